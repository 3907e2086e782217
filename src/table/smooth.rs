//! Gradients averaged over sub-cells, from values on their facets.

use crate::cells::Smoothing;
use crate::each::Each;
use crate::error::{Error, GeometryError};
use crate::kinematics::{Kinematics, hoop_components};
use crate::shape::{Approximation, Scratch, ShapeFunctions};

use super::alike::{Surroundings, sources};
use super::build::{Rows, rows};
use super::facets::{Facets, List};
use super::measured::Measured;
use super::{Clusters, check_values};

/// Rows of averaged gradients; see [`ShapeTable::smoothed`](super::ShapeTable::smoothed).
pub(super) fn smoothed<const D: usize>(
    approximation: &dyn Approximation<D>,
    smoothing: &Smoothing<D>,
    kinematics: &dyn Kinematics<D>,
) -> Result<(Rows, Clusters), Error> {
    if hoop_components(kinematics)?.is_empty()
        && Surroundings::repeat(approximation, smoothing)
        && let Some(done) = shared(approximation, smoothing, kinematics)?
    {
        return Ok(done);
    }
    each(approximation, smoothing, kinematics)
}

/// Rows of which sub-cells with the same surroundings share one; none where these are not known.
fn shared<const D: usize>(
    approximation: &dyn Approximation<D>,
    smoothing: &Smoothing<D>,
    kinematics: &dyn Kinematics<D>,
) -> Result<Option<(Rows, Clusters)>, Error> {
    let measured = Measured::new(kinematics, 0, smoothing)?;
    let origin = smoothing.facet_points.first().map_or(0.0, |at| at[0]);
    let (mut rows, clusters) =
        rows(&smoothing.groups, &|(surroundings, nodes): &mut (Surroundings, Vec<u32>), cell, rows: &mut Rows| {
            measured.at(&smoothing.centres[cell])?;
            let mut volume = 0.0;
            for &(facet, sign) in &smoothing.cells[cell] {
                let mut part = 0.0;
                for point in smoothing.facet(facet as usize) {
                    let at = &smoothing.facet_points[point];
                    part += (at[0] - origin) * smoothing.facet_areas[point][0] * measured.at(at)?;
                }
                volume += sign * part;
            }
            ensure!(volume > 0.0 && volume.is_finite(), GeometryError::InvertedCell { cell, measure: volume });
            rows.weights.push(volume);
            if let Some(likeness) = surroundings.of(approximation, smoothing, cell, nodes) {
                rows.nodes.extend_from_slice(nodes);
                rows.likeness.push(likeness);
            }
            Ok(())
        })?;
    if rows.likeness.len() < rows.weights.len() {
        return Ok(None);
    }
    let sources = sources(&std::mem::take(&mut rows.likeness));
    let first = |cell: usize| sources[cell] as usize == cell;
    let own: Vec<usize> = (0..sources.len()).filter(|&cell| first(cell)).collect();
    let (written, places) = each(approximation, &smoothing.of(&own), kinematics)?;
    // A node may touch a sub-cell and none of its points.
    let nodes = |k: usize, cell: usize| written.nodes[places.entries(k)] == rows.nodes[clusters.entries(cell)];
    if !own.iter().enumerate().all(|(k, &cell)| nodes(k, cell)) {
        return Ok(None);
    }
    let mut row_of = vec![0; sources.len()];
    own.iter().enumerate().for_each(|(k, &cell)| row_of[cell] = k);
    rows.starts = sources.mapped(|&source| written.starts[row_of[source as usize]]);
    (rows.gradients, rows.rcond) = (written.gradients, written.rcond);
    Ok(Some((rows, clusters)))
}

