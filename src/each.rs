//! Lists, arrays and sums of the values of a function, made in plain loops.
//!
//! `iter().map(f).collect()` and `[T; N]::map` compile a dozen functions of the standard library for each closure, in generic code once for
//! each dimension; what is here compiles one.

use nalgebra::SVector;

/// Values of a function of each item.
pub(crate) trait Each<T> {
    fn mapped<'a, U>(&'a self, f: impl FnMut(&'a T) -> U) -> Vec<U>
    where
        T: 'a;

    /// All values, or the first error.
    fn try_mapped<'a, U, E>(&'a self, f: impl FnMut(&'a T) -> Result<U, E>) -> Result<Vec<U>, E>
    where
        T: 'a;

    fn summed<'a>(&'a self, f: impl FnMut(&'a T) -> f64) -> f64
    where
        T: 'a;

    /// The largest of zero and the values.
    fn largest<'a>(&'a self, f: impl FnMut(&'a T) -> f64) -> f64
    where
        T: 'a;

    /// Values of each item with that of another list in its place, as far as both go.
    fn paired<'a, S, U>(&'a self, others: &'a [S], f: impl FnMut(&'a T, &'a S) -> U) -> Vec<U>
    where
        T: 'a;

    /// The sum of those.
    fn pair_sum<'a, S>(&'a self, others: &'a [S], f: impl FnMut(&'a T, &'a S) -> f64) -> f64
    where
        T: 'a;
}

impl<T> Each<T> for [T] {
    fn mapped<'a, U>(&'a self, mut f: impl FnMut(&'a T) -> U) -> Vec<U> {
        let mut values = room(self.len());
        for item in self {
            values.push(f(item));
        }
        values
    }

    fn try_mapped<'a, U, E>(&'a self, mut f: impl FnMut(&'a T) -> Result<U, E>) -> Result<Vec<U>, E> {
        let mut values = room(self.len());
        for item in self {
            values.push(f(item)?);
        }
        Ok(values)
    }

    fn summed<'a>(&'a self, mut f: impl FnMut(&'a T) -> f64) -> f64 {
        let mut sum = ZERO;
        for item in self {
            sum += f(item);
        }
        sum
    }

    fn largest<'a>(&'a self, mut f: impl FnMut(&'a T) -> f64) -> f64 {
        let mut largest = 0.0f64;
        for item in self {
            largest = largest.max(f(item));
        }
        largest
    }

    fn paired<'a, S, U>(&'a self, others: &'a [S], mut f: impl FnMut(&'a T, &'a S) -> U) -> Vec<U> {
        list_of(self.len().min(others.len()), |i| f(&self[i], &others[i]))
    }

    fn pair_sum<'a, S>(&'a self, others: &'a [S], mut f: impl FnMut(&'a T, &'a S) -> f64) -> f64 {
        sum_of(self.len().min(others.len()), |i| f(&self[i], &others[i]))
    }
}

/// Values of a function of each item of a list that is taken apart.
pub(crate) trait IntoEach<T> {
    fn into_mapped<U>(self, f: impl FnMut(T) -> U) -> Vec<U>;
}

impl<T> IntoEach<T> for Vec<T> {
    fn into_mapped<U>(self, mut f: impl FnMut(T) -> U) -> Vec<U> {
        let mut values = room(self.len());
        for item in self {
            values.push(f(item));
        }
        values
    }
}

/// Values of a function of each item of an array that is not empty.
pub(crate) trait EachOf<T, const N: usize> {
    fn each<U: Copy>(self, f: impl FnMut(T) -> U) -> [U; N];
}

impl<T: Copy, const N: usize> EachOf<T, N> for [T; N] {
    #[inline(always)]
    fn each<U: Copy>(self, mut f: impl FnMut(T) -> U) -> [U; N] {
        let mut values = [f(self[0]); N];
        for i in 1..N {
            values[i] = f(self[i]);
        }
        values
    }
}

/// Values of a function of 0, 1, …
pub(crate) fn list_of<U>(count: usize, mut f: impl FnMut(usize) -> U) -> Vec<U> {
    let mut values = room(count);
    for i in 0..count {
        values.push(f(i));
    }
    values
}

/// The sum of a function of 0, 1, …
#[inline(always)]
pub(crate) fn sum_of(count: usize, mut f: impl FnMut(usize) -> f64) -> f64 {
    let mut sum = ZERO;
    for i in 0..count {
        sum += f(i);
    }
    sum
}

/// An array, not an empty one, of values of a function of 0, 1, …
#[inline(always)]
pub(crate) fn array_of<U: Copy, const N: usize>(mut f: impl FnMut(usize) -> U) -> [U; N] {
    let mut values = [f(0); N];
    for i in 1..N {
        values[i] = f(i);
    }
    values
}

/// Share `part` of `parts` of so many items: the shares are as long as each other but for one.
pub(crate) fn share_of(count: usize, part: usize, parts: usize) -> std::ops::Range<usize> {
    let parts = parts.max(1);
    let first = |part: usize| (count as u128 * part.min(parts) as u128 / parts as u128) as usize;
    first(part)..first(part.saturating_add(1))
}

/// Adds numbers times a factor.
#[inline(always)]
pub(crate) fn add(to: &mut [f64], factor: f64, of: &[f64]) {
    to.iter_mut().zip(of).for_each(|(sum, part)| *sum += factor * part);
}

/// A point by its components.
#[inline(always)]
pub(crate) fn point_of<const D: usize>(mut f: impl FnMut(usize) -> f64) -> SVector<f64, D> {
    let mut x = SVector::zeros();
    for i in 0..D {
        x[i] = f(i);
    }
    x
}

/// A list with room for so many values. Not inlined: closures have a function each, lists of one type have this one together.
#[inline(never)]
fn room<U>(count: usize) -> Vec<U> {
    Vec::with_capacity(count)
}

/// What the standard library begins a sum with: a sum of nothing but negative zeros is one.
const ZERO: f64 = -0.0;
