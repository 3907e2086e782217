//! Bodies that were drawn: regions of the plane and meshes.

use std::sync::Arc;

use crate::cells::{Cells, Triangulation, Voronoi};
use crate::error::Error;
use crate::geometry::{Point, Region};
use crate::mesh::Mesh;

use super::resolution::per_axis;
use super::source::Source;
use crate::scene::{Partition, Resolution, Scheme};

/// A body that was drawn, for [`Scene::on`](crate::scene::Scene::on): a [`Region`] or a [`Mesh`].
#[derive(Clone)]
pub struct Drawn<const D: usize> {
    pub(crate) source: Source<D>,
}

impl From<Region> for Drawn<2> {
    fn from(region: Region) -> Self {
        let scattering = move |scheme: &Scheme| -> Result<Arc<dyn Cells<2>>, Error> {
            let grading = |x: &Point<2>| scheme.grading.as_ref().map_or(1.0, |grading| grading(x.as_slice()));
            let triangles = match &scheme.resolution {
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
        Drawn { source: Source::Scattered(Arc::new(scattering)) }
    }
}

impl<const D: usize> From<Mesh<D>> for Drawn<D> {
    fn from(mesh: Mesh<D>) -> Self {
        Drawn { source: Source::Mesh(Arc::new(mesh)) }
    }
}

impl<const D: usize> From<&Mesh<D>> for Drawn<D> {
    fn from(mesh: &Mesh<D>) -> Self {
        Drawn::from(mesh.clone())
    }
}
