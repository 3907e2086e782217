//! Runs of cases, and the laws that their states keep.

use std::cell::Cell;
use std::ops::ControlFlow;

use approx::{abs_diff_eq, relative_eq, relative_ne};
use rkpm::error::Error;
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::*;
use rkpm::scene::Field;
use rkpm::solve::{EnclosedVolume, Step, StepControl};
use rkpm::study::{Budget, Quantity, Tolerance};

use super::parts::{Dimension, Line, PRESSURE, Plane, Space, TRACTION, contact, scene, scheme, weight};
use super::ranks::on_two;
use super::{ACTION, APPROXIMATION, Case, Failure, KINEMATICS, LAW, RESULT, RUN, SOURCE};

type Held = Result<(), Failure>;

/// What is asked of sized models.
const TOLERANCE: f64 = 0.15;
/// Part of the displacement by which the way to a state tells where surfaces slide.
const SLIDING: f64 = 0.05;

/// Whether a case keeps its laws.
pub fn holds(case: Case) -> Held {
    match case.option(SOURCE) {
        "radial" => holds_in::<1, Line>(case),
        "solid mesh" | "cut surface" => holds_in::<3, Space>(case),
        _ => holds_in::<2, Plane>(case),
    }
}

fn require(holds: bool, what: impl FnOnce() -> String) -> Held {
    if holds { Ok(()) } else { Err(Failure::Broken(what())) }
}

fn holds_in<const D: usize, S: Dimension<D>>(case: Case) -> Held {
    if case.option(RUN) == "ranks" {
        return holds_on_ranks::<D, S>(case);
    }
    let (problem, path) = run::<D, S>(case)?;
    let state = path.last();
    in_equilibrium(case, &problem, state)?;
    by_another_way::<D, S>(case, &problem, state)?;
    matters::<D, S>(case, &problem, state).map_err(|failure| match failure {
        Failure::Broken(what) => Failure::Dropped(what),
        other => other,
    })?;
    result::<D, S>(case, &problem, state).map(|_| ())
}

/// A point whose displacement is looked at: in the middle of the right face, or of a line.
fn seen<const D: usize>() -> Point<D> {
    Point::from_fn(|i, _| {
        if i > 0 {
            0.5
        } else if D == 1 {
            1.5
        } else {
            2.0
        }
    })
}

/// Ends a run after some steps.
struct After(usize);

