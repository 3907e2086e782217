//! Sheets in plane stress: the thickness settles at each point.

use nalgebra::{Matrix3, SMatrix};

use super::homogeneous::root;
use super::{InitialModuli, InternalVariables, Material, Response};
use crate::error::MaterialError;
use crate::tensor::{Tangent, cofactor, determinant_hessian};

/// The component 33.
const THICKNESS: usize = 8;

/// A material whose thickness stretch $F_{33}$ is free: the least energy over it, $W^*(F) = \min_{F_{33}} W$, where $P_{33} = 0$.
///
/// With $c = \operatorname{cof}F$, $d = c_{33}$, $B = \bar A + p\\,\partial^2J$ of the parts of (2.8) and $e = B_{3333}$ the condensed tangent is
/// $$A^*_{ab} = B_{ab} + \frac{e\\,c_ac_b - d\\,(c_aB_{b3} + B_{a3}c_b) - B_{a3}B_{b3}/\tilde W''}{d^2 + e/\tilde W''},\qquad
/// p = -\bar P_{33}/d :$$
/// the bulk modulus stands below fractions alone, so that incompressible sheets lose no digits and nothing locks.
pub(crate) struct FreeThickness<M>(pub M);

/// In-plane components of a deformation gradient with a thickness stretch.
fn sheet(f: &Matrix3<f64>, thickness: f64) -> Matrix3<f64> {
    Matrix3::new(f.m11, f.m12, 0.0, f.m21, f.m22, 0.0, 0.0, 0.0, thickness)
}

/// Stress and tangent of a law in a few components, as [`Material::respond`] writes them.
type Respond<'a> = &'a dyn Fn(&Matrix3<f64>, &[usize], &mut [f64], &mut [f64]);

impl<M: Material> FreeThickness<M> {
    /// The law without the volumetric energy, where it has one of its own.
    fn shape(&self) -> &dyn Material {
        self.0.split().map_or(&self.0, |(distortional, _)| distortional)
    }

    /// The deformation gradient with the thickness at which a law has no stress across; `None` where there is none.
    fn settle(&self, f: &Matrix3<f64>, respond: Respond<'_>) -> Option<Matrix3<f64>> {
        let area = f.m11 * f.m22 - f.m12 * f.m21;
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let volumetric = self.0.split().map(|(_, volumetric)| volumetric);
        let of = |thickness: f64| {
            let (mut stress, mut tangent) = ([0.0], [0.0]);
            respond(&sheet(f, thickness), &[THICKNESS], &mut stress, &mut tangent);
            if let Some(volumetric) = volumetric {
                let u = volumetric.evaluate(area * thickness);
                stress[0] += u.slope * area;
                tangent[0] += u.curvature * area * area;
            }
            (stress[0], tangent[0])
        };
        root(1.0 / area, of).map(|thickness| sheet(f, thickness))
    }

    /// The condensed stress and tangent of a law.
    fn condense(
        &self,
        f: &Matrix3<f64>,
        respond: Respond<'_>,
        components: &[usize],
        stress: &mut [f64],
        tangent: &mut [f64],
    ) {
        let n = components.len();
        let Some(f) = self.settle(f, respond) else {
            stress[..n].fill(f64::NAN);
            tangent.fill(f64::NAN);
            return;
        };
        // The components requested, and the thickness behind them.
        let mut all = [THICKNESS; 10];
        all[..n].copy_from_slice(components);
        let m = n + 1;
        let (mut p, mut a) = ([0.0; 10], SMatrix::<f64, 10, 10>::zeros());
        let mut block = [0.0; 100];
        let wanted = if tangent.is_empty() { 0 } else { m * m };
        let volumetric = self.0.split().map(|(_, volumetric)| volumetric);
        respond(&f, &all[..m], &mut p[..m], &mut block[..wanted]);
        let cof = cofactor(&f);
        let of = |c: usize| cof[(c / 3, c % 3)];
        let d = of(THICKNESS);
        let pressure = if volumetric.is_some() { -p[n] / d } else { 0.0 };
        for i in 0..n {
            stress[i] = if all[i] == THICKNESS { 0.0 } else { p[i] + pressure * of(all[i]) };
        }
        if tangent.is_empty() {
            return;
        }
        for i in 0..m {
            for j in 0..m {
                a[(i, j)] = block[i * m + j];
                if volumetric.is_some() {
                    a[(i, j)] += pressure * determinant_hessian(&f, all[i], all[j]);
                }
            }
        }
        let e = a[(n, n)];
        let softness = volumetric.map(|v| 1.0 / v.evaluate(f.determinant()).curvature);
        for i in 0..n {
            for j in 0..n {
                let (bi, bj) = (a[(i, n)], a[(n, j)]);
                let condensed = match softness {
                    None => -bi * bj / e,
                    Some(s) => {
                        let (ci, cj) = (of(all[i]), of(all[j]));
                        (e * ci * cj - d * (ci * bj + bi * cj) - bi * bj * s) / (d * d + e * s)
                    }
                };
                let still = all[i] == THICKNESS || all[j] == THICKNESS;
                tangent[i * n + j] = if still { 0.0 } else { a[(i, j)] + condensed };
            }
        }
    }

