//! Local refinement where a corner asks for it.

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::cells::{Cells, Refined};
use crate::error::{Error, GeometryError};
use crate::geometry::Point;
use crate::scene::{Problem, Scene, Scheme};

use super::answer::{Answer, Budget, Level, Tolerance};
use super::nested::{Against, Course, check, follow, join, judge, solve};
use super::progress::{Limits, Progress};
use super::sides::THIN;

/// Share of the summed squared indicators that the refined macro cells carry (Dörfler's bulk criterion).
const BULK: f64 = 0.5;
/// Cells along the shortest side of the first lattice; the others have in proportion, so that cells are nearly square.
const FIRST: f64 = 4.0;
/// Models are compared with the last one of at most this part of their unknowns: neighbours in the sequence differ
/// too little to tell their error.
const COARSER: f64 = 0.5;
/// Assumed order of convergence in $N^{-1/2}$: between the first that bare corners allow and the second of linear functions
/// that refined ones come near.
const ORDER: f64 = 1.75;
/// An estimate falls at most with this power of $N^{-1/2}$: models refined in the right places gain more than evenly spaced
/// ones, whose second order is the steepest.
const STEEPEST: f64 = 2.5;
/// Errors are taken to be no less than this part of the uneven gradients over the strains: cells that no model has cut make
/// errors that differences of models don't show.
const SHARE: f64 = 0.5;
/// The same for bases of higher order, whose gradients are more uneven for their errors.
const SHARE_OF_HIGHER_ORDERS: f64 = 0.3;

impl Scene<2> {
    /// Solves the scene within a tolerance on macro cells that are refined one by one where the gradient asks for
    /// it, by request: never chosen by itself, since thin bodies need other cells.
    ///
    /// The marker is the distance of the gradients from their own average over neighbouring sub-cells,
    /// $\eta_z^2 = \int_z |\nabla u - \overline{\nabla u}|^2\\,\mathrm d\Omega$; the macro cells $z$ with the largest
    /// ones that sum to half of all are cut into four, neighbours so that they differ by one halving at most, none to
    /// less than 1/16 of the coarsest. The estimate is that of [`solve_within_by`](Scene::solve_within_by) against the
    /// last model $l$ of at most half the unknowns $N$, with an order between those of bare corners and of smooth
    /// solutions, and at least what the indicators say by themselves,
    /// $$e_k = \max\Big(\frac{\delta_k}{f^{7/4} - 1},\ e_l\\,\max(f^{-5/2}, s_k),\ \sigma\\,\zeta_k\Big),\qquad
    /// f = \sqrt{N_k/N_l},\qquad
    /// \zeta_k = \frac{\sum_z\eta_{z,k}^2}{\int \mathbf F:\mathbf F - 3 - 2\ln J\\,\mathrm d\Omega}.$$
    /// $\zeta$ is the energy of the uneven gradients over that of the body, both those of one neo-Hookean rubber, so
    /// that any material will do; differences can't see what cells make that no model has cut. $\sigma$ is 0.5, for
    /// orders above 1 it is 0.3. In
    /// $s_k = \sum_{z\ \mathrm{stuck}}\eta_{z,k}^2 / \sum_z \eta_{z,l}^2$ stands the part of the indicators in macro
    /// cells that can't be cut any more: a corner that has reached the smallest spacing keeps its error, and the estimate
    /// says so.
    /// Tolerances below a few tenths of a per cent take more models than the default [`Budget`] allows.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]]; // mm
    /// let membrane = Scene::new(Quadrilateral { corners }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
    ///     .hold((0, Side::Min))
    ///     .traction((0, Side::Max), [0.0, 6.25]);
    /// let tip = Tolerance::of(Quantity::displacement([48.0, 60.0], 1), 0.01);
    /// let answer = membrane.solve_within_locally(&Scheme::default(), &tip, Budget::default())?;
    /// assert!(answer.reached() && (answer.values()[0] / 6.9355 - 1.0).abs() < 0.01);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`solve_within_by`](Scene::solve_within_by), and for thin bodies.
    pub fn solve_within_locally(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<2>,
        budget: Budget,
    ) -> Result<Answer<2>, Error> {
        self.solve_within_locally_watched(scheme, tolerance, budget, &mut ())
    }

