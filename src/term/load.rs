//! Loads: dead forces, follower pressure, elastic foundation.

use crate::each::array_of;
use crate::error::{Invalid, SolveError};
use crate::geometry::Vec3;
use crate::tensor::cofactor;

use super::amplitude::Amplitude;
use super::integrand::{Integrand, PointDerivatives, PointState, Sparsity};

/// A force per reference volume (body force), per reference area (dead traction) or, on a table of one
/// point of weight 1, a point load; $\Pi = -\int u\cdot b\\,a(\lambda)$, (4.4).
#[derive(Debug, Clone, PartialEq)]
pub struct DeadLoad {
    /// The force density $b$ \[stress/length, stress or force\].
    pub force: Vec3,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
}

impl Integrand for DeadLoad {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, derivatives: &mut PointDerivatives) {
        let (factor, slope) = self.amplitude.evaluate(at.load);
        derivatives.force = -self.force * factor;
        derivatives.force_by_load = -self.force * slope;
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn amplitudes(&self, _: &Vec3) -> Vec<Amplitude> {
        vec![self.amplitude.clone()]
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.amplitude.validate_of("a dead load")
    }
}

/// A pressure that follows the surface: traction $-p\\,a(\lambda)\operatorname{cof}(F)N$ per reference
/// area, $N$ outward from the body, $p$ positive inwards. Its points need normals: those of a boundary have them.
///
/// Its derivative is the load stiffness; without it Newton is not quadratic. On boundaries that are
/// closed or held at their ends it is symmetric in total.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowerPressure {
    /// The pressure $p$ \[stress\].
    pub pressure: f64,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
}

impl Integrand for FollowerPressure {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, force_by_gradient: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, derivatives: &mut PointDerivatives) {
        let (factor, slope) = self.amplitude.evaluate(at.load);
        let area = cofactor(&at.deformation) * at.normal;
        derivatives.force = area * (self.pressure * factor);
        derivatives.force_by_load = area * (self.pressure * slope);
        // ∂cof F_iJ/∂F_kL N_J = ε_ikm (f_m × N)_L with the rows f_m of F.
        let rows: [Vec3; 3] = array_of(|m| at.deformation.row(m).transpose().cross(&at.normal));
        for i in 0..3 {
            let (k, m) = ((i + 1) % 3, (i + 2) % 3);
            for l in 0..3 {
                derivatives.force_by_gradient[(i, 3 * k + l)] = self.pressure * factor * rows[m][l];
                derivatives.force_by_gradient[(i, 3 * m + l)] = -self.pressure * factor * rows[k][l];
            }
        }
    }

    fn is_symmetric(&self) -> bool {
        false
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn amplitudes(&self, _: &Vec3) -> Vec<Amplitude> {
        vec![self.amplitude.clone()]
    }

    fn needs_normals(&self) -> bool {
        true
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.amplitude.validate_of("a pressure")
    }
}

/// Refuses stiffnesses of foundations that push away what leaves its place.
pub(crate) fn foundation(stiffness: f64) -> Result<(), SolveError> {
    match stiffness >= 0.0 && stiffness.is_finite() {
        true => Ok(()),
        false => {
            Err(Invalid::new("stiffness of an elastic foundation", stiffness, "give a finite number from 0 on").into())
        }
    }
}

/// Springs under a surface or in a body: $\Pi = \tfrac12\int k\\,|u|^2$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticFoundation {
    /// Stiffness per reference area or volume $k$ \[stress/length\].
    pub stiffness: f64,
}

impl Integrand for ElasticFoundation {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, force_by_displacement: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, derivatives: &mut PointDerivatives) {
        derivatives.energy = 0.5 * self.stiffness * at.displacement.norm_squared();
        derivatives.force = at.displacement * self.stiffness;
        derivatives.force_by_displacement.fill_diagonal(self.stiffness);
    }

    fn validate(&self) -> Result<(), SolveError> {
        foundation(self.stiffness)
    }
}
