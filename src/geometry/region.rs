//! Drawn regions: an outline and holes in it.

use std::f64::consts::PI;

use crate::each::Each;
use crate::error::{GeometryError, Invalid};

use super::Vec2;
use super::outline::{Curve, Outline};

/// A region of the plane: an outline and holes in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Outer loop counter-clockwise, holes clockwise; each a list of (curve, part).
    pub(crate) loops: Vec<Vec<(Curve, usize)>>,
    /// Names of the parts, in the order drawn.
    pub(crate) names: Vec<String>,
    pub(crate) tolerance: f64,
    area: f64,
    pub(crate) min: Vec2,
    pub(crate) max: Vec2,
    /// Chords of all loops, for tests of containment.
    pub(super) chords: Vec<(Vec2, Vec2)>,
    /// Centre and squared radius of the arcs of those chords that are not lines.
    circles: Vec<Option<(Vec2, f64)>>,
    /// Chords by height, with what lies between them and their arcs: as many bands as chords, from bottom to top.
    bands: Vec<Vec<u32>>,
}

/// Default distance of chords from their arc as a part of the region's smaller extent.
const TOLERANCE: f64 = 1e-3;
/// Least tolerance of arcs relative to the smaller extent.
const FINEST: f64 = 1e-6;

impl Region {
    /// A region without holes.
    ///
    /// # Errors
    /// Where the outline is not closed, crosses itself, or holds no area.
    pub fn new(outline: Outline) -> Result<Self, GeometryError> {
        Region::with_holes(outline, [])
    }

    /// A region with holes.
    ///
    /// # Errors
    /// Where a loop is not closed, loops cross themselves or each other, or a hole is not inside.
    pub fn with_holes(outline: Outline, holes: impl IntoIterator<Item = Outline>) -> Result<Self, GeometryError> {
        let mut region = Region {
            loops: Vec::new(),
            names: Vec::new(),
            tolerance: 0.0,
            area: 0.0,
            min: Vec2::repeat(f64::INFINITY),
            max: Vec2::repeat(f64::NEG_INFINITY),
            chords: Vec::new(),
            circles: Vec::new(),
            bands: Vec::new(),
        };
        for (index, outline) in std::iter::once(outline).chain(holes).enumerate() {
            let curves = outline.curves()?;
            let corner = curves[0].0.at(0.0);
            let area: f64 = curves.summed(|(curve, _)| curve.signed_area(&corner));
            let mut parts = Vec::with_capacity(curves.len());
            for (curve, name) in curves {
                let part = region.names.iter().position(|n| *n == name).unwrap_or(region.names.len());
                if part == region.names.len() {
                    region.names.push(name);
                }
                parts.push((curve, part));
            }
            if (area > 0.0) != (index == 0) {
                parts.reverse();
                for (curve, _) in &mut parts {
                    *curve = curve.reversed();
                }
            }
            region.area += if index == 0 { area.abs() } else { -area.abs() };
            region.loops.push(parts);
        }
        for x in region.loops.iter().flatten().flat_map(|(curve, _)| (0..=32).map(|k| curve.at(f64::from(k) / 32.0))) {
            region.min = region.min.zip_map(&x, f64::min);
            region.max = region.max.zip_map(&x, f64::max);
        }
        let tolerance = TOLERANCE * region.extent();
        region.with_tolerance(tolerance)
    }

    /// Changes how far \[length\] chords may be from their arc; default 1e-3 of the smaller extent.
    ///
    /// # Errors
    /// For a tolerance below a millionth of the smaller extent, and where the region's chords cross.
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self, GeometryError> {
        let hollow = |region: &Region| {
            let (what, remedy) = ("the outline holds no area", "give corners that are not on one line");
            Err(GeometryError::Shape { what, at: region.min.as_slice().to_vec(), remedy })
        };
        if !(self.extent() > 0.0) {
            return hollow(&self);
        }
        // Each chord is compared with all others.
        ensure!(
            tolerance >= FINEST * self.extent() && tolerance.is_finite(),
            Invalid::new(
                "tolerance of arcs",
                tolerance,
                "give a finite length, at least a millionth of the shape's smaller extent"
            )
        );
        self.tolerance = tolerance;
        self.chords.clear();
        self.circles.clear();
        let mut ends = Vec::new();
        for curves in &self.loops {
            let first = self.chords.len();
            for (curve, _) in curves {
                // A full circle needs three chords to have an inside.
                let n = curve.chords(tolerance).max(if curves.len() < 3 { 3 } else { 1 });
                for k in 0..n {
                    let (from, to) = (curve.at(k as f64 / n as f64), curve.at((k + 1) as f64 / n as f64));
                    self.chords.push((from, to));
                    self.circles.push(curve.circle());
                }
            }
            ends.push((first, self.chords.len()));
        }
        self.bands = vec![Vec::new(); self.chords.len()];
        for (chord, ((a, b), circle)) in (0..).zip(self.chords.iter().zip(&self.circles)) {
            // A chord spans less than half a circle, so that its arc lies inside the circle around the chord.
            let reach = 0.5 * if circle.is_some() { (b - a).norm() } else { (b[1] - a[1]).abs() };
            let middle = 0.5 * (a[1] + b[1]);
            for band in self.band(middle - reach)..=self.band(middle + reach) {
                self.bands[band].push(chord);
            }
        }
        self.refuse_crossings(&ends)?;
        if !(self.area > 1e-12 * self.extent().powi(2)) {
            return hollow(&self);
        }
        for &(first, end) in &ends[1..] {
            let outer = &self.chords[ends[0].0..ends[0].1];
            let at = self.chords[first].0;
            let nested = ends[1..].iter().any(|&(f, e)| f != first && winds(&self.chords[f..e], &at));
            ensure!(
                winds(outer, &at) && !nested,
                GeometryError::Shape {
                    what: "a hole is not inside the outline",
                    at: at.as_slice().to_vec(),
                    remedy: "draw holes inside, apart from each other"
                }
            );
            debug_assert!(end > first);
        }
        Ok(self)
    }

