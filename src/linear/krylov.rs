//! Large bodies in space: pressures apart, Krylov iteration, linear elements on the particles as a preconditioner.

use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Matrix4;

use crate::assembly::{Assembler, Model, Pattern, Ranks, System};
use crate::error::LinearError;
use crate::geometry::Morton;
use crate::parallel::map_with;
use crate::term::{Product, Zone};

use super::gmres::gmres;
use super::multilevel::{BlockMatrix, Cycles, Multilevel};
use super::{At, Direct, Factorizer, Factors, Inertia, LinearSolver, Linearised, MatrixClass, ZoneProduct};

/// Relative residuals of solutions: no more than Newton's method can make use of. It leaves about the square of what the last
/// iteration has reduced the right-hand side by (Eisenstat and Walker, second choice).
const TOLERANCE: [f64; 2] = [1e-5, 1e-2];
/// Elements of an earlier state go on preconditioning while directions for a decade of the residual are at most so many times
/// those that they took at first.
const STALE: f64 = 1.3;
/// Right-hand sides are not reduced below this part of the largest of an analysis.
const ENOUGH: f64 = 1e-12;
/// Right-hand sides below this part of the largest of an analysis may be rounding, which no direction removes.
const ROUNDING: f64 = 1e-8;
/// Directions before a restart, and at most.
const DIRECTIONS: [usize; 2] = [80, 240];
/// Parts of a product that threads share: the same for any number of them, for the sake of the bits.
const PARTS: usize = 16;
/// Stiffness of held nodes in the preconditioner, in the largest of its diagonal.
const HELD: f64 = 10.0;
/// Schur's complement of the pressures is taken for $1/(c\\,\mu) + H^{-1}$ with this $c$: an unconfined change of volume meets
/// $\lambda + 2\mu$, of which the pointwise part of the volumetric energy leaves $2.3\mu$.
const COMPLEMENT: f64 = 2.0;

/// Elements beside the particles, which are stiff where these are: what a large model is preconditioned with.
#[derive(Clone)]
pub struct Auxiliary {
    /// Linear elements on the particles with the material and the zones of the body.
    pub model: Arc<Model<3>>,
    /// Which term of the model to be solved has the same condensed unknowns.
    pub term: usize,
    /// Values of the shape functions at the particles by rows: first entry of each, particles, values. Empty where the
    /// functions interpolate. Where ranks share the model, the rows of this rank's share.
    pub values: (Vec<usize>, Vec<u32>, Vec<f64>),
    /// Places of the particles in the unit cube, and how many times their spacing it is wide.
    pub places: Vec<[f64; 3]>,
    /// Cells along each axis of the unit cube.
    pub cells: [usize; 3],
    /// Unknowns that conditions hold.
    pub held: Vec<usize>,
}

impl Auxiliary {
    /// The nodes whose part of vectors a rank keeps.
    pub(crate) fn share(ranks: Option<&dyn Ranks>, nodes: usize) -> Range<usize> {
        match ranks {
            Some(ranks) => nodes * ranks.rank() / ranks.count()..nodes * (ranks.rank() + 1) / ranks.count(),
            None => 0..nodes,
        }
    }
}

/// Generalised minimal residuals for nearly incompressible bodies in space.
///
/// Pressures of zones stay unknowns,
/// $$\begin{bmatrix}K & C^T\\ C & -H^{-1}\end{bmatrix}\begin{bmatrix}\delta d\\ q\end{bmatrix} =
///   \begin{bmatrix}b\\ 0\end{bmatrix},$$
/// for $C^T H C$ would couple all particles of a zone and defeat every preconditioner. Conditions hold exactly in each
/// direction: $\Pi = 1 - G^T (G G^T)^{-1} G$. The preconditioner is block triangular. In place of $K^{-1}$ it has
/// $N^{-1} A^{-1} N^{-T}$ with $N_{JI} = \Psi_I(X_J)$ and the stiffness $A$ of trilinear elements between the particles,
/// which sees the same displacements at particles and has a tenth of the entries; one multilevel cycle stands for $A^{-1}$.
/// In place of Schur's complement it has the mass of the pressures, $1/(2\mu) + H^{-1}$.
#[derive(Clone)]
pub struct Krylov {
    auxiliary: Auxiliary,
    /// What one cycle is solved by in place of this crate's own.
    cycle: Option<Arc<dyn LinearSolver>>,
    counts: Arc<Mutex<Vec<usize>>>,
}

