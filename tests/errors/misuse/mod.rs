//! GOAL: no argument is silent. Each argument of each call of the scenes in `scenes` is replaced in turn by what can't be meant. Nothing
//! panics, and nothing passes without a word: what no physics allows is an error, or a finding of `check::scene`, that names it. What is
//! valid after all stands in `valid`, with its reason.
#![cfg(all(feature = "solve", feature = "fit"))]

mod args;
mod scenes;
mod valid;

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use args::{Args, Heard, Swap, Wrong, forget};
use valid::VALID;

/// What a replaced argument led to.
enum Outcome {
    /// An error or a finding, with its words.
    Told(String),
    Silent,
    Panicked,
}

fn outcome(build: fn(&mut Args) -> Result<Heard, rkpm::Error>, swap: Swap) -> Outcome {
    forget();
    let run = || build(&mut Args::new(Some(swap)));
    match catch_unwind(AssertUnwindSafe(run)) {
        Err(_) => Outcome::Panicked,
        Ok(Err(error)) => Outcome::Told(error.to_string()),
        Ok(Ok(heard)) if heard.findings.is_empty() => Outcome::Silent,
        Ok(Ok(heard)) => Outcome::Told(heard.findings.join("; ")),
    }
}

/// What is wrong with the words of an error for an argument that is called one of some names.
fn flaw(text: &str, names: &str, swap: Swap) -> Option<&'static str> {
    let lower = text.to_lowercase();
    // What lies far off is told by its place.
    let far = swap.wrong == Wrong::Far && text.contains("100");
    if !far && !names.split('|').any(|name| lower.contains(&name.to_lowercase())) {
        Some("does not name it")
    } else if text.contains("NaN") && !swap.wrong.is_nan() {
        Some("speaks of NaN")
    } else if text.trim_end().ends_with(':') {
        Some("ends empty")
    } else {
        None
    }
}

#[test]
fn each_argument_replaced_by_what_can_not_be_meant() {
    let (mut faults, mut used, mut cases) = (Vec::new(), BTreeSet::new(), 0);
    let (loud, mut told) = (std::env::var("MISUSE").ok(), 0);
    for (scene, build) in scenes::ALL {
        let started = std::time::Instant::now();
        let mut args = Args::new(None);
        forget();
        match build(&mut args) {
            Ok(heard) if heard.findings.is_empty() => {}
            Ok(heard) => faults.push(format!("{scene}, as it is: {}", heard.findings.join("; "))),
            Err(error) => faults.push(format!("{scene}, as it is: {error}")),
        }
        for (number, (names, wrongs)) in args.taken.iter().enumerate() {
            for &wrong in *wrongs {
                let swap = Swap { number, wrong };
                let listed = VALID.iter().position(|v| v.names == *names && v.wrongs.contains(&wrong));
                let case = format!("{scene}, {names}, {wrong:?}");
                let begun = std::time::Instant::now();
                let found = outcome(*build, swap);
                if loud.is_some() && begun.elapsed().as_secs_f64() > 1.0 {
                    println!("{case}: {:.1} s", begun.elapsed().as_secs_f64());
                }
                cases += 1;
                match (&found, listed) {
                    (Outcome::Panicked, _) => faults.push(format!("{case}: panics")),
                    (Outcome::Silent, None) => faults.push(format!("{case}: silent")),
                    (Outcome::Silent, Some(entry)) => drop(used.insert(entry)),
                    (Outcome::Told(text), _) => {
                        if let Some(flaw) = flaw(text, names, swap) {
                            faults.push(format!("{case}: {flaw}: {text}"));
                        }
                    }
                }
                if let (Some("all"), Outcome::Told(text)) = (loud.as_deref(), &found) {
                    eprintln!("{case}: {text}");
                }
            }
        }
        if loud.is_some() {
            faults.iter().skip(told).for_each(|fault| println!("FAULT {fault}"));
            told = faults.len();
        }
        println!("{scene}: {} arguments, {:.1} s", args.taken.len(), started.elapsed().as_secs_f64());
    }
    println!("{cases} cases");
    assert!(scenes::ALL.len() >= 12 && cases > 1000);
    for (entry, valid) in VALID.iter().enumerate() {
        assert!(!valid.reason.is_empty());
        if !used.contains(&entry) {
            faults.push(format!("valid, and nothing needs it: {} {:?}", valid.names, valid.wrongs));
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
