//! Gradients that are linear in sub-cells, from the moments of values on their facets and inside.

use nalgebra::{Cholesky, SMatrix, SVector};

use crate::cells::Smoothing;
use crate::each::{Each, array_of, sum_of};
use crate::error::{Error, GeometryError};
use crate::geometry::Point;
use crate::kinematics::{Kinematics, hoop_components};
use crate::shape::{Approximation, Scratch, ShapeFunctions};

use super::build::{Rows, rows};
use super::facets::{Facets, List, monomials, shifted, slopes};
use super::measured::Measured;
use super::{Clusters, check_values};

/// The part of a moment that is left when what the others know of it is taken off, at which interior points count as
/// flat: rounding leaves 1e-16, a slanting cell a million times longer than wide 1e-12.
const FLAT: f64 = 1e-13;

/// What tabulating a sub-cell leaves for its points.
struct SubCell<const D: usize, const Q: usize> {
    values: Scratch,
    psi: ShapeFunctions<D>,
    /// The sub-cell that the rest belongs to.
    cell: Option<usize>,
    /// Moments $\int\Psi_{,j}\\,q_k\\,m\\,\mathrm dV$ by slot.
    list: List<[[f64; Q]; 4]>,
    /// Coefficients of the functions by slot at a point, from moments: $M^{-1}$.
    inverse: SMatrix<f64, Q, Q>,
}

impl<const D: usize, const Q: usize> Default for SubCell<D, Q> {
    fn default() -> Self {
        SubCell {
            values: Scratch::default(),
            psi: ShapeFunctions::default(),
            cell: None,
            list: List::default(),
            inverse: SMatrix::zeros(),
        }
    }
}

/// The [`monomials`] of $X - X_c$.
fn linear<const D: usize, const Q: usize>(at: &Point<D>, centre: &Point<D>) -> SVector<f64, Q> {
    monomials::<D, Q>(&(at - centre)).into()
}

