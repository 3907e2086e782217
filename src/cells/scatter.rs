//! Scattered particles: on the boundary by the local spacing, inside as blue noise that is then relaxed.

use std::f64::consts::TAU;

use crate::each::Each;
use crate::error::{GeometryError, Invalid};
use crate::geometry::{Cubes, Curve, Region, Vec2};

use super::mesh::{Mesh, Piece, cross};

/// How particles are scattered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Scatter {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Rounds of moves to the middle of the surrounding triangles; none leaves blue noise.
    pub relaxations: usize,
}

impl Default for Scatter {
    /// Seed 0; four rounds, after which further ones hardly change the triangles.
    fn default() -> Self {
        Scatter { seed: 0, relaxations: 4 }
    }
}

/// Smallest distance of particles as a part of the spacing: maximal sets at distance r hold about 0.7 / r² particles
/// per area (random sequential addition of discs covers 0.547), triangles of side h hold 1.155 / h².
const CLOSEST: f64 = 0.78;
/// A particle farther than this part of a chord from both its ends is outside of the chord's diametral circle, so that
/// the triangle on the chord has its circumcentre inside.
const CLEAR: f64 = 0.72;
/// Tries around a particle before it is given up (Bridson 2007 takes 30; relaxation fills what is left).
const TRIES: usize = 20;
/// Particles beyond which a spacing is refused, so that a mistyped one is an error and not a crash.
const LIMIT: f64 = 2e7;
/// Least spacing relative to the smallest that samples find.
const DIP: f64 = 0.01;
/// Samples per axis of the integral of the density.
const SAMPLES: usize = 160;

/// A spacing function whose values are checked where it is evaluated.
pub(crate) struct Spacing<'a> {
    pub function: &'a dyn Fn(&Vec2) -> f64,
    pub factor: f64,
    /// Below this it is refused.
    pub floor: f64,
}

impl<'a> Spacing<'a> {
    pub(crate) fn of(function: &'a dyn Fn(&Vec2) -> f64, factor: f64) -> Self {
        Spacing { function, factor, floor: 0.0 }
    }

    fn at(&self, x: &Vec2) -> Result<f64, GeometryError> {
        let h = self.factor * (self.function)(x);
        if h > 0.0 && h >= self.floor && h.is_finite() {
            Ok(h)
        } else if h > 0.0 && h < self.floor {
            let needed = "let the spacing vary more slowly: between places a hundredth of the shape apart it falls to a hundredth";
            Err(Invalid::new("particle spacing", h, needed).into())
        } else {
            let needed = "give finite lengths above zero everywhere in the region";
            Err(Invalid::new("particle spacing", h, needed).into())
        }
    }

    /// Particles expected inside, $\int\mathrm dA/(\tfrac{\sqrt3}2h^2)$, and for the boundary, $\tfrac12\oint\mathrm ds/h$, and the
    /// smallest spacing.
    fn expected(&self, region: &Region) -> Result<([f64; 2], f64), GeometryError> {
        let step = (region.max - region.min) / SAMPLES as f64;
        let (mut inner, mut smallest, mut seen) = (0.0, f64::INFINITY, 0.0);
        for k in 0..SAMPLES * SAMPLES {
            let offset = Vec2::new((k % SAMPLES) as f64 + 0.5, (k / SAMPLES) as f64 + 0.5);
            let x = region.min + offset.component_mul(&step);
            if region.contains(&x) {
                let h = self.at(&x)?;
                inner += 1.0 / (h * h);
                seen += 1.0;
                smallest = smallest.min(h);
            }
        }
        let mut along = 0.0;
        for (curve, _) in region.loops.iter().flatten() {
            for k in 0..SAMPLES {
                let h = self.at(&curve.at((k as f64 + 0.5) / SAMPLES as f64))?;
                along += curve.length() / (SAMPLES as f64 * h);
                smallest = smallest.min(h);
            }
        }
        let inner = if seen > 0.0 { inner * region.area() / (seen * 0.75f64.sqrt()) } else { 0.0 };
        Ok(([inner, 0.5 * along], smallest))
    }
}

