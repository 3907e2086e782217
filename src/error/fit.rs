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
        "the header has no column {column}: name the columns mode (or test), stretch and nominal_stress (or stress)"
    )]
    Column {
        /// The column.
        column: &'static str,
    },
    /// A column is missing, and one that is near it holds something else.
    #[error("no column {column} in the header, and {header:?} is not read as one: {remedy}")]
    Header {
        /// The column.
        column: &'static str,
        /// The header that is near it.
        header: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Two columns may be meant.
    #[error("the headers {first:?} and {second:?} both name the column {column}: keep that name for one of them")]
    Ambiguous {
        /// The column.
        column: &'static str,
        /// The first header.
        first: String,
        /// The second header.
        second: String,
    },
    /// A row can't be read.
    #[error("{}: {what}", if *row == 0 { "header of the data".to_string() } else { format!("row {row} of the data") })]
    Row {
        /// The row, counted from 1 without header and comments; 0 for the header.
        row: usize,
        /// What is wrong.
        what: String,
    },
    /// A mode of test that is not known.
    #[error(
        "row {row} of the data: unknown test {mode:?}; there are uniaxial (UT), equibiaxial (ET), planar (PS) and volumetric (VT) tests"
    )]
    Mode {
        /// The row, counted from 1.
        row: usize,
        /// The mode given.
        mode: String,
    },
    /// A stretch is not positive and finite.
    #[error(
        "{mode} test, point {point}: stretch {value}; a stretch is the deformed length over the undeformed one, finite and above zero (1 + strain)"
    )]
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
    /// The sign of a stress does not fit its stretch.
    #[error(
        "{mode} test, point {point}: stress {stress} at stretch {stretch}; stresses are positive in tension (stretch > 1) \
         and negative in compression; where the first rows are noise, leave them out and shift the others so that the test begins \
         at stretch 1 without stress"
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
    #[error("{mode} test: weight {value}; give a finite number above zero")]
    Weight {
        /// The test.
        mode: &'static str,
        /// The value given.
        value: f64,
    },
    /// A weight for tests that there are not.
    #[error("no {mode} test to give a weight to: add its points before its weight, or leave the weight out")]
    Unweighted {
        /// The mode.
        mode: &'static str,
    },
    /// All tests are of a kind that the material does not depend on.
    #[error("{law} can't be fitted to {mode} tests alone: add a uniaxial, equibiaxial or planar test")]
    Unseen {
        /// The material.
        law: String,
        /// The mode of the tests.
        mode: &'static str,
    },
    /// There are fewer points than coefficients.
    #[error(
        "{points} points can't determine the {coefficients} coefficients of {law}: add points, or take a material with fewer coefficients"
    )]
    TooFew {
        /// The material.
        law: String,
        /// Points of tests that the material depends on.
        points: usize,
        /// Its coefficients.
        coefficients: usize,
    },
    /// A material's coefficients, or bounds for them, are unusable.
    #[error("{law}: {what}")]
    Coefficient {
        /// The material.
        law: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// The search converged from no start.
    #[error(
        "{law}: the search converged from none of {starts} starting points; widen the bounds, or leave out points beyond the limiting stretch of the material"
    )]
    NoOptimum {
        /// The material.
        law: String,
        /// Starts that were tried.
        starts: usize,
    },
    /// A search from no starting point, or from more than anyone would wait for.
    #[error("{starts} starting points: give from 1 to 100000; the default is 40")]
    Starts {
        /// Starts requested.
        starts: usize,
    },
    /// All optima lose stability inside the range of the data.
    #[error(
        "{law}: the best fit is stable in {mode} tests only for stretches from {low:.4} to {high:.4}, but the data range from {from} to \
         {to}; take another material or fewer terms, or accept it by Fit::allow_unstable"
    )]
    Unstable {
        /// The material.
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
