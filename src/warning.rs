//! Warnings: all that was left out, guessed or mended, each with its place and what to do.
//!
//! Whoever reads or changes an asset adds them to [`Asset::warnings`] or to a list that it returns; the
//! reports show them, and the command line prints a line of each. Equal texts are one warning with a
//! count, at the place of the first, so a scan with a million bad normals says so once. Lists made in
//! parallel are joined in the order of what they are about, and so are the same at any number of
//! threads.
//!
//! [`Asset::warnings`]: crate::document::asset::Asset::warnings

use std::borrow::Cow;
use std::fmt::{Display, Formatter};
use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Result};

/// Most warnings of different texts: a file of a million materials that are not there is told of by
/// its first, and the rest is counted.
const MAX_TEXTS: usize = 100;

/// The text in place of those beyond [`MAX_TEXTS`].
const MORE: &str = "more of other kinds; mend the others first";

/// One thing that was left out, guessed or mended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// The first place: a JSON pointer in a glTF document, a line, or a file and a line.
    pub at: String,
    /// The problem there, how it was handled, and what to do.
    pub what: Cow<'static, str>,
    /// How many places it is about.
    pub times: usize,
}

impl Display for Warning {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Self { at, what, times } = self;
        match times {
            1 => write!(f, "{at}: {what}"),
            _ => write!(f, "{what}, {times} times, first at {at}"),
        }
    }
}

/// Warnings in the order of their first places.
///
/// ```
/// use seamwise::warning::Warnings;
///
/// let mut warnings = Warnings::default();
/// for line in [12, 40] {
///     warnings.add(format_args!("line {line}"), "a UV that is not finite: it is taken for 0 0");
/// }
/// let line = warnings.iter().next().unwrap().to_string();
/// assert_eq!(line, "a UV that is not finite: it is taken for 0 0, 2 times, first at line 12");
/// assert!(warnings.refuse_if(true).is_err(), "--strict");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Warnings {
    list: Vec<Warning>,
}

impl Warnings {
    /// Adds one, or counts it if its text is known. `what` names no place; it says what is wrong, then
    /// what to do: "there is no material `steel`: the default is used; define it in the .mtl".
    pub fn add(&mut self, at: impl Display, what: impl Into<Cow<'static, str>>) {
        self.count(&at, what.into(), 1);
    }

    /// Adds those of another list behind these.
    pub fn extend(&mut self, other: Self) {
        for Warning { at, what, times } in other.list {
            self.count(&at, what, times);
        }
    }

    /// The same with the file they were found in, for reports on several.
    #[must_use]
    pub fn in_file(mut self, path: &Path) -> Self {
        for warning in &mut self.list {
            warning.at = format!("{}: {}", path.display(), warning.at);
        }
        self
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Warning> {
        self.list.iter()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Takes them for errors if `strict`.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the first, and the number of others.
    pub fn refuse_if(&self, strict: bool) -> Result<()> {
        let Some(Warning { at, what, .. }) = self.list.first().filter(|_| strict) else {
            return Ok(());
        };
        let others: usize = self.list.iter().map(|warning| warning.times).sum::<usize>() - 1;
        let others = if others == 0 { String::new() } else { format!(", nor {others} more") };
        Err(Error::invalid(at, format!("{what} (--strict does not let this pass{others})")))
    }

    fn count(&mut self, at: &dyn Display, what: Cow<'static, str>, times: usize) {
        let what = match self.list.iter().any(|warning| warning.what == what) {
            false if self.list.len() >= MAX_TEXTS => MORE.into(),
            _ => what,
        };
        match self.list.iter_mut().find(|warning| warning.what == what) {
            Some(known) => known.times += times,
            None => self.list.push(Warning { at: at.to_string(), what, times }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_texts_are_one_line_with_a_count_and_the_first_place() {
        let mut warnings = Warnings::default();
        for line in [12, 15, 90] {
            warnings.add(format_args!("line {line}"), "a normal is not finite: left out");
        }
        let mut others = Warnings::default();
        others.add("line 7", "no picture `a.png`: left out; put it there");
        others.add("line 99", "a normal is not finite: left out");
        warnings.extend(others);
        let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "a normal is not finite: left out, 4 times, first at line 12",
                "line 7: no picture `a.png`: left out; put it there",
            ]
        );
        let named = warnings.in_file(Path::new("a.obj"));
        assert_eq!(
            named.iter().last().unwrap().to_string(),
            "a.obj: line 7: no picture `a.png`: left out; put it there"
        );
    }

    #[test]
    fn as_many_texts_as_a_file_can_hold_end_in_a_count() {
        let mut warnings = Warnings::default();
        (0..1000).for_each(|name| warnings.add("line 1", format!("no material `{name}`")));
        assert_eq!(warnings.iter().count(), MAX_TEXTS + 1);
        assert_eq!(warnings.iter().map(|warning| warning.times).sum::<usize>(), 1000);
    }

    #[test]
    fn strictness_makes_an_error_of_the_first_and_counts_the_others() {
        let mut warnings = Warnings::default();
        assert!(warnings.refuse_if(true).is_ok());
        warnings.add("line 3", "no .mtl: left out; put it there");
        assert!(warnings.refuse_if(false).is_ok());
        let said = |warnings: &Warnings| warnings.refuse_if(true).unwrap_err().to_string();
        let alone = "line 3: no .mtl: left out; put it there (--strict does not let this pass)";
        assert_eq!(said(&warnings), alone);
        warnings.add("line 4", "another");
        warnings.add("line 5", "another");
        assert!(said(&warnings).ends_with("pass, nor 2 more)"), "{}", said(&warnings));
    }
}
