//! Tables referred to the configuration of a body that has expanded.

use crate::each::Each;
use crate::error::{Error, Invalid};
use crate::geometry::{Mat3, Point};

use super::ShapeTable;

/// The largest stretch of free expansion: no gel swells to more than about a thousand times its volume.
const MOST_EXPANSION: f64 = 10.0;

impl<const D: usize> ShapeTable<D> {
    /// The table of a body that would like to be larger: where it is free it expands by the stretch $\vartheta(X)$ in all directions, by
    /// heat or swelling. Its points then see the elastic part $F_e = F/\vartheta$ of the deformation alone, and measures are those
    /// of the expanded body, $\vartheta^3\mathrm d\Omega$: energies and forces are the true ones.
    ///
    /// # Errors
    /// Where the stretch is not between 0.1 and 10.
    pub(crate) fn expanding(mut self, stretch: impl Fn(&Point<D>) -> f64) -> Result<Self, Error> {
        let factors: Vec<f64> = self.positions.mapped(stretch);
        if let Some(point) = factors.iter().position(|s| !(MOST_EXPANSION.recip()..=MOST_EXPANSION).contains(s)) {
            let what = format!("stretch of free expansion at X = {:?}", self.positions[point].as_slice());
            let needed = "give the stretch itself, 1 + alpha times the change of temperature: from 0.1 to 10, a thousand times the volume";
            return Err(Invalid::new(what, factors[point], needed).into());
        }
        self.separate();
        for (point, factor) in factors.iter().enumerate() {
            let entries = self.entries(point);
            self.gradients[entries.start * self.slots..entries.end * self.slots].iter_mut().for_each(|g| *g /= factor);
            self.weights[point] *= factor.powi(3);
        }
        self.rest = factors.mapped(|factor| 1.0 / factor);
        Ok(self)
    }

    /// Gives each point gradients of its own.
    fn separate(&mut self) {
        let entries: usize = (0..self.point_count()).map(|point| self.entries(point).len()).sum();
        if !self.values.is_empty() || entries * self.slots == self.gradients.len() {
            return;
        }
        let mut gradients = Vec::with_capacity(entries * self.slots);
        let (mut starts, mut end) = (Vec::with_capacity(self.point_count()), 0);
        for point in 0..self.point_count() {
            gradients.extend_from_slice(self.gradients(point));
            starts.push(end);
            end += self.nodes(point).len();
        }
        (self.gradients, self.starts) = (gradients, starts);
    }

    /// The deformation gradient of no displacement: that of the elastic part where the body expands.
    #[inline(always)]
    pub(crate) fn at_rest(&self, point: usize) -> Mat3 {
        match self.rest.get(point) {
            None => Mat3::identity(),
            Some(&rest) => Mat3::from_diagonal_element(rest),
        }
    }
}
