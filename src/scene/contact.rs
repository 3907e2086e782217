//! Contact of a scene: what touches what, and what a state tells of it.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::cells::BoundaryCells;
use crate::contact::Drive;
use crate::contact::{Carriage, Chain, ContactError, Leash, PairContact, RigidContact, RigidSurface, Skin, Stiffness};
use crate::error::{Error, OutputError};
use crate::geometry::Point;
use crate::material::{initial_bulk_modulus, initial_shear_modulus};
use crate::output::Table;
use crate::quadrature::Points;
use crate::solve::{EquilibriumPath, State};
use crate::table::ShapeTable;
use crate::tensor::cofactor;
use crate::term::View;

use super::{Place, Problem, Scene};

/// A part of the body and the rigid surface that it may touch.
#[derive(Clone)]
pub(crate) struct Touching<const D: usize> {
    pub place: Place<D>,
    pub surface: RigidSurface<D>,
}

impl<const D: usize> Touching<D> {
    fn label(&self) -> String {
        format!("contact of {} with {}", self.place, self.surface.name)
    }
}

/// Two parts of the boundary that may touch each other, or one that may touch itself.
#[derive(Clone)]
pub(crate) struct Meeting<const D: usize> {
    pub first: Place<D>,
    pub second: Option<Place<D>>,
    pub name: String,
}

/// A contact in a problem.
pub(crate) struct Contact<const D: usize> {
    /// The name of its surface.
    pub name: String,
    /// Its place among the terms.
    pub term: usize,
    pub law: Law<D>,
}

/// What it touches.
pub(crate) enum Law<const D: usize> {
    Rigid(Arc<RigidContact<D>>),
    /// Two parts, and whether they are in the other order than named.
    Pair(Arc<PairContact<D>>, bool),
}

/// Facets of a boundary part with plain hats, and the shape functions at their points.
type Face<const D: usize> = (BoundaryCells<D>, ShapeTable<D>);

/// Where boundary cells for contact and their tables come from.
pub(super) struct Skins<'a, const D: usize> {
    /// Facets of a part with plain hats, and their table.
    pub part: &'a dyn Fn(&Place<D>) -> Result<Face<D>, Error>,
    /// Shape functions at any points of the boundary.
    pub points: &'a dyn Fn(&Points<D>) -> Result<ShapeTable<D>, Error>,
}

impl<const D: usize> Scene<D> {
    /// Lets a boundary part touch a rigid surface: it may come to lie on it, slide along it and leave it, and never goes
    /// in. Nothing else is to be said: no factor, no first step, no guess of what touches.
    ///
    /// A body that nothing but contact holds is kept in place until it touches. Results are found by the name of the
    /// surface, [`Problem::contact`].
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A quarter of a rubber cylinder of 0.4 m squeezed by a plate that comes down by 25 mm.
    /// let quarter = Outline::at([0.0, 0.0]).line("equator", [0.2, 0.0])
    ///     .arc("outer", [0.0, 0.2], [0.0, 0.0], Turn::Left).close("axis");
    /// let rubber = Rubber::mooney_rivlin(0.293, 0.177, 1410.0)?; // MPa
    /// let roller = Scene::on(Region::new(quarter)?, PlaneStrain, rubber)
    ///     .prescribe("equator", 1, 0.0)
    ///     .prescribe("axis", 0, 0.0)
    ///     .contact("outer", RigidSurface::plane([0.0, 0.2], [0.0, -1.0]).moving([0.0, -0.025]).named("plate"));
    /// let problem = roller.discretize(&Scheme::default().particles([8]))?;
    /// let path = problem.run(&mut ())?.completed()?;
    /// let plate = problem.contact(path.last(), "plate")?;
    /// let width = plate.extent; // m, of this half
    /// assert!(plate.force[1] < 0.0 && width > 0.04 && width < 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn contact(mut self, place: impl Into<Place<D>>, surface: RigidSurface<D>) -> Self {
        self.contacts.push(Touching { place: place.into(), surface });
        self
    }
}

