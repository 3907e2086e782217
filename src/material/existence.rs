//! The existence conditions of the paper's §5, checked for a polynomial energy and a volumetric one.

use std::fmt;

use super::{RivlinPolynomial, VolumetricEnergy};
use crate::each::Each;

/// Whether a condition holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExistenceVerdict {
    /// The material satisfies it.
    Holds,
    /// The material violates it.
    Fails,
    /// It can't be said: what it asks about isn't known or isn't defined for this material.
    Unknown,
}

impl From<bool> for ExistenceVerdict {
    fn from(holds: bool) -> Self {
        if holds { Self::Holds } else { Self::Fails }
    }
}

/// One of the conditions (5.6)–(5.13).
#[derive(Debug, Clone, PartialEq)]
pub struct ExistenceCondition {
    /// The paper's equation number, such as "5.10".
    pub equation: &'static str,
    /// Whether it holds.
    pub verdict: ExistenceVerdict,
    /// What was found.
    pub detail: String,
}

/// The conditions (a)–(c) of Theorem 5.1 for one material, made by [`Rubber::existence`](super::Rubber::existence).
///
/// They are sufficient for a solution to exist, not necessary: rubbers that violate some of them
/// (Mooney–Rivlin, the paper's own material) are solved every day.
#[derive(Debug, Clone, PartialEq)]
pub struct ExistenceReport {
    /// One entry per equation, (5.6) to (5.13) in order.
    pub conditions: Vec<ExistenceCondition>,
    /// The largest exponent $\alpha_i$ of (5.7), or $\beta/2$ where there are only $b_i$.
    pub alpha: Option<f64>,
    /// The largest exponent $\beta_i$ of (5.7), or $\alpha/2$ where there are only $a_i$.
    pub beta: Option<f64>,
    /// The growth $\gamma$ of (5.11).
    pub gamma: Option<f64>,
    /// $p = 3\alpha\gamma/(\alpha+3\gamma)$ of (5.13).
    pub p: Option<f64>,
    /// $q = 3\beta\gamma/(2\beta+3\gamma)$ of (5.13).
    pub q: Option<f64>,
}

impl ExistenceReport {
    /// Whether every condition holds.
    pub fn holds(&self) -> bool {
        self.conditions.iter().all(|condition| condition.verdict == ExistenceVerdict::Holds)
    }

    /// The verdict on one equation, such as "5.10"; `None` for an equation outside (5.6)–(5.13).
    pub fn verdict(&self, equation: &str) -> Option<ExistenceVerdict> {
        self.conditions.iter().find(|condition| condition.equation == equation).map(|condition| condition.verdict)
    }
}

impl fmt::Display for ExistenceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for condition in &self.conditions {
            let verdict = match condition.verdict {
                ExistenceVerdict::Holds => "holds",
                ExistenceVerdict::Fails => "fails",
                ExistenceVerdict::Unknown => "unknown",
            };
            writeln!(f, "({:<4}) {verdict:<7} {}", condition.equation, condition.detail)?;
        }
        Ok(())
    }
}

