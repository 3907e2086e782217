//! Hyperelastic materials: a stored energy $W(F)$ with its stress and tangent, always three-dimensional.
//!
//! | layer | trait | comes with |
//! |---|---|---|
//! | anything with a stored energy | [`Material`] | [`NearlyIncompressible`], [`Invariants`], [`PrincipalStretches`], [`TotalStretches`] |
//! | $\bar W(\bar I_1, \bar I_2)$ | [`InvariantEnergy`] | [`RivlinPolynomial`] (2.9), [`Gent`], [`GentGent`], [`ArrudaBoyce`], [`Carroll`] |
//! | $\bar W(\bar\lambda_1, \bar\lambda_2, \bar\lambda_3)$ | [`PrincipalEnergy`] | [`Ogden`], [`Hencky`], [`ExtendedTube`] |
//! | $W(\lambda_1, \lambda_2, \lambda_3)$, foams | [`PrincipalEnergy`] | [`OgdenFoam`] |
//! | $\tilde W(J)$ | [`VolumetricEnergy`] | [`QuadraticVolume`] (2.10), [`MixedLogarithmicVolume`], [`LogarithmicVolume`], [`HartmannNeffVolume`] |
//!
//! [`Rubber`] is the paper's material in one call:
//!
//! ```
//! use rkpm::material::{Material, Rubber};
//! use rkpm::nalgebra::Matrix3;
//!
//! let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?;          // MPa, the material of the paper's §6
//! let shear = Matrix3::new(1.0, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
//! assert!(rubber.energy(&shear) > 0.0);
//! assert!((rubber.initial_moduli().shear - 0.746).abs() < 1e-12); // 2 (A10 + A01)
//! # Ok::<(), rkpm::error::MaterialError>(())
//! ```
//!
//! # Laws by name, and constants of other programs
//! | here | elsewhere |
//! |---|---|
//! | [`Rubber::neo_hookean`], `mooney_rivlin`, `yeoh`, `polynomial`: $A_{mn}$ | $C_{mn}$, the same in Abaqus, Ansys, Marc; $C_{10} = \mu_0/2$ where a program asks for $\mu_0$ |
//! | `bulk` $= k$ of [`QuadraticVolume`] | $k = 2/D_1$ (Abaqus), $2/d$ (Ansys): [`QuadraticVolume::from_compliance`] |
//! | [`Rubber::ogden`]: $\mu_p$ in $\frac{\mu_p}{\alpha_p}$ | the same in Ansys, COMSOL, LS-DYNA, Marc; $\frac{2\mu_p}{\alpha_p^2}$ in Abaqus, CalculiX; $\frac{c_p}{\alpha_p^2}$ in FEBio: [`Rubber::ogden_in`] with an [`OgdenConvention`] |
//! | [`Rubber::arruda_boyce`]: $\mu$, $\lambda_m$ | the same in Abaqus, Ansys, five terms of the series; $\mu$ is not quite the initial modulus |
//! | [`Rubber::gent`]: $\mu$, $J_m$ | the same in Ansys, COMSOL; $E = 3\mu$ where a program asks for it |
//! | [`Rubber::extended_tube`]: $G_c$, $G_e$, $\beta$, $\delta$ | the same in Ansys |
//! | [`Rubber::foam`]: $\mu_p$ in $\frac{2\mu_p}{\alpha_p^2}$, $\nu_p$ | Abaqus (hyperfoam); Ansys has $\frac{\mu_p}{\alpha_p}$ and $\beta_p = \frac{\nu_p}{1-2\nu_p}$ |
//! | [`Rubber::blatz_ko`] with $\nu = \tfrac14$, $f = 0$ | Ansys, COMSOL: $\mu$ alone |
//!
//! A material never panics: where its energy is undefined ($J \le 0$, a stretch beyond a limit) it
//! answers with NaN, which a solver takes as a reason to shorten its step.

mod carroll;
mod existence;
mod foam;
mod gent;
mod homogeneous;
mod internal_variables;
mod invariants;
mod mullins;
mod named;
mod network;
mod prestretched;
mod principal;
mod rivlin;
mod rubber;
mod stability;
mod stretches;
mod surface_stability;
#[cfg(feature = "solve")]
mod thickness;
mod viscoelastic;
mod volumetric;

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::{Invalid, MaterialError};
use crate::tensor::{Tangent, add_determinant_hessian, cofactor, components, determinant_hessian};

