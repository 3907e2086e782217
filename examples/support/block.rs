//! The large block of rubber that `large_block` measures, here and on many ranks: scene, scheme and what a process takes.
#![allow(dead_code)] // No example needs all of it.

use rkpm::prelude::*;
use rkpm::solve::Newton;

/// What stands behind a flag.
pub fn flag(name: &str, default: &str) -> String {
    let arguments: Vec<String> = std::env::args().collect();
    let place = arguments.iter().position(|a| a == name);
    place.and_then(|k| arguments.get(k + 1)).cloned().unwrap_or_else(|| default.to_string())
}

/// A block twice as wide as high with µ = 1 and a bulk modulus of `ratio`, bonded between plates, the upper of which is
/// moved sideways by a fifth of the height.
pub fn scene(ratio: f64) -> Result<Scene<3>, rkpm::Error> {
    let block = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, Rubber::neo_hookean(0.5, ratio)?);
    let top = (2, Side::Max);
    Ok(block.hold((2, Side::Min)).prescribe(top, 0, 0.2).prescribe(top, 1, 0.0).prescribe(top, 2, 0.0))
}

/// About so many particles, and at most so many iterations of Newton's method in one attempt; 0 runs the whole analysis.
pub fn scheme(particles: f64, iterations: usize) -> Scheme {
    let h = (4.0 / particles).cbrt();
    let counts = [2.0, 2.0, 1.0].map(|length: f64| ((length / h).round() as usize).max(2) + 1);
    let scheme = Scheme::default().particles(counts);
    if iterations == 0 {
        return scheme;
    }
    // One attempt, for the time that an iteration takes.
    let stepping = Stepping { smallest: 0.9, ..Stepping::equal(1) };
    scheme.newton(Newton { iterations, ..Newton::default() }).stepping(stepping)
}

/// The most memory that this process has held, in bytes; known on Linux alone.
pub fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1)).and_then(|n| n.parse::<f64>().ok());
    1024.0 * number.unwrap_or(f64::NAN)
}

/// The seconds that processors have spent on this process, all threads together; known on Linux alone.
pub fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name of the program, which may hold anything: the 14th and 15th number of all, in hundredths.
    let behind = stat.rsplit_once(')').map_or("", |(_, behind)| behind);
    let ticks = |place: usize| behind.split_whitespace().nth(place).and_then(|n| n.parse::<f64>().ok());
    ticks(11).zip(ticks(12)).map_or(f64::NAN, |(user, system)| 0.01 * (user + system))
}
