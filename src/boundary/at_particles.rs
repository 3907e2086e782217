//! Constraint equations at particles.

use crate::error::{ApproximationError, Error};
use crate::geometry::{Point, Vec3, padded};
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::table::check_values;
use crate::term::Amplitude;

use super::constraints::{AT_PARTICLES, Constraints};
use super::over_boundary::rounding;
use super::prescribed_directions::is_redundant;
use super::row_values::{Prescription, scaled};

impl Constraints {
    /// Conditions $u_i(X_J) = g(X_J)\\,a(\lambda)$ at particles: the constraint equations $\Psi_I(X_J)$ of the paper's
    /// transformation (4.29).
    ///
    /// A condition given twice with equal values is taken once.
    ///
    /// # Errors
    /// Where two conditions conflict, a component does not exist, or a shape function is not defined.
    pub fn at_particles<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        particles: &[usize],
        component: usize,
        target: &dyn Fn(&Point<D>) -> f64,
        amplitude: &Amplitude,
        label: &str,
    ) -> Result<(), Error> {
        let prescription = Prescription::of(D, component, scaled(target, amplitude), label)?;
        self.collocate(approximation, particles, &[], &prescription)
    }

    /// Conditions $e(X_J)\\cdot u(X_J) = g$ at particles, with the outward normals there where they are known.
    pub(crate) fn collocate<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        particles: &[usize],
        normals: &[Vec3],
        prescription: &Prescription<'_>,
    ) -> Result<(), Error> {
        let rounding = rounding(approximation.nodes());
        let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
        for (place, &particle) in particles.iter().enumerate() {
            let Some(&at) = approximation.nodes().get(particle) else {
                return Err(no_particle(particle).into());
            };
            let normal = normals.get(place).copied().unwrap_or_else(Point::zeros);
            let requested = prescription.at(&padded(&at), &normal)?;
            if is_redundant(self.prescriptions(AT_PARTICLES, particle), &requested, at.as_slice(), rounding)? {
                continue;
            }
            approximation.evaluate_at_node(particle, &mut scratch, &mut psi)?;
            check_values(&psi, approximation.nodes().len(), &at)?;
            let direction = requested.direction;
            let mut entries = Vec::with_capacity(psi.nodes.len());
            for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
                let parts = (0..D).filter(|&i| direction[i] != 0.0);
                entries.extend(parts.map(|i| (node as usize * D + i, value * direction[i])));
            }
            let value = (prescription.value)(vec![(padded(&at), 1.0)]);
            self.own(D, (AT_PARTICLES, particle), requested, entries, value)?;
        }
        Ok(())
    }
}

fn no_particle(particle: usize) -> ApproximationError {
    ApproximationError::Particle {
        particle,
        what: "there is no particle of this number",
        remedy: "give indices below the number of particles",
    }
}
