//! Where a lattice is refined: a tree of macro cells that are halved, by one halving more than what they touch at most.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use crate::each::{EachOf, array_of, point_of};
use crate::error::{GeometryError, Invalid};
use crate::geometry::{Bounds, Vec3, mean, places};
use crate::solid::{Solid3, Wall};

use super::frame::Frame;
use super::grid::MACRO;

/// Halvings of a spacing at most, as on refined lattices of the plane.
const DEEPEST: u32 = 4;
/// Part of a spacing by which a wanted one may be below it: rounding.
const SLACK: f64 = 1e-9;

/// What asks for smaller spacings in a solid.
pub(super) struct Wanted<'a> {
    pub(super) solid: &'a Solid3,
    /// The largest spacing.
    pub(super) spacing: f64,
    /// Walls with fewer spacings across are refined.
    pub(super) fewest: f64,
    /// Spacings that they have then at least.
    pub(super) across: f64,
    /// The spacing wanted over the largest one.
    pub(super) grading: &'a dyn Fn(&Vec3) -> f64,
    /// Walls thinner than this part of the largest spacing are left.
    pub(super) thinnest: f64,
    /// Whether of small facets one in each half of a spacing is looked at, instead of all.
    pub(super) sampled: bool,
    /// The walls that are thinner than wanted, once they are looked for.
    pub(super) found: OnceCell<Vec<Wall>>,
}

/// A macro cell: how often it is halved, and its place in units of its width.
pub(super) type Macro = (u32, [i32; 3]);

/// A wall in coordinates of the lattice: a box around it, and its thickness over the number of spacings across it, in
/// units of the largest spacing.
struct Across {
    around: Bounds<3>,
    wanted: f64,
}

/// Macro cells that are not halved further, with the walls in them.
struct Tree {
    walls: Vec<Across>,
    leaves: BTreeMap<Macro, Vec<u32>>,
    /// Those that have not been looked at.
    open: Vec<Macro>,
}

/// The corners of a macro cell in bricks of the coarsest level.
fn corners((level, place): Macro) -> Bounds<3> {
    let width = MACRO as f64 / f64::from(1 << level);
    let [low, high] = [0, 1].each(|end| Vec3::from(place.each(|at| f64::from(at + end) * width)));
    Bounds { low, high }
}

/// The middle of a wall.
fn middle(wall: &Wall) -> Vec<f64> {
    (mean(&wall.corners) + wall.through * 0.5).as_slice().to_vec()
}

