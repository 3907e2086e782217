//! From scene and scheme to a problem.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::assembly::Model;
use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation, Unaugmented};
use crate::cells::members;
use crate::compiled::compiled;
use crate::each::{Each, EachOf, IntoEach};
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::{Point, all_padded, padded};
use crate::linear::{Direct, Krylov};
use crate::material::Material;
use crate::order;
use crate::solve::Analysis;
use crate::table::ShapeTable;
use crate::term::{FollowerPressure, Integrand, Pointwise};

use super::body_cells::all_cells;
use super::bond::{are_bonded_at, bond_all};
use super::conditions::{Nowhere, Refused, particle_at};
use super::contact::{contact_definition, hold_free, rigid_dof_count};
use super::discrete_body::DiscreteBody;
use super::elements::elements;
use super::frame::RigidFrame;
use super::neutral::hold_rolling;
use super::one_body::{BodyInput, BuiltBody};
use super::particles::particles;
use super::problem::{LoadTerms, Problem};
use super::rigid;
use super::sharing::Sharing;
use crate::scene::definition::validate::is_finite_over;
use crate::scene::results::free_motions::unheld;
use crate::scene::results::view::ProblemView;
use crate::scene::{
    ApproximationChoice, BodyCells, ConstraintMethod, Load, LoadKind, OnSheet, Place, Scene, Scheme, Sheet, Spot,
    Value, Varying, dead,
};

/// Rows up to which the mixed transformation is the default: beyond, its dense faces cost more than multipliers.
const TRANSFORMATION_ROWS: usize = 600;

impl<const D: usize> Scene<D> {
    /// Turns the scene into a problem under a scheme.
    ///
    /// # Errors
    /// Any bad input of scene or scheme: geometry, particles, supports, selections, rows, loads.
    pub fn discretize(&self, scheme: &Scheme) -> Result<Problem<D>, Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<Problem<D>, Error> {
            scene.validate()?;
            discretize(scene, scheme, &mut Err)
        })
    }

    /// As [`discretize`](Scene::discretize) without the conditions that can't be taken, and why not.
    pub(crate) fn discretize_leniently(&self, scheme: &Scheme) -> Result<(Problem<D>, Vec<Error>), Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<(Problem<D>, Vec<Error>), Error> {
            scene.validate()?;
            let mut refused = Vec::new();
            let problem = discretize(scene, scheme, &mut |error| {
                refused.push(error);
                Ok(())
            })?;
            Ok((problem, refused))
        })
    }
}

pub(crate) fn discretize<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    refused: Refused<'_>,
) -> Result<Problem<D>, Error> {
    let all = all_cells(scene, scheme)?;
    let sharing = Sharing::of(scheme, &all)?;
    let mut conditions: Vec<Vec<(usize, Place<D>)>> = vec![Vec::new(); scene.bodies.len()];
    let (mut loads, mut ties) = (conditions.clone(), conditions.clone());
    for (number, condition) in scene.conditions.iter().enumerate() {
        let what = || condition.name.clone().unwrap_or_else(|| format!("condition on {}", condition.place));
        let has = |at: &Point<D>| {
            let bodies = 0..all.len();
            bodies.filter(|body| particle_at(&*all[*body].1, at, "").is_ok()).collect()
        };
        distribute(scene, &all, (number, &condition.place), &what, &has, &mut conditions)?;
    }
    for (number, load) in scene.loads.iter().enumerate() {
        let has = |at: &Point<D>| members(all.iter().map(|(_, cells)| &**cells), at);
        distribute(scene, &all, (number, &load.place), &|| load.label(), &has, &mut loads)?;
    }
    for (number, (name, place)) in scene.rigids.iter().enumerate() {
        for body in scene.bodies_at(&scene.resolve(place), &|| format!("rigid body {name}"), &all, &|_| true)? {
            ties[body].push((number, scene.resolve(place)));
        }
    }
    let particles_of_all: usize = all.iter().map(|(_, cells)| cells.positions().len()).sum();
    let total = particles_of_all + rigid_dof_count(scene) + scene.rigid_names().len() * (D + 1);
    let mut first = 0;
    let (mut built, mut nowhere) = (Vec::with_capacity(scene.bodies.len()), <[Nowhere; 3]>::default());
    for (number, body) in scene.bodies.iter().enumerate() {
        let (scheme, cells) = (&all[number].0, all[number].1.clone());
        let (conditions, loads, ties) = (&conditions[number], &loads[number], &ties[number]);
        let of = BodyInput { scene, body, scheme, cells, conditions, loads, ties, first, total, sharing: &sharing };
        first += of.cells.positions().len();
        let mut own = match scheme.approximation {
            ApproximationChoice::Particles => particles(&of, refused)?,
            ApproximationChoice::Elements => elements(&of, refused)?,
        };
        nowhere.iter_mut().zip(&mut own.nowhere).for_each(|(all, own)| all.append(own));
        built.push(own);
    }
    let [idle, untied, unloaded] = nowhere;
    refuse_nowhere(&conditions, idle, refused)?;
    refuse_nowhere(&ties, untied, &mut Err)?;
    refuse_nowhere(&loads, unloaded, &mut Err)?;
    finish(scene, scheme, &all, built, &sharing)
}

