//! Energies of the change of volume.

use super::constants::check;
use crate::error::MaterialError;

/// A volumetric energy and its derivatives at one J \[stress\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volumetric {
    /// $\tilde W(J)$.
    pub energy: f64,
    /// $\tilde W'(J)$, the hydrostatic pressure of (2.15) (tension positive).
    pub slope: f64,
    /// $\tilde W''(J)$.
    pub curvature: f64,
}

/// What the existence theorem 5.1(b) asks about $G = \tilde W/k$ as a function on $(0,\infty)$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumetricShape {
    /// (5.9): $G$ is convex and not negative.
    pub convex: bool,
    /// (5.10): $G\to\infty$ for $J\to0_+$.
    pub infinite_at_zero: bool,
    /// (5.11): the largest $\gamma$ with $G\ge cJ^\gamma$ for some $c>0$ and large $J$; `None` where no
    /// $\gamma > 0$ will do, infinite where any will.
    pub growth: Option<f64>,
    /// (5.12): $G = 0$ at $J = 1$ and only there.
    pub zero_only_at_one: bool,
}

/// An energy $\tilde W(J)$ of the change of volume, as in (2.8).
///
/// It should have $\tilde W(1) = \tilde W'(1) = 0$ and $\tilde W''(1) = k$, the bulk modulus. Ogden's
/// energy $\frac{k}{\beta^2}\left(\beta\ln J + J^{-\beta} - 1\right)$:
///
/// ```
/// use rkpm::material::{Volumetric, VolumetricEnergy};
///
/// struct OgdenVolume { bulk: f64, beta: f64 }
///
/// impl VolumetricEnergy for OgdenVolume {
///     fn evaluate(&self, j: f64) -> Volumetric {
///         let (k, b, power) = (self.bulk, self.beta, j.powf(-self.beta));
///         Volumetric {
///             energy: k / (b * b) * (b * j.ln() + power - 1.0),
///             slope: k / (b * j) * (1.0 - power),
///             curvature: k / (b * j * j) * ((1.0 + b) * power - 1.0),
///         }
///     }
/// }
///
/// let volume = OgdenVolume { bulk: 2.0, beta: 9.0 };
/// assert_eq!(volume.evaluate(1.0), Volumetric { energy: 0.0, slope: 0.0, curvature: 2.0 });
/// ```
pub trait VolumetricEnergy: Send + Sync {
    /// The energy and its derivatives at $J$; NaN where it is undefined, never a panic.
    fn evaluate(&self, j: f64) -> Volumetric;

    /// The facts that the existence conditions (5.9)–(5.12) ask for, where they are known.
    fn shape(&self) -> Option<VolumetricShape> {
        None
    }
}

/// The quadratic energy (2.10), $\tilde W = \frac k2(J-1)^2$.
///
/// It is finite at $J = 0$, against (5.10): only the solver keeps $J$ above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

/// The energy $\tilde W = \frac k4\left(J^2 - 1 - 2\ln J\right)$ of Simo and Miehe, which satisfies
/// (5.9)–(5.12) with $\gamma = 2$.
///
/// (Computer Methods in Applied Mechanics and Engineering 98, 1992.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MixedLogarithmicVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

/// The energy $\tilde W = \frac k2(\ln J)^2$ that goes with [`Hencky`](super::Hencky).
///
/// It isn't convex beyond $J = e$ and grows slower than any power, against (5.9) and (5.11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogarithmicVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

/// The energy $\tilde W = \frac{k}{50}\left(J^5 + J^{-5} - 2\right)$ of Hartmann and Neff, which
/// satisfies (5.9)–(5.12) with $\gamma = 5$.
///
/// Its faster growth admits smaller exponents $\alpha$, $\beta$ in (5.13). (International Journal of
/// Solids and Structures 40, 2003.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HartmannNeffVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

