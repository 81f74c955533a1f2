//! What makes this unit this unit: its model with the keys of its front, and the numbers that it bears.

use crate::random::Random;

/// Which keys the front has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Front {
    /// RUN is one key: the mode and the start.
    Run,
    /// MANUAL selects the mode and RUN starts, as on a D-700.
    ManualAndRun,
    /// None that the manual gives to this model, as on a D-300.
    Neither,
}

impl Front {
    fn of(model: &str) -> Self {
        match model {
            "D-300" => Self::Neither,
            "D-700" => Self::ManualAndRun,
            _ => Self::Run,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Identity {
    /// Register 10609.
    pub(super) code: u16,
    pub(super) model: String,
    pub(super) front: Front,
    pub(super) mac: [u8; 6],
    pub(super) unique: [u8; 12],
    pub(super) imei: [u8; 16],
}

impl Identity {
    pub(super) fn new(model: &str, code: u16, random: &mut Random) -> Self {
        let mut bytes = [0; 18];
        for (byte, word) in bytes.iter_mut().zip(std::iter::repeat_with(|| random.bits())) {
            *byte = word as u8;
        }
        let (mut mac, mut unique) = ([0; 6], [0; 12]);
        mac.copy_from_slice(&bytes[..6]);
        unique.copy_from_slice(&bytes[6..]);
        // Locally administered, so that it is no maker's address.
        mac[0] = 0x02;
        Self {
            code,
            model: model.to_owned(),
            front: Front::of(model),
            mac,
            unique,
            imei: imei(random.bits()),
        }
    }
}

/// 15 digits under the test prefix 001010 with their Luhn digit, in ASCII, then a zero byte.
fn imei(mut serial: u64) -> [u8; 16] {
    let mut digits = [0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    for digit in &mut digits[6..14] {
        *digit = (serial % 10) as u8;
        serial /= 10;
    }
    let sum: u8 = digits[..14]
        .iter()
        .enumerate()
        .map(|(position, digit)| match digit << (position % 2) {
            doubled @ 10.. => doubled - 9,
            kept => kept,
        })
        .sum();
    digits[14] = (10 - sum % 10) % 10;
    let mut text = [0; 16];
    for (letter, digit) in text.iter_mut().zip(digits) {
        *letter = b'0' + digit;
    }
    text
}
