//! From TOML text to the types of the file, with as many findings at once as the text allows.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Error, ValueDeserializer};

use super::lint::newer_than_1_0;
use crate::findings::Collector;
use crate::suggest::nearest;

/// Takes the elements of a list out of the tree that are not of the list's type, noting each.
pub(super) type Prune = fn(&mut DeTable<'_>, &mut Collector<'_>);

/// Reads a text as `T`. `prunes` name the long lists of the file, so that every bad line in them is reported and not
/// only the first.
pub(super) fn read<T: DeserializeOwned>(
    text: &str,
    prunes: &[Prune],
    collector: &mut Collector<'_>,
) -> Option<T> {
    let (mut tree, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        for error in &errors {
            note_syntax(error, text, collector);
        }
        return None;
    }
    for newer in newer_than_1_0(text) {
        collector.add(newer.span, newer.message, newer.help);
    }
    for prune in prunes {
        prune(tree.get_mut(), collector);
    }
    match T::deserialize(toml::de::Deserializer::from(tree)) {
        Ok(value) if collector.is_empty() => Some(value),
        Ok(_) => None,
        Err(error) => {
            note_shape(&error, collector);
            None
        }
    }
}

/// Prunes the list at a path; `*` stands for every element or entry.
pub(super) fn prune<T: DeserializeOwned>(
    table: &mut DeTable<'_>,
    path: &[&str],
    collector: &mut Collector<'_>,
) {
    let Some((first, rest)) = path.split_first() else {
        return;
    };
    for (key, value) in table.iter_mut() {
        if *first == "*" || key.get_ref() == first {
            prune_value::<T>(value, rest, collector);
        }
    }
}

fn prune_value<T: DeserializeOwned>(
    value: &mut Spanned<DeValue<'_>>,
    path: &[&str],
    collector: &mut Collector<'_>,
) {
    match value.get_mut() {
        DeValue::Table(table) => prune::<T>(table, path, collector),
        DeValue::Array(array) => match path.split_first() {
            None => retain::<T>(array, collector),
            Some((&"*", rest)) => {
                for element in array.iter_mut() {
                    prune_value::<T>(element, rest, collector);
                }
            }
            Some(_) => {}
        },
        _ => {}
    }
}

fn retain<T: DeserializeOwned>(array: &mut DeArray<'_>, collector: &mut Collector<'_>) {
    let elements = std::mem::replace(array, DeArray::new());
    *array = elements
        .into_iter()
        .filter(|element| match T::deserialize(ValueDeserializer::from(element.clone())) {
            Ok(_) => true,
            Err(error) => {
                note_shape(&error, collector);
                false
            }
        })
        .collect();
}

fn note_syntax(error: &Error, text: &str, collector: &mut Collector<'_>) {
    let span = error.span().unwrap_or(text.len()..text.len());
    let message = error.message().trim_end();
    if message.starts_with("duplicate key") {
        let key = text.get(span.clone()).unwrap_or_default();
        collector.add(span, format!("the key `{key}` is there twice"), "keep one of the two");
        return;
    }
    let message = message.trim_end_matches(", expected nothing").replace('\n', ", ");
    collector.add(span, message, "write valid TOML 1.0 here");
}

/// Turns the words of the deserializer into the words of the file, with a remedy.
fn note_shape(error: &Error, collector: &mut Collector<'_>) {
    let span = error.span().unwrap_or(0..0);
    let message = error.message().trim_end();
    let (message, help) = if let Some(rest) = message.strip_prefix("unknown field ") {
        let (found, known) = rest.split_once(", expected ").unwrap_or((rest, ""));
        (format!("unknown key {found}"), remedy_for_unknown(found, known, "remove it"))
    } else if let Some(rest) = message.strip_prefix("unknown variant ") {
        let (found, known) = rest.split_once(", expected ").unwrap_or((rest, ""));
        (format!("unknown word {found}"), remedy_for_unknown(found, known, "replace it"))
    } else if let Some(key) = message.strip_prefix("missing field ") {
        (format!("the key {key} is missing"), format!("add {key}"))
    } else if let Some((found, expected)) = message.split_once(", expected ") {
        let found = match collector.excerpt(&span) {
            Some(excerpt) => format!("`{excerpt}` does not belong here"),
            None => found.to_owned(),
        };
        (found, format!("write {}", in_words(expected)))
    } else {
        (message.to_owned(), "write it as the format says".to_owned())
    };
    collector.add(span, message, help);
}

fn remedy_for_unknown(found: &str, known: &str, otherwise: &str) -> String {
    let known: Vec<&str> = known.split('`').skip(1).step_by(2).collect();
    if let Some(meant) = nearest(found.trim_matches('`'), known.iter().copied()) {
        return format!("write `{meant}`");
    }
    match known.as_slice() {
        [] => otherwise.to_owned(),
        _ => format!("{otherwise}, or write one of: {}", known.join(", ")),
    }
}

/// What the deserializer calls by the name of a Rust type.
fn in_words(expected: &str) -> String {
    match expected {
        "u8" => "a whole number from 0 to 255".to_owned(),
        "u16" => "a whole number from 0 to 65535".to_owned(),
        "u32" => "a whole number from 0 to 4294967295".to_owned(),
        "a tuple of size 2" => "two numbers: [first, last]".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list: [ ... ]".to_owned(),
        "a map" => "a table: { key = value }".to_owned(),
        _ => match expected.strip_prefix("struct ") {
            Some(_) => "a table: { key = value }".to_owned(),
            None => expected.to_owned(),
        },
    }
}