macro_rules! checked {
    ($($volume:ident),*) => {$(
        impl $volume {
            /// The energy with bulk modulus `bulk` $= k$ \[stress\].
            ///
            /// # Errors
            /// [`MaterialError::Invalid`] unless it is finite and above zero.
            pub fn new(bulk: f64) -> Result<Self, MaterialError> {
                check("k", bulk, bulk > 0.0 && bulk.is_finite(), "a bulk modulus is a finite number above zero")?;
                Ok(Self { bulk })
            }
        }
    )*};
}

checked!(QuadraticVolume, MixedLogarithmicVolume, LogarithmicVolume, HartmannNeffVolume);

/// NaN where an energy with a singularity at J = 0 is undefined: powers would be finite again below it.
const UNDEFINED: Volumetric = Volumetric { energy: f64::NAN, slope: f64::NAN, curvature: f64::NAN };

impl VolumetricEnergy for QuadraticVolume {
    #[inline]
    fn evaluate(&self, j: f64) -> Volumetric {
        let slope = self.bulk * (j - 1.0);
        Volumetric { energy: 0.5 * slope * (j - 1.0), slope, curvature: self.bulk }
    }

    fn shape(&self) -> Option<VolumetricShape> {
        Some(VolumetricShape { convex: true, infinite_at_zero: false, growth: Some(2.0), zero_only_at_one: true })
    }
}

impl VolumetricEnergy for MixedLogarithmicVolume {
    fn evaluate(&self, j: f64) -> Volumetric {
        if j.is_nan() || j <= 0.0 {
            return UNDEFINED;
        }
        let d = j - 1.0;
        Volumetric {
            // J² - 1 - 2 ln J = d² + 2 (d - ln(1 + d)): the second term is accurate only to the
            // round-off of d, so that the sum is good to ε/d.
            energy: 0.25 * self.bulk * (d * d + 2.0 * (d - d.ln_1p())),
            slope: 0.5 * self.bulk * d * (j + 1.0) / j,
            curvature: 0.5 * self.bulk * (1.0 + 1.0 / (j * j)),
        }
    }

    fn shape(&self) -> Option<VolumetricShape> {
        Some(VolumetricShape { convex: true, infinite_at_zero: true, growth: Some(2.0), zero_only_at_one: true })
    }
}

impl VolumetricEnergy for LogarithmicVolume {
    fn evaluate(&self, j: f64) -> Volumetric {
        if j.is_nan() || j <= 0.0 {
            return UNDEFINED;
        }
        let logarithm = j.ln();
        Volumetric {
            energy: 0.5 * self.bulk * logarithm * logarithm,
            slope: self.bulk * logarithm / j,
            curvature: self.bulk * (1.0 - logarithm) / (j * j),
        }
    }

    fn shape(&self) -> Option<VolumetricShape> {
        Some(VolumetricShape { convex: false, infinite_at_zero: true, growth: None, zero_only_at_one: true })
    }
}

impl VolumetricEnergy for HartmannNeffVolume {
    fn evaluate(&self, j: f64) -> Volumetric {
        if j.is_nan() || j <= 0.0 {
            return UNDEFINED;
        }
        let (power, inverse) = (j.powi(5), j.powi(-5));
        // J⁵ + J⁻⁵ - 2 = (J⁵ - 1)²/J⁵ and J⁵ - 1 = (J - 1)(1 + J + J² + J³ + J⁴), without cancellation.
        let difference = (j - 1.0) * (1.0 + j * (1.0 + j * (1.0 + j * (1.0 + j))));
        Volumetric {
            energy: self.bulk / 50.0 * difference * difference * inverse,
            slope: self.bulk / 10.0 * difference * (power + 1.0) * inverse / j,
            curvature: self.bulk / 10.0 * (4.0 * power + 6.0 * inverse) / (j * j),
        }
    }

    fn shape(&self) -> Option<VolumetricShape> {
        Some(VolumetricShape { convex: true, infinite_at_zero: true, growth: Some(5.0), zero_only_at_one: true })
    }
}
