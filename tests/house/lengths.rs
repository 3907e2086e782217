//! A file has one purpose, and at most 400 lines.

use std::fs;
use std::path::Path;

use crate::floors::files;

const MOST: usize = 400;

#[test]
fn files_are_short() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    assert!(paths.len() > 100, "{} files found", paths.len());
    let mut longer = Vec::new();
    for path in paths {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
        if lines > MOST {
            longer.push(format!("{name}: {lines}"));
        }
    }
    assert!(longer.is_empty(), "split by purpose: {longer:?}");
}
