//! Terms of a rigid body: what keeps its shape, and the forces and moments on it.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix};

use crate::assembly::Model;
use crate::error::{Error, Incompatible};
use crate::geometry::Point;
use crate::quadrature::Points;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Element, Layout, Pointwise, Term, View};

use super::frame::Frame;
use super::unmeasured::Unmeasured;
use crate::scene::{Load, LoadKind, dead};

/// Stiffness of the frame that finds its reactions, in terms of the stiffest body beside it: what is left of a strain of
/// the frame falls by about this factor with each iteration.
const FIRM: f64 = 10.0;

impl<const D: usize> Frame<D> {
    /// Adds a load on the body, at a point of it or at its centre.
    pub(crate) fn load(
        &self,
        model: &mut Model,
        load: &Load<D>,
        point: Option<Point<D>>,
        revolved: bool,
    ) -> Result<(), Error> {
        let total = model.node_count();
        match &load.kind {
            LoadKind::Total(force) if revolved && force[0] != 0.0 => {
                let remedy = "radial forces on it balance each other: take a force along the axis alone";
                return Err(Incompatible::new("a radial force", "an axisymmetric rigid body", remedy).into());
            }
            LoadKind::Total(force) => {
                let at = point.unwrap_or(self.centre);
                let values = self.values(&at);
                let table = ShapeTable::tabulate(total, &Points::single(at), &Unmeasured, &|_, _, psi| {
                    psi.nodes.clone_from(&self.numbers);
                    psi.values = values[..=D].to_vec();
                    psi.gradients = vec![Point::zeros(); D + 1];
                    psi.rcond = 1.0;
                    Ok(())
                })?;
                model.add_replicated(Arc::new(Pointwise::new(table, dead(force, &load.amplitude))));
            }
            LoadKind::Moment(_) if revolved => {
                let remedy = "symmetry leaves it no rotation: take a force along the axis";
                return Err(Incompatible::new("a moment", "an axisymmetric body", remedy).into());
            }
            LoadKind::Moment(moment) => {
                let (moment, amplitude) = (*moment, load.amplitude.clone());
                model.add_replicated(Arc::new(Turning { frame: self.clone(), moment, amplitude }));
            }
            _ => {
                let remedy = "take Load::force or Load::moment; pressures act on the parts that are tied to it";
                return Err(Incompatible::new(load.label(), "a rigid body", remedy).into());
            }
        }
        Ok(())
    }

    /// The term that keeps the frame's shape beside bodies of the given moduli (first of the tangent, shear).
    pub(crate) fn stay(&self, modulus: f64, shear: f64) -> impl Term + 'static {
        let measure = self.size.powi(D as i32);
        Rigidity { frame: self.clone(), stiffness: FIRM * modulus * measure, unit: shear * measure }
    }
}

/// $E = \tfrac12(F^T F - 1) = 0$ for a frame, by multipliers $\pi$ that are found as a stiffness would find them and kept from one
/// iteration to the next: $\delta\pi = c\\,(E + \delta E)$ until $E$ vanishes. The stiffness changes the way, not the state.
struct Rigidity<const D: usize> {
    frame: Frame<D>,
    stiffness: f64,
    /// What multipliers are measured in.
    unit: f64,
}

/// Pairs (i, j), i ≤ j, of the components of a symmetric tensor.
fn pairs<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..D).flat_map(|i| (i..D).map(move |j| (i, j)))
}

impl<const D: usize> Rigidity<D> {
    const COUNT: usize = D * (D + 1) / 2;

    /// $E$ component by component, shear ones doubled.
    fn strains(&self, h: &SMatrix<f64, D, D>) -> Vec<f64> {
        let e = (h + h.transpose() + h.transpose() * h) * 0.5;
        pairs::<D>().map(|(i, j)| if i == j { e[(i, i)] } else { 2.0 * e[(i, j)] }).collect()
    }

    /// Slopes of a strain over the unknowns of the frame.
    fn slopes(&self, h: &SMatrix<f64, D, D>) -> Vec<Vec<f64>> {
        let f = SMatrix::<f64, D, D>::identity() + h;
        let along = |k: usize, axis: usize| self.frame.slope(k, axis);
        let slope = |(i, j): (usize, usize), k: usize, m: usize| {
            let both = along(k, i) * f[(m, j)] + along(k, j) * f[(m, i)];
            if i == j { 0.5 * both } else { both }
        };
        let mut slopes = Vec::with_capacity(Self::COUNT);
        for pair in pairs::<D>() {
            let mut own = Vec::with_capacity((D + 1) * D);
            for k in 0..=D {
                for m in 0..D {
                    own.push(slope(pair, k, m));
                }
            }
            slopes.push(own);
        }
        slopes
    }
}

