//! A tree of boxes over facets: nearest facets, facets in a box, winding numbers.

use std::f64::consts::PI;

use crate::each::{Each, EachOf};
use crate::geometry::{Bounds, Mat3, Vec3, double_area, mean};
use crate::neighbours::BoxTree;

/// Distance over radius from which a part of the tree is seen as its moments: winding numbers are off by 0.07 at most on a sphere.
const FAR: f64 = 2.0;

/// Facets by their boxes.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    corners: Vec<[Vec3; 3]>,
    boxes: BoxTree<3>,
    /// Of each part of the tree.
    moments: Vec<Moments>,
}

/// Moments of facets about their centre.
#[derive(Debug, Clone, Default)]
struct Moments {
    /// Mean of the facets' centres by area, and the largest distance of a corner from it.
    centre: Vec3,
    radius: f64,
    /// $\int n\,\mathrm dA$ and $\int n\otimes(y-c)\,\mathrm dA$.
    dipole: Vec3,
    moment: Mat3,
}

/// The foot of a point on the triangle $abc$ and the places of the corners that span where it lies, one, two or three (Ericson, *Real-Time
/// Collision Detection*, 5.1.5).
pub(crate) fn foot(x: &Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, &'static [usize]) {
    let (ab, ac, ax) = (b - a, c - a, x - a);
    let (d1, d2) = (ab.dot(&ax), ac.dot(&ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, &[0]);
    }
    let bx = x - b;
    let (d3, d4) = (ab.dot(&bx), ac.dot(&bx));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, &[1]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), &[0, 1]);
    }
    let cx = x - c;
    let (d5, d6) = (ab.dot(&cx), ac.dot(&cx));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, &[2]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), &[2, 0]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), &[1, 2]);
    }
    let sum = va + vb + vc;
    (a + ab * (vb / sum) + ac * (vc / sum), &[0, 1, 2])
}

/// The solid angle of a triangle seen from the origin (van Oosterom & Strackee 1983).
pub(crate) fn solid_angle([a, b, c]: &[Vec3; 3]) -> f64 {
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(&b.cross(c)).atan2(below)
}

impl Tree {
    pub(crate) fn new(vertices: &[Vec3], facets: &[[u32; 3]]) -> Self {
        let corners = facets.mapped(|facet| facet.each(|vertex| vertices[vertex as usize]));
        let boxes = BoxTree::new(corners.mapped(Bounds::of));
        let mut moments = Vec::new();
        boxes.each_part(&mut |part, facets| {
            if moments.len() <= part {
                moments.resize(part + 1, Moments::default());
            }
            moments[part] = Moments::of(&facets.mapped(|&facet| corners[facet as usize]));
        });
        Tree { corners, boxes, moments }
    }

    /// The winding number of the facets about a point.
    pub(crate) fn winding_number(&self, x: &Vec3) -> f64 {
        let mut angle = 0.0;
        let enter = |part: usize, _: &Bounds<3>| {
            let far = self.moments[part].far_angle(x);
            angle += far.unwrap_or(0.0);
            far.is_none()
        };
        let mut near = 0.0;
        self.boxes.walk(enter, |facet| {
            near += solid_angle(&self.corners[facet].each(|corner| corner - x));
            false
        });
        (near + angle) / (4.0 * PI)
    }

    /// The nearest facet, its nearest point and the distance; `None` without facets.
    pub(crate) fn closest(&self, x: &Vec3) -> Option<(u32, Vec3, f64)> {
        let mut best: Option<(f64, usize, Vec3)> = None;
        self.boxes.approach(x, |facet, _| {
            let at = foot(x, &self.corners[facet]).0;
            let square = (at - x).norm_squared();
            // Of facets as near as each other the first: the same whatever the order of the tree.
            if best.is_none_or(|found| square < found.0 || square == found.0 && facet < found.1) {
                best = Some((square, facet, at));
            }
            best.map_or(f64::INFINITY, |found| found.0.sqrt())
        });
        best.map(|(square, facet, at)| (facet as u32, at, square.sqrt()))
    }

    /// Calls `visit` for the facets whose boxes meet a box.
    pub(crate) fn for_each_in(&self, within: &Bounds<3>, mut visit: impl FnMut(u32)) {
        self.boxes.each_meeting(within, |facet| visit(facet as u32));
    }
}

impl Moments {
    fn of(facets: &[[Vec3; 3]]) -> Self {
        let area = |corners: &[Vec3; 3]| double_area(corners) * 0.5;
        let total = facets.summed(|corners| area(corners).norm());
        let mut own = Moments::default();
        if total > 0.0 {
            own.centre = facets.iter().map(|corners| mean(corners) * area(corners).norm()).sum::<Vec3>() / total;
        } else if let Some(first) = facets.first() {
            own.centre = mean(first);
        }
        for corners in facets {
            own.dipole += area(corners);
            own.moment += area(corners) * (mean(corners) - own.centre).transpose();
            own.radius = own.radius.max(corners.largest(|x| (x - own.centre).norm()));
        }
        own
    }

    /// The solid angle of the facets seen from a point that is far away; none from near by.
    fn far_angle(&self, x: &Vec3) -> Option<f64> {
        let r = self.centre - x;
        let square = r.norm_squared();
        if square <= (FAR * self.radius).powi(2) {
            return None;
        }
        let cube = square * square.sqrt();
        Some((self.dipole.dot(&r) + self.moment.trace() - 3.0 * r.dot(&(self.moment * r)) / square) / cube)
    }
}
