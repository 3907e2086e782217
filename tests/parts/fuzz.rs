//! GOAL: files that were damaged are refused or read as something else, without a panic, a hang or more memory than ten
//! times the file.

use std::time::Instant;

use rkpm::cells::{Cells, Unstructured};
use rkpm::geometry::Part;
use rkpm::mesh::Mesh;

use super::{file, peak};

const FILES: [&str; 8] = [
    "plug_22_ascii.msh",
    "plug_22_binary.msh",
    "plug_41_ascii.msh",
    "plug_41_binary.msh",
    "prisms.msh",
    "hexahedra.msh",
    "flat.msh",
    "plug_second_order.msh",
];

/// Damages a file in one to four places.
fn mutated(bytes: &[u8], random: &mut fastrand::Rng) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..random.usize(1..=4) {
        if out.is_empty() {
            break;
        }
        // Half of all in the first lines, where counts stand.
        let reach = if random.bool() { out.len() } else { out.len().min(400) };
        let at = random.usize(..reach);
        match random.u8(..9) {
            0 => out[at] = random.u8(..),
            1 => out[at] ^= 1 << random.u8(..8),
            2 => out.truncate(at),
            3 => out[at] = *random.choice(b"0123456789-+.eE \n$\"").unwrap(),
            4 => {
                let number =
                    *random.choice(&["999999999999", "-1", "18446744073709551615", "nan", "1e400", "$"]).unwrap();
                out.splice(at..at, number.bytes());
            }
            5 => {
                let end = out.len().min(at + random.usize(1..200));
                out.drain(at..end);
            }
            6 => {
                let end = out.len().min(at + random.usize(1..200));
                let piece = out[at..end].to_vec();
                let to = random.usize(..out.len());
                out.splice(to..to, piece);
            }
            7 => {
                // Eight bytes as a large binary number.
                let end = out.len().min(at + 8);
                out[at..end].fill(*random.choice(&[0xff, 0x7f, 0x00]).unwrap());
            }
            _ => {
                let other = random.usize(..out.len());
                out.swap(at, other);
            }
        }
    }
    out
}

/// Makes particles and cells of a mesh, where that can be done.
fn use_cells<const D: usize>(mesh: &Mesh<D>) {
    let Ok(cells) = Unstructured::new(mesh) else { return };
    let zones = cells.zones(2);
    let _ = cells.smoothing(2, 2, &zones).and_then(|smoothing| smoothing.validate());
    let _ = cells.boundary_pieces(&Part::Whole, 2, 2);
    let _ = cells.contains(&cells.positions()[0]);
}

/// How often damaged files were read, refused.
fn run(rounds: usize, seed: u64) -> [usize; 2] {
    let originals: Vec<Vec<u8>> = FILES.iter().map(|name| file(name)).collect();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut counts = [0; 2];
    for round in 0..rounds {
        let bytes = mutated(&originals[round % originals.len()], &mut random);
        let start = Instant::now();
        let plane = round % FILES.len() == 6;
        let (held, read) =
            peak(|| if plane { Mesh::<2>::parse(&bytes).map(drop) } else { Mesh::<3>::parse(&bytes).map(drop) });
        assert!(start.elapsed().as_secs_f64() < 5.0, "round {round} of seed {seed} hangs");
        // A message and a few names beside the numbers.
        assert!(held <= 10 * bytes.len() + 4096, "round {round} of seed {seed} holds {held} of {}", bytes.len());
        match read {
            Ok(()) => {
                counts[0] += 1;
                // Whatever was read is refused or has cells.
                if plane {
                    Mesh::<2>::parse(&bytes).map(|mesh| use_cells(&mesh)).unwrap();
                } else {
                    Mesh::<3>::parse(&bytes).map(|mesh| use_cells(&mesh)).unwrap();
                }
            }
            Err(error) => {
                counts[1] += 1;
                assert!(error.to_string().len() < 2000);
            }
        }
    }
    counts
}

#[test]
fn damaged_files_neither_panic_nor_hang_nor_fill_the_memory() {
    let [read, refused] = run(3000, 1);
    assert!(read > 100 && refused > 1000, "{read} read, {refused} refused");
}

/// `cargo test --release --test parts -- --ignored --nocapture hundred_thousand`
#[test]
#[ignore = "a minute"]
fn a_hundred_thousand_damaged_files() {
    let [read, refused] = run(100_000, 2);
    println!("{read} read, {refused} refused");
}
