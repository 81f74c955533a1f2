//! The server's transactions as message sequences: what comes when, what is asked by it, what goes back.

mod support;

use std::time::Duration;

use busbar_modbus::{DecodeError, ExceptionCode, Fault, Framing, Request, Response, Server};
use support::{hex, ms};

/// Answers every request with the registers 1 and 2, or with an exception where it is no read of two.
fn answers(server: &mut Server, now: Duration, bytes: &str) -> String {
    server.receive(now, &hex(bytes));
    drain(server)
}

fn drain(server: &mut Server) -> String {
    let mut out = Vec::new();
    while let Some(incoming) = server.next_request() {
        let code = match (incoming.malformed, incoming.request) {
            (Some(_), _) => ExceptionCode::ILLEGAL_DATA_VALUE,
            (_, Request::Other { .. }) => ExceptionCode::ILLEGAL_FUNCTION,
            _ => ExceptionCode::ILLEGAL_DATA_ADDRESS,
        };
        let response = match incoming.request {
            Request::ReadHoldingRegisters { count: 2, .. } => {
                Response::ReadHoldingRegisters((&[1, 2]).into())
            }
            request => Response::Exception { function: request.function(), code },
        };
        assert_eq!(incoming.respond(&response, &mut out), Ok(()));
    }
    out.iter().map(|byte| format!("{byte:02X}")).collect()
}

fn squeezed(text: &str) -> String {
    text.replace(' ', "")
}

#[test]
fn tcp_answers_carry_transaction_and_unit() {
    let mut server = Server::new(Framing::Tcp);
    let answer = answers(&mut server, ms(0), "ABCD 0000 0006 07 03 0020 0002");
    assert_eq!(answer, squeezed("ABCD 0000 0007 07 03 04 0001 0002"));
    assert_eq!((server.deadline(), server.fault()), (None, None));
}

#[test]
fn tcp_glued_requests_are_answered_in_one_write() {
    let mut server = Server::new(Framing::Tcp);
    let two = "0001 0000 0006 07 03 0020 0002 0002 0000 0006 08 04 0020 0002";
    let both = squeezed("0001 0000 0007 07 03 04 0001 0002 0002 0000 0003 08 84 02");
    assert_eq!(answers(&mut server, ms(0), two), both);
    // In any pieces, with any time between: TCP has no silence.
    for at in 0..=24 {
        let bytes = squeezed(two);
        let (one, other) = bytes.split_at(2 * at);
        let answer = answers(&mut server, ms(1), one) + &answers(&mut server, ms(60_000), other);
        assert_eq!(answer, both, "split at {at}");
    }
}

#[test]
fn tcp_malformed_requests_get_an_exception() {
    let cases = [
        ("too short", "03 0020 00", DecodeError::Length { function: 3, expected: 5, found: 4 }),
        (
            "byte count",
            "10 0000 0001 04 0001 0002",
            DecodeError::ByteCount { function: 0x10, expected: 2, found: 4 },
        ),
    ];
    for (label, pdu, error) in cases {
        let pdu = hex(pdu);
        let mut server = Server::new(Framing::Tcp);
        server.receive(ms(0), &[0, 9, 0, 0, 0, pdu.len() as u8 + 1, 1]);
        server.receive(ms(0), &pdu);
        let incoming = server.next_request().unwrap();
        assert_eq!(incoming.malformed, Some(error), "{label}");
        assert_eq!(incoming.request, Request::Other { function: pdu[0], data: &pdu[1..] }, "{label}");
        assert_eq!((incoming.transaction, incoming.unit), (9, 1));
    }
    let mut server = Server::new(Framing::Tcp);
    let answer = answers(&mut server, ms(0), "0001 0000 0005 07 03 0020 00");
    assert_eq!(answer, squeezed("0001 0000 0003 07 83 03"));
}

