//! Laws: a stored energy for a scene, by name, by an expression, by a Python function, or fitted to tests.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rkpm::error::MaterialError;
use rkpm::fit::{Fit as Search, Law as Family, Report, TestData};
use rkpm::material::{
    Invariants, Material, Mode, NearlyIncompressible, OgdenConvention, Prony, QuadraticVolume, Viscoelastic,
};
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::Rubber;

use crate::expression::Expression;
use crate::fault::{Error, Faults, mistyped, refused};
use crate::geometry::numbers;
use crate::own::Own;

/// A law of a rubber or a foam: a stored energy W(F) per reference volume, in the unit of its constants.
#[pyclass(frozen, module = "rkpm", from_py_object)]
#[derive(Clone)]
pub(crate) struct Law {
    pub(crate) material: Arc<dyn Material>,
    pub(crate) faults: Faults,
    name: String,
}

impl Law {
    fn new(name: &str, material: Result<impl Material + 'static, MaterialError>) -> PyResult<Self> {
        Ok(Law { material: Arc::new(material.map_err(refused)?), faults: Faults::default(), name: name.into() })
    }

    /// A value of the law, unless a Python function that it calls raises.
    fn value<T: Send>(&self, py: Python<'_>, value: impl FnOnce(&dyn Material) -> T + Send) -> PyResult<T> {
        self.faults.calling(py, || Ok::<_, rkpm::Error>(value(&*self.material)))
    }
}

#[pymethods]
impl Law {
    /// The shear modulus at rest [stress].
    #[getter]
    fn shear(&self, py: Python<'_>) -> PyResult<f64> {
        self.value(py, |law| law.initial_moduli().shear)
    }

    /// The bulk modulus at rest [stress].
    #[getter]
    fn bulk(&self, py: Python<'_>) -> PyResult<f64> {
        self.value(py, |law| law.initial_moduli().bulk)
    }

    /// The stored energy at a deformation gradient, 3 × 3.
    fn energy(&self, py: Python<'_>, gradient: &Bound<'_, PyAny>) -> PyResult<f64> {
        let f = matrix(gradient)?;
        self.value(py, |law| law.energy(&f))
    }

    /// The first Piola–Kirchhoff stress at a deformation gradient, 3 × 3.
    fn stress<'py>(&self, py: Python<'py>, gradient: &Bound<'_, PyAny>) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let f = matrix(gradient)?;
        let stress = self.value(py, |law| law.response(&f).stress)?;
        rows(py, stress.transpose().as_slice(), 3)
    }

    /// Nominal stresses at stretches in a test, "uniaxial", "equibiaxial" or "planar": of rubber, with k/2 (J - 1)², without change of
    /// volume, of foams with that of a free surface. "volumetric": mean Cauchy stresses at ratios of the volume.
    #[pyo3(signature = (stretches, mode="uniaxial"))]
    fn nominal<'py>(&self, py: Python<'py>, stretches: Vec<f64>, mode: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mode = self::mode(mode)?;
        let values = self.value(py, |law| stretches.iter().map(|&l| stress(law, mode, l)).collect::<Vec<f64>>())?;
        Ok(PyArray1::from_vec(py, values))
    }

    /// The same relaxing: pairs of the part of the stress at first that goes, and its time, `[(0.3, 1.0), …]`. The scene needs
    /// `over_time`.
    fn relaxing(&self, pairs: Vec<(f64, f64)>) -> PyResult<Self> {
        let prony = Prony::of_instantaneous(pairs).map_err(refused)?;
        let material = Arc::new(Viscoelastic::new(self.material.clone(), prony));
        Ok(Law { material, faults: self.faults.clone(), name: format!("{}, relaxing", self.name) })
    }

    fn __repr__(&self) -> String {
        format!("<rkpm.Law {}>", self.name)
    }
}

/// The stress of a law in a test, as fits take it; NaN outside of its domain.
fn stress(law: &dyn Material, mode: Mode, stretch: f64) -> f64 {
    match mode {
        Mode::Volumetric => {
            let side = stretch.cbrt();
            mode.state(law, side).map_or(f64::NAN, |state| state.stress / (side * side))
        }
        _ if law.volumetric().is_none() => mode.state(law, stretch).map_or(f64::NAN, |state| state.stress),
        _ => mode.incompressible_state(law, stretch).stress,
    }
}

