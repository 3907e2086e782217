//! Names of series beside their curves.
use crate::each::EachOf;
/// Width of a letter and height of a name \[px\].
const LETTER: f64 = 7.6;
const HEIGHT: f64 = 16.0;
/// Distance of a name from the point that it stands at \[px\].
const GAP: f64 = 8.0;
/// Points of a curve that a name is tried at, at most; both ends are among them.
const TRIED: usize = 15;
/// What it costs to cover another name, a marker, and a piece of a line as long as a name is high; names stand at the last point
/// where nothing is covered, at the first, and elsewhere.
const COVERED: [f64; 3] = [1e3, 12.0, 3.0];
const PLACES: [f64; 3] = [0.0, 0.5, 2.0];

/// What is drawn under one name, in pixels from the upper left corner of the plot.
pub(super) struct Curve {
    /// Letters of its name; 0 where it has none.
    pub(super) letters: usize,
    /// Its lines.
    pub(super) lines: Vec<Vec<[f64; 2]>>,
    /// Its markers.
    pub(super) markers: Vec<[f64; 2]>,
    /// Where its name may stand: points of the curve, from the first to the last.
    pub(super) anchors: Vec<[f64; 2]>,
}

/// A box: lowest and highest x and y.
type Frame = [[f64; 2]; 2];

/// The left end of each name, in the middle of its height \[px\]; nothing for curves without a name, without a point, or whose
/// name would cover another.
pub(super) fn place(curves: &[Curve], room: [f64; 2]) -> Vec<Option<[f64; 2]>> {
    let mut taken: Vec<Frame> = Vec::new();
    let mut places = Vec::with_capacity(curves.len());
    for curve in curves {
        let best = candidates(curve, room)
            .map(|(frame, place)| (place + cost(&frame, curves, &taken), frame))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(cost, _)| *cost < COVERED[0]);
        places.push(best.map(|(_, frame)| [frame[0][0], (frame[1][0] + frame[1][1]) / 2.0]));
        taken.extend(best.map(|(_, frame)| frame));
    }
    places
}

/// Boxes around points of a curve that lie in the plot, each with what its place costs.
fn candidates(curve: &Curve, room: [f64; 2]) -> impl Iterator<Item = (Frame, f64)> {
    let (width, last) = (curve.letters as f64 * LETTER, curve.anchors.len().saturating_sub(1));
    let step = curve.anchors.len().div_ceil(TRIED - 1).max(1);
    let tried = curve.anchors.iter().enumerate().filter(move |(k, _)| width > 0.0 && (k % step == 0 || *k == last));
    tried.flat_map(move |(k, at)| {
        let place = if k == last { PLACES[0] } else { PLACES[usize::from(k > 0) + 1] };
        let [right, left, middle] = [at[0] + GAP, at[0] - GAP - width, at[0] - width / 2.0];
        let [level, above, below] = [0.0, -GAP - HEIGHT / 2.0, GAP + HEIGHT / 2.0].each(|shift| at[1] + shift);
        let around = [
            (right, level),
            (middle, above),
            (middle, below),
            (right, above),
            (right, below),
            (left, level),
            (left, above),
            (left, below),
        ];
        around.into_iter().enumerate().filter_map(move |(side, (x, y))| {
            let frame = [[x, x + width], [y - HEIGHT / 2.0, y + HEIGHT / 2.0]];
            let inside = (0..2).all(|axis| frame[axis][0] >= 0.0 && frame[axis][1] <= room[axis]);
            inside.then_some((frame, place + 0.05 * side as f64))
        })
    })
}

/// What a box covers.
fn cost(frame: &Frame, curves: &[Curve], taken: &[Frame]) -> f64 {
    let apart = |other: &Frame| (0..2).any(|axis| frame[axis][0] >= other[axis][1] || frame[axis][1] <= other[axis][0]);
    let holds = |at: &[f64; 2]| (0..2).all(|axis| (frame[axis][0] - 4.0..frame[axis][1] + 4.0).contains(&at[axis]));
    let names = taken.iter().filter(|other| !apart(other)).count() as f64;
    let markers = curves.iter().flat_map(|curve| &curve.markers).filter(|at| holds(at)).count() as f64;
    let pieces = curves.iter().flat_map(|curve| &curve.lines).flat_map(|line| line.windows(2));
    let covered: f64 = pieces.map(|piece| length_within(frame, piece[0], piece[1])).sum();
    COVERED[0] * names + COVERED[1] * markers + COVERED[2] * covered / HEIGHT
}

/// The length of the part of a line within a box.
fn length_within(frame: &Frame, a: [f64; 2], b: [f64; 2]) -> f64 {
    let ranges = frame.each(|[low, high]| (low, high));
    let part = super::ranges::clip(&ranges, a.into(), b.into());
    part.map_or(0.0, |[from, to]| (to.0 - from.0).hypot(to.1 - from.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_inside_the_plot_and_apart() {
        // Five curves that end within a name's height of one another.
        let curves: Vec<Curve> = (0..5)
            .map(|k| {
                let line = vec![[10.0, 20.0 + 4.0 * f64::from(k)], [280.0, 100.0 + 3.0 * f64::from(k)]];
                Curve { letters: 8, markers: line.clone(), anchors: line.clone(), lines: vec![line] }
            })
            .collect();
        let places: Vec<[f64; 2]> = place(&curves, [300.0, 200.0]).into_iter().flatten().collect();
        assert!(places.len() >= 4, "{places:?}");
        for (k, a) in places.iter().enumerate() {
            assert!(a[0] >= 0.0 && a[0] + 8.0 * LETTER <= 300.0 && (8.0..=192.0).contains(&a[1]), "{a:?}");
            let apart = |b: &[f64; 2]| (a[0] - b[0]).abs() >= 8.0 * LETTER || (a[1] - b[1]).abs() >= HEIGHT;
            assert!(places[..k].iter().all(apart), "{places:?}");
        }
        assert_eq!(length_within(&[[0.0, 2.0], [0.0, 2.0]], [-1.0, 1.0], [5.0, 1.0]), 2.0);
    }
}
