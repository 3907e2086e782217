//! Boxes in a grid of bins: a search looks into a few of them.

use std::collections::HashMap;

use crate::geometry::{Bounds, Vec3};

/// Boxes by the bins that they reach into.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    low: Vec3,
    /// The edge of a bin \[length\]; infinite, so that there is one, for coordinates that are not finite.
    pub size: f64,
    /// The last bin along each axis.
    last: [i32; 3],
    lists: HashMap<[i32; 3], Vec<u32>>,
}

impl Bins {
    /// Boxes with their numbers, in bins of a size.
    pub(super) fn new(boxes: &[(u32, Bounds<3>)], size: f64) -> Self {
        let Bounds { low, high } = boxes.iter().fold(Bounds::none(), |all, (_, own)| all.join(own));
        let size = if size > 0.0 && size.is_finite() { size } else { f64::INFINITY };
        let mut bins = Bins { low, size, last: [0; 3], lists: HashMap::new() };
        bins.last = bins.bin(&high);
        for (k, own) in boxes {
            let (from, to) = (bins.bin(&own.low), bins.bin(&own.high));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    for l in from[2]..=to[2] {
                        bins.lists.entry([i, j, l]).or_default().push(*k);
                    }
                }
            }
        }
        bins
    }

    fn bin(&self, x: &Vec3) -> [i32; 3] {
        [0, 1, 2].map(|i| ((x[i] - self.low[i]) / self.size).floor().clamp(-1e6, 1e6) as i32)
    }

    /// Rings around a bin that hold all others.
    pub(super) fn rings(&self) -> i32 {
        self.last.iter().fold(0, |most, last| most.max(*last)) + 1
    }

    /// Visits what reaches into the bins that are `ring` bins away from that of a point.
    pub(super) fn ring(&self, x: &Vec3, ring: i32, mut visit: impl FnMut(u32)) {
        let middle = self.bin(x);
        let span = |i: usize| (middle[i] - ring).max(0)..=(middle[i] + ring).min(self.last[i]);
        for i in span(0) {
            for j in span(1) {
                let whole = (i - middle[0]).abs() == ring || (j - middle[1]).abs() == ring;
                for l in span(2).filter(|l| whole || (l - middle[2]).abs() == ring) {
                    self.lists.get(&[i, j, l]).into_iter().flatten().for_each(|&k| visit(k));
                }
            }
        }
    }
}
