//! Where a lattice lies in a part: its axes and its origin.

use crate::each::{Each, EachOf};
use crate::error::{GeometryError, Invalid};
use crate::geometry::{Mat3, Vec3, double_area, unit};
use crate::order;

use super::grid::{Grid, MACRO};

/// Bricks between particles along each axis.
const STEP: usize = 2;
/// Part of the surface that a direction's facets take at least to make it an axis.
const DOMINANT: f64 = 0.05;
/// Cosine between normals of one direction.
const ALIKE: f64 = 1.0 - 1e-9;
/// How far the first plane stands before the first corner, in bricks: planar faces across an axis then lie beside planes of particles,
/// and on none.
const BEFORE: f64 = 0.02;
/// Distance from a plane below which a corner counts as on it, in bricks.
const CLEAR: f64 = 1e-7;
/// Bricks beyond which a lattice is refused: a mistyped spacing.
const MOST: f64 = 2e8;

/// Axes, origin and size of bricks: $x = o + A u s$ with the coordinates $u$ of the lattice.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// None for the axes of space.
    pub(super) axes: Option<Mat3>,
    pub(super) origin: Vec3,
    pub(super) size: f64,
}

impl Frame {
    /// Coordinates of the lattice at a place.
    pub(super) fn local(&self, x: &Vec3) -> Vec3 {
        let away = (x - self.origin) / self.size;
        self.axes.map_or(away, |axes| axes.tr_mul(&away))
    }

    /// The place of coordinates of the lattice.
    pub(super) fn place(&self, u: &Vec3) -> Vec3 {
        self.origin + self.turned(u) * self.size
    }

    /// A direction of the lattice in space.
    pub(super) fn turned(&self, u: &Vec3) -> Vec3 {
        self.axes.map_or(*u, |axes| axes * u)
    }

    /// A lattice around a part, the first axis along the largest plane faces, and the bricks that hold it: `finest` of them along a
    /// brick of the largest spacing.
    pub(super) fn around(
        vertices: &[Vec3],
        axes: Option<Mat3>,
        spacing: f64,
        finest: usize,
    ) -> Result<(Self, Grid), GeometryError> {
        let size = spacing / (STEP * finest) as f64;
        // Macro cells of the coarsest level, and where there is one level alone, cells.
        let whole = if finest == 1 { STEP } else { MACRO * finest };
        let mut frame = Frame { axes, origin: Vec3::zeros(), size };
        let mut shift = Vec3::zeros();
        let mut counts = [0; 3];
        for axis in 0..3 {
            let mut along: Vec<f64> = vertices.mapped(|x| frame.local(x)[axis]);
            along.sort_by(f64::total_cmp);
            let (low, high) = (along[0], along[along.len() - 1]);
            let bricks = ((high - low).ceil() + 6.0) / STEP as f64;
            ensure!(
                bricks.powi(3) < MOST,
                GeometryError::Count {
                    what: "bricks along a part",
                    count: bricks as usize,
                    needed: "give a wider spacing: the lattice would have more bricks than fit into memory"
                }
            );
            // Distances to planes, of the corners that are nearest to one.
            let clearance = |before: f64| {
                let off = |x: &f64| {
                    let u = x - low + before;
                    (u - u.round()).abs()
                };
                along.iter().map(off).fold(f64::INFINITY, f64::min)
            };
            let tries = (0..64).map(|k| BEFORE * (1.0 + 0.618 * f64::from(k)));
            let before = tries.clone().find(|before| clearance(*before) > CLEAR);
            let before = before
                .unwrap_or_else(|| tries.max_by(|a, b| clearance(*a).total_cmp(&clearance(*b))).unwrap_or(BEFORE));
            // Blocks of two bricks per direction begin at the part; a block before it, and room for the upper ends of faces.
            shift[axis] = low - before - (2 * STEP * finest) as f64;
            counts[axis] = ((high - shift[axis]).floor() as usize + 2).next_multiple_of(whole);
        }
        // Of bricks of the finest spacing there is a number for each, in the solid or not.
        let all: f64 = counts.iter().map(|&count| count as f64).product();
        ensure!(
            finest <= 1 || all < MOST,
            GeometryError::Count {
                what: "bricks of the finest spacing",
                count: all as usize,
                needed: "give a wider spacing or halve it less often: the finest bricks would not fit into memory"
            }
        );
        frame.origin = frame.turned(&shift) * size;
        ensure!(
            frame.origin.iter().all(|x| x.is_finite()),
            Invalid::new("particle spacing", spacing, "give one that is smaller than the part")
        );
        Ok((frame, Grid::even(counts)))
    }
}

/// Axes along the largest plane faces; none where those of space are as good.
pub(super) fn dominant_axes(vertices: &[Vec3], facets: &[[u32; 3]]) -> Option<Mat3> {
    let mut directions: Vec<(Vec3, f64)> = Vec::new();
    let mut areas: Vec<(Vec3, f64)> = facets.mapped(|facet| {
        let area = double_area(&facet.each(|corner| vertices[corner as usize])) * 0.5;
        (area / area.norm().max(f64::MIN_POSITIVE), area.norm())
    });
    let whole: f64 = areas.summed(|facet| facet.1);
    // Large facets first: directions of more than a share of the surface show among few.
    order::sort(&mut areas, &|a, b| b.1.total_cmp(&a.1));
    for (normal, area) in areas {
        match directions.iter().position(|known| known.0.dot(&normal).abs() > ALIKE) {
            Some(known) => directions[known].1 += area,
            None if directions.len() < 256 => directions.push((normal, area)),
            None => {}
        }
    }
    directions.retain(|direction| direction.1 > DOMINANT * whole);
    order::sort(&mut directions, &|a, b| b.1.total_cmp(&a.1));
    let first = directions.first()?.0;
    let across = |x: &Vec3| x - first * first.dot(x);
    let second = directions.iter().map(|direction| direction.0).find(|normal| normal.dot(&first).abs() < 1e-6);
    let flattest = (0..3).min_by(|&a, &b| first[a].abs().total_cmp(&first[b].abs())).unwrap_or(0);
    let second = across(&second.unwrap_or_else(|| unit(flattest))).normalize();
    let third = first.cross(&second);
    let axes = [first, second, third];
    // Planes across the axes of space need no other ones.
    if axes.iter().all(|axis| axis.amax() > 1.0 - 1e-12) {
        return None;
    }
    Some(Mat3::from_columns(&axes))
}
