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


def mount():
    """A half of a rubber mount with a bonded steel insert [mm]: a cone of rubber on a base plate, the insert from above."""
    begin(5.0)
    occ = gmsh.model.occ
    cone = occ.addCone(0, 0, 0, 0, 0, 24, 26, 16)
    insert = occ.addCylinder(0, 0, 10, 0, 0, 18, 7)
    half = occ.addBox(-50, 0, -1, 100, 50, 50)
    occ.fuse([(3, cone)], [(3, insert)], removeTool=False)
    body = [tag for _, tag in gmsh.model.occ.getEntities(3) if tag not in (insert, half)]
    occ.intersect([(3, tag) for tag in body], [(3, half)], removeTool=False)
    occ.intersect([(3, insert)], [(3, half)])
    occ.fragment(gmsh.model.occ.getEntities(3), [])
    occ.synchronize()
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    steel = min(volumes, key=lambda tag: gmsh.model.occ.getMass(3, tag))
    name(3, [tag for tag in volumes if tag != steel], "rubber")
    name(3, [steel], "insert")
    name(2, surfaces_at(2, 0.0), "base")
    name(2, surfaces_at(2, 28.0), "top")
    name(2, surfaces_at(1, 0.0), "middle")
    gmsh.model.mesh.generate(3)
    save(os.path.join(EXAMPLES, "mount.msh"), 2.2, 1)
    gmsh.finalize()


def bushing():
    """The rubber of a bushing between two sleeves [mm]: a ring 10 to 20 mm in radius, 4 mm long, of hexahedra."""
    begin(3.0)
    occ = gmsh.model.occ
    sectors = []
    for quarter in range(4):
        turn = quarter * np.pi / 2
        points = [occ.addPoint(r * np.cos(t), r * np.sin(t), 0) for r, t in
                  [(10, turn), (20, turn), (20, turn + np.pi / 2), (10, turn + np.pi / 2)]]
        centre = occ.addPoint(0, 0, 0)
        lines = [occ.addLine(points[0], points[1]), occ.addCircleArc(points[1], centre, points[2]),
                 occ.addLine(points[2], points[3]), occ.addCircleArc(points[3], centre, points[0])]
        sectors.append(occ.addPlaneSurface([occ.addCurveLoop(lines)]))
    occ.fragment([(2, tag) for tag in sectors], [])
    occ.synchronize()
    faces = [tag for _, tag in gmsh.model.getEntities(2)]
    for _, line in gmsh.model.getEntities(1):
        box = gmsh.model.getBoundingBox(1, line)
        straight = gmsh.model.getType(1, line) == "Line"
        gmsh.model.mesh.setTransfiniteCurve(line, 7 if straight else 13)
    for face in faces:
        gmsh.model.mesh.setTransfiniteSurface(face)
        gmsh.model.mesh.setRecombine(2, face)
    occ.extrude([(2, face) for face in faces], 0, 0, 4, numElements=[2], recombine=True)
    occ.synchronize()
    name(3, [tag for _, tag in gmsh.model.getEntities(3)], "rubber")
    sides = {"inner": [], "outer": []}
    for _, tag in gmsh.model.getEntities(2):
        if gmsh.model.getType(2, tag) == "Cylinder":
            area = gmsh.model.occ.getMass(2, tag)
            sides["inner" if area < np.pi / 2 * 15 * 4 else "outer"].append(tag)
    name(2, sides["inner"], "inner")
    name(2, sides["outer"], "outer")
    name(2, surfaces_at(2, 0.0) + surfaces_at(2, 4.0), "ends")
    gmsh.model.mesh.generate(3)
    save(os.path.join(EXAMPLES, "bushing.msh"), 2.2, 1)
    gmsh.finalize()


