//! faer's sparse Cholesky family behind the trait of this crate; only this file and the next name faer.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
    supernodal::{SupernodalIntranodeLbltRef, SupernodalLdltRef},
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::{Par, Side, Spec};

use crate::assembly::{Pattern, release};
use crate::each::{Each, sum_of};
use crate::error::LinearError;
use crate::rows::Rows;

use super::factors::{Cholesky, Kind, Matrix, Memory, check_length, out_of_memory, signs};
use super::{Inertia, LinearSolver, LinearSystem, MatrixClass};

/// Sparse direct solution: Cholesky where the matrix is definite, $LDL^T$ without pivoting for saddle points of stable
/// states, Bunch–Kaufman ($LBL^T$ with pivoting inside supernodes) for all others, which are found out by trying.
///
/// Factors are computed on one thread: those of $LBL^T$ and solves with many threads were not bit-equal.
#[derive(Default)]
pub struct Direct(Option<Box<Cholesky>>);

/// Entries that 32-bit indices can address.
const ENTRY_LIMIT: usize = i32::MAX as usize;

impl LinearSolver for Direct {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Direct::default())
    }

    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<(), LinearError> {
        self.0 = Some(Box::new(Cholesky::new(pattern, class, order)?));
        Ok(())
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        self.analyzed()?.factorize(system.values)
    }

    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        _: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError> {
        self.analyzed()?.solve(system.values, rhs).map(|()| 0.0)
    }

    fn release(&mut self) {
        if let Some(cholesky) = &mut self.0 {
            cholesky.kind = None;
            release(&mut cholesky.values);
            if cholesky.values.capacity() == 0 {
                cholesky.memory = Memory::default();
            }
        }
    }

    fn bytes(&self) -> Option<usize> {
        self.0.as_ref().map(|cholesky| size_of::<f64>() * cholesky.symbolic.len_val())
    }
}

impl Direct {
    /// One that has analysed a pattern.
    pub(crate) fn of(pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<Self, LinearError> {
        let mut direct = Direct::default();
        direct.analyze(pattern, class, order)?;
        Ok(direct)
    }

    fn analyzed(&mut self) -> Result<&mut Cholesky, LinearError> {
        self.0.as_deref_mut().ok_or_else(|| LinearError::Library { what: "no pattern was analysed".into() })
    }
}

/// An elimination order by approximate minimum degree among the first `count` unknowns of a pattern; the others,
/// multipliers, stay last.
///
/// # Errors
/// Where the pattern is malformed or memory runs out.
pub(crate) fn minimum_degree(pattern: &Pattern, count: usize) -> Result<Vec<usize>, LinearError> {
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

/// Multiplications that the factors of a pattern take, its unknowns eliminated in an order.
///
/// # Errors
/// Where memory runs out.
pub(crate) fn multiplications(pattern: &Pattern, order: &[usize]) -> Result<f64, LinearError> {
    let columns: Vec<u32> = pattern.columns.mapped(|&c| c as u32);
    let symbolic = symbolic(pattern, &columns, order)?;
    let SymbolicCholeskyRaw::Supernodal(factor) = symbolic.raw() else { return Ok(0.0) };
    let of_block = |block: usize| {
        let own = (factor.supernode_end()[block] - factor.supernode_begin()[block]) as f64;
        let below = factor.supernode(block).pattern().len() as f64;
        // Its triangle, what stands below it, and what that takes from the blocks after it.
        own * (own * own / 6.0 + own * below / 2.0 + below * below / 2.0)
    };
    Ok(sum_of(factor.n_supernodes(), of_block))
}

/// The symbolic factor, always by supernodes: rows of hundreds of entries make even small ones faster than single
/// columns, and on single columns $LBL^T$ silently becomes $LDL^T$ without pivoting.
fn symbolic(pattern: &Pattern, columns: &[u32], order: &[usize]) -> Result<SymbolicCholesky<u32>, LinearError> {
    let n = pattern.size();
    ensure!(
        order.len() == n,
        LinearError::Library { what: format!("an order of {} unknowns for a matrix of {n}", order.len()) }
    );
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let failed = |e| LinearError::Library { what: format!("{e:?}") };
    if order.iter().copied().eq(0..n) {
        // Without a permutation the numeric phase reads the matrix where it is. The symbolic one then takes any
        // pattern for an upper triangle, and gets the transpose.
        let transposed = Rows::new(n, &|add| {
            for column in 0..n {
                pattern.column(column).iter().for_each(|&row| add(row as usize, column as u32));
            }
        });
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &transposed.starts, None, &transposed.entries);
        return factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params).map_err(failed);
    }
    let mut inverse = vec![u32::MAX; n];
    for (new, &old) in order.iter().enumerate() {
        if old >= n || inverse[old] != u32::MAX {
            return Err(LinearError::Library { what: "the elimination order is no permutation".into() });
        }
        inverse[old] = new as u32;
    }
    let forward: Vec<u32> = order.mapped(|&old| old as u32);
    let lower = SymbolicSparseColMatRef::new_checked(n, n, columns, None, &pattern.rows);
    let ordering = SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n));
    factorize_symbolic_cholesky(lower, Side::Lower, ordering, params).map_err(failed)
}

