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
    /// A closed surface is unusable or can't be read.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// A cell of the background partition is inverted.
    #[error(
        "cell {cell} is inverted or flat, its volume (area, length) is {measure:e}: reduce the jitter or the distortion of the map, swap two axes of a map that mirrors, or take other cells (in the plane cells::Voronoi)"
    )]
    InvertedCell {
        /// Index of the cell.
        cell: usize,
        /// Its signed length, area or volume.
        measure: f64,
    },
    /// The points of one group have more nodes together than a table can hold.
    #[error(
        "the points of group {group} have {nodes} nodes together, a group takes at most {limit}: make groups smaller (Points::close_group)"
    )]
    CrowdedGroup {
        /// The group, counted from 0.
        group: usize,
        /// Nodes whose shape functions are nonzero at its points.
        nodes: usize,
        /// The most that a group may have.
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
    /// A wall is too thin for the particle spacing.
    #[error(
        "the wall at X = {at:?} is {thickness:e} thick, less than half the particle spacing {spacing:e}: give a spacing of at most {needed:e}, or refine there by Scheme::across or Scheme::graded"
    )]
    ThinWall {
        /// Its thickness \[length\].
        thickness: f64,
        /// Where.
        at: Vec<f64>,
        /// The particle spacing \[length\].
        spacing: f64,
        /// A spacing that resolves it \[length\].
        needed: f64,
    },
    /// Conditions leave the particles in a wall fewer displacements than its pressures need.
    #[error(
        "the body at X = {at:?} is about {thickness:e} thick, and conditions leave it {displacements:.1} displacements for {pressures} pressures: it would be far too stiff; halve the cells there, by a spacing of at most {spacing:e} or more particles, or allow it by Scheme::thin_walls"
    )]
    LockedWall {
        /// A place in it.
        at: Vec<f64>,
        /// Its thickness \[length\].
        thickness: f64,
        /// Pressures of the zone there.
        pressures: usize,
        /// Displacements that conditions leave free there.
        displacements: f64,
        /// A spacing that suffices \[length\].
        spacing: f64,
    },
    /// A wall has fewer spacings across it than requested, even with the finest local refinement.
    #[error(
        "the wall at X = {at:?} is {thickness:e} thick and cannot have {across} particle spacings across it, even with the finest local refinement of the spacing {spacing:e}: give a spacing of at most {needed:e}, refine there by Scheme::graded, in a solid request fewer spacings by Scheme::across, or leave walls as they are by Scheme::thin_walls without Scheme::across"
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
        /// One that suffices \[length\].
        needed: f64,
    },
    /// Walls are left with few spacings across: to refine them takes too many particles to be done unasked.
    #[error(
        "the wall at X = {at:?} is {thickness:e} thick and was not refined at the spacing {spacing:e}, because all walls together would take more than 10 000 further particles: bonded or bent, its stiffness is far off; give a spacing of {needed:e} there by Scheme::graded or everywhere, or accept the wall by Scheme::thin_walls"
    )]
    ThinLeft {
        /// Its thickness \[length\].
        thickness: f64,
        /// Where.
        at: Vec<f64>,
        /// The particle spacing there \[length\].
        spacing: f64,
        /// One that suffices \[length\].
        needed: f64,
    },
    /// A part of a boundary has an empty name.
    #[error("{what} has an empty name: give it a name, by which conditions and results find it")]
    Nameless {
        /// What has no name.
        what: &'static str,
    },
    /// These cells, or this place, do not support a feature.
    #[error("{what} is not supported by these cells: it needs {needed}")]
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