impl<const D: usize> Term for Rigidity<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        1
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.frame.numbers
    }

    fn layout(&self) -> Layout {
        Layout { follows_load: false, ..Layout::default() }
    }

    fn unknowns(&self, _: usize) -> Range<usize> {
        // The first is their measure, one for all time: multipliers that vanish are settled.
        0..1 + Self::COUNT
    }

    fn start(&self, condensed: &mut [f64], _: &mut [f64]) {
        condensed[0] = 1.0;
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let h = self.frame.gradient(view.displacement);
        let (strains, slopes) = (self.strains(&h), self.slopes(&h));
        let size = (D + 1) * D;
        for ((strain, slope), pi) in strains.iter().zip(&slopes).zip(&view.condensed[1..]) {
            let force = self.unit * pi + self.stiffness * strain;
            out.residual.iter_mut().zip(slope).for_each(|(r, s)| *r += force * s);
        }
        if !out.with_matrix {
            return;
        }
        for slope in &slopes {
            for (column, a) in slope.iter().enumerate() {
                for (row, b) in slope.iter().enumerate() {
                    out.matrix[column * size + row] += self.stiffness * a * b;
                }
            }
        }
        // π : ∂²E, with the same component at both ends.
        let square = self.frame.size * self.frame.size;
        for ((i, j), pi) in pairs::<D>().zip(&view.condensed[1..]) {
            let pi = self.unit * pi / square;
            let ends = [(i + 1, 1.0), (0, -1.0)];
            let others = [(j + 1, 1.0), (0, -1.0)];
            for (a, x) in ends {
                for (b, y) in others {
                    for (a, b) in if i == j { vec![(a, b)] } else { vec![(a, b), (b, a)] } {
                        (0..D).for_each(|m| out.matrix[(b * D + m) * size + a * D + m] += pi * x * y);
                    }
                }
            }
        }
    }

    fn advance(&self, _: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let h = self.frame.gradient(view.displacement);
        condensed_step[0] = 0.0;
        let range = self.frame.first * D..(self.frame.first + D + 1) * D;
        for ((strain, slope), out) in self.strains(&h).iter().zip(self.slopes(&h)).zip(&mut condensed_step[1..]) {
            let change: f64 = slope.iter().zip(&step[range.clone()]).map(|(s, d)| s * d).sum();
            *out = self.stiffness * (strain + change) / self.unit;
        }
        1.0
    }
}

/// A moment on a frame: virtual work $M\cdot\delta\omega$, $\delta\omega$ the axial vector of $\delta F F^{-1}$.
struct Turning<const D: usize> {
    frame: Frame<D>,
    moment: [f64; 3],
    amplitude: Amplitude,
}

impl<const D: usize> Turning<D> {
    /// $\tfrac12 M_k\varepsilon_{kij}$, with which $\partial\Pi/\partial F = \hat M F$ for a rotation $F$.
    fn turning(&self) -> SMatrix<f64, D, D> {
        let [x, y, z] = self.moment;
        let all = Matrix3::new(0.0, z, -y, -z, 0.0, x, y, -x, 0.0) * 0.5;
        SMatrix::from_fn(|i, j| all[(i, j)])
    }
}

impl<const D: usize> Term for Turning<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        1
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
        let f = SMatrix::<f64, D, D>::identity() + self.frame.gradient(view.displacement);
        let turning = self.turning();
        let stress = turning * f;
        let size = (D + 1) * D;
        for k in 0..=D {
            for i in 0..D {
                let force: f64 = (0..D).map(|axis| stress[(i, axis)] * self.frame.slope(k, axis)).sum();
                out.residual[k * D + i] += factor * force;
                out.load_slope[k * D + i] += change * force;
            }
        }
        if !out.with_matrix {
            return;
        }
        for k in 0..=D {
            for l in 0..=D {
                let both: f64 = (0..D).map(|axis| self.frame.slope(k, axis) * self.frame.slope(l, axis)).sum();
                for i in 0..D {
                    for j in 0..D {
                        out.matrix[(l * D + j) * size + k * D + i] += factor * turning[(i, j)] * both;
                    }
                }
            }
        }
    }
}