impl Krylov {
    /// With the elements that belong to the particles.
    pub fn new(auxiliary: Auxiliary) -> Self {
        Krylov { auxiliary, cycle: None, counts: Arc::default() }
    }

    /// With a solver of one's own in place of a multilevel cycle: of the stiffness of the elements, about. Where ranks share the
    /// model, one that works on all of them.
    pub fn with_cycle(mut self, cycle: Arc<dyn LinearSolver>) -> Self {
        self.cycle = Some(cycle);
        self
    }
}

impl LinearSolver for Krylov {
    fn analyze(
        &self,
        pattern: &Pattern,
        class: MatrixClass,
        _order: Option<&[usize]>,
    ) -> Result<Box<dyn Factorizer>, LinearError> {
        pattern.validate()?;
        let rows = match class {
            MatrixClass::Definite => 0,
            MatrixClass::Saddle { constraints } => constraints,
        };
        let unknowns = pattern.size() - rows;
        if unknowns != self.auxiliary.model.unknowns() {
            return Err(LinearError::Length {
                what: "reduced unknowns beside multipliers",
                given: unknowns,
                needed: self.auxiliary.model.unknowns(),
            });
        }
        // Conditions: entries in rows of multipliers.
        let mut entries: Vec<Vec<(u32, usize)>> = vec![Vec::new(); rows];
        for column in 0..unknowns {
            let all = pattern.column(column);
            let first = all.partition_point(|&row| (row as usize) < unknowns);
            for (k, &row) in all.iter().enumerate().skip(first) {
                entries[row as usize - unknowns].push((column as u32, pattern.columns[column] + k));
            }
        }
        let mut users: Vec<Vec<u32>> = vec![Vec::new(); unknowns];
        for (row, entries) in entries.iter().enumerate() {
            entries.iter().for_each(|&(column, _)| users[column as usize].push(row as u32));
        }
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); rows];
        for (row, entries) in entries.iter().enumerate() {
            let others = entries.iter().flat_map(|&(column, _)| &users[column as usize]);
            columns[row] = others.copied().filter(|&other| other as usize > row).collect();
            columns[row].sort_unstable();
            columns[row].dedup();
        }
        let products = Pattern::from_columns(columns);
        let assembler = self.auxiliary.model.assembler_apart();
        let cycle = match &self.cycle {
            Some(cycle) => {
                // Along a curve, so that each rank holds a region.
                let positions = self.auxiliary.model.positions();
                let curve = Morton::through(positions);
                let mut nodes: Vec<usize> = (0..positions.len()).collect();
                nodes.sort_by_cached_key(|&node| (curve.place(&positions[node]), node));
                let order: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
                Some(cycle.analyze(assembler.pattern(), MatrixClass::Definite, Some(&order))?)
            }
            None => None,
        };
        let ranks = self.auxiliary.model.shared_ranks();
        let projector = if rows > 0 { Some(Direct.analyze(&products, MatrixClass::Definite, None)?) } else { None };
        Ok(Box::new(KrylovFactorizer {
            pattern: pattern.clone(),
            unknowns,
            entries,
            products,
            projector,
            product_values: Vec::new(),
            values_at: Interpolation::new(&self.auxiliary.values, unknowns / 3, ranks.clone()),
            ranks,
            assembler,
            cycle,
            system: System::default(),
            multilevel: None,
            stiffness: 1.0,
            largest: Cell::new(0.0),
            last: Cell::new(f64::MIN_POSITIVE),
            pace: Cell::default(),
            auxiliary: self.auxiliary.clone(),
            counts: self.counts.clone(),
        }))
    }

    fn keeps_pressures(&self) -> bool {
        true
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        self.auxiliary.model.shared_ranks()
    }

    fn directions(&self) -> Vec<usize> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Solutions with the values of shape functions at particles, by a polynomial of fixed degree.
struct Interpolation {
    /// Of all nodes, or of those of a rank.
    rows: Sparse,
    /// Empty where ranks share the rows.
    columns: Sparse,
    own: Range<usize>,
    ranks: Option<Arc<dyn Ranks>>,
    /// Least eigenvalue that the polynomial sees, and its degree.
    least: f64,
    degree: usize,
}

