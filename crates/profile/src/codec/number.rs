//! Points that hold one number: a few shifts and one multiplication a reading.

use super::{EncodeError, Field, Sentinels};
use crate::number::{Linear, Number, divide_half_even};
use crate::terms::{DataType, WordOrder};
use crate::value::{Decoded, Value};

/// Decimals of a share, whose fraction has no end.
const SHARE_DECIMALS: u8 = 4;
/// 100 % with that many decimals.
const SHARE_FULL: i64 = 1_000_000;

/// What the bits of a raw word mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Two's complement, or unsigned where there is no sign bit.
    Plain,
    /// Any of the sign bits set is negative; the others are the magnitude.
    Magnitude,
    /// Share of the greatest word in per cent, to four decimals.
    Share,
}

/// A point that holds one number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NumberCodec {
    linear: Linear,
    sentinels: Sentinels,
    /// The bits of the raw word, after the shift.
    mask: u32,
    /// The sign bits of the raw word; 0 for unsigned numbers.
    sign: u32,
    shift: u8,
    registers: u8,
    form: Form,
}

impl NumberCodec {
    /// The codec of a numeric type; `field` where it takes part of a register. None for other types.
    pub(crate) fn new(
        data_type: DataType,
        field: Option<Field>,
        linear: Linear,
        sentinels: Sentinels,
    ) -> Option<Self> {
        use DataType as T;
        let whole = field.unwrap_or(Field::WHOLE);
        let low = field.unwrap_or(Field::LOW_BYTE);
        let (field, sign, form) = match data_type {
            T::U8 => (low, 0, Form::Plain),
            T::I8 => (low, 0x80, Form::Plain),
            T::U16 => (whole, 0, Form::Plain),
            T::I16 => (whole, 0x8000, Form::Plain),
            T::Sm16 => (whole, 0x8000, Form::Magnitude),
            T::Fraction8 => (low, 0, Form::Share),
            T::Fraction16 => (whole, 0, Form::Share),
            T::U32 => return Some(Self::double(0, Form::Plain, linear, sentinels)),
            T::I32 => return Some(Self::double(0x8000_0000, Form::Plain, linear, sentinels)),
            // Any bit of the highest byte is a sign; FFh is what is written.
            T::Sm24 => return Some(Self::double(0xFF00_0000, Form::Magnitude, linear, sentinels)),
            T::Bits | T::Bits2 | T::Choice | T::Trace | T::Image | T::Bytes => return None,
        };
        Some(Self { linear, sentinels, mask: field.max(), sign, shift: field.shift, registers: 1, form })
    }

    const fn double(sign: u32, form: Form, linear: Linear, sentinels: Sentinels) -> Self {
        Self { linear, sentinels, mask: u32::MAX, sign, shift: 0, registers: 2, form }
    }

    pub(super) fn registers(&self) -> usize {
        usize::from(self.registers)
    }

    /// The bits it takes in each of its registers.
    pub(crate) const fn bits(&self) -> u16 {
        match self.registers {
            1 => (self.mask << self.shift) as u16,
            _ => 0xFFFF,
        }
    }

    #[inline]
    pub(super) fn decode(&self, registers: &[u16], order: WordOrder) -> Decoded {
        let Some(raw) = self.take(registers, order) else {
            return Decoded::BAD;
        };
        if self.sentinels.contain(raw) {
            return Decoded::INVALID;
        }
        Decoded::good(Value::Number(self.scaled(self.signed(raw))))
    }

    pub(super) fn encode(
        &self,
        value: Number,
        order: WordOrder,
        registers: &mut [u16],
    ) -> Result<(), EncodeError> {
        let (min, max) = self.range();
        let raw = match self.form {
            Form::Share => {
                let hundred = 100 * 10_i128.pow(u32::from(value.decimals()));
                let raw = divide_half_even(i128::from(value.mantissa()) * i128::from(max), hundred);
                i64::try_from(raw).ok()
            }
            Form::Plain | Form::Magnitude => self.linear.invert(value),
        };
        let Some(raw) = raw.filter(|raw| (min..=max).contains(raw)) else {
            let (min, max) = (self.scaled(min), self.scaled(max));
            return Err(EncodeError::Range { value, min, max });
        };
        let word = self.word(raw);
        self.sentinels.refuse(word)?;
        self.put(word, order, registers);
        Ok(())
    }

