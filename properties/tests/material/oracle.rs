//! What the laws of the materials are tested against: energies straight from their definitions in hyper-dual
//! numbers, and the paper's own formulas.

use nalgebra::{Matrix3, Rotation3, Vector3};
use num_dual::{DualNum, HyperDual64};
use proptest::prelude::*;
use rkpm::material::{
    ArrudaBoyce, Carroll, ExtendedTube, FoamTerm, Gent, GentGent, HartmannNeffVolume, Hencky, Invariants,
    LogarithmicVolume, Material, MixedLogarithmicVolume, NearlyIncompressible, Ogden, OgdenFoam, PrincipalStretches,
    QuadraticVolume, RivlinPolynomial, TotalStretches, VolumetricEnergy,
};
use rkpm::nalgebra;
use rkpm::tensor::Tangent;

fn turn(angles: [f64; 3]) -> Matrix3<f64> {
    Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner()
}

pub fn rotation() -> impl Strategy<Value = Matrix3<f64>> {
    [-3.1..3.1f64, -3.1..3.1f64, -3.1..3.1f64].prop_map(turn)
}

fn with_stretches(stretches: impl Strategy<Value = [f64; 3]>) -> impl Strategy<Value = Matrix3<f64>> {
    (rotation(), stretches, rotation()).prop_map(|(a, s, b)| a * Matrix3::from_diagonal(&Vector3::from(s)) * b)
}

/// Rotations times stretches of 0.5 to 2, so that det F lies between 1/8 and 8.
pub fn deformation() -> impl Strategy<Value = Matrix3<f64>> {
    with_stretches([0.5..2.0f64, 0.5..2.0f64, 0.5..2.0f64])
}

/// The same with two or three principal stretches equal or nearly so.
pub fn nearly_equal() -> impl Strategy<Value = Matrix3<f64>> {
    // From equal over round-off to beyond the distance at which the tangent changes its formula.
    let gap = || proptest::sample::select(vec![0.0, 1e-15, -1e-12, 1e-9, -1e-6, 1e-4, -5e-3, 0.019, 0.021, 0.05]);
    with_stretches(
        (0.6..1.8f64, gap(), gap(), any::<bool>()).prop_map(|(s, first, second, three)| {
            [s, s * (1.0 + first), if three { s * (1.0 + second) } else { 1.0 / s }]
        }),
    )
}

pub const EXPONENTS: [(u32, u32); 7] = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1)];

pub fn constants() -> impl Strategy<Value = [f64; 7]> {
    [-0.1..1.0f64, -0.1..1.0f64, -0.1..0.1f64, -0.1..0.1f64, -0.1..0.1f64, -0.01..0.01f64, -0.01..0.01f64]
}

/// Which volumetric energy an oracle takes.
#[derive(Clone, Copy, Debug)]
pub enum Volume {
    Quadratic,
    MixedLogarithmic,
    Logarithmic,
    HartmannNeff,
}

pub const VOLUMES: [Volume; 4] =
    [Volume::Quadratic, Volume::MixedLogarithmic, Volume::Logarithmic, Volume::HartmannNeff];

/// Which distortional energy an oracle takes.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    Polynomial([f64; 7]),
    Gent(f64, f64),
    Ogden([(f64, f64); 3]),
    Hencky(f64),
    /// µ, λ_m.
    ArrudaBoyce(f64, f64),
    /// A, B, C.
    Carroll([f64; 3]),
    /// µ, J_m, C_2.
    GentGent([f64; 3]),
    /// G_c, G_e, β, δ.
    ExtendedTube([f64; 4]),
    /// µ, α, ν of each term.
    Foam([[f64; 3]; 2]),
}

type T = HyperDual64;
type Square = [[T; 3]; 3];

fn square(entry: impl Fn(usize, usize) -> T) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

