//! GOAL: the one stepping rule where methods fail: limit points, bifurcations, false equilibria.
//! GEOMETRY: a spherical shell; a column between held ends; sheared and turned blocks.
//! BOUNDARY: an inner pressure; prescribed displacements.
//! REFERENCE: the incompressible pressure by quadrature; control by volume; symmetry.
#![cfg(feature = "solve")]

use std::ops::ControlFlow;
use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::assembly::Pattern;
use rkpm::error::LinearError;
use rkpm::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};
use rkpm::prelude::*;
use rkpm::scene::ConstraintMethod;
use rkpm::solve::{CriticalKind, EnclosedVolume, Following, Functional, State, Step, StepControl};

const RUBBER: [f64; 2] = [0.5, 1e5];

fn shell(control: StepControl) -> (Problem<1>, EnclosedVolume<1>) {
    shell_under(Amplitude::Ramp, control)
}

/// A spherical shell, inner radius 1, outer 1.1, under an inner pressure that it can't hold at load factor 1.
fn shell_under(amplitude: Amplitude, control: StepControl) -> (Problem<1>, EnclosedVolume<1>) {
    let block = Block::new([1.0], [1.1]);
    let rubber = Rubber::neo_hookean(RUBBER[0], RUBBER[1]).unwrap();
    let scheme = Scheme::default().particles([9]).stepping(Stepping { control, ..Stepping::default() });
    let pressure = Load::pressure(Side::Min, 1.0).amplitude(amplitude);
    let problem = Scene::new(block, RadialSphere, rubber).with(pressure).discretize(&scheme).unwrap();
    let lattice = block.lattice([9]).unwrap();
    let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let points = lattice.boundary(&Side::Min.into(), 1, 1).unwrap().points;
    (problem, EnclosedVolume::new(ShapeTable::new(&rk, &points, &RadialSphere).unwrap()).unwrap())
}

/// Stops an analysis once a functional is beyond a value.
struct Until<'a>(&'a dyn Functional, f64);

impl Observer for Until<'_> {
    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        if self.0.value(&step.state.displacement) < self.1 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

/// The incompressible pressure at an inner stretch, p = ∫ 2µ(λ² − λ⁻⁴) R²/r³ dR, by the midpoint rule.
fn exact_pressure(stretch: f64) -> f64 {
    let n = 2000;
    let width = 0.1 / f64::from(n);
    (0..n)
        .map(|i| {
            let reference = 1.0 + width * (f64::from(i) + 0.5);
            let radius = (reference.powi(3) + stretch.powi(3) - 1.0).cbrt();
            let hoop = radius / reference;
            2.0 * (hoop * hoop - hoop.powi(-4)) * reference * reference / radius.powi(3) * width
        })
        .sum()
}

/// The volume pumped into the shell at an inner stretch.
fn pumped(stretch: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * (stretch.powi(3) - 1.0)
}

