//! What a state tells of a contact.

use crate::contact::{ContactError, Trace, chains};
use crate::each::Each;
use crate::error::{Error, OutputError};
use crate::geometry::{Mat3, Point, Vec3, padded};
use crate::output::Table;
use crate::solve::{EquilibriumPath, State};
use crate::term::View;

use crate::scene::Problem;
use crate::scene::definition::contact_definition::{Contact, Law};
use crate::scene::definition::load::Sheet;

/// One boundary particle in contact or beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint<const D: usize> {
    /// Its place in the body at rest \[length\].
    pub reference: Point<D>,
    /// Where it is now \[length\].
    pub position: Point<D>,
    /// Pressure per current area \[stress\], zero or above: on the body, against the normal of the body.
    pub pressure: f64,
    /// Gap over its trace function \[length\], a mean in which depth behind a rigid surface counts for more; zero in contact. Infinite where
    /// nothing is opposite, and on the part of a pair that carries no pressures.
    pub gap: f64,
    /// Traction per current area on the body \[stress\], friction included.
    pub traction: Point<D>,
    /// Force on the body that it carries \[force\].
    pub force: Point<D>,
    /// Whether it touches.
    pub is_active: bool,
    /// Whether it touches and slides; what touches without friction does. On the face that carries no pressures: whether all that presses on it
    /// slides.
    pub slips: bool,
}

/// What a state tells of a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactState<const D: usize> {
    /// Force of the surface on the body \[force\]; of the whole revolution along the axis of bodies of revolution, where the radial component is
    /// the sum over all directions.
    pub force: Point<D>,
    /// Moment about the origin of that force \[force·length\]; in the plane about axis 2.
    pub moment: Vec3,
    /// What touches in the current state: the width in the plane and along the meridian \[length\], the area in space \[length²\].
    pub extent: f64,
    /// How far the surface has gone \[length\].
    pub travel: Point<D>,
    /// By how much it has turned \[rad\].
    pub angle: f64,
    /// How deep a boundary particle or a point of a facet lies behind a rigid surface at most \[length\]: mean gaps close, and points may
    /// lie to both sides of the surface, deepest at a sharp edge between particles. An interference that is not resolved yet counts. None
    /// between deformable parts, where it is not looked for.
    pub depth: Option<f64>,
    /// The boundary particles, along the boundary.
    pub points: Vec<ContactPoint<D>>,
}

impl<const D: usize> ContactState<D> {
    /// The largest pressure \[stress\].
    pub fn peak_pressure(&self) -> f64 {
        self.points.largest(|point| point.pressure)
    }

    /// Pressures, gaps and tractions along the boundary as a table, a row for each boundary particle.
    ///
    /// # Errors
    /// [`OutputError::Length`], which rows of equal length do not cause.
    pub fn table(&self) -> Result<Table, OutputError> {
        const AXES: [&str; 3] = ["0", "1", "2"];
        let mut names: Vec<String> = Vec::new();
        for what in ["X", "x"] {
            names.extend(AXES[..D].iter().map(|axis| format!("{what}{axis}")));
        }
        names.extend(["pressure".to_string(), "gap".to_string()]);
        names.extend(AXES[..D].iter().map(|axis| format!("traction{axis}")));
        let mut table = Table::new(names);
        for point in &self.points {
            let mut row: Vec<f64> = Vec::with_capacity(3 * D + 2);
            row.extend(point.reference.iter());
            row.extend(point.position.iter());
            row.extend([point.pressure, point.gap]);
            row.extend(point.traction.iter());
            table.push(row)?;
        }
        Ok(table)
    }
}

