//! Contact of a body with another part of it, or with itself, in the plane.

use std::sync::{Arc, Mutex, PoisonError};

use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::Point;
use crate::quadrature::Points;
use crate::table::ShapeTable;
use crate::term::{Element, Term, View};

use super::Skin;
use super::obstacle::{Stiffness, TOO_FAR};

/// Rings of chords around a point that it never touches: its neighbours.
const RINGS: usize = 2;
/// Cosine between two outward normals above which they do not face each other.
const FACING: f64 = -0.1;
/// How deep a point may be behind a chord to be in contact with it, in terms of the chord: beyond, it is the far side of a wall.
const BEHIND: f64 = 1.5;

/// The boundary parts that may touch each other: what they may lie on, as a chain of straight pieces between points of the boundary that
/// know their shape functions.
pub(crate) struct Chain<const D: usize> {
    /// Shape functions at the vertices.
    vertices: ShapeTable<D>,
    /// Vertices at both ends, outward to the right of the way from the first to the second (1) or to the left (-1), and the chord.
    pieces: Vec<([u32; 2], f64, u32)>,
    /// Chords beside each chord, itself among them.
    beside: Vec<Vec<u32>>,
    /// First piece of each chord.
    pieces_of: Vec<usize>,
    /// Which part each chord belongs to.
    side: Vec<u8>,
    /// Hats and their values at each vertex.
    hats: Vec<[(u32, f64); 2]>,
}

/// A chain at a state.
pub(crate) struct Sorted<const D: usize> {
    displacement: Vec<f64>,
    places: Vec<Point<D>>,
    bins: Bins<D>,
}

/// Pieces in a grid of square bins, as many as there are pieces: a search looks into a few of them.
struct Bins<const D: usize> {
    low: Point<D>,
    size: f64,
    counts: [usize; 2],
    offsets: Vec<usize>,
    pieces: Vec<u32>,
}

impl<const D: usize> Bins<D> {
    fn new(boxes: Vec<[Point<D>; 2]>) -> Self {
        let mut low = Point::<D>::repeat(f64::INFINITY);
        let mut high = Point::<D>::repeat(f64::NEG_INFINITY);
        let mut longest: f64 = 0.0;
        for [a, b] in &boxes {
            (low, high) = (low.zip_map(a, f64::min), high.zip_map(b, f64::max));
            longest = longest.max((b - a).amax());
        }
        let extent = high - low;
        let area = extent.iter().take(2).product::<f64>();
        let size = longest.max((area / boxes.len().max(1) as f64).sqrt());
        // Numbers that are not finite leave one bin.
        let size = if size > 0.0 && size.is_finite() { size } else { f64::INFINITY };
        let count = |i: usize| ((extent[i] / size).floor() + 1.0).clamp(1.0, 4.0 * boxes.len() as f64 + 1.0) as usize;
        let mut bins = Bins { low, size, counts: [count(0), count(1)], offsets: Vec::new(), pieces: Vec::new() };
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); bins.counts[0] * bins.counts[1]];
        for (k, [a, b]) in boxes.iter().enumerate() {
            let (from, to) = (bins.bin(a), bins.bin(b));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    lists[i * bins.counts[1] + j].push(k as u32);
                }
            }
        }
        bins.offsets.push(0);
        for list in lists {
            bins.pieces.extend(list);
            bins.offsets.push(bins.pieces.len());
        }
        bins
    }

    fn bin(&self, x: &Point<D>) -> [usize; 2] {
        [0, 1].map(|i| (((x[i] - self.low[i]) / self.size).max(0.0) as usize).min(self.counts[i] - 1))
    }

    fn rings(&self) -> usize {
        self.counts[0].max(self.counts[1])
    }

    /// The pieces in the bins that lie `ring` bins away from that of a point.
    fn ring(&self, x: &Point<D>, ring: usize) -> impl Iterator<Item = u32> + '_ {
        let [i, j] = self.bin(x);
        let span = move |at: usize, count: usize| at.saturating_sub(ring)..=(at + ring).min(count - 1);
        span(i, self.counts[0])
            .flat_map(move |a| span(j, self.counts[1]).map(move |b| (a, b)))
            .filter(move |&(a, b)| a.abs_diff(i) == ring || b.abs_diff(j) == ring)
            .flat_map(|(a, b)| {
                let bin = a * self.counts[1] + b;
                self.pieces[self.offsets[bin]..self.offsets[bin + 1]].iter().copied()
            })
    }
}

