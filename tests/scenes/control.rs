//! Control by a functional of the displacement: falling branches, enclosed volumes, deflections.
#![cfg(feature = "solve")]

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::prelude::*;
use rkpm::solve::{Cause, Driven, EnclosedVolume, Functional, Newton, State, StepControl};

/// A spherical shell, inner radius 1, outer 1.1, neo-Hookean µ = 1, k = 1e5, by hand from the layers.
fn shell() -> (Model, ShapeTable<1>) {
    let lattice = Block::new([1.0], [1.1]).lattice([9]).unwrap();
    let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let body = ShapeTable::new(&rk, &lattice.coarsened(2).gauss(5).unwrap(), &RadialSphere).unwrap();
    let points = lattice.boundary(&Side::Min.into(), 1, 1).unwrap().points;
    let inner = ShapeTable::new(&rk, &points, &RadialSphere).unwrap();
    let mut model = Model::new(rk.nodes());
    model.add(Body::new(body, Rubber::neo_hookean(0.5, 1e5).unwrap(), PressureField::Linear));
    model.add(Pointwise::new(inner.clone(), FollowerPressure { pressure: 1.0, amplitude: Amplitude::Ramp }));
    (model, inner)
}

/// The incompressible pressure at inner stretch λ: p = ∫ 2µ(λ² − λ⁻⁴) R²/r³ dR, by the midpoint rule.
fn exact_pressure(stretch: f64) -> f64 {
    let n = 20_000;
    let width = 0.1 / n as f64;
    (0..n)
        .map(|i| {
            let reference = 1.0 + width * (i as f64 + 0.5);
            let radius = (reference.powi(3) + stretch.powi(3) - 1.0).cbrt();
            let hoop = radius / reference;
            2.0 * (hoop * hoop - hoop.powi(-4)) * reference * reference / radius.powi(3) * width
        })
        .sum()
}

#[test]
fn a_balloon_is_followed_past_its_limit_by_volume() {
    let (model, inner) = shell();
    let volume = EnclosedVolume::new(inner.clone()).unwrap();
    let full = 4.0 / 3.0 * std::f64::consts::PI;
    let stretches: [f64; 6] = [1.1, 1.2, 1.38, 1.6, 2.0, 4.0];
    let targets = stretches.map(|s| full * (s.powi(3) - 1.0));
    let rows = Constraints::default();
    let path = Analysis::default()
        .run_controlled(&model, &rows, State::at_rest(&model, &rows), &volume, &targets, &mut ())
        .unwrap();
    assert_eq!(path.ending, Ending::Completed);
    for step in &path.steps {
        let stretch = 1.0 + inner.displacement(0, &step.state.displacement)[0];
        // k/µ = 1e5 changes the pressure by about 6e-5 at λ = 4, far less below.
        assert!(relative_eq!(step.state.load, exact_pressure(stretch), max_relative = 1e-4), "{stretch}");
        // One pivot turns negative where the pressure falls.
        let falls = exact_pressure(stretch + 1e-4) < exact_pressure(stretch - 1e-4);
        assert_eq!(step.inertia.unwrap().negative, usize::from(falls), "{stretch}");
    }
}

#[test]
fn volume_has_its_gradient_and_its_sphere() {
    let (model, inner) = shell();
    let volume = EnclosedVolume::new(inner.clone()).unwrap();
    let mut random = fastrand::Rng::with_seed(4);
    let d: Vec<f64> = (0..model.unknowns()).map(|_| 0.2 * random.f64()).collect();
    let radius = 1.0 + inner.displacement(0, &d)[0];
    // Exact for a sphere up to rounding.
    assert_abs_diff_eq!(volume.value(&d), 4.0 / 3.0 * std::f64::consts::PI * (radius.powi(3) - 1.0), epsilon = 1e-12);
    check_gradient(&volume, &d);

    let lattice = Block::new([1.0, 0.0], [2.0, 1.0]).lattice([4, 4]).unwrap();
    let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let points = lattice.boundary(&(1, Side::Min).into(), 2, 2).unwrap().points;
    let d: Vec<f64> = (0..32).map(|_| 0.2 * random.f64()).collect();
    check_gradient(&EnclosedVolume::new(ShapeTable::new(&rk, &points, &Axisymmetric).unwrap()).unwrap(), &d);
    check_gradient(&EnclosedVolume::new(ShapeTable::new(&rk, &points, &PlaneStrain).unwrap()).unwrap(), &d);
}

