//! A body by reproducing kernel particles.

use crate::cells::Zones;
use crate::each::Each;
use crate::error::Error;
use crate::table::ShapeTable;
use crate::term::Body;

use super::approximation::covering;
use super::conditions::{Prescribed, Refused};
use super::facet_rule::Facets;
use super::one_body::{BodyInput, BuiltBody, FINER, Tables, load_tables};
use super::rule::body_table;
use super::thin_walls;
use crate::scene::ConstraintKind;

/// Reproducing kernel particles.
pub(crate) fn particles<const D: usize>(
    definition: &BodyInput<'_, D>,
    refused: Refused<'_>,
) -> Result<BuiltBody<D>, Error> {
    let BodyInput { scene, scheme, cells, .. } = definition;
    let (approximation, raised) = covering(scheme, &**cells)?;
    let dilations = approximation.particles().supports().mapped(|s| s.half_widths().max());
    let kinematics = &*scene.kinematics;
    let sharing = definition.sharing;
    let body = body_table(definition, &approximation).and_then(|(table, facets, field, zone)| {
        let body = definition.body_of(table, |table, law| Body::projecting(table, law, field, scheme.measure))?;
        Ok((body, facets, zone))
    });
    let (mut body, facets, zone) = sharing.agreed(body)?;
    let over_boundary = match scheme.constraint_kind {
        ConstraintKind::Auto => D > 1,
        ConstraintKind::AtParticles => false,
        ConstraintKind::OverBoundary => true,
    };
    let rule = over_boundary.then_some(facets);
    let Prescribed { equations, placed, ties, at_ties, nowhere: [idle, untied] } =
        definition.prescribed(&approximation, rule, refused)?;
    // Of clusters that are zones of cells.
    let zones = zone.map(|size| sharing.zones(&**cells, cells.zones(size))).transpose()?;
    if let Some(zones) = &zones {
        if let Some(directions) = cells.pressure_directions(zones) {
            body = body.varying_along(&directions);
        }
        let free = thin_walls::free::<D>(&equations, cells.positions().len());
        sharing.agreed(thin_walls::refuse(scheme, (&**cells, zones), &body, &free, refused))?;
    }
    let body = sharing.smallest_zones_of(body);
    let tables = Tables {
        boundary: &|part, place| {
            // Where a load ends within a facet, finer ones see it.
            let parts = facets.parts * if place.within.is_empty() { 1 } else { FINER };
            let points = cells.facet_points(part, parts, facets.gauss)?;
            let points = sharing.points(points.retained(|x| place.holds(x)));
            ShapeTable::new(&approximation, &points, kinematics)
        },
        body: &|place| {
            let zones = sharing.zones(&**cells, Zones::single(cells.cell_count()))?;
            let points = cells.gauss_in(2 + usize::from(scheme.order > 1), &zones)?;
            ShapeTable::new(&approximation, &points.retained(|x| place.holds(x)), kinematics)
        },
    };
    let (loads, unloaded) = load_tables(definition, &approximation, &tables)?;
    let krylov = match super::space::is_one_body(scene) {
        true => super::space::krylov(scene, scheme, &**cells, &approximation, &body, &equations, sharing)?,
        false => None,
    };
    let discrete_body =
        definition.discrete_body(body, Box::new(approximation), Facets::OfCells(facets), dilations, raised);
    let nowhere = [idle, untied, unloaded];
    Ok(BuiltBody { discrete_body, facets, equations, placed, loads, ties, at_ties, nowhere, krylov })
}
