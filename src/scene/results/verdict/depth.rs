//! Bodies that lie deep in rigid surfaces.

use std::f64::consts::PI;
use std::fmt;

use crate::contact::RigidContact;
use crate::error::{Doubt, DoubtCause};
use crate::geometry::{Point, padded};
use crate::solve::State;
use crate::term::View;

use crate::scene::{Contact, Problem};

use super::energy::elastic;
use super::volume::LARGEST_SHARE;

/// The largest depth as a part of the width of a trace function, which is the spacing of the boundary particles: half of it is the
/// distance from a particle to the middle between two, so that what lies deeper has passed between them.
const DEEPEST: f64 = 0.5;

/// Doubts about contacts in which points of the boundary lie behind the rigid surface by more than their particles resolve, or which the
/// trace functions do not resolve: the tip of a tool between particles is in the mean of no gap.
pub(super) fn unresolved<const D: usize>(problem: &Problem<D>, state: &State) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    if !problem.contacts.iter().any(|contact| judged(problem, contact, state).is_some()) {
        return doubts;
    }
    let energies = elastic(&problem.view(), state);
    let body_of = |particle: u32| {
        problem.discrete_bodies.iter().position(|body| body.nodes.contains(&(particle as usize))).unwrap_or(0)
    };
    for contact in &problem.contacts {
        let Some((law, view)) = judged(problem, contact, state) else { continue };
        let Depths { deepest, lacking, at } = depths(law, &view, (energies.len(), &body_of));
        let mut doubt = |cause: DoubtCause, at: &Point<3>| {
            doubts.push(Doubt { cause, load: state.load, at: law.contact_surface.coordinates(at) });
        };
        if let Some((depth, limit, at)) = deepest {
            let fixed = fixed_inside(problem).iter().any(|inside| inside.surface == contact.name);
            doubt(DoubtCause::Depth { contact: contact.name.clone(), depth, limit, fixed }, &at);
        }
        // Each body by itself: what another one stores says nothing about it.
        let shares = lacking.iter().zip(&energies);
        let share = shares.map(|(lacking, energy)| lacking / (lacking + (energy.shape + energy.volume).max(0.0)));
        let share = share.filter(|share| !share.is_nan()).fold(0.0, f64::max);
        if share > LARGEST_SHARE {
            doubt(DoubtCause::Overlap { contact: contact.name.clone(), share, limit: LARGEST_SHARE }, &at);
        }
    }
    doubts
}

/// A contact with a rigid surface and its part of a state; none while the overlap of an interference is not resolved yet.
fn judged<'a, const D: usize>(
    problem: &Problem<D>,
    contact: &'a Contact,
    state: &'a State,
) -> Option<(&'a RigidContact, View<'a>)> {
    let law = contact.law.rigid()?;
    let begins_inside = law.law.interference.is_some_and(|fit| !fit.resolved && state.load < fit.until);
    Some((law, problem.model.view(state, contact.term).filter(|_| !begins_inside)?))
}

/// A particle of a contact whose displacement is prescribed in all components, and which ends deep in the rigid surface: no displacement of
/// the rest of the body brings it out.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedInside {
    /// The rigid surface.
    pub surface: String,
    /// Where the particle is in the undeformed body \[length\].
    pub at: Vec<f64>,
    /// How deep it lies at the end of the load \[length\].
    pub depth: f64,
    /// The depth that its trace function resolves \[length\].
    pub limit: f64,
}

impl fmt::Display for FixedInside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FixedInside { surface, at, depth, limit } = self;
        write!(
            f,
            "{surface} ends {depth:.3e} behind the particle at X = {at:?}, whose displacement is prescribed (resolved: {limit:.3e}): move or \
             shorten the surface, or end the prescribed part before it"
        )
    }
}

/// The deepest such particle of each rigid surface that is not pushed by a force.
pub(crate) fn fixed_inside<const D: usize>(problem: &Problem<D>) -> Vec<FixedInside> {
    let mut displacement = vec![0.0; problem.model().unknowns()];
    for equation in problem.equations().equations() {
        let sum: f64 = equation.entries.iter().map(|entry| entry.1).sum();
        // Equations of one component: the value that they give to their own particle.
        if sum.abs() > 0.5 * equation.measure() {
            displacement[equation.dependent] = equation.target * equation.amplitude.value(1.0) / sum;
        }
    }
    let mut found = Vec::new();
    for contact in &problem.contacts {
        let Some(law) = contact.law.rigid() else { continue };
        if law.rigid_dof.is_some() {
            continue;
        }
        let placed = law.placed(&displacement, 1.0);
        let fixed =
            law.contact_surface.traces.iter().filter(|trace| {
                (0..D).all(|component| problem.equations().prescribes(trace.particle as usize, component))
            });
        let inside = fixed.map(|trace| {
            let node = trace.particle as usize;
            let x = problem.model().point::<D>(node);
            let moved = x + Point::<D>::from_fn(|i, _| displacement[node * D + i]);
            (-placed.nearest(&*law.surface.shape, &padded(&moved)).gap, DEEPEST * trace.width, x)
        });
        let deep = inside.filter(|(depth, limit, _)| depth > limit).max_by(|a, b| a.0.total_cmp(&b.0));
        found.extend(deep.map(|(depth, limit, x)| FixedInside {
            surface: contact.name.clone(),
            at: x.as_slice().to_vec(),
            depth,
            limit,
        }));
    }
    found
}

/// What lies behind a rigid surface.
struct Depths {
    /// Depth, largest allowed one and undeformed position of the point that exceeds its limit most.
    deepest: Option<(f64, f64, Point<3>)>,
    /// The energy that the state lacks in each body, and where most of it.
    lacking: Vec<f64>,
    at: Point<3>,
}

/// Depths of the points under all trace functions.
///
/// To press out a wave of the surface with the amplitude $a$ and the wave length $4w$ takes an energy of $\tfrac{\pi}{4w}\mu a^2$ per
/// area. Over the trace functions, with the area of each that lies behind the surface, the depth of its deepest point and its width, that is
/// the energy that the state lacks, but for the depth $pw/(4\pi\mu)$ that a pressure $p$ gives to waves no longer than the width.
fn depths(law: &RigidContact, view: &View<'_>, (bodies, body_of): (usize, &dyn Fn(u32) -> usize)) -> Depths {
    let mut found = Depths { deepest: None, lacking: vec![0.0; bodies], at: Point::zeros() };
    let (mut worst, mut largest) = (1.0, 0.0);
    for (k, trace) in law.contact_surface.traces.iter().enumerate() {
        let (mut area, mut depth, mut deepest) = (0.0, 0.0, Point::<3>::zeros());
        law.local_contact(k, view, |p, _, at| {
            if at.found.gap < 0.0 {
                area += trace.points[p].1;
            }
            if -at.found.gap > depth {
                depth = -at.found.gap;
                deepest = law.contact_surface.table.positions[at.point as usize];
            }
        });
        let limit = DEEPEST * trace.width;
        if depth > worst * limit {
            worst = depth / limit;
            found.deepest = Some((depth, limit, deepest));
        }
        // What is less is left by convergence.
        if depth < f64::EPSILON.sqrt() * trace.width {
            continue;
        }
        let shear = law.law.stiffness.decisive;
        let pressure = law.law.pressure(k, view.condensed).0.max(0.0);
        let unexplained = (depth - pressure * trace.width / (4.0 * PI * shear)).max(0.0);
        let own = 0.25 * PI * shear * unexplained * unexplained * area / trace.width;
        found.lacking[body_of(trace.particle)] += own;
        if own > largest {
            (largest, found.at) = (own, deepest);
        }
    }
    found
}
