//! Families of laws: coefficients in, a law out.

use std::sync::Arc;

use crate::error::{Invalid, MaterialError};
use crate::material::{
    ArrudaBoyce, Carroll, ExtendedTube, FoamTerm, Gent, GentGent, Hencky, Invariants, Material, Ogden, OgdenConvention,
    OgdenFoam, PrincipalStretches, RivlinPolynomial, TotalStretches,
};

/// A coefficient that is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// Its name in the report.
    pub name: String,
    /// Whether it is a stress: then `bounds` and `start` are in units of the shear modulus that the data suggest.
    pub is_stress: bool,
    /// Least and largest value; infinite where there is none. Values come near finite bounds and never reach them.
    pub bounds: [f64; 2],
    /// Between what random starts lie: evenly, or evenly in the logarithm where both are above zero.
    pub start: [f64; 2],
}

impl Coefficient {
    /// A stress above zero.
    pub fn modulus(name: impl Into<String>) -> Self {
        Self { name: name.into(), is_stress: true, bounds: [0.0, f64::INFINITY], start: [0.01, 2.0] }
    }

    /// A stress of either sign that starts in a range.
    pub fn stress(name: impl Into<String>, start: [f64; 2]) -> Self {
        Self { name: name.into(), is_stress: true, bounds: [f64::NEG_INFINITY, f64::INFINITY], start }
    }

    /// A number between bounds that starts in a range.
    pub fn number(name: impl Into<String>, bounds: [f64; 2], start: [f64; 2]) -> Self {
        Self { name: name.into(), is_stress: false, bounds, start }
    }
}

/// A family of laws with coefficients, to be fitted; [`Law`] has those of this crate.
///
/// ```
/// use std::sync::Arc;
/// use rkpm::error::MaterialError;
/// use rkpm::fit::{Coefficient, Family, Fit, TestData};
/// use rkpm::material::{Distortion, InvariantEnergy, Invariants, Material, Mode};
///
/// /// W = µ/(2b) (exp(b (I1 - 3)) - 1).
/// struct Fung { mu: f64, b: f64 }
/// impl InvariantEnergy for Fung {
///     fn evaluate(&self, i1: f64, _: f64) -> Distortion {
///         let w1 = 0.5 * self.mu * (self.b * (i1 - 3.0)).exp();
///         Distortion { energy: (w1 - 0.5 * self.mu) / self.b, w1, w11: self.b * w1, ..Distortion::default() }
///     }
/// }
/// struct FungFamily;
/// impl Family for FungFamily {
///     fn name(&self) -> String { "Fung".into() }
///     fn coefficients(&self) -> Vec<Coefficient> {
///         vec![Coefficient::modulus("mu"), Coefficient::number("b", [0.0, 50.0], [0.01, 1.0])]
///     }
///     fn build(&self, values: &[f64]) -> Result<Arc<dyn Material>, MaterialError> {
///         Ok(Arc::new(Invariants(Fung { mu: values[0], b: values[1] })))
///     }
/// }
///
/// let known = FungFamily.build(&[0.3, 0.2])?;
/// let points = (1..20).map(|k| 1.0 + 0.1 * k as f64).map(|x| [x, Mode::Uniaxial.incompressible_state(&known, x).stress]);
/// let report = Fit::new(FungFamily).to(&TestData::default().with(Mode::Uniaxial, points)?)?;
/// assert!((report.value("b").unwrap() - 0.2).abs() < 1e-6);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub trait Family: Send + Sync {
    /// The name of the law.
    fn name(&self) -> String;

    /// The coefficients.
    fn coefficients(&self) -> Vec<Coefficient>;

    /// The law: its distortional energy, or where it [`is_compressible`](Self::is_compressible) the whole.
    ///
    /// # Errors
    /// For values that the law does not take; the search turns back there.
    fn build(&self, values: &[f64]) -> Result<Arc<dyn Material>, MaterialError>;

    /// Whether volume is part of the law, as in foams; else bodies are taken for incompressible.
    fn is_compressible(&self) -> bool {
        false
    }

    /// Puts terms that may change places into one order, so that equal laws have equal coefficients; called where the terms that would
    /// change places have the same bounds.
    fn arrange(&self, _values: &mut [f64]) {}
}

