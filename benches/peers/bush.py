"""felupe's reference of the bush: force on the inner sleeve against its stroke, on three meshes.

Usage: bush.py tests/reference/bush.csv

Half of the section (x >= 0) in plane strain per mm of length; biquadratic displacements, continuous bilinear pressures
and volumes. Needs felupe and tensortrax from PyPI.
"""

import sys
import warnings

import felupe as fem
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models.hyperelastic import yeoh

warnings.filterwarnings("ignore")
INNER, OUTER = 10.0, 20.0  # mm
STROKES = np.arange(0.5, 5.01, 0.5)  # mm


def forces(across, around):
    """Forces on the whole inner sleeve [N per mm of length]."""
    mesh = fem.Rectangle(a=(0, 0), b=(1, 1), n=(across + 1, around + 1))
    mesh = mesh.add_midpoints_edges().add_midpoints_faces(cell_type="quad9")
    s, t = mesh.points[:, 0].copy(), mesh.points[:, 1].copy()
    inner, outer = np.isclose(s, 0), np.isclose(s, 1)
    plane = (np.isclose(t, 0) | np.isclose(t, 1)) & ~inner & ~outer
    radius, angle = INNER + (OUTER - INNER) * s, np.pi * (t - 0.5)
    mesh.points[:, 0], mesh.points[:, 1] = radius * np.cos(angle), radius * np.sin(angle)
    field = fem.FieldsMixed(fem.RegionBiQuadraticQuad(mesh), n=3, disconnect=False, planestrain=True)
    rubber = fem.NearlyIncompressible(Hyperelastic(yeoh, C10=0.5, C20=-0.02, C30=0.002), bulk=1000.0)
    solid = fem.SolidBody(rubber, field)
    u = field[0]
    bounds = {
        "outer": fem.Boundary(u, mask=outer),
        "plane": fem.Boundary(u, mask=plane, skip=(0, 1)),
        "aside": fem.Boundary(u, mask=inner, skip=(0, 1)),
        "down": fem.Boundary(u, mask=inner, skip=(1, 0)),
    }
    out = []
    for stroke in STROKES:
        bounds["down"].value = -stroke
        fixed, free = fem.dof.partition(field, bounds)
        fem.newtonrhapson(
            items=[solid], dof0=fixed, dof1=free, ext0=fem.dof.apply(field, bounds, fixed), tol=1e-10, verbose=0
        )
        vector = solid.assemble.vector(field).toarray().ravel()[: u.values.size].reshape(-1, 2)
        out.append(-2.0 * vector[inner, 1].sum())
    return np.array(out)


coarse, fine = forces(16, 64), forces(32, 128)
with open(sys.argv[1], "w") as file:
    file.write(
        "# Rubber bush: inner radius 10 mm, outer radius 20 mm, bonded to rigid sleeves, plane strain per mm of length; "
        "Yeoh 0.5, -0.02, 0.002 MPa with bulk modulus 1000 MPa; inner sleeve moved sideways. "
        f"felupe {fem.__version__}, three fields on 32 x 128 biquadratic elements of a half; rel_err is the change from "
        "16 x 64. Made by benches/peers/bush.py.\n"
    )
    file.write("stroke_mm,force_N_per_mm,rel_err\n")
    for stroke, a, b in zip(STROKES, coarse, fine):
        file.write(f"{stroke},{b:.4f},{abs(a / b - 1):.1e}\n")
