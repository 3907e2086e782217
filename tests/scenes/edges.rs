//! Edges where faces that are fixed meet: each equation belongs to the face whose normal is nearest to it.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use rkpm::check;
use rkpm::error::BoundaryError;
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, Direction};

#[path = "../../examples/support/mount.rs"]
mod mount;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

/// The displacements and the force on the base of half of the mount, its insert pressed down by 2 mm.
fn pressed(scene: &Scene<2>, spacing: f64) -> (Vec<f64>, f64) {
    let problem = scene.discretize(&Scheme::default().spacing(spacing)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = problem.reaction(path.last(), "base").unwrap()[1] / 2.0;
    (path.last().displacement.clone(), force)
}

fn section(backwards: bool) -> Scene<2> {
    Scene::new(mount::section(backwards).unwrap(), Axisymmetric, mount::rubber().unwrap()).prescribe("axis", 0, 0.0)
}

fn down(on: &str) -> Condition<2> {
    Condition::on(on).displacement([0.0, -2.0])
}

/// REFERENCE: graded Q2/P1 elements, extrapolated, 295.0 to 295.4 N. Where the wall of the insert owned the equations at its lower end, the
/// forces were 7.5 % too large with 65 particles, and 5.8 and 1.9 % in the mean of seven spacings around 2 and 1 mm.
#[test]
fn a_bonded_insert_is_not_clamped_along_its_edge() {
    let error = |spacing: f64| {
        let scene = section(false).hold("base").with(down("wall")).with(down("floor"));
        (pressed(&scene, spacing).1 / mount::FORCE).abs() - 1.0
    };
    let mean = |spacing: f64| {
        let around = [0.94, 0.96, 0.98, 1.0, 1.02, 1.04, 1.06].map(|factor| error(factor * spacing).abs());
        around.iter().sum::<f64>() / 7.0
    };
    let errors = [error(3.0).abs(), mean(2.04), mean(1.01)];
    assert!(errors[0] < 0.04 && errors[1] < 0.045 && errors[2] < 0.015, "{errors:?}");
}

#[test]
fn the_order_of_faces_does_not_count() {
    let reference = pressed(&section(false).hold("base").with(down("wall")).with(down("floor")), 3.0);
    for backwards in [false, true] {
        let other = section(backwards).with(down("floor")).hold("base").with(down("wall"));
        let found = pressed(&other, 3.0);
        assert_relative_eq!(found.1, reference.1, max_relative = 1e-9);
        for (own, other) in found.0.iter().zip(&reference.0).filter(|_| !backwards) {
            assert_abs_diff_eq!(own, other, epsilon = 1e-9);
        }
    }
    // All of the boundary at once, but for what is free.
    let all = Place::on(Part::Whole)
        .within(|x: &Point<2>| x[1] < 1e-6 || (x[0] < 7.0 + 1e-6 && x[0] > 1e-6 && x[1] < 24.0 - 1e-6));
    let motion = |x: &Point<2>| if x[1] < 1e-6 { [0.0; 2] } else { [0.0, -2.0] };
    let scene = section(false).with(Condition::on(all).displacement(Value::field(motion)).named("bonded"));
    let problem = scene.discretize(&Scheme::default().spacing(3.0)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    for (own, other) in path.last().displacement.iter().zip(&reference.0) {
        assert_abs_diff_eq!(own, other, epsilon = 1e-9);
    }
}

#[test]
fn an_insert_that_is_tied_moves_as_one_that_is_prescribed() {
    let reference = pressed(&section(false).hold("base").with(down("wall")).with(down("floor")), 3.0);
    for parts in [["wall", "floor"], ["floor", "wall"]] {
        let tied = parts.iter().fold(section(false), |scene, part| scene.rigid("steel", *part)).hold("base");
        let found = pressed(&tied.with(Condition::on("steel").component(1, -2.0)), 3.0);
        assert_relative_eq!(found.1, reference.1, max_relative = 1e-7);
    }
}

/// A body turned by some angle, held and moved along turned directions, moves as before, turned.
#[test]
fn directions_that_are_no_axes_own_edges_as_axes_do() {
    let run = |angle: f64| -> Vec<f64> {
        let (sin, cos) = angle.sin_cos();
        let turned = Mapped(move |unit: &Point<2>| {
            Point::<2>::new(2.0 * cos * unit[0] - sin * unit[1], 2.0 * sin * unit[0] + cos * unit[1])
        });
        let along = |e: [f64; 2]| Direction::Along([cos * e[0] - sin * e[1], sin * e[0] + cos * e[1]]);
        let on = |part: (usize, Side), values: [f64; 2]| {
            Condition::on(part).along(along([1.0, 0.0]), values[0]).along(along([0.0, 1.0]), values[1])
        };
        let scene = Scene::new(turned, PlaneStrain, rubber())
            .with(on((1, Side::Min), [0.0, 0.0]))
            .with(on((0, Side::Min), [0.0, 0.0]))
            .with(Condition::on((0, Side::Max)).along(along([1.0, 0.0]), 0.2));
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        // Edges with sudden values are too coarse for an answer; models are compared with each other.
        let path = problem.run().unwrap().reached().unwrap();
        let nodes = path.last().displacement.chunks(2);
        nodes.flat_map(|u| [cos * u[0] + sin * u[1], cos * u[1] - sin * u[0]]).collect()
    };
    for (own, other) in run(0.5).iter().zip(run(0.0)) {
        assert!(abs_diff_eq!(*own, other, epsilon = 1e-8), "{own} and {other}");
    }
}

/// Values of two faces that differ at their common edge: that of the face whose normal is nearest holds, whichever comes first, and the
/// check of the scene says so.
#[test]
fn values_that_differ_at_an_edge_are_those_of_its_owner() {
    let scheme = Scheme::default().particles([9, 9]).constraint_kind(ConstraintKind::OverBoundary);
    let block = || Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Max));
    let pushed = |scene: Scene<2>| scene.prescribe(Side::Min, 0, 0.05);
    let mut found: Vec<Vec<f64>> = Vec::new();
    for scene in [pushed(block().hold((1, Side::Min))), pushed(block()).hold((1, Side::Min))] {
        let problem = scene.discretize(&scheme).unwrap();
        // Edges with sudden values are too coarse for an answer; models are compared with each other.
        let path = problem.run().unwrap().reached().unwrap();
        let at_edge = problem.displacement(path.last(), &Point::<2>::new(0.0, 0.0)).unwrap();
        // The weighted mean near the corner is the value of the side; the other face's is 0.
        assert_abs_diff_eq!(at_edge[0], 0.05, epsilon = 0.02);
        found.push(path.last().displacement.clone());
        let overruled = check::scene(&scene, &scheme).unwrap().overruled;
        assert_eq!(overruled.len(), 2, "{overruled:?}");
        let doubts = problem.verdict(&path).unwrap();
        let told = doubts.iter().filter(|doubt| doubt.to_string().contains("make them equal there"));
        assert_eq!(told.count(), 2, "{doubts:?}");
        for error in &overruled {
            let BoundaryError::Overruled { owner, component: 0, values, .. } = error else { panic!("{error}") };
            assert_eq!((owner.as_str(), *values), ("u_0 on face (0, Min)", [0.05, 0.0]));
        }
        assert!(overruled[0].to_string().contains("make them equal there"));
    }
    for (own, other) in found[0].iter().zip(&found[1]) {
        assert_abs_diff_eq!(own, other, epsilon = 1e-10);
    }
    // Faces that look the same way have no owner: values must agree.
    let halves = |first: bool| {
        let at = Place::on((1, Side::Min)).within(move |x: &Point<2>| (x[0] < 0.5) == first);
        Condition::on(at).component(1, if first { 0.0 } else { 0.1 })
    };
    let error = block().with(halves(true)).with(halves(false)).discretize(&scheme).err().unwrap();
    assert!(matches!(error, Error::Boundary(BoundaryError::Conflict { component: 1, .. })), "{error}");
}

