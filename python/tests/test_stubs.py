"""The stubs tell what the module has, with the same arguments."""

import ast
import inspect
from pathlib import Path

import rkpm

PUBLIC = {name for name, value in vars(rkpm).items() if not (name.startswith("_") or inspect.ismodule(value))}
STUB = ast.parse((Path(__file__).parent.parent / "rkpm.pyi").read_text())


def arguments(function):
    # Keyword-only ones behind the others, as inspect has them.
    given = function.args
    names = [argument.arg for argument in given.posonlyargs + given.args + given.kwonlyargs]
    return names + ([given.kwarg.arg] if given.kwarg else [])


def members(body):
    return {node.name: node for node in body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}


def test_the_stubs_have_every_name_and_no_other():
    assert set(members(STUB.body)) == PUBLIC
    for name, node in members(STUB.body).items():
        if isinstance(node, ast.ClassDef) and not issubclass(getattr(rkpm, name), BaseException):
            own = {member for member in vars(getattr(rkpm, name)) if not member.startswith("_")}
            assert {member for member in members(node.body) if not member.startswith("_")} == own, name


def test_the_stubs_have_the_same_arguments():
    compared = 0
    for name, node in members(STUB.body).items():
        pairs = [(node, getattr(rkpm, name))]
        if isinstance(node, ast.ClassDef):
            pairs = [(n, getattr(getattr(rkpm, name), m)) for m, n in members(node.body).items() if not m.startswith("_")]
        for stub, real in pairs:
            if isinstance(stub, ast.FunctionDef) and callable(real):
                found = [parameter for parameter in inspect.signature(real).parameters]
                assert [n for n in arguments(stub)] == found, (name, stub.name)
                compared += 1
    assert compared > 60


def test_every_public_name_is_documented():
    for name in PUBLIC:
        value = getattr(rkpm, name)
        assert value.__doc__, name
        if isinstance(value, type) and not issubclass(value, BaseException):
            for member in vars(value):
                assert member.startswith("_") or getattr(value, member).__doc__, (name, member)
