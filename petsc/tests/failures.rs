//! GOAL: a rank that fails ends all of them with one message; what was recorded is read and resumed, with the same state to rounding:
//! factors over several ranks add up what arrives in turn, and do so in another order each time.
//! GEOMETRY: a strip bent by pressure in eight steps, on two ranks; one of them is killed, fails, panics, asks for memory that is
//! not there, or all of them stall.
//!
//! Started without `mpirun` this program starts itself with it, once for each way to fail.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};
use std::sync::Arc;

use rkpm::material::{Material, Prony, Viscoelastic};
use rkpm::output::Journal;
use rkpm::prelude::*;
use rkpm::solve::{Newton, Step};
use rkpm_petsc::{Journals, Mumps, Session, on_all_ranks};

const RANKS: usize = 2;
/// Names of the variables that tell a started program what to do, and where.
const WAY: &str = "RKPM_FAILURE";
const FOLDER: &str = "RKPM_FOLDER";
/// Where it is set the rubber creeps: points remember.
const CREEPS: &str = "RKPM_CREEPS";
/// States of runs that were resumed, or are on different numbers of ranks, relative to the largest displacement.
const ROUNDING: f64 = 1e-10;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> ExitCode {
    match (std::env::var(WAY), std::env::var_os(FOLDER)) {
        (Ok(way), Some(folder)) => on_all_ranks(|session| started(session, &way, Path::new(&folder))),
        _ => match drive() {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
    }
}

/// Fails after the third step on the last rank.
struct Fate<'a> {
    way: &'a str,
    rank: usize,
    steps: usize,
}

impl Observer for Fate<'_> {
    fn step(&mut self, _: &Step) -> ControlFlow<()> {
        self.steps += 1;
        if self.steps == 3 && self.rank + 1 == RANKS {
            match self.way {
                "killed" => {
                    let _ = Command::new("kill").args(["-9", &std::process::id().to_string()]).status();
                }
                "stops" => return ControlFlow::Break(()),
                "panics" => panic!("an observer gave up"),
                "memory" => drop(std::hint::black_box(vec![1u8; isize::MAX as usize / 4])),
                _ => {}
            }
        }
        ControlFlow::Continue(())
    }
}

fn started(session: &Session, way: &str, folder: &Path) -> Outcome<()> {
    let ratio = if way == "other" { 0.6 } else { 0.5 };
    let rubber = Rubber::neo_hookean(ratio, 1e3)?;
    let rubber: Arc<dyn Material> = match std::env::var(CREEPS).is_ok() {
        true => Arc::new(Viscoelastic::new(rubber, Prony::of_instantaneous([(0.4, 2.0)])?)),
        false => Arc::new(rubber),
    };
    let scene = Scene::new(Block::new([0.0, 0.0], [6.0, 1.0]), PlaneStrain, rubber)
        .hold((0, Side::Min))
        .with_clock(Amplitude::Table(vec![(0.0, 0.0), (1.0, 5.0)]))
        .pressure((1, Side::Max), 0.01)
        // All ranks know what touches and how far it has slipped.
        .contact((1, Side::Min), RigidSurface::shaft([4.5, -0.6], 0.5).friction(0.3).named("shaft"));
    let mut scheme = Scheme::default().particles([25, 5]).stepping(Stepping::equal(8)).solver(Mumps::new(session));
    if way == "stalls" {
        scheme = scheme.newton(Newton { iterations: 1, ..Newton::default() });
    }
    let problem = scene.discretize(&scheme)?;
    let file = folder.join("run.jsonl");
    let (mut journal, so_far) = if matches!(way, "resumed" | "other") {
        Journals::reopen(session, &file, &problem)?
    } else {
        (Journals::create(session, &file, &problem)?, EquilibriumPath::from(problem.at_rest()))
    };
    if way == "fails" && session.rank() + 1 == RANKS {
        return Err("this rank has no license".into());
    }
    let mut fate = Fate { way, rank: session.rank(), steps: so_far.steps.len() };
    let path = problem.resume(so_far, &mut (&mut journal, &mut fate))?;
    journal.close(&path)?;
    if way == "stops" {
        return Ok(());
    }
    let path = path.completed()?;
    let last = path.last();
    ensure(problem.contact(last, "shaft")?.force.norm() > 0.0, "the strip does not come to lie on the shaft")?;
    if session.rank() == 0 {
        let numbers: Vec<String> = last.displacement.iter().map(|x| format!("{x:e}")).collect();
        std::fs::write(folder.join("displacement"), numbers.join("\n"))?;
    }
    Ok(())
}

