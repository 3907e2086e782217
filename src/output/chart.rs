//! Charts as SVG: curves, work against precision, deformed shapes.
//!
//! A [`Chart`] says what is shown; ranges come from the data, and plotters draws axes and series. The legend stands
//! beneath the plot, or names stand [beside their curves](Chart::names_beside_curves).
//!
//! ```
//! use rkpm::output::Chart;
//! let exact = [(0.0, 0.0), (1.0, 0.11), (2.0, 0.19), (3.0, 0.25)];
//! let particles = [(1.0, 0.112), (2.0, 0.191)];
//! let svg = Chart::new("Inflated tube")
//!     .x("bore displacement u [cm]")
//!     .y("pressure p [MPa]")
//!     .line("exact", &exact)
//!     .markers("RKPM, 9 particles", &particles)
//!     .to_svg()?;
//! assert!(svg.contains("RKPM, 9 particles"));
//! # Ok::<(), rkpm::error::OutputError>(())
//! ```

mod draw;
mod labels;
mod ranges;
mod series;

use crate::error::OutputError;

pub use series::{Colour, Marker, Series, Stroke};

/// How an axis measures its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Scale {
    /// Equal differences take equal room.
    #[default]
    Linear,
    /// Equal ratios take equal room; values that are not positive are skipped.
    Logarithmic,
}

impl Scale {
    /// The coordinate in which the axis is even; NaN for what cannot be shown.
    fn forward(self, value: f64) -> f64 {
        match self {
            // Beyond this bound a difference of two values could overflow.
            Self::Linear if value.abs() <= 1e300 => value,
            Self::Logarithmic if value > 0.0 && value.is_finite() => value.log10(),
            _ => f64::NAN,
        }
    }
}

/// One axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Axis {
    /// What it measures, with the unit in brackets.
    pub(crate) label: String,
    /// Linear or logarithmic.
    pub(crate) scale: Scale,
    /// Lower and upper end; from the data where none is given.
    pub(crate) range: Option<(f64, f64)>,
}

/// A dashed line across the plot at a value to compare with.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReferenceLine {
    /// Its name in the legend; an empty one has no entry there.
    pub(crate) name: String,
    /// The axis it crosses, 0 to the right and 1 upwards, and where.
    pub(crate) axis: usize,
    pub(crate) value: f64,
}

/// A grey band across the plot: a reference and its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Band {
    /// Its name in the legend; an empty one has no entry there.
    pub(crate) name: String,
    /// Lower end, in the unit of y.
    pub(crate) lower: f64,
    /// Upper end, in the unit of y.
    pub(crate) upper: f64,
}

/// A chart: what is shown, not yet drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// The title; an empty one takes no room.
    pub(crate) title: String,
    /// The axis to the right.
    pub(crate) x: Axis,
    /// The axis upwards.
    pub(crate) y: Axis,
    /// The series, drawn in this order.
    pub(crate) series: Vec<Series>,
    /// Lines to compare with.
    pub(crate) references: Vec<ReferenceLine>,
    /// Grey bands behind everything else.
    pub(crate) bands: Vec<Band>,
    /// Whether a unit is equally long on both axes: for shapes. Needs linear ones.
    pub(crate) equal_aspect: bool,
    /// Names stand beside their curves.
    pub(crate) beside: bool,
    /// Width and height in pixels, at least 320 by 240. The legend adds to the height; a flat shape drawn to scale takes less.
    pub(crate) size: (u32, u32),
}

impl Default for Chart {
    fn default() -> Self {
        Self {
            title: String::new(),
            x: Axis::default(),
            y: Axis::default(),
            series: Vec::new(),
            references: Vec::new(),
            bands: Vec::new(),
            equal_aspect: false,
            beside: false,
            size: (680, 440),
        }
    }
}

impl Chart {
    /// An empty chart with a title.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Labels the axis to the right, linear.
    #[must_use]
    pub fn x(mut self, label: impl Into<String>) -> Self {
        (self.x.label, self.x.scale) = (label.into(), Scale::Linear);
        self
    }

    /// Labels the axis to the right, logarithmic.
    #[must_use]
    pub fn x_log(mut self, label: impl Into<String>) -> Self {
        (self.x.label, self.x.scale) = (label.into(), Scale::Logarithmic);
        self
    }

    /// Labels the axis upwards, linear.
    #[must_use]
    pub fn y(mut self, label: impl Into<String>) -> Self {
        (self.y.label, self.y.scale) = (label.into(), Scale::Linear);
        self
    }

    /// Labels the axis upwards, logarithmic.
    #[must_use]
    pub fn y_log(mut self, label: impl Into<String>) -> Self {
        (self.y.label, self.y.scale) = (label.into(), Scale::Logarithmic);
        self
    }

    /// Fixes the range of the axis to the right; what lies outside is cut off.
    #[must_use]
    pub fn x_range(mut self, lower: f64, upper: f64) -> Self {
        self.x.range = Some((lower, upper));
        self
    }

    /// Fixes the range of the axis upwards; what lies outside is cut off.
    #[must_use]
    pub fn y_range(mut self, lower: f64, upper: f64) -> Self {
        self.y.range = Some((lower, upper));
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a solid line.
    #[must_use]
    pub fn line<P: Copy + Into<[f64; 2]>>(self, name: impl Into<String>, points: &[P]) -> Self {
        self.with(Series::line(name, points))
    }

    /// Adds markers that are not joined.
    #[must_use]
    pub fn markers<P: Copy + Into<[f64; 2]>>(self, name: impl Into<String>, points: &[P]) -> Self {
        self.with(Series::markers(name, points))
    }

    /// Adds markers joined by a solid line.
    #[must_use]
    pub fn marked_line<P: Copy + Into<[f64; 2]>>(self, name: impl Into<String>, points: &[P]) -> Self {
        self.with(Series::line(name, points).marker(Marker::Automatic))
    }

    /// Adds a black dashed line to compare with: another solution, a slope.
    #[must_use]
    pub fn dashed<P: Copy + Into<[f64; 2]>>(self, name: impl Into<String>, points: &[P]) -> Self {
        let series = Series::line(name, points);
        self.with(series.stroke(Stroke::Dashed).colour(Colour::Black))
    }

    /// Adds a dashed line at one value of y.
    #[must_use]
    pub fn horizontal(mut self, name: impl Into<String>, value: f64) -> Self {
        self.references.push(ReferenceLine { name: name.into(), axis: 1, value });
        self
    }

    /// Adds a dashed line at one value of x.
    #[must_use]
    pub fn vertical(mut self, name: impl Into<String>, value: f64) -> Self {
        self.references.push(ReferenceLine { name: name.into(), axis: 0, value });
        self
    }

    /// Adds a grey band between two values of y.
    #[must_use]
    pub fn band(mut self, name: impl Into<String>, lower: f64, upper: f64) -> Self {
        self.bands.push(Band { name: name.into(), lower, upper });
        self
    }

    /// Draws a unit equally long on both axes, as a picture of a shape needs it.
    #[must_use]
    pub fn equal_aspect(mut self) -> Self {
        self.equal_aspect = true;
        self
    }

    /// Writes names beside their curves, in their colours. The legend keeps those for which there is no room.
    #[must_use]
    pub fn names_beside_curves(mut self) -> Self {
        self.beside = true;
        self
    }

    /// Sets width and height in pixels.
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = (width, height);
        self
    }

    /// What is wrong with this chart.
    fn error(&self, what: impl Into<String>) -> OutputError {
        OutputError::Chart { title: self.title.clone(), what: what.into() }
    }
}
