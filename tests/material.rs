//! Laws of the materials: stress and tangent are derivatives of the energy, energies do not see rotations,
//! and the stress of the paper (2.13) is the same thing.

use nalgebra::{Matrix3, Rotation3, Vector3};
use num_dual::{DualNum, HyperDual64};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rkpm::error::MaterialError;
use rkpm::material::{
    Gent, Invariants, LogarithmicVolume, Material, MixedLogarithmicVolume, NearlyIncompressible, QuadraticVolume,
    Response, RivlinPolynomial, Rubber, VolumetricEnergy, initial_bulk_modulus, initial_shear_modulus,
};
use rkpm::nalgebra;
use rkpm::tensor::Tangent;

fn config(seed: u64) -> ProptestConfig {
    ProptestConfig { cases: 256, rng_seed: RngSeed::Fixed(seed), failure_persistence: None, ..Default::default() }
}

/// Rotations times stretches of 0.5 to 2, so that det F lies between 1/8 and 8.
fn deformation() -> impl Strategy<Value = Matrix3<f64>> {
    let angle = -3.1..3.1f64;
    let stretch = 0.5..2.0f64;
    (
        [angle.clone(), angle.clone(), angle.clone()],
        [stretch.clone(), stretch.clone(), stretch],
        [angle.clone(), angle.clone(), angle],
    )
        .prop_map(|(a, s, b)| {
            let rotation = |r: [f64; 3]| Rotation3::from_euler_angles(r[0], r[1], r[2]).into_inner();
            rotation(a) * Matrix3::from_diagonal(&Vector3::new(s[0], s[1], s[2])) * rotation(b)
        })
}

fn rotation() -> impl Strategy<Value = Matrix3<f64>> {
    [-3.1..3.1f64, -3.1..3.1f64, -3.1..3.1f64].prop_map(|r| Rotation3::from_euler_angles(r[0], r[1], r[2]).into_inner())
}

const EXPONENTS: [(u32, u32); 7] = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1)];

fn constants() -> impl Strategy<Value = [f64; 7]> {
    [-0.1..1.0f64, -0.1..1.0f64, -0.1..0.1f64, -0.1..0.1f64, -0.1..0.1f64, -0.01..0.01f64, -0.01..0.01f64]
}

/// Which volumetric energy an oracle takes.
#[derive(Clone, Copy, Debug)]
enum Volume {
    Quadratic,
    MixedLogarithmic,
    Logarithmic,
}

/// Which distortional energy an oracle takes.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Polynomial([f64; 7]),
    Gent(f64, f64),
}

type T = HyperDual64;

/// W(F) straight from its definition (2.8)–(2.12), in hyper-dual numbers.
fn energy(f: &[T; 9], shape: Shape, volume: Volume, k: f64) -> T {
    let at = |i: usize, j: usize| f[3 * i + j];
    let j = at(0, 0) * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1))
        - at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0))
        + at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0));
    let mut g = [[T::from(0.0); 3]; 3];
    for (a, row) in g.iter_mut().enumerate() {
        for (b, entry) in row.iter_mut().enumerate() {
            for m in 0..3 {
                *entry += at(m, a) * at(m, b);
            }
        }
    }
    let i1 = g[0][0] + g[1][1] + g[2][2];
    let mut square = T::from(0.0);
    for row in &g {
        for entry in row {
            square += *entry * *entry;
        }
    }
    let i2 = (i1 * i1 - square) * 0.5;
    let b1 = i1 * j.powf(-2.0 / 3.0) - 3.0;
    let b2 = i2 * j.powf(-4.0 / 3.0) - 3.0;
    let distortional = match shape {
        Shape::Polynomial(a) => {
            let mut sum = T::from(0.0);
            for (&(m, n), &a) in EXPONENTS.iter().zip(&a) {
                sum += b1.powi(m as i32) * b2.powi(n as i32) * a;
            }
            sum
        }
        Shape::Gent(shear, limit) => (T::from(1.0) - b1 / limit).ln() * (-0.5 * shear * limit),
    };
    let volumetric = match volume {
        Volume::Quadratic => (j - 1.0) * (j - 1.0) * (0.5 * k),
        Volume::MixedLogarithmic => (j * j - 1.0 - j.ln() * 2.0) * (0.25 * k),
        Volume::Logarithmic => j.ln() * j.ln() * (0.5 * k),
    };
    distortional + volumetric
}

