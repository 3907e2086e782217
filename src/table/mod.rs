//! Shape tables: the only cache. Shape functions are evaluated once, because the kernel is material.

mod alike;
mod build;
mod clusters;
mod consistent;
mod elements;
mod facets;
mod functions;
mod gradient;
mod measured;
mod referred;
mod smooth;

pub use clusters::Clusters;
pub(crate) use functions::check_values;
pub(crate) use gradient::displacement_gradient;

use crate::cells::Smoothing;
use crate::each::{Each, sum_of};
use crate::error::{ApproximationError, Error, Invalid};
use crate::geometry::{Mat3, Point};
use crate::kinematics::Kinematics;
use crate::quadrature::Points;
use crate::shape::{Approximation, ElementPoints, FiniteElements, Scratch, ShapeFunctions};
use crate::simd::Plain;

use functions::check_functions;
use measured::inverse_radius;

/// Shape functions tabulated at points: nodes, values, gradients and weights in compressed rows.
///
/// At each point the gradients are stored by *slot*, the neighbours running fastest: slots
/// $0..D$ hold $\partial\Psi_I/\partial X_s$, one further slot holds $\Psi_I/R$ where the kinematics
/// has hoops.
#[derive(Debug, Clone)]
pub struct ShapeTable<const D: usize> {
    node_count: usize,
    nodes: Vec<u32>,
    values: Vec<f64>,
    slots: usize,
    gradients: Vec<f64>,
    /// First entry of each point in `values` and by slot in `gradients`: points whose surroundings are alike share them.
    starts: Vec<usize>,
    hoops: &'static [usize],
    plane_stress: bool,
    weights: Vec<f64>,
    positions: Vec<Point<D>>,
    normals: Vec<Point<D>>,
    clusters: Clusters,
    smallest_rcond: f64,
    /// Stretch at rest of what is free of stress, point by point; none where it is 1 everywhere.
    rest: Vec<f64>,
}

impl<const D: usize> ShapeTable<D> {
    /// Tabulates an approximation at points; weights get the factor of the kinematics.
    ///
    /// # Errors
    /// Where a point is not covered, a hoop is needed at $R \le 0$ with a weight, or the points of a group see more
    /// than 65 536 nodes.
    pub fn new(
        approximation: &dyn Approximation<D>,
        points: &Points<D>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        ShapeTable::tabulate(approximation.nodes().len(), points, kinematics, &|scratch, point, psi| {
            approximation.evaluate(&points.positions[point], scratch, psi)
        })
    }

    /// Tabulates whatever `evaluate(scratch, point, out)` writes of a point, given by its number, with buffers of its own; the way in
    /// for approximations that know more of a point than its position (the element it lies in).
    ///
    /// # Errors
    /// Those of `evaluate`, and where a hoop is needed at $R \le 0$ with a weight.
    pub fn tabulate(
        node_count: usize,
        points: &Points<D>,
        kinematics: &dyn Kinematics<D>,
        evaluate: &(dyn Fn(&mut Scratch, usize, &mut ShapeFunctions<D>) -> Result<(), ApproximationError> + Sync),
    ) -> Result<Self, Error> {
        points.validate()?;
        let hoops = crate::kinematics::hoop_components(kinematics)?;
        let (rows, clusters) =
            build::rows(&points.groups, &|(scratch, psi): &mut (Scratch, ShapeFunctions<D>), point, rows| {
                let at = points.positions[point];
                evaluate(scratch, point, psi)?;
                check_functions(psi, node_count, &at)?;
                let measure = crate::kinematics::measure(kinematics, !hoops.is_empty(), &at)?;
                rows.nodes.extend_from_slice(&psi.nodes);
                rows.values.extend_from_slice(&psi.values);
                for slot in 0..D {
                    rows.gradients.extend(psi.gradients.iter().map(|g| g[slot]));
                }
                if !hoops.is_empty() {
                    let inverse = inverse_radius(at[0], at.as_slice(), measure)?;
                    rows.gradients.extend(psi.values.iter().map(|v| v * inverse));
                }
                rows.weights.push(points.weights[point] * measure);
                rows.rcond = rows.rcond.min(psi.rcond);
                Ok(())
            })?;
        let total: f64 = rows.weights.iter().sum();
        // Points on the axis have the measure zero.
        ensure!(
            !(total < 0.0 || total == 0.0 && hoops.is_empty() && !rows.weights.is_empty()),
            Invalid::new(
                "sum of the weights of a table",
                total,
                "weights times the measure of the kinematics add up to more than nothing: give positive ones"
            )
        );
        let (positions, normals) = (points.positions.clone(), points.normals.clone());
        Ok(ShapeTable::of_rows(node_count, rows, clusters, kinematics, positions, normals))
    }

