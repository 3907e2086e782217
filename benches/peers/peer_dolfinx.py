"""dolfinx, Q2/Q1 (displacement, pressure) in the perturbed Lagrangian form, MUMPS.

Usage: peer_dolfinx.py REFERENCES TABLE
Seconds are those of the solve alone: forms are compiled and matrices allocated before.
"""

import sys

import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc

import common

OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native", "-ffast-math"]}


class Case:
    """One problem on one mesh."""

    def __init__(self, problem, cells, degree):
        self.problem = problem
        box = {"tube": ((6.0, 0.0), (8.0, 1.0)), "disk": ((0.0, 0.0), (18.923, 0.635)), "cook": ((0.0, 0.0), (1.0, 1.0))}
        low, high = box[problem]
        domain = mesh.create_rectangle(
            MPI.COMM_SELF, [np.array(low), np.array(high)], cells, mesh.CellType.quadrilateral
        )
        if problem == "cook":
            x = domain.geometry.x
            s, t = x[:, 0].copy(), x[:, 1].copy()
            x[:, 0], x[:, 1] = 48 * s, 44 * s * (1 - t) + (44 + 16 * s) * t
        cell = domain.ufl_cell()
        element = ufl.MixedElement(
            ufl.VectorElement("Lagrange", cell, degree), ufl.FiniteElement("Lagrange", cell, degree - 1)
        )
        space = fem.FunctionSpace(domain, element)
        self.space, self.z = space, fem.Function(space)
        u, p = ufl.split(self.z)
        x = ufl.SpatialCoordinate(domain)
        revolved = problem != "cook"
        measure = 2 * np.pi * x[0] if revolved else 1.0
        hoop = u[0] / x[0] if revolved else 0.0
        g = ufl.grad(u)
        f = ufl.as_matrix([[1 + g[0, 0], g[0, 1], 0], [g[1, 0], 1 + g[1, 1], 0], [0, 0, 1 + hoop]])
        j = ufl.det(f)
        c = f.T * f
        i1 = ufl.tr(c)
        i2 = (i1**2 - ufl.tr(c * c)) / 2
        b1, b2 = j ** (-2 / 3) * i1 - 3, j ** (-4 / 3) * i2 - 3
        if problem == "tube":
            w, bulk = 0.373 * b1 - 0.031 * b1**2 + 0.005 * b1**3, 1e5
        elif problem == "disk":
            w, bulk = 0.5516 * b1 + 0.1379 * b2, 689.5
        else:
            w, bulk = 40.097 * b1, 4e5
        quadrature = {"quadrature_degree": 2 * degree}
        dx = ufl.dx(domain=domain, metadata=quadrature)
        self.energy = fem.form((w + p**2 / (2 * bulk)) * measure * dx, jit_params=OPTIONS)
        potential = (w + p * (j - 1) - p**2 / (2 * bulk)) * measure * dx
        test = ufl.TestFunction(space)
        residual = ufl.derivative(potential, self.z, test)
        self.load = fem.Constant(domain, PETSc.ScalarType(0.0))
        v, _ = ufl.split(test)
        edge = {
            "tube": lambda x: np.isclose(x[0], 6.0),
            "disk": lambda x: np.isclose(x[1], 0.0),
            "cook": lambda x: np.isclose(x[0], 48.0),
        }[problem]
        facets = np.sort(mesh.locate_entities_boundary(domain, 1, edge))
        tags = mesh.meshtags(domain, 1, facets, np.ones(len(facets), dtype=np.int32))
        ds = ufl.ds(domain=domain, subdomain_data=tags, metadata=quadrature)(1)
        if problem == "cook":
            residual -= self.load * 6.25 * v[1] * ds
        else:
            pressure = {"tube": 0.46, "disk": 0.1035}[problem]
            n = ufl.FacetNormal(domain)
            normal = j * ufl.inv(f).T * ufl.as_vector([n[0], n[1], 0])
            residual += self.load * pressure * (normal[0] * v[0] + normal[1] * v[1]) * measure * ds
        self.residual = fem.form(residual, jit_params=OPTIONS)
        self.tangent = fem.form(ufl.derivative(residual, self.z), jit_params=OPTIONS)
        held = {
            "tube": [(lambda x: np.full(x.shape[1], True), 1)],
            "disk": [(lambda x: np.isclose(x[0], 0.0), 0)] + [(lambda x: np.isclose(x[0], 18.923), i) for i in (0, 1)],
            "cook": [(lambda x: np.isclose(x[0], 0.0), i) for i in (0, 1)],
        }[problem]
        self.conditions = []
        for where, component in held:
            sub = space.sub(0).sub(component)
            collapsed, _ = sub.collapse()
            zero = fem.Function(collapsed)
            dofs = fem.locate_dofs_geometrical((sub, collapsed), where)
            self.conditions.append(fem.dirichletbc(zero, dofs, sub))
        self.matrix = fem.petsc.create_matrix(self.tangent)
        self.vector = fem.petsc.create_vector(self.residual)
        self.step = self.vector.duplicate()
        self.make_solver()

    def make_solver(self):
        self.solver = PETSc.KSP().create(MPI.COMM_SELF)
        self.solver.setOperators(self.matrix)
        self.solver.setType("preonly")
        self.solver.getPC().setType("lu")
        self.solver.getPC().setFactorSolverType("mumps")
        self.solver.setErrorIfNotConverged(False)

    def newton(self, guess, load):
        x = self.z.x.array
        x[:] = guess
        self.load.value = load
        for iteration in range(1, 31):
            with self.vector.localForm() as local:
                local.set(0)
            fem.petsc.assemble_vector(self.vector, self.residual)
            fem.petsc.set_bc(self.vector, self.conditions, self.z.vector, -1.0)
            self.matrix.zeroEntries()
            fem.petsc.assemble_matrix(self.matrix, self.tangent, self.conditions)
            self.matrix.assemble()
            try:
                self.solver.solve(self.vector, self.step)
            except PETSc.Error:
                # MUMPS refuses everything after a matrix that is not finite: begin anew.
                self.make_solver()
                raise common.Failed(iteration) from None
            step = self.step.array
            size = np.linalg.norm(step)
            if not np.isfinite(size) or size > 1e10:
                self.make_solver()
                raise common.Failed(iteration)
            x -= step
            if size <= 1e-8 * np.linalg.norm(x):
                return x.copy(), iteration
        raise common.Failed(30)

    def value_at(self, point, component):
        sub = self.space.sub(0).sub(component)
        collapsed, _ = sub.collapse()
        dofs = fem.locate_dofs_geometrical(
            (sub, collapsed), lambda x: np.isclose(x[0], point[0]) & np.isclose(x[1], point[1])
        )
        return self.z.x.array[dofs[0][0]]

    def values(self, state):
        self.z.x.array[:] = state
        energy = fem.assemble_scalar(self.energy)
        if self.problem == "tube":
            return {"energy": energy}
        if self.problem == "disk":
            return {"w": self.value_at((0.0, 0.0), 1)}
        return {"tip": self.value_at((48.0, 60.0), 1), "mid": self.value_at((48.0, 52.0), 1), "energy": energy}


