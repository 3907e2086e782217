//! Gauss–Legendre rules and sets of weighted points.

use std::f64::consts::PI;

use crate::each::{Each, share_of};
use crate::error::{GeometryError, Invalid};
use crate::geometry::{Point, mean};

/// Abscissae and weights of the `n`-point Gauss–Legendre rule on $[0, 1]$, exact to degree $2n-1$.
///
/// # Errors
/// For no point, and for more than 64 per direction, where another rule should be taken.
///
/// ```
/// let (x, w) = rkpm::quadrature::gauss_legendre(3)?;
/// let fifth: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(5)).sum();
/// assert!((fifth - 1.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn gauss_legendre(n: usize) -> Result<(Vec<f64>, Vec<f64>), GeometryError> {
    if n == 0 || n > 64 {
        return Err(GeometryError::Count {
            what: "integration points per direction",
            count: n,
            needed: "1 to 64 are possible",
        });
    }
    let mut abscissae = vec![0.0; n];
    let mut weights = vec![0.0; n];
    for i in 0..n.div_ceil(2) {
        // Newton from Tricomi's first guess converges in a few steps for any n.
        let mut z = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..n {
                let next = ((2 * k + 1) as f64 * z * p - k as f64 * before) / (k + 1) as f64;
                before = p;
                p = next;
            }
            slope = n as f64 * (z * p - before) / (z * z - 1.0);
            let step = p / slope;
            z -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        if 2 * i + 1 == n {
            z = 0.0;
        }
        let weight = 1.0 / ((1.0 - z * z) * slope * slope);
        abscissae[i] = 0.5 - 0.5 * z;
        abscissae[n - 1 - i] = 0.5 + 0.5 * z;
        weights[i] = weight;
        weights[n - 1 - i] = weight;
    }
    Ok((abscissae, weights))
}

/// Abscissae and weights on $[0, 1]$.
pub(crate) type LineRule = (Vec<f64>, Vec<f64>);

/// A rule on each of several equal pieces of $[0, 1]$.
pub(crate) fn in_pieces((abscissae, weights): &LineRule, pieces: usize) -> LineRule {
    let count = pieces as f64;
    let each = |piece: usize| abscissae.iter().map(move |x| (piece as f64 + x) / count);
    ((0..pieces).flat_map(each).collect(), (0..pieces).flat_map(|_| weights.iter().map(|w| w / count)).collect())
}

/// Points beyond which a set is refused: 2.4 GB of positions in three dimensions, so that a mistyped number is an
/// error and not a crash.
const POINT_LIMIT: usize = 100_000_000;

/// Refuses sets of `cells` times `per_cell` points that no memory would hold.
pub(crate) fn check_point_count(cells: usize, per_cell: usize) -> Result<(), GeometryError> {
    let count = cells.saturating_mul(per_cell);
    if count > POINT_LIMIT {
        return Err(GeometryError::Count { what: "integration points", count, needed: "at most 1e8 are accepted" });
    }
    Ok(())
}

/// Refuses no sub-cells.
pub(crate) fn check_parts(parts: usize) -> Result<(), GeometryError> {
    refuse_parts(parts, parts == 0, "at least 1 is needed")
}

/// Refuses sub-cells that are neither cells nor their halves.
pub(crate) fn check_halves(parts: usize, needed: &'static str) -> Result<(), GeometryError> {
    check_parts(parts)?;
    refuse_parts(parts, parts > 2, needed)
}

fn refuse_parts(count: usize, refused: bool, needed: &'static str) -> Result<(), GeometryError> {
    ensure!(!refused, GeometryError::Count { what: "sub-cells per direction", count, needed });
    Ok(())
}

/// Weighted points in a body or on its boundary, grouped by cell or zone.
///
/// Weights are coordinate measures (length, area, volume); the kinematics adds its own factor when a
/// table is built.
#[derive(Debug, Clone, PartialEq)]
pub struct Points<const D: usize> {
    /// Positions $X_p$ \[length\].
    pub positions: Vec<Point<D>>,
    /// Weights $w_p$ \[length^d\].
    pub weights: Vec<f64>,
    /// Outward unit normals $N_p$ on a boundary, empty inside a body.
    pub normals: Vec<Point<D>>,
    /// Offsets of the groups: group $g$ holds the points `groups[g]..groups[g + 1]`. A group plays the part of a
    /// finite element, its points see 65 536 nodes between them at most.
    pub groups: Vec<usize>,
}

