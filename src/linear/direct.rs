//! faer's sparse Cholesky family behind the traits of this crate; the only file that names faer.

use std::cell::RefCell;
use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SupernodalIntranodeLbltRef,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::assembly::{Pattern, add_column, release};
use crate::error::LinearError;

use super::{Factorizer, Factors, Inertia, LinearSolver, MatrixClass};

/// Sparse direct solution: Cholesky where the matrix is definite, Bunch–Kaufman ($LBL^T$ with pivoting
/// inside supernodes) where it is not.
///
/// Factors are computed on one thread: those of $LBL^T$ and solves with many threads were not bit-equal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Direct;

/// Entries that 32-bit indices can address.
const ENTRY_LIMIT: usize = i32::MAX as usize;

impl LinearSolver for Direct {
    fn analyze(
        &self,
        pattern: &Pattern,
        class: MatrixClass,
        order: Option<&[usize]>,
    ) -> Result<Box<dyn Factorizer>, LinearError> {
        if pattern.entries() > ENTRY_LIMIT {
            return Err(LinearError::Size {
                what: "matrix entries",
                size: pattern.entries(),
                limit: ENTRY_LIMIT,
                remedy: "take fewer particles or a smaller dilation",
            });
        }
        pattern.validate()?;
        let n = pattern.size();
        let columns: Vec<u32> = pattern.columns.iter().map(|&c| c as u32).collect();
        let saddle = match class {
            MatrixClass::Definite => 0,
            MatrixClass::Saddle { constraints } => constraints.min(n),
        };
        let own = match order {
            Some(_) => Vec::new(),
            None => minimum_degree(pattern, n - saddle)?,
        };
        let symbolic = symbolic(pattern, &columns, order.unwrap_or(&own))?;
        Ok(Box::new(CholeskyFactorizer {
            columns,
            rows: Arc::clone(&pattern.rows),
            n,
            symbolic,
            definite: saddle == 0,
            values: Vec::new(),
            subdiagonal: Vec::new(),
            forward: Vec::new(),
            inverse: Vec::new(),
            memory: Memory { buffer: MemBuffer::new(StackReq::empty()), bytes: 0 },
            given: Vec::new(),
        }))
    }
}

fn out_of_memory() -> LinearError {
    LinearError::Library { what: "out of memory".into() }
}

/// An elimination order by approximate minimum degree among the first `count` unknowns of a pattern; the others,
/// multipliers, stay last: further forward their pivots would be zero.
///
/// # Errors
/// Where the pattern is malformed or memory runs out.
pub fn minimum_degree(pattern: &Pattern, count: usize) -> Result<Vec<usize>, LinearError> {
    pattern.validate()?;
    let count = count.min(pattern.size());
    let mut columns = vec![0u32];
    let mut rows = Vec::with_capacity(pattern.entries());
    for column in 0..count {
        rows.extend(pattern.column(column).iter().copied().filter(|&row| (row as usize) < count));
        columns.push(rows.len() as u32);
    }
    let lower = SymbolicSparseColMatRef::new_checked(count, count, &columns, None, &rows);
    let (mut forward, mut inverse) = (vec![0u32; count], vec![0u32; count]);
    let request = amd::order_scratch::<u32>(count, rows.len());
    let mut memory = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
    amd::order(&mut forward, &mut inverse, lower, amd::Control::default(), MemStack::new(&mut memory))
        .map_err(|e| LinearError::Library { what: format!("{e:?}") })?;
    Ok(forward.into_iter().map(|old| old as usize).chain(count..pattern.size()).collect())
}

