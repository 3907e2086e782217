//! Gradients averaged over sub-cells, from values on their facets.

use crate::cells::Smoothing;
use crate::error::{Error, GeometryError};
use crate::geometry::Point;
use crate::kinematics::{Kinematics, hoops, measure};
use crate::parallel::map_ranges;
use crate::shape::{Approximation, ShapeFunctions};

use super::build::{Rows, SERIAL_BELOW, rows};
use super::{Clusters, check_values, inverse_radius};

/// What differences of the measure rounding may leave, relative to it.
const ROUNDING: f64 = 1e-9;

/// Refuses measures that the averages are wrong for: the divergence theorem takes them for constant, or with hoops for
/// proportional to $R$ to their number.
struct Measured<'a, const D: usize, K: ?Sized> {
    kinematics: &'a K,
    hoops: usize,
    /// The first facet point off the axis, and the measure there.
    reference: Option<(f64, f64)>,
}

impl<'a, const D: usize, K: Kinematics<D> + ?Sized> Measured<'a, D, K> {
    fn new(kinematics: &'a K, hoops: usize, smoothing: &Smoothing<D>) -> Result<Self, GeometryError> {
        let reference = match smoothing.facet_points.iter().find(|at| hoops == 0 || at[0] > 0.0) {
            Some(at) => Some((at[0], measure(kinematics, hoops > 0, at)?)),
            None => None,
        };
        Ok(Measured { kinematics, hoops, reference })
    }

    /// The measure at a point.
    fn at(&self, at: &Point<D>) -> Result<f64, GeometryError> {
        let found = measure(self.kinematics, self.hoops > 0, at)?;
        let Some((radius, first)) = self.reference.filter(|_| self.hoops == 0 || at[0] > 0.0) else { return Ok(found) };
        let expected = if self.hoops == 0 { first } else { first * (at[0] / radius).powi(self.hoops as i32) };
        if (found - expected).abs() <= ROUNDING * found.abs().max(expected.abs()) {
            return Ok(found);
        }
        Err(GeometryError::Kinematics {
            what: "the measure of the kinematics is not constant or, with hoops, proportional to R to their number",
            at: at.as_slice().to_vec(),
            remedy: "averages over sub-cells are made for such measures alone: integrate at Gauss points (Rule::Gauss)",
        })
    }
}

/// Facets in consecutive runs, as they were integrated: joining them would copy the largest lists of all.
struct Facets<const D: usize> {
    /// First facet of each run.
    starts: Vec<usize>,
    runs: Vec<Run<D>>,
    rcond: f64,
}

/// $\int\Psi_I\\,m\\,n\\,\mathrm dA$ over each facet of a run, in the direction in which the facet is stored.
struct Run<const D: usize> {
    ends: Vec<usize>,
    nodes: Vec<u32>,
    sums: Vec<Point<D>>,
    /// $\int m\\,(x_0 - o)\\,n_0\\,\mathrm dA$: the facet's part in the measure of its cells.
    volumes: Vec<f64>,
    rcond: f64,
}

impl<const D: usize> Facets<D> {
    /// Nodes and sums of a facet, and its part in the measure of its cells.
    fn get(&self, facet: usize) -> (&[u32], &[Point<D>], f64) {
        let run = self.starts.partition_point(|&start| start <= facet) - 1;
        let (run, facet) = (&self.runs[run], facet - self.starts[run]);
        let entries = if facet == 0 { 0..run.ends[0] } else { run.ends[facet - 1]..run.ends[facet] };
        (&run.nodes[entries.clone()], &run.sums[entries], run.volumes[facet])
    }

    /// Facets are integrated once, and each serves both its neighbours.
    fn integrate<A: Approximation<D>>(
        approximation: &A,
        smoothing: &Smoothing<D>,
        measured: &Measured<'_, D, impl Kinematics<D> + ?Sized>,
    ) -> Result<Self, Error> {
        let count = smoothing.facet_points.len() / smoothing.points_per_facet.max(1);
        let dimension = (1 + measured.hoops) as f64;
        // Radii count from the axis. Other coordinates count from the body: far from the origin the parts of a small
        // cell would be large and cancel.
        let on_axis = measured.hoops > 0;
        let origin = smoothing.facet_points.first().filter(|_| !on_axis).map_or(0.0, |at| at[0]);
        let runs = map_ranges(count, SERIAL_BELOW, |range| -> Result<(usize, Run<D>), Error> {
            let mut facets = Run {
                ends: Vec::with_capacity(range.len()),
                nodes: Vec::new(),
                sums: Vec::new(),
                volumes: Vec::with_capacity(range.len()),
                rcond: 1.0,
            };
            let mut scratch = A::Scratch::default();
            let mut psi = ShapeFunctions::default();
            let mut list = List::default();
            for facet in range.clone() {
                let first = facet * smoothing.points_per_facet;
                let mut volume = 0.0;
                list.clear();
                for point in first..first + smoothing.points_per_facet {
                    let at = &smoothing.facet_points[point];
                    approximation.evaluate_values(at, &mut scratch, &mut psi)?;
                    check_values(&psi, approximation.nodes().len(), at)?;
                    facets.rcond = facets.rcond.min(psi.rcond);
                    let area = smoothing.facet_areas[point] * measured.at(at)?;
                    volume += (at[0] - origin) * area[0] / dimension;
                    list.add(Point::zeros(), &psi.nodes, |a, sum| *sum += area * psi.values[a]);
                }
                facets.nodes.extend_from_slice(&list.nodes);
                facets.sums.extend_from_slice(&list.sums);
                facets.ends.push(facets.nodes.len());
                facets.volumes.push(volume);
                if facet == range.start {
                    // As wide as the first one, and some.
                    let width = list.nodes.len() + list.nodes.len() / 8;
                    facets.nodes.reserve(width * range.len());
                    facets.sums.reserve(width * range.len());
                }
            }
            Ok((range.start, facets))
        });
        let (starts, runs): (_, Vec<Run<D>>) = runs.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let rcond = runs.iter().map(|run| run.rcond).fold(1.0, f64::min);
        Ok(Facets { starts, runs, rcond })
    }
}

