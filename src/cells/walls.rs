//! Spacings across the walls of regions.

use crate::error::GeometryError;
use crate::geometry::{Point, Region, Wall};

use super::scatter::{Scatter, factor_for};
use super::triangulation::Triangulation;

/// Walls of regions with fewer spacings across are refined: with one, no particle in the middle is free where both faces are fixed.
const FEWEST: f64 = 2.0;
/// Spacings across walls of regions that are refined: with n the error of re-entrant corners falls as 1/n, and averages over sub-cells leave
/// out $1/(2n)^2$ of the energy of bending.
const ACROSS: usize = 6;
/// Smallest spacing in walls over the one asked for. Walls that need a smaller one are an error; where a body tapers off spacings stay at
/// this one.
const FINEST: f64 = 1.0 / 32.0;
/// Part of a spacing by which one may be below it: rounding.
const SLACK: f64 = 1e-9;
/// Growth of the spacing with the distance from a wall.
const GROWTH: f64 = 0.25;
/// Spacings within which a body that tapers off is thicker, or ends: particles there follow it.
const NEAR: f64 = 2.0;

/// The walls of a region that are thinner than [`FEWEST`] spacings, with the spacings that they get.
pub(crate) struct Walls(Vec<(Wall, f64)>);

impl Walls {
    /// Those that a spacing leaves less than [`FEWEST`] of it.
    ///
    /// # Errors
    /// For a wall that is much thinner than a spacing.
    pub(crate) fn new(region: &Region, spacing: &dyn Fn(&Point<2>) -> f64) -> Result<Self, GeometryError> {
        let across = ACROSS as f64;
        let all = region.walls(&|x| FEWEST * spacing(x));
        let thickness = |wall: &Wall| wall.through.map(|through| through.norm());
        let least = |wall: &Wall| across * FINEST * spacing(&wall.from) * (1.0 - SLACK);
        let too_thin = |wall: &&Wall| thickness(wall).is_some_and(|own| own < least(wall));
        let is_followed = |wall: &Wall| {
            let within = NEAR * spacing(&wall.from);
            let near = |other: &&Wall| (other.from - wall.from).norm() <= within;
            all.iter().filter(near).any(|other| !too_thin(&other))
        };
        let thinnest = |a: &&Wall, b: &&Wall| thickness(a).unwrap_or(0.0).total_cmp(&thickness(b).unwrap_or(0.0));
        if let Some(wall) = all.iter().filter(too_thin).filter(|wall| !is_followed(wall)).min_by(thinnest) {
            let own = thickness(wall).unwrap_or(0.0);
            let at = (wall.from + wall.through.unwrap_or_default() * 0.5).as_slice().to_vec();
            let (spacing, needed) = (spacing(&wall.from), own / (across * FINEST));
            return Err(GeometryError::WallAcross { thickness: own, at, across: ACROSS, spacing, needed });
        }
        let wanted = |wall: &Wall| thickness(wall).map(|own| (*wall, own.max(least(wall)) / across));
        Ok(Walls(all.iter().filter_map(wanted).collect()))
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The spacing at a place, no larger than the one given.
    pub(crate) fn spacing(&self, x: &Point<2>, given: f64) -> f64 {
        let near = |(wall, own): &(Wall, f64)| {
            let (off, through) = (x - wall.from, wall.through.unwrap_or_default());
            let share = (off.dot(&through) / through.norm_squared()).clamp(0.0, 1.0);
            own + GROWTH * ((off - through * share).norm() - wall.reach).max(0.0)
        };
        self.0.iter().map(near).fold(given, f64::min)
    }
}

impl Triangulation {
    /// Scatters particles, a largest spacing apart or, where a number is given, as many as that and what walls need more. Walls with less
    /// than [`FEWEST`] spacings across get [`ACROSS`].
    ///
    /// # Errors
    /// As [`scattered`](Triangulation::scattered), and for walls that are much thinner than a spacing.
    pub(crate) fn walled(
        region: &Region,
        count: Option<usize>,
        spacing: impl Fn(&Point<2>) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        let factor = count.map_or(Ok(1.0), |count| factor_for(region, &spacing, count))?;
        let given = |x: &Point<2>| factor * spacing(x);
        let walls = Walls::new(region, &given)?;
        match count {
            Some(count) if walls.is_empty() => Triangulation::about(region, count, spacing, settings),
            _ => Triangulation::scattered(region, |x| walls.spacing(x, given(x)), settings),
        }
    }
}
