#!/usr/bin/env bash
# From three STL files to a force, by this crate and by Gmsh with dolfinx, one thread: benches/peers/surfaces.sh [DIR]
#
# Needs Debian's python3-dolfinx and Gmsh's package from PyPI (put into a virtual environment). DIR/ours.csv and
# DIR/peers.csv have the rows of both, DIR/table.md the seconds that each takes for an error of 2 %; the
# reference is the mean of the two programs' finest forces.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
root="$(cd "$here/../.." && pwd)"
out="$(realpath -m "${1:-$root/target/rkpm/surfaces}")"
mkdir -p "$out"
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 RAYON_NUM_THREADS=1
if [ ! -x "$out/venv/bin/python" ]; then python3 -m venv "$out/venv"; fi
"$out/venv/bin/pip" install --quiet gmsh numpy
"$out/venv/bin/python" "$here/surfaces.py" write "$out"
"$out/venv/bin/python" "$here/surfaces.py" mesh "$out"
/usr/bin/python3 "$here/surfaces.py" solve "$out"
cd "$root"
cargo bench -p rkpm-benches --bench surfaces -- "$out"
"$out/venv/bin/python" "$here/surfaces.py" table "$out" | tee "$out/table.md"
