//! The paper's material in one call.

use super::constants::positive;
use super::existence::existence;
use super::{ExistenceReport, Invariants, NearlyIncompressible, QuadraticVolume, RivlinPolynomial, VolumetricEnergy};
use crate::error::MaterialError;

/// The paper's material (2.8)–(2.10): the polynomial $\bar W(\bar I_1,\bar I_2)$ with $\frac k2(J-1)^2$.
///
/// ```
/// use rkpm::material::Rubber;
///
/// let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
/// let same = Rubber::polynomial([((1, 0), 0.373), ((2, 0), -0.031), ((3, 0), 0.005)], 1e5)?;
/// assert_eq!(rubber, same);
/// assert!(Rubber::neo_hookean(0.5, f64::NAN).is_err());
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
pub type Rubber = NearlyIncompressible<Invariants<RivlinPolynomial>, QuadraticVolume>;

impl NearlyIncompressible<Invariants<RivlinPolynomial>, QuadraticVolume> {
    /// $A_{10}(\bar I_1-3) + \frac k2(J-1)^2$, constants in \[stress\].
    ///
    /// # Errors
    /// [`Invalid`](crate::error::Invalid) unless $A_{10}$ is finite and above zero, and those of [`QuadraticVolume::new`].
    pub fn neo_hookean(a10: f64, bulk: f64) -> Result<Self, MaterialError> {
        Self::of(RivlinPolynomial::neo_hookean(a10)?, bulk)
    }

    /// $A_{10}(\bar I_1-3) + A_{01}(\bar I_2-3) + \frac k2(J-1)^2$, constants in \[stress\].
    ///
    /// # Errors
    /// [`Invalid`](crate::error::Invalid) unless both are finite and their sum is above zero, and those of [`QuadraticVolume::new`].
    pub fn mooney_rivlin(a10: f64, a01: f64, bulk: f64) -> Result<Self, MaterialError> {
        Self::of(RivlinPolynomial::mooney_rivlin(a10, a01)?, bulk)
    }

    /// $\sum_{m=1}^3 A_{m0}(\bar I_1-3)^m + \frac k2(J-1)^2$, constants in \[stress\].
    ///
    /// # Errors
    /// [`Invalid`](crate::error::Invalid) unless all are finite and $A_{10}$ is above zero, and those of [`QuadraticVolume::new`].
    pub fn yeoh(a10: f64, a20: f64, a30: f64, bulk: f64) -> Result<Self, MaterialError> {
        Self::of(RivlinPolynomial::yeoh(a10, a20, a30)?, bulk)
    }

    /// Any polynomial (2.9) with terms $((m, n), A_{mn})$ and $\frac k2(J-1)^2$, constants in \[stress\].
    ///
    /// # Errors
    /// Those of [`RivlinPolynomial::new`] and [`QuadraticVolume::new`]; [`Invalid`](crate::error::Invalid) unless the initial shear
    /// modulus $2(A_{10}+A_{01})$ is above zero.
    pub fn polynomial(terms: impl IntoIterator<Item = ((u32, u32), f64)>, bulk: f64) -> Result<Self, MaterialError> {
        let polynomial = RivlinPolynomial::new(terms)?;
        let first: f64 = polynomial.terms().filter(|((m, n), _)| m + n == 1).map(|(_, value)| value).sum();
        positive("A_10 + A_01", first)?;
        Self::of(polynomial, bulk)
    }

    fn of(polynomial: RivlinPolynomial, bulk: f64) -> Result<Self, MaterialError> {
        Ok(Self { distortional: Invariants(polynomial), volumetric: QuadraticVolume::new(bulk)? })
    }
}

impl<U: VolumetricEnergy> NearlyIncompressible<Invariants<RivlinPolynomial>, U> {
    /// Which of the existence conditions (5.6)–(5.13) this material satisfies.
    ///
    /// ```
    /// use rkpm::material::{ExistenceVerdict, HartmannNeffVolume, Invariants, NearlyIncompressible, RivlinPolynomial, Rubber};
    /// let report = Rubber::mooney_rivlin(0.3, 0.05, 1e3)?.existence();
    /// assert_eq!(report.verdict("5.8"), Some(ExistenceVerdict::Fails));  // beta = 2 < 3
    /// assert_eq!(report.verdict("5.10"), Some(ExistenceVerdict::Fails)); // (k/2)(J - 1)² is finite at J = 0
    ///
    /// let distortional = Invariants(RivlinPolynomial::new([((1, 0), 1.0), ((2, 0), 0.1), ((3, 0), 0.01)])?);
    /// let stiffening = NearlyIncompressible { distortional, volumetric: HartmannNeffVolume::new(1e3)? };
    /// assert!(stiffening.existence().holds());
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    pub fn existence(&self) -> ExistenceReport {
        existence(&self.distortional.0, &self.volumetric)
    }
}
