//! Reads typed keys out of parsed TOML and notes every mistake with its place, instead of stopping at the first.

use std::ops::Range;
use std::time::Duration;

use busbar_profile::Collector;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and where it stands in the text.
#[derive(Debug, Clone)]
pub(super) struct At<T> {
    pub(super) value: T,
    pub(super) span: Range<usize>,
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
                let remedy = match keys.iter().find(|known| alike(known, word)) {
                    Some(known) => format!("did you mean `{known}`?"),
                    None => format!("write one of: {}", keys.join(", ")),
                };
                findings.add(key.span(), format!("unknown key `{word}` in {name}"), remedy);
            }
        }
        Self { name, table, span }
    }

    /// The value of a key, or a report that it is missing, with what to add.
    pub(super) fn required<T>(
        &self,
        key: &str,
        example: &str,
        findings: &mut Collector<'_>,
        read: impl FnOnce(&Self, &str, &mut Collector<'_>) -> Option<T>,
    ) -> Option<T> {
        if !self.table.contains_key(key) {
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

    /// A duration within `limits`.
    pub(super) fn duration(
        &self,
        key: &str,
        limits: std::ops::RangeInclusive<Duration>,
        findings: &mut Collector<'_>,
    ) -> Option<At<Duration>> {
        const HELP: &str = "write a number and ms, s, min or h, such as \"500ms\" or \"10s\"";
        let value = self.value(key)?;
        let Some(text) = value.get_ref().as_str() else {
            return wrong_type(key, value, "a duration in quotes, such as \"1s\"", findings);
        };
        let Some(duration) = parse_duration(text) else {
            findings.add(value.span(), format!("`{text}` is no duration"), HELP);
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

/// `500ms`, `1s`, `2min`, `1h`; nothing else.
fn parse_duration(text: &str) -> Option<Duration> {
    let digits = text.find(|c: char| !c.is_ascii_digit())?;
    let number: u64 = text[..digits].parse().ok()?;
    let milliseconds = match &text[digits..] {
        "ms" => 1,
        "s" => 1_000,
        "min" => 60_000,
        "h" => 3_600_000,
        _ => return None,
    };
    number.checked_mul(milliseconds).map(Duration::from_millis)
}

fn in_words(duration: Duration) -> String {
    match duration.as_millis() {
        0 => "0s".to_owned(),
        ms if ms % 3_600_000 == 0 => format!("{}h", ms / 3_600_000),
        ms if ms % 60_000 == 0 => format!("{}min", ms / 60_000),
        ms if ms % 1_000 == 0 => format!("{}s", ms / 1_000),
        ms => format!("{ms}ms"),
    }
}

/// Whether two words differ by one slip: a letter too many, too few, changed, or two swapped.
fn alike(known: &str, word: &str) -> bool {
    let (a, b): (Vec<char>, Vec<char>) = (known.chars().collect(), word.chars().collect());
    let same_start = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let (a, b) = (&a[same_start..], &b[same_start..]);
    let same_end = a.iter().rev().zip(b.iter().rev()).take_while(|(a, b)| a == b).count();
    match (&a[..a.len() - same_end], &b[..b.len() - same_end]) {
        ([_] | [], [_] | []) => true,
        ([a1, a2], [b1, b2]) => a1 == b2 && a2 == b1,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations() {
        for (text, expected) in [
            ("500ms", Some(500)),
            ("1s", Some(1_000)),
            ("2min", Some(120_000)),
            ("1h", Some(3_600_000)),
            ("1", None),
            ("s", None),
            ("", None),
            ("-1s", None),
            ("1.5s", None),
            ("1 s", None),
            ("1d", None),
            ("99999999999999999999s", None),
            ("9999999999999999999h", None),
        ] {
            assert_eq!(parse_duration(text), expected.map(Duration::from_millis), "{text}");
        }
        assert_eq!(in_words(Duration::from_millis(1_500)), "1500ms");
        assert_eq!(in_words(Duration::from_secs(60)), "1min");
        assert_eq!(in_words(Duration::ZERO), "0s");
    }

    #[test]
    fn slips_are_recognised() {
        for (word, known) in
            [("unti", "unit"), ("uni", "unit"), ("unitt", "unit"), ("unat", "unit"), ("profil", "profile")]
        {
            assert!(alike(known, word), "{word}");
        }
        assert!(!alike("unit", "name"));
        assert!(!alike("wire", "endpoint"));
    }
}
