//! Boundary facets of scattered particles and their plain trace functions.

use crate::error::GeometryError;
use crate::geometry::Vec2;
use crate::quadrature::{check_parts, gauss_legendre};

use super::BoundaryCells;
use super::mesh::{Mesh, Piece, parabola};
use super::smoothing::on_facets;

/// Facets of one piece, each chord cut into `parts` with `gauss` points on each part, with plain trace functions of the ends of each chord.
pub(crate) fn facets(
    mesh: &Mesh,
    piece: &Piece,
    parts: usize,
    gauss: usize,
) -> Result<BoundaryCells<2>, GeometryError> {
    check_parts(parts)?;
    let rule = gauss_legendre(on_facets(gauss, mesh.is_curved()))?;
    let mut cells = BoundaryCells::empty();
    for ends in piece.particles.windows(2) {
        let [from, to] = [ends[0], ends[1]];
        let positions = [from, to].map(|particle| mesh.positions[particle as usize]);
        on_chord(positions, &mesh.bulge(from, to), parts, &rule, &mut cells, &|t, _| vec![(from, 1.0 - t), (to, t)]);
    }
    Ok(cells)
}

/// Trace functions by the place along a chord and the normal there.
type Traces<'a> = dyn Fn(f64, &Vec2) -> Vec<(u32, f64)> + 'a;

/// Adds a chord with its parabola in equal parts, with trace functions by the place along it and the normal, as one group.
pub(super) fn on_chord(
    [from, to]: [Vec2; 2],
    bulge: &Vec2,
    parts: usize,
    (abscissae, weights): &(Vec<f64>, Vec<f64>),
    cells: &mut BoundaryCells<2>,
    traces: &Traces<'_>,
) {
    for part in 0..parts {
        for (t, w) in abscissae.iter().zip(weights) {
            let t = (part as f64 + t) / parts as f64;
            let (position, along) = parabola(&from, &to, bulge, t);
            let length = along.norm();
            let normal = Vec2::new(along[1], -along[0]) / length;
            cells.push(position, length * w / parts as f64, normal, traces(t, &normal));
        }
    }
    cells.points.close_group();
}
