//! What is wrong with a mesh.

use thiserror::Error;

/// What is wrong with a mesh or the file that it comes from.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file can't be read.
    #[error("{path}: {what}")]
    Read {
        /// The file.
        path: String,
        /// The system's reason.
        what: String,
    },
    /// The file is of another format or version.
    #[error(
        "mesh format {found}: this crate reads Gmsh's MSH 2.2 and 4.1, ASCII and binary; save with `gmsh part.geo -3 -format msh41`"
    )]
    Version {
        /// What the file says it is.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends within ${section}, at byte {at}: it was not completely written or copied; save it again")]
    Truncated {
        /// The section.
        section: &'static str,
        /// Bytes read.
        at: usize,
    },
    /// The file holds something else than its format says.
    #[error("${section}, byte {at}: {what}; save the mesh again with Gmsh")]
    Malformed {
        /// The section.
        section: &'static str,
        /// Bytes read.
        at: usize,
        /// What is wrong.
        what: String,
    },
    /// An element of a kind that is not read.
    #[error(
        "element {element} is of Gmsh's type {kind}, which is not supported: mesh with points, lines, triangles, quadrangles, tetrahedra, hexahedra and prisms of first and second order"
    )]
    Kind {
        /// The element's number in the file.
        element: u64,
        /// Gmsh's number of the kind.
        kind: i64,
    },
    /// An element names a node that the mesh does not have.
    #[error("element {element} names node {node}, which the mesh does not have: export nodes and elements together")]
    DanglingNode {
        /// The element: its number in a file, else its place counted from 0.
        element: u64,
        /// The node.
        node: u64,
    },
    /// A node is given twice.
    #[error("node {node} is given twice: number nodes once each (in Gmsh: renumber on saving)")]
    DuplicateNode {
        /// The node.
        node: u64,
    },
    /// Two nodes of one body are at one place.
    #[error(
        "nodes {nodes:?} are both at X = {at:?}, and the mesh is not connected there: merge them (in Gmsh: Coherence Mesh), or read the bodies separately (Mesh::body)"
    )]
    CoincidentNodes {
        /// The nodes, counted from 0.
        nodes: [usize; 2],
        /// Where.
        at: Vec<f64>,
    },
    /// A cell is turned inside out or flat.
    #[error(
        "cell {cell} of the mesh, a {shape}, has a Jacobian of {measure:e} at X = {at:?}: it is inverted or flat; mesh again, finer or with Gmsh's mesh optimisation"
    )]
    InvertedCell {
        /// The cell, counted from 0.
        cell: usize,
        /// Its shape.
        shape: &'static str,
        /// The Jacobian \[length^d\].
        measure: f64,
        /// One of its corners.
        at: Vec<f64>,
    },
    /// Cells of another dimension than the one requested.
    #[error("{what}: {remedy}")]
    Dimension {
        /// What was found.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A group does not exist.
    #[error("no {what} is named {}: the mesh has {known}", if name.trim().is_empty() { "\"\"" } else { name.as_str() })]
    MissingGroup {
        /// What was looked for: a body, a face, a group.
        what: &'static str,
        /// The name.
        name: String,
        /// What there is.
        known: String,
    },
    /// A number is not finite or an array does not fit.
    #[error("{what}: {remedy}")]
    Array {
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
}
