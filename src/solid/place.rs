//! Where the vertices of a contour lie: on the surfaces that meet in them.

use crate::each::Each;
use crate::geometry::{Mat3, Vec3};

use super::program::Program;
use super::surface::Surface;

/// How far from the middle of its cell a vertex may lie along an axis, in spacings: edges of 45 degrees lie up to 1.7 beyond.
const REACH: f64 = 2.0;
/// Eigenvalues below this part of the largest are no direction: surfaces at less than 0.14 rad have no curve.
const PARALLEL: f64 = 0.01;
/// Steps of Newton's method, and the distance from a surface at which they end, in spacings.
const STEPS: usize = 30;
const NEAR: f64 = 1e-10;
/// Cosine between normals of a level set in one cell below which it has an edge there.
const SHARP: f64 = 0.8;
/// Rounds of evening out.
const ROUNDS: usize = 8;

/// An edge of the grid that the surface crosses.
#[derive(Debug, Clone)]
pub(super) struct Crossed {
    /// Three times its first point, plus its axis.
    pub edge: usize,
    /// Whether inside comes first along the axis.
    pub rises: bool,
    pub at: Vec3,
    /// The surface that crosses, and its sign there.
    pub surface: u32,
    pub sign: f64,
    /// The sheets in the cells around, counter-clockwise seen against the axis.
    pub sheets: [u32; 4],
}

impl Crossed {
    /// The quadrangle, counter-clockwise seen from outside.
    pub(crate) fn outward(&self) -> [u32; 4] {
        let [a, b, c, d] = self.sheets;
        if self.rises { [a, b, c, d] } else { [d, c, b, a] }
    }
}

/// A sheet of the surface in a cell, which gets a vertex.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    /// The middle of the cell.
    middle: Vec3,
    /// The edges that it crosses.
    pub crossed: Vec<u32>,
    /// The surfaces that it is of.
    surfaces: Vec<u32>,
    /// Keeps its place.
    fixed: bool,
    /// How often its vertex was drawn back.
    drawn_back: usize,
}

impl Sheet {
    pub(crate) fn new(middle: Vec3) -> Self {
        Sheet { middle, crossed: Vec::new(), surfaces: Vec::new(), fixed: false, drawn_back: 0 }
    }

    /// Takes the surfaces of what it crosses.
    fn gather(&mut self, crossed: &[Crossed]) {
        self.surfaces = self.crossed.mapped(|&k| crossed[k as usize].surface);
        self.surfaces.sort_unstable();
        self.surfaces.dedup();
    }

    /// The middle of what it crosses.
    fn mean(&self, crossed: &[Crossed]) -> Vec3 {
        self.crossed.iter().map(|&k| crossed[k as usize].at).sum::<Vec3>() / self.crossed.len() as f64
    }
}

/// Solves $A^TA\,s = A^Tb$ for the shortest $s$.
fn shortest(square: &Mat3, right: &Vec3) -> (Vec3, usize) {
    let eigen = square.symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let mut step = Vec3::zeros();
    let mut rank = 0;
    for k in 0..3 {
        let value = eigen.eigenvalues[k];
        if value > PARALLEL * largest && value > 0.0 {
            let way = eigen.eigenvectors.column(k);
            step += way * (way.dot(right) / value);
            rank += 1;
        }
    }
    (step, rank)
}

/// The point near `x` where surfaces meet, `None` where Newton's method does not find one.
fn project(program: &Program, surfaces: &[u32], mut x: Vec3, h: f64) -> Option<Vec3> {
    for _ in 0..STEPS {
        let mut square = Mat3::zeros();
        let mut right = Vec3::zeros();
        let mut furthest = 0.0f64;
        for &surface in surfaces {
            let surface = &program.surfaces[surface as usize];
            let gradient = surface.gradient(&x);
            let slope = gradient.norm();
            let (normal, off) = (gradient / slope, surface.value(&x) / slope);
            if !(slope > 0.0 && off.is_finite()) {
                return None;
            }
            square += normal * normal.transpose();
            right -= normal * off;
            furthest = furthest.max(off.abs());
        }
        if furthest <= NEAR * h {
            return Some(x);
        }
        let step = shortest(&square, &right).0;
        // Far steps of level sets that are not distances.
        x += step * (h / step.norm().max(h));
    }
    None
}

