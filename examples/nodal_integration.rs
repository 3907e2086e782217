//! Two nodal rules built from public traits alone, beside those of the crate: naturally stabilised nodal integration
//! (NSNI; Hillman & Chen 2016) and a variationally consistent correction (VC; Chen, Hillman & Rüter 2013).
//!
//! Direct nodal integration underrates short waves and fails the patch test. NSNI adds what the energy's Taylor series
//! has beyond the particle, $\tfrac12\sum_k M_k\,\mu\,|\partial_k F|^2$ with the second moments $M_k$ of the particle's
//! cell: an [`Integrand`] over a table of second derivatives. VC corrects the test functions' gradients,
//! $\nabla\hat\Psi_I = \nabla\Psi_I + \xi_I$, until $\sum_L w_L\nabla\hat\Psi_I(x_L) = \oint\Psi_I n$: a [`Term`] whose
//! matrix is not symmetric.
//!
//! `cargo run --release --example nodal_integration [-- --out DIR]` prints the patch test's error and the deflection
//! of Cook's membrane under each rule and writes `summary.csv`.

mod support;

use std::error::Error;

use rkpm::error::ApproximationError;
use rkpm::nalgebra::{Matrix3, SMatrix};
use rkpm::prelude::*;
use rkpm::solve::State;
use rkpm::term::{Element, Layout, PointDerivatives, PointState, Sparsity, View};
use support::Summary;

/// Compressible rubber: volumetric locking is another matter.
const SHEAR: f64 = 1.0;
const BULK: f64 = 5.0 / 3.0;

type ApproximationChoice = ReproducingKernel<2, CubicSpline, Polynomial<2>>;

/// Particles in a region, their functions and their nodal points.
struct Body2 {
    cells: Voronoi,
    functions: ApproximationChoice,
    points: Points<2>,
}

impl Body2 {
    fn new(region: &Region, count: usize, seed: u64) -> Result<Self, rkpm::Error> {
        let scatter = rkpm::cells::Scatter { seed, ..Default::default() };
        let cells = Voronoi::new(Triangulation::about(region, count, |_| 1.0, &scatter)?);
        let functions = ReproducingKernel::new(cells.particles(1.0)?, CubicSpline, Polynomial::linear())?;
        let points = cells.nodal_cells(2)?.nodal(cells.positions());
        Ok(Body2 { cells, functions, points })
    }
}

/// $\tfrac12\,\mu\,|G|^2$ of the derivative $G = \partial_k F$ that the table holds in place of gradients.
struct NaturalStabilisation;

impl Integrand for NaturalStabilisation {
    fn sparsity(&self) -> Sparsity {
        Sparsity { stress: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        let derivative = at.deformation - Matrix3::identity();
        flux.energy = 0.5 * SHEAR * derivative.norm_squared();
        flux.stress = derivative * SHEAR;
        flux.stress_by_gradient.fill_diagonal(SHEAR);
    }
}

/// Second derivatives along `axis`, by differences of the first, weighted by the second moments of the cells.
fn second_derivatives(body: &Body2, axis: usize) -> Result<ShapeTable<2>, rkpm::Error> {
    let mut points = body.points.clone();
    let dual = body.cells.nodal_cells(2)?;
    for ((weight, inner), x) in points.weights.iter_mut().zip(&dual.interior).zip(body.cells.positions()) {
        *weight = inner.iter().map(|(at, w)| w * (at[axis] - x[axis]).powi(2)).sum();
    }
    let count = body.cells.positions().len();
    let evaluate = |_: &mut Scratch, point: usize, out: &mut ShapeFunctions<2>| -> Result<(), ApproximationError> {
        // The functions are smooth: differences over a hundredth of the spacing leave four digits.
        let step = 0.01 * body.cells.local_spacing(point);
        let mut offset = Point::<2>::zeros();
        offset[axis] = step;
        let at = points.positions[point];
        // One-sided at the boundary would leave the body; the functions reach a little beyond it.
        let (above, below) =
            (body.functions.shape_functions(&(at + offset))?, body.functions.shape_functions(&(at - offset))?);
        let mut all: Vec<(u32, Point<2>)> = Vec::new();
        for (psi, sign) in [(&above, 1.0), (&below, -1.0)] {
            for (&node, gradient) in psi.nodes.iter().zip(&psi.gradients) {
                match all.iter_mut().find(|(other, _)| *other == node) {
                    Some((_, sum)) => *sum += gradient * (sign / (2.0 * step)),
                    None => all.push((node, gradient * (sign / (2.0 * step)))),
                }
            }
        }
        all.sort_unstable_by_key(|(node, _)| *node);
        out.nodes = all.iter().map(|a| a.0).collect();
        out.values = vec![0.0; all.len()];
        out.gradients = all.iter().map(|a| a.1).collect();
        out.rcond = above.rcond.min(below.rcond);
        Ok(())
    };
    ShapeTable::tabulate(count, &points, &PlaneStrain, &evaluate)
}

/// A body whose forces are tested with corrected gradients: $\sum_L w_L\,P(F_L)\cdot\nabla\hat\Psi_I(x_L)$.
struct Consistent<M> {
    trial: ShapeTable<2>,
    /// $\xi_I$ of each particle.
    corrections: Vec<Point<2>>,
    material: M,
}

impl<M> Consistent<M> {
    fn new(body: &Body2, material: M) -> Result<Self, rkpm::Error> {
        let trial = ShapeTable::new(&body.functions, &body.points, &PlaneStrain)?;
        let count = body.cells.positions().len();
        let mut missing = vec![Point::<2>::zeros(); count];
        let mut volumes = vec![0.0; count];
        let boundary = body.cells.boundary(&rkpm::geometry::Part::Whole, 2, 2)?.points;
        for ((at, weight), normal) in boundary.positions.iter().zip(&boundary.weights).zip(&boundary.normals) {
            let psi = body.functions.shape_functions(at)?;
            for (&node, value) in psi.nodes.iter().zip(&psi.values) {
                missing[node as usize] += normal * (weight * value);
            }
        }
        for point in 0..trial.point_count() {
            let (nodes, gradients, weight) = (trial.nodes(point), trial.gradients(point), trial.weights()[point]);
            for (a, &node) in nodes.iter().enumerate() {
                missing[node as usize] -= Point::<2>::new(gradients[a], gradients[nodes.len() + a]) * weight;
                volumes[node as usize] += weight;
            }
        }
        let corrections = missing.iter().zip(&volumes).map(|(m, v)| m / *v).collect();
        Ok(Consistent { trial, corrections, material })
    }
}

impl<M: Material> Term for Consistent<M> {
    fn dim(&self) -> usize {
        2
    }

