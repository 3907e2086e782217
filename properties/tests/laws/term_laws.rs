//! Laws of the terms: rigid motions, derivatives, load stiffness, resultants.
#![cfg(feature = "solve")]

use std::cell::Cell;

use approx::{abs_diff_eq, relative_eq};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError, TestRunner};
use rkpm::assembly::{StateRef, System};
use rkpm::cells::{Lattice, Layout};
use rkpm::nalgebra::{Matrix3, Rotation2, Rotation3, SMatrix, Vector3};
use rkpm::prelude::*;
use rkpm::solve::State;
use rkpm::term::{ElasticFoundation, TermState, TermStep};

type Pt<const D: usize> = Point<D>;
type Kernels<const D: usize> = ReproducingKernel<D, CubicSpline, Polynomial<D>>;

const FIELDS: [PressureField; 4] =
    [PressureField::Displacement, PressureField::Pointwise, PressureField::Constant, PressureField::Linear];

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

/// Particles per direction.
fn counts<const D: usize>() -> [usize; D] {
    [[6, 4, 3][D - 1]; D]
}

/// What a random case is drawn from.
#[derive(Debug, Clone, Copy)]
struct Recipe {
    seed: u64,
    field: PressureField,
    smoothed: bool,
    bulk: f64,
}

fn recipes() -> impl Strategy<Value = Recipe> {
    (any::<u64>(), 0..4usize, any::<bool>(), 1.0..4.0f64).prop_map(|(seed, field, smoothed, decades)| Recipe {
        seed,
        field: FIELDS[field],
        smoothed,
        bulk: 10f64.powf(decades),
    })
}

