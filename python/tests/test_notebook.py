"""The cells of the notebook run one after the other, and what they show can be drawn."""

import ast
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_draws(notebook):
    cells = json.loads(notebook.read_text())["cells"]
    names, pictures = {}, 0
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        shown = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, notebook.name, "exec"), names)
        if shown is None:
            continue
        value = eval(compile(ast.Expression(shown.value), notebook.name, "eval"), names)
        if hasattr(value, "_repr_svg_"):
            ElementTree.fromstring(value._repr_svg_())
            pictures += 1
    assert pictures >= 3
