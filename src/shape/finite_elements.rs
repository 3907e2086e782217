//! Lagrange finite elements on lattices: the second implementer of [`Approximation`], to compare with.

use crate::cells::BoundaryCells;
use crate::cells::{Lattice, Locator, Zones, area_vector, determinant, interpolated, lagrange, ravel, unravel};
use crate::each::{Each, EachOf, array_of, point_of};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Bounds, Part, Point, Side};
use crate::quadrature::{LineRule, Points, check_point_count, gauss_legendre, in_pieces, shared};
use crate::tensor::small_inverse;

use super::{Approximation, Scratch, ShapeFunctions};

/// How far the box around an element reaches beyond its nodes, in parts of their extent.
const MARGIN: f64 = 0.25;

/// How far beyond an element its functions go on, in parts of it: as far as points count as inside the cells.
const BEYOND: f64 = 0.1;

/// The same in rounding: points on the boundary are inside.
const ROUNDING: f64 = 1e-9;

/// Parts of an edge between its ends and its middle node: at a quarter the map of the edge is singular in an end.
const QUARTER: f64 = 0.26;

/// Lagrange elements on a lattice of nodes: order 1 (2-node lines, 4-node quadrilaterals, 8-node
/// bricks) or order 2 (3, 9, 27 nodes), isoparametric.
///
/// Points of tables lie inside elements: one on an edge between elements has two gradients.
/// With one pressure per element they are Q1/P0, with linear pressures Q2/P1.
#[derive(Debug, Clone, PartialEq)]
pub struct FiniteElements<const D: usize> {
    lattice: Lattice<D>,
    order: usize,
    elements: [usize; D],
    locator: Locator<D>,
}

/// Points that know their element.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ElementPoints<const D: usize> {
    /// Positions, weights, normals; one group per element or element face.
    pub points: Points<D>,
    /// Element of each point.
    pub elements: Vec<usize>,
    /// Coordinates of each point in the unit cube of its element.
    pub local: Vec<Point<D>>,
}

impl<const D: usize> ElementPoints<D> {
    /// The points where a predicate of their position holds.
    pub(crate) fn retained(self, holds: impl Fn(&Point<D>) -> bool) -> Self {
        let ElementPoints { points, elements, local } = self;
        ElementPoints::of(points.chosen(&|k: usize, points: &Points<D>| holds(&points.positions[k])), &elements, &local)
    }

    /// Points with their numbers among those of elements and local coordinates.
    fn of((points, numbers): (Points<D>, Vec<usize>), elements: &[usize], local: &[Point<D>]) -> Self {
        let elements = numbers.mapped(|&k| elements[k]);
        let local = numbers.mapped(|&k| local[k]);
        ElementPoints { points, elements, local }
    }

    /// Share `part` of `parts`: a run of the groups, as [`Points::share`] has it.
    pub(crate) fn share(&self, part: usize, parts: usize) -> Self {
        let range = self.points.share_range(part, parts);
        ElementPoints {
            points: self.points.share(part, parts),
            elements: shared(&self.elements, &range),
            local: shared(&self.local, &range),
        }
    }
}

impl<const D: usize> FiniteElements<D> {
    /// Elements of order 1 or 2 on a lattice of nodes.
    ///
    /// # Errors
    /// For other orders, and where the cells along an axis are no multiple of the order.
    pub fn new(lattice: Lattice<D>, order: usize) -> Result<Self, GeometryError> {
        ensure!(
            order == 1 || order == 2,
            GeometryError::Count { what: "order of finite elements", count: order, needed: "1 or 2 are built" }
        );
        let cells = lattice.cell_counts();
        if let Some(&count) = cells.iter().find(|&&c| c % order != 0) {
            return Err(GeometryError::Count {
                what: "lattice cells along an axis",
                count,
                needed: "an even number is needed for elements of order 2",
            });
        }
        let elements = cells.each(|c| c / order);
        let elements = FiniteElements { lattice, order, elements, locator: Locator::default() };
        match elements.misplaced_middle() {
            Some(at) => Err(GeometryError::Shape {
                what: "a middle node of an element of order 2 lies near a quarter of its edge or beyond, where its map is singular",
                at: at.as_slice().to_vec(),
                remedy: "put the nodes of elements first and their middle nodes halfway between",
            }),
            None => Ok(elements),
        }
    }

