//! STL files that were damaged and arrays of facets that are wrong: solids, what is asked of them, lattices in them.

use std::sync::OnceLock;

use rkpm::cells::{Cells, CutLattice};
use rkpm::error::GeometryError;
use rkpm::geometry::Point;
use rkpm::solid::{Solid3, SurfaceFlaws};

use super::harness::{Input, held};

/// Three corners of each facet.
type Facets = Vec<[[f64; 3]; 3]>;

/// A box, its facets facing outwards.
fn cube(half: f64, middle: [f64; 3]) -> Facets {
    let corner = |k: usize| std::array::from_fn(|i| middle[i] + half * (f64::from(k as u32 >> i & 1) * 2.0 - 1.0));
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|facet| facet.map(corner)).collect()
}

/// A ring of n by m quadrangles.
fn torus(n: usize, m: usize) -> Facets {
    let corner = |i: usize, j: usize| {
        let [u, v] = [(i % n, n), (j % m, m)].map(|(k, of)| std::f64::consts::TAU * k as f64 / of as f64);
        let radius = 1.0 + 0.45 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.45 * v.sin()]
    };
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let of_quad = |(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    quads.flat_map(of_quad).collect()
}

fn binary(facets: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        out.extend([0; 12]);
        facet.iter().flatten().for_each(|x| out.extend((*x as f32).to_le_bytes()));
        out.extend([0; 2]);
    }
    out
}

fn ascii(sections: &[(&str, &[[[f64; 3]; 3]])]) -> Vec<u8> {
    let mut text = String::new();
    for (name, facets) in sections {
        text += &format!("solid {name}\n");
        for facet in *facets {
            text += "facet normal 0 0 nan\n outer loop\n";
            facet.iter().for_each(|[x, y, z]| text += &format!("  vertex {x:e} {y} {z}\n"));
            text += " endloop\nendfacet\n";
        }
        text += &format!("endsolid {name}\n");
    }
    text.into_bytes()
}

/// Sound files, binary and of text: one part, a cavity, a part beside another, named sections.
fn originals() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| {
        let (ring, single) = (torus(12, 8), cube(1.0, [0.0; 3]));
        let nested = [cube(1.0, [0.0; 3]), cube(0.5, [0.1, 0.0, 0.0])].concat();
        let beside =
            [cube(1.0, [0.0; 3]), torus(7, 5).iter().map(|f| f.map(|x| x.map(|x| x + 4.0))).collect()].concat();
        let named = ascii(&[("low", &single[..4]), ("high", &single[4..])]);
        vec![
            binary(&ring),
            ascii(&[("ring", &ring)]),
            binary(&nested),
            named,
            binary(&beside),
            ascii(&[("cube", &single)]),
            binary(&single),
        ]
    })
}

/// A number of single precision that nobody wants.
fn bad_single(input: &mut Input) -> f32 {
    let bad =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e30, -1e20, 1e-45, f32::MIN_POSITIVE, 0.0];
    if input.once_in(6) { f32::from_bits(input.random.u32(..)) } else { input.pick(&bad) }
}

/// Damages a file in one place.
fn damage(input: &mut Input, out: &mut Vec<u8>) {
    if out.is_empty() {
        return;
    }
    let at = input.random.usize(..out.len());
    let end = out.len().min(at + input.random.usize(1..200));
    let kind = input.random.u8(..12);
    let _ = input.saw("kind, at", (kind, at));
    match kind {
        0 => out[at] = input.random.u8(..),
        1 => out[at] ^= 1 << input.random.u8(..8),
        2 => out.truncate(at),
        3 => drop(out.drain(at..end)),
        4 => {
            let piece = out[at..end].to_vec();
            let to = input.random.usize(..out.len());
            out.splice(to..to, piece);
        }
        5 => out[at..end].fill(input.pick(&[0xff, 0x7f, 0x00, b'9', b' ', b'\n'])),
        6 => {
            let words =
                ["nan", "inf", "1e400", "-1e38", " 1e-40 ", "solid", "endsolid", "facet", "vertex 0 0 0 ", "\u{e9}"];
            let word = input.pick(&words);
            out.splice(at..at, word.bytes());
        }
        // A number of a binary file where it stands.
        7 | 8 if out.len() > 134 => {
            let facet = 84 + 50 * input.random.usize(..(out.len() - 84) / 50);
            let place = facet + 12 + 4 * input.random.usize(..9);
            let number = bad_single(input);
            out[place..place + 4].copy_from_slice(&number.to_le_bytes());
        }
        // The count of one.
        9 if out.len() > 84 => {
            let right = ((out.len() - 84) / 50) as u32;
            let count = input.pick(&[0, 1, right - right.min(1), right + 1, right / 2, 1 << 31, u32::MAX, 85_899_346]);
            out[80..84].copy_from_slice(&count.to_le_bytes());
        }
        10 => out[..at.min(80)].fill(b' '),
        _ => {
            let header = input.pick(&["solid ", "SOLID x\n", "", "\u{feff}solid"]);
            let to = header.len().min(out.len());
            out[..to].copy_from_slice(&header.as_bytes()[..to]);
        }
    }
}