/// The laws of this crate as families.
///
/// | law | coefficients |
/// |---|---|
/// | `NeoHookean` | `A_10` |
/// | `MooneyRivlin` | `A_10`, `A_01` |
/// | `Yeoh` | `A_10`, `A_20`, `A_30` |
/// | `Ogden(n)` | `mu_p`, `alpha_p` with $\frac{2\mu_p}{\alpha_p^2}$ ([`OgdenConvention::ShearModuli`]) and $\mu_p > 0$: each term is stable |
/// | `Hencky` | `mu` |
/// | `Gent` | `mu`, `J_m` |
/// | `GentGent` | `mu`, `J_m`, `C_2` |
/// | `ArrudaBoyce` | `mu`, `lambda_m` |
/// | `Carroll` | `A`, `B`, `C` |
/// | `ExtendedTube` | `G_c`, `G_e`, `beta`, `delta` |
/// | `Foam(n)` | `mu_p`, `alpha_p`, `nu_p` of [`OgdenFoam`] |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Law {
    /// [`Rubber::neo_hookean`](crate::material::Rubber::neo_hookean).
    NeoHookean,
    /// [`Rubber::mooney_rivlin`](crate::material::Rubber::mooney_rivlin).
    MooneyRivlin,
    /// [`Rubber::yeoh`](crate::material::Rubber::yeoh).
    Yeoh,
    /// [`Ogden`] with a number of terms.
    Ogden(usize),
    /// [`Hencky`].
    Hencky,
    /// [`Gent`].
    Gent,
    /// [`GentGent`].
    GentGent,
    /// [`ArrudaBoyce`].
    ArrudaBoyce,
    /// [`Carroll`].
    Carroll,
    /// [`ExtendedTube`].
    ExtendedTube,
    /// [`OgdenFoam`] with a number of terms.
    Foam(usize),
}

/// Exponents of Ogden's terms lie between these; rubbers have them between -10 and 15.
const EXPONENTS: [f64; 2] = [-25.0, 25.0];

impl Family for Law {
    fn name(&self) -> String {
        match self {
            Law::NeoHookean => "neo-Hookean".into(),
            Law::MooneyRivlin => "Mooney-Rivlin".into(),
            Law::Yeoh => "Yeoh".into(),
            Law::Ogden(n) => format!("Ogden, {n} terms"),
            Law::Hencky => "Hencky".into(),
            Law::Gent => "Gent".into(),
            Law::GentGent => "Gent-Gent".into(),
            Law::ArrudaBoyce => "Arruda-Boyce".into(),
            Law::Carroll => "Carroll".into(),
            Law::ExtendedTube => "extended tube".into(),
            Law::Foam(n) => format!("foam, {n} terms"),
        }
    }

