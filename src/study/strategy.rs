//! How the models of a search are made finer: everywhere alike, or where the error is.

use crate::scene::{Scene, Scheme};

use super::sides::Sides;

/// Measured orders are believed between these.
pub(super) const ORDERS: [f64; 2] = [0.5, 1.25];
/// Bounds of the ratio of spacings from model to model.
const FACTORS: [f64; 2] = [1.25, 2.5];
/// The next model aims at this part of the tolerance.
const AIM: f64 = 0.8;
/// No model takes more than so many times the work of all before it,
pub(super) const RUNAWAY: f64 = 4.0;
/// unless it is expected to be the last.
pub(super) const RUNAWAY_LAST: f64 = 16.0;

/// A model of a search.
pub(super) struct Model<const D: usize> {
    pub scene: Scene<D>,
    pub scheme: Scheme,
    /// Particles along each axis, or all of them.
    pub counts: Vec<usize>,
    /// The mean spacing, in parts of the body.
    pub spacing: f64,
}

/// What a search knows of its last model.
pub(super) struct Found<'a> {
    /// None but the coarsest model was solved.
    pub first: bool,
    pub bound: f64,
    pub tolerance: f64,
    pub order: f64,
    /// Particles of the last model.
    pub counts: &'a [usize],
    /// What the zones of the last model contribute to its bound.
    pub zones: &'a [f64],
    /// Most displacement unknowns of a model.
    pub unknowns: usize,
}

/// The next models of a search.
pub(super) struct Next<const D: usize> {
    /// The one to compare with; none where that is the last model.
    pub coarse: Option<Model<D>>,
    pub fine: Model<D>,
    /// Whether the tolerance is expected of it.
    pub last: bool,
}

/// How the models of a search are made finer.
pub(super) trait Strategy<const D: usize> {
    /// The coarsest model.
    fn coarsest(&self) -> Model<D>;

    /// Whether a coarsest model without a free unknown could be given more cells.
    fn thicken(&mut self) -> bool {
        false
    }

    /// The next model, and the one to compare it with; why there is none.
    fn next(&mut self, found: &Found<'_>) -> Result<Next<D>, String>;

    /// The best order in the mean spacing, by which a search is called hopeless.
    fn steepest(&self) -> f64;
}

/// Cells that are spaced alike, or graded alike.
pub(super) struct Even<'a, const D: usize> {
    scene: &'a Scene<D>,
    scheme: &'a Scheme,
    sides: Sides<D>,
    /// Of the model with half the cells.
    fineness: f64,
}

impl<'a, const D: usize> Even<'a, D> {
    pub(crate) fn new(scene: &'a Scene<D>, scheme: &'a Scheme) -> Result<Self, crate::Error> {
        Ok(Even { scene, scheme, sides: Sides::of(scene, scheme)?, fineness: 1.0 })
    }

    fn model(&self, counts: Vec<usize>) -> Model<D> {
        let spacing = self.sides.spacing(&counts);
        Model { scene: self.scene.clone(), scheme: self.sides.scheme(self.scheme, &counts), counts, spacing }
    }
}

/// The ratio of spacings to the next model, and whether that is expected to be the last.
pub(super) fn factor<const D: usize>(found: &Found<'_>) -> (f64, bool) {
    // The ratio that multiplies the work.
    let by = |times: f64| times.powf(1.0 / (1.5 * D as f64)).min(FACTORS[1]);
    let wanted = (found.bound / (AIM * found.tolerance)).powf(1.0 / found.order);
    if wanted <= by(RUNAWAY_LAST) { (wanted.max(FACTORS[0]), true) } else { (by(RUNAWAY), false) }
}

impl<const D: usize> Strategy<D> for Even<'_, D> {
    fn coarsest(&self) -> Model<D> {
        self.model(self.sides.counts(self.fineness))
    }

    fn thicken(&mut self) -> bool {
        let before = self.sides.counts(self.fineness);
        self.sides.fewest *= 2.0;
        // Drawn shapes have no sides to count along.
        if self.sides.counts(self.fineness) == before {
            self.fineness *= 2.0;
        }
        true
    }

    fn next(&mut self, found: &Found<'_>) -> Result<Next<D>, String> {
        // The first model is halved.
        let halved = found.first && !self.sides.scattered;
        let (mut factor, mut last) = if halved { (1.0, true) } else { factor::<D>(found) };
        // As much as the budget allows, where it does not allow that much.
        let unknowns = |fineness: f64| self.sides.halved(fineness).iter().fold(D, |n, &c| n.saturating_mul(c));
        while factor > FACTORS[0] && unknowns(self.fineness * factor) > found.unknowns {
            (factor, last) = ((0.95 * factor).max(FACTORS[0]), false);
        }
        self.fineness *= factor;
        // Models that round to the same counts are skipped.
        while self.sides.halved(self.fineness) == found.counts {
            self.fineness *= 1.05;
        }
        let coarse = self.sides.counts(self.fineness);
        // Drawn shapes are compared with the model before.
        let coarse = (coarse != found.counts && !self.sides.scattered).then(|| self.model(coarse));
        Ok(Next { coarse, fine: self.model(self.sides.halved(self.fineness)), last })
    }

    fn steepest(&self) -> f64 {
        ORDERS[1]
    }
}
