#!/usr/bin/env python3
"""Reads every .vtu and .pvd below a folder with meshio and says what is in them.

Usage: python3 tests/check_vtu.py FOLDER        (needs: pip install meshio)

Ends with status 1 where a file cannot be read, a .pvd names a file that does not exist, or the
folder holds none; with 0 otherwise. Not part of the tests that cargo runs.
"""

import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import meshio


def describe(path):
    """One line about a .vtu file: its points, cells and fields."""
    mesh = meshio.read(path)
    cells = ", ".join(f"{len(block.data)} {block.type}" for block in mesh.cells)
    shapes = {name: data.shape[1:] for name, data in mesh.point_data.items()}
    shapes |= {name: blocks[0].shape[1:] for name, blocks in mesh.cell_data.items()}
    fields = ", ".join(f"{name}{list(shape) or ''}" for name, shape in shapes.items())
    return f"{len(mesh.points)} points; {cells or 'no cells'}; {fields or 'no fields'}"


def collection(path):
    """One line about a .pvd file; an exception where a file it names is missing."""
    entries = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    times = [float(entry.attrib["timestep"]) for entry in entries]
    for entry in entries:
        if not (path.parent / entry.attrib["file"]).is_file():
            raise FileNotFoundError(f"names {entry.attrib['file']}, which does not exist")
    return f"{len(times)} files, times {times[0]} to {times[-1]}" if times else "0 files"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    files = sorted([*folder.rglob("*.vtu"), *folder.rglob("*.pvd")])
    failures = 0
    for path in files:
        try:
            found = collection(path) if path.suffix == ".pvd" else describe(path)
            print(f"ok      {path.relative_to(folder)}: {found}")
        # meshio ends the process itself on some malformed files.
        except (Exception, SystemExit) as failure:
            failures += 1
            print(f"FAILED  {path.relative_to(folder)}: {failure}")
    if not files:
        print(f"no .vtu or .pvd below {folder}")
    return 1 if failures or not files else 0


if __name__ == "__main__":
    sys.exit(main())
