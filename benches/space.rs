//! Three dimensions: which supports, what they are worth, and what an iteration takes: `cargo bench -p rkpm-benches --bench space`.
//!
//! One part: `-- supports`, `rules`, `gradings`, `cube`, `iteration`, `solids`. Prints a table of `name,value` rows.

mod support;

use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

use rkpm::geometry::Mapped;
use rkpm::nalgebra::Rotation3;
use rkpm::prelude::*;
use rkpm::scene::{Rule, SolverChoice};
use rkpm::solid::{Select, Shape};
use rkpm::solve::State;

/// A bonded cube of 10 mm, its top moved aside by 3 mm.
fn sheared(k: f64) -> Scene<3> {
    let rubber = Rubber::neo_hookean(40.097, k).expect("constants above zero"); // MPa
    Scene::new(Block::new([0.0; 3], [10.0; 3]), Solid, rubber)
        .hold((2, Side::Min))
        .prescribe((2, Side::Max), 0, 3.0)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.0)
}

/// A column turned between rigid ends.
fn twisted() -> Scene<3> {
    let turn = |load: f64| (PI * load).sin_cos();
    let end = (2, Side::Max);
    Scene::new(Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, 4.0]), Solid, Rubber::neo_hookean(0.5, 1e4).expect("constants"))
        .hold((2, Side::Min))
        .prescribe(end, 0, Value::motion(move |x: &Point<3>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0))
        .prescribe(end, 1, Value::motion(move |x: &Point<3>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)))
        .prescribe(end, 2, 0.0)
}

/// A square mapped to a disk: the largest of the two coordinates is the radius.
fn disk(unit: &Point<3>) -> Point<3> {
    let (a, b) = (2.0 * unit[0] - 1.0, 2.0 * unit[1] - 1.0);
    Point::<3>::new(a * (1.0 - 0.5 * b * b).sqrt(), b * (1.0 - 0.5 * a * a).sqrt(), unit[2])
}

/// A solid cylinder in torsion between ends that turn rigidly (Rivlin).
fn cylinder() -> Scene<3> {
    let rubber = Rubber::mooney_rivlin(0.3, 0.2, 1e4).expect("constants above zero");
    let turn = |load: f64| (1.2 * load).sin_cos();
    let end = (2, Side::Max);
    Scene::new(Mapped(disk), Solid, rubber)
        .hold((2, Side::Min))
        .prescribe(end, 0, Value::motion(move |x: &Point<3>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0))
        .prescribe(end, 1, Value::motion(move |x: &Point<3>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)))
        .prescribe(end, 2, 0.0)
}

/// A block on a smooth table, pressed in the middle of its top: a quarter.
fn patch() -> Scene<3> {
    let rubber = Rubber::neo_hookean(0.5, 1e3).expect("constants above zero");
    Scene::new(Block::new([0.0; 3], [1.0, 1.0, 1.0]), Solid, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((2, Side::Min), 2, 0.0)
        .prescribe((2, Side::Max), 0, 0.0)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, -0.2)
}

/// A bar bent by a force on its end.
fn bent() -> Scene<3> {
    let rubber = Rubber::neo_hookean(0.5, 1e3).expect("constants above zero");
    Scene::new(Block::new([0.0; 3], [1.0, 1.0, 4.0]), Solid, rubber)
        .hold((2, Side::Min))
        .traction((2, Side::Max), [0.01, 0.0, 0.0])
}

/// An eighth of a thick sphere under inner pressure, by the cube's face mapped to its inside.
fn sphere() -> Scene<3> {
    let rubber = Rubber::mooney_rivlin(0.4, 0.1, 1e3).expect("constants above zero");
    let shell = |unit: &Point<3>| {
        let radius = 1.0 + unit[2];
        let (a, b) = ((0.25 * PI * (2.0 * unit[0] - 1.0)).tan(), (0.25 * PI * (2.0 * unit[1] - 1.0)).tan());
        Point::<3>::new(a, b, 1.0) * (radius / (1.0 + a * a + b * b).sqrt())
    };
    Scene::new(Mapped(shell), Solid, rubber).hold((2, Side::Max)).pressure((2, Side::Min), 0.3)
}