/// A step that is one spacing high has the particles of its corners alone: they are its own.
#[test]
fn a_face_without_particles_of_its_own_keeps_those_at_its_ends() {
    let outline = Outline::at([0.0, 0.0]).line("low", [2.0, 0.0]).line("step", [2.0, 0.25]).line("high", [4.0, 0.25]);
    let outline = outline.line("end", [4.0, 2.0]).line("top", [0.0, 2.0]).close("start");
    let scene = ["low", "step", "high"].iter().fold(
        Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber()).prescribe("top", 1, -0.1),
        |scene, part| scene.with(Condition::on(*part).displacement([0.0; 2]).named(*part)),
    );
    let problem = scene.discretize(&Scheme::default().spacing(0.25)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = problem.reaction(path.last(), "step").unwrap();
    assert!(force[1].abs() > 0.0, "the step owns no equation along axis 1: {force:?}");
    let whole = ["low", "step", "high", "top"].iter().map(|part| problem.reaction(path.last(), *part).unwrap()[1]);
    assert_abs_diff_eq!(whole.sum::<f64>(), 0.0, epsilon = 1e-8);
}

/// REFERENCE: as above, for the surface of half of a turn. Where the curved wall owned the edge, the mean error was 3.3 %. Walls are left as
/// they are: on refined lattices the error of the edges is another one.
#[test]
fn a_cut_mount_is_right_in_the_mean_and_the_order_of_parts_does_not_count() {
    let solid = mount::half(48).unwrap();
    let scene = || Scene::new(&solid, Solid, mount::rubber().unwrap());
    let insert = || Condition::on("insert").displacement([0.0, 0.0, -2.0]);
    let force = |scene: Scene<3>, spacing: f64| {
        let problem = scene.discretize(&Scheme::default().spacing(spacing).thin_walls()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), "base").unwrap()[2]
    };
    let forces = [5.0, 4.0, 3.5].map(|s| force(scene().hold("base").prescribe("middle", 1, 0.0).with(insert()), s));
    let mean = forces.iter().map(|force| (force / mount::FORCE - 1.0).abs()).sum::<f64>() / 3.0;
    assert!(mean < 0.015, "{forces:?}");
    let other = force(scene().with(insert()).prescribe("middle", 1, 0.0).hold("base"), 5.0);
    assert_relative_eq!(other, forces[0], max_relative = 1e-8);
}
