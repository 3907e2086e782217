//! How a displacement in `D` dimensions becomes a 3×3 deformation gradient, and what a point measures.
//!
//! Bodies of revolution are whole: their measure is $2\pi R$ (or $4\pi R^2$), so that loads, reactions
//! and energies are those of the full part. Divide by $2\pi$ for values per radian.

use std::f64::consts::PI;

use crate::error::GeometryError;
use crate::geometry::{Point, Vec2, Vec3};

/// A kinematics: the in-plane block of $F$ is $\delta_{ij} + \partial u_i/\partial X_j$, `hoops` names the
/// diagonal entries that hold the hoop stretch $1 + u_1/X_1$, all others are those of the identity.
///
/// ```
/// use rkpm::{geometry::Point, kinematics::Kinematics};
/// /// A straight bar of given cross-section whose sides are held: uniaxial strain.
/// struct HeldBar { area: f64 }
/// impl Kinematics<1> for HeldBar {
///     fn hoop_components(&self) -> &'static [usize] { &[] }
///     fn measure(&self, _: &Point<1>) -> f64 { self.area }
/// }
/// assert_eq!(HeldBar { area: 2.0 }.measure(&Point::<1>::new(0.3)), 2.0);
/// ```
pub trait Kinematics<const D: usize>: Send + Sync {
    /// Diagonal entries of $F$ that hold the hoop stretch (none, one or two, all $\ge D$, each once).
    fn hoop_components(&self) -> &'static [usize];

    /// The factor of the coordinate measure at $X$: $1$, $2\pi R$, $4\pi R^2$, an area or a thickness. Positive
    /// and finite; on the axis of a kinematics with hoops it is zero.
    ///
    /// Rules that average gradients over sub-cells ask for a constant, or with hoops for a multiple of $R$ to their
    /// number, and refuse other measures; those of [`Rule::Gauss`](crate::scene::Rule::Gauss) take any.
    fn measure(&self, at: &Point<D>) -> f64;

    /// Whether the stretch across, $F_{33}$, is free at each point so that $P_{33} = 0$: a thin sheet in plane stress. Neither a
    /// coordinate nor a hoop may move that entry.
    fn is_plane_stress(&self) -> bool {
        false
    }
}

/// The diagonal entry of $F$ that is free in plane stress.
const ACROSS: usize = 2;

/// The hoops of a kinematics, after a look at them.
pub(crate) fn hoop_components<const D: usize>(
    kinematics: &dyn Kinematics<D>,
) -> Result<&'static [usize], GeometryError> {
    let hoops = kinematics.hoop_components();
    if kinematics.is_plane_stress() && (D > ACROSS || hoops.contains(&ACROSS)) {
        let needed = "but Kinematics::is_plane_stress() leaves it to the thickness: take fewer coordinates and other hoops, or no plane stress";
        return Err(GeometryError::Count { what: "entry of F that the kinematics moves", count: ACROSS, needed });
    }
    match (0..hoops.len()).find(|&k| hoops[k] < D || hoops[k] > 2 || hoops[..k].contains(&hoops[k])) {
        None => Ok(hoops),
        Some(k) => {
            let needed =
                "Kinematics::hoop_components() names entries from the number of coordinates up to 2, each once";
            Err(GeometryError::Count { what: "hoop of the kinematics", count: hoops[k], needed })
        }
    }
}

/// The measure of a kinematics at a point, after a look at it. Points beyond the axis are left to whoever divides by the
/// radius.
pub(crate) fn measure<const D: usize>(
    kinematics: &dyn Kinematics<D>,
    has_hoops: bool,
    at: &Point<D>,
) -> Result<f64, GeometryError> {
    let measure = kinematics.measure(at);
    if measure > 0.0 && measure.is_finite() || has_hoops && (at[0] < 0.0 || at[0] == 0.0 && measure == 0.0) {
        return Ok(measure);
    }
    let what = if measure.is_finite() {
        "the measure of the kinematics is not positive"
    } else {
        "the measure of the kinematics is not finite"
    };
    let remedy = "Kinematics::measure() gives a thickness, an area or a circumference: finite and above zero";
    Err(GeometryError::Kinematics { what, at: at.as_slice().to_vec(), remedy })
}

