//! What problems answer beside displacements, against values known without them.
#![cfg(feature = "solve")]

use std::ops::ControlFlow;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use rkpm::output::{Cell, Table, VtkCell, VtkField, VtkGrid};
use rkpm::prelude::*;
use rkpm::scene::{Dilation, Rule};
use rkpm::solve::{Observer, Step};
use rkpm::study::Quantity;

/// A sheet of a compressible rubber stretched by F = diag(1.5, 1.2).
fn stretched() -> (Problem<2>, EquilibriumPath) {
    let scene = Scene::new(Block::new([1.0, 2.0], [3.0, 3.0]), PlaneStrain, Rubber::neo_hookean(0.5, 2.0).unwrap())
        .prescribe(Part::Whole, 0, Value::field(|x: &Point<2>| 0.5 * x[0]))
        .prescribe(Part::Whole, 1, Value::field(|x: &Point<2>| 0.2 * x[1]));
    let problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

#[test]
fn the_volume_is_that_of_the_deformed_body() {
    let (problem, path) = stretched();
    let volume = Quantity::volume().evaluate(&problem, path.last()).unwrap();
    assert_relative_eq!(volume, 2.0 * 1.0 * 1.5 * 1.2, max_relative = 1e-10);
}

/// Two hoops: smoothed cells measure the whole shell, and a homogeneous stretch has its stress.
#[test]
fn smoothed_spheres_have_two_hoops() {
    let scene = Scene::new(Block::new([1.0], [2.0]), RadialSphere, Rubber::neo_hookean(0.5, 2.0).unwrap()).prescribe(
        Part::Whole,
        0,
        Value::field(|x: &Point<1>| 0.3 * x[0]),
    );
    let problem = scene.discretize(&Scheme::default().particles([9]).rule(Rule::Smoothed { parts: 2 })).unwrap();
    let volume: f64 = problem.body().table().weights().iter().sum();
    assert_relative_eq!(volume, 4.0 / 3.0 * std::f64::consts::PI * 7.0, max_relative = 1e-12);
    let path = problem.run().unwrap().completed().unwrap();
    let exact = rkpm::nalgebra::Matrix3::<f64>::identity() * 1.3;
    for f in problem.deformation_gradients(path.last()).unwrap() {
        assert_abs_diff_eq!(f, exact, epsilon = 3e-10);
    }
}

/// Supports over the largest spacing of an uneven set, axis by axis.
#[test]
fn global_supports_take_the_largest_spacing() {
    let graded = Layout::Graded(std::sync::Arc::new(|axis, t| if axis == 0 { t * t } else { t }));
    let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 2.0).unwrap());
    let scheme = Scheme::default().particles([5, 3]).layout(graded);
    let problem = scene.discretize(&scheme.dilation(Dilation::Global(1.2))).unwrap();
    // 1 − (3/4)² along the first axis, ½ along the second: all 15 particles are seen at (0.45, 0.5).
    let particles = problem.cells().particles_global(1.2).unwrap();
    let half = |p: usize| match &particles.supports()[p] {
        Support::Box(half) => *half,
        _ => panic!("lattices have boxes"),
    };
    assert_abs_diff_eq!(half(0), Point::<2>::new(2.4 * 0.4375, 1.2), epsilon = 1e-12);
    assert_eq!(half(0), half(14));
    assert_eq!(problem.shape_functions(&[0.45, 0.5].into()).unwrap().nodes.len(), 15);
}

/// Elements of order 2 on uneven layouts: their middle nodes stand halfway, whatever the layout says of them, and given ones
/// near a quarter of their edge are refused.
#[test]
fn elements_have_their_middle_nodes_halfway() {
    let graded = |power: f64| Layout::Graded(std::sync::Arc::new(move |_, t: f64| t.powf(power)));
    let rubber = || Rubber::neo_hookean(0.5, 500.0).unwrap();
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .traction((1, Side::Max), [0.1, 0.0]);
    let energy = |scheme: Scheme| {
        let problem = scene.discretize(&scheme).unwrap();
        problem.energy(problem.run().unwrap().completed().unwrap().last()).unwrap()
    };
    let even = energy(Scheme::elements(2).particles([17, 17]));
    let uneven = energy(Scheme::elements(2).particles([17, 17]).layout(graded(2.0)));
    assert_abs_diff_eq!(uneven / even, 1.0, epsilon = 0.01);
    let cells = Lattice::new(&Block::new([0.0, 0.0], [1.0, 1.0]), [5, 5], &graded(2.0)).unwrap();
    let given = Scene::new(rkpm::scene::Geometry::cells(std::sync::Arc::new(cells)), PlaneStrain, rubber());
    let error = given.discretize(&Scheme::elements(2)).err().unwrap().to_string();
    assert!(error.contains("middle node") && error.contains("halfway"), "{error}");
}