/// Refuses what selects nothing on any of the bodies that it is given to.
fn refuse_nowhere<const D: usize>(
    given: &[Vec<(usize, Place<D>)>],
    nowhere: Nowhere,
    refused: Refused<'_>,
) -> Result<(), Error> {
    let mut left: HashMap<usize, usize> = HashMap::new();
    given.iter().flatten().for_each(|(number, _)| *left.entry(*number).or_default() += 1);
    for (number, error) in nowhere {
        let left = left.entry(number).or_default();
        *left = left.saturating_sub(1);
        if *left == 0 {
            refused(error)?;
        }
    }
    Ok(())
}

/// Gives a condition or load to the bodies at its place, at points to the one that has them; rigid bodies come later.
fn distribute<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    (number, place): (usize, &Place<D>),
    what: &dyn Fn() -> String,
    has: &dyn Fn(&Point<D>) -> Vec<usize>,
    given: &mut [Vec<(usize, Place<D>)>],
) -> Result<(), Error> {
    let place = scene.resolve(place);
    if scene.rigid_at(&place).is_some() {
        return Ok(());
    }
    let having = match (&place.spot, &place.of) {
        (Spot::Point(at), None) => has(at),
        _ => Vec::new(),
    };
    if let (Spot::Point(at), [_, _, ..]) = (&place.spot, &having[..])
        && !are_bonded_at(scene, all, &having, at)?
    {
        let known = having.mapped(|body| &*scene.bodies[*body].name).join("; ");
        return Err(BoundaryError::Ambiguous { what: what(), known }.into());
    }
    for body in scene.bodies_at(&place, what, all, &|body| having.first() == Some(&body))? {
        given[body].push((number, place.clone()));
    }
    Ok(())
}

/// Adds a load over a table of its place, `measure` being that of the place on all bodies.
fn add_load<const D: usize>(
    model: &mut Model,
    load: &Load<D>,
    table: ShapeTable<D>,
    measure: f64,
    sheet: Option<Sheet<D>>,
) -> Result<(), Error> {
    let amplitude = load.amplitude.clone();
    let varying = |value: &Value<D>| Varying { value: value.clone(), amplitude: amplitude.clone() };
    let integrand: Arc<dyn Integrand> = match (&load.kind, sheet) {
        (LoadKind::Dead(Value::Constant(force)), _) => Arc::new(dead(force, &amplitude)),
        (LoadKind::Dead(value), _) => Arc::new(Varying { value: value.clone(), amplitude }),
        (LoadKind::Total(force), _) => Arc::new(dead(&force.each(|f| f / measure), &amplitude)),
        (LoadKind::Pressure(Value::Constant(pressure)), None) => {
            Arc::new(FollowerPressure { pressure: *pressure, amplitude })
        }
        (LoadKind::Pressure(value), None) => Arc::new(varying(value)),
        (LoadKind::Pressure(value), Some(sheet)) => Arc::new(OnSheet { load: Arc::new(varying(value)), sheet }),
        (LoadKind::Integrand(integrand), Some(sheet)) => {
            let reads = integrand.sparsity();
            let remedy = "the stretch across follows from the law alone: make it part of the law, or take a body in 3D";
            ensure!(!reads.stress, Incompatible::new(load.label(), "a sheet in plane stress", remedy));
            match reads.force_by_gradient {
                true => Arc::new(OnSheet { load: integrand.clone(), sheet }),
                false => integrand.clone(),
            }
        }
        (LoadKind::Integrand(integrand), None) => integrand.clone(),
        // Refused with its table.
        (LoadKind::Moment(_), _) => return Ok(()),
    };
    model.add(Pointwise::shared(table, integrand));
    Ok(())
}

