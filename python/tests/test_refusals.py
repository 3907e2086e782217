"""What can't be is an exception with the words of the crate, a run that ends early keeps its path, and nothing crashes."""

import os
import random
import signal
import threading

import numpy as np
import pytest

import rkpm

LAW = rkpm.neo_hookean(0.5, bulk=1e3)
BLOCK = rkpm.Block([0, 0], [2, 1])
SCENE = rkpm.Scene(BLOCK, LAW).hold((0, "min")).move((0, "max"), [0.5, 0], name="pull")


@pytest.mark.parametrize("call, words", [
    (lambda: rkpm.neo_hookean(-1.0, bulk=1e3), "modulus|constant"),
    (lambda: rkpm.neo_hookean(0.5, bulk=-1.0), "bulk"),
    (lambda: rkpm.ogden([], bulk=1.0), "modulus"),
    (lambda: rkpm.ogden([(1, 1)], bulk=1.0, convention="other"), "convention"),
    (lambda: rkpm.Block([0, 0], [1]), "corners"),
    (lambda: rkpm.Scene(rkpm.Block([0, 0], [0, 1]), LAW).hold("x").solve(), "extent|empty|block|side|positive"),
    (lambda: rkpm.Scene(BLOCK, LAW, "solid"), "dimensions"),
    (lambda: rkpm.Scene(BLOCK, LAW, "plane"), "no kinematics"),
    (lambda: SCENE.hold("base").solve(), "base"),
    (lambda: SCENE.move((0, "max"), [1, 2, 3]), "3 components, give 2"),
    (lambda: SCENE.hold((0, "up")), "no end of an axis"),
    (lambda: SCENE.hold((7, "min")).solve(), "axis|face"),
    (lambda: SCENE.pressure((1, "max"), float("nan")).solve(), "NaN|finite"),
    (lambda: SCENE.prescribe((1, "max"), 5, 0.0).solve(), "component"),
    (lambda: SCENE.solve(particles=5, spacing=0.1), "not both"),
    (lambda: SCENE.solve(particles=1), "at least 2"),
    (lambda: SCENE.solve(particles=[5, 5, 5]), "3"),
    (lambda: SCENE.solve(spacing=-1.0), "spacing"),
    (lambda: SCENE.solve(steps=0), "at least one"),
    (lambda: SCENE.solve(order=99), "basis has 5050 terms"),
    (lambda: SCENE.solve(within=2.0), "between 0 and 1|tolerance"),
    (lambda: SCENE.solve(within=0.1, of="speed"), "of: give"),
    (lambda: SCENE.solve(within=0.1, of=("force", "pull", 9)), "component"),
    (lambda: SCENE.without("push").solve(), "push"),
    (lambda: SCENE.solve(particles=5).reaction("push"), "push"),
    (lambda: SCENE.solve(particles=5).contact("plate"), "plate"),
    (lambda: SCENE.solve(particles=5).plot("colour"), "no field"),
    (lambda: SCENE.solve(particles=5).displacement_at([[9.0, 9.0]]), "9"),
    (lambda: SCENE.solve(particles=5).displacement_at([[1.0, 1.0, 1.0]]), "rows of 2"),
    (lambda: rkpm.Mesh.read("/nowhere.msh"), "nowhere"),
    (lambda: rkpm.Solid.stl("/nowhere.stl"), "nowhere"),
    (lambda: rkpm.Mesh([[0, 0]], {"hexagon": [[0]]}), "no cells"),
    (lambda: rkpm.Mesh([[0, 0], [1, 0], [0, 1]], {"triangle": [[0, 1, 7]]}), "7|exist"),
    (lambda: rkpm.Mesh(np.eye(4), {"triangle": [[0, 1, 2, 3]] * 3}), "4 corners, give 3"),
    (lambda: rkpm.Mesh(np.eye(3), {"triangle": [[0, 1, 2]]}), "surface in space"),
    (lambda: SCENE.body("other", BLOCK, LAW, particles=5, spacing=0.1), "not both"),
    (lambda: SCENE.solve(particles=5, of="energy"), "within"),
    (lambda: rkpm.Region(rkpm.Outline([0, 0]).line("a", [1, 0])), "outline|closed|close"),
    (lambda: rkpm.fit({"uniaxial": ([1.1, 1.2], [0.1])}), "as many"),
    (lambda: rkpm.fit({"sideways": ([1.1], [0.1])}), "no test"),
    (lambda: rkpm.fit("mode,stretch\n"), "column|stress"),
    (lambda: rkpm.fit({"uniaxial": ([1.1, 1.2], [0.1, 0.2])}, "yeoh", terms=5), "yeoh has no number of terms"),
    (lambda: rkpm.Scene(BLOCK, LAW, "plane strain", thickness=5.0), "thickness in plane strain"),
    (lambda: rkpm.energy("mu/2*(I1 - 3)", mu=0.8, c=0.1, bulk=1e3), "no constant c"),
    (lambda: rkpm.energy("exp(I1 - 3)", exp=2.0, bulk=1e3), "no constant exp"),
    (lambda: SCENE.hold("min").solve(particles=5), "min"),
    (lambda: rkpm.Mesh(np.eye(4), {"triangle6": [[0, 1, 2]]}), "3 corners, give 6"),
    (lambda: rkpm.Mesh(np.eye(4), {"triangle2": [[0, 1, 2]]}), "no cells"),
    (lambda: rkpm.shape_functions([[0.0, 0]], [[0.0, 0]], 1.0, order=40), "particles"),
])
def test_is_refused_by_name(call, words):
    with pytest.raises(rkpm.Error, match=f"(?i){words}"):
        call()


