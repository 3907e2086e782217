//! Cells follow curved boundaries: areas of the fourth order, and the laws of integration as exact as on straight cells.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use approx::abs_diff_eq;
use rkpm::cells::{Cells, Lattice, Layout, Refined, Scatter, Smoothing, Triangulation, Voronoi};
use rkpm::geometry::{Mapped, Outline, Part, Region};
use rkpm::kinematics::Kinematics;
use rkpm::prelude::*;
use rkpm::shape::ReproducingKernel;
use rkpm::table::ShapeTable;

/// A quarter ring of radii 1 and 2, radius along axis 0.
fn ring(unit: &Point<2>) -> Point<2> {
    let (radius, angle) = (1.0 + unit[0], FRAC_PI_2 * unit[1]);
    Point::<2>::new(radius * angle.cos(), radius * angle.sin())
}

/// The same as a body of unit height.
fn cylinder(unit: &Point<3>) -> Point<3> {
    let flat = ring(&Point::<2>::new(unit[0], unit[1]));
    Point::<3>::new(flat[0], flat[1], unit[2])
}

/// A plate of 4 × 4 with a hole of radius 1, off its middle and away from the axis.
fn plate() -> Region {
    let square = Outline::at([1.0, 0.0])
        .line("bottom", [5.0, 0.0])
        .line("right", [5.0, 4.0])
        .line("top", [1.0, 4.0])
        .close("left");
    Region::with_holes(square, [Outline::circle("hole", [3.0, 2.2], 1.0)]).unwrap()
}

fn refined(macros: &[usize], cells: usize) -> Refined {
    Refined::new(Arc::new(Mapped(ring)), [cells, cells]).unwrap().refined(macros).unwrap()
}

fn measure<const D: usize>(cells: &dyn Cells<D>) -> [f64; 2] {
    let smoothed = cells.smoothing(2, 2, &cells.zones(1)).unwrap();
    [cells.gauss(4).unwrap().weights.iter().sum(), smoothed.volumes().iter().sum()]
}

#[test]
fn curved_cells_fill_the_body_to_fourth_order() {
    // Halved spacings: errors of chords would fall by 4, those of parabolas by 16.
    let falls = |what: &str, errors: [[f64; 2]; 2]| {
        for rule in 0..2 {
            let [coarse, fine] = [errors[0][rule].abs(), errors[1][rule].abs()];
            assert!(coarse < 1e-3 && fine < coarse / 12.0, "{what}, rule {rule}: {coarse:.1e}, {fine:.1e}");
        }
    };
    let errors = |exact: f64, found: [f64; 2]| found.map(|m| m / exact - 1.0);
    let quarter = 0.75 * PI;
    let of = |n: usize| {
        let lattice = Lattice::new(&Mapped(ring), [n, 2 * n - 1], &Layout::Regular).unwrap();
        errors(quarter, measure::<2>(&lattice))
    };
    falls("ring", [of(3), of(5)]);
    let of = |n: usize| {
        let lattice = Lattice::new(&Mapped(cylinder), [n, 2 * n - 1, 3], &Layout::Regular).unwrap();
        errors(quarter, measure::<3>(&lattice))
    };
    falls("cylinder", [of(3), of(5)]);
    falls("refined", [4, 8].map(|n| errors(quarter, measure::<2>(&refined(&[], n)))));
    // Particles of a circle are scattered in equal numbers of chords: their sagittas fall as those of regular polygons.
    let of = |h: f64| Triangulation::scattered(&plate(), |_| h, &Scatter::default()).unwrap();
    let exact = 16.0 - PI;
    falls("plate", [0.15, 0.075].map(|h| errors(exact, measure::<2>(&of(h)))));
    falls("Voronoi", [0.15, 0.075].map(|h| errors(exact, measure::<2>(&Voronoi::new(of(h))))));
}

/// Rounding of sums over some hundred points.
const ROUNDING: f64 = 1e-11;

