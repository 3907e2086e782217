//! GOAL: a scene that several ranks share is the scene: displacement, energy, reactions, steps.
//! GEOMETRY: Cook's membrane, a strip under pressure that follows, a bonded pair, a scattered plate.
//! REFERENCE: the same scene in one process. The ranks are threads here; `petsc/tests/ranks.rs` has processes.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, Mutex};
use std::thread;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use rkpm::assembly::{Pattern, Ranks};
use rkpm::error::LinearError;
use rkpm::linear::{Direct, Inertia, LinearSolver, LinearSystem, MatrixClass};
use rkpm::output::{VtkGrid, VtkValues};
use rkpm::prelude::*;

/// Differences of rounding in sums of other order.
const TOLERANCE: f64 = 1e-10;

/// What threads sum together.
#[derive(Debug)]
pub(crate) struct Exchange {
    pub(crate) gate: Barrier,
    pub(crate) values: Mutex<Vec<Vec<f64>>>,
}

#[derive(Debug, Clone)]
pub(crate) struct Rank {
    pub(crate) rank: usize,
    pub(crate) count: usize,
    pub(crate) exchange: Arc<Exchange>,
}

impl Rank {
    fn meet(&self, values: &mut [f64], join: fn(f64, f64) -> f64) {
        self.exchange.values.lock().unwrap()[self.rank] = values.to_vec();
        self.exchange.gate.wait();
        let all = self.exchange.values.lock().unwrap().clone();
        for (k, value) in values.iter_mut().enumerate() {
            *value = all.iter().map(|own| own[k]).reduce(join).unwrap();
        }
        self.exchange.gate.wait();
    }
}

impl Ranks for Rank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn sum(&self, values: &mut [f64]) {
        self.meet(values, |a, b| a + b);
    }

    fn largest(&self, values: &mut [f64]) {
        self.meet(values, f64::max);
    }
}

/// Factors of the matrix that all have summed, on each of them.
pub(crate) struct Gathered {
    rank: Rank,
    pattern: Pattern,
    whole: Pattern,
    inner: Direct,
    values: Vec<f64>,
}

impl Gathered {
    pub(crate) fn new(rank: Rank) -> Self {
        let (pattern, whole) = Default::default();
        Gathered { rank, pattern, whole, inner: Direct::default(), values: Vec::new() }
    }
}

impl LinearSolver for Gathered {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Gathered::new(self.rank.clone()))
    }

    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
        let size = pattern.size() as u32;
        self.whole = Pattern::from_columns((0..size).map(|column| (column..size).collect()).collect());
        self.pattern = pattern.clone();
        self.inner.analyze(&self.whole, class, None)
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        self.values = vec![0.0; self.whole.entries()];
        for column in 0..self.pattern.size() {
            for (k, &row) in self.pattern.column(column).iter().enumerate() {
                let place = self.whole.find(row as usize, column).unwrap();
                self.values[place] += system.values[self.pattern.columns[column] + k];
            }
        }
        self.rank.sum(&mut self.values);
        self.inner.factorize(&LinearSystem::of(&self.values))
    }

    fn solve(&mut self, _: &LinearSystem<'_>, rhs: &mut [f64], _: Option<&mut [[f64; 4]]>) -> Result<f64, LinearError> {
        self.inner.solve(&LinearSystem::of(&self.values), rhs, None)
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        Some(Arc::new(self.rank.clone()))
    }
}

