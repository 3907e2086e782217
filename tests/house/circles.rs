//! No circles: what a file imports does not import it back, by no way.
//!
//! A `mod.rs` that hands on what its files define is no import of them: paths are followed to the file that defines the
//! item.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::floors::{bare, files};

type Module = Vec<String>;

/// The imports of a file and what it hands on by another path.
#[derive(Default)]
struct File {
    imports: BTreeSet<Module>,
    handed_on: BTreeMap<String, Module>,
}

fn identifier(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The single paths of a `use` tree with the names that they get.
fn expand(tree: &str, prefix: &str, out: &mut Vec<(String, String)>) {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else {
        let (path, name) = tree.split_once(" as ").unwrap_or((tree, ""));
        let full = format!("{prefix}{}", path.trim());
        let last = full.rsplit("::").next().unwrap_or("").to_string();
        out.push((full, if name.is_empty() { last } else { name.trim().to_string() }));
        return;
    };
    let (inner, prefix) =
        (&tree[open + 1..tree.rfind('}').unwrap_or(tree.len())], format!("{prefix}{}", &tree[..open]));
    let (mut depth, mut start) = (0, 0);
    for (at, c) in inner.char_indices().chain([(inner.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !inner[start..at].trim().is_empty() {
                    expand(&inner[start..at], &prefix, out);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// A path from the root of the crate, where it leads into it.
fn absolute(path: &str, module: &Module, modules: &BTreeSet<Module>) -> Option<Module> {
    let mut segments: Vec<&str> = path.split("::").map(str::trim).filter(|s| !s.is_empty()).collect();
    let mut base = match *segments.first()? {
        "crate" => Vec::new(),
        "self" => module.clone(),
        "super" => {
            let mut base = module.clone();
            while segments.get(1) == Some(&"super") {
                base.pop();
                segments.remove(0);
            }
            base.pop();
            base
        }
        first => {
            let child: Module = module.iter().cloned().chain([first.to_string()]).collect();
            if !modules.contains(&child) {
                return None;
            }
            return Some(module.iter().cloned().chain(segments.iter().map(|s| s.to_string())).collect());
        }
    };
    base.extend(segments[1..].iter().filter(|s| **s != "*" && **s != "self").map(|s| s.to_string()));
    Some(base)
}

/// What a source without comments, strings and tests imports.
fn read(source: &str, module: &Module, modules: &BTreeSet<Module>) -> File {
    let mut file = File::default();
    let mut body = String::new();
    let mut rest = source;
    while let Some(at) = rest.find("use ") {
        let (before, from) = rest.split_at(at);
        if before.ends_with(identifier) {
            body.push_str(&rest[..at + 4]);
            rest = &from[4..];
            continue;
        }
        let end = from.find(';').unwrap_or(from.len() - 1);
        // Up to the `pub` of this line.
        let start = before.rfind(['\n', ';', '}']).map_or(0, |place| place + 1);
        let is_public = before[start..].contains("pub");
        body.push_str(&before[..start]);
        let mut paths = Vec::new();
        expand(&from[4..end].replace('\n', " "), "", &mut paths);
        for (path, name) in paths {
            let Some(full) = absolute(&path, module, modules) else { continue };
            if is_public {
                file.handed_on.insert(name, full);
            } else {
                file.imports.insert(full);
            }
        }
        rest = &from[end + 1..];
    }
    body.push_str(rest);
    // Paths in the code itself.
    for path in body.split(|c: char| !identifier(c) && c != ':').filter(|path| path.contains("::")) {
        let path = path.trim_end_matches(':');
        if path.contains("::") {
            file.imports.extend(absolute(path, module, modules));
        }
    }
    file
}

/// The file that defines what a path names.
fn definition(path: &[String], all: &BTreeMap<Module, File>, depth: usize) -> Option<Module> {
    let length = (1..=path.len()).rev().find(|&length| all.contains_key(&path[..length]))?;
    let (module, item) = path.split_at(length);
    match item.first().and_then(|name| all[module].handed_on.get(name)) {
        Some(target) if depth < 8 => {
            let target: Module = target.iter().chain(&item[1..]).cloned().collect();
            definition(&target, all, depth + 1)
        }
        _ => Some(module.to_vec()),
    }
}

/// Groups of files that import each other, each in the order of names.
fn circles(sources: &BTreeMap<Module, String>) -> Vec<Vec<String>> {
    let modules: BTreeSet<Module> = sources.keys().cloned().collect();
    let all: BTreeMap<Module, File> =
        sources.iter().map(|(module, source)| (module.clone(), read(source, module, &modules))).collect();
    let names: Vec<&Module> = all.keys().collect();
    let place: BTreeMap<&Module, usize> = names.iter().enumerate().map(|(k, module)| (*module, k)).collect();
    // Who is reached from whom.
    let mut reached = vec![vec![false; names.len()]; names.len()];
    for (from, file) in all.values().enumerate() {
        for path in &file.imports {
            if let Some(to) = definition(path, &all, 0).map(|module| place[&module]).filter(|to| *to != from) {
                reached[from][to] = true;
            }
        }
    }
    for middle in 0..names.len() {
        for from in 0..names.len() {
            if reached[from][middle] {
                for to in 0..names.len() {
                    reached[from][to] |= reached[middle][to];
                }
            }
        }
    }
    let mut found: BTreeSet<Vec<String>> = BTreeSet::new();
    for a in 0..names.len() {
        if reached[a][a] {
            let group = (0..names.len()).filter(|&b| reached[a][b] && reached[b][a]);
            found.insert(group.map(|b| names[b].join("::")).collect());
        }
    }
    found.into_iter().collect()
}

fn module(place: &Path) -> Module {
    let mut module: Module =
        place.with_extension("").components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    if module.last().is_some_and(|last| last == "mod") {
        module.pop();
    }
    module
}

#[test]
fn no_files_import_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    let mut sources = BTreeMap::new();
    for path in paths {
        let module = module(path.strip_prefix(&root).unwrap());
        if module != ["lib"] && module.last().is_none_or(|last| last != "tests") {
            sources.insert(module, bare(&fs::read_to_string(&path).unwrap()));
        }
    }
    assert!(sources.len() > 100, "{} files found", sources.len());
    let found = circles(&sources);
    assert!(found.is_empty(), "these files import each other: {found:?}");
}

#[test]
fn circles_are_found_by_whatever_way() {
    let found = |files: &[(&str, &str)]| {
        let split = |name: &str| name.split("::").map(String::from).collect::<Module>();
        circles(&files.iter().map(|(name, source)| (split(name), source.to_string())).collect())
    };
    let circle = [vec!["a::one".to_string(), "b".to_string()]];
    // Through what another file hands on, through `super`, through a path in the code, in a group.
    let facade = ("a", "mod one; pub use one::{One, Other as Name};");
    assert_eq!(found(&[facade, ("a::one", "use crate::b::B;"), ("b", "use crate::a::One;")]), circle);
    assert_eq!(found(&[facade, ("a::one", "use super::super::b::B;"), ("b", "use crate::{c::C, a::{Name}};")]), circle);
    assert_eq!(found(&[facade, ("a::one", "fn f() -> crate::b::B { todo!() }"), ("b", "use crate::a::one;")]), circle);
    // A facade and its file are no circle, nor is a common leaf.
    assert!(found(&[facade, ("a::one", "use super::leaf::Leaf;"), ("a::leaf", "")]).is_empty());
    assert!(found(&[("a", "use crate::b::B;"), ("b", "use crate::c::C;"), ("c", "")]).is_empty());
}