#[test]
fn arcs_pass_the_limit_point_of_a_balloon_where_the_load_can_not() {
    let (problem, volume) = shell(StepControl::ArcLength);
    let path = problem.run_with(&mut Until(&volume, pumped(4.0))).unwrap();
    assert_eq!(path.ending, Ending::Stopped);
    let volumes: Vec<f64> = path.steps.iter().map(|s| volume.value(&s.state.displacement)).collect();
    let rest = State::at_rest(problem.model(), problem.equations());
    let pumped_up = problem
        .analysis()
        .run_controlled(problem.model(), problem.equations(), rest, &volume, &volumes, &mut ())
        .unwrap()
        .completed()
        .unwrap();
    for (step, volume_of_step) in path.steps.iter().zip(&volumes) {
        let reached =
            |s: &&Step| relative_eq!(volume.value(&s.state.displacement), *volume_of_step, max_relative = 1e-10);
        let other = pumped_up.steps.iter().find(reached).unwrap();
        // One path, whatever leads along it.
        // Settled to 1e-6 before a last iteration that squares the error.
        assert_relative_eq!(step.state.load, other.state.load, max_relative = 1e-8);
        let stretch = (1.0 + volume_of_step / pumped(2.0) * 7.0).cbrt();
        // k/µ = 1e5 changes the pressure by about 6e-5 at λ = 4 and by more beyond.
        let exact = exact_pressure(stretch);
        assert!(stretch > 4.0 || relative_eq!(step.state.load, exact, max_relative = 1e-4), "{stretch}");
    }
    // One limit point, at the largest exact pressure; its neighbours on the path are 3 % of the way apart.
    let points: Vec<_> = path.critical_points().collect();
    assert_eq!(points.len(), 1, "{points:?}");
    let largest = (0..1000).map(|k| exact_pressure(1.3 + 2e-4 * f64::from(k))).fold(0.0, f64::max);
    assert_eq!((points[0].kind, points[0].modes), (CriticalKind::Limit, [0, 1]));
    assert_relative_eq!(points[0].load(), largest, max_relative = 1e-4);
    let beyond = path.steps.iter().filter(|s| s.unstable == Some(1)).count();
    assert!(beyond > 1 && beyond < path.steps.len());

    // The load alone comes close to the limit point and says that it ends there.
    let (problem, _) = shell(StepControl::Load);
    let path = problem.run().unwrap();
    assert!(matches!(path.ending, Ending::Stalled(_)));
    assert!(path.last().load < largest * (1.0 + 1e-4) && path.last().load > 0.95 * largest);
}

/// Also where the pressure does not act at first, and no tangent at rest tells where the first arc goes.
#[test]
fn a_run_by_arcs_is_resumed_with_the_same_bits() {
    let squared = Amplitude::Function(Arc::new(|load| load * load));
    for amplitude in [Amplitude::Ramp, squared, Amplitude::Table(vec![(0.0, 0.0), (0.2, 0.0), (1.0, 1.0)])] {
        let (problem, volume) = shell_under(amplitude, StepControl::ArcLength);
        let whole = problem.run_with(&mut Until(&volume, pumped(3.0))).unwrap();
        assert_eq!((&whole.ending, whole.critical_points().count()), (&Ending::Stopped, 1));
        for kept in [1, 2, whole.steps.len() - 1] {
            let mut path = whole.clone();
            path.steps.truncate(kept);
            assert_eq!(problem.resume(path, &mut Until(&volume, pumped(3.0))).unwrap(), whole);
        }
    }
}

/// A column 1 × 10 pressed between held ends by 6 % of its length.
fn column(constraint_method: ConstraintMethod) -> (Problem<2>, EquilibriumPath) {
    let scene = Scene::new(Block::new([0.0; 2], [1.0, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -0.6);
    let stepping = Stepping { follow: Following::Path, ..Stepping::default() };
    let scheme = Scheme::default().particles([5, 41]).constraint_method(constraint_method).stepping(stepping);
    let problem = scene.discretize(&scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

#[test]
fn a_column_buckles_and_the_bifurcation_is_bracketed() {
    let by = [ConstraintMethod::Transformation, ConstraintMethod::Multipliers].map(column);
    for (problem, path) in &by {
        let points: Vec<_> = path.critical_points().collect();
        assert_eq!((points[0].kind, points[0].modes), (CriticalKind::Bifurcation, [0, 1]));
        let [low, high] = points[0].loads;
        assert!(low < high && high / low - 1.0 <= 1e-3, "{low} {high}");
        // Nothing is lost on the way: the steps tell of as many modes as the points.
        let modes = path.steps.last().unwrap().unstable.unwrap();
        assert_eq!(points.last().unwrap().modes[1], modes);
        // The force there, between those of the states around it. 9 × 81 particles find 0.1401 µ; Euler's load of the clamped
        // column softened by shear, for the column as it stands then, is 0.131 µ, a tenth short of what its ends add.
        let force = |state: &State| problem.reaction(state, (1, Side::Max)).unwrap()[1].abs();
        let states = || std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state));
        let load = points[0].load();
        let before = states().rfind(|state| state.load <= load).unwrap();
        let behind = states().find(|state| state.load > load).unwrap();
        let part = (load - before.load) / (behind.load - before.load);
        let buckling = (1.0 - part) * force(before) + part * force(behind);
        assert_abs_diff_eq!(buckling / 0.1401, 1.0, epsilon = 0.02);
        assert_abs_diff_eq!(buckling / 0.131, 1.0, epsilon = 0.1);
    }
    // Multipliers count the same modes behind their constraints: one space, one inertia.
    let loads = by.map(|(_, path)| path.critical_points().next().unwrap().load());
    assert_abs_diff_eq!(loads[0] / loads[1], 1.0, epsilon = 1e-3);
}

/// A solver that does not tell the signs of its pivots.
struct Blind(Box<dyn LinearSolver>);

impl LinearSolver for Blind {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Blind(self.0.fresh()))
    }

    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<(), LinearError> {
        self.0.analyze(pattern, class, order)
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        self.0.factorize(system).map(|_| None)
    }

    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        pressures: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError> {
        self.0.solve(system, rhs, pressures)
    }
}