fn agrees<const D: usize>(scene: &Scene<D>, scheme: &Scheme, place: Place<D>) {
    let alone = scene.discretize(scheme).unwrap();
    let path = alone.run().unwrap().reached().unwrap();
    let expected = path.last();
    let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
    let force = alone.reaction(expected, place.clone()).unwrap();
    let stresses = alone.at_particles(&alone.stresses(expected).unwrap());
    for count in [2, 3] {
        static FOLDERS: AtomicUsize = AtomicUsize::new(0);
        let number = FOLDERS.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("rkpm-scene-on-ranks-{}-{number}", std::process::id()));
        let exchange = Arc::new(Exchange { gate: Barrier::new(count), values: Mutex::new(vec![Vec::new(); count]) });
        let points: usize = thread::scope(|scope| {
            let run = |rank| {
                let (exchange, place) = (exchange.clone(), place.clone());
                let (path, force, alone, stresses, folder) = (&path, &force, &alone, &stresses, &folder);
                scope.spawn(move || {
                    let solver = Gathered::new(Rank { rank, count, exchange });
                    let shared = scene.discretize(&scheme.clone().solver(solver)).unwrap();
                    let found = shared.run().unwrap().reached().unwrap();
                    assert_eq!(found.steps.last().unwrap().doubts.len(), path.steps.last().unwrap().doubts.len());
                    let (state, expected) = (found.last(), path.last());
                    let other = shared.reaction(state, place).unwrap();
                    let means = shared.at_particles(&shared.stresses(state).unwrap());
                    let energy = shared.energy(state).unwrap() / alone.energy(expected).unwrap();
                    assert_eq!((found.iterations, found.steps.len()), (path.iterations, path.steps.len()));
                    let displacement = distance(&state.displacement, &expected.displacement);
                    assert!(displacement <= TOLERANCE * largest(&expected.displacement), "{displacement:e}");
                    assert_abs_diff_eq!(energy, 1.0, epsilon = TOLERANCE);
                    assert!(distance(other.as_slice(), force.as_slice()) <= TOLERANCE * largest(force.as_slice()));
                    let most = stresses.iter().map(|stress| stress.norm()).fold(0.0, f64::max);
                    let off = means.iter().zip(stresses).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                    assert!(off <= 1e2 * TOLERANCE * most, "{off:e}");
                    let [history, expected] = [shared.history(&found), alone.history(path)].map(|found| found.unwrap());
                    assert_eq!(history.header, expected.header);
                    let number =
                        |row: &[rkpm::output::Cell], column: usize| row[column].to_string().parse().unwrap_or(0.0);
                    // Components are measured against the largest of their vector.
                    let kind = |name: &str| name.trim_end_matches(|c: char| c.is_ascii_digit()).to_string();
                    for (column, name) in history.header.iter().enumerate() {
                        let alike = (0..history.header.len()).filter(|&k| kind(&history.header[k]) == kind(name));
                        let size = alike.flat_map(|k| expected.rows.iter().map(move |row| number(row, k)));
                        let size = size.fold(1e-3, |m: f64, x: f64| m.max(x.abs()));
                        for (row, other) in history.rows.iter().zip(&expected.rows) {
                            let off: f64 = number(row, column) - number(other, column);
                            assert!(off.abs() <= TOLERANCE * size, "{name}: {off:e} of {size}");
                        }
                    }
                    pieces_hold_the_grid(&shared.vtk_grid(state).unwrap(), count);
                    shared.write(&found, folder.join("run.pvd")).unwrap();
                    let ranks = shared.model().ranks().unwrap();
                    let weights = ranks.gathered(&shared.weights().collect::<Vec<_>>());
                    assert_eq!(weights.len(), alone.points().count());
                    let volume: f64 = alone.weights().sum();
                    assert_relative_eq!(weights.iter().sum::<f64>(), volume, max_relative = 1e-12);
                    shared.points().count()
                })
            };
            let threads: Vec<_> = (0..count).map(run).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).sum()
        });
        assert_eq!(points, alone.points().count());
        let read = |name: String| std::fs::read_to_string(folder.join(name)).unwrap();
        for state in 0..=path.steps.len() {
            assert!(read("run.pvd".into()).contains(&format!("run_{state:04}.pvtu")));
            for rank in 0..count {
                let piece = format!("run_{state:04}_{rank}.vtu");
                assert!(read(format!("run_{state:04}.pvtu")).contains(&piece) && read(piece).ends_with("</VTKFile>\n"));
            }
        }
        assert_eq!(read("run.csv".into()).lines().count(), alone.history(&path).unwrap().rows.len() + 1);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

