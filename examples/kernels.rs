//! Kernel functions, their corrections, and why rubber wants a material kernel (paper §3.1, §4.3).
//!
//! `cargo run --release --example kernels [-- --out DIR]` writes Fig. 1 (kernel and modified kernel), Figs. 2 and 3
//! (material and spatial kernel of a stretched bar), Fig. 4 (particles, supports and zones), the kernels of the crate, and
//! `summary.csv`: the stretch at which a spatial kernel of fixed dilation loses its cover at particles (`lost_r…`), the smaller one
//! at which the certificate warns (`warned_r…`), and analyses of the sheet of §6.1 whose shape functions are rebuilt on the current
//! configuration after each step (`spatial_…`), beside those with a material kernel (`material_…`). `analyses.svg` shows them.

mod support;

use std::error::Error;
use std::path::Path as FilePath;
use std::sync::Arc;

use rkpm::error::ApproximationError;
use rkpm::nalgebra::Matrix2;
use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use support::Summary;

/// Nine particles one unit apart with their volumes inside the sum (3.24).
fn bar(r: f64) -> Result<ReproducingKernel<1, CubicSpline, Polynomial<1>>, rkpm::Error> {
    let particles = Block::new([0.0], [8.0]).particles([9], r)?;
    let volumes = (0..9).map(|i| if i == 0 || i == 8 { 0.5 } else { 1.0 }).collect();
    Ok(ReproducingKernel::new(particles.with_volumes(volumes)?, CubicSpline, Polynomial::linear())?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("kernels");
    modified_kernels(&out)?;
    stretched_kernels(&out)?;
    discretization()?.0.write(out.join("discretization.svg"))?;
    all_kernels(&out)?;
    draw_cover(&out)?;
    let analyses = analyses()?;
    draw_analyses(&out, &analyses)?;
    let summary = summary(&analyses)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    println!("results in {}", out.display());
    Ok(())
}

/// Fig. 1: the correction changes the kernel near an end and leaves its shape alone inside.
fn modified_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let rk = bar(1.0)?;
    let mut chart =
        Chart::new("Kernel and modified kernel, nine particles, r = 1").x("x").y("kernel × particle volume");
    for particle in [0, 1, 4] {
        let mut plain = Vec::new();
        let mut modified = Vec::new();
        for i in 0..=320 {
            let x = [i as f64 / 40.0].into();
            let weights = rk.kernel_weights(&x);
            let weight = weights.iter().find(|w| w.0 == particle).map_or(0.0, |w| w.1);
            // (3.25) integrates to 1/2: twice the kernel estimates a constant inside the bar.
            plain.push([x[0], 2.0 * weight]);
            // The modified kernel is the shape function.
            let psi = rk.shape_functions(&x)?;
            let own = psi.nodes.iter().zip(&psi.values).find(|own| *own.0 == particle);
            modified.push([x[0], own.map_or(0.0, |own| *own.1)]);
        }
        let name = format!("particle {particle}");
        chart = chart.line(format!("{name}, modified"), &modified).dashed(format!("{name}, 2Φ"), &plain);
    }
    chart.write(out.join("modified_kernel.svg"))?;
    Ok(())
}

