//! Smoothed sub-cells and boundary cells, sharing their facet points.

use std::ops::Range;

use crate::each::{Each, EachOf, array_of, list_of, point_of};
use crate::error::GeometryError;
use crate::geometry::{Part, Point, Side};
use crate::order;
use crate::parallel::map_ranges;
use crate::quadrature::{LineRule, Points, check_parts, check_point_count, gauss_legendre};

use super::brick::{Shape, area_vector, determinant, ravel, unravel};
use super::lattice::SERIAL_BELOW;
use super::pieces::smooth_pieces;
use super::{BoundaryCells, Lattice, Zones};

/// What rounding may leave of $\oint n\\,\mathrm dA$ over a sub-cell, as a part of its surface: coordinates far from
/// the origin have few digits for a small cell, and a facet that lacks is far larger.
const GAP: f64 = 1e-6;

/// Sub-cells over which gradients are averaged, $\langle\Psi_{,j}\rangle = \frac1V\oint\Psi\\,n_j\\,\mathrm dA$,
/// with the facets between neighbours stored once.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothing<const D: usize> {
    /// Points on all facets.
    pub facet_points: Vec<Point<D>>,
    /// $n\\,\mathrm dA$ at each facet point, in the direction in which the facet is stored.
    pub facet_areas: Vec<Point<D>>,
    /// Offsets of the points of each facet: they rise from 0 to the number of facet points.
    pub facet_offsets: Vec<usize>,
    /// Facets of each sub-cell with the sign that turns the stored direction outward.
    pub cells: Vec<Vec<(u32, f64)>>,
    /// Interior points of each sub-cell and their weights, exact to degree 2; for hoop strains and gradients that vary.
    pub interior: Vec<Vec<(Point<D>, f64)>>,
    /// Centres of the sub-cells.
    pub centres: Vec<Point<D>>,
    /// Offsets of the groups of sub-cells that share a pressure.
    pub groups: Vec<usize>,
}

impl<const D: usize> Smoothing<D> {
    /// Some of the sub-cells with their facets, each in a group of its own.
    pub(crate) fn of(&self, cells: &[usize]) -> Self {
        let mut some = Smoothing {
            cells: cells.mapped(|&cell| self.cells[cell].clone()),
            interior: cells.mapped(|&cell| self.interior[cell].clone()),
            centres: cells.mapped(|&cell| self.centres[cell]),
            groups: (0..=cells.len()).collect(),
            facet_points: Vec::new(),
            facet_areas: Vec::new(),
            facet_offsets: vec![0],
        };
        some.take_facets(self);
        some
    }

    /// Number of facets.
    pub(crate) fn facet_count(&self) -> usize {
        self.facet_offsets.len().saturating_sub(1)
    }

    /// The places of the points of a facet; none for a facet that does not exist.
    pub(crate) fn facet(&self, facet: usize) -> Range<usize> {
        match self.facet_offsets.get(facet..facet.saturating_add(2)) {
            Some(&[first, end]) => first..end,
            _ => 0..0,
        }
    }

    /// Offsets of facets with the same number of points each.
    pub(super) fn even_offsets(facets: usize, points: usize) -> Vec<usize> {
        list_of(facets + 1, |facet| facet * points)
    }

    /// Without sub-cells and facets.
    pub(super) fn empty() -> Self {
        Smoothing {
            facet_points: Vec::new(),
            facet_areas: Vec::new(),
            facet_offsets: vec![0],
            cells: Vec::new(),
            interior: Vec::new(),
            centres: Vec::new(),
            groups: vec![0],
        }
    }

    /// The same without facets that no sub-cell has: those of cells that other ranks hold.
    pub(crate) fn pruned(mut self) -> Self {
        let all = Smoothing {
            facet_points: std::mem::take(&mut self.facet_points),
            facet_areas: std::mem::take(&mut self.facet_areas),
            facet_offsets: std::mem::replace(&mut self.facet_offsets, vec![0]),
            ..Smoothing::empty()
        };
        self.take_facets(&all);
        self
    }