/// Plane strain, per unit thickness.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlaneStrain;

/// Plane stress: a thin sheet of constant thickness at rest, whose thickness changes freely.
///
/// The stretch across settles at each point so that $P_{33} = 0$, and is condensed from stress and tangent; with it free,
/// incompressible sheets do not lock and need no pressures. Forces on edges are those of the whole thickness:
/// tractions are per area at rest. A pressure that follows an edge acts on the area that its thickness leaves it, by the elastic law.
/// Laws with internal variables keep them for the settled thickness.
///
/// ```
/// use rkpm::prelude::*;
/// // A strip 2 mm thick is pulled to twice its length: F = µ A (λ - 1/λ²).
/// let strip = Scene::new(Block::new([0.0, 0.0], [10.0, 4.0]), PlaneStress { thickness: 2.0 }, Rubber::neo_hookean(0.2, 1e6)?)
///     .prescribe((0, Side::Min), 0, 0.0)
///     .prescribe((1, Side::Min), 1, 0.0)
///     .prescribe((0, Side::Max), 0, 10.0);
/// let problem = strip.discretize(&Scheme::default().particles([5, 3]))?;
/// let path = problem.run()?.completed()?;
/// let force = problem.reaction(path.last(), (0, Side::Max))?[0]; // N
/// assert!((force - 0.4 * 8.0 * (2.0 - 0.25)).abs() < 1e-5);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneStress {
    /// Thickness at rest \[length\]; finite and above zero.
    pub thickness: f64,
}

/// Axisymmetric without torsion, coordinates $(R, Z)$, the hoop at $F_{33}$; measure $2\pi R$.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Axisymmetric;

/// A body in three dimensions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Solid;

/// The radial motion of a long cylinder in plane strain, coordinate $R$, hoop at $F_{22}$;
/// measure $2\pi R$ per unit length.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RadialCylinder;

/// The radial motion of a sphere, coordinate $R$, hoops at $F_{22}$ and $F_{33}$; measure $4\pi R^2$.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RadialSphere;

impl Kinematics<2> for PlaneStrain {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Vec2) -> f64 {
        1.0
    }
}

impl Kinematics<2> for PlaneStress {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Vec2) -> f64 {
        self.thickness
    }

    fn is_plane_stress(&self) -> bool {
        true
    }
}

impl Kinematics<2> for Axisymmetric {
    fn hoop_components(&self) -> &'static [usize] {
        &[2]
    }

    fn measure(&self, at: &Vec2) -> f64 {
        2.0 * PI * at[0]
    }
}

impl Kinematics<3> for Solid {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Vec3) -> f64 {
        1.0
    }
}

impl Kinematics<1> for RadialCylinder {
    fn hoop_components(&self) -> &'static [usize] {
        &[1]
    }

    fn measure(&self, at: &Point<1>) -> f64 {
        2.0 * PI * at[0]
    }
}

impl Kinematics<1> for RadialSphere {
    fn hoop_components(&self) -> &'static [usize] {
        &[1, 2]
    }

    fn measure(&self, at: &Point<1>) -> f64 {
        4.0 * PI * at[0] * at[0]
    }
}

impl<const D: usize, K: Kinematics<D> + ?Sized> Kinematics<D> for std::sync::Arc<K> {
    fn hoop_components(&self) -> &'static [usize] {
        (**self).hoop_components()
    }

    fn measure(&self, at: &Point<D>) -> f64 {
        (**self).measure(at)
    }

    fn is_plane_stress(&self) -> bool {
        (**self).is_plane_stress()
    }
}
