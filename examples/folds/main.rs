//! Runs that complete are answers: families of problems whose coarse models may fold between points or let contact leak.
//!
//! `cargo run --release --example folds [-- --family NAME] [--most N] [--references] [--out DIR]` runs each problem with many
//! discretisations and compares what completes with a refined model. `summary.csv` has the rows `runs`, `wrong_completed` (completed and
//! more than 5 % from the refined model), `right` (within 5 %, or ended where the refined model ends as well), `ended_with_cause`,
//! `ends_refined` (runs whose refined model ends) and `iterations`, for each family and in total; `runs.csv` has a line for each run.
//! `--most N` takes N runs of a family alone, spread evenly; `--references` runs the refined models instead.
//! Seeds are fixed. Meshes are those of `examples/meshes/make.py`.

mod axisymmetric;
mod beam;
mod case;
mod plane;
#[path = "../support/mod.rs"]
mod support;

use std::error::Error;
use std::path::PathBuf;

use case::{Family, Model, Reference, Target, Verdict};
use rkpm::output::{Cell, Table};
use support::Summary;

/// What the command line asks for.
struct Request {
    family: Option<String>,
    most: usize,
    references: bool,
    out: PathBuf,
}

fn request() -> Option<Request> {
    let out = ["target", "rkpm", "folds"].iter().collect();
    let mut request = Request { family: None, most: usize::MAX, references: false, out };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        match flag.as_str() {
            "--references" => request.references = true,
            "--family" => request.family = Some(arguments.next()?),
            "--most" => request.most = arguments.next()?.parse().ok().filter(|n| *n > 0)?,
            "--out" => request.out = arguments.next()?.into(),
            _ => return None,
        }
    }
    Some(request)
}

fn families() -> Vec<Family> {
    vec![
        plane::shaft(),
        plane::ring("ring_12", 0.12),
        plane::ring("ring_08", 0.08),
        plane::seal(),
        plane::pad(),
        plane::column(),
        axisymmetric::bumper(),
        axisymmetric::disk(),
        axisymmetric::sphere(),
        beam::beam(),
    ]
}

/// Counts of one family.
#[derive(Default)]
struct Counts {
    runs: usize,
    wrong_completed: usize,
    right: usize,
    ended: usize,
    ends_refined: usize,
    iterations: usize,
}

impl Counts {
    fn add(&mut self, other: &Counts) {
        self.runs += other.runs;
        self.wrong_completed += other.wrong_completed;
        self.right += other.right;
        self.ended += other.ended;
        self.ends_refined += other.ends_refined;
        self.iterations += other.iterations;
    }

    fn write(&self, name: &str, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
        for (what, count) in [
            ("runs", self.runs),
            ("wrong_completed", self.wrong_completed),
            ("right", self.right),
            ("ended_with_cause", self.ended),
            ("ends_refined", self.ends_refined),
            ("iterations", self.iterations),
        ] {
            summary.note(format!("{what}_{name}"), count as f64)?;
        }
        Ok(())
    }
}

/// Runs one model and counts what it is worth.
fn run(target: &Target, model: &Model, counts: &mut Counts, table: &mut Table) -> Result<(), Box<dyn Error>> {
    let found = (model.run)()?;
    let verdict = target.reference.judge(&found);
    counts.runs += 1;
    counts.iterations += found.iterations;
    counts.wrong_completed += usize::from(verdict == Verdict::WrongCompleted);
    counts.right += usize::from(verdict == Verdict::Right);
    counts.ended += usize::from(found.ending.is_some());
    counts.ends_refined += usize::from(matches!(target.reference, Reference::Ends));
    let (word, reference) = match (verdict, target.reference) {
        (Verdict::Right, Reference::Value { value, .. }) => ("right", value),
        (Verdict::Right, Reference::Ends) => ("right", f64::NAN),
        (Verdict::Ended, _) => ("ended", f64::NAN),
        (Verdict::WrongCompleted, Reference::Value { value, .. }) => ("WRONG", value),
        (Verdict::WrongCompleted, Reference::Ends) => ("WRONG", f64::NAN),
    };
    let [low, high] = found.jacobians;
    let why = found.ending.clone().unwrap_or_default();
    println!(
        "{word:5} {}, {}: {:.6} for {reference:.6} at {:.3}, {} iterations, {} unstable, J {low:.2} to {high:.2} {why}",
        target.label, model.label, found.value, found.load, found.iterations, found.unstable
    );
    table.push([
        Cell::from(target.label.as_str()),
        Cell::from(model.label.as_str()),
        Cell::from(word),
        Cell::from(found.value),
        Cell::from(reference),
        Cell::from(found.load),
        Cell::from(found.iterations as f64),
        Cell::from(found.unstable as f64),
        Cell::from(low),
        Cell::from(high),
        Cell::from(why.replace(',', ";").as_str()),
    ])?;
    Ok(())
}

/// Runs the refined models of a family: where two neighbours agree, their difference tells how far the value is known.
fn references(family: &Family) -> Result<(), Box<dyn Error>> {
    for target in &family.targets {
        for model in &target.refined {
            let found = (model.run)()?;
            let ending = found.ending.unwrap_or_else(|| "completed".into());
            println!("{}, {}: {:.6} at {:.3}: {ending}", target.label, model.label, found.value, found.load);
        }
        if let Reference::Value { value, uncertainty } = target.reference {
            println!("{}: carried {value:.6}, known to {:.2} %", target.label, 100.0 * uncertainty);
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(request) = request() else {
        eprintln!("usage: folds [--family NAME] [--most N] [--references] [--out DIR]");
        std::process::exit(2);
    };
    let mut summary = Summary::new();
    let columns =
        ["problem", "model", "verdict", "value", "reference", "load", "iterations", "unstable", "low", "high", "cause"];
    let mut table = Table::new(columns);
    let mut total = Counts::default();
    let wanted = |name: &str| request.family.as_ref().is_none_or(|family| family == name);
    for family in families().iter().filter(|family| wanted(family.name)) {
        if request.references {
            references(family)?;
            continue;
        }
        let mut counts = Counts::default();
        let all: Vec<_> = family.targets.iter().flat_map(|t| t.models.iter().map(move |model| (t, model))).collect();
        let taken = all.len().min(request.most);
        for (target, model) in (0..taken).map(|k| all[k * all.len() / taken]) {
            run(target, model, &mut counts, &mut table)?;
        }
        counts.write(family.name, &mut summary)?;
        total.add(&counts);
    }
    if request.references {
        return Ok(());
    }
    total.write("total", &mut summary)?;
    print!("{summary}");
    std::fs::create_dir_all(&request.out)?;
    summary.write(request.out.join("summary.csv"))?;
    table.write(request.out.join("runs.csv"))?;
    println!("results in {}", request.out.display());
    Ok(())
}
