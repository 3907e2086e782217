//! GOAL: an analysis that finds no further state says why, as a value.
//! GEOMETRY: a block 2 × 1; a thin sphere.
//! BOUNDARY: one that meets the cause.
//! REFERENCE: the cause.

use approx::assert_abs_diff_eq;
use rkpm::assembly::Pattern;
use rkpm::error::LinearError;
use rkpm::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};
use rkpm::material::{Material, Past, Prony, Response, Viscoelastic};
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::*;
use rkpm::scene::{StagePath, Stages};
use rkpm::solve::{Cause, Following, Functional, Newton, StepControl};
use rkpm::term::{Element, View};
use std::sync::Arc;

fn cause(path: &EquilibriumPath) -> Cause {
    match &path.ending {
        Ending::Stalled(stalled) => stalled.cause.clone(),
        ending => panic!("{ending:?}"),
    }
}

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

fn block(material: impl Material + 'static) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, material)
}

fn run(scene: &Scene<2>, scheme: Scheme) -> EquilibriumPath {
    scene.discretize(&scheme.particles([9, 5])).unwrap().run().unwrap()
}

/// The whole load in one step, which may not be halved.
fn at_once() -> Scheme {
    Scheme::default().stepping(Stepping { smallest: 1.0, ..Stepping::default() })
}

/// A functional that nothing changes.
struct Constant;

impl Functional for Constant {
    fn value(&self, _: &[f64]) -> f64 {
        0.0
    }

    fn gradient(&self, _: &[f64], out: &mut [f64]) {
        out.fill(0.0);
    }
}

/// A law that ends at a stretch of 1.2.
struct Brittle(Rubber);

impl Material for Brittle {
    fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
        if f[(0, 0)] < 1.2 { self.0.energy(f) } else { f64::NAN }
    }

    fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
        if f[(0, 0)] < 1.2 { self.0.response(f) } else { Response::undefined() }
    }
}

/// A solver whose library gives up when it is to factorise.
#[derive(Debug)]
struct GivesUp;

impl LinearSolver for GivesUp {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(GivesUp)
    }

    fn analyze(&mut self, _: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
        Ok(())
    }

    fn factorize(&mut self, _: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        Err(LinearError::Library { what: "out of licences".to_string() })
    }

    fn solve(&mut self, _: &LinearSystem<'_>, _: &mut [f64], _: Option<&mut [[f64; 4]]>) -> Result<f64, LinearError> {
        Err(LinearError::Library { what: "out of licences".to_string() })
    }
}

#[test]
fn the_allowed_steps_and_iterations_are_used_up() {
    let pulled = block(rubber()).hold(Side::Min).prescribe(Side::Max, 0, 0.3);
    // One step of a third of the load, and no more.
    let few = Stepping { steps: 1, ..Stepping::equal(3) };
    assert_eq!(cause(&run(&pulled, Scheme::default().stepping(few))), Cause::Steps(1));
    let newton = Newton { iterations: 2, ..Newton::default() };
    assert_eq!(cause(&run(&pulled, at_once().newton(newton))), Cause::Iterations(2));
}

#[test]
fn steps_are_limited_where_bodies_are_pressed_through_themselves() {
    let crushed =
        block(rubber()).hold((1, Side::Min)).prescribe((1, Side::Max), 0, 0.0).prescribe((1, Side::Max), 1, -1.2);
    let path = run(&crushed, at_once());
    assert!(matches!(cause(&path), Cause::StepLimited { .. }), "{:?}", path.ending);
}

#[test]
fn laws_that_end_leave_numbers_that_are_not_finite() {
    let path = run(&block(Brittle(rubber())).hold(Side::Min).prescribe(Side::Max, 0, 0.6), at_once());
    assert_eq!(cause(&path), Cause::NotFinite);
    // The path up to there is kept: the law ends where some point is stretched by 1.2.
    let path = run(&block(Brittle(rubber())).hold(Side::Min).prescribe(Side::Max, 0, 0.6), Scheme::default());
    assert_eq!(cause(&path), Cause::NotFinite);
    assert!((0.2..1.0).contains(&path.last().load), "{}", path.last().load);
    // A force that is not finite beyond half the load is refused before it is followed.
    let broken = Amplitude::Function(Arc::new(|load: f64| if load > 0.5 { f64::NAN } else { load }));
    let scene = block(rubber()).hold(Side::Min).with(Load::traction(Side::Max, [0.1, 0.0]).amplitude(broken));
    assert!(scene.discretize(&Scheme::default().particles([9, 5])).is_err());
}

