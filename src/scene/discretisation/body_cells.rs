//! The particles of each body and the cells between them.

use std::sync::Arc;

use crate::cells::{Cells, Lattice, Unstructured};
use crate::compiled::compiled;
use crate::error::{Error, GeometryError};

use crate::scene::definition::resolution::counts;
use crate::scene::definition::scene::Scene;
use crate::scene::definition::scheme::Scheme;
use crate::scene::definition::scheme_choices::PressureScheme;
use crate::scene::definition::source::{BodyCells, BodyOf, Source};

impl<const D: usize> Scene<D> {
    /// The particles of each body under its scheme and the cells between them.
    pub(crate) fn cells(&self, scheme: &Scheme) -> Result<BodyCells<D>, Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<BodyCells<D>, Error> {
            scene.validate()?;
            all_cells(scene, scheme)
        })
    }
}

/// The particles of each body under its own scheme and the cells between them.
pub(crate) fn all_cells<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<BodyCells<D>, Error> {
    let of = |body: &BodyOf<D>| {
        let scheme = body.scheme.as_ref().map_or_else(|| scheme.clone(), |own| own(scheme.clone()));
        if let PressureScheme::Field { size: 0, .. } = scheme.pressure {
            let (what, needed) = ("cells per direction of a pressure zone", "at least 1 is needed");
            return Err(GeometryError::Count { what, count: 0, needed }.into());
        }
        let cells: Arc<dyn Cells<D>> = match &body.source {
            Source::Domain(domain) => {
                let counts = counts(&**domain, &scheme)?;
                super::space::refuse(&scheme, &counts)?;
                Arc::new(Lattice::new(&**domain, counts, &scheme.layout)?)
            }
            Source::Cells(cells) => cells.clone(),
            Source::Scattered(scatter) => scatter(&scheme)?,
            Source::Mesh(mesh) => {
                let rigid = scene.rigid_volumes(mesh);
                match rigid.is_empty() {
                    true => Arc::new(Unstructured::new(mesh)?),
                    false => Arc::new(Unstructured::new(&mesh.without(&rigid)?)?),
                }
            }
        };
        Ok((scheme, cells))
    };
    scene.bodies.iter().map(of).collect()
}
