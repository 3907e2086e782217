"""Runs the same problems by felupe and by this module and prints a table: answers, lines of the programs, seconds of each.

`pip install felupe==11.3.0 tensortrax rkpm`, then `OMP_NUM_THREADS=1 RAYON_NUM_THREADS=1 python compare.py [case …]`. A program is run until it has
taken two seconds, at most five times; the least time counts. Imports do not.
"""

import os
import runpy
import sys
import time
import warnings
from pathlib import Path

import felupe  # noqa: F401  (imported here, so that no program pays for it)
import numpy as np  # noqa: F401

import rkpm  # noqa: F401

CASES = {
    "tension": "cube, Yeoh, uniaxial tension to 2.5: force",
    "planar": "cube, Ogden, planar tension to 2: force",
    "shear": "bonded pad 4 × 1, plane strain, γ = 0.5: force",
    "clamped": "strip 2 × 1, clamped ends, plane strain, to 2: force",
    "bushing": "bush, axial shift by half its thickness: force",
    "hole": "quarter of a plate with a hole, plane strain, to 1.5: force",
    "tube": "tube under pressure, Yeoh: displacement of the bore",
    "beam": "cantilever under its weight: deflection of the tip",
    "twist": "square column twisted by 1 rad: moment",
    "contact": "roller under a rigid plate: force",
    "fit": "Yeoh's law fitted to Treloar's tension test: A₁₀",
}


def run(program):
    seconds, spent = [], 0.0
    while spent < 2.0 and len(seconds) < 5:
        started = time.perf_counter()
        answer = runpy.run_path(program)["answer"]
        seconds.append(time.perf_counter() - started)
        spent += seconds[-1]
    return float(answer), min(seconds)


def lines(program):
    text = Path(program).read_text().splitlines()
    return sum(1 for line in text if line.strip() and not line.strip().startswith("#"))


def main():
    warnings.simplefilter("ignore")
    os.chdir(Path(__file__).parent / "cases")
    print("| problem: answer | felupe | here | difference | lines felupe, here | s felupe | s here |")
    print("|---|---|---|---|---|---|---|")
    for case in sys.argv[1:] or CASES:
        (a, s), (b, t) = (run(f"{case}_{who}.py") for who in ("felupe", "rkpm"))
        count = ", ".join(str(lines(f"{case}_{who}.py")) for who in ("felupe", "rkpm"))
        print(f"| {CASES[case]} | {a:.5g} | {b:.5g} | {100 * (b / a - 1):+.2f} % | {count} | {s:.2g} | {t:.2g} |", flush=True)


if __name__ == "__main__":
    main()