#[derive(Default)]
struct Sparse {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Sparse {
    /// $y = x - A z$ for three components of each node.
    fn residual(&self, x: &[f64], z: &[f64], y: &mut [f64]) {
        for row in 0..self.starts.len().saturating_sub(1) {
            let mut sum = [x[3 * row], x[3 * row + 1], x[3 * row + 2]];
            for k in self.starts[row]..self.starts[row + 1] {
                let z = &z[3 * self.columns[k] as usize..][..3];
                for i in 0..3 {
                    sum[i] -= self.values[k] * z[i];
                }
            }
            y[3 * row..3 * row + 3].copy_from_slice(&sum);
        }
    }

    /// $y \mathrel{-}= A^T z$.
    fn subtract_transposed(&self, z: &[f64], y: &mut [f64]) {
        for row in 0..self.starts.len().saturating_sub(1) {
            for k in self.starts[row]..self.starts[row + 1] {
                let y = &mut y[3 * self.columns[k] as usize..][..3];
                for i in 0..3 {
                    y[i] -= self.values[k] * z[3 * row + i];
                }
            }
        }
    }

    fn transposed(&self) -> Sparse {
        let n = self.starts.len().saturating_sub(1);
        let mut starts = vec![0usize; n + 1];
        self.columns.iter().for_each(|&c| starts[c as usize + 1] += 1);
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let (mut columns, mut values) = (vec![0u32; self.columns.len()], vec![0.0; self.columns.len()]);
        for row in 0..n {
            for k in self.starts[row]..self.starts[row + 1] {
                let place = &mut next[self.columns[k] as usize];
                (columns[*place], values[*place]) = (row as u32, self.values[k]);
                *place += 1;
            }
        }
        Sparse { starts, columns, values }
    }
}

impl Interpolation {
    fn new(
        (starts, columns, values): &(Vec<usize>, Vec<u32>, Vec<f64>),
        nodes: usize,
        ranks: Option<Arc<dyn Ranks>>,
    ) -> Option<Self> {
        if values.is_empty() && ranks.is_none() {
            return None;
        }
        let rows = Sparse { starts: starts.clone(), columns: columns.clone(), values: values.clone() };
        let n = 3 * nodes;
        let columns = if ranks.is_none() { rows.transposed() } else { Sparse::default() };
        let own = Auxiliary::share(ranks.as_deref(), nodes);
        let mut all = Interpolation { rows, columns, own, ranks, least: 0.0, degree: 0 };
        // Splines of the third order on regular lattices have 1/27 and more; wider supports less.
        let b: Vec<f64> = (0..n).map(|k| (1.7 * k as f64).sin()).collect();
        for (least, degree) in [(0.03, 10), (0.01, 18), (0.003, 32), (0.001, 56)] {
            (all.least, all.degree) = (least, degree);
            let mut x = b.clone();
            all.solve(false, &mut x);
            let mut left = vec![0.0; n];
            all.residual(false, &b, &x, &mut left);
            if dot(&left, &left) <= 0.01 * dot(&b, &b) {
                break;
            }
        }
        Some(all)
    }

    /// $y = x - A z$ for the matrix or its transpose.
    fn residual(&self, transposed: bool, x: &[f64], z: &[f64], y: &mut [f64]) {
        let Some(ranks) = &self.ranks else {
            let matrix = if transposed { &self.columns } else { &self.rows };
            return matrix.residual(x, z, y);
        };
        y.fill(0.0);
        if transposed {
            self.rows.subtract_transposed(&z[3 * self.own.start..], y);
        } else {
            let zeros = vec![0.0; 3 * self.own.len()];
            self.rows.residual(&zeros, z, &mut y[3 * self.own.start..3 * self.own.end]);
        }
        ranks.sum(y);
        y.iter_mut().zip(x).for_each(|(y, x)| *y += x);
    }

