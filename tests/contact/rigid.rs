//! A body against rigid surfaces, without friction.

use std::f64::consts::PI;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::error::Cause;
use rkpm::prelude::*;
use rkpm::solve::{Ending, EquilibriumPath};

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.293, 0.177, 1410.0).unwrap()
}

fn solved<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> (Problem<D>, EquilibriumPath) {
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

fn square(size: f64) -> Region {
    let outline = Outline::at([0.0, 0.0]).line("bottom", [size, 0.0]).line("right", [size, size]);
    Region::new(outline.line("top", [0.0, size]).close("left")).unwrap()
}

/// The contact patch test: a block that lies on a plane under a uniform traction has a uniform pressure, on lattices, from
/// scattered particles, in the plane, of revolution and in space.
#[test]
fn uniform_pressure_under_uniform_traction() {
    fn check<const D: usize>(name: &str, problem: &Problem<D>, path: &EquilibriumPath, axis: usize, traction: f64) {
        let floor = problem.contact(path.last(), "floor").unwrap();
        let stretch = {
            let f = problem.deformation_gradients(path.last()).unwrap()[0];
            f.determinant() / f[(axis, axis)]
        };
        for point in &floor.points {
            let pressure = point.pressure * stretch;
            assert!(
                point.is_active && relative_eq!(pressure, traction, max_relative = 1e-8),
                "{name}: {pressure} at {:?}",
                point.reference
            );
            assert_abs_diff_eq!(point.gap, 0.0, epsilon = 1e-10);
        }
    }
    let floor = || RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).named("floor");
    let lattice = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber())
        .traction((1, Side::Max), [0.0, -0.4])
        .contact((1, Side::Min), floor());
    let jittered = Scheme::default().particles([7, 6]).layout(Layout::Jittered { amount: 0.2, seed: 3 });
    let elements = [1, 2].map(|order| Scheme::elements(order).particles([7, 7]));
    for scheme in [Scheme::default().particles([7, 6]), jittered].into_iter().chain(elements) {
        let (problem, path) = solved(&lattice, &scheme);
        check("lattice", &problem, &path, 1, 0.4);
    }
    let scattered =
        Scene::new(square(1.0), PlaneStrain, rubber()).traction("top", [0.0, -0.4]).contact("bottom", floor());
    let (problem, path) = solved(&scattered, &Scheme::default().particles([9]).seed(5));
    check("scattered", &problem, &path, 1, 0.4);
    let turned = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), Axisymmetric, rubber())
        .prescribe((0, Side::Min), 0, 0.0)
        .traction((1, Side::Max), [0.0, -0.4])
        .contact((1, Side::Min), floor());
    let (problem, path) = solved(&turned, &Scheme::default().particles([6, 5]));
    check("of revolution", &problem, &path, 1, 0.4);
    let solid = Scene::new(Block::new([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]), Solid, rubber())
        .traction((2, Side::Max), [0.0, 0.0, -0.4])
        .contact((2, Side::Min), RigidSurface::plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).named("floor"));
    let (problem, path) = solved(&solid, &Scheme::default().particles([4, 4, 4]));
    check("solid", &problem, &path, 2, 0.4);
}

/// Hertz: a cylinder pressed by 1 % of its diameter between plates, incompressible: half-width and peak pressure by the force
/// that was found.
#[test]
fn hertz() {
    let (radius, closure) = (0.2, 0.004);
    let outline = Outline::at([0.0, 0.0])
        .line("equator", [radius, 0.0])
        .arc("outer", [0.0, radius], [0.0, 0.0], Turn::Left)
        .close("axis");
    let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber())
        .prescribe("equator", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .contact("outer", RigidSurface::plane([0.0, radius], [0.0, -1.0]).moving([0.0, -0.5 * closure]).named("plate"));
    // Spacings that grow away from the line of contact.
    let grading = move |x: &[f64]| (x[0] * x[0] + (x[1] - radius).powi(2)).sqrt().max(0.01) / radius;
    let (problem, path) = solved(&scene, &Scheme::default().particles([25]).graded(grading));
    let plate = problem.contact(path.last(), "plate").unwrap();
    let force = -2.0 * plate.force[1];
    let modulus = 4.0 * 2.0 * (0.293 + 0.177);
    let half_width = (4.0 * force * radius / (PI * modulus)).sqrt();
    let peak = 2.0 * force / (PI * half_width);
    let found = (plate.extent / half_width - 1.0, plate.peak_pressure() / peak - 1.0);
    assert!(found.0.abs() < 0.03 && found.1.abs() < 0.03, "width and peak off by {found:?}");
}

