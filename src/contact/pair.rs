//! Contact of a body with another one, with another part of it, or with itself.

use std::sync::{Arc, Mutex};

use nalgebra::SVector;

use crate::compiled::by_dim;
use crate::each::{Each, add, list_of};
use crate::geometry::{Point, Vec3, padded};
use crate::order::merged;
use crate::parallel::lock;
use crate::term::{Element, PointMotion, View};

use super::chain::{Chain, Laid};
use super::faces::{Faces, LaidFaces};
use super::facets::Facing;
use super::facing::{Facets, THROUGH};
use super::jet::Jet;
use super::law::{Pressed, Slipping, Touch, started, three};
use super::vertices::{Means, Movers};
use super::{ContactLaw, ContactSurface, overlap};

/// What faces what.
pub(super) enum Geometry {
    /// The ends of radial lines.
    Line(Facets),
    /// Chords in the plane.
    Plane(Chain),
    /// Facets in space.
    Space(Faces),
}

pub(super) enum Opposite {
    /// Of each end that carries pressures, the end nearest to it.
    Line(Vec<Option<u32>>),
    Plane(Laid),
    Space(LaidFaces),
}

/// The faces at a state.
pub(super) struct State {
    pub(super) displacement: Vec<f64>,
    /// Where the movers are.
    pub(super) places: Vec<Vec3>,
    pub(super) opposite: Opposite,
    pub(super) reach: f64,
}

/// A part of the gap of a trace function times its area, over points that move: the coordinates of one after the other.
pub(super) struct Piece {
    movers: [u32; MOST],
    /// How many there are, of which the first so many are of the face that carries pressures.
    counts: [usize; 2],
    pub(super) value: f64,
    pub(super) area: f64,
    /// What each mover moves the trace function by, times area.
    shares: [f64; MOST],
    /// A unit normal of the faces.
    normal: Vec3,
    source: Source,
}

/// Most points that move a piece: the corners of two triangles.
const MOST: usize = 6;

/// Derivatives over the coordinates of a piece's points.
struct Derivatives {
    slope: Vec<f64>,
    /// By columns.
    curve: Vec<f64>,
    /// Gradient of the area.
    area_slope: Vec<f64>,
}

/// Where the derivatives of a piece are.
enum Source {
    Here(Derivatives),
    /// Those of a triangle over one of those that face it; parts of its corners, and what is added to the gap.
    Triangle {
        triangle: usize,
        number: usize,
        parts: [f64; 3],
        shift: f64,
    },
}

impl Piece {
    /// Its movers.
    fn movers(&self) -> &[u32] {
        &self.movers[..self.counts[0]]
    }

    /// Its movers with what they move the trace function by beside what is opposite, times area.
    fn moving(&self) -> impl Iterator<Item = (u32, f64)> {
        let signed = |(k, share): (usize, &f64)| if k < self.counts[1] { *share } else { -share };
        self.movers().iter().copied().zip(self.shares.iter().enumerate().map(signed))
    }
}

/// A list of at most as many as move a piece.
fn few<T: Copy + Default>(list: &[T]) -> [T; MOST] {
    std::array::from_fn(|k| list.get(k).copied().unwrap_or_default())
}

/// A piece given by its gap times area and its area over the coordinates of its movers, of which the first `own` are of the face that
/// carries pressures.
fn piece<const N: usize>(
    (movers, own): (&[u32], usize),
    [gap, area]: [Jet<N>; 2],
    shares: &[f64],
    normal: Vec3,
    shift: f64,
) -> Piece {
    let source = Source::Here(Derivatives {
        slope: (gap.slope + area.slope * shift).as_slice().to_vec(),
        curve: gap.curve.as_slice().to_vec(),
        area_slope: area.slope.as_slice().to_vec(),
    });
    let counts = [movers.len(), own];
    Piece { movers: few(movers), counts, value: gap.value, area: area.value, shares: few(shares), normal, source }
}

/// Pieces with their derivatives over the points that they have in common.
pub(super) struct Gathered {
    pub(super) points: Vec<u32>,
    /// Gradients of the gap times area, and of the area.
    pub(super) slope: Vec<f64>,
    pub(super) area_slope: Vec<f64>,
}

