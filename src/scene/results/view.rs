//! Problems and their bodies as results see them, whatever their dimension.

use std::ops::Range;

use crate::assembly::{Model, Ranks};
use crate::boundary::Constraints;
use crate::each::{Each, IntoEach, list_of};
use crate::error::{ApproximationError, Error};
use crate::geometry::{Mat3, Point, Vec3, all_padded, cut, padded};
use crate::material::Material;
use crate::parallel::map_with;
use crate::scene::Problem;
use crate::scene::discretisation::discrete_body::{DiscreteBody, SERIAL_BELOW};
use crate::scene::discretisation::facet_rule::Facets;
use crate::scene::discretisation::frame::{RigidFrame, RigidShape};
use crate::shape::{FiniteElements, Scratch, ShapeFunctions};
use crate::solve::State;
use crate::table::Clusters;
use crate::term::View;

/// For each point of a boundary the particles whose trace functions are nonzero there, with their values.
pub(crate) type Traces = Vec<Vec<(u32, f64)>>;

/// Points on the surface of a body.
pub(crate) struct SurfaceRule {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub weights: Vec<f64>,
    /// The particles whose equations over the surface would prescribe each point, where there are trace functions.
    pub traces: Option<Traces>,
}

impl SurfaceRule {
    /// Particles of the body whose functions act at a point, by trace functions where there are some.
    pub(super) fn owners(&self, point: usize, psi: &ShapeFunctions<3>) -> Vec<usize> {
        if let Some(traces) = &self.traces {
            return traces[point].mapped(|&(node, _)| node as usize);
        }
        let seen = psi.nodes.iter().zip(&psi.values).filter(|(_, value)| value.abs() > 1e-9);
        seen.map(|(&node, _)| node as usize).collect()
    }
}

/// What results ask of a body. Places and vectors have three components, of which those beyond its dimension are zero; nodes of functions
/// are counted within the body.
pub(crate) trait BodyView: Send + Sync {
    fn dim(&self) -> usize;
    fn name(&self) -> &str;
    fn nodes(&self) -> Range<usize>;
    fn material(&self) -> &dyn Material;
    fn is_sheet(&self) -> bool;
    /// The stretch of free expansion at a place.
    fn expands(&self, at: &Vec3) -> f64;
    fn facets(&self) -> Facets;