/// Runs a law on 256 random cases; `tested` of them at least must have had something to say.
fn on_cases(seed: u64, tested: usize, law: impl Fn(&Recipe, &mut fastrand::Rng) -> Result<bool, TestCaseError>) {
    let count = Cell::new(0);
    let result = TestRunner::new(config(seed)).run(&recipes(), |recipe| {
        let mut random = fastrand::Rng::with_seed(recipe.seed);
        count.set(count.get() + usize::from(law(&recipe, &mut random)?));
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    assert!(count.get() >= tested, "only {} cases were tested", count.get());
}

fn signed(random: &mut fastrand::Rng) -> f64 {
    2.0 * random.f64() - 1.0
}

/// A jittered lattice over [1, 2]^D and its shape functions.
fn body<const D: usize>(random: &mut fastrand::Rng, order: u8) -> (Lattice<D>, Kernels<D>) {
    let layout = Layout::Jittered { amount: 0.2, seed: random.u64(..) };
    let block = Block { min: Pt::<D>::repeat(1.0), max: Pt::<D>::repeat(2.0) };
    let lattice = Lattice::new(&block, counts::<D>(), &layout).unwrap();
    let dilation = if order > 1 { 1.5 } else { 0.85 + 0.4 * random.f64() };
    let particles = lattice.particles(dilation).unwrap();
    let approximation = ReproducingKernel::new(particles, CubicSpline, Polynomial::new(order)).unwrap();
    (lattice, approximation)
}

/// A model of one body under the recipe's treatment of the volume.
fn body_model<const D: usize>(
    recipe: &Recipe,
    lattice: &Lattice<D>,
    approximation: &Kernels<D>,
    kinematics: &dyn Kinematics<D>,
) -> Model {
    let zones = lattice.zones(2);
    let table = if recipe.smoothed {
        ShapeTable::smoothed(approximation, &lattice.smoothing(2, 2, &zones).unwrap(), kinematics).unwrap()
    } else {
        ShapeTable::new(approximation, &lattice.gauss_in(2, &zones).unwrap(), kinematics).unwrap()
    };
    let mut model = Model::new(lattice.positions());
    model.add(Body::new(table, rubber(recipe.bulk), recipe.field));
    model
}

/// A model of one load on all of the boundary.
fn boundary_model<const D: usize>(
    lattice: &Lattice<D>,
    approximation: &Kernels<D>,
    kinematics: &dyn Kinematics<D>,
    part: impl Into<Part>,
    load: impl Integrand + 'static,
) -> Model {
    let points = lattice.boundary(&part.into(), 1, 4).unwrap().points;
    let mut model = Model::new(lattice.positions());
    model.add(Pointwise::new(ShapeTable::new(approximation, &points, kinematics).unwrap(), load));
    model
}

/// Coefficients of the displacement x(X) − X: the basis is linear at least, so they are the field itself.
fn coefficients<const D: usize>(lattice: &Lattice<D>, map: impl Fn(&Pt<D>) -> Pt<D>) -> Vec<f64> {
    lattice.positions().iter().flat_map(|x| (map(x) - x).iter().copied().collect::<Vec<_>>()).collect()
}

/// A homogeneous deformation with stretches around 1, and noise on it.
fn deformed<const D: usize>(random: &mut fastrand::Rng, lattice: &Lattice<D>, noise: f64) -> Vec<f64> {
    deformed_by(random, lattice, 0.25, noise)
}

/// Displacements of a random gradient with noise on top, in terms of the spacing.
fn deformed_by<const D: usize>(
    random: &mut fastrand::Rng,
    lattice: &Lattice<D>,
    gradient: f64,
    noise: f64,
) -> Vec<f64> {
    let mut f = SMatrix::<f64, D, D>::identity();
    for i in 0..D {
        for j in 0..D {
            f[(i, j)] += gradient * signed(random);
        }
    }
    let spacing = 1.0 / (counts::<D>()[0] - 1) as f64;
    let mut d = coefficients(lattice, |x| f * (x - Pt::<D>::repeat(1.0)) + Pt::<D>::repeat(1.0));
    d.iter_mut().for_each(|d| *d += noise * spacing * signed(random));
    d
}

/// Where the exponents of zones stand among condensed unknowns: the last of each zone's, whose number is odd.
fn exponents(model: &Model) -> Vec<(usize, usize)> {
    let of = |t: usize| -> Vec<(usize, usize)> {
        let term = &model.terms()[t];
        let ranges = (0..term.clusters()).map(|c| term.unknowns(c)).filter(|range| range.len() % 2 == 1);
        ranges.map(|range| (t, range.end - 1)).collect()
    };
    (0..model.terms().len()).flat_map(of).collect()
}

/// The condensed unknowns that belong to a displacement: those that a Newton step of zero leaves as they are.
fn settled(model: &Model, d: &[f64], load: f64) -> Vec<TermState> {
    settled_from(model, d, load, None)
}

/// The same with the exponents of other condensed unknowns: what a zone projects goes over from roots of J to J by steps, and
/// a body is the potential of its forces between them.
fn settled_from(model: &Model, d: &[f64], load: f64, held: Option<&[TermState]>) -> Vec<TermState> {
    let mut terms = held.map_or_else(|| model.start(), <[_]>::to_vec);
    let zero = vec![0.0; d.len()];
    // One round for the projected J, one for the pressure that belongs to it, one for rounding; and as many again for each
    // of the exponents that a pressure asks for.
    for _ in 0..9 {
        let mut step: Vec<Vec<f64>> = terms.iter().map(|own| vec![0.0; own.condensed.len()]).collect();
        model
            .at(StateRef::new(d, &terms, load))
            .unwrap()
            .advance(TermStep { displacement: &zero, load: 0.0 }, &mut step)
            .unwrap();
        for (own, step) in terms.iter_mut().zip(&step) {
            own.condensed.iter_mut().zip(step).for_each(|(l, s)| *l += s);
        }
        for (term, place) in exponents(model).into_iter().filter(|_| held.is_some()) {
            terms[term].condensed[place] = held.map_or(0.0, |held| held[term].condensed[place]);
        }
    }
    terms
}

fn forces(model: &Model, d: &[f64], load: f64) -> Vec<f64> {
    model.at(StateRef::new(d, &settled(model, d, load), load)).unwrap().residual()
}

fn assembled(model: &Model, d: &[f64], load: f64) -> (System, rkpm::assembly::Pattern) {
    let mut assembler = model.assembler();
    let mut system = System::default();
    assembler.assemble(model, StateRef::new(d, &settled(model, d, load), load), &mut system).unwrap();
    (system, assembler.pattern().clone())
}

/// The assembled matrix times a vector, skew part included.
fn product(model: &Model, d: &[f64], load: f64, v: &[f64]) -> Vec<f64> {
    let (system, pattern) = assembled(model, d, load);
    let mut out = vec![0.0; d.len()];
    pattern.multiply_add(&system.values, v, &mut out);
    system.skew_multiply_add(v, &mut out);
    out
}

/// The largest diagonal entry: what a force is measured by.
fn stiffness(model: &Model, d: &[f64]) -> f64 {
    let (system, pattern) = assembled(model, d, 1.0);
    (0..pattern.size()).map(|c| system.values[pattern.columns[c]].abs()).fold(0.0, f64::max)
}

fn largest(v: &[f64]) -> f64 {
    v.iter().map(|x| x.abs()).fold(0.0, f64::max)
}

/// d + s v.
fn along(d: &[f64], s: f64, v: &[f64]) -> Vec<f64> {
    d.iter().zip(v).map(|(d, v)| d + s * v).collect()
}

/// A random direction as large as a particle spacing.
fn direction<const D: usize>(random: &mut fastrand::Rng, unknowns: usize) -> Vec<f64> {
    let spacing = 1.0 / (counts::<D>()[0] - 1) as f64;
    (0..unknowns).map(|_| spacing * signed(random)).collect()
}

// --- Rigid motions -------------------------------------------------------------------------------------------

/// Forces and energy of a rigid motion vanish.
fn is_free(model: &Model, d: &[f64]) -> Result<bool, TestCaseError> {
    let terms = model.start();
    let force = largest(&model.at(StateRef::new(d, &terms, 0.0)).unwrap().residual());
    let scale = stiffness(model, &vec![0.0; d.len()]) * largest(d);
    // 1e-10 of stiffness times motion, the bound requested; F comes out to ε times a few neighbours.
    prop_assert!(force <= 1e-10 * scale, "{force:e} of {scale:e}");
    let energy = model.at(StateRef::new(d, &terms, 0.0)).unwrap().energy();
    // The energy is quadratic about its minimum: rounding ε in F leaves ε² of it, and ε in the sums.
    prop_assert!(abs_diff_eq!(energy, 0.0, epsilon = 1e-12 * scale * largest(d)), "{energy:e}");
    Ok(true)
}

#[test]
fn rigid_motion_of_a_plane_body_gives_no_force() {
    on_cases(201, 256, |recipe, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &PlaneStrain);
        let turn = Rotation2::new(3.1 * signed(random));
        let shift = Pt::<2>::new(signed(random), signed(random));
        is_free(&model, &coefficients(&lattice, |x| turn * x + shift))
    });
}

