//! Runs that are killed and go on: nothing that converged is lost, and no bit tells a resumed run from another.
//!
//! `cargo run --release --features serde --example resume [-- --out DIR]` blows up a thin disk, kills the run at
//! 50 random moments, reads each journal, resumes it, and compares with the uninterrupted run bit by bit. It
//! prints and writes `summary.csv`: `resume_differences` (bits that differ) and `killed_runs_readable`.

#[path = "support/killed.rs"]
mod killed;
mod support;

use std::error::Error;
use std::process::Command;
use support::Summary;

const KILLS: usize = 50;

fn main() -> Result<(), Box<dyn Error>> {
    if killed::is_child()? {
        return Ok(());
    }
    let out = support::out_dir("resume");
    let program = std::env::current_exe()?;
    let killed = killed::kill_and_resume(|| Command::new(&program), &out, KILLS)?;
    let mut summary = Summary::default();
    summary.record("resume_differences", killed.differences as f64, 0.0)?;
    summary.record("killed_runs_readable", killed.readable as f64, KILLS as f64)?;
    summary.note("killed_midway", killed.midway as f64)?;
    summary.write(out.join("summary.csv"))?;
    println!("{summary}");
    Ok(())
}
