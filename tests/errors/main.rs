//! What is refused, and how it says so.

mod indices;
mod input;
mod kept;
mod misfits;
mod misuses;
mod silent;