/// A 3 × 3 array as a matrix.
fn matrix(given: &Bound<'_, PyAny>) -> PyResult<Matrix3<f64>> {
    let array = numbers::<f64>(given, "deformation gradient")?;
    let array = array.as_array();
    if array.shape() != [3, 3] {
        return Err(Error::new_err(format!("deformation gradient: an array of {:?}, give 3 × 3", array.shape())));
    }
    Ok(Matrix3::from_fn(|i, j| array[[i, j]]))
}

/// Numbers as an array of so many columns.
pub(crate) fn rows<'py>(py: Python<'py>, values: &[f64], columns: usize) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
    values.to_pyarray(py).reshape([values.len() / columns.max(1), columns])
}

/// W = A₁₀ (I₁ - 3) + k/2 (J - 1)²; A₁₀ is half the shear modulus.
#[pyfunction]
#[pyo3(signature = (a10, *, bulk))]
pub(crate) fn neo_hookean(a10: f64, bulk: f64) -> PyResult<Law> {
    Law::new("neo-Hookean", Rubber::neo_hookean(a10, bulk))
}

/// W = A₁₀ (I₁ - 3) + A₀₁ (I₂ - 3) + k/2 (J - 1)².
#[pyfunction]
#[pyo3(signature = (a10, a01, *, bulk))]
pub(crate) fn mooney_rivlin(a10: f64, a01: f64, bulk: f64) -> PyResult<Law> {
    Law::new("Mooney-Rivlin", Rubber::mooney_rivlin(a10, a01, bulk))
}

/// W = A₁₀ (I₁ - 3) + A₂₀ (I₁ - 3)² + A₃₀ (I₁ - 3)³ + k/2 (J - 1)².
#[pyfunction]
#[pyo3(signature = (a10, a20, a30, *, bulk))]
pub(crate) fn yeoh(a10: f64, a20: f64, a30: f64, bulk: f64) -> PyResult<Law> {
    Law::new("Yeoh", Rubber::yeoh(a10, a20, a30, bulk))
}

/// W = Σ Aₘₙ (I₁ - 3)ᵐ (I₂ - 3)ⁿ + k/2 (J - 1)²: `{(1, 0): 0.5, (0, 1): 0.1}`.
#[pyfunction]
#[pyo3(signature = (terms, *, bulk))]
pub(crate) fn polynomial(terms: &Bound<'_, PyDict>, bulk: f64) -> PyResult<Law> {
    let terms: Vec<((u32, u32), f64)> =
        terms.iter().map(|(powers, value)| Ok((powers.extract()?, value.extract()?))).collect::<PyResult<_>>()?;
    Law::new("polynomial", Rubber::polynomial(terms, bulk))
}

/// Ogden's law, Σ µ/α (λ₁^α + λ₂^α + λ₃^α - 3) + k/2 (J - 1)², by pairs (µ, α). `convention="abaqus"` takes µ of 2µ/α²
/// (Abaqus, CalculiX, felupe), "febio" c of c/α².
#[pyfunction]
#[pyo3(signature = (terms, *, bulk, convention=None))]
pub(crate) fn ogden(terms: Vec<(f64, f64)>, bulk: f64, convention: Option<&str>) -> PyResult<Law> {
    let material = match convention {
        None => Rubber::ogden(terms, bulk),
        Some("abaqus") => Rubber::ogden_in(OgdenConvention::ShearModuli, terms, bulk),
        Some("febio") => Rubber::ogden_in(OgdenConvention::Squared, terms, bulk),
        Some(other) => {
            return Err(Error::new_err(format!("ogden: no convention {other:?}, give \"abaqus\", \"febio\" or none")));
        }
    };
    Law::new("Ogden", material)
}

/// Gent's law with shear modulus and limit Jₘ of I₁ - 3.
#[pyfunction]
#[pyo3(signature = (shear, limit, *, bulk))]
pub(crate) fn gent(shear: f64, limit: f64, bulk: f64) -> PyResult<Law> {
    Law::new("Gent", Rubber::gent(shear, limit, bulk))
}

/// The law of Arruda and Boyce with µ and the stretch λₘ at which chains lock.
#[pyfunction]
#[pyo3(signature = (shear, locking, *, bulk))]
pub(crate) fn arruda_boyce(shear: f64, locking: f64, bulk: f64) -> PyResult<Law> {
    Law::new("Arruda-Boyce", Rubber::arruda_boyce(shear, locking, bulk))
}

/// The extended tube model with G_c, G_e, β and δ.
#[pyfunction]
#[pyo3(signature = (crosslinks, entanglements, beta, delta, *, bulk))]
pub(crate) fn extended_tube(crosslinks: f64, entanglements: f64, beta: f64, delta: f64, bulk: f64) -> PyResult<Law> {
    Law::new("extended tube", Rubber::extended_tube(crosslinks, entanglements, beta, delta, bulk))
}

