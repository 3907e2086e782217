//! The floors: a module imports only from its own floor and those beneath it.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules by floor, lowest first, as `src/lib.rs` has them.
const FLOORS: [&[&str]; 12] = [
    &["error", "geometry", "tensor", "compiled", "dense", "each", "order", "parallel", "rows", "simd"],
    &["basis", "kernel", "kinematics", "material"],
    &["cells", "mesh", "neighbours", "particles", "quadrature", "solid"],
    &["shape"],
    &["table"],
    &["term", "contact"],
    &["assembly"],
    &["boundary", "linear"],
    &["solve", "paper"],
    &["output"],
    &["scene"],
    &["study", "check", "fit"],
];

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|modules| modules.contains(&module))
}

/// All Rust files beneath a folder.
pub fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// A source without comments, strings' contents and test modules, line breaks kept.
pub fn bare(source: &str) -> String {
    let mut bare = String::new();
    let mut rest = source;
    while let Some(c) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("/*") {
            rest = &rest[rest.find("*/").map_or(rest.len(), |end| end + 2)..];
        } else if let Some(inner) = rest.strip_prefix('"') {
            let mut escaped = false;
            let end = inner.find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            bare.push_str("\"\"");
            rest = end.map_or("", |end| &inner[end + 1..]);
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\\"'") {
            rest = &rest[rest[1..].find('\'').map_or(rest.len(), |end| end + 2)..];
        } else {
            bare.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    without_tests(&bare)
}

/// Cuts out the block that follows each `#[cfg(test)]`.
fn without_tests(source: &str) -> String {
    let mut out = String::new();
    let mut rest = source;
    while let Some(start) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..start]);
        let block = &rest[start..];
        let mut depth = 0;
        let end = block.char_indices().find_map(|(at, c)| {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            let ends = depth == 0 && (c == '}' || c == ';');
            ends.then_some(at + 1)
        });
        rest = &block[end.unwrap_or(block.len())..];
    }
    out.push_str(rest);
    out
}

/// The first segments of all `crate::…` paths, also of groups `crate::{a::…, b::…}`.
fn imports(bare: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in bare.match_indices("crate::") {
        let identifier = |c: char| c.is_alphanumeric() || c == '_';
        if bare[..at].ends_with(identifier) {
            continue;
        }
        let path = &bare[at + "crate::".len()..];
        let Some(group) = path.strip_prefix('{') else {
            found.push(path.split(|c| !identifier(c)).next().unwrap_or("").to_string());
            continue;
        };
        let (mut depth, mut segment) = (0, String::new());
        for c in group.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => found.push(std::mem::take(&mut segment)),
                c if depth == 0 && !c.is_whitespace() => segment.push(c),
                _ => {}
            }
        }
        found.push(segment);
    }
    found.retain(|segment| !segment.is_empty());
    found.iter().map(|s| s.split("::").next().unwrap_or("").to_string()).collect()
}

/// What a module may not import.
fn violations(module: &str, source: &str) -> Vec<String> {
    let Some(own) = floor(module) else { return vec![format!("module {module} stands on no floor")] };
    let mut violations = Vec::new();
    for import in imports(&bare(source)) {
        match floor(&import) {
            Some(theirs) if theirs > own => {
                violations.push(format!("{module} (floor {own}) imports {import} (floor {theirs})"));
            }
            Some(_) => {}
            // The umbrella error is named at the root by the public API; it lives on floor 0.
            None if import == "Error" => {}
            None => violations.push(format!("{module} imports {import}, which stands on no floor")),
        }
    }
    violations
}

