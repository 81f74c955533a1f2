//! Reads typed keys out of parsed TOML and notes every mistake with its place, instead of stopping at the first.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use busbar_profile::Collector;
use busbar_profile::text::{duration, in_words, shown};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::words::meant;

/// A value and where it stands in the text.
#[derive(Debug, Clone)]
pub(super) struct At<T> {
    pub(super) value: T,
    pub(super) span: Range<usize>,
}

/// What a number may be.
pub(super) struct Limits {
    pub(super) range: RangeInclusive<f64>,
    /// The same for people.
    pub(super) words: &'static str,
}

/// One table of the file; asking it for a key that is not declared in `keys` is a bug of the caller.
pub(super) struct Table<'t, 'i> {
    /// As a person would call it: `[server]`, `[[devices]]`.
    name: &'static str,
    table: &'t DeTable<'i>,
    /// Where a missing key is reported.
    pub(super) span: Range<usize>,
}

impl<'t, 'i> Table<'t, 'i> {
    /// Takes a table and reports every key that is not among `keys`.
    pub(super) fn new(
        name: &'static str,
        keys: &[&str],
        table: &'t DeTable<'i>,
        span: Range<usize>,
        findings: &mut Collector<'_>,
    ) -> Self {
        for key in table.keys() {
            let word = key.get_ref().as_ref();
            if !keys.contains(&word) {
                let known = keys.iter().copied();
                let remedy = match meant(word, known.clone()) {
                    Some(known) => format!("did you mean `{known}`?"),
                    None => format!("write one of: {}", known.collect::<Vec<_>>().join(", ")),
                };
                findings.add(key.span(), format!("unknown key `{}` in {name}", shown(word)), remedy);
            }
        }
        Self { name, table, span }
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// The value of a key, or a report that it is missing, with what to add.
    pub(super) fn required<T>(
        &self,
        key: &str,
        example: &str,
        findings: &mut Collector<'_>,
        read: impl FnOnce(&Self, &str, &mut Collector<'_>) -> Option<T>,
    ) -> Option<T> {
        if !self.has(key) {
            findings.add(
                self.span.clone(),
                format!("`{key}` is missing in {}", self.name),
                format!("add `{key} = {example}`"),
            );
            return None;
        }
        read(self, key, findings)
    }

    pub(super) fn string(&self, key: &str, findings: &mut Collector<'_>) -> Option<At<String>> {
        let value = self.value(key)?;
        match value.get_ref().as_str() {
            Some(text) => Some(At { value: text.to_owned(), span: value.span() }),
            None => wrong_type(key, value, "a text in quotes", findings),
        }
    }

    /// The texts of a list; what is no text in it is reported and left out.
    pub(super) fn texts(&self, key: &str, findings: &mut Collector<'_>) -> Vec<At<String>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        let Some(list) = value.get_ref().as_array() else {
            wrong_type::<()>(key, value, "a list of texts in quotes, in square brackets", findings);
            return Vec::new();
        };
        let text = |item: &Spanned<DeValue<'_>>| match item.get_ref().as_str() {
            Some(text) => Some(At { value: text.to_owned(), span: item.span() }),
            None => wrong_type(key, item, "each text in quotes", findings),
        };
        list.iter().filter_map(text).collect()
    }

    pub(super) fn integer(&self, key: &str, findings: &mut Collector<'_>) -> Option<At<i64>> {
        let value = self.value(key)?;
        let Some(integer) = value.get_ref().as_integer() else {
            return wrong_type(key, value, "a whole number without quotes", findings);
        };
        match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(integer) => Some(At { value: integer, span: value.span() }),
            Err(_) => {
                findings.add(value.span(), format!("`{key}` is too large"), "write a smaller number");
                None
            }
        }
    }

    pub(super) fn boolean(&self, key: &str, findings: &mut Collector<'_>) -> Option<bool> {
        let value = self.value(key)?;
        value.get_ref().as_bool().or_else(|| wrong_type(key, value, "true or false without quotes", findings))
    }

    /// A number within `limits`, with or without a fraction.
    pub(super) fn number(&self, key: &str, limits: &Limits, findings: &mut Collector<'_>) -> Option<At<f64>> {
        let value = self.value(key)?;
        let (text, number) = match value.get_ref() {
            DeValue::Float(float) => (float.as_str(), float.as_str().parse().ok()),
            DeValue::Integer(integer) => {
                let whole = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
                (integer.as_str(), whole.map(|whole| whole as f64))
            }
            _ => return wrong_type(key, value, "a number without quotes", findings),
        };
        let Some(number) = number.filter(|number| limits.range.contains(number)) else {
            findings.add(
                value.span(),
                format!("`{key}` is {}", shown(text)),
                format!("write a number {}", limits.words),
            );
            return None;
        };
        Some(At { value: number, span: value.span() })
    }

    /// A duration within `limits`.
    pub(super) fn duration(
        &self,
        key: &str,
        limits: RangeInclusive<Duration>,
        findings: &mut Collector<'_>,
    ) -> Option<At<Duration>> {
        const HELP: &str = "write a number and ms, s, min or h, such as \"500ms\" or \"10s\"";
        let value = self.value(key)?;
        let Some(text) = value.get_ref().as_str() else {
            return wrong_type(key, value, "a duration in quotes, such as \"1s\"", findings);
        };
        let Some(duration) = duration(text) else {
            findings.add(value.span(), format!("`{}` is no duration", shown(text)), HELP);
            return None;
        };
        if !limits.contains(&duration) {
            findings.add(
                value.span(),
                format!("`{key}` is {text}"),
                format!("write a duration from {} to {}", in_words(*limits.start()), in_words(*limits.end())),
            );
            return None;
        }
        Some(At { value: duration, span: value.span() })
    }

    /// A table under this one.
    pub(super) fn table(
        &self,
        key: &str,
        name: &'static str,
        keys: &[&str],
        findings: &mut Collector<'_>,
    ) -> Option<Table<'t, 'i>> {
        let value = self.value(key)?;
        match value.get_ref().as_table() {
            Some(table) => Some(Table::new(name, keys, table, value.span(), findings)),
            None => wrong_type(key, value, "a table", findings),
        }
    }

    /// The tables of an array, `[[name]]`.
    pub(super) fn tables(
        &self,
        key: &str,
        name: &'static str,
        keys: &[&str],
        findings: &mut Collector<'_>,
    ) -> Vec<Table<'t, 'i>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        let Some(array) = value.get_ref().as_array() else {
            wrong_type::<()>(key, value, &format!("a list of tables, each headed {name}"), findings);
            return Vec::new();
        };
        let mut tables = Vec::new();
        for item in array.iter() {
            match item.get_ref().as_table() {
                Some(table) => tables.push(Table::new(name, keys, table, item.span(), findings)),
                None => {
                    wrong_type::<()>(key, item, "a table", findings);
                }
            }
        }
        tables
    }

    fn value(&self, key: &str) -> Option<&'t Spanned<DeValue<'i>>> {
        self.table.get(key)
    }
}

fn wrong_type<T>(
    key: &str,
    value: &Spanned<DeValue<'_>>,
    wanted: &str,
    findings: &mut Collector<'_>,
) -> Option<T> {
    let found = value.get_ref().type_str();
    findings.add(value.span(), format!("`{key}` has the wrong type ({found})"), format!("write {wanted}"));
    None
}
