//! Sums over vectors.

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

pub(crate) fn root_mean_square(v: &[f64]) -> f64 {
    (dot(v, v) / v.len() as f64).sqrt()
}
