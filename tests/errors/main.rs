//! What is refused, and how it says so.

mod input;
mod misfits;
mod misuses;
mod silent;
