//! Bodies that lie in each other.

use crate::each::Each;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Bounds, Point};

use crate::scene::{BodyCells, Place, Scene};

/// Refuses bodies of which the middle of a cell lies in another body: bonds and contacts begin at surfaces. Bodies whose
/// interference is resolved may begin as deep in each other as they are drawn. Contact without one looks for faces a chord and a half deep,
/// so that bodies deeper in each other would pass by unseen.
pub(crate) fn refuse<const D: usize>(scene: &Scene<D>, all: &BodyCells<D>) -> Result<(), Error> {
    if all.len() < 2 {
        return Ok(());
    }
    let fits = fits(scene, all);
    let boxes: Vec<Bounds<D>> = all.mapped(|(_, cells)| Bounds::of(cells.positions()));
    for (first, (_, cells)) in all.iter().enumerate() {
        for (second, (_, others)) in all.iter().enumerate() {
            let Bounds { low, high } = boxes[second];
            let apart = |i: usize| boxes[first].high[i] <= low[i] || boxes[first].low[i] >= high[i];
            let fitted = fits.contains(&[first, second]) || fits.contains(&[second, first]);
            if first == second || fitted || (0..D).any(apart) {
                continue;
            }
            let inside = |x: &&Point<D>| (0..D).all(|i| x[i] > low[i] && x[i] < high[i]) && others.encloses(x);
            if let Some(at) = cells.gauss(1)?.positions.iter().find(inside) {
                let name = |body: usize| scene.bodies[body].name.clone();
                let at = at.as_slice().to_vec();
                return Err(BoundaryError::Overlap { first: name(first), second: name(second), at }.into());
            }
        }
    }
    Ok(())
}

/// The bodies that contacts with an interference press into each other. Places that do not exist are refused with the contacts.
fn fits<const D: usize>(scene: &Scene<D>, all: &BodyCells<D>) -> Vec<[usize; 2]> {
    let body = |place: &Place<D>| scene.touching(place, all).ok().map(|found| found.0);
    let pairs = scene.contact_pairs.iter().chain(&scene.released).filter(|pair| pair.interference.is_some());
    pairs.filter_map(|pair| Some([body(&pair.first)?, body(pair.second.as_ref()?)?])).collect()
}