pub fn files(input: &mut Input) {
    let which = input.random.usize(..originals().len());
    let mut bytes = originals()[which].clone();
    let places = input.random.usize(..5);
    let _ = input.saw("file, places", (which, places));
    (0..places).for_each(|_| damage(input, &mut bytes));
    if input.once_in(500) {
        bytes.clear();
    }
    // The count of a binary file as its length has it, so that more is read than the header.
    if input.once_in(2) && bytes.len() > 84 && !bytes.starts_with(b"solid") {
        let count = ((bytes.len() - 84) / 50) as u32;
        bytes.truncate(84 + 50 * count as usize);
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
    }
    let (most, read) = held(|| Solid3::parse_stl(&bytes));
    assert!(most <= 10 * bytes.len() + 8192, "holds {most} bytes of a file of {}", bytes.len());
    used(input, read);
}

/// What was read is a solid, and what was refused is so for a reason that a reader can use.
fn used(input: &mut Input, read: Result<Solid3, GeometryError>) {
    let solid = match read {
        Ok(solid) => solid,
        Err(error) => {
            let typed = matches!(error, GeometryError::Solid(_) | GeometryError::Invalid(_));
            let text = error.to_string();
            assert!(typed && text.len() < 2000 && text.contains([':', ';']), "{error:?}: {text}");
            return;
        }
    };
    input.passed = true;
    assert!(solid.volume() > 0.0 && solid.volume().is_finite() && solid.area().is_finite(), "{}", solid.volume());
    let at = input.point::<3>(-1.5, 1.5);
    let at = input.saw("at", at);
    let _ = (solid.contains(&at), solid.closest(&at), solid.winding_number(&at));
    let _ = (solid.features(0.5), solid.patches(0.5));
    if input.once_in(6) {
        let size = solid.bounds();
        let wide = (size.max - size.min).amax();
        let part = input.number(2.0, 6.0);
        let spacing = input.saw("spacing", wide / part.clamp(0.0, 8.0));
        if let Ok(cells) = CutLattice::new(&solid, spacing) {
            let zones = cells.zones(2);
            let _ = cells.smoothing(2, 2, &zones).map(|smoothing| smoothing.validate());
            let _ = cells.contains(&at);
        }
    }
}

pub fn arrays(input: &mut Input) {
    let facets = if input.once_in(2) { torus(8, 5) } else { cube(1.0, [0.0; 3]) };
    let mut vertices: Vec<Point<3>> = facets.iter().flatten().map(|x| Point::<3>::from(*x)).collect();
    let mut corners: Vec<[u32; 3]> = (0..facets.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    for _ in 0..input.random.usize(..4) {
        let (vertex, facet) = (input.random.usize(..vertices.len()), input.random.usize(..facets.len()));
        match input.random.u8(..6) {
            // One corner of one facet, or all at its place.
            0 => vertices[vertex] = input.point(-1.0, 1.0),
            1 | 2 => {
                let (from, to) = (vertices[vertex], input.point(-1.0, 1.0));
                vertices.iter_mut().filter(|x| **x == from).for_each(|x| *x = to);
            }
            3 => corners[facet][input.random.usize(..3)] = input.index(vertices.len()) as u32,
            4 => corners[facet].swap(1, 2),
            _ => {
                corners.truncate(input.length(facets.len()));
                if corners.is_empty() {
                    break;
                }
                corners.resize(facets.len(), [0, 1, 2]);
            }
        }
    }
    let _ = input.saw("vertices, facets", (&vertices, &corners));
    let flaws = SurfaceFlaws::of(&vertices, &corners);
    let read = Solid3::new(vertices, corners);
    if let (Ok(flaws), Err(error)) = (&flaws, &read) {
        assert!(!flaws.is_empty(), "refused without a flaw: {error}");
    }
    used(input, read);
}
