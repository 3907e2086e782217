//! Schemes: how a scene is discretised and solved.

use std::fmt;
use std::sync::Arc;

use crate::cells::{Layout, Scatter};
use crate::kernel::Kernel;
use crate::linear::LinearSolver;
use crate::solve::{Newton, Stepping};
use crate::term::{PressureField, ProjectedMeasure};

use super::scheme_choices::{
    ApproximationChoice, ConstraintKind, ConstraintMethod, Dilation, Grading, Partition, PressureScheme, Resolution,
    Rule, SolverChoice,
};

/// How a scene is discretised and solved. [`Scheme::default`] is the one default; set the particles.
///
/// ```
/// use rkpm::prelude::*;
/// use rkpm::solve::{Newton, StepControl};
/// let scheme = Scheme::default()
///     .particles([17, 9])
///     .dilation(Dilation::Global(1.2))
///     .newton(Newton { iterations: 40, ..Newton::default() })
///     .stepping(Stepping { control: StepControl::ArcLength, ..Stepping::default() });
/// # let _ = scheme;
/// ```
#[derive(Clone)]
pub struct Scheme {
    /// Which shape functions.
    pub(crate) approximation: ApproximationChoice,
    /// How many particles; 9 along each axis where it is not said.
    pub(crate) resolution: Option<Resolution>,
    /// How they are spaced.
    pub(crate) layout: Layout,
    /// How particles are scattered over planar regions.
    pub(crate) scatter: Scatter,
    /// How their spacing varies, see [`graded`](Scheme::graded).
    pub(crate) grading: Option<Grading>,
    /// Spacings across walls of solids at least, see [`across`](Scheme::across).
    pub(crate) across: usize,
    /// Whether thin walls are left as they are, see [`thin_walls`](Scheme::thin_walls).
    pub(crate) thin_walls: bool,
    /// The cells between them.
    pub(crate) partition: Partition,
    /// Order of the basis.
    pub(crate) order: u8,
    /// The kernel; a cubic spline where it is not said.
    pub(crate) kernel: Option<Arc<dyn Kernel>>,
    /// Supports.
    pub(crate) dilation: Dilation,
    /// Reciprocal condition number of the moment matrix below which a point is refused; `None` for 1e-8, where gradients may be off
    /// by 1e-3, see [`with_rcond_limit`](crate::shape::ReproducingKernel::with_rcond_limit).
    pub(crate) rcond_limit: Option<f64>,
    /// Domain integration.
    pub(crate) rule: Rule,
    /// Volumetric energy.
    pub(crate) pressure: PressureScheme,
    /// What of the volume is projected on zones of pressure.
    pub(crate) measure: ProjectedMeasure,
    /// Essential conditions.
    pub(crate) constraint_kind: ConstraintKind,
    /// Their enforcement.
    pub(crate) constraint_method: ConstraintMethod,
    /// Linear systems.
    pub(crate) solver_choice: SolverChoice,
    /// Bytes that a lattice in space may take; `None` for the memory at hand, where the system tells. Larger models are
    /// refused before they are built.
    pub(crate) memory: Option<u64>,
    /// A linear solver of one's own, see [`solver`](Scheme::solver).
    pub(crate) solver: Option<Arc<dyn LinearSolver>>,
    /// Newton's method.
    pub(crate) newton: Newton,
    /// Load stepping.
    pub(crate) stepping: Stepping,
}

impl fmt::Debug for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scheme")
            .field("approximation", &self.approximation)
            .field("resolution", &self.resolution)
            .field("layout", &self.layout)
            .field("scatter", &self.scatter)
            .field("across", &self.across)
            .field("thin_walls", &self.thin_walls)
            .field("partition", &self.partition)
            .field("order", &self.order)
            .field("dilation", &self.dilation)
            .field("rcond_limit", &self.rcond_limit)
            .field("rule", &self.rule)
            .field("pressure", &self.pressure)
            .field("measure", &self.measure)
            .field("constraint_kind", &self.constraint_kind)
            .field("constraint_method", &self.constraint_method)
            .field("solver_choice", &self.solver_choice)
            .field("memory", &self.memory)
            .field("newton", &self.newton)
            .field("stepping", &self.stepping)
            .finish_non_exhaustive()
    }
}

