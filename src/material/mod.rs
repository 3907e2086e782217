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
//! | `bulk` $= k$ of [`QuadraticVolume`] | $k = 2/D_1$ (Abaqus), $2/d$ (Ansys) |
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
mod constants;
mod existence;
mod foam;
mod gent;
mod homogeneous;
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
mod thickness;
mod viscoelastic;
mod volumetric;

use std::sync::Arc;

use crate::each::EachOf;
use crate::error::MaterialError;
use crate::geometry::Mat3;
use crate::tensor::{Tangent, add_determinant_hessian, cofactor, components, determinant_hessian};

pub use carroll::Carroll;
pub use existence::{ExistenceCondition, ExistenceReport, ExistenceVerdict};
pub use foam::{FoamTerm, OgdenFoam};
pub use gent::{Gent, GentGent};
pub use homogeneous::{HomogeneousState, Mode};
pub use invariants::{Distortion, InvariantEnergy, Invariants};
pub use mullins::Mullins;
pub use named::{InvariantRubber, StretchRubber};
pub use network::{ArrudaBoyce, ExtendedTube};
pub use prestretched::Prestretched;
pub use principal::{Hencky, Ogden, OgdenConvention, Principal, PrincipalEnergy};
pub use rivlin::RivlinPolynomial;
pub use rubber::Rubber;
pub(crate) use stability::SEARCHED;
pub use stability::{Criterion, StableRange, stable_ranges, stable_ranges_incompressible};
pub use stretches::{PrincipalStretches, TotalStretches};
pub(crate) use surface_stability::surface_stability;
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
    pub stress: Mat3,
    /// $A_{iJkL} = \partial P_{iJ}/\partial F_{kL}$ at row $3i+J$, column $3k+L$ \[stress\].
    pub tangent: Tangent,
}

impl Response {
    /// The answer of a material outside the domain of its energy: NaN in every component.
    pub fn undefined() -> Self {
        Self { stress: Mat3::repeat(f64::NAN), tangent: Tangent::repeat(f64::NAN) }
    }

    /// Copies a few components, as [`Material::respond`] writes them.
    pub(crate) fn select(&self, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        for (a, &c) in components.iter().enumerate() {
            stress[a] = self.stress[(c / 3, c % 3)];
            if tangent.is_empty() {
                continue;
            }
            for (b, &d) in components.iter().enumerate() {
                tangent[a * components.len() + b] = self.tangent[(c, d)];
            }
        }
    }

    /// The response of which [`Material::respond`] writes all components.
    fn of_components(respond: impl FnOnce(&[usize], &mut [f64], &mut [f64])) -> Self {
        let (mut stress, mut tangent) = ([0.0; 9], [0.0; 81]);
        respond(&ALL, &mut stress, &mut tangent);
        Self { stress: Mat3::from_row_slice(&stress), tangent: Tangent::from_row_slice(&tangent) }
    }

    /// The same with the part of a volumetric energy, for $J > 0$.
    fn with_volume(mut self, volumetric: &dyn VolumetricEnergy, f: &Mat3) -> Self {
        let Volumetric { slope, curvature, .. } = volumetric.evaluate(f.determinant());
        let cof = cofactor(f);
        self.stress += slope * cof;
        let cof = components(&cof);
        self.tangent.ger(curvature, &cof, &cof, 1.0);
        add_determinant_hessian(&mut self.tangent, f, slope);
        self
    }
}

/// All components of a gradient.
const ALL: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];

/// Moduli of a material at $F = \delta$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialModuli {
    /// The shear modulus $\mu_0 = A_{1212}$ \[stress\], for an isotropic material free of stress at $F = \delta$;
    /// $2(A_{10}+A_{01})$ for (2.9).
    pub shear: f64,
    /// The bulk modulus $\kappa_0 = \frac19\sum_{iK} A_{iiKK}$ \[stress\]; $k$ for every volumetric energy of this crate.
    pub bulk: f64,
}

