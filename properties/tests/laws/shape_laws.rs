//! Laws of the reproducing kernel shape functions, on random clouds with random supports.

use std::cell::Cell;

use approx::abs_diff_eq;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError, TestRunner};
use rkpm::basis::{Basis, Polynomial};
use rkpm::cells::Cells;
use rkpm::error::ApproximationError;
use rkpm::kernel::{CubicSpline, Gaussian, Kernel, QuinticSpline, WendlandC2};
use rkpm::nalgebra::{DMatrix, DVector, SMatrix};
use rkpm::particles::{Particles, Support};
use rkpm::prelude::{Approximation, Block, ReproducingKernel, ShapeFunctions};

type Point<const D: usize> = rkpm::geometry::Point<D>;
/// Whether the law had something to say about the point.
type Outcome = Result<bool, TestCaseError>;

fn config(seed: u64) -> ProptestConfig {
    ProptestConfig {
        cases: 256,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        // A seed does not get simpler by getting smaller: shrink the rest of the recipe, briefly.
        max_shrink_iters: 64,
        ..Default::default()
    }
}

/// What a random cloud is drawn from.
#[derive(Debug, Clone, Copy)]
struct Recipe {
    /// Seed of positions, supports, volumes and evaluation points.
    seed: u64,
    /// Order of the polynomial basis.
    order: u8,
    /// Which of the kernels.
    kernel: usize,
    /// Box or ball supports.
    boxes: bool,
    /// Whether the sums carry nodal volumes.
    volumes: bool,
    /// Mean dilation in units of the mean spacing, per order of the basis.
    reach: f64,
    /// Where the cloud lies.
    offset: f64,
}

fn recipes(orders: u8) -> impl Strategy<Value = Recipe> {
    let offsets = prop_oneof![3 => Just(0.0), 1 => Just(-7.0), 1 => Just(1e3)];
    (any::<u64>(), 1..=orders, 0..4usize, any::<bool>(), any::<bool>(), 1.0..2.0f64, offsets).prop_map(
        |(seed, order, kernel, boxes, volumes, reach, offset)| Recipe {
            seed,
            order,
            kernel,
            boxes,
            volumes,
            reach,
            offset,
        },
    )
}

fn kernel(which: usize) -> Box<dyn Kernel> {
    match which {
        0 => Box::new(CubicSpline),
        1 => Box::new(QuinticSpline),
        2 => Box::new(Gaussian::default()),
        _ => Box::new(WendlandC2),
    }
}

/// A kernel behind a box, because the choice is made at run time.
struct Chosen(Box<dyn Kernel>);

impl Kernel for Chosen {
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        self.0.value_and_slope(z)
    }
}

type Cloud<const D: usize> = ReproducingKernel<D, Chosen, Polynomial<D>>;

/// Particles per direction: enough that inner points see more particles than the basis has terms.
fn count<const D: usize>() -> usize {
    [24, 81, 216][D - 1]
}

fn random_point<const D: usize>(random: &mut fastrand::Rng, offset: f64) -> Point<D> {
    Point::from_fn(|_, _| offset + random.f64())
}

/// Uniformly random particles in a unit cube at `offset`; dilations vary by a factor of two.
fn cloud<const D: usize>(recipe: &Recipe) -> Cloud<D> {
    let mut random = fastrand::Rng::with_seed(recipe.seed);
    let n = count::<D>();
    let mean = recipe.reach * f64::from(recipe.order + 1) * (n as f64).powf(-1.0 / D as f64);
    let positions = (0..n).map(|_| random_point::<D>(&mut random, recipe.offset)).collect();
    let supports = (0..n)
        .map(|_| {
            let mut dilation = || mean * (0.7 + 0.7 * random.f64());
            let half = Point::<D>::from_fn(|_, _| dilation());
            match (recipe.boxes, random.u8(0..3)) {
                (false, _) => Support::Ball(half[0]),
                // A third of the boxes are askew.
                (true, 0) => Support::Parallelepiped(SMatrix::from_fn(|i, k| {
                    half[k] * if i == k { 1.0 } else { 0.6 * (random.f64() - 0.5) }
                })),
                (true, _) => Support::Box(half),
            }
        })
        .collect();
    let mut particles = Particles::new(positions, supports).unwrap();
    if recipe.volumes {
        particles = particles.with_volumes((0..n).map(|_| (0.5 + random.f64()) / n as f64).collect()).unwrap();
    }
    ReproducingKernel::new(particles, Chosen(kernel(recipe.kernel)), Polynomial::new(recipe.order)).unwrap()
}

