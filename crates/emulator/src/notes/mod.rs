//! TOML files of people: typed values with their places, and a finding with a remedy where one is wrong.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use busbar_profile::text::{duration, in_words, shown};
use busbar_profile::{Collector, Findings, Profile, builtin, builtins, nearest};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::device::Device;

/// Who has mended these will be told the others.
const MOST_FOUND: usize = 100;

/// Where something stands in a file, both from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) line: usize,
    pub(crate) column: usize,
}

/// Reads a file whose name only serves the findings; `twice` is what to do about a key that is there twice. Nothing comes of a text in which anything is wrong.
///
/// # Errors
/// Everything that is wrong with it.
pub(crate) fn read<T>(
    file: &str,
    text: &str,
    twice: &str,
    understand: impl FnOnce(&DeTable<'_>, &mut Notes<'_>) -> Option<T>,
) -> Result<Option<T>, Findings> {
    let mut notes = Notes::new(file, text);
    let (root, errors) = DeTable::parse_recoverable(text);
    for error in errors {
        let span = error.span().unwrap_or(0..0);
        let message = error.message().replace('\n', ", ");
        let help = match message.starts_with("duplicate key") {
            true => twice,
            false => syntax_help(text, span.start),
        };
        notes.add(span, format!("this is not TOML: {message}"), help);
    }
    if !notes.is_clean() {
        // After a syntax error the rest of the text means who knows what.
        notes.finish()?;
        notes = Notes::new(file, text);
    }
    let understood = understand(root.get_ref(), &mut notes);
    notes.finish()?;
    Ok(understood)
}

/// What to do about a value that TOML does not understand.
fn syntax_help(text: &str, at: usize) -> &'static str {
    let before = text.get(..at).unwrap_or(text).trim_end_matches(|c: char| c.is_alphanumeric());
    match before.trim_end().ends_with('=') {
        true => "put texts and durations in quotes, such as mains = \"failed\" or at = \"10s\"",
        false => "mend the syntax; https://toml.io shows it",
    }
}

/// The text of a file and what was found wrong with it.
pub(crate) struct Notes<'a> {
    text: &'a str,
    /// Where its lines begin.
    lines: Vec<usize>,
    findings: Collector<'a>,
    count: usize,
}

/// A key with its value.
pub(crate) struct Entry<'t, 'i> {
    /// With dots where it lies in tables below.
    pub(crate) key: String,
    pub(crate) span: Range<usize>,
    pub(crate) value: &'t Spanned<DeValue<'i>>,
}

