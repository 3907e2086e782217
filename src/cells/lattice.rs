//! Lattices of particles and the cells between them.

use nalgebra::SMatrix;

use crate::each::{Each, EachOf, array_of, list_of, point_of};
use crate::error::{GeometryError, Invalid};
use crate::geometry::{Domain, Point, check_dimension};
use crate::parallel::map_ranges;
use crate::quadrature::check_parts;

use super::Layout;
use super::brick::{Shape, area_vector, determinant, multilinear, ravel, unravel};
use super::locator::Locator;
use super::zones::block_starts;

/// A lattice of nodes, axis 0 running fastest, and the cells between neighbouring nodes.
///
/// Cells are intervals, straight-edged quadrilaterals and bricks with bilinear faces. Where the boundary of the domain is
/// curved all edges are parabolas and faces biquadratic, through the images of the middles of cells, sides and edges: the
/// cells then fill the body up to the fourth order of the spacing, where chords leave the second.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice<const D: usize> {
    pub(super) counts: [usize; D],
    pub(super) positions: Vec<Point<D>>,
    /// Unit vectors along the lines of the lattice at each node, in columns; none where they run along the axes.
    pub(super) lines: Vec<SMatrix<f64, D, D>>,
    /// Nodes and middles of curved cells, $2n - 1$ along an axis of $n$ nodes; none where cells are straight.
    middles: Vec<Point<D>>,
    pub(super) locator: Locator<D>,
}

/// Nodes beyond which a lattice is refused, so that a mistyped count is an error and not a crash.
const NODE_LIMIT: usize = 20_000_000;

/// How far a boundary is off its straight cells, as a part of a cell, to be called curved: far above rounding, far below
/// what matters.
const BENT: f64 = 1e-9;

/// Cells, facets or zones of lattices that one thread makes.
pub(super) const SERIAL_BELOW: usize = 400;

/// Angles below which a lattice runs along the axes: above rounding, below what matters.
pub(super) const ASKEW: f64 = 1e-9;

impl<const D: usize> Lattice<D> {
    /// A lattice over a domain with `counts` nodes along each axis of the unit cube.
    ///
    /// # Errors
    /// For a degenerate domain, fewer than two nodes along an axis, a jitter outside $[0, 0.5)$, a
    /// grading that does not rise from 0 to 1, or cells turned inside out.
    pub fn new(domain: &(impl Domain<D> + ?Sized), counts: [usize; D], layout: &Layout) -> Result<Self, GeometryError> {
        check_dimension::<D>()?;
        domain.validate()?;
        if let Some(&count) = counts.iter().find(|count| **count < 2) {
            return Err(GeometryError::Count { what: "nodes along an axis", count, needed: "at least 2 are needed" });
        }
        let total = node_count(&counts)?;
        if let Layout::Jittered { amount, .. } = layout
            && !(*amount >= 0.0 && *amount < 0.5)
        {
            return Err(Invalid::new("jitter", *amount, "give 0 up to, not including, 0.5").into());
        }
        let mut random = match layout {
            Layout::Jittered { seed, .. } => fastrand::Rng::with_seed(*seed),
            _ => fastrand::Rng::with_seed(0),
        };
        let (mut units, mut even) = (Vec::with_capacity(total), Vec::new());
        for node in 0..total {
            let index = unravel(node, &counts);
            let mut unit = point_of::<D>(|i| index[i] as f64 / (counts[i] - 1) as f64);
            match layout {
                Layout::Regular => {}
                Layout::Graded(grade) => {
                    for i in 0..D {
                        let t = unit[i];
                        let graded = grade(i, t);
                        let end_moved = (t == 0.0 || t == 1.0) && (graded - t).abs() > 1e-12;
                        ensure!(
                            !end_moved && graded.is_finite(),
                            Invalid::new(
                                "graded coordinate",
                                graded,
                                "a grading maps 0 to 0 and 1 to 1 and rises in between",
                            )
                        );
                        unit[i] = if t == 0.0 || t == 1.0 { t } else { graded };
                    }
                }
                Layout::Jittered { amount, .. } => {
                    even.push(unit);
                    let inner = (0..D).all(|i| index[i] > 0 && index[i] + 1 < counts[i]);
                    for i in 0..D {
                        // Drawn for all nodes, so that a node's move does not depend on the others' kind.
                        let draw = 2.0 * random.f64() - 1.0;
                        if inner {
                            unit[i] += amount * draw / (counts[i] - 1) as f64;
                        }
                    }
                }
            }
            units.push(unit);
        }
        let positions = units.mapped(|unit| domain.position(unit));
        let mut lattice = Lattice::straight(counts, positions);
        lattice.validate()?;
        lattice.lines = match layout {
            // Directions are those of the even lattice: a jittered block is a block.
            Layout::Jittered { .. } => {
                Lattice::straight(counts, even.mapped(|unit| domain.position(unit))).measured_lines()
            }
            _ => lattice.measured_lines(),
        };
        lattice.bend(domain, &units);
        if lattice.is_curved() && lattice.validate().is_err() {
            // Parabolas fold where the boundary of the domain has a kink: straight edges take their place.
            lattice.middles.clear();
        }
        Ok(lattice)
    }

