//! Tables of tests as laboratories write them: which column holds what, and how numbers are spelt.

use csv::{ReaderBuilder, StringRecord, Trim};

use super::FitError;
use crate::each::EachOf;

/// Separators of columns, in the order in which they are tried.
const SEPARATORS: [u8; 3] = *b"\t;,";

/// Units that may follow a name, as words.
const UNITS: &[&str] = &[
    "pa", "hpa", "kpa", "mpa", "gpa", "psi", "ksi", "bar", "mbar", "atm", "n", "kn", "mn", "kgf", "kg", "gf", "lbf",
    "lb", "m", "cm", "mm", "m2", "cm2", "mm2", "in", "inch", "in2", "sq",
];

/// A column of a table of tests: a header is its name where each word of it is understood. One word that is not makes it
/// something else: a strain, a rate, a true stress, the number of a test.
struct Column {
    name: &'static str,
    /// Any of these sets of words names the quantity.
    names: &'static [&'static [&'static str]],
    /// A header with one of these goes before one without.
    explicit: &'static [&'static str],
    /// Words that do not change what is meant.
    harmless: &'static [&'static str],
    /// Words of headers that are near it.
    near: &'static [&'static str],
    /// What to do where only such a header is there.
    remedy: &'static str,
}

const COLUMNS: [Column; 3] = [
    Column {
        name: "mode",
        names: &[&["mode"], &["test"]],
        explicit: &["mode"],
        harmless: &["of", "type", "kind", "loading", "deformation"],
        near: &["mode", "test"],
        remedy: "name the column with uniaxial, equibiaxial, planar or volumetric mode",
    },
    Column {
        name: "stretch",
        names: &[&["stretch"], &["stretches"], &["lambda"], &["λ"], &["volume", "ratio"], &["j"]],
        explicit: &[],
        harmless: &["1", "m", "cm", "mm", "in"],
        near: &["stretch", "stretches", "strain", "strains", "elongation", "extension", "displacement", "volume"],
        remedy: "give stretches, lengths over undeformed lengths, under the header stretch; they are 1 + engineering strain \
                 and exp(true strain)",
    },
    Column {
        name: "nominal_stress",
        names: &[&["stress"], &["stresses"]],
        explicit: &["nominal", "engineering", "eng", "pk1"],
        harmless: &["mean", "average", "measured", "tensile"],
        near: &["stress", "stresses", "force", "load", "engineering", "nominal"],
        remedy: "give forces over undeformed areas under the header nominal_stress; in a uniaxial test they are true stress / \
                 stretch",
    },
];

/// Words of a header in lower case: runs of letters and digits, those of `NominalStress` apart.
fn words(header: &str) -> Vec<String> {
    let header = header.replace('^', "").replace('²', "2").replace('%', " % ");
    let mut words = Vec::new();
    for run in header.split(|c: char| !c.is_alphanumeric() && c != '%').filter(|run| !run.is_empty()) {
        let lower = run.to_lowercase();
        // `MPa` and `kPa` are one word.
        if UNITS.contains(&lower.as_str()) {
            words.push(lower);
            continue;
        }
        let mut word = String::new();
        let mut before = ' ';
        for letter in run.chars() {
            if letter.is_uppercase() && before.is_lowercase() {
                words.push(std::mem::take(&mut word).to_lowercase());
            }
            word.push(letter);
            before = letter;
        }
        words.push(word.to_lowercase());
    }
    let text = words.join(" ").replace("first piola kirchhoff", "nominal").replace("1st piola kirchhoff", "nominal");
    text.split(' ').filter(|word| !word.is_empty()).map(str::to_string).collect()
}

impl Column {
    /// How well a header names the column: 2 if it says so outright, 1 if it does, 0 if it does not.
    fn rank(&self, header: &str) -> usize {
        let words = words(header);
        let has = |word: &str| words.iter().any(|w| w == word);
        let units = if self.name == "nominal_stress" { UNITS } else { &[] };
        let understood = |word: &String| {
            let lists = [self.explicit, self.harmless, units];
            lists.iter().any(|list| list.contains(&word.as_str()))
                || self.names.iter().flat_map(|set| set.iter()).any(|w| w == word)
        };
        let named = self.names.iter().any(|set| set.iter().all(|word| has(word)));
        match named && words.iter().all(understood) {
            false => 0,
            true if self.explicit.iter().any(|word| has(word)) => 2,
            true => 1,
        }
    }

