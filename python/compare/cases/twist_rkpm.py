import numpy as np
import rkpm


def turn(x, angle):
    c, s = np.cos(angle), np.sin(angle)
    return [0, c * x[1] - s * x[2] - x[1], s * x[1] + c * x[2] - x[2]]


column = rkpm.Scene(rkpm.Block([0, -0.5, -0.5], [2, 0.5, 0.5]), rkpm.neo_hookean(0.5, bulk=500))
column = column.hold((0, "min")).move((0, "max"), turn, name="move")
path = column.solve(particles=[15, 9, 9], order=2, elements=True)
answer = path.moment("move", [2, 0, 0])[0]
