//! GOAL: what goes with what. Every pair of options of different groups either passes its laws or is refused by one typed
//! error that names both sides and what to do instead; no option is dropped in silence.
//! GEOMETRY: a block of side 1 whose first coordinate runs from 1 to 2, in all sources.
//! REFERENCE: equilibrium, work, the same scene by another run, in one process, without the option.
//!
//! Cases combine one option of each group; a case that passes covers all of its pairs. Where one is refused the pair that is
//! refused alone is its cause. `RKPM_WRITE_COMBINATIONS=1` writes docs/combinations.md, otherwise it is compared.

mod laws;
mod parts;
mod ranks;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use rkpm::error::{Error, Incompatible, SolveError};

/// The groups and their options; the first of each is the plain one.
const GROUPS: [(&str, &[&str]); 7] = [
    ("source", &["block", "mapped block", "radial", "region", "planar mesh", "solid mesh", "cut surface"]),
    ("approximation", &["order 1", "order 2", "order 3", "elements 1", "elements 2"]),
    ("kinematics", &["plane strain or 3D", "axisymmetric", "plane stress"]),
    ("material", &["elastic", "viscoelastic", "Mullins", "foam"]),
    (
        "action",
        &[
            "none",
            "follower pressure",
            "several bodies",
            "rigid body",
            "rigid contact",
            "contact of two bodies",
            "contact with itself",
            "friction",
        ],
    ),
    ("run", &["load", "deflection", "volume", "arc length", "solve_within", "locally", "resume", "ranks"]),
    ("result", &["reaction", "moment", "stress", "contact pressure", "picture", "VTU", "transfer"]),
];

const SOURCE: usize = 0;
const APPROXIMATION: usize = 1;
const KINEMATICS: usize = 2;
const LAW: usize = 3;
const ACTION: usize = 4;
const RUN: usize = 5;
const RESULT: usize = 6;

/// An option of each group.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Case([usize; 7]);

/// Two options of different groups, the earlier group first.
type Pair = [(usize, usize); 2];

impl Case {
    fn option(&self, group: usize) -> &'static str {
        GROUPS[group].1[self.0[group]]
    }

    /// The same with the plain option of a group.
    fn plain(mut self, group: usize) -> Self {
        self.0[group] = 0;
        self
    }

    fn of(pair: Pair) -> Self {
        let mut case = Case([0; 7]);
        pair.iter().for_each(|&(group, option)| case.0[group] = option);
        case
    }

    fn pairs(&self) -> impl Iterator<Item = Pair> + '_ {
        (0..7).flat_map(move |a| (a + 1..7).map(move |b| [(a, self.0[a]), (b, self.0[b])]))
    }
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<&str> = (0..7).map(|group| self.option(group)).collect();
        f.write_str(&names.join(" · "))
    }
}

fn name((group, option): (usize, usize)) -> &'static str {
    GROUPS[group].1[option]
}

/// Pairs that can't be written down: the types refuse them.
fn by_types(pair: Pair) -> Option<&'static str> {
    match pair.map(name) {
        ["radial", "plane stress"] => Some("a radial line has no thickness that could change"),
        ["solid mesh" | "cut surface", "plane stress"] => Some("a 3D body has no free thickness: use Solid"),
        ["solid mesh" | "cut surface", "axisymmetric"] => {
            Some("a 3D body cannot be axisymmetric: model its meridian as `Mesh<2>` or `Region`")
        }
        ["radial", "locally"] => Some("a line needs no local refinement: use Scene::solve_within"),
        ["solid mesh" | "cut surface", "locally"] => {
            Some("3D cells are not refined one by one: use Scene::solve_within")
        }
        _ => None,
    }
}

/// How the pairs of a case went.
struct Search {
    open: BTreeSet<Pair>,
    passed: BTreeSet<Pair>,
    refused: BTreeMap<Pair, (String, bool)>,
    failures: Vec<String>,
    /// Cases of which an option has changed nothing that it is for.
    dropped: usize,
    /// Cases that ended without a state, as they say.
    stalled: BTreeSet<String>,
    cases: usize,
}

