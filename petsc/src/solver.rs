//! MUMPS behind the trait of `rkpm::linear`.

use std::ffi::{CStr, c_int};
use std::ptr;
use std::sync::Arc;

use rkpm::assembly::{Pattern, Ranks};
use rkpm::error::LinearError;
use rkpm::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};

use crate::error::PetscError;
use crate::ffi::{self, PetscInt};
use crate::session::{Reduction, Session, check};

/// The entry of MUMPS' list of results that counts negative pivots.
const NEGATIVE_PIVOTS: PetscInt = 12;

/// The setting of MUMPS for working memory beyond its estimate, in percent: pivoting needs what it can't foresee.
const MORE_MEMORY: PetscInt = 14;
/// Percentages that are tried in turn.
const PERCENT: [PetscInt; 5] = [35, 100, 200, 400, 800];
/// The reason of a failed factorisation that more memory mends.
const OUT_OF_MEMORY: c_int = 3;

/// What a solution with numbers that are none is.
pub(crate) const NOT_FINITE: LinearError = LinearError::Residual { residual: f64::NAN };

/// Relative residual of a solution with a matrix that is singular to working precision: MUMPS divides by what rounding leaves.
const SINGULAR: f64 = 1e-2;

/// Sparse direct solution by MUMPS, on all ranks of a session: $LDL^T$ with pivoting, whose signs tell stability.
///
/// Each rank gives the pattern and the values that it has summed itself, over the unknowns of the whole system; entries
/// that several ranks give are added up. Right-hand sides and solutions are whole on every rank.
#[derive(Debug)]
pub struct Mumps {
    session: Session,
    /// Once a pattern is analysed.
    factors: Option<Factors>,
}

impl Mumps {
    /// The solver of a session.
    pub fn new(session: &Session) -> Self {
        Mumps { session: session.clone(), factors: None }
    }
}

impl LinearSolver for Mumps {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Mumps::new(&self.session))
    }

    fn analyze(&mut self, pattern: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
        self.session.at_home().map_err(LinearError::from)?;
        pattern.validate()?;
        self.factors = Some(Factors::new(&self.session, pattern)?);
        Ok(())
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        let factors = self.factors.as_mut().ok_or_else(not_analysed)?;
        check_values(&self.session, &factors.pattern, system.values)?;
        factors.numeric(system.values)?;
        let negative = factors.negative;
        Ok(Some(Inertia { positive: factors.pattern.size() - negative, negative }))
    }

    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        _: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError> {
        let Factors { session, pattern, objects, range, .. } = self.factors.as_ref().ok_or_else(not_analysed)?;
        check_length("right-hand side", rhs.len(), pattern.size())?;
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let given = rhs.to_vec();
        objects.solve(*range, rhs)?;
        let mut product = vec![0.0; rhs.len()];
        pattern.multiply_add(system.values, rhs, &mut product);
        session.reduce(Reduction::Sum, &mut product)?;
        product.iter_mut().zip(&given).for_each(|(p, b)| *p -= b);
        let (residual, size) = (norm(&product), norm(&given));
        if residual <= SINGULAR * size { Ok(0.0) } else { Err(LinearError::Residual { residual: residual / size }) }
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        Some(Arc::new(self.session.clone()))
    }
}

/// What a solver without a pattern says.
pub(crate) fn not_analysed() -> LinearError {
    LinearError::Library { what: "no pattern was analysed".into() }
}

/// Matrix, vectors and factors of one pattern.
#[derive(Debug)]
struct Factors {
    session: Session,
    /// What this rank sums of the matrix.
    pattern: Pattern,
    objects: Objects,
    /// The unknowns that this rank holds.
    range: [usize; 2],
    negative: usize,
    /// Working memory beyond MUMPS' estimate that was enough so far, in percent.
    percent: PetscInt,
}

/// PETSc's objects, destroyed together.
#[derive(Debug)]
pub(crate) struct Objects {
    pub matrix: ffi::Mat,
    pub rhs: ffi::Vec_,
    pub solution: ffi::Vec_,
    pub whole: ffi::Vec_,
    pub scatter: ffi::VecScatter,
    pub ksp: ffi::KSP,
    session: Session,
}

impl Objects {
    /// None of them yet; what others have left is destroyed.
    pub fn empty(session: &Session) -> Self {
        session.clear();
        Objects {
            matrix: ptr::null_mut(),
            rhs: ptr::null_mut(),
            solution: ptr::null_mut(),
            whole: ptr::null_mut(),
            scatter: ptr::null_mut(),
            ksp: ptr::null_mut(),
            session: session.clone(),
        }
    }