#[test]
fn rigid_motion_of_a_solid_gives_no_force() {
    on_cases(202, 256, |recipe, random| {
        let (lattice, approximation) = body::<3>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &Solid);
        let mut draw = || Vector3::new(signed(random), signed(random), signed(random));
        let turn = Rotation3::from_scaled_axis(draw() * 1.8);
        let shift = draw();
        is_free(&model, &coefficients(&lattice, |x| turn * x + shift))
    });
}

#[test]
fn translation_along_the_axis_gives_no_force() {
    on_cases(203, 256, |recipe, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &Axisymmetric);
        let shift = Pt::<2>::new(0.0, signed(random));
        is_free(&model, &coefficients(&lattice, |x| x + shift))
    });
}

#[test]
fn radial_translation_of_a_body_of_revolution_gives_forces() {
    // The counter-example: with hoops a radial shift is no rigid motion.
    let mut random = fastrand::Rng::with_seed(1);
    let recipe = Recipe { seed: 1, field: PressureField::Displacement, smoothed: false, bulk: 1e3 };
    let (lattice, approximation) = body::<2>(&mut random, 1);
    let model = body_model(&recipe, &lattice, &approximation, &Axisymmetric);
    let d = coefficients(&lattice, |x| x + Pt::<2>::new(0.1, 0.0));
    assert!(is_free(&model, &d).is_err());
}

#[test]
fn forces_turn_with_the_body() {
    on_cases(204, 200, |recipe, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &PlaneStrain);
        let d = deformed(random, &lattice, 0.1);
        if !admissible(&model, &d) {
            return Ok(false);
        }
        let turn = Rotation2::new(3.1 * signed(random));
        let turned: Vec<f64> = lattice
            .positions()
            .iter()
            .zip(d.chunks_exact(2))
            .flat_map(|(x, d)| {
                let moved = turn * (x + Pt::<2>::new(d[0], d[1])) - x;
                [moved[0], moved[1]]
            })
            .collect();
        let (before, after) = (forces(&model, &d, 0.0), forces(&model, &turned, 0.0));
        let scale = stiffness(&model, &d);
        for (f, g) in before.chunks_exact(2).zip(after.chunks_exact(2)) {
            let f = turn * Pt::<2>::new(f[0], f[1]);
            // ε times a few neighbours in F times the stiffness, as for rigid motions.
            prop_assert!(abs_diff_eq!(f, Pt::<2>::new(g[0], g[1]), epsilon = 1e-11 * scale));
        }
        let energy = |d: &[f64]| model.at(StateRef::new(d, &settled(&model, d, 0.0), 0.0)).unwrap().energy();
        // Sums of some hundred positive energies, each with the rounding of F times its stress.
        prop_assert!(abs_diff_eq!(energy(&d), energy(&turned), epsilon = 1e-11 * scale));
        Ok(true)
    });
}

// --- Derivatives ---------------------------------------------------------------------------------------------

