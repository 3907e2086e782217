//! A body by finite elements on the same lattice.

use crate::cells::Zones;
use crate::each::list_of;
use crate::error::{BoundaryError, Error, GeometryError};
use crate::shape::FiniteElements;
use crate::table::ShapeTable;
use crate::term::{Body, PressureField};

use super::conditions::{Prescribed, Refused};
use super::facet_rule::{FacetRule, Facets};
use super::one_body::{BodyInput, BuiltBody, FINER, Tables, load_tables};
use super::rule::lattice_of;
use crate::scene::{ConstraintKind, PressureScheme, Rule};

/// Finite elements on the same lattice.
pub(crate) fn elements<const D: usize>(
    definition: &BodyInput<'_, D>,
    refused: Refused<'_>,
) -> Result<BuiltBody<D>, Error> {
    let BodyInput { scene, scheme, cells, .. } = definition;
    ensure!(
        scheme.constraint_kind != ConstraintKind::OverBoundary,
        BoundaryError::Unsuitable {
            enforcement: "rows over boundaries",
            reason: "finite elements interpolate: prescribe values at nodes".into(),
        }
    );
    let order = usize::from(scheme.order);
    let elements = FiniteElements::new(lattice_of(&**cells, "finite elements")?.clone(), order)?;
    let kinematics = &*scene.kinematics;
    let points = match &scheme.rule {
        Rule::Auto => order + 1,
        Rule::Gauss { zones: None, points } => points.unwrap_or(order + 1),
        _ => {
            return Err(GeometryError::Count {
                what: "integration zones of finite elements",
                count: 0,
                needed: "elements are integrated by Gauss points in each element",
            }
            .into());
        }
    };
    let field = match scheme.pressure {
        PressureScheme::Auto if order == 1 => PressureField::Constant,
        PressureScheme::Auto => PressureField::Linear,
        PressureScheme::Field { field, .. } => field,
    };
    let sharing = definition.sharing;
    let own = sharing.run(Zones::single(elements.element_count()));
    let body = || {
        let table = ShapeTable::of_elements(&elements, &elements.gauss_in(points, &own)?, kinematics)?;
        // Q1/P0 and Q2/P1 as the literature has them: all of the volumetric energy projected.
        definition.body_of(table, |table, law| Body::zonal(table, law, field, 0.0))
    };
    let body = sharing.agreed(body())?;
    let tables = Tables {
        boundary: &|part, place| {
            let points = elements.boundary(part, points * if place.within.is_empty() { 1 } else { FINER })?;
            let points = sharing.element_points(points.retained(|x| place.holds(x)));
            ShapeTable::of_elements(&elements, &points, kinematics)
        },
        body: &|place| {
            ShapeTable::of_elements(
                &elements,
                &elements.gauss_in(points, &own)?.retained(|x| place.holds(x)),
                kinematics,
            )
        },
    };
    let (loads, unloaded) = load_tables(definition, &elements, &tables)?;
    let Prescribed { equations, placed, ties, at_ties, nowhere: [idle, untied] } =
        definition.prescribed(&elements, None, refused)?;
    let dilations = list_of(cells.positions().len(), |node| cells.local_spacing(node));
    let facets = FacetRule { parts: 1, gauss: points };
    let discrete_body =
        definition.discrete_body(body, Box::new(elements), Facets::OfElements { order, gauss: points }, dilations, 0);
    let nowhere = [idle, untied, unloaded];
    Ok(BuiltBody { discrete_body, facets, equations, placed, loads, ties, at_ties, nowhere, krylov: None })
}
