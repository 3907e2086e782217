#!/usr/bin/env bash
# Runs other programs on the tube, the disk, Cook's membrane and a sheared cube beside this crate, all on one thread, and
# draws one chart: benches/peers/run.sh [DIR]
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
peers="$out/peers.csv"
echo "problem,scheme,particles,unknowns,steps,iterations,error,seconds" >"$peers"

system=/usr/bin/python3
if ! "$system" -c "import dolfinx" 2>/dev/null; then
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
    "${as_root[@]}" apt-get update && "${as_root[@]}" apt-get install -y --no-install-recommends python3-dolfinx || true
fi
if "$system" -c "import dolfinx" 2>/dev/null; then
    "$system" "$here/peer_dolfinx.py" "$root/tests/reference" "$peers" 2>&1 | grep -v INFO || true
    "$system" "$here/peer_dolfinx_cube.py" "$root/tests/reference" "$peers" 2>&1 | grep -v INFO || true
else
    echo "dolfinx is missing and could not be installed: left out" >&2
fi

if [ ! -x "$out/venv/bin/python" ]; then python3 -m venv "$out/venv"; fi
if "$out/venv/bin/pip" install --quiet felupe tensortrax scipy; then
    "$out/venv/bin/python" "$here/peer_felupe.py" "$root/tests/reference" "$peers" || true
else
    echo "felupe could not be installed: left out" >&2
fi

cd "$root"
cargo run --release --example work_precision -- --out "$out" --peers "$peers"