/// What a point has found on the other side.
struct Found<const D: usize> {
    gap: f64,
    normal: Point<D>,
    piece: usize,
    /// Where on the piece.
    at: f64,
    /// Whether it is nearest to the inside of the piece and not to its end.
    inside: bool,
}

impl<const D: usize> Chain<D> {
    /// The chain of one or two parts; `tabulate` gives shape functions at points.
    ///
    /// # Errors
    /// Where a point of the boundary is not covered.
    pub fn new(
        parts: &[&BoundaryCells<D>],
        positions: &[Point<D>],
        tabulate: impl Fn(&Points<D>) -> Result<ShapeTable<D>, Error>,
    ) -> Result<Self, Error> {
        let mut points = Points::empty();
        let mut chain = Chain {
            vertices: tabulate(&Points::empty())?,
            pieces: Vec::new(),
            beside: Vec::new(),
            pieces_of: vec![0],
            side: Vec::new(),
            hats: Vec::new(),
        };
        let mut ends: Vec<[u32; 2]> = Vec::new();
        for (side, cells) in parts.iter().enumerate() {
            for group in cells.points.groups.windows(2) {
                let Some(&[(a, _), (b, _)]) = cells.hats.get(group[0]).map(Vec::as_slice) else { continue };
                let (from, to) = (positions[a as usize], positions[b as usize]);
                let along = to - from;
                let mut inner: Vec<usize> = (group[0]..group[1]).collect();
                inner.sort_by(|&p, &q| {
                    let place = |p: usize| (cells.points.positions[p] - from).dot(&along);
                    place(p).total_cmp(&place(q))
                });
                let first = points.positions.len();
                let places = std::iter::once((from, [(a, 1.0), (b, 0.0)]))
                    .chain(inner.iter().map(|&p| (cells.points.positions[p], [cells.hats[p][0], cells.hats[p][1]])))
                    .chain(std::iter::once((to, [(a, 0.0), (b, 1.0)])));
                for (at, hats) in places {
                    points.positions.push(at);
                    points.weights.push(1.0);
                    chain.hats.push(hats);
                }
                let outward = cells.points.normals[group[0]];
                let turned = Point::<D>::from_fn(|i, _| if i == 0 { along[1] } else { -along[0] });
                let sign = turned.dot(&outward).signum();
                let chord = ends.len() as u32;
                for vertex in first..points.positions.len() - 1 {
                    chain.pieces.push(([vertex as u32, vertex as u32 + 1], sign, chord));
                }
                chain.pieces_of.push(chain.pieces.len());
                chain.side.push(side as u8);
                ends.push([a, b]);
            }
        }
        points.close_group();
        chain.vertices = tabulate(&points)?;
        chain.beside = (0..ends.len())
            .map(|chord| {
                let mut ring = vec![chord as u32];
                for _ in 0..RINGS {
                    let known: Vec<u32> = ring.iter().flat_map(|&c| ends[c as usize]).collect();
                    ring = (0..ends.len() as u32)
                        .filter(|&c| ends[c as usize].iter().any(|end| known.contains(end)))
                        .collect();
                }
                ring
            })
            .collect();
        Ok(chain)
    }

    /// Current positions of the vertices.
    fn places(&self, displacement: &[f64]) -> Vec<Point<D>> {
        (0..self.vertices.len())
            .map(|vertex| self.vertices.positions()[vertex] + self.vertices.displacement(vertex, displacement))
            .collect()
    }

    /// The current outward normal of a piece, its direction and its length.
    fn frame(&self, piece: usize, places: &[Point<D>]) -> (Point<D>, Point<D>, f64) {
        let ([a, b], sign, _) = self.pieces[piece];
        let along = places[b as usize] - places[a as usize];
        let length = along.norm();
        let along = along / length;
        (Point::from_fn(|i, _| sign * if i == 0 { along[1] } else { -along[0] }), along, length)
    }

    /// The chain at a state with its pieces sorted into bins.
    fn sorted(&self, displacement: &[f64]) -> Sorted<D> {
        let places = self.places(displacement);
        let boxes = self.pieces.iter().map(|&([a, b], _, _)| {
            let (a, b) = (places[a as usize], places[b as usize]);
            [a.zip_map(&b, f64::min), a.zip_map(&b, f64::max)]
        });
        let bins = Bins::new(boxes.collect());
        Sorted { displacement: displacement.to_vec(), places, bins }
    }

