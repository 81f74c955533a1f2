//! MBAP framing: a PDU behind the seven-byte header of Modbus TCP (Modbus Messaging on TCP/IP V1.0b, 3.1.3).

use crate::error::{EncodeError, FrameError};
use crate::pdu::{MAX_PDU, Request, Response};

/// The port registered for Modbus TCP.
pub const PORT: u16 = 502;

/// Bytes of the header, unit id included.
pub const HEADER_LEN: usize = 7;
/// Bytes of the smallest frame: header and function code.
pub const MIN_FRAME: usize = HEADER_LEN + 1;
/// Bytes of the largest frame.
pub const MAX_FRAME: usize = HEADER_LEN + MAX_PDU;

/// Bytes before those that the length field counts.
const BEFORE_LENGTH: usize = 6;
/// The length field counts the unit id and a PDU of 1 to 253 bytes.
const MIN_LENGTH: u16 = 2;
const MAX_LENGTH: u16 = 254;

/// The header in front of every PDU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Chosen by the client, repeated by the server.
    pub transaction: u16,
    /// 0 for Modbus.
    pub protocol: u16,
    /// Bytes that follow this field: unit id and PDU, 2 to 254.
    pub length: u16,
    /// Which device behind the address; a server repeats it.
    pub unit: u8,
}

impl Header {
    /// The header at the front of `bytes`, unjudged; `None` when there are fewer than seven.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let &[t1, t0, p1, p0, l1, l0, unit] = bytes.first_chunk::<HEADER_LEN>()?;
        Some(Self {
            transaction: u16::from_be_bytes([t1, t0]),
            protocol: u16::from_be_bytes([p1, p0]),
            length: u16::from_be_bytes([l1, l0]),
            unit,
        })
    }
}

/// One frame taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The header.
    pub header: Header,
    /// 1 to 253 bytes.
    pub pdu: &'a [u8],
}

/// Takes one whole frame apart.
///
/// # Errors
/// [`FrameError::TooShort`], [`FrameError::Protocol`], or [`FrameError::Length`] when the length field is impossible
/// or is not what follows it.
pub fn decode(bytes: &[u8]) -> Result<Frame<'_>, FrameError> {
    let (Some(header), Some(pdu @ [_, ..])) = (Header::read(bytes), bytes.get(HEADER_LEN..)) else {
        return Err(FrameError::TooShort { found: bytes.len(), min: MIN_FRAME });
    };
    if header.protocol != 0 {
        return Err(FrameError::Protocol { found: header.protocol });
    }
    let found = bytes.len() - BEFORE_LENGTH;
    let possible = (MIN_LENGTH..=MAX_LENGTH).contains(&header.length);
    if !possible || usize::from(header.length) != found {
        return Err(FrameError::Length { declared: header.length, found });
    }
    Ok(Frame { header, pdu })
}

/// Appends the frame of a request to `out`.
///
/// # Errors
/// Any [`EncodeError`]; `out` is then as it was.
pub fn encode_request(
    transaction: u16,
    unit: u8,
    request: &Request<'_>,
    out: &mut Vec<u8>,
) -> Result<(), EncodeError> {
    encode(transaction, unit, out, |out| request.encode(out))
}

/// Appends the frame of a response to `out`; several may go out in one write.
///
/// # Errors
/// Any [`EncodeError`]; `out` is then as it was.
pub fn encode_response(
    transaction: u16,
    unit: u8,
    response: &Response<'_>,
    out: &mut Vec<u8>,
) -> Result<(), EncodeError> {
    encode(transaction, unit, out, |out| response.encode(out))
}

fn encode(
    transaction: u16,
    unit: u8,
    out: &mut Vec<u8>,
    pdu: impl FnOnce(&mut Vec<u8>) -> Result<(), EncodeError>,
) -> Result<(), EncodeError> {
    let start = out.len();
    out.reserve(MAX_FRAME);
    let [t1, t0] = transaction.to_be_bytes();
    out.extend_from_slice(&[t1, t0, 0, 0, 0, 0, unit]);
    if let Err(error) = pdu(out) {
        out.truncate(start);
        return Err(error);
    }
    // A PDU has at most 253 bytes, so the length is at most 254.
    let length = u16::try_from(out.len() - start - BEFORE_LENGTH).unwrap_or(MAX_LENGTH);
    if let Some(field) = out.get_mut(start + 4..start + BEFORE_LENGTH) {
        field.copy_from_slice(&length.to_be_bytes());
    }
    Ok(())
}