/// Figs. 2 and 3: a bar stretched by x = (1 + t) X; the support of a material kernel follows the particles, that
/// of a spatial one does not. Each kernel over the original and over the current configuration.
fn stretched_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    // The support covers five particles at rest, as in the paper.
    let rk = bar(1.5)?;
    let middle = 4;
    for (name, material) in [("material_kernel", true), ("spatial_kernel", false)] {
        let equation = if material { "Material kernel (4.52)" } else { "Spatial kernel (4.55)" };
        let mut original = Chart::new(format!("{equation}, original configuration"))
            .x("X")
            .y("kernel of the middle particle, stretch by stretch below");
        let mut current = Chart::new(format!("{equation}, current configuration"))
            .x("x")
            .y("kernel of the middle particle, stretch by stretch below");
        for (row, t) in [0.0, 0.5, 1.0, 2.0].into_iter().enumerate() {
            let stretch = 1.0 + t;
            let base = -(row as f64);
            let moved = rk.nodes().iter().map(|x| x * stretch).collect::<Vec<_>>();
            // A spatial kernel stands at the moved particles and is requested at points of the moved bar.
            let spatial = rk.spatial(moved.clone())?;
            let kernel = |x: f64| {
                let weights = if material {
                    rk.kernel_weights(&[x].into())
                } else {
                    spatial.kernel_weights(&[x * stretch].into())
                };
                weights.iter().find(|w| w.0 == middle).map_or(0.0, |w| w.1)
            };
            let places = (0..=640).map(|i| f64::from(i) / 80.0);
            let values: Vec<[f64; 2]> = places.map(|x| [x, base + kernel(x)]).collect();
            let stretched: Vec<[f64; 2]> = values.iter().map(|q| [q[0] * stretch, q[1]]).collect();
            let at_rest: Vec<[f64; 2]> = rk.nodes().iter().map(|x| [x[0], base]).collect();
            let now: Vec<[f64; 2]> = moved.iter().map(|x| [x[0], base]).collect();
            original = original.line(format!("stretch {stretch}"), &values).markers("", &at_rest);
            current = current.line(format!("stretch {stretch}"), &stretched).markers("", &now);
        }
        std::fs::write(out.join(format!("{name}.svg")), support::panels(&[original, current])?)?;
    }
    Ok(())
}

/// The kernels of the crate side by side.
fn all_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let gaussian = Gaussian::default();
    let kernels: [(&str, &dyn Kernel); 4] = [
        ("cubic B-spline (3.25)", &CubicSpline),
        ("quintic B-spline", &QuinticSpline),
        ("Gaussian, width 0.4", &gaussian),
        ("Wendland C2", &WendlandC2),
    ];
    let mut chart = Chart::new("Kernels, scaled to one at the centre").x("z = |x − x_I| / a").y("Φ(z) / Φ(0)");
    for (name, kernel) in kernels {
        let top = kernel.value_and_slope(0.0).0;
        let curve: Vec<[f64; 2]> =
            (0..=120).map(|i| f64::from(i) / 100.0).map(|z| [z, kernel.value_and_slope(z).0 / top]).collect();
        chart = chart.line(name, &curve);
    }
    chart.write(out.join("kernels.svg"))?;
    Ok(())
}

/// Normalised dilations of the stretched bar.
const DILATIONS: [f64; 5] = [0.75, 1.0, 1.25, 1.5, 2.0];

/// The certificate of the particles of a bar that was stretched.
fn cover(r: f64, stretch: f64) -> Result<rkpm::paper::Cover, rkpm::Error> {
    let rk = bar(r)?;
    // As far as the arithmetic goes: the usual guard would refuse a hair earlier.
    let spatial = rk.spatial(rk.nodes().iter().map(|x| x * stretch).collect())?.with_rcond_limit(1e-300);
    Ok(spatial.cover(spatial.nodes()))
}

/// The certificate against the stretch.
fn draw_cover(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new(["r", "stretch", "smallest_rcond"]);
    let mut chart = Chart::new("Certificate of a spatial kernel at its particles")
        .x("stretch 1 + t")
        .y_log("smallest reciprocal condition of M");
    for r in DILATIONS {
        let mut curve = Vec::new();
        for i in 0..=150 {
            let stretch = 1.0 + f64::from(i) / 50.0;
            let rcond = cover(r, stretch)?.rcond;
            table.push([r, stretch, rcond])?;
            curve.push([stretch, if rcond > 1e-8 { rcond } else { f64::NAN }]);
        }
        chart = chart.line(format!("r = {r}"), &curve);
    }
    chart.horizontal("warning", rkpm::paper::COVER_WARNING).write(out.join("cover.svg"))?;
    table.write(out.join("cover.csv"))?;
    Ok(())
}