fn launch(way: &str, folder: &Path, ranks: usize) -> Outcome<Output> {
    launch_with(way, folder, ranks, &[])
}

fn launch_with(way: &str, folder: &Path, ranks: usize, set: &[&str]) -> Outcome<Output> {
    let mut command = Command::new("mpirun");
    command.args(["-n", &ranks.to_string(), "--oversubscribe", "--bind-to", "none"]);
    // Ranks that wait for ever are a failure of the test.
    command.args(["--timeout", "100"]);
    // Allowed to the owner of a container.
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    // Ranks that wait leave the processors to those that work: there may be more of them than processors.
    command.env("OMPI_MCA_mpi_yield_when_idle", "1").env("RAYON_NUM_THREADS", "1").env("OMP_NUM_THREADS", "1");
    command.arg(std::env::current_exe()?).env(WAY, way).env(FOLDER, folder);
    command.envs(set.iter().map(|name| (name, "1")));
    Ok(command.output()?)
}

fn ensure(holds: bool, what: impl std::fmt::Display) -> Outcome<()> {
    if holds { Ok(()) } else { Err(what.to_string().into()) }
}

fn drive() -> Outcome<()> {
    let all: PathBuf = std::env::temp_dir().join(format!("rkpm-ranks-{}", std::process::id()));
    let outcome = drive_in(&all);
    let _ = std::fs::remove_dir_all(&all);
    outcome
}

fn drive_in(all: &Path) -> Outcome<()> {
    let folder = |way: &str| -> Outcome<PathBuf> {
        let folder = all.join(way);
        std::fs::create_dir_all(&folder)?;
        Ok(folder)
    };
    let whole = folder("whole")?;
    let done = launch("whole", &whole, RANKS)?;
    ensure(done.status.success(), String::from_utf8_lossy(&done.stderr))?;
    let undisturbed = displacement(&whole)?;
    for way in ["killed", "fails", "panics", "memory", "stalls"] {
        let folder = folder(way)?;
        let failed = launch(way, &folder, RANKS)?;
        let printed = String::from_utf8_lossy(&failed.stderr).into_owned();
        ensure(!failed.status.success(), format!("{way}: the ranks ended well"))?;
        let own = printed.lines().filter(|line| line.starts_with("rank ")).count();
        let expected = usize::from(matches!(way, "fails" | "panics" | "stalls"));
        ensure(own == expected, format!("{way}: {own} messages\n{printed}"))?;
        let journals = (0..RANKS).map(|rank| Journal::read(folder.join(format!("run.{rank}_of_{RANKS}.jsonl"))));
        let steps: Vec<usize> = journals.map(|path| path.map(|path| path.steps.len())).collect::<Result<_, _>>()?;
        println!(
            "{way}: steps recorded {steps:?}; {}",
            printed.lines().find(|line| line.starts_with("rank ")).unwrap_or("")
        );
        if matches!(way, "fails" | "stalls") {
            continue;
        }
        ensure(steps.iter().all(|&steps| steps >= 2), format!("{way}: steps recorded {steps:?}"))?;
        // Another scene, and then what belongs there.
        let other = launch("other", &folder, RANKS)?;
        let printed = String::from_utf8_lossy(&other.stderr).into_owned();
        ensure(
            !other.status.success() && printed.contains("does not belong to this problem"),
            format!("{way}: another scene went on\n{printed}"),
        )?;
        let resumed = launch("resumed", &folder, RANKS)?;
        ensure(resumed.status.success(), format!("{way}: {}", String::from_utf8_lossy(&resumed.stderr)))?;
        let off = differ(&undisturbed, &displacement(&folder)?);
        ensure(off <= ROUNDING, format!("{way}: resumed {off:e} off"))?;
    }
    println!("5 failures told once; 3 runs resumed");
    others(all, &whole)
}

