//! What a state tells of a contact.

use nalgebra::{Matrix3, Vector3};

use crate::contact::{ContactError, ContactSurface, LocalContact, PairContact, Trace, chains};
use crate::error::{Error, OutputError};
use crate::geometry::{Point, padded};
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
    /// Gap over its trace function \[length\], a mean in which depth behind a rigid surface counts for more; zero in contact.
    pub gap: f64,
    /// Traction per current area on the body \[stress\], friction included.
    pub traction: Point<D>,
    /// Force on the body that it carries \[force\].
    pub force: Point<D>,
    /// Whether it touches.
    pub is_active: bool,
    /// Whether it touches and slides; what touches without friction does.
    pub slips: bool,
}

/// What a state tells of a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactState<const D: usize> {
    /// Force of the surface on the body \[force\]; of the whole revolution along the axis of bodies of revolution, where the radial component is
    /// the sum over all directions.
    pub force: Point<D>,
    /// Moment about the origin of that force \[force·length\]; in the plane about axis 2.
    pub moment: Vector3<f64>,
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
        self.points.iter().map(|point| point.pressure).fold(0.0, f64::max)
    }

    /// Pressures, gaps and tractions along the boundary as a table, a row for each boundary particle.
    ///
    /// # Errors
    /// None where the table takes its rows.
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
        let condensed = &state.condensed[contact.term];
        let law = match &contact.law {
            Law::Rigid(law) => law,
            Law::Pair(law, swapped) => return self.pair_contact(law, *swapped, state, condensed),
        };
        let view = View { displacement: &state.displacement, condensed, load: state.load };
        let placed = law.placed(&state.displacement, state.load);
        let mut found = ContactState {
            force: Point::zeros(),
            moment: Vector3::zeros(),
            extent: 0.0,
            travel: placed.offset,
            angle: placed.angle(),
            depth: Some(0.0),
            points: Vec::with_capacity(law.contact_surface.traces.len()),
        };
        let mut sizes = Vec::with_capacity(law.contact_surface.traces.len());
        for (k, trace) in law.contact_surface.traces.iter().enumerate() {
            let (nominal, friction) = law.pressure(k, condensed);
            let (mut area, mut width) = (0.0, 0.0);
            let particle = trace.particle as usize;
            let reference = self.model.point::<D>(particle);
            let moved = self.node_displacement(particle, state)?;
            let sheet = self.sheet_of(particle);
            let (mut force, mut moment) = (Point::<D>::zeros(), Vector3::zeros());
            let mut behind = -placed.nearest(&*law.surface.shape, &(reference + moved)).gap;
            let local_contact = law.local_contact(k, &view, |p, part, nearest, _| {
                let (point, weight) = trace.points[p];
                let x = law.contact_surface.table.positions()[point as usize]
                    + law.contact_surface.displacement(point, &state.displacement);
                let stretch = law.contact_surface.outward(point, &state.displacement).norm();
                area += weight * stretch * thickness(sheet, &law.contact_surface, point, &state.displacement);
                behind = behind.max(-nearest.gap);
                // Along the meridian, without the hoop's stretch.
                let table = &law.contact_surface.table;
                let hoop = match table.hoop_components() {
                    [] => 1.0,
                    _ => 1.0 + table.displacement_gradient(point as usize, &state.displacement)[(2, 2)],
                };
                width += weight * stretch / hoop;
                let push = nearest.normal * (nominal * part) + friction * weight;
                force += push;
                moment += padded::<D, 3>(&x).cross(&padded(&push));
            });
            let is_active = law.is_active(k, nominal, local_contact.gap);
            if !is_active {
                (force, moment) = (Point::zeros(), Vector3::zeros());
            }
            found.force += force;
            found.moment += moment;
            found.depth = found.depth.map(|depth| depth.max(behind));
            // The size of the trace function now.
            sizes.push(if D == 3 { width } else { width / trace.area * trace.width });
            found.points.push(ContactPoint {
                reference,
                position: reference + moved,
                pressure: if is_active { nominal * trace.area / area } else { 0.0 },
                gap: local_contact.gap,
                traction: force / area,
                force,
                is_active,
                slips: is_active && friction.norm() >= (1.0 - 1e-6) * law.surface.friction * nominal,
            });
        }
        found.extent = along(&mut found.points, &law.contact_surface.traces, &sizes);
        Ok(found)
    }

    /// The work that friction has taken along a path on the surface of a name \[force·length\]: over its steps, the mean traction times
    /// the slip of each boundary particle.
    ///
    /// # Errors
    /// As [`contact`](Problem::contact).
    pub fn friction_work(&self, path: &EquilibriumPath, name: &str) -> Result<f64, Error> {
        let contact = self.contact_named(name)?;
        let law = match &contact.law {
            Law::Rigid(law) => law,
            Law::Pair(law, _) => return self.pair_friction_work(law, contact.term, path),
        };
        let mut work = 0.0;
        let mut before: Option<Vec<(Point<D>, LocalContact<D>)>> = None;
        for state in std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state)) {
            state.check_lengths(&self.model, &self.equations)?;
            let condensed = &state.condensed[contact.term];
            let view = View { displacement: &state.displacement, condensed, load: state.load };
            let now: Vec<_> = (0..law.contact_surface.traces.len())
                .map(|trace| {
                    let local_contact = law.local_contact(trace, &view, |_, _, _, _| {});
                    (law.pressure(trace, condensed).1 * law.contact_surface.traces[trace].area, local_contact)
                })
                .collect();
            if let Some(before) = before {
                let steps = now.iter().zip(&before);
                work -= steps
                    .map(|((f, now), (f0, was))| 0.5 * (f + f0).dot(&now.slip(&was.beside, was.angle)))
                    .sum::<f64>();
            }
            before = Some(now);
        }
        Ok(work)
    }

    /// The same between two parts.
    fn pair_friction_work(&self, law: &PairContact<D>, term: usize, path: &EquilibriumPath) -> Result<f64, Error> {
        let states: Vec<&State> =
            std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state)).collect();
        states.iter().try_for_each(|state| state.check_lengths(&self.model, &self.equations))?;
        Ok(states.windows(2).map(|pair| law.friction_work(&seen(pair[0], term), &seen(pair[1], term))).sum())
    }

    /// The same of two parts of the boundary: the force is that on the part named first; boundary particles of the part that carries the
    /// pressures, then those of the other.
    fn pair_contact(
        &self,
        law: &PairContact<D>,
        swapped: bool,
        state: &State,
        condensed: &[f64],
    ) -> Result<ContactState<D>, Error> {
        let mut found = ContactState {
            force: Point::zeros(),
            moment: Vector3::zeros(),
            extent: 0.0,
            travel: Point::zeros(),
            angle: 0.0,
            depth: None,
            points: Vec::with_capacity(law.traces),
        };
        let pressed = law.pressed(&View { displacement: &state.displacement, condensed, load: state.load });
        let mut sizes = Vec::new();
        for (all, &force) in pressed.forces.iter().enumerate() {
            let (side, trace) = law.trace(all);
            let contact_surface = &law.contact_surfaces[side];
            let trace = &contact_surface.traces[trace];
            let sheet = self.sheet_of(trace.particle as usize);
            let mut area = 0.0;
            let mut normal = Vector3::zeros();
            for &(point, weight) in &trace.points {
                let outward = contact_surface.outward(point, &state.displacement);
                area += weight * outward.norm() * thickness(sheet, contact_surface, point, &state.displacement);
                normal += outward * weight;
            }
            let particle = trace.particle as usize;
            let reference = self.model.point::<D>(particle);
            let position = reference + self.node_displacement(particle, state)?;
            sizes.push(area);
            let pressure = (-padded::<D, 3>(&force).dot(&normal.normalize()) / area).max(0.0);
            let is_active = pressure > 0.0;
            if (side == 0) != swapped || law.contact_surfaces.len() == 1 {
                found.moment += padded::<D, 3>(&position).cross(&padded(&force));
            }
            let traction = force / area;
            found.points.push(ContactPoint {
                reference,
                position,
                pressure,
                gap: pressed.gaps[all],
                traction,
                force,
                is_active,
                slips: is_active && (law.law.friction == 0.0 || pressed.slides[all]),
            });
        }
        found.force = match law.contact_surfaces.len() {
            // What a part does to itself is nothing in all.
            1 => pressed.forces.iter().sum(),
            _ => pressed.total * if swapped { -1.0 } else { 1.0 },
        };
        let mut beside = found.points.split_off(law.contact_surfaces[0].traces.len());
        found.extent = along(&mut found.points, &law.contact_surfaces[0].traces, &sizes);
        if let Some(contact_surface) = law.contact_surfaces.get(1) {
            along(&mut beside, &contact_surface.traces, &sizes[found.points.len()..]);
        }
        found.points.extend(beside);
        Ok(found)
    }

    /// The sheet in plane stress that a particle belongs to.
    fn sheet_of(&self, particle: usize) -> Option<&Sheet<D>> {
        self.discrete_bodies.iter().find(|body| body.nodes.contains(&particle))?.sheet.as_ref()
    }

    fn contact_named(&self, name: &str) -> Result<&Contact<D>, ContactError> {
        self.contacts.iter().find(|contact| contact.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.contacts.iter().map(|contact| contact.name.as_str()).collect();
            ContactError::Unknown { requested: name.to_string(), known: known.join("; ") }
        })
    }
}

