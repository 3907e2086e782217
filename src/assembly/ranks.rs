//! Ranks that share the clusters of a model.

use std::fmt;

/// Processes that sum one model together: each holds a share of its clusters and the whole of all vectors over its nodes.
///
/// What a rank finds for its clusters is summed, or the largest of it taken, over all ranks, and all of them go on with the
/// same bits; so they take the same decisions without further communication. Condensed unknowns stay with the rank that holds
/// their cluster; those of contact and of terms of one's own are replicated.
///
/// ```
/// use rkpm::assembly::Ranks;
/// /// The only rank.
/// #[derive(Debug)]
/// struct Alone;
/// impl Ranks for Alone {
///     fn rank(&self) -> usize { 0 }
///     fn count(&self) -> usize { 1 }
///     fn sum(&self, _: &mut [f64]) {}
///     fn largest(&self, _: &mut [f64]) {}
/// }
/// assert_eq!(Alone.least(2.0), 2.0);
/// assert_eq!(Alone.gathered(&[1.0, 2.0]), [1.0, 2.0]);
/// ```
pub trait Ranks: fmt::Debug + Send + Sync {
    /// This rank, counted from 0.
    fn rank(&self) -> usize;

    /// How many ranks there are.
    fn count(&self) -> usize;

    /// Replaces each value by its sum over the ranks, the same bits on all of them.
    fn sum(&self, values: &mut [f64]);

    /// Replaces each value by the largest of all ranks; values are never NaN.
    fn largest(&self, values: &mut [f64]);

    /// The least value of all ranks.
    fn least(&self, value: f64) -> f64 {
        let mut negative = [-value];
        self.largest(&mut negative);
        -negative[0]
    }

    /// The values of all ranks, those of the first one first, on all of them: for a table that one rank writes.
    fn gathered(&self, mine: &[f64]) -> Vec<f64> {
        let mut counts = vec![0.0; self.count()];
        counts[self.rank()] = mine.len() as f64;
        self.sum(&mut counts);
        let before: f64 = counts[..self.rank()].iter().sum();
        let mut all = vec![0.0; counts.iter().sum::<f64>() as usize];
        all[before as usize..][..mine.len()].copy_from_slice(mine);
        self.sum(&mut all);
        all
    }
}
