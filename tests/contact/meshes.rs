//! Contact on meshes, by elements on curved blocks, and of a body with itself, beside the same by other means.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::geometry::Mapped;
use rkpm::mesh::CellShape;
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

/// A rectangle of 6 × 2 pressed by 5 % between plates without friction touches along its whole width, in whatever order its file
/// lists the cells.
#[test]
fn widths_do_not_depend_on_the_order_of_a_file() {
    let (along, up) = (12, 4);
    let points = (0..(along + 1) * (up + 1))
        .map(|k| Point::<2>::new((k % (along + 1)) as f64 * 0.5, (k / (along + 1)) as f64 * 0.5))
        .collect();
    let cell = |k: usize| {
        let first = k % along + k / along * (along + 1);
        [first, first + 1, first + along + 2, first + along + 1]
    };
    // 7 is prime to 48.
    let cells = (0..along * up).flat_map(|k| cell(k * 7 % (along * up))).collect();
    let top: Vec<usize> =
        (0..along).map(|k| k * 5 % along).flat_map(|k| [k, k + 1].map(|k| k + up * (along + 1))).collect();
    let lines = (CellShape::Line, top);
    let mesh = Mesh::new(points, &[(CellShape::Quadrangle, cells), lines], &[("top".into(), (48..60).collect())]);
    let floor = RigidSurface::plane([0.0, 0.0], [0.0, 1.0]);
    let plate = RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).moving([0.0, -0.1]).named("plate");
    let scene = Scene::new(mesh.unwrap(), PlaneStrain, rubber())
        .contact("top", plate)
        .contact(Place::on(rkpm::geometry::Part::Whole).within(|x: &Point<2>| x[1] < 1e-9), floor);
    let (problem, path) = solved(&scene, &Scheme::default());
    let plate = problem.contact(path.last(), "plate").unwrap();
    let width = 6.0 / 0.95;
    assert_abs_diff_eq!(plate.extent / width, 1.0, epsilon = 2e-3);
    let rises = plate.points.windows(2).map(|pair| pair[1].position[0] - pair[0].position[0]);
    let signs: Vec<f64> = rises.map(f64::signum).collect();
    assert!(signs.iter().all(|sign| *sign == signs[0]), "points are not in order along the boundary");
}

/// A quarter of a thick ring squeezed by a plate: elements of either order beside particles.
#[test]
fn elements_on_a_curved_block() {
    let ring = Mapped(|unit: &Point<2>| {
        let (radius, angle) = (1.0 + unit[0], 0.5 * std::f64::consts::PI * unit[1]);
        Point::<2>::new(radius * angle.cos(), radius * angle.sin())
    });
    let scene = Scene::new(ring, PlaneStrain, rubber())
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .contact((0, Side::Max), RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).moving([0.0, -0.2]).named("plate"));
    let force = |scheme: Scheme| {
        let (problem, path) = solved(&scene, &scheme);
        -problem.contact(path.last(), "plate").unwrap().force[1]
    };
    let particles = force(Scheme::default().particles([7, 21]));
    for order in [1, 2] {
        let elements = force(Scheme::elements(order).particles([7, 21]));
        println!("order {order}: {elements} beside {particles} of particles");
        assert!(
            abs_diff_eq!(elements / particles, 1.0, epsilon = 0.02),
            "order {order}: {elements} beside {particles}"
        );
    }
}

/// A clamp whose slot closes on itself is, by symmetry, its half on a rigid floor.
#[test]
fn a_slot_that_closes_on_itself() {
    let whole = Outline::at([0.0, -0.5]).line("bottom", [2.0, -0.5]).line("tip", [2.0, -0.1]).line("slot", [0.6, -0.1]);
    let whole = whole.line("slot", [0.6, 0.1]).line("slot", [2.0, 0.1]).line("tip", [2.0, 0.5]).line("top", [0.0, 0.5]);
    let half = Outline::at([0.0, 0.0]).line("axis", [0.6, 0.0]).line("slot", [0.6, 0.1]).line("slot", [2.0, 0.1]);
    let half = half.line("tip", [2.0, 0.5]).line("top", [0.0, 0.5]).close("left");
    let end = |name: &'static str| Place::on(name).within(|x: &Point<2>| x[0] > 1.4);
    let region = |outline| Region::new(outline).unwrap();
    let pressed = |scene: Scene<2>| scene.with(Condition::on(end("top")).component(1, -0.16).named("top"));
    let full = pressed(Scene::new(region(whole.close("left")), PlaneStrain, rubber()).prescribe("left", 0, 0.0))
        .with(Condition::on(end("bottom")).component(1, 0.16))
        .contact_itself("slot", "slot");
    let half = pressed(Scene::new(region(half), PlaneStrain, rubber()).prescribe("left", 0, 0.0))
        .prescribe("axis", 1, 0.0)
        .contact("slot", RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).named("slot"));
    let scheme = Scheme::default().spacing(0.08).seed(1);
    let found = [full, half].map(|scene| {
        let (problem, path) = solved(&scene, &scheme);
        let slot = problem.contact(path.last(), "slot").unwrap();
        let touched: f64 = slot.points.iter().map(|point| point.force[1].max(0.0)).sum();
        (problem.reaction(path.last(), "top").unwrap()[1], touched, slot.force.norm())
    });
    println!("whole and half: {found:?}");
    let [(force, touched, total), (expected, floor, _)] = found;
    assert!(touched > 0.0 && total < 1e-9 * touched, "forces of a body on itself leave {total:e}");
    // The two have other particles, about five across each arm, and differ by 4.4 %: which of them is closer was not measured.
    assert_abs_diff_eq!(force / expected, 1.0, epsilon = 0.06);
    assert_abs_diff_eq!(touched / floor, 1.0, epsilon = 0.06);
}