/// Whether every point is well away from inversion, so that differences stay inside the material's domain.
fn admissible(model: &Model, d: &[f64]) -> bool {
    model.at(StateRef::new(d, &model.start(), 0.0)).unwrap().smallest_jacobian().is_none_or(|(j, _)| j > 0.3)
}

/// The derivative of a vector function by central differences, once extrapolated (error h⁴).
fn derivative(h: f64, f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let (a, b, c, e) = (f(-2.0 * h), f(-h), f(h), f(2.0 * h));
    (0..a.len()).map(|i| (8.0 * (c[i] - b[i]) - (e[i] - a[i])) / (12.0 * h)).collect()
}

/// Forces are the derivative of the energy, the matrix is the derivative of the forces; with condensed unknowns,
/// both at those that belong to the displacement, where condensation must give exactly that.
fn derivatives_agree<const D: usize>(
    recipe: &Recipe,
    random: &mut fastrand::Rng,
    kinematics: &dyn Kinematics<D>,
) -> Result<bool, TestCaseError> {
    let (lattice, approximation) = body::<D>(random, 1);
    let model = body_model(recipe, &lattice, &approximation, kinematics);
    let d = deformed_by(random, &lattice, 0.1, 0.1);
    // The third derivative of the pointwise energy jumps where its stiffness stops rising, at J of 0.74 or less.
    let least = model.at(StateRef::new(&d, &model.start(), 0.0)).unwrap().smallest_jacobian();
    if least.is_some_and(|(j, _)| j < 0.76) {
        return Ok(false);
    }
    let v = direction::<D>(random, d.len());
    let scale = stiffness(&model, &d) * largest(&v);
    // A step of 1e-3 spacings leaves 1e-12 of the fifth derivative and rounding of 1e-16/1e-3.
    let step = 1e-3;
    let base = settled(&model, &d, 0.0);
    let held = |d: &[f64]| settled_from(&model, d, 0.0, Some(&base));
    let slope = derivative(step, |s| {
        let d = along(&d, s, &v);
        vec![model.at(StateRef::new(&d, &held(&d), 0.0)).unwrap().energy()]
    })[0];
    let work: f64 = forces(&model, &d, 0.0).iter().zip(&v).map(|(f, v)| f * v).sum();
    // The energy sums over all points, a scale times a spacing each; rounding 1e-13 of it dominates.
    prop_assert!(abs_diff_eq!(slope, work, epsilon = 1e-9 * scale), "energy: {:e} of {scale:e}", slope - work);
    let expected = derivative(step, |s| {
        let d = along(&d, s, &v);
        model.at(StateRef::new(&d, &held(&d), 0.0)).unwrap().residual()
    });
    let given = product(&model, &d, 0.0, &v);
    let error = expected.iter().zip(&given).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // Truncation, see above, with fifth derivatives of the order of (1/J)^5 ≤ 400; rounding 1e-13.
    prop_assert!(error <= 1e-9 * scale, "forces: {error:e} of {scale:e}");
    Ok(true)
}

#[test]
fn forces_and_matrices_are_derivatives_in_plane_strain() {
    on_cases(211, 150, |recipe, random| derivatives_agree::<2>(recipe, random, &PlaneStrain));
}

#[test]
fn forces_and_matrices_are_derivatives_in_bodies_of_revolution() {
    on_cases(212, 150, |recipe, random| derivatives_agree::<2>(recipe, random, &Axisymmetric));
}

#[test]
fn forces_and_matrices_are_derivatives_in_solids() {
    on_cases(213, 150, |recipe, random| derivatives_agree::<3>(recipe, random, &Solid));
}

#[test]
fn forces_and_matrices_are_derivatives_in_radial_motion() {
    on_cases(214, 150, |recipe, random| derivatives_agree::<1>(recipe, random, &RadialCylinder));
    on_cases(215, 150, |recipe, random| derivatives_agree::<1>(recipe, random, &RadialSphere));
}

#[test]
fn forces_do_not_see_local_unknowns_twice() {
    // The term's residual at unsettled condensed is that of the settled ones to first order: condensation linearises
    // about them. Half a perturbation leaves a quarter.
    on_cases(216, 100, |recipe, random| {
        if recipe.field == PressureField::Displacement {
            return Ok(false);
        }
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &PlaneStrain);
        let d = deformed(random, &lattice, 0.1);
        let settled = settled(&model, &d, 0.0);
        let direction: Vec<f64> = settled.iter().flat_map(|own| &own.condensed).map(|_| signed(random)).collect();
        let reference = model.at(StateRef::new(&d, &settled, 0.0)).unwrap().residual();
        let error = |size: f64| {
            let mut moved = settled.clone();
            for (local, change) in moved.iter_mut().flat_map(|own| &mut own.condensed).zip(&direction) {
                *local += size * change;
            }
            // Exponents are given, not solved for.
            for (term, place) in exponents(&model) {
                moved[term].condensed[place] = settled[term].condensed[place];
            }
            let residual = model.at(StateRef::new(&d, &moved, 0.0)).unwrap().residual();
            residual.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let (whole, half) = (error(1e-4), error(5e-5));
        let rounding = 1e-11 * recipe.bulk;
        // At points U is quadratic, hence the pressure that enters is exactly that of the settled state.
        prop_assert!(recipe.field != PressureField::Pointwise || whole <= rounding, "{whole:e}");
        prop_assert!(half <= 0.26 * whole + rounding, "{half:e} of {whole:e}");
        Ok(true)
    });
}

