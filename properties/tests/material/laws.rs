//! Laws of the materials: stress and tangent are derivatives of the energy, energies do not see rotations,
//! the stress of the paper (2.13) is the same thing, and so are the published curves.

use std::sync::Arc;

use crate::oracle::{Shape, VOLUMES, Volume, constants, deformation, material, nearly_equal, oracle, paper, rotation};
use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rkpm::error::MaterialError;
use rkpm::material::{
    ExistenceVerdict, Gent, HartmannNeffVolume, Hencky, Invariants, Material, NearlyIncompressible, Ogden, Past,
    Response, RivlinPolynomial, Rubber,
};
use rkpm::nalgebra;
use rkpm::tensor::{Tangent, add_determinant_hessian, cofactor, components, from_components};

fn config(seed: u64) -> ProptestConfig {
    ProptestConfig { cases: 256, rng_seed: RngSeed::Fixed(seed), failure_persistence: None, ..Default::default() }
}

fn compare(f: &Matrix3<f64>, shape: Shape, volume: Volume, k: f64) -> Result<(), TestCaseError> {
    let (value, stress, tangent) = oracle(f, shape, volume, k);
    let subject = material(shape, volume, k);
    let response = subject.response(f);
    // Rounding of the oracle's powers and logarithms, relative to the largest part of each result.
    prop_assert!(abs_diff_eq!(subject.energy(f), value, epsilon = 1e-10 * (1.0 + value.abs())));
    prop_assert!(abs_diff_eq!(response.stress, stress, epsilon = 3e-11 * (1.0 + stress.norm())), "stress");
    prop_assert!(abs_diff_eq!(response.tangent, tangent, epsilon = 1e-11 * (1.0 + tangent.norm())), "tangent");
    // Exact up to the order of the sums.
    prop_assert!(abs_diff_eq!(response.tangent, response.tangent.transpose(), epsilon = 1e-14 * tangent.norm()));
    // A few components are those of all, and stresses alone the same bits.
    let response = subject.response_from(f, Past::NONE);
    for few in [&[0, 1, 3, 4][..], &[0, 1, 3, 4, 8], &[0, 1, 2, 3, 4, 5, 6, 7, 8]] {
        let n = few.len();
        let (mut some, mut alone, mut block) = (vec![0.0; n], vec![0.0; n], vec![0.0; n * n]);
        subject.respond(f, Past::NONE, few, &mut some, &mut block);
        subject.respond(f, Past::NONE, few, &mut alone, &mut []);
        prop_assert_eq!(&some, &alone);
        for (i, &c) in few.iter().enumerate() {
            prop_assert!(abs_diff_eq!(
                some[i],
                response.stress[(c / 3, c % 3)],
                epsilon = 1e-12 * response.stress.norm()
            ));
            for (j, &d) in few.iter().enumerate() {
                prop_assert!(abs_diff_eq!(
                    block[i * n + j],
                    response.tangent[(c, d)],
                    epsilon = 1e-12 * response.tangent.norm()
                ));
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(config(1))]

    #[test]
    fn polynomial_stress_and_tangent_are_derivatives(f in deformation(), a in constants(), k in 1.0..1e3f64) {
        for volume in VOLUMES {
            compare(&f, Shape::Polynomial(a), volume, k)?;
        }
    }

    #[test]
    fn gent_stress_and_tangent_are_derivatives(f in deformation(), shear in 0.1..2.0f64) {
        // Stretches up to 2 reach Ī₁ of about 13.
        compare(&f, Shape::Gent(shear, 30.0), Volume::Quadratic, 100.0)?;
    }

    #[test]
    fn ogden_and_hencky_stress_and_tangent_are_derivatives(
        f in prop_oneof![deformation(), nearly_equal()],
        shear in 0.1..2.0f64,
        exponents in [0.5..6.0f64, 0.5..6.0f64, 0.5..4.0f64],
    ) {
        let [a, b, c] = exponents;
        compare(&f, Shape::Ogden([(shear / a, a), (0.1 / b, b), (-0.2 / c, -c)]), Volume::Quadratic, 10.0)?;
        compare(&f, Shape::Hencky(shear), Volume::Logarithmic, 10.0)?;
    }

    #[test]
    fn named_laws_stress_and_tangent_are_derivatives(
        f in prop_oneof![deformation(), nearly_equal()],
        shear in 0.1..2.0f64,
        second in -0.05..0.3f64,
        locking in 1.5..8.0f64,
        [beta, delta, nu] in [0.1..3.0f64, 0.0..0.25f64, -0.4..0.48f64],
    ) {
        for shape in [
            Shape::ArrudaBoyce(shear, locking),
            Shape::Carroll([shear, 1e-3 * second, second]),
            Shape::GentGent([shear, 30.0, second]),
            // Stretches up to 2 at det F down to 1/8 reach D = 13.
            Shape::ExtendedTube([shear, 0.3, beta, delta]),
            Shape::Foam([[shear, beta, nu], [0.2 * shear, -2.0, 0.25]]),
            Shape::Foam([[shear, 2.0 * beta, 0.0], [0.1, -2.0, 0.3]]),
        ] {
            compare(&f, shape, Volume::Quadratic, 10.0)?;
        }
    }

    #[test]
    fn energy_does_not_see_rotations(f in deformation(), q in rotation(), a in constants()) {
        let ogden = Shape::Ogden([(0.6, 1.3), (0.001, 5.0), (-0.01, -2.0)]);
        let foam = Shape::Foam([[0.5, 3.0, 0.2], [0.2, -2.0, 0.0]]);
        let tube = Shape::ExtendedTube([0.5, 0.2, 0.3, 0.1]);
        for shape in [Shape::Polynomial(a), Shape::Gent(0.7, 30.0), ogden, Shape::Hencky(0.7), foam, tube] {
            let subject = material(shape, Volume::Quadratic, 50.0);
            let (before, after) = (subject.response(&f), subject.response(&(q * f)));
            // Rounding of products of rotations, relative to the size of the stress and its parts (k = 50).
            let size = 1.0 + before.stress.norm() + 50.0 * f.norm_squared();
            let energy = subject.energy(&f);
            prop_assert!(abs_diff_eq!(energy, subject.energy(&(q * f)), epsilon = 1e-12 * (energy.abs() + size)));
            prop_assert!(abs_diff_eq!(after.stress, q * before.stress, epsilon = 3e-13 * size));
            // Isotropy: nor do they see how the reference was turned.
            prop_assert!(abs_diff_eq!(energy, subject.energy(&(f * q)), epsilon = 1e-12 * (energy.abs() + size)));
            // Nothing is felt in a rotation alone, and not even rounding at rest.
            prop_assert!(abs_diff_eq!(subject.response(&q).stress, Matrix3::zeros(), epsilon = 3e-13 * 50.0));
            prop_assert!(abs_diff_eq!(subject.response(&Matrix3::identity()).stress, Matrix3::zeros(), epsilon = 3e-16));
        }
    }

    #[test]
    fn the_papers_formulas_give_the_same(f in deformation(), a in constants(), k in 1.0..100.0f64) {
        let subject = material(Shape::Polynomial(a), Volume::Quadratic, k);
        let Response { stress, tangent } = subject.response(&f);
        let (s, c) = paper(&f, a, k);
        // The same numbers by another route: rounding alone.
        prop_assert!(abs_diff_eq!(f * s, stress, epsilon = 3e-13 * (s.norm() * f.norm()).max(1.0)));
        let mut expected = Tangent::zeros();
        for i in 0..3 { for j in 0..3 { for m in 0..3 { for l in 0..3 {
            let mut value = if i == m { s[(j, l)] } else { 0.0 };
            for p in 0..3 { for q in 0..3 { value += f[(i, p)] * f[(m, q)] * c[p][j][q][l]; } }
            expected[(3 * i + j, 3 * m + l)] = value;
        }}}}
        prop_assert!(abs_diff_eq!(expected, tangent, epsilon = 1e-13 * expected.norm().max(1.0)));
    }
}

#[test]
fn moduli_at_rest() {
    let rubber = Rubber::mooney_rivlin(0.3, 0.1, 1e3).unwrap();
    // µ = 2 (A10 + A01); differences of order k are rounding.
    assert_abs_diff_eq!(rubber.initial_moduli().shear, 0.8, epsilon = 1e-12);
    assert_abs_diff_eq!(rubber.initial_moduli().bulk, 1e3, epsilon = 1e-9);
}

#[test]
fn states_outside_the_domain_are_not_finite_and_do_not_panic() {
    let rubber = Rubber::neo_hookean(0.4, 1e3).unwrap();
    let flipped = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    assert!(!rubber.response(&flipped).stress.norm().is_finite());
    assert!(rubber.energy(&Matrix3::zeros()).is_nan());
    let gent = Invariants(Gent::new(1.0, 2.0).unwrap());
    let locked = Matrix3::from_diagonal(&Vector3::new(4.0, 0.5, 0.5));
    assert!(gent.energy(&locked).is_nan() && !gent.response(&locked).stress.norm().is_finite());
}

#[test]
fn bad_constants_are_named() {
    let name = |error: MaterialError| match error {
        MaterialError::Invalid(invalid) => invalid.what.trim_start_matches("material constant ").to_string(),
        other => panic!("{other}"),
    };
    assert_eq!(name(Rubber::neo_hookean(f64::NAN, 1.0).unwrap_err()), "A_10");
    assert_eq!(name(Rubber::neo_hookean(1.0, 0.0).unwrap_err()), "k");
    assert_eq!(name(Rubber::polynomial([((0, 0), 1.0)], 1.0).unwrap_err()), "A_00");
    assert_eq!(name(Rubber::polynomial([((40, 0), 1.0)], 1.0).unwrap_err()), "A_400");
    assert_eq!(name(Gent::new(1.0, f64::INFINITY).unwrap_err()), "J_m");
    assert_eq!(Rubber::polynomial([], 1.0).unwrap_err(), MaterialError::Empty);
    let message = Rubber::yeoh(1.0, 0.0, 0.0, -5.0).unwrap_err().to_string();
    assert!(message.contains("bulk modulus") && message.contains("above zero"), "{message}");
    assert_eq!(name(Rubber::neo_hookean(-0.4, 1.0).unwrap_err()), "A_10");
    assert_eq!(name(Rubber::mooney_rivlin(0.2, -0.3, 1.0).unwrap_err()), "A_10 + A_01");
    assert_eq!(name(Rubber::mooney_rivlin(0.2, f64::NAN, 1.0).unwrap_err()), "A_01");
    assert_eq!(RivlinPolynomial::new([((1, 0), 0.0)]).unwrap_err(), MaterialError::Empty);
    assert_eq!(name(Hencky::new(0.0).unwrap_err()), "mu");
    assert_eq!(name(Ogden::new([(1.0, 2.0), (1.0, 0.0)]).unwrap_err()), "alpha_2");
    assert_eq!(name(Ogden::new([(f64::NAN, 2.0)]).unwrap_err()), "mu_1");
    assert!(name(Ogden::new([]).unwrap_err()).contains("initial shear modulus"));
    assert_eq!(name(Rubber::arruda_boyce(1.0, 0.0, 1.0).unwrap_err()), "lambda_m");
    assert_eq!(name(Rubber::extended_tube(0.1, -1.0, 0.3, 0.1, 1.0).unwrap_err()), "G_e");
    assert_eq!(name(Rubber::extended_tube(0.1, 1.0, 0.3, 1.0, 1.0).unwrap_err()), "delta");
    assert_eq!(name(Rubber::carroll(0.1, f64::NAN, 0.3, 1.0).unwrap_err()), "B");
    assert_eq!(name(Rubber::gent_gent(0.1, 10.0, f64::NAN, 1.0).unwrap_err()), "C_2");
    assert_eq!(name(Rubber::blatz_ko(0.1, 0.5, 0.0).unwrap_err()), "nu_1");
    assert_eq!(name(Rubber::blatz_ko(0.1, 0.25, 1.5).unwrap_err()), "f");
    assert!(name(Rubber::foam([]).unwrap_err()).contains("initial shear modulus"));
    assert_eq!(name(HartmannNeffVolume::new(f64::INFINITY).unwrap_err()), "k");
}

#[test]
fn every_energy_has_the_moduli_it_was_given() {
    for volume in VOLUMES {
        for shape in [Shape::Gent(0.8, 30.0), Shape::Hencky(0.8), Shape::Ogden([(0.4, 2.0), (-0.1, -4.0), (0.4, 1.0)])]
        {
            let subject = material(shape, volume, 50.0);
            assert!(abs_diff_eq!(subject.initial_moduli().shear, 0.8, epsilon = 1e-13), "{shape:?} {volume:?}");
            assert!(abs_diff_eq!(subject.initial_moduli().bulk, 50.0, epsilon = 1e-12), "{shape:?} {volume:?}");
        }
    }
}

#[test]
fn small_strains_keep_their_energy() {
    // Simple shear has Ī₁ - 3 = Ī₂ - 3 = γ² exactly; at γ = 1e-7 that is 45 units of rounding of 3.
    let gamma = 1e-7;
    let mut f = Matrix3::identity();
    f[(0, 1)] = gamma;
    for (shape, shear) in [
        (Shape::Polynomial([0.3, 0.1, 0.5, 0.5, 0.5, 0.1, 0.1]), 0.8),
        (Shape::Carroll([0.4, 0.0, 0.0]), 0.8),
        (Shape::GentGent([0.6, 20.0, 0.3]), 0.8),
        (Shape::Gent(0.8, 20.0), 0.8),
        (Shape::Hencky(0.8), 0.8),
    ] {
        let exact = 0.5 * shear * gamma * gamma;
        // W itself departs from its quadratic part by a relative γ²; F and its stretches carry 1e-16/γ.
        let energy = material(shape, Volume::Quadratic, 10.0).energy(&f);
        assert!(relative_eq!(energy, exact, epsilon = 0.0, max_relative = 1e-8), "{shape:?}: {energy:e} {exact:e}");
    }
}

#[test]
fn pointers_and_parts_answer_as_the_whole() {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap();
    let f = Matrix3::new(1.1, 0.2, -0.1, 0.05, 0.95, 0.1, 0.0, 0.1, 1.02);
    let expected = rubber.response(&f);
    let shared: Arc<dyn Material> = Arc::new(rubber.clone());
    let boxed: Box<dyn Material> = Box::new(&rubber);
    assert_eq!(shared.response(&f), expected);
    assert_eq!(boxed.response(&f), expected);
    let put_together = NearlyIncompressible { distortional: &boxed, volumetric: boxed.volumetric().unwrap() };
    assert_eq!(put_together.response(&f), expected);
    let volumetric = boxed.volumetric().unwrap().evaluate(f.determinant());
    assert_eq!(boxed.energy_from(&f, Past::NONE) + volumetric.energy, rubber.energy(&f));
}

/// W = µ/2 (I1 - 3) - µ ln J + λ/2 (ln J)², a material that isn't split: all that a user has to write.
struct CompressibleNeoHookean {
    lambda: f64,
    mu: f64,
}

impl Material for CompressibleNeoHookean {
    fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
        let logarithm = f.determinant().ln();
        0.5 * self.mu * (f.norm_squared() - 3.0) - self.mu * logarithm + 0.5 * self.lambda * logarithm * logarithm
    }
    fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
        let j = f.determinant();
        let (normal, pressure) = (cofactor(f) / j, self.lambda * j.ln() - self.mu);
        let n = components(&normal);
        let mut tangent = self.mu * Tangent::identity() + (self.lambda - pressure) * n * n.transpose();
        add_determinant_hessian(&mut tangent, f, pressure / j);
        Response { stress: self.mu * f + pressure * normal, tangent }
    }
}