impl<const D: usize> Problem<D> {
    /// What a state tells of the contact with the surface of a name: force, moment, width or area, and pressures along the
    /// boundary.
    ///
    /// # Errors
    /// Where no surface has the name, with those that there are; for a state of another problem.
    pub fn contact(&self, state: &State, name: &str) -> Result<ContactState<D>, Error> {
        state.check_lengths(&self.model, &self.equations)?;
        let contact = self.contact_named(name)?;
        let mut places = Vec::new();
        for surface in contact.law.surfaces() {
            for trace in &surface.traces {
                let particle = trace.particle as usize;
                let (reference, sheet) = (self.model.point::<D>(particle), self.sheet_of(particle));
                let position = reference + self.node_displacement(particle, state)?;
                // The stretch across a sheet at its edge.
                let mut area = 0.0;
                for &(point, weight) in &trace.points {
                    let stretch = surface.outward(point, &state.displacement).norm();
                    let gradient = || surface.table.displacement_gradient(point as usize, &state.displacement);
                    let x = || padded(&surface.table.positions[point as usize]);
                    let thickness = sheet.map_or(1.0, |sheet| sheet.thickness(&(Mat3::identity() + gradient()), &x()));
                    area += weight * stretch * thickness;
                }
                places.push(Place { reference: padded(&reference), position: padded(&position), area });
            }
        }
        Ok(found(contact, state, self.model.at_own(state).view(contact.term), &places))
    }

    /// The work that friction has taken along a path on the surface of a name \[force·length\]: over its steps, the mean traction times
    /// the slip of each boundary particle.
    ///
    /// # Errors
    /// As [`contact`](Problem::contact).
    pub fn friction_work(&self, path: &EquilibriumPath, name: &str) -> Result<f64, Error> {
        let contact = self.contact_named(name)?;
        let (mut work, mut before) = (0.0, &path.start);
        before.check_lengths(&self.model, &self.equations)?;
        for step in &path.steps {
            step.state.check_lengths(&self.model, &self.equations)?;
            let (was, now) =
                (self.model.at_own(before).view(contact.term), self.model.at_own(&step.state).view(contact.term));
            work += match &contact.law {
                Law::Rigid(law) => law.friction_work(&was, &now),
                Law::Pair(law, _) => law.friction_work(&was, &now),
            };
            before = &step.state;
        }
        Ok(work)
    }

    /// The sheet in plane stress that a particle belongs to.
    fn sheet_of(&self, particle: usize) -> Option<&Sheet<D>> {
        self.discrete_bodies.iter().find(|body| body.nodes.contains(&particle))?.sheet.as_ref()
    }

    fn contact_named(&self, name: &str) -> Result<&Contact, ContactError> {
        self.contacts.iter().find(|contact| contact.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.contacts.mapped(|contact| contact.name.as_str());
            ContactError::Unknown { requested: name.to_string(), known: known.join("; ") }
        })
    }
}

/// Where the particle of a trace function is in the body at rest and now, and the area of the trace function now.
struct Place {
    reference: Vec3,
    position: Vec3,
    area: f64,
}

/// What a state tells of a contact whose trace functions have places.
fn found<const D: usize>(contact: &Contact, state: &State, view: View<'_>, places: &[Place]) -> ContactState<D> {
    let none = (Point::zeros(), 0.0, None);
    let (pressed, (travel, angle, depth), moment, swapped) = match &contact.law {
        Law::Rigid(law) => {
            let (pressed, moment, mut depth) = law.pressed(&view);
            let placed = law.placed(&state.displacement, state.load);
            for place in places {
                depth = depth.max(-placed.nearest(&*law.surface.shape, &place.position).gap);
            }
            (pressed, (placed.offset, placed.angle(), Some(depth)), Some(moment), false)
        }
        Law::Pair(law, swapped) => (law.pressed(&view), none, None, *swapped),
    };
    let surfaces = contact.law.surfaces();
    let force = match surfaces {
        // What a part does to itself is nothing in all.
        [_] if moment.is_none() => pressed.forces.iter().sum::<Vec3>(),
        _ => pressed.total * if swapped { -1.0 } else { 1.0 },
    };
    let (mut extent, mut points) = (0.0, Vec::with_capacity(places.len()));
    let mut own_moment = Vec3::zeros();
    for (side, surface) in surfaces.iter().enumerate() {
        let (first, mut own) = (points.len(), Vec::new());
        for (k, &Place { reference, position, area }) in
            places.iter().enumerate().skip(first).take(surface.traces.len())
        {
            let force = pressed.forces[k];
            if (side == 0) != swapped || surfaces.len() == 1 {
                own_moment += position.cross(&force);
            }
            own.push(ContactPoint {
                reference: padded(&reference),
                position: padded(&position),
                pressure: pressed.normal_forces[k] / area,
                gap: pressed.gaps[k],
                traction: padded(&(force / area)),
                force: padded(&force),
                is_active: pressed.active[k],
                slips: pressed.active[k] && pressed.slides[k],
            });
        }
        let touching = along(&mut own, &surface.traces, &places[first..]);
        extent = if side == 0 { touching } else { extent };
        points.extend(own);
    }
    let (force, travel) = (padded(&force), padded(&travel));
    ContactState { force, moment: moment.unwrap_or(own_moment), extent, travel, angle, depth, points }
}

