//! One frame taken apart: which transport, which direction, what it carries, or the byte at which it is none.

use busbar_modbus::{ExceptionCode, FrameError, Request, Response, mbap, rtu};
use serde::Serialize;

/// A frame, as `busbar frame --json` prints it.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Anatomy {
    pub(crate) transport: Transport,
    pub(crate) unit: u8,
    pub(crate) function: u8,
    pub(crate) kind: Kind,
    /// None over TCP, which has no CRC in the frame.
    pub(crate) crc_ok: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) transaction: Option<u16>,
    #[serde(flatten)]
    pub(crate) content: Content,
    /// The CRC in the frame and the one that its bytes give, where they differ.
    #[serde(skip)]
    pub(crate) wrong_crc: Option<(u16, u16)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Transport {
    Rtu,
    Tcp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
    Request,
    Response,
    /// Both look alike.
    RequestOrResponse,
    Exception,
}

/// What the frame carries; the fields that its kind does not have are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Content {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) address: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) count: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) value: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) values: Option<Values>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) registers: Option<Vec<u16>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bits: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) exception: Option<Exception>,
    /// The bytes after a function code that is not taken apart, hex.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) data: Option<String>,
}

/// What functions 15 and 16 write.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub(crate) enum Values {
    Coils(Vec<bool>),
    Registers(Vec<u16>),
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Exception {
    pub(crate) code: u8,
    pub(crate) name: String,
}

/// Bytes that are no frame: at which byte, counted from 0, and why.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("no frame: byte {at}, {why}")]
pub(crate) struct NoFrame {
    pub(crate) at: usize,
    pub(crate) why: String,
}

impl NoFrame {
    fn new(at: usize, why: impl Into<String>) -> Self {
        Self { at, why: why.into() }
    }
}

/// Bytes of an RTU frame before its PDU.
const RTU_PDU: usize = 1;

/// Takes the bytes of one frame apart. A right CRC proves RTU, a fitting MBAP header proves TCP; an RTU frame whose
/// CRC is wrong still counts as one when its function and length fit each other.
pub(crate) fn take_apart(bytes: &[u8]) -> Result<Anatomy, NoFrame> {
    if bytes.is_empty() {
        return Err(NoFrame::new(0, "there is nothing"));
    }
    match (rtu::decode(bytes), mbap::decode(bytes)) {
        (Ok(frame), tcp) => match (carried(frame.pdu, true), tcp) {
            (Ok((function, kind, content)), _) => Ok(rtu_anatomy(frame.unit, function, kind, content, None)),
            (Err(_), Ok(frame)) => tcp_anatomy(frame),
            (Err(wrong), Err(_)) => Err(wrong.after(RTU_PDU)),
        },
        (Err(_), Ok(frame)) => tcp_anatomy(frame),
        (Err(rtu), Err(tcp)) => without_proof(bytes, rtu, tcp),
    }
}

/// Neither CRC nor MBAP header is right.
fn without_proof(bytes: &[u8], rtu: FrameError, tcp: FrameError) -> Result<Anatomy, NoFrame> {
    let header = mbap::Header::read(bytes);
    // Nobody answers a broadcast, so a unit of 0 speaks for the first half of a transaction number.
    let like_tcp = header.is_some_and(|header| header.protocol == 0 && header.length <= 254);
    if let FrameError::Crc { found, computed } = rtu
        && !(like_tcp && bytes.first() == Some(&0))
        && let Some((unit, body)) = bytes.split_first()
        && let Some((pdu, _)) = body.split_last_chunk::<2>()
        && let Ok((function, kind, content)) = carried(pdu, false)
    {
        return Ok(rtu_anatomy(*unit, function, kind, content, Some((found, computed))));
    }
    if let (true, FrameError::Length { declared, found }) = (like_tcp, tcp) {
        return Err(NoFrame::new(
            4,
            format!("the MBAP header announces {declared} bytes and {found} follow"),
        ));
    }
    Err(match rtu {
        FrameError::TooShort { .. } => NoFrame::new(
            bytes.len(),
            format!("the bytes end here; the smallest frame has {} (RTU)", rtu::MIN_FRAME),
        ),
        FrameError::TooLong { max, .. } => NoFrame::new(
            max,
            format!("an RTU frame ends before it, and no MBAP header stands at byte 0 ({tcp})"),
        ),
        _ => {
            let crc = bytes.len().saturating_sub(2);
            let pdu = bytes.get(RTU_PDU..crc).unwrap_or_default();
            match carried(pdu, false) {
                Err(wrong) => {
                    let wrong = wrong.after(RTU_PDU);
                    NoFrame::new(
                        wrong.at,
                        format!("{}; the CRC at byte {crc} is wrong too ({rtu})", wrong.why),
                    )
                }
                Ok(_) => NoFrame::new(crc, rtu.to_string()),
            }
        }
    })
}