/// The stretch across a sheet at a point of its edge; 1 for other bodies.
fn thickness<const D: usize>(
    sheet: Option<&Sheet<D>>,
    surface: &ContactSurface<D>,
    point: u32,
    displacement: &[f64],
) -> f64 {
    let f = || Matrix3::identity() + surface.table.displacement_gradient(point as usize, displacement);
    sheet.map_or(1.0, |sheet| sheet.thickness(&f(), &surface.table.positions()[point as usize]))
}

/// Puts points into their order along the boundary, and tells how much of it touches.
fn along<const D: usize>(points: &mut Vec<ContactPoint<D>>, traces: &[Trace], sizes: &[f64]) -> f64 {
    if D == 3 {
        return touching_extent(points, sizes);
    }
    let chains = chains(traces);
    let mut ordered = Vec::with_capacity(points.len());
    for chain in &chains {
        for &trace in chain {
            ordered.push(points[trace]);
        }
    }
    *points = ordered;
    let mut first = 0;
    let widths = chains.iter().map(|chain| {
        first += chain.len();
        width(&points[first - chain.len()..first])
    });
    widths.sum()
}

/// What a term sees of a state.
fn seen(state: &State, term: usize) -> View<'_> {
    View { displacement: &state.displacement, condensed: &state.condensed[term], load: state.load }
}

