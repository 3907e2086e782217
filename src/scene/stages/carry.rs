//! How a stage begins where the one before ended.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use crate::boundary::{ConstraintEquation, Constraints};
use crate::each::{Each, add};
use crate::error::{Error, Incompatible};
use crate::linear::vector::dot;
use crate::scene::{DiscreteBody, Problem};
use crate::solve::State;
use crate::term::{Amplitude, Element, Layout, Term, TermState, View};

use super::StagePath;
use super::turning::{Deviation, deviations};

/// Iterations of conjugate gradients for the forces that conditions carry; each condition takes a few.
const MOST: usize = 2000;
/// What they leave of the forces along the conditions.
const LEFT: f64 = 1e-13;

/// The first state of a stage after others, with conditions that begin where the body is and forces that fall with the load factor.
pub(super) fn start<const D: usize>(done: &[StagePath<D>], problem: &mut Problem<D>) -> Result<State, Error> {
    let Some(StagePath { problem: before, path, .. }) = done.last() else { return Ok(problem.at_rest()) };
    let state = path.last();
    // A path of another history.
    state.check_lengths(before.model(), before.equations())?;
    expands_as_before(before, problem)?;
    let mut next = State { time: state.time, ..problem.at_rest() };
    carry_displacement(before, state, problem, &mut next)?;
    for body in 0..problem.discrete_bodies.len() {
        next.terms[body].clone_from(&state.terms[body]);
    }
    for contact in &problem.contacts {
        let same = before.contacts.iter().find(|other| other.name == contact.name);
        let Some(other) = same else { continue };
        let (given, to) = (&state.terms[other.term].condensed, &mut next.terms[contact.term].condensed);
        if given.len() == to.len() {
            to.clone_from(given);
            continue;
        }
        // With friction now and none before, say: pressures and tractions go on, and slips begin anew.
        let [(now, all), (was, before)] = [contact, other].map(|contact| contact.law.unknowns());
        for trace in 0..if all == before { all } else { 0 } {
            let (to, given) = (&mut to[trace * now..][..now], &given[trace * was..][..was]);
            to.iter_mut().zip(given).for_each(|(to, given)| *to = *given);
        }
    }
    begin_slips(problem, &mut next);
    let deviations = deviations(done, problem, &next.displacement);
    begin_at(&mut problem.equations, &deviations, &next.displacement);
    let left = carry_multipliers(before, state, problem, &mut next)?;
    let nodes: Vec<[u32; 1]> = (0..problem.model.node_count() as u32).map(|node| [node]).collect();
    problem.model.add_replicated(Arc::new(Fading::<D> { nodes, forces: left }));
    next.terms.push(TermState::default());
    Ok(next)
}

/// Lets slips begin where the bodies are: what has moved past a surface before it was there has not slipped on it. Contacts that go on
/// remember the same state.
fn begin_slips<const D: usize>(problem: &Problem<D>, next: &mut State) {
    for contact in &problem.contacts {
        let term = &problem.model.terms()[contact.term];
        let mut history = std::mem::take(&mut next.terms[contact.term].history);
        term.update(problem.model.at_own(&*next).view(contact.term), &mut history);
        next.terms[contact.term].history = history;
    }
}

/// Refuses another free expansion than that of the stage before: it acts in full from the first step on.
fn expands_as_before<const D: usize>(before: &Problem<D>, problem: &Problem<D>) -> Result<(), Incompatible> {
    let alike = |(body, other): (&DiscreteBody<D>, &DiscreteBody<D>)| {
        let (table, other) = (body.body.table(), other.body.table());
        table.positions() != other.positions() || (0..table.point_count()).all(|k| table.at_rest(k) == other.at_rest(k))
    };
    let remedy = "give it from the first stage on; for a change of temperature in steps solve a run for each";
    let all = problem.discrete_bodies.iter().zip(&before.discrete_bodies);
    ensure!(all.into_iter().all(alike), Incompatible::new("another free expansion", "a later stage", remedy));
    Ok(())
}

