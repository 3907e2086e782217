//! How rigid bodies move in a state.

use nalgebra::{Rotation3, SMatrix, UnitQuaternion};

use crate::each::Each;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Mat3, Point, padded};
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
        let mut whole = Mat3::identity();
        whole.view_mut((0, 0), (D, D)).copy_from(&self.rotation);
        rotation_vector(&whole)
    }
}

/// The rotation vector of a matrix, by the quaternion: the trace alone tells neither small angles nor those near π.
pub(crate) fn rotation_vector(rotation: &Mat3) -> [f64; 3] {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).scaled_axis().into()
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
        let (displacement, rotation) = frame.motion(&state.displacement);
        let rotation = SMatrix::from_fn(|i, j| rotation[(i, j)]);
        Ok(RigidMotion { centre: padded(&frame.centre), displacement: padded(&displacement), rotation })
    }

    /// The displacements of the frames of another problem at the nodes of those of this one.
    pub(crate) fn transfer_frames(&self, from: &Problem<D>, state: &State, guess: &mut State) {
        for frame in &self.frames {
            let Some(other) = from.frames.iter().find(|other| other.name == frame.name) else { continue };
            for (node, x) in frame.nodes().zip(frame.positions()) {
                let u = other.displacement(&x, &state.displacement);
                guess.displacement[node * D..(node + 1) * D].copy_from_slice(&u.as_slice()[..D]);
            }
        }
    }
}
