//! Sub-cells at the roots of slots, divided so finely that what is connected there follows the surface.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::each::{Each, EachOf, array_of};
use crate::geometry::{Bounds, Cubes, Vec3, double_area};
use crate::neighbours::{BoxTree, FACING, Flood, MARGIN};

use super::connected::{Divided, Divisions, FINER, SubCells};
use super::grid::Grid;
use super::parts::{NONE, Parts, each_triangle};
use super::sections::Sections;
use super::split::{Split, by_brick};
use crate::rows::Rows;

/// Distance below which facets that face each other are the walls of a slot, in half spacings: that between particles.
const ACROSS: f64 = 2.0;
/// Margin of the box in which sub-cells connect the walls of a slot, in half spacings.
const AROUND: f64 = 2.0 * MARGIN;

/// What coordinates of one point may differ by that are taken back from those of two divisions, in bricks.
const ROUNDING: f64 = 1e-9;

/// Facets of a sub-cell that look alike.
struct Wall {
    part: u32,
    patches: Vec<u32>,
    /// Their middle.
    at: Vec3,
    /// Their mean normal, outward.
    normal: Vec3,
    /// Half the spacing around the sub-cell.
    size: i32,
}

/// Where a triangle around a divided sub-cell comes from.
#[derive(Clone, Copy)]
enum Source {
    /// A section, and which of its triangles.
    Section(u32, u32),
    /// A patch of the surface.
    Patch(u32),
}

/// A division of a sub-cell beside a section.
struct Beside {
    number: u32,
    /// Whether the section is on its upper side.
    above: bool,
    face: Bounds<3>,
}

/// The walls of all sub-cells.
fn walls(connected: &SubCells, normals: &[Vec3]) -> Vec<Wall> {
    let (split, grid) = (&connected.split, &connected.sections.grid);
    let mut found = Vec::new();
    for (part, own) in connected.parts.parts.iter().enumerate() {
        let mut alike: BTreeMap<[i8; 3], (Vec3, Vec3, f64, Vec<u32>)> = BTreeMap::new();
        for &number in &own.patches {
            let patch = &split.patches[number as usize];
            let normal = normals[patch.facet as usize];
            let corners = split.corners(number);
            let area = double_area(&corners).norm();
            let key = array_of(|i| normal[i].round() as i8);
            let (at, along, whole, patches) = alike.entry(key).or_default();
            (*at, *along, *whole) =
                (*at + corners.iter().sum::<Vec3>() * (area / 3.0), *along + normal * area, *whole + area);
            patches.push(number);
        }
        let size = grid.half_spacing(grid.place(own.brick as usize));
        for (at, along, whole, patches) in alike.into_values().filter(|own| own.2 > 0.0) {
            found.push(Wall { part: part as u32, patches, at: at / whole, normal: along / whole, size });
        }
    }
    found
}

/// Whether the solid lies on both sides of what is between two walls.
fn face_each_other(a: &Wall, b: &Wall) -> bool {
    let between = b.at - a.at;
    a.normal.dot(&b.normal) < FACING
        && a.normal.dot(&between) > 0.0
        && b.normal.dot(&between) < 0.0
        && between.norm() < ACROSS * f64::from(a.size.max(b.size))
}

/// The patches of the surface around each of its corners.
struct Around<'a> {
    split: &'a Split,
    patches: Rows,
    /// The last search that met each patch.
    met: Vec<u32>,
    number: u32,
}

impl<'a> Around<'a> {
    fn new(split: &'a Split) -> Self {
        let patches = Rows::new(split.points.len(), &|add| {
            for (number, patch) in split.patches.iter().enumerate() {
                patch.corners.iter().for_each(|&corner| add(corner as usize, number as u32));
            }
        });
        Around { split, patches, met: vec![0; split.patches.len()], number: 0 }
    }

