//! Generalised minimal residuals (GMRES) of Saad and Schultz.

use crate::each::Each;
use crate::error::LinearError;
use crate::parallel::{for_each_mut, map_with};

/// What a minimisation of residuals left.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Minimised {
    /// Krylov iterations that were made.
    pub iterations: usize,
    /// The residual, relative to the right-hand side.
    pub residual: f64,
}

/// Iterations in which the residual has to fall by a third, where rounding may leave it as it is.
const STALLED: usize = 8;

/// The residual [`STALLED`] iterations before the last one: each rotation multiplies it by its sine.
fn left_before(left: &[f64], rotations: &[[f64; 2]], end: usize) -> f64 {
    rotations[end + 1 - STALLED..]
        .iter()
        .fold(left[end + 1].abs(), |r, [_, sine]| r / sine.abs().max(f64::MIN_POSITIVE))
}

/// Numbers of vectors that one thread at a time works on.
const PIECE: usize = 1 << 15;

/// The sum over pieces of vectors, the same for any number of threads.
fn dot<A: Copy + Into<f64> + Sync>(a: &[A], b: &[f64]) -> f64 {
    if a.len() <= PIECE {
        return dot_of_piece(a, b);
    }
    let piece = |k: usize| k * PIECE..((k + 1) * PIECE).min(a.len());
    map_with(a.len().div_ceil(PIECE), 2, || (), |(), k| dot_of_piece(&a[piece(k)], &b[piece(k)])).into_iter().sum()
}

/// $y \mathrel{+}= f x$.
fn add_multiple(factor: f64, x: &[f32], y: &mut [f64]) {
    let mut pieces: Vec<_> = y.chunks_mut(PIECE).zip(x.chunks(PIECE)).collect();
    for_each_mut(&mut pieces, |_, (y, x)| y.iter_mut().zip(&**x).for_each(|(y, x)| *y += factor * f64::from(*x)));
}

fn dot_of_piece<A: Copy + Into<f64>>(a: &[A], b: &[f64]) -> f64 {
    // Eight sums fill the registers, in an order that depends on nothing.
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a8.iter().zip(b8) {
        for l in 0..8 {
            sums[l] += a[l].into() * b[l];
        }
    }
    sums.iter().sum::<f64>() + a_rest.pair_sum(b_rest, |a, b| (*a).into() * b)
}

/// A vector times a number, in single precision.
fn kept(factor: f64, x: &[f64]) -> Vec<f32> {
    x.mapped(|x| (factor * x) as f32)
}

/// A vector of single precision, in double precision.
fn widened(x: &[f32], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y = f64::from(*x));
}

/// Tolerance below which rotations do not tell the residual: basis vectors are kept in single precision, and orthogonal to that.
const KNOWN: f64 = 1e-5;

/// Solves $A P^{-1} y = b$, $x = P^{-1} y$, from zero: flexible GMRES, restarted after `restart` iterations, of which there are at most
/// `most`. `apply` and `precondition` write their answers into the second vector, `total` adds up dot products over the ranks that
/// hold parts of the vectors. Basis vectors and preconditioned ones are kept in single precision and applied as they are kept, so that
/// the sum of the latter is as exact as the residual of a restart. A restart that leaves more than half of the residual before it is the
/// last. Once no more than `enough` is left the iteration ends as soon as it hardly reduces the residual; above that it goes on,
/// because the first iterations may reduce it little and later ones much.
pub(crate) fn gmres(
    b: &[f64],
    x: &mut [f64],
    (tolerance, enough): (f64, f64),
    [restart, most]: [usize; 2],
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64]),
    total: impl Fn(f64) -> f64,
) -> Minimised {
    let n = b.len();
    let norm = |a: &[f64]| total(dot(a, a)).sqrt();
    let size = norm(b);
    x.fill(0.0);
    let mut done = Minimised { iterations: 0, residual: 0.0 };
    if !(size > 0.0) {
        return done;
    }
    let mut residual = b.to_vec();
    let (mut product, mut answer) = (vec![0.0; n], vec![0.0; n]);
    let (mut stalled, mut converged, mut before) = (false, false, f64::INFINITY);
    loop {
        let start = norm(&residual);
        done.residual = start / size;
        if !(done.residual > tolerance) || done.iterations >= most || start > 0.5 * before {
            return done;
        }
        before = start;
        let mut basis = vec![kept(1.0 / start, &residual)];
        let mut answers: Vec<Vec<f32>> = Vec::new();
        let (mut columns, mut rotations, mut left) = (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new(), vec![start]);
        while answers.len() < restart && done.iterations < most {
            let last = &basis[basis.len() - 1];
            widened(last, &mut product);
            precondition(&product, &mut answer);
            answers.push(kept(1.0, &answer));
            widened(&answers[answers.len() - 1], &mut answer);
            apply(&answer, &mut product);
            done.iterations += 1;
            let mut column = Vec::with_capacity(basis.len() + 1);
            for other in &basis {
                let along = total(dot(other, &product));
                add_multiple(-along, other, &mut product);
                column.push(along);
            }
            let length = norm(&product);
            for (k, [cosine, sine]) in rotations.iter().enumerate() {
                let (a, b) = (column[k], column[k + 1]);
                (column[k], column[k + 1]) = (cosine * a + sine * b, cosine * b - sine * a);
            }
            let end = column.len() - 1;
            let hypotenuse = column[end].hypot(length);
            if !(hypotenuse > 0.0 && hypotenuse.is_finite()) {
                done.residual = f64::NAN;
                return done;
            }
            let rotation = [column[end] / hypotenuse, length / hypotenuse];
            column[end] = hypotenuse;
            columns.push(column);
            rotations.push(rotation);
            left.push(-rotation[1] * left[end]);
            left[end] *= rotation[0];
            if left[end + 1].abs() <= tolerance * size || length <= f64::from(f32::EPSILON) * hypotenuse {
                converged = true;
                break;
            }
            // Rounding leaves residuals where they are.
            let may_stall = left[end + 1].abs() <= enough * size;
            if may_stall && end >= STALLED && left[end + 1].abs() > 0.7 * left_before(&left, &rotations, end) {
                stalled = true;
                break;
            }
            basis.push(kept(1.0 / length, &product));
        }
        for k in (0..columns.len()).rev() {
            let known: f64 = (k + 1..columns.len()).map(|j| columns[j][k] * left[j]).sum();
            left[k] = (left[k] - known) / columns[k][k];
            add_multiple(left[k], &answers[k], x);
        }
        if converged && tolerance > KNOWN {
            // Rotations give the residual of so few iterations as exactly as a product would.
            done.residual = left[columns.len()].abs() / size;
            return done;
        }
        apply(x, &mut product);
        if stalled {
            residual.iter_mut().zip(b).zip(&product).for_each(|((r, b), p)| *r = b - p);
            done.residual = norm(&residual) / size;
            return done;
        }
        residual.iter_mut().zip(b).zip(&product).for_each(|((r, b), p)| *r = b - p);
    }
}

