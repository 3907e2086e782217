//! Whole scenes: conditions, control, answers, studies, journals.

mod answers;
mod bodies;
mod combinations;
mod conditions;
mod control;
mod diagnosis;
mod edges;
mod equilibrium;
mod fields;
mod manufactured;
mod motions;
mod places;
mod ranks;
mod references;
mod resume;
mod rigid;
mod schemes;
mod sizing;
mod space;
mod stages;
mod stalls;
mod stress;
mod study;
mod verdict;
