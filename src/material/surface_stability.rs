//! Stability of a free surface.

use super::{Material, Past};
use crate::geometry::{Mat3, Vec3};

/// Whether the free surface of an incompressible body is stable under waves along a principal direction: above 0 where it is, 0 at
/// Biot's limit.
///
/// With axis 1 along the wave and axis 2 normal to the surface, the instantaneous moduli $\mathcal A_{jilk} = F_{j\alpha}F_{l\beta}\\,
/// \partial^2W/\partial F_{i\alpha}\partial F_{k\beta}$ of the distortional energy, $\alpha = \mathcal A_{1212}$,
/// $\gamma = \mathcal A_{2121}$, $2\beta = \mathcal A_{1111} + \mathcal A_{2222} - 2\mathcal A_{1122} - 2\mathcal A_{1221}$, the surface is
/// stable where
/// $$\alpha\gamma - \gamma^2 + 2\sqrt{\alpha\gamma}\\,(\beta + \gamma) > 0 .$$
/// The value is the left-hand side over $\alpha\gamma$; −1 where $\alpha$ or $\gamma$ is not positive, NaN where the material is not
/// defined. A pressure of a fluid changes nothing. The limit of a neo-Hookean half space is the stretch 0.5437 in plane strain, 0.6661 under
/// equibiaxial, 0.4437 under uniaxial compression. Creases, which are finite, begin before. M. A. Biot, *Mechanics of Incremental
/// Deformations* (1965); M. A. Dowaikh and R. W. Ogden, *IMA J. Appl. Math.* 44 (1990) 261–284.
///
/// `along` is the principal stretch along the wave, `across` that of the surface across it; the normal one follows from the volume.
pub(crate) fn surface_stability(material: &dyn Material, along: f64, across: f64) -> f64 {
    // Index of a component of F in the tangent.
    const fn at(i: usize, j: usize) -> usize {
        3 * i + j
    }
    let normal = 1.0 / (along * across);
    let f = Mat3::from_diagonal(&Vec3::new(along, normal, across));
    let memory = material.rest();
    let tangent = material.response_from(&f, Past { memory: &memory, elapsed: 0.0 }).tangent;
    let alpha = along * along * tangent[(at(1, 0), at(1, 0))];
    let gamma = normal * normal * tangent[(at(0, 1), at(0, 1))];
    let direct = along * along * tangent[(at(0, 0), at(0, 0))] + normal * normal * tangent[(at(1, 1), at(1, 1))];
    let coupled = along * normal * (tangent[(at(0, 0), at(1, 1))] + tangent[(at(1, 0), at(0, 1))]);
    let beta = 0.5 * direct - coupled;
    if alpha <= 0.0 || gamma <= 0.0 {
        return -1.0;
    }
    let product = alpha * gamma;
    (product - gamma * gamma + 2.0 * product.sqrt() * (beta + gamma)) / product
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Rubber;

    /// The stretch at which the surface loses stability, between two stretches.
    fn limit(material: &dyn Material, across: impl Fn(f64) -> f64) -> f64 {
        let (mut low, mut high) = (0.3f64, 0.95f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if surface_stability(material, middle, across(middle)) > 0.0 { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }

    /// Biot's limits: the roots of the boundary conditions of an incompressible half space, to four digits. In plane strain the square
    /// is 0.2956. Mooney and Rivlin's energy has the same ones in plane strain, and in the others as its derivation says.
    #[test]
    fn half_spaces_lose_stability_at_biots_limits() {
        let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
        // The stretch across the wave as a power of that along it.
        for (power, expected) in [(0.0, 0.5437), (1.0, 0.6661), (-0.5, 0.4437)] {
            let across = |along: f64| along.powf(power);
            let found = limit(&rubber, across);
            assert!((found - expected).abs() < 6e-5, "{found} for {expected}");
            let found = limit(&Rubber::mooney_rivlin(0.4, 0.1, 1e3).unwrap(), across);
            assert!((found - expected).abs() < 6e-5, "{found} for {expected}");
        }
        // Without strain α = β = γ = µ.
        assert!((surface_stability(&rubber, 1.0, 1.0) - 4.0).abs() < 1e-12);
        assert!(surface_stability(&rubber, 0.55, 1.0) > 0.0 && surface_stability(&rubber, 0.54, 1.0) < 0.0);
    }
}
