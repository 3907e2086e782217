//! Results of the states of a problem.

pub(super) mod contact_state;
pub(super) mod control;
pub(super) mod fields;
pub(super) mod free_motions;
pub(super) mod neutral_motion;
#[cfg(feature = "chart")]
pub(super) mod picture;
pub(super) mod reactions;
pub(super) mod recovery;
mod restricted;
pub(super) mod rigid_motion;
pub(super) mod runs;
pub(super) mod surface;
pub(super) mod transfer;
pub(super) mod verdict;
pub(super) mod view;
