//! The only place that names rayon: ordered maps over indices.
//!
//! Results come back in index order and each index is computed by one thread alone, so the bits
//! do not depend on the number of threads.

/// Maps `0..count` with one scratch value per worker; results in index order.
#[cfg(feature = "rayon")]
pub(crate) fn map_with<S, T, F>(
    count: usize,
    serial_below: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: F,
) -> Vec<T>
where
    S: Send,
    T: Send,
    F: Fn(&mut S, usize) -> T + Sync + Send,
{
    use rayon::prelude::*;
    if count < serial_below {
        let mut s = scratch();
        return (0..count).map(|i| f(&mut s, i)).collect();
    }
    (0..count).into_par_iter().map_init(scratch, f).collect()
}

/// Maps `0..count` with one scratch value per worker; results in index order.
#[cfg(not(feature = "rayon"))]
pub(crate) fn map_with<S, T, F>(
    count: usize,
    _serial_below: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: F,
) -> Vec<T>
where
    F: Fn(&mut S, usize) -> T,
{
    let mut s = scratch();
    (0..count).map(|i| f(&mut s, i)).collect()
}

/// Maps consecutive ranges that cover `0..count`; results in order. Below `serial_below` there is one range.
pub(crate) fn map_ranges<T: Send>(
    count: usize,
    serial_below: usize,
    f: impl Fn(std::ops::Range<usize>) -> T + Sync + Send,
) -> Vec<T> {
    // Several ranges per thread even out ranges of unequal work.
    const RANGES_PER_THREAD: usize = 8;
    let parts = if threads() < 2 || count < serial_below { 1 } else { (RANGES_PER_THREAD * threads()).min(count) };
    map_with(parts, 2, || (), |(), part| f(count * part / parts..count * (part + 1) / parts))
}

/// Calls `f` on each item, on all threads where there are more than one item.
#[cfg(feature = "rayon")]
pub(crate) fn for_each_mut<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync + Send) {
    use rayon::prelude::*;
    if items.len() < 2 {
        items.iter_mut().enumerate().for_each(|(i, t)| f(i, t));
    } else {
        items.par_iter_mut().enumerate().for_each(|(i, t)| f(i, t));
    }
}

/// Calls `f` on each item.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each_mut<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync + Send) {
    items.iter_mut().enumerate().for_each(|(i, t)| f(i, t));
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