impl Observer for After {
    fn step(&mut self, _: &Step) -> ControlFlow<()> {
        self.0 -= 1;
        if self.0 > 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

fn completed(path: EquilibriumPath) -> Result<EquilibriumPath, Failure> {
    path.completed().map_err(|error| Failure::from(Error::from(error)))
}

/// Runs a case as it asks for.
fn run<const D: usize, S: Dimension<D>>(case: Case) -> Result<(Problem<D>, EquilibriumPath), Failure> {
    let scene = scene::<D, S>(case, 1.0);
    let scheme = scheme::<D>(case);
    let sized = || Tolerance::of(Quantity::displacement(seen::<D>().into(), D - 1), TOLERANCE);
    let budget = Budget { unknowns: 3000, levels: 4, ..Budget::default() };
    let answer = match case.option(RUN) {
        "solve_within" => Some(scene.solve_within_by(std::slice::from_ref(&scheme), &sized(), budget, &mut ())?),
        "locally" => Some(S::locally(&scene, &scheme, &sized(), budget)?),
        _ => None,
    };
    if let Some(answer) = answer {
        require(answer.levels.len() > 1, || format!("one model alone: {:?}", answer.verdict))?;
        return Ok((answer.problem, answer.path));
    }
    let mut problem = scene.discretize(&scheme)?;
    let path = match case.option(RUN) {
        "deflection" => {
            let deflection = problem.deflection(&seen(), D - 1)?;
            let whole = completed(problem.run()?)?;
            let last = problem.displacement(whole.last(), &seen())?[D - 1];
            completed(problem.run_controlled(&deflection, &[0.5 * last, last], &mut ())?)?
        }
        "volume" => {
            let volume = enclosed::<D, S>(case, &problem)?;
            let whole = completed(problem.run()?)?;
            let last = rkpm::solve::Functional::value(&volume, &whole.last().displacement);
            require(last.abs() > 1e-6, || format!("the volume changes by {last:e}"))?;
            completed(problem.run_controlled(&volume, &[0.5 * last, last], &mut ())?)?
        }
        "arc length" => {
            problem.analysis_mut().stepping.control = StepControl::ArcLength;
            completed(problem.run()?)?
        }
        "resume" => {
            problem.analysis_mut().stepping = Stepping::equal(3);
            let whole = completed(problem.run()?)?;
            let cut = problem.run_with(&mut After(1))?;
            require(cut.ending == Ending::Stopped && cut.steps.len() == 1, || format!("{:?}", cut.ending))?;
            let resumed = completed(problem.resume(cut, &mut ())?)?;
            require(resumed.last() == whole.last(), || "other bits than without a break".into())?;
            resumed
        }
        _ => completed(problem.run()?)?,
    };
    Ok((problem, path))
}

/// The volume behind the right face, or the outer end of a line.
fn enclosed<const D: usize, S: Dimension<D>>(case: Case, problem: &Problem<D>) -> Result<EnclosedVolume<D>, Error> {
    let part: Part = match (case.option(SOURCE), D) {
        (_, 1) => Side::Max.into(),
        ("region" | "planar mesh" | "solid mesh" | "cut surface", _) => "right".into(),
        _ => (0, Side::Max).into(),
    };
    let facets = problem.cells().boundary(&part, 2, 2)?;
    Ok(EnclosedVolume::new(problem.tabulate(&facets.points, &*S::kinematics(case))?)?)
}

/// Forces and moments of conditions, loads and contacts sum to nothing.
fn in_equilibrium<const D: usize>(case: Case, problem: &Problem<D>, state: &State) -> Held {
    if D == 1 {
        return Ok(());
    }
    let revolved = case.option(KINEMATICS) == "axisymmetric";
    let free = ["rigid contact", "friction"].contains(&case.option(ACTION));
    let by_driven = if free { Point::zeros() } else { problem.reaction(state, "driven")? };
    let mut forces = vec![problem.reaction(state, "bottom")?, by_driven];
    for name in ["contact", "wall"] {
        let rigid = name == "wall" || free;
        if contact(case) == Some(name) && rigid {
            forces.push(problem.contact(state, name)?.force);
        }
    }
    let size: f64 = forces.iter().map(|force| force.norm()).sum();
    let mut sum: Point<D> = forces.iter().sum();
    sum[D - 1] += weight(case) * state.load;
    let mut exact = 1e-6;
    if case.option(ACTION) == "follower pressure" {
        sum += pushed(case, problem, state)?;
        // The chord of the face in the plane; in space and where the thickness is free its size alone is known.
        exact = if D == 3 || case.option(KINEMATICS) == "plane stress" { 0.3 } else { 0.03 };
    }
    let first = usize::from(revolved);
    for axis in first..D {
        require(abs_diff_eq!(sum[axis], 0.0, epsilon = exact * size), || {
            format!("forces of {size:.3e} miss {:.3e} along {axis}", sum[axis])
        })?;
    }
    Ok(())
}

/// The force of the pressure on the right face, by where its ends are.
fn pushed<const D: usize>(case: Case, problem: &Problem<D>, state: &State) -> Result<Point<D>, Error> {
    let ends = [0.0, 1.0].map(|height| {
        let mut x = Point::<D>::repeat(0.5);
        (x[0], x[D - 1]) = (2.0, height);
        problem.displacement(state, &x).map(|u| x + u)
    });
    let [low, high] = ends;
    let (low, high) = (low?, high?);
    let pressure = PRESSURE * state.load;
    let mut force = Point::zeros();
    if case.option(KINEMATICS) == "axisymmetric" {
        force[D - 1] = pressure * std::f64::consts::PI * (high[0].powi(2) - low[0].powi(2));
    } else {
        let thick = weight(case) / TRACTION;
        force[0] = -pressure * thick * (high[D - 1] - low[D - 1]);
        force[D - 1] = pressure * thick * (high[0] - low[0]);
    }
    Ok(force)
}

/// The state of a case is that which a plain run finds.
fn by_another_way<const D: usize, S: Dimension<D>>(case: Case, problem: &Problem<D>, state: &State) -> Held {
    let (within, sized) = match case.option(RUN) {
        "deflection" | "volume" | "arc length" => (1e-5, false),
        // The plain run has few particles, and is off by as much.
        "solve_within" | "locally" => (2.0 * TOLERANCE, true),
        _ => return Ok(()),
    };
    let other = scene::<D, S>(case, 1.0).discretize(&scheme::<D>(case.plain(RUN)))?;
    let path = completed(other.run()?)?;
    let (own, plain) = (problem.displacement(state, &seen())?, other.displacement(path.last(), &seen())?);
    let off = if sized {
        // In what is asked for.
        (own - plain)[D - 1].abs() / plain[D - 1].abs()
    } else {
        (own - plain).norm() / plain.norm()
    };
    // Where it slides the state depends on the steps to it.
    let slides = case.option(ACTION) == "friction";
    let (within, of_load) = if slides { (SLIDING.max(within), SLIDING) } else { (within, 1e-4) };
    require(abs_diff_eq!(state.load, 1.0, epsilon = of_load), || format!("ended at load factor {}", state.load))?;
    require(off <= within, || format!("the plain run is off by {off:.1e} of the displacement"))
}

/// Each option that is not plain has changed what it is for.
fn matters<const D: usize, S: Dimension<D>>(case: Case, problem: &Problem<D>, state: &State) -> Held {
    if case.0[APPROXIMATION] > 0 {
        let other = scene::<D, S>(case, 1.0).discretize(&scheme::<D>(case.plain(APPROXIMATION).plain(RUN)))?;
        let at = Point::from_fn(|i, _| if i > 0 { 0.42 } else { 1.37 });
        let (own, plain) = (problem.shape_functions(&at), other.shape_functions(&at));
        let same = matches!((&own, &plain), (Ok(a), Ok(b)) if a.nodes == b.nodes && a.values == b.values);
        require(!same, || "the shape functions are those of order 1".into())?;
    }
    let volume: f64 = problem.weights().sum();
    let area = if case.option(ACTION) == "several bodies" || case.option(ACTION) == "contact of two bodies" {
        1.4
    } else {
        1.0
    };
    match case.option(KINEMATICS) {
        "axisymmetric" => require(volume > 2.0 * area, || format!("no revolution: {volume}"))?,
        "plane stress" => {
            let across = problem.stresses(state)?.iter().map(|stress| stress[(2, 2)].abs()).fold(0.0, f64::max);
            let along = problem.stresses(state)?.iter().map(|stress| stress.norm()).fold(0.0, f64::max);
            require(
                across < 1e-8 * along && relative_eq!(volume, 2.0 * area, epsilon = 0.0, max_relative = 1e-9),
                || format!("stress across: {across:e}"),
            )?;
        }
        _ => {}
    }
    if case.0[LAW] > 0 {
        let elastic = case.plain(LAW).plain(RUN).plain(RESULT);
        let twin = scene::<D, S>(elastic, 1.0).discretize(&scheme::<D>(elastic))?;
        let path = completed(twin.run()?)?;
        let [own, other] = [problem.energy(state)?, twin.energy(path.last())?];
        match case.option(LAW) {
            // Softer only where it is let go.
            "Mullins" => {
                let variables: usize = state.terms.iter().map(|own| own.history.len()).sum();
                let plain: usize = path.last().terms.iter().map(|own| own.history.len()).sum();
                require(variables > plain, || "no internal variables".into())?;
            }
            _ => require(relative_ne!(own, other, epsilon = 0.0, max_relative = 1e-3), || {
                format!("the energy is that of the elastic law: {own}")
            })?,
        }
    }
    acts::<D, S>(case, problem, state)
}

/// The action of a case has had its effect.
fn acts<const D: usize, S: Dimension<D>>(case: Case, problem: &Problem<D>, state: &State) -> Held {
    match case.option(ACTION) {
        "follower pressure" => {
            let plain = case.plain(ACTION).plain(RUN).plain(RESULT);
            let twin = scene::<D, S>(plain, 1.0).discretize(&scheme::<D>(plain))?;
            let path = completed(twin.run()?)?;
            // Both ends of a line are held: its pressure is felt by the support alone.
            let felt = |problem: &Problem<D>, state: &State| match D {
                1 => problem.reaction(state, "bottom").map(|force| force[0]),
                _ => problem.energy(state),
            };
            let [own, other] = [felt(problem, state)?, felt(&twin, path.last())?];
            require(relative_ne!(own, other, epsilon = 0.0, max_relative = 1e-6), || {
                "the pressure changes nothing".into()
            })
        }
        "several bodies" => {
            require(problem.discrete_bodies().len() == 2, || "one body".into())?;
            // Bonded: both move alike where they meet.
            let mut at = Point::<D>::repeat(0.5);
            (at[0], at[D - 1]) = (1.5, if D == 1 { 2.0 } else { 1.0 });
            let moves = problem.discrete_bodies().iter().map(|body| body.displacement(state, &at));
            let moves = moves.collect::<Result<Vec<_>, _>>()?;
            let apart = (moves[0] - moves[1]).norm() / moves[0].norm();
            require(apart < 0.1, || format!("the bodies are {apart:.1e} of their displacement apart"))
        }
        "rigid body" => {
            let motion = problem.rigid_motion(state, "plate")?;
            require(abs_diff_eq!(motion.displacement[D - 1], -0.1 * state.load, epsilon = 1e-9), || {
                format!("{motion:?}")
            })
        }
        "rigid contact" | "friction" | "contact of two bodies" => {
            let found = problem.contact(state, "contact")?;
            require(found.force.norm() > 1e-3, || format!("nothing touches: {found:?}"))?;
            if case.option(ACTION) == "friction" {
                let along = found.points.iter().map(|point| point.traction[0].abs()).fold(0.0, f64::max);
                require(along > 1e-6, || "no friction".into())?;
            }
            Ok(())
        }
        "contact with itself" => {
            // Nothing folds: the state is that without, and the part is looked at.
            let found = problem.contact(state, "contact")?;
            require(!found.points.is_empty() && abs_diff_eq!(found.force, Point::zeros(), epsilon = 5e-13), || {
                format!("{:?}", found.force)
            })
        }
        _ => Ok(()),
    }
}

/// The result of a case, which keeps its own law, as numbers.
fn result<const D: usize, S: Dimension<D>>(
    case: Case,
    problem: &Problem<D>,
    state: &State,
) -> Result<Vec<f64>, Failure> {
    match case.option(RESULT) {
        "reaction" => {
            let force = problem.reaction(state, "bottom")?;
            require(force.norm() > 1e-3, || "no reaction".into())?;
            if D == 1 && case.0[RUN] == 0 && case.0[ACTION] == 0 && case.option(LAW) == "elastic" {
                works::<D, S>(case, problem, state)?;
            }
            Ok(force.iter().copied().collect())
        }
        "moment" => moment(case, problem, state),
        "stress" => {
            let at = Point::from_fn(|i, _| if i > 0 { 0.5 } else { 1.5 });
            let stress = problem.stress(state, &at)?;
            let means = problem.stresses(state)?;
            let most = problem
                .model()
                .ranks()
                .map_or_else(|| means.iter().map(|stress| stress.norm()).fold(0.0, f64::max), |_| f64::INFINITY);
            // Those of the points around it, whose mean is that of a linear field at their centre.
            let around =
                problem.points().zip(problem.weights()).zip(&means).filter(|((x, _), _)| (*x - at).amax() < 0.5);
            let (sum, weight) = around.fold((Matrix3::zeros(), 0.0), |(sum, all), ((_, weight), stress)| {
                (sum + stress * weight, all + weight)
            });
            if most.is_finite() {
                let off = (stress - sum / weight).norm() / most;
                require(off < 0.3, || format!("the stress at a point is {off:.2} of the largest off those around"))?;
            }
            Ok(stress.iter().copied().collect())
        }
        "contact pressure" => {
            let name = contact(case).unwrap_or("wall");
            let found = problem.contact(state, name)?;
            let sum: Point<D> = found.points.iter().map(|point| point.force).sum();
            // On both bodies, where there are two.
            let all = if case.option(ACTION) == "contact of two bodies" && name == "contact" {
                Point::zeros()
            } else {
                found.force
            };
            require(abs_diff_eq!(sum, all, epsilon = 5e-10 * found.force.norm().max(1e-9)), || {
                format!("forces of points {sum:?}, of all {:?}", found.force)
            })?;
            require(found.points.iter().all(|point| point.pressure >= 0.0), || "it pulls".into())?;
            if case.option(ACTION) != "contact with itself" {
                require(found.peak_pressure() > 0.0, || "no pressure".into())?;
            }
            Ok(vec![found.peak_pressure(), found.force.norm()])
        }
        "picture" => {
            let svg = problem.picture(state, Field::LargestStretch)?.to_svg().map_err(Error::from)?;
            require(svg.contains("</svg>") && svg.len() > 500, || "an empty picture".into())?;
            Ok(vec![svg.len() as f64])
        }
        "VTU" => {
            let grid = problem.vtk_grid(state)?;
            let particles: usize = problem.discrete_bodies().iter().map(|body| body.nodes().len()).sum();
            require(
                grid.points.len() >= particles && grid.to_xml().map_err(Error::from)?.contains("Cauchy stress"),
                || "no grid".into(),
            )?;
            let most = grid.point_data.iter().map(|field| match &field.values {
                rkpm::output::VtkValues::Vectors(all) => all.iter().map(|v| v[D - 1].abs()).fold(0.0, f64::max),
                _ => 0.0,
            });
            let most = most.fold(0.0, f64::max);
            require(most > 0.01, || "nothing moves in the grid".into())?;
            Ok(vec![most])
        }
        _ => {
            let plain = case.plain(RUN);
            let other = scene::<D, S>(plain, 1.0).discretize(&finer::<D>(plain))?;
            let guess = other.transfer(problem, state)?;
            let (own, moved) = (problem.displacement(state, &seen())?, other.displacement(&guess, &seen())?);
            require((own - moved).norm() < 0.1 * own.norm(), || format!("transferred {moved:?} of {own:?}"))?;
            Ok(moved.iter().copied().collect())
        }
    }
}

/// The scheme with other particles, where it says how many there are.
fn finer<const D: usize>(case: Case) -> Scheme {
    let fixed = ["planar mesh", "solid mesh", "cut surface"].contains(&case.option(SOURCE));
    match D {
        1 => scheme::<D>(case).particles([9]),
        2 if !fixed => scheme::<D>(case).particles([7, 7]),
        _ => scheme::<D>(case),
    }
}

/// The work of the driven end is energy.
fn works<const D: usize, S: Dimension<D>>(case: Case, problem: &Problem<D>, state: &State) -> Held {
    const STEP: f64 = 1e-3;
    let energies = [1.0 - STEP, 1.0 + STEP].map(|size| -> Result<f64, Failure> {
        let problem = scene::<D, S>(case, size).discretize(&scheme::<D>(case))?;
        Ok(problem.energy(completed(problem.run()?)?.last())?)
    });
    let [low, high] = energies;
    let work = -0.1 * 2.0 * STEP * problem.reaction(state, "driven")?[D - 1];
    let gained = high? - low?;
    require(relative_eq!(work, gained, epsilon = 0.0, max_relative = 5e-3), || {
        format!("work {work:e}, energy {gained:e}")
    })
}

/// Moments about the origin sum to nothing; bodies of revolution have none.
fn moment<const D: usize>(case: Case, problem: &Problem<D>, state: &State) -> Result<Vec<f64>, Failure> {
    let bottom = problem.moment(state, "bottom", [0.0; D])?;
    if D == 1 || case.option(KINEMATICS) == "axisymmetric" {
        require(bottom == [0.0; 3], || format!("a moment {bottom:?}"))?;
        return Ok(bottom.to_vec());
    }
    let free = ["rigid contact", "friction"].contains(&case.option(ACTION));
    let mut all = vec![bottom];
    if !free {
        all.push(problem.moment(state, "driven", [0.0; D])?);
    }
    if free {
        all.push(problem.contact(state, "contact")?.moment.into());
    }
    let plane = if D == 3 { 1 } else { 2 };
    let size: f64 = all.iter().map(|moment| moment[plane].abs()).sum();
    let mut sum: f64 = all.iter().map(|moment| moment[plane]).sum();
    // The dead traction where the right face has come to, by Simpson's rule.
    let about = Cell::new(0.0);
    for k in 0..=8 {
        let part = [1.0, 4.0, 2.0, 4.0, 2.0, 4.0, 2.0, 4.0, 1.0][k] / 24.0;
        let mut x = Point::<D>::repeat(0.5);
        (x[0], x[D - 1]) = (2.0, k as f64 / 8.0);
        about.set(about.get() + part * (x[0] + problem.displacement(state, &x)?[0]));
    }
    let by_load = about.get() * weight(case) * state.load;
    sum += if D == 3 { -by_load } else { by_load };
    let exact = if case.option(ACTION) == "follower pressure" { 0.2 } else { 1e-2 };
    require(abs_diff_eq!(sum, 0.0, epsilon = exact * size.max(by_load)), || {
        format!("moments of {size:.3e} miss {sum:.3e}")
    })?;
    Ok(bottom.to_vec())
}

/// Each of two ranks finds what one process does.
fn holds_on_ranks<const D: usize, S: Dimension<D>>(case: Case) -> Held {
    let scene = scene::<D, S>(case, 1.0);
    let find = |share: &dyn Fn(Scheme) -> Scheme| -> Result<Vec<f64>, Failure> {
        let problem = scene.discretize(&share(scheme::<D>(case)))?;
        let path = completed(problem.run()?)?;
        let mut found: Vec<f64> = problem.displacement(path.last(), &seen())?.iter().copied().collect();
        found.push(problem.energy(path.last())?);
        found.extend(result::<D, S>(case, &problem, path.last())?);
        Ok(found)
    };
    let found = on_two(find);
    let alone = find(&|scheme| scheme)?;
    let size = alone.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
    for shared in found {
        let off = shared?.iter().zip(&alone).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        require(off <= 1e-7 * size, || format!("a rank is off by {off:e} of {size:e}"))?;
    }
    // The other options have their effect in one process.
    let mut serial = case;
    serial.0[RUN] = 0;
    holds_in::<D, S>(serial)
}
