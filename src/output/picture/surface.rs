//! Normals and edges of a surface of faces.

use crate::each::Each;
use crate::geometry::Vec3;
use std::collections::HashMap;

/// Cosine of the angle between faces beyond which the edge between them is sharp, 35°.
const CREASE: f64 = 0.82;

/// Faces with their normals and the faces at each edge.
pub(super) struct Surface<'a> {
    faces: &'a [Vec<usize>],
    /// Unit normals, outward by the right hand.
    normals: Vec<Vec3>,
    /// Those between which angles are taken: at rest, so that a bent face is not taken for two.
    angles: Vec<Vec3>,
    /// Faces at each point.
    around: Vec<Vec<u32>>,
    edges: Vec<([usize; 2], Vec<u32>)>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(points: &[Vec3], rest: &[Vec3], faces: &'a [Vec<usize>]) -> Self {
        let [normals, angles] = [points, rest].map(|points| faces.mapped(|face| normal(points, face)));
        let mut around = vec![Vec::new(); points.len()];
        let mut numbers: HashMap<[usize; 2], usize> = HashMap::new();
        let mut edges: Vec<([usize; 2], Vec<u32>)> = Vec::new();
        for (number, face) in faces.iter().enumerate() {
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                let ends = [a.min(b), a.max(b)];
                let edge = *numbers.entry(ends).or_insert_with(|| {
                    edges.push((ends, Vec::new()));
                    edges.len() - 1
                });
                edges[edge].1.push(number as u32);
                around[a].push(number as u32);
            }
        }
        Surface { faces, normals, angles, around, edges }
    }

    pub(super) fn normal(&self, face: usize) -> Vec3 {
        self.normals[face]
    }

    /// The mean normal of the faces around a corner that make no sharp edge with its face.
    pub(super) fn corner_normal(&self, face: usize, corner: usize) -> Vec3 {
        let own = self.angles[face];
        let near = self.around[self.faces[face][corner]].iter().map(|&other| other as usize);
        let smooth = near.filter(|&other| own.dot(&self.angles[other]) > CREASE).map(|other| self.normals[other]);
        smooth.sum::<Vec3>().try_normalize(0.0).unwrap_or(self.normals[face])
    }

    pub(super) fn edges(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.edges.iter().map(|(ends, _)| *ends)
    }

    /// Edges at which the surface has an angle or ends.
    pub(super) fn creases(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let sharp = |faces: &[u32]| match faces {
            [a, b] => self.angles[*a as usize].dot(&self.angles[*b as usize]) < CREASE,
            _ => true,
        };
        self.edges.iter().filter(move |(_, faces)| sharp(faces)).map(|(ends, _)| *ends)
    }

    /// Edges between a face that looks at the eye and one that looks away.
    pub(super) fn outline<'s>(&'s self, eye: &'s Vec3) -> impl Iterator<Item = [usize; 2]> + 's {
        let looks = move |face: u32| self.normals[face as usize].dot(eye) > 0.0;
        self.edges
            .iter()
            .filter(move |(_, faces)| matches!(faces[..], [a, b] if looks(a) != looks(b)))
            .map(|(ends, _)| *ends)
    }
}

/// The unit normal of a face; zero where it has no area.
fn normal(points: &[Vec3], face: &[usize]) -> Vec3 {
    let x = |k: usize| points[face[k % face.len()]];
    let area = (0..face.len()).map(|k| (x(k) - x(0)).cross(&(x(k + 1) - x(0)))).sum::<Vec3>();
    area.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
}
