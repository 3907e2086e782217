//! What is promised, tried.

use super::*;
use crate::material::{
    Gent, Invariants, LogarithmicVolume, MixedLogarithmicVolume, Mullins, NearlyIncompressible, Prestretched, Prony,
    QuadraticVolume, Rubber, Viscoelastic,
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
    fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
        0.5 * (f - Matrix3::identity()).norm_squared()
    }
    fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
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
        fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
            self.0.energy(f)
        }
        fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
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
        fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
            self.0.energy(f)
        }
        fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
            self.0.response(f)
        }
        fn respond(&self, f: &Matrix3<f64>, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
            let unwritten = tangent.len() * self.2;
            self.response_from(f, past).select(of, stress, tangent);
            stress.iter_mut().for_each(|p| *p *= self.1);
            tangent[..unwritten].fill(f64::NAN);
        }
    }
    assert!(material(&Few(rubber.clone(), 1.0, 0)).holds());
    for few in [Few(rubber.clone(), 1.01, 0), Few(rubber.clone(), 1.0, 1)] {
        assert_eq!(broken(&material(&few)), ["respond gives the components of response_from"]);
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
        fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
            self.0.energy(f)
        }
        fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
            self.0.response(f)
        }
        fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
            Some(&self.1)
        }
    }
    let expected = ["the distortional energy does not depend on the volume"];
    assert_eq!(broken(&material(&Twice(rubber, QuadraticVolume::new(10.0).unwrap()))), expected);
}

/// A rubber nearly incompressible whose distortional stress and tangent are off by a factor.
#[test]
fn errors_do_not_hide_behind_a_bulk_modulus() {
    struct Part(Rubber, f64, f64);
    impl Material for Part {
        fn energy_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> f64 {
            self.0.energy_from(f, past)
        }
        fn response_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> Response {
            let Response { stress, tangent } = self.0.response_from(f, past);
            Response { stress: stress * self.1, tangent: tangent * self.2 }
        }
        fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
            self.0.volumetric()
        }
    }
    let part = |stress, tangent| material(&Part(Rubber::neo_hookean(0.5, 1e5).unwrap(), stress, tangent));
    assert!(part(1.0, 1.0).holds());
    assert_eq!(broken(&part(1.04, 1.04)), ["P is the derivative of W"]);
    assert_eq!(broken(&part(1.0, 1.04)), ["the tangent is the derivative of P"]);
}

/// Laws that remember hold in each other and in all that wraps them; what forgets a part of its memory is found out.
#[test]
fn laws_that_remember_hold_in_laws_that_do() {
    let rubber = || Rubber::mooney_rivlin(0.3, 0.1, 1e3).unwrap();
    let foam = || Rubber::blatz_ko(0.4, 0.25, 0.3).unwrap();
    let prony = || Prony::of_instantaneous([(0.3, 0.5), (0.2, 4.0)]).unwrap();
    let filled = || Mullins::new(rubber(), 1.5, 0.2, 0.1).unwrap();
    let laws: [Box<dyn Material>; 8] = [
        Box::new(Viscoelastic::new(rubber(), prony())),
        Box::new(Viscoelastic::new(foam(), prony())),
        Box::new(filled()),
        Box::new(Viscoelastic::new(filled(), prony())),
        Box::new(Viscoelastic::new(Mullins::new(foam(), 1.5, 0.2, 0.1).unwrap(), prony())),
        Box::new(Viscoelastic::new(Viscoelastic::new(rubber(), prony()), prony())),
        Box::new(Viscoelastic::new(std::sync::Arc::new(filled()) as std::sync::Arc<dyn Material>, prony())),
        Box::new(Prestretched::new(Viscoelastic::new(filled(), prony()), Matrix3::identity()).unwrap()),
    ];
    for (number, law) in laws.iter().enumerate() {
        let report = material(law);
        assert!(report.holds() && law.memory() > 0, "{number}: {report}");
    }

    /// Softens, and writes nothing down.
    struct Forgets(Mullins<Rubber>);
    impl Material for Forgets {
        fn inner(&self) -> Option<&dyn Material> {
            Some(&self.0)
        }
        fn energy_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> f64 {
            self.0.energy_from(f, past)
        }
        fn response_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> Response {
            // Softer by a part that should have been remembered.
            let Response { stress, tangent } = self.0.response_from(f, past);
            let part = if past.elapsed > 0.0 { 0.9 } else { 1.0 };
            Response { stress: stress * part, tangent: tangent * part }
        }
    }
    let found = material(&Forgets(filled()));
    assert!(broken(&found).contains(&"the memory just written gives the stress of the step back"), "{found}");
}
