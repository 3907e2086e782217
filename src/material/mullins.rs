//! Softening of filled rubber on its first stretch.

use std::f64::consts::PI;

use super::constants::{check, not_negative, positive};
use super::{Material, Past, Response};
use crate::error::{Invalid, MaterialError};
use crate::geometry::Mat3;

/// Mullins' effect by the pseudo-energy of Ogden and Roxburgh: below the largest distortional energy $\bar W_m$ that a point has had,
/// its distortional stress is softer,
/// $$\bar P = \eta\\,\frac{\partial\bar W}{\partial F},\qquad \eta = 1 - \frac1r\operatorname{erf}\frac{\bar W_m - \bar W}{m + \beta\bar W_m}.$$
///
/// On the way to a new $\bar W_m$ the law is the elastic one; unloading and reloading follow one softer curve that meets it there.
/// $\bar W_m$ is the internal variable of a point. (Ogden and Roxburgh, Proceedings of the Royal Society A 455, 1999; $\beta$ as in Abaqus, Ansys.)
///
/// ```
/// use rkpm::material::{Mullins, Rubber};
/// let filled = Mullins::new(Rubber::yeoh(0.373, -0.031, 0.005, 1e3)?, 1.5, 0.5, 0.1)?; // m in MPa
/// # let _ = filled;
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mullins<M> {
    material: M,
    r: f64,
    m: f64,
    beta: f64,
}

impl<M: Material> Mullins<M> {
    /// The material of an elastic law with $r$, $m$ \[stress\] and $\beta$.
    ///
    /// # Errors
    /// [`Invalid`] unless $r > 1$, $m, \beta \ge 0$ with one of them above zero, all finite, and for a law with internal variables.
    pub fn new(material: M, r: f64, m: f64, beta: f64) -> Result<Self, MaterialError> {
        check("r", r, r > 1.0 && r.is_finite(), "give a finite number above 1")?;
        for (name, value) in [("m", m), ("beta", beta)] {
            not_negative(name, value)?;
        }
        positive("m + beta", m + beta)?;
        let law = Self { material, r, m, beta };
        law.validate()?;
        Ok(law)
    }

    /// $z = (\bar W_m - \bar W)/(m + \beta\bar W_m)$ and its denominator; nothing on the way to a new $\bar W_m$.
    fn softened(&self, energy: f64, largest: f64) -> Option<[f64; 2]> {
        let scale = self.m + self.beta * largest;
        (energy < largest && scale > 0.0).then(|| [(largest - energy) / scale, scale])
    }
}

impl<M: Material> Material for Mullins<M> {
    fn inner(&self) -> Option<&dyn Material> {
        Some(&self.material)
    }

    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
        let energy = self.material.energy_from(f, Past::NONE);
        match self.softened(energy, past.memory[0]) {
            // ∫η dW from the largest energy down.
            Some([z, scale]) => energy + scale / self.r * (z * libm::erf(z) + (-z * z).exp_m1() / PI.sqrt()),
            None => energy,
        }
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        Response::of_components(|of, stress, tangent| self.respond(f, past, of, stress, tangent))
    }

    fn respond(&self, f: &Mat3, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        self.material.respond(f, Past::NONE, of, stress, tangent);
        let Some([z, scale]) = self.softened(self.material.energy_from(f, Past::NONE), past.memory[0]) else { return };
        let factor = 1.0 - libm::erf(z) / self.r;
        let slope = 2.0 / PI.sqrt() * (-z * z).exp() / (self.r * scale);
        let n = of.len();
        if !tangent.is_empty() {
            for a in 0..n {
                for b in 0..n {
                    let entry = &mut tangent[a * n + b];
                    *entry = factor * *entry + slope * stress[a] * stress[b];
                }
            }
        }
        stress[..n].iter_mut().for_each(|p| *p *= factor);
    }

    fn memory(&self) -> usize {
        1
    }

    /// That of a law which is stressed at rest, as one that was stretched before, is not zero.
    fn start(&self, memory: &mut [f64]) {
        memory[0] = self.material.energy_from(&Mat3::identity(), Past::NONE);
    }

    fn remember(&self, f: &Mat3, past: Past<'_>, next: &mut [f64]) {
        next[0] = past.memory[0].max(self.material.energy_from(f, Past::NONE));
    }

    fn validate(&self) -> Result<(), MaterialError> {
        self.material.validate()?;
        match self.material.memory() {
            0 => Ok(()),
            memory => {
                let needed = "softening is measured by the energy of an elastic law: soften that, then let it relax, \
                              Viscoelastic::new(Mullins::new(..)?, ..)";
                Err(Invalid::new("numbers that the law within Mullins remembers", memory as f64, needed).into())
            }
        }
    }
}
