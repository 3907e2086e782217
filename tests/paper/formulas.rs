//! §3 and §4 of the paper, formula by formula, against the path that the crate takes.
#![cfg(feature = "solve")]

use approx::assert_abs_diff_eq;
use nalgebra::{DMatrix, Matrix3, SMatrix};
use rkpm::assembly::System;
use rkpm::nalgebra;
use rkpm::prelude::*;
use rkpm::solve::State;

use super::estimate::Estimate;
use super::full_transformation::FullTransformation;

fn cloud(seed: u64) -> ReproducingKernel<2, CubicSpline, Polynomial<2>> {
    let layout = Layout::Jittered { amount: 0.3, seed };
    let lattice = Lattice::new(&Block::new([1.0, 0.0], [3.0, 1.0]), [7, 5], &layout).unwrap();
    ReproducingKernel::new(lattice.particles(1.1).unwrap(), CubicSpline, Polynomial::linear()).unwrap()
}

#[test]
fn shape_functions_are_the_modified_kernel() {
    // (3.10), (3.11), (3.21), (3.22) by the paper's unscaled route: rounding times the conditioning of that route.
    let rk = cloud(1);
    for at in [[1.0, 0.0], [1.37, 0.61], [2.9, 0.99], [2.2, 0.33]] {
        let at = at.into();
        let psi = rk.shape_functions(&at).unwrap();
        for (&node, value) in psi.nodes.iter().zip(&psi.values) {
            assert_abs_diff_eq!(rk.modified_kernel(&at, node as usize), value, epsilon = 1e-11);
        }
        // The zeroth moment of the modified kernel is one (3.16), the estimate of a linear field is not its value.
        let total: f64 = (0..35).map(|i| rk.modified_kernel(&at, i)).sum();
        assert_abs_diff_eq!(total, 1.0, epsilon = 1e-12);
    }
}

/// With volumes inside the sum kernels are densities of supports that differ: (3.3), (3.26). Any common factor would cancel.
#[test]
fn densities_of_unequal_supports_are_those_of_the_modified_kernel() {
    let lattice = Block::new([1.0, 0.0], [3.0, 1.0]).lattice([7, 5]).unwrap();
    let half = |k: usize| Point::<2>::new(0.8 + 0.02 * k as f64, 0.9 - 0.01 * k as f64);
    let supports = (0..35).map(|k| Support::Box(half(k))).collect();
    let volumes: Vec<f64> = (0..35).map(|k| 0.05 + 0.003 * k as f64).collect();
    let particles = Particles::new(lattice.positions().to_vec(), supports).unwrap().with_volumes(volumes).unwrap();
    let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
    for at in [[1.2, 0.1], [1.37, 0.61], [2.9, 0.99]] {
        let at = at.into();
        let psi = rk.shape_functions(&at).unwrap();
        for (&node, value) in psi.nodes.iter().zip(&psi.values) {
            assert_abs_diff_eq!(rk.modified_kernel(&at, node as usize), value, epsilon = 1e-11);
        }
    }
}

