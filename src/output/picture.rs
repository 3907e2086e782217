//! Pictures of bodies as SVG: the contact surface from outside, coloured by a field.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{SVector, Vector3};

use super::{short, write_text};
use crate::error::OutputError;

/// Bands of colour between the smallest and the largest value.
const BANDS: usize = 12;
/// Brightness of faces along the light; those across it have 1.
const SHADE: f64 = 0.5;
/// Cosine of the angle between faces beyond which the edge between them is drawn strongly, 35°.
const CREASE: f64 = 0.82;
/// Values that differ by less than this part are the same, but for rounding.
const LEVEL: f64 = 1e-9;
/// Room for the title, the colour bar and around the body [px].
const MARGIN: f64 = 24.0;
const BAR: f64 = 150.0;

/// A body seen from outside, its faces coloured in bands by values at its points; hidden faces are left out.
///
/// Bodies in space are seen from above and aside ([`view`](Picture::view)), without perspective; those in the plane from
/// above.
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
    points: Vec<Vector3<f64>>,
    faces: Vec<Vec<usize>>,
    flat: bool,
    closed: bool,
    values: Vec<f64>,
    label: String,
    title: String,
    range: Option<(f64, f64)>,
    view: [f64; 2],
    size: [u32; 2],
}

impl Picture {
    /// Faces by their corners around; points in the plane have two coordinates.
    pub fn new<const D: usize>(points: &[SVector<f64, D>], faces: Vec<Vec<usize>>) -> Self {
        let padded = |x: &SVector<f64, D>| Vector3::from_fn(|i, _| if i < D { x[i] } else { 0.0 });
        Picture {
            points: points.iter().map(padded).collect(),
            faces,
            flat: D < 3,
            closed: false,
            values: Vec::new(),
            label: String::new(),
            title: String::new(),
            range: None,
            view: [-60.0, 25.0],
            size: [900, 640],
        }
    }

    /// Colours the faces by values at the points, with a bar of the colours and its label; faces with a value that is NaN are
    /// grey.
    #[must_use]
    pub fn coloured(mut self, label: impl Into<String>, values: Vec<f64>) -> Self {
        (self.label, self.values) = (label.into(), values);
        self
    }

    /// Says that the faces enclose a body, corners around outward by the right hand: those that look away are left out.
    #[must_use]
    pub fn closed(mut self) -> Self {
        self.closed = true;
        self
    }

    /// Sets the title.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Sets the values at the ends of the colours; by default the smallest and the largest that are shown.
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

