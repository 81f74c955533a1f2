//! The worked frames of the four controllers' manuals, both ways: bytes to what they say, and what they say to bytes.
//!
//! Of the exceptions the manuals give the function and the code, not a whole frame; these are held as PDUs.

mod support;

use busbar_modbus::{ExceptionCode, Registers, Request, Response, rtu};
use support::hex;

/// Where a frame is printed.
struct Place {
    manual: &'static str,
    table: &'static str,
    frame: &'static str,
}

const DATAKOM_D: &str = "Datakom D-300 / 500 / 700 Modbus Application Manual V5.6";
const DATAKOM_DKG: &str = "Datakom DKG Modbus manual (P_650)";
const HAT821SI: &str = "SmartGen HAT821SI communication protocol";
const ACC1700: &str = "SmartGen ACC1700 communication protocol";

fn at(manual: &'static str, table: &'static str, frame: &'static str) -> Place {
    Place { manual, table, frame }
}

fn requests() -> [(Place, u8, Request<'static>); 10] {
    let read = |address, count| Request::ReadHoldingRegisters { address, count };
    let write = Request::WriteSingleRegister { address: 0x40, value: 0x10 };
    let coil = |address| Request::WriteSingleCoil { address, value: 0xFF00 };
    [
        (at(DATAKOM_D, "data reading, query", "01 03 00 20 00 10 45 CC"), 1, read(32, 16)),
        (at(DATAKOM_D, "writing a single register, query", "01 06 00 40 00 10 89 D2"), 1, write),
        (at(DATAKOM_DKG, "data reading, query", "01 03 00 20 00 10 45 CC"), 1, read(32, 16)),
        (at(DATAKOM_DKG, "data writing, query", "01 06 00 40 00 10 89 D2"), 1, write),
        (at(HAT821SI, "table 3", "01 03 01 FA 00 02 E5 C6"), 1, read(506, 2)),
        (at(HAT821SI, "table 7", "01 03 04 6D 00 02 54 E6"), 1, read(1133, 2)),
        (at(HAT821SI, "table 11", "01 05 3A 9C FF 00 40 CC"), 1, coil(15004)),
        (at(ACC1700, "table 3", "01 03 00 01 00 02 95 CB"), 1, read(1, 2)),
        (at(ACC1700, "table 7", "01 03 00 56 00 02 24 1B"), 1, read(86, 2)),
        (at(ACC1700, "table 11", "01 05 00 03 FF 00 7C 3A"), 1, coil(3)),
    ]
}

fn responses() -> [(Place, u8, Response<'static>); 8] {
    let registers = |words: &'static [u16]| Response::ReadHoldingRegisters(words.into());
    let written = Response::WriteSingleRegister { address: 0x40, value: 0x10 };
    let coil = |address| Response::WriteSingleCoil { address, value: 0xFF00 };
    [
        (at(DATAKOM_D, "writing a single register, response", "01 06 00 40 00 10 89 D2"), 1, written),
        (at(DATAKOM_DKG, "data writing, response", "01 06 00 40 00 10 89 D2"), 1, written),
        (at(HAT821SI, "table 4", "01 03 04 00 01 00 10 AA 3F"), 1, registers(&[0x0001, 0x0010])),
        (at(HAT821SI, "table 8", "01 03 04 E2 40 00 01 0C 5F"), 1, registers(&[0xE240, 0x0001])),
        (at(HAT821SI, "table 12", "01 05 3A 9C FF 00 40 CC"), 1, coil(15004)),
        (at(ACC1700, "table 4", "01 03 04 00 02 00 02 DA 32"), 1, registers(&[0x0002, 0x0002])),
        (at(ACC1700, "table 8", "01 03 04 E2 40 00 01 0C 5F"), 1, registers(&[0xE240, 0x0001])),
        (at(ACC1700, "table 12", "01 05 00 03 FF 00 7C 3A"), 1, coil(3)),
    ]
}

/// Function and code as the manuals give them, in decimal.
fn exceptions() -> [(Place, u8, u8); 6] {
    [
        (at(DATAKOM_D, "data reading, exceptional response", "83 02"), 131, 2),
        (at(DATAKOM_D, "writing a single register, exceptional response", "86 0A"), 134, 10),
        (at(DATAKOM_D, "writing multiple registers, exceptional response", "90 02"), 144, 2),
        (at(DATAKOM_D, "writing multiple registers, exceptional response", "90 0A"), 144, 10),
        (at(DATAKOM_DKG, "data reading, exceptional response", "83 02"), 131, 2),
        (at(DATAKOM_DKG, "data writing, exceptional response", "86 0A"), 134, 10),
    ]
}

#[test]
fn requests_both_ways() {
    for (Place { manual, table, frame }, unit, request) in requests() {
        let bytes = hex(frame);
        let decoded = rtu::decode(&bytes).unwrap();
        assert_eq!(decoded.unit, unit, "{manual}, {table}");
        assert_eq!(Request::decode(decoded.pdu), Ok(request), "{manual}, {table}");

        let mut out = Vec::new();
        assert_eq!(rtu::encode_request(unit, &request, &mut out), Ok(()));
        assert_eq!(out, bytes, "{manual}, {table}");
    }
}

#[test]
fn responses_both_ways() {
    for (Place { manual, table, frame }, unit, response) in responses() {
        let bytes = hex(frame);
        let decoded = rtu::decode(&bytes).unwrap();
        assert_eq!(decoded.unit, unit, "{manual}, {table}");
        assert_eq!(Response::decode(decoded.pdu), Ok(response), "{manual}, {table}");

        let mut out = Vec::new();
        assert_eq!(rtu::encode_response(unit, &response, &mut out), Ok(()));
        assert_eq!(out, bytes, "{manual}, {table}");
    }
}

#[test]
fn exceptions_both_ways() {
    for (Place { manual, table, frame }, function, code) in exceptions() {
        let bytes = hex(frame);
        assert_eq!(bytes, [function, code], "{manual}, {table}");
        let response = Response::Exception { function: function - 128, code: ExceptionCode(code) };
        assert_eq!(Response::decode(&bytes), Ok(response), "{manual}, {table}");

        let mut out = Vec::new();
        assert_eq!(response.encode(&mut out), Ok(()));
        assert_eq!(out, bytes, "{manual}, {table}");
    }
}

#[test]
fn the_printed_responses_answer_the_printed_requests() {
    for (asked, _, request) in requests() {
        let same = |place: &Place| place.manual == asked.manual;
        let answers =
            responses().iter().filter(|(at, ..)| same(at)).any(|(.., r)| r.answers(&request).is_ok());
        // Of the Datakom reads only the query is printed.
        let unanswered = matches!(request, Request::ReadHoldingRegisters { address: 32, .. });
        assert_eq!(answers, !unanswered, "{}, {}", asked.manual, asked.table);
    }
}

#[test]
fn registers_come_high_byte_first_and_words_low_word_first() {
    // Close times of source 1 (HAT821SI table 9) and total fuel consumption (ACC1700 table 9): 123456 each.
    let bytes = hex("01 03 04 E2 40 00 01 0C 5F");
    let decoded = rtu::decode(&bytes).unwrap();
    let words = [0xE240, 0x0001];
    let words = Registers::from(&words);
    assert_eq!(Response::decode(decoded.pdu), Ok(Response::ReadHoldingRegisters(words)));
    let value: u32 = words.iter().zip([1, 65_536]).map(|(word, weight)| u32::from(word) * weight).sum();
    assert_eq!(value, 123_456);
}
