//! The faces between the cells of a mesh, and its boundary in pieces.

use std::collections::{HashMap, HashSet};

use crate::cells::pieces::{FLAT, Facet, smooth};
use crate::each::{Each, EachOf, IntoEach, point_of};
use crate::error::{GeometryError, MeshError};
use crate::geometry::{Part, Point, Vec3, padded};
use crate::mesh::{Mesh, face_key};
use crate::order;

/// No cell beyond a face, no corner in a place.
pub(super) const NONE: u32 = u32::MAX;

/// Faces of all cells, each stored once.
#[derive(Debug, Clone)]
pub(super) struct Faces {
    /// Corners, outward of the first cell beside; unused places hold [`NONE`].
    corners: Vec<[u32; 4]>,
    beside: Vec<[u32; 2]>,
    /// Faces of each cell in the order of its shape.
    of_cells: Vec<u32>,
    starts: Vec<u32>,
    /// First facet of each face: one at each of its corners.
    facets: Vec<u32>,
    pub pieces: Vec<Piece>,
}

/// A part of the boundary without edges inside, all of it with the same names.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub names: Vec<String>,
    pub faces: Vec<u32>,
    /// Whether its faces have different normals.
    pub curved: bool,
    /// Particles on its rim that another curved piece has: those carry its trace functions.
    pub lent: HashSet<u32>,
}

impl Faces {
    pub(crate) fn new<const D: usize>(mesh: &Mesh<D>) -> Result<Self, MeshError> {
        let mut faces = Faces {
            corners: Vec::new(),
            beside: Vec::new(),
            of_cells: Vec::new(),
            starts: vec![0],
            facets: vec![0],
            pieces: Vec::new(),
        };
        let mut known: HashMap<[u32; 4], u32> = HashMap::with_capacity(mesh.cell_count() * 3);
        for cell in 0..mesh.cell_count() {
            let (shape, corners) = mesh.cell(cell);
            for face in shape.faces() {
                let next = faces.corners.len() as u32;
                let number = *known.entry(face_key(&face.mapped(|&k| corners[k]))).or_insert(next);
                if number == next {
                    let mut around = [NONE; 4];
                    for (place, &k) in around.iter_mut().zip(*face) {
                        *place = corners[k];
                    }
                    faces.corners.push(around);
                    faces.beside.push([cell as u32, NONE]);
                    faces.facets.push(faces.facets[number as usize] + face.len() as u32);
                } else {
                    let beside = &mut faces.beside[number as usize];
                    ensure!(
                        beside[1] == NONE,
                        MeshError::Array {
                            what: format!("cells {}, {} and {cell} share a face", beside[0], beside[1]),
                            remedy: "remove the one that lies upon the others"
                        }
                    );
                    beside[1] = cell as u32;
                }
                faces.of_cells.push(number);
            }
            faces.starts.push(faces.of_cells.len() as u32);
        }
        faces.pieces = faces.boundary_pieces(mesh, &known);
        Ok(faces)
    }

    /// Number of facets on faces: one at each corner of each.
    pub(crate) fn facet_count(&self) -> usize {
        self.facets.last().map_or(0, |end| *end as usize)
    }

    /// Face `side` of a cell.
    pub(crate) fn of(&self, cell: usize, side: usize) -> usize {
        self.of_cells[self.starts[cell] as usize + side] as usize
    }

    /// Cells on both sides; on the boundary the second is [`NONE`].
    pub(crate) fn beside(&self, face: usize) -> [u32; 2] {
        self.beside[face]
    }

    pub(crate) fn corners(&self, face: usize) -> &[u32] {
        let count = (self.facets[face + 1] - self.facets[face]) as usize;
        &self.corners[face][..count]
    }

    /// The facet of a face at one of its corners.
    pub(crate) fn facet(&self, face: usize, corner: u32) -> usize {
        let place = self.corners(face).iter().position(|c| *c == corner).unwrap_or(0);
        self.facets[face] as usize + place
    }

