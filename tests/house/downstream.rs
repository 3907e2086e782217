//! A crate that takes shape functions alone gets neither the solver's nor the threads' dependencies.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A copy of the downstream crate under the target folder, so that its lock file stays out of the sources;
/// with this crate's lock file, so that everything it needs has been downloaded already.
fn downstream() -> &'static Path {
    static COPY: OnceLock<PathBuf> = OnceLock::new();
    COPY.get_or_init(|| {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("downstream");
        fs::create_dir_all(copy.join("src")).unwrap();
        let source = root.join("tests/downstream");
        let manifest = fs::read_to_string(source.join("Cargo.toml")).unwrap();
        let manifest = manifest.replace("path = \"../..\"", &format!("path = {:?}", root.to_str().unwrap()));
        fs::write(copy.join("Cargo.toml"), manifest).unwrap();
        fs::copy(source.join("src/main.rs"), copy.join("src/main.rs")).unwrap();
        fs::copy(root.join("Cargo.lock"), copy.join("Cargo.lock")).unwrap();
        copy
    })
}

/// Runs cargo on the downstream crate, off the network and beside this crate's own build.
fn cargo(arguments: &[&str]) -> String {
    let crate_folder = downstream();
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .arg("--offline")
        .arg("--manifest-path")
        .arg(crate_folder.join("Cargo.toml"))
        .env("CARGO_TARGET_DIR", crate_folder.join("target"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "cargo {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn shape_functions_alone_need_neither_faer_nor_rayon() {
    let tree = cargo(&["tree", "--edges", "normal", "--prefix", "none", "--format", "{p}"]);
    let names: Vec<&str> = tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
    // Present, or the tree would have been read wrongly.
    for needed in ["downstream", "rkpm", "nalgebra"] {
        assert!(names.contains(&needed), "{needed} is not in the tree:\n{tree}");
    }
    for unwanted in ["faer", "rayon", "plotters"] {
        let found = names.iter().find(|name| **name == unwanted || name.starts_with(&format!("{unwanted}-")));
        assert!(found.is_none(), "{unwanted} is in the tree:\n{tree}");
    }
}

#[test]
fn ten_lines_evaluate_shape_functions() {
    let printed = cargo(&["run", "--quiet"]);
    assert!(printed.contains("particles reproduce"), "{printed}");
}
