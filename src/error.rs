//! Errors: one small enum per floor and one umbrella.
//!
//! Each message says where, what, and what to do about it.

mod contact;
mod mesh;

pub use contact::ContactError;
pub use mesh::MeshError;

use thiserror::Error;

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
    #[error("{what} = {value:e}: {needed}")]
    Number {
        /// The quantity.
        what: &'static str,
        /// The value given.
        value: f64,
        /// What would be accepted.
        needed: &'static str,
    },
    /// A cell of the background partition is inverted.
    #[error(
        "cell {cell} has measure {measure:e}: the particles at its corners are out of order; reduce the jitter or the distortion of the map"
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
    #[error("no boundary part {part}: this domain has {known}")]
    UnknownPart {
        /// The part asked for.
        part: String,
        /// The parts that exist.
        known: String,
    },
    /// A drawn shape or the particles in it are unusable.
    #[error("{what}, at X = {at:?}: {remedy}")]
    Shape {
        /// What is wrong.
        what: &'static str,
        /// Where.
        at: Vec<f64>,
        /// What to do.
        remedy: &'static str,
    },
    /// The cells can't serve what is asked of them.
    #[error("{what}: these cells can't serve it, it needs {needed}")]
    Unsuited {
        /// What was asked.
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

/// What is wrong with particles or shape functions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ApproximationError {
    /// The normalised dilation is too small.
    #[error(
        "normalised dilation r = {r} (6.1): particles see only themselves at r <= 0.5 and the moment matrix is singular there; use r >= 0.6, or 1.0 for a linear and 1.3 for a quadratic basis"
    )]
    Dilation {
        /// The value given.
        r: f64,
    },
    /// A support is not positive and finite.
    #[error(
        "support of particle {particle} is {value:e}: dilations are finite lengths above zero; derive them from the spacing with r >= 0.6 (6.1)"
    )]
    Support {
        /// The particle.
        particle: usize,
        /// The dilation given.
        value: f64,
    },
    /// Particles are missing, not finite, or coincide.
    #[error("particle {particle}: {what}; {remedy}")]
    Particle {
        /// The particle.
        particle: usize,
        /// What is wrong.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Arrays of different length describe the same particles.
    #[error("{what}: {given} entries for {particles} particles; give one for each")]
    Length {
        /// The array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The number of particles.
        particles: usize,
    },
    /// Too few particles cover a point.
    #[error(
        "X = {at:?} is covered by {covering} particles, the basis has {needed} terms: raise the dilation there (r >= 0.6 for a linear basis on a lattice, 1.1 for a quadratic one) or add particles"
    )]
    Uncovered {
        /// The point.
        at: Vec<f64>,
        /// Particles whose support holds the point.
        covering: usize,
        /// Terms of the basis.
        needed: usize,
    },
    /// The moment matrix is singular to working precision.
    #[error(
        "moment matrix at X = {at:?} has reciprocal condition {rcond:e} < {limit:e} ({covering} particles cover the point): if they are few or nearly on a line or plane, raise the dilation there or add particles off that line; if they are many, supports are too wide or the kernel too narrow for their spacing: lower the dilation (r of 1 to 3) or take a wider kernel"
    )]
    Singular {
        /// The point.
        at: Vec<f64>,
        /// Reciprocal condition number in the 1-norm.
        rcond: f64,
        /// The bound it fell below.
        limit: f64,
        /// Particles whose support holds the point.
        covering: usize,
    },
    /// A kernel, a basis or shape functions of one's own have values that nothing can be made of.
    #[error("{what} is {value:e} at {at}: {remedy}")]
    Function {
        /// The function.
        what: &'static str,
        /// Its value or slope, or the parameter that makes it unusable.
        value: f64,
        /// Where: a point or a normalised distance.
        at: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A point is not finite.
    #[error("evaluation point X = {at:?} is not finite")]
    Point {
        /// The point.
        at: Vec<f64>,
    },
    /// A point lies outside the body.
    #[error("X = {at:?} lies outside of the body: evaluate inside it")]
    Outside {
        /// The point.
        at: Vec<f64>,
    },
}

