//! Draws a chart with plotters.

use std::path::Path;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, DynElement};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::labels::{Curve, place};
use super::ranges::{Ranges, clip, ranges};
use super::{Chart, Colour, Marker, Scale, Series, Stroke};
use crate::each::{Each, EachOf};
use crate::error::OutputError;
use crate::output::{short, write_file};

type Svg<'a> = SVGBackend<'a>;
type Plot<'a, 'b> = ChartContext<'a, Svg<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Colours in turn (Okabe and Ito, "Color universal design", 2008), the strongest first.
const PALETTE: [Colour; 6] =
    [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple, Colour::Orange, Colour::Sky];
/// Markers in turn.
const MARKERS: [Marker; 5] = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross];
const FONT: &str = "Helvetica, Arial, DejaVu Sans, sans-serif";
const GRID: RGBColor = RGBColor(0xE3, 0xE3, 0xE3);
const SHADE: RGBColor = RGBColor(0xD2, 0xD2, 0xD2);
/// The colour of a band's name.
const NAMED: RGBColor = RGBColor(0x50, 0x50, 0x50);
/// Units per pixel: plotters counts whole units, and curves are to stay smooth.
const PIXEL: i32 = 10;
/// Sizes of letters: of the title, of labels and of all other text \[px\]; plotters divides them by 1.24.
const LETTERS: [i32; 3] = [21, 19, 17];
/// Heights of a row of the legend and of the title \[px\].
const ROW: i32 = 22;
const TITLE: i32 = 24;
/// Room beside the plot: left and beneath for labels, and elsewhere \[px\].
const LEFT: i32 = 84;
const BENEATH: i32 = 56;
const EDGE: i32 = 14;
/// Pixels along a side beyond which a chart is refused: no screen is as large, and dashes would fill the memory.
const LARGEST: u32 = 20_000;

/// Points in even coordinates.
type Points = Vec<(f64, f64)>;

/// A series, reference line or band as it is drawn and named in the legend, in even coordinates.
struct Drawn<'a> {
    name: &'a str,
    colour: RGBColor,
    /// Width of its lines \[px\]; 0 for points that are not joined.
    width: i32,
    /// Length of its dashes \[px\].
    dash: Option<i32>,
    marker: Marker,
    /// The visible runs of its lines.
    runs: Vec<Points>,
    /// Its visible points.
    points: Points,
}

impl Chart {
    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`OutputError::Chart`] where no point of any series can be shown, a range, band or reference
    /// line cannot be, or equal aspect is set with a logarithmic axis.
    pub fn to_svg(&self) -> Result<String, OutputError> {
        svg(self)
    }

    /// Writes the chart as an SVG file, with the directories above it.
    ///
    /// # Errors
    /// As [`to_svg`](Self::to_svg), and [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_file(path.as_ref(), &["svg"], &self.to_svg()?)
    }
}

