//! Runs that are led by a displacement.

use crate::error::{ApproximationError, BoundaryError, Error};
use crate::geometry::Point;
use crate::solve::{Deflection, EquilibriumPath, Functional, Observer};

use super::Problem;

impl<const D: usize> Problem<D> {
    /// A displacement component at a point of the body as a functional \[length\]: what a displacement-controlled run prescribes,
    /// $q = \sum_I \Psi_I(X)\\,d_{Ii}$.
    ///
    /// # Errors
    /// Where the point lies outside the body, or the component does not exist.
    pub fn deflection(&self, at: &Point<D>, component: usize) -> Result<Deflection, Error> {
        if component >= D {
            let what = format!("deflection at {:?}", at.as_slice());
            return Err(BoundaryError::Component { what, component, dimension: D }.into());
        }
        if !self.cells.contains(at) {
            return Err(ApproximationError::Outside { at: at.as_slice().to_vec() }.into());
        }
        let psi = self.shape_functions(at)?;
        let mut weights = vec![0.0; self.model.unknowns()];
        for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
            weights[node as usize * D + component] = value;
        }
        Ok(Deflection { weights })
    }

    /// Runs the problem so that a functional takes each target in turn, the load factor being what it takes, from the
    /// state at rest: through limit points and past load factor 1.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// # let disk = Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?)
    /// #     .prescribe((0, Side::Min), 0, 0.0).hold((0, Side::Max)).pressure((1, Side::Min), 0.1);
    /// let problem = disk.discretize(&Scheme::default().particles([11, 2]))?;
    /// let centre = problem.deflection(&[0.0, 0.0].into(), 1)?;
    /// let path = problem.run_controlled(&centre, &[1.0, 3.0, 5.0], &mut ())?.completed()?; // cm
    /// assert!((problem.displacement(path.last(), &[0.0, 0.0].into())?[1] - 5.0).abs() < 1e-9);
    /// println!("{} MPa", 0.1 * path.last().load);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Analysis::run_controlled`](crate::solve::Analysis::run_controlled).
    pub fn run_controlled(
        &self,
        functional: &dyn Functional,
        targets: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        self.analysis.run_controlled(&self.model, &self.rows, self.at_rest(), functional, targets, observer)
    }
}
