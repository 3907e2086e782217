//! Evaluation of the functions at a point.

use crate::basis::Basis;
use crate::each::point_of;
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::simd::dispatch;

use super::super::correction::{Correction, padded, resize};
use super::super::{Approximation, Scratch, ShapeFunctions};
use super::{EDGE, Form, KernelScratch, Reach, ReproducingKernel, sign};

impl<const D: usize, K: Kernel, B: Basis<D>> ReproducingKernel<D, K, B> {
    /// Everything of [`Approximation::evaluate`]; gradients only where requested.
    fn evaluate_some(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
        gradients: bool,
    ) -> Result<(), ApproximationError> {
        ensure!(at.iter().all(|x| x.is_finite()), ApproximationError::Point { at: at.as_slice().to_vec() });
        let terms = self.basis.len();
        self.collect(at, scratch, out);
        // A particle whose kernel underflows to zero inside its support adds nothing; met at its very edge.
        if !self.weigh(scratch, out, gradients) {
            self.drop_weightless(at, scratch, out)?;
            self.weigh(scratch, out, gradients);
        }
        let covering = out.nodes.len();
        if covering < terms {
            return Err(ApproximationError::Uncovered { at: at.as_slice().to_vec(), covering, needed: terms });
        }
        // One over the widest support.
        let halves = &scratch.inverse_halves[..covering];
        let inverse_scale = halves.iter().fold(halves[0], |scale, half| scale.zip_map(half, f64::min));
        let stride = padded(covering);
        resize(&mut scratch.sums.scaled, D * stride);
        for (a, offset) in scratch.offsets[..covering].iter().enumerate() {
            for k in 0..D {
                scratch.sums.scaled[k * stride + a] = offset[k] * inverse_scale[k];
            }
        }
        for k in 0..D {
            scratch.sums.scaled[k * stride + covering..(k + 1) * stride].fill(0.0);
        }
        let sums = &mut scratch.sums;
        out.rcond = dispatch(Correction {
            basis: &self.basis,
            inverse_scale,
            stride,
            sums,
            gradients,
            rcond_limit: self.rcond_limit,
        });
        // A matrix without an inverse has 0, whatever the limit; NaN is refused too.
        ensure!(out.rcond > 0.0 && out.rcond >= self.rcond_limit, self.refusal(at, scratch, out, gradients));
        out.values.clear();
        out.values.extend_from_slice(&scratch.sums.values[..covering]);
        if gradients {
            let slopes = &scratch.sums.slopes;
            out.gradients.clear();
            out.gradients.extend((0..covering).map(|a| point_of(|k| slopes[k * stride + a])));
        }
        Ok(())
    }

    /// Finds the particles that cover a point, and their distances in terms of their supports.
    fn collect(&self, at: &Point<D>, scratch: &mut KernelScratch<D>, out: &mut ShapeFunctions<D>) {
        let candidates = self.bins.candidates(at);
        let row = candidates.len();
        let KernelScratch { offsets, inverse_halves, distances, .. } = scratch;
        out.nodes.resize(row, 0);
        if offsets.len() < row {
            offsets.resize(row, Point::zeros());
            inverse_halves.resize(row, Point::zeros());
        }
        resize(distances, D * row);
        let (mut covering, mut balls) = (0, 0);
        // Each candidate is written down and counted if it covers the point: no branch that the machine has to guess.
        for &particle in candidates {
            let reach = &self.reaches[particle as usize];
            let offset = at - reach.position;
            let mut inside = true;
            match reach.form {
                Form::Ball => {
                    let distance = offset.norm() * reach.inverse[0];
                    inside = distance < EDGE;
                    distances[covering] = distance;
                    for k in 1..D {
                        distances[k * row + covering] = 0.0;
                    }
                }
                Form::Box => {
                    for k in 0..D {
                        let distance = offset[k].abs() * reach.inverse[k];
                        inside &= distance < EDGE;
                        distances[k * row + covering] = distance;
                    }
                }
                Form::Parallelepiped(place) => {
                    let xi = self.inverse_axes[place as usize] * offset;
                    for k in 0..D {
                        let distance = xi[k].abs();
                        inside &= distance < EDGE;
                        distances[k * row + covering] = distance;
                    }
                }
            }
            out.nodes[covering] = particle;
            offsets[covering] = offset;
            inverse_halves[covering] = reach.inverse;
            covering += usize::from(inside);
            balls += usize::from(inside && reach.form == Form::Ball);
        }
        out.nodes.truncate(covering);
        scratch.row = row;
        scratch.balls = balls;
        if let Some(visibility) = &self.visibility
            && out.nodes.iter().any(|&node| visibility.is_near_slot(node))
        {
            let mut sights = std::mem::take(&mut scratch.sights);
            let near = out.nodes.iter().copied().filter(|&node| visibility.is_near_slot(node));
            let mut seen = visibility.seen(at, near, &mut sights).iter();
            self.retain(scratch, out, |_, node| !visibility.is_near_slot(node) || seen.next().is_none_or(|seen| *seen));
            scratch.sights = sights;
        }
    }