impl<'a> Notes<'a> {
    fn new(file: &'a str, text: &'a str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(newline, _)| newline + 1));
        Self { text, lines: lines.collect(), findings: Collector::new(file, text), count: 0 }
    }

    pub(crate) fn add(&mut self, span: Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        self.count += 1;
        self.findings.add(span, message, help);
    }

    /// Notes an error of the emulator, whose sentences end with the remedy.
    pub(crate) fn add_error(&mut self, span: Range<usize>, error: &impl ToString) {
        let sentence = error.to_string();
        let halves = sentence.split_once("; ").or_else(|| sentence.split_once(": "));
        let (message, help) = halves.unwrap_or((&sentence, "correct it"));
        self.add(span, message, help);
    }

    pub(crate) fn is_clean(&self) -> bool {
        self.count == 0
    }

    /// Whether that much was found that nobody reads on, nor looks for more.
    pub(crate) fn is_full(&self) -> bool {
        self.count >= MOST_FOUND
    }

    fn finish(self) -> Result<(), Findings> {
        self.findings.finish()
    }

    pub(crate) fn place(&self, offset: usize) -> Place {
        let line = self.lines.partition_point(|start| *start <= offset);
        let start = line.checked_sub(1).and_then(|index| self.lines.get(index)).copied().unwrap_or_default();
        let before = self.text.get(start..offset).unwrap_or_default();
        Place { line, column: before.trim_start_matches('\u{FEFF}').chars().count() + 1 }
    }

    /// Where a part of a text value stands in the file; the whole value where escapes moved it.
    pub(crate) fn inside(&self, value: &Range<usize>, content: &str, part: &Range<usize>) -> Range<usize> {
        let start = value.start + 1;
        match self.text.get(start..value.end.saturating_sub(1)) {
            Some(between) if between == content => start + part.start..start + part.end,
            _ => value.clone(),
        }
    }

    /// A key that is not there, with what to add.
    pub(crate) fn missing(&mut self, table: Range<usize>, name: &str, key: &str, example: &str) {
        self.add(table, format!("`{key}` is missing in {name}"), format!("add `{key} = {example}`"));
    }

    pub(crate) fn text(&mut self, entry: &Entry<'_, '_>) -> Option<String> {
        match entry.value.get_ref().as_str() {
            Some(text) => Some(text.to_owned()),
            None => self.wrong_type(entry, "a text in quotes"),
        }
    }

    /// A text on one line, of so many characters at most.
    pub(crate) fn line(&mut self, entry: &Entry<'_, '_>, most: usize) -> Option<String> {
        let text = self.text(entry)?;
        let text = text.trim();
        let fits = (1..=most).contains(&text.chars().count()) && !text.contains(char::is_control);
        if !fits {
            let message = format!("this is no {}", entry.key);
            self.add(entry.value.span(), message, format!("write 1 to {most} characters on one line"));
        }
        fits.then(|| text.to_owned())
    }

    /// The built-in profile of a key.
    pub(crate) fn profile(&mut self, entry: &Entry<'_, '_>) -> Option<&'static Profile> {
        let key = self.text(entry)?;
        let found = builtin(&key);
        if found.is_none() {
            let keys: Vec<_> = builtins().iter().map(|profile| profile.key.as_str()).collect();
            let help = match nearest(&key, keys.iter().copied()) {
                Some(key) => format!("did you mean `{key}`?"),
                None => format!("write one of: {}", keys.join(", ")),
            };
            self.add(entry.value.span(), format!("there is no controller `{}`", shown(&key)), help);
        }
        found
    }

    /// A setting and what it is set to, if the controller can be set so.
    pub(crate) fn setting(&mut self, probe: &mut Device, entry: &Entry<'_, '_>) -> Option<String> {
        let value = match entry.value.get_ref().as_bool() {
            Some(yes) => u8::from(yes).to_string(),
            None => self.plain(entry)?,
        };
        match probe.set(&entry.key, &value) {
            Ok(()) => Some(value),
            Err(error) => {
                self.add_error(entry.span.clone(), &error);
                None
            }
        }
    }

    /// One text, or a list of texts, each with its place.
    pub(crate) fn texts(&mut self, entry: &Entry<'_, '_>) -> Vec<(String, Range<usize>)> {
        let items = match entry.value.get_ref() {
            DeValue::Array(items) => items.iter().collect(),
            _ => vec![entry.value],
        };
        let mut texts = Vec::new();
        for item in items {
            match item.get_ref().as_str() {
                Some(text) => texts.push((text.to_owned(), item.span())),
                None => {
                    self.wrong_type::<()>(entry, "a text in quotes, or a list of such");
                    return Vec::new();
                }
            }
        }
        texts
    }

    /// A text or a number, as text.
    pub(crate) fn plain(&mut self, entry: &Entry<'_, '_>) -> Option<String> {
        match entry.value.get_ref() {
            DeValue::String(text) => Some(text.as_ref().to_owned()),
            DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(number) => Some(number.to_string()),
                Err(_) => {
                    let message = format!("`{}` is {}", entry.key, shown(integer.as_str()));
                    self.add(entry.value.span(), message, "write a smaller number");
                    None
                }
            },
            DeValue::Float(float) => Some(float.as_str().to_owned()),
            _ => self.wrong_type(entry, "a text in quotes, or a number"),
        }
    }

    /// A whole number that is not negative.
    pub(crate) fn whole(&mut self, entry: &Entry<'_, '_>) -> Option<u64> {
        let Some(integer) = entry.value.get_ref().as_integer() else {
            return self.wrong_type(entry, "a whole number without quotes");
        };
        let number = u64::from_str_radix(integer.as_str(), integer.radix()).ok();
        if number.is_none() {
            let message = format!("`{}` is {}", entry.key, shown(integer.as_str()));
            self.add(entry.value.span(), message, format!("write a whole number from 0 to {}", u64::MAX));
        }
        number
    }

    pub(crate) fn duration(
        &mut self,
        entry: &Entry<'_, '_>,
        limits: RangeInclusive<Duration>,
    ) -> Option<Duration> {
        let Some(text) = entry.value.get_ref().as_str() else {
            return self.wrong_type(entry, "a duration in quotes, such as \"10s\"");
        };
        let Some(duration) = duration(text) else {
            self.add(
                entry.value.span(),
                format!("`{}` is no duration", shown(text)),
                "write a number and ms, s, min or h, such as \"500ms\" or \"10s\"",
            );
            return None;
        };
        if !limits.contains(&duration) {
            self.add(
                entry.value.span(),
                format!("`{}` is {text}", entry.key),
                format!("write a duration from {} to {}", in_words(*limits.start()), in_words(*limits.end())),
            );
            return None;
        }
        Some(duration)
    }

    /// The entries of a table, in the order of the file.
    pub(crate) fn table<'t, 'i>(&mut self, entry: &Entry<'t, 'i>) -> Option<Vec<Entry<'t, 'i>>> {
        match entry.value.get_ref().as_table() {
            Some(table) => Some(entries(table)),
            None => self.wrong_type(entry, "a table, such as { name = 1 }"),
        }
    }

    /// The tables of a list of tables, each with its place.
    pub(crate) fn tables<'t, 'i>(&mut self, entry: &Entry<'t, 'i>) -> Vec<(&'t DeTable<'i>, Range<usize>)> {
        let items = entry.value.get_ref().as_array();
        let tables: Option<Vec<_>> = items.and_then(|items| {
            items.iter().map(|item| Some((item.get_ref().as_table()?, item.span()))).collect()
        });
        tables.unwrap_or_else(|| {
            self.wrong_type::<()>(entry, &format!("a list of tables, each headed [[{}]]", entry.key));
            Vec::new()
        })
    }

    pub(crate) fn wrong_type<T>(&mut self, entry: &Entry<'_, '_>, wanted: &str) -> Option<T> {
        let found = entry.value.get_ref().type_str();
        let message = format!("`{}` has the wrong type ({found})", shown(&entry.key));
        self.add(entry.value.span(), message, format!("write {wanted}"));
        None
    }

    /// Reports a key that is none of the known ones.
    pub(crate) fn unknown_key(&mut self, entry: &Entry<'_, '_>, table: &str, known: &[&str]) {
        let help = match nearest(&entry.key, known.iter().copied()) {
            Some(known) => format!("did you mean `{known}`?"),
            None => format!("write one of: {}", known.join(", ")),
        };
        self.add(entry.span.clone(), format!("unknown key `{}` in {table}", shown(&entry.key)), help);
    }
}

