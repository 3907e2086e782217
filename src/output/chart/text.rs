//! Widths of text and line breaks.
//!
//! An SVG is laid out before anybody knows the font it will be shown in, so widths are estimated
//! from a wide one; a narrower font leaves air, never an overlap.

/// Marks the beginning of a superscript; a private character, so no label can hold it by accident.
pub(super) const RAISE: char = '\u{E000}';
/// Marks the end of a superscript.
pub(super) const LOWER: char = '\u{E001}';
/// Size of a superscript relative to the text it belongs to.
pub(super) const SUPERSCRIPT: f64 = 0.7;

/// Width of a text in a font of the given size, both in pixels.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let (mut width, mut factor) = (0.0, 1.0);
    for character in text.chars() {
        match character {
            RAISE => factor = SUPERSCRIPT,
            LOWER => factor = 1.0,
            c => width += advance(c) * factor,
        }
    }
    width * size
}

/// Advance of a character in ems: DejaVu Sans, the widest of the common sans-serif fonts.
fn advance(character: char) -> f64 {
    match character {
        'i' | 'j' | 'l' | '\'' => 0.28,
        ' ' | '.' | ',' | '·' => 0.32,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '|' | '/' | ':' | ';' | 'I' | 'J' | '-' => 0.41,
        's' | 'c' | 'k' | 'v' | 'x' | 'y' | 'z' | '*' | '"' | '⁻' => 0.59,
        'm' | 'W' | '—' | '%' | '@' | '…' => 1.0,
        'w' | 'M' | '+' | '−' | '=' | '<' | '>' | '×' | '±' | '≤' | '≥' | '→' | '∞' | '~' | '#' => 0.85,
        '²' | '³' | '¹' | '⁰'..='⁹' => 0.41,
        'A'..='Z' => 0.76,
        c if c.is_ascii() => 0.64,
        // Ideographs and other full-width characters.
        '\u{1100}'.. => 1.0,
        _ => 0.7,
    }
}

/// Breaks a text into lines no wider than `room` pixels: between words, or within a word that is
/// wider by itself. An empty text has no line.
pub(super) fn wrap(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let joined = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        if width(&joined, size) <= room {
            line = joined;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        for character in word.chars() {
            line.push(character);
            if line.chars().count() > 1 && width(&line, size) > room {
                line.pop();
                lines.push(std::mem::replace(&mut line, character.to_string()));
            }
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_nothing_is_lost() {
        let text = "volume-averaged pressure against an extraordinarilylongwordwithoutanyspace";
        for room in [60.0, 120.0, 1e4] {
            let lines = wrap(text, 12.0, room);
            assert!(lines.iter().all(|line| width(line, 12.0) <= room));
            let letters = |s: &str| s.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(text));
        }
        assert!(wrap("  ", 12.0, 100.0).is_empty());
    }
}
