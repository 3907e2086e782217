//! Homogeneous tests of a material: uniaxial, equibiaxial, planar, volumetric.

use super::{Material, Past, respond_to_volume};
use crate::geometry::{Mat3, Vec3};

/// A homogeneous test, driven by one stretch $\lambda$.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Mode {
    /// $\lambda$ along one direction, the other two free.
    Uniaxial,
    /// $\lambda$ along two directions, the third free.
    Equibiaxial,
    /// $\lambda$ along one direction, the second held, the third free: pure shear of a wide sheet.
    Planar,
    /// $\lambda^3 = J$: the stretch in all directions alike.
    Volumetric,
}

/// A homogeneous state of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomogeneousState {
    /// Principal stretches; the driven one first, the free one last.
    pub stretches: [f64; 3],
    /// Nominal stress $P_{11}$ along the first stretch \[stress\].
    pub stress: f64,
}

impl Mode {
    /// The modes that shape alone decides.
    pub(crate) const SHAPES: [Mode; 3] = [Mode::Uniaxial, Mode::Equibiaxial, Mode::Planar];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Uniaxial => "uniaxial",
            Mode::Equibiaxial => "equibiaxial",
            Mode::Planar => "planar",
            Mode::Volumetric => "volumetric",
        }
    }

    /// The principal stretches of an incompressible body; those of [`Volumetric`](Mode::Volumetric) are all $\lambda$.
    pub(crate) fn incompressible(self, stretch: f64) -> [f64; 3] {
        let lateral = self.lateral(stretch, 1.0);
        self.stretches(stretch, lateral)
    }

    /// The state of an incompressible body with the energy of a material without its volumetric part: the free surface sets the
    /// pressure, $P_{11} = \bar P_{11} - \bar P_{33}\lambda_3/\lambda_1$. Volumetric tests have none, and give zero.
    pub fn incompressible_state(self, material: &dyn Material, stretch: f64) -> HomogeneousState {
        let stretches = self.incompressible(stretch);
        let [first, third] = principal_stresses(material, false, stretches);
        let free = if self == Mode::Volumetric { first } else { third };
        HomogeneousState { stretches, stress: first - free * stretches[2] / stretches[0] }
    }

    /// The state of a compressible body: the free stretch has no stress along it. `None` where there is none in the domain
    /// of the energy.
    ///
    /// ```
    /// use rkpm::material::{Mode, Rubber};
    /// let rubber = Rubber::neo_hookean(0.2, 1e5)?; // µ = 0.4 MPa
    /// let pulled = Mode::Uniaxial.state(&rubber, 2.0).unwrap();
    /// assert!((pulled.stress - 0.4 * (2.0 - 1.0 / 4.0)).abs() < 1e-5); // MPa, but for k = 10⁵ MPa
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    pub fn state(self, material: &dyn Material, stretch: f64) -> Option<HomogeneousState> {
        if !(stretch > 0.0 && stretch.is_finite()) {
            return None;
        }
        if self == Mode::Volumetric {
            let stretches = [stretch; 3];
            let stress = principal_stresses(material, true, stretches)[0];
            return stress.is_finite().then_some(HomogeneousState { stretches, stress });
        }
        let lateral = root(self.lateral(stretch, 1.0), |lateral| {
            let stretches = self.stretches(stretch, lateral);
            let f = Mat3::from_diagonal(&Vec3::from(stretches));
            let (mut stress, mut tangent) = ([0.0; 2], [0.0; 4]);
            whole(material, &f, &[4, 8], &mut stress, &mut tangent);
            let slope = if self == Mode::Uniaxial { tangent[3] + tangent[2] } else { tangent[3] };
            (stress[1], slope)
        })?;
        let stretches = self.stretches(stretch, lateral);
        let stress = principal_stresses(material, true, stretches)[0];
        stress.is_finite().then_some(HomogeneousState { stretches, stress })
    }

    /// The free stretch at a volume ratio.
    fn lateral(self, stretch: f64, volume: f64) -> f64 {
        match self {
            Mode::Uniaxial => (volume / stretch).sqrt(),
            Mode::Equibiaxial => volume / (stretch * stretch),
            Mode::Planar => volume / stretch,
            Mode::Volumetric => stretch,
        }
    }

    fn stretches(self, stretch: f64, lateral: f64) -> [f64; 3] {
        match self {
            Mode::Uniaxial => [stretch, lateral, lateral],
            Mode::Equibiaxial => [stretch, stretch, lateral],
            Mode::Planar => [stretch, 1.0, lateral],
            Mode::Volumetric => [stretch; 3],
        }
    }
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Stress and tangent of a sudden step from rest, with the volumetric part.
fn whole(material: &dyn Material, f: &Mat3, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
    material.respond(f, Past { memory: &material.rest(), elapsed: 0.0 }, of, stress, tangent);
    if let Some(volumetric) = material.volumetric() {
        respond_to_volume(volumetric, f, of, stress, tangent);
    }
}

/// $P_{11}$ and $P_{33}$ at principal stretches, with the volumetric part or without.
fn principal_stresses(material: &dyn Material, with_volume: bool, stretches: [f64; 3]) -> [f64; 2] {
    let (f, mut stress) = (Mat3::from_diagonal(&Vec3::from(stretches)), [0.0; 2]);
    match with_volume {
        true => whole(material, &f, &[0, 8], &mut stress, &mut []),
        false => {
            let rest = material.rest();
            material.respond(&f, Past { memory: &rest, elapsed: 0.0 }, &[0, 8], &mut stress, &mut []);
        }
    }
    stress
}

/// Iterations of [`root`]; a good guess takes four to six.
const ITERATIONS: usize = 60;

/// The positive zero of a function with its slope, by Newton's method in the logarithm from a guess; `None` where the
/// way leads nowhere.
pub(super) fn root(guess: f64, of: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
    let mut x = guess;
    let (mut value, mut slope) = of(x);
    // Outside of the domain at the guess: towards no change of thickness.
    for _ in 0..ITERATIONS {
        if value.is_finite() {
            break;
        }
        x = x.sqrt();
        (value, slope) = of(x);
    }
    if !value.is_finite() {
        return None;
    }
    for _ in 0..ITERATIONS {
        // Quadratic convergence: what a step of this size would leave is beneath rounding.
        if value == 0.0 || slope > 0.0 && (value / (slope * x)).abs() <= 1e-14 {
            return Some(x);
        }
        // Where the stress falls with the stretch Newton's method would leave the zero: go against the stress instead.
        let step = if slope > 0.0 { -value / (slope * x) } else { -value.signum() };
        let mut step = step.clamp(-1.0, 1.0);
        let (mut next, mut after, mut after_slope);
        loop {
            next = x * step.exp();
            (after, after_slope) = of(next);
            if step.abs() <= 4.0 * f64::EPSILON {
                // As close as numbers are, or stuck at the edge of the domain.
                let settled = slope > 0.0 && (value / (slope * x)).abs() <= 1e-12;
                return settled.then_some(if after.abs() < value.abs() { next } else { x });
            }
            if after.is_finite() && (after.abs() <= value.abs() || slope <= 0.0) {
                break;
            }
            step *= 0.5;
        }
        let small = step.abs() <= 1e-13;
        (x, value, slope) = (next, after, after_slope);
        if small && slope > 0.0 {
            return Some(x);
        }
    }
    None
}
