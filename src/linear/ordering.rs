//! Fill-reducing orders from the positions of the unknowns.

use crate::assembly::Pattern;

/// A cut is worth while where the separator is smaller than this part of the smaller half: separators of wide supports
/// would otherwise eat up what they part. Bodies in space of 500 to 6000 unknowns hardly tell 0.25 from 2.
const WORTH: f64 = 0.5;

/// The full adjacency of the first `count` unknowns of a lower pattern.
fn adjacency(pattern: &Pattern, count: usize) -> Vec<Vec<u32>> {
    let mut adjacency: Vec<Vec<u32>> = vec![Vec::new(); count];
    for column in 0..count {
        for &row in pattern.column(column) {
            if (row as usize) < count && row as usize != column {
                adjacency[column].push(row);
                adjacency[row as usize].push(column as u32);
            }
        }
    }
    adjacency
}

/// Sorts unknowns by one coordinate.
fn sort<const D: usize>(set: &mut [usize], axis: usize, position: impl Fn(usize) -> [f64; D]) {
    set.sort_unstable_by(|&a, &b| position(a)[axis].total_cmp(&position(b)[axis]).then(a.cmp(&b)));
}

/// An elimination order along the axis that gives the narrowest band: for bodies in the plane of up to some thousand
/// unknowns no order takes less time, symbolic phase included.
///
/// Arguments as for [`nested_dissection`].
pub fn banded<const D: usize>(pattern: &Pattern, count: usize, position: impl Fn(usize) -> [f64; D]) -> Vec<usize> {
    let count = count.min(pattern.size());
    let mut best: Option<(usize, Vec<usize>)> = None;
    let mut place = vec![0usize; count];
    for axis in 0..D {
        let mut order: Vec<usize> = (0..count).collect();
        sort(&mut order, axis, &position);
        for (new, &old) in order.iter().enumerate() {
            place[old] = new;
        }
        // The profile: how far each row reaches back.
        let mut first: Vec<usize> = (0..count).collect();
        for column in 0..count {
            for row in pattern.column(column).iter().map(|&row| row as usize).filter(|&row| row < count) {
                let (low, high) = (place[row].min(place[column]), place[row].max(place[column]));
                first[high] = first[high].min(low);
            }
        }
        let profile = first.iter().enumerate().map(|(row, first)| row - first).sum();
        if best.as_ref().is_none_or(|(least, _)| profile < *least) {
            best = Some((profile, order));
        }
    }
    best.map_or_else(|| (0..count).collect(), |(_, order)| order)
}

/// The elimination order `inner` of the first unknowns of a pattern with the others, multipliers, put in: each right after
/// the last unknown of its row.
///
/// Any further forward its pivot could be zero. Further back, at the end, multipliers would make one dense block with each
/// other, and every block on the way there would carry their rows.
pub(crate) fn after_their_rows(pattern: &Pattern, inner: &[usize]) -> Vec<usize> {
    let count = inner.len();
    // Where each multiplier's last unknown stands; those without any come first, and are found singular.
    let mut last: Vec<(usize, usize)> = (count..pattern.size()).map(|multiplier| (0, multiplier)).collect();
    for (place, &unknown) in inner.iter().enumerate() {
        let rows = pattern.column(unknown);
        for &row in &rows[rows.partition_point(|&row| (row as usize) < count)..] {
            last[row as usize - count].0 = place + 1;
        }
    }
    last.sort_unstable();
    let mut order = Vec::with_capacity(pattern.size());
    let mut multipliers = last.into_iter().peekable();
    for place in 0..=count {
        while let Some((_, multiplier)) = multipliers.next_if(|&(last, _)| last <= place) {
            order.push(multiplier);
        }
        order.extend(inner.get(place));
    }
    order
}

/// An elimination order by geometric nested dissection: cut at the median of the axis with the smallest separator,
/// order both halves, then those unknowns of the lower half that couple to the upper one. What no cut improves
/// follows that axis, as in a band matrix.
///
/// `position(i)` gives the coordinates of unknown `i`; the first `count` unknowns of the pattern are
/// ordered, old indices in new places.
pub fn nested_dissection<const D: usize>(
    pattern: &Pattern,
    count: usize,
    position: impl Fn(usize) -> [f64; D],
) -> Vec<usize> {
    let count = count.min(pattern.size());
    let adjacency = adjacency(pattern, count);
    let mut order = Vec::with_capacity(count);
    let mut upper_half = vec![false; count];
    enum Task {
        Cut(Vec<usize>),
        Emit(Vec<usize>),
    }
    let mut stack = vec![Task::Cut((0..count).collect())];
    while let Some(task) = stack.pop() {
        let mut set = match task {
            Task::Emit(set) => {
                order.extend(set);
                continue;
            }
            Task::Cut(set) => set,
        };
        let half = set.len() / 2;
        let mut best: Option<(usize, usize)> = None;
        // The lower half that is left beside its separator.
        let mut part = |set: &[usize]| -> (Vec<usize>, Vec<usize>) {
            for &i in &set[half..] {
                upper_half[i] = true;
            }
            let couples = |&i: &usize| adjacency[i].iter().any(|&j| upper_half[j as usize]);
            let parts = set[..half].iter().copied().partition(couples);
            for &i in &set[half..] {
                upper_half[i] = false;
            }
            parts
        };
        for axis in 0..D {
            sort(&mut set, axis, &position);
            let separator = part(&set).0.len();
            if best.is_none_or(|(least, _)| separator < least) {
                best = Some((separator, axis));
            }
        }
        let Some((size, axis)) = best else {
            order.extend(set);
            continue;
        };
        sort(&mut set, axis, &position);
        if size as f64 >= WORTH * (half - size) as f64 {
            order.extend(set);
            continue;
        }
        let (separator, lower) = part(&set);
        stack.push(Task::Emit(separator));
        stack.push(Task::Cut(set.split_off(half)));
        stack.push(Task::Cut(lower));
    }
    order
}