/// Checks the existence conditions (5.6)–(5.13) for $\bar W$ of (2.9) and a volumetric energy.
///
/// With $\bar A = J^{-1/3}F$ and $B = \operatorname{adj}\bar A$, $\bar I_1 = \operatorname{tr}\bar A^T\bar A$
/// and $\bar I_2 = \operatorname{tr}B^TB$: the polynomial is expanded in powers of $\bar I_1$ and
/// $\bar I_2$, and the form (5.7)
/// $$\bar w = \sum_i a_i\bar I_1^{\alpha_i/2} + \sum_i b_i\bar I_2^{\beta_i/2} + c$$
/// follows with $\alpha_i$ and $\beta_i$ twice the exponents. Different powers are independent, so the
/// expansion decides (5.7) and (5.8); mixed terms $m, n \ge 1$ have no such form.
/// The volumetric conditions are read from [`VolumetricEnergy::shape`].
///
/// Where one of the two sums is empty its exponent is taken from the other: $\det\bar A = 1$ makes
/// $\bar I_2 \le \bar I_1^2/3$ and $\bar I_1 \le \bar I_2^2/3$, so that $\bar I_1^{\alpha/2}$ alone
/// bounds $\bar I_2^{\beta/2}$ with $\beta = \alpha/2$, and the other way round.
pub(crate) fn existence(distortional: &RivlinPolynomial, volumetric: &dyn VolumetricEnergy) -> ExistenceReport {
    let mut conditions = Vec::with_capacity(8);
    let mut note = |equation, verdict: ExistenceVerdict, detail: String| {
        conditions.push(ExistenceCondition { equation, verdict, detail });
    };

    note("5.6", ExistenceVerdict::Holds, "a polynomial in tr(AᵀA) and tr(BᵀB), A = J^(-1/3) F, B = adj A".into());
    let mixed: Vec<_> =
        distortional.terms().filter(|((m, n), _)| *m > 0 && *n > 0).map(|((m, n), _)| format!("A_{m}{n}")).collect();
    let pure = Expansion::new(distortional);
    let (mut alpha, mut beta) = (None, None);
    if mixed.is_empty() {
        let show = |name: &str, exponent: &str, terms: &[(f64, f64)]| -> Vec<String> {
            terms.mapped(|(power, coefficient)| format!("{name} = {coefficient:.4} with {exponent} = {power}"))
        };
        let mut terms = show("a", "alpha", &pure.first);
        terms.extend(show("b", "beta", &pure.second));
        note("5.7", ExistenceVerdict::Holds, terms.join(", "));
        // The bounds 3/2 and 3 make J^(-α/3)|F|^α and J^(-2β/3)|adj F|^β convex in (F, adj F, J).
        let faults: Vec<_> = violations("a", &pure.first, 1.5).chain(violations("b", &pure.second, 3.0)).collect();
        let detail =
            if faults.is_empty() { "every a, b > 0, alpha >= 3/2, beta >= 3".into() } else { faults.join(", ") };
        note("5.8", faults.is_empty().into(), detail);
        alpha = largest(&pure.first).or(largest(&pure.second).map(|beta| 0.5 * beta));
        beta = largest(&pure.second).or(largest(&pure.first).map(|alpha| 0.5 * alpha));
    } else {
        let mixed = mixed.join(", ");
        note("5.7", ExistenceVerdict::Fails, format!("mixed terms {mixed}"));
        note("5.8", ExistenceVerdict::Unknown, "asks for the form (5.7)".into());
    }

    let shape = volumetric.shape();
    let mut ask = |equation, holds: Option<bool>, yes: &str, no: &str| match holds {
        None => note(equation, ExistenceVerdict::Unknown, "the volumetric energy gives no shape".into()),
        Some(true) => note(equation, ExistenceVerdict::Holds, yes.into()),
        Some(false) => note(equation, ExistenceVerdict::Fails, no.into()),
    };
    ask("5.9", shape.map(|s| s.convex), "G is convex", "G is not convex");
    ask(
        "5.10",
        shape.map(|s| s.infinite_at_zero),
        "G grows without bound for J -> 0",
        "G is finite at J = 0: the solver must keep J > 0",
    );
    let gamma = shape.and_then(|s| s.growth);
    ask(
        "5.11",
        // γ = 1 and NaN fail too.
        shape.map(|_| gamma.is_some_and(|gamma| gamma > 1.0)),
        &format!("gamma = {}", gamma.unwrap_or(f64::NAN)),
        "G grows no faster than J for large J",
    );
    ask(
        "5.12",
        shape.map(|s| s.zero_only_at_one),
        "G = 0 only at J = 1",
        "G has other zeros than J = 1, or none there",
    );

    // Written in reciprocals, which stay defined for γ = ∞: 1/p = 1/α + 1/(3γ), 1/q = 1/β + 2/(3γ).
    let reciprocal = |exponent: Option<f64>, times: f64| Some(exponent?.recip() + times / (3.0 * gamma?));
    let (p, q) = (reciprocal(alpha, 1.0), reciprocal(beta, 2.0));
    match (p, q) {
        (Some(over_p), Some(over_q)) => note(
            "5.13",
            // Round-off must not decide equality, which fails both: neo-Hookean with γ = 2 has p = 3/2.
            (over_p < 2.0 / 3.0 - 1e-12 && over_p + over_q < 4.0 / 3.0 - 1e-12).into(),
            format!(
                "p = {:.4} (> 3/2 required), 1/p + 1/q = {:.4} (< 4/3 required){}",
                over_p.recip(),
                over_p + over_q,
                match (pure.first.is_empty(), pure.second.is_empty()) {
                    (_, true) => "; no b, beta = alpha/2 from tr(BᵀB) <= tr(AᵀA)²/3",
                    (true, _) => "; no a, alpha = beta/2 from tr(AᵀA) <= tr(BᵀB)²/3",
                    _ => "",
                }
            ),
        ),
        _ => note("5.13", ExistenceVerdict::Unknown, "asks for alpha and beta of (5.7) and gamma of (5.11)".into()),
    }
    ExistenceReport { conditions, alpha, beta, gamma, p: p.map(f64::recip), q: q.map(f64::recip) }
}

/// The pure powers of a polynomial: pairs (twice the exponent, coefficient).
struct Expansion {
    /// (α_i, a_i): powers of Ī1.
    first: Vec<(f64, f64)>,
    /// (β_i, b_i): powers of Ī2.
    second: Vec<(f64, f64)>,
}

