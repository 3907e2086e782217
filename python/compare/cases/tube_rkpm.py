import rkpm

tube = rkpm.Scene(rkpm.Block([6], [8]), rkpm.yeoh(0.373, -0.031, 0.005, bulk=1e5), "radial cylinder")
path = tube.pressure("min", 0.15).solve(particles=9)
answer = path.displacement_at([[6]])[0, 0]
