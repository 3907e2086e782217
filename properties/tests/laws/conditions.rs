//! Essential conditions: two exact strategies agree, conditions hold, forces balance.
#![cfg(feature = "solve")]

use approx::abs_diff_eq;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError, TestRunner};
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, ConstraintMethod};
use rkpm::solve::State;

fn config(seed: u64) -> ProptestConfig {
    ProptestConfig {
        cases: 256,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        // A seed does not get simpler by getting smaller: shrink the rest of the recipe, briefly.
        max_shrink_iters: 64,
        ..Default::default()
    }
}

/// The rubber of §6 of the paper [MPa].
fn rubber(k: f64) -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, k).unwrap()
}

/// What a random case is drawn from.
#[derive(Debug, Clone, Copy)]
struct Recipe {
    seed: u64,
    at_particles: bool,
    revolution: bool,
    bulk: f64,
}

fn on_cases(seed: u64, law: impl Fn(&Recipe, &mut fastrand::Rng) -> Result<(), TestCaseError>) {
    let recipes = (any::<u64>(), any::<bool>(), any::<bool>(), 1.0..3.0f64).prop_map(
        |(seed, at_particles, revolution, decades)| Recipe {
            seed,
            at_particles,
            revolution,
            bulk: 10f64.powf(decades),
        },
    );
    let result =
        TestRunner::new(config(seed)).run(&recipes, |recipe| law(&recipe, &mut fastrand::Rng::with_seed(recipe.seed)));
    if let Err(error) = result {
        panic!("{error}");
    }
}

fn signed(random: &mut fastrand::Rng) -> f64 {
    2.0 * random.f64() - 1.0
}

fn largest(v: &[f64]) -> f64 {
    v.iter().map(|x| x.abs()).fold(0.0, f64::max)
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn solved<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<(Problem<D>, State), TestCaseError> {
    let fail = |e: &dyn std::fmt::Display| TestCaseError::fail(e.to_string());
    let problem = scene.discretize(scheme).map_err(|e| fail(&e))?;
    // Homogeneous states of large volume changes are exact and, under their pressures, unstable.
    let path = problem.run().map_err(|e| fail(&e))?.reached().map_err(|e| fail(&e))?;
    let state = path.last().clone();
    Ok((problem, state))
}

/// Displacements, pressures and multipliers of both strategies are the same.
fn strategies_agree<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<(Problem<D>, State), TestCaseError> {
    let (_, multipliers) = solved(scene, &scheme.clone().constraint_method(ConstraintMethod::Multipliers))?;
    let (problem, transformed) = solved(scene, &scheme.clone().constraint_method(ConstraintMethod::Transformation))?;
    // The bound requested. Both span one space and Newton ends quadratically, so that what is left is the
    // rounding of the factors: ε times the condition of K, some 1e4 here.
    let tolerance = 1e-9;
    let (a, b) = (&multipliers.displacement, &transformed.displacement);
    prop_assert!(distance(a, b) <= tolerance * largest(a), "displacement {:e} of {:e}", distance(a, b), largest(a));
    let (a, b) = (&multipliers.multipliers, &transformed.multipliers);
    prop_assert!(!a.is_empty() && largest(a) > 0.0);
    prop_assert!(distance(a, b) <= tolerance * largest(a), "multipliers {:e} of {:e}", distance(a, b), largest(a));
    for (a, b) in multipliers.terms.iter().zip(&transformed.terms) {
        let (a, b) = (&a.condensed, &b.condensed);
        prop_assert!(distance(a, b) <= tolerance * largest(a).max(1.0));
    }
    Ok((problem, transformed))
}

/// Both row kinds, a random jitter and few particles.
fn scheme(recipe: &Recipe, counts: impl Into<Vec<usize>>, random: &mut fastrand::Rng) -> Scheme {
    Scheme::default()
        .particles(counts)
        .layout(Layout::Jittered { amount: 0.15, seed: random.u64(..) })
        .constraint_kind(if recipe.at_particles { ConstraintKind::AtParticles } else { ConstraintKind::OverBoundary })
}

#[test]
fn multipliers_and_transformation_agree_in_2d() {
    on_cases(301, |recipe, random| {
        let block = Block::new([1.0, 0.0], [2.0, 1.0]);
        let scene = if recipe.revolution {
            Scene::new(block, Axisymmetric, rubber(recipe.bulk))
        } else {
            Scene::new(block, PlaneStrain, rubber(recipe.bulk))
        };
        let (dead, pull) = ([0.02 * signed(random), 0.02 * signed(random)], 0.1 * signed(random));
        let scene = scene
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 1, 0.2 * signed(random))
            .prescribe((1, Side::Max), 0, Value::field(move |x: &Point<2>| pull * (x[0] - 1.5)))
            .traction((0, Side::Max), dead)
            .pressure((0, Side::Min), 0.02 * random.f64());
        let (problem, state) = strategies_agree(&scene, &scheme(recipe, [5], random))?;
        let mut gap = Vec::new();
        problem.equations().violation(&state.displacement, state.load, &mut gap);
        // Rows hold to the rounding of the elimination, whatever Newton does.
        prop_assert!(largest(&gap) <= 1e-12, "{:e}", largest(&gap));
        if recipe.at_particles {
            for node in problem.cells().boundary_nodes(&(1, Side::Max).into()).unwrap() {
                let x = problem.cells().positions()[node];
                let u = problem.displacement(&state, &x).unwrap();
                // The value at a particle, not its coefficient, is what is prescribed; as above.
                prop_assert!(abs_diff_eq!(u[0], pull * (x[0] - 1.5), epsilon = 1e-12));
            }
        }
        Ok(())
    });
}

