//! Meshes with each cell cut in 8.

use std::collections::HashMap;

use crate::each::{Each, list_of};
use crate::error::MeshError;
use crate::geometry::Point;

use super::elements::{Elements, Group};
use super::{CellShape, Mesh, sorted};

/// Nodes of a mesh and those in the middle of its edges, faces and cells, by what they are in the middle of.
struct Middles<'a, const D: usize> {
    points: Vec<Point<D>>,
    known: HashMap<[u32; 8], u32>,
    curved: &'a HashMap<[u32; 2], Point<D>>,
}

impl<const D: usize> Middles<'_, D> {
    /// The node in the middle of others.
    fn of(&mut self, corners: &[u32]) -> u32 {
        if let &[corner] = corners {
            return corner;
        }
        let key = sorted(corners);
        let next = self.points.len() as u32;
        let number = *self.known.entry(key).or_insert(next);
        if number == next {
            let sum: Point<D> = key.iter().filter(|c| **c != u32::MAX).map(|&c| self.points[c as usize]).sum();
            let mut middle = sum / corners.len() as f64;
            // The middle of a curved edge is known; that of a face or a cell moves with the middles of its edges, as
            // functions of second order on its corners and edges have it.
            let mut off = Point::<D>::zeros();
            for (k, &a) in key.iter().enumerate() {
                for &b in key[k + 1..].iter().take_while(|b| **b != u32::MAX) {
                    if let Some(known) = self.curved.get(&[a, b]) {
                        off += known - (self.points[a as usize] + self.points[b as usize]) * 0.5;
                    }
                }
            }
            middle += match corners.len() {
                2 => off,
                4 => off * 0.5,
                _ => off * 0.25,
            };
            self.points.push(middle);
        }
        number
    }
}

/// The cells that one is cut into, their corners as sets of its own whose middle they are.
fn parts(shape: CellShape) -> Vec<(CellShape, Vec<Vec<usize>>)> {
    let around = |face: &[usize], corner: usize| {
        let place = face.iter().position(|c| *c == corner).unwrap_or(0);
        [face[(place + 1) % face.len()], face[(place + face.len() - 1) % face.len()]]
    };
    match shape {
        CellShape::Vertex => vec![(shape, vec![vec![0]])],
        CellShape::Line => vec![(shape, vec![vec![0], vec![0, 1]]), (shape, vec![vec![0, 1], vec![1]])],
        CellShape::Triangle => {
            let [a, b, c] = [vec![0, 1], vec![1, 2], vec![2, 0]];
            vec![
                (shape, vec![vec![0], a.clone(), c.clone()]),
                (shape, vec![a.clone(), vec![1], b.clone()]),
                (shape, vec![c.clone(), b.clone(), vec![2]]),
                (shape, vec![a, b, c]),
            ]
        }
        CellShape::Quadrangle => list_of(4, |corner| {
            let [next, last] = around(&[0, 1, 2, 3], corner);
            (shape, vec![vec![corner], vec![corner, next], vec![0, 1, 2, 3], vec![last, corner]])
        }),
        CellShape::Prism => {
            let level = |upper: usize| {
                move |set: &Vec<usize>| -> Vec<usize> {
                    match upper {
                        0 => set.clone(),
                        2 => set.mapped(|c| c + 3),
                        _ => set.iter().flat_map(|c| [*c, c + 3]).collect(),
                    }
                }
            };
            parts(CellShape::Triangle)
                .into_iter()
                .flat_map(|(_, triangle)| {
                    [0, 1].map(|storey| {
                        let corners = triangle.iter().map(level(storey)).chain(triangle.iter().map(level(storey + 1)));
                        (shape, corners.collect())
                    })
                })
                .collect()
        }
        CellShape::Hexahedron => {
            // Corners by their bits along three axes, Gmsh's order turning in each face.
            let bits = |c: usize| [(c & 1) ^ ((c >> 1) & 1), (c >> 1) & 1, (c >> 2) & 1];
            // Corner k of the part at a corner is the middle of all corners between the two.
            let between = |corner: usize, k: usize, c: usize| {
                (0..3).all(|i| bits(c)[i] == bits(corner)[i] || bits(c)[i] == bits(k)[i])
            };
            let set = |corner, k| (0..8).filter(|&c| between(corner, k, c)).collect();
            list_of(8, |corner| (shape, list_of(8, |k| set(corner, k))))
        }
        CellShape::Tetrahedron => Vec::new(),
    }
}