/// What is wrong with a material.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A constant is out of its range.
    #[error("material constant {name} = {value:e}: {needed}")]
    Constant {
        /// The constant's name.
        name: String,
        /// The value given.
        value: f64,
        /// What would be accepted.
        needed: &'static str,
    },
    /// No constants were given.
    #[error("no material constants: give at least one term A_mn with m + n >= 1 (2.9)")]
    Empty,
}

/// What is wrong with loads or essential conditions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BoundaryError {
    /// A component is beyond the dimension.
    #[error("{what}: component {component} asked for, the displacement has {dimension}")]
    Component {
        /// The condition or load.
        what: String,
        /// The component.
        component: usize,
        /// Displacement components of the scene.
        dimension: usize,
    },
    /// Two conditions give one unknown different values.
    #[error(
        "conditions {first} and {second} prescribe component {component} at X = {at:?} with different values {values:?}: remove one or make them equal there"
    )]
    Conflict {
        /// The earlier condition.
        first: String,
        /// The later condition.
        second: String,
        /// The component.
        component: usize,
        /// Where.
        at: Vec<f64>,
        /// Both values.
        values: [f64; 2],
    },
    /// A row is a combination of others.
    #[error(
        "row {row} ({what}) depends on the rows before it (pivot {pivot:e}): each prescribed component may be given once; remove the repeated condition"
    )]
    Dependent {
        /// The row.
        row: usize,
        /// The condition it comes from.
        what: String,
        /// Relative size of what is left of the row.
        pivot: f64,
    },
    /// A prescribed value moves a point of a body of revolution to its axis or beyond.
    #[error(
        "{what} takes X = {at:?} to radius {radius} at load factor {load}, to the axis of revolution or beyond: prescribe values that leave it off the axis"
    )]
    BeyondAxis {
        /// The condition.
        what: String,
        /// The point.
        at: Vec<f64>,
        /// The radius it would have.
        radius: f64,
        /// The load factor.
        load: f64,
    },
    /// A call of the builder has nothing to act on.
    #[error("{what}: {remedy}")]
    Misplaced {
        /// What was called where.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A load or target is not finite.
    #[error("{what}: value {value:e} at load factor {load}; give finite numbers")]
    Value {
        /// The load or condition.
        what: String,
        /// The value.
        value: f64,
        /// The load factor.
        load: f64,
    },
    /// A selection holds nothing.
    #[error("{what} selects no particle; the nearest one is at X = {nearest:?}")]
    Empty {
        /// The selection.
        what: String,
        /// The nearest particle.
        nearest: Vec<f64>,
    },
    /// No row comes from the condition asked for.
    #[error("no condition {asked}: give the label of one, word by word; there are {known}")]
    UnknownCondition {
        /// The label asked for.
        asked: String,
        /// The labels of the rows that there are.
        known: String,
    },
    /// A load acts beside the body.
    #[error("{what}: X = {at:?} lies outside of the body; give a point in it")]
    Outside {
        /// The load.
        what: String,
        /// Where.
        at: Vec<f64>,
    },
    /// An enforcement can't serve the rows asked of it.
    #[error("{enforcement}: {reason}")]
    Unsuitable {
        /// The enforcement.
        enforcement: &'static str,
        /// Why, and what to take instead.
        reason: String,
    },
    /// An amplitude table is unusable.
    #[error("amplitude table: {what}; give at least two (load factor, value) pairs with growing, finite load factors")]
    Amplitude {
        /// What is wrong.
        what: &'static str,
    },
}