/// Unilateral contact between two boundary parts, or of a part with itself, with Coulomb's friction or without.
///
/// Both faces are chains of chords, or triangles, between vertices. A vertex is not the particle, but follows from the means
/// $\bar x_K = \int\Theta_K\\,x\\,\mathrm d\Gamma/A_K$ over the facet points of its own body,
/// $$\hat x_K = \bar x_K + \frac1{A_K}\sum_L t_{KL}\\,(\bar x_K - \bar x_L),\qquad
/// t_{KL} = \frac{|X_K - X_L|}{|\bar X_K - \bar X_L|}\int\Theta_K\Theta_L\\,\mathrm d\Gamma.$$
/// So it lies at the particle where the displacement is linear, and as $t$ is symmetric, forces $\pi A_K$ on the vertices are those
/// $\pi\int\Theta_K$ of a uniform pressure, by the integration that the body is smoothed with: the patch test is passed.
///
/// A mortar method: a trace function $J$ of the face that carries pressures has the gap
/// $$G_J = \int N_J\\,n\cdot\Big(\sum_K N_K(\eta(\xi))\\,\hat y_K - \sum_L N_L(\xi)\\,\hat x_L\Big)\mathrm d\Gamma,$$
/// where $\xi$ runs along a chord or over a triangle, $\eta$ over the one that is opposite along its normal $n$, and the integral is cut
/// where chords begin and end, and along the edges of triangles: exact whether particles match or not. In space $t$ is changed by
/// least squares so that vertices lie at the particles of flat faces; a facet of four vertices is four triangles around their mean. A facet
/// of any other number, as lattices have that a surface cuts, presses with its points, each with its distance from a triangle.
/// The law between pressure and $\bar g_J = G_J/a_J$, $a_J = \int N_J\\,\mathrm d\Gamma$ over what has something opposite, is that of rigid
/// surfaces, a saddle of $\Pi - \sum_J A_J\\,\pi_J\\,\bar g_J$ with $\pi_J$ per area $A_J$ of the whole trace function: its force
/// $-\pi_J A_J\nabla\bar g_J$, $\nabla\bar g = (\nabla G - \bar g\\,\nabla a)/a$, pushes along the gap even where an overlap is small and grows.
///
/// Friction: the mean slip of a trace function is that of the material points which faced each other at the last converged state,
/// $$s_J = \frac1{a_J}\int N_J\\,\big(\Delta x - \Delta y\big)\mathrm d\Gamma$$
/// along its mean normal there, with the overlaps of that state, so that it is linear in displacements within a step. The law is that of
/// rigid surfaces, its traction per area $A_J$ as the pressure is: force $A_J\\,\tau_J\nabla s_J$.
pub(crate) struct PairContact {
    pub contact_surfaces: Vec<ContactSurface>,
    pub law: ContactLaw,
    pub(super) geometry: Geometry,
    /// Nodes of all clusters: those that any point of the boundary parts sees.
    pub nodes: Vec<u32>,
    /// For each trace function its vertex, then others.
    movers: Movers,
    /// What those are of the displacements of the nodes that are no means.
    pub(super) motion: PointMotion,
    /// Trace functions of all parts.
    pub traces: usize,
    /// Trace functions that may carry pressures, from the first on.
    pub(super) carrying: usize,
    /// The faces at the state that was looked at last: all trace functions of an iteration see the same one.
    pub(super) last: Mutex<Option<Arc<State>>>,
    /// The state whose search is kept while an active set cycles.
    searched: Mutex<Option<Arc<State>>>,
    /// What slips beside what since the last converged state.
    held: Mutex<Option<Arc<Held>>>,
}

/// The slips of all trace functions that carry pressures, from a converged state on; none where nothing was opposite.
struct Held {
    internal_variables: Vec<f64>,
    slips: Vec<Option<Slip>>,
}

/// The faces at a state, and what points have moved since the last converged one.
pub(super) struct Now {
    pub(super) state: Arc<State>,
    held: Option<Arc<Held>>,
    since: Vec<Vec3>,
}

impl Now {
    /// How a trace function slips; none without friction, or where nothing was opposite.
    pub(super) fn slip(&self, trace: usize) -> Option<&Slip> {
        self.held.as_ref()?.slips[trace].as_ref()
    }
}

/// The slip of a trace function as a combination of those of points, and the normal that it is across to.
pub(super) struct Slip {
    pub(super) weights: Vec<(u32, f64)>,
    pub(super) normal: Vec3,
}

impl Slip {
    /// What it is where points have moved.
    pub(super) fn of(&self, moves: &[Vec3]) -> Vec3 {
        self.weights.iter().map(|&(point, weight)| moves[point as usize] * weight).sum()
    }
}

