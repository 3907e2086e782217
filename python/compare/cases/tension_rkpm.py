import rkpm

scene = rkpm.Scene(rkpm.Block([0, 0, 0], [1, 1, 1]), rkpm.yeoh(0.5, -0.05, 0.02, bulk=5000))
for axis in range(3):
    scene = scene.prescribe((axis, "min"), axis, 0)
path = scene.prescribe((0, "max"), 0, 1.5, name="move").solve(particles=3)
answer = path.reaction("move")[0]
