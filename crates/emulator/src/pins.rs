//! `--set POINT=VALUE`: a value given as text, checked against its point, as the registers that hold it.

use busbar_profile::{BitSet, DataType, EncodeError, Number, Point, Profile, Value, nearest};

use crate::error::{PinError, PinProblem};

/// The index of the point and its registers.
pub(crate) fn parse(profile: &Profile, name: &str, text: &str) -> Result<(usize, Vec<u16>), PinError> {
    let refuse = |problem| PinError { point: name.to_owned(), value: text.to_owned(), problem };
    let found = profile.point_index(name).and_then(|index| Some((index, profile.points.get(index)?)));
    let (index, point) = found.ok_or_else(|| unknown(profile, name))?;
    if !point.access.is_readable() {
        return Err(refuse(PinProblem::WriteOnly));
    }
    let mut registers = vec![0; usize::from(point.registers)];
    let order = profile.wire.word_order;
    let encoded = match text {
        "absent" => point.encode_invalid(order, &mut registers),
        _ => {
            let value = value(point, text).map_err(refuse)?;
            point.encode(&value, order, &mut registers)
        }
    };
    encoded.map_err(|error| refuse(explain(point, error)))?;
    Ok((index, registers))
}

/// What there is to say of a point that the controller does not have. Whoever sets things sets settings too.
pub(crate) fn unknown(profile: &Profile, name: &str) -> PinError {
    let points = profile.points.iter().filter(|point| point.access.is_readable()).map(|point| &*point.id);
    let settings = profile.settings.iter().map(|setting| &*setting.id);
    let problem =
        PinProblem::UnknownPoint { nearest: nearest(name, points.chain(settings)).map(str::to_owned) };
    PinError { point: name.to_owned(), value: String::new(), problem }
}

fn value(point: &Point, text: &str) -> Result<Value, PinProblem> {
    match point.data_type {
        DataType::Choice => choice(point, text),
        DataType::Bits => bits(point, text),
        DataType::Bits2 => {
            list(text).map(Value::Codes).ok_or(PinProblem::Codes { count: 8 * point.registers })
        }
        DataType::Trace => list(text).map(Value::Trace).ok_or(PinProblem::Samples { count: point.registers }),
        DataType::Image | DataType::Bytes => {
            hex(text).map(Value::Bytes).ok_or(PinProblem::Hex { bytes: 2 * point.registers })
        }
        _ => match text.parse::<Number>() {
            Ok(number) => Ok(Value::Number(number)),
            // Any number that fits will do to ask the point for its limits.
            Err(_) => {
                Err(limits(point).unwrap_or(PinProblem::NotEncodable { reason: "it is not a number".into() }))
            }
        },
    }
}

fn choice(point: &Point, text: &str) -> Result<Value, PinProblem> {
    let named =
        point.choices.iter().find(|choice| choice.id == text || choice.label.eq_ignore_ascii_case(text));
    match named.map(|choice| choice.value).or_else(|| number(text)) {
        Some(code) => Ok(Value::Choice { code }),
        None => Err(PinProblem::Choice { allowed: labels(point) }),
    }
}

fn bits(point: &Point, text: &str) -> Result<Value, PinProblem> {
    let mut set = BitSet::EMPTY;
    for word in text.split(',').map(str::trim).filter(|word| !word.is_empty() && *word != "none") {
        let bit = match point.bit_by_id(word) {
            Some(bit) => bit.bit,
            None => match number(word).and_then(|bit| u16::try_from(bit).ok()) {
                Some(bit) if bit < 16 * point.registers => bit,
                _ => return Err(PinProblem::Bit { word: word.to_owned(), allowed: bit_ids(point) }),
            },
        };
        set.insert(bit);
    }
    Ok(Value::Bits(set))
}

fn explain(point: &Point, error: EncodeError) -> PinProblem {
    match error {
        EncodeError::Range { min, max, .. } => PinProblem::Range { min, max, unit: point.unit.clone() },
        EncodeError::Code { .. } if point.data_type == DataType::Bits2 => {
            PinProblem::Codes { count: 8 * point.registers }
        }
        EncodeError::Code { .. } => PinProblem::Choice { allowed: labels(point) },
        EncodeError::Bit { bit } => PinProblem::Bit { word: bit.to_string(), allowed: bit_ids(point) },
        EncodeError::NoSentinel => PinProblem::NeverAbsent,
        EncodeError::Length { expected, .. } => {
            let count = u16::try_from(expected).unwrap_or(u16::MAX);
            match point.data_type {
                DataType::Bits2 => PinProblem::Codes { count },
                DataType::Trace => PinProblem::Samples { count },
                _ => PinProblem::Hex { bytes: count },
            }
        }
        other => PinProblem::NotEncodable { reason: other.to_string() },
    }
}

/// What the point says to a number that no register holds.
fn limits(point: &Point) -> Option<PinProblem> {
    let mut registers = vec![0; usize::from(point.registers)];
    let far = Value::Number(Number::integer(i64::MAX));
    let error = point.encode(&far, busbar_profile::WordOrder::LowFirst, &mut registers).err()?;
    Some(explain(point, error))
}

fn labels(point: &Point) -> Vec<String> {
    point.choices.iter().map(|choice| choice.label.clone()).collect()
}

fn bit_ids(point: &Point) -> Vec<String> {
    point.bits.iter().map(|bit| bit.id.clone()).collect()
}

fn number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn list<T: std::str::FromStr>(text: &str) -> Option<Vec<T>> {
    text.split(',').map(|word| word.trim().parse().ok()).collect()
}

fn hex(text: &str) -> Option<Vec<u8>> {
    if !text.bytes().all(|byte| byte.is_ascii_hexdigit()) || !text.len().is_multiple_of(2) {
        return None;
    }
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok()).collect()
}
