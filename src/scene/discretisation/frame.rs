//! The frame of a rigid body: an affine one of $D + 1$ nodes, and the rows that tie parts to it.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::SMatrix;

use crate::boundary::{ConstraintEquation, Constraints, Prescription};
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::Point;
use crate::mesh::Mesh;
use crate::term::Amplitude;

use super::conditions::singles;
use crate::scene::Condition;

/// A rigid body of a problem: an affine frame of $D + 1$ nodes that keeps its shape.
#[derive(Debug, Clone)]
pub(crate) struct Frame<const D: usize> {
    pub name: String,
    /// Its first node.
    pub first: usize,
    pub numbers: Vec<u32>,
    pub centre: Point<D>,
    pub size: f64,
    /// The term that keeps its shape; none of revolution, where conditions do.
    pub rigidity: Option<usize>,
    /// The volumes of a mesh that it stands for, to be drawn.
    pub shapes: Vec<Arc<Mesh<D>>>,
}

impl<const D: usize> Frame<D> {
    /// The frame of rows that tie a face to it, around their middle; rows count the nodes among all.
    pub(crate) fn around(
        name: &str,
        first: usize,
        equations: &[&ConstraintEquation],
        positions: &[Point<D>],
    ) -> Result<Self, Error> {
        let (mut total, mut moment) = (0.0, Point::<D>::zeros());
        for equation in equations.iter().filter(|equation| equation.dependent % D == 0) {
            for &(k, c) in equation.entries.iter().filter(|entry| entry.0 % D == 0) {
                total += c;
                moment += positions[k / D] * c;
            }
        }
        if !(total != 0.0) {
            let what = format!("rigid body {name}, all of whose parts other conditions prescribe,");
            return Err(BoundaryError::Incomplete { what }.into());
        }
        let centre = moment / total;
        let mut size = f64::MIN_POSITIVE;
        for equation in equations {
            for entry in &equation.entries {
                size = size.max((positions[entry.0 / D] - centre).norm());
            }
        }
        let numbers = (first as u32..=(first + D) as u32).collect();
        Ok(Frame { name: name.to_string(), first, numbers, centre, size, rigidity: None, shapes: Vec::new() })
    }

    pub(crate) fn positions(&self) -> impl Iterator<Item = Point<D>> + '_ {
        let corner = |k: usize| Point::<D>::from_fn(|i, _| if i + 1 == k { self.size } else { 0.0 });
        (0..=D).map(move |k| self.centre + corner(k))
    }

    pub(crate) fn nodes(&self) -> Range<usize> {
        self.first..self.first + D + 1
    }

    /// The values of the frame's functions at a point.
    pub(crate) fn values(&self, at: &Point<D>) -> [f64; 4] {
        let local = (at - self.centre) / self.size;
        std::array::from_fn(|k| match k {
            0 => 1.0 - local.sum(),
            k if k <= D => local[k - 1],
            _ => 0.0,
        })
    }

    /// What rows that weigh displacements of a body have to take off, so that they weigh the difference from the frame's.
    /// Functions of bodies reproduce linear fields: their coefficients and positions tell the sums of the frame's.
    pub(crate) fn counterpart(&self, equation: &ConstraintEquation, positions: &[Point<D>]) -> Vec<(usize, f64)> {
        let mut sums = [[0.0; 3]; 4];
        for &(k, c) in &equation.entries {
            let values = self.values(&positions[k / D]);
            sums.iter_mut().zip(values).for_each(|(sum, value)| sum[k % D] -= c * value);
        }
        self.entries(0.0, |k, i| sums[k][i])
    }

    /// Entries over its unknowns, by node and axis, that are more than rounding.
    fn entries(&self, rounding: f64, value: impl Fn(usize, usize) -> f64) -> Vec<(usize, f64)> {
        let all = (0..=D).flat_map(|k| (0..D).map(move |i| (k, i)));
        let entry = |(k, i)| ((self.first + k) * D + i, value(k, i));
        // A number that is none is kept, and refused with its equation.
        all.map(entry).filter(|entry| !(entry.1.abs() <= rounding)).collect()
    }

    /// $F - 1$ of the frame.
    pub(crate) fn gradient(&self, displacement: &[f64]) -> SMatrix<f64, D, D> {
        let d = |k: usize, i: usize| displacement[(self.first + k) * D + i];
        SMatrix::from_fn(|i, j| (d(j + 1, i) - d(0, i)) / self.size)
    }

    /// $\partial F_{mJ}/\partial d_{km}$: how a node of the frame changes $F$ along an axis.
    pub(crate) fn slope(&self, node: usize, axis: usize) -> f64 {
        match node {
            0 => -1.0 / self.size,
            _ if node == axis + 1 => 1.0 / self.size,
            _ => 0.0,
        }
    }

    pub(crate) fn displacement(&self, at: &Point<D>, displacement: &[f64]) -> Point<D> {
        let values = self.values(at);
        Point::from_fn(|i, _| (0..=D).map(|k| values[k] * displacement[(self.first + k) * D + i]).sum())
    }

    /// Adds the rows that leave a rigid body of revolution its motion along the axis alone.
    pub(crate) fn guide(&self, equations: &mut Constraints) -> Result<(), Error> {
        let label = format!("rigid body {}", self.name);
        for node in self.nodes() {
            for i in 0..D {
                let own = node * D + i;
                let entries = match (i, node == self.first) {
                    (0, _) => vec![(own, 1.0)],
                    (_, true) => continue,
                    _ => vec![(self.first * D + i, -1.0), (own, 1.0)],
                };
                let (amplitude, label) = (Amplitude::Ramp, label.clone());
                equations.push(ConstraintEquation { entries, dependent: own, target: 0.0, amplitude, label })?;
            }
        }
        Ok(())
    }

    /// Adds the rows of a condition on the body: at a point of it, or at all its nodes; in bodies of revolution along the axis
    /// alone.
    pub(crate) fn prescribe(
        &self,
        equations: &mut Constraints,
        condition: &Condition<D>,
        point: Option<Point<D>>,
        revolved: bool,
    ) -> Result<(), Error> {
        let at: Vec<Point<D>> = match point {
            Some(at) => vec![at],
            None if revolved => vec![self.centre],
            None => self.positions().collect(),
        };
        for single in singles(condition, &condition.place) {
            if revolved && single.axis() == Some(0) {
                if single.value.at(&self.centre, 1.0) != 0.0 {
                    let remedy = "prescribe no radial displacement but zero: a rigid ring keeps its radius";
                    return Err(
                        Incompatible::new(single.label().to_string(), "an axisymmetric rigid body", remedy).into()
                    );
                }
                continue;
            }
            equations.add_break_points(single.break_points());
            for x in &at {
                let unit = single.along(x, &Point::zeros())?;
                let (target, amplitude) = single.value(vec![(*x, 1.0)]);
                let label = single.label().to_string();
                let values = self.values(x);
                let entries = self.entries(1e-14, |k, i| values[k] * unit[i]);
                let largest = entries.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                let dependent = largest.map_or(self.first * D, |entry| entry.0);
                equations.push(ConstraintEquation { entries, dependent, target, amplitude, label })?;
            }
        }
        Ok(())
    }
}
