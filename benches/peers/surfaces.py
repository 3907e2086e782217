"""From a closed surface to a force by other programs: Gmsh meshes the STL file, dolfinx solves with P2/P1 on its tetrahedra.

    surfaces.py write DIR     writes bracket.stl, mount.stl and bush.stl (needs Gmsh's Python package)
    surfaces.py mesh DIR      meshes them with several sizes: DIR/PART_SIZE.npz, with the seconds that it took
    surfaces.py solve DIR     solves on these meshes (needs dolfinx): DIR/peers.csv
    surfaces.py table DIR     this crate's rows of DIR/ours.csv beside them, and the seconds that each takes for 2 %

Gmsh and dolfinx may belong to different Python installations. Seconds are processor seconds of one thread: classification
of the surface, meshing, assembly and solution; imports and the compilation of forms come before. The problems are those of
`cargo bench -p rkpm-benches --bench surfaces`.
"""

import glob
import os
import sys
import time

import numpy as np

SIZES = {
    "bracket": [8.0, 6.0, 4.5, 3.5, 2.8, 2.2],
    "mount": [8.0, 6.0, 4.5, 3.5, 2.8, 2.2],
    "bush": [0.5, 0.4, 0.3, 0.22, 0.17, 0.13],
}


def geometry(part, occ):
    """The solids of examples/meshes/make.py, and a bush of radii 1 and 2, 1 long."""
    if part == "bracket":
        occ.fuse([(3, occ.addBox(0, 0, 0, 40, 20, 8))], [(3, occ.addBox(0, 0, 0, 8, 20, 40))])
        occ.synchronize()
        solid = occ.getEntities(3)[0][1]
        for _, edge in occ.getEntities(1):
            box = occ.getBoundingBox(1, edge)
            if all(abs(box[k] - 8) < 1e-5 for k in (0, 2, 3, 5)):
                occ.fillet([solid], [edge], [5.0])
                break
        occ.cut(occ.getEntities(3), [(3, occ.addCylinder(28, 10, -1, 0, 0, 20, 4))])
    elif part == "mount":
        occ.cut([(3, occ.addCone(0, 0, 0, 0, 0, 24, 26, 16))], [(3, occ.addCylinder(0, 0, 10, 0, 0, 18, 7))])
        occ.intersect(occ.getEntities(3), [(3, occ.addBox(-50, 0, -1, 100, 50, 50))])
    else:
        occ.cut([(3, occ.addCylinder(0, 0, 0, 0, 0, 1, 2))], [(3, occ.addCylinder(0, 0, -1, 0, 0, 3, 1))])
    occ.synchronize()


def write(directory):
    import gmsh

    for part, sizes in SIZES.items():
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", sizes[2])
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 60)
        geometry(part, gmsh.model.occ)
        gmsh.model.mesh.generate(2)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(os.path.join(directory, f"{part}.stl"))
        gmsh.finalize()


def mesh(directory):
    import gmsh

    for part, sizes in SIZES.items():
        for size in sizes:
            gmsh.initialize()
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setNumber("General.NumThreads", 1)
            begin = time.process_time()
            gmsh.merge(os.path.join(directory, f"{part}.stl"))
            gmsh.model.mesh.classifySurfaces(np.pi / 5, True, True, np.pi)
            gmsh.model.mesh.createGeometry()
            gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])])
            gmsh.model.geo.synchronize()
            gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5 * size)
            gmsh.option.setNumber("Mesh.MeshSizeMax", size)
            gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
            try:
                gmsh.model.mesh.generate(3)
            except Exception as error:
                print(f"{part} {size}: Gmsh fails: {error}", flush=True)
                gmsh.finalize()
                continue
            tags, points, _ = gmsh.model.mesh.getNodes()
            _, corners = gmsh.model.mesh.getElementsByType(4)
            seconds = time.process_time() - begin
            order = np.argsort(tags)
            cells = np.searchsorted(tags[order], corners).reshape(-1, 4)
            used, cells = np.unique(cells, return_inverse=True)
            points = points.reshape(-1, 3)[order][used]
            np.savez(os.path.join(directory, f"{part}_{size}.npz"), points=points, cells=cells.reshape(-1, 4), seconds=seconds)
            print(f"{part} {size}: {len(points)} nodes, {len(cells.reshape(-1, 4))} tetrahedra, {seconds:.2f} s", flush=True)
            gmsh.finalize()


def held(part):
    """What is prescribed: (where, component, value) and where the force is taken, with its component."""
    if part == "bracket":
        bore = lambda x: (np.hypot(x[0] - 28, x[1] - 10) < 4.01) & (x[2] < 8.01)
        base = lambda x: x[2] < 1e-6
        top = lambda x: x[2] > 40 - 1e-6
        fixed = [(where, k, 0.0) for where in (base, bore) for k in range(3)]
        return fixed + [(top, k, 6.0 if k == 0 else 0.0) for k in range(3)], top, 0
    if part == "mount":
        insert = lambda x: (np.hypot(x[0], x[1]) < 7.01) & (x[2] > 10 - 1e-6)
        fixed = [(lambda x: x[2] < 1e-6, k, 0.0) for k in range(3)] + [(lambda x: np.abs(x[1]) < 1e-6, 1, 0.0)]
        return fixed + [(insert, k, value) for k, value in enumerate([1.5, 0.0, -2.0])], insert, 2
    inner = lambda x: np.hypot(x[0], x[1]) < 1.01
    outer = lambda x: np.hypot(x[0], x[1]) > 1.99
    return [(outer, k, 0.0) for k in range(3)] + [(inner, k, value) for k, value in enumerate([0.2, 0.0, 0.0])], inner, 0