    /// As [`solve_within_locally`](Scene::solve_within_locally), watched.
    ///
    /// # Errors
    /// As [`solve_within_locally`](Scene::solve_within_locally).
    pub fn solve_within_locally_watched(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<2>,
        budget: Budget,
        watch: &mut dyn Progress,
    ) -> Result<Answer<2>, Error> {
        check(tolerance)?;
        let mut limits = Limits::new(watch);
        let needed = "a scene on a block or mapped block, no side of which is more than eight times another";
        let unsuited = GeometryError::Unsuited { what: "local refinement", needed };
        let (Some(lengths), Some(domain)) = (self.side_lengths(), self.domain()) else { return Err(unsuited.into()) };
        let shortest = lengths[0].min(lengths[1]);
        if lengths[0].max(lengths[1]) > THIN * shortest {
            return Err(unsuited.into());
        }
        let even = |length: f64| 2 * (0.5 * FIRST * length / shortest).round() as usize;
        let mut cells = Refined::new(domain, lengths.map(even))?;
        let mut answer: Option<Answer<2>> = None;
        let mut totals: Vec<f64> = Vec::new();
        let share = if scheme.order > 1 { SHARE_OF_HIGHER_ORDERS } else { SHARE };
        loop {
            let scene = self.with_cells(Arc::new(cells.clone()));
            let counts = [cells.positions().len()];
            limits.begin(false);
            let solved = solve(&scene, scheme.clone(), &counts, tolerance, answer.as_ref(), &mut limits);
            let (mut next, before) = match follow(solved, answer, &counts, &limits)? {
                Course::Onward(next, before) => (next, before),
                Course::Ended(best) => return Ok(best),
            };
            let gradients = next.problem.deformation_gradients(next.path.last());
            let mut indicators = indicators(&next.problem, &gradients, &cells);
            let total = indicators.iter().sum::<f64>();
            totals.push(total);
            let least = share * total / strain(&next.problem, &gradients);
            // What can't be refined must not fill the bulk.
            let mut stuck = 0.0;
            for (indicator, _) in indicators.iter_mut().zip(cells.refinable()).filter(|(_, refinable)| !refinable) {
                stuck += std::mem::take(indicator);
            }
            let against = compared(&before, next.levels[0].unknowns, &totals, stuck, least);
            join(&mut next, before, tolerance, against);
            let course = judge(next, tolerance, budget, &mut limits, |_| {
                let finer = cells.refined(&marked(&indicators));
                let finer = finer.map_err(|error| format!("the cells can't be refined: {error}"))?;
                if finer.positions().len() == cells.positions().len() {
                    return Err("the smallest spacing is reached: 1/16 of the coarsest".to_string());
                }
                Ok((2 * finer.positions().len(), finer))
            });
            match course {
                Course::Onward(next, finer) => {
                    answer = Some(next);
                    cells = finer;
                }
                Course::Ended(found) => return Ok(found),
            }
        }
    }
}

/// The last model that is coarse enough to compare with, else the first. Of its estimate as much is left at least as
/// its indicators have in macro cells that can't be refined.
fn compared(before: &[Level], unknowns: usize, totals: &[f64], stuck: f64, least: f64) -> Option<Against> {
    let most = COARSER * unknowns as f64;
    let place = before.iter().rposition(|other| other.unknowns as f64 <= most).unwrap_or(0);
    let factor = (unknowns as f64 / before.get(place)?.unknowns as f64).sqrt();
    let left = factor.powf(-STEEPEST).max(stuck / totals[place]).min(1.0);
    Some(Against { place, ratio: factor.powf(ORDER), left, least })
}

/// $\eta_z^2$ of each macro cell.
fn indicators(problem: &Problem<2>, gradients: &[Matrix3<f64>], cells: &Refined) -> Vec<f64> {
    let weights = problem.body().table().weights();
    let macros = cells.macro_count();
    // Clusters of the body are macro cells of four cells, or single ones; each cell has the points nearest to its middle.
    let middles: Vec<Point<2>> = (0..cells.cell_count())
        .map(|cell| cells.corners(cell).iter().map(|&corner| cells.positions()[corner]).sum::<Point<2>>() * 0.25)
        .collect();
    let table = problem.body().table();
    let mut macro_of = vec![0; gradients.len()];
    let clusters = table.clusters().len();
    for cluster in 0..clusters {
        macro_of[table.clusters().points(cluster)].fill(cluster * macros / clusters);
    }
    let cell_of = |point: usize| {
        let away = |cell: &usize| (middles[*cell] - table.positions()[point]).norm_squared();
        let own = 4 * macro_of[point]..4 * macro_of[point] + 4;
        own.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or_default()
    };
    // The recovered gradient at a particle: the mean over all sub-cells of the cells around it.
    let mut sums = vec![(0.0, Matrix3::<f64>::zeros()); cells.positions().len()];
    for (point, (f, w)) in gradients.iter().zip(weights).enumerate() {
        for corner in cells.corners(cell_of(point)) {
            sums[corner].0 += w;
            sums[corner].1 += f * *w;
        }
    }
    let mut eta = vec![0.0; macros];
    for (point, (f, w)) in gradients.iter().zip(weights).enumerate() {
        let at = &table.positions()[point];
        let corners = cells.corners(cell_of(point));
        // Nearer corners count more.
        let (mut total, mut mean) = (0.0, Matrix3::<f64>::zeros());
        for corner in corners {
            let near = 1.0 / ((cells.positions()[corner] - at).norm_squared()).max(f64::MIN_POSITIVE);
            total += near;
            mean += sums[corner].1 * (near / sums[corner].0.max(f64::MIN_POSITIVE));
        }
        eta[macro_of[point]] += w * (f - mean / total).norm_squared();
    }
    eta
}

/// $\int \mathbf F:\mathbf F - 3 - 2\ln J\\,\mathrm d\Omega$: what indicators are compared with, nothing for a rigid motion.
fn strain(problem: &Problem<2>, gradients: &[Matrix3<f64>]) -> f64 {
    // In terms of H = F − 1, so that nothing cancels where strains are small.
    let density = |f: &Matrix3<f64>| {
        let h = f - Matrix3::identity();
        let minors = (h.trace().powi(2) - (h * h).trace()) / 2.0;
        h.norm_squared() + 2.0 * (h.trace() - (h.trace() + minors + h.determinant()).ln_1p())
    };
    gradients.iter().zip(problem.body().table().weights()).map(|(f, w)| w * density(f)).sum()
}

/// The largest indicators that sum to the bulk of all.
fn marked(indicators: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..indicators.len()).collect();
    order.sort_by(|&a, &b| indicators[b].total_cmp(&indicators[a]).then(a.cmp(&b)));
    let total: f64 = indicators.iter().sum();
    let mut sum = 0.0;
    let mut marked = Vec::new();
    for zone in order {
        if sum >= BULK * total && !marked.is_empty() {
            break;
        }
        sum += indicators[zone];
        marked.push(zone);
    }
    marked
}
