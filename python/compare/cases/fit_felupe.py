import felupe as fem
import numpy as np

rows = [line.split(",")[1:] for line in open("../../../tests/reference/treloar_1944.csv") if line.startswith("UT")]
stretch, stress = np.array(rows, dtype=float).T
umat = fem.Hyperelastic(fem.yeoh, C10=0.2, C20=0.0, C30=0.0)
fitted, result = umat.optimize(ux=[stretch, stress], incompressible=True)
answer = fitted.kwargs["C10"]