    /// Takes what its sub-cells name of facets, and numbers them anew.
    fn take_facets(&mut self, all: &Self) {
        let mut number = std::collections::HashMap::new();
        for (facet, _) in self.cells.iter_mut().flatten() {
            let own = all.facet(*facet as usize);
            let (Some(at), Some(areas)) = (all.facet_points.get(own.clone()), all.facet_areas.get(own)) else {
                continue;
            };
            *facet = *number.entry(*facet).or_insert_with(|| {
                self.facet_points.extend_from_slice(at);
                self.facet_areas.extend_from_slice(areas);
                self.facet_offsets.push(self.facet_points.len());
                self.facet_offsets.len() as u32 - 2
            });
        }
    }

    /// Refuses sub-cells whose arrays do not fit together, and ones that are not closed: $\oint n\\,\mathrm dA = 0$.
    ///
    /// # Errors
    /// [`GeometryError::Count`] with the array that is too long or too short, or names what does not exist;
    /// [`GeometryError::Shape`] for facets that leave a gap.
    pub fn validate(&self) -> Result<(), GeometryError> {
        let wrong = |what, count, needed| Err(GeometryError::Count { what, count, needed });
        let (points, cells) = (self.facet_points.len(), self.cells.len());
        let rise = |offsets: &[usize], least: usize, end| {
            let rise = offsets.windows(2).all(|w| w[1].checked_sub(w[0]).is_some_and(|own| own >= least));
            rise && offsets.first() == Some(&0) && offsets.last() == Some(&end)
        };
        if !rise(&self.facet_offsets, 1, points) {
            return wrong("facet points", points, "offsets of facets rise from 0 to the number of facet points");
        }
        if self.facet_areas.len() != points {
            return wrong("facet areas", self.facet_areas.len(), "give one for each facet point");
        }
        let facets = self.facet_count();
        if let Some(&(facet, _)) = self.cells.iter().flatten().find(|f| f.0 as usize >= facets) {
            return wrong("facet of a sub-cell", facet as usize, "name facets that exist, counted from 0");
        }
        for (what, count) in [("interior rules", self.interior.len()), ("centres of sub-cells", self.centres.len())] {
            if count != cells {
                return wrong(what, count, "give one for each sub-cell");
            }
        }
        if !rise(&self.groups, 0, cells) {
            return wrong("groups of sub-cells", self.groups.len(), "offsets rise from 0 to the number of sub-cells");
        }
        self.check_closure()
    }

    /// Refuses sub-cells whose facets leave a gap: constant fields would have gradients.
    fn check_closure(&self) -> Result<(), GeometryError> {
        for (facets, centre) in self.cells.iter().zip(&self.centres) {
            let (mut sum, mut size) = (Point::<D>::zeros(), 0.0);
            for &(facet, sign) in facets {
                for area in &self.facet_areas[self.facet(facet as usize)] {
                    sum += area * sign;
                    size += area.norm();
                }
            }
            // The negation also refuses NaN.
            ensure!(
                sum.norm() <= GAP * size,
                GeometryError::Shape {
                    what: "the facets of a sub-cell do not close it",
                    at: centre.as_slice().to_vec(),
                    remedy: "name all of them, with the signs that turn them outward: their n dA sum to nothing",
                }
            );
        }
        Ok(())
    }

    /// Coordinate measures of the sub-cells \[length^d\], $V = \frac1D\oint x\cdot n\\,\mathrm dA$; NaN for facets
    /// that do not exist.
    pub fn volumes(&self) -> Vec<f64> {
        let volume = |facets: &Vec<(u32, f64)>| {
            // Measured from a point of the sub-cell: about a distant origin the fluxes are large and cancel.
            let first = facets.first().map_or(0..0, |f| self.facet(f.0 as usize)).start;
            let origin = self.facet_points.get(first).copied().unwrap_or_else(Point::zeros);
            let flux = |&(facet, sign): &(u32, f64)| -> f64 {
                let points = self.facet(facet as usize);
                if points.is_empty() {
                    return f64::NAN;
                }
                match (self.facet_points.get(points.clone()), self.facet_areas.get(points)) {
                    (Some(at), Some(areas)) => at.pair_sum(areas, |x, area| sign * (x - origin).dot(area)),
                    _ => f64::NAN,
                }
            };
            facets.summed(flux) / D as f64
        };
        self.cells.mapped(volume)
    }