/// Adds the loads over their tables, each with its number in the scene: their terms, in the order of the scene.
fn add_loads<const D: usize>(
    scene: &Scene<D>,
    mut tables: Vec<(usize, ShapeTable<D>)>,
    discrete_bodies: &[DiscreteBody<D>],
    sharing: &Sharing,
    model: &mut Model,
) -> Result<Vec<LoadTerms>, Error> {
    order::sort(&mut tables, &|a, b| a.0.cmp(&b.0));
    let mut measures = vec![0.0; scene.loads.len()];
    tables.iter().for_each(|(number, table)| measures[*number] += table.weights().iter().sum::<f64>());
    sharing.total(&mut measures);
    let mut loads: Vec<(usize, LoadTerms)> = Vec::new();
    for (number, table) in tables {
        let node = table.clusters().nodes(0).first().map_or(0, |node| *node as usize);
        let own = discrete_bodies.iter().find(|body: &&DiscreteBody<D>| body.nodes.contains(&node));
        let sheet = own.and_then(|body| body.sheet.clone());
        let (load, term) = (&scene.loads[number], model.terms().len());
        is_finite_over(load, table.positions())?;
        ensure!(
            !matches!(load.kind, LoadKind::Total(_)) || measures[number] > 0.0,
            Incompatible::new(
                load.label(),
                "a place without area or volume, as the axis of revolution is",
                "give it to a point by Place::at, or to a part off the axis"
            )
        );
        add_load(model, load, table, measures[number], sheet)?;
        match loads.last_mut().filter(|(last, _)| *last == number) {
            Some((_, of)) => of.terms.end = model.terms().len(),
            None => loads.push((number, LoadTerms::of(load, term..model.terms().len()))),
        }
    }
    Ok(loads.into_mapped(|(_, terms)| terms))
}

/// Puts the bodies together, bonds them where they share faces, and binds the strategies.
fn finish<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    all: &BodyCells<D>,
    built: Vec<BuiltBody<D>>,
    sharing: &Sharing,
) -> Result<Problem<D>, Error> {
    let mut positions: Vec<Point<3>> = Vec::new();
    for body in &built {
        positions.extend(body.discrete_body.cells.positions().iter().map(padded::<D, 3>));
    }
    let particles = positions.len();
    // The nodes of surfaces that are pushed or free to turn stand behind those of the particles, and where the last of these is.
    if let Some(&last) = positions.last() {
        positions.resize(particles + rigid_dof_count(scene), last);
    }
    let (mut equations, mut placed, mut ties, mut krylov) = (Constraints::default(), Vec::new(), Vec::new(), None);
    let (mut discrete_bodies, mut rules, mut tables) = (Vec::new(), Vec::new(), Vec::new());
    let mut at_ties = Vec::new();
    for BuiltBody {
        discrete_body,
        facets,
        equations: own,
        placed: mine,
        loads,
        ties: tied,
        at_ties: own_at_ties,
        krylov: own_krylov,
        ..
    } in built
    {
        let (equation, node) = (equations.len(), discrete_body.nodes.start);
        krylov = own_krylov;
        let shifted = |range: Range<usize>, by: usize| range.start + by..range.end + by;
        if discrete_bodies.is_empty() {
            equations = own;
        } else {
            equations.append(own, node, D);
        }
        for mut own in mine {
            (own.equations, own.nodes) = (shifted(own.equations, equation), shifted(own.nodes, node));
            placed.push(own);
        }
        ties.extend(tied.into_iter().map(|(number, range)| (number, shifted(range, equation))));
        at_ties.extend(own_at_ties);
        discrete_bodies.push(discrete_body);
        rules.push(facets);
        tables.extend(loads);
    }
    let bonded = bond_all(scene, all, &discrete_bodies, &rules, &mut equations, &mut placed)?;
    let mut frames = rigid::frames(scene, all, (&ties, &at_ties), &mut equations, &mut placed, &mut positions)?;
    let mut model = model_of(scene, &positions, &discrete_bodies, sharing)?;
    let loads = sharing.agreed(add_loads(scene, tables, &discrete_bodies, sharing, &mut model))?;
    add_frames(scene, &discrete_bodies, &mut frames, &mut model)?;
    let parts = ProblemView::of(&model, &equations, &discrete_bodies, &frames);
    let free = free_nodes(scene, &parts, particles, krylov.is_some())?;
    rigid::held(scene, &frames, &free)?;
    let contacts =
        contact_definition(scene, all, (&discrete_bodies, &rules), &equations, &positions[..particles], &mut model)?;
    if !contacts.is_empty() {
        hold_free(&free, &discrete_bodies, sharing, &mut model);
    }
    let rolling = hold_rolling(scene, &discrete_bodies, sharing, &equations, &contacts, &mut model);
    let elements = discrete_bodies.len() == 1 && scheme.approximation == ApproximationChoice::Elements;
    let few = equations.len() <= TRANSFORMATION_ROWS || elements;
    let analysis = analysis_of(scheme, !bonded && frames.is_empty() && few, krylov)?;
    Ok(Problem {
        model,
        equations,
        analysis,
        discrete_bodies,
        loads,
        contacts,
        rolling,
        frames,
        placed,
        names: scene.names.clone(),
    })
}

