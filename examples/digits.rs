//! The last digits of eight scenes: whether a change of the code has changed a result.
//!
//! `cargo run --release --features serde --example digits [-- --out DIR]` writes for each scene a hash of the bits of all states of
//! its path (`states.csv`), and the norm of its last displacement with the count of iterations (`summary.csv`).
//! `just digits COMMIT` compares these, and the summaries of other examples, with those of another commit.
//! With `--scene NAME` it runs that scene alone, which may also be `cube_9`, `cube_13` (particles a side) or `ring_fine`:
//! `just instructions COMMIT` counts their instructions.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::material::{Prony, Viscoelastic};
use rkpm::output::{Journal, Table};
use rkpm::prelude::*;
use support::Summary;

/// The hash of Fowler, Noll and Vo with 64 bits (FNV-1a).
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Hash(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn path(mut self, path: &EquilibriumPath) -> Self {
        for state in std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state)) {
            let own = state.terms.iter().flat_map(|own| own.condensed.iter().chain(&own.history));
            let numbers = state.displacement.iter().chain(own).chain(&state.multipliers);
            for number in numbers.chain([&state.load]) {
                self.bytes(&number.to_bits().to_le_bytes());
            }
        }
        self
    }
}

fn tube() -> Result<Problem<1>, rkpm::Error> {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa, cm
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46);
    scene.discretize(&Scheme::default().particles([9]))
}

fn disk() -> Result<Problem<2>, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?; // MPa, cm
    Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), 0.145)
        .discretize(&Scheme::default().particles([11, 2]))
}

fn cook() -> Result<Problem<2>, rkpm::Error> {
    let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
    Scene::new(Quadrilateral { corners }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25])
        .discretize(&Scheme::default().particles([9]))
}

fn cube(side: usize) -> Result<Problem<3>, rkpm::Error> {
    Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, Rubber::neo_hookean(0.5, 1e3)?)
        .hold((2, Side::Min))
        .traction((2, Side::Max), [0.05, 0.0, 0.05])
        .discretize(&Scheme::default().particles([side]))
}

/// A sector of a quarter turn between two radii.
fn quarter(name: &str, inner: f64, outer: f64) -> Result<Region, rkpm::Error> {
    let side = |which: &str| format!("{name} {which}");
    let outline = Outline::at([inner, 0.0]).line(&side("bottom"), [outer, 0.0]);
    let outline = outline.arc(&side("rim"), [0.0, outer], [0.0, 0.0], Turn::Left);
    let outline = outline.line(&side("left"), [0.0, inner]);
    Ok(Region::new(outline.arc(&side("bore"), [inner, 0.0], [0.0, 0.0], Turn::Right))?)
}

/// Both straight sides of a sector are planes of symmetry.
fn symmetric(scene: Scene<2>, name: &str) -> Scene<2> {
    scene.prescribe(&*format!("{name} bottom"), 1, 0.0).prescribe(&*format!("{name} left"), 0, 0.0)
}

/// The quarter of a ring, pressed by a plate with friction.
fn ring(spacing: f64) -> Result<Problem<2>, rkpm::Error> {
    let plate = RigidSurface::plane([0.0, 0.2], [0.0, -1.0]).moving([0.0, -0.04]).friction(0.2).named("plate");
    let scene = Scene::new(quarter("ring", 0.12, 0.2)?, PlaneStrain, Rubber::mooney_rivlin(0.293, 0.177, 1410.0)?);
    symmetric(scene, "ring").contact("ring rim", plate).discretize(&Scheme::default().spacing(spacing))
}

/// Two tubes of rubber, the inner one too large for the outer.
fn press_fit() -> Result<Problem<2>, rkpm::Error> {
    let rubber = Rubber::neo_hookean(0.25, 20.0)?;
    let pair = Scene::assembly(PlaneStrain)
        .body("bush", quarter("bush", 0.9, 2.0)?, rubber.clone())
        .body("sleeve", quarter("sleeve", 0.4, 1.0)?, rubber)
        .press_fit("sleeve rim", "bush bore", "fit");
    symmetric(symmetric(pair, "bush"), "sleeve").discretize(&Scheme::default().particles([12]))
}