#[test]
fn all_pressures_at_points_reach_the_solution_of_the_displacements() {
    // Small blocks, moderately sheared and stretched: one solution, two ways of Newton. Bulk moduli up to
    // 200 µ: above 4000 µ so coarse and uncured a block locks, and has several equilibria.
    on_cases(217, 256, |recipe, random| {
        let (stretch, shear) = (0.15 * signed(random), 0.15 * signed(random));
        let bulk = recipe.bulk.powf(0.55);
        let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber(bulk))
            .hold((0, Side::Min))
            .prescribe((0, Side::Max), 0, stretch)
            .prescribe((0, Side::Max), 1, shear);
        let solve = |field| {
            let scheme = Scheme::default().particles([4]).pressure_field(field, 2);
            let problem = scene.discretize(&scheme).unwrap();
            let path = problem.run().unwrap().completed().map_err(|e| TestCaseError::fail(e.to_string()))?;
            Ok::<_, TestCaseError>((problem, path))
        };
        let (_, plain) = solve(PressureField::Displacement)?;
        let (problem, mixed) = solve(PressureField::Pointwise)?;
        let size = largest(&plain.last().displacement);
        let distance = |state: &State| {
            plain.last().displacement.iter().zip(&state.displacement).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        // The bound requested; Newton ends with an increment of 1e-8 and squares it.
        prop_assert!(distance(mixed.last()) <= 1e-9 * size, "{:e}", distance(mixed.last()));
        // Where the pressures start must not matter either.
        let mut start = mixed.start.clone();
        for local in start.terms.iter_mut().flat_map(|own| &mut own.condensed) {
            *local += 0.05 * signed(random);
        }
        let other = problem.analysis().resume(problem.model(), problem.equations(), start, &mut ()).unwrap();
        let other = other.completed().map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!(distance(other.last()) <= 1e-9 * size, "{:e}", distance(other.last()));
        Ok(true)
    });
}

// --- Loads ---------------------------------------------------------------------------------------------------

/// The matrix of a load of at most quadratic forces is their central difference, with a step as large as you like.
fn load_stiffness_agrees<const D: usize>(
    random: &mut fastrand::Rng,
    model: &Model,
    lattice: &Lattice<D>,
) -> Result<bool, TestCaseError> {
    let d = deformed(random, lattice, 0.3);
    let v = direction::<D>(random, d.len());
    let load = 0.2 + random.f64();
    let (up, down) = (
        model.at(StateRef::new(&along(&d, 1.0, &v), &model.start(), load)).unwrap().residual(),
        model.at(StateRef::new(&along(&d, -1.0, &v), &model.start(), load)).unwrap().residual(),
    );
    let given = product(model, &d, load, &v);
    let scale = largest(&given).max(largest(&up));
    prop_assert!(scale > 0.0);
    for i in 0..d.len() {
        let error = (0.5 * (up[i] - down[i]) - given[i]).abs();
        // Forces are polynomials of degree two at most in d: central differences have no truncation error,
        // and some hundred terms of rounding are left.
        prop_assert!(error <= 1e-12 * scale, "{error:e} of {scale:e}");
    }
    // ∂r/∂λ: all amplitudes here are straight lines near this load, so differences are exact again.
    let (system, _) = assembled(model, &d, load);
    let (more, less) = (
        model.at(StateRef::new(&d, &model.start(), load + 1e-3)).unwrap().residual(),
        model.at(StateRef::new(&d, &model.start(), load - 1e-3)).unwrap().residual(),
    );
    for i in 0..d.len() {
        let error = ((more[i] - less[i]) / 2e-3 - system.load_slope[i]).abs();
        // Rounding of the forces over the step, and of the forces a step further.
        let scale = scale.max(largest(&system.load_slope));
        prop_assert!(error <= 1e-12 * scale / 1e-3, "load slope: {error:e} of {scale:e}");
    }
    // The assembler's forces are the model's.
    let direct = model.at(StateRef::new(&d, &model.start(), load)).unwrap().residual();
    for (a, b) in direct.iter().zip(&system.residual) {
        prop_assert!(abs_diff_eq!(a, b, epsilon = 1e-14 * scale));
    }
    Ok(true)
}

