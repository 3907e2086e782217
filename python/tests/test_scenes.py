"""Scenes beside closed forms, and what paths tell of them."""

import numpy as np
import pytest

import rkpm

LAW = rkpm.neo_hookean(0.5, bulk=1e5)


def sheared(**how):
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), rkpm.neo_hookean(0.5, bulk=1e3))
    return scene.hold((1, "min")).move((1, "max"), [0.4, 0], name="push").solve(**(how or {"particles": [9, 5]}))


def test_tube_beside_the_exact_solution():
    tube = rkpm.Scene(rkpm.Block([6], [8]), rkpm.yeoh(0.373, -0.031, 0.005, bulk=1e5)).pressure("min", 0.46)
    path = tube.solve(particles=9)
    assert path.displacement_at([[6.0]])[0, 0] == pytest.approx(15.0023846431, rel=5e-6)
    assert path.energy[-1] == pytest.approx(2 * np.pi * 45.7940, rel=1e-5)


@pytest.mark.parametrize("kinematics, exact", [("plane strain", 2.0 - 0.125), ("plane stress", 2.0 - 0.25)])
def test_tension_of_a_sheet(kinematics, exact):
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), LAW, kinematics)
    scene = scene.prescribe((0, "min"), 0, 0).prescribe((1, "min"), 1, 0).prescribe((0, "max"), 0, 2.0, name="pull")
    assert scene.solve(particles=[5, 3]).reaction("pull")[0] == pytest.approx(exact, rel=1e-4)


def test_tension_in_space():
    scene = rkpm.Scene(rkpm.Block([0, 0, 0], [1, 1, 1]), LAW)
    for axis in range(3):
        scene = scene.prescribe((axis, "min"), axis, 0)
    path = scene.prescribe((0, "max"), 0, 1.0, name="pull").solve(particles=3)
    assert path.reaction("pull")[0] == pytest.approx(2 - 0.25, rel=1e-4)
    assert path.stretch == pytest.approx(2.0, rel=1e-4)
    assert path.gradient[:, 0, 0] == pytest.approx(2.0, rel=1e-6)
    assert path.cauchy[:, 0, 0] == pytest.approx(4 - 0.5, rel=1e-3)


def test_states_are_a_sequence_with_the_one_at_rest_first():
    path = sheared(particles=[9, 5], steps=4)
    assert len(path) == 5 and list(path.load) == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    assert not path[0].displacement.any() and path[-1].displacement.any()
    assert path.force("push").shape == (5, 2)
    assert path.force("push")[2] == pytest.approx(path[2].reaction("push"))
    with pytest.raises(IndexError):
        path[5]
    assert [state.ending for state in path] == ["completed"] * 5


def test_arrays_have_a_row_for_each_particle():
    path = sheared()
    assert path.points.shape == path.displacement.shape == (45, 2)
    assert path.cauchy.shape == path.gradient.shape == (45, 3, 3)
    assert path.displacement_at(path.points) == pytest.approx(path.displacement)
    assert path.cauchy_at([1.0, 0.5]).shape == (1, 3, 3)
    assert path.moment("push", [0, 0]).shape == (3,)


def test_forces_balance():
    path = sheared()
    assert path.reaction("push") + path.reaction((1, "min")) == pytest.approx(0, abs=1e-9)


def test_functions_of_position_prescribe_and_load():
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), LAW)
    by_number = scene.hold((0, "min")).traction((0, "max"), [0, 0.01])
    by_function = scene.move((0, "min"), lambda x: [0 * x[0], 0]).traction((0, "max"), lambda x: [0, 0.01])
    a, b = by_number.solve(particles=[9, 5]), by_function.solve(particles=[9, 5])
    assert b.displacement == pytest.approx(a.displacement, abs=1e-10)


def test_a_motion_turns_a_face():
    def turn(x, load):
        c, s = np.cos(load), np.sin(load)
        return [0, c * x[1] - s * x[2] - x[1], s * x[1] + c * x[2] - x[2]]

    scene = rkpm.Scene(rkpm.Block([0, -0.5, -0.5], [2, 0.5, 0.5]), LAW).hold((0, "min")).move((0, "max"), turn, name="turn")
    path = scene.solve(particles=[7, 4, 4])
    assert path.moment("turn", [2, 0, 0])[0] > 0.05


def test_a_rigid_plate_carries_a_load():
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 2]), rkpm.neo_hookean(0.5, bulk=1e3)).hold((1, "min")).rigid("plate", (1, "max"))
    path = scene.force("plate", [0.1, -0.1]).solve(particles=[9, 9])
    assert path.reaction("plate") == pytest.approx([0.1, -0.1], abs=1e-9)


def test_contact_with_a_plane_tells_forces_pressures_and_width():
    outline = rkpm.Outline([0, 0]).line("equator", [0.2, 0]).arc("outer", [0, 0.2], [0, 0]).close("axis")
    scene = rkpm.Scene(rkpm.Region(outline), rkpm.mooney_rivlin(0.293, 0.177, bulk=1410))
    scene = scene.prescribe("equator", 1, 0).prescribe("axis", 0, 0)
    path = scene.contact("outer", "plate", plane=([0, 0.2], [0, -1]), move_by=[0, -0.025]).solve(particles=8)
    told = path.contact("plate")
    assert told["force"][1] < 0 and 0.04 < told["extent"] < 0.1
    assert path.reaction("plate") == pytest.approx(told["force"])
    assert told["pressure"].min() >= 0 and len(told["points"]) == len(told["gap"])


