import felupe as fem
import numpy as np

mesh = fem.Cube(a=(0, -0.5, -0.5), b=(2, 0.5, 0.5), n=(8, 5, 5))
mesh = mesh.add_midpoints_edges().add_midpoints_faces().add_midpoints_volumes()
field = fem.FieldContainer([fem.Field(fem.RegionTriQuadraticHexahedron(mesh), dim=3)])
boundaries = {"fix": fem.Boundary(field[0], fx=0), "move": fem.Boundary(field[0], fx=2)}
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
face = mesh.points[boundaries["move"].points]
move = []
for angle in np.linspace(0, 1, 5)[1:]:
    move.append(fem.math.rotation_matrix(np.rad2deg(angle), axis=0) @ face.T - face.T)
step = fem.Step(items=[solid], ramp={boundaries["move"]: [u.T.ravel() for u in move]}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.moment(field, solid.assemble.vector(), boundaries["move"], centerpoint=np.array([2, 0, 0]))[0]
