//! What a file holds, as it is read.

use std::collections::HashMap;

use super::bytes::Bytes;
use crate::each::EachOf;
use crate::error::MeshError;
use crate::mesh::elements::{Content, Elements, Group};
use crate::mesh::shape::CellShape;

/// What was read so far.
#[derive(Default)]
pub(crate) struct Reading {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) numbers: Numbers,
    pub(super) elements: [Elements; 4],
    pub(super) has_elements: bool,
    /// Names of physical groups by dimension and number.
    pub(super) names: HashMap<(usize, i64), String>,
    /// Physical groups of geometric entities by dimension and number.
    pub(super) physical: HashMap<(usize, i64), Vec<i64>>,
    /// Places of the members of each group.
    pub(super) groups: Vec<((usize, i64), Vec<u32>)>,
    pub(super) group_of: HashMap<(usize, i64), usize>,
    pub(super) middles: HashMap<[u32; 2], [f64; 3]>,
}

/// Places of nodes by their numbers in the file.
#[derive(Default)]
pub(super) enum Numbers {
    #[default]
    None,
    /// By number, from the first one on.
    Dense { first: u64, places: Vec<u32> },
    /// Where numbers have wide gaps.
    Sparse(HashMap<u64, u32>),
}

/// No node has the number.
const NOWHERE: u32 = u32::MAX;

impl Numbers {
    /// Places of the nodes with these numbers.
    fn new(tags: &[u64]) -> Result<Self, MeshError> {
        let (first, last) = tags.iter().fold((u64::MAX, 0), |(low, high), &tag| (low.min(tag), high.max(tag)));
        if tags.is_empty() {
            return Ok(Numbers::None);
        }
        if (last - first) as usize / 2 < tags.len() {
            let mut places = vec![NOWHERE; (last - first) as usize + 1];
            for (place, &tag) in tags.iter().enumerate() {
                let slot = &mut places[(tag - first) as usize];
                ensure!(*slot == NOWHERE, MeshError::DuplicateNode { node: tag });
                *slot = place as u32;
            }
            return Ok(Numbers::Dense { first, places });
        }
        let mut places = HashMap::with_capacity(tags.len());
        for (place, &tag) in tags.iter().enumerate() {
            ensure!(places.insert(tag, place as u32).is_none(), MeshError::DuplicateNode { node: tag });
        }
        Ok(Numbers::Sparse(places))
    }

    #[inline]
    pub(super) fn place(&self, tag: u64) -> Option<u32> {
        match self {
            Numbers::None => None,
            Numbers::Dense { first, places } => {
                let place = *places.get(usize::try_from(tag.checked_sub(*first)?).ok()?)?;
                (place != NOWHERE).then_some(place)
            }
            Numbers::Sparse(places) => places.get(&tag).copied(),
        }
    }
}

/// Shape and number of nodes of an element by Gmsh's number; those of second order have more nodes than corners.
pub(super) fn kind(number: i64) -> Option<(CellShape, usize)> {
    Some(match number {
        1 => (CellShape::Line, 2),
        2 => (CellShape::Triangle, 3),
        3 => (CellShape::Quadrangle, 4),
        4 => (CellShape::Tetrahedron, 4),
        5 => (CellShape::Hexahedron, 8),
        6 => (CellShape::Prism, 6),
        8 => (CellShape::Line, 3),
        9 => (CellShape::Triangle, 6),
        10 => (CellShape::Quadrangle, 9),
        11 => (CellShape::Tetrahedron, 10),
        12 => (CellShape::Hexahedron, 27),
        13 => (CellShape::Prism, 18),
        15 => (CellShape::Vertex, 1),
        16 => (CellShape::Quadrangle, 8),
        17 => (CellShape::Hexahedron, 20),
        18 => (CellShape::Prism, 15),
        _ => return None,
    })
}

/// The edges in whose middles an element of second order has its further nodes, in Gmsh's order.
fn middles(shape: CellShape) -> &'static [[usize; 2]] {
    match shape {
        CellShape::Vertex => &[],
        CellShape::Line => &[[0, 1]],
        CellShape::Triangle => &[[0, 1], [1, 2], [2, 0]],
        CellShape::Quadrangle => &[[0, 1], [1, 2], [2, 3], [3, 0]],
        CellShape::Tetrahedron => &[[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]],
        CellShape::Prism => &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
        CellShape::Hexahedron => {
            &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]]
        }
    }
}

