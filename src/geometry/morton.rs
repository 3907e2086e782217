//! A space-filling curve: places near each other along it are near each other in space.

/// Morton's curve through the bounding box of a set of points.
pub(crate) struct Morton {
    low: Vec<f64>,
    /// Cells of the curve's finest grid per length.
    density: f64,
}

impl Morton {
    /// Bits along each axis: 63 in all, and no more than 32.
    fn bits(dim: usize) -> u32 {
        63 / dim.max(2) as u32
    }

    /// The curve through a cube around points; through the origin where there are none.
    pub(crate) fn through<'a>(dim: usize, points: impl IntoIterator<Item = &'a [f64]>) -> Self {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for x in points {
            if low.is_empty() {
                low.extend_from_slice(x);
                high.extend_from_slice(x);
            }
            for i in 0..dim {
                low[i] = x[i].min(low[i]);
                high[i] = x[i].max(high[i]);
            }
        }
        low.resize(dim, 0.0);
        let extent = high.iter().zip(&low).fold(f64::MIN_POSITIVE, |extent, (high, low)| extent.max(high - low));
        // The last cell of the grid holds its own end.
        Morton { low, density: ((1u64 << Self::bits(dim)) - 1) as f64 / extent }
    }

    /// The place of a point along the curve.
    pub(crate) fn place(&self, x: &[f64]) -> u64 {
        let mut at = [0; 3];
        let at = &mut at[..self.low.len()];
        for (i, at) in at.iter_mut().enumerate() {
            *at = ((x[i] - self.low[i]) * self.density).max(0.0) as u64;
        }
        let mut place = 0;
        for bit in (0..Self::bits(at.len())).rev() {
            for along in &*at {
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
        let points: Vec<[f64; 2]> = (0..16).map(|k| [f64::from(k % 4), f64::from(k / 4)]).collect();
        let curve = Morton::through(2, points.iter().map(|x| &x[..]));
        let mut order: Vec<usize> = (0..16).collect();
        order.sort_by_key(|&k| curve.place(&points[k]));
        for quarter in order.chunks(4) {
            let low = quarter.iter().map(|k| [k % 4 / 2, k / 4 / 2]).collect::<std::collections::BTreeSet<_>>();
            assert_eq!(low.len(), 1, "{order:?}");
        }
    }
}