#[test]
fn tcp_what_no_client_asks_is_dropped() {
    let mut server = Server::new(Framing::Tcp);
    let bytes = "0001 0000 0003 07 83 02  0001 0000 0002 07 00  0001 0007 0002 07 03  0002 0000 0002 07 11";
    assert_eq!(answers(&mut server, ms(0), bytes), squeezed("0002 0000 0003 07 91 01"));
    assert_eq!((server.losses().malformed, server.losses().wrong_protocol), (2, 1));
}

#[test]
fn tcp_an_impossible_length_is_a_fault() {
    let mut server = Server::new(Framing::Tcp);
    let bytes = "0001 0000 0006 07 03 0020 0002  0002 0000 FFFF 07 03 0020 0002";
    assert_eq!(answers(&mut server, ms(0), bytes), squeezed("0001 0000 0007 07 03 04 0001 0002"));
    assert_eq!(server.fault(), Some(Fault::Length { found: 0xFFFF }));
    assert_eq!(answers(&mut server, ms(1), "0001 0000 0006 07 03 0020 0002"), "");
    assert_eq!(server.losses().garbage_bytes, 24);
    server.reset();
    assert_eq!(server.fault(), None);
    assert_ne!(answers(&mut server, ms(2), "0001 0000 0006 07 03 0020 0002"), "");
}

#[test]
fn rtu_answers_carry_the_unit() {
    let mut server = Server::new(Framing::Rtu);
    assert_eq!(answers(&mut server, ms(0), "01 03 0020 0002 C5C1"), squeezed("01 03 04 0001 0002 2A32"));
    assert_eq!(answers(&mut server, ms(9), "01 06 0040 0010 89D2"), squeezed("01 86 02 C3A1"));
    assert_eq!(server.deadline(), None);
}

#[test]
fn rtu_half_a_request_dies_by_silence() {
    let mut server = Server::new(Framing::Rtu).with_quiet(ms(10));
    assert_eq!(answers(&mut server, ms(0), "01 10 0000 0064"), "");
    assert_eq!(server.deadline(), Some(ms(10)));
    assert_eq!(answers(&mut server, ms(9), "C8"), "");
    assert_eq!(server.deadline(), Some(ms(19)));
    // Without the silence the next request would be taken for data of the first.
    assert_eq!(answers(&mut server, ms(19), "01 03 0020 0002 C5C1"), squeezed("01 03 04 0001 0002 2A32"));
    assert_eq!((server.losses().garbage_bytes, server.deadline()), (7, None));
}

#[test]
fn rtu_pieces_within_the_quiet_period_are_one_request() {
    let bytes = "0103002000 02C5C1".replace(' ', "");
    for at in 1..8 {
        let mut server = Server::new(Framing::Rtu);
        let (one, other) = bytes.split_at(2 * at);
        assert_eq!(answers(&mut server, ms(0), one), "");
        assert_eq!(answers(&mut server, ms(49), other), squeezed("01 03 04 0001 0002 2A32"), "split at {at}");
        assert_eq!(answers(&mut server, ms(100), one), "");
        assert_eq!(answers(&mut server, ms(150), other), "", "split at {at}");
    }
}

#[test]
fn rtu_other_functions_end_by_silence() {
    let mut server = Server::new(Framing::Rtu);
    assert_eq!(answers(&mut server, ms(0), "01 11 C02C"), "");
    assert_eq!(server.deadline(), Some(ms(50)));
    server.silence();
    assert_eq!(drain(&mut server), squeezed("01 91 01 8C50"));
    assert_eq!(server.deadline(), None);
}

#[test]
fn rtu_hears_its_neighbours_and_stays_in_step() {
    let mut server = Server::new(Framing::Rtu);
    // Another unit's answer and the next request in one piece, as a USB adapter delivers them.
    let bytes = "02 03 04 E240 0001 3F5F 01 03 0020 0002 C5C1";
    assert_eq!(answers(&mut server, ms(0), bytes), squeezed("01 03 04 0001 0002 2A32"));
    assert_eq!(server.losses().garbage_bytes, 9);
}
