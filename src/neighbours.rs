//! Spatial search: a grid of bins for particles that cover a point, a tree of boxes for all else.

mod adjacent;
mod box_tree;
mod flood;
mod sights;
mod visibility;

pub(crate) use adjacent::Adjacent;
pub(crate) use box_tree::BoxTree;
pub(crate) use flood::Flood;
pub(crate) use sights::Sights;
pub use visibility::Connections;
pub(crate) use visibility::{FACING, MARGIN, Visibility};

use crate::each::{array_of, point_of};
use crate::geometry::{Bounds, Point};
use crate::particles::Particles;
use crate::rows::Rows;

/// A grid of bins that lists, for each bin, the particles whose support touches it.
///
/// A query reads one bin, and one of the finer grid inside where particles lie closer than elsewhere; candidates come in
/// rising order of particle.
#[derive(Debug, Clone)]
pub(crate) struct BinGrid<const D: usize> {
    min: Point<D>,
    inverse_width: Point<D>,
    counts: [usize; D],
    /// Particles by bin.
    lists: Rows,
    /// Finer grids of crowded bins, by rising bin.
    finer: Vec<(u32, BinGrid<D>)>,
}

/// Bins per particle at which refining the grid no longer shortens the candidate lists enough.
const BINS_PER_PARTICLE: f64 = 4.0;
/// As many times more bins are accepted where some axes are shorter than a bin.
const WIDEST: f64 = 4.0;
/// Particles of a bin that may be looked at one by one however close they are.
const CROWD: usize = 64;
/// A crowded bin gets a finer grid where that has at least this many bins.
const FINER: usize = 8;

impl<const D: usize> BinGrid<D> {
    pub(crate) fn new(particles: &Particles<D>) -> Self {
        let all: Vec<u32> = (0..particles.positions().len() as u32).collect();
        let everywhere = Bounds { low: Point::repeat(f64::NEG_INFINITY), high: Point::repeat(f64::INFINITY) };
        let mut grid = BinGrid::over(particles, &all, everywhere);
        grid.fill(particles, &all);
        grid.refine(particles);
        grid
    }

    /// The bins, still empty, over what some particles cover of a box.
    fn over(particles: &Particles<D>, some: &[u32], room: Bounds<D>) -> Self {
        let mut covered = Bounds::none();
        let mut mean = Point::<D>::zeros();
        for &particle in some {
            let (x, half) = (particles.positions()[particle as usize], half_widths(particles, particle));
            covered = covered.join(&Bounds::of([&x]).widened(&half));
            mean += half / some.len() as f64;
        }
        let Bounds { low: min, high: max } = covered.common(&room);
        // Bins half a support wide keep the lists short at a bounded number of entries per particle.
        let mut ideal = point_of::<D>(|i| (2.0 * (max[i] - min[i]) / mean[i]).max(1.0));
        let bins: f64 = ideal.iter().product();
        let limit = BINS_PER_PARTICLE * some.len() as f64 + 64.0;
        if bins > limit {
            ideal *= (limit / bins).powf(1.0 / D as f64);
        }
        // A side shorter than one bin leaves its share to nobody: clamp each axis by the limit too.
        let mut counts: [usize; D] = array_of(|i| (ideal[i].min(limit).floor() as usize).max(1));
        // Axes that are clamped do not take up their share: of a few particles far from all others the axes would
        // have as many bins as there are particles, each.
        while counts.iter().map(|&c| c as f64).product::<f64>() > WIDEST * limit {
            let widest = (0..D).max_by_key(|&i| counts[i]).unwrap_or(0);
            counts[widest] /= 2;
        }
        let inverse_width = point_of::<D>(|i| counts[i] as f64 / (max[i] - min[i]));
        BinGrid { min, inverse_width, counts, lists: Rows::default(), finer: Vec::new() }
    }

