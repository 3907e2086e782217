//! Journals of a run on several ranks: one file each.

use std::fs;
use std::path::{Path, PathBuf};

use rkpm::assembly::Ranks;
use rkpm::error::OutputError;
use rkpm::output::{Flush, Journal};
use rkpm::solve::{EquilibriumPath, Observer, State};

use crate::error::PetscError;
use crate::session::Session;

/// Journals of a run, one for each rank: `run.jsonl` becomes `run.0_of_2.jsonl` and `run.1_of_2.jsonl`. Each holds the
/// displacements of all and the condensed unknowns of its rank; together they resume the run on as many ranks, bit for bit.
#[derive(Debug)]
pub struct Journals;

impl Journals {
    /// The file of this rank.
    pub fn file(session: &Session, path: impl AsRef<Path>) -> PathBuf {
        name(path.as_ref(), session.rank(), session.count())
    }

    /// Begins the journal of this rank.
    ///
    /// # Errors
    /// As [`Journal::create`].
    pub fn create(session: &Session, path: impl AsRef<Path>, start: &State) -> Result<Journal, OutputError> {
        Journal::create(Self::file(session, path), start)
    }

    /// Opens the journals to go on with, and the path up to the last step that all ranks have recorded: what some have beyond
    /// it is taken again.
    ///
    /// # Errors
    /// Where the run was recorded on another number of ranks, and as [`Journal::reopen`].
    pub fn reopen(
        session: &Session,
        path: impl AsRef<Path>,
    ) -> Result<(Journal, EquilibriumPath), Box<dyn std::error::Error + Send + Sync>> {
        let path = path.as_ref();
        let file = Self::file(session, path);
        if let (false, Some(recorded)) = (file.exists(), recorded(path)) {
            let given = session.count();
            return Err(PetscError::Partition { recorded, given }.into());
        }
        let mut so_far = Journal::read(&file)?;
        let mine = so_far.steps.len();
        let common = session.least(mine as f64) as usize;
        if mine > common {
            so_far.steps.truncate(common);
            let mut beside = file.clone().into_os_string();
            beside.push(".shorter");
            let beside = PathBuf::from(beside);
            // What is left of an attempt that was killed.
            let _ = fs::remove_file(&beside);
            let mut shorter = Journal::create(&beside, &so_far.start)?.flush(Flush::System);
            for step in &so_far.steps {
                if shorter.step(step).is_break() {
                    break;
                }
            }
            drop(shorter);
            fs::rename(&beside, &file)?;
        }
        Ok(Journal::reopen(&file)?)
    }
}

/// The file of a rank.
fn name(path: &Path, rank: usize, count: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!("{stem}.{rank}_of_{count}.{}", extension.to_string_lossy()),
        None => format!("{stem}.{rank}_of_{count}"),
    };
    path.with_file_name(name)
}

/// On how many ranks a run was recorded, where its first journal is there.
fn recorded(path: &Path) -> Option<usize> {
    (1..=4096).find(|&count| name(path, 0, count).exists())
}