    /// A lattice of given node positions, axis 0 running fastest.
    ///
    /// # Errors
    /// Where the number of positions is not the product of the counts, or a cell is inverted.
    pub fn from_positions(counts: [usize; D], positions: Vec<Point<D>>) -> Result<Self, GeometryError> {
        check_dimension::<D>()?;
        let total = product(&counts);
        if counts.iter().any(|&c| c < 2) || total != positions.len() {
            return Err(GeometryError::Count {
                what: "lattice positions",
                count: positions.len(),
                needed: "the product of the counts (each at least 2) is needed",
            });
        }
        let mut lattice = Lattice::straight(counts, positions);
        lattice.validate()?;
        lattice.lines = lattice.measured_lines();
        Ok(lattice)
    }

    /// A lattice of straight cells along the axes.
    fn straight(counts: [usize; D], positions: Vec<Point<D>>) -> Self {
        Lattice { counts, positions, lines: Vec::new(), middles: Vec::new(), locator: Locator::default() }
    }

    /// The mean directions in which neighbours stand, node by node; none where all are along the axes.
    fn measured_lines(&self) -> Vec<SMatrix<f64, D, D>> {
        let lines = |node: usize| {
            let mut columns = [Point::<D>::zeros(); D];
            self.neighbours(node, &mut |axis, up, direction| {
                columns[axis] += direction.normalize() * if up { 1.0 } else { -1.0 };
            });
            SMatrix::from_columns(&columns.each(|sum| sum.normalize()))
        };
        let all = list_of(self.positions.len(), lines);
        if all.iter().all(along_axes) { Vec::new() } else { all }
    }

    /// Gives the cells the middles of a domain whose boundary is curved; `units` are the nodes in the unit cube.
    fn bend(&mut self, domain: &(impl Domain<D> + ?Sized), units: &[Point<D>]) {
        if D == 1 {
            return;
        }
        let middle = |cell: usize, at: &Point<D>| {
            let corners = self.corner_nodes(cell).each(|node| units[node]);
            domain.position(&multilinear(&corners, at).0)
        };
        let curved = |cell: usize, axis: usize, end: f64| {
            let corners = self.corners(cell);
            (0..3usize.pow(D as u32 - 1)).any(|place| {
                let mut place = unravel(place, &[3; D]).into_iter();
                let at = point_of::<D>(|i| if i == axis { end } else { 0.5 * place.next().unwrap_or(0) as f64 });
                let (straight, columns) = multilinear(&corners, &at);
                let area = area_vector(axis, &columns);
                let away = (middle(cell, &at) - straight).dot(&area.normalize());
                away.abs() > BENT * area.norm().powf(1.0 / (D as f64 - 1.0))
            })
        };
        let cells = self.cell_counts();
        let bent = (0..self.cell_count()).any(|cell| {
            let index = unravel(cell, &cells);
            (0..D).any(|axis| {
                index[axis] == 0 && curved(cell, axis, 0.0) || index[axis] + 1 == cells[axis] && curved(cell, axis, 1.0)
            })
        });
        if bent {
            self.middles = self.subdivided(2, middle);
        }
    }

