//! The drawing area and what is put on it.

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle};

use super::super::drawn::{Drawn, Sample, WHITE, crossing, dashed, edges};
use super::super::layout::{ENTRY, GAP, LABEL, LEADING, Layout, LegendLayout, SAMPLE, TICK, TICK_GAP, TITLE};
use super::super::{Chart, Direction, Marker, Stroke};

const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const FRAME: RGBColor = RGBColor(0x44, 0x44, 0x44);
const GRID: RGBColor = RGBColor(0xE3, 0xE3, 0xE3);
const SHADE: RGBColor = RGBColor(0xD2, 0xD2, 0xD2);
const FONT: &str = "Helvetica, Arial, DejaVu Sans, sans-serif";
/// Dashes and the gaps behind them, in turn, so that two dashed lines of one colour differ.
const DASHES: [[f64; 4]; 4] = [[7.0, 4.5, 7.0, 4.5], [2.0, 2.5, 2.0, 2.5], [11.0, 3.0, 2.5, 3.0], [4.0, 2.5, 4.0, 2.5]];

/// What a backend reports, in words: plotters does not export the type.
pub(super) type Failure = String;

fn reason(failure: impl std::fmt::Display) -> Failure {
    failure.to_string()
}

/// The backend counts whole units: ten to a pixel, so that curves stay smooth.
pub(super) fn units(pixels: f64) -> i32 {
    (pixels * 10.0).round() as i32
}

pub(super) struct Canvas<'a> {
    backend: SVGBackend<'a>,
}

impl<'a> Canvas<'a> {
    pub(super) fn new(text: &'a mut String, width: f64, height: f64) -> Self {
        let size = (units(width) as u32, units(height) as u32);
        Self { backend: SVGBackend::with_string(text, size) }
    }

    pub(super) fn plot(&mut self, chart: &Chart, layout: &Layout, drawn: &[Drawn<'_>]) -> Result<(), Failure> {
        let plot = layout.plot;
        for band in &chart.bands {
            let (top, bottom) = edges(layout, chart.y.scale, band);
            // A band thinner than a hair would vanish.
            let grow = (0.75 - (bottom - top) / 2.0).max(0.0);
            let visible = bottom > plot.top && top < plot.bottom();
            if visible {
                self.fill([plot.left, top - grow], [plot.right(), bottom + grow], SHADE)?;
            }
        }
        let [x_ticks, y_ticks] = &layout.ticks;
        for (position, _) in &x_ticks.major {
            let x = layout.across(*position);
            self.line(&[[x, plot.top], [x, plot.bottom()]], GRID, 0.8)?;
        }
        for (position, _) in &y_ticks.major {
            let y = layout.up(*position);
            self.line(&[[plot.left, y], [plot.right(), y]], GRID, 0.8)?;
        }
        for (k, reference) in chart.references.iter().enumerate() {
            let run = crossing(layout, chart, reference.direction, reference.value);
            self.dashes(&run, INK, 1.3, dashed(chart) + k)?;
        }
        self.axes(layout)?;
        for series in drawn {
            for run in &series.runs {
                self.stroke(series, run)?;
            }
        }
        // Above all lines, so that a curve through them hides none.
        for series in drawn {
            for &at in &series.points {
                self.marker(series, at)?;
            }
        }
        Ok(())
    }

    /// Frame, ticks and all text around the plot.
    /// Ends the picture.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        self.backend.present().map_err(reason)
    }