    /// Chebyshev's iteration from zero, for the matrix or its transpose.
    fn solve(&self, transposed: bool, b: &mut [f64]) {
        let (middle, half) = (0.5 * (1.0 + self.least), 0.5 * (1.0 - self.least));
        let mut x = vec![0.0; b.len()];
        let mut left = b.to_vec();
        let mut step: Vec<f64> = b.iter().map(|b| b / middle).collect();
        let mut rho = half / middle;
        for _ in 0..self.degree {
            x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
            self.residual(transposed, b, &x, &mut left);
            let next = 1.0 / (2.0 * middle / half - rho);
            step.iter_mut().zip(&left).for_each(|(s, l)| *s = next * rho * *s + 2.0 * next / half * l);
            rho = next;
        }
        b.copy_from_slice(&x);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Replaces values by their sums over the ranks.
fn total(ranks: &Option<Arc<dyn Ranks>>, values: &mut [f64]) {
    if let Some(ranks) = ranks {
        ranks.sum(values);
    }
}

struct KrylovFactorizer {
    auxiliary: Auxiliary,
    pattern: Pattern,
    unknowns: usize,
    /// Unknown and place of each entry of a condition.
    entries: Vec<Vec<(u32, usize)>>,
    /// Pattern of $G G^T$.
    products: Pattern,
    projector: Option<Box<dyn Factorizer>>,
    product_values: Vec<f64>,
    values_at: Option<Interpolation>,
    ranks: Option<Arc<dyn Ranks>>,
    assembler: Assembler,
    cycle: Option<Box<dyn Factorizer>>,
    system: System,
    multilevel: Option<Multilevel>,
    /// The largest diagonal entry of the elements.
    stiffness: f64,
    largest: Cell<f64>,
    last: Cell<f64>,
    pace: Cell<Pace>,
    counts: Arc<Mutex<Vec<usize>>>,
}

impl KrylovFactorizer {
    /// The stiffness of the elements at a state.
    fn stiffness(&mut self, at: At<'_>) -> Result<(), LinearError> {
        let Auxiliary { model, term, places, cells, held, .. } = &self.auxiliary;
        let own: Vec<f64> = match &self.values_at {
            Some(values) => {
                let mut moved = vec![0.0; at.displacement.len()];
                values.residual(false, &moved.clone(), at.displacement, &mut moved);
                moved.iter_mut().for_each(|u| *u = -*u);
                moved
            }
            None => at.displacement.to_vec(),
        };
        let condensed = at.condensed.get(*term).map(|l| vec![l.clone()]).unwrap_or_default();
        self.assembler.assemble(model, &own, &condensed, at.load, &mut self.system);
        let mut wrong = [f64::from(u8::from(!self.system.values.iter().all(|v| v.is_finite())))];
        total(&self.ranks, &mut wrong);
        if wrong[0] > 0.0 {
            // Elements may turn over where averages over particles do not: those at rest are stiff in the same places.
            let rest = vec![0.0; own.len()];
            self.assembler.assemble(model, &rest, &model.start(), 0.0, &mut self.system);
        }
        if self.cycle.is_some() {
            let first = &self.assembler.pattern().columns;
            let mut diagonal: Vec<f64> =
                first[..own.len()].iter().map(|&first| self.system.values[first].abs()).collect();
            total(&self.ranks, &mut diagonal);
            self.stiffness = diagonal.iter().fold(0.0, |largest: f64, d| largest.max(*d));
            let stiff = HELD * self.stiffness;
            if self.ranks.as_ref().is_none_or(|ranks| ranks.rank() == 0) {
                held.iter().for_each(|&unknown| self.system.values[first[unknown]] += stiff);
            }
            return Ok(());
        }
        let mut blocks = BlockMatrix::from_lower(self.assembler.pattern(), &self.system.values);
        self.stiffness = blocks.largest_diagonal();
        let stiff = HELD * self.stiffness;
        held.iter().for_each(|&unknown| blocks.add_diagonal(unknown, stiff));
        self.multilevel = Some(Multilevel::new(blocks, places, *cells)?);
        Ok(())
    }
}

impl Factorizer for KrylovFactorizer {
    fn factorize<'a>(&'a mut self, _values: &'a [f64]) -> Result<Box<dyn Factors + 'a>, LinearError> {
        Err(LinearError::Library { what: "a Krylov iteration needs the state beside the matrix".into() })
    }

    fn factorize_at<'a>(&'a mut self, at: Linearised<'a>, state: At<'_>) -> Result<Box<dyn Factors + 'a>, LinearError> {
        let Pace { first, last } = self.pace.get();
        if first.is_none_or(|first| !(last <= STALE * first)) {
            self.stiffness(state)?;
            self.pace.set(Pace::default());
        }
        // Conditions with a largest entry of one.
        let mut rows = Vec::with_capacity(self.entries.len());
        let mut stiffness: f64 = 0.0;
        let mut coefficients: Vec<f64> = self.entries.iter().flatten().map(|&(_, place)| at.values[place]).collect();
        total(&self.ranks, &mut coefficients);
        let mut coefficients = coefficients.into_iter();
        for entries in &self.entries {
            let row: Vec<(u32, f64)> =
                entries.iter().zip(coefficients.by_ref()).map(|(&(column, _), value)| (column, value)).collect();
            stiffness = row.iter().fold(stiffness, |largest, (_, c)| largest.max(c.abs()));
            rows.push(row);
        }
        if rows.is_empty() {
            stiffness = self.stiffness;
        }
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(LinearError::Pivot {
                pivot: 0,
                hint: "the matrix has entries that are not finite, or none at all",
            });
        }
        rows.iter_mut().flatten().for_each(|(_, c)| *c /= stiffness);
        let mut dense = vec![0.0; self.unknowns];
        self.product_values.clear();
        for row in 0..rows.len() {
            rows[row].iter().for_each(|&(column, c)| dense[column as usize] = c);
            for &other in self.products.column(row) {
                let sum = rows[other as usize].iter().map(|&(column, c)| c * dense[column as usize]).sum();
                self.product_values.push(sum);
            }
            rows[row].iter().for_each(|&(column, _)| dense[column as usize] = 0.0);
        }
        let projector = match &mut self.projector {
            Some(projector) => Some(projector.factorize(&self.product_values)?),
            None => None,
        };
        let mut pressures = Vec::with_capacity(at.zones.len());
        for zone in at.zones {
            let singular = LinearError::Pivot { pivot: 0, hint: "the volumetric energy of a zone has no curvature" };
            let compliance = zone.regular_hessian().try_inverse().ok_or(singular)?;
            let soft = if zone.shear > 0.0 { 1.0 / (COMPLEMENT * zone.shear) } else { 0.0 };
            let complement = compliance + Matrix4::identity() * soft;
            let singular = LinearError::Pivot { pivot: 0, hint: "the pressures of a zone have no stiffness" };
            // Unknowns of the size of the forces.
            let scale = (self.stiffness / complement[(0, 0)].abs()).sqrt();
            let inverse = complement.try_inverse().ok_or(singular)? / (scale * scale);
            pressures.push(Pressures { scale, compliance: compliance * (scale * scale), inverse });
        }
        let ends = parts(&self.pattern, self.unknowns);
        let cycle = match &mut self.cycle {
            Some(cycle) => Some(cycle.factorize(&self.system.values)?),
            None => None,
        };
        let nodes = Auxiliary::share(self.ranks.as_deref(), self.unknowns / 3);
        let pieces = pieces(at.zones);
        let cycles = self.multilevel.as_mut().map(Multilevel::cycles).transpose()?;
        Ok(Box::new(Solved {
            pattern: &self.pattern,
            unknowns: self.unknowns,
            values: at.values,
            zones: at.zones,
            product: at.product,
            skew: at.skew,
            pressures,
            pieces,
            rows,
            stiffness,
            projector,
            values_at: self.values_at.as_ref(),
            ends,
            cycles: RefCell::new(cycles),
            cycle,
            ranks: &self.ranks,
            own: 3 * nodes.start..3 * nodes.end,
            left: Cell::new(1.0),
            last: &self.last,
            pace: &self.pace,
            largest: &self.largest,
            counts: &self.counts,
        }))
    }
}

