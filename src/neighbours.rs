//! Neighbour search: by a grid of bins for particles that cover a point, by a tree for neighbours of a rank.

mod tree;

pub(crate) use tree::distances;

use crate::geometry::Point;
use crate::particles::Particles;

/// A grid of bins that lists, for each bin, the particles whose support touches it.
///
/// A query reads exactly one bin; candidates come in rising order of particle.
#[derive(Debug, Clone)]
pub(crate) struct BinGrid<const D: usize> {
    min: Point<D>,
    inverse_width: Point<D>,
    counts: [usize; D],
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

/// Bins per particle at which refining the grid no longer shortens the candidate lists enough.
const BINS_PER_PARTICLE: f64 = 4.0;
/// As many times more bins are accepted where some axes are shorter than a bin.
const WIDEST: f64 = 4.0;

impl<const D: usize> BinGrid<D> {
    pub(crate) fn new(particles: &Particles<D>) -> Self {
        let count = particles.positions().len();
        let mut min = Point::<D>::repeat(f64::INFINITY);
        let mut max = Point::<D>::repeat(f64::NEG_INFINITY);
        let mut mean = Point::<D>::zeros();
        for (x, support) in particles.positions().iter().zip(particles.supports()) {
            let half = support.half_widths();
            min = min.zip_map(&(x - half), f64::min);
            max = max.zip_map(&(x + half), f64::max);
            mean += half / count as f64;
        }
        // Bins half a support wide keep the lists short at a bounded number of entries per particle.
        let mut ideal = Point::<D>::from_fn(|i, _| (2.0 * (max[i] - min[i]) / mean[i]).max(1.0));
        let bins: f64 = ideal.iter().product();
        let limit = BINS_PER_PARTICLE * count as f64 + 64.0;
        if bins > limit {
            ideal *= (limit / bins).powf(1.0 / D as f64);
        }
        // A side shorter than one bin leaves its share to nobody: clamp each axis by the limit too.
        let mut counts: [usize; D] = std::array::from_fn(|i| (ideal[i].min(limit).floor() as usize).max(1));
        // Axes that are clamped do not take up their share: of a few particles far from all others the axes would
        // have as many bins as there are particles, each.
        while counts.iter().map(|&c| c as f64).product::<f64>() > WIDEST * limit {
            let widest = (0..D).max_by_key(|&i| counts[i]).unwrap_or(0);
            counts[widest] /= 2;
        }
        let inverse_width = Point::<D>::from_fn(|i, _| counts[i] as f64 / (max[i] - min[i]));
        let mut grid = BinGrid { min, inverse_width, counts, offsets: Vec::new(), entries: Vec::new() };
        let total: usize = counts.iter().product();
        let mut offsets = vec![0u32; total + 1];
        for particle in 0..count {
            grid.for_each_bin(particles, particle, |bin| offsets[bin + 1] += 1);
        }
        for bin in 0..total {
            offsets[bin + 1] += offsets[bin];
        }
        let mut cursor = offsets.clone();
        let mut entries = vec![0u32; offsets[total] as usize];
        for particle in 0..count {
            grid.for_each_bin(particles, particle, |bin| {
                entries[cursor[bin] as usize] = particle as u32;
                cursor[bin] += 1;
            });
        }
        grid.offsets = offsets;
        grid.entries = entries;
        grid
    }

    fn bin_of(&self, value: f64, axis: usize) -> usize {
        let scaled = (value - self.min[axis]) * self.inverse_width[axis];
        (scaled.max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn for_each_bin(&self, particles: &Particles<D>, particle: usize, mut visit: impl FnMut(usize)) {
        let x = particles.positions()[particle];
        let half = particles.supports()[particle].half_widths();
        let low: [usize; D] = std::array::from_fn(|i| self.bin_of(x[i] - half[i], i));
        let high: [usize; D] = std::array::from_fn(|i| self.bin_of(x[i] + half[i], i));
        let mut index = low;
        loop {
            let bin = (0..D).rev().fold(0, |bin, i| bin * self.counts[i] + index[i]);
            visit(bin);
            let mut axis = 0;
            while axis < D {
                index[axis] += 1;
                if index[axis] <= high[axis] {
                    break;
                }
                index[axis] = low[axis];
                axis += 1;
            }
            if axis == D {
                return;
            }
        }
    }

    /// Particles whose support may hold `at`, by rising index; nothing outside all supports.
    pub(crate) fn candidates(&self, at: &Point<D>) -> &[u32] {
        let mut bin = 0;
        for axis in (0..D).rev() {
            bin = bin * self.counts[axis] + self.bin_of(at[axis], axis);
        }
        &self.entries[self.offsets[bin] as usize..self.offsets[bin + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::Support;

    #[test]
    fn candidates_hold_every_covering_particle() {
        let mut random = fastrand::Rng::with_seed(3);
        let positions: Vec<Point<2>> = (0..200).map(|_| Point::<2>::new(random.f64() * 9.0, random.f64())).collect();
        let supports = (0..200).map(|_| Support::Ball(0.1 + random.f64())).collect();
        let particles = Particles::new(positions, supports).unwrap();
        let grid = BinGrid::new(&particles);
        for _ in 0..500 {
            let x = Point::<2>::new(random.f64() * 12.0 - 1.5, random.f64() * 3.0 - 1.0);
            let found = grid.candidates(&x);
            for (i, (p, s)) in particles.positions().iter().zip(particles.supports()).enumerate() {
                if (p - x).norm() < s.half_widths()[0] {
                    assert!(found.contains(&(i as u32)));
                }
            }
            assert!(found.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn a_far_particle_does_not_blow_up_the_grid() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut positions: Vec<Point<3>> = (0..2000).map(|_| Point::<3>::from_fn(|_, _| random.f64())).collect();
        positions.push(Point::<3>::new(1e9, 1e9, 0.5));
        let particles = Particles::new(positions, vec![Support::Ball(0.2); 2001]).unwrap();
        let grid = BinGrid::new(&particles);
        assert!(grid.offsets.len() < 100 * 2001 && grid.entries.len() < 100 * 2001);
        assert_eq!(grid.candidates(&Point::<3>::new(1e9, 1e9, 0.5)), [2000]);
        assert!(grid.candidates(&Point::<3>::repeat(0.5)).len() >= 2000);
    }
}
