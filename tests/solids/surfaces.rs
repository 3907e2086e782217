//! GOAL: what encloses a solid is taken, whichever way its facets face; what does not is refused with the place.

use rkpm::error::{GeometryError, SolidError};
use rkpm::geometry::Point;
use rkpm::solid::{Select, Solid3, SurfaceFlaws};

use super::{ascii_stl, binary_stl, cube, drawn, sphere};
use approx::{abs_diff_eq, assert_abs_diff_eq};

/// The refusal of a surface.
fn refusal(vertices: Vec<Point<3>>, facets: Vec<[u32; 3]>) -> SolidError {
    match Solid3::new(vertices, facets) {
        Err(GeometryError::Solid(error)) => error,
        other => panic!("{other:?}"),
    }
}

fn shifted(mut part: (Vec<Point<3>>, Vec<[u32; 3]>), by: [f64; 3], scale: f64) -> (Vec<Point<3>>, Vec<[u32; 3]>) {
    part.0.iter_mut().for_each(|x| *x = *x * scale + Point::<3>::from(by));
    part
}

fn both(a: (Vec<Point<3>>, Vec<[u32; 3]>), b: (Vec<Point<3>>, Vec<[u32; 3]>)) -> (Vec<Point<3>>, Vec<[u32; 3]>) {
    let count = a.0.len() as u32;
    let facets = a.1.into_iter().chain(b.1.into_iter().map(|facet| facet.map(|v| v + count))).collect();
    (a.0.into_iter().chain(b.0).collect(), facets)
}