/// The symbolic factor, always by supernodes: rows of hundreds of entries make even small ones faster than single
/// columns, and on single columns $LBL^T$ silently becomes $LDL^T$ without pivoting.
fn symbolic(pattern: &Pattern, columns: &[u32], order: &[usize]) -> Result<SymbolicCholesky<u32>, LinearError> {
    let n = pattern.size();
    if order.len() != n {
        return Err(LinearError::Library { what: format!("an order of {} unknowns for a matrix of {n}", order.len()) });
    }
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let failed = |e| LinearError::Library { what: format!("{e:?}") };
    if order.iter().copied().eq(0..n) {
        // Without a permutation the numeric phase reads the matrix where it is. The symbolic one then takes any
        // pattern for an upper triangle, and gets the transpose.
        let (columns, rows) = transposed(pattern);
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &columns, None, &rows);
        return factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params).map_err(failed);
    }
    let mut inverse = vec![u32::MAX; n];
    for (new, &old) in order.iter().enumerate() {
        if old >= n || inverse[old] != u32::MAX {
            return Err(LinearError::Library { what: "the elimination order is no permutation".into() });
        }
        inverse[old] = new as u32;
    }
    let forward: Vec<u32> = order.iter().map(|&old| old as u32).collect();
    let lower = SymbolicSparseColMatRef::new_checked(n, n, columns, None, &pattern.rows);
    let ordering = SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n));
    factorize_symbolic_cholesky(lower, Side::Lower, ordering, params).map_err(failed)
}

/// Columns and rows of the upper triangle.
fn transposed(pattern: &Pattern) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.size();
    let mut columns = vec![0u32; n + 1];
    for &row in pattern.rows.iter() {
        columns[row as usize + 1] += 1;
    }
    for k in 0..n {
        columns[k + 1] += columns[k];
    }
    let mut next = columns.clone();
    let mut rows = vec![0u32; pattern.entries()];
    for column in 0..n {
        for &row in pattern.column(column) {
            rows[next[row as usize] as usize] = column as u32;
            next[row as usize] += 1;
        }
    }
    (columns, rows)
}

struct CholeskyFactorizer {
    columns: Vec<u32>,
    rows: Arc<Vec<u32>>,
    n: usize,
    symbolic: SymbolicCholesky<u32>,
    /// Whether Cholesky is tried first.
    definite: bool,
    values: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    memory: Memory,
    given: Vec<f64>,
}

/// Working memory of the library, as large as the largest request so far.
struct Memory {
    buffer: MemBuffer,
    bytes: usize,
}

impl Memory {
    fn reserve(&mut self, request: StackReq) -> Result<&mut MemStack, LinearError> {
        let bytes = request.unaligned_bytes_required();
        if self.bytes < bytes {
            // The old buffer is given back before the new one is asked for.
            self.buffer = MemBuffer::new(StackReq::empty());
            self.buffer = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
            self.bytes = bytes;
        }
        Ok(MemStack::new(&mut self.buffer))
    }
}

impl Factorizer for CholeskyFactorizer {
    fn factorize<'a>(&'a mut self, values: &'a [f64]) -> Result<Box<dyn Factors + 'a>, LinearError> {
        check_length("list of values", values.len(), self.rows.len())?;
        if let Some(place) = values.iter().position(|v| !v.is_finite()) {
            return Err(LinearError::Pivot { pivot: place, hint: "the matrix has entries that are not finite" });
        }
        let definite = self.definite && self.cholesky(values)?;
        if !definite {
            self.bunch_kaufman(values)?;
        }
        let solution = RefCell::new(Solution {
            symbolic: &self.symbolic,
            values: &self.values,
            matrix: Matrix { columns: &self.columns, rows: &self.rows, values },
            checked: false,
            given: &mut self.given,
            memory: &mut self.memory,
        });
        if definite {
            return Ok(Box::new(Definite(solution)));
        }
        Ok(Box::new(Indefinite {
            solution,
            subdiagonal: &self.subdiagonal,
            forward: &self.forward,
            inverse: &self.inverse,
        }))
    }

    fn release(&mut self) {
        release(&mut self.values);
        if self.values.capacity() == 0 {
            self.memory = Memory { buffer: MemBuffer::new(StackReq::empty()), bytes: 0 };
        }
    }

    fn bytes(&self) -> Option<usize> {
        Some(size_of::<f64>() * self.symbolic.len_val())
    }
}

