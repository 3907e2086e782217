//! Scenes solved by MUMPS beside the crate's own factors: `cargo test -p rkpm-petsc`.
//!
//! A program of its own without the test harness: MPI starts once in a process, on one thread.

use rkpm::prelude::*;
use rkpm_petsc::{Mumps, Session};

type Outcome = Result<(), Box<dyn std::error::Error>>;
type Test = fn(&Session) -> Outcome;

fn main() -> Outcome {
    let session = Session::start()?;
    let tests: [(&str, Test); 5] = [
        ("contract of solvers", contract),
        ("Cook's membrane", membrane),
        ("a cube with uneven zones", uneven_cube),
        ("a cube held by multipliers", held_cube),
        ("a strip bent by pressure", bent_strip),
    ];
    let mut failed = 0;
    for (name, test) in tests {
        let outcome = test(&session);
        if let Err(error) = &outcome {
            eprintln!("{name}: {error}");
            failed += 1;
        }
    }
    println!("{} passed, {failed} failed", tests.len() - failed);
    if failed > 0 { session.abort(1) } else { Ok(()) }
}

fn ensure(holds: bool, what: impl std::fmt::Display) -> Outcome {
    if holds { Ok(()) } else { Err(what.to_string().into()) }
}

/// What the checks of the crate ask of any solver.
fn contract(session: &Session) -> Outcome {
    let report = rkpm::check::solver(&Mumps::new(session));
    ensure(report.holds(), format!("{report}"))
}

/// Displacements, energies and reactions of a scene by MUMPS, beside those by the crate's own factors.
fn agrees<const D: usize>(session: &Session, scene: &Scene<D>, scheme: &Scheme, part: (usize, Side)) -> Outcome {
    let alone = scene.discretize(scheme)?;
    let expected = alone.run(&mut ())?.completed()?;
    let shared = scene.discretize(&scheme.clone().solver(Mumps::new(session)))?;
    let found = shared.run(&mut ())?.completed()?;
    let (a, b) = (expected.last(), found.last());
    let size = a.displacement.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let error = a.displacement.iter().zip(&b.displacement).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs())) / size;
    ensure(error <= TOLERANCE, format!("displacements differ by {error:e} of the largest"))?;
    let (energy, other) = (alone.energy(a), shared.energy(b));
    ensure((energy / other - 1.0).abs() <= TOLERANCE, format!("energies {energy:e} and {other:e}"))?;
    let (force, other) = (alone.reaction(a, part)?, shared.reaction(b, part)?);
    for (x, y) in force.iter().zip(other.iter()) {
        let error = (x - y).abs() / force.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        ensure(error <= TOLERANCE, format!("reactions differ by {error:e}"))?;
    }
    ensure(expected.iterations == found.iterations, "iterations differ")?;
    let [j, other] = [&alone, &shared].map(|problem| {
        let state = if std::ptr::eq(problem, &alone) { a } else { b };
        problem.model().smallest_jacobian(&state.displacement, &state.condensed, state.load)
    });
    let (Some((j, _)), Some((other, _))) = (j, other) else { return Err("no determinant".into()) };
    ensure((j / other - 1.0).abs() <= TOLERANCE, format!("smallest J {j} and {other}"))
}

/// Bound on differences: those of rounding in sums of other order, times the condition of nearly incompressible bodies.
const TOLERANCE: f64 = 1e-9;

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
    cube(session, &Scheme { enforcing: rkpm::scene::Enforcing::Multipliers, ..Scheme::default().particles([5]) })
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