impl Scene<2> {
    /// Lets two boundary parts touch each other, without friction; results are found by the name. The boundary particles of the part that
    /// has more of them carry the pressures, whichever is named first.
    pub fn contact_between(mut self, first: impl Into<Place<2>>, second: impl Into<Place<2>>, name: &str) -> Self {
        self.meetings.push(Meeting { first: first.into(), second: Some(second.into()), name: name.into() });
        self
    }

    /// Lets a boundary part touch itself where it folds, without friction; results are found by the name.
    pub fn contact_itself(mut self, place: impl Into<Place<2>>, name: &str) -> Self {
        self.meetings.push(Meeting { first: place.into(), second: None, name: name.into() });
        self
    }
}

/// Refuses contacts that no scheme could serve.
pub(super) fn validate<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    for contact in &scene.contacts {
        contact.surface.validate(&contact.label())?;
    }
    let rigid = scene.contacts.iter().map(|contact| &contact.surface.name);
    let names: Vec<&String> = rigid.chain(scene.meetings.iter().map(|meeting| &meeting.name)).collect();
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        Some((_, name)) => Err(ContactError::Twice { name: name.to_string() }.into()),
        None => Ok(()),
    }
}

/// Number of surfaces that are pushed.
pub(super) fn carriage_count<const D: usize>(scene: &Scene<D>) -> usize {
    scene.contacts.iter().filter(|contact| contact.surface.free_direction().is_some()).count()
}

/// Positions of the unknown travels of surfaces that are pushed, behind those of the particles.
pub(super) fn carriages<const D: usize>(scene: &Scene<D>, positions: &[Point<D>]) -> Vec<Point<D>> {
    let pushed = scene.contacts.iter().filter(|contact| contact.surface.free_direction().is_some());
    pushed.filter_map(|_| positions.last().copied()).collect()
}

/// Adds the contacts of a scene to a model whose positions have the carriages behind the particles.
pub(super) fn add<const D: usize>(
    scene: &Scene<D>,
    positions: &[Point<D>],
    rows: &Constraints,
    volume: f64,
    skins: &Skins<'_, D>,
    model: &mut Model<D>,
) -> Result<Vec<Contact<D>>, Error> {
    let mut contacts = Vec::new();
    if scene.contacts.is_empty() && scene.meetings.is_empty() {
        return Ok(contacts);
    }
    // The softest body is the one that gives.
    let softer = |a: &&super::BodyOf<D>, b: &&super::BodyOf<D>| {
        initial_shear_modulus(&*a.material).total_cmp(&initial_shear_modulus(&*b.material))
    };
    let Some(softest) = scene.bodies.iter().min_by(softer) else { return Ok(contacts) };
    let material = &*softest.material;
    let (shear, bulk) = (initial_shear_modulus(material), initial_bulk_modulus(material));
    let particles = positions.len();
    let mut next = particles;
    for contact in &scene.contacts {
        let (cells, table) = (skins.part)(&contact.place)?;
        let carriage = contact.surface.free_direction().map(|_| {
            next += 1;
            next as u32 - 1
        });
        let skin = Skin::new(&cells, table, carriage)?;
        let law =
            RigidContact { skin, surface: contact.surface.clone(), carriage, stiffness: Stiffness::of(shear, bulk) };
        starts_outside(&law, model.unknowns(), contact)?;
        let law = Arc::new(law);
        let name = contact.surface.name.clone();
        contacts.push(Contact { name, term: model.terms().len(), law: Law::Rigid(law.clone()) });
        model.add(law);
        if let (Some(node), Drive::Pushed { force, amplitude, .. }) = (carriage, &contact.surface.drive) {
            model.add(Carriage { node: [node], force: *force, amplitude: amplitude.clone(), stiffness: shear });
        }
    }
    for meeting in &scene.meetings {
        let mut found = vec![(skins.part)(&meeting.first)?];
        if let Some(second) = &meeting.second {
            found.push((skins.part)(second)?);
        }
        // Pressures live on the finer side.
        let swapped = found.len() > 1 && found[1].0.points.groups.len() > found[0].0.points.groups.len();
        if swapped {
            found.reverse();
        }
        let faces: Vec<&BoundaryCells<D>> = found.iter().map(|(face, _)| face).collect();
        let chain = Chain::new(&faces, positions, skins.points)?;
        let bodies =
            found.iter().map(|(face, table)| Skin::new(face, table.clone(), None)).collect::<Result<_, _>>()?;
        let law = Arc::new(PairContact::new(bodies, &faces, chain, Stiffness::of(shear, bulk), particles));
        let name = meeting.name.clone();
        contacts.push(Contact { name, term: model.terms().len(), law: Law::Pair(law.clone(), swapped) });
        model.add(law);
    }
    if next > particles
        || !scene.meetings.is_empty()
        || !holds(rows, positions, !scene.kinematics.hoop_components().is_empty())
    {
        model.add(leash(model.positions(), volume, shear));
    }
    Ok(contacts)
}

