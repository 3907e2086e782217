//! The paper's transformation of all particles (4.28)–(4.45).

use rkpm::assembly::Pattern;
use rkpm::boundary::{Eliminated, Enforced, Enforcement};
use rkpm::error::BoundaryError;
use rkpm::nalgebra::DMatrix;
use rkpm::prelude::*;

/// The full transformation: all coefficients are exchanged for values at particles, $\hat d = A^T d$ with
/// $A_{IJ} = \Psi_I(X_J)$ (4.31), so that $\hat\Psi_I(X_J) = \delta_{IJ}$ (4.33) and prescribed values are simply
/// struck out: $\hat K = \Lambda^{-1} K \Lambda^{-T}$ (4.42).
///
/// $\Lambda^{-1}$ is dense, and so is $\hat K$: memory grows with the square and time with the cube of the
/// number of unknowns. It spans the same space as
/// `MixedTransformation`, which transforms the constrained particles alone.
/// Only rows at particles can be served.
#[derive(Debug, Clone)]
pub struct FullTransformation {
    /// $A^{-T}$: coefficients for unit values at particles, `particles × particles`.
    inverse: DMatrix<f64>,
}

impl FullTransformation {
    /// Inverts $\Lambda$ for the particles of an approximation.
    pub fn new<const D: usize>(approximation: &dyn Approximation<D>) -> Self {
        let n = approximation.nodes().len();
        let mut at_particles = DMatrix::zeros(n, n);
        let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
        for particle in 0..n {
            approximation.evaluate_at_node(particle, &mut scratch, &mut psi).unwrap();
            for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
                at_particles[(particle, node as usize)] = value;
            }
        }
        FullTransformation { inverse: at_particles.lu().try_inverse().expect("values that determine the coefficients") }
    }

    /// The transformed functions $\hat\Psi_K(X) = \sum_I A^{-1}_{KI}\Psi_I(X)$ (4.33) for given $\Psi_I(X)$,
    /// one for each particle; NaN where one of them is that of no particle.
    pub fn transformed(&self, nodes: &[u32], values: &[f64]) -> Vec<f64> {
        (0..self.inverse.ncols())
            .map(|k| {
                let entry = |i: u32| self.inverse.get((i as usize, k)).copied().unwrap_or(f64::NAN);
                nodes.iter().zip(values).map(|(&i, v)| entry(i) * v).sum()
            })
            .collect()
    }
}

impl Enforcement for FullTransformation {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        let particles = self.inverse.nrows();
        let size = pattern.size();
        let unsuitable = |reason: String| BoundaryError::Unsuitable { enforcement: "full transformation", reason };
        if particles == 0 || !size.is_multiple_of(particles) {
            return Err(unsuitable(format!("{particles} particles were transformed, the model has {size} unknowns")));
        }
        let dimension = size / particles;
        let mut row_of = vec![None; size];
        for (r, equation) in equations.equations().iter().enumerate() {
            let component = equation.dependent % dimension;
            if equation.entries.iter().any(|e| e.0 % dimension != component) {
                return Err(unsuitable(format!("{} couples components; take multipliers", equation.label)));
            }
            // G d = G A^{-T} d̂: a row at a particle picks one value alone.
            let mut picked = vec![0.0; particles];
            for &(unknown, c) in &equation.entries {
                for (k, p) in picked.iter_mut().enumerate() {
                    *p += c * self.inverse[(unknown / dimension, k)];
                }
            }
            let dependent = equation.dependent / dimension;
            let scale = picked[dependent];
            let other =
                picked.iter().enumerate().filter(|(k, _)| *k != dependent).map(|(_, p)| p.abs()).fold(0.0, f64::max);
            // Rounding of the inverse.
            if !(other <= 1e-9 * scale.abs()) {
                return Err(unsuitable(format!(
                    "{} is not a condition at a particle; take multipliers",
                    equation.label
                )));
            }
            if row_of[equation.dependent].replace((r, scale)).is_some() {
                return Err(BoundaryError::Dependent { equation: r, what: equation.label.clone(), pivot: 0.0 });
            }
        }
        // By component, for the transformation does not couple them: d = A^{-T} d̂, where what is prescribed of d̂ is known.
        let eliminated = (0..dimension).map(|component| {
            let unknowns: Vec<usize> = (0..particles).map(|particle| particle * dimension + component).collect();
            let (known, free): (Vec<usize>, Vec<usize>) =
                unknowns.iter().partition(|&&unknown| row_of[unknown].is_some());
            let (mut transfer, mut offsets) = (Vec::new(), Vec::new());
            for i in 0..particles {
                transfer.extend(free.iter().map(|&unknown| self.inverse[(i, unknown / dimension)]));
                let prescribed = known.iter().filter_map(|&unknown| Some((unknown, row_of[unknown]?.1)));
                offsets.extend(prescribed.map(|(unknown, scale)| self.inverse[(i, unknown / dimension)] / scale));
            }
            let equations = known.iter().filter_map(|&unknown| Some(row_of[unknown]?.0)).collect();
            Eliminated { unknowns, free, transfer, equations, offsets }
        });
        Ok(Enforced { eliminated: eliminated.collect(), ..Enforced::default() })
    }
}
