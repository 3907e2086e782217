//! How many particles a scheme puts along the axes of a domain.

use crate::error::{Error, GeometryError, Invalid};
use crate::geometry::{Domain, Point};

use super::scheme::Scheme;
use super::scheme_choices::{ApproximationChoice, Resolution};

/// Cells across a block thinner than a spacing: averages over sub-cells leave out $1/(2n)^2$ of the energy of bending.
const ACROSS: usize = 4;
/// Particles along each axis where a scheme does not say.
const COUNT: usize = 9;

impl Scheme {
    /// How many particles, said or not.
    pub(super) fn resolution_or_default(&self) -> Resolution {
        self.resolution.clone().unwrap_or_else(|| Resolution::Counts(vec![COUNT]))
    }
}

/// Particles along each axis.
pub(crate) fn counts<const D: usize>(domain: &dyn Domain<D>, scheme: &Scheme) -> Result<[usize; D], Error> {
    match &scheme.resolution_or_default() {
        Resolution::Counts(counts) => per_axis(counts, "particle counts"),
        Resolution::Spacing(spacing) => {
            ensure!(
                *spacing > 0.0 && spacing.is_finite(),
                Invalid::new("particle spacing", *spacing, "give a finite length above zero")
            );
            let (lengths, mut counts) = (edge_lengths(domain), [0; D]);
            let is_refined = D > 1 && scheme.approximation == ApproximationChoice::Particles && !scheme.thin_walls;
            for axis in 0..D {
                let count = (lengths[axis] / spacing - 1e-9).ceil().clamp(1.0, 1e12) as usize;
                counts[axis] = if is_refined && count == 1 { ACROSS } else { count } + 1;
            }
            Ok(counts)
        }
    }
}

/// The longest of the edges of a domain's unit cube along each axis, each measured in 16 pieces \[length\].
pub(crate) fn edge_lengths<const D: usize>(domain: &dyn Domain<D>) -> [f64; D] {
    let mut longest = [0.0f64; D];
    for axis in 0..D {
        for edge in 0..1usize << D {
            let (mut corner, mut length) = (Point::<D>::zeros(), 0.0);
            for i in 0..D {
                corner[i] = if i == axis { 0.0 } else { ((edge >> i) & 1) as f64 };
            }
            let mut before = domain.position(&corner);
            for piece in 1..=16 {
                let mut at = corner;
                at[axis] = piece as f64 / 16.0;
                let next = domain.position(&at);
                length += (next - before).norm();
                before = next;
            }
            longest[axis] = longest[axis].max(length);
        }
    }
    longest
}

/// One number for each axis; a single one stands for all.
pub(crate) fn per_axis<const D: usize>(given: &[usize], what: &'static str) -> Result<[usize; D], Error> {
    if let &[one] = given {
        Ok([one; D])
    } else if let Ok(each) = given.try_into() {
        Ok(each)
    } else {
        Err(GeometryError::Count { what, count: given.len(), needed: "give one number for each axis, or one for all" }
            .into())
    }
}