/// The nodes that nothing holds, or contact alone, where a scene has contacts or rigid bodies.
fn free_nodes<const D: usize>(
    scene: &Scene<D>,
    parts: &ProblemView<'_>,
    particles: usize,
    iterative: bool,
) -> Result<Vec<u32>, Error> {
    if !scene.has_contact() && parts.frames.is_empty() {
        return Ok(Vec::new());
    }
    let free = unheld(parts, particles as u32..(particles + rigid_dof_count(scene)) as u32);
    if scene.has_contact() && iterative && !free.is_empty() {
        let remedy = "fix it by conditions, or take SolverChoice::Auto";
        return Err(
            Incompatible::new("solution by Krylov iteration", "a body that only contact supports", remedy).into()
        );
    }
    Ok(free)
}

/// The analysis of a scheme, by transformation where that is chosen, or left to choose and `transformable`.
fn analysis_of(scheme: &Scheme, transformable: bool, krylov: Option<Krylov>) -> Result<Analysis, Error> {
    let transform = match scheme.constraint_method {
        ConstraintMethod::Auto => transformable,
        ConstraintMethod::Transformation => true,
        ConstraintMethod::Multipliers => false,
    };
    let mut analysis = if transform {
        Analysis::new(MixedTransformation::default(), Direct::default())
    } else {
        Analysis::new(LagrangeMultipliers, Direct::default())
    };
    if let Some(solver) = &scheme.solver {
        if krylov.is_none() && solver.preconditioner(&[]).is_some() {
            let remedy = "take a direct solver, or one body of particles on a lattice in 3D";
            return Err(Incompatible::new("a solver that only preconditions", "these cells", remedy).into());
        }
        analysis.solver = solver.fresh();
    }
    if let Some(krylov) = krylov {
        let replaceable = krylov.replaceable;
        let iterative = Analysis::new(Unaugmented, krylov);
        let factors = std::mem::replace(&mut analysis, iterative);
        analysis.factors = replaceable.then(|| Box::new(factors));
    }
    analysis.newton = scheme.newton;
    analysis.stepping = scheme.stepping;
    Ok(analysis)
}

/// A model of the bodies, with the clock of the scene.
fn model_of<const D: usize>(
    scene: &Scene<D>,
    positions: &[Point<3>],
    discrete_bodies: &[DiscreteBody<D>],
    sharing: &Sharing,
) -> Result<Model, Error> {
    let mut model = Model::new(&all_padded::<3, D>(positions));
    model.set_clock(scene.clock.clone())?;
    if let Some(ranks) = sharing.ranks() {
        model.share(ranks);
    }
    discrete_bodies.iter().for_each(|own| _ = model.add_shared(own.body.clone()));
    Ok(model)
}

/// Adds what keeps the shapes of rigid bodies, and the loads on them.
fn add_frames<const D: usize>(
    scene: &Scene<D>,
    discrete_bodies: &[DiscreteBody<D>],
    frames: &mut [RigidFrame],
    model: &mut Model,
) -> Result<(), Error> {
    let modulus =
        |discrete_body: &DiscreteBody<D>| discrete_body.body.material().response(&Matrix3::identity()).tangent[(0, 0)];
    let shear = |discrete_body: &DiscreteBody<D>| discrete_body.body.material().initial_moduli().shear;
    let turned = scene.kinematics.hoop_components().is_empty();
    for frame in frames.iter_mut().filter(|_| turned) {
        frame.rigidity = Some(model.terms().len());
        let rigidity = frame.stay(discrete_bodies.largest(modulus), discrete_bodies.largest(shear));
        model.add_replicated(Arc::new(rigidity));
    }
    for load in &scene.loads {
        if let Some((number, point)) = scene.rigid_at(&scene.resolve(&load.place)) {
            frames[number].load(model, load, point, !turned)?;
        }
    }
    Ok(())
}
