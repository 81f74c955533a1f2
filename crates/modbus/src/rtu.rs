//! RTU framing: unit id, PDU and CRC-16, with silence between frames (Modbus over Serial Line V1.02, 2.5.1).

use std::time::Duration;

use crate::error::{EncodeError, FrameError};
use crate::pdu::{MAX_PDU, Request, Response};

/// Bytes of the smallest frame: unit id, function code, CRC.
pub const MIN_FRAME: usize = 1 + 1 + CRC_LEN;
/// Bytes of the largest frame (Modbus over Serial Line V1.02, 2.5.1).
pub const MAX_FRAME: usize = 1 + MAX_PDU + CRC_LEN;

const CRC_LEN: usize = 2;
/// The generator polynomial, bit-reversed (Modbus over Serial Line V1.02, 6.2.2).
const POLYNOMIAL: u16 = 0xA001;

/// Above this, silences are fixed and no longer counted in characters (Modbus over Serial Line V1.02, 2.5.1.1).
const FASTEST_COUNTED_BAUD: u32 = 19_200;
const FIXED_SILENCE: Duration = Duration::from_micros(1_750);

/// One frame taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Which device on the line; 0 is all of them.
    pub unit: u8,
    /// 1 to 253 bytes.
    pub pdu: &'a [u8],
}

/// Takes one whole frame apart.
///
/// # Errors
/// [`FrameError::TooShort`], [`FrameError::TooLong`] or [`FrameError::Crc`].
pub fn decode(bytes: &[u8]) -> Result<Frame<'_>, FrameError> {
    if bytes.len() > MAX_FRAME {
        return Err(FrameError::TooLong { found: bytes.len(), max: MAX_FRAME });
    }
    let too_short = FrameError::TooShort { found: bytes.len(), min: MIN_FRAME };
    let Some((body, &crc)) = bytes.split_last_chunk::<CRC_LEN>() else {
        return Err(too_short);
    };
    let [unit, pdu @ ..] = body else {
        return Err(too_short);
    };
    if pdu.is_empty() {
        return Err(too_short);
    }
    let (found, computed) = (u16::from_le_bytes(crc), crc16(body));
    if found != computed {
        return Err(FrameError::Crc { found, computed });
    }
    Ok(Frame { unit: *unit, pdu })
}

/// Appends the frame of a request to `out`.
///
/// # Errors
/// Any [`EncodeError`]; `out` is then as it was.
pub fn encode_request(unit: u8, request: &Request<'_>, out: &mut Vec<u8>) -> Result<(), EncodeError> {
    encode(unit, out, |out| request.encode(out))
}

/// Appends the frame of a response to `out`.
///
/// # Errors
/// Any [`EncodeError`]; `out` is then as it was.
pub fn encode_response(unit: u8, response: &Response<'_>, out: &mut Vec<u8>) -> Result<(), EncodeError> {
    encode(unit, out, |out| response.encode(out))
}

fn encode(
    unit: u8,
    out: &mut Vec<u8>,
    pdu: impl FnOnce(&mut Vec<u8>) -> Result<(), EncodeError>,
) -> Result<(), EncodeError> {
    let start = out.len();
    out.reserve(MAX_FRAME);
    out.push(unit);
    if let Err(error) = pdu(out) {
        out.truncate(start);
        return Err(error);
    }
    let crc = crc16(out.get(start..).unwrap_or_default());
    out.extend_from_slice(&crc.to_le_bytes());
    Ok(())
}

/// The check sum of everything before it, unit id included; its low byte goes first on the wire
/// (Modbus over Serial Line V1.02, 2.5.1.2).
#[must_use]
pub fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        let [low, _] = crc.to_le_bytes();
        (crc >> 8) ^ TABLE[usize::from(low ^ byte)]
    })
}

