//! Contact of a scene as terms.

use std::collections::HashSet;
use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::{ConstraintEquation, Constraints};
use crate::contact::{
    ArtificialSpring, ContactError, ContactLaw, ContactSurface, PairContact, RigidBodyDof, RigidContact, Stiffness,
    THROUGH, Trace, started,
};
use crate::each::Each;
use crate::error::{Error, Incompatible};
use crate::geometry::Point;
use crate::material::Material;
use crate::shape::FiniteElements;
use crate::table::ShapeTable;
use crate::term::View;

use super::discrete_body::DiscreteBody;
use super::facet_rule::{FacetRule, Facets};
use super::sharing::Sharing;
use crate::scene::Problem;
use crate::scene::definition::contact_definition::{Contact, ContactPair, Law};
use crate::scene::definition::place::{Place, Spot};
use crate::scene::definition::scene::Scene;
use crate::scene::definition::source::{BodyCells, BodyOf};

/// Number of surfaces that are pushed or free to turn.
pub(crate) fn rigid_dof_count<const D: usize>(scene: &Scene<D>) -> usize {
    scene.contacts.iter().filter(|contact| contact.surface.is_free()).count()
}

/// Where the contact surfaces of a scene come from: its bodies.
struct Bodies<'a, const D: usize> {
    scene: &'a Scene<D>,
    all: &'a BodyCells<D>,
    discrete_bodies: &'a [DiscreteBody<D>],
    rules: &'a [FacetRule],
    nodes: usize,
}

/// Adds the contacts of a scene to a model whose positions have the rigid-body degrees of freedom behind the particles.
pub(crate) fn contact_definition<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    (discrete_bodies, rules): (&[DiscreteBody<D>], &[FacetRule]),
    equations: &Constraints,
    positions: &[Point<3>],
    model: &mut Model,
) -> Result<Vec<Contact>, Error> {
    let mut contacts = Vec::new();
    if !scene.has_contact() {
        return Ok(contacts);
    }
    let bodies = Bodies { scene, all, discrete_bodies, rules, nodes: model.node_count() };
    // The softest body is the one that gives.
    let softer = |a: &&BodyOf<D>, b: &&BodyOf<D>| {
        a.material.initial_moduli().shear.total_cmp(&b.material.initial_moduli().shear)
    };
    let Some(softest) = scene.bodies.iter().min_by(softer) else { return Ok(contacts) };
    let shear = softest.material.initial_moduli().shear;
    // Pressures act on what a body gives least in, whichever it is.
    let bulk = scene.bodies.iter().map(|body| body.material.initial_moduli().bulk).fold(0.0, f64::max);
    let particles = positions.len();
    let moved = scene.moved(D * particles);
    let mut next = particles;
    let still = still(equations, D * particles, moved);
    let fixes =
        |particle: usize, i: usize| i < D && still.contains(&(particle * D + i)) && equations.prescribes(particle, i);
    for contact in &scene.contacts {
        let rigid_dof = contact.surface.is_free().then(|| {
            next += 1;
            next as u32 - 1
        });
        let contact_surface = bodies.surface(&contact.place, &|| contact.label(), rigid_dof)?;
        let stiffness = Stiffness::of(shear, bulk);
        let law = RigidContact::new(contact_surface, contact.surface.clone(), moved, rigid_dof, stiffness, fixes);
        let begun = started(moved, model.unknowns());
        if let Some(undefined) = law.undefined(&View::at_rest(&begun, 0.0)) {
            return Err(undefined.into());
        }
        if !contact.goes_on {
            begins_right(&law, &begun, scene.started.is_none(), || contact.label())?;
        }
        let (lever, law, term) = (law.lever, Arc::new(law), model.terms().len());
        contacts.push(Contact { name: contact.surface.name.clone(), term, law: Law::Rigid(law.clone()) });
        model.add_replicated(law);
        if let Some(node) = rigid_dof {
            let drive = contact.surface.drive.as_ref();
            let pushed = drive.and_then(|drive| Some((drive.force?, drive.amplitude.clone())));
            let turning = contact.surface.turning.as_ref().filter(|turning| turning.free);
            let turned = turning.map(|turning| (turning.amount / lever, turning.amplitude.clone()));
            let (node, loads) = ([node], [pushed, turned]);
            model.add_replicated(Arc::new(RigidBodyDof { dim: D, node, loads, stiffness: shear }));
        }
    }
    for contact_pair in &scene.contact_pairs {
        contacts.push(bodies.pair(contact_pair, positions, Stiffness::of(shear, bulk), model)?);
    }
    Ok(contacts)
}