/// The gap between a trace function and the faces opposite.
pub(crate) struct TraceGap {
    /// $\bar g_J$ \[length\], infinite where nothing is opposite.
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
    /// $\int N_J\\,\mathrm d\Gamma$ over what has something opposite.
    pub area: f64,
}

impl PairContact {
    /// Faces of one or two parts, and the particles that move them by rising number.
    pub(crate) fn new(
        contact_surfaces: Vec<ContactSurface>,
        nodes: Vec<u32>,
        positions: &[Vec3],
        law: ContactLaw,
        moved: &[f64],
    ) -> Self {
        let place = |node: u32| nodes.partition_point(|&n| n < node) as u16;
        let mut movers = Movers::default();
        for contact_surface in &contact_surfaces {
            let means = Means::of(contact_surface, positions);
            for trace in 0..contact_surface.traces.len() {
                let owner = vec![(movers.rest.len() as u32, 1.0)];
                let (combination, rest) = means.vertex(contact_surface, trace, place);
                movers.push(combination, rest, owner);
            }
        }
        let traces = movers.rest.len();
        let facets = || Facets::new(&contact_surfaces, &movers.rest);
        let geometry = if law.dim == 3 {
            let mut found = Faces::new(facets(), contact_surfaces[0].traces.len(), &movers.rest);
            for triangle in &mut found.triangles {
                triangle.movers = triangle.corners.each_ref().map(|corner| movers.push_mean(corner));
            }
            add_loose(&mut found, &contact_surfaces[0], place, &mut movers);
            Geometry::Space(found)
        } else if law.dim == 1 {
            Geometry::Line(Facets::of_lines(&contact_surfaces, &movers.rest))
        } else {
            Geometry::Plane(Chain::new(facets(), &movers.rest))
        };
        let carrying = contact_surfaces[0].traces.len();
        let (last, searched, held) = (Mutex::new(None), Mutex::new(None), Mutex::new(None));
        let motion = PointMotion::new(std::mem::take(&mut movers.combinations), nodes.len());
        let mut pair = PairContact {
            contact_surfaces,
            law,
            geometry,
            nodes,
            movers,
            motion,
            traces,
            carrying,
            last,
            searched,
            held,
        };
        pair.measure_overlap(moved);
        pair
    }

    /// Whether the face that is pressed against has facets of other than three or four corners, as those that a surface cuts from a
    /// lattice: nothing could be pressed against them.
    pub(crate) fn has_cut_facets(&self) -> bool {
        matches!(&self.geometry, Geometry::Space(faces) if faces.cut_facets)
    }

    /// The trace functions of a facet in the plane that has others than two: it is no chord between particles.
    pub(crate) fn no_chord(&self) -> Option<usize> {
        match &self.geometry {
            Geometry::Plane(chain) => chain.no_chord,
            _ => None,
        }
    }

    /// Whether two undeformed faces look away from each other: beside all their trace functions the nearest one of the other face looks the
    /// same way, and one of the bodies lies between them.
    pub(crate) fn looks_away(&self) -> bool {
        let all = list_of(self.traces, |all| {
            let (side, trace) = self.trace(all);
            let surface = &self.contact_surfaces[side];
            (side, self.movers.rest[all], surface.normal(&surface.traces[trace]))
        });
        let away = |&(side, x, normal): &(usize, Vec3, Vec3)| {
            let far = |y: &Vec3| (y - x).norm_squared();
            let others = all.iter().filter(|other| other.0 != side);
            others.min_by(|a, b| far(&a.1).total_cmp(&far(&b.1))).is_some_and(|(_, y, its)| {
                let (way, through) = (y - x, THROUGH * (y - x).norm());
                normal.dot(its) > THROUGH && (way.dot(&normal) < -through || way.dot(its) > through)
            })
        };
        all.iter().all(away)
    }

    /// Measures the overlap that an interference resolves, of bodies that begin with a displacement.
    fn measure_overlap(&mut self, moved: &[f64]) {
        if let Some(interference) = self.law.interference.take() {
            self.deepen(f64::INFINITY);
            let unknowns = self.nodes.last().map_or(0, |last| (*last as usize + 1) * self.law.dim);
            let state = self.laid(&started(moved, unknowns));
            let gaps = (0..self.carrying).map(|trace| {
                let gap = self.overlap(trace, &state, 0.0, |_| {}).gap;
                if gap.is_finite() { gap } else { 0.0 }
            });
            let gaps: Vec<f64> = gaps.collect();
            self.deepen(gaps.iter().fold(0.0, |deepest: f64, gap| deepest.max(-gap)));
            self.law.at_rest = gaps;
            self.law.interference = Some(interference);
        }
    }