    /// Sets width and height \[px\].
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = [width, height];
        self
    }

    /// Directions to the right, upward and to the eye.
    fn directions(&self) -> [Vector3<f64>; 3] {
        if self.flat {
            return [Vector3::x(), Vector3::y(), Vector3::z()];
        }
        let [(sa, ca), (se, ce)] = self.view.map(|angle| angle.to_radians().sin_cos());
        let eye = Vector3::new(ce * ca, ce * sa, se);
        let right = Vector3::new(-sa, ca, 0.0);
        [right, eye.cross(&right), eye]
    }

    /// The picture as text.
    ///
    /// # Errors
    /// Where values don't fit the points, a face names a point that does not exist, or there is nothing to see.
    pub fn to_svg(&self) -> Result<String, OutputError> {
        self.check()?;
        let [right, up, eye] = self.directions();
        let seen: Vec<[f64; 3]> = self.points.iter().map(|x| [x.dot(&right), x.dot(&up), x.dot(&eye)]).collect();
        let shown: Vec<usize> = self.faces.iter().flatten().copied().collect();
        let ends = |i: usize| {
            shown.iter().map(|&p| seen[p][i]).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
        };
        let [(left, right_end), (low, high)] = [ends(0), ends(1)];
        let bar = if self.values.is_empty() { 0.0 } else { BAR };
        let top = MARGIN + if self.title.is_empty() { 0.0 } else { 28.0 };
        let [width, height] = self.size.map(f64::from);
        let room = [width - 2.0 * MARGIN - bar, height - top - MARGIN];
        let scale = (room[0] / (right_end - left)).min(room[1] / (high - low));
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(self.nothing("a body without extent, or no room for it"));
        }
        let middle = [0.5 * (left + right_end), 0.5 * (low + high)];
        let place = |x: &[f64; 3]| {
            [MARGIN + 0.5 * room[0] + (x[0] - middle[0]) * scale, top + 0.5 * room[1] - (x[1] - middle[1]) * scale]
        };
        let (least, most) = self.range.unwrap_or_else(|| {
            let values = shown.iter().filter_map(|&p| self.values.get(p)).copied();
            let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            if most - least > LEVEL * least.abs().max(most.abs()) { (least, most) } else { (least, least) }
        });
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let title = escaped(&self.title);
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{}\" font-size=\"18\">{title}</text>", MARGIN, MARGIN + 8.0);
        // From the back to the front: what is in front is drawn over it.
        let depth = |face: &[usize]| face.iter().map(|&p| seen[p][2]).sum::<f64>() / face.len() as f64;
        let mut order: Vec<(f64, usize)> = self.faces.iter().enumerate().map(|(k, face)| (depth(face), k)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let light = (right * -0.6 + up * 0.8 + eye * 0.8).normalize();
        let creases = self.creases();
        for (_, face) in order {
            let face = &self.faces[face];
            let normal = self.normal(face);
            if self.closed && !self.flat && normal.dot(&eye) <= 1e-9 {
                continue;
            }
            let bright = if self.flat { 1.0 } else { SHADE + (1.0 - SHADE) * normal.dot(&light).max(0.0) };
            let outline: Vec<[f64; 2]> = face.iter().map(|&p| place(&seen[p])).collect();
            if self.values.is_empty() || face.iter().any(|&p| self.values[p].is_nan()) {
                polygon(&mut svg, &outline, shaded([205.0, 214.0, 224.0], bright));
            } else {
                let part = |v: f64| if most > least { ((v - least) / (most - least)).clamp(0.0, 1.0) } else { 0.0 };
                let values: Vec<f64> = face
                    .iter()
                    .map(|&p| BANDS as f64 * part(self.values[p]))
                    .map(|band| if band.is_finite() { band } else { 0.0 })
                    .collect();
                bands(&mut svg, &outline, &values, bright);
            }
            let _ = write!(svg, "<path d=\"");
            path(&mut svg, &outline);
            svg.push_str("\" fill=\"none\" stroke=\"#222\" stroke-opacity=\"0.4\" stroke-width=\"0.5\"/>\n");
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                if creases.contains(&(a.min(b), a.max(b))) {
                    let ([x1, y1], [x2, y2]) = (place(&seen[a]), place(&seen[b]));
                    let _ = writeln!(
                        svg,
                        "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#111\" stroke-width=\"1.4\"/>"
                    );
                }
            }
        }
        if !self.values.is_empty() {
            self.bar(&mut svg, [width - bar, top], room[1], (least, most));
        }
        svg.push_str("</svg>\n");
        Ok(svg)
    }

    /// Writes the picture, with the directories above it.
    ///
    /// # Errors
    /// As [`to_svg`](Picture::to_svg), and [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_text(path.as_ref(), &self.to_svg()?)
    }

    fn nothing(&self, what: &str) -> OutputError {
        OutputError::Chart { title: self.title.clone(), what: what.to_string() }
    }

    fn check(&self) -> Result<(), OutputError> {
        let length = |what: &str, given, needed| Err(OutputError::Length { what: what.to_string(), given, needed });
        if self.faces.iter().all(Vec::is_empty) {
            return Err(self.nothing("no face to show"));
        }
        if let Some(&point) = self.faces.iter().flatten().find(|point| **point >= self.points.len()) {
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
        Ok(())
    }

    /// Edges at which the contact surface has an angle or ends.
    fn creases(&self) -> HashSet<(usize, usize)> {
        let mut at: HashMap<(usize, usize), Vec<Vector3<f64>>> = HashMap::new();
        for face in &self.faces {
            let normal = self.normal(face);
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                at.entry((a.min(b), a.max(b))).or_default().push(normal);
            }
        }
        let is_crease = |normals: &[Vector3<f64>]| match normals {
            [a, b] => a.dot(b) < CREASE,
            _ => true,
        };
        at.into_iter().filter(|(_, normals)| is_crease(normals)).map(|(edge, _)| edge).collect()
    }

    /// Unit normal of a face, outward by the right hand.
    fn normal(&self, face: &[usize]) -> Vector3<f64> {
        let x = |k: usize| self.points[face[k % face.len()]];
        (0..face.len()).map(|k| (x(k) - x(0)).cross(&(x(k + 1) - x(0)))).sum::<Vector3<f64>>().normalize()
    }

    fn bar(&self, svg: &mut String, [x, top]: [f64; 2], height: f64, (least, most): (f64, f64)) {
        let (bar, step) = (0.8 * height, 0.8 * height / BANDS as f64);
        let from = top + 0.5 * (height - bar) + 10.0;
        for band in 0..BANDS {
            let y = from + bar - (band + 1) as f64 * step;
            let colour = shaded(colour(band), 1.0);
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"18\" height=\"{:.1}\" fill=\"{colour}\"/>",
                step + 0.3
            );
        }
        let range = most - least;
        for mark in if range > 0.0 { 0..=4 } else { 0..=0 } {
            let part = f64::from(mark) / 4.0;
            let text = short(least + part * range, if range > 0.0 { range } else { least });
            let y = from + bar * (1.0 - part) + 4.0;
            let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\" font-size=\"13\">{text}</text>", x + 24.0);
        }
        let label = escaped(&self.label);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"13\">{label}</text>", from - 14.0);
    }
}

