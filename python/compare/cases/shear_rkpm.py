import rkpm

scene = rkpm.Scene(rkpm.Block([0, 0], [4, 1]), rkpm.neo_hookean(0.5, bulk=500))
scene = scene.hold((1, "min")).move((1, "max"), [0.5, 0], name="move")
answer = scene.solve(particles=[49, 13]).reaction("move")[0]
