"""dolfinx, Q2/Q1 hexahedra on the sheared bonded cube, by MUMPS and by GMRES with blocks.

Usage: peer_dolfinx_cube.py REFERENCES TABLE [CELLS ...]
Seconds are those of the solve alone: forms are compiled and matrices allocated before.
"""

import csv
import sys

import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc

import common

OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native", "-ffast-math"]}


class Cube:
    """The cube [0, 10]^3 mm, its top moved aside by 3 mm, with `n` elements a side."""

    def __init__(self, n, iterative):
        corners = [np.zeros(3), np.full(3, 10.0)]
        domain = mesh.create_box(MPI.COMM_SELF, corners, [n] * 3, mesh.CellType.hexahedron)
        cell = domain.ufl_cell()
        element = ufl.MixedElement(ufl.VectorElement("Lagrange", cell, 2), ufl.FiniteElement("Lagrange", cell, 1))
        space = fem.FunctionSpace(domain, element)
        self.z = fem.Function(space)
        u, p = ufl.split(self.z)
        f = ufl.Identity(3) + ufl.grad(u)
        j = ufl.det(f)
        w = 40.097 * (j ** (-2 / 3) * ufl.tr(f.T * f) - 3)
        bulk = 400889.8
        dx = ufl.dx(domain=domain, metadata={"quadrature_degree": 4})
        self.energy = fem.form((w + p**2 / (2 * bulk)) * dx, jit_params=OPTIONS)
        potential = (w + p * (j - 1) - p**2 / (2 * bulk)) * dx
        residual = ufl.derivative(potential, self.z, ufl.TestFunction(space))
        self.residual = fem.form(residual, jit_params=OPTIONS)
        self.tangent = fem.form(ufl.derivative(residual, self.z), jit_params=OPTIONS)
        self.conditions, self.top, self.moved = [], {}, None
        for i in range(3):
            sub = space.sub(0).sub(i)
            collapsed, _ = sub.collapse()
            for height in (0.0, 10.0):
                dofs = fem.locate_dofs_geometrical((sub, collapsed), lambda x: np.isclose(x[2], height))
                value = fem.Function(collapsed)
                if height > 0.0:
                    self.top[i] = dofs[0]
                    if i == 0:
                        self.moved = value
                self.conditions.append(fem.dirichletbc(value, dofs, sub))
        self.matrix = fem.petsc.create_matrix(self.tangent)
        self.vector = fem.petsc.create_vector(self.residual)
        self.step = self.vector.duplicate()
        solver = PETSc.KSP().create(MPI.COMM_SELF)
        solver.setOperators(self.matrix)
        pc = solver.getPC()
        if iterative:
            _, displacements = space.sub(0).collapse()
            _, pressures = space.sub(1).collapse()
            fields = [("u", np.sort(displacements)), ("p", np.sort(pressures))]
            solver.setType("fgmres")
            solver.setTolerances(rtol=1e-6, max_it=300)
            pc.setType("fieldsplit")
            pc.setFieldSplitIS(*[(name, PETSc.IS().createGeneral(np.array(d, dtype=np.int32))) for name, d in fields])
            options = PETSc.Options()
            for key, value in {
                "pc_fieldsplit_type": "schur",
                "pc_fieldsplit_schur_fact_type": "upper",
                "pc_fieldsplit_schur_precondition": "selfp",
                "fieldsplit_u_ksp_type": "preonly",
                "fieldsplit_u_pc_type": "gamg",
                "fieldsplit_p_ksp_type": "preonly",
                "fieldsplit_p_pc_type": "jacobi",
            }.items():
                options[key] = value
            solver.setFromOptions()
        else:
            solver.setType("preonly")
            pc.setType("lu")
            pc.setFactorSolverType("mumps")
        self.solver = solver

    def assembled(self):
        with self.vector.localForm() as local:
            local.set(0)
        fem.petsc.assemble_vector(self.vector, self.residual)

    def newton(self, guess, load):
        x = self.z.x.array
        x[:] = guess
        self.moved.x.array[:] = 3.0 * load
        for iteration in range(1, 31):
            self.assembled()
            fem.petsc.apply_lifting(self.vector, [self.tangent], [self.conditions], [self.z.vector], -1.0)
            fem.petsc.set_bc(self.vector, self.conditions, self.z.vector, -1.0)
            self.matrix.zeroEntries()
            fem.petsc.assemble_matrix(self.matrix, self.tangent, self.conditions)
            self.matrix.assemble()
            self.solver.solve(self.vector, self.step)
            step = self.step.array
            size = np.linalg.norm(step)
            if not np.isfinite(size) or size > 1e10 or self.solver.getConvergedReason() < 0:
                raise common.Failed(iteration)
            x -= step
            if size <= 1e-8 * np.linalg.norm(x):
                return x.copy(), iteration
        raise common.Failed(30)

    def values(self, state):
        self.z.x.array[:] = state
        self.assembled()
        force = self.vector.array
        energy = fem.assemble_scalar(self.energy)
        return {"E": energy, "Fx": force[self.top[0]].sum(), "Fz": force[self.top[2]].sum()}


def main():
    with open(f"{sys.argv[1]}/sheared_cube.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    common.REFERENCE["cube"] = {r["quantity"]: float(r["value"]) for r in rows if r["quantity"] in ("E", "Fx", "Fz")}
    common.FIRST["cube"] = [1.0]
    table = common.Rows(sys.argv[2])
    meshes = [int(n) for n in sys.argv[3:]] or [2, 4, 6]
    for name, iterative in (("dolfinx Q2/Q1", False), ("dolfinx Q2/Q1 GMRES", True)):
        for n in meshes:
            case = Cube(n, iterative)
            start = np.zeros(len(case.z.x.array))
            found = common.timed("cube", lambda first: common.march(first, case.newton, start))
            if found is None:
                print(f"{name} with {n} elements a side failed", file=sys.stderr)
                continue
            seconds, (state, steps, iterations) = found
            error = common.worst("cube", case.values(state))
            table.add("cube", name, (2 * n + 1) ** 3, len(start), steps, iterations, error, seconds)


main()