    /// What the body's table says of its points.
    fn clusters(&self) -> &Clusters;
    fn hoops(&self) -> &'static [usize];
    fn weights(&self) -> &[f64];
    fn point(&self, point: usize) -> Vec3;
    fn seen_by(&self, point: usize) -> &[u32];
    fn zone_functions(&self, point: usize) -> &[f64];
    fn at_rest(&self, point: usize) -> Mat3;
    /// Of the kinematics alone, linear in the displacement.
    fn displacement_gradient(&self, point: usize, displacement: &[f64]) -> Mat3;
    fn deformation_gradient(&self, point: usize, displacement: &[f64]) -> Mat3;
    /// In a sheet with the thickness that its history leaves.
    fn deformation_in(&self, point: usize, view: View<'_>) -> Mat3;
    fn nominal_stress(&self, point: usize, f: &Mat3, view: View<'_>) -> Mat3;
    fn pressures(&self, view: View<'_>) -> Option<Vec<f64>>;
    /// Of the part that is proportional to the bulk modulus.
    fn bulk_pressures(&self, view: View<'_>) -> Option<Vec<f64>>;

    fn particle(&self, particle: usize) -> Vec3;
    fn spacings(&self, particle: usize) -> Vec3;
    /// Up to rounding, or a tenth of a cell.
    fn holds(&self, at: &Vec3, strictly: bool) -> bool;
    fn drawn(&self) -> Vec<Vec<usize>>;
    fn drawn_surface(&self) -> Option<(Vec<Vec3>, Vec<Vec<usize>>)>;
    /// Points on the whole surface, so many times as dense along each direction as loads have them.
    fn surface(&self, density: usize) -> Result<SurfaceRule, Error>;

    /// Values and gradients of its functions at a point.
    fn functions(&self, at: &Vec3) -> Result<ShapeFunctions<3>, ApproximationError>;
    /// Values of its functions at each of several points, or why there are none.
    fn each_at(&self, points: &[Vec3]) -> Vec<Result<ShapeFunctions<3>, ApproximationError>>;
    fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<3>, ApproximationError>;
    fn particle_displacements(&self, state: &State) -> Result<Vec<Vec3>, Error>;
}

impl<const D: usize> BodyView for DiscreteBody<D> {
    fn dim(&self) -> usize {
        D
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn nodes(&self) -> Range<usize> {
        self.nodes.clone()
    }

    fn material(&self) -> &dyn Material {
        &**self.body.material()
    }

    fn is_sheet(&self) -> bool {
        self.sheet.is_some()
    }

    fn expands(&self, at: &Vec3) -> f64 {
        self.expansion.as_ref().map_or(1.0, |stretch| stretch.at(&padded(at), 1.0))
    }

    fn facets(&self) -> Facets {
        self.facets
    }

    fn clusters(&self) -> &Clusters {
        self.body.table().clusters()
    }

    fn hoops(&self) -> &'static [usize] {
        self.body.table().hoop_components()
    }

    fn weights(&self) -> &[f64] {
        self.body.table().weights()
    }

    fn point(&self, point: usize) -> Vec3 {
        padded(&self.body.table().positions()[point])
    }

    fn seen_by(&self, point: usize) -> &[u32] {
        self.body.table().nodes(point)
    }

    fn zone_functions(&self, point: usize) -> &[f64] {
        self.body.zone_functions(point)
    }

    fn at_rest(&self, point: usize) -> Mat3 {
        self.body.table().at_rest(point)
    }

    fn displacement_gradient(&self, point: usize, displacement: &[f64]) -> Mat3 {
        self.body.table().displacement_gradient(point, displacement)
    }

    fn deformation_gradient(&self, point: usize, displacement: &[f64]) -> Mat3 {
        self.body.deformation_gradient(point, displacement)
    }

    fn deformation_in(&self, point: usize, view: View<'_>) -> Mat3 {
        self.body.deformation_in(point, view)
    }

    fn nominal_stress(&self, point: usize, f: &Mat3, view: View<'_>) -> Mat3 {
        self.body.stress(point, f, view)
    }

    fn pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        self.body.pressures(view)
    }

    fn bulk_pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        self.body.bulk_pressures(view)
    }

    fn particle(&self, particle: usize) -> Vec3 {
        padded(&self.cells.positions()[particle])
    }

    fn spacings(&self, particle: usize) -> Vec3 {
        padded(&self.cells.spacings(particle))
    }

    fn holds(&self, at: &Vec3, strictly: bool) -> bool {
        if strictly { self.cells.encloses(&padded(at)) } else { self.cells.contains(&padded(at)) }
    }

    fn drawn(&self) -> Vec<Vec<usize>> {
        self.cells.drawn()
    }

    fn drawn_surface(&self) -> Option<(Vec<Vec3>, Vec<Vec<usize>>)> {
        let (points, facets) = self.cells.drawn_surface()?;
        Some((all_padded(&points), facets))
    }

    fn surface(&self, density: usize) -> Result<SurfaceRule, Error> {
        let whole = &crate::geometry::Part::Whole;
        let (points, traces) = match self.facets {
            Facets::OfCells(rule) => {
                let cells = self.cells.facets(whole, density * rule.parts, rule.gauss)?;
                (cells.points, Some(cells.traces))
            }
            Facets::OfElements { order, gauss } => match self.cells.lattice() {
                Some(lattice) => {
                    (FiniteElements::new(lattice.clone(), order)?.boundary(whole, density * gauss)?.points, None)
                }
                None => (crate::quadrature::Points::empty(), None),
            },
        };
        let (positions, normals) = (all_padded(&points.positions), all_padded(&points.normals));
        Ok(SurfaceRule { positions, normals, weights: points.weights, traces })
    }

    fn functions(&self, at: &Vec3) -> Result<ShapeFunctions<3>, ApproximationError> {
        Ok(lifted(self.approximation.shape_functions(&padded(at))?))
    }

    fn each_at(&self, points: &[Vec3]) -> Vec<Result<ShapeFunctions<3>, ApproximationError>> {
        map_with(points.len(), SERIAL_BELOW, Scratch::default, |scratch, point| {
            let mut psi = ShapeFunctions::default();
            self.approximation.evaluate_values(&padded(&points[point]), scratch, &mut psi)?;
            Ok(lifted(psi))
        })
    }

    fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<3>, ApproximationError> {
        Ok(lifted(DiscreteBody::values_at_node(self, node)?))
    }

    fn particle_displacements(&self, state: &State) -> Result<Vec<Vec3>, Error> {
        let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
        let mut displacements = Vec::with_capacity(self.nodes.len());
        for particle in 0..self.nodes.len() {
            self.approximation.evaluate_at_node(particle, &mut scratch, &mut psi)?;
            displacements.push(padded(&self.weighted(&psi, state)));
        }
        Ok(displacements)
    }
}

fn lifted<const D: usize>(psi: ShapeFunctions<D>) -> ShapeFunctions<3> {
    let gradients = all_padded(&psi.gradients);
    ShapeFunctions { nodes: psi.nodes, values: psi.values, gradients, rcond: psi.rcond }
}

impl dyn BodyView + '_ {
    /// Values of its functions at points.
    pub(crate) fn values_at(&self, points: &[Vec3]) -> Result<Vec<ShapeFunctions<3>>, Error> {
        Ok(self.each_at(points).into_iter().collect::<Result<_, _>>()?)
    }

    /// Values of its functions at points of faces, each with what makes it of particles: points of a plane face that a curved body
    /// does not reach, in a bore say, move as these particles do.
    #[cfg(feature = "chart")]
    pub(super) fn values_on(
        &self,
        points: &[Vec3],
        weights: &[Vec<(usize, f64)>],
    ) -> Result<Vec<ShapeFunctions<3>>, Error> {
        let mut all = Vec::with_capacity(points.len());
        for (found, weights) in self.each_at(points).into_iter().zip(weights) {
            all.push(match found {
                Err(ApproximationError::Outside { .. }) => self.joined(weights)?,
                found => found?,
            });
        }
        Ok(all)
    }

    /// The functions of several particles, weighted.
    #[cfg(feature = "chart")]
    fn joined(&self, weights: &[(usize, f64)]) -> Result<ShapeFunctions<3>, ApproximationError> {
        let mut sum: std::collections::BTreeMap<u32, f64> = Default::default();
        for &(particle, weight) in weights {
            let psi = self.values_at_node(particle)?;
            for (node, value) in psi.nodes.iter().zip(&psi.values) {
                *sum.entry(*node).or_default() += weight * value;
            }
        }
        let (nodes, values) = sum.into_iter().unzip();
        Ok(ShapeFunctions { nodes, values, rcond: 1.0, ..ShapeFunctions::default() })
    }

    /// $\sum_I \Psi_I d_I$.
    pub(super) fn weighted(&self, psi: &ShapeFunctions<3>, state: &State) -> Vec3 {
        psi.weighted(self.dim(), &state.displacement[self.nodes().start * self.dim()..])
    }

    /// The displacement $u$ and the deformation gradient $F$ at a point, whose functions are given, from the coefficients of the body.
    pub(super) fn moved(&self, at: &Vec3, psi: &ShapeFunctions<3>, coefficients: &[f64]) -> (Vec3, Mat3) {
        let (dim, mut u, mut f) = (self.dim(), Point::zeros(), Mat3::identity());
        for (&node, (value, gradient)) in psi.nodes.iter().zip(psi.values.iter().zip(&psi.gradients)) {
            let d = &coefficients[node as usize * dim..][..dim];
            for i in 0..dim {
                u[i] += value * d[i];
                for j in 0..dim {
                    f[(i, j)] += d[i] * gradient[j];
                }
            }
            for &k in self.hoops() {
                f[(k, k)] += d[0] * value / at[0];
            }
        }
        (u, f)
    }

    /// The largest coordinate of its particles.
    pub(super) fn size(&self) -> f64 {
        (0..self.nodes().len()).fold(0.0, |largest: f64, particle| largest.max(self.particle(particle).amax()))
    }

    /// The smallest distance from a particle to its neighbours along an axis \[length\].
    pub(super) fn spacing(&self, particle: usize) -> f64 {
        self.spacings(particle).as_slice()[..self.dim()].iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Deformation gradients at the points of the body's table, in a sheet with the thickness that its history leaves.
    pub(super) fn settled_gradients(&self, view: View<'_>) -> Vec<Mat3> {
        list_of(self.weights().len(), |point| self.deformation_in(point, view))
    }

    /// The stretch across a sheet at the points of its table, its free expansion included.
    pub(super) fn stretches_across(&self, gradients: &[Mat3]) -> Vec<Mat3> {
        let across = |(point, f): (usize, &Mat3)| Mat3::repeat(f[(2, 2)] / self.at_rest(point)[(2, 2)]);
        gradients.iter().enumerate().map(across).collect()
    }

    /// Cauchy stresses at the points of the body's table.
    pub(super) fn stresses(&self, view: View<'_>) -> Vec<Mat3> {
        let pressures = self.pressures(view);
        let mut stresses = self.settled_gradients(view);
        for (point, f) in stresses.iter_mut().enumerate() {
            let stress = self.nominal_stress(point, f, view) * f.transpose() / f.determinant();
            *f = match &pressures {
                Some(p) => stress + Mat3::identity() * (p[point] - stress.trace() / 3.0),
                None => stress,
            };
        }
        stresses
    }

    /// Values at the points of the body's table averaged at its particles; see
    /// [`Problem::at_particles`](crate::scene::Problem::at_particles).
    pub(super) fn at_particles(&self, values: &[Mat3], ranks: Option<&dyn Ranks>) -> Vec<Mat3> {
        let (nodes, dim) = (self.nodes(), self.dim());
        let spacings: Vec<Vec3> = list_of(nodes.len(), |particle| self.spacings(particle));
        let mut sums = vec![(0.0, Mat3::zeros()); nodes.len()];
        for (point, value) in values.iter().enumerate() {
            let (x, weight) = (self.point(point), self.weights()[point]);
            for &node in self.seen_by(point) {
                let particle = node as usize - nodes.start;
                let offset = self.particle(particle) - x;
                let mut near = 1.0;
                for i in 0..dim {
                    near *= (1.0 - offset[i].abs() / spacings[particle][i]).max(0.0);
                }
                if near > 0.0 {
                    let weight = near * weight;
                    let (total, sum) = &mut sums[particle];
                    *total += weight;
                    *sum += value * weight;
                }
            }
        }
        if let Some(ranks) = ranks {
            let mut all: Vec<f64> = Vec::with_capacity(10 * sums.len());
            for (total, sum) in &sums {
                all.push(*total);
                all.extend_from_slice(sum.as_slice());
            }
            ranks.sum(&mut all);
            for ((total, sum), all) in sums.iter_mut().zip(all.chunks_exact(10)) {
                (*total, *sum) = (all[0], Mat3::from_column_slice(&all[1..]));
            }
        }
        sums.into_mapped(|(total, sum)| if total > 0.0 { sum / total } else { sum })
    }
}

/// A problem as results see it.
#[derive(Clone)]
pub(crate) struct ProblemView<'a> {
    pub dim: usize,
    pub model: &'a Model,
    pub equations: &'a Constraints,
    pub bodies: Vec<&'a dyn BodyView>,
    pub frames: &'a [RigidFrame],
}

impl<const D: usize> Problem<D> {
    /// The problem as results see it.
    pub(crate) fn view(&self) -> ProblemView<'_> {
        ProblemView::of(&self.model, &self.equations, &self.discrete_bodies, &self.frames)
    }
}

