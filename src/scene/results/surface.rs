//! Surfaces of bodies that are drawn where no particles are.

use crate::error::Error;
use crate::geometry::Point;
use crate::scene::Problem;
use crate::shape::ShapeFunctions;
use crate::solve::State;

/// The surface of a body with what moves it.
pub(super) struct DrawnSurface<const D: usize> {
    /// The number of the body.
    pub(super) body: usize,
    pub(super) points: Vec<Point<D>>,
    pub(super) displacements: Vec<Point<D>>,
    pub(super) facets: Vec<Vec<usize>>,
    /// Shape functions at the points, by the particles of all bodies.
    pub(super) functions: Vec<ShapeFunctions<D>>,
}

impl<const D: usize> DrawnSurface<D> {
    /// Values at the points from those at all particles.
    pub(super) fn interpolated<T>(&self, at_particles: &[T]) -> Vec<T>
    where
        T: Copy + std::ops::Mul<f64, Output = T> + std::iter::Sum<T>,
    {
        let at = |psi: &ShapeFunctions<D>| {
            psi.nodes.iter().zip(&psi.values).map(|(n, v)| at_particles[*n as usize] * *v).sum()
        };
        self.functions.iter().map(at).collect()
    }
}

impl<const D: usize> Problem<D> {
    /// The surfaces of bodies whose cells give one to draw.
    pub(super) fn drawn_surfaces(&self, state: &State) -> Result<Vec<DrawnSurface<D>>, Error> {
        let mut found = Vec::new();
        for (body, own) in self.discrete_bodies.iter().enumerate() {
            let Some((points, facets)) = own.cells.drawn_surface() else { continue };
            let functions = own.values_at(&points)?;
            let displacements = functions.iter().map(|psi| own.weighted(psi, state)).collect();
            let functions = functions.into_iter().map(|psi| psi.shifted(own.nodes.start)).collect();
            found.push(DrawnSurface { body, points, displacements, facets, functions });
        }
        Ok(found)
    }
}
