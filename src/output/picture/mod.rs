//! Pictures of bodies: a shaded surface, coloured by a field, as SVG around an image of pixels.

mod colour;
mod page;
mod raster;
mod surface;

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::SVector;

pub use page::Page;

use super::{base64, escaped, short, write_file};
use crate::each::{Each, EachOf};
use crate::error::OutputError;
use crate::geometry::{Vec3, all_padded};
use colour::{BANDS, colour};
use raster::{Canvas, Lines};

/// Values that differ by less than this part are the same, but for rounding.
const LEVEL: f64 = 1e-9;
/// Room for the title, the colour bar and around the body \[px\].
const MARGIN: f64 = 24.0;
const BAR: f64 = 150.0;
/// Size of letters: of the title and of all other text \[px\].
const LETTERS: [f64; 2] = [20.0, 16.0];

/// A body seen from outside, its faces coloured in bands by values at its points.
///
/// Bodies in space are seen from above and aside ([`view`](Picture::view)), without perspective, lit and smooth but for edges of
/// more than 35°; those in the plane from above.
///
/// ```
/// use rkpm::geometry::Point;
/// use rkpm::output::Picture;
/// let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]].map(Point::<2>::from);
/// let svg = Picture::new(&corners, vec![vec![0, 1, 2, 3]])
///     .coloured("displacement [mm]", vec![0.0, 1.0, 1.5, 0.5])
///     .title("A plate")
///     .to_svg()?;
/// assert!(svg.contains("displacement [mm]"));
/// # Ok::<(), rkpm::error::OutputError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    points: Vec<Vec3>,
    faces: Vec<Vec<usize>>,
    lines: Option<Vec<Vec<usize>>>,
    flat: bool,
    closed: bool,
    /// Where the points are at rest, if that differs.
    rest: Option<Vec<Vec3>>,
    values: Vec<f64>,
    label: String,
    title: String,
    range: Option<(f64, f64)>,
    view: [f64; 2],
    size: [u32; 2],
    /// Pictures that stand to the right of this one.
    beside: Vec<Picture>,
}

impl Picture {
    /// Faces by their corners around; points in the plane have two coordinates.
    pub fn new<const D: usize>(points: &[SVector<f64, D>], faces: Vec<Vec<usize>>) -> Self {
        Picture::of(all_padded(points), D < 3, faces)
    }

    /// The same of points with three coordinates, which may lie in the plane.
    pub(crate) fn of(points: Vec<Vec3>, flat: bool, faces: Vec<Vec<usize>>) -> Self {
        Picture {
            points,
            faces,
            lines: None,
            flat,
            closed: false,
            rest: None,
            values: Vec::new(),
            label: String::new(),
            title: String::new(),
            range: None,
            view: [-60.0, 25.0],
            size: [900, 640],
            beside: Vec::new(),
        }
    }

    /// Colours the faces by values at the points, with a bar of the colours and its label; faces with a value that is NaN are
    /// grey. Infinite values have the colours of the ends.
    #[must_use]
    pub fn coloured(mut self, label: impl Into<String>, values: Vec<f64>) -> Self {
        (self.label, self.values) = (label.into(), values);
        self
    }

    /// Sets the thin lines, each through points; by default they are the edges of all faces.
    #[must_use]
    pub fn lines(mut self, lines: Vec<Vec<usize>>) -> Self {
        self.lines = Some(lines);
        self
    }

    /// Says that the faces enclose a body, corners around outward by the right hand: those that look away are left out.
    #[must_use]
    pub(crate) fn closed(mut self) -> Self {
        self.closed = true;
        self
    }

    /// Says where the points are at rest: edges are those of the part at rest.
    #[must_use]
    pub(crate) fn at_rest(mut self, points: Vec<Vec3>) -> Self {
        self.rest = Some(points);
        self
    }

    /// Sets the title.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Sets the values at the ends of the colours; by default the smallest and the largest finite ones that are shown.
    #[must_use]
    pub fn range(mut self, lower: f64, upper: f64) -> Self {
        self.range = Some((lower, upper));
        self
    }

    /// Sets where a body in space is seen from \[degrees\]: the azimuth about axis 2, from axis 0 on, and the elevation above
    /// the plane of axes 0 and 1.
    #[must_use]
    pub fn view(mut self, azimuth: f64, elevation: f64) -> Self {
        self.view = [azimuth, elevation];
        self
    }

