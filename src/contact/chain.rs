//! The boundary parts that may touch each other as chains of chords, and which chord faces which.

use crate::geometry::Point;

use super::facing::{BEHIND, THROUGH};
use super::mortar::{End, Facing, Overlap};

/// Bins around a chord that are searched: what is further away is not looked for.
const REACH: usize = 16;
/// Differences of places along a chord that are none.
const SAME: f64 = 1e-12;

/// A chord between two particles of a boundary part.
#[derive(Debug, Clone)]
pub(super) struct Chord {
    /// The trace functions at its ends, counted through all parts.
    pub traces: [u32; 2],
    /// Which part it belongs to.
    pub part: u8,
    /// Outward to the right of the way (1) or to the left (-1).
    pub sign: f64,
    /// Reference measure at the ends, of which the trace functions take their part.
    pub measure: [f64; 2],
    /// Its middle at rest.
    pub middle: Point<2>,
    /// Its outward normal at rest.
    pub outward: Point<2>,
}

/// Chords of one or two parts.
pub(super) struct Chain {
    pub chords: Vec<Chord>,
    /// For each chord those that it meets at a particle, itself among them: they never touch.
    beside: Vec<Vec<u32>>,
    /// Whether chords touch those of the other part alone.
    two: bool,
    /// How much deeper than usual a chord may lie behind another one \[length\].
    pub deeper: f64,
    /// The first chord and those after it of each trace function: at most two.
    pub of_trace: Vec<Vec<(u32, usize)>>,
}

/// A chain at a state.
pub(super) struct Laid {
    /// Of each trace function.
    pub ends: Vec<Point<2>>,
    /// For each chord what faces it.
    pub facing: Vec<Vec<Overlap>>,
    /// How far around a chord is known.
    pub reach: f64,
}

impl Chain {
    /// `particles` are those of the trace functions.
    pub(crate) fn new(chords: Vec<Chord>, particles: &[u32], two: bool) -> Self {
        let mut of_trace = vec![Vec::new(); particles.len()];
        for (k, chord) in chords.iter().enumerate() {
            for (end, trace) in chord.traces.iter().enumerate() {
                of_trace[*trace as usize].push((k as u32, end));
            }
        }
        // Chords meet at particles: a corner has a trace function for each of its faces.
        let mut at: std::collections::HashMap<u32, Vec<u32>> = std::collections::HashMap::new();
        for (k, chord) in chords.iter().enumerate() {
            for trace in chord.traces {
                at.entry(particles[trace as usize]).or_default().push(k as u32);
            }
        }
        let meeting = |chord: &Chord| {
            let mut beside: Vec<u32> = Vec::new();
            for &trace in &chord.traces {
                beside.extend_from_slice(&at[&particles[trace as usize]]);
            }
            beside.sort_unstable();
            beside.dedup();
            beside
        };
        let beside = chords.iter().map(meeting).collect();
        Chain { chords, beside, two, deeper: 0.0, of_trace }
    }

    /// Two chords at a state.
    pub(crate) fn facing(&self, laid: &Laid, chord: usize, other: usize) -> Facing {
        let (mine, its) = (&self.chords[chord], &self.chords[other]);
        let traces = [mine.traces[0], mine.traces[1], its.traces[0], its.traces[1]].map(|trace| trace as usize);
        Facing { ends: traces.map(|trace| laid.ends[trace]), sign: mine.sign, measure: mine.measure }
    }

    /// Finds what faces each chord that carries pressures.
    pub(crate) fn laid(&self, ends: Vec<Point<2>>) -> Laid {
        let boxes = self.chords.iter().map(|chord| {
            let [a, b] = chord.traces.map(|trace| ends[trace as usize]);
            [a.zip_map(&b, f64::min), a.zip_map(&b, f64::max)]
        });
        let bins = Bins::new(&boxes.collect::<Vec<_>>());
        let facing = (0..self.chords.len()).map(|chord| self.search(chord, &ends, &bins)).collect();
        Laid { ends, facing, reach: (REACH - 1) as f64 * bins.size }
    }

