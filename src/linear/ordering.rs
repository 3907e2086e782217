//! Fill-reducing orders from the positions of the unknowns.

use crate::assembly::Pattern;
use crate::each::IntoEach;

/// A cut is worth while where the separator is smaller than this part of the smaller half: separators of wide supports
/// would otherwise eat up what they part. Operations of factors in space, counted with 9, 13 and 17 particles a side in
/// 1e9: 1.25, 18 and 123 by cuts in the middle; 1.25, 18 and 73 by the best ones with 0.5; 1.25, 11.5 and 73 with 1.
const WORTH: f64 = 1.0;

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

/// Sorts unknowns by a coordinate.
fn sort(set: &mut [usize], coordinate: &dyn Fn(usize) -> f64) {
    set.sort_unstable_by(|&a, &b| coordinate(a).total_cmp(&coordinate(b)).then(a.cmp(&b)));
}

/// An elimination order along the axis that gives the narrowest band: for bodies in the plane of up to some thousand
/// unknowns no order takes less time, symbolic phase included.
///
/// Arguments as for [`nested_dissection`].
pub(crate) fn banded(
    pattern: &Pattern,
    count: usize,
    dim: usize,
    coordinate: &dyn Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let count = count.min(pattern.size());
    let mut best: Option<(usize, Vec<usize>)> = None;
    let mut place = vec![0usize; count];
    for axis in 0..dim {
        let mut order: Vec<usize> = (0..count).collect();
        sort(&mut order, &|unknown| coordinate(unknown, axis));
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

/// A cut of a set of unknowns along one axis.
struct Cut {
    /// The separator over the smaller of the two halves beside it.
    ratio: f64,
    axis: usize,
    /// Unknowns below the cut, the separator among them.
    below: usize,
}

/// Cuts sets of unknowns, with working memory of its own.
struct Knife<'a> {
    adjacency: &'a [Vec<u32>],
    /// Place of each unknown of the set along an axis; `u32::MAX` for all others.
    place: Vec<u32>,
    /// The last place that each place couples to.
    last: Vec<u32>,
    /// Changes of the separator from one cut to the next.
    change: Vec<i32>,
}

impl Knife<'_> {
    /// Notes places along an axis, and how far they couple.
    fn look(&mut self, set: &[usize]) {
        for (place, &i) in set.iter().enumerate() {
            self.place[i] = place as u32;
        }
        self.last.clear();
        for (own, &i) in set.iter().enumerate() {
            let places = self.adjacency[i].iter().map(|&j| self.place[j as usize]).filter(|&place| place != u32::MAX);
            self.last.push(places.fold(own as u32, u32::max));
        }
        set.iter().for_each(|&i| self.place[i] = u32::MAX);
    }

    /// The best cut of a set in its order: unknowns below it that couple to others above are the separator.
    fn best(&mut self, axis: usize, set: &[usize]) -> Option<Cut> {
        self.look(set);
        self.change.clear();
        self.change.resize(set.len() + 1, 0);
        for (own, &last) in self.last.iter().enumerate() {
            // Part of the separator of all cuts after its own place up to the last that it couples to.
            self.change[own + 1] += 1;
            self.change[last as usize + 1] -= 1;
        }
        let mut best: Option<Cut> = None;
        let mut separator = 0;
        for below in 1..set.len() {
            separator += self.change[below];
            let half = (below as i32 - separator).min((set.len() - below) as i32);
            let ratio = f64::from(separator) / f64::from(half);
            if half > 0 && best.as_ref().is_none_or(|best| ratio < best.ratio) {
                best = Some(Cut { ratio, axis, below });
            }
        }
        best
    }
}

/// An elimination order by geometric nested dissection: cut where the separator is smallest beside the smaller half, along
/// any axis, order both halves, then those unknowns of the lower half that couple to the upper one. What no cut
/// improves follows the axis of the best one, as in a band matrix.
///
/// `coordinate(i, axis)` gives one of the `dim` coordinates of unknown `i`; the first `count` unknowns of the pattern are
/// ordered, old indices in new places.
pub(crate) fn nested_dissection(
    pattern: &Pattern,
    count: usize,
    dim: usize,
    coordinate: &dyn Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let count = count.min(pattern.size());
    let adjacency = adjacency(pattern, count);
    let mut order = Vec::with_capacity(count);
    let mut knife = Knife { adjacency: &adjacency, place: vec![u32::MAX; count], last: Vec::new(), change: Vec::new() };
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
        let mut best: Option<Cut> = None;
        for axis in 0..dim {
            sort(&mut set, &|unknown| coordinate(unknown, axis));
            let cut = knife.best(axis, &set);
            best = match (best, cut) {
                (Some(best), Some(cut)) if cut.ratio < best.ratio => Some(cut),
                (None, cut) => cut,
                (best, _) => best,
            };
        }
        let Some(cut) = best else {
            order.extend(set);
            continue;
        };
        sort(&mut set, &|unknown| coordinate(unknown, cut.axis));
        if cut.ratio >= WORTH {
            order.extend(set);
            continue;
        }
        knife.look(&set);
        let upper = set.split_off(cut.below);
        let (separator, lower): (Vec<(usize, usize)>, _) =
            set.into_iter().enumerate().partition(|&(place, _)| knife.last[place] as usize >= cut.below);
        let unknowns = |part: Vec<(usize, usize)>| part.into_mapped(|(_, i)| i);
        stack.push(Task::Emit(unknowns(separator)));
        stack.push(Task::Cut(upper));
        stack.push(Task::Cut(unknowns(lower)));
    }
    order
}
