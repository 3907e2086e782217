//! Parts of a mesh as meshes of their own.

use std::collections::HashMap;

use crate::each::Each;
use crate::error::MeshError;
use crate::geometry::padded;

use super::elements::{Content, Elements, Group};
use super::shape::CellShape;
use super::{Mesh, face_key};

impl<const D: usize> Mesh<D> {
    /// A body alone: the cells of a named group with the faces, edges and points on them, and their groups. The nodes keep
    /// their order. Faces that it shares with another body are named by that body: `mount.body("rubber")?` has a face
    /// "insert" where the insert is bonded.
    ///
    /// # Errors
    /// Where no group of cells has the name.
    pub fn body(&self, name: &str) -> Result<Mesh<D>, MeshError> {
        let group = self.group(D, name).ok_or_else(|| self.missing("body", name, D..=D))?;
        self.of_cells(&group.members)
    }

    /// The mesh without some bodies. Faces that others share with one of them are named by it.
    ///
    /// # Errors
    /// Where no group of cells has one of the names, and where no cell is left.
    pub(crate) fn without(&self, names: &[&str]) -> Result<Mesh<D>, MeshError> {
        let mut kept = vec![true; self.cell_count()];
        for name in names {
            let group = self.group(D, name).ok_or_else(|| self.missing("body", name, D..=D))?;
            group.members.iter().for_each(|&member| kept[member as usize] = false);
        }
        let members: Vec<u32> = (0..kept.len() as u32).filter(|&cell| kept[cell as usize]).collect();
        self.of_cells(&members)
    }

    /// The mesh of some cells.
    fn of_cells(&self, chosen: &[u32]) -> Result<Mesh<D>, MeshError> {
        let all = &self.elements[D];
        let mut place = HashMap::with_capacity(chosen.len());
        let mut cells = Elements::default();
        // Faces that one cell of the body alone has.
        let mut boundary_faces: HashMap<[u32; 4], Vec<u32>> = HashMap::new();
        for &member in chosen {
            place.insert(member, cells.len() as u32);
            cells.push(all.shape(member as usize), all.corners(member as usize).iter().copied());
            for corners in self.faces_of(member as usize) {
                let key = face_key(&corners);
                if boundary_faces.remove(&key).is_none() {
                    boundary_faces.insert(key, corners);
                }
            }
        }
        let mut elements: [Elements; 4] = self.elements.clone();
        let mut groups = self.groups.clone();
        for other in self.groups.iter().filter(|other| other.dimension == D) {
            let mut members = Vec::new();
            for &member in other.members.iter().filter(|member| !place.contains_key(member)) {
                for corners in self.faces_of(member as usize) {
                    let Some(corners) = boundary_faces.get(&face_key(&corners)) else { continue };
                    members.push(elements[D - 1].len() as u32);
                    let shape = match (D, corners.len()) {
                        (2, _) => CellShape::Line,
                        (_, 3) => CellShape::Triangle,
                        _ => CellShape::Quadrangle,
                    };
                    elements[D - 1].push(shape, corners.iter().copied());
                }
            }
            if self.group(D - 1, &other.name).is_none() {
                groups.push(Group { name: other.name.clone(), dimension: D - 1, members });
            }
        }
        elements[D] = cells;
        for group in groups.iter_mut().filter(|group| group.dimension == D) {
            group.members = group.members.iter().filter_map(|m| place.get(m).copied()).collect();
        }
        let points = self.points.mapped(|x| padded::<D, 3>(x).into());
        let middles = self.curved.iter().map(|(ends, x)| (*ends, padded::<D, 3>(x).into())).collect();
        Self::assemble(Content { points, elements, groups, middles })
    }
}

/// Triangles, and names with some of them.
type NamedTriangles = (Vec<[u32; 3]>, Vec<(String, Vec<u32>)>);

impl Mesh<3> {
    /// Triangles of the faces that belong to one cell alone, quadrangles cut in two, and those of each group of faces.
    pub(crate) fn surface(&self) -> NamedTriangles {
        let mut owners: HashMap<[u32; 4], usize> = HashMap::new();
        for cell in 0..self.cell_count() {
            for face in self.faces_of(cell) {
                *owners.entry(face_key(&face)).or_default() += 1;
            }
        }
        let mut triangles = Vec::new();
        let mut of_face: HashMap<[u32; 4], std::ops::Range<u32>> = HashMap::new();
        for cell in 0..self.cell_count() {
            for face in self.faces_of(cell).filter(|face| owners.get(&face_key(face)) == Some(&1)) {
                let first = triangles.len() as u32;
                triangles.extend((2..face.len()).map(|k| [face[0], face[k - 1], face[k]]));
                of_face.insert(face_key(&face), first..triangles.len() as u32);
            }
        }
        let mut named = Vec::new();
        for name in self.groups(2) {
            let mut members: Vec<u32> = Vec::new();
            for face in self.members(2, name) {
                if let Some(own) = of_face.get(&face_key(face)) {
                    members.extend(own.clone());
                }
            }
            if !members.is_empty() {
                named.push((name.to_string(), members));
            }
        }
        (triangles, named)
    }
}
