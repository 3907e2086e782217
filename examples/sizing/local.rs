//! Local refinement: particles needed, as a user needs them and as one who knows the error would.

use std::collections::BTreeSet;
use std::error::Error;
use std::sync::Arc;

use crate::support::Summary;
use rkpm::cells::{Cells, Refined};
use rkpm::geometry::Domain;
use rkpm::prelude::*;
use rkpm::study::{Answer, Budget, Quantity, Tolerance};

use crate::{COOK, Case, Uniform, worst};

/// Size and quality of an answer in words.
fn described(answer: &Answer<2>, exact: &[f64]) -> String {
    format!(
        "{} with {} particles, bound {:.2} %, true {:.2} %, {:.0} ms",
        if answer.reached() { "reached" } else { "not reached" },
        answer.problem.model().unknowns() / 2,
        100.0 * answer.bound,
        100.0 * worst(answer.values(), exact),
        1e3 * answer.seconds()
    )
}

/// Particles needed for an error with local refinement over those evenly spaced: as a user needs them, in the answers for
/// that tolerance, and as one who knows the error would, each series credited with the worst error of all finer models.
pub fn compare(case: &Case<2>, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let error = |values: &[f64]| worst(values, &case.exact);
    // As many cells along both sides, or in proportion to them: a series each.
    let series = |sizes: &[[usize; 2]]| -> Result<Vec<(usize, f64)>, Box<dyn Error>> {
        let errors = sizes.iter().map(|&counts| {
            let problem = case.scene.discretize(&Scheme::default().particles(counts))?;
            let path = problem.run()?.completed()?;
            let values =
                case.requested.iter().map(|q| q.evaluate(&problem, path.last())).collect::<Result<Vec<_>, _>>()?;
            Ok((counts[0] * counts[1], error(&values)))
        });
        errors.collect()
    };
    let alike = series(&[5, 6, 7, 8, 9, 11, 13, 15, 17, 19, 21, 25, 29, 33, 41, 49, 57].map(|n| [n, n]))?;
    let square = series(&[2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 30, 36].map(|k| [3 * k / 2 + 1, k + 1]))?;
    // A tolerance beyond reach shows the whole sequence.
    let requested = Tolerance { error: 1e-6, quantities: case.requested.clone() };
    let sequence = |scheme: Scheme| -> Result<Vec<(usize, f64)>, Box<dyn Error>> {
        let answer = case.scene.solve_within_locally(&scheme, &requested, Budget::default())?;
        Ok(answer.levels.iter().map(|l| (l.unknowns / 2, error(&l.values[..case.exact.len()]))).collect())
    };
    let fine = sequence(Scheme::default())?;
    let quadratic = sequence(Scheme::default().order(2))?;
    for percent in [0.5, 0.3, 0.2] {
        let requested = Tolerance { error: 1e-2 * percent, quantities: case.requested.clone() };
        let evenly = case.scene.solve_within_by(&[Scheme::default()], &requested, Budget::default(), &mut ())?;
        let locally = case.scene.solve_within_locally(&Scheme::default(), &requested, Budget::default())?;
        println!(
            "answers for {percent} %: evenly {}, locally {}",
            described(&evenly, &case.exact),
            described(&locally, &case.exact)
        );
        if evenly.reached() && locally.reached() {
            let ratio = locally.problem.model().unknowns() as f64 / evenly.problem.model().unknowns() as f64;
            summary.note(format!("cook_local_answer_{percent}"), ratio)?;
            summary.note(format!("cook_local_answer_{percent}_error"), error(locally.values()))?;
        }
    }
    let needed = |series: &[(usize, f64)], tolerance: f64| {
        let first = series.iter().rposition(|(_, e)| *e > tolerance).map_or(0, |last| last + 1);
        series.get(first).map(|(particles, _)| *particles)
    };
    for tolerance in [0.5, 0.2, 0.1] {
        let within = 1e-2 * tolerance;
        let even = [&alike, &square].into_iter().filter_map(|series| needed(series, within)).min();
        if let (Some(l), Some(e)) = (needed(&fine, within), even) {
            println!("{tolerance} %: {l} particles locally refined, {e} evenly spaced");
            summary.note(format!("cook_local_{tolerance}"), l as f64 / e as f64)?;
            // Odd numbers of cells among them make the credit of the evenly spaced ones worse.
            let pairs: Vec<_> = alike.iter().copied().filter(|(particles, _)| particles % 2 == 1).collect();
            let in_pairs = needed(&pairs, within);
            if let Some(e) = in_pairs {
                println!("{tolerance} %: {e} evenly spaced with even numbers of cells");
                summary.note(format!("cook_local_{tolerance}_even_cells"), l as f64 / e as f64)?;
            }
            // The first model is not refined yet.
            if let Some(refined) = needed(&fine[1..], within) {
                println!("{tolerance} %: {refined} particles after at least one refinement");
                summary.note(format!("cook_local_{tolerance}_refined"), refined as f64 / e as f64)?;
            }
            if let Some(l) = needed(&quadratic, within) {
                println!("{tolerance} %: {l} particles locally refined with a quadratic basis");
                summary.note(format!("cook_local_{tolerance}_quadratic"), l as f64 / e as f64)?;
            }
            if tolerance == 0.5 {
                // What no marker can do better: half of either count.
                let half = best_of_all(case, e / 2)?;
                println!("{half}");
                summary.note("cook_local_0.5_ways", half.models as f64)?;
                summary.note("cook_local_0.5_best_error", half.best)?;
                summary.note("cook_local_0.5_best_refined_error", half.best_refined)?;
                if let Some(e) = in_pairs {
                    let half = best_of_all(case, e / 2)?;
                    println!("{half}");
                    summary.note("cook_local_0.5_even_cells_best_error", half.best)?;
                }
            }
        }
    }
    Ok(())
}

