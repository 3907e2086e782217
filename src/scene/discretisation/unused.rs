//! Settings of a scheme that no body of a scene could follow.

use std::sync::Arc;

use crate::cells::{Layout, Scatter};
use crate::error::Incompatible;

use crate::scene::{
    ApproximationChoice, BodyOf, Dilation, Partition, PressureScheme, Rule, Scene, Scheme, SolverChoice, Source,
};

/// A setting, whether a scheme has it otherwise than another one, and which bodies follow it.
struct Setting<const D: usize> {
    name: &'static str,
    differs: fn(&Scheme, &Scheme) -> bool,
    /// Also those that are documented to leave it out.
    follows: fn(&Source<D>, &Scheme) -> bool,
    /// What it can't be combined with, where that is not the body's source.
    with: Option<&'static str>,
    remedy: &'static str,
}

/// Of particles and their cells.
fn of_cells<const D: usize>() -> [Setting<D>; 6] {
    let scattered: fn(&Source<D>, &Scheme) -> bool = |source, _| matches!(source, Source::Scattered(_));
    let planar: fn(&Source<D>, &Scheme) -> bool = |source, _| D == 2 && matches!(source, Source::Scattered(_));
    [
        Setting {
            name: "a number or spacing of particles",
            differs: |a, b| a.resolution != b.resolution,
            follows: |source, _| matches!(source, Source::Domain(_) | Source::Scattered(_) | Source::Cells(_)),
            with: None,
            remedy: "particles are the nodes of a mesh: mesh the part finer, or call Mesh::refined",
        },
        Setting {
            name: "Scheme::layout",
            differs: |a, b| !same_layout(&a.layout, &b.layout),
            follows: |source, _| matches!(source, Source::Domain(_) | Source::Cells(_)),
            with: None,
            remedy: "layouts are those of blocks and mapped blocks; over regions Scheme::graded says where particles are finer",
        },
        Setting {
            name: "Scheme::graded",
            differs: |a, b| !is_same(&a.grading, &b.grading),
            follows: scattered,
            with: None,
            remedy: "it is for planar regions and solids; blocks take Scheme::layout with Layout::Graded, meshes are graded by the mesher",
        },
        Setting {
            name: "Scheme::across",
            differs: |a, b| a.across != b.across,
            follows: |source, _| D == 3 && matches!(source, Source::Scattered(_)),
            with: None,
            remedy: "only lattices in solids are refined across walls: leave it out",
        },
        Setting {
            name: "Scheme::seed or Scheme::scatter",
            differs: |a, b| a.scatter != b.scatter,
            follows: planar,
            with: None,
            remedy: "only planar regions have scattered particles; Layout::Jittered has a seed of its own",
        },
        Setting {
            name: "Scheme::partition",
            differs: |a, b| a.partition != b.partition,
            follows: planar,
            with: None,
            remedy: "only planar regions have a choice of cells",
        },
    ]
}

/// Of functions, pressures and the solution.
fn of_functions<const D: usize>() -> [Setting<D>; 4] {
    [
        Setting {
            name: "Scheme::dilation, rcond_limit or kernel",
            differs: |a, b| {
                a.dilation != b.dilation || a.rcond_limit != b.rcond_limit || !is_same(&a.kernel, &b.kernel)
            },
            follows: |_, scheme| scheme.approximation == ApproximationChoice::Particles,
            with: Some("finite elements"),
            remedy: "finite elements have no supports: leave it out, or take ApproximationChoice::Particles",
        },
        Setting {
            name: "Scheme::pressure_field with zones of several elements",
            differs: |a, b| zone(a) != zone(b),
            follows: |_, scheme| scheme.approximation == ApproximationChoice::Particles || zone(scheme) <= 1,
            with: Some("finite elements"),
            remedy: "a zone of finite elements is one element: give the size 1",
        },
        Setting {
            name: "Scheme::pressure_field with zones of several cells",
            differs: |a, b| zone(a) != zone(b),
            follows: |_, scheme| zone(scheme) <= 1 || !has_zones(&scheme.rule),
            with: Some("an integration rule with zones of its own"),
            remedy: "pressures are those of its zones: give the size 1, or take Rule::Auto or Rule::Smoothed",
        },
        Setting {
            name: "solution by Krylov iteration",
            differs: |a, b| a.solver_choice != b.solver_choice,
            follows: |_, scheme| {
                scheme.approximation == ApproximationChoice::Particles || scheme.solver_choice != SolverChoice::Krylov
            },
            with: Some("finite elements"),
            remedy: "take SolverChoice::Auto, which takes factors",
        },
    ]
}

