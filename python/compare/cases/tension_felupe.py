import felupe as fem

mesh = fem.Cube(n=3)
field = fem.FieldContainer([fem.Field(fem.RegionHexahedron(mesh), dim=3)])
boundaries = fem.dof.uniaxial(field, clamped=False, return_loadcase=False)
umat = fem.Hyperelastic(fem.yeoh, C10=0.5, C20=-0.05, C30=0.02)
solid = fem.SolidBodyNearlyIncompressible(umat, field, bulk=5000)
move = fem.math.linsteps([0, 1.5], num=6)
step = fem.Step(items=[solid], ramp={boundaries["move"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.force(field, solid.assemble.vector(), boundaries["move"])[0]