pub use carroll::Carroll;
pub use existence::{ExistenceCondition, ExistenceReport, ExistenceVerdict, existence};
pub use foam::{FoamTerm, OgdenFoam};
pub use gent::{Gent, GentGent};
pub use homogeneous::{HomogeneousState, Mode};
pub use internal_variables::InternalVariables;
pub use invariants::{Distortion, InvariantEnergy, Invariants};
pub use mullins::Mullins;
pub use named::{InvariantRubber, StretchRubber};
pub use network::{ArrudaBoyce, ExtendedTube};
pub use prestretched::Prestretched;
pub use principal::{Hencky, Ogden, OgdenConvention, OgdenWarning, Principal, PrincipalEnergy};
pub use rivlin::RivlinPolynomial;
pub use rubber::Rubber;
pub use stability::{Criterion, SEARCHED, StableRange, stable_ranges, stable_ranges_incompressible};
pub use stretches::{PrincipalStretches, TotalStretches};
pub use surface_stability::surface_stability;
#[cfg(feature = "solve")]
#[cfg(feature = "solve")]
pub(crate) use thickness::FreeThickness;
pub use viscoelastic::{Prony, Viscoelastic};
pub use volumetric::{
    HartmannNeffVolume, LogarithmicVolume, MixedLogarithmicVolume, QuadraticVolume, Volumetric, VolumetricEnergy,
    VolumetricShape,
};

/// Stress and tangent of a material at one deformation gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// First Piola–Kirchhoff stress $P_{iJ} = \partial W/\partial F_{iJ}$ \[stress\].
    pub stress: Matrix3<f64>,
    /// $A_{iJkL} = \partial P_{iJ}/\partial F_{kL}$ at row $3i+J$, column $3k+L$ \[stress\].
    pub tangent: Tangent,
}

impl Response {
    /// The answer of a material outside the domain of its energy: NaN in every component.
    pub fn undefined() -> Self {
        Self { stress: Matrix3::repeat(f64::NAN), tangent: Tangent::repeat(f64::NAN) }
    }
}

/// Moduli of a material at $F = \delta$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialModuli {
    /// The shear modulus $\mu_0 = A_{1212}$ \[stress\], for an isotropic material free of stress at $F = \delta$;
    /// $2(A_{10}+A_{01})$ for (2.9).
    pub shear: f64,
    /// The bulk modulus $\kappa_0 = \frac19\sum_{iK} A_{iiKK}$ \[stress\]; $k$ for every volumetric energy of this crate.
    pub bulk: f64,
}

/// A hyperelastic material: a stored energy per reference volume and its first two derivatives.
///
/// The contract: $W(QF) = W(F)$ for every rotation $Q$, `stress` is $\partial W/\partial F$, `tangent`
/// is $\partial^2 W/\partial F\partial F$ (hence symmetric), and where $W$ is undefined the answer is
/// NaN ([`Response::undefined`]), never a panic.
///
/// A St. Venant–Kirchhoff solid, $W = \frac\lambda2 (\operatorname{tr}E)^2 + \mu\\,E:E$ with $E$ of (2.3):
///
/// ```
/// use rkpm::material::{Material, Response};
/// use rkpm::nalgebra::Matrix3;
/// use rkpm::tensor::Tangent;
///
/// struct StVenant { lambda: f64, mu: f64 }
///
/// impl StVenant {
///     fn strain_and_second_stress(&self, f: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
///         let e = 0.5 * (f.transpose() * f - Matrix3::identity());
///         (e, self.lambda * e.trace() * Matrix3::identity() + 2.0 * self.mu * e)
///     }
/// }
///
/// impl Material for StVenant {
///     fn energy(&self, f: &Matrix3<f64>) -> f64 {
///         let (e, s) = self.strain_and_second_stress(f);
///         0.5 * s.dot(&e)
///     }
///     fn response(&self, f: &Matrix3<f64>) -> Response {
///         let (_, s) = self.strain_and_second_stress(f);
///         let b = f * f.transpose();
///         let tangent = Tangent::from_fn(|row, column| {
///             let (i, j, k, l) = (row / 3, row % 3, column / 3, column % 3);
///             let geometric = if i == k { s[(j, l)] } else { 0.0 };
///             let shear = f[(i, l)] * f[(k, j)] + if j == l { b[(i, k)] } else { 0.0 };
///             geometric + self.lambda * f[(i, j)] * f[(k, l)] + self.mu * shear
///         });
///         Response { stress: f * s, tangent }
///     }
/// }
///
/// let solid = StVenant { lambda: 1.0, mu: 0.5 };
/// assert_eq!(solid.response(&Matrix3::identity()).stress, Matrix3::zeros());
/// assert!((solid.initial_moduli().bulk - (1.0 + 2.0 / 3.0 * 0.5)).abs() < 1e-15);
/// ```
pub trait Material: Send + Sync {
    /// Stored energy $W(F)$ per reference volume \[stress\].
    fn energy(&self, f: &Matrix3<f64>) -> f64;