/// The displacements at the end of a run: two for each of 125 particles.
fn displacement(folder: &Path) -> Outcome<Vec<f64>> {
    let numbers = std::fs::read_to_string(folder.join("displacement"))?;
    Ok(numbers.lines().map(str::parse).collect::<Result<_, _>>()?)
}

fn differ(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs())) / largest
}

/// A run that stops after three of eight steps goes on, on another number of ranks; what is no whole set does not.
fn others(all: &Path, whole: &Path) -> Outcome<()> {
    let soft = all.join("soft");
    std::fs::create_dir_all(&soft)?;
    let done = launch_with("whole", &soft, RANKS, &[CREEPS])?;
    ensure(done.status.success(), String::from_utf8_lossy(&done.stderr))?;
    let [hard, soft] = [displacement(whole)?, displacement(&soft)?];
    ensure(differ(&hard, &soft) > 1e-3, "what the rubber remembers makes no difference")?;
    for (creeps, expected) in [(&[][..], &hard), (&[CREEPS][..], &soft)] {
        for [from, to] in [[1, 2], [2, 1], [2, 4]] {
            let folder = all.join(format!("{from}_to_{to}_{}", creeps.len()));
            std::fs::create_dir_all(&folder)?;
            let first = launch_with("stops", &folder, from, creeps)?;
            ensure(first.status.success(), String::from_utf8_lossy(&first.stderr))?;
            let other = launch_with("other", &folder, to, creeps)?;
            ensure(!other.status.success(), "a run of another scene went on, on another number of ranks")?;
            let second = launch_with("resumed", &folder, to, creeps)?;
            ensure(second.status.success(), String::from_utf8_lossy(&second.stderr))?;
            let found = displacement(&folder)?;
            let off = differ(expected, &found);
            println!("from {from} to {to} ranks, {}: {off:.1e}", if creeps.is_empty() { "rubber" } else { "creeping" });
            ensure(off <= ROUNDING, format!("from {from} to {to} ranks: {off:e}"))?;
        }
    }
    // The longest set goes on: that of four ranks here.
    let folder = all.join("2_to_4_0");
    let again = launch("resumed", &folder, 1)?;
    ensure(again.status.success(), String::from_utf8_lossy(&again.stderr))?;
    ensure(differ(&hard, &displacement(&folder)?) <= ROUNDING, "a run that had ended went elsewhere")?;
    // A piece of another run, then none at all.
    let (folder, strange) = (all.join("1_to_2_0"), all.join("2_to_1_1"));
    std::fs::remove_file(folder.join("run.0_of_1.jsonl"))?;
    for ending in ["", ".zones"] {
        let name = format!("run.1_of_2.jsonl{ending}");
        std::fs::copy(strange.join(&name), folder.join(&name))?;
    }
    is_rejected(&folder, 1, "of different runs")?;
    is_rejected(&folder, 2, "of different runs")?;
    std::fs::remove_file(folder.join("run.1_of_2.jsonl"))?;
    is_rejected(&folder, 1, "is missing")?;
    is_rejected(&folder, 2, "is missing")?;
    println!("6 runs resumed on another number of ranks; mixed and incomplete journals refused");
    Ok(())
}

fn is_rejected(folder: &Path, ranks: usize, why: &str) -> Outcome<()> {
    let refused = launch("resumed", folder, ranks)?;
    let printed = String::from_utf8_lossy(&refused.stderr).into_owned();
    ensure(!refused.status.success() && printed.contains(why), format!("{why}: not refused\n{printed}"))
}