    /// Nodes of the lattice with each cell cut into `parts` per direction: `position(cell, local)` of each.
    fn subdivided(&self, parts: usize, position: impl Fn(usize, &Point<D>) -> Point<D>) -> Vec<Point<D>> {
        let counts = self.counts.each(|c| (c - 1) * parts + 1);
        let of = |node| {
            let index = unravel(node, &counts);
            let cell: [usize; D] = array_of(|i| (index[i] / parts).min(self.counts[i] - 2));
            let at = point_of::<D>(|i| (index[i] - cell[i] * parts) as f64 / parts as f64);
            position(ravel(&cell, &self.cell_counts()), &at)
        };
        list_of(counts.iter().product(), of)
    }

    /// Whether cells are curved.
    pub(super) fn is_curved(&self) -> bool {
        !self.middles.is_empty()
    }

    /// The shape of a cell.
    pub(super) fn shape(&self, cell: usize) -> Shape<D> {
        if self.is_curved() { Shape::Curved(self.nodes(cell)) } else { Shape::Straight(self.corners(cell)) }
    }

    /// The $3^D$ nodes of a curved cell, axis 0 running fastest (unused entries are zero).
    fn nodes(&self, cell: usize) -> [Point<D>; 27] {
        let base = unravel(cell, &self.cell_counts());
        let counts = self.counts.each(|c| 2 * c - 1);
        let mut nodes = [Point::zeros(); 27];
        for (node, x) in nodes.iter_mut().enumerate().take(3usize.pow(D as u32)) {
            let place = unravel(node, &[3; D]);
            *x = self.middles[ravel(&array_of(|i| 2 * base[i] + place[i]), &counts)];
        }
        nodes
    }

    /// Hands out the axis, whether it is the next one along it, and the way to each neighbour of a node.
    pub(super) fn neighbours(&self, node: usize, with: &mut dyn FnMut(usize, bool, Point<D>)) {
        let index = unravel(node, &self.counts);
        for axis in 0..D {
            for up in [false, true] {
                let mut other = index;
                other[axis] = if up { index[axis] + 1 } else { index[axis].wrapping_sub(1) };
                if other[axis] < self.counts[axis] {
                    with(axis, up, self.positions[self.node(other)] - self.positions[node]);
                }
            }
        }
    }

    fn validate(&self) -> Result<(), GeometryError> {
        let each: usize = if self.is_curved() { 3 } else { 2 };
        let runs = map_ranges(self.cell_count(), SERIAL_BELOW, |cells| {
            for cell in cells {
                // The Jacobian at the corners decides for intervals and quadrilaterals, and nearly so for bricks; that of curved
                // cells is evaluated at their middles too.
                let shape = self.shape(cell);
                for place in 0..each.pow(D as u32) {
                    let place = unravel(place, &[each; D]);
                    let (_, columns) = shape.map(&point_of::<D>(|i| place[i] as f64 / (each - 1) as f64));
                    let measure = determinant(&columns);
                    ensure!(measure > 0.0 && measure.is_finite(), GeometryError::InvertedCell { cell, measure });
                }
            }
            Ok(())
        });
        runs.into_iter().collect()
    }

    /// Nodes along each axis.
    pub fn counts(&self) -> [usize; D] {
        self.counts
    }

    /// Node positions \[length\], axis 0 running fastest.
    pub fn positions(&self) -> &[Point<D>] {
        &self.positions
    }

    /// Cells along each axis.
    pub(crate) fn cell_counts(&self) -> [usize; D] {
        self.counts.each(|c| c - 1)
    }