/// Part of the largest displacement by which a condition of a later stage may move a particle that stays: what solutions are off by.
const STAYS: f64 = 1e-6;

/// The unknowns that equations over particles alone hold, there being `own` of them: neither rigid bodies nor what a stage prescribes anew
/// move these.
fn still(equations: &Constraints, own: usize, moved: &[f64]) -> HashSet<usize> {
    let rounding = STAYS * moved.largest(|u| u.abs());
    let holds = |equation: &&ConstraintEquation| {
        let begins = equation.entries.summed(|&(k, c)| c * moved.get(k).copied().unwrap_or(0.0));
        equation.entries.iter().all(|entry| entry.0 < own) && equation.stays_at(begins, rounding * equation.measure())
    };
    equations.equations().iter().filter(holds).map(|equation| equation.dependent).collect()
}

impl<const D: usize> Bodies<'_, D> {
    /// Adds the contact of two parts, or of one with itself.
    fn pair(
        &self,
        contact_pair: &ContactPair<D>,
        positions: &[Point<3>],
        stiffness: Stiffness,
        model: &mut Model,
    ) -> Result<Contact, Error> {
        let name = contact_pair.name.clone();
        let label = || format!("contact {name}");
        let mut faces = vec![self.surface(&contact_pair.first, &label, None)?];
        if let Some(second) = &contact_pair.second {
            let [first, other] = [&contact_pair.first, second].map(|place| self.scene.resolve(place));
            if first.takes_in(&other) && other.takes_in(&first) {
                return Err(ContactError::SameFace { contact: label(), place: second.to_string() }.into());
            }
            faces.push(self.surface(second, &label, None)?);
        }
        let law = ContactLaw::new(D, stiffness, contact_pair.friction, contact_pair.interference);
        let (law, swapped) = between(faces, positions, &law, self.scene.moved(D * positions.len()), &label)?;
        let fit = law.law.interference.filter(|fit| !fit.resolved);
        // Faces of one body come to look at each other where it folds.
        if self.scene.started.is_none() && fit.is_none() && self.joins_bodies(contact_pair) && law.looks_away() {
            let surface = &law.contact_surfaces[usize::from(swapped)];
            return Err(ContactError::FacesAway {
                contact: label(),
                at: surface.coordinates(&surface.table.positions[0]),
            }
            .into());
        }
        if !contact_pair.goes_on {
            let deepest = law.deepest(&started(self.scene.moved(D * positions.len()), model.unknowns()));
            starts_right(deepest, &law.contact_surfaces[0], fit.is_some(), label)?;
        }
        let (law, term) = (Arc::new(law), model.terms().len());
        model.add_replicated(law.clone());
        Ok(Contact { name, term, law: Law::Pair(law, swapped) })
    }

    /// Whether the faces of a pair are of two bodies.
    fn joins_bodies(&self, pair: &ContactPair<D>) -> bool {
        let body = |place: &Place<D>| self.scene.touching(place, self.all).ok().map(|found| found.0);
        pair.second.as_ref().is_some_and(|second| body(second) != body(&pair.first))
    }

    /// The contact surface at a place, of which there has to be a facet; its trace functions see the node of a rigid surface too.
    fn surface(
        &self,
        place: &Place<D>,
        label: &dyn Fn() -> String,
        rigid_dof: Option<u32>,
    ) -> Result<ContactSurface, Error> {
        let (body, at) = self.scene.touching(place, self.all)?;
        let Spot::Part(part) = &at.spot else {
            let contact = format!("contact of {at}");
            return Err(ContactError::NoFacet { contact, place: at.to_string() }.into());
        };
        let (discrete_body, rule) = (&self.discrete_bodies[body], self.rules[body]);
        let kinematics = &*self.scene.kinematics;
        let (mut cells, table) = match (discrete_body.facets, discrete_body.cells.lattice()) {
            // Faces of elements run beside a curved boundary.
            (Facets::OfElements { order, gauss }, Some(lattice)) => {
                let elements = FiniteElements::new(lattice.clone(), order)?;
                let (cells, points) = elements.contact_boundary(part, gauss, &|x| at.holds(x))?;
                (cells, ShapeTable::of_elements(&elements, &points, kinematics)?)
            }
            _ => {
                let whole = discrete_body.cells.contact_facets(part, rule.parts, rule.gauss)?;
                let cells = whole.within(&|x| at.holds(x));
                let table = ShapeTable::new(&*discrete_body.approximation, &cells.points, kinematics)?;
                (cells, table)
            }
        };
        if cells.points.positions.is_empty() {
            return Err(ContactError::NoFacet { contact: label(), place: place.to_string() }.into());
        }
        let first = discrete_body.nodes.start;
        cells.traces.iter_mut().flatten().for_each(|trace| trace.0 += first as u32);
        let mut surface = ContactSurface::new(&cells, &table.shifted(first, self.nodes), rigid_dof)?;
        if D == 1 {
            // The weight of a point is no length.
            for trace in &mut surface.traces {
                trace.width = discrete_body.cells.local_spacing(trace.particle as usize - first);
            }
        }
        Ok(surface)
    }
}

