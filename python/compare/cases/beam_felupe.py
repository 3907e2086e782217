import felupe as fem

mesh = fem.Rectangle(b=(10, 1), n=(121, 13))
field = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(mesh), dim=2)])
boundaries = {"clamp": fem.Boundary(field[0], fx=0)}
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
weight = fem.SolidBodyForce(field)
ramp = fem.math.linsteps([0, 1], num=10, axis=1, axes=2) * -5e-4
step = fem.Step(items=[solid, weight], ramp={weight: ramp}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = field[0].values[(mesh.x == 10) & (mesh.y == 0), 1][0]
