//! Large bodies in 3D: pressures as separate unknowns, Krylov iteration, linear elements on the particles as a preconditioner.

mod auxiliary;
mod convergence;
mod interpolation;
mod iteration;
mod product;
mod solution;

use std::sync::{Arc, Mutex};

use crate::assembly::{Pattern, Ranks, System};
use crate::error::LinearError;
use crate::parallel::lock;

use super::{Direct, Inertia, LinearSolver, LinearSystem, MatrixClass};

pub(crate) use auxiliary::Auxiliary;

use convergence::Progress;
use interpolation::Interpolation;
use iteration::Iteration;

/// Generalised minimal residuals for nearly incompressible bodies in space.
///
/// Pressures of zones stay unknowns,
/// $$\begin{bmatrix}K & C^T\\ C & -H^{-1}\end{bmatrix}\begin{bmatrix}\delta d\\ q\end{bmatrix} =
///   \begin{bmatrix}b\\ 0\end{bmatrix},$$
/// for $C^T H C$ would couple all particles of a zone and defeat every preconditioner. Conditions hold exactly in each
/// direction: $\Pi = 1 - G^T (G G^T)^{-1} G$. The preconditioner is block triangular. In place of $K^{-1}$ it has
/// $N^{-1} A^{-1} N^{-T}$ with $N_{JI} = \Psi_I(X_J)$ and the stiffness $A$ of trilinear elements between the particles,
/// which sees the same displacements at particles and has a tenth of the entries; one multilevel cycle stands for $A^{-1}$. Off lattices
/// gradients of linear fits to the nearest particles take the place of elements.
/// In place of Schur's complement it has the mass of the pressures, $1/(2\mu) + H^{-1}$.
pub(crate) struct Krylov {
    auxiliary: Arc<Auxiliary>,
    /// The solver that takes the place of this crate's own multilevel cycle.
    preconditioner: Option<Box<dyn LinearSolver>>,
    /// Once a pattern is analysed.
    iteration: Option<Box<Iteration>>,
    counts: Arc<Mutex<Vec<usize>>>,
    /// Whether factors may take its place where it does not converge: nobody asked for it by name, and they fit into memory.
    pub(crate) replaceable: bool,
}

impl Krylov {
    /// With the elements that belong to the particles.
    pub(crate) fn new(auxiliary: Auxiliary) -> Self {
        Krylov {
            auxiliary: Arc::new(auxiliary),
            preconditioner: None,
            iteration: None,
            counts: Arc::default(),
            replaceable: false,
        }
    }

    fn analyzed(&mut self) -> Result<&mut Iteration, LinearError> {
        self.iteration.as_deref_mut().ok_or_else(|| LinearError::Library { what: "no pattern was analysed".into() })
    }

    /// With a custom solver in place of the multilevel cycle: an approximate one for the stiffness of the elements. Where ranks share
    /// the model, one that works on all of them.
    pub(crate) fn with_preconditioner(mut self, preconditioner: Box<dyn LinearSolver>) -> Self {
        self.preconditioner = Some(preconditioner);
        self
    }
}

impl LinearSolver for Krylov {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Krylov {
            auxiliary: self.auxiliary.clone(),
            preconditioner: self.preconditioner.as_ref().map(|preconditioner| preconditioner.fresh()),
            iteration: None,
            counts: self.counts.clone(),
            replaceable: self.replaceable,
        })
    }

    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
        pattern.validate()?;
        let rows = class.constraints();
        let unknowns = pattern.size() - rows;
        ensure!(
            unknowns == self.auxiliary.model.unknowns(),
            LinearError::Length {
                what: "reduced unknowns beside multipliers",
                given: unknowns,
                needed: self.auxiliary.model.unknowns(),
            }
        );
        // Conditions: entries in rows of multipliers.
        let mut entries: Vec<Vec<(u32, usize)>> = vec![Vec::new(); rows];
        for column in 0..unknowns {
            let all = pattern.column(column);
            let first = all.partition_point(|&row| (row as usize) < unknowns);
            for (k, &row) in all.iter().enumerate().skip(first) {
                entries[row as usize - unknowns].push((column as u32, pattern.columns[column] + k));
            }
        }
        let mut users: Vec<Vec<u32>> = vec![Vec::new(); unknowns];
        for (row, entries) in entries.iter().enumerate() {
            entries.iter().for_each(|&(column, _)| users[column as usize].push(row as u32));
        }
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); rows];
        for (row, entries) in entries.iter().enumerate() {
            let others = entries.iter().flat_map(|&(column, _)| &users[column as usize]);
            columns[row] = others.copied().filter(|&other| other as usize > row).collect();
            columns[row].sort_unstable();
            columns[row].dedup();
        }
        let products = Pattern::from_columns(columns);
        let assembler = self.auxiliary.model.assembler();
        let preconditioner = match &self.preconditioner {
            Some(preconditioner) => {
                // Along a curve, so that each rank holds a region.
                let model = &self.auxiliary.model;
                let curve = model.curve();
                let mut nodes: Vec<usize> = (0..model.node_count()).collect();
                nodes.sort_by_cached_key(|&node| (curve.place(model.coordinates(node)), node));
                let order: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
                let mut own = preconditioner.fresh();
                own.analyze(assembler.pattern(), MatrixClass::Definite, Some(&order))?;
                Some(own)
            }
            None => None,
        };
        let projector = if rows > 0 { Some(Direct::of(&products, MatrixClass::Definite, None)?) } else { None };
        let ranks = self.auxiliary.model.shared_ranks();
        self.iteration = Some(Box::new(Iteration {
            auxiliary: self.auxiliary.clone(),
            ends: product::parts(pattern, unknowns),
            pattern: pattern.clone(),
            unknowns,
            entries,
            products,
            projector,
            product_values: Vec::new(),
            values_at: Interpolation::new(&self.auxiliary.values, unknowns / 3, ranks.clone()),
            ranks,
            assembler,
            preconditioner,
            system: System::default(),
            multilevel: None,
            stiffness: 1.0,
            rows: (Vec::new(), 1.0),
            pressures: Vec::new(),
            pieces: Vec::new(),
            progress: Progress::new(self.counts.clone()),
        }));
        Ok(())
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        self.analyzed()?.prepare(system).map(|()| None)
    }

    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        pressures: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError> {
        let iteration = self.analyzed()?;
        match pressures {
            Some(pressures) => iteration.solve(system, rhs, pressures, false),
            None => iteration.solve(system, rhs, &mut vec![[0.0; 4]; system.zones.len()], true),
        }
    }

    fn keeps_pressures(&self) -> bool {
        true
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        self.auxiliary.model.shared_ranks()
    }

    fn krylov_iterations(&self) -> Vec<usize> {
        lock(&self.counts).clone()
    }
}