/// The refusal of a second list: numbers of one mesh name other nodes in another.
fn second(what: &str) -> MeshError {
    MeshError::Array {
        what: format!("the file has two lists of {what}"),
        remedy: "save each mesh to a file of its own, or merge them in Gmsh",
    }
}

/// How far the middle of an edge is off its chord, as a part of it, to be called curved.
const BENT: f64 = 1e-6;

impl Reading {
    /// Keeps the middles of an element's edges that are curved; `tags` are its nodes, corners first.
    pub(super) fn bend(&mut self, shape: CellShape, tags: &[u64]) {
        let corners = shape.corner_count();
        for (ends, &middle) in middles(shape).iter().zip(tags.iter().skip(corners)) {
            let place = |tag: u64| self.numbers.place(tag);
            let (Some(a), Some(b), Some(m)) = (place(tags[ends[0]]), place(tags[ends[1]]), place(middle)) else {
                continue;
            };
            let [x, y, z] = [a, b, m].each(|place| self.points[place as usize]);
            let (mut off, mut length) = (0.0, 0.0);
            for i in 0..3 {
                off += (z[i] - 0.5 * (x[i] + y[i])).powi(2);
                length += (x[i] - y[i]).powi(2);
            }
            if off > BENT * BENT * length {
                self.middles.insert([a.min(b), a.max(b)], z);
            }
        }
    }

    pub(super) fn names(&mut self, bytes: &mut Bytes<'_>) -> Result<(), MeshError> {
        bytes.enter("PhysicalNames");
        let count = bytes.text_integer()?;
        for _ in 0..count {
            let dimension = bytes.text_integer()?;
            let number = bytes.text_integer()?;
            let name = bytes.quoted()?;
            if let Ok(dimension) = usize::try_from(dimension) {
                self.names.insert((dimension, number), name);
            }
        }
        Ok(())
    }

    /// Takes the nodes and their numbers.
    pub(super) fn take_nodes(&mut self, tags: Vec<u64>, points: Vec<[f64; 3]>) -> Result<(), MeshError> {
        ensure!(self.points.is_empty(), second("nodes"));
        self.numbers = Numbers::new(&tags)?;
        self.points = points;
        Ok(())
    }

    /// Begins the list of elements.
    pub(super) fn begin_elements(&mut self) -> Result<(), MeshError> {
        ensure!(!self.has_elements, second("elements"));
        self.has_elements = true;
        Ok(())
    }

    /// The place of a group of members.
    pub(super) fn group(&mut self, dimension: usize, physical: i64) -> usize {
        // A negative number means that the elements are turned round.
        let key = (dimension, physical.saturating_abs());
        let next = self.groups.len();
        let place = *self.group_of.entry(key).or_insert(next);
        if place == next {
            self.groups.push((key, Vec::new()));
        }
        place
    }

    /// Adds an element by its corners' numbers; its place among those of its dimension.
    #[inline]
    pub(super) fn push(&mut self, element: u64, shape: CellShape, tags: &[u64]) -> Result<u32, MeshError> {
        let mut corners = [0u32; 8];
        for (corner, &tag) in corners.iter_mut().zip(tags) {
            *corner = self.numbers.place(tag).ok_or(MeshError::DanglingNode { element, node: tag })?;
        }
        let list = &mut self.elements[shape.dimension()];
        let place = list.len() as u32;
        list.push(shape, corners[..shape.corner_count()].iter().copied());
        Ok(place)
    }

    pub(super) fn finish(mut self) -> Result<Content, MeshError> {
        let mut groups: Vec<Group> = Vec::new();
        for ((dimension, number), mut members) in self.groups {
            members.sort_unstable();
            members.dedup();
            let name = self.names.get(&(dimension, number)).cloned().unwrap_or_else(|| number.to_string());
            // Two physical groups of one name are one.
            match groups.iter_mut().find(|group| group.dimension == dimension && group.name == name) {
                Some(group) => {
                    group.members.extend(members);
                    group.members.sort_unstable();
                    group.members.dedup();
                }
                None => groups.push(Group { name, dimension, members }),
            }
        }
        for list in &mut self.elements {
            list.shrink();
        }
        Ok(Content { points: self.points, elements: self.elements, groups, middles: self.middles })
    }
}
