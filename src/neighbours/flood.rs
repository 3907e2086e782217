//! Which of many goals are connected to some cells, each within a box of its own: one flood for all of them.

use std::collections::VecDeque;

use crate::geometry::Bounds;

use super::adjacent::Adjacent;

/// Goals of one flood: each is one bit.
pub(crate) const GOALS: usize = u64::BITS as usize;

/// Cells that are looked for, and the box that the way there must keep to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Goal<'a, const D: usize> {
    pub(crate) cells: &'a [u32],
    pub(crate) within: Bounds<D>,
}

/// What a flood knows of a cell: bits are those of goals.
#[derive(Debug, Clone, Copy, Default)]
struct Met {
    /// The flood that met the cell last: what another one left counts as nothing.
    flood: u32,
    /// Whether it is in the queue.
    is_open: bool,
    /// The goals whose boxes are connected up to here, and those of them that have not been handed on.
    reached: u64,
    fresh: u64,
    /// The goals that have this cell.
    goals: u64,
}

/// Which boxes begin below a value, or end above it.
#[derive(Debug, Clone, Default)]
struct Ends {
    /// In rising order, each once, with the boxes that have it or one before it.
    values: Vec<(f64, u64)>,
}

impl Ends {
    fn fill(&mut self, boxes: usize, end: &dyn Fn(usize) -> f64) {
        self.values.clear();
        for bit in 0..boxes {
            self.values.push((end(bit), 1 << bit));
        }
        self.values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        self.values.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 |= if is_same { next.1 } else { 0 };
            is_same
        });
        let mut all = 0;
        for (_, bits) in &mut self.values {
            all |= *bits;
            *bits = all;
        }
    }

    /// The boxes whose value is at most this one.
    fn up_to(&self, value: f64) -> u64 {
        let count = self.values.partition_point(|known| known.0 <= value);
        count.checked_sub(1).map_or(0, |last| self.values[last].1)
    }
}

/// Buffers of a flood.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flood {
    met: Vec<Met>,
    number: u32,
    open: VecDeque<u32>,
    /// Lower ends along each axis, and upper ones with their signs turned.
    low: [Ends; 3],
    high: [Ends; 3],
    /// Cells looked at so far.
    #[cfg(test)]
    pub(crate) visits: usize,
}

impl Flood {
    /// Whether one of some cells is connected to the first ones through faces that meet a box.
    pub(crate) fn reaches<const D: usize>(
        &mut self,
        cells: &dyn Adjacent<D>,
        start: &[u32],
        goal: &[u32],
        within: &Bounds<D>,
    ) -> bool {
        self.reached(cells, start, &[Goal { cells: goal, within: *within }]) != 0
    }

    /// The goals, at most [`GOALS`], one of whose cells is connected to one of the first ones through faces that meet the goal's box.
    pub(crate) fn reached<const D: usize>(
        &mut self,
        cells: &dyn Adjacent<D>,
        start: &[u32],
        goals: &[Goal<'_, D>],
    ) -> u64 {
        let all = u64::MAX.checked_shr(GOALS.saturating_sub(goals.len()) as u32).unwrap_or(0);
        self.begin(cells.count(), &goals[..goals.len().min(GOALS)]);
        let Flood { met, number, open, low, high, .. } = self;
        let mut found = 0;
        for &cell in start {
            let own = known(met, cell, *number);
            found |= own.goals;
            (own.reached, own.fresh) = (all, all);
            if !std::mem::replace(&mut own.is_open, true) {
                open.push_back(cell);
            }
        }
        while found != all {
            let Some(cell) = open.pop_front() else { break };
            #[cfg(test)]
            {
                self.visits += 1;
            }
            let own = &mut met[cell as usize];
            let fresh = std::mem::take(&mut own.fresh) & !found;
            own.is_open = false;
            if fresh == 0 {
                continue;
            }
            cells.beside(cell, &mut |other, face| {
                let beside = known(met, other, *number);
                let mut new = fresh & !beside.reached;
                for i in 0..D {
                    if new == 0 {
                        return;
                    }
                    new &= low[i].up_to(face.high[i]) & high[i].up_to(-face.low[i]);
                }
                if new == 0 {
                    return;
                }
                found |= new & beside.goals;
                beside.reached |= new;
                beside.fresh |= new;
                if !std::mem::replace(&mut beside.is_open, true) {
                    open.push_back(other);
                }
            });
        }
        found
    }

    fn begin<const D: usize>(&mut self, count: usize, goals: &[Goal<'_, D>]) {
        self.met.resize(count.max(self.met.len()), Met::default());
        self.number = self.number.wrapping_add(1);
        if self.number == 0 {
            self.met.fill(Met::default());
            self.number = 1;
        }
        self.open.clear();
        for i in 0..D {
            self.low[i].fill(goals.len(), &|goal| goals[goal].within.low[i]);
            self.high[i].fill(goals.len(), &|goal| -goals[goal].within.high[i]);
        }
        for (bit, goal) in goals.iter().enumerate() {
            for &cell in goal.cells {
                known(&mut self.met, cell, self.number).goals |= 1 << bit;
            }
        }
    }
}

/// What is known of a cell in this flood.
fn known(met: &mut [Met], cell: u32, flood: u32) -> &mut Met {
    let own = &mut met[cell as usize];
    if own.flood != flood {
        *own = Met { flood, ..Met::default() };
    }
    own
}
