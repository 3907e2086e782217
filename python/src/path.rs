//! Paths: what a run found, as arrays, files and pictures.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, ToPyArray};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rkpm::geometry::Point;
use rkpm::nalgebra::Matrix3;
use rkpm::output::Picture as Drawing;
use rkpm::scene::{Field, Place as PlaceOf, Problem};
use rkpm::solve::{EquilibriumPath, State};

use crate::fault::{Error, Faults, refused};
use crate::geometry::points;
use crate::place::{Place, array};

/// What was to be known within an error: its value, extrapolated from a series of models, and the bound of the relative error of that.
#[derive(Clone, Copy)]
pub(crate) struct Within {
    pub(crate) value: f64,
    pub(crate) bound: f64,
}

/// A solved problem with its path.
pub(crate) struct Run<const D: usize> {
    pub(crate) problem: Problem<D>,
    pub(crate) path: EquilibriumPath,
    pub(crate) within: Option<Within>,
    /// Why a tolerance was not met.
    pub(crate) why: Option<String>,
    pub(crate) seconds: f64,
    /// Of the functions that the problem calls.
    pub(crate) faults: Faults,
}

impl<const D: usize> Run<D> {
    /// What the crate finds in the run while the interpreter is free, unless a Python function that the problem calls raises.
    fn told<T: Send, E: Into<rkpm::Error> + Send>(
        &self,
        py: Python<'_>,
        find: impl FnOnce(&Self) -> Result<T, E> + Send,
    ) -> PyResult<T> {
        self.faults.calling(py, || find(self))
    }

    fn state(&self, number: usize) -> &State {
        number.checked_sub(1).and_then(|k| self.path.steps.get(k)).map_or(&self.path.start, |step| &step.state)
    }

    fn states(&self) -> impl Iterator<Item = &State> {
        std::iter::once(&self.path.start).chain(self.path.steps.iter().map(|step| &step.state))
    }

    /// The force of a condition, of a rigid body or of a contact on the body.
    fn force(&self, state: &State, at: &PlaceOf<D>, name: Option<&str>) -> Result<Point<D>, rkpm::Error> {
        let error = match self.problem.reaction(state, at.clone()) {
            Ok(force) => return Ok(force),
            Err(error) => error,
        };
        let contact = name.and_then(|name| self.problem.contact(state, name).ok());
        contact.map(|contact| contact.force).ok_or(error)
    }

    fn cauchy(&self, state: &State) -> Result<Vec<Matrix3<f64>>, rkpm::Error> {
        self.problem.stress_field(state)?.at_particles()
    }

    fn gradients(&self, state: &State) -> Result<Vec<Matrix3<f64>>, rkpm::Error> {
        Ok(self.problem.at_particles(&self.problem.deformation_gradients(state)?))
    }
}

enum AnyRun {
    One(Arc<Run<1>>),
    Two(Arc<Run<2>>),
    Three(Arc<Run<3>>),
}

/// What is written once for all dimensions.
macro_rules! each {
    ($self:expr, $run:ident => $body:expr) => {
        match &$self.run {
            AnyRun::One($run) => $body,
            AnyRun::Two($run) => $body,
            AnyRun::Three($run) => $body,
        }
    };
}

/// The states of a run, the one at rest first. Fields are those of one state: of the last one, or of the one that an index picks,
/// `path[3].displacement`. Arrays have a row for each particle, or for each state.
#[pyclass(frozen, module = "rkpm", sequence)]
pub(crate) struct Path {
    run: AnyRun,
    state: usize,
}

impl Path {
    pub(crate) fn one(run: Arc<Run<1>>) -> Self {
        Path { state: run.path.steps.len(), run: AnyRun::One(run) }
    }

    pub(crate) fn two(run: Arc<Run<2>>) -> Self {
        Path { state: run.path.steps.len(), run: AnyRun::Two(run) }
    }

    pub(crate) fn three(run: Arc<Run<3>>) -> Self {
        Path { state: run.path.steps.len(), run: AnyRun::Three(run) }
    }

    /// Why a tolerance was not met.
    pub(crate) fn unmet(&self) -> Option<&String> {
        each!(self, run => run.why.as_ref())
    }

    /// Why the run was not completed.
    pub(crate) fn refusal(&self) -> Option<String> {
        each!(self, run => run.path.clone().completed().err().map(|error| error.to_string()))
    }

    fn field(name: &str) -> PyResult<Field> {
        Ok(match name {
            "displacement" => Field::Displacement,
            "largest stretch" => Field::LargestStretch,
            "von Mises stress" => Field::MisesStress,
            "mean stress" => Field::MeanStress,
            other => {
                let known = "displacement, largest stretch, von Mises stress, mean stress";
                return Err(Error::new_err(format!("plot: no field {other:?}; there are {known}")));
            }
        })
    }
}

/// Points as an array, a row for each.
fn point_rows<'py, const D: usize>(py: Python<'py>, points: &[Point<D>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = points.iter().flat_map(|point| point.iter().copied()).collect();
    PyArray1::from_vec(py, flat).reshape([points.len(), D])
}

