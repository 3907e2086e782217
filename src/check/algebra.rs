//! Dense symmetric algebra of the certificates.

use nalgebra::{Cholesky, ColPivQR, DMatrix, DVector, Dyn};

use crate::assembly::{Model, StateRef, System};
use crate::error::LinearError;

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
pub(super) fn add_tangent_at_rest<const D: usize>(model: &Model<D>, tangent: &mut DMatrix<f64>) {
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

/// Eigenvalues $\theta$ of $Av = \theta Bv$ by rising size, $A$ symmetric, $B$ symmetric positive definite.
pub(super) fn relative_spectrum(
    mut a: DMatrix<f64>,
    b: DMatrix<f64>,
    hint: &'static str,
) -> Result<Vec<f64>, LinearError> {
    let l = cholesky(b, hint)?;
    forward(&l, &mut a);
    a.transpose_mut();
    forward(&l, &mut a);
    spectrum(a)
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

    #[test]
    fn spectra_on_complements() {
        // A = diag(1, 2, 3, 4) against B = 2 I, without the span of e₁ (given twice).
        let a = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0]));
        let b = DMatrix::identity(4, 4) * 2.0;
        let complement = Complement::of(DMatrix::from_column_slice(4, 2, &[3.0, 0., 0., 0., -1.0, 0., 0., 0.]));
        assert_eq!(complement.rank(), 1);
        let theta = relative_spectrum(complement.compress(a), complement.compress(b), "").unwrap();
        for (theta, expected) in theta.iter().zip([1.0, 1.5, 2.0]) {
            assert!((theta - expected).abs() < 1e-14);
        }
        assert_eq!(Complement::of(DMatrix::zeros(4, 0)).compress(DMatrix::identity(4, 4)).nrows(), 4);
        assert!(check_size("unknowns", SIZE_LIMIT + 1).is_err());
        assert!(spectrum(DMatrix::from_element(1, 1, f64::NAN)).is_err());
    }
}