    /// Whether what is between two walls is deeper than it is wide, and so a slot: the surface goes from one to the other no nearer to them
    /// than they are to each other. Bores and grooves are no slots, however narrow.
    fn is_slot(&mut self, a: &Wall, b: &Wall) -> bool {
        let width = (b.at - a.at).norm();
        let near = Bounds::of([&a.at, &b.at]).widened(&Vec3::repeat(width));
        let split = self.split;
        let is_near = |patch: u32| {
            let corners = split.patches[patch as usize].corners;
            Bounds::of(corners.iter().map(|corner| &split.points[*corner as usize])).meets(&near)
        };
        self.number += 1;
        let mut open: Vec<u32> = a.patches.iter().copied().filter(|patch| is_near(*patch)).collect();
        open.iter().for_each(|&patch| self.met[patch as usize] = self.number);
        while let Some(patch) = open.pop() {
            for corner in split.patches[patch as usize].corners {
                for &other in self.patches.row(corner as usize) {
                    if self.met[other as usize] == self.number || !is_near(other) {
                        continue;
                    }
                    if b.patches.contains(&other) {
                        return false;
                    }
                    self.met[other as usize] = self.number;
                    open.push(other);
                }
            }
        }
        true
    }
}

/// Walls that face each other and that sub-cells connect near the line between them.
struct Joined {
    middle: Vec3,
    /// Distance of a slot that this is the root of, at most.
    reach: f64,
    /// A box around the line.
    within: Bounds<3>,
}

/// The sub-cells at the roots of slots: those around walls that face each other and that sub-cells connect near the line between them, and
/// no farther from a slot than what is between them is wide, and the sub-cell besides.
fn at_roots(connected: &SubCells, normals: &[Vec3]) -> BTreeSet<u32> {
    let (walls, mut flood, mut surface) = (walls(connected, normals), Flood::default(), Around::new(&connected.split));
    let (mut slots, mut joined) = (Vec::new(), Vec::new());
    let sizes: BTreeSet<i32> = walls.iter().map(|wall| wall.size).collect();
    for size in sizes {
        // Pairs the larger of whose spacings is this one, each wall with those before it.
        let mut before: Cubes<3, &Wall> = Cubes::new(f64::from(size));
        for a in walls.iter().filter(|wall| wall.size <= size) {
            for b in before.near(&a.at, ACROSS * f64::from(size)) {
                if a.size.max(b.size) < size || !face_each_other(a, b) {
                    continue;
                }
                let line = Bounds::of([&a.at, &b.at]);
                if surface.is_slot(a, b) {
                    slots.push(line);
                }
                let around = AROUND * f64::from(size);
                let within = line.widened(&Vec3::repeat(around));
                if flood.reaches(connected, &[a.part], &[b.part], &within) {
                    let reach = (b.at - a.at).norm() + f64::from(size);
                    joined.push(Joined { middle: (a.at + b.at) * 0.5, reach, within });
                }
            }
            before.add(&a.at, a);
        }
    }
    let tree = BoxTree::new(slots);
    let at_slot = |own: &&Joined| {
        let mut least = f64::INFINITY;
        tree.approach(&own.middle, |_, distance| {
            least = least.min(distance);
            least
        });
        least <= own.reach
    };
    joined.iter().filter(at_slot).flat_map(|own| connected.cut_near(&own.within)).collect()
}

