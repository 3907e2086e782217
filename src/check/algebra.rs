//! Dense symmetric algebra of the certificates.

use nalgebra::{Cholesky, ColPivQR, DMatrix, DVector, Dyn};

use crate::assembly::{Model, Pattern, StateRef, System};
use crate::each::Each;
use crate::error::LinearError;
use crate::linear::{Direct, LinearSolver, LinearSystem, MatrixClass};

use super::SIZE_LIMIT;

/// A column is dependent where less than this part of the largest is left of it.
const DEPENDENT: f64 = 1e-10;

/// Refuses what dense algebra can't hold.
pub(super) fn check_size(what: &'static str, size: usize) -> Result<(), LinearError> {
    if size <= SIZE_LIMIT {
        Ok(())
    } else {
        let remedy = "certificates do not depend on the size: take fewer particles";
        Err(LinearError::Size { what, size, limit: SIZE_LIMIT, remedy })
    }
}

/// Adds the symmetric tangent at rest of a model to a dense matrix.
pub(super) fn add_tangent_at_rest(model: &Model, tangent: &mut DMatrix<f64>) {
    let rest = vec![0.0; model.unknowns()];
    let mut system = System::default();
    let mut assembler = model.assembler();
    assembler.assemble_own(model, StateRef::new(&rest, &model.start(), 0.0), &mut system);
    let pattern = assembler.pattern();
    for column in 0..pattern.size() {
        for k in pattern.columns[column]..pattern.columns[column + 1] {
            let row = pattern.rows[k] as usize;
            tangent[(row, column)] += system.values[k];
            if row != column {
                tangent[(column, row)] += system.values[k];
            }
        }
    }
}

/// The orthogonal complement of some columns: the last columns of $Q$ in $QR$.
pub(super) struct Complement {
    qr: Option<ColPivQR<f64, Dyn, Dyn>>,
    rank: usize,
}

impl Complement {
    /// Dependent columns count once.
    pub(super) fn of(columns: DMatrix<f64>) -> Self {
        if columns.ncols() == 0 {
            return Complement { qr: None, rank: 0 };
        }
        let qr = columns.col_piv_qr();
        let r = qr.r();
        let count = r.nrows().min(r.ncols());
        let rank = (0..count).take_while(|&i| r[(i, i)].abs() > DEPENDENT * r[(0, 0)].abs()).count();
        Complement { qr: Some(qr), rank }
    }

    /// Dimension of the span of the columns.
    pub(super) fn rank(&self) -> usize {
        self.rank
    }

    /// $Z^T A$ with the orthonormal basis $Z$ of the complement.
    pub(super) fn restrict(&self, mut a: DMatrix<f64>) -> DMatrix<f64> {
        if let Some(qr) = &self.qr {
            qr.q_tr_mul(&mut a);
        }
        let rows = a.nrows() - self.rank;
        a.rows(self.rank, rows).into_owned()
    }

    /// $Z^T A Z$ for symmetric $A$.
    pub(super) fn compress(&self, a: DMatrix<f64>) -> DMatrix<f64> {
        self.restrict(self.restrict(a).transpose())
    }
}

/// $L$ of $B = LL^T$.
pub(super) fn cholesky(b: DMatrix<f64>, hint: &'static str) -> Result<DMatrix<f64>, LinearError> {
    Cholesky::new(b).map(|c| c.unpack()).ok_or(LinearError::Pivot { pivot: 0, hint })
}

/// Writes $L^{-1}A$; $L$ comes from [`cholesky`] and has no zero on its diagonal.
pub(super) fn forward(l: &DMatrix<f64>, a: &mut DMatrix<f64>) {
    l.solve_lower_triangular_mut(a);
}

/// Symmetric matrices $A$ and $B$ by their lower triangles, for $Av = \theta Bv$.
pub(super) struct Pencil {
    pattern: Pattern,
    a: Vec<f64>,
    b: Vec<f64>,
}

/// The ends of the spectrum of a pencil, and how many eigenvalues lie below a bound.
pub(super) struct Ends {
    pub(super) smallest: f64,
    pub(super) largest: f64,
    pub(super) below: usize,
}