    /// Tabulates finite elements at points that know their element.
    ///
    /// # Errors
    /// Where a hoop is needed at $R < 0$.
    pub(crate) fn of_elements(
        elements: &FiniteElements<D>,
        points: &ElementPoints<D>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        ShapeTable::tabulate(elements.nodes().len(), &points.points, kinematics, &|_, point, psi| {
            elements.write(points.elements[point], &points.local[point], psi);
            Ok(())
        })
    }

    /// As [`of_elements`](Self::of_elements) for kinematics without hoops; points that are alike share a row.
    pub(crate) fn of_alike_elements(
        elements: &FiniteElements<D>,
        points: &ElementPoints<D>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        let (rows, clusters) = elements::shared(elements, points, kinematics)?;
        let (positions, normals) = (points.points.positions.clone(), points.points.normals.clone());
        Ok(ShapeTable::of_rows(elements.nodes().len(), rows, clusters, kinematics, positions, normals))
    }

    /// Tabulates gradients averaged over sub-cells,
    /// $$\langle\Psi_{,j}\rangle = \frac1V\Big(\oint\Psi\\,m\\,n_j\\,\mathrm dA - \int\Psi\\,m_{,j}\\,\mathrm dV\Big),\quad
    ///   \langle\Psi/R\rangle = \frac1V\int\frac{\Psi}{R}\\,m\\,\mathrm dV,\quad V = \int m\\,\mathrm dV,$$
    /// with the measure $m$ of the kinematics: a constant, or with hoops one proportional to $R$ to their number
    /// ($2\pi R$, $4\pi R^2$). Values are not stored: loads have tables of their own.
    ///
    /// # Errors
    /// Where a facet point is not covered, a sub-cell is inverted, or it reaches over the axis, and for other measures:
    /// a thickness that varies is integrated at Gauss points.
    pub fn smoothed(
        approximation: &dyn Approximation<D>,
        smoothing: &Smoothing<D>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        smoothing.validate()?;
        let (rows, clusters) = smooth::smoothed(approximation, smoothing, kinematics)?;
        let (node_count, positions) = (approximation.nodes().len(), smoothing.centres.clone());
        Ok(ShapeTable::of_rows(node_count, rows, clusters, kinematics, positions, Vec::new()))
    }