/// A ramp, or a table with its break points outside the loads that are tested.
fn amplitude(random: &mut fastrand::Rng) -> Amplitude {
    if random.bool() {
        Amplitude::Ramp
    } else {
        Amplitude::table(vec![(0.0, 0.5), (0.1, signed(random)), (2.0, 1.0 + random.f64())]).unwrap()
    }
}

fn pressure(random: &mut fastrand::Rng) -> FollowerPressure {
    FollowerPressure { pressure: 0.5 + random.f64(), amplitude: amplitude(random) }
}

#[test]
fn load_stiffness_of_the_follower_pressure_is_the_derivative_of_its_forces() {
    on_cases(221, 256, |_, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let part = if random.bool() { Part::Whole } else { (1, Side::Max).into() };
        let load = pressure(random);
        let plane = boundary_model(&lattice, &approximation, &PlaneStrain, part.clone(), load.clone());
        load_stiffness_agrees(random, &plane, &lattice)?;
        let round = boundary_model(&lattice, &approximation, &Axisymmetric, part, load);
        load_stiffness_agrees(random, &round, &lattice)
    });
    on_cases(222, 256, |_, random| {
        let (lattice, approximation) = body::<3>(random, 1);
        let part = if random.bool() { Part::Whole } else { (2, Side::Min).into() };
        let load = pressure(random);
        let solid = boundary_model(&lattice, &approximation, &Solid, part, load);
        load_stiffness_agrees(random, &solid, &lattice)
    });
    on_cases(223, 256, |_, random| {
        let (lattice, approximation) = body::<1>(random, 1);
        let side = if random.bool() { Side::Min } else { Side::Max };
        let load = pressure(random);
        let cylinder = boundary_model(&lattice, &approximation, &RadialCylinder, side, load.clone());
        load_stiffness_agrees(random, &cylinder, &lattice)?;
        let sphere = boundary_model(&lattice, &approximation, &RadialSphere, side, load);
        load_stiffness_agrees(random, &sphere, &lattice)
    });
}

#[test]
fn stiffness_of_foundations_and_dead_loads_is_the_derivative_of_their_forces() {
    on_cases(224, 256, |_, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let foundation = ElasticFoundation { stiffness: 0.1 + random.f64() };
        let model = boundary_model(&lattice, &approximation, &PlaneStrain, Part::Whole, foundation);
        load_stiffness_agrees(random, &model, &lattice)?;
        // A foundation has an energy, ½ k∫|u|²: quadratic, so differences are exact.
        let d = deformed(random, &lattice, 0.3);
        let v = direction::<2>(random, d.len());
        let energy = |s: f64| model.at(StateRef::new(&along(&d, s, &v), &model.start(), 0.0)).unwrap().energy();
        let work: f64 = forces(&model, &d, 0.0).iter().zip(&v).map(|(f, v)| f * v).sum();
        // Rounding of sums over some fifty points.
        prop_assert!(abs_diff_eq!(
            0.5 * (energy(1.0) - energy(-1.0)),
            work,
            epsilon = 1e-13 * (energy(1.0) + energy(-1.0))
        ));
        let dead = DeadLoad { force: Vector3::new(signed(random), 0.3, 0.0), amplitude: amplitude(random) };
        let model = boundary_model(&lattice, &approximation, &Axisymmetric, Part::Whole, dead);
        load_stiffness_agrees(random, &model, &lattice)
    });
}

#[test]
fn radial_pressure_does_work_on_the_enclosed_volume() {
    // Per unit length p d(πr²) = 2πr p dr and, for the sphere, p d(4πr³/3) = 4πr² p dr, outward on the bore.
    on_cases(225, 256, |_, random| {
        let (lattice, approximation) = body::<1>(random, 1);
        let stretch = 0.5 + 1.5 * random.f64();
        let load = FollowerPressure { pressure: 0.7, amplitude: Amplitude::Constant };
        let d = coefficients(&lattice, |x| x * stretch);
        let total =
            |model: &Model| -model.at(StateRef::new(&d, &model.start(), 1.0)).unwrap().residual().iter().sum::<f64>();
        let cylinder = total(&boundary_model(&lattice, &approximation, &RadialCylinder, Side::Min, load.clone()));
        let sphere = total(&boundary_model(&lattice, &approximation, &RadialSphere, Side::Min, load));
        let pi = std::f64::consts::PI;
        // ΣΨ = 1 and the exact reproduction of a stretch leave rounding only.
        prop_assert!(relative_eq!(cylinder, 2.0 * pi * stretch * 0.7, max_relative = 1e-12));
        prop_assert!(relative_eq!(sphere, 4.0 * pi * stretch * stretch * 0.7, max_relative = 1e-12));
        Ok(true)
    });
}

