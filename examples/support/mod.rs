//! What all examples share: where results go, reading of reference tables, pictures of bodies.
#![allow(dead_code)] // No example needs all of it.

mod summary;

use std::path::PathBuf;

use rkpm::Error;
use rkpm::cells::Lattice;
use rkpm::geometry::Point;
use rkpm::output::Chart;
use rkpm::scene::Problem;
use rkpm::solve::{EquilibriumPath, State};

pub use summary::Summary;

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

/// Prints what makes a path doubtful, a line for each doubt.
pub fn print_doubts<const D: usize>(problem: &Problem<D>, path: &EquilibriumPath) -> Result<(), Error> {
    for doubt in problem.verdict(path)? {
        println!("doubt: {doubt}");
    }
    Ok(())
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

/// Current positions of all particles: reference positions and displacements.
pub fn deformed<const D: usize>(problem: &Problem<D>, state: &State) -> Result<Vec<Point<D>>, Error> {
    let moves = problem.particle_displacements(state)?;
    Ok(problem.cells().positions().iter().zip(&moves).map(|(x, u)| x + u).collect())
}

/// Closed outlines of all cells between particles at the given positions.
pub fn cells(problem: &Problem<2>, positions: &[Point<2>]) -> Vec<Vec<Point<2>>> {
    (0..problem.cells().cell_count())
        .map(|cell| {
            let corners = problem.cells().corners(cell);
            corners.iter().chain(corners.first()).map(|&particle| positions[particle]).collect()
        })
        .collect()
}

/// Current courses of the lines of particles along all axes: what a drawn grid on the body would turn
/// into. Each line is sampled at `parts` points per cell, so that it bends where the body does.
pub fn grid_lines<const D: usize>(
    problem: &Problem<D>,
    state: &State,
    parts: usize,
) -> Result<Vec<Vec<Point<D>>>, Error> {
    let fine = problem.lattice().expect("a scene on a domain has a lattice").refined(parts)?;
    let counts = fine.counts();
    let mut lines = Vec::new();
    for axis in 0..D {
        // A line starts at each particle of the lower face of its axis.
        for node in 0..fine.positions().len() {
            let index = multi_index(node, counts);
            if index[axis] != 0 || (0..D).any(|i| index[i] % parts != 0) {
                continue;
            }
            let along = (0..counts[axis]).map(|k| {
                let mut at = index;
                at[axis] = k;
                let x = fine.positions()[fine.node(at)];
                Ok(x + problem.displacement(state, &x)?)
            });
            lines.push(along.collect::<Result<_, Error>>()?);
        }
    }
    Ok(lines)
}

/// The same lines at rest.
pub fn grid_lines_at_rest<const D: usize>(lattice: &Lattice<D>) -> Vec<Vec<Point<D>>> {
    let counts = lattice.counts();
    let starts =
        |axis: usize| (0..lattice.positions().len()).map(move |n| multi_index(n, counts)).filter(move |i| i[axis] == 0);
    let line = |axis: usize, start: [usize; D]| {
        (0..counts[axis]).map(move |k| {
            let mut at = start;
            at[axis] = k;
            lattice.positions()[lattice.node(at)]
        })
    };
    (0..D).flat_map(|axis| starts(axis).map(move |start| line(axis, start).collect())).collect()
}

/// Several charts as one picture, two in a row.
///
/// # Errors
/// As [`Chart::to_svg`].
pub fn panels(charts: &[Chart]) -> Result<String, Error> {
    let (mut width, mut height) = (0.0f64, 0.0f64);
    let mut inner = String::new();
    for row in charts.chunks(2) {
        let (mut left, mut tallest) = (0.0, 0.0f64);
        for chart in row {
            let svg = chart.to_svg()?;
            let length = |name: &str| -> f64 {
                let cell = svg.split_once(&format!("{name}=\"")).and_then(|(_, rest)| rest.split('"').next());
                cell.and_then(|number| number.parse().ok()).unwrap_or_default()
            };
            // Charts begin with their own element: all it lacks is a place.
            let start = svg.find("<svg").unwrap_or_default();
            inner.push_str(&svg[start..].replacen("<svg", &format!("<svg x=\"{left}\" y=\"{height}\""), 1));
            left += length("width");
            tallest = tallest.max(length("height"));
        }
        width = width.max(left);
        height += tallest;
    }
    let open = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\">");
    Ok(format!("{open}\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{inner}</svg>\n"))
}

/// The multi-index of a number, axis 0 running fastest.
fn multi_index<const D: usize>(number: usize, counts: [usize; D]) -> [usize; D] {
    let mut rest = number;
    counts.map(|count| {
        let index = rest % count;
        rest /= count;
        index
    })
}