    pub(super) fn encode_invalid(&self, order: WordOrder, registers: &mut [u16]) -> Result<(), EncodeError> {
        let word = self.sentinels.first().ok_or(EncodeError::NoSentinel)?;
        self.put(word, order, registers);
        Ok(())
    }

    /// The raw word.
    #[inline]
    pub(super) fn take(&self, registers: &[u16], order: WordOrder) -> Option<u32> {
        let word = match (self.registers, registers) {
            (1, &[word]) => u32::from(word),
            (2, &[first, second]) => join(first, second, order),
            _ => return None,
        };
        Some(word >> self.shift & self.mask)
    }

    /// The number that a raw word stands for.
    #[inline]
    const fn signed(&self, raw: u32) -> i64 {
        if matches!(self.form, Form::Magnitude) {
            let magnitude = (raw & !self.sign) as i64;
            return if raw & self.sign == 0 { magnitude } else { -magnitude };
        }
        let sign = self.sign as i64;
        (raw as i64 ^ sign) - sign
    }

    /// The raw word of a number within the range.
    const fn word(&self, number: i64) -> u32 {
        match self.form {
            Form::Magnitude if number < 0 => self.sign | number.unsigned_abs() as u32,
            _ => number as u32 & self.mask,
        }
    }

    /// Least and greatest number before scale.
    const fn range(&self) -> (i64, i64) {
        let (mask, sign) = (self.mask as i64, self.sign as i64);
        match self.form {
            Form::Magnitude => (-(mask & !sign), mask & !sign),
            _ if sign != 0 => (-sign, sign - 1),
            _ => (0, mask),
        }
    }

    #[inline]
    fn scaled(&self, raw: i64) -> Number {
        if self.form == Form::Share {
            let full = i64::from(self.mask);
            // 255 and 65535 are odd, so no raw number lies half-way and rounding up is rounding to the nearest.
            let mantissa = (2 * raw * SHARE_FULL + full) / (2 * full);
            return Number::from_parts(mantissa, SHARE_DECIMALS);
        }
        self.linear.apply(raw)
    }

    fn put(&self, word: u32, order: WordOrder, registers: &mut [u16]) {
        match registers {
            [register] => *register = *register & !self.bits() | (word << self.shift) as u16,
            [first, second] => {
                let (low, high) = (word as u16, (word >> 16) as u16);
                (*first, *second) = match order {
                    WordOrder::LowFirst => (low, high),
                    WordOrder::HighFirst => (high, low),
                };
            }
            _ => {}
        }
    }
}

