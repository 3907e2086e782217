//! What a table asks of shape functions, of one's own ones too.

use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::shape::ShapeFunctions;

/// Refuses functions that a table could not hold: values and gradients for each node, nodes rising and there,
/// numbers finite.
pub(super) fn check_functions<const D: usize>(
    psi: &ShapeFunctions<D>,
    nodes: usize,
    at: &Point<D>,
) -> Result<(), ApproximationError> {
    check_values(psi, nodes, at)?;
    ensure!(
        psi.gradients.len() == psi.nodes.len(),
        ApproximationError::Length {
            what: "gradients at a point",
            given: psi.gradients.len(),
            particles: psi.nodes.len()
        }
    );
    let mut finite = true;
    for gradient in &psi.gradients {
        for i in 0..D {
            finite &= gradient[i].is_finite();
        }
    }
    if finite {
        return Ok(());
    }
    let check = |g: &Point<D>| check_finite("the gradient of a shape function", g.as_slice(), at.as_slice());
    psi.gradients.iter().try_for_each(check)
}

/// The same for values alone: smoothed tables need no gradients.
pub(crate) fn check_values<const D: usize>(
    psi: &ShapeFunctions<D>,
    nodes: usize,
    at: &Point<D>,
) -> Result<(), ApproximationError> {
    let particles = psi.nodes.len();
    ensure!(
        psi.values.len() == particles,
        ApproximationError::Length { what: "values at a point", given: psi.values.len(), particles }
    );
    let last = psi.nodes.last().map_or(0, |&n| n as usize);
    if psi.nodes.windows(2).any(|w| w[0] >= w[1]) || (particles > 0 && last >= nodes) {
        return Err(ApproximationError::Particle {
            particle: last,
            what: "an approximation lists nodes at a point that do not rise, or do not exist",
            remedy: "list each node once, by rising index",
        });
    }
    check_finite("the value of a shape function", &psi.values, at.as_slice())
}

fn check_finite(what: &'static str, numbers: &[f64], at: &[f64]) -> Result<(), ApproximationError> {
    // Without a way out in the middle whole registers are compared at once.
    if numbers.iter().fold(true, |finite, x| finite & x.is_finite()) {
        return Ok(());
    }
    let value = numbers.iter().copied().find(|x| !x.is_finite()).unwrap_or(f64::NAN);
    let (at, remedy) = (format!("X = {at:?}"), "an approximation gives finite values and gradients");
    Err(ApproximationError::Function { what, value, at, remedy })
}
