//! The frame of a rigid body: an affine one of a node more than there are dimensions, and the rows that tie parts to it.

use std::ops::Range;

use crate::boundary::{ConstraintEquation, Constraints, PrescribedDirection, follows, rounding};
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::{Mat3, Point, Vec3, padded};
use crate::term::Amplitude;

use super::conditions::singles;
use crate::scene::Condition;

/// A rigid body of a problem: an affine frame that keeps its shape.
#[derive(Debug, Clone)]
pub(crate) struct RigidFrame {
    pub name: String,
    pub dim: usize,
    /// Its nodes, one after the other.
    pub numbers: Vec<u32>,
    pub centre: Vec3,
    pub size: f64,
    /// The term that keeps its shape; none of revolution, where conditions do.
    pub rigidity: Option<usize>,
    /// What the multipliers of that term are measured in.
    pub unit: f64,
    /// The volumes of a mesh that it stands for, to be drawn.
    pub shapes: Vec<RigidShape>,
    /// What is prescribed of it: directions of its displacement and of the slopes of that along each axis.
    prescribed: Vec<PrescribedDirection<12>>,
}

/// A volume of a mesh that is rigid, as it is drawn.
#[derive(Debug, Clone)]
pub(crate) struct RigidShape {
    pub points: Vec<Vec3>,
    /// Corners in the order of [`Cells::corners`](crate::cells::Cells::corners).
    pub cells: Vec<Vec<usize>>,
}

impl RigidFrame {
    /// The frame of rows that tie a face to it, around a centre; rows count the nodes among all, behind which its own stand.
    pub(crate) fn around(
        name: &str,
        dim: usize,
        centre: Vec3,
        equations: &[&ConstraintEquation],
        positions: &[Vec3],
    ) -> Result<Self, Error> {
        ensure!(
            !equations.is_empty(),
            BoundaryError::Incomplete {
                what: format!("rigid body {name}, all of whose parts other conditions prescribe,")
            }
        );
        let mut size = f64::MIN_POSITIVE;
        for equation in equations {
            for entry in &equation.entries {
                size = size.max((positions[entry.0 / dim] - centre).norm());
            }
        }
        let first = positions.len() as u32;
        let numbers = (first..=first + dim as u32).collect();
        Ok(RigidFrame {
            name: name.to_string(),
            dim,
            numbers,
            centre,
            size,
            rigidity: None,
            unit: 1.0,
            shapes: Vec::new(),
            prescribed: Vec::new(),
        })
    }