    /// Looks for faces deeper behind others than usual.
    fn deepen(&mut self, by: f64) {
        match &mut self.geometry {
            Geometry::Plane(chain) => chain.facets.deeper = by,
            Geometry::Space(faces) => faces.facets.deeper = by,
            Geometry::Line(_) => {}
        }
        self.last = Mutex::new(None);
    }

    /// What slips beside what since the last converged state, with the displacements of the nodes there.
    fn held(&self, internal_variables: &[f64]) -> Arc<Held> {
        let mut held = lock(&self.held);
        if let Some(held) = held.as_ref().filter(|held| held.internal_variables == internal_variables) {
            return held.clone();
        }
        let mut displacement = vec![0.0; self.nodes.last().map_or(0, |last| (*last as usize + 1) * self.law.dim)];
        let dim = self.law.dim;
        for (&node, was) in self.nodes.iter().zip(internal_variables.chunks_exact(dim)) {
            displacement[node as usize * dim..][..dim].copy_from_slice(was);
        }
        let state = self.found(&displacement, None);
        let slips = list_of(self.carrying, |trace| self.slip(trace, &state));
        let new = Arc::new(Held { internal_variables: internal_variables.to_vec(), slips });
        *held = Some(new.clone());
        new
    }

    /// The slip of a trace function from a state on.
    fn slip(&self, trace: usize, state: &State) -> Option<Slip> {
        let (mut weights, mut normal) = (Vec::new(), Vec3::zeros());
        let overlap = self.overlap(trace, state, 0.0, |piece| {
            for (mover, share) in piece.moving() {
                weights.extend(self.movers.parts[mover as usize].iter().map(|&(point, part)| (point, share * part)));
            }
            normal += piece.normal * piece.area;
        });
        let length = normal.norm();
        let found = overlap.gap.is_finite() && length > 0.0;
        weights.iter_mut().for_each(|entry| entry.1 /= overlap.area);
        found.then(|| Slip { weights: merged(weights), normal: normal / length })
    }

    /// What the points have moved by since the last converged state; nothing without friction.
    fn moved_since(&self, displacement: &[f64], history: &[f64]) -> Vec<Vec3> {
        if !self.law.has_friction() {
            return Vec::new();
        }
        let mut since = displacement.to_vec();
        let dim = self.law.dim;
        for (&node, was) in self.nodes.iter().zip(history.chunks_exact(dim)) {
            add(&mut since[node as usize * dim..], -1.0, was);
        }
        self.moves(&since)
    }

    /// The faces at a state.
    fn laid(&self, displacement: &[f64]) -> Arc<State> {
        let mut last = lock(&self.last);
        if let Some(state) = last.as_ref().filter(|state| state.displacement == displacement) {
            return state.clone();
        }
        let searched = lock(&self.searched).clone();
        let state = Arc::new(self.found(displacement, searched.as_deref()));
        *last = Some(state.clone());
        state
    }

    /// Keeps the search of the last state for those that follow, or searches anew.
    pub(super) fn hold_search(&self, hold: bool) {
        let mut last = lock(&self.last);
        let mut searched = lock(&self.searched);
        if hold {
            searched.clone_from(&last);
        } else if searched.take().is_some() {
            *last = None;
        }
    }

