//! Bodies against each other, and a body against itself.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::assembly::{StateRef, System};
use rkpm::prelude::*;
use rkpm::solve::EquilibriumPath;

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.293, 0.177, 1410.0).unwrap()
}

fn solved<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> (Problem<D>, EquilibriumPath) {
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

/// A rectangle over [0, 1] whose sides carry names with a prefix.
fn rectangle(prefix: &str, low: f64, high: f64) -> Region {
    let name = |side: &str| format!("{prefix} {side}");
    let outline = Outline::at([0.0, low])
        .line(&name("bottom"), [1.0, low])
        .line(&name("right"), [1.0, high])
        .line(&name("top"), [0.0, high])
        .close(&name("left"));
    Region::new(outline).unwrap()
}

/// The contact patch test: a block that comes down on another across a gap under a uniform traction, with particles that match and ones
/// that don't, scattered, on lattices, and of revolution: the pressure on either face is uniform to 1e-8.
#[test]
fn uniform_pressure_between_blocks() {
    let pressed = |name: &str, scene: &Scene<2>, scheme: &Scheme| {
        let (problem, path) = solved(scene, scheme);
        let joint = problem.contact(path.last(), "joint").unwrap();
        let f = problem.deformation_gradients(path.last()).unwrap()[0];
        let stretch = f.determinant() / f[(1, 1)];
        let off = |point: &rkpm::scene::ContactPoint<2>| (point.pressure * stretch / 0.3 - 1.0).abs();
        let worst = joint.points.iter().map(off).fold(0.0, f64::max);
        println!("{name}: pressures uniform to {worst:e}, {} factorisations", path.iterations);
        assert!(worst < 1e-8 && joint.points.len() >= 8, "{name}: {worst:e} {:#?}", joint.points);
        // The force is that on the part named first.
        assert!(joint.force[1] < 0.0, "{}", joint.force);
    };
    let scattered = |particles: [usize; 2]| {
        Scene::assembly(PlaneStrain)
            .body("lower", rectangle("lower", 0.0, 1.0), rubber())
            .body("upper", rectangle("upper", 1.8, 2.8), rubber())
            .scheme_of("lower", move |scheme| scheme.particles([particles[0]]).seed(1))
            .scheme_of("upper", move |scheme| scheme.particles([particles[1]]).seed(2))
            .prescribe("lower bottom", 1, 0.0)
            .prescribe("lower left", 0, 0.0)
            .prescribe("upper left", 0, 0.0)
            .traction("upper top", [0.0, -0.3])
            .contact_between("lower top", "upper bottom", "joint")
    };
    pressed("scattered, alike", &scattered([7, 7]), &Scheme::default());
    pressed("scattered, 8 on 5", &scattered([8, 5]), &Scheme::default());
    let blocks = |kinematics: bool| {
        let scene = if kinematics { Scene::assembly(PlaneStrain) } else { Scene::assembly(Axisymmetric) };
        scene
            .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
            .body("upper", Block::new([0.0, 1.4], [1.0, 2.0]), rubber())
            .scheme_of("lower", |scheme| scheme.particles([6, 5]))
            .scheme_of("upper", |scheme| scheme.particles([9, 5]))
            .prescribe(Place::on((1, Side::Min)).of("lower"), 1, 0.0)
            .prescribe(Place::on((0, Side::Min)).of("lower"), 0, 0.0)
            .prescribe(Place::on((0, Side::Min)).of("upper"), 0, 0.0)
            .traction(Place::on((1, Side::Max)).of("upper"), [0.0, -0.3])
            .contact_between(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "joint")
    };
    pressed("lattices", &blocks(true), &Scheme::default());
    pressed("of revolution", &blocks(false), &Scheme::default());
}

/// Two equal cylinders pressed on each other do what one does on a rigid plane.
#[test]
fn two_cylinders_and_a_plane() {
    let gap = 0.6;
    let lower =
        Outline::at([0.0, 0.0]).line("base", [1.0, 0.0]).arc("low", [0.0, 1.0], [0.0, 0.0], Turn::Left).close("axis");
    let upper = Outline::at([0.0, 1.0 + gap])
        .arc("high", [1.0, 2.0 + gap], [0.0, 2.0 + gap], Turn::Left)
        .line("roof", [0.0, 2.0 + gap])
        .close("axis above");
    let (lower, upper) = (Region::new(lower).unwrap(), Region::new(upper).unwrap());
    let closure = 0.3;
    let plane = Scene::new(lower.clone(), PlaneStrain, rubber())
        .prescribe("base", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .contact("low", RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -closure]).named("plate"));
    let scheme = Scheme::default().particles([13]);
    let (problem, path) = solved(&plane, &scheme);
    let one = problem.contact(path.last(), "plate").unwrap();
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", lower, rubber())
        .body("upper", upper, rubber())
        .scheme_of("upper", |scheme| scheme.seed(2))
        .prescribe("base", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .prescribe("axis above", 0, 0.0)
        .prescribe("roof", 1, -gap - 2.0 * closure)
        .contact_between("low", "high", "joint");
    let (problem, path) = solved(&scene, &scheme);
    let two = problem.contact(path.last(), "joint").unwrap();
    let (force, width) = (two.force[1] / one.force[1] - 1.0, two.extent / one.extent - 1.0);
    println!(
        "force off by {force:e}, width by {width:e}, {} steps, {} factorisations",
        path.steps.len(),
        path.iterations
    );
    assert!(force.abs() < 5e-3, "force off by {force:e}, width by {width:e}");
    assert!(width.abs() < 0.05, "width off by {width:e}");
}

/// The patch test between two bodies in space whose particles match, across a gap.
#[test]
fn uniform_pressure_in_space() {
    for counts in [[3, 3, 3], [4, 6, 3], [7, 5, 3]] {
        let (problem, path) = solved(&cubes(counts, counts), &Scheme::default());
        let joint = problem.contact(path.last(), "joint").unwrap();
        let f = problem.deformation_gradients(path.last()).unwrap()[0];
        let stretch = f.determinant() / f[(2, 2)];
        for point in &joint.points {
            let pressure = point.pressure * stretch;
            assert!(
                relative_eq!(pressure, 0.3, max_relative = 1e-8),
                "{pressure} at {:?} of {counts:?}",
                point.reference
            );
        }
        assert_eq!(joint.points.len(), 2 * counts[0] * counts[1]);
        assert!(
            abs_diff_eq!(joint.force[2], -0.3, epsilon = 1e-9)
                && relative_eq!(joint.extent, stretch, max_relative = 1e-8),
            "{joint:?}"
        );
    }
}

/// Two cubes across a gap, each with its own particles; the upper one is pressed down by a uniform traction.
fn cubes(lower: [usize; 3], upper: [usize; 3]) -> Scene<3> {
    Scene::assembly(Solid)
        .body("lower", Block::new([0.0; 3], [1.0, 1.0, 1.0]), rubber())
        .body("upper", Block::new([0.0, 0.0, 1.3], [1.0, 1.0, 2.3]), rubber())
        .scheme_of("lower", move |scheme| scheme.particles(lower))
        .scheme_of("upper", move |scheme| scheme.particles(upper))
        .prescribe(Place::on((2, Side::Min)).of("lower"), 2, 0.0)
        .prescribe(Place::on((0, Side::Min)).of("lower"), 0, 0.0)
        .prescribe(Place::on((1, Side::Min)).of("lower"), 1, 0.0)
        .prescribe(Place::on((0, Side::Min)).of("upper"), 0, 0.0)
        .prescribe(Place::on((1, Side::Min)).of("upper"), 1, 0.0)
        .traction(Place::on((2, Side::Max)).of("upper"), [0.0, 0.0, -0.3])
        .contact_between(Place::on((2, Side::Max)).of("lower"), Place::on((2, Side::Min)).of("upper"), "joint")
}

/// How far pressures between two cubes are from uniform, each with its own particles, where facets are cut into `parts` per direction.
fn off_uniform(lower: [usize; 3], upper: [usize; 3], parts: usize) -> f64 {
    let (problem, path) = solved(&cubes(lower, upper), &Scheme::default().rule(rkpm::scene::Rule::Smoothed { parts }));
    let joint = problem.contact(path.last(), "joint").unwrap();
    let f = problem.deformation_gradients(path.last()).unwrap()[0];
    let stretch = f.determinant() / f[(2, 2)];
    let worst = joint.points.iter().map(|point| (point.pressure * stretch / 0.3 - 1.0).abs()).fold(0.0, f64::max);
    println!("{lower:?} on {upper:?}, {parts} parts: {worst:e}, {} iterations", path.iterations);
    assert_relative_eq!(joint.force[2], -0.3, max_relative = 1e-8);
    worst
}

/// The same where particles do not match, in ratios of 2, 4 : 5 and 7 : 8, and in others drawn for each axis.
#[test]
fn pressure_in_space_where_particles_do_not_match() {
    for (lower, upper) in [
        ([3, 3, 3], [5, 5, 3]),
        ([4, 4, 3], [5, 5, 3]),
        ([7, 7, 3], [8, 8, 3]),
        ([6, 4, 3], [5, 9, 3]),
        ([7, 5, 3], [4, 6, 3]),
    ] {
        let worst = off_uniform(lower, upper, 2);
        assert!(worst < 1e-8, "{lower:?} on {upper:?}: {worst:e}");
    }
}

/// The same whatever the parts are that facets are cut into for the smoothing.
#[test]
fn pressure_does_not_depend_on_parts_of_facets() {
    assert!(off_uniform([4, 4, 3], [5, 5, 3], 3) < 1e-8);
}

/// Finite elements of either order that lie on each other, in the plane and in space: a uniform pressure over all of the joint, whether
/// nodes match or not.
#[test]
fn uniform_pressure_between_elements() {
    fn joint<const D: usize>(kinematics: impl Kinematics<D> + 'static, scheme: &Scheme, upper: usize) {
        let up = D - 1;
        let block = |low: f64, high: f64| {
            let (mut min, mut max) = ([0.0; D], [1.0; D]);
            (min[up], max[up]) = (low, high);
            Block::new(min, max)
        };
        let mut traction = [0.0; D];
        traction[up] = -0.3;
        let on = |axis: usize, side: Side, of: &str| Place::<D>::on((axis, side)).of(of);
        let mut scene = Scene::assembly(kinematics)
            .body("lower", block(0.0, 1.0), rubber())
            .body("upper", block(1.0, 1.8), rubber())
            .scheme_of("upper", move |scheme| scheme.particles([upper; D]))
            .prescribe(on(up, Side::Min, "lower"), up, 0.0)
            .traction(on(up, Side::Max, "upper"), traction)
            .contact_between(on(up, Side::Max, "lower"), on(up, Side::Min, "upper"), "joint");
        for axis in 0..up {
            scene = scene.prescribe(on(axis, Side::Min, "lower"), axis, 0.0).prescribe(
                on(axis, Side::Min, "upper"),
                axis,
                0.0,
            );
        }
        let (problem, path) = solved(&scene, scheme);
        let joint = problem.contact(path.last(), "joint").unwrap();
        let f = problem.deformation_gradients(path.last()).unwrap()[0];
        let stretch = f.determinant() / f[(up, up)];
        let worst = joint.points.iter().map(|point| (point.pressure * stretch / 0.3 - 1.0).abs()).fold(0.0, f64::max);
        println!("{D}, {upper} nodes: {worst:e}");
        let nodes = 5usize.pow(up as u32) + upper.pow(up as u32);
        assert!(worst < 1e-8 && joint.points.len() == nodes, "{D}, {upper}: {worst:e} {:#?}", joint.points);
    }
    for order in [1, 2] {
        for upper in [5, 7] {
            joint::<2>(PlaneStrain, &Scheme::elements(order).particles([5, 5]), upper);
            joint::<3>(Solid, &Scheme::elements(order).particles([5, 5, 5]), upper);
        }
    }
}

/// Forces that two bodies put on each other, at drawn displacements that bend both faces and drawn pressures: they have neither a sum nor a
/// moment.
fn assert_balance<const D: usize>(kinematics: impl Kinematics<D> + 'static, scheme: &Scheme) {
    let last = D - 1;
    let corner = |low: f64, along: f64| std::array::from_fn(|i| if i == last { low } else { along });
    let on = |side: Side, body: &str| Place::<D>::on((last, side)).of(body);
    let scene = Scene::<D>::assembly(kinematics)
        .body("lower", Block::new(corner(-1.0, 0.0), corner(0.0, 1.0)), rubber())
        .body("upper", Block::new(corner(0.0, 0.31), corner(1.0, 1.31)), rubber())
        .scheme_of("upper", |scheme| scheme.particles([7; D]))
        .contact_between(on(Side::Max, "lower"), on(Side::Min, "upper"), "joint");
    let problem = scene.discretize(scheme).unwrap();
    let (whole, positions) = (problem.model(), problem.positions());
    let term = whole.terms().iter().find(|term| term.layout().unilateral).unwrap();
    let mut model = Model::new(&positions);
    model.add_shared(term.clone());
    let mut number: f64 = 0.3;
    let mut draw = || {
        number = (number * 97.31 + 0.17).fract();
        number
    };
    let displacement: Vec<f64> = (0..model.unknowns()).map(|_| 0.04 * (draw() - 0.5)).collect();
    let mut terms = model.start();
    terms[0].condensed.iter_mut().for_each(|pressure| *pressure = 1e3 * (1.0 + draw()));
    let mut system = System::default();
    model.assembler().assemble(&model, StateRef::new(&displacement, &terms, 0.0), &mut system).unwrap();
    let (mut force, mut moment, mut size) = (Point::<D>::zeros(), 0.0f64, 0.0);
    let forces = system.residual.chunks_exact(D).zip(displacement.chunks_exact(D)).zip(&positions);
    let (mut sums, axes) = ([0.0; 3], [(0, 1), (1, 2), (2, 0)]);
    for ((f, u), x) in forces {
        let at = x + Point::<D>::from_column_slice(u);
        let f = Point::<D>::from_column_slice(f);
        force += f;
        size += f.norm();
        for (sum, (i, j)) in sums.iter_mut().zip(axes).filter(|(_, (i, j))| *i < D && *j < D) {
            *sum += at[i] * f[j] - at[j] * f[i];
        }
    }
    sums.iter().for_each(|sum| moment = moment.max(sum.abs()));
    println!("{D}: sums of {:e} and {:e} of {size}", force.amax(), moment);
    assert!(size > 1.0, "{size}");
    assert_abs_diff_eq!(force, Point::<D>::zeros(), epsilon = 1e-12 * size);
    assert_abs_diff_eq!(moment, 0.0, epsilon = 1e-12 * size);
}

#[test]
fn forces_and_moments_balance() {
    assert_balance::<2>(PlaneStrain, &Scheme::default().particles([5, 5]));
    assert_balance::<3>(Solid, &Scheme::default().particles([5, 5, 5]));
    for order in [1, 2] {
        let scheme = Scheme::elements(order).particles([5; 3]);
        assert_balance::<3>(Solid, &scheme);
    }
}

/// Two blocks that share a face: what a contact is said for opens, the rest stays bonded.
#[test]
fn faces_in_contact_are_not_bonded() {
    let opened = |half: bool| {
        let side = move |x: &Point<2>| !half || x[0] > 1.0;
        let scene = Scene::assembly(PlaneStrain)
            .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
            .body("upper", Block::new([0.0, 1.0], [2.0, 2.0]), rubber())
            .hold(Place::on((1, Side::Min)).of("lower"))
            .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.0, 0.2]).named("pulled"))
            .contact_between(
                Place::on((1, Side::Max)).of("lower").within(side),
                Place::on((1, Side::Min)).of("upper").within(side),
                "joint",
            );
        let (problem, path) = solved(&scene, &Scheme::default().particles([9, 5]));
        let jump = |x: f64| {
            let at = Point::<2>::new(x, 1.0);
            let of = |body: usize| problem.discrete_bodies()[body].displacement(path.last(), &at).unwrap();
            (of(1) - of(0)).norm()
        };
        ([0.25, 0.5, 1.75].map(jump), problem.reaction(path.last(), "pulled").unwrap()[1])
    };
    let ([a, b, c], force) = opened(true);
    assert!(a < 5e-3 && b < 5e-3 && c > 0.05 && force > 0.1, "{a} {b} {c} {force}");
    let (jumps, force) = opened(false);
    assert_abs_diff_eq!(jumps[..], [0.2; 3][..], epsilon = 1e-6);
    assert_abs_diff_eq!(force, 0.0, epsilon = 1e-6);
}

