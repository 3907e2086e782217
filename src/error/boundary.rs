//! Errors of loads and conditions.

use thiserror::Error;

/// What is wrong with loads or essential conditions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BoundaryError {
    /// A component is beyond the dimension.
    #[error(
        "{what}: there is no component {component}, the displacement has {dimension}; components are counted from 0, give one below {dimension}"
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
    /// Conditions on two faces give different values to their common edge: that of the face whose normal is nearest to the direction
    /// holds there.
    #[error(
        "condition {owner} holds at X = {at:?}, on the edge where {other} prescribes component {component} too, values {values:?}: make them equal there, or let one of them change gradually towards the edge"
    )]
    Overruled {
        /// The condition that holds.
        owner: String,
        /// The other condition.
        other: String,
        /// The component.
        component: usize,
        /// Where.
        at: Vec<f64>,
        /// Both values.
        values: [f64; 2],
    },
    /// A constraint equation is a combination of others.
    #[error(
        "condition {what} is already implied by other conditions (constraint equation {equation}, pivot {pivot:e}): prescribe each component of a particle once; remove the repeated condition"
    )]
    Dependent {
        /// The constraint equation, counted from 0.
        equation: usize,
        /// The condition it comes from.
        what: String,
        /// What elimination leaves of the equation, relative to its size.
        pivot: f64,
    },
    /// A prescribed value moves a point of an axisymmetric body to its axis or beyond.
    #[error(
        "{what} moves X = {at:?} to radius {radius} at load factor {load}, onto the axis of symmetry or beyond it: prescribe values that keep the radius above zero"
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
    #[error(
        "no body is named {requested:?}; {}",
        there_are(known, "bodies", "leave the name out, or give names by Scene::body or Scene::rigid")
    )]
    UnknownBody {
        /// The name requested.
        requested: String,
        /// The names that there are.
        known: String,
    },
    /// Nothing supports a rigid body and the bodies that it is tied to.
    #[error(
        "rigid body {name} can move freely, without any force: fix it, or the bodies that it is tied to (Scene::hold)"
    )]
    Free {
        /// The rigid body.
        name: String,
    },
    /// Two bodies share a name.
    #[error("two bodies have the name {name}: give each a different name")]
    NamedTwice {
        /// The name.
        name: String,
    },
    /// A condition has the name of a part on which another one is.
    #[error(
        "the condition on {place} has the name of the part {name}, on which another condition is: give it another name"
    )]
    NameOfPart {
        /// The name.
        name: String,
        /// Where the condition is.
        place: String,
    },
    /// A condition elsewhere has the name of a rigid body.
    #[error("the condition on {place} has the name of the rigid body {name}: give it another name")]
    NameOfBody {
        /// The name.
        name: String,
        /// Where the condition is.
        place: String,
    },
    /// Two bodies overlap.
    #[error(
        "bodies {first} and {second} overlap, for instance at X = {at:?}: move or trim one of them, or model a press fit \
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
    /// Two bodies share a face that can't be bonded.
    #[error(
        "bodies {first} and {second} share a face, but a facet at X = {at:?} is too large to be bonded to those of the other body: give its body more particles there, or leave the two unbonded (Scene::unbonded)"
    )]
    Unmatched {
        /// The one.
        first: String,
        /// The other.
        second: String,
        /// The middle of the facet.
        at: Vec<f64>,
    },
    /// A name is empty.
    #[error("{what} has an empty name: give it a name, by which its results are found")]
    Nameless {
        /// What has no name.
        what: &'static str,
    },
    /// Two stages share a name.
    #[error("two stages have the name {name}: give each a different name")]
    StageTwice {
        /// The name.
        name: String,
    },
    /// The place does not name the body that it belongs to.
    #[error("{what}: this place exists on several bodies; name the body by Place::of. The bodies are: {known}")]
    Ambiguous {
        /// The condition, load or contact.
        what: String,
        /// The bodies that have it.
        known: String,
    },
    /// A condition prescribes nothing.
    #[error("{what} prescribes nothing: add a component, a direction or a displacement")]
    Incomplete {
        /// The condition.
        what: String,
    },
    /// A condition has no direction at a point where it acts.
    #[error(
        "{what}: the direction is undefined at X = {at:?}, where its vector is {vector:?}: give a finite vector that is not zero; normals exist on boundaries only, circumferential directions off their axis only"
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
    #[error("{what} has the value {value:e} at load factor {load}: give finite numbers")]
    Value {
        /// The load or condition.
        what: String,
        /// The value.
        value: f64,
        /// The load factor.
        load: f64,
    },
    /// A selection holds nothing.
    #[error(
        "{what} selects no particle: the nearest one is at X = {nearest:?}; let the selection include it, or name another part"
    )]
    Empty {
        /// The selection.
        what: String,
        /// The nearest particle.
        nearest: Vec<f64>,
    },
    /// A load acts on no integration point.
    #[error(
        "{what} acts nowhere: its `within` selects no integration point of its part, which lies between X = {low:?} and {high:?}; let it select points there"
    )]
    NoFacet {
        /// The load.
        what: String,
        /// The least coordinates of the part.
        low: Vec<f64>,
        /// The largest ones.
        high: Vec<f64>,
    },
    /// No condition has the name or acts at the place requested.
    #[error("no condition acts on {}; {}", if requested.trim().is_empty() { "\"\"" } else { requested.as_str() }, acting(requested, known))]
    UnknownCondition {
        /// The name or place requested.
        requested: String,
        /// The names and places of the conditions that there are.
        known: String,
    },
    /// Nothing that a scene could leave out or move has the name.
    #[error("no condition, load or contact has the name {requested:?}; {}", named(known))]
    UnknownName {
        /// The name requested.
        requested: String,
        /// The names that there are.
        known: String,
    },
    /// A load acts outside the body.
    #[error("{what}: X = {at:?} lies outside the body; give a point inside it")]
    Outside {
        /// The load.
        what: String,
        /// Where.
        at: Vec<f64>,
    },
    /// The chosen enforcement cannot be used for these constraint equations.
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
        /// The load, condition or motion that it belongs to.
        of: String,
        /// What is wrong.
        what: &'static str,
    },
}

/// What a message says of the conditions that there are.
fn acting(requested: &str, known: &str) -> String {
    if known.is_empty() {
        "there are no conditions: add one, or fix the part by Scene::hold".to_string()
    } else if known.split("; ").any(|own| own == requested) {
        // Functions can't be compared, so that a part restricted by another one is another part.
        format!(
            "name one that does: {known}; where `within` restricts the part, ask for the same Place again, or for the name that \
             Condition::named gives"
        )
    } else {
        format!("name one that does: {known}")
    }
}

/// The names by which something can be left out or moved, and how it gets one.
fn named(known: &str) -> String {
    let remedy = "give one by Condition::named, Load::named or RigidSurface::named; a place is no name";
    if known.is_empty() { remedy.to_string() } else { format!("there are: {known}; {remedy}") }
}

/// The names that there are, or what to do where there are none.
pub(super) fn there_are(known: &str, what: &str, remedy: &str) -> String {
    if known.trim().is_empty() { format!("no {what} have names: {remedy}") } else { format!("there are: {known}") }
}
