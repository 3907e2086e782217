//! How close each phase is to what the machine allows: `cargo bench -p rkpm-benches --bench limits`.
//!
//! Loops are measured in one process, interleaved with products of matrices by faer, and given as a share of
//! their speed: shares travel between machines and survive a busy one, seconds do not. Speeds are
//! counted as full blocks, 2 D³ operations per pair of neighbours and point, though only one half is formed.
//! Prints a table of `name,value` rows. Fresh processes of the same program measure memory.

mod support;

use std::time::Instant;

use faer::{Accum, Mat, Par};
use rkpm::assembly::{Model, StateRef, System};
use rkpm::kinematics::Kinematics;
use rkpm::linear::LinearSystem;
use rkpm::prelude::*;
use rkpm::solve::State;

/// Rounds of interleaved measurements with one thread and with two.
const ROUNDS: usize = 12;
/// Rounds of short ones, of which the best counts on either side: on a busy machine only the fastest is
/// undisturbed.
const SHORT_ROUNDS: usize = 60;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Seconds of one call, repeated until a measurement takes half a millisecond at least.
fn seconds(mut f: impl FnMut()) -> f64 {
    let mut repeats = 1;
    loop {
        let start = Instant::now();
        for _ in 0..repeats {
            f();
        }
        let taken = start.elapsed().as_secs_f64();
        if taken > 5e-4 {
            return taken / repeats as f64;
        }
        repeats *= 2;
    }
}

/// Operations per second of a product of square matrices on one thread.
fn dgemm(matrices: &mut [Mat<f64>; 3]) -> f64 {
    let n = matrices[0].nrows();
    let [a, b, c] = matrices;
    let taken = seconds(|| {
        faer::linalg::matmul::matmul(c.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), 1.0, Par::Seq);
    });
    2.0 * (n as f64).powi(3) / taken
}

/// Full-block operations of one assembly of a body's table.
fn operations<const D: usize>(table: &ShapeTable<D>) -> f64 {
    let pairs: usize = (0..table.point_count()).map(|point| table.nodes(point).len().pow(2)).sum();
    2.0 * (D as f64).powi(3) * pairs as f64
}

/// Measures `ours` and dgemm in turn; the ratio of their best, and our operations per second.
fn share(operations: f64, mut ours: impl FnMut() -> f64) -> (f64, f64) {
    // Large enough for full speed, small enough to finish between two interruptions.
    let mut matrices = std::array::from_fn(|k| Mat::from_fn(384, 384, |i, j| ((i + j + k) as f64).sin()));
    let (mut product, mut least) = (0.0f64, f64::INFINITY);
    for _ in 0..SHORT_ROUNDS {
        product = product.max(dgemm(&mut matrices));
        least = least.min(ours());
    }
    (operations / least / product, operations / least)
}

/// The point kernel alone: what the matrix costs beyond the forces, on one cluster whose points all see all
/// `counts` nodes.
fn kernel<const D: usize>(name: &str, kinematics: impl Kinematics<D>, counts: [usize; D], r: f64) {
    let lattice = Block::new([0.0; D], [1.0; D]).lattice(counts).expect("a lattice");
    let points = lattice.gauss_in(4, &lattice.zones(counts[0] - 1)).expect("a rule");
    let particles = lattice.particles(r).expect("a dilation");
    let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).expect("particles");
    let table = ShapeTable::new(&rk, &points, &kinematics).expect("covered points");
    let neighbours = table.nodes(0).len();
    let operations = operations(&table);
    let rubber = Rubber::neo_hookean(0.5, 1e3).expect("constants");
    let mut model = Model::new(lattice.positions());
    model.add(Body::new(table, rubber, PressureField::Pointwise));
    let (d, terms) = (support::moved(&model), model.start());
    let mut assembler = model.assembler();
    let mut system = System::default();
    // The best of either, or a disturbed residual would flatter the difference.
    let residual = (0..SHORT_ROUNDS)
        .map(|_| seconds(|| drop(model.at(StateRef::new(&d, &terms, 1.0)).unwrap().residual())))
        .fold(f64::INFINITY, f64::min);
    let (share, speed) = share(operations, || {
        seconds(|| assembler.assemble(&model, StateRef::new(&d, &terms, 1.0), &mut system).unwrap()) - residual
    });
    println!("kernel_{name}_neighbours,{neighbours}");
    println!("kernel_{name}_gflops,{:.2}", speed * 1e-9);
    println!("kernel_{name}_of_dgemm,{share:.3}");
}