/// Contact with itself takes factors, whatever is requested: parts of its matrix are left out of them.
#[test]
fn contact_with_itself_takes_factors() {
    let cube = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()).hold((2, Side::Min));
    let krylov = Scheme::default().particles([5]).solver_choice(rkpm::scene::SolverChoice::Krylov);
    assert!(cube.discretize(&krylov).unwrap().analysis().solver.keeps_pressures());
    let touching = cube.contact_itself((2, Side::Max), "itself");
    assert!(!touching.discretize(&krylov).unwrap().analysis().solver.keeps_pressures());
}

/// Conditions hold a slender bar: contact that is declared and does not occur leaves the matrix, and the states, as they are.
#[test]
fn contact_that_does_not_occur_changes_nothing() {
    let bar = Scene::new(Block::new([0.0, 0.0], [20.0, 0.5]), PlaneStrain, rubber())
        .hold((0, Side::Min))
        .with(Load::force((0, Side::Max), [0.0, -2e-5]));
    let scheme = Scheme::default().particles([41, 3]);
    let [(problem, free), (_, declared)] =
        [bar.clone(), bar.contact_itself((1, Side::Max), "fold")].map(|scene| solved(&scene, &scheme));
    assert_eq!(free.iterations, declared.iterations);
    let tip = problem.displacement(free.last(), &[20.0, 0.25].into()).unwrap()[1];
    assert!(tip < -1.0, "{tip}");
    let [free, declared] = [free.last(), declared.last()].map(|state| &state.displacement);
    for (a, b) in free.iter().zip(declared) {
        assert_abs_diff_eq!(a, b, epsilon = 1e-9 * tip.abs());
    }
}

/// A sheet folded around a bend of a given inner radius, in space: arms along the first axis, above and below the plane between them, or the
/// lower half of it. `uneven` makes lengths along the sheet grow from one end to the other.
fn folded(whole: bool, uneven: f64) -> Mapped<impl Fn(&Point<3>) -> Point<3> + Send + Sync + 'static> {
    let (radius, thickness, arm, width) = (0.12, 0.2, 1.0, 0.5);
    let bend = std::f64::consts::PI * (radius + 0.5 * thickness);
    let length = if whole { 2.0 * arm + bend } else { arm + 0.5 * bend };
    Mapped(move |unit: &Point<3>| {
        let along = length * (unit[0] + uneven * unit[0] * (1.0 - unit[0]));
        let out = radius + thickness * unit[2];
        let [x, y] = if along < arm {
            [arm - along, -out]
        } else if along > arm + bend {
            [along - arm - bend, out]
        } else {
            let (sine, cosine) = ((along - arm) / bend * std::f64::consts::PI).sin_cos();
            [-out * sine, -out * cosine]
        };
        Point::<3>::new(x, y, -width * unit[1])
    })
}

