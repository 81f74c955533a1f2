//! A file of faults.

use std::time::Duration;

use busbar_profile::{Findings, nearest};
use toml::de::DeTable;

use super::{Faults, Kind, Often, Rule};
use crate::notes::{self, Entry, Notes, entries};
use busbar_profile::text::shown;

const FILE: [&str; 2] = ["seed", "faults"];
const FAULT: [&str; 11] =
    ["kind", "by", "code", "chance", "every", "times", "unit", "function", "address", "from", "until"];
const KINDS: [&str; 13] = [
    "unheard",
    "unanswered",
    "late",
    "exception",
    "garbled",
    "cut",
    "noise",
    "other_unit",
    "other_function",
    "answer_before",
    "twice",
    "echo",
    "hang_up",
];
/// A client that waits longer than this for an answer is none that anybody has.
const LATEST: Duration = Duration::from_secs(60);
/// A fortnight.
const LONGEST: Duration = Duration::from_secs(14 * 86_400);

pub(super) fn faults(file: &str, text: &str) -> Result<Faults, Findings> {
    let faults = notes::read(file, text, "leave one of them out", read)?;
    // Without a finding there are faults.
    Ok(faults.unwrap_or(Faults { seed: 1, rules: Vec::new() }))
}

fn read(root: &DeTable<'_>, notes: &mut Notes<'_>) -> Option<Faults> {
    let mut faults = Faults { seed: 1, rules: Vec::new() };
    let mut listed = false;
    for entry in entries(root) {
        match entry.key.as_str() {
            "seed" => faults.seed = notes.whole(&entry).unwrap_or_default(),
            "faults" => {
                listed = true;
                for (table, span) in notes.tables(&entry) {
                    faults.rules.extend(rule(table, span, notes));
                }
            }
            _ => notes.unknown_key(&entry, "a file of faults", &FILE),
        }
    }
    if !listed {
        notes.add(0..0, "there are no faults", "add [[faults]] with kind = \"unanswered\" and chance = 0.01");
    }
    Some(faults)
}

fn rule(table: &DeTable<'_>, span: std::ops::Range<usize>, notes: &mut Notes<'_>) -> Option<Rule> {
    let all = entries(table);
    let of = |key: &str| all.iter().find(|entry| entry.key == key);
    for entry in all.iter().filter(|entry| !FAULT.contains(&entry.key.as_str())) {
        notes.unknown_key(entry, "[[faults]]", &FAULT);
    }
    let often = often(of("chance"), of("every"), &span, notes);
    let Some(named) = of("kind") else {
        notes.missing(span, "[[faults]]", "kind", "\"unanswered\"");
        return None;
    };
    let kind = kind(named, of("by"), of("code"), notes);
    let whole = |key: &str, most: u64, notes: &mut Notes<'_>| match of(key) {
        Some(entry) => whole(entry, 0..=most, notes).map(Some),
        None => Some(None),
    };
    let times = whole("times", u64::MAX, notes);
    let unit = whole("unit", u64::from(u8::MAX), notes);
    let function = whole("function", 127, notes);
    let address = whole("address", u64::from(u16::MAX), notes);
    let time = |key: &str, notes: &mut Notes<'_>| match of(key) {
        Some(entry) => notes.duration(entry, Duration::ZERO..=LONGEST).map(Some),
        None => Some(None),
    };
    let (from, until) = (time("from", notes)?.unwrap_or_default(), time("until", notes)?);
    if let Some(entry) = of("until").filter(|_| until.is_some_and(|until| until <= from)) {
        notes.add(entry.value.span(), "it ends before it begins", "write an `until` after `from`");
    }
    Some(Rule {
        kind: kind?,
        often: often?,
        times: times?,
        unit: unit?.and_then(|unit| u8::try_from(unit).ok()),
        function: function?.and_then(|function| u8::try_from(function).ok()),
        address: address?.and_then(|address| u16::try_from(address).ok()),
        from,
        until,
    })
}

fn kind(
    named: &Entry<'_, '_>,
    by: Option<&Entry<'_, '_>>,
    code: Option<&Entry<'_, '_>>,
    notes: &mut Notes<'_>,
) -> Option<Kind> {
    let text = notes.text(named)?;
    for (entry, owner) in [(by, "late"), (code, "exception")] {
        if let Some(entry) = entry.filter(|_| text != owner) {
            let message = format!("`{}` means nothing here", entry.key);
            notes.add(entry.span.clone(), message, format!("leave it out; it belongs to kind = \"{owner}\""));
        }
    }
    Some(match text.as_str() {
        "unheard" => Kind::Unheard,
        "unanswered" => Kind::Unanswered,
        "late" => match by {
            Some(by) => Kind::Late(notes.duration(by, Duration::from_millis(1)..=LATEST)?),
            None => {
                notes.missing(named.span.clone(), "this fault", "by", "\"1500ms\"");
                return None;
            }
        },
        "exception" => match code {
            Some(code) => Kind::Exception(u8::try_from(whole(code, 1..=255, notes)?).unwrap_or_default()),
            None => {
                notes.missing(named.span.clone(), "this fault", "code", "6");
                return None;
            }
        },
        "garbled" => Kind::Garbled,
        "cut" => Kind::Cut,
        "noise" => Kind::Noise,
        "other_unit" => Kind::OtherUnit,
        "other_function" => Kind::OtherFunction,
        "answer_before" => Kind::AnswerBefore,
        "twice" => Kind::Twice,
        "echo" => Kind::Echo,
        "hang_up" => Kind::HangUp,
        _ => {
            let help = match nearest(&text, KINDS) {
                Some(kind) => format!("did you mean `{kind}`?"),
                None => format!("write one of: {}", KINDS.join(", ")),
            };
            notes.add(named.value.span(), format!("there is no fault `{}`", shown(&text)), help);
            return None;
        }
    })
}

