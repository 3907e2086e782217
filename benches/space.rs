//! Three dimensions: which supports, what they are worth, and what an iteration takes: `cargo bench -p rkpm-benches --bench space`.
//!
//! One part: `-- supports`, `cube`, `iteration`. Prints a table of `name,value` rows.

mod support;

use std::f64::consts::PI;
use std::time::Instant;

use rkpm::geometry::Mapped;
use rkpm::prelude::*;
use rkpm::scene::Solving;
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
    problem.energy(state)
}

fn force(problem: &Problem<3>, state: &State, component: usize) -> f64 {
    problem.reaction(state, (2, Side::Max)).map_or(f64::NAN, |f| f[component])
}

fn moment(problem: &Problem<3>, state: &State) -> f64 {
    problem.moment(state, (2, Side::Max), [0.0; 3]).map_or(f64::NAN, |m| m[2])
}

/// Errors of two dilations on scenes whose finer solutions by quadratic elements are near.
fn supports() {
    let across: Measured = |p, s| force(p, s, 0);
    let along: Measured = |p, s| force(p, s, 2);
    type Case = (&'static str, Scene<3>, [usize; 3], [usize; 3], Vec<(&'static str, Measured)>);
    let cases: Vec<Case> = vec![
        ("cube", sheared(400_889.8), [9, 9, 9], [17, 17, 17], vec![("E", energy), ("Fx", across), ("Fz", along)]),
        ("twist", twisted(), [5, 5, 17], [9, 9, 33], vec![("E", energy), ("M", moment), ("Fz", along)]),
        ("torsion", cylinder(), [9, 9, 5], [13, 13, 9], vec![("E", energy), ("M", moment), ("Fz", along)]),
        ("pressed", patch(), [7, 7, 7], [13, 13, 13], vec![("E", energy), ("Fz", along)]),
        ("bent", bent(), [4, 4, 13], [9, 9, 33], vec![("E", energy)]),
        ("sphere", sphere(), [7, 7, 5], [13, 13, 9], vec![("E", energy)]),
    ];
    for (name, scene, counts, fine, measured) in cases {
        let solve = |scheme: Scheme| {
            let start = Instant::now();
            let problem = scene.discretize(&scheme).ok()?;
            let path = problem.run(&mut ()).ok()?.completed().ok()?;
            let seconds = start.elapsed().as_secs_f64();
            Some((measured.iter().map(|m| m.1(&problem, path.last())).collect::<Vec<_>>(), path.iterations, seconds))
        };
        let Some((reference, ..)) = solve(Scheme::elements(2).particles(fine)) else {
            println!("{name},no reference");
            continue;
        };
        for r in [0.75, 1.0, 1.15] {
            let Some((found, iterations, seconds)) = solve(Scheme::default().dilation(r).particles(counts)) else {
                println!("{name}_{r},stalled");
                continue;
            };
            for (k, (what, _)) in measured.iter().enumerate() {
                println!("{name}_{what}_r{r},{:.4}", found[k] / reference[k] - 1.0);
            }
            println!("{name}_r{r}_iterations,{iterations}");
            println!("{name}_r{r}_seconds,{seconds:.3}");
        }
        for (k, (what, _)) in measured.iter().enumerate() {
            println!("{name}_{what}_reference,{:.6}", reference[k]);
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
        ("r0.75_factors", 13, Scheme::default().dilation(0.75).solving(Solving::Direct)),
        ("factors", 13, Scheme::default().solving(Solving::Direct)),
        ("iteration", 9, Scheme::default().solving(Solving::Krylov)),
        ("iteration", 13, Scheme::default().solving(Solving::Krylov)),
        ("order2", 5, Scheme::default().order(2)),
        ("order2", 9, Scheme::default().order(2)),
        ("q2p1", 9, Scheme::elements(2)),
        ("q2p1", 13, Scheme::elements(2)),
    ] {
        let start = Instant::now();
        let Ok(problem) = sheared(400_889.8).discretize(&scheme.particles([n])) else { continue };
        let tables = start.elapsed().as_secs_f64();
        let Ok(Ok(path)) = problem.run(&mut ()).map(EquilibriumPath::completed) else {
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
            problem.analysis().solver.directions()
        );
    }
}

/// Directions of the iteration over sizes and bulk moduli.
fn iteration() {
    for (n, ratio) in [(9, 1e2), (9, 1e3), (9, 1e5), (13, 1e3), (17, 1e3), (22, 1e2), (22, 1e3), (22, 1e5)] {
        let start = Instant::now();
        let scheme = Scheme::default().solving(Solving::Krylov).particles([n]);
        let problem = match sheared(2.0 * 40.097 * ratio).discretize(&scheme) {
            Ok(problem) => problem,
            Err(error) => {
                println!("iteration_{n},{error}");
                continue;
            }
        };
        let ended = problem.run(&mut ()).map(|path| path.completed().map(|p| p.iterations).map_err(|e| e.to_string()));
        println!(
            "iteration_{n}_{ratio:e},{:?},{ended:?},{:.2} s",
            problem.analysis().solver.directions(),
            start.elapsed().as_secs_f64()
        );
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let asked = |name: &str| arguments.iter().any(|a| a == name);
    let all = !["supports", "cube", "iteration"].iter().any(|part| asked(part));
    for (name, run) in [("supports", supports as fn()), ("cube", cube), ("iteration", iteration)] {
        if all || asked(name) {
            support::on_threads(1, run);
        }
    }
}
