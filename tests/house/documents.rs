//! README and book: links lead somewhere, pages are listed, their programs are run with the tests.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Markdown files of a directory.
fn documents(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|e| e == "md")).collect()
}

/// The text outside of blocks of code, and the first lines of these blocks.
fn prose(text: &str) -> (String, Vec<&str>) {
    let (mut prose, mut blocks, mut inside) = (String::new(), Vec::new(), false);
    for line in text.lines() {
        match line.trim_start().strip_prefix("```") {
            Some(kind) => {
                if !inside {
                    blocks.push(kind);
                }
                inside = !inside;
            }
            None if !inside => prose.extend([line, "\n"]),
            None => {}
        }
    }
    (prose, blocks)
}

/// The lines in blocks of Rust.
fn lines_of_rust(text: &str) -> Vec<&str> {
    let (mut lines, mut kind) = (Vec::new(), None);
    for line in text.lines() {
        match (line.strip_prefix("```"), kind) {
            (Some(opened), None) => kind = Some(opened),
            (Some(_), Some(_)) => kind = None,
            (None, Some("rust")) => lines.push(line),
            (None, _) => {}
        }
    }
    lines
}

/// Targets of links that are files of the project.
fn links(prose: &str) -> Vec<&str> {
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    let files = targets.filter(|target| !target.contains("://") && !target.starts_with('#'));
    files.map(|target| target.split('#').next().unwrap_or(target)).collect()
}

#[test]
fn links_between_documents_lead_to_files() {
    let of_root = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    let directories = ["docs", "docs/book", "docs/measurements", "petsc"].map(|name| root().join(name));
    let files = of_root.into_iter().chain(directories.iter().flat_map(|directory| documents(directory)));
    let mut seen = 0;
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for link in links(&prose(&text).0) {
            let target = file.parent().unwrap().join(link);
            assert!(target.exists(), "{}: {link} does not exist", file.display());
            seen += 1;
        }
    }
    assert!(seen > 80, "{seen} links found");
}

/// The site has the pages that the summary lists and the files beside them, and nothing outside `docs`.
#[test]
fn links_of_listed_pages_lead_to_listed_pages() {
    let docs = root().join("docs").canonicalize().unwrap();
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    let listed: Vec<_> = links(&summary).iter().map(|page| docs.join(page)).collect();
    for page in &listed {
        for link in links(&prose(&fs::read_to_string(page).unwrap()).0) {
            let target = page.parent().unwrap().join(link).canonicalize().unwrap();
            let is_page = target.extension().is_some_and(|ending| ending == "md");
            assert!(target.starts_with(&docs), "{}: {link} is outside the book", page.display());
            assert!(!is_page || listed.contains(&target), "{}: {link} is not in docs/SUMMARY.md", page.display());
        }
    }
    assert!(listed.len() > 30, "{} pages", listed.len());
}

/// Whether a text says a part in a hundred or a power of ten: what was measured.
fn says_a_measured_number(text: &str) -> bool {
    let all: Vec<char> = text.chars().collect();
    all.windows(3).any(|three| {
        let digit = three[0].is_ascii_digit();
        let percent = three[1] == '%' || (three[1] == ' ' && three[2] == '%');
        digit && (percent || three[1] == 'e' && three[2] == '-')
    })
}

/// A page whose text says measured numbers names a command, a test, a bench or an example that shows them; a page of the book may
/// be that program itself.
#[test]
fn pages_with_numbers_name_what_shows_them() {
    let directories = ["docs", "docs/book", "docs/measurements", "petsc"].map(|name| root().join(name));
    let files = directories.iter().flat_map(|directory| documents(directory)).chain([root().join("README.md")]);
    let (mut seen, mut unfounded) = (0, Vec::new());
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let (prose, blocks) = prose(&text);
        if !says_a_measured_number(&prose) {
            continue;
        }
        seen += 1;
        let sources = ["cargo run", "cargo test", "cargo bench", "tests/", "benches/", "examples/", "summary.csv"];
        let is_program = file.starts_with(root().join("docs/book")) && blocks.contains(&"rust");
        if !is_program && !sources.iter().any(|source| text.contains(source)) {
            unfounded.push(file.display().to_string());
        }
    }
    assert!(seen > 15, "{seen} pages with numbers");
    assert!(unfounded.is_empty(), "no command, test or example is named by {unfounded:?}");
    assert!(
        says_a_measured_number("off by 0.7 %") && says_a_measured_number("1e-8") && !says_a_measured_number("8 cells")
    );
}

/// The test program `book` of `properties` runs what stands in blocks of Rust, as it stands.
#[test]
fn pages_of_the_book_are_listed_and_can_be_pasted() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let pages = documents(&root().join("docs/book"));
    assert!(pages.len() > 15, "{} pages", pages.len());
    for page in pages.iter().chain([&root().join("README.md")]) {
        let name = page.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(page).unwrap();
        let (prose, blocks) = prose(&text);
        assert!(blocks.contains(&"rust"), "{name}: no program");
        assert!(blocks.iter().all(|kind| ["rust", "text", "sh", "toml"].contains(kind)), "{name}: {blocks:?}");
        for line in lines_of_rust(&text) {
            assert!(!line.starts_with("# ") && line.chars().count() <= 90, "{name}: hidden or wide: {line}");
        }
        if name == "README" {
            continue;
        }
        assert!(summary.contains(&format!("(book/{name}.md)")), "{name} is missing in docs/SUMMARY.md");
        let draws = |picture: &&str| picture.ends_with(".svg") && text.contains(&format!("\"{picture}\""));
        assert!(links(&prose).iter().any(draws), "{name}: no program draws a picture of the page");
    }
}

/// The first page stays short, and its code fits beside a table of contents.
#[test]
fn the_readme_is_short() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let (prose, _) = prose(&text);
    // A link counts as the words that are seen.
    let shown: String = prose.split("](").map(|part| part.split_once(')').map_or(part, |(_, rest)| rest)).collect();
    let words = shown.split_whitespace().filter(|word| word.chars().any(char::is_alphanumeric)).count();
    assert!((300..=700).contains(&words), "{words} words");
    // The page is shown with the package, which holds no other members of the workspace.
    let members = ["benches/", "petsc/", "properties/", "python/"];
    let outside = |link: &&str| members.iter().any(|member| link.starts_with(member));
    assert_eq!(links(&prose).into_iter().find(outside), None, "a link that the package lacks");
}
