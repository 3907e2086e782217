//! Supports that cover the body, and the certificate of a discretisation's shape functions.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::basis::Polynomial;
use crate::cells::{Cells, Connections};
use crate::each::sum_of;
use crate::error::{ApproximationError, Error};
use crate::geometry::{Part, Point};
use crate::kernel::{CubicSpline, Kernel};
use crate::neighbours::Visibility;
use crate::parallel::map_with;
use crate::particles::Particles;
use crate::quadrature::Points;
use crate::shape::{Approximation, ReproducingKernel, Scratch, ShapeFunctions};
use crate::table::ShapeTable;

use super::discrete_body::{DiscreteBody, SERIAL_BELOW};
use super::unmeasured::Unmeasured;
use crate::scene::{Problem, Scheme};

/// Rounds after which supports are no longer raised: raising until all is well often does not end.
const ROUNDS: usize = 8;
/// What a round multiplies supports by; eight rounds treble them.
const RAISE: f64 = 1.15;
/// Reciprocal condition below which supports are raised: gradients have eight digits above (`docs/measurements/numbers.md`), and
/// points between those that are looked at are a little worse.
const SOUND: f64 = 1e-6;
/// Above this everywhere, a body is taken as covered without a closer look: the default stays above 1e-3.
const EASY: f64 = 1e-4;
/// Points per direction and cell of the closer look.
const DENSE: usize = 4;

/// How well a discretisation's shape functions are conditioned, at particles, in the middle of cells and on the boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certificate {
    /// Smallest reciprocal condition number of the moment matrix: gradients have eight digits above 1e-6.
    pub smallest_rcond: f64,
    /// Smallest number of particles that cover a point.
    pub cover: usize,
    /// $\max a_I\\,|\nabla\Psi_I|$ with the dilation $a_I$: of order one where functions do not oscillate.
    pub largest_slope: f64,
    /// Particles whose supports were raised to cover the body.
    pub raised: usize,
}

/// The functions of a scheme on particles.
pub(crate) type KernelFunctions<const D: usize> = ReproducingKernel<D, Arc<dyn Kernel>, Polynomial<D>>;

/// Shape functions of the particles, without a look at whether they cover the body.
pub(crate) fn approximation<const D: usize>(
    scheme: &Scheme,
    particles: Particles<D>,
) -> Result<KernelFunctions<D>, ApproximationError> {
    if let Some(value) = scheme.rcond_limit.filter(|limit| !(*limit >= 0.0)) {
        return Err(ApproximationError::Function {
            what: "the limit of the reciprocal condition number",
            value,
            at: "every point".to_string(),
            remedy: "give a small number, such as 1e-8",
        });
    }
    let kernel = scheme.kernel.clone().unwrap_or_else(|| Arc::new(CubicSpline));
    let approximation = ReproducingKernel::new(particles, kernel, Polynomial::new(scheme.order))?;
    Ok(match scheme.rcond_limit {
        Some(limit) => approximation.with_rcond_limit(limit),
        None => approximation,
    })
}

/// Middles and outward normals of boundary facets; none where a body has no boundary.
pub(crate) fn facets<const D: usize>(cells: &dyn Cells<D>) -> Vec<(Point<D>, Point<D>)> {
    let Ok(points) = cells.facet_points(&Part::Whole, 1, 1) else { return Vec::new() };
    points.positions.into_iter().zip(points.normals).collect()
}

/// What points see of particles near the slots of a body; none where it has no slots within reach of a support.
pub(crate) fn visibility<const D: usize>(
    particles: &Particles<D>,
    cells: &dyn Cells<D>,
    facets: &[(Point<D>, Point<D>)],
    connections: impl FnOnce() -> Option<Connections<D>>,
) -> Option<Visibility<D>> {
    let spacings = (0..particles.positions().len()).map(|particle| cells.spacings(particle));
    Visibility::new(particles, spacings, facets, connections)
}

/// Particles, middles of cells and points on the boundary: the places where scattered supports fail first.
fn places<const D: usize>(cells: &dyn Cells<D>, order: u8) -> Result<Vec<Point<D>>, Error> {
    let mut places = cells.positions().to_vec();
    places.extend(cells.gauss(1)?.positions);
    // Those of the default rule, where weak constraint equations and sub-cells ask for them.
    let per_direction = 2 + usize::from(order > 1);
    // Facets of meshes in space are divided in two at most.
    places.extend(cells.facet_points(&Part::Whole, per_direction.min(2), per_direction)?.positions);
    Ok(places)
}

/// Places that are not covered, or where the reciprocal condition is below a limit.
fn failing<const D: usize>(approximation: &KernelFunctions<D>, places: &[Point<D>], limit: f64) -> Vec<Point<D>> {
    let fails =
        map_with(places.len(), SERIAL_BELOW, <(Scratch, ShapeFunctions<D>)>::default, |(scratch, psi), place| {
            approximation.evaluate_values(&places[place], scratch, psi).is_err() || psi.rcond < limit
        });
    places.iter().zip(&fails).filter(|(_, fails)| **fails).map(|(x, _)| *x).collect()
}