/// The factor on a spacing function that gives about `count` particles.
pub(crate) fn factor_for(region: &Region, function: &dyn Fn(&Vec2) -> f64, count: usize) -> Result<f64, GeometryError> {
    // Homogeneous in the factor: a / f² + b / f + 1 = count.
    let ([a, b], _) = Spacing::of(function, 1.0).expected(region)?;
    let wanted = (count as f64 - 1.0).max(2.0);
    Ok((b + (b * b + 4.0 * a * wanted).sqrt()) / (2.0 * wanted))
}

/// About how many particles a spacing gives a region.
pub(crate) fn expected(region: &Region, function: &dyn Fn(&Vec2) -> f64) -> Result<f64, GeometryError> {
    let ([inside, outline], _) = Spacing::of(function, 1.0).expected(region)?;
    Ok(inside + outline + 1.0)
}

/// Scatters particles over a region.
pub(crate) fn scatter(region: &Region, spacing: &Spacing<'_>, settings: &Scatter) -> Result<Mesh, GeometryError> {
    let ([inside, outline], smallest) = spacing.expected(region)?;
    let expected = inside + outline + 1.0;
    check_count(expected)?;
    ensure!(
        !(smallest > region.extent()),
        Invalid::new("particle spacing", smallest, "give a spacing below the smaller extent of the shape")
    );
    // A dip between the samples has no end: particles crowd into it.
    let spacing = &Spacing { floor: DIP * smallest, ..*spacing };
    let (mut positions, pieces) = boundary(region, spacing)?;
    let fixed = positions.len();
    let spacings = positions.try_mapped(|x| spacing.at(x));
    let mut bins = bins(region, expected);
    positions.iter().enumerate().for_each(|(particle, x)| bins.add(x, particle));
    blue_noise(region, spacing, settings.seed, &mut positions, spacings?, &mut bins)?;
    let mut mesh = Mesh::new(positions, pieces)?;
    let chords = Chords::new(&mesh, region);
    for _ in 0..settings.relaxations {
        relax(&mut mesh, fixed, region, spacing, &chords)?;
        mesh = Mesh::new(mesh.positions, mesh.pieces)?;
    }
    Ok(mesh)
}

fn check_count(count: f64) -> Result<(), GeometryError> {
    let needed = "raise the spacing: at most 2e7 are accepted";
    ensure!(!(count > LIMIT), GeometryError::Count { what: "particles in the region", count: count as usize, needed });
    Ok(())
}

/// Particles on the boundary.
fn boundary(region: &Region, spacing: &Spacing<'_>) -> Result<(Vec<Vec2>, Vec<Piece>), GeometryError> {
    let mut positions = Vec::new();
    let mut pieces = Vec::new();
    for curves in &region.loops {
        let first = positions.len() as u32;
        for (index, (curve, part)) in curves.iter().enumerate() {
            let here = positions.len() as u32;
            positions.push(curve.at(0.0));
            let curved = matches!(curve, Curve::Arc { .. });
            // Weak constraint equations need a particle inside each line and three inside each arc.
            let least = if curved { curve.chords(region.tolerance).max(4) } else { 2 };
            positions.extend(divide(curve, spacing, least)?);
            let mut particles: Vec<u32> = (here..positions.len() as u32).collect();
            particles.push(if index + 1 == curves.len() { first } else { positions.len() as u32 });
            pieces.push(Piece { part: *part, particles, curved });
        }
    }
    Ok((positions, pieces))
}

/// Points inside a curve at equal steps of $\int\mathrm ds/h$.
fn divide(curve: &Curve, spacing: &Spacing<'_>, least: usize) -> Result<Vec<Vec2>, GeometryError> {
    // Enough samples that the sum changes by far less than one particle.
    const STEPS: usize = 4000;
    let mut sums = Vec::with_capacity(STEPS + 1);
    let mut sum = 0.0;
    sums.push(0.0);
    for k in 0..STEPS {
        sum += curve.length() / STEPS as f64 / spacing.at(&curve.at((k as f64 + 0.5) / STEPS as f64))?;
        sums.push(sum);
    }
    let count = (sum.round() as usize).max(least);
    Ok((1..count)
        .map(|k| {
            let wanted = sum * k as f64 / count as f64;
            let above = sums.partition_point(|s| *s < wanted).clamp(1, STEPS);
            let part = (wanted - sums[above - 1]) / (sums[above] - sums[above - 1]);
            curve.at((above as f64 - 1.0 + part) / STEPS as f64)
        })
        .collect())
}

