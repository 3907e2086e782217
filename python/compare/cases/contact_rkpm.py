import rkpm

quarter = rkpm.Outline([0, 0]).line("bottom", [1, 0]).arc("outer", [0, 1], [0, 0]).close("left")
scene = rkpm.Scene(rkpm.Region(quarter), rkpm.neo_hookean(0.5, bulk=500))
scene = scene.prescribe("left", 0, 0).prescribe("bottom", 1, 0, name="bottom")
path = scene.contact("outer", "plate", plane=([0, 1], [0, -1]), move_by=[0, -0.2]).solve(spacing=0.05)
answer = path.contact("plate")["force"][1]
