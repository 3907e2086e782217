import felupe as fem
import numpy as np

line = fem.mesh.Line(n=25)
phi = np.linspace(1, 0.5, 25) * np.pi / 2
curve = line.copy(points=0.3 * np.vstack([np.cos(phi), np.sin(phi)]).T)
top = line.copy(points=np.vstack([np.linspace(0, 1, 25), np.ones(25)]).T)
face = curve.fill_between(top, n=np.linspace(0, 1, 25) ** 1.3 * 2 - 1)
rect = fem.Rectangle(a=(1, 0), b=(2, 1), n=(25, 25))
mesh = fem.mesh.concatenate([face, face.mirror(normal=[-1, 1, 0]), rect]).merge_duplicate_points(decimals=6)
field = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(mesh), dim=2)])
boundaries = fem.dof.uniaxial(field, clamped=False, return_loadcase=False)
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
move = fem.math.linsteps([0, 1], num=4)
step = fem.Step(items=[solid], ramp={boundaries["move"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.force(field, solid.assemble.vector(), boundaries["move"])[0]
