//! Modes, pressures and patch tests: where methods fail, and that the default scheme does not.

mod certificates;
mod modes;
mod potential;
