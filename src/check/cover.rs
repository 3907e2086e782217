//! Where too few particles cover the body.

use crate::cells::Cells;
use crate::each::{Each, list_of};
use crate::error::{Error, GeometryError};
use crate::geometry::{Bounds, Disjoint, Point};
use crate::order;
use crate::paper::Cover;
use crate::shape::{Approximation, Scratch, ShapeFunctions};

/// Gauss points per direction and cell at which the cover is sampled, beside the particles: the loads' and bodies'
/// own points lie between them.
const SAMPLES: usize = 4;

/// Connected cells in which too few particles cover some points.
#[derive(Debug, Clone, PartialEq)]
pub struct UncoveredRegion {
    /// The cells, by rising index.
    pub cells: Vec<usize>,
    /// Corners of the smallest box around the sampled points that are uncovered \[length\].
    pub bounds: [Vec<f64>; 2],
}

/// The cover at particles and points in cells, and the regions where there is none.
pub(super) fn cover<const D: usize>(
    approximation: &dyn Approximation<D>,
    cells: &dyn Cells<D>,
) -> Result<(Cover, Vec<UncoveredRegion>), Error> {
    let points = cells.gauss(SAMPLES)?;
    let mut cover = Cover { rcond: f64::INFINITY, at: Vec::new(), lost: 0 };
    let mut scratch = Scratch::default();
    let mut psi = ShapeFunctions::default();
    let mut is_lost = |at: &Point<D>| {
        let rcond = approximation.evaluate_values(at, &mut scratch, &mut psi).map_or(0.0, |()| psi.rcond);
        if rcond < cover.rcond {
            (cover.rcond, cover.at) = (rcond, at.as_slice().to_vec());
        }
        cover.lost += usize::from(rcond == 0.0);
        rcond == 0.0
    };
    let at_particles: Vec<bool> = cells.positions().mapped(&mut is_lost);
    let mut gaps = Vec::new();
    ensure!(
        points.groups.len() == cells.cell_count() + 1,
        GeometryError::Count {
            what: "groups of points in single cells",
            count: points.groups.len().saturating_sub(1),
            needed: "Cells::gauss_in gives one for each zone"
        }
    );
    for (cell, group) in points.groups.windows(2).enumerate() {
        let corners = cells.corners(cell);
        if let Some(&count) = corners.iter().find(|&&corner| corner >= at_particles.len()) {
            let needed = "Cells::corners names particles of Cells::positions, counted from 0";
            return Err(GeometryError::Count { what: "corner of a cell", count, needed }.into());
        }
        let mut lost: Vec<Point<D>> = Vec::new();
        for &corner in &corners {
            if at_particles[corner] {
                lost.push(cells.positions()[corner]);
            }
        }
        for at in &points.positions[group[0]..group[1]] {
            if is_lost(at) {
                lost.push(*at);
            }
        }
        if !lost.is_empty() {
            gaps.push(Gap { cell, corners, lost });
        }
    }
    Ok((cover, joined(&gaps, at_particles.len())))
}

/// A cell with uncovered points.
struct Gap<const D: usize> {
    cell: usize,
    corners: Vec<usize>,
    lost: Vec<Point<D>>,
}

/// Cells that share corners, joined to regions.
fn joined<const D: usize>(gaps: &[Gap<D>], particles: usize) -> Vec<UncoveredRegion> {
    let mut sets = Disjoint::new(particles);
    for gap in gaps {
        for pair in gap.corners.windows(2) {
            sets.join(pair[0], pair[1]);
        }
    }
    // Cells without corners are regions of their own.
    let leaders = list_of(gaps.len(), |number| match gaps[number].corners.first() {
        Some(&corner) => sets.leader(corner),
        None => particles + number,
    });
    let mut regions = order::grouped(&leaders).mapped(|numbers| {
        let lost = numbers.iter().flat_map(|&number| &gaps[number].lost);
        let Bounds { low, high } = Bounds::of(lost);
        let bounds = [low.as_slice().to_vec(), high.as_slice().to_vec()];
        UncoveredRegion { cells: numbers.mapped(|&number| gaps[number].cell), bounds }
    });
    order::sort(&mut regions, &|a, b| a.cells[0].cmp(&b.cells[0]));
    regions
}