#[test]
fn the_uncorrected_estimate_fails_at_the_boundary() {
    // Remarks of §3.1: with volumes inside the sum the interior moments of a regular set are constant; at an
    // end half of the kernel is missing, and the estimate of a constant with it.
    let n = 21;
    let particles = Block::new([0.0], [20.0]).particles([n], 1.0).unwrap();
    let mut volumes = vec![1.0; n];
    volumes[0] = 0.5;
    volumes[n - 1] = 0.5;
    let rk =
        ReproducingKernel::new(particles.with_volumes(volumes).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let ones = vec![1.0; n];
    // ∫Φ = 1/2 for (3.25), and the trapezoidal sum of a B-spline on its own break points is exact.
    for at in [5.0, 7.3, 10.0, 12.81] {
        assert_abs_diff_eq!(rk.kernel_estimate(&[at].into(), &ones), 0.5, epsilon = 1e-14);
        assert_abs_diff_eq!(rk.moment(&[at].into(), [0]), 0.5, epsilon = 1e-14);
        assert_abs_diff_eq!(rk.moment(&[at].into(), [1]), 0.0, epsilon = 1e-14);
    }
    let interior = rk.moment_matrix(&[8.0].into());
    // Remark 4: constant in the interior from particle to particle.
    assert_abs_diff_eq!(rk.moment_matrix(&[11.0].into()), interior, epsilon = 5e-14);
    assert!((rk.moment_matrix(&[0.0].into()) - &interior).norm() > 0.1);
    assert_abs_diff_eq!(rk.kernel_estimate(&[0.0].into(), &ones), 0.25, epsilon = 1e-14);
    // The correction is constant inside (Fig. 1) and repairs the end.
    let c = rk.correction(&[8.0].into(), &[7.0].into());
    assert_abs_diff_eq!(c, 2.0, epsilon = 1e-13);
    let repaired: f64 = (0..n).map(|i| rk.modified_kernel(&[0.0].into(), i)).sum();
    assert_abs_diff_eq!(repaired, 1.0, epsilon = 1e-14);
}

#[test]
fn shape_functions_are_as_smooth_as_their_kernel() {
    // Remark 2. Across the end of a support the second difference of the slope, divided by the step, goes to
    // zero for a C² kernel and stays for one whose second derivative jumps.
    fn bend<K: Kernel>(kernel: K, step: f64) -> f64 {
        let particles = Block::new([0.0], [10.0]).particles([11], 1.0).unwrap();
        let rk = ReproducingKernel::new(particles, kernel, Polynomial::linear()).unwrap();
        // Particle 3 ends at x = 5 where particle 7 begins.
        let slope = |x: f64| {
            let psi = rk.shape_functions(&[x].into()).unwrap();
            psi.nodes.iter().position(|&n| n == 3).map_or(0.0, |k| psi.gradients[k][0])
        };
        (slope(5.0 + step) - 2.0 * slope(5.0) + slope(5.0 - step)).abs() / step
    }
    for (coarse, fine) in
        [(bend(CubicSpline, 1e-2), bend(CubicSpline, 1e-3)), (bend(QuinticSpline, 1e-2), bend(QuinticSpline, 1e-3))]
    {
        assert!(fine < 0.2 * coarse, "{coarse} {fine}");
    }
    // The truncated Gaussian has a kink: its slope jumps.
    assert!(bend(Gaussian { width: 0.5 }, 1e-3) > 5.0 * bend(Gaussian { width: 0.5 }, 1e-2));
}

#[test]
fn full_transformation_interpolates_and_agrees() {
    let rk = cloud(2);
    let full = FullTransformation::new(&rk);
    for (j, x) in rk.nodes().iter().enumerate() {
        let psi = rk.shape_functions(x).unwrap();
        // Ψ̂_I(X_J) = δ_IJ (4.33), and with it point loads at particles act on one coefficient alone: rounding
        // of the inverse of Λ.
        for (i, value) in full.transformed(&psi.nodes, &psi.values).iter().enumerate() {
            assert_abs_diff_eq!(*value, f64::from(i == j), epsilon = 1e-12);
        }
    }
    let scheme = Scheme::default().particles([7, 5]).constraint_kind(rkpm::scene::ConstraintKind::AtParticles);
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.4, 40.0).unwrap())
        .hold((0, Side::Min))
        .prescribe((0, Side::Max), 0, 0.6)
        .with(Load::force(Place::at([2.0, 1.0]), [0.0, 0.05]));
    let mut problem = scene.discretize(&scheme).unwrap();
    let mixed = problem.run().unwrap().completed().unwrap();
    let rk =
        ReproducingKernel::new(problem.cells().particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    problem.analysis_mut().enforcement = Box::new(FullTransformation::new(&rk));
    let full = problem.run().unwrap().completed().unwrap();
    // One space, one solution: the tolerance of Newton and rounding of the dense inverse.
    for (a, b) in mixed.last().displacement.iter().zip(&full.last().displacement) {
        assert_abs_diff_eq!(a, b, epsilon = 1e-10);
    }
    for (a, b) in mixed.last().multipliers.iter().zip(&full.last().multipliers) {
        assert_abs_diff_eq!(a, b, epsilon = 1e-8);
    }
    // Boundary integrals are no rows at particles.
    let scheme = Scheme::default().particles([7, 5]);
    let mut problem = scene.discretize(&scheme).unwrap();
    problem.analysis_mut().enforcement = Box::new(FullTransformation::new(&rk));
    assert!(problem.run().unwrap_err().to_string().contains("multipliers"));
}

/// A deformed state of a jittered cloud under a body in plain displacement form.
fn deformed(kinematics: impl Kinematics<2> + Copy) -> (ShapeTable<2>, Model, State, Rubber) {
    let rk = cloud(3);
    let lattice = Block::new([1.0, 0.0], [3.0, 1.0]).lattice([4, 3]).unwrap();
    let table = ShapeTable::new(&rk, &lattice.gauss(3).unwrap(), &kinematics).unwrap();
    let rubber = Rubber::polynomial([((1, 0), 0.4), ((0, 1), 0.1), ((2, 0), 0.05), ((1, 1), 0.02)], 30.0).unwrap();
    let mut model = Model::new(rk.nodes());
    model.add(Body::new(table.clone(), rubber.clone(), PressureField::Displacement));
    let mut random = fastrand::Rng::with_seed(7);
    let displacement = rk
        .nodes()
        .iter()
        .flat_map(|x| [0.3 * x[0] + 0.2 * x[1], 0.1 * x[0] * x[1] - 0.1 * x[1]])
        .map(|u| u + 0.02 * random.f64())
        .collect();
    let state = State { displacement, terms: model.start(), load: 1.0, ..State::default() };
    (table, model, state, rubber)
}