/// The material under test for the same choice.
fn material(shape: Shape, volume: Volume, k: f64) -> Box<dyn Material> {
    fn with(shape: Shape, volumetric: impl VolumetricEnergy + 'static) -> Box<dyn Material> {
        match shape {
            Shape::Polynomial(a) => {
                let terms = EXPONENTS.iter().zip(a).map(|(&e, a)| (e, a));
                let distortional = Invariants(RivlinPolynomial::new(terms).unwrap());
                Box::new(NearlyIncompressible { distortional, volumetric })
            }
            Shape::Gent(shear, limit) => {
                let distortional = Invariants(Gent::new(shear, limit).unwrap());
                Box::new(NearlyIncompressible { distortional, volumetric })
            }
        }
    }
    match volume {
        Volume::Quadratic => with(shape, QuadraticVolume::new(k).unwrap()),
        Volume::MixedLogarithmic => with(shape, MixedLogarithmicVolume::new(k).unwrap()),
        Volume::Logarithmic => with(shape, LogarithmicVolume::new(k).unwrap()),
    }
}

/// Gradient and Hessian of the oracle by hyper-dual numbers: exact to rounding.
fn oracle(f: &Matrix3<f64>, shape: Shape, volume: Volume, k: f64) -> (f64, Matrix3<f64>, Tangent) {
    let mut stress = Matrix3::zeros();
    let mut tangent = Tangent::zeros();
    let mut value = 0.0;
    for c in 0..9 {
        for e in 0..=c {
            let mut x = [HyperDual64::from(0.0); 9];
            for (n, entry) in x.iter_mut().enumerate() {
                *entry = HyperDual64::from(f[(n / 3, n % 3)]);
            }
            x[c].eps1 = 1.0;
            x[e].eps2 = 1.0;
            let w = energy(&x, shape, volume, k);
            value = w.re;
            stress[(c / 3, c % 3)] = w.eps1;
            tangent[(c, e)] = w.eps1eps2;
            tangent[(e, c)] = w.eps1eps2;
        }
    }
    (value, stress, tangent)
}

fn compare(f: &Matrix3<f64>, shape: Shape, volume: Volume, k: f64) -> Result<(), TestCaseError> {
    let (value, stress, tangent) = oracle(f, shape, volume, k);
    let subject = material(shape, volume, k);
    let response = subject.response(f);
    // Rounding of the oracle's powers and logarithms, relative to the largest part of each result.
    prop_assert!((subject.energy(f) - value).abs() <= 1e-10 * (1.0 + value.abs()));
    prop_assert!((response.stress - stress).norm() <= 1e-10 * (1.0 + stress.norm()), "stress");
    prop_assert!((response.tangent - tangent).norm() <= 1e-10 * (1.0 + tangent.norm()), "tangent");
    // Exact up to the order of the sums.
    prop_assert!((response.tangent - response.tangent.transpose()).norm() <= 1e-13 * tangent.norm());
    Ok(())
}

proptest! {
    #![proptest_config(config(1))]

    #[test]
    fn polynomial_stress_and_tangent_are_derivatives(f in deformation(), a in constants(), k in 1.0..1e3f64) {
        for volume in [Volume::Quadratic, Volume::MixedLogarithmic, Volume::Logarithmic] {
            compare(&f, Shape::Polynomial(a), volume, k)?;
        }
    }

    #[test]
    fn gent_stress_and_tangent_are_derivatives(f in deformation(), shear in 0.1..2.0f64) {
        // Stretches up to 2 reach Ī₁ of about 13.
        compare(&f, Shape::Gent(shear, 30.0), Volume::Quadratic, 100.0)?;
    }

    #[test]
    fn energy_does_not_see_rotations(f in deformation(), q in rotation(), a in constants()) {
        let subject = material(Shape::Polynomial(a), Volume::Quadratic, 50.0);
        let (before, after) = (subject.response(&f), subject.response(&(q * f)));
        // Rounding of products of rotations, relative to the size of the stress and its parts (k = 50).
        let size = 1.0 + before.stress.norm() + 50.0 * f.norm_squared();
        prop_assert!((subject.energy(&f) - subject.energy(&(q * f))).abs() <= 1e-12 * (1.0 + subject.energy(&f).abs() + size));
        prop_assert!((after.stress - q * before.stress).norm() <= 1e-12 * size);
        // Nothing is felt in a rotation alone.
        prop_assert!(subject.response(&q).stress.norm() <= 1e-12 * 50.0);
    }

    #[test]
    fn the_papers_formulas_give_the_same(f in deformation(), a in constants(), k in 1.0..100.0f64) {
        let subject = material(Shape::Polynomial(a), Volume::Quadratic, k);
        let Response { stress, tangent } = subject.response(&f);
        let (s, c) = paper(&f, a, k);
        // The same numbers by another route: rounding alone.
        prop_assert!((f * s - stress).norm() <= 1e-12 * (1.0 + s.norm()) * f.norm() * 10.0);
        let mut expected = Tangent::zeros();
        for i in 0..3 { for j in 0..3 { for m in 0..3 { for l in 0..3 {
            let mut value = if i == m { s[(j, l)] } else { 0.0 };
            for p in 0..3 { for q in 0..3 { value += f[(i, p)] * f[(m, q)] * c[p][j][q][l]; } }
            expected[(3 * i + j, 3 * m + l)] = value;
        }}}}
        prop_assert!((expected - tangent).norm() <= 1e-12 * expected.norm().max(1.0) * 100.0);
    }
}