impl InitialModuli {
    /// Those of a tangent at $F = \delta$.
    fn of(tangent: &Tangent) -> Self {
        // The diagonal components 11, 22, 33 have the indices 0, 4, 8; component iJ = 12 has index 3·0 + 1.
        let sum: f64 = [0, 4, 8].iter().flat_map(|&row| [0, 4, 8].each(|column| tangent[(row, column)])).sum();
        InitialModuli { shear: tangent[(1, 1)], bulk: sum / 9.0 }
    }
}

/// What a material remembers of a point when a step begins, and the time that has passed since.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Past<'a> {
    /// As many numbers as [`Material::memory`] says.
    pub memory: &'a [f64],
    /// Time from there to the end of the step \[time\].
    pub elapsed: f64,
}

impl<'a> Past<'a> {
    /// Nothing to remember: the past of an elastic material.
    pub const NONE: Past<'static> = Past { memory: &[], elapsed: 0.0 };

    /// The first numbers of the memory, those of a material itself, and the past of the material that it wraps behind them.
    pub fn split(self, own: usize) -> (&'a [f64], Past<'a>) {
        let (own, memory) = self.memory.split_at(own);
        (own, Past { memory, ..self })
    }
}

/// A material: a stored energy per reference volume and its first two derivatives, at the end of a step that began with a memory.
///
/// $W(F) = W_e(F) + \tilde W(J)$ with the energy of [`volumetric`](Material::volumetric), which schemes may project onto pressure
/// zones. The methods with a [`Past`] leave that part out; [`energy`](Material::energy) and [`response`](Material::response) have the
/// whole. Elastic materials look at no past.
///
/// The contract: $W_e(QF) = W_e(F)$ for every rotation $Q$, the stress is $\partial W_e/\partial F$, the tangent
/// $\partial^2 W_e/\partial F\partial F$ (hence symmetric), and where $W$ is undefined the answer is
/// NaN ([`Response::undefined`]), never a panic.
///
/// A St. Venant–Kirchhoff solid, $W = \frac\lambda2 (\operatorname{tr}E)^2 + \mu\\,E:E$ with $E$ of (2.3):
///
/// ```
/// use rkpm::material::{Material, Past, Response};
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
///     fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
///         let (e, s) = self.strain_and_second_stress(f);
///         0.5 * s.dot(&e)
///     }
///     fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
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
///
/// # Memory
/// A step leads from the memory at its beginning to a deformation gradient at its end, some time later. Within it the material is one
/// of hyperelasticity, an energy of $F$ at fixed memory, and Newton's method is unchanged. Once the step is accepted
/// [`remember`](Material::remember) writes the memory that the next one begins with. The contract: with no time elapsed and the memory
/// just written, the stress is that of the step that ended there.
///
/// A wrapper says what it wraps ([`inner`](Material::inner)), and everything that it does not write itself is that of the inner
/// material. Its own memory stands before the inner one ([`Past::split`]). A law that counts how far a point was stretched and is its
/// inner law otherwise:
///
/// ```
/// use rkpm::material::{Material, Past, Response, Rubber};
/// use rkpm::nalgebra::Matrix3;
///
/// struct Counted<M>(M);
/// impl<M: Material> Material for Counted<M> {
///     fn inner(&self) -> Option<&dyn Material> { Some(&self.0) }
///     fn energy_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> f64 { self.0.energy_from(f, past.split(1).1) }
///     fn response_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> Response { self.0.response_from(f, past.split(1).1) }
///     fn memory(&self) -> usize { 1 + self.0.memory() }
///     fn start(&self, memory: &mut [f64]) { self.0.start(&mut memory[1..]) }
///     fn remember(&self, f: &Matrix3<f64>, past: Past<'_>, next: &mut [f64]) {
///         next[0] = past.memory[0].max(f.norm());
///         self.0.remember(f, past.split(1).1, &mut next[1..]);
///     }
/// }
/// let (law, mut next) = (Counted(Rubber::neo_hookean(0.5, 1e3)?), [0.0]);
/// law.remember(&Matrix3::identity(), Past { memory: &[0.0], elapsed: 0.0 }, &mut next);
/// assert_eq!(next, [3f64.sqrt()]);
/// assert_eq!(law.initial_moduli().shear, 1.0);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
pub trait Material: Send + Sync {
    /// Stored energy $W_e(F)$ per reference volume \[stress\].
    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64;

