//! The only place that names rayon: ordered maps over indices.
//!
//! Results come back in index order and each index is computed by one thread alone, so the bits
//! do not depend on the number of threads.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Parts per thread: several even out parts of unequal work.
const PARTS_PER_THREAD: usize = 8;

/// Maps `0..count` with one scratch value per part of it; results in index order.
pub(crate) fn map_with<S, T: Send>(
    count: usize,
    serial_below: usize,
    scratch: impl Fn() -> S + Sync,
    f: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let is_serial = threads() < 2 || count < serial_below.max(2);
    let length = if is_serial { count } else { count.div_ceil(PARTS_PER_THREAD * threads()) };
    in_parts(count, length, &|part, results| {
        let mut s = scratch();
        for i in part {
            results.push(f(&mut s, i));
        }
    })
}

/// Maps consecutive ranges that cover `0..count`; results in order. Below `serial_below` there is one range.
pub(crate) fn map_ranges<T: Send>(count: usize, serial_below: usize, f: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let parts = if threads() < 2 || count < serial_below { 1 } else { (PARTS_PER_THREAD * threads()).min(count) };
    in_parts(parts, 1, &|part, results| {
        for k in part {
            results.push(f(count * k / parts..count * (k + 1) / parts));
        }
    })
}

/// The results of parts of `0..count` with so many indices each, in order. A part pushes its own.
///
/// Generic over the result alone, in plain loops: callers have a closure each, and what is compiled for each of them is short.
fn in_parts<T: Send>(count: usize, length: usize, fill: &(dyn Fn(Range<usize>, &mut Vec<T>) + Sync)) -> Vec<T> {
    let mut results = Vec::with_capacity(count);
    if count <= length {
        fill(0..count, &mut results);
        return results;
    }
    let mut parts: Vec<Vec<T>> = Vec::new();
    for _ in 0..count.div_ceil(length) {
        parts.push(Vec::new());
    }
    for_each_mut(&mut parts, |part, own| {
        let range = part * length..count.min((part + 1) * length);
        own.reserve_exact(range.len());
        fill(range, own);
    });
    for part in &mut parts {
        results.append(part);
    }
    results
}

/// Calls `f` on each item, on all threads where there are more than one.
pub(crate) fn for_each_mut<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    if threads() < 2 {
        for i in 0..items.len() {
            f(i, &mut items[i]);
        }
    } else {
        halve(items, 0, &f);
    }
}

/// Calls `f` on each item, counted from `first`, one half beside the other.
fn halve<T: Send>(items: &mut [T], first: usize, f: &(dyn Fn(usize, &mut T) + Sync)) {
    match items {
        [] => {}
        [item] => f(first, item),
        _ => {
            let middle = items.len() / 2;
            let (left, right) = items.split_at_mut(middle);
            join(&mut || halve(left, first, f), &mut || halve(right, first + middle, f));
        }
    }
}

/// Two calls, on two threads if one is free. Not generic: the machinery of threads is compiled once, not for each map.
fn join(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    #[cfg(feature = "rayon")]
    rayon::join(a, b);
    #[cfg(not(feature = "rayon"))]
    {
        a();
        b();
    }
}

/// Number of threads that share the work.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "rayon")]
    {
        rayon::current_num_threads()
    }
    #[cfg(not(feature = "rayon"))]
    {
        1
    }
}

/// What a mutex holds. Nothing of it is broken by a panic: parts are summed, searches are made anew.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
