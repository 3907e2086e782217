//! What is promised, tried.

use super::*;
use crate::material::{
    Gent, Invariants, LogarithmicVolume, MixedLogarithmicVolume, NearlyIncompressible, QuadraticVolume, Rubber,
    VolumetricEnergy,
};

fn broken(report: &Report) -> Vec<&str> {
    report.violations().map(|f| f.law).collect()
}

#[test]
fn the_materials_of_the_crate_hold() {
    let gent = Invariants(Gent::new(1.0, 30.0).unwrap());
    let pieces: [&dyn Material; 5] = [
        &Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap(),
        &Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap(),
        &Rubber::polynomial([((1, 0), 0.4), ((0, 1), 0.1), ((1, 1), 0.01)], 1e6).unwrap(),
        &NearlyIncompressible { distortional: gent, volumetric: MixedLogarithmicVolume::new(1e3).unwrap() },
        &NearlyIncompressible { distortional: gent, volumetric: LogarithmicVolume::new(1e3).unwrap() },
    ];
    for piece in pieces {
        let report = material(piece);
        assert!(report.holds() && report.unchecked.is_empty(), "{report}");
    }
}

/// Springs: not frame-indifferent.
struct Springs;

impl Material for Springs {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        0.5 * (f - Matrix3::identity()).norm_squared()
    }
    fn response(&self, f: &Matrix3<f64>) -> Response {
        Response { stress: f - Matrix3::identity(), tangent: Tangent::identity() }
    }
}

#[test]
fn each_broken_law_is_named() {
    let report = material(&Springs);
    assert_eq!(broken(&report), ["W does not depend on the frame", "P turns with the frame"]);
    assert_eq!(report.unchecked.len(), 1);

    /// A rubber whose stress is off by a factor.
    struct Scaled(Rubber, f64, f64);
    impl Material for Scaled {
        fn energy(&self, f: &Matrix3<f64>) -> f64 {
            self.0.energy(f)
        }
        fn response(&self, f: &Matrix3<f64>) -> Response {
            let Response { stress, tangent } = self.0.response(f);
            Response { stress: stress * self.1, tangent: tangent * self.2 }
        }
    }
    let rubber = Rubber::neo_hookean(0.5, 10.0).unwrap();
    assert!(broken(&material(&Scaled(rubber.clone(), 1.01, 1.01))).contains(&"P is the derivative of W"));
    assert_eq!(broken(&material(&Scaled(rubber.clone(), 1.0, 1.01))), ["the tangent is the derivative of P"]);

    /// A rubber with a stress of its own for a few components.
    struct Few(Rubber, f64, usize);
    impl Material for Few {
        fn energy(&self, f: &Matrix3<f64>) -> f64 {
            self.0.energy(f)
        }
        fn response(&self, f: &Matrix3<f64>) -> Response {
            self.0.response(f)
        }
        fn respond(&self, f: &Matrix3<f64>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
            let unwritten = tangent.len() * self.2;
            self.0.respond(f, components, stress, tangent);
            stress.iter_mut().for_each(|p| *p *= self.1);
            tangent[..unwritten].fill(f64::NAN);
        }
    }
    assert!(material(&Few(rubber.clone(), 1.0, 0)).holds());
    for few in [Few(rubber.clone(), 1.01, 0), Few(rubber.clone(), 1.0, 1)] {
        assert_eq!(broken(&material(&few)), ["respond gives the components of response"]);
    }

    /// An energy of the invariants whose parts are off by factors.
    struct Parts([f64; 3]);
    impl InvariantEnergy for Parts {
        fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
            let (e1, e2) = (i1 - 3.0, i2 - 3.0);
            let energy = 0.5 * e1 + 0.1 * e1 * e2;
            Distortion {
                energy,
                w1: (0.5 + 0.1 * e2) * self.0[0],
                w2: 0.1 * e1 * self.0[0],
                w12: 0.1 * self.0[0] * self.0[1],
                ..Distortion::default()
            }
        }
        fn evaluate_excess(&self, e1: f64, e2: f64) -> Distortion {
            let exact = self.evaluate(3.0 + e1, 3.0 + e2);
            Distortion { energy: exact.energy * self.0[2], ..exact }
        }
    }
    assert!(invariant_energy(&Parts([1.0; 3])).holds());
    for (parts, law) in [
        ([1.01, 1.0, 1.0], "w1 and w2 are derivatives of the energy"),
        ([1.0, 1.01, 1.0], "w11, w12 and w22 are derivatives of w1 and w2"),
        ([1.0, 1.0, 1.01], "evaluate_excess gives what evaluate gives"),
    ] {
        assert_eq!(broken(&invariant_energy(&Parts(parts))), [law]);
    }

    /// Takes the whole for the distortional part.
    struct Twice(Rubber, QuadraticVolume);
    impl Material for Twice {
        fn energy(&self, f: &Matrix3<f64>) -> f64 {
            self.0.energy(f)
        }
        fn response(&self, f: &Matrix3<f64>) -> Response {
            self.0.response(f)
        }
        fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
            Some((&self.0, &self.1))
        }
    }
    let expected = ["the parts of the split sum to the whole", "the distortional energy does not depend on the volume"];
    assert_eq!(broken(&material(&Twice(rubber, QuadraticVolume::new(10.0).unwrap()))), expected);
}

/// A rubber nearly incompressible whose distortional stress and tangent are off by a factor, in both its forms or
/// in the tangent of its parts alone.
#[test]
fn errors_do_not_hide_behind_a_bulk_modulus() {
    struct Part(Rubber, f64, f64);
    impl Material for Part {
        fn energy(&self, f: &Matrix3<f64>) -> f64 {
            self.0.split().unwrap().0.energy(f)
        }
        fn response(&self, f: &Matrix3<f64>) -> Response {
            let Response { stress, tangent } = self.0.split().unwrap().0.response(f);
            Response { stress: stress * self.1, tangent: tangent * self.2 }
        }
    }
    struct Whole(Part, bool);
    impl Material for Whole {
        fn energy(&self, f: &Matrix3<f64>) -> f64 {
            self.0.0.energy(f)
        }
        fn response(&self, f: &Matrix3<f64>) -> Response {
            let mut whole = self.0.0.response(f);
            if self.1 {
                let (exact, off) = (self.0.0.split().unwrap().0.response(f), self.0.response(f));
                whole.stress += off.stress - exact.stress;
                whole.tangent += off.tangent - exact.tangent;
            }
            whole
        }
        fn split(&self) -> Option<(&dyn Material, &dyn VolumetricEnergy)> {
            Some((&self.0, self.0.0.split().unwrap().1))
        }
    }
    let whole = |stress, tangent, both| Whole(Part(Rubber::neo_hookean(0.5, 1e5).unwrap(), stress, tangent), both);
    assert!(material(&whole(1.0, 1.0, true)).holds());
    let report = material(&whole(1.04, 1.04, true));
    assert_eq!(broken(&report), ["P is the derivative of W"]);
    assert!(report.violations().all(|f| f.at.ends_with("distortional part")), "{report}");
    assert_eq!(broken(&material(&whole(1.0, 1.04, true))), ["the tangent is the derivative of P"]);
    let names = broken(&material(&whole(1.0, 1.0001, false))).join("; ");
    assert_eq!(names, "the tangent is the derivative of P; the parts of the split sum to the whole");
}
