//! Sets that are joined two by two.

/// Numbers in disjoint sets, each of which has its least number for a leader.
pub(crate) struct Disjoint(Vec<usize>);

impl Disjoint {
    /// Each number in a set of its own.
    pub(crate) fn new(count: usize) -> Self {
        Disjoint((0..count).collect())
    }

    pub(crate) fn leader(&mut self, mut number: usize) -> usize {
        while self.0[number] != number {
            self.0[number] = self.0[self.0[number]];
            number = self.0[number];
        }
        number
    }

    /// Joins the sets of two numbers; `false` where they are one already.
    pub(crate) fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.leader(a), self.leader(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }
}