/// What went wrong in the linear algebra.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LinearError {
    /// The matrix is singular or not definite enough for the method.
    #[error("factorisation failed at pivot {pivot}: {hint}")]
    Pivot {
        /// Index of the pivot, where the method knows it.
        pivot: usize,
        /// What this usually means.
        hint: &'static str,
    },
    /// The solution is not finite or does not satisfy the equations.
    #[error(
        "relative residual {residual:e} after the linear solve: the matrix is singular to working precision; a rigid motion may be left free"
    )]
    Residual {
        /// ‖b − A x‖ / ‖b‖, NaN where the solution is not finite.
        residual: f64,
    },
    /// A sparsity pattern is malformed.
    #[error("pattern, column {column}: {what}; build it with Pattern::from_columns")]
    Pattern {
        /// The column.
        column: usize,
        /// What a pattern keeps.
        what: &'static str,
    },
    /// A vector or a list of values has the wrong length.
    #[error("{what} has {given} entries, the matrix {needed}")]
    Length {
        /// The vector.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// The problem is too large for the index type or the method.
    #[error("{what}: {size} is beyond the limit {limit}; {remedy}")]
    Size {
        /// What is too large.
        what: &'static str,
        /// Its size.
        size: usize,
        /// The limit.
        limit: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// The solver library reported something else.
    #[error("sparse solver: {what}")]
    Library {
        /// The library's words.
        what: String,
    },
}

/// What went wrong in an analysis.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The first guess is inverted somewhere.
    #[error(
        "J = {jacobian:e} at X = {at:?} in the first state: start from a state with J > 0 everywhere (zero displacement is one)"
    )]
    InvertedStart {
        /// det F.
        jacobian: f64,
        /// Where.
        at: Vec<f64>,
    },
    /// A vector has the wrong length.
    #[error("{what} has {given} entries, the model {needed}")]
    Length {
        /// The vector.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// The nodes of a cluster fall or repeat.
    #[error(
        "term {term} of the model, cluster {cluster}: Term::nodes() does not rise; list each node once, by rising index"
    )]
    Nodes {
        /// The term, counted from 0.
        term: usize,
        /// Its cluster, counted from 0.
        cluster: usize,
    },
    /// A setting is out of its range.
    #[error("{what} = {value:e}: {needed}")]
    Setting {
        /// The setting.
        what: &'static str,
        /// The value given.
        value: f64,
        /// What would be accepted.
        needed: &'static str,
    },
    /// The model has nothing to solve.
    #[error("the model has no {what}: {remedy}")]
    Empty {
        /// What is missing.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A path that is to be resumed was recorded with another problem.
    #[error(
        "the last state of the path, at load factor {load}, is none of this problem: {what} {value:.1e}; resume with the scene and the scheme that it was recorded with"
    )]
    OtherProblem {
        /// What gave it away.
        what: &'static str,
        /// By how much.
        value: f64,
        /// Load factor of the state.
        load: f64,
    },
    /// The analysis ended before its last load, though further steps may well be found.
    #[error("ended at load factor {load} after {steps} converged steps: {why}")]
    BrokenOff {
        /// Load factor of the last converged state.
        load: f64,
        /// Converged steps.
        steps: usize,
        /// Who broke off.
        why: &'static str,
    },
    /// The analysis stalled before its last load.
    #[error("stalled at load factor {load} after {steps} converged steps: {why}")]
    Stalled {
        /// Load factor of the last converged state.
        load: f64,
        /// Converged steps.
        steps: usize,
        /// The reason of the last rejected step.
        why: String,
    },
}

/// What went wrong while writing or reading results.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Columns or fields have different lengths.
    #[error("{what}: {given} values where {needed} are needed")]
    Length {
        /// The column or field.
        what: String,
        /// Values given.
        given: usize,
        /// Values needed.
        needed: usize,
    },
    /// A journal holds something else than it should.
    #[error("{path}, line {line}: {what}")]
    Journal {
        /// The file.
        path: String,
        /// The line, from 1; 0 for the file as a whole.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// Nothing that could be drawn.
    #[error("chart {title}: {what}")]
    Chart {
        /// The chart's title.
        title: String,
        /// What is wrong.
        what: String,
    },
}

/// Any error of this crate.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// Geometry, cells, rules.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Meshes and their files.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Particles and shape functions.
    #[error(transparent)]
    Approximation(#[from] ApproximationError),
    /// Materials.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Loads and conditions.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// Contact.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Linear algebra.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// Newton and stepping.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Files and charts.
    #[error(transparent)]
    Output(#[from] OutputError),
}
