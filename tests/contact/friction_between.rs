//! Coulomb's friction between deformable bodies.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::assembly::{StateRef, System};
use rkpm::kinematics::Kinematics;
use rkpm::prelude::*;
use rkpm::solve::{EquilibriumPath, State};

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.293, 0.177, 100.0).unwrap()
}

fn on<const D: usize>(axis: usize, side: Side, body: &str) -> Place<D> {
    Place::on((axis, side)).of(body)
}

/// A block on a wider one whose top is pressed down by 0.03 and then moved along as a table says.
fn blocks(friction: f64, along: &[(f64, f64)]) -> Scene<2> {
    let mut pairs = vec![(0.0, 0.0)];
    pairs.extend(along);
    let pressed = Amplitude::table(vec![(0.0, 0.0), (0.2, 1.0), (1.0, 1.0)]).unwrap();
    Scene::assembly(PlaneStrain)
        .body("lower", Block::new([-1.0, -1.0], [2.0, 0.0]), rubber())
        .body("upper", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
        .scheme_of("lower", |scheme| scheme.particles([22, 6]))
        .scheme_of("upper", |scheme| scheme.particles([10, 7]))
        .hold(on(1, Side::Min, "lower"))
        .with(Condition::on(on(1, Side::Max, "upper")).component(1, -0.03).amplitude(pressed))
        .with(Condition::on(on(1, Side::Max, "upper")).component(0, 1.0).amplitude(Amplitude::table(pairs).unwrap()))
        .with(ContactPair::between(on(1, Side::Max, "lower"), on(1, Side::Min, "upper"), "joint").friction(friction))
}

fn run<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> (Problem<D>, EquilibriumPath) {
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

/// The work of friction in the first steps of a path.
fn dissipated(problem: &Problem<2>, path: &EquilibriumPath, steps: usize) -> f64 {
    let mut part = path.clone();
    part.steps.truncate(steps);
    problem.friction_work(&part, "joint").unwrap()
}

/// Far beyond the limit all that touches slides at μ times the normal force; below it the bodies are as if bonded by what
/// sticks, and both faces feel opposite forces.
#[test]
fn sticks_below_and_slides_at_the_limit() {
    let friction = 0.2;
    let (problem, path) = run(&blocks(friction, &[(0.2, 0.0), (1.0, 0.5)]), &Scheme::default());
    let joint = problem.contact(path.last(), "joint").unwrap();
    let ratio = joint.force[0] / joint.force[1];
    println!("ratio {ratio}, {} iterations in {} steps", path.iterations, path.steps.len());
    // Where the ends of the face dig in, normals lean by as much as the joint bends.
    assert!(joint.points.iter().filter(|p| p.is_active).any(|p| p.slips));
    // So do both faces, of which the lower one carries no pressures and has no gaps.
    let of = |joint: &rkpm::scene::ContactState<2>, carries: bool| -> Vec<bool> {
        let own = joint.points.iter().filter(|p| p.is_active && p.gap.is_finite() == carries);
        own.map(|p| p.slips).collect()
    };
    for slips in [of(&joint, true), of(&joint, false)] {
        assert!(slips.len() > 4 && slips.iter().all(|slips| *slips), "{slips:?}");
    }
    assert_abs_diff_eq!(-ratio / friction, 1.0, epsilon = 0.02);
    let base = problem.reaction(path.last(), on(1, Side::Min, "lower")).unwrap();
    let top = problem.reaction(path.last(), on(1, Side::Max, "upper")).unwrap();
    for i in 0..2 {
        assert_abs_diff_eq!(base[i], -top[i], epsilon = 1e-7 * top[1].abs());
        assert_abs_diff_eq!(joint.force[i], -base[i], epsilon = 1e-7 * top[1].abs());
    }
    let (problem, path) = run(&blocks(2.0, &[(0.2, 0.0), (1.0, 1e-3)]), &Scheme::default());
    let joint = problem.contact(path.last(), "joint").unwrap();
    assert!(joint.points.iter().filter(|p| p.is_active && !p.slips).count() > 8);
    assert!(of(&joint, false).iter().filter(|slips| !**slips).count() > 4);
    assert!(joint.force[0] > 0.0 && joint.force[0] < 0.5 * joint.force[1].abs(), "{}", joint.force);
}

/// What the moved top puts in over a closed cycle is what friction takes, up to steps whose slip is as long as a facet.
#[test]
fn a_closed_cycle_balances() {
    let cycle: Vec<(f64, f64)> =
        [0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0].into_iter().zip([0.0, 0.1, -0.1, 0.1, -0.1, 0.1, 0.1]).collect();
    let (problem, path) = run(&blocks(0.1, &cycle), &Scheme::default());
    let place = || on(1, Side::Max, "upper");
    let top = |state: &State| problem.reaction(state, place()).unwrap()[0];
    let moved = |state: &State| problem.displacement(state, &[0.5, 1.0].into()).unwrap()[0];
    let at = |load: f64| path.steps.iter().position(|step| (step.state.load - load).abs() < 1e-12).unwrap();
    let (from, to) = (at(0.6), at(0.9));
    let work: f64 = path.steps[from..=to]
        .windows(2)
        .map(|pair| (&pair[0].state, &pair[1].state))
        .map(|(a, b)| 0.5 * (top(a) + top(b)) * (moved(b) - moved(a)))
        .sum();
    let until = |last: usize| dissipated(&problem, &path, last + 1);
    let taken = until(to) - until(from);
    let kept = path.steps[to].energy - path.steps[from].energy;
    println!("work {work}, taken {taken}, kept {kept}, {} iterations in {} steps", path.iterations, path.steps.len());
    assert!(taken > 0.0, "{taken}");
    assert_abs_diff_eq!(work, taken + kept, epsilon = 3e-2 * taken);
    // Friction never gives.
    let steps: Vec<f64> = (0..path.steps.len()).map(until).collect();
    assert!(steps.windows(2).all(|pair| pair[1] >= pair[0] - 1e-12), "{steps:?}");
}

/// Of revolution: a sleeve on a shaft that is widened and then pushed along it by its outside. What slides carries μ times its pressure, point
/// by point, but for what the joint bends within a facet (normals at the ends lean, so resultants differ); axial forces balance, and while the sleeve slides its work is what friction takes
/// and bodies keep.
#[test]
fn a_sleeve_slides_along_its_shaft() {
    let friction = 0.2;
    let widened = Amplitude::table(vec![(0.0, 0.0), (0.2, 1.0), (1.0, 1.0)]).unwrap();
    let pushed = Amplitude::table(vec![(0.0, 0.0), (0.2, 0.0), (1.0, 1.0)]).unwrap();
    let scene = Scene::assembly(Axisymmetric)
        .body("shaft", Block::new([0.5, -1.0], [1.0, 2.0]), rubber())
        .body("sleeve", Block::new([1.0, 0.0], [1.5, 1.0]), rubber())
        .scheme_of("shaft", |scheme| scheme.particles([6, 22]))
        .scheme_of("sleeve", |scheme| scheme.particles([7, 10]))
        .with(Condition::on(on(0, Side::Min, "shaft")).component(0, 0.06).amplitude(widened))
        .prescribe(on(0, Side::Min, "shaft"), 1, 0.0)
        .prescribe(on(0, Side::Max, "sleeve"), 0, 0.0)
        .with(Condition::on(on(0, Side::Max, "sleeve")).component(1, 0.5).amplitude(pushed))
        .with(ContactPair::between(on(0, Side::Max, "shaft"), on(0, Side::Min, "sleeve"), "joint").friction(friction));
    let (problem, path) = run(&scene, &Scheme::default());
    let joint = problem.contact(path.last(), "joint").unwrap();
    let steps = path.steps.len();
    println!("{:?}, {} iterations in {steps} steps", joint.force, path.iterations);
    assert!(joint.points.iter().filter(|point| point.slips).count() > 8);
    let mut worst = 0.0f64;
    // Of the sleeve, which carries the pressures.
    for point in joint.points.iter().filter(|point| point.is_active && point.slips && point.gap.is_finite()) {
        let expected = point.pressure * (1.0 + friction * friction).sqrt();
        worst = worst.max((point.traction.norm() / expected - 1.0).abs());
        assert!(abs_diff_eq!(point.traction.norm() / expected, 1.0, epsilon = 0.01), "{point:?}");
    }
    let outside = |state: &State| problem.reaction(state, on(0, Side::Max, "sleeve")).unwrap()[1];
    let total = outside(path.last());
    assert_abs_diff_eq!(joint.force[1].abs(), total.abs(), epsilon = 1e-7 * total.abs());
    let moved = |state: &State| problem.displacement(state, &[1.5, 0.5].into()).unwrap()[1];
    let last = &path.steps[steps - 3..];
    let work: f64 = last
        .windows(2)
        .map(|pair| (&pair[0].state, &pair[1].state))
        .map(|(a, b)| 0.5 * (outside(a) + outside(b)) * (moved(b) - moved(a)))
        .sum();
    let until = |count: usize| dissipated(&problem, &path, count);
    let (taken, kept) = (until(steps) - until(steps - 2), last[2].energy - last[0].energy);
    println!("work {work}, taken {taken}, kept {kept}; law off by {worst:.1e}");
    assert!(taken > 0.0, "{taken}");
    assert_abs_diff_eq!(work, taken + kept, epsilon = 3e-2 * taken);
}

/// In space: a block that slides askew on another carries its friction against the way it goes.
#[test]
fn askew_in_space() {
    let friction = 0.2;
    let scene = Scene::assembly(Solid)
        .body("lower", Block::new([-0.5, -0.5, -0.5], [1.5, 1.5, 0.0]), rubber())
        .body("upper", Block::new([0.0, 0.0, 0.0], [1.0, 1.0, 0.5]), rubber())
        .scheme_of("lower", |scheme| scheme.particles([7, 7, 3]))
        .scheme_of("upper", |scheme| scheme.particles([5, 5, 3]))
        .hold(on(2, Side::Min, "lower"))
        .prescribe(on(2, Side::Max, "upper"), 2, -0.03)
        .prescribe(on(2, Side::Max, "upper"), 0, 0.24)
        .prescribe(on(2, Side::Max, "upper"), 1, 0.32)
        .with(ContactPair::between(on(2, Side::Min, "upper"), on(2, Side::Max, "lower"), "joint").friction(friction));
    let (problem, path) = run(&scene, &Scheme::default());
    let joint = problem.contact(path.last(), "joint").unwrap();
    let along = joint.force[0].hypot(joint.force[1]);
    println!(
        "{:?}, ratio {}, {} iterations in {} steps",
        joint.force,
        along / joint.force[2],
        path.iterations,
        path.steps.len()
    );
    assert_abs_diff_eq!(along / joint.force[2].abs() / friction, 1.0, epsilon = 0.03);
    assert_abs_diff_eq!(joint.force[0] / joint.force[1], 0.75, epsilon = 0.05);
    assert!(joint.force[0] < 0.0, "{}", joint.force);
}

/// Numbers in [0, 1) from a given one on.
fn drawn(mut number: f64) -> impl FnMut() -> f64 {
    move || {
        number = (number * 97.31 + 0.17).fract();
        number
    }
}

/// Two blocks that touch with particles that do not match: the upper one is moved along the lower one, so that gaps stay closed, with drawn
/// pressures and tractions. The tangent of the contact alone, its part beside the factors included, is that of central differences of its
/// forces.
fn assert_tangent<const D: usize>(kinematics: impl Kinematics<D> + 'static, friction: f64, particles: [[usize; D]; 2]) {
    let last = D - 1;
    let corner = |low: f64, along: f64| std::array::from_fn(|i| if i == last { low } else { along });
    let scene = Scene::<D>::assembly(kinematics)
        .body("lower", Block::new(corner(-1.0, 0.0), corner(0.0, 1.0)), rubber())
        .body("upper", Block::new(corner(0.0, 0.31), corner(1.0, 1.31)), rubber())
        .scheme_of("lower", move |scheme| scheme.particles(particles[0]))
        .scheme_of("upper", move |scheme| scheme.particles(particles[1]))
        .with(
            ContactPair::between(on(last, Side::Max, "lower"), on(last, Side::Min, "upper"), "joint")
                .friction(friction),
        );
    let problem = scene.discretize(&Scheme::default()).unwrap();
    let whole = problem.model();
    let term = whole.terms().iter().find(|term| term.layout().unilateral).unwrap();
    let mut model = Model::new(&problem.positions());
    model.add_shared(term.clone());
    let lower: usize = particles[0].iter().product();
    let (mut draw, mut displacement) = (drawn(0.3), vec![0.0; model.unknowns()]);
    for u in displacement[lower * D..].chunks_exact_mut(D) {
        u[..last].iter_mut().zip([0.043, 0.0271]).for_each(|(u, by)| *u = by);
    }
    let direction: Vec<f64> = displacement.iter().map(|_| draw() - 0.5).collect();
    let mut terms = model.start();
    let unknowns = term.unknowns(0);
    for unknowns in terms[0].condensed[unknowns].chunks_exact_mut(1 + D) {
        unknowns[0] = 1e3 * (1.0 + draw());
        unknowns[1..D].iter_mut().for_each(|traction| *traction = 30.0 * draw());
    }
    let mut assembler = model.assembler();
    let mut at = |part: f64| {
        let moved: Vec<f64> = displacement.iter().zip(&direction).map(|(d, v)| d + part * v).collect();
        let mut system = System::default();
        assembler.assemble(&model, StateRef::new(&moved, &terms, 0.0), &mut system).unwrap();
        let mut product = vec![0.0; moved.len()];
        assembler.pattern().multiply_add(&system.values, &direction, &mut product);
        system.skew_multiply_add(&direction, &mut product);
        (system.residual, product)
    };
    let step = 1e-7;
    let ((ahead, _), (behind, _), (_, found)) = (at(step), at(-step), at(0.0));
    let largest = found.iter().fold(0.0f64, |largest, f| largest.max(f.abs()));
    assert!(largest > 0.0);
    let difference = |((a, b), f): ((&f64, &f64), &f64)| (f - (a - b) / (2.0 * step)).abs() / largest;
    let worst = ahead.iter().zip(&behind).zip(&found).map(difference).fold(0.0, f64::max);
    println!("friction {friction} in {D}D: off by {worst:e}");
    // What slides in space turns with its slip, by as much as the matrix knows at rest, where slip and traction are parallel: drawn ones are not.
    assert!(worst < if D == 3 && friction < 1.0 { 1e-4 } else { 1e-6 }, "{worst:e}");
}

#[test]
fn tangents_are_differences_of_forces() {
    // All sticks with the first one, all slides with the second.
    for friction in [2.0, 0.01] {
        assert_tangent(PlaneStrain, friction, [[8, 4], [6, 4]]);
        assert_tangent(Axisymmetric, friction, [[8, 4], [6, 4]]);
        assert_tangent(Solid, friction, [[4, 4, 3], [3, 3, 3]]);
    }
}
