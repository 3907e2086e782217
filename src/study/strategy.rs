//! How the models of a search are made finer: everywhere alike, or where the error is.

use crate::scene::{Scene, Scheme};

use super::sides::Sides;

/// Measured orders of bounds are believed between these.
pub(super) const ORDERS: [f64; 2] = [0.5, 1.25];
/// No model takes more than so many times the work of all before it.
pub(super) const RUNAWAY: f64 = 16.0;

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
    /// Particles of the last model.
    pub counts: &'a [usize],
    /// What the zones of the last model contribute to its bound.
    pub zones: &'a [f64],
}

/// The next models of a search.
pub(super) struct Next<const D: usize> {
    /// The one to compare with; none where that is the last model.
    pub coarse: Option<Model<D>>,
    pub fine: Model<D>,
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

    /// Whether all cells are divided alike, so that values are extrapolated from model to model.
    fn is_uniform(&self) -> bool {
        true
    }
}

/// Cells that are spaced alike, or graded alike.
pub(super) struct Even<'a, const D: usize> {
    scene: &'a Scene<D>,
    scheme: &'a Scheme,
    sides: Sides<D>,
    /// Of the last model.
    fineness: f64,
}

impl<'a, const D: usize> Even<'a, D> {
    pub(crate) fn new(scene: &'a Scene<D>, scheme: &'a Scheme) -> Result<Self, crate::Error> {
        Ok(Even { scene, scheme, sides: Sides::of(scene, scheme)?, fineness: 1.0 })
    }

    fn model(&self, counts: Vec<usize>) -> Model<D> {
        let (sides, along) = (self.sides, counts.clone());
        let name = self.scene.bodies.first().map_or("", |body| &body.name);
        // Behind changes of the body's own, which may be of its particles.
        let scene = self.scene.clone().scheme_of(name, move |scheme| sides.scheme(scheme, &along));
        Model { scene, scheme: self.scheme.clone(), spacing: sides.spacing(&counts), counts }
    }
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
        // Models that round to the same counts are skipped.
        while self.sides.counts(self.fineness) == found.counts {
            self.fineness = finer(self.fineness, self.sides.scattered);
        }
        Ok(Next { coarse: None, fine: self.model(self.sides.counts(self.fineness)) })
    }
}

/// The next of 1, 2, 3, 4, 6, 8, 12 and so on, whatever is requested; shapes without sides to divide alike have 3/2 between 1 and 2.
pub(super) fn finer(fineness: f64, scattered: bool) -> f64 {
    if fineness < 2.0 && !scattered {
        return 2.0;
    }
    let power = fineness.log2().floor().exp2();
    if fineness < 1.5 * power { 1.5 * power } else { 2.0 * power }
}
