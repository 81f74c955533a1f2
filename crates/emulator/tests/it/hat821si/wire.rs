//! The manual's worked frames, and what it lets through.

use std::time::Duration;

use busbar_emulator::{Config, Device, StartError};
use busbar_modbus::{Bits, Framing, Registers, Request, Server};
use proptest::prelude::*;

use super::{ON, bit, config, quiet};
use crate::site::{Answer, Site, ask};

/// What a request frame is answered with on a serial line.
fn exchange(site: &mut Site, frame: &[u8]) -> Vec<u8> {
    let (mut server, mut out) = (Server::new(Framing::Rtu), Vec::new());
    server.receive(Duration::ZERO, frame);
    server.silence();
    while let Some(incoming) = server.next_request() {
        if let Some(response) = site.device.answer(incoming.unit, &incoming.request) {
            incoming.respond(&response, &mut out).unwrap();
        }
    }
    out
}

#[test]
fn the_worked_frames() {
    let pins = [("aux_outputs", "aux_output_1"), ("switches", "s1_closed"), ("s1_closings", "123456")];
    let pins = pins.map(|(point, value)| (point.to_owned(), value.to_owned())).to_vec();
    let mut site = Site::new(&Config { pins, ..config() });
    super::send(&mut site, 15004, super::OFF);
    for (request, answer) in [
        (
            [0x01, 0x03, 0x01, 0xFA, 0x00, 0x02, 0xE5, 0xC6],
            vec![0x01, 0x03, 0x04, 0x00, 0x01, 0x00, 0x10, 0xAA, 0x3F],
        ),
        (
            [0x01, 0x03, 0x04, 0x6D, 0x00, 0x02, 0x54, 0xE6],
            vec![0x01, 0x03, 0x04, 0xE2, 0x40, 0x00, 0x01, 0x0C, 0x5F],
        ),
        (
            [0x01, 0x05, 0x3A, 0x9C, 0xFF, 0x00, 0x40, 0xCC],
            vec![0x01, 0x05, 0x3A, 0x9C, 0xFF, 0x00, 0x40, 0xCC],
        ),
    ] {
        assert_eq!(exchange(&mut site, &request), answer, "{request:02X?}");
    }
    assert!(bit(&site, "common_status", 8), "500.8 confirms the automatic mode");
}

#[test]
fn reads_go_up_to_120_registers_of_the_map() {
    let mut site = quiet();
    for (name, address, count, expected) in [
        ("one register", 500, 1, Answer::Registers(1)),
        ("all words", 500, 44, Answer::Registers(44)),
        ("the most there is", 1000, 120, Answer::Registers(120)),
        ("one too many", 1000, 121, Answer::Exception(3)),
        ("the most the protocol allows", 1000, 125, Answer::Exception(3)),
        ("more than that", 1000, 126, Answer::Exception(3)),
        ("far more", 1000, 65535, Answer::Exception(3)),
        ("nothing", 1000, 0, Answer::Exception(3)),
        ("too many where there is nothing", 0, 121, Answer::Exception(3)),
        ("half a value", 1049, 1, Answer::Registers(1)),
        ("reserved rows", 1139, 16, Answer::Registers(16)),
        ("before the words", 499, 2, Answer::Exception(2)),
        ("past the words", 543, 2, Answer::Exception(2)),
        ("between the ranges", 700, 1, Answer::Exception(2)),
        ("the last register", 1203, 1, Answer::Registers(1)),
        ("past the map", 1203, 2, Answer::Exception(2)),
        ("a coil", 15004, 1, Answer::Exception(2)),
        ("the last address there is", 65535, 2, Answer::Exception(2)),
    ] {
        let request = Request::ReadHoldingRegisters { address, count };
        assert_eq!(ask(&mut site, 1, request), expected, "{name}");
    }
}

#[test]
fn reserved_rows_read_as_zero() {
    let site = quiet();
    for (first, last) in [(1010, 1019), (1035, 1039), (1076, 1078), (1081, 1082), (1085, 1085), (1139, 1154)]
    {
        let registers = site.device.registers(first, last - first + 1).unwrap();
        assert!(registers.iter().all(|register| *register == 0), "{first}");
    }
}

