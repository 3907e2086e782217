//! What holds the neutral motions of a scene.

use crate::error::Error;
use crate::solve::State;

use crate::scene::discretisation::problem::Problem;

/// A motion of a body that no surface resists, and what the run has held it with.
#[derive(Debug, Clone, PartialEq)]
pub struct NeutralMotion {
    /// The name of the body.
    pub body: String,
    /// The moment that holds the body \[force·length\]: zero for exact shape functions, and small beside the forces of contact
    /// times the radius where the motion is neutral.
    pub moment: f64,
}

impl<const D: usize> Problem<D> {
    /// The neutral motions that are held: round bodies between surfaces without friction, whose material could run round. Empty
    /// where there are none.
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn neutral_motions(&self, state: &State) -> Result<Vec<NeutralMotion>, Error> {
        state.check_lengths(&self.model, &self.equations)?;
        let each = self.rolling.iter().map(|rolling| NeutralMotion {
            body: rolling.body.clone(),
            moment: 2.0 * rolling.radius * rolling.spring.force(&state.displacement),
        });
        Ok(each.collect())
    }
}
