import felupe as fem
import numpy as np

mesh = fem.Circle(radius=1, n=21, sections=[0])  # a quarter of a roller
mesh.update(points=np.vstack([mesh.points, [0, 1]]))
mesh.points_without_cells = mesh.points_without_cells[:0]
field = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(mesh), dim=2)])
centre = mesh.npoints - 1
boundaries = {
    "left": fem.Boundary(field[0], fx=0, skip=(0, 1)),
    "bottom": fem.Boundary(field[0], fy=0, skip=(1, 0)),
    "plate": fem.Boundary(field[0], mask=np.arange(mesh.npoints) == centre, skip=(0, 1)),
    "move": fem.Boundary(field[0], mask=np.arange(mesh.npoints) == centre, skip=(1, 0)),
}
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
outer = np.flatnonzero(np.isclose(np.linalg.norm(mesh.points, axis=1), 1))[:-1]
plate = fem.ContactRigidPlane(field, outer, centre, normal=[0, -1], multiplier=10, items=[solid])
move = fem.math.linsteps([0, -0.2], num=10)
step = fem.Step(items=[solid, plate], ramp={boundaries["move"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = -fem.tools.force(field, solid.assemble.vector(), boundaries["bottom"])[1]