fn check_gradient(functional: &dyn Functional, d: &[f64]) {
    let mut gradient = vec![0.0; d.len()];
    functional.gradient(d, &mut gradient);
    for k in 0..d.len() {
        // The volume is a cubic: central differences with step h err by h²/6 of its third derivative.
        let at = |h: f64| {
            let mut moved = d.to_vec();
            moved[k] += h;
            functional.value(&moved)
        };
        let difference = (at(1e-4) - at(-1e-4)) / 2e-4;
        assert!(abs_diff_eq!(difference, gradient[k], epsilon = 1e-7), "{k}: {difference} {}", gradient[k]);
    }
}

/// The disk of the paper (§6.4) under a pressure, edge held.
fn disk(pressure: f64, amplitude: Amplitude) -> Scene<2> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5).unwrap();
    Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .with(Load::pressure((1, Side::Min), pressure).amplitude(amplitude))
}

#[test]
fn thin_sheets_are_led_by_their_deflection() {
    let by = |control| {
        let stepping = Stepping { control, ..Stepping::default() };
        let problem =
            disk(0.0207, Amplitude::Ramp).discretize(&Scheme::default().particles([11, 2]).stepping(stepping)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let deflection = problem.displacement(path.last(), &[0.0, 0.0].into()).unwrap()[1];
        (deflection, path.iterations)
    };
    let (auto, iterations) = by(StepControl::Auto);
    let (load, iterations_load) = by(StepControl::Load);
    // One equilibrium, reached twice to the tolerance of Newton.
    assert_abs_diff_eq!(auto / load, 1.0, epsilon = 1e-8);
    assert!(iterations < iterations_load, "{iterations} {iterations_load}");
    // Finite elements, edge fixed: 6.7085 cm ± 3e-5; 22 particles are required to come within 1 %.
    assert_abs_diff_eq!(auto / 6.708548, 1.0, epsilon = 0.01);
}

#[test]
fn a_displacement_at_a_point_can_be_prescribed_by_the_load() {
    let problem = disk(0.1, Amplitude::Ramp).discretize(&Scheme::default().particles([11, 2])).unwrap();
    let centre = problem.deflection(&[0.0, 0.0].into(), 1).unwrap();
    let path = problem.run_controlled(&centre, &[1.0, 3.0, 5.0], &mut ()).unwrap().completed().unwrap();
    let reached = problem.displacement(path.last(), &[0.0, 0.0].into()).unwrap()[1];
    // Linear control equation: met to rounding.
    assert_abs_diff_eq!(reached, 5.0, epsilon = 1e-10);
    assert!(problem.deflection(&[0.0, 0.0].into(), 2).is_err());
    assert!(problem.deflection(&[30.0, 0.0].into(), 1).is_err());
}

/// The pressed ring that wrinkles inside macro cells without a pointwise share of the volumetric energy.
#[test]
fn a_pressed_ring_is_stable_and_smooth() {
    let pressed = |n: usize, m: usize| {
        let ring =
            Scene::new(Block::new([1.6, 0.0], [5.2, 3.0]), Axisymmetric, Rubber::neo_hookean(2.298, 1e3).unwrap())
                .prescribe((0, Side::Min), 0, 0.33)
                .prescribe((0, Side::Max), 0, -0.83)
                .prescribe((1, Side::Min), 1, 0.0);
        let problem = ring.discretize(&Scheme::default().particles([n, m])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert_eq!(path.steps.last().unwrap().inertia.unwrap().negative, 0);
        move |x: f64| problem.displacement(path.last(), &[x, 3.0].into()).unwrap()[1]
    };
    let fine = pressed(25, 29);
    for (n, m) in [(7, 8), (13, 15)] {
        let u = pressed(n, m);
        // 1.74 cm: finite elements with Q2/P1; the issue of the ring asks for half a percent.
        assert_abs_diff_eq!(u(5.2) / 1.74, 1.0, epsilon = 5e-3);
        // The part of the difference to a finer model that goes up and down from particle to particle all along the free edge, beside
        // the height of the edge. Without the ends: at the inner sleeve the edge bends within less than a spacing.
        let off: Vec<f64> = (0..n).map(|i| 1.6 + 3.6 * i as f64 / (n - 1) as f64).map(|x| u(x) - fine(x)).collect();
        let alternating: f64 =
            off.iter().enumerate().skip(1).take(n - 2).map(|(i, d)| (-1.0f64).powi(i as i32) * d).sum();
        let wrinkle = alternating.abs() / (n - 2) as f64 / (fine(1.6) - fine(5.2));
        println!("{n} × {m}: {wrinkle:.4}");
        assert!(wrinkle < 0.04, "{wrinkle}: {off:?}");
    }
}

#[test]
fn a_table_that_is_a_ramp_leads_like_one() {
    let by = |amplitude| {
        let problem = disk(0.0207, amplitude).discretize(&Scheme::default().particles([11, 2])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        (path.steps[0].state.load, problem.displacement(path.last(), &[0.0, 0.0].into()).unwrap()[1])
    };
    let (first, deflection) = by(Amplitude::Ramp);
    let (first_of_table, deflection_of_table) = by(Amplitude::table(vec![(0.0, 0.0), (1.0, 1.0)]).unwrap());
    // The deflection is in control from the first step on.
    assert!(first < 0.5);
    assert_relative_eq!(first_of_table, first, max_relative = 1e-9);
    assert_abs_diff_eq!(deflection_of_table / deflection, 1.0, epsilon = 1e-8);
}

#[test]
fn steps_stop_at_the_knots_of_tables() {
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let table = |pairs: &[(f64, f64)]| Amplitude::table(pairs.to_vec()).unwrap();
    let block = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min));
    let loads = |scene: Scene<2>, stepping| {
        let problem = scene.discretize(&Scheme::default().particles([5, 3]).stepping(stepping)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let loads: Vec<f64> = path.steps.iter().map(|step| step.state.load).collect();
        let tip = |load: f64| {
            let state = path.steps.iter().map(|step| &step.state).find(|state| state.load == load).unwrap();
            problem.displacement(state, &[2.0, 0.5].into()).unwrap()[0]
        };
        let peak = loads.iter().map(|&load| tip(load)).fold(0.0, f64::max);
        (loads, peak, tip(1.0))
    };
    // Up and down again: the peak is a state of the path, and at the end nothing is left of it.
    let pulled = |amplitude| block().with(Load::traction((0, Side::Max), [0.3, 0.0]).amplitude(amplitude));
    let (steps, peak, end) = loads(pulled(table(&[(0.0, 0.0), (0.5, 1.0), (1.0, 0.0)])), Stepping::default());
    assert_eq!(steps, [0.5, 1.0]);
    let (ramp, full, _) = loads(pulled(Amplitude::Ramp), Stepping::default());
    assert_eq!(ramp, [1.0]);
    assert_abs_diff_eq!(peak / full, 1.0, epsilon = 1e-8);
    assert_abs_diff_eq!(end, 0.0, epsilon = 1e-8);
    // Of all amplitudes together, those of motions too; break points at either end and beyond are none.
    let scene = block()
        .with(Condition::on((0, Side::Max)).component(0, 0.2).amplitude(table(&[
            (0.0, 0.0),
            (0.3, 0.5),
            (0.8, 0.5),
            (1.0, 1.0),
            (1.7, 2.0),
        ])))
        .with(
            Condition::on((0, Side::Max))
                .component(1, Value::motion(|_: &Point<2>, load| 0.1 * load))
                .amplitude(table(&[(0.0, 0.0), (0.6, 1.0), (1.0, 0.0)])),
        )
        .with(Load::body_force([0.0, -0.01]).amplitude(table(&[(-0.4, 0.0), (0.8, 1.0)])));
    assert_eq!(loads(scene, Stepping::default()).0, [0.3, 0.6, 0.8, 1.0]);
    // Steps of a size of their own come at them earlier.
    let scene = pulled(table(&[(0.0, 0.0), (0.25, 1.0), (1.0, 0.0)]));
    let equal = loads(scene, Stepping::equal(5)).0;
    assert!((equal[1] - 0.25).abs() == 0.0 && equal.len() == 6, "{equal:?}");
}

/// A spherical shell of neo-Hookean rubber under more pressure than it can bear.
fn overblown(stepping: Stepping) -> EquilibriumPath {
    let scene = Scene::new(Block::new([1.0], [2.0]), RadialSphere, Rubber::neo_hookean(0.5, 1e5).unwrap())
        .pressure(Side::Min, 5.0);
    scene.discretize(&Scheme::default().particles([17]).stepping(stepping)).unwrap().run().unwrap()
}

#[test]
fn stalls_say_where_the_path_turned_and_what_leads_on() {
    let arcs = Stepping { control: StepControl::ArcLength, steps: 60, ..Stepping::default() };
    for stepping in [arcs, Stepping { steps: 400, ..arcs }] {
        let path = overblown(stepping);
        let largest = path.steps.iter().map(|step| step.state.load).fold(0.0, f64::max);
        let Ending::Stalled(why) = &path.ending else { panic!("{:?}", path.ending) };
        assert_eq!((why.load, why.largest_load), (path.last().load, largest));
        assert!(why.load < why.largest_load && why.driven == Driven::ByControl, "{why:?}");
        let used_up = why.cause == Cause::Steps(stepping.steps);
        assert_eq!(used_up, path.steps.len() == stepping.steps, "{why:?}");
    }
    // Under load control there is no way on, but there are others.
    let path = overblown(Stepping { control: StepControl::Load, ..Stepping::default() });
    let Ending::Stalled(why) = &path.ending else { panic!("{:?}", path.ending) };
    assert!(!path.steps.is_empty() && why.driven == Driven::ByLoads && why.load == why.largest_load, "{why:?}");
    // Where displacements alone are prescribed there is no load whose limit could be passed.
    let squeezed = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -0.8);
    let newton = Newton { iterations: 2, ..Newton::default() };
    for (scene, loaded) in [(squeezed.clone().with(Load::body_force([0.0, -1e-3])), true), (squeezed, false)] {
        let mut problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        problem.analysis_mut().newton = newton;
        problem.analysis_mut().stepping.smallest = 0.1;
        let squeezed = problem.run().unwrap();
        let Ending::Stalled(why) = &squeezed.ending else { panic!("{:?}", squeezed.ending) };
        assert_eq!(why.driven, if loaded { Driven::ByLoads } else { Driven::ByDisplacements });
        assert_eq!(why.cause, Cause::Iterations(2));
    }
    // An observer that breaks off stalls nothing.
    let error = EquilibriumPath { ending: Ending::Stopped, ..path }.completed().unwrap_err();
    assert!(matches!(error.error, rkpm::error::SolveError::BrokenOff { .. }), "{error:?}");
}

/// A pressure on a free face has a stiffness that is not symmetric. Left out, Newton's method converges linearly.
#[test]
fn pressures_on_free_faces_converge_quadratically() {
    let scene = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .pressure((1, Side::Min), 0.02);
    let problem = scene.discretize(&Scheme::default().particles([17, 5]).stepping(Stepping::equal(2))).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let tip = problem.displacement(path.last(), &[4.0, 0.5].into()).unwrap();
    assert!(tip[1] > 1.0 && path.iterations <= 12, "{} {tip}", path.iterations);
}

/// Large prescribed displacements lead themselves: a load beside them, however small, must not be followed instead.
#[test]
fn prescribed_displacements_lead_beside_loads() {
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let pad = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 20.0)
        .prescribe((1, Side::Max), 1, 0.0)
        .with(Load::body_force([0.0, -1e-8]));
    let path = pad.discretize(&Scheme::default().particles([17, 5])).unwrap().run().unwrap().completed().unwrap();
    assert!(path.steps.len() == 1 && path.iterations <= 10, "{} {}", path.steps.len(), path.iterations);
    let sheet = Scene::new(Block::new([0.0, 0.0], [10.0, 0.1]), PlaneStrain, rubber())
        .hold((0, Side::Min))
        .prescribe((0, Side::Max), 0, 12.0)
        .prescribe((0, Side::Max), 1, 0.0)
        .with(Load::body_force([0.0, -1e-5]));
    let energy = |control| {
        let scheme = Scheme::default().particles([21, 2]).stepping(Stepping { control, ..Stepping::default() });
        let problem = sheet.discretize(&scheme).unwrap();
        problem.energy(problem.run().unwrap().completed().unwrap().last()).unwrap()
    };
    let (auto, load) = (energy(StepControl::Auto), energy(StepControl::Load));
    assert_abs_diff_eq!(auto / load, 1.0, epsilon = 1e-12);
}

