import rkpm

beam = rkpm.Scene(rkpm.Block([0, 0], [10, 1]), rkpm.neo_hookean(0.5, bulk=500)).hold((0, "min"))
path = beam.body_force([0, -5e-4]).solve(particles=[81, 9])
answer = path.displacement_at([10, 0])[0, 1]
