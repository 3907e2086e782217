//! Algebraic multigrid of PETSc: one cycle inside the crate's Krylov iteration.

use std::ffi::{CStr, c_int};
use std::ptr;
use std::sync::Arc;

use rkpm::assembly::{Pattern, Ranks};
use rkpm::error::LinearError;
use rkpm::geometry::Point;
use rkpm::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};

use crate::error::PetscError;
use crate::ffi::{self, PetscInt};
use crate::session::{Session, check};
use crate::solver::{Objects, Spread, add, allocate, check_length, check_values, index, not_analysed, spread};

/// Components of a node.
const BLOCK: usize = 3;

/// What stands before the names of PETSc's options.
const PREFIX: &CStr = c"rkpm_";
/// Options unless they are set by the user.
///
/// Aggregates of one or two nodes leave empty columns: smoothing by diagonals and shifted factors of the coarsest level bear
/// them, sweeps of Gauss and Seidel do not.
const OPTIONS: [(&CStr, &CStr); 7] = [
    (c"-rkpm_pc_type", c"gamg"),
    (c"-rkpm_pc_gamg_agg_nsmooths", c"1"),
    (c"-rkpm_pc_gamg_threshold", c"0.0"),
    (c"-rkpm_mg_levels_ksp_type", c"chebyshev"),
    (c"-rkpm_mg_levels_ksp_max_it", c"4"),
    (c"-rkpm_mg_levels_pc_type", c"jacobi"),
    (c"-rkpm_mg_coarse_sub_pc_factor_shift_type", c"nonzero"),
];

/// Krylov iteration for nearly incompressible bodies on lattices in space, on all ranks of a session: the iteration of
/// [`rkpm::linear::Krylov`], whose stiffness of elements is solved about by a cycle of PETSc's algebraic multigrid (GAMG) with
/// rigid motions as its near null space.
///
/// PETSc's options change the cycle, with the prefix `rkpm_`: `PETSC_OPTIONS="-rkpm_pc_type hypre"`.
#[derive(Debug, Clone)]
pub struct Gamg {
    session: Session,
}

impl Gamg {
    /// The solver of a session.
    pub fn new(session: &Session) -> Self {
        Gamg { session: session.clone() }
    }
}

/// What is said where it is to solve by itself.
fn solves_about() -> LinearError {
    LinearError::Library { what: "GAMG solves about: hand it to a scheme, which iterates with it".into() }
}

impl LinearSolver for Gamg {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(self.clone())
    }

    fn analyze(&mut self, _: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
        Err(solves_about())
    }

    fn factorize(&mut self, _: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        Err(solves_about())
    }

    fn solve(&mut self, _: &LinearSystem<'_>, _: &mut [f64], _: Option<&mut [[f64; 4]]>) -> Result<f64, LinearError> {
        Err(solves_about())
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        Some(Arc::new(self.session.clone()))
    }

    fn preconditioner(&self, nodes: &[Point<3>]) -> Option<Box<dyn LinearSolver>> {
        Some(Box::new(Cycle { session: self.session.clone(), nodes: nodes.into(), levels: None }))
    }
}

/// One cycle over given nodes.
struct Cycle {
    session: Session,
    nodes: Arc<[Point<3>]>,
    /// Once a pattern is analysed.
    levels: Option<Levels>,
}

impl LinearSolver for Cycle {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Cycle { session: self.session.clone(), nodes: self.nodes.clone(), levels: None })
    }

    fn analyze(&mut self, pattern: &Pattern, _: MatrixClass, order: Option<&[usize]>) -> Result<(), LinearError> {
        self.session.at_home().map_err(LinearError::from)?;
        pattern.validate()?;
        check_length("unknowns of the nodes", pattern.size(), BLOCK * self.nodes.len())?;
        let natural: Vec<usize> = (0..pattern.size()).collect();
        self.levels = Some(Levels::new(&self.session, pattern, order.unwrap_or(&natural), &self.nodes)?);
        Ok(())
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        let levels = self.levels.as_mut().ok_or_else(not_analysed)?;
        check_values(&self.session, &levels.pattern, system.values)?;
        levels.numeric(system.values)?;
        Ok(None)
    }

    fn solve(&mut self, _: &LinearSystem<'_>, rhs: &mut [f64], _: Option<&mut [[f64; 4]]>) -> Result<f64, LinearError> {
        let Levels { pattern, number, objects, range, .. } = self.levels.as_ref().ok_or_else(not_analysed)?;
        check_length("right-hand side", rhs.len(), pattern.size())?;
        let mut numbered = vec![0.0; rhs.len()];
        rhs.iter().zip(number).for_each(|(value, &place)| numbered[place as usize] = *value);
        objects.solve(*range, &mut numbered)?;
        rhs.iter_mut().zip(number).for_each(|(value, &place)| *value = numbered[place as usize]);
        Ok(0.0)
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        Some(Arc::new(self.session.clone()))
    }
}