    fn axes(&mut self, layout: &Layout) -> Result<(), Failure> {
        let plot = layout.plot;
        let [x_ticks, y_ticks] = &layout.ticks;
        let (right, bottom) = (plot.right(), plot.bottom());
        for (positions, length) in
            [(x_ticks.major.iter().map(|t| t.0).collect::<Vec<_>>(), 4.0), (x_ticks.minor.clone(), 2.5)]
        {
            for x in positions.into_iter().map(|p| layout.across(p)) {
                self.line(&[[x, bottom], [x, bottom - length]], FRAME, 1.0)?;
            }
        }
        for (positions, length) in
            [(y_ticks.major.iter().map(|t| t.0).collect::<Vec<_>>(), 4.0), (y_ticks.minor.clone(), 2.5)]
        {
            for y in positions.into_iter().map(|p| layout.up(p)) {
                self.line(&[[plot.left, y], [plot.left + length, y]], FRAME, 1.0)?;
            }
        }
        let frame =
            [[plot.left, plot.top], [right, plot.top], [right, bottom], [plot.left, bottom], [plot.left, plot.top]];
        self.line(&frame, FRAME, 1.0)?;

        for (position, label) in &x_ticks.major {
            let at = [layout.across(*position), bottom + TICK_GAP + TICK / 2.0];
            self.text(label, at, TICK, HPos::Center)?;
        }
        for (position, label) in &y_ticks.major {
            let at = [plot.left - TICK_GAP, layout.up(*position)];
            self.text(label, at, TICK, HPos::Right)?;
        }
        let middle = plot.left + plot.width / 2.0;
        let lines = layout.title.len();
        for (k, line) in layout.title.iter().enumerate() {
            let y = plot.top - 8.0 - ((lines - k) as f64 - 0.5) * TITLE * LEADING;
            self.text_bold(line, [middle, y], TITLE)?;
        }
        for (k, line) in layout.x_label.iter().enumerate() {
            let y = bottom + TICK_GAP + TICK * LEADING + (k as f64 + 0.5) * LABEL * LEADING;
            self.text(line, [middle, y], LABEL, HPos::Center)?;
        }
        let lines = layout.y_label.len();
        // A long label may reach up beside the title, but not out of the picture.
        let longest = layout.y_label.iter().map(|l| super::super::text::width(l, LABEL));
        let half = longest.fold(0.0, f64::max) / 2.0;
        let y = (plot.top + plot.height / 2.0).min(bottom - half).max(half);
        for (k, line) in layout.y_label.iter().enumerate() {
            let x = layout.y_label_right - ((lines - k) as f64 - 0.5) * LABEL * LEADING;
            self.text_upwards(line, [x, y], LABEL)?;
        }
        Ok(())
    }

