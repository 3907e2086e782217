import felupe as fem
import numpy as np

mesh = fem.Rectangle(a=(0, 6), b=(0.1, 8), n=(2, 61))
field = fem.FieldContainer([fem.FieldAxisymmetric(fem.RegionQuad(mesh), dim=2)])
inner = fem.FieldContainer([fem.FieldAxisymmetric(fem.RegionQuadBoundary(mesh, mask=mesh.y == 6, ensure_3d=True), dim=2)])
boundaries = {"axial": fem.Boundary(field[0], mask=np.ones(mesh.npoints, bool), skip=(0, 1))}
umat = fem.Hyperelastic(fem.yeoh, C10=0.373, C20=-0.031, C30=0.005)
solid = fem.SolidBodyNearlyIncompressible(umat, field, bulk=1e5)
pressure = fem.SolidBodyPressure(inner)
ramp = fem.math.linsteps([0, 0.15], num=5)
step = fem.Step(items=[solid, pressure], ramp={pressure: ramp}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = field[0].values[mesh.y == 6, 1].mean()
