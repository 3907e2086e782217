//! Particles: positions, supports and representative volumes.

use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::neighbours::distances;

/// The support of one kernel function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support<const D: usize> {
    /// A ball of the given radius $a$, kernel $\Phi(\|x-x_I\|/a)$, eq. (3.27).
    Ball(f64),
    /// A box of half-widths $a_i$, kernel $\prod_i \Phi(|x_i-x_{Ii}|/a_i)$, eq. (3.26).
    Box(Point<D>),
}

impl<const D: usize> Support<D> {
    /// Half-widths of the smallest box that holds the support \[length\].
    pub fn half_widths(&self) -> Point<D> {
        match self {
            Support::Ball(radius) => Point::repeat(*radius),
            Support::Box(half) => *half,
        }
    }

    /// The same support with all lengths multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Support::Ball(radius) => Support::Ball(radius * factor),
            Support::Box(half) => Support::Box(half * factor),
        }
    }
}

/// Refuses a normalised dilation $r \le \tfrac12$ (6.1), where particles see only themselves.
pub fn check_dilation(r: f64) -> Result<(), ApproximationError> {
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
    /// positive, or two particles coincide.
    pub fn new(positions: Vec<Point<D>>, supports: Vec<Support<D>>) -> Result<Self, ApproximationError> {
        if positions.is_empty() {
            return Err(ApproximationError::Particle {
                particle: 0,
                what: "the set is empty",
                remedy: "give at least as many particles as the basis has terms",
            });
        }
        if supports.len() != positions.len() {
            return Err(ApproximationError::Length {
                what: "supports",
                given: supports.len(),
                particles: positions.len(),
            });
        }
        for (particle, position) in positions.iter().enumerate() {
            if !position.iter().all(|x| x.is_finite()) {
                return Err(ApproximationError::Particle {
                    particle,
                    what: "the position is not finite",
                    remedy: "give finite coordinates",
                });
            }
        }
        for (particle, support) in supports.iter().enumerate() {
            for &value in support.half_widths().iter() {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(ApproximationError::Support { particle, value });
                }
            }
        }
        if let Some(particle) = coincident(&positions) {
            return Err(ApproximationError::Particle {
                particle,
                what: "another particle has the same position",
                remedy: "remove one of them",
            });
        }
        Ok(Particles { positions, supports, volumes: Vec::new() })
    }

    /// Balls of `factor` times the distance to the neighbour of rank `rank`, counted from 1.
    ///
    /// # Errors
    /// As [`new`](Particles::new), and where there is no neighbour of that rank.
    pub fn by_neighbour(positions: Vec<Point<D>>, rank: usize, factor: f64) -> Result<Self, ApproximationError> {
        if rank == 0 || rank >= positions.len() {
            let remedy = "give a rank of 1 up to, not including, the number of particles";
            return Err(ApproximationError::Particle { particle: 0, what: "no neighbour has this rank", remedy });
        }
        let supports = distances(&positions, rank).into_iter().map(|d| Support::Ball(factor * d)).collect();
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
        if volumes.len() != self.positions.len() {
            return Err(ApproximationError::Length {
                what: "volumes",
                given: volumes.len(),
                particles: self.positions.len(),
            });
        }
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

/// The first particle that shares its position with another one.
fn coincident<const D: usize>(positions: &[Point<D>]) -> Option<usize> {
    let mut order: Vec<usize> = (0..positions.len()).collect();
    let key = |i: usize, j: usize| {
        positions[i].iter().zip(positions[j].iter()).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne())
    };
    order.sort_unstable_by(|&i, &j| key(i, j).unwrap_or(std::cmp::Ordering::Equal));
    order.windows(2).find(|w| positions[w[0]] == positions[w[1]]).map(|w| w[0].max(w[1]))
}
