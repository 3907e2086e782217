//! The paper's transformation of all particles (4.28)–(4.45).

use rkpm::assembly::{Pattern, System};
use rkpm::boundary::{Enforced, Enforcement};
use rkpm::error::BoundaryError;
use rkpm::linear::MatrixClass;
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

struct Bound {
    full: Pattern,
    pattern: Pattern,
    inverse: DMatrix<f64>,
    dimension: usize,
    /// Values at particles that are unknown, and the row that prescribes each of the others.
    free: Vec<usize>,
    prescribed: Vec<(usize, usize, f64)>,
    /// Of the full matrix that was reduced last.
    values: Vec<f64>,
}

impl Enforcement for FullTransformation {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
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
        let free: Vec<usize> = (0..size).filter(|&u| row_of[u].is_none()).collect();
        let prescribed = (0..size).filter_map(|u| row_of[u].map(|(r, scale)| (u, r, scale))).collect();
        let n = free.len();
        let dense = Pattern::from_columns((0..n).map(|c| (c as u32..n as u32).collect()).collect());
        Ok(Box::new(Bound {
            full: pattern.clone(),
            pattern: dense,
            inverse: self.inverse.clone(),
            dimension,
            free,
            prescribed,
            values: Vec::new(),
        }))
    }
}

impl Bound {
    /// $d = A^{-T}\hat d$, component by component.
    fn coefficients(&self, values: &[f64], out: &mut [f64]) {
        let d = self.dimension;
        out.fill(0.0);
        for k in 0..self.inverse.ncols() {
            for i in 0..self.inverse.nrows() {
                let t = self.inverse[(i, k)];
                for c in 0..d {
                    out[i * d + c] += t * values[k * d + c];
                }
            }
        }
    }

    /// $A^{-1} f$, component by component: the nodal forces $\Lambda^{-1}f$ of (4.43).
    fn nodal(&self, force: &[f64]) -> Vec<f64> {
        let d = self.dimension;
        let mut out = vec![0.0; force.len()];
        for k in 0..self.inverse.ncols() {
            for i in 0..self.inverse.nrows() {
                let t = self.inverse[(i, k)];
                for c in 0..d {
                    out[k * d + c] += t * force[i * d + c];
                }
            }
        }
        out
    }
}

impl Enforced for Bound {
    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn class(&self) -> MatrixClass {
        MatrixClass::Definite
    }

    fn unknowns(&self) -> usize {
        self.free.len()
    }

    fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
        let size = self.full.size();
        let d = self.dimension;
        self.values.clone_from(&full.values);
        let mut k = DMatrix::zeros(size, size);
        for column in 0..size {
            for entry in self.full.columns[column]..self.full.columns[column + 1] {
                let row = self.full.rows[entry] as usize;
                k[(row, column)] = full.values[entry];
                k[(column, row)] = full.values[entry];
            }
        }
        let particles = self.inverse.nrows();
        let mut transformation = DMatrix::zeros(size, size);
        for i in 0..particles {
            for j in 0..particles {
                for c in 0..d {
                    transformation[(i * d + c, j * d + c)] = self.inverse[(i, j)];
                }
            }
        }
        let reduced = transformation.tr_mul(&(k * &transformation));
        values.clear();
        for (c, &column) in self.free.iter().enumerate() {
            values.extend(self.free[c..].iter().map(|&row| reduced[(row, column)]));
        }
    }

    fn restrict(&self, force: &[f64], violation: &[f64], full: &System, rhs: &mut Vec<f64>) {
        let size = self.full.size();
        let mut values = vec![0.0; size];
        for &(unknown, equation, scale) in &self.prescribed {
            values[unknown] = violation[equation] / scale;
        }
        let mut jump = vec![0.0; size];
        self.coefficients(&values, &mut jump);
        let mut product = vec![0.0; size];
        self.full.multiply_add(&self.values, &jump, &mut product);
        full.skew_multiply_add(&jump, &mut product);
        for (p, f) in product.iter_mut().zip(force) {
            *p = f - *p;
        }
        self.project(&product, rhs);
    }

    fn project(&self, full: &[f64], out: &mut Vec<f64>) {
        let nodal = self.nodal(full);
        out.clear();
        out.extend(self.free.iter().map(|&u| nodal[u]));
    }

    fn stiffen(&self, step: &[f64], full: &System, residual: &mut [f64]) {
        let mut product = vec![0.0; residual.len()];
        self.full.multiply_add(&self.values, step, &mut product);
        full.skew_multiply_add(step, &mut product);
        residual.iter_mut().zip(&product).for_each(|(r, p)| *r += p);
    }

    fn react(&self, residual: &[f64], multipliers: &mut [f64]) {
        let nodal = self.nodal(residual);
        for &(unknown, equation, scale) in &self.prescribed {
            multipliers[equation] = -nodal[unknown] / scale;
        }
    }

    fn recover(&self, solved: &[f64], violation: &[f64], step: &mut [f64], _multipliers: &mut [f64]) {
        let mut values = vec![0.0; self.full.size()];
        for (&unknown, value) in self.free.iter().zip(solved) {
            values[unknown] = *value;
        }
        for &(unknown, equation, scale) in &self.prescribed {
            values[unknown] = violation[equation] / scale;
        }
        self.coefficients(&values, step);
    }

    fn full_index(&self, reduced: usize) -> Option<usize> {
        self.free.get(reduced).copied()
    }
}
