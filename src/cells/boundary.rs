//! Facets on the boundary, and the trace functions of the particles on them.

use std::collections::HashMap;
use std::collections::HashSet;

use crate::each::Each;
use crate::error::GeometryError;
use crate::geometry::Point;
use crate::geometry::all_padded;
use crate::quadrature::Points;

/// Cosine between normals of facets below which they are faces of their own to contact: a trace function around a corner would be held up
/// by its mean gap on one face while the other goes in.
pub(crate) const CORNER: f64 = 0.6;

/// A value at a particle for the normal of a piece there.
type Facing<'a, const D: usize> = &'a dyn Fn(&Point<D>, &Point<D>) -> f64;

/// What a condition asks of the pieces of a boundary part.
#[derive(Clone, Copy, Default)]
pub struct TraceChoice<'a, const D: usize> {
    /// The facets whose middle this holds for; all without it.
    pub within: Option<&'a dyn Fn(&Point<D>) -> bool>,
    /// $|n\cdot e|$ at a particle for the normal of a piece there: where pieces meet, the one with the largest value owns the particle's
    /// equation.
    pub facing: Option<Facing<'a, D>>,
    /// For each piece, in their order, its particles whose equations belong to other ones; none without it.
    pub without: &'a [HashSet<u32>],
}

/// Boundary facets with the linear trace functions $\Theta_J$ of the particles on them.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryCells<const D: usize> {
    /// Points, weights and outward normals, grouped by facet between particles.
    pub points: Points<D>,
    /// At each point the particles with a nonzero trace function, and its value.
    pub traces: Vec<Vec<(u32, f64)>>,
}

impl<const D: usize> BoundaryCells<D> {
    /// Without facets.
    pub(crate) fn empty() -> Self {
        BoundaryCells { points: Points::empty(), traces: Vec::new() }
    }

    /// The facets of several pieces.
    pub(super) fn joined(pieces: Vec<Self>) -> Self {
        let mut all = BoundaryCells::empty();
        for piece in pieces {
            all.points.append(piece.points);
            all.traces.extend(piece.traces);
        }
        all
    }

    /// Adds a point to a facet.
    pub(super) fn push(&mut self, at: Point<D>, weight: f64, normal: Point<D>, traces: Vec<(u32, f64)>) {
        self.points.push(at, weight);
        self.points.normals.push(normal);
        self.traces.push(traces);
    }

    /// The mean outward normals at the particles, weighted by their trace functions; none for particles without a trace function.
    pub(crate) fn normals_at_particles(&self) -> HashMap<u32, Point<D>> {
        let mut normals = HashMap::new();
        for ((traces, normal), weight) in self.traces.iter().zip(&self.points.normals).zip(&self.points.weights) {
            for &(particle, trace) in traces {
                *normals.entry(particle).or_insert_with(Point::<D>::zeros) += normal * (trace * weight);
            }
        }
        normals.retain(|_, normal| normal.norm() > 0.0);
        normals.values_mut().for_each(|normal| *normal /= normal.norm());
        normals
    }

    /// The same with three components.
    pub(crate) fn padded(&self) -> BoundaryCells<3> {
        let Points { positions, weights, normals, groups } = &self.points;
        let [positions, normals] = [positions, normals].map(|all| all_padded(all));
        let points = Points { positions, weights: weights.clone(), normals, groups: groups.clone() };
        BoundaryCells { points, traces: self.traces.clone() }
    }

    /// The mean of the points of each facet.
    pub(crate) fn middles(&self) -> Vec<Point<D>> {
        let groups = self.points.groups.windows(2).enumerate().filter(|(_, group)| group[0] < group[1]);
        groups.map(|(group, _)| self.points.middle(group)).collect()
    }

    /// The facets whose middle a predicate holds for.
    pub(crate) fn within(&self, holds: &dyn Fn(&Point<D>) -> bool) -> Self {
        self.facets(&|_, middle| holds(middle))
    }

    /// The facets whose number and middle a predicate holds for.
    pub(crate) fn facets(&self, holds: &dyn Fn(usize, &Point<D>) -> bool) -> Self {
        self.of_chosen(self.points.clone().in_groups(holds))
    }

    /// The points whose number a predicate holds for.
    pub(crate) fn at_points(&self, holds: &dyn Fn(usize) -> bool) -> Self {
        self.of_chosen(self.points.clone().chosen(&|point, _| holds(point)))
    }

    fn of_chosen(&self, (points, numbers): (Points<D>, Vec<usize>)) -> Self {
        BoundaryCells { points, traces: numbers.mapped(|&k| self.traces[k].clone()) }
    }

    /// Refuses arrays that do not fit together, numbers that are not finite, and trace functions of particles beyond `particles`.
    ///
    /// # Errors
    /// [`GeometryError::Count`] and [`Invalid`](crate::error::Invalid) in these cases.
    pub fn validate(&self, particles: usize) -> Result<(), GeometryError> {
        self.points.validate()?;
        let wrong = |what, count, needed| Err(GeometryError::Count { what, count, needed });
        if self.traces.len() != self.points.positions.len() {
            return wrong("lists in BoundaryCells::traces", self.traces.len(), "give one for each boundary point");
        }
        match self.traces.iter().flatten().find(|trace| trace.0 as usize >= particles) {
            Some(&(particle, _)) => {
                wrong("particle in BoundaryCells::traces", particle as usize, "name particles that exist")
            }
            None => Ok(()),
        }
    }
}