/// Puts points into their order along the boundary, and tells how much of it touches.
fn along<const D: usize>(points: &mut Vec<ContactPoint<D>>, traces: &[Trace], places: &[Place]) -> f64 {
    if D == 3 {
        let touching = points.iter().zip(places).filter(|(point, _)| point.is_active);
        return touching.map(|(_, place)| place.area).sum();
    }
    let chains = chains(traces);
    let mut ordered = Vec::with_capacity(points.len());
    for (chain, _) in &chains {
        for &trace in chain {
            ordered.push(points[trace]);
        }
    }
    *points = ordered;
    let mut first = 0;
    let widths = chains.iter().map(|(chain, closed)| {
        first += chain.len();
        width(&points[first - chain.len()..first], *closed)
    });
    widths.sum()
}

/// The width of contact along a chain of trace functions: between the last trace function that touches and the next one the square of the
/// pressure, which falls in proportion to the distance from a smooth edge, is extrapolated to zero.
fn width<const D: usize>(points: &[ContactPoint<D>], closed: bool) -> f64 {
    let n = points.len();
    let between = |a: usize, b: usize| (points[a].position - points[b].position).norm();
    let ahead = |k: usize| if closed { Some((k + 1) % n) } else { Some(k + 1).filter(|&next| next < n) };
    let behind = |k: usize| if closed { Some((k + n - 1) % n) } else { k.checked_sub(1) };
    let mut width = 0.0;
    for k in 0..n {
        if !points[k].is_active {
            continue;
        }
        for (beside, inner) in [(behind(k), ahead(k)), (ahead(k), behind(k))] {
            // None beyond the end of the boundary part.
            let Some(b) = beside else { continue };
            if points[b].is_active {
                width += 0.5 * between(k, b);
                continue;
            }
            let square = |i: usize| points[i].pressure.powi(2);
            width += match inner.filter(|&inner| points[inner].is_active && square(inner) > square(k)) {
                Some(inner) => (between(k, inner) * square(k) / (square(inner) - square(k))).min(between(k, b)),
                None => 0.5 * between(k, b),
            };
        }
    }
    width
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Along a closed outline the width does not depend on where it starts.
    #[test]
    fn widths_along_closed_outlines() {
        let point = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 12.0;
            let pressure = [3.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.5][k % 12];
            ContactPoint::<2> {
                reference: Point::zeros(),
                position: Point::<2>::new(angle.cos(), angle.sin()),
                pressure,
                gap: 0.0,
                traction: Point::zeros(),
                force: Point::zeros(),
                is_active: pressure > 0.0,
                slips: false,
            }
        };
        let from = |first: usize| -> Vec<ContactPoint<2>> { (first..first + 12).map(point).collect() };
        let expected = width(&from(6), false);
        assert!(expected > 3.0 * 0.5);
        for first in 0..12 {
            assert_abs_diff_eq!(width(&from(first), true), expected, epsilon = 1e-12);
        }
    }
}
