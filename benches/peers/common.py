"""What the programs share: problems, references, the load-stepping rule, the table.

The stepping is the one of this crate under load control: the first increment is tried, halved where Newton
fails within 30 iterations, grown by half after at most 6 iterations, with a linear predictor from the last
two states; converged where the increment is below 1e-8 of the displacement. Programs may start with any of
the increments below; the fastest counts.
"""

import csv
import math
import sys
import time

REFERENCE = {
    # name: (value, where it comes from)
    "tube": {"energy": 2 * math.pi * 63.6418853057},  # replaced from the file by `references`
    "disk": {"w": 17.949637},
    "cook": {"tip": 6.9355, "mid": 6.9635, "energy": 334.97},
}

FIRST = {"tube": [1.0, 0.25, 0.1], "disk": [0.2, 0.1, 0.05, 0.02], "cook": [1.0]}


def references(directory):
    """Reads the references that the crate's tests use."""
    with open(f"{directory}/tube_inflation.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    row = next(r for r in rows if abs(float(r["p_MPa"]) - 0.46) < 1e-12)
    REFERENCE["tube"]["energy"] = 2 * math.pi * float(row["U_k1e5"])
    with open(f"{directory}/cook_membrane.csv") as file:
        rows = {r["quantity"]: float(r["value"]) for r in csv.DictReader(l for l in file if not l.lstrip('"').startswith("#"))}
    REFERENCE["cook"] = {"tip": rows["uy_48_60"], "mid": rows["uy_48_52"], "energy": rows["U_stored"]}


class Failed(Exception):
    """Newton gave up."""


def march(first, solve, state):
    """Follows the load factor from 0 to 1.

    `solve(guess, load)` returns (state, iterations) or raises Failed with the iterations spent as its
    argument; `state` must support + - and multiplication by a number.
    """
    load, increment, previous, steps, iterations = 0.0, first, None, 0, 0
    rejected = False
    while load < 1.0:
        target = min(1.0, load + increment)
        if target > 1.0 - 1e-9:
            target = 1.0
        guess = state
        if previous is not None:
            ratio = (target - load) / (load - previous[1])
            guess = state + (state - previous[0]) * ratio
        try:
            found, spent = solve(guess, target)
        except Failed as failed:
            iterations += failed.args[0]
            increment = 0.5 * (target - load)
            rejected = True
            if increment < 1e-4:
                raise
            continue
        iterations += spent
        steps += 1
        previous = (state, load)
        state, load = found, target
        if spent <= 6 and not rejected:
            increment *= 1.5
        rejected = False
    return state, steps, iterations


def timed(problem, run):
    """Runs with each first increment, warm and repeated: (seconds, result) of the fastest."""
    best = None
    for first in FIRST[problem]:
        seconds = []
        try:
            begin = time.perf_counter()
            result = run(first)
            first_run = time.perf_counter() - begin
            repeats = 20 if first_run < 0.1 else 5 if first_run < 0.5 else 2
            for _ in range(repeats):
                begin = time.perf_counter()
                result = run(first)
                seconds.append(time.perf_counter() - begin)
        except Failed:
            continue
        if best is None or min(seconds) < best[0]:
            best = (min(seconds), result)
    return best


def worst(problem, values):
    """The worst relative error of the quantities asked for."""
    return max(abs(values[name] / value - 1) for name, value in REFERENCE[problem].items())


class Rows:
    """The table, written row by row, so that what was measured stays when a program fails."""

    def __init__(self, path):
        self.file = open(path, "a")

    def add(self, problem, scheme, particles, unknowns, steps, iterations, error, seconds):
        row = f"{problem},{scheme},{particles},{unknowns},{steps},{iterations},{error:.6e},{seconds:.6e}"
        print(row, file=self.file, flush=True)
        print(row, file=sys.stderr, flush=True)
