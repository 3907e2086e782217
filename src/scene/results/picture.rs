//! Pictures of states: the contact surface of the body, coloured by a field.

use std::collections::{HashMap, HashSet};

use nalgebra::Matrix3;

use crate::error::Error;
use crate::geometry::Point;
use crate::mesh::CellShape;
use crate::output::{Picture, VtkCell};
use crate::solve::State;

use super::fields::vtk_cell;
use crate::scene::Problem;
use crate::tensor::von_mises;

/// A field of a state that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Field {
    /// The length of the displacement \[length\].
    Displacement,
    /// The largest principal stretch.
    LargestStretch,
    /// Von Mises' equivalent of the Cauchy stress \[stress\].
    MisesStress,
    /// The mean of the Cauchy stress, positive in tension \[stress\].
    MeanStress,
}

impl Field {
    /// What a bar of colours is labelled with.
    fn label(self) -> &'static str {
        match self {
            Field::Displacement => "displacement",
            Field::LargestStretch => "largest stretch",
            Field::MisesStress => "von Mises stress",
            Field::MeanStress => "mean stress",
        }
    }
}

impl<const D: usize> Problem<D> {
    /// A picture of a state: the body from outside in its current position, coloured by a field; volumes of a mesh that are
    /// rigid bodies are grey.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::scene::Field;
    /// # let scene = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, Rubber::neo_hookean(0.5, 1e3)?).hold((0, Side::Min));
    /// let problem = scene.discretize(&Scheme::default().particles([5, 3, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// # let directory = std::env::temp_dir().join("rkpm-pictures");
    /// problem.picture(path.last(), Field::LargestStretch)?.title("A bar").write(directory.join("bar.svg"))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn picture(&self, state: &State, field: Field) -> Result<Picture, Error> {
        let displacements = self.particle_displacements(state)?;
        let positions = &self.model().positions()[..displacements.len()];
        let mut current: Vec<Point<D>> = positions.iter().zip(&displacements).map(|(x, u)| x + u).collect();
        let mean = |stress: &Matrix3<f64>| stress.trace() / 3.0;
        let stresses = || Ok::<_, Error>(self.at_particles(&self.stresses(state)?));
        let mut values: Vec<f64> = match field {
            Field::Displacement => displacements.iter().map(|u| u.norm()).collect(),
            Field::LargestStretch => {
                let gradients = self.at_particles(&self.deformation_gradients(state)?);
                gradients.iter().map(|f| f.singular_values().max()).collect()
            }
            Field::MisesStress => stresses()?.iter().map(von_mises).collect(),
            Field::MeanStress => stresses()?.iter().map(mean).collect(),
        };
        let mut faces = contact_surface(&self.drawn_cells(), positions);
        for shape in self.rigid_shapes(state) {
            let (first, points) = (current.len(), shape.mesh.points());
            let mut own = contact_surface(&shape.cells, points);
            // What is bonded is inside.
            let place = |corners: &[usize], x: &[Point<D>]| {
                let mut place: Vec<[u64; 3]> = corners.iter().map(|&c| bits(&x[c])).collect();
                place.sort_unstable();
                place
            };
            let [bonded, rigid]: [HashSet<_>; 2] =
                [(&faces, positions), (&own, points)].map(|(all, x)| all.iter().map(|face| place(face, x)).collect());
            faces.retain(|face| face.iter().any(|&c| c >= positions.len()) || !rigid.contains(&place(face, positions)));
            own.retain(|face| !bonded.contains(&place(face, points)));
            faces.extend(own.into_iter().map(|face| face.into_iter().map(|corner| first + corner).collect()));
            current.extend(points.iter().zip(&shape.displacements).map(|(x, u)| x + u));
            values.resize(current.len(), f64::NAN);
        }
        let picture = Picture::new(&current, faces).coloured(field.label(), values);
        Ok(if D == 3 { picture.closed() } else { picture })
    }
}

/// Coordinates as they are stored.
fn bits<const D: usize>(x: &Point<D>) -> [u64; 3] {
    std::array::from_fn(|i| if i < D { x[i].to_bits() } else { 0 })
}

/// Faces that one cell alone has, outward; in the plane the cells themselves.
fn contact_surface<const D: usize>(cells: &[Vec<usize>], positions: &[Point<D>]) -> Vec<Vec<usize>> {
    let cells = cells.iter().map(|corners| vtk_cell(corners, positions));
    if D < 3 {
        return cells.map(|cell| cell.corners().to_vec()).filter(|corners| corners.len() > 2).collect();
    }
    let mut found: HashMap<Vec<usize>, (Vec<usize>, bool)> = HashMap::new();
    let mut order = Vec::new();
    for cell in cells {
        let shape = match cell {
            VtkCell::Tetrahedron(_) => CellShape::Tetrahedron,
            VtkCell::Wedge(_) => CellShape::Prism,
            VtkCell::Hexahedron(_) => CellShape::Hexahedron,
            _ => continue,
        };
        let corners = cell.corners();
        let centre = corners.iter().map(|&c| positions[c]).sum::<Point<D>>() / corners.len() as f64;
        for face in shape.faces() {
            let mut face: Vec<usize> = face.iter().map(|&k| corners[k]).collect();
            let mut key = face.clone();
            key.sort_unstable();
            let [a, b, c] = [0, 1, face.len() - 1].map(|k| positions[face[k]]);
            if crate::mesh::spanned(&[b - a, c - a, a - centre]) < 0.0 {
                face.reverse();
            }
            found.entry(key.clone()).and_modify(|(_, alone)| *alone = false).or_insert_with(|| {
                order.push(key);
                (face, true)
            });
        }
    }
    order.iter().filter_map(|key| found.get(key)).filter(|(_, alone)| *alone).map(|(face, _)| face.clone()).collect()
}
