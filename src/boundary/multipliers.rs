//! Lagrange multipliers (4.5)–(4.19).

use crate::assembly::{Pattern, System};
use crate::error::BoundaryError;
use crate::linear::{Direct, LinearSolver, LinearSystem, MatrixClass};
use crate::order::merged;

use super::{ConstraintEquation, Constraints, Enforced, Enforcement, pattern_fits};

/// Lagrange multipliers: the saddle point system (4.11),
/// $$\begin{bmatrix}K + G^T R\\,G & G^T\\ G & 0\end{bmatrix}
///   \begin{bmatrix}\delta d\\ \mu\end{bmatrix} = \begin{bmatrix}-r + G^T R\\,\gamma\\ \gamma\end{bmatrix},
///   \qquad \gamma = g - G d,$$
/// eliminated with each multiplier right after the last unknown of its constraint equation. The augmentation $G^T R\\,G$ does not
/// change the solution; it makes the block of the unknowns regular where the constraint equations alone support the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LagrangeMultipliers;

/// The same system without its augmentation, which couples all particles near a face: for iterations that meet the constraint
/// equations in every direction.
pub(crate) struct Unaugmented;

struct Bound {
    full: usize,
    augmented: bool,
    pattern: Pattern,
    /// Constraint equations scaled to a largest entry of one, and the scale.
    equations: Vec<(Vec<(usize, f64)>, f64)>,
    /// Place of each entry of the full pattern.
    destination: Vec<u32>,
    /// (place, constraint equation, coefficient product) of the augmentation.
    augmentation: Vec<(u32, f64)>,
    /// (place, coefficient) of the constraint equations themselves.
    entries: Vec<(u32, f64)>,
    /// Stiffness that the constraint equations were last scaled with.
    stiffness: f64,
    /// Place of each full unknown in the saddle point system, then of each multiplier.
    place_of: Vec<u32>,
    /// The other way round: `full` and more are multipliers.
    number_of: Vec<u32>,
}

impl Enforcement for LagrangeMultipliers {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
        Ok(Box::new(Bound::new(pattern, equations, true)?))
    }
}

impl Enforcement for Unaugmented {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
        Ok(Box::new(Bound::new(pattern, equations, false)?))
    }
}

impl Bound {
    fn new(pattern: &Pattern, equations: &Constraints, augmented: bool) -> Result<Self, BoundaryError> {
        let full = pattern.size();
        pattern_fits(pattern, equations)?;
        let mut columns: Vec<Vec<u32>> = (0..full).map(|c| pattern.column(c).to_vec()).collect();
        columns.resize(full + equations.len(), Vec::new());
        let mut scaled = Vec::with_capacity(equations.len());
        for (r, equation) in equations.equations().iter().enumerate() {
            let largest = equation.largest();
            if !(largest > 0.0) {
                return Err(BoundaryError::Dependent { equation: r, what: equation.label.clone(), pivot: 0.0 });
            }
            let entries: Vec<(usize, f64)> =
                equation.entries.iter().filter(|e| e.1 != 0.0).map(|&(k, c)| (k, c / largest)).collect();
            for &(a, _) in &entries {
                columns[a].push((full + r) as u32);
                columns[a].extend(entries.iter().filter(|e| augmented && e.0 > a).map(|e| e.0 as u32));
            }
            scaled.push((entries, 1.0 / largest));
        }
        if let Some(dependent) = first_dependent(equations.equations(), &scaled) {
            return Err(dependent);
        }
        let saddle = Pattern::from_columns(columns);
        let place = |row: usize, column: usize| saddle.find(row, column).unwrap_or(0) as u32;
        let mut destination = Vec::with_capacity(pattern.entries());
        for column in 0..full {
            // Both lists rise.
            let mut at = saddle.columns[column];
            for &row in pattern.column(column) {
                while saddle.rows[at] < row {
                    at += 1;
                }
                destination.push(at as u32);
            }
        }
        let mut augmentation = Vec::new();
        let mut entries = Vec::new();
        for (r, (equation, _)) in scaled.iter().enumerate() {
            for &(a, ca) in equation {
                entries.push((place(full + r, a), ca));
                for &(b, cb) in equation.iter().filter(|&&(b, _)| augmented && b >= a) {
                    augmentation.push((place(b, a), ca * cb));
                }
            }
        }
        let numbers: Vec<u32> = (0..(full + equations.len()) as u32).collect();
        Ok(Bound {
            full,
            augmented,
            pattern: saddle,
            equations: scaled,
            destination,
            augmentation,
            entries,
            stiffness: 1.0,
            place_of: numbers.clone(),
            number_of: numbers,
        })
    }
}