/// The total size of the points that touch.
fn touching_extent<const D: usize>(points: &[ContactPoint<D>], sizes: &[f64]) -> f64 {
    points.iter().zip(sizes).filter(|(point, _)| point.is_active).map(|(_, size)| size).sum()
}

/// The width of contact along a chain of trace functions: between the last trace function that touches and the next one the square of the
/// pressure, which falls in proportion to the distance from a smooth edge, is extrapolated to zero.
fn width<const D: usize>(points: &[ContactPoint<D>]) -> f64 {
    let n = points.len();
    let between = |a: usize, b: usize| (points[a].position - points[b].position).norm();
    let mut width = 0.0;
    for k in 0..n {
        if !points[k].is_active {
            continue;
        }
        for (beside, inner) in [(k.checked_sub(1), k + 1), (Some(k + 1), k.wrapping_sub(1))] {
            match beside.filter(|&b| b < n) {
                // The end of the boundary part.
                None => {}
                Some(b) if points[b].is_active => width += 0.5 * between(k, b),
                Some(b) => {
                    let squares = |i: usize| points[i].pressure.powi(2);
                    let to_edge = if inner < n && points[inner].is_active && squares(inner) > squares(k) {
                        (between(k, inner) * squares(k) / (squares(inner) - squares(k))).min(between(k, b))
                    } else {
                        0.5 * between(k, b)
                    };
                    width += to_edge;
                }
            }
        }
    }
    width
}