/// The whole assembly: gradients, material, zones, sums into the sparse matrix.
fn assembly<const D: usize>(name: &str, scene: &Scene<D>, scheme: &Scheme) {
    let problem = scene.discretize(scheme).expect("a scene");
    let (model, table) = (problem.model(), problem.body().table());
    let state = State::at_rest(model, problem.equations());
    let d = support::moved(model);
    let mut assembler = model.assembler();
    let mut system = System::default();
    let neighbours =
        (0..table.point_count()).map(|p| table.nodes(p).len()).sum::<usize>() as f64 / table.point_count() as f64;
    let (share, speed) = share(operations(table), || {
        seconds(|| assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap())
    });
    println!("assembly_{name}_neighbours,{neighbours:.1}");
    println!("assembly_{name}_gflops,{:.2}", speed * 1e-9);
    println!("assembly_{name}_of_dgemm,{share:.3}");
}

/// Assembly against factorisation in a Newton iteration of 1e5 unknowns in 2D.
fn iteration() {
    let problem = support::membrane().discretize(&support::scheme(224)).expect("a scene");
    let model = problem.model();
    let state = State::at_rest(model, problem.equations());
    let (_, values, mut solver) = support::reduced(&problem);
    let others: Vec<f64> = values.iter().map(|v| 2.0 * v).collect();
    let mut assembler = model.assembler();
    let mut system = System::default();
    let d = support::moved(model);
    let (mut assemblies, mut factorisations) = (Vec::new(), Vec::new());
    for round in 0..5 {
        let start = Instant::now();
        assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap();
        assemblies.push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        solver.factorize(&LinearSystem::of(if round % 2 == 0 { &values } else { &others })).expect("a regular matrix");
        factorisations.push(start.elapsed().as_secs_f64());
    }
    let (assembly, factorisation) = (median(assemblies), median(factorisations));
    println!("iteration_2d_unknowns,{}", model.unknowns());
    println!("iteration_2d_assembly_seconds,{assembly:.4}");
    println!("iteration_2d_factorisation_seconds,{factorisation:.4}");
    println!("iteration_2d_assembly_over_factorisation,{:.3}", assembly / factorisation);
}

/// One thread over two, on a 3D body of 1e4 particles.
fn threads() {
    let scene = support::cube();
    let lattice = Block::new([0.0; 3], [1.0; 3]).lattice([22; 3]).expect("a lattice");
    let smoothing = lattice.smoothing(2, 2, &lattice.zones(2)).expect("a rule");
    let particles = lattice.particles(1.0).expect("a dilation");
    let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).expect("particles");
    let problem = scene.discretize(&support::scheme(22)).expect("a scene");
    let (model, state) = (problem.model(), State::at_rest(problem.model(), problem.equations()));
    let d = support::moved(model);
    let measure = |threads: usize| {
        support::on_threads(threads, || {
            let start = Instant::now();
            drop(ShapeTable::smoothed(&rk, &smoothing, &Solid).expect("covered points"));
            let tabulation = start.elapsed().as_secs_f64();
            let mut assembler = model.assembler();
            let mut system = System::default();
            // The first assembly grows the buffers.
            assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap();
            let start = Instant::now();
            assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap();
            [tabulation, start.elapsed().as_secs_f64()]
        })
    };
    // The best of either: a moment that disturbs one of two threads disturbs both.
    let (mut one, mut two) = ([f64::INFINITY; 2], [f64::INFINITY; 2]);
    for _ in 0..ROUNDS {
        for (best, threads) in [(&mut one, 1), (&mut two, 2)] {
            let measured = measure(threads);
            *best = [best[0].min(measured[0]), best[1].min(measured[1])];
        }
    }
    println!("threads_3d_tabulation_one_over_two,{:.2}", one[0] / two[0]);
    println!("threads_3d_assembly_one_over_two,{:.2}", one[1] / two[1]);
}