#[test]
fn solvers_say_why_they_give_up() {
    let path = run(&block(rubber()).hold(Side::Min).prescribe(Side::Max, 0, 0.3), Scheme::default().solver(GivesUp));
    let Cause::LinearSolver(words) = cause(&path) else { panic!("{:?}", path.ending) };
    assert!(words.contains("out of licences"));
}

#[test]
fn a_body_that_nothing_holds_is_singular_from_the_start() {
    let path = run(&block(rubber()).traction(Side::Max, [0.1, 0.0]), Scheme::default());
    let Cause::FreeMotion { motions, friction: false } = cause(&path) else { panic!("{:?}", path.ending) };
    assert_eq!(motions.len(), 3, "{motions:?}");
}

/// A ring over a plug that is too large for it, its friction the only thing that holds the ring along the axis: named, and held by a stop
/// until there is pressure it fits without a force along the axis.
#[test]
fn fits_that_friction_alone_holds_are_named() {
    let outline = Outline::at([10.5, 0.0])
        .line("floor", [13.5, 0.0])
        .line("outer", [13.5, 3.0])
        .line("upper", [10.5, 3.0])
        .arc("bore", [10.0, 2.5], [10.5, 2.5], Turn::Left)
        .line("bore", [10.0, 0.5])
        .arc("bore", [10.5, 0.0], [10.5, 0.5], Turn::Left);
    let plug = RigidSurface::plane([10.3, 0.0], [1.0, 0.0]).interference(1.0).friction(0.2).named("plug");
    let ring = Scene::new(Region::new(outline).unwrap(), Axisymmetric, rubber()).contact("bore", plug);
    let scheme = Scheme::default().spacing(0.6);
    let path = run(&ring, scheme.clone());
    let Cause::FreeMotion { motions, friction: true } = cause(&path) else { panic!("{:?}", path.ending) };
    assert_eq!(motions[..], ["a translation along axis 1"]);
    let stop = Condition::on("floor").component(1, 0.0).named("stop");
    let stages = Stages::new("fit", ring.with(stop)).then("free", |scene| scene.without("stop")).run(&scheme).unwrap();
    let force = |stage: &StagePath<2>| stage.problem.contact(stage.path.last(), "plug").unwrap().force;
    assert!(stages.iter().all(|stage| stage.path.ending == Ending::Completed));
    let [held, free] = [force(&stages[0]), force(&stages[1])];
    assert!(held[1].abs() > 0.1 && free[1].abs() < 1e-9 && (free[0] / held[0] - 1.0).abs() < 0.01, "{held:?} {free:?}");
}

#[test]
fn what_does_not_change_can_not_be_controlled() {
    let pulled = block(rubber()).hold(Side::Min).prescribe(Side::Max, 0, 0.3);
    let problem = pulled.discretize(&Scheme::default().particles([9, 5])).unwrap();
    assert_eq!(cause(&problem.run_controlled(&Constant, &[1.0], &mut ()).unwrap()), Cause::Control);
}

/// A sphere that carries less pressure than it is given: its path has a limit point.
#[test]
fn loads_beyond_a_limit_point_are_not_followed_unasked() {
    let rubber = Rubber::neo_hookean(0.5, 1e5).unwrap();
    let sphere = Scene::new(Block::new([1.0], [1.1]), RadialSphere, rubber).pressure(Side::Min, 1.0);
    let stepping = Stepping { control: StepControl::Auto, ..Stepping::default() };
    let problem = sphere.discretize(&Scheme::default().particles([9]).stepping(stepping)).unwrap();
    let path = problem.run().unwrap();
    assert_eq!(cause(&path), Cause::LimitPoint);
    // 2 µ h/R (λ⁻¹ − λ⁻⁷) is largest at λ = 7^(1/6): 0.12 for the thin shell; the wall of a tenth carries as much to a few per cent.
    let largest = path.steps.iter().map(|step| step.state.load).fold(0.0, f64::max);
    assert!((0.09..0.13).contains(&largest), "{largest}");
}

