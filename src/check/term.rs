//! The contract of terms.

use crate::assembly::{fault, misnumbered};
use crate::each::{Each, add};
use crate::error::{Error, Invalid};
use crate::linear::vector::norm;
use crate::term::{Coupling, Element, Form, Term, TermState, TermStep, View};

use super::{Finding, Report, nearest_difference, signed};

/// Random directions per cluster along which derivatives are compared.
const DIRECTIONS: usize = 3;
/// Step of the central differences relative to the size of the displacement.
const STEP: f64 = 1e-5;
/// What differences leave of exact derivatives.
const TOLERANCE: f64 = 1e-6;
/// Sweeps of the local equations before they count as unsolvable.
const SWEEPS: usize = 30;
/// Change of the condensed unknowns, relative to their size, at which they count as solved.
const SOLVED: f64 = 1e-12;

/// Checks the contract of [`Term`] around a state, cluster by cluster: the residual is the derivative of
/// the energy (where there is one), the matrix that of the residual, the load slope that of the residual
/// by the load factor; nodes rise, forces and matrix are finite, the matrix is symmetric where [`Term::layout`] promises so, residual, load slope and matrix keep the lengths in which they are handed over, and
/// [`advance`](Term::advance) allows a step of nothing in full.
///
/// `displacement` holds the coefficients of all nodes, as many components each as the term has dimensions: a small admissible state that
/// is not at rest, where errors hide. Terms with condensed unknowns are checked with these solved
/// (by [`advance`](Term::advance) with a step of nothing) at each state: then the condensed residual is the
/// derivative of the energy, the condensed matrix that of the residual, and the increments by
/// `advance` are the derivatives of the solved unknowns along the step. How such a term converges from
/// condensed unknowns that are not solved is not checked.
///
/// # Errors
/// Where the displacement is not finite, [`MissingNode`](crate::error::SolveError::MissingNode) where it lacks nodes of the term, and [`Unknowns`](crate::error::SolveError::Unknowns) where
/// clusters share condensed unknowns.
///
/// ```
/// use rkpm::check;
/// use rkpm::prelude::*;
/// let block = Block::new([0.0, 0.0], [1.0, 1.0]);
/// let lattice = block.lattice([4, 4])?;
/// let functions = ReproducingKernel::new(lattice.particles(1.0)?, CubicSpline, Polynomial::linear())?;
/// let table = ShapeTable::new(&functions, &lattice.gauss_in(2, &lattice.zones(3))?, &PlaneStrain)?;
/// let body = Body::new(table, Rubber::neo_hookean(0.5, 100.0)?, PressureField::Linear);
/// let displacement: Vec<f64> = (0..32).map(|k| 0.02 * (k as f64).sin()).collect();
/// let report = check::term(&body, &displacement, 1.0)?;
/// assert!(report.holds(), "{report}");
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn term(term: &dyn Term, displacement: &[f64], load: f64) -> Result<Report, Error> {
    if let Some(&value) = displacement.iter().chain([&load]).find(|v| !v.is_finite()) {
        return Err(Invalid::new("state to check a term at", value, "give finite values").into());
    }
    let (clusters, dim) = (term.clusters(), term.dim());
    ensure!((1..=3).contains(&dim), Invalid::new("dimension of a term", dim as f64, "return 1, 2 or 3 from Term::dim"));
    let nodes = displacement.len() / dim;
    if let Some(error) = misnumbered(term, 0, nodes) {
        return Err(error.into());
    }
    let probe = Probe::new(term, displacement, load);
    let mut order = Finding::new("the nodes of a cluster rise", 0.0);
    let mut promises =
        Finding::new("forces and matrix are finite, and the matrix is symmetric where that is promised", 0.0);
    let mut still = Finding::new("a step of nothing is allowed in full", 0.0);
    for cluster in 0..clusters {
        let rising = term.nodes(cluster).windows(2).all(|w| w[0] < w[1]);
        order.see(f64::from(u8::from(!rising)), || format!("cluster {cluster}"));
    }
    let report = Report::default();
    let Some(base) = probe.solved(displacement, load) else {
        return Ok(report
            .with([order])
            .unchecked("all derivatives: the condensed unknowns were not solved by advance() with a step of nothing"));
    };
    let mut lengths = Finding::new("linearize() keeps the lengths of its buffers", 0.0);
    for cluster in 0..clusters {
        let changed = probe.changed_lengths(cluster, &base);
        lengths.see(changed as f64, || format!("cluster {cluster}"));
    }
    if !lengths.holds() {
        return Ok(report.with([order, lengths]).unchecked("all derivatives: the buffers have other lengths"));
    }
    for cluster in 0..clusters {
        let fault = probe.fault(cluster, &base);
        promises
            .see(f64::from(u8::from(fault.is_some())), || format!("cluster {cluster}: {}", fault.unwrap_or_default()));
        let factor = probe.advance(cluster, displacement, load, &base, &probe.nothing, &mut Vec::new());
        still.see((factor - 1.0).abs(), || format!("cluster {cluster}"));
    }
    let report = report.with([order, lengths, promises, still]);
    Ok(probe.derivatives(report, &base))
}