/// Columns of about equal numbers of entries.
fn parts(pattern: &Pattern, unknowns: usize) -> Vec<usize> {
    let total = pattern.columns[unknowns];
    let mut ends: Vec<usize> =
        (0..=PARTS).map(|k| pattern.columns[..=unknowns].partition_point(|&c| c < total * k / PARTS)).collect();
    ends[PARTS] = unknowns;
    ends
}

/// Directions for a decade of the residual: of the first solution with the elements of a state, and of the last one.
#[derive(Clone, Copy, Default)]
struct Pace {
    first: Option<f64>,
    last: f64,
}

/// Zones that one thread at a time multiplies.
struct Piece {
    zones: std::ops::Range<usize>,
    /// The unknowns of their nodes.
    unknowns: std::ops::Range<usize>,
}

fn pieces(zones: &[Zone]) -> Vec<Piece> {
    let parts = PARTS.min(zones.len().max(1));
    let piece = |part| {
        let own = zones.len() * part / parts..zones.len() * (part + 1) / parts;
        let nodes = || zones[own.clone()].iter().flat_map(|zone| &zone.nodes).map(|&node| node as usize);
        let unknowns = nodes().min().map_or(0..0, |least| 3 * least..3 * (nodes().max().unwrap_or(least) + 1));
        Piece { zones: own, unknowns }
    };
    (0..parts).map(piece).collect()
}