/// A sub-cell divided by planes between those of bricks, its divisions numbered from one on, and where the triangles around it come from.
fn divided(connected: &SubCells, part: u32, first: u32) -> (Divided, Vec<Source>) {
    let own = &connected.parts.parts[part as usize];
    let (mut triangles, mut sources) = (Vec::new(), Vec::new());
    for &(section, sign) in &own.sections {
        let mut number = 0;
        each_triangle(&connected.sections, section, |[a, b, c]| {
            triangles.push(if sign > 0.0 { [a, b, c] } else { [a, c, b] });
            sources.push(Source::Section(section, number));
            number += 1;
        });
    }
    for &patch in &own.patches {
        triangles.push(connected.split.patches[patch as usize].corners);
        sources.push(Source::Patch(patch));
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut corners: Vec<Vec3> = Vec::new();
    for corner in triangles.iter_mut().flatten() {
        *corner = *numbers.entry(*corner).or_insert_with(|| {
            corners.push(connected.point(*corner));
            corners.len() as u32 - 1
        });
    }
    // From whole leaves on, so that planes on both sides of a section between leaves of one size are the same.
    let around = Bounds::of(&corners);
    let size = connected.sections.grid.size(connected.sections.grid.place(own.brick as usize));
    let scale = f64::from(size);
    let low: [i32; 3] = array_of(|i| (around.low[i] / scale).floor() as i32);
    let count = |i: usize| ((around.high[i] / scale).ceil() as i32 - low[i]).max(1) * FINER + 2;
    let counts = array_of(|i| count(i) as usize);
    let mut own = Divided { first, size, low: Vec3::from(low.each(|at| f64::from(at * size))), ..Divided::default() };
    let corners: Vec<Vec3> = corners.mapped(|corner| own.local(corner));
    let grid = Grid::even(counts);
    let split = Split::new(&corners, &triangles);
    let by_brick = by_brick(&split, grid.len(), |place| grid.brick(place));
    let sections = Sections::new(&split, grid);
    let parts = Parts::new(&split, &by_brick, &sections);
    own.cells = SubCells::new(split, sections, parts);
    for (number, patch) in own.cells.split.patches.iter().enumerate() {
        if let Source::Patch(patch) = sources[patch.facet as usize] {
            own.of_patch.entry(patch).or_default().push(number as u32);
        }
    }
    (own, sources)
}

/// Pairs that have a face in common, with a box around it, either way.
#[derive(Default)]
struct Pairs(BTreeMap<(u32, u32), Bounds<3>>);

impl Pairs {
    fn add(&mut self, a: u32, b: u32, face: &Bounds<3>) {
        for pair in [(a, b), (b, a)] {
            let known = self.0.entry(pair).or_insert_with(Bounds::none);
            *known = known.join(face);
        }
    }
}

/// Whether two boxes have a point in common.
fn meet(a: &Bounds<3>, b: &Bounds<3>) -> bool {
    (0..3).all(|i| a.low[i] <= b.high[i] + ROUNDING && b.low[i] <= a.high[i] + ROUNDING)
}

impl Divisions {
    /// Divides the sub-cells at the roots of slots; normals are those of facets.
    pub(super) fn new(connected: &SubCells, normals: &[Vec3]) -> Self {
        let mut all = Divisions { count: connected.parts.parts.len(), ..Divisions::default() };
        let mut sources = Vec::new();
        for part in at_roots(connected, normals) {
            let (own, from) = divided(connected, part, all.count as u32);
            all.count += own.cells.parts.parts.len();
            all.of_part.insert(part, own);
            sources.push(from);
        }
        all.connect(connected, &sources);
        all
    }

    /// Finds what lies beside divisions, and beside the sub-cells around them.
    fn connect(&mut self, connected: &SubCells, sources: &[Vec<Source>]) {
        let mut pairs = Pairs::default();
        // Divisions on both sides of a section hold the same pieces of its triangles, those of leaves of two sizes
        // pieces that overlap: by section, triangle and place, which is left out for those.
        let mut across: BTreeMap<(u32, u32, [i32; 3]), Vec<Beside>> = BTreeMap::new();
        let mut around: BTreeSet<u32> = BTreeSet::new();
        for ((&part, own), sources) in self.of_part.iter().zip(sources) {
            let signs: HashMap<u32, f64> = connected.parts.parts[part as usize].sections.iter().copied().collect();
            let inner = &own.cells;
            for number in 0..inner.parts.parts.len() as u32 {
                let mut add =
                    |other, face: &Bounds<3>| pairs.add(own.first + number, own.first + other, &own.in_lattice(face));
                inner.each_beside(number, &mut add);
            }
            for (patch, &number) in inner.split.patches.iter().zip(&inner.of_patch) {
                let Source::Section(section, triangle) = sources[patch.facet as usize] else { continue };
                let above = signs[&section] > 0.0;
                let other = connected.parts.beside[section as usize][usize::from(above)];
                if other == NONE || number == NONE {
                    continue;
                }
                let face = Bounds::of(&patch.corners.each(|corner| own.place(&inner.split.points[corner as usize])));
                let number = own.first + number;
                let Some(beside) = self.of_part.get(&other) else {
                    around.insert(other);
                    pairs.add(number, other, &face);
                    continue;
                };
                let mut place: [i32; 3] = array_of(|i| patch.brick[i] + FINER * (own.low[i] as i32 / own.size));
                if beside.size != own.size {
                    place = [0; 3];
                }
                place[usize::from(connected.sections.sections[section as usize].axis)] = 0;
                across.entry((section, triangle, place)).or_default().push(Beside { number, above, face });
            }
        }
        for both in across.into_values() {
            let below = both.iter().filter(|own| own.above);
            let pairs_across = below.flat_map(|a| both.iter().filter(|own| !own.above).map(move |b| (a, b)));
            for (a, b) in pairs_across.filter(|(a, b)| meet(&a.face, &b.face)) {
                pairs.add(a.number, b.number, &a.face.join(&b.face));
            }
        }
        for part in around {
            connected.each_beside(part, &mut |other, face| {
                if !self.of_part.contains_key(&other) {
                    let known = pairs.0.entry((part, other)).or_insert_with(Bounds::none);
                    *known = known.join(face);
                }
            });
        }
        for ((number, other), face) in pairs.0 {
            self.beside.entry(number).or_default().push((other, face));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::cells::CutLattice;
    use crate::geometry::Vec3;
    use crate::mesh::{CellShape, Mesh};
    use crate::solid::{Shape, Solid3};

    /// Sub-cells at the roots of slots.
    fn divided(solid: &Solid3, spacing: f64) -> usize {
        CutLattice::new(solid, spacing).unwrap().sub_cells.divisions.of_part.len()
    }

    /// A plate of 4 by 4 by 1 without tools whose faces lie between z = −1 and 2.
    fn plate(tools: impl Iterator<Item = Shape>) -> Solid3 {
        tools.fold(Shape::block([0.0; 3], [4.0, 4.0, 1.0]), Shape::minus).solid(0.2).unwrap()
    }

    #[test]
    fn bores_and_grooves_narrower_than_a_spacing_are_no_slots() {
        let random = &mut fastrand::Rng::with_seed(62);
        let mut bore = |k: usize| {
            let [x, y] = [k % 3, k / 3].map(|k| 0.8 + 1.2 * k as f64 + 0.2 * (random.f64() - 0.5));
            Shape::cylinder([x, y, -1.0], [x, y, 2.0], 0.15 + 0.2 * random.f64())
        };
        let bored = plate((0..9).map(&mut bore));
        let grooved = plate((0..3).map(|k| {
            let x = 0.8 + 1.1 * f64::from(k);
            Shape::block([x, -1.0, 0.8], [x + 0.3, 5.0, 2.0])
        }));
        for spacing in [0.6, 0.8, 1.0] {
            assert_eq!([divided(&bored, spacing), divided(&grooved, spacing)], [0; 2], "{spacing}");
        }
    }

    /// A plate of 4 by 4 by 1 with a slot from its upper side down.
    fn slotted(width: f64, depth: f64) -> Solid3 {
        let (left, right, root) = (1.93, 1.93 + width, 4.0 - depth);
        let outline =
            [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [right, 4.0], [right, root], [left, root], [left, 4.0], [0.0, 4.0]];
        let points = |z: f64| outline.map(|x| Vec3::new(x[0], x[1], z));
        let quads = [[0, 5, 6, 7], [1, 2, 3, 4], [0, 1, 4, 5]];
        let cells = quads.iter().flat_map(|quad| quad.iter().copied().chain(quad.iter().map(|corner| corner + 8)));
        let points = points(0.0).into_iter().chain(points(1.0)).collect();
        Solid3::of_mesh(&Mesh::new(points, &[(CellShape::Hexahedron, cells.collect())], &[]).unwrap()).unwrap()
    }

    /// Sub-cells along the root of a slot lie in one row or two on either side, in each layer through the plate: as many however deep and
    /// narrow the slot.
    #[test]
    fn slots_are_divided_at_their_roots_alone() {
        let spacing = 0.5;
        let layers = 1.0 / (0.5 * spacing) + 1.0;
        for width in [0.01, 0.05, 0.1, 0.2, 0.3] {
            for depth in [1.3, 2.0, 2.9] {
                let count = divided(&slotted(width, depth), spacing) as f64;
                println!("slot {width} wide, {depth} deep: {count} sub-cells divided");
                assert!(count >= layers - 1.0 && count <= 6.0 * layers, "{width} {depth}: {count}");
            }
        }
    }
}