/// Refuses a body that begins inside its surface.
fn starts_outside<const D: usize>(law: &RigidContact<D>, unknowns: usize, contact: &Touching<D>) -> Result<(), Error> {
    let rest = vec![0.0; unknowns];
    let placed = law.placed(&rest, 0.0);
    let mut deepest = (0.0, 0);
    for (point, x) in law.skin.table.positions().iter().enumerate() {
        let gap = placed.nearest(&*law.surface.shape, x).gap;
        if gap < deepest.0 {
            deepest = (gap, point);
        }
    }
    // Chords of a body and arcs of a surface that fits it differ by a hundredth of their spacing.
    let spacing = law.skin.hats.iter().map(|hat| hat.width).fold(0.0, f64::max);
    if -deepest.0 > SLACK * spacing {
        let at = law.skin.table.positions()[deepest.1].as_slice().to_vec();
        return Err(ContactError::Penetrates { contact: contact.label(), depth: -deepest.0, at }.into());
    }
    Ok(())
}

/// Depth at the start that is taken for a fit, as a part of the spacing.
const SLACK: f64 = 0.05;

/// Part of the shear modulus, over the square of the extent, that keeps free rigid motions regular: what the contact
/// then holds comes to rest with as small a factor per iteration.
const LEASH: f64 = 1e-6;

fn leash<const D: usize>(positions: &[Point<D>], volume: f64, shear: f64) -> Leash {
    let extent = positions.iter().fold(0.0f64, |e, x| e.max((x - positions[0]).norm()));
    let each = LEASH * shear * volume / (extent * extent * positions.len() as f64);
    Leash { nodes: (0..positions.len() as u32).map(|n| [n]).collect(), stiffness: vec![each; positions.len()] }
}

/// A rigid motion: a component at a point.
type Motion<const D: usize> = Box<dyn Fn(&Point<D>, usize) -> f64>;

/// Whether rows hold all rigid motions of a body.
pub(super) fn holds<const D: usize>(rows: &Constraints, positions: &[Point<D>], revolved: bool) -> bool {
    let extent = positions.iter().fold(0.0f64, |e, x| e.max((x - positions[0]).norm())).max(f64::MIN_POSITIVE);
    let centre = positions.iter().fold(Point::<D>::zeros(), |c, x| c + x) / positions.len().max(1) as f64;
    // Translations and turns at the nodes; bodies of revolution move along their axis alone.
    let mut motions: Vec<Motion<D>> = Vec::new();
    for axis in 0..D {
        if !revolved || axis > 0 {
            motions.push(Box::new(move |_, i| f64::from(u8::from(i == axis))));
        }
    }
    for a in 0..D {
        for b in a + 1..D {
            if !revolved {
                motions.push(Box::new(move |x, i| {
                    let y = (x - centre) / extent;
                    if i == a {
                        -y[b]
                    } else if i == b {
                        y[a]
                    } else {
                        0.0
                    }
                }));
            }
        }
    }
    if motions.is_empty() {
        return true;
    }
    let mut gram = nalgebra::DMatrix::<f64>::zeros(motions.len(), motions.len());
    for row in rows.rows() {
        let measure: f64 = row.entries.iter().map(|e| e.1.abs()).sum();
        let found: Vec<f64> = motions
            .iter()
            .map(|m| row.entries.iter().map(|&(k, c)| c * m(&positions[k / D], k % D)).sum::<f64>() / measure)
            .collect();
        for (a, x) in found.iter().enumerate() {
            for (b, y) in found.iter().enumerate() {
                gram[(a, b)] += x * y;
            }
        }
    }
    let values = gram.symmetric_eigenvalues();
    values.min() > 1e-8 * values.max().max(1e-3)
}