#[test]
fn increments_grow_up_to_the_largest_one() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.1, 0.0]);
    let stepping = Stepping { first: 0.1, largest: 0.2, growth: 2.0, ..Stepping::default() };
    let problem = scene.discretize(&Scheme::default().particles([5, 3]).stepping(stepping)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let loads: Vec<f64> = path.steps.iter().map(|step| step.state.load).collect();
    assert_eq!(loads.len(), 6);
    assert_abs_diff_eq!(loads[..], [0.1, 0.3, 0.5, 0.7, 0.9, 1.0][..], epsilon = 1e-12);
}

/// Units change nothing: rows over boundaries of a body of revolution are lengths times areas, and their gaps decide
/// whether the matrix is kept.
#[test]
fn the_unit_of_length_changes_no_iteration() {
    let counts = |unit: f64| {
        let button = Block::new([0.0, 0.0], [unit, 0.5 * unit]);
        let path = Scene::new(button, Axisymmetric, Rubber::mooney_rivlin(0.3, 0.2, 1e3).unwrap())
            .prescribe((0, Side::Min), 0, 0.0)
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 0, 0.0)
            .prescribe((1, Side::Max), 1, -0.15 * unit)
            .pressure((0, Side::Max), 0.1)
            .discretize(&Scheme::default().particles([9, 7]))
            .unwrap()
            .run()
            .unwrap()
            .reached() // coarse at its edges
            .unwrap();
        (path.steps.len(), path.iterations, path.rejected)
    };
    let one = counts(1.0);
    for unit in [1e-3, 1e3, 1e5] {
        assert_eq!(counts(unit), one, "{unit}");
    }
}

