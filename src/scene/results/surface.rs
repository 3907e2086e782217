//! Surfaces of bodies that are drawn where no particles are.

use super::view::ProblemView;
use crate::each::{Each, IntoEach};
use crate::error::Error;
use crate::geometry::{Mat3, Vec3};
use crate::shape::ShapeFunctions;
use crate::solve::State;

/// The surface of a body with what moves it.
pub(super) struct DrawnSurface {
    /// The number of the body.
    pub(super) body: usize,
    pub(super) points: Vec<Vec3>,
    pub(super) displacements: Vec<Vec3>,
    pub(super) facets: Vec<Vec<usize>>,
    /// Shape functions at the points, by the particles of all bodies.
    pub(super) functions: Vec<ShapeFunctions<3>>,
}

impl DrawnSurface {
    /// Values at the points from those at all particles.
    pub(super) fn interpolated(&self, at_particles: &[Mat3]) -> Vec<Mat3> {
        let at = |psi: &ShapeFunctions<3>| {
            psi.nodes.iter().zip(&psi.values).map(|(n, v)| at_particles[*n as usize] * *v).sum()
        };
        self.functions.mapped(at)
    }
}

impl ProblemView<'_> {
    /// The surfaces of bodies whose cells give one to draw.
    pub(super) fn drawn_surfaces(&self, state: &State) -> Result<Vec<DrawnSurface>, Error> {
        let mut found = Vec::new();
        for (body, own) in self.bodies.iter().enumerate() {
            let Some((points, facets)) = own.drawn_surface() else { continue };
            let functions = own.values_at(&points)?;
            let displacements = functions.mapped(|psi| own.weighted(psi, state));
            let functions = functions.into_mapped(|psi| psi.shifted(own.nodes().start));
            found.push(DrawnSurface { body, points, displacements, facets, functions });
        }
        Ok(found)
    }
}