/// The matrix of a pattern with its levels.
struct Levels {
    session: Session,
    pattern: Pattern,
    /// PETSc's number of each unknown.
    number: Vec<PetscInt>,
    objects: Objects,
    range: [usize; 2],
}

impl Levels {
    fn new(session: &Session, pattern: &Pattern, order: &[usize], nodes: &[Point<3>]) -> Result<Self, PetscError> {
        let size = index("unknowns", pattern.size())?;
        index("entries of one rank", 2 * pattern.entries())?;
        let mut number = vec![0; order.len()];
        for (place, &unknown) in order.iter().enumerate() {
            number[unknown] = place as PetscInt;
        }
        let (rank, count) = (session.rank(), session.count());
        let mine = BLOCK * (nodes.len() * (rank + 1) / count - nodes.len() * rank / count);
        let local = index("unknowns", mine)?;
        let mut objects = Objects::empty(session);
        objects.matrix = spread(c"aij", local, size, BLOCK)?;
        let range = objects.vectors(local, size, BLOCK)?;
        allocate(objects.matrix, Spread { pattern, number: Some(&number) }, (local, size, BLOCK))?;
        // SAFETY: objects are created before they are used; PETSc copies what it is given.
        unsafe {
            // Rigid motions by the positions, which stand in the vector for a moment.
            let mut array = ptr::null_mut();
            check("VecGetArray", ffi::VecGetArray(objects.rhs, &mut array))?;
            for place in range[0]..range[1] {
                *array.add(place - range[0]) = nodes[order[place] / BLOCK][order[place] % BLOCK];
            }
            check("VecRestoreArray", ffi::VecRestoreArray(objects.rhs, &mut array))?;
            let mut motions = ptr::null_mut();
            check("MatNullSpaceCreateRigidBody", ffi::MatNullSpaceCreateRigidBody(objects.rhs, &mut motions))?;
            let set = check("MatSetNearNullSpace", ffi::MatSetNearNullSpace(objects.matrix, motions));
            ffi::MatNullSpaceDestroy(&mut motions);
            set?;
            for (name, value) in OPTIONS {
                let mut given = 0;
                let (list, prefix) = (ptr::null_mut(), ptr::null());
                check("PetscOptionsHasName", ffi::PetscOptionsHasName(list, prefix, name.as_ptr(), &mut given))?;
                if given == 0 {
                    check("PetscOptionsSetValue", ffi::PetscOptionsSetValue(list, name.as_ptr(), value.as_ptr()))?;
                }
            }
        }
        Ok(Levels { session: session.clone(), pattern: pattern.clone(), number, objects, range })
    }

    fn numeric(&mut self, values: &[f64]) -> Result<(), PetscError> {
        self.session.at_home()?;
        let mut reason: c_int = 0;
        let mut pc = ptr::null_mut();
        let matrix = self.objects.matrix;
        // SAFETY: the objects live as long as `self`.
        unsafe {
            check("MatZeroEntries", ffi::MatZeroEntries(matrix))?;
            add(matrix, Spread { pattern: &self.pattern, number: Some(&self.number) }, Some(values))?;
            // Afresh each time: a run that is resumed has the same bits as one that was never broken off.
            check("KSPDestroy", ffi::KSPDestroy(&mut self.objects.ksp))?;
            check("KSPCreate", ffi::KSPCreate(ffi::PETSC_COMM_WORLD, &mut self.objects.ksp))?;
            let ksp = self.objects.ksp;
            check("KSPSetType", ffi::KSPSetType(ksp, c"preonly".as_ptr()))?;
            check("KSPSetOptionsPrefix", ffi::KSPSetOptionsPrefix(ksp, PREFIX.as_ptr()))?;
            check("KSPSetOperators", ffi::KSPSetOperators(ksp, matrix, matrix))?;
            check("KSPSetFromOptions", ffi::KSPSetFromOptions(ksp))?;
            check("KSPSetUp", ffi::KSPSetUp(ksp))?;
            check("KSPGetPC", ffi::KSPGetPC(ksp, &mut pc))?;
            check("PCGetFailedReason", ffi::PCGetFailedReason(pc, &mut reason))?;
        }
        check("setting up of multigrid", reason)
    }
}
