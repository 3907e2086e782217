import rkpm

scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), rkpm.neo_hookean(0.5, bulk=500))
scene = scene.hold((0, "min")).move((0, "max"), [1, 0], name="move")
answer = scene.solve(particles=[33, 17]).reaction("move")[0]