#[test]
fn steps_of_time_are_not_taken_at_any_error() {
    let creeping = Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.4, 2.0)]).unwrap());
    let pulled = block(creeping).hold(Side::Min).prescribe(Side::Max, 0, 0.3).over_time(10.0);
    let coarse = Stepping { first: 0.5, smallest: 0.25, time_tolerance: 1e-15, ..Stepping::default() };
    let Cause::TimeError { error, tolerance } = cause(&run(&pulled, Scheme::default().stepping(coarse))) else {
        panic!("another cause")
    };
    assert!(tolerance == 1e-15 && error > tolerance, "{error}");
}

/// Where no step is too small, halves of it end with the rounding of the load.
#[test]
fn steps_end_with_rounding() {
    let brittle = block(Brittle(rubber())).hold(Side::Min).prescribe(Side::Max, 0, 0.6);
    let halved = Stepping { smallest: 1e-30, ..Stepping::default() };
    let path = run(&brittle, Scheme::default().stepping(halved));
    let Cause::Rounding { now, next } = cause(&path) else { panic!("{:?}", path.ending) };
    assert_eq!(now, path.last().load);
    assert_abs_diff_eq!(next / now, 1.0, epsilon = 4.0 * f64::EPSILON);
}

/// A column whose dead load grows at once from less to more than what it buckles under.
#[test]
fn gained_modes_are_not_taken_unseen() {
    let at_once = Amplitude::Function(Arc::new(|load: f64| if load < 0.5 { 0.1 * load } else { 1.0 }));
    let column = Scene::new(Block::new([0.0, 0.0], [1.0, 8.0]), PlaneStrain, rubber())
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Min), 0, 0.0)
        .with(Load::traction((1, Side::Max), [0.0, -0.3]).amplitude(at_once));
    let along = Stepping { control: StepControl::Load, follow: Following::Path, ..Stepping::default() };
    let problem = column.discretize(&Scheme::default().particles([3, 17]).stepping(along)).unwrap();
    let path = problem.run().unwrap();
    let Cause::Unstable { before, after } = cause(&path) else { panic!("{:?}", path.ending) };
    assert!(before == 0 && after > 0 && path.last().load < 0.5, "{before} {after}");
}

/// A sphere that carries less pressure than it is given: predicted beyond its limit point, Newton's method runs away.
#[test]
fn growing_increments_end_an_attempt() {
    let sphere = Scene::new(Block::new([1.0], [1.5]), RadialSphere, rubber()).pressure(Side::Min, 1.0);
    let equal = Stepping { control: StepControl::Load, first: 0.1, smallest: 0.1, growth: 1.0, ..Stepping::default() };
    let path = sphere.discretize(&Scheme::default().particles([9]).stepping(equal)).unwrap().run().unwrap();
    let Cause::Diverging { increment } = cause(&path) else { panic!("{:?}", path.ending) };
    assert!(increment > 0.1 && path.steps.len() > 2, "{increment} {}", path.steps.len());
}

/// A load that rises and falls again while another one rises across it: the path turns where the first is largest, by more than
/// a right angle, and no arc that may not be halved leads around the corner.
#[test]
fn arcs_do_not_run_back() {
    let table = |pairs: [(f64, f64); 3]| Amplitude::table(pairs.to_vec()).unwrap();
    let along = Load::traction(Side::Max, [0.3, 0.0]).amplitude(table([(0.0, 0.0), (0.5, 1.0), (1.0, 0.5)]));
    let across = Load::traction(Side::Max, [0.0, 0.3]).amplitude(table([(0.0, 0.0), (0.5, 0.0), (1.0, 1.0)]));
    let pulled = block(rubber()).hold(Side::Min).with(along).with(across);
    let arcs =
        Stepping { control: StepControl::ArcLength, first: 0.2, smallest: 0.2, growth: 1.0, ..Stepping::default() };
    let path = run(&pulled, Scheme::default().stepping(arcs));
    assert_eq!(cause(&path), Cause::Turned);
    assert!(path.last().load < 0.5 && path.steps.len() > 2, "{} {}", path.last().load, path.steps.len());
}