/// S of (2.13) and C of the appendix with its misprints corrected.
#[allow(clippy::needless_range_loop)]
fn paper(f: &Matrix3<f64>, a: [f64; 7], k: f64) -> (Matrix3<f64>, [[[[f64; 3]; 3]; 3]; 3]) {
    let g = f.transpose() * f;
    let gi = g.try_inverse().unwrap();
    let i1 = g.trace();
    let i2 = 0.5 * (i1 * i1 - (g * g).trace());
    let i3 = g.determinant();
    let j = i3.sqrt();
    let (x, y) = (i1 * i3.powf(-1.0 / 3.0) - 3.0, i2 * i3.powf(-2.0 / 3.0) - 3.0);
    let (mut k1, mut k2, mut h11, mut h12, mut h22) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let d = |x: f64, m: u32, order: u32| -> f64 {
        if m < order {
            return 0.0;
        }
        let factor: f64 = (0..order).map(|q| f64::from(m - q)).product();
        factor * x.powi((m - order) as i32)
    };
    for (&(m, n), &a) in EXPONENTS.iter().zip(&a) {
        k1 += a * d(x, m, 1) * d(y, n, 0);
        k2 += a * d(x, m, 0) * d(y, n, 1);
        h11 += a * d(x, m, 2) * d(y, n, 0);
        h12 += a * d(x, m, 1) * d(y, n, 1);
        h22 += a * d(x, m, 0) * d(y, n, 2);
    }
    let id = Matrix3::<f64>::identity();
    let av = id - gi * (i1 / 3.0);
    let bv = id * i1 - g - gi * (2.0 / 3.0 * i2);
    let s = (av * (k1 * i3.powf(-1.0 / 3.0)) + bv * (k2 * i3.powf(-2.0 / 3.0))) * 2.0 + gi * (k * (j - 1.0) * j);
    let sym =
        |m: &Matrix3<f64>, i: usize, jj: usize, p: usize, l: usize| m[(i, p)] * m[(jj, l)] + m[(i, l)] * m[(jj, p)];
    let mut c = [[[[0.0; 3]; 3]; 3]; 3];
    for i in 0..3 {
        for jj in 0..3 {
            for p in 0..3 {
                for l in 0..3 {
                    let dg = id[(i, jj)] * gi[(p, l)] + gi[(i, jj)] * id[(p, l)];
                    let gg = gi[(i, jj)] * gi[(p, l)];
                    let mixed = g[(i, jj)] * gi[(p, l)] + gi[(i, jj)] * g[(p, l)];
                    let mut value = 2.0 / 3.0
                        * k1
                        * i3.powf(-1.0 / 3.0)
                        * (-2.0 * dg + i1 / 3.0 * (2.0 * gg + 3.0 * sym(&gi, i, jj, p, l)));
                    value += 4.0 / 3.0
                        * k2
                        * i3.powf(-2.0 / 3.0)
                        * (-2.0 * i1 * dg
                            + 2.0 * mixed
                            + i2 * (4.0 / 3.0 * gg + sym(&gi, i, jj, p, l))
                            + 1.5 * (2.0 * id[(i, jj)] * id[(p, l)] - sym(&id, i, jj, p, l)));
                    value += 4.0 * h11 * i3.powf(-2.0 / 3.0) * av[(i, jj)] * av[(p, l)];
                    value += 4.0 * h12 / i3 * (av[(i, jj)] * bv[(p, l)] + bv[(i, jj)] * av[(p, l)]);
                    value += 4.0 * h22 * i3.powf(-4.0 / 3.0) * bv[(i, jj)] * bv[(p, l)];
                    value += k * j * (j - 1.0) * (gg - sym(&gi, i, jj, p, l)) + k * j * j * gg;
                    c[i][jj][p][l] = value;
                }
            }
        }
    }
    (s, c)
}

#[test]
fn moduli_at_rest() {
    let rubber = Rubber::mooney_rivlin(0.3, 0.1, 1e3).unwrap();
    // µ = 2 (A10 + A01); differences of order k are rounding.
    assert!((initial_shear_modulus(&rubber) - 0.8).abs() < 1e-12);
    assert!((initial_bulk_modulus(&rubber) - 1e3).abs() < 1e-9);
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
        MaterialError::Constant { name, .. } => name,
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
}
