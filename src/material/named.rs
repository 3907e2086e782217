//! Laws by name: each with the quadratic volume energy (2.10) in one call.

use super::{
    ArrudaBoyce, Carroll, ExtendedTube, FoamTerm, Gent, GentGent, Hencky, InvariantEnergy, Invariants,
    NearlyIncompressible, Ogden, OgdenConvention, OgdenFoam, PrincipalEnergy, PrincipalStretches, QuadraticVolume,
    Rubber, TotalStretches,
};
use crate::error::MaterialError;

/// A law of the reduced invariants with $\frac k2(J-1)^2$.
pub type InvariantRubber<E> = NearlyIncompressible<Invariants<E>, QuadraticVolume>;

/// A law of the reduced principal stretches with $\frac k2(J-1)^2$.
pub type StretchRubber<E> = NearlyIncompressible<PrincipalStretches<E>, QuadraticVolume>;

fn invariants<E: InvariantEnergy>(energy: E, bulk: f64) -> Result<InvariantRubber<E>, MaterialError> {
    Ok(NearlyIncompressible { distortional: Invariants(energy), volumetric: QuadraticVolume::new(bulk)? })
}

fn stretches<E: PrincipalEnergy>(energy: E, bulk: f64) -> Result<StretchRubber<E>, MaterialError> {
    Ok(NearlyIncompressible { distortional: PrincipalStretches(energy), volumetric: QuadraticVolume::new(bulk)? })
}

/// Laws other than the paper's polynomial, each with the quadratic volume energy (2.10) of bulk modulus `bulk`.
///
/// ```
/// use rkpm::material::{Material, Rubber};
/// let laws: [f64; 3] = [ // MPa
///     Rubber::ogden([(0.618, 1.3), (0.001245, 5.0), (-0.00981, -2.0)], 1e3)?.initial_moduli().shear,
///     Rubber::gent(0.4, 80.0, 1e3)?.initial_moduli().shear,
///     Rubber::extended_tube(0.19, 0.2, 0.3, 0.1, 1e3)?.initial_moduli().shear,
/// ];
/// assert!(laws.iter().all(|mu| (0.3..0.5).contains(mu)));
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
impl Rubber {
    /// [`Ogden`]'s law with terms $(\mu_p, \alpha_p)$, $\mu_p$ in \[stress\].
    ///
    /// # Errors
    /// Those of [`Ogden::new`] and [`QuadraticVolume::new`].
    pub fn ogden(
        terms: impl IntoIterator<Item = (f64, f64)>,
        bulk: f64,
    ) -> Result<StretchRubber<Ogden>, MaterialError> {
        stretches(Ogden::new(terms)?, bulk)
    }

    /// [`Ogden`]'s law with the constants of another program; `terms` are its pairs (modulus, exponent).
    ///
    /// ```
    /// use rkpm::material::{OgdenConvention, Rubber};
    /// // The same rubber: µ_p here, 2 µ_p/α_p² there; exponents are the same.
    /// let here = Rubber::ogden([(0.618, 1.3), (-0.00981, -2.0)], 1e3)?;
    /// let there = [(0.5 * 0.618 * 1.3, 1.3), (0.5 * 0.00981 * 2.0, -2.0)];
    /// assert_eq!(Rubber::ogden_in(OgdenConvention::ShearModuli, there, 1e3)?, here);
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Ogden::new`] and [`QuadraticVolume::new`].
    pub fn ogden_in(
        convention: OgdenConvention,
        terms: impl IntoIterator<Item = (f64, f64)>,
        bulk: f64,
    ) -> Result<StretchRubber<Ogden>, MaterialError> {
        stretches(Ogden::in_convention(convention, terms)?, bulk)
    }

    /// [`Hencky`]'s law of the logarithmic strain.
    ///
    /// # Errors
    /// Those of [`Hencky::new`] and [`QuadraticVolume::new`].
    pub fn hencky(shear: f64, bulk: f64) -> Result<StretchRubber<Hencky>, MaterialError> {
        stretches(Hencky::new(shear)?, bulk)
    }

    /// [`Gent`]'s law with initial shear modulus $\mu$ and limit $J_m$.
    ///
    /// # Errors
    /// Those of [`Gent::new`] and [`QuadraticVolume::new`].
    pub fn gent(shear: f64, limit: f64, bulk: f64) -> Result<InvariantRubber<Gent>, MaterialError> {
        invariants(Gent::new(shear, limit)?, bulk)
    }

    /// The [`GentGent`] law with $\mu$, $J_m$ and $C_2$.
    ///
    /// # Errors
    /// Those of [`GentGent::new`] and [`QuadraticVolume::new`].
    pub fn gent_gent(
        shear: f64,
        limit: f64,
        second: f64,
        bulk: f64,
    ) -> Result<InvariantRubber<GentGent>, MaterialError> {
        invariants(GentGent::new(shear, limit, second)?, bulk)
    }

    /// The law of [`ArrudaBoyce`] with $\mu$ and $\lambda_m$.
    ///
    /// # Errors
    /// Those of [`ArrudaBoyce::new`] and [`QuadraticVolume::new`].
    pub fn arruda_boyce(shear: f64, locking: f64, bulk: f64) -> Result<InvariantRubber<ArrudaBoyce>, MaterialError> {
        invariants(ArrudaBoyce::new(shear, locking)?, bulk)
    }

    /// [`Carroll`]'s law with $A$, $B$ and $C$.
    ///
    /// # Errors
    /// Those of [`Carroll::new`] and [`QuadraticVolume::new`].
    pub fn carroll(a: f64, b: f64, c: f64, bulk: f64) -> Result<InvariantRubber<Carroll>, MaterialError> {
        invariants(Carroll::new(a, b, c)?, bulk)
    }

    /// The [`ExtendedTube`] with $G_c$, $G_e$, $\beta$ and $\delta$.
    ///
    /// # Errors
    /// Those of [`ExtendedTube::new`] and [`QuadraticVolume::new`].
    pub fn extended_tube(
        crosslinks: f64,
        entanglements: f64,
        beta: f64,
        delta: f64,
        bulk: f64,
    ) -> Result<StretchRubber<ExtendedTube>, MaterialError> {
        stretches(ExtendedTube::new(crosslinks, entanglements, beta, delta)?, bulk)
    }

    /// The compressible law of Blatz and Ko with $\mu$, $\nu$ and $f$; see [`OgdenFoam::blatz_ko`].
    ///
    /// # Errors
    /// Those of [`OgdenFoam::blatz_ko`].
    pub fn blatz_ko(shear: f64, poisson: f64, fraction: f64) -> Result<TotalStretches<OgdenFoam>, MaterialError> {
        Ok(TotalStretches(OgdenFoam::blatz_ko(shear, poisson, fraction)?))
    }

    /// A foam of Ogden and Storåkers; see [`OgdenFoam`].
    ///
    /// # Errors
    /// Those of [`OgdenFoam::new`].
    pub fn foam(terms: impl IntoIterator<Item = FoamTerm>) -> Result<TotalStretches<OgdenFoam>, MaterialError> {
        Ok(TotalStretches(OgdenFoam::new(terms)?))
    }
}