def bracket():
    """A bracket with a hole and a fillet [mm], tetrahedra."""
    begin(4.5)
    occ = gmsh.model.occ
    foot = occ.addBox(0, 0, 0, 40, 20, 8)
    wall = occ.addBox(0, 0, 0, 8, 20, 40)
    occ.fuse([(3, foot)], [(3, wall)])
    occ.synchronize()
    solid = gmsh.model.getEntities(3)[0][1]
    for _, edge in gmsh.model.getEntities(1):
        box = gmsh.model.getBoundingBox(1, edge)
        if abs(box[0] - 8) < 1e-5 and abs(box[3] - 8) < 1e-5 and abs(box[2] - 8) < 1e-5 and abs(box[5] - 8) < 1e-5:
            occ.fillet([solid], [edge], [5.0])
            break
    hole = occ.addCylinder(28, 10, -1, 0, 0, 20, 4)
    occ.cut([(3, tag) for _, tag in occ.getEntities(3) if tag != hole], [(3, hole)])
    occ.synchronize()
    name(3, [tag for _, tag in gmsh.model.getEntities(3)], "rubber")
    name(2, surfaces_at(2, 0.0), "base")
    name(2, surfaces_at(2, 40.0), "top")
    holes = [tag for _, tag in gmsh.model.getEntities(2)
             if gmsh.model.getType(2, tag) == "Cylinder" and gmsh.model.getBoundingBox(2, tag)[0] > 20]
    name(2, holes, "hole")
    gmsh.model.mesh.generate(3)
    save(os.path.join(EXAMPLES, "bracket.msh"), 2.2, 1)
    gmsh.finalize()


def cook():
    """Cook's membrane [mm], extruded by 4 mm, tetrahedra."""
    begin(4.2)
    occ = gmsh.model.occ
    points = [occ.addPoint(x, y, 0) for x, y in [(0, 0), (48, 44), (48, 60), (0, 44)]]
    lines = [occ.addLine(points[k], points[(k + 1) % 4]) for k in range(4)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    occ.extrude([(2, face)], 0, 0, 5)
    occ.synchronize()
    name(3, [tag for _, tag in gmsh.model.getEntities(3)], "membrane")
    name(2, surfaces_at(0, 0.0), "clamp")
    name(2, surfaces_at(0, 48.0), "edge")
    name(2, surfaces_at(2, 0.0) + surfaces_at(2, 5.0), "sides")
    gmsh.model.mesh.generate(3)
    save(os.path.join(EXAMPLES, "cook.msh"), 2.2, 1)
    gmsh.finalize()


def solids():
    """Shapes whose meshes the laws are tested on; each leaves one volume or more behind and gives its size."""
    occ = gmsh.model.occ

    def box():
        occ.addBox(0, 0, 0, 1, 1.2, 0.9)

    def cylinder():
        occ.addCylinder(0, 0, 0, 0, 0, 1.2, 0.6)

    def ball():
        occ.addSphere(0, 0, 0, 0.7)

    def cone():
        occ.addCone(0, 0, 0, 0, 0, 1.2, 0.8, 0.4)

    def bracket():
        a = occ.addBox(0, 0, 0, 1.6, 0.7, 0.7)
        b = occ.addBox(0, 0, 0, 0.7, 0.7, 1.6)
        occ.fuse([(3, a)], [(3, b)])

    def drilled():
        a = occ.addBox(0, 0, 0, 1.4, 1.2, 0.8)
        b = occ.addCylinder(0.7, 0.6, -1, 0, 0, 3, 0.3)
        occ.cut([(3, a)], [(3, b)])

    def sector():
        occ.addTorus(0, 0, 0, 1.2, 0.5, angle=1.2)

    def wedge():
        occ.addWedge(0, 0, 0, 1.4, 1.0, 0.9, ltx=0.6)

    def sleeve():
        a = occ.addCylinder(0, 0, 0, 0, 0, 0.9, 1.0, angle=1.6)
        b = occ.addCylinder(0, 0, -1, 0, 0, 3, 0.45)
        occ.cut([(3, a)], [(3, b)])

    def bulge():
        a = occ.addBox(0, 0, 0, 1.2, 1.0, 0.6)
        b = occ.addSphere(0.6, 0.5, 0.5, 0.45)
        occ.fuse([(3, a)], [(3, b)])

    return [box, cylinder, ball, cone, bracket, drilled, sector, wedge, sleeve, bulge]


def family():
    """Ten meshes of tetrahedra by three algorithms, not optimised where the number is odd; ten of hexahedra: tetrahedra cut
    in four, and extruded quadrangles."""
    for number, shape in enumerate(solids()):
        begin(0.33, [1, 4, 10][number % 3])
        gmsh.option.setNumber("Mesh.Optimize", 1 - number % 2)
        shape()
        gmsh.model.occ.synchronize()
        name(3, [tag for _, tag in gmsh.model.getEntities(3)], "part")
        gmsh.model.mesh.generate(3)
        save(os.path.join(TESTS, f"tetrahedra_{number}.msh"), 2.2, 1)
        gmsh.finalize()
    # Tetrahedra cut in four: six shapes.
    shapes = solids()
    for number, shape in enumerate([shapes[k] for k in (0, 1, 8, 3, 4, 7)]):
        begin(1.3, 1)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 2)
        shape()
        gmsh.model.occ.synchronize()
        name(3, [tag for _, tag in gmsh.model.getEntities(3)], "part")
        gmsh.model.mesh.generate(3)
        save(os.path.join(TESTS, f"hexahedra_{number}.msh"), 2.2, 1)
        gmsh.finalize()
    # Quadrangles extruded: a disk, a drilled plate, a slanting block, a twisted one.
    for number in range(6, 10):
        begin(0.36)
        occ = gmsh.model.occ
        if number in (6, 9):
            base = occ.addDisk(0, 0, 0, 0.8, 0.6)
        else:
            base = occ.addRectangle(0, 0, 0, 1.4, 1.1)
            if number == 7:
                hole = occ.addDisk(0.6, 0.5, 0, 0.25, 0.25)
                occ.cut([(2, base)], [(2, hole)])
        occ.synchronize()
        base = gmsh.model.getEntities(2)[0][1]
        gmsh.model.mesh.setRecombine(2, base)
        if number == 9:
            out = occ.revolve([(2, base)], 1.6, 0, 0, 0, 1, 0, 0.8, numElements=[3], recombine=True)
        else:
            out = occ.extrude([(2, base)], 0.4 if number == 8 else 0, 0, 0.9, numElements=[3], recombine=True)
        occ.synchronize()
        name(3, [tag for dimension, tag in out if dimension == 3], "part")
        gmsh.model.mesh.generate(3)
        save(os.path.join(TESTS, f"hexahedra_{number}.msh"), 2.2, 1)
        gmsh.finalize()
    for file in sorted(os.listdir(TESTS)):
        if file.startswith(("tetrahedra_", "hexahedra_")):
            mesh = meshio.read(os.path.join(TESTS, file))
            print(file, len(mesh.points), {block.type: len(block.data) for block in mesh.cells})


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