/// Takes over the displacements of particles, of surfaces that are pushed, and of rigid bodies.
fn carry_displacement<const D: usize>(
    before: &Problem<D>,
    state: &State,
    problem: &Problem<D>,
    next: &mut State,
) -> Result<(), Error> {
    let particles = |problem: &Problem<D>| problem.discrete_bodies.iter().map(|body| body.nodes.len()).sum::<usize>();
    let count = particles(problem);
    let moved = |node: usize| before.model.coordinates(node) != problem.model.coordinates(node);
    ensure!(
        particles(before) == count && !(0..count).any(moved),
        Incompatible::new(
            "a stage with other particles",
            "the stage before",
            "a stage changes conditions, loads and contacts alone: give bodies and places of other particles from the start"
        )
    );
    next.displacement[..D * count].copy_from_slice(&state.displacement[..D * count]);
    let mut take = |to: Range<usize>, from: Range<usize>| {
        next.displacement[to].copy_from_slice(&state.displacement[from]);
    };
    let pushed = |problem: &Problem<D>, name: &str| {
        let node = problem.contacts.iter().find(|contact| contact.name == name)?.law.rigid_dof()?;
        Some(D * node..D * (node + 1))
    };
    for contact in &problem.contacts {
        if let (Some(to), Some(from)) = (pushed(problem, &contact.name), pushed(before, &contact.name)) {
            take(to, from);
        }
    }
    let new = problem.frames.iter().find(|frame| !before.frames.iter().any(|other| other.name == frame.name));
    if let Some(frame) = new {
        let remedy = "tie parts to rigid bodies in the first stage; hold or load them in later ones";
        return Err(Incompatible::new(format!("rigid body {}", frame.name), "a later stage", remedy).into());
    }
    // Frames of fewer or more ties have other nodes.
    problem.transfer_frames(before, state, next);
    Ok(())
}

/// Lets prescribed values begin where the body is: what they are off by at load factor 0 falls with the load factor, and rigid bodies turn.
fn begin_at(equations: &mut Constraints, deviations: &HashMap<usize, Deviation>, displacement: &[f64]) {
    let mut off = Vec::new();
    equations.violation(displacement, 0.0, &mut off);
    let mut break_points = Vec::new();
    for (number, (equation, off)) in equations.equations_mut().zip(off).enumerate() {
        let (target, amplitude, deviation) =
            (equation.target, equation.amplitude.clone(), deviations.get(&number).cloned());
        let turns = deviation.is_some();
        let value = move |load: f64| {
            let deviation = deviation.as_ref().map_or(0.0, |deviation| deviation(load));
            target * amplitude.value(load) - off * (1.0 - load) + deviation
        };
        equation.amplitude = match &equation.amplitude {
            amplitude if turns => {
                break_points.extend(amplitude.break_points());
                Amplitude::Function(Arc::new(value))
            }
            // Straight lines stay straight.
            Amplitude::Ramp | Amplitude::Constant => Amplitude::Table(vec![(0.0, value(0.0)), (1.0, value(1.0))]),
            Amplitude::Table(pairs) => {
                let inner = pairs.iter().map(|pair| pair.0).filter(|load| *load > 0.0 && *load < 1.0);
                let loads = std::iter::once(0.0).chain(inner).chain([1.0]);
                Amplitude::Table(loads.map(|load| (load, value(load))).collect())
            }
            Amplitude::Function(_) => Amplitude::Function(Arc::new(value)),
        };
        equation.target = 1.0;
    }
    equations.add_break_points(break_points);
}

