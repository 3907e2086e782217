//! Solids within closed surfaces: reading, closing, inside and outside, names, features.

mod damaged;
#[path = "../parts/memory.rs"]
mod memory;
mod shapes;
mod surfaces;

use rkpm::geometry::Point;

/// A cube of side 2 about the origin, two triangles a side, facing outwards.
pub fn cube() -> (Vec<Point<3>>, Vec<[u32; 3]>) {
    let vertices = (0..8).map(|k| Point::<3>::from_fn(|i, _| f64::from(k >> i & 1) * 2.0 - 1.0)).collect();
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (vertices, sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A sphere of 20 · 4^level facets.
pub fn sphere(level: usize) -> (Vec<Point<3>>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut x: Vec<Point<3>> = Vec::new();
    for s in [-1.0, 1.0] {
        for t in [-g, g] {
            x.extend([[0.0, s, t], [s, t, 0.0], [t, 0.0, s]].map(|x| Point::<3>::from(x).normalize()));
        }
    }
    let edge = (0..12).map(|k| (x[k] - x[0]).norm()).filter(|d| *d > 0.1).fold(9.0, f64::min) * 1.01;
    let mut facets = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let near = |i: u32, j: u32| (x[i as usize] - x[j as usize]).norm() < edge;
                if near(a, b) && near(b, c) && near(c, a) {
                    let out = x[a as usize].dot(&x[b as usize].cross(&x[c as usize])) > 0.0;
                    facets.push(if out { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in facets {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    x.push((x[i as usize] + x[j as usize]).normalize());
                    x.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        facets = finer;
    }
    (x, facets)
}

/// The bytes of a binary STL.
pub fn binary_stl(vertices: &[Point<3>], facets: &[[u32; 3]]) -> Vec<u8> {
    let mut out = vec![0; 80];
    out.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        out.extend([0; 12]);
        facet.iter().for_each(|&v| vertices[v as usize].iter().for_each(|x| out.extend((*x as f32).to_le_bytes())));
        out.extend([0; 2]);
    }
    out
}

/// The text of an ASCII STL of one section, "all".
pub fn ascii_stl(vertices: &[Point<3>], facets: &[[u32; 3]]) -> String {
    let mut text = String::from("solid all\n");
    for facet in facets {
        text += "facet normal 0 0 nan\n outer loop\n";
        for x in facet.map(|v| vertices[v as usize]) {
            text += &format!("  vertex {:e} {} {}\n", x[0], x[1], x[2]);
        }
        text += " endloop\nendfacet\n";
    }
    text + "endsolid all\n"
}

/// A point in the cube of half side `half`.
pub fn drawn(random: &mut fastrand::Rng, half: f64) -> Point<3> {
    Point::<3>::from_fn(|_, _| half * (2.0 * random.f64() - 1.0))
}
