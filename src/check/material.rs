//! The contract of materials.

use nalgebra::{DMatrix, Rotation3};

use crate::each::{Each, list_of};
use crate::geometry::{Mat3, Vec3};
use crate::material::{Distortion, InvariantEnergy, Material, Past, Response, VolumetricEnergy, stable_ranges};
use crate::tensor::{Tangent, Vector9, components, from_components};

use super::{Finding, Report, nearest_difference, signed};

/// Random deformations that are sampled.
const SAMPLES: usize = 60;
/// Principal stretches of the samples go from this to its inverse: inside the domain of any rubber.
const STRETCH: f64 = 0.8;
/// Step of the differences; with the four-point formula the truncation is $h^4$.
const STEP: f64 = 1e-4;
/// What differences leave of exact derivatives.
const TOLERANCE: f64 = 1e-6;
/// Times of two steps of a material that remembers \[time\]: branches of a rubber relax within orders of magnitude around them.
const FIRST: f64 = 0.3;
const SECOND: f64 = 0.7;
/// What rounding leaves of identities.
const ROUNDING: f64 = 1e-10;

/// Checks the contract of [`Material`] at rest and at random $F$ with principal stretches between 0.8 and
/// 1.25: $P = \partial W_e/\partial F$, the tangent $= \partial P/\partial F$ and symmetric, frame indifference,
/// no stress at rest and a tangent that is not negative there. [`Material::respond`], which bodies call, must give what
/// [`Material::response_from`] gives. Where there is a volumetric part, $W_e(sF) = W_e(F)$, and $U'$ and $U''$ are derivatives.
/// A material that remembers is looked at after a first step too, and must give the stress of a step back from the memory that it
/// has just written; beside a kink of $P$ its tangent is that of one side. An energy of the invariants shows itself to
/// [`invariant_energy`]: the material of it calls one of its two ways alone.
///
/// Beside the laws the report says in which stretches the material is stable ([`stable_ranges`]): an unstable one keeps the contract.
///
/// Violations are relative to the size of stress or tangent (whichever of $|P|$ and $|A|\\,|F - I|$ is larger), without the
/// volumetric part, beside which they would vanish.
///
/// ```
/// use rkpm::{check, material::Rubber};
/// assert!(check::material(&Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?).holds());
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
pub fn material(material: &dyn Material) -> Report {
    let mut random = fastrand::Rng::with_seed(2);
    let samples: Vec<Mat3> = list_of(SAMPLES, |_| deformation(&mut random));
    let rest = material.response(&Mat3::identity());
    let stiffness = rest.tangent.norm();

    let mut free = Finding::new("no stress at rest", ROUNDING);
    free.see(rest.stress.norm() / stiffness, || "F = I".into());
    let mut stable = Finding::new("the tangent at rest is not negative", ROUNDING);
    let symmetric = (rest.tangent + rest.tangent.transpose()) * 0.5;
    if symmetric.iter().all(|v| v.is_finite()) {
        let lowest = DMatrix::from_column_slice(9, 9, symmetric.as_slice()).symmetric_eigenvalues().min();
        stable.see((-lowest / stiffness).max(0.0), || "F = I".into());
    } else {
        stable.see(f64::NAN, || "F = I".into());
    }
    let at_rest = material.rest();
    let own = material.response_from(&Mat3::identity(), Past { memory: &at_rest, elapsed: 0.0 }).tangent.norm();
    let mut pasts = vec![(at_rest, 0.0)];
    if material.memory() > 0 {
        let (first, mut next) = (deformation(&mut random), pasts[0].0.clone());
        material.remember(&first, Past { memory: &pasts[0].0, elapsed: FIRST }, &mut next);
        pasts.push((next, SECOND));
    }
    // A fluid has no shape, and nothing but zeros to look at.
    let subject = Subject { material, pasts, stiffness: if own == 0.0 { stiffness } else { own } };
    let mut laws = subject.derivatives(&samples);
    laws.extend(subject.frames(&samples, &mut random));
    laws.push(subject.components_alone(&samples));
    laws.extend((material.memory() > 0).then(|| subject.memory(&samples)));
    let mut report = Report::default().with([free, stable]).with(laws);
    report.ranges = stable_ranges(material);
    match material.volumetric() {
        Some(volumetric) => report.with(subject.volume(volumetric, &samples)),
        None => report
            .unchecked("volumetric part: the material has none and runs in displacement form, uncured against locking"),
    }
}