/// The paper's rule: particles per direction in a zone, and two.
#[test]
fn zones_of_the_paper_have_as_many_points_as_it_says() {
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, Rubber::neo_hookean(0.5, 2.0).unwrap());
    for (particles, zones, points) in [(9, 4, 5), (9, 2, 7), (5, 4, 4)] {
        let rule = Rule::Gauss { zones: Some(vec![zones]), points: None };
        let problem = scene.discretize(&Scheme::paper(1.5).particles([particles]).rule(rule)).unwrap();
        assert_eq!(problem.body().table().point_count(), zones * points);
    }
}

#[test]
fn displacements_are_known_a_tenth_of_a_cell_outside_and_no_further() {
    let (problem, path) = stretched();
    let at = |x: f64| problem.displacement(path.last(), &[x, 2.5].into());
    assert_abs_diff_eq!(at(3.0 + 0.5 * 0.05).unwrap()[0], 0.5 * 3.025, epsilon = 1e-9);
    assert!(at(3.0 + 0.5 * 0.2).is_err());
}

/// Breaks off after so many steps.
struct Patience(usize);

impl Observer for Patience {
    fn step(&mut self, _: &Step) -> ControlFlow<()> {
        self.0 -= 1;
        if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn either_of_two_observers_ends_a_run() {
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, Rubber::neo_hookean(0.5, 2.0).unwrap()).prescribe(
        Side::Min,
        0,
        0.5,
    );
    let problem = scene.discretize(&Scheme::default().particles([9]).stepping(Stepping::equal(5))).unwrap();
    for (first, second) in [(2, 4), (4, 2)] {
        let path = problem.run_with(&mut (Patience(first), Patience(second))).unwrap();
        assert_eq!(path.steps.len(), 2);
    }
}

/// Numbers of shapes in VTK's file format, and text that its XML and a table must escape.
#[test]
fn files_name_shapes_and_escape_text() {
    let corners: Vec<Point<3>> =
        (0..8).map(|k| Point::<3>::new((k & 1) as f64, ((k >> 1) & 1) as f64, (k >> 2) as f64)).collect();
    let cells = vec![VtkCell::Tetrahedron([0, 1, 2, 4]), VtkCell::Hexahedron([0, 1, 3, 2, 4, 5, 7, 6])];
    let mut grid = VtkGrid::new(&corners, cells);
    grid.point_data.push(VtkField::scalars("a \"b\" <c>", (0..8).map(f64::from)));
    let xml = grid.to_xml().unwrap();
    assert!(xml.contains("Name=\"a &quot;b&quot; &lt;c&gt;\""), "{xml}");
    // vtkCellType.h: 10 is a tetrahedron, 12 a hexahedron; two bytes behind their count, in base64.
    let types = xml.split("Name=\"types\"").nth(1).unwrap();
    assert!(types.contains("AgAAAAAAAAAKDA=="), "{types}");

    let mut table = Table::new(["what", "value"]);
    table.push([Cell::from("two\nlines"), Cell::from(1.0)]).unwrap();
    assert_eq!(table.to_csv().unwrap(), "what,value\n\"two\nlines\",1\n");
}

/// Parts by functions are written alike, and have columns of their own in the table of forces.
#[test]
fn parts_written_alike_are_told_apart_in_tables() {
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    let (low, high) = (|x: &Point<2>| x[1] < 0.4, |x: &Point<2>| x[1] > 0.6);
    let parts = [Place::on(Side::Max).within(low), Place::on(Side::Max).within(high)];
    let [first, second] = &parts;
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber)
        .hold(Side::Min)
        .prescribe(first.clone(), 0, 0.1)
        .prescribe(second.clone(), 0, 0.2)
        .prescribe(second.clone(), 1, 0.0);
    let problem = scene.discretize(&Scheme::default().particles([9, 11])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let table = problem.history(&path).unwrap();
    for (part, title) in parts.iter().zip(["some of face (0, Max)", "some of face (0, Max) (2)"]) {
        let column = table.header.iter().position(|name| *name == format!("{title}: force_0")).unwrap();
        let force = problem.reaction(path.last(), part.clone()).unwrap()[0];
        assert_eq!(table.rows.last().unwrap()[column], force.into());
    }
    assert_eq!(table.header.iter().filter(|name| name.ends_with("force_0")).count(), 3);
}
