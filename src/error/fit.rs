//! What is wrong with test data, or with a fit to them.

use thiserror::Error;

/// What is wrong with test data, or with a fit to them.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// There are no rows.
    #[error("no test data: give at least one row of mode, stretch and nominal stress")]
    Empty,
    /// A file can't be read.
    #[error("{path}: {what}")]
    File {
        /// The file.
        path: String,
        /// The system's reason.
        what: String,
    },
    /// A column is missing.
    #[error(
        "no column {column} in the header: name the columns mode (or test), stretch and nominal_stress (or stress)"
    )]
    Column {
        /// The column.
        column: &'static str,
    },
    /// A row can't be read.
    #[error("row {row} of the data: {what}")]
    ConstraintEquation {
        /// The row, counted from 1 without header and comments.
        row: usize,
        /// What is wrong.
        what: String,
    },
    /// A mode is none of those that a law answers to.
    #[error(
        "row {row} of the data: no test {mode}; there are uniaxial (UT), equibiaxial (ET), planar (PS) and volumetric (VT)"
    )]
    Mode {
        /// The row, counted from 1.
        row: usize,
        /// The mode given.
        mode: String,
    },
    /// A stretch is not positive and finite.
    #[error("{mode} test, point {point}: stretch {value}; stretches are lengths over first lengths, above zero")]
    Stretch {
        /// The test.
        mode: &'static str,
        /// The point, counted from 1.
        point: usize,
        /// The value given.
        value: f64,
    },
    /// A stress is not finite.
    #[error("{mode} test, point {point}: stress {value}; give finite numbers")]
    Stress {
        /// The test.
        mode: &'static str,
        /// The point, counted from 1.
        point: usize,
        /// The value given.
        value: f64,
    },
    /// A stress pulls where the body is pressed, or presses where it is pulled.
    #[error(
        "{mode} test, point {point}: stress {stress} at stretch {stretch}; stresses are above zero in tension (stretch > 1) \
         and below it in compression"
    )]
    Sign {
        /// The test.
        mode: &'static str,
        /// The point, counted from 1.
        point: usize,
        /// The stretch, or the volume ratio.
        stretch: f64,
        /// The stress given.
        stress: f64,
    },
    /// A weight is not usable.
    #[error("{mode} test: weight {value}; weights are finite and above zero")]
    Weight {
        /// The test.
        mode: &'static str,
        /// The value given.
        value: f64,
    },
    /// There are only tests that the law does not answer to.
    #[error("{law} says nothing of {mode} tests: add a uniaxial, equibiaxial or planar one")]
    Unseen {
        /// The law.
        law: String,
        /// The mode of the tests.
        mode: &'static str,
    },
    /// There are fewer points than coefficients.
    #[error(
        "{points} points can't decide the {coefficients} coefficients of {law}: add points, or take a law with fewer"
    )]
    TooFew {
        /// The law.
        law: String,
        /// Points of tests that the law answers to.
        points: usize,
        /// Its coefficients.
        coefficients: usize,
    },
    /// A law's coefficients, or bounds for them, are unusable.
    #[error("{law}: {what}")]
    Coefficient {
        /// The law.
        law: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// No start came to an optimum.
    #[error(
        "{law}: none of {starts} starts came to an optimum; widen the bounds, or leave out points beyond the law's limit"
    )]
    NoOptimum {
        /// The law.
        law: String,
        /// Starts that were tried.
        starts: usize,
    },
    /// All optima lose stability inside the range of the data.
    #[error(
        "{law}: the best fit is unstable in {mode} tests outside of stretches {low:.4} to {high:.4}, the data reach from {from} to \
         {to}; take another law or fewer terms, or ask for it by Fit::allow_unstable"
    )]
    Unstable {
        /// The law.
        law: String,
        /// The mode in which it is unstable.
        mode: &'static str,
        /// Least stable stretch.
        low: f64,
        /// Largest stable stretch.
        high: f64,
        /// Least stretch of the data.
        from: f64,
        /// Largest stretch of the data.
        to: f64,
    },
}