/// A material with what it may remember, and what its errors are measured against.
struct Subject<'a> {
    material: &'a dyn Material,
    /// Memories, and the time from there.
    pasts: Vec<(Vec<f64>, f64)>,
    stiffness: f64,
}

impl Subject<'_> {
    /// Each past with each sample, and how to name it.
    fn each<'a>(&'a self, samples: &'a [Mat3]) -> impl Iterator<Item = (Past<'a>, &'a Mat3, String)> {
        self.pasts.iter().enumerate().flat_map(move |(number, (memory, elapsed))| {
            let past = Past { memory, elapsed: *elapsed };
            let when = if number == 0 { "" } else { ", after a first step" };
            samples.iter().map(move |f| (past, f, format!("{}{when}", place(f))))
        })
    }

    /// $P$ and tangent against differences.
    fn derivatives(&self, samples: &[Mat3]) -> Vec<Finding> {
        let mut stress = Finding::new("P is the derivative of W", TOLERANCE);
        let mut tangent = Finding::new("the tangent is the derivative of P", TOLERANCE);
        let mut symmetry = Finding::new("the tangent is symmetric", ROUNDING);
        let &Subject { material, stiffness, .. } = self;
        for (past, f, place) in self.each(samples) {
            let Response { stress: p, tangent: a } = material.response_from(f, past);
            let place = || place.clone();
            let (mut p_differences, mut a_differences) = (Vector9::zeros(), Tangent::zeros());
            for c in 0..9 {
                let mut unit = Vector9::zeros();
                unit[c] = 1.0;
                let along = |t: f64| f + from_components(&unit) * t;
                p_differences[c] = difference(|t| Vector9::repeat(material.energy_from(&along(t), past)))[0];
                let stress = |steps: i32| {
                    let f = along(f64::from(steps) * STEP);
                    components(&material.response_from(&f, past).stress).as_slice().to_vec()
                };
                // Where what a material remembers is a bound of its strain, as in one that softens, P has a kink.
                let column: Vector9 = a.column(c).into();
                let differences = nearest_difference(&stress, column.as_slice(), STEP);
                a_differences.set_column(c, &Vector9::from_column_slice(&differences));
            }
            let size = stress_size(&p, f, stiffness);
            stress.see((p_differences - components(&p)).norm() / size, place);
            tangent.see((a_differences - a).norm() / stiffness.max(a.norm()), place);
            symmetry.see((a - a.transpose()).norm() / stiffness.max(a.norm()), place);
        }
        vec![stress, tangent, symmetry]
    }

    /// [`Material::respond`] against the whole response, for the components that plane, radial and solid bodies and the thickness of sheets ask for.
    fn components_alone(&self, samples: &[Mat3]) -> Finding {
        let lists: [&[usize]; 9] = [
            &[0],
            &[8],
            &[0, 4],
            &[0, 4, 8],
            &[0, 1, 3, 4],
            &[0, 1, 3, 4, 8],
            &[1, 5, 6],
            &[2, 7],
            &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        ];
        let mut same = Finding::new("respond gives the components of response_from", ROUNDING);
        let &Subject { material, stiffness, .. } = self;
        for (past, f, place) in self.each(samples) {
            let whole = material.response_from(f, past);
            let size = stress_size(&whole.stress, f, stiffness);
            for list in lists {
                let n = list.len();
                for with_tangent in [false, true] {
                    // What is not written stays a NaN and shows.
                    let mut stress = vec![f64::NAN; n];
                    let mut tangent = vec![f64::NAN; if with_tangent { n * n } else { 0 }];
                    material.respond(f, past, list, &mut stress, &mut tangent);
                    let place = || format!("components {list:?}, {place}");
                    for (stress, &c) in stress.iter().zip(list) {
                        same.see((stress - whole.stress[(c / 3, c % 3)]).abs() / size, place);
                    }
                    for (k, entry) in tangent.iter().enumerate() {
                        let exact = whole.tangent[(list[k / n], list[k % n])];
                        same.see((entry - exact).abs() / stiffness.max(whole.tangent.norm()), place);
                    }
                }
            }
        }
        same
    }

    /// $W(QF) = W(F)$ and $P(QF) = QP(F)$.
    fn frames(&self, samples: &[Mat3], random: &mut fastrand::Rng) -> Vec<Finding> {
        let mut energy = Finding::new("W does not depend on the frame", ROUNDING);
        let mut stress = Finding::new("P turns with the frame", ROUNDING);
        let &Subject { material, stiffness, .. } = self;
        for (past, f, place) in self.each(samples) {
            let q = rotation(random);
            let turned = q * f;
            let place = || format!("Q = {:.4?}, {place}", q.as_slice());
            let change = material.energy_from(&turned, past) - material.energy_from(f, past);
            energy.see(change.abs() / (stiffness * (f - Mat3::identity()).norm_squared()), place);
            let p = material.response_from(f, past).stress;
            let error = material.response_from(&turned, past).stress - q * p;
            stress.see(error.norm() / stress_size(&p, f, stiffness), place);
        }
        vec![energy, stress]
    }

    /// What is remembered of a step gives its stress back.
    fn memory(&self, samples: &[Mat3]) -> Finding {
        let mut back = Finding::new("the memory just written gives the stress of the step back", ROUNDING);
        for (past, f, place) in self.each(samples) {
            let mut next = past.memory.to_vec();
            self.material.remember(f, past, &mut next);
            let stress = self.material.response_from(f, past).stress;
            let again = self.material.response_from(f, Past { memory: &next, elapsed: 0.0 }).stress;
            back.see((again - stress).norm() / stress_size(&stress, f, self.stiffness), || place.clone());
        }
        back
    }

    /// What the volumetric part is, and what it leaves.
    fn volume(&self, volumetric: &dyn VolumetricEnergy, samples: &[Mat3]) -> Vec<Finding> {
        let mut volume = Finding::new("the distortional energy does not depend on the volume", ROUNDING);
        let mut slopes = Finding::new("U' and U'' are derivatives of U", TOLERANCE);
        let bulk = volumetric.evaluate(1.0).curvature.abs();
        let stiffness = self.stiffness.max(bulk);
        for (past, f, place) in self.each(samples) {
            let j = f.determinant();
            let u = volumetric.evaluate(j);
            let strain = (f - Mat3::identity()).norm_squared();
            let change = self.material.energy_from(&(f * 1.1), past) - self.material.energy_from(f, past);
            volume.see(change.abs() / (stiffness * strain), || place.clone());
            let first = difference(|t| Vector9::repeat(volumetric.evaluate(j + t).energy))[0];
            let second = difference(|t| Vector9::repeat(volumetric.evaluate(j + t).slope))[0];
            slopes.see((first - u.slope).abs().max((second - u.curvature).abs()) / bulk, || place.clone());
        }
        vec![volume, slopes]
    }
}