    /// Tabulates gradients that are linear in each sub-cell and consistent with its boundary, for approximations of order 2
    /// and above: at its interior points $p$, with $q = (1, X - X_c)$ from its centre,
    /// $$\widetilde{\Psi_{,j}}(X_p) = q(X_p)\cdot M^{-1}\Big(\oint\Psi\\,q\\,m\\,n_j\\,\mathrm dA -
    ///   \sum_r w_r\\,\Psi\\,(m\\,q)_{,j}\Big),\quad
    ///   \widetilde{\Psi/R}(X_p) = q(X_p)\cdot M^{-1}\sum_r w_r\frac{\Psi}{R}\\,m\\,q,\quad M = \sum_r w_r\\,m\\,q\\,q^T,$$
    /// with the measure $m$ as in [`smoothed`](Self::smoothed) and sums over the interior points $r$ and their weights.
    ///
    /// Stresses that are linear in a sub-cell do the right work on all shape functions, whatever the error of the facets'
    /// rule, and quadratic fields have their exact gradients where the interior points integrate their moments (degree 2,
    /// in bodies of revolution 3). Averages are the same with $q = 1$ alone and have the second order, whatever the basis.
    /// In the plane one sub-cell for each cell sees all deformations. In space, where a linear gradient in a brick leaves
    /// three of them unseen, each sub-cell with eight interior points or more has $q = (1, x, y, z, xy, yz, zx, xyz)$.
    /// Values are not stored: loads have tables of their own. Conditions of this kind: J. S. Chen, M. Hillman and
    /// M. Rüter, *Int. J. Numer. Meth. Engng* 95 (2013) 387–418; Q. Duan, X. Li, H. Zhang and T. Belytschko, *ibid.* 92
    /// (2012) 399–424.
    ///
    /// # Errors
    /// As [`smoothed`](Self::smoothed), and where a sub-cell has too few interior points to tell linear fields apart.
    pub fn consistent(
        approximation: &dyn Approximation<D>,
        smoothing: &Smoothing<D>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        smoothing.validate()?;
        let (rows, clusters, positions) = match D {
            1 => consistent::consistent::<D, 2>(approximation, smoothing, kinematics)?,
            2 => consistent::consistent::<D, 3>(approximation, smoothing, kinematics)?,
            // Eight points of a brick tell products apart; with four, gradients are linear and leave three modes unseen.
            // What a sub-cell takes follows from its own points, whichever comes first and whichever are of other ranks.
            _ if smoothing.interior.iter().any(|points| points.len() >= 8) => {
                consistent::consistent::<D, 8>(approximation, smoothing, kinematics)?
            }
            _ => consistent::consistent::<D, 4>(approximation, smoothing, kinematics)?,
        };
        let node_count = approximation.nodes().len();
        Ok(ShapeTable::of_rows(node_count, rows, clusters, kinematics, positions, Vec::new()))
    }

    fn of_rows(
        node_count: usize,
        rows: build::Rows,
        clusters: Clusters,
        kinematics: &dyn Kinematics<D>,
        positions: Vec<Point<D>>,
        normals: Vec<Point<D>>,
    ) -> Self {
        let hoops = kinematics.hoop_components();
        ShapeTable {
            rest: Vec::new(),
            node_count,
            nodes: rows.nodes,
            values: rows.values,
            slots: D + usize::from(!hoops.is_empty()),
            gradients: rows.gradients,
            starts: rows.starts,
            hoops,
            plane_stress: kinematics.is_plane_stress(),
            weights: rows.weights,
            positions,
            normals,
            clusters,
            smallest_rcond: rows.rcond,
        }
    }

    /// The table of a body whose nodes stand `first` behind the first of `node_count` in all.
    pub(crate) fn shifted(mut self, first: usize, node_count: usize) -> Self {
        self.nodes.iter_mut().for_each(|node| *node += first as u32);
        self.clusters.shift(first as u32);
        self.node_count = node_count;
        self
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.weights.len()
    }

    /// Number of nodes of the approximation.
    pub(crate) fn node_count(&self) -> usize {
        self.node_count
    }

    /// Nodes with a nonzero function at a point, by rising index; none where there is no such point.
    #[inline]
    pub fn nodes(&self, point: usize) -> &[u32] {
        &self.nodes[self.clusters.entries(point)]
    }

    /// Values $\Psi_I$ at a point; empty in smoothed tables.
    #[inline]
    pub fn values(&self, point: usize) -> &[f64] {
        if self.values.is_empty() { &[] } else { &self.values[self.entries(point)] }
    }

    /// Whether values are stored: not in smoothed tables.
    pub(crate) fn has_values(&self) -> bool {
        !self.values.is_empty()
    }

    /// Gradients at a point by slot, `slots × nodes`, neighbours running fastest.
    #[inline]
    pub fn gradients(&self, point: usize) -> &[f64] {
        let entries = self.entries(point);
        &self.gradients[entries.start * self.slots..entries.end * self.slots]
    }