type Measured = fn(&Problem<3>, &State) -> f64;

fn energy(problem: &Problem<3>, state: &State) -> f64 {
    problem.energy(state).unwrap()
}

fn force(problem: &Problem<3>, state: &State, component: usize) -> f64 {
    problem.reaction(state, (2, Side::Max)).map_or(f64::NAN, |f| f[component])
}

fn moment(problem: &Problem<3>, state: &State) -> f64 {
    problem.moment(state, (2, Side::Max), [0.0; 3]).map_or(f64::NAN, |m| m[2])
}

/// Scene, particles, nodes of quadratic elements whose solution is near, and what is compared.
type Case = (&'static str, Scene<3>, [usize; 3], [usize; 3], Vec<(&'static str, Measured)>);

fn cases() -> Vec<Case> {
    let across: Measured = |p, s| force(p, s, 0);
    let along: Measured = |p, s| force(p, s, 2);
    vec![
        ("cube", sheared(400_889.8), [9, 9, 9], [17, 17, 17], vec![("E", energy), ("Fx", across), ("Fz", along)]),
        ("twist", twisted(), [5, 5, 17], [9, 9, 33], vec![("E", energy), ("M", moment), ("Fz", along)]),
        ("torsion", cylinder(), [9, 9, 5], [13, 13, 9], vec![("E", energy), ("M", moment), ("Fz", along)]),
        ("pressed", patch(), [7, 7, 7], [13, 13, 13], vec![("E", energy), ("Fz", along)]),
        ("bent", bent(), [4, 4, 13], [9, 9, 33], vec![("E", energy)]),
        ("sphere", sphere(), [7, 7, 5], [13, 13, 9], vec![("E", energy)]),
    ]
}

/// Errors of schemes on scenes whose finer solutions by quadratic elements are near.
fn compare(schemes: &[(&str, Scheme)]) {
    for (name, scene, counts, fine, measured) in cases() {
        let solve = |scheme: Scheme| {
            let start = Instant::now();
            let problem = scene.discretize(&scheme).ok()?;
            let path = problem.run().ok()?.completed().ok()?;
            let seconds = start.elapsed().as_secs_f64();
            Some((measured.iter().map(|m| m.1(&problem, path.last())).collect::<Vec<_>>(), path.iterations, seconds))
        };
        let Some((reference, ..)) = solve(Scheme::elements(2).particles(fine)) else {
            println!("{name},no reference");
            continue;
        };
        for (label, scheme) in schemes {
            let Some((found, iterations, seconds)) = solve(scheme.clone().particles(counts)) else {
                println!("{name}_{label},stalled");
                continue;
            };
            for (k, (what, _)) in measured.iter().enumerate() {
                println!("{name}_{what}_{label},{:.4}", found[k] / reference[k] - 1.0);
            }
            println!("{name}_{label}_iterations,{iterations}");
            println!("{name}_{label}_seconds,{seconds:.3}");
        }
        for (k, (what, _)) in measured.iter().enumerate() {
            println!("{name}_{what}_reference,{:.6}", reference[k]);
        }
    }
}

fn supports() {
    compare(&[("r0.75", 0.75), ("r1", 1.0), ("r1.15", 1.15)].map(|(name, r)| (name, Scheme::default().dilation(r))));
}

fn rules() {
    compare(&[
        ("parts2", Scheme::default()),
        ("parts3", Scheme::default().rule(Rule::Smoothed { parts: 3 })),
        ("gauss2", Scheme::default().rule(Rule::Gauss { zones: None, points: Some(2) })),
    ]);
}

/// Particles that stand closer by a power of their distance from the nearest face; of a quarter, from that of the whole block.
fn graded(power: f64, quarter: bool) -> Layout {
    let half = move |t: f64| 0.5 * (2.0 * t).powf(power);
    let whole = move |t: f64| if t < 0.5 { half(t) } else { 1.0 - half(1.0 - t) };
    Layout::Graded(Arc::new(move |_, t| if quarter { 2.0 * whole(0.5 + 0.5 * t) - 1.0 } else { whole(t) }))
}

