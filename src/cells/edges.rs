//! Boundary facets of scattered particles and the trace functions of weak constraint equations on them.

use crate::each::{Each, list_of};
use crate::error::GeometryError;
use crate::geometry::{Mat3, Vec2, Vec3};
use crate::quadrature::{check_parts, gauss_legendre};

use super::BoundaryCells;
use super::mesh::{Mesh, Piece, parabola};
use super::smoothing::on_facets;

/// Facets of one piece, each chord cut into `parts` with `gauss` points on each part.
///
/// Rows reproduce the tractions of homogeneous stress exactly where the trace functions can combine to the normal of each
/// chord. On a line trace functions that sum to one do. On an arc the normals jump from chord to chord: there the weights of the
/// particles around a chord are the trace functions with the smallest change for which $\sum_J f_J = 1$ and
/// $\sum_J f_J\\,n_J = n$, with $n_J$ the mean normal at particle $J$. The ends of an open arc carry none: they belong
/// to the pieces beside it.
pub(crate) fn facets(
    mesh: &Mesh,
    piece: &Piece,
    parts: usize,
    gauss: usize,
) -> Result<BoundaryCells<2>, GeometryError> {
    with_traces(mesh, piece, parts, gauss, piece.curved)
}

/// The same with plain trace functions of the ends of each chord, on arcs as well.
pub(crate) fn plain_facets(
    mesh: &Mesh,
    piece: &Piece,
    parts: usize,
    gauss: usize,
) -> Result<BoundaryCells<2>, GeometryError> {
    with_traces(mesh, piece, parts, gauss, false)
}

fn with_traces(
    mesh: &Mesh,
    piece: &Piece,
    parts: usize,
    gauss: usize,
    curved: bool,
) -> Result<BoundaryCells<2>, GeometryError> {
    check_parts(parts)?;
    let rule = gauss_legendre(on_facets(gauss, mesh.is_curved()))?;
    let mut cells = BoundaryCells::empty();
    let at = |k: usize| mesh.positions[piece.particles[k] as usize];
    let normals = Normals::of(mesh, piece);
    for chord in 0..piece.particles.len() - 1 {
        let (from, to) = (at(chord), at(chord + 1));
        let bulge = mesh.bulge(piece.particles[chord], piece.particles[chord + 1]);
        let window = if curved { normals.window(chord) } else { Vec::new() };
        on_chord([from, to], &bulge, parts, &rule, &mut cells, &|t, normal| {
            if window.len() >= 3 {
                normals.traces(piece, &window, chord, t, normal)
            } else {
                vec![(piece.particles[chord], 1.0 - t), (piece.particles[chord + 1], t)]
            }
        });
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

/// Mean normals of the particles along a curved piece.
struct Normals {
    normals: Vec<Vec2>,
    closed: bool,
}

impl Normals {
    fn of(mesh: &Mesh, piece: &Piece) -> Self {
        let chords: Vec<Vec2> = piece
            .particles
            .windows(2)
            .map(|w| {
                let along = mesh.positions[w[1] as usize] - mesh.positions[w[0] as usize];
                Vec2::new(along[1], -along[0])
            })
            .collect();
        let n = chords.len();
        let closed = piece.particles.first() == piece.particles.last();
        let mean = |k: usize| {
            let before = if k > 0 {
                chords[k - 1]
            } else if closed {
                chords[n - 1]
            } else {
                chords[0]
            };
            let after = if k < n {
                chords[k]
            } else if closed {
                chords[0]
            } else {
                chords[n - 1]
            };
            (before + after).normalize()
        };
        Normals { normals: list_of(n + 1, mean), closed }
    }

    /// Up to four particles around a chord that may carry weights.
    fn window(&self, chord: usize) -> Vec<usize> {
        let n = self.normals.len() - 1;
        if self.closed {
            // The last particle is the first again.
            let count = 4.min(n);
            return list_of(count, |k| (chord + n + k - 1) % n);
        }
        let (low, high) = (1, n - 1);
        if high < low {
            return Vec::new();
        }
        let count = 4.min(high - low + 1);
        let first = (chord.max(1) - 1).clamp(low, high + 1 - count);
        (first..first + count).collect()
    }

    /// Trace functions moved as little as possible to sum to one and to the normal.
    fn traces(&self, piece: &Piece, window: &[usize], chord: usize, t: f64, normal: &Vec2) -> Vec<(u32, f64)> {
        let n = self.normals.len() - 1;
        let place = |k: usize| if self.closed { k % n } else { k };
        let mut weights: Vec<f64> = window.mapped(|&k| {
            f64::from(u8::from(k == place(chord))) * (1.0 - t) + f64::from(u8::from(k == place(chord + 1))) * t
        });
        let row = |k: usize| Vec3::new(1.0, self.normals[k][0], self.normals[k][1]);
        let mut missing = Vec3::new(1.0, normal[0], normal[1]);
        let mut gram = Mat3::zeros();
        for (&k, w) in window.iter().zip(&weights) {
            missing -= row(k) * *w;
            gram += row(k) * row(k).transpose();
        }
        // Normals that hardly differ make the Gram matrix singular: what is in its range is solved, the rest is zero.
        let eigen = gram.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let mut solution = Vec3::zeros();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > 1e-14 * largest {
                solution += vector * (vector.dot(&missing) / value);
            }
        }
        for (&k, w) in window.iter().zip(&mut weights) {
            *w += row(k).dot(&solution);
        }
        window.iter().map(|&k| piece.particles[k]).zip(weights).collect()
    }
}
