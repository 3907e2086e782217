import rkpm

bush = rkpm.Scene(rkpm.Block([10, 0], [20, 40]), rkpm.neo_hookean(0.5, bulk=500), "axisymmetric")
bush = bush.hold((0, "max")).move((0, "min"), [0, 5], name="move")
answer = bush.solve(particles=[13, 49]).reaction("move")[1]