def solve(directory):
    import ufl
    from dolfinx import fem
    from dolfinx import mesh as meshes
    from mpi4py import MPI

    from saddle import Newton

    options = {"cffi_extra_compile_args": ["-O3", "-march=native", "-ffast-math"]}
    rows = open(os.path.join(directory, "peers.csv"), "w")
    print("part,size,nodes,unknowns,iterations,force,meshing_seconds,seconds", file=rows, flush=True)
    for part, sizes in SIZES.items():
        for size in sizes:
            path = os.path.join(directory, f"{part}_{size}.npz")
            if not os.path.exists(path):
                continue
            data = np.load(path)
            domain = meshes.create_mesh(
                MPI.COMM_SELF, data["cells"], data["points"], ufl.Mesh(ufl.VectorElement("Lagrange", ufl.tetrahedron, 1))
            )
            cell = domain.ufl_cell()
            pair = ufl.MixedElement(ufl.VectorElement("Lagrange", cell, 2), ufl.FiniteElement("Lagrange", cell, 1))
            space = fem.FunctionSpace(domain, pair)
            z = fem.Function(space)
            u, p = ufl.split(z)
            f = ufl.Identity(3) + ufl.grad(u)
            j = ufl.det(f)
            c = f.T * f
            first = j ** (-2 / 3) * ufl.tr(c) - 3
            second = 0.5 * j ** (-4 / 3) * (ufl.tr(c) ** 2 - ufl.tr(c * c)) - 3
            law, bulk = {
                "bracket": (0.4 * first + 0.1 * second, 500.0),
                "mount": (0.55 * first - 0.05 * first**2 + 0.01 * first**3, 1e3),
                "bush": (0.5 * first, 1e3),
            }[part]
            dx = ufl.dx(domain=domain, metadata={"quadrature_degree": 4})
            residual_form = ufl.derivative((law + p * (j - 1) - p**2 / (2 * bulk)) * dx, z)
            residual = fem.form(residual_form, jit_params=options)
            tangent = fem.form(ufl.derivative(residual_form, z), jit_params=options)
            prescribed, loaded, direction = held(part)
            conditions, force_dofs = [], None
            for where, component, value in prescribed:
                sub = space.sub(0).sub(component)
                collapsed, _ = sub.collapse()
                function = fem.Function(collapsed)
                function.x.array[:] = value
                dofs = fem.locate_dofs_geometrical((sub, collapsed), where)
                conditions.append((fem.dirichletbc(function, dofs, sub), function, value))
                if where is loaded and component == direction:
                    force_dofs = dofs[0]
            newton = Newton(z, residual, tangent, [condition for condition, _, _ in conditions])

            # In one step if that converges, else in as many as are needed; failed tries are not counted.
            for steps in (1, 2, 4, 8):
                z.x.array[:] = 0.0
                begin, spent = time.process_time(), 0
                for number in range(1, steps + 1):
                    for _, function, value in conditions:
                        function.x.array[:] = value * number / steps
                    found = newton.solve(20)
                    if found is None:
                        break
                    spent += found
                if found is not None:
                    break
            seconds = time.process_time() - begin
            if found is None:
                print(f"{part} {size}: Newton's method fails", flush=True)
                continue
            force = newton.forces()[force_dofs].sum()
            row = f"{part},{size},{len(data['points'])},{len(z.x.array)},{spent},{force:.6g},{float(data['seconds']):.3f},{seconds:.3f}"
            print(row, file=rows, flush=True)
            print(row, flush=True)
            if seconds > 60:
                break


def table(directory):
    import csv

    with open(os.path.join(directory, "peers.csv")) as file:
        peers = list(csv.DictReader(file))
    with open(os.path.join(directory, "ours.csv")) as file:
        ours = list(csv.DictReader(file))
    chosen = {}
    print("| part | program | particles or nodes | force | off the reference | seconds |")
    print("|---|---|---|---|---|---|")
    for part in SIZES:
        sides = []
        for name, rows, count in [("rkpm", ours, "particles"), ("Gmsh, dolfinx P2/P1", peers, "nodes")]:
            found = [r for r in rows if r["part"] == part]
            seconds = [float(r["seconds"]) + float(r.get("meshing_seconds", 0)) for r in found]
            sides.append((name, [int(r[count]) for r in found], [abs(float(r["force"])) for r in found], seconds))
        # The finest models of both programs: half their distance is the reference's own uncertainty.
        finest = [forces[-1] for _, _, forces, _ in sides]
        reference = sum(finest) / 2
        doubt = abs(finest[0] - finest[1]) / (2 * reference)
        for name, counts, forces, seconds in sides:
            errors = [force / reference - 1 for force in forces]
            for row in zip(counts, forces, errors, seconds):
                print(f"| {part} | {name} | {row[0]} | {row[1]:.4g} | {100 * row[2]:+.2f} % | {row[3]:.2f} |")
            # The first model from which on all are within 2 %.
            first = max([k + 1 for k, error in enumerate(errors) if abs(error) > 0.02], default=0)
            chosen[part, name] = seconds[first] if first < len(seconds) else float("nan")
        ratio = chosen[part, sides[1][0]] / chosen[part, sides[0][0]]
        print(f"\n{part} to 2 %: {sides[0][0]} {chosen[part, sides[0][0]]:.2f} s, {sides[1][0]} "
              f"{chosen[part, sides[1][0]]:.2f} s, ratio {ratio:.1f}; the reference is known to {100 * doubt:.2f} %\n")


if __name__ == "__main__":
    {"write": write, "mesh": mesh, "solve": solve, "table": table}[sys.argv[1]](sys.argv[2])
