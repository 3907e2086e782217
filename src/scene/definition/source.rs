//! What the bodies of a scene are made of.

use std::sync::Arc;

use crate::cells::Cells;
use crate::error::Error;
use crate::geometry::Domain;
use crate::material::Material;
use crate::mesh::Mesh;

use super::scheme::Scheme;

/// What is discretised: the image of a unit cube, or whatever hands out its own cells.
#[derive(Clone)]
pub(crate) enum Source<const D: usize> {
    Domain(Arc<dyn Domain<D>>),
    Cells(Arc<dyn Cells<D>>),
    Scattered(Arc<Scattering<D>>),
    Mesh(Arc<Mesh<D>>),
}

/// Particles and cells of a planar region under a scheme.
pub(crate) type Scattering<const D: usize> = dyn Fn(&Scheme) -> Result<Arc<dyn Cells<D>>, Error> + Send + Sync;

/// A body of a scene.
#[derive(Clone)]
pub(crate) struct BodyOf<const D: usize> {
    pub name: String,
    pub source: Source<D>,
    pub material: Arc<dyn Material>,
}

/// The scheme of each body with its particles and the cells between them.
pub(crate) type BodyCells<const D: usize> = Vec<(Scheme, Arc<dyn Cells<D>>)>;

/// A change of a scheme.
pub(crate) type Own = Arc<dyn Fn(Scheme) -> Scheme + Send + Sync>;
