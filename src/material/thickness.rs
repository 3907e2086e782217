//! Sheets in plane stress: the thickness settles at each point.

use nalgebra::SMatrix;

use super::homogeneous::root;
use super::{Material, Past, Response, VolumetricEnergy};
use crate::geometry::Mat3;
use crate::tensor::{cofactor, determinant_hessian};

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
fn sheet(f: &Mat3, thickness: f64) -> Mat3 {
    Mat3::new(f.m11, f.m12, 0.0, f.m21, f.m22, 0.0, 0.0, 0.0, thickness)
}

impl<M: Material> FreeThickness<M> {
    /// The deformation gradient with the thickness at which a law has no stress across; `None` where there is none.
    fn settle(&self, f: &Mat3, past: Past<'_>) -> Option<Mat3> {
        let area = f.m11 * f.m22 - f.m12 * f.m21;
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let volumetric = self.0.volumetric();
        let of = |thickness: f64| {
            let (mut stress, mut tangent) = ([0.0], [0.0]);
            self.0.respond(&sheet(f, thickness), past, &[THICKNESS], &mut stress, &mut tangent);
            if let Some(volumetric) = volumetric {
                let u = volumetric.evaluate(area * thickness);
                stress[0] += u.slope * area;
                tangent[0] += u.curvature * area * area;
            }
            (stress[0], tangent[0])
        };
        root(1.0 / area, of).map(|thickness| sheet(f, thickness))
    }
}

impl<M: Material> Material for FreeThickness<M> {
    fn inner(&self) -> Option<&dyn Material> {
        Some(&self.0)
    }

    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
        let Some(f) = self.settle(f, past) else { return f64::NAN };
        let volumetric = self.0.volumetric().map_or(0.0, |volumetric| volumetric.evaluate(f.determinant()).energy);
        self.0.energy_from(&f, past) + volumetric
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        Response::of_components(|of, stress, tangent| self.respond(f, past, of, stress, tangent))
    }

    /// The condensed stress and tangent.
    fn respond(&self, f: &Mat3, past: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let n = components.len();
        let Some(f) = self.settle(f, past) else {
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
        let volumetric = self.0.volumetric();
        self.0.respond(&f, past, &all[..m], &mut p[..m], &mut block[..wanted]);
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

    /// None: it is condensed with the thickness.
    fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
        None
    }

    /// That of the inner material, at the thickness to which a law that is stressed at rest settles.
    fn start(&self, memory: &mut [f64]) {
        self.0.start(memory);
        let rest = memory.to_vec();
        self.remember(&Mat3::identity(), Past { memory: &rest, elapsed: 0.0 }, memory);
    }

    fn settled(&self, f: &Mat3, past: Past<'_>) -> Mat3 {
        self.settle(f, past).unwrap_or_else(|| Mat3::repeat(f64::NAN))
    }

    fn remember(&self, f: &Mat3, past: Past<'_>, next: &mut [f64]) {
        self.0.remember(&self.settled(f, past), past, next);
    }
}