/// Cubes for about so many particles, one in each.
fn bins(region: &Region, expected: f64) -> Cubes<2, usize> {
    let extent = region.max - region.min;
    Cubes::new((extent[0] * extent[1] / expected.max(16.0)).sqrt())
}

/// Fills the region with particles at least [`CLOSEST`] spacings apart (Bridson 2007, with a local distance).
fn blue_noise(
    region: &Region,
    spacing: &Spacing<'_>,
    seed: u64,
    positions: &mut Vec<Vec2>,
    mut spacings: Vec<f64>,
    bins: &mut Cubes<2, usize>,
) -> Result<(), GeometryError> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut active: Vec<u32> = (0..positions.len() as u32).collect();
    while !active.is_empty() {
        let chosen = random.usize(..active.len());
        let parent = active[chosen] as usize;
        let mut placed = false;
        for _ in 0..TRIES {
            let radius = CLOSEST * spacings[parent] * (1.0 + random.f64());
            let angle = TAU * random.f64();
            let x = positions[parent] + Vec2::new(angle.cos(), angle.sin()) * radius;
            if (0..2).any(|i| x[i] <= region.min[i] || x[i] >= region.max[i]) {
                continue;
            }
            let h = spacing.at(&x)?;
            let close = bins.near(&x, CLOSEST * h).any(|other| (positions[*other] - x).norm() < CLOSEST * h);
            if close || !region.contains(&x) {
                continue;
            }
            active.push(positions.len() as u32);
            bins.add(&x, positions.len());
            positions.push(x);
            spacings.push(h);
            placed = true;
            break;
        }
        if !placed {
            active.swap_remove(chosen);
        }
        check_count(positions.len() as f64)?;
    }
    Ok(())
}

/// Boundary particles with the longer of their chords.
struct Chords {
    bins: Cubes<2, usize>,
    lengths: Vec<f64>,
    longest: f64,
}

impl Chords {
    fn new(mesh: &Mesh, region: &Region) -> Self {
        let fixed = mesh.pieces.iter().flat_map(|p| &p.particles).max().map_or(0, |&p| p as usize + 1);
        let mut lengths = vec![0.0f64; fixed];
        for pair in mesh.pieces.iter().flat_map(|piece| piece.particles.windows(2)) {
            let length = (mesh.positions[pair[1] as usize] - mesh.positions[pair[0] as usize]).norm();
            for &p in pair {
                lengths[p as usize] = lengths[p as usize].max(length);
            }
        }
        let mut bins = bins(region, fixed as f64 * fixed as f64 / 16.0);
        mesh.positions[..fixed].iter().enumerate().for_each(|(particle, x)| bins.add(x, particle));
        let longest = lengths.largest(|x| *x);
        Chords { bins, lengths, longest }
    }

    fn clear(&self, x: &Vec2, positions: &[Vec2]) -> bool {
        let is_close = |p: &usize| (positions[*p] - x).norm() < CLEAR * self.lengths[*p];
        !self.bins.near(x, CLEAR * self.longest).any(is_close)
    }
}

/// Moves each inner particle to the mean of the middles of its triangles, weighted by area and wanted density.
fn relax(
    mesh: &mut Mesh,
    fixed: usize,
    region: &Region,
    spacing: &Spacing<'_>,
    chords: &Chords,
) -> Result<(), GeometryError> {
    let mut sums = vec![(Vec2::zeros(), 0.0); mesh.positions.len()];
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle);
        let middle = (a + b + c) / 3.0;
        let h = spacing.at(&middle)?;
        // With the inverse fourth power centroids equidistribute (Du, Faber & Gunzburger 1999).
        let weight = 0.5 * cross(a, b, c) / h.powi(4);
        for &particle in &mesh.triangles[triangle] {
            let sum = &mut sums[particle as usize];
            sum.0 += middle * weight;
            sum.1 += weight;
        }
    }
    for particle in fixed..mesh.positions.len() {
        let (sum, weight) = sums[particle];
        let target = sum / weight;
        if weight > 0.0 && region.contains(&target) && chords.clear(&target, &mesh.positions) {
            mesh.positions[particle] = target;
        }
    }
    Ok(())
}
