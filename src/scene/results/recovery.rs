//! Stresses recovered at any point of the body, on its surface in equilibrium with the loads.

mod patch;
mod surface;

use std::sync::OnceLock;

use nalgebra::DVector;

use crate::assembly::{Model, Ranks};
use crate::boundary::Constraints;
use crate::each::{Each, list_of};
use crate::error::{ApproximationError, Error};
use crate::geometry::{Mat3, Point, Vec3, padded};
use crate::parallel::map_with;
use crate::shape::ShapeFunctions;
use crate::solve::State;
use crate::tensor;

use super::view::{BodyView, ProblemView};
use crate::scene::Problem;
use crate::scene::discretisation::discrete_body::SERIAL_BELOW;

/// Weight of the equations of equilibrium, in the body and on its surface, beside one of all data of a patch: polynomials of a patch as
/// wide as the body cannot meet both.
const EQUILIBRIUM: f64 = 3.0;

/// Weight of the highest terms of a patch that too few data determine, beside one of all data.
const RIDGE: f64 = 1e-8;

/// Cauchy stresses of a state, recovered from those at the integration points.
///
/// Around each particle, over the zones that see it, $\sigma$ is a tensor $\sigma_I(x)$ of quadratic polynomials of the current
/// position $x$: the least squares fit of
/// - the deviators at the integration points,
/// - the moments $\int\varphi_k\\,p$ of the zones' pressures (their values at points, where pressures are not projected),
/// - equilibrium, $\operatorname{div}\sigma + b/J = 0$ with hoops, and
/// - the tractions that are known on the surface, $\sigma\operatorname{cof}(F)N = T$ component by component: those of the loads,
///   none on free parts, nothing where a displacement is prescribed.
///
/// The last two weigh three times as much as the data, and what is left on the surface is added there. Between particles $\sigma(X) = \sum_I\Psi_I(X)\\,\sigma_I(x)$. Patches
/// beside a term that does not tell its [`force_densities`](crate::term::Term::force_densities) go without equilibrium.
/// Recovery from patches: O. C. Zienkiewicz and J. Z. Zhu, *Int. J. Numer. Meth. Engng* 33 (1992) 1331–1364; with
/// equilibrium: N.-E. Wiberg and F. Abdulwahab, *ibid.* 36 (1993) 2703–2724.
///
/// Each body has its own; parts that are bonded or tied to something have no traction that is known. In plane stress the polynomials are
/// those of the force per current length over the thickness at rest, $\lambda_3\sigma$, which is in equilibrium where the thickness
/// varies. Where ranks share the scene all of them ask for the same points in the same order.
pub struct StressField<'a, const D: usize> {
    bodies: Vec<BodyStress<'a>>,
}

/// The stresses of one body.
struct BodyStress<'a> {
    recovery: Recovery<'a>,
    fits: Vec<OnceLock<Option<Fit>>>,
    /// What the polynomials miss of the tractions, facet by facet.
    misses: Vec<OnceLock<Mat3>>,
}

impl<'a, const D: usize> StressField<'a, D> {
    /// The Cauchy stress $\sigma$ \[stress\] at a point $X$ of the body, of the first of several that hold it.
    ///
    /// # Errors
    /// Where the point lies outside the bodies by more than a tenth of a cell.
    pub fn at(&self, at: &Point<D>) -> Result<Mat3, Error> {
        let (own, psi) = self.seen(at)?;
        Ok(own.evaluate(&padded(at), &psi))
    }

    /// How uncertain the stress at a point $X$ is \[stress\]: $\sqrt{\sum_I|\Psi_I|\,|\sigma_I(x) - \sigma(X)|^2/\sum_I|\Psi_I|}$, by
    /// which the polynomials of patches differ there, and what they miss of the tractions that are known nearby. It is no bound; where it
    /// is a large part of the stress, displacements may be right, and more particles are needed for the stress.
    ///
    /// # Errors
    /// As [`at`](StressField::at).
    pub fn uncertainty(&self, at: &Point<D>) -> Result<f64, Error> {
        let (own, psi) = self.seen(at)?;
        Ok(own.uncertainty(&padded(at), &psi))
    }

    /// The first body that holds a point, and its functions there.
    fn seen(&self, at: &Point<D>) -> Result<(&BodyStress<'a>, ShapeFunctions<3>), Error> {
        let x = padded(at);
        let outside = || ApproximationError::Outside { at: at.as_slice().to_vec() };
        let holding = |strictly: bool| self.bodies.iter().find(|own| own.recovery.body.holds(&x, strictly));
        let own = holding(true).or_else(|| holding(false)).ok_or_else(outside)?;
        Ok((own, own.recovery.body.functions(&x)?))
    }

