import felupe as fem

mesh = fem.Rectangle(b=(2, 1), n=(81, 41))
field = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(mesh), dim=2)])
boundaries = fem.dof.uniaxial(field, clamped=True, sym=False, return_loadcase=False)
solid = fem.SolidBodyNearlyIncompressible(fem.NeoHooke(mu=1), field, bulk=500)
move = fem.math.linsteps([0, 1], num=4)
step = fem.Step(items=[solid], ramp={boundaries["move"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.force(field, solid.assemble.vector(), boundaries["move"])[0]
