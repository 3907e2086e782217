//! GOAL: damaged STL files are refused or read, without a panic, a hang or more memory than ten times the file.

use rkpm::cells::{Cells, CutLattice};
use rkpm::error::GeometryError;
use rkpm::solid::Solid3;

use super::memory::peak;
use super::{ascii_stl, binary_stl, cube, sphere};
use approx::relative_eq;

/// Damages a file in one to four places.
fn mutated(bytes: &[u8], random: &mut fastrand::Rng) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..random.usize(1..=4) {
        let at = random.usize(..out.len().max(1));
        let end = out.len().min(at + random.usize(1..120));
        match random.u8(..7) {
            _ if out.is_empty() => break,
            0 => out[at] = random.u8(..),
            1 => out[at] ^= 1 << random.u8(..8),
            2 => out.truncate(at),
            3 => drop(out.drain(at..end)),
            4 => {
                let piece = out[at..end].to_vec();
                out.splice(at..at, piece);
            }
            5 => out[at..end].fill(*random.choice(&[0xff, 0x7f, 0x00, b'9', b' ']).unwrap()),
            _ => {
                let words = ["nan", "1e400", "-1e38", " 1e-40 ", "solid", "endsolid", "facet", "vertex 0 0 0 "];
                out.splice(at..at, random.choice(&words).unwrap().bytes());
            }
        }
    }
    // The count of a binary file where it stands, so that some get past it.
    if random.bool() && out.len() > 84 && !out.starts_with(b"solid") {
        let count = ((out.len() - 84) / 50) as u32;
        out.truncate(84 + 50 * count as usize);
        out[80..84].copy_from_slice(&count.to_le_bytes());
    }
    out
}

#[test]
fn damaged_files_neither_panic_nor_fill_the_memory() {
    let (round, square) = (sphere(2), cube());
    let originals = [
        binary_stl(&round.0, &round.1),
        ascii_stl(&round.0, &round.1).into_bytes(),
        binary_stl(&square.0, &square.1),
        ascii_stl(&square.0, &square.1).into_bytes(),
    ];
    let mut random = fastrand::Rng::with_seed(4);
    let rounds = std::env::var("DAMAGED").map_or(2000, |n| n.parse().unwrap());
    let (mut read, mut refused, mut divided) = (0, 0, 0);
    for number in 0..rounds {
        let bytes = mutated(&originals[number % 4], &mut random);
        let (held, result) = peak(|| Solid3::parse_stl(&bytes));
        assert!(held <= 10 * bytes.len() + 8192, "round {number} holds {held} of {}", bytes.len());
        match result {
            Ok(solid) => {
                read += 1;
                let (volume, size) = (solid.volume(), solid.bounds());
                // What was read is cut as well, or refused by type: one in six, which takes longer than reading.
                let cut = (read % 6 == 1).then(|| CutLattice::new(&solid, 0.25 * (size.max - size.min).amax()));
                if let Some(Ok(cells)) = cut {
                    divided += 1;
                    let found: f64 = cells.smoothing(2, 2, &cells.zones(2)).unwrap().volumes().iter().sum();
                    assert!(
                        relative_eq!(found, volume, epsilon = 0.0, max_relative = 1e-6),
                        "round {number}: {found} of {volume}"
                    );
                }
                assert!(volume > 0.0 && volume.is_finite(), "round {number}: {volume}");
            }
            Err(GeometryError::Solid(_) | GeometryError::Invalid(_)) => refused += 1,
            Err(other) => panic!("round {number}: {other}"),
        }
    }
    // Both ends are reached, and solids are cut.
    assert!(read > rounds / 100 && refused > rounds / 3, "{read} read, {refused} refused");
    assert!(divided > read / 20, "{divided} of {read} cut");
}