    /// The Cauchy stresses \[stress\] at all particles.
    ///
    /// # Errors
    /// Where a particle is not covered.
    pub fn at_particles(&self) -> Result<Vec<Mat3>, Error> {
        at_particles(&self.bodies)
    }
}

fn at_particles(bodies: &[BodyStress<'_>]) -> Result<Vec<Mat3>, Error> {
    let mut all = Vec::new();
    for body in bodies {
        all.append(&mut body.at_particles()?);
    }
    Ok(all)
}

impl ProblemView<'_> {
    /// The recovered Cauchy stresses of a state at all particles.
    pub(super) fn recovered_at_particles(&self, state: &State) -> Result<Vec<Mat3>, Error> {
        at_particles(&recovered(self, state)?)
    }
}

/// The recovered stresses of all bodies.
fn recovered<'a>(problem: &ProblemView<'a>, state: &'a State) -> Result<Vec<BodyStress<'a>>, Error> {
    state.check_lengths(problem.model, problem.equations)?;
    (0..problem.bodies.len()).map(|number| BodyStress::new(problem, number, state)).collect()
}

impl<'a> BodyStress<'a> {
    fn new(problem: &ProblemView<'a>, number: usize, state: &'a State) -> Result<Self, Error> {
        let recovery = Recovery::new(problem, number, state)?;
        let fits = recovery.clusters.mapped(|_| OnceLock::new());
        let misses = recovery.facets.mapped(|_| OnceLock::new());
        Ok(BodyStress { recovery, fits, misses })
    }

    fn at_particles(&self) -> Result<Vec<Mat3>, Error> {
        let Recovery { body, ranks, .. } = &self.recovery;
        let particles = body.nodes().len();
        let at = |(): &mut (), node: usize| -> Result<Mat3, Error> {
            Ok(self.evaluate(&body.particle(node), &body.values_at_node(node)?))
        };
        match ranks {
            // Ranks sum together, patch by patch.
            Some(_) => (0..particles).map(|node| at(&mut (), node)).collect(),
            None => map_with(particles, SERIAL_BELOW, || (), at).into_iter().collect(),
        }
    }

    fn fit(&self, node: u32) -> Option<&Fit> {
        self.fits[node as usize].get_or_init(|| self.recovery.fit(node as usize)).as_ref()
    }

    /// The polynomials between particles, and near the surface what they miss there.
    fn evaluate(&self, at: &Vec3, psi: &ShapeFunctions<3>) -> Mat3 {
        self.over_thickness(self.blend(at, psi) + self.missing(at, psi), psi)
    }

    /// How far patches differ, and what they miss of the tractions.
    fn uncertainty(&self, at: &Vec3, psi: &ShapeFunctions<3>) -> f64 {
        let mean = self.blend(at, psi);
        let (mut sum, mut total) = (0.0, 0.0);
        self.each(at, psi, &mut |value, stress| {
            sum += value.abs() * (stress - mean).norm_squared();
            total += value.abs();
        });
        let spread = if total > 1e-9 { (sum / total).sqrt() } else { 0.0 };
        let alone = self.over_thickness(Mat3::identity(), psi)[(0, 0)];
        (spread + self.missing(at, psi).norm()) * alone
    }

    /// What the polynomials miss of the tractions that are known nearby.
    fn missing(&self, at: &Vec3, psi: &ShapeFunctions<3>) -> Mat3 {
        let mut facets: Vec<u32> = Vec::new();
        for &node in &psi.nodes {
            facets.extend_from_slice(&self.recovery.facets_of[node as usize]);
        }
        facets.sort_unstable();
        facets.dedup();
        let (mut sum, mut total) = (Mat3::zeros(), 1.0);
        for facet in facets {
            let Facet { reference, owner, .. } = &self.recovery.facets[facet as usize];
            let reach = self.recovery.body.spacing(*owner as usize);
            let near = (reach / (at - reference).norm().max(1e-9 * reach) - 1.0).max(0.0);
            let weight = near.powi(4);
            if weight > 0.0 {
                sum += self.miss(facet) * weight;
                total += weight;
            }
        }
        sum / total
    }

    /// A force per current length of a sheet over its thickness.
    fn over_thickness(&self, stress: Mat3, psi: &ShapeFunctions<3>) -> Mat3 {
        if self.recovery.thickness.is_empty() {
            return stress;
        }
        let thickness: f64 =
            psi.nodes.pair_sum(&psi.values, |&node, value| value * self.recovery.thickness[node as usize]);
        stress / thickness
    }