    /// Number of cells.
    pub(crate) fn cell_count(&self) -> usize {
        self.cell_counts().iter().product()
    }

    /// The node at a multi-index; the number of all nodes, which is that of none, where there is no such node.
    pub fn node(&self, index: [usize; D]) -> usize {
        let inside = index.iter().zip(&self.counts).all(|(i, count)| i < count);
        if inside { ravel(&index, &self.counts) } else { self.positions.len() }
    }

    /// The indices of all nodes, the first one fastest.
    pub(crate) fn indices(&self) -> impl Iterator<Item = [usize; D]> {
        let counts = self.counts;
        (0..counts.iter().product()).map(move |node| unravel(node, &counts))
    }

    /// Whether its lines run along the axes, so that no two of its faces look at each other from outside.
    pub(crate) fn runs_along_axes(&self) -> bool {
        self.lines.is_empty()
    }

    /// The $2^D$ corners of a cell, axis 0 running fastest (unused entries are zero).
    pub(crate) fn corner_nodes(&self, cell: usize) -> [usize; 8] {
        let base = unravel(cell, &self.cell_counts());
        let mut corners = [0; 8];
        for (corner, node) in corners.iter_mut().enumerate().take(1 << D) {
            *node = self.node(array_of(|i| base[i] + ((corner >> i) & 1)));
        }
        corners
    }

    pub(super) fn corners(&self, cell: usize) -> [Point<D>; 8] {
        self.corner_nodes(cell).each(|node| self.positions[node])
    }

    /// The lattice with each cell cut into `parts` per direction, new nodes by multilinear interpolation.
    ///
    /// # Errors
    /// For no part, or where the lattice would grow too large.
    pub fn refined(&self, parts: usize) -> Result<Lattice<D>, GeometryError> {
        check_parts(parts)?;
        let counts = self.counts.each(|c| (c - 1).saturating_mul(parts).saturating_add(1));
        node_count(&counts)?;
        let at = |cell: usize, local: &Point<D>| self.shape(cell).map(local).0;
        let positions = self.subdivided(parts, at);
        let middles = if self.is_curved() { self.subdivided(2 * parts, at) } else { Vec::new() };
        let mut lattice = Lattice { middles, ..Lattice::straight(counts, positions) };
        if !self.lines.is_empty() {
            lattice.lines = lattice.measured_lines();
        }
        Ok(lattice)
    }

    /// The lattice that keeps every `parts`-th node along each axis; left-over cells join the last one.
    pub fn coarsened(&self, parts: usize) -> Lattice<D> {
        let starts: [Vec<usize>; D] = std::array::from_fn(|i| block_starts(self.counts[i] - 1, parts.max(1)));
        let counts: [usize; D] = std::array::from_fn(|i| starts[i].len());
        let total: usize = counts.iter().product();
        let kept: Vec<usize> = list_of(total, |node| {
            let index = unravel(node, &counts);
            self.node(array_of(|i| starts[i][index[i]]))
        });
        let lines = if self.lines.is_empty() { Vec::new() } else { kept.mapped(|&k| self.lines[k]) };
        Lattice { lines, ..Lattice::straight(counts, kept.mapped(|&k| self.positions[k])) }
    }
}

fn product(counts: &[usize]) -> usize {
    counts.iter().fold(1, |product, &count| product.saturating_mul(count))
}

/// The number of nodes; refuses too many.
fn node_count(counts: &[usize]) -> Result<usize, GeometryError> {
    let (count, needed) = (product(counts), "at most 2e7 are accepted");
    ensure!(count <= NODE_LIMIT, GeometryError::Count { what: "nodes of a lattice", count, needed });
    Ok(count)
}

/// Whether unit vectors are those of the axes, in any order: boxes along them are boxes along the axes.
pub(super) fn along_axes<const D: usize>(lines: &SMatrix<f64, D, D>) -> bool {
    lines.iter().all(|entry| entry.abs() < ASKEW || entry.abs() > 1.0 - ASKEW)
}
