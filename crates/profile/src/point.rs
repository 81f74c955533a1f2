//! One point: a fact that a controller's registers hold, and how to read and write it.

use crate::codec::{Codec, EncodeError};
use crate::number::{Linear, Number, Scale};
use crate::terms::{Access, Class, DataType, Rate, WordOrder};
use crate::value::{Decoded, Value};

/// A fact that a controller's registers hold.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Point {
    /// Its id, unique in the profile.
    pub id: String,
    /// Its name, as a person reads it.
    pub name: String,
    /// Modbus address of its first register.
    pub address: u16,
    /// How many registers it takes.
    pub registers: u16,
    /// What may be done with it.
    pub access: Access,
    /// How its registers are to be read.
    pub data_type: DataType,
    /// The bits of one register that it takes, highest and lowest, where it does not take all of them.
    pub field: Option<(u8, u8)>,
    /// How many bits the manual gives it, where the type leaves that open: sets, lists of codes, bytes and pictures.
    pub size: Option<u16>,
    /// Unit of the number.
    pub unit: Option<String>,
    /// How the raw number becomes a value; none where the manual gives none, and the raw number is the value.
    pub scale: Option<Scale>,
    /// Id in the shared vocabulary.
    pub signal: Option<String>,
    /// Codes with a meaning, in ascending order.
    pub choices: Vec<Choice>,
    /// Ranges of codes that the manual prints as reserved.
    pub reserved_codes: Vec<(u32, u32)>,
    /// Named bits, in ascending order.
    pub bits: Vec<Bit>,
    /// Class of its bits, unless a bit has its own.
    pub class: Option<Class>,
    /// Raw words by which the device says that it has no value.
    pub sentinels: Vec<u64>,
    /// Index of the point that shows the delay of this state.
    pub timer: Option<usize>,
    /// Whether people read the number in hexadecimal.
    pub hex: bool,
    /// What the manual leaves open.
    pub doubt: Option<String>,
    /// Where real hardware confirmed it.
    pub verified: Option<String>,
    /// Page of the manual.
    pub page: Option<u16>,
    /// Index of its group.
    pub group: usize,
    /// How often it deserves to be read.
    pub rate: Rate,
    pub(crate) codec: Codec,
    /// Scale of the samples of a trace.
    pub(crate) samples: Linear,
    /// From this point's unit to the unit of its signal.
    pub(crate) to_signal: Option<Scale>,
}

impl Point {
    /// The value of exactly this point's registers.
    ///
    /// Total: any other number of registers is of quality bad.
    #[inline]
    pub fn decode(&self, registers: &[u16], order: WordOrder) -> Decoded {
        self.codec.decode(registers, order)
    }

    /// Writes a value into exactly this point's registers; what does not belong to the point stays as it is.
    ///
    /// A number is rounded to the nearest that the registers can hold, halves to the even one.
    ///
    /// # Errors
    ///
    /// The value is of another kind, out of range, or would read as "no value"; the registers are then untouched.
    pub fn encode(&self, value: &Value, order: WordOrder, registers: &mut [u16]) -> Result<(), EncodeError> {
        self.codec.encode(value, order, registers)
    }

    /// Writes the first sentinel: the device has no value.
    ///
    /// # Errors
    ///
    /// The point has no sentinel.
    pub fn encode_invalid(&self, order: WordOrder, registers: &mut [u16]) -> Result<(), EncodeError> {
        self.codec.encode_invalid(order, registers)
    }

    /// The number before scale, the code of a choice, or the low bits of a set: what conditions compare.
    pub fn raw_code(&self, registers: &[u16], order: WordOrder) -> Option<u32> {
        self.codec.raw_code(registers, order)
    }

    /// This point's registers out of a window that starts at `address`; none unless they are all in it.
    pub fn within<'a>(&self, address: u16, window: &'a [u16]) -> Option<&'a [u16]> {
        let start = usize::from(self.address.checked_sub(address)?);
        window.get(start..start + usize::from(self.registers))
    }

    /// The last register.
    pub const fn last(&self) -> u16 {
        self.address.saturating_add(self.registers - 1)
    }

    /// The number that PLC programs know the first register by: 40001 for address 0 on, and 410000 for 9999 on,
    /// where five digits do not reach.
    pub const fn plc_number(&self) -> u32 {
        let first = if self.address <= 9998 { 40_001 } else { 400_001 };
        first + self.address as u32
    }

    /// The choice behind a code.
    pub fn choice(&self, code: u32) -> Option<&Choice> {
        let index = self.choices.binary_search_by_key(&code, |c| c.value).ok()?;
        Some(&self.choices[index])
    }

    /// Whether the manual prints a code as reserved.
    pub fn is_reserved_code(&self, code: u32) -> bool {
        self.reserved_codes.iter().any(|&(first, last)| (first..=last).contains(&code))
    }

    /// The bit of that number.
    pub fn bit(&self, bit: u16) -> Option<&Bit> {
        let index = self.bits.binary_search_by_key(&bit, |b| b.bit).ok()?;
        Some(&self.bits[index])
    }

    /// The bit of that id.
    pub fn bit_by_id(&self, id: &str) -> Option<&Bit> {
        self.bits.iter().find(|bit| bit.id == id)
    }

    /// One sample of a trace as a number.
    pub fn sample(&self, sample: i16) -> Number {
        self.samples.apply(i64::from(sample))
    }

    /// A number of this point in the unit of its signal; none where it has none.
    pub fn in_signal_unit(&self, value: Number) -> Option<Number> {
        self.to_signal?.apply(value)
    }
}

/// A code with a meaning.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Choice {
    /// The code.
    pub value: u32,
    /// Its id, unique in the point.
    pub id: String,
    /// Its label.
    pub label: String,
    /// The label where the model is known and the meaning depends on it: model and label.
    pub by_model: Vec<(String, String)>,
    /// The word of the point's signal that it stands for.
    pub state: Option<String>,
    /// Whether the point's timer runs in this state.
    pub timed: bool,
}

impl Choice {
    /// The label on a model, or the general one.
    pub fn label_for(&self, model: Option<&str>) -> &str {
        self.by_model
            .iter()
            .find(|(name, _)| Some(name.as_str()) == model)
            .map_or(&self.label, |(_, label)| label)
    }
}

/// A named bit.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Bit {
    /// Its number, from bit 0 of the first register.
    pub bit: u16,
    /// Its id, unique in the point.
    pub id: String,
    /// Its label.
    pub label: String,
    /// How serious it is; its own or the point's.
    pub class: Option<Class>,
    /// Id of a flag in the shared vocabulary.
    pub signal: Option<String>,
    /// The word of the point's signal that it stands for.
    pub state: Option<String>,
    /// What it stands for while it is clear, where it alone tells the state.
    pub clear: Option<Clear>,
    /// What the manual leaves open.
    pub doubt: Option<String>,
}

/// What a bit stands for while it is clear.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Clear {
    /// Its label.
    pub label: String,
    /// The word of the point's signal.
    pub state: String,
}
