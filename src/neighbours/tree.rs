//! Distances to neighbours by rank, from a tree that follows the points however unevenly they lie.

use std::collections::BinaryHeap;

use crate::geometry::Point;

/// Points in a leaf, which are looked at one by one.
const LEAF: usize = 8;

/// A k-d tree: the points between `low` and `high` have their median along the widest extent in the middle, smaller
/// ones before it and larger ones behind.
struct Tree<const D: usize> {
    points: Vec<Point<D>>,
    /// Place of each point in the list that was given.
    numbers: Vec<u32>,
    /// The axis along which the points around each middle are split.
    axes: Vec<u8>,
}

impl<const D: usize> Tree<D> {
    fn new(positions: &[Point<D>]) -> Self {
        let mut numbers: Vec<u32> = (0..positions.len() as u32).collect();
        let mut axes = vec![0; positions.len()];
        let mut open = vec![(0, positions.len())];
        while let Some((low, high)) = open.pop() {
            if high - low <= LEAF {
                continue;
            }
            let (mut min, mut max) = (Point::<D>::repeat(f64::INFINITY), Point::<D>::repeat(f64::NEG_INFINITY));
            for &number in &numbers[low..high] {
                min = min.zip_map(&positions[number as usize], f64::min);
                max = max.zip_map(&positions[number as usize], f64::max);
            }
            let axis = (max - min).imax();
            let middle = (high - low) / 2;
            let along = |a: &u32, b: &u32| positions[*a as usize][axis].total_cmp(&positions[*b as usize][axis]);
            numbers[low..high].select_nth_unstable_by(middle, along);
            let middle = low + middle;
            axes[middle] = axis as u8;
            open.extend([(low, middle), (middle + 1, high)]);
        }
        Tree { points: numbers.iter().map(|&n| positions[n as usize]).collect(), numbers, axes }
    }

    /// Keeps the `rank` smallest distances from a point to the others between `low` and `high`; the number of points looked
    /// at.
    fn search(
        &self,
        (low, high): (usize, usize),
        own: u32,
        x: &Point<D>,
        rank: usize,
        nearest: &mut BinaryHeap<u64>,
    ) -> usize {
        let look = |places: std::ops::Range<usize>, nearest: &mut BinaryHeap<u64>| {
            let looked_at = places.len();
            for place in places.filter(|&place| self.numbers[place] != own) {
                // Bits of positive numbers rise with them; NaN counts as the largest.
                let distance = (self.points[place] - x).norm().to_bits();
                if nearest.len() < rank {
                    nearest.push(distance);
                } else if let Some(mut largest) = nearest.peek_mut()
                    && distance < *largest
                {
                    *largest = distance;
                }
            }
            looked_at
        };
        if high - low <= LEAF {
            return look(low..high, nearest);
        }
        let middle = low + (high - low) / 2;
        let axis = usize::from(self.axes[middle]);
        let beyond = x[axis] - self.points[middle][axis];
        let halves = [(low, middle), (middle + 1, high)];
        let near = usize::from(beyond > 0.0);
        let mut looked_at = self.search(halves[near], own, x, rank, nearest);
        looked_at += look(middle..middle + 1, nearest);
        // Rounding may bring a norm below its largest component by a bit or two.
        let largest = nearest.peek().map_or(f64::INFINITY, |&bits| f64::from_bits(bits) * (1.0 + 4.0 * f64::EPSILON));
        if nearest.len() < rank || !(beyond.abs() > largest) {
            looked_at += self.search(halves[1 - near], own, x, rank, nearest);
        }
        looked_at
    }
}

/// The distance from each point to its neighbour of rank `rank`, 1 being the nearest; `rank` is below their number.
pub(crate) fn distances<const D: usize>(positions: &[Point<D>], rank: usize) -> Vec<f64> {
    let tree = Tree::new(positions);
    let mut nearest = BinaryHeap::with_capacity(rank);
    positions
        .iter()
        .enumerate()
        .map(|(k, x)| {
            nearest.clear();
            tree.search((0, positions.len()), k as u32, x, rank, &mut nearest);
            nearest.peek().map_or(f64::INFINITY, |&bits| f64::from_bits(bits))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_by_rank_are_those_of_a_full_search() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut positions: Vec<Point<2>> =
            (0..300).map(|_| Point::<2>::new(random.f64().powi(3) * 9.0, random.f64())).collect();
        // Points in a row, at one place and far away are points like others.
        positions.extend((0..20).map(|k| Point::<2>::new(f64::from(k), 0.5)));
        positions.extend([Point::<2>::new(2.0, 0.5), Point::<2>::new(1e6, 1e6)]);
        for rank in [1, 6, positions.len() - 1] {
            let found = distances(&positions, rank);
            for (k, x) in positions.iter().enumerate() {
                let mut all: Vec<f64> = positions.iter().map(|y| (y - x).norm()).collect();
                all.sort_by(f64::total_cmp);
                assert_eq!(found[k], all[rank]);
            }
        }
    }

    #[test]
    fn a_far_point_costs_no_more_than_others() {
        let mut random = fastrand::Rng::with_seed(6);
        let mut positions: Vec<Point<2>> = (0..20_000).map(|_| Point::<2>::from_fn(|_, _| random.f64())).collect();
        let mut looked_at = |first: f64| -> usize {
            positions[0] = Point::<2>::repeat(first);
            let tree = Tree::new(&positions);
            let all = (0, positions.len());
            let search = |(k, x)| tree.search(all, k as u32, x, 6, &mut BinaryHeap::new());
            positions.iter().enumerate().map(search).sum()
        };
        // With bins over the whole extent all the others were in one.
        let (near, far) = (looked_at(0.5), looked_at(1e6));
        assert!(near < 100 * 20_000 && far < near + near / 10, "{near} {far}");
    }
}