/// The entries of a table, in the order of the file.
pub(crate) fn entries<'t, 'i>(table: &'t DeTable<'i>) -> Vec<Entry<'t, 'i>> {
    let mut entries: Vec<_> = table
        .iter()
        .map(|(key, value)| Entry { key: key.get_ref().to_string(), span: key.span(), value })
        .collect();
    entries.sort_by_key(|entry| entry.span.start);
    entries
}

/// The entries with what lies in tables below, but for the keys that are tables themselves: `breaker.genset = ...` and
/// `"breaker.genset" = ...` are the same.
pub(crate) fn flat<'t, 'i>(table: &'t DeTable<'i>, tables: &[&str]) -> Vec<Entry<'t, 'i>> {
    let mut flat = Vec::new();
    for entry in entries(table) {
        flatten(entry, tables, &mut flat);
    }
    flat
}

fn flatten<'t, 'i>(entry: Entry<'t, 'i>, tables: &[&str], out: &mut Vec<Entry<'t, 'i>>) {
    let below = entry.value.get_ref().as_table().filter(|_| !tables.contains(&entry.key.as_str()));
    let Some(below) = below else { return out.push(entry) };
    for mut inner in entries(below) {
        inner.key = format!("{}.{}", entry.key, inner.key);
        flatten(inner, tables, out);
    }
}
