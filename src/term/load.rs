//! Loads: dead forces, follower pressure, elastic foundation.

use nalgebra::{SMatrix, Vector3};

use crate::tensor::{Tangent, add_determinant_hessian, cofactor};

use super::amplitude::Amplitude;
use super::integrand::{Blocks, Flux, Integrand, PointState};

/// A force per reference volume (body force), per reference area (dead traction) or, on a table of one
/// point of weight 1, a point load; $\Pi = -\int u\cdot b\,a(\lambda)$, (4.4).
#[derive(Debug, Clone, PartialEq)]
pub struct DeadLoad {
    /// The force density $b$ \[stress/length, stress or force\].
    pub force: Vector3<f64>,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
}

impl Integrand for DeadLoad {
    fn blocks(&self) -> Blocks {
        Blocks { force: true, ..Blocks::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut Flux) {
        let (factor, slope) = self.amplitude.evaluate(at.load);
        flux.force = -self.force * factor;
        flux.force_by_load = -self.force * slope;
    }
}

/// A pressure that follows the surface: traction $-p\,a(\lambda)\operatorname{cof}(F)N$ per reference
/// area, $N$ outward from the body, $p$ positive inwards.
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
    fn blocks(&self) -> Blocks {
        Blocks { force: true, force_by_gradient: true, ..Blocks::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut Flux) {
        let (factor, slope) = self.amplitude.evaluate(at.load);
        let area = cofactor(&at.deformation) * at.normal;
        flux.force = area * (self.pressure * factor);
        flux.force_by_load = area * (self.pressure * slope);
        let mut hessian = Tangent::zeros();
        add_determinant_hessian(&mut hessian, &at.deformation, self.pressure * factor);
        flux.force_by_gradient =
            SMatrix::<f64, 3, 9>::from_fn(|i, c| (0..3).map(|j| hessian[(3 * i + j, c)] * at.normal[j]).sum());
    }

    fn is_symmetric(&self) -> bool {
        false
    }
}

/// Springs under a surface or in a body: $\Pi = \tfrac12\int k\,|u|^2$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticFoundation {
    /// Stiffness per reference area or volume $k$ \[stress/length\].
    pub stiffness: f64,
}

impl Integrand for ElasticFoundation {
    fn blocks(&self) -> Blocks {
        Blocks { force: true, force_by_displacement: true, ..Blocks::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut Flux) {
        flux.energy = 0.5 * self.stiffness * at.displacement.norm_squared();
        flux.force = at.displacement * self.stiffness;
        flux.force_by_displacement.fill_diagonal(self.stiffness);
    }
}