    /// First Piola–Kirchhoff stress $P = \partial W/\partial F$ and tangent $\partial P/\partial F$ \[stress\].
    fn response(&self, f: &Matrix3<f64>) -> Response;

    /// Its moduli at $F = \delta$.
    fn initial_moduli(&self) -> InitialModuli {
        let tangent = self.response(&Matrix3::identity()).tangent;
        // The diagonal components 11, 22, 33 have the indices 0, 4, 8; component iJ = 12 has index 3·0 + 1.
        let sum: f64 = [0, 4, 8].iter().flat_map(|&row| [0, 4, 8].map(|column| tangent[(row, column)])).sum();
        InitialModuli { shear: tangent[(1, 1)], bulk: sum / 9.0 }
    }

    /// Writes the stress and the tangent in a few components $c = 3i + J$ alone: $P_{c_a}$ to `stress[a]`,
    /// $A_{c_a c_b}$ to `tangent[a * components.len() + b]`; where `tangent` is empty the stress alone is requested.
    ///
    /// Plane and radial bodies ask for two to five of the nine. Nothing needs to be written for it; a material
    /// that does is quicker there.
    fn respond(&self, f: &Matrix3<f64>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let response = self.response(f);
        for (a, &c) in components.iter().enumerate() {
            stress[a] = response.stress[(c / 3, c % 3)];
        }
        if tangent.is_empty() {
            return;
        }
        for (a, &c) in components.iter().enumerate() {
            for (b, &d) in components.iter().enumerate() {
                tangent[a * components.len() + b] = response.tangent[(c, d)];
            }
        }
    }

    /// The internal variables of the material, where it has any: relaxation ([`Viscoelastic`]), softening ([`Mullins`]).
    fn internal_variables(&self) -> Option<&dyn InternalVariables> {
        None
    }

    /// The whole deformation gradient where the material itself settles a part of it, as the thickness of a sheet in plane
    /// stress; else $F$ as it is.
    fn deformation(&self, f: &Matrix3<f64>) -> Matrix3<f64> {
        *f
    }

    /// Refuses what makes no material, a law within another one whose memory nothing keeps, say; the default accepts all.
    ///
    /// # Errors
    /// Where the material can't be what it was put together for.
    fn validate(&self) -> Result<(), MaterialError> {
        Ok(())
    }

    /// The parts $\bar W$ and $\tilde W$ of (2.8), where the material is such a sum.
    ///
    /// Schemes that project the volumetric energy onto pressure zones need it; a material that
    /// answers `None` is integrated as it is.
    fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
        None
    }
}

/// Refuses an inner law with internal variables under one that has its own: nothing would read them.
fn without_memory(inner: &dyn Material, outer: &'static str) -> Result<(), MaterialError> {
    inner.validate()?;
    match inner.internal_variables() {
        None => Ok(()),
        Some(variables) => {
            let needed = "give an elastic law: what relaxes or softens within another law that does would be lost";
            Err(Invalid::new(format!("internal variables of the law within {outer}"), variables.len() as f64, needed)
                .into())
        }
    }
}