impl Expansion {
    /// Expands (Ī1 - 3)^m and (Ī2 - 3)^n; mixed terms are left out.
    fn new(polynomial: &RivlinPolynomial) -> Self {
        let powers = RivlinPolynomial::LARGEST_EXPONENT as usize + 1;
        // Sums and sums of magnitudes, by exponent.
        let mut sums = [vec![(0.0, 0.0); powers], vec![(0.0, 0.0); powers]];
        for ((m, n), a) in polynomial.terms() {
            let (degree, sums) = match (m, n) {
                (degree, 0) => (degree as i32, &mut sums[0]),
                (0, degree) => (degree as i32, &mut sums[1]),
                _ => continue,
            };
            // The coefficients C(degree, power) (-3)^(degree - power), from the highest power down.
            let mut binomial = 1.0;
            for power in (1..=degree).rev() {
                let term = a * binomial * (-3.0_f64).powi(degree - power);
                let sum = &mut sums[power as usize];
                sum.0 += term;
                sum.1 += term.abs();
                binomial *= f64::from(power) / f64::from(degree - power + 1);
            }
        }
        let [first, second] = sums.map(|sums| {
            sums.into_iter()
                .enumerate()
                // What is left of a cancellation is round-off, not a term.
                .filter(|(_, (sum, size))| sum.abs() > 64.0 * f64::EPSILON * size)
                .map(|(power, (sum, _))| (2.0 * power as f64, sum))
                .collect()
        });
        Self { first, second }
    }
}

/// The terms of a sum in (5.7) that violate (5.8), in words.
fn violations(name: &'static str, terms: &[(f64, f64)], least: f64) -> impl Iterator<Item = String> {
    terms.iter().filter_map(move |&(exponent, coefficient)| {
        if coefficient <= 0.0 {
            Some(format!("{name} = {coefficient:.4} at exponent {exponent}"))
        } else if exponent < least {
            Some(format!("exponent {exponent} of {name} below {least}"))
        } else {
            None
        }
    })
}

/// The largest exponent of a sum in (5.7).
fn largest(terms: &[(f64, f64)]) -> Option<f64> {
    terms.iter().map(|term| term.0).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{HartmannNeffVolume, LogarithmicVolume, MixedLogarithmicVolume, Volumetric};
    use approx::assert_abs_diff_eq;

    fn verdicts(terms: &[((u32, u32), f64)], volumetric: &dyn VolumetricEnergy) -> ExistenceReport {
        existence(&RivlinPolynomial::new(terms.iter().copied()).unwrap(), volumetric)
    }

    #[test]
    fn exponents_and_growth_decide_the_last_condition() {
        let neo_hookean = [((1, 0), 0.5)];
        // α = 2, γ = 2: p = 12/8 = 3/2, which is not above 3/2.
        let report = verdicts(&neo_hookean, &MixedLogarithmicVolume { bulk: 1.0 });
        assert_eq!(report.verdict("5.13"), Some(ExistenceVerdict::Fails));
        assert_abs_diff_eq!(report.p.unwrap(), 1.5, epsilon = 1e-15);
        // γ = 5: p = 30/17 > 3/2, but 1/2 + 1/1 + 1/5 > 4/3 with β = α/2 = 1.
        let report = verdicts(&neo_hookean, &HartmannNeffVolume { bulk: 1.0 });
        assert_eq!(report.verdict("5.13"), Some(ExistenceVerdict::Fails));
        assert_abs_diff_eq!(report.p.unwrap(), 30.0 / 17.0, epsilon = 1e-14);
        // A term of β = 4 helps: 1/2 + 1/4 + 1/5 < 4/3. Its linear part 0.6 - 6 × 0.1 is round-off.
        let helped = [((1, 0), 0.5), ((0, 1), 0.6), ((0, 2), 0.1)];
        let report = verdicts(&helped, &HartmannNeffVolume { bulk: 1.0 });
        assert_eq!((report.alpha, report.beta), (Some(2.0), Some(4.0)));
        assert!(report.holds(), "{report}");
    }

    #[test]
    fn mixed_terms_have_no_such_form() {
        let report = verdicts(&[((1, 0), 0.5), ((1, 1), 0.1)], &MixedLogarithmicVolume { bulk: 1.0 });
        let found = ["5.6", "5.7", "5.8", "5.13"].map(|equation| report.verdict(equation).unwrap());
        assert_eq!(
            found,
            [ExistenceVerdict::Holds, ExistenceVerdict::Fails, ExistenceVerdict::Unknown, ExistenceVerdict::Unknown]
        );
        assert!(report.to_string().contains("A_11"), "{report}");
    }

    #[test]
    fn the_volumetric_conditions_come_from_its_shape() {
        struct Shapeless;
        impl VolumetricEnergy for Shapeless {
            fn evaluate(&self, j: f64) -> Volumetric {
                Volumetric { energy: 0.0, slope: 0.0, curvature: j }
            }
        }
        let stiffening = [((1, 0), 1.0), ((2, 0), 0.1)];
        let report = verdicts(&stiffening, &Shapeless);
        let volumetric = ["5.9", "5.10", "5.11", "5.12", "5.13"];
        assert!(volumetric.iter().all(|equation| report.verdict(equation) == Some(ExistenceVerdict::Unknown)));
        let report = verdicts(&stiffening, &LogarithmicVolume { bulk: 1.0 });
        let found = volumetric.map(|equation| report.verdict(equation).unwrap());
        use ExistenceVerdict::{Fails, Holds, Unknown};
        assert_eq!(found, [Fails, Holds, Fails, Holds, Unknown]);
    }
}
