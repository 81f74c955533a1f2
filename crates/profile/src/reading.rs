//! A value with its labels and unit, as the command line and the API print it.

use std::borrow::Cow;

use serde::Serialize;

use crate::number::Number;
use crate::point::Point;
use crate::profile::Profile;
use crate::terms::{Quality, WordOrder};
use crate::value::{BitSet, Decoded, Value};

/// One reading of one point; serialises as `busbar decode --json` prints it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Reading<'a> {
    /// Id of the point.
    pub id: &'a str,
    /// Address of its first register.
    pub address: u16,
    /// The value; none where there is none or it cannot be trusted.
    pub value: Option<Shown<'a>>,
    /// The code beside the label of a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<u32>,
    /// The numbers of the bits beside their labels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<Vec<u16>>,
    /// Unit of the number.
    pub unit: Option<&'a str>,
    /// How far it can be trusted.
    pub quality: Quality,
    /// The registers; none where they could not be read.
    pub raw: Option<Cow<'a, [u16]>>,
}

/// A value as people read it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Shown<'a> {
    /// A number, exact.
    Number(Number),
    /// The label of a code.
    Label(Cow<'a, str>),
    /// The labels of the bits that are set.
    Labels(Vec<Cow<'a, str>>),
    /// Two-bit codes.
    Codes(Vec<u8>),
    /// Samples.
    Numbers(Vec<Number>),
    /// Lower-case hex.
    Hex(String),
}

/// The reading of a decoded point; `model` picks the label where a meaning depends on it.
pub fn reading<'a>(point: &'a Point, decoded: &Decoded, raw: &'a [u16], model: Option<&str>) -> Reading<'a> {
    let value = decoded.value.as_ref();
    Reading {
        id: &point.id,
        address: point.address,
        value: value.map(|value| shown(point, value, model)),
        code: value.and_then(Value::as_code),
        set: value.and_then(Value::as_bits).map(|bits| bits.iter().collect()),
        unit: point.unit.as_deref(),
        quality: decoded.quality,
        raw: Some(Cow::Borrowed(raw)),
    }
}

/// The reading of a point that could not be read.
pub fn no_reading(point: &Point, quality: Quality) -> Reading<'_> {
    Reading {
        id: &point.id,
        address: point.address,
        value: None,
        code: None,
        set: None,
        unit: point.unit.as_deref(),
        quality,
        raw: None,
    }
}

/// Every point that lies wholly inside a window of registers, write-only ones too, in address order.
pub fn decode_window<'a>(
    profile: &'a Profile,
    address: u16,
    registers: &[u16],
    order: WordOrder,
) -> Vec<(&'a Point, Decoded)> {
    profile
        .points_within(address, registers.len())
        .filter_map(|point| {
            let own = point.within(address, registers)?;
            Some((point, point.decode(own, order)))
        })
        .collect()
}

impl Point {
    /// The label of a code: the choice's, `reserved (6)` or `unknown (26)`.
    pub fn label(&self, code: u32, model: Option<&str>) -> Cow<'_, str> {
        if let Some(choice) = self.choice(code) {
            return Cow::Borrowed(choice.label_for(model));
        }
        if self.is_reserved_code(code) {
            return Cow::Owned(format!("reserved ({code})"));
        }
        Cow::Owned(format!("unknown ({code})"))
    }

    /// Whether a label of it depends on the model.
    pub fn depends_on_model(&self) -> bool {
        self.choices.iter().any(|choice| !choice.by_model.is_empty())
    }

    /// The label of a bit, or `bit 200` where the manual has none.
    pub fn bit_label(&self, bit: u16) -> Cow<'_, str> {
        match self.bit(bit) {
            Some(bit) => Cow::Borrowed(&bit.label),
            None => Cow::Owned(format!("bit {bit}")),
        }
    }
}

fn shown<'a>(point: &'a Point, value: &Value, model: Option<&str>) -> Shown<'a> {
    match value {
        Value::Number(number) => Shown::Number(*number),
        Value::Choice { code } => Shown::Label(point.label(*code, model)),
        Value::Bits(bits) => Shown::Labels(bit_labels(point, bits)),
        Value::Codes(codes) => Shown::Codes(codes.clone()),
        Value::Trace(samples) => Shown::Numbers(samples.iter().map(|&sample| point.sample(sample)).collect()),
        Value::Bytes(bytes) => Shown::Hex(hex(bytes)),
    }
}

fn bit_labels<'a>(point: &'a Point, bits: &BitSet) -> Vec<Cow<'a, str>> {
    bits.iter().map(|bit| point.bit_label(bit)).collect()
}

fn hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let mut text = String::with_capacity(bytes.len() * 2);
    for byte in bytes {
        text.push(DIGITS[usize::from(byte >> 4)] as char);
        text.push(DIGITS[usize::from(byte & 15)] as char);
    }
    text
}
