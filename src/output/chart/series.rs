//! What a chart shows: points, how they are joined, marked and coloured.
use crate::each::Each;
/// How the points of a series are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stroke {
    /// Not at all.
    None,
    /// By a solid line.
    #[default]
    Solid,
    /// By a dashed line.
    Dashed,
}

/// How the points of a series are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Marker {
    /// Not at all.
    #[default]
    None,
    /// By the next shape in turn, so that marked series differ without their colours.
    Automatic,
    /// ●
    Circle,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// ✕
    Cross,
}

/// The colour of a series: the palette of Okabe and Ito, which colour-blind readers can tell apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Colour {
    /// The next one of the palette.
    #[default]
    Automatic,
    /// Black: for what the rest is compared with.
    Black,
    /// Grey: for what stands in the background, such as an undeformed shape.
    Grey,
    /// Blue.
    Blue,
    /// Vermilion.
    Vermilion,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Orange.
    Orange,
    /// Sky blue.
    Sky,
    /// Any other: red, green, blue.
    Rgb(u8, u8, u8),
}

/// One entry of the legend and the points that belong to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Its name in the legend; an empty one has no entry there.
    pub(crate) name: String,
    /// Polylines, or one list of points. A point that is not finite, or not positive on a
    /// logarithmic axis, is skipped, and the line broken there.
    pub(crate) paths: Vec<Vec<[f64; 2]>>,
    /// How the points are joined.
    pub(crate) stroke: Stroke,
    /// How the points are marked.
    pub(crate) marker: Marker,
    /// The colour of both.
    pub(crate) colour: Colour,
}

impl Series {
    /// Its name in the legend.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its polylines, or one list of points.
    pub fn paths(&self) -> &[Vec<[f64; 2]>] {
        &self.paths
    }

    /// A solid line through the points.
    pub fn line<P: Copy + Into<[f64; 2]>>(name: impl Into<String>, points: &[P]) -> Self {
        Self { name: name.into(), paths: vec![points.mapped(|&p| p.into())], ..Self::default() }
    }

    /// Several polylines under one name: the outlines and grid lines of a shape.
    pub fn outlines<P: Copy + Into<[f64; 2]>>(name: impl Into<String>, paths: &[Vec<P>]) -> Self {
        let points = |path: &Vec<P>| path.mapped(|&p| p.into());
        Self { name: name.into(), paths: paths.mapped(points), ..Self::default() }
    }

    /// The points, marked and not joined.
    pub fn markers<P: Copy + Into<[f64; 2]>>(name: impl Into<String>, points: &[P]) -> Self {
        Self::line(name, points).stroke(Stroke::None).marker(Marker::Automatic)
    }

    /// The same series, joined otherwise.
    #[must_use]
    pub fn stroke(self, stroke: Stroke) -> Self {
        Self { stroke, ..self }
    }

    /// The same series, marked otherwise.
    #[must_use]
    pub fn marker(self, marker: Marker) -> Self {
        Self { marker, ..self }
    }

    /// The same series in another colour.
    #[must_use]
    pub fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}
