//! Draws a laid-out chart with plotters' SVG backend.

mod canvas;

use super::drawn::{Drawn, Sample, WHITE, crossing, dashed, edges};
use super::layout::Layout;
use super::text::{LOWER, RAISE, SUPERSCRIPT};
use super::{Chart, Colour, Marker, Stroke};
use crate::error::OutputError;
use canvas::{Canvas, Failure, units};
use plotters::style::RGBColor;

/// Colours in turn (Okabe and Ito, "Color universal design", 2008), the strongest first.
const PALETTE: [Colour; 6] =
    [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple, Colour::Orange, Colour::Sky];
/// Markers in turn.
const MARKERS: [Marker; 5] = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross];

pub(super) fn svg(chart: &Chart) -> Result<String, OutputError> {
    let layout = Layout::new(chart)?;
    let drawn = resolve(chart, &layout);
    let seen = |d: &Drawn<'_>| {
        let joined = d.series.stroke != Stroke::None && !d.runs.is_empty();
        joined || !d.points.is_empty()
    };
    if !drawn.iter().any(seen) {
        return Err(chart.error("no point to draw: all lie outside the range given"));
    }
    let mut entries: Vec<(&str, Sample<'_>)> =
        drawn.iter().map(|d| (d.series.name.as_str(), Sample::Series(d))).collect();
    let dashed = dashed(chart);
    let references = chart.references.iter().enumerate();
    entries.extend(references.map(|(k, r)| {
        let sample = Sample::ReferenceLine(r.direction, dashed + k);
        (r.name.as_str(), sample)
    }));
    let bands = chart.bands.iter();
    entries.extend(bands.map(|b| (b.name.as_str(), Sample::Band)));
    entries.retain(|(name, _)| !name.trim().is_empty());
    let names: Vec<&str> = entries.iter().map(|(name, _)| *name).collect();
    let legend = layout.legend(&names, &ink(chart, &layout, &drawn), chart.legend);

    let [width, mut height] = layout.size;
    height += legend.as_ref().map_or(0.0, |legend| legend.height);
    let mut text = String::new();
    let failed = |what: Failure| chart.error(what);
    let mut canvas = Canvas::new(&mut text, width, height);
    canvas.fill([0.0, 0.0], [width, height], WHITE).map_err(failed)?;
    canvas.plot(chart, &layout, &drawn).map_err(failed)?;
    if let Some(legend) = &legend {
        canvas.legend(legend, &entries).map_err(failed)?;
    }
    canvas.finish().map_err(failed)?;
    Ok(finish(&text, width, height))
}

/// Gives the picture its size in pixels and raises superscripts, which plotters has no words for.
fn finish(text: &str, width: f64, height: f64) -> String {
    let drawn = format!("width=\"{}\" height=\"{}\"", units(width), units(height));
    let shown = format!(
        "width=\"{}\" height=\"{}\" stroke-linejoin=\"round\" stroke-linecap=\"butt\"",
        width.ceil(),
        height.ceil()
    );
    let raise = format!("<tspan dy=\"-0.5em\" font-size=\"{}%\">", SUPERSCRIPT * 100.0);
    text.replacen(&drawn, &shown, 1).replace(RAISE, &raise).replace(LOWER, "</tspan>")
}

/// Decides colours and markers and cuts the lines at the frame.
fn resolve<'a>(chart: &'a Chart, layout: &Layout) -> Vec<Drawn<'a>> {
    let (mut colours, mut markers) = (PALETTE.iter().cycle(), MARKERS.iter().cycle());
    let mut drawn = Vec::with_capacity(chart.series.len());
    let mut dash = 0;
    for series in &chart.series {
        let colour = match series.colour {
            Colour::Automatic => colours.next().copied().unwrap_or(Colour::Blue),
            chosen => chosen,
        };
        let marker = match series.marker {
            Marker::Automatic => markers.next().copied().unwrap_or(Marker::Circle),
            chosen => chosen,
        };
        let (mut runs, mut points) = (Vec::new(), Vec::new());
        for path in &series.paths {
            let mut previous: Option<[f64; 2]> = None;
            let mut run: Vec<[f64; 2]> = Vec::new();
            for &value in path {
                let at = layout.place(value);
                points.extend(at.filter(|&at| layout.contains(at)));
                let segment = previous.zip(at).and_then(|(a, b)| layout.clip(a, b));
                match segment {
                    Some([a, b]) => {
                        if run.last().is_some_and(|&last| last != a) {
                            runs.push(std::mem::take(&mut run));
                        }
                        if run.is_empty() {
                            run.push(a);
                        }
                        run.push(b);
                    }
                    None if !run.is_empty() => runs.push(std::mem::take(&mut run)),
                    None => {}
                }
                previous = at;
            }
            if !run.is_empty() {
                runs.push(run);
            }
        }
        // Many particles need small dots.
        let radius = match points.len() {
            0..=60 => 3.8,
            61..=300 => 2.8,
            301..=1500 => 2.0,
            _ => 1.2,
        };
        drawn.push(Drawn { series, colour: rgb(colour), marker, radius, dash, runs, points });
        dash += usize::from(series.stroke == Stroke::Dashed);
    }
    drawn
}

/// Pixels that a legend must not cover.
fn ink(chart: &Chart, layout: &Layout, drawn: &[Drawn<'_>]) -> Vec<[f64; 2]> {
    let mut ink = Vec::new();
    for series in drawn {
        if series.marker != Marker::None {
            ink.extend(&series.points);
        }
        if series.series.stroke != Stroke::None {
            for run in &series.runs {
                trace(run, &mut ink);
            }
        }
    }
    for reference in &chart.references {
        trace(&crossing(layout, chart, reference.direction, reference.value), &mut ink);
    }
    for band in &chart.bands {
        let (top, bottom) = edges(layout, chart.y.scale, band);
        let mut y = top;
        while y <= bottom {
            trace(&[[layout.plot.left, y], [layout.plot.right(), y]], &mut ink);
            y += 4.0;
        }
    }
    ink
}

/// Points along a line, close enough that no legend falls between two.
fn trace(run: &[[f64; 2]], ink: &mut Vec<[f64; 2]>) {
    for pair in run.windows(2) {
        let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let pieces = (dx.hypot(dy) / 4.0).ceil().max(1.0) as usize;
        ink.extend((0..=pieces).map(|k| {
            let t = k as f64 / pieces as f64;
            [pair[0][0] + t * dx, pair[0][1] + t * dy]
        }));
    }
}

fn rgb(colour: Colour) -> RGBColor {
    match colour {
        Colour::Automatic | Colour::Blue => RGBColor(0x00, 0x72, 0xB2),
        Colour::Black => RGBColor(0x00, 0x00, 0x00),
        Colour::Grey => RGBColor(0x8C, 0x8C, 0x8C),
        Colour::Vermilion => RGBColor(0xD5, 0x5E, 0x00),
        Colour::Green => RGBColor(0x00, 0x9E, 0x73),
        Colour::Purple => RGBColor(0xCC, 0x79, 0xA7),
        Colour::Orange => RGBColor(0xE6, 0x9F, 0x00),
        Colour::Sky => RGBColor(0x56, 0xB4, 0xE9),
        Colour::Rgb(red, green, blue) => RGBColor(red, green, blue),
    }
}
