//! Shape functions: the trait [`Approximation`] and the reproducing kernel functions.

mod correction;
mod finite_elements;
mod reproducing;

pub(crate) use finite_elements::ElementPoints;
pub use finite_elements::FiniteElements;
pub use reproducing::ReproducingKernel;

use std::any::Any;

use crate::error::ApproximationError;
use crate::geometry::{Point, Vec3};

/// Shape functions at one point, in the caller's buffers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShapeFunctions<const D: usize> {
    /// Nodes with a nonzero function, by rising index.
    pub nodes: Vec<u32>,
    /// Values $\Psi_I(X)$.
    pub values: Vec<f64>,
    /// Gradients $\partial\Psi_I/\partial X$ \[1/length\].
    pub gradients: Vec<Point<D>>,
    /// Reciprocal condition number of the moment matrix (1-norm); 1 where there is none.
    pub rcond: f64,
}

impl<const D: usize> ShapeFunctions<D> {
    /// $\sum_I\Psi_I d_I$ for coefficients of so many components, padded by zeros.
    pub(crate) fn weighted(&self, dim: usize, coefficients: &[f64]) -> Vec3 {
        let mut sum = Point::zeros();
        for (&node, &value) in self.nodes.iter().zip(&self.values) {
            for i in 0..dim {
                sum[i] += value * coefficients[node as usize * dim + i];
            }
        }
        sum
    }

    /// The same for nodes that are counted from another one.
    pub(crate) fn shifted(mut self, first: usize) -> Self {
        self.nodes.iter_mut().for_each(|node| *node += first as u32);
        self
    }
}

/// Buffers that an [`Approximation`] reuses from point to point, so that nothing is allocated after warm-up.
///
/// Whoever evaluates keeps one per thread; what is in it is the approximation's own affair.
/// ```
/// use rkpm::shape::Scratch;
/// let mut scratch = Scratch::default();
/// scratch.of::<Vec<f64>>().resize(8, 0.0);
/// assert_eq!(scratch.of::<Vec<f64>>().len(), 8);
/// ```
#[derive(Default)]
pub struct Scratch(Option<Box<dyn Any + Send>>);

impl Scratch {
    /// The buffers of this type; made anew where those of another type were in use.
    pub fn of<T: Default + Send + 'static>(&mut self) -> &mut T {
        if !self.0.as_ref().is_some_and(|buffers| buffers.is::<T>()) {
            self.0 = Some(Box::new(T::default()));
        }
        self.0.as_mut().and_then(|buffers| buffers.downcast_mut()).expect("buffers of this type")
    }
}

/// The error for a node that there is not.
fn no_node(node: usize) -> ApproximationError {
    ApproximationError::Particle {
        particle: node,
        what: "there is no node of this number",
        remedy: "give indices below the number of nodes",
    }
}

/// A set of shape functions attached to nodes.
///
/// ```
/// use rkpm::error::ApproximationError;
/// use rkpm::geometry::Point;
/// use rkpm::shape::{Approximation, Scratch, ShapeFunctions};
/// /// Linear finite elements on an interval.
/// struct Hats(Vec<Point<1>>);
/// impl Approximation<1> for Hats {
///     fn nodes(&self) -> &[Point<1>] { &self.0 }
///     fn evaluate(&self, at: &Point<1>, _: &mut Scratch, out: &mut ShapeFunctions<1>) -> Result<(), ApproximationError> {
///         let right = self.0.partition_point(|n| n[0] < at[0]).clamp(1, self.0.len() - 1);
///         let (a, b) = (self.0[right - 1][0], self.0[right][0]);
///         let t = (at[0] - a) / (b - a);
///         out.nodes = vec![right as u32 - 1, right as u32];
///         out.values = vec![1.0 - t, t];
///         out.gradients = vec![Point::<1>::new(-1.0 / (b - a)), Point::<1>::new(1.0 / (b - a))];
///         out.rcond = 1.0;
///         Ok(())
///     }
/// }
/// let hats = Hats(vec![Point::<1>::new(0.0), Point::<1>::new(2.0)]);
/// assert_eq!(hats.shape_functions(&Point::<1>::new(0.5))?.values, [0.75, 0.25]);
/// # Ok::<(), ApproximationError>(())
/// ```
pub trait Approximation<const D: usize>: Send + Sync {
    /// Positions of the nodes \[length\].
    fn nodes(&self) -> &[Point<D>];

    /// Writes values and gradients at `at`, nodes by rising index.
    ///
    /// # Errors
    /// Where the functions are not defined: the point is not covered, or the moment matrix is singular.
    fn evaluate(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError>;

    /// Writes values alone; gradients are left as they are. Cheaper where it matters (smoothed tables).
    ///
    /// # Errors
    /// As [`evaluate`](Approximation::evaluate).
    fn evaluate_values(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.evaluate(at, scratch, out)
    }

    /// Writes values alone at a node; interpolating functions know them without looking.
    ///
    /// # Errors
    /// As [`evaluate`](Approximation::evaluate).
    fn evaluate_at_node(
        &self,
        node: usize,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        let at = self.nodes().get(node).ok_or_else(|| no_node(node))?;
        self.evaluate_values(at, scratch, out)
    }

    /// Writes what the functions in a box follow from: the nodes that may have one there, by rising index, and numbers for where
    /// they stand, seen from the corner `low`. Where two boxes of one size have as many nodes and the same numbers to rounding,
    /// points at the same place in them have the same values, node by node. False where this is not known, and tables then
    /// ask at each point.
    fn surroundings(&self, _low: &Point<D>, _high: &Point<D>, _nodes: &mut Vec<u32>, _numbers: &mut Vec<f64>) -> bool {
        false
    }

    /// Values and gradients at one point, freshly allocated.
    ///
    /// # Errors
    /// As [`evaluate`](Approximation::evaluate).
    fn shape_functions(&self, at: &Point<D>) -> Result<ShapeFunctions<D>, ApproximationError> {
        let mut out = ShapeFunctions::default();
        self.evaluate(at, &mut Scratch::default(), &mut out)?;
        Ok(out)
    }
}
