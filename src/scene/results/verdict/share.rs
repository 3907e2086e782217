//! How much of the energy may be in doubt.

/// The largest part of its energy that a state may have in changes of volume that pressures do not allow, or lack where contacts overlap:
/// energies go with the squares of strains, so that strains are off by a tenth in the mean.
pub(super) const LARGEST_SHARE: f64 = 0.01;