    /// Finds the faces at a state, with the search of another one or of its own.
    fn found(&self, displacement: &[f64], searched: Option<&State>) -> State {
        let all = self.movers.rest.iter().zip(self.moves(displacement));
        let places: Vec<Vec3> = all.map(|(x, moved)| x + moved).collect();
        let (opposite, reach) = match &self.geometry {
            Geometry::Line(ends) => {
                let nearest = |own: usize| {
                    let outward = ends.all[own].outward;
                    let gap = |other: &usize| (places[*other] - places[own]).dot(&outward);
                    let facing = (self.carrying..self.traces).filter(|other| {
                        let looks_back = ends.all[*other].outward.dot(&outward) < 0.0;
                        looks_back && ends.may_touch(own as u32, *other as u32, gap(other))
                    });
                    facing.min_by(|a, b| gap(a).abs().total_cmp(&gap(b).abs())).map(|other| other as u32)
                };
                (Opposite::Line(list_of(self.carrying, nearest)), f64::MAX)
            }
            Geometry::Plane(chain) => {
                let ends = places[..self.traces].mapped(padded);
                let laid = match searched.map(|state| &state.opposite) {
                    Some(Opposite::Plane(laid)) => Laid { ends, facing: laid.facing.clone(), reach: laid.reach },
                    _ => chain.laid(ends),
                };
                let reach = laid.reach;
                (Opposite::Plane(laid), reach)
            }
            Geometry::Space(faces) => {
                let corners = faces.triangles.iter().map(|triangle| triangle.movers.map(|k| places[k as usize]));
                let points = faces.loose.iter().map(|loose| {
                    let normal = self.contact_surfaces[0].outward(loose.point, displacement);
                    (places[loose.mover as usize], normal / normal.norm().max(f64::MIN_POSITIVE))
                });
                let before = match searched.map(|state| &state.opposite) {
                    Some(Opposite::Space(laid)) => Some(laid),
                    _ => None,
                };
                let laid = faces.laid(corners.collect(), &points.collect::<Vec<_>>(), before);
                let reach = laid.reach;
                (Opposite::Space(laid), reach)
            }
        };
        State { displacement: displacement.to_vec(), places, opposite, reach }
    }

    /// What coefficients move all movers by.
    pub(super) fn moves(&self, step: &[f64]) -> Vec<Vec3> {
        let mut moves: Vec<Vec3> = Vec::with_capacity(self.motion.len());
        for (point, parts) in self.movers.parts.iter().enumerate() {
            let mut u = Vec3::zeros();
            by_dim!(self.law.dim, D => {
                for &(place, value) in self.motion.of(point as u32) {
                    let first = self.nodes[place as usize] as usize * D;
                    (0..D).for_each(|i| u[i] += value * step[first + i]);
                }
            });
            if parts.len() > 1 {
                parts.iter().for_each(|&(of, part)| u += moves[of as usize] * part);
            }
            moves.push(u);
        }
        moves
    }

    /// Part and trace function in it.
    pub(crate) fn trace(&self, trace: usize) -> (usize, usize) {
        if trace < self.carrying { (0, trace) } else { (1, trace - self.carrying) }
    }

    /// Visits the pieces of the gap of a trace function that carries pressures.
    pub(super) fn overlap(&self, trace: usize, state: &State, load: f64, mut visit: impl FnMut(Piece)) -> TraceGap {
        let (mut gap, mut area) = (0.0, 0.0);
        let [shift, by_load] = self.law.shift(trace, load);
        let mut take = |piece: Piece| {
            gap += piece.value;
            area += piece.area;
            visit(piece);
        };
        match (&self.geometry, &state.opposite) {
            (Geometry::Line(ends), Opposite::Line(nearest)) => {
                if let Some(other) = nearest[trace] {
                    let (own, normal) = (trace as u32, ends.all[trace].outward[0]);
                    let area = self.contact_surfaces[0].traces[trace].area;
                    let [here, there] = [own, other].map(|k| state.places[k as usize][0]);
                    let gap = (Jet::variable(there, 1) - Jet::variable(here, 0)) * (area * normal);
                    let both: [Jet<2>; 2] = [gap, Jet::constant(area)];
                    take(piece((&[own, other], 1), both, &[area; 2], Vec3::new(normal, 0.0, 0.0), shift));
                }
            }
            (Geometry::Plane(chain), Opposite::Plane(laid)) => {
                for &(chord, end) in &chain.of_trace[trace] {
                    for overlap in &laid.facing[chord as usize] {
                        let facing = chain.facing(laid, chord as usize, overlap.other as usize);
                        let (found, normal) = (facing.mean_gap(overlap, end), padded(&facing.normal()));
                        let [a, b] = chain.chords[chord as usize].traces;
                        let [c, d] = chain.chords[overlap.other as usize].traces;
                        take(piece((&[a, b, c, d], 2), [found.gap, found.area], &found.shares, normal, shift));
                    }
                }
            }
            (Geometry::Space(faces), Opposite::Space(laid)) => {
                self.overlap_of_triangles((faces, laid), trace, shift, &mut take);
                if !faces.loose.is_empty() {
                    self.overlap_of_points((faces, laid), trace, state, &mut take);
                }
            }
            _ => {}
        }
        // What has less than rounding opposite has nothing.
        let least = f64::EPSILON * self.contact_surfaces[0].traces[trace].area;
        TraceGap { gap: if area > least { gap / area + shift } else { f64::INFINITY }, by_load, area }
    }

