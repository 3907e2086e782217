//! GOAL: a rank that fails ends all of them with one message; what was recorded is read and resumed with the same bits.
//! GEOMETRY: a strip bent by pressure in eight steps, on two ranks; one of them is killed, fails, panics, asks for memory that is
//! not there, or all of them stall.
//!
//! Started without `mpirun` this program starts itself with it, once for each way to fail.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use rkpm::output::Journal;
use rkpm::prelude::*;
use rkpm::solve::{Newton, Step};
use rkpm_petsc::{Journals, Mumps, Session, on_all_ranks};

const RANKS: usize = 2;
/// Names of the variables that tell a started program what to do, and where.
const WAY: &str = "RKPM_FAILURE";
const FOLDER: &str = "RKPM_FOLDER";

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
                "panics" => panic!("an observer gave up"),
                "memory" => drop(vec![1u8; isize::MAX as usize / 4]),
                _ => {}
            }
        }
        ControlFlow::Continue(())
    }
}

fn started(session: &Session, way: &str, folder: &Path) -> Outcome<()> {
    let ratio = if way == "other" { 0.6 } else { 0.5 };
    let scene = Scene::new(Block::new([0.0, 0.0], [6.0, 1.0]), PlaneStrain, Rubber::neo_hookean(ratio, 1e3)?)
        .hold((0, Side::Min))
        .pressure((1, Side::Max), 0.01);
    let mut scheme = Scheme::default().particles([25, 5]).stepping(Stepping::equal(8)).solver(Mumps::new(session));
    if way == "stalls" {
        scheme = scheme.newton(Newton { iterations: 1, ..Newton::default() });
    }
    let problem = scene.discretize(&scheme)?;
    let file = folder.join("run.jsonl");
    let resumed = matches!(way, "resumed" | "other");
    let (mut journal, so_far) = if resumed {
        Journals::reopen(session, &file)?
    } else {
        let start = problem.at_rest();
        (Journals::create(session, &file, &start)?, EquilibriumPath::new(start))
    };
    if way == "fails" && session.rank() + 1 == RANKS {
        return Err("this rank has no license".into());
    }
    let mut fate = Fate { way, rank: session.rank(), steps: so_far.steps.len() };
    let path = problem.resume(so_far, &mut (&mut journal, &mut fate))?;
    journal.close(&path)?;
    let path = path.completed()?;
    let last = path.last();
    let bits: Vec<String> = last
        .displacement
        .iter()
        .chain(last.condensed.iter().flatten())
        .chain(&last.multipliers)
        .map(|x| format!("{:016x}", x.to_bits()))
        .collect();
    std::fs::write(folder.join(format!("bits.{}", session.rank())), bits.join("\n"))?;
    Ok(())
}

fn launch(way: &str, folder: &Path, ranks: usize) -> Outcome<Output> {
    let mut command = Command::new("mpirun");
    command.args(["-n", &ranks.to_string(), "--oversubscribe", "--bind-to", "none"]);
    // Ranks that wait for ever are a failure of the test.
    command.args(["--timeout", "100"]);
    // Allowed to the owner of a container.
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    command.env("RAYON_NUM_THREADS", "1").env("OMP_NUM_THREADS", "1");
    command.arg(std::env::current_exe()?).env(WAY, way).env(FOLDER, folder);
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
    let bits = |folder: &Path, rank: usize| std::fs::read_to_string(folder.join(format!("bits.{rank}")));
    for way in ["killed", "fails", "panics", "memory", "stalls"] {
        let folder = folder(way)?;
        let failed = launch(way, &folder, RANKS)?;
        let told = String::from_utf8_lossy(&failed.stderr).into_owned();
        ensure(!failed.status.success(), format!("{way}: the ranks ended well"))?;
        let own = told.lines().filter(|line| line.starts_with("rank ")).count();
        let expected = usize::from(matches!(way, "fails" | "panics" | "stalls"));
        ensure(own == expected, format!("{way}: {own} messages\n{told}"))?;
        let journals = (0..RANKS).map(|rank| Journal::read(folder.join(format!("run.{rank}_of_{RANKS}.jsonl"))));
        let steps: Vec<usize> = journals.map(|path| path.map(|path| path.steps.len())).collect::<Result<_, _>>()?;
        println!(
            "{way}: steps recorded {steps:?}; {}",
            told.lines().find(|line| line.starts_with("rank ")).unwrap_or("")
        );
        if matches!(way, "fails" | "stalls") {
            continue;
        }
        ensure(steps.iter().all(|&steps| steps >= 2), format!("{way}: steps recorded {steps:?}"))?;
        // Another scene, another number of ranks, and then what belongs there.
        let other = launch("other", &folder, RANKS)?;
        let told = String::from_utf8_lossy(&other.stderr).into_owned();
        ensure(
            !other.status.success() && told.contains("none of this problem"),
            format!("{way}: another scene went on\n{told}"),
        )?;
        let other = launch("resumed", &folder, RANKS + 1)?;
        let told = String::from_utf8_lossy(&other.stderr).into_owned();
        ensure(
            !other.status.success() && told.contains("recorded on 2 ranks"),
            format!("{way}: another partition went on\n{told}"),
        )?;
        let resumed = launch("resumed", &folder, RANKS)?;
        ensure(resumed.status.success(), format!("{way}: {}", String::from_utf8_lossy(&resumed.stderr)))?;
        for rank in 0..RANKS {
            ensure(bits(&folder, rank)? == bits(&whole, rank)?, format!("{way}: resumed with other bits"))?;
        }
    }
    println!("5 failures told once; 3 runs resumed bit for bit");
    Ok(())
}
