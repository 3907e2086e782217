//! Elements of which many are alike: their rows are written once.

use crate::error::Error;
use crate::kinematics::Kinematics;
use crate::shape::{ElementPoints, FiniteElements, ShapeFunctions};

use super::alike::{Surroundings, sources};
use super::{Clusters, build};

/// Rows at points of elements, of which those that are alike to rounding share one; without hoops.
pub(super) fn shared<const D: usize>(
    elements: &FiniteElements<D>,
    points: &ElementPoints<D>,
    kinematics: &dyn Kinematics<D>,
) -> Result<(build::Rows, Clusters), Error> {
    let fill =
        |point: usize, psi: &mut ShapeFunctions<D>| elements.write(points.elements[point], &points.local[point], psi);
    let (mut rows, clusters) =
        build::rows(&points.points.groups, &|(surroundings, psi): &mut (Surroundings, ShapeFunctions<D>),
                                             point,
                                             rows| {
            fill(point, psi);
            let measure = crate::kinematics::measure(kinematics, false, &points.points.positions[point])?;
            rows.nodes.extend_from_slice(&psi.nodes);
            rows.weights.push(points.points.weights[point] * measure);
            rows.likeness.push(surroundings.of_functions(psi, points.points.weights[point]));
            Ok(())
        })?;
    let sources = sources(&std::mem::take(&mut rows.likeness));
    let mut psi = ShapeFunctions::default();
    rows.starts.clear();
    for (point, &source) in sources.iter().enumerate() {
        if source as usize != point {
            rows.starts.push(rows.starts[source as usize]);
            continue;
        }
        fill(point, &mut psi);
        rows.starts.push(rows.values.len());
        rows.values.extend_from_slice(&psi.values);
        for slot in 0..D {
            rows.gradients.extend(psi.gradients.iter().map(|g| g[slot]));
        }
    }
    Ok((rows, clusters))
}