    /// Visits the triangles under a trace function with what faces each of them.
    fn overlap_of_triangles(
        &self,
        (faces, laid): (&Faces, &LaidFaces),
        trace: usize,
        shift: f64,
        take: &mut impl FnMut(Piece),
    ) {
        for &(triangle, parts) in &faces.of_trace[trace] {
            let triangle = triangle as usize;
            let normal = laid.bases[triangle].normal;
            let sum = |of: [f64; 3]| parts[0] * of[0] + parts[1] * of[1] + parts[2] * of[2];
            let [a, b, c] = faces.triangles[triangle].movers;
            for (number, Facing { other, gaps, .. }) in laid.facing[triangle].iter().enumerate() {
                let [d, e, f] = faces.triangles[*other as usize].movers;
                take(Piece {
                    movers: [a, b, c, d, e, f],
                    counts: [6, 3],
                    value: sum(gaps.values),
                    area: sum(gaps.areas),
                    shares: std::array::from_fn(|k| sum(gaps.shares.map(|of| of[k]))),
                    normal,
                    source: Source::Triangle { triangle, number, parts, shift },
                });
            }
        }
    }

    /// Visits the points under a trace function whose facets are no triangles.
    fn overlap_of_points(
        &self,
        (faces, laid): (&Faces, &LaidFaces),
        trace: usize,
        state: &State,
        take: &mut impl FnMut(Piece),
    ) {
        for &(point, weight) in &self.contact_surfaces[0].traces[trace].points {
            let place = |mover: u32| state.places[mover as usize];
            let Some((own, triangle, found)) = faces.loose_gap(laid, point, place) else { continue };
            let [a, b, c] = faces.triangles[triangle as usize].movers;
            let outward: Vec3 = found.slope.fixed_rows::<3>(0).into();
            // What point and corners move the place of contact by.
            let shares = [0, 1, 2, 3].map(|k| weight * found.slope.fixed_rows::<3>(3 * k).dot(&outward).abs());
            let both = [found * weight, Jet::constant(weight)];
            take(piece((&[own, a, b, c], 1), both, &shares, -outward, 0.0));
        }
    }

    /// Visits the gradients of a piece's gap times area and of its area by the place of each of its movers.
    fn slopes(&self, piece: &Piece, state: &State, mut visit: impl FnMut(usize, [Vec3; 2])) {
        let dim = self.law.dim;
        match (&piece.source, &state.opposite) {
            (Source::Here(of), _) => {
                for (k, (slope, area_slope)) in
                    of.slope.chunks_exact(dim).zip(of.area_slope.chunks_exact(dim)).enumerate()
                {
                    visit(k, [three(slope), three(area_slope)]);
                }
            }
            (&Source::Triangle { triangle, number, parts, shift }, Opposite::Space(laid)) => {
                let found = &laid.slopes(triangle)[number];
                let sum = |of: &[SVector<f64, { overlap::LOCAL }>; 3], i: usize| {
                    parts[0] * of[0][i] + parts[1] * of[1][i] + parts[2] * of[2][i]
                };
                for k in 0..MOST {
                    let [mut slope, mut area_slope] = [Vec3::zeros(); 2];
                    for i in 0..3 {
                        area_slope[i] = sum(&found.areas, 3 * k + i);
                        slope[i] = sum(&found.gaps, 3 * k + i) + area_slope[i] * shift;
                    }
                    visit(k, [slope, area_slope]);
                }
            }
            _ => {}
        }
    }

    /// The derivatives of pieces over the points that their movers are means of, and over others.
    pub(super) fn gathered(&self, pieces: &[Piece], others: impl Iterator<Item = u32>, state: &State) -> Gathered {
        let parts = |mover: u32| &self.movers.parts[mover as usize];
        let mut movers: Vec<u32> = Vec::new();
        for piece in pieces {
            movers.extend_from_slice(piece.movers());
        }
        movers.sort_unstable();
        movers.dedup();
        let mut points: Vec<u32> = Vec::new();
        for &mover in &movers {
            for part in parts(mover) {
                points.push(part.0);
            }
        }
        points.extend(others);
        points.sort_unstable();
        points.dedup();
        let dim = self.law.dim;
        let size = points.len() * dim;
        let mut found = Gathered { slope: vec![0.0; size], area_slope: vec![0.0; size], points: Vec::new() };
        // Over movers first, which many pieces share.
        let mut over_movers = vec![[Vec3::zeros(); 2]; movers.len()];
        for piece in pieces {
            self.slopes(piece, state, |k, [slope, area_slope]| {
                let own = &mut over_movers[movers.partition_point(|&m| m < piece.movers[k])];
                own[0] += slope;
                own[1] += area_slope;
            });
        }
        for (&mover, [slope, area_slope]) in movers.iter().zip(&over_movers) {
            for &(point, part) in parts(mover) {
                let place = points.partition_point(|&p| p < point) * dim;
                for i in 0..dim {
                    found.slope[place + i] += part * slope[i];
                    found.area_slope[place + i] += part * area_slope[i];
                }
            }
        }
        found.points = points;
        found
    }