fn assembled(model: &Model, state: &State) -> (Vec<f64>, DMatrix<f64>) {
    let mut assembler = model.assembler();
    let mut system = System::default();
    assembler.assemble(model, state, &mut system).unwrap();
    let n = model.unknowns();
    let mut dense = DMatrix::zeros(n, n);
    for column in 0..n {
        for (k, &row) in assembler.pattern().column(column).iter().enumerate() {
            let value = system.values[assembler.pattern().columns[column] + k];
            dense[(row as usize, column)] = value;
            dense[(column, row as usize)] = value;
        }
    }
    (system.residual, dense)
}

/// (4.14), (4.15), (4.18) with B_G, B_M, C, T, Ξ of (4.20)–(4.26), ε of (4.27), misprints corrected.
#[test]
fn the_papers_matrices_give_the_same_system() {
    the_papers_matrices(PlaneStrain, 0.0);
    the_papers_matrices(Axisymmetric, 1.0);
}

fn the_papers_matrices(kinematics: impl Kinematics<2> + Copy, epsilon: f64) {
    let (table, model, state, rubber) = deformed(kinematics);
    let n = model.unknowns();
    let mut forces = vec![0.0; n];
    let mut stiffness = DMatrix::<f64>::zeros(n, n);
    for point in 0..table.point_count() {
        let f = Matrix3::identity() + table.displacement_gradient(point, &state.displacement);
        let response = rubber.response(&f);
        let inverse = f.try_inverse().unwrap();
        let s = inverse * response.stress;
        // C by pulling ∂P/∂F back: (∂P/∂F)_iJkL = δ_ik S_JL + F_iM F_kN C_MJNL.
        let c = |m: usize, j: usize, p: usize, l: usize| -> f64 {
            let mut sum = 0.0;
            for i in 0..3 {
                for k in 0..3 {
                    let geometric = if i == k { s[(j, l)] } else { 0.0 };
                    sum += inverse[(m, i)] * inverse[(p, k)] * (response.tangent[(3 * i + j, 3 * k + l)] - geometric);
                }
            }
            sum
        };
        let pairs = [(0, 0), (1, 1), (0, 1), (2, 2)];
        let c_matrix = SMatrix::<f64, 4, 4>::from_fn(|a, b| c(pairs[a].0, pairs[a].1, pairs[b].0, pairs[b].1));
        #[rustfmt::skip]
        let t = SMatrix::<f64, 5, 5>::from_row_slice(&[
            s[(0, 0)], 0.0, s[(0, 1)], 0.0, 0.0,
            0.0, s[(1, 1)], 0.0, s[(1, 0)], 0.0,
            s[(1, 0)], 0.0, s[(1, 1)], 0.0, 0.0,
            0.0, s[(0, 1)], 0.0, s[(0, 0)], 0.0,
            0.0, 0.0, 0.0, 0.0, s[(2, 2)],
        ]);
        let xi = SMatrix::<f64, 4, 1>::new(s[(0, 0)], s[(1, 1)], s[(0, 1)], s[(2, 2)]);
        let nodes = table.nodes(point);
        let g = table.gradients(point);
        let m = nodes.len();
        let slope = |a: usize, k: usize| g[k * m + a];
        let hoop = |a: usize| if epsilon > 0.0 { epsilon * g[2 * m + a] } else { 0.0 };
        let bg = |a: usize| {
            let [x, y] = [slope(a, 0), slope(a, 1)];
            SMatrix::<f64, 5, 2>::from_row_slice(&[x, 0.0, 0.0, y, y, 0.0, 0.0, x, hoop(a), 0.0])
        };
        let bm = |a: usize| {
            SMatrix::<f64, 4, 2>::from_row_slice(&[
                f[(0, 0)] * slope(a, 0),
                f[(1, 0)] * slope(a, 0), //
                f[(0, 1)] * slope(a, 1),
                f[(1, 1)] * slope(a, 1), //
                f[(0, 0)] * slope(a, 1) + f[(0, 1)] * slope(a, 0),
                f[(1, 0)] * slope(a, 1) + f[(1, 1)] * slope(a, 0), //
                f[(2, 2)] * hoop(a),
                0.0,
            ])
        };
        let weight = table.weights()[point];
        for a in 0..m {
            let force = bm(a).tr_mul(&xi) * weight;
            for i in 0..2 {
                forces[nodes[a] as usize * 2 + i] += force[i];
            }
            for b in 0..m {
                let block = (bm(a).tr_mul(&(c_matrix * bm(b))) + bg(a).tr_mul(&(t * bg(b)))) * weight;
                for i in 0..2 {
                    for j in 0..2 {
                        stiffness[(nodes[a] as usize * 2 + i, nodes[b] as usize * 2 + j)] += block[(i, j)];
                    }
                }
            }
        }
    }
    let (residual, dense) = assembled(&model, &state);
    let error: f64 = residual.iter().zip(&forces).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let size: f64 = forces.iter().map(|f| f * f).sum::<f64>().sqrt();
    // The same sums in another order.
    assert!(error < 1e-12 * size, "{error} {size}");
    assert!((&dense - &stiffness).norm() < 1e-12 * stiffness.norm(), "{}", (&dense - &stiffness).norm());
}