/// A random quadratic field, which a quadratic basis reproduces.
fn quadratic<const D: usize>(random: &mut fastrand::Rng, lattice: &Lattice<D>) -> Vec<f64> {
    let linear = SMatrix::<f64, D, D>::from_fn(|_, _| 0.3 * signed(random));
    let bend: Vec<SMatrix<f64, D, D>> = (0..D).map(|_| SMatrix::from_fn(|_, _| 0.2 * signed(random))).collect();
    coefficients(lattice, |x| {
        let curved = Pt::<D>::from_fn(|i, _| (x.transpose() * bend[i] * x)[(0, 0)]);
        x + linear * x + curved
    })
}

#[test]
fn follower_pressure_on_a_closed_boundary_has_no_resultant_and_no_moment() {
    // Faces of a block are flat and F is linear on them, so four Gauss points integrate cof(F)N and
    // x × cof(F)N exactly, and the divergence theorem holds to rounding.
    on_cases(226, 256, |_, random| {
        let (lattice, approximation) = body::<2>(random, 2);
        let load = FollowerPressure { pressure: 1.0, amplitude: Amplitude::Constant };
        let model = boundary_model(&lattice, &approximation, &PlaneStrain, Part::Whole, load.clone());
        let d = quadratic(random, &lattice);
        let f = model.at(StateRef::new(&d, &model.start(), 1.0)).unwrap().residual();
        let scale = f.iter().map(|f| f.abs()).sum::<f64>();
        let sum = |i: usize| f.iter().skip(i).step_by(2).sum::<f64>();
        let moment: f64 = lattice
            .positions()
            .iter()
            .enumerate()
            .map(|(a, x)| (x[0] + d[2 * a]) * f[2 * a + 1] - (x[1] + d[2 * a + 1]) * f[2 * a])
            .sum();
        // Rounding of shape functions whose sums are 1 to 1000 ε / rcond.
        let tolerance = 1e-11 * scale;
        prop_assert!(
            abs_diff_eq!(sum(0), 0.0, epsilon = tolerance) && abs_diff_eq!(sum(1), 0.0, epsilon = tolerance),
            "{:e} {:e}",
            sum(0),
            sum(1)
        );
        prop_assert!(abs_diff_eq!(moment, 0.0, epsilon = 4.0 * tolerance), "{moment:e}");
        // The axial resultant of a closed body of revolution vanishes as well.
        let round = boundary_model(&lattice, &approximation, &Axisymmetric, Part::Whole, load.clone());
        let f = round.at(StateRef::new(&d, &round.start(), 1.0)).unwrap().residual();
        let axial: f64 = f.iter().skip(1).step_by(2).sum();
        // As above.
        prop_assert!(abs_diff_eq!(axial, 0.0, epsilon = 1e-11 * f.iter().map(|f| f.abs()).sum::<f64>()), "{axial:e}");
        // One open face is not balanced: the law says something.
        let open = boundary_model(&lattice, &approximation, &PlaneStrain, Side::Min, load);
        let f = open.at(StateRef::new(&vec![0.0; d.len()], &open.start(), 1.0)).unwrap().residual();
        prop_assert!(f.iter().step_by(2).sum::<f64>().abs() > 0.1);
        Ok(true)
    });
    on_cases(227, 256, |_, random| {
        // A lattice of 4³ particles carries a quadratic basis.
        let lattice = Block::new([1.0; 3], [2.0; 3]).lattice([4; 3]).unwrap();
        let particles = lattice.particles(1.3).unwrap();
        let approximation = ReproducingKernel::new(particles, CubicSpline, Polynomial::new(2)).unwrap();
        let load = FollowerPressure { pressure: 1.0, amplitude: Amplitude::Constant };
        let model = boundary_model(&lattice, &approximation, &Solid, Part::Whole, load);
        let d = quadratic(random, &lattice);
        let f = model.at(StateRef::new(&d, &model.start(), 1.0)).unwrap().residual();
        let scale = f.iter().map(|f| f.abs()).sum::<f64>();
        let mut moment = Vector3::zeros();
        let mut sum = Vector3::zeros();
        for (a, x) in lattice.positions().iter().enumerate() {
            let force = Vector3::from_column_slice(&f[3 * a..3 * a + 3]);
            sum += force;
            moment += (x + Vector3::from_column_slice(&d[3 * a..3 * a + 3])).cross(&force);
        }
        // As in the plane.
        prop_assert!(abs_diff_eq!(sum, Vector3::zeros(), epsilon = 1e-11 * scale), "{sum:?}");
        prop_assert!(abs_diff_eq!(moment, Vector3::zeros(), epsilon = 1e-10 * scale), "{moment:?}");
        Ok(true)
    });
}

