//! What is refused, and how it says so.

mod indices;
mod input;
mod kept;
mod misfits;
mod misuse;
mod misuses;
mod silent;