    /// Faces on the boundary.
    pub(crate) fn boundary(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.beside.len()).filter(|&face| self.beside[face][1] == NONE)
    }

    /// Pieces of a part, or of the whole boundary.
    pub(crate) fn pieces_of(&self, part: &Part) -> Result<Vec<&Piece>, GeometryError> {
        let found: Vec<&Piece> = match part {
            Part::Whole => self.pieces.iter().collect(),
            Part::Named(name) => self.pieces.iter().filter(|piece| piece.names.contains(name)).collect(),
            Part::Face { .. } => Vec::new(),
        };
        if found.is_empty() {
            let mut names: Vec<&str> = self.pieces.iter().flat_map(|piece| &piece.names).map(String::as_str).collect();
            names.sort_unstable();
            names.dedup();
            return Err(part.unknown(&names, "no named parts (physical groups in Gmsh)"));
        }
        Ok(found)
    }

    /// Unit normal of a face, outward of the first cell beside it.
    pub(crate) fn normal<const D: usize>(&self, points: &[Point<D>], face: usize) -> Point<D> {
        self.area(points, face).normalize()
    }

    /// Area of a face, length in the plane.
    pub(crate) fn measure<const D: usize>(&self, points: &[Point<D>], face: usize) -> f64 {
        self.area(points, face).norm()
    }

    /// The normal of a face as long as its measure.
    fn area<const D: usize>(&self, points: &[Point<D>], face: usize) -> Point<D> {
        let corners = self.corners(face);
        let x = |k: usize| points[corners[k] as usize];
        if D == 2 {
            let along = x(1) - x(0);
            return point_of::<D>(|i| if i == 0 { along[1] } else { -along[0] });
        }
        let [p, q] = match corners.len() {
            3 => [x(1) - x(0), x(2) - x(0)],
            // The mean normal of a quadrangle is that of its diagonals.
            _ => [x(2) - x(0), x(3) - x(1)],
        };
        let [p, q] = [p, q].each(|v| Vec3::from_fn(|i, _| v[i]));
        let area = p.cross(&q) * 0.5;
        point_of::<D>(|i| area[i])
    }

    /// Connected faces of the boundary with the same names and without edges between them.
    fn boundary_pieces<const D: usize>(&self, mesh: &Mesh<D>, known: &HashMap<[u32; 4], u32>) -> Vec<Piece> {
        let mut normals = vec![Point::zeros(); self.corners.len()];
        let mut warped = vec![false; self.corners.len()];
        for face in self.boundary() {
            let normal = self.normal(mesh.points(), face);
            let corners = self.corners(face);
            for &corner in &corners[1..] {
                let direction = mesh.points()[corner as usize] - mesh.points()[corners[0] as usize];
                warped[face] |= direction.dot(&normal).abs() > FLAT * direction.norm();
            }
            normals[face] = padded(&normal);
        }
        let (names, named) = self.names(mesh, known);
        let faces: Vec<usize> = self.boundary().collect();
        let facets = faces.mapped(|&face| Facet {
            corners: self.corners(face).to_vec(),
            normal: normals[face],
            warped: warped[face],
        });
        let found = smooth(D, &facets, &|a, b| named[faces[a]] == named[faces[b]]);
        let mut pieces = found.into_mapped(|(own, curved)| {
            let names = named[faces[own[0] as usize]].mapped(|&number| names[number as usize].to_string());
            Piece { names, faces: own.mapped(|&facet| faces[facet as usize] as u32), curved, lent: HashSet::new() }
        });
        self.lend(&mut pieces);
        pieces
    }

    /// The names of groups, and the numbers of those that each face has.
    fn names<'a, const D: usize>(
        &self,
        mesh: &'a Mesh<D>,
        known: &HashMap<[u32; 4], u32>,
    ) -> (Vec<&'a str>, Vec<Vec<u32>>) {
        let mut names: Vec<&str> = mesh.groups(D - 1).collect();
        let mut named: Vec<Vec<u32>> = vec![Vec::new(); self.corners.len()];
        for (number, name) in names.iter().enumerate() {
            for corners in mesh.members(D - 1, name) {
                if let Some(&face) = known.get(&face_key(corners)) {
                    named[face as usize].push(number as u32);
                }
            }
        }
        // A body's name stands for its faces where no face has it.
        for name in mesh.groups(D) {
            if names.contains(&name) {
                continue;
            }
            let number = names.len() as u32;
            names.push(name);
            for cell in mesh.member_cells(name) {
                for side in 0..mesh.cell(cell).0.faces().len() {
                    named[self.of(cell, side)].push(number);
                }
            }
        }
        (names, named)
    }

    /// Orders pieces and says which particles of each belong to one before.
    fn lend(&self, pieces: &mut [Piece]) {
        // Curved pieces come first, whose trace functions must stay where they are; then small ones: where all of a piece's particles
        // lie on its rim, others must not have claimed them before.
        let rank = |piece: &Piece| (!piece.curved, piece.faces.len());
        order::sort(pieces, &|a, b| rank(a).cmp(&rank(b)));
        let mut taken: HashSet<u32> = HashSet::new();
        for piece in pieces.iter_mut().filter(|piece| piece.curved) {
            let mut own: Vec<u32> = piece.faces.iter().flat_map(|&face| self.corners(face as usize)).copied().collect();
            own.sort_unstable();
            own.dedup();
            piece.lent = own.iter().copied().filter(|particle| taken.contains(particle)).collect();
            taken.extend(own);
        }
    }
}