/// Seconds of each phase over sizes and the exponents between them.
fn slopes<const D: usize>(name: &str, scene: &Scene<D>, counts: &[usize]) {
    let mut before: Option<(f64, [f64; 5])> = None;
    for &n in counts {
        let scheme = support::scheme(n);
        let mut problem = scene.discretize(&scheme).expect("a scene");
        let tabulation = median(
            (0..3)
                .map(|_| {
                    let start = Instant::now();
                    problem = scene.discretize(&scheme).expect("a scene");
                    start.elapsed().as_secs_f64()
                })
                .collect(),
        );
        let model = problem.model();
        let state = State::at_rest(model, problem.equations());
        let d = support::moved(model);
        let (reduction, values, mut solver) = support::reduced(&problem);
        let others: Vec<f64> = values.iter().map(|v| 2.0 * v).collect();
        let mut bound = support::bound(&problem);
        let start = Instant::now();
        drop(problem.analysis().bound_solver(model, &mut bound).expect("a pattern"));
        let analysis = start.elapsed().as_secs_f64();
        let mut assembler = model.assembler();
        let mut system = System::default();
        let assembly = median(
            (0..3)
                .map(|_| {
                    seconds(|| assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap())
                })
                .collect(),
        );
        let mut turn = false;
        let factorisation = median(
            (0..3)
                .map(|_| {
                    seconds(|| {
                        turn = !turn;
                        solver
                            .factorize(&LinearSystem::of(if turn { &values } else { &others }))
                            .expect("a regular matrix");
                    })
                })
                .collect(),
        );
        let system = LinearSystem::of(&values);
        solver.factorize(&system).expect("a regular matrix");
        let mut x = vec![1.0; reduction.unknowns()];
        let solution = seconds(|| {
            x.fill(1.0);
            solver.solve(&system, &mut x, None).expect("a regular matrix");
        });
        let unknowns = model.unknowns() as f64;
        let phases = [tabulation, assembly, analysis, factorisation, solution];
        let names = ["discretize", "assemble", "analyze", "factorize", "solve"];
        for (k, phase) in names.iter().enumerate() {
            print!("{phase}_{name}_{unknowns},{:.3e}", phases[k]);
            if let Some((smaller, earlier)) = &before {
                print!(",slope {:.2}", (phases[k] / earlier[k]).ln() / (unknowns / smaller).ln());
            }
            println!();
        }
        before = Some((unknowns, phases));
    }
}

/// The most memory that this process has held, in bytes; known on Linux alone.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

/// Runs one analysis and compares the peak of memory with table, matrix and factor.
fn memory<const D: usize>(name: &str, scene: &Scene<D>, n: usize) {
    let idle = peak().unwrap_or(f64::NAN);
    let problem = scene.discretize(&support::scheme(n)).expect("a scene");
    let tabulated = peak().unwrap_or(f64::NAN) - idle;
    problem.run().expect("a model").completed().expect("full load");
    let peak = peak().unwrap_or(f64::NAN) - idle;
    let (_, values, mut solver) = support::reduced(&problem);
    solver.factorize(&LinearSystem::of(&values)).expect("a regular matrix");
    let table = problem.body().table().bytes() as f64;
    let matrix = 12.0 * values.len() as f64;
    let factor = solver.bytes().map_or(f64::NAN, |bytes| bytes as f64);
    let particles = problem.model().node_count() as f64;
    println!("bytes_per_particle_{name}_table,{:.0}", table / particles);
    println!("bytes_per_particle_{name}_matrix,{:.0}", matrix / particles);
    println!("bytes_per_particle_{name}_factor,{:.0}", factor / particles);
    println!("bytes_per_particle_{name}_peak_of_tabulation,{:.0}", tabulated / particles);
    println!("bytes_per_particle_{name}_peak,{:.0}", peak / particles);
    println!("peak_over_table_matrix_factor_{name},{:.2}", peak / (table + matrix + factor));
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let requested = |name: &str| arguments.iter().any(|a| a == name);
    if requested("memory_2d") {
        return support::on_threads(1, || memory("2d", &support::membrane(), 200));
    }
    if requested("memory_3d") {
        return support::on_threads(1, || memory("3d", &support::cube(), 19));
    }
    // `cargo bench -p rkpm-benches --bench limits -- kernel` measures one part alone.
    let parts = ["kernel", "assembly", "iteration", "threads", "slopes", "memory"];
    let all = !parts.iter().any(|part| requested(part));
    support::on_threads(1, || {
        if all || requested("kernel") {
            kernel("2d", PlaneStrain, [6, 6], 3.0);
            kernel("3d", Solid, [3, 3, 3], 1.5);
        }
        if all || requested("assembly") {
            assembly("2d_default", &support::membrane(), &support::scheme(33));
            assembly("2d_r1.5", &support::membrane(), &support::scheme(33).dilation(1.5));
            assembly("3d_default", &support::cube(), &support::scheme(9));
            assembly("3d_r0.75", &support::cube(), &support::scheme(13).dilation(0.75));
        }
        if all || requested("iteration") {
            iteration();
        }
    });
    if all || requested("threads") {
        threads();
    }
    if all || requested("slopes") {
        support::on_threads(1, || {
            slopes("2d", &support::membrane(), &[17, 33, 65, 129]);
            slopes("3d", &support::cube(), &[5, 9, 13]);
        });
    }
    if all || requested("memory") {
        // A fresh process each: the peak is that of its whole life. Models large enough that what is given back goes
        // back to the system: of smaller ones the allocator keeps up to 64 MB.
        for part in ["memory_2d", "memory_3d"] {
            let program = std::env::current_exe().expect("the path of this program");
            std::process::Command::new(program).arg(part).status().expect("a process of this program");
        }
    }
}