/// Numbers of a zone, in unknowns of the size of the forces.
struct Pressures {
    scale: f64,
    compliance: Matrix4<f64>,
    inverse: Matrix4<f64>,
}

struct Solved<'a> {
    pattern: &'a Pattern,
    unknowns: usize,
    values: &'a [f64],
    zones: &'a [Zone],
    product: ZoneProduct<'a>,
    skew: &'a [(u32, u32, f64)],
    pressures: Vec<Pressures>,
    pieces: Vec<Piece>,
    /// Conditions with a largest entry of one, and what they are multiplied with in the matrix.
    rows: Vec<Vec<(u32, f64)>>,
    stiffness: f64,
    projector: Option<Box<dyn Factors + 'a>>,
    values_at: Option<&'a Interpolation>,
    /// Columns that one thread at a time multiplies.
    ends: Vec<usize>,
    cycles: RefCell<Option<Cycles<'a>>>,
    cycle: Option<Box<dyn Factors + 'a>>,
    ranks: &'a Option<Arc<dyn Ranks>>,
    /// The displacements that this rank keeps of vectors: all of them where it is alone.
    own: Range<usize>,
    /// What the last solution left.
    left: Cell<f64>,
    /// The last right-hand side.
    last: &'a Cell<f64>,
    pace: &'a Cell<Pace>,
    /// The largest right-hand side so far.
    largest: &'a Cell<f64>,
    counts: &'a Mutex<Vec<usize>>,
}