    /// The entries of a point's values; none where there is no such point.
    #[inline(always)]
    fn entries(&self, point: usize) -> std::ops::Range<usize> {
        self.starts.get(point).map_or(0..0, |&start| start..start + self.clusters.entries(point).len())
    }

    /// Gradient slots: $D$, and one for the hoop where there is one.
    #[inline]
    pub(crate) fn gradient_components(&self) -> usize {
        self.slots
    }

    /// Diagonal entries of $F$ that hold the hoop stretch.
    #[inline]
    pub fn hoop_components(&self) -> &'static [usize] {
        self.hoops
    }

    /// Whether it is that of a sheet in plane stress, whose stretch across follows from a law and not from its functions.
    #[inline]
    pub(crate) fn is_plane_stress(&self) -> bool {
        self.plane_stress
    }

    /// Weights with the measure of the kinematics.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Positions \[length\]; centres of the sub-cells in smoothed tables.
    pub fn positions(&self) -> &[Point<D>] {
        &self.positions
    }

    /// Outward unit normals; empty inside a body.
    pub fn normals(&self) -> &[Point<D>] {
        &self.normals
    }

    /// The clusters of points that are assembled together.
    pub fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// The smallest reciprocal condition number met while tabulating.
    pub(crate) fn smallest_rcond(&self) -> f64 {
        self.smallest_rcond
    }

    /// Bytes held by the table.
    pub fn bytes(&self) -> usize {
        8 * (self.values.len() + self.gradients.len() + self.starts.len() + self.weights.len())
            + 4 * self.nodes.len()
            + 8 * D * (self.positions.len() + self.normals.len())
            + self.clusters.bytes()
    }

    /// Adds the forces of a stress at a point, $P:\nabla\Psi_I$ with hoops, to a vector over all nodes.
    pub(crate) fn add_stress(&self, point: usize, stress: &Mat3, forces: &mut [f64]) {
        let hoops: f64 = self.hoop_components().summed(|&c| stress[(c, c)]);
        let (nodes, gradients) = (self.nodes(point), self.gradients(point));
        for (a, &node) in nodes.iter().enumerate() {
            let at = |slot: usize| gradients[slot * nodes.len() + a];
            let own = &mut forces[node as usize * D..][..D];
            for (i, own) in own.iter_mut().enumerate() {
                *own += sum_of(D, |j| stress[(i, j)] * at(j));
            }
            if hoops != 0.0 {
                own[0] += hoops * at(D);
            }
        }
    }

    /// The gradient of a coefficient vector `d` (node by node, `D` components each) at a point, padded
    /// to 3×3: $\nabla u$ with hoops on the diagonal; $F = I + \nabla u$. NaN where there is no such point, or `d` is too
    /// short for the nodes.
    #[inline]
    pub fn displacement_gradient(&self, point: usize, d: &[f64]) -> Mat3 {
        if !self.reads(point, d) {
            return Mat3::repeat(f64::NAN);
        }
        displacement_gradient::<Plain, D>(self.nodes(point), self.gradients(point), self.hoops, d)
    }

    /// Whether there is such a point, and coefficients for all nodes.
    #[inline]
    fn reads(&self, point: usize, d: &[f64]) -> bool {
        point < self.point_count() && d.len() >= self.node_count * D
    }

    /// The displacement $u = \sum_I \Psi_I d_I$ at a point; zero in smoothed tables, which hold no values. NaN where
    /// there is no such point, or `d` is too short for the nodes.
    #[inline]
    pub fn displacement(&self, point: usize, d: &[f64]) -> Point<D> {
        if !self.reads(point, d) {
            return Point::repeat(f64::NAN);
        }
        let mut u = Point::zeros();
        for (&node, &value) in self.nodes(point).iter().zip(self.values(point)) {
            for i in 0..D {
                u[i] += value * d[node as usize * D + i];
            }
        }
        u
    }
}
