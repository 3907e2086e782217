//! The journal of a run: one line per converged step, written while it runs, read and resumed after it was killed.
//!
//! A journal is a text file of JSON lines, each with a checksum over its record:
//! ```text
//! {"check":"<16 hex digits>","record":{"start":{"version":3,"state":{…}}}}
//! {"check":"<16 hex digits>","record":{"step":{"state":{…},"iterations":5,…}}}
//! {"check":"<16 hex digits>","record":{"end":{"ending":"Completed",…}}}
//! ```
//! Numbers are spelt with the fewest digits that read back to the same bits. The file appears with its first
//! line complete; each step is handed to the system in one piece before the analysis goes on. So whenever the
//! process dies, the file holds every converged step but at most a piece of the last, which a reader ignores.
//!
//! A history of stages has one journal: behind the `end` of a completed stage stands the `start` of the next, each with the name of its
//! stage (`"start":{"version":3,"stage":"release","state":{…}}`). `Stages::run_journaled` writes and resumes it.
//!
//! ```
//! use rkpm::output::Journal;
//! use rkpm::prelude::*;
//! # let folder = std::env::temp_dir().join(format!("rkpm-journal-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder).unwrap();
//! let file = folder.join("tube.jsonl");
//! let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, Rubber::neo_hookean(0.373, 1e5)?);
//! let problem = tube.pressure(Side::Min, 0.1).discretize(&Scheme::default().particles([5]))?;
//! let mut journal = Journal::create(&file, &problem.at_rest())?;
//! let path = problem.run_with(&mut journal)?;
//! journal.close(&path)?;
//! assert_eq!(Journal::read(&file)?, path);
//! // After a kill: what there is, and on.
//! let (mut journal, so_far) = Journal::reopen(&file)?;
//! let path = problem.resume(so_far, &mut journal)?;
//! journal.close(&path)?;
//! # std::fs::remove_dir_all(&folder).unwrap();
//! # Ok::<(), rkpm::Error>(())
//! ```

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path as FilePath, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::OutputError;
use crate::solve::{Ending, EquilibriumPath, Observer, State, Step};

/// The layout of the records; files of others are refused.
const VERSION: u32 = 3;
/// What stands before and behind the checksum and behind the record on every line.
const BEFORE: &str = "{\"check\":\"";
const BETWEEN: &str = "\",\"record\":";
const BEHIND: &str = "}\n";
/// Hexadecimal digits of a checksum.
const DIGITS: usize = 16;

/// How far a record is brought before the analysis goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Flush {
    /// To the disk (`fsync`): it survives a loss of power, and costs some milliseconds a step.
    #[default]
    Disk,
    /// To the operating system: it survives the death of the process, however sudden.
    System,
}

#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum Line<'a> {
    Start {
        version: u32,
        #[serde(skip_serializing_if = "Option::is_none")]
        stage: Option<&'a str>,
        state: &'a State,
    },
    Step(&'a Step),
    End {
        ending: &'a Ending,
        iterations: usize,
        rejected: usize,
    },
}