/// Metres or millimetres, with pascals, megapascals or gigapascals: the same steps, iterations and digits.
#[test]
fn units_do_not_matter() {
    let run = |metre: f64, pascal: f64| {
        let material = Rubber::mooney_rivlin(0.293 * pascal, 0.177 * pascal, 1410.0 * pascal).unwrap();
        let scene = Scene::new(square(metre), PlaneStrain, material)
            .prescribe("left", 0, 0.0)
            .traction("top", [0.0, -0.1 * pascal])
            .contact("bottom", RigidSurface::shaft([0.3 * metre, -0.7 * metre], 0.5 * metre).named("die"));
        let (problem, path) = solved(&scene, &Scheme::default().particles([9]));
        let die = problem.contact(path.last(), "die").unwrap();
        let loads: Vec<f64> = path.steps.iter().map(|step| step.state.load).collect();
        ((loads, path.iterations), die.force[1] / (metre * pascal), die.extent / metre)
    };
    let first = run(1.0, 1.0);
    for metre in [1.0, 1e3] {
        // From megapascals.
        for pascal in [1e6, 1.0, 1e-3] {
            let other = run(metre, pascal);
            assert_eq!(first.0, other.0, "{metre} {pascal}");
            let off = [first.1 / other.1 - 1.0, first.2 / other.2 - 1.0];
            println!("{metre} {pascal}: force and width differ by {off:?}");
            assert!(off.iter().all(|off| off.abs() < 1e-10), "{first:?} {other:?}");
        }
    }
    // It began with a gap, and nothing but the die holds it against the traction.
    assert_abs_diff_eq!(first.1, 0.1, epsilon = 1e-10);
}

/// A plate that a force pushes onto a cylinder across a gap: it travels, touches and carries its force; what a plate that is
/// moved as far carries is the same.
#[test]
fn pushed_and_moved_plates_agree() {
    let outline = Outline::at([0.0, 0.0])
        .line("equator", [1.0, 0.0])
        .arc("outer", [0.0, 1.0], [0.0, 0.0], Turn::Left)
        .close("axis");
    let region = Region::new(outline).unwrap();
    let body =
        || Scene::new(region.clone(), PlaneStrain, rubber()).prescribe("equator", 1, 0.0).prescribe("axis", 0, 0.0);
    let plane = || RigidSurface::plane([0.0, 1.3], [0.0, -1.0]).named("plate");
    let scheme = Scheme::default().particles([9]);
    let (problem, path) = solved(&body().contact("outer", plane().pushed([0.0, -0.3])), &scheme);
    let pushed = problem.contact(path.last(), "plate").unwrap();
    assert_abs_diff_eq!(pushed.force[1], -0.3, epsilon = 1e-9);
    assert!(pushed.travel[1] < -0.35 && pushed.travel[0] == 0.0, "{:?}", pushed.travel);
    let (problem, path) = solved(&body().contact("outer", plane().moving([0.0, pushed.travel[1]])), &scheme);
    let moved = problem.contact(path.last(), "plate").unwrap();
    assert_relative_eq!(moved.force[1], pushed.force[1], max_relative = 1e-8);
}

/// Two plates on one cylinder that nothing else holds along their way: one carries what the other does.
#[test]
fn plates_balance() {
    let outline = Outline::at([0.0, -1.0]).arc("outer", [0.0, 1.0], [0.0, 0.0], Turn::Left).close("axis");
    let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber())
        .prescribe("axis", 0, 0.0)
        .contact("outer", RigidSurface::plane([0.0, 1.2], [0.0, -1.0]).moving([0.0, -0.5]).named("upper"))
        .contact("outer", RigidSurface::plane([0.0, -1.0], [0.0, 1.0]).named("lower"));
    let (problem, path) = solved(&scene, &Scheme::default().particles([12]));
    let [upper, lower] = ["upper", "lower"].map(|name| problem.contact(path.last(), name).unwrap().force[1]);
    assert!(lower > 0.1);
    assert_relative_eq!(upper, -lower, max_relative = 1e-10);
}

