"""What Python functions raise reaches the caller, once, from wherever the crate calls them; how they are called."""

import functools

import numpy as np
import pytest

import rkpm

LAW = rkpm.neo_hookean(0.5, bulk=1e3)
BLOCK = rkpm.Block([0, 0], [2, 1])
HELD = rkpm.Scene(BLOCK, LAW).hold((0, "min"))


class Law:
    """A law by a function that raises while it is `broken`."""

    def __init__(self):
        self.broken = False
        self.law = rkpm.material(self.stress, bulk=1e3, energy=self.energy)

    def check(self, F):
        # At rest it does not: laws are asked there before they are called in a run.
        if self.broken and not np.allclose(F, np.eye(3), atol=1e-4):
            raise ZeroDivisionError("on purpose")

    def stress(self, F):
        self.check(F)
        J = np.linalg.det(F)
        return J ** (-2 / 3) * (F - np.trace(F.T @ F) / 3 * np.linalg.inv(F).T)

    def energy(self, F):
        self.check(F)
        return 0.5 * (np.linalg.det(F) ** (-2 / 3) * np.trace(F.T @ F) - 3)


def wrong(*given):
    raise ZeroDivisionError("on purpose")


@pytest.mark.parametrize("stage", [
    lambda scene: scene.move((0, "max"), lambda x: wrong()),
    lambda scene: scene.move((0, "max"), lambda x, load: wrong()),
    lambda scene: scene.prescribe((0, "max"), 0, wrong),
    lambda scene: scene.pressure((0, "max"), wrong),
    lambda scene: scene.traction((0, "max"), lambda x: wrong()),
    lambda scene: scene.hold(rkpm.Place((0, "max"), within=wrong)),
    lambda scene: wrong(),
], ids=["move", "motion", "prescribe", "pressure", "traction", "place", "stage"])
def test_what_a_stage_adds_may_raise(stage):
    with pytest.raises(ZeroDivisionError, match="on purpose"):
        HELD.history({"next": stage}, particles=[5, 3])


@pytest.mark.parametrize("how", [{"particles": [5, 3]}, {"within": 0.2}])
def test_control_c_before_the_first_step_is_told_as_such(how):
    def interrupted(x):
        raise KeyboardInterrupt

    with pytest.raises(rkpm.Interrupted, match="before its first step") as found:
        HELD.move((0, "max"), interrupted).solve(**how)
    assert found.value.path is None


def test_a_scene_that_a_stage_was_given_tells_what_raises_later():
    moved = {"by": [0.1, 0]}
    given = []

    def later(scene):
        given.append(scene)
        return scene.without("pull")

    def motion(x):
        return moved["by"] or wrong()

    HELD.move((0, "max"), motion, name="pull").history({"next": later}, particles=[5, 3])
    moved["by"] = None
    with pytest.raises(ZeroDivisionError, match="on purpose"):
        given[0].solve(particles=[5, 3])


@pytest.mark.parametrize("result", [
    lambda path: path.energy,
    lambda path: path.cauchy,
    lambda path: path.cauchy_at([[1.0, 0.5]]),
    lambda path: path.plot("von Mises stress"),
], ids=["energy", "cauchy", "cauchy_at", "plot"])
def test_a_law_may_raise_in_a_result_and_is_then_forgotten(result):
    own = Law()
    scene = rkpm.Scene(BLOCK, own.law).hold((0, "min")).move((0, "max"), [0.2, 0])
    path = scene.solve(particles=[5, 3])
    own.broken = True
    with pytest.raises(ZeroDivisionError, match="on purpose"):
        result(path)
    own.broken = False
    assert scene.solve(particles=[5, 3]).energy[-1] == path.energy[-1] > 0
    result(path)


def test_a_law_may_raise_in_the_results_of_stages():
    own = Law()
    scene = rkpm.Scene(BLOCK, own.law).hold((0, "min")).move((0, "max"), [0.1, 0], name="pull")
    first, second = scene.history({"on": lambda scene: scene}, particles=[5, 3])
    own.broken = True
    for path in (first, second):
        with pytest.raises(ZeroDivisionError, match="on purpose"):
            path.energy