MESHES = {
    "tube": [(1, 1), (2, 1), (3, 1), (4, 1), (6, 1), (8, 1)],
    "disk": [(10, 1), (11, 1), (12, 1), (14, 1), (20, 1), (28, 1), (40, 1), (60, 1), (80, 2)],
    "cook": [(2, 2), (4, 4), (5, 5), (6, 6), (8, 8), (12, 12), (14, 14), (16, 16), (20, 20), (24, 24)],
}


def main():
    common.references(sys.argv[1])
    rows = common.Rows(sys.argv[2])
    for degree in (2, 3):
        for problem, meshes in MESHES.items():
            for cells in meshes:
                if problem == "cook" and degree * cells[1] % 2:
                    continue  # The middle of the edge is no node.
                case = Case(problem, cells, degree)
                unknowns = len(case.z.x.array)
                start = np.zeros(unknowns)
                found = common.timed(problem, lambda first: common.march(first, case.newton, start))
                if found is None:
                    continue
                seconds, (state, steps, iterations) = found
                error = common.worst(problem, case.values(state))
                nodes = (degree * cells[0] + 1) * (degree * cells[1] + 1)
                name = f"dolfinx Q{degree}/Q{degree - 1}"
                rows.add(problem, name, nodes, unknowns, steps, iterations, error, seconds)
                if seconds > 1.0:
                    break


main()
