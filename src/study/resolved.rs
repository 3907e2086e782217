//! Whether the cells of a model see the narrowest places of a body, and contacts that are about to close.

use crate::cells::Cells;
use crate::each::{Each, EachOf};
use crate::error::Error;
use crate::scene::{ContactPoint, Problem};

use super::answer::Answer;
use super::evidence::EXACT;

/// Opposite sides of a cell differ by this factor at most: beyond it displacements around a bore, which fall with the distance from its
/// middle, vary within the cell by more than its functions do, and models that all overlook the bore agree.
const TAPER: f64 = 3.0;

/// A place where cells taper too much to see a bore or a narrow end: sides of one vanish beside the opposite ones, those around the axis
/// of an axisymmetric body included. Sides of no length and bodies on the axis are none.
pub(super) fn overlooked<const D: usize>(problem: &Problem<D>) -> Option<Vec<f64>> {
    problem.discrete_bodies().iter().find_map(|body| {
        let (cells, positions) = (&**body.cells(), body.cells().positions());
        let hollow = positions.iter().all(|x| x[0] > 0.0) && !body.body().table().hoop_components().is_empty();
        let opposite = D > 1 && cells.lattice().is_some();
        let tapers = |cell: &usize| {
            let corners = cells.corners(*cell);
            hollow && differ(corners.iter().map(|&corner| positions[corner][0]))
                || opposite && sides_differ(cells, &corners)
        };
        let cell = (0..cells.cell_count()).find(tapers)?;
        Some(positions[cells.corners(cell)[0]].as_slice().to_vec())
    })
}

/// A contact that is open in a model and may close in finer ones: its least gap is no more than the part `left` of the gap's change from
/// a coarser model. Mean gaps over trace functions on a curved surface fall with the spacing. A change of rounding alone is none.
pub(super) fn may_close<const D: usize>(
    coarse: &Answer<D>,
    fine: &Answer<D>,
    left: f64,
) -> Result<Option<String>, Error> {
    for contact in &fine.problem.contacts {
        let state = |of: &Answer<D>| of.problem.contact(of.path.last(), &contact.name);
        let (before, now) = (state(coarse)?, state(fine)?);
        if now.points.iter().any(|point| point.is_active) {
            continue;
        }
        let least = |points: &[ContactPoint<D>]| points.iter().map(|point| point.gap).fold(f64::INFINITY, f64::min);
        let (before, gap) = (least(&before.points), least(&now.points));
        let (change, size) = ((before - gap).abs(), now.points.largest(|point| point.position.amax()));
        if change > EXACT * size && gap <= left * change {
            return Ok(Some(contact.name.clone()));
        }
    }
    Ok(None)
}

/// Whether the sides of a cell of a lattice along one axis differ by too much.
fn sides_differ<const D: usize>(cells: &dyn Cells<D>, corners: &[usize]) -> bool {
    let side = |from: usize, axis: usize| {
        let [a, b] = [from, from | 1 << axis].each(|corner| cells.positions()[corners[corner]]);
        (b - a).norm()
    };
    (0..D).any(|axis| differ((0..1 << D).filter(|corner| corner >> axis & 1 == 0).map(|corner| side(corner, axis))))
}

/// Whether lengths differ by too much, none of them zero.
fn differ(lengths: impl Iterator<Item = f64>) -> bool {
    let (least, most) = lengths.fold((f64::INFINITY, 0.0f64), |(least, most), l| (least.min(l), most.max(l)));
    least > 0.0 && most > TAPER * least
}
