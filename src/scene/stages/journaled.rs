//! A history with one journal of all stages.

use std::path::Path;

use crate::error::{Error, OutputError};
use crate::output::Journal;
use crate::scene::Scheme;
use crate::solve::{EquilibriumPath, Observer};

use super::{BrokenHistory, StagePath, Stages};

/// A journal that exists, and the stages that it holds.
type Opened = (Option<Journal>, Vec<(String, EquilibriumPath)>);

impl<const D: usize> Stages<D> {
    /// Runs the history with one [`Journal`] of all stages, watched by an observer. Where the file exists it goes on with what it holds,
    /// whenever that run was broken off: with the same bits as if it had never been. [`Journal::read_stages`] reads the file,
    /// also while the history runs.
    ///
    /// # Errors
    /// As [`resume`](Stages::resume), where the file is no journal of stages with these names, and where the file system refuses.
    pub fn run_journaled(
        &self,
        scheme: &Scheme,
        file: impl AsRef<Path>,
        observer: &mut dyn Observer,
    ) -> Result<Vec<StagePath<D>>, BrokenHistory<D>> {
        let file = file.as_ref();
        let (mut journal, given) = self.opened(file)?;
        let (known, paths): (Vec<String>, Vec<_>) = given.into_iter().unzip();
        self.go_on(scheme, paths, |stage, problem, path| {
            let journal = match &mut journal {
                Some(journal) => {
                    if !known.iter().any(|other| other == stage) {
                        journal.begin(stage, &path.start)?;
                    }
                    journal
                }
                None => journal.insert(Journal::create_for(file, Some(stage), &path.start)?),
            };
            let path = problem.resume(path, &mut (&mut *journal, &mut *observer))?;
            journal.end(&path)?;
            Ok(path)
        })
    }

    /// The journal of a file, where it exists and is one of this history.
    fn opened(&self, file: &Path) -> Result<Opened, Error> {
        let io = |source| OutputError::Io { path: file.display().to_string(), source };
        if !file.try_exists().map_err(io)? {
            return Ok((None, Vec::new()));
        }
        let (journal, given) = Journal::reopen_stages(file)?;
        if let Some(k) = (0..given.len()).find(|&k| self.names().nth(k) != Some(&given[k].0)) {
            let own = self.names().nth(k).map_or("has no such stage".into(), |own| format!("calls it {own}"));
            let what = format!(
                "stage {k} of the journal is {}, the history {own}: resume with the history that it was recorded with",
                given[k].0
            );
            return Err(OutputError::Journal { path: file.display().to_string(), line: 0, what }.into());
        }
        Ok((Some(journal), given))
    }
}
