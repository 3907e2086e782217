//! Faces and lines in pixels, what is in front over what is behind.

use super::colour::{BANDS, colour};
use crate::each::{Each, EachOf, sum_of};
use crate::geometry::Vec3;

/// Pixels of the image on a pixel of the picture, and samples on a pixel of the image, in each direction.
const DENSITY: f64 = 1.5;
const SAMPLES: usize = 2;
/// What reaches a face that no light falls on, what the light adds, and a highlight.
const LIGHT: [f64; 3] = [0.52, 0.5, 0.12];
/// How much nearer than a face a line on it counts \[px\].
const NEARER: f64 = 1.5;

/// A corner of a face: its place \[px\] and depth, its normal if it is lit, its value in [0, 1] or NaN.
pub(super) struct Corner {
    pub at: [f64; 3],
    pub normal: Option<Vec3>,
    pub value: f64,
}

/// How lines look: half the width \[px\], and how much they cover.
pub(super) struct Lines {
    half: f64,
    cover: f64,
}

impl Lines {
    pub(super) const THIN: Lines = Lines { half: 0.35, cover: 0.28 };
    pub(super) const EDGE: Lines = Lines { half: 0.7, cover: 0.85 };
}

/// Pixels with their depths.
pub(super) struct Canvas {
    size: [usize; 2],
    colours: Vec<[f32; 3]>,
    depths: Vec<f32>,
    /// The directions to the light and halfway between it and the eye.
    light: Vec3,
    half: Vec3,
}

impl Canvas {
    /// An empty canvas of a size \[px\], with the directions to the light and to the eye.
    pub(super) fn new(room: [f64; 2], [light, eye]: [Vec3; 2]) -> Self {
        let size = room.each(|side| (side * DENSITY).round().max(1.0) as usize * SAMPLES);
        let count = size[0] * size[1];
        let light = light.normalize();
        Canvas {
            size,
            colours: vec![[255.0; 3]; count],
            depths: vec![f32::NEG_INFINITY; count],
            light,
            half: (light + eye).normalize(),
        }
    }

    /// Draws a face, cut into triangles about its middle.
    pub(super) fn face(&mut self, corners: &[Corner]) {
        if let [a, b, c] = corners {
            return self.triangle([a, b, c]);
        }
        let n = corners.len() as f64;
        let middle = Corner {
            at: [0, 1, 2].each(|i| corners.summed(|corner| corner.at[i]) / n),
            normal: corners.iter().map(|corner| corner.normal).sum(),
            value: corners.summed(|corner| corner.value) / n,
        };
        for (k, corner) in corners.iter().enumerate() {
            self.triangle([&middle, corner, &corners[(k + 1) % corners.len()]]);
        }
    }

    /// The pixels along an axis whose middles lie between two places.
    fn pixels(&self, axis: usize, least: f64, most: f64) -> std::ops::Range<usize> {
        let end = ((most - 0.5).floor() + 1.0).clamp(0.0, self.size[axis] as f64);
        (least - 0.5).ceil().max(0.0) as usize..end as usize
    }

    fn triangle(&mut self, corners: [&Corner; 3]) {
        let dense = DENSITY * SAMPLES as f64;
        let [a, b, c] = corners.each(|corner| [corner.at[0] * dense, corner.at[1] * dense]);
        let across =
            |p: [f64; 2], q: [f64; 2], x: [f64; 2]| (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0]);
        let area = across(a, b, c);
        if area == 0.0 {
            return;
        }
        let [columns, rows] = [0, 1].map(|i| self.pixels(i, a[i].min(b[i]).min(c[i]), a[i].max(b[i]).max(c[i])));
        for row in rows {
            for column in columns.clone() {
                let x = [column as f64 + 0.5, row as f64 + 0.5];
                let parts = [across(b, c, x) / area, across(c, a, x) / area, across(a, b, x) / area];
                if parts.iter().any(|part| *part < 0.0) {
                    continue;
                }
                let mean = |of: &dyn Fn(&Corner) -> f64| sum_of(3, |k| parts[k] * of(corners[k]));
                let (depth, pixel) = (mean(&|corner| corner.at[2]) as f32, row * self.size[0] + column);
                if depth > self.depths[pixel] {
                    self.depths[pixel] = depth;
                    let normal: Option<Vec3> = (0..3).map(|k| corners[k].normal.map(|n| n * parts[k])).sum();
                    self.colours[pixel] = self.shade(mean(&|corner| corner.value), normal);
                }
            }
        }
    }

    fn shade(&self, value: f64, normal: Option<Vec3>) -> [f32; 3] {
        let colour = match value.is_nan() {
            true => [205.0, 214.0, 224.0],
            false => colour((value * BANDS as f64) as usize),
        };
        let Some(normal) = normal.and_then(|normal| normal.try_normalize(0.0)) else {
            return colour.each(|c| c as f32);
        };
        let [ambient, diffuse, highlight] = LIGHT;
        let bright = ambient + diffuse * normal.dot(&self.light).max(0.0);
        let shine = 255.0 * highlight * normal.dot(&self.half).max(0.0).powi(24);
        colour.each(|c| (c * bright + shine).clamp(0.0, 255.0) as f32)
    }

    /// Draws a line where no face is in front of it.
    pub(super) fn line(&mut self, points: impl Iterator<Item = [f64; 3]>, look: Lines) {
        let dense = DENSITY * SAMPLES as f64;
        let mut last: Option<[f64; 3]> = None;
        for to in points {
            if let Some(from) = last {
                self.segment([from, to].each(|x| [x[0] * dense, x[1] * dense, x[2]]), look.half * dense, look.cover);
            }
            last = Some(to);
        }
    }

    /// A segment as the pixels within half a width of it.
    fn segment(&mut self, [p, q]: [[f64; 3]; 2], half: f64, cover: f64) {
        let along = [q[0] - p[0], q[1] - p[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let [columns, rows] = [0, 1].map(|i| self.pixels(i, p[i].min(q[i]) - half, p[i].max(q[i]) + half));
        for row in rows {
            for column in columns.clone() {
                let x = [column as f64 + 0.5 - p[0], row as f64 + 0.5 - p[1]];
                let t = if square > 0.0 { ((x[0] * along[0] + x[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                let off = [x[0] - t * along[0], x[1] - t * along[1]];
                let pixel = row * self.size[0] + column;
                let depth = p[2] + t * (q[2] - p[2]) + NEARER;
                if off[0] * off[0] + off[1] * off[1] <= half * half && depth as f32 >= self.depths[pixel] {
                    self.colours[pixel] = self.colours[pixel].each(|c| c * (1.0 - cover as f32) + 20.0 * cover as f32);
                }
            }
        }
    }

    /// The image as a file in the format PNG.
    pub(super) fn encoded(&self) -> Result<Vec<u8>, String> {
        let [width, height] = self.size.each(|side| side / SAMPLES);
        let mut bytes = Vec::with_capacity(3 * width * height);
        for row in 0..height {
            for column in 0..width {
                let sample = |k: usize| {
                    self.colours[(row * SAMPLES + k / SAMPLES) * self.size[0] + column * SAMPLES + k % SAMPLES]
                };
                for i in 0..3 {
                    let mean = (0..SAMPLES * SAMPLES).map(|k| sample(k)[i]).sum::<f32>() / (SAMPLES * SAMPLES) as f32;
                    bytes.push(mean.round() as u8);
                }
            }
        }
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&bytes)?;
            writer.finish()
        });
        written.map_err(|error| error.to_string())?;
        Ok(file)
    }
}