/// Most iterations that minimise residuals without a preconditioner. The skew part of a tangent comes from free faces
/// under pressure, and few are needed: a strip that pressure bends by 122° takes 2.
const UNAIDED: usize = 60;

/// Solves $A x = b$ from zero until the residual is below `tolerance` times that of zero, without preconditioner and restarts;
/// `apply` writes $A v$ into its second vector. With the solution comes the residual that is left, which may be larger where the
/// directions were too few.
///
/// # Errors
/// Those of `apply`, and where a product is not finite.
pub(crate) fn minimal_residuals(
    b: &[f64],
    tolerance: f64,
    mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<(), LinearError>,
) -> Result<(Vec<f64>, f64), LinearError> {
    let mut x = vec![0.0; b.len()];
    let mut failed = None;
    let done = gmres(
        b,
        &mut x,
        (tolerance, 0.0),
        [UNAIDED; 2],
        |v, product| {
            if let Err(error) = apply(v, product) {
                failed.get_or_insert(error);
                product.fill(f64::NAN);
            }
        },
        |v, answer| answer.copy_from_slice(v),
        |dot| dot,
    );
    match failed {
        Some(error) => Err(error),
        None if done.residual.is_finite() => Ok((x, done.residual)),
        None => Err(LinearError::Residual { residual: done.residual }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_small_system_is_solved() {
        let matrix = [[4.0, 1.0, -2.0], [-1.0, 3.0, 0.5], [2.0, -0.5, 5.0]];
        let exact = [1.0, -2.0, 0.5];
        let multiply = |v: &[f64], product: &mut [f64]| {
            product.iter_mut().zip(&matrix).for_each(|(p, row)| *p = dot(row, v));
        };
        let mut b = [0.0; 3];
        multiply(&exact, &mut b);
        let product = |v: &[f64], product: &mut [f64]| {
            multiply(v, product);
            Ok(())
        };
        let (x, left) = minimal_residuals(&b, 1e-14, product).unwrap();
        assert!(left <= 1e-14, "{left}");
        assert_abs_diff_eq!(x[..], exact[..], epsilon = 1e-12);
        let refused = LinearError::Pivot { pivot: 2, hint: "none" };
        assert_eq!(minimal_residuals(&b, 1e-14, |_, _| Err(refused.clone())).unwrap_err(), refused);
    }

    /// A shift turns each unit vector into the next: residuals stay as they are until all directions are there.
    #[test]
    fn what_is_left_after_all_directions_is_told() {
        let n = 2 * UNAIDED;
        let mut b = vec![0.0; n];
        b[0] = 1.0;
        let shift = |v: &[f64], product: &mut [f64]| {
            (0..n).for_each(|k| product[(k + 1) % n] = v[k]);
            Ok(())
        };
        let (_, left) = minimal_residuals(&b, 1e-6, shift).unwrap();
        assert!((left - 1.0).abs() < 1e-12, "{left}");
    }

    #[test]
    fn a_preconditioned_system_is_solved_with_and_without_restarts() {
        let n = 40;
        let b: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
        // A nonsymmetric matrix of three diagonals.
        let apply = |x: &[f64], y: &mut [f64]| {
            for k in 0..n {
                let before = if k > 0 { x[k - 1] } else { 0.0 };
                let after = if k + 1 < n { x[k + 1] } else { 0.0 };
                y[k] = (3.0 + k as f64) * x[k] - before - 0.5 * after;
            }
        };
        for restart in [40, 4] {
            let mut x = vec![0.0; n];
            let jacobi = |r: &[f64], z: &mut [f64]| (0..n).for_each(|k| z[k] = r[k] / (3.0 + k as f64));
            let done = gmres(&b, &mut x, (1e-11, 0.0), [restart, 200], apply, jacobi, |dot| dot);
            assert!(done.residual <= 1e-11 && done.iterations < 100, "{done:?}");
            let mut y = vec![0.0; n];
            apply(&x, &mut y);
            assert_abs_diff_eq!(y[..], b[..], epsilon = 1e-9);
        }
    }
}
