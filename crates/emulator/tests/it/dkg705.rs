//! The DKG-705 as a client sees it: its wire rules, and its commands with their proofs.

mod alarms;
mod contactors;
mod parameters;
mod registers;

use busbar_emulator::{Config, StartError};
use busbar_modbus::{Registers, Request, Response};
use proptest::prelude::*;

use crate::site::{Answer, Site, TENTH, ask};

const MODE_KEYS: u16 = 0x0040;
const AUTO: u16 = 0x10;
const OFF: u16 = 0x20;
const TEST: u16 = 0x40;
const LOAD_TEST: u16 = 0x80;
const CLOCK: u16 = 0x0024;

fn config() -> Config {
    Config { profile: "datakom-dkg705".into(), ..Config::default() }
}

fn quiet() -> Site {
    Site::new(&config())
}

fn story(seed: u64) -> Site {
    Site::new(&Config { seed, story: true, ..config() })
}

fn clock(site: &Site) -> [u16; 6] {
    ["year", "month", "day", "hour", "minute", "second"]
        .map(|part| site.number(&format!("clock_{part}")) as u16)
}

// The wire.

fn read(address: u16, count: u16) -> Request<'static> {
    Request::ReadHoldingRegisters { address, count }
}

fn write(address: u16, value: u16) -> Request<'static> {
    Request::WriteSingleRegister { address, value }
}

#[test]
fn reads_are_cut_to_sixteen_and_holes_are_illegal() {
    let mut site = quiet();
    for (name, address, count, expected) in [
        ("the manual's example", 0x0020, 16, Answer::Registers(16)),
        ("one too many", 0x0020, 17, Answer::Registers(16)),
        ("the most the protocol allows", 0x0020, 125, Answer::Registers(16)),
        ("nothing", 0x0020, 0, Answer::Exception(2)),
        ("more than the protocol allows", 0x0020, 126, Answer::Exception(2)),
        ("the end of the first range", 0x0028, 16, Answer::Registers(16)),
        ("past its end only before the cut", 0x0028, 100, Answer::Registers(16)),
        ("into the hole behind it", 0x0029, 16, Answer::Exception(2)),
        ("the hole", 0x0038, 1, Answer::Exception(2)),
        ("from hole to hole", 0x0039, 11, Answer::Registers(11)),
        ("the second hole", 0x0044, 1, Answer::Exception(2)),
        ("its end", 0x005F, 1, Answer::Exception(2)),
        ("the J1939 block", 0x0060, 16, Answer::Registers(16)),
        ("its faults", 0x0070, 16, Answer::Registers(16)),
        ("past them", 0x0080, 1, Answer::Exception(2)),
        ("before the parameters", 0x0FFF, 2, Answer::Exception(2)),
        ("the first parameters", 0x1000, 3, Answer::Registers(3)),
        ("a hole among them", 0x1003, 1, Answer::Exception(2)),
        ("across it", 0x1002, 4, Answer::Exception(2)),
        ("its end", 0x1004, 1, Answer::Exception(2)),
        ("the last hole", 0x1029, 1, Answer::Exception(2)),
        ("the last registers", 0x102A, 4, Answer::Registers(4)),
        ("past them", 0x102A, 5, Answer::Exception(2)),
        ("the last address there is", 0xFFFF, 16, Answer::Exception(2)),
    ] {
        assert_eq!(ask(&mut site, 1, read(address, count)), expected, "{name}");
    }
}

#[test]
fn seven_registers_can_be_written_and_no_function_but_3_and_6_exists() {
    let mut site = quiet();
    for register in (CLOCK..CLOCK + 6).chain([MODE_KEYS]) {
        assert_eq!(ask(&mut site, 1, write(register, 0x10)), Answer::Echo, "{register:04X}");
    }
    for (register, code) in
        [(0x0000, 10), (0x0023, 10), (0x002A, 10), (0x003D, 10), (0x1016, 10), (0x0038, 2), (0x1029, 2)]
    {
        assert_eq!(ask(&mut site, 1, write(register, 0x10)), Answer::Exception(code), "{register:04X}");
    }
    let before = site.image();
    for request in [
        Request::WriteMultipleRegisters { address: MODE_KEYS, registers: Registers::from(&[OFF]) },
        Request::WriteMultipleRegisters { address: CLOCK, registers: Registers::from(&[1; 6]) },
        Request::ReadInputRegisters { address: 0, count: 1 },
        Request::ReadCoils { address: 0, count: 1 },
        Request::WriteSingleCoil { address: MODE_KEYS, value: 0xFF00 },
        Request::Other { function: 0x2B, data: &[0x0E, 1, 0] },
    ] {
        assert_eq!(ask(&mut site, 1, request), Answer::Exception(1), "{request:?}");
    }
    assert_eq!(ask(&mut site, 1, Request::Other { function: 6, data: &[0] }), Answer::Silence);
    assert_eq!(site.image(), before);
}

