"""The same bits as Rust: RKPM_BITS names the output of `cargo run -p rkpm-python --example bits` in the profile of the module."""

import os
import struct
from pathlib import Path

import pytest

import rkpm


def tube():
    law = rkpm.yeoh(0.373, -0.031, 0.005, bulk=1e5)
    scene = rkpm.Scene(rkpm.Block([6], [8]), law, "radial cylinder").pressure("min", 0.46)
    return scene.solve(particles=9), None


def strip():
    law = rkpm.neo_hookean(0.5, bulk=1e3)
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), law).hold((0, "min")).move((0, "max"), [0.5, 0], name="pull")
    return scene.solve(particles=[9, 5]), "pull"


def block():
    law = rkpm.ogden([(0.6, 1.8), (-0.01, -3.0)], bulk=500)
    scene = rkpm.Scene(rkpm.Block([0, 0, 0], [1, 1, 1]), law).hold((2, "min"))
    return scene.move((2, "max"), [0.3, 0, -0.1], name="plate").solve(particles=5), "plate"


def roller():
    outline = rkpm.Outline([0, 0]).line("equator", [0.2, 0]).arc("outer", [0, 0.2], [0, 0]).close("axis")
    scene = rkpm.Scene(rkpm.Region(outline), rkpm.mooney_rivlin(0.293, 0.177, bulk=1410))
    scene = scene.prescribe("equator", 1, 0).prescribe("axis", 0, 0)
    scene = scene.contact("outer", "plate", plane=([0, 0.2], [0, -1]), move_by=[0, -0.025])
    return scene.solve(particles=8), None


def bearing():
    scene = rkpm.Scene(rkpm.Block([0, 0], [40, 10]), rkpm.neo_hookean(0.5, bulk=1e3))
    scene = scene.hold((1, "min")).move((1, "max"), [5, 0], name="push")
    return scene.solve(within=0.02, of=("force", "push", 0)), "push"


@pytest.fixture(scope="module")
def expected():
    if "RKPM_BITS" not in os.environ:
        pytest.skip("RKPM_BITS names no file")
    lines = [line.split(" ") for line in Path(os.environ["RKPM_BITS"]).read_text().splitlines()]
    return {(scene, field): values for scene, field, *values in lines}


@pytest.mark.parametrize("scene", [tube, strip, block, roller, bearing])
def test_bits_are_those_of_rust(scene, expected):
    path, force = scene()
    fields = {"displacement": path.displacement, "cauchy": path.cauchy, "energy": path.energy[-1:]}
    if force:
        fields["force"] = path.reaction(force)
    for field, values in fields.items():
        bits = [struct.pack(">d", value).hex() for value in values.ravel()]
        assert bits == expected[scene.__name__, field], field
