//! Terms of a rigid body: what keeps its shape, and the forces and moments on it.

use std::ops::Range;
use std::sync::Arc;

use crate::assembly::Model;
use crate::each::{Each, add, sum_of};
use crate::error::{Error, Incompatible};
use crate::geometry::{Mat3, Point, Vec3, padded};
use crate::linear::vector::dot;
use crate::quadrature::Points;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Element, Layout, Pointwise, Term, TermStep, View};

use super::frame::RigidFrame;
use super::unmeasured::Unmeasured;
use crate::scene::{Load, LoadKind, dead};

/// Stiffness of the frame that finds its reactions, in terms of the stiffest body beside it: what is left of a strain of
/// the frame falls by about this factor with each iteration.
const FIRM: f64 = 10.0;

impl RigidFrame {
    /// Adds a load on the body, at a point of it or at its centre.
    pub(crate) fn load<const D: usize>(
        &self,
        model: &mut Model,
        load: &Load<D>,
        point: Option<Vec3>,
        revolved: bool,
    ) -> Result<(), Error> {
        let amplitude = load.amplitude.clone();
        let refused = |what: String, with, remedy| Err(Incompatible::new(what, with, remedy).into());
        match &load.kind {
            LoadKind::Total(force) if revolved && force[0] != 0.0 => {
                let remedy = "radial forces on it balance each other: take a force along the axis alone";
                return refused("a radial force".into(), "an axisymmetric rigid body", remedy);
            }
            LoadKind::Total(force) => {
                let at = point.unwrap_or(self.centre);
                let (values, point) = (self.values(&at), Points::<D>::single(padded(&at)));
                let table = ShapeTable::tabulate(model.node_count(), &point, &Unmeasured, &|_, _, psi| {
                    psi.nodes.clone_from(&self.numbers);
                    psi.values = values[..=D].to_vec();
                    psi.gradients = vec![Point::zeros(); D + 1];
                    psi.rcond = 1.0;
                    Ok(())
                })?;
                model.add_replicated(Arc::new(Pointwise::new(table, dead(force, &amplitude))));
            }
            LoadKind::Moment(_) if revolved => {
                let remedy = "symmetry leaves it no rotation: take a force along the axis";
                return refused("a moment".into(), "an axisymmetric body", remedy);
            }
            LoadKind::Moment(moment) => {
                let turning = Vec3::from(*moment).cross_matrix() * -0.5;
                model.add_replicated(Arc::new(Moment { frame: self.clone(), turning, amplitude }));
            }
            _ => {
                let remedy = "take Load::force or Load::moment; pressures act on the parts that are tied to it";
                return refused(load.label(), "a rigid body", remedy);
            }
        }
        Ok(())
    }

    /// The term that keeps the frame's shape beside bodies of the given moduli (first of the tangent, shear).
    pub(crate) fn stay(&mut self, modulus: f64, shear: f64) -> impl Term + use<> + 'static {
        let measure = self.size.powi(self.dim as i32);
        self.unit = shear * measure;
        Rigidity { frame: self.clone(), stiffness: FIRM * modulus * measure }
    }

    /// Rows along which multipliers keep the frame's shape, by strains times its size; what a multiplier of these is in units of the term.
    pub(crate) fn shape_rows(&self, displacement: &[f64]) -> (Vec<Vec<(usize, f64)>>, f64) {
        let row =
            |slopes: &[f64]| slopes.iter().zip(self.unknowns()).map(|(slope, k)| (k, slope * self.size)).collect();
        (self.strains(displacement).mapped(|(_, slopes)| row(slopes)), self.size / self.unit)
    }

    /// Pairs (i, j), i ≤ j, of the components of a symmetric tensor.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let dim = self.dim;
        (0..dim).flat_map(move |i| (i..dim).map(move |j| (i, j)))
    }

    /// $E = \tfrac12(F^T F - 1)$ component by component, shear ones doubled, and their slopes over the unknowns of the frame.
    fn strains(&self, displacement: &[f64]) -> Vec<(f64, Vec<f64>)> {
        let h = self.gradient(displacement);
        let (e, f) = ((h + h.transpose() + h.transpose() * h) * 0.5, Mat3::identity() + h);
        let mut strains = Vec::new();
        for (i, j) in self.pairs() {
            let part = if i == j { 0.5 } else { 1.0 };
            let mut slopes = Vec::with_capacity(self.unknowns().len());
            for k in 0..=self.dim {
                for m in 0..self.dim {
                    slopes.push(part * (self.slope(k, i) * f[(m, j)] + self.slope(k, j) * f[(m, i)]));
                }
            }
            strains.push((if i == j { e[(i, i)] } else { 2.0 * e[(i, j)] }, slopes));
        }
        strains
    }
}