/// The check sum of every single byte.
static TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < table.len() {
        let mut crc = byte as u16;
        let mut bit = 0;
        while bit < 8 {
            let carry = crc & 1 == 1;
            crc >>= 1;
            if carry {
                crc ^= POLYNOMIAL;
            }
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// The silence that must stand before a frame: 3.5 characters, 1.75 ms above 19200 baud
/// (Modbus over Serial Line V1.02, 2.5.1.1). Rounded up to the nanosecond.
///
/// `bits_per_char` counts start, data, parity and stop bits: 10 for 8N1, 11 for 8E1 and 8N2. A baud rate of 0 is
/// taken as 1.
#[must_use]
pub fn silence(baud: u32, bits_per_char: u8) -> Duration {
    if baud > FASTEST_COUNTED_BAUD {
        return FIXED_SILENCE;
    }
    const NANOSECONDS_OF_3_5_BITS: u64 = 3_500_000_000;
    let nanoseconds = NANOSECONDS_OF_3_5_BITS * u64::from(bits_per_char);
    Duration::from_nanos(nanoseconds.div_ceil(u64::from(baud.max(1))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pdu::ExceptionCode;

    #[test]
    fn check_sums() {
        let cases: [(&[u8], u16); 5] = [
            // The check value of CRC-16/MODBUS.
            (b"123456789", 0x4B37),
            (&[], 0xFFFF),
            (&[0x00], 0x40BF),
            (&[0x02, 0x07], 0x1241), // Modbus over Serial Line V1.02, 6.2.2
            (&[0x01, 0x03, 0x00, 0x20, 0x00, 0x10], 0xCC45),
        ];
        for (bytes, crc) in cases {
            assert_eq!(crc16(bytes), crc, "{bytes:02X?}");
            assert_eq!(crc16(&[bytes, &crc.to_le_bytes()].concat()), 0, "{bytes:02X?}");
        }
    }

    #[test]
    fn a_request_both_ways() {
        let bytes = [0x01, 0x06, 0x00, 0x40, 0x00, 0x10, 0x89, 0xD2];
        let request = Request::WriteSingleRegister { address: 0x40, value: 0x10 };
        let mut out = vec![0xEE];
        assert_eq!(encode_request(1, &request, &mut out), Ok(()));
        assert_eq!(out, [&[0xEE], &bytes[..]].concat());
        assert_eq!(decode(&bytes), Ok(Frame { unit: 1, pdu: &bytes[1..6] }));
    }

    #[test]
    fn what_cannot_be_encoded_leaves_no_trace() {
        let mut out = vec![0xEE];
        let response = Response::Exception { function: 0, code: ExceptionCode(1) };
        assert!(encode_response(1, &response, &mut out).is_err());
        assert_eq!(out, [0xEE]);
    }

    #[test]
    fn rejects_what_is_no_frame() {
        let short = |found| FrameError::TooShort { found, min: 4 };
        let cases: [(&[u8], FrameError); 5] = [
            (&[], short(0)),
            (&[1], short(1)),
            (&[1, 0x7E, 0x80], short(3)),
            (&[0; 257], FrameError::TooLong { found: 257, max: 256 }),
            (
                &[0x01, 0x03, 0x00, 0x20, 0x00, 0x10, 0xCC, 0x45],
                FrameError::Crc { found: 0x45CC, computed: 0xCC45 },
            ),
        ];
        for (bytes, error) in cases {
            assert_eq!(decode(bytes), Err(error), "{bytes:02X?}");
        }
    }

    #[test]
    fn silences() {
        let cases = [
            (1_200, 11, 32_083_334),
            (2_400, 10, 14_583_334),
            (9_600, 10, 3_645_834),
            (9_600, 11, 4_010_417),
            (19_200, 11, 2_005_209),
            (19_201, 11, 1_750_000),
            (115_200, 10, 1_750_000),
            (0, 10, 35_000_000_000),
        ];
        for (baud, bits, nanoseconds) in cases {
            assert_eq!(silence(baud, bits), Duration::from_nanos(nanoseconds), "{baud} baud, {bits} bits");
        }
    }
}
