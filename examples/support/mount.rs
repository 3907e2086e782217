//! A round rubber mount with a bonded insert, axisymmetric and in 3D [mm, MPa].
#![allow(dead_code)] // Nobody needs all of it.

use std::f64::consts::PI;

use rkpm::prelude::*;

/// The force \[N\] on half of the mount whose insert is pressed down by 2 mm: graded meshes of Q2/P1 elements, refined and
/// extrapolated; 295.0 to 295.4.
pub const FORCE: f64 = 295.2;

/// Its corners (radius, height) from the axis at the base on; the insert lies on the last two sides but one.
const CORNERS: [[f64; 2]; 6] = [[0.0, 0.0], [26.0, 0.0], [16.0, 24.0], [7.0, 24.0], [7.0, 10.0], [0.0, 10.0]];
/// Names of the sides from each corner to the next one.
const SIDES: [&str; 6] = ["base", "outside", "top", "wall", "floor", "axis"];

/// C10 = 0.55, C20 = −0.05, C30 = 0.01, k = 1100.
pub fn rubber() -> Result<Rubber, rkpm::Error> {
    Ok(Rubber::yeoh(0.55, -0.05, 0.01, 1.1e3)?)
}

/// Half of the section, drawn the one way or the other; the insert's sides are named `wall` and `floor`.
pub fn section(backwards: bool) -> Result<Region, rkpm::Error> {
    let mut outline = Outline::at(CORNERS[0]);
    for k in 1..=CORNERS.len() {
        let (side, to) = if backwards { (6 - k, 6 - k) } else { (k - 1, k % 6) };
        outline = if k == 6 { outline.close(SIDES[side]) } else { outline.line(SIDES[side], CORNERS[to]) };
    }
    Ok(Region::new(outline)?)
}

/// Half of a turn as a closed surface of so many segments, with the parts `base`, `middle` (the plane of symmetry y = 0) and `insert`.
pub fn half(segments: u32) -> Result<Solid3, rkpm::Error> {
    let (row, mut points) = (segments + 1, Vec::new());
    for [radius, height] in &CORNERS[1..5] {
        for k in 0..=segments {
            let (sin, cos) = (PI * f64::from(k) / f64::from(segments)).sin_cos();
            points.push(Point::<3>::new(radius * cos, radius * sin, *height));
        }
    }
    let on_axis = points.len() as u32;
    points.extend([Point::<3>::new(0.0, 0.0, 0.0), Point::<3>::new(0.0, 0.0, 10.0)]);
    let mut facets: Vec<[u32; 3]> = Vec::new();
    for k in 0..segments {
        for ring in [0, 1, 2] {
            let (a, b) = (ring * row + k, (ring + 1) * row + k);
            facets.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
        facets.extend([[on_axis, k + 1, k], [on_axis + 1, 3 * row + k, 3 * row + k + 1]]);
    }
    for (end, turned) in [(0, false), (segments, true)] {
        let [outer, shoulder, rim, foot] = [0, 1, 2, 3].map(|ring| ring * row + end);
        let ends = [[on_axis, outer, foot], [on_axis, foot, on_axis + 1], [outer, shoulder, rim], [outer, rim, foot]];
        facets.extend(ends.map(|[a, b, c]| if turned { [a, c, b] } else { [a, b, c] }));
    }
    let solid = Solid3::new(points, facets)?;
    let bonded = |facet: &u32| {
        let corners = solid.corners(*facet as usize);
        let on_insert = |x: &Point<3>| x[0].hypot(x[1]) < 7.0 + 1e-6 && x[2] > 10.0 - 1e-6;
        corners.iter().all(on_insert) && corners.iter().any(|x| x[1] > 1e-6)
    };
    let insert: Vec<u32> = (0..solid.facets().len() as u32).filter(bonded).collect();
    Ok(solid
        .name("base", Select::plane([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]))?
        .name("middle", Select::plane([0.0, 0.0, 0.0], [0.0, -1.0, 0.0]))?
        .name("insert", Select::facets(insert))?)
}