/// A tetrahedron cut at its corners, the octahedron that is left along its shortest diagonal.
fn tetrahedra<const D: usize>(corners: &[u32], middles: &mut Middles<'_, D>) -> [[u32; 4]; 8] {
    let mut m = [[0u32; 4]; 4];
    for a in 0..4 {
        for b in 0..4 {
            m[a][b] = if a == b { corners[a] } else { middles.of(&[corners[a], corners[b]]) };
        }
    }
    let c = corners;
    let length = |p: [u32; 2]| (middles.points[p[0] as usize] - middles.points[p[1] as usize]).norm_squared();
    // Diagonals between opposite edges, and the other four vertices of the octahedron around each, right-handed.
    let diagonals = [
        ([m[0][1], m[2][3]], [m[0][2], m[0][3], m[1][3], m[1][2]]),
        ([m[0][2], m[1][3]], [m[0][3], m[0][1], m[1][2], m[2][3]]),
        ([m[0][3], m[1][2]], [m[0][1], m[0][2], m[2][3], m[1][3]]),
    ];
    let (mut shortest, mut least) = (0, f64::INFINITY);
    for (k, (ends, _)) in diagonals.iter().enumerate() {
        // A little shorter does not count: rounding would choose.
        if length(*ends) < 0.999 * least {
            (shortest, least) = (k, length(*ends));
        }
    }
    let ([from, to], ring) = diagonals[shortest];
    let mut out = [
        [c[0], m[0][1], m[0][2], m[0][3]],
        [m[0][1], c[1], m[1][2], m[1][3]],
        [m[0][2], m[1][2], c[2], m[2][3]],
        [m[0][3], m[1][3], m[2][3], c[3]],
        [0; 4],
        [0; 4],
        [0; 4],
        [0; 4],
    ];
    for k in 0..4 {
        out[4 + k] = [from, to, ring[k], ring[(k + 1) % 4]];
    }
    out
}

impl<const D: usize> Mesh<D> {
    /// The mesh with each cell cut in $2^D$ parts at the middles of its edges; groups are kept. The nodes of this mesh come
    /// first. Edges that were curved in a file of second order are followed, as parabolas.
    ///
    /// # Errors
    /// Where a part of a warped cell is inverted.
    pub fn refined(&self) -> Result<Mesh<D>, MeshError> {
        let mut middles = Middles { points: self.points.clone(), known: HashMap::new(), curved: &self.curved };
        let mut elements: [Elements; 4] = Default::default();
        // Where the parts of each element begin.
        let mut starts: [Vec<u32>; 4] = Default::default();
        for dimension in (0..=D).rev() {
            let (list, finer) = (&self.elements[dimension], &mut elements[dimension]);
            for element in 0..list.len() {
                starts[dimension].push(finer.len() as u32);
                let (shape, corners) = (list.shape(element), list.corners(element));
                if shape == CellShape::Tetrahedron {
                    for part in tetrahedra(corners, &mut middles) {
                        finer.push(shape, part);
                    }
                    continue;
                }
                for (shape, part) in parts(shape) {
                    let nodes: Vec<u32> = part.mapped(|set| middles.of(&set.mapped(|&c| corners[c])));
                    finer.push(shape, nodes);
                }
            }
            starts[dimension].push(finer.len() as u32);
        }
        let groups = self.groups.mapped(|group| {
            let starts = &starts[group.dimension];
            let parts = group.members.iter().flat_map(|&m| starts[m as usize]..starts[m as usize + 1]);
            Group { members: parts.collect(), ..group.clone() }
        });
        let curved = self.curved_parts(&middles);
        let mut mesh = Mesh { points: middles.points, elements, groups, curved };
        mesh.orient()?;
        Ok(mesh)
    }
}

