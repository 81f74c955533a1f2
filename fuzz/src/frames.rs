//! What must hold for any bytes, one function a fuzz target. The tests of `busbar-modbus` include this file to replay
//! the corpus and to try random streams.

// Public for the fuzz targets; in a test it is a private module, and what fails there may panic.
#![allow(unreachable_pub, dead_code, clippy::expect_used)]

use std::time::Duration;

use busbar_modbus::{
    Bits, Client, ExceptionCode, Framing, ListenerDecoder, Losses, Progress, Request, Response, Server,
    ServerDecoder, mbap, rtu,
};

/// Decoding never panics; what decodes and can be encoded decodes to the same again; an answer is no longer than the
/// request says.
pub fn pdu(bytes: &[u8]) {
    if let Ok(request) = Request::decode(bytes) {
        let mut again = Vec::new();
        if request.encode(&mut again).is_ok() {
            assert_eq!(Request::decode(&again), Ok(request));
            assert_eq!(again.len(), bytes.len());
        }
    }
    if let Ok(response) = Response::decode(bytes) {
        let mut again = Vec::new();
        if response.encode(&mut again).is_ok() {
            assert_eq!(Response::decode(&again), Ok(response));
            assert_eq!(again, bytes);
        }
    }
    let _ = (rtu::decode(bytes), mbap::decode(bytes));

    // The first byte says where the request ends and the response begins.
    let Some((&at, rest)) = bytes.split_first() else {
        return;
    };
    let Some((request, answer)) = rest.split_at_checked(at.into()) else {
        return;
    };
    let (Ok(request), Ok(response)) = (Request::decode(request), Response::decode(answer)) else {
        return;
    };
    if response.answers(&request).is_ok() {
        assert_eq!(response.function(), request.function());
        let full = request.response_len().unwrap_or(answer.len());
        assert!(answer.len() <= full, "{response:?} to {request:?}");
    }
}

/// A frame that was cut out, with what told about it.
type Cut<T> = (T, u16, u8, Vec<u8>);

/// The same frames come out in whatever pieces the bytes came, every one stands in the bytes with its check sum, and
/// every byte was in a frame or was counted.
pub fn rtu_stream(bytes: &[u8]) {
    let Some((&size, stream)) = bytes.split_first() else {
        return;
    };
    let whole = serve(Framing::Rtu, stream, stream.len().max(1));
    assert_eq!(whole, serve(Framing::Rtu, stream, usize::from(size) + 1));

    let (frames, losses, waiting) = whole;
    assert!(!waiting, "silence leaves nothing");
    assert_rtu(stream, &frames, losses.garbage_bytes);
}

/// The same frames come out in whatever pieces the bytes came, and no byte was in two. A server sees them too, and can
/// answer each.
pub fn tcp_stream(bytes: &[u8]) {
    let Some((&size, stream)) = bytes.split_first() else {
        return;
    };
    let whole = serve(Framing::Tcp, stream, stream.len().max(1));
    assert_eq!(whole, serve(Framing::Tcp, stream, usize::from(size) + 1));

    let (frames, losses, _) = whole;
    let in_frames: usize = frames.iter().map(|frame| mbap::HEADER_LEN + frame.3.len()).sum();
    assert!(in_frames as u64 + losses.garbage_bytes <= stream.len() as u64);

    let mut server = Server::new(Framing::Tcp);
    server.receive(Duration::ZERO, stream);
    let mut requests = 0;
    while let Some(incoming) = server.next_request() {
        let function = incoming.request.function();
        let mut answer = Vec::new();
        let refused = Response::Exception { function, code: ExceptionCode::ILLEGAL_FUNCTION };
        assert_eq!(incoming.respond(&refused, &mut answer), Ok(()));
        let frame = mbap::decode(&answer).map(|frame| (frame.header.transaction, frame.header.unit));
        assert_eq!(frame, Ok((incoming.transaction, incoming.unit)));
        requests += 1;
    }
    assert_eq!(requests + server.losses().malformed, frames.len() as u64);
}

