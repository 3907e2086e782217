//! The integration rule of a scheme: the table of a body, its pressures, and the facets that agree with it.

use crate::cells::{Cells, Lattice, Layout};
use crate::each::EachOf;
use crate::error::{Error, GeometryError, Incompatible};
use crate::shape::Approximation;
use crate::table::ShapeTable;
use crate::term::PressureField;

use super::facet_rule::FacetRule;
use super::one_body::BodyInput;
use crate::scene::{PressureScheme, Rule, Source, per_axis};

/// Gauss points per cell in 1D where the basis is quadratic or higher.
const FINE: usize = 7;

/// The table of the body, the facet rule that agrees with it, the pressure field on its clusters, and how many cells wide those are where
/// they are zones of cells.
pub(crate) fn body_table<const D: usize>(
    definition: &BodyInput<'_, D>,
    approximation: &dyn Approximation<D>,
) -> Result<(ShapeTable<D>, FacetRule, PressureField, Option<usize>), Error> {
    let sharing = definition.sharing;
    let (scene, scheme, cells) = (definition.scene, definition.scheme, &*definition.cells);
    // The quadratic basis asks for one sub-cell or point more per direction.
    let more = usize::from(scheme.order > 1);
    let (field, size) = match scheme.pressure {
        // One point for each particle: a pressure there is one constraint for two unknowns already.
        PressureScheme::Auto if matches!(scheme.rule, Rule::Scni | Rule::Nodal) => (PressureField::Pointwise, 1),
        PressureScheme::Auto if !cells.is_thin() => (PressureField::Linear, 2),
        PressureScheme::Auto => (PressureField::Constant, 1),
        PressureScheme::Field { field, size } => (field, size),
    };
    let kinematics = &*scene.kinematics;
    match &scheme.rule {
        Rule::Auto if D == 1 => {
            // Gauss points over whole zones, which end at particles; over single cells and more of them for functions whose
            // third and fourth order the error of the rule would hide.
            let points = match cells.lattice() {
                Some(lattice) if scheme.order < 2 => sharing.points(lattice.coarsened(size).gauss(5)?),
                _ => cells
                    .gauss_in(if scheme.order < 2 { 5 } else { FINE }, &sharing.zones(cells, cells.zones(size))?)?,
            };
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: 1 }, field, None))
        }
        // Gradients that are linear in a cell do not integrate a cubic basis to its order.
        Rule::Auto if scheme.order > 2 && D == 3 && cells.lattice().is_none() => {
            let remedy = "take order 1 or 2, or a block in 3D";
            Err(Incompatible::new("a basis of order 3", "cells of a mesh or of a cut solid in 3D", remedy).into())
        }
        // Averages would leave a basis that can do more at their second order.
        Rule::Auto if scheme.order > 1 => {
            let gauss = 2 + more;
            let smoothing = sharing.smoothing(cells, [1, gauss], cells.zones(size))?;
            let table = ShapeTable::consistent(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss }, field, Some(size)))
        }
        Rule::Auto | Rule::Smoothed { .. } => {
            let parts = if let Rule::Smoothed { parts } = scheme.rule { parts } else { 2 + more };
            let gauss = 2 + more;
            let smoothing = sharing.smoothing(cells, [parts, gauss], cells.zones(size))?;
            let table = ShapeTable::smoothed(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts, gauss }, field, Some(size)))
        }
        Rule::Scni => {
            let gauss = 2 + more;
            let table = ShapeTable::smoothed(approximation, &cells.nodal_cells(gauss)?, kinematics)?;
            Ok((table, FacetRule { parts: 2, gauss }, field, None))
        }
        Rule::Nodal => {
            let gauss = 2 + more;
            let points = cells.nodal_cells(gauss)?.nodal(cells.positions());
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 2, gauss }, field, None))
        }
        Rule::Gauss { zones, points } => {
            let (gauss, points) = match (zones, &definition.body.source) {
                (None, _) => {
                    // Two particles per direction and cell, and two more.
                    let points = points.unwrap_or(4);
                    (cells.gauss_in(points, &sharing.zones(cells, cells.zones(size))?)?, points)
                }
                // Equal zones of the domain, whatever the particles.
                (Some(zones), Source::Domain(domain)) => {
                    let counts: [usize; D] = per_axis(zones, "integration zones")?;
                    ensure!(
                        !counts.contains(&0),
                        GeometryError::Count { what: "integration zones", count: 0, needed: "at least 1 is needed" }
                    );
                    let along = lattice_of(cells, "integration zones")?.cell_counts();
                    let default = (0..D).map(|i| along[i].div_ceil(counts[i]) + 3).max().unwrap_or(5);
                    let points = points.unwrap_or(default);
                    let lattice = Lattice::new(&**domain, counts.each(|z| z.saturating_add(1)), &Layout::Regular)?;
                    (sharing.points(lattice.gauss(points)?), points)
                }
                (Some(_), _) => return Err(no_lattice("equal integration zones").into()),
            };
            let table = ShapeTable::new(approximation, &gauss, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: points }, field, None))
        }
    }
}

/// The lattice of the cells, for what needs one.
pub(crate) fn lattice_of<'a, const D: usize>(
    cells: &'a dyn Cells<D>,
    what: &'static str,
) -> Result<&'a Lattice<D>, Incompatible> {
    cells.lattice().ok_or_else(|| no_lattice(what))
}

fn no_lattice(what: &'static str) -> Incompatible {
    Incompatible::new(what, "cells that do not form a lattice", "make the scene of a block or mapped block")
}
