//! The linearised system at a state.

use crate::assembly::{Assembler, Model, System, release};
use crate::boundary::Enforced;
use crate::error::Cause;
use crate::linear::{LinearSolver, LinearSystem};
use crate::term::{Product, Zone};

use super::active_set::shift_diagonal;
use super::increment::Linear;
use super::rejection::Rejection;
use super::state::State;

/// The product of a zone's condensed unknowns with a vector.
type Multiply<'a> = Box<dyn Fn(&Zone, &[f64], &mut Product) + Sync + 'a>;

/// Conditions and solver bound to the pattern of a model; buffers are kept from one state to the next.
pub(crate) struct Tangent<'a> {
    model: &'a Model,
    product: Multiply<'a>,
    pub enforced: Box<dyn Enforced>,
    solver: Box<dyn LinearSolver>,
    system: System,
    values: Vec<f64>,
}

impl<'a> Tangent<'a> {
    pub(crate) fn new(model: &'a Model, enforced: Box<dyn Enforced>, solver: Box<dyn LinearSolver>) -> Self {
        let product = Box::new(|zone: &Zone, x: &[f64], product: &mut Product| model.multiply_zone(zone, x, product));
        Tangent { model, product, enforced, solver, system: System::default(), values: Vec::new() }
    }

    /// Forms and factorises the reduced matrix at a state, `shift` times the median of its diagonal added to it.
    /// `right_hand_sides` are written while the full matrix is there, which conditions need for theirs.
    pub(super) fn linearise(
        &mut self,
        assembler: &mut Assembler,
        state: &State,
        shift: f64,
        right_hand_sides: impl FnOnce(&dyn Enforced, &mut System),
    ) -> Result<Linear<'_>, Rejection> {
        self.make_room();
        let Tangent { model, product, enforced, solver, system, values } = self;
        assembler.assemble_own(model, state.into(), system);
        if !system.scale.is_finite() {
            return Err(Cause::NotFinite.into());
        }
        if shift > 0.0 {
            let diagonal = assembler.pattern().columns.split_last().map_or(&[][..], |(_, columns)| columns);
            shift_diagonal(&mut system.values, diagonal, shift);
        }
        enforced.reduce(system, values);
        right_hand_sides(&**enforced, system);
        system.release();
        let reduced =
            LinearSystem { skew: &system.skew, zones: &system.zones, product: &**product, ..LinearSystem::of(values) };
        // Solutions look at the matrix alone: the state moves on.
        let inertia = solver.factorize(&LinearSystem { state: state.into(), ..reduced })?;
        Ok(Linear { enforced: &**enforced, solver: &mut **solver, inertia, left: 0.0, system, reduced })
    }

    /// Bytes of the reduced matrix, a value and a row index for each entry, and of its factors, where the solver tells them.
    pub(super) fn bytes(&self) -> usize {
        let entry = size_of::<f64>() + size_of::<u32>();
        entry * self.enforced.pattern().entries() + self.solver.bytes().unwrap_or(0)
    }

    /// Gives back what large matrices and factors took before, and asks for the place of the reduced matrix first: the
    /// full one, which goes first, then lies above it and leaves no hole.
    fn make_room(&mut self) {
        self.solver.release();
        release(&mut self.values);
        self.values.clear();
        self.values.reserve_exact(self.enforced.pattern().entries());
    }
}
