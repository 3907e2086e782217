//! Gradients averaged over sub-cells, from values on their facets.

use crate::cells::Smoothing;
use crate::error::{Error, GeometryError};
use crate::geometry::Point;
use crate::kinematics::{Kinematics, hoop_components, measure};
use crate::shape::{Approximation, ShapeFunctions};

use super::build::{Rows, rows};
use super::facets::{Facets, List};
use super::{Clusters, check_values, inverse_radius};

/// What differences of the measure rounding may leave, relative to it.
const ROUNDING: f64 = 1e-9;

/// Refuses measures that the averages are wrong for: the divergence theorem takes them for constant, or with hoops for
/// proportional to $R$ to their number.
pub(super) struct Measured<'a, const D: usize, K: ?Sized> {
    kinematics: &'a K,
    pub(super) hoops: usize,
    /// The first facet point off the axis, and the measure there.
    reference: Option<(f64, f64)>,
}

impl<'a, const D: usize, K: Kinematics<D> + ?Sized> Measured<'a, D, K> {
    pub(super) fn new(kinematics: &'a K, hoops: usize, smoothing: &Smoothing<D>) -> Result<Self, GeometryError> {
        let reference = match smoothing.facet_points.iter().find(|at| hoops == 0 || at[0] > 0.0) {
            Some(at) => Some((at[0], measure(kinematics, hoops > 0, at)?)),
            None => None,
        };
        Ok(Measured { kinematics, hoops, reference })
    }

    /// The measure at a point.
    pub(super) fn at(&self, at: &Point<D>) -> Result<f64, GeometryError> {
        let found = measure(self.kinematics, self.hoops > 0, at)?;
        let Some((radius, first)) = self.reference.filter(|_| self.hoops == 0 || at[0] > 0.0) else { return Ok(found) };
        let expected = if self.hoops == 0 { first } else { first * (at[0] / radius).powi(self.hoops as i32) };
        if (found - expected).abs() <= ROUNDING * found.abs().max(expected.abs()) {
            return Ok(found);
        }
        Err(GeometryError::Kinematics {
            what: "the measure of the kinematics is not constant or, with hoops, proportional to R to their number",
            at: at.as_slice().to_vec(),
            remedy: "averages over sub-cells are made for such measures alone: integrate at Gauss points (Rule::Gauss)",
        })
    }

    /// The measure and $1/R$ at an interior point with its weight: a little off the axis for one on it, where $m/R$ has a
    /// limit, $2\pi$ for the measure $2\pi R$.
    pub(super) fn hoop(&self, at: &Point<D>, weight: f64) -> Result<[f64; 2], GeometryError> {
        let mut off_axis = *at;
        if at[0] == 0.0 {
            off_axis[0] = 1e-8 * weight.abs().sqrt();
        }
        let measure = self.at(&off_axis)?;
        Ok([measure, inverse_radius(off_axis[0], at.as_slice(), measure)?])
    }
}

/// Rows of averaged gradients; see [`ShapeTable::smoothed`](super::ShapeTable::smoothed).
pub(super) fn smoothed<const D: usize, A: Approximation<D>>(
    approximation: &A,
    smoothing: &Smoothing<D>,
    kinematics: &(impl Kinematics<D> + ?Sized),
) -> Result<(Rows, Clusters), Error> {
    let hoops = hoop_components(kinematics)?;
    let slots = D + usize::from(!hoops.is_empty());
    let measured = Measured::new(kinematics, hoops.len(), smoothing)?;
    let facets = Facets::<D, 1>::integrate(approximation, smoothing, &measured)?;
    type Scratch<S, const D: usize> = (S, ShapeFunctions<D>, List<[f64; 4]>);
    let (mut rows, clusters) = rows(
        &smoothing.groups,
        <Scratch<A::Scratch, D>>::default,
        |(scratch, psi, list), cell, rows: &mut Rows| -> Result<(), Error> {
            list.clear();
            // A measure that is the same on all facets may bulge between them.
            measured.at(&smoothing.centres[cell])?;
            // The measure of the cell from the divergence theorem along axis 0, so that V and the
            // gradients come from the same numbers.
            let mut volume = 0.0;
            for &(facet, sign) in &smoothing.cells[cell] {
                let (nodes, sums, part) = facets.get(facet as usize);
                volume += sign * part;
                list.add([0.0; 4], nodes, |a, sum| {
                    for j in 0..D {
                        sum[j] += sign * sums[a][0][j];
                    }
                });
            }
            if !hoops.is_empty() {
                for (at, weight) in &smoothing.interior[cell] {
                    let [measure, inverse] = measured.hoop(at, *weight)?;
                    approximation.evaluate_values(at, scratch, psi)?;
                    check_values(psi, approximation.nodes().len(), at)?;
                    list.add([0.0; 4], &psi.nodes, |a, sum| {
                        // m,R = (number of hoops) m / R for the measures 2πR and 4πR².
                        let hoop = psi.values[a] * weight * measure * inverse;
                        sum[0] -= hoops.len() as f64 * hoop;
                        sum[D] += hoop;
                    });
                }
            }
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(GeometryError::InvertedCell { cell, measure: volume }.into());
            }
            let inverse = 1.0 / volume;
            rows.nodes.extend_from_slice(&list.nodes);
            for slot in 0..slots {
                rows.gradients.extend(list.sums.iter().map(|sum| sum[slot] * inverse));
            }
            rows.weights.push(volume);
            Ok(())
        },
    )?;
    rows.rcond = rows.rcond.min(facets.rcond);
    Ok((rows, clusters))
}