/// Nodes by rising index, each with a sum.
struct List<T> {
    nodes: Vec<u32>,
    sums: Vec<T>,
    merged_nodes: Vec<u32>,
    merged_sums: Vec<T>,
}

impl<T> Default for List<T> {
    fn default() -> Self {
        List { nodes: Vec::new(), sums: Vec::new(), merged_nodes: Vec::new(), merged_sums: Vec::new() }
    }
}

impl<T: Copy> List<T> {
    fn clear(&mut self) {
        self.nodes.clear();
        self.sums.clear();
    }

    /// Adds to the sums of further nodes, also by rising index: `add(a, sum)` for the a-th of them.
    #[inline(always)]
    fn add(&mut self, zero: T, nodes: &[u32], add: impl Fn(usize, &mut T)) {
        if self.nodes.is_empty() {
            self.nodes.extend_from_slice(nodes);
            self.sums.resize(nodes.len(), zero);
        }
        // Points of a facet mostly see the same particles, and so do facets of a cell.
        if self.nodes == nodes {
            for (a, sum) in self.sums.iter_mut().enumerate() {
                add(a, sum);
            }
            return;
        }
        self.merged_nodes.clear();
        self.merged_sums.clear();
        let (mut i, mut j) = (0, 0);
        while i < self.nodes.len() && j < nodes.len() {
            let (x, y) = (self.nodes[i], nodes[j]);
            self.merged_nodes.push(x.min(y));
            self.merged_sums.push(if x <= y { self.sums[i] } else { zero });
            i += usize::from(x <= y);
            j += usize::from(y <= x);
        }
        self.merged_nodes.extend_from_slice(&self.nodes[i..]);
        self.merged_sums.extend_from_slice(&self.sums[i..]);
        self.merged_nodes.extend_from_slice(&nodes[j..]);
        self.merged_sums.resize(self.merged_nodes.len(), zero);
        std::mem::swap(&mut self.nodes, &mut self.merged_nodes);
        std::mem::swap(&mut self.sums, &mut self.merged_sums);
        let mut place = 0;
        for (a, &node) in nodes.iter().enumerate() {
            while self.nodes[place] < node {
                place += 1;
            }
            add(a, &mut self.sums[place]);
        }
    }
}

/// Rows of averaged gradients; see [`ShapeTable::smoothed`](super::ShapeTable::smoothed).
pub(super) fn smoothed<const D: usize, A: Approximation<D>>(
    approximation: &A,
    smoothing: &Smoothing<D>,
    kinematics: &(impl Kinematics<D> + ?Sized),
) -> Result<(Rows, Clusters), Error> {
    let hoops = hoops(kinematics)?;
    let slots = D + usize::from(!hoops.is_empty());
    let measured = Measured::new(kinematics, hoops.len(), smoothing)?;
    let facets = Facets::integrate(approximation, smoothing, &measured)?;
    type Scratch<S, const D: usize> = (S, ShapeFunctions<D>, List<[f64; 4]>);
    let (mut rows, clusters) = rows(
        &smoothing.groups,
        <Scratch<A::Scratch, D>>::default,
        |(scratch, psi, list), cell, rows: &mut Rows| -> Result<(), Error> {
            list.clear();
            // A measure that is the same on all facets may bulge between them.
            measured.at(&smoothing.centres[cell])?;
            // The measure of the cell from the divergence theorem along axis 0, so that V and the
            // gradients come from the same numbers.
            let mut volume = 0.0;
            for &(facet, sign) in &smoothing.cells[cell] {
                let (nodes, sums, part) = facets.get(facet as usize);
                volume += sign * part;
                list.add([0.0; 4], nodes, |a, sum| {
                    for j in 0..D {
                        sum[j] += sign * sums[a][j];
                    }
                });
            }
            if !hoops.is_empty() {
                for (at, weight) in &smoothing.interior[cell] {
                    // m/R has a limit on the axis: 2π for the measure 2πR.
                    let mut off_axis = *at;
                    if at[0] == 0.0 {
                        off_axis[0] = 1e-8 * weight.abs().sqrt();
                    }
                    let measure = measured.at(&off_axis)?;
                    let inverse = inverse_radius(off_axis[0], at.as_slice(), measure)?;
                    approximation.evaluate_values(at, scratch, psi)?;
                    check_values(psi, approximation.nodes().len(), at)?;
                    list.add([0.0; 4], &psi.nodes, |a, sum| {
                        // m,R = (number of hoops) m / R for the measures 2πR and 4πR².
                        let hoop = psi.values[a] * weight * measure * inverse;
                        sum[0] -= hoops.len() as f64 * hoop;
                        sum[D] += hoop;
                    });
                }
            }
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(GeometryError::InvertedCell { cell, measure: volume }.into());
            }
            let inverse = 1.0 / volume;
            rows.nodes.extend_from_slice(&list.nodes);
            for slot in 0..slots {
                rows.gradients.extend(list.sums.iter().map(|sum| sum[slot] * inverse));
            }
            rows.weights.push(volume);
            Ok(())
        },
    )?;
    rows.rcond = rows.rcond.min(facets.rcond);
    Ok((rows, clusters))
}
