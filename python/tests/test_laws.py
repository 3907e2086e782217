"""Laws: moduli, stresses, fits, expressions and functions."""

import numpy as np
import pytest

import rkpm

STRETCHES = np.linspace(1.1, 3, 12)


@pytest.mark.parametrize("law, shear", [
    (rkpm.neo_hookean(0.4, bulk=1e3), 0.8),
    (rkpm.mooney_rivlin(0.3, 0.1, bulk=1e3), 0.8),
    (rkpm.yeoh(0.4, -0.01, 0.001, bulk=1e3), 0.8),
    (rkpm.polynomial({(1, 0): 0.4, (2, 0): 0.01}, bulk=1e3), 0.8),
    (rkpm.ogden([(1.0, 1.6)], bulk=1e3), 0.8),
    (rkpm.ogden([(0.8, 1.6)], bulk=1e3, convention="abaqus"), 0.8),
    (rkpm.ogden([(1.6, 1.6)], bulk=1e3, convention="febio"), 0.8),
    (rkpm.gent(0.8, 50, bulk=1e3), 0.8),
    (rkpm.energy("0.4*(I1 - 3)", bulk=1e3), 0.8),
], ids=lambda given: str(given))
def test_shear_and_bulk_modulus_at_rest(law, shear):
    assert law.shear == pytest.approx(shear, rel=1e-9) and law.bulk == pytest.approx(1e3, rel=1e-9)


def test_foams_need_no_bulk_modulus():
    assert rkpm.blatz_ko(0.8, 0.25).bulk == pytest.approx(0.8 * 5 / 3, rel=1e-9)
    assert rkpm.arruda_boyce(0.8, 7, bulk=1e3).shear == pytest.approx(0.8, rel=0.05)
    assert rkpm.extended_tube(0.19, 0.2, 0.3, 0.1, bulk=1e3).shear > 0.3


def test_nominal_stress_in_tension():
    law = rkpm.neo_hookean(0.5, bulk=1e3)
    assert law.nominal(STRETCHES) == pytest.approx(STRETCHES - STRETCHES**-2)
    assert law.nominal(STRETCHES, "planar") == pytest.approx(STRETCHES - STRETCHES**-3)
    assert law.nominal(STRETCHES, "equibiaxial") == pytest.approx(STRETCHES - STRETCHES**-5)
    assert law.nominal([1.1], "volumetric")[0] == pytest.approx(100)
    # Free surfaces let foams change their volume.
    assert rkpm.blatz_ko(1.0).nominal(STRETCHES) == pytest.approx(STRETCHES**-0.5 - STRETCHES**-3.0)


def test_a_fit_gives_back_the_law_that_made_the_data():
    law = rkpm.yeoh(0.4, -0.01, 0.002, bulk=1e3)
    report = rkpm.fit({"uniaxial": (STRETCHES, law.nominal(STRETCHES))}, "yeoh", allow_unstable=True)
    assert [value for _, value in report.coefficients] == pytest.approx([0.4, -0.01, 0.002], rel=1e-4)
    assert report.rubber(bulk=1e3).shear == pytest.approx(0.8, rel=1e-5)
    assert report.nominal([2.0])[0] == pytest.approx(law.nominal([2.0])[0], rel=1e-5)
    assert report._repr_svg_().startswith("<svg") and dict(report.misfits)["uniaxial"] < 1e-5


def test_a_fit_tells_and_takes_the_bulk_modulus_of_volumetric_tests():
    tests = {"uniaxial": (STRETCHES, STRETCHES - STRETCHES**-2)}
    plain = rkpm.fit(tests, "neo-hookean")
    assert plain.bulk is None
    with pytest.raises(rkpm.Error, match="bulk modulus"):
        plain.nominal([1.1], "volumetric")
    with pytest.raises(rkpm.Error, match="give bulk"):
        plain.rubber()
    whole = rkpm.fit({**tests, "volumetric": ([0.99, 1.01], [-10, 10])}, "neo-hookean")
    assert whole.bulk == pytest.approx(1e3) and whole.rubber().bulk == pytest.approx(1e3)
    assert whole.rubber(bulk=500).bulk == pytest.approx(500)


def test_a_fitted_foam_is_whole():
    foam = rkpm.fit({"uniaxial": (STRETCHES, STRETCHES - STRETCHES**-2)}, "foam", terms=1, allow_unstable=True)
    _, nu = foam.coefficients[2]
    assert foam.bulk is None and foam.rubber().bulk == pytest.approx(foam.rubber().shear * 2 * (1 + nu) / (3 - 6 * nu))
    with pytest.raises(rkpm.Error, match="compressible"):
        foam.rubber(bulk=1e3)


