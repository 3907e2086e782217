//! Spacings across the walls of regions.

use crate::error::GeometryError;
use crate::geometry::{Region, Vec2, Wall};

use super::scatter::{Scatter, expected, factor_for};
use super::triangulation::Triangulation;

/// Particles that walls may add to those asked for where nothing is said about them: more of them are the user's decision, and the walls
/// are left as they are, see [`Cells::left_thin`](super::Cells::left_thin).
pub(super) const MOST: f64 = 10_000.0;
/// Walls of regions with fewer spacings across are refined: with n averages over sub-cells leave out $1/(2n)^2$ of the energy of bending,
/// and re-entrant corners are off by up to 15 %/n.
const FEWEST: f64 = 3.0;
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
    pub(crate) fn new(region: &Region, spacing: &dyn Fn(&Vec2) -> f64) -> Result<Self, GeometryError> {
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

    /// What is said of the thinnest wall where all are left, with the spacing that it should have, at a spacing around it.
    fn left(&self, spacing: &dyn Fn(&Vec2) -> f64) -> Option<GeometryError> {
        let (wall, needed) = self.0.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let through = wall.through.unwrap_or_default();
        Some(GeometryError::ThinLeft {
            thickness: through.norm(),
            at: (wall.from + through * 0.5).as_slice().to_vec(),
            spacing: spacing(&wall.from),
            needed: *needed,
        })
    }

    /// The spacing at a place, no larger than the one given.
    pub(crate) fn spacing(&self, x: &Vec2, given: f64) -> f64 {
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
    /// than [`FEWEST`] spacings across get [`ACROSS`], unless that takes [`MOST`] particles more than asked for.
    ///
    /// # Errors
    /// As [`scattered`](Triangulation::scattered), and for walls that are much thinner than a spacing.
    pub(crate) fn walled(
        region: &Region,
        count: Option<usize>,
        spacing: impl Fn(&Vec2) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        let factor = count.map_or(Ok(1.0), |count| factor_for(region, &spacing, count))?;
        let given = |x: &Vec2| factor * spacing(x);
        let walls = Walls::new(region, &given)?;
        let refined = |x: &Vec2| walls.spacing(x, given(x));
        let is_left = !walls.is_empty() && expected(region, &refined)? > expected(region, &given)? + MOST;
        if !walls.is_empty() && !is_left {
            return Triangulation::scattered(region, refined, settings);
        }
        let mut triangles = match count {
            Some(count) => Triangulation::about(region, count, &spacing, settings)?,
            None => Triangulation::scattered(region, given, settings)?,
        };
        triangles.left = if is_left { walls.left(&given) } else { None };
        Ok(triangles)
    }
}
