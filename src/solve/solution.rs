//! Solutions of the linearised equations: the factors carry the symmetric part, sweeps or minimal residuals the rest.

use crate::assembly::System;
use crate::each::{Each, add, list_of};
use crate::error::{Cause, LinearError};
use crate::linear::minimal_residuals;
use crate::linear::vector::norm;
use crate::term::Zone;

use super::equilibrium::Equilibrium;
use super::increment::Increment;

/// Linear solutions are refined until this relative residual: what is left of it is corrected by Newton's next
/// iteration, which would leave as much by its own rounding.
const REFINED: f64 = 1e-10;
/// Where there is a skew part, until this one: each sweep costs a solution, and Newton's next iteration finds what is
/// left of it at once.
const SWEPT: f64 = 1e-6;
/// Sweeps over the skew part that leave more than this part of the residual of the one before give way to minimal residuals.
const SLOW: f64 = 0.5;
/// Inverse iterations for a mode that is near enough.
const INVERSE_ITERATIONS: usize = 4;
/// The golden ratio, whose multiples leave no two parts of 1 close together.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Right-hand sides of the linearised equations. Conditions are kept: prescribed displacements change by what the right-hand side
/// says, by nothing otherwise.
#[derive(Debug, Clone, Copy)]
pub enum Rhs<'a> {
    /// What is left of the forces and of prescribed displacements: Newton's step.
    Residual,
    /// A unit of the load factor, loads and prescribed displacements together.
    Load,
    /// Forces on the nodes, one for each unknown.
    Force(&'a [f64]),
    /// Changes of the values of the constraint equations, one for each.
    Prescribed(&'a [f64]),
    /// The dual problem $K^Tz = \partial q/\partial d$ of a quantity of the displacement, $z$ being prescribed by the constraint equations.
    Dual {
        /// $\partial q/\partial d$ at fixed conditions.
        force: &'a [f64],
        /// What the constraint equations prescribe of $z$.
        prescribed: &'a [f64],
    },
}

/// Which right-hand sides pressures have that the solver keeps as unknowns.
#[derive(Clone, Copy, PartialEq)]
enum Kept {
    /// What is left of their equations.
    Gaps,
    /// None: loads move forces alone.
    Zeros,
    /// None, and nobody asks for their changes.
    Unasked,
}

impl Equilibrium<'_> {
    /// Solves with the factors of the last linearisation; parts of the matrix that are not symmetric, pressures that the solver keeps and
    /// multipliers included. The multipliers are changes of the reactions. What touches gives a little in one solution (some 1e-4 of the
    /// displacement where the pressures are condensed): Newton's steps undo that, a single answer to a load keeps it.
    ///
    /// # Errors
    /// [`Cause::Singular`] where the factors leave too much of the right-hand side, and [`Cause::Refused`] for lists of other lengths
    /// than this problem has.
    pub fn solve(&mut self, rhs: Rhs<'_>) -> Result<Increment, Cause> {
        self.solve_to(rhs, !matches!(rhs, Rhs::Residual))
    }

    /// The answer to a unit of the load within an iteration, which corrects what it is off by.
    pub(super) fn load_response(&mut self) -> Result<Increment, Cause> {
        self.solve_to(Rhs::Load, false)
    }

    /// Solves in full, or as far as an iteration needs that corrects what is left.
    fn solve_to(&mut self, rhs: Rhs<'_>, fully: bool) -> Result<Increment, Cause> {
        let negative = |all: &[f64]| all.mapped(|x| -x);
        let (unknowns, equations) = (self.model.unknowns(), self.equations.len());
        let (force, jump, kept) = match rhs {
            Rhs::Residual => (negative(&self.system.residual), self.violation.clone(), Kept::Gaps),
            Rhs::Load => {
                let mut slope = Vec::new();
                self.equations.load_slope(self.load, &mut slope);
                (negative(&self.system.load_slope), slope, Kept::Zeros)
            }
            Rhs::Force(force) => (force.to_vec(), vec![0.0; equations], Kept::Unasked),
            Rhs::Prescribed(jump) => (vec![0.0; unknowns], jump.to_vec(), Kept::Unasked),
            Rhs::Dual { force, prescribed } => (force.to_vec(), prescribed.to_vec(), Kept::Unasked),
        };
        self.check("right-hand side, or what was linearised,", force.len(), unknowns)?;
        self.check("right-hand side of the constraint equations", jump.len(), equations)?;
        let transposed = matches!(rhs, Rhs::Dual { .. });
        if transposed {
            transpose(&mut self.system);
        }
        let solved = self.solve_for((&force, &jump), kept, fully);
        if transposed {
            transpose(&mut self.system);
        }
        let mut step = solved?;
        match rhs {
            // Solutions have whole multipliers, steps their changes.
            Rhs::Residual => add(&mut step.multipliers, -1.0, &self.multipliers),
            Rhs::Load => step.load = 1.0,
            _ => {}
        }
        Ok(step)
    }

    /// The increment for a force, and changes of the values of the constraint equations.
    fn solve_for(
        &mut self,
        (force, jump): (&[f64], &[f64]),
        kept: Kept,
        fully: bool,
    ) -> Result<Increment, LinearError> {
        let mut rhs = Vec::new();
        self.reduction.restrict(force, jump, &self.system, &mut rhs);
        let gap = |zone: &Zone| if kept == Kept::Gaps { zone.gap() } else { [0.0; 4] };
        let mut step = Increment {
            displacement: vec![0.0; force.len()],
            multipliers: vec![0.0; jump.len()],
            kept: self.system.zones.mapped(gap),
            ..Increment::default()
        };
        let pressures = (kept != Kept::Unasked).then_some(&mut step.kept[..]);
        let (solution, left) = self.solve_reduced(&rhs, pressures, fully)?;
        step.left = left;
        self.reduction.recover(&solution, jump, &mut step.displacement, &mut step.multipliers);
        let mut residual: Vec<f64> = force.mapped(|force| -force);
        self.reduction.stiffen(&step.displacement, &self.system, &mut residual);
        self.reduction.react(&residual, &mut step.multipliers);
        Ok(step)
    }

    /// Solves for a reduced right-hand side, and what is left of it that an iteration has to take into account. Where none follows sweeps go on:
    /// what prescribed values ask for is as large as the bulk modulus, the answer as small as the shear modulus.
    ///
    /// # Errors
    /// Where no iteration follows also if sweeps and minimal residuals over the skew part leave more than it would correct.
    fn solve_reduced(
        &mut self,
        rhs: &[f64],
        pressures: Option<&mut [[f64; 4]]>,
        fully: bool,
    ) -> Result<(Vec<f64>, f64), LinearError> {
        let mut solution = rhs.to_vec();
        let (solver, reduced) = self.reduced();
        let left = solver.solve(&reduced, &mut solution, pressures)?;
        // An iterative solver tells what it has left; sweeps would not reduce it.
        if left > 0.0 {
            return Ok((solution, left));
        }
        let symmetric = self.system.is_symmetric();
        let enough = if symmetric || fully { REFINED } else { SWEPT };
        let size = norm(rhs);
        let (mut before, mut correction, mut skew) = (f64::INFINITY, Vec::new(), Vec::new());
        for sweep in 0.. {
            correction.clear();
            correction.resize(rhs.len(), 0.0);
            self.reduction.pattern.multiply_add(&self.values, &solution, &mut correction);
            if !symmetric {
                self.skew_product(&solution, &mut skew);
                add(&mut correction, 1.0, &skew);
            }
            self.system.over_ranks(&mut correction);
            correction.iter_mut().zip(rhs).for_each(|(p, b)| *p = b - *p);
            let residual = norm(&correction);
            ensure!(residual.is_finite(), LinearError::Residual { residual });
            // One sweep removes the rounding of the factors; the skew part needs as many as it takes, each of which leaves no
            // more than half.
            if residual <= enough * size || (symmetric && sweep > 0) {
                // A solution of a regular system leaves next to nothing; what is left of a singular one is of its own size.
                let singular = symmetric && residual > 1e-3 * size;
                return if singular {
                    Err(LinearError::Residual { residual: residual / size })
                } else {
                    Ok((solution, 0.0))
                };
            }
            if residual > SLOW * before {
                if residual > size {
                    correction.copy_from_slice(rhs);
                    solution.fill(0.0);
                }
                let left = self.minimise(correction, &mut solution, enough)?;
                return if fully && !(left <= SWEPT) {
                    Err(LinearError::Residual { residual: left })
                } else {
                    Ok((solution, if left <= SWEPT { 0.0 } else { left }))
                };
            }
            before = residual;
            let (solver, reduced) = self.reduced();
            solver.solve(&reduced, &mut correction, None)?;
            add(&mut solution, 1.0, &correction);
        }
        Ok((solution, 0.0))
    }

    /// Adds the minimal residuals of $(1 + K^{-1}N)\\,x = K^{-1}b$ to a solution that leaves `b`, and tells the part of it that they leave:
    /// where the skew part is no longer small compared with the stiffness, as in slender bodies with free ends under following pressure,
    /// sweeps diverge.
    fn minimise(&mut self, mut b: Vec<f64>, solution: &mut [f64], enough: f64) -> Result<f64, LinearError> {
        let (solver, reduced) = self.reduced();
        solver.solve(&reduced, &mut b, None)?;
        let mut skew = Vec::new();
        let (found, left) = minimal_residuals(&b, enough, |last, product| {
            self.skew_product(last, &mut skew);
            self.system.over_ranks(&mut skew);
            let (solver, reduced) = self.reduced();
            solver.solve(&reduced, &mut skew, None)?;
            product.iter_mut().zip(last).zip(&skew).for_each(|((p, v), n)| *p = v + n);
            Ok(())
        })?;
        add(solution, 1.0, &found);
        Ok(left)
    }

    /// Writes the product of the skew part with a reduced vector.
    fn skew_product(&self, x: &[f64], product: &mut Vec<f64>) {
        let (mut full, mut moved) = (vec![0.0; self.model.unknowns()], vec![0.0; self.model.unknowns()]);
        let zeros = vec![0.0; self.equations.len()];
        self.reduction.recover(x, &zeros, &mut full, &mut zeros.clone());
        self.system.skew_multiply_add(&full, &mut moved);
        self.reduction.project(&moved, product);
    }

    /// The displacement that the last matrix resists least, by inverse iteration: a mode of an unstable state, or a soft one beside it.
    /// Its norm is 1.
    ///
    /// # Errors
    /// As [`solve`](Equilibrium::solve).
    pub(super) fn weakest_mode(&mut self) -> Result<Vec<f64>, Cause> {
        // From anything that has a part of all modes.
        let unknowns = self.model.unknowns();
        let mut mode: Vec<f64> = list_of(unknowns, |k| ((k + 1) as f64 * GOLDEN).fract() - 0.5);
        let (mut reduced_mode, zeros) = (Vec::new(), vec![0.0; self.equations.len()]);
        let mut unused = zeros.clone();
        for _ in 0..INVERSE_ITERATIONS {
            self.reduction.project(&mode, &mut reduced_mode);
            let (solver, reduced) = self.reduced();
            solver.solve(&reduced, &mut reduced_mode, None)?;
            self.reduction.recover(&reduced_mode, &zeros, &mut mode, &mut unused);
            let size = norm(&mode);
            ensure!(size > 0.0 && size.is_finite(), LinearError::Residual { residual: size });
            mode.iter_mut().for_each(|u| *u /= size);
        }
        Ok(mode)
    }
}

/// Makes the matrix its transpose: its symmetric part stays.
fn transpose(system: &mut System) {
    system.skew.iter_mut().for_each(|entry| entry.2 = -entry.2);
    system.coupling.iter_mut().for_each(|of| std::mem::swap(&mut of.left, &mut of.right));
}