/// A block whose upper edge is turned, everything else free.
fn turned_block(particles: usize, turns: f64) -> Problem<2> {
    let turn = move |load: f64| (load * turns * std::f64::consts::TAU).sin_cos();
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    Scene::new(Block::new([-0.5, -0.5], [0.5, 0.5]), PlaneStrain, rubber)
        .prescribe((1, Side::Max), 0, Value::motion(move |x: &Point<2>, l| x[0] * (turn(l).1 - 1.0) - x[1] * turn(l).0))
        .prescribe((1, Side::Max), 1, Value::motion(move |x: &Point<2>, l| x[0] * turn(l).0 + x[1] * (turn(l).1 - 1.0)))
        .discretize(&Scheme::default().particles([particles]))
        .unwrap()
}

#[test]
fn large_steps_do_not_land_on_false_equilibria() {
    // A rigid rotation costs nothing; large steps would fold the block on the way on some of these lattices. Neither those
    // who see the signs of the pivots nor those who see uneven volumes alone take such a state.
    for (particles, turns) in [(5, 0.35), (8, 0.4), (8, 0.5), (9, 0.3), (9, 0.5)] {
        let mut problem = turned_block(particles, turns);
        let path = problem.run().unwrap().completed().unwrap();
        assert!(path.steps.iter().all(|step| step.unstable == Some(0) && step.energy < 1e-9));
        assert!(path.steps.last().unwrap().energy < 1e-20);
        problem.analysis_mut().solver = Box::new(Blind(Box::new(Direct::default())));
        let path = problem.run().unwrap().completed().unwrap();
        // Steps follow the way of the edge, a quarter of a turn at most each.
        assert!(path.steps.len() >= 2);
        assert!(path.steps.iter().all(|step| step.unstable.is_none() && step.critical.is_empty()));
        assert!(path.steps.iter().all(|step| step.energy < 1e-9), "{particles} {turns}");
    }
}

#[test]
fn a_column_that_is_not_quite_straight_stays_on_its_stable_branch() {
    let bend = |unit: &Point<2>| 0.5e-3 * (1.0 - (2.0 * std::f64::consts::PI * unit[1]).cos());
    let domain = Mapped(move |unit: &Point<2>| Point::<2>::new(unit[0] + bend(unit), 10.0 * unit[1]));
    let scene = Scene::new(domain, PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -2.0);
    let last = |control| {
        let scheme = Scheme::default().particles([5, 41]).stepping(Stepping {
            control,
            follow: Following::Path,
            ..Stepping::default()
        });
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert!(path.steps.iter().all(|step| step.unstable == Some(0)), "{control:?}");
        problem.displacement(path.last(), &[0.5 + 1e-3, 5.0].into()).unwrap()[0]
    };
    // The straight column, shortened by 20 %, has four unstable modes and hardly moves sideways.
    let (by_load, by_arcs) = (last(StepControl::Load), last(StepControl::ArcLength));
    assert!(by_load.abs() > 2.0, "{by_load}");
    assert_relative_eq!(by_load, by_arcs, max_relative = 1e-7);
}

