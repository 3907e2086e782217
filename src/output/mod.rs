//! Results on disk: tables (CSV), fields (VTU, PVD) and charts (SVG).
//!
//! | type | file | made for |
//! |---|---|---|
//! | [`Table`] | `.csv` | columns of numbers and words |
//! | [`VtkGrid`] | `.vtu` | fields on particles and cells, for ParaView |
//! | pieces of a [`VtkGrid`] | `.pvtu` and `.vtu` | the same from several ranks |
//! | [`PvdCollection`] | `.pvd` | the `.vtu` files of a path in time or load |
//! | `Picture` | `.svg`, `.png` | bodies seen from outside, coloured by a field |
//! | `Page` | `.html` | a body to be turned with the mouse, moving through its steps |
//! | `Chart` | `.svg` | curves, work against precision, deformed shapes |
//! | `Journal` | `.jsonl` | a run while it runs, to be read and resumed |
//!
//! Each type is data first and a file last: nothing touches the disk before `write`, which makes
//! missing parent directories and replaces an existing file. Nothing here prints, and whatever is
//! wrong with the data or with the disk is an [`OutputError`]. Only a journal is written as it grows, and
//! never over another one.
//!
//! Charts and pictures need the feature `chart`, journals `serde`.

#[cfg(feature = "chart")]
pub mod chart;
pub mod csv;
#[cfg(feature = "serde")]
pub mod journal;
#[cfg(feature = "chart")]
mod picture;
mod pieces;
pub mod vtk;

#[cfg(feature = "chart")]
pub use chart::{Chart, Series};
pub use csv::{Cell, Table};
#[cfg(feature = "serde")]
pub use journal::{Flush, Journal};
#[cfg(feature = "chart")]
pub use picture::{Page, Picture};
pub use vtk::{PvdCollection, VtkCell, VtkField, VtkGrid, VtkValues};

use crate::each::Each;
use crate::error::OutputError;
use std::path::Path;

/// Refuses names whose ending says another format than the one written; names without an ending say none.
pub(crate) fn check_ending(path: &Path, endings: &[&str]) -> Result<(), OutputError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    match ending {
        Some(ending) if !endings.contains(&ending.as_str()) => {
            let (path, endings) = (path.display().to_string(), endings.mapped(|e| format!(".{e}")));
            Err(OutputError::Ending { path, written: endings.join(" or ") })
        }
        _ => Ok(()),
    }
}

/// Text of which XML and HTML make the same text: control characters and others that XML forbids become spaces.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if is_forbidden(c) || c.is_control() => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// Whether a document of XML may not hold a character, not even by its number.
fn is_forbidden(c: char) -> bool {
    c < ' ' && !matches!(c, '\t' | '\n' | '\r') || matches!(c, '\u{FFFE}' | '\u{FFFF}')
}

/// Writes a file whose ending, if it has one, is one of its format, with the directories above it.
fn write_file(path: &Path, endings: &[&str], contents: impl AsRef<[u8]>) -> Result<(), OutputError> {
    check_ending(path, endings)?;
    let refused = |source| OutputError::Io { path: path.display().to_string(), source };
    if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(refused)?;
    }
    std::fs::write(path, contents).map_err(refused)
}

#[cfg(feature = "chart")]
/// A number with as many digits as tell it from others between two ends.
fn short(value: f64, [low, high]: [f64; 2]) -> String {
    let order = |size: f64| size.max(1e-300).log10().floor();
    let size = low.abs().max(high.abs());
    let range = if high > low { high - low } else { size };
    // A narrow range is written as what it is narrow beside.
    let scale = if range < 1e-3 { size } else { range };
    if !(1e-3..1e5).contains(&scale) {
        let digits = 2.0 + (order(size) - order(range)).max(0.0);
        return format!("{value:.*e}", digits as usize);
    }
    let text = format!("{value:.*}", (2.0 - order(range)).max(0.0) as usize);
    // Rounding leaves a sign on nothing.
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_string(),
        _ => text,
    }
}

/// Bytes as text of 64 letters (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, k| word << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k)) as usize & 63] as char;
            text.push(if k <= three.len() { letter } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn bytes_become_the_letters_of_the_standard() {
        let pairs = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in pairs {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