impl CholeskyFactorizer {
    /// $LBL^T$ with pivoting inside supernodes.
    fn bunch_kaufman(&mut self, values: &[f64]) -> Result<(), LinearError> {
        let pattern = SymbolicSparseColMatRef::new_checked(self.n, self.n, &self.columns, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, values);
        self.values.clear();
        self.values.resize(self.symbolic.len_val(), 0.0);
        self.subdiagonal.clear();
        self.subdiagonal.resize(self.n, 0.0);
        self.forward.resize(self.n, 0);
        self.inverse.resize(self.n, 0);
        let request = self.symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default());
        let memory = self.memory.reserve(request)?;
        self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut self.subdiagonal,
            &mut self.forward,
            &mut self.inverse,
            matrix,
            Side::Lower,
            Par::Seq,
            memory,
            Spec::default(),
        );
        if self.values.iter().any(|v| !v.is_finite()) {
            return Err(LinearError::Pivot {
                pivot: 0,
                hint: "a pivot is zero: a rigid motion is left free, or conditions depend on each other",
            });
        }
        Ok(())
    }

    /// Tries $LL^T$; `false` where the matrix is not positive definite.
    fn cholesky(&mut self, values: &[f64]) -> Result<bool, LinearError> {
        let pattern = SymbolicSparseColMatRef::new_checked(self.n, self.n, &self.columns, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, values);
        self.values.clear();
        self.values.resize(self.symbolic.len_val(), 0.0);
        let request = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let memory = self.memory.reserve(request)?;
        let result = self.symbolic.factorize_numeric_llt(
            &mut self.values,
            matrix,
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            memory,
            Spec::default(),
        );
        Ok(result.is_ok())
    }
}

/// The lower triangle of what was factorised.
#[derive(Clone, Copy)]
struct Matrix<'a> {
    columns: &'a [u32],
    rows: &'a [u32],
    values: &'a [f64],
}

/// Relative residual beyond which a solution is refused. A backward stable solution of a regular system
/// leaves about 1e-16 times its condition number; that of a singular one leaves 1 and more.
const RESIDUAL: f64 = 1e-2;

impl Matrix<'_> {
    /// Refuses a solution that is not finite or does not satisfy the equations; `rhs` becomes the residual.
    fn check(&self, solution: &[f64], rhs: &mut [f64]) -> Result<(), LinearError> {
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = norm(rhs);
        for ends in self.columns.windows(2) {
            let entries = ends[0] as usize..ends[1] as usize;
            add_column(&self.rows[entries.clone()], &self.values[entries], -1.0, solution, rhs);
        }
        let residual = norm(rhs);
        // The negation also refuses NaN.
        if !(residual <= RESIDUAL * size) {
            return Err(LinearError::Residual { residual: residual / size });
        }
        Ok(())
    }
}

/// What solutions need besides the factors: the matrix, and buffers that outlive a solve.
struct Solution<'a> {
    symbolic: &'a SymbolicCholesky<u32>,
    values: &'a [f64],
    matrix: Matrix<'a>,
    /// Whether a solution was found sound: a singular matrix shows in the first one.
    checked: bool,
    given: &'a mut Vec<f64>,
    memory: &'a mut Memory,
}

impl Solution<'_> {
    fn solve(
        &mut self,
        rhs: &mut [f64],
        substitute: impl FnOnce(&SymbolicCholesky<u32>, &[f64], MatMut<'_, f64>, &mut MemStack),
    ) -> Result<(), LinearError> {
        let n = rhs.len();
        if !self.checked {
            self.given.clear();
            self.given.extend_from_slice(rhs);
        }
        let memory = self.memory.reserve(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))?;
        substitute(self.symbolic, self.values, MatMut::from_column_major_slice_mut(rhs, n, 1), memory);
        if !self.checked {
            self.matrix.check(rhs, self.given)?;
            self.checked = true;
        } else if rhs.iter().any(|x| !x.is_finite()) {
            return Err(LinearError::Residual { residual: f64::NAN });
        }
        Ok(())
    }
}

struct Definite<'a>(RefCell<Solution<'a>>);

struct Indefinite<'a> {
    solution: RefCell<Solution<'a>>,
    subdiagonal: &'a [f64],
    forward: &'a [u32],
    inverse: &'a [u32],
}

fn check_length(what: &'static str, given: usize, needed: usize) -> Result<(), LinearError> {
    if given == needed { Ok(()) } else { Err(LinearError::Length { what, given, needed }) }
}

impl Factors for Definite<'_> {
    fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        check_length("right-hand side", rhs.len(), self.0.borrow().symbolic.nrows())?;
        self.0.borrow_mut().solve(rhs, |symbolic, values, rhs, memory| {
            LltRef::<'_, u32, f64>::new(symbolic, values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, memory);
        })
    }

    fn inertia(&self) -> Option<Inertia> {
        Some(Inertia { positive: self.0.borrow().symbolic.nrows(), negative: 0 })
    }
}

