"""Writes the meshes of the examples and tests with Gmsh's Python package (4.11 or later).

    python3 examples/meshes/make.py

Files are small; run it again after changing a shape. `tests/reference/mesh_measures.csv` holds their volumes and areas as
numpy finds them in what meshio reads.
"""
import os

import gmsh
import meshio
import numpy as np

EXAMPLES = os.path.dirname(os.path.abspath(__file__))
TESTS = os.path.join(EXAMPLES, "..", "..", "tests", "meshes")
REFERENCE = os.path.join(EXAMPLES, "..", "..", "tests", "reference", "mesh_measures.csv")


def begin(size, algorithm=None):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5 * size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    if algorithm is not None:
        gmsh.option.setNumber("Mesh.Algorithm3D", algorithm)


def name(dimension, entities, text):
    gmsh.model.addPhysicalGroup(dimension, entities, name=text)


def save(path, version=4.1, binary=0):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(path)


def surfaces_at(axis, value, eps=1e-6):
    """Surfaces that lie in the plane x_axis = value."""
    found = []
    for _, tag in gmsh.model.getEntities(2):
        box = gmsh.model.getBoundingBox(2, tag)
        if abs(box[axis] - value) < eps and abs(box[axis + 3] - value) < eps:
            found.append(tag)
    return found


def plug():
    """A cylinder of two materials, in all four formats: rubber below, steel above, prisms and hexahedra beside them."""
    begin(0.5)
    low = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 1)
    high = gmsh.model.occ.addCylinder(0, 0, 1, 0, 0, 0.5, 1)
    gmsh.model.occ.fragment([(3, low)], [(3, high)])
    gmsh.model.occ.synchronize()
    name(3, [low], "rubber")
    name(3, [high], "steel plate")
    name(2, surfaces_at(2, 0.0), "base")
    name(2, surfaces_at(2, 1.5), "top")
    # A face in two groups.
    name(2, surfaces_at(2, 0.0) + surfaces_at(2, 1.5), "ends")
    gmsh.model.mesh.generate(3)
    for version, binary, label in [(2.2, 0, "22_ascii"), (2.2, 1, "22_binary"), (4.1, 0, "41_ascii"), (4.1, 1, "41_binary")]:
        save(os.path.join(TESTS, f"plug_{label}.msh"), version, binary)
    gmsh.model.mesh.setOrder(2)
    save(os.path.join(TESTS, "plug_second_order.msh"), 4.1, 1)
    gmsh.finalize()


def extruded(label, recombine):
    """A plate with a hole, extruded: prisms or hexahedra."""
    begin(0.35)
    square = gmsh.model.occ.addRectangle(0, 0, 0, 2, 1.5)
    hole = gmsh.model.occ.addDisk(0.8, 0.7, 0, 0.3, 0.3)
    gmsh.model.occ.cut([(2, square)], [(2, hole)])
    gmsh.model.occ.synchronize()
    plate = gmsh.model.getEntities(2)[0][1]
    if recombine:
        gmsh.model.mesh.setRecombine(2, plate)
    out = gmsh.model.occ.extrude([(2, plate)], 0, 0, 0.6, numElements=[3], recombine=True)
    gmsh.model.occ.synchronize()
    name(3, [tag for dimension, tag in out if dimension == 3], "plate")
    name(2, surfaces_at(0, 0.0), "left")
    name(2, surfaces_at(0, 2.0), "right")
    gmsh.model.mesh.generate(3)
    save(os.path.join(TESTS, f"{label}.msh"), 4.1, 1)
    gmsh.finalize()


def flat():
    """A plate with a hole in the plane, triangles and quadrangles."""
    begin(0.25)
    left = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    right = gmsh.model.occ.addRectangle(1, 0, 0, 1, 1)
    hole = gmsh.model.occ.addDisk(0.5, 0.5, 0, 0.25, 0.25)
    gmsh.model.occ.cut([(2, left)], [(2, hole)])
    gmsh.model.occ.fragment([(2, left)], [(2, right)])
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setRecombine(2, right)
    name(2, [left, right], "plate")
    for side, axis, value in [("left", 0, 0.0), ("right", 0, 2.0), ("bottom", 1, 0.0), ("top", 1, 1.0)]:
        lines = []
        for _, tag in gmsh.model.getEntities(1):
            box = gmsh.model.getBoundingBox(1, tag)
            if abs(box[axis] - value) < 1e-6 and abs(box[axis + 3] - value) < 1e-6:
                lines.append(tag)
        name(1, lines, side)
    gmsh.model.mesh.generate(2)
    save(os.path.join(TESTS, "flat.msh"), 2.2, 0)
    gmsh.finalize()


FACES = {
    "hexahedron": [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
    "wedge": [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
}
CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "wedge": 6}
DIMENSIONS = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3, "wedge": 3}


def area_vectors(x):
    """n dA of triangles and planar quadrangles, integrated."""
    if x.shape[1] == 3:
        return 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    return 0.5 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])


def measures(kind, x):
    """Volumes, areas, lengths of elements."""
    if kind == "line":
        return np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
    if kind in ("triangle", "quad"):
        return np.linalg.norm(area_vectors(x), axis=1)
    if kind == "tetra":
        return np.abs(np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x[:, 3] - x[:, 0])) / 6
    # Planar faces: a third of their mean point times their area.
    total = np.zeros(len(x))
    for face in FACES[kind]:
        corners = x[:, face]
        if len(face) == 3:
            parts = [corners]
        else:
            parts = [corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]
        for part in parts:
            total += np.einsum("ij,ij->i", part.mean(axis=1), area_vectors(part)) / 3
    return np.abs(total)


def reference():
    lines = ["# Volumes, areas and lengths of the groups of tests/meshes, from meshio's arrays by numpy (examples/meshes/make.py); rounding 1e-13",
             "file,dimension,group,measure"]
    for file in sorted(os.listdir(TESTS)):
        if not file.endswith(".msh") or "second" in file:
            continue
        mesh = meshio.read(os.path.join(TESTS, file))
        for group, (tag, dimension) in sorted(mesh.field_data.items()):
            total = 0.0
            for kind, sets in mesh.cell_sets_dict[group].items() if group in mesh.cell_sets else []:
                pass
            for index, block in enumerate(mesh.cells):
                kind = block.type
                if DIMENSIONS.get(kind) != dimension:
                    continue
                if group in mesh.cell_sets and mesh.cell_sets[group][index] is not None and len(mesh.cell_sets[group][index]):
                    members = mesh.cell_sets[group][index]
                elif group in mesh.cell_sets:
                    continue
                else:
                    members = np.nonzero(mesh.cell_data["gmsh:physical"][index] == tag)[0]
                total += measures(kind, mesh.points[block.data[np.asarray(members, dtype=int)]]).sum()
            lines.append(f"{file},{dimension},{group},{total!r}".replace("np.float64(", "").replace(")", ""))
    with open(REFERENCE, "w") as out:
        out.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    os.makedirs(TESTS, exist_ok=True)
    plug()
    extruded("prisms", False)
    extruded("hexahedra", True)
    flat()
    reference()
