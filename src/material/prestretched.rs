//! Materials that are stretched before anything is done to them.

use std::sync::Arc;

use super::{InitialModuli, Material, Past, Response, Volumetric, VolumetricEnergy};
use crate::each::sum_of;
use crate::error::{Invalid, MaterialError};
use crate::geometry::Mat3;
use crate::tensor::Tangent;

/// A material that was stretched by $F_0$ before it was built in: the body at rest has the elastic deformation $F_0$, and
/// $W(F) = W_e(FF_0)/\det F_0$ per volume of that body.
///
/// Free parts would shrink back; held ones are stressed from the first step on. Beside it
/// [`Scene::with_expansion`](crate::scene::Scene::with_expansion) says what varies over a body and is the same in all directions.
///
/// ```
/// use rkpm::material::{Material, Prestretched, Rubber};
/// use rkpm::nalgebra::{Matrix3, Vector3};
/// // A band pulled by a half along the first axis, its volume kept.
/// let before = Matrix3::from_diagonal(&Vector3::new(1.5, 1.5f64.powf(-0.5), 1.5f64.powf(-0.5)));
/// let band = Prestretched::new(Rubber::neo_hookean(0.2, 1e3)?, before)?;
/// let stress = band.response(&Matrix3::identity()).stress;
/// let difference = 0.4 * (1.5f64.powi(2) - 1.0 / 1.5); // µ (λ² - 1/λ), MPa
/// assert!((stress[(0, 0)] - stress[(1, 1)] - difference).abs() < 1e-12);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Prestretched<M> {
    material: Arc<M>,
    before: Mat3,
    volumetric: Volume<M>,
}

/// The volumetric energy of a stretched material.
#[derive(Debug, Clone)]
struct Volume<M> {
    material: Arc<M>,
    /// $\det F_0$.
    volume: f64,
}

impl<M: Material> Prestretched<M> {
    /// The material stretched by `before` $= F_0$.
    ///
    /// # Errors
    /// [`Invalid`] unless $F_0$ is finite with a determinant above zero.
    pub fn new(material: M, before: Mat3) -> Result<Self, MaterialError> {
        let volume = before.determinant();
        ensure!(
            volume > 0.0 && before.iter().all(|f| f.is_finite()),
            Invalid::new("det F_0", volume, "give a finite deformation gradient with a determinant above zero")
        );
        let material = Arc::new(material);
        Ok(Self { volumetric: Volume { material: material.clone(), volume }, material, before })
    }
}

impl<M: Material> VolumetricEnergy for Volume<M> {
    fn evaluate(&self, j: f64) -> Volumetric {
        let undefined = Volumetric { energy: f64::NAN, slope: f64::NAN, curvature: f64::NAN };
        self.material.volumetric().map_or(undefined, |volumetric| {
            let Volumetric { energy, slope, curvature } = volumetric.evaluate(j * self.volume);
            Volumetric { energy: energy / self.volume, slope, curvature: curvature * self.volume }
        })
    }
}

impl<M: Material> Material for Prestretched<M> {
    fn inner(&self) -> Option<&dyn Material> {
        Some(&*self.material)
    }

    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
        self.material.energy_from(&(f * self.before), past) / self.volumetric.volume
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        let Response { stress, tangent } = self.material.response_from(&(f * self.before), past);
        let (g, volume) = (&self.before, self.volumetric.volume);
        // A_iJkL = A_iMkN G_JM G_LN / det G.
        let mut half = Tangent::zeros();
        for i in 0..3 {
            for j in 0..3 {
                for column in 0..9 {
                    half[(3 * i + j, column)] = sum_of(3, |m| g[(j, m)] * tangent[(3 * i + m, column)]);
                }
            }
        }
        let pulled = Tangent::from_fn(|row, column| {
            let (k, l) = (column / 3, column % 3);
            sum_of(3, |n| g[(l, n)] * half[(row, 3 * k + n)]) / volume
        });
        Response { stress: stress * g.transpose() / volume, tangent: pulled }
    }

    fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
        self.material.volumetric().map(|_| &self.volumetric as &dyn VolumetricEnergy)
    }

    fn initial_moduli(&self) -> InitialModuli {
        InitialModuli::of(&self.response(&Mat3::identity()).tangent)
    }

    /// What the material settles of $FF_0$, seen from the body at rest.
    fn settled(&self, f: &Mat3, past: Past<'_>) -> Mat3 {
        let undone = self.before.try_inverse().unwrap_or_else(|| Mat3::repeat(f64::NAN));
        self.material.settled(&(f * self.before), past) * undone
    }

    /// That of a material that was stretched a moment ago.
    fn start(&self, memory: &mut [f64]) {
        self.material.start(memory);
        let rest = memory.to_vec();
        self.material.remember(&self.before, Past { memory: &rest, elapsed: 0.0 }, memory);
    }

    fn remember(&self, f: &Mat3, past: Past<'_>, next: &mut [f64]) {
        self.material.remember(&(f * self.before), past, next);
    }
}