    /// Adds the second derivatives of the gaps of trace functions times area, with a factor for each trace function whose pieces are given.
    pub(super) fn add_curves(&self, pressed: &[(u32, f64, &[Piece])], state: &State, out: &mut Element) {
        for (_, factor, pieces) in pressed.iter().filter(|(_, factor, _)| *factor != 0.0) {
            for piece in *pieces {
                if let Source::Here(Derivatives { curve, .. }) = &piece.source {
                    by_dim!(self.law.dim, D => self.add_curve::<D>(piece.movers(), *factor, curve, out));
                }
            }
        }
        // Those of triangles once for all of their corners.
        let (Geometry::Space(faces), Opposite::Space(laid)) = (&self.geometry, &state.opposite) else { return };
        let mut at_corners = vec![[0.0; 3]; laid.facing.len()];
        for (trace, factor, _) in pressed.iter().filter(|(_, factor, _)| *factor != 0.0) {
            for (triangle, parts) in &faces.of_trace[*trace as usize] {
                let corners = &mut at_corners[*triangle as usize];
                add(corners, *factor, parts);
            }
        }
        for (triangle, factors) in at_corners.into_iter().enumerate().filter(|(_, factors)| *factors != [0.0; 3]) {
            let [a, b, c] = faces.triangles[triangle].movers;
            for (number, facing) in laid.facing[triangle].iter().enumerate() {
                let [d, e, f] = faces.triangles[facing.other as usize].movers;
                self.add_curve::<3>(&[a, b, c, d, e, f], 1.0, laid.curve(triangle, number, factors).as_slice(), out);
            }
        }
    }

    /// Adds second derivatives over the coordinates of movers, by columns, times a factor.
    fn add_curve<const D: usize>(&self, movers: &[u32], factor: f64, curve: &[f64], out: &mut Element) {
        let size = movers.len() * D;
        for (b, column) in movers.iter().enumerate() {
            for (a, row) in movers.iter().enumerate() {
                for &(point, part) in &self.movers.parts[*column as usize] {
                    for &(beside, other) in &self.movers.parts[*row as usize] {
                        let (block, factor) = (out.points.block::<D>(beside, point), factor * part * other);
                        for j in 0..D {
                            (0..D).for_each(|i| block[j][i] += factor * curve[(b * D + j) * size + a * D + i]);
                        }
                    }
                }
            }
        }
    }

    /// How a step that moves the movers changes the mean gap of pieces, times area.
    pub(super) fn change(&self, pieces: &[Piece], state: &State, gap: f64, moves: &[Vec3]) -> f64 {
        let mut change = 0.0;
        for piece in pieces {
            self.slopes(piece, state, |k, [slope, area_slope]| {
                let moved = &moves[piece.movers[k] as usize];
                (0..self.law.dim).for_each(|i| change += (slope[i] - gap * area_slope[i]) * moved[i]);
            });
        }
        change
    }

    /// How a step that moves the movers opens pieces whose overlaps stay as they are, times area.
    pub(super) fn opening(&self, pieces: &[Piece], moves: &[Vec3]) -> f64 {
        let of = |piece: &Piece| {
            let along = |(mover, share): (u32, f64)| -share * piece.normal.dot(&moves[mover as usize]);
            piece.moving().map(along).sum::<f64>()
        };
        pieces.iter().map(of).sum()
    }

    /// The faces at a state.
    pub(super) fn now(&self, view: &View<'_>) -> Now {
        let held = self.law.has_friction().then(|| self.held(view.history));
        let since = self.moved_since(view.displacement, view.history);
        Now { state: self.laid(view.displacement), held, since }
    }

