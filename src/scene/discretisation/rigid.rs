//! Rigid bodies: faces tied to six degrees of freedom, three in the plane, held, moved or loaded.

use std::collections::HashSet;
use std::ops::Range;

use crate::boundary::{ConstraintEquation, Constraints};
use crate::cells::BoundaryCells;
use crate::each::Each;
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::{Bounds, Part, Point, all_padded, padded};
use crate::mesh::Mesh;
use crate::quadrature::Points;

use super::conditions::{Placed, TiedPrescription};
use super::frame::{RigidFrame, RigidShape};
use super::interface::shared;
use super::one_body::FINER;
use crate::scene::{BodyCells, Load, LoadKind, Place, Scene, Source, Spot};

impl<const D: usize> Scene<D> {
    /// The volumes of a body's mesh that are rigid bodies, or one of them: groups of cells that no faces have the name of.
    pub(crate) fn rigid_volumes(&self, body: &str, mesh: &Mesh<D>, one: Option<&str>) -> Vec<String> {
        let mut volumes = Vec::new();
        for (_, place) in self.rigids.iter().filter(|(name, _)| one.is_none_or(|one| one == name)) {
            let Place { spot: Spot::Part(Part::Named(name)), of, within } = self.resolve(place) else { continue };
            if within.is_empty() && of.is_none_or(|of| of == body) && mesh.is_volume(&name) {
                volumes.push(name);
            }
        }
        volumes.sort_unstable();
        volumes.dedup();
        volumes
    }

    /// The volumes of meshes that a rigid body stands for.
    fn rigid_shapes(&self, name: &str) -> Result<Vec<RigidShape>, Error> {
        let mut shapes = Vec::new();
        for body in &self.bodies {
            let Source::Mesh(mesh) = &body.source else { continue };
            for volume in self.rigid_volumes(&body.name, mesh, Some(name)) {
                let mesh = mesh.body(&volume)?;
                let cells = (0..mesh.cell_count()).map(|cell| mesh.lattice_corners(cell)).collect();
                shapes.push(RigidShape { points: all_padded(mesh.points()), cells });
            }
        }
        Ok(shapes)
    }

    /// The centroid of the parts that are tied to a rigid body, whatever ties them: of volumes where there are any, else of faces, else of
    /// particles.
    fn centre_of(&self, name: &str, all: &BodyCells<D>) -> Result<Point<3>, Error> {
        let what = || format!("rigid body {name}");
        let (mut by_dimension, mut bounds) = ([(0.0, Point::zeros()); 3], Bounds::none());
        let mut faces: Vec<(usize, BoundaryCells<3>)> = Vec::new();
        let mut add = |dimension: usize, x: &Point<D>, weight: f64| {
            let (sum, moment): &mut (f64, Point<3>) = &mut by_dimension[dimension];
            *sum += weight;
            *moment += padded(x) * weight;
        };
        for (_, place) in self.rigids.iter().filter(|rigid| rigid.0 == name) {
            let place = self.resolve(place);
            for body in self.bodies_at(&place, &what, all, &|_| true)? {
                let (cells, parts) = (&all[body].1, if place.within.is_empty() { 1 } else { FINER });
                let (dimension, points) = match &place.spot {
                    Spot::Part(part) => (1, cells.facet_points(part, parts, 2)?),
                    Spot::Body => (2, cells.gauss(2)?),
                    Spot::Point(at) => (0, Points::single(*at)),
                };
                bounds = Bounds::of(&points.positions);
                // Faces of two bodies that lie on each other count once.
                let mut counted = HashSet::new();
                if dimension == 1 {
                    let face = |points: Points<D>| BoundaryCells { points, traces: Vec::new() }.padded();
                    for (_, other) in faces.iter().filter(|other| other.0 != body) {
                        let [_, own] = shared(D, [other.clone(), face(points.clone())]).chosen;
                        counted.extend(own);
                    }
                    faces.push((body, face(points.clone().in_groups(&|_, x| place.holds(x)).0)));
                }
                for (_, group) in points.groups.windows(2).enumerate().filter(|group| !counted.contains(&group.0)) {
                    let points = points.positions[group[0]..group[1]].iter().zip(&points.weights[group[0]..group[1]]);
                    for (x, weight) in points.filter(|(x, _)| place.holds(x)) {
                        add(dimension, x, if dimension > 0 { weight * self.kinematics.measure(x) } else { *weight });
                    }
                }
                if let Spot::Body = place.spot {
                    cells.positions().iter().filter(|x| place.holds(x)).for_each(|x| add(0, x, 1.0));
                }
            }
        }
        let [low, high] = [bounds.low, bounds.high].map(|end| end.as_slice().to_vec());
        let Some((sum, moment)) = by_dimension.into_iter().rev().find(|(sum, _)| *sum > 0.0) else {
            return Err(BoundaryError::NoFacet { what: what(), low, high }.into());
        };
        Ok(moment / sum)
    }

    /// The names of the rigid bodies, each once.
    pub(crate) fn rigid_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in &self.rigids {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        names
    }

