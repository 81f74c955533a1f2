//! Checks of one point for itself.

use std::ops::Range;

use super::Check;
use crate::codec::{BitsCodec, Codec, Field, MAX_SENTINELS, NumberCodec, Sentinels};
use crate::file::{At, PointFile};
use crate::number::Linear;
use crate::point::Point;
use crate::profile::Wire;
use crate::terms::{Access, DataType};
use crate::value::BitSet;

/// A point that is right for itself, and what it claims of its registers.
pub(super) struct Draft<'a> {
    pub(super) point: Point,
    pub(super) file: &'a At<PointFile>,
    /// Named and reserved bits of a set of bits.
    pub(super) claimed: BitSet,
}

impl<'a> Check<'a> {
    /// Checks one point; none where its registers cannot be told.
    pub(super) fn point(
        &mut self,
        file: &'a At<PointFile>,
        group: usize,
        wire: Option<&Wire>,
    ) -> Option<Draft<'a>> {
        self.id(&file.id);
        self.text(&file.name, &file.span, "name");
        for (text, what) in [(&file.doubt, "doubt"), (&file.verified, "verified")] {
            if let Some(text) = text {
                self.text(text, &file.span, what);
            }
        }
        self.keys(file);
        let registers = self.registers(file)?;
        self.place(file, registers, wire);
        let field = self.field(file)?;
        let scale = self.scale(file);
        let (scale_of, linear) = scale.unwrap_or((None, Linear::ONE));
        // A scale with a finding of its own is a scale all the same.
        if scale.is_some() {
            self.unit(file, scale_of);
        }
        let to_signal = if scale.is_some() { self.signal(file, scale_of) } else { None };
        let code_max = field.map_or(0xFFFF, Field::max);
        let size = file.size.as_deref().copied().unwrap_or(0);
        let sentinels = self.sentinels(file, field, registers);
        let (choices, reserved_codes) = self.choices_of(file, code_max.min(self.code_limit(file)))?;
        let (bits, reserved) = self.bits_of(file, size)?;
        let claimed = bits.iter().map(|bit| bit.bit).collect::<BitSet>().union(&reserved);
        let visible = (0..size.min(BitSet::CAPACITY)).collect::<BitSet>().difference(&reserved);
        let codec = codec(file, field, linear, registers, &sentinels, visible);
        let head = &self.file.groups[group];
        let point = Point {
            id: file.id.clone(),
            name: file.name.clone(),
            address: *file.at,
            registers,
            access: file.access.unwrap_or(Access::Read),
            data_type: *file.data_type,
            field: file.mask.as_deref().copied(),
            size: file.size.as_deref().copied(),
            unit: file.unit.as_deref().cloned(),
            scale: scale_of,
            signal: file.signal.as_deref().cloned(),
            choices,
            reserved_codes,
            bits,
            class: file.class.as_deref().copied(),
            sentinels,
            timer: None,
            hex: file.hex.as_deref().copied().unwrap_or(false),
            doubt: file.doubt.clone(),
            verified: file.verified.clone(),
            page: file.page.or(head.page),
            group,
            rate: file.rate.unwrap_or(head.rate),
            codec,
            samples: linear,
            to_signal,
        };
        Some(Draft { point, file, claimed })
    }

    /// Each key goes with some types, and some types need a key.
    fn keys(&mut self, file: &PointFile) {
        use DataType as T;
        fn span<X>(key: &Option<At<X>>) -> Option<Range<usize>> {
            key.as_ref().map(|at| at.span.clone())
        }
        let kind = *file.data_type;
        let number = kind.is_numeric();
        let scaled = number && !kind.is_fraction();
        let sized = matches!(kind, T::Bits | T::Bits2 | T::Bytes | T::Image);
        let rows = [
            ("coeff", span(&file.coeff), scaled || kind == T::Trace, false),
            ("ratio", span(&file.ratio), scaled || kind == T::Trace, false),
            ("offset", span(&file.offset), scaled, false),
            ("unit", span(&file.unit), number, false),
            ("signal", span(&file.signal), number || matches!(kind, T::Choice | T::Bits), false),
            ("choices", span(&file.choices), matches!(kind, T::Choice | T::Bits2), kind == T::Choice),
            ("bits", span(&file.bits), kind == T::Bits, kind == T::Bits),
            ("class", span(&file.class), kind == T::Bits, false),
            ("size", span(&file.size), sized, sized),
            ("count", span(&file.count), kind == T::Trace, kind == T::Trace),
            ("mask", span(&file.mask), matches!(kind, T::Choice | T::U8 | T::U16), false),
            ("sentinels", span(&file.sentinels), number || kind == T::Choice, false),
            ("timer", span(&file.timer), kind == T::Choice, false),
            ("hex", span(&file.hex), matches!(kind, T::U8 | T::U16 | T::U32), false),
        ];
        for (key, span, allowed, needed) in rows {
            match span {
                Some(span) if !allowed => {
                    self.note(&span, format!("`{key}` does not go with type {kind}"), "remove it");
                }
                None if needed => self.note(
                    &file.data_type.span,
                    format!("type {kind} needs `{key}`"),
                    format!("add {key}"),
                ),
                _ => {}
            }
        }
    }

    /// How many registers it takes; none where the text does not say.
    fn registers(&mut self, file: &PointFile) -> Option<u16> {
        use DataType as T;
        match *file.data_type {
            T::U32 | T::I32 | T::Sm24 => Some(2),
            T::Bits => {
                let size = file.size.as_ref()?;
                if **size == 0 || **size > BitSet::CAPACITY {
                    self.note(
                        &size.span,
                        format!("a set of {} bits", **size),
                        format!("write a size from 1 to {} bits", BitSet::CAPACITY),
                    );
                    return None;
                }
                Some(size.div_ceil(16))
            }
            T::Bits2 | T::Bytes | T::Image => {
                let size = file.size.as_ref()?;
                if **size == 0 || **size % 16 != 0 {
                    self.note(
                        &size.span,
                        format!("{} bits are not a whole number of registers", **size),
                        "write a multiple of 16",
                    );
                    return None;
                }
                Some(**size / 16)
            }
            T::Trace => {
                let count = file.count.as_ref()?;
                if **count == 0 {
                    self.note(&count.span, "a trace without samples", "write how many there are");
                    return None;
                }
                Some(**count)
            }
            _ => Some(1),
        }
    }

    /// Its registers lie where they can be read, and fit into one read.
    fn place(&mut self, file: &PointFile, registers: u16, wire: Option<&Wire>) {
        let first = *file.at;
        let Some(last) = first.checked_add(registers - 1) else {
            self.note(
                &file.at.span,
                format!("{registers} registers from {first} end past 65535"),
                "correct `at`",
            );
            return;
        };
        let Some(wire) = wire else {
            return;
        };
        let access = file.access.unwrap_or(Access::Read);
        if access.is_readable() && !wire.is_readable(first, registers) {
            self.note(
                &file.at.span,
                match registers {
                    1 => format!("register {first} is not readable"),
                    _ => format!("registers {first} to {last} are not readable in one range"),
                },
                "correct `at`, or add what the manual prints to wire.readable",
            );
        }
        if access.is_readable() && registers > wire.max_read && !file.data_type.is_bulk() {
            self.note(
                &file.data_type.span,
                format!("{registers} registers do not fit into one read of {}", wire.max_read),
                "correct the size; only a trace or an image can be read in parts",
            );
        }
        if access.is_writable() && registers > wire.max_write {
            self.note(
                &file.at.span,
                match registers {
                    1 => "no register can be written on this device".to_owned(),
                    _ => format!("{registers} registers cannot be written at once"),
                },
                "correct `access`, or wire.max_write",
            );
        }
    }

    /// The field of one register that a mask names, if there is one; none where it makes no sense.
    fn field(&mut self, file: &PointFile) -> Option<Option<Field>> {
        let Some(mask) = &file.mask else {
            return Some(None);
        };
        let (high, low) = **mask;
        let Some(field) = Field::new(high, low) else {
            self.note(
                &mask.span,
                format!("[{high}, {low}] is no field of a register"),
                "write [highest bit, lowest bit], from 15 down to 0",
            );
            return None;
        };
        if *file.data_type == DataType::U8 && field.max() > 0xFF {
            self.note(&mask.span, "a field of more than 8 bits", "write type = \"u16\", or a narrower mask");
            return None;
        }
        Some(Some(field))
    }

    fn code_limit(&self, file: &PointFile) -> u32 {
        if *file.data_type == DataType::Bits2 { 3 } else { 0xFFFF }
    }

    fn sentinels(&mut self, file: &PointFile, field: Option<Field>, registers: u16) -> Vec<u64> {
        use DataType as T;
        let Some(sentinels) = &file.sentinels else {
            return Vec::new();
        };
        let max = match *file.data_type {
            T::U8 | T::I8 | T::Fraction8 => field.map_or(0xFF, Field::max),
            _ if registers == 2 => u32::MAX,
            _ => field.map_or(0xFFFF, Field::max),
        };
        if let Some(word) = sentinels.iter().find(|word| **word > max) {
            self.note(
                &sentinels.span,
                format!("the sentinel {word:#X} does not fit into `{}`", *file.id),
                format!("write raw words up to {max:#X}"),
            );
        }
        if sentinels.is_empty() || sentinels.len() > MAX_SENTINELS {
            self.note(
                &sentinels.span,
                format!("{} sentinels", sentinels.len()),
                format!("write 1 to {MAX_SENTINELS}, or leave the key out"),
            );
        }
        sentinels.iter().map(|word| u64::from(*word)).collect()
    }
}

fn codec(
    file: &PointFile,
    field: Option<Field>,
    linear: Linear,
    registers: u16,
    sentinels: &[u64],
    visible: BitSet,
) -> Codec {
    use DataType as T;
    let sentinels = Sentinels::new(sentinels);
    let registers = usize::from(registers);
    match *file.data_type {
        T::Choice => Codec::Choice(field.unwrap_or(Field::WHOLE), sentinels),
        T::Bits => Codec::Bits(BitsCodec { registers, visible }),
        T::Bits2 => Codec::Codes { registers },
        T::Trace => Codec::Trace { registers },
        kind => match NumberCodec::new(kind, field, linear, sentinels) {
            Some(codec) => Codec::Number(codec),
            None => Codec::Bytes { registers },
        },
    }
}
