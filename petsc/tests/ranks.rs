//! What holds on one rank and on several: run it by `cargo test -p rkpm-petsc`, and under `mpirun -n 2` as `.ci/run` does.
//!
//! A program of its own without the test harness: MPI starts once in a process, on one thread.

use rkpm::assembly::Ranks;
use rkpm::prelude::*;
use rkpm::scene::ConstraintMethod;
use rkpm_petsc::{Gamg, Mumps, Session};

type Outcome = Result<(), Box<dyn std::error::Error>>;
type Test = fn(&Session) -> Outcome;

fn main() -> Outcome {
    let session = Session::start()?;
    let tests: [(&str, Test); 15] = [
        ("contract of solvers", contract),
        ("Cook's membrane", membrane),
        ("a cube with uneven zones", uneven_cube),
        ("a cube held by multipliers", held_cube),
        ("a strip bent by pressure", bent_strip),
        ("a mount from a file", mount),
        ("a scattered plate", scattered),
        ("finite elements", elements),
        ("a tube in one dimension", tube),
        ("two bonded bodies", bonded),
        ("a rigid plate that is turned", turned),
        ("a cube by iteration", iterated),
        ("a pressed pad by iteration", pressed),
        ("contact with friction", touching),
        ("what is refused", refused),
    ];
    let mut failed = 0;
    for (name, test) in tests {
        let outcome = test(&session);
        if let Err(error) = &outcome {
            eprintln!("rank {}: {name}: {error}", session.rank());
            failed += 1;
        }
    }
    if session.rank() == 0 {
        println!("{} ranks: {} passed, {failed} failed", session.count(), tests.len() - failed);
    }
    if failed > 0 { session.abort(1) } else { Ok(()) }
}

fn ensure(holds: bool, what: impl std::fmt::Display) -> Outcome {
    if holds { Ok(()) } else { Err(what.to_string().into()) }
}

/// On one rank: what the checks of the crate ask of any solver.
fn contract(session: &Session) -> Outcome {
    if session.count() > 1 {
        return Ok(());
    }
    let report = rkpm::check::solver(&Mumps::new(session));
    ensure(report.holds(), format!("{report}"))
}

/// Displacements, energies and reactions of a scene on all ranks, beside those of one process.
fn agrees<const D: usize>(session: &Session, scene: &Scene<D>, scheme: &Scheme, part: impl Into<Place<D>>) -> Outcome {
    let part = part.into();
    let alone = scene.discretize(scheme)?;
    let expected = alone.run()?.completed()?;
    let shared = scene.discretize(&scheme.clone().solver(Mumps::new(session)))?;
    let found = shared.run()?.completed()?;
    let (a, b) = (expected.last(), found.last());
    let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
    let displacement = distance(&a.displacement, &b.displacement) / largest(&a.displacement);
    let (energy, other) = (alone.energy(a).unwrap(), shared.energy(b).unwrap());
    let energy = (energy / other - 1.0).abs();
    let (force, other) = (alone.reaction(a, part.clone())?, shared.reaction(b, part)?);
    let reaction = distance(force.as_slice(), other.as_slice()) / largest(force.as_slice());
    let [j, other] =
        [(&alone, a), (&shared, b)].map(|(problem, state)| problem.model().at(state).unwrap().smallest_jacobian());
    let (Some((j, _)), Some((other, _))) = (j, other) else { return Err("no determinant".into()) };
    let jacobian = (j / other - 1.0).abs();
    if session.rank() == 0 {
        println!("  displacement {displacement:.1e}, energy {energy:.1e}, reaction {reaction:.1e}, J {jacobian:.1e}");
    }
    ensure(displacement <= TOLERANCE, format!("displacements differ by {displacement:e} of the largest"))?;
    ensure(energy <= TOLERANCE, format!("energies differ by {energy:e}"))?;
    ensure(reaction <= TOLERANCE, format!("reactions differ by {reaction:e}"))?;
    ensure(jacobian <= TOLERANCE, format!("smallest J differ by {jacobian:e}"))?;
    let (steps, other) = (expected.steps.len(), found.steps.len());
    ensure(expected.iterations == found.iterations && steps == other, "iterations or steps differ")?;
    if session.count() > 1 {
        // No rank holds all zones.
        let (all, own) = (alone.body().table().point_count() as f64, shared.body().table().point_count() as f64);
        ensure(own <= all * 1.5 / session.count() as f64, format!("a rank holds {own} of {all} points"))?;
        let mut total = [own];
        session.sum(&mut total);
        ensure(total[0] == all, format!("all ranks hold {} points of {all}", total[0]))?;
    }
    Ok(())
}