/// Places all vertices.
pub(super) fn place(program: &Program, crossed: &mut [Crossed], sheets: &mut [Sheet], h: f64) -> Vec<Vec3> {
    relabel(crossed, sheets);
    let mut vertices = Vec::with_capacity(sheets.len());
    for sheet in sheets.iter_mut() {
        let mean = sheet.mean(crossed);
        let inside = |x: &Vec3| (x - sheet.middle).amax() <= REACH * h;
        if let [surface] = sheet.surfaces[..]
            && let Some(x) = crease(program, surface, crossed, &sheet.crossed, &mean).filter(inside)
        {
            sheet.fixed = true;
            vertices.push(x);
            continue;
        }
        let x = project(program, &sheet.surfaces, mean, h).filter(inside);
        sheet.fixed = x.is_none();
        vertices.push(x.or_else(|| compromise(program, &sheet.surfaces, mean, h, inside)).unwrap_or(mean));
    }
    tips(program, crossed, sheets, &mut vertices, h);
    even_out(program, crossed, sheets, &mut vertices, h);
    vertices
}

/// Draws the vertices of facets that cross back: first into their cells, then to the middle of what their sheets cross.
pub(super) fn draw_back(
    program: &Program,
    crossed: &[Crossed],
    sheets: &mut [Sheet],
    vertices: &mut [Vec3],
    h: f64,
    which: impl IntoIterator<Item = u32>,
) {
    for vertex in which {
        let sheet = &mut sheets[vertex as usize];
        let mean = sheet.mean(crossed);
        sheet.drawn_back += 1;
        let inside = |x: &Vec3| (x - sheet.middle).amax() <= 0.5 * h;
        let within = match sheet.drawn_back {
            1 => project(program, &sheet.surfaces, mean, h)
                .filter(inside)
                .or_else(|| compromise(program, &sheet.surfaces, mean, h, inside)),
            _ => None,
        };
        vertices[vertex as usize] = within.unwrap_or(mean);
    }
}

/// The point for surfaces that meet elsewhere or nowhere, as where two edges run through one cell: that of as many as do meet
/// there, closest to the others.
fn compromise(program: &Program, surfaces: &[u32], mean: Vec3, h: f64, inside: impl Fn(&Vec3) -> bool) -> Option<Vec3> {
    let off = |x: &Vec3| {
        let distance = |&s: &u32| program.surfaces[s as usize].value(x).abs();
        surfaces.summed(distance)
    };
    (1..surfaces.len().min(4)).rev().find_map(|size| {
        let subsets = (1u32..1 << surfaces.len().min(8)).filter(|set| set.count_ones() as usize == size);
        let found = subsets.filter_map(|set| {
            let some: Vec<u32> = (0..surfaces.len()).filter(|k| set >> k & 1 == 1).map(|k| surfaces[k]).collect();
            project(program, &some, mean, h).filter(&inside)
        });
        found.map(|x| (off(&x), x)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, x)| x)
    })
}

/// Surfaces of the sheets. A quadrangle all of whose vertices lie on one further surface too would have no area: it is taken for
/// one of that surface.
fn relabel(crossed: &mut [Crossed], sheets: &mut [Sheet]) {
    for _ in 0..4 {
        sheets.iter_mut().for_each(|sheet| sheet.gather(crossed));
        let mut changed = false;
        for place in 0..crossed.len() {
            let own = crossed[place].surface;
            let around = crossed[place].sheets;
            let of = |k: usize| &sheets[around[k] as usize].surfaces;
            let Some(&other) = of(0).iter().find(|s| **s != own && (1..4).all(|k| of(k).contains(s))) else {
                continue;
            };
            let like = around.iter().flat_map(|&sheet| &sheets[sheet as usize].crossed);
            let Some(sign) = like.map(|&k| &crossed[k as usize]).find(|c| c.surface == other).map(|c| c.sign) else {
                continue;
            };
            (crossed[place].surface, crossed[place].sign) = (other, sign);
            changed = true;
            // Sheets around follow at once, so that not both sides change places.
            around.iter().for_each(|&sheet| sheets[sheet as usize].gather(crossed));
        }
        if !changed {
            return;
        }
    }
}