/// Rows of which each is written by itself.
fn each<const D: usize>(
    approximation: &dyn Approximation<D>,
    smoothing: &Smoothing<D>,
    kinematics: &dyn Kinematics<D>,
) -> Result<(Rows, Clusters), Error> {
    let hoops = hoop_components(kinematics)?;
    let slots = D + usize::from(!hoops.is_empty());
    let measured = Measured::new(kinematics, hoops.len(), smoothing)?;
    let facets = Facets::<D, 1>::integrate(approximation, smoothing, &measured)?;
    let (mut rows, clusters) =
        rows(&smoothing.groups, &|(scratch, psi, list): &mut (Scratch, ShapeFunctions<D>, List<[f64; 4]>),
                                  cell,
                                  rows: &mut Rows| {
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
            ensure!(volume > 0.0 && volume.is_finite(), GeometryError::InvertedCell { cell, measure: volume });
            let inverse = 1.0 / volume;
            rows.nodes.extend_from_slice(&list.nodes);
            for slot in 0..slots {
                rows.gradients.extend(list.sums.iter().map(|sum| sum[slot] * inverse));
            }
            rows.weights.push(volume);
            Ok(())
        })?;
    rows.rcond = rows.rcond.min(facets.rcond);
    Ok((rows, clusters))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::Polynomial;
    use crate::cells::Lattice;
    use crate::geometry::Block;
    use crate::kernel::CubicSpline;
    use crate::kinematics::Solid;
    use crate::shape::ReproducingKernel;
    use approx::abs_diff_eq;

    /// Rows that are shared and rows that are not, over the lattice of a block.
    fn both(counts: [usize; 3]) -> Result<[(Rows, Clusters); 2], Error> {
        let block = Block::new([3.0, -1.0, 0.5], [5.0, 1.7, 2.9]);
        let lattice: Lattice<3> = block.lattice(counts)?;
        let functions = ReproducingKernel::new(block.particles(counts, 1.0)?, CubicSpline, Polynomial::linear())?;
        let smoothing = lattice.smoothing(2, 2, &lattice.zones(2))?;
        let shared = shared(&functions, &smoothing, &Solid)?.expect("box supports");
        Ok([shared, each(&functions, &smoothing, &Solid)?])
    }

    #[test]
    fn shared_rows_are_those_of_each_sub_cell() -> Result<(), Error> {
        for counts in [[6, 7, 9], [9, 5, 12]] {
            let [(shared, found), (own, expected)] = both(counts)?;
            assert!(6 * shared.gradients.len() < own.gradients.len() && shared.weights == own.weights);
            let mut largest: f64 = 0.0;
            for point in 0..own.starts.len() {
                let (nodes, local) = (&own.nodes[expected.entries(point)], expected.local(point));
                assert!(nodes == &shared.nodes[found.entries(point)] && local == found.local(point));
                let row = |rows: &Rows, k: usize| rows.gradients[3 * rows.starts[point] + k];
                for k in 0..3 * nodes.len() {
                    largest = largest.max((row(&shared, k) - row(&own, k)).abs());
                }
            }
            assert!(largest < 1e-12, "{largest}");
        }
        Ok(())
    }

    #[test]
    fn a_particle_that_moves_a_little_has_rows_of_its_own() -> Result<(), Error> {
        let block = Block::new([0.0; 3], [1.0; 3]);
        let lattice: Lattice<3> = block.lattice([10; 3])?;
        let even = block.particles([10; 3], 1.0)?;
        let mut positions = even.positions().to_vec();
        positions[555][1] += 1e-7;
        let moved = crate::particles::Particles::new(positions, even.supports().to_vec())?;
        let smoothing = lattice.smoothing(2, 2, &lattice.zones(2))?;
        let rows = |particles| -> Result<_, Error> {
            let functions = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
            Ok((shared(&functions, &smoothing, &Solid)?.expect("box supports"), each(&functions, &smoothing, &Solid)?))
        };
        let (((even, _), _), ((shared, _), (own, _))) = (rows(even)?, rows(moved)?);
        assert!(shared.gradients.len() > even.gradients.len());
        let row = |rows: &Rows, point: usize| rows.gradients[3 * rows.starts[point]..][..3].to_vec();
        for point in 0..own.starts.len() {
            for (a, b) in row(&shared, point).iter().zip(row(&own, point)) {
                assert!(abs_diff_eq!(*a, b, epsilon = 1e-11), "{point}");
            }
        }
        Ok(())
    }
}
