//! Where the unknowns of a model and multipliers stand in the reduced system.

use crate::assembly::Pattern;
use crate::each::Each;

use super::enforced::Eliminated;

/// The numbers of unknowns of the model, behind which those of the multipliers follow, and their places in the reduced system.
pub(super) struct Numbering {
    /// Block and row in it of each unknown of the model that a block expresses.
    pub rows: Vec<Option<[u32; 2]>>,
    /// Place by number; `u32::MAX` for unknowns that have none.
    pub places: Vec<u32>,
    /// Number by place.
    pub numbers: Vec<u32>,
}

impl Numbering {
    pub(super) fn new(unknowns: usize, eliminated: &[Eliminated], multipliers: usize) -> Self {
        let mut rows = vec![None; unknowns];
        for (b, block) in eliminated.iter().enumerate() {
            for (p, &unknown) in block.unknowns.iter().enumerate() {
                rows[unknown] = Some([b as u32, p as u32]);
            }
        }
        let mut places: Vec<u32> = rows.mapped(|row| if row.is_some() { u32::MAX } else { 0 });
        eliminated.iter().flat_map(|block| &block.free).for_each(|&unknown| places[unknown] = 0);
        places.resize(unknowns + multipliers, 0);
        let numbers: Vec<u32> = (0..places.len() as u32).filter(|&k| places[k as usize] == 0).collect();
        let mut numbering = Numbering { rows, places, numbers };
        numbering.place();
        numbering
    }

    fn place(&mut self) {
        for (place, &number) in self.numbers.iter().enumerate() {
            self.places[number as usize] = place as u32;
        }
    }

    /// The number of unknowns of the model.
    pub(super) fn unknowns(&self) -> usize {
        self.rows.len()
    }

    /// Renumbers so that place `order[k]` becomes `k`.
    pub(super) fn renumber(&mut self, order: &[usize]) {
        self.numbers = order.mapped(|&old| self.numbers[old]);
        self.place();
    }

    /// What a vector over the unknowns of the model has at places: at unknowns that no block expresses, zero elsewhere.
    pub(super) fn kept(&self, full: &[f64]) -> impl Iterator<Item = f64> {
        self.numbers.iter().map(|&number| match self.rows.get(number as usize) {
            Some(None) => full[number as usize],
            _ => 0.0,
        })
    }

    /// The place in the reduced pattern of each entry of that of the model between unknowns that no block expresses; `u32::MAX` for others.
    pub(super) fn destinations(&self, pattern: &Pattern, reduced: &Pattern) -> Vec<u32> {
        let mut destinations = vec![u32::MAX; pattern.entries()];
        for column in (0..pattern.size()).filter(|&column| self.rows[column].is_none()) {
            // Both columns are sorted: walk along instead of searching.
            let mut at = reduced.columns[self.places[column] as usize];
            for (entry, &row) in (pattern.columns[column]..).zip(pattern.column(column)) {
                if self.rows[row as usize].is_none() {
                    while reduced.rows[at] < self.places[row as usize] {
                        at += 1;
                    }
                    destinations[entry] = at as u32;
                }
            }
        }
        destinations
    }
}