impl Cholesky {
    fn new(pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<Self, LinearError> {
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
        let columns: Vec<u32> = pattern.columns.mapped(|&c| c as u32);
        let saddle = class.constraints().min(n);
        let own = match order {
            Some(_) => Vec::new(),
            None => minimum_degree(pattern, n - saddle)?,
        };
        let symbolic = symbolic(pattern, &columns, order.unwrap_or(&own))?;
        Ok(Cholesky {
            columns,
            rows: Arc::clone(&pattern.rows),
            n,
            symbolic,
            class,
            kind: None,
            values: Vec::new(),
            subdiagonal: Vec::new(),
            forward: Vec::new(),
            inverse: Vec::new(),
            memory: Memory::default(),
            checked: false,
            given: Vec::new(),
        })
    }

    fn factorize(&mut self, values: &[f64]) -> Result<Option<Inertia>, LinearError> {
        (self.kind, self.checked) = (None, false);
        check_length("list of values", values.len(), self.rows.len())?;
        if let Some(place) = values.iter().position(|v| !v.is_finite()) {
            return Err(LinearError::Pivot { pivot: place, hint: "the matrix has entries that are not finite" });
        }
        // What the factors held before is overwritten.
        self.values.resize(self.symbolic.len_val(), 0.0);
        let class = self.class;
        let (kind, inertia) = match class {
            MatrixClass::Definite if self.cholesky(values)? => {
                (Kind::Definite, Some(Inertia { positive: self.n, negative: 0 }))
            }
            MatrixClass::Saddle { constraints } if self.without_pivoting(values, constraints)? => {
                (Kind::Saddle, Some(Inertia { positive: self.n - constraints, negative: constraints }))
            }
            _ => (Kind::Pivoted, self.bunch_kaufman(values)?),
        };
        self.kind = Some(kind);
        Ok(inertia)
    }

    fn matrix<'a>(&'a self, values: &'a [f64]) -> Matrix<'a> {
        Matrix { columns: &self.columns, rows: &self.rows, values }
    }

    /// $LBL^T$ with pivoting inside supernodes; the signs of its pivots.
    fn bunch_kaufman(&mut self, values: &[f64]) -> Result<Option<Inertia>, LinearError> {
        let matrix = Matrix { columns: &self.columns, rows: &self.rows, values }.lower();
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
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return Ok(None) };
        let order = PermRef::new_checked(&self.forward, &self.inverse, self.n);
        let factor = SupernodalIntranodeLbltRef::new(symbolic, &self.values, &self.subdiagonal, order);
        Ok(Some(signs(factor, &self.subdiagonal)))
    }

