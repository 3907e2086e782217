//! The local equations of a zone of pressure.

use crate::material::VolumetricEnergy;

use super::body::Body;
use super::stabilisation::Kept;
use super::volumetric_measure::{Jet, VolumetricMeasure};

/// Residuals of the local equations of one zone and their Hessian; at most four functions.
pub(super) struct ZoneResiduals {
    /// What is projected.
    pub(super) measure: VolumetricMeasure,
    pub(super) of_theta: [f64; 4],
    pub(super) of_pi: [f64; 4],
    pub(super) hessian: [[f64; 4]; 4],
}

impl ZoneResiduals {
    #[inline(always)]
    pub(super) fn new(theta: &[f64], pi: &[f64], measure: VolumetricMeasure) -> Self {
        let mut zone = ZoneResiduals { measure, of_theta: [0.0; 4], of_pi: [0.0; 4], hessian: [[0.0; 4]; 4] };
        for k in 0..theta.len() {
            zone.of_theta[k] = -pi[k];
            zone.of_pi[k] = -theta[k];
        }
        zone
    }

    /// Adds a point with determinant `j`, where so much stays pointwise, and returns the measure of its volume.
    #[inline(always)]
    pub(super) fn add<const D: usize>(
        &mut self,
        body: &Body<D>,
        (volumetric, kept): (&dyn VolumetricEnergy, Kept),
        point: usize,
        weight: f64,
        theta: &[f64],
        j: f64,
    ) -> Jet {
        let phi = body.zone_functions(point);
        let measure = self.measure.of(j);
        let mut projected = 0.0;
        for (p, t) in phi.iter().zip(theta) {
            projected += p * t;
        }
        let u = body.projected_energy(volumetric, (self.measure, kept), projected);
        let n = theta.len();
        for k in 0..n {
            let factor = weight * phi[k];
            self.of_theta[k] += factor * u.slope;
            self.of_pi[k] += factor * measure.value;
            for l in 0..n {
                self.hessian[k][l] += factor * phi[l] * u.curvature;
            }
        }
        measure
    }
}