/// All rows of `summary.csv`.
pub fn summary(analyses: &[PulledSheet]) -> Result<Summary, Box<dyn Error>> {
    let mut summary = Summary::new();
    summary.note("covering_particles", discretization()?.1 as f64)?;
    for r in DILATIONS {
        let bisect = |bad: &dyn Fn(&rkpm::paper::Cover) -> bool| -> Result<f64, rkpm::Error> {
            let (mut good, mut lost) = (1.0, 8.0);
            for _ in 0..50 {
                let middle = 0.5 * (good + lost);
                if bad(&cover(r, middle)?) { lost = middle } else { good = middle }
            }
            Ok(lost)
        };
        // Linear basis: both neighbours leave the support together, at 2r.
        summary.record(format!("lost_r{r}"), bisect(&|c| c.is_lost())?, 2.0 * r)?;
        summary.note(format!("warned_r{r}"), bisect(&|c| c.is_warned())?)?;
    }
    for PulledSheet { r, is_spatial, curve, error } in analyses {
        let kernel = if *is_spatial { "spatial" } else { "material" };
        let reached = curve.last().map_or(1.0, |point| point[0]);
        let off = |[stretch, force]: &[f64; 2]| (force / exact_force(*stretch) - 1.0).abs();
        summary.note(format!("{kernel}_reached_r{r}"), reached)?;
        summary.note(format!("{kernel}_force_error_r{r}"), curve.iter().map(off).fold(0.0, f64::max))?;
        if *is_spatial {
            // The shape functions of the configuration that was reached last do not exist everywhere.
            let lost = matches!(
                error,
                Some(rkpm::Error::Approximation(
                    ApproximationError::Singular { .. } | ApproximationError::Uncovered { .. }
                ))
            );
            summary.note(format!("spatial_lost_its_cover_r{r}"), f64::from(u8::from(lost)))?;
        }
    }
    Ok(summary)
}

/// Fig. 4: particles with circular supports (3.27), zones of integration with their points, and a point that three supports cover;
/// with how many particles have a shape function there.
fn discretization() -> Result<(Chart, usize), Box<dyn Error>> {
    const RADIUS: f64 = 1.1;
    let block = Block::new([0.0, 0.0], [3.0, 2.0]);
    let lattice = Lattice::new(&block, [4, 3], &Layout::Jittered { amount: 0.25, seed: 4 })?;
    let positions = lattice.positions().to_vec();
    let particles = Particles::new(positions.clone(), vec![Support::Ball(RADIUS); positions.len()])?;
    let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
    let zones = block.lattice([4, 3])?;
    let points = zones.gauss(2)?.positions;
    let centre = Point::<2>::new(1.5, 1.0);
    let covered = |x: &&Point<2>| rk.kernel_weights(x).len() == 3;
    let at = points.iter().filter(covered).min_by(|a, b| (*a - centre).norm().total_cmp(&(*b - centre).norm()));
    let at = *at.ok_or("no point is covered by three supports")?;
    let set = rk.shape_functions(&at)?.nodes;
    let circle = |centre: &Point<2>| -> Vec<[f64; 2]> {
        let turn = |k: i32| (std::f64::consts::TAU * f64::from(k) / 72.0).sin_cos();
        (0..=72).map(turn).map(|(sin, cos)| [centre[0] + RADIUS * cos, centre[1] + RADIUS * sin]).collect()
    };
    let supports: Vec<_> = set.iter().map(|&particle| circle(&positions[particle as usize])).collect();
    let chart = Chart::new("Particles, zones of integration, and the supports that cover a point")
        .x("X")
        .y("Y")
        .equal_aspect()
        .with(Series::outlines("partition lines", &support::grid_lines_at_rest(&zones)).colour(Colour::Grey))
        .with(Series::markers("integration points", &points).marker(Marker::Cross).colour(Colour::Grey))
        .with(Series::markers("particles", &positions).marker(Marker::Circle).colour(Colour::Blue))
        .with(Series::outlines("supports of the particles that cover X_A", &supports).colour(Colour::Sky))
        .with(Series::markers("X_A", &[at]).marker(Marker::Square).colour(Colour::Vermilion));
    Ok((chart, set.len()))
}