/// Bound on differences: those of rounding in sums of other order, times the condition of nearly incompressible bodies.
const TOLERANCE: f64 = 1e-10;

fn membrane(session: &Session) -> Outcome {
    let shape = Quadrilateral { corners: [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] };
    let rubber = Rubber::neo_hookean(40.097, 4e5)?;
    let scene = Scene::new(shape, PlaneStrain, rubber).hold((0, Side::Min)).traction((0, Side::Max), [0.0, 6.25]);
    agrees(session, &scene, &Scheme::default().particles([9, 9]), (0, Side::Min))
}

/// Uneven zones, conditions by transformation.
fn uneven_cube(session: &Session) -> Outcome {
    cube(session, &Scheme::default().particles([6]))
}

/// Conditions by multipliers.
fn held_cube(session: &Session) -> Outcome {
    cube(session, &Scheme::default().particles([5]).constraint_method(ConstraintMethod::Multipliers))
}

fn cube(session: &Session, scheme: &Scheme) -> Outcome {
    let rubber = Rubber::neo_hookean(40.097, 400_889.8)?;
    let scene = Scene::new(Block::new([0.0; 3], [10.0; 3]), Solid, rubber)
        .hold((2, Side::Min))
        .prescribe((2, Side::Max), 0, 3.0)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.0);
    agrees(session, &scene, scheme, (2, Side::Max))
}

/// Pressure that follows a free end: a skew part.
fn bent_strip(session: &Session) -> Outcome {
    let rubber = Rubber::neo_hookean(0.5, 1e3)?;
    let scene = Scene::new(Block::new([0.0, 0.0], [6.0, 1.0]), PlaneStrain, rubber)
        .hold((0, Side::Min))
        .pressure((1, Side::Max), 0.01);
    agrees(session, &scene, &Scheme::default().particles([25, 5]), (0, Side::Min))
}

fn rubber(ratio: f64) -> Result<Rubber, rkpm::Error> {
    Ok(Rubber::neo_hookean(0.5, ratio)?)
}

/// A part of tetrahedra, as the file has it: the base held, the insert pressed down.
fn mount(session: &Session) -> Outcome {
    let mesh = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/meshes/mount.msh"))?;
    let scene = Scene::new(mesh.body("rubber")?, Solid, rubber(1e3)?)
        .hold("base")
        .prescribe("middle", 1, 0.0)
        .with(Condition::on("insert").displacement([0.0, 0.0, -1.0]));
    agrees(session, &scene, &Scheme::default(), "insert")
}

fn scattered(session: &Session) -> Outcome {
    let plate = Outline::at([0.0, 0.0])
        .line("bottom", [4.0, 0.0])
        .line("right", [4.0, 1.0])
        .line("top", [0.0, 1.0])
        .close("left");
    let scene = Scene::new(Region::new(plate)?, PlaneStrain, rubber(1e3)?)
        .hold("left")
        .traction("right", [0.0, 0.01])
        .with(Load::body_force([0.0, -1e-3]));
    agrees(session, &scene, &Scheme::default().spacing(0.25).seed(7), "left")
}

fn elements(session: &Session) -> Outcome {
    let scene = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, rubber(1e3)?)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 0.0, 0.02]);
    agrees(session, &scene, &Scheme::elements(2).particles([9, 5, 5]), (0, Side::Min))
}

fn tube(session: &Session) -> Outcome {
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber(1e3)?).pressure(Side::Min, 0.1).prescribe(
        Side::Max,
        0,
        0.0,
    );
    agrees(session, &scene, &Scheme::default().particles([9]), Side::Max)
}

