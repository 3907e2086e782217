//! Where everything goes: ranges, ticks, margins and the legend, in pixels from the upper left.

use super::ranges::ranges;
use super::text::{width, wrap};
use super::ticks::Ticks;
use super::{Aspect, Chart, Legend, Scale};
use crate::error::OutputError;

/// Sizes of the fonts in pixels.
pub(super) const TITLE: f64 = 15.0;
pub(super) const LABEL: f64 = 13.0;
pub(super) const TICK: f64 = 12.0;
pub(super) const ENTRY: f64 = 12.0;
/// Pixels along a side beyond which a chart is refused: no screen is as large, and dashes would fill the memory.
const LARGEST: u32 = 20_000;
/// Distance between two lines of text relative to the size of the font.
pub(super) const LEADING: f64 = 1.3;
/// Width of the sample of a line or marker in the legend, and the gap behind it.
pub(super) const SAMPLE: f64 = 28.0;
pub(super) const GAP: f64 = 8.0;
/// Free room at the edges of the picture.
const EDGE: f64 = 10.0;
/// Distance between an axis and its tick labels.
pub(super) const TICK_GAP: f64 = 7.0;

/// A rectangle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }
}

/// The plot and the axes around it.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    /// The whole picture, without a legend beneath.
    pub size: [f64; 2],
    pub plot: Frame,
    /// Ranges of x and y in the coordinates in which the axes are even.
    pub ranges: [(f64, f64); 2],
    scales: [Scale; 2],
    pub ticks: [Ticks; 2],
    pub title: Vec<String>,
    pub x_label: Vec<String>,
    pub y_label: Vec<String>,
    /// Right edge of the label of the upward axis.
    pub y_label_right: f64,
}

impl Layout {
    pub(super) fn new(chart: &Chart) -> Result<Self, OutputError> {
        let scales = [chart.x.scale, chart.y.scale];
        if chart.aspect == Aspect::Equal && scales != [Scale::Linear; 2] {
            return Err(chart.error("equal aspect needs two linear axes"));
        }
        if chart.size.0.max(chart.size.1) > LARGEST {
            return Err(chart.error(format!("{} by {} pixels; up to {LARGEST} are drawn", chart.size.0, chart.size.1)));
        }
        let data = ranges(chart)?;
        let [canvas, height] = [f64::from(chart.size.0.max(320)), f64::from(chart.size.1.max(240))];
        let line = |size: f64, lines: usize| size * LEADING * lines as f64;
        let above = |lines: usize| EDGE + line(TITLE, lines) + 6.0;
        let beneath = |lines: usize| TICK_GAP + TICK * LEADING + line(LABEL, lines) + EDGE;
        let room = height - above(1) - beneath(1);

        // Margins depend on the labels, these on the ticks and those on the margins: three rounds
        // settle it, because labels hardly change in width from one to the next.
        let (mut left, mut right) = (60.0, 20.0);
        let mut layout = Self::default();
        for _ in 0..3 {
            let mut plot = Frame { left, top: 0.0, width: (canvas - left - right).max(100.0), height: room.max(100.0) };
            let mut ranges = data;
            if chart.aspect == Aspect::Equal {
                ranges = equalise(data, &mut plot);
            }
            // Centred above and beneath the plot, text must end before the nearer edge.
            let middle = plot.left + plot.width / 2.0;
            let span = 2.0 * (middle.min(canvas - middle) - EDGE);
            let title = wrap(&chart.title, TITLE, span);
            let x_label = wrap(&chart.x.label, LABEL, span);
            plot.top = above(title.len());
            let y_label = wrap(&chart.y.label, LABEL, plot.height + plot.top - EDGE);

            let x_ticks = spaced(scales[0], ranges[0], plot.width, 9, |label| width(label, TICK) + 14.0);
            let most = (plot.height / 42.0) as usize;
            let y_ticks = spaced(scales[1], ranges[1], plot.height, most, |_| TICK * 1.6);
            let widest = |ticks: &Ticks| {
                let widths = ticks.major.iter().map(|(_, label)| width(label, TICK));
                widths.fold(0.0, f64::max)
            };
            let labels = widest(&y_ticks) + TICK_GAP;
            let mut margin = EDGE + line(LABEL, y_label.len()) + labels;
            if !y_label.is_empty() {
                margin += 4.0;
            }
            let overhang = widest(&x_ticks) / 2.0 + 4.0;
            (left, right) = (margin.max(overhang), overhang.max(18.0));
            layout = Self {
                size: [canvas, plot.bottom() + beneath(x_label.len())],
                plot,
                ranges,
                scales,
                ticks: [x_ticks, y_ticks],
                title,
                x_label,
                y_label,
                y_label_right: plot.left - labels - 4.0,
            };
        }
        Ok(layout)
    }