fn svg(chart: &Chart) -> Result<String, OutputError> {
    let scales = [chart.x.scale, chart.y.scale];
    if chart.equal_aspect && scales != [Scale::Linear; 2] {
        return Err(chart.error("equal aspect needs two linear axes"));
    }
    if chart.size.0.max(chart.size.1) > LARGEST {
        return Err(chart.error(format!("{} by {} pixels; up to {LARGEST} are drawn", chart.size.0, chart.size.1)));
    }
    let mut ranges = ranges(chart)?;
    let [width, mut height] = [chart.size.0.max(320), chart.size.1.max(240)].each(|side| side as i32);
    let title = if chart.title.is_empty() { 0 } else { TITLE };
    if chart.equal_aspect {
        let room = room(width, height, title);
        // One scale for both axes: a flat shape takes less height, a slender one stands in the middle.
        let spans = ranges.each(|(low, high)| high - low);
        let unit = (spans[0] / room[0]).max(spans[1] / room[1]);
        let used = [room[0], (spans[1] / unit).max(80.0)];
        height -= (room[1] - used[1]) as i32;
        let kept = [0, 1].each(|axis| (used[axis] as i32 as f64 * unit - spans[axis]) / 2.0);
        ranges = [0, 1].each(|axis| (ranges[axis].0 - kept[axis], ranges[axis].1 + kept[axis]));
    }
    let drawn = resolve(chart, &ranges);
    let visible = |d: &Drawn<'_>| (d.width > 0 && !d.runs.is_empty()) || !d.points.is_empty();
    ensure!(
        drawn[..chart.series.len()].iter().any(visible),
        chart.error("no point to draw: all lie outside the range given")
    );
    let beside = if chart.beside { names(chart, &ranges, &drawn, room(width, height, title)) } else { Vec::new() };
    let named = |k: usize| beside.get(k).is_some_and(Option::is_some);
    let entries: Vec<&Drawn<'_>> =
        drawn.iter().enumerate().filter(|(k, d)| !d.name.trim().is_empty() && !named(*k)).map(|(_, d)| d).collect();
    let widest = entries.iter().map(|d| d.name.chars().count() as i32).max().unwrap_or(0) * 8 + 48;
    let columns = (width / widest.max(1)).clamp(1, entries.len().max(1) as i32) as usize;
    let rows = entries.len().div_ceil(columns);
    let size = [width, height + ROW * rows as i32 + if rows > 0 { 6 } else { 0 }];

    let mut text = String::new();
    let paint = |text: &mut String| -> Result<(), Box<dyn std::error::Error>> {
        let root = Svg::with_string(text, ((size[0] * PIXEL) as u32, (size[1] * PIXEL) as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        let (upper, lower) = root.split_vertically(height * PIXEL);
        plot(chart, &upper, ranges, &drawn, &beside)?;
        let lower = lower.margin(0, 6 * PIXEL, EDGE * PIXEL, 0);
        let cells = if rows > 0 { lower.split_evenly((rows, columns)) } else { Vec::new() };
        for (entry, cell) in entries.iter().zip(cells) {
            legend(entry, &cell)?;
        }
        root.present()?;
        Ok(())
    };
    paint(&mut text).map_err(|failure| chart.error(failure.to_string()))?;
    // plotters takes titles and names as they come.
    let text = text.replace(crate::output::is_forbidden, " ");
    let units = size.each(|side| side * PIXEL);
    let given = format!("width=\"{}\" height=\"{}\"", units[0], units[1]);
    Ok(text.replacen(&given, &format!("width=\"{}\" height=\"{}\"", size[0], size[1]), 1))
}

/// Axes, bands, lines and markers.
fn plot<'a>(
    chart: &Chart,
    area: &DrawingArea<Svg<'a>, Shift>,
    [x, y]: Ranges,
    drawn: &[Drawn<'_>],
    beside: &[Option<[f64; 2]>],
) -> Result<(), Box<dyn std::error::Error>> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(EDGE * PIXEL).margin_left(6 * PIXEL).margin_bottom(0);
    builder.set_label_area_size(LabelAreaPosition::Left, LEFT * PIXEL);
    builder.set_label_area_size(LabelAreaPosition::Bottom, BENEATH * PIXEL);
    if !chart.title.is_empty() {
        builder.margin_top((EDGE + TITLE) * PIXEL);
        let size = (LETTERS[0] * PIXEL)
            .min((area.dim_in_pixel().0 as i32 * 9 / 5) / chart.title.chars().count().max(1) as i32);
        let style = TextStyle::from((FONT, size)).pos(Pos::new(HPos::Center, VPos::Center));
        area.draw(&Text::new(
            chart.title.clone(),
            (area.dim_in_pixel().0 as i32 / 2, (EDGE + TITLE) * PIXEL / 2),
            style,
        ))?;
    }
    let mut plot = builder.build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    let label = |scale: Scale, (low, high): (f64, f64)| {
        move |even: &f64| match scale {
            Scale::Linear => short(*even, [low, high]),
            // Two digits, and more where the ends differ by less than a factor of two.
            Scale::Logarithmic if high - low < 2.0 => {
                let apart = (10f64.powf(high - low) - 1.0).log10().floor();
                rounded(10f64.powf(*even), (2.0 - apart.min(0.0)) as i32)
            }
            Scale::Logarithmic if (even - even.round()).abs() < 1e-9 => power_of_ten(even.round() as i32),
            Scale::Logarithmic => format!("{:.1e}", 10f64.powf(*even)),
        }
    };
    // At most one tick per decade.
    let count = |scale: Scale, (low, high): (f64, f64), most: i32| match scale {
        Scale::Logarithmic if high - low >= 2.0 => ((high - low) as usize + 1).min(most as usize),
        _ => most as usize,
    };
    let (across, up) = plot.plotting_area().dim_in_pixel();
    plot.configure_mesh()
        .x_desc(chart.x.label.as_str())
        .y_desc(chart.y.label.as_str())
        .axis_desc_style((FONT, LETTERS[1] * PIXEL))
        .label_style((FONT, LETTERS[2] * PIXEL))
        .x_labels(count(chart.x.scale, x, (across as i32 / (90 * PIXEL)).clamp(2, 9)))
        .y_labels(count(chart.y.scale, y, (up as i32 / (42 * PIXEL)).clamp(2, 12)))
        .x_label_formatter(&label(chart.x.scale, x))
        .y_label_formatter(&label(chart.y.scale, y))
        .set_all_tick_mark_size(5 * PIXEL)
        .axis_style(BLACK.stroke_width(PIXEL as u32))
        .bold_line_style(GRID.stroke_width(PIXEL as u32))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for band in &chart.bands {
        let [low, high] = [band.lower, band.upper].each(|end| match chart.y.scale.forward(end) {
            even if even.is_nan() => y.0,
            even => even.clamp(y.0, y.1),
        });
        plot.draw_series([Rectangle::new([(x.0, low), (x.1, high)], SHADE.filled())])?;
    }
    for (k, series) in drawn.iter().enumerate() {
        lines(&mut plot, series, k < chart.series.len())?;
    }
    let area = plot.plotting_area().strip_coord_spec();
    for (drawn, at) in drawn.iter().zip(beside) {
        if let Some([x, y]) = at.map(|at| at.each(|px| (px * f64::from(PIXEL)) as i32)) {
            let colour = if drawn.colour == SHADE { NAMED } else { drawn.colour };
            let style =
                TextStyle::from((FONT, LETTERS[2] * PIXEL)).pos(Pos::new(HPos::Left, VPos::Center)).color(&colour);
            area.draw(&Text::new(drawn.name.to_owned(), (x, y), style))?;
        }
    }
    Ok(())
}

/// Width and height of the plot \[px\].
fn room(width: i32, height: i32, title: i32) -> [f64; 2] {
    [width - LEFT - 6 - EDGE, height - title - BENEATH - EDGE].each(f64::from)
}

/// Where the names of what is drawn stand, from the upper left corner of the plot \[px\].
fn names(chart: &Chart, ranges: &Ranges, drawn: &[Drawn<'_>], room: [f64; 2]) -> Vec<Option<[f64; 2]>> {
    let [x, y] = *ranges;
    let at = |&(a, b): &(f64, f64)| [(a - x.0) / (x.1 - x.0) * room[0], (y.1 - b) / (y.1 - y.0) * room[1]];
    let first_band = drawn.len() - chart.bands.len();
    let curve = |(k, drawn): (usize, &Drawn<'_>)| {
        let markers: Vec<[f64; 2]> = drawn.points.mapped(at);
        let lines: Vec<Vec<[f64; 2]>> = drawn.runs.mapped(|run| run.mapped(at));
        let anchors = match k.checked_sub(first_band).map(|k| &chart.bands[k]) {
            Some(band) => {
                let ends = [band.lower, band.upper].each(|end| chart.y.scale.forward(end).max(y.0).min(y.1));
                let middle = at(&(x.0, (ends[0] + ends[1]) / 2.0))[1];
                vec![[room[0], middle], [0.0, middle]]
            }
            None if markers.is_empty() => lines.concat(),
            None => markers.clone(),
        };
        Curve { letters: drawn.name.trim().chars().count(), lines, markers, anchors }
    };
    place(&drawn.iter().enumerate().map(curve).collect::<Vec<_>>(), room)
}

/// The lines and the markers of a series.
fn lines<'a>(plot: &mut Plot<'_, 'a>, drawn: &Drawn<'_>, marked: bool) -> Result<(), Box<dyn std::error::Error>> {
    if drawn.width > 0 {
        for run in &drawn.runs {
            plot.draw_series([path(drawn, run.clone())])?;
        }
    }
    if marked && drawn.marker != Marker::None {
        // Many particles need small dots.
        let radius = match drawn.points.len() {
            0..=60 => 38,
            61..=300 => 28,
            301..=1500 => 20,
            _ => 12,
        };
        let area = plot.plotting_area().strip_coord_spec();
        let (left, top) = area.get_base_pixel();
        for at in &drawn.points {
            let (x, y) = plot.plotting_area().map_coordinate(at);
            area.draw(&marker(drawn.marker, (x - left, y - top), radius, drawn.colour))?;
        }
    }
    Ok(())
}

/// A sample and the name of a series.
fn legend<'a>(drawn: &Drawn<'_>, cell: &DrawingArea<Svg<'a>, Shift>) -> Result<(), Box<dyn std::error::Error>> {
    let middle = cell.dim_in_pixel().1 as i32 / 2;
    if drawn.width > 0 {
        cell.draw(&path(drawn, vec![(0, middle), (28 * PIXEL, middle)]))?;
    }
    if drawn.marker != Marker::None {
        cell.draw(&marker(drawn.marker, (14 * PIXEL, middle), 38, drawn.colour))?;
    }
    let style = TextStyle::from((FONT, LETTERS[2] * PIXEL)).pos(Pos::new(HPos::Left, VPos::Center));
    cell.draw(&Text::new(drawn.name.to_owned(), (36 * PIXEL, middle), style))?;
    Ok(())
}

