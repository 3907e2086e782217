//! What is wrong with a closed surface or the file that it comes from.

use thiserror::Error;

/// What is wrong with the surface of a solid.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SolidError {
    /// The file can't be read.
    #[error("{path}: {what}")]
    Read {
        /// The file.
        path: String,
        /// The system's reason.
        what: String,
    },
    /// The file ends too early.
    #[error("the file ends at byte {at} within {inside}: it was not completely written or copied; save it again")]
    Truncated {
        /// What it ends in.
        inside: &'static str,
        /// Bytes read.
        at: usize,
    },
    /// The file holds something else than its format says.
    #[error("byte {at}: {what}; export the surface again")]
    Malformed {
        /// Bytes read.
        at: usize,
        /// What is wrong.
        what: String,
    },
    /// There is nothing that a surface could enclose.
    #[error("{what}: {remedy}")]
    Empty {
        /// What is empty.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A facet names a vertex that does not exist.
    #[error(
        "facet {facet} names vertex {vertex}, but there are {count}: vertices are counted from 0, give those of all facets"
    )]
    DanglingVertex {
        /// The facet, counted from 0.
        facet: usize,
        /// The vertex.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// Openings too large to be closed automatically.
    #[error(
        "the surface is open: {edges} edges belong to one facet only; the largest opening, of area {area:.3e}, is at X = {at:?}: close it in the program that made the surface"
    )]
    Open {
        /// Number of open edges.
        edges: usize,
        /// Area of the largest opening \[length²\].
        area: f64,
        /// A point on its edge.
        at: [f64; 3],
    },
    /// An edge bounds facets that do not separate inside from outside.
    #[error(
        "{facets} facets meet at the edge at X = {at:?} and do not separate inside from outside: remove walls of no thickness inside the solid"
    )]
    Branching {
        /// How many facets.
        facets: usize,
        /// The middle of the edge.
        at: [f64; 3],
    },
    /// The facets can't be turned so that all face outwards.
    #[error("the surface is one-sided, at X = {at:?} for instance: draw one that has an inside and an outside")]
    OneSided {
        /// The middle of an edge where the sides change.
        at: [f64; 3],
    },
    /// Facets cross each other.
    #[error(
        "the surface crosses itself: {count} pairs of facets intersect, the first are {facets:?} at X = {at:?}; unite the parts (boolean union) in the program that made the surface"
    )]
    Crossing {
        /// How many pairs.
        count: usize,
        /// The first pair, as facets of the surface that was given.
        facets: [usize; 2],
        /// A point of both.
        at: [f64; 3],
    },
    /// The spacing is too wide for a shape.
    #[error(
        "a spacing of {spacing:.3e} is too wide for the shape at X = {at:?}, where edges or walls are closer together: give a finer one"
    )]
    Coarse {
        /// Where.
        at: [f64; 3],
        /// The spacing.
        spacing: f64,
    },
    /// A closed part that separates no inside from an outside, whichever way parts face.
    #[error(
        "at X = {at:?} a closed part of the surface separates no inside from an outside, whichever way parts are turned: separate parts that touch along an edge, or leave it out"
    )]
    Nested {
        /// A point of the part.
        at: [f64; 3],
    },
    /// A name that selects no facet.
    #[error("{name:?} selects no facet by {by}: {nearest}")]
    NothingSelected {
        /// The name.
        name: String,
        /// How it selects.
        by: String,
        /// The nearest match, and what to do.
        nearest: String,
    },
}
