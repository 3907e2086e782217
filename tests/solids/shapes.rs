//! GOAL: shapes become closed surfaces with sharp edges, whose volumes and areas converge with the square of the spacing.

use std::f64::consts::PI;

use approx::assert_abs_diff_eq;
use rkpm::error::{GeometryError, SolidError};
use rkpm::geometry::Point;
use rkpm::solid::{Shape, Solid3};

/// Volumes and areas at two spacings, the second half of the first, against the exact ones.
fn converges(shape: &Shape, spacing: f64, volume: f64, area: f64) {
    let errors = [spacing, 0.5 * spacing].map(|h| {
        let solid = shape.solid(h).unwrap();
        [(solid.volume() / volume - 1.0).abs(), (solid.area() / area - 1.0).abs()]
    });
    for k in 0..2 {
        assert!(errors[1][k] < 0.02 && errors[1][k] < 0.35 * errors[0][k] + 1e-12, "{errors:?}");
    }
}

#[test]
fn primitives_converge_with_the_square_of_the_spacing() {
    let turned = |shape: Shape| shape.rotated([1.0, 2.0, 0.5], 0.7).translated([0.3, -2.0, 5.0]);
    converges(&turned(Shape::sphere([0.0; 3], 1.0)), 0.2, 4.0 * PI / 3.0, 4.0 * PI);
    converges(&turned(Shape::block([0.0; 3], [1.0, 0.7, 0.4])), 0.13, 0.28, 2.0 * (0.7 + 0.4 + 0.28));
    converges(&turned(Shape::cylinder([0.0; 3], [0.0, 0.0, 2.0], 0.8)), 0.2, 1.28 * PI, PI * (1.28 + 3.2));
    converges(&turned(Shape::torus([0.0; 3], [0.0, 0.0, 1.0], 1.0, 0.4)), 0.14, 0.32 * PI * PI, 1.6 * PI * PI);
    let slant = 1f64.hypot(0.5);
    let (volume, area) = (PI / 3.0 * (1.0 + 0.5 + 0.25), PI * (1.25 + slant * 1.5));
    converges(&turned(Shape::cone([0.0; 3], [0.0, 1.0, 0.0], 1.0, 0.5)), 0.15, volume, area);
    converges(&turned(Shape::cone([0.0; 3], [0.0, 1.0, 0.0], 1.0, 0.0)), 0.15, PI / 3.0, PI * (1.0 + 2f64.sqrt()));
}

#[test]
fn edges_are_sharp_and_plane_faces_exact() {
    let block = |min, max| Shape::block(min, max);
    let bracket = block([0.0; 3], [2.0, 1.0, 1.0]).minus(block([0.5, 0.4, -1.0], [1.5, 2.0, 2.0]).named("slot"));
    let bracket = bracket.union(block([0.0, 1.0, 0.0], [0.2, 1.5, 1.0])).rotated([1.0, 1.0, 0.3], 0.4);
    let solid = bracket.solid(0.11).unwrap();
    assert_abs_diff_eq!(solid.volume(), 2.0 - 0.6 + 0.1, epsilon = 1e-9);
    let slot: f64 = solid.facets_of("slot").unwrap().iter().map(|&f| facet_area(&solid, f)).sum();
    assert_abs_diff_eq!(slot, 1.0 + 0.6 + 0.6, epsilon = 1e-9);
}