fn rtu_anatomy(
    unit: u8,
    function: u8,
    kind: Kind,
    content: Content,
    wrong_crc: Option<(u16, u16)>,
) -> Anatomy {
    let crc_ok = Some(wrong_crc.is_none());
    Anatomy { transport: Transport::Rtu, unit, function, kind, crc_ok, transaction: None, content, wrong_crc }
}

fn tcp_anatomy(frame: mbap::Frame<'_>) -> Result<Anatomy, NoFrame> {
    let (function, kind, content) =
        carried(frame.pdu, true).map_err(|wrong| wrong.after(mbap::HEADER_LEN))?;
    Ok(Anatomy {
        transport: Transport::Tcp,
        unit: frame.header.unit,
        function,
        kind,
        crc_ok: None,
        transaction: Some(frame.header.transaction),
        content,
        wrong_crc: None,
    })
}

/// What a PDU carries. A function that Busbar does not take apart is believed only when the frame is proven.
fn carried(pdu: &[u8], proven: bool) -> Result<(u8, Kind, Content), NoFrame> {
    let request = Request::decode(pdu).ok();
    let legal = request.as_ref().is_some_and(legal);
    let response = Response::decode(pdu).ok().and_then(of_response);
    let (kind, content) = match (request.and_then(of_request), response) {
        (Some(_), Some(response)) if !legal => (Kind::Response, response),
        (Some(request), Some(response)) => {
            (Kind::RequestOrResponse, Content { bits: response.bits, ..request })
        }
        (Some(request), None) => (Kind::Request, request),
        (None, Some(response)) if response.exception.is_some() => (Kind::Exception, response),
        (None, Some(response)) => (Kind::Response, response),
        (None, None) => match request {
            Some(Request::Other { data, .. }) if proven => {
                (Kind::RequestOrResponse, Content { data: Some(hex(data)), ..Content::default() })
            }
            _ => return Err(misfit(pdu)),
        },
    };
    Ok((pdu.first().copied().unwrap_or_default() & 0x7F, kind, content))
}

/// Whether a read of coils or inputs asks for a legal number of them. Where it does not, what looks alike is a response
/// of three data bytes.
fn legal(request: &Request<'_>) -> bool {
    match request {
        Request::ReadCoils { count, .. } | Request::ReadDiscreteInputs { count, .. } => {
            (1..=2000).contains(count)
        }
        _ => true,
    }
}

fn of_request(request: Request<'_>) -> Option<Content> {
    let content = |address: u16| Content { address: Some(address), ..Content::default() };
    Some(match request {
        Request::ReadCoils { address, count }
        | Request::ReadDiscreteInputs { address, count }
        | Request::ReadHoldingRegisters { address, count }
        | Request::ReadInputRegisters { address, count } => {
            Content { count: Some(count), ..content(address) }
        }
        Request::WriteSingleCoil { address, value } | Request::WriteSingleRegister { address, value } => {
            Content { value: Some(value), ..content(address) }
        }
        Request::WriteMultipleCoils { address, coils } => {
            Content { values: Some(Values::Coils(coils.iter().collect())), ..content(address) }
        }
        Request::WriteMultipleRegisters { address, registers } => {
            Content { values: Some(Values::Registers(registers.iter().collect())), ..content(address) }
        }
        Request::Other { .. } => return None,
    })
}

fn of_response(response: Response<'_>) -> Option<Content> {
    Some(match response {
        Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => {
            Content { bits: Some(bits.iter().collect()), ..Content::default() }
        }
        Response::ReadHoldingRegisters(registers) | Response::ReadInputRegisters(registers) => {
            Content { registers: Some(registers.iter().collect()), ..Content::default() }
        }
        Response::WriteSingleCoil { address, value } | Response::WriteSingleRegister { address, value } => {
            Content { address: Some(address), value: Some(value), ..Content::default() }
        }
        Response::WriteMultipleCoils { address, count }
        | Response::WriteMultipleRegisters { address, count } => {
            Content { address: Some(address), count: Some(count), ..Content::default() }
        }
        Response::Exception { code: ExceptionCode(raw), .. } => {
            let name = ExceptionCode(raw).name().to_owned();
            Content { exception: Some(Exception { code: raw, name }), ..Content::default() }
        }
        Response::Other { .. } => return None,
    })
}

