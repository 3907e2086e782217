//! The part of the volumetric energy that stays pointwise beside projected pressures.

use crate::material::Material;

/// Part of the bulk modulus that may stay pointwise beside projected pressures; see `Body::zonal`.
pub(super) const POINTWISE_SHARE: f64 = 0.1;

/// Zones of so many times the points of the smallest keep as many times its stabilisation, wider ones no more.
pub(super) const WIDEST: f64 = 1.5;

/// The stabilisation $s$ of a material that can be split, so that $sk$ is a part of $\mu_0$, else 0; see `Body::new`.
pub(super) fn pointwise_share(material: &impl Material, of_shear: f64) -> f64 {
    let Some((_, volumetric)) = material.split() else { return 0.0 };
    // The energy of the stabilisation does not relax: that of the relaxed body is none too much at any time.
    let shear = material.initial_moduli().shear
        * material.internal_variables().map_or(1.0, |internal_variables| internal_variables.relaxed());
    let bulk = volumetric.evaluate(1.0).curvature;
    let kept = of_shear * shear;
    if bulk > 0.0 && kept >= 0.0 { (kept / bulk).min(POINTWISE_SHARE) } else { 0.0 }
}