/// Supports as narrow as the particles stand along a block do not cover its fine end across: the rank with that end cannot discretise its share, and none waits for it.
#[test]
fn all_refuse_what_one_cannot_discretise() {
    let rubber = Rubber::neo_hookean(0.5, 100.0).unwrap();
    let scene = Scene::new(Block::new([0.0, 0.0], [8.0, 1.0]), PlaneStrain, rubber)
        .hold(Side::Min)
        .traction(Side::Max, [0.1, 0.0]);
    let dense = Layout::Graded(Arc::new(|axis, t| if axis == 0 { t * t } else { t }));
    let scheme =
        Scheme::default().particles([33, 5]).layout(dense).dilation(Dilation::Neighbour { rank: 1, factor: 2.2 });
    let exchange = Arc::new(Exchange { gate: Barrier::new(2), values: Mutex::new(vec![Vec::new(); 2]) });
    let errors: Vec<Error> = thread::scope(|scope| {
        let run = |rank| {
            let (exchange, scene, scheme) = (exchange.clone(), &scene, &scheme);
            scope.spawn(move || {
                let solver = Gathered::new(Rank { rank, count: 2, exchange });
                scene.discretize(&scheme.clone().solver(solver)).map(|_| ()).unwrap_err()
            })
        };
        let threads: Vec<_> = (0..2).map(run).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let waits = |error: &&Error| matches!(error, Error::Incompatible(_));
    assert_eq!(errors.iter().filter(waits).count(), 1, "{errors:?}");
    assert!(errors.iter().any(|error| matches!(error, Error::Approximation(_))), "{errors:?}");
}

/// Whether each cell stands in one piece, with the same points and the same values on them and on itself.
fn pieces_hold_the_grid(grid: &VtkGrid, parts: usize) {
    let mut cell = 0;
    let mut seen = vec![false; grid.points.len()];
    for part in 0..parts {
        let piece = grid.piece(part, parts).unwrap();
        piece.to_xml().unwrap();
        for (own, corners) in piece.cells.iter().map(|cell| cell.corners()).enumerate() {
            assert_eq!(corners.len(), grid.cells[cell].corners().len());
            for (&a, &b) in corners.iter().zip(grid.cells[cell].corners()) {
                assert_eq!(piece.points[a], grid.points[b]);
                seen[b] = true;
                for (mine, all) in piece.point_data.iter().zip(&grid.point_data) {
                    assert_eq!((&mine.name, entry(&mine.values, a)), (&all.name, entry(&all.values, b)));
                }
            }
            for (mine, all) in piece.cell_data.iter().zip(&grid.cell_data) {
                assert_eq!((&mine.name, entry(&mine.values, own)), (&all.name, entry(&all.values, cell)));
            }
            cell += 1;
        }
    }
    assert_eq!(cell, grid.cells.len());
    assert!(seen.iter().all(|&seen| seen));
}

fn entry(values: &VtkValues, place: usize) -> Vec<f64> {
    match values {
        VtkValues::Integers(values) => vec![values[place] as f64],
        VtkValues::Scalars(values) => vec![values[place]],
        VtkValues::Vectors(values) => values[place].to_vec(),
        VtkValues::Tensors(values) => values[place].to_vec(),
        _ => panic!("a kind of values without a test"),
    }
}

fn rubber(ratio: f64) -> Rubber {
    Rubber::neo_hookean(0.5, ratio).unwrap()
}

#[test]
fn a_lattice_is_shared() {
    let shape = Quadrilateral { corners: [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] };
    let scene = Scene::new(shape, PlaneStrain, rubber(1e4)).hold((0, Side::Min)).traction((0, Side::Max), [0.0, 0.07]);
    agrees(&scene, &Scheme::default().particles([7, 7]), (0, Side::Min).into());
    agrees(&scene, &Scheme::elements(2).particles([7, 7]), (0, Side::Min).into());
}

/// Contact is replicated on all ranks: a shaft that rubs along a block, a plate pushed onto it, a block that rubs along another one, a ball in
/// space. `docs/combinations.md` has contact of a body with itself.
#[test]
fn contact_is_shared() {
    let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e3)).hold((1, Side::Min));
    let scheme = Scheme::default().particles([9, 5]);
    let place = || Place::from((1, Side::Min));
    let shaft = RigidSurface::shaft([0.9, 1.5], 0.5).moving([0.1, -0.2]).friction(0.4);
    agrees(&block.clone().contact((1, Side::Max), shaft), &scheme, place());
    let plate = RigidSurface::plane([1.0, 1.0], [0.0, -1.0]).pushed([0.0, -0.2]);
    agrees(&block.contact((1, Side::Max), plate), &scheme, place());
    let upper = Block::new([0.5, 1.05], [1.5, 2.0]);
    let two = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber(1e3))
        .body("upper", upper, rubber(1e3))
        .hold(Place::on((1, Side::Min)).of("lower"))
        .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.1, -0.2]));
    let [below, above] = [Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper")];
    let joint = ContactPair::between(below, above, "joint").friction(0.3);
    agrees(&two.with(joint), &scheme, Place::on((1, Side::Min)).of("lower"));
    let ball = RigidSurface::sphere([1.0, 1.0, 2.0], 1.0).moving([0.0, 0.0, -0.3]);
    let pad = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, rubber(1e3)).hold((2, Side::Min));
    agrees(&pad.contact((2, Side::Max), ball), &Scheme::default().particles([5, 5, 4]), (2, Side::Min).into());
}

#[test]
fn a_pressure_that_follows_is_shared() {
    let scene = Scene::new(Block::new([0.0, 0.0], [6.0, 1.0]), PlaneStrain, rubber(1e3))
        .hold((0, Side::Min))
        .pressure((1, Side::Max), 0.01);
    agrees(&scene, &Scheme::default().particles([13, 3]), (0, Side::Min).into());
}

#[test]
fn bonded_bodies_and_scattered_particles_are_shared() {
    let plate = Outline::at([0.0, 0.0])
        .line("bottom", [2.0, 0.0])
        .line("right", [2.0, 1.0])
        .line("top", [0.0, 1.0])
        .close("left");
    let scene = Scene::assembly(PlaneStrain)
        .body("soft", Region::new(plate).unwrap(), rubber(1e2))
        .body("stiff", Block::new([0.0, 1.0], [2.0, 1.5]), Rubber::neo_hookean(5.0, 1e3).unwrap())
        .hold(Place::on("bottom").of("soft"))
        .with(Condition::on(Place::on((1, Side::Max)).of("stiff")).displacement([0.2, -0.05]));
    let scheme = Scheme::default().spacing(0.25).seed(3);
    agrees(&scene, &scheme, Place::on("bottom").of("soft"));
}