/// Whether pressures stand on zones that follow from the rule alone.
fn has_zones(rule: &Rule) -> bool {
    matches!(rule, Rule::Scni | Rule::Nodal | Rule::Gauss { zones: Some(_), .. })
}

/// Cells per direction of a zone of pressure.
fn zone(scheme: &Scheme) -> usize {
    if let PressureScheme::Field { size, .. } = scheme.pressure { size } else { 1 }
}

/// Whether a body's own scheme asks for no solution of its own. One that replaces that of the scene has the defaults of what is not set.
fn solves_alike(own: &Scheme, of: &Scheme) -> bool {
    let solution = |scheme: &Scheme| (scheme.newton, scheme.stepping, scheme.constraint_method);
    let same = |solver| of.solver.as_ref().is_some_and(|other| Arc::ptr_eq(solver, other));
    [of, &Scheme::default()].iter().any(|other| solution(own) == solution(other))
        && own.solver.as_ref().is_none_or(same)
}

fn is_same<T: ?Sized>(a: &Option<Arc<T>>, b: &Option<Arc<T>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    }
}

fn same_layout(a: &Layout, b: &Layout) -> bool {
    match (a, b) {
        (Layout::Regular, Layout::Regular) => true,
        (Layout::Graded(a), Layout::Graded(b)) => Arc::ptr_eq(a, b),
        (Layout::Jittered { amount, seed }, Layout::Jittered { amount: other, seed: others }) => {
            amount == other && seed == others
        }
        _ => false,
    }
}

/// What is not set.
fn plain(scheme: &Scheme) -> Scheme {
    Scheme {
        resolution: None,
        layout: Layout::Regular,
        grading: None,
        across: 0,
        scatter: Scatter::default(),
        partition: Partition::default(),
        dilation: Dilation::Auto,
        rcond_limit: None,
        kernel: None,
        pressure: PressureScheme::Auto,
        solver_choice: SolverChoice::Auto,
        ..scheme.clone()
    }
}

/// Refuses settings of a scheme that no body of the scene follows, and those of a body's own scheme that it does not
/// follow itself; `own` are the schemes of the bodies.
pub(crate) fn refuse<const D: usize>(scene: &Scene<D>, scheme: &Scheme, own: &[Scheme]) -> Result<(), Incompatible> {
    for (body, own) in scene.bodies.iter().zip(own) {
        ensure!(
            !scene.has_scheme_of(&body.name) || solves_alike(own, scheme),
            Incompatible::new(
                "Scheme::newton, stepping, constraint_method or solver",
                "the scheme of one body",
                "all bodies are solved together: give it in the scheme of the scene"
            )
        );
    }
    let plain = plain(scheme);
    for Setting { name, differs, follows, with, remedy } in of_cells::<D>().into_iter().chain(of_functions::<D>()) {
        let taken = |body: &BodyOf<D>, scheme: &Scheme| follows(&body.source, scheme);
        let all = || scene.bodies.iter().zip(own);
        let of_scene = differs(scheme, &plain) && !all().any(|(body, own)| taken(body, own));
        let of_body = all().find(|(body, own)| differs(own, scheme) && differs(own, &plain) && !taken(body, own));
        if let Some((body, _)) = of_body.or_else(|| all().next().filter(|_| of_scene)) {
            let source = match &body.source {
                Source::Domain(_) => "a block or mapped block",
                Source::Cells(_) => "given cells",
                Source::Scattered(_) if D == 3 => "a solid",
                Source::Scattered(_) => "a planar region",
                Source::Mesh(_) => "a mesh",
            };
            return Err(Incompatible::new(name, with.unwrap_or(source), remedy));
        }
    }
    Ok(())
}