/// A plate pressed through a block onto its held face, which can't give way.
#[test]
fn a_surface_that_runs_into_held_particles_is_named() {
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -1.2]).named("plate");
    let scene = block(rubber()).hold((1, Side::Min)).contact(Part::Whole, plate);
    let why = cause(&run(&scene, Scheme::default())).to_string();
    assert!(why.contains("plate ends") && why.contains("whose displacement is prescribed"), "{why}");
}

/// A law that counts its steps, and after two of them remembers something else.
struct Forgetful(Rubber, f64);

impl Material for Forgetful {
    fn inner(&self) -> Option<&dyn Material> {
        Some(&self.0)
    }
    fn energy_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> f64 {
        self.0.energy_from(f, past.split(1).1)
    }
    fn response_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> Response {
        self.0.response_from(f, past.split(1).1)
    }
    fn memory(&self) -> usize {
        1
    }
    fn remember(&self, _: &Matrix3<f64>, past: Past<'_>, next: &mut [f64]) {
        next[0] = if past.memory[0] < 2.0 { past.memory[0] + 1.0 } else { self.1 };
    }
}

/// What is remembered of a step begins the next one, is written down and read: it is a number, or the run ends before.
#[test]
fn a_memory_that_is_no_number_ends_the_run() {
    for (spoilt, steps) in [(5.0, 4), (f64::NAN, 2), (f64::INFINITY, 2)] {
        let pulled = block(Forgetful(rubber(), spoilt)).hold(Side::Min).prescribe(Side::Max, 0, 0.2);
        let problem = pulled.discretize(&Scheme::default().particles([5, 3]).stepping(Stepping::equal(4))).unwrap();
        let path = problem.run().unwrap();
        assert_eq!(path.steps.len(), steps, "{spoilt}");
        if spoilt.is_finite() {
            assert_eq!(path.ending, Ending::Completed);
            continue;
        }
        assert!(matches!(cause(&path), Cause::Term(what) if what.contains("term 0") && what.contains("remember")));
        let (mut equilibrium, mut state) = (problem.equilibrium().unwrap(), path.last().clone());
        let refused = equilibrium.commit(path.last(), &mut state).unwrap_err();
        assert!(matches!(refused, Cause::Term(_)), "{refused}");
    }
}

/// A term without forces that breaks a promise of its trait.
struct Strays(usize);

impl Term for Strays {
    fn dim(&self) -> usize {
        2
    }
    fn nodes(&self, _: usize) -> &[u32] {
        &[3, 7]
    }
    fn linearize(&self, _: usize, _: View<'_>, out: &mut Element) {
        if self.0 == 1 {
            out.matrix.clear();
        }
    }
    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        match self.0 {
            2 => 5.0,
            3 => from - 1.0,
            4 => f64::NAN,
            _ => to,
        }
    }
    fn rounding(&self) -> [f64; 2] {
        if self.0 == 5 { [f64::NAN; 2] } else { [0.0; 2] }
    }
}

/// Terms of one's own that break their promises are named, or have no effect: no run goes beyond its load, none takes for settled what is
/// no number.
#[test]
fn broken_promises_of_terms_lead_nowhere_else() {
    let run = |how: Option<usize>| {
        let mut problem = block(rubber())
            .hold(Side::Min)
            .traction(Side::Max, [0.2, 0.0])
            .discretize(&Scheme::default().particles([5, 3]).stepping(Stepping::equal(2)))
            .unwrap();
        how.map(|how| problem.add(Strays(how)));
        problem.run()
    };
    let right = run(None).unwrap().completed().unwrap();
    for how in [0, 2] {
        let path = run(Some(how)).unwrap().completed().unwrap();
        assert_eq!(path.last().load, 1.0);
        assert_eq!(path.last().displacement, right.last().displacement, "{how}");
    }
    for how in [1, 3, 4, 5] {
        assert!(!run(Some(how)).is_ok_and(|path| path.ending == Ending::Completed), "{how}");
    }
    assert!(run(Some(1)).unwrap_err().to_string().contains("length of a buffer"));
}
