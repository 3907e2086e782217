//! Gradients averaged over sub-cells, from values on their facets.

use crate::cells::Smoothing;
use crate::error::{Error, GeometryError};
use crate::kinematics::{Kinematics, hoop_components};
use crate::shape::{Approximation, ShapeFunctions};

use super::build::{Rows, rows};
use super::facets::{Facets, List};
use super::measured::Measured;
use super::{Clusters, check_values};

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