/// Why a PDU is neither a request nor a response, at a byte counted from the function code.
fn misfit(pdu: &[u8]) -> NoFrame {
    let function = pdu.first().copied().unwrap_or_default();
    let after = pdu.len().saturating_sub(2);
    match function {
        0 | 0x80 => NoFrame::new(0, format!("{function:02X}h is no function code")),
        0x81.. => NoFrame::new(
            2,
            format!(
                "an exception ({function:02X}h) has one byte after its function code, not {}",
                pdu.len() - 1
            ),
        ),
        1..=4 if pdu.len() < 2 => NoFrame::new(1, format!("function {function} ends right after its code")),
        1..=4 => {
            let declared = pdu.get(1).copied().unwrap_or_default();
            let odd = function >= 3 && !declared.is_multiple_of(2) && usize::from(declared) == after;
            let response = if odd {
                format!("as a response it announces {declared} bytes, which is no number of whole registers")
            } else {
                format!("as a response it announces {declared} bytes and {after} follow")
            };
            let length = pdu.len() - 1;
            NoFrame::new(
                1,
                format!(
                    "function {function} fits neither way: {response}, as a request it would have 4 bytes after the function code, not {length}"
                ),
            )
        }
        5 | 6 => {
            NoFrame::new(1, format!("function {function} has 4 bytes after its code, not {}", pdu.len() - 1))
        }
        15 | 16 if pdu.len() < 6 => NoFrame::new(
            pdu.len(),
            format!(
                "function {function} has 4 bytes after its code in a response and more in a request, not {}",
                pdu.len() - 1
            ),
        ),
        15 | 16 => NoFrame::new(
            5,
            format!("function {function}: number of values, byte count and bytes do not fit each other"),
        ),
        _ => NoFrame::new(0, format!("function {function} is not one that Busbar takes apart")),
    }
}

impl NoFrame {
    /// The same, counted from the first byte of the frame.
    fn after(self, bytes: usize) -> Self {
        Self { at: self.at + bytes, ..self }
    }
}