#[test]
fn dead_loads_sum_to_force_times_measure() {
    on_cases(228, 256, |_, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let force = Vector3::new(signed(random), signed(random), 0.0);
        let load = DeadLoad { force, amplitude: Amplitude::Ramp };
        let face = boundary_model(&lattice, &approximation, &PlaneStrain, (1, Side::Max), load.clone());
        let d = deformed(random, &lattice, 0.3);
        let total = |model: &Model, i: usize| {
            -model.at(StateRef::new(&d, &model.start(), 0.4)).unwrap().residual().iter().skip(i).step_by(2).sum::<f64>()
        };
        // ΣΨ = 1 to rounding; the face has length 1, the outer face of the ring 2π·2·1.
        prop_assert!(abs_diff_eq!(total(&face, 0), 0.4 * force[0], epsilon = 1e-12));
        prop_assert!(abs_diff_eq!(total(&face, 1), 0.4 * force[1], epsilon = 1e-12));
        let ring = boundary_model(&lattice, &approximation, &Axisymmetric, (0, Side::Max), load);
        let area = 4.0 * std::f64::consts::PI;
        prop_assert!(abs_diff_eq!(total(&ring, 1), 0.4 * area * force[1], epsilon = 1e-11));
        Ok(true)
    });
}

#[test]
fn homogeneous_states_carry_the_stress_of_the_material() {
    // P of the material at F, found again in the forces on a face by virtual work of a linear field.
    on_cases(229, 200, |recipe, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &PlaneStrain);
        let mut f = Matrix3::identity();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            f[(i, j)] += 0.25 * signed(random);
        }
        let d = coefficients(&lattice, |x| Pt::<2>::new(f.m11 * x[0] + f.m12 * x[1], f.m21 * x[0] + f.m22 * x[1]));
        if !admissible(&model, &d) {
            return Ok(false);
        }
        let force = forces(&model, &d, 0.0);
        let stress = rubber(recipe.bulk).response(&f).stress;
        for i in 0..2 {
            for j in 0..2 {
                let work: f64 = lattice.positions().iter().enumerate().map(|(a, x)| force[2 * a + i] * x[j]).sum();
                // The area is 1; the rounding of J is magnified by the bulk modulus. With projected
                // pressures the state is the same, whatever the pointwise share.
                prop_assert!(
                    abs_diff_eq!(work, stress[(i, j)], epsilon = 1e-11 * recipe.bulk),
                    "{work} {}",
                    stress[(i, j)]
                );
            }
        }
        Ok(true)
    });
}

#[test]
fn homogeneous_states_of_bodies_of_revolution_carry_the_stress_of_the_material() {
    on_cases(230, 200, |recipe, random| {
        let (lattice, approximation) = body::<2>(random, 1);
        let model = body_model(recipe, &lattice, &approximation, &Axisymmetric);
        let mut stretch = || 1.0 + 0.25 * signed(random);
        let (radial, axial, slope) = (stretch(), stretch(), stretch() - 1.0);
        let d = coefficients(&lattice, |x| Pt::<2>::new(radial * x[0], axial * x[1] + slope * x[0]));
        let f = Matrix3::new(radial, 0.0, 0.0, slope, axial, 0.0, 0.0, 0.0, radial);
        if !admissible(&model, &d) {
            return Ok(false);
        }
        let force = forces(&model, &d, 0.0);
        let stress = rubber(recipe.bulk).response(&f).stress;
        let work = |i: usize, j: usize| -> f64 {
            lattice.positions().iter().enumerate().map(|(a, x)| force[2 * a + i] * x[j]).sum()
        };
        // The ring between R = 1 and 2, of height 1, has the volume 3π.
        let volume = 3.0 * std::f64::consts::PI;
        // Rounding of J times the bulk modulus, as in plane strain; gradients, hoops and volume of the
        // smoothed cells come from the same numbers.
        let tolerance = 1e-11 * recipe.bulk * volume;
        prop_assert!(abs_diff_eq!(work(0, 0), volume * (stress.m11 + stress.m33), epsilon = tolerance));
        prop_assert!(abs_diff_eq!(work(1, 1), volume * stress.m22, epsilon = tolerance));
        prop_assert!(abs_diff_eq!(work(1, 0), volume * stress.m21, epsilon = tolerance));
        Ok(true)
    });
}
