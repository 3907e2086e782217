//! Zones in which conditions leave fewer free displacements than there are pressures.

use crate::boundary::Constraints;
use crate::cells::{Cells, ZoneParticles, Zones};
use crate::error::{Error, GeometryError};
use crate::material::Material;
use crate::scene::definition::scheme::Scheme;
use crate::term::{Body, PressureField};

use super::conditions::{Refused, nearest_particle};

/// Bulk over shear modulus above which a point's volume counts as a constraint.
const STIFF: f64 = 20.0;

/// Whether a material resists a change of volume, undeformed, so much more than one of shape that it locks.
pub(crate) fn is_stiff(material: &dyn Material) -> bool {
    let moduli = material.initial_moduli();
    moduli.bulk > STIFF * moduli.shear
}

/// The part of each particle's displacement that equations leave free.
pub(super) fn free<const D: usize>(equations: &Constraints, particles: usize) -> impl Fn(usize) -> f64 + use<D> {
    let mut fixed = vec![0usize; particles];
    for equation in equations.equations() {
        if let Some(fixed) = fixed.get_mut(equation.dependent / D) {
            *fixed += 1;
        }
    }
    move |particle| 1.0 - fixed[particle].min(D) as f64 / D as f64
}

/// Refuses zones that have more pressures than displacements that conditions leave free.
pub(super) fn refuse<const D: usize>(
    scheme: &Scheme,
    (cells, zones): (&dyn Cells<D>, &Zones),
    body: &Body<D>,
    free: &dyn Fn(usize) -> f64,
    refused: Refused<'_>,
) -> Result<(), Error> {
    let projected = matches!(body.field(), PressureField::Constant | PressureField::Linear);
    if scheme.thin_walls || !projected || D == 1 || !is_stiff(&**body.material()) {
        return Ok(());
    }
    let clusters = body.table().clusters();
    let found = cells.free_particles(zones, free);
    let pressures = |zone: usize| {
        let mut functions = [false; 4];
        for point in clusters.points(zone) {
            for (is_used, value) in functions.iter_mut().zip(body.zone_functions(point)) {
                *is_used |= *value != 0.0;
            }
        }
        functions.iter().filter(|is_used| **is_used).count()
    };
    let locked = |(zone, own): (usize, &ZoneParticles<D>)| {
        let (pressures, displacements) = (pressures(zone), D as f64 * own.free);
        (pressures as f64 > displacements).then_some((pressures, displacements, *own))
    };
    let worst = found.iter().enumerate().filter_map(locked).min_by(|a, b| a.2.thickness.total_cmp(&b.2.thickness));
    let Some((pressures, displacements, ZoneParticles { middle, thickness, .. })) = worst else { return Ok(()) };
    // Each cell halved has a free particle inside, whatever is fixed around it.
    let spacing = 0.5 * cells.spacings(nearest_particle(cells, &middle)).min().min(thickness);
    let at = middle.as_slice().to_vec();
    refused(GeometryError::LockedWall { at, thickness, pressures, displacements, spacing }.into())
}