    /// One point for each sub-cell at the given positions, weighted by the sub-cell's measure.
    pub fn nodal(&self, positions: &[Point<D>]) -> Points<D> {
        Points {
            positions: positions.to_vec(),
            weights: self.volumes(),
            normals: Vec::new(),
            groups: (0..=self.cells.len()).collect(),
        }
    }

    /// Sub-cells of one owner joined, in the order of owners, each in a group of its own; facets inside the unions
    /// drop out. `owners` has one entry per sub-cell, `centres` one point per owner.
    pub(crate) fn merged(mut self, owners: &[u32], centres: &[Point<D>]) -> Self {
        let mut cells: Vec<Vec<(u32, f64)>> = vec![Vec::new(); centres.len()];
        let mut interior: Vec<Vec<(Point<D>, f64)>> = vec![Vec::new(); centres.len()];
        for ((facets, points), &owner) in self.cells.iter().zip(&self.interior).zip(owners) {
            cells[owner as usize].extend(facets);
            interior[owner as usize].extend(points);
        }
        for facets in &mut cells {
            order::sort(facets, &|a, b| a.0.cmp(&b.0));
            // Both sides of a facet inside a union have its signs −1 and 1.
            let mut kept: Vec<(u32, f64)> = Vec::with_capacity(facets.len());
            for &(facet, sign) in facets.iter() {
                if kept.last().is_some_and(|last| last.0 == facet) {
                    kept.pop();
                } else {
                    kept.push((facet, sign));
                }
            }
            *facets = kept;
        }
        self.groups = (0..=cells.len()).collect();
        self.cells = cells;
        self.interior = interior;
        self.centres = centres.to_vec();
        self
    }
}

impl<const D: usize> Lattice<D> {
    /// `parts` sub-cells per direction in each cell, `gauss` points per direction on each facet, one
    /// more where cells are curved, grouped by zone.
    ///
    /// # Errors
    /// For an impossible number of parts or points.
    pub(crate) fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<D>, GeometryError> {
        zones.validate(self.cell_count())?;
        let fine = self.refined(parts)?;
        let gauss = on_facets(gauss, self.is_curved());
        let (abscissae, weights) = gauss_legendre(gauss)?;
        let points_per_facet = gauss.pow(D as u32 - 1);
        check_point_count(fine.positions().len().saturating_mul(D), points_per_facet)?;
        let mut facet_points = Vec::new();
        let mut facet_areas = Vec::new();
        let mut first_facet = [0usize; D];
        let mut facet_counts = [[0usize; D]; D];
        for axis in 0..D {
            first_facet[axis] = facet_points.len() / points_per_facet;
            facet_counts[axis] = fine.counts().each(|c| c - 1);
            facet_counts[axis][axis] += 1;
            let runs = map_ranges(facet_counts[axis].iter().product(), SERIAL_BELOW, |facets| {
                let mut run = Vec::with_capacity(facets.len() * points_per_facet);
                for facet in facets {
                    let mut index = unravel(facet, &facet_counts[axis]);
                    // The facet lies on the lower end of this cell, or on the upper end of the last one.
                    let upper = index[axis] == fine.counts()[axis] - 1;
                    if upper {
                        index[axis] -= 1;
                    }
                    let shape = fine.shape(ravel(&index, &fine.cell_counts()));
                    for point in 0..points_per_facet {
                        let (at, weight) = facet_point::<D>(axis, f64::from(upper), point, &abscissae, &weights);
                        let (position, columns) = shape.map(&at);
                        run.push((position, area_vector(axis, &columns) * weight));
                    }
                }
                run
            });
            for (position, area) in runs.into_iter().flatten() {
                facet_points.push(position);
                facet_areas.push(area);
            }
        }
        let facets = facet_points.len() / points_per_facet;
        let mut smoothing = Smoothing {
            facet_points,
            facet_areas,
            facet_offsets: Smoothing::<D>::even_offsets(facets, points_per_facet),
            ..Smoothing::empty()
        };
        // Exact to degree 2, and on curved cells, whose maps have a higher degree, to the hoops of linear fields. Products of coordinates have
        // a higher one on bricks whose faces are not parallel.
        let distorted = || (0..self.cell_count()).any(|cell| !self.shape(cell).is_parallelepiped());
        let inside = gauss_legendre(2 + usize::from(self.is_curved() || (D == 3 && parts == 1 && distorted())))?;
        let runs = map_ranges(zones.offsets.len() - 1, SERIAL_BELOW, |some| {
            self.zones_cut(&fine, (parts, &first_facet, &facet_counts), &inside, zones, some)
        });
        for run in runs {
            let (run, before) = (run?, smoothing.cells.len());
            smoothing.cells.extend(run.cells);
            smoothing.interior.extend(run.interior);
            smoothing.centres.extend(run.centres);
            smoothing.groups.extend(run.groups[1..].iter().map(|end| before + end));
        }
        Ok(smoothing)
    }