/// Forwards a material trait through the pointers that trait objects travel in.
macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<T: Material + ?Sized> Material for $pointer {
            fn energy(&self, f: &Matrix3<f64>) -> f64 {
                (**self).energy(f)
            }
            fn response(&self, f: &Matrix3<f64>) -> Response {
                (**self).response(f)
            }
            fn initial_moduli(&self) -> InitialModuli {
                (**self).initial_moduli()
            }
            fn validate(&self) -> Result<(), MaterialError> {
                (**self).validate()
            }
            fn respond(&self, f: &Matrix3<f64>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
                (**self).respond(f, components, stress, tangent);
            }
            fn internal_variables(&self) -> Option<&dyn InternalVariables> {
                (**self).internal_variables()
            }
            fn deformation(&self, f: &Matrix3<f64>) -> Matrix3<f64> {
                (**self).deformation(f)
            }
            fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
                (**self).split()
            }
        }
        impl<T: VolumetricEnergy + ?Sized> VolumetricEnergy for $pointer {
            fn evaluate(&self, j: f64) -> Volumetric {
                (**self).evaluate(j)
            }
            fn shape(&self) -> Option<VolumetricShape> {
                (**self).shape()
            }
        }
        impl<T: InvariantEnergy + ?Sized> InvariantEnergy for $pointer {
            fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
                (**self).evaluate(i1, i2)
            }
            fn evaluate_excess(&self, e1: f64, e2: f64) -> Distortion {
                (**self).evaluate_excess(e1, e2)
            }
        }
        impl<T: PrincipalEnergy + ?Sized> PrincipalEnergy for $pointer {
            fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
                (**self).evaluate(logarithms)
            }
        }
    )*};
}

forward!(&T, Box<T>, Arc<T>);

/// The split (2.8), $W = \bar W + \tilde W(J)$: a distortional energy beside a volumetric one.
///
/// With $p = \tilde W'(J)$ (2.15) and $\operatorname{cof}F = \partial J/\partial F$,
/// $$P = \frac{\partial\bar W}{\partial F} + p\operatorname{cof}F,\qquad
/// \frac{\partial P}{\partial F} = \frac{\partial^2\bar W}{\partial F\partial F}
/// {}+ \tilde W''\operatorname{cof}F\otimes\operatorname{cof}F
/// {}+ p\\,\frac{\partial^2 J}{\partial F\partial F}.$$
///
/// `distortional` is expected to depend on $\bar F = J^{-1/3}F$ alone ([`Invariants`] and
/// [`PrincipalStretches`] see to it); then $p$ is the mean Cauchy stress. NaN for $J \le 0$.
///
/// ```
/// use rkpm::material::{Gent, Invariants, NearlyIncompressible, MixedLogarithmicVolume};
///
/// let rubber = NearlyIncompressible {
///     distortional: Invariants(Gent::new(0.746, 80.0)?),
///     volumetric: MixedLogarithmicVolume::new(1e3)?,
/// };
/// # let _ = rubber;
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearlyIncompressible<W, U> {
    /// The energy $\bar W$ of the distortion.
    pub distortional: W,
    /// The energy $\tilde W(J)$ of the change of volume.
    pub volumetric: U,
}

impl<W: Material, U: VolumetricEnergy> Material for NearlyIncompressible<W, U> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        let j = f.determinant();
        // (2.10) is finite at J <= 0, so the guard can't be left to the energies.
        if j > 0.0 { self.distortional.energy(f) + self.volumetric.evaluate(j).energy } else { f64::NAN }
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        let j = f.determinant();
        // Written so that a NaN determinant is caught too.
        if j.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            return Response::undefined();
        }
        let mut response = self.distortional.response(f);
        let Volumetric { slope, curvature, .. } = self.volumetric.evaluate(j);
        let cof = cofactor(f);
        response.stress += slope * cof;
        let cof = components(&cof);
        response.tangent.ger(curvature, &cof, &cof, 1.0);
        add_determinant_hessian(&mut response.tangent, f, slope);
        response
    }

    fn respond(&self, f: &Matrix3<f64>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let n = components.len();
        let j = f.determinant();
        if j.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            stress[..n].fill(f64::NAN);
            tangent.fill(f64::NAN);
            return;
        }
        self.distortional.respond(f, components, stress, tangent);
        let Volumetric { slope, curvature, .. } = self.volumetric.evaluate(j);
        let cof = cofactor(f);
        let entry = |c: usize| cof[(c / 3, c % 3)];
        for (a, &c) in components.iter().enumerate() {
            stress[a] += slope * entry(c);
            for (b, &d) in components.iter().enumerate().take(if tangent.is_empty() { 0 } else { n }) {
                tangent[a * n + b] += curvature * entry(c) * entry(d) + slope * determinant_hessian(f, c, d);
            }
        }
    }

    fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
        Some((&self.distortional, &self.volumetric))
    }

    /// Those of the distortional energy, which they stand in place of.
    fn internal_variables(&self) -> Option<&dyn InternalVariables> {
        self.distortional.internal_variables()
    }

    fn validate(&self) -> Result<(), MaterialError> {
        self.distortional.validate()
    }
}