#[test]
fn a_users_material_is_twenty_lines() {
    let subject = CompressibleNeoHookean { lambda: 3.0, mu: 0.5 };
    let f = Matrix3::new(1.1, 0.2, -0.3, 0.05, 0.9, 0.4, -0.2, 0.1, 1.3);
    let Response { stress, tangent } = subject.response(&f);
    let step = 1e-5;
    for c in 0..9 {
        let mut direction = components(&Matrix3::zeros());
        direction[c] = step;
        let (ahead, behind) = (f + from_components(&direction), f - from_components(&direction));
        // Central differences: a truncation of step² beside rounding of 1e-16/step.
        let slope = (subject.energy(&ahead) - subject.energy(&behind)) / (2.0 * step);
        assert_abs_diff_eq!(slope, components(&stress)[c], epsilon = 1e-8);
        let column = (subject.response(&ahead).stress - subject.response(&behind).stress) / (2.0 * step);
        assert_abs_diff_eq!(components(&column), tangent.column(c).into_owned(), epsilon = 5e-9);
    }
    assert!(subject.volumetric().is_none());
    assert_abs_diff_eq!(subject.initial_moduli().shear, 0.5, epsilon = 1e-15);
}

/// The rows of a reference table: comments and the line of names left out.
fn rows(table: &str) -> impl Iterator<Item = Vec<f64>> + '_ {
    table.lines().filter_map(|line| line.split(',').map(|entry| entry.trim().parse().ok()).collect())
}