    /// The sub-cells of some zones, `parts` per direction in each cell, by the numbers of the facets of the finer lattice.
    fn zones_cut(
        &self,
        fine: &Lattice<D>,
        (parts, first_facet, facet_counts): (usize, &[usize; D], &[[usize; D]; D]),
        inside: &LineRule,
        zones: &Zones,
        some: Range<usize>,
    ) -> Result<Smoothing<D>, GeometryError> {
        let mut smoothing = Smoothing::empty();
        for zone in zones.each().skip(some.start).take(some.len()) {
            for &cell in zone {
                let base = unravel(cell as usize, &self.cell_counts());
                for sub in 0..parts.pow(D as u32) {
                    let offset = unravel(sub, &[parts; D]);
                    let index: [usize; D] = array_of(|i| base[i] * parts + offset[i]);
                    let mut facets = Vec::with_capacity(2 * D);
                    for axis in 0..D {
                        let lower = ravel(&index, &facet_counts[axis]);
                        let mut next = index;
                        next[axis] += 1;
                        let upper = ravel(&next, &facet_counts[axis]);
                        facets.push(((first_facet[axis] + lower) as u32, -1.0));
                        facets.push(((first_facet[axis] + upper) as u32, 1.0));
                    }
                    smoothing.cells.push(facets);
                    let shape = fine.shape(ravel(&index, &fine.cell_counts()));
                    smoothing.centres.push(shape.map(&Point::repeat(0.5)).0);
                    // In space averages need no interior points; whole cells have them for gradients that vary in them.
                    let interior = if D == 3 && parts > 1 { Vec::new() } else { interior_rule(&shape, inside) };
                    smoothing.interior.push(interior);
                }
            }
            smoothing.groups.push(smoothing.cells.len());
        }
        Ok(smoothing)
    }

    /// One cell around each particle, the union of the $2^D$ halves of its cells that touch it; in the order of
    /// particles, each in a group of its own.
    ///
    /// # Errors
    /// For an impossible number of points.
    pub(crate) fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<D>, GeometryError> {
        let zones = self.zones(1);
        let halves = self.smoothing(2, gauss, &zones)?;
        // Sub-cells run like corners: sub-cell k of a cell touches its corner k.
        let mut owners: Vec<u32> = Vec::with_capacity(zones.cells.len() << D);
        for &cell in &zones.cells {
            for &node in &self.corner_nodes(cell as usize)[..1 << D] {
                owners.push(node as u32);
            }
        }
        Ok(halves.merged(&owners, self.positions()))
    }

    /// The facets of a boundary part in smooth pieces, each cut into `parts` per direction with `gauss` points per
    /// direction, one more where cells are curved: the edge points of [`smoothing`](Lattice::smoothing) with the same numbers.
    ///
    /// # Errors
    /// Where the part does not exist or the numbers are impossible.
    pub(crate) fn boundary_pieces(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        let faces = self.faces(part)?;
        smooth_pieces(&faces, &self.faces(&Part::Whole)?, &|face| self.face(face, parts, gauss))
    }