@pytest.mark.parametrize("call", [
    lambda: rkpm.Scene(BLOCK),
    lambda: rkpm.Scene("block", LAW),
    lambda: SCENE.hold(3.5),
    lambda: SCENE.contact("outer", "plate"),
    lambda: SCENE.pressure((1, "max"), "much"),
    lambda: SCENE.history({"next": 3}),
    lambda: rkpm.Place("base", at=[0, 0]),
    lambda: rkpm.material(3.0),
    lambda: rkpm.fit(3.0),
    lambda: rkpm.Mesh.of(3.0),
    lambda: SCENE.solve(particles="many"),
    lambda: SCENE.contact_between("outer", None, "fit", fit=True),
    lambda: rkpm.Mesh([[0, 0], [1, 0], [0, 1]], {"triangle": [[0, 1.5, 2]]}),
    lambda: rkpm.Mesh([[0, 0], [1, 0], [0, 1j]], {"triangle": [[0, 1, 2]]}),
    lambda: rkpm.Mesh([[0, 0], [1, 0], [0, 1]], {"triangle": [[0, 1, 2]]}, {"all": {"triangle": [True]}}),
])
def test_other_types_are_type_errors(call):
    with pytest.raises(TypeError):
        call()


def test_a_stalled_run_keeps_its_path():
    chains = rkpm.gent(0.5, 1.0, bulk=1e3)
    scene = rkpm.Scene(BLOCK, chains).hold((0, "min")).move((0, "max"), [4, 0])
    with pytest.raises(rkpm.Error, match="strained beyond its range") as stalled:
        scene.solve(particles=[5, 3])
    path = stalled.value.path
    assert path.ending == "stalled" and path.load[-1] < 1 and len(scene.path) == len(path)


def test_a_stage_that_stalls_keeps_the_paths_of_all():
    scene = rkpm.Scene(BLOCK, rkpm.gent(0.5, 1.0, bulk=1e3)).hold((0, "min")).move((0, "max"), [0.1, 0], name="pull")
    # Any name will do, the one that the scene itself goes by inside too.
    stages = {"first": lambda scene: scene, "too far": lambda scene: scene.without("pull").move((0, "max"), [4, 0])}
    with pytest.raises(rkpm.Error, match="strained beyond its range") as stalled:
        scene.history(stages, particles=[5, 3])
    assert [path.ending for path in stalled.value.paths] == ["completed", "completed", "stalled"]
    assert stalled.value.paths[-1] is stalled.value.path