#[test]
fn facets_are_turned_outwards_whatever_their_order() {
    let mut random = fastrand::Rng::with_seed(1);
    for (vertices, facets) in [cube(), sphere(2)] {
        let exact = Solid3::new(vertices.clone(), facets.clone()).unwrap();
        for _ in 0..20 {
            // Facets in any order and turn, each with vertices of its own.
            let mut soup: Vec<[u32; 3]> = facets.clone();
            random.shuffle(&mut soup);
            soup.iter_mut().filter(|_| random.bool()).for_each(|facet| facet.reverse());
            let own: Vec<Point<3>> = soup.iter().flatten().map(|&v| vertices[v as usize]).collect();
            let numbers = (0..soup.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
            let solid = Solid3::new(own, numbers).unwrap();
            assert_eq!((solid.vertices().len(), solid.facets().len()), (vertices.len(), facets.len()));
            assert_abs_diff_eq!(solid.volume(), exact.volume(), epsilon = 1e-12);
            assert_abs_diff_eq!(solid.area(), exact.area(), epsilon = 1e-12);
        }
    }
}

#[test]
fn inside_and_outside_are_those_of_the_sphere() {
    let (vertices, facets) = sphere(4);
    let solid = Solid3::new(vertices.clone(), facets.clone()).unwrap();
    // Without one facet it is closed, and the same but there.
    let holed = Solid3::new(vertices, facets[1..].to_vec()).unwrap();
    assert_eq!(holed.facets().len(), facets.len());
    let mut random = fastrand::Rng::with_seed(2);
    for _ in 0..2000 {
        let x = drawn(&mut random, 1.5);
        // Facets of this level lie 1.3e-3 below the sphere.
        if (x.norm() - 1.0).abs() < 2e-3 {
            continue;
        }
        let inside = x.norm() < 1.0;
        assert!(solid.contains(&x) == inside && holed.contains(&x) == inside);
        let closest = solid.closest(&x);
        assert_abs_diff_eq!(closest.distance, (x.norm() - 1.0).abs(), epsilon = 2e-3);
        let least = (0..facets.len()).map(|f| (solid.corners(f).iter().sum::<Point<3>>() / 3.0 - x).norm());
        assert!(closest.distance <= least.fold(f64::INFINITY, f64::min) + 1e-15);
    }
}

/// The flat of a half shaft has its vertices on the cylinder too, and its normal across the axis.
#[test]
fn cylinders_leave_out_the_flats_between_their_generators() {
    const SIDES: u32 = 16;
    let rim = |k: u32| (std::f64::consts::PI * f64::from(k) / f64::from(SIDES)).sin_cos();
    let ends = (0..=SIDES).map(|k| [rim(k).1, rim(k).0, 0.0].map(|x| 2.0 * x));
    let vertices: Vec<Point<3>> = ends.flat_map(|[x, y, _]| [[x, y, 0.0], [x, y, 9.0]].map(Point::from)).collect();
    let mut facets: Vec<[u32; 3]> = Vec::new();
    for k in 0..SIDES {
        facets.extend([[2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1]]);
    }
    for k in 1..SIDES {
        facets.extend([[0, 2 * k + 2, 2 * k], [1, 2 * k + 1, 2 * k + 3]]);
    }
    facets.extend([[0, 2 * SIDES + 1, 2 * SIDES], [0, 1, 2 * SIDES + 1]]);
    let solid = Solid3::new(vertices, facets).unwrap();
    let select = || Select::cylinder([0.0; 3], [0.0, 0.0, -3.0], 2.0);
    let solid = solid.name("shaft", select()).unwrap();
    let found = solid.facets_of("shaft").unwrap();
    assert_eq!(found.len(), 2 * SIDES as usize);
    assert!(found.iter().all(|&facet| solid.corners(facet as usize).iter().any(|x| x[1] > 0.1)));
    // Normals are off the radii to the vertices by half a side, 0.098 rad.
    assert!(solid.clone().name("none", select().angle(0.09)).is_err());
    assert!(solid.name("all", select().angle(0.1)).is_ok());
}

#[test]
fn parts_within_parts_are_cavities_whichever_way_they_face() {
    let inner = || shifted(cube(), [0.1, 0.0, 0.0], 0.25);
    let mut cavity = inner();
    cavity.1.iter_mut().for_each(|facet| facet.reverse());
    for inside_out in [false, true] {
        let (vertices, mut facets) = both(cube(), cavity.clone());
        if inside_out {
            facets.iter_mut().for_each(|facet| facet.reverse());
        }
        let solid = Solid3::new(vertices, facets).unwrap();
        assert_abs_diff_eq!(solid.volume(), 8.0 - 0.125, epsilon = 1e-12);
        assert!(!solid.contains(&[0.1, 0.0, 0.0].into()) && solid.contains(&[0.5, 0.0, 0.0].into()));
    }
    // A body in a cavity, each of the three facing either way: (2³ − 1³ + 0.25³) in all.
    for which in 0..8 {
        let turned = |number: usize, mut part: (Vec<Point<3>>, Vec<[u32; 3]>)| {
            if which >> number & 1 == 1 {
                part.1.iter_mut().for_each(|facet| facet.reverse());
            }
            part
        };
        let inside = both(turned(1, shifted(cube(), [0.2, 0.0, 0.0], 0.5)), turned(2, inner()));
        let (vertices, facets) = both(turned(0, cube()), inside);
        let found = SurfaceFlaws::of(&vertices, &facets).unwrap();
        let solid = Solid3::new(vertices, facets).unwrap();
        assert_abs_diff_eq!(solid.volume(), 8.0 - 1.0 + 0.125, epsilon = 1e-12);
        assert!(solid.contains(&[0.1, 0.0, 0.0].into()) && !solid.contains(&[0.5, 0.0, 0.0].into()));
        // What was turned is listed: nothing where the cavity alone faces inwards.
        assert_eq!(found == SurfaceFlaws::default(), which == 2, "{which}");
    }
    // As Gmsh writes a pore: facets away from its middle, as those of the block around it.
    let (vertices, facets) = both(cube(), inner());
    let report = rkpm::check::surface(&vertices, &facets).unwrap();
    let nested = report.finding("no part lies within another that faces the same way").unwrap();
    assert!(nested.violation == 1.0 && nested.at.starts_with("X = ["), "{report}");
    assert_abs_diff_eq!(Solid3::new(vertices, facets).unwrap().volume(), 8.0 - 0.125, epsilon = 1e-12);
    let (vertices, facets) = both(cube(), shifted(cube(), [3.0, 0.5, 0.0], 1.0));
    assert_abs_diff_eq!(Solid3::new(vertices, facets).unwrap().volume(), 16.0, epsilon = 1e-12);
}

#[test]
fn what_encloses_nothing_is_refused_with_the_place() {
    assert!(matches!(refusal(vec![], vec![]), SolidError::Empty { .. }));
    let (vertices, facets) = cube();
    let open = refusal(vertices.clone(), facets[..10].to_vec());
    assert!(
        matches!(open, SolidError::Open { edges: 4, at, area } if at[2] == 1.0 && abs_diff_eq!(area, 4.0, epsilon = 1e-12))
    );
    let (crossed, crossing) = both(cube(), shifted(cube(), [0.7, 0.4, 0.3], 0.8));
    assert!(matches!(refusal(crossed, crossing), SolidError::Crossing { at, .. } if at.iter().all(|x| x.abs() < 1.51)));
    // A wall across the cube.
    let mut walled = facets.clone();
    walled.extend([[0, 1, 7], [0, 7, 6]]);
    assert!(matches!(refusal(vertices.clone(), walled), SolidError::Branching { facets: 3, .. }));
    let dangling = refusal(vertices.clone(), vec![[0, 1, 8]]);
    assert!(matches!(dangling, SolidError::DanglingVertex { facet: 0, vertex: 8, count: 8 }));
    let flat = refusal(vertices, vec![[0, 1, 2], [0, 2, 1]]);
    assert!(matches!(flat, SolidError::Empty { .. }));
    let far = vec![[0.0; 3].into(), [f64::NAN, 0.0, 0.0].into(), [0.0, 1.0, 0.0].into()];
    assert!(matches!(Solid3::new(far, vec![[0, 1, 2]]), Err(GeometryError::Invalid(_))));
    // A Möbius strip, thickened nowhere.
    let strip = |k: usize, side: f64| {
        let angle = std::f64::consts::TAU * k as f64 / 12.0;
        let (out, up) = (2.0 + side * (angle / 2.0).cos(), side * (angle / 2.0).sin());
        Point::<3>::new(out * angle.cos(), out * angle.sin(), up)
    };
    let band = (0..12).flat_map(|k| {
        let [a, b, c, d] = [strip(k, -0.5), strip(k, 0.5), strip(k + 1, -0.5), strip(k + 1, 0.5)];
        [a, b, c, b, d, c]
    });
    let band: Vec<Point<3>> = band.collect();
    let numbers = (0..24).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    assert!(matches!(refusal(band, numbers), SolidError::OneSided { .. }));
}

#[test]
fn flat_facets_and_cracks_go() {
    let (mut vertices, mut facets) = cube();
    // A vertex on an edge of one side alone, with a facet without area in the crack, and without.
    vertices.push([0.0, -1.0, -1.0].into());
    let split = facets.iter().position(|f| f.contains(&0) && f.contains(&1)).unwrap();
    let [a, b, c] = facets[split];
    let third = [a, b, c].into_iter().find(|v| ![0, 1].contains(v)).unwrap();
    let rises = [[a, b], [b, c], [c, a]].contains(&[0, 1]);
    facets.remove(split);
    facets.extend(if rises { [[0, 8, third], [8, 1, third]] } else { [[8, 0, third], [1, 8, third]] });
    for sliver in [false, true] {
        let mut facets = facets.clone();
        if sliver {
            facets.push([0, 1, 8]);
        }
        let solid = Solid3::new(vertices.clone(), facets).unwrap();
        assert_abs_diff_eq!(solid.volume(), 8.0, epsilon = 1e-12);
        assert_eq!(solid.facets().len(), 14);
        assert!(solid.normals().iter().all(|n| abs_diff_eq!(n.norm(), 1.0, epsilon = 1e-12)));
    }
}

#[test]
fn slivers_on_an_edge_go_where_it_is_closed_without_them() {
    let (mut vertices, facets) = cube();
    vertices.push([0.0, -1.0, -1.0].into());
    // Both facets at the edge split at its middle, or none.
    for is_split in [false, true] {
        let mut all: Vec<[u32; 3]> = Vec::new();
        for facet in &facets {
            let sides = [0, 1, 2].map(|k| [facet[k], facet[(k + 1) % 3]]);
            match sides.iter().position(|side| *side == [0, 1] || *side == [1, 0]).filter(|_| is_split) {
                Some(k) => {
                    let [a, b, c] = [0, 1, 2].map(|i| facet[(k + i) % 3]);
                    all.extend([[a, 8, c], [8, b, c]]);
                }
                None => all.push(*facet),
            }
        }
        for sliver in [[0, 1, 8], [0, 8, 1]] {
            let mut with = all.clone();
            with.push(sliver);
            let report = rkpm::check::surface(&vertices, &with).unwrap();
            let flat = report.finding("facets have areas").unwrap();
            assert!(flat.violation == 1.0 && flat.at == "X = [0.0, -1.0, -1.0]", "{report}");
            let solid = Solid3::new(vertices.clone(), with).unwrap();
            assert_eq!(solid.facets().len(), all.len());
            assert_abs_diff_eq!(solid.volume(), 8.0, epsilon = 1e-12);
        }
    }
    let (vertices, mut facets) = cube();
    facets.extend([facets[3], facets[5]]);
    assert_eq!(SurfaceFlaws::of(&vertices, &facets).unwrap().doubled.len(), 2);
    assert_eq!(Solid3::new(vertices, facets).unwrap().facets().len(), 12);
}

#[test]
fn patches_are_the_sides_of_a_cube() {
    let (vertices, facets) = cube();
    let solid = Solid3::new(vertices, facets).unwrap();
    assert_eq!(solid.patches(0.5).len(), 6);
    let (vertices, facets) = sphere(3);
    let round = Solid3::new(vertices, facets).unwrap();
    assert_eq!(round.patches(0.5).len(), 1);
    let named = solid.name("base", Select::plane([0.0, 0.0, -1.0], [0.0, 0.0, -2.0])).unwrap();
    assert!(named.facets_of("base").unwrap().iter().all(|&f| named.normals()[f as usize][2] == -1.0));
    let missing = named.clone().name("top", Select::plane([0.0, 0.0, 2.0], [0.0, 0.0, 1.0])).unwrap_err().to_string();
    assert!(missing.contains("lies off it by 1.000e0"), "{missing}");
    let unknown = named.facets_of("lid").unwrap_err().to_string();
    assert!(unknown.contains("base"), "{unknown}");
}

#[test]
fn binary_and_ascii_files_are_the_same_solid() {
    let (vertices, facets) = sphere(2);
    let binary = Solid3::parse_stl(&binary_stl(&vertices, &facets)).unwrap();
    let [lower, upper] = [&facets[..160], &facets[160..]].map(|half| ascii_stl(&vertices, half));
    let text = lower.replace("\nendsolid all", "\nendsolid").replace("solid all", "solid lower half") + &upper;
    let ascii = Solid3::parse_stl(text.as_bytes()).unwrap();
    assert_eq!(ascii.facets(), binary.facets());
    assert_abs_diff_eq!(ascii.volume(), binary.volume(), epsilon = 1e-6);
    assert_eq!(ascii.facets_of("lower half").unwrap().len(), 160);
}

/// Names are in any language and encoding, whatever stands in the header of a binary file.
#[test]
fn names_do_not_tell_text_from_binary_files() {
    let (vertices, facets) = sphere(1);
    let text = ascii_stl(&vertices, &facets);
    for name in ["part", "Gehäuse", "деталь 3", "部品", "a\tb"] {
        let solid = Solid3::parse_stl(text.replace("solid all", &format!("solid {name}")).as_bytes()).unwrap();
        assert_eq!(solid.facets().len(), facets.len(), "{name}");
    }
    // As older programs write it: one byte for each letter.
    let named = [&b"solid Geh\xe4use\n"[..], &text.as_bytes()[text.find('\n').unwrap() + 1..]].concat();
    assert_eq!(Solid3::parse_stl(&named).unwrap().facets().len(), facets.len());
    for header in ["solid part", "solid Gehäuse", "COLOR="] {
        let mut bytes = binary_stl(&vertices, &facets);
        bytes[..header.len()].copy_from_slice(header.as_bytes());
        bytes.extend(b"what some programs append");
        assert_eq!(Solid3::parse_stl(&bytes).unwrap().facets().len(), facets.len(), "{header}");
    }
}

#[test]
fn the_bunny_is_closed() {
    let bunny = Solid3::stl("examples/geometry/bunny.stl").unwrap();
    println!("volume {:.6}, area {:.6}", bunny.volume(), bunny.area());
    // By the divergence theorem over the facets as they stand in the file, in double precision.
    assert_abs_diff_eq!(bunny.volume(), 194.288_371, epsilon = 1e-6);
}

#[test]
fn flaws_are_values_with_places() {
    let find = |(vertices, facets): (Vec<Point<3>>, Vec<[u32; 3]>)| SurfaceFlaws::of(&vertices, &facets).unwrap();
    assert_eq!(find(sphere(2)), SurfaceFlaws::default());
    let (vertices, mut facets) = cube();
    facets[0].swap(0, 1);
    facets.pop();
    facets.push([0, 1, 1]);
    let flaws = find((vertices, facets));
    assert_eq!((flaws.open.len(), flaws.turned.len(), flaws.flat.as_slice()), (3, 2, &[11][..]));
    assert!(flaws.open.iter().flatten().all(|x| x[2] == 1.0));
    let flaws = find(both(cube(), shifted(cube(), [0.7, 0.4, 0.3], 0.8)));
    assert!(!flaws.crossing.is_empty() && flaws.crossing.iter().all(|(pair, at)| pair[1] >= 12 && at.amax() < 1.51));
    assert_eq!(find(both(cube(), shifted(cube(), [0.1, 0.0, 0.0], 0.25))).nested.len(), 1);
    let (vertices, mut facets) = cube();
    facets.iter_mut().for_each(|facet| facet.reverse());
    assert_eq!(find((vertices, facets)).inside_out.len(), 1);
}