/// A term at a state.
struct Probe<'a> {
    term: &'a dyn Term,
    displacement: &'a [f64],
    load: f64,
    /// What it holds at zero displacement.
    start: TermState,
    nothing: Vec<f64>,
    step: f64,
}

impl<'a> Probe<'a> {
    fn new(term: &'a dyn Term, displacement: &'a [f64], load: f64) -> Self {
        let condensed = (0..term.clusters()).map(|c| term.unknowns(c).end).max().unwrap_or(0);
        let mut start = TermState { condensed: vec![0.0; condensed], history: vec![0.0; term.layout().history] };
        term.start(&mut start.condensed, &mut start.history);
        let size = displacement.largest(|v| v.abs());
        let step = STEP * if size > 0.0 { size } else { 1.0 };
        Probe { term, displacement, load, start, nothing: vec![0.0; displacement.len()], step }
    }

    fn view<'b>(&'b self, displacement: &'b [f64], load: f64, condensed: &'b [f64]) -> View<'b> {
        View { displacement, condensed, history: &self.start.history, load, elapsed: 0.0 }
    }

    fn advance(
        &self,
        cluster: usize,
        displacement: &[f64],
        load: f64,
        condensed: &[f64],
        step: &[f64],
        out: &mut Vec<f64>,
    ) -> f64 {
        out.clear();
        out.resize(self.term.unknowns(cluster).len(), 0.0);
        let step = TermStep { displacement: step, load: 0.0 };
        self.term.advance(cluster, self.view(displacement, load, condensed), step, out)
    }

    /// The condensed unknowns that belong to a displacement; `None` where they are not found.
    fn solved(&self, displacement: &[f64], load: f64) -> Option<Vec<f64>> {
        let mut condensed = self.start.condensed.clone();
        let mut change = Vec::new();
        for cluster in 0..self.term.clusters() {
            let range = self.term.unknowns(cluster);
            if range.is_empty() {
                continue;
            }
            let mut found = false;
            for _ in 0..SWEEPS {
                self.advance(cluster, displacement, load, &condensed, &self.nothing, &mut change);
                let own = &mut condensed[range.clone()];
                let size = own.largest(|v| v.abs());
                let moved = change.largest(|v| v.abs());
                add(own, 1.0, &change);
                found = moved <= SOLVED * size.max(1e-300);
                if found {
                    break;
                }
            }
            if !found {
                return None;
            }
        }
        Some(condensed)
    }

    fn linearize(&self, cluster: usize, displacement: &[f64], load: f64, condensed: &[f64], matrix: bool) -> Element {
        let mut element = Element::default();
        let size = self.term.nodes(cluster).len() * self.term.dim();
        element.reset(size, matrix);
        self.term.linearize(cluster, self.view(displacement, load, condensed), &mut element);
        // They may change in one state and not in another.
        element.residual.resize(size, f64::NAN);
        element.load_slope.resize(size, f64::NAN);
        element.matrix.resize(if matrix { size * size } else { 0 }, f64::NAN);
        element
    }

    /// Entries by which a linearisation, with a matrix and without, makes its buffers longer or shorter.
    fn changed_lengths(&self, cluster: usize, condensed: &[f64]) -> usize {
        let size = self.term.nodes(cluster).len() * self.term.dim();
        let view = self.view(self.displacement, self.load, condensed);
        let mut changed = 0;
        for matrix in [false, true] {
            let mut element = Element::default();
            element.reset(size, matrix);
            self.term.linearize(cluster, view, &mut element);
            changed += element.residual.len().abs_diff(size) + element.load_slope.len().abs_diff(size);
            changed += element.matrix.len().abs_diff(if matrix { size * size } else { 0 });
        }
        changed
    }

    /// What is wrong with a cluster whose matrix is filled node by node.
    fn fault(&self, cluster: usize, condensed: &[f64]) -> Option<&'static str> {
        if !matches!(self.term.form(), Form::Nodes) {
            return None;
        }
        let layout = self.term.layout();
        let element = self.linearize(cluster, self.displacement, self.load, condensed, layout.has_matrix);
        fault(element.residual.len(), layout, &element)
    }

    fn energy(&self, cluster: usize, displacement: &[f64], condensed: &[f64]) -> f64 {
        self.term.energy(cluster, self.view(displacement, self.load, condensed))
    }

    /// The displacement moved by `t` along a direction of one cluster.
    fn moved(&self, cluster: usize, direction: &[f64], t: f64) -> Vec<f64> {
        let (dim, mut displacement) = (self.term.dim(), self.displacement.to_vec());
        for (a, &node) in self.term.nodes(cluster).iter().enumerate() {
            for i in 0..dim {
                displacement[node as usize * dim + i] += t * direction[a * dim + i];
            }
        }
        displacement
    }

    /// Compares the load slope: that of one side where the load factor is at a break point of a table. None where condensed unknowns
    /// were not solved beside it.
    fn load_slope(&self, base: &[f64]) -> Option<Finding> {
        let loads: Vec<f64> = (-3..=3).map(|steps| self.load + f64::from(steps) * STEP).collect();
        let mut solved = Vec::with_capacity(loads.len());
        for &load in &loads {
            solved.push(self.solved(self.displacement, load)?);
        }
        let mut slope = Finding::new("the load slope is the derivative of the residual", TOLERANCE);
        for cluster in 0..self.term.clusters() {
            let element = self.linearize(cluster, self.displacement, self.load, base, true);
            let residual = |steps: i32| {
                let at = (steps + 3) as usize;
                self.linearize(cluster, self.displacement, loads[at], &solved[at], false).residual
            };
            let change = nearest_difference(&residual, &element.load_slope, STEP);
            let size = norm(&element.load_slope) + norm(&element.residual) * 1e-10 / STEP;
            slope.see(relative(&change, &element.load_slope, size), || format!("cluster {cluster}"));
        }
        Some(slope)
    }

    /// Compares all derivatives, cluster by cluster.
    fn derivatives(&self, report: Report, base: &[f64]) -> Report {
        let mut residual = Finding::new("the residual is the derivative of the energy", TOLERANCE);
        let mut matrix = Finding::new("the matrix is the derivative of the residual", TOLERANCE);
        let mut condensed = Finding::new("advance() follows the solved condensed unknowns", TOLERANCE);
        let mut random = fastrand::Rng::with_seed(3);
        let (mut stored, mut solved_all) = (false, true);
        for cluster in 0..self.term.clusters() {
            let place = || format!("cluster {cluster}");
            let element = self.linearize(cluster, self.displacement, self.load, base, true);
            let full = full_matrix(self.term.dim(), &element, self.term.layout().symmetric);
            let forces = norm(&element.residual);
            for _ in 0..DIRECTIONS {
                let direction: Vec<f64> = element.residual.mapped(|_| signed(&mut random));
                let (plus, minus) =
                    (self.moved(cluster, &direction, self.step), self.moved(cluster, &direction, -self.step));
                let (Some(l_plus), Some(l_minus)) = (self.solved(&plus, self.load), self.solved(&minus, self.load))
                else {
                    solved_all = false;
                    continue;
                };
                let energies = [self.energy(cluster, &plus, &l_plus), self.energy(cluster, &minus, &l_minus)];
                if energies != [0.0; 2] {
                    stored = true;
                    let work: f64 = element.residual.pair_sum(&direction, |r, v| r * v);
                    let error = (energies[0] - energies[1]) / (2.0 * self.step) - work;
                    let size = forces * norm(&direction) + (energies[0].abs() + energies[1].abs()) * 1e-10 / self.step;
                    residual.see(error.abs() / size, place);
                }
                let above = self.linearize(cluster, &plus, self.load, &l_plus, false).residual;
                let below = self.linearize(cluster, &minus, self.load, &l_minus, false).residual;
                let product = multiply(&full, &direction);
                let change: Vec<f64> = above.paired(&below, |a, b| (a - b) / (2.0 * self.step));
                // Rounding of the forces counts too: that of a difference of two large numbers.
                let size = norm(&product) + forces * 1e-10 / self.step;
                matrix.see(relative(&change, &product, size), place);

                let range = self.term.unknowns(cluster);
                if !range.is_empty() {
                    let step: Vec<f64> = plus.paired(&minus, |a, b| (a - b) / (2.0 * self.step));
                    let mut increments = Vec::new();
                    self.advance(cluster, self.displacement, self.load, base, &step, &mut increments);
                    let change: Vec<f64> =
                        range.clone().map(|k| (l_plus[k] - l_minus[k]) / (2.0 * self.step)).collect();
                    let size = norm(&increments) + norm(&base[range]) * 1e-10 / self.step;
                    condensed.see(relative(&change, &increments, size), place);
                }
            }
        }
        let slope = self.load_slope(base);
        solved_all &= slope.is_some();
        let mut report = report.with([matrix]).with(slope);
        if stored {
            report = report.with([residual]);
        } else {
            report = report.unchecked("residual against energy: the term stores none");
        }
        if !self.start.condensed.is_empty() {
            report = report.with([condensed]);
            report = report.unchecked("convergence from condensed unknowns that are not solved");
        }
        if !solved_all {
            report = report.unchecked("some directions: the condensed unknowns were not solved there");
        }
        report
    }
}

