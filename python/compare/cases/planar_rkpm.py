import rkpm

law = rkpm.ogden([(0.6, 1.8), (-0.01, -3.0)], bulk=5000, convention="abaqus")
scene = rkpm.Scene(rkpm.Block([0, 0, 0], [1, 1, 1]), law)
for axis in range(3):
    scene = scene.prescribe((axis, "min"), axis, 0)
scene = scene.prescribe((1, "max"), 1, 0).prescribe((0, "max"), 0, 1, name="move")
answer = scene.solve(particles=3).reaction("move")[0]
