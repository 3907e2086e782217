//! Modes, pressures and patch tests: where methods fail, and that the default scheme does not.

mod certificates;
mod discs;
mod modes;
mod potential;
