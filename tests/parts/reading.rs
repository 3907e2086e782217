//! GOAL: meshes as Gmsh writes them are read whole, from all four formats alike, and what is wrong is named.
//! GEOMETRY: a cylinder of two materials (tetrahedra), a plate with a hole (prisms, hexahedra), one in the plane.
//! REFERENCE: `tests/reference/mesh_measures.csv`, volumes and areas by numpy of what meshio reads; rounding 1e-13.

use std::fmt::Write as _;
use std::time::Instant;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::error::MeshError;
use rkpm::geometry::Point;
use rkpm::mesh::{CellShape, Mesh};

use super::file;

#[test]
fn volumes_and_areas_by_group_are_those_that_meshio_reads() {
    let reference = include_str!("../reference/mesh_measures.csv");
    let mut compared = 0;
    for line in reference.lines().skip(2) {
        let cells: Vec<&str> = line.split(',').collect();
        let [name, _, group, value] = cells[..] else { panic!("{line}") };
        let value: f64 = value.parse().unwrap();
        let found = if name == "flat.msh" {
            Mesh::<2>::parse(&file(name)).unwrap().measure(group).unwrap()
        } else {
            Mesh::<3>::parse(&file(name)).unwrap().measure(group).unwrap()
        };
        assert!(relative_eq!(found, value, max_relative = 1e-12), "{line}: {found}");
        compared += 1;
    }
    assert_eq!(compared, 31);
}

#[test]
fn all_four_formats_read_the_same() {
    let first = Mesh::<3>::parse(&file("plug_41_binary.msh")).unwrap();
    assert_eq!(first.groups(3).collect::<Vec<_>>(), ["rubber", "steel plate"]);
    assert_eq!(first.groups(2).collect::<Vec<_>>(), ["base", "ends", "top"]);
    for name in ["plug_41_ascii.msh", "plug_22_ascii.msh", "plug_22_binary.msh"] {
        let other = Mesh::<3>::parse(&file(name)).unwrap();
        assert_eq!(first.cell_count(), other.cell_count(), "{name}");
        assert_eq!(first.points().len(), other.points().len());
        for (a, b) in first.points().iter().zip(other.points()) {
            // Text has sixteen digits.
            assert!(abs_diff_eq!(a, b, epsilon = 5e-16), "{name}: {a} {b}");
        }
        for cell in 0..first.cell_count() {
            assert_eq!(first.cell(cell), other.cell(cell), "{name}");
        }
        let mut groups: Vec<&str> = other.groups(2).collect();
        groups.sort_unstable();
        assert_eq!(groups, ["base", "ends", "top"]);
    }
    // Of second order by their corners: the same cells.
    let second = Mesh::<3>::parse(&file("plug_second_order.msh")).unwrap();
    assert_eq!(second.points().len(), first.points().len());
    assert_eq!(second.cell_count(), first.cell_count());
    assert_relative_eq!(second.total(), first.total(), max_relative = 1e-12);
}

/// The bytes of a binary file of the other order: what a machine of that kind would write.
fn swapped(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut at = 0;
    let line = |at: usize| at + bytes[at..].iter().position(|b| *b == b'\n').unwrap() + 1;
    let number = |out: &mut Vec<u8>, at: &mut usize, size: usize| -> u64 {
        let mut word = [0u8; 8];
        word[..size].copy_from_slice(&bytes[*at..*at + size]);
        out.extend(bytes[*at..*at + size].iter().rev());
        *at += size;
        u64::from_le_bytes(word)
    };
    while at < bytes.len() {
        let end = line(at);
        out.extend_from_slice(&bytes[at..end]);
        let head = std::str::from_utf8(&bytes[at..end]).unwrap().trim().to_string();
        at = end;
        match head.as_str() {
            "$MeshFormat" => {
                let end = line(at);
                out.extend_from_slice(&bytes[at..end]);
                at = end;
                number(&mut out, &mut at, 4);
            }
            "$Entities" => {
                let counts: [u64; 4] = std::array::from_fn(|_| number(&mut out, &mut at, 8));
                for (dimension, count) in counts.into_iter().enumerate() {
                    for _ in 0..count {
                        number(&mut out, &mut at, 4);
                        for _ in 0..if dimension == 0 { 3 } else { 6 } {
                            number(&mut out, &mut at, 8);
                        }
                        for _ in 0..if dimension == 0 { 1 } else { 2 } {
                            for _ in 0..number(&mut out, &mut at, 8) {
                                number(&mut out, &mut at, 4);
                            }
                        }
                    }
                }
            }
            "$Nodes" => {
                let blocks = number(&mut out, &mut at, 8);
                for _ in 0..3 {
                    number(&mut out, &mut at, 8);
                }
                for _ in 0..blocks {
                    for _ in 0..3 {
                        number(&mut out, &mut at, 4);
                    }
                    for _ in 0..4 * number(&mut out, &mut at, 8) {
                        number(&mut out, &mut at, 8);
                    }
                }
            }
            "$Elements" => {
                let blocks = number(&mut out, &mut at, 8);
                for _ in 0..3 {
                    number(&mut out, &mut at, 8);
                }
                for _ in 0..blocks {
                    let [_, _, kind] = [0, 1, 2].map(|_| number(&mut out, &mut at, 4));
                    let nodes = [0, 2, 3, 4, 4, 8, 6][usize::try_from(kind).unwrap() % 15];
                    for _ in 0..number(&mut out, &mut at, 8) * (1 + nodes) {
                        number(&mut out, &mut at, 8);
                    }
                }
            }
            _ => {}
        }
    }
    out
}