/// One boundary particle in contact or beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint<const D: usize> {
    /// Its place in the body at rest \[length\].
    pub reference: Point<D>,
    /// Where it is now \[length\].
    pub position: Point<D>,
    /// Pressure per current area \[stress\], zero or above: on the body, against the normal of the body.
    pub pressure: f64,
    /// Mean gap over its hat \[length\]; zero in contact.
    pub gap: f64,
    /// Traction per current area on the body \[stress\], friction included.
    pub traction: Point<D>,
    /// Force on the body that it carries \[force\].
    pub force: Point<D>,
    /// Whether it touches.
    pub touches: bool,
    /// Whether it touches and slides; what touches without friction does.
    pub slides: bool,
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
    /// Where no surface has the name, with those that there are; where the body lies on a profile beyond its open end; for a
    /// state of another problem.
    pub fn contact(&self, state: &State, name: &str) -> Result<ContactState<D>, Error> {
        state.check_lengths(&self.model, &self.rows)?;
        let contact = self.contact_named(name)?;
        let condensed = &state.condensed[contact.term];
        let law = match &contact.law {
            Law::Rigid(law) => law,
            Law::Pair(law, swapped) => return self.pair_contact(law, *swapped, state, condensed),
        };
        let view = View { displacement: &state.displacement, condensed, load: state.load };
        let mut found = ContactState {
            force: Point::zeros(),
            moment: Vector3::zeros(),
            extent: 0.0,
            travel: law.placed(&state.displacement, state.load).offset,
            points: Vec::with_capacity(law.skin.hats.len()),
        };
        let mut sizes = Vec::with_capacity(law.skin.hats.len());
        for (k, hat) in law.skin.hats.iter().enumerate() {
            let (nominal, friction) = law.pressure(k, condensed);
            let (mut area, mut width) = (0.0, 0.0);
            let particle = hat.particle as usize;
            let reference = self.model.positions()[particle];
            let moved = self.node_displacement(particle, state)?;
            let (mut force, mut moment) = (Point::<D>::zeros(), Vector3::zeros());
            let mut passed = None;
            let touch = law.touch(k, &view, |p, weight, nearest| {
                let (point, _) = hat.points[p];
                let x = law.skin.table.positions()[point as usize] + law.skin.displacement(point, &state.displacement);
                let f = Matrix3::identity() + law.skin.table.displacement_gradient(point as usize, &state.displacement);
                let normal = pad(&law.skin.table.normals()[point as usize]);
                let stretch = (cofactor(&f) * normal).norm();
                area += weight * stretch;
                // Along the meridian, without the hoop's stretch.
                let hoop = if law.skin.table.hoop_components().is_empty() { 1.0 } else { f[(2, 2)] };
                width += weight * stretch / hoop;
                let push = (nearest.normal * nominal + friction) * weight;
                if nearest.passed_end {
                    passed = Some(x);
                }
                force += push;
                moment += pad(&x).cross(&pad(&push));
            });
            let touches = law.touches(k, nominal, touch.gap);
            if let Some(at) = passed.filter(|_| touches) {
                let (contact, at, load) = (name.to_string(), at.as_slice().to_vec(), state.load);
                return Err(ContactError::PassedEnd { contact, at, load }.into());
            }
            if !touches {
                (force, moment) = (Point::zeros(), Vector3::zeros());
            }
            found.force += force;
            found.moment += moment;
            // The size of the hat now.
            sizes.push(if D == 3 { width } else { width / hat.area * hat.width });
            found.points.push(ContactPoint {
                reference,
                position: reference + moved,
                pressure: if touches { nominal * hat.area / area } else { 0.0 },
                gap: touch.gap,
                traction: force / area,
                force,
                touches,
                slides: touches && friction.norm() >= (1.0 - 1e-6) * law.surface.friction * nominal,
            });
        }
        found.extent = if D == 3 { touching(&found.points, &sizes) } else { width(&found.points) };
        Ok(found)
    }

    /// The work that friction has taken along a path on the surface of a name \[force·length\]: over its steps, the mean traction times
    /// the slip of each boundary particle.
    ///
    /// # Errors
    /// As [`contact`](Problem::contact).
    pub fn friction_work(&self, path: &EquilibriumPath, name: &str) -> Result<f64, Error> {
        let contact = self.contact_named(name)?;
        let Law::Rigid(law) = &contact.law else { return Ok(0.0) };
        let mut work = 0.0;
        let mut before: Option<Vec<(Point<D>, Point<D>)>> = None;
        for state in std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state)) {
            state.check_lengths(&self.model, &self.rows)?;
            let condensed = &state.condensed[contact.term];
            let view = View { displacement: &state.displacement, condensed, load: state.load };
            let now: Vec<_> = (0..law.skin.hats.len())
                .map(|hat| {
                    let touch = law.touch(hat, &view, |_, _, _| {});
                    (law.pressure(hat, condensed).1 * law.skin.hats[hat].area, touch.beside)
                })
                .collect();
            if let Some(before) = before {
                let steps = now.iter().zip(&before);
                work -= steps.map(|((f, u), (f0, u0))| 0.5 * (f + f0).dot(&(u - u0))).sum::<f64>();
            }
            before = Some(now);
        }
        Ok(work)
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
            points: Vec::with_capacity(law.hats()),
        };
        for cluster in 0..law.hats() {
            let (side, hat) = law.hat(cluster);
            let skin = &law.skins[side];
            let hat = &skin.hats[hat];
            let (meeting, nominal, force) = law.report(&state.displacement, condensed, cluster);
            let mut area = 0.0;
            let mut normal = Vector3::zeros();
            for &(point, weight) in &hat.points {
                let point = point as usize;
                let f = Matrix3::identity() + skin.table.displacement_gradient(point, &state.displacement);
                let outward = cofactor(&f) * pad(&skin.table.normals()[point]);
                area += weight * outward.norm();
                normal += outward * weight;
            }
            let particle = hat.particle as usize;
            let reference = self.model.positions()[particle];
            let position = reference + self.node_displacement(particle, state)?;
            let touches = nominal > 0.0;
            let pressure = nominal * hat.area / area;
            let inward = -normal.normalize() * pressure;
            let force = if swapped { -force } else { force };
            found.force += force;
            found.moment += pad(&position).cross(&pad(&force));
            found.points.push(ContactPoint {
                reference,
                position,
                pressure,
                gap: meeting.gap,
                traction: Point::from_fn(|i, _| inward[i]),
                force,
                touches,
                slides: touches,
            });
        }
        found.extent = width(&found.points[..law.skins[0].hats.len()]);
        Ok(found)
    }

    fn contact_named(&self, name: &str) -> Result<&Contact<D>, ContactError> {
        self.contacts.iter().find(|contact| contact.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.contacts.iter().map(|contact| contact.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_string() } else { known.join("; ") };
            ContactError::Unknown { asked: name.to_string(), known }
        })
    }
}

