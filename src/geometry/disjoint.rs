//! Sets that are joined two by two.

use crate::each::list_of;

/// Numbers in disjoint sets, each of which has a leader: the least of its numbers where sets are [joined](Disjoint::join).
pub(crate) struct Disjoint(Vec<u32>);

impl Disjoint {
    /// Each number in a set of its own.
    pub(crate) fn new(count: usize) -> Self {
        Disjoint((0..count as u32).collect())
    }

    pub(crate) fn leader(&mut self, number: usize) -> usize {
        let mut number = number as u32;
        while self.0[number as usize] != number {
            self.0[number as usize] = self.0[self.0[number as usize] as usize];
            number = self.0[number as usize];
        }
        number as usize
    }

    /// The set of each number, counted in the order of leaders, and how many there are.
    pub(crate) fn numbered(&mut self) -> (Vec<u32>, usize) {
        let mut set_of = vec![0; self.0.len()];
        let mut count = 0;
        for number in 0..self.0.len() {
            if self.leader(number) == number {
                set_of[number] = count;
                count += 1;
            }
        }
        (list_of(self.0.len(), |number| set_of[self.leader(number)]), count as usize)
    }

    /// Joins the sets of two numbers; `false` where they are one already.
    pub(crate) fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.leader(a), self.leader(b));
        self.lead(a.min(b), a.max(b));
        a != b
    }

    /// Puts the set of one leader under another leader.
    pub(crate) fn lead(&mut self, leader: usize, other: usize) {
        self.0[other] = leader as u32;
    }
}
