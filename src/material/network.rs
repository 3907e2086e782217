//! Energies of chain networks: Arruda and Boyce, and the extended tube.

use super::constants::{check, not_negative, positive};
use super::{Distortion, InvariantEnergy, Principal, PrincipalEnergy};
use crate::each::{Each, EachOf};
use crate::error::MaterialError;
use crate::geometry::{Mat3, Vec3};

/// The energy of Arruda and Boyce by the first five terms of its series, as other programs have it,
/// $$\bar W = \mu\sum_{i=1}^5\frac{C_i}{\lambda_m^{2i-2}}\big(\bar I_1^i - 3^i\big),\qquad
/// C = \tfrac12, \tfrac1{20}, \tfrac{11}{1050}, \tfrac{19}{7000}, \tfrac{519}{673750}.$$
///
/// Its initial shear modulus is $\mu_0 = \mu\big(1 + \tfrac{3}{5\lambda_m^2} + \tfrac{99}{175\lambda_m^4} + \dots\big)$,
/// above $\mu$. (Arruda and Boyce, Journal of the Mechanics and Physics of Solids 41, 1993.)
///
/// ```
/// use rkpm::material::{ArrudaBoyce, Invariants, Material};
/// let law = Invariants(ArrudaBoyce::new(0.3, 5.0)?); // MPa
/// let series = 1.0 + 3.0 / 5.0 / 25.0 + 99.0 / 175.0 / 625.0 + 513.0 / 875.0 / 15625.0 + 42039.0 / 67375.0 / 390625.0;
/// assert!((law.initial_moduli().shear - 0.3 * series).abs() < 1e-15);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrudaBoyce {
    shear: f64,
    locking: f64,
    /// Coefficients of $(\bar I_1-3)^k$, $k = 1\dots5$.
    powers: [f64; 5],
}

impl ArrudaBoyce {
    /// The energy with `shear` $= \mu$ \[stress\] and locking stretch `locking` $= \lambda_m$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless both are finite and above zero.
    pub fn new(shear: f64, locking: f64) -> Result<Self, MaterialError> {
        positive("mu", shear)?;
        positive("lambda_m", locking)?;
        const SERIES: [f64; 5] = [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];
        // (3 + x)^i - 3^i in powers of x keeps the digits of small strains.
        const BINOMIALS: [[f64; 5]; 5] = [
            [1.0, 0.0, 0.0, 0.0, 0.0],
            [6.0, 1.0, 0.0, 0.0, 0.0],
            [27.0, 9.0, 1.0, 0.0, 0.0],
            [108.0, 54.0, 12.0, 1.0, 0.0],
            [405.0, 270.0, 90.0, 15.0, 1.0],
        ];
        let mut powers = [0.0; 5];
        for (i, (c, row)) in SERIES.iter().zip(&BINOMIALS).enumerate() {
            for (power, binomial) in powers.iter_mut().zip(row) {
                *power += shear * c * binomial / locking.powi(2 * i as i32);
            }
        }
        positive("initial shear modulus", 2.0 * powers[0])?;
        Ok(Self { shear, locking, powers })
    }
}

impl InvariantEnergy for ArrudaBoyce {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, x: f64, _: f64) -> Distortion {
        let (mut energy, mut w1, mut half) = (0.0, 0.0, 0.0);
        for &a in self.powers.iter().rev() {
            half = half * x + w1;
            w1 = w1 * x + energy;
            energy = energy * x + a;
        }
        // The list begins with the first power: one more step with nothing.
        half = half * x + w1;
        w1 = w1 * x + energy;
        energy *= x;
        Distortion { energy, w1, w11: 2.0 * half, ..Distortion::default() }
    }
}

/// The extended tube of Kaliske and Heinrich: crosslinks of limited extensibility in a tube of entanglements,
/// $$\bar W = \frac{G_c}{2}\left(\frac{(1-\delta^2)D}{1-\delta^2D} + \ln(1-\delta^2D)\right)
/// {}+ \frac{2G_e}{\beta^2}\sum_a\big(\bar\lambda_a^{-\beta}-1\big),\qquad D = \bar I_1 - 3.$$
///
/// Initial shear modulus $G_c(1-2\delta^2) + G_e$; NaN from $D = \delta^{-2}$ on.
/// (Kaliske and Heinrich, Rubber Chemistry and Technology 72, 1999.)
///
/// ```
/// use rkpm::material::{ExtendedTube, Material, PrincipalStretches};
/// let law = PrincipalStretches(ExtendedTube::new(0.19, 0.2, 0.3, 0.1)?); // MPa, MPa
/// assert!((law.initial_moduli().shear - (0.19 * 0.98 + 0.2)).abs() < 1e-15);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtendedTube {
    /// $G_c$ of the crosslinks \[stress\].
    crosslinks: f64,
    /// $G_e$ of the entanglements \[stress\].
    entanglements: f64,
    beta: f64,
    delta: f64,
}

impl ExtendedTube {
    /// The energy with $G_c$, $G_e$ \[stress\], $\beta$ and $\delta$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless $G_c, G_e \ge 0$, $\beta > 0$, $0 \le \delta < 1$, all are finite, and the
    /// initial shear modulus is above zero.
    pub fn new(crosslinks: f64, entanglements: f64, beta: f64, delta: f64) -> Result<Self, MaterialError> {
        for (name, value) in [("G_c", crosslinks), ("G_e", entanglements)] {
            not_negative(name, value)?;
        }
        positive("beta", beta)?;
        check("delta", delta, (0.0..1.0).contains(&delta), "give a number from 0 to below 1")?;
        let shear = crosslinks * (1.0 - 2.0 * delta * delta) + entanglements;
        positive("initial shear modulus G_c (1 - 2 delta²) + G_e", shear)?;
        Ok(Self { crosslinks, entanglements, beta, delta })
    }
}

impl PrincipalEnergy for ExtendedTube {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let squares = Vec3::from(logarithms.each(|h| (2.0 * h).exp()));
        // Ī1 - 3 without cancellation beyond that of the logarithms, which add up to zero.
        let d: f64 = logarithms.summed(|h| (2.0 * h).exp_m1());
        let limit = self.delta * self.delta;
        let left = 1.0 - limit * d;
        if left.is_nan() || left <= 0.0 {
            let nan = f64::NAN;
            return Principal { energy: nan, gradient: Vec3::repeat(nan), hessian: Mat3::repeat(nan) };
        }
        let half = 0.5 * self.crosslinks;
        let first = half * ((1.0 - limit) / (left * left) - limit / left);
        let second = half * (2.0 * limit * (1.0 - limit) / left.powi(3) - limit * limit / (left * left));
        let mut energy = half * ((1.0 - limit) * d / left + (-limit * d).ln_1p());
        let mut gradient = 2.0 * first * squares;
        let mut hessian = 4.0 * second * squares * squares.transpose();
        for (a, h) in logarithms.into_iter().enumerate() {
            let excess = (-self.beta * h).exp_m1();
            energy += 2.0 * self.entanglements / (self.beta * self.beta) * excess;
            gradient[a] -= 2.0 * self.entanglements / self.beta * (1.0 + excess);
            hessian[(a, a)] += 4.0 * first * squares[a] + 2.0 * self.entanglements * (1.0 + excess);
        }
        Principal { energy, gradient, hessian }
    }
}