    fn coefficients(&self) -> Vec<Coefficient> {
        let modulus = |name: String| Coefficient::modulus(name);
        let numbered = |name: &str, p: usize| format!("{name}_{}", p + 1);
        let limit = || Coefficient::number("J_m", [0.0, f64::INFINITY], [5.0, 500.0]);
        match *self {
            Law::NeoHookean => vec![modulus("A_10".into())],
            Law::MooneyRivlin => vec![modulus("A_10".into()), Coefficient::stress("A_01", [-0.1, 0.5])],
            Law::Yeoh => vec![
                modulus("A_10".into()),
                Coefficient::stress("A_20", [-0.1, 0.1]),
                Coefficient::stress("A_30", [-0.01, 0.01]),
            ],
            Law::Ogden(n) => (0..n)
                .flat_map(|p| {
                    let exponent = Coefficient::number(numbered("alpha", p), EXPONENTS, [-8.0, 12.0]);
                    [Coefficient { start: [1e-4, 2.0], ..modulus(numbered("mu", p)) }, exponent]
                })
                .collect(),
            Law::Hencky => vec![modulus("mu".into())],
            Law::Gent => vec![modulus("mu".into()), limit()],
            Law::GentGent => vec![modulus("mu".into()), limit(), Coefficient::stress("C_2", [-0.1, 1.0])],
            Law::ArrudaBoyce => {
                vec![modulus("mu".into()), Coefficient::number("lambda_m", [0.0, f64::INFINITY], [1.0, 20.0])]
            }
            Law::Carroll => vec![
                modulus("A".into()),
                Coefficient { start: [1e-9, 1e-3], ..modulus("B".into()) },
                Coefficient::stress("C", [-0.1, 1.0]),
            ],
            Law::ExtendedTube => vec![
                modulus("G_c".into()),
                modulus("G_e".into()),
                Coefficient::number("beta", [0.0, 10.0], [0.05, 2.0]),
                // Beyond 1/√2 crosslinks alone would be unstable at rest.
                Coefficient::number("delta", [0.0, std::f64::consts::FRAC_1_SQRT_2], [0.01, 0.3]),
            ],
            Law::Foam(n) => (0..n)
                .flat_map(|p| {
                    [
                        modulus(numbered("mu", p)),
                        Coefficient::number(numbered("alpha", p), EXPONENTS, [-8.0, 12.0]),
                        Coefficient::number(numbered("nu", p), [-0.9, 0.4999], [0.0, 0.45]),
                    ]
                })
                .collect(),
        }
    }

    fn build(&self, values: &[f64]) -> Result<Arc<dyn Material>, MaterialError> {
        let expected = self.coefficients().len();
        ensure!(
            values.len() == expected,
            Invalid::new(
                format!("constants of {}", self.name()),
                values.len() as f64,
                "give one value for each coefficient of the law"
            )
        );
        let v = values;
        Ok(match self {
            Law::NeoHookean => Arc::new(Invariants(RivlinPolynomial::neo_hookean(v[0])?)),
            Law::MooneyRivlin => Arc::new(Invariants(RivlinPolynomial::mooney_rivlin(v[0], v[1])?)),
            Law::Yeoh => Arc::new(Invariants(RivlinPolynomial::yeoh(v[0], v[1], v[2])?)),
            Law::Ogden(_) => {
                let terms = v.chunks_exact(2).map(|term| (term[0], term[1]));
                Arc::new(PrincipalStretches(Ogden::in_convention(OgdenConvention::ShearModuli, terms)?))
            }
            Law::Hencky => Arc::new(PrincipalStretches(Hencky::new(v[0])?)),
            Law::Gent => Arc::new(Invariants(Gent::new(v[0], v[1])?)),
            Law::GentGent => Arc::new(Invariants(GentGent::new(v[0], v[1], v[2])?)),
            Law::ArrudaBoyce => Arc::new(Invariants(ArrudaBoyce::new(v[0], v[1])?)),
            Law::Carroll => Arc::new(Invariants(Carroll::new(v[0], v[1], v[2])?)),
            Law::ExtendedTube => Arc::new(PrincipalStretches(ExtendedTube::new(v[0], v[1], v[2], v[3])?)),
            Law::Foam(_) => {
                let term = |t: &[f64]| FoamTerm { shear: t[0], exponent: t[1], poisson: t[2] };
                Arc::new(TotalStretches(OgdenFoam::new(v.chunks_exact(3).map(term))?))
            }
        })
    }

    fn is_compressible(&self) -> bool {
        matches!(self, Law::Foam(_))
    }

    fn arrange(&self, values: &mut [f64]) {
        let width = match self {
            Law::Ogden(_) => 2,
            Law::Foam(_) => 3,
            _ => return,
        };
        let mut terms: Vec<Vec<f64>> = values.chunks_exact(width).map(<[f64]>::to_vec).collect();
        terms.sort_by(|a, b| b[1].total_cmp(&a[1]));
        for (target, value) in values.iter_mut().zip(terms.into_iter().flatten()) {
            *target = value;
        }
    }
}