/// The matrix with the blocks above the diagonal that symmetric terms leave out, by columns.
fn full_matrix(dim: usize, element: &Element, symmetric: bool) -> Vec<f64> {
    let size = element.residual.len();
    let mut full = element.matrix.clone();
    if symmetric {
        for column in 0..size {
            for row in (column / dim + 1) * dim..size {
                full[row * size + column] = element.matrix[column * size + row];
            }
        }
    }
    for Coupling { left, right } in &element.coupling {
        if left.iter().chain(right).any(|(k, _)| *k as usize >= size) {
            // No entry of the cluster: the matrix is none, and shows.
            full.fill(f64::NAN);
            break;
        }
        for (column, r) in right {
            left.iter().for_each(|(row, l)| full[*column as usize * size + *row as usize] += l * r);
        }
    }
    full
}

fn multiply(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    let size = x.len();
    let mut product = vec![0.0; size];
    for (column, x) in x.iter().enumerate() {
        for (row, p) in product.iter_mut().enumerate() {
            *p += matrix[column * size + row] * x;
        }
    }
    product
}

/// $|a - b|$ over a size; zero where both are.
fn relative(a: &[f64], b: &[f64], size: f64) -> f64 {
    let error = a.pair_sum(b, |a, b| (a - b) * (a - b)).sqrt();
    if error == 0.0 { 0.0 } else { error / size }
}