def test_bodies_are_bonded_and_named():
    law, steel = rkpm.neo_hookean(0.5, bulk=1e3), rkpm.neo_hookean(40e3, bulk=175e3)
    scene = rkpm.Scene(kinematics="plane strain").body("rubber", rkpm.Block([0, 1], [20, 5]), law, particles=[21, 5])
    scene = scene.body("lower", rkpm.Block([0, 0], [20, 1]), steel).body("upper", rkpm.Block([0, 5], [20, 6]), steel)
    scene = scene.hold(rkpm.Place((1, "min"), of="lower")).move(rkpm.Place((1, "max"), of="upper"), [2, 0], name="shear")
    assert scene.solve(particles=[11, 3]).reaction("shear")[0] == pytest.approx(10, rel=0.1)


def test_a_press_fit_of_two_bodies():
    law = rkpm.neo_hookean(0.5, bulk=500)
    top, bottom = (1, "max"), (1, "min")
    scene = rkpm.Scene(kinematics="plane strain").body("lower", rkpm.Block([0, 0], [1, 1]), law)
    scene = scene.body("upper", rkpm.Block([0, 0.9], [1, 1.9]), law)
    scene = scene.prescribe(rkpm.Place(bottom, of="lower"), 1, 0).prescribe(rkpm.Place(top, of="upper"), 1, 0)
    # Without friction blocks that nothing holds sideways slip off each other.
    for body in ("lower", "upper"):
        scene = scene.prescribe(rkpm.Place((0, "min"), of=body), 0, 0)
    scene = scene.contact_between(rkpm.Place(top, of="lower"), rkpm.Place(bottom, of="upper"), "fit", fit=True)
    assert scene.solve(particles=4).contact("fit")["force"][1] < -0.05


def test_stages_end_where_nothing_is_left():
    pad = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), rkpm.neo_hookean(0.5, bulk=500)).hold((1, "min"))
    pad = pad.traction((1, "max"), [0, -0.1], name="press")
    stages = {
        "shear": lambda scene: scene.without("press").move((1, "max"), [0.2, -0.05], name="plate"),
        "release": lambda scene: scene.without("plate"),
    }
    pressed, moved, released = pad.history(stages, particles=[5, 3])
    assert pressed.displacement[:, 1].min() < -0.02 and moved.reaction("plate")[0] > 0.05
    assert released.displacement == pytest.approx(0, abs=1e-8)


def test_laws_relax_over_time():
    law = rkpm.neo_hookean(0.5, bulk=1e3).relaxing([(0.4, 2.0)])
    pad = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), law).hold((1, "min"))
    pad = pad.move((1, "max"), [0.2, 0], name="push", over=[(0, 0), (0.1, 1), (1, 1)]).over_time(10)
    force = pad.solve(particles=[5, 3]).force("push")[:, 0]
    assert 0.6 < force[-1] / force.max() < 0.8


def test_a_tolerance_is_met_and_told():
    scene = rkpm.Scene(rkpm.Block([0, 0], [40, 10]), rkpm.neo_hookean(0.5, bulk=1e3))
    path = scene.hold((1, "min")).move((1, "max"), [5, 0], name="push").solve(within=0.02, of=("force", "push", 0))
    assert 0 < path.bound <= 0.02 and sheared().bound is None and sheared().value is None
    assert abs(path.value / path.reaction("push")[0] - 1) < 0.2


def test_models_within_a_tolerance_follow_the_settings():
    def loads(**how):
        seen = []
        sheared(within=0.05, progress=lambda load, iterations: seen.append(load), **how)
        return seen

    assert loads(steps=4)[:4] == pytest.approx([0.25, 0.5, 0.75, 1])
    assert loads(steps=3, dilation=1.2)[:3] == pytest.approx([1 / 3, 2 / 3, 1])
    plain, arc = loads(), loads(arc_length=True)
    assert arc != plain and arc[-1] == pytest.approx(1)


def test_a_seed_is_no_hindrance_to_elements():
    assert sheared(within=0.05, seed=3).displacement == pytest.approx(sheared(within=0.05).displacement, abs=0)


def test_order_and_elements_come_to_the_same_force():
    linear, quadratic = sheared(particles=[17, 9]), sheared(particles=[17, 9], order=2)
    elements = sheared(particles=[17, 9], order=2, elements=True)
    assert quadratic.reaction("push")[0] == pytest.approx(linear.reaction("push")[0], rel=0.01)
    assert elements.reaction("push")[0] == pytest.approx(linear.reaction("push")[0], rel=0.01)


