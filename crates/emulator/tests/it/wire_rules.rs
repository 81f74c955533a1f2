//! The wire rules of the D-series manual, request by request.

use busbar_emulator::Config;
use busbar_modbus::{Registers, Request};

use crate::site::{Answer, CHANNEL_SELECT, HARD_RESET, PUSH_BUTTONS, Site, ask};

fn read(address: u16, count: u16) -> Request<'static> {
    Request::ReadHoldingRegisters { address, count }
}

fn write(address: u16, value: u16) -> Request<'static> {
    Request::WriteSingleRegister { address, value }
}

fn write_several(address: u16, registers: &[u16]) -> Request<'_> {
    Request::WriteMultipleRegisters { address, registers: Registers::from(registers) }
}

#[test]
fn reads_are_cut_to_sixteen_and_judged_afterwards() {
    let mut site = Site::quiet();
    for (name, address, count, expected) in [
        ("one register", 10240, 1, Answer::Registers(1)),
        ("all that one read gives", 10240, 16, Answer::Registers(16)),
        ("one too many", 10240, 17, Answer::Registers(16)),
        ("the most the protocol allows", 10240, 125, Answer::Registers(16)),
        ("nothing", 10240, 0, Answer::Exception(2)),
        ("more than the protocol allows", 10240, 126, Answer::Exception(2)),
        ("far more", 10240, 65535, Answer::Exception(2)),
        ("the end of a range", 10536, 16, Answer::Registers(16)),
        ("past the end only before the cut", 10536, 100, Answer::Registers(16)),
        ("one past the end", 10537, 16, Answer::Exception(2)),
        ("half a value", 10241, 1, Answer::Registers(1)),
        ("a reserved row", 10336, 2, Answer::Registers(2)),
        ("reserved rows inside a block", 10342, 16, Answer::Registers(16)),
        ("between the ranges", 10552, 1, Answer::Exception(2)),
        ("across a hole", 10599, 6, Answer::Exception(2)),
        ("before the map", 10239, 2, Answer::Exception(2)),
        ("the last register", 11700, 1, Answer::Registers(1)),
        ("past the map", 11700, 2, Answer::Exception(2)),
        ("the last address there is", 65535, 16, Answer::Exception(2)),
        ("the first address there is", 0, 1, Answer::Exception(2)),
        ("the manual's example, a register of another controller", 0x20, 16, Answer::Exception(2)),
        ("a register that can only be written", PUSH_BUTTONS, 1, Answer::Exception(2)),
        ("another", HARD_RESET, 1, Answer::Exception(2)),
    ] {
        assert_eq!(ask(&mut site, 1, read(address, count)), expected, "{name}");
    }
}

#[test]
fn reserved_rows_read_as_zero() {
    let site = Site::quiet();
    for (first, last) in [(10336, 10337), (10342, 10342), (10353, 10360)] {
        assert!(
            site.device.registers(first, last - first + 1).unwrap().iter().all(|register| *register == 0)
        );
    }
}

#[test]
fn writes_go_to_three_registers_only() {
    let mut site = Site::quiet();
    for (name, request, expected) in [
        ("no key at all", write(PUSH_BUTTONS, 0), Answer::Echo),
        ("a key", write(PUSH_BUTTONS, 4), Answer::Echo),
        ("a channel", write(CHANNEL_SELECT, 19), Answer::Echo),
        ("a channel that does not exist", write(CHANNEL_SELECT, 20), Answer::Echo),
        ("not the reset word", write(HARD_RESET, 14535), Answer::Echo),
        ("a measured value", write(10240, 0), Answer::Exception(10)),
        ("a reserved row", write(10336, 0), Answer::Exception(10)),
        ("a register nobody knows", write(8195, 0), Answer::Exception(2)),
        ("the manual's example, AUTO on another controller", write(0x40, 0x10), Answer::Exception(2)),
        ("the last address", write(65535, 0), Answer::Exception(2)),
        ("both neighbours", write_several(PUSH_BUTTONS, &[0, 3]), Answer::Echo),
        ("one alone", write_several(CHANNEL_SELECT, &[3]), Answer::Echo),
        ("nothing", write_several(PUSH_BUTTONS, &[]), Answer::Exception(2)),
        ("more than sixteen", write_several(10240, &[0; 17]), Answer::Exception(2)),
        ("sixteen protected ones", write_several(10240, &[0; 16]), Answer::Exception(10)),
        ("a known and an unknown one", write_several(CHANNEL_SELECT, &[0, 0]), Answer::Exception(2)),
        ("an unknown and a protected one", write_several(10239, &[0, 0]), Answer::Exception(10)),
        ("past the last address", write_several(65535, &[0, 0]), Answer::Exception(2)),
    ] {
        assert_eq!(ask(&mut site, 1, request), expected, "{name}");
    }
}