/// Two blocks with a gap between them, of which the one whose face carries the pressures stands still and the other comes down, or the reverse,
/// by much more than opposite facets are looked for, in one step: they meet as they do in ten.
fn assert_met<const D: usize>(kinematics: impl Kinematics<D> + Clone + 'static, gap: f64, particles: [[usize; D]; 2]) {
    let up = D - 1;
    let block = |low: f64| {
        let (mut min, mut max) = ([0.0; D], [1.0; D]);
        (min[up], max[up]) = (low, low + 0.5);
        Block::new(min, max)
    };
    let on = |side: Side, of: &str| Place::<D>::on((up, side)).of(of);
    let force = |fine: usize, stepping: Stepping| {
        let mut by = [0.0; D];
        by[up] = -gap - 0.25;
        let scene = Scene::assembly(kinematics.clone())
            .body("lower", block(0.0), rubber())
            .body("upper", block(0.5 + gap), rubber())
            .scheme_of("lower", move |scheme| scheme.particles(particles[fine]))
            .scheme_of("upper", move |scheme| scheme.particles(particles[1 - fine]))
            .hold(on(Side::Min, "lower"))
            .with(Condition::on(on(Side::Max, "upper")).displacement(by))
            .contact_between(on(Side::Max, "lower"), on(Side::Min, "upper"), "joint");
        let (problem, path) = solved(&scene, &Scheme::default().stepping(stepping));
        problem.contact(path.last(), "joint").unwrap().force[up]
    };
    for fine in [0, 1] {
        let [found, expected] = [Stepping::default(), Stepping::equal(10)].map(|stepping| force(fine, stepping));
        println!("{D}, {fine}: {found} and {expected}");
        assert!(expected < -0.01, "{expected}");
        assert_relative_eq!(found, expected, max_relative = 1e-6);
    }
}

