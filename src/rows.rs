//! Lists of numbers, one behind the other.

/// Lists by their number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    /// Where each begins, and the end of the last.
    pub(crate) starts: Vec<u32>,
    pub(crate) entries: Vec<u32>,
}

/// Takes a list and an entry of it.
type Add<'a> = dyn FnMut(usize, u32) + 'a;

impl Rows {
    /// Some number of lists from pairs of a list and an entry, which `each` visits twice in the same order: that of the entries.
    pub(crate) fn new(count: usize, each: &dyn Fn(&mut Add<'_>)) -> Self {
        let mut starts = vec![0u32; count + 1];
        each(&mut |row, _| starts[row + 1] += 1);
        for row in 0..count {
            starts[row + 1] += starts[row];
        }
        let (mut next, mut entries) = (starts.clone(), vec![0; starts[count] as usize]);
        each(&mut |row, entry| {
            entries[next[row] as usize] = entry;
            next[row] += 1;
        });
        Rows { starts, entries }
    }

    /// Particles beside those with which they share one of the sets.
    pub(crate) fn sharing(count: usize, sets: &[&[u32]]) -> Self {
        let mut rows: Vec<Vec<u32>> = vec![Vec::new(); count];
        for set in sets {
            for own in *set {
                rows[*own as usize].extend(set.iter().filter(|other| *other != own));
            }
        }
        let mut all = Rows { starts: vec![0], entries: Vec::new() };
        for mut row in rows {
            row.sort_unstable();
            row.dedup();
            all.entries.extend(row);
            all.starts.push(all.entries.len() as u32);
        }
        all
    }

    /// One of the lists.
    pub(crate) fn row(&self, row: usize) -> &[u32] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.starts.len() - 1
    }
}