#[test]
fn coils_take_two_values_and_only_the_printed_ones_exist() {
    let mut site = quiet();
    let write = |address, value| Request::WriteSingleCoil { address, value };
    for coil in site.device.profile().coils.iter().map(|coil| coil.address) {
        for (value, expected) in [
            (0x0000, Answer::Echo),
            (ON, Answer::Echo),
            (0x0001, Answer::Exception(3)),
            (0x00FF, Answer::Exception(3)),
            (0xFF01, Answer::Exception(3)),
            (0xFFFF, Answer::Exception(3)),
        ] {
            assert_eq!(ask(&mut site, 1, write(coil, value)), expected, "coil {coil}, {value:04X}");
        }
    }
    let reserved = (15000..=15003).chain(15010..=15011).chain(15025..=15029).chain(15038..=15039);
    for coil in reserved.chain([0, 500, 1094, 14999, 15088, 65535]) {
        assert_eq!(ask(&mut site, 1, write(coil, ON)), Answer::Exception(2), "coil {coil}");
    }
}

#[test]
fn functions_other_than_3_and_5_are_illegal() {
    let mut site = quiet();
    for request in [
        Request::ReadCoils { address: 15004, count: 1 },
        Request::ReadDiscreteInputs { address: 500, count: 1 },
        Request::ReadInputRegisters { address: 1000, count: 1 },
        Request::WriteSingleRegister { address: 15004, value: 1 },
        Request::WriteMultipleCoils { address: 15004, coils: Bits::from_bytes(&[1]) },
        Request::WriteMultipleRegisters { address: 1000, registers: Registers::from(&[1][..]) },
        Request::Other { function: 0x2B, data: &[0x0E, 1, 0] },
    ] {
        assert_eq!(ask(&mut site, 1, request), Answer::Exception(1), "{request:?}");
    }
}

#[test]
fn other_units_and_broadcast_get_no_answer_and_no_effect() {
    let mut site = Site::new(&Config { unit: 254, ..config() });
    for unit in [0, 1, 253, 255] {
        let read = Request::ReadHoldingRegisters { address: 500, count: 1 };
        assert_eq!(ask(&mut site, unit, read), Answer::Silence);
        let manual = Request::WriteSingleCoil { address: 15004, value: 0 };
        assert_eq!(ask(&mut site, unit, manual), Answer::Silence);
    }
    assert!(bit(&site, "common_status", 8));
    assert_eq!(
        ask(&mut site, 254, Request::ReadHoldingRegisters { address: 500, count: 1 }),
        Answer::Registers(1)
    );
}

#[test]
fn impossible_configurations_are_refused_by_name() {
    for unit in [0, 255] {
        let error = Device::new(&Config { unit, ..config() }).unwrap_err();
        assert_eq!(error, StartError::Unit { unit, min: 1, max: 254 });
    }
    let error = Device::new(&Config { model: Some("HAT560".into()), ..config() }).unwrap_err();
    assert_eq!(error.to_string(), "`HAT560` is not a model of this controller; its models are HAT821SI");
    Device::new(&Config { model: Some("hat821si".into()), ..config() }).unwrap();
}

#[test]
fn pinned_alarms_have_their_common_bits() {
    for (point, value, common) in [
        ("alarms_1", "s1_close_failure", 5),
        ("alarms_2", "overload", 3),
        ("alarms_2", "genset_fault", 5),
        ("alarms_3", "input_module_1_comm_failure", 3),
        ("alarms_3", "l2_transfer_failure_fault", 5),
        ("alarms_4", "load_ats_trip_warning", 3),
        ("load_1_opening_failures", "0", 5),
    ] {
        let site = Site::new(&Config { pins: vec![(point.into(), value.into())], ..config() });
        assert_eq!(site.bits("common_status").register(0) & 7, common, "{point}: {value}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_request_gets_a_lawful_answer_or_none(
        requests in prop::collection::vec(
            (1..=6_u8, prop_oneof![any::<u16>(), 490..550_u16, 990..1210_u16, 14_995..15_095_u16], any::<u16>()),
            1..60,
        ),
    ) {
        let mut site = quiet();
        for (function, address, word) in requests {
            site.pass(Duration::from_millis(200));
            let mut pdu = vec![function];
            pdu.extend(address.to_be_bytes());
            pdu.extend(word.to_be_bytes());
            let Ok(request) = Request::decode(&pdu) else { continue };
            match ask(&mut site, 1, request) {
                Answer::Registers(count) => prop_assert!(function == 3 && (1..=120).contains(&count)),
                Answer::Exception(code) => prop_assert!((1..=3).contains(&code)),
                Answer::Echo => prop_assert_eq!(function, 5),
                Answer::Silence => prop_assert!(false, "silence"),
            }
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }
}
