//! Trace functions of boundary conditions on pieces of a surface.

use std::collections::HashMap;

use nalgebra::{Matrix4, SymmetricEigen, Vector4};

use crate::geometry::Point;

/// Radius within which particles carry the functions of a point, in bricks: with three quarters of it the patch test leaves 3e-3.
const REACH: f64 = 4.0;
/// Radii are raised so often, each time by half.
const RAISES: usize = 5;
/// What may be missing of the sum of functions and of the normal.
const EXACT: f64 = 1e-11;
/// Eigenvalues below which moments are taken for singular, relative to the largest.
const SINGULAR: f64 = 1e-12;

/// Particles on a piece, each with its normal there, by the cubes of a grid.
pub(super) struct Traces<'a> {
    positions: &'a [Point<3>],
    particles: Vec<(u32, Point<3>)>,
    cubes: HashMap<[i32; 3], Vec<u32>>,
    curved: bool,
}

fn cube(x: &Point<3>) -> [i32; 3] {
    std::array::from_fn(|i| (x[i] / REACH).floor() as i32)
}

/// Wendland's function of the distance in parts of the radius.
fn weight(q: f64) -> f64 {
    if q < 1.0 { (1.0 - q).powi(4) * (4.0 * q + 1.0) } else { 0.0 }
}

impl<'a> Traces<'a> {
    pub(super) fn new(positions: &'a [Point<3>], particles: Vec<(u32, Point<3>)>, curved: bool) -> Self {
        let mut cubes: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for (place, &(particle, _)) in particles.iter().enumerate() {
            cubes.entry(cube(&positions[particle as usize])).or_default().push(place as u32);
        }
        Traces { positions, particles, cubes, curved }
    }

    /// Particles within a radius whose normals are not turned away, by rising index, with their weights.
    fn around(&self, x: &Point<3>, normal: &Point<3>, radius: f64) -> Vec<(u32, f64)> {
        let (middle, rings) = (cube(x), (radius / REACH).ceil() as i32);
        let mut found: Vec<(u32, f64)> = Vec::new();
        for k in -rings..=rings {
            for j in -rings..=rings {
                for i in -rings..=rings {
                    let Some(own) = self.cubes.get(&[middle[0] + i, middle[1] + j, middle[2] + k]) else { continue };
                    found.extend(own.iter().filter_map(|&place| {
                        let (particle, towards) = self.particles[place as usize];
                        let weight = weight((self.positions[particle as usize] - x).norm() / radius);
                        (weight > 0.0 && towards.dot(normal) > 0.0).then_some((place, weight))
                    }));
                }
            }
        }
        found.sort_unstable_by_key(|entry| entry.0);
        found
    }

    /// Functions $f_J$ at a point of the piece: moving least squares over the basis $(1, n)$, so that $\sum_J f_J = 1$ and
    /// $\sum_J f_J n_J = n$; with `positive` those of Shepard, which do not give the normal.
    pub(super) fn at(&self, x: &Point<3>, normal: &Point<3>, positive: bool) -> Vec<(u32, f64)> {
        let mut shepard = Vec::new();
        let mut radius = REACH;
        for _ in 0..RAISES {
            let around = self.around(x, normal, radius);
            radius *= 1.5;
            let whole: f64 = around.iter().map(|entry| entry.1).sum();
            // A single far particle has a weight that rounding may spoil.
            if !(whole > 1e-6) {
                continue;
            }
            let plain: Vec<(u32, f64)> = around.iter().map(|&(place, weight)| (place, weight / whole)).collect();
            if positive || !self.curved {
                shepard = plain;
                break;
            }
            if let Some(exact) = self.reproducing(&plain, normal) {
                shepard = exact;
                break;
            }
            if shepard.is_empty() {
                shepard = plain;
            }
        }
        if shepard.is_empty() {
            let distance = |place: &u32| (self.positions[self.particles[*place as usize].0 as usize] - x).norm();
            let all = 0..self.particles.len() as u32;
            shepard.extend(all.min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|place| (place, 1.0)));
        }
        shepard.into_iter().map(|(place, value)| (self.particles[place as usize].0, value)).collect()
    }

    /// Functions with these weights that give the normal; none where the particles can't.
    fn reproducing(&self, weights: &[(u32, f64)], normal: &Point<3>) -> Option<Vec<(u32, f64)>> {
        let off = |place: u32| self.particles[place as usize].1 - normal;
        let scale = weights.iter().map(|entry| off(entry.0).norm()).fold(0.0, f64::max);
        if scale < EXACT {
            return Some(weights.to_vec());
        }
        let basis = |place: u32| {
            let off = off(place) / scale;
            Vector4::new(1.0, off[0], off[1], off[2])
        };
        let mut moments = Matrix4::zeros();
        weights.iter().for_each(|&(place, weight)| moments += basis(place) * basis(place).transpose() * weight);
        let eigen = SymmetricEigen::new(moments);
        let largest = eigen.eigenvalues.max();
        let mut values = vec![0.0; weights.len()];
        // Once more for what rounding leaves.
        for _ in 0..2 {
            let mut missing = Vector4::new(1.0, 0.0, 0.0, 0.0);
            weights.iter().zip(&values).for_each(|(entry, value)| missing -= basis(entry.0) * *value);
            let mut solution = Vector4::zeros();
            for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                if *value > SINGULAR * largest {
                    solution += vector * (vector.dot(&missing) / value);
                }
            }
            for (value, &(place, weight)) in values.iter_mut().zip(weights) {
                *value += weight * basis(place).dot(&solution);
            }
        }
        let mut left = Vector4::new(1.0, 0.0, 0.0, 0.0);
        weights.iter().zip(&values).for_each(|(entry, value)| left -= basis(entry.0) * *value);
        let exact = left[0].abs() + left.norm() * scale < EXACT;
        exact.then(|| weights.iter().zip(values).map(|(entry, value)| (entry.0, value)).collect())
    }
}