fn often(
    chance: Option<&Entry<'_, '_>>,
    every: Option<&Entry<'_, '_>>,
    span: &std::ops::Range<usize>,
    notes: &mut Notes<'_>,
) -> Option<Often> {
    match (chance, every) {
        (Some(entry), None) => {
            let chance: Option<f64> = notes.plain(entry)?.parse().ok();
            let chance = chance.filter(|chance| *chance > 0.0 && *chance <= 1.0);
            if chance.is_none() {
                let help = "write a number above 0 and up to 1, such as 0.05 for one request in twenty";
                notes.add(entry.value.span(), "this is no chance", help);
            }
            chance.map(Often::Chance)
        }
        (None, Some(entry)) => whole(entry, 1..=u64::MAX, notes).map(Often::Every),
        (Some(_), Some(entry)) => {
            notes.add(entry.span.clone(), "`chance` and `every` are both there", "leave one of them out");
            None
        }
        (None, None) => {
            let help = "add `chance = 0.05`, or `every = 20`";
            notes.add(span.clone(), "how often is missing in [[faults]]", help);
            None
        }
    }
}

/// A whole number in its range.
fn whole(entry: &Entry<'_, '_>, range: std::ops::RangeInclusive<u64>, notes: &mut Notes<'_>) -> Option<u64> {
    let number = notes.whole(entry)?;
    if !range.contains(&number) {
        let message = format!("`{}` is {number}", entry.key);
        notes.add(
            entry.value.span(),
            message,
            format!("write a number from {} to {}", range.start(), range.end()),
        );
        return None;
    }
    Some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_about_it_has_every_kind_and_key() {
        const PAGE: &str = include_str!("../../../../docs/faults.md");
        assert!(KINDS.iter().all(|kind| PAGE.contains(&format!("\n| `{kind}` |"))));
        assert!(
            FAULT
                .iter()
                .all(|key| PAGE.contains(&format!("`{key}`")) || PAGE.contains(&format!("\n{key} = ")))
        );
    }

    #[test]
    fn a_file_is_a_list_of_what_goes_wrong() {
        let text = "seed = 3\n[[faults]]\nkind = \"late\"\nby = \"2s\"\nchance = 0.5\n\
                    [[faults]]\nkind = \"exception\"\ncode = 6\nevery = 10\naddress = 0x2000\n";
        let faults = Faults::parse("f.toml", text).unwrap_or_else(|findings| panic!("{findings}"));
        assert_eq!((faults.seed, faults.rules.len()), (3, 2));
        assert_eq!(faults.rules[0].kind, Kind::Late(Duration::from_secs(2)));
        assert_eq!((faults.rules[1].kind, faults.rules[1].address), (Kind::Exception(6), Some(8192)));
        for kind in KINDS {
            let more = match kind {
                "late" => "by = \"1s\"\n",
                "exception" => "code = 1\n",
                _ => "",
            };
            let text = format!("[[faults]]\nkind = \"{kind}\"\nevery = 1\n{more}");
            assert!(Faults::parse("f.toml", &text).is_ok(), "{kind}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_line_and_a_remedy() {
        let with = |rest: &str| format!("[[faults]]\nkind = \"cut\"\n{rest}\n");
        for (text, line, says) in [
            (String::new(), 1, "there are no faults"),
            ("faults = 3".to_owned(), 1, "`faults` has the wrong type"),
            ("[[fault]]\n".to_owned(), 1, "unknown key `fault`"),
            ("[[faults]]\nevery = 1\n".to_owned(), 1, "`kind` is missing"),
            ("[[faults]]\nkind = \"silence\"\nevery = 1\n".to_owned(), 2, "there is no fault `silence`"),
            ("[[faults]]\nkind = \"late\"\nevery = 1\n".to_owned(), 2, "`by` is missing"),
            ("[[faults]]\nkind = \"exception\"\nevery = 1\n".to_owned(), 2, "`code` is missing"),
            ("[[faults]]\nkind = \"exception\"\nevery = 1\ncode = 256\n".to_owned(), 4, "`code` is 256"),
            (with(""), 1, "how often is missing"),
            (with("every = 0"), 3, "`every` is 0"),
            (with("every = 2\nchance = 0.1"), 3, "are both there"),
            (with("chance = 0"), 3, "this is no chance"),
            (with("chance = 1.5"), 3, "this is no chance"),
            (with("chance = nan"), 3, "this is no chance"),
            (with("every = 1\nby = \"1s\""), 4, "`by` means nothing here"),
            (with("every = 1\nunit = 256"), 4, "`unit` is 256"),
            (with("every = 1\nfunction = 128"), 4, "`function` is 128"),
            (with("every = 1\naddress = 65536"), 4, "`address` is 65536"),
            (with("every = 1\nfrom = \"2s\"\nuntil = \"2s\""), 5, "it ends before it begins"),
            (with("every = 1\nfrom = \"soon\""), 4, "`soon` is no duration"),
            (with("every = -1"), 3, "`every` is -1"),
        ] {
            let findings = Faults::parse("f.toml", &text).err().unwrap_or_else(|| panic!("accepted: {text}"));
            let said = findings.to_string();
            let there =
                said.lines().any(|said| said.contains(&format!("f.toml:{line}:")) && said.contains(says));
            assert!(there, "line {line}, {says}:\n{said}\n{text}");
        }
    }
}
