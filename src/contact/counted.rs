//! The gap of a trace function: a mean in which depth counts for more.

/// The length $\ell$ over which depth counts, as a part of the width of a trace function: the shortest waves of the surface are stable
/// from a depth of a fifth of the width on at pressures of ten shear moduli.
const LENGTH: f64 = 1.0 / 6.0;

/// The gap $\bar g$ of a trace function, with $\int\Theta\\,c(g - \bar g)\\,\mathrm d\Gamma = 0$ and $c(x) = x - \langle -x\rangle^3/(3\ell^2)$.
///
/// A pressure that answers to the mean gap alone is a dead load on all that the mean does not see. The energy of an incompressible half
/// space under a dead pressure $\pi$ is $\tfrac k2(\mu a^2 + \mu b^2 - \pi ab)$ per length for waves $(b\sin kx, a\cos kx)$ of its
/// surface: unstable from $\pi = 2\mu$ on whatever the wave number $k$ is, so that finer trace functions change nothing, and the rigid
/// surface passes between the particles of the boundary. A stiffness of $k(\pi^2 - 4\mu^2)/(2\mu)$ against $a$ makes it stable. Here points
/// that are deeper than the mean count for more, and that stiffness is $2\pi\langle\bar g - g\rangle/\ell^2$. There is one potential and one
/// pressure for each trace function; equal gaps count as they are, and $c''$ is continuous: rounding of a gap and the curvature of an arc
/// do not matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CountedMean {
    /// $\bar g$ \[length\].
    pub gap: f64,
    length: f64,
    /// $\int\Theta\\,c'\\,\mathrm d\Gamma$ over the area.
    slope: f64,
}

impl CountedMean {
    /// The mean of gaps with their weights under a trace function of an undeformed width.
    pub(super) fn new(gaps: &[(f64, f64)], width: f64) -> Self {
        let (mut area, mut sum) = (0.0, 0.0);
        for (gap, weight) in gaps {
            area += weight;
            sum += weight * gap;
        }
        let mut mean = CountedMean { gap: sum / area, length: LENGTH * width, slope: 1.0 };
        // Newton's method from the plain mean: the sum is concave and falls with the mean, so that it comes down to the root.
        loop {
            let (mut sum, mut slope) = (0.0, 0.0);
            for (gap, weight) in gaps {
                let depth = mean.depth(*gap);
                let square = depth * depth;
                sum += weight * ((gap - mean.gap) - mean.length * depth * square / 3.0);
                slope += weight * (1.0 + square);
            }
            mean.slope = slope / area;
            let next = mean.gap + sum / slope;
            // Down to rounding.
            if !(next < mean.gap) {
                return mean;
            }
            mean.gap = next;
        }
    }

    /// How much deeper than the mean a gap is, over $\ell$.
    #[inline]
    fn depth(&self, gap: f64) -> f64 {
        ((self.gap - gap) / self.length).max(0.0)
    }

    /// The derivative of the mean by a gap, over that of a plain mean.
    #[inline]
    pub(super) fn part(&self, gap: f64) -> f64 {
        (1.0 + self.depth(gap).powi(2)) / self.slope
    }

    /// Its second derivative by the difference of a gap and the mean \[1/length\], over the first one of a plain mean.
    #[inline]
    pub(super) fn curvature(&self, gap: f64) -> f64 {
        -2.0 * self.depth(gap) / (self.length * self.slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    const GAPS: [(f64, f64); 4] = [(0.3, 0.2), (-0.7, 0.1), (0.05, 0.4), (-0.4, 0.3)];

    #[test]
    fn equal_gaps_are_their_mean_and_a_shift_of_all_shifts_it() {
        for gap in [0.3, -5.0] {
            let mean = CountedMean::new(&GAPS.map(|(_, weight)| (gap, weight)), 2.0);
            assert_abs_diff_eq!(mean.gap, gap, epsilon = 1e-15);
            assert_abs_diff_eq!(mean.part(gap), 1.0, epsilon = 1e-15);
        }
        let [here, there] = [0.0, 7.0].map(|by| CountedMean::new(&GAPS.map(|(gap, weight)| (gap + by, weight)), 2.0));
        assert_abs_diff_eq!(there.gap - here.gap, 7.0, epsilon = 1e-14);
        let plain = GAPS.iter().map(|(gap, weight)| gap * weight).sum::<f64>();
        assert!(here.gap < plain - 0.05 && here.gap > -0.7, "{} {plain}", here.gap);
    }

    #[test]
    fn parts_and_curvatures_are_derivatives() {
        let mean = CountedMean::new(&GAPS, 2.0);
        let parts = GAPS.map(|(gap, weight)| weight * mean.part(gap));
        assert_abs_diff_eq!(parts.iter().sum::<f64>(), 1.0, epsilon = 1e-14);
        for k in 0..GAPS.len() {
            let step = 1e-5;
            let moved = [-step, step].map(|by| {
                let mut gaps = GAPS;
                gaps[k].0 += by;
                (gaps, CountedMean::new(&gaps, 2.0))
            });
            assert_relative_eq!((moved[1].1.gap - moved[0].1.gap) / (2.0 * step), parts[k], max_relative = 1e-7);
            // d²ḡ/dg_k² = Σ w c''/⟨c'⟩ (δ - part)².
            let expected: f64 = (0..GAPS.len())
                .map(|l| {
                    let (gap, weight) = GAPS[l];
                    weight * mean.curvature(gap) * (f64::from(u8::from(l == k)) - parts[k]).powi(2)
                })
                .sum();
            let slopes = moved.map(|(gaps, mean)| gaps[k].1 * mean.part(gaps[k].0));
            assert_relative_eq!((slopes[1] - slopes[0]) / (2.0 * step), expected, max_relative = 1e-6);
        }
    }
}