/// The sum of what touches.
fn touching<const D: usize>(points: &[ContactPoint<D>], sizes: &[f64]) -> f64 {
    points.iter().zip(sizes).filter(|(point, _)| point.touches).map(|(_, size)| size).sum()
}

/// The width of what touches along a chain of hats: between the last hat that touches and the next one the square of the pressure,
/// which falls in proportion to the distance from a smooth edge, is drawn on to zero.
fn width<const D: usize>(points: &[ContactPoint<D>]) -> f64 {
    let n = points.len();
    let between = |a: usize, b: usize| (points[a].position - points[b].position).norm();
    let mut width = 0.0;
    for k in 0..n {
        if !points[k].touches {
            continue;
        }
        for (beside, inner) in [(k.checked_sub(1), k + 1), (Some(k + 1), k.wrapping_sub(1))] {
            match beside.filter(|&b| b < n) {
                // The end of the boundary part.
                None => {}
                Some(b) if points[b].touches => width += 0.5 * between(k, b),
                Some(b) => {
                    let squares = |i: usize| points[i].pressure.powi(2);
                    let to_edge = if inner < n && points[inner].touches && squares(inner) > squares(k) {
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

fn pad<const D: usize>(p: &Point<D>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| if i < D { p[i] } else { 0.0 })
}
