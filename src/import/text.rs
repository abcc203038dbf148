//! Lines and words of the formats that are texts.

use std::borrow::Cow;
use std::str::FromStr;

use crate::error::{Error, Result};

/// A line with its number, counted from 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

/// A file's text. Only names in it may be no UTF-8, and are then found by no file.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// The lines that are neither empty nor comments, without space around.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.lines().enumerate().filter_map(|(at, text)| {
        let text = text.trim();
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

    /// Reads `N` finite numbers at the beginning of `rest`.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line if there are fewer.
    pub(super) fn floats<const N: usize>(self, rest: &str) -> Result<[f32; N]> {
        let mut words = words(rest);
        let mut numbers = [0.0f32; N];
        for number in &mut numbers {
            let word = words.next().ok_or_else(|| self.error(format!("fewer than {N} numbers")))?;
            *number = self.parse(word)?;
            if !number.is_finite() {
                return Err(self.error(format!("`{}` is no finite number", shorten(word))));
            }
        }
        Ok(numbers)
    }

    pub(super) fn error(self, what: impl Into<String>) -> Error {
        Error::invalid(format!("line {}", self.number), what)
    }
}

/// The beginning of what a message quotes from a file.
pub(super) fn shorten(text: &str) -> String {
    text.chars().take(40).collect()
}
