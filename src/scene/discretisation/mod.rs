//! From a scene and a scheme to a problem: particles, cells, tables, terms and constraint equations.

pub(super) mod approximation;
pub(super) mod body_cells;
pub(super) mod bond;
pub(super) mod conditions;
pub(super) mod contact;
pub(super) mod cover;
pub(super) mod discrete_body;
pub(super) mod discretize;
pub(super) mod elements;
pub(super) mod facet_rule;
pub(super) mod frame;
pub(super) mod frame_terms;
pub(super) mod interface;
pub(super) mod interface_moments;
pub(super) mod memory;
pub(super) mod one_body;
pub(super) mod overlap;
pub(super) mod ownership;
pub(super) mod particles;
pub(super) mod problem;
pub(super) mod rigid;
pub(super) mod rule;
pub(super) mod sharing;
pub(super) mod space;
pub(super) mod unmeasured;
pub(super) mod unused;