/// Evaluation points in the middle of the cloud, on its edge and at a particle.
fn points<const D: usize>(recipe: &Recipe, cloud: &Cloud<D>) -> Vec<Point<D>> {
    let mut random = fastrand::Rng::with_seed(recipe.seed ^ 0x5eed);
    let mut points: Vec<Point<D>> = (0..6).map(|_| random_point(&mut random, recipe.offset)).collect();
    let mut edge = random_point::<D>(&mut random, recipe.offset);
    edge[0] = recipe.offset;
    points.push(edge);
    points.push(cloud.nodes()[random.usize(0..cloud.nodes().len())]);
    points
}

/// Shape functions at a point, or `None` where the guard refuses it.
fn guarded<const D: usize>(cloud: &Cloud<D>, at: &Point<D>) -> Result<Option<ShapeFunctions<D>>, TestCaseError> {
    match cloud.shape_functions(at) {
        Ok(psi) => Ok(Some(psi)),
        Err(ApproximationError::Uncovered { .. } | ApproximationError::Singular { .. }) => Ok(None),
        Err(other) => Err(TestCaseError::fail(format!("{at:?}: {other}"))),
    }
}

/// The largest half-widths of the supports that hold the point: the length a by which gradients are measured.
fn reach<const D: usize>(cloud: &Cloud<D>, psi: &ShapeFunctions<D>) -> Point<D> {
    psi.nodes.iter().fold(Point::zeros(), |reach, &node| {
        reach.zip_map(&cloud.particles().supports()[node as usize].half_widths(), f64::max)
    })
}