    /// Lists particles in the bins that their supports touch.
    fn fill(&mut self, particles: &Particles<D>, some: &[u32]) {
        let bins = self.counts.iter().product();
        let lists = Rows::new(bins, &|add| {
            for &particle in some {
                let (x, half) = (particles.positions()[particle as usize], half_widths(particles, particle));
                self.bins_in(&(x - half), &(x + half)).for_each(|bin| add(bin, particle));
            }
        });
        self.lists = lists;
    }

    /// Gives bins that are crowded by small supports grids of their own: beside wide supports, or far from others, the mean
    /// width says nothing of theirs.
    fn refine(&mut self, particles: &Particles<D>) {
        for bin in 0..self.lists.count() {
            let list = self.lists.row(bin);
            if list.len() <= CROWD {
                continue;
            }
            let mut rest = bin;
            let place: [usize; D] = array_of(|i| {
                let place = rest % self.counts[i];
                rest /= self.counts[i];
                place
            });
            let corner =
                |more: usize| point_of::<D>(|i| self.min[i] + (place[i] + more) as f64 / self.inverse_width[i]);
            let mut grid = BinGrid::over(particles, list, Bounds { low: corner(0), high: corner(1) });
            if grid.counts.iter().product::<usize>() < FINER {
                continue;
            }
            grid.fill(particles, list);
            // One that leaves a bin as crowded as this one would be followed by others without end.
            let longest = (0..grid.lists.count()).map(|bin| grid.lists.row(bin).len()).max().unwrap_or(0);
            if longest < list.len() {
                grid.refine(particles);
                self.finer.push((bin as u32, grid));
            }
        }
    }

    fn bin_of(&self, value: f64, axis: usize) -> usize {
        let scaled = (value - self.min[axis]) * self.inverse_width[axis];
        (scaled.max(0.0) as usize).min(self.counts[axis] - 1)
    }

    /// The bins that a box touches, axis 0 running fastest.
    fn bins_in(&self, low: &Point<D>, high: &Point<D>) -> impl Iterator<Item = usize> {
        let first: [usize; D] = array_of(|i| self.bin_of(low[i], i));
        let last: [usize; D] = array_of(|i| self.bin_of(high[i], i));
        let next = move |index: &[usize; D]| {
            let axis = (0..D).find(|&axis| index[axis] < last[axis])?;
            let mut next = *index;
            next[axis] += 1;
            next[..axis].copy_from_slice(&first[..axis]);
            Some(next)
        };
        let counts = self.counts;
        let number = move |index: [usize; D]| (0..D).rev().fold(0, |bin, i| bin * counts[i] + index[i]);
        std::iter::successors(Some(first), next).map(number)
    }

    /// Writes the particles whose supports may reach into a box and for which `reaches` holds, by rising index; false where there are
    /// finer grids, which are not searched.
    pub(crate) fn within(
        &self,
        low: &Point<D>,
        high: &Point<D>,
        reaches: impl Fn(u32) -> bool,
        found: &mut Vec<u32>,
    ) -> bool {
        found.clear();
        if !self.finer.is_empty() {
            return false;
        }
        let mut bins = 0;
        for bin in self.bins_in(low, high) {
            let list = self.lists.row(bin);
            let (start, mut end) = (found.len(), found.len());
            found.resize(start + list.len(), 0);
            // No branch that the machine has to guess.
            for &particle in list {
                found[end] = particle;
                end += usize::from(reaches(particle));
            }
            found.truncate(end);
            bins += usize::from(end > start);
        }
        if bins > 1 {
            found.sort_unstable();
            found.dedup();
        }
        true
    }

    /// Particles whose support may hold `at`, by rising index; nothing outside all supports.
    pub(crate) fn candidates(&self, at: &Point<D>) -> &[u32] {
        let mut bin = 0;
        for axis in (0..D).rev() {
            bin = bin * self.counts[axis] + self.bin_of(at[axis], axis);
        }
        match self.finer.binary_search_by_key(&(bin as u32), |finer| finer.0) {
            Ok(place) => self.finer[place].1.candidates(at),
            Err(_) => self.lists.row(bin),
        }
    }
}