fn path<'a, C: Clone + 'static>(drawn: &Drawn<'_>, points: Vec<C>) -> DynElement<'static, Svg<'a>, C> {
    let style = drawn.colour.stroke_width((drawn.width * PIXEL / 2) as u32);
    match drawn.dash {
        Some(dash) => DashedPathElement::new(points, dash * PIXEL, 4 * PIXEL, style).into_dyn(),
        None => PathElement::new(points, style).into_dyn(),
    }
}

fn marker<'a>(shape: Marker, (x, y): (i32, i32), r: i32, colour: RGBColor) -> DynElement<'static, Svg<'a>, (i32, i32)> {
    let (full, far) = (colour.filled(), r + r / 3);
    match shape {
        Marker::Square => Rectangle::new([(x - r, y - r), (x + r, y + r)], full).into_dyn(),
        Marker::Triangle => TriangleMarker::new((x, y), far, full).into_dyn(),
        Marker::Diamond => Polygon::new(vec![(x - far, y), (x, y - far), (x + far, y), (x, y + far)], full).into_dyn(),
        Marker::Cross => Cross::new((x, y), r, colour.stroke_width(14)).into_dyn(),
        _ => Circle::new((x, y), r, full).into_dyn(),
    }
}

/// Decides colours and markers and cuts lines at the edges of the plot: series, reference lines, bands.
fn resolve<'a>(chart: &'a Chart, ranges: &Ranges) -> Vec<Drawn<'a>> {
    let (mut colours, mut markers) = (PALETTE.iter().cycle(), MARKERS.iter().cycle());
    let mut dashes = 0;
    let mut dash = || {
        dashes += 1;
        Some([7, 2, 11, 4][(dashes - 1) % 4])
    };
    let mut drawn: Vec<Drawn<'a>> = Vec::new();
    for series in &chart.series {
        let colour = match series.colour {
            Colour::Automatic => colours.next().copied().unwrap_or_default(),
            chosen => chosen,
        };
        let marker = match series.marker {
            Marker::Automatic => markers.next().copied().unwrap_or_default(),
            chosen => chosen,
        };
        let (runs, points) = visible(chart, series, ranges);
        let dash = if series.stroke == Stroke::Dashed { dash() } else { None };
        let width = if series.stroke == Stroke::None { 0 } else { 3 };
        drawn.push(Drawn { name: &series.name, colour: rgb(colour), width, dash, marker, runs, points });
    }
    let line = |name, colour, width, dash, run: Points| {
        let runs = if run.is_empty() { Vec::new() } else { vec![run] };
        Drawn { name, colour, width, dash, marker: Marker::None, runs, points: Vec::new() }
    };
    for reference in &chart.references {
        let [x, y] = *ranges;
        let ends = match reference.axis {
            0 => [y.0, y.1].each(|y| (chart.x.scale.forward(reference.value), y)),
            _ => [x.0, x.1].each(|x| (x, chart.y.scale.forward(reference.value))),
        };
        let run = clip(ranges, ends[0], ends[1]).map_or(Vec::new(), Vec::from);
        drawn.push(line(reference.name.as_str(), BLACK, 2, dash(), run));
    }
    drawn.extend(chart.bands.iter().map(|band| line(band.name.as_str(), SHADE, 20, None, Vec::new())));
    drawn
}

