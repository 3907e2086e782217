//! What a scheme chooses among.

use std::sync::Arc;

use crate::term::PressureField;

/// How many particles.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Resolution {
    /// Particles along each axis; one number stands for all axes. Over planar regions about the product of them.
    Counts(Vec<usize>),
    /// The largest spacing of particles \[length\].
    Spacing(f64),
}

/// The cells between particles scattered over a planar region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partition {
    /// A constrained Delaunay triangulation.
    #[default]
    Triangles,
    /// Clipped Voronoi cells.
    Voronoi,
}

/// A relative spacing of particles as a function of position.
pub(crate) type Grading = Arc<dyn Fn(&[f64]) -> f64 + Send + Sync>;

/// How supports follow from the spacing: $a_i = 2 r d_i$ (6.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dilation {
    /// Local spacing, $r$ by basis: 1 (linear), 1.3 (quadratic; on lattices in space 1, and 1.2 for the third
    /// particle from each end), 1.8 (cubic).
    Auto,
    /// $d_i$ is the largest distance from the particle to its neighbours on lattices, their mean distance, smoothed, on
    /// scattered sets.
    Local(f64),
    /// $d_i$ is the largest spacing of the whole set, as in the paper.
    Global(f64),
    /// Balls of `factor` times the distance to the neighbour of rank `rank`; 1.5 times that to the sixth is a
    /// common choice for scattered sets.
    Neighbour {
        /// Which neighbour, counted from 1.
        rank: usize,
        /// The factor on its distance.
        factor: f64,
    },
}

impl From<f64> for Dilation {
    /// The normalised dilation over the local spacing.
    fn from(r: f64) -> Self {
        Dilation::Local(r)
    }
}

/// How the domain is integrated.
#[derive(Debug, Clone, PartialEq)]
pub enum Rule {
    /// Gauss points in 1D; beyond, gradients averaged over two sub-cells per direction of each cell. For orders above 1
    /// gradients that are linear in each cell of the plane and multilinear in each cell of a lattice in space
    /// ([`ShapeTable::consistent`](crate::table::ShapeTable::consistent)), averages over three sub-cells per direction
    /// elsewhere.
    Auto,
    /// Gauss points, `points` per direction in each of `zones` equal zones along each axis. `None`
    /// for the points means particles per direction in the zone + 2 (the paper's rule), `None` for
    /// the zones one zone per cell.
    Gauss {
        /// Zones along each axis.
        zones: Option<Vec<usize>>,
        /// Points per direction in a zone.
        points: Option<usize>,
    },
    /// Gradients averaged over `parts` sub-cells per direction of each cell.
    Smoothed {
        /// Sub-cells per direction; one alone has spurious modes.
        parts: usize,
    },
    /// Stabilised conforming nodal integration: gradients averaged over one cell around each particle
    /// ([`Cells::nodal_cells`](crate::cells::Cells::nodal_cells)). Passes the patch test; weak modes remain, and pressures
    /// are not projected.
    Scni,
    /// Direct nodal integration: gradients at particles, weighted by the cell around each. Neither passes the
    /// patch test nor sees all deformations; for comparison.
    Nodal,
}

/// How the volumetric energy is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PressureScheme {
    /// Linear pressures on macro cells of two cells per direction; constant per cell where only one
    /// cell spans a thickness.
    ///
    /// One cell does for membranes. In bending a pressure that is constant across it resists nothing: a beam comes out 2.6 times
    /// too soft, however many cells it has along itself. With two cells across it is off by 5 %, with four by 1 %.
    Auto,
    /// A field of one's own choice on zones of `size` cells per direction.
    Field {
        /// The field.
        field: PressureField,
        /// Cells per direction in a zone.
        size: usize,
    },
}

/// Where rows of essential conditions come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConstraintKind {
    /// At particles in 1D, over boundaries beyond.
    Auto,
    /// Values at particles: the paper's transformation (4.29).
    AtParticles,
    /// Boundary integrals with linear trace functions: the paper's multipliers (4.16). Prescribed values are met in the mean: particles
    /// of a held face move a little, by some thousandths of the largest displacement on coarse lattices.
    OverBoundary,
}

/// Which strategy enforces the rows; an iteration ([`SolverChoice::Krylov`]) has one of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConstraintMethod {
    /// Mixed transformation where few unknowns are constrained together, multipliers above.
    Auto,
    /// Lagrange multipliers.
    Multipliers,
    /// Mixed transformation.
    Transformation,
}

/// How linear systems are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverChoice {
    /// By what takes less. By iteration: lattices in space with nine by nine particles and more in cross section, cut solids with twelve
    /// by twelve, and cut solids of one process whose factors take more than a million multiplications for each unknown. All others
    /// by factors, which also take over where the iteration does not converge and they fit into memory. Scenes with contact take factors, and
    /// so do schemes with a [`ConstraintMethod`] of their own. Where it has to be known whether states are stable, ask for factors.
    #[default]
    Auto,
    /// By factors.
    Direct,
    /// By Krylov iteration with pressures as unknowns that are not condensed into the matrix: one body in 3D, lattice, mesh or cut solid,
    /// with projected pressures alone, with or without frictionless contact with rigid surfaces. Whether states are stable is not known
    /// then. Scenes with contact between faces, rigid bodies or several bodies are solved by a direct solver all the same.
    Krylov,
}

/// Which shape functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ApproximationChoice {
    /// Reproducing kernel particles.
    Particles,
    /// Lagrange finite elements of the scheme's order, for comparison: with the default volumetric
    /// treatment Q1/P0 (order 1) and Q2/P1 (order 2), Gauss points, conditions at nodes.
    Elements,
}