/// Part of the largest eigenvalue that the ends of the spectrum are off by at most.
const RESIDUAL: f64 = 1e-10;

impl Pencil {
    /// The pencil on the quotient by some columns that both matrices annihilate: as many rows and columns are left out.
    pub(super) fn beside(a: &DMatrix<f64>, b: &DMatrix<f64>, annihilated: &DMatrix<f64>) -> Self {
        let pins = pins(annihilated.clone());
        let kept: Vec<usize> = (0..a.nrows()).filter(|row| !pins.contains(row)).collect();
        let rows = |column: usize| {
            let filled = move |&row: &usize| a[(row, column)] != 0.0 || b[(row, column)] != 0.0;
            (0..).zip(&kept).filter(move |(_, row)| filled(row)).map(|(place, _)| place as u32)
        };
        let columns =
            kept.iter().zip(0u32..).map(|(&column, place)| rows(column).filter(|row| *row >= place).collect());
        let pattern = Pattern::from_columns(columns.collect());
        let values = |full: &DMatrix<f64>| {
            let of = |column: usize| pattern.column(column).iter().map(move |&row| (row as usize, column));
            (0..kept.len()).flat_map(of).map(|(row, column)| full[(kept[row], kept[column])]).collect()
        };
        let (a, b) = (values(a), values(b));
        Pencil { pattern, a, b }
    }