#[test]
fn a_refused_write_changes_nothing() {
    let mut site = Site::quiet();
    site.write(CHANNEL_SELECT, 7);
    assert_eq!(ask(&mut site, 1, write_several(CHANNEL_SELECT, &[3, 0])), Answer::Exception(2));
    assert_eq!(ask(&mut site, 1, write(CHANNEL_SELECT, 20)), Answer::Echo);
    assert_eq!(site.code("selected_channel"), 7);

    let before = site.image();
    assert_eq!(ask(&mut site, 1, write_several(10240, &[9; 16])), Answer::Exception(10));
    assert_eq!(ask(&mut site, 1, write(HARD_RESET, 1)), Answer::Echo);
    assert_eq!(site.image(), before);
}

#[test]
fn functions_other_than_3_6_and_16_are_illegal() {
    let mut site = Site::quiet();
    let coils = busbar_modbus::Bits::from_bytes(&[1]);
    for request in [
        Request::ReadCoils { address: 10240, count: 1 },
        Request::ReadDiscreteInputs { address: 10240, count: 1 },
        Request::ReadInputRegisters { address: 10240, count: 1 },
        Request::WriteSingleCoil { address: 8193, value: 0xFF00 },
        Request::WriteMultipleCoils { address: 8193, coils },
        Request::Other { function: 0, data: &[0x28, 0, 0, 1] },
        Request::Other { function: 0x2B, data: &[0x0E, 1, 0] },
        Request::Other { function: 0x17, data: &[] },
    ] {
        assert_eq!(ask(&mut site, 1, request), Answer::Exception(1), "{request:?}");
    }
}

#[test]
fn a_body_that_does_not_fit_its_function_gets_no_answer() {
    let mut site = Site::quiet();
    for function in [3, 6, 16] {
        assert_eq!(ask(&mut site, 1, Request::Other { function, data: &[0x28] }), Answer::Silence);
    }
}

#[test]
fn other_units_and_broadcast_get_no_answer_and_no_effect() {
    let mut site = Site::new(&Config { unit: 7, ..Config::default() });
    for unit in [0, 1, 6, 8, 255] {
        assert_eq!(ask(&mut site, unit, read(10240, 1)), Answer::Silence);
        assert_eq!(ask(&mut site, unit, write(CHANNEL_SELECT, 5)), Answer::Silence);
    }
    assert_eq!(site.code("selected_channel"), 0);
    assert_eq!(ask(&mut site, 7, read(10240, 1)), Answer::Registers(1));
}

#[test]
fn the_reset_word_silences_the_unit_for_some_seconds_and_keeps_its_counters() {
    let mut site = Site::quiet();
    site.write(CHANNEL_SELECT, 7);
    site.pass_seconds(60);
    let counters =
        ["genset_runs", "engine_hours", "genset_active_energy", "ethernet_packets", "fuel_counter"];
    let before = counters.map(|id| site.exact(id));
    let energy = site.number("mains_active_energy");

    site.write(HARD_RESET, 14536);
    assert!(site.device.is_silent());
    assert_eq!(ask(&mut site, 1, read(10240, 1)), Answer::Silence);
    site.pass_seconds(2);
    assert_eq!(ask(&mut site, 1, write(PUSH_BUTTONS, 1)), Answer::Silence);
    site.pass_seconds(3);
    assert!(!site.device.is_silent());
    assert_eq!(ask(&mut site, 1, read(10240, 16)), Answer::Registers(16));
    assert_eq!(counters.map(|id| site.exact(id)), before);
    assert!(site.number("mains_active_energy") >= energy, "the load was fed all the time");
    assert_eq!(site.code("selected_channel"), 0);
    assert_eq!(site.code("unit_mode"), 4);
}

#[test]
fn the_packet_counter_counts_and_wraps() {
    let mut site = Site::quiet();
    for _ in 0..65_535 {
        site.device.count_packet();
    }
    assert_eq!(site.number("ethernet_packets"), 65_535.0);
    site.device.count_packet();
    assert_eq!(site.number("ethernet_packets"), 0.0);
    site.pass_seconds(1);
    assert_eq!(site.number("ethernet_packets"), 0.0);
}