/// Energy and forces on the upper face, iterations and most directions.
fn forces(scene: &Scene<3>, scheme: &Scheme) -> Option<([f64; 3], usize, usize)> {
    let problem = scene.discretize(scheme).ok()?;
    let path = problem.run().ok()?.completed().ok()?;
    let state = path.last();
    let found = [energy(&problem, state), force(&problem, state, 0), force(&problem, state, 2)];
    let krylov_iterations = problem.analysis().solver.krylov_iterations().into_iter().max().unwrap_or(0);
    Some((found, path.iterations, krylov_iterations))
}

/// Gradings towards the edges of bonded faces: the sheared cube against its reference, the pressed block against graded
/// quadratic elements.
fn gradings() {
    let Some((fine, ..)) = forces(&patch(), &Scheme::elements(2).layout(graded(2.0, true)).particles([13])) else {
        println!("pressed,no reference");
        return;
    };
    let cases: [(_, _, &[usize], _); 2] =
        [("cube", sheared(400_889.8), &[0, 1, 2], [2672.3, 1793.8, 343.0]), ("pressed", patch(), &[0, 2], fine)];
    for (name, scene, compared, reference) in cases {
        for power in [1.0, 1.5, 2.0] {
            for n in [9, 13, 17] {
                let start = Instant::now();
                let scheme = Scheme::default().layout(graded(power, name == "pressed")).particles([n]);
                let Some((found, iterations, krylov_iterations)) = forces(&scene, &scheme) else {
                    println!("{name}_{power}_{n},stalled");
                    continue;
                };
                let errors: Vec<f64> = compared.iter().map(|&k| 100.0 * (found[k] / reference[k] - 1.0)).collect();
                let seconds = start.elapsed().as_secs_f64();
                println!(
                    "{name}_{power}_{n},{errors:.2?} %,{seconds:.2} s,{iterations} iterations,{krylov_iterations} Krylov iterations at most"
                );
            }
        }
    }
}

/// The sheared cube against its reference, and 13 particles a side by factors and by iteration.
fn cube() {
    let reference = [2672.3, 1793.8, 343.0];
    for (name, n, scheme) in [
        ("default", 5, Scheme::default()),
        ("default", 9, Scheme::default()),
        ("default", 13, Scheme::default()),
        ("r0.75_factors", 13, Scheme::default().dilation(0.75).solver_choice(SolverChoice::Direct)),
        ("factors", 13, Scheme::default().solver_choice(SolverChoice::Direct)),
        ("iteration", 9, Scheme::default().solver_choice(SolverChoice::Krylov)),
        ("iteration", 13, Scheme::default().solver_choice(SolverChoice::Krylov)),
        ("order2", 5, Scheme::default().order(2)),
        ("order2", 9, Scheme::default().order(2)),
        ("q2p1", 9, Scheme::elements(2)),
        ("q2p1", 13, Scheme::elements(2)),
    ] {
        let start = Instant::now();
        let Ok(problem) = sheared(400_889.8).discretize(&scheme.particles([n])) else { continue };
        let tables = start.elapsed().as_secs_f64();
        let Ok(Ok(path)) = problem.run().map(EquilibriumPath::completed) else {
            println!("cube_{name}_{n},stalled");
            continue;
        };
        let state = path.last();
        let found = [energy(&problem, state), force(&problem, state, 0), force(&problem, state, 2)];
        let worst = found.iter().zip(reference).map(|(f, r)| (f / r - 1.0).abs()).fold(0.0, f64::max);
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "cube_{name}_{n},{:.2} %,{seconds:.3} s,tables {tables:.3} s,{} iterations,{found:.2?},directions {:?}",
            100.0 * worst,
            path.iterations,
            problem.analysis().solver.krylov_iterations()
        );
    }
}