impl<const D: usize> Mesh<D> {
    /// Middles of the curved edges of the finer mesh: halves of curved edges, and those that cut curved faces, as functions
    /// of second order have them.
    fn curved_parts(&self, middles: &Middles<'_, D>) -> HashMap<[u32; 2], Point<D>> {
        let mut curved = HashMap::with_capacity(4 * self.curved.len());
        let number = |corners: &[u32]| middles.known.get(&sorted(corners)).copied();
        let at = |node: u32| middles.points[node as usize];
        for (&[a, b], middle) in &self.curved {
            let Some(m) = number(&[a, b]) else { continue };
            for (end, other) in [(a, b), (b, a)] {
                curved.insert([end, m], at(end) * 0.375 + middle * 0.75 - at(other) * 0.125);
            }
        }
        let list = &self.elements[D];
        for cell in 0..list.len() {
            let corners = list.corners(cell);
            let faces = if D == 2 { &[][..] } else { list.shape(cell).faces() };
            let own: Vec<usize> = (0..corners.len()).collect();
            let plane = [&own[..]];
            for face in if D == 2 { &plane[..] } else { faces } {
                let c: Vec<u32> = face.mapped(|&k| corners[k]);
                let n = c.len();
                let bent = |k: usize| {
                    let (a, b) = (c[k], c[(k + 1) % n]);
                    self.curved.contains_key(&[a.min(b), a.max(b)])
                };
                if !(0..n).any(bent) {
                    continue;
                }
                let Some(m) = (0..n).map(|k| number(&[c[k], c[(k + 1) % n]])).collect::<Option<Vec<u32>>>() else {
                    continue;
                };
                let sum: Point<D> = c.iter().map(|&c| at(c)).sum();
                for k in 0..n {
                    // Triangles are cut between the middles of their edges, quadrangles from those to their own middle.
                    let (ends, middle) = if n == 3 {
                        let (here, next, far) = (m[k], m[(k + 1) % 3], m[(k + 2) % 3]);
                        let corner = at(c[(k + 1) % 3]);
                        ([here, next], (at(here) + at(next)) * 0.5 + at(far) * 0.25 - (sum - corner) * 0.125)
                    } else {
                        let Some(centre) = number(&c) else { continue };
                        let beside = at(m[(k + 1) % 4]) + at(m[(k + 3) % 4]);
                        ([m[k], centre], at(m[k]) * 0.75 + at(m[(k + 2) % 4]) * 0.25 + beside * 0.375 - sum * 0.1875)
                    };
                    curved.insert([ends[0].min(ends[1]), ends[0].max(ends[1])], middle);
                }
            }
        }
        curved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use approx::{assert_abs_diff_eq, assert_relative_eq, relative_eq};

    #[test]
    fn parts_fill_their_cell() {
        let tetrahedron = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.1, 0.3, 1.2]];
        let prism =
            [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.1, 1.3], [0.2, 1.0, 1.1]];
        let hexahedron = [
            [0.0, 0.0, 0.0],
            [1.0, 0.1, 0.0],
            [1.2, 1.0, 0.0],
            [0.1, 1.1, 0.1],
            [0.0, 0.0, 1.0],
            [1.0, 0.1, 1.3],
            [1.2, 1.0, 1.1],
            [0.0, 1.0, 0.9],
        ];
        let check = |shape: CellShape, points: &[[f64; 3]]| {
            let points: Vec<Vec3> = points.iter().map(|x| (*x).into()).collect();
            let corners: Vec<usize> = (0..points.len()).collect();
            let face: Vec<usize> = shape.faces()[0].to_vec();
            let face_shape = if face.len() == 3 { CellShape::Triangle } else { CellShape::Quadrangle };
            let groups = [("all".to_string(), vec![0]), ("base".to_string(), vec![1])];
            let mesh = Mesh::new(points, &[(shape, corners), (face_shape, face)], &groups).unwrap();
            let finer = mesh.refined().unwrap();
            assert_eq!(finer.cell_count(), 8);
            assert!(relative_eq!(finer.total(), mesh.total(), max_relative = 1e-14), "{shape:?}");
            assert_relative_eq!(finer.measure("all").unwrap(), mesh.total(), max_relative = 1e-14);
            assert_abs_diff_eq!(finer.measure("base").unwrap() / mesh.measure("base").unwrap(), 1.0, epsilon = 1e-2);
            // No part was turned round by the check of the orientation: they are cut with the right one.
            for cell in 0..8 {
                let (shape, corners) = finer.cell(cell);
                assert!(super::super::elements::measure(shape, corners, finer.points()) > 0.0);
            }
        };
        check(CellShape::Tetrahedron, &tetrahedron);
        check(CellShape::Prism, &prism);
        check(CellShape::Hexahedron, &hexahedron);
    }
}