/// Tensors as an array, 3 × 3 for each.
fn tensors<'py>(py: Python<'py>, tensors: &[Matrix3<f64>]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: Vec<f64> = tensors.iter().flat_map(|t| (0..9).map(|c| t[(c / 3, c % 3)])).collect();
    PyArray1::from_vec(py, flat).reshape([tensors.len(), 3, 3])
}

#[pymethods]
impl Path {
    fn __len__(&self) -> usize {
        each!(self, run => run.path.steps.len() + 1)
    }

    fn __getitem__(&self, index: isize) -> PyResult<Self> {
        let count = self.__len__() as isize;
        let state = if index < 0 { index + count } else { index };
        if !(0..count).contains(&state) {
            return Err(PyIndexError::new_err(format!("state {index} of {count}")));
        }
        let run = match &self.run {
            AnyRun::One(run) => AnyRun::One(run.clone()),
            AnyRun::Two(run) => AnyRun::Two(run.clone()),
            AnyRun::Three(run) => AnyRun::Three(run.clone()),
        };
        Ok(Path { run, state: state as usize })
    }

    /// How the run ended: "completed", "stopped", "stalled".
    #[getter]
    fn ending(&self) -> &'static str {
        each!(self, run => crate::scheme::ending(&run.path.ending))
    }

    /// What makes the path doubtful, a sentence for each doubt, also what only the problem can tell: undeclared contact, surfaces that
    /// are compressed beyond Biot's limit.
    #[getter]
    fn doubts(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let doubts = each!(self, run => run.told(py, |run| run.problem.verdict(&run.path)))?;
        Ok(doubts.iter().map(ToString::to_string).collect())
    }

    /// Newton iterations, those of rejected steps included.
    #[getter]
    fn iterations(&self) -> usize {
        each!(self, run => run.path.iterations)
    }

    /// Displacement unknowns.
    #[getter]
    fn unknowns(&self) -> usize {
        each!(self, run => run.problem.model().unknowns())
    }

    /// Seconds from particles to the last state.
    #[getter]
    fn seconds(&self) -> f64 {
        each!(self, run => run.seconds)
    }

    /// The value of `of`, where `within` asked for one: extrapolated from a series of models, of which this path is the last.
    #[getter]
    fn value(&self) -> Option<f64> {
        each!(self, run => run.within.map(|within| within.value))
    }

    /// The bound of the relative error of `value`. Forces and fields are those of the model alone and are not bounded.
    #[getter]
    fn bound(&self) -> Option<f64> {
        each!(self, run => run.within.map(|within| within.bound))
    }

    /// Load factors of all states.
    #[getter]
    fn load<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, each!(self, run => run.states().map(|state| state.load).collect()))
    }

    /// Stored energies of all states, of the whole revolution for bodies of revolution.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let energies: Vec<f64> = each!(self, run => run.told(py, |run| {
            run.states().map(|state| run.problem.energy(state)).collect::<Result<_, _>>()
        }))?;
        Ok(PyArray1::from_vec(py, energies))
    }

    /// Particles at rest [length].
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        each!(self, run => {
            let displaced = run.told(py, |run| run.problem.particle_displacements(run.state(0)))?.len();
            point_rows(py, &run.problem.positions()[..displaced])
        })
    }

    /// Displacements at the particles [length].
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        each!(self, run => {
            point_rows(py, &run.told(py, |run| run.problem.particle_displacements(run.state(self.state)))?)
        })
    }

    /// Cauchy stresses at the particles [stress], 3 × 3 for each, in equilibrium with the loads for a single body.
    #[getter]
    fn cauchy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        tensors(py, &each!(self, run => run.told(py, |run| run.cauchy(run.state(self.state))))?)
    }

    /// Deformation gradients at the particles, means of the points around each, 3 × 3.
    #[getter]
    fn gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        tensors(py, &each!(self, run => run.told(py, |run| run.gradients(run.state(self.state))))?)
    }

    /// Largest principal stretches at the particles.
    #[getter]
    fn stretch<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = each!(self, run => run.told(py, |run| run.gradients(run.state(self.state))))?;
        Ok(PyArray1::from_vec(py, found.iter().map(|f| f.singular_values().max()).collect()))
    }

    /// Displacements at points of the body at rest [length].
    fn displacement_at<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        each!(self, run => {
            let at = self::points(points)?;
            let state = run.state(self.state);
            let found: Vec<_> = run.told(py, |run| {
                at.iter().map(|x| run.problem.displacement(state, x)).collect::<Result<_, _>>()
            })?;
            point_rows(py, &found)
        })
    }

    /// Cauchy stresses at points of the body at rest [stress], for scenes of one body.
    fn cauchy_at<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let found = each!(self, run => {
            let at = self::points(points)?;
            let state = run.state(self.state);
            run.told(py, |run| {
                let field = run.problem.stress_field(state)?;
                at.iter().map(|x| field.at(x)).collect::<Result<Vec<_>, _>>()
            })?
        });
        tensors(py, &found)
    }

    /// The force on the body by the conditions at a place, or by the condition, rigid body or contact of a name, in this state.
    fn reaction<'py>(&self, py: Python<'py>, place: &Bound<'_, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let place = Place::of(place)?;
        each!(self, run => {
            let (state, at, name) = (run.state(self.state), place.to()?, place.plain_name());
            Ok(run.told(py, |run| run.force(state, &at, name))?.as_slice().to_pyarray(py))
        })
    }

    /// The same in all states, a row for each.
    fn force<'py>(&self, py: Python<'py>, place: &Bound<'_, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let place = Place::of(place)?;
        each!(self, run => {
            let (at, name) = (place.to()?, place.plain_name());
            let forces: Vec<_> = run.told(py, |run| {
                run.states().map(|state| run.force(state, &at, name)).collect::<Result<_, _>>()
            })?;
            point_rows(py, &forces)
        })
    }

    /// The moment about a point of the forces by the conditions at a place, in this state: three components.
    fn moment<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'_, PyAny>,
        about: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let place = Place::of(place)?;
        each!(self, run => {
            let (state, at, about) = (run.state(self.state), place.to()?, array(&about, "moment")?);
            Ok(run.told(py, |run| run.problem.moment(state, at, about))?.to_pyarray(py))
        })
    }

    /// A contact in this state: force on the body, what touches (`extent`: width or area), and by boundary particle `points`, `pressure`
    /// and `gap`.
    fn contact<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        each!(self, run => {
            let found = run.told(py, |run| run.problem.contact(run.state(self.state), name))?;
            let told = PyDict::new(py);
            told.set_item("force", found.force.as_slice().to_pyarray(py))?;
            told.set_item("extent", found.extent)?;
            let positions: Vec<_> = found.points.iter().map(|point| point.position).collect();
            told.set_item("points", point_rows(py, &positions)?)?;
            let numbers = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
                found.points.iter().map(|point| of(&(point.pressure, point.gap))).collect()
            };
            told.set_item("pressure", PyArray1::from_vec(py, numbers(|pair| pair.0)))?;
            told.set_item("gap", PyArray1::from_vec(py, numbers(|pair| pair.1)))?;
            Ok(told)
        })
    }

    /// The problem's shape functions at points: `(data, indices, indptr)` of a sparse matrix, points × particles, for
    /// `scipy.sparse.csr_matrix`.
    fn shape_functions<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<crate::shape::Csr<'py>> {
        each!(self, run => {
            let at = self::points(points)?;
            let found: Vec<_> = run.told(py, |run| {
                at.iter().map(|x| run.problem.shape_functions(x)).collect::<Result<_, _>>()
            })?;
            Ok(crate::shape::csr(py, &found))
        })
    }

    /// Writes the path for ParaView, `name.pvd` with a `.vtu` file for each state, and its forces and moments as `name.csv`.
    fn write(&self, py: Python<'_>, file: std::path::PathBuf) -> PyResult<()> {
        each!(self, run => run.told(py, |run| run.problem.write(&run.path, file)))
    }

    /// This state as an object of pyvista, which has to be installed.
    fn pyvista<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pyvista = py.import("pyvista")?;
        let folder = py.import("tempfile")?.call_method0("TemporaryDirectory")?;
        let file = std::path::Path::new(&folder.getattr("name")?.extract::<String>()?).join("state.vtu");
        each!(self, run => {
            let grid = run.told(py, |run| run.problem.vtk_grid(run.state(self.state)))?;
            grid.write(&file).map_err(refused)?;
        });
        let read = pyvista.call_method1("read", (&file,));
        folder.call_method0("cleanup")?;
        read
    }

    /// A picture of this state, coloured by "displacement", "largest stretch", "von Mises stress" or "mean stress". A notebook shows it.
    #[pyo3(signature = (field="displacement", *, title=None))]
    fn plot(&self, py: Python<'_>, field: &str, title: Option<String>) -> PyResult<Picture> {
        let field = Path::field(field)?;
        let drawn = each!(self, run => run.told(py, |run| run.problem.picture(run.state(self.state), field)))?;
        Ok(Picture(match title {
            Some(title) => drawn.title(title),
            None => drawn,
        }))
    }

    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.plot(py, "displacement", None)?._repr_svg_()
    }

    fn __repr__(&self) -> String {
        each!(self, run => format!(
            "<rkpm.Path {}: load factor {}, {} unknowns, {} steps, {} iterations, {:.3} s>",
            self.ending(), run.state(self.state).load, self.unknowns(), run.path.steps.len(), run.path.iterations, run.seconds
        ))
    }
}

/// A picture that a notebook shows.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Picture(Drawing);

#[pymethods]
impl Picture {
    fn _repr_svg_(&self) -> PyResult<String> {
        self.0.to_svg().map_err(refused)
    }

    /// Writes the picture as SVG, or without title and colour bar to a file that ends with .png.
    fn save(&self, file: std::path::PathBuf) -> PyResult<()> {
        match file.extension().is_some_and(|end| end == "png") {
            true => Ok(std::fs::write(file, self.0.to_png().map_err(refused)?)?),
            false => self.0.write(file).map_err(refused),
        }
    }
}
