//! Conditions of a scene as rows.

use std::sync::Arc;

use crate::boundary::{Constraints, Motion};
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
        let before = rows.clone();
        if let Err(error) = add(&mut rows, scene, condition, cells, approximation, facets) {
            refused(error)?;
            // Without the rows that were added before it was refused.
            rows = before;
        }
    }
    Ok(rows)
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
    let nodes = match (&condition.place, facets) {
        (Place::Part(part), Some(facets)) => {
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

/// The particle that lies at a point, to a thousandth of its spacing.
fn particle_at<const D: usize>(cells: &dyn Cells<D>, at: &Point<D>, label: &str) -> Result<usize, Error> {
    let distance = |node: usize| (cells.positions()[node] - at).norm();
    let nearest = (0..cells.positions().len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    if distance(nearest) <= 1e-3 * cells.local_spacing(nearest) {
        Ok(nearest)
    } else {
        let nearest = cells.positions()[nearest].as_slice().to_vec();
        Err(BoundaryError::Empty { what: label.to_string(), nearest }.into())
    }
}