    /// Makes vectors of blocks, `local` of `size` numbers on this rank; the range of these.
    pub fn vectors(&mut self, local: PetscInt, size: PetscInt, block: usize) -> Result<[usize; 2], PetscError> {
        let (mut first, mut end) = (0, 0);
        // SAFETY: vectors are created before they are used.
        unsafe {
            for vector in [&mut self.rhs, &mut self.solution] {
                check("VecCreateMPI", ffi::VecCreateMPI(ffi::PETSC_COMM_WORLD, local, size, vector))?;
                check("VecSetBlockSize", ffi::VecSetBlockSize(*vector, block as PetscInt))?;
            }
            check("VecGetOwnershipRange", ffi::VecGetOwnershipRange(self.rhs, &mut first, &mut end))?;
            let made = ffi::VecScatterCreateToAll(self.solution, &mut self.scatter, &mut self.whole);
            check("VecScatterCreateToAll", made)?;
        }
        Ok([first as usize, end as usize])
    }

    /// Solves for a right-hand side that is whole on every rank; so is the solution.
    pub fn solve(&self, [first, end]: [usize; 2], values: &mut [f64]) -> Result<(), PetscError> {
        self.session.at_home()?;
        let mut array = ptr::null_mut();
        // SAFETY: this rank's part of the vector is `end - first` long, the gathered one as long as the system.
        unsafe {
            check("VecGetArray", ffi::VecGetArray(self.rhs, &mut array))?;
            if end > first {
                std::slice::from_raw_parts_mut(array, end - first).copy_from_slice(&values[first..end]);
            }
            check("VecRestoreArray", ffi::VecRestoreArray(self.rhs, &mut array))?;
            check("KSPSolve", ffi::KSPSolve(self.ksp, self.rhs, self.solution))?;
            let mut reason: c_int = 0;
            check("KSPGetConvergedReason", ffi::KSPGetConvergedReason(self.ksp, &mut reason))?;
            check("solution", if reason < 0 { reason } else { 0 })?;
            for half in [ffi::VecScatterBegin, ffi::VecScatterEnd] {
                let done = half(self.scatter, self.solution, self.whole, ffi::INSERT_VALUES, ffi::SCATTER_FORWARD);
                check("VecScatter", done)?;
            }
            check("VecGetArray", ffi::VecGetArray(self.whole, &mut array))?;
            if !values.is_empty() {
                values.copy_from_slice(std::slice::from_raw_parts(array, values.len()));
            }
            check("VecRestoreArray", ffi::VecRestoreArray(self.whole, &mut array))
        }
    }
}

// SAFETY: every use of the pointers first makes sure that it runs on the thread that started the library.
unsafe impl Send for Objects {}
// SAFETY: as above.
unsafe impl Sync for Objects {}

impl Drop for Objects {
    fn drop(&mut self) {
        // To destroy them takes all ranks, and this one may be leaving alone, with an error.
        self.session.leave(Remains {
            matrix: self.matrix,
            vectors: [self.rhs, self.solution, self.whole],
            scatter: self.scatter,
            ksp: self.ksp,
        });
    }
}

/// Objects that nobody uses any more, until all ranks meet again.
#[derive(Debug)]
pub(crate) struct Remains {
    matrix: ffi::Mat,
    vectors: [ffi::Vec_; 3],
    scatter: ffi::VecScatter,
    ksp: ffi::KSP,
}

// SAFETY: the pointers are used on the thread that started the library alone.
unsafe impl Send for Remains {}

impl Remains {
    /// Destroys them, on all ranks alike and on the thread that started the library.
    pub fn destroy(mut self) {
        // SAFETY: created by PETSc, destroyed once; null pointers are left alone by it.
        unsafe {
            ffi::KSPDestroy(&mut self.ksp);
            ffi::VecScatterDestroy(&mut self.scatter);
            self.vectors.iter_mut().for_each(|vector| {
                ffi::VecDestroy(vector);
            });
            ffi::MatDestroy(&mut self.matrix);
        }
    }
}

/// A number of unknowns or entries as PETSc counts them.
pub(crate) fn index(what: &'static str, size: usize) -> Result<PetscInt, PetscError> {
    let remedy = "take fewer particles, or a PETSc with 64-bit indices";
    PetscInt::try_from(size).map_err(|_| PetscError::Size { what, size, remedy })
}

