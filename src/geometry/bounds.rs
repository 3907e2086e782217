//! Boxes along the axes.

use super::Point;

/// A box along the axes, from its lowest to its highest corner; nothing where these are infinite the other way round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds<const D: usize> {
    pub(crate) low: Point<D>,
    pub(crate) high: Point<D>,
}

impl<const D: usize> Bounds<D> {
    /// No box.
    pub(crate) fn none() -> Self {
        Bounds { low: Point::repeat(f64::INFINITY), high: Point::repeat(f64::NEG_INFINITY) }
    }

    /// The box of some points.
    pub(crate) fn of<'a>(points: impl IntoIterator<Item = &'a Point<D>>) -> Self {
        let mut bounds = Bounds::none();
        for x in points {
            bounds = bounds.join(&Bounds { low: *x, high: *x });
        }
        bounds
    }

    /// The box of two boxes.
    pub(crate) fn join(&self, other: &Self) -> Self {
        Bounds { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Lengths of the sides.
    pub(crate) fn extent(&self) -> Point<D> {
        self.high - self.low
    }

    /// The part that two boxes have in common; nothing where they have none.
    pub(crate) fn common(&self, other: &Self) -> Self {
        Bounds { low: self.low.sup(&other.low), high: self.high.inf(&other.high) }
    }

    /// The box and a margin along each axis.
    pub(crate) fn widened(&self, margin: &Point<D>) -> Self {
        Bounds { low: self.low - margin, high: self.high + margin }
    }

    /// The box and a margin, in parts of its sides.
    pub(crate) fn grown(&self, part: f64) -> Self {
        self.widened(&(self.extent() * part))
    }

    /// The middle of the box.
    pub(crate) fn middle(&self) -> Point<D> {
        (self.low + self.high) * 0.5
    }

    /// Whether a point lies in the box.
    pub(crate) fn holds(&self, x: &Point<D>) -> bool {
        (0..D).all(|i| self.low[i] <= x[i] && x[i] <= self.high[i])
    }

    /// Whether two boxes have a point in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        (0..D).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }

    /// The distance of a point from the box.
    pub(crate) fn distance(&self, x: &Point<D>) -> f64 {
        (self.low - x).sup(&(x - self.high)).map(|away| away.max(0.0)).norm()
    }
}
