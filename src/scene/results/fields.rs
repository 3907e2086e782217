//! Fields of a state: stresses, means at particles, and a grid for ParaView.

use crate::each::{Each, EachOf};
use crate::error::{ApproximationError, Error};
use crate::geometry::{Mat3, Point, Vec3, unit};
use crate::kinematics::Kinematics;
use crate::mesh::{CellShape, spanned};
use crate::output::{VtkCell, VtkField, VtkGrid};
use crate::quadrature::Points;
use crate::shape::ShapeFunctions;
use crate::solve::State;
use crate::table::ShapeTable;
use crate::tensor::{mean, von_mises};

use super::view::ProblemView;
use crate::scene::Problem;

impl<const D: usize> Problem<D> {
    /// Cauchy stresses $\sigma$ \[stress\] at the [`points`](Problem::points) of the bodies' tables.
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
    /// let path = problem.run()?.completed()?;
    /// for stress in problem.stresses(path.last())? {
    ///     assert!(stress[(1, 1)].abs() < 1e-9); // free sides
    ///     assert!(stress[(0, 0)] > 0.3); // the section gets thinner
    /// }
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError::OtherModel`](crate::error::SolveError::OtherModel) for a state of another problem.
    pub fn stresses(&self, state: &State) -> Result<Vec<Mat3>, Error> {
        self.view().stresses(state)
    }

    /// Values at the [`points`](Problem::points) $P$ of the bodies' tables, one for each, averaged at the particles, one for each,
    /// $$\bar v_I = \frac{\sum_P w_P\\,h_I(X_P)\\,v_P}{\sum_P w_P\\,h_I(X_P)},\qquad
    /// h_I(X) = \prod_i\max\Big(0, 1 - \frac{|X_i - X_{Ii}|}{d_{Ii}}\Big),$$
    /// $w_P$ the measures of the points, $d_{Ii}$ the distance of a particle to its neighbours along axis $i$
    /// ([`Cells::spacings`](crate::cells::Cells::spacings)), in the values' unit. Zeros for values of another table. Where ranks
    /// share the scene each of them gives the values at its own points, and all get the same means.
    pub fn at_particles(&self, values: &[Mat3]) -> Vec<Mat3> {
        self.view().at_particles(values)
    }

    /// Particles and the cells between them in their current positions as a grid for ParaView, with the displacement, the
    /// Cauchy stress recovered at the particles ([`stress_field`](Problem::stress_field); where ranks share the scene averaged there), its
    /// mean \[stress, positive in tension\] and von Mises' equivalent $\sqrt{\tfrac32\\,\mathbf s:\mathbf s}$. Volumes of a mesh that are
    /// rigid bodies stand beside them, without stresses. Cells have the number of their body, counted from 0, and the least ratio of a
    /// corner's current to its reference volume, that of its ring in bodies of revolution and with its thickness in sheets; it is negative
    /// where a cell has folded, and no number for facets of a surface and polygons, beside cells that have one.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// # let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    /// #     .hold((0, Side::Min)).prescribe((0, Side::Max), 0, 0.4);
    /// let problem = scene.discretize(&Scheme::default().particles([9, 5]))?;
    /// let path = problem.run()?.completed()?;
    /// # let directory = std::env::temp_dir().join("rkpm-fields");
    /// problem.vtk_grid(path.last())?.write(directory.join("pulled.vtu"))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn vtk_grid(&self, state: &State) -> Result<VtkGrid, Error> {
        self.check_length(state)?;
        self.view().grid(state)
    }

    /// The problem's shape functions $\Psi_I(X)$ and their gradients \[1/length\] at a point of the body, node by node
    /// (3.22): for quantities and couplings of one's own.
    ///
    /// # Errors
    /// Where the point is not covered.
    pub fn shape_functions(&self, at: &Point<D>) -> Result<ShapeFunctions<D>, ApproximationError> {
        let discrete_body = self.member_at(at).unwrap_or(self.first());
        Ok(discrete_body.approximation.shape_functions(at)?.shifted(discrete_body.nodes.start))
    }

    /// The problem's shape functions tabulated at points inside the body: what a [`Term`](crate::term::Term) or
    /// [`Integrand`](crate::term::Integrand) of one's own is made of, added by [`add`](Problem::add); of several bodies the
    /// functions are those of the one that the first point lies in.
    ///
    /// # Errors
    /// Where a point is not covered.
    pub fn tabulate(&self, points: &Points<D>, kinematics: &dyn Kinematics<D>) -> Result<ShapeTable<D>, Error> {
        let inside = points.positions.first().and_then(|at| self.member_at(at).ok());
        let discrete_body = inside.unwrap_or(self.first());
        let table = ShapeTable::new(&*discrete_body.approximation, points, kinematics)?;
        Ok(table.shifted(discrete_body.nodes.start, self.model.node_count()))
    }
}

impl ProblemView<'_> {
    fn grid(&self, state: &State) -> Result<VtkGrid, Error> {
        let dim = self.dim;
        let mut displacements = self.particle_displacements(state)?;
        let mut positions = self.positions();
        positions.truncate(displacements.len());
        let (mut cells, mut of_body, mut of_cell) = (Vec::new(), Vec::new(), Vec::new());
        let shifted = |first: usize, corners: &[usize], positions: &[Vec3]| {
            vtk_cell(dim, &corners.mapped(|corner| first + corner), positions)
        };
        for (number, body) in self.bodies.iter().enumerate() {
            let (first, end) = (body.nodes().start, body.nodes().end);
            cells.extend(body.drawn().iter().map(|corners| shifted(first, corners, &positions)));
            of_body.resize(end, number as f64);
            of_cell.resize(cells.len(), number as i64);
        }
        for (number, (shape, moved)) in self.rigid_shapes(state).enumerate() {
            let first = positions.len();
            positions.extend_from_slice(&shape.points);
            displacements.extend(moved);
            cells.extend(shape.cells.iter().map(|corners| shifted(first, corners, &positions)));
            of_body.resize(positions.len(), (self.bodies.len() + number) as f64);
            of_cell.resize(cells.len(), (self.bodies.len() + number) as i64);
        }
        let rigid_end = positions.len();
        let surfaces = self.drawn_surfaces(state)?;
        for surface in &surfaces {
            let first = positions.len();
            positions.extend_from_slice(&surface.points);
            displacements.extend_from_slice(&surface.displacements);
            cells.extend(surface.facets.iter().map(|facet| match facet[..] {
                [a, b, c] => VtkCell::Triangle([first + a, first + b, first + c]),
                _ => VtkCell::Polygon(facet.mapped(|corner| first + corner)),
            }));
            of_body.resize(positions.len(), surface.body as f64);
            of_cell.resize(cells.len(), surface.body as i64);
        }
        let current: Vec<Vec3> = positions.paired(&displacements, |x, u| x + u);
        let hoops = self.bodies.first().map_or(0, |body| body.hoops().len());
        let (places, across) = ([&positions[..], &current[..]], self.stretches_across(state));
        let ratios: Vec<Option<f64>> = cells.mapped(|cell| volume_ratio((dim, hoops), cell, places, &across));
        let mut stresses = match self.model.ranks() {
            None => self.recovered_at_particles(state)?,
            Some(_) => self.at_particles(&self.stresses(state)?),
        };
        let at_particles = stresses.clone();
        stresses.resize(rigid_end, Mat3::zeros());
        stresses.extend(surfaces.iter().flat_map(|surface| surface.interpolated(&at_particles)));
        let mut grid = VtkGrid::new(&current, cells);
        grid.point_data.extend([
            VtkField::vectors("displacement", &displacements),
            VtkField::tensors("Cauchy stress", &stresses),
            VtkField::scalars("mean stress", stresses.iter().map(mean)),
            VtkField::scalars("von Mises stress", stresses.iter().map(von_mises)),
        ]);
        if of_body.iter().any(|body| *body != 0.0) {
            grid.point_data.push(VtkField::scalars("body", of_body));
        }
        grid.cell_data.push(VtkField::integers("body", of_cell));
        if ratios.iter().any(Option::is_some) {
            let ratios = ratios.iter().map(|ratio| ratio.unwrap_or(f64::NAN));
            grid.cell_data.push(VtkField::scalars("volume ratio", ratios));
        }
        Ok(grid)
    }
}

/// The least ratio of the volumes that the edges at a corner of a cell span, at rest and now; none for shapes without such corners.
fn volume_ratio(
    (dim, hoops): (usize, usize),
    cell: &VtkCell,
    [positions, current]: [&[Vec3]; 2],
    across: &[f64],
) -> Option<f64> {
    let shape = shape_of(cell).filter(|shape| shape.dimension() == dim)?;
    let corners = cell.corners();
    let volume = |x: &[Vec3], corner: usize| {
        // Along axes that there are not, cells have the length 1.
        let mut ways = [0, 1, 2].each(unit);
        for (way, &other) in ways.iter_mut().zip(shape.neighbours()[corner]) {
            *way = x[corners[other]] - x[corners[corner]];
        }
        spanned(&ways)
    };
    // What the edges span goes around with the radius of its middle, along each hoop.
    let radius = |x: &[Vec3], corner: usize| {
        let around = &shape.neighbours()[corner][..dim];
        around.iter().fold(x[corners[corner]][0], |sum, &other| sum + x[corners[other]][0])
    };
    let ratio = |corner: usize| {
        let ring = (0..hoops).fold(1.0, |ring, _| ring * radius(current, corner) / radius(positions, corner));
        ring * across.get(corners[corner]).unwrap_or(&1.0) * volume(current, corner) / volume(positions, corner)
    };
    Some((0..corners.len()).map(ratio).fold(f64::INFINITY, f64::min))
}

/// The shape of the cells of meshes that one is drawn as.
pub(super) fn shape_of(cell: &VtkCell) -> Option<CellShape> {
    Some(match cell {
        VtkCell::Line(_) => CellShape::Line,
        VtkCell::Triangle(_) => CellShape::Triangle,
        VtkCell::Quad(_) => CellShape::Quadrangle,
        VtkCell::Tetrahedron(_) => CellShape::Tetrahedron,
        VtkCell::Wedge(_) => CellShape::Prism,
        VtkCell::Hexahedron(_) => CellShape::Hexahedron,
        _ => return None,
    })
}

/// A cell in VTK's order: around, where lattices count along their axes.
pub(crate) fn vtk_cell(dim: usize, corners: &[usize], positions: &[Vec3]) -> VtkCell {
    match (dim, corners) {
        (_, &[a]) => VtkCell::Vertex(a),
        (_, &[a, b]) => VtkCell::Line([a, b]),
        (2, &[a, b, c]) => VtkCell::Triangle([a, b, c]),
        (2, &[a, b, c, d]) => {
            // Twice the area from the diagonals: the order that crosses itself has less.
            let area = |from: [usize; 2], to: [usize; 2]| {
                let [p, q] = [positions[from[1]] - positions[from[0]], positions[to[1]] - positions[to[0]]];
                (p[0] * q[1] - p[1] * q[0]).abs()
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
