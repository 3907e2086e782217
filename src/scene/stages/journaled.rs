//! A history with one journal of all stages.

use std::path::Path;

use crate::error::{Error, OutputError};
use crate::output::Journal;
use crate::scene::Scheme;
use crate::solve::Observer;

use super::{StagePath, Stages};

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
    ) -> Result<Vec<StagePath<D>>, Error> {
        let file = file.as_ref();
        let exists =
            file.try_exists().map_err(|source| OutputError::Io { path: file.display().to_string(), source })?;
        let (mut journal, given) = match exists.then(|| Journal::reopen_stages(file)).transpose()? {
            Some((journal, given)) => (Some(journal), given),
            None => (None, Vec::new()),
        };
        let (known, paths): (Vec<String>, Vec<_>) = given.into_iter().unzip();
        if let Some(k) = (0..known.len()).find(|&k| self.names().nth(k) != Some(&known[k])) {
            let own = self.names().nth(k).map_or("has no such stage".into(), |own| format!("calls it {own}"));
            let what = format!(
                "stage {k} of the journal is {}, the history {own}: resume with the history that it was recorded with",
                known[k]
            );
            return Err(OutputError::Journal { path: file.display().to_string(), line: 0, what }.into());
        }
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
}
