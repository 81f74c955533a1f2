//! Ids and names: what a text may be that addresses, findings and people call something by.

use busbar_profile::Collector;
use busbar_profile::text::{is_unseen, shown};

use super::reader::{At, Table};

/// Longest name, in characters.
const LONGEST_NAME: usize = 200;

/// An id of something of this `kind`; `is_taken` knows those before it.
pub(super) fn id(
    table: &Table<'_, '_>,
    kind: &str,
    is_taken: impl FnOnce(&str) -> bool,
    findings: &mut Collector<'_>,
) -> Option<At<String>> {
    let id =
        table.required("id", "\"gen1\"", findings, |table, key, findings| table.string(key, findings))?;
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !(1..=64).contains(&id.value.len()) || !id.value.chars().all(allowed) {
        findings.add(
            id.span,
            format!("`{}` cannot be an id", shown(&id.value)),
            "write 1 to 64 letters a-z or A-Z, digits, - and _; `name` takes any text",
        );
        return None;
    }
    if is_taken(&id.value) {
        findings.add(
            id.span,
            format!("there is a {kind} `{}` already", id.value),
            format!("give every {kind} an id of its own"),
        );
        return None;
    }
    Some(id)
}

/// A name: any text that fits on a line and is what it looks like.
pub(super) fn name(table: &Table<'_, '_>, key: &str, findings: &mut Collector<'_>) -> Option<String> {
    let text = table.string(key, findings)?;
    let name = text.value.trim();
    let (message, help) = match (name.chars().count(), disguise(name)) {
        (0, _) => (format!("`{key}` is empty"), format!("write 1 to {LONGEST_NAME} characters")),
        (length, _) if length > LONGEST_NAME => (
            format!("`{key}` has {length} characters"),
            format!("shorten it to {LONGEST_NAME}, so that it fits where names stand"),
        ),
        (_, Some((place, c))) => (
            format!("`{key}` holds U+{:04X} as character {place}, which nobody sees", u32::from(c)),
            "leave it out: names are one line of visible characters".to_owned(),
        ),
        _ => return Some(name.to_owned()),
    };
    findings.add(text.span, message, help);
    None
}

/// The first character that could make a name look like another one, and its place from 1.
fn disguise(name: &str) -> Option<(usize, char)> {
    let chars: Vec<char> = name.chars().collect();
    let neighbour = |index: Option<usize>| index.and_then(|index| chars.get(index)).copied();
    chars.iter().enumerate().find_map(|(index, &c)| {
        // Emoji and several scripts are written with joiners; between Latin letters they only hide.
        let is_joint = matches!(c, '\u{200C}' | '\u{200D}')
            && [index.checked_sub(1), Some(index + 1)]
                .into_iter()
                .all(|index| neighbour(index).is_some_and(|c| !c.is_ascii() && !is_unseen(c)));
        ((c.is_control() || is_unseen(c)) && !is_joint).then_some((index + 1, c))
    })
}