/// A square matrix of a kind and of blocks, spread over the ranks.
pub(crate) fn spread(kind: &CStr, local: PetscInt, size: PetscInt, block: usize) -> Result<ffi::Mat, PetscError> {
    let mut matrix = ptr::null_mut();
    // SAFETY: the matrix is created before it is used.
    unsafe {
        check("MatCreate", ffi::MatCreate(ffi::PETSC_COMM_WORLD, &mut matrix))?;
        check("MatSetSizes", ffi::MatSetSizes(matrix, local, local, size, size))?;
        check("MatSetBlockSize", ffi::MatSetBlockSize(matrix, block as PetscInt))?;
        check("MatSetType", ffi::MatSetType(matrix, kind.as_ptr()))?;
    }
    Ok(matrix)
}

/// The matrix of a pattern on PETSc's side.
#[derive(Clone, Copy)]
pub(crate) struct Spread<'a> {
    pub pattern: &'a Pattern,
    /// PETSc's number of each unknown, where that is another one. Matrices with numbers of their own keep both triangles, others the upper
    /// one alone.
    pub number: Option<&'a [PetscInt]>,
}

/// Adds values column by column: the columns of the lower triangle that is given are the rows of the upper one.
pub(crate) fn add(matrix: ffi::Mat, spread: Spread<'_>, values: Option<&[f64]>) -> Result<(), PetscError> {
    let Spread { pattern: Pattern { columns, rows, .. }, number } = spread;
    let of = |unknown: usize| number.map_or(unknown as PetscInt, |number| number[unknown]);
    let longest = columns.windows(2).map(|ends| ends[1] - ends[0]).max().unwrap_or(0);
    let (mut targets, zeros) = (Vec::<PetscInt>::new(), vec![0.0; longest]);
    for (column, ends) in columns.windows(2).enumerate() {
        targets.clear();
        targets.extend(rows[ends[0]..ends[1]].iter().map(|&row| of(row as usize)));
        let given = values.map_or(&zeros[..targets.len()], |values| &values[ends[0]..ends[1]]);
        let (own, count) = (of(column), targets.len() as PetscInt);
        // SAFETY: indices and values are as long as said and below the size of the matrix (Pattern::validate).
        check("MatSetValues", unsafe {
            ffi::MatSetValues(matrix, 1, &own, count, targets.as_ptr(), given.as_ptr(), ffi::ADD_VALUES)
        })?;
        // The diagonal is the first of a column.
        if let (Some(_), Some(below), Some(given)) = (number, targets.get(1..), given.get(1..)) {
            let rows = below.len() as PetscInt;
            // SAFETY: as above.
            check("MatSetValues", unsafe {
                ffi::MatSetValues(matrix, rows, below.as_ptr(), 1, &own, given.as_ptr(), ffi::ADD_VALUES)
            })?;
        }
    }
    // SAFETY: the matrix is there.
    unsafe {
        check("MatAssemblyBegin", ffi::MatAssemblyBegin(matrix, ffi::MAT_FINAL_ASSEMBLY))?;
        check("MatAssemblyEnd", ffi::MatAssemblyEnd(matrix, ffi::MAT_FINAL_ASSEMBLY))
    }
}

/// Gives a matrix room for the pattern of all ranks together, counted by one that holds none.
pub(crate) fn allocate(
    matrix: ffi::Mat,
    given: Spread<'_>,
    (local, size, block): (PetscInt, PetscInt, usize),
) -> Result<(), PetscError> {
    let mut counter = spread(c"preallocator", local, size, block)?;
    // SAFETY: both matrices are there; the counter is destroyed whatever comes of it.
    unsafe {
        let counted =
            check("MatSetUp", ffi::MatSetUp(counter)).and_then(|()| add(counter, given, None)).and_then(|()| {
                let filled = ffi::MatPreallocatorPreallocate(counter, ffi::PETSC_TRUE, matrix);
                check("MatPreallocatorPreallocate", filled)
            });
        ffi::MatDestroy(&mut counter);
        counted
    }
}