/// Lower-case hex without blanks.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(hex: &str) -> Vec<u8> {
        hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
    }

    /// The unit and PDU in `hex` with their CRC behind them.
    fn rtu(hex: &str) -> Vec<u8> {
        let mut frame = bytes(hex);
        let crc = rtu::crc16(&frame);
        frame.extend(crc.to_le_bytes());
        frame
    }

    fn json(bytes: &[u8]) -> String {
        serde_json::to_string(&take_apart(bytes).unwrap()).unwrap()
    }

    #[test]
    fn takes_every_kind_apart() {
        for (hex, expected) in [
            ("01 01 00 13 00 13", r#""function":1,"kind":"request","crc_ok":true,"address":19,"count":19"#),
            (
                "01 01 01 CD",
                r#""function":1,"kind":"response","crc_ok":true,"bits":[true,false,true,true,false,false,true,true]"#,
            ),
            // The standard's own example: three data bytes, which would be a read of 27397 coils.
            ("01 01 03 CD 6B 05", r#""function":1,"kind":"response","crc_ok":true,"bits":[true,false,"#),
            (
                "01 02 03 00 00 08",
                r#""function":2,"kind":"request_or_response","crc_ok":true,"address":768,"count":8,"bits":[false,"#,
            ),
            ("01 03 00 20 00 10", r#""function":3,"kind":"request","crc_ok":true,"address":32,"count":16"#),
            // Nothing but a request can look like this, however much it asks for.
            (
                "01 03 03 08 FE 00",
                r#""function":3,"kind":"request","crc_ok":true,"address":776,"count":65024"#,
            ),
            ("01 01 00 00 00 00", r#""function":1,"kind":"request","crc_ok":true,"address":0,"count":0"#),
            ("01 03 04 08 FE 00 00", r#""function":3,"kind":"response","crc_ok":true,"registers":[2302,0]"#),
            ("01 04 02 FF FF", r#""function":4,"kind":"response","crc_ok":true,"registers":[65535]"#),
            (
                "01 05 3A 9C FF 00",
                r#""function":5,"kind":"request_or_response","crc_ok":true,"address":15004,"value":65280"#,
            ),
            (
                "01 06 00 40 00 10",
                r#""function":6,"kind":"request_or_response","crc_ok":true,"address":64,"value":16"#,
            ),
            (
                "01 0F 00 13 00 03 01 05",
                r#""function":15,"kind":"request","crc_ok":true,"address":19,"values":[true,false,true]"#,
            ),
            ("01 0F 00 13 00 0A", r#""function":15,"kind":"response","crc_ok":true,"address":19,"count":10"#),
            (
                "01 10 20 01 00 02 04 00 01 00 02",
                r#""function":16,"kind":"request","crc_ok":true,"address":8193,"values":[1,2]"#,
            ),
            (
                "01 10 20 01 00 02",
                r#""function":16,"kind":"response","crc_ok":true,"address":8193,"count":2"#,
            ),
            (
                "01 83 02",
                r#""function":3,"kind":"exception","crc_ok":true,"exception":{"code":2,"name":"illegal data address"}"#,
            ),
            ("01 2B 0E 01 00", r#""function":43,"kind":"request_or_response","crc_ok":true,"data":"0e0100""#),
        ] {
            let expected = format!(r#"{{"transport":"rtu","unit":1,{expected}"#);
            let json = json(&rtu(hex));
            assert!(json.starts_with(&expected), "{hex}: {json}");
        }
    }

    #[test]
    fn the_manuals_frames_are_rtu() {
        let frame = take_apart(&bytes("01 03 00 20 00 10 45 CC")).unwrap();
        assert_eq!((frame.transport, frame.crc_ok), (Transport::Rtu, Some(true)));
        let frame = take_apart(&bytes("01 06 00 40 00 10 89 D2")).unwrap();
        assert_eq!((frame.transport, frame.kind), (Transport::Rtu, Kind::RequestOrResponse));
    }

    #[test]
    fn tcp_has_a_transaction_and_no_crc() {
        assert_eq!(
            json(&bytes("12 34 00 00 00 06 01 03 28 06 00 02")),
            r#"{"transport":"tcp","unit":1,"function":3,"kind":"request","crc_ok":null,"transaction":4660,"address":10246,"count":2}"#
        );
        assert_eq!(
            json(&bytes("00 01 00 00 00 03 01 83 0A")),
            r#"{"transport":"tcp","unit":1,"function":3,"kind":"exception","crc_ok":null,"transaction":1,"exception":{"code":10,"name":"gateway path unavailable"}}"#
        );
    }

    #[test]
    fn a_wrong_crc_leaves_the_rest() {
        let frame = take_apart(&bytes("01 03 00 20 00 10 45 CD")).unwrap();
        assert_eq!((frame.crc_ok, frame.wrong_crc), (Some(false), Some((0xCD45, 0xCC45))));
        assert_eq!((frame.content.address, frame.content.count), (Some(32), Some(16)));
        // A read of register 0 has the zeros of an MBAP header at the right place, and is none.
        let frame = take_apart(&bytes("01 03 00 00 00 0A C5 CE")).unwrap();
        assert_eq!((frame.transport, frame.content.count), (Transport::Rtu, Some(10)));
    }

    #[test]
    fn says_at_which_byte_it_is_no_frame() {
        let check = |bytes: &[u8], at, why: &str| {
            let wrong = take_apart(bytes).unwrap_err();
            assert!(wrong.at == at && wrong.why.contains(why), "{bytes:02X?}: {wrong}");
        };
        check(&[], 0, "nothing");
        check(&bytes("01 03"), 2, "end here");
        check(&bytes("DE AD BE EF"), 3, "exception (ADh)");
        check(&bytes("00 01 00 00 00 06 01 03 28 06 00"), 4, "announces 6 bytes and 5 follow");
        check(&bytes("00 01 00 00 00 06 01 03"), 4, "announces 6 bytes and 2 follow");
        check(&bytes("00 01 00 00 00 04 01 03 02 08"), 8, "announces 2 bytes and 1 follow");
        check(&bytes("48 65 6C 6C 6F"), 1, "function 101");
        check(&rtu("01 03 01 08"), 2, "no number of whole registers");
        check(&rtu("01 03 04 08 FE 00 00 00"), 2, "announces 4 bytes and 5 follow");
        check(&rtu("01 00"), 1, "no function code");
        check(&rtu("01 06 00 40 00"), 2, "4 bytes after its code, not 3");
        check(&rtu("01 10 20 01 00 02 04 00 01"), 6, "do not fit");
        check(&rtu("01 03"), 2, "right after");
        check(&[0x01; 300], 256, "RTU frame ends");
    }

    #[test]
    fn any_bytes_are_survived() {
        for length in 0..12 {
            for seed in 0..2000_u64 {
                let bytes: Vec<u8> = (0..length)
                    .map(|i| (seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (i * 5)) as u8)
                    .collect();
                if let Err(wrong) = take_apart(&bytes) {
                    assert!(wrong.at <= bytes.len(), "{bytes:02X?}: {wrong}");
                }
            }
        }
    }
}