/// Number of constraint equations beyond which a factorisation of $G G^T$ first tells whether they are independent. Elimination one by
/// one, which names the dependent equation, costs the third power of their number.
const MANY: usize = 100;

/// The first constraint equation that depends on earlier ones.
fn first_dependent(equations: &[ConstraintEquation], scaled: &[(Vec<(usize, f64)>, f64)]) -> Option<BoundaryError> {
    if equations.len() > MANY && independent(scaled) {
        return None;
    }
    dependent_rows(equations).into_iter().next()
}

/// Whether $G G^T$ has factors that solve.
fn independent(scaled: &[(Vec<(usize, f64)>, f64)]) -> bool {
    use std::collections::HashMap;
    let mut users: HashMap<usize, Vec<(u32, f64)>> = HashMap::new();
    for (r, (equation, _)) in scaled.iter().enumerate() {
        equation.iter().for_each(|&(k, c)| users.entry(k).or_default().push((r as u32, c)));
    }
    let (mut columns, mut values) = (vec![0], Vec::new());
    let mut all = Vec::new();
    for (r, (equation, _)) in scaled.iter().enumerate() {
        let mut products: Vec<(u32, f64)> = Vec::new();
        for (k, c) in equation {
            products.extend(users[k].iter().filter(|user| user.0 as usize >= r).map(|&(other, d)| (other, c * d)));
        }
        for (other, product) in merged(products) {
            all.push(other);
            values.push(product);
        }
        columns.push(all.len());
    }
    let pattern = Pattern { columns, rows: std::sync::Arc::new(all) };
    let Ok(mut direct) = Direct::of(&pattern, MatrixClass::Definite, None) else { return false };
    let system = LinearSystem::of(&values);
    if !matches!(direct.factorize(&system), Ok(Some(inertia)) if inertia.negative == 0) {
        return false;
    }
    let mut x: Vec<f64> = (0..scaled.len()).map(|k| (1.3 * k as f64).sin()).collect();
    // Products of independent constraint equations are mass matrices with a condition of some thousand.
    direct.solve(&system, &mut x, None).is_ok() && x.iter().all(|x| x.abs() < 1e10)
}

/// The constraint equations that depend on earlier ones, by elimination among constraint equations that share unknowns.
pub(crate) fn dependent_rows(equations: &[ConstraintEquation]) -> Vec<BoundaryError> {
    use std::collections::BTreeMap;
    let mut dependent = Vec::new();
    // Sparse Gaussian elimination: reduced constraint equations are found by their pivot unknown.
    let mut reduced: BTreeMap<usize, BTreeMap<usize, f64>> = BTreeMap::new();
    for (r, equation) in equations.iter().enumerate() {
        let scale = if equation.largest() > 0.0 { equation.largest() } else { 1.0 };
        let mut left: BTreeMap<usize, f64> = BTreeMap::new();
        for &(k, c) in &equation.entries {
            *left.entry(k).or_insert(0.0) += c / scale;
        }
        // Eliminate by rising pivot order of creation until no pivot unknown is left.
        while let Some((unknown, factor)) =
            left.iter().find(|(k, v)| **v != 0.0 && reduced.contains_key(k)).map(|(k, v)| (*k, *v))
        {
            for (k, value) in &reduced[&unknown] {
                *left.entry(*k).or_insert(0.0) -= factor * value;
            }
            left.remove(&unknown);
        }
        let pivot = left.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|(k, v)| (*k, *v));
        match pivot {
            Some((pivot, size)) if size.abs() > 1e-10 => {
                let mut equation: BTreeMap<usize, f64> = left.into_iter().map(|(k, v)| (k, v / size)).collect();
                equation.insert(pivot, 1.0);
                // Keep earlier equations free of the new pivot, so that one pass over each equation suffices.
                for other in reduced.values_mut() {
                    if let Some(factor) = other.get(&pivot).copied().filter(|f| *f != 0.0) {
                        for (k, value) in &equation {
                            *other.entry(*k).or_insert(0.0) -= factor * value;
                        }
                        other.remove(&pivot);
                    }
                }
                reduced.insert(pivot, equation);
            }
            other => dependent.push(BoundaryError::Dependent {
                equation: r,
                what: equation.label.clone(),
                pivot: other.map_or(0.0, |(_, v)| v.abs()),
            }),
        }
    }
    dependent
}