    /// Sets width and height \[px\], of all pictures together where some stand side by side.
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = [width, height];
        self
    }

    /// Puts another picture to the right of this one, at the same scale and with the same colours for the same values: ranges that were set
    /// are joined, and the bar has the label of the first picture with values.
    #[must_use]
    pub fn beside(mut self, mut other: Picture) -> Self {
        let further = std::mem::take(&mut other.beside);
        self.beside.push(other);
        self.beside.extend(further);
        self
    }

    /// The picture as text: an image of the body within, all words as text.
    ///
    /// # Errors
    /// Where values don't fit the points, a face names a point that does not exist, the ends of a range are not finite or the lower one is
    /// the larger, or there is nothing to see.
    pub fn to_svg(&self) -> Result<String, OutputError> {
        let panels: Vec<&Picture> = std::iter::once(self).chain(&self.beside).collect();
        panels.iter().try_for_each(|panel| panel.check())?;
        let [width, height] = self.size.each(f64::from);
        let bar = if panels.iter().all(|panel| panel.values.is_empty()) { 0.0 } else { BAR };
        let top = MARGIN + if panels.iter().all(|panel| panel.title.is_empty()) { 0.0 } else { 32.0 };
        let across = (width - MARGIN - bar) / panels.len() as f64;
        let room = [across - MARGIN, height - top - MARGIN];
        let seen: Vec<Vec<[f64; 3]>> = panels.mapped(|panel| panel.seen());
        let extents: Vec<[[f64; 2]; 2]> = panels.paired(&seen, |panel, seen| panel.extent(seen));
        let scale = (extents.iter())
            .flat_map(|ends| [0, 1].each(|i| room[i] / (ends[i][1] - ends[i][0])))
            .fold(f64::INFINITY, f64::min);
        ensure!(scale > 0.0 && scale.is_finite(), self.nothing("a body without extent, or no room for it"));
        let range = given_range(panels.iter().copied()).unwrap_or_else(|| value_range(&panels));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for (k, panel) in panels.iter().enumerate() {
            let left = MARGIN + k as f64 * across;
            let title = escaped(&panel.title);
            let _ = writeln!(
                svg,
                "<text x=\"{left:.1}\" y=\"{}\" font-size=\"{}\">{title}</text>",
                MARGIN + 8.0,
                LETTERS[0]
            );
            let image = panel.drawn(&seen[k], &extents[k], room, scale, range).encoded();
            let image = image.map_err(|what| self.nothing(&what))?;
            let _ = writeln!(
                svg,
                "<image x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" href=\"data:image/png;base64,{}\"/>",
                room[0],
                room[1],
                base64(&image)
            );
        }
        if bar > 0.0 {
            first_coloured(panels.iter().copied()).unwrap_or(self).bar(&mut svg, [width - bar, top], room[1], range);
        }
        svg.push_str("</svg>\n");
        Ok(svg)
    }

    /// The picture alone as an image in the format PNG, without title, colour bar and what stands beside it.
    ///
    /// # Errors
    /// As [`to_svg`](Picture::to_svg).
    pub fn to_png(&self) -> Result<Vec<u8>, OutputError> {
        self.check()?;
        let (seen, room) = (self.seen(), self.size.each(f64::from));
        let ends = self.extent(&seen);
        let scale = (room[0] / (ends[0][1] - ends[0][0])).min(room[1] / (ends[1][1] - ends[1][0]));
        ensure!(scale > 0.0 && scale.is_finite(), self.nothing("a body without extent, or no room for it"));
        let range = self.range.unwrap_or_else(|| value_range(&[self]));
        self.drawn(&seen, &ends, room, scale, range).encoded().map_err(|what| self.nothing(&what))
    }

    /// Writes the picture as SVG, or as PNG where the name ends in `.png`, with the directories above it.
    ///
    /// # Errors
    /// As [`to_svg`](Picture::to_svg), [`OutputError::Ending`] for the ending of another format, and [`OutputError::Io`] where the
    /// file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let path = path.as_ref();
        match path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            true => write_file(path, &["png"], self.to_png()?),
            false => write_file(path, &["svg", "png"], self.to_svg()?),
        }
    }

    /// Directions to the right, upward and to the eye.
    fn directions(&self) -> [Vec3; 3] {
        if self.flat {
            return [Vec3::x(), Vec3::y(), Vec3::z()];
        }
        let [(sa, ca), (se, ce)] = self.view.each(|angle| angle.to_radians().sin_cos());
        let eye = Vec3::new(ce * ca, ce * sa, se);
        let right = Vec3::new(-sa, ca, 0.0);
        [right, eye.cross(&right), eye]
    }

    /// The points to the right, upward and to the eye.
    fn seen(&self) -> Vec<[f64; 3]> {
        let directions = self.directions();
        self.points.mapped(|x| directions.each(|direction| x.dot(&direction)))
    }

    /// Least and largest coordinates of what is shown, to the right and upward.
    fn extent(&self, seen: &[[f64; 3]]) -> [[f64; 2]; 2] {
        let shown = || self.faces.iter().flatten().map(|&point| seen[point]);
        [0, 1].each(|i| shown().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x[i]), b.max(x[i])]))
    }

    /// The body in pixels, in the middle of a room.
    fn drawn(&self, seen: &[[f64; 3]], ends: &[[f64; 2]; 2], room: [f64; 2], scale: f64, range: (f64, f64)) -> Canvas {
        let [right, up, eye] = self.directions();
        let mut canvas = Canvas::new(room, [right * -0.5 + up * 0.7 + eye * 0.8, eye]);
        let middle = ends.each(|[a, b]| 0.5 * (a + b));
        let place = |x: &[f64; 3]| {
            [0.5 * room[0] + (x[0] - middle[0]) * scale, 0.5 * room[1] - (x[1] - middle[1]) * scale, x[2] * scale]
        };
        let at: Vec<[f64; 3]> = seen.mapped(place);
        let (least, most) = range;
        let part = |v: f64| if most > least { ((v - least) / (most - least)).clamp(0.0, 1.0) } else { 0.0 };
        let surface = surface::Surface::new(&self.points, self.rest.as_ref().unwrap_or(&self.points), &self.faces);
        let eye = (!self.flat).then_some(eye);
        for (number, face) in self.faces.iter().enumerate() {
            if self.closed && eye.is_some_and(|eye| surface.normal(number).dot(&eye) <= 0.0) {
                continue;
            }
            let corners: Vec<raster::Corner> = (face.iter().enumerate())
                .map(|(k, &point)| raster::Corner {
                    at: at[point],
                    normal: if self.flat { None } else { Some(surface.corner_normal(number, k)) },
                    value: self.values.get(point).map_or(f64::NAN, |v| part(*v)),
                })
                .collect();
            canvas.face(&corners);
        }
        match &self.lines {
            Some(lines) => lines.iter().for_each(|line| canvas.line(line.iter().map(|&p| at[p]), Lines::THIN)),
            None => surface.edges().for_each(|[a, b]| canvas.line([at[a], at[b]].into_iter(), Lines::THIN)),
        }
        surface.creases().for_each(|[a, b]| canvas.line([at[a], at[b]].into_iter(), Lines::EDGE));
        if let Some(eye) = eye {
            surface.outline(&eye).for_each(|[a, b]| canvas.line([at[a], at[b]].into_iter(), Lines::EDGE));
        }
        canvas
    }

    fn nothing(&self, what: &str) -> OutputError {
        OutputError::Chart { title: self.title.clone(), what: what.to_string() }
    }

    fn check(&self) -> Result<(), OutputError> {
        let length = |what: &str, given, needed| Err(OutputError::Length { what: what.to_string(), given, needed });
        if self.faces.iter().all(Vec::is_empty) {
            return Err(self.nothing("no face to show"));
        }
        if let Some(&point) =
            self.faces.iter().chain(self.lines.iter().flatten()).flatten().find(|p| **p >= self.points.len())
        {
            return length("points of a picture", self.points.len(), point + 1);
        }
        if let Some(face) = self.faces.iter().find(|face| face.len() < 3) {
            return length("corners of a face", face.len(), 3);
        }
        if !self.values.is_empty() && self.values.len() != self.points.len() {
            return length("values at the points of a picture", self.values.len(), self.points.len());
        }
        if self.points.iter().any(|x| !x.iter().all(|v| v.is_finite())) {
            return Err(self.nothing("a point is not finite"));
        }
        if let Some((lower, upper)) =
            self.range.filter(|(lower, upper)| !(lower <= upper && (upper - lower).is_finite()))
        {
            let remedy = "give finite ends, the lower first";
            return Err(self.nothing(&format!("colours from {lower:e} to {upper:e} cannot be shown: {remedy}")));
        }
        if self.size.iter().any(|side| *side > 8000) {
            return Err(self.nothing("more than 8000 pixels a side"));
        }
        Ok(())
    }

    fn bar(&self, svg: &mut String, [x, top]: [f64; 2], height: f64, (least, most): (f64, f64)) {
        let (bar, step) = (0.8 * height, 0.8 * height / BANDS as f64);
        let from = top + 0.5 * (height - bar) + 10.0;
        let letters = LETTERS[1];
        for band in 0..BANDS {
            let y = from + bar - (band + 1) as f64 * step;
            let [r, g, b] = colour(band).each(|c| c as u8);
            let height = step + 0.3;
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"18\" height=\"{height:.1}\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>"
            );
        }
        let range = most - least;
        for mark in if range > 0.0 { 0..=4 } else { 0..=0 } {
            let part = f64::from(mark) / 4.0;
            let text = short(least + part * range, [least, most]);
            let y = from + bar * (1.0 - part) + 5.0;
            let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\" font-size=\"{letters}\">{text}</text>", x + 26.0);
        }
        let label = escaped(&self.label);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"{letters}\">{label}</text>", from - 14.0);
    }
}

/// The range of all pictures that were given one.
fn given_range<'a>(panels: impl Iterator<Item = &'a Picture>) -> Option<(f64, f64)> {
    panels.filter_map(|panel| panel.range).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// The first picture with values, whose label stands at the bar.
fn first_coloured<'a>(mut panels: impl Iterator<Item = &'a Picture>) -> Option<&'a Picture> {
    panels.find(|panel| !panel.values.is_empty())
}

/// The least and the largest finite value that pictures show.
fn value_range(panels: &[&Picture]) -> (f64, f64) {
    let shown = panels.iter().flat_map(|panel| panel.faces.iter().flatten().filter_map(|&p| panel.values.get(p)));
    let (least, most) =
        shown.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    match most - least > LEVEL * least.abs().max(most.abs()) {
        true => (least, most),
        false if least.is_finite() => (least, least),
        false => (0.0, 0.0),
    }
}