def test_a_stage_that_cannot_begin_keeps_the_paths_before():
    scene = rkpm.Scene(BLOCK, LAW).hold((0, "min")).move((0, "max"), [0.1, 0], name="pull")
    with pytest.raises(rkpm.Error, match="nowhere") as refused:
        scene.history({"next": lambda scene: scene.hold("nowhere")}, particles=[5, 3])
    assert [path.ending for path in refused.value.paths] == ["completed"]
    assert refused.value.paths[-1] is refused.value.path is scene.path

    def fails(scene):
        raise ValueError("mine")
    with pytest.raises(ValueError, match="mine") as raised:
        scene.history({"next": fails}, particles=[5, 3])
    assert raised.value.paths[0].ending == "completed"


def test_an_unstable_state_is_refused_and_keeps_its_path():
    column = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), LAW).prescribe((0, "min"), 0, 0).prescribe((1, "min"), 1, 0)
    with pytest.raises(rkpm.Error, match="unstable modes") as refused:
        column.prescribe((0, "max"), 0, -1.4).solve(particles=[17, 9], steps=4)
    path = refused.value.path
    assert path.ending == "completed" and path.load[-1] == 1
    assert any("unstable modes" in doubt for doubt in path.doubts)


@pytest.fixture
def control_c():
    """Control-C as in a terminal: a shell that starts a job in the background has it ignore the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_control_c_keeps_the_path(control_c):
    scene = rkpm.Scene(BLOCK, LAW).hold((0, "min")).move((0, "max"), [0.5, 0])

    def stop(load, iterations):
        if load > 0.45:
            thread = threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGINT))
            thread.start()
            thread.join()

    with pytest.raises(rkpm.Interrupted) as interrupted:
        scene.solve(particles=[9, 5], steps=10, progress=stop)
    path = interrupted.value.path
    assert path.ending == "stopped" and 0.45 < path.load[-1] < 1 and len(scene.path) == len(path)
    assert isinstance(interrupted.value, KeyboardInterrupt)


def test_progress_is_printed_or_called(capsys):
    SCENE.solve(particles=5, steps=2, progress=True)
    assert capsys.readouterr().out.count("load factor") == 2
    seen = []
    SCENE.solve(particles=5, steps=2, progress=lambda load, iterations: seen.append(load))
    assert seen == pytest.approx([0.5, 1.0])
    with pytest.raises(ZeroDivisionError):
        SCENE.solve(particles=5, progress=lambda load, iterations: 1 / 0)


def test_the_interpreter_is_free_while_solving():
    ticks, done = [], threading.Event()

    def count():
        while not done.wait(0.001):
            ticks.append(1)

    counter = threading.Thread(target=count)
    counter.start()
    scene = rkpm.Scene(rkpm.Block([0, 0, 0], [1, 1, 1]), LAW).hold((2, "min")).move((2, "max"), [0.3, 0, 0])
    before = len(ticks)
    scene.solve(particles=9)
    during = len(ticks) - before
    done.set()
    counter.join()
    assert during > 3


def test_ten_thousand_drawn_calls_do_not_crash():
    """Each call is answered or refused by an exception of Python; small scenes are solved."""
    draw = random.Random(7)
    number = lambda: draw.choice([0, 1, -1, 0.5, 2.0, 1e3, 1e-9, 1e300, float("nan"), float("inf"), -0.0, draw.uniform(-2, 2)])
    vector = lambda: [number() for _ in range(draw.randrange(5))]
    name = lambda: draw.choice(["", "pull", "plate", "base", "min", "ünïcödé", "a" * 300])
    place = lambda: draw.choice([name(), (draw.randrange(4), draw.choice(["min", "max", "mid"])), None, 3, rkpm.Place(at=vector()), rkpm.Place()])
    laws = [LAW, rkpm.blatz_ko(0.5), rkpm.gent(0.5, 3, bulk=10)]
    blocks = [rkpm.Block([0], [1]), BLOCK, rkpm.Block([0, 0, 0], [1, 1, 1])]
    scenes = [rkpm.Scene(block, LAW) for block in blocks] + [SCENE]
    paths = [SCENE.solve(particles=3), rkpm.Scene(blocks[2], LAW).hold((0, "min")).solve(particles=2)]
    scene, path, any_block, law = (lambda of=of: draw.choice(of) for of in (scenes, paths, blocks, laws))
    calls = [
        lambda: rkpm.Block(vector(), vector()),
        lambda: rkpm.Scene(any_block(), law(), draw.choice([None, "plane stress", "axisymmetric", "solid", "radial sphere"]), thickness=number()),
        lambda: scene().hold(place()), lambda: scene().move(place(), vector(), name=name()),
        lambda: scene().prescribe(place(), draw.randrange(5), number()), lambda: scene().pressure(place(), number()),
        lambda: scene().traction(place(), vector()), lambda: scene().force(place(), vector()),
        lambda: scene().rigid(name(), place()), lambda: scene().moment(name(), [number()] * 3),
        lambda: scene().contact(place(), name(), plane=(vector(), vector()), move_by=vector()),
        lambda: scene().contact(place(), name(), sphere=(vector(), number()), friction=number()),
        lambda: scene().contact_between(place(), place(), name()), lambda: scene().expansion(number()),
        lambda: scene().over_time(number()), lambda: scene().without(name()), lambda: scene().foundation(place(), number()),
        lambda: scene().body(name(), any_block(), law()), lambda: scene().body_force(vector()),
        lambda: path().displacement_at(vector()), lambda: path().reaction(place()), lambda: path().contact(name()),
        lambda: path()[draw.randrange(-9, 9)].stretch, lambda: path().plot(name()), lambda: path().moment(place(), vector()),
        lambda: path().cauchy_at([vector()]), lambda: path().shape_functions([vector()]),
        lambda: rkpm.neo_hookean(number(), bulk=number()), lambda: rkpm.yeoh(number(), number(), number(), bulk=number()),
        lambda: rkpm.ogden([(number(), number())], bulk=number()), lambda: rkpm.gent(number(), number(), bulk=number()),
        lambda: rkpm.extended_tube(number(), number(), number(), number(), bulk=number()),
        lambda: law().nominal(vector(), draw.choice(["uniaxial", "planar", "volumetric", "shear"])),
        lambda: law().energy(np.full((3, 3), number())), lambda: law().stress(np.diag([1, 1, number()])),
        lambda: rkpm.energy("".join(draw.choice(["I1", "I2", "+", "-", "*", "/", "**", "(", ")", "3", "exp", " ", "x", "1e5"])
                                    for _ in range(draw.randrange(9))), bulk=number(), x=number()),
        lambda: rkpm.shape_functions(np.array([vector() for _ in range(4)], dtype=object), [vector()], number()),
        lambda: rkpm.shape_functions(np.array([[draw.uniform(0, 1)] * 2 for _ in range(5)]), [[0.5, 0.5]], number(), order=draw.randrange(4)),
        lambda: rkpm.Mesh([vector()], {draw.choice(["tetra", "line", "quad"]): [[draw.randrange(-2, 9)] * 4]}),
        lambda: rkpm.Outline(vector()), lambda: rkpm.Region(rkpm.Outline.circle(name(), [number(), number()], number())),
        lambda: rkpm.Shape.sphere([number()] * 3, number()),
    ]
    answered = 0
    for count in range(10_000):
        # One call in fifty solves a scene that calls before it have changed.
        call = (lambda: scene().solve(particles=draw.randrange(5), steps=draw.choice([None, 1]))) if count % 50 == 0 else draw.choice(calls)
        try:
            found = call()
        except (rkpm.Error, TypeError, ValueError, IndexError, OverflowError):
            continue
        answered += 1
        if isinstance(found, rkpm.Scene):
            scenes.append(found)
            del scenes[4:-20]
    assert answered > 3000