    /// The rigid body that a place is, by its number; and the point of it, where it is one.
    pub(crate) fn rigid_at(&self, place: &Place<D>) -> Option<(usize, Option<Point<3>>)> {
        let find = |requested: &str| self.rigid_names().iter().position(|name| *name == requested);
        match (&place.spot, &place.of) {
            (Spot::Part(Part::Named(name)), None) => Some((find(name)?, None)),
            (Spot::Point(at), Some(name)) => Some((find(name)?, Some(padded(at)))),
            _ => None,
        }
    }
}

/// Puts the frames of rigid bodies behind the rows that tie parts to them.
pub(crate) fn frames<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    (ties, at_ties): (&[(usize, Range<usize>)], &[TiedPrescription]),
    equations: &mut Constraints,
    placed: &mut Vec<Placed<D>>,
    positions: &mut Vec<Point<3>>,
) -> Result<Vec<RigidFrame>, Error> {
    let names = scene.rigid_names();
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let revolved = !scene.kinematics.hoop_components().is_empty();
    if D < 2 {
        let remedy = "a rigid ring keeps its radius: hold the end";
        return Err(Incompatible::new("a rigid body", "a radial line", remedy).into());
    }
    let particles = positions.len();
    let mut frames = Vec::with_capacity(names.len());
    for (number, name) in names.into_iter().enumerate() {
        let numbers = || ties.iter().filter(|tie| tie.0 == number).flat_map(|tie| tie.1.clone());
        let own: Vec<&ConstraintEquation> = numbers().filter_map(|k| equations.equations().get(k)).collect();
        let mut frame = RigidFrame::around(name, D, scene.centre_of(name, all)?, &own, positions)?;
        frame.shapes = scene.rigid_shapes(name)?;
        for k in numbers() {
            let entries = frame.counterpart(&equations.equations()[k], positions);
            equations.extend_equation(k, entries);
        }
        for (_, range) in ties.iter().filter(|tie| tie.0 == number) {
            let (name, nodes) = (Some(name.to_string()), 0..particles);
            placed.push(Placed { name, place: None, equations: range.clone(), nodes });
        }
        positions.extend(frame.positions());
        if revolved {
            frame.guide(equations)?;
        }
        frames.push(frame);
    }
    prescribe(scene, at_ties, revolved, &mut frames, equations, placed)?;
    Ok(frames)
}

/// Adds the rows of conditions on rigid bodies, and on particles that are tied to them.
fn prescribe<const D: usize>(
    scene: &Scene<D>,
    at_ties: &[TiedPrescription],
    revolved: bool,
    frames: &mut [RigidFrame],
    equations: &mut Constraints,
    placed: &mut Vec<Placed<D>>,
) -> Result<(), Error> {
    let places = scene.conditions.mapped(|condition| scene.resolve(&condition.place));
    let at = places.mapped(|place| scene.rigid_at(place));
    // First what is prescribed of bodies as a whole, which gives an equation for each node.
    let (whole, others): (Vec<usize>, Vec<usize>) =
        (0..places.len()).partition(|&condition| at[condition].is_some_and(|at| at.1.is_none()));
    for number in whole.into_iter().chain(others) {
        let (condition, place) = (&scene.conditions[number], &places[number]);
        for (rigid, frame) in frames.iter_mut().enumerate() {
            let first = equations.len();
            let tied = || at_ties.iter().filter(|tied| tied.condition == number && tied.rigid == rigid);
            let own = at[number].filter(|at| at.0 == rigid);
            if let Some((_, point)) = own {
                frame.prescribe(equations, condition, point, revolved)?;
            } else if place.is_all_of_body() && tied().next().is_some() {
                // What is tied to a body moves with all of it.
                frame.prescribe(equations, condition, None, revolved)?;
            }
            for TiedPrescription { at, unit, value, label, .. } in tied() {
                frame.prescribe_at(equations, (at, unit), value.clone(), label)?;
            }
            if first < equations.len() || own.is_some() {
                // By the name of the body results are those of its parts, which carry what its conditions do.
                let name = condition.name.clone().filter(|name| *name != frame.name);
                let (place, nodes) = (Some(place.clone()), frame.nodes());
                placed.push(Placed { name, place, equations: first..equations.len(), nodes });
            }
        }
    }
    Ok(())
}

/// Refuses rigid bodies where nodes are free that neither contacts nor springs may hold.
pub(crate) fn held<const D: usize>(scene: &Scene<D>, frames: &[RigidFrame], free: &[u32]) -> Result<(), Error> {
    let springs = |load: &Load<D>| matches!(load.kind, LoadKind::Integrand(_) | LoadKind::Pressure(_));
    let is_free = |frame: &&RigidFrame| free.iter().any(|&node| frame.nodes().contains(&(node as usize)));
    let Some(frame) = frames.iter().find(is_free).or(frames.first()) else { return Ok(()) };
    if free.is_empty() || scene.has_contact() || scene.loads.iter().any(springs) {
        return Ok(());
    }
    Err(BoundaryError::Free { name: frame.name.clone() }.into())
}