impl Line<'_> {
    /// Refuses a state that could not be read back: JSON has no word for numbers that are not finite.
    fn check(&self) -> std::io::Result<()> {
        let state = match self {
            Line::Start { state, .. } => *state,
            Line::Step(step) => &step.state,
            Line::End { .. } => return Ok(()),
        };
        match state.numbers().find(|number| !number.is_finite()) {
            None => Ok(()),
            Some(number) => Err(std::io::Error::new(
                std::io::ErrorKind::InvalidInput,
                format!("a number of the state is {number}: only finite ones can be read back and gone on with"),
            )),
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Record {
    Start {
        version: u32,
        #[serde(default)]
        stage: Option<String>,
        state: State,
    },
    Step(Step),
    End {
        ending: Ending,
        iterations: usize,
        rejected: usize,
    },
}

/// Writes a run to a file while it runs: an [`Observer`] to hand to it, beside another one as `(&mut journal, other)`.
///
/// Where the disk refuses, the run stops with [`Ending::Stopped`] and [`close`](Journal::close) says why.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    flush: Flush,
    /// Buffer of a line.
    line: Vec<u8>,
    failure: Option<std::io::Error>,
}

impl Journal {
    /// Begins a journal with the first state of a run, with the directories above it.
    ///
    /// # Errors
    /// [`OutputError::Io`] where the file exists — it may be all that is left of a run: resume or remove
    /// it —, where a number of the state is not finite, and where the file system refuses.
    pub fn create(path: impl AsRef<FilePath>, start: &State) -> Result<Self, OutputError> {
        Journal::create_for(path.as_ref(), None, start)
    }

    /// Starts the journal of a run, or of the first stage of a history.
    pub(crate) fn create_for(path: &FilePath, stage: Option<&str>, start: &State) -> Result<Self, OutputError> {
        let refused = |source| io_error(path, source);
        let holders = holders(path);
        if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            fs::create_dir_all(parent).map_err(refused)?;
        }
        ensure!(
            !path.try_exists().map_err(refused)?,
            refused(std::io::Error::new(
                std::io::ErrorKind::AlreadyExists,
                "a journal of this name exists: resume it, or remove it first"
            ))
        );
        // The first line is written under another name: whoever finds the file finds it complete.
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".new");
        let beside = path.with_file_name(name);
        let file = File::create(&beside).map_err(refused)?;
        let mut journal =
            Journal { file, path: path.to_path_buf(), flush: Flush::default(), line: Vec::new(), failure: None };
        journal.append(&Line::Start { version: VERSION, stage, state: start }).map_err(refused)?;
        fs::rename(&beside, path).map_err(refused)?;
        holders.iter().try_for_each(|holder| sync_directory(holder)).map_err(refused)?;
        Ok(journal)
    }

    /// Opens a journal to go on with: the path it holds, and the journal behind its last whole record.
    ///
    /// # Errors
    /// As [`read`](Journal::read), and where the file can't be written to.
    pub fn reopen(path: impl AsRef<FilePath>) -> Result<(Self, EquilibriumPath), OutputError> {
        let path = path.as_ref();
        let (runs, length) = read(path)?;
        let so_far = only(path, runs)?;
        Ok((Journal::behind(path, length)?, so_far))
    }

    /// The same for a history: its stages so far.
    pub(crate) fn reopen_stages(path: &FilePath) -> Result<(Self, Vec<(String, EquilibriumPath)>), OutputError> {
        let (runs, length) = read(path)?;
        let stages = named(path, runs)?;
        Ok((Journal::behind(path, length)?, stages))
    }

    /// The journal behind the whole records of a file.
    fn behind(path: &FilePath, length: u64) -> Result<Self, OutputError> {
        let refused = |source| io_error(path, source);
        let mut file = OpenOptions::new().write(true).open(path).map_err(refused)?;
        file.set_len(length).map_err(refused)?;
        file.seek(SeekFrom::End(0)).map_err(refused)?;
        Ok(Journal { file, path: path.to_path_buf(), flush: Flush::default(), line: Vec::new(), failure: None })
    }

    /// The path that a journal holds, also of a run that still goes on; a torn last record is left out.
    ///
    /// The ending is [`Ending::Interrupted`] where none was written.
    ///
    /// # Errors
    /// [`OutputError::Io`] where the file can't be read, [`OutputError::Journal`] where it is no journal or that of stages, or
    /// whole records stand behind a damaged one.
    pub fn read(path: impl AsRef<FilePath>) -> Result<EquilibriumPath, OutputError> {
        let path = path.as_ref();
        only(path, read(path)?.0)
    }

    /// The stages that the journal of a history holds, by name, as [`read`](Journal::read) does the path of a single run.
    ///
    /// # Errors
    /// As [`read`](Journal::read), and for the journal of a run without stages.
    pub fn read_stages(path: impl AsRef<FilePath>) -> Result<Vec<(String, EquilibriumPath)>, OutputError> {
        let path = path.as_ref();
        named(path, read(path)?.0)
    }

    /// Sets how far a record is brought before the analysis goes on.
    #[must_use]
    pub fn flush(mut self, flush: Flush) -> Self {
        self.flush = flush;
        self
    }

    /// Writes how the run ended.
    ///
    /// # Errors
    /// [`OutputError::Io`] where the file system refused this or any earlier record.
    pub fn close(mut self, path: &EquilibriumPath) -> Result<(), OutputError> {
        self.end(path)
    }

    /// Starts the record of a later stage.
    pub(crate) fn begin(&mut self, stage: &str, start: &State) -> Result<(), OutputError> {
        self.append(&Line::Start { version: VERSION, stage: Some(stage), state: start })
            .map_err(|source| io_error(&self.path, source))
    }

    /// Writes how a run or a stage ended.
    pub(crate) fn end(&mut self, path: &EquilibriumPath) -> Result<(), OutputError> {
        if let Some(failure) = self.failure.take() {
            return Err(io_error(&self.path, failure));
        }
        let EquilibriumPath { ending, iterations, rejected, .. } = path;
        self.append(&Line::End { ending, iterations: *iterations, rejected: *rejected })
            .map_err(|source| io_error(&self.path, source))
    }

    /// Appends a record in one piece.
    fn append(&mut self, record: &Line<'_>) -> std::io::Result<()> {
        record.check()?;
        self.line.clear();
        self.line.extend_from_slice(BEFORE.as_bytes());
        self.line.extend_from_slice(&[b'0'; DIGITS]);
        self.line.extend_from_slice(BETWEEN.as_bytes());
        let body = self.line.len();
        serde_json::to_writer(&mut self.line, record)?;
        let check = format!("{:016x}", checksum(&self.line[body..]));
        self.line[BEFORE.len()..BEFORE.len() + DIGITS].copy_from_slice(check.as_bytes());
        self.line.extend_from_slice(BEHIND.as_bytes());
        self.file.write_all(&self.line)?;
        match self.flush {
            Flush::Disk => self.file.sync_data(),
            Flush::System => Ok(()),
        }
    }
}

