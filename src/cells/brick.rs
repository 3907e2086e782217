//! Numbers and maps of bricks.

use crate::geometry::Point;

/// The multi-index of a linear index, axis 0 running fastest.
#[inline]
pub(crate) fn unravel<const D: usize>(mut linear: usize, counts: &[usize; D]) -> [usize; D] {
    std::array::from_fn(|i| {
        let index = linear % counts[i];
        linear /= counts[i];
        index
    })
}

/// The linear index of a multi-index, axis 0 running fastest.
#[inline]
pub(crate) fn ravel<const D: usize>(index: &[usize; D], counts: &[usize; D]) -> usize {
    (0..D).rev().fold(0, |linear, i| linear * counts[i] + index[i])
}

/// Position and derivative columns $\partial X/\partial\xi_i$ of the multilinear map of $2^D$ corners.
pub(crate) fn multilinear<const D: usize>(corners: &[Point<D>; 8], at: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    let mut position = Point::zeros();
    let mut columns = [Point::zeros(); D];
    for (corner, x) in corners.iter().enumerate().take(1 << D) {
        let factor = |i: usize| if (corner >> i) & 1 == 1 { at[i] } else { 1.0 - at[i] };
        let weight: f64 = (0..D).map(factor).product();
        position += x * weight;
        for (k, column) in columns.iter_mut().enumerate() {
            let sign = if (corner >> k) & 1 == 1 { 1.0 } else { -1.0 };
            let slope: f64 = (0..D).filter(|&i| i != k).map(factor).product();
            *column += x * (sign * slope);
        }
    }
    (position, columns)
}

/// The determinant of `D` column vectors, `D` ≤ 3.
pub(crate) fn determinant<const D: usize>(columns: &[Point<D>; D]) -> f64 {
    match D {
        1 => columns[0][0],
        2 => columns[0][0] * columns[1][1] - columns[0][1] * columns[1][0],
        _ => {
            let (a, b, c) = (&columns[0], &columns[1], &columns[2]);
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        }
    }
}
