//! A tree of boxes: which boxes hold a point, which lie nearest to it.

use crate::each::{Each, EachOf};
use crate::geometry::{Bounds, Point};
use crate::order;

/// Boxes in a leaf, which are looked at one by one.
pub(crate) const LEAF: usize = 8;

/// Boxes halved along the widest extent of their middles, with the box of each half: it follows the boxes however
/// unevenly they lie.
#[derive(Debug, Clone)]
pub(crate) struct BoxTree<const D: usize> {
    boxes: Vec<Bounds<D>>,
    /// The boxes' numbers, in the order of the leaves.
    numbers: Vec<u32>,
    /// The box of each part; those of the halves of part k are 2k + 1 and 2k + 2.
    parts: Vec<Bounds<D>>,
}

/// A part: its number and the range of its boxes.
type Part = (usize, usize, usize);

fn halves((part, low, high): Part) -> [Part; 2] {
    let middle = low + (high - low) / 2;
    [(2 * part + 1, low, middle), (2 * part + 2, middle, high)]
}

impl<const D: usize> BoxTree<D> {
    pub(crate) fn new(boxes: Vec<Bounds<D>>) -> Self {
        let mut numbers: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut parts = Vec::new();
        let mut open = vec![(0, 0, boxes.len())];
        while let Some((part, low, high)) = open.pop() {
            let (mut around, mut middles) = (Bounds::none(), Bounds::none());
            let middle = |number: u32| boxes[number as usize].low + boxes[number as usize].high;
            for &number in &numbers[low..high] {
                around = around.join(&boxes[number as usize]);
                middles = middles.join(&Bounds::of([&middle(number)]));
            }
            if parts.len() <= part {
                parts.resize(part + 1, Bounds::none());
            }
            parts[part] = around;
            if high - low > LEAF {
                let axis = middles.extent().imax();
                order::halve(&mut numbers[low..high], &|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
                open.extend(halves((part, low, high)));
            }
        }
        BoxTree { boxes, numbers, parts }
    }

    /// A tree of points.
    pub(crate) fn of(points: &[Point<D>]) -> Self {
        BoxTree::new(points.mapped(|x| Bounds::of([x])))
    }

    /// Hands out each part with the numbers of its boxes.
    pub(crate) fn each_part(&self, with: &mut dyn FnMut(usize, &[u32])) {
        let mut open = vec![(0, 0, self.numbers.len())];
        while let Some(part) = open.pop() {
            with(part.0, &self.numbers[part.1..part.2]);
            if part.2 - part.1 > LEAF {
                open.extend(halves(part));
            }
        }
    }

    /// Visits the boxes in all parts that `enter`, given the part and its box, goes into; whether a visit was the last, having given `true`.
    pub(crate) fn walk(
        &self,
        mut enter: impl FnMut(usize, &Bounds<D>) -> bool,
        mut visit: impl FnMut(usize) -> bool,
    ) -> bool {
        let mut open = vec![(0, 0, self.numbers.len())];
        while let Some(part) = open.pop() {
            if !enter(part.0, &self.parts[part.0]) {
                continue;
            }
            if part.2 - part.1 > LEAF {
                open.extend(halves(part));
            } else if self.numbers[part.1..part.2].iter().any(|&number| visit(number as usize)) {
                return true;
            }
        }
        false
    }

    /// Whether `found(box)` holds for any of the boxes that contain a point; it is called for no others.
    pub(crate) fn any_at(&self, x: &Point<D>, mut found: impl FnMut(usize) -> bool) -> bool {
        self.walk(|_, own| own.holds(x), |number| self.boxes[number].holds(x) && found(number))
    }

    /// Visits the boxes that have a point in common with another one.
    pub(crate) fn each_meeting(&self, within: &Bounds<D>, mut visit: impl FnMut(usize)) {
        self.walk(
            |_, own| own.meets(within),
            |number| {
                if self.boxes[number].meets(within) {
                    visit(number);
                }
                false
            },
        );
    }

    /// Visits boxes with their distance from a point, near ones first, as long as that is at most what the last visit gave
    /// back.
    pub(crate) fn approach(&self, x: &Point<D>, mut visit: impl FnMut(usize, f64) -> f64) {
        let mut bound = f64::INFINITY;
        let mut open = vec![(0.0, (0, 0, self.numbers.len()))];
        while let Some((distance, part)) = open.pop() {
            if distance > bound {
                continue;
            }
            if part.2 - part.1 > LEAF {
                let mut both = halves(part).each(|half| (self.parts[half.0].distance(x), half));
                if both[0].0 < both[1].0 {
                    both.reverse();
                }
                open.extend(both);
                continue;
            }
            for &number in &self.numbers[part.1..part.2] {
                let distance = self.boxes[number as usize].distance(x);
                // Boxes as near as the last one count: the caller decides between them.
                if !(distance > bound) {
                    bound = visit(number as usize, distance);
                }
            }
        }
    }

    /// The box nearest to a point, the first of those equally near; none without boxes.
    pub(crate) fn nearest(&self, x: &Point<D>) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        self.approach(x, |number, distance| {
            if best.is_none_or(|(least, first)| distance < least || (distance == least && number < first)) {
                best = Some((distance, number));
            }
            best.map_or(f64::INFINITY, |(least, _)| least)
        });
        best.map(|(_, number)| number)
    }

