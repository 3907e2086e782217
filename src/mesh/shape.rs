//! The shapes of cells and how their corners are numbered.

use crate::geometry::Point;

/// The shape of a cell; corners are numbered as Gmsh does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CellShape {
    /// A point.
    Vertex,
    /// A segment.
    Line,
    /// A triangle, counter-clockwise.
    Triangle,
    /// A quadrangle, counter-clockwise.
    Quadrangle,
    /// A tetrahedron: corners 0, 1, 2 counter-clockwise seen from corner 3's far side, as in
    /// $(x_1 - x_0)\times(x_2 - x_0)\cdot(x_3 - x_0) > 0$.
    Tetrahedron,
    /// A hexahedron: the lower face around, then the upper one.
    Hexahedron,
    /// A prism: the lower triangle, then the upper one.
    Prism,
}

/// Corners of faces, unused entries repeat the first.
type Faces = &'static [&'static [usize]];

impl CellShape {
    /// Dimension of the cell.
    pub(crate) fn dimension(self) -> usize {
        match self {
            CellShape::Vertex => 0,
            CellShape::Line => 1,
            CellShape::Triangle | CellShape::Quadrangle => 2,
            _ => 3,
        }
    }

    /// Number of corners.
    pub(crate) fn corner_count(self) -> usize {
        match self {
            CellShape::Vertex => 1,
            CellShape::Line => 2,
            CellShape::Triangle => 3,
            CellShape::Quadrangle | CellShape::Tetrahedron => 4,
            CellShape::Prism => 6,
            CellShape::Hexahedron => 8,
        }
    }

    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            CellShape::Vertex => "point",
            CellShape::Line => "line",
            CellShape::Triangle => "triangle",
            CellShape::Quadrangle => "quadrangle",
            CellShape::Tetrahedron => "tetrahedron",
            CellShape::Hexahedron => "hexahedron",
            CellShape::Prism => "prism",
        }
    }

    /// Faces of one dimension less, their corners around, outward by the right hand; the sides of plane cells run
    /// counter-clockwise.
    pub(crate) fn faces(self) -> Faces {
        match self {
            CellShape::Vertex => &[],
            CellShape::Line => &[&[0], &[1]],
            CellShape::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
            CellShape::Quadrangle => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            CellShape::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            CellShape::Hexahedron => {
                &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
            }
            CellShape::Prism => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
        }
    }

    /// The neighbours of each corner along edges, right-handed.
    pub(crate) fn neighbours(self) -> &'static [&'static [usize]] {
        match self {
            CellShape::Vertex => &[&[]],
            CellShape::Line => &[&[1], &[0]],
            CellShape::Triangle => &[&[1, 2], &[2, 0], &[0, 1]],
            CellShape::Quadrangle => &[&[1, 3], &[2, 0], &[3, 1], &[0, 2]],
            CellShape::Tetrahedron => &[&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]],
            CellShape::Hexahedron => {
                &[&[1, 3, 4], &[2, 0, 5], &[3, 1, 6], &[0, 2, 7], &[7, 5, 0], &[4, 6, 1], &[5, 7, 2], &[6, 4, 3]]
            }
            CellShape::Prism => &[&[1, 2, 3], &[2, 0, 4], &[0, 1, 5], &[5, 4, 0], &[3, 5, 1], &[4, 3, 2]],
        }
    }

    /// Edges by their corners, the lower one first.
    pub(crate) fn edges(self) -> &'static [[usize; 2]] {
        match self {
            CellShape::Vertex => &[],
            CellShape::Line => &[[0, 1]],
            CellShape::Triangle => &[[0, 1], [1, 2], [0, 2]],
            CellShape::Quadrangle => &[[0, 1], [1, 2], [2, 3], [0, 3]],
            CellShape::Tetrahedron => &[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]],
            CellShape::Hexahedron => {
                &[[0, 1], [1, 2], [2, 3], [0, 3], [4, 5], [5, 6], [6, 7], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7]]
            }
            CellShape::Prism => &[[0, 1], [1, 2], [0, 2], [3, 4], [4, 5], [3, 5], [0, 3], [1, 4], [2, 5]],
        }
    }

    /// The corners of the mirrored cell, which has the opposite orientation.
    pub(crate) fn mirrored(self) -> &'static [usize] {
        match self {
            CellShape::Vertex => &[0],
            CellShape::Line => &[1, 0],
            CellShape::Triangle => &[0, 2, 1],
            CellShape::Quadrangle => &[0, 3, 2, 1],
            CellShape::Tetrahedron => &[0, 2, 1, 3],
            CellShape::Hexahedron => &[0, 3, 2, 1, 4, 7, 6, 5],
            CellShape::Prism => &[0, 2, 1, 3, 5, 4],
        }
    }
}

/// The parallelepiped of three vectors, the parallelogram of two.
pub(crate) fn spanned<const D: usize>(vectors: &[Point<D>]) -> f64 {
    let v = |k: usize, i: usize| vectors[k][i];
    match D {
        1 => v(0, 0),
        2 => v(0, 0) * v(1, 1) - v(0, 1) * v(1, 0),
        _ => {
            v(0, 0) * (v(1, 1) * v(2, 2) - v(1, 2) * v(2, 1))
                + v(0, 1) * (v(1, 2) * v(2, 0) - v(1, 0) * v(2, 2))
                + v(0, 2) * (v(1, 0) * v(2, 1) - v(1, 1) * v(2, 0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    const SOLIDS: [CellShape; 3] = [CellShape::Tetrahedron, CellShape::Hexahedron, CellShape::Prism];

    fn corners(shape: CellShape) -> Vec<Vec3> {
        let at = |x: &[[f64; 3]]| x.iter().map(|x| Vec3::from(*x)).collect();
        match shape {
            CellShape::Tetrahedron => at(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            CellShape::Prism => {
                at(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
            }
            _ => at(&[
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 1.0],
                [1.0, 1.0, 1.0],
                [0.0, 1.0, 1.0],
            ]),
        }
    }

    #[test]
    fn neighbours_are_right_handed_and_faces_point_outward() {
        for shape in SOLIDS {
            let x = corners(shape);
            let centre = x.iter().sum::<Vec3>() / x.len() as f64;
            for (corner, around) in shape.neighbours().iter().enumerate() {
                let ways: Vec<Vec3> = around.iter().map(|&n| x[n] - x[corner]).collect();
                assert!(spanned(&ways) > 0.0, "{shape:?} {corner}");
                for &other in *around {
                    let ends = [corner.min(other), corner.max(other)];
                    assert!(shape.edges().contains(&ends), "{shape:?} {ends:?}");
                }
            }
            for face in shape.faces() {
                let [a, b, c] = [0, 1, 2].map(|k| x[face[k]]);
                assert!((b - a).cross(&(c - a)).dot(&(a - centre)) > 0.0, "{shape:?} {face:?}");
            }
            let mirrored: Vec<Vec3> = shape.mirrored().iter().map(|&k| x[k]).collect();
            for (corner, around) in shape.neighbours().iter().enumerate() {
                let ways: Vec<Vec3> = around.iter().map(|&n| mirrored[n] - mirrored[corner]).collect();
                assert!(spanned(&ways) < 0.0, "{shape:?} {corner}");
            }
        }
    }
}
