//! Where methods fail: at which load, how it is noticed, and what the remedy costs.
//!
//! `cargo run --release --example limits [-- --out DIR]` prints and writes `summary.csv`, a table of what stopped
//! each analysis (`stops.csv`), curves and pictures; `docs/stability.md` reads them. It takes about half a minute.
//!
//! A balloon past its limit pressure, a column that buckles, a punched block, the sets of particles on which an
//! independent prototype of the method stopped, the certificate of the spatial kernel, the spurious modes of direct
//! nodal integration.

#[path = "../support/mod.rs"]
mod support;

mod balloon;
mod column;
mod outlast;
mod paper;
mod punch;
mod rules;

use std::error::Error;

use rkpm::output::{Cell, Table};
use rkpm::prelude::*;
use support::Summary;

/// Where an analysis ended, and why.
pub struct Stops(Table);

impl Stops {
    fn new() -> Self {
        Stops(Table::new(["case", "scheme", "load", "steps", "iterations", "rejected", "unstable_modes", "ending"]))
    }

    /// Adds a path; `scale` is the load at load factor 1.
    pub fn add(&mut self, case: &str, scheme: &str, scale: f64, path: &EquilibriumPath) -> Result<(), Box<dyn Error>> {
        let ending = match &path.ending {
            Ending::Completed => "completed".to_string(),
            Ending::Stopped => "stopped by its observer".to_string(),
            Ending::Stalled(stalled) => stalled.to_string(),
            Ending::Interrupted => "interrupted".to_string(),
        };
        let unstable = path.steps.last().and_then(|step| step.unstable).unwrap_or_default();
        self.0.push([
            Cell::from(case),
            Cell::from(scheme),
            Cell::from(scale * path.last().load),
            Cell::from(path.steps.len() as f64),
            Cell::from(path.iterations as f64),
            Cell::from(path.rejected as f64),
            Cell::from(unstable as f64),
            Cell::from(ending.replace(',', ";").as_str()),
        ])?;
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("limits");
    let mut summary = Summary::new();
    let mut stops = Stops::new();
    outlast::run(&out, &mut summary)?;
    balloon::run(&out, &mut summary, &mut stops)?;
    column::run(&out, &mut summary, &mut stops)?;
    paper::run(&out, &mut summary, &mut stops)?;
    punch::run(&out, &mut summary, &mut stops)?;
    rules::run(&out, &mut summary)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    stops.0.write(out.join("stops.csv"))?;
    println!("results in {}", out.display());
    Ok(())
}
