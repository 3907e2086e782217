"""Meshes of tetrahedra of a cube [0, 10]³ by Gmsh, for this crate (.msh) and for dolfinx (.npz): cube_meshes.py DIR"""

import os
import sys

import gmsh
import numpy as np

os.makedirs(sys.argv[1], exist_ok=True)
for number, size in enumerate([5.0, 3.3, 2.5, 2.0, 1.6, 1.25]):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    cube = gmsh.model.occ.addBox(0, 0, 0, 10, 10, 10)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [cube], name="cube")
    for name, level in [("base", 0.0), ("top", 10.0)]:
        faces = [
            tag
            for _, tag in gmsh.model.getEntities(2)
            if all(abs(gmsh.model.getBoundingBox(2, tag)[k] - level) < 1e-5 for k in (2, 5))
        ]
        gmsh.model.addPhysicalGroup(2, faces, name=name)
    gmsh.model.mesh.generate(3)
    path = os.path.join(sys.argv[1], f"cube_{number}")
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(path + ".msh")
    tags, points, _ = gmsh.model.mesh.getNodes()
    kinds, _, corners = gmsh.model.mesh.getElements(3)
    place = {tag: k for k, tag in enumerate(tags)}
    cells = np.array([place[tag] for tag in corners[list(kinds).index(4)]]).reshape(-1, 4)
    np.savez(path + ".npz", points=points.reshape(-1, 3), cells=cells)
    print(number, size, len(tags), "nodes", len(cells), "tetrahedra")
    gmsh.finalize()
