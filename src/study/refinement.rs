//! Local refinement where the error is.

use std::sync::Arc;
use std::time::Instant;

use crate::cells::{Cells, Refined};
use crate::each::EachOf;
use crate::error::{Error, GeometryError, Incompatible};
use crate::scene::{Scene, Scheme};

use super::answer::{Answer, Budget, Tolerance};
use super::nested::check;
use super::progress::Limits;
use super::sides::THIN;
use super::sizing::search;
use super::strategy::{Found, Model, Next, Strategy};

/// Part of all zones' contributions that the refined macro cells carry (Dörfler's bulk criterion).
const BULK: f64 = 0.5;
/// Cells along the shortest side of the first lattice; the others have in proportion, so that cells are nearly square.
const FIRST: f64 = 4.0;

impl Scene<2> {
    /// Solves the scene within a tolerance on macro cells that are refined one by one where the error is, by request: never chosen by
    /// itself, since thin bodies need other cells.
    ///
    /// Bounds and their order are those of [`solve_within_by`](Scene::solve_within_by): each model has every macro cell of
    /// a coarser one cut into four, and is compared with that. The parts of $\eta$ of the four zones in place of a macro
    /// cell are its indicator. The macro cells of the coarser model with the largest ones that sum to half of all are cut, neighbours so
    /// that they differ by one halving at most; cells are no smaller than 1/16 of the coarsest ones of the answer's model.
    /// Tolerances below a few tenths of a per cent take more models than the default [`Budget`] allows.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]]; // mm
    /// let membrane = Scene::new(Quadrilateral { corners }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
    ///     .hold((0, Side::Min))
    ///     .traction((0, Side::Max), [0.0, 6.25]);
    /// let tip = Tolerance::of(Quantity::displacement([48.0, 60.0], 1), 0.01);
    /// let answer = membrane.solve_within_locally(&Scheme::default(), &tip, Budget::default())?;
    /// assert!(answer.reached() && (answer.values()[0] / 6.9355 - 1.0).abs() < 0.01);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`solve_within_by`](Scene::solve_within_by), and for thin bodies.
    pub fn solve_within_locally(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<2>,
        budget: Budget,
    ) -> Result<Answer<2>, Error> {
        check(tolerance)?;
        let refused = |with, remedy| Err(Incompatible::new("local refinement", with, remedy).into());
        let (Some(lengths), Some(domain)) = (self.side_lengths(), self.domain()) else {
            return refused("cells that do not form a block", "take Scene::solve_within, which refines them evenly");
        };
        let shortest = lengths[0].min(lengths[1]);
        if lengths[0].max(lengths[1]) > THIN * shortest {
            return refused(
                "a body with one side more than eight times as long as another",
                "take Scene::solve_within",
            );
        }
        let even = |length: f64| 2 * (0.5 * FIRST * length / shortest).round() as usize;
        let cells = Refined::new(domain, lengths.each(even))?;
        let local = Local { scene: self, scheme, cells, parents: Vec::new() };
        let start = Instant::now();
        search(local, tolerance, budget, &mut Limits::new(&mut (), budget, &|| start.elapsed()))
    }
}

/// Macro cells that are cut where the error is.
struct Local<'a> {
    scene: &'a Scene<2>,
    scheme: &'a Scheme,
    /// Of the coarser model.
    cells: Refined,
    /// For each macro cell of the finer model, the one of the coarser model that it is part of.
    parents: Vec<usize>,
}

impl Local<'_> {
    fn model(&self, cells: Refined) -> Model<2> {
        let (counts, spacing) = (vec![cells.positions().len()], 1.0 / (cells.cell_count() as f64).sqrt());
        Model { scene: self.scene.with_cells(Arc::new(cells)), scheme: self.scheme.clone(), counts, spacing }
    }

    /// What each macro cell of the coarser model contributes; nothing where it can't be cut any more.
    fn indicators(&self, zones: &[f64]) -> Vec<f64> {
        let mut indicators = vec![0.0; self.cells.refinable().count()];
        // Zones are macro cells, or parts of them in their order.
        for (zone, part) in zones.iter().enumerate() {
            indicators[self.parents[zone * self.parents.len() / zones.len()]] += part;
        }
        // What can't be cut must not fill the bulk.
        let cut = self.cells.refinable_twice();
        indicators.iter_mut().zip(cut).filter(|(_, cut)| !cut).for_each(|(indicator, _)| *indicator = 0.0);
        indicators
    }
}

impl Strategy<2> for Local<'_> {
    fn coarsest(&self) -> Model<2> {
        self.model(self.cells.clone())
    }

    fn next(&mut self, found: &Found<'_>) -> Result<Next<2>, String> {
        let refused = |error: GeometryError| format!("the cells can't be refined: {error}");
        if !found.first {
            let marked = marked(&self.indicators(found.zones));
            if marked.is_empty() {
                return Err("the smallest spacing is reached: 1/16 of the coarsest".to_string());
            }
            self.cells = self.cells.refined(&marked).map_err(refused)?;
        }
        let all: Vec<usize> = (0..self.cells.refinable().count()).collect();
        let fine = self.cells.refined(&all).map_err(refused)?;
        self.parents = self.cells.parents(&fine);
        let coarse = (!found.first).then(|| self.model(self.cells.clone()));
        Ok(Next { coarse, fine: self.model(fine) })
    }

    fn is_uniform(&self) -> bool {
        false
    }
}

/// The largest indicators that sum to the bulk of all.
fn marked(indicators: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..indicators.len()).collect();
    crate::order::sort(&mut order, &|&a, &b| indicators[b].total_cmp(&indicators[a]));
    let total: f64 = indicators.iter().sum();
    let mut sum = 0.0;
    let mut marked = Vec::new();
    for zone in order {
        // What contributes nothing is never cut.
        if sum >= BULK * total || !(indicators[zone] > 0.0) {
            break;
        }
        sum += indicators[zone];
        marked.push(zone);
    }
    marked
}
