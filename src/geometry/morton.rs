//! A space-filling curve: places near each other along it are near each other in space.

use super::Point;

/// Morton's curve through the bounding box of a set of points.
pub(crate) struct Morton<const D: usize> {
    low: Point<D>,
    /// Cells of the curve's finest grid per length.
    density: f64,
}

impl<const D: usize> Morton<D> {
    /// Bits along each axis: 63 in all.
    const BITS: u32 = 63 / D as u32;

    /// The curve through a cube around points; through the origin where there are none.
    pub(crate) fn through(points: &[Point<D>]) -> Self {
        let first = points.first().copied().unwrap_or_else(Point::zeros);
        let (low, high) = points.iter().fold((first, first), |(low, high), x| (low.inf(x), high.sup(x)));
        let extent = (high - low).max().max(f64::MIN_POSITIVE);
        // The last cell of the grid holds its own end.
        Morton { low, density: ((1u64 << Self::BITS.min(32)) - 1) as f64 / extent }
    }

    /// The place of a point along the curve.
    pub(crate) fn place(&self, x: &Point<D>) -> u64 {
        let at: [u64; D] = std::array::from_fn(|i| ((x[i] - self.low[i]) * self.density).max(0.0) as u64);
        let bits = Self::BITS.min(32);
        let mut place = 0;
        for bit in (0..bits).rev() {
            for along in &at {
                place = place << 1 | (along >> bit & 1);
            }
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along the curve a square of 4 × 4 places goes quarter by quarter.
    #[test]
    fn quarters_follow_each_other() {
        let points: Vec<Point<2>> = (0..16).map(|k| [f64::from(k % 4), f64::from(k / 4)].into()).collect();
        let curve = Morton::through(&points);
        let mut order: Vec<usize> = (0..16).collect();
        order.sort_by_key(|&k| curve.place(&points[k]));
        for quarter in order.chunks(4) {
            let low = quarter.iter().map(|k| [k % 4 / 2, k / 4 / 2]).collect::<std::collections::BTreeSet<_>>();
            assert_eq!(low.len(), 1, "{order:?}");
        }
    }
}
