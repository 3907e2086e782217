//! A body by reproducing kernel particles.

use crate::cells::Zones;
use crate::error::Error;
use crate::table::ShapeTable;
use crate::term::Body;

use super::conditions::{Refused, rows};
use super::facet_rule::Facets;
use super::functions::covering;
use super::one_body::{FINER, Made, Of, Tables, clocked, expanding, load_tables, material};
use super::rule::body_table;
use crate::scene::definition::scheme_choices::RowKind;

/// Reproducing kernel particles.
pub(crate) fn particles<const D: usize>(of: &Of<'_, D>, refused: Refused<'_>) -> Result<Made<D>, Error> {
    let Of { scene, scheme, cells, .. } = of;
    let (approximation, raised) = covering(scheme, &**cells)?;
    let dilations = approximation.particles().supports().iter().map(|s| s.half_widths().max()).collect();
    let kinematics = &*scene.kinematics;
    let sharing = of.sharing;
    let (table, facets, field) = body_table(of, &approximation)?;
    let (table, law) = (of.among_all(expanding(scene, table)?), material(scene, &of.body.material)?);
    let mut body = clocked(scene, Body::projecting(table, law, field, scheme.measure))?;
    if let Some(fewest) = sharing.fewest(body.fewest()) {
        body = body.with_fewest(fewest);
    }
    let tables = Tables {
        boundary: &|part, place| {
            // Where a load ends within a facet, finer ones see it.
            let parts = facets.parts * if place.within.is_some() { FINER } else { 1 };
            let points = cells.boundary(part, parts, facets.gauss)?.points;
            let points = sharing.points(points.retained(|x| place.holds(x)));
            ShapeTable::new(&approximation, &points, kinematics)
        },
        body: &|place| {
            let zones = sharing.zones(&**cells, Zones::single(cells.cell_count()));
            let points = cells.gauss_in(2 + usize::from(scheme.order > 1), &zones)?;
            ShapeTable::new(&approximation, &points.retained(|x| place.holds(x)), kinematics)
        },
    };
    let over_boundary = match scheme.rows {
        RowKind::Auto => D > 1,
        RowKind::AtParticles => false,
        RowKind::OverBoundary => true,
    };
    let loads = load_tables(of, &approximation, &tables)?;
    let rule = over_boundary.then_some(facets);
    let (mut rows, placed) = rows(scene, of.conditions, &**cells, &approximation, rule, refused)?;
    let ties = of.tied(&mut rows, &approximation, rule)?;
    // Several bodies are solved by factors.
    // Factors leave out parts of the matrix of contact, which sweeps over them put right.
    let alone = scene.bodies.len() == 1 && scene.rigids.is_empty() && scene.contacts.is_empty();
    let krylov = match alone {
        true => super::space::krylov(scene, scheme, &**cells, &approximation, &body, &rows, sharing)?,
        false => None,
    };
    let member = of.member(body, Box::new(approximation), Facets::OfCells(facets), dilations, raised);
    Ok(Made { member, facets, rows, placed, loads, ties, krylov })
}
