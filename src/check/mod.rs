//! Certificates: checks that schemes and components of one's own must pass.
//!
//! * [`scene`]: errors in a scene, found before it is solved.
//! * [`surface`]: defects of a surface of triangles that is to bound a solid.
//! * [`patch_test`]: are homogeneous fields reproduced?
//! * [`spurious_modes`]: does the integration rule see every deformation?
//! * [`inf_sup`]: are the pressures stable?
//! * [`kernel`], [`basis`], [`material`], [`invariant_energy`], [`term`], [`solver`]: does a piece keep the contract of
//!   its trait?
//!
//! Certificates use dense linear algebra and small problems (at most 3000 unknowns): what they
//! tell of a scheme does not depend on the size. Contract checks sample the piece, with fixed seeds, and
//! report every law with its largest violation; nothing panics.
//!
//! ```
//! use rkpm::check;
//! use rkpm::kernel::{CubicSpline, Kernel};
//! assert!(check::kernel(&CubicSpline).holds());
//! /// Forgets to end at z = 1.
//! struct Endless;
//! impl Kernel for Endless {
//!     fn value_and_slope(&self, z: f64) -> (f64, f64) {
//!         ((-z * z).exp(), -2.0 * z * (-z * z).exp())
//!     }
//! }
//! let report = check::kernel(&Endless);
//! assert_eq!(report.violations().next().map(|f| f.law), Some("value and slope are zero for z >= 1"));
//! ```

mod algebra;
mod cover;
mod inf_sup;
mod material;
mod patch;
mod scene;
mod shape;
mod solver;
mod stability;
mod surface;
mod term;

pub use crate::scene::{FixedInside, FreeMotion};
pub use cover::UncoveredRegion;
pub use inf_sup::{InfSup, inf_sup};
pub use material::{invariant_energy, material};
pub use patch::{PatchTest, patch_test};
pub use scene::{Diagnosis, scene};
pub use shape::{basis, kernel};
pub use solver::solver;
pub use stability::{Stability, spurious_modes};
pub use surface::surface;
pub use term::term;

use std::fmt;

use crate::each::{Each, list_of};
use crate::material::StableRange;

/// Unknowns up to which certificates are computed: dense matrices of 72 MB, spectra in under a minute.
pub(crate) const SIZE_LIMIT: usize = 3000;

/// One law of a contract and how well it was kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The law.
    pub law: &'static str,
    /// Largest violation met, relative to the size of what is compared; NaN where numbers were not finite.
    pub violation: f64,
    /// Largest violation that rounding and differences explain.
    pub tolerance: f64,
    /// Where the largest violation was met.
    pub at: String,
}

impl Finding {
    /// Whether the law was kept.
    pub fn holds(&self) -> bool {
        self.violation <= self.tolerance
    }
}

/// What a contract check found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The laws that were checked.
    pub findings: Vec<Finding>,
    /// Laws that could not be checked, and why.
    pub unchecked: Vec<String>,
    /// Stretches in which a material is stable: no law of the contract, but what its user should know.
    pub ranges: Vec<StableRange>,
}

impl Report {
    /// Whether every checked law was kept.
    pub fn holds(&self) -> bool {
        self.findings.iter().all(Finding::holds)
    }

    /// The laws that were broken.
    pub fn violations(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|f| !f.holds())
    }

    /// The finding of a law, `None` where it was not checked.
    pub fn finding(&self, law: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.law == law)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for finding in &self.findings {
            let word = if finding.holds() { "holds" } else { "BROKEN" };
            writeln!(f, "{word:>9}  {}: {:.1e} (tolerance {:.0e})", finding.law, finding.violation, finding.tolerance)?;
            if !finding.holds() {
                writeln!(f, "           at {}", finding.at)?;
            }
        }
        for law in &self.unchecked {
            writeln!(f, "unchecked  {law}")?;
        }
        for range in &self.ranges {
            writeln!(f, "   stable  {range}")?;
        }
        Ok(())
    }
}

impl Finding {
    /// A law that is not sampled yet.
    fn new(law: &'static str, tolerance: f64) -> Self {
        Finding { law, violation: 0.0, tolerance, at: String::new() }
    }

    /// Keeps the largest violation of all samples; a NaN counts as larger than any number.
    fn see(&mut self, violation: f64, at: impl FnOnce() -> String) {
        if !(violation <= self.violation) && !self.violation.is_nan() {
            (self.violation, self.at) = (violation, at());
        }
    }
}

impl Report {
    fn with(mut self, findings: impl IntoIterator<Item = Finding>) -> Self {
        self.findings.extend(findings);
        self
    }

    fn unchecked(mut self, law: impl Into<String>) -> Self {
        self.unchecked.push(law.into());
        self
    }
}

/// The derivative of a function of so many steps, at none: of the four-point difference around it and those to either side the one nearest
/// to `exact`. Where the function has a kink, a derivative is that of one side.
fn nearest_difference(f: &dyn Fn(i32) -> Vec<f64>, exact: &[f64], step: f64) -> Vec<f64> {
    let [here, f1, f2, f3, b1, b2, b3] = [0, 1, 2, 3, -1, -2, -3].map(f);
    let aside = |[at, one, two, three]: [f64; 4]| (one * 18.0 - at * 11.0 - two * 9.0 + three * 2.0) / (6.0 * step);
    let mut nearest = list_of(exact.len(), |k| ((f1[k] - b1[k]) * 8.0 - (f2[k] - b2[k])) / (12.0 * step));
    let ahead = list_of(exact.len(), |k| aside([here[k], f1[k], f2[k], f3[k]]));
    let behind = list_of(exact.len(), |k| -aside([here[k], b1[k], b2[k], b3[k]]));
    let off = |slope: &[f64]| slope.pair_sum(exact, |a, b| (a - b) * (a - b));
    for other in [ahead, behind] {
        // A central difference that is no number stays one, and shows.
        if off(&other) < off(&nearest) {
            nearest = other;
        }
    }
    nearest
}

/// A random number between −1 and 1.
fn signed(random: &mut fastrand::Rng) -> f64 {
    2.0 * random.f64() - 1.0
}