#[test]
fn either_order_of_bytes_is_read() {
    for name in ["plug_41_binary.msh", "prisms.msh", "hexahedra.msh"] {
        let bytes = file(name);
        let other = swapped(&bytes);
        assert_ne!(bytes, other);
        assert_eq!(Mesh::<3>::parse(&bytes), Mesh::<3>::parse(&other), "{name}");
    }
}

#[test]
fn bodies_and_refined_meshes_keep_their_groups() {
    let plug = Mesh::<3>::parse(&file("plug_41_binary.msh")).unwrap();
    let rubber = plug.body("rubber").unwrap();
    assert_abs_diff_eq!(rubber.total(), plug.measure("rubber").unwrap(), epsilon = 1e-12);
    // The face on which the steel is bonded has the steel's name.
    assert_eq!(rubber.groups(2).collect::<Vec<_>>(), ["base", "ends", "steel plate"]);
    let steel = plug.body("steel plate").unwrap();
    assert_abs_diff_eq!(rubber.measure("steel plate").unwrap(), steel.measure("rubber").unwrap(), epsilon = 1e-12);
    assert_abs_diff_eq!(steel.measure("rubber").unwrap() / steel.measure("top").unwrap(), 1.0, epsilon = 1e-2);
    assert_abs_diff_eq!(rubber.measure("ends").unwrap(), plug.measure("base").unwrap(), epsilon = 1e-12);
    let finer = plug.refined().unwrap();
    assert_eq!(finer.cell_count(), 8 * plug.cell_count());
    for group in ["rubber", "steel plate", "base", "ends", "top"] {
        let (a, b) = (finer.measure(group).unwrap(), plug.measure(group).unwrap());
        assert!(abs_diff_eq!(a / b, 1.0, epsilon = 1e-12), "{group}: {a} {b}");
    }
    // Of second order: refined meshes follow the cylinder, whose volume chords cut short.
    let second = Mesh::<3>::parse(&file("plug_second_order.msh")).unwrap();
    let mut finer = second.clone();
    let volume = 1.5 * std::f64::consts::PI;
    let mut off = vec![1.0 - second.total() / volume];
    for _ in 0..2 {
        finer = finer.refined().unwrap();
        off.push(1.0 - finer.total() / volume);
    }
    println!("volume short of the cylinder's by {off:?}");
    // Of second order in the size of the cells, towards the body whose edges are parabolas, which is nearly the cylinder.
    let steps = [off[0] - off[1], off[1] - off[2]];
    let left = off[2] - steps[1] / 3.0;
    assert!(steps[1] < steps[0] / 3.5 && left.abs() < 0.03 * off[0], "{off:?} {left}");
    let flat = Mesh::<2>::parse(&file("flat.msh")).unwrap();
    assert_relative_eq!(flat.refined().unwrap().total(), flat.total(), max_relative = 1e-12);
}

/// A text file with the given nodes and elements.
fn text(nodes: &str, elements: &str) -> Vec<u8> {
    let count = |lines: &str| lines.lines().count();
    let format = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let nodes = format!("$Nodes\n{}\n{nodes}$EndNodes\n", count(nodes));
    format!("{format}{nodes}$Elements\n{}\n{elements}$EndElements\n", count(elements)).into_bytes()
}