#[test]
fn homogeneous_states_are_reached_at_once_and_tell_that_they_are_unstable() {
    // A sheet pressed to a tenth between sliding ends would long have wrinkled.
    let scene = Scene::new(Block::new([0.0; 2], [1.0, 0.25]), PlaneStrain, Rubber::neo_hookean(0.5, 1e5).unwrap())
        .prescribe(Side::Min, 0, 0.0)
        .prescribe(Side::Max, 0, -0.9)
        .prescribe(Place::at([0.0, 0.0]), 1, 0.0);
    let problem = scene.discretize(&Scheme::default().particles([9, 3])).unwrap();
    let none = problem.run().unwrap().completed().unwrap_err();
    let path = &none.path;
    assert_eq!((path.steps.len(), path.critical_points().count()), (1, 0));
    let modes = path.steps[0].unstable.unwrap();
    assert!(modes > 0 && none.to_string().contains(&format!("{modes} unstable modes")), "{none}");
}

#[test]
fn steps_tell_how_far_they_can_be_trusted() {
    // The tube of §6.2, whose energy the uncured scheme misses by 4 % at r = 1 because it locks.
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap();
    let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46);
    let last = |scheme: Scheme| {
        let problem = tube.discretize(&scheme.particles([9])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        path.steps.last().unwrap().clone()
    };
    let cured = last(Scheme::default());
    assert_eq!(cured.locking(), None);
    assert!(cured.diagnostics.rcond.unwrap() > 1e-3);
    let [low, high] = cured.diagnostics.jacobians.unwrap();
    // Means over zones are 1; between them the wall may breathe as the interpolation asks.
    assert!(low < 1.0 && low > 0.99 && high > 1.0 && high < 1.01, "{low} {high}");
    for r in [0.8, 1.0, 1.2, 1.4] {
        let paper = last(Scheme::paper(r).integration_zones([4]));
        let error = (paper.energy / cured.energy - 1.0).abs();
        // An independent prototype found it within −8 … +15 % of the error.
        let indicator = paper.locking().unwrap() / error;
        assert!(indicator > 0.92 && indicator < 1.15, "{r}: {indicator}");
    }
}

/// The first arc may be longer than the way to the limit point: it still goes where the load pushes, and the arch snaps
/// at the load that short arcs find.
#[test]
fn the_first_arc_follows_the_load() {
    let arch = Mapped(|unit: &Point<2>| {
        let (angle, radius) = (0.5 - unit[0], 20.0 + 0.5 * unit[1]);
        Point::<2>::new(-radius * angle.sin(), radius * angle.cos())
    });
    let scene = Scene::new(arch, PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .hold((0, Side::Max))
        .pressure((1, Side::Max), 0.004);
    let limit = |first: f64| {
        let stepping = Stepping { control: StepControl::ArcLength, steps: 40, first, ..Stepping::default() };
        let problem = scene.discretize(&Scheme::default().particles([41, 3]).stepping(stepping)).unwrap();
        let path = problem.run().unwrap();
        assert!(path.steps[0].state.load > 0.0, "{}", path.steps[0].state.load);
        path.critical_points().find(|point| point.kind == CriticalKind::Limit).map(|point| point.load())
    };
    let (long, short) = (limit(1.0).unwrap(), limit(0.05).unwrap());
    assert_abs_diff_eq!(long / short, 1.0, epsilon = 0.02);
}

/// The block [1, 2] × [0, 1] bent into a sector by Rivlin's solution for incompressible rubber: its lower side slides, its
/// upper one is turned by `angle` with the stretch of the solution.
fn bent(rubber: Rubber, angle: f64) -> Scene<2> {
    let d = 2.0 / angle;
    let inner = 0.5 * (-d + (d * d + 4.0 / angle.powi(4)).sqrt());
    let radius = move |x: f64| (inner + 2.0 * (x - 1.0) / angle).sqrt();
    Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, Value::field(move |x: &Point<2>| radius(x[0]) * angle.cos() - x[0]))
        .prescribe((1, Side::Max), 1, Value::field(move |x: &Point<2>| radius(x[0]) * angle.sin() - 1.0))
}