impl Wanted<'_> {
    /// How many leaves are about in the solid: those whose middle is not outside by more than half of their width.
    pub(super) fn inside(&self, leaves: &[Macro], frame: &Frame) -> usize {
        let is_inside = |own: &&Macro| {
            let own = corners(**own);
            let (centre, reach) = (frame.place(&own.middle()), 0.5 * own.extent()[0] * frame.size);
            self.solid.contains(&centre) || self.solid.closest(&centre).distance < reach
        };
        leaves.iter().filter(is_inside).count()
    }

    /// The leaves of the tree over a lattice of the largest spacing, and how often the deepest ones are halved.
    pub(super) fn macros(&self, frame: &Frame, counts: [usize; 3]) -> Result<(Vec<Macro>, u32), GeometryError> {
        let mut tree = Tree { walls: self.walls(frame), leaves: BTreeMap::new(), open: Vec::new() };
        let last = counts.each(|count| count.div_ceil(MACRO) as i32 - 1);
        tree.open.extend(places([0; 3], last).map(|place| (0, place)));
        let all: Vec<u32> = (0..tree.walls.len() as u32).collect();
        let roots: BTreeMap<Macro, Vec<u32>> = tree.open.iter().map(|root| (*root, Vec::new())).collect();
        tree.leaves = roots;
        tree.spread(&all);
        while let Some(next) = tree.open.pop() {
            if tree.leaves.contains_key(&next) && self.is_halved(&tree, next, frame)? {
                tree.halve(next);
            }
        }
        let deepest = tree.leaves.keys().map(|leaf| leaf.0).max().unwrap_or(0);
        Ok((tree.leaves.into_keys().collect(), deepest))
    }

    fn walls(&self, frame: &Frame) -> Vec<Across> {
        let across = self.across;
        let local = |Wall { corners, through, .. }: &Wall| {
            let sides: Vec<Vec3> = corners.iter().flat_map(|x| [*x, x + through].each(|x| frame.local(&x))).collect();
            Across { around: Bounds::of(&sides), wanted: through.norm() / across / self.spacing }
        };
        let least = self.thinnest * self.spacing * (1.0 - SLACK);
        self.found().iter().filter(|wall| wall.through.norm() >= least).map(local).collect()
    }

    /// Whether there are walls that are thinner than wanted.
    pub(super) fn has_walls(&self) -> bool {
        !self.found().is_empty()
    }

    /// What is said of the thinnest wall with parallel sides, or of the thinnest one, where all are left.
    pub(super) fn left(&self) -> Option<GeometryError> {
        let own = |wall: &Wall| self.spacing * (self.grading)(&Vec3::from_column_slice(&middle(wall)));
        let thin = || self.found().iter().filter(|wall| wall.through.norm() < self.fewest * own(wall));
        let thinner = |a: &&Wall, b: &&Wall| a.through.norm().total_cmp(&b.through.norm());
        let wall = thin().filter(|wall| wall.is_even).min_by(thinner).or_else(|| thin().min_by(thinner))?;
        let (thickness, spacing) = (wall.through.norm(), own(wall));
        Some(GeometryError::ThinLeft { thickness, at: middle(wall), spacing, needed: thickness / self.across })
    }

    /// Refuses walls too thin to be refined whose sides are parallel: those that taper off may be followed by the particles of what is
    /// beside them.
    pub(super) fn check_walls(&self) -> Result<(), GeometryError> {
        let least = self.thinnest * self.spacing * (1.0 - SLACK);
        let walls = self.found();
        let thin = walls.iter().filter(|wall| wall.is_even && wall.through.norm() < least);
        if let Some(wall) = thin.min_by(|a, b| a.through.norm().total_cmp(&b.through.norm())) {
            let thickness = wall.through.norm();
            let (across, needed) = (self.across as usize, thickness / self.thinnest);
            return Err(GeometryError::WallAcross {
                thickness,
                at: middle(wall),
                across,
                spacing: self.spacing,
                needed,
            });
        }
        Ok(())
    }

    fn found(&self) -> &[Wall] {
        self.found.get_or_init(|| self.search())
    }

    fn search(&self) -> Vec<Wall> {
        if !(self.fewest > 0.0) {
            return Vec::new();
        }
        // Points a brick apart see a wall from each brick; none are closer than the width of the smallest macro cells.
        let least = self.spacing * 2.0 / f64::from(1 << DEEPEST);
        // No wall is thicker than the solid is long.
        let length = Bounds::of(self.solid.vertices()).extent().norm();
        let wanted = self.fewest * self.spacing * (1.0 - SLACK);
        let walls = self.solid.walls(wanted.min(length), 0.5 * self.spacing, least, self.sampled);
        walls.into_iter().filter(|wall| wall.through.norm() < wanted).collect()
    }

    /// Whether particles between the corners of a macro cell are wanted closer than they are.
    fn is_halved(&self, tree: &Tree, own: Macro, frame: &Frame) -> Result<bool, GeometryError> {
        let around = corners(own);
        let (centre, reach) = (frame.place(&around.middle()), 0.5 * around.extent().norm() * frame.size);
        if self.solid.closest(&centre).distance > reach && !self.solid.contains(&centre) {
            return Ok(false);
        }
        let spacing = 1.0 / f64::from(1 << own.0);
        let is_wide = |wanted: f64| wanted < spacing * (1.0 - SLACK);
        let walls = tree.leaves[&own].iter().map(|wall| &tree.walls[*wall as usize]);
        let thin = walls.filter(|wall| is_wide(wall.wanted)).min_by(|a, b| a.wanted.total_cmp(&b.wanted));
        if let Some(wall) = thin.filter(|_| own.0 == DEEPEST) {
            return Err(self.too_thin(wall, frame));
        }
        let mut wide = thin.is_some();
        for place in places([0; 3], [2; 3]) {
            let at = point_of::<3>(|i| around.low[i] + 0.5 * f64::from(place[i]) * around.extent()[i]);
            let wanted = (self.grading)(&frame.place(&at));
            let least = 1.0 / f64::from(1 << DEEPEST);
            ensure!(
                wanted >= least * (1.0 - SLACK) && wanted.is_finite(),
                Invalid::new(
                    "grading of the spacing in a solid",
                    wanted,
                    "give 1/16 at least, or a smaller spacing: it is halved four times at most"
                )
            );
            wide |= is_wide(wanted);
        }
        Ok(wide && own.0 < DEEPEST)
    }

    fn too_thin(&self, wall: &Across, frame: &Frame) -> GeometryError {
        GeometryError::WallAcross {
            thickness: wall.wanted * self.across * self.spacing,
            at: frame.place(&wall.around.middle()).as_slice().to_vec(),
            across: self.across as usize,
            spacing: self.spacing,
            needed: wall.wanted * self.spacing * f64::from(1 << DEEPEST),
        }
    }
}

impl Tree {
    /// Gives walls to the macro cells of the coarsest level that they meet.
    fn spread(&mut self, all: &[u32]) {
        for &wall in all {
            let Bounds { low, high } = &self.walls[wall as usize].around;
            let [first, last] = [low, high].each(|end| array_of(|i| (end[i] / MACRO as f64).floor() as i32));
            for place in places(first, last) {
                if let Some(own) = self.leaves.get_mut(&(0, place)) {
                    own.push(wall);
                }
            }
        }
    }

    /// Halves a macro cell along each axis, coarser ones that touch it first.
    fn halve(&mut self, own: Macro) {
        let (level, place) = own;
        for beside in places(place.each(|at| at - 1), place.each(|at| at + 1)) {
            if level > 0 && self.leaves.contains_key(&(level - 1, beside.each(|at| at >> 1))) {
                self.halve((level - 1, beside.each(|at| at >> 1)));
            }
        }
        let Some(walls) = self.leaves.remove(&own) else { return };
        for k in 0..8 {
            let child = (level + 1, array_of(|i| 2 * place[i] + ((k >> i) & 1)));
            let own = corners(child);
            let meets = |wall: &u32| self.walls[*wall as usize].around.meets(&own);
            self.leaves.insert(child, walls.iter().copied().filter(meets).collect());
            self.open.push(child);
        }
    }
}