#[test]
fn what_is_wrong_is_named() {
    let corners = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
    let sound = text(corners, "1 4 2 1 1 1 2 3 4\n");
    let mesh = Mesh::<3>::parse(&sound).unwrap();
    assert_abs_diff_eq!(mesh.measure("1").unwrap(), 1.0 / 6.0, epsilon = 1e-15);
    // Mirrored numbering is turned round.
    let mirrored = Mesh::<3>::parse(&text(corners, "1 4 2 1 1 1 3 2 4\n")).unwrap();
    assert_abs_diff_eq!(mirrored.total(), 1.0 / 6.0, epsilon = 1e-15);

    let refused = |bytes: &[u8]| Mesh::<3>::parse(bytes).unwrap_err();
    let with = |from: &str, to: &str| String::from_utf8(sound.clone()).unwrap().replace(from, to).into_bytes();
    assert!(matches!(refused(b"solid cube\n"), MeshError::Version { .. }));
    assert!(matches!(refused(&with("2.2 0 8", "4.0 0 8")), MeshError::Version { found } if found == "MSH 4.0"));
    assert!(matches!(refused(&with("2.2 0 8", "4.1 0 4")), MeshError::Version { .. }));
    for cut in [60, sound.len() - 20] {
        assert!(matches!(refused(&sound[..cut]), MeshError::Truncated { .. }), "{cut}");
    }
    assert!(matches!(refused(&sound[..35]), MeshError::Truncated { section: "Elements", .. }));
    assert_eq!(refused(&text(corners, "7 4 2 1 1 1 2 3 9\n")), MeshError::DanglingNode { element: 7, node: 9 });
    assert_eq!(
        refused(&text(&format!("{corners}4 2 2 2\n"), "1 4 2 1 1 1 2 3 4\n")),
        MeshError::DuplicateNode { node: 4 }
    );
    let flat = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n";
    assert!(matches!(refused(&text(flat, "1 4 2 1 1 1 2 3 4\n")), MeshError::InvertedCell { cell: 0, .. }));
    let crossed = "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 0.1 0.1 0.2\n8 0 1 1\n";
    assert!(matches!(refused(&text(crossed, "1 5 2 1 1 1 2 3 4 5 6 7 8\n")), MeshError::InvertedCell { .. }));
    assert!(matches!(refused(&text(corners, "3 7 2 1 1 1 2 3 4 1\n")), MeshError::Kind { element: 3, kind: 7 }));
    assert!(matches!(refused(&text(corners, "1 2 2 1 1 1 2 3\n")), MeshError::Dimension { .. }));
    assert!(matches!(Mesh::<2>::parse(&sound).unwrap_err(), MeshError::Dimension { .. }));
    assert!(matches!(Mesh::<2>::parse(&text(corners, "1 2 2 1 1 1 2 4\n")).unwrap_err(), MeshError::Dimension { .. }));
    assert!(matches!(refused(&with("4 0 0 1", "4 0 0 inf")), MeshError::Array { .. }));
    assert!(matches!(refused(&with("4 0 0 1", "4 0 0 x")), MeshError::Malformed { section: "Nodes", .. }));
    let missing = mesh.measure("lid").unwrap_err().to_string();
    assert_eq!(missing, "no group is named lid: the mesh has 1");
    assert!(matches!(mesh.body("rubber").unwrap_err(), MeshError::MissingGroup { what: "body", .. }));
    assert!(matches!(Mesh::<3>::read("no/such.msh").unwrap_err(), MeshError::Read { .. }));

    let points = || vec![Point::<2>::new(0.0, 0.0), Point::<2>::new(1.0, 0.0), Point::<2>::new(0.0, 1.0)];
    let triangle = [(CellShape::Triangle, vec![0, 1, 2])];
    let groups = |members: Vec<usize>| [("all".to_string(), members)];
    assert!(Mesh::new(points(), &triangle, &groups(vec![0])).is_ok());
    assert!(matches!(Mesh::new(points(), &triangle, &groups(vec![1])).unwrap_err(), MeshError::Array { .. }));
    let odd = [(CellShape::Triangle, vec![0, 1, 2, 0])];
    assert!(matches!(Mesh::new(points(), &odd, &[]).unwrap_err(), MeshError::Array { .. }));
    let beyond = [(CellShape::Triangle, vec![0, 1, 3])];
    assert_eq!(Mesh::new(points(), &beyond, &[]).unwrap_err(), MeshError::DanglingNode { element: 0, node: 3 });
    let both = [(CellShape::Triangle, vec![0, 1, 2]), (CellShape::Line, vec![0, 1])];
    assert!(matches!(Mesh::new(points(), &both, &groups(vec![0, 1])).unwrap_err(), MeshError::Dimension { .. }));
}

