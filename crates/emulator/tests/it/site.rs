//! A device under test: simulated time, and values read the way a client reads them.

use std::ops::RangeInclusive;
use std::time::Duration;

use busbar_emulator::{Config, Device};
use busbar_modbus::{ExceptionCode, Request, Response};
use busbar_profile::{BitSet, Decoded, Number, Point, Quality, Value};

pub(crate) const PUSH_BUTTONS: u16 = 8193;
pub(crate) const CHANNEL_SELECT: u16 = 8194;
pub(crate) const HARD_RESET: u16 = 8210;
pub(crate) const STOP: u16 = 1;
pub(crate) const RUN: u16 = 2;
pub(crate) const AUTO: u16 = 4;
pub(crate) const TEST: u16 = 8;
pub(crate) const GCB: u16 = 32;
pub(crate) const MCB: u16 = 64;

pub(crate) const TENTH: Duration = Duration::from_millis(100);

pub(crate) struct Site {
    pub(crate) device: Device,
    pub(crate) now: Duration,
}

impl Site {
    pub(crate) fn new(config: &Config) -> Self {
        Self { device: Device::new(config).unwrap(), now: Duration::ZERO }
    }

    pub(crate) fn quiet() -> Self {
        Self::new(&Config::default())
    }

    pub(crate) fn model(model: &str) -> Self {
        Self::new(&Config { model: Some(model.into()), ..Config::default() })
    }

    pub(crate) fn pass(&mut self, time: Duration) {
        self.now += time;
        self.device.advance(self.now);
    }

    pub(crate) fn pass_seconds(&mut self, seconds: u64) {
        self.pass(Duration::from_secs(seconds));
    }

    pub(crate) fn write(&mut self, address: u16, value: u16) {
        let echo = Response::WriteSingleRegister { address, value };
        assert_eq!(self.device.answer(1, &Request::WriteSingleRegister { address, value }), Some(echo));
    }

    pub(crate) fn press(&mut self, keys: u16) {
        self.write(PUSH_BUTTONS, keys);
    }

    /// Lets time pass until register 10604 shows a status; all statuses seen on the way, the first one included.
    pub(crate) fn walk_to(&mut self, status: u32) -> Vec<u32> {
        let mut seen = vec![self.code("operation_status")];
        for _ in 0..3000 {
            if seen.last() == Some(&status) {
                return seen;
            }
            self.pass(TENTH);
            let now = self.code("operation_status");
            if seen.last() != Some(&now) {
                seen.push(now);
            }
        }
        panic!("status {status} never came: {seen:?}");
    }

    pub(crate) fn decode(&self, id: &str) -> Decoded {
        let profile = self.device.profile();
        let point = profile.point(id).unwrap_or_else(|| panic!("no point {id}"));
        let registers = self.device.registers(point.address, point.registers);
        let registers = registers.unwrap_or_else(|| panic!("{id} cannot be read"));
        point.decode(registers, profile.wire.word_order)
    }

    pub(crate) fn exact(&self, id: &str) -> Number {
        let decoded = self.decode(id);
        decoded.value.and_then(|value| value.as_number()).unwrap_or_else(|| panic!("{id} is no number"))
    }

    pub(crate) fn number(&self, id: &str) -> f64 {
        self.exact(id).as_f64()
    }

    pub(crate) fn code(&self, id: &str) -> u32 {
        self.decode(id).value.and_then(|value| value.as_code()).unwrap_or_else(|| panic!("{id} is no code"))
    }

    pub(crate) fn bits(&self, id: &str) -> BitSet {
        let decoded = self.decode(id);
        *decoded.value.as_ref().and_then(Value::as_bits).unwrap_or_else(|| panic!("{id} is no set of bits"))
    }

    pub(crate) fn flag(&self, flag: u16) -> bool {
        self.bits("function_flags").contains(flag)
    }

    pub(crate) fn codes(&self, id: &str) -> Vec<u8> {
        match self.decode(id).value {
            Some(Value::Codes(codes)) => codes,
            other => panic!("{id} is no list of codes: {other:?}"),
        }
    }

    /// Every readable register.
    pub(crate) fn image(&self) -> Vec<u16> {
        let ranges = &self.device.profile().wire.readable;
        ranges
            .iter()
            .flat_map(|&(first, last)| self.device.registers(first, last - first + 1).unwrap())
            .copied()
            .collect()
    }
}

/// What came of a request.
#[derive(Debug, PartialEq)]
pub(crate) enum Answer {
    Registers(usize),
    Echo,
    Exception(u8),
    Silence,
}

/// Asks the device itself, without a wire.
pub(crate) fn ask(site: &mut Site, unit: u8, request: Request<'_>) -> Answer {
    match site.device.answer(unit, &request) {
        None => Answer::Silence,
        Some(Response::ReadHoldingRegisters(registers)) => Answer::Registers(registers.len()),
        Some(Response::Exception { function, code: ExceptionCode(code) }) => {
            assert_eq!(function, request.function());
            Answer::Exception(code)
        }
        Some(response) => {
            response.answers(&request).unwrap();
            Answer::Echo
        }
    }
}

/// Whether a person at the site would take this for the value of a number, a choice or a set of bits.
///
/// `plausible` gives the range of a number, and is asked for nothing else.
pub(crate) fn believe(
    point: &Point,
    decoded: Decoded,
    plausible: fn(&Point) -> RangeInclusive<f64>,
    situation: &str,
) {
    assert_eq!(decoded.quality, Quality::Good, "{situation}: {}", point.id);
    match decoded.value {
        Some(Value::Number(number)) => {
            let (value, range) = (number.as_f64(), plausible(point));
            assert!(range.contains(&value), "{situation}: {} = {value}, not in {range:?}", point.id);
        }
        Some(Value::Choice { code }) => {
            assert!(point.choice(code).is_some(), "{situation}: {} = {code}", point.id);
        }
        Some(Value::Bits(bits)) => {
            assert!(bits.iter().all(|bit| point.bit(bit).is_some()), "{situation}: {}", point.id);
        }
        other => panic!("{situation}: {} is {other:?}", point.id),
    }
}