impl Default for Scheme {
    /// Linear basis, cubic spline, consistent integration, projected pressures; 9 particles along each
    /// axis unless set.
    fn default() -> Self {
        Scheme {
            approximation: ApproximationChoice::Particles,
            resolution: None,
            layout: Layout::Regular,
            scatter: Scatter::default(),
            grading: None,
            across: 0,
            thin_walls: false,
            partition: Partition::Triangles,
            order: 1,
            kernel: None,
            dilation: Dilation::Auto,
            rcond_limit: None,
            rule: Rule::Auto,
            pressure: PressureScheme::Auto,
            measure: ProjectedMeasure::Adapted,
            constraint_kind: ConstraintKind::Auto,
            constraint_method: ConstraintMethod::Auto,
            solver_choice: SolverChoice::Auto,
            memory: None,
            solver: None,
            newton: Newton::default(),
            stepping: Stepping::default(),
        }
    }
}

impl Scheme {
    /// The paper's scheme: Gauss points (particles per direction in the zone + 2), zones as given by
    /// [`integration_zones`](Scheme::integration_zones), no cure against locking, transformation at particles, supports from
    /// the largest spacing with normalised dilation `r`.
    ///
    /// Pressures at points are iterates of Newton, which changes its path but not its solution.
    pub fn paper(r: f64) -> Self {
        Scheme {
            dilation: Dilation::Global(r),
            rule: Rule::Gauss { zones: None, points: None },
            pressure: PressureScheme::Field { field: PressureField::Pointwise, size: 1 },
            constraint_kind: ConstraintKind::AtParticles,
            constraint_method: ConstraintMethod::Transformation,
            ..Scheme::default()
        }
    }

    /// Finite elements of order 1 or 2 in place of particles; counts are those of the nodes.
    pub fn elements(order: u8) -> Self {
        Scheme { approximation: ApproximationChoice::Elements, order, ..Scheme::default() }
    }

    /// Sets which shape functions: with finite elements counts are those of the nodes.
    pub fn approximation(mut self, approximation: ApproximationChoice) -> Self {
        self.approximation = approximation;
        self
    }

    /// Sets the particles along each axis; one number stands for all axes.
    pub fn particles(mut self, counts: impl Into<Vec<usize>>) -> Self {
        self.resolution = Some(Resolution::Counts(counts.into()));
        self
    }

    /// Sets the largest spacing of particles \[length\].
    pub fn spacing(mut self, spacing: f64) -> Self {
        self.resolution = Some(Resolution::Spacing(spacing));
        self
    }

    /// Sets how the spacing of particles scattered over a planar region varies: the spacing is multiplied by the
    /// function, or is in proportion to it where a number of particles is requested. In solids blocks of cells are halved until their
    /// spacing is no larger than that, down to 1/16 ([`CutLattice::refined`](crate::cells::CutLattice::refined)).
    pub fn graded(mut self, grading: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        self.grading = Some(Arc::new(grading));
        self
    }

    /// Sets the least number of particle spacings across each wall of a solid: blocks of cells are halved in thinner walls, down to 1/16 of
    /// the spacing ([`CutLattice::refined`](crate::cells::CutLattice::refined)); walls that would need a smaller spacing are an error. With 0,
    /// the default, walls with fewer than two and a half spacings get at least three where three halvings suffice, see
    /// [`thin_walls`](Scheme::thin_walls). Bodies that are not solids are refused.
    pub fn across(mut self, spacings: usize) -> Self {
        self.across = spacings;
        self
    }

    /// Leaves thin walls as they are. Without this call, walls of planar regions under three spacings get six, those of solids under two and
    /// a half get three to six, and blocks thinner than a given spacing get four cells. Where walls of regions or solids take more than
    /// 10 000 particles beyond those of the spacing, they are left as they are, and [`check::scene`](crate::check::scene) and
    /// [`Problem::verdict`](crate::scene::Problem::verdict) say so. What cannot be refined enough is
    /// refused, and so are blocks with given counts and meshes where conditions leave a zone fewer displacements than it has pressures.
    ///
    /// A wall with one cell across is far too stiff where both faces are bonded, and bends wrongly where they are free. In solids
    /// [`across`](Scheme::across) goes before this rule, and under [`graded`](Scheme::graded) walls thinner than three eighths of the largest
    /// spacing are left to the grading.
    pub fn thin_walls(mut self) -> Self {
        self.thin_walls = true;
        self
    }

    /// Sets the seed of scattered particles.
    pub fn seed(mut self, seed: u64) -> Self {
        self.scatter.seed = seed;
        self
    }

    /// Sets how particles are scattered over planar regions.
    pub fn scatter(mut self, scatter: Scatter) -> Self {
        self.scatter = scatter;
        self
    }