/// Numbers of nodes mean nothing in another list: files that were appended to each other are no mesh, whichever is the larger.
#[test]
fn meshes_appended_to_each_other_are_refused() {
    let corners = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
    let one = text(corners, "1 4 2 1 1 1 2 3 4\n");
    let two = text(&format!("{corners}5 1 1 1\n"), "1 4 2 1 1 1 2 3 4\n2 4 2 1 1 5 3 2 4\n");
    let plug = [file("plug_41_ascii.msh"), file("plug_41_binary.msh")];
    assert!(Mesh::<3>::parse(&one).is_ok() && Mesh::<3>::parse(&two).is_ok());
    for (first, second) in [(&one, &two), (&two, &one), (&plug[0], &plug[0]), (&plug[1], &plug[1])] {
        let both = [first.as_slice(), b"\n", second].concat();
        let error = Mesh::<3>::parse(&both).unwrap_err();
        assert!(matches!(&error, MeshError::Array { what, .. } if what.contains("two lists of nodes")), "{error}");
    }
    let again = String::from_utf8(one.clone()).unwrap();
    let elements = &again[again.find("$Elements").unwrap()..];
    let error = Mesh::<3>::parse(format!("{again}{elements}").as_bytes()).unwrap_err();
    assert!(error.to_string().contains("two lists of elements"), "{error}");
}

/// A block of n³ nodes and the hexahedra between them as MSH 4.1.
fn block(n: usize, binary: bool) -> Vec<u8> {
    let node = |i: usize, j: usize, k: usize| 1 + i + n * (j + n * k);
    let (nodes, cells) = (n * n * n, (n - 1).pow(3));
    let mut out = format!("$MeshFormat\n4.1 {} 8\n", u8::from(binary)).into_bytes();
    let places = (0..nodes).map(|t| [t % n, (t / n) % n, t / (n * n)]);
    let corners = |[i, j, k]: [usize; 3]| {
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
            .map(|(a, b, c)| node(i + a, j + b, k + c))
    };
    let m = n - 1;
    let cell_places = (0..cells).map(|t| [t % m, (t / m) % m, t / (m * m)]);
    if binary {
        let ints = |out: &mut Vec<u8>, v: &[i32]| v.iter().for_each(|v| out.extend(v.to_le_bytes()));
        let sizes = |out: &mut Vec<u8>, v: &[usize]| v.iter().for_each(|v| out.extend((*v as u64).to_le_bytes()));
        ints(&mut out, &[1]);
        out.extend(b"\n$EndMeshFormat\n$Nodes\n");
        sizes(&mut out, &[1, nodes, 1, nodes]);
        ints(&mut out, &[3, 1, 0]);
        sizes(&mut out, &[nodes]);
        sizes(&mut out, &(1..=nodes).collect::<Vec<_>>());
        for place in places {
            place.iter().for_each(|i| out.extend((*i as f64 / 7.0).to_le_bytes()));
        }
        out.extend(b"\n$EndNodes\n$Elements\n");
        sizes(&mut out, &[1, cells, 1, cells]);
        ints(&mut out, &[3, 1, 5]);
        sizes(&mut out, &[cells]);
        for (cell, place) in cell_places.enumerate() {
            sizes(&mut out, &[cell + 1]);
            sizes(&mut out, &corners(place));
        }
        out.extend(b"\n$EndElements\n");
    } else {
        let mut text = String::from("$EndMeshFormat\n$Nodes\n");
        let _ = write!(text, "1 {nodes} 1 {nodes}\n3 1 0 {nodes}\n");
        (1..=nodes).for_each(|tag| writeln!(text, "{tag}").unwrap());
        places
            .for_each(|[i, j, k]| writeln!(text, "{} {} {}", i as f64 / 7.0, j as f64 / 7.0, k as f64 / 7.0).unwrap());
        let _ = write!(text, "$EndNodes\n$Elements\n1 {cells} 1 {cells}\n3 1 5 {cells}\n");
        for (cell, place) in cell_places.enumerate() {
            let [a, b, c, d, e, f, g, h] = corners(place);
            writeln!(text, "{} {a} {b} {c} {d} {e} {f} {g} {h}", cell + 1).unwrap();
        }
        text.push_str("$EndElements\n");
        out.extend(text.into_bytes());
    }
    out
}

#[test]
fn a_block_is_read_whole() {
    for binary in [false, true] {
        let mesh = Mesh::<3>::parse(&block(8, binary)).unwrap();
        assert_eq!((mesh.points().len(), mesh.cell_count()), (512, 343));
        assert_abs_diff_eq!(mesh.total(), 1.0, epsilon = 1e-12);
    }
}

/// `cargo test --release --test parts -- --ignored --nocapture a_million`
#[test]
#[ignore = "a million nodes: for releases"]
fn a_million_nodes_are_read_in_two_seconds() {
    for binary in [false, true] {
        let bytes = block(100, binary);
        let start = Instant::now();
        let (peak, mesh) = super::peak(|| Mesh::<3>::parse(&bytes).unwrap());
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "1e6 nodes, binary {binary}: {seconds:.2} s, file {} MB, {:.1} times that held",
            bytes.len() / 1_000_000,
            peak as f64 / bytes.len() as f64
        );
        assert_eq!(mesh.points().len(), 1_000_000);
        assert!(seconds <= 2.0);
    }
}