impl Solved<'_> {
    /// $y = K x + C^T q$ and $z = C x$, in scaled pressures.
    fn multiply(&self, x: &[f64], q: &[f64], y: &mut [f64], z: &mut [f64]) {
        self.symmetric(x, y);
        let Solved { zones: all, pressures, pieces, product: multiply, .. } = self;
        let done = map_with(pieces.len(), 2, Product::default, |product, piece| {
            let Piece { zones, unknowns } = &pieces[piece];
            let mut sums = vec![0.0; unknowns.len()];
            let mut volumes = Vec::with_capacity(4 * zones.len());
            for k in zones.clone() {
                let (zone, scale) = (&all[k], pressures[k].scale);
                multiply(zone, x, product);
                for (node, values) in zone.nodes.iter().zip(product.values.as_chunks::<3>().0) {
                    let target = &mut sums[3 * *node as usize - unknowns.start..][..3];
                    (0..3).for_each(|i| target[i] += values[i]);
                }
                let q = std::array::from_fn(|l| scale * q[4 * k + l]);
                if q.iter().any(|q| *q != 0.0) {
                    zone.scatter::<3>(&q, &mut sums, unknowns.start);
                }
                volumes.extend(zone.gather::<3>(x).map(|v| scale * v));
            }
            (sums, volumes)
        });
        let mut z = z;
        for (Piece { unknowns, .. }, (sums, volumes)) in self.pieces.iter().zip(done) {
            y[unknowns.clone()].iter_mut().zip(&sums).for_each(|(y, s)| *y += s);
            let own;
            (own, z) = z.split_at_mut(volumes.len());
            own.copy_from_slice(&volumes);
        }
        for &(row, column, value) in self.skew {
            y[row as usize] += value * x[column as usize];
            y[column as usize] -= value * x[row as usize];
        }
    }

    /// What is summed of the symmetric part.
    fn symmetric(&self, x: &[f64], y: &mut [f64]) {
        let Solved { unknowns: n, ends, pattern, values, .. } = self;
        let n = *n;
        let pieces = map_with(
            PARTS,
            2,
            || (),
            |(), part| {
                let (first, end) = (ends[part], ends[part + 1]);
                let last = (first..end)
                    .filter_map(|column| {
                        let rows = pattern.column(column);
                        rows[..rows.partition_point(|&row| (row as usize) < n)].last().copied()
                    })
                    .max();
                let mut sums = vec![0.0; last.map_or(0, |last| last as usize + 1 - first)];
                for column in first..end {
                    let from = pattern.columns[column];
                    let rows = pattern.column(column);
                    let factor = x[column];
                    let mut sum = values[from] * factor;
                    for (&row, value) in rows.iter().zip(&values[from..]).skip(1) {
                        let row = row as usize;
                        if row >= n {
                            break;
                        }
                        sum += value * x[row];
                        sums[row - first] += value * factor;
                    }
                    sums[column - first] += sum;
                }
                (first, sums)
            },
        );
        y.fill(0.0);
        for (first, sums) in pieces {
            y[first..first + sums.len()].iter_mut().zip(&sums).for_each(|(y, s)| *y += s);
        }
    }

    /// $G x$ of conditions with a largest entry of one.
    fn conditions(&self, x: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().map(|&(k, c)| c * x[k as usize]).sum()).collect()
    }

    /// $x \mathrel{+}= s\\,G^T \mu$.
    fn react(&self, mu: &[f64], s: f64, x: &mut [f64]) {
        for (row, mu) in self.rows.iter().zip(mu) {
            row.iter().for_each(|&(k, c)| x[k as usize] += s * c * mu);
        }
    }

    /// $(G G^T)^{-1} G x$.
    fn multipliers(&self, x: &[f64]) -> Result<Vec<f64>, LinearError> {
        let mut mu = self.conditions(x);
        if let Some(projector) = &self.projector {
            projector.solve_in_place(&mut mu)?;
        }
        Ok(mu)
    }

    /// $\Pi x$.
    fn project(&self, x: &mut [f64]) {
        if let Ok(mu) = self.multipliers(x) {
            self.react(&mu, -1.0, x);
        } else {
            x.fill(f64::NAN);
        }
    }

    /// $y \mathrel{+}= C^T q$ in scaled pressures.
    fn pressed(&self, q: &[f64], sign: f64, y: &mut [f64]) {
        for ((zone, own), q) in self.zones.iter().zip(&self.pressures).zip(q.as_chunks::<4>().0) {
            zone.scatter::<3>(&q.map(|q| sign * own.scale * q), y, 0);
        }
    }

    /// The sum of a number over the ranks.
    fn total(&self, mine: f64) -> f64 {
        let mut sum = [mine];
        total(self.ranks, &mut sum);
        sum[0]
    }

    /// The whole of a vector of which each rank has a part.
    fn gathered(&self, mine: &[f64]) -> Vec<f64> {
        let mut whole = vec![0.0; self.unknowns];
        whole[self.own.clone()].copy_from_slice(mine);
        total(self.ranks, &mut whole);
        whole
    }

    /// In place of $K^{-1}$.
    fn smooth(&self, x: &mut [f64]) {
        if let Some(values) = self.values_at {
            values.solve(true, x);
        }
        let failed = match &self.cycle {
            Some(cycle) => cycle.solve_in_place(x).is_err(),
            None => self.cycles.borrow_mut().as_mut().is_some_and(|cycles| cycles.cycle(x).is_err()),
        };
        if failed {
            x.fill(f64::NAN);
        }
        if let Some(values) = self.values_at {
            values.solve(false, x);
        }
    }
}

