//! Fill-reducing orders from the positions of the unknowns.

use crate::assembly::Pattern;

/// Groups smaller than this are not cut further: a separator would be as large as the rest.
const LEAF: usize = 48;

/// An elimination order by geometric nested dissection: cut at the median of the widest axis, order both
/// halves, then those unknowns of the lower half that couple to the upper one.
///
/// `position(i)` gives the coordinates of unknown `i`; the first `count` unknowns of the pattern are
/// ordered, old indices in new places.
pub fn nested_dissection<const D: usize>(
    pattern: &Pattern,
    count: usize,
    position: impl Fn(usize) -> [f64; D],
) -> Vec<usize> {
    // Full adjacency from the lower triangle.
    let mut adjacency: Vec<Vec<u32>> = vec![Vec::new(); count];
    for column in 0..count {
        for &row in pattern.column(column) {
            if (row as usize) < count && row as usize != column {
                adjacency[column].push(row);
                adjacency[row as usize].push(column as u32);
            }
        }
    }
    let mut order = Vec::with_capacity(count);
    let mut side = vec![0u8; count];
    // Explicit stack: (unknowns, done with children).
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
        if set.len() <= LEAF {
            order.extend(set);
            continue;
        }
        let mut low = [f64::INFINITY; D];
        let mut high = [f64::NEG_INFINITY; D];
        for &i in &set {
            let x = position(i);
            for axis in 0..D {
                low[axis] = low[axis].min(x[axis]);
                high[axis] = high[axis].max(x[axis]);
            }
        }
        let axis = (0..D).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        let half = set.len() / 2;
        set.select_nth_unstable_by(half, |&a, &b| position(a)[axis].total_cmp(&position(b)[axis]).then(a.cmp(&b)));
        let upper: Vec<usize> = set.split_off(half);
        for &i in &set {
            side[i] = 1;
        }
        for &i in &upper {
            side[i] = 2;
        }
        let (separator, lower): (Vec<usize>, Vec<usize>) =
            set.iter().copied().partition(|&i| adjacency[i].iter().any(|&j| side[j as usize] == 2));
        for &i in set.iter().chain(&upper) {
            side[i] = 0;
        }
        if lower.is_empty() {
            // Everything couples with everything: no cut helps.
            order.extend(set);
            order.extend(upper);
            continue;
        }
        stack.push(Task::Emit(separator));
        stack.push(Task::Cut(upper));
        stack.push(Task::Cut(lower));
    }
    order
}
