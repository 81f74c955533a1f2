//! Properties: what is encoded decodes to the same, and no bytes in any pieces upset a decoder.

use std::time::Duration;

use busbar_modbus::pdu::function::{READ_COILS, READ_INPUT_REGISTERS};
use busbar_modbus::{Bits, Client, ExceptionCode, Framing, Progress, Request, Response, Server, mbap, rtu};
use proptest::collection::vec;
use proptest::prelude::*;

#[path = "../../../fuzz/src/frames.rs"]
mod fuzz;

/// A PDU with what it borrows.
#[derive(Clone, Debug)]
enum Owned {
    Read { function: u8, address: u16, count: u16 },
    WriteOne { coil: bool, address: u16, value: u16 },
    WriteCoils { address: u16, states: Vec<bool> },
    WriteRegisters { address: u16, words: Vec<u16> },
    Other { function: u8, data: Vec<u8> },
}

impl Owned {
    /// The request; coils are packed into `buffer`.
    fn request<'a>(&'a self, buffer: &'a mut Vec<u8>) -> Request<'a> {
        match *self {
            Self::Read { function: 1, address, count } => Request::ReadCoils { address, count },
            Self::Read { function: 2, address, count } => Request::ReadDiscreteInputs { address, count },
            Self::Read { function: 3, address, count } => Request::ReadHoldingRegisters { address, count },
            Self::Read { address, count, .. } => Request::ReadInputRegisters { address, count },
            Self::WriteOne { coil: true, address, value } => Request::WriteSingleCoil { address, value },
            Self::WriteOne { address, value, .. } => Request::WriteSingleRegister { address, value },
            Self::WriteCoils { address, ref states } => {
                Request::WriteMultipleCoils { address, coils: Bits::pack(states.iter().copied(), buffer) }
            }
            Self::WriteRegisters { address, ref words } => {
                Request::WriteMultipleRegisters { address, registers: words.into() }
            }
            Self::Other { function, ref data } => Request::Other { function, data },
        }
    }

    /// A right answer with data of `seed`.
    fn response<'a>(&'a self, seed: &'a Data) -> Response<'a> {
        match *self {
            Self::Read { function: 1, count, .. } => Response::ReadCoils(seed.bits(count)),
            Self::Read { function: 2, count, .. } => Response::ReadDiscreteInputs(seed.bits(count)),
            Self::Read { function: 3, count, .. } => Response::ReadHoldingRegisters(seed.words(count).into()),
            Self::Read { count, .. } => Response::ReadInputRegisters(seed.words(count).into()),
            Self::WriteOne { coil: true, address, value } => Response::WriteSingleCoil { address, value },
            Self::WriteOne { address, value, .. } => Response::WriteSingleRegister { address, value },
            Self::WriteCoils { address, ref states } => {
                Response::WriteMultipleCoils { address, count: states.len() as u16 }
            }
            Self::WriteRegisters { address, ref words } => {
                Response::WriteMultipleRegisters { address, count: words.len() as u16 }
            }
            Self::Other { function, ref data } => Response::Other { function, data },
        }
    }
}

/// What a device holds.
#[derive(Clone, Debug)]
struct Data {
    bytes: Vec<u8>,
    words: Vec<u16>,
}

impl Data {
    /// Whole bytes, as a response has them.
    fn bits(&self, count: u16) -> Bits<'_> {
        Bits::from_bytes(&self.bytes[..usize::from(count).div_ceil(8)])
    }

    fn words(&self, count: u16) -> &[u16] {
        &self.words[..usize::from(count)]
    }
}

fn data() -> impl Strategy<Value = Data> {
    (vec(any::<u8>(), 250), vec(any::<u16>(), 125)).prop_map(|(bytes, words)| Data { bytes, words })
}