impl Factors for Solved<'_> {
    fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        self.solve_apart(rhs, &mut vec![[0.0; 4]; self.zones.len()])
    }

    fn solve_apart(&self, rhs: &mut [f64], pressures: &mut [[f64; 4]]) -> Result<(), LinearError> {
        let n = self.unknowns;
        let (force, gap) = rhs.split_at_mut(n);
        // A displacement that meets the conditions.
        let mut met = vec![0.0; n];
        if let Some(projector) = &self.projector {
            let mut mu: Vec<f64> = gap.iter().map(|g| g / self.stiffness).collect();
            projector.solve_in_place(&mut mu)?;
            self.react(&mu, 1.0, &mut met);
        }
        let own = self.own.clone();
        let size = own.len() + 4 * self.zones.len();
        let mut right = vec![0.0; size];
        {
            let (u, q) = right.split_at_mut(own.len());
            let mut whole = vec![0.0; n];
            if met.iter().any(|m| *m != 0.0) {
                self.multiply(&met, &vec![0.0; q.len()], &mut whole, q);
                total(self.ranks, &mut whole);
            }
            whole.iter_mut().zip(&*force).for_each(|(u, f)| *u = f - *u);
            self.project(&mut whole);
            u.copy_from_slice(&whole[own.clone()]);
            let wanted = pressures.iter().zip(&self.pressures).flat_map(|(g, own)| g.map(|g| own.scale * g));
            q.iter_mut().zip(wanted).for_each(|(q, wanted)| *q = wanted - *q);
        }
        let mut x = vec![0.0; size];
        let norm = self.total(dot(&right, &right)).sqrt();
        let largest = self.largest.get().max(norm);
        self.largest.set(largest);
        let rounding = norm <= ROUNDING * largest;
        let [least, most] = TOLERANCE;
        let reduced = norm / self.last.replace(norm);
        let tolerance = reduced.powi(2).max(ENOUGH * largest / norm).clamp(least, most);
        let done = gmres(
            &right,
            &mut x,
            (tolerance, rounding),
            DIRECTIONS,
            |x, y| {
                let ((mine, q), (y, z)) = (x.split_at(own.len()), y.split_at_mut(own.len()));
                let u = self.gathered(mine);
                let mut force = vec![0.0; n];
                self.multiply(&u, q, &mut force, z);
                total(self.ranks, &mut force);
                self.project(&mut force);
                y.copy_from_slice(&force[own.clone()]);
                let zones = self.pressures.iter().zip(q.as_chunks::<4>().0).zip(z.as_chunks_mut::<4>().0);
                for ((own, q), z) in zones {
                    let soft = own.compliance * nalgebra::Vector4::from(*q);
                    (0..4).for_each(|k| z[k] -= soft[k]);
                }
            },
            |x, y| {
                let ((u, q), (y, z)) = (x.split_at(own.len()), y.split_at_mut(own.len()));
                let zones = self.pressures.iter().zip(q.as_chunks::<4>().0).zip(z.as_chunks_mut::<4>().0);
                for ((own, q), z) in zones {
                    let answer = own.inverse * nalgebra::Vector4::from(*q);
                    (0..4).for_each(|k| z[k] = -answer[k]);
                }
                let mut force = vec![0.0; n];
                force[own.clone()].copy_from_slice(u);
                self.pressed(z, -1.0, &mut force);
                total(self.ranks, &mut force);
                self.project(&mut force);
                self.smooth(&mut force);
                self.project(&mut force);
                y.copy_from_slice(&force[own.clone()]);
            },
            |mine| self.total(mine),
        );
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).push(done.iterations);
        let pace = done.iterations as f64 / -done.residual.min(0.9).log10();
        if done.iterations > 0 {
            self.pace.set(Pace { first: self.pace.get().first.or(Some(pace)), last: pace });
        }
        // What is not quite solved is left to Newton's next iteration.
        let allowed = if rounding { 0.5 } else { most };
        self.left.set(done.residual);
        if !(done.residual <= allowed) {
            return Err(LinearError::Residual { residual: done.residual });
        }
        let (mine, q) = x.split_at(own.len());
        met.iter_mut().zip(&self.gathered(mine)).for_each(|(m, u)| *m += u);
        let mut left = vec![0.0; n];
        self.multiply(&met, q, &mut left, &mut vec![0.0; q.len()]);
        total(self.ranks, &mut left);
        for ((pressures, own), q) in pressures.iter_mut().zip(&self.pressures).zip(q.as_chunks::<4>().0) {
            *pressures = q.map(|q| own.scale * q);
        }
        left.iter_mut().zip(&*force).for_each(|(l, f)| *l = f - *l);
        let mu = self.multipliers(&left)?;
        gap.iter_mut().zip(mu).for_each(|(gap, mu)| *gap = mu / self.stiffness);
        force.copy_from_slice(&met);
        Ok(())
    }

    fn inertia(&self) -> Option<Inertia> {
        None
    }

    fn leaves(&self) -> f64 {
        self.left.get().max(f64::MIN_POSITIVE)
    }
}
