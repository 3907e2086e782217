//! The surface of a body in a state, point by point.

use nalgebra::{Matrix3, Vector3};

use crate::error::Error;
use crate::geometry::Point;
use crate::scene::results::view::ProblemView;
use crate::solve::State;
use crate::tensor::cofactor;

/// Points beside one another for one of a load, in the plane: a fold is seen although its surface is stretched.
const DENSITY: usize = 4;

/// A point of the surface of a body.
pub(super) struct SurfacePoint {
    pub dim: usize,
    /// The number of the body.
    pub body: usize,
    /// Where it is undeformed \[length\].
    pub reference: Point<3>,
    /// Where it is \[length\].
    pub current: Point<3>,
    /// Its part of the undeformed surface.
    pub weight: f64,
    /// The deformation gradient.
    pub f: Matrix3<f64>,
    /// The stretch of the body's free expansion.
    pub free: f64,
    /// The outward normal of the undeformed surface.
    pub normal: Vector3<f64>,
    /// Particles whose trace functions it lies under, among all nodes.
    pub owners: Vec<usize>,
    /// The spacing of particles there \[length\].
    pub spacing: f64,
}

impl SurfacePoint {
    /// Current area vector per undeformed area, $\operatorname{cof}(F)N$.
    pub(super) fn area(&self) -> Vector3<f64> {
        cofactor(&self.f) * self.normal
    }

    /// Area vector of the part of the current surface that it stands for, of axisymmetric bodies that of the meridian.
    pub(super) fn facet(&self) -> Vector3<f64> {
        let hoop = if self.dim == 2 { self.f[(2, 2)] } else { 1.0 };
        self.area() * (self.weight / hoop)
    }
}

/// All points of the surfaces of all bodies; the axis is no surface.
pub(super) fn surface_points(problem: &ProblemView<'_>, state: &State) -> Result<Vec<SurfacePoint>, Error> {
    let dim = problem.dim;
    let mut all = Vec::new();
    for (number, body) in problem.bodies.iter().enumerate() {
        let points = body.surface(if dim == 2 { DENSITY } else { 1 })?;
        let (first, hoops, size) = (body.nodes().start, body.hoops(), body.size());
        for (point, x) in points.positions.iter().enumerate() {
            if !hoops.is_empty() && x[0].abs() < 1e-12 * size {
                continue;
            }
            let psi = body.functions(x)?;
            let (u, f) = body.moved(x, &psi, &state.displacement[first * dim..]);
            let near = |(node, _): &(&u32, &f64)| (body.particle(**node as usize) - x).norm_squared();
            let nearest = psi.nodes.iter().zip(&psi.values).min_by(|a, b| near(a).total_cmp(&near(b)));
            let spacing = nearest.map_or(0.0, |(node, _)| body.spacing(*node as usize));
            let owners = points.owners(point, &psi).into_iter().map(|node| first + node).collect();
            all.push(SurfacePoint {
                dim,
                body: number,
                reference: *x,
                current: x + u,
                weight: points.weights[point],
                f,
                free: body.expands(x),
                normal: points.normals[point],
                owners,
                spacing,
            });
        }
    }
    Ok(all)
}
