//! Walls of regions: where the outline faces away from itself.

use super::{Region, Vec2};
use crate::each::EachOf;

/// Cosine of the angle within which sides of a wall face away from each other, 10°.
pub(crate) const OPPOSITE: f64 = 0.985;
/// Rounding, as a part of a side and of the largest thickness.
const EDGE: f64 = 1e-9;
/// Pieces of one line beyond which walls are not looked for: particles that close together would not fit into memory.
const MOST: f64 = 1e5;

/// Some of a wall: the middle of a piece of one side, what leads from it to the other side, and half the length of the piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    pub(crate) from: Vec2,
    /// None where the other side is farther than asked for.
    pub(crate) through: Option<Vec2>,
    pub(crate) reach: f64,
}

impl Region {
    /// All pieces of the outline no longer than a quarter of a length that depends on the place, with the walls thinner than that length
    /// that are seen along their normals.
    pub(crate) fn walls(&self, thinner: &dyn Fn(&Vec2) -> f64) -> Vec<Wall> {
        let mut found = Vec::new();
        for (own, &(a, b)) in self.chords.iter().enumerate() {
            let length = (b - a).norm();
            let inward = Vec2::new(a[1] - b[1], b[0] - a[0]) / length;
            let limits = [a, (a + b) * 0.5, b].each(|x| thinner(&x));
            let pieces = (length / limits.into_iter().fold(f64::INFINITY, f64::min) * 4.0).ceil();
            if !(pieces <= MOST) {
                continue;
            }
            for k in 0..pieces as usize {
                let from = a + (b - a) * ((k as f64 + 0.5) / pieces);
                let through = self.through(own, &from, &inward, thinner(&from)).map(|distance| inward * distance);
                found.push(Wall { from, through, reach: 0.5 * length / pieces });
            }
        }
        found
    }

    /// The distance from a point of a chord along a direction to the other side of a wall there.
    fn through(&self, own: usize, from: &Vec2, along: &Vec2, thinner: f64) -> Option<f64> {
        let mut nearest: Option<(f64, f64)> = None;
        for (_, &(a, b)) in self.chords.iter().enumerate().filter(|(chord, _)| *chord != own) {
            let (side, off) = (b - a, a - from);
            let steep = along.perp(&side);
            let (distance, share) = (off.perp(&side) / steep, off.perp(along) / steep);
            let crosses = (-EDGE..=1.0 + EDGE).contains(&share) && distance > EDGE * thinner && distance < thinner;
            if crosses && nearest.is_none_or(|known| distance < known.0) {
                nearest = Some((distance, steep.abs() / side.norm()));
            }
        }
        nearest.filter(|(_, steep)| *steep > OPPOSITE).map(|(distance, _)| distance)
    }
}