#[test]
fn large_steps_do_not_fold_bent_blocks() {
    // With a pointwise energy that has a bound each of these converged to a folded state in one step or two, most of them stable ones.
    let (mut rejected, mut equal) = (0, 0);
    for (rubber, angle, n) in [
        (Rubber::mooney_rivlin(0.3, 0.2, 20.0).unwrap(), 1.2, 7),
        (Rubber::mooney_rivlin(0.3, 0.2, 1e3).unwrap(), 1.2, 8),
        (Rubber::mooney_rivlin(0.3, 0.2, 1e3).unwrap(), 1.2, 11),
        (Rubber::neo_hookean(0.5, 1e3).unwrap(), 0.9, 9),
        (Rubber::yeoh(0.5, -0.02, 0.01, 1e3).unwrap(), 0.9, 6),
    ] {
        let scene = bent(rubber, angle);
        let energy = |stepping: Stepping| {
            let problem = scene.discretize(&Scheme::default().particles([n]).stepping(stepping)).unwrap();
            // Unstable states are among them, and tell it.
            let path = problem.run().unwrap().reached().unwrap();
            (path.steps.last().unwrap().energy, path.steps.last().unwrap().unstable, path.rejected)
        };
        let small = energy(Stepping { first: 0.1, largest: 0.1, ..Stepping::default() });
        let large = energy(Stepping::default());
        println!("{small:?} {large:?}");
        // A state that is another one is near, and tells that it is unstable.
        let same = abs_diff_eq!(large.0 / small.0, 1.0, epsilon = 1e-8) && large.1 == small.1;
        let near = abs_diff_eq!(large.0 / small.0, 1.0, epsilon = 1e-2);
        assert!(same || near && large.1 > small.1, "{n} {angle}: {large:?} {small:?}");
        equal += usize::from(same);
        rejected += large.2;
    }
    assert!(rejected > 0 && equal >= 3, "{rejected} {equal}");
}

/// Others are unstable, and tell it; `cargo test --release --test stability modes -- --ignored` takes a minute or two.
#[test]
#[ignore = "long"]
fn few_of_many_bent_blocks_differ_from_small_steps_and_do_not_tell() {
    let (mut runs, mut differ) = (0, 0);
    for bulk in [2.0, 20.0, 1e3] {
        let rubbers = [
            Rubber::mooney_rivlin(0.3, 0.2, bulk).unwrap(),
            Rubber::neo_hookean(0.5, bulk).unwrap(),
            Rubber::yeoh(0.5, -0.02, 0.01, bulk).unwrap(),
        ];
        for (rubber, angle) in rubbers.iter().flat_map(|rubber| [0.6, 0.9, 1.2].map(|angle| (rubber, angle))) {
            for n in 5..=14 {
                let scene = bent(rubber.clone(), angle);
                let energy = |stepping: Stepping| {
                    let scheme = Scheme::default().particles([n]).stepping(stepping);
                    let path = scene.discretize(&scheme).unwrap().run().unwrap();
                    path.steps.last().filter(|step| step.state.load == 1.0).map(|step| (step.energy, step.unstable))
                };
                let small = energy(Stepping { first: 0.1, largest: 0.1, ..Stepping::default() });
                runs += 1;
                // Blocks that crease stall with small steps: nothing to compare with.
                if let (Some((small, _)), Some((large, unstable))) = (small, energy(Stepping::default())) {
                    let off = (large / small - 1.0).abs();
                    if off > 3e-3 {
                        println!("k {bulk}, angle {angle}, {n} across: {off:.4} off, {unstable:?} unstable");
                    }
                    differ += usize::from(off > 3e-3 && unstable == Some(0));
                }
            }
        }
    }
    println!("{differ} of {runs} do not tell");
    assert!(runs == 270 && differ <= 2, "{differ} of {runs}");
}

