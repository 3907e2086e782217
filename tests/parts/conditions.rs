//! GOAL: conditions, loads and results by the names of a file do on meshes what they do on lattices.
//! GEOMETRY: a cylinder of rubber under a steel plate (`plug`), a plate with a hole (`hexahedra`, `prisms`), a wedge
//! (`tetrahedra_7`).
//! REFERENCE: balance; the same requested in another way.

use rkpm::prelude::*;

use super::file;
use approx::{abs_diff_eq, assert_abs_diff_eq};

fn mesh(name: &str) -> Mesh<3> {
    Mesh::<3>::parse(&file(name)).unwrap()
}

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e2).unwrap()
}

fn run(scene: Scene<3>) -> (Problem<3>, EquilibriumPath) {
    let problem = scene.discretize(&Scheme::default()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

/// A plate pulled against a soft elastic foundation moves by force over stiffness, whatever its cells; a normal one lets it slide.
#[test]
fn beddings_and_total_forces() {
    for name in ["hexahedra.msh", "prisms.msh"] {
        let (area, soft) = (mesh(name).measure("left").unwrap(), 1e-4);
        let on = |elastic_foundation| Scene::new(mesh(name), Solid, rubber()).with(elastic_foundation);
        let guided = on(Load::elastic_foundation("left", soft)).prescribe("right", 1, 0.0).prescribe("right", 2, 0.0);
        let (problem, path) = run(guided.with(Load::force("right", [1e-6, 0.0, 0.0])));
        let left = problem.displacement(path.last(), &[0.0, 0.75, 0.3].into()).unwrap();
        assert!(abs_diff_eq!(left[0] / (1e-6 / (soft * area)), 1.0, epsilon = 5e-3), "{name}: {left}");
        // A body that is moved as a whole is held back by k·A·u, by normal springs along the normal alone.
        let moved = |elastic_foundation| {
            let (problem, path) =
                run(on(elastic_foundation).with(Condition::on("right").displacement([0.003, 0.02, 0.0])));
            problem.reaction(path.last(), "right").unwrap() / (soft * area)
        };
        let (all, normal) =
            (moved(Load::elastic_foundation("left", soft)), moved(Load::normal_elastic_foundation("left", soft)));
        assert!((all - Point::<3>::new(0.003, 0.02, 0.0)).norm() < 5e-3 * 0.02, "{name}: {all}");
        assert!((normal - Point::<3>::new(0.003, 0.0, 0.0)).norm() < 5e-3 * 0.003, "{name}: {normal}");
    }
    // On a part of a part, as on the whole of it.
    let halves = |x: &Point<3>| x[1] < 0.8;
    let load = |place: Place<3>, force| Load::force(place, force);
    let (problem, path) = run(Scene::new(mesh("hexahedra.msh"), Solid, rubber())
        .hold("left")
        .with(load(Place::on("right").within(halves), [0.01, 0.0, 0.0]))
        .with(load(Place::on("right").within(move |x| !halves(x)), [0.02, 0.0, 0.0])));
    assert_abs_diff_eq!(problem.reaction(path.last(), "left").unwrap()[0], -0.03, epsilon = 1e-10);
    // A force is that of its face, and the base takes it.
    let (force, plug) = ([0.02, 0.0, -0.1], mesh("plug_41_binary.msh").body("rubber").unwrap());
    let (problem, path) = run(Scene::new(&plug, Solid, rubber()).hold("base").with(Load::force("steel plate", force)));
    let base = problem.reaction(path.last(), "base").unwrap();
    assert_abs_diff_eq!(base, -Point::<3>::from(force), epsilon = 5e-10);
}

/// A face turned about an axis: by components, and by the tangent and the radius at each point.
#[test]
fn cylindrical_directions_are_those_of_the_points() {
    let plug = || Scene::new(mesh("plug_41_binary.msh"), Solid, rubber()).hold("base");
    let (angle, origin, axis) = (0.1, [0.0; 3], [0.0, 0.0, 1.0]);
    let turn = move |x: &Point<3>| [-angle * x[1], angle * x[0], 0.0];
    let by_components = plug().with(Condition::on("top").displacement(Value::field(turn)));
    let around = Value::field(move |x: &Point<3>| angle * x[0].hypot(x[1]));
    let top = || Condition::on("top");
    let by_directions = plug()
        .with(top().along(Direction::tangential(origin, axis), around))
        .with(top().along(Direction::radial(origin, axis), 0.0))
        .with(top().along(Direction::Normal, 0.0));
    let [one, other] = [by_components, by_directions].map(|scene| {
        let (problem, path) = run(scene);
        (problem.energy(path.last()).unwrap(), problem.moment(path.last(), "top", [0.0; 3]).unwrap()[2])
    });
    // At the particle on the axis neither direction is defined: what its trace function weighs lies around it.
    assert_abs_diff_eq!(one.0 / other.0, 1.0, epsilon = 1e-2);
    assert_abs_diff_eq!(one.1 / other.1, 1.0, epsilon = 1e-2);
    assert!(one.1 > 0.01);
}

/// A plane of symmetry at an angle: by its normal, and by the direction; forces on it stand upright.
#[test]
fn inclined_planes_hold_along_their_normal() {
    // The slanting side of the wedge, whose name the file does not have.
    let (sin, cos) = (0.8f64.hypot(1.0).recip() * 0.8, 0.8f64.hypot(1.0).recip());
    let slope =
        || Place::on(Part::Whole).within(move |x: &Point<3>| (x[0] * cos + x[1] * sin - 1.4 * cos).abs() < 1e-6);
    let back = || Place::on(Part::Whole).within(|x: &Point<3>| x[0] < 1e-6);
    let answers = [Direction::Normal, Direction::Along([3.0 * cos, 3.0 * sin, 0.0])].map(|direction| {
        let (problem, path) = run(Scene::new(mesh("tetrahedra_7.msh"), Solid, rubber())
            .with(Condition::on(slope()).along(direction, 0.0).named("slope"))
            .with(Condition::on(back()).displacement([0.05, 0.02, 0.0]).named("back")));
        let force = problem.reaction(path.last(), "slope").unwrap();
        assert_abs_diff_eq!(force, -problem.reaction(path.last(), "back").unwrap(), epsilon = 5e-10 * force.norm());
        assert!((force[0] * sin - force[1] * cos).abs() + force[2].abs() < 1e-9 * force.norm(), "{force}");
        assert!(force.norm() > 1e-3);
        problem.energy(path.last()).unwrap()
    });
    assert_abs_diff_eq!(answers[0] / answers[1], 1.0, epsilon = 1e-9);
}

/// Errors of a first try say what to do.
#[test]
fn names_and_torn_meshes_are_explained() {
    let part = || mesh("tetrahedra_0.msh");
    let refused = |scene: Scene<3>| scene.discretize(&Scheme::default()).err().unwrap().to_string();
    assert!(
        refused(Scene::new(part(), Solid, rubber()).hold("base"))
            .contains("no boundary part base: name one of this domain, part")
    );
    let nameless = Mesh::<3>::new(
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::from).to_vec(),
        &[(rkpm::mesh::CellShape::Tetrahedron, vec![0, 1, 2, 3])],
        &[],
    );
    let scene = Scene::new(nameless.unwrap(), Solid, rubber()).hold("base");
    assert!(refused(scene).contains("no named parts (physical groups in Gmsh)"));
    // Two blocks that touch, each with nodes of its own.
    let points = [0.0, 1.0, 1.0, 2.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]);
    let points = points.concat().into_iter().map(Point::from).collect();
    let cells = vec![(rkpm::mesh::CellShape::Hexahedron, (0..16).collect())];
    let torn = Mesh::<3>::new(points, &cells, &[]).unwrap();
    let error = refused(Scene::new(torn, Solid, rubber()).hold(Part::Whole));
    assert!(error.contains("are both at X") && error.contains("Coherence"), "{error}");
}