/// A pad of a relaxing rubber, sheared suddenly and held.
fn relaxation() -> Result<Problem<2>, rkpm::Error> {
    let series = Prony::of_instantaneous([(0.2, 0.1), (0.15, 1.0), (0.1, 10.0)])?;
    let course = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)])?;
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (0.4, 1.0), (1.0, 50.0)])?;
    let material = Viscoelastic::new(Rubber::neo_hookean(0.4, 8e3)?, series);
    Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, material)
        .hold((1, Side::Min))
        .with(Condition::on((1, Side::Max)).displacement([5.0, 0.0]).amplitude(course))
        .with_clock(clock)
        .discretize(&Scheme::default().particles([9, 4]))
}

/// What is known of all scenes so far.
struct Digits {
    summary: Summary,
    states: Table,
}

impl Digits {
    fn add(&mut self, name: &str, path: &EquilibriumPath, hash: Hash) -> Result<(), Box<dyn Error>> {
        let norm = path.last().displacement.iter().map(|d| d * d).sum::<f64>().sqrt();
        self.summary.note(name, norm)?.note(format!("iterations_{name}"), path.iterations as f64)?;
        self.states.push([name.to_owned(), format!("{:016x}", hash.0)])?;
        Ok(())
    }

    fn run<const D: usize>(&mut self, name: &str, problem: &Problem<D>) -> Result<(), Box<dyn Error>> {
        let path = problem.run()?.completed()?;
        self.add(name, &path, Hash::new().path(&path))
    }
}

/// The disk into a journal, broken off at half of its steps, and resumed from there; the hash is of the journal too.
fn resumed(digits: &mut Digits, out: &FilePath) -> Result<(), Box<dyn Error>> {
    let (problem, file) = (disk()?, out.join("disk.jsonl"));
    std::fs::create_dir_all(out)?;
    if file.exists() {
        std::fs::remove_file(&file)?;
    }
    let mut journal = Journal::create(&file, &problem.at_rest())?;
    let whole = problem.run_with(&mut journal)?.completed()?;
    journal.close(&whole)?;
    let mut half = Journal::read(&file)?;
    half.steps.truncate(whole.steps.len() / 2);
    half.ending = Ending::Interrupted;
    let path = problem.resume(half, &mut ())?.completed()?;
    let mut hash = Hash::new().path(&path);
    hash.bytes(&std::fs::read(&file)?);
    digits.add("resume", &path, hash)
}

/// Runs a scene by its name.
fn run(digits: &mut Digits, name: &str, out: &FilePath) -> Result<(), Box<dyn Error>> {
    match name {
        "tube" => digits.run(name, &tube()?),
        "disk" => digits.run(name, &disk()?),
        "cook" => digits.run(name, &cook()?),
        "cube" => digits.run(name, &cube(6)?),
        "cube_9" => digits.run(name, &cube(9)?),
        "cube_13" => digits.run(name, &cube(13)?),
        "ring" => digits.run(name, &ring(0.02)?),
        "ring_fine" => digits.run(name, &ring(0.005)?),
        "press_fit" => digits.run(name, &press_fit()?),
        "relaxation" => digits.run(name, &relaxation()?),
        "resume" => resumed(digits, out),
        _ => Err(format!("no scene {name}").into()),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut digits = Digits { summary: Summary::new(), states: Table::new(["scene", "hash"]) };
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, name] = &arguments[..]
        && flag == "--scene"
    {
        run(&mut digits, name, &std::env::temp_dir())?;
        print!("{}", digits.summary);
        return Ok(());
    }
    let out = support::out_dir("digits");
    for name in ["tube", "disk", "cook", "cube", "ring", "press_fit", "relaxation", "resume"] {
        run(&mut digits, name, &out)?;
    }
    print!("{}{}", digits.summary, digits.states.to_csv()?);
    digits.summary.write(out.join("summary.csv"))?;
    digits.states.write(out.join("states.csv"))?;
    Ok(())
}