fn papers_rubber() -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap()
}

/// GOAL: stress and energy of the paper's rubber in plane-strain tension and compression.
/// REFERENCE: tests/reference/uniaxial_plane_strain.csv, 12 digits, relative error below 1e-10.
#[test]
fn plane_strain_uniaxial_states_match_their_reference() {
    let rubber = papers_rubber();
    let mut count = 0;
    for row in rows(include_str!("../../../tests/reference/uniaxial_plane_strain.csv")) {
        let [lambda, cauchy, _, _, _, second, stress, thickness, energy] = row[..] else {
            panic!("nine columns expected: {row:?}")
        };
        // P22 = 0 by Newton from the incompressible answer.
        let mut f = Matrix3::from_diagonal(&Vector3::new(lambda, 1.0 / lambda, 1.0));
        for _ in 0..30 {
            let response = rubber.response(&f);
            let step = response.stress.m22 / response.tangent[(4, 4)];
            f.m22 -= step;
            if step.abs() < 1e-15 * f.m22 {
                break;
            }
        }
        let Response { stress: p, .. } = rubber.response(&f);
        count += 1;
        let j = f.determinant();
        // J - 1 carries a rounding of 2e-16, the pressure one of 1e5 × 2e-16 MPa; λ has six decimals as listed.
        for (ours, reference) in [
            (f.m22, second),
            (p.m11, stress),
            (p.m11 * lambda / j, cauchy),
            (p.m33 / j, thickness),
            (rubber.energy(&f), energy),
        ] {
            assert!(relative_eq!(ours, reference, epsilon = 1e-9, max_relative = 1e-9), "{lambda}: {ours} {reference}");
        }
    }
    assert!(count > 80, "{count} rows");
}

