import numpy as np
import rkpm

rows = [line.split(",")[1:] for line in open("../../../tests/reference/treloar_1944.csv") if line.startswith("UT")]
stretch, stress = np.array(rows, dtype=float).T
fitted = rkpm.fit({"uniaxial": (stretch, stress)}, "yeoh", allow_unstable=True)
answer = dict(fitted.coefficients)["A_10"]