/// All models of at most so many particles that refine macro cells of any first lattice with even numbers of cells.
struct Ways {
    most: usize,
    models: usize,
    /// The least error of all of them.
    best: f64,
    /// The least error of those that are refined at least once.
    best_refined: f64,
}

impl std::fmt::Display for Ways {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Ways { most, models, best, best_refined } = self;
        let percent = 100.0 * best;
        write!(f, "{models} models of macro cells have at most {most} particles: the best is off by {percent:.2} %, ")?;
        if best_refined.is_finite() {
            write!(f, "of those that are refined at least once by {:.2} %", 100.0 * best_refined)
        } else {
            write!(f, "none is refined")
        }
    }
}

/// Errors of all those models: what no marker can do better.
fn best_of_all(case: &Case<2>, most: usize) -> Result<Ways, Box<dyn Error>> {
    let domain: Arc<dyn Domain<2>> = Arc::new(Quadrilateral { corners: COOK });
    let mut models: Vec<(Refined, bool)> = Vec::new();
    for columns in (2..most).step_by(2) {
        for rows in (2..most).step_by(2).take_while(|rows| (columns + 1) * (rows + 1) <= most) {
            models.push((Refined::new(domain.clone(), [columns, rows])?, false));
        }
    }
    let mut seen = BTreeSet::new();
    let (mut best, mut best_refined) = (f64::INFINITY, f64::INFINITY);
    while let Some((cells, refined)) = models.pop() {
        let places: Vec<[u64; 2]> = cells.positions().iter().map(|x| [x[0].to_bits(), x[1].to_bits()]).collect();
        if !seen.insert(places) {
            continue;
        }
        for zone in 0..cells.refinable().count() {
            let finer = cells.refined(&[zone])?;
            models.extend((finer.positions().len() <= most).then_some((finer, true)));
        }
        let problem = case.scene.with_cells(Arc::new(cells)).discretize(&Scheme::default())?;
        // A model that does not carry the whole load reaches nothing.
        let Ok(path) = problem.run()?.completed() else { continue };
        let values = case.requested.iter().map(|q| q.evaluate(&problem, path.last())).collect::<Result<Vec<_>, _>>()?;
        let error = worst(&values, &case.exact);
        best = best.min(error);
        best_refined = if refined { best_refined.min(error) } else { best_refined };
    }
    Ok(Ways { most, models: seen.len(), best, best_refined })
}

/// Tolerances for the drawn scenes.
const DRAWN: [f64; 4] = [0.02, 0.01, 0.005, 0.003];