type Functions = ReproducingKernel<2, CubicSpline, Polynomial<2>>;

/// Spatial kernels as functions of reference positions (4.54), $\Phi_a(\varphi(X) - \varphi(X_I))$: particles stand where the state
/// before has brought them, supports stay as they were.
#[derive(Clone)]
struct Spatial {
    rk: Functions,
    /// Reference positions.
    nodes: Vec<Point<2>>,
    /// The functions and the coefficients of the state before; none at rest.
    before: Option<(Arc<Spatial>, Vec<f64>)>,
}

impl Spatial {
    fn at_rest(rk: Functions) -> Self {
        Spatial { nodes: rk.nodes().to_vec(), rk, before: None }
    }

    /// The functions rebuilt on the configuration of a state.
    fn rebuilt(self: &Arc<Self>, displacement: &[f64]) -> Result<Self, ApproximationError> {
        let before = Some((self.clone(), displacement.to_vec()));
        let mut next = Spatial { rk: self.rk.clone(), nodes: self.nodes.clone(), before };
        let moved =
            next.nodes.iter().map(|node| Ok(next.motion(node)?.0)).collect::<Result<_, ApproximationError>>()?;
        next.rk = self.rk.spatial(moved)?;
        Ok(next)
    }

    /// Where the state before has brought a point, and the gradient of that motion.
    fn motion(&self, at: &Point<2>) -> Result<(Point<2>, Matrix2<f64>), ApproximationError> {
        let (mut position, mut gradient) = (*at, Matrix2::identity());
        if let Some((before, displacement)) = &self.before {
            let psi = before.shape_functions(at)?;
            for ((&node, value), slope) in psi.nodes.iter().zip(&psi.values).zip(&psi.gradients) {
                let coefficient = Point::<2>::from_column_slice(&displacement[2 * node as usize..][..2]);
                position += coefficient * *value;
                gradient += coefficient * slope.transpose();
            }
        }
        Ok((position, gradient))
    }
}

impl Approximation<2> for Spatial {
    fn nodes(&self) -> &[Point<2>] {
        &self.nodes
    }

    fn evaluate(
        &self,
        at: &Point<2>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<2>,
    ) -> Result<(), ApproximationError> {
        let (position, gradient) = self.motion(at)?;
        self.rk.evaluate(&position, scratch, out)?;
        // The chain rule of (4.51): what is wanted is the slope over reference positions.
        out.gradients.iter_mut().for_each(|slope| *slope = gradient.tr_mul(slope));
        Ok(())
    }
}

/// Length and height of the sheet of §6.1 \[cm\].
const SHEET: [f64; 2] = [1.0, 0.25];
/// Coefficients of its rubber \[MPa\].
const YEOH: [f64; 3] = [0.373, -0.031, 0.005];
/// Stretches to which it is pulled in turn; no dilation loses its cover, at $2r$, at one of them.
const STEPS: usize = 20;
const STEP: f64 = 0.15;

/// The sheet pulled in steps by one kernel.
pub struct PulledSheet {
    r: f64,
    is_spatial: bool,
    /// Stretches and forces of the pulled end \[MPa cm\], as far as the analysis came.
    curve: Vec<[f64; 2]>,
    error: Option<rkpm::Error>,
}

/// The force on the end of the incompressible sheet, $2\bar W'(I_1)(\lambda - \lambda^{-3})$ times its height.
fn exact_force(stretch: f64) -> f64 {
    let excess = stretch.powi(2) + stretch.powi(-2) - 2.0;
    let slope = YEOH[0] + 2.0 * YEOH[1] * excess + 3.0 * YEOH[2] * excess * excess;
    2.0 * slope * (stretch - stretch.powi(-3)) * SHEET[1]
}