    /// What a law of internal variables does in a step.
    fn stepped<T>(&self, internal_variables: &[f64], elapsed: f64, then: impl FnOnce(Respond<'_>) -> T) -> Option<T> {
        let law = self.0.internal_variables()?;
        Some(then(&|f, components, stress, tangent| {
            law.respond(f, internal_variables, elapsed, components, stress, tangent);
        }))
    }
}

impl<M: Material> Material for FreeThickness<M> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        let settled = self.settle(f, &|f, of, stress, tangent| self.shape().respond(f, of, stress, tangent));
        settled.map_or(f64::NAN, |f| self.0.energy(&f))
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        const ALL: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let (mut stress, mut tangent) = ([0.0; 9], [0.0; 81]);
        Material::respond(self, f, &ALL, &mut stress, &mut tangent);
        Response { stress: Matrix3::from_row_slice(&stress), tangent: Tangent::from_row_slice(&tangent) }
    }

    fn respond(&self, f: &Matrix3<f64>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let law = |f: &Matrix3<f64>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]| {
            self.shape().respond(f, of, stress, tangent);
        };
        self.condense(f, &law, components, stress, tangent);
    }

    fn deformation(&self, f: &Matrix3<f64>) -> Matrix3<f64> {
        let settled = self.settle(f, &|f, of, stress, tangent| self.shape().respond(f, of, stress, tangent));
        settled.unwrap_or_else(|| Matrix3::repeat(f64::NAN))
    }

    fn initial_moduli(&self) -> InitialModuli {
        self.0.initial_moduli()
    }

    fn validate(&self) -> Result<(), MaterialError> {
        self.0.validate()
    }

    fn internal_variables(&self) -> Option<&dyn InternalVariables> {
        self.0.internal_variables().map(|_| self as &dyn InternalVariables)
    }
}

/// The whole of the law: its volumetric energy is condensed with the thickness.
impl<M: Material> InternalVariables for FreeThickness<M> {
    fn len(&self) -> usize {
        self.0.internal_variables().map_or(0, |law| law.len())
    }

    fn start(&self, internal_variables: &mut [f64]) {
        if let Some(law) = self.0.internal_variables() {
            law.start(internal_variables);
        }
    }

    fn relaxed(&self) -> f64 {
        self.0.internal_variables().map_or(1.0, |law| law.relaxed())
    }

    fn energy(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64) -> f64 {
        let Some(law) = self.0.internal_variables() else { return f64::NAN };
        let f = InternalVariables::deformation(self, f, internal_variables, elapsed);
        let volumetric = self.0.split().map_or(0.0, |(_, volumetric)| volumetric.evaluate(f.determinant()).energy);
        law.energy(&f, internal_variables, elapsed) + volumetric
    }

    fn respond(
        &self,
        f: &Matrix3<f64>,
        internal_variables: &[f64],
        elapsed: f64,
        components: &[usize],
        stress: &mut [f64],
        tangent: &mut [f64],
    ) {
        self.stepped(internal_variables, elapsed, |law| self.condense(f, law, components, stress, tangent));
    }

    fn update_history(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64, next: &mut [f64]) {
        let Some(law) = self.0.internal_variables() else { return };
        let f = InternalVariables::deformation(self, f, internal_variables, elapsed);
        law.update_history(&f, internal_variables, elapsed, next);
    }

    fn time_error(
        &self,
        before: Option<(&[f64], f64)>,
        internal_variables: &[f64],
        elapsed: f64,
        next: &[f64],
    ) -> [f64; 2] {
        let law = self.0.internal_variables();
        law.map_or([0.0; 2], |law| law.time_error(before, internal_variables, elapsed, next))
    }

    fn deformation(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64) -> Matrix3<f64> {
        let settled = self.stepped(internal_variables, elapsed, |law| self.settle(f, law)).flatten();
        settled.unwrap_or_else(|| Matrix3::repeat(f64::NAN))
    }
}
