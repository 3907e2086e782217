import felupe as fem

mesh = fem.Cube(n=3)
field = fem.FieldContainer([fem.Field(fem.RegionHexahedron(mesh), dim=3)])
boundaries = fem.dof.biaxial(field, moves=(0, 0), return_loadcase=False)
umat = fem.Hyperelastic(fem.ogden, mu=[0.6, -0.01], alpha=[1.8, -3.0])
solid = fem.SolidBodyNearlyIncompressible(umat, field, bulk=5000)
move = fem.math.linsteps([0, 1], num=5)
step = fem.Step(items=[solid], ramp={boundaries["move-right-0"]: move}, boundaries=boundaries)
fem.Job(steps=[step]).evaluate(verbose=False)
answer = fem.tools.force(field, solid.assemble.vector(), boundaries["move-right-0"])[0]
