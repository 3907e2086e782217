//! Errors of geometry, cells and rules.

use thiserror::Error;

use super::{Invalid, SolidError};

/// What is wrong with a shape, a lattice or an integration rule.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A block, map or polygon has no positive extent.
    #[error("{what} along axis {axis} is {value:e}: give finite corners with max > min")]
    Degenerate {
        /// The object.
        what: &'static str,
        /// The axis, counted from 0.
        axis: usize,
        /// The offending extent.
        value: f64,
    },
    /// A count is too small or too large.
    #[error("{what}: {count} given, {needed}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many were given.
        count: usize,
        /// What would be accepted.
        needed: &'static str,
    },
    /// A number is NaN, infinite or out of its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// A closed surface can't be told or read.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// A cell of the background partition is inverted.
    #[error(
        "cell {cell} has measure {measure:e}: the particles at its corners are out of order; reduce the jitter or the distortion of the map, or give the particles other cells (in the plane cells::Voronoi)"
    )]
    InvertedCell {
        /// Index of the cell.
        cell: usize,
        /// Its signed measure.
        measure: f64,
    },
    /// The points of one group see more nodes between them than a table can hold.
    #[error("group {group} of points sees {nodes} nodes, at most {limit} fit into one: close groups more often")]
    CrowdedGroup {
        /// The group, counted from 0.
        group: usize,
        /// Nodes that its points see between them.
        nodes: usize,
        /// How many may be seen.
        limit: usize,
    },
    /// A boundary part does not exist.
    #[error("no boundary part {part}: name one of this domain, {known}")]
    UnknownPart {
        /// The part requested.
        part: String,
        /// The parts that exist.
        known: String,
    },
    /// A planar shape or the particles in it are unusable.
    #[error("{what}, at X = {at:?}: {remedy}")]
    Shape {
        /// What is wrong.
        what: &'static str,
        /// Where.
        at: Vec<f64>,
        /// What to do.
        remedy: &'static str,
    },
    /// A wall is thinner than particles of a spacing can follow.
    #[error(
        "a wall of thickness {thickness:e} at X = {at:?} is thinner than half the particle spacing {spacing:e}: give a spacing of at most {needed:e}"
    )]
    ThinWall {
        /// Its thickness \[length\].
        thickness: f64,
        /// Where.
        at: Vec<f64>,
        /// The particle spacing \[length\].
        spacing: f64,
        /// A spacing that follows it \[length\].
        needed: f64,
    },
    /// A wall has fewer spacings across it than requested, however often a lattice may be halved.
    #[error(
        "a wall of thickness {thickness:e} at X = {at:?} has no {across} spacings of particles across it where {spacing:e} is halved as often as it may be: give a spacing of at most {needed:e}, fewer spacings across walls, or Scheme::graded there in place of Scheme::across"
    )]
    WallAcross {
        /// Its thickness \[length\].
        thickness: f64,
        /// Where.
        at: Vec<f64>,
        /// Spacings across it that are requested.
        across: usize,
        /// The largest particle spacing \[length\].
        spacing: f64,
        /// One that follows it \[length\].
        needed: f64,
    },
    /// The cells can't serve what is requested of them.
    #[error("{what}: these cells can't serve it, it needs {needed}")]
    Unsuited {
        /// What was requested.
        what: &'static str,
        /// What it needs.
        needed: &'static str,
    },
    /// The kinematics does not fit the domain.
    #[error("{what} at X = {at:?}: {remedy}")]
    Kinematics {
        /// What is wrong.
        what: &'static str,
        /// Where.
        at: Vec<f64>,
        /// What to do.
        remedy: &'static str,
    },
}
