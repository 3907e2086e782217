//! Functionals of the displacement that may control an analysis in place of the load.
use crate::each::Each;
/// A scalar function of the displacement that may control an analysis in place of the load.
///
/// ```
/// use rkpm::solve::Functional;
/// /// The sum of the squares of all coefficients.
/// struct Square;
/// impl Functional for Square {
///     fn value(&self, d: &[f64]) -> f64 { d.iter().map(|x| x * x).sum() }
///     fn gradient(&self, d: &[f64], out: &mut [f64]) {
///         for (o, x) in out.iter_mut().zip(d) { *o = 2.0 * x; }
///     }
/// }
/// assert_eq!(Square.value(&[1.0, 2.0]), 5.0);
/// ```
pub trait Functional: Send + Sync {
    /// $q(d)$.
    fn value(&self, displacement: &[f64]) -> f64;

    /// Writes $\partial q/\partial d$.
    fn gradient(&self, displacement: &[f64], out: &mut [f64]);

    /// Number of displacement unknowns that it is made for, `None` where any will do.
    fn unknowns(&self) -> Option<usize> {
        None
    }
}

/// A linear functional $q = c\cdot d$: a displacement at a point, or a generalised deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct Deflection {
    /// $c$, one entry per coefficient.
    pub weights: Vec<f64>,
}

impl Functional for Deflection {
    fn value(&self, displacement: &[f64]) -> f64 {
        self.weights.pair_sum(displacement, |c, d| c * d)
    }

    fn gradient(&self, _displacement: &[f64], out: &mut [f64]) {
        for (o, weight) in out.iter_mut().zip(&self.weights) {
            *o = *weight;
        }
    }

    fn unknowns(&self) -> Option<usize> {
        Some(self.weights.len())
    }
}

/// What is held fixed while Newton iterates.
#[derive(Clone, Copy)]
pub enum Control<'a> {
    /// The load factor.
    Load(f64),
    /// A functional of the displacement, the load factor being unknown.
    Functional(&'a dyn Functional, f64),
}