    pub(crate) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let corner = |k: usize| Vec3::from_fn(|i, _| if i + 1 == k { self.size } else { 0.0 });
        (0..=self.dim).map(move |k| self.centre + corner(k))
    }

    fn first(&self) -> usize {
        self.numbers[0] as usize
    }

    pub(crate) fn nodes(&self) -> Range<usize> {
        self.first()..self.first() + self.numbers.len()
    }

    /// Its unknowns among all.
    pub(crate) fn unknowns(&self) -> Range<usize> {
        self.first() * self.dim..self.nodes().end * self.dim
    }

    /// The values of the frame's functions at a point.
    pub(crate) fn values(&self, at: &Vec3) -> [f64; 4] {
        let local = (at - self.centre) / self.size;
        std::array::from_fn(|k| if k == 0 { 1.0 - local.sum() } else { local[k - 1] })
    }

    /// What rows that weigh displacements of a body have to take off, so that they weigh the difference from the frame's.
    /// Functions of bodies reproduce linear fields: their coefficients and positions tell the sums of the frame's.
    pub(crate) fn counterpart(&self, equation: &ConstraintEquation, positions: &[Vec3]) -> Vec<(usize, f64)> {
        let mut sums = [[0.0; 3]; 4];
        for &(k, c) in &equation.entries {
            let values = self.values(&positions[k / self.dim]);
            sums.iter_mut().zip(values).for_each(|(sum, value)| sum[k % self.dim] -= c * value);
        }
        self.entries(0.0, |k, i| sums[k][i])
    }

    /// Entries over its unknowns, by node and axis, that are more than rounding.
    fn entries(&self, rounding: f64, value: impl Fn(usize, usize) -> f64) -> Vec<(usize, f64)> {
        let entry = |(own, unknown)| (unknown, value(own / self.dim, own % self.dim));
        // A number that is none is kept, and refused with its equation.
        self.unknowns().enumerate().map(entry).filter(|entry| !(entry.1.abs() <= rounding)).collect()
    }

    /// $F - 1$ of the frame.
    pub(crate) fn gradient(&self, displacement: &[f64]) -> Mat3 {
        let own = &displacement[self.unknowns()];
        Mat3::from_fn(|i, j| match i.max(j) < self.dim {
            true => (own[(j + 1) * self.dim + i] - own[i]) / self.size,
            false => 0.0,
        })
    }

    /// $\partial F_{mJ}/\partial d_{km}$: how a node of the frame changes $F$ along an axis.
    pub(crate) fn slope(&self, node: usize, axis: usize) -> f64 {
        match node {
            0 => -1.0 / self.size,
            _ if node == axis + 1 => 1.0 / self.size,
            _ => 0.0,
        }
    }

    pub(crate) fn displacement(&self, at: &Vec3, displacement: &[f64]) -> Vec3 {
        let mut u = Vec3::zeros();
        for (d, value) in displacement[self.unknowns()].chunks_exact(self.dim).zip(self.values(at)) {
            u.iter_mut().zip(d).for_each(|(u, d)| *u += value * d);
        }
        u
    }

    /// The displacement of its middle, and its rotation.
    pub(crate) fn motion(&self, displacement: &[f64]) -> (Vec3, Mat3) {
        (self.displacement(&self.centre, displacement), Mat3::identity() + self.gradient(displacement))
    }

    /// Adds the rows that leave a rigid body of revolution its motion along the axis alone.
    pub(crate) fn guide(&mut self, equations: &mut Constraints) -> Result<(), Error> {
        let (label, first) = (format!("rigid body {}", self.name), self.unknowns().start);
        for own in self.unknowns() {
            let entries = match (own - first) % self.dim {
                0 => vec![(own, 1.0)],
                i if own == first + i => continue,
                i => vec![(first + i, -1.0), (own, 1.0)],
            };
            let (node, axis) = ((own - first) / self.dim, (own - first) % self.dim);
            let direction = std::array::from_fn(|k| f64::from(u8::from(k == 3 * node + axis)));
            self.prescribed.push(PrescribedDirection::new(direction, &label, 0.0, Amplitude::Ramp));
            let (amplitude, label) = (Amplitude::Ramp, label.clone());
            equations.push(ConstraintEquation { entries, dependent: own, target: 0.0, amplitude, label })?;
        }
        Ok(())
    }

    /// Adds the rows of a condition on the body: at a point of it, or at all its nodes; in bodies of revolution along the axis
    /// alone.
    pub(crate) fn prescribe<const D: usize>(
        &mut self,
        equations: &mut Constraints,
        condition: &Condition<D>,
        point: Option<Vec3>,
        revolved: bool,
    ) -> Result<(), Error> {
        let at: Vec<Vec3> = match point {
            Some(at) => vec![at],
            None if revolved => vec![self.centre],
            None => self.positions().collect(),
        };
        for single in singles(condition, &condition.place) {
            if revolved && single.what.axis == Some(0) {
                ensure!(
                    single.value.at(&padded(&self.centre), 1.0) == 0.0,
                    Incompatible::new(
                        single.what.label,
                        "an axisymmetric rigid body",
                        "prescribe no radial displacement but zero: a rigid ring keeps its radius"
                    )
                );
                continue;
            }
            equations.add_break_points(single.break_points());
            for x in &at {
                let what = &single.what;
                let unit = (what.along)(x, &Point::zeros())?;
                self.prescribe_at(equations, (x, &unit), (what.value)(vec![(*x, 1.0)]), &what.label)?;
            }
        }
        Ok(())
    }

    /// Adds the row of what is prescribed at a point of the body along a direction, unless it follows from what is prescribed already: a
    /// few points tell how an affine frame moves.
    ///
    /// # Errors
    /// Where another value follows.
    pub(crate) fn prescribe_at(
        &mut self,
        equations: &mut Constraints,
        (at, unit): (&Vec3, &Vec3),
        (target, amplitude): (f64, Amplitude),
        label: &str,
    ) -> Result<(), Error> {
        let local = (at - self.centre) / self.size;
        let direction = std::array::from_fn(|k| unit[k % 3] * if k < 3 { 1.0 } else { local[k / 3 - 1] });
        let requested = PrescribedDirection::new(direction, label, target, amplitude.clone());
        if follows(&self.prescribed, &requested, &at.as_slice()[..self.dim], rounding(&[*at, self.centre]))? {
            return Ok(());
        }
        self.prescribed.push(requested);
        let values = self.values(at);
        let entries = self.entries(1e-14, |k, i| values[k] * unit[i]);
        let largest = entries.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (dependent, label) = (largest.map_or(self.unknowns().start, |entry| entry.0), label.to_string());
        equations.push(ConstraintEquation { entries, dependent, target, amplitude, label })?;
        Ok(())
    }
}