/// $E = 0$ for a frame, by multipliers $\pi$ that are found as a stiffness would find them and kept from one
/// iteration to the next: $\delta\pi = c\\,(E + \delta E)$ until $E$ vanishes. The stiffness changes the way, not the state.
struct Rigidity {
    frame: RigidFrame,
    stiffness: f64,
}

impl Term for Rigidity {
    fn dim(&self) -> usize {
        self.frame.dim
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.frame.numbers
    }

    fn layout(&self) -> Layout {
        Layout { follows_load: false, ..Layout::default() }
    }

    fn unknowns(&self, _: usize) -> Range<usize> {
        // The first is their measure, one for all time: multipliers that vanish are settled.
        0..1 + self.frame.pairs().count()
    }

    fn start(&self, condensed: &mut [f64], _: &mut [f64]) {
        condensed[0] = 1.0;
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let (dim, size) = (self.frame.dim, self.frame.unknowns().len());
        for ((strain, slope), pi) in self.frame.strains(view.displacement).iter().zip(&view.condensed[1..]) {
            let force = self.frame.unit * pi + self.stiffness * strain;
            add(&mut out.residual, force, slope);
            for (k, entry) in out.matrix.iter_mut().enumerate() {
                *entry += self.stiffness * slope[k / size] * slope[k % size];
            }
        }
        if !out.with_matrix {
            return;
        }
        // π : ∂²E, with the same component at both ends.
        let square = self.frame.size * self.frame.size;
        for ((i, j), pi) in self.frame.pairs().zip(&view.condensed[1..]) {
            let pi = self.frame.unit * pi / square;
            for (a, x) in [(i + 1, 1.0), (0, -1.0)] {
                for (b, y) in [(j + 1, 1.0), (0, -1.0)] {
                    for (a, b) in [(a, b), (b, a)].into_iter().take(1 + usize::from(i != j)) {
                        (0..dim).for_each(|m| out.matrix[(b * dim + m) * size + a * dim + m] += pi * x * y);
                    }
                }
            }
        }
    }

    fn advance(&self, _: usize, view: View<'_>, step: TermStep<'_>, condensed_step: &mut [f64]) -> f64 {
        condensed_step[0] = 0.0;
        let step = &step.displacement[self.frame.unknowns()];
        for ((strain, slope), out) in self.frame.strains(view.displacement).iter().zip(&mut condensed_step[1..]) {
            *out = self.stiffness * (strain + dot(slope, step)) / self.frame.unit;
        }
        1.0
    }
}

/// A moment on a frame: virtual work $M\cdot\delta\omega$, $\delta\omega$ the axial vector of $\delta F F^{-1}$.
struct Moment {
    frame: RigidFrame,
    /// $\tfrac12 M_k\varepsilon_{kij}$, with which $\partial\Pi/\partial F = \hat M F$ for a rotation $F$.
    turning: Mat3,
    amplitude: Amplitude,
}

impl Term for Moment {
    fn dim(&self) -> usize {
        self.frame.dim
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.frame.numbers
    }

    fn layout(&self) -> Layout {
        Layout { symmetric: false, ..Layout::default() }
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn amplitudes(&self) -> Vec<Amplitude> {
        vec![self.amplitude.clone()]
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let (factor, change) = self.amplitude.evaluate(view.load);
        let stress = self.turning * (Mat3::identity() + self.frame.gradient(view.displacement));
        let (dim, size) = (self.frame.dim, self.frame.unknowns().len());
        for k in 0..=dim {
            for i in 0..dim {
                let force = sum_of(dim, |axis| stress[(i, axis)] * self.frame.slope(k, axis));
                out.residual[k * dim + i] += factor * force;
                out.load_slope[k * dim + i] += change * force;
            }
        }
        if !out.with_matrix {
            return;
        }
        for k in 0..=dim {
            for l in 0..=dim {
                let both = sum_of(dim, |axis| self.frame.slope(k, axis) * self.frame.slope(l, axis));
                for i in 0..dim {
                    for j in 0..dim {
                        out.matrix[(l * dim + j) * size + k * dim + i] += factor * self.turning[(i, j)] * both;
                    }
                }
            }
        }
    }
}
