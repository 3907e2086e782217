//! The crate itself: its floors, files, allocations, dependencies, threads and extension points.

mod allocations;
mod circles;
mod documents;
mod downstream;
mod floors;
mod output;
mod threads;
mod user_extensions;