/// A folded sheet whose arms are pressed on each other is, by symmetry, its half on a rigid floor. Where the cells of the arms do not match
/// forces balance as well; they are not those of the half, as other cells lie in what is pressed.
#[test]
fn a_folded_sheet_touches_itself_in_space() {
    let arm = |up: bool| Place::<3>::on((2, Side::Max)).within(move |x: &Point<3>| x[0] > 0.5 && (x[1] > 0.0) == up);
    let found = |whole: bool, uneven: f64, particles: [usize; 3]| {
        let mut scene = Scene::new(folded(whole, uneven), Solid, rubber())
            .prescribe((1, Side::Min), 2, 0.0)
            .prescribe((0, Side::Min), 0, 0.0)
            .with(Condition::on(arm(false)).component(1, 0.14).named("pressed"));
        scene = if whole {
            scene
                .prescribe((0, Side::Max), 0, 0.0)
                .with(Condition::on(arm(true)).component(1, -0.14))
                .contact_itself((2, Side::Min), "fold")
        } else {
            let floor = RigidSurface::plane([0.0; 3], [0.0, -1.0, 0.0]).named("fold");
            scene.prescribe((0, Side::Max), 1, 0.0).contact((2, Side::Min), floor)
        };
        let (problem, path) = solved(&scene, &Scheme::default().particles(particles));
        let fold = problem.contact(path.last(), "fold").unwrap();
        let touched: f64 = fold.points.iter().map(|point| point.force[1].abs()).sum();
        let force = problem.reaction(path.last(), "pressed").unwrap()[1];
        println!("whole {whole}, uneven {uneven}: {force} {touched}, {} iterations", path.iterations);
        (force, touched, fold.force.norm())
    };
    let (expected, floor, _) = found(false, 0.0, [15, 4, 3]);
    for uneven in [0.0, 0.1] {
        let (force, touched, total) = found(true, uneven, [29, 4, 3]);
        assert!(touched > 0.0 && total < 1e-9 * touched, "forces of a body on itself leave {total:e}");
        let off = [force / expected - 1.0, 0.5 * touched / floor - 1.0];
        assert!(uneven > 0.0 || off.iter().all(|off| off.abs() < 0.01), "{off:?}");
    }
}

/// A round pillar, cut from a lattice, above a body that is a block or another pillar: it comes down by more than the gap.
fn pillars(lower_cut: bool, named_first: bool) -> Scene<3> {
    let pillar = |from: f64, to: f64, radius: f64| {
        let shape = Shape::cylinder([0.0, 0.0, from], [0.0, 0.0, to], radius).solid(0.05).unwrap();
        let end = |z: f64, up: f64| Select::plane([0.0, 0.0, z], [0.0, 0.0, up]);
        shape.name("bottom", end(from, -1.0)).unwrap().name("top", end(to, 1.0)).unwrap()
    };
    let scene = Scene::assembly(Solid);
    let (scene, foot, face) = if lower_cut {
        let lower = scene.body("lower", pillar(0.0, 0.5, 0.5), rubber());
        (lower.scheme_of("lower", |scheme| scheme.spacing(0.25)), Place::from("bottom"), Place::from("top"))
    } else {
        let lower = scene.body("lower", Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, 0.5]), rubber());
        (
            lower.scheme_of("lower", |scheme| scheme.particles([5, 5, 3])),
            Place::on((2, Side::Min)),
            Place::on((2, Side::Max)),
        )
    };
    let (face, end) = (face.of("lower"), Place::from("bottom").of("upper"));
    let (first, second) = if named_first { (end, face) } else { (face, end) };
    scene
        .body("upper", pillar(0.51, 1.0, 0.3), rubber())
        .scheme_of("upper", |scheme| scheme.spacing(0.2))
        .hold(foot.of("lower"))
        .prescribe(Place::from("top").of("upper"), 0, 0.0)
        .prescribe(Place::from("top").of("upper"), 1, 0.0)
        .prescribe(Place::from("top").of("upper"), 2, -0.05)
        .contact_between(first, second, "joint")
}

/// A face that is cut from a lattice has facets of any number of corners: it is pressed against one of three or four, whichever is named
/// first; between two of them nothing would carry.
#[test]
fn faces_cut_from_a_lattice_press_on_others() {
    let force = |named_first: bool| {
        let (problem, path) = solved(&pillars(false, named_first), &Scheme::default());
        let down = problem.reaction(path.last(), Place::from("top").of("upper")).unwrap();
        let up = problem.reaction(path.last(), Place::on((2, Side::Min)).of("lower")).unwrap();
        assert_abs_diff_eq!(down, -up, epsilon = 5e-9 * up.norm());
        up[2]
    };
    let forces = [force(true), force(false)];
    println!("{forces:?}");
    // The pillar alone on rigid ground would give 3 µ A 0.04/0.49, its ends free to widen; the block below is wider and as tall.
    let alone = 3.0 * 0.94 * std::f64::consts::PI * 0.09 * 0.04 / 0.49;
    assert!(forces[0] > 0.5 * alone && forces[0] < alone, "{forces:?} beside {alone}");
    assert_abs_diff_eq!(forces[1] / forces[0], 1.0, epsilon = 1e-9);
    match pillars(true, true).discretize(&Scheme::default()) {
        Err(rkpm::Error::Incompatible(refusal)) => assert_eq!(refusal.with, "facets cut from a lattice"),
        other => panic!("{:?}", other.map(|_| ())),
    }
}