    /// Sets the cells between scattered particles.
    pub fn partition(mut self, partition: Partition) -> Self {
        self.partition = partition;
        self
    }

    /// Sets how the particles are spaced.
    pub fn layout(mut self, layout: Layout) -> Self {
        self.layout = layout;
        self
    }

    /// Sets the order of the basis.
    ///
    /// Second and higher orders pay where solutions are smooth: the default rule is then consistent with quadratic fields in
    /// one and two dimensions, and the energy of a strip of revolution of 9 × 9 particles is off by 1.5e-6 where averages
    /// over sub-cells leave 1.0e-4. On lattices in space gradients are multilinear in
    /// each cell; where edges are singular averages of linear functions are nearer: a sheared bonded cube of 9 particles a
    /// side is off by 5.4 %, with the linear basis by 1.8 %.
    pub fn order(mut self, order: u8) -> Self {
        self.order = order;
        self
    }

    /// Sets the kernel.
    pub fn kernel(mut self, kernel: impl Kernel + 'static) -> Self {
        self.kernel = Some(Arc::new(kernel));
        self
    }

    /// Sets how supports follow from the spacing: a [`Dilation`], or a number for the normalised dilation over the local
    /// spacing.
    ///
    /// For $r$ above about 1.5 on irregular sets [`Dilation::Global`] is more accurate: wide supports of
    /// unequal size cost a digit.
    pub fn dilation(mut self, dilation: impl Into<Dilation>) -> Self {
        self.dilation = dilation.into();
        self
    }

    /// Sets the reciprocal condition number of the moment matrix below which a point is refused, in place of 1e-8, where gradients may
    /// be off by 1e-3, see [`with_rcond_limit`](crate::shape::ReproducingKernel::with_rcond_limit).
    pub fn rcond_limit(mut self, limit: f64) -> Self {
        self.rcond_limit = Some(limit);
        self
    }

    /// Sets the integration zones along each axis of a Gauss rule; other rules become one.
    pub fn integration_zones(mut self, zones: impl Into<Vec<usize>>) -> Self {
        let points = match self.rule {
            Rule::Gauss { points, .. } => points,
            _ => None,
        };
        self.rule = Rule::Gauss { zones: Some(zones.into()), points };
        self
    }

    /// Sets the domain integration.
    pub fn rule(mut self, rule: Rule) -> Self {
        self.rule = rule;
        self
    }

    /// Sets the treatment of the volumetric energy on zones of `size` cells per direction; where the rule has zones of its own, pressures
    /// are those of these, and the size is 1.
    pub fn pressure_field(mut self, field: PressureField, size: usize) -> Self {
        self.pressure = PressureScheme::Field { field, size };
        self
    }

    /// Sets what of the volume is projected on zones of pressure: [`ProjectedMeasure::Jacobian`] for work that is energy to
    /// rounding.
    pub fn projected_measure(mut self, measure: ProjectedMeasure) -> Self {
        self.measure = measure;
        self
    }

    /// Sets where rows come from.
    pub fn constraint_kind(mut self, constraint_kind: ConstraintKind) -> Self {
        self.constraint_kind = constraint_kind;
        self
    }

    /// Sets the enforcement.
    pub fn constraint_method(mut self, constraint_method: ConstraintMethod) -> Self {
        self.constraint_method = constraint_method;
        self
    }

    /// Sets how linear systems are solved.
    pub fn solver_choice(mut self, solver_choice: SolverChoice) -> Self {
        self.solver_choice = solver_choice;
        self
    }

    /// Sets the bytes that a lattice in space may take, in place of the memory at hand, where the system tells. Larger models
    /// are refused before they are built.
    pub fn memory(mut self, bytes: u64) -> Self {
        self.memory = Some(bytes);
        self
    }

    /// Sets a linear solver in place of the crate's own: one behind the trait of [`linear`](crate::linear). Where it works on
    /// several ranks ([`LinearSolver::ranks`]) the scene is
    /// shared among them: each tabulates and sums its own zones.
    pub fn solver(mut self, solver: impl LinearSolver + 'static) -> Self {
        self.solver = Some(Arc::new(solver));
        self
    }

    /// Sets Newton's method.
    pub fn newton(mut self, newton: Newton) -> Self {
        self.newton = newton;
        self
    }

    /// Sets the stepping.
    pub fn stepping(mut self, stepping: Stepping) -> Self {
        self.stepping = stepping;
        self
    }
}