/// The compressible law of Blatz and Ko with µ, ν and f, for foams.
#[pyfunction]
#[pyo3(signature = (shear, poisson=0.25, fraction=0.0))]
pub(crate) fn blatz_ko(shear: f64, poisson: f64, fraction: f64) -> PyResult<Law> {
    Law::new("Blatz-Ko", Rubber::blatz_ko(shear, poisson, fraction))
}

/// A law by an expression of the reduced invariants `I1` and `I2` and named constants, with + k/2 (J - 1)²:
/// `energy("mu/2*(I1 - 3) + c*(I1 - 3)**2", mu=0.8, c=0.01, bulk=1e3)`. It knows + - * / ** ( ) exp log sqrt; derivatives are
/// exact.
#[pyfunction]
#[pyo3(signature = (expression, *, bulk, **constants))]
pub(crate) fn energy(expression: &str, bulk: f64, constants: Option<&Bound<'_, PyDict>>) -> PyResult<Law> {
    let mut named = Vec::new();
    for (name, value) in constants.into_iter().flatten() {
        named.push((name.extract::<String>()?, value.extract::<f64>()?));
    }
    let parsed = Expression::parse(expression, &named).map_err(Error::new_err)?;
    let volumetric = QuadraticVolume::new(bulk).map_err(refused)?;
    Law::new(expression, Ok(NearlyIncompressible { distortional: Invariants(parsed), volumetric }))
}

/// A law by a Python function: F, a 3 × 3 array, in; the stress P out, or P with the tangent dP/dF, 3 × 3 × 3 × 3. Without a
/// tangent it is made of differences. With `bulk` the function gives the distortional part alone, and k/2 (J - 1)² is added,
/// which nearly incompressible rubber needs in order not to lock.
///
/// Slow: the function is called at each point in each iteration, one thread at a time. `energy` of an expression is as fast as
/// the laws of the crate. `energy` as a keyword is a function of F for the stored energy; without it energies are NaN, and states are not
/// doubted for what their energy would tell.
#[pyfunction]
#[pyo3(signature = (stress, *, bulk=None, energy=None))]
pub(crate) fn material(
    stress: &Bound<'_, PyAny>,
    bulk: Option<f64>,
    energy: Option<&Bound<'_, PyAny>>,
) -> PyResult<Law> {
    for (what, function) in [("stress", Some(stress)), ("energy", energy)] {
        if function.is_some_and(|function| !function.is_callable()) {
            return Err(mistyped(format!("material: {what} is no function")));
        }
    }
    let own = Own::new(stress, energy);
    let faults = Faults::new([own.fault()]);
    let name = "Python function";
    let law = match bulk {
        None => Law::new(name, Ok(own))?,
        Some(bulk) => {
            let volumetric = QuadraticVolume::new(bulk).map_err(refused)?;
            Law::new(name, Ok(NearlyIncompressible { distortional: own, volumetric }))?
        }
    };
    Ok(Law { faults, ..law })
}

fn mode(name: &str) -> PyResult<Mode> {
    let all = [Mode::Uniaxial, Mode::Equibiaxial, Mode::Planar, Mode::Volumetric];
    all.into_iter().find(|mode| mode.name() == name).ok_or_else(|| {
        let known = all.map(Mode::name).join(", ");
        Error::new_err(format!("no test is called {name:?}; there are {known}"))
    })
}

/// A law fitted to tests: coefficients, misfits, warnings; `rubber(bulk=…)` is the law for a scene, `rubber()` that of a foam.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Fitted {
    report: Report,
}

#[pymethods]
impl Fitted {
    /// Coefficients by name; those of "ogden" are those of `ogden` with `convention="abaqus"`.
    #[getter]
    fn coefficients(&self) -> Vec<(String, f64)> {
        self.report.coefficients.iter().map(|c| (c.name.clone(), c.value)).collect()
    }

    /// Relative misfits by test.
    #[getter]
    fn misfits(&self) -> Vec<(&'static str, f64)> {
        self.report.misfits.iter().map(|m| (m.mode.name(), m.relative)).collect()
    }