fn facet_area(solid: &Solid3, facet: u32) -> f64 {
    let [a, b, c] = solid.corners(facet as usize);
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// A drawn shape of two to four primitives, and whether a point is in it.
type Drawn = (Shape, Box<dyn Fn(&Point<3>) -> f64>);

fn drawn_shape(random: &mut fastrand::Rng) -> Drawn {
    let mut number = |low: f64, high: f64| low + (high - low) * random.f64();
    let mut all: Option<Drawn> = None;
    for _ in 0..2 + (number(0.0, 3.0) as usize) {
        let (centre, axis) = ([0; 3].map(|_| number(-0.6, 0.6)), [0; 3].map(|_| number(-1.0, 1.0)));
        let (r, s) = (number(0.3, 0.8), number(0.15, 0.28));
        let angle = number(0.0, 3.0);
        let (kind, how) = (number(0.0, 5.0) as usize, number(0.0, 3.0) as usize);
        let turn = rkpm::nalgebra::Rotation3::from_axis_angle(&rkpm::nalgebra::Unit::new_normalize(axis.into()), angle);
        let local = move |x: &Point<3>| turn.inverse() * (x - Point::<3>::from(centre));
        let flat = |y: &Point<3>| y[0].hypot(y[1]);
        let (shape, inside): Drawn = match kind {
            0 => (Shape::sphere([0.0; 3], r), Box::new(move |x| local(x).norm() - r)),
            1 => (
                Shape::block([-r, -s, -0.5], [r, s, 0.5]),
                Box::new(move |x| (local(x).abs() - Point::<3>::new(r, s, 0.5)).max()),
            ),
            2 => (
                Shape::cylinder([0.0, 0.0, -r], [0.0, 0.0, r], s),
                Box::new(move |x| (flat(&local(x)) - s).max(local(x)[2].abs() - r)),
            ),
            3 => (
                Shape::torus([0.0; 3], [0.0, 0.0, 1.0], r, s),
                Box::new(move |x| (flat(&local(x)) - r).hypot(local(x)[2]) - s),
            ),
            _ => (
                Shape::cone([0.0, 0.0, -r], [0.0, 0.0, r], r, 0.0),
                Box::new(move |x| ((2.0 * flat(&local(x)) - r + local(x)[2]) / 5f64.sqrt()).max(-r - local(x)[2])),
            ),
        };
        let shape = shape.rotated(axis, angle).translated(centre);
        all = Some(match (all, how) {
            (None, _) => (shape, inside),
            (Some((a, f)), 0) => (a.minus(shape), Box::new(move |x| f(x).max(-inside(x)))),
            (Some((a, f)), _) => (a.union(shape), Box::new(move |x| f(x).min(inside(x)))),
        });
    }
    all.unwrap()
}

#[test]
fn drawn_shapes_are_closed_and_contain_what_they_should() {
    let mut random = fastrand::Rng::with_seed(7);
    let (mut refused, mut wrong, mut asked) = (Vec::new(), 0, 0);
    let total = std::env::var("SHAPES").map_or(20, |n| n.parse().unwrap());
    for number in 0..total {
        let (shape, f) = drawn_shape(&mut random);
        let solid = match shape.solid(0.08) {
            Ok(solid) => solid,
            // Some are cut away whole.
            Err(GeometryError::Solid(SolidError::Empty { .. })) => {
                assert!((0..2000).all(|_| f(&super::drawn(&mut random, 1.5)) > -0.02));
                continue;
            }
            Err(error) => {
                refused.push(format!("{number}: {error}"));
                continue;
            }
        };
        for _ in 0..300 {
            let x = super::drawn(&mut random, 1.5);
            // A spacing of 0.08 lets chords of the smallest radius, 0.15, lie 0.02 off; thin pieces are as wide.
            if f(&x).abs() > 0.03 {
                asked += 1;
                wrong += usize::from(solid.contains(&x) != (f(&x) < 0.0));
            }
        }
    }
    println!("{} of {total} refused, {wrong} of {asked} points wrong\n{}", refused.len(), refused.join("\n"));
    assert!(refused.is_empty() && wrong == 0, "{wrong} points");
}

#[test]
fn level_sets_keep_their_creases() {
    // A ball, and a double cone cut from it, by one formula.
    let ball = Shape::level_set([-1.1; 3], [1.1; 3], |x| x.norm_squared() - 1.0);
    converges(&ball, 0.15, 4.0 * PI / 3.0, 4.0 * PI);
    let lens = |x: &Point<3>| {
        (x - Point::<3>::new(0.0, 0.0, 0.6)).norm().max((x + Point::<3>::new(0.0, 0.0, 0.6)).norm()) - 1.0
    };
    let (volume, area) = (2.0 * PI * 0.16 * (3.0 - 0.4) / 3.0, 4.0 * PI * 0.4);
    converges(&Shape::level_set([-1.0; 3], [1.0; 3], lens), 0.08, volume, area);
    let nothing = Shape::level_set([0.0; 3], [1.0; 3], |_| 1.0).solid(0.1);
    assert!(matches!(nothing, Err(GeometryError::Solid(SolidError::Empty { .. }))));
}

#[test]
fn voxels_above_a_threshold_are_a_solid() {
    // A ball of radius 1 with a bubble, cut by an end of the stack: gray values, and black and white.
    let distance = |x: &Point<3>| (x.norm() - 1.0).max(0.5 - (x - Point::<3>::new(0.2, 0.1, 0.0)).norm());
    let counts = [50, 60, 40];
    let stack = |value: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let at = |k: usize| [k % 50, k / 50 % 60, k / 3000].map(|i| 0.05 * (i as f64 + 0.5));
        (0..50 * 60 * 40).map(|k| value(distance(&(Point::from(at(k)) - Point::<3>::new(1.2, 1.5, 0.8))))).collect()
    };
    let cap = PI * 0.04 * (3.0 - 0.2) / 3.0;
    let volume = 4.0 * PI / 3.0 * (1.0 - 0.125) - cap;
    for (values, tolerance) in [(stack(&|d| -d), 2e-3), (stack(&|d| f64::from(d < 0.0) - 0.5), 1e-2)] {
        let solid = Shape::voxels(counts, [0.05; 3], values, 0.0).unwrap().solid(0.05).unwrap();
        assert_abs_diff_eq!(solid.volume() / volume, 1.0, epsilon = tolerance);
        assert!(!solid.contains(&[1.4, 1.6, 0.8].into()) && solid.contains(&[0.4, 1.5, 0.8].into()));
    }
    let one = Shape::voxels([2, 2, 2], [1.0; 3], vec![1.0; 8], 0.5);
    assert!(matches!(one, Err(GeometryError::Solid(SolidError::Empty { .. }))));
    assert!(matches!(Shape::voxels([2, 2, 2], [1.0; 3], vec![1.0; 7], 0.5), Err(GeometryError::Count { .. })));
    assert!(matches!(Shape::voxels([1, 1, 2], [0.0; 3], vec![0.0, 1.0], 0.5), Err(GeometryError::Invalid(_))));
    // Noise has specks, necks and cavities of all sizes.
    let mut random = fastrand::Rng::with_seed(11);
    let noise: Vec<f64> = (0..8000).map(|_| random.f64()).collect();
    let solid = Shape::voxels([20; 3], [1.0; 3], noise, 0.55).unwrap().solid(0.9).unwrap();
    assert!(solid.volume() > 1000.0 && solid.volume() < 5000.0, "{}", solid.volume());
}