    /// Removes particles whose kernel vanishes at the point; the kernel is nowhere negative.
    fn drop_weightless(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.check_kernel(at, scratch, out)?;
        let weights = std::mem::take(&mut scratch.sums.weights);
        self.retain(scratch, out, |a, _| weights[a] > 0.0);
        scratch.sums.weights = weights;
        Ok(())
    }

    /// Keeps covering particles, given by their place and number, for which a predicate holds.
    fn retain(
        &self,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
        mut keeps: impl FnMut(usize, u32) -> bool,
    ) {
        let row = scratch.row;
        let mut kept = 0;
        for a in 0..out.nodes.len() {
            if keeps(a, out.nodes[a]) {
                out.nodes[kept] = out.nodes[a];
                scratch.offsets[kept] = scratch.offsets[a];
                scratch.inverse_halves[kept] = scratch.inverse_halves[a];
                for k in 0..D {
                    scratch.distances[k * row + kept] = scratch.distances[k * row + a];
                }
                kept += 1;
            }
        }
        out.nodes.truncate(kept);
        scratch.balls = out.nodes.iter().filter(|&&node| self.reaches[node as usize].form == Form::Ball).count();
    }

    /// Kernel values and, if requested, gradients of the collected particles, as [`kernel_at`](Self::kernel_at)
    /// has them; `false` where a value is not positive.
    fn weigh(&self, scratch: &mut KernelScratch<D>, out: &ShapeFunctions<D>, gradients: bool) -> bool {
        let covering = out.nodes.len();
        let stride = padded(covering);
        let KernelScratch { offsets, inverse_halves, balls, row, distances, factors, factor_slopes, sums, .. } =
            scratch;
        let (balls, row) = (*balls, *row);
        resize(&mut sums.weights, stride);
        resize(&mut sums.slopes, D * stride);
        sums.weights[covering..stride].fill(0.0);
        for k in 0..D {
            sums.slopes[k * stride + covering..(k + 1) * stride].fill(0.0);
        }
        resize(factors, D * row);
        resize(factor_slopes, D * row);
        // A ball has one distance and one factor, a box one for each axis.
        let axes = if balls == covering { 1 } else { D };
        for k in 0..axes {
            let all = k * row..k * row + covering;
            self.kernel.fill(&distances[all.clone()], &mut factors[all.clone()], &mut factor_slopes[all]);
        }
        // Boxes alone are by far the usual case.
        let boxes = balls == 0 && self.inverse_axes.is_empty();
        let form = |a: usize| if boxes { Form::Box } else { self.reaches[out.nodes[a] as usize].form };
        if balls == 0 && !gradients && self.densities.is_empty() {
            // What smoothed tables ask for: products of whole rows.
            let weights = &mut sums.weights[..covering];
            weights.copy_from_slice(&factors[..covering]);
            for k in 1..D {
                for (weight, factor) in weights.iter_mut().zip(&factors[k * row..k * row + covering]) {
                    *weight *= factor;
                }
            }
            return weights.iter().fold(true, |positive, weight| positive & (*weight > 0.0));
        }
        let mut positive = true;
        for a in 0..covering {
            let mut weight = 1.0;
            let form = form(a);
            if form == Form::Ball {
                weight = factors[a];
                if gradients {
                    // The kernel is even: its slope vanishes at the centre, where the direction is undefined.
                    let distance = offsets[a].norm();
                    let slope = factor_slopes[a] * inverse_halves[a][0];
                    let scale = if distance > 0.0 { slope / distance } else { 0.0 };
                    for k in 0..D {
                        sums.slopes[k * stride + a] = offsets[a][k] * scale;
                    }
                }
            } else {
                for k in 0..D {
                    weight *= factors[k * row + a];
                }
                // Slopes by places in the support, then by those in the body.
                let by_place = |k: usize, sign: f64| {
                    let others = (0..D).filter(|&other| other != k).map(|other| factors[other * row + a]);
                    others.fold(factor_slopes[k * row + a] * sign, |slope, factor| slope * factor)
                };
                match form {
                    _ if !gradients => {}
                    Form::Parallelepiped(place) => {
                        let inverse = &self.inverse_axes[place as usize];
                        let xi = inverse * offsets[a];
                        let slopes = inverse.tr_mul(&point_of::<D>(|k| by_place(k, sign(xi[k]))));
                        for k in 0..D {
                            sums.slopes[k * stride + a] = slopes[k];
                        }
                    }
                    Form::Ball | Form::Box => {
                        for k in 0..D {
                            sums.slopes[k * stride + a] = by_place(k, sign(offsets[a][k]) * inverse_halves[a][k]);
                        }
                    }
                }
            }
            if let Some(&density) = self.densities.get(out.nodes[a] as usize) {
                weight *= density;
                for k in 0..D {
                    sums.slopes[k * stride + a] *= density;
                }
            }
            sums.weights[a] = weight;
            positive &= weight > 0.0;
        }
        positive
    }
}