    /// The smallest stress that brings the polynomials to the known tractions at a facet point.
    fn miss(&self, facet: u32) -> Mat3 {
        let miss = || {
            let Facet { reference, psi, area, traction, known, .. } = &self.recovery.facets[facet as usize];
            let missed = traction - self.blend(reference, psi) * area;
            // Δ = Σ λ_k (e_k ⊗ n + n ⊗ e_k) / 2 over the known components.
            let mut gram = Mat3::identity();
            for i in (0..3).filter(|&i| known[i]) {
                for j in (0..3).filter(|&j| known[j]) {
                    gram[(i, j)] = 0.5 * (f64::from(u8::from(i == j)) + area[i] * area[j]);
                }
            }
            let known = Vec3::from_fn(|i, _| if known[i] { missed[i] } else { 0.0 });
            let factors = tensor::inverse(&gram).map_or_else(Vec3::zeros, |inverse| inverse * known);
            (factors * area.transpose() + area * factors.transpose()) * 0.5
        };
        *self.misses[facet as usize].get_or_init(miss)
    }

    /// $\sum_I\Psi_I\,\sigma_I(x)$ over the particles that have a patch.
    fn blend(&self, at: &Vec3, psi: &ShapeFunctions<3>) -> Mat3 {
        let (mut stress, mut total) = (Mat3::zeros(), 0.0);
        self.each(at, psi, &mut |value, own| {
            stress += own * value;
            total += value;
        });
        if total.abs() > 1e-9 { stress / total } else { stress }
    }

    /// Visits $\Psi_I$ and $\sigma_I(x)$ of the particles that have a patch.
    fn each(&self, at: &Vec3, psi: &ShapeFunctions<3>, visit: &mut dyn FnMut(f64, Mat3)) {
        let x = self.recovery.moved(at, psi);
        for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
            let Some(fit) = self.fit(node) else { continue };
            let terms = terms(self.recovery.body.dim(), &fit.centre, &fit.scale, &x).values;
            let mut stress = Mat3::zeros();
            for (c, &(i, j)) in self.recovery.components.iter().enumerate() {
                let part = fit.coefficients.rows(c * terms.len(), terms.len());
                let sum: f64 = part.iter().zip(&terms).map(|(a, t)| a * t).sum();
                (stress[(i, j)], stress[(j, i)]) = (sum, sum);
            }
            visit(value, stress);
        }
    }
}

impl<const D: usize> Problem<D> {
    /// The Cauchy stress $\sigma$ \[stress\] at any point $X$ of the body, see [`StressField`]; for many points make the
    /// [`stress_field`](Problem::stress_field) once.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
    /// let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
    /// let problem = tube.discretize(&Scheme::default().particles([9]))?;
    /// let path = problem.run()?.completed()?;
    /// let bore = problem.stress(path.last(), &[6.0].into())?;
    /// assert!((bore[(0, 0)] + 0.46).abs() < 0.005);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// Where the point lies outside the body by more than a tenth of a cell; for a state of another problem.
    pub fn stress(&self, state: &State, at: &Point<D>) -> Result<Mat3, Error> {
        self.stress_field(state)?.at(at)
    }

    /// The Cauchy stresses of a state at all points of the body; polynomials are fitted where they are requested.
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn stress_field<'a>(&'a self, state: &'a State) -> Result<StressField<'a, D>, Error> {
        Ok(StressField { bodies: recovered(&self.view(), state)? })
    }
}

/// A facet point whose traction is known: $\sigma a = T$ in the components that are.
struct Facet {
    reference: Vec3,
    /// The particle nearest to it.
    owner: u32,
    psi: ShapeFunctions<3>,
    current: Vec3,
    weight: f64,
    /// $\operatorname{cof}(F)N$ of length 1.
    area: Vec3,
    traction: Vec3,
    known: [bool; 3],
}

/// Quadratic polynomials around a particle.
struct Fit {
    centre: Vec3,
    scale: Vec3,
    /// Component by component, as many as the basis has terms.
    coefficients: DVector<f64>,
}

/// What recovery reads of a state.
struct Recovery<'a> {
    model: &'a Model,
    equations: &'a Constraints,
    /// The number of bodies.
    bodies: usize,
    body: &'a dyn BodyView,
    ranks: Option<&'a dyn Ranks>,
    /// Of the body.
    displacement: &'a [f64],
    /// Thickness stretches at the particles of a sheet in plane stress, whose stresses are taken times them.
    thickness: Vec<f64>,
    /// Components that may be other than zero, hoops included.
    components: Vec<(usize, usize)>,
    stresses: Vec<Mat3>,
    current: Vec<Vec3>,
    jacobians: Vec<f64>,
    /// Body force $b/J$ per current volume at the integration points, where there is one.
    body_force: Option<Vec<Vec3>>,
    /// Clusters that see each particle.
    clusters: Vec<Vec<u32>>,
    facets: Vec<Facet>,
    facets_of: Vec<Vec<u32>>,
    /// Particles beside terms that keep their forces to themselves.
    obscure: Vec<bool>,
}