    /// The distance from box `own` at `x` to the one of rank `rank` of the others, 1 being the nearest.
    pub(crate) fn distance_by_rank(&self, own: usize, x: &Point<D>, rank: usize) -> f64 {
        let mut nearest = std::collections::BinaryHeap::with_capacity(rank + 1);
        let mut reached = f64::INFINITY;
        self.approach(x, |number, distance| {
            if number != own {
                // Bits of positive numbers rise with them; NaN counts as the largest.
                nearest.push(distance.to_bits());
                if nearest.len() > rank {
                    nearest.pop();
                }
                if nearest.len() == rank {
                    reached = nearest.peek().map_or(f64::INFINITY, |&bits| f64::from_bits(bits));
                }
            }
            reached
        });
        reached
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;

    fn scattered(count: usize) -> Vec<Vec2> {
        let mut random = fastrand::Rng::with_seed(5);
        let mut points: Vec<Vec2> = (0..count).map(|_| Vec2::new(random.f64().powi(3) * 9.0, random.f64())).collect();
        // Points in a row, at one place and far away are points like others.
        points.extend((0..20).map(|k| Vec2::new(f64::from(k), 0.5)));
        points.extend([Vec2::new(2.0, 0.5), Vec2::new(1e6, 1e6)]);
        points
    }

    #[test]
    fn what_is_found_is_what_a_full_search_finds() {
        let points = scattered(300);
        let tree = BoxTree::of(&points);
        let boxes: Vec<Bounds<2>> = points.windows(2).map(Bounds::of).collect();
        let wide = BoxTree::new(boxes.clone());
        for (k, x) in points.iter().enumerate() {
            let mut all: Vec<f64> = points.iter().map(|y| (y - x).norm()).collect();
            let at = all.iter().position(|d| *d == 0.0);
            assert_eq!(tree.nearest(x), at);
            all.sort_by(f64::total_cmp);
            for rank in [1, 6, points.len() - 1] {
                assert_eq!(tree.distance_by_rank(k, x, rank), all[rank]);
            }
            let mut held = Vec::new();
            assert!(!wide.any_at(x, |number| {
                held.push(number);
                false
            }));
            held.sort_unstable();
            assert!(held.into_iter().eq((0..boxes.len()).filter(|&b| boxes[b].holds(x))));
        }
        assert_eq!(BoxTree::<2>::of(&[]).nearest(&points[0]), None);
    }

    #[test]
    fn a_far_point_costs_no_more_than_others() {
        let mut points = scattered(20_000);
        let mut looked_at = |first: f64| -> usize {
            points[0] = Vec2::repeat(first);
            let tree = BoxTree::of(&points);
            let mut count = 0;
            for x in &points {
                tree.approach(x, |_, distance| {
                    count += 1;
                    // The nearest other point.
                    if distance > 0.0 { distance } else { f64::INFINITY }
                });
            }
            count
        };
        let (near, far) = (looked_at(0.5), looked_at(1e9));
        assert!(near < 100 * points.len() && far < near + near / 10, "{near} {far}");
    }
}
