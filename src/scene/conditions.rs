//! Conditions of a scene as rows.

use std::sync::Arc;

use crate::boundary::{Constraints, Motion, check_agreement, rounding};
use crate::cells::Cells;
use crate::error::{BoundaryError, Error};
use crate::geometry::Point;
use crate::shape::Approximation;
use crate::term::Amplitude;

use super::discretize::{FacetRule, Refused};
use super::{Condition, Place, Scene, Value};

/// Rows over boundaries with the given facet rule, or at particles without one.
pub(super) fn rows<const D: usize, A: Approximation<D>>(
    scene: &Scene<D>,
    cells: &dyn Cells<D>,
    approximation: &A,
    facets: Option<FacetRule>,
    refused: Refused<'_>,
) -> Result<Constraints, Error> {
    let mut rows = Constraints::new();
    for condition in &scene.conditions {
        let before = rows.mark();
        // Rows over a face know nothing of single particles: what they say twice is looked up in the scene.
        let added = match facets.map_or(Ok(false), |_| lies_on_part(scene, condition, cells)) {
            Ok(true) => Ok(()),
            Ok(false) => add(&mut rows, scene, condition, cells, approximation, facets),
            Err(error) => Err(error),
        };
        if let Err(error) = added {
            refused(error)?;
            // Without the rows that were added before it was refused.
            rows.take_back(before);
        }
    }
    Ok(rows)
}

/// Whether a condition at a particle says again what one on a part that holds the particle says: taken as well, the
/// particle would be prescribed twice.
///
/// # Errors
/// Where it says something else.
fn lies_on_part<const D: usize>(
    scene: &Scene<D>,
    condition: &Condition<D>,
    cells: &dyn Cells<D>,
) -> Result<bool, Error> {
    let Place::Particle(at) = &condition.place else { return Ok(false) };
    let particle = particle_at(cells, at, &condition.label)?;
    let at = &cells.positions()[particle];
    for other in scene.conditions.iter().filter(|other| other.component == condition.component) {
        let Place::Part(part) = &other.place else { continue };
        // Parts that don't exist are refused with their own condition.
        if !cells.boundary_nodes(part).is_ok_and(|nodes| nodes.contains(&particle)) {
            continue;
        }
        let ((first, a), (second, b)) = (value_at(other, at), value_at(condition, at));
        let (first, second) = ((other.label.as_str(), first, &a), (condition.label.as_str(), second, &b));
        check_agreement(first, second, condition.component, at, rounding(cells.positions()))?;
        return Ok(true);
    }
    Ok(false)
}

/// What a condition prescribes at a point: a value and its amplitude.
fn value_at<const D: usize>(condition: &Condition<D>, at: &Point<D>) -> (f64, Amplitude) {
    match &condition.value {
        Value::Field(field) => (field(at), condition.amplitude.clone()),
        Value::Motion(motion) => {
            let (motion, at) = (along(motion, &condition.amplitude), *at);
            (1.0, Amplitude::Function(Arc::new(move |load| motion(&at, load))))
        }
    }
}

/// Refuses values that take a point of a body of revolution to its axis or beyond, where its hoops would be inverted.
fn stays_off_axis<const D: usize>(
    scene: &Scene<D>,
    condition: &Condition<D>,
    cells: &dyn Cells<D>,
    nodes: &[usize],
) -> Result<(), BoundaryError> {
    if condition.component != 0 || scene.kinematics.hoops().is_empty() {
        return Ok(());
    }
    for &node in nodes {
        let at = &cells.positions()[node];
        let (target, amplitude) = value_at(condition, at);
        for load in [1.0, 0.75, 0.5, 0.25].into_iter().chain(condition.amplitude.knots()) {
            let radius = at[0] + target * amplitude.evaluate(load).0;
            // Points on the axis stay there: moved off it, they would be circles that were points.
            if radius < 0.0 || (radius == 0.0) != (at[0] == 0.0) {
                return Err(BoundaryError::BeyondAxis {
                    what: condition.label.clone(),
                    at: at.as_slice().to_vec(),
                    radius,
                    load,
                });
            }
        }
    }
    Ok(())
}

