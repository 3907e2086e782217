//! Shape functions alone, for solvers of one's own.

use numpy::PyArray1;
use pyo3::prelude::*;
use rkpm::geometry::Point;
use rkpm::kernel::CubicSpline;
use rkpm::particles::{Particles, Support};
use rkpm::prelude::{Approximation, Polynomial, ReproducingKernel, ShapeFunctions};

use crate::fault::{Error, refused};
use crate::geometry::{numbers, points};

/// Values, columns and the beginnings of rows, as `scipy.sparse.csr_matrix` takes them.
pub(crate) type Csr<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>);

/// Values at points as sparse rows.
pub(crate) fn csr<'py, const D: usize>(py: Python<'py>, functions: &[ShapeFunctions<D>]) -> Csr<'py> {
    with(py, functions, |psi| psi.values.clone())
}

fn with<'py, const D: usize>(
    py: Python<'py>,
    functions: &[ShapeFunctions<D>],
    values: impl Fn(&ShapeFunctions<D>) -> Vec<f64>,
) -> Csr<'py> {
    let data = functions.iter().flat_map(values).collect();
    let indices = functions.iter().flat_map(|psi| psi.nodes.iter().map(|node| *node as i32)).collect();
    let mut starts = vec![0];
    for psi in functions {
        starts.push(starts[starts.len() - 1] + psi.nodes.len() as i32);
    }
    (PyArray1::from_vec(py, data), PyArray1::from_vec(py, indices), PyArray1::from_vec(py, starts))
}

/// Reproducing kernel shape functions of particles (n × D) with balls or boxes of radius `support` (one number, or one for each particle)
/// [length], tabulated at points (m × D): `(values, gradients)`, `values` as `(data, indices, indptr)` for
/// `scipy.sparse.csr_matrix(…, shape=(m, n))`, `gradients` a list of such, one for each axis.
#[pyfunction]
#[pyo3(signature = (particles, points, support, *, order=1, boxes=true))]
pub(crate) fn shape_functions<'py>(
    py: Python<'py>,
    particles: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    support: &Bound<'py, PyAny>,
    order: u8,
    boxes: bool,
) -> PyResult<(Csr<'py>, Vec<Csr<'py>>)> {
    let dimension = numbers::<f64>(particles, "particles")?.as_array().shape().last().copied().unwrap_or(0);
    match dimension {
        1 => tabulated::<1>(py, particles, points, support, order, boxes),
        2 => tabulated::<2>(py, particles, points, support, order, boxes),
        3 => tabulated::<3>(py, particles, points, support, order, boxes),
        other => Err(Error::new_err(format!("particles: {other} coordinates, give 1, 2 or 3"))),
    }
}

fn tabulated<'py, const D: usize>(
    py: Python<'py>,
    particles: &Bound<'py, PyAny>,
    at: &Bound<'py, PyAny>,
    support: &Bound<'py, PyAny>,
    order: u8,
    boxes: bool,
) -> PyResult<(Csr<'py>, Vec<Csr<'py>>)> {
    let positions = points::<D>(particles)?;
    let at = points::<D>(at)?;
    let sizes: Vec<f64> = numbers::<f64>(support, "support")?.as_array().iter().copied().collect();
    let own = |size: f64| if boxes { Support::Box(Point::repeat(size)) } else { Support::Ball(size) };
    let supports = match sizes[..] {
        [size] => vec![own(size); positions.len()],
        _ => sizes.into_iter().map(own).collect(),
    };
    let found = py.detach(|| {
        let particles = Particles::new(positions, supports)?;
        let kernel = ReproducingKernel::new(particles, CubicSpline, Polynomial::new(order))?;
        at.iter().map(|x| kernel.shape_functions(x)).collect::<Result<Vec<_>, _>>()
    });
    let found = found.map_err(refused)?;
    let gradients = (0..D).map(|axis| with(py, &found, |psi| psi.gradients.iter().map(|g| g[axis]).collect()));
    Ok((csr(py, &found), gradients.collect()))
}