#[test]
fn unit_ids_reach_250_and_others_get_no_answer() {
    let mut site = Site::new(&Config { unit: 250, ..config() });
    for unit in [0, 1, 249, 251] {
        assert_eq!(ask(&mut site, unit, read(0, 1)), Answer::Silence);
        assert_eq!(ask(&mut site, unit, write(MODE_KEYS, OFF)), Answer::Silence);
    }
    assert_eq!(ask(&mut site, 250, read(0, 1)), Answer::Registers(1));
    assert!(site.bits("operating_mode").contains(4));
}

#[test]
fn a_model_of_another_family_is_refused_by_name() {
    let of = |model: &str| busbar_emulator::Device::new(&Config { model: Some(model.into()), ..config() });
    assert!(of("dkg-705").is_ok());
    assert!(matches!(of("D-500"), Err(StartError::UnknownModel { allowed, .. }) if allowed == ["DKG-705"]));
}

// The commands, with the registers that prove them.

#[test]
fn each_key_selects_its_mode_at_once() {
    let mut site = quiet();
    for (key, bit) in [(OFF, 5), (TEST, 6), (LOAD_TEST, 7), (AUTO, 4)] {
        site.write(MODE_KEYS, key);
        for point in ["operating_mode", "last_key"] {
            assert_eq!(site.bits(point).iter().collect::<Vec<_>>(), [bit], "{point} after {key:02X}");
        }
    }
}

#[test]
fn words_that_mean_no_mode_have_no_effect_and_high_bytes_do_not_count() {
    let mut site = quiet();
    let before = site.image();
    for word in [0x00, 0x01, 0x0F, 0x11, 0x30, 0xF0, 0xFF, 0x2000, 0x4030] {
        site.write(MODE_KEYS, word);
        assert_eq!(site.image(), before, "{word:04X}");
    }
    site.write(MODE_KEYS, 0xFF00 | OFF);
    assert_eq!(site.bits("operating_mode").iter().collect::<Vec<_>>(), [5]);
}

#[test]
fn test_runs_beside_the_load_and_off_cools_down_first() {
    let mut site = quiet();
    site.write(MODE_KEYS, TEST);
    assert_eq!(site.walk_to(4), [0, 1, 2, 3, 4]);
    assert_eq!(site.walk_to(0), [4, 0]);
    site.pass_seconds(5);
    assert!(site.number("engine_speed") > 1490.0);
    assert!(site.number("mains_active_power") > 20.0 && site.number("genset_active_power") == 0.0);

    site.write(MODE_KEYS, OFF);
    assert_eq!(site.walk_to(13), [0, 12, 13]);
    site.walk_to(0);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), site.number("engine_speed")), (0, 0.0));
}

#[test]
fn off_again_stops_at_once() {
    let mut site = quiet();
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(8);
    site.write(MODE_KEYS, OFF);
    site.write(MODE_KEYS, OFF);
    assert_eq!(site.code("operation_status"), 13);
    site.pass(TENTH);
    assert!(!site.bits("relays").contains(4) && !site.bits("relays").contains(6));
    // The mains take the load over after the engine has stopped.
    assert_eq!(site.walk_to(11), [13, 0, 11]);
    site.walk_to(0);
    assert!(site.number("mains_active_power") > 20.0);
}

#[test]
fn load_test_moves_the_load_there_and_back_without_a_break() {
    let mut site = quiet();
    site.write(MODE_KEYS, LOAD_TEST);
    let mut seen = site.walk_to(5);
    seen.extend(interrupted_never(&mut site, 8));
    site.pass_seconds(20);
    site.write(MODE_KEYS, AUTO);
    seen.extend(interrupted_never(&mut site, 12));
    seen.extend(site.walk_to(0));
    seen.dedup();
    assert_eq!(seen, [0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 14, 12, 13, 0]);
}