def test_a_fit_reads_text():
    text = "mode,stretch,nominal_stress\n" + "\n".join(f"uniaxial,{l},{l - l**-2}" for l in STRETCHES)
    assert dict(rkpm.fit(text, "neo-hookean").coefficients).popitem()[1] == pytest.approx(0.5, rel=1e-6)


def strip(law):
    scene = rkpm.Scene(rkpm.Block([0, 0], [2, 1]), law).hold((0, "min")).move((0, "max"), [0.5, 0], name="pull")
    return scene.solve(particles=[7, 4])


@pytest.mark.parametrize("expression, named, constants", [
    ("a*(I1 - 3)", rkpm.neo_hookean(0.5, bulk=1e3), {"a": 0.5}),
    ("a*(I1-3) + b*(I2-3)", rkpm.mooney_rivlin(0.3, 0.2, bulk=1e3), {"a": 0.3, "b": 0.2}),
    ("a*(I1-3) + b*(I1-3)**2 + c*(I1-3)^3", rkpm.yeoh(0.5, -0.02, 0.003, bulk=1e3), {"a": 0.5, "b": -0.02, "c": 0.003}),
    ("-mu/2*J*log(1 - (I1 - 3)/J)", rkpm.gent(0.8, 30, bulk=1e3), {"mu": 0.8, "J": 30}),
], ids=["neo-Hookean", "Mooney-Rivlin", "Yeoh", "Gent"])
def test_an_expression_is_the_law_that_it_writes(expression, named, constants):
    written = rkpm.energy(expression, bulk=1e3, **constants)
    a, b = strip(named), strip(written)
    assert b.iterations == a.iterations
    assert b.displacement == pytest.approx(a.displacement, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("expression", ["", "1 +", "(I1 - 3", "x*(I1-3)", "exp I1", "I1 I2", "2..5*I1", "(" * 99, "é"])
def test_what_is_no_expression_is_refused_with_the_place(expression):
    with pytest.raises(rkpm.Error, match="energy"):
        rkpm.energy(expression, bulk=1e3)


def distortional(F):
    J = np.linalg.det(F)
    return J ** (-2 / 3) * (F - np.trace(F.T @ F) / 3 * np.linalg.inv(F).T)


def test_a_python_function_is_the_law_that_it_evaluates():
    own, named = strip(rkpm.material(distortional, bulk=1e3)), strip(rkpm.neo_hookean(0.5, bulk=1e3))
    assert own.displacement == pytest.approx(named.displacement, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("numbers", [list, lambda P: P.astype(np.float32), lambda P: np.round(P).astype(int)], ids=["lists", "float32", "integers"])
def test_a_python_function_gives_any_numbers(numbers):
    law = rkpm.material(lambda F: numbers(F - np.linalg.inv(F).T))
    assert law.stress([[2, 0, 0], [0, 1, 0], [0, 0, 1]])[0, 0] == pytest.approx(1.5, abs=0.5)
    paired = rkpm.material(lambda F: (numbers(F - np.linalg.inv(F).T), numbers(np.zeros((3, 3, 3, 3)))))
    assert paired.stress(2 * np.eye(3, dtype=int))[1, 1] == pytest.approx(1.5, abs=0.5)


def test_what_a_python_function_raises_ends_the_run():
    def wrong(F):
        raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError, match="on purpose"):
        strip(rkpm.material(wrong, bulk=1e3))
    with pytest.raises(rkpm.Error, match="3 × 3"):
        strip(rkpm.material(lambda F: np.zeros(4), bulk=1e3))


def test_energy_and_stress_at_a_gradient():
    law, F = rkpm.neo_hookean(0.5, bulk=1e3), np.array([[1.0, 0.3, 0], [0, 1, 0], [0, 0, 1]])
    assert law.energy(F) == pytest.approx(0.5 * 0.09)
    assert law.stress(F)[0, 1] == pytest.approx(0.3)
    assert law.energy(F.tolist()) == law.energy(F) and law.energy(np.eye(3, dtype=int)) == 0
    assert law.stress(F.astype(np.float32)) == pytest.approx(law.stress(F), abs=1e-4)
    with pytest.raises(rkpm.Error, match="give 3 × 3"):
        law.energy([1.0, 2.0])