    fn clusters(&self) -> usize {
        self.trial.point_count()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.trial.nodes(cluster)
    }

    fn layout(&self) -> Layout {
        Layout { symmetric: false, ..Layout::default() }
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let f = Matrix3::identity() + self.trial.displacement_gradient(cluster, view.displacement);
        let response = self.material.response(&f);
        let (nodes, gradients) = (self.trial.nodes(cluster), self.trial.gradients(cluster));
        let (n, weight) = (nodes.len(), self.trial.weights()[cluster]);
        let trial = |a: usize| [gradients[a], gradients[n + a]];
        let test = |a: usize| {
            let correction = self.corrections[nodes[a] as usize];
            [gradients[a] + correction[0], gradients[n + a] + correction[1]]
        };
        for a in 0..n {
            for i in 0..2 {
                let row = 2 * a + i;
                out.residual[row] += weight * (0..2).map(|s| response.stress[(i, s)] * test(a)[s]).sum::<f64>();
                if !out.with_matrix {
                    continue;
                }
                for b in 0..n {
                    for j in 0..2 {
                        let mut sum = 0.0;
                        for s in 0..2 {
                            for t in 0..2 {
                                sum += test(a)[s] * response.tangent[(3 * i + s, 3 * j + t)] * trial(b)[t];
                            }
                        }
                        out.matrix[(2 * b + j) * 2 * n + row] += weight * sum;
                    }
                }
            }
        }
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        let f = Matrix3::identity() + self.trial.displacement_gradient(cluster, view.displacement);
        self.trial.weights()[cluster] * self.material.energy(&f)
    }
}

/// The rules that are compared.
#[derive(Clone, Copy)]
enum Rule {
    Smoothed,
    Conforming,
    Nodal,
    Natural,
    Consistent,
    Both,
}

/// The terms of a body under a rule.
fn model(body: &Body2, rule: Rule) -> Result<Model, rkpm::Error> {
    let rubber = || Rubber::neo_hookean(SHEAR / 2.0, BULK);
    let mut model = Model::new(body.cells.positions());
    match rule {
        Rule::Smoothed => {
            let triangles = body.cells.triangles();
            let smoothing = triangles.smoothing(2, 2, &triangles.zones(1))?;
            let table = ShapeTable::smoothed(&body.functions, &smoothing, &PlaneStrain)?;
            model.add(rkpm::term::Body::new(table, rubber()?, PressureField::Displacement));
        }
        Rule::Conforming => {
            let table = ShapeTable::smoothed(&body.functions, &body.cells.nodal_cells(2)?, &PlaneStrain)?;
            model.add(rkpm::term::Body::new(table, rubber()?, PressureField::Displacement));
        }
        Rule::Nodal | Rule::Natural => {
            let table = ShapeTable::new(&body.functions, &body.points, &PlaneStrain)?;
            model.add(rkpm::term::Body::new(table, rubber()?, PressureField::Displacement));
        }
        Rule::Consistent | Rule::Both => {
            model.add(Consistent::new(body, rubber()?)?);
        }
    }
    if matches!(rule, Rule::Natural | Rule::Both) {
        for axis in 0..2 {
            model.add(Pointwise::new(second_derivatives(body, axis)?, NaturalStabilisation));
        }
    }
    Ok(model)
}

/// Rows of a displacement over a part, piece by piece.
fn prescribe(
    rows: &mut Constraints,
    body: &Body2,
    part: &rkpm::geometry::Part,
    component: usize,
    value: &dyn Fn(&Point<2>) -> f64,
) -> Result<(), rkpm::Error> {
    for piece in body.cells.boundary_pieces(part, 2, 2)? {
        rows.over_boundary(&body.functions, &piece, &PlaneStrain, component, value, &Amplitude::Ramp, "u")?;
    }
    Ok(())
}

fn run(model: &Model, rows: &Constraints) -> Result<State, rkpm::Error> {
    let analysis = Analysis::new(MixedTransformation::default(), Direct::default());
    Ok(analysis.run(model, rows, &mut ())?.completed()?.last().clone())
}

fn at(body: &Body2, state: &State, x: Point<2>) -> Result<Point<2>, rkpm::Error> {
    let psi = body.functions.shape_functions(&x)?;
    let mut u = Point::<2>::zeros();
    for (&node, value) in psi.nodes.iter().zip(&psi.values) {
        let d = &state.displacement[2 * node as usize..2 * node as usize + 2];
        u += Point::<2>::new(d[0], d[1]) * *value;
    }
    Ok(u)
}

/// Largest error of a linear field on an L with a hole.
fn patch_test(rule: Rule) -> Result<f64, rkpm::Error> {
    let outline = Outline::at([0.0, 0.0])
        .line("a", [2.0, 0.0])
        .line("b", [2.0, 1.0])
        .line("c", [1.0, 1.0])
        .line("d", [1.0, 2.0])
        .line("e", [0.0, 2.0])
        .close("f");
    let region = Region::with_holes(outline, [Outline::circle("hole", [0.5, 0.5], 0.25)])?;
    let body = Body2::new(&region, 150, 1)?;
    let gradient = SMatrix::<f64, 2, 2>::new(0.02, 0.01, -0.005, -0.01);
    let mut rows = Constraints::default();
    for component in 0..2 {
        prescribe(&mut rows, &body, &rkpm::geometry::Part::Whole, component, &|x| (gradient * x)[component])?;
    }
    let state = run(&model(&body, rule)?, &rows)?;
    let (mut error, mut size) = (0.0f64, 0.0f64);
    for x in body.cells.positions() {
        error = error.max((at(&body, &state, *x)? - gradient * x).norm());
        size = size.max((gradient * x).norm());
    }
    Ok(error / size)
}

/// Deflection of the corner of Cook's membrane.
fn cook(rule: Rule, count: usize) -> Result<f64, rkpm::Error> {
    let outline = Outline::at([0.0, 0.0])
        .line("bottom", [48.0, 44.0])
        .line("right", [48.0, 60.0])
        .line("top", [0.0, 44.0])
        .close("left");
    let body = Body2::new(&Region::new(outline)?, count, 1)?;
    let mut model = model(&body, rule)?;
    let right = body.cells.boundary(&"right".into(), 2, 2)?.points;
    let table = ShapeTable::new(&body.functions, &right, &PlaneStrain)?;
    let force = [0.0, 0.03, 0.0].into();
    model.add(Pointwise::new(table, DeadLoad { force, amplitude: Amplitude::Ramp }));
    let mut rows = Constraints::default();
    for component in 0..2 {
        prescribe(&mut rows, &body, &"left".into(), component, &|_| 0.0)?;
    }
    let state = run(&model, &rows)?;
    Ok(at(&body, &state, Point::<2>::new(48.0, 60.0))?[1])
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("nodal_integration");
    let reference = cook(Rule::Smoothed, 2500)?;
    let mut summary = Summary::new();
    let rules = [
        ("default", Rule::Smoothed),
        ("scni", Rule::Conforming),
        ("nodal", Rule::Nodal),
        ("nsni", Rule::Natural),
        ("vc", Rule::Consistent),
        ("vc_nsni", Rule::Both),
    ];
    for (name, rule) in rules {
        // A rule that does not carry the load is a result too.
        summary.note(format!("patch_{name}"), patch_test(rule).unwrap_or(f64::NAN))?;
        summary.note(format!("cook_{name}_289"), cook(rule, 289).map_or(f64::NAN, |tip| tip / reference - 1.0))?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    println!("results in {}", out.display());
    Ok(())
}
