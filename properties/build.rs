//! Makes a test of each program in the README and in the book: `tests/book` runs them and compares what they print.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "tests/book/pages.rs"]
mod pages;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a member of a workspace");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo names it"));
    let book = root.join("docs/book");
    println!("cargo::rerun-if-changed={}", book.display());
    let entries = fs::read_dir(&book).expect("the book").map(|entry| entry.expect("a page").path());
    let mut files: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "md")).collect();
    files.sort();
    files.insert(0, root.join("README.md"));
    let mut tests = String::new();
    for file in files {
        println!("cargo::rerun-if-changed={}", file.display());
        let text = fs::read_to_string(&file).expect("a page is text");
        let page = file.strip_prefix(root).expect("within the project").to_str().expect("ASCII");
        let stem = file.file_stem().and_then(|stem| stem.to_str()).expect("ASCII").to_lowercase();
        for (index, program) in pages::programs(&text).iter().enumerate() {
            let name = format!("{stem}_{}", index + 1);
            let source = out.join(format!("{name}.rs"));
            fs::write(&source, &program.code).expect("a folder of cargo");
            let test = format!("#[test] fn is_as_shown() {{ super::check({page:?}, {index}, main); }}");
            writeln!(tests, "mod {name} {{ include!({source:?}); {test} }}").expect("text");
        }
    }
    fs::write(out.join("programs.rs"), tests).expect("a folder of cargo");
}