/// A clamped dome pressed from outside snaps through: arcs keep to the path between lattices, where a step from one unstable mode to none may land
/// on another one far away, at loads below zero.
#[test]
fn arcs_keep_to_the_path_of_a_dome() {
    let (radius, half) = (107.0, (33.3f64 / 107.0).asin());
    let dome = move |unit: &Point<2>| {
        let (r, angle) = (radius + 0.375 - 0.75 * unit[0], half * unit[1]);
        Point::<2>::new(r * angle.sin(), r * angle.cos())
    };
    let scene = Scene::new(Mapped(dome), Axisymmetric, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((1, Side::Max))
        .pressure((0, Side::Min), 6e-4);
    let stepping = Stepping { control: StepControl::ArcLength, ..Stepping::default() };
    let limits = [3, 5].map(|across| {
        let problem = scene.discretize(&Scheme::default().particles([across, 41]).stepping(stepping)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let least = path.steps.iter().map(|step| step.state.load).fold(f64::INFINITY, f64::min);
        let first = path.critical_points().next().unwrap().load();
        println!("{across} across: {} steps, first limit {first:.4}, least load {least:.4}", path.steps.len());
        assert!(least > 0.0, "{least}");
        first
    });
    assert_abs_diff_eq!(limits[0] / limits[1], 1.0, epsilon = 0.05);
}
