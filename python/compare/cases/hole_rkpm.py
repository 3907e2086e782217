import rkpm

outline = rkpm.Outline([0.3, 0]).line("bottom", [2, 0]).line("right", [2, 1]).line("top", [0, 1])
outline = outline.line("left", [0, 0.3]).arc("hole", [0.3, 0], [0, 0], clockwise=True)
scene = rkpm.Scene(rkpm.Region(outline), rkpm.neo_hookean(0.5, bulk=500))
scene = scene.prescribe("left", 0, 0).prescribe("bottom", 1, 0).prescribe("right", 0, 1, name="move")
answer = scene.solve(spacing=0.06).reaction("move")[0]
