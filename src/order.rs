//! Sorting by one routine.

use std::cmp::Ordering;

/// Sorts by a comparison; items that compare equal keep their order.
///
/// Numbers are sorted and items moved behind them: a sort of the standard library is compiled for each type and each comparison, 2700
/// lines of LLVM's input at a time, this one once. Not for inner loops: it allocates, and compares through a pointer.
pub(crate) fn sort<T>(items: &mut [T], compare: &dyn Fn(&T, &T) -> Ordering) {
    let mut order: Vec<usize> = (0..items.len()).collect();
    sort_numbers(&mut order, &|a, b| compare(&items[a], &items[b]).then(a.cmp(&b)));
    // Cycle by cycle: what belongs at a place is swapped there.
    for first in 0..order.len() {
        let mut place = first;
        while order[place] != first {
            let from = std::mem::replace(&mut order[place], place);
            items.swap(place, from);
            place = from;
        }
        order[place] = place;
    }
}

/// The numbers of three values, the largest first.
pub(crate) fn falling(values: [f64; 3]) -> [usize; 3] {
    let mut order = [0, 1, 2];
    sort(&mut order, &|&a: &usize, &b| values[b].total_cmp(&values[a]));
    order
}

/// Numbers of items, those of one key together: groups by rising key, each in the order of the items.
pub(crate) fn grouped<K: Ord>(keys: &[K]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    sort_numbers(&mut order, &|a, b| keys[a].cmp(&keys[b]).then(a.cmp(&b)));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for number in order {
        match groups.last_mut() {
            Some(group) if keys[group[0]] == keys[number] => group.push(number),
            _ => groups.push(vec![number]),
        }
    }
    groups
}

/// Moves the lower half of some numbers before the others, by a comparison.
pub(crate) fn halve(numbers: &mut [u32], compare: &dyn Fn(u32, u32) -> Ordering) {
    numbers.select_nth_unstable_by(numbers.len() / 2, |&a, &b| compare(a, b));
}

/// Values by rising key, those of one key summed in the order in which they stand.
pub(crate) fn merged<K: Ord + Copy>(mut values: Vec<(K, f64)>) -> Vec<(K, f64)> {
    sort(&mut values, &|a, b| a.0.cmp(&b.0));
    values.dedup_by(|later, first| {
        let same = later.0 == first.0;
        first.1 += if same { later.1 } else { 0.0 };
        same
    });
    values
}

/// Adds to the value of a key in a short list, whose keys stand in the order in which they come.
pub(crate) fn accumulate<K: PartialEq>(list: &mut Vec<(K, f64)>, key: K, value: f64) {
    match list.iter_mut().find(|known| known.0 == key) {
        Some(known) => known.1 += value,
        None => list.push((key, value)),
    }
}

/// Sorts numbers by a comparison that tells all of them apart.
fn sort_numbers(numbers: &mut [usize], compare: &dyn Fn(usize, usize) -> Ordering) {
    numbers.sort_unstable_by(|&a, &b| compare(a, b));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_sorted_as_by_the_standard_library() {
        let mut random = fastrand::Rng::with_seed(7);
        for count in [0, 1, 2, 3, 10, 100, 1000] {
            let given: Vec<(u32, usize)> = (0..count).map(|k| (random.u32(0..20), k)).collect();
            let (mut found, mut expected) = (given.clone(), given);
            sort(&mut found, &|a, b| a.0.cmp(&b.0));
            expected.sort_by_key(|item| item.0);
            assert_eq!(found, expected);
        }
    }
}