    /// Where the column stands in a header.
    fn find(&self, header: &StringRecord) -> Result<usize, FitError> {
        let ranks: Vec<usize> = header.iter().map(|head| self.rank(head)).collect();
        let best = ranks.iter().copied().max().unwrap_or(0);
        let mut found = (0..ranks.len()).filter(|&k| best > 0 && ranks[k] == best);
        match (found.next(), found.next()) {
            (Some(place), None) => Ok(place),
            (Some(first), Some(second)) => {
                let [first, second] = [first, second].map(|k| header[k].to_string());
                Err(FitError::Ambiguous { column: self.name, first, second })
            }
            (None, _) => {
                let near = |head: &&str| words(head).iter().any(|word| self.near.contains(&word.as_str()));
                Err(match header.iter().find(near) {
                    Some(head) => FitError::Header { column: self.name, header: head.into(), remedy: self.remedy },
                    None => FitError::Column { column: self.name },
                })
            }
        }
    }
}

/// A table of tests: the fields of mode, stretch and stress by row.
pub(super) struct Rows<'a> {
    text: &'a str,
    separator: u8,
    /// Where mode, stretch and stress stand.
    columns: [usize; 3],
    /// Columns of the header.
    width: usize,
}

impl<'a> Rows<'a> {
    /// Finds the header: the first line, under whatever stands above it, that names all columns with one of the separators.
    pub(super) fn new(text: &'a str) -> Result<Self, FitError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // What the line that names most columns lacks.
        let mut lacks = (0, FitError::Column { column: COLUMNS[0].name });
        let mut end = 0;
        for line in text.split_inclusive('\n') {
            end += line.len();
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            for separator in SEPARATORS {
                let Some(header) = record(line, separator) else { continue };
                let found = COLUMNS.each_ref().map(|column| column.find(&header));
                let there = found.iter().filter(|f| matches!(f, Ok(_) | Err(FitError::Ambiguous { .. }))).count();
                match found {
                    [Ok(mode), Ok(stretch), Ok(stress)] => {
                        let columns = [mode, stretch, stress];
                        return Ok(Rows { text: &text[end..], separator, columns, width: header.len() });
                    }
                    found if there > lacks.0 => {
                        if let Some(error) = found.into_iter().find_map(Result::err) {
                            lacks = (there, error);
                        }
                    }
                    _ => {}
                }
            }
        }
        Err(lacks.1)
    }

    /// Hands out mode, stretch and stress of each row, counted from 1.
    pub(super) fn each(
        &self,
        mut take: impl FnMut(usize, &str, [f64; 2]) -> Result<(), FitError>,
    ) -> Result<(), FitError> {
        let mut reader = (ReaderBuilder::new().comment(Some(b'#')).trim(Trim::All).flexible(true).has_headers(false))
            .delimiter(self.separator)
            .from_reader(self.text.as_bytes());
        let mut decimal = None;
        let mut row = 0;
        for record in reader.records() {
            row += 1;
            let wrong = |what: String| FitError::Row { row, what };
            let record = record.map_err(|e| wrong(e.to_string()))?;
            let [mode, stretch, stress] = self.columns.each(|c| record.get(c).unwrap_or_default());
            // Spreadsheets write rows of separators; a row of units stands under some headers.
            let no_data = |text: &str| words(text).iter().all(|word| UNITS.contains(&word.as_str()));
            if record.iter().all(str::is_empty) || row == 1 && no_data(stretch) && no_data(stress) {
                row -= 1;
                continue;
            }
            ensure!(
                !record.iter().skip(self.width).any(|field| !field.is_empty()),
                wrong(format!(
                    "{} fields, the header has {}; where numbers have decimal commas, separate columns by semicolons",
                    record.len(),
                    self.width
                ))
            );
            let numbers = [self.number(stretch, &mut decimal), self.number(stress, &mut decimal)];
            let [stretch, stress] = numbers.map(|number| number.map_err(wrong));
            take(row, mode, [stretch?, stress?])?;
        }
        Ok(())
    }

    /// A number with a decimal point, or with a comma where commas do not separate columns; one of them in the whole table.
    fn number(&self, text: &str, decimal: &mut Option<char>) -> Result<f64, String> {
        let comma = self.separator != b',' && text.contains(',');
        for mark in [comma.then_some(','), text.contains('.').then_some('.')].into_iter().flatten() {
            ensure!(
                *decimal.get_or_insert(mark) == mark,
                format!(
                    "{text:?} in a table with points and commas in its numbers; write them with decimal points alone"
                )
            );
        }
        let spelt = if comma { text.replace(',', ".") } else { text.to_string() };
        spelt.parse().map_err(|_| format!("{text:?} is no number"))
    }
}

/// The fields of one line.
fn record(line: &str, separator: u8) -> Option<StringRecord> {
    let mut reader =
        (ReaderBuilder::new().trim(Trim::All).has_headers(false).delimiter(separator)).from_reader(line.as_bytes());
    reader.records().next()?.ok()
}