/// Takes over the multipliers of equations that the stage before had too, and finds those of others and those that keep the shapes of rigid
/// bodies: where conditions have kept a shape, these tell nothing. Gives the forces that are left.
fn carry_multipliers<const D: usize>(
    before: &Problem<D>,
    state: &State,
    problem: &Problem<D>,
    next: &mut State,
) -> Result<Vec<f64>, Error> {
    let key =
        |equation: &ConstraintEquation| -> Vec<(usize, u64)> { equation.entries.mapped(|&(k, c)| (k, c.to_bits())) };
    let known = before.equations.equations().iter().map(key).zip(state.multipliers.iter().copied());
    let known: HashMap<Vec<(usize, u64)>, f64> = known.collect();
    let add = |left: &mut [f64], row: &[(usize, f64)], multiplier: f64| {
        row.iter().for_each(|&(k, c)| left[k] += c * multiplier);
    };
    let mut left = problem.model.at(&*next)?.residual();
    let (mut rows, mut new) = (Vec::new(), Vec::new());
    for (number, equation) in problem.equations.equations().iter().enumerate() {
        match known.get(&key(equation)) {
            Some(multiplier) => {
                add(&mut left, &equation.entries, *multiplier);
                next.multipliers[number] = *multiplier;
            }
            None => {
                rows.push(&equation.entries[..]);
                new.push(number);
            }
        }
    }
    let shapes = problem.frames.mapped(|frame| (frame.rigidity, frame.shape_rows(&next.displacement)));
    for (_, (own, _)) in shapes.iter().filter(|(term, _)| term.is_some()) {
        rows.extend(own.iter().map(|row| &row[..]));
    }
    let found = carried(&rows, &left);
    for (row, multiplier) in rows.iter().zip(&found) {
        add(&mut left, row, *multiplier);
    }
    let (of_new, mut shaping) = found.split_at(new.len());
    new.iter().zip(of_new).for_each(|(number, multiplier)| next.multipliers[*number] = *multiplier);
    for (term, (own, scale)) in &shapes {
        let Some(term) = *term else { continue };
        let (mine, others) = shaping.split_at(own.len());
        next.terms[term].condensed[1..].copy_from_slice(&mine.mapped(|multiplier| multiplier * scale));
        shaping = others;
    }
    Ok(left)
}

/// The multipliers of rows that leave least of forces, $\min_\mu|f + G^T\mu|$, by conjugate gradients on $GG^T$ from zero.
fn carried(rows: &[&[(usize, f64)]], forces: &[f64]) -> Vec<f64> {
    let against = |x: &[f64]| -> Vec<f64> { rows.mapped(|row| -row.summed(|&(k, c)| c * x[k])) };
    let mut left = forces.to_vec();
    let mut multipliers = vec![0.0; rows.len()];
    let mut along = against(&left);
    let mut step = along.clone();
    let mut size = dot(&along, &along);
    let first = size;
    for _ in 0..MOST {
        if !(size > LEFT * LEFT * first) {
            break;
        }
        let mut change = vec![0.0; forces.len()];
        for (row, step) in rows.iter().zip(&step) {
            row.iter().for_each(|&(k, c)| change[k] += c * step);
        }
        let part = size / dot(&change, &change);
        add(&mut left, part, &change);
        add(&mut multipliers, part, &step);
        along = against(&left);
        let next = dot(&along, &along);
        let ratio = next / size;
        step.iter_mut().zip(&along).for_each(|(step, along)| *step = along + ratio * *step);
        size = next;
    }
    multipliers
}

/// Forces $(1 - \lambda)\\,f_0$ that a stage takes away.
struct Fading<const D: usize> {
    nodes: Vec<[u32; 1]>,
    forces: Vec<f64>,
}

impl<const D: usize> Term for Fading<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        self.nodes.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.nodes[cluster]
    }

    fn layout(&self) -> Layout {
        Layout { has_matrix: false, follows_load: false, ..Layout::default() }
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        for i in 0..D {
            let force = self.forces[cluster * D + i];
            out.residual[i] -= (1.0 - view.load) * force;
            out.load_slope[i] += force;
        }
    }
}
