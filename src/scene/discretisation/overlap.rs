//! Bodies that lie in each other.

use crate::error::{BoundaryError, Error};
use crate::geometry::Point;

use crate::scene::definition::scene::Scene;
use crate::scene::definition::source::BodyCells;

/// Refuses bodies of which the middle of a cell lies in another body: bonds and contacts begin at surfaces. Bodies whose
/// contact is requested may be pressed into each other at the start, which the contact itself judges.
pub(crate) fn refuse<const D: usize>(scene: &Scene<D>, all: &BodyCells<D>) -> Result<(), Error> {
    if all.len() < 2 || scene.contact_pairs.iter().any(|contact_pair| contact_pair.second.is_some()) {
        return Ok(());
    }
    let boxes: Vec<[Point<D>; 2]> = all.iter().map(|(_, cells)| bounds(cells.positions())).collect();
    for (first, (_, cells)) in all.iter().enumerate() {
        for (second, (_, others)) in all.iter().enumerate() {
            let [low, high] = boxes[second];
            let unbonded = |i: usize| boxes[first][1][i] <= low[i] || boxes[first][0][i] >= high[i];
            if first == second || (0..D).any(unbonded) {
                continue;
            }
            let inside = |x: &&Point<D>| (0..D).all(|i| x[i] > low[i] && x[i] < high[i]) && others.contains(x);
            if let Some(at) = cells.gauss(1)?.positions.iter().find(inside) {
                let name = |body: usize| scene.bodies[body].name.clone();
                let at = at.as_slice().to_vec();
                return Err(BoundaryError::Overlap { first: name(first), second: name(second), at }.into());
            }
        }
    }
    Ok(())
}

fn bounds<const D: usize>(positions: &[Point<D>]) -> [Point<D>; 2] {
    let start = [Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY)];
    positions.iter().fold(start, |[low, high], x| [low.inf(x), high.sup(x)])
}
