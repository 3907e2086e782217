//! Rigid surfaces that turn about an axis.

use crate::error::Invalid;
use crate::geometry::{Mat3, Vec3};
use crate::term::Amplitude;

/// How a rigid surface turns: by a given angle, or free under a given moment.
#[derive(Debug, Clone)]
pub(crate) struct Turning {
    /// A point of the axis \[length\].
    pub about: Vec3,
    /// $\hat\omega$: what a turn by a unit angle moves a point by is $\hat\omega\,(x - x_0)$.
    pub spin: Mat3,
    /// The angle where it is given, else the moment.
    pub amount: f64,
    pub amplitude: Amplitude,
    pub free: bool,
    /// By how much it has turned before the run.
    pub start: f64,
    /// The length of the axis as it was given.
    pub axis: f64,
}

/// A surface that has turned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turned {
    pub about: Vec3,
    pub spin: Mat3,
    pub rotation: Mat3,
    pub angle: f64,
    /// Change of the angle with the load factor.
    pub rate: f64,
}

/// The rotation by an angle about an axis, Rodrigues' formula.
pub(crate) fn rotation(spin: &Mat3, angle: f64) -> Mat3 {
    let (sine, cosine) = angle.sin_cos();
    Mat3::identity() + spin * sine + spin * spin * (1.0 - cosine)
}

impl Turning {
    /// At a load factor; `angle` is its own unknown where it is free.
    pub(crate) fn at(&self, load: f64, angle: f64) -> Turned {
        let (angle, rate) = if self.free {
            (angle, 0.0)
        } else {
            let (value, slope) = self.amplitude.evaluate(load);
            (self.start + self.amount * value, self.amount * slope)
        };
        Turned { about: self.about, spin: self.spin, rotation: rotation(&self.spin, angle), angle, rate }
    }

    /// Stays as it is at load factor 1.
    pub(crate) fn stay(&mut self) {
        let value = self.amplitude.value(1.0);
        if self.free {
            self.amplitude = Amplitude::level(value);
        } else {
            self.start += self.amount * value;
            self.amount = 0.0;
        }
    }

    /// Refuses axes and amounts that are none.
    pub(crate) fn validate(&self, contact: &str) -> Result<(), crate::error::Error> {
        self.amplitude.validate(|| contact.to_string())?;
        ensure!(
            self.axis > 0.0 && self.axis.is_finite(),
            Invalid::new(
                format!("{contact}: length of the axis about which the rigid surface turns"),
                self.axis,
                "give a finite vector of some length"
            )
        );
        let own = [self.amount].into_iter().chain(self.about.iter().chain(&self.spin).copied());
        Ok(finite(|| format!("{contact}: turn of the rigid surface"), own, &self.amplitude)?)
    }
}

/// Refuses numbers of a motion, and values of its amplitude, that are not finite.
pub(super) fn finite(
    what: impl FnOnce() -> String,
    own: impl IntoIterator<Item = f64>,
    amplitude: &Amplitude,
) -> Result<(), Invalid> {
    let ends = [0.0, 0.5, 1.0].map(|load| amplitude.value(load));
    match own.into_iter().chain(ends).find(|value| !value.is_finite()) {
        Some(value) => Err(Invalid::new(what(), value, "give finite numbers")),
        None => Ok(()),
    }
}