/// The contact of one face, or of two, and whether the second of these carries the pressures.
fn between(
    mut faces: Vec<ContactSurface>,
    positions: &[Point<3>],
    law: &ContactLaw,
    moved: &[f64],
    label: &dyn Fn() -> String,
) -> Result<(PairContact, bool), Error> {
    let mut nodes: Vec<u32> = Vec::new();
    for surface in &faces {
        for trace in &surface.traces {
            nodes.extend_from_slice(&trace.nodes);
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    let (particles, most) = (nodes.len(), usize::from(u16::MAX));
    if particles > most {
        return Err(ContactError::TooManyParticles { contact: label(), particles, most }.into());
    }
    let two = faces.len() > 1;
    let mut swapped = two && carries(&faces[1], &faces[0]);
    if swapped {
        faces.reverse();
    }
    let mut pair = PairContact::new(faces, nodes, positions, law.clone(), moved);
    if let Some(count) = pair.no_chord() {
        let with = format!("a facet of {count} trace functions in the plane");
        let remedy = "let boundary cells have facets from one particle to the next one";
        return Err(Incompatible::new("contact between deformable faces", with, remedy).into());
    }
    if pair.has_cut_facets() && two {
        // Nothing can be pressed against this face, but it may be pressed against the other one.
        let (mut faces, nodes) = (pair.contact_surfaces, pair.nodes);
        faces.reverse();
        swapped = !swapped;
        pair = PairContact::new(faces, nodes, positions, law.clone(), moved);
    }
    if pair.has_cut_facets() {
        let remedy = "mesh the body that is pressed against, or press it against a rigid surface";
        return Err(Incompatible::new("contact against a deformable face", "facets cut from a lattice", remedy).into());
    }
    Ok((pair, swapped))
}

/// Whether a face is to carry the pressures rather than another one: the smaller one, whose trace functions lie on the other one as a whole;
/// of two that differ by less than a facet the finer one.
fn carries(face: &ContactSurface, other: &ContactSurface) -> bool {
    let [facets, its_facets] = [face, other].map(|face| face.table.clusters.count());
    let most = facets.max(its_facets) as f64;
    let alike = (face.area - other.area).abs() * most < face.area.max(other.area);
    if alike { facets > its_facets } else { face.area < other.area }
}

/// Refuses a surface that is new where the body begins: one of a first stage that the part does not look at, and one that it begins in or, where
/// an interference is to be resolved, apart from. What a later stage begins with may lie in the surface between particles, as in one that this
/// surface is in place of: there the means count.
fn begins_right(law: &RigidContact, begun: &[f64], is_first: bool, label: impl Fn() -> String) -> Result<(), Error> {
    let fitted = law.law.interference.is_some();
    if is_first && !fitted {
        looks_at(law, begun.len(), &label)?;
    }
    let deepest = if is_first || fitted { deepest(law, begun, 0.0) } else { deepest_mean(law, begun) };
    starts_right(deepest, &law.contact_surface, fitted, label)
}

/// Refuses a surface that no facet of the part looks at: it would be met from behind, through the body.
fn looks_at(law: &RigidContact, unknowns: usize, label: impl Fn() -> String) -> Result<(), Error> {
    let placed = law.placed(&vec![0.0; unknowns], 0.0);
    let table = &law.contact_surface.table;
    let away =
        |(x, normal): (&Point<3>, &Point<3>)| placed.nearest(&*law.surface.shape, x).normal.dot(normal) > THROUGH;
    if table.len() > 0 && table.positions.iter().zip(&table.normals).all(away) {
        let at = law.contact_surface.coordinates(&table.positions[0]);
        return Err(ContactError::FacesAway { contact: label(), at }.into());
    }
    Ok(())
}

/// Refuses a body that begins inside what it may touch, and an interference of what begins apart.
fn starts_right(
    deepest: Option<(f64, Point<3>)>,
    surface: &ContactSurface,
    fitted: bool,
    label: impl Fn() -> String,
) -> Result<(), Error> {
    // Chords of a body and arcs of a surface that fits it differ by a hundredth of their spacing.
    let spacing = surface.traces.iter().map(|trace| trace.width).fold(0.0, f64::max);
    match deepest {
        Some((depth, at)) if !fitted && depth > SLACK * spacing => {
            Err(ContactError::Penetrates { contact: label(), depth, at: surface.coordinates(&at) }.into())
        }
        deepest if fitted && deepest.is_none_or(|(depth, _)| !(depth > 0.0)) => {
            let gap = deepest.map_or(f64::INFINITY, |(depth, _)| -depth);
            Err(ContactError::NoOverlap { contact: label(), gap }.into())
        }
        _ => Ok(()),
    }
}

/// How deep the body is in a rigid surface at a load factor where it begins, and where.
fn deepest(law: &RigidContact, displacement: &[f64], load: f64) -> Option<(f64, Point<3>)> {
    let placed = law.placed(displacement, load);
    let table = &law.contact_surface.table;
    let place = |point: usize| law.contact_surface.place(point as u32, displacement);
    let depth = |point: usize| (-placed.nearest(&*law.surface.shape, &place(point)).gap, table.positions[point]);
    (0..table.len()).map(depth).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The same of the mean gaps of trace functions at load factor 0.
fn deepest_mean(law: &RigidContact, displacement: &[f64]) -> Option<(f64, Point<3>)> {
    let view = View::at_rest(displacement, 0.0);
    let (surface, gap) = (&law.contact_surface, |trace: usize| law.local_contact(trace, &view, |_, _, _| {}).gap);
    let depth = |(k, trace): (usize, &Trace)| (-gap(k), surface.table.positions[trace.points[0].0 as usize]);
    surface.traces.iter().enumerate().map(depth).max_by(|a, b| a.0.total_cmp(&b.0))
}

impl<const D: usize> Problem<D> {
    /// Rigid surfaces that stay farther from the body than it is large, by their motion and by what moves the body, with what to do.
    pub(crate) fn out_of_reach(&self, moved: f64) -> Vec<String> {
        let positions = self.positions();
        let extent = positions.iter().fold(0.0f64, |e, x| e.max((x - positions[0]).norm()));
        let apart = |contact: &Contact| {
            let law = contact.law.rigid()?;
            if law.surface.is_free() {
                return None;
            }
            let rest = vec![0.0; self.model.unknowns()];
            let nearest = (0..=16).filter_map(|k| deepest(law, &rest, f64::from(k) / 16.0));
            let (depth, at) = nearest.max_by(|a, b| a.0.total_cmp(&b.0))?;
            (-depth - moved > extent).then(|| {
                format!(
                    "rigid surface `{}` comes no nearer than {:.3e} to X = {:?}: it never touches; move it to the body, or leave it out",
                    contact.name,
                    -depth,
                    law.contact_surface.coordinates(&at)
                )
            })
        };
        self.contacts.iter().filter_map(apart).collect()
    }
}

/// Depth at the start that is taken for a fit, as a part of the spacing.
const SLACK: f64 = 0.05;

/// Part of the shear modulus, over the square of the extent, that keeps free rigid motions regular: what the contact
/// then holds comes to rest with as small a factor per iteration.
const FREE_MOTION_STIFFNESS: f64 = 1e-6;

/// Keeps the nodes regular that nothing but contact holds.
pub(crate) fn hold_free<const D: usize>(
    free: &[u32],
    discrete_bodies: &[DiscreteBody<D>],
    sharing: &Sharing,
    model: &mut Model,
) {
    if free.is_empty() {
        return;
    }
    let (mut volume, mut shear) = ([0.0], f64::INFINITY);
    for discrete_body in discrete_bodies {
        shear = discrete_body.body.material().initial_moduli().shear.min(shear);
        for weight in discrete_body.body.table().weights() {
            volume[0] += weight;
        }
    }
    sharing.total(&mut volume);
    let (nodes, mut extent) = (model.node_count(), 0.0f64);
    for node in 0..nodes {
        let both = model.coordinates(node).iter().zip(model.coordinates(0));
        extent = extent.max(both.map(|(x, first)| (x - first) * (x - first)).sum::<f64>().sqrt());
    }
    let each = FREE_MOTION_STIFFNESS * shear * volume[0] / (extent * extent * nodes as f64);
    let nodes = free.mapped(|&node| [node]);
    model.add_replicated(Arc::new(ArtificialSpring { dim: D, nodes, stiffness: vec![each; free.len()] }));
}
