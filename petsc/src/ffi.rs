//! The functions of PETSc and MPI that this crate calls, as their headers declare them (PETSc 3.18, Open MPI 4).

#![allow(non_camel_case_types, non_upper_case_globals, missing_docs, clippy::upper_case_acronyms)]

use std::ffi::{c_char, c_int, c_void};

/// A communicator of Open MPI, which is a pointer.
pub type MPI_Comm = *mut c_void;
pub type PetscErrorCode = c_int;
pub type PetscInt = c_int;
pub type Vec_ = *mut c_void;
pub type Mat = *mut c_void;
pub type KSP = *mut c_void;
pub type PC = *mut c_void;
pub type MatNullSpace = *mut c_void;
pub type VecScatter = *mut c_void;

pub type ErrorHandler = unsafe extern "C" fn(
    MPI_Comm,
    c_int,
    *const c_char,
    *const c_char,
    PetscErrorCode,
    c_int,
    *const c_char,
    *mut c_void,
) -> PetscErrorCode;

pub const PETSC_DECIDE: PetscInt = -1;
pub const PETSC_TRUE: c_int = 1;
pub const INSERT_VALUES: c_int = 1;
pub const ADD_VALUES: c_int = 2;
pub const SCATTER_FORWARD: c_int = 0;
pub const MAT_FINAL_ASSEMBLY: c_int = 0;

