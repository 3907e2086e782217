//! Runs that are killed and resumed, for the example `resume`, others that show it, and the tests.
//!
//! The run is a thin disk blown up under deflection control. It is repeated in child processes that are killed
//! (SIGKILL) at random moments; each leaves a journal, which is read, compared bit by bit and resumed.
#![allow(dead_code)] // Not all who include it need all of it.

use std::error::Error;
use std::io::{Read, Write};
use std::ops::ControlFlow;
use std::path::Path as FilePath;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rkpm::output::{Flush, Journal};
use rkpm::prelude::*;
use rkpm::solve::{State, Step};
use rkpm::term::TermState;

/// Holds the journal's name in a process that is to be killed.
const CHILD: &str = "RKPM_RUN_TO_BE_KILLED";

/// What became of the killed runs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Killed {
    /// Runs that were killed.
    pub kills: usize,
    /// Journals that could be read and held every step the run had announced, to the bit.
    pub readable: usize,
    /// Journals of runs that had not ended before the kill.
    pub midway: usize,
    /// Bits in which paths of resumed runs differ from that of the uninterrupted one.
    pub differences: u64,
}

/// The run: a disk of 22 particles, as the paper's §6.4 has it.
pub fn problem() -> Result<Problem<2>, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?; // MPa
    Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber) // cm
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), 0.145)
        .discretize(&Scheme::default().particles([11, 2]))
}

/// Tells whoever started this process of each step, once it is in the journal.
struct Announce<W>(W);

impl<W: Write> Observer for Announce<W> {
    fn step(&mut self, _: &Step) -> ControlFlow<()> {
        match self.0.write_all(b"s").and_then(|()| self.0.flush()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    }
}

/// Runs into a journal if this process was started to be killed; call it first, and return where it says `true`.
pub fn is_child() -> Result<bool, Box<dyn Error>> {
    let Some(file) = std::env::var_os(CHILD) else { return Ok(false) };
    let problem = problem()?;
    let mut journal = Journal::create(&file, &problem.at_rest())?.flush(Flush::System);
    let mut announce = Announce(std::io::stderr());
    announce.0.write_all(b"b")?;
    let path = problem.run_with(&mut (&mut journal, &mut announce))?;
    journal.close(&path)?;
    Ok(true)
}

/// A child process, its journal begun.
fn start(command: &mut Command, file: &FilePath) -> Result<Child, Box<dyn Error>> {
    let mut child = command.env(CHILD, file).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    let mut byte = [0];
    if let Some(stderr) = &mut child.stderr {
        stderr.read_exact(&mut byte)?;
    }
    if byte != *b"b" {
        return Err("the child process did not begin".into());
    }
    Ok(child)
}

/// Steps that a child announced before it ended.
fn announced(child: &mut Child) -> Result<usize, Box<dyn Error>> {
    let mut bytes = Vec::new();
    if let Some(stderr) = &mut child.stderr {
        stderr.read_to_end(&mut bytes)?;
    }
    Ok(bytes.iter().filter(|&&b| b == b's').count())
}

/// Kills runs at random moments (fixed seed) and resumes each. `command` starts this program again, in a way that
/// it calls [`is_child`].
pub fn kill_and_resume(
    mut command: impl FnMut() -> Command,
    folder: &FilePath,
    kills: usize,
) -> Result<Killed, Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let problem = problem()?;
    let whole = problem.run()?.completed()?;
    let name = |k: usize| folder.join(format!("killed_{k}.jsonl"));
    let fresh = |k: usize| match std::fs::remove_file(name(k)) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(name(k)),
    };
    // How long a run takes in a child, so that the moments spread over all of it.
    let mut duration = Duration::MAX;
    for _ in 0..3 {
        let mut child = start(&mut command(), &fresh(0)?)?;
        let clock = Instant::now();
        child.wait()?;
        duration = duration.min(clock.elapsed());
    }
    let mut random = fastrand::Rng::with_seed(7);
    let mut killed = Killed { kills, ..Killed::default() };
    for k in 0..kills {
        let file = fresh(k)?;
        let moment = duration.mul_f64(random.f64());
        let mut child = start(&mut command(), &file)?;
        sleep(moment);
        child.kill()?;
        child.wait()?;
        let announced = announced(&mut child)?;
        let Ok((mut journal, so_far)) = Journal::reopen(&file) else { continue };
        let same = so_far.steps.len() >= announced
            && so_far.steps.len() <= whole.steps.len()
            && so_far.steps.iter().zip(&whole.steps).all(|(a, b)| step_differences(a, b) == 0);
        killed.readable += usize::from(same);
        killed.midway += usize::from(so_far.ending == Ending::Interrupted);
        let resumed = problem.resume(so_far, &mut journal)?;
        journal.close(&resumed)?;
        killed.differences += differences(&resumed, &whole) + differences(&Journal::read(&file)?, &whole);
        std::fs::remove_file(&file)?;
    }
    Ok(killed)
}

/// Bits in which two paths differ; a number that one of them lacks counts with all of its bits.
pub fn differences(a: &EquilibriumPath, b: &EquilibriumPath) -> u64 {
    let missing: u64 = match a.steps.len().cmp(&b.steps.len()) {
        std::cmp::Ordering::Less => b.steps[a.steps.len()..].iter().map(step_size).sum(),
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => a.steps[b.steps.len()..].iter().map(step_size).sum(),
    };
    missing
        + state_differences(&a.start, &b.start)
        + a.steps.iter().zip(&b.steps).map(|(a, b)| step_differences(a, b)).sum::<u64>()
        + count(a.iterations, b.iterations)
        + count(a.rejected, b.rejected)
        + u64::from(a.ending != b.ending)
}

/// Bits in which two steps differ.
pub fn step_differences(a: &Step, b: &Step) -> u64 {
    state_differences(&a.state, &b.state)
        + number(a.energy, b.energy)
        + number(a.control_state.increment, b.control_state.increment)
        + count(a.control_state.reached, b.control_state.reached)
        + count(a.iterations, b.iterations)
        + count(a.rejected, b.rejected)
        + u64::from(a.inertia != b.inertia)
}

fn state_differences(a: &State, b: &State) -> u64 {
    let none = TermState::default();
    let terms = (0..a.terms.len().max(b.terms.len())).map(|k| {
        let [a, b] = [a, b].map(|state| state.terms.get(k).unwrap_or(&none));
        numbers(&a.condensed, &b.condensed) + numbers(&a.history, &b.history)
    });
    numbers(&a.displacement, &b.displacement)
        + terms.sum::<u64>()
        + numbers(&a.multipliers, &b.multipliers)
        + number(a.load, b.load)
}

fn step_size(step: &Step) -> u64 {
    state_differences(&step.state, &State::default()).max(1)
}

fn numbers(a: &[f64], b: &[f64]) -> u64 {
    64 * a.len().abs_diff(b.len()) as u64 + a.iter().zip(b).map(|(a, b)| number(*a, *b)).sum::<u64>()
}

fn number(a: f64, b: f64) -> u64 {
    u64::from((a.to_bits() ^ b.to_bits()).count_ones())
}

fn count(a: usize, b: usize) -> u64 {
    u64::from((a ^ b).count_ones())
}