    /// The nearest piece that faces a point of a chord with the given outward normal.
    fn nearest(&self, x: &Point<D>, outward: &Point<D>, chord: u32, other: bool, now: &Sorted<D>) -> Option<Found<D>> {
        let mut best: Option<(f64, Found<D>)> = None;
        let (mine, places) = (self.side[chord as usize], &now.places);
        for (ring, k) in (0..now.bins.rings()).flat_map(|ring| now.bins.ring(x, ring).map(move |k| (ring, k as usize)))
        {
            // What lies further out is further away.
            let away = (ring as f64 - 1.0) * now.bins.size;
            if best.as_ref().is_some_and(|(least, _)| *least < away) {
                break;
            }
            let ([a, b], _, c) = self.pieces[k];
            // Each pair of chords once, by the hats of the first: pressures of both would share one load and none of them
            // would come to rest.
            if c <= chord || other && self.side[c as usize] == mine {
                continue;
            }
            let (from, to) = (places[a as usize], places[b as usize]);
            let away = x - from;
            let along = to - from;
            let square = along.norm_squared();
            let place = away.dot(&along) / square;
            let at = place.clamp(0.0, 1.0);
            let apart = x - (from + along * at);
            let distance = apart.norm();
            if best.as_ref().is_some_and(|(least, _)| distance >= *least) {
                continue;
            }
            let (normal, _, length) = self.frame(k, places);
            // The chord is as long as its pieces; neighbours are looked up last.
            let chord_length = length * (self.pieces_of[c as usize + 1] - self.pieces_of[c as usize]) as f64;
            let signed = apart.dot(&normal);
            if normal.dot(outward) > FACING
                || signed < -BEHIND * chord_length
                || self.beside[chord as usize].contains(&c)
            {
                continue;
            }
            let inside = place == at;
            let found = if inside || distance <= 1e-6 * length {
                Found { gap: away.dot(&normal), normal, piece: k, at, inside: true }
            } else {
                let sign = if signed >= 0.0 { 1.0 } else { -1.0 };
                Found { gap: sign * distance, normal: apart * (sign / distance), piece: k, at, inside: false }
            };
            best = Some((distance, found));
        }
        best.map(|(_, found)| found)
    }
}

/// Unilateral contact without friction between two parts of the boundary, or of a part with itself. Of two chords that face each other
/// the hats of the first carry the pressure, against the chain of the other.
pub(crate) struct PairContact<const D: usize> {
    pub skins: Vec<Skin<D>>,
    pub chain: Chain<D>,
    pub stiffness: Stiffness,
    /// Nodes of all clusters: those that any point of the boundary parts sees.
    nodes: Vec<u32>,
    /// Place of each node among those.
    place_of: Vec<u16>,
    /// For each side and point: its chord, and the piece behind it.
    chord_of: Vec<Vec<(u32, u32)>>,
    /// The chain at the state that was looked at last: all hats of an iteration see the same one.
    last: Mutex<Option<Arc<Sorted<D>>>>,
}

/// What a hat knows of the other side.
pub(crate) struct Meeting {
    /// $\bar g_J$ \[length\], infinite where some of its points have nothing opposite.
    pub gap: f64,
}

impl<const D: usize> PairContact<D> {
    pub fn new(
        skins: Vec<Skin<D>>,
        cells: &[&BoundaryCells<D>],
        chain: Chain<D>,
        stiffness: Stiffness,
        total: usize,
    ) -> Self {
        let mut nodes: Vec<u32> = (0..chain.vertices.len()).flat_map(|v| chain.vertices.nodes(v)).copied().collect();
        for skin in &skins {
            nodes.extend(skin.hats.iter().flat_map(|hat| &hat.nodes));
        }
        nodes.sort_unstable();
        nodes.dedup();
        let mut place_of = vec![0; total];
        for (place, &node) in nodes.iter().enumerate() {
            place_of[node as usize] = place as u16;
        }
        // Chords come side by side and group by group, in the order of the chain; a point lies behind the piece that begins
        // at its own vertex.
        let mut chord = 0u32;
        let mut chord_of = Vec::new();
        for cells in cells {
            let mut of_points = vec![(0, 0); cells.points.positions.len()];
            for group in cells.points.groups.windows(2) {
                if cells.hats.get(group[0]).is_none_or(|hats| hats.len() != 2) {
                    continue;
                }
                for point in group[0]..group[1] {
                    let first = chain.pieces_of[chord as usize];
                    let x = &cells.points.positions[point];
                    let same = |k: &usize| {
                        let vertex = chain.pieces[*k].0[0] as usize;
                        chain.vertices.positions()[vertex] == *x
                    };
                    let piece = (first..chain.pieces_of[chord as usize + 1]).find(same).unwrap_or(first);
                    of_points[point] = (chord, piece as u32);
                }
                chord += 1;
            }
            chord_of.push(of_points);
        }
        PairContact { skins, chain, stiffness, nodes, place_of, chord_of, last: Mutex::new(None) }
    }

