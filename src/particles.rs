//! Particles: positions, supports and representative volumes.

use nalgebra::SMatrix;

use crate::each::{Each, IntoEach, list_of, point_of, sum_of};
use crate::error::ApproximationError;
use crate::geometry::{Bounds, Point};
use crate::neighbours::BoxTree;
use crate::tensor::small_inverse;

/// The support of one kernel function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support<const D: usize> {
    /// A ball of the given radius $a$, kernel $\Phi(\\|x-x_I\\|/a)$, eq. (3.27).
    Ball(f64),
    /// A box of half-widths $a_i$, kernel $\prod_i \Phi(|x_i-x_{Ii}|/a_i)$, eq. (3.26).
    Box(Point<D>),
    /// A parallelepiped, in the plane a parallelogram, with half-axes $a_k$, the columns of a matrix \[length\]: kernel
    /// $\prod_k \Phi(|\xi_k|)$, $x - x_I = \sum_k \xi_k a_k$. Eq. (3.26) along directions of one's own; lattices that are askew to
    /// the axes have turned boxes.
    Parallelepiped(SMatrix<f64, D, D>),
}

impl<const D: usize> Support<D> {
    /// Half-widths of the smallest box that holds the support \[length\].
    pub fn half_widths(&self) -> Point<D> {
        match self {
            Support::Ball(radius) => Point::repeat(*radius),
            Support::Box(half) => *half,
            Support::Parallelepiped(axes) => point_of(|i| axes.row(i).abs().sum()),
        }
    }

    /// The same support with all lengths multiplied by `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        match self {
            Support::Ball(radius) => Support::Ball(radius * factor),
            Support::Box(half) => Support::Box(half * factor),
            Support::Parallelepiped(axes) => Support::Parallelepiped(axes * factor),
        }
    }

    /// The matrix that takes an offset to its $\xi$ in a parallelepiped; `None` for other supports, and where half-axes lie in
    /// one plane or on one line.
    pub(crate) fn inverse_axes(&self) -> Option<SMatrix<f64, D, D>> {
        let Support::Parallelepiped(axes) = self else { return None };
        // Scaled, so that a length of 1e-200 is not taken for none.
        let scale = axes.amax();
        let inverse = small_inverse(&(axes / scale))? / scale;
        inverse.iter().all(|entry| entry.is_finite()).then_some(inverse)
    }
}

/// Refuses a normalised dilation $r \le \tfrac12$ (6.1), where particles see only themselves.
pub(crate) fn check_dilation(r: f64) -> Result<(), ApproximationError> {
    if r > 0.5 && r.is_finite() { Ok(()) } else { Err(ApproximationError::Dilation { r }) }
}

/// A set of particles with their supports.
#[derive(Debug, Clone, PartialEq)]
pub struct Particles<const D: usize> {
    positions: Vec<Point<D>>,
    supports: Vec<Support<D>>,
    volumes: Vec<f64>,
}

impl<const D: usize> Particles<D> {
    /// Given particles, one support each.
    ///
    /// # Errors
    /// Where there is no particle, the lengths differ, a number is not finite, a support is not
    /// positive, or two particles are at one place, closer than rounding leaves them.
    pub fn new(positions: Vec<Point<D>>, supports: Vec<Support<D>>) -> Result<Self, ApproximationError> {
        check_positions(&positions)?;
        ensure!(
            supports.len() == positions.len(),
            ApproximationError::Length { what: "supports", given: supports.len(), particles: positions.len() }
        );
        for (particle, support) in supports.iter().enumerate() {
            for &value in support.half_widths().iter() {
                ensure!(value > 0.0 && value.is_finite(), ApproximationError::Support { particle, value });
            }
            ensure!(
                !matches!(support, Support::Parallelepiped(_)) || support.inverse_axes().is_some(),
                ApproximationError::Particle {
                    particle,
                    what: "the half-axes of its support enclose nothing",
                    remedy: "give half-axes in as many directions as there are dimensions",
                }
            );
        }
        check_places(&positions, &|particle| supports[particle].half_widths())?;
        Ok(Particles { positions, supports, volumes: Vec::new() })
    }

