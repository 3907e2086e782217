//! A tree of boxes over facets: nearest facets, facets in a box, winding numbers.

use std::f64::consts::PI;

use crate::each::{Each, EachOf};
use crate::geometry::{Mat3, Point, Vec3};

/// Facets in a leaf.
const LEAF: usize = 8;
/// Distance over radius from which a node is seen as its moments: winding numbers are off by 0.07 at most on a sphere.
const FAR: f64 = 2.0;
/// Depth of the tree of as many facets as indices can name, twice.
const DEPTH: usize = 64;

#[derive(Debug, Clone)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Mean of the facets' centres by area, and the largest distance of a corner from it.
    centre: Vec3,
    radius: f64,
    /// $\int n\,\mathrm dA$ and $\int n\otimes(y-c)\,\mathrm dA$.
    dipole: Vec3,
    moment: Mat3,
    /// Places in `order`.
    first: u32,
    end: u32,
    /// The second child; the first one follows its parent. Zero in leaves.
    second: u32,
}

/// A tree of boxes, each split in the middle of its facets along its longest side.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
    corners: Vec<[Vec3; 3]>,
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

/// The solid angle of a triangle seen from a point, over 4π (van Oosterom & Strackee 1983).
fn solid_angle(x: &Vec3, corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.each(|corner| corner - x);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    a.dot(&b.cross(&c)).atan2(below) / (2.0 * PI)
}

impl Tree {
    pub(crate) fn new(vertices: &[Vec3], facets: &[[u32; 3]]) -> Self {
        let corners_of = |facet: u32| facets[facet as usize].each(|vertex| vertices[vertex as usize]);
        let centres: Vec<Vec3> = (0..facets.len() as u32).map(|f| corners_of(f).iter().sum::<Vec3>() / 3.0).collect();
        let mut order: Vec<u32> = (0..facets.len() as u32).collect();
        let mut nodes: Vec<Node> = Vec::with_capacity(4 * facets.len() / LEAF + 1);
        // Ranges to be split, with the node whose second child they are.
        let mut open = vec![(0, order.len(), usize::MAX)];
        while let Some((first, end, parent)) = open.pop() {
            if parent != usize::MAX {
                nodes[parent].second = nodes.len() as u32;
            }
            let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
            for &facet in &order[first..end] {
                for x in corners_of(facet) {
                    (low, high) = (low.inf(&x), high.sup(&x));
                }
            }
            let mut node = Node {
                low,
                high,
                centre: (low + high) * 0.5,
                radius: 0.0,
                dipole: Point::zeros(),
                moment: Mat3::zeros(),
                first: first as u32,
                end: end as u32,
                second: 0,
            };
            node.expand(&order[first..end], corners_of);
            nodes.push(node);
            if end - first > LEAF {
                let axis = (high - low).imax();
                let middle = (end - first) / 2;
                let along =
                    |a: &u32, b: &u32| centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b));
                order[first..end].select_nth_unstable_by(middle, along);
                open.push((first + middle, end, nodes.len() - 1));
                open.push((first, first + middle, usize::MAX));
            }
        }
        let corners = order.mapped(|&facet| corners_of(facet));
        Tree { nodes, order, corners }
    }

    /// Calls `visit` for the leaves' ranges of all nodes into which `enter` goes.
    fn walk(&self, mut enter: impl FnMut(&Node) -> bool, mut visit: impl FnMut(std::ops::Range<usize>)) {
        let mut stack = [0u32; DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let place = stack[height];
            let node = &self.nodes[place as usize];
            if !enter(node) {
                continue;
            }
            if node.second == 0 {
                visit(node.first as usize..node.end as usize);
            } else {
                stack[height] = node.second;
                stack[height + 1] = place + 1;
                height += 2;
            }
        }
    }

    /// The winding number of the facets about a point.
    pub(crate) fn winding_number(&self, x: &Vec3) -> f64 {
        let mut far = 0.0;
        let mut near = 0.0;
        let enter = |node: &Node| {
            let r = node.centre - x;
            let square = r.norm_squared();
            if square <= (FAR * node.radius).powi(2) {
                return true;
            }
            let cube = square * square.sqrt();
            far += (node.dipole.dot(&r) + node.moment.trace() - 3.0 * r.dot(&(node.moment * r)) / square) / cube;
            false
        };
        self.walk(enter, |range| near += self.corners[range].summed(|corners| solid_angle(x, corners)));
        near + far / (4.0 * PI)
    }

    /// The nearest facet, its nearest point and the distance; `None` without facets.
    pub(crate) fn closest(&self, x: &Vec3) -> Option<(u32, Vec3, f64)> {
        let mut best: Option<(f64, u32, Vec3)> = None;
        let mut stack = [(0.0, 0u32); DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let (bound, place) = stack[height];
            if best.is_some_and(|found| bound > found.0) {
                continue;
            }
            let node = &self.nodes[place as usize];
            if node.second == 0 {
                for k in node.first as usize..node.end as usize {
                    let at = foot(x, &self.corners[k]).0;
                    let (square, facet) = ((at - x).norm_squared(), self.order[k]);
                    // Of facets as near as each other the first: the same whatever the order of the tree.
                    if best.is_none_or(|found| square < found.0 || square == found.0 && facet < found.1) {
                        best = Some((square, facet, at));
                    }
                }
                continue;
            }
            let distance = |child: u32| {
                let node = &self.nodes[child as usize];
                (x.sup(&node.low).inf(&node.high) - x).norm_squared()
            };
            let children = [place + 1, node.second].each(|child| (distance(child), child));
            let nearer = usize::from(children[1].0 < children[0].0);
            stack[height] = children[1 - nearer];
            stack[height + 1] = children[nearer];
            height += 2;
        }
        best.map(|(square, facet, at)| (facet, at, square.sqrt()))
    }

    /// Calls `visit` for the facets whose boxes meet a box.
    pub(crate) fn for_each_in(&self, low: &Vec3, high: &Vec3, mut visit: impl FnMut(u32)) {
        let meets = |min: &Vec3, max: &Vec3| (0..3).all(|i| min[i] <= high[i] && max[i] >= low[i]);
        self.walk(
            |node| meets(&node.low, &node.high),
            |range| {
                for k in range {
                    let [a, b, c] = &self.corners[k];
                    if meets(&a.inf(b).inf(c), &a.sup(b).sup(c)) {
                        visit(self.order[k]);
                    }
                }
            },
        );
    }
}

impl Node {
    /// Moments of facets about their centre.
    fn expand(&mut self, facets: &[u32], corners_of: impl Fn(u32) -> [Vec3; 3]) {
        let mut total = 0.0;
        let mut sum = Vec3::zeros();
        for &facet in facets {
            let [a, b, c] = corners_of(facet);
            let area = (b - a).cross(&(c - a)).norm();
            total += area;
            sum += (a + b + c) * (area / 3.0);
        }
        if total > 0.0 {
            self.centre = sum / total;
        }
        for &facet in facets {
            let corners = corners_of(facet);
            let [a, b, c] = corners;
            let normal = (b - a).cross(&(c - a)) * 0.5;
            self.dipole += normal;
            self.moment += normal * ((a + b + c) / 3.0 - self.centre).transpose();
            let furthest = corners.largest(|x| (x - self.centre).norm());
            self.radius = self.radius.max(furthest);
        }
    }
}