def test_results_leave_the_interpreter_free_for_the_law():
    own = Law()
    scene = rkpm.Scene(BLOCK, own.law).hold((0, "min")).move((0, "max"), [0.2, 0], name="pull")
    path = scene.solve(particles=[9, 5])
    assert path.doubts == [] and path.moment("pull", [0, 0]).shape == (3,) and path.points.shape == (45, 2)


def test_two_laws_that_raise_are_both_forgotten():
    lower, upper = Law(), Law()
    scene = rkpm.Scene(kinematics="plane strain").body("lower", BLOCK, lower.law)
    scene = scene.body("upper", rkpm.Block([0, 1], [2, 2]), upper.law).hold(rkpm.Place((1, "min"), of="lower"))
    scene = scene.move(rkpm.Place((1, "max"), of="upper"), [0.1, 0])
    lower.broken = upper.broken = True
    with pytest.raises(ZeroDivisionError, match="on purpose"):
        scene.solve(particles=[5, 3])
    lower.broken = upper.broken = False
    assert scene.solve(particles=[5, 3]).ending == "completed"


def test_a_place_within_is_where_results_are_asked_for():
    end = rkpm.Place((0, "max"), within=lambda x: x[1] > 0.4)
    path = HELD.move(end, [0.2, 0], name="pull").solve(particles=[9, 5])
    assert path.reaction(end)[0] == path.reaction("pull")[0] > 0
    assert path.force(end) == pytest.approx(path.force("pull"))
    assert path.moment(end, [0, 0]) == pytest.approx(path.moment("pull", [0, 0]))
    found = HELD.move(end, [0.2, 0]).solve(within=0.2, of=("force", end, 0))
    assert found.reaction(end)[0] > 0


def test_a_place_within_that_raises_gives_no_result():
    broken = []
    end = rkpm.Place((0, "max"), within=lambda x: wrong() if broken else x[1] > 0.4)
    scene = HELD.move(end, [0.2, 0])
    path = scene.solve(particles=[9, 5])
    force = path.reaction(end)
    broken.append(True)
    # Where conditions act was found before.
    assert path.reaction(end) == pytest.approx(force, abs=0)
    for how in ({"particles": [9, 5]}, {"within": 0.2, "of": ("force", end, 0)}):
        with pytest.raises(ZeroDivisionError, match="on purpose"):
            scene.solve(**how)
    # A place of which the scene knows nothing is refused, not taken for an empty one.
    for call in (path.reaction, path.force, lambda place: path.moment(place, [0, 0])):
        with pytest.raises(rkpm.Error, match="no condition|condition"):
            call(rkpm.Place((0, "max"), within=wrong))


class Moves:
    def field(self, x):
        return [0.2, 0 * x[1]]

    def motion(self, x, load):
        return [0.2 * load, 0 * x[1]]

    @staticmethod
    def fixed(x, load):
        return [0.2 * load, 0]

    def __call__(self, x, load):
        return [0.2 * load, 0]


def scaled(by, x, load):
    return [by * load, 0]


@pytest.mark.parametrize("by", [
    Moves().field,
    Moves().motion,
    Moves.fixed,
    Moves(),
    lambda x, size=0.2: [size, 0],
    lambda x, load, size=0.2: [size * load, 0],
    lambda x, *, size=0.2: [size, 0],
    lambda *given: [0.2, 0],
    functools.partial(scaled, 0.2),
    functools.partial(Moves().motion, load=1.0),
], ids=["method", "method of load", "static method", "object", "default", "load and default", "keyword", "any", "partial", "all but X"])
def test_a_motion_is_a_function_that_needs_the_load_factor(by):
    expected = HELD.move((0, "max"), [0.2, 0], name="pull").solve(particles=[5, 3]).reaction("pull")
    found = HELD.move((0, "max"), by, name="pull").solve(particles=[5, 3]).reaction("pull")
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)