/// What stands at the front of a stream.
pub(crate) enum Front {
    /// Not enough bytes yet.
    Incomplete,
    /// A frame of so many bytes.
    Frame { header: Header, len: usize },
    /// No Modbus, but it says where it ends.
    Foreign { len: usize },
    /// Nobody knows where the next frame begins.
    Broken { found: u16 },
}

/// Judges the front of a stream, as soon as the header is there: a bad length is not waited for.
pub(crate) fn front(bytes: &[u8]) -> Front {
    let Some(header) = Header::read(bytes) else {
        return Front::Incomplete;
    };
    if !(MIN_LENGTH..=MAX_LENGTH).contains(&header.length) {
        return Front::Broken { found: header.length };
    }
    let len = BEFORE_LENGTH + usize::from(header.length);
    if bytes.len() < len {
        return Front::Incomplete;
    }
    if header.protocol != 0 {
        return Front::Foreign { len };
    }
    Front::Frame { header, len }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pdu::ExceptionCode;

    /// A read of one register, transaction 1501h.
    const READ: [u8; 12] = [0x15, 0x01, 0, 0, 0, 6, 0xFF, 0x03, 0x00, 0x04, 0x00, 0x01];

    #[test]
    fn a_request_both_ways() {
        let request = Request::ReadHoldingRegisters { address: 4, count: 1 };
        let mut out = vec![0xEE];
        assert_eq!(encode_request(0x1501, 0xFF, &request, &mut out), Ok(()));
        assert_eq!(out, [&[0xEE], &READ[..]].concat());

        let header = Header { transaction: 0x1501, protocol: 0, length: 6, unit: 0xFF };
        assert_eq!(decode(&READ), Ok(Frame { header, pdu: &READ[7..] }));
    }

    #[test]
    fn responses_append_one_after_the_other() {
        let mut out = Vec::new();
        let busy = Response::Exception { function: 3, code: ExceptionCode::SERVER_DEVICE_BUSY };
        assert_eq!(encode_response(1, 2, &busy, &mut out), Ok(()));
        assert_eq!(encode_response(2, 2, &busy, &mut out), Ok(()));
        assert_eq!(out, [0, 1, 0, 0, 0, 3, 2, 0x83, 6, 0, 2, 0, 0, 0, 3, 2, 0x83, 6]);
    }

    #[test]
    fn what_cannot_be_encoded_leaves_no_trace() {
        let mut out = vec![0xEE];
        let request = Request::ReadHoldingRegisters { address: 0, count: 0 };
        assert!(encode_request(1, 1, &request, &mut out).is_err());
        assert_eq!(out, [0xEE]);
    }

    #[test]
    fn the_largest_frame() {
        let request = Request::Other { function: 0x65, data: &[7; 252] };
        let mut out = Vec::new();
        assert_eq!(encode_request(1, 1, &request, &mut out), Ok(()));
        assert_eq!(out.len(), MAX_FRAME);
        let frame = decode(&out).unwrap();
        assert_eq!((frame.header.length, frame.pdu.len()), (254, MAX_PDU));
    }

    #[test]
    fn rejects_what_is_no_frame() {
        let with = |at: usize, byte: u8| {
            let mut bytes = READ.to_vec();
            bytes[at] = byte;
            bytes
        };
        let cases = [
            (vec![], FrameError::TooShort { found: 0, min: 8 }),
            (READ[..6].to_vec(), FrameError::TooShort { found: 6, min: 8 }),
            (READ[..7].to_vec(), FrameError::TooShort { found: 7, min: 8 }),
            (with(2, 1), FrameError::Protocol { found: 0x0100 }),
            (with(5, 1), FrameError::Length { declared: 1, found: 6 }),
            (with(5, 7), FrameError::Length { declared: 7, found: 6 }),
            (with(4, 1), FrameError::Length { declared: 262, found: 6 }),
            (READ[..11].to_vec(), FrameError::Length { declared: 6, found: 5 }),
        ];
        for (bytes, error) in cases {
            assert_eq!(decode(&bytes), Err(error), "{bytes:02X?}");
        }
    }
}
