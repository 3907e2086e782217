//! Which sections are one facet: those between the same two sub-cells on one face of a leaf.

use std::collections::{BTreeMap, HashMap};

use super::parts::Parts;
use super::sections::Sections;

/// Sections by the facets that they are part of; each is one of its own where a leaf beside it is a single brick.
pub(super) struct Faces {
    /// The first section of the facet of each; empty in an even lattice.
    first: Vec<u32>,
    /// All sections of facets that have several.
    all: BTreeMap<u32, Vec<u32>>,
}

impl Faces {
    pub(super) fn new(sections: &Sections, parts: &Parts) -> Self {
        let grid = &sections.grid;
        let mut faces = Faces { first: Vec::new(), all: BTreeMap::new() };
        if grid.is_even() {
            return faces;
        }
        // The axis, the smaller leaf, whether it is the one above, and the sub-cells on both sides.
        let mut known: HashMap<(u8, u32, bool, [u32; 2]), u32> = HashMap::new();
        for (number, (section, beside)) in (0u32..).zip(sections.sections.iter().zip(&parts.beside)) {
            let above = grid.place(section.brick as usize);
            let mut below = above;
            below[section.axis as usize] = (below[section.axis as usize] - 1).max(0);
            let (place, is_above) = if grid.size(above) < grid.size(below) { (above, true) } else { (below, false) };
            let mut first = number;
            if grid.size(place) > 1 {
                let leaf = grid.brick(grid.leaf(place)) as u32;
                first = *known.entry((section.axis, leaf, is_above, *beside)).or_insert(number);
            }
            if first != number {
                faces.all.entry(first).or_insert_with(|| vec![first]).push(number);
            }
            faces.first.push(first);
        }
        faces
    }

    /// The first section of the facet that a section is part of.
    pub(super) fn first(&self, section: u32) -> u32 {
        self.first.get(section as usize).copied().unwrap_or(section)
    }

    /// The sections of a facet by the first one, where there are several.
    pub(super) fn all(&self, first: u32) -> Option<&[u32]> {
        self.all.get(&first).map(Vec::as_slice)
    }
}