/// The visible runs of a series and its visible points.
fn visible(chart: &Chart, series: &Series, ranges: &Ranges) -> (Vec<Points>, Points) {
    let (mut runs, mut points) = (Vec::new(), Vec::new());
    for path in &series.paths {
        let mut run = Points::new();
        let mut previous = None;
        for &[x, y] in path {
            let at = (chart.x.scale.forward(x), chart.y.scale.forward(y));
            let at = (at.0.is_finite() && at.1.is_finite()).then_some(at);
            points.extend(at.filter(|&at| clip(ranges, at, at).is_some()));
            let piece = previous.zip(at).and_then(|(from, to)| clip(ranges, from, to));
            if piece.is_none_or(|[from, _]| run.last() != Some(&from)) && !run.is_empty() {
                runs.push(std::mem::take(&mut run));
            }
            if let Some([from, to]) = piece {
                if run.is_empty() {
                    run.push(from);
                }
                run.push(to);
            }
            previous = at;
        }
        runs.push(run);
    }
    runs.retain(|run| !run.is_empty());
    (runs, points)
}

/// 10 with a raised exponent.
fn power_of_ten(exponent: i32) -> String {
    let raised = |c: char| match c.to_digit(10) {
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
        None => '⁻',
    };
    "10".chars().chain(exponent.to_string().chars().map(raised)).collect()
}

