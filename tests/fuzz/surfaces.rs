//! Arrays of facets that are wrong: solids, what is asked of them, lattices in them. Damaged files stand in `tests/solids/damaged.rs`.

use rkpm::cells::{Cells, CutLattice};
use rkpm::error::GeometryError;
use rkpm::geometry::Point;
use rkpm::solid::{Solid3, SurfaceFlaws};

use super::harness::Input;

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
    let _ = (solid.contains(&at), solid.closest(&at));
    let _ = solid.patches(0.5);
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
        assert!(*flaws != SurfaceFlaws::default(), "refused without a flaw: {error}");
    }
    used(input, read);
}
