//! Fields of a state: stresses, means at particles, and a grid for ParaView.

use nalgebra::Matrix3;

use crate::compiled::compiled;
use crate::error::{ApproximationError, Error};
use crate::geometry::Point;
use crate::kinematics::Kinematics;
use crate::output::{VtkCell, VtkField, VtkGrid};
use crate::quadrature::Points;
use crate::shape::ShapeFunctions;
use crate::solve::State;
use crate::table::ShapeTable;
use crate::term::View;

use super::Problem;

impl<const D: usize> Problem<D> {
    /// Cauchy stresses $\sigma$ \[stress\] at the points of the body's table, whose positions are
    /// `problem.body.table().positions()`; none for a state of another problem.
    ///
    /// $$\sigma = \operatorname{dev}\big(J^{-1}\\,\mathbf P\\,\mathbf F^{\mathsf T}\big) + p\\,\mathbf 1$$
    /// with the [`pressures`](Problem::pressures) $p$ of the scheme: those that balance the loads. The volumetric law at a
    /// point's own $J$, as `material.response` has it, is as rough as locking makes it. Materials that can't be split give
    /// their stress as it is.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .prescribe((0, Side::Min), 0, 0.0)
    ///     .prescribe((1, Side::Min), 1, 0.0)
    ///     .traction((0, Side::Max), [0.3, 0.0]); // MPa
    /// let problem = scene.discretize(&Scheme::default().particles([9, 5]))?;
    /// let path = problem.run(&mut ())?.completed()?;
    /// for stress in problem.stresses(path.last()) {
    ///     assert!(stress[(1, 1)].abs() < 1e-9); // free sides
    ///     assert!(stress[(0, 0)] > 0.3); // the section gets thinner
    /// }
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn stresses(&self, state: &State) -> Vec<Matrix3<f64>> {
        compiled!(D: (problem: &Problem<D> = self; state: &State = state) -> Vec<Matrix3<f64>> {
            problem.cauchy_stresses(state)
        })
    }

    fn cauchy_stresses(&self, state: &State) -> Vec<Matrix3<f64>> {
        let gradients = self.deformation_gradients(state);
        let Some(condensed) = state.condensed.first() else { return Vec::new() };
        let view = View { displacement: &state.displacement, condensed, load: state.load };
        let pressures = self.pressures(state);
        let cauchy = |(point, f): (usize, &Matrix3<f64>)| {
            let stress = self.body.stress(point, f, view) * f.transpose() / f.determinant();
            match &pressures {
                Some(p) => stress + Matrix3::identity() * (p[point] - stress.trace() / 3.0),
                None => stress,
            }
        };
        gradients.iter().enumerate().map(cauchy).collect()
    }

    /// Values at the $P$ points of the body's table, one for each, averaged at the particles, one for each,
    /// $$\bar v_I = \frac{\sum_P w_P\\,h_I(X_P)\\,v_P}{\sum_P w_P\\,h_I(X_P)},\qquad
    /// h_I(X) = \prod_i\max\Big(0, 1 - \frac{|X_i - X_{Ii}|}{d_{Ii}}\Big),$$
    /// $w_P$ the measures of the points, $d_{Ii}$ the distance of a particle to its neighbours along axis $i$
    /// ([`Cells::spacings`](crate::cells::Cells::spacings)), in the values' unit. Zeros for values of another table.
    pub fn at_particles(&self, values: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
        let table = self.body.table();
        let particles = self.cells.positions();
        let spacings: Vec<Point<D>> = (0..particles.len()).map(|node| self.cells.spacings(node)).collect();
        let mut sums = vec![(0.0, Matrix3::zeros()); particles.len()];
        if values.len() == table.len() {
            for (point, value) in values.iter().enumerate() {
                for &node in table.nodes(point) {
                    let offset = particles[node as usize] - table.positions()[point];
                    let hat = |i: usize| (1.0 - offset[i].abs() / spacings[node as usize][i]).max(0.0);
                    let near: f64 = (0..D).map(hat).product();
                    if near > 0.0 {
                        let weight = near * table.weights()[point];
                        let (total, sum) = &mut sums[node as usize];
                        *total += weight;
                        *sum += value * weight;
                    }
                }
            }
        }
        sums.into_iter().map(|(total, sum)| if total > 0.0 { sum / total } else { sum }).collect()
    }

