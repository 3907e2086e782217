//! Places of a grid of cubes, and points by the cube that they lie in.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::Point;
use crate::each::array_of;

/// A hash of whole numbers: several times faster than the standard one, and the same in every run.
#[derive(Default)]
pub(crate) struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(u64::from(byte)));
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(23) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

/// A map whose keys are whole numbers.
pub(crate) type Places<K, V> = HashMap<K, V, BuildHasherDefault<Mixed>>;

/// The places of a box from its lowest to its highest one, axis 0 running fastest.
pub(crate) fn places<const D: usize>(low: [i32; D], high: [i32; D]) -> impl Iterator<Item = [i32; D]> {
    let counts: [usize; D] = array_of(|i| (high[i] - low[i] + 1).max(0) as usize);
    (0..counts.iter().product()).map(move |mut rest: usize| {
        array_of(|i| {
            let at = low[i] + (rest % counts[i]) as i32;
            rest /= counts[i];
            at
        })
    })
}

/// Items by the cubes of a side that their points lie in.
pub(crate) struct Cubes<const D: usize, T> {
    side: f64,
    items: Places<[i32; D], Vec<T>>,
}

impl<const D: usize, T> Cubes<D, T> {
    pub(crate) fn new(side: f64) -> Self {
        Cubes { side, items: Places::default() }
    }

    fn cube(&self, x: &Point<D>, shift: f64) -> [i32; D] {
        array_of(|i| ((x[i] + shift) / self.side).floor() as i32)
    }

    pub(crate) fn add(&mut self, x: &Point<D>, item: T) {
        self.items.entry(self.cube(x, 0.0)).or_default().push(item);
    }

    /// Items among which are all whose points are no farther from a point.
    pub(crate) fn near(&self, x: &Point<D>, distance: f64) -> impl Iterator<Item = &T> {
        let cubes = places(self.cube(x, -distance), self.cube(x, distance));
        cubes.filter_map(|cube| self.items.get(&cube)).flatten()
    }
}