/// Checks the contract of [`InvariantEnergy`] at the invariants of the same random $F$: the first and second
/// derivatives are those of the energy, and [`InvariantEnergy::evaluate_excess`], which [`Invariants`] calls, gives
/// what [`InvariantEnergy::evaluate`] gives.
///
/// [`Invariants`]: crate::material::Invariants
///
/// ```
/// use rkpm::{check, material::Gent};
/// assert!(check::invariant_energy(&Gent::new(1.0, 30.0)?).holds());
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
pub fn invariant_energy(energy: &dyn InvariantEnergy) -> Report {
    let mut random = fastrand::Rng::with_seed(2);
    let mut same = Finding::new("evaluate_excess gives what evaluate gives", ROUNDING);
    let mut first = Finding::new("w1 and w2 are derivatives of the energy", TOLERANCE);
    let mut second = Finding::new("w11, w12 and w22 are derivatives of w1 and w2", TOLERANCE);
    let list = |d: &Distortion| [d.energy, d.w1, d.w2, d.w11, d.w12, d.w22];
    for _ in 0..SAMPLES {
        let f = deformation(&mut random);
        let bar = f / f.determinant().cbrt();
        let (i1, i2) = (bar.norm_squared(), crate::tensor::cofactor(&bar).norm_squared());
        let place = || format!("I1 = {i1}, I2 = {i2}");
        let exact = energy.evaluate(i1, i2);
        let size = list(&exact)[1..].summed(|w| w.abs());
        let excess = list(&energy.evaluate_excess(i1 - 3.0, i2 - 3.0));
        for (a, b) in excess.iter().zip(list(&exact)) {
            same.see((a - b).abs() / size, place);
        }
        let along = |unit: [f64; 2]| {
            difference(|t| {
                let moved = list(&energy.evaluate(i1 + unit[0] * t, i2 + unit[1] * t));
                Vector9::from_fn(|k, _| moved.get(k).copied().unwrap_or(0.0))
            })
        };
        let (by_first, by_second) = (along([1.0, 0.0]), along([0.0, 1.0]));
        first.see(((by_first[0] - exact.w1).abs() + (by_second[0] - exact.w2).abs()) / size, place);
        let errors = [by_first[1] - exact.w11, by_second[1] - exact.w12, by_first[2] - exact.w12];
        let error = errors.summed(|e| e.abs()) + (by_second[2] - exact.w22).abs();
        second.see(error / size, place);
    }
    Report::default().with([same, first, second])
}