/// No trace function is pulled, no trace function goes in, and where one presses there is no gap: on a body that corners, a plane and a bore touch.
#[test]
fn complementarity() {
    let groove = rkpm::contact::Profile::at([0.7, 1.0]).line([0.4, -0.1]).line([-0.4, -0.1]).line([-0.7, 1.0]);
    let outline = Outline::circle("outer", [0.0, 0.55], 0.5);
    let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber())
        .contact("outer", RigidSurface::profile(groove).named("groove"))
        .contact("outer", RigidSurface::shaft([0.1, 1.4], 0.3).moving([0.0, -0.4]).named("shaft"));
    let (problem, path) = solved(&scene, &Scheme::default().particles([12]));
    let mut total = Point::<2>::zeros();
    for name in ["groove", "shaft"] {
        let contact = problem.contact(path.last(), name).unwrap();
        total += contact.force;
        let mut pressed = 0;
        for point in &contact.points {
            assert!(point.pressure >= 0.0 && point.gap > -1e-9, "{name}: {point:?}");
            assert!(point.pressure == 0.0 || abs_diff_eq!(point.gap, 0.0, epsilon = 1e-9), "{name}: {point:?}");
            pressed += usize::from(point.pressure > 0.0);
        }
        assert!(pressed >= 3, "{name}: {pressed}");
    }
    assert_abs_diff_eq!(total, Point::<2>::zeros(), epsilon = 5e-7);
}

/// A place with a name, and some of a face, touch as parts do.
#[test]
fn places_touch_as_parts_do() {
    let block = || {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
            .hold((1, Side::Min))
            .name("lid side", (1, Side::Max))
    };
    let die = || RigidSurface::shaft([0.5, 1.6], 0.6).moving([0.0, -0.1]).named("die");
    let scheme = Scheme::default().particles([17, 9]);
    let force = |scene: Scene<2>| {
        let (problem, path) = solved(&scene, &scheme);
        problem.contact(path.last(), "die").unwrap().force[1]
    };
    let whole = force(block().contact((1, Side::Max), die()));
    assert_eq!(whole, force(block().contact("lid side", die())));
    let left = Place::on("lid side").within(|x: &Point<2>| x[0] < 1.0);
    assert_abs_diff_eq!(force(block().contact(left, die())) / whole, 1.0, epsilon = 1e-9);
}

/// The hull of a mesh carries what a plane does where it is flat.
#[test]
fn hulls_press_as_planes_do() {
    use rkpm::mesh::{CellShape, Mesh};
    let corner = |k: usize| -> Point<3> {
        [(k % 2) as f64 * 4.0 - 1.5, ((k / 2) % 2) as f64 * 4.0 - 1.5, 1.1 + (k / 4) as f64].into()
    };
    let cells = vec![0, 1, 3, 2, 4, 5, 7, 6];
    let lid = Mesh::new((0..8).map(corner).collect(), &[(CellShape::Hexahedron, cells)], &[]).unwrap();
    let force = |surface: RigidSurface<3>| {
        let scene = Scene::new(Block::new([0.0; 3], [1.0, 1.0, 1.0]), Solid, rubber())
            .hold((2, Side::Min))
            .contact((2, Side::Max), surface.moving([0.0, 0.0, -0.25]).named("lid"));
        let (problem, path) = solved(&scene, &Scheme::default().particles([4, 4, 4]));
        problem.contact(path.last(), "lid").unwrap().force[2]
    };
    let (hull, plane) = (
        force(RigidSurface::solid(&Solid3::of_mesh(&lid).unwrap())),
        force(RigidSurface::plane([0.0, 0.0, 1.1], [0.0, 0.0, -1.0])),
    );
    assert!(plane < -0.1);
    assert_relative_eq!(hull, plane, max_relative = 1e-9);
}