    /// Particles and the cells between them in their current positions as a grid for ParaView, with the displacement, the
    /// Cauchy stress averaged at the particles, its mean \[stress, positive in tension\] and von Mises' equivalent
    /// $\sqrt{\tfrac32\\,\mathbf s:\mathbf s}$.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// # let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    /// #     .hold((0, Side::Min)).prescribe((0, Side::Max), 0, 0.4);
    /// let problem = scene.discretize(&Scheme::default().particles([9, 5]))?;
    /// let path = problem.run(&mut ())?.completed()?;
    /// # let directory = std::env::temp_dir().join("rkpm-fields");
    /// problem.vtk_grid(path.last())?.write(directory.join("pulled.vtu"))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn vtk_grid(&self, state: &State) -> Result<VtkGrid, Error> {
        compiled!(D: (problem: &Problem<D> = self; state: &State = state) -> Result<VtkGrid, Error> {
            problem.grid(state)
        })
    }

    fn grid(&self, state: &State) -> Result<VtkGrid, Error> {
        let displacements = self.particle_displacements(state)?;
        let positions = self.cells.positions();
        let current: Vec<Point<D>> = positions.iter().zip(&displacements).map(|(x, u)| x + u).collect();
        let cells = self.cells.drawn().iter().map(|corners| vtk_cell(corners, positions)).collect();
        let stresses = self.at_particles(&self.stresses(state));
        let mean = |stress: &Matrix3<f64>| stress.trace() / 3.0;
        let mises = |stress: &Matrix3<f64>| (1.5f64).sqrt() * (stress - Matrix3::identity() * mean(stress)).norm();
        let mut grid = VtkGrid::new(&current, cells);
        grid.point_data.extend([
            VtkField::vectors("displacement", &displacements),
            VtkField::tensors("Cauchy stress", &stresses),
            VtkField::scalars("mean stress", stresses.iter().map(mean)),
            VtkField::scalars("von Mises stress", stresses.iter().map(mises)),
        ]);
        Ok(grid)
    }

    /// The problem's shape functions $\Psi_I(X)$ and their gradients \[1/length\] at a point of the body, node by node
    /// (3.22): for quantities and couplings of one's own.
    ///
    /// # Errors
    /// Where the point is not covered.
    pub fn shape_functions(&self, at: &Point<D>) -> Result<ShapeFunctions<D>, ApproximationError> {
        self.approximation.shape_functions_at(at)
    }

    /// The problem's shape functions tabulated at points inside the body: what a [`Term`](crate::term::Term) or
    /// [`Integrand`](crate::term::Integrand) of one's own is made of, added to `problem.model`.
    ///
    /// # Errors
    /// Where a point is not covered.
    pub fn tabulate(&self, points: &Points<D>, kinematics: &dyn Kinematics<D>) -> Result<ShapeTable<D>, Error> {
        self.approximation.tabulate(points, kinematics)
    }
}

/// A cell in VTK's order: around, where lattices count along their axes.
pub(super) fn vtk_cell<const D: usize>(corners: &[usize], positions: &[Point<D>]) -> VtkCell {
    match (D, corners) {
        (_, &[a]) => VtkCell::Vertex(a),
        (_, &[a, b]) => VtkCell::Line([a, b]),
        (2, &[a, b, c]) => VtkCell::Triangle([a, b, c]),
        (2, &[a, b, c, d]) => {
            // Twice the area from the diagonals: the order that crosses itself has less.
            let area = |from: [usize; 2], to: [usize; 2]| {
                let [p, q] = [positions[from[1]] - positions[from[0]], positions[to[1]] - positions[to[0]]];
                (p[0] * q[D - 1] - p[D - 1] * q[0]).abs()
            };
            let around = area([a, c], [b, d]) >= area([a, d], [b, c]);
            VtkCell::Quad(if around { [a, b, c, d] } else { [a, b, d, c] })
        }
        (3, &[a, b, c, d]) => VtkCell::Tetrahedron([a, b, c, d]),
        (3, &[a, b, c, d, e, f, g, h]) => VtkCell::Hexahedron([a, b, d, c, e, f, h, g]),
        (3, &[a, b, c, d, e, f]) => VtkCell::Wedge([a, c, b, d, f, e]),
        _ => VtkCell::Polygon(corners.to_vec()),
    }
}