    /// Where a value of the data lies; none where it cannot be shown.
    pub(super) fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let at = [self.across(self.scales[0].forward(x)), self.up(self.scales[1].forward(y))];
        at.iter().all(|value| value.is_finite()).then_some(at)
    }

    /// Pixel of an even coordinate along the axis to the right.
    pub(super) fn across(&self, x: f64) -> f64 {
        let (low, high) = self.ranges[0];
        self.plot.left + (x - low) / (high - low) * self.plot.width
    }

    /// Pixel of an even coordinate along the axis upwards.
    pub(super) fn up(&self, y: f64) -> f64 {
        let (low, high) = self.ranges[1];
        self.plot.bottom() - (y - low) / (high - low) * self.plot.height
    }

    /// The part of a segment that lies in the plot (Liang and Barsky).
    pub(super) fn clip(&self, a: [f64; 2], b: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let lower = [self.plot.left, self.plot.top];
        let upper = [self.plot.right(), self.plot.bottom()];
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            let run = b[axis] - a[axis];
            // Half a tenth of a pixel of grace: rounding must not cut a line along the frame.
            let (p, q) = (lower[axis] - 0.05 - a[axis], upper[axis] + 0.05 - a[axis]);
            if run == 0.0 {
                if p > 0.0 || q < 0.0 {
                    return None;
                }
                continue;
            }
            let (t0, t1) = (p / run, q / run);
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        if enter > leave {
            return None;
        }
        // Lines from far away meet the frame with a rounding of their own size.
        let framed = |x: [f64; 2]| std::array::from_fn(|i| x[i].clamp(lower[i] - 0.05, upper[i] + 0.05));
        let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
        let start = if enter == 0.0 { a } else { at(enter) };
        Some([framed(start), framed(if leave == 1.0 { b } else { at(leave) })])
    }

    pub(super) fn contains(&self, at: [f64; 2]) -> bool {
        let Frame { left, top, width, height } = self.plot;
        Frame { left: left - 0.5, top: top - 0.5, width: width + 1.0, height: height + 1.0 }.contains(at)
    }

    /// Places the legend, given the names and the pixels that the data cover.
    pub(super) fn legend(&self, names: &[&str], ink: &[[f64; 2]], wish: Legend) -> Option<LegendLayout> {
        if names.is_empty() || wish == Legend::None {
            return None;
        }
        if wish == Legend::Automatic
            && let Some(inside) = self.legend_inside(names, ink)
        {
            return Some(inside);
        }
        Some(self.legend_beneath(names))
    }

    fn legend_inside(&self, names: &[&str], ink: &[[f64; 2]]) -> Option<LegendLayout> {
        let text = names.iter().map(|n| width(n, ENTRY)).fold(0.0, f64::max);
        let row = ENTRY * 1.5;
        let (pad, margin) = (8.0, 10.0);
        let (w, h) = (2.0 * pad + SAMPLE + GAP + text, 2.0 * pad + row * names.len() as f64 - (row - ENTRY));
        let plot = self.plot;
        if w > 0.65 * plot.width || h > 0.65 * plot.height {
            return None;
        }
        let columns = [plot.right() - margin - w, plot.left + margin, plot.left + (plot.width - w) / 2.0];
        let rows = [plot.top + margin, plot.bottom() - margin - h, plot.top + (plot.height - h) / 2.0];
        let air = 5.0;
        for reach in [2, 3] {
            for &top in &rows[..reach] {
                for &left in &columns[..reach] {
                    let around =
                        Frame { left: left - air, top: top - air, width: w + 2.0 * air, height: h + 2.0 * air };
                    if ink.iter().any(|&at| around.contains(at)) {
                        continue;
                    }
                    let entries = names.iter().enumerate().map(|(k, name)| LegendEntry {
                        left: left + pad,
                        middle: top + pad + ENTRY / 2.0 + row * k as f64,
                        lines: vec![(*name).to_owned()],
                    });
                    return Some(LegendLayout {
                        frame: Some(Frame { left, top, width: w, height: h }),
                        entries: entries.collect(),
                        height: 0.0,
                    });
                }
            }
        }
        None
    }

    fn legend_beneath(&self, names: &[&str]) -> LegendLayout {
        let room = self.size[0] - 2.0 * EDGE;
        let spacing = 24.0;
        let lines: Vec<Vec<String>> = names.iter().map(|name| wrap(name, ENTRY, room - SAMPLE - GAP)).collect();
        let widths = lines.iter().flatten().map(|line| width(line, ENTRY));
        let column = SAMPLE + GAP + widths.fold(0.0, f64::max);
        let most = ((room + spacing) / (column + spacing)).max(1.0) as usize;
        // As many rows as needed, and then no more columns than fill them.
        let rows = names.len().div_ceil(most.min(names.len()));
        let columns = names.len().div_ceil(rows);
        let total = columns as f64 * (column + spacing) - spacing;
        let first = (self.size[0] - total) / 2.0;
        let (mut top, mut entries) = (self.size[1], Vec::new());
        for row in lines.chunks(columns) {
            let tallest = row.iter().map(Vec::len).max().unwrap_or(1).max(1);
            for (k, lines) in row.iter().enumerate() {
                entries.push(LegendEntry {
                    left: first + k as f64 * (column + spacing),
                    middle: top + ENTRY / 2.0,
                    lines: lines.clone(),
                });
            }
            top += tallest as f64 * ENTRY * LEADING + 4.0;
        }
        LegendLayout { frame: None, entries, height: top + EDGE - self.size[1] }
    }
}