    /// First Piola–Kirchhoff stress $P = \partial W_e/\partial F$ and tangent $\partial P/\partial F$ \[stress\].
    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response;

    /// Writes the stress and the tangent of [`response_from`](Material::response_from) in a few components $c = 3i + J$ alone:
    /// $P_{c_a}$ to `stress[a]`, $A_{c_a c_b}$ to `tangent[a * components.len() + b]`; where `tangent` is empty the stress alone is
    /// requested.
    ///
    /// Plane and radial bodies ask for two to five of the nine. Nothing needs to be written for it; a material
    /// that does is quicker there.
    fn respond(&self, f: &Mat3, past: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        self.response_from(f, past).select(components, stress, tangent);
    }

    /// The material that this one wraps: what is not written here is that of it.
    fn inner(&self) -> Option<&dyn Material> {
        None
    }

    /// The energy $\tilde W(J)$ of (2.8) that is added to $W_e$, the energy of the shape then; none where $W_e$ is the whole.
    fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
        self.inner()?.volumetric()
    }

    /// Its moduli at $F = \delta$.
    fn initial_moduli(&self) -> InitialModuli {
        match self.inner() {
            Some(inner) => inner.initial_moduli(),
            None => InitialModuli::of(&self.response(&Mat3::identity()).tangent),
        }
    }

    /// The whole deformation gradient where the material itself settles a part of it, as the thickness of a sheet in plane
    /// stress; else $F$ as it is.
    fn settled(&self, f: &Mat3, past: Past<'_>) -> Mat3 {
        self.inner().map_or(*f, |inner| inner.settled(f, past))
    }

    /// Refuses what makes no material, a law within another one that can't stand there, say; the default accepts all.
    ///
    /// # Errors
    /// Where the material can't be what it was put together for.
    fn validate(&self) -> Result<(), MaterialError> {
        self.inner().map_or(Ok(()), |inner| inner.validate())
    }

    /// How many numbers it remembers of a point: relaxation ([`Viscoelastic`]), softening ([`Mullins`]).
    fn memory(&self) -> usize {
        self.inner().map_or(0, |inner| inner.memory())
    }

    /// Writes the memory at rest into zeros.
    fn start(&self, memory: &mut [f64]) {
        if let Some(inner) = self.inner() {
            inner.start(memory);
        }
    }

    /// Writes the memory at the end of a step.
    fn remember(&self, f: &Mat3, past: Past<'_>, next: &mut [f64]) {
        if let Some(inner) = self.inner() {
            inner.remember(f, past, next);
        }
    }

    /// The square of the error of the stress that the step of time has left, and the square of the stress, at a point:
    /// for laws whose steps are exact, zero. `before` has the memory a step earlier and the time from there, where the
    /// rate of loading had no break point; `next` that at the end of the step.
    fn time_error(&self, before: Option<Past<'_>>, past: Past<'_>, next: &[f64]) -> [f64; 2] {
        self.inner().map_or([0.0; 2], |inner| inner.time_error(before, past, next))
    }

    /// The series by which the stress of the shape relaxes, of nested laws the outer one's, none where nothing does: what stabilises a body
    /// relaxes alike.
    fn relaxation(&self) -> Option<&Prony> {
        self.inner()?.relaxation()
    }

    /// The whole energy $W(F)$ of a sudden step from rest \[stress\]; NaN for $J \le 0$ where there is a volumetric part.
    fn energy(&self, f: &Mat3) -> f64 {
        let (rest, j) = (self.rest(), f.determinant());
        let shape = || self.energy_from(f, Past { memory: &rest, elapsed: 0.0 });
        match self.volumetric() {
            None => shape(),
            // (2.10) is finite at J <= 0, so the guard can't be left to the energies.
            Some(volumetric) if j > 0.0 => shape() + volumetric.evaluate(j).energy,
            Some(_) => f64::NAN,
        }
    }

    /// The whole stress and tangent of a sudden step from rest \[stress\]; with $p = \tilde W'(J)$ and
    /// $\operatorname{cof}F = \partial J/\partial F$,
    /// $$P = \frac{\partial W_e}{\partial F} + p\operatorname{cof}F,\qquad
    /// \frac{\partial P}{\partial F} = \frac{\partial^2 W_e}{\partial F\partial F}
    /// {}+ \tilde W''\operatorname{cof}F\otimes\operatorname{cof}F
    /// {}+ p\\,\frac{\partial^2 J}{\partial F\partial F}.$$
    fn response(&self, f: &Mat3) -> Response {
        let rest = self.rest();
        let shape = || self.response_from(f, Past { memory: &rest, elapsed: 0.0 });
        match self.volumetric() {
            None => shape(),
            // A NaN determinant is left out too.
            Some(volumetric) if f.determinant() > 0.0 => shape().with_volume(volumetric, f),
            Some(_) => Response::undefined(),
        }
    }

    /// The memory at rest.
    fn rest(&self) -> Vec<f64> {
        let mut memory = vec![0.0; self.memory()];
        self.start(&mut memory);
        memory
    }
}