/// A bonded pad of 20 × 2 (a quarter of it) pulled by a tenth: tensions of 16 µ inside.
fn pulled_pad(scattered: bool) -> (Scene<2>, Place<2>) {
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    if scattered {
        let outline = Outline::at([0.0, 0.0]).line("b", [10.0, 0.0]).line("r", [10.0, 1.0]).line("t", [0.0, 1.0]);
        let region = Region::new(outline.close("l")).unwrap();
        let scene = Scene::new(region, PlaneStrain, rubber).prescribe("l", 0, 0.0).prescribe("b", 1, 0.0);
        return (scene.prescribe("t", 0, 0.0).prescribe("t", 1, 0.1), Place::on("t"));
    }
    let scene = Scene::new(Block::new([0.0, 0.0], [10.0, 1.0]), PlaneStrain, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, 0.1);
    (scene, Place::on((1, Side::Max)))
}

#[test]
fn pulled_bodies_do_not_tear_up_inside_their_macro_cells() {
    // With roots of J alone the modes of a zone gain energy beyond a tension of 3 to 4 µ: 39 unstable modes on the lattice, and
    // scattered particles ended, stable, at 41.9 in place of 68.6 (Q2/P1: 68.64).
    for (scattered, scheme) in [
        (false, Scheme::default().particles([33, 7])),
        (true, Scheme::default().spacing(0.17)),
        (true, Scheme::default().spacing(0.25)),
    ] {
        let (scene, top) = pulled_pad(scattered);
        let mut forces = Vec::new();
        for steps in [1, 10] {
            let size = 1.0 / f64::from(steps);
            let stepping = Stepping { first: size, largest: size, ..Stepping::default() };
            let problem = scene.discretize(&scheme.clone().stepping(stepping)).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            assert!(path.steps.iter().all(|step| step.unstable == Some(0)));
            assert!(path.iterations <= 16 + 4 * path.steps.len(), "{}", path.iterations);
            forces.push(problem.reaction(path.last(), top.clone()).unwrap()[1]);
        }
        // Nearly the same state by either way, zones may stand a sixteenth apart; and 0.2 % off the finite elements.
        assert_abs_diff_eq!(forces[0] / forces[1], 1.0, epsilon = 1e-4);
        assert_abs_diff_eq!(forces[0] / 68.64, 1.0, epsilon = 2e-3);
    }
}

#[test]
fn work_is_stored_while_measures_change() {
    // Exponents follow the pressure without being derived from the potential: what that leaves of ∫F du is far below what the
    // lattice is off.
    let (scene, top) = pulled_pad(false);
    let stepping = Stepping { first: 0.01, largest: 0.01, ..Stepping::default() };
    let problem = scene.discretize(&Scheme::default().particles([33, 7]).stepping(stepping)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = |state: &State| problem.reaction(state, top.clone()).unwrap()[1];
    let (mut work, mut before) = (0.0, (0.0, 0.0));
    for step in &path.steps {
        let now = (0.1 * step.state.load, force(&step.state));
        work += 0.5 * (now.1 + before.1) * (now.0 - before.0);
        before = now;
    }
    let off = work / problem.energy(path.last()).unwrap() - 1.0;
    assert!(off.abs() < 3e-4, "{off:.1e}");
}

#[test]
fn pulled_bodies_of_revolution_and_solids_are_stable() {
    // Bonded between plates and pulled by 30 % and a fifth: tensions of 4.4 and 5 µ, beyond the 3 and 4 µ of roots.
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let cylinder = Scene::new(Block::new([0.0, 0.0], [5.0, 1.0]), Axisymmetric, rubber())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, 0.3);
    let block = Scene::new(Block::new([0.0; 3], [3.0, 3.0, 0.5]), Solid, rubber())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((2, Side::Min), 2, 0.0)
        .prescribe((2, Side::Max), 0, 0.0)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.1);
    fn run<const D: usize>(scene: &Scene<D>, counts: &[usize], tension: f64) -> f64 {
        let problem = scene.discretize(&Scheme::default().particles(counts).stepping(Stepping::equal(5))).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert!(path.steps.iter().all(|step| step.unstable == Some(0)));
        let largest = problem.pressures(path.last()).unwrap().unwrap().into_iter().fold(0.0, f64::max);
        assert!(largest > tension, "{largest}");
        problem.energy(path.last()).unwrap()
    }
    // Q2/P1 with 41 × 13 nodes, refined once: 30.555, from which 21 × 7 particles are 0.2 % off. In space with 13 × 13 × 5: 1.2376,
    // not refined; the default says 0.5 % more with 9 and with 13 particles a side.
    let energy = run(&cylinder, &[21, 7], 4.2);
    assert_abs_diff_eq!(energy / 30.555, 1.0, epsilon = 3e-3);
    let energy = run(&block, &[9, 9, 5], 4.5);
    assert_abs_diff_eq!(energy / 1.2376, 1.0, epsilon = 0.007);
}