/// A legend in its place.
#[derive(Debug, Clone)]
pub(super) struct LegendLayout {
    /// Its frame, where it stands inside the plot.
    pub frame: Option<Frame>,
    pub entries: Vec<LegendEntry>,
    /// What it adds to the height of the picture.
    pub height: f64,
}

/// One entry of a legend.
#[derive(Debug, Clone)]
pub(super) struct LegendEntry {
    pub left: f64,
    /// Height of the sample and of the middle of the first line.
    pub middle: f64,
    pub lines: Vec<String>,
}

/// Ticks whose labels don't touch: fewer, until they fit.
fn spaced(scale: Scale, range: (f64, f64), length: f64, most: usize, extent: impl Fn(&str) -> f64) -> Ticks {
    let pixels = |position: f64| (position - range.0) / (range.1 - range.0) * length;
    let fits =
        |a: &(f64, String), b: &(f64, String)| (pixels(b.0) - pixels(a.0)).abs() >= (extent(&a.1) + extent(&b.1)) / 2.0;
    let mut ticks = Ticks::default();
    for count in (2..=most.max(2)).rev() {
        ticks = Ticks::new(scale, range, count);
        if ticks.major.windows(2).all(|pair| fits(&pair[0], &pair[1])) {
            return ticks;
        }
    }
    let mut kept: Vec<(f64, String)> = Vec::new();
    for tick in ticks.major.drain(..) {
        if kept.last().is_none_or(|last| fits(last, &tick)) {
            kept.push(tick);
        }
    }
    ticks.major = kept;
    ticks
}

/// Gives both axes the same pixels per unit: shrinks the plot as far as it stays readable, then
/// widens a range.
fn equalise(ranges: [(f64, f64); 2], plot: &mut Frame) -> [(f64, f64); 2] {
    let span = ranges.map(|(low, high)| high - low);
    let scale = (plot.width / span[0]).min(plot.height / span[1]);
    let (width, height) = ((span[0] * scale).max(plot.width.min(180.0)), (span[1] * scale).max(plot.height.min(140.0)));
    plot.left += (plot.width - width) / 2.0;
    (plot.width, plot.height) = (width, height);
    let widened = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = ((low + high) / 2.0, pixels / scale / 2.0);
        (middle - half, middle + half)
    };
    [widened(ranges[0], width), widened(ranges[1], height)]
}