/// Adds the rows of one condition.
fn add<const D: usize, A: Approximation<D>>(
    rows: &mut Constraints,
    scene: &Scene<D>,
    condition: &Condition<D>,
    cells: &dyn Cells<D>,
    approximation: &A,
    facets: Option<FacetRule>,
) -> Result<(), Error> {
    let (component, amplitude, label) = (condition.component, &condition.amplitude, condition.label.as_str());
    if let Value::Motion(_) = &condition.value {
        rows.add_knots(amplitude.knots());
    }
    let nodes = match (&condition.place, facets) {
        (Place::Part(part), Some(facets)) => {
            stays_off_axis(scene, condition, cells, &cells.boundary_nodes(part)?)?;
            // One by one, so that each piece claims its corners in turn.
            for cells in cells.boundary_pieces(part, facets.parts, facets.gauss)? {
                let kinematics = &*scene.kinematics;
                match &condition.value {
                    Value::Field(field) => {
                        rows.over_boundary(approximation, &cells, kinematics, component, &**field, amplitude, label)?;
                    }
                    Value::Motion(motion) => {
                        let motion = along(motion, amplitude);
                        rows.motion_over_boundary(approximation, &cells, kinematics, component, &motion, label)?;
                    }
                }
            }
            return Ok(());
        }
        (Place::Part(part), None) => cells.boundary_nodes(part)?,
        (Place::Particle(at), _) => vec![particle_at(cells, at, label)?],
        (Place::Body, _) => return Ok(()),
    };
    stays_off_axis(scene, condition, cells, &nodes)?;
    match &condition.value {
        Value::Field(field) => rows.at_particles(approximation, &nodes, component, &**field, amplitude, label)?,
        Value::Motion(motion) => {
            rows.motion_at_particles(approximation, &nodes, component, &along(motion, amplitude), label)?;
        }
    }
    Ok(())
}

/// A motion whose load factor follows an amplitude.
fn along<const D: usize>(motion: &Motion<D>, amplitude: &Amplitude) -> Motion<D> {
    let (motion, amplitude) = (motion.clone(), amplitude.clone());
    Arc::new(move |x, load| motion(x, amplitude.evaluate(load).0))
}

/// The particle that lies at a point, to a thousandth of its spacing along each axis.
fn particle_at<const D: usize>(cells: &dyn Cells<D>, at: &Point<D>, label: &str) -> Result<usize, Error> {
    let distance = |node: usize| (cells.positions()[node] - at).norm();
    let nearest = (0..cells.positions().len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let (offset, spacings) = (cells.positions()[nearest] - at, cells.spacings(nearest));
    if (0..D).all(|i| offset[i].abs() <= 1e-3 * spacings[i]) {
        Ok(nearest)
    } else {
        let nearest = cells.positions()[nearest].as_slice().to_vec();
        Err(BoundaryError::Empty { what: label.to_string(), nearest }.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prelude::*;

    /// Rows at particles and over boundaries, some owned twice, taken back one condition after the other.
    #[test]
    fn what_was_added_is_taken_back() {
        let block = Block::new([0.0, 0.0], [2.0, 1.0]);
        let scene = Scene::new(block, PlaneStrain, Rubber::neo_hookean(0.5, 10.0).unwrap())
            .prescribe_at([0.0, 0.0], 0, 0.0)
            .hold((0, Side::Min))
            .prescribe_motion((0, Side::Max), 0, |x, load| 0.1 * x[1] * load)
            .with_amplitude(Amplitude::table(vec![(0.0, 0.0), (0.5, 2.0), (1.0, 1.0)]).unwrap())
            .prescribe_at([2.0, 0.0], 1, 0.1)
            .prescribe((1, Side::Max), 0, 0.0);
        let cells = block.lattice([5, 4]).unwrap();
        let functions =
            ReproducingKernel::new(cells.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
        for facets in [None, Some(FacetRule { parts: 2, gauss: 2 })] {
            let mut rows = Constraints::new();
            for condition in &scene.conditions {
                let (before, mark) = (rows.clone(), rows.mark());
                let refused = add(&mut rows, &scene, condition, &cells, &functions, facets).is_err();
                let added = rows.clone();
                assert!(refused || added != before);
                rows.take_back(mark);
                assert_eq!(rows, before);
                if !refused {
                    add(&mut rows, &scene, condition, &cells, &functions, facets).unwrap();
                }
            }
        }
    }
}