/// Six plates that come in upon all faces of a block by their ways.
fn between_plates(block: impl Domain<3> + 'static, rubber: Rubber, ways: [f64; 3]) -> Scene<3> {
    let mut scene = Scene::new(block, Solid, rubber);
    for axis in 0..3 {
        for (side, sign) in [(Side::Min, -1.0), (Side::Max, 1.0)] {
            let along = |length: f64| std::array::from_fn(|i| if i == axis { length } else { 0.0 });
            let plate = RigidSurface::plane(along(sign), along(-sign)).moving(along(-sign * ways[axis]));
            scene = scene.contact((axis, side), plate.named(&format!("{axis} {sign}")));
        }
    }
    scene
}

/// The forces of the plates along each axis, which balance each other and leave no moment.
fn balanced(problem: &Problem<3>, path: &EquilibriumPath) -> [f64; 3] {
    let (mut moment, mut arms) = (Point::<3>::zeros(), 0.0);
    let forces = std::array::from_fn(|axis| {
        let [low, high] = ["-1", "1"].map(|sign| problem.contact(path.last(), &format!("{axis} {sign}")).unwrap());
        assert!(low.force[axis] > 0.1);
        assert_relative_eq!(high.force[axis], -low.force[axis], max_relative = 1e-8);
        moment += low.moment + high.moment;
        arms += low.force.norm();
        low.force[axis]
    });
    assert_abs_diff_eq!(moment, Point::<3>::zeros(), epsilon = 5e-9 * arms);
    forces
}

/// A cube that six plates hold and lock: they leave it no way but to lose volume. It stays a box, to 1e-8, and the plates have its stresses, up to
/// a pressure of 29 shear moduli; at 41 runs stall.
#[test]
fn a_cube_locked_by_six_plates() {
    for (bulk, ways) in [(94.0, [0.06, 0.03, 0.02]), (1410.0, [0.01, 0.006, 0.004])] {
        let rubber = Rubber::mooney_rivlin(0.293, 0.177, bulk).unwrap();
        let scene = between_plates(Block::new([-1.0; 3], [1.0; 3]), rubber, ways);
        let (problem, path) = solved(&scene, &Scheme::default().particles([5]));
        let forces = balanced(&problem, &path);
        println!("forces {forces:?}, {} iterations in {} steps", path.iterations, path.steps.len());
        let stretches = ways.map(|way| 1.0 - way);
        for f in problem.deformation_gradients(path.last()).unwrap() {
            assert_abs_diff_eq!(f, diagonal(stretches), epsilon = 3e-9);
        }
        let stress = problem.stress(path.last(), &Point::<3>::zeros()).unwrap();
        for axis in 0..3 {
            let area = 4.0 * stretches.iter().product::<f64>() / stretches[axis];
            assert_relative_eq!(-stress[(axis, axis)] * area, forces[axis], max_relative = 1e-8);
        }
    }
}

fn diagonal(values: [f64; 3]) -> rkpm::nalgebra::Matrix3<f64> {
    rkpm::nalgebra::Matrix3::from_diagonal(&values.into())
}

/// A rounded block of rubber that nothing but six plates holds, each of which touches the middle of its face.
#[test]
fn a_rounded_block_squeezed_on_six_sides() {
    let rounded = Mapped(|unit: &Point<3>| {
        let x = unit.map(|t| 2.0 * t - 1.0);
        let square = x.map(|v| v * v);
        Point::<3>::from_fn(|i, _| {
            let (a, b) = (square[(i + 1) % 3], square[(i + 2) % 3]);
            x[i] * (1.0 - 0.2 * (a + b) + 0.05 * a * b)
        })
    });
    let (problem, path) =
        solved(&between_plates(rounded, rubber(), [0.12, 0.1, 0.08]), &Scheme::default().particles([5]));
    let forces = balanced(&problem, &path);
    println!("forces {forces:?}, {} iterations in {} steps", path.iterations, path.steps.len());
    assert!(path.iterations < 20);
    // A plate along an axis has come in from where the block ends at rest: as deep as is said lie particles behind it, or points between them,
    // which bulge by less than a twentieth of the spacing.
    for (axis, way) in [0.12, 0.1, 0.08].into_iter().enumerate() {
        for sign in [-1.0, 1.0] {
            let state = problem.contact(path.last(), &format!("{axis} {sign}")).unwrap();
            let behind = |x: &Point<3>| sign * x[axis] - (1.0 - way);
            let depth = state.points.iter().map(|point| behind(&point.position)).fold(0.0, f64::max);
            let found = state.depth.unwrap();
            assert!(found > depth - 1e-9 && found < depth + 0.025, "{axis} {sign}: {found} beside {depth}");
        }
    }
}