    /// Tries $LDL^T$ without pivoting; `false` where pivots are not negative for multipliers and positive for all others.
    ///
    /// With each multiplier after the unknowns of its row the factors of stable saddle points exist and don't grow: they are
    /// as accurate as those with pivoting, whose working memory is an eighth of the factors in space.
    fn without_pivoting(&mut self, values: &[f64], constraints: usize) -> Result<bool, LinearError> {
        // Other rows without a positive diagonal need pivoting.
        if self.matrix(values).multipliers() != constraints {
            return Ok(false);
        }
        let matrix = Matrix { columns: &self.columns, rows: &self.rows, values }.lower();
        let request = self.symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Spec::default());
        let memory = self.memory.reserve(request)?;
        let result = self.symbolic.factorize_numeric_ldlt(
            &mut self.values,
            matrix,
            Side::Lower,
            LdltRegularization::default(),
            Par::Seq,
            memory,
            Spec::default(),
        );
        let (Ok(_), SymbolicCholeskyRaw::Supernodal(symbolic)) = (result, self.symbolic.raw()) else {
            return Ok(false);
        };
        let factor = SupernodalLdltRef::<'_, u32, f64>::new(symbolic, &self.values);
        let order = self.symbolic.perm().map(|perm| perm.arrays().0);
        let matrix = self.matrix(values);
        for s in 0..symbolic.n_supernodes() {
            let supernode = factor.supernode(s);
            let block = supernode.val();
            for k in 0..block.ncols() {
                let new = supernode.start() + k;
                let old = order.map_or(new, |order| order[new] as usize);
                let pivot = if matrix.is_multiplier(old) { -block[(k, k)] } else { block[(k, k)] };
                if !(pivot > 0.0) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Tries $LL^T$; `false` where the matrix is not positive definite.
    fn cholesky(&mut self, values: &[f64]) -> Result<bool, LinearError> {
        let matrix = Matrix { columns: &self.columns, rows: &self.rows, values }.lower();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{after_their_rows, nested_dissection};
    use approx::assert_abs_diff_eq;

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
            let order = order.then(|| nested_dissection(&pattern, n, 1, &|i, _| i as f64));
            let mut solver = Direct::of(&pattern, MatrixClass::Definite, order.as_deref()).unwrap();
            let system = LinearSystem::of(&values);
            let inertia = solver.factorize(&system).unwrap();
            // Eigenvalues of the chain: 2 + shift − 2 cos(π k/(n+1)).
            let negative = (1..=n)
                .filter(|&k| 2.0 + shift - 2.0 * (std::f64::consts::PI * k as f64 / (n + 1) as f64).cos() < 0.0)
                .count();
            assert_eq!(inertia.unwrap(), Inertia { positive: n - negative, negative });
            let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let mut x = b.clone();
            solver.solve(&system, &mut x, None).unwrap();
            let mut product = vec![0.0; n];
            pattern.multiply_add(&values, &x, &mut product);
            for i in 0..n {
                assert_abs_diff_eq!(product[i], b[i], epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn multiplications_of_factors_are_counted() {
        // Of a dense matrix n³/6, of a chain two for each unknown, or those of the blocks of 16 that it is padded to.
        let n = 60;
        let dense = Pattern::from_columns((0..n).map(|c| (c as u32..n as u32).collect()).collect());
        let order: Vec<usize> = (0..n).collect();
        let found = multiplications(&dense, &order).unwrap() / (n as f64).powi(3);
        assert_abs_diff_eq!(found, 1.0 / 6.0, epsilon = 1e-12);
        let few = multiplications(&chain(1000, 0.0).0, &(0..1000).collect::<Vec<_>>()).unwrap();
        assert!((1000.0..1000.0 * 16.0 * 16.0).contains(&few), "{few}");
    }

    #[test]
    fn saddle_points_are_solved_and_counted_stable_or_not() {
        let (n, constraints) = (60, 5);
        let (chain, _) = chain(n, 0.0);
        let mut columns: Vec<Vec<u32>> = (0..n).map(|c| chain.column(c).to_vec()).collect();
        for c in 0..constraints {
            for unknown in [10 * c, 10 * c + 2] {
                columns[unknown].push((n + c) as u32);
            }
        }
        columns.resize(n + constraints, Vec::new());
        let pattern = Pattern::from_columns(columns);
        let order = after_their_rows(&pattern, &nested_dissection(&pattern, n, 1, &|i, _| i as f64));
        let class = MatrixClass::Saddle { constraints };
        let mut given = Direct::of(&pattern, class, Some(&order)).unwrap();
        let mut own = Direct::of(&pattern, class, None).unwrap();
        // Stable, unstable, and stable again with the same factoriser.
        for shift in [0.0, -0.3, -1.1, 0.2] {
            let value = |row: usize, column: usize| match (row < n, row == column) {
                (true, true) => 2.0 + shift,
                (true, false) => -1.0,
                (false, true) => 0.0,
                (false, false) => 1.0 + column as f64 / n as f64,
            };
            let size = n + constraints;
            let values: Vec<f64> = (0..size)
                .flat_map(|column| pattern.column(column).iter().map(move |&row| (row as usize, column)))
                .map(|(row, column)| value(row, column))
                .collect();
            let mut dense = nalgebra::DMatrix::zeros(size, size);
            for column in 0..size {
                for entry in pattern.columns[column]..pattern.columns[column + 1] {
                    let row = pattern.rows[entry] as usize;
                    dense[(row, column)] = values[entry];
                    dense[(column, row)] = values[entry];
                }
            }
            let negative = dense.symmetric_eigenvalues().iter().filter(|&&e| e < 0.0).count();
            assert_eq!(negative > constraints, shift < 0.0);
            for solver in [&mut given, &mut own] {
                let system = LinearSystem::of(&values);
                let inertia = solver.factorize(&system).unwrap();
                assert_eq!(inertia.unwrap(), Inertia { positive: size - negative, negative });
                let b: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
                let mut x = b.clone();
                solver.solve(&system, &mut x, None).unwrap();
                let mut product = vec![0.0; size];
                pattern.multiply_add(&values, &x, &mut product);
                let error = product.iter().zip(&b).map(|(p, b)| (p - b).abs()).fold(0.0, f64::max);
                let scale = x.iter().map(|x| x.abs()).fold(1.0, f64::max);
                assert!(error < 1e-12 * scale, "{shift}: {error:e} at {scale:e}");
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let pattern = Pattern::from_columns(vec![vec![1], vec![]]);
        let mut solver = Direct::of(&pattern, MatrixClass::Definite, None).unwrap();
        let zeros = LinearSystem::of(&[0.0, 0.0, 0.0]);
        assert!(solver.factorize(&zeros).is_err() || solver.solve(&zeros, &mut [1.0, 1.0], None).is_err());
        assert!(solver.factorize(&LinearSystem::of(&[f64::NAN, 0.0, 1.0])).is_err());
        // Nothing to solve with.
        assert!(solver.solve(&zeros, &mut [1.0, 1.0], None).is_err());
        assert!(Direct::default().factorize(&zeros).is_err());
    }
}