#[test]
fn multipliers_and_transformation_agree_in_1d() {
    on_cases(302, |recipe, random| {
        let block = Block::new([6.0], [8.0]);
        let scene = if recipe.revolution {
            Scene::new(block, RadialCylinder, rubber(10.0 * recipe.bulk))
        } else {
            Scene::new(block, RadialSphere, rubber(10.0 * recipe.bulk))
        };
        // Half a centimetre at least: reactions far below k ε would be rounding.
        let bore = 0.5 + 2.5 * random.f64();
        let scene = scene.prescribe(Side::Min, 0, bore).pressure(Side::Max, 0.02 * random.f64());
        strategies_agree(&scene, &scheme(recipe, [9], random)).map(drop)
    });
}

#[test]
fn multipliers_and_transformation_agree_in_3d() {
    on_cases(303, |recipe, random| {
        let push = -0.15 * random.f64();
        let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber(recipe.bulk))
            .hold((2, Side::Min))
            .prescribe((2, Side::Max), 2, push)
            // Nothing at the edge that it shares with the held face.
            .prescribe((2, Side::Max), 0, Value::field(move |x: &Point<3>| push * x[0] * (x[1] - 0.5)))
            .prescribe((0, Side::Min), 0, 0.0)
            .traction((1, Side::Max), [0.0, 0.02 * signed(random), 0.0]);
        strategies_agree(&scene, &scheme(recipe, [3, 3, 3], random)).map(drop)
    });
}

#[test]
fn multipliers_and_transformation_agree_in_3d_at_particles() {
    on_cases(304, |recipe, random| {
        let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber(recipe.bulk))
            .hold((2, Side::Min))
            .prescribe((2, Side::Max), 2, -0.15 * random.f64())
            .traction((1, Side::Max), [0.0, 0.02 * signed(random), 0.0]);
        let recipe = Recipe { at_particles: true, ..*recipe };
        strategies_agree(&scene, &scheme(&recipe, [3, 3, 3], random)).map(drop)
    });
}

#[test]
fn reactions_balance_the_loads() {
    on_cases(305, |recipe, random| {
        let dead = [0.03 * signed(random), 0.03 * signed(random)];
        let weight = 0.02 * signed(random);
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(recipe.bulk))
            .hold(Side::Min)
            .traction(Side::Max, dead)
            .with(Load::force(Place::at([2.0, 1.0]), [0.01, 0.0]))
            .with(Load::body_force([0.0, weight]));
        let (problem, state) = strategies_agree(&scene, &scheme(recipe, [7, 5], random))?;
        let reaction = problem.reaction(&state, Side::Min).unwrap();
        // The face has length 1, the body area 2; ΣΨ = 1 makes the sum of the coefficients' forces exact up
        // to what Newton leaves: its last increment, 1e-8 at most, squared, times the bulk modulus.
        let tolerance = 1e-11 * recipe.bulk;
        prop_assert!(
            abs_diff_eq!(reaction[0] + dead[0], -0.01, epsilon = tolerance),
            "{}",
            reaction[0] + dead[0] + 0.01
        );
        prop_assert!(
            abs_diff_eq!(reaction[1] + dead[1], -2.0 * weight, epsilon = tolerance),
            "{}",
            reaction[1] + dead[1] + 2.0 * weight
        );
        Ok(())
    });
}

#[test]
fn linear_fields_over_the_whole_boundary_are_the_solution_within() {
    // The patch test: smoothed cells and rows built on the same edge points are consistent.
    on_cases(306, |recipe, random| {
        let h = [0.2 * signed(random), 0.2 * signed(random), 0.2 * signed(random), 0.2 * signed(random)];
        let field = move |x: &Point<2>| Point::<2>::new(h[0] * x[0] + h[1] * x[1], h[2] * x[0] + h[3] * x[1]);
        let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber(recipe.bulk))
            .prescribe(Part::Whole, 0, Value::field(move |x: &Point<2>| field(x)[0]))
            .prescribe(Part::Whole, 1, Value::field(move |x: &Point<2>| field(x)[1]));
        let scheme = scheme(&Recipe { at_particles: false, ..*recipe }, [6], random);
        let (problem, state) = strategies_agree(&scene, &scheme)?;
        for x in problem.cells().positions() {
            let error = (problem.displacement(&state, x).unwrap() - field(x)).amax();
            // Integration and rows are consistent, so the field solves the equations to rounding.
            prop_assert!(error <= 1e-11, "{error:e}");
        }
        Ok(())
    });
}
