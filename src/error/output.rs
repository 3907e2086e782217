//! Errors of files and charts.

use thiserror::Error;

/// What went wrong while writing or reading results.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The file system reported an error.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The name of a file says another format than the one that is written.
    #[error("{path}: the ending is that of another format; {written} is written")]
    Ending {
        /// The file.
        path: String,
        /// The endings that fit.
        written: String,
    },
    /// Columns or fields have different lengths.
    #[error("{what}: {given} values where {needed} are needed")]
    Length {
        /// The column or field.
        what: String,
        /// Values given.
        given: usize,
        /// Values needed.
        needed: usize,
    },
    /// A journal holds something else than it should.
    #[error("{path}, line {line}: {what}")]
    Journal {
        /// The file.
        path: String,
        /// The line, from 1; 0 for the file as a whole.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// A chart that can't be drawn.
    #[error("chart {title}: {what}")]
    Chart {
        /// The chart's title.
        title: String,
        /// What is wrong.
        what: String,
    },
}
