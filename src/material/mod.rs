//! Materials: hyperelastic energies of the deformation gradient.
//!
//! A [`Material`] gives $P = \partial W/\partial F$ and $\partial P/\partial F$ together. Nearly incompressible
//! rubber is [`NearlyIncompressible`]: a distortional energy of $\bar F = J^{-1/3}F$ plus a volumetric
//! energy $U(J)$ (2.8); the split is what the default scheme's cure against locking needs.

mod invariants;
mod rivlin;
mod volumetric;

pub use invariants::{Distortion, Gent, InvariantEnergy, Invariants};
pub use rivlin::RivlinPolynomial;
pub use volumetric::{LogarithmicVolume, MixedLogarithmicVolume, QuadraticVolume, Volumetric, VolumetricEnergy};

use nalgebra::Matrix3;

use crate::error::MaterialError;
use crate::tensor::{Tangent, add_determinant_hessian, cofactor, components};

/// Stress and tangent at one deformation gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// First Piola–Kirchhoff stress $P = \partial W/\partial F$ \[stress\].
    pub stress: Matrix3<f64>,
    /// $\partial P/\partial F$ \[stress\].
    pub tangent: Tangent,
}

/// A hyperelastic material.
///
/// A deformation outside the material's domain ($J \le 0$, a locked chain) gives numbers that are not
/// finite; the solver then rejects the step. Nothing panics.
///
/// ```
/// use rkpm::material::{Material, Response};
/// use rkpm::nalgebra::Matrix3;
/// use rkpm::tensor::Tangent;
/// /// W = c/2 |F − I|²: springs; not frame-indifferent, good for tests.
/// struct Springs(f64);
/// impl Material for Springs {
///     fn energy(&self, f: &Matrix3<f64>) -> f64 {
///         0.5 * self.0 * (f - Matrix3::identity()).norm_squared()
///     }
///     fn response(&self, f: &Matrix3<f64>) -> Response {
///         Response { stress: (f - Matrix3::identity()) * self.0, tangent: Tangent::identity() * self.0 }
///     }
/// }
/// assert_eq!(Springs(2.0).response(&Matrix3::identity()).stress, Matrix3::zeros());
/// ```
pub trait Material: Send + Sync {
    /// Energy $W(F)$ per reference volume \[stress\].
    fn energy(&self, f: &Matrix3<f64>) -> f64;

    /// Stress and tangent.
    fn response(&self, f: &Matrix3<f64>) -> Response;

    /// Distortional and volumetric part, where $W = \bar W(F) + U(J)$; `None` where the energy can't be split.
    fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
        None
    }
}

macro_rules! forward_material {
    ($($pointer:ty),*) => {$(
        impl<T: Material + ?Sized> Material for $pointer {
            fn energy(&self, f: &Matrix3<f64>) -> f64 {
                (**self).energy(f)
            }

            fn response(&self, f: &Matrix3<f64>) -> Response {
                (**self).response(f)
            }

            fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
                (**self).split()
            }
        }
    )*};
}

forward_material!(&T, Box<T>, std::sync::Arc<T>);

/// $W = \bar W(F) + U(J)$ (2.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearlyIncompressible<W, U> {
    /// The energy of the distortion.
    pub distortional: W,
    /// The energy of the volume change.
    pub volumetric: U,
}

impl<W: Material, U: VolumetricEnergy> Material for NearlyIncompressible<W, U> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        self.distortional.energy(f) + self.volumetric.evaluate(f.determinant()).energy
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        let mut response = self.distortional.response(f);
        let volume = self.volumetric.evaluate(f.determinant());
        let cof = cofactor(f);
        response.stress += cof * volume.slope;
        let c = components(&cof);
        response.tangent.ger(volume.curvature, &c, &c, 1.0);
        add_determinant_hessian(&mut response.tangent, f, volume.slope);
        response
    }

    fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
        Some((&self.distortional, &self.volumetric))
    }
}

/// The rubber of the paper: a polynomial in the reduced invariants (2.9) and $\tfrac k2(J-1)^2$ (2.10).
pub type Rubber = NearlyIncompressible<Invariants<RivlinPolynomial>, QuadraticVolume>;

impl Rubber {
    /// Any polynomial: terms $((m, n), A_{mn})$ and bulk modulus $k$ \[stress\].
    ///
    /// # Errors
    /// For no term, $m + n = 0$, numbers that are not finite, or $k \le 0$.
    ///
    /// ```
    /// let rubber = rkpm::material::Rubber::polynomial([((1, 0), 0.4), ((0, 1), 0.1), ((1, 1), 0.01)], 1e3)?;
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    pub fn polynomial(terms: impl IntoIterator<Item = ((u32, u32), f64)>, k: f64) -> Result<Self, MaterialError> {
        Ok(NearlyIncompressible {
            distortional: Invariants(RivlinPolynomial::new(terms)?),
            volumetric: QuadraticVolume::new(k)?,
        })
    }

    /// $A_{10}(\bar I_1 - 3)$; the shear modulus is $2A_{10}$.
    ///
    /// # Errors
    /// As [`polynomial`](Rubber::polynomial).
    pub fn neo_hookean(a10: f64, k: f64) -> Result<Self, MaterialError> {
        Rubber::polynomial([((1, 0), a10)], k)
    }

    /// $A_{10}(\bar I_1 - 3) + A_{01}(\bar I_2 - 3)$; the shear modulus is $2(A_{10} + A_{01})$.
    ///
    /// # Errors
    /// As [`polynomial`](Rubber::polynomial).
    pub fn mooney_rivlin(a10: f64, a01: f64, k: f64) -> Result<Self, MaterialError> {
        Rubber::polynomial([((1, 0), a10), ((0, 1), a01)], k)
    }

    /// $\sum_{m=1}^3 A_{m0}(\bar I_1 - 3)^m$: the paper's rubber is (0.373, −0.031, 0.005) MPa with $k = 10^5$ MPa.
    ///
    /// # Errors
    /// As [`polynomial`](Rubber::polynomial).
    pub fn yeoh(a10: f64, a20: f64, a30: f64, k: f64) -> Result<Self, MaterialError> {
        Rubber::polynomial([((1, 0), a10), ((2, 0), a20), ((3, 0), a30)], k)
    }
}

/// The shear modulus $\mu_0$ at $F = I$ \[stress\]: $\partial P_{12}/\partial F_{12}$.
pub fn initial_shear_modulus(material: &(impl Material + ?Sized)) -> f64 {
    material.response(&Matrix3::identity()).tangent[(1, 1)]
}

/// The bulk modulus at $F = I$ \[stress\]: $\tfrac19\,\partial P_{ii}/\partial F_{jj}$.
pub fn initial_bulk_modulus(material: &(impl Material + ?Sized)) -> f64 {
    let tangent = material.response(&Matrix3::identity()).tangent;
    (0..3).map(|i| (0..3).map(|j| tangent[(4 * i, 4 * j)]).sum::<f64>()).sum::<f64>() / 9.0
}
