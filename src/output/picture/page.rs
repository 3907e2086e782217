//! A page on which a body is turned and its steps are run through.

use std::fmt::Write as _;
use std::path::Path;

use super::colour::{BANDS, colour};
use super::{LEVEL, Picture, first_coloured, given_range};
use crate::each::{EachOf, list_of};
use crate::error::OutputError;
use crate::output::{base64, escaped, is_forbidden, short, write_file};

/// A web page of its own, without anything from elsewhere: a body that is turned with the mouse and moves through the frames of
/// a path by a slider.
///
/// ```
/// use rkpm::geometry::Point;
/// use rkpm::output::{Page, Picture};
/// let plate = |right: f64| {
///     let corners = [[0.0, 0.0], [right, 0.0], [right, 1.0], [0.0, 1.0]].map(Point::<2>::from);
///     Picture::new(&corners, vec![vec![0, 1, 2, 3]]).coloured("stretch", vec![right / 2.0; 4])
/// };
/// let html = Page::new("A plate").frame("at rest", plate(2.0)).frame("pulled", plate(3.0)).to_html()?;
/// assert!(html.contains("at rest") && html.contains("pulled"));
/// # Ok::<(), rkpm::error::OutputError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    title: String,
    frames: Vec<(String, Picture)>,
}

impl Page {
    /// A page without frames.
    pub fn new(title: impl Into<String>) -> Self {
        Page { title: title.into(), frames: Vec::new() }
    }

    /// Adds a frame with what the slider says at it. All frames show the same faces at other places; the first one's view counts, ranges
    /// that were set are joined, and the bar has the label of the first picture with values.
    #[must_use]
    pub fn frame(mut self, label: impl Into<String>, picture: Picture) -> Self {
        self.frames.push((label.into(), picture));
        self
    }

    /// The page as text.
    ///
    /// # Errors
    /// Without frames, where frames have other faces than the first one, and as [`Picture::to_svg`].
    pub fn to_html(&self) -> Result<String, OutputError> {
        let refused = |what: String| OutputError::Chart { title: self.title.clone(), what };
        let (_, first) = self.frames.first().ok_or_else(|| refused("a page without a frame".to_string()))?;
        let mut frames = String::new();
        let pictures = || self.frames.iter().map(|(_, picture)| picture);
        let given = given_range(pictures());
        let (mut least, mut most) = given.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
        for (label, picture) in &self.frames {
            picture.check()?;
            ensure!(
                picture.faces == first.faces && picture.points.len() == first.points.len(),
                refused(format!("frame \"{label}\" has other faces than the first frame"))
            );
            if given.is_none() {
                let values = picture.values.iter().filter(|v| v.is_finite());
                (least, most) = values.fold((least, most), |(a, b), v| (a.min(*v), b.max(*v)));
            }
            let points = floats(&mut picture.points.iter().flat_map(|x| [x[0], x[1], x[2]]));
            let grey = std::iter::repeat_n(f64::NAN, if picture.values.is_empty() { picture.points.len() } else { 0 });
            let values = floats(&mut picture.values.iter().copied().chain(grey));
            let _ = write!(frames, "{{label:{},points:\"{points}\",values:\"{values}\"}},", quoted(label));
        }
        if !(most - least > LEVEL * least.abs().max(most.abs())) {
            most = least;
        }
        let (least, most) = if least.is_finite() { (least, most) } else { (0.0, 0.0) };
        let mut triangles =
            first.faces.iter().flat_map(|face| (2..face.len()).flat_map(|k| [face[0], face[k - 1], face[k]]));
        let edges =
            || first.faces.iter().flat_map(|face| (0..face.len()).flat_map(|k| [face[k], face[(k + 1) % face.len()]]));
        let lines = match &first.lines {
            Some(lines) => {
                integers(&mut lines.iter().flat_map(|line| line.windows(2).flat_map(|ends| [ends[0], ends[1]])))
            }
            None => integers(&mut edges()),
        };
        let colours: Vec<[u8; 3]> = list_of(BANDS, |band| colour(band).each(|c| c as u8));
        let range = most - least;
        let marks: Vec<String> = match range > 0.0 {
            true => (0..=4).map(|mark| short(least + f64::from(mark) / 4.0 * range, [least, most])).collect(),
            false => vec![short(least, [least, most])],
        };
        let data = format!(
            "{{flat:{},view:{:?},label:{},range:[{least:?},{most:?}],marks:{marks:?},colours:{colours:?},triangles:\"{}\",\
             lines:\"{lines}\",frames:[{frames}]}}",
            first.flat,
            first.view,
            quoted(&escaped(&first_coloured(pictures()).unwrap_or(first).label)),
            integers(&mut triangles),
        );
        // Piece by piece: words of the page's own are no places of the template.
        let title = escaped(&self.title);
        let pieces = include_str!("page.html").split('@').map(|piece| match piece {
            "TITLE" => title.as_str(),
            "DATA" => data.as_str(),
            text => text,
        });
        Ok(pieces.collect())
    }

    /// Writes the page, with the directories above it.
    ///
    /// # Errors
    /// As [`to_html`](Page::to_html), and [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_file(path.as_ref(), &["html", "htm"], &self.to_html()?)
    }
}

/// Numbers in single precision, as text.
fn floats(numbers: &mut dyn Iterator<Item = f64>) -> String {
    let mut bytes = Vec::new();
    for x in numbers {
        bytes.extend_from_slice(&(x as f32).to_le_bytes());
    }
    base64(&bytes)
}

fn integers(numbers: &mut dyn Iterator<Item = usize>) -> String {
    let mut bytes = Vec::new();
    for x in numbers {
        bytes.extend_from_slice(&(x as u32).to_le_bytes());
    }
    base64(&bytes)
}

/// Text within a script: nothing in it ends the script.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            // Also the two ends of lines that scripts know beside those of text.
            c if c.is_control() || is_forbidden(c) || matches!(c, '<' | '\u{2028}' | '\u{2029}') => {
                let _ = write!(quoted, "\\u{:04x}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