/// The same frames, told apart the same way, in whatever pieces the bytes came.
pub fn listener(bytes: &[u8]) {
    let Some((&first, stream)) = bytes.split_first() else {
        return;
    };
    let framing = if first & 0x80 == 0 { Framing::Rtu } else { Framing::Tcp };
    let whole = overhear(framing, stream, stream.len().max(1));
    assert_eq!(whole, overhear(framing, stream, usize::from(first & 0x7F) + 1));
    if framing == Framing::Rtu {
        assert_rtu(stream, &whole.0, whole.1.garbage_bytes);
    }
}

/// A client that is told anything in any order takes nothing for an answer that is none, and never waits longer than
/// it was told to.
pub fn client(bytes: &[u8]) {
    let mut script = bytes.iter().copied();
    let framing = if script.next().is_some_and(|byte| byte & 1 == 1) { Framing::Rtu } else { Framing::Tcp };
    let mut client = Client::new(framing).with_transaction(0xFFFE);
    let mut now = Duration::ZERO;
    let mut asked: Option<Asked> = None;
    let mut out = Vec::new();
    while let Some(op) = script.next() {
        now += Duration::from_millis(u64::from(op >> 3));
        let progress = match op & 7 {
            0 | 1 => {
                let next = Asked::parse(&mut script);
                let timeout = Duration::from_millis(100);
                match client.start(now, next.unit, &next.request(), timeout, &mut out) {
                    Ok(()) => {
                        assert!(asked.is_none());
                        assert_eq!(client.deadline(), Some(now + timeout));
                        asked = Some(next);
                    }
                    Err(_) => assert!(out.is_empty()),
                }
                continue;
            }
            2 | 3 => {
                let len = script.next().unwrap_or_default();
                let piece: Vec<u8> = script.by_ref().take(len.into()).collect();
                client.receive(now, &piece)
            }
            // The right answer with one byte changed, or none.
            4 => {
                let (at, flip) = (script.next().unwrap_or_default(), script.next().unwrap_or_default());
                let mut answer = asked.as_ref().map(|asked| asked.answer(framing, &out)).unwrap_or_default();
                if let Some(byte) = answer.get_mut(usize::from(at)) {
                    *byte ^= flip;
                }
                client.receive(now, &answer)
            }
            5 => client.silence(now),
            6 => client.expire(now),
            _ => {
                client.reset();
                asked = None;
                assert_eq!((client.fault(), client.quiet_until()), (None, None));
                Progress::Pending
            }
        };
        match progress {
            Progress::Pending => {}
            Progress::Answered => {
                let asked = asked.take().expect("an answer needs a question");
                let response = client.response().expect("an answer can be read");
                assert_eq!(response.answers(&asked.request()), Ok(()));
            }
            Progress::TimedOut => assert!(asked.take().is_some(), "nothing was waited for"),
            Progress::Broken(fault) => {
                assert_eq!((client.fault(), framing), (Some(fault), Framing::Tcp));
                asked = None;
            }
        }
        assert_eq!(client.deadline().is_some(), asked.is_some());
        assert!(client.deadline().is_none_or(|deadline| now < deadline || op & 7 == 7));
    }
}

/// All that a server's decoder makes of a stream that ends in silence.
fn serve(framing: Framing, stream: &[u8], size: usize) -> (Vec<Cut<()>>, Losses, bool) {
    let mut decoder = ServerDecoder::new(framing);
    let mut frames = Vec::new();
    let mut drain = |decoder: &mut ServerDecoder| {
        while let Some(frame) = decoder.next_frame() {
            let Ok(frame) = frame else { continue };
            frames.push(((), frame.transaction, frame.unit, frame.pdu.to_vec()));
        }
    };
    for piece in stream.chunks(size) {
        decoder.push(piece);
        drain(&mut decoder);
    }
    decoder.silence();
    drain(&mut decoder);
    (frames, *decoder.losses(), decoder.is_waiting())
}