/// Adds the stress and the tangent of a volumetric energy in a few components, as [`Material::respond`] writes them; NaN for
/// $J \le 0$.
pub(crate) fn respond_to_volume(
    volumetric: &dyn VolumetricEnergy,
    f: &Mat3,
    components: &[usize],
    stress: &mut [f64],
    tangent: &mut [f64],
) {
    let n = components.len();
    let j = f.determinant();
    if j.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        stress[..n].fill(f64::NAN);
        tangent.fill(f64::NAN);
        return;
    }
    let Volumetric { slope, curvature, .. } = volumetric.evaluate(j);
    let cof = cofactor(f);
    let entry = |c: usize| cof[(c / 3, c % 3)];
    for (a, &c) in components.iter().enumerate() {
        stress[a] += slope * entry(c);
        for (b, &d) in components.iter().enumerate().take(if tangent.is_empty() { 0 } else { n }) {
            tangent[a * n + b] += curvature * entry(c) * entry(d) + slope * determinant_hessian(f, c, d);
        }
    }
}

/// The material behind a pointer, with all that it overrides; and the volumetric energy behind one.
macro_rules! behind {
    ($($pointer:ty $(, $of:ident)?;)*) => {$(
        impl$(<$of: Material>)? Material for $pointer {
            fn inner(&self) -> Option<&dyn Material> {
                Some(&**self)
            }
            fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
                (**self).energy_from(f, past)
            }
            fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
                (**self).response_from(f, past)
            }
            fn respond(&self, f: &Mat3, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
                (**self).respond(f, past, of, stress, tangent);
            }
        }
    )*};
    (volume $($pointer:ty),*) => {$(
        impl<T: VolumetricEnergy + ?Sized> VolumetricEnergy for $pointer {
            fn evaluate(&self, j: f64) -> Volumetric {
                (**self).evaluate(j)
            }
            fn shape(&self) -> Option<VolumetricShape> {
                (**self).shape()
            }
        }
    )*};
}

behind! { &M, M; Box<M>, M; Arc<M>, M; &(dyn Material + '_); Box<dyn Material + '_>; Arc<dyn Material + '_>; }
behind! { volume &T, Box<T>, Arc<T> }

/// The split (2.8), $W = \bar W + \tilde W(J)$: a distortional energy beside a volumetric one.
///
/// `distortional` is expected to depend on $\bar F = J^{-1/3}F$ alone ([`Invariants`] and
/// [`PrincipalStretches`] see to it); then $p = \tilde W'(J)$ (2.15) is the mean Cauchy stress.
/// NaN for $J \le 0$.
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
    fn inner(&self) -> Option<&dyn Material> {
        Some(&self.distortional)
    }

    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
        self.distortional.energy_from(f, past)
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        self.distortional.response_from(f, past)
    }

    fn respond(&self, f: &Mat3, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        self.distortional.respond(f, past, of, stress, tangent);
    }

    fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
        Some(&self.volumetric)
    }

    fn initial_moduli(&self) -> InitialModuli {
        InitialModuli::of(&self.response(&Mat3::identity()).tangent)
    }
}