/// (4.47), (4.48): forces and tangent over the current configuration are those over the reference one.
#[test]
fn updated_and_total_formulation_are_the_same() {
    for axisymmetric in [false, true] {
        let (table, model, state, rubber) = if axisymmetric { deformed(Axisymmetric) } else { deformed(PlaneStrain) };
        let n = model.unknowns();
        let mut forces = vec![0.0; n];
        let mut stiffness = DMatrix::<f64>::zeros(n, n);
        for point in 0..table.point_count() {
            let f = Matrix3::identity() + table.displacement_gradient(point, &state.displacement);
            let response = rubber.response(&f);
            let j = f.determinant();
            let cauchy = response.stress * f.transpose() / j;
            // a_ijkl = (1/J) F_jJ F_lL ∂P_iJ/∂F_kL.
            let spatial = |i: usize, q: usize, k: usize, l: usize| -> f64 {
                let mut sum = 0.0;
                for a in 0..3 {
                    for b in 0..3 {
                        sum += f[(q, a)] * f[(l, b)] * response.tangent[(3 * i + a, 3 * k + b)];
                    }
                }
                sum / j
            };
            let nodes = table.nodes(point);
            let m = nodes.len();
            let (g, inverse) = (table.gradients(point), f.try_inverse().unwrap());
            // Displacement gradients over x of unit coefficients, component i of node a: ∂Ψ/∂x = ∂Ψ/∂X F⁻¹.
            let gradient = |a: usize, i: usize| {
                let mut h = Matrix3::zeros();
                for s in 0..2 {
                    h[(i, s)] = g[s * m + a];
                }
                if i == 0 && axisymmetric {
                    h[(2, 2)] = g[2 * m + a];
                }
                h * inverse
            };
            let weight = table.weights()[point] * j;
            for a in 0..m {
                for i in 0..2 {
                    let ha = gradient(a, i);
                    forces[nodes[a] as usize * 2 + i] += weight * cauchy.dot(&ha);
                    for b in 0..m {
                        for k in 0..2 {
                            let hb = gradient(b, k);
                            let mut sum = 0.0;
                            for (r, q) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)] {
                                for (t, l) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)] {
                                    if ha[(r, q)] != 0.0 && hb[(t, l)] != 0.0 {
                                        sum += ha[(r, q)] * spatial(r, q, t, l) * hb[(t, l)];
                                    }
                                }
                            }
                            stiffness[(nodes[a] as usize * 2 + i, nodes[b] as usize * 2 + k)] += weight * sum;
                        }
                    }
                }
            }
        }
        let (residual, dense) = assembled(&model, &state);
        let error: f64 = residual.iter().zip(&forces).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let size: f64 = forces.iter().map(|f| f * f).sum::<f64>().sqrt();
        // One more product with F and F⁻¹ than the total formulation: rounding.
        assert!(error < 1e-12 * size, "{error} {size}");
        assert!((&dense - &stiffness).norm() < 1e-12 * stiffness.norm());
    }
}

#[test]
fn a_spatial_kernel_loses_its_cover_and_warns_before() {
    for r in [0.75, 1.0, 1.5] {
        let particles = Block::new([0.0], [8.0]).particles([9], r).unwrap();
        let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
        let cover = |stretch: f64| {
            let moved: Vec<_> = rk.nodes().iter().map(|x| x * stretch).collect();
            let spatial = rk.spatial(moved).unwrap();
            spatial.cover(spatial.nodes())
        };
        // Neighbours leave the support at the stretch 2r; a kernel that has shrunk to 1e-8 counts as gone.
        assert!(!cover(2.0 * r * 0.99).is_lost() && cover(2.0 * r * 1.001).is_lost());
        assert!(cover(2.0 * r * 0.99).is_warned());
        assert!(!cover(1.0).is_warned());
        let strict = rk.spatial(rk.nodes().to_vec()).unwrap().with_rcond_limit(1.0);
        let again = strict.spatial(rk.nodes().to_vec()).unwrap();
        assert!(again.cover(rk.nodes()).is_lost());
    }
}
