//! Which parts of deformable faces may touch each other: chords in the plane, facets in space.

/// How deep a part may be behind another one to be in contact with it, in terms of their length: beyond, it is the far side of a
/// wall.
pub(super) const BEHIND: f64 = 1.5;
/// Cosine between the inward normal and the way to another part, both at rest, from which on the body lies between them; the same between
/// the outward normals of the body and of a rigid surface that has passed through it.
pub(super) const THROUGH: f64 = 0.5;