impl Observer for Journal {
    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        if self.failure.is_none() {
            self.failure = self.append(&Line::Step(step)).err();
        }
        if self.failure.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// The directories that get a new entry when a file is made with the directories above it, the lowest first.
fn holders(path: &FilePath) -> Vec<PathBuf> {
    let named = |holder: &FilePath| {
        if holder.as_os_str().is_empty() { PathBuf::from(".") } else { holder.to_path_buf() }
    };
    let mut holders = Vec::new();
    for holder in path.ancestors().skip(1) {
        holders.push(named(holder));
        if named(holder).exists() {
            break;
        }
    }
    holders
}

/// Brings the entries of a directory to the disk: without them a file may be gone after a loss of power though its contents are
/// there.
#[cfg(unix)]
fn sync_directory(directory: &FilePath) -> std::io::Result<()> {
    File::open(directory)?.sync_all()
}

/// Other systems have no such call: entries follow the files.
#[cfg(not(unix))]
fn sync_directory(_: &FilePath) -> std::io::Result<()> {
    Ok(())
}

fn io_error(path: &FilePath, source: std::io::Error) -> OutputError {
    OutputError::Io { path: path.display().to_string(), source }
}

/// FNV-1a in 64 bits (offset basis and prime of Fowler, Noll and Vo).
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The record of a whole line, or what is wrong with it.
fn parse(line: &[u8]) -> Result<Record, String> {
    let damaged = || "no whole record with its checksum".to_string();
    let rest = line.strip_prefix(BEFORE.as_bytes()).ok_or_else(damaged)?;
    let (check, rest) = rest.split_at_checked(DIGITS).ok_or_else(damaged)?;
    let rest = rest.strip_prefix(BETWEEN.as_bytes()).ok_or_else(damaged)?;
    let body = rest.strip_suffix(BEHIND.as_bytes()).ok_or_else(damaged)?;
    ensure!(check == format!("{:016x}", checksum(body)).as_bytes(), "the checksum does not fit the record");
    serde_json::from_slice(body).map_err(|e| e.to_string())
}

/// A run, or a stage of a history, as it stands in a journal.
struct Recorded {
    stage: Option<String>,
    path: EquilibriumPath,
}

/// The path of a journal without stages.
fn only(path: &FilePath, runs: Vec<Recorded>) -> Result<EquilibriumPath, OutputError> {
    let wrong = |what: &str| OutputError::Journal { path: path.display().to_string(), line: 0, what: what.into() };
    match runs.into_iter().next() {
        Some(Recorded { stage: None, path }) => Ok(path),
        Some(_) => Err(wrong("a journal of stages: read it by Journal::read_stages, go on by Stages::run_journaled")),
        None => Err(wrong("the file is empty")),
    }
}

/// The stages of a journal of a history.
fn named(path: &FilePath, runs: Vec<Recorded>) -> Result<Vec<(String, EquilibriumPath)>, OutputError> {
    let what = "a journal of a run without stages: read it by Journal::read, go on by Journal::reopen";
    let wrong = || OutputError::Journal { path: path.display().to_string(), line: 0, what: what.into() };
    runs.into_iter().map(|run| Ok((run.stage.ok_or_else(wrong)?, run.path))).collect()
}

/// Adds a record to the runs so far, or says why it can't follow them.
fn follow(runs: &mut Vec<Recorded>, record: Record) -> Result<(), String> {
    match (runs.last_mut(), record) {
        (_, Record::Start { version, .. }) if version != VERSION => {
            return Err(format!(
                "version {version} of the layout, this crate reads {VERSION}: run the analysis anew, or read it with the crate that wrote it"
            ));
        }
        (None, Record::Start { stage, state, .. }) => runs.push(Recorded { stage, path: EquilibriumPath::from(state) }),
        (None, _) => return Err("the first record is not the start of a run".into()),
        (Some(before), Record::Start { stage, state, .. }) => {
            ensure!(before.stage.is_some() && stage.is_some(), "a second start");
            ensure!(before.path.ending == Ending::Completed, "a stage behind one that was not completed");
            runs.push(Recorded { stage, path: EquilibriumPath::from(state) });
        }
        (Some(Recorded { path, .. }), Record::Step(step)) => {
            path.steps.push(step);
            // Behind an ending, this is a run that was resumed; its own ending follows.
            path.ending = Ending::Interrupted;
        }
        (Some(Recorded { path, .. }), Record::End { ending, iterations, rejected }) => {
            (path.ending, path.iterations, path.rejected) = (ending, iterations, rejected);
        }
    }
    Ok(())
}

/// The runs in a file, at least one, and the length of its whole records.
fn read(path: &FilePath) -> Result<(Vec<Recorded>, u64), OutputError> {
    let refused = |source| io_error(path, source);
    let wrong = |line: usize, what: String| OutputError::Journal { path: path.display().to_string(), line, what };
    let file = File::open(path).map_err(refused)?;
    // A device or a pipe may never end.
    ensure!(file.metadata().map_err(refused)?.is_file(), wrong(0, "not a file".into()));
    let mut reader = BufReader::new(file);
    let mut runs: Vec<Recorded> = Vec::new();
    let mut length = 0;
    let mut damage: Option<(usize, String)> = None;
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let bytes = reader.read_until(b'\n', &mut line).map_err(refused)?;
        if bytes == 0 {
            break;
        }
        let record = match parse(&line) {
            Ok(record) => record,
            Err(what) => {
                damage.get_or_insert((number, what));
                continue;
            }
        };
        // Nothing is torn in the middle of a file.
        if let Some((number, what)) = damage {
            return Err(wrong(number, format!("{what}; the lines before it are sound: keep them alone to go on")));
        }
        follow(&mut runs, record).map_err(|what| wrong(number, what))?;
        length += bytes as u64;
    }
    match (runs.last_mut(), damage) {
        (Some(Recorded { path, .. }), _) => {
            if path.ending == Ending::Interrupted {
                (path.iterations, path.rejected) = path.spent();
            }
            Ok((runs, length))
        }
        (None, Some((number, what))) => Err(wrong(number, what)),
        (None, None) => Err(wrong(0, "the file is empty".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_directory_with_a_new_entry_is_known() {
        let there = std::env::temp_dir();
        let file = there.join("rkpm-no-such-directory/a/run.jsonl");
        let expected = ["rkpm-no-such-directory/a", "rkpm-no-such-directory", ""].map(|name| there.join(name));
        assert_eq!(holders(&file), expected);
        assert_eq!(holders(FilePath::new("run.jsonl")), [PathBuf::from(".")]);
        assert_eq!(holders(&there.join("run.jsonl")), std::slice::from_ref(&there));
        assert!(holders(&file).iter().skip(2).all(|holder| sync_directory(holder).is_ok()));
    }
}
