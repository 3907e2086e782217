//! Charts as files.

use std::path::Path;

use crate::error::OutputError;

use super::super::write_text;
use super::{Chart, draw};

impl Chart {
    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`OutputError::Chart`] where no point of any series can be shown, a range, band or reference
    /// line cannot be, or equal aspect is requested of a logarithmic axis.
    pub fn to_svg(&self) -> Result<String, OutputError> {
        draw::svg(self)
    }

    /// Writes the chart as an SVG file, with the directories above it.
    ///
    /// # Errors
    /// As [`to_svg`](Self::to_svg), and [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_text(path.as_ref(), &self.to_svg()?)
    }
}