    /// What the law asks of a trace function, and the pieces of its gap.
    pub(super) fn touch(&self, trace: usize, view: &View<'_>, now: &Now) -> (Touch, Vec<Piece>) {
        let mut pieces = Vec::new();
        let overlap = self.overlap(trace, &now.state, view.load, |piece| pieces.push(piece));
        let slipping = now.slip(trace).map(|slip| Slipping {
            normal: slip.normal,
            slip: slip.of(&now.since),
            by_load: Point::zeros(),
            fixed: None,
        });
        let own = (trace, &self.contact_surfaces[0].traces[trace]);
        let touch = self.law.touch(own, view.condensed, [overlap.gap, overlap.by_load], slipping);
        (Touch { gap_area: overlap.area, ..touch }, pieces)
    }

    /// Gaps and forces at a state.
    pub(crate) fn pressed(&self, view: &View<'_>) -> Pressed {
        let now = self.now(view);
        let mut found = Pressed::new(self.traces);
        // Whether something that sticks, and something that slides, presses on a trace function.
        let mut pressed = vec![[false; 2]; self.traces];
        for trace in 0..self.carrying {
            let (touch, pieces) = self.touch(trace, view, &now);
            found.gaps[trace] = touch.gap;
            if !touch.is_active() {
                continue;
            }
            let slides = self.law.slides(touch.pressure, &touch.traction);
            (found.slides[trace], found.active[trace]) = (slides, true);
            let concentration = touch.area / touch.gap_area;
            let (pressure, traction) = (touch.pressure * concentration, touch.traction * concentration);
            for piece in pieces {
                let mut pushes = [Vec3::zeros(); MOST];
                self.slopes(&piece, &now.state, |k, [slope, _]| pushes[k] = slope * pressure);
                for (k, ((mover, share), push)) in piece.moving().zip(&pushes).enumerate() {
                    let force = push + traction * share;
                    for &(owner, part) in &self.movers.owners[mover as usize] {
                        found.forces[owner as usize] += force * part;
                        if k >= piece.counts[1] && share * part != 0.0 {
                            pressed[owner as usize][usize::from(slides)] = true;
                        }
                    }
                    if k < piece.counts[1] {
                        found.total += force;
                    }
                }
            }
        }
        for all in 0..self.traces {
            let (side, trace) = self.trace(all);
            let surface = &self.contact_surfaces[side];
            let mut normal = Vec3::zeros();
            for &(point, weight) in &surface.traces[trace].points {
                normal += surface.outward(point, view.displacement) * weight;
            }
            found.slides[all] |= !self.law.has_friction() || !found.active[all] && pressed[all] == [false, true];
            let against = -found.forces[all].dot(&normal.normalize());
            found.normal_forces[all] = against.max(0.0);
            found.active[all] = against > 0.0;
        }
        found
    }

    /// The work of friction between two converged states \[force·length\].
    pub(crate) fn friction_work(&self, before: &View<'_>, after: &View<'_>) -> f64 {
        if !self.law.has_friction() {
            return 0.0;
        }
        // From the state before on: the memory of that state is its own.
        let (held, moved) = (self.held(before.history), self.moved_since(after.displacement, before.history));
        let slip = |trace: usize| held.slips[trace].as_ref().map_or_else(Point::zeros, |slip| slip.of(&moved));
        self.law.work(&self.contact_surfaces[0], [before.condensed, after.condensed], slip)
    }

    /// How deep the faces are in each other where they begin, with a displacement, and where.
    pub(crate) fn deepest(&self, begun: &[f64]) -> Option<(f64, Vec3)> {
        let state = self.laid(begun);
        // An interference is counted from the overlap that was measured: the gap itself starts at zero.
        let gap = |trace: usize| match self.law.interference {
            Some(_) => self.law.at_rest[trace],
            None => self.overlap(trace, &state, 0.0, |_| {}).gap,
        };
        let deep = |trace: usize| (-gap(trace), self.movers.rest[trace]);
        (0..self.carrying).map(deep).max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Adds movers at the points whose facets are no triangles.
fn add_loose(faces: &mut Faces, contact_surface: &ContactSurface, place: impl Fn(u32) -> u16, movers: &mut Movers) {
    let table = &contact_surface.table;
    for loose in &mut faces.loose {
        let point = loose.point as usize;
        let seen = table.nodes(point).iter().map(|&n| place(n));
        let combination = seen.zip(table.values(point).iter().copied()).collect();
        loose.mover = movers.rest.len() as u32;
        let owners = contact_surface.over[point].iter().map(|&(trace, w)| (trace, w / table.weights[point]));
        movers.push(combination, table.positions[point], owners.collect());
    }
}