    /// The chain at a state.
    fn now(&self, displacement: &[f64]) -> Arc<Sorted<D>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sorted) = last.as_ref().filter(|sorted| sorted.displacement == displacement) {
            return sorted.clone();
        }
        let sorted = Arc::new(self.chain.sorted(displacement));
        *last = Some(sorted.clone());
        sorted
    }

    /// Side and hat of a cluster.
    pub fn hat(&self, cluster: usize) -> (usize, usize) {
        let first = self.skins[0].hats.len();
        if cluster < first { (0, cluster) } else { (1, cluster - first) }
    }

    pub fn hats(&self) -> usize {
        self.skins.iter().map(|skin| skin.hats.len()).sum()
    }

    fn width(&self, cluster: usize) -> f64 {
        let (side, hat) = self.hat(cluster);
        self.skins[side].hats[hat].width
    }

    pub fn touches(&self, cluster: usize, pressure: f64, gap: f64) -> bool {
        pressure > self.stiffness.decisive / self.width(cluster) * gap
    }

    fn proximal(&self, cluster: usize) -> f64 {
        self.stiffness.proximal / self.width(cluster)
    }

    /// Visits the points of a hat that have something opposite: point, weight, and what they found.
    fn meet(
        &self,
        cluster: usize,
        displacement: &[f64],
        now: &Sorted<D>,
        mut visit: impl FnMut(u32, f64, &Found<D>),
    ) -> Meeting {
        let (side, hat) = self.hat(cluster);
        let (skin, two) = (&self.skins[side], self.skins.len() > 1);
        let hat = &skin.hats[hat];
        let mut gap = 0.0;
        for &(point, weight) in &hat.points {
            let u = skin.displacement(point, displacement);
            let x = skin.table.positions()[point as usize] + u;
            let (chord, piece) = self.chord_of[side][point as usize];
            let (outward, _, _) = self.chain.frame(piece as usize, &now.places);
            match self.chain.nearest(&x, &outward, chord, two, now) {
                Some(found) => {
                    gap += weight * found.gap;
                    visit(point, weight, &found);
                }
                None => gap = f64::INFINITY,
            }
        }
        Meeting { gap: gap / hat.area }
    }

    /// Pressure per reference area, force on the first side and what touches, hat by hat of a side.
    pub fn report(&self, displacement: &[f64], condensed: &[f64], cluster: usize) -> (Meeting, f64, Point<D>) {
        let now = self.now(displacement);
        let (side, hat) = self.hat(cluster);
        let area = self.skins[side].hats[hat].area;
        let first = |side: usize| if side == 0 { 0 } else { self.skins[0].hats.len() };
        let (mut opposite, mut force) = (0.0, Point::<D>::zeros());
        let pressure_at = |vertex: u32, side: usize| -> f64 {
            self.chain.hats[vertex as usize]
                .iter()
                .map(|&(particle, value)| {
                    let hat = self.skins[side].hats.iter().position(|hat| hat.particle == particle);
                    hat.map_or(0.0, |hat| value * condensed[first(side) + hat].max(0.0))
                })
                .sum()
        };
        let meeting = self.meet(cluster, displacement, &now, |_, weight, found| {
            let ([a, b], _, chord) = self.chain.pieces[found.piece];
            let other = self.chain.side[chord as usize] as usize;
            opposite += weight * ((1.0 - found.at) * pressure_at(a, other) + found.at * pressure_at(b, other));
            force += found.normal * (weight * condensed[cluster]);
        });
        let own = condensed[cluster];
        if !self.touches(cluster, own, meeting.gap) {
            return (meeting, 0.0, Point::zeros());
        }
        let sign = if side == 0 { 1.0 } else { -1.0 };
        (meeting, own + opposite / area, force * sign)
    }
}