    /// A middle node, along a line of the lattice, that leaves the middle part of its edge.
    fn misplaced_middle(&self) -> Option<Point<D>> {
        if self.order == 1 {
            return None;
        }
        let (positions, counts) = (self.lattice.positions(), self.lattice.counts());
        let wrong = |node: usize| {
            let index = unravel(node, &counts);
            (0..D).filter(|&axis| index[axis] % 2 == 1).any(|axis| {
                let end = |step: usize| {
                    let mut index = index;
                    index[axis] = index[axis] - 1 + step;
                    positions[self.lattice.node(index)]
                };
                let (edge, part) = (end(2) - end(0), positions[node] - end(0));
                let along = part.dot(&edge) / edge.norm_squared();
                !(along > QUARTER && along < 1.0 - QUARTER)
            })
        };
        (0..positions.len()).find(|&node| wrong(node)).map(|node| positions[node])
    }

    /// Number of elements.
    pub(crate) fn element_count(&self) -> usize {
        self.elements.iter().product()
    }

    /// Gauss points, `n` per direction in each element, one group per zone of elements.
    ///
    /// # Errors
    /// For an impossible number of points, an inverted element, or zones of other elements.
    pub(crate) fn gauss_in(&self, n: usize, zones: &Zones) -> Result<ElementPoints<D>, GeometryError> {
        let (abscissae, weights) = gauss_legendre(n)?;
        check_point_count(self.element_count(), n.pow(D as u32))?;
        let (mut elements, mut all, mut inverted) = (Vec::new(), Vec::new(), None);
        let points = zones.points(self.element_count(), |element, points| {
            for point in 0..n.pow(D as u32) {
                let index = unravel(point, &[n; D]);
                let local = point_of::<D>(|i| abscissae[index[i]]);
                let (position, columns) = self.map(element, &local);
                let measure = determinant(&columns);
                if !(measure > 0.0 && measure.is_finite()) {
                    inverted.get_or_insert(GeometryError::InvertedCell { cell: element, measure });
                }
                points.push(position, measure * index.iter().map(|&i| weights[i]).product::<f64>());
                elements.push(element);
                all.push(local);
            }
        })?;
        inverted.map_or(Ok(ElementPoints { points, elements, local: all }), Err)
    }

    /// Gauss points on the element faces of a boundary part, one group per face, outward normals.
    ///
    /// # Errors
    /// Where the part does not exist or the number of points is impossible.
    pub(crate) fn boundary(&self, part: &Part, n: usize) -> Result<ElementPoints<D>, GeometryError> {
        self.faces_by(part, &gauss_legendre(n)?, 1)
    }

    /// The same faces, those whose middle a predicate holds for, with linear trace functions of the nodes: `n` points per direction on
    /// each piece of a face between nodes.
    ///
    /// # Errors
    /// As [`boundary`](FiniteElements::boundary).
    pub(crate) fn contact_boundary(
        &self,
        part: &Part,
        n: usize,
        holds: &dyn Fn(&Point<D>) -> bool,
    ) -> Result<(BoundaryCells<D>, ElementPoints<D>), GeometryError> {
        // A group for each piece: what touches is made of faces with linear trace functions.
        let all = self.faces_by(part, &in_pieces(&gauss_legendre(n)?, self.order), self.order)?;
        let found = ElementPoints::of(all.points.in_groups(&|_, middle| holds(middle)), &all.elements, &all.local);
        let traces = found.elements.paired(&found.local, |&element, local| {
            let mut traces = Vec::new();
            for (k, node) in self.element_nodes(element).enumerate() {
                let (place, mut value) = (unravel(k, &[self.order + 1; D]), 1.0);
                for i in 0..D {
                    value *= (1.0 - (local[i] * self.order as f64 - place[i] as f64).abs()).max(0.0);
                }
                if value > 0.0 {
                    traces.push((node as u32, value));
                }
            }
            traces
        });
        Ok((BoundaryCells { points: found.points.clone(), traces }, found))
    }

