//! The surface of a body in a state, point by point.

use nalgebra::{Matrix3, Vector3};

use crate::error::Error;
use crate::geometry::{Point, padded};
use crate::scene::Problem;
use crate::scene::results::recovery::surface_of;
use crate::solve::State;
use crate::tensor::cofactor;

/// Points beside one another for one of a load, in the plane: a fold is seen although its surface is stretched.
const DENSITY: usize = 4;

/// A point of the surface of a body.
pub(super) struct SurfacePoint<const D: usize> {
    /// The number of the body.
    pub body: usize,
    /// Where it is undeformed \[length\].
    pub reference: Point<D>,
    /// Where it is \[length\].
    pub current: Point<D>,
    /// Its part of the undeformed surface.
    pub weight: f64,
    /// The deformation gradient.
    pub f: Matrix3<f64>,
    /// The outward normal of the undeformed surface.
    pub normal: Vector3<f64>,
    /// Particles whose trace functions it lies under, among all nodes.
    pub owners: Vec<usize>,
    /// The spacing of particles there \[length\].
    pub spacing: f64,
}

impl<const D: usize> SurfacePoint<D> {
    /// Current area vector per undeformed area, $\operatorname{cof}(F)N$.
    pub(super) fn area(&self) -> Vector3<f64> {
        cofactor(&self.f) * self.normal
    }

    /// Area vector of the part of the current surface that it stands for, of axisymmetric bodies that of the meridian.
    pub(super) fn facet(&self) -> Vector3<f64> {
        let hoop = if D == 2 { self.f[(2, 2)] } else { 1.0 };
        self.area() * (self.weight / hoop)
    }
}

/// All points of the surfaces of all bodies; the axis is no surface.
pub(super) fn surface_points<const D: usize>(
    problem: &Problem<D>,
    state: &State,
) -> Result<Vec<SurfacePoint<D>>, Error> {
    let mut all = Vec::new();
    for (number, body) in problem.discrete_bodies().iter().enumerate() {
        let (points, traces) = surface_of(body, if D == 2 { DENSITY } else { 1 })?;
        let (first, hoops) = (body.nodes().start, body.body().table().hoop_components());
        let positions = body.cells().positions();
        let size = positions.iter().fold(0.0, |largest: f64, x| largest.max(x.amax()));
        for (point, x) in points.positions.iter().enumerate() {
            if !hoops.is_empty() && x[0].abs() < 1e-12 * size {
                continue;
            }
            let psi = body.approximation.shape_functions(x)?;
            let mut f = Matrix3::identity();
            let mut u = Point::<D>::zeros();
            for (&node, (value, gradient)) in psi.nodes.iter().zip(psi.values.iter().zip(&psi.gradients)) {
                let d = &state.displacement[(first + node as usize) * D..][..D];
                for i in 0..D {
                    u[i] += value * d[i];
                    for j in 0..D {
                        f[(i, j)] += d[i] * gradient[j];
                    }
                }
                for &k in hoops {
                    f[(k, k)] += d[0] * value / x[0];
                }
            }
            let near = |(node, _): &(&u32, &f64)| (positions[**node as usize] - x).norm_squared();
            let nearest = psi.nodes.iter().zip(&psi.values).min_by(|a, b| near(a).total_cmp(&near(b)));
            let spacing = nearest.map_or(0.0, |(node, _)| body.cells().spacings(*node as usize).min());
            let owners = match &traces {
                Some(traces) => traces[point].iter().map(|&(node, _)| first + node as usize).collect(),
                None => {
                    let seen = psi.nodes.iter().zip(&psi.values).filter(|(_, value)| value.abs() > 1e-9);
                    seen.map(|(&node, _)| first + node as usize).collect()
                }
            };
            all.push(SurfacePoint {
                body: number,
                reference: *x,
                current: x + u,
                weight: points.weights[point],
                f,
                normal: padded(&points.normals[point]),
                owners,
                spacing,
            });
        }
    }
    Ok(all)
}