impl<const D: usize> Term<D> for PairContact<D> {
    fn clusters(&self) -> usize {
        self.hats()
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn is_unilateral(&self) -> bool {
        true
    }

    fn fills_compact(&self) -> bool {
        true
    }

    fn rounding(&self) -> [f64; 2] {
        let extent = self.skins.iter().map(|skin| skin.extent).fold(0.0, f64::max);
        self.stiffness.rounding(self.skins.iter().flat_map(|skin| &skin.hats), extent)
    }

    fn condensed(&self, cluster: usize) -> std::ops::Range<usize> {
        cluster..cluster + 1
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let (side, hat) = self.hat(cluster);
        let skin = &self.skins[side];
        let area = skin.hats[hat].area;
        let pressure = view.condensed[cluster];
        let now = self.now(view.displacement);
        let mut list: Vec<(u32, f64, Found<D>)> = Vec::new();
        let meeting = self.meet(cluster, view.displacement, &now, |point, weight, found| {
            list.push((point, weight, Found { ..*found }));
        });
        if !self.touches(cluster, pressure, meeting.gap) {
            return;
        }
        // How each node moves a point away from what it found: ∂(x − y)/∂d = c_a 1, and the piece, ∂e/∂d = e_a 1.
        let mut used: Vec<u16> = Vec::new();
        for (point, _, found) in &list {
            let [a, b] = self.chain.pieces[found.piece].0;
            let seen = skin.table.nodes(*point as usize).iter();
            let seen = seen.chain(self.chain.vertices.nodes(a as usize)).chain(self.chain.vertices.nodes(b as usize));
            used.extend(seen.map(|&node| self.place_of[node as usize]));
        }
        used.sort_unstable();
        used.dedup();
        out.reset_compact::<D>(&used);
        let n = used.len();
        let size = n * D;
        let local = |node: u32| used.partition_point(|&u| u < self.place_of[node as usize]);
        let mut slope = vec![0.0; size];
        let (mut apart, mut edge) = (vec![0.0; n], vec![0.0; n]);
        for (point, weight, found) in &list {
            apart.fill(0.0);
            edge.fill(0.0);
            let [a, b] = self.chain.pieces[found.piece].0;
            for (&node, value) in skin.table.nodes(*point as usize).iter().zip(skin.table.values(*point as usize)) {
                apart[local(node)] += value;
            }
            for (vertex, part, end) in [(a, 1.0 - found.at, -1.0), (b, found.at, 1.0)] {
                let vertex = vertex as usize;
                for (&node, value) in self.chain.vertices.nodes(vertex).iter().zip(self.chain.vertices.values(vertex)) {
                    let place = local(node);
                    apart[place] -= part * value;
                    edge[place] += end * value;
                }
            }
            for k in 0..n {
                for i in 0..D {
                    slope[k * D + i] += weight * apart[k] * found.normal[i];
                }
            }
            if out.with_matrix && pressure > 0.0 && found.inside {
                let (normal, along, length) = self.chain.frame(found.piece, &now.places);
                let factor = pressure * weight;
                for q in 0..n {
                    for j in 0..D {
                        let (turn_q, slide_q) = (normal[j] * edge[q], along[j] * apart[q]);
                        if turn_q == 0.0 && slide_q == 0.0 {
                            continue;
                        }
                        let column = &mut out.matrix[(q * D + j) * size..][..size];
                        for p in 0..n {
                            for i in 0..D {
                                let (turn_p, slide_p) = (normal[i] * edge[p], along[i] * apart[p]);
                                column[p * D + i] += factor
                                    * ((turn_p * slide_q + slide_p * turn_q) / length
                                        + found.gap / (length * length) * turn_p * turn_q);
                            }
                        }
                    }
                }
            }
        }
        let proximal = self.proximal(cluster);
        let force = pressure - proximal * meeting.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = proximal / area * b;
                for (entry, a) in column.iter_mut().zip(&slope) {
                    *entry += factor * a;
                }
            }
        }
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let (side, hat) = self.hat(cluster);
        let skin = &self.skins[side];
        let hat = &skin.hats[hat];
        let pressure = view.condensed[cluster];
        let now = self.now(view.displacement);
        let mut change = 0.0;
        let meeting = self.meet(cluster, view.displacement, &now, |point, weight, found| {
            let [a, b] = self.chain.pieces[found.piece].0;
            let of = |vertex: u32| self.chain.vertices.displacement(vertex as usize, step);
            let by = skin.displacement(point, step) - of(a) * (1.0 - found.at) - of(b) * found.at;
            change += weight * found.normal.dot(&by);
        });
        let (gap, change) = (meeting.gap, change / hat.area);
        if self.touches(cluster, pressure, gap) {
            condensed_step[0] = -self.proximal(cluster) * (gap + change);
            return 1.0;
        }
        condensed_step[0] = -pressure;
        let most = TOO_FAR * hat.width;
        if gap.is_finite() && gap + change < -most && change < 0.0 {
            return ((gap + most) / -change).min(1.0);
        }
        1.0
    }
}
