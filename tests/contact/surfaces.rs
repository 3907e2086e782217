//! Normals are gradients of gaps, curvatures are gradients of normals, for every rigid surface.

use approx::abs_diff_eq;
use rkpm::contact::{Ball, Cone, Cylinder, Plane, Profile, Surface, Triangulated};
use rkpm::geometry::{Point, Turn};
use rkpm::mesh::{CellShape, Mesh};

/// Draws of numbers in (-1, 1).
fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Central differences at points drawn around a surface; points whose nearest one changes within a difference are left out.
fn check<const D: usize>(name: &str, surface: &impl Surface<D>, size: f64) {
    surface.validate().unwrap();
    let mut draw = draws(7);
    let h = 1e-5;
    let mut checked = 0;
    for _ in 0..400 {
        let x = Point::<D>::from_fn(|_, _| size * draw());
        let at = surface.nearest(&x);
        assert!(abs_diff_eq!(at.normal.norm(), 1.0, epsilon = 1e-12), "{name}: normal {:?} at {x:?}", at.normal);
        let moved = |i: usize, by: f64| {
            let mut y = x;
            y[i] += by;
            surface.nearest(&y)
        };
        // The nearest point lies on the surface.
        let foot = surface.nearest(&(x - at.normal * at.gap));
        let near_kink = (0..D).any(|i| (moved(i, h).normal - moved(i, -h).normal).norm() > 1e-2);
        if near_kink || at.passed_end || at.curvature.norm() > 1e2 {
            continue;
        }
        checked += 1;
        assert!(abs_diff_eq!(foot.gap, 0.0, epsilon = 1e-9 * size), "{name}: foot of {x:?} is {:e} off", foot.gap);
        for i in 0..D {
            let (ahead, behind) = (moved(i, h), moved(i, -h));
            let slope = (ahead.gap - behind.gap) / (2.0 * h);
            assert!(abs_diff_eq!(slope, at.normal[i], epsilon = 1e-6), "{name} at {x:?}: {slope} {}", at.normal[i]);
            for j in 0..D {
                let turn = (ahead.normal[j] - behind.normal[j]) / (2.0 * h);
                let curvature = at.curvature[(i, j)];
                assert!(
                    abs_diff_eq!(turn, curvature, epsilon = 1e-4 * (1.0 + curvature.abs())),
                    "{name} at {x:?}: {turn} {curvature}"
                );
            }
        }
    }
    assert!(checked > 200, "{name}: {checked}");
}

#[test]
fn normals_and_curvatures_are_derivatives_of_gaps() {
    check("plane", &Plane { through: [0.3, 0.2].into(), normal: [1.0, 2.0].into() }, 2.0);
    check("plane", &Plane { through: [0.3, 0.2, 0.1].into(), normal: [1.0, 2.0, -1.0].into() }, 2.0);
    for hollow in [false, true] {
        check("disc", &Ball::<2> { centre: [0.1, 0.2].into(), radius: 0.7, hollow }, 2.0);
        check("sphere", &Ball::<3> { centre: [0.1, 0.2, -0.3].into(), radius: 0.7, hollow }, 2.0);
        let (through, along) = ([0.1, 0.0, 0.2].into(), [1.0, 1.0, 0.3].into());
        check("cylinder", &Cylinder { through, along, radius: 0.6, hollow }, 2.0);
    }
    check("cone", &Cone { tip: [0.1, 0.2, 0.0].into(), along: [0.2, 0.1, 1.0].into(), half_angle: 0.6 }, 2.0);
    let groove = Profile::at([1.5, 1.0])
        .line([1.5, -0.5])
        .arc([1.2, -0.8], [1.2, -0.5], Turn::Right)
        .line([-1.0, -0.8])
        .line([-1.0, 1.0]);
    check("groove", &groove, 1.4);
    let cam =
        Profile::at([0.8, 0.0]).arc([0.0, 0.8], [0.0, 0.0], Turn::Left).line([-0.8, 0.8]).line([-0.8, 0.0]).close();
    check("cam", &cam, 2.0);
}

#[test]
fn profiles_know_their_inside() {
    let square = Profile::at([0.0, 0.0]).line([1.0, 0.0]).line([1.0, 1.0]).line([0.0, 1.0]).close();
    for (x, gap) in [([0.5, 0.4], -0.4), ([0.5, 1.5], 0.5), ([4.0, 5.0], 5.0), ([-0.3, 0.5], 0.3), ([0.9, 0.5], -0.1)] {
        assert!(abs_diff_eq!(square.nearest(&x.into()).gap, gap, epsilon = 1e-12), "{x:?}");
    }
    // The same way the other way round bounds a cavity.
    let cavity = Profile::at([0.0, 0.0]).line([0.0, 1.0]).line([1.0, 1.0]).line([1.0, 0.0]).close();
    for (x, gap) in [([0.5, 0.4], 0.4), ([0.5, 1.5], -0.5), ([4.0, 5.0], -5.0)] {
        assert!(abs_diff_eq!(cavity.nearest(&x.into()).gap, gap, epsilon = 1e-12), "{x:?}");
    }
    let open = Profile::at([1.0, 0.0]).line([0.0, 0.0]);
    assert!(open.nearest(&[2.0, 0.3].into()).passed_end && !open.nearest(&[0.5, 0.3].into()).passed_end);
}

/// Two hexahedra side by side, as a mesh.
fn bricks() -> Mesh<3> {
    let corner = |k: usize| [(k % 3) as f64 - 1.0, ((k / 3) % 2) as f64 - 0.5, (k / 6) as f64 - 0.5].into();
    let cells = vec![0, 1, 4, 3, 6, 7, 10, 9, 1, 2, 5, 4, 7, 8, 11, 10];
    Mesh::new((0..12).map(corner).collect(), &[(CellShape::Hexahedron, cells)], &[]).unwrap()
}

#[test]
fn hulls_of_meshes_are_signed_distances() {
    let hull = Triangulated::hull(&bricks());
    check("hull", &hull, 2.0);
    // Beside the distance of a box.
    let mut draw = draws(11);
    for _ in 0..200 {
        let x = Point::<3>::from_fn(|_, _| 2.0 * draw());
        let away = Point::<3>::new(x[0].abs() - 1.0, x[1].abs() - 0.5, x[2].abs() - 0.5);
        let outside = away.map(|v| v.max(0.0)).norm();
        let gap = if outside > 0.0 { outside } else { away.max() };
        assert!(abs_diff_eq!(hull.nearest(&x).gap, gap, epsilon = 1e-12), "{x:?}: {} {gap}", hull.nearest(&x).gap);
    }
}
