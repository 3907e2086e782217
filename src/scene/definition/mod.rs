//! What is to be solved, and how: scenes and schemes as they are said.

pub(super) mod bodies;
pub(super) mod condition;
pub(super) mod contact;
pub(super) mod contact_definition;
pub(super) mod geometry;
pub(super) mod load;
pub(super) mod place;
pub(super) mod resolution;
pub(super) mod rigid;
pub(super) mod scene;
pub(super) mod scheme;
pub(super) mod scheme_choices;
pub(super) mod source;
pub(super) mod validate;
pub(super) mod value;
