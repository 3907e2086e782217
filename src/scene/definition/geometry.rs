//! The geometry of bodies: images of a unit cube, regions of the plane, meshes, given cells.

use std::sync::Arc;

use crate::cells::{Cells, Triangulation, Voronoi};
use crate::error::Error;
use crate::geometry::{Domain, Point, Region};
use crate::mesh::Mesh;

use super::resolution::per_axis;
use super::source::Source;
use crate::scene::{Partition, Resolution, Scheme};

/// The geometry of a body, for [`Scene::new`](crate::scene::Scene::new) and [`Scene::body`](crate::scene::Scene::body): the image of a
/// unit cube ([`Domain`], a block for instance), a [`Region`] of the plane, over which the scheme scatters its particles, a
/// [`Mesh`], at whose nodes they are, or given particles and [`Cells`], for which the scheme's resolution and layout are left out.
#[derive(Clone)]
pub struct Geometry<const D: usize> {
    pub(crate) source: Source<D>,
}

impl<const D: usize, T: Domain<D> + 'static> From<T> for Geometry<D> {
    fn from(domain: T) -> Self {
        Geometry { source: Source::Domain(Arc::new(domain)) }
    }
}

impl<const D: usize> Geometry<D> {
    /// A body over given particles and cells.
    pub fn cells(cells: Arc<dyn Cells<D>>) -> Self {
        Geometry { source: Source::Cells(cells) }
    }
}

impl<const D: usize> From<Arc<dyn Cells<D>>> for Geometry<D> {
    fn from(cells: Arc<dyn Cells<D>>) -> Self {
        Geometry::cells(cells)
    }
}

impl From<Region> for Geometry<2> {
    fn from(region: Region) -> Self {
        let scattering = move |scheme: &Scheme| -> Result<Arc<dyn Cells<2>>, Error> {
            let grading = |x: &Point<2>| scheme.grading.as_ref().map_or(1.0, |grading| grading(x.as_slice()));
            let triangles = match &scheme.resolution_or_default() {
                Resolution::Spacing(h) => Triangulation::scattered(&region, |x| h * grading(x), &scheme.scatter)?,
                Resolution::Counts(counts) => {
                    let counts: [usize; 2] = per_axis(counts, "particle counts")?;
                    let count = counts[0].saturating_mul(counts[1]);
                    Triangulation::about(&region, count, grading, &scheme.scatter)?
                }
            };
            Ok(match scheme.partition {
                Partition::Triangles => Arc::new(triangles),
                Partition::Voronoi => Arc::new(Voronoi::new(triangles)),
            })
        };
        Geometry { source: Source::Scattered(Arc::new(scattering)) }
    }
}

impl<const D: usize> From<Mesh<D>> for Geometry<D> {
    fn from(mesh: Mesh<D>) -> Self {
        Geometry { source: Source::Mesh(Arc::new(mesh)) }
    }
}

impl<const D: usize> From<&Mesh<D>> for Geometry<D> {
    fn from(mesh: &Mesh<D>) -> Self {
        Geometry::from(mesh.clone())
    }
}