fn half_widths<const D: usize>(particles: &Particles<D>, particle: u32) -> Point<D> {
    particles.supports()[particle as usize].half_widths()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec2, Vec3};
    use crate::particles::Support;

    /// The longest list of candidates at some points, each of which holds every particle that covers the point.
    fn longest<const D: usize>(particles: &Particles<D>, grid: &BinGrid<D>, at: &[Point<D>]) -> usize {
        let lists = at.iter().map(|x| {
            let found = grid.candidates(x);
            for (i, (p, s)) in particles.positions().iter().zip(particles.supports()).enumerate() {
                if (p - x).norm() < s.half_widths()[0] {
                    assert!(found.contains(&(i as u32)));
                }
            }
            assert!(found.windows(2).all(|w| w[0] < w[1]));
            found.len()
        });
        lists.max().unwrap()
    }

    #[test]
    fn candidates_hold_every_covering_particle() {
        let mut random = fastrand::Rng::with_seed(3);
        let positions: Vec<Vec2> = (0..200).map(|_| Vec2::new(random.f64() * 9.0, random.f64())).collect();
        let supports = (0..200).map(|_| Support::Ball(0.1 + random.f64())).collect();
        let particles = Particles::new(positions, supports).unwrap();
        let at: Vec<Vec2> = (0..500).map(|_| Vec2::new(random.f64() * 12.0 - 1.5, random.f64() * 3.0 - 1.0)).collect();
        longest(&particles, &BinGrid::new(&particles), &at);
    }

    #[test]
    fn lists_stay_short_where_particles_crowd() {
        let mut random = fastrand::Rng::with_seed(5);
        // Spacings in proportion to the distance from the origin, over four decades.
        let mut point = || {
            let (radius, angle) = (10f64.powf(-4.0 * random.f64()), 6.3 * random.f64());
            Vec2::new(radius * angle.cos(), radius * angle.sin())
        };
        let positions: Vec<Vec2> = (0..4000).map(|_| point()).collect();
        let supports = positions.iter().map(|x| Support::Ball(0.15 * x.norm())).collect();
        let particles = Particles::new(positions, supports).unwrap();
        let grid = BinGrid::new(&particles);
        let at: Vec<Vec2> = (0..500).map(|_| point()).collect();
        let most = longest(&particles, &grid, &at);
        // About 20 particles cover each point.
        assert!(most < 130, "{most}");
        // Bins can't separate particles that all cover each other; the grid stops to refine them.
        let close = (0..500).map(|_| point() * 1e-3).collect();
        let particles = Particles::new(close, vec![Support::Ball(2.0); 500]).unwrap();
        assert_eq!(longest(&particles, &BinGrid::new(&particles), &at), 500);
    }

    #[test]
    fn a_far_particle_does_not_blow_up_the_grid() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut positions: Vec<Vec3> = (0..2000).map(|_| Vec3::from_fn(|_, _| random.f64())).collect();
        let at = positions.clone();
        positions.push(Vec3::new(1e9, 1e9, 0.5));
        let particles = Particles::new(positions, vec![Support::Ball(0.2); 2001]).unwrap();
        let grid = BinGrid::new(&particles);
        let size = |grid: &BinGrid<3>| grid.lists.starts.len() + grid.lists.entries.len();
        assert!(size(&grid) + grid.finer.iter().map(|finer| size(&finer.1)).sum::<usize>() < 200 * 2001);
        assert_eq!(grid.candidates(&Vec3::new(1e9, 1e9, 0.5)), [2000]);
        // A bin and its particles' supports are 0.5 wide: an eighth of all.
        let most = longest(&particles, &grid, &at[..200]);
        assert!(most < 500, "{most}");
    }
}
