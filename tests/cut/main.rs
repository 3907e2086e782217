//! Laws of cut lattices on drawn shapes.

mod holes;
mod refined;
mod thin;

use std::collections::HashSet;
use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::nalgebra::{Matrix3, Rotation3, Vector3};

use rkpm::cells::CutLattice;
use rkpm::check::{inf_sup, patch_test, spurious_modes};
use rkpm::error::GeometryError;
use rkpm::geometry::Point;
use rkpm::prelude::*;

type Shape = (Vec<Point<3>>, Vec<[u32; 3]>);

/// A box of these sides.
fn block(sides: [f64; 3]) -> Shape {
    let points = (0..8).map(|k| Point::<3>::from_fn(|i, _| if (k >> i) & 1 == 1 { sides[i] } else { 0.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (points, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

/// Rings of points around the third axis between two ends.
fn turned(profile: &[[f64; 2]], count: u32) -> Shape {
    let mut points = Vec::new();
    let rings = profile.len() as u32;
    for [radius, height] in profile {
        for k in 0..count {
            let angle = f64::from(k) / f64::from(count) * std::f64::consts::TAU;
            points.push(Point::<3>::new(radius * angle.cos(), radius * angle.sin(), *height));
        }
    }
    let at = |ring: u32, k: u32| ring * count + k % count;
    let mut facets = Vec::new();
    for ring in 0..rings - 1 {
        for k in 0..count {
            facets.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)]);
            facets.push([at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    let ends = points.len() as u32;
    points.push(Point::<3>::new(0.0, 0.0, profile[0][1]));
    points.push(Point::<3>::new(0.0, 0.0, profile[profile.len() - 1][1]));
    for k in 0..count {
        facets.push([ends, at(0, k + 1), at(0, k)]);
        facets.push([ends + 1, at(rings - 1, k), at(rings - 1, k + 1)]);
    }
    (points, facets)
}

fn ball(radius: f64, count: u32) -> Shape {
    let ring = |k: u32| {
        let angle = f64::from(k) / f64::from(count / 2) * std::f64::consts::PI;
        [radius * angle.sin(), -radius * angle.cos()]
    };
    let mut shape = turned(&(1..count / 2).map(ring).collect::<Vec<_>>(), count);
    let ends = shape.0.len() - 2;
    shape.0[ends][2] = -radius;
    shape.0[ends + 1][2] = radius;
    shape
}

fn cylinder(radius: f64, height: f64, count: u32) -> Shape {
    turned(&[[radius, 0.0], [radius, height]], count)
}

/// The shape turned and shifted as drawn.
fn moved(mut shape: Shape, random: &mut fastrand::Rng) -> Shape {
    let mut draw = || random.f64() - 0.5;
    let turn = Rotation3::from_scaled_axis(Vector3::new(draw(), draw(), draw()) * 4.0);
    let shift = Point::<3>::new(draw(), draw(), draw());
    shape.0.iter_mut().for_each(|x| *x = turn * *x + shift);
    shape
}

fn volume((points, facets): &Shape) -> f64 {
    let at = |k: u32| points[k as usize] - points[0];
    facets.iter().map(|f| at(f[0]).dot(&at(f[1]).cross(&at(f[2]))) / 6.0).sum()
}

fn lattice(shape: &Shape, spacing: f64, axes: Option<Matrix3<f64>>) -> CutLattice {
    let solid = Solid3::new(shape.0.clone(), shape.1.clone()).unwrap();
    match axes {
        Some(axes) => CutLattice::with_axes(&solid, spacing, axes),
        None => CutLattice::new(&solid, spacing),
    }
    .unwrap()
}

fn drawn() -> Vec<(&'static str, Shape)> {
    let mut random = fastrand::Rng::with_seed(7);
    let mut all = vec![("block", block([1.0, 1.0, 1.0]))];
    all.push(("turned block", moved(block([1.0, 0.8, 1.3]), &mut random)));
    all.push(("ball", moved(ball(0.6, 24), &mut random)));
    all.push(("cylinder", moved(cylinder(0.5, 1.0, 24), &mut random)));
    all
}

/// Axes of no plane of a shape.
fn askew(random: &mut fastrand::Rng) -> Matrix3<f64> {
    let mut draw = || 4.0 * random.f64() - 2.0;
    *Rotation3::from_scaled_axis(Vector3::new(draw(), draw(), draw())).matrix()
}

#[test]
fn sub_cells_are_closed_and_fill_the_solid() {
    let mut random = fastrand::Rng::with_seed(3);
    for (name, shape) in drawn() {
        for axes in [None, Some(askew(&mut random)), Some(askew(&mut random))] {
            let cells = lattice(&shape, 0.23, axes);
            for parts in [1, 2] {
                let smoothing = cells.smoothing(parts, 2, &cells.zones(2)).unwrap();
                smoothing.validate().unwrap();
                let total: f64 = smoothing.volumes().iter().sum();
                assert!(relative_eq!(total, volume(&shape), max_relative = 1e-12), "{name} {total} {}", volume(&shape));
                assert!(smoothing.volumes().iter().all(|v| *v > 0.0));
            }
            let gauss: f64 = cells.gauss(4).unwrap().weights.iter().sum();
            assert_relative_eq!(gauss, volume(&shape), max_relative = 1e-12);
        }
    }
}

/// On a cone the mean of two facets' normals, scaled to a unit vector, would leave the plane that the normals end in.
#[test]
fn cones_and_quadratic_bases_keep_homogeneous_fields() {
    let mut random = fastrand::Rng::with_seed(11);
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    let cone = moved(turned(&[[0.6, 0.0], [0.3, 1.0]], 24), &mut random);
    for (name, shape, order) in
        [("cone", cone, 1), ("block", block([1.0; 3]), 2), ("ball", moved(ball(0.6, 24), &mut random), 2)]
    {
        let cells = Arc::new(lattice(&shape, 0.26, Some(askew(&mut random))));
        let scene = Scene::new(Geometry::cells(cells), Solid, Rubber::neo_hookean(0.5, 1e3).unwrap());
        let patch = patch_test(&scene, &gradient, &Scheme::default().order(order)).unwrap().error;
        assert!(patch < 1e-10, "{name} of order {order}: {patch:e}");
    }
}

#[test]
fn homogeneous_fields_are_exact_and_neither_modes_nor_pressures_are_spurious() {
    let mut random = fastrand::Rng::with_seed(3);
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    for (name, shape) in drawn() {
        let cells = Arc::new(lattice(&shape, 0.26, Some(askew(&mut random))));
        let scene = |bulk| Scene::new(Geometry::cells(cells.clone()), Solid, Rubber::neo_hookean(0.5, bulk).unwrap());
        let scheme = Scheme::default();
        let patch = patch_test(&scene(5e3), &gradient, &scheme).unwrap().error;
        let beta = inf_sup(&scene(1e3), &scheme).unwrap().constant;
        let theta = spurious_modes(&scene(5.0 / 6.0), &scheme).unwrap().smallest;
        assert!(patch < 1e-10 && beta > 0.15 && theta > 0.3, "{name}: {patch:e} {beta} {theta}");
    }
}

/// A wheel with teeth, a bore and flanks between sharp edges that are narrower than a spacing.
fn gear(teeth: f64, count: u32) -> Shape {
    let (mut points, mut facets) = (Vec::new(), Vec::new());
    for k in 0..count {
        let angle = f64::from(k) / f64::from(count) * std::f64::consts::TAU;
        let outer = 1.0 + 0.15 * (4.0 * (teeth * angle).sin()).clamp(-1.0, 1.0);
        for (radius, z) in [(0.4, 0.0), (outer, 0.0), (outer, 0.6), (0.4, 0.6)] {
            points.push(Point::<3>::new(radius * angle.cos(), radius * angle.sin(), z));
        }
        for side in 0..4 {
            let at = |k: u32, side: u32| (k % count) * 4 + side % 4;
            let [a, b, c, d] = [at(k, side), at(k + 1, side), at(k + 1, side + 1), at(k, side + 1)];
            facets.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, facets)
}

#[test]
fn a_gear_is_exact_has_zones_enough_and_is_pressed_to_the_end() {
    let mut random = fastrand::Rng::with_seed(4);
    let shape = moved(gear(6.0, 48), &mut random);
    let spacing = (volume(&shape) / 100.0).cbrt();
    let cells = Arc::new(lattice(&shape, spacing, None));
    // Thin parts, whose particles lie on the surface but for one row, have zones of their own.
    let zones = cells.zones(2).offsets.len() - 1;
    assert!(zones > 8, "{zones}");
    let scene = || Scene::new(Geometry::cells(cells.clone()), Solid, Rubber::neo_hookean(0.5, 1e3).unwrap());
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    let patch = patch_test(&scene(), &gradient, &Scheme::default()).unwrap().error;
    assert!(patch < 1e-10, "{patch:e}");
    // Slices of the ends as they come: constraint equations of a part of a piece do not depend on each other.
    let heights = shape.0.iter().map(|x| x[2]);
    let [low, high] = [heights.clone().fold(f64::INFINITY, f64::min), heights.fold(f64::NEG_INFINITY, f64::max)];
    let [low, high] = [low + 0.15 * (high - low), high - 0.15 * (high - low)];
    for moved in [[0.0, 0.0, -0.25 * (high - low)], [0.3 * (high - low), 0.0, 0.0]] {
        let scene = scene()
            .hold(Place::from(Part::Whole).within(move |x| x[2] < low))
            .with(Condition::on(Place::from(Part::Whole).within(move |x| x[2] > high)).displacement(moved));
        let path = scene.discretize(&Scheme::default()).unwrap().run().unwrap();
        // A hundred particles are too few for an answer.
        assert!(path.reached().is_ok());
    }
}

#[test]
fn pieces_of_the_boundary_have_functions_that_sum_to_one_and_to_the_normal() {
    let mut random = fastrand::Rng::with_seed(5);
    for (name, shape) in drawn() {
        let cells = lattice(&shape, 0.2, Some(askew(&mut random)));
        let smoothing = cells.smoothing(2, 2, &cells.zones(2)).unwrap();
        let bits = |x: &Point<3>| [x[0].to_bits(), x[1].to_bits(), x[2].to_bits()];
        let known: HashSet<[u64; 3]> = smoothing.facet_points.iter().map(bits).collect();
        let (mut area, mut flux) = (0.0, 0.0);
        for piece in cells.boundary_pieces(&Part::Whole, 2, 2).unwrap() {
            piece.validate(cells.positions().len()).unwrap();
            for ((at, weight), traces) in piece.points.positions.iter().zip(&piece.points.weights).zip(&piece.traces) {
                assert!(abs_diff_eq!(traces.iter().map(|f| f.1).sum::<f64>(), 1.0, epsilon = 1e-10), "{name}");
                // Those of the smoothing.
                assert!(known.contains(&bits(at)));
                area += weight;
            }
            let normals = piece.points.positions.iter().zip(&piece.points.normals).zip(&piece.points.weights);
            flux += normals.map(|((x, n), w)| x.dot(n) * w).sum::<f64>();
        }
        assert!(relative_eq!(flux / 3.0, volume(&shape), max_relative = 1e-12) && area > 1.0, "{name}");
    }
}

#[test]
fn walls_that_particles_cannot_follow_are_refused_with_the_place() {
    let (points, facets) = block([1.0, 1.0, 0.05]);
    let solid = Solid3::new(points, facets).unwrap();
    let error = CutLattice::new(&solid, 0.25).unwrap_err();
    let GeometryError::ThinWall { thickness, needed, .. } = error else { panic!("{error}") };
    assert_abs_diff_eq!(thickness, 0.05, epsilon = 1e-12);
    assert_abs_diff_eq!(needed, 0.1, epsilon = 1e-12);
    assert!(CutLattice::new(&solid, 0.099).is_ok());
    for spacing in [0.0, -1.0, f64::NAN, 1e-9] {
        assert!(CutLattice::new(&solid, spacing).is_err());
    }
}

#[test]
fn a_cylinder_between_its_ends() {
    let (points, facets) = cylinder(0.5, 1.0, 24);
    let solid = Solid3::new(points, facets).unwrap();
    let ends = [([0.0; 3], [0.0, 0.0, -1.0]), ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])];
    let solid = ["base", "top"]
        .iter()
        .zip(ends)
        .fold(solid, |solid, (name, (at, normal))| solid.name(name, Select::plane(at, normal)).unwrap());
    let scene = Scene::new(&solid, Solid, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold("base")
        .with(Condition::on("top").displacement([0.2, 0.0, -0.1]).named("top"));
    let problem = scene.discretize(&Scheme::default().spacing(0.2)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let [base, top] = ["base", "top"].map(|name| problem.reaction(path.last(), name).unwrap());
    assert!(top.norm() > 0.0);
    assert_abs_diff_eq!(base, -top, epsilon = 5e-10 * top.norm());
    // Halfway up the middle moves half of it, but for the bulge.
    let middle = problem.displacement(path.last(), &[0.0, 0.0, 0.5].into()).unwrap();
    assert!((middle - Point::<3>::new(0.1, 0.0, -0.05)).norm() < 5e-3, "{middle}");
    let grid = problem.vtk_grid(path.last()).unwrap();
    let highest = grid.points.iter().map(|x| x[2]).fold(0.0, f64::max);
    assert_abs_diff_eq!(highest, 0.9, epsilon = 0.02);
    assert!(!grid.cells.is_empty());
    problem.picture(path.last(), rkpm::scene::Field::MisesStress).unwrap().to_svg().unwrap();
    let unknown = scene.clone().hold("side").discretize(&Scheme::default().spacing(0.2)).err().unwrap();
    assert!(unknown.to_string().contains("base, top"), "{unknown}");
}

/// Cells have the ratio of their volumes beside the facets of a surface, which have none.
#[test]
fn cells_beside_a_surface_tell_their_volume() {
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let (points, facets) = cylinder(0.5, 1.0, 24);
    let scene = Scene::assembly(Solid).body("pin", Solid3::new(points, facets).unwrap(), rubber()).body(
        "block",
        Block::new([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        rubber(),
    );
    let problem = scene.discretize(&Scheme::default().spacing(0.25)).unwrap();
    let grid = problem.vtk_grid(&problem.at_rest()).unwrap();
    let field = grid.cell_data.iter().find(|field| field.name == "volume ratio").unwrap();
    let rkpm::output::VtkValues::Scalars(ratios) = &field.values else { panic!("{field:?}") };
    let bricks = grid.cells.iter().filter(|cell| matches!(cell, rkpm::output::VtkCell::Hexahedron(_))).count();
    assert!(bricks > 0 && bricks < ratios.len() && grid.to_xml().is_ok());
    for (cell, ratio) in grid.cells.iter().zip(ratios) {
        match cell {
            rkpm::output::VtkCell::Hexahedron(_) => assert_abs_diff_eq!(*ratio, 1.0, epsilon = 1e-12),
            _ => assert!(ratio.is_nan()),
        }
    }
}
