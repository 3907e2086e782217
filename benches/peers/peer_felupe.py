"""felupe, Q1/P0 and Q2/Q1 (three fields), its own assembly and SciPy's direct solver.

Usage: peer_felupe.py REFERENCES TABLE
"""

import sys
import warnings

import felupe as fem
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models.hyperelastic import mooney_rivlin, yeoh
from scipy.sparse.linalg import spsolve

import common

warnings.filterwarnings("ignore")


class Case:
    """One problem on one mesh."""

    def __init__(self, problem, cells, element):
        self.problem = problem
        # Bodies of revolution turn about the first axis: (z, r).
        box = {"tube": ((0.0, 6.0), (1.0, 8.0)), "disk": ((0.0, 0.0), (0.635, 18.923)), "cook": ((0.0, 0.0), (1.0, 1.0))}
        if problem != "cook":
            cells = cells[::-1]
        low, high = box[problem]
        mesh = fem.Rectangle(a=low, b=high, n=tuple(c + 1 for c in cells))
        if problem == "cook":
            s, t = mesh.points[:, 0].copy(), mesh.points[:, 1].copy()
            mesh.points[:, 0], mesh.points[:, 1] = 48 * s, 44 * s * (1 - t) + (44 + 16 * s) * t
        plane = {"planestrain": True} if problem == "cook" else {"axisymmetric": True}
        if problem == "cook":
            umat, bulk = fem.NeoHooke(mu=80.194), 4e5
        elif problem == "disk":
            umat, bulk = Hyperelastic(mooney_rivlin, C10=0.5516, C01=0.1379), 689.5
        else:
            umat, bulk = Hyperelastic(yeoh, C10=0.373, C20=-0.031, C30=0.005), 1e5
        if element == "Q1/P0":
            region = fem.RegionQuad(mesh)
            self.field = fem.FieldsMixed(region, n=3, **plane)
            self.solid = fem.SolidBody(fem.NearlyIncompressible(umat, bulk=bulk), self.field)
        else:
            mesh = mesh.add_midpoints_edges().add_midpoints_faces(cell_type="quad9")
            region = fem.RegionBiQuadraticQuad(mesh)
            self.field = fem.FieldsMixed(region, n=3, disconnect=False, **plane)
            self.solid = fem.SolidBody(fem.NearlyIncompressible(umat, bulk=bulk), self.field)
        self.mesh, self.umat, self.bulk = mesh, umat, bulk
        x = mesh.points
        u = self.field[0]
        if problem == "tube":
            self.bounds = {"z": fem.Boundary(u, mask=np.ones(len(x), dtype=bool), skip=(0, 1))}
            loaded = np.isclose(x[:, 1], 6.0)
        elif problem == "disk":
            self.bounds = {
                "axis": fem.Boundary(u, fy=0.0, skip=(1, 0)),
                "rim": fem.Boundary(u, fy=18.923, skip=(0, 0)),
            }
            loaded = np.isclose(x[:, 0], 0.0)
        else:
            self.bounds = {"left": fem.Boundary(u, fx=0.0, skip=(0, 0))}
            loaded = np.isclose(x[:, 0], 48.0)
        boundary = fem.RegionQuadBoundary if element == "Q1/P0" else fem.RegionBiQuadraticQuadBoundary
        region = boundary(mesh, mask=loaded, only_surface=True, ensure_3d=True)
        kind = fem.FieldPlaneStrain if problem == "cook" else fem.FieldAxisymmetric
        edge = fem.FieldContainer([kind(region, dim=2)])
        # The pressure looks at the displacement of the body.
        edge[0].values = u.values
        self.edge, self.dead = fem.SolidBodyPressure(edge), None
        if problem == "cook":
            # A dead traction: the pressure on the undeformed edge, whose normal is the first axis, turned upwards.
            self.dead = fem.SolidBodyPressure(fem.FieldContainer([kind(region, dim=2)]), pressure=1.0)
            force = self.dead.assemble.vector().toarray().ravel().reshape(-1, 2)
            self.dead = np.zeros_like(force)
            self.dead[:, 1] = np.abs(force[:, 0]) * 6.25
            self.dead = self.dead.ravel()
        self.dof0, self.dof1 = fem.dof.partition(self.field, self.bounds)
        self.sizes = [f.values.size for f in self.field.fields]
        self.load_pressure = {"tube": 0.46, "disk": 0.1035, "cook": 0.0}[problem]

    def start(self):
        return np.concatenate([f.values.ravel() for f in self.field.fields])

    def put(self, state):
        offset = 0
        for field, size in zip(self.field.fields, self.sizes):
            field.values[:] = state[offset : offset + size].reshape(field.values.shape)
            offset += size

    def newton(self, guess, load):
        state = guess.copy()
        free = self.dof1
        n = self.sizes[0]
        for iteration in range(1, 31):
            self.put(state)
            vector = self.solid.assemble.vector(self.field).toarray().ravel()
            matrix = self.solid.assemble.matrix(self.field).tocsr()
            if self.dead is None:
                self.edge.field[0].values[:] = self.field[0].values
                pressure = load * self.load_pressure
                self.edge.update(pressure)
                vector[:n] -= self.edge.assemble.vector(self.edge.field).toarray().ravel()
                matrix = matrix.copy()
                extra = self.edge.assemble.matrix(self.edge.field)
                extra.resize(matrix.shape)
                matrix = matrix - extra
            else:
                vector[:n] -= load * self.dead
            if not np.all(np.isfinite(vector)):
                raise common.Failed(iteration)
            step = np.zeros(len(state))
            step[free] = spsolve(matrix[free][:, free], -vector[free])
            size = np.linalg.norm(step[:n])
            if not np.isfinite(size) or size > 1e10:
                raise common.Failed(iteration)
            state = state + step
            if size <= 1e-8 * np.linalg.norm(state[:n]):
                self.put(state)
                f = self.field.extract()[0]
                if np.linalg.det(f.transpose(2, 3, 0, 1)).min() <= 0.0:
                    # Converged, but inside out: no solution.
                    raise common.Failed(iteration)
                return state, iteration
        raise common.Failed(30)


    def values(self, state):
        self.put(state)
        u, x = self.field[0].values, self.mesh.points
        at = lambda a, b: u[np.argmin((x[:, 0] - a) ** 2 + (x[:, 1] - b) ** 2)]
        if self.problem == "disk":
            return {"w": at(0.0, 0.0)[0]}
        f, p, _ = self.field.extract()
        j = np.linalg.det(f.transpose(2, 3, 0, 1))
        c = np.einsum("kiqc,kjqc->ijqc", f, f)
        b1 = j ** (-2 / 3) * np.einsum("iiqc->qc", c) - 3
        w = 40.097 * b1 if self.problem == "cook" else 0.373 * b1 - 0.031 * b1**2 + 0.005 * b1**3
        region = self.field.region
        measure = region.dV
        if self.problem == "tube":
            measure = measure * 2 * np.pi * self.field[0].radius
        energy = float(((w + np.asarray(p).reshape(w.shape) ** 2 / (2 * self.bulk)) * measure).sum())
        if self.problem == "tube":
            return {"energy": energy}
        return {"tip": at(48.0, 60.0)[1], "mid": at(48.0, 52.0)[1], "energy": energy}