/// Twelve membranes of other shapes and loads and twelve bonded blocks, none of which the rule was made with: are
/// promises kept, and how many particles do answers take that are refined locally, over evenly spaced ones?
pub fn drawn(summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let (mut runs, mut accepted, mut kept, mut held) = (0, 0, 0, 0);
    let (mut particles, mut seconds) = (Vec::new(), Vec::new());
    for (name, domain, scene, requested) in scenes()? {
        let exact = reference(&scene, domain, &requested)?;
        for tolerance in DRAWN {
            let within = Tolerance { error: tolerance, quantities: requested.clone() };
            let locally = scene.solve_within_locally(&Scheme::default(), &within, Budget::default())?;
            runs += 1;
            if !locally.reached() {
                continue;
            }
            accepted += 1;
            let error = worst(locally.values(), &exact);
            kept += i32::from(error < tolerance);
            held += i32::from(error <= locally.bound);
            if error >= tolerance {
                println!("missed: {name}, {}", described(&locally, &exact));
            }
            if tolerance == DRAWN[2] {
                let evenly = scene.solve_within_by(&[Scheme::default()], &within, Budget::default(), &mut ())?;
                println!("{name}: locally {}, evenly {}", described(&locally, &exact), described(&evenly, &exact));
                // Where the budget ended the search more particles would have been needed.
                particles.push(locally.problem.model().unknowns() as f64 / evenly.problem.model().unknowns() as f64);
                seconds.push(locally.seconds() / evenly.seconds());
            }
        }
    }
    let mean = |ratios: &[f64]| (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    summary.note("local_accepted", f64::from(accepted) / f64::from(runs))?;
    summary.note("local_kept", f64::from(kept) / f64::from(accepted))?;
    summary.note("local_bound_held", f64::from(held) / f64::from(accepted))?;
    summary.note("local_particles_0.5", mean(&particles))?;
    summary.note("local_particles_0.5_worst", particles.iter().copied().fold(0.0, f64::max))?;
    summary.note("local_seconds_0.5", mean(&seconds))?;
    Ok(())
}

/// A name, the body, the scene on it and what is requested of it.
type Drawn = (String, Arc<dyn Domain<2>>, Scene<2>, Vec<Quantity<2>>);

/// The drawn scenes.
fn scenes() -> Result<Vec<Drawn>, rkpm::Error> {
    let mut random = Uniform(1997);
    let mut all: Vec<Drawn> = Vec::new();
    for load in [0.1, 0.5, 1.0].into_iter().cycle().take(12) {
        let (width, low, height) = (35.0 + 25.0 * random.next(), 40.0 * random.next(), 14.0 + 26.0 * random.next()); // mm
        let shape = Quadrilateral { corners: [[0.0, 0.0], [width, low], [width, low + height], [0.0, 44.0]] };
        let scene = Scene::new(shape, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
            .hold((0, Side::Min))
            .traction((0, Side::Max), [0.0, 6.25 * load]);
        let requested = vec![Quantity::displacement(shape.corners[2], 1), Quantity::energy()];
        all.push((
            format!("membrane {width:.0} mm wide, {height:.0} mm at its end"),
            Arc::new(shape),
            scene,
            requested,
        ));
    }
    // Pulled, sheared, or both. Pressed ones have no limit: where they are bonded their free surface folds onto the plate.
    for slide in [0.0, 0.5, 1.0].into_iter().cycle().take(12) {
        let (width, across, along) = (1.0 + 3.0 * random.next(), 0.3 * random.next(), slide * 0.5 * random.next());
        let block = Block::new([0.0, 0.0], [width, 1.0]); // cm, bonded to plates below and above
        let scene = Scene::new(block, PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 0, along)
            .prescribe((1, Side::Max), 1, across);
        let axis = usize::from(along == 0.0);
        let requested = vec![Quantity::reaction((1, Side::Max), axis), Quantity::energy()];
        all.push((
            format!("block {width:.1} wide, moved by {along:.2}, {across:.2}"),
            Arc::new(block),
            scene,
            requested,
        ));
    }
    Ok(all)
}

/// Values of what is requested by 48 × 48 cells, cut four times towards each corner.
fn reference(
    scene: &Scene<2>,
    domain: Arc<dyn Domain<2>>,
    requested: &[Quantity<2>],
) -> Result<Vec<f64>, Box<dyn Error>> {
    let ends = [0.0, 1.0].into_iter().flat_map(|x| [0.0, 1.0].map(|y| domain.position(&Point::<2>::new(x, y))));
    let ends: Vec<Point<2>> = ends.collect();
    let mut cells = Refined::new(domain.clone(), [48, 48])?;
    for _ in 0..4 {
        let zones = cells.zones(2);
        let at_end = |cell: &u32| cells.corners(*cell as usize).iter().any(|&c| ends.contains(&cells.positions()[c]));
        let touches = |zone: &usize| zones.cells[zones.offsets[*zone]..zones.offsets[zone + 1]].iter().any(at_end);
        let zones: Vec<usize> = (0..cells.refinable().count()).filter(touches).collect();
        cells = cells.refined(&zones)?;
    }
    let problem = scene.with_cells(Arc::new(cells)).discretize(&Scheme::default())?;
    let path = problem.run()?.completed()?;
    requested.iter().map(|q| Ok(q.evaluate(&problem, path.last())?)).collect()
}