/// Rows of the interior points, and their positions; see [`ShapeTable::consistent`](super::ShapeTable::consistent).
pub(super) fn consistent<const D: usize, const Q: usize>(
    approximation: &dyn Approximation<D>,
    smoothing: &Smoothing<D>,
    kinematics: &dyn Kinematics<D>,
) -> Result<(Rows, Clusters, Vec<Point<D>>), Error> {
    let hoops = hoop_components(kinematics)?;
    let slots = D + usize::from(!hoops.is_empty());
    let measured = Measured::new(kinematics, hoops.len(), smoothing)?;
    let facets = Facets::<D, Q>::integrate(approximation, smoothing, &measured)?;
    let (mut starts, mut positions) = (vec![0], Vec::new());
    for (points, centre) in smoothing.interior.iter().zip(&smoothing.centres) {
        ensure!(points.len() > D, too_few(centre));
        positions.extend(points.iter().map(|own| own.0));
        starts.push(positions.len());
    }
    let groups: Vec<usize> = smoothing.groups.mapped(|&cell| starts[cell]);
    let (mut rows, clusters) =
        rows(&groups, &|SubCell { values, psi, cell: known, list, inverse }: &mut SubCell<D, Q>,
                        point,
                        rows: &mut Rows| {
            let cell = starts.partition_point(|&start| start <= point) - 1;
            let centre = &smoothing.centres[cell];
            if *known != Some(cell) {
                *known = Some(cell);
                list.clear();
                measured.at(centre)?;
                let mut volume = 0.0;
                for &(facet, sign) in &smoothing.cells[cell] {
                    let (nodes, sums, part) = facets.get(facet as usize);
                    volume += sign * part;
                    let from = smoothing.facet_points[smoothing.facet(facet as usize).start] - centre;
                    list.add([[0.0; Q]; 4], nodes, |a, sum| {
                        for j in 0..D {
                            let moments: [f64; Q] = shifted(&array_of(|k| sums[a][k][j]), &from);
                            for k in 0..Q {
                                sum[j][k] += sign * moments[k];
                            }
                        }
                    });
                }
                // With fewer points than monomials gradients are linear there, whatever they are in other sub-cells.
                let terms = if smoothing.interior[cell].len() < Q { D + 1 } else { Q };
                let mut moments = SMatrix::<f64, Q, Q>::zeros();
                for (at, weight) in &smoothing.interior[cell] {
                    let q = linear::<D, Q>(at, centre);
                    let measure = measured.at(at)?;
                    moments += q * q.transpose() * (weight * measure);
                    approximation.evaluate_values(at, values, psi)?;
                    check_values(psi, approximation.nodes().len(), at)?;
                    rows.rcond = rows.rcond.min(psi.rcond);
                    let [off_axis, inverse] = if hoops.is_empty() { [0.0; 2] } else { measured.hoop(at, *weight)? };
                    let over_radius = off_axis * inverse;
                    let falls: [[f64; Q]; D] = array_of(|j| slopes(&(at - centre), j));
                    list.add([[0.0; Q]; 4], &psi.nodes, |a, sum| {
                        let value = weight * psi.values[a] * measure;
                        for j in 0..D {
                            for k in 1..Q {
                                sum[j][k] -= value * falls[j][k];
                            }
                        }
                        if !hoops.is_empty() {
                            // m,R = (number of hoops) m / R for the measures 2πR and 4πR².
                            let value = weight * psi.values[a];
                            for k in 0..Q {
                                let hoop = value * over_radius * q[k];
                                sum[0][k] -= hoops.len() as f64 * hoop;
                                sum[D][k] += hoop;
                            }
                        }
                    });
                }
                encloses(cell, volume, moments[(0, 0)])?;
                *inverse = inverted(moments, terms).ok_or_else(|| too_few(centre))?;
            }
            let (at, weight) = &smoothing.interior[cell][point - starts[cell]];
            let share = *inverse * linear::<D, Q>(at, centre);
            rows.nodes.extend_from_slice(&list.nodes);
            for slot in 0..slots {
                rows.gradients.extend(list.sums.iter().map(|sum| sum_of(Q, |k| sum[slot][k] * share[k])));
            }
            rows.weights.push(weight * measured.at(at)?);
            Ok(())
        })?;
    rows.rcond = rows.rcond.min(facets.rcond);
    Ok((rows, clusters, positions))
}

/// $M^{-1}$ of the first monomials, zero for the others; none where it is singular.
fn inverted<const Q: usize>(mut moments: SMatrix<f64, Q, Q>, terms: usize) -> Option<SMatrix<f64, Q, Q>> {
    let among = |i: usize, j: usize| i < terms && j < terms;
    moments = SMatrix::from_fn(|i, j| if among(i, j) { moments[(i, j)] } else { f64::from(u8::from(i == j)) });
    let scale = moments.diagonal().map(|own| 1.0 / own.sqrt());
    let scale = SMatrix::<f64, Q, Q>::from_diagonal(&scale);
    let factor = Cholesky::new(scale * moments * scale)?;
    let left = factor.l_dirty().diagonal().min().powi(2);
    let inverse = (left > FLAT).then(|| scale * factor.inverse() * scale)?;
    Some(SMatrix::from_fn(|i, j| if among(i, j) { inverse[(i, j)] } else { 0.0 }))
}

/// What the facets of a sub-cell enclose is what its points fill, but for the errors of both rules.
fn encloses(cell: usize, volume: f64, inside: f64) -> Result<(), GeometryError> {
    let alike = inside > 0.0 && inside.is_finite() && (volume - inside).abs() < 0.5 * inside;
    let measure = if inside > 0.0 { volume } else { inside };
    if alike { Ok(()) } else { Err(GeometryError::InvertedCell { cell, measure }) }
}

fn too_few<const D: usize>(centre: &Point<D>) -> Error {
    GeometryError::Shape {
        what: "the interior points of a sub-cell do not tell linear fields apart",
        at: centre.as_slice().to_vec(),
        remedy: "give at least one more than there are axes, not all on one line or plane",
    }
    .into()
}