/// Directions of the iteration over sizes and bulk moduli.
fn iteration() {
    for (n, ratio) in [(9, 1e2), (9, 1e3), (9, 1e5), (13, 1e3), (17, 1e3), (22, 1e2), (22, 1e3), (22, 1e5)] {
        let start = Instant::now();
        let scheme = Scheme::default().solver_choice(SolverChoice::Krylov).particles([n]);
        let problem = match sheared(2.0 * 40.097 * ratio).discretize(&scheme) {
            Ok(problem) => problem,
            Err(error) => {
                println!("iteration_{n},{error}");
                continue;
            }
        };
        let ended = problem.run().map(|path| path.completed().map(|p| p.iterations).map_err(|e| e.to_string()));
        println!(
            "iteration_{n}_{ratio:e},{:?},{ended:?},{:.2} s",
            problem.analysis().solver.krylov_iterations(),
            start.elapsed().as_secs_f64()
        );
    }
}

/// A solid of side 1, held below, its top moved.
fn cut(shape: Shape, along: Option<([f64; 3], f64)>, by: [f64; 3], ratio: f64) -> Result<Scene<3>, rkpm::Error> {
    let turned = along.map(|(axis, angle)| Rotation3::new(Point::<3>::from(axis).normalize() * angle));
    let up: [f64; 3] = turned.map_or(Point::<3>::z(), |turn| turn * Point::<3>::z()).into();
    let shape = along.map_or(shape.clone(), |(axis, angle)| shape.rotated(axis, angle));
    let solid = shape.solid(0.04)?;
    let solid = solid.name("base", Select::plane([0.0; 3], up.map(|x| -x)))?.name("top", Select::plane(up, up))?;
    let rubber = Rubber::neo_hookean(0.5, ratio)?;
    Ok(Scene::new(&solid, Solid, rubber).hold("base").with(Condition::on("top").displacement(by).named("top")))
}

/// Cut solids by iteration and by factors: directions, seconds, the force on the top.
fn solids() {
    let block = || Shape::block([0.0; 3], [1.0; 3]);
    let void = || block().minus(Shape::sphere([0.5; 3], 0.3));
    let bore = || block().minus(Shape::cylinder([0.5, -0.1, 0.5], [0.5, 1.1, 0.5], 0.25));
    let cylinder = || Shape::cylinder([0.5, 0.5, 0.0], [0.5, 0.5, 1.0], 0.5);
    let (press, shear, aslant) = ([0.0, 0.0, -0.15], [0.2, 0.0, 0.0], Some(([1.0, 2.0, 0.5], 0.4)));
    let scenes = [
        ("block", block(), None, shear, 5e2, 0.125),
        ("void", void(), None, press, 5e2, 0.125),
        ("void", void(), None, press, 5e2, 0.0625),
        ("void", void(), None, press, 5e4, 0.0625),
        ("bore", bore(), aslant, shear, 5e2, 0.125),
        ("bore", bore(), aslant, shear, 5e4, 0.0625),
        ("cylinder", cylinder(), None, shear, 5e2, 0.1),
        ("cylinder", cylinder(), None, shear, 5e2, 0.05),
    ];
    for (name, shape, along, by, ratio, spacing) in scenes {
        let scene = cut(shape, along, by, ratio).expect("a closed solid with two plane faces");
        for choice in [SolverChoice::Krylov, SolverChoice::Direct] {
            let scheme = Scheme::default().spacing(spacing).solver_choice(choice);
            let problem = scene.discretize(&scheme).expect("a spacing of a part of the side");
            let (start, particles) = (Instant::now(), problem.model().node_count());
            let ended = problem.run().and_then(|path| {
                let force = problem.reaction(&path.steps[path.steps.len() - 1].state, "top")?;
                Ok((path.ending, path.iterations, force.norm()))
            });
            println!(
                "{name}_{particles}_{ratio:e}_{choice:?},{:?},{ended:?},{:.2} s",
                problem.analysis().solver.krylov_iterations(),
                start.elapsed().as_secs_f64()
            );
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let requested = |name: &str| arguments.iter().any(|a| a == name);
    let parts = [
        ("supports", supports as fn()),
        ("rules", rules),
        ("gradings", gradings),
        ("cube", cube),
        ("iteration", iteration),
        ("solids", solids),
    ];
    let all = !parts.iter().any(|(part, _)| requested(part));
    for (name, run) in parts {
        if all || requested(name) {
            support::on_threads(1, run);
        }
    }
}