/// A volume of the file is a rigid body by its name, and one call writes what there is to know.
#[test]
fn volumes_are_rigid_bodies_and_paths_are_written_whole() {
    let plug = mesh("plug_41_binary.msh");
    let (problem, path) = run(Scene::new(&plug, Solid, rubber())
        .hold("base")
        .rigid("steel plate", "steel plate")
        .with(Condition::on(Place::at([0.0, 0.0, 1.0]).of("steel plate")).component(0, 0.2).named("push"))
        .with(Load::force("steel plate", [0.0, 0.0, -0.05])));
    let alone = plug.body("rubber").unwrap();
    assert_eq!(problem.cells().positions(), alone.points());
    // By a name of its own as well.
    let named = Scene::new(&plug, Solid, rubber()).name("core", "steel plate").rigid("steel", "core");
    let named = named.hold("base").discretize(&Scheme::default()).unwrap();
    assert_eq!(named.cells().positions(), alone.points());
    let motion = problem.rigid_motion(path.last(), "steel plate").unwrap();
    assert!(
        abs_diff_eq!(motion.displacement[0], 0.2, epsilon = 0.05) && motion.rotation_vector()[1] > 1e-3,
        "{motion:?}"
    );
    let folder = std::env::temp_dir().join(format!("rkpm-parts-{}", std::process::id()));
    problem.write(&path, folder.join("plug.pvd")).unwrap();
    let text = std::fs::read_to_string(folder.join("plug.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let last: Vec<f64> = text.lines().last().unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    let at = |name: &str| last[header.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name}"))];
    assert_eq!(text.lines().count(), 2 + path.steps.len());
    assert_abs_diff_eq!(at("base: force_2"), 0.05, epsilon = 1e-9);
    assert_abs_diff_eq!(at("steel plate: force_2"), -0.05, epsilon = 1e-9);
    assert_abs_diff_eq!(at("steel plate: force_0"), at("push: force_0"), epsilon = 1e-9);
    assert_abs_diff_eq!(at("steel plate: displacement_0"), motion.displacement[0], epsilon = 1e-12);
    assert_abs_diff_eq!(at("steel plate: rotation_1"), motion.rotation_vector()[1], epsilon = 1e-12);
    assert_abs_diff_eq!(at("base: displacement_2"), 0.0, epsilon = 1e-12);
    assert!(!header.contains(&"push: displacement_1"));
    let films = std::fs::read_to_string(folder.join("plug.pvd")).unwrap();
    assert_eq!(films.matches("<DataSet").count(), 1 + path.steps.len());
    let grid = problem.vtk_grid(path.last()).unwrap();
    let rkpm::output::VtkValues::Integers(bodies) = &grid.cell_data[0].values else {
        panic!("{:?}", grid.cell_data[0])
    };
    assert_eq!(bodies.len(), grid.cells.len());
    let rkpm::output::VtkValues::Scalars(ratios) = &grid.cell_data[1].values else { panic!("{:?}", grid.cell_data[1]) };
    assert!(ratios.iter().all(|ratio| (0.5..1.5).contains(ratio)), "{ratios:?}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A file of MSH 2.2 as text with its nodes scaled and shifted.
fn drawn(name: &str, scale: f64, shift: [f64; 3]) -> Mesh<3> {
    let text = String::from_utf8(file(name)).unwrap();
    let (mut inside, mut out) = (0, String::new());
    for line in text.lines() {
        inside = match line {
            "$Nodes" => 1,
            "$EndNodes" => 0,
            _ if inside == 1 => 2,
            _ => {
                let mut cells = line.split(' ');
                if inside == 2
                    && let Some(number) = cells.next()
                {
                    let x: Vec<f64> = cells.zip(shift).map(|(x, s)| scale * (x.parse::<f64>().unwrap() + s)).collect();
                    out.push_str(&format!("{number} {} {} {}\n", x[0], x[1], x[2]));
                    continue;
                }
                inside
            }
        };
        out.push_str(line);
        out.push('\n');
    }
    Mesh::<3>::parse(out.as_bytes()).unwrap()
}

/// A part in metres, or far from the origin as assemblies are drawn, is the same part.
#[test]
fn units_and_origins_change_nothing() {
    let force = |scale: f64, shift: [f64; 3]| {
        let push = [0.2 * scale, 0.0, -0.1 * scale];
        let scene = Scene::new(drawn("plug_22_ascii.msh", scale, shift), Solid, rubber())
            .hold("base")
            .rigid("steel plate", "steel plate")
            .with(Condition::on("steel plate").displacement(push));
        let problem = scene.discretize(&Scheme::default()).unwrap();
        // The mesh is too coarse for an answer.
        let path = problem.run().unwrap().reached().unwrap();
        problem.reaction(path.last(), "steel plate").unwrap() / (scale * scale)
    };
    let here = force(1.0, [0.0; 3]);
    assert!(here[0] > 0.1 && here[2] < -0.1, "{here}");
    for (scale, shift) in [(1e-3, [0.0; 3]), (1e3, [0.0; 3]), (1.0, [2e3, -1e3, 500.0]), (1e-3, [1e4, 0.0, 3e3])] {
        let there = force(scale, shift);
        assert!(abs_diff_eq!(there, here, epsilon = 5e-9 * here.norm()), "{scale} {shift:?}: {here} {there}");
    }
}