/// A bar that is narrower than a few spacings does not slip between particles, and a ball in 3D that touches none ends its run: what completes has the
/// force of a finer model.
#[test]
fn narrow_tools_do_not_pass_through() {
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let bar = RigidSurface::shaft([25.0, 24.0], 4.0).moving([0.0, -8.0]).named("bar");
    let block = Scene::new(Block::new([0.0, 0.0], [50.0, 20.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .contact((1, Side::Max), bar);
    // With 16 and 20 cells over the height 35.2 and 35.4.
    for cells in [4, 6, 7, 8, 10, 11, 12, 13] {
        let problem = block.discretize(&Scheme::default().particles([5 * cells / 2 + 1, cells + 1])).unwrap();
        let path = problem.run().unwrap();
        let force = problem.contact(path.last(), "bar").unwrap().force[1];
        println!("{cells}: load {:.3}, force {force:.2}, {:?}", path.last().load, path.ending);
        // The mean gap under a trace function of width h is off by the order of h²/R.
        let off = 0.25 * (20.0 / cells as f64 / 4.0f64).powi(2);
        match &path.ending {
            Ending::Completed => assert!(abs_diff_eq!(force / -35.3, 1.0, epsilon = off), "{cells}: {force}"),
            Ending::Stalled(stalled) => assert!(stalled.load > 0.3 && force < 0.0, "{cells}: {stalled:?} {force}"),
            other => panic!("{cells}: {other:?}"),
        }
    }
    let ball = RigidSurface::sphere([6.0, 6.0, 8.5], 1.5).moving([0.0, 0.0, -4.0]).named("ball");
    let problem = Scene::new(Block::new([0.0; 3], [12.0, 12.0, 7.0]), Solid, rubber())
        .hold((2, Side::Min))
        .contact((2, Side::Max), ball)
        .discretize(&Scheme::default().particles([6, 6, 4]))
        .unwrap();
    let path = problem.run().unwrap();
    let Ending::Stalled(stalled) = &path.ending else { panic!("{:?}", path.ending) };
    println!("ball: {stalled:?}");
    assert!(matches!(&stalled.cause, Cause::Refused(why) if why.contains("passed through")), "{stalled:?}");
}

/// A plane pressed against a face that a rigid body holds flat moves this body as a condition does: elements hold the face flat at each of its
/// points.
#[test]
fn a_plane_pressed_on_a_rigid_body_moves_it() {
    let block = || {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
            .hold((1, Side::Min))
            .rigid("plate", (1, Side::Max))
            .with(Load::force("plate", [0.1, 0.0]))
    };
    for order in [1, 2] {
        let scheme = Scheme::elements(order).particles([9, 5]);
        let plane = RigidSurface::plane([0.0, 1.05], [0.0, -1.0]).moving([0.0, -0.1]).named("press");
        let pressed = block().contact((1, Side::Max), plane).discretize(&scheme).unwrap();
        let path = pressed.run().unwrap().completed().unwrap();
        let moved = block().with(Condition::on("plate").component(1, -0.05)).discretize(&scheme).unwrap();
        let other = moved.run().unwrap().completed().unwrap();
        let found = pressed.contact(path.last(), "press").unwrap().force[1];
        let expected = moved.reaction(other.last(), "plate").unwrap()[1];
        assert_relative_eq!(found, expected, max_relative = 1e-8);
        let [found, expected] = [(&pressed, &path), (&moved, &other)]
            .map(|(problem, path)| problem.rigid_motion(path.last(), "plate").unwrap());
        assert_abs_diff_eq!(found.displacement, expected.displacement, epsilon = 1e-8);
    }
}