    /// Things to know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.report.warnings.iter().map(ToString::to_string).collect()
    }

    /// The bulk modulus of volumetric tests [stress]; none without them, and of foams, which have it among their coefficients.
    #[getter]
    fn bulk(&self) -> Option<f64> {
        self.report.bulk
    }

    /// The law for a scene: with k/2 (J - 1)², k being `bulk`, or that of volumetric tests; foams are compressible and take none.
    #[pyo3(signature = (*, bulk=None))]
    fn rubber(&self, bulk: Option<f64>) -> PyResult<Law> {
        match bulk.or(self.report.bulk) {
            Some(bulk) => Law::new(&self.report.name, self.report.rubber(bulk)),
            None if self.report.compressible => Law::new(&self.report.name, Ok(self.report.law.clone())),
            None => Err(Error::new_err("rubber: no volumetric test tells the bulk modulus, give bulk")),
        }
    }

    /// Nominal stresses of the law at stretches in a test.
    #[pyo3(signature = (stretches, mode="uniaxial"))]
    fn nominal<'py>(&self, py: Python<'py>, stretches: Vec<f64>, mode: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mode = self::mode(mode)?;
        if mode == Mode::Volumetric && self.report.bulk.is_none() && !self.report.compressible {
            return Err(Error::new_err(
                "nominal: no volumetric test tells the bulk modulus, ask the law of rubber(bulk=...)",
            ));
        }
        Ok(PyArray1::from_vec(py, stretches.iter().map(|&l| self.report.stress(mode, l)).collect()))
    }

    /// Data beside the law, as a notebook shows it.
    fn _repr_svg_(&self) -> PyResult<String> {
        self.report.chart().to_svg().map_err(refused)
    }

    fn __repr__(&self) -> String {
        format!("<rkpm.Fitted {}: {:?}>", self.report.name, self.coefficients())
    }
}

/// Fits a law to tests: "yeoh", "mooney-rivlin", "neo-hookean", "ogden", "gent", "arruda-boyce", "extended tube", "foam". Tests are
/// `{"uniaxial": (stretches, nominal stresses), …}`, a CSV text with the columns mode, stretch and nominal_stress, or its file.
/// A law that is unstable inside the range of its own data is refused unless `allow_unstable`. `terms` are those of "ogden" and "foam", 2
/// unless given.
#[pyfunction]
#[pyo3(signature = (tests, law="yeoh", *, terms=None, starts=40, seed=1, allow_unstable=false))]
pub(crate) fn fit(
    py: Python<'_>,
    tests: &Bound<'_, PyAny>,
    law: &str,
    terms: Option<usize>,
    starts: usize,
    seed: u64,
    allow_unstable: bool,
) -> PyResult<Fitted> {
    let data = self::tests(tests)?;
    let count = terms.unwrap_or(2);
    let family = match law {
        "neo-hookean" => Family::NeoHookean,
        "mooney-rivlin" => Family::MooneyRivlin,
        "yeoh" => Family::Yeoh,
        "ogden" => Family::Ogden(count),
        "gent" => Family::Gent,
        "arruda-boyce" => Family::ArrudaBoyce,
        "extended tube" => Family::ExtendedTube,
        "foam" => Family::Foam(count),
        other => return Err(Error::new_err(format!("fit: no law {other:?}; the documentation of fit lists them"))),
    };
    if terms.is_some() && !matches!(family, Family::Ogden(_) | Family::Foam(_)) {
        return Err(Error::new_err(format!("fit: {law} has no number of terms, ogden and foam have")));
    }
    let mut search = Search::new(family).starts(starts).seed(seed);
    if allow_unstable {
        search = search.allow_unstable();
    }
    let report = py.detach(|| search.to(&data)).map_err(refused)?;
    Ok(Fitted { report })
}

fn tests(given: &Bound<'_, PyAny>) -> PyResult<TestData> {
    if let Ok(text) = given.extract::<String>() {
        let data = if text.contains('\n') { TestData::parse(&text) } else { TestData::read(&text) };
        return data.map_err(refused);
    }
    if let Ok(file) = given.extract::<std::path::PathBuf>() {
        return TestData::read(file).map_err(refused);
    }
    let Ok(given) = given.cast::<PyDict>() else {
        return Err(mistyped("fit: give tests as {mode: (stretches, nominal stresses)}, CSV text or a file"));
    };
    let mut data = TestData::default();
    for (name, pair) in given.iter() {
        let (stretches, stresses): (Vec<f64>, Vec<f64>) = pair.extract()?;
        if stretches.len() != stresses.len() {
            let (a, b) = (stretches.len(), stresses.len());
            return Err(Error::new_err(format!("fit: {a} stretches with {b} stresses, give as many of both")));
        }
        let points = stretches.into_iter().zip(stresses).map(|(l, p)| [l, p]);
        data = data.with(mode(&name.extract::<String>()?)?, points).map_err(refused)?;
    }
    Ok(data)
}
