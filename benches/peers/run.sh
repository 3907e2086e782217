#!/usr/bin/env bash
# Runs other programs on the tube, the disk, Cook's membrane and a sheared cube beside this crate, all on one thread, three
# times one after the other: benches/peers/run.sh [DIR]
#
# Each run has its chart and points in DIR/1, DIR/2, DIR/3; DIR/table.md compares times at equal error with their ranges over
# the runs. The table of docs/performance.md is that of all three, its chart that of one.
#
# Each program uses its best element on several meshes and the load-stepping rule of common.py. Counted are
# the seconds of the solve: imports, compilation of forms, meshes and matrix structures come before. This
# crate's own seconds include particles, cells and tables. The tube is one-dimensional here (radial
# kinematics) and an axisymmetric strip there.
#
# Needs Debian's python3-dolfinx (installed where it is missing and the user may) and felupe from PyPI (put
# into a virtual environment). A program that cannot be had is left out, and said.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
root="$(cd "$here/../.." && pwd)"
out="${1:-$root/target/rkpm/peers}"
mkdir -p "$out"
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 RAYON_NUM_THREADS=1 PYTHONPATH="$here"
system=/usr/bin/python3
if ! "$system" -c "import dolfinx" 2>/dev/null; then
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
    "${as_root[@]}" apt-get update && "${as_root[@]}" apt-get install -y --no-install-recommends python3-dolfinx || true
fi
have_dolfinx=0
if "$system" -c "import dolfinx" 2>/dev/null; then
    have_dolfinx=1
else
    echo "dolfinx is missing and could not be installed: left out" >&2
fi
have_felupe=0
if [ ! -x "$out/venv/bin/python" ]; then python3 -m venv "$out/venv" || true; fi
if [ -x "$out/venv/bin/pip" ] && "$out/venv/bin/pip" install --quiet felupe tensortrax scipy; then
    have_felupe=1
else
    echo "felupe could not be installed: left out" >&2
fi

cd "$root"
cargo build --release --example work_precision
for run in 1 2 3; do
    mkdir -p "$out/$run"
    peers="$out/$run/peers.csv"
    echo "problem,scheme,particles,unknowns,steps,iterations,error,seconds" >"$peers"
    if [ "$have_dolfinx" = 1 ]; then
        "$system" "$here/peer_dolfinx.py" "$root/tests/reference" "$peers" 2>&1 | grep -v INFO || true
        "$system" "$here/peer_dolfinx_cube.py" "$root/tests/reference" "$peers" 2>&1 | grep -v INFO || true
    fi
    # Felupe is in the chart alone, which is of the first run.
    if [ "$have_felupe" = 1 ] && [ "$run" = 1 ]; then
        "$out/venv/bin/python" "$here/peer_felupe.py" "$root/tests/reference" "$peers" || true
    fi
    cargo run --release --example work_precision -- --out "$out/$run" --peers "$peers"
done
python3 "$here/table.py" "$out/1" "$out/2" "$out/3" >"$out/table.md"
cat "$out/table.md"
