//! The particles of each body and the cells between them.

use std::sync::Arc;

use crate::cells::{Cells, Lattice, Layout, Unstructured};
use crate::compiled::compiled;
use crate::each::Each;
use crate::error::{Error, GeometryError};

use crate::scene::{ApproximationChoice, BodyCells, BodyOf, PressureScheme, Rule, Scene, Scheme, Source, counts};

use super::checked::check_cells;
use super::{overlap, unused};

impl<const D: usize> Scene<D> {
    /// The particles of each body under its scheme and the cells between them.
    pub(crate) fn cells(&self, scheme: &Scheme) -> Result<BodyCells<D>, Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<BodyCells<D>, Error> {
            scene.validate()?;
            all_cells(scene, scheme)
        })
    }
}

/// The particles of each body under its own scheme and the cells between them.
pub(crate) fn all_cells<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<BodyCells<D>, Error> {
    let schemes: Vec<Scheme> = scene.bodies.mapped(|body| scene.scheme_under(&body.name, scheme));
    unused::refuse(scene, scheme, &schemes)?;
    let mut all = Vec::new();
    for (body, scheme) in scene.bodies.iter().zip(schemes) {
        all.push(cells_of(scene, body, scheme)?);
    }
    overlap::refuse(scene, &all)?;
    Ok(all)
}

/// The particles of a body and the cells between them.
fn cells_of<const D: usize>(
    scene: &Scene<D>,
    body: &BodyOf<D>,
    scheme: Scheme,
) -> Result<(Scheme, Arc<dyn Cells<D>>), Error> {
    check(&scheme)?;
    let cells: Arc<dyn Cells<D>> = match &body.source {
        Source::Domain(domain) => {
            let counts = counts(&**domain, &scheme)?;
            super::space::refuse(scene, &scheme, &**domain, &counts)?;
            Arc::new(Lattice::new(&**domain, counts, &layout(&scheme, counts))?)
        }
        Source::Cells(cells) => {
            check_cells(&**cells)?;
            cells.clone()
        }
        Source::Scattered(scatter) => scatter(&scheme)?,
        Source::Mesh(mesh) => {
            let rigid = scene.rigid_volumes(&body.name, mesh, None);
            match rigid.is_empty() {
                true => Arc::new(Unstructured::new(mesh)?),
                false => Arc::new(Unstructured::new(&mesh.without(&rigid.mapped(|name| &**name))?)?),
            }
        }
    };
    if let PressureScheme::Field { size, .. } = scheme.pressure {
        let most = cells.lattice().and_then(|lattice| lattice.cell_counts().into_iter().max());
        ensure!(
            size <= most.unwrap_or(cells.cell_count()),
            GeometryError::Count {
                what: ZONE,
                count: size,
                needed: "at most as many as the body has along its longest axis: that is one zone"
            }
        );
    }
    Ok((scheme, cells))
}

const ZONE: &str = "cells per direction of a pressure zone";

/// Sub-cells or Gauss points per direction of a cell beyond which a rule is refused: errors have long been rounding there,
/// and a mistyped number is an error instead of an hour.
const MOST_PARTS: usize = 64;

/// Refuses numbers of a scheme that no body could be discretised with.
fn check(scheme: &Scheme) -> Result<(), Error> {
    let count = |what, count, needed| Err(GeometryError::Count { what, count, needed }.into());
    if let PressureScheme::Field { size: 0, .. } = scheme.pressure {
        return count(ZONE, 0, "at least 1 is needed");
    }
    if scheme.order == 0 {
        let needed = "at least 1: functions that do not reproduce linear fields converge to nothing";
        return count("order of the basis", 0, needed);
    }
    match scheme.rule {
        Rule::Smoothed { parts } if parts > MOST_PARTS => {
            count("sub-cells per direction", parts, "at most 64 are accepted; the default takes 2")
        }
        _ => Ok(()),
    }
}

/// The layout of a scheme; nodes in the middle of elements of order 2 stand halfway between those at their ends.
fn layout<const D: usize>(scheme: &Scheme, counts: [usize; D]) -> Layout {
    match &scheme.layout {
        Layout::Graded(grade) if scheme.approximation == ApproximationChoice::Elements && scheme.order == 2 => {
            let grade = grade.clone();
            Layout::Graded(Arc::new(move |axis, t| {
                let cells = (counts[axis].max(2) - 1) as f64;
                let node = (t * cells).round();
                let end = |node: f64| grade(axis, node / cells);
                if node % 2.0 == 1.0 { 0.5 * (end(node - 1.0) + end(node + 1.0)) } else { end(node) }
            }))
        }
        other => other.clone(),
    }
}