    fn faces_by(
        &self,
        part: &Part,
        (abscissae, weights): &LineRule,
        pieces: usize,
    ) -> Result<ElementPoints<D>, GeometryError> {
        let n = abscissae.len() / pieces;
        let mut out = ElementPoints { points: Points::empty(), elements: Vec::new(), local: Vec::new() };
        for (axis, side) in self.lattice.faces(part)? {
            let end = f64::from(side == Side::Max);
            for element in 0..self.element_count() {
                let index = unravel(element, &self.elements);
                let wanted = if side == Side::Max { self.elements[axis] - 1 } else { 0 };
                if index[axis] != wanted {
                    continue;
                }
                let along = |count: usize| -> [usize; D] { array_of(|i| if i == axis { 1 } else { count }) };
                let (shape, all) = (along(n), along(pieces));
                let each: usize = shape.iter().product();
                for number in 0..each * all.iter().product::<usize>() {
                    let (piece, point) = (unravel(number / each, &all), unravel(number % each, &shape));
                    let at: [usize; D] = array_of(|i| piece[i] * n + point[i]);
                    let local = point_of::<D>(|i| if i == axis { end } else { abscissae[at[i]] });
                    let weight: f64 = (0..D).filter(|&i| i != axis).map(|i| weights[at[i]]).product();
                    let (position, columns) = self.map(element, &local);
                    let area = area_vector(axis, &columns) * (weight * (2.0 * end - 1.0));
                    let size = area.norm();
                    out.points.push(position, size);
                    out.points.normals.push(area / size);
                    out.elements.push(element);
                    out.local.push(local);
                    if (number + 1) % each == 0 {
                        out.points.close_group();
                    }
                }
            }
        }
        Ok(out)
    }

    /// The nodes of an element, axis 0 running fastest.
    fn element_nodes(&self, element: usize) -> impl Iterator<Item = usize> + '_ {
        let base = unravel(element, &self.elements);
        let shape = [self.order + 1; D];
        (0..shape.iter().product::<usize>()).map(move |k| {
            let offset = unravel(k, &shape);
            ravel(&array_of(|i| base[i] * self.order + offset[i]), &self.lattice.counts())
        })
    }

    /// A box around an element, wider than that of its nodes: curved sides bulge.
    fn around(&self, element: usize) -> Bounds<D> {
        Bounds::of(self.element_nodes(element).map(|node| &self.lattice.positions()[node])).grown(MARGIN)
    }

    /// Position and derivative columns of the isoparametric map.
    fn map(&self, element: usize, local: &Point<D>) -> (Point<D>, [Point<D>; D]) {
        interpolated(self.order, self.element_nodes(element).map(|node| self.lattice.positions()[node]), local)
    }

    /// Writes the functions of an element.
    pub(crate) fn write(&self, element: usize, local: &Point<D>, out: &mut ShapeFunctions<D>) {
        let (_, columns) = self.map(element, local);
        let jacobian = nalgebra::SMatrix::<f64, D, D>::from_columns(&columns);
        // Inverted elements were refused with the rule; a singular corner of a degenerate one gives zeros.
        let inverse = small_inverse(&jacobian).unwrap_or_else(nalgebra::SMatrix::zeros);
        out.nodes.clear();
        out.values.clear();
        out.gradients.clear();
        for (k, node) in self.element_nodes(element).enumerate() {
            let (value, slopes) = lagrange(self.order, k, local);
            out.nodes.push(node as u32);
            out.values.push(value);
            out.gradients.push(inverse.tr_mul(&slopes));
        }
        out.rcond = 1.0;
    }
}

impl<const D: usize> Approximation<D> for FiniteElements<D> {
    fn nodes(&self) -> &[Point<D>] {
        self.lattice.positions()
    }

    fn evaluate_at_node(
        &self,
        node: usize,
        _: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        ensure!(node < self.nodes().len(), super::no_node(node));
        out.nodes.clear();
        out.nodes.push(node as u32);
        out.values.clear();
        out.values.push(1.0);
        out.rcond = 1.0;
        Ok(())
    }

