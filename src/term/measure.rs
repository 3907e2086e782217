//! The measure of volume that is projected on zones.

use crate::material::{Volumetric, VolumetricEnergy};

/// $G(J) = 1 + m(J^{1/m} - 1)$, the volume itself for $m = 1$; $G(1) = G'(1) = 1$.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measure {
    roots: i32,
}

/// A function of one variable with two derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub value: f64,
    pub slope: f64,
    pub curvature: f64,
}

impl Measure {
    /// $G = J$.
    pub const VOLUME: Measure = Measure { roots: 1 };

    /// The measure with $m$ = `roots`, from 1 to 3.
    pub fn roots(roots: usize) -> Self {
        Measure { roots: roots.clamp(1, 3) as i32 }
    }

    /// $G$ at a determinant; NaN below zero.
    #[inline(always)]
    pub fn of(self, j: f64) -> Jet {
        let root = match self.roots {
            1 => return Jet { value: j, slope: 1.0, curvature: 0.0 },
            2 => j.sqrt(),
            // Quicker than the cube root, and NaN below zero as well.
            _ => (j.ln() / 3.0).exp(),
        };
        let m = f64::from(self.roots);
        let slope = root / j;
        Jet { value: 1.0 + m * (root - 1.0), slope, curvature: (1.0 / m - 1.0) * slope / j }
    }

    /// $\hat U$, the energy as a function of $G$: $\hat U(G(J)) = U(J)$.
    #[inline(always)]
    pub fn energy(self, volumetric: &dyn VolumetricEnergy, measure: f64) -> Volumetric {
        if self.roots == 1 {
            return volumetric.evaluate(measure);
        }
        let m = f64::from(self.roots);
        let root = 1.0 + (measure - 1.0) / m;
        // dJ/dG and d²J/dG² of J = rootᵐ.
        let slope = root.powi(self.roots - 1);
        let curvature = (m - 1.0) / m * root.powi(self.roots - 2);
        let u = volumetric.evaluate(slope * root);
        Volumetric {
            energy: u.energy,
            slope: u.slope * slope,
            curvature: u.curvature * slope * slope + u.slope * curvature,
        }
    }
}