    /// Crossing or touching chords that are not neighbours in their loop.
    fn refuse_crossings(&self, loops: &[(usize, usize)]) -> Result<(), GeometryError> {
        for &(first, end) in loops {
            for i in first..end {
                for j in i + 1..self.chords.len() {
                    let neighbours = j < end && (j == i + 1 || (i == first && j + 1 == end));
                    let (a, b) = (self.chords[i], self.chords[j]);
                    let crossing = if neighbours {
                        // Neighbours share a corner; they may not fold back onto each other.
                        let shared = if j == i + 1 { (a.0, a.1, b.1) } else { (b.0, b.1, a.1) };
                        folds(shared)
                    } else {
                        cross_or_touch(a, b)
                    };
                    ensure!(
                        !crossing,
                        GeometryError::Shape {
                            what: "outlines cross or touch here",
                            at: b.0.as_slice().to_vec(),
                            remedy: "draw each loop without crossings, holes apart from other loops"
                        }
                    );
                }
            }
        }
        Ok(())
    }

    /// The enclosed area, arcs exact.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Names of the boundary parts in the order drawn.
    pub fn parts(&self) -> &[String] {
        &self.names
    }

    /// The smaller extent of the bounding box \[length\].
    pub(crate) fn extent(&self) -> f64 {
        (self.max - self.min).min()
    }

    /// The band at a height.
    fn band(&self, height: f64) -> usize {
        let part = (height - self.min[1]) / (self.max[1] - self.min[1]);
        ((part * self.bands.len() as f64) as usize).min(self.bands.len() - 1)
    }

    /// Whether a point lies inside, arcs exact.
    pub fn contains(&self, at: &Vec2) -> bool {
        let mut inside = false;
        for &chord in &self.bands[self.band(at[1])] {
            let (a, b) = self.chords[chord as usize];
            // What lies between a chord and its arc is inside of one of them alone.
            let between = self.circles[chord as usize].is_some_and(|(centre, square)| {
                (at - centre).norm_squared() <= square && side(a, b, *at) * side(a, b, centre) < 0.0
            });
            inside ^= between ^ is_left(a, b, at);
        }
        inside
    }
}

/// Whether a set of closed polygons winds oddly around a point.
fn winds(chords: &[(Vec2, Vec2)], at: &Vec2) -> bool {
    chords.iter().fold(false, |inside, (a, b)| inside ^ is_left(*a, *b, at))
}

/// Whether a chord crosses the line from a point to the right.
pub(crate) fn is_left(a: Vec2, b: Vec2, at: &Vec2) -> bool {
    (a[1] > at[1]) != (b[1] > at[1]) && at[0] < a[0] + (b[0] - a[0]) * (at[1] - a[1]) / (b[1] - a[1])
}

fn side(a: Vec2, b: Vec2, c: Vec2) -> f64 {
    let (u, v) = (b - a, c - a);
    let cross = u.perp(&v);
    // What rounding of coordinates of this size leaves of a point on the line.
    if cross.abs() <= 1e-12 * u.norm() * v.norm().max(u.norm()) { 0.0 } else { cross }
}

/// Whether two segments have a point in common.
fn cross_or_touch((a, b): (Vec2, Vec2), (c, d): (Vec2, Vec2)) -> bool {
    let (p, q) = (side(a, b, c), side(a, b, d));
    let (r, s) = (side(c, d, a), side(c, d, b));
    if p * q < 0.0 && r * s < 0.0 {
        return true;
    }
    let between = |a: Vec2, b: Vec2, c: Vec2, side: f64| side == 0.0 && (c - a).dot(&(c - b)) <= 0.0;
    between(a, b, c, p) || between(a, b, d, q) || between(c, d, a, r) || between(c, d, b, s)
}

/// Whether a line turns back onto itself at its middle corner.
fn folds((a, b, c): (Vec2, Vec2, Vec2)) -> bool {
    let (u, v) = (a - b, c - b);
    let angle = u.perp(&v).atan2(u.dot(&v)).abs();
    angle < 1e-9 * PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn areas_do_not_depend_on_the_direction() {
        let square = |turned: bool| {
            let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
            let at = |k: usize| corners[if turned { (4 - k) % 4 } else { k % 4 }];
            Outline::at(at(0)).line("a", at(1)).line("b", at(2)).line("c", at(3)).close("d")
        };
        for turned in [false, true] {
            let hole = Outline::circle("hole", [1.0, 1.0], 0.5);
            let region = Region::with_holes(square(turned), [hole]).unwrap();
            assert_abs_diff_eq!(region.area(), 4.0 - PI / 4.0, epsilon = 1e-12);
            assert!(region.contains(&Vec2::new(0.2, 0.2)) && !region.contains(&Vec2::new(1.0, 1.0)));
        }
    }
}