    /// By Lanczos' method in the inner product of $B$, every vector orthogonal to all before, and by the signs of the pivots of
    /// $A - \text{bound}\,B$. NaN for an empty pencil.
    ///
    /// # Errors
    /// Where $B$ is not positive definite, which `hint` explains.
    pub(super) fn ends(&self, bound: f64, hint: &'static str) -> Result<Ends, LinearError> {
        let n = self.pattern.size();
        if n == 0 {
            return Ok(Ends { smallest: f64::NAN, largest: f64::NAN, below: 0 });
        }
        let shifted: Vec<f64> = self.a.paired(&self.b, |a, b| a - bound * b);
        let mut direct = Direct::of(&self.pattern, MatrixClass::Definite, None)?;
        let below = direct.factorize(&LinearSystem::of(&shifted))?.map_or(0, |inertia| inertia.negative);
        let b = LinearSystem::of(&self.b);
        if direct.factorize(&b)?.is_some_and(|inertia| inertia.negative > 0) {
            return Err(LinearError::Pivot { pivot: 0, hint });
        }
        let product = |values: &[f64], x: &DVector<f64>| {
            let mut y = DVector::zeros(n);
            self.pattern.multiply_add(values, x.as_slice(), y.as_mut_slice());
            y
        };
        let mut random = fastrand::Rng::with_seed(1);
        let mut vector = DVector::from_fn(n, |_, _| super::signed(&mut random));
        let (mut basis, mut images): (Vec<DVector<f64>>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
        let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let (mut image, mut next_look) = (product(&self.b, &vector), 16);
        loop {
            let size = vector.dot(&image).max(0.0).sqrt();
            let scale = diagonal.largest(|d| d.abs());
            let ended = basis.len() == n || (!basis.is_empty() && size <= 1e-13 * scale);
            if !basis.is_empty() {
                beside.push(size);
            }
            if ended || basis.len() == next_look {
                let (ends, residual) = ritz(&diagonal, &beside);
                ensure!(ends.iter().all(|end| end.is_finite()), LinearError::Residual { residual: f64::NAN });
                if ended || residual <= RESIDUAL * ends[1].abs() {
                    return Ok(Ends { smallest: ends[0], largest: ends[1], below });
                }
                next_look += next_look / 2;
            }
            basis.push(vector / size);
            images.push(image / size);
            let last = &basis[basis.len() - 1];
            let mut following = product(&self.a, last);
            diagonal.push(last.dot(&following));
            direct.solve(&b, following.as_mut_slice(), None)?;
            for _ in 0..2 {
                for (own, image) in basis.iter().zip(&images) {
                    let along = following.dot(image);
                    following.axpy(-along, own, 1.0);
                }
            }
            (image, vector) = (product(&self.b, &following), following);
        }
    }
}

/// The ends of the spectrum of a symmetric matrix of three diagonals, and the larger of their residuals in Lanczos' method.
fn ritz(diagonal: &[f64], beside: &[f64]) -> ([f64; 2], f64) {
    let m = diagonal.len();
    let matrix = DMatrix::from_fn(m, m, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    let eigen = matrix.symmetric_eigen();
    let (least, most) = (eigen.eigenvalues.imin(), eigen.eigenvalues.imax());
    let last = |k: usize| (eigen.eigenvectors[(m - 1, k)] * beside[m - 1]).abs();
    ([eigen.eigenvalues[least], eigen.eigenvalues[most]], last(least).max(last(most)))
}

/// One row for each column in which the columns differ, chosen one after the other.
fn pins(mut columns: DMatrix<f64>) -> Vec<usize> {
    let mut pins = Vec::with_capacity(columns.ncols());
    for column in 0..columns.ncols() {
        let pin = columns.column(column).icamax();
        let chosen = columns.column(column) / columns[(pin, column)];
        for other in column + 1..columns.ncols() {
            let share = columns[(pin, other)];
            columns.column_mut(other).axpy(-share, &chosen, 1.0);
        }
        pins.push(pin);
    }
    pins
}

/// Eigenvalues by rising size.
pub(super) fn spectrum(a: DMatrix<f64>) -> Result<Vec<f64>, LinearError> {
    if a.iter().any(|v| !v.is_finite()) {
        return Err(LinearError::Residual { residual: f64::NAN });
    }
    if a.is_empty() {
        return Ok(Vec::new());
    }
    let values: DVector<f64> = a.symmetric_eigenvalues();
    let mut values: Vec<f64> = values.iter().copied().collect();
    values.sort_unstable_by(f64::total_cmp);
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn spectra_on_complements() {
        // A = diag(1, 2, 3, 4) without the span of e₁ (given twice).
        let a = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0]));
        let complement = Complement::of(DMatrix::from_column_slice(4, 2, &[3.0, 0., 0., 0., -1.0, 0., 0., 0.]));
        assert_eq!(complement.rank(), 1);
        let squares = spectrum(complement.compress(a)).unwrap();
        for (square, expected) in squares.iter().zip([2.0, 3.0, 4.0]) {
            assert_abs_diff_eq!(*square, expected, epsilon = 1e-14);
        }
        assert_eq!(Complement::of(DMatrix::zeros(4, 0)).compress(DMatrix::identity(4, 4)).nrows(), 4);
        assert!(check_size("unknowns", SIZE_LIMIT + 1).is_err());
        assert!(spectrum(DMatrix::from_element(1, 1, f64::NAN)).is_err());
    }

    /// Chains of springs whose stiffnesses are in drawn proportion to those of another chain: both let the chain move as a whole.
    #[test]
    fn ends_of_the_spectrum_of_two_chains() {
        let mut random = fastrand::Rng::with_seed(3);
        for count in [2, 3, 40, 300] {
            let mut random_theta = || 0.3 + random.f64();
            let thetas: Vec<f64> = (1..count).map(|_| random_theta()).collect();
            let (mut a, mut b) = (DMatrix::zeros(count, count), DMatrix::zeros(count, count));
            for (k, theta) in thetas.iter().enumerate() {
                let stiffness = 1.0 + (k % 7) as f64;
                for (i, j, sign) in [(k, k, 1.0), (k + 1, k + 1, 1.0), (k, k + 1, -1.0), (k + 1, k, -1.0)] {
                    a[(i, j)] += sign * theta * stiffness;
                    b[(i, j)] += sign * stiffness;
                }
            }
            let pencil = Pencil::beside(&a, &b, &DMatrix::from_element(count, 1, 1.0));
            let mut sorted = thetas.clone();
            sorted.sort_by(f64::total_cmp);
            let bound = sorted[sorted.len() / 2] + 1e-9;
            let ends = pencil.ends(bound, "").unwrap();
            assert_abs_diff_eq!(ends.smallest, sorted[0], epsilon = 1e-8);
            assert_abs_diff_eq!(ends.largest, sorted[count - 2], epsilon = 1e-8);
            assert_eq!(ends.below, sorted.iter().filter(|theta| **theta < bound).count());
        }
    }
}