/// Runs a law on 256 random clouds and requires that it was tested at `passing` points at least, so that
/// it is not kept by refusing everything.
fn on_clouds<const D: usize>(
    seed: u64,
    orders: u8,
    passing: usize,
    law: impl Fn(&Recipe, &Cloud<D>, &Point<D>, &ShapeFunctions<D>) -> Outcome,
) {
    let passed = Cell::new(0);
    let mut runner = TestRunner::new(config(seed));
    let result = runner.run(&recipes(orders), |recipe| {
        let cloud = cloud::<D>(&recipe);
        for at in points(&recipe, &cloud) {
            if let Some(psi) = guarded(&cloud, &at)? {
                passed.set(passed.get() + usize::from(law(&recipe, &cloud, &at, &psi)?));
            }
        }
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    assert!(passed.get() >= passing, "the law was tested at {} points only", passed.get());
}

/// The bound on errors of reproduction: 1000 ε / rcond, because a solve with the moment matrix loses as many
/// digits as its condition has; and 1e-10 where rcond ≥ 1e-3, which is tighter there.
fn bound(rcond: f64) -> f64 {
    let bound = 1000.0 * f64::EPSILON / rcond;
    if rcond >= 1e-3 { bound.min(1e-10) } else { bound }
}

/// All monomials of the basis about three centres: x itself, a corner of the cloud, and the origin.
fn reproduces<const D: usize>(recipe: &Recipe, cloud: &Cloud<D>, at: &Point<D>, psi: &ShapeFunctions<D>) -> Outcome {
    let reach = reach(cloud, psi);
    let basis = Polynomial::<D>::new(recipe.order);
    let terms = basis.len();
    for centre in [*at, Point::repeat(recipe.offset), Point::zeros()] {
        let fill = |x: &Point<D>| {
            let (mut p, mut dp) = (vec![0.0; terms], vec![Point::<D>::zeros(); terms]);
            basis.fill(&(x - centre).component_div(&reach), &mut p, &mut dp);
            (p, dp)
        };
        let (exact, slopes) = fill(at);
        let mut size: Vec<f64> = exact.iter().map(|p| p.abs()).collect();
        let mut value = vec![0.0; terms];
        let mut gradient = vec![Point::<D>::zeros(); terms];
        for (a, &node) in psi.nodes.iter().enumerate() {
            let (p, _) = fill(&cloud.nodes()[node as usize]);
            for k in 0..terms {
                size[k] = size[k].max(p[k].abs());
                value[k] += psi.values[a] * p[k];
                // a·∇, to compare with the slope in scaled coordinates.
                gradient[k] += psi.gradients[a].component_mul(&reach) * p[k];
            }
        }
        for k in 0..terms {
            let bound = bound(psi.rcond) * size[k];
            let error = (value[k] - exact[k]).abs();
            prop_assert!(error <= bound, "value of {:?}: {error:e} > {bound:e}", basis.exponents()[k]);
            let error = (gradient[k] - slopes[k]).amax();
            prop_assert!(error <= bound, "gradient of {:?}: {error:e} > {bound:e}", basis.exponents()[k]);
        }
    }
    Ok(true)
}

#[test]
fn polynomials_of_the_basis_are_reproduced_in_1d() {
    on_clouds::<1>(101, 3, 1200, reproduces);
}

#[test]
fn polynomials_of_the_basis_are_reproduced_in_2d() {
    on_clouds::<2>(102, 2, 1200, reproduces);
}

#[test]
fn polynomials_of_the_basis_are_reproduced_in_3d() {
    on_clouds::<3>(103, 2, 1200, reproduces);
}

/// ΣΨ = 1 and Σ∇Ψ = 0 (times a).
fn is_partition_of_unity<const D: usize>(
    _: &Recipe,
    cloud: &Cloud<D>,
    _: &Point<D>,
    psi: &ShapeFunctions<D>,
) -> Outcome {
    let sum: f64 = psi.values.iter().sum();
    let slope = psi.gradients.iter().sum::<Point<D>>().component_mul(&reach(cloud, psi)).amax();
    // The bound of the reproduction of a constant, whose size is 1.
    let bound = bound(psi.rcond);
    prop_assert!(abs_diff_eq!(sum, 1.0, epsilon = bound), "sum − 1 = {:e} > {bound:e}", sum - 1.0);
    prop_assert!(slope <= bound, "sum of gradients {slope:e} > {bound:e}");
    prop_assert!(psi.nodes.windows(2).all(|w| w[0] < w[1]));
    prop_assert!(psi.values.len() == psi.nodes.len() && psi.gradients.len() == psi.nodes.len());
    Ok(true)
}

#[test]
fn shape_functions_are_a_partition_of_unity() {
    on_clouds::<1>(111, 3, 1200, is_partition_of_unity);
    on_clouds::<2>(112, 2, 1200, is_partition_of_unity);
    on_clouds::<3>(113, 2, 1200, is_partition_of_unity);
}

/// Gradients are the derivatives of the values.
fn gradients_are_derivatives<const D: usize>(
    recipe: &Recipe,
    cloud: &Cloud<D>,
    at: &Point<D>,
    psi: &ShapeFunctions<D>,
) -> Outcome {
    // The Gaussian has a kink at the end of its support, and at 1e3 the step itself is rounded.
    if psi.rcond < 1e-4 || recipe.kernel == 2 || recipe.offset > 0.0 {
        return Ok(false);
    }
    let reach = reach(cloud, psi);
    // A step of 1e-5 a balances truncation, (1e-5)² times third derivatives, against rounding, ε/1e-5.
    let step = 1e-5;
    let largest = psi.gradients.iter().map(|g| g.component_mul(&reach).amax()).fold(1.0, f64::max);
    for axis in 0..D {
        let mut values = vec![[0.0; 2]; cloud.nodes().len()];
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let mut x = *at;
            x[axis] += sign * step * reach[axis];
            let Some(there) = guarded(cloud, &x)? else { return Ok(false) };
            for (&node, &value) in there.nodes.iter().zip(&there.values) {
                values[node as usize][side] = value;
            }
        }
        let mut gradients = vec![0.0; cloud.nodes().len()];
        for (&node, gradient) in psi.nodes.iter().zip(&psi.gradients) {
            gradients[node as usize] = gradient[axis] * reach[axis];
        }
        for (value, gradient) in values.iter().zip(&gradients) {
            let difference = (value[1] - value[0]) / (2.0 * step);
            // Rounding: ε/rcond/step ≤ 2e-7; truncation: 1e-10 times third derivatives, measured up to 1e4.
            let tolerance = 2e-6 * largest;
            let error = (difference - gradient).abs();
            prop_assert!(error <= tolerance, "axis {axis}: {error:e} > {tolerance:e} at rcond {:e}", psi.rcond);
        }
    }
    Ok(true)
}

#[test]
fn gradients_agree_with_central_differences_of_the_values() {
    on_clouds::<1>(121, 3, 400, gradients_are_derivatives);
    on_clouds::<2>(122, 2, 400, gradients_are_derivatives);
    on_clouds::<3>(123, 2, 400, gradients_are_derivatives);
}

/// Evaluating values alone gives the values of the full evaluation.
fn values_alone_are_the_values<const D: usize>(
    _: &Recipe,
    cloud: &Cloud<D>,
    at: &Point<D>,
    psi: &ShapeFunctions<D>,
) -> Outcome {
    let mut alone = ShapeFunctions::default();
    cloud.evaluate_values(at, &mut Default::default(), &mut alone).unwrap();
    // To the bit: both take the same arithmetic.
    prop_assert_eq!(&alone.values, &psi.values);
    prop_assert_eq!(&alone.nodes, &psi.nodes);
    prop_assert_eq!(alone.rcond, psi.rcond);
    // Used buffers must not leave a trace.
    let mut scratch = Default::default();
    let mut used = ShapeFunctions::default();
    for before in cloud.nodes().iter().take(3) {
        let _ = cloud.evaluate(before, &mut scratch, &mut used);
    }
    cloud.evaluate(at, &mut scratch, &mut used).unwrap();
    prop_assert_eq!(&used, psi);
    Ok(true)
}

#[test]
fn values_alone_and_used_buffers_give_the_same_bits() {
    on_clouds::<1>(131, 3, 1200, values_alone_are_the_values);
    on_clouds::<2>(132, 2, 1200, values_alone_are_the_values);
    on_clouds::<3>(133, 2, 1200, values_alone_are_the_values);
}

/// A copy of a cloud with all positions moved to the multiples of 2⁻²⁰ and shifted.
fn on_grid<const D: usize>(recipe: &Recipe, cloud: &Cloud<D>, shift: f64) -> Cloud<D> {
    let old = cloud.particles();
    let positions = old.positions().iter().map(|x| x.map(|c| grid(c) + shift)).collect();
    let mut particles = Particles::new(positions, old.supports().to_vec()).unwrap();
    if recipe.volumes {
        particles = particles.with_volumes(old.volumes().to_vec()).unwrap();
    }
    ReproducingKernel::new(particles, Chosen(kernel(recipe.kernel)), Polynomial::new(recipe.order)).unwrap()
}

fn grid(x: f64) -> f64 {
    let scale = f64::from(1 << 20);
    (x * scale).round() / scale
}

fn is_translation_invariant<const D: usize>(
    recipe: &Recipe,
    cloud: &Cloud<D>,
    at: &Point<D>,
    _: &ShapeFunctions<D>,
) -> Outcome {
    if recipe.offset != 0.0 {
        return Ok(false);
    }
    let at = at.map(grid);
    let Some(here) = guarded(&on_grid(recipe, cloud, 0.0), &at)? else { return Ok(false) };
    let there = on_grid(recipe, cloud, 1e3)
        .shape_functions(&at.map(|c| c + 1e3))
        .map_err(|e| TestCaseError::fail(e.to_string()))?;
    // To the bit: positions on a grid of 2⁻²⁰ are represented exactly at both places, so that all
    // differences x − x_I are the same numbers, and nothing else may enter.
    prop_assert_eq!(&here, &there);
    Ok(true)
}

#[test]
fn shape_functions_do_not_depend_on_the_place_of_the_body() {
    on_clouds::<1>(141, 3, 800, is_translation_invariant);
    on_clouds::<2>(142, 2, 800, is_translation_invariant);
    on_clouds::<3>(143, 2, 800, is_translation_invariant);
}

/// Equal volumes with equal supports cancel.
fn equal_volumes_cancel<const D: usize>(
    recipe: &Recipe,
    cloud: &Cloud<D>,
    at: &Point<D>,
    _: &ShapeFunctions<D>,
) -> Outcome {
    let n = cloud.nodes().len();
    let build = |volume: Option<f64>| {
        let supports = vec![cloud.particles().supports()[0]; n];
        let mut particles = Particles::new(cloud.nodes().to_vec(), supports).unwrap();
        if let Some(volume) = volume {
            particles = particles.with_volumes(vec![volume; n]).unwrap();
        }
        ReproducingKernel::new(particles, Chosen(kernel(recipe.kernel)), Polynomial::new(recipe.order)).unwrap()
    };
    let Some(without) = guarded(&build(None), at)? else { return Ok(false) };
    let Some(with) = guarded(&build(Some(0.013)), at)? else {
        // The guard looks at a ratio, which a common factor changes by rounding alone.
        prop_assert!(without.rcond < 1.001e-8);
        return Ok(false);
    };
    prop_assert_eq!(&with.nodes, &without.nodes);
    // The common factor rounds each entry of the moment matrix; the solve magnifies that by 1/rcond.
    let tolerance = 1000.0 * f64::EPSILON / without.rcond;
    let reach = reach(cloud, &without);
    for a in 0..with.nodes.len() {
        let size = without.values[a].abs().max(1.0);
        prop_assert!(abs_diff_eq!(with.values[a], without.values[a], epsilon = tolerance * size));
        let (g, h) = (with.gradients[a].component_mul(&reach), without.gradients[a].component_mul(&reach));
        prop_assert!(abs_diff_eq!(g, h, epsilon = tolerance * h.amax().max(1.0) / without.rcond.sqrt()));
    }
    Ok(true)
}

#[test]
fn equal_volumes_with_equal_supports_change_nothing() {
    on_clouds::<1>(151, 3, 1200, equal_volumes_cancel);
    on_clouds::<2>(152, 2, 1200, equal_volumes_cancel);
    on_clouds::<3>(153, 2, 1200, equal_volumes_cancel);
}

/// Rounding of positions does not let in particles at whose edge of support a point lies.
#[test]
fn a_lattice_has_the_same_neighbours_whatever_its_spacing() {
    let neighbours = |cells: usize, length: f64| {
        let lattice = Block::new([0.1, 0.2], [0.1 + length, 0.2 + length]).lattice([cells + 1; 2]).unwrap();
        let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
        let points = lattice.smoothing(2, 2, &lattice.zones(2)).unwrap().facet_points;
        let count = |at: &Point<2>| rk.shape_functions(at).unwrap().nodes.len();
        points.iter().map(count).max().unwrap()
    };
    let exact = neighbours(8, 1.0);
    for (cells, length) in [(8, 0.3), (12, 1.0 / 7.0), (18, 48.0), (24, 16.1)] {
        assert_eq!(neighbours(cells, length), exact, "{cells} cells");
    }
}

#[test]
fn unequal_volumes_do_change_the_shape_functions() {
    // The counter-example that keeps the law above from being empty.
    let recipe = Recipe { seed: 5, order: 1, kernel: 0, boxes: true, volumes: false, reach: 1.5, offset: 0.0 };
    let with = cloud::<2>(&Recipe { volumes: true, ..recipe });
    let without = cloud::<2>(&recipe);
    let at = Point::<2>::new(0.5, 0.5);
    let (a, b) = (with.shape_functions(&at).unwrap(), without.shape_functions(&at).unwrap());
    assert!(a.values.iter().zip(&b.values).any(|(a, b)| (a - b).abs() > 1e-3));
}

/// Supports end a rounding before their edge.
const EDGE: f64 = 1.0 - 1e-12;

/// The place of an offset in a parallelepiped.
fn solved<const D: usize>(axes: &SMatrix<f64, D, D>, offset: &Point<D>) -> Point<D> {
    let place = DMatrix::from_fn(D, D, |i, k| axes[(i, k)]).lu().solve(&DVector::from_fn(D, |i, _| offset[i])).unwrap();
    Point::from_fn(|i, _| place[i])
}

/// The particles whose support holds a point, by looking at all of them.
fn brute_force<const D: usize>(cloud: &Cloud<D>, at: &Point<D>) -> Vec<u32> {
    let particles = cloud.particles();
    (0..particles.positions().len())
        .filter(|&i| {
            let offset = at - particles.positions()[i];
            let distances = match particles.supports()[i] {
                Support::Ball(radius) => Point::repeat(offset.norm() / radius),
                Support::Box(half) => offset.abs().component_div(&half),
                Support::Parallelepiped(axes) => solved(&axes, &offset).abs(),
            };
            let value: f64 = distances.iter().map(|&z| cloud.kernel().value_and_slope(z).0).product();
            value > 0.0 && distances.max() < EDGE
        })
        .map(|i| i as u32)
        .collect()
}

fn neighbours_are_found<const D: usize>(seed: u64) {
    let mut runner = TestRunner::new(config(seed));
    let result = runner.run(&recipes(2), |recipe| {
        let cloud = cloud::<D>(&recipe);
        let mut at = points(&recipe, &cloud);
        // Points at the very end of supports, where a search by bins goes wrong first.
        for (x, support) in cloud.nodes().iter().zip(cloud.particles().supports()).take(12) {
            let half = support.half_widths();
            at.push(x + half);
            at.push(x - half);
            at.push(x - half * (1.0 - 1e-15));
        }
        // And points where nothing is.
        at.push(Point::repeat(recipe.offset + 50.0));
        at.push(Point::repeat(recipe.offset - 50.0));
        for at in at {
            let expected = brute_force(&cloud, &at);
            match cloud.shape_functions(&at) {
                Ok(psi) => prop_assert_eq!(psi.nodes, expected),
                Err(ApproximationError::Uncovered { covering, .. } | ApproximationError::Singular { covering, .. }) => {
                    prop_assert_eq!(covering, expected.len())
                }
                Err(other) => return Err(TestCaseError::fail(other.to_string())),
            }
        }
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
}

#[test]
fn neighbours_by_bins_are_those_of_a_full_search() {
    neighbours_are_found::<1>(161);
    neighbours_are_found::<2>(162);
    neighbours_are_found::<3>(163);
}

#[test]
fn particles_on_a_line_are_refused_and_the_point_is_named() {
    let positions: Vec<Point<2>> = (0..9).map(|i| Point::<2>::new(0.125 * f64::from(i), 0.5)).collect();
    let supports = vec![Support::Ball(0.4); positions.len()];
    let particles = Particles::new(positions, supports).unwrap();
    let cloud = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
    let error = cloud.shape_functions(&Point::<2>::new(0.5, 0.55)).unwrap_err();
    assert!(matches!(error, ApproximationError::Singular { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("0.55") && text.contains("raise the dilation"), "{text}");
}