impl<const D: usize, K: Kernel, B: Basis<D>> Approximation<D> for ReproducingKernel<D, K, B> {
    fn nodes(&self) -> &[Point<D>] {
        self.particles.positions()
    }

    fn evaluate(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.evaluate_some(at, scratch.of(), out, true)
    }

    fn evaluate_values(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.evaluate_some(at, scratch.of(), out, false)
    }

    fn surroundings(&self, low: &Point<D>, high: &Point<D>, nodes: &mut Vec<u32>, numbers: &mut Vec<f64>) -> bool {
        nodes.clear();
        numbers.clear();
        if !self.inverse_axes.is_empty() || !low.iter().chain(high.iter()).all(|x| x.is_finite()) {
            return false;
        }
        let touches = |particle: u32| {
            let Reach { position, inverse, form } = self.reaches[particle as usize];
            let gap = point_of::<D>(|k| (low[k] - position[k]).max(position[k] - high[k]).max(0.0) * inverse[k]);
            match form {
                Form::Ball => gap.norm() < EDGE,
                _ => gap.iter().fold(true, |inside, gap| inside & (*gap < EDGE)),
            }
        };
        if !self.bins.within(low, high, touches, nodes) {
            return false;
        }
        if self.visibility.as_ref().is_some_and(|v| nodes.iter().any(|&node| v.is_near_slot(node))) {
            return false;
        }
        let Some(&first) = nodes.first() else { return true };
        let scale = self.reaches[first as usize].inverse;
        numbers.extend(scale.iter().map(|s| s.ln()));
        for &node in &*nodes {
            let Reach { position, inverse, form } = self.reaches[node as usize];
            for k in 0..D {
                numbers.push((position[k] - low[k]) * inverse[k]);
                numbers.push(inverse[k] / scale[k]);
            }
            numbers.push(f64::from(u8::from(form == Form::Ball)));
            numbers.extend(self.densities.get(node as usize));
        }
        true
    }
}
