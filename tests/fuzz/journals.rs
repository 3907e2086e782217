use std::fs;
use std::path::PathBuf;

use rkpm::output::Journal;
use rkpm::prelude::*;
use rkpm::solve::{State, Step, StepControlState};
use rkpm::term::TermState;

use super::harness::Input;

fn path(input: &mut Input) -> EquilibriumPath {
    let state = |input: &mut Input| State {
        displacement: (0..input.random.usize(0..4)).map(|_| input.good(-1.0, 1.0)).collect(),
        terms: vec![TermState { condensed: vec![0.5], history: vec![] }; input.random.usize(0..3)],
        load: input.good(0.0, 1.0),
        ..State::default()
    };
    let mut path = EquilibriumPath::from(state(input));
    for _ in 0..input.random.usize(0..4) {
        path.steps.push(Step {
            state: state(input),
            iterations: 3,
            rejected: 0,
            energy: input.number(0.0, 1.0),
            inertia: None,
            unstable: input.once_in(2).then_some(1),
            critical: Vec::new(),
            diagnostics: Default::default(),
            doubts: Vec::new(),
            control_state: StepControlState { increment: 0.5, ..StepControlState::default() },
        });
    }
    path
}

/// Bytes struck, doubled, cut and changed.
fn spoil(input: &mut Input, bytes: &mut Vec<u8>) {
    for _ in 0..input.random.usize(0..4) {
        if bytes.is_empty() {
            return;
        }
        let k = input.random.usize(0..bytes.len());
        match input.random.usize(0..6) {
            0 => bytes[k] = input.random.u8(..),
            1 => drop(bytes.remove(k)),
            2 => bytes.insert(k, bytes[k]),
            3 => bytes.truncate(k),
            4 => {
                let word = input.pick(&[
                    "1e999",
                    "-",
                    "[[[[[[[[",
                    "null",
                    "\"",
                    "18446744073709551616",
                    "NaN",
                    "{\"",
                    "\n",
                    "9e18",
                    "-0",
                    "\u{fffd}",
                ]);
                bytes.splice(k..k, word.bytes());
            }
            _ => {
                let end = (k + input.random.usize(0..40)).min(bytes.len());
                let piece = bytes[k..end].to_vec();
                bytes.splice(k..k, piece);
            }
        }
    }
}

pub fn records(input: &mut Input) {
    let path = path(input);
    let mut bytes = serde_json::to_vec(&path).unwrap();
    spoil(input, &mut bytes);
    if input.once_in(50) {
        bytes = vec![b'['; 100_000];
    }
    let _ = input.saw("json", String::from_utf8_lossy(&bytes).into_owned());
    let read: Result<EquilibriumPath, _> = serde_json::from_slice(&bytes);
    input.passed = read.is_ok();
    let _: Result<State, _> = serde_json::from_slice(&bytes);
}

/// FNV-1a, as the journal has it: a record that is spoilt and yet passes its checksum.
fn checked(body: &[u8]) -> Vec<u8> {
    let hash = body.iter().fold(0xcbf2_9ce4_8422_2325u64, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    let mut line = format!("{{\"check\":\"{hash:016x}\",\"record\":").into_bytes();
    line.extend_from_slice(body);
    line.extend_from_slice(b"}\n");
    line
}

pub fn journals(input: &mut Input) {
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("fuzz.jsonl");
    let path = path(input);
    let mut records =
        vec![format!("{{\"start\":{{\"version\":3,\"state\":{}}}}}", serde_json::to_string(&path.start).unwrap())];
    records.extend(path.steps.iter().map(|s| format!("{{\"step\":{}}}", serde_json::to_string(s).unwrap())));
    records.push("{\"end\":{\"ending\":\"Completed\",\"iterations\":3,\"rejected\":0}}".into());
    if input.once_in(3) {
        let k = input.random.usize(0..records.len());
        records.swap(0, k);
    }
    let mut bytes = Vec::new();
    for record in records {
        let mut body = record.into_bytes();
        if input.once_in(3) {
            spoil(input, &mut body);
        }
        bytes.extend(checked(&body));
    }
    if input.once_in(2) {
        spoil(input, &mut bytes);
    }
    let _ = input.saw("journal", String::from_utf8_lossy(&bytes).into_owned());
    fs::write(&file, &bytes).unwrap();
    let read = Journal::read(&file);
    if let Ok((journal, so_far)) = Journal::reopen(&file) {
        assert_eq!(format!("{:?}", read.unwrap()), format!("{so_far:?}"));
        drop(journal.close(&so_far));
        assert!(Journal::read(&file).is_ok());
        input.passed = true;
    }
}
