//! How the sides of a body are divided into cells, and how these are spaced.

use std::sync::Arc;

use crate::cells::Layout;
use crate::each::{Each, EachOf, IntoEach};
use crate::error::{Error, Incompatible};
use crate::scene::{ApproximationChoice, Scene, Scheme, Source, edge_lengths};

/// Elements of order 2 stand by this power of the distance from the nearer face: corners leave even ones first order, and higher
/// powers leave cells at edges too flat to be bent hard.
const GRADED: f64 = 1.25;
/// Cells across the shortest side of the first model of a compact body.
const FIRST_ACROSS: f64 = 2.0;
/// Cells along the longest side of the first model of a thin body; spacings across that of a planar shape, as if it were a square.
const FIRST_ALONG: f64 = 6.0;
/// A body whose sides differ by more than this factor is thin.
pub(super) const THIN: f64 = 8.0;
/// Sides that differ by less than this factor get as many cells each.
const ALIKE: f64 = 2.0;
/// Spacing across a thin body relative to that along it: bending varies along, hardly across.
const ACROSS: f64 = 2.0;

/// Lengths of the sides of a body's unit cube, and how they are divided.
#[derive(Clone, Copy)]
pub(super) struct Sides<const D: usize> {
    lengths: [f64; D],
    first: f64,
    /// Longest side of those that count as thickness.
    thin: f64,
    /// Cells across a side of the first model at least.
    pub fewest: f64,
    /// A drawn shape, whose counts are the product of two.
    pub scattered: bool,
    /// Elements of order 2 take two by two cells everywhere.
    elements: bool,
}

impl<const D: usize> Sides<D> {
    pub(crate) fn of(scene: &Scene<D>, scheme: &Scheme) -> Result<Self, Error> {
        match scene.bodies.as_slice() {
            [body] => Self::of_body(&body.source, &scene.scheme_under(&body.name, scheme)),
            _ => Err(given().into()),
        }
    }

    /// Of one body of a scene.
    pub(crate) fn of_body(source: &Source<D>, scheme: &Scheme) -> Result<Self, Error> {
        if let Source::Scattered(_) = source {
            let (first, thin) = (1.0 / FIRST_ALONG, 0.0);
            return Ok(Sides { lengths: [1.0; D], first, thin, fewest: 1.0, scattered: true, elements: false });
        }
        let Source::Domain(domain) = source else { return Err(given().into()) };
        let lengths = edge_lengths(&**domain);
        let longest = lengths.largest(|x| *x);
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let first = if longest > THIN * shortest { longest / FIRST_ALONG } else { shortest / FIRST_ACROSS };
        // Sides that are nearly alike are taken as equal to the shortest, in favour of cells of any shape.
        let lengths = lengths.each(|l| if l < ALIKE * shortest { shortest } else { l });
        let elements = scheme.approximation == ApproximationChoice::Elements && scheme.order > 1;
        // A basis needs as many particles along each axis as its polynomials of one variable have terms.
        let fewest = scheme.order as f64;
        Ok(Sides { lengths, first, thin: longest / THIN, fewest, scattered: false, elements })
    }

    /// Cells along each axis, `fineness` times those of the first model: models whose cells are divided alike have errors
    /// that fall as powers of one spacing.
    fn cells(&self, fineness: f64) -> Vec<usize> {
        let spacing = self.first;
        let cells = |&length: &f64| {
            let coarser = if length < self.thin { ACROSS } else { 1.0 };
            let cells = (length / (coarser * spacing)).max(self.fewest).min(1e7);
            let even = 2.0 * (0.5 * cells).round();
            // Pressure zones take two by two: the wider one that an odd number leaves makes errors of its own, and models
            // with and without it differ by them.
            let cells = if self.scattered || D == 1 { cells.round().max(1.0) } else { even.max(2.0) };
            (cells * fineness).round() as usize
        };
        self.lengths.mapped(cells)
    }

    pub(crate) fn counts(&self, fineness: f64) -> Vec<usize> {
        self.cells(fineness).into_mapped(|cells| cells + 1)
    }

    /// The mean spacing of counts, in parts of the body.
    pub(crate) fn spacing(&self, counts: &[usize]) -> f64 {
        let cells: f64 = counts.iter().map(|&n| (n - 1) as f64).product();
        cells.powf(-1.0 / D as f64)
    }

    /// The scheme with so many particles, spaced as it suits.
    pub(crate) fn scheme(&self, scheme: Scheme, counts: &[usize]) -> Scheme {
        let scheme = scheme.particles(counts);
        if !(self.elements && D > 1 && matches!(scheme.layout, Layout::Regular)) {
            return scheme;
        }
        let elements: Vec<f64> = counts.mapped(|&n| ((n - 1) / 2) as f64);
        // Middle nodes stay in the middle.
        scheme.layout(Layout::Graded(Arc::new(move |axis, t| {
            let x = t * elements[axis];
            let element = (x + 1e-9).floor().min(elements[axis] - 1.0);
            let [a, b] = [element, element + 1.0].each(|x| graded(x / elements[axis]));
            a + (b - a) * (x - element)
        })))
    }
}

/// Refuses cells that can't be made finer.
fn given() -> Incompatible {
    let remedy = "give the body as a block, mapped block, region, closed surface or mesh";
    Incompatible::new("sizing to a tolerance", "cells given by the user", remedy)
}

/// Places between 0 and 1 that crowd towards both.
fn graded(t: f64) -> f64 {
    let half = |t: f64| 0.5 * (2.0 * t).powf(GRADED);
    if t <= 0.5 { half(t) } else { 1.0 - half(1.0 - t) }
}