/// Makes what holds the factors of a matrix.
///
/// # Safety
/// The matrix is there.
unsafe fn create(ksp: &mut ffi::KSP, matrix: ffi::Mat) -> Result<(), PetscError> {
    let mut pc = ptr::null_mut();
    // SAFETY: created before it is used.
    unsafe {
        check("KSPCreate", ffi::KSPCreate(ffi::PETSC_COMM_WORLD, ksp))?;
        check("KSPSetType", ffi::KSPSetType(*ksp, c"preonly".as_ptr()))?;
        check("KSPSetOperators", ffi::KSPSetOperators(*ksp, matrix, matrix))?;
        check("KSPGetPC", ffi::KSPGetPC(*ksp, &mut pc))?;
        check("PCSetType", ffi::PCSetType(pc, c"cholesky".as_ptr()))?;
        check("PCFactorSetMatSolverType", ffi::PCFactorSetMatSolverType(pc, c"mumps".as_ptr()))
    }
}

impl Factors {
    fn new(session: &Session, pattern: &Pattern) -> Result<Self, PetscError> {
        let size = index("unknowns", pattern.size())?;
        index("entries of one rank", pattern.entries())?;
        let mut objects = Objects::empty(session);
        objects.matrix = spread(c"sbaij", ffi::PETSC_DECIDE, size, 1)?;
        let range = objects.vectors(ffi::PETSC_DECIDE, size, 1)?;
        allocate(objects.matrix, Spread { pattern, number: None }, (ffi::PETSC_DECIDE, size, 1))?;
        // SAFETY: the matrix is there.
        unsafe { create(&mut objects.ksp, objects.matrix)? };
        Ok(Factors {
            session: session.clone(),
            pattern: pattern.clone(),
            objects,
            range,
            negative: 0,
            percent: PERCENT[0],
        })
    }

    fn numeric(&mut self, values: &[f64]) -> Result<(), PetscError> {
        self.session.at_home()?;
        let (mut pc, mut factor, mut negative) = (ptr::null_mut(), ptr::null_mut(), 0);
        // SAFETY: the objects live as long as `self`.
        unsafe {
            check("MatZeroEntries", ffi::MatZeroEntries(self.objects.matrix))?;
            add(self.objects.matrix, Spread { pattern: &self.pattern, number: None }, Some(values))?;
            let mut reason: c_int = 0;
            let enough = self.percent;
            for percent in PERCENT.into_iter().filter(|&percent| percent >= enough) {
                let Objects { ksp, matrix, .. } = &mut self.objects;
                if percent > self.percent {
                    // The analysis counts the memory: after a failure it begins anew.
                    check("KSPDestroy", ffi::KSPDestroy(ksp))?;
                    create(ksp, *matrix)?;
                    self.percent = percent;
                }
                check("KSPGetPC", ffi::KSPGetPC(*ksp, &mut pc))?;
                check("KSPSetOperators", ffi::KSPSetOperators(*ksp, *matrix, *matrix))?;
                check("PCFactorSetUpMatSolverType", ffi::PCFactorSetUpMatSolverType(pc))?;
                check("PCFactorGetMatrix", ffi::PCFactorGetMatrix(pc, &mut factor))?;
                check("MatMumpsSetIcntl", ffi::MatMumpsSetIcntl(factor, MORE_MEMORY, percent))?;
                check("KSPSetUp", ffi::KSPSetUp(*ksp))?;
                check("PCGetFailedReason", ffi::PCGetFailedReason(pc, &mut reason))?;
                if reason != OUT_OF_MEMORY {
                    break;
                }
            }
            if reason != 0 {
                let mut code = [0; 2];
                check("MatMumpsGetInfog", ffi::MatMumpsGetInfog(factor, 1, &mut code[0]))?;
                check("MatMumpsGetInfog", ffi::MatMumpsGetInfog(factor, 2, &mut code[1]))?;
                return Err(PetscError::Factors { code });
            }
            check("MatMumpsGetInfog", ffi::MatMumpsGetInfog(factor, NEGATIVE_PIVOTS, &mut negative))?;
        }
        self.negative = negative as usize;
        Ok(())
    }
}

pub(crate) fn check_length(what: &'static str, given: usize, needed: usize) -> Result<(), LinearError> {
    if given == needed { Ok(()) } else { Err(LinearError::Length { what, given, needed }) }
}

/// Refuses values of another pattern, and numbers that are none: those of one rank are all ranks' error.
pub(crate) fn check_values(session: &Session, pattern: &Pattern, values: &[f64]) -> Result<(), LinearError> {
    check_length("list of values", values.len(), pattern.entries())?;
    let mut wrong = [f64::from(u8::from(values.iter().any(|v| !v.is_finite())))];
    session.reduce(Reduction::Largest, &mut wrong)?;
    if wrong[0] > 0.0 { Err(NOT_FINITE) } else { Ok(()) }
}
