//! Errors of loads and conditions.

use thiserror::Error;

/// What is wrong with loads or essential conditions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BoundaryError {
    /// A component is beyond the dimension.
    #[error(
        "{what}: component {component} requested, the displacement has {dimension}; give one below, the first is 0"
    )]
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
        "row {equation} ({what}) depends on the rows before it (pivot {pivot:e}): each prescribed component may be given once; remove the repeated condition"
    )]
    Dependent {
        /// The row.
        equation: usize,
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
    /// A place names no body of the scene.
    #[error("no body {requested}; there are: {known}")]
    UnknownBody {
        /// The name requested.
        requested: String,
        /// The names that there are.
        known: String,
    },
    /// Nothing holds a rigid body and what it is tied to.
    #[error("rigid body {name} may move without any force: hold it, or the bodies that it is tied to")]
    Free {
        /// The rigid body.
        name: String,
    },
    /// Two bodies share a name.
    #[error("two bodies are called {name}: give each a name of its own")]
    NamedTwice {
        /// The name.
        name: String,
    },
    /// Two bodies lie in each other.
    #[error(
        "bodies {first} and {second} overlap, at X = {at:?} for instance: move one of them, cut it, or let a press fit resolve it \
         (Scene::press_fit)"
    )]
    Overlap {
        /// The one.
        first: String,
        /// The other.
        second: String,
        /// A point in both.
        at: Vec<f64>,
    },
    /// A name is empty.
    #[error("{what} has an empty name: give it one, by which results can be requested")]
    Nameless {
        /// What is called so.
        what: &'static str,
    },
    /// Two stages share a name.
    #[error("two stages are called {name}: give each a name of its own")]
    StageTwice {
        /// The name.
        name: String,
    },
    /// A face does not say of which body it is.
    #[error("{what}: say of which body, by Place::of; there are: {known}")]
    Ambiguous {
        /// The condition or load.
        what: String,
        /// The bodies that there are.
        known: String,
    },
    /// A condition says where, but not what.
    #[error("{what} prescribes nothing: add a component, a direction or a displacement")]
    Incomplete {
        /// The condition.
        what: String,
    },
    /// A condition acts where its direction is none.
    #[error(
        "{what}: the direction is undefined at X = {at:?}, its vector there is {vector:?}: give a vector of finite length that is not zero; normals exist on boundaries only, directions around an axis off that axis only"
    )]
    Direction {
        /// The condition.
        what: String,
        /// Where.
        at: Vec<f64>,
        /// The vector there.
        vector: Vec<f64>,
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
    /// A load acts on nothing.
    #[error(
        "{what} acts on no point of integration; its part lies between X = {low:?} and {high:?}: let the predicate hold there"
    )]
    NoFacet {
        /// The load.
        what: String,
        /// The least coordinates of the part.
        low: Vec<f64>,
        /// The largest ones.
        high: Vec<f64>,
    },
    /// No row comes from the condition requested.
    #[error("no condition acts on {requested}; {}", acting(known))]
    UnknownCondition {
        /// The name or place requested.
        requested: String,
        /// The names and places of the conditions that there are.
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
    /// An enforcement can't serve the rows requested of it.
    #[error("{enforcement}: {reason}")]
    Unsuitable {
        /// The enforcement.
        enforcement: &'static str,
        /// Why, and what to take instead.
        reason: String,
    },
    /// An amplitude table is unusable.
    #[error(
        "amplitude table of {of}: {what}; give at least two (load factor, value) pairs with growing, finite load factors"
    )]
    Amplitude {
        /// What follows it.
        of: String,
        /// What is wrong.
        what: &'static str,
    },
}

/// What a message says of the conditions that there are.
fn acting(known: &str) -> String {
    if known.is_empty() {
        "there is none: add one, or hold the part".to_string()
    } else {
        format!("name one that does: {known}")
    }
}