/// Shape functions whose supports are raised around points that they don't cover, at most [`ROUNDS`] times; what is
/// uncovered after that is refused where it is tabulated. Also the number of particles raised.
pub(crate) fn covering<const D: usize>(
    scheme: &Scheme,
    particles: Particles<D>,
    cells: &dyn Cells<D>,
) -> Result<(KernelFunctions<D>, usize), Error> {
    let facets = facets(cells);
    // Found once, where any are asked for: wider supports do not change them.
    let connections = OnceCell::new();
    let connected = || connections.get_or_init(|| cells.connections()).clone();
    let seen = visibility(&particles, cells, &facets, connected);
    let mut approximation = approximation(scheme, particles)?.seeing(seen);
    let mut places = places(cells, scheme.order)?;
    // Where nothing is near the limit at these, nothing is beyond it in between.
    if failing(&approximation, &places, EASY).is_empty() {
        return Ok((approximation, 0));
    }
    places.extend(cells.gauss(DENSE)?.positions);
    let mut raised = vec![false; approximation.particles().positions().len()];
    let mut failed = failing(&approximation, &places, SOUND);
    for _ in 0..ROUNDS {
        if failed.is_empty() {
            break;
        }
        let old = approximation.particles();
        let mut supports = old.supports().to_vec();
        let mut wider = vec![false; supports.len()];
        for (particle, support) in supports.iter_mut().enumerate() {
            let reach = support.half_widths() * 2.0;
            let near = |x: &Point<D>| {
                let offset = x - old.positions()[particle];
                (0..D).all(|i| offset[i].abs() < reach[i])
            };
            if failed.iter().any(near) {
                *support = support.scaled(RAISE);
                (wider[particle], raised[particle]) = (true, true);
            }
        }
        let particles = Particles::new(old.positions().to_vec(), supports)?;
        let seen = visibility(&particles, cells, &facets, connected);
        approximation = self::approximation(scheme, particles)?.seeing(seen);
        // Elsewhere functions are what they were.
        let reached = |x: &&Point<D>| approximation.covering(x).any(|particle| wider[particle as usize]);
        let looked_at: Vec<Point<D>> = places.iter().filter(reached).copied().collect();
        failed.retain(|x| !reached(&x));
        failed.extend(failing(&approximation, &looked_at, SOUND));
    }
    Ok((approximation, raised.iter().filter(|r| **r).count()))
}

impl<const D: usize> Problem<D> {
    /// The certificate of the shape functions: conditioning, cover, slopes.
    ///
    /// # Errors
    /// Where a point is not covered.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let disk = Region::new(Outline::circle("rim", [0.0, 0.0], 1.0))?;
    /// let scene = Scene::new(disk, PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?);
    /// let certificate = scene.discretize(&Scheme::default().spacing(0.2))?.certificate()?;
    /// assert!(certificate.smallest_rcond > 1e-3 && certificate.cover >= 4 && certificate.largest_slope < 6.0);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn certificate(&self) -> Result<Certificate, Error> {
        let mut whole = Certificate { smallest_rcond: f64::INFINITY, cover: usize::MAX, largest_slope: 0.0, raised: 0 };
        for discrete_body in &self.discrete_bodies {
            let own = discrete_body.certificate()?;
            whole.smallest_rcond = whole.smallest_rcond.min(own.smallest_rcond);
            whole.cover = whole.cover.min(own.cover);
            whole.largest_slope = whole.largest_slope.max(own.largest_slope);
            whole.raised += own.raised;
        }
        Ok(whole)
    }
}

impl<const D: usize> DiscreteBody<D> {
    fn certificate(&self) -> Result<Certificate, Error> {
        let positions = places(&*self.cells, 1)?;
        let count = positions.len();
        let points =
            Points { positions, weights: vec![1.0; count], normals: Vec::new(), groups: (0..=count).collect() };
        let table = ShapeTable::new(&*self.approximation, &points, &Unmeasured)?;
        let (mut cover, mut largest_slope) = (usize::MAX, 0.0f64);
        for point in 0..table.point_count() {
            let (nodes, gradients) = (table.nodes(point), table.gradients(point));
            cover = cover.min(nodes.len());
            for (a, &node) in nodes.iter().enumerate() {
                let slope = sum_of(D, |i| gradients[i * nodes.len() + a].powi(2)).sqrt();
                let dilation = self.dilations.get(node as usize).copied().unwrap_or(f64::NAN);
                largest_slope = largest_slope.max(dilation * slope);
            }
        }
        Ok(Certificate { smallest_rcond: table.smallest_rcond(), cover, largest_slope, raised: self.raised })
    }
}