/// Equilibrium of the stretched sheet with given shape functions: coefficients of its displacement, and the force on its end.
fn pulled(functions: &Arc<Spatial>, stretch: f64) -> Result<(Vec<f64>, f64), rkpm::Error> {
    let lattice = Block::new([0.0, 0.0], SHEET).lattice([9, 3])?;
    // 4 × 1 zones of 3 × 3 particles: 5 × 5 points each.
    let table = ShapeTable::new(&**functions, &lattice.coarsened(2).gauss(5)?, &PlaneStrain)?;
    let rubber: Arc<dyn Material> = Arc::new(Rubber::yeoh(YEOH[0], YEOH[1], YEOH[2], 1e5)?);
    let body = Body::new(table, rubber, PressureField::Pointwise);
    let mut problem = Problem::compose(lattice.clone(), Spatial::clone(functions), body)?;
    let conditions =
        [("left", 0, Side::Min, 0.0), ("right", 0, Side::Max, (stretch - 1.0) * SHEET[0]), ("axis", 1, Side::Min, 0.0)];
    for (name, axis, side, value) in conditions {
        let face = lattice.boundary(&(axis, side).into(), 2, 3)?;
        problem.constrain(name, |equations| {
            equations.over_boundary(&**functions, &face, &PlaneStrain, axis, &|_| value, &Amplitude::Ramp, name)
        })?;
    }
    let path = problem.run()?.completed()?;
    let force = problem.reaction(path.last(), "right")?[0];
    Ok((path.last().displacement.clone(), force))
}

/// Sheets with material and spatial kernels of several dilations, in the same steps.
pub fn analyses() -> Result<Vec<PulledSheet>, rkpm::Error> {
    let mut all = Vec::new();
    for r in [0.75, 1.0, 1.5] {
        let particles = Block::new([0.0, 0.0], SHEET).lattice([9, 3])?.particles(r)?;
        let rest = Arc::new(Spatial::at_rest(ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?));
        for is_spatial in [false, true] {
            let mut functions = rest.clone();
            let mut sheet = PulledSheet { r, is_spatial, curve: Vec::new(), error: None };
            for stretch in (1..=STEPS).map(|k| 1.0 + STEP * k as f64) {
                let step = pulled(&functions, stretch).and_then(|(displacement, force)| {
                    sheet.curve.push([stretch, force]);
                    if is_spatial {
                        functions = Arc::new(functions.rebuilt(&displacement)?);
                    }
                    Ok(())
                });
                if let Err(error) = step {
                    sheet.error = Some(error);
                    break;
                }
            }
            all.push(sheet);
        }
    }
    Ok(all)
}

/// Forces against stretches, as far as each analysis came.
fn draw_analyses(out: &FilePath, analyses: &[PulledSheet]) -> Result<(), Box<dyn Error>> {
    let stretches = (0..=120).map(|k| 1.0 + f64::from(k) / 40.0);
    let exact: Vec<[f64; 2]> = stretches.map(|stretch| [stretch, exact_force(stretch)]).collect();
    let mut table = Table::new(["r", "is_spatial", "stretch", "force_MPa_cm"]);
    let mut chart = Chart::new("A sheet pulled by material and spatial kernels")
        .x("stretch")
        .y("force on the end [MPa cm]")
        .line("exact, incompressible", &exact);
    let markers = [Marker::Circle, Marker::Square, Marker::Cross];
    for (k, PulledSheet { r, is_spatial, curve, .. }) in analyses.iter().enumerate() {
        for [stretch, force] in curve {
            table.push([*r, f64::from(u8::from(*is_spatial)), *stretch, *force])?;
        }
        // Material kernels of all dilations lie on each other.
        if !is_spatial && *r != 1.0 {
            continue;
        }
        let (kernel, colour) = if *is_spatial { ("spatial", Colour::Vermilion) } else { ("material", Colour::Blue) };
        let series = Series::markers(format!("{kernel}, r = {r}"), curve);
        chart = chart.with(series.marker(markers[k / 2 % markers.len()]).colour(colour));
    }
    table.write(out.join("analyses.csv"))?;
    chart.write(out.join("analyses.svg"))?;
    Ok(())
}
