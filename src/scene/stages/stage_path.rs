//! What a stage has come to.

use std::fmt;

use crate::each::Each;
use crate::error::Error;
use crate::output::{PvdCollection, Table, check_ending};
use crate::scene::Problem;
use crate::solve::EquilibriumPath;

/// A stage that was run: its name, its problem, and its path from load factor 0.
pub struct StagePath<const D: usize> {
    /// The name of the stage.
    pub name: String,
    /// The scene of the stage under the scheme, of which results are asked.
    pub problem: Problem<D>,
    /// The path.
    pub path: EquilibriumPath,
}

/// Why a history could not go on, and the stages before.
#[derive(thiserror::Error)]
#[error("{error}")]
pub struct BrokenHistory<const D: usize> {
    /// The stages that were run, all with an answer.
    pub stages: Vec<StagePath<D>>,
    /// Why the next one could not be discretised, begun or run.
    pub error: Box<Error>,
}

impl<const D: usize> From<Error> for BrokenHistory<D> {
    /// Before the first stage.
    fn from(error: Error) -> Self {
        BrokenHistory { stages: Vec::new(), error: Box::new(error) }
    }
}

impl<const D: usize> From<BrokenHistory<D>> for Error {
    fn from(broken: BrokenHistory<D>) -> Self {
        *broken.error
    }
}

/// Without the states, which fill pages where a program unwraps the result.
impl<const D: usize> fmt::Debug for BrokenHistory<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BrokenHistory")
            .field("error", &self.error)
            .field("stages", &self.stages.mapped(|stage| &stage.name))
            .finish()
    }
}

/// The tables of [`Problem::history`] of stages in one: the number of the stage, counted from 0, stands first; places that a stage
/// does not know are NaN in its rows.
///
/// # Errors
/// As [`Problem::history`].
pub fn history<const D: usize>(stages: &[StagePath<D>]) -> Result<Table, Error> {
    let each = stages.try_mapped(|stage| stage.problem.history(&stage.path))?;
    let mut header = vec!["stage".to_string()];
    for name in each.iter().flat_map(|table| &table.header) {
        if !header.contains(name) {
            header.push(name.clone());
        }
    }
    let mut whole = Table::new(header.clone());
    for (number, table) in each.iter().enumerate() {
        let places: Vec<Option<usize>> = header.mapped(|name| table.header.iter().position(|own| own == name));
        for values in &table.rows {
            let value = |(k, place): (usize, &Option<usize>)| match place {
                Some(place) => values[*place].clone(),
                None => if k == 0 { number as f64 } else { f64::NAN }.into(),
            };
            let row: Vec<crate::output::Cell> = places.iter().enumerate().map(value).collect();
            whole.push(row)?;
        }
    }
    Ok(whole)
}

/// Writes the paths of stages as [`Problem::write`] does one: `fit.pvd` with a `.vtu` file for each state of each stage, and
/// [`history`] as `fit.csv`. The first state of a later stage, with which the one before has ended, is a row of the table and has no file. Time is that of the scene's clock where all stages have one, else the number of the stage and the load factor within it.
///
/// # Errors
/// As [`Problem::write`].
pub fn write_stages<const D: usize>(stages: &[StagePath<D>], file: impl AsRef<std::path::Path>) -> Result<(), Error> {
    let file = file.as_ref();
    check_ending(file, &["pvd"])?;
    let mut films = PvdCollection::default();
    let timed = stages.iter().all(|stage| stage.problem.model.has_clock());
    for (number, StagePath { problem, path, .. }) in stages.iter().enumerate() {
        // A stage begins in the state in which the one before has ended.
        let first = usize::from(number > 0);
        let since = (!timed).then_some(number as f64);
        problem.write_states(path, first, file, &format!("_{number}"), since, &mut films)?;
    }
    let table = history(stages)?;
    if stages.iter().all(|stage| stage.problem.writes_for_all()) {
        films.write(file.with_extension("pvd"))?;
        table.write(file.with_extension("csv"))?;
    }
    Ok(())
}
