//! Readings in the form that people read.

use busbar_profile::{Class, Point, Quality, Reading, Shown};

use crate::table::{Cell, Look};

/// Hex and code lists are printed in lines of so many digits, and as a number of bytes or codes beyond so many lines.
const DIGITS: usize = 16;
const LINES: usize = 2;

/// Numbers stand right-aligned in this many columns at most; longer ones stick out.
const WIDEST_NUMBER: usize = 10;

/// How many columns the numbers among these readings need.
pub(crate) fn number_width<'a>(readings: impl IntoIterator<Item = (&'a Point, &'a Reading<'a>)>) -> usize {
    let widths =
        readings.into_iter().filter_map(|(point, reading)| Some(number(point, reading)?.chars().count()));
    widths.max().unwrap_or_default().min(WIDEST_NUMBER)
}

/// A value as lines: one for most, one for each label of a set of bits. Numbers stand right-aligned in `width` columns.
pub(crate) fn lines(point: &Point, reading: &Reading<'_>, width: usize) -> Vec<Cell> {
    if let Some(number) = number(point, reading) {
        return vec![with_unit(format!("{number:>width$}"), reading.unit).into()];
    }
    let Some(value) = &reading.value else {
        return vec![match reading.quality {
            Quality::Bad => Cell::new("not read", Look::Alarm),
            _ => Cell::dim("no value"),
        }];
    };
    match value {
        Shown::Label(label) => vec![label.as_ref().into()],
        Shown::Labels(labels) if labels.is_empty() => vec![Cell::dim("none")],
        Shown::Labels(labels) => {
            let bits = reading.set.iter().flatten();
            labels.iter().zip(bits).map(|(label, bit)| Cell::new(label.as_ref(), look(point, *bit))).collect()
        }
        Shown::Codes(codes) => {
            let digits: String = codes.iter().map(u8::to_string).collect();
            digit_lines(&digits, 8, &format!("{} codes", codes.len()))
        }
        Shown::Numbers(numbers) => {
            let ends = numbers.iter().min().zip(numbers.iter().max());
            let range = ends.map(|(least, most)| format!(", {least} to {most}")).unwrap_or_default();
            vec![with_unit(format!("{} samples{range}", numbers.len()), reading.unit).into()]
        }
        Shown::Hex(hex) => digit_lines(hex, 4, &format!("{} bytes", hex.len() / 2)),
        _ => vec![Cell::dim("see --json")],
    }
}

/// A value in one line.
pub(crate) fn line(point: &Point, reading: &Reading<'_>) -> String {
    let lines = lines(point, reading, 0);
    lines.iter().map(Cell::text).collect::<Vec<_>>().join(", ")
}

/// So many of something: `1 point`, `2 points`.
pub(crate) fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// How serious a bit that is set looks.
fn look(point: &Point, bit: u16) -> Look {
    match point.bit(bit).and_then(|bit| bit.class).or(point.class) {
        Some(Class::Shutdown | Class::LoadDump | Class::Trip) => Look::Alarm,
        Some(Class::Warning) => Look::Caution,
        _ => Look::Plain,
    }
}

/// The digits of a reading that is one number.
fn number(point: &Point, reading: &Reading<'_>) -> Option<String> {
    let Some(Shown::Number(number)) = &reading.value else { return None };
    Some(match (point.hex, number.as_integer()) {
        (true, Some(integer)) => format!("{integer:04X}h"),
        _ => number.to_string(),
    })
}

/// ASCII digits in groups, or what they are where they are too many.
fn digit_lines(digits: &str, group: usize, what: &str) -> Vec<Cell> {
    if digits.len() > DIGITS * LINES {
        return vec![Cell::dim(format!("{what}, see --json"))];
    }
    let groups = |line: &[char]| line.chunks(group).map(String::from_iter).collect::<Vec<_>>().join(" ");
    digits.chars().collect::<Vec<_>>().chunks(DIGITS).map(|line| groups(line).into()).collect()
}

/// A number and its unit, as people write it.
pub(crate) fn with_unit(number: String, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{number} {}", self::unit(unit)),
        None => number,
    }
}

/// The profile's spelling of a unit, as people write it.
pub(crate) fn unit(unit: &str) -> &str {
    match unit {
        "degC" => "°C",
        "deg" => "°",
        "ohm" => "Ω",
        other => other,
    }
}
