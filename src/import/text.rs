//! Lines and words of the formats that are texts.

use std::borrow::Cow;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Largest coordinate that is read, by size: differences of larger ones, squared and added up, are
/// beyond the greatest float of 3.4e38.
pub(super) const MAX_COORDINATE: f64 = 1e18;

/// A line with its number, counted from 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

/// A file's text: UTF-8, or UTF-16 as its byte order mark or its zeros say. Lines may end in carriage
/// returns alone. Only names in it may be no UTF-8, and are then found by no file.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => from_utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => from_utf16(rest, u16::from_be_bytes),
        [1..=127, 0, 1..=127, 0, ..] => from_utf16(bytes, u16::from_le_bytes),
        [0, 1..=127, 0, 1..=127, ..] => from_utf16(bytes, u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes),
    };
    let is_alone = |pair: &[u8]| pair[0] == b'\r' && pair[1] != b'\n';
    if text.as_bytes().windows(2).any(is_alone) {
        return text.replace("\r\n", "\n").replace('\r', "\n").into();
    }
    text
}

fn from_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Cow<'_, str> {
    let units = bytes.as_chunks().0.iter().map(|&pair| unit(pair));
    let character =
        |unit: std::result::Result<char, _>| unit.unwrap_or(char::REPLACEMENT_CHARACTER);
    Cow::Owned(char::decode_utf16(units).map(character).collect())
}

/// The lines that are neither empty nor comments, without space and byte order marks around.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.lines().enumerate().filter_map(|(at, text)| {
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
        (!text.is_empty() && !text.starts_with('#')).then_some(Line { number: at + 1, text })
    })
}

/// The words of a text, up to a comment. Names are no such texts: they may hold the mark of one.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> + Clone {
    text.split_whitespace().take_while(|word| !word.starts_with('#'))
}

impl<'a> Line<'a> {
    /// The first word, and what follows it.
    pub(super) fn split(self) -> (&'a str, &'a str) {
        let (word, rest) = self.text.split_once(char::is_whitespace).unwrap_or((self.text, ""));
        (word, rest.trim())
    }

    /// Reads a word.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if it is not of that kind.
    pub(super) fn parse<T: FromStr>(self, word: &str) -> Result<T> {
        word.parse().map_err(|_| self.error(format!("`{}` is no such number", shorten(word))))
    }

    /// Reads a number; NaN for what programs write where they have none.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if it is no number.
    pub(super) fn number(self, word: &str) -> Result<f64> {
        match self.parse(word) {
            Err(_) if is_no_number(word) => Ok(f64::NAN),
            number => number,
        }
    }

    /// Reads `N` numbers at the beginning of `rest`, finite or not.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if there are fewer.
    pub(super) fn numbers<const N: usize>(self, rest: &str) -> Result<[f64; N]> {
        let mut words = words(rest);
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let word = words.next().ok_or_else(|| self.error(format!("fewer than {N} numbers")))?;
            *number = self.number(word)?;
        }
        Ok(numbers)
    }

    /// Reads a position, finite or not.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if it has fewer than three coordinates, or one is too large.
    pub(super) fn position(self, rest: &str) -> Result<[f64; 3]> {
        let position = self.numbers(rest)?;
        match too_large(position) {
            Some(what) => Err(self.error(what)),
            None => Ok(position),
        }
    }

    /// Reads `N` finite numbers at the beginning of `rest`.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if there are fewer.
    pub(super) fn floats<const N: usize>(self, rest: &str) -> Result<[f32; N]> {
        let numbers = self.numbers::<N>(rest)?.map(|number| number as f32);
        match numbers.iter().all(|number| number.is_finite()) {
            true => Ok(numbers),
            false => Err(self.error(format!("`{}` has no finite numbers", shorten(rest)))),
        }
    }

    pub(super) fn error(self, what: impl Into<String>) -> Error {
        Error::invalid(self.place(), what)
    }

    /// The line as messages name it.
    pub(super) fn place(self) -> String {
        format!("line {}", self.number)
    }
}

/// A message on a position with a finite coordinate beyond [`MAX_COORDINATE`], if it has one.
pub(super) fn too_large(position: [f64; 3]) -> Option<String> {
    let is_large = |x: &&f64| x.is_finite() && x.abs() > MAX_COORDINATE;
    let large = position.iter().find(is_large)?;
    Some(format!(
        "the coordinate {large:e} is beyond {MAX_COORDINATE:e}, where floats overflow: scale it down"
    ))
}

/// Whether a word is what C libraries write for a number that is none or infinite: `-nan(ind)`,
/// `1.#QNAN`, `inf`.
pub(super) fn is_no_number(word: &str) -> bool {
    let word = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    ["nan", "1.#", "inf"].iter().any(|begin| word.starts_with(begin))
}

/// The beginning of what a message quotes from a file.
pub(super) fn shorten(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Vec<(usize, String)> {
        lines(&decode(bytes)).map(|line| (line.number, line.text.to_owned())).collect()
    }

    #[test]
    fn a_text_is_the_same_in_all_encodings_and_line_ends() {
        let text = "v 1\n\n# é\nmtllib ä.mtl\n";
        let expected = read(text.as_bytes());
        assert_eq!(expected, [(1, "v 1".to_owned()), (4, "mtllib ä.mtl".to_owned())]);
        let marked = format!("\u{feff}{text}");
        let units = |text: &str| text.encode_utf16().collect::<Vec<u16>>();
        let little = |text| units(text).iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big = |text| units(text).iter().flat_map(|unit| unit.to_be_bytes()).collect();
        let encodings: [Vec<u8>; 8] = [
            marked.clone().into(),
            little(&marked),
            big(&marked),
            little(text),
            big(text),
            text.replace('\n', "\r").into(),
            text.replace('\n', "\r\n").into(),
            text.replace("\n\n", "\r\r").into(),
        ];
        for bytes in encodings {
            assert_eq!(read(&bytes), expected, "{bytes:?}");
        }
        assert_eq!(read("v 1\n\u{feff}v 2".as_bytes())[1].1, "v 2", "files that were joined");
    }

    #[test]
    fn what_c_libraries_write_for_no_number_is_none() {
        let line = Line { number: 7, text: "" };
        for word in ["nan", "-nan", "NaN", "-nan(ind)", "nan(snan)", "1.#QNAN", "-1.#IND", "1.#INF"]
        {
            assert!(line.number(word).is_ok_and(f64::is_nan), "{word}");
        }
        assert!(line.number("none").unwrap_err().to_string().starts_with("line 7: `none`"));
        assert!(line.numbers("inf 1").is_ok_and(|numbers| numbers == [f64::INFINITY, 1.0]));
        assert!(line.position("1e18 -1e18 0").is_ok());
        let error = line.position("0 -3.4e38 0").unwrap_err().to_string();
        assert!(error.starts_with("line 7: the coordinate -3.4e38"), "{error}");
    }
}