/// Values and first derivatives of the basis at a point.
struct Terms {
    values: Vec<f64>,
    slopes: Vec<Vec3>,
}

/// Number of terms of the quadratic basis.
fn length(dim: usize) -> usize {
    (dim + 1) * (dim + 2) / 2
}

/// The basis $1, \xi_i, \xi_i\xi_j$ of $\xi_i = (x_i - c_i)/s_i$ and its derivatives by $x$.
fn terms(dim: usize, centre: &Vec3, scale: &Vec3, at: &Vec3) -> Terms {
    let mut xi = [0.0; 3];
    for i in 0..dim {
        xi[i] = (at[i] - centre[i]) / scale[i];
    }
    let (mut values, mut slopes) = (Vec::with_capacity(length(dim)), Vec::with_capacity(length(dim)));
    values.push(1.0);
    slopes.push(Point::zeros());
    for i in 0..dim {
        values.push(xi[i]);
        let mut slope = Point::zeros();
        slope[i] = 1.0 / scale[i];
        slopes.push(slope);
    }
    for i in 0..dim {
        for j in i..dim {
            values.push(xi[i] * xi[j]);
            let mut slope = Point::zeros();
            slope[i] += xi[j] / scale[i];
            slope[j] += xi[i] / scale[j];
            slopes.push(slope);
        }
    }
    Terms { values, slopes }
}

impl<'a> Recovery<'a> {
    fn new(problem: &ProblemView<'a>, number: usize, state: &'a State) -> Result<Self, Error> {
        let (body, dim) = (problem.bodies[number], problem.dim);
        let (clusters_of, nodes) = (body.clusters(), body.nodes());
        let mut clusters = vec![Vec::new(); nodes.len()];
        for cluster in 0..clusters_of.count() {
            for &node in clusters_of.nodes(cluster) {
                clusters[node as usize - nodes.start].push(cluster as u32);
            }
        }
        let mut components = Vec::new();
        for i in 0..dim {
            for j in i..dim {
                components.push((i, j));
            }
        }
        let view = problem.model.at_own(state).view(number);
        let gradients = body.settled_gradients(view);
        // Of the body as it was given, its free expansion included.
        let volume = |(point, f): (usize, &Mat3)| f.determinant() / body.at_rest(point).determinant();
        let mut jacobians: Vec<f64> = gradients.iter().enumerate().map(volume).collect();
        let mut stresses = body.stresses(view);
        let mut thickness = Vec::new();
        if body.is_sheet() {
            let across = body.stretches_across(&gradients);
            stresses.iter_mut().zip(&across).for_each(|(stress, stretch)| *stress *= stretch[(0, 0)]);
            jacobians.iter_mut().zip(&across).for_each(|(j, stretch)| *j /= stretch[(0, 0)]);
            thickness = body.at_particles(&across, problem.model.ranks()).mapped(|mean| mean[(0, 0)]);
        } else {
            components.extend((dim..3).map(|k| (k, k)));
        }
        let places: Vec<Vec3> = list_of(stresses.len(), |point| body.point(point));
        let current = moved_in(body, state, &places)?;
        let mut recovery = Recovery {
            model: problem.model,
            equations: problem.equations,
            bodies: problem.bodies.len(),
            body,
            ranks: problem.model.ranks(),
            displacement: &state.displacement[nodes.start * dim..nodes.end * dim],
            thickness,
            components,
            stresses,
            current,
            jacobians,
            body_force: None,
            clusters,
            facets: Vec::new(),
            facets_of: vec![Vec::new(); nodes.len()],
            obscure: vec![false; nodes.len()],
        };
        recovery.look_at_surface(state)?;
        Ok(recovery)
    }

    /// Sums over the ranks, where there are several.
    fn total(&self, values: &mut [f64]) {
        if let Some(ranks) = self.ranks {
            ranks.sum(values);
        }
    }

    /// A node among all as the body counts it, if it is one of its.
    fn own(&self, node: usize) -> Option<usize> {
        let nodes = self.body.nodes();
        nodes.contains(&node).then(|| node - nodes.start)
    }

    /// The current position of a point.
    fn moved(&self, at: &Vec3, psi: &ShapeFunctions<3>) -> Vec3 {
        let (mut x, dim) = (*at, self.body.dim());
        for (&node, value) in psi.nodes.iter().zip(&psi.values) {
            for i in 0..dim {
                x[i] += value * self.displacement[node as usize * dim + i];
            }
        }
        x
    }
}

/// Current positions of points of a body.
fn moved_in(body: &dyn BodyView, state: &State, points: &[Vec3]) -> Result<Vec<Vec3>, Error> {
    let mut moved = points.to_vec();
    for (x, psi) in moved.iter_mut().zip(body.values_at(points)?) {
        *x += body.weighted(&psi, state);
    }
    Ok(moved)
}