impl<'a> ProblemView<'a> {
    /// Parts of a problem as results see them.
    pub(crate) fn of<const D: usize>(
        model: &'a Model,
        equations: &'a Constraints,
        discrete_bodies: &'a [DiscreteBody<D>],
        frames: &'a [RigidFrame],
    ) -> Self {
        let bodies = discrete_bodies.mapped(|body| body as &dyn BodyView);
        ProblemView { dim: D, model, equations, bodies, frames }
    }
}

impl ProblemView<'_> {
    /// Positions of all nodes.
    pub(super) fn positions(&self) -> Vec<Vec3> {
        self.model.points()
    }

    pub(super) fn position(&self, node: usize) -> Vec3 {
        self.model.point(node)
    }

    /// The volumes that are rigid bodies, with the displacements of their points in a state.
    pub(super) fn rigid_shapes(&self, state: &State) -> impl Iterator<Item = (&RigidShape, Vec<Vec3>)> {
        let moved = |frame: &RigidFrame, x: &Vec3| frame.displacement(x, &state.displacement);
        let all = self.frames.iter().flat_map(|frame| frame.shapes.iter().map(move |shape| (frame, shape)));
        all.map(move |(frame, shape)| (shape, shape.points.mapped(|x| moved(frame, x))))
    }

    /// Displacements at all particles.
    pub(crate) fn particle_displacements(&self, state: &State) -> Result<Vec<Vec3>, Error> {
        let mut all = Vec::with_capacity(self.model.node_count());
        for body in &self.bodies {
            all.append(&mut body.particle_displacements(state)?);
        }
        Ok(all)
    }

    /// Deformation gradients at the points of the bodies' tables.
    pub(crate) fn deformation_gradients(&self, state: &State) -> Vec<Mat3> {
        let (here, mut all) = (self.model.at_own(state), Vec::new());
        for (number, body) in self.bodies.iter().enumerate() {
            all.append(&mut body.settled_gradients(here.view(number)));
        }
        all
    }

    /// The stretch across the sheet at each particle; nothing where the bodies are no sheets.
    pub(super) fn stretches_across(&self, state: &State) -> Vec<f64> {
        let (here, mut across) = (self.model.at_own(state), Vec::new());
        for (number, body) in self.bodies.iter().enumerate().filter(|(_, body)| body.is_sheet()) {
            across.append(&mut body.stretches_across(&body.settled_gradients(here.view(number))));
        }
        if across.is_empty() { Vec::new() } else { self.at_particles(&across).mapped(|mean| mean[(0, 0)]) }
    }

    /// Pressures at the points of the bodies' tables; none where a law tells none.
    pub(crate) fn pressures(&self, state: &State) -> Option<Vec<f64>> {
        let mut all = Vec::new();
        for (number, body) in self.bodies.iter().enumerate() {
            all.append(&mut body.pressures(self.model.view(state, number)?)?);
        }
        Some(all)
    }

    /// Cauchy stresses at the points of the bodies' tables.
    pub(super) fn stresses(&self, state: &State) -> Result<Vec<Mat3>, Error> {
        let (here, mut stresses) = (self.model.at(state)?, Vec::new());
        for (number, body) in self.bodies.iter().enumerate() {
            stresses.append(&mut body.stresses(here.view(number)));
        }
        Ok(stresses)
    }

    /// See [`Problem::at_particles`](crate::scene::Problem::at_particles).
    pub(super) fn at_particles(&self, values: &[Mat3]) -> Vec<Mat3> {
        let mut means = Vec::with_capacity(self.model.node_count());
        let count: usize = self.bodies.iter().map(|body| body.weights().len()).sum();
        let mut first = 0;
        for body in &self.bodies {
            let end = first + body.weights().len();
            match values.get(first..end) {
                Some(own) if values.len() == count => means.append(&mut body.at_particles(own, self.model.ranks())),
                _ => means.resize(means.len() + body.nodes().len(), Mat3::zeros()),
            }
            first = end;
        }
        means
    }

    /// A place as long as the problem has dimensions.
    pub(super) fn cut(&self, at: &Vec3) -> Vec<f64> {
        cut(at, self.dim)
    }
}