unsafe extern "C" {
    pub static PETSC_COMM_WORLD: MPI_Comm;
    // Open MPI's objects behind MPI_DOUBLE, MPI_SUM and MPI_MAX.
    pub static ompi_mpi_double: u8;
    pub static ompi_mpi_op_sum: u8;
    pub static ompi_mpi_op_max: u8;

    pub fn MPI_Comm_rank(comm: MPI_Comm, rank: *mut c_int) -> c_int;
    pub fn MPI_Comm_size(comm: MPI_Comm, size: *mut c_int) -> c_int;
    pub fn MPI_Reduce(
        send: *const c_void,
        receive: *mut c_void,
        count: c_int,
        datatype: *const u8,
        op: *const u8,
        root: c_int,
        comm: MPI_Comm,
    ) -> c_int;
    pub fn MPI_Bcast(buffer: *mut c_void, count: c_int, datatype: *const u8, root: c_int, comm: MPI_Comm) -> c_int;
    pub fn MPI_Abort(comm: MPI_Comm, code: c_int) -> c_int;

    pub fn PetscInitializeNoArguments() -> PetscErrorCode;
    pub fn PetscFinalize() -> PetscErrorCode;
    pub fn PetscErrorMessage(code: c_int, text: *mut *const c_char, specific: *mut *mut c_char) -> PetscErrorCode;
    pub fn PetscPushErrorHandler(handler: ErrorHandler, context: *mut c_void) -> PetscErrorCode;
    pub fn PetscReturnErrorHandler(
        comm: MPI_Comm,
        line: c_int,
        function: *const c_char,
        file: *const c_char,
        code: PetscErrorCode,
        kind: c_int,
        text: *const c_char,
        context: *mut c_void,
    ) -> PetscErrorCode;

    pub fn PetscOptionsHasName(
        options: *mut c_void,
        prefix: *const c_char,
        name: *const c_char,
        set: *mut c_int,
    ) -> PetscErrorCode;
    pub fn PetscOptionsSetValue(options: *mut c_void, name: *const c_char, value: *const c_char) -> PetscErrorCode;

    pub fn VecCreateMPI(comm: MPI_Comm, local: PetscInt, global: PetscInt, vector: *mut Vec_) -> PetscErrorCode;
    pub fn VecSetBlockSize(vector: Vec_, size: PetscInt) -> PetscErrorCode;
    pub fn VecGetOwnershipRange(vector: Vec_, first: *mut PetscInt, end: *mut PetscInt) -> PetscErrorCode;
    pub fn VecGetArray(vector: Vec_, values: *mut *mut f64) -> PetscErrorCode;
    pub fn VecRestoreArray(vector: Vec_, values: *mut *mut f64) -> PetscErrorCode;
    pub fn VecDestroy(vector: *mut Vec_) -> PetscErrorCode;
    pub fn VecScatterCreateToAll(vector: Vec_, scatter: *mut VecScatter, whole: *mut Vec_) -> PetscErrorCode;
    pub fn VecScatterBegin(s: VecScatter, from: Vec_, to: Vec_, mode: c_int, direction: c_int) -> PetscErrorCode;
    pub fn VecScatterEnd(s: VecScatter, from: Vec_, to: Vec_, mode: c_int, direction: c_int) -> PetscErrorCode;
    pub fn VecScatterDestroy(scatter: *mut VecScatter) -> PetscErrorCode;

    pub fn MatCreate(comm: MPI_Comm, matrix: *mut Mat) -> PetscErrorCode;
    pub fn MatSetSizes(
        m: Mat,
        rows: PetscInt,
        columns: PetscInt,
        all_rows: PetscInt,
        all_columns: PetscInt,
    ) -> PetscErrorCode;
    pub fn MatSetType(matrix: Mat, kind: *const c_char) -> PetscErrorCode;
    pub fn MatSetUp(matrix: Mat) -> PetscErrorCode;
    pub fn MatPreallocatorPreallocate(preallocator: Mat, fill: c_int, matrix: Mat) -> PetscErrorCode;
    pub fn MatZeroEntries(matrix: Mat) -> PetscErrorCode;
    pub fn MatSetValues(
        matrix: Mat,
        rows: PetscInt,
        row: *const PetscInt,
        columns: PetscInt,
        column: *const PetscInt,
        values: *const f64,
        mode: c_int,
    ) -> PetscErrorCode;
    pub fn MatAssemblyBegin(matrix: Mat, kind: c_int) -> PetscErrorCode;
    pub fn MatAssemblyEnd(matrix: Mat, kind: c_int) -> PetscErrorCode;
    pub fn MatDestroy(matrix: *mut Mat) -> PetscErrorCode;
    pub fn MatMumpsSetIcntl(factor: Mat, entry: PetscInt, value: PetscInt) -> PetscErrorCode;
    pub fn MatMumpsGetInfog(factor: Mat, entry: PetscInt, value: *mut PetscInt) -> PetscErrorCode;

    pub fn MatSetBlockSize(matrix: Mat, size: PetscInt) -> PetscErrorCode;
    pub fn MatSetNearNullSpace(matrix: Mat, space: MatNullSpace) -> PetscErrorCode;
    pub fn MatNullSpaceCreateRigidBody(positions: Vec_, space: *mut MatNullSpace) -> PetscErrorCode;
    pub fn MatNullSpaceDestroy(space: *mut MatNullSpace) -> PetscErrorCode;

    pub fn KSPCreate(comm: MPI_Comm, ksp: *mut KSP) -> PetscErrorCode;
    pub fn KSPSetType(ksp: KSP, kind: *const c_char) -> PetscErrorCode;
    pub fn KSPSetOperators(ksp: KSP, matrix: Mat, preconditioner: Mat) -> PetscErrorCode;
    pub fn KSPSetOptionsPrefix(ksp: KSP, prefix: *const c_char) -> PetscErrorCode;
    pub fn KSPSetFromOptions(ksp: KSP) -> PetscErrorCode;
    pub fn KSPSetUp(ksp: KSP) -> PetscErrorCode;
    pub fn KSPSolve(ksp: KSP, rhs: Vec_, solution: Vec_) -> PetscErrorCode;
    pub fn KSPGetConvergedReason(ksp: KSP, reason: *mut c_int) -> PetscErrorCode;
    pub fn KSPGetPC(ksp: KSP, pc: *mut PC) -> PetscErrorCode;
    pub fn KSPDestroy(ksp: *mut KSP) -> PetscErrorCode;
    pub fn PCSetType(pc: PC, kind: *const c_char) -> PetscErrorCode;
    pub fn PCFactorSetMatSolverType(pc: PC, kind: *const c_char) -> PetscErrorCode;
    pub fn PCFactorSetUpMatSolverType(pc: PC) -> PetscErrorCode;
    pub fn PCFactorGetMatrix(pc: PC, factor: *mut Mat) -> PetscErrorCode;
    pub fn PCGetFailedReason(pc: PC, reason: *mut c_int) -> PetscErrorCode;
}