impl<const D: usize> Default for Points<D> {
    fn default() -> Self {
        Points::empty()
    }
}

impl<const D: usize> Points<D> {
    /// A set without points.
    pub fn empty() -> Self {
        Points { positions: Vec::new(), weights: Vec::new(), normals: Vec::new(), groups: vec![0] }
    }

    /// One point of weight 1: the carrier of a point load.
    pub(crate) fn single(at: Point<D>) -> Self {
        Points { positions: vec![at], weights: vec![1.0], normals: Vec::new(), groups: vec![0, 1] }
    }

    /// The points where a predicate of their position holds, group by group; groups that hold none are left out.
    pub(crate) fn retained(self, holds: impl Fn(&Point<D>) -> bool) -> Self {
        self.chosen(&|k: usize, points: &Points<D>| holds(&points.positions[k])).0
    }

    /// The points of a choice, and their numbers.
    pub(crate) fn chosen(self, choice: &dyn Fn(usize, &Points<D>) -> bool) -> (Self, Vec<usize>) {
        let (mut kept, mut numbers) = (Points::empty(), Vec::new());
        for group in self.groups.windows(2) {
            let before = numbers.len();
            numbers.extend((group[0]..group[1]).filter(|&k| choice(k, &self)));
            if numbers.len() > before {
                kept.groups.push(numbers.len());
            }
        }
        if numbers.len() == self.positions.len() {
            return (self, numbers);
        }
        kept.positions = numbers.mapped(|&k| self.positions[k]);
        kept.weights = numbers.mapped(|&k| self.weights[k]);
        if !self.normals.is_empty() {
            kept.normals = numbers.mapped(|&k| self.normals[k]);
        }
        (kept, numbers)
    }

    /// The middle of the points of a group.
    pub(crate) fn middle(&self, group: usize) -> Point<D> {
        mean(&self.positions[self.groups[group]..self.groups[group + 1]])
    }

    /// The points of the groups whose number and middle a predicate holds for, and their numbers.
    pub(crate) fn in_groups(self, holds: &dyn Fn(usize, &Point<D>) -> bool) -> (Self, Vec<usize>) {
        let mut kept = vec![false; self.positions.len()];
        for group in 0..self.groups.len().saturating_sub(1) {
            kept[self.groups[group]..self.groups[group + 1]].fill(holds(group, &self.middle(group)));
        }
        self.chosen(&|k, _| kept[k])
    }

    /// Adds a point.
    pub(crate) fn push(&mut self, at: Point<D>, weight: f64) {
        self.positions.push(at);
        self.weights.push(weight);
    }

    /// Closes the current group.
    pub(crate) fn close_group(&mut self) {
        self.groups.push(self.positions.len());
    }

    /// Share `part` of `parts`: a run of the groups, the shares as long as each other but for one. Nothing for a share that does
    /// not exist, and of points beyond the arrays of a set that [`validate`](Points::validate) refuses.
    pub(crate) fn share(&self, part: usize, parts: usize) -> Self {
        let groups = self.share_groups(part, parts);
        let points = self.share_range(part, parts);
        let offset = |group: &usize| (*group).clamp(points.start, points.end) - points.start;
        let mut groups: Vec<usize> = self.groups.get(groups.start..=groups.end).unwrap_or_default().mapped(offset);
        if groups.is_empty() {
            groups.push(0);
        }
        Points {
            positions: shared(&self.positions, &points),
            weights: shared(&self.weights, &points),
            normals: shared(&self.normals, &points),
            groups,
        }
    }

    fn share_groups(&self, part: usize, parts: usize) -> std::ops::Range<usize> {
        share_of(self.groups.len().saturating_sub(1), part, parts)
    }

    /// The points of a share.
    pub(crate) fn share_range(&self, part: usize, parts: usize) -> std::ops::Range<usize> {
        let groups = self.share_groups(part, parts);
        let offset = |group: usize| self.groups.get(group).map_or(0, |&first| first.min(self.positions.len()));
        offset(groups.start)..offset(groups.end).max(offset(groups.start))
    }

    /// Appends the groups of another set of the same kind.
    pub(crate) fn append(&mut self, other: Points<D>) {
        let shift = self.positions.len();
        if self.groups.is_empty() {
            // A default set, which has not even the start of a first group.
            self.groups.push(0);
        }
        self.positions.extend(other.positions);
        self.weights.extend(other.weights);
        self.normals.extend(other.normals);
        self.groups.extend(other.groups.iter().skip(1).map(|g| g.saturating_add(shift)));
    }

