"""dolfinx, P2/P1 on tetrahedra (displacement, pressure), MUMPS: the bonded cube sheared by 3 mm in one step.

Usage: peer_tetrahedra.py DIR, with the meshes of cube_meshes.py; one thread. Seconds are those of the solve alone.
"""

import glob
import sys
import time

import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from saddle import Newton

OPTIONS = {"cffi_extra_compile_args": ["-O3", "-march=native", "-ffast-math"]}
REFERENCE = {"E": 2672.3, "Fx": 1793.8, "Fz": 343.0}

for path in sorted(glob.glob(f"{sys.argv[1]}/cube_*.npz")):
    data = np.load(path)
    domain = mesh.create_mesh(
        MPI.COMM_SELF, data["cells"], data["points"], ufl.Mesh(ufl.VectorElement("Lagrange", ufl.tetrahedron, 1))
    )
    cell = domain.ufl_cell()
    space = fem.FunctionSpace(
        domain, ufl.MixedElement(ufl.VectorElement("Lagrange", cell, 2), ufl.FiniteElement("Lagrange", cell, 1))
    )
    z = fem.Function(space)
    u, p = ufl.split(z)
    f = ufl.Identity(3) + ufl.grad(u)
    j = ufl.det(f)
    w = 40.097 * (j ** (-2 / 3) * ufl.tr(f.T * f) - 3)
    bulk = 400889.8
    dx = ufl.dx(domain=domain, metadata={"quadrature_degree": 4})
    energy = fem.form((w + p**2 / (2 * bulk)) * dx, jit_params=OPTIONS)
    residual_form = ufl.derivative((w + p * (j - 1) - p**2 / (2 * bulk)) * dx, z)
    residual = fem.form(residual_form, jit_params=OPTIONS)
    tangent = fem.form(ufl.derivative(residual_form, z), jit_params=OPTIONS)
    conditions, tops = [], {}
    for component in range(3):
        sub = space.sub(0).sub(component)
        collapsed, _ = sub.collapse()
        for level, value in [(0.0, 0.0), (10.0, 3.0 if component == 0 else 0.0)]:
            function = fem.Function(collapsed)
            function.x.array[:] = value
            dofs = fem.locate_dofs_geometrical((sub, collapsed), lambda x, level=level: np.isclose(x[2], level))
            conditions.append(fem.dirichletbc(function, dofs, sub))
            if level == 10.0:
                tops[component] = dofs[0]
    newton = Newton(z, residual, tangent, conditions)
    begin = time.process_time()
    iterations = newton.solve(30)
    seconds = time.process_time() - begin
    force = newton.forces()
    found = {"E": fem.assemble_scalar(energy)}
    for name, component in [("Fx", 0), ("Fz", 2)]:
        found[name] = force[tops[component]].sum()
    worst = max(abs(found[name] / value - 1) for name, value in REFERENCE.items())
    print(
        f"{path.split('/')[-1]}: dolfinx P2/P1, {len(z.x.array)} unknowns, {iterations} iterations, "
        + ", ".join(f"{name} {value:.1f}" for name, value in found.items())
        + f", worst {100 * worst:.2f} %, {seconds:.3f} s",
        flush=True,
    )
    if seconds > 20:
        break