/// Gradients of constants vanish, those of coordinates are unit vectors, and what all cells give a particle is what the
/// boundary gives it.
fn laws<const D: usize>(what: &str, cells: &dyn Cells<D>, kinematics: &dyn Kinematics<D>) {
    let functions = ReproducingKernel::new(cells.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let holds = |rule: &str, smoothing: &Smoothing<D>, parts: usize, gauss: usize| {
        let table = ShapeTable::smoothed(&functions, smoothing, kinematics).unwrap();
        let mut inner = vec![Point::<D>::zeros(); cells.positions().len()];
        for point in 0..table.point_count() {
            let (nodes, gradients) = (table.nodes(point), table.gradients(point));
            for axis in 0..D {
                let slopes = &gradients[axis * nodes.len()..(axis + 1) * nodes.len()];
                let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
                    nodes.iter().zip(slopes).map(|(&node, slope)| of(node as usize) * slope).sum()
                };
                assert!(abs_diff_eq!(sum(&|_| 1.0), 0.0, epsilon = ROUNDING), "{what}, {rule}");
                for i in 0..D {
                    let slope = sum(&|node| cells.positions()[node][i]);
                    assert!(
                        abs_diff_eq!(slope, f64::from(u8::from(i == axis)), epsilon = ROUNDING),
                        "{what}, {rule}: {slope}"
                    );
                }
                for (&node, slope) in nodes.iter().zip(slopes) {
                    inner[node as usize][axis] += table.weights()[point] * slope;
                }
            }
            if !table.hoop_components().is_empty() {
                // The radius is a linear field too: its hoop is one.
                let radii = nodes.iter().zip(&gradients[D * nodes.len()..]);
                let sum: f64 = radii.map(|(&node, g)| cells.positions()[node as usize][0] * g).sum();
                assert!(abs_diff_eq!(sum, 1.0, epsilon = ROUNDING), "{what}, {rule}: hoop {sum}");
            }
        }
        if table.hoop_components().is_empty() {
            let boundary = cells.boundary(&Part::Whole, parts, gauss).unwrap().points;
            let outer = ShapeTable::new(&functions, &boundary, kinematics).unwrap();
            for point in 0..outer.point_count() {
                let force = outer.normals()[point] * outer.weights()[point];
                for (&node, value) in outer.nodes(point).iter().zip(outer.values(point)) {
                    inner[node as usize] -= force * *value;
                }
            }
            let off = inner.iter().map(|f| f.amax()).fold(0.0, f64::max);
            assert!(off < ROUNDING, "{what}, {rule}: {off:.1e}");
        }
    };
    for (parts, gauss) in [(1, 2), (2, 2), (3, 3)] {
        if let Ok(smoothing) = cells.smoothing(parts, gauss, &cells.zones(2)) {
            holds(&format!("{parts} parts"), &smoothing, parts, gauss);
        }
    }
    if let Ok(dual) = cells.nodal_cells(2) {
        holds("dual", &dual, 2, 2);
    }
}

#[test]
fn laws_of_integration_are_exact_on_curved_cells() {
    let jittered = Layout::Jittered { amount: 0.2, seed: 3 };
    let lattice = Lattice::new(&Mapped(ring), [4, 6], &jittered).unwrap();
    laws("ring", &lattice, &PlaneStrain);
    laws("ring in revolution", &lattice_off_axis(), &Axisymmetric);
    laws("cylinder", &Lattice::new(&Mapped(cylinder), [3, 5, 3], &jittered).unwrap(), &Solid);
    laws("refined", &refined(&[1], 4), &PlaneStrain);
    let triangles = Triangulation::scattered(&plate(), |_| 0.5, &Scatter::default()).unwrap();
    laws("plate in revolution", &triangles, &Axisymmetric);
    laws("plate", &triangles, &PlaneStrain);
    laws("Voronoi in revolution", &Voronoi::new(triangles.clone()), &Axisymmetric);
    laws("Voronoi", &Voronoi::new(triangles), &PlaneStrain);
}

/// The ring moved away from the axis of revolution.
fn lattice_off_axis() -> Lattice<2> {
    let moved = Mapped(|unit: &Point<2>| ring(unit) + Point::<2>::new(1.0, 0.0));
    Lattice::new(&moved, [4, 6], &Layout::Regular).unwrap()
}

#[test]
fn straight_domains_keep_straight_cells() {
    // Two points on each facet of straight cells, three on those of curved ones.
    let facets = |lattice: &Lattice<2>| lattice.smoothing(2, 2, &lattice.zones(1)).unwrap().facet_offsets[1];
    let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
    let jittered = Layout::Jittered { amount: 0.3, seed: 1 };
    let straight = Lattice::new(&Quadrilateral { corners }, [5, 6], &jittered).unwrap();
    // Uneven along straight sides: middles move along their chords only.
    let uneven = Mapped(|unit: &Point<2>| Point::<2>::new(unit[0] * unit[0] + 0.1 * unit[0], unit[1]));
    let uneven = Lattice::new(&uneven, [5, 6], &Layout::Regular).unwrap();
    assert_eq!([facets(&straight), facets(&uneven), facets(&lattice_off_axis())], [2, 2, 3]);
}