    /// What faces a chord along its normal, the nearest where there are several. Of two chords that face each other the one that
    /// comes first carries the pressures: those of both would share one load and none of them would come to rest.
    fn search(&self, chord: usize, ends: &[Point<2>], bins: &Bins) -> Vec<Overlap> {
        let mine = &self.chords[chord];
        if self.two && mine.part != 0 {
            return Vec::new();
        }
        let [a, b] = mine.traces.map(|trace| ends[trace as usize]);
        let along = b - a;
        let square = along.norm_squared();
        let length = square.sqrt();
        let normal = Point::<2>::new(along[1], -along[0]) * (mine.sign / length);
        // Chords opposite with the places of their ends along this one and their distances.
        let mut found: Vec<(u32, [f64; 2], [f64; 2])> = Vec::new();
        let (mut covered, mut farthest) = (0.0, 0.0f64);
        let middle = (a + b) * 0.5;
        for ring in 0..bins.rings().min(REACH) {
            if covered >= 1.0 - SAME && farthest < (ring as f64 - 1.0) * bins.size - length {
                break;
            }
            for other in bins.ring(&middle, ring) {
                let its = &self.chords[other as usize];
                if self.two && its.part == mine.part || found.iter().any(|f| f.0 == other) {
                    continue;
                }
                let points = its.traces.map(|trace| ends[trace as usize]);
                let places = points.map(|y| (y - a).dot(&along) / square);
                let (from, to) = (places[0].min(places[1]).max(0.0), places[0].max(places[1]).min(1.0));
                if !(to - from > SAME) {
                    continue;
                }
                let direction = points[1] - points[0];
                let size = direction.norm();
                let its_normal = Point::<2>::new(direction[1], -direction[0]) * (its.sign / size);
                if normal.dot(&its_normal) >= 0.0 || self.beside[chord].binary_search(&other).is_ok() {
                    continue;
                }
                let gaps = points.map(|y| (y - a).dot(&normal));
                let at = |place: f64| gaps[0] + (gaps[1] - gaps[0]) * (place - places[0]) / (places[1] - places[0]);
                let gap = at(0.5 * (from + to));
                if gap < -BEHIND * length.max(size) - self.deeper || gap < 0.0 && !self.two && self.through(mine, its) {
                    continue;
                }
                covered += to - from;
                farthest = farthest.max(gap.abs());
                found.push((other, places, gaps));
            }
        }
        let mut cuts = vec![0.0, 1.0];
        cuts.extend(found.iter().flat_map(|f| f.1).filter(|&place| place > 0.0 && place < 1.0));
        cuts.sort_by(f64::total_cmp);
        let mut overlaps = Vec::new();
        for cut in cuts.windows(2) {
            let (from, to) = (cut[0], cut[1]);
            if !(to - from > SAME) {
                continue;
            }
            let at = 0.5 * (from + to);
            let mut best: Option<(f64, usize)> = None;
            for (k, (_, places, gaps)) in found.iter().enumerate() {
                if places[0].min(places[1]) > at || places[0].max(places[1]) < at {
                    continue;
                }
                let gap = gaps[0] + (gaps[1] - gaps[0]) * (at - places[0]) / (places[1] - places[0]);
                if best.is_none_or(|(least, _)| gap.abs() < least) {
                    best = Some((gap.abs(), k));
                }
            }
            let Some((_, k)) = best else { continue };
            let (other, places, _) = found[k];
            if !self.two && (other as usize) < chord {
                continue;
            }
            let end = |place: f64| match places.iter().position(|own| (own - place).abs() <= SAME) {
                Some(k) if place > 0.0 && place < 1.0 => End::Opposite(k),
                _ => End::At(place),
            };
            overlaps.push(Overlap { other, ends: [end(from), end(to)] });
        }
        overlaps
    }

    /// Whether the body lies between two chords at rest.
    fn through(&self, mine: &Chord, its: &Chord) -> bool {
        let direction = its.middle - mine.middle;
        direction.dot(&mine.outward) < -THROUGH * direction.norm()
    }
}

/// Chords in a grid of square bins, about as many as there are chords: a search looks into a few of them.
struct Bins {
    low: Point<2>,
    size: f64,
    counts: [usize; 2],
    offsets: Vec<usize>,
    chords: Vec<u32>,
}

impl Bins {
    fn new(boxes: &[[Point<2>; 2]]) -> Self {
        let mut low = Point::<2>::repeat(f64::INFINITY);
        let mut high = Point::<2>::repeat(f64::NEG_INFINITY);
        let mut longest: f64 = 0.0;
        for [a, b] in boxes {
            (low, high) = (low.zip_map(a, f64::min), high.zip_map(b, f64::max));
            longest = longest.max((b - a).amax());
        }
        let extent = high - low;
        let size = longest.max((extent[0] * extent[1] / boxes.len().max(1) as f64).sqrt());
        // Numbers that are not finite leave one bin.
        let size = if size > 0.0 && size.is_finite() { size } else { f64::INFINITY };
        let count = |i: usize| ((extent[i] / size).floor() + 1.0).clamp(1.0, 4.0 * boxes.len() as f64 + 1.0) as usize;
        let mut bins = Bins { low, size, counts: [count(0), count(1)], offsets: vec![0], chords: Vec::new() };
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); bins.counts[0] * bins.counts[1]];
        for (k, [a, b]) in boxes.iter().enumerate() {
            let (from, to) = (bins.bin(a), bins.bin(b));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    lists[i * bins.counts[1] + j].push(k as u32);
                }
            }
        }
        for list in lists {
            bins.chords.extend(list);
            bins.offsets.push(bins.chords.len());
        }
        bins
    }

    fn bin(&self, x: &Point<2>) -> [usize; 2] {
        [0, 1].map(|i| (((x[i] - self.low[i]) / self.size).max(0.0) as usize).min(self.counts[i] - 1))
    }

    fn rings(&self) -> usize {
        self.counts[0].max(self.counts[1])
    }

    /// The chords in the bins that lie `ring` bins away from that of a point.
    fn ring(&self, x: &Point<2>, ring: usize) -> impl Iterator<Item = u32> + '_ {
        let [i, j] = self.bin(x);
        let span = move |at: usize, count: usize| at.saturating_sub(ring)..=(at + ring).min(count - 1);
        span(i, self.counts[0])
            .flat_map(move |a| span(j, self.counts[1]).map(move |b| (a, b)))
            .filter(move |&(a, b)| a.abs_diff(i) == ring || b.abs_diff(j) == ring)
            .flat_map(|(a, b)| {
                let bin = a * self.counts[1] + b;
                self.chords[self.offsets[bin]..self.offsets[bin + 1]].iter().copied()
            })
    }
}
