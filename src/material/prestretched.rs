//! Materials that are stretched before anything is done to them.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::{Material, Response, Volumetric, VolumetricEnergy};
use crate::error::{Invalid, MaterialError};
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
    whole: Part<M>,
    distortional: Shape<M>,
    volumetric: Volume<M>,
}

/// The whole material.
#[derive(Debug, Clone)]
struct Part<M> {
    material: Arc<M>,
    before: Matrix3<f64>,
    volume: f64,
}

/// Its distortional part.
#[derive(Debug, Clone)]
struct Shape<M>(Part<M>);

/// Its volumetric part.
#[derive(Debug, Clone)]
struct Volume<M>(Part<M>);

impl<M: Material> Prestretched<M> {
    /// The material stretched by `before` $= F_0$.
    ///
    /// # Errors
    /// [`Invalid`] unless $F_0$ is finite with a determinant above zero, and for a material with internal variables:
    /// stretch the elastic law and let the whole relax.
    pub fn new(material: M, before: Matrix3<f64>) -> Result<Self, MaterialError> {
        let volume = before.determinant();
        if !(volume > 0.0 && before.iter().all(|f| f.is_finite())) {
            let needed = "give a finite deformation gradient with a determinant above zero";
            return Err(Invalid::new("det F_0", volume, needed).into());
        }
        if let Some(internal_variables) = material.internal_variables() {
            let needed = "prestretch the elastic law, then add the internal variables: Viscoelastic::new(Prestretched::new(..)?, ..)";
            return Err(Invalid::new(
                "internal variables of the prestretched law",
                internal_variables.len() as f64,
                needed,
            )
            .into());
        }
        let whole = Part { material: Arc::new(material), before, volume };
        let part = || Part { material: whole.material.clone(), ..whole };
        Ok(Self { distortional: Shape(part()), volumetric: Volume(part()), whole: part() })
    }
}

impl<M> Part<M> {
    fn energy(&self, law: &dyn Material, f: &Matrix3<f64>) -> f64 {
        law.energy(&(f * self.before)) / self.volume
    }

    fn response(&self, law: &dyn Material, f: &Matrix3<f64>) -> Response {
        let Response { stress, tangent } = law.response(&(f * self.before));
        let g = &self.before;
        // A_iJkL = A_iMkN G_JM G_LN / det G.
        let mut half = Tangent::zeros();
        for i in 0..3 {
            for j in 0..3 {
                for column in 0..9 {
                    half[(3 * i + j, column)] = (0..3).map(|m| g[(j, m)] * tangent[(3 * i + m, column)]).sum();
                }
            }
        }
        let pulled = Tangent::from_fn(|row, column| {
            let (k, l) = (column / 3, column % 3);
            (0..3).map(|n| g[(l, n)] * half[(row, 3 * k + n)]).sum::<f64>() / self.volume
        });
        Response { stress: stress * g.transpose() / self.volume, tangent: pulled }
    }
}

impl<M: Material> Shape<M> {
    fn law(&self) -> &dyn Material {
        self.0.material.split().map_or(&*self.0.material, |(distortional, _)| distortional)
    }
}

impl<M: Material> Material for Shape<M> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        self.0.energy(self.law(), f)
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        self.0.response(self.law(), f)
    }
}

impl<M: Material> VolumetricEnergy for Volume<M> {
    fn evaluate(&self, j: f64) -> Volumetric {
        let undefined = Volumetric { energy: f64::NAN, slope: f64::NAN, curvature: f64::NAN };
        self.0.material.split().map_or(undefined, |(_, volumetric)| {
            let Volumetric { energy, slope, curvature } = volumetric.evaluate(j * self.0.volume);
            Volumetric { energy: energy / self.0.volume, slope, curvature: curvature * self.0.volume }
        })
    }
}

impl<M: Material> Material for Prestretched<M> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        self.whole.energy(&*self.whole.material, f)
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        self.whole.response(&*self.whole.material, f)
    }

    /// What the material settles of $FF_0$, seen from the body at rest.
    fn deformation(&self, f: &Matrix3<f64>) -> Matrix3<f64> {
        let Part { material, before, .. } = &self.whole;
        let undone = before.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        material.deformation(&(f * before)) * undone
    }

    fn validate(&self) -> Result<(), MaterialError> {
        self.whole.material.validate()
    }

    fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
        self.whole
            .material
            .split()
            .map(|_| (&self.distortional as &dyn Material, &self.volumetric as &dyn VolumetricEnergy))
    }
}