impl Enforced for Bound {
    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn class(&self) -> MatrixClass {
        MatrixClass::Saddle { constraints: self.equations.len() }
    }

    fn unknowns(&self) -> usize {
        self.full + self.equations.len()
    }

    fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
        values.clear();
        values.resize(self.pattern.entries(), 0.0);
        let mut stiffness: f64 = 0.0;
        for (value, &place) in full.values.iter().zip(&self.destination) {
            values[place as usize] += value;
            stiffness = stiffness.max(value.abs());
        }
        if let Some(ranks) = &full.ranks {
            stiffness = -ranks.least(-stiffness);
        }
        self.stiffness = if stiffness > 0.0 { stiffness } else { 1.0 };
        // The contribution of the constraint equations is counted once in the sum over the ranks.
        if full.ranks.as_ref().is_some_and(|ranks| ranks.rank() > 0) {
            return;
        }
        for &(place, product) in &self.augmentation {
            values[place as usize] += self.stiffness * product;
        }
        for &(place, coefficient) in &self.entries {
            values[place as usize] += self.stiffness * coefficient;
        }
    }

    fn restrict(&self, force: &[f64], violation: &[f64], _full: &System, rhs: &mut Vec<f64>) {
        self.project(force, rhs);
        for (((equation, scale), g), &multiplier) in
            self.equations.iter().zip(violation).zip(&self.place_of[self.full..])
        {
            let scaled = self.stiffness * scale * g;
            for &(k, c) in equation.iter().filter(|_| self.augmented) {
                rhs[self.place_of[k] as usize] += c * scaled;
            }
            rhs[multiplier as usize] = scaled;
        }
    }

    fn project(&self, full: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.number_of.iter().map(|&number| full.get(number as usize).copied().unwrap_or(0.0)));
    }

    fn imbalance(&self, residual: &[f64], multipliers: &[f64], out: &mut Vec<f64>) {
        self.project(residual, out);
        for ((equation, scale), mu) in self.equations.iter().zip(multipliers) {
            for &(k, c) in equation {
                out[self.place_of[k] as usize] += c / scale * mu;
            }
        }
    }

    fn recover(&self, solved: &[f64], _gap: &[f64], step: &mut [f64], multipliers: &mut [f64]) {
        let (unknowns, places) = self.place_of.split_at(self.full);
        for (step, &place) in step.iter_mut().zip(unknowns) {
            *step = solved[place as usize];
        }
        for ((mu, &place), (_, scale)) in multipliers.iter_mut().zip(places).zip(&self.equations) {
            *mu = solved[place as usize] * self.stiffness * scale;
        }
    }

    fn renumber(&mut self, order: &[usize]) -> bool {
        let (pattern, places) = self.pattern.permuted(order);
        self.pattern = pattern;
        let entries = self.augmentation.iter_mut().chain(&mut self.entries).map(|(place, _)| place);
        self.destination.iter_mut().chain(entries).for_each(|place| *place = places[*place as usize]);
        self.number_of = order.iter().map(|&old| self.number_of[old]).collect();
        for (new, &number) in self.number_of.iter().enumerate() {
            self.place_of[number as usize] = new as u32;
        }
        true
    }

    fn full_index(&self, reduced: usize) -> Option<usize> {
        self.number_of.get(reduced).map(|&number| number as usize).filter(|&number| number < self.full)
    }
}
