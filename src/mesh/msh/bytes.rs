//! Numbers and words of a file, as text or binary, with where they stand.

use crate::error::MeshError;

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
enum Writing {
    Text,
    Binary,
    /// Binary with the bytes the other way round.
    Swapped,
}

/// The bytes of a file, read from the front.
pub(super) struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    section: &'static str,
    writing: Writing,
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Bytes { bytes, at: 0, section: "MeshFormat", writing: Writing::Text }
    }

    pub(crate) fn at(&self) -> usize {
        self.at
    }

    pub(crate) fn is_text(&self) -> bool {
        self.writing == Writing::Text
    }

    /// Names the section for messages.
    pub(crate) fn enter(&mut self, section: &'static str) {
        self.section = section;
    }

    fn truncated(&self) -> MeshError {
        MeshError::Truncated { section: self.section, at: self.at }
    }

    pub(crate) fn malformed(&self, section: &'static str, what: String) -> MeshError {
        MeshError::Malformed { section, at: self.at, what }
    }

    fn wrong(&self, what: &str) -> MeshError {
        self.malformed(self.section, what.to_string())
    }

    fn skip_blank(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The next word between blanks.
    pub(crate) fn word(&mut self) -> Result<&'a [u8], MeshError> {
        self.skip_blank();
        let start = self.at;
        let rest = &self.bytes[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        ensure!(length != 0, self.truncated());
        self.at += length;
        Ok(&rest[..length])
    }

    /// The name of the section that begins next; none at the end of the file.
    pub(crate) fn section(&mut self) -> Result<Option<Vec<u8>>, MeshError> {
        self.skip_blank();
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        match self.word()?.strip_prefix(b"$") {
            Some(name) => Ok(Some(name.to_vec())),
            None => Err(self.wrong("something else than a section follows")),
        }
    }

    /// Reads the end of a section.
    pub(crate) fn end_of(&mut self, name: &[u8]) -> Result<(), MeshError> {
        let word = self.word()?;
        if word.strip_prefix(b"$End") == Some(name) {
            return Ok(());
        }
        Err(self.wrong("the section holds more than it says"))
    }

    /// Skips a section that is not read.
    pub(crate) fn skip_to_end_of(&mut self, name: &[u8]) -> Result<(), MeshError> {
        let end = [b"$End", name].concat();
        let rest = &self.bytes[self.at..];
        let mut from = 0;
        // A search by lines: `windows` would take a name as long as the file for as many comparisons each.
        while let Some(dollar) = rest[from..].iter().position(|b| *b == b'$') {
            let here = from + dollar;
            if rest[here..].starts_with(&end) {
                self.at += here + end.len();
                return Ok(());
            }
            from = here + 1;
        }
        Err(self.truncated())
    }

    /// Turns to binary numbers: reads the one that tells the order of bytes.
    pub(crate) fn binary(&mut self) -> Result<(), MeshError> {
        // The line ends; what follows is binary.
        self.end_line()?;
        let one = self.take::<4>()?;
        self.writing = if i32::from_le_bytes(one) == 1 {
            Writing::Binary
        } else if i32::from_be_bytes(one) == 1 {
            Writing::Swapped
        } else {
            return Err(self.wrong("the number that tells the order of bytes is not 1"));
        };
        Ok(())
    }

    /// Goes beyond the end of the line, where binary numbers begin.
    pub(crate) fn end_line(&mut self) -> Result<(), MeshError> {
        match self.bytes[self.at..].iter().position(|b| *b == b'\n') {
            Some(end) => {
                self.at += end + 1;
                Ok(())
            }
            None => Err(self.truncated()),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], MeshError> {
        let bytes = self.bytes.get(self.at..self.at.saturating_add(N)).ok_or_else(|| self.truncated())?;
        self.at += N;
        let mut out = [0; N];
        out.copy_from_slice(bytes);
        Ok(out)
    }

    /// An integer written as text, whatever the rest is.
    pub(crate) fn text_integer(&mut self) -> Result<i64, MeshError> {
        let word = self.word()?;
        let (digits, negative) = match word {
            [b'-', rest @ ..] => (rest, true),
            _ => (word, false),
        };
        let mut value = 0i64;
        for &byte in digits {
            let digit = byte.wrapping_sub(b'0');
            let next = value.checked_mul(10).and_then(|v| v.checked_add(i64::from(digit)));
            match next {
                Some(next) if digit < 10 => value = next,
                _ => return Err(self.not_a_number(word, "an integer")),
            }
        }
        if digits.is_empty() {
            return Err(self.not_a_number(word, "an integer"));
        }
        Ok(if negative { -value } else { value })
    }

    fn not_a_number(&self, word: &[u8], needed: &str) -> MeshError {
        let word: String = String::from_utf8_lossy(word).chars().take(20).collect();
        if word.starts_with('$') {
            return self.wrong("the section holds less than it says");
        }
        self.wrong(&format!("{word:?} is not {needed}"))
    }

    /// An integer; 32 bits where it is binary.
    #[inline]
    pub(crate) fn int(&mut self) -> Result<i64, MeshError> {
        match self.writing {
            Writing::Text => self.text_integer(),
            Writing::Binary => Ok(i64::from(i32::from_le_bytes(self.take()?))),
            Writing::Swapped => Ok(i64::from(i32::from_be_bytes(self.take()?))),
        }
    }

    /// A count or number of 64 bits.
    #[inline]
    pub(crate) fn size(&mut self) -> Result<u64, MeshError> {
        match self.writing {
            Writing::Text => {
                let value = self.text_integer()?;
                u64::try_from(value).map_err(|_| self.wrong("a number is below zero"))
            }
            Writing::Binary => Ok(u64::from_le_bytes(self.take()?)),
            Writing::Swapped => Ok(u64::from_be_bytes(self.take()?)),
        }
    }

    /// A real number.
    #[inline]
    pub(crate) fn real(&mut self) -> Result<f64, MeshError> {
        match self.writing {
            Writing::Text => {
                let word = self.word()?;
                let value = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
                value.ok_or_else(|| self.not_a_number(word, "a number"))
            }
            Writing::Binary => Ok(f64::from_le_bytes(self.take()?)),
            Writing::Swapped => Ok(f64::from_be_bytes(self.take()?)),
        }
    }

    /// Goes to the numbers of a section, which may be binary.
    pub(crate) fn begin_numbers(&mut self) -> Result<(), MeshError> {
        if self.is_text() { Ok(()) } else { self.end_line() }
    }

    /// Three coordinates, and so many numbers behind them that say nothing of the place.
    pub(crate) fn place(&mut self, more: i64) -> Result<[f64; 3], MeshError> {
        let at = [self.real()?, self.real()?, self.real()?];
        for _ in 0..more {
            self.real()?;
        }
        Ok(at)
    }

    /// A count of things that take at least so many bytes each: what the file can't hold is no count.
    pub(crate) fn count_of(&self, count: u64, text: usize, binary: usize) -> Result<usize, MeshError> {
        let each = if self.is_text() { text } else { binary };
        let left = self.bytes.len() - self.at;
        match usize::try_from(count) {
            // The last line may lack its end.
            Ok(count) if count.checked_mul(each).is_some_and(|bytes| bytes <= left + 1) => Ok(count),
            _ => Err(MeshError::Truncated { section: self.section, at: self.bytes.len() }),
        }
    }

    /// A name in quotation marks.
    pub(crate) fn quoted(&mut self) -> Result<String, MeshError> {
        self.skip_blank();
        let rest = &self.bytes[self.at..];
        let line = &rest[..rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len())];
        let start = line
            .iter()
            .position(|b| *b == b'"')
            .ok_or_else(|| self.wrong("a physical group has no name in quotation marks"))?;
        let length = line[start + 1..]
            .iter()
            .rposition(|b| *b == b'"')
            .ok_or_else(|| self.wrong("the name of a physical group has no end"))?;
        self.at += start + length + 2;
        Ok(String::from_utf8_lossy(&line[start + 1..start + 1 + length]).into_owned())
    }
}