    /// Balls of `factor` times the distance to the neighbour of rank `rank`, counted from 1.
    ///
    /// # Errors
    /// As [`new`](Particles::new), and where there is no neighbour of that rank.
    pub fn by_neighbour(positions: Vec<Point<D>>, rank: usize, factor: f64) -> Result<Self, ApproximationError> {
        ensure!(
            rank != 0 && rank < positions.len(),
            ApproximationError::Particle {
                particle: 0,
                what: "no neighbour has this rank",
                remedy: "give a rank of 1 up to, not including, the number of particles"
            }
        );
        check_positions(&positions)?;
        let tree = BoxTree::of(&positions);
        let distances = |rank| list_of(positions.len(), |own| tree.distance_by_rank(own, &positions[own], rank));
        if rank == 1 && positions.len() > 2 {
            // Of two particles at one place each would have a support that holds nothing else.
            let second = distances(2);
            check_places(&positions, &|particle| Point::repeat(second[particle]))?;
        }
        let supports = distances(rank).into_mapped(|d| Support::Ball(factor * d));
        Particles::new(positions, supports)
    }

    /// Adds nodal volumes $\Delta V_I$ inside the sums (3.24), (3.32).
    ///
    /// The kernel then carries its factor $\prod_i 1/a_i$ too. For equal supports and volumes the
    /// shape functions do not change.
    ///
    /// # Errors
    /// Where the number of volumes differs from that of the particles or one is not positive.
    pub fn with_volumes(mut self, volumes: Vec<f64>) -> Result<Self, ApproximationError> {
        ensure!(
            volumes.len() == self.positions.len(),
            ApproximationError::Length { what: "volumes", given: volumes.len(), particles: self.positions.len() }
        );
        if let Some(particle) = volumes.iter().position(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(ApproximationError::Particle {
                particle,
                what: "the volume is not a positive number",
                remedy: "give the volume of the particle's cell",
            });
        }
        self.volumes = volumes;
        Ok(self)
    }

    /// Positions $X_I$ \[length\].
    pub fn positions(&self) -> &[Point<D>] {
        &self.positions
    }

    /// Supports, one per particle.
    pub fn supports(&self) -> &[Support<D>] {
        &self.supports
    }

    /// Nodal volumes; empty where the sums carry none.
    pub fn volumes(&self) -> &[f64] {
        &self.volumes
    }
}

/// Particles closer than this part of their supports, and of the mean spacing, are at one place: no shape functions tell
/// them apart, while the closest ones of any graded set are far wider apart.
const ONE_PLACE: f64 = 1e-9;

/// Refuses positions that are missing or not finite.
fn check_positions<const D: usize>(positions: &[Point<D>]) -> Result<(), ApproximationError> {
    if positions.is_empty() || D == 0 {
        return Err(ApproximationError::Particle {
            particle: 0,
            what: "the set is empty",
            remedy: "give at least as many particles as the basis has terms",
        });
    }
    match positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        None => Ok(()),
        Some(particle) => Err(ApproximationError::Particle {
            particle,
            what: "the position is not finite",
            remedy: "give finite coordinates",
        }),
    }
}

/// Refuses two particles at one place; `half_widths` are those of their supports.
fn check_places<const D: usize>(
    positions: &[Point<D>],
    half_widths: &dyn Fn(usize) -> Point<D>,
) -> Result<(), ApproximationError> {
    match coincident(positions, half_widths) {
        None => Ok(()),
        Some(particle) => Err(ApproximationError::Particle {
            particle,
            what: "another particle has the same position, but for rounding",
            remedy: "remove one of them; where a mapped domain closes on itself (a full ring), model half of it with \
                     conditions of symmetry, or draw a Region",
        }),
    }
}

/// The first particle in a sweep across the set that shares its place with another one.
fn coincident<const D: usize>(positions: &[Point<D>], half_widths: &dyn Fn(usize) -> Point<D>) -> Option<usize> {
    let bounds = Bounds::of(positions);
    let spacing = bounds.extent().max() / (positions.len() as f64).powf(1.0 / D as f64);
    let reach = |i: usize| half_widths(i).map(|half| ONE_PLACE * half.min(spacing));
    // A slanting direction, along which no two nodes of an ordinary lattice are level.
    const DIRECTION: [f64; 3] = [1.0, 0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let along: Vec<f64> = positions.mapped(|x| sum_of(D, |k| (x[k] - bounds.low[k]) * DIRECTION[k % 3]));
    let mut order: Vec<usize> = (0..positions.len()).collect();
    crate::order::sort(&mut order, &|&i, &j| along[i].total_cmp(&along[j]));
    for (place, &i) in order.iter().enumerate() {
        let own = reach(i);
        // What rounding of the sums adds to their distance.
        let window = own.sum() + 8.0 * f64::EPSILON * along[i];
        for &j in order[place + 1..].iter().take_while(|&&j| along[j] - along[i] <= window) {
            let (offset, other) = (positions[j] - positions[i], reach(j));
            if (0..D).all(|k| offset[k].abs() <= own[k].min(other[k])) {
                return Some(i.max(j));
            }
        }
    }
    None
}
