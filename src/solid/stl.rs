//! STL files, binary and ASCII.

use crate::each::point_of;
use crate::error::SolidError;
use crate::geometry::Vec3;

/// Bytes before the facets of a binary file, and of a facet.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Facets as they stand in a file: three vertices each, and the sections ("solid name") that they stand in.
#[derive(Debug, Default)]
pub(super) struct Listed {
    pub vertices: Vec<Vec3>,
    /// Names and first facets.
    pub sections: Vec<(String, usize)>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Listed, SolidError> {
    let count = bytes.get(80..HEADER).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let size = count.and_then(|count| count.checked_mul(RECORD)?.checked_add(HEADER));
    let text = bytes.trim_ascii_start();
    let start = &text[..text.len().min(512)];
    // Binary files may begin with "solid" too: their length tells, or bytes that no text has, in whatever language its names are.
    let is_binary = |byte: &u8| byte.is_ascii_control() && !byte.is_ascii_whitespace();
    let is_text = starts_with(text, b"solid") && size != Some(bytes.len()) && !start.iter().any(is_binary);
    match (is_text, size) {
        (true, _) => ascii(bytes),
        (false, Some(size)) if size <= bytes.len() => Ok(binary(&bytes[HEADER..size])),
        (false, _) if bytes.is_empty() => {
            Err(SolidError::Empty { what: "the file has no bytes", remedy: "save the surface again" })
        }
        (false, Some(_)) => Err(SolidError::Truncated { inside: "the list of facets", at: bytes.len() }),
        (false, None) => Err(SolidError::Truncated { inside: "the header of 84 bytes", at: bytes.len() }),
    }
}

fn starts_with(text: &[u8], word: &[u8]) -> bool {
    text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
}

fn binary(records: &[u8]) -> Listed {
    let mut vertices = Vec::with_capacity(3 * (records.len() / RECORD));
    for record in records.chunks_exact(RECORD) {
        // The normal, the first 12 bytes, follows from the corners.
        vertices.extend(record[12..48].chunks_exact(12).map(|vertex| {
            point_of::<3>(|i| {
                let number = &vertex[4 * i..4 * i + 4];
                f64::from(f32::from_le_bytes([number[0], number[1], number[2], number[3]]))
            })
        }));
    }
    Listed { vertices, sections: Vec::new() }
}

/// Words of a text with their places.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
        let rest = &self.bytes[self.at..];
        let word = &rest[..rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len())];
        self.at += word.len();
        (!word.is_empty()).then_some(word)
    }

    /// What is left of the line.
    fn line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let line = &rest[..rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len())];
        self.at += line.len();
        line.trim_ascii()
    }

    fn needed(&mut self, inside: &'static str) -> Result<&'a [u8], SolidError> {
        self.next().ok_or(SolidError::Truncated { inside, at: self.bytes.len() })
    }

    fn expect(&mut self, word: &'static str, inside: &'static str) -> Result<(), SolidError> {
        let found = self.needed(inside)?;
        if found.eq_ignore_ascii_case(word.as_bytes()) {
            return Ok(());
        }
        Err(self.malformed(format!("{word:?} was expected, {} found", shown(found))))
    }

    fn number(&mut self) -> Result<f64, SolidError> {
        let word = self.needed("a facet")?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.malformed(format!("a number was expected, {} found", shown(word))))
    }

    fn malformed(&self, what: String) -> SolidError {
        SolidError::Malformed { at: self.at, what }
    }
}

/// The start of a word for a message.
fn shown(word: &[u8]) -> String {
    format!("{:?}", String::from_utf8_lossy(&word[..word.len().min(20)]))
}

fn ascii(bytes: &[u8]) -> Result<Listed, SolidError> {
    let mut listed = Listed::default();
    let mut words = Words { bytes, at: 0 };
    while let Some(word) = words.next() {
        ensure!(
            word.eq_ignore_ascii_case(b"solid"),
            words.malformed(format!("\"solid\" was expected, {} found", shown(word)))
        );
        let line = words.line();
        let name = String::from_utf8_lossy(&line[..line.len().min(200)]).into_owned();
        listed.sections.push((name, listed.vertices.len() / 3));
        loop {
            let word = words.needed("a solid without \"endsolid\"")?;
            if word.eq_ignore_ascii_case(b"endsolid") {
                words.line();
                break;
            }
            ensure!(
                word.eq_ignore_ascii_case(b"facet"),
                words.malformed(format!("\"facet\" or \"endsolid\" was expected, {} found", shown(word)))
            );
            // The normal follows from the corners; some programs write what is no number.
            words.expect("normal", "a facet")?;
            for _ in 0..3 {
                words.needed("a facet")?;
            }
            words.expect("outer", "a facet")?;
            words.expect("loop", "a facet")?;
            for _ in 0..3 {
                words.expect("vertex", "a facet")?;
                let vertex = [words.number()?, words.number()?, words.number()?];
                listed.vertices.push(vertex.into());
            }
            words.expect("endloop", "a facet")?;
            words.expect("endfacet", "a facet")?;
        }
    }
    Ok(listed)
}