impl Search {
    fn new() -> Self {
        let options = || (0..7).flat_map(|group| (0..GROUPS[group].1.len()).map(move |option| (group, option)));
        let all = options().flat_map(|a| options().filter(move |b| b.0 > a.0).map(move |b| [a, b]));
        let (typed, open): (BTreeSet<Pair>, BTreeSet<Pair>) = all.partition(|pair| by_types(*pair).is_some());
        let reason = |pair: Pair| (pair, (by_types(pair).unwrap_or_default().to_string(), true));
        let refused = typed.into_iter().map(reason).collect();
        Search {
            open,
            passed: BTreeSet::new(),
            refused,
            failures: Vec::new(),
            dropped: 0,
            stalled: BTreeSet::new(),
            cases: 0,
        }
    }

    /// A case with a pair that nothing is known of, and as many more as there are.
    fn next(&self) -> Option<Case> {
        let pair = *self.open.first()?;
        let mut chosen: Vec<(usize, usize)> = pair.to_vec();
        for group in (0..7).filter(|group| pair.iter().all(|own| own.0 != *group)) {
            let with = |option: usize| {
                let pairs = chosen.iter().map(move |&other| {
                    let own = (group, option);
                    if other.0 < group { [other, own] } else { [own, other] }
                });
                pairs.collect::<Vec<Pair>>()
            };
            let possible = (0..GROUPS[group].1.len()).filter(|&option| {
                let known = |pair: &Pair| self.refused.contains_key(pair);
                !with(option).iter().any(known)
            });
            let gain = |option: &usize| with(*option).iter().filter(|pair| self.open.contains(*pair)).count();
            let best = possible.max_by_key(|option| (gain(option), std::cmp::Reverse(*option)));
            chosen.push((group, best.unwrap_or(0)));
        }
        let mut case = Case([0; 7]);
        chosen.into_iter().for_each(|(group, option)| case.0[group] = option);
        Some(case)
    }

    /// Runs a case and notes what it tells of its pairs.
    fn run(&mut self, case: Case) -> Result<(), Incompatible> {
        self.cases += 1;
        let panicked = |_| Err(Failure::Broken("it panics".into()));
        let held = std::panic::catch_unwind(|| laws::holds(case)).unwrap_or_else(panicked);
        self.dropped += usize::from(matches!(held, Err(Failure::Dropped(_))));
        match held {
            Ok(()) => {
                for pair in case.pairs() {
                    self.open.remove(&pair);
                    self.passed.insert(pair);
                }
                Ok(())
            }
            Err(Failure::Refused(refusal)) => Err(refusal),
            Err(Failure::Stalled(why)) => {
                self.stalled.insert(format!("{case}: {why}"));
                // Whether it is a pair of them that has no states is another question.
                let open: Vec<Pair> = case.pairs().filter(|pair| self.open.contains(pair)).collect();
                for pair in open {
                    if Case::of(pair) == case {
                        self.failures.push(format!("{case}: {why}"));
                        self.open.remove(&pair);
                    } else if let Err(alone) = self.run(Case::of(pair)) {
                        self.open.remove(&pair);
                        self.refused.insert(pair, (alone.to_string(), false));
                    }
                }
                Ok(())
            }
            Err(Failure::Broken(what) | Failure::Dropped(what)) => {
                self.failures.push(format!("{case}: {what}"));
                for pair in case.pairs() {
                    self.open.remove(&pair);
                }
                Ok(())
            }
        }
    }

