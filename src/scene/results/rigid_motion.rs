//! How rigid bodies move in a state.

use nalgebra::{Matrix3, Rotation3, SMatrix};

use crate::each::{Each, list_of};
use crate::error::{BoundaryError, Error};
use crate::geometry::{Point, all_padded, padded};
use crate::solve::State;

use crate::scene::discretisation::problem::Problem;

/// How a rigid body has moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion<const D: usize> {
    /// Where its middle was at rest \[length\].
    pub centre: Point<D>,
    /// The displacement of the middle \[length\].
    pub displacement: Point<D>,
    /// The rotation, a proper orthogonal matrix.
    pub rotation: SMatrix<f64, D, D>,
}

impl<const D: usize> RigidMotion<D> {
    /// The rotation vector \[rad\]: along the axis, as long as the angle, which is at most π; in the plane its third component
    /// alone.
    pub fn rotation_vector(&self) -> [f64; 3] {
        let whole = Matrix3::from_fn(|i, j| match i < D && j < D {
            true => self.rotation[(i, j)],
            false => f64::from(u8::from(i == j)),
        });
        Rotation3::from_matrix_unchecked(whole).scaled_axis().into()
    }
}

/// A volume of a mesh that is rigid, as it is drawn in a state.
pub(crate) struct RigidShape {
    pub points: Vec<Point<3>>,
    /// Corners in the order of [`Cells::corners`](crate::cells::Cells::corners).
    pub cells: Vec<Vec<usize>>,
    pub displacements: Vec<Point<3>>,
}

impl<const D: usize> Problem<D> {
    /// The volumes that are rigid bodies in a state.
    pub(crate) fn rigid_shapes(&self, state: &State) -> Vec<RigidShape> {
        let mut shapes = Vec::new();
        for frame in &self.frames {
            for mesh in &frame.shapes {
                let points = all_padded(mesh.points());
                let mut displacements = Vec::with_capacity(points.len());
                for x in mesh.points() {
                    displacements.push(padded(&frame.displacement(x, &state.displacement)));
                }
                let cells = list_of(mesh.cell_count(), |cell| mesh.lattice_corners(cell));
                shapes.push(RigidShape { points, cells, displacements });
            }
        }
        shapes
    }
}

impl<const D: usize> Problem<D> {
    /// How a rigid body of a name has moved in a state.
    ///
    /// # Errors
    /// Where no rigid body has the name, with those that there are; for a state of another problem.
    pub fn rigid_motion(&self, state: &State, name: &str) -> Result<RigidMotion<D>, Error> {
        self.check_length(state)?;
        let Some(frame) = self.frames.iter().find(|frame| frame.name == name) else {
            let known = self.frames.mapped(|frame| frame.name.as_str()).join("; ");
            return Err(BoundaryError::UnknownBody { requested: name.to_string(), known }.into());
        };
        let rotation = SMatrix::identity() + frame.gradient(&state.displacement);
        let displacement = frame.displacement(&frame.centre, &state.displacement);
        Ok(RigidMotion { centre: frame.centre, displacement, rotation })
    }

    /// The displacements of the frames of another problem at the nodes of those of this one.
    pub(crate) fn transfer_frames(&self, from: &Problem<D>, state: &State, guess: &mut State) {
        for frame in &self.frames {
            let Some(other) = from.frames.iter().find(|other| other.name == frame.name) else { continue };
            for (node, x) in frame.nodes().zip(frame.positions()) {
                let u = other.displacement(&x, &state.displacement);
                guess.displacement[node * D..(node + 1) * D].copy_from_slice(u.as_slice());
            }
        }
    }
}
