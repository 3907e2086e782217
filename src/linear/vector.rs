//! Sums over vectors.
use crate::each::Each;
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.pair_sum(b, |a, b| a * b)
}

pub(crate) fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

pub(crate) fn root_mean_square(v: &[f64]) -> f64 {
    (dot(v, v) / v.len() as f64).sqrt()
}
