//! The boundary parts that may touch each other as chains of chords, and which chord faces which.

use crate::each::Each;
use crate::geometry::{Bounds, Vec2, Vec3, padded};

use super::bins::Bins;
use super::facing::{BEHIND, Facets};
use super::mortar::{End, Facing, Overlap, outward};

/// Bins around a chord that are searched: what is further away is not looked for.
const REACH: i32 = 16;
/// Differences of places along a chord that are none.
const SAME: f64 = 1e-12;

/// A chord between two particles of a boundary part.
#[derive(Debug, Clone)]
pub(super) struct Chord {
    /// The trace functions at its ends, counted through all parts.
    pub traces: [u32; 2],
    facet: u32,
    /// Outward to the right of the way (1) or to the left (-1).
    sign: f64,
    /// Reference measure at the ends, of which the trace functions take their part.
    measure: [f64; 2],
}

/// Chords of one or two parts.
pub(super) struct Chain {
    pub chords: Vec<Chord>,
    pub facets: Facets,
    /// The first chord and those after it of each trace function: at most two.
    pub of_trace: Vec<Vec<(u32, usize)>>,
    /// The trace functions of a facet that is no chord.
    pub no_chord: Option<usize>,
}

/// A chain at a state.
pub(super) struct Laid {
    /// Of each trace function.
    pub ends: Vec<Vec2>,
    /// For each chord what faces it.
    pub facing: Vec<Vec<Overlap>>,
    /// How far around a chord is known.
    pub reach: f64,
}

/// The gap at a place along a chord between those of the ends of another one, opposite of two places.
fn gap_at(place: f64, places: &[f64; 2], gaps: &[f64; 2]) -> f64 {
    gaps[0] + (gaps[1] - gaps[0]) * (place - places[0]) / (places[1] - places[0])
}

impl Chain {
    /// The chords of facets, given the vertices of the trace functions.
    pub(crate) fn new(mut facets: Facets, ends: &[Vec3]) -> Self {
        let (mut chords, mut of_trace, mut no_chord) = (Vec::new(), vec![Vec::new(); ends.len()], None);
        for (number, facet) in (0..).zip(&mut facets.all) {
            let &[(a, i), (b, j)] = facet.shares.as_slice() else {
                // Along the axis of revolution facets have no area and no trace functions.
                no_chord = no_chord.or(Some(facet.shares.len()).filter(|shares| *shares > 0));
                continue;
            };
            let along = ends[b as usize] - ends[a as usize];
            let right = Vec3::new(along[1], -along[0], 0.0).normalize();
            let sign = if right.dot(&facet.outward) >= 0.0 { 1.0 } else { -1.0 };
            facet.outward = right * sign;
            of_trace[a as usize].push((chords.len() as u32, 0));
            of_trace[b as usize].push((chords.len() as u32, 1));
            // ∫ N_a (m_a N_a + m_b N_b) = i, ∫ N_b (…) = j.
            let measure = [4.0 * i - 2.0 * j, 4.0 * j - 2.0 * i];
            chords.push(Chord { traces: [a, b], facet: number, sign, measure });
        }
        Chain { chords, facets, of_trace, no_chord }
    }

    /// Two chords at a state.
    pub(crate) fn facing(&self, laid: &Laid, chord: usize, other: usize) -> Facing {
        let (mine, its) = (&self.chords[chord], &self.chords[other]);
        let traces = [mine.traces[0], mine.traces[1], its.traces[0], its.traces[1]].map(|trace| trace as usize);
        Facing { ends: traces.map(|trace| laid.ends[trace]), sign: mine.sign, measure: mine.measure }
    }

    /// Finds what faces each chord that carries pressures.
    pub(crate) fn laid(&self, ends: Vec<Vec2>) -> Laid {
        let around = |chord: &Chord| Bounds::of(&chord.traces.map(|trace| padded(&ends[trace as usize])));
        let boxes: Vec<(u32, Bounds<3>)> = (0..).zip(self.chords.iter().map(around)).collect();
        let longest = boxes.largest(|(_, own)| own.extent().amax());
        let extent = boxes.iter().fold(Bounds::none(), |all, (_, own)| all.join(own)).extent();
        // About as many bins as there are chords.
        let mean = (extent[0] * extent[1] / boxes.len() as f64).sqrt();
        let bins = Bins::new(&boxes, longest.max(mean));
        let facing = (0..self.chords.len()).map(|chord| self.search(chord, &ends, &bins)).collect();
        Laid { ends, facing, reach: f64::from(REACH - 1) * bins.size }
    }

    /// What faces a chord along its normal, the nearest where there are several. Of two chords that face each other the one that
    /// comes first carries the pressures: those of both would share one load and none of them would come to rest.
    fn search(&self, chord: usize, ends: &[Vec2], bins: &Bins) -> Vec<Overlap> {
        let mine = &self.chords[chord];
        let (facets, two) = (&self.facets, self.facets.two);
        let part = |chord: &Chord| facets.all[chord.facet as usize].part;
        if two && part(mine) != 0 {
            return Vec::new();
        }
        let [a, b] = mine.traces.map(|trace| ends[trace as usize]);
        let along = b - a;
        let square = along.norm_squared();
        let length = square.sqrt();
        let normal = outward(&along, mine.sign);
        // Chords opposite with the places of their ends along this one and their distances.
        let mut found: Vec<(u32, [f64; 2], [f64; 2])> = Vec::new();
        let (mut covered, mut farthest) = (0.0, 0.0f64);
        let middle = padded(&((a + b) * 0.5));
        for ring in 0..bins.rings().min(REACH) {
            if covered >= 1.0 - SAME && farthest < (f64::from(ring) - 1.0) * bins.size - length {
                break;
            }
            bins.ring(&middle, ring, |other| {
                let its = &self.chords[other as usize];
                if two && part(its) == part(mine) || found.iter().any(|f| f.0 == other) {
                    return;
                }
                let points = its.traces.map(|trace| ends[trace as usize]);
                let places = points.map(|y| (y - a).dot(&along) / square);
                let (from, to) = (places[0].min(places[1]).max(0.0), places[0].max(places[1]).min(1.0));
                if !(to - from > SAME) {
                    return;
                }
                let direction = points[1] - points[0];
                let size = direction.norm();
                if normal.dot(&outward(&direction, its.sign)) >= 0.0 {
                    return;
                }
                let gaps = points.map(|y| (y - a).dot(&normal));
                let gap = gap_at(0.5 * (from + to), &places, &gaps);
                if gap < -BEHIND * length.max(size) - facets.deeper || !facets.may_touch(mine.facet, its.facet, gap) {
                    return;
                }
                covered += to - from;
                farthest = farthest.max(gap.abs());
                found.push((other, places, gaps));
            });
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
                let gap = gap_at(at, places, gaps);
                if best.is_none_or(|(least, _)| gap.abs() < least) {
                    best = Some((gap.abs(), k));
                }
            }
            let Some((_, k)) = best else { continue };
            let (other, places, _) = found[k];
            if !two && (other as usize) < chord {
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
}
