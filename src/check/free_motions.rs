//! Rigid motions that nothing resists.

use std::fmt;

use nalgebra::DMatrix;

use crate::assembly::StateRef;
use crate::geometry::Point;
use crate::scene::Problem;

/// Energy of a motion and what rows see of it, squares relative to stiffness and size, below which it is free.
/// Rounding leaves 1e-15; a radial motion of a far, thin ring has 1e-6.
const FREE: f64 = 1e-12;

/// A rigid motion that neither conditions nor energy resist: $u = t + \Omega\\,(X - X_0)$.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeMotion {
    /// The translation $t$, components relative to the largest displacement of the motion.
    pub translation: Vec<f64>,
    /// $\Omega_{ij} = -\Omega_{ji}$, $i > j$, as (i, j, part of the largest displacement that it gives).
    pub rotations: Vec<(usize, usize, f64)>,
    /// The centre $X_0$ of the rotations: the mean position of the particles \[length\].
    pub centre: Vec<f64>,
}

impl fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Parts below a hundredth say nothing to a reader.
        let mut word = "";
        for (axis, part) in self.translation.iter().enumerate().filter(|(_, part)| part.abs() > 0.01) {
            write!(f, "{word}{part:.2} of a translation along axis {axis}")?;
            word = " and ";
        }
        for (i, j, part) in self.rotations.iter().filter(|r| r.2.abs() > 0.01) {
            write!(f, "{word}{part:.2} of a rotation in the plane of axes {j} and {i}")?;
            word = " and ";
        }
        Ok(())
    }
}

/// Combinations of translations and infinitesimal rotations that cost no energy at rest and that no row sees.
pub(super) fn free_motions<const D: usize>(problem: &Problem<D>) -> Vec<FreeMotion> {
    let (model, equations) = (problem.model(), problem.equations());
    let positions = model.positions();
    let centre = positions.iter().sum::<Point<D>>() / positions.len() as f64;
    let size = positions.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
    let mut kinds: Vec<(usize, Option<usize>)> = (0..D).map(|i| (i, None)).collect();
    kinds.extend((0..D).flat_map(|i| (0..i).map(move |j| (i, Some(j)))));
    // Shape functions reproduce linear fields: their values at the particles are the coefficients.
    let motion = |kind: &(usize, Option<usize>)| -> Vec<f64> {
        let value = |x: Point<D>, k: usize| match *kind {
            (i, None) => f64::from(u8::from(k == i)),
            (i, Some(j)) if k == i => x[j] / size,
            (i, Some(j)) if k == j => -x[i] / size,
            _ => 0.0,
        };
        positions.iter().flat_map(|x| (0..D).map(move |k| value(x - centre, k))).collect()
    };
    let motions: Vec<Vec<f64>> = kinds.iter().map(motion).collect();
    let m = motions.len();
    let mut assembler = model.assembler();
    let mut system = Default::default();
    assembler.assemble_own(model, StateRef::new(&vec![0.0; model.unknowns()], &model.start(), 0.0), &mut system);
    let pattern = assembler.pattern();
    let stiffness = (0..pattern.size()).map(|c| system.values[pattern.columns[c]].abs()).fold(0.0, f64::max);
    let energies: Vec<Vec<f64>> = motions
        .iter()
        .map(|motion| {
            let mut force = vec![0.0; motion.len()];
            pattern.multiply_add(&system.values, motion, &mut force);
            force
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut resistance =
        DMatrix::<f64>::from_fn(m, m, |a, b| dot(&motions[a], &energies[b]) / (stiffness * positions.len() as f64));
    for row in equations.equations() {
        let scale: f64 = row.entries.iter().map(|e| e.1.abs()).sum();
        let seen: Vec<f64> =
            motions.iter().map(|r| row.entries.iter().map(|&(k, c)| c * r[k]).sum::<f64>() / scale).collect();
        for a in 0..m {
            for b in 0..m {
                resistance[(a, b)] += seen[a] * seen[b];
            }
        }
    }
    if !resistance.iter().all(|r| r.is_finite()) {
        return Vec::new();
    }
    let resistance = (&resistance + resistance.transpose()) * 0.5;
    let spectrum = resistance.symmetric_eigen();
    let free: Vec<usize> = (0..m).filter(|&k| spectrum.eigenvalues[k] <= FREE).collect();
    // Any basis of the space serves; the reduced one has a translation or rotation of its own in each motion.
    let mut basis = DMatrix::<f64>::from_fn(free.len(), m, |a, k| spectrum.eigenvectors[(k, free[a])]);
    reduce(&mut basis);
    (0..free.len())
        .map(|a| {
            let largest = basis.row(a).iter().copied().max_by(|v, w| v.abs().total_cmp(&w.abs())).unwrap_or(1.0);
            let part = |k: usize| basis[(a, k)] / largest;
            FreeMotion {
                translation: (0..D).map(part).collect(),
                rotations: (D..m).map(|k| (kinds[k].0, kinds[k].1.unwrap_or(0), part(k))).collect(),
                centre: centre.as_slice().to_vec(),
            }
        })
        .collect()
}

/// Gauss–Jordan elimination with row and column pivots: the rows span the same space.
fn reduce(basis: &mut DMatrix<f64>) {
    let mut used = Vec::new();
    for row in 0..basis.nrows() {
        let column = (0..basis.ncols())
            .filter(|c| !used.contains(c))
            .max_by(|&a, &b| basis[(row, a)].abs().total_cmp(&basis[(row, b)].abs()));
        let Some(column) = column else { return };
        used.push(column);
        let pivot = basis[(row, column)];
        for other in (0..basis.nrows()).filter(|&other| other != row) {
            let factor = basis[(other, column)] / pivot;
            for c in 0..basis.ncols() {
                let change = factor * basis[(row, c)];
                basis[(other, c)] -= change;
            }
        }
    }
}