fn owned() -> impl Strategy<Value = Owned> {
    prop_oneof![
        (READ_COILS..=READ_INPUT_REGISTERS, any::<u16>(), 1..=2000_u16).prop_map(
            |(function, address, count)| {
                let count = if function < 3 { count } else { (count - 1) % 125 + 1 };
                Owned::Read { function, address, count }
            }
        ),
        any::<(bool, u16, u16)>().prop_map(|(coil, address, value)| Owned::WriteOne { coil, address, value }),
        (any::<u16>(), vec(any::<bool>(), 1..=1968))
            .prop_map(|(address, states)| Owned::WriteCoils { address, states }),
        (any::<u16>(), vec(any::<u16>(), 1..=123))
            .prop_map(|(address, words)| Owned::WriteRegisters { address, words }),
        (prop_oneof![7..=14_u8, 17..=127_u8], vec(any::<u8>(), 0..=252))
            .prop_map(|(function, data)| Owned::Other { function, data }),
    ]
}

/// Frames of both directions with noise between them, as a line or a connection carries them.
fn stream(framing: Framing) -> impl Strategy<Value = Vec<u8>> {
    let frame = (owned(), data(), any::<(bool, u16)>(), 1..=3_u8).prop_map(
        move |(owned, data, (asks, transaction), unit)| {
            let mut bytes = Vec::new();
            let mut buffer = Vec::new();
            let request = owned.request(&mut buffer);
            let response = owned.response(&data);
            let encoded = match (framing, asks) {
                (Framing::Rtu, true) => rtu::encode_request(unit, &request, &mut bytes),
                (Framing::Rtu, false) => rtu::encode_response(unit, &response, &mut bytes),
                (Framing::Tcp, true) => mbap::encode_request(transaction, unit, &request, &mut bytes),
                (Framing::Tcp, false) => mbap::encode_response(transaction, unit, &response, &mut bytes),
            };
            assert_eq!(encoded, Ok(()));
            bytes
        },
    );
    let noise = vec(any::<u8>(), 0..12);
    vec(prop_oneof![4 => frame, 1 => noise], 0..8).prop_map(|pieces| pieces.concat())
}

/// A byte for the pieces in front of a stream, as the fuzz targets take it.
fn with_size(size: u8, stream: &[u8]) -> Vec<u8> {
    [&[size], stream].concat()
}

