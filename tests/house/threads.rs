//! Every example writes the same bytes with one thread and with two.
//!
//! `cargo test --release --all-features --test house threads -- --include-ignored --nocapture` runs all of them, which
//! takes as long as the examples do, twice; build them first with `cargo build --release --all-features --examples`.
//! The quick ones run whenever the tests do. Only what measures time is left out of the comparison: see below.
#![cfg(all(feature = "solve", feature = "chart"))]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Examples that take about a second or less.
const QUICK: [&str; 4] = ["simple_shear", "kernels", "locking", "bushing_assembly"];
/// Columns that hold seconds.
const TIMED_COLUMNS: [&str; 6] = ["seconds", "discretize_s", "analyze_s", "factorize_s", "solve_s", "assemble_s"];
/// Rows of a summary that hold seconds or ratios of them, by (example, end of the row's name); `killed_midway`
/// counts kills that came before the end.
const TIMED_ROWS: [(&str, &str); 8] = [
    ("work_precision", "_seconds"),
    ("work_precision", "_ratio"),
    ("economy", "_over_radial"),
    ("sizing", "overhead_cook"),
    ("sizing", "overhead_disk"),
    ("sizing", "reduction_tube"),
    ("sizing", "local_seconds_0.5"),
    ("resume", "killed_midway"),
];
/// Charts with an axis that is time.
const TIMED_CHARTS: [(&str, &str); 2] = [("work_precision", "work_precision.svg"), ("sizing", "sizing.svg")];

fn examples() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let name = |entry: fs::DirEntry| {
        let path = entry.path();
        let is_source = path.extension().is_some_and(|e| e == "rs");
        let is_folder = path.join("main.rs").exists();
        (is_source || is_folder).then(|| path.file_stem().unwrap().to_string_lossy().into_owned())
    };
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().filter_map(|entry| name(entry.unwrap())).collect();
    names.sort();
    names
}

/// All files beneath a folder by their names from there.
fn files(root: &Path, folder: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(root, &path, out);
        } else {
            let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
            out.insert(name, fs::read(&path).unwrap());
        }
    }
}

/// A table without what was timed; cells with line breaks stand in no timed table.
fn untimed(example: &str, text: &str) -> String {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let kept: Vec<bool> = header.iter().map(|name| !TIMED_COLUMNS.contains(name)).collect();
    if kept.iter().all(|kept| *kept) {
        let timed = |line: &str| {
            let name = line.split(',').next().unwrap_or_default();
            TIMED_ROWS.iter().any(|(of, part)| *of == example && name.ends_with(part))
        };
        return text.lines().filter(|line| !timed(line)).collect::<Vec<_>>().join("\n");
    }
    let cut = |line: &str| {
        // Names of series hold commas, in quotes: only those outside part cells.
        let mut quoted = false;
        let cells = line.split(|c| {
            quoted ^= c == '"';
            c == ',' && !quoted
        });
        let cells = cells.zip(&kept).filter(|(_, kept)| **kept);
        cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",")
    };
    text.lines().map(cut).collect::<Vec<_>>().join("\n")
}

fn run(example: &str, threads: usize) -> BTreeMap<String, Vec<u8>> {
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("threads").join(format!("{example}_{threads}"));
    let _ = fs::remove_dir_all(&out);
    let program = std::env::current_exe().unwrap();
    let program = program.parent().and_then(Path::parent).unwrap().join("examples").join(example);
    let status = Command::new(&program)
        .arg("--out")
        .arg(&out)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .stdout(Stdio::null())
        .status()
        .unwrap_or_else(|e| panic!("{}: {e}; build the examples first", program.display()));
    assert!(status.success(), "{example} with {threads} threads: {status}");
    let mut found = BTreeMap::new();
    files(&out, &out, &mut found);
    found
}

/// Names of files that differ between one thread and two.
fn differences(example: &str) -> Vec<String> {
    let (one, two) = (run(example, 1), run(example, 2));
    assert!(one.contains_key("summary.csv"), "{example} writes no summary");
    assert!(one.keys().eq(two.keys()), "{example}: {:?} and {:?}", one.keys(), two.keys());
    let differs = |name: &str| {
        let (a, b) = (&one[name], &two[name]);
        if TIMED_CHARTS.contains(&(example, name)) {
            return false;
        }
        match (std::str::from_utf8(a), std::str::from_utf8(b)) {
            (Ok(a), Ok(b)) if name.ends_with(".csv") => untimed(example, a) != untimed(example, b),
            _ => a != b,
        }
    };
    one.keys().filter(|name| differs(name)).map(|name| format!("{example}/{name}")).collect()
}

#[test]
fn quick_examples_write_the_same_bytes_with_one_and_two_threads() {
    let different: Vec<String> = QUICK.iter().flat_map(|example| differences(example)).collect();
    assert!(different.is_empty(), "{different:?}");
}

#[test]
#[ignore = "runs every example twice: cargo test --release --all-features --test house threads -- --include-ignored"]
fn every_example_writes_the_same_bytes_with_one_and_two_threads() {
    let mut different = Vec::new();
    for example in examples() {
        let found = differences(&example);
        println!("{example}: {}", if found.is_empty() { "same bytes" } else { "differs" });
        different.extend(found);
    }
    assert!(different.is_empty(), "{different:?}");
}

#[test]
fn only_times_are_left_out() {
    let runs = "scheme,seconds,error\n\"a, r = 1\",0.1,2e-3\nb,0.2,1e-3";
    assert_eq!(untimed("sizing", runs), "scheme,error\n\"a, r = 1\",2e-3\nb,1e-3");
    let summary = "quantity,value,reference,relative_error\noverhead_cook,1.2,,\nreduction_tube_error,1,,";
    assert_eq!(untimed("sizing", summary), "quantity,value,reference,relative_error\nreduction_tube_error,1,,");
    assert_eq!(untimed("uniaxial", summary), summary);
    assert!(examples().len() >= 12 && QUICK.iter().all(|quick| examples().iter().any(|e| e == quick)));
}
