//! What all examples share: where results go, reading of reference tables, pictures of bodies.
#![allow(dead_code)] // No example needs all of it.

use std::path::PathBuf;

/// The directory of the results of example `name`: `target/rkpm/NAME`, or what `--out DIR` says.
///
/// Ends the program with exit code 2 and a word about usage on any other argument.
pub fn out_dir(name: &str) -> PathBuf {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    match arguments.as_slice() {
        [] => ["target", "rkpm", name].iter().collect(),
        [flag, directory] if flag == "--out" && !directory.is_empty() => directory.into(),
        _ => {
            eprintln!("usage: {name} [--out DIR]\n\nResults go to DIR, by default target/rkpm/{name}.");
            std::process::exit(2);
        }
    }
}

/// The columns of a CSV text by name. Lines that start with `#` are comments, the first other line is
/// the header; a cell that is no number reads as NaN.
pub fn csv_columns(text: &str) -> Vec<(String, Vec<f64>)> {
    let mut lines = csv_lines(text);
    let names = lines.next().unwrap_or_default().split(',');
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name.trim().to_owned(), Vec::new())).collect();
    for line in lines {
        // A short line leaves its last cells empty.
        let cells = line.split(',').chain(std::iter::repeat(""));
        for ((_, column), cell) in columns.iter_mut().zip(cells) {
            column.push(cell.trim().parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

/// The number beside `name` in a CSV text whose first two columns are names and values.
pub fn csv_value(text: &str, name: &str) -> f64 {
    csv_lines(text)
        .filter_map(|line| line.split_once(','))
        .find(|(quantity, _)| *quantity == name)
        .and_then(|(_, rest)| rest.split(',').next()?.trim().parse().ok())
        .unwrap_or_else(|| panic!("the reference has no quantity {name}"))
}

/// The lines that are neither empty nor comments; a comment with commas may stand in quotes.
fn csv_lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#') && !line.starts_with("\"#"))
}