impl Factors for Indefinite<'_> {
    fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        let n = rhs.len();
        check_length("right-hand side", n, self.solution.borrow().symbolic.nrows())?;
        let order = PermRef::new_checked(self.forward, self.inverse, n);
        self.solution.borrow_mut().solve(rhs, |symbolic, values, rhs, memory| {
            IntranodeLbltRef::<'_, u32, f64>::new(symbolic, values, self.subdiagonal, order).solve_in_place_with_conj(
                Conj::No,
                rhs,
                Par::Seq,
                memory,
            );
        })
    }

    fn inertia(&self) -> Option<Inertia> {
        let Solution { symbolic, values, .. } = &*self.solution.borrow();
        let SymbolicCholeskyRaw::Supernodal(symbolic) = symbolic.raw() else { return None };
        let factor = SupernodalIntranodeLbltRef::<'_, u32, f64>::new(
            symbolic,
            values,
            self.subdiagonal,
            PermRef::new_checked(self.forward, self.inverse, symbolic.nrows()),
        );
        let mut inertia = Inertia { positive: 0, negative: 0 };
        for s in 0..symbolic.n_supernodes() {
            let supernode = factor.supernode(s);
            let block = supernode.val();
            let mut k = 0;
            while k < block.ncols() {
                let off = self.subdiagonal[supernode.start() + k];
                if off != 0.0 && k + 1 < block.ncols() {
                    // A 2×2 pivot: the determinant tells one of each sign from two of the trace's sign.
                    let (a, c) = (block[(k, k)], block[(k + 1, k + 1)]);
                    if a * c - off * off < 0.0 {
                        inertia.positive += 1;
                        inertia.negative += 1;
                    } else if a + c > 0.0 {
                        inertia.positive += 2;
                    } else {
                        inertia.negative += 2;
                    }
                    k += 2;
                } else {
                    if block[(k, k)] > 0.0 {
                        inertia.positive += 1;
                    } else {
                        inertia.negative += 1;
                    }
                    k += 1;
                }
            }
        }
        Some(inertia)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::nested_dissection;

    /// A path graph's Laplacian plus `shift` on the diagonal, as lower pattern and values.
    fn chain(n: usize, shift: f64) -> (Pattern, Vec<f64>) {
        let pattern =
            Pattern::from_columns((0..n).map(|c| if c + 1 < n { vec![c as u32 + 1] } else { vec![] }).collect());
        let mut values = Vec::new();
        for c in 0..n {
            values.push(2.0 + shift);
            if c + 1 < n {
                values.push(-1.0);
            }
        }
        (pattern, values)
    }

    #[test]
    fn definite_and_indefinite_matrices_are_solved_and_counted() {
        let n = 200;
        for (shift, order) in [(0.0, false), (0.1, true), (-0.5, false), (-1.7, true)] {
            let (pattern, values) = chain(n, shift);
            let order = order.then(|| nested_dissection(&pattern, n, |i| [i as f64]));
            let mut solver = Direct.analyze(&pattern, MatrixClass::Definite, order.as_deref()).unwrap();
            let factors = solver.factorize(&values).unwrap();
            // Eigenvalues of the chain: 2 + shift − 2 cos(π k/(n+1)).
            let negative = (1..=n)
                .filter(|&k| 2.0 + shift - 2.0 * (std::f64::consts::PI * k as f64 / (n + 1) as f64).cos() < 0.0)
                .count();
            assert_eq!(factors.inertia().unwrap(), Inertia { positive: n - negative, negative });
            let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let mut x = b.clone();
            factors.solve_in_place(&mut x).unwrap();
            let mut product = vec![0.0; n];
            pattern.multiply_add(&values, &x, &mut product);
            for i in 0..n {
                assert!((product[i] - b[i]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let pattern = Pattern::from_columns(vec![vec![1], vec![]]);
        let mut solver = Direct.analyze(&pattern, MatrixClass::Definite, None).unwrap();
        let singular = match solver.factorize(&[0.0, 0.0, 0.0]) {
            Err(_) => true,
            Ok(factors) => factors.solve_in_place(&mut [1.0, 1.0]).is_err(),
        };
        assert!(singular);
        assert!(solver.factorize(&[f64::NAN, 0.0, 1.0]).is_err());
    }
}
