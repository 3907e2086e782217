//! The only place that names rayon: ordered maps over indices.
//!
//! Results come back in index order and each index is computed by one thread alone, so the bits
//! do not depend on the number of threads.

use std::sync::Mutex;

/// Parts per thread: several even out parts of unequal work.
const PARTS_PER_THREAD: usize = 8;

/// Maps `0..count` with one scratch value per worker; results in index order.
pub(crate) fn map_with<S: Send, T: Send>(
    count: usize,
    serial_below: usize,
    scratch: impl Fn() -> S + Sync,
    f: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    if threads() < 2 || count < serial_below.max(2) {
        let mut s = scratch();
        return (0..count).map(|i| f(&mut s, i)).collect();
    }
    let length = count.div_ceil(PARTS_PER_THREAD * threads());
    let mut found: Vec<Option<T>> = Vec::new();
    found.resize_with(count, || None);
    let mut parts: Vec<&mut [Option<T>]> = found.chunks_mut(length).collect();
    let idle: Mutex<Vec<S>> = Mutex::new(Vec::new());
    for_each_mut(&mut parts, |part, found| {
        let kept = idle.lock().ok().and_then(|mut idle| idle.pop());
        let mut s = kept.unwrap_or_else(&scratch);
        found.iter_mut().enumerate().for_each(|(k, found)| *found = Some(f(&mut s, part * length + k)));
        if let Ok(mut idle) = idle.lock() {
            idle.push(s);
        }
    });
    found.into_iter().flatten().collect()
}

/// Maps consecutive ranges that cover `0..count`; results in order. Below `serial_below` there is one range.
pub(crate) fn map_ranges<T: Send>(
    count: usize,
    serial_below: usize,
    f: impl Fn(std::ops::Range<usize>) -> T + Sync,
) -> Vec<T> {
    let parts = if threads() < 2 || count < serial_below { 1 } else { (PARTS_PER_THREAD * threads()).min(count) };
    map_with(parts, 2, || (), |(), part| f(count * part / parts..count * (part + 1) / parts))
}

/// Calls `f` on each item, on all threads where there are more than one.
pub(crate) fn for_each_mut<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    if threads() < 2 {
        items.iter_mut().enumerate().for_each(|(i, t)| f(i, t));
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