proptest! {
    #[test]
    fn request_round_trips(owned in owned(), unit: u8, transaction: u16) {
        let mut buffer = Vec::new();
        let request = owned.request(&mut buffer);

        let mut pdu = Vec::new();
        request.encode(&mut pdu).unwrap();
        prop_assert_eq!(Request::decode(&pdu), Ok(request));

        let mut bytes = Vec::new();
        rtu::encode_request(unit, &request, &mut bytes).unwrap();
        prop_assert_eq!(rtu::decode(&bytes), Ok(rtu::Frame { unit, pdu: &pdu }));

        bytes.clear();
        mbap::encode_request(transaction, unit, &request, &mut bytes).unwrap();
        let frame = mbap::decode(&bytes).unwrap();
        prop_assert_eq!((frame.header.transaction, frame.header.unit), (transaction, unit));
        prop_assert_eq!(frame.pdu, &pdu);
    }

    #[test]
    fn response_round_trips(owned in owned(), data in data(), unit: u8, transaction: u16) {
        let mut buffer = Vec::new();
        let request = owned.request(&mut buffer);
        let response = owned.response(&data);
        prop_assert_eq!(response.answers(&request), Ok(()));

        let mut pdu = Vec::new();
        response.encode(&mut pdu).unwrap();
        prop_assert_eq!(Response::decode(&pdu), Ok(response));
        prop_assert!(request.response_len().is_none_or(|len| len == pdu.len()));

        let mut bytes = Vec::new();
        rtu::encode_response(unit, &response, &mut bytes).unwrap();
        prop_assert_eq!(rtu::decode(&bytes), Ok(rtu::Frame { unit, pdu: &pdu }));

        bytes.clear();
        mbap::encode_response(transaction, unit, &response, &mut bytes).unwrap();
        prop_assert_eq!(mbap::decode(&bytes).map(|frame| frame.pdu), Ok(&pdu[..]));
    }

    #[test]
    fn exception_round_trips(function in 1..=127_u8, code: u8) {
        let response = Response::Exception { function, code: ExceptionCode(code) };
        let mut pdu = Vec::new();
        response.encode(&mut pdu).unwrap();
        prop_assert_eq!(Response::decode(&pdu), Ok(response));
    }

    #[test]
    fn one_flipped_bit_never_passes_rtu(owned in owned(), unit: u8, at: prop::sample::Index) {
        let mut bytes = Vec::new();
        rtu::encode_request(unit, &owned.request(&mut Vec::new()), &mut bytes).unwrap();
        let bit = at.index(bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(rtu::decode(&bytes).is_err());
    }

    /// Client and server understand each other in any pieces.
    #[test]
    fn client_and_server_agree(
        owned in owned(),
        data in data(),
        rtu: bool,
        unit in 1..=247_u8,
        transaction: u16,
        sizes in (1..300_usize, 1..300_usize),
    ) {
        let framing = if rtu { Framing::Rtu } else { Framing::Tcp };
        let now = Duration::ZERO;
        let mut buffer = Vec::new();
        let request = owned.request(&mut buffer);
        let response = owned.response(&data);
        let mut client = Client::new(framing).with_transaction(transaction);
        let mut server = Server::new(framing);

        let mut sent = Vec::new();
        client.start(now, unit, &request, Duration::from_secs(1), &mut sent).unwrap();
        for piece in sent.chunks(sizes.0) {
            server.receive(now, piece);
        }
        server.silence();
        let mut answer = Vec::new();
        let incoming = server.next_request().unwrap();
        prop_assert_eq!((incoming.unit, incoming.request, incoming.malformed), (unit, request, None));
        incoming.respond(&response, &mut answer).unwrap();
        prop_assert!(server.next_request().is_none());

        let mut progress = Progress::Pending;
        for piece in answer.chunks(sizes.1) {
            prop_assert_eq!(progress, Progress::Pending);
            progress = client.receive(now, piece);
        }
        if progress == Progress::Pending {
            progress = client.silence(now);
        }
        prop_assert_eq!(progress, Progress::Answered);
        // Coils come back as many as were asked for, not as many as whole bytes hold.
        let held = |at: usize| data.bytes[at / 8] >> (at % 8) & 1 == 1;
        match (client.response().unwrap(), request) {
            (Response::ReadCoils(read), Request::ReadCoils { count, .. })
            | (Response::ReadDiscreteInputs(read), Request::ReadDiscreteInputs { count, .. }) => {
                prop_assert_eq!(read.len(), usize::from(count));
                prop_assert!(read.iter().enumerate().all(|(at, state)| state == held(at)));
            }
            (read, _) => prop_assert_eq!(read, response),
        }
    }

    #[test]
    fn decoders_never_panic(bytes in vec(any::<u8>(), 0..600)) {
        fuzz::pdu(&bytes);
        fuzz::rtu_stream(&bytes);
        fuzz::tcp_stream(&bytes);
        fuzz::listener(&bytes);
        fuzz::client(&bytes);
    }

    #[test]
    fn any_pieces_give_the_same_rtu_frames(stream in stream(Framing::Rtu), size in 0..40_u8) {
        fuzz::rtu_stream(&with_size(size, &stream));
        fuzz::listener(&with_size(size, &stream));
    }

    #[test]
    fn any_pieces_give_the_same_tcp_frames(stream in stream(Framing::Tcp), size in 0..40_u8) {
        fuzz::tcp_stream(&with_size(size, &stream));
        fuzz::listener(&with_size(0x80 | size, &stream));
    }
}
