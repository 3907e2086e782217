//! How the volumetric energy of a body is treated.

/// How the volumetric energy of a body is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PressureField {
    /// $U(J)$ at each point, plain Newton in the displacements.
    Displacement,
    /// $U(J)$ at each point, the pressure at each point an iterate of Newton. Same solution as
    /// [`Displacement`](PressureField::Displacement) in far fewer steps.
    Pointwise,
    /// $U(\bar J)$ with $G(\bar J)$ the projection of $G(J)$ on constants in each cluster; see [`Body`](super::Body).
    Constant,
    /// $U(\bar J)$ with $G(\bar J)$ the projection of $G(J)$ on linear functions in each cluster.
    Linear,
}

/// Which measure of the volume is projected on the zones of pressure; see [`Body`](super::Body).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ProjectedMeasure {
    /// A root of $J$ that goes over to $J$ in zones under tension. Coarse models stay stable whether pressed, bent or pulled.
    ///
    /// The exponent is set beside Newton's iteration and is no variable of the energy: beyond tensions of 0.8 shear moduli work
    /// and energy differ (by 1.3e-4 for a bonded pad pulled by a tenth), and a state depends as much on the way to it.
    #[default]
    Adapted,
    /// $J$ itself, with the stabilisation $sk = \mu_0$: forces, tangent and energy derive from one potential, so that work is energy
    /// and a state does not depend on how it was reached.
    ///
    /// Coarse models are less stable: of 48 drawn blocks that were bent hard 6 ended in unstable states, 2 with
    /// [`Adapted`](ProjectedMeasure::Adapted), and strips of few particles stretched to three times their length are a quarter
    /// further off.
    Jacobian,
}
