import felupe as fem

mesh = fem.Rectangle(a=(0, 10), b=(40, 20), n=(81, 21))  # along the axis, then the radius
field = fem.FieldContainer([fem.FieldAxisymmetric(fem.RegionQuad(mesh), dim=2)])
boundaries = {
    "outer": fem.Boundary(field[0], fy=20),
    "inner": fem.Boundary(field[0], fy=10, skip=(1, 0)),
    "move": fem.Boundary(field[0], fy=10, skip=(0, 1)),
}
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
move = fem.math.linsteps([0, 5], num=2)
step = fem.Step(items=[solid], ramp={boundaries["move"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.force(field, solid.assemble.vector(), boundaries["move"])[0]
