//! Moments of bodies and plane pieces, and the points that have them.

use nalgebra::SymmetricEigen;

use crate::each::EachOf;
use crate::geometry::{Mat3, Vec3, mean};
use crate::order::falling;

/// Measure and moments of a plane piece or a body.
#[derive(Debug, Clone, Default)]
pub(super) struct Inertia {
    pub(super) measure: f64,
    first: Vec3,
    second: Mat3,
}

impl Inertia {
    /// Adds a simplex by its corners, three in a plane or four in space, its measure signed.
    pub(super) fn add(&mut self, corners: &[Vec3], measure: f64) {
        let count = corners.len() as f64;
        let centre = mean(corners);
        let spread = corners.iter().map(|x| (x - centre) * (x - centre).transpose()).sum::<Mat3>();
        self.measure += measure;
        self.first += centre * measure;
        self.second += (spread / (count * (count + 1.0)) + centre * centre.transpose()) * measure;
    }

    /// Adds a point of a rule with its weight.
    pub(super) fn add_point(&mut self, at: &Vec3, weight: f64) {
        self.add(&[*at], weight);
    }

    /// Adds the tetrahedron from a place to a triangle around a body, seen from outside.
    pub(super) fn add_cone(&mut self, apex: &Vec3, [a, b, c]: &[Vec3; 3]) {
        let volume = (a - apex).dot(&(b - apex).cross(&(c - apex))) / 6.0;
        self.add(&[*apex, *a, *b, *c], volume);
    }

    /// Four points of a body that have its moments of second order.
    pub(super) fn in_body(&self, mut with: impl FnMut(Vec3, f64)) {
        if !(self.measure > 0.0) {
            return;
        }
        let (centre, [p, q, r]) = self.axes();
        for [s, t, u] in [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]] {
            with(centre + p * s + q * t + r * u, self.measure / 4.0);
        }
    }

    pub(super) fn centre(&self) -> Vec3 {
        self.first / self.measure
    }

    /// The second moments about the centre over the measure.
    pub(super) fn variance(&self) -> Mat3 {
        let centre = self.centre();
        self.second / self.measure - centre * centre.transpose()
    }

    /// Adds second moments that are the same along all axes.
    pub(super) fn spread(&mut self, moment: f64) {
        self.second += Mat3::identity() * moment;
    }

    /// The centre, and the semi-axes of the points' spread: $\sqrt{\lambda_k}\,e_k$ with the eigenvalues of the second moments over the
    /// measure, the largest first.
    pub(super) fn axes(&self) -> (Vec3, [Vec3; 3]) {
        let eigen = SymmetricEigen::new(self.variance());
        (
            self.centre(),
            falling(eigen.eigenvalues.into())
                .each(|k| eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt()),
        )
    }
}
