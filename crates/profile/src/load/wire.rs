//! Checks of the wire rules.

use std::collections::HashSet;
use std::hash::Hash;

use super::Check;
use crate::file::WireFile;
use crate::number::Number;
use crate::profile::{ExceptionName, SerialSettings, UnitRange, Wire};

/// The Modbus specification's most registers in one read and in one write.
const READ_LIMIT: u16 = 125;
const WRITE_LIMIT: u16 = 123;

impl Check<'_> {
    /// The wire rules; none where the readable ranges make no sense.
    pub(super) fn wire(&mut self) -> Option<Wire> {
        let wire = &self.file.wire;
        self.wire_unit(wire);
        self.wire_functions(wire);
        self.wire_limits(wire);
        self.wire_serial(wire);
        let readable = self.wire_readable(wire)?;
        Some(Wire {
            transports: wire.transports.clone(),
            unit: UnitRange { min: wire.unit.min, max: wire.unit.max, default: wire.unit.default },
            functions: wire.functions.clone(),
            max_read: *wire.max_read,
            max_write: wire.max_write.as_deref().copied().unwrap_or(0),
            over_read: wire.over_read,
            spacing_ms: wire.spacing_ms,
            answer_delay_ms: wire.answer_delay_ms.0,
            timeout_ms: *wire.timeout_ms,
            word_order: wire.word_order,
            serial: SerialSettings {
                baud: wire.serial.baud.clone(),
                parity: wire.serial.parity.clone(),
                stop: wire.serial.stop.clone(),
            },
            readable,
            exceptions: wire
                .exceptions
                .iter()
                .map(|exception| ExceptionName { code: exception.code, name: exception.name.clone() })
                .collect(),
        })
    }

    fn wire_unit(&mut self, wire: &WireFile) {
        let unit = &wire.unit;
        if unit.min == 0 || unit.min > unit.max {
            self.note(
                &unit.span,
                format!("{} to {} is no range of unit ids", unit.min, unit.max),
                "write the lowest and the highest; 0 is the broadcast address and no unit",
            );
        }
        if unit.default.is_some_and(|default| !(unit.min..=unit.max).contains(&default)) {
            self.note(&unit.span, "the default unit is outside the range", "correct it or leave it out");
        }
    }

    fn wire_functions(&mut self, wire: &WireFile) {
        let functions = &wire.functions;
        if let Some(function) = functions.iter().find(|function| !(1..=127).contains(*function)) {
            self.note(
                &functions.span,
                format!("{function} is not a function code"),
                "write codes from 1 to 127",
            );
        }
        if !functions.contains(&3) && !functions.contains(&4) {
            self.note(&functions.span, "no function reads registers", "add 3 (or 4) as the manual says");
        }
        if has_repeats(functions) {
            self.note(&functions.span, "a function is there twice", "keep one of the two");
        }
        if wire.transports.is_empty() || has_repeats(&wire.transports) {
            self.note(
                &wire.transports.span,
                "transports are missing or there twice",
                "list each transport of the manual once",
            );
        }
        for (i, exception) in wire.exceptions.iter().enumerate() {
            self.text(&exception.name, &exception.span, "name");
            let repeats = wire.exceptions[..i].iter().any(|other| other.code == exception.code);
            if repeats || exception.code == 0 {
                self.note(
                    &exception.span,
                    format!("the exception code {} is 0 or there twice", exception.code),
                    "list each code of the manual once",
                );
            }
        }
    }

    fn wire_limits(&mut self, wire: &WireFile) {
        if !(1..=READ_LIMIT).contains(&*wire.max_read) {
            self.note(
                &wire.max_read.span,
                format!("{} registers cannot be read at once", *wire.max_read),
                format!("write a number from 1 to {READ_LIMIT}"),
            );
        }
        let writes = wire.functions.contains(&6) || wire.functions.contains(&16);
        match &wire.max_write {
            Some(max) if !writes || !(1..=WRITE_LIMIT).contains(&**max) => self.note(
                &max.span,
                format!("{} registers cannot be written at once with these functions", **max),
                format!(
                    "write a number from 1 to {WRITE_LIMIT}, or leave it out where neither 6 nor 16 is known"
                ),
            ),
            None if writes => self.note(
                &wire.functions.span,
                "functions write registers and max_write is missing",
                "add max_write (1 where function 6 alone is known)",
            ),
            _ => {}
        }
        if *wire.timeout_ms == 0 {
            self.note(&wire.timeout_ms.span, "a time-out of 0 ms", "write how long an answer may take");
        }
        if wire.answer_delay_ms.0 < Number::ZERO {
            self.note(&wire.answer_delay_ms.span, "an answer before its request", "write 0 or more");
        }
    }

    fn wire_serial(&mut self, wire: &WireFile) {
        let serial = &wire.serial;
        let is_list = |ok: bool, repeats: bool| ok && !repeats;
        let baud = !serial.baud.is_empty() && !serial.baud.contains(&0);
        let stop = !serial.stop.is_empty() && serial.stop.iter().all(|stop| matches!(stop, 1 | 2));
        let good = is_list(baud, has_repeats(&serial.baud))
            && is_list(stop, has_repeats(&serial.stop))
            && is_list(!serial.parity.is_empty(), has_repeats(&serial.parity));
        if !good {
            self.note(
                &serial.span,
                "the serial settings make no sense",
                "list each speed above 0, each parity, and 1 or 2 stop bits, each once",
            );
        }
    }

    /// The ranges with neighbours joined, so that a read across two of them is one inside the map.
    fn wire_readable(&mut self, wire: &WireFile) -> Option<Vec<(u16, u16)>> {
        let mut joined: Vec<(u16, u16)> = Vec::with_capacity(wire.readable.len());
        let mut good = true;
        for range in wire.readable.iter() {
            let (first, last) = **range;
            let after = joined.last().map(|(_, last)| *last);
            if first > last || after.is_some_and(|after| first <= after) {
                self.note(
                    &range.span,
                    format!("[{first}, {last}] is not above the range before it"),
                    "write [first, last], ascending, without overlap",
                );
                good = false;
                continue;
            }
            match joined.last_mut() {
                Some(before) if before.1 + 1 == first => before.1 = last,
                _ => joined.push((first, last)),
            }
        }
        if wire.readable.is_empty() {
            self.note(&wire.readable.span, "nothing is readable", "list the ranges that the manual prints");
            good = false;
        }
        good.then_some(joined)
    }
}

fn has_repeats<T: Hash + Eq>(list: &[T]) -> bool {
    let mut seen = HashSet::new();
    !list.iter().all(|item| seen.insert(item))
}