/// All that a listener makes of a stream that ends in silence.
fn overhear(framing: Framing, stream: &[u8], size: usize) -> (Vec<Cut<busbar_modbus::Kind>>, Losses) {
    let mut decoder = ListenerDecoder::new(framing);
    let mut frames = Vec::new();
    let mut drain = |decoder: &mut ListenerDecoder| {
        while let Some(heard) = decoder.next_frame() {
            let Ok(heard) = heard else { continue };
            frames.push((heard.kind, heard.transaction, heard.unit, heard.pdu.to_vec()));
        }
    };
    for piece in stream.chunks(size) {
        decoder.push(piece);
        drain(&mut decoder);
    }
    decoder.silence();
    drain(&mut decoder);
    (frames, *decoder.losses())
}

/// Every frame stands in the stream behind the one before, with its check sum; the rest is the garbage counted.
fn assert_rtu<T>(stream: &[u8], frames: &[Cut<T>], garbage: u64) {
    let mut rest = stream;
    let mut in_frames = 0;
    for (_, _, unit, pdu) in frames {
        let body = [&[*unit], &pdu[..]].concat();
        let sealed = [&body[..], &rtu::crc16(&body).to_le_bytes()].concat();
        let at = rest.windows(sealed.len()).position(|window| window == sealed);
        rest = &rest[at.expect("a frame stands in the stream") + sealed.len()..];
        in_frames += sealed.len() as u64;
    }
    assert_eq!(in_frames + garbage, stream.len() as u64);
}

/// A request that outlives the bytes it was made of.
struct Asked {
    unit: u8,
    function: u8,
    address: u16,
    /// Also the value to write.
    count: u16,
}

const WORDS: [u16; 4] = [1, 2, 3, 4];

impl Asked {
    fn parse(script: &mut impl Iterator<Item = u8>) -> Self {
        let mut next = || script.next().unwrap_or_default();
        Self { unit: next(), function: next(), address: u16::from(next()) << 4, count: u16::from(next()) }
    }

    fn request(&self) -> Request<'_> {
        let (address, count) = (self.address, self.count);
        match self.function {
            1 => Request::ReadCoils { address, count },
            2 => Request::ReadDiscreteInputs { address, count },
            3 => Request::ReadHoldingRegisters { address, count },
            4 => Request::ReadInputRegisters { address, count },
            5 => Request::WriteSingleCoil { address, value: count },
            6 => Request::WriteSingleRegister { address, value: count },
            15 => Request::WriteMultipleCoils { address, coils: Bits::from_bytes(&[0x55, 0xAA]) },
            16 => Request::WriteMultipleRegisters { address, registers: (&WORDS).into() },
            function => Request::Other { function, data: &[] },
        }
    }

    /// The right answer to the request that left as `sent`.
    fn answer(&self, framing: Framing, sent: &[u8]) -> Vec<u8> {
        let data = [0; 250];
        let (address, count) = (self.address, self.count);
        let bits = Bits::new(&data, count.into()).unwrap_or(Bits::from_bytes(&[]));
        let words = &[0; 125][..usize::from(count).min(125)];
        let response = match self.function {
            1 => Response::ReadCoils(bits),
            2 => Response::ReadDiscreteInputs(bits),
            3 => Response::ReadHoldingRegisters(words.into()),
            4 => Response::ReadInputRegisters(words.into()),
            5 => Response::WriteSingleCoil { address, value: count },
            6 => Response::WriteSingleRegister { address, value: count },
            15 => Response::WriteMultipleCoils { address, count: 16 },
            16 => Response::WriteMultipleRegisters { address, count: 4 },
            function => Response::Other { function, data: &[] },
        };
        let mut answer = Vec::new();
        let encoded = match (framing, sent) {
            (Framing::Tcp, [high, low, ..]) => {
                let transaction = u16::from_be_bytes([*high, *low]);
                mbap::encode_response(transaction, self.unit, &response, &mut answer)
            }
            _ => rtu::encode_response(self.unit, &response, &mut answer),
        };
        assert_eq!(encoded, Ok(()));
        answer
    }
}
