//! Sentences for the reason of a verdict, in the words of the controller.

use std::borrow::Cow;

use crate::command::{ArgRef, Condition, Seen, Sign, Subject, Test};
use crate::point::Point;
use crate::profile::Profile;
use crate::terms::DataType;

/// What a sign is called.
pub(super) fn name(profile: &Profile, sign: Sign) -> Cow<'_, str> {
    match sign {
        Sign::Point { point, bit } => {
            let point = &profile.points[point];
            match bit {
                Some(bit) => point.bit_label(bit),
                None => Cow::Borrowed(point.name.as_str()),
            }
        }
        Sign::Joined(index) => Cow::Borrowed(profile.joined()[index].signal.as_str()),
        Sign::Device => Cow::Borrowed("the device"),
    }
}

/// What was seen of a sign.
pub(super) fn seen(profile: &Profile, model: Option<&str>, sign: Sign, seen: Option<Seen>) -> String {
    match (seen, sign) {
        (None, _) => "without a value".to_owned(),
        (Some(Seen::Number(number)), Sign::Point { point, .. }) => {
            let point = &profile.points[point];
            match (&point.unit, number.as_integer()) {
                (Some(unit), _) => format!("{number} {unit}"),
                (None, Some(integer)) if point.hex => format!("{integer:04X}h"),
                (None, _) => number.to_string(),
            }
        }
        (Some(Seen::Number(number)), _) => number.to_string(),
        (Some(Seen::Code(code)), Sign::Point { point, .. }) => {
            profile.points[point].label(code, model).into_owned()
        }
        (Some(Seen::Code(code)), _) => code.to_string(),
        (Some(Seen::Bit(bit)), _) => on_off(bit).to_owned(),
        (Some(Seen::Clock(clock)), _) => clock.to_string(),
        (Some(Seen::Answers(true)), _) => "answering".to_owned(),
        (Some(Seen::Answers(false)), _) => "silent".to_owned(),
    }
}

/// What a condition asks for.
pub(super) fn wanted(
    profile: &Profile,
    model: Option<&str>,
    condition: &Condition,
    arg: impl Fn(ArgRef) -> Option<u16>,
) -> String {
    let code = |code: u32| match condition.subject {
        Subject::Point { bit: Some(_), .. } => on_off(code == 1).to_owned(),
        Subject::Point { point, bit: None } => raw(&profile.points[point], model, code),
        Subject::Arg(_) => code.to_string(),
    };
    match &condition.test {
        Test::Equals(value) => code(*value),
        Test::NotEquals(value) => format!("anything but {}", code(*value)),
        Test::Between(range) => format!("{} to {}", code(*range.start()), code(*range.end())),
        Test::EqualsArg(of) => arg(*of).map_or_else(|| "the argument".to_owned(), |n| code(u32::from(n))),
        Test::Changes => "anything else".to_owned(),
    }
}

fn raw(point: &Point, model: Option<&str>, code: u32) -> String {
    if point.data_type == DataType::Choice {
        return point.label(code, model).into_owned();
    }
    if point.hex { format!("{code:04X}h") } else { code.to_string() }
}

const fn on_off(bit: bool) -> &'static str {
    if bit { "on" } else { "off" }
}

/// The standard's name of an exception code, unless the maker has one.
pub(super) fn exception(profile: &Profile, code: u8) -> String {
    let standard = match code {
        0x01 => "illegal function",
        0x02 => "illegal data address",
        0x03 => "illegal data value",
        0x04 => "server device failure",
        0x05 => "acknowledge",
        0x06 => "server device busy",
        0x08 => "memory parity error",
        0x0A => "gateway path unavailable",
        0x0B => "gateway target device failed to respond",
        _ => "unknown exception",
    };
    let name = profile.exception_name(code).unwrap_or(standard);
    format!("exception {code} ({name})")
}

/// A sentence begins with a capital letter.
pub(super) fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => first.to_uppercase().chain(chars).collect(),
        None => String::new(),
    }
}
