//! What a chart shows, with its pixels.

use plotters::style::RGBColor;

use super::layout::Layout;
use super::{Band, Chart, Direction, Marker, Scale, Series, Stroke};

pub(super) const WHITE: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);
/// A series with its colour, marker and pixels decided.
pub(super) struct Drawn<'a> {
    pub(super) series: &'a Series,
    pub(super) colour: RGBColor,
    pub(super) marker: Marker,
    pub(super) radius: f64,
    /// Which of the dashes, where its lines are dashed.
    pub(super) dash: usize,
    /// The visible runs of its lines.
    pub(super) runs: Vec<Vec<[f64; 2]>>,
    /// Its visible points.
    pub(super) points: Vec<[f64; 2]>,
}

/// What stands in front of a name in the legend.
pub(super) enum Sample<'a> {
    Series(&'a Drawn<'a>),
    ReferenceLine(Direction, usize),
    Band,
}

/// Number of dashed series; reference lines take the dashes that follow.
pub(super) fn dashed(chart: &Chart) -> usize {
    let all = chart.series.iter();
    all.filter(|s| s.stroke == Stroke::Dashed).count()
}

/// The ends of a reference line; none where it lies outside the plot.
pub(super) fn crossing(layout: &Layout, chart: &Chart, direction: Direction, value: f64) -> Vec<[f64; 2]> {
    let plot = layout.plot;
    let ends = match direction {
        Direction::Horizontal => {
            let y = layout.up(chart.y.scale.forward(value));
            [[plot.left, y], [plot.right(), y]]
        }
        Direction::Vertical => {
            let x = layout.across(chart.x.scale.forward(value));
            [[x, plot.bottom()], [x, plot.top]]
        }
    };
    layout.clip(ends[0], ends[1]).map_or(Vec::new(), Vec::from)
}

/// Upper and lower pixel of a band, cut at the frame; equal where nothing is left of it.
pub(super) fn edges(layout: &Layout, scale: Scale, band: &Band) -> (f64, f64) {
    let plot = layout.plot;
    let inside = |y: f64| y.clamp(plot.top, plot.bottom());
    let lower = scale.forward(band.lower);
    let bottom = if lower.is_finite() { layout.up(lower) } else { plot.bottom() };
    (inside(layout.up(scale.forward(band.upper))), inside(bottom))
}
