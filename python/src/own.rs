//! A law by a Python function.

use numpy::{IxDyn, PyArray2, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rkpm::material::{Material, Past, Response};
use rkpm::nalgebra::Matrix3;
use rkpm::tensor::Tangent;

use crate::fault::{Callback, Error, Fault};

/// Half the interval of the central differences of a tangent: the root of rounding over twice its size.
const DIFFERENCE: f64 = 1e-6;

/// The stress and, where it is given, the tangent and the energy by Python functions.
pub(crate) struct Own {
    stress: Callback,
    energy: Option<Callback>,
}

impl Own {
    pub(crate) fn new(stress: &Bound<'_, PyAny>, energy: Option<&Bound<'_, PyAny>>) -> Self {
        let stress = Callback::new(stress);
        let energy = energy.map(|energy| Callback::new(energy).sharing(&stress));
        Own { stress, energy }
    }

    pub(crate) fn fault(&self) -> Fault {
        self.stress.fault.clone()
    }

    fn evaluate(&self, f: &Matrix3<f64>) -> Option<(Matrix3<f64>, Option<Tangent>)> {
        self.stress.call(|function| {
            let given = function.call1((array(function.py(), f)?,))?;
            match given.cast::<PyTuple>() {
                Ok(pair) if pair.len() == 2 => {
                    let tangent = numbers::<81>(&pair.get_item(1)?, "tangent", "3 × 3 × 3 × 3")?;
                    Ok((stress(&pair.get_item(0)?)?, Some(Tangent::from_fn(|row, column| tangent[9 * row + column]))))
                }
                _ => Ok((stress(&given)?, None)),
            }
        })
    }
}

fn array<'py>(py: Python<'py>, f: &Matrix3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    crate::laws::rows(py, f.transpose().as_slice(), 3)
}

fn stress(given: &Bound<'_, PyAny>) -> PyResult<Matrix3<f64>> {
    let values = numbers::<9>(given, "stress", "3 × 3")?;
    Ok(Matrix3::from_fn(|i, j| values[3 * i + j]))
}

/// The numbers of an array in C's order.
fn numbers<const N: usize>(given: &Bound<'_, PyAny>, what: &str, shape: &str) -> PyResult<[f64; N]> {
    // Most functions give what needs no conversion.
    let array: PyReadonlyArrayDyn<'_, f64> = given
        .extract()
        .or_else(|_| crate::geometry::numbers(given, what))
        .map_err(|_| Error::new_err(format!("material: the {what} is no array of numbers, give {shape}")))?;
    let array = array.as_array();
    if array.len() != N {
        let found = array.shape().to_vec();
        return Err(Error::new_err(format!("material: the {what} is an array of {found:?}, give {shape}")));
    }
    let flat = array.to_shape(IxDyn(&[N])).map_err(|error| Error::new_err(error.to_string()))?;
    Ok(std::array::from_fn(|k| flat[k]))
}

impl Material for Own {
    fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
        let value = self
            .energy
            .as_ref()
            .and_then(|energy| energy.call(|function| function.call1((array(function.py(), f)?,))?.extract::<f64>()));
        value.unwrap_or(f64::NAN)
    }

    fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
        let Some((stress, tangent)) = self.evaluate(f) else { return Response::undefined() };
        let differences = || {
            let mut tangent = Tangent::zeros();
            for column in 0..9 {
                let mut sides = [*f, *f];
                sides[0][(column / 3, column % 3)] += DIFFERENCE;
                sides[1][(column / 3, column % 3)] -= DIFFERENCE;
                let [(plus, _), (minus, _)] = [self.evaluate(&sides[0])?, self.evaluate(&sides[1])?];
                for row in 0..9 {
                    let at = (row / 3, row % 3);
                    tangent[(row, column)] = (plus[at] - minus[at]) / (2.0 * DIFFERENCE);
                }
            }
            // Symmetric, as the tangent of an energy is.
            Some(0.5 * (tangent + tangent.transpose()))
        };
        match tangent.or_else(differences) {
            Some(tangent) => Response { stress, tangent },
            None => Response::undefined(),
        }
    }
}
