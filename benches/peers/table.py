"""Times at equal error, with their ranges over several runs, as a table in Markdown.

Usage: table.py DIR [DIR ...], each with the points.csv of one run.

A series has reached an error at a run if that run and all finer ones behind it in the series stay below: the lucky zero
crossing of a signed error counts for nothing.
"""

import csv
import math
import sys

# Problem, error, what the error is of.
TARGETS = [
    ("tube", 1e-5, "tube (1D here, 2D there), energy to 1e-5"),
    ("disk", 1.5e-2, "disk, deflection to 1.5 %"),
    ("cook", 5e-3, "Cook's membrane, worst of three to 0.5 %"),
    ("cook", 2e-3, "the same to 0.2 %"),
    ("cube", 3e-2, "sheared cube, worst of three to 3 %"),
    ("cube", 2.5e-2, "the same to 2.5 %"),
    ("cube", 2e-2, "the same to 2 %"),
    ("cube", 1e-2, "the same to 1 %"),
]
PARTICLES = ["default"]
SAME_CONTROL = ["default, load in control"]
FINER = ["default", "quadratic", "graded"]
ELEMENTS = ["Q1/P0", "Q2/P1"]


def read(directory):
    """Runs by problem and series, from coarse to fine."""
    series = {}
    with open(f"{directory}/points.csv", newline="") as file:
        for row in csv.DictReader(file):
            series.setdefault((row["problem"], row["scheme"]), []).append(row)
    return series


def reached(runs, error):
    """The cheapest run from which on the error stays below."""
    worst, best = 0.0, None
    for row in reversed(runs):
        try:
            own = float(row["error"])
        except ValueError:
            own = math.nan
        if math.isnan(own):
            continue
        worst = max(worst, own)
        if worst <= error and (best is None or float(row["seconds"]) < float(best["seconds"])):
            best = row
    return best


def fastest(found, problem, names, error):
    runs = [reached(found[(problem, name)], error) for name in names if (problem, name) in found]
    runs = [run for run in runs if run is not None]
    return min(runs, key=lambda run: float(run["seconds"]), default=None)


def spread(values, digits=2):
    """The smallest and the largest value."""
    def words(value):
        # So many digits, without an exponent.
        return f"{float(f'{value:.{digits}g}'):g}"

    low, high = words(min(values)), words(max(values))
    return low if low == high else f"{low} to {high}"


def milliseconds(rows):
    rows = [row for row in rows if row is not None]
    if not rows:
        return "–"
    return spread([1e3 * float(row["seconds"]) for row in rows])


def work(row):
    return "" if row is None else f"{row['particles']} nodes, {row['factorizations']} factorisations, {row['solutions']} solutions"


def main():
    runs = [read(directory) for directory in sys.argv[1:]]
    print("| problem | default [ms] | own elements [ms] | dolfinx [ms] | dolfinx / default | work of the default |")
    print("|---|---|---|---|---|---|")
    for problem, error, words in TARGETS:
        peers = [sorted({name for p, name in found if p == problem and name.startswith("dolfinx")}) for found in runs]
        rows = []
        for label, names in (("", PARTICLES), (", load in control as there", SAME_CONTROL)):
            ours = [fastest(found, problem, names, error) for found in runs]
            if all(row is None for row in ours):
                continue
            rows.append((words + label, ours))
        for label, ours in rows:
            elements = [fastest(found, problem, ELEMENTS, error) for found in runs]
            theirs = [fastest(found, problem, names, error) for found, names in zip(runs, peers)]
            ratio = "–"
            pairs = [(o, t) for o, t in zip(ours, theirs) if o is not None and t is not None]
            if pairs:
                ratio = spread([float(t["seconds"]) / float(o["seconds"]) for o, t in pairs])
            print(f"| {label} | {milliseconds(ours)} | {milliseconds(elements)} | {milliseconds(theirs)} | {ratio} | {work(ours[0])} |")
    print()
    for error in (2e-2, 1e-2):
        best = [fastest(found, "cube", FINER, error) for found in runs]
        own = [fastest(found, "cube", ["Q2/P1"], error) for found in runs]
        if all(best) and all(own):
            ratio = spread([float(o["seconds"]) / float(b["seconds"]) for b, o in zip(best, own)])
            print(f"Cube at {error:g}: Q2/P1 over the best particles ({best[0]['scheme']}) {ratio}.")


main()