    /// Refuses sets whose arrays do not fit together, that hold numbers that are not finite or normals that are not of
    /// length 1, or whose weights do not add up to more than nothing; single weights may be negative.
    ///
    /// # Errors
    /// [`GeometryError::Count`] and [`Invalid`] in these cases.
    pub(crate) fn validate(&self) -> Result<(), GeometryError> {
        let n = self.positions.len();
        let lengths_fit = self.weights.len() == n && (self.normals.is_empty() || self.normals.len() == n);
        let groups_fit = self.groups.first() == Some(&0)
            && self.groups.last() == Some(&n)
            && self.groups.windows(2).all(|w| w[0] <= w[1]);
        ensure!(
            lengths_fit && groups_fit,
            GeometryError::Count {
                what: "entries of a point set",
                count: self.weights.len(),
                needed: "positions, weights and normals have one entry per point, groups rise from 0 to their number",
            }
        );
        if let Some(&value) = self.weights.iter().find(|w| !w.is_finite()) {
            return Err(Invalid::new("integration weight", value, "give finite weights").into());
        }
        if let Some(&value) = self.normals.iter().flat_map(|normal| normal.iter()).find(|n| !n.is_finite()) {
            return Err(Invalid::new("component of a normal", value, "give finite normals").into());
        }
        // A little more than rounding: normals may come from tables of few digits.
        if let Some(normal) = self.normals.iter().find(|normal| (normal.norm_squared() - 1.0).abs() > 1e-6) {
            let needed = "normals point outward with length 1, areas belong into the weights";
            return Err(Invalid::new("length of a normal", normal.norm(), needed).into());
        }
        let total: f64 = self.weights.iter().sum();
        ensure!(
            total > 0.0 || n == 0,
            Invalid::new(
                "sum of the integration weights",
                total,
                "weights measure a body or its boundary: give ones that add up to more than nothing"
            )
        );
        Ok(())
    }
}

/// The entries of an array that a share has; none of an array that is shorter.
pub(crate) fn shared<T: Clone>(entries: &[T], share: &std::ops::Range<usize>) -> Vec<T> {
    entries.get(share.clone()).unwrap_or_default().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;

    #[test]
    fn rules_are_exact_to_their_degree() {
        for n in 1..=20 {
            let (x, w) = gauss_legendre(n).unwrap();
            for degree in 0..2 * n {
                let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!(abs_diff_eq!(sum, 1.0 / (degree + 1) as f64, epsilon = 1e-14), "{n} {degree}");
            }
        }
        assert!(gauss_legendre(0).is_err());
    }

    #[test]
    fn shares_of_points_hold_each_group_once() {
        let mut all = Points::<1>::empty();
        for point in 0..10 {
            all.positions.push(Point::<1>::new(f64::from(point)));
            all.weights.push(1.0 + f64::from(point));
            if point % 3 != 1 {
                all.close_group();
            }
        }
        for parts in [1, 2, 3, 4, 9, 20] {
            let mut together = Points::empty();
            (0..parts).for_each(|part| together.append(all.share(part, parts)));
            assert_eq!((&together.weights, &together.groups), (&all.weights, &all.groups), "{parts} parts");
        }
    }

    #[test]
    fn shares_that_do_not_exist_are_empty() {
        let nothing = Points::<2>::default();
        assert_eq!(nothing.share(0, 1), nothing);
        assert!(nothing.validate().is_ok());
        let bare = Points::<2> { groups: Vec::new(), ..Points::empty() };
        assert!(bare.share(0, 1).positions.is_empty() && bare.share(3, 2).positions.is_empty());
        let mut points = Points::<2>::empty();
        for k in 0..6 {
            points.push(Point::<2>::new(f64::from(k), 1.0), 0.5);
            points.close_group();
        }
        for (part, parts) in [(2, 2), (usize::MAX, 3), (usize::MAX, usize::MAX)] {
            assert!(points.share(part, parts).positions.is_empty(), "{part} of {parts}");
        }
        // Sets that `validate` refuses have what there is of a share.
        points.weights.truncate(3);
        points.groups.push(usize::MAX);
        assert!(points.validate().is_err());
        let _ = (points.share(0, 1), points.share(1, 2));
    }
}
