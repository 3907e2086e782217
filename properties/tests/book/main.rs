//! The programs of the README and of the book run as they stand there; what they print and draw is compared with the page.
//!
//! `RKPM_BOOK=write cargo test --profile quick --all-features -p rkpm-properties --test book` writes outputs and pictures
//! into the pages: look at the difference before it is committed.

mod pages;
mod pictures;

use std::cell::RefCell;
use std::fmt::Display;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, Once};

/// Numbers that are printed with a decimal point may differ by this part of themselves, or by one in their last place.
const PART: f64 = 1e-3;

/// Pages are read while none is written.
static PAGES: Mutex<()> = Mutex::new(());

thread_local! {
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What a program prints is kept.
macro_rules! println {
    ($($arguments:tt)*) => { crate::print(&format!($($arguments)*)) };
}

include!(concat!(env!("OUT_DIR"), "/programs.rs"));

fn print(text: &str) {
    PRINTED.with_borrow_mut(|printed| printed.extend([text, "\n"]));
}

/// Whether pages are written instead of compared.
fn writes() -> bool {
    std::env::var_os("RKPM_BOOK").is_some_and(|value| value == "write")
}

/// Runs a program of a page in an empty folder, with the files of the project that it reads.
fn check<E: Display>(page: &str, index: usize, run: fn() -> Result<(), E>) {
    static EMPTY: Once = Once::new();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book");
    EMPTY.call_once(|| {
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        std::env::set_current_dir(&folder).unwrap();
    });
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join(page);
    let text = {
        let _one = PAGES.lock();
        fs::read_to_string(&file).unwrap()
    };
    let program = pages::programs(&text).swap_remove(index);
    let names: Vec<&str> = program.code.split('"').skip(1).step_by(2).collect();
    for input in names.iter().filter(|name| name.contains('/') && root.join(name).is_file()) {
        fs::create_dir_all(folder.join(input).parent().unwrap()).unwrap();
        fs::copy(root.join(input), folder.join(input)).unwrap();
    }
    PRINTED.take();
    run().unwrap_or_else(|error| panic!("{page}: {error}"));
    let printed: String = PRINTED.take().lines().flat_map(|line| [line.trim_end(), "\n"]).collect();
    let printed = printed.trim_matches('\n');
    if writes() {
        write_output(&file, index, printed);
    } else {
        compare(page, program.output.unwrap_or_default().trim_matches('\n'), printed);
    }
    for name in names.iter().filter(|name| name.ends_with(".svg")) {
        let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| Path::new(link));
        for link in links.filter(|link| link.file_name().is_some_and(|last| last == *name)) {
            pictures::compare(&file.parent().unwrap().join(link), &folder.join(name));
        }
    }
}

/// Fails where a page shows another output than its program has.
fn compare(page: &str, shown: &str, printed: &str) {
    let (old, new) = (pictures::words(shown), pictures::words(printed));
    let same = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>(), a.split_once('.')) {
        (Ok(x), Ok(y), Some((_, decimals))) => {
            (x - y).abs() <= 1.01 * 0.1f64.powi(decimals.len() as i32) + PART * x.abs()
        }
        _ => a == b,
    };
    let all = old.len() == new.len() && old.iter().zip(&new).all(|(a, b)| same(a, b));
    assert!(all, "{page} shows\n{shown}\nand its program prints\n{printed}\nrun with RKPM_BOOK=write and look at both");
}

/// Puts what a program printed behind it.
fn write_output(file: &Path, index: usize, printed: &str) {
    let _one = PAGES.lock();
    let text = fs::read_to_string(file).unwrap();
    let program = pages::programs(&text).swap_remove(index);
    let mut lines: Vec<&str> = text.lines().collect();
    if let Some(old) = &program.output {
        let from = (program.end..).find(|&line| lines[line] == "```text").unwrap();
        lines.drain(program.end..from + old.lines().count() + 2);
    }
    let shown = format!("\n```text\n{printed}\n```");
    if !printed.is_empty() {
        lines.splice(program.end..program.end, shown.lines());
    }
    fs::write(file, lines.join("\n") + "\n").unwrap();
}

#[test]
fn outputs_are_compared_number_by_number() {
    compare("a page", "force 1.234 N in 5 steps", "force 1.235 N in 5 steps");
    let differs = |shown: &str, printed: &str| std::panic::catch_unwind(|| compare("a page", shown, printed)).is_err();
    assert!(differs("force 1.234 N", "force 1.254 N") && differs("5 steps", "6 steps") && differs("a", "b"));
}

#[test]
fn programs_go_on_in_the_next_block() {
    let page = "```rust\nfn main() {\n```\nand\n```rust\n}\n```\n\n```text\n1\n```\n```text\n2\n```\n```rust\nfn f() {}\n```\n```rust\nfn main() {}\n```\n";
    let found = pages::programs(page);
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].code.as_str(), found[0].output.as_deref()), ("fn main() {\n}\n", Some("1\n")));
    assert_eq!((found[1].code.as_str(), found[1].output.as_deref()), ("fn f() {}\nfn main() {}\n", None));
}
