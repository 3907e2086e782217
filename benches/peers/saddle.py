"""Newton's method of dolfinx for a displacement and a pressure in one vector, by MUMPS."""

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc


class Newton:
    """Of compiled forms of a residual and its derivative; matrices are allocated here, before anything is timed."""

    def __init__(self, z, residual, tangent, conditions):
        self.z, self.residual, self.tangent, self.conditions = z, residual, tangent, conditions
        self.matrix, self.vector = fem.petsc.create_matrix(tangent), fem.petsc.create_vector(residual)
        self.step = self.vector.duplicate()

    def forces(self):
        """The residual at the current state, without conditions."""
        with self.vector.localForm() as local:
            local.set(0)
        fem.petsc.assemble_vector(self.vector, self.residual)
        return self.vector.array

    def solve(self, most):
        """Iterates from the current state; the number of iterations, or none where it fails."""
        solver = PETSc.KSP().create(MPI.COMM_SELF)
        solver.setOperators(self.matrix)
        solver.setType("preonly")
        solver.getPC().setType("lu")
        solver.getPC().setFactorSolverType("mumps")
        x = self.z.x.array
        for iteration in range(1, most + 1):
            self.forces()
            self.matrix.zeroEntries()
            fem.petsc.assemble_matrix(self.matrix, self.tangent, self.conditions)
            self.matrix.assemble()
            fem.petsc.apply_lifting(self.vector, [self.tangent], [self.conditions], x0=[self.z.vector], scale=-1.0)
            fem.petsc.set_bc(self.vector, self.conditions, self.z.vector, -1.0)
            solver.solve(self.vector, self.step)
            x -= self.step.array
            if not np.all(np.isfinite(x)):
                return None
            if np.linalg.norm(self.step.array) <= 1e-8 * np.linalg.norm(x):
                return iteration
        return None
