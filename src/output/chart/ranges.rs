//! Ranges of the axes.

use crate::each::array_of;
use crate::error::OutputError;

use super::{Axis, Chart, Scale};

/// Room of the plot in even coordinates, lower and upper end of both axes.
pub(super) type Ranges = [(f64, f64); 2];

/// Ranges of both axes in their even coordinates, from what is fixed and from the data.
pub(super) fn ranges(chart: &Chart) -> Result<Ranges, OutputError> {
    let scales = [chart.x.scale, chart.y.scale];
    let fixed = [fixed(chart, &chart.x, "x")?, fixed(chart, &chart.y, "y")?];
    let inside = |axis: usize, t: f64| fixed[axis].is_none_or(|(a, b)| (a..=b).contains(&t));

    // A fixed range of one axis selects the points that decide the other one; where it selects
    // none, a line may still cross it, so all points count.
    let (mut found, mut all) = ([Extent::default(); 2], [Extent::default(); 2]);
    for &[x, y] in chart.series.iter().flat_map(|s| &s.paths).flatten() {
        let t = [scales[0].forward(x), scales[1].forward(y)];
        if t.iter().all(|t| t.is_finite()) {
            all[0].include(t[0]);
            all[1].include(t[1]);
            if inside(0, t[0]) && inside(1, t[1]) {
                found[0].include(t[0]);
                found[1].include(t[1]);
            }
        }
    }
    if all[0].0.is_none() {
        let logarithmic = scales.contains(&Scale::Logarithmic);
        let skipped = if logarithmic { " or not positive on a logarithmic axis" } else { "" };
        return Err(chart.error(format!("no point to draw: there is none, or each is not finite{skipped}")));
    }
    if found[0].0.is_none() {
        found = all;
    }
    for reference in &chart.references {
        let t = scales[reference.axis].forward(reference.value);
        ensure!(
            t.is_finite(),
            chart.error(format!("reference {:?} at {:e} cannot be shown on its axis", reference.name, reference.value))
        );
        found[reference.axis].include(t);
    }
    for band in &chart.bands {
        let upper = scales[1].forward(band.upper);
        // A band may reach down to nothing on a logarithmic axis, but not up.
        let order = band.lower <= band.upper && band.lower.is_finite();
        ensure!(order && upper.is_finite(), chart.error(format!(
                "band {:?} from {:e} to {:e} cannot be shown: give finite ends, the lower first, the upper positive on a logarithmic axis",
                band.name, band.lower, band.upper
            )));
        found[1].include(upper);
        let lower = scales[1].forward(band.lower);
        if lower.is_finite() {
            found[1].include(lower);
        }
    }
    Ok(array_of(|axis| fixed[axis].unwrap_or_else(|| found[axis].padded(scales[axis], !chart.equal_aspect))))
}

/// A range set by the user, in the even coordinate.
fn fixed(chart: &Chart, axis: &Axis, name: &str) -> Result<Option<(f64, f64)>, OutputError> {
    let Some((low, high)) = axis.range else {
        return Ok(None);
    };
    let range = (axis.scale.forward(low), axis.scale.forward(high));
    // The comparison of spans keeps ticks apart in double precision.
    let resolved = (range.1 - range.0) > 1e-9 * range.0.abs().max(range.1.abs());
    if resolved && range.0.is_finite() && range.1.is_finite() {
        return Ok(Some(range));
    }
    Err(chart.error(format!(
        "range of {name} from {low:e} to {high:e} cannot be shown: give finite ends, the lower first, both positive on a logarithmic axis"
    )))
}

/// Smallest and largest coordinate seen.
#[derive(Debug, Clone, Copy, Default)]
struct Extent(Option<(f64, f64)>);

impl Extent {
    fn include(&mut self, t: f64) {
        let (low, high) = self.0.unwrap_or((t, t));
        self.0 = Some((low.min(t), high.max(t)));
    }

    /// The range with some air; an end at zero may stay there, as curves from the origin ask for it.
    fn padded(self, scale: Scale, keeps_origin: bool) -> (f64, f64) {
        let (low, high) = self.0.unwrap_or((0.0, 1.0));
        let (span, largest) = (high - low, low.abs().max(high.abs()));
        let flat = match scale {
            Scale::Linear => span <= 1e-9 * largest || span == 0.0,
            Scale::Logarithmic => span <= 1e-3,
        };
        if flat {
            let half = match scale {
                Scale::Linear if largest > 0.0 => 0.05 * largest,
                Scale::Linear => 1.0,
                Scale::Logarithmic => 0.5,
            };
            return (low - half, high + half);
        }
        let air = 0.05 * span;
        let origin = |end: f64| end == 0.0 && scale == Scale::Linear && keeps_origin;
        (if origin(low) { low } else { low - air }, if origin(high) { high } else { high + air })
    }
}

/// The part of a line inside the plot (Liang and Barsky).
pub(super) fn clip(ranges: &Ranges, a: (f64, f64), b: (f64, f64)) -> Option<[(f64, f64); 2]> {
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for ((low, high), a, b) in [(ranges[0], a.0, b.0), (ranges[1], a.1, b.1)] {
        if a == b {
            if !(low..=high).contains(&a) {
                return None;
            }
            continue;
        }
        let (t0, t1) = ((low - a) / (b - a), (high - a) / (b - a));
        enter = enter.max(t0.min(t1));
        leave = leave.min(t0.max(t1));
    }
    // Lines from far away meet the edge with a rounding of their own size.
    let inside = |(x, y): (f64, f64)| (x.clamp(ranges[0].0, ranges[0].1), y.clamp(ranges[1].0, ranges[1].1));
    let at = |t: f64| inside((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
    (enter <= leave).then(|| [if enter == 0.0 { a } else { at(enter) }, if leave == 1.0 { b } else { at(leave) }])
}