/// $f'(0)$ by the four-point central difference.
fn difference(f: impl Fn(f64) -> Vector9) -> Vector9 {
    ((f(STEP) - f(-STEP)) * 8.0 - (f(2.0 * STEP) - f(-2.0 * STEP))) / (12.0 * STEP)
}

/// What an error of the stress is measured against.
fn stress_size(p: &Mat3, f: &Mat3, stiffness: f64) -> f64 {
    p.norm().max(stiffness * (f - Mat3::identity()).norm())
}

fn place(f: &Mat3) -> String {
    format!("F = {:.4?} (row by row)", components(f).as_slice())
}

fn rotation(random: &mut fastrand::Rng) -> Mat3 {
    let axis = Vec3::from_fn(|_, _| 3.0 * signed(random));
    Rotation3::new(axis).into_inner()
}

/// A random deformation: rotations around random principal stretches.
fn deformation(random: &mut fastrand::Rng) -> Mat3 {
    let stretches = Vec3::from_fn(|_, _| STRETCH.powf(signed(random)));
    rotation(random) * Mat3::from_diagonal(&stretches) * rotation(random)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{
        Gent, Invariants, LogarithmicVolume, MixedLogarithmicVolume, Mullins, NearlyIncompressible, Prestretched,
        Prony, QuadraticVolume, Rubber, Viscoelastic,
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
        fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
            0.5 * (f - Mat3::identity()).norm_squared()
        }
        fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
            Response { stress: f - Mat3::identity(), tangent: Tangent::identity() }
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
            fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
                self.0.energy(f)
            }
            fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
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
            fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
                self.0.energy(f)
            }
            fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
                self.0.response(f)
            }
            fn respond(&self, f: &Mat3, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
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
            fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
                self.0.energy(f)
            }
            fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
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
            fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
                self.0.energy_from(f, past)
            }
            fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
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
            Box::new(Prestretched::new(Viscoelastic::new(filled(), prony()), Mat3::identity()).unwrap()),
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
            fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
                self.0.energy_from(f, past)
            }
            fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
                // Softer by a part that should have been remembered.
                let Response { stress, tangent } = self.0.response_from(f, past);
                let part = if past.elapsed > 0.0 { 0.9 } else { 1.0 };
                Response { stress: stress * part, tangent: tangent * part }
            }
        }
        let found = material(&Forgets(filled()));
        assert!(broken(&found).contains(&"the memory just written gives the stress of the step back"), "{found}");
    }
}