def test_expansion_foundation_and_body_force():
    block = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), rkpm.neo_hookean(0.5, bulk=1e3))
    walls = block.prescribe((0, "min"), 0, 0).prescribe((0, "max"), 0, 0).prescribe((1, "min"), 1, 0)
    assert walls.expansion(1.02).solve(particles=[5, 3]).displacement_at([1, 1])[0, 1] == pytest.approx(0.0612, abs=1e-3)
    sunk = block.foundation((1, "min"), 5.0).prescribe((0, "min"), 0, 0).body_force([0, -0.01]).solve(particles=[5, 3])
    assert sunk.displacement_at([1, 0])[0, 1] == pytest.approx(-0.002, rel=0.02)


def test_a_solid_of_a_shape_and_its_parts():
    bush = rkpm.Shape.cylinder([0, 0, 0], [0, 0, 2], 2).named("outside") - rkpm.Shape.block([-1, -1, -1], [1, 1, 3])
    solid = rkpm.Solid.shape(bush, 0.5).name("base", plane=([0, 0, 0], [0, 0, -1]))
    assert solid.volume == pytest.approx(2 * (4 * np.pi - 4), rel=0.02)
    assert {"outside", "base"} <= set(solid.names)


def test_a_mesh_of_arrays():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    groups = {"rubber": {"tetra": [0]}, "base": {"triangle": [0]}}
    mesh = rkpm.Mesh(points, {"tetra": [[0, 1, 2, 3]], "triangle": [[0, 2, 1]]}, groups)
    # The number behind the last of a shape is not the first of the next one.
    for cells in ({"triangle": [[0, 2, 1]], "tetra": [[0, 1, 2, 3]]}, {"tetra": [[0, 1, 2, 3]], "triangle": [[0, 2, 1]]}):
        for shape in cells:
            with pytest.raises(rkpm.Error, match="does not exist"):
                rkpm.Mesh(points, cells, {"wrong": {shape: [1]}})
    assert mesh.volume == pytest.approx(1 / 6) and set(mesh.names) == {"rubber", "base"}


def test_a_mesh_of_meshio_is_that_of_the_file():
    meshio = pytest.importorskip("meshio")
    square = np.array([[x, y] for y in np.linspace(0, 1, 9) for x in np.linspace(0, 1, 9)])
    quads = [[9 * j + i, 9 * j + i + 1, 9 * j + i + 10, 9 * j + i + 9] for j in range(8) for i in range(8)]
    edges = [[row + i, row + i + 1] for row in (0, 72) for i in range(8)]
    given = meshio.Mesh(square, [("quad", quads), ("line", edges)],
                        cell_sets={"low": [np.array([], int), np.arange(8)], "high": [np.array([], int), np.arange(8, 16)]})
    scene = rkpm.Scene(rkpm.Mesh.of(given), rkpm.neo_hookean(0.5, bulk=1e3)).hold("low").move("high", [0.2, 0], name="push")
    block = rkpm.Scene(rkpm.Block([0, 0], [1, 1]), rkpm.neo_hookean(0.5, bulk=1e3)).hold((1, "min"))
    force = block.move((1, "max"), [0.2, 0], name="push").solve(particles=9).reaction("push")[0]
    assert scene.solve().reaction("push")[0] == pytest.approx(force, rel=0.01)


def test_cells_of_second_order_are_taken_by_their_corners():
    meshio = pytest.importorskip("meshio")
    corners, middles = [[0, 0], [1, 0], [1, 1], [0, 1]], [[0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5], [0.5, 0.5]]
    cells = [("triangle6", np.array([[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]])), ("line3", np.array([[0, 1, 4]]))]
    given = meshio.Mesh(np.array(corners + middles), cells, cell_sets={"low": [np.array([], int), np.array([0])]})
    mesh = rkpm.Mesh.of(given)
    assert mesh.volume == pytest.approx(1) and mesh.names == ["low"]
    scene = rkpm.Scene(mesh, rkpm.neo_hookean(0.5, bulk=10)).hold("low").body_force([0.01, 0])
    assert scene.solve().points == pytest.approx(np.array(corners, float))


def test_parts_may_be_named_like_the_ends_of_a_bar():
    outline = rkpm.Outline([0, 0]).line("min", [2, 0]).line("right", [2, 1]).line("max", [0, 1]).close("left")
    scene = rkpm.Scene(rkpm.Region(outline), rkpm.neo_hookean(0.5, bulk=1e3)).hold("min").move("max", [0.2, 0])
    moved = scene.solve(spacing=0.25).displacement_at([[1.0, 1.0], [1.0, 0.0]])[:, 0]
    assert moved == pytest.approx([0.2, 0], abs=1e-2)


def test_files_and_pictures(tmp_path):
    path = sheared()
    path.write(tmp_path / "pad.pvd")
    assert (tmp_path / "pad_0001.vtu").exists() and (tmp_path / "pad.csv").exists()
    picture = path.plot("largest stretch", title="A pad")
    picture.save(tmp_path / "pad.png")
    assert (tmp_path / "pad.png").read_bytes()[:4] == b"\x89PNG"
    assert picture._repr_svg_().startswith("<svg") and path._repr_svg_().startswith("<svg")
    assert "90 unknowns" in repr(path)
