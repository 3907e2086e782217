//! Laws fitted to Treloar's rubber: uniaxial, equibiaxial and planar tension at once.
//!
//! `cargo run --release --features fit --example fit_treloar [-- --out DIR]` prints what each fit found and writes `summary.csv`
//! (RMS of the error over RMS of the stress in %, rows `NAME_ua`, `NAME_eb`, `NAME_ps`), the reports and a chart for each law.

mod support;

use std::error::Error;

use rkpm::fit::{Fit, Law, TestData};
use rkpm::material::Mode;
use support::Summary;

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("fit_treloar");
    let data = TestData::parse(include_str!("../tests/reference/treloar_1944.csv"))?;
    let mut summary = Summary::new();
    std::fs::create_dir_all(&out)?;
    for (name, law) in [
        ("ogden3", Law::Ogden(3)),
        ("extended_tube", Law::ExtendedTube),
        ("carroll", Law::Carroll),
        ("gent_gent", Law::GentGent),
        ("yeoh", Law::Yeoh),
        ("arruda_boyce", Law::ArrudaBoyce),
        ("gent", Law::Gent),
        ("mooney_rivlin", Law::MooneyRivlin),
        ("neo_hookean", Law::NeoHookean),
    ] {
        const STARTS: usize = 100;
        let report = Fit::new(law).starts(STARTS).to(&data)?;
        for (mode, suffix) in [(Mode::Uniaxial, "ua"), (Mode::Equibiaxial, "eb"), (Mode::Planar, "ps")] {
            summary.note(format!("{name}_{suffix}"), 100.0 * report.misfit(mode).unwrap_or(f64::NAN))?;
        }
        let named: usize = report.optima.iter().map(|optimum| optimum.starts).sum();
        summary.note(format!("{name}_optima"), report.optima.len() as f64)?;
        summary.note(format!("{name}_starts_at_named_optima"), 100.0 * named as f64 / STARTS as f64)?;
        println!("{report}");
        std::fs::write(out.join(format!("{name}.txt")), report.to_string())?;
        report.chart().write(out.join(format!("{name}.svg")))?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    println!("results in {}", out.display());
    Ok(())
}