/// The edge or corner of a level set within a cell, where its normals tell one.
fn crease(program: &Program, surface: u32, crossed: &[Crossed], own: &[u32], mean: &Vec3) -> Option<Vec3> {
    let Surface::Field { creased: true, .. } = program.surfaces[surface as usize] else { return None };
    let normals: Vec<(Vec3, Vec3)> = own
        .iter()
        .map(|&k| (crossed[k as usize].at, program.surfaces[surface as usize].gradient(&crossed[k as usize].at)))
        .filter_map(|(at, gradient)| Some((at, gradient.try_normalize(0.0)?)))
        .collect();
    let widest = normals.iter().flat_map(|a| normals.iter().map(|b| a.1.dot(&b.1))).fold(1.0, f64::min);
    if widest > SHARP {
        return None;
    }
    let mut square = Mat3::zeros();
    let mut right = Vec3::zeros();
    for (at, normal) in &normals {
        square += normal * normal.transpose();
        right += normal * normal.dot(&(at - mean));
    }
    let (step, rank) = shortest(&square, &right);
    (rank > 1).then(|| mean + step)
}

/// The vertex nearest to the tip of a cone goes there.
fn tips(program: &Program, crossed: &[Crossed], sheets: &mut [Sheet], vertices: &mut [Vec3], h: f64) {
    for (number, surface) in program.surfaces.iter().enumerate() {
        let Surface::Cone { apex, .. } = surface else { continue };
        let found = program.at(apex);
        if found.surface as usize != number || found.value.abs() > NEAR * h {
            continue;
        }
        let mine = crossed.iter().filter(|c| c.surface as usize == number).flat_map(|c| c.sheets);
        let distance = |&sheet: &u32| (vertices[sheet as usize] - apex).norm();
        let alone = mine.filter(|&sheet| sheets[sheet as usize].surfaces.len() == 1);
        let nearest = alone.min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        if let Some(sheet) = nearest.filter(|sheet| distance(sheet) < 2.0 * h) {
            vertices[sheet as usize] = *apex;
            sheets[sheet as usize].fixed = true;
        }
    }
}

/// Moves vertices to the middle of their neighbours, those on curves of their neighbours on the curve, and back to their surfaces.
fn even_out(program: &Program, crossed: &[Crossed], sheets: &[Sheet], vertices: &mut Vec<Vec3>, h: f64) {
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); sheets.len()];
    for crossing in crossed {
        for k in 0..4 {
            let (a, b) = (crossing.sheets[k], crossing.sheets[(k + 1) % 4]);
            let has_all = |a: u32, b: u32| {
                let of = |sheet: u32| &sheets[sheet as usize].surfaces;
                of(a).iter().all(|surface| of(b).contains(surface))
            };
            if has_all(a, b) {
                neighbours[a as usize].push(b);
            }
            if has_all(b, a) {
                neighbours[b as usize].push(a);
            }
        }
    }
    for (list, sheet) in neighbours.iter_mut().zip(sheets) {
        list.sort_unstable();
        list.dedup();
        // Corners, and ends of curves.
        if sheet.fixed || sheet.surfaces.len() > 2 || sheet.surfaces.len() == 2 && list.len() != 2 {
            list.clear();
        }
    }
    for _ in 0..ROUNDS {
        let moved = crate::parallel::map_with(
            vertices.len(),
            1024,
            || (),
            |(), k| {
                let list = &neighbours[k];
                if list.is_empty() {
                    return vertices[k];
                }
                let mean = list.iter().map(|&other| vertices[other as usize]).sum::<Vec3>() / list.len() as f64;
                let inside = |x: &Vec3| (x - sheets[k].middle).amax() <= REACH * h;
                let to = project(program, &sheets[k].surfaces, (mean + vertices[k]) * 0.5, h);
                to.filter(inside).unwrap_or(vertices[k])
            },
        );
        *vertices = moved;
    }
}