def groove(name_of_file, size, quadrangles):
    """A block 2 by 1 with a half-round groove of radius 0.3 in its upper face: the example `folds` presses a shaft into it."""
    begin(size)
    points = [(0, 0), (2, 0), (2, 1), (1.3, 1), (1, 0.7), (0.7, 1), (0, 1)]
    tags = [gmsh.model.occ.addPoint(x, y, 0) for x, y in points]
    centre = gmsh.model.occ.addPoint(1, 1, 0)
    lines = []
    for k in range(len(tags)):
        start, end = tags[k], tags[(k + 1) % len(tags)]
        if k in (3, 4):
            lines.append(gmsh.model.occ.addCircleArc(start, centre, end))
        else:
            lines.append(gmsh.model.occ.addLine(start, end))
    surface = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop(lines)])
    gmsh.model.occ.synchronize()
    name(1, [lines[0]], "bottom")
    name(1, [lines[3], lines[4]], "groove")
    name(1, [lines[1], lines[6]], "sides")
    name(1, [lines[2], lines[5]], "top")
    name(2, [surface], "rubber")
    # Even sizes, so that the size alone tells the meshes apart.
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    if quadrangles:
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.model.mesh.generate(2)
    os.makedirs(os.path.join(EXAMPLES, "folds"), exist_ok=True)
    save(os.path.join(EXAMPLES, "folds", name_of_file + ".msh"))
    gmsh.finalize()


def grooves():
    """Fourteen sizes of triangles from 0.05 to 0.107 in equal ratios, and three of quadrangles."""
    for k in range(14):
        groove(f"groove_{k}", 0.05 * (0.107 / 0.05) ** (k / 13), False)
    for k, size in enumerate((0.06, 0.08, 0.1)):
        groove(f"groove_quadrangles_{k}", size, True)


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
        if not file.startswith(("plug_", "prisms", "hexahedra.", "flat")) or "second" in file:
            continue
        mesh = meshio.read(os.path.join(TESTS, file))
        for group, (tag, dimension) in sorted(mesh.field_data.items()):
            total = 0.0
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
    family()
    mount()
    bushing()
    bracket()
    cook()
    grooves()
    reference()