fn product(a: &Square, b: &Square) -> Square {
    square(|i, j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
}

fn unit(scale: f64) -> Square {
    square(|i, j| T::from(if i == j { scale } else { 0.0 }))
}

fn sum(a: &Square, b: &Square) -> Square {
    square(|i, j| a[i][j] + b[i][j])
}

fn times(a: &Square, factor: f64) -> Square {
    square(|i, j| a[i][j] * factor)
}

fn trace(a: &Square) -> T {
    a[0][0] + a[1][1] + a[2][2]
}

/// Cofactors by cyclic minors.
fn cofactors(a: &Square) -> Square {
    let (n, p) = (|i: usize| (i + 1) % 3, |i: usize| (i + 2) % 3);
    square(|i, j| a[n(i)][n(j)] * a[p(i)][p(j)] - a[n(i)][p(j)] * a[p(i)][n(j)])
}

fn determinant(a: &Square) -> T {
    let c = cofactors(a);
    a[0][0] * c[0][0] + a[0][1] * c[0][1] + a[0][2] * c[0][2]
}

/// ln G = 2 artanh((G - I)(G + I)⁻¹) by its series: no eigenvalues, so equal stretches are nothing special.
fn logarithm(g: &Square) -> Square {
    let plus = sum(g, &unit(1.0));
    let (cofactors, determinant) = (cofactors(&plus), determinant(&plus));
    let ratio = product(&sum(g, &unit(-1.0)), &square(|i, j| cofactors[j][i] / determinant));
    let squared = product(&ratio, &ratio);
    let (mut power, mut result) = (ratio, ratio);
    // Stretches of 1/2 to 2 give ratios up to 0.6, and 0.36^45 is below 1e-19.
    for k in 1..=45 {
        power = product(&power, &squared);
        result = sum(&result, &times(&power, 1.0 / f64::from(2 * k + 1)));
    }
    times(&result, 2.0)
}

/// exp(A) by scaling, its series, and squaring.
fn exponential(a: &Square) -> Square {
    let scaled = times(a, 1.0 / 16.0);
    let (mut power, mut result) = (unit(1.0), unit(1.0));
    for k in 1..=16 {
        power = times(&product(&power, &scaled), 1.0 / f64::from(k));
        result = sum(&result, &power);
    }
    (0..4).fold(result, |result, _| product(&result, &result))
}

/// W(F) straight from its definition (2.8)–(2.12), in hyper-dual numbers.
fn energy(f: &Square, shape: Shape, volume: Volume, k: f64) -> T {
    let j = determinant(f);
    let g = product(&square(|a, b| f[b][a]), f);
    let distortional = match shape {
        Shape::Foam(terms) => {
            let strain = times(&logarithm(&g), 0.5);
            terms
                .iter()
                .map(|&[mu, alpha, nu]| {
                    let beta = nu / (1.0 - 2.0 * nu);
                    let stretches = trace(&exponential(&times(&strain, alpha))) - 3.0;
                    let volume = if beta == 0.0 { j.ln() * -alpha } else { (j.powf(-alpha * beta) - 1.0) / beta };
                    (stretches + volume) * (2.0 * mu / (alpha * alpha))
                })
                .sum()
        }
        Shape::ExtendedTube([crosslinks, entanglements, beta, delta]) => {
            let strain = times(&logarithm(&g), 0.5);
            let mean = trace(&strain) / 3.0;
            let strain = square(|a, b| strain[a][b] - if a == b { mean } else { T::from(0.0) });
            let d = trace(&g) * j.powf(-2.0 / 3.0) - 3.0;
            let left = T::from(1.0) - d * (delta * delta);
            let tubes = trace(&exponential(&times(&strain, -beta))) - 3.0;
            (d * (1.0 - delta * delta) / left + left.ln()) * (0.5 * crosslinks)
                + tubes * (2.0 * entanglements / (beta * beta))
        }
        Shape::Polynomial(_) | Shape::Gent(..) | Shape::ArrudaBoyce(..) | Shape::Carroll(_) | Shape::GentGent(_) => {
            let i1 = trace(&g);
            let i2 = (i1 * i1 - trace(&product(&g, &g))) * 0.5;
            let b1 = i1 * j.powf(-2.0 / 3.0) - 3.0;
            let b2 = i2 * j.powf(-4.0 / 3.0) - 3.0;
            match shape {
                Shape::ArrudaBoyce(shear, locking) => {
                    let [i1, l] = [b1 + 3.0, T::from(locking)];
                    [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0]
                        .iter()
                        .enumerate()
                        .map(|(i, &c)| {
                            let n = i as i32 + 1;
                            (i1.powi(n) - 3f64.powi(n)) / l.powi(2 * n - 2) * (shear * c)
                        })
                        .sum()
                }
                Shape::Carroll([a, b, c]) => {
                    b1 * a + ((b1 + 3.0).powi(4) - 81.0) * b + ((b2 + 3.0).sqrt() - 3f64.sqrt()) * c
                }
                Shape::GentGent([shear, limit, second]) => {
                    (T::from(1.0) - b1 / limit).ln() * (-0.5 * shear * limit) + ((b2 + 3.0) / 3.0).ln() * second
                }
                Shape::Gent(shear, limit) => (T::from(1.0) - b1 / limit).ln() * (-0.5 * shear * limit),
                Shape::Polynomial(a) => {
                    EXPONENTS.iter().zip(&a).map(|(&(m, n), &a)| b1.powi(m as i32) * b2.powi(n as i32) * a).sum()
                }
                _ => unreachable!(),
            }
        }
        Shape::Ogden(_) | Shape::Hencky(_) => {
            let strain = times(&logarithm(&g), 0.5);
            let mean = trace(&strain) / 3.0;
            let strain = square(|a, b| strain[a][b] - if a == b { mean } else { T::from(0.0) });
            match shape {
                Shape::Hencky(shear) => trace(&product(&strain, &strain)) * shear,
                Shape::Ogden(terms) => terms
                    .iter()
                    .map(|&(mu, alpha)| (trace(&exponential(&times(&strain, alpha))) - 3.0) * (mu / alpha))
                    .sum(),
                _ => unreachable!(),
            }
        }
    };
    let volumetric = match volume {
        Volume::Quadratic => (j - 1.0) * (j - 1.0) * (0.5 * k),
        Volume::MixedLogarithmic => (j * j - 1.0 - j.ln() * 2.0) * (0.25 * k),
        Volume::Logarithmic => j.ln() * j.ln() * (0.5 * k),
        Volume::HartmannNeff => (j.powi(5) + j.powi(-5) - 2.0) * (k / 50.0),
    };
    distortional + volumetric
}

/// The material under test for the same choice.
pub fn material(shape: Shape, volume: Volume, k: f64) -> Box<dyn Material> {
    let distortional: Box<dyn Material> = match shape {
        Shape::Polynomial(a) => {
            let terms = EXPONENTS.iter().zip(a).map(|(&e, a)| (e, a));
            Box::new(Invariants(RivlinPolynomial::new(terms).unwrap()))
        }
        Shape::Gent(shear, limit) => Box::new(Invariants(Gent::new(shear, limit).unwrap())),
        Shape::Ogden(terms) => Box::new(PrincipalStretches(Ogden::new(terms).unwrap())),
        Shape::Hencky(shear) => Box::new(PrincipalStretches(Hencky::new(shear).unwrap())),
        Shape::ArrudaBoyce(shear, locking) => Box::new(Invariants(ArrudaBoyce::new(shear, locking).unwrap())),
        Shape::Carroll([a, b, c]) => Box::new(Invariants(Carroll::new(a, b, c).unwrap())),
        Shape::GentGent([shear, limit, second]) => Box::new(Invariants(GentGent::new(shear, limit, second).unwrap())),
        Shape::ExtendedTube([c, e, beta, delta]) => {
            Box::new(PrincipalStretches(ExtendedTube::new(c, e, beta, delta).unwrap()))
        }
        Shape::Foam(terms) => {
            let term = |[shear, exponent, poisson]: [f64; 3]| FoamTerm { shear, exponent, poisson };
            Box::new(TotalStretches(OgdenFoam::new(terms.map(term)).unwrap()))
        }
    };
    let volumetric: Box<dyn VolumetricEnergy> = match volume {
        Volume::Quadratic => Box::new(QuadraticVolume::new(k).unwrap()),
        Volume::MixedLogarithmic => Box::new(MixedLogarithmicVolume::new(k).unwrap()),
        Volume::Logarithmic => Box::new(LogarithmicVolume::new(k).unwrap()),
        Volume::HartmannNeff => Box::new(HartmannNeffVolume::new(k).unwrap()),
    };
    Box::new(NearlyIncompressible { distortional, volumetric })
}

/// Gradient and Hessian of the oracle by hyper-dual numbers: exact to rounding.
pub fn oracle(f: &Matrix3<f64>, shape: Shape, volume: Volume, k: f64) -> (f64, Matrix3<f64>, Tangent) {
    let mut stress = Matrix3::zeros();
    let mut tangent = Tangent::zeros();
    let mut value = 0.0;
    for c in 0..9 {
        for e in 0..=c {
            let mut x = square(|i, j| T::from(f[(i, j)]));
            x[c / 3][c % 3].eps1 = 1.0;
            x[e / 3][e % 3].eps2 = 1.0;
            let w = energy(&x, shape, volume, k);
            value = w.re;
            stress[(c / 3, c % 3)] = w.eps1;
            tangent[(c, e)] = w.eps1eps2;
            tangent[(e, c)] = w.eps1eps2;
        }
    }
    (value, stress, tangent)
}

/// C_ijkl of (2.16).
pub type Fourth = [[[[f64; 3]; 3]; 3]; 3];

/// S of (2.13) and C of the appendix with its misprints corrected.
#[allow(clippy::needless_range_loop)]
pub fn paper(f: &Matrix3<f64>, a: [f64; 7], k: f64) -> (Matrix3<f64>, Fourth) {
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