/// Walks to a status; at every moment something feeds the load.
fn interrupted_never(site: &mut Site, status: u32) -> Vec<u32> {
    let mut seen = vec![site.code("operation_status")];
    for _ in 0..1200 {
        let fed = site.number("mains_active_power") + site.number("genset_active_power");
        assert!(fed > 20.0, "{fed} kW in {seen:?}");
        if seen.last() == Some(&status) {
            return seen;
        }
        site.pass(TENTH);
        seen.push(site.code("operation_status"));
        seen.dedup();
    }
    panic!("status {status} never came: {seen:?}");
}

#[test]
fn the_clock_runs_and_is_set_register_by_register() {
    let mut site = quiet();
    assert_eq!(clock(&site), [26, 1, 5, 10, 0, 0]);
    site.pass_seconds(61);
    assert_eq!(clock(&site), [26, 1, 5, 10, 1, 1]);

    for (register, value) in (CLOCK..).zip([27, 2, 28, 23, 59, 58]) {
        site.write(register, value);
        assert_eq!(site.device.registers(register, 1).unwrap()[0] & 0x00FF, value, "read back at once");
    }
    site.pass_seconds(2);
    assert_eq!(clock(&site), [27, 3, 1, 0, 0, 0]);
}

#[test]
fn the_clock_starts_where_it_is_told_and_nothing_else_follows_it() {
    let epoch = "2031-12-31T23:59:50".parse().unwrap();
    let mut site = Site::new(&Config { epoch, ..config() });
    let mut usual = quiet();
    assert_eq!(clock(&site), [31, 12, 31, 23, 59, 50]);
    for site in [&mut site, &mut usual] {
        site.pass_seconds(20);
    }
    assert_eq!(clock(&site), [32, 1, 1, 0, 0, 10]);
    let without_clock = |site: &Site| {
        let points = site.device.profile().points.iter().filter(|point| !point.id.starts_with("clock_"));
        points.map(|point| format!("{} {:?}", point.id, site.decode(&point.id))).collect::<Vec<_>>()
    };
    assert_eq!(without_clock(&site), without_clock(&usual));
}

#[test]
fn impossible_clock_values_are_echoed_and_have_no_effect() {
    let mut site = quiet();
    let before = clock(&site);
    let impossible: [&[u16]; 6] = [&[100, 255], &[0, 13], &[0, 32], &[24], &[60], &[60, 0x00FF]];
    for (register, values) in (CLOCK..).zip(impossible) {
        for value in values {
            site.write(register, *value);
            assert_eq!(clock(&site), before, "{value} into {register:04X}");
        }
    }
    // The high byte is no part of an 8-bit register.
    site.write(CLOCK, 0xAB00 | 30);
    assert_eq!(clock(&site)[0], 30);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_request_gets_a_lawful_answer_or_none(
        pdus in prop::collection::vec((pdu(), 0..20_u32), 1..40),
    ) {
        let mut site = quiet();
        for (pdu, tenths) in &pdus {
            site.pass(TENTH * *tenths);
            let Ok(request) = Request::decode(pdu) else { continue };
            let Some(response) = site.device.answer(1, &request) else { continue };
            match response {
                Response::Exception { function, code } => {
                    prop_assert_eq!(function, request.function());
                    prop_assert!([1, 2, 10].contains(&code.0));
                }
                Response::ReadHoldingRegisters(registers) => {
                    let Request::ReadHoldingRegisters { count, .. } = request else {
                        unreachable!("{request:?}")
                    };
                    // More than 16 are not refused: the answer ends.
                    prop_assert_eq!(registers.len(), usize::from(count).min(16));
                    prop_assert!(count > 16 || response.answers(&request).is_ok());
                }
                Response::WriteSingleRegister { .. } => response.answers(&request).unwrap(),
                other => prop_assert!(false, "{other:?}"),
            }
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }
}

/// Addresses around the edges of the map are where mistakes live.
fn pdu() -> impl Strategy<Value = Vec<u8>> {
    let address = prop_oneof![any::<u16>(), 0x0000..0x0090_u16, 0x0FF0..0x1040_u16];
    let short = (1..=6_u8, address, any::<u16>()).prop_map(|(function, address, word)| {
        [&[function][..], &address.to_be_bytes(), &word.to_be_bytes()].concat()
    });
    prop_oneof![short, prop::collection::vec(any::<u8>(), 0..260)]
}