#[test]
fn no_module_imports_from_a_floor_above() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut sources = Vec::new();
    files(&root, &mut sources);
    assert!(sources.len() > 30, "{} files found", sources.len());
    let mut all = Vec::new();
    for path in sources {
        let place = path.strip_prefix(&root).unwrap();
        let first = place.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = first.strip_suffix(".rs").unwrap_or(first);
        // The root re-exports everything.
        if module == "lib" {
            continue;
        }
        for violation in violations(module, &fs::read_to_string(&path).unwrap()) {
            all.push(format!("{}: {violation}", place.display()));
        }
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn every_module_of_the_root_stands_on_a_floor() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs");
    let source = bare(&fs::read_to_string(root).unwrap());
    let mut before = 0;
    for line in source.lines().map(str::trim) {
        let Some(name) = line.strip_prefix("pub mod ").or(line.strip_prefix("mod ")) else { continue };
        // `pub mod prelude { … }` is no floor: it has a body.
        let Some(name) = name.strip_suffix(';') else { continue };
        let floor = floor(name).unwrap_or_else(|| panic!("module {name} stands on no floor"));
        assert!(floor >= before, "{name}: lib.rs lists the floors from the lowest up");
        before = floor;
    }
    assert!(before >= 10);
}

#[test]
fn upward_imports_are_found_wherever_they_hide() {
    let upward = [
        "use crate::scene::Scene;",
        "use crate::{error::Error, solve::{Analysis, Path}};",
        "fn f() -> crate::term::Body<2, ()> { todo!() }",
        "pub(crate) use crate::table::ShapeTable;",
        "const A: &str = \"a \\\" // b\"; use crate::linear::Direct;",
        "#[cfg(test)] mod tests { use crate::scene::Scene; } use crate::assembly::Model;",
        "#[cfg(test)]\nuse crate::error::Error; use crate::scene::Scene;",
    ];
    for source in upward {
        assert_eq!(violations("shape", source).len(), 1, "{source}");
    }
    assert_eq!(violations("shape", "use crate::nowhere::Thing;").len(), 1);
    assert_eq!(violations("nowhere", "").len(), 1);
    let sound = [
        "use crate::kernel::Kernel; use crate::shape::ShapeFunctions; use crate::Error;",
        "// use crate::scene::Scene;",
        "/// use crate::scene::Scene;\nfn f() {}",
        "#[cfg(test)]\nmod tests { use crate::scene::Scene; fn f() { if true {} } }",
        "const A: &str = \"crate::scene::Scene\";",
        "use other_crate::scene::Scene;",
    ];
    for source in sound {
        assert_eq!(violations("shape", source), Vec::<String>::new(), "{source}");
    }
}

/// The names of the functions in the block of a source that begins with a text, as the formatter leaves blocks.
fn functions(source: &str, begins: &str) -> Vec<String> {
    let block = source.split(begins).nth(1).unwrap().split("\n}").next().unwrap();
    let name = |line: &str| Some(line.strip_prefix("    fn ")?.split(['(', '<']).next()?.to_string());
    block.lines().filter_map(name).collect()
}

/// What wraps a user's functions hands on all they can be asked, those with a default too: a method that is added to the trait and
/// not to its wrapper would answer with the default.
#[test]
fn wrappers_hand_on_every_method() {
    let asked = functions(&source("shape/mod.rs"), "pub trait Approximation<");
    let handed_on = functions(&source("scene/discretisation/checked.rs"), "Approximation<D> for CheckedFunctions<A>");
    assert!(asked.len() > 5);
    for name in asked.iter().filter(|name| *name != "shape_functions") {
        assert!(handed_on.contains(name), "{name}");
    }
}

fn source(file: &str) -> String {
    bare(&fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(file)).unwrap())
}

/// Scenes ask cells for boundaries by the methods that look at the answers, which may be a user's.
#[test]
fn boundaries_of_cells_are_looked_at() {
    let mut scenes = Vec::new();
    files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene"), &mut scenes);
    assert!(scenes.len() > 20);
    for file in scenes.iter().filter(|file| !file.ends_with("checked.rs")) {
        let text = bare(&fs::read_to_string(file).unwrap());
        for name in ["cells.boundary", "cells.boundary_points", "cells.contact_boundary", "cells.boundary_nodes"] {
            assert!(!text.contains(&format!("{name}(")), "{}: {name}", file.display());
        }
        assert!(!text.contains("boundary_pieces"), "{}", file.display());
    }
}