/// Rows between bodies.
fn bonded(session: &Session) -> Outcome {
    let scene = Scene::assembly(PlaneStrain)
        .body("soft", Block::new([0.0, 0.0], [2.0, 1.0]), rubber(1e2)?)
        .body("stiff", Block::new([0.0, 1.0], [2.0, 1.5]), Rubber::neo_hookean(5.0, 1e3)?)
        .hold(Place::on((1, Side::Min)).of("soft"))
        .with(Condition::on(Place::on((1, Side::Max)).of("stiff")).displacement([0.3, -0.05]));
    agrees(session, &scene, &Scheme::default().particles([9, 5]), Place::on((1, Side::Min)).of("soft"))
}

/// Terms that one rank alone sums.
fn turned(session: &Session) -> Outcome {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e2)?)
        .hold((0, Side::Min))
        .rigid("plate", (0, Side::Max))
        .with(Load::moment("plate", [0.0, 0.0, 0.02]))
        .with(Load::force((1, Side::Max), [0.0, -0.01]));
    agrees(session, &scene, &Scheme::default().particles([9, 5]), (0, Side::Min))
}

/// A shaft that rubs along a block that stands on another one, which it may leave.
fn touching(session: &Session) -> Outcome {
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber(1e2)?)
        .body("upper", Block::new([0.3, 1.0], [1.5, 1.5]), rubber(1e2)?)
        .hold(Place::on((1, Side::Min)).of("lower"))
        .with(
            ContactPair::between(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "joint")
                .friction(0.5),
        )
        .contact(
            Place::on((1, Side::Max)).of("upper"),
            RigidSurface::shaft([0.9, 2.0], 0.5).moving([0.05, -0.2]).friction(0.3).named("shaft"),
        );
    agrees(session, &scene, &Scheme::default().particles([9, 5]), Place::on((1, Side::Min)).of("lower"))
}

/// On several ranks: rules whose points belong to no cells.
fn refused(session: &Session) -> Outcome {
    if session.count() == 1 {
        return Ok(());
    }
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e2)?).hold((0, Side::Min));
    let scheme = Scheme::default().particles([5, 3]).rule(Rule::Scni).solver(Mumps::new(session));
    ensure(scene.discretize(&scheme).is_err(), "a rule over the cells of particles was not refused")
}

/// Krylov iteration with PETSc's multigrid, beside factors: as the tolerance of the iteration allows.
fn iterated(session: &Session) -> Outcome {
    let scene = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, rubber(1e3)?)
        .hold((2, Side::Min))
        .prescribe((2, Side::Max), 0, 0.2)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.0);
    iterates(session, &scene)
}

/// Contact is in the system that PETSc's multigrid conditions.
fn pressed(session: &Session) -> Outcome {
    let ball = RigidSurface::sphere([1.0, 1.0, 3.0], 2.0).moving([0.0, 0.0, -0.2]);
    let scene = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, rubber(1e3)?)
        .hold((2, Side::Min))
        .contact((2, Side::Max), ball);
    iterates(session, &scene)
}

/// Displacements, energies and reactions of a block with its lower face held, by iteration beside those by factors.
fn iterates(session: &Session, scene: &Scene<3>) -> Outcome {
    let scheme = Scheme::default().particles([9, 9, 5]);
    let alone = scene.discretize(&scheme)?;
    let expected = alone.run()?.completed()?;
    let shared = scene.discretize(&scheme.solver(Gamg::new(session)))?;
    let found = shared.run()?.completed()?;
    let (a, b) = (expected.last(), found.last());
    let error = a.displacement.iter().zip(&b.displacement).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
    let energy = (alone.energy(a).unwrap() / shared.energy(b).unwrap() - 1.0).abs();
    let [force, other] = [alone.reaction(a, (2, Side::Min))?, shared.reaction(b, (2, Side::Min))?];
    let reaction = (force - other).norm() / other.norm();
    let krylov_iterations = shared.analysis().solver.krylov_iterations();
    if session.rank() == 0 {
        println!(
            "  displacement {error:.1e}, energy {energy:.1e}, reaction {reaction:.1e}, Krylov iterations {krylov_iterations:?}"
        );
    }
    ensure(error <= 1e-6 && energy <= 1e-6 && reaction <= 1e-6, "the iteration found another state")?;
    ensure(
        !krylov_iterations.is_empty() && krylov_iterations.iter().all(|&d| d <= 45),
        format!("Krylov iterations {krylov_iterations:?}"),
    )
}
