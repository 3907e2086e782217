//! The measure of volume that is projected on zones.

use crate::material::{Volumetric, VolumetricEnergy};

/// $G(J) = 1 + (J^q - 1)/q$: $m(J^{1/m} - 1) + 1$ for $q = 1/m$, the volume itself for $q = 1$; $G(1) = G'(1) = 1$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum VolumetricMeasure {
    /// $q = 1$.
    Volume,
    /// $q = \tfrac12$.
    Square,
    /// $q = \tfrac13$.
    Cube,
    /// Any $q$ in between.
    Power(f64),
}

/// A function of one variable with two derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub value: f64,
    pub slope: f64,
    pub curvature: f64,
}

impl VolumetricMeasure {
    /// The measure with $q = 1/m$, $m$ = `roots` from 1 to 3.
    pub(crate) fn roots(roots: usize) -> Self {
        match roots {
            0 | 1 => VolumetricMeasure::Volume,
            2 => VolumetricMeasure::Square,
            _ => VolumetricMeasure::Cube,
        }
    }

    /// The measure whose $q$ is a part of the way from this one's to 1.
    #[inline(always)]
    pub(crate) fn towards_volume(self, part: f64) -> Self {
        // Nothing of it is by far the usual case.
        if part <= 0.0 || self == VolumetricMeasure::Volume {
            return self;
        }
        if part >= 1.0 {
            return VolumetricMeasure::Volume;
        }
        let q = self.exponent();
        VolumetricMeasure::Power(q + part * (1.0 - q))
    }

    fn exponent(self) -> f64 {
        match self {
            VolumetricMeasure::Volume => 1.0,
            VolumetricMeasure::Square => 0.5,
            VolumetricMeasure::Cube => 1.0 / 3.0,
            VolumetricMeasure::Power(q) => q,
        }
    }

    /// $G$ at a determinant; NaN below zero.
    #[inline(always)]
    pub(crate) fn of(self, j: f64) -> Jet {
        let power = match self {
            VolumetricMeasure::Volume => return Jet { value: j, slope: 1.0, curvature: 0.0 },
            VolumetricMeasure::Square => j.sqrt(),
            // Quicker than the cube root, and NaN below zero as well.
            VolumetricMeasure::Cube => (j.ln() / 3.0).exp(),
            VolumetricMeasure::Power(q) => (j.ln() * q).exp(),
        };
        let q = self.exponent();
        let slope = power / j;
        Jet { value: 1.0 + (power - 1.0) / q, slope, curvature: (q - 1.0) * slope / j }
    }

    /// The volume $J$ with a measure.
    pub(super) fn volume(self, measure: f64) -> f64 {
        let q = self.exponent();
        (1.0 + q * (measure - 1.0)).powf(q.recip())
    }

    /// $\hat U$, the energy as a function of $G$: $\hat U(G(J)) = U(J)$.
    #[inline(always)]
    pub(crate) fn energy(self, volumetric: &dyn VolumetricEnergy, measure: f64) -> Volumetric {
        let q = self.exponent();
        let power = 1.0 + q * (measure - 1.0);
        // dJ/dG and d²J/dG² of J = powerᵐ, m = 1/q.
        let (slope, curvature) = match self {
            VolumetricMeasure::Volume => return volumetric.evaluate(measure),
            VolumetricMeasure::Square => (power, 0.5),
            VolumetricMeasure::Cube => (power * power, 2.0 / 3.0 * power),
            VolumetricMeasure::Power(q) => {
                let slope = (power.ln() * (1.0 / q - 1.0)).exp();
                (slope, (1.0 - q) * slope / power)
            }
        };
        let u = volumetric.evaluate(slope * power);
        Volumetric {
            energy: u.energy,
            slope: u.slope * slope,
            curvature: u.curvature * slope * slope + u.slope * curvature,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::QuadraticVolume;
    use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};

    #[test]
    fn measures_are_derivatives_of_each_other_and_invert() {
        let energy = QuadraticVolume { bulk: 10.0 };
        for base in [VolumetricMeasure::Square, VolumetricMeasure::Cube] {
            for part in [0.0, 1e-3, 0.4, 1.0] {
                let measure = base.towards_volume(part);
                for j in [0.4, 0.97, 1.0, 1.6] {
                    let (step, at) = (1e-5, measure.of(j));
                    let [low, high] = [j - step, j + step].map(|j| measure.of(j));
                    assert_relative_eq!((high.value - low.value) / (2.0 * step), at.slope, max_relative = 1e-8);
                    assert_abs_diff_eq!((high.slope - low.slope) / (2.0 * step), at.curvature, epsilon = 1e-8);
                    let u = measure.energy(&energy, at.value);
                    assert!(abs_diff_eq!(u.energy, energy.evaluate(j).energy, epsilon = 1e-13), "{measure:?} {j}");
                    let [low, high] = [at.value - step, at.value + step].map(|g| measure.energy(&energy, g));
                    assert_abs_diff_eq!((high.energy - low.energy) / (2.0 * step), u.slope, epsilon = 1e-8);
                    assert_abs_diff_eq!((high.slope - low.slope) / (2.0 * step), u.curvature, epsilon = 1e-6);
                }
            }
        }
        // The ends of the way meet what they lead to.
        let j = 1.3;
        assert_abs_diff_eq!(
            VolumetricMeasure::Cube.towards_volume(1e-12).of(j).value,
            VolumetricMeasure::Cube.of(j).value,
            epsilon = 1e-11
        );
        assert_abs_diff_eq!(VolumetricMeasure::Cube.towards_volume(1.0 - 1e-12).of(j).value, j, epsilon = 1e-11);
    }
}
