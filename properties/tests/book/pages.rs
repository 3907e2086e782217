// Programs of a page and what they print; shared by the build script, which compiles them, and the tests, which run them.

/// A program of a page: its blocks of Rust, and the block of text behind the last of them.
#[derive(Debug)]
pub struct Program {
    pub code: String,
    /// What the page says that it prints.
    pub output: Option<String>,
    /// The number of lines of the page up to the end of the program's last block.
    pub end: usize,
}

/// The programs of a page in their order. A block of Rust without `main`, or with a brace left open, goes on in the next one; a block of
/// `text` that follows a program, with nothing but empty lines between them, is what it prints.
pub fn programs(page: &str) -> Vec<Program> {
    let lines: Vec<&str> = page.lines().collect();
    let mut found: Vec<Program> = Vec::new();
    let (mut code, mut at) = (String::new(), 0);
    while at < lines.len() {
        let Some(kind) = lines[at].strip_prefix("```") else {
            at += 1;
            continue;
        };
        let length = lines[at + 1..].iter().take_while(|line| **line != "```").count();
        let block: String = lines[at + 1..at + 1 + length].iter().flat_map(|line| [line, "\n"]).collect();
        let behind_program = found
            .last()
            .is_some_and(|last| last.output.is_none() && lines[last.end..at].iter().all(|line| line.is_empty()));
        at += length + 2;
        if kind == "rust" {
            code.push_str(&block);
            if code.contains("fn main") && code.matches('{').count() == code.matches('}').count() {
                found.push(Program { code: std::mem::take(&mut code), output: None, end: at });
            }
        } else if kind == "text" && code.is_empty() && behind_program {
            found.last_mut().expect("a program stands before").output = Some(block);
        }
    }
    assert!(code.is_empty(), "a program has no end:\n{code}");
    found
}