#[test]
fn faces_that_come_from_afar_do_not_pass_each_other() {
    assert_met::<2>(PlaneStrain, 10.0, [[31, 5], [21, 5]]);
    assert_met::<3>(Solid, 1.2, [[11, 11, 3], [9, 9, 3]]);
}

/// Thin blocks that may touch with all of their boundary: the far side of one body is not in contact with that of the other one, through both,
/// however few particles are across. The force is that of the faces which meet.
#[test]
fn far_sides_of_thin_bodies_do_not_touch() {
    let force = |whole: bool| {
        let face = |side: Side, of: &str| {
            let part = if whole { Part::Whole } else { (1, side).into() };
            Place::<2>::on(part).of(of)
        };
        let scene = Scene::assembly(PlaneStrain)
            .body("lower", Block::new([0.0, 0.0], [10.0, 0.5]), rubber())
            .body("upper", Block::new([0.0, 0.5], [10.0, 1.0]), rubber())
            .hold(Place::on((1, Side::Min)).of("lower"))
            .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.0, -0.01]))
            .contact_between(face(Side::Max, "lower"), face(Side::Min, "upper"), "joint");
        let (problem, path) = solved(&scene, &Scheme::default().particles([11, 3]));
        problem.contact(path.last(), "joint").unwrap().force[1]
    };
    let [whole, named] = [true, false].map(force);
    assert!(named < -0.01, "{named}");
    assert_relative_eq!(whole, named, max_relative = 1e-7);
}