/// A number of so many digits.
fn rounded(value: f64, digits: i32) -> String {
    if !(1e-4..1e5).contains(&value) {
        return format!("{value:.*e}", digits as usize - 1);
    }
    let last = (value * 1.000001).log10().floor() as i32 + 1 - digits;
    let (unit, digits) = (10f64.powi(last.abs()), last.min(0).unsigned_abs() as usize);
    if last > 0 { format!("{:.0}", (value / unit).round() * unit) } else { format!("{value:.digits$}") }
}

fn rgb(colour: Colour) -> RGBColor {
    match colour {
        Colour::Automatic | Colour::Blue => RGBColor(0x00, 0x72, 0xB2),
        Colour::Black => BLACK,
        Colour::Grey => RGBColor(0x8C, 0x8C, 0x8C),
        Colour::Vermilion => RGBColor(0xD5, 0x5E, 0x00),
        Colour::Green => RGBColor(0x00, 0x9E, 0x73),
        Colour::Purple => RGBColor(0xCC, 0x79, 0xA7),
        Colour::Orange => RGBColor(0xE6, 0x9F, 0x00),
        Colour::Sky => RGBColor(0x56, 0xB4, 0xE9),
        Colour::Rgb(red, green, blue) => RGBColor(red, green, blue),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_at_the_edges_and_ticks_have_few_digits() {
        let ranges = [(0.0, 1.0), (0.0, 2.0)];
        assert_eq!(clip(&ranges, (-1.0, 1.0), (3.0, 1.0)), Some([(0.0, 1.0), (1.0, 1.0)]));
        assert_eq!(clip(&ranges, (0.5, 0.5), (0.5, 0.5)), Some([(0.5, 0.5); 2]));
        assert_eq!(clip(&ranges, (-1.0, 1.0), (0.5, 4.0)), None);
        assert_eq!(power_of_ten(-12), "10⁻¹²");
        let texts =
            [10f64.powf(2.6), 10f64.powf(3.1), 1e-3, 10f64.powf(-3.2), 2.0, 1e-9].map(|value| rounded(value, 2));
        assert_eq!(texts, ["400", "1300", "0.0010", "0.00063", "2.0", "1.0e-9"]);
    }
}