    /// The element that holds the point is searched for; on an edge between elements the first one counts. Beyond all elements, but not by
    /// more than a tenth of one, the functions of the nearest go on: elements follow a curved boundary only to their order.
    fn evaluate(&self, at: &Point<D>, _: &mut Scratch, out: &mut ShapeFunctions<D>) -> Result<(), ApproximationError> {
        ensure!(at.iter().all(|x| x.is_finite()), ApproximationError::Point { at: at.as_slice().to_vec() });
        let mut candidates = Vec::new();
        self.locator.any(
            self.elements.iter().product(),
            at,
            |element| self.around(element),
            |element| {
                candidates.push(element);
                false
            },
        );
        candidates.sort_unstable();
        let mut nearest: Option<(f64, usize, Point<D>)> = None;
        for element in candidates {
            let Bounds { low, high } = self.around(element);
            let mut local = Point::<D>::repeat(0.5);
            let mut miss = f64::INFINITY;
            for _ in 0..30 {
                let (x, columns) = self.map(element, &local);
                miss = (at - x).norm();
                let step = small_inverse(&nalgebra::SMatrix::<f64, D, D>::from_columns(&columns))
                    .unwrap_or_else(nalgebra::SMatrix::zeros)
                    * (at - x);
                local += step;
                if step.norm() < 1e-14 {
                    break;
                }
            }
            // The map of a distorted element may lead Newton astray: only a point that maps back counts.
            if !(miss <= 1e-9 / (1.0 + 2.0 * MARGIN) * (high - low).norm()) {
                continue;
            }
            let beyond = local.iter().map(|t| (-t).max(t - 1.0)).fold(0.0, f64::max);
            if beyond <= ROUNDING {
                self.write(element, &local, out);
                return Ok(());
            }
            if nearest.is_none_or(|(least, ..)| beyond < least) {
                nearest = Some((beyond, element, local));
            }
        }
        match nearest {
            Some((beyond, element, local)) if beyond <= BEYOND => {
                self.write(element, &local, out);
                Ok(())
            }
            _ => Err(ApproximationError::Outside { at: at.as_slice().to_vec() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Layout;
    use crate::geometry::Vec2;
    use crate::geometry::{Block, Mapped};
    use approx::assert_abs_diff_eq;

    #[test]
    fn elements_reproduce_their_polynomials() {
        let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 5]).unwrap();
        for order in [1, 2] {
            let elements = FiniteElements::new(lattice.clone(), order).unwrap();
            let psi = elements.shape_functions(&Vec2::new(0.77, 0.31)).unwrap();
            let field = |x: &Vec2| if order == 1 { x[0] * x[1] } else { x[0] * x[0] * x[1] };
            let value: f64 =
                psi.nodes.iter().zip(&psi.values).map(|(&n, v)| v * field(&elements.nodes()[n as usize])).sum();
            assert_abs_diff_eq!(value, field(&Vec2::new(0.77, 0.31)), epsilon = 1e-14);
            let slope: f64 =
                psi.nodes.iter().zip(&psi.gradients).map(|(&n, g)| g[0] * field(&elements.nodes()[n as usize])).sum();
            let exact = if order == 1 { 0.31 } else { 2.0 * 0.77 * 0.31 };
            assert_abs_diff_eq!(slope, exact, epsilon = 1e-13);
            assert!(elements.shape_functions(&Vec2::new(2.5, 0.3)).is_err());
        }
    }

    /// Points of a circle that the chords or parabolas of elements leave outside move as the polynomials of the nearest element say.
    #[test]
    fn elements_go_on_to_the_curve_that_they_follow() {
        let ring = Mapped(|unit: &Vec2| {
            let (radius, angle) = (1.0 + unit[0], std::f64::consts::FRAC_PI_2 * unit[1]);
            Vec2::new(radius * angle.cos(), radius * angle.sin())
        });
        for order in [1, 2] {
            let lattice = Lattice::new(&ring, [5, 9], &Layout::Regular).unwrap();
            let elements = FiniteElements::new(lattice, order).unwrap();
            let (mut psi, mut beyond) = (ShapeFunctions::default(), 0);
            for k in 0..=40 {
                let angle = std::f64::consts::FRAC_PI_2 * k as f64 / 40.0;
                let at = Vec2::new(2.0 * angle.cos(), 2.0 * angle.sin());
                elements.evaluate(&at, &mut Scratch::default(), &mut psi).unwrap();
                // Linear fields are reproduced there as anywhere.
                let sum = psi.nodes.iter().zip(&psi.values).map(|(&n, v)| elements.nodes()[n as usize] * *v);
                assert_abs_diff_eq!(sum.sum::<Vec2>(), at, epsilon = 1e-9);
                beyond += usize::from(psi.values.iter().any(|v| *v < -1e-6));
            }
            assert!(beyond > 5, "{beyond}");
            assert!(elements.evaluate(&Vec2::new(2.1, 0.1), &mut Scratch::default(), &mut psi).is_err());
        }
    }
}