/// The colour of a band: dark blue over green to yellow (the map viridis), which prints and colour-blind readers keep apart.
fn colour(band: usize) -> [f64; 3] {
    const STOPS: [[f64; 3]; 9] = [
        [68.0, 1.0, 84.0],
        [71.0, 44.0, 122.0],
        [59.0, 81.0, 139.0],
        [44.0, 113.0, 142.0],
        [33.0, 144.0, 141.0],
        [39.0, 173.0, 129.0],
        [92.0, 200.0, 99.0],
        [170.0, 220.0, 50.0],
        [253.0, 231.0, 37.0],
    ];
    let at = band.min(BANDS - 1) as f64 / (BANDS - 1) as f64 * 8.0;
    let low = (at as usize).min(7);
    std::array::from_fn(|i| STOPS[low][i] + (at - low as f64) * (STOPS[low + 1][i] - STOPS[low][i]))
}

fn shaded(colour: [f64; 3], bright: f64) -> String {
    let [r, g, b] = colour.map(|c| (c * bright).round().clamp(0.0, 255.0) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn path(svg: &mut String, outline: &[[f64; 2]]) {
    for (k, [x, y]) in outline.iter().enumerate() {
        let _ = write!(svg, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
    }
    svg.push('Z');
}

fn polygon(svg: &mut String, outline: &[[f64; 2]], colour: String) {
    svg.push_str("<path d=\"");
    path(svg, outline);
    let _ = writeln!(svg, "\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0.4\"/>");
}

/// A face cut into bands of its values, linear in triangles around its middle.
fn bands(svg: &mut String, outline: &[[f64; 2]], values: &[f64], bright: f64) {
    let band = |value: f64| (value as usize).min(BANDS - 1);
    let (least, most) = values.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &v| (a.min(v), b.max(v)));
    if band(least) == band(most) {
        return polygon(svg, outline, shaded(colour(band(least)), bright));
    }
    let n = outline.len();
    let mean = |of: &dyn Fn(usize) -> f64| (0..n).map(of).sum::<f64>() / n as f64;
    let middle = ([mean(&|k| outline[k][0]), mean(&|k| outline[k][1])], mean(&|k| values[k]));
    let triangles: Vec<[([f64; 2], f64); 3]> = if n == 3 {
        vec![[0, 1, 2].map(|k| (outline[k], values[k]))]
    } else {
        (0..n).map(|k| [middle, (outline[k], values[k]), (outline[(k + 1) % n], values[(k + 1) % n])]).collect()
    };
    for triangle in triangles {
        let (low, high) = triangle.iter().fold((f64::INFINITY, 0.0f64), |(a, b), c| (a.min(c.1), b.max(c.1)));
        for band in band(low)..=band(high) {
            let above = clipped(&triangle, band as f64, 1.0);
            let top = if band + 1 == BANDS { f64::INFINITY } else { (band + 1) as f64 };
            let piece = clipped(&above, top, -1.0);
            if piece.len() > 2 {
                let outline: Vec<[f64; 2]> = piece.iter().map(|c| c.0).collect();
                polygon(svg, &outline, shaded(colour(band), bright));
            }
        }
    }
}

/// The part of a polygon with values above a level (`side` 1) or below it (−1).
fn clipped(polygon: &[([f64; 2], f64)], level: f64, side: f64) -> Vec<([f64; 2], f64)> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (k, &(x, value)) in polygon.iter().enumerate() {
        let (next, following) = polygon[(k + 1) % polygon.len()];
        let inside = |value: f64| side * (value - level) >= 0.0;
        if inside(value) {
            out.push((x, value));
        }
        if inside(value) != inside(following) {
            let t = (level - value) / (following - value);
            out.push(([x[0] + t * (next[0] - x[0]), x[1] + t * (next[1] - x[1])], level));
        }
    }
    out
}

/// Text between elements.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