    /// The pair of a refused case that is refused alone.
    fn find_cause(&mut self, case: Case, refusal: &Incompatible) {
        for pair in case.pairs() {
            if self.passed.contains(&pair) {
                continue;
            }
            match self.run(Case::of(pair)) {
                Err(alone) if alone == *refusal => {
                    self.open.remove(&pair);
                    self.refused.insert(pair, (alone.to_string(), false));
                    return;
                }
                Err(alone) => {
                    self.open.remove(&pair);
                    self.refused.insert(pair, (alone.to_string(), false));
                }
                Ok(()) => {}
            }
        }
        if !case.pairs().any(|pair| self.refused.contains_key(&pair)) {
            self.failures.push(format!("{case}: no two of its options are refused alone, all are: {refusal}"));
            case.pairs().for_each(|pair| _ = self.open.remove(&pair));
        }
    }
}

/// Why a case does not hold.
enum Failure {
    /// By one typed error.
    Refused(Incompatible),
    /// No further state was found, which the run says.
    Stalled(String),
    Broken(String),
    /// An option has changed nothing that it is for.
    Dropped(String),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Incompatible(refusal) => Failure::Refused(refusal),
            Error::Solve(error @ SolveError::Stalled { .. }) => Failure::Stalled(error.to_string()),
            other => Failure::Broken(format!("{other:?}")),
        }
    }
}

/// The table as a page.
fn page(search: &Search) -> String {
    let (refused, all) = (search.refused.len(), search.refused.len() + search.passed.len());
    let mut text = String::from("# Which options can be combined\n\n");
    let _ = write!(
        text,
        "{refused} of {all} pairs of options are not supported, {} options were silently ignored.\n\n",
        search.dropped
    );
    text += "This page is written by `cargo test --profile quick --all-features --test scenes combinations` with \
        `RKPM_WRITE_COMBINATIONS=1`, which tries all pairs of options of different groups. Every pair that is not listed below was part \
        of a case that passed its checks: forces and moments are in equilibrium with the loads, work agrees with energy, another run \
        reaches the same state, and the result differs from the result without the option.\n\n| group | options |\n|---|---|\n";
    for (group, options) in GROUPS {
        let _ = writeln!(text, "| {group} | {} |", options.join(", "));
    }
    text += "\nPairs that are not supported:\n\n| pair | excluded by | message |\n|---|---|---|\n";
    for (pair, (reason, typed)) in &search.refused {
        let by = if *typed { "types" } else { "`Error::Incompatible`" };
        let [a, b] = pair.map(name);
        let _ = writeln!(text, "| {a} × {b} | {by} | {reason} |");
    }
    if !search.stalled.is_empty() {
        text += "\nCases of more than two options that stalled (`Ending::Stalled`); each of their pairs passed in another case:\n\n";
    }
    for case in &search.stalled {
        let _ = writeln!(text, "* {case}");
    }
    text
}

#[test]
fn all_pairs_pass_their_laws_or_are_refused() {
    if let Ok(only) = std::env::var("RKPM_COMBINATION") {
        // Options of one case by their numbers, for a look at it alone.
        let mut case = Case([0; 7]);
        only.split(',').enumerate().for_each(|(group, option)| case.0[group] = option.parse().unwrap());
        match laws::holds(case) {
            Ok(()) => println!("{case}: holds"),
            Err(Failure::Refused(refusal)) => println!("{case}: {refusal}"),
            Err(Failure::Broken(what) | Failure::Dropped(what) | Failure::Stalled(what)) => panic!("{case}: {what}"),
        }
        return;
    }
    let mut search = Search::new();
    while let Some(case) = search.next() {
        if let Err(refusal) = search.run(case) {
            search.find_cause(case, &refusal);
        }
    }
    println!("{} cases, {} passed, {} refused", search.cases, search.passed.len(), search.refused.len());
    let text = page(&search);
    if std::env::var("RKPM_SHOW_COMBINATIONS").is_ok() {
        println!("{text}");
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/combinations.md");
    if std::env::var("RKPM_WRITE_COMBINATIONS").is_ok() {
        std::fs::write(&file, &text).unwrap();
    }
    assert!(search.failures.is_empty(), "{} failures:\n{}", search.failures.len(), search.failures.join("\n"));
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        committed == text,
        "docs/combinations.md is not what the test found: run it with RKPM_WRITE_COMBINATIONS=1"
    );
}
