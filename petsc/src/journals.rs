//! Journals of a run on several ranks: one file each.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use rkpm::assembly::Ranks;
use rkpm::error::OutputError;
use rkpm::output::{Flush, Journal};
use rkpm::scene::{LocalOwnership, Problem};
use rkpm::solve::{EquilibriumPath, Observer};

use crate::error::PetscError;
use crate::pieces::{Piece, composed};
use crate::session::Session;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Journals of a run, one for each rank: `run.jsonl` becomes `run.0_of_2.jsonl` and `run.1_of_2.jsonl`. Each holds the
/// displacements of all and the condensed unknowns of its rank, and a file beside it, `run.0_of_2.jsonl.zones`, says of which zones.
/// Together they resume the run: to rounding, for factors over several ranks add up what arrives in any order.
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
    pub fn create<const D: usize>(
        session: &Session,
        path: impl AsRef<Path>,
        problem: &Problem<D>,
    ) -> Result<Journal, OutputError> {
        let file = Self::file(session, path);
        let journal = Journal::create(&file, &problem.at_rest())?;
        write_zones(&file, &problem.ownership())?;
        Ok(journal)
    }

    /// Opens the journals to go on with, and the path up to the last step that all ranks have recorded: what some have beyond
    /// it is taken again. Where journals of several numbers of ranks stand side by side, those that know the most steps are
    /// gone on with, and those of this number among equals.
    ///
    /// # Errors
    /// [`PetscError::Pieces`] where a journal of a set is missing, where they are of different runs or of another scene, and as
    /// [`Journal::reopen`].
    pub fn reopen<const D: usize>(
        session: &Session,
        path: impl AsRef<Path>,
        problem: &Problem<D>,
    ) -> Outcome<(Journal, EquilibriumPath)> {
        let path = path.as_ref();
        let file = Self::file(session, path);
        let own = problem.ownership();
        let recorded = chosen(session, path)?;
        let pieces: Outcome<Vec<Piece>> = (0..recorded)
            .map(|rank| {
                let file = name(path, rank, recorded);
                let name = file.display().to_string();
                Ok(Piece { name, ownership: zones(&file)?, path: Journal::read(&file)? })
            })
            .collect();
        let pieces = pieces?;
        let so_far = composed(&pieces, &own)?;
        // Nobody writes before all have read.
        session.least(0.0);
        let steps = so_far.steps.len();
        let stands = |piece: &Piece| piece.ownership == own && piece.path.steps.len() == steps;
        if recorded != session.count() || !pieces.get(session.rank()).is_some_and(stands) {
            write_zones(&file, &own)?;
            replace(&file, &so_far)?;
        }
        Ok(Journal::reopen(&file)?)
    }
}

/// Writes a journal anew, complete whenever its name is found.
fn replace(file: &Path, so_far: &EquilibriumPath) -> Outcome<()> {
    let beside = with_ending(file, ".shorter");
    // What is left of an attempt that was killed.
    let _ = fs::remove_file(&beside);
    let mut anew = Journal::create(&beside, &so_far.start)?.flush(Flush::System);
    for step in &so_far.steps {
        if anew.step(step).is_break() {
            anew.close(so_far)?;
            break;
        }
    }
    Ok(fs::rename(&beside, file)?)
}

/// Which zones a journal is about, beside it.
fn write_zones(file: &Path, ownership: &LocalOwnership) -> Result<(), OutputError> {
    let path = with_ending(file, ".zones");
    let refused = |source| OutputError::Io { path: path.display().to_string(), source };
    let text = serde_json::to_string(ownership).map_err(|error| refused(error.into()))?;
    fs::write(&path, text).map_err(refused)
}

fn zones(file: &Path) -> Result<LocalOwnership, PetscError> {
    let path = with_ending(file, ".zones");
    let text = fs::read_to_string(&path).map_err(|error| error.to_string());
    let read = text.and_then(|text| serde_json::from_str(&text).map_err(|error| error.to_string()));
    read.map_err(|error| PetscError::Pieces { what: format!("{}: {error}", path.display()) })
}

fn with_ending(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.to_path_buf().into_os_string();
    name.push(ending);
    PathBuf::from(name)
}

/// The file of a rank.
fn name(path: &Path, rank: usize, count: usize) -> PathBuf {
    let (stem, ending) = around(path);
    path.with_file_name(format!("{stem}.{rank}_of_{count}{ending}"))
}

/// What stands before and behind the numbers of a journal's name.
fn around(path: &Path) -> (String, String) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    (stem, path.extension().map_or_else(String::new, |extension| format!(".{}", extension.to_string_lossy())))
}

/// The ranks whose journals are there, by how many they were.
fn sets(path: &Path) -> BTreeMap<usize, BTreeSet<usize>> {
    let (stem, ending) = around(path);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut sets: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        let numbers = file.strip_prefix(&format!("{stem}.")).and_then(|rest| rest.strip_suffix(&ending));
        let Some((rank, count)) = numbers.and_then(|numbers| numbers.split_once("_of_")) else { continue };
        if let (Ok(rank), Ok(count)) = (rank.parse(), count.parse()) {
            sets.entry(count).or_default().insert(rank);
        }
    }
    sets
}

/// How many ranks recorded the journals to go on with: the first rank looks, and tells the others.
fn chosen(session: &Session, path: &Path) -> Outcome<usize> {
    let mut choice = [0.0];
    let found = if session.rank() == 0 { longest(session.count(), path) } else { Ok(0) };
    if let Ok(count) = found {
        choice[0] = count as f64;
    }
    session.sum(&mut choice);
    found?;
    match choice[0] as usize {
        0 => Err(PetscError::Pieces { what: "the first rank has refused them".into() }.into()),
        count => Ok(count),
    }
}

fn longest(own: usize, path: &Path) -> Outcome<usize> {
    let sets = sets(path);
    for (&count, ranks) in &sets {
        if let Some(missing) = (0..count).find(|rank| !ranks.contains(rank)) {
            let what = format!(
                "{} is missing: put it back, or take the others of its set away",
                name(path, missing, count).display()
            );
            return Err(PetscError::Pieces { what }.into());
        }
    }
    if let (1, Some(&count)) = (sets.len(), sets.keys().next()) {
        return Ok(count);
    }
    let mut best = None;
    for &count in sets.keys() {
        let mut steps = usize::MAX;
        for rank in 0..count {
            steps = steps.min(Journal::read(name(path, rank, count))?.steps.len());
        }
        best = best.max(Some((steps, count == own, count)));
    }
    let none = || PetscError::Pieces { what: format!("there is none at {}", path.display()) };
    Ok(best.map(|(_, _, count)| count).ok_or_else(none)?)
}