/// A block that comes to touch in a first step and is pressed in a second one, which is predicted from the first: however fine the
/// particles, the prediction ends before it leaves the depth in which opposite facets are looked for.
#[test]
fn predicted_steps_do_not_go_through_what_touches() {
    let square = |at: [f64; 2], width: f64, names: [&str; 2]| {
        let outline = Outline::at(at).line(names[0], [at[0] + width, at[1]]).line("side", [at[0] + width, at[1] + 0.5]);
        Region::new(outline.line(names[1], [at[0], at[1] + 0.5]).close("side")).unwrap()
    };
    let material = || Rubber::neo_hookean(0.5, 100.0).unwrap();
    let energy = |spacing: f64, predict: bool| {
        let stepping = Stepping { first: 0.5, largest: 0.5, predict, ..Stepping::default() };
        let scene = Scene::assembly(PlaneStrain)
            .body("lower", square([0.0, 0.0], 2.0, ["base", "face"]), material())
            .body("upper", square([0.75, 0.58], 0.5, ["other", "roof"]), material())
            .hold("base")
            .with(Condition::on("roof").displacement([0.0, -0.17]))
            .contact_between("face", "other", "joint");
        let (problem, path) = solved(&scene, &Scheme::default().spacing(spacing).stepping(stepping));
        problem.energy(path.last()).unwrap()
    };
    for spacing in [0.06, 0.03] {
        let [predicted, plain] = [true, false].map(|predict| energy(spacing, predict));
        assert!(plain > 0.003, "{plain}");
        assert_relative_eq!(predicted, plain, max_relative = 1e-8);
    }
}