#[inline]
const fn join(first: u16, second: u16, order: WordOrder) -> u32 {
    let (low, high) = match order {
        WordOrder::LowFirst => (first, second),
        WordOrder::HighFirst => (second, first),
    };
    (high as u32) << 16 | low as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Codec;
    use crate::terms::WordOrder::{HighFirst, LowFirst};

    fn field(data_type: DataType, field: Option<Field>, linear: Linear, sentinels: &[u64]) -> Codec {
        Codec::Number(NumberCodec::new(data_type, field, linear, Sentinels::new(sentinels)).unwrap())
    }

    fn number(data_type: DataType, sentinels: &[u64]) -> Codec {
        field(data_type, None, Linear::ONE, sentinels)
    }

    fn decoded(codec: &Codec, registers: &[u16], order: WordOrder) -> i64 {
        let value = codec.decode(registers, order).value.unwrap();
        value.as_number().unwrap().as_integer().unwrap()
    }

    #[test]
    fn decodes_every_type() {
        for (data_type, registers, order, expected) in [
            (DataType::U8, &[0xA5FF][..], LowFirst, 0xFF),
            (DataType::I8, &[0x1280], LowFirst, -128),
            (DataType::I8, &[0xFF7F], LowFirst, 127),
            (DataType::U16, &[0xFFFF], LowFirst, 0xFFFF),
            (DataType::I16, &[0x8000], LowFirst, -32768),
            (DataType::Sm16, &[0x8000], LowFirst, 0),
            (DataType::Sm16, &[0x802D], LowFirst, -45),
            (DataType::U32, &[0xE240, 1], LowFirst, 123_456),
            (DataType::U32, &[1, 0xE240], HighFirst, 123_456),
            (DataType::U32, &[0xFFFF, 0xFFFF], LowFirst, 0xFFFF_FFFF),
            (DataType::I32, &[0xFFFF, 0xFFFF], LowFirst, -1),
            (DataType::I32, &[0xFFFE, 0xFFFF], HighFirst, -65537),
            (DataType::I32, &[0, 0x8000], LowFirst, -0x8000_0000),
            (DataType::Sm24, &[0x3039, 0xFF00], LowFirst, -12345),
            (DataType::Sm24, &[0x3039, 0x0100], LowFirst, -12345),
            (DataType::Sm24, &[0, 0x8000], LowFirst, 0),
            (DataType::Sm24, &[0xFFFF, 0x00FF], LowFirst, 0xFF_FFFF),
        ] {
            assert_eq!(decoded(&number(data_type, &[]), registers, order), expected, "{data_type}");
        }
        let high = field(DataType::U8, Field::new(15, 8), Linear::ONE, &[]);
        assert_eq!(decoded(&high, &[0xA5FF], LowFirst), 0xA5);
        let middle = field(DataType::U16, Field::new(12, 3), Linear::ONE, &[]);
        assert_eq!(decoded(&middle, &[0b1110_0000_0000_1111], LowFirst), 1);
    }

    #[test]
    fn wrong_number_of_registers_is_bad() {
        for registers in [&[][..], &[1, 2], &[1, 2, 3]] {
            assert_eq!(number(DataType::I16, &[]).decode(registers, LowFirst), Decoded::BAD);
        }
        for registers in [&[][..], &[1], &[1, 2, 3]] {
            assert_eq!(number(DataType::U32, &[]).decode(registers, LowFirst), Decoded::BAD);
        }
    }

    #[test]
    fn sentinels_compare_the_raw_word() {
        let codec = number(DataType::I16, &[0x7FFE, 0x7FFF]);
        assert_eq!(codec.decode(&[0x7FFF], LowFirst), Decoded::INVALID);
        assert_eq!(decoded(&codec, &[0x7FFD], LowFirst), 0x7FFD);
        let codec = number(DataType::U32, &[0xFFFF_FFFF]);
        assert_eq!(codec.decode(&[0xFFFF, 0xFFFF], LowFirst), Decoded::INVALID);
        let mut registers = [0, 0];
        assert_eq!(
            codec.encode(&Value::Number(0xFFFF_FFFF.into()), LowFirst, &mut registers),
            Err(EncodeError::Sentinel { raw: 0xFFFF_FFFF })
        );
        codec.encode_invalid(LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0xFFFF, 0xFFFF]);
        assert_eq!(
            number(DataType::I16, &[]).encode_invalid(LowFirst, &mut [0]),
            Err(EncodeError::NoSentinel)
        );
    }

    #[test]
    fn bytes_leave_the_other_half_alone() {
        let mut registers = [0xABCD];
        let value = Value::Number((-1).into());
        number(DataType::I8, &[]).encode(&value, LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0xABFF]);
        let high = field(DataType::U8, Field::new(15, 8), Linear::ONE, &[]);
        high.encode(&Value::Number(0x12.into()), LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0x12FF]);
    }

    #[test]
    fn negative_magnitudes_are_written_with_a_full_sign_byte() {
        let mut registers = [0; 2];
        let value = Value::Number((-12345).into());
        number(DataType::Sm24, &[]).encode(&value, LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0x3039, 0xFF00]);
        number(DataType::Sm24, &[]).encode(&value, HighFirst, &mut registers).unwrap();
        assert_eq!(registers, [0xFF00, 0x3039]);
    }

    #[test]
    fn shares_round_half_even_to_four_decimals() {
        let (byte, word) = (number(DataType::Fraction8, &[]), number(DataType::Fraction16, &[]));
        for (codec, register, expected) in [
            (&byte, 0x00, "0"),
            (&byte, 0x80, "50.1961"),
            (&byte, 0xEEFF, "100"),
            (&word, 0x8000, "50.0008"),
            (&word, 0xFFFF, "100"),
        ] {
            let value = codec.decode(&[register], LowFirst).value.unwrap();
            assert_eq!(value.as_number().unwrap().to_string(), expected);
        }
    }

    #[test]
    fn range_errors_name_the_range() {
        let tenths = Linear { multiplier: 1, addend: 0, decimals: 1 };
        let codec = field(DataType::I16, None, tenths, &[]);
        let error = codec.encode(&Value::Number(3277.into()), LowFirst, &mut [0]).unwrap_err();
        assert_eq!(error.to_string(), "3277 is outside -3276.8 to 3276.7");
        let huge = Value::Number(i64::MAX.into());
        assert!(codec.encode(&huge, LowFirst, &mut [0]).is_err());
    }
}
