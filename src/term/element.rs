//! What terms see and give, cluster by cluster.

use super::at_points::{PointColumns, PointMatrix};
use super::contraction::Windows;
use super::lower::LowerBlocks;
use super::point_panel::PointPanel;
use super::uncondensed::Zone;
use crate::geometry::Vec3;

/// What a term sees of the state of an analysis.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Coefficients $d$, node by node, as many components each as the model has dimensions \[length\].
    pub displacement: &'a [f64],
    /// Condensed unknowns of this term, all clusters.
    pub condensed: &'a [f64],
    /// Internal variables of this term ([`Layout::history`](super::Layout::history)), as they were at the last converged state.
    pub history: &'a [f64],
    /// Load factor $\lambda$.
    pub load: f64,
    /// Time since the internal variables were written \[time\]; 0 without a clock.
    pub elapsed: f64,
}

impl<'a> View<'a> {
    /// Of a state with which no internal variables come, and no time passes.
    pub(crate) fn at_rest(displacement: &'a [f64], load: f64) -> Self {
        View { displacement, condensed: &[], history: &[], load, elapsed: 0.0 }
    }
}

/// An increment of Newton's method, as a term sees it.
#[derive(Debug, Clone, Copy)]
pub struct TermStep<'a> {
    /// Increments of the coefficients, node by node \[length\].
    pub displacement: &'a [f64],
    /// Increment of the load factor, where that is an unknown; else 0.
    pub load: f64,
}

/// What a state holds of a term.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TermState {
    /// Condensed unknowns (pressures), all clusters.
    pub condensed: Vec<f64>,
    /// Internal variables at the last converged state.
    pub history: Vec<f64>,
}

impl TermState {
    /// All numbers.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &f64> {
        self.condensed.iter().chain(&self.history)
    }
}

/// A matrix of rank one, $l\\,r^{\mathsf T}$: unknowns and values of both vectors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coupling {
    /// $l$.
    pub left: Vec<(u32, f64)>,
    /// $r$.
    pub right: Vec<(u32, f64)>,
}

/// The contribution of one cluster: gradient and Hessian of the potential over the cluster's unknowns.
///
/// Unknown $aD + i$ is component $i$ of the cluster's $a$-th node, $D$ being the dimension of the term. The matrix is stored by columns;
/// symmetric terms need only fill blocks on and below the diagonal.
#[derive(Debug, Clone, Default)]
pub struct Element {
    /// $\partial\Pi/\partial d$, internal minus external forces.
    pub residual: Vec<f64>,
    /// $\sum f^2$ over the contributions that the residual sums, where a cluster has several: the scale of convergence.
    pub(crate) force_squares: Option<f64>,
    /// $\partial^2\Pi/\partial d\\,\partial\lambda$.
    pub load_slope: Vec<f64>,
    /// $\partial^2\Pi/\partial d\\,\partial d$, `size × size` by columns; empty where only forces are requested.
    pub matrix: Vec<f64>,
    /// Whether the matrix is requested.
    pub with_matrix: bool,
    /// A part of $\partial^2\Pi/\partial d\\,\partial d$ that is not symmetric and that factors leave out: linear solutions are refined until
    /// it is met.
    pub coupling: Vec<Coupling>,
    /// Buffer for the term's own use.
    pub scratch: Vec<f64>,
    /// The matrix of terms that fill it over points instead, and a buffer for its columns.
    pub(crate) points: PointMatrix,
    pub(crate) columns: PointColumns,
    /// The matrix of terms that fill its lower blocks instead: bodies, which add it to `matrix` where there is one.
    pub(crate) lower: LowerBlocks,
    pub(crate) windows: Windows,
    pub(crate) point_panel: PointPanel,
    /// Where pressures may be kept uncondensed: what their condensation would have added to the matrix, and tangents at points in place
    /// of the rest.
    pub(crate) uncondensed: Option<Zone>,
}

impl Element {
    /// Zeroes the buffers for a cluster of `size` unknowns.
    pub(crate) fn reset(&mut self, size: usize, with_matrix: bool) {
        self.residual.clear();
        self.residual.resize(size, 0.0);
        self.force_squares = None;
        self.load_slope.clear();
        self.load_slope.resize(size, 0.0);
        self.matrix.clear();
        self.matrix.resize(if with_matrix { size * size } else { 0 }, 0.0);
        self.coupling.clear();
        self.points.clear();
        self.with_matrix = with_matrix;
        self.uncondensed = None;
    }
}

/// Forces of a term on the body, point by point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ForceDensities {
    /// Reference positions \[length\], padded by zeros.
    pub positions: Vec<Vec3>,
    /// Outward unit normals of the reference body; empty inside it.
    pub normals: Vec<Vec3>,
    /// Reference areas or volumes, measure of the kinematics included.
    pub weights: Vec<f64>,
    /// Forces per reference area or volume \[stress, stress/length\].
    pub forces: Vec<Vec3>,
}
