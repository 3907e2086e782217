//! What conditions have claimed of the particles: directions that were prescribed there, and whether another one says the
//! same again.

use std::sync::Arc;

use crate::error::BoundaryError;
use crate::geometry::Point;
use crate::term::Amplitude;

/// What is left of a direction beside those that were claimed before it, below which it is one of them: a row of its own
/// would repeat them but for a twentieth, and reactions would be twenty times as large as the forces they balance.
const REPEATED: f64 = 0.05;
/// The same for directions that are combinations of the claimed ones but for rounding, whose values have to agree.
const EXACT: f64 = 1e-9;

/// A direction of a particle that a condition has claimed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Claim {
    /// The unit vector, padded by zeros.
    direction: [f64; 3],
    label: String,
    target: f64,
    amplitude: Amplitude,
    /// The row that carries it.
    pub(crate) row: usize,
}

impl Claim {
    pub(crate) fn new<const D: usize>(
        direction: Point<D>,
        label: &str,
        target: f64,
        amplitude: Amplitude,
        row: usize,
    ) -> Self {
        let direction = std::array::from_fn(|i| if i < D { direction[i] } else { 0.0 });
        Claim { direction, label: label.to_string(), target, amplitude, row }
    }

    pub(crate) fn direction<const D: usize>(&self) -> Point<D> {
        Point::from_fn(|i, _| self.direction[i])
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The direction as a combination of the claimed ones, and what is left of it.
fn resolve(claims: &[Claim], direction: &[f64; 3]) -> (Vec<f64>, f64) {
    // Gram–Schmidt over at most three vectors, remembering how each basis vector is made of the claimed ones.
    let mut basis: Vec<([f64; 3], Vec<f64>)> = Vec::new();
    for (place, claim) in claims.iter().enumerate() {
        let (mut rest, mut made) = (claim.direction, vec![0.0; claims.len()]);
        made[place] = 1.0;
        for (vector, of) in &basis {
            let along = dot(vector, &claim.direction);
            rest.iter_mut().zip(vector).for_each(|(r, v)| *r -= along * v);
            made.iter_mut().zip(of).for_each(|(m, o)| *m -= along * o);
        }
        let size = dot(&rest, &rest).sqrt();
        if size > EXACT {
            basis.push((rest.map(|r| r / size), made.iter().map(|m| m / size).collect()));
        }
    }
    let (mut rest, mut parts) = (*direction, vec![0.0; claims.len()]);
    for (vector, of) in &basis {
        let along = dot(vector, direction);
        rest.iter_mut().zip(vector).for_each(|(r, v)| *r -= along * v);
        parts.iter_mut().zip(of).for_each(|(p, o)| *p += along * o);
    }
    (parts, dot(&rest, &rest).sqrt())
}

/// Whether a condition says again what the claims on its particle say.
///
/// # Errors
/// Where it says something else.
pub(crate) fn says_again<const D: usize>(
    claims: &[Claim],
    asked: &Claim,
    at: &Point<D>,
    rounding: f64,
) -> Result<bool, BoundaryError> {
    if claims.is_empty() {
        return Ok(false);
    }
    let (parts, rest) = resolve(claims, &asked.direction);
    if rest > REPEATED {
        return Ok(false);
    }
    if rest > EXACT {
        return Ok(true);
    }
    let component = (0..D).max_by(|&i, &j| asked.direction[i].abs().total_cmp(&asked.direction[j].abs())).unwrap_or(0);
    let involved: Vec<(&Claim, f64)> = claims.iter().zip(parts).filter(|(_, part)| part.abs() > EXACT).collect();
    let second = (asked.label.as_str(), asked.target, &asked.amplitude);
    match involved.as_slice() {
        [(claim, part)] => {
            let first = (claim.label.as_str(), part * claim.target, &claim.amplitude);
            check_agreement(first, second, component, at, rounding)?;
        }
        several => {
            let terms: Vec<(f64, Amplitude)> =
                several.iter().map(|(claim, part)| (part * claim.target, claim.amplitude.clone())).collect();
            let label = several.iter().map(|(claim, _)| claim.label.as_str()).collect::<Vec<_>>().join(" and ");
            let sum = move |load: f64| terms.iter().map(|(target, a)| target * a.evaluate(load).0).sum();
            check_agreement((&label, 1.0, &Amplitude::Function(Arc::new(sum))), second, component, at, rounding)?;
        }
    }
    Ok(true)
}

/// Whether claims prescribe a component.
pub(crate) fn spans(claims: &[Claim], component: usize) -> bool {
    let axis = std::array::from_fn(|i| f64::from(u8::from(i == component)));
    !claims.is_empty() && resolve(claims, &axis).1 <= REPEATED
}

/// The component of the unknown that a row along a direction owns: its largest one that no earlier row of the particle has.
pub(crate) fn own_component<const D: usize>(
    claims: &[Claim],
    direction: &Point<D>,
    owned: impl Fn(usize) -> usize,
) -> usize {
    let taken = |i: &usize| claims.iter().any(|claim| owned(claim.row) == *i);
    (0..D)
        .filter(|i| !taken(i))
        .max_by(|&i, &j| direction[i].abs().total_cmp(&direction[j].abs()).then(j.cmp(&i)))
        .unwrap_or(0)
}

/// Refuses two conditions (label, target, amplitude) on one component that say different things at a point, with the
/// values at the full load, or at the first load found where they differ.
pub(crate) fn check_agreement<const D: usize>(
    first: (&str, f64, &Amplitude),
    second: (&str, f64, &Amplitude),
    component: usize,
    at: &Point<D>,
    rounding: f64,
) -> Result<(), BoundaryError> {
    let same = |[a, b]: [f64; 2]| (a - b).abs() <= rounding + 1e-12 * a.abs().max(b.abs());
    let found = if first.2 == second.2 {
        Some((1.0, [first.1, second.1])).filter(|&(_, values)| !same(values))
    } else {
        // At some loads and at the break points of tables; those of functions can't be known.
        let break_points = first.2.break_points().into_iter().chain(second.2.break_points());
        let loads = [1.0, 0.0, 0.21, 0.47, 0.76].into_iter().chain(break_points);
        let both = |load: f64| (load, [first, second].map(|(_, g, a)| g * a.evaluate(load).0));
        loads.map(both).find(|&(_, values)| !same(values))
    };
    let Some((load, values)) = found else { return Ok(()) };
    for ((label, ..), value) in [first, second].into_iter().zip(values) {
        if !value.is_finite() {
            return Err(BoundaryError::Value { what: label.to_string(), value, load });
        }
    }
    let (first, second) = (first.0.to_string(), second.0.to_string());
    Err(BoundaryError::Conflict { first, second, component, at: at.as_slice().to_vec(), values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(direction: [f64; 2], target: f64) -> Claim {
        Claim::new(Point::<2>::from(direction), "a plane", target, Amplitude::Ramp, 0)
    }

    #[test]
    fn a_direction_between_two_claimed_ones_repeats_them() {
        let at = Point::<2>::zeros();
        let claims = [claim([1.0, 0.0], 0.3), claim([0.6, 0.8], 0.5)];
        // u = (0.3, 0.4): along the second axis 0.4.
        assert!(says_again(&claims, &claim([0.0, 1.0], 0.4), &at, 0.0).unwrap());
        assert!(says_again(&claims, &claim([0.0, 1.0], 0.41), &at, 0.0).is_err());
        assert!(says_again(&claims[..1], &claim([-1.0, 0.0], -0.3), &at, 0.0).unwrap());
        assert!(!says_again(&claims[..1], &claim([0.6, 0.8], 9.0), &at, 0.0).unwrap());
        assert!(!says_again(&[], &claim([0.6, 0.8], 9.0), &at, 0.0).unwrap());
        // Nearly the same direction: merged, whatever it says.
        let slight = claim([1.0_f64.cos().mul_add(0.0, 0.9999), 0.0141], 0.0);
        assert!(says_again(&claims[..1], &slight, &at, 0.0).unwrap());
    }
}
