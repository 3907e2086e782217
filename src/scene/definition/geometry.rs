//! The geometry of bodies: images of a unit cube, regions of the plane, meshes, solids, given cells.

use std::sync::Arc;

use crate::cells::{Cells, CutLattice, Triangulation, Voronoi};
use crate::each::{Each, array_of};
use crate::error::{Error, GeometryError};
use crate::geometry::{Block, Domain, Region, Vec2, Vec3};
use crate::mesh::Mesh;
use crate::solid::Solid3;

use super::resolution::per_axis;
use super::source::Source;
use crate::scene::{Partition, Resolution, Scheme};

/// The geometry of a body, for [`Scene::new`](crate::scene::Scene::new) and [`Scene::body`](crate::scene::Scene::body): the image of a
/// unit cube ([`Domain`], a block for instance), a [`Region`] of the plane, over which the scheme scatters its particles, a
/// [`Mesh`], at whose nodes they are, a [`Solid3`], through which the scheme lays a lattice, or given particles and [`Cells`], for which the scheme's resolution and layout are left out.
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

/// Particle counts for each axis of a shape that is not divided along axes, none of them zero.
fn some_per_axis<const D: usize>(counts: &[usize]) -> Result<[usize; D], Error> {
    let what = "particle counts";
    let counts = per_axis(counts, what)?;
    ensure!(
        !counts.contains(&0),
        GeometryError::Count { what, count: 0, needed: "at least 1 is needed along each axis" }
    );
    Ok(counts)
}

impl From<Region> for Geometry<2> {
    fn from(region: Region) -> Self {
        let scattering = move |scheme: &Scheme| -> Result<Arc<dyn Cells<2>>, Error> {
            let grading = |x: &Vec2| scheme.grading.as_ref().map_or(1.0, |grading| grading(x.as_slice()));
            let (spacing, count) = match &scheme.resolution_or_default() {
                Resolution::Spacing(h) => (*h, None),
                Resolution::Counts(counts) => {
                    let counts: [usize; 2] = some_per_axis(counts)?;
                    (1.0, Some(counts[0].saturating_mul(counts[1])))
                }
            };
            let spacing = |x: &Vec2| spacing * grading(x);
            let triangles = match (scheme.thin_walls, count) {
                (false, _) => Triangulation::walled(&region, count, spacing, &scheme.scatter)?,
                (true, None) => Triangulation::scattered(&region, spacing, &scheme.scatter)?,
                (true, Some(count)) => Triangulation::about(&region, count, spacing, &scheme.scatter)?,
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

impl From<Solid3> for Geometry<3> {
    fn from(solid: Solid3) -> Self {
        let lattice = move |scheme: &Scheme| -> Result<Arc<dyn Cells<3>>, Error> {
            let spacing = match &scheme.resolution_or_default() {
                Resolution::Spacing(spacing) => *spacing,
                // As many along the longest side as are asked for, or as few as any axis allows.
                Resolution::Counts(counts) => {
                    let counts: [usize; 3] = some_per_axis(counts)?;
                    let Block { min, max } = solid.bounds();
                    let sides: [f64; 3] = array_of(|i| max[i] - min[i]);
                    let even = counts.iter().all(|count| *count == counts[0]);
                    let own = |i: usize| sides[i] / (counts[i].max(2) - 1) as f64;
                    let spacings = [own(0), own(1), own(2)];
                    match even {
                        true => spacings.largest(|x| *x),
                        false => spacings.iter().copied().fold(f64::INFINITY, f64::min),
                    }
                }
            };
            let grading = |x: &Vec3| scheme.grading.as_ref().map_or(1.0, |grading| grading(x.as_slice()));
            let graded: Option<&dyn Fn(&Vec3) -> f64> = scheme.grading.as_ref().map(|_| &grading as _);
            Ok(Arc::new(match (graded, scheme.across) {
                (graded, 0) if !scheme.thin_walls => CutLattice::walled(&solid, spacing, graded)?,
                (None, 0) => CutLattice::new(&solid, spacing)?,
                (_, across) => CutLattice::refined(&solid, spacing, across, grading)?,
            }))
        };
        Geometry { source: Source::Scattered(Arc::new(lattice)) }
    }
}

impl From<&Solid3> for Geometry<3> {
    fn from(solid: &Solid3) -> Self {
        Geometry::from(solid.clone())
    }
}
