//! Richardson extrapolation of values from a series of models, and a bound of what it leaves.

/// Part of what first order leaves of the dual-weighted changes, which are summed without their signs.
const WEIGHTED: f64 = 0.25;
/// Measured orders are believed between these: the largest is that of quantities by quadratic functions.
const ORDERS: [f64; 2] = [0.5, 4.0];
/// Values are corrected by this order at least: the changes of smooth parts reverse their sign where corners take over.
const CAUTIOUS: f64 = 2.0;
/// Bisections for an order.
const BISECTIONS: usize = 40;

/// What extrapolation adds to the last value of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extrapolation {
    /// To be added to the last value.
    pub correction: f64,
    /// Bound of what is left then.
    pub left: f64,
}

/// Extrapolates a series of spacings $h$ and values $q$, from coarse to fine, whose last change has the dual-weighted sum $\eta$.
///
/// What order $a$ would leave of the last value, after the last change and after the one before, is
/// $$r_a = \max_{k = n, n-1}|q_k - q_{k-1}|\frac{h_n^a}{h_{k-1}^a - h_k^a}.$$
/// With the order $p$ of the last three values, between 1/2 and 4, the correction is what order $\max(p, 2)$ leaves after the last change,
/// with its sign, and the bound $r_{\min(p, 1)}$ less the correction. Where the last two changes differ in sign no order is known: the
/// value is not corrected, and its bound is $r_{1/2}$. Quantities without a dual solution are not corrected either; their bound is all of
/// $r_{\min(p, 1)}$. After two values the order is not known, and the bound is $r_{1/2}$. No bound is less than a quarter of what first order leaves of $\eta$.
pub(super) fn extrapolate(series: &[(f64, f64)], eta: f64, has_dual: bool) -> Extrapolation {
    let [.., (coarser, from), (finest, to)] = *series else {
        return Extrapolation { correction: 0.0, left: f64::INFINITY };
    };
    let left_by = |order: f64, coarse: f64, fine: f64| finest.powf(order) / (coarse.powf(order) - fine.powf(order));
    let weighted = WEIGHTED * eta * left_by(1.0, coarser, finest);
    let [.., (coarsest, before), _, _] = *series else {
        // Nothing has measured an order yet.
        let left = (to - from).abs() * left_by(ORDERS[0], coarser, finest);
        return Extrapolation { correction: 0.0, left: weighted.max(left) };
    };
    let remainder = |a: f64| {
        let last = (to - from).abs() * left_by(a, coarser, finest);
        last.max((from - before).abs() * left_by(a, coarsest, coarser))
    };
    let (correction, left) = match order([coarsest, coarser, finest], (from - before) / (to - from)) {
        None => (0.0, remainder(ORDERS[0])),
        Some(p) if !has_dual => (0.0, remainder(p.min(1.0))),
        Some(p) => {
            let correction = (to - from) * left_by(p.max(CAUTIOUS), coarser, finest);
            (correction, remainder(p.min(1.0)) - correction.abs())
        }
    };
    Extrapolation { correction, left: left.max(weighted) }
}

/// The order by which changes between three spacings have this ratio; none where their signs differ.
fn order([coarsest, coarser, finest]: [f64; 3], ratio: f64) -> Option<f64> {
    if !(ratio > 0.0) {
        return None;
    }
    let of = |p: f64| (coarsest.powf(p) - coarser.powf(p)) / (coarser.powf(p) - finest.powf(p));
    let [mut low, mut high] = ORDERS;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if of(middle) < ratio { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;

    /// Powers between orders 2 and 4 are extrapolated exactly; what falls more slowly lies within the bound.
    #[test]
    fn powers_are_extrapolated_to_their_limit() {
        for p in [2.0, 2.5, 3.3, 4.0] {
            let series: Vec<(f64, f64)> = [1.0, 0.5, 1.0 / 3.0].map(|h: f64| (h, 3.0 + 0.2 * h.powf(p))).to_vec();
            let found = extrapolate(&series, 0.0, true);
            let off = (series[2].1 + found.correction - 3.0).abs();
            assert!(off < 1e-9 && found.left > off, "{p}: {found:?}");
        }
        for p in [0.75, 1.0, 1.5] {
            let series: Vec<(f64, f64)> = [0.5, 0.25, 0.125].map(|h: f64| (h, 3.0 - 0.2 * h.powf(p))).to_vec();
            let found = extrapolate(&series, 0.0, true);
            let off = (series[2].1 + found.correction - 3.0).abs();
            assert!(off < (series[2].1 - 3.0).abs() && off <= found.left * (1.0 + 1e-9), "{p}: {found:?}");
        }
    }

    /// Values whose changes differ in sign are left as they are.
    #[test]
    fn changes_of_both_signs_are_not_corrected() {
        let found = extrapolate(&[(1.0, 1.0), (0.5, 2.0), (0.25, 1.9)], 0.0, true);
        let slowest = 1.0 / (1.0 - 0.5f64.sqrt()) * 0.5f64.sqrt(); // of the change 1 between spacings 1 and 1/2, left at 1/4
        assert!(
            found.correction == 0.0 && abs_diff_eq!(found.left, slowest * 0.5f64.sqrt(), epsilon = 1e-12),
            "{found:?}"
        );
        assert_eq!(extrapolate(&[(1.0, 1.0)], 0.0, true).left, f64::INFINITY);
        let same = extrapolate(&[(1.0, 2.0), (0.5, 2.0), (0.25, 2.0)], 0.0, true);
        assert_eq!((same.correction, same.left), (0.0, 0.0));
    }
}
