//! Boundary parts in space that may touch each other: triangles, and which is opposite of which point.

use crate::cells::BoundaryCells;
use crate::geometry::Point;

use super::ContactSurface;
use super::facets::{Gap, Sorted, Triangle, gap};
use super::facing::{RINGS, THROUGH};

/// A facet at rest.
struct Facet {
    part: u8,
    middle: Point<3>,
    outward: Point<3>,
    /// Facets beside it, itself among them.
    beside: Vec<u32>,
}

/// Faces of one or two parts.
pub(super) struct Faces {
    pub triangles: Vec<Triangle>,
    facets: Vec<Facet>,
    /// The facet of each point of the part that carries pressures.
    facet_of: Vec<u32>,
    two: bool,
    /// How much deeper than usual a point may lie behind a triangle \[length\].
    pub deeper: f64,
}

/// Faces at a state.
pub(super) struct LaidFaces {
    /// The triangle opposite of each point of the part that carries pressures.
    pub opposite: Vec<Option<u32>>,
    /// How far around a point is known.
    pub reach: f64,
}

fn solid<const D: usize>(x: &Point<D>) -> Point<3> {
    Point::<3>::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0))
}

impl Faces {
    /// Facets of three or four corners; others, and those without all their trace functions, touch nothing.
    pub fn new<const D: usize>(
        contact_surfaces: &[ContactSurface<D>],
        cells: &[&BoundaryCells<D>],
        ends: &[Point<D>],
    ) -> Self {
        let two = contact_surfaces.len() > 1;
        let mut faces = Faces { triangles: Vec::new(), facets: Vec::new(), facet_of: Vec::new(), two, deeper: 0.0 };
        let mut traces_of: Vec<Vec<u32>> = Vec::new();
        let mut first = 0u32;
        for (part, (contact_surface, cells)) in contact_surfaces.iter().zip(cells).enumerate() {
            let mut over: Vec<Vec<u32>> = vec![Vec::new(); cells.points.positions.len()];
            for (k, trace) in contact_surface.traces.iter().enumerate() {
                trace.points.iter().for_each(|&(point, _)| over[point as usize].push(k as u32 + first));
            }
            for group in cells.points.groups.windows(2) {
                let range = group[0]..group[1];
                let mut traces: Vec<u32> = range.clone().flat_map(|point| over[point].iter().copied()).collect();
                traces.sort_unstable();
                traces.dedup();
                let number = faces.facets.len() as u32;
                if part == 0 {
                    faces.facet_of.resize(range.end.max(faces.facet_of.len()), number);
                    faces.facet_of[range.clone()].fill(number);
                }
                let outward = range.clone().map(|point| solid(&cells.points.normals[point])).sum::<Point<3>>();
                let outward = outward / outward.norm().max(f64::MIN_POSITIVE);
                let middle =
                    traces.iter().map(|&h| solid(&ends[h as usize])).sum::<Point<3>>() / traces.len().max(1) as f64;
                faces.facets.push(Facet { part: part as u8, middle, outward, beside: Vec::new() });
                traces_of.push(traces.clone());
                if !(3..=4).contains(&traces.len()) {
                    continue;
                }
                // Counter-clockwise about the outward normal.
                let axis = outward.cross(&(solid(&ends[traces[0] as usize]) - middle)).normalize();
                let other = axis.cross(&outward);
                let angle = |h: u32| {
                    let away = solid(&ends[h as usize]) - middle;
                    away.dot(&axis).atan2(away.dot(&other))
                };
                traces.sort_by(|a, b| angle(*a).total_cmp(&angle(*b)));
                let mut push = |corners: [Vec<u32>; 3]| {
                    let at = |k: usize| {
                        corners[k].iter().map(|&h| solid(&ends[h as usize])).sum::<Point<3>>() / corners[k].len() as f64
                    };
                    let turned = (at(1) - at(0)).cross(&(at(2) - at(0))).dot(&outward);
                    let sign = if turned >= 0.0 { 1.0 } else { -1.0 };
                    faces.triangles.push(Triangle { corners, sign, facet: number });
                };
                if let [a, b, c] = traces[..] {
                    push([vec![a], vec![b], vec![c]]);
                } else {
                    for k in 0..traces.len() {
                        push([vec![traces[k]], vec![traces[(k + 1) % traces.len()]], traces.clone()]);
                    }
                }
            }
            first += contact_surface.traces.len() as u32;
        }
        if !two {
            faces.find_neighbours(contact_surfaces, &traces_of);
        }
        faces
    }

    fn find_neighbours<const D: usize>(&mut self, contact_surfaces: &[ContactSurface<D>], traces_of: &[Vec<u32>]) {
        let particle = |trace: u32| contact_surfaces[0].traces[trace as usize].particle;
        let mut at: std::collections::HashMap<u32, Vec<u32>> = std::collections::HashMap::new();
        for (facet, traces) in traces_of.iter().enumerate() {
            traces.iter().for_each(|&trace| at.entry(particle(trace)).or_default().push(facet as u32));
        }
        for facet in 0..self.facets.len() {
            let mut ring = vec![facet as u32];
            for _ in 0..RINGS {
                let traces = ring.iter().flat_map(|&f| &traces_of[f as usize]);
                ring = traces.flat_map(|&trace| at[&particle(trace)].iter().copied()).collect();
                ring.sort_unstable();
                ring.dedup();
            }
            self.facets[facet].beside = ring;
        }
    }

    /// Finds what is opposite of each point, given positions of the triangles' corners, and of the points with their normals.
    pub fn laid(&self, corners: Vec<[Point<3>; 3]>, points: &[(Point<3>, Point<3>)]) -> LaidFaces {
        let sorted = Sorted::new(&self.triangles, corners);
        let opposite = points.iter().enumerate().map(|(point, (x, outward))| {
            let mine = self.facet_of.get(point).copied().unwrap_or(u32::MAX);
            let may = |k: usize, gap: f64| {
                let its = self.triangles[k].facet;
                if self.two {
                    return self.facets[its as usize].part == 1;
                }
                let Some(facet) = self.facets.get(mine as usize) else { return false };
                facet.beside.binary_search(&its).is_err() && !(gap < 0.0 && self.through(mine, its))
            };
            let found = sorted.nearest(x, outward, self.deeper, may)?;
            // Of two facets that face each other the one that comes first carries the pressures.
            (self.two || self.triangles[found].facet > mine).then_some(found as u32)
        });
        LaidFaces { opposite: opposite.collect(), reach: sorted.reach() }
    }

    /// Whether the body lies between two facets at rest.
    fn through(&self, mine: u32, its: u32) -> bool {
        let (mine, its) = (&self.facets[mine as usize], &self.facets[its as usize]);
        let direction = its.middle - mine.middle;
        direction.dot(&mine.outward) < -THROUGH * direction.norm()
    }

    /// The gap of a point over a triangle.
    pub fn gap(&self, triangle: usize, point: &Point<3>, corners: &[Point<3>; 3]) -> Gap {
        gap(point, corners, self.triangles[triangle].sign)
    }
}
