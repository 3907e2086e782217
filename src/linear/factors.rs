//! Solutions with factors by faer.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    IntranodeLbltRef, LdltRef, LltRef, SymbolicCholesky, supernodal::SupernodalIntranodeLbltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use crate::assembly::add_column;
use crate::each::Each;
use crate::error::LinearError;

use super::{Inertia, MatrixClass};

/// The lower triangle of what was factorised.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    pub columns: &'a [u32],
    pub rows: &'a [u32],
    pub values: &'a [f64],
}

/// Relative residual beyond which a solution is refused. A backward stable solution of a regular system
/// leaves about 1e-16 times its condition number; that of a singular one leaves 1 and more.
const RESIDUAL: f64 = 1e-2;

impl<'a> Matrix<'a> {
    /// As the library takes it.
    pub(crate) fn lower(self) -> SparseColMatRef<'a, u32, f64> {
        let n = self.columns.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, self.columns, None, self.rows);
        SparseColMatRef::new(pattern, self.values)
    }

    /// Whether a row can belong to a multiplier: its diagonal is zero, or negative where a solver of others smooths it.
    pub(crate) fn is_multiplier(&self, row: usize) -> bool {
        self.values[self.columns[row] as usize] <= 0.0
    }

    /// The number of such rows.
    pub(crate) fn multipliers(&self) -> usize {
        (1..self.columns.len()).filter(|row| self.is_multiplier(row - 1)).count()
    }

    /// Refuses a solution that is not finite or does not satisfy the equations; `rhs` becomes the residual.
    fn check(&self, solution: &[f64], rhs: &mut [f64]) -> Result<(), LinearError> {
        let norm = |v: &[f64]| v.summed(|x| x * x).sqrt();
        let size = norm(rhs);
        for ends in self.columns.windows(2) {
            let entries = ends[0] as usize..ends[1] as usize;
            add_column(&self.rows[entries.clone()], &self.values[entries], -1.0, solution, rhs);
        }
        let residual = norm(rhs);
        // The negation also refuses NaN.
        ensure!(residual <= RESIDUAL * size, LinearError::Residual { residual: residual / size });
        Ok(())
    }
}

/// Working memory of the library, as large as the largest request so far.
pub(super) struct Memory {
    buffer: MemBuffer,
    bytes: usize,
}

impl Default for Memory {
    fn default() -> Self {
        Memory { buffer: MemBuffer::new(StackReq::empty()), bytes: 0 }
    }
}

impl Memory {
    pub(crate) fn reserve(&mut self, request: StackReq) -> Result<&mut MemStack, LinearError> {
        let bytes = request.unaligned_bytes_required();
        if self.bytes < bytes {
            // The old buffer is given back before the new one is requested.
            *self = Memory::default();
            self.buffer = MemBuffer::try_new(request).map_err(|_| out_of_memory())?;
            self.bytes = bytes;
        }
        Ok(MemStack::new(&mut self.buffer))
    }
}

/// What a factorisation left.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// $LL^T$.
    Definite,
    /// $LDL^T$ without pivoting.
    Saddle,
    /// $LBL^T$ with pivoting inside supernodes.
    Pivoted,
}

/// A pattern with its symbolic factor, and the factors of the last matrix.
pub(super) struct Cholesky {
    pub columns: Vec<u32>,
    pub rows: Arc<Vec<u32>>,
    pub n: usize,
    pub symbolic: SymbolicCholesky<u32>,
    pub class: MatrixClass,
    /// Of which kind the factors are, once there are some.
    pub kind: Option<Kind>,
    pub values: Vec<f64>,
    pub subdiagonal: Vec<f64>,
    pub forward: Vec<u32>,
    pub inverse: Vec<u32>,
    pub memory: Memory,
    /// Whether a solution with them was found sound.
    pub checked: bool,
    pub given: Vec<f64>,
}

impl Cholesky {
    /// Solves in place with the factors of these values.
    pub(super) fn solve(&mut self, values: &[f64], rhs: &mut [f64]) -> Result<(), LinearError> {
        let Cholesky { columns, rows, n, symbolic, values: factors, subdiagonal, forward, inverse, .. } = self;
        let n = *n;
        let kind = self.kind.ok_or_else(|| LinearError::Library { what: "nothing was factorised".into() })?;
        check_length("right-hand side", rhs.len(), n)?;
        check_length("list of values", values.len(), rows.len())?;
        if !self.checked {
            self.given.clear();
            self.given.extend_from_slice(rhs);
        }
        let memory = self.memory.reserve(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))?;
        let x = MatMut::from_column_major_slice_mut(rhs, n, 1);
        match kind {
            Kind::Definite => {
                LltRef::<'_, u32, f64>::new(symbolic, factors).solve_in_place_with_conj(Conj::No, x, Par::Seq, memory);
            }
            Kind::Saddle => {
                LdltRef::<'_, u32, f64>::new(symbolic, factors).solve_in_place_with_conj(Conj::No, x, Par::Seq, memory);
            }
            Kind::Pivoted => {
                let order = PermRef::new_checked(forward, inverse, n);
                IntranodeLbltRef::<'_, u32, f64>::new(symbolic, factors, subdiagonal, order).solve_in_place_with_conj(
                    Conj::No,
                    x,
                    Par::Seq,
                    memory,
                );
            }
        }
        if !self.checked {
            Matrix { columns, rows, values }.check(rhs, &mut self.given)?;
            // A singular matrix shows in the first solution.
            self.checked = true;
        } else if rhs.iter().any(|x| !x.is_finite()) {
            return Err(LinearError::Residual { residual: f64::NAN });
        }
        Ok(())
    }
}

/// Signs of the pivots of $B$, blocks of one or two rows.
pub(super) fn signs(factor: SupernodalIntranodeLbltRef<'_, u32, f64>, subdiagonal: &[f64]) -> Inertia {
    let mut inertia = Inertia { positive: 0, negative: 0 };
    for s in 0..factor.symbolic().n_supernodes() {
        let supernode = factor.supernode(s);
        let block = supernode.val();
        let mut k = 0;
        while k < block.ncols() {
            let off = subdiagonal[supernode.start() + k];
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
    inertia
}

pub(super) fn check_length(what: &'static str, given: usize, needed: usize) -> Result<(), LinearError> {
    if given == needed { Ok(()) } else { Err(LinearError::Length { what, given, needed }) }
}

pub(super) fn out_of_memory() -> LinearError {
    LinearError::Library { what: "out of memory".into() }
}