#[test]
fn shapes_that_can_not_be_are_refused() {
    let bad = [
        Shape::sphere([0.0; 3], -1.0),
        Shape::block([0.0; 3], [1.0, 0.0, 1.0]),
        Shape::cylinder([0.0; 3], [0.0; 3], 1.0),
        Shape::torus([0.0; 3], [0.0, 0.0, 1.0], 1.0, 2.0),
        Shape::half_space([0.0; 3], [0.0, 0.0, 1.0]),
        Shape::sphere([f64::NAN; 3], 1.0),
    ];
    for shape in bad {
        let error = shape.solid(0.1).map(|_| ()).unwrap_err();
        assert!(matches!(error, GeometryError::Invalid(_)), "{error}");
    }
    let apart = Shape::sphere([0.0; 3], 1.0).intersect(Shape::sphere([5.0, 0.0, 0.0], 1.0)).solid(0.1);
    assert!(matches!(apart, Err(GeometryError::Solid(SolidError::Empty { .. }))));
    assert!(matches!(Shape::sphere([0.0; 3], 1.0).solid(1e-9), Err(GeometryError::Count { .. })));
}

/// Areas may differ by rounding in a chain: each from the next by less than what is told apart, the ends by more.
#[test]
fn patches_of_nearly_equal_areas_are_ordered() {
    const SIDES: u32 = 41;
    let angles: Vec<f64> = (0..SIDES).map(|k| 1.0 + 6e-10 * f64::from(7 * k % SIDES)).collect();
    let whole: f64 = angles.iter().sum();
    let mut turned = 0.0;
    let mut vertices = Vec::new();
    for angle in &angles {
        let (sine, cosine) = (std::f64::consts::TAU * turned / whole).sin_cos();
        vertices.extend([[cosine, sine, 0.0], [cosine, sine, 1.0]].map(Point::<3>::from));
        turned += angle;
    }
    let mut facets = Vec::new();
    for k in 0..SIDES {
        let [a, b] = [2 * k, 2 * ((k + 1) % SIDES)];
        facets.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    for k in 1..SIDES - 1 {
        facets.extend([[0, 2 * k + 2, 2 * k], [1, 2 * k + 1, 2 * k + 3]]);
    }
    let prism = Solid3::new(vertices, facets).unwrap();
    let patches = prism.patches(0.1);
    assert_eq!(patches.len(), SIDES as usize + 2);
    let corner = |v: u32| prism.vertices()[v as usize];
    let area = |facet: &u32| {
        let [a, b, c] = prism.facets()[*facet as usize].map(corner);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let areas: Vec<f64> = patches.iter().map(|facets| facets.iter().map(area).sum()).collect();
    assert!(areas.windows(2).all(|pair| pair[0] > pair[1] * (1.0 - 1e-7)), "{areas:?}");
}
