//! Typed values out of parsed TOML, each with its place, and the findings where one is wrong.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use busbar_profile::text::{duration, in_words, shown};
use busbar_profile::{Collector, Findings, nearest};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Place;

/// Who has mended these will be told the others.
const MOST_FOUND: usize = 100;

/// The text of a file and what was found wrong with it.
pub(super) struct Notes<'a> {
    text: &'a str,
    /// Where its lines begin.
    lines: Vec<usize>,
    findings: Collector<'a>,
    count: usize,
}

/// A key with its value.
pub(super) struct Entry<'t, 'i> {
    /// With dots where it lies in tables below.
    pub(super) key: String,
    pub(super) span: Range<usize>,
    pub(super) value: &'t Spanned<DeValue<'i>>,
}

impl<'a> Notes<'a> {
    pub(super) fn new(file: &'a str, text: &'a str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(newline, _)| newline + 1));
        Self { text, lines: lines.collect(), findings: Collector::new(file, text), count: 0 }
    }

    pub(super) fn add(&mut self, span: Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        self.count += 1;
        self.findings.add(span, message, help);
    }

    /// Notes an error of the emulator, whose sentences end with the remedy.
    pub(super) fn add_error(&mut self, span: Range<usize>, error: &impl ToString) {
        let sentence = error.to_string();
        let halves = sentence.split_once("; ").or_else(|| sentence.split_once(": "));
        let (message, help) = halves.unwrap_or((&sentence, "correct it"));
        self.add(span, message, help);
    }

    pub(super) fn is_clean(&self) -> bool {
        self.count == 0
    }

    /// Whether that much was found that nobody reads on, nor looks for more.
    pub(super) fn is_full(&self) -> bool {
        self.count >= MOST_FOUND
    }

    pub(super) fn finish(self) -> Result<(), Findings> {
        self.findings.finish()
    }

    pub(super) fn place(&self, offset: usize) -> Place {
        let line = self.lines.partition_point(|start| *start <= offset);
        let start = line.checked_sub(1).and_then(|index| self.lines.get(index)).copied().unwrap_or_default();
        let before = self.text.get(start..offset).unwrap_or_default();
        Place { line, column: before.trim_start_matches('\u{FEFF}').chars().count() + 1 }
    }

    /// Where a part of a text value stands in the file; the whole value where escapes moved it.
    pub(super) fn inside(&self, value: &Range<usize>, content: &str, part: &Range<usize>) -> Range<usize> {
        let start = value.start + 1;
        match self.text.get(start..value.end.saturating_sub(1)) {
            Some(between) if between == content => start + part.start..start + part.end,
            _ => value.clone(),
        }
    }

    /// A key that is not there, with what to add.
    pub(super) fn missing(&mut self, table: Range<usize>, name: &str, key: &str, example: &str) {
        self.add(table, format!("`{key}` is missing in {name}"), format!("add `{key} = {example}`"));
    }

    pub(super) fn text(&mut self, entry: &Entry<'_, '_>) -> Option<String> {
        match entry.value.get_ref().as_str() {
            Some(text) => Some(text.to_owned()),
            None => self.wrong_type(entry, "a text in quotes"),
        }
    }

    /// A text on one line, of so many characters at most.
    pub(super) fn line(&mut self, entry: &Entry<'_, '_>, most: usize) -> Option<String> {
        let text = self.text(entry)?;
        let text = text.trim();
        let fits = (1..=most).contains(&text.chars().count()) && !text.contains(char::is_control);
        if !fits {
            let message = format!("this is no {}", entry.key);
            self.add(entry.value.span(), message, format!("write 1 to {most} characters on one line"));
        }
        fits.then(|| text.to_owned())
    }

    /// One text, or a list of texts, each with its place.
    pub(super) fn texts(&mut self, entry: &Entry<'_, '_>) -> Vec<(String, Range<usize>)> {
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
    pub(super) fn plain(&mut self, entry: &Entry<'_, '_>) -> Option<String> {
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
    pub(super) fn whole(&mut self, entry: &Entry<'_, '_>) -> Option<u64> {
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

    pub(super) fn duration(
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
    pub(super) fn table<'t, 'i>(&mut self, entry: &Entry<'t, 'i>) -> Option<Vec<Entry<'t, 'i>>> {
        match entry.value.get_ref().as_table() {
            Some(table) => Some(entries(table)),
            None => self.wrong_type(entry, "a table, such as { name = 1 }"),
        }
    }

    pub(super) fn wrong_type<T>(&mut self, entry: &Entry<'_, '_>, wanted: &str) -> Option<T> {
        let found = entry.value.get_ref().type_str();
        let message = format!("`{}` has the wrong type ({found})", shown(&entry.key));
        self.add(entry.value.span(), message, format!("write {wanted}"));
        None
    }

    /// Reports a key that is none of the known ones.
    pub(super) fn unknown_key(&mut self, entry: &Entry<'_, '_>, table: &str, known: &[&str]) {
        let help = match nearest(&entry.key, known.iter().copied()) {
            Some(known) => format!("did you mean `{known}`?"),
            None => format!("write one of: {}", known.join(", ")),
        };
        self.add(entry.span.clone(), format!("unknown key `{}` in {table}", shown(&entry.key)), help);
    }
}

/// The entries of a table, in the order of the file.
pub(super) fn entries<'t, 'i>(table: &'t DeTable<'i>) -> Vec<Entry<'t, 'i>> {
    let mut entries: Vec<_> = table
        .iter()
        .map(|(key, value)| Entry { key: key.get_ref().to_string(), span: key.span(), value })
        .collect();
    entries.sort_by_key(|entry| entry.span.start);
    entries
}

/// The entries with what lies in tables below, but for the keys that are tables themselves: `breaker.genset = ...` and
/// `"breaker.genset" = ...` are the same.
pub(super) fn flat<'t, 'i>(table: &'t DeTable<'i>, tables: &[&str]) -> Vec<Entry<'t, 'i>> {
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