    pub(super) fn legend(&mut self, legend: &LegendLayout, entries: &[(&str, Sample<'_>)]) -> Result<(), Failure> {
        if let Some(frame) = legend.frame {
            let (left, top, right, bottom) = (frame.left, frame.top, frame.right(), frame.bottom());
            self.fill([left, top], [right, bottom], WHITE)?;
            let outline = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
            self.line(&outline, SHADE, 0.8)?;
        }
        for (entry, (_, sample)) in legend.entries.iter().zip(entries) {
            let (left, y) = (entry.left, entry.middle);
            let run = [[left, y], [left + SAMPLE, y]];
            match sample {
                Sample::Series(series) => {
                    self.stroke(series, &run)?;
                    // A sample must be seen even where the dots of the plot are tiny.
                    let series =
                        Drawn { runs: Vec::new(), points: Vec::new(), radius: series.radius.max(2.4), ..**series };
                    self.marker(&series, [left + SAMPLE / 2.0, y])?;
                }
                Sample::ReferenceLine(Direction::Horizontal, dash) => {
                    self.dashes(&run, INK, 1.3, *dash)?;
                }
                Sample::ReferenceLine(Direction::Vertical, dash) => {
                    let x = left + SAMPLE / 2.0;
                    self.dashes(&[[x, y + 8.0], [x, y - 8.0]], INK, 1.3, *dash)?;
                }
                Sample::Band => self.fill([left, y - 5.0], [left + SAMPLE, y + 5.0], SHADE)?,
            }
            for (k, line) in entry.lines.iter().enumerate() {
                let at = [left + SAMPLE + GAP, y + k as f64 * ENTRY * LEADING];
                self.text(line, at, ENTRY, HPos::Left)?;
            }
        }
        Ok(())
    }

    fn stroke(&mut self, series: &Drawn<'_>, run: &[[f64; 2]]) -> Result<(), Failure> {
        match series.series.stroke {
            Stroke::None => Ok(()),
            Stroke::Solid => {
                // Grid lines of a shape are many, and thinner.
                let width = if series.runs.len() > 8 { 1.0 } else { 1.8 };
                self.line(run, series.colour, width)
            }
            Stroke::Dashed => self.dashes(run, series.colour, 1.5, series.dash),
        }
    }

    fn marker(&mut self, series: &Drawn<'_>, at: [f64; 2]) -> Result<(), Failure> {
        let radius = series.radius;
        // A white edge sets a marker off from the line through it and from its neighbours.
        if radius > 2.5 {
            self.shape(series.marker, at, radius + 0.9, WHITE)?;
        }
        self.shape(series.marker, at, radius, series.colour)
    }

    fn shape(&mut self, marker: Marker, [x, y]: [f64; 2], r: f64, colour: RGBColor) -> Result<(), Failure> {
        let polygon = |corners: &[[f64; 2]]| -> Vec<(i32, i32)> {
            let at = |&[dx, dy]: &[f64; 2]| (units(x + r * dx), units(y + r * dy));
            corners.iter().map(at).collect()
        };
        let filled = ShapeStyle::from(colour).filled();
        // Half widths that give the shapes about the area of the circle.
        let corners = match marker {
            Marker::None => return Ok(()),
            Marker::Automatic | Marker::Circle => {
                let centre = (units(x), units(y));
                return self.backend.draw_circle(centre, units(r) as u32, &filled, true).map_err(reason);
            }
            Marker::Square => polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
            Marker::Triangle => polygon(&[[0.0, -1.25], [1.1, 0.75], [-1.1, 0.75]]),
            Marker::Diamond => polygon(&[[0.0, -1.25], [1.25, 0.0], [0.0, 1.25], [-1.25, 0.0]]),
            Marker::Cross => {
                // The white edge of a cross is a wider one.
                let width = if colour == WHITE { 3.4 } else { 1.8 };
                for s in [-1.0, 1.0] {
                    let d = 0.9 * r;
                    self.line(&[[x - d, y - s * d], [x + d, y + s * d]], colour, width)?;
                }
                return Ok(());
            }
        };
        self.backend.fill_polygon(corners, &filled).map_err(reason)
    }

    pub(super) fn fill(&mut self, from: [f64; 2], to: [f64; 2], colour: RGBColor) -> Result<(), Failure> {
        let corner = |[x, y]: [f64; 2]| (units(x), units(y));
        let style = ShapeStyle::from(colour).filled();
        self.backend.draw_rect(corner(from), corner(to), &style, true).map_err(reason)
    }

    fn line(&mut self, run: &[[f64; 2]], colour: RGBColor, width: f64) -> Result<(), Failure> {
        let mut path: Vec<(i32, i32)> = run.iter().map(|&[x, y]| (units(x), units(y))).collect();
        path.dedup();
        if path.len() < 2 {
            return Ok(());
        }
        let style = ShapeStyle::from(colour).stroke_width(units(width) as u32);
        self.backend.draw_path(path, &style).map_err(reason)
    }

    fn dashes(&mut self, run: &[[f64; 2]], colour: RGBColor, width: f64, dash: usize) -> Result<(), Failure> {
        let pattern = DASHES[dash % DASHES.len()];
        // Even phases are drawn, odd ones are gaps.
        let (mut phase, mut left) = (0, pattern[0]);
        let mut dash: Vec<[f64; 2]> = run.first().copied().into_iter().collect();
        for pair in run.windows(2) {
            let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            let length = dx.hypot(dy);
            let mut done = 0.0;
            while length - done > left {
                done += left;
                let t = done / length;
                let at = [pair[0][0] + t * dx, pair[0][1] + t * dy];
                if phase % 2 == 0 {
                    dash.push(at);
                    self.line(&dash, colour, width)?;
                }
                dash = vec![at];
                phase = (phase + 1) % pattern.len();
                left = pattern[phase];
            }
            left -= length - done;
            if phase % 2 == 0 {
                dash.push(pair[1]);
            }
        }
        if phase % 2 == 0 {
            self.line(&dash, colour, width)?;
        }
        Ok(())
    }

    fn text(&mut self, text: &str, at: [f64; 2], size: f64, side: HPos) -> Result<(), Failure> {
        self.write(text, at, size, side, FontStyle::Normal, FontTransform::None)
    }

    fn text_bold(&mut self, text: &str, at: [f64; 2], size: f64) -> Result<(), Failure> {
        self.write(text, at, size, HPos::Center, FontStyle::Bold, FontTransform::None)
    }

    fn text_upwards(&mut self, text: &str, at: [f64; 2], size: f64) -> Result<(), Failure> {
        let turned = FontTransform::Rotate270;
        self.write(text, at, size, HPos::Center, FontStyle::Normal, turned)
    }

    /// Writes one line, its middle at the height given.
    fn write(
        &mut self,
        text: &str,
        [x, y]: [f64; 2],
        size: f64,
        side: HPos,
        weight: FontStyle,
        transform: FontTransform,
    ) -> Result<(), Failure> {
        // Plotters centres on half the height of an x, readers on that of digits and capitals.
        let shift = 0.1 * size;
        let [x, y] = match transform {
            FontTransform::Rotate270 => [x + shift, y],
            _ => [x, y + shift],
        };
        // Plotters divides sizes by 1.24 on the way to SVG.
        let font = FontDesc::new(FontFamily::Name(FONT), 10.0 * size * 1.24, weight);
        let style = TextStyle {
            font: font.transform(transform),
            color: INK.to_backend_color(),
            pos: Pos::new(side, VPos::Center),
        };
        // XML has no way to write these.
        let forbidden = |c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}');
        let text: String = text.chars().map(|c| if forbidden(c) { ' ' } else { c }).collect();
        self.backend.draw_text(&text, &style, (units(x), units(y))).map_err(reason)
    }
}