/// GOAL: the paper's rubber in simple shear. REFERENCE: tests/reference/simple_shear.csv, exact.
#[test]
fn simple_shear_matches_its_reference() {
    let rubber = papers_rubber();
    let mut count = 0;
    for row in rows(include_str!("../../../tests/reference/simple_shear.csv")) {
        let [gamma, s12, s11, s22, s33, p12, energy] = row[..] else { panic!("seven columns expected: {row:?}") };
        let mut f = Matrix3::identity();
        f[(0, 1)] = gamma;
        let stress = rubber.response(&f).stress;
        // J = 1 exactly, so the Cauchy stress is P Fᵀ.
        let cauchy = stress * f.transpose();
        let ours = [cauchy.m12, cauchy.m11, cauchy.m22, cauchy.m33, stress.m12, rubber.energy(&f)];
        for (ours, reference) in ours.into_iter().zip([s12, s11, s22, s33, p12, energy]) {
            assert!(
                abs_diff_eq!(ours, reference, epsilon = 1e-11 * (1.0 + reference.abs())),
                "{gamma}: {ours} {reference}"
            );
        }
        count += 1;
    }
    assert!(count >= 40, "{count} rows");
}

#[test]
fn existence_conditions_of_the_papers_rubber() {
    // Expanded in powers of Ī₁, 0.373 x - 0.031 x² + 0.005 x³ has a negative square: -0.031 - 9 × 0.005.
    let report = papers_rubber().existence();
    let failing: Vec<_> =
        report.conditions.iter().filter(|c| c.verdict == ExistenceVerdict::Fails).map(|c| c.equation).collect();
    assert_eq!(failing, ["5.8", "5.10"], "{report}");
    assert_eq!((report.alpha, report.gamma), (Some(6.0), Some(2.0)));
}
