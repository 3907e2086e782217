//! Models of scenes of several bodies, of meshes, or of both: all bodies are made finer together.

use std::sync::Arc;

use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::{BodyOf, Own, Scene, Scheme, Source};

use super::sides::Sides;
use super::strategy::{Found, Model, Next, Strategy, finer};

/// How one body is made finer.
enum Refinable<const D: usize> {
    /// By the number of its particles.
    Sides(Sides<D>),
    /// By cutting each cell at the middles of its edges: the mesh with no cut, one, two and so on.
    Mesh(Vec<Arc<Mesh<D>>>),
}

/// Bodies that are made finer together; meshes, whose cells can only be halved, decide where there are any.
pub(super) struct Assembled<'a, const D: usize> {
    scene: &'a Scene<D>,
    scheme: Scheme,
    bodies: Vec<Refinable<D>>,
    fineness: f64,
    /// Cuts of the meshes.
    cuts: usize,
    halves: bool,
}

impl<'a, const D: usize> Assembled<'a, D> {
    pub(crate) fn new(scene: &'a Scene<D>, scheme: &Scheme) -> Result<Self, Error> {
        let refinable = |body: &BodyOf<D>| match &body.source {
            Source::Mesh(mesh) => Ok(Refinable::Mesh(vec![mesh.clone()])),
            source => Ok(Refinable::Sides(Sides::of_body(source, &scene.scheme_under(&body.name, scheme))?)),
        };
        let bodies = scene.bodies.iter().map(refinable).collect::<Result<Vec<_>, Error>>()?;
        let halves = bodies.iter().any(|body| matches!(body, Refinable::Mesh(_)));
        // The number of particles is chosen here, body by body.
        let scheme = Scheme { resolution: None, ..scheme.clone() };
        Ok(Assembled { scene, scheme, bodies, fineness: 1.0, cuts: 0, halves })
    }

    /// Cuts meshes until they have been cut as often as is asked for.
    fn cut(&mut self) -> Result<(), Error> {
        for body in &mut self.bodies {
            if let Refinable::Mesh(meshes) = body {
                while meshes.len() <= self.cuts {
                    let finer = meshes[meshes.len() - 1].refined()?;
                    meshes.push(Arc::new(finer));
                }
            }
        }
        Ok(())
    }

    fn model(&self) -> Model<D> {
        let mut scene = self.scene.clone();
        let (mut particles, mut schemes) = (0, Vec::new());
        for (body, refinable) in scene.bodies.iter_mut().zip(&self.bodies) {
            match refinable {
                Refinable::Mesh(meshes) => {
                    let mesh = &meshes[self.cuts.min(meshes.len() - 1)];
                    particles += mesh.points().len();
                    body.source = Source::Mesh(mesh.clone());
                }
                Refinable::Sides(sides) => {
                    let counts = sides.counts(self.fineness);
                    particles += counts.iter().product::<usize>();
                    let sides = *sides;
                    let finer = move |scheme: Scheme| sides.scheme(scheme, &counts);
                    schemes.push((body.name.clone(), Arc::new(finer) as Own));
                }
            }
        }
        scene.schemes.append(&mut schemes);
        Model { scene, scheme: self.scheme.clone(), counts: vec![particles], spacing: 1.0 / self.fineness }
    }

    /// Particles of the bodies that are no meshes.
    fn particles(&self) -> usize {
        let count = |body: &Refinable<D>| match body {
            Refinable::Sides(sides) => sides.counts(self.fineness).iter().product(),
            Refinable::Mesh(_) => 0,
        };
        self.bodies.iter().map(count).sum()
    }
}

impl<const D: usize> Strategy<D> for Assembled<'_, D> {
    fn coarsest(&self) -> Model<D> {
        self.model()
    }

    fn thicken(&mut self) -> bool {
        self.fineness *= 2.0;
        self.cuts += 1;
        self.cut().is_ok()
    }

    fn next(&mut self, _: &Found<'_>) -> Result<Next<D>, String> {
        if self.halves {
            self.fineness *= 2.0;
            self.cuts += 1;
            self.cut().map_err(|error| format!("the mesh can't be refined: {error}"))?;
        } else {
            let before = self.particles();
            // Models that round to the same counts are skipped.
            while self.particles() == before {
                self.fineness = finer(self.fineness, false);
            }
        }
        Ok(Next { coarse: None, fine: self.model() })
    }
}

/// Whether a scene is sized body by body.
pub(super) fn is_assembled<const D: usize>(scene: &Scene<D>) -> bool {
    scene.bodies.len() > 1 || scene.bodies.iter().any(|body| matches!(body.source, Source::Mesh(_)))
}
