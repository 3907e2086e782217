//! Pictures of the book, compared with those that its programs draw.

use std::path::Path;

/// Numbers may differ by this part of themselves, and places by `NEAR` tenths of a pixel.
const PART: f64 = 0.01;
const NEAR: f64 = 12.0;
/// Levels of 256 by which the colours of an image may differ in the mean.
const LEVELS: f64 = 2.0;

/// Fails where the picture of a page and the one that its program drew show different data; `RKPM_BOOK=write` replaces it.
pub(crate) fn compare(page: &Path, drawn: &Path) {
    let svg = std::fs::read_to_string(drawn).unwrap_or_else(|e| panic!("{}: {e}", drawn.display()));
    if crate::writes() {
        return std::fs::write(page, svg).unwrap();
    }
    let name = page.display();
    let old = std::fs::read_to_string(page).unwrap_or_else(|e| panic!("{name}: {e}; run with RKPM_BOOK=write"));
    let advice = "look at both; where the new one is right, run with RKPM_BOOK=write";
    let ((old_text, old_images), (text, images)) = (parts(&old), parts(&svg));
    let (old_words, words) = (words(&old_text), words(&text));
    assert_eq!(old_words.len(), words.len(), "{name}: another number of lines, marks or letters; {advice}");
    let mut inside = false; // a tag, where numbers are places
    for (a, b) in old_words.iter().zip(&words) {
        if let Some(mark) = b.rfind(['<', '>']) {
            inside = b[mark..].starts_with('<');
        }
        let near = if inside { NEAR } else { 0.0 };
        let same = match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= PART * a.abs().max(b.abs()) + near,
            _ => a == b,
        };
        assert!(same, "{name}: {a} is now {b}; {advice}");
    }
    assert_eq!(old_images.len(), images.len(), "{name}: images; {advice}");
    for (a, b) in old_images.iter().zip(&images) {
        let (a, b) = (pixels(a), pixels(b));
        assert_eq!(a.len(), b.len(), "{name}: the size of an image; {advice}");
        let sum: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        assert!(sum <= LEVELS * a.len() as f64, "{name}: {} levels of colour; {advice}", sum / a.len() as f64);
    }
}

/// The text without its images, and their data.
fn parts(svg: &str) -> (String, Vec<&str>) {
    let mut pieces = svg.split("base64,");
    let (mut text, mut images) = (pieces.next().unwrap_or("").to_string(), Vec::new());
    for piece in pieces {
        let (image, rest) = piece.split_once('"').unwrap();
        images.push(image);
        text.push_str(rest);
    }
    (text, images)
}

/// Numbers and what stands between them.
pub(crate) fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut number = None;
    for c in text.chars() {
        let digit = c.is_ascii_digit() || c == '.' || c == '-';
        if number != Some(digit) {
            words.push(String::new());
            number = Some(digit);
        }
        words.last_mut().unwrap().push(c);
    }
    words
}

fn pixels(image: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut bytes = Vec::new();
    for four in image.trim_end_matches('=').as_bytes().chunks(4) {
        let bits = four.iter().fold(0u32, |bits, c| bits << 6 | u32::from(digit(*c))) << (6 * (4 - four.len()));
        bytes.extend_from_slice(&bits.to_be_bytes()[1..four.len()]);
    }
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}