    /// The facets of a boundary part with plain trace functions, face by face.
    ///
    /// # Errors
    /// As [`boundary_pieces`](Self::boundary_pieces).
    pub(crate) fn plain_boundary(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
    ) -> Result<BoundaryCells<D>, GeometryError> {
        let faces = self.faces(part)?.into_iter().map(|face| self.face(face, parts, gauss));
        Ok(BoundaryCells::joined(faces.collect::<Result<_, _>>()?))
    }

    /// The facets of a face with plain trace functions.
    fn face(&self, (axis, side): (usize, Side), parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        check_parts(parts)?;
        let gauss = on_facets(gauss, self.is_curved());
        let (abscissae, weights) = gauss_legendre(gauss)?;
        let per_facet = (0..D - 1).fold(1usize, |total, _| total.saturating_mul(parts).saturating_mul(gauss));
        check_point_count(self.positions().len().saturating_mul(2 * D), per_facet)?;
        let mut cells = BoundaryCells::empty();
        let end = f64::from(side == Side::Max);
        let mut shape = self.cell_counts();
        shape[axis] = 1;
        let mut sub_shape = [parts; D];
        sub_shape[axis] = 1;
        for face in 0..shape.iter().product() {
            let mut index = unravel(face, &shape);
            if side == Side::Max {
                index[axis] = self.cell_counts()[axis] - 1;
            }
            let cell = ravel(&index, &self.cell_counts());
            let (nodes, shape) = (self.corner_nodes(cell), self.shape(cell));
            for sub in 0..sub_shape.iter().product() {
                let offset = unravel(sub, &sub_shape);
                for point in 0..gauss.pow(D as u32 - 1) {
                    let (local, weight) = facet_point::<D>(axis, 0.0, point, &abscissae, &weights);
                    let along = |i: usize| (offset[i] as f64 + local[i]) / parts as f64;
                    let at = point_of::<D>(|i| if i == axis { end } else { along(i) });
                    let (position, columns) = shape.map(&at);
                    let share = weight / (parts as f64).powi(D as i32 - 1);
                    let area = area_vector(axis, &columns) * (share * (2.0 * end - 1.0));
                    let size = area.norm();
                    let traces = (0..1usize << D)
                        .filter(|corner| ((corner >> axis) & 1) as f64 == end)
                        .map(|corner| {
                            let value =
                                (0..D).map(|i| if (corner >> i) & 1 == 1 { at[i] } else { 1.0 - at[i] }).product();
                            (nodes[corner] as u32, value)
                        })
                        .collect();
                    cells.push(position, size, area / size, traces);
                }
            }
            cells.points.close_group();
        }
        Ok(cells)
    }
}

/// Points per direction on a facet: curved ones take one more, which keeps the patch test exact on parabolas.
pub(super) fn on_facets(gauss: usize, curved: bool) -> usize {
    gauss + usize::from(curved && (1..64).contains(&gauss))
}

/// Unit-cube coordinates and weight of one Gauss point on the facet normal to `axis`.
pub(super) fn facet_point<const D: usize>(
    axis: usize,
    end: f64,
    mut point: usize,
    abscissae: &[f64],
    weights: &[f64],
) -> (Point<D>, f64) {
    let mut at = Point::<D>::repeat(end);
    let mut weight = 1.0;
    for i in (0..D).filter(|&i| i != axis) {
        at[i] = abscissae[point % abscissae.len()];
        weight *= weights[point % abscissae.len()];
        point /= abscissae.len();
    }
    (at, weight)
}

/// Interior points on an interval, a quadrilateral or a brick.
pub(super) fn interior_rule<const D: usize>(shape: &Shape<D>, (abscissae, weights): &LineRule) -> Vec<(Point<D>, f64)> {
    let counts = [weights.len(); D];
    let point = |point| {
        let index = unravel(point, &counts);
        let (position, columns) = shape.map(&point_of::<D>(|i| abscissae[index[i]]));
        (position, index.iter().map(|&i| weights[i]).product::<f64>() * determinant(&columns))
    };
    list_of(counts.iter().product(), point)
}
