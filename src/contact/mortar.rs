//! The mean gap between two chords that face each other, with its derivatives.

use crate::geometry::Vec2;

use super::jet::Jet;

/// Coordinates of the ends of two chords.
pub(super) const LOCAL: usize = 8;
/// Points of Gauss's rule over an overlap, as parts of it; their weights are a half. Exact for the product of two trace functions and
/// the measure of revolution.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Where an overlap ends on its chord.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum End {
    /// At a place that does not move along the chord.
    At(f64),
    /// Where an end of the other chord is opposite.
    Opposite(usize),
}

/// A part of a chord, from 0 to 1 along it, and the chord opposite.
#[derive(Debug, Clone, Copy)]
pub(super) struct Overlap {
    pub other: u32,
    pub ends: [End; 2],
}

/// Two chords at a state: `[a, b, c, d]`, the ends of one, then of the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facing {
    pub ends: [Vec2; 4],
    /// Outward to the right of the way from a to b (1) or to the left (-1).
    pub sign: f64,
    /// Reference measure at a and b, of which the trace functions take their part.
    pub measure: [f64; 2],
}

/// $G_a = \int N_a\\,g\\,\mathrm d\Gamma$ over an overlap for the trace function of one end of the first chord.
#[derive(Debug, Clone)]
pub(super) struct MeanGap {
    pub gap: Jet<LOCAL>,
    /// $\int N_a\\,\mathrm d\Gamma$ over the overlap.
    pub area: Jet<LOCAL>,
    /// $\int N_a N_k\,\mathrm d\Gamma$ of the four ends: what they move it by.
    pub shares: [f64; 4],
}

/// Direction of the chord, its outward normal, and where the ends of the other one are along it.
struct Frame {
    normal: [Jet<LOCAL>; 2],
    opposite: [Jet<LOCAL>; 2],
}

/// The outward normal of a chord that runs along a vector, outward to its right (1) or to its left (-1).
pub(super) fn outward(along: &Vec2, sign: f64) -> Vec2 {
    Vec2::new(along[1], -along[0]) * (sign / along.norm())
}

impl Facing {
    fn frame(&self) -> Frame {
        let x: [[Jet<LOCAL>; 2]; 4] =
            std::array::from_fn(|k| std::array::from_fn(|i| Jet::variable(self.ends[k][i], 2 * k + i)));
        let along: [Jet<LOCAL>; 2] = std::array::from_fn(|i| x[1][i] - x[0][i]);
        let square = along[0] * along[0] + along[1] * along[1];
        let inverse = square.reciprocal();
        let by_length = square.root().reciprocal() * self.sign;
        let opposite = std::array::from_fn(|k| {
            ((x[2 + k][0] - x[0][0]) * along[0] + (x[2 + k][1] - x[0][1]) * along[1]) * inverse
        });
        Frame { normal: [along[1] * by_length, along[0] * by_length * -1.0], opposite }
    }

    /// The outward normal of the first chord.
    pub(crate) fn normal(&self) -> Vec2 {
        outward(&(self.ends[1] - self.ends[0]), self.sign)
    }

    /// The mean gap under the trace function of end `end`, 0 or 1, over an overlap.
    pub(crate) fn mean_gap(&self, overlap: &Overlap, end: usize) -> MeanGap {
        let Frame { normal, opposite } = self.frame();
        let place = |end: End| match end {
            End::At(place) => Jet::constant(place),
            End::Opposite(k) => opposite[k],
        };
        let (from, to) = (place(overlap.ends[0]), place(overlap.ends[1]));
        let (width, one) = (to - from, Jet::constant(1.0));
        let across = (opposite[1] - opposite[0]).reciprocal();
        // ∫ N_a g, where the gap along the normal is linear between those of the ends of the other chord.
        let gaps: [Jet<LOCAL>; 2] = std::array::from_fn(|k| {
            (0..2).fold(Jet::constant(0.0), |sum, i| {
                let away = Jet::variable(self.ends[2 + k][i], 4 + 2 * k + i) - Jet::variable(self.ends[0][i], i);
                sum + normal[i] * away
            })
        });
        let (mut gap, mut area, mut shares) = (Jet::constant(0.0), Jet::constant(0.0), [0.0; 4]);
        for at in GAUSS {
            let xi = from + width * at;
            let eta = (xi - opposite[0]) * across;
            let traces = [one - xi, xi];
            let measure = traces[0] * self.measure[0] + traces[1] * self.measure[1];
            let weight = width * measure * traces[end] * 0.5;
            area = area + weight;
            for (share, part) in shares.iter_mut().zip([traces[0], traces[1], one - eta, eta]) {
                *share += weight.value * part.value;
            }
            gap = gap + weight * (gaps[0] * (one - eta) + gaps[1] * eta);
        }
        MeanGap { gap, area, shares }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::assert_derivatives;
    use super::*;
    use approx::assert_abs_diff_eq;

    fn facing(q: &[f64; LOCAL]) -> Facing {
        let point = |k: usize| Vec2::new(q[2 * k], q[2 * k + 1]);
        Facing { ends: std::array::from_fn(point), sign: 1.0, measure: [0.7, 1.3] }
    }

    const AT: [f64; LOCAL] = [0.0, 0.0, 1.1, 0.2, 1.5, -0.3, 0.4, -0.1];

    /// Gradient and Hessian are those of differences.
    #[test]
    fn derivatives() {
        let overlap = Overlap { other: 0, ends: [End::Opposite(1), End::At(1.0)] };
        for end in 0..2 {
            let at = |q: &[f64; LOCAL]| {
                let gap = facing(q).mean_gap(&overlap, end).gap;
                (gap.value, gap.slope, gap.curve)
            };
            assert_derivatives(at, &AT);
        }
    }

    /// Moving or turning both chords leaves the gap.
    #[test]
    fn rigid_motions() {
        let overlap = Overlap { other: 0, ends: [End::Opposite(1), End::At(1.0)] };
        let here = facing(&AT).mean_gap(&overlap, 0);
        let (sine, cosine) = 0.7f64.sin_cos();
        let mut turned = AT;
        for k in 0..LOCAL / 2 {
            let (x, y) = (AT[2 * k], AT[2 * k + 1]);
            turned[2 * k] = cosine * x - sine * y + 3.0;
            turned[2 * k + 1] = sine * x + cosine * y - 2.0;
        }
        let there = facing(&turned).mean_gap(&overlap, 0);
        assert_abs_diff_eq!(here.gap.value, there.gap.value, epsilon = 1e-14);
        assert_abs_diff_eq!(here.area.value, there.area.value, epsilon = 1e-14);
    }
}