/// A strip, held at one end and pressed from below, 20 thicknesses long.
fn rolled(pressure: f64, constraint_method: ConstraintMethod, stepping: Stepping) -> Problem<2> {
    Scene::new(Block::new([0.0, 0.0], [20.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .pressure((1, Side::Min), pressure)
        .discretize(&Scheme::default().particles([41, 9]).constraint_method(constraint_method).stepping(stepping))
        .unwrap()
}

/// The tip of the middle line, displaced.
fn tip(problem: &Problem<2>, path: &EquilibriumPath) -> Point<2> {
    problem.displacement(path.last(), &[20.0, 0.5].into()).unwrap() + Point::<2>::new(20.0, 0.0)
}

/// The tip of an inextensible rod with the bending stiffness 4µ/12 of the strip under the pressure on its outer face,
/// $q(1 + \kappa/2)$ along its middle, integrated from the free end.
fn rod(pressure: f64) -> Point<2> {
    let (pieces, stiffness) = (20_000, 1.0 / 3.0);
    let length = 20.0 / f64::from(pieces);
    let rate = |[normal, shear, moment]: [f64; 3]| {
        let curvature = moment / stiffness;
        [-curvature * shear, curvature * normal + pressure * (1.0 + 0.5 * curvature.abs()), shear]
    };
    let (mut forces, mut curvatures) = ([0.0; 3], vec![0.0]);
    for _ in 0..pieces {
        let ahead = |rate: [f64; 3], part: f64| -> [f64; 3] { std::array::from_fn(|i| forces[i] + part * rate[i]) };
        // The midpoint rule: its error is far below that of the rod's assumptions.
        forces = ahead(rate(ahead(rate(forces), 0.5 * length)), length);
        curvatures.push(forces[2] / stiffness);
    }
    let (mut angle, mut at) = (0.0f64, Point::<2>::zeros());
    for pair in curvatures.windows(2).rev() {
        let turned = 0.5 * length * (pair[0] + pair[1]);
        at += Point::<2>::new((angle + 0.5 * turned).cos(), (angle + 0.5 * turned).sin()) * length;
        angle += turned;
    }
    at
}

/// Pressure that follows a free strip rolls it up by 122°, then by 240°; the skew part of its stiffness is no longer small
/// then, and what moves along the pressure at first has its largest value on the way. Against the rod, whose strains of
/// up to a tenth are neglected, and against Q2/P1 with 81 × 9 nodes: (−2.636, −0.611).
#[test]
fn following_pressure_rolls_a_free_strip_up() {
    let by_load = Stepping { first: 0.05, control: StepControl::Load, ..Stepping::default() };
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let problem = rolled(6e-4, constraint_method, by_load);
        let path = problem.run().unwrap().completed().unwrap();
        let (tip, rod) = (tip(&problem, &path), rod(6e-4));
        // Measured: 0.04 of the length 20.
        assert!((tip - rod).norm() < 0.08 && path.iterations <= 60, "{tip} {rod}, {} iterations", path.iterations);
    }
    let steps = [by_load, Stepping { control: StepControl::ArcLength, ..by_load }, Stepping::default()];
    let tips = steps.map(|stepping| {
        let problem = rolled(3e-3, ConstraintMethod::Auto, stepping);
        let path = problem.run().unwrap().completed().unwrap();
        tip(&problem, &path)
    });
    assert!((tips[0] - Point::<2>::new(-2.636, -0.611)).norm() < 0.08, "{}", tips[0]);
    assert!(tips.iter().all(|tip| abs_diff_eq!(*tip, tips[0], epsilon = 5e-7)), "{tips:?}");
}

/// A disc held at its edge and blown up: the deflection of its pole, and the unstable modes of the last state.
fn disc(radius: f64, thickness: f64, pressure: f64, scheme: &Scheme) -> (f64, Option<usize>) {
    let rubber = Rubber::mooney_rivlin(80.0, 20.0, 1e5).unwrap(); // psi
    let scene = Scene::new(Block::new([0.0, 0.0], [radius, thickness]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), pressure);
    let problem = scene.discretize(scheme).unwrap();
    // Three particles over the thickness are coarse at the edge.
    let path = problem.run().unwrap().reached().unwrap_or_else(|error| panic!("{scheme:?}: {error}"));
    let deflection = problem.displacement(path.last(), &[0.0, 0.0].into()).unwrap()[1];
    (deflection, path.steps.last().unwrap().unstable)
}

/// Inflated discs, whose cells are shorter than wide through the thickness or wider, by the numbers of particles: nothing in them is unstable,
/// and the deflection of the pole is that of the finest elements. The edge is singular, so that it rises with the particles along the radius.
#[test]
fn inflated_discs_have_no_mode_of_their_own() {
    let pole = |radius: f64, thickness: f64, pressure: f64, counts: [usize; 2]| {
        let (deflection, unstable) = disc(radius, thickness, pressure, &Scheme::default().particles(counts));
        assert_eq!(unstable, Some(0), "{radius} × {thickness} at {pressure}, {counts:?}");
        deflection
    };
    for across in [3, 5, 9] {
        for along in [41, 61, 77, 97, 161] {
            // The corner of this one has a limit point at 0.85 of the load, where the run ends.
            if [along, across] == [161, 9] {
                continue;
            }
            let deflection = pole(7.5, 0.5, 45.0, [along, across]); // in, psi
            println!("{along} × {across}: {deflection:.4}");
            assert!(abs_diff_eq!(deflection / 15.06, 1.0, epsilon = 0.02), "{along} × {across}: {deflection}");
        }
    }
    // Drawn: cells up to eight times as long as thick, or as thick as long. Pressures by the thickness over the radius, as membranes take them.
    let mut random = fastrand::Rng::with_seed(15);
    for _ in 0..24 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        let (thickness, across) = (between(0.1, 1.0), between(2.0, 9.9) as usize);
        let ratio = 8f64.powf(between(-1.0, 1.0));
        let along = (7.5 / (ratio * thickness / (across as f64 - 1.0))).clamp(12.0, 220.0) as usize;
        pole(7.5, thickness, between(200.0, 650.0) * thickness / 7.5, [along, across]);
    }
}

/// The same disc by elements: what its deflection is to be compared with.
#[test]
#[ignore = "report: cargo test --release --test stability disc_by_elements -- --ignored --nocapture"]
fn the_disc_by_elements() {
    let deflections = [[81, 5], [161, 9], [321, 17]].map(|counts| {
        let (deflection, unstable) = disc(7.5, 0.5, 45.0, &Scheme::elements(2).particles(counts));
        println!("{counts:?}: {deflection:.4}, {unstable:?} unstable modes");
        deflection
    });
    // The held edge is singular: from below, by less each time.
    let [first, second, third] = deflections;
    assert!(second > first && third > second && third - second < second - first, "{deflections:?}");
    assert_abs_diff_eq!(third / 15.06, 1.0, epsilon = 1e-3);
}