MESHES = {
    ("tube", "Q2/Q1"): [(2, 1), (3, 1), (4, 1), (8, 1)],
    ("disk", "Q2/Q1"): [(10, 1), (14, 1), (20, 1), (40, 1)],
    ("cook", "Q2/Q1"): [(4, 4), (6, 6), (8, 8), (12, 12), (16, 16), (20, 20)],
    ("tube", "Q1/P0"): [(8, 1), (16, 1), (32, 1)],
    ("disk", "Q1/P0"): [(20, 1), (40, 1), (80, 1)],
    ("cook", "Q1/P0"): [(8, 8), (16, 16), (32, 32)],
}


def main():
    common.references(sys.argv[1])
    rows = common.Rows(sys.argv[2])
    for (problem, element), meshes in MESHES.items():
        for cells in meshes:
            case = Case(problem, cells, element)
            start = case.start()
            found = common.timed(problem, lambda first: common.march(first, case.newton, start))
            if found is None:
                continue
            seconds, (state, steps, iterations) = found
            error = common.worst(problem, case.values(state))
            unknowns, nodes = len(case.dof1), len(case.mesh.points)
            rows.add(problem, f"felupe {element}", nodes, unknowns, steps, iterations, error, seconds)
            if seconds > 2.0:
                break


main()
