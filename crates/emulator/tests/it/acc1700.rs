//! The imitated ACC1700: worked frames, wire rules, keys and the two procedures of its manual.

mod alarms;
mod filter;
mod life;
mod plant;
mod settings;

use std::time::Duration;

use busbar_emulator::{Config, Device, StartError};
use busbar_modbus::{Framing, Request, Response, Server};
use busbar_profile::WordOrder;
use busbar_profile::command::{Next, Report, Run, Verdict, WriteOutcome};

use crate::site::{Answer, Site, TENTH, ask};

const START: u16 = 0;
const STOP: u16 = 1;
const LOAD_UNLOAD: u16 = 3;
const DOWN: u16 = 8;
const UNLOCK: u16 = 18;
const LOCK: u16 = 19;
const OUTPUT_1: u16 = 20;
const ON: u16 = 0xFF00;
const OFF: u16 = 0;

fn config() -> Config {
    Config { profile: "smartgen-acc1700".into(), ..Config::default() }
}

fn quiet() -> Site {
    Site::new(&config())
}

fn pinned(pins: &[(&str, &str)]) -> Site {
    let pins = pins.iter().map(|(point, value)| ((*point).into(), (*value).into())).collect();
    Site::new(&Config { pins, ..config() })
}

fn write(site: &mut Site, coil: u16, value: u16) {
    let request = Request::WriteSingleCoil { address: coil, value };
    let echo = Response::WriteSingleCoil { address: coil, value };
    assert_eq!(site.device.answer(1, &request), Some(echo));
}

fn press(site: &mut Site, key: u16) {
    write(site, key, ON);
}

fn status(site: &Site) -> u32 {
    site.code("engine_running_status")
}

fn indicator(site: &Site, bit: u16) -> bool {
    site.bits("indicators").contains(bit)
}

fn common(site: &Site, bit: u16) -> bool {
    site.bits("common_status").contains(bit)
}

/// Lets time pass until register 94 shows a status; all statuses seen on the way, the first one included.
fn walk_to(site: &mut Site, wanted: u32) -> Vec<u32> {
    let mut seen = vec![status(site)];
    for _ in 0..3000 {
        if seen.last() == Some(&wanted) {
            return seen;
        }
        site.pass(TENTH);
        let now = status(site);
        if seen.last() != Some(&now) {
            seen.push(now);
        }
    }
    panic!("status {wanted} never came: {seen:?}");
}

fn loaded() -> Site {
    let mut site = quiet();
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    assert_eq!(status(&site), 9);
    site
}

/// Carries out a command of the profile as Busbar does.
fn command(site: &mut Site, id: &str) -> Report {
    let profile = site.device.profile();
    let command = profile.command(id).unwrap_or_else(|| panic!("no command {id}"));
    let local = "2026-11-23T05:19:20".parse().unwrap();
    let arguments = command.arguments([], local).unwrap();
    let mut run = Run::new(profile, command, arguments, WordOrder::LowFirst);
    loop {
        match run.next(site.now) {
            Next::WaitUntil(at) => {
                let until = at.max(site.now + Duration::from_millis(1));
                site.pass(until - site.now);
            }
            Next::Read(points) => {
                for point in points {
                    let point = &profile.points[point];
                    run.store(point.address, site.device.registers(point.address, point.registers).unwrap());
                }
                site.pass(Duration::from_millis(50));
                run.read(site.now, Ok(()));
            }
            Next::Write(frame) => {
                assert_eq!(frame.function, 5);
                write(site, frame.address, frame.value);
                run.written(site.now, WriteOutcome::Acknowledged);
            }
            Next::Done(report) => return report,
            Next::Pending => panic!("{id}: an answer was not taken"),
        }
    }
}

/// One RTU frame in, the answer's bytes out.
fn on_the_wire(site: &mut Site, frame: &[u8]) -> Vec<u8> {
    let mut server = Server::new(Framing::Rtu);
    let mut out = Vec::new();
    server.receive(Duration::ZERO, frame);
    let incoming = server.next_request().unwrap();
    if let Some(response) = site.device.answer(incoming.unit, &incoming.request) {
        incoming.respond(&response, &mut out).unwrap();
    }
    out
}

#[test]
fn the_manuals_frames_get_the_manuals_answers() {
    let mut site = pinned(&[
        ("shutdown_alarms_1", "overspeed_shutdown"),
        ("shutdown_alarms_2", "high_engine_temperature_shutdown"),
        ("total_fuel", "123456"),
        ("battery_voltage", "27.6"),
    ]);
    let tables_3_and_4 = (
        [0x01, 0x03, 0x00, 0x01, 0x00, 0x02, 0x95, 0xCB],
        [0x01, 0x03, 4, 0x00, 0x02, 0x00, 0x02, 0xDA, 0x32],
    );
    let tables_7_and_8 = (
        [0x01, 0x03, 0x00, 0x56, 0x00, 0x02, 0x24, 0x1B],
        [0x01, 0x03, 4, 0xE2, 0x40, 0x00, 0x01, 0x0C, 0x5F],
    );
    for (asked, answered) in [tables_3_and_4, tables_7_and_8] {
        assert_eq!(on_the_wire(&mut site, &asked), answered);
    }
    let tables_11_and_12 = [0x01, 0x05, 0x00, 0x03, 0xFF, 0x00, 0x7C, 0x3A];
    assert_eq!(on_the_wire(&mut site, &tables_11_and_12), tables_11_and_12);
    assert_eq!(site.device.registers(51, 1), Some(&[276][..]));

    let mut site = loaded();
    assert_eq!(on_the_wire(&mut site, &tables_11_and_12), tables_11_and_12);
    assert_eq!(status(&site), 8, "that frame was the key");
}

#[test]
fn reads_take_120_registers_at_most_and_stay_inside_the_map() {
    let mut site = quiet();
    for (name, address, count, expected) in [
        ("one", 0, 1, Answer::Registers(1)),
        ("the most", 0, 120, Answer::Registers(120)),
        ("the most, up to the end", 80, 120, Answer::Registers(120)),
        ("reserved rows", 7, 13, Answer::Registers(13)),
        ("the last", 199, 1, Answer::Registers(1)),
        ("one too many", 0, 121, Answer::Exception(3)),
        ("the most the protocol allows", 0, 125, Answer::Exception(3)),
        ("more than that", 0, 126, Answer::Exception(3)),
        ("none", 0, 0, Answer::Exception(3)),
        ("too many where nothing is", 300, 121, Answer::Exception(3)),
        ("past the end", 81, 120, Answer::Exception(2)),
        ("one past the end", 199, 2, Answer::Exception(2)),
        ("nowhere", 200, 1, Answer::Exception(2)),
        ("the last address of all", 65535, 1, Answer::Exception(2)),
    ] {
        let request = Request::ReadHoldingRegisters { address, count };
        assert_eq!(ask(&mut site, 1, request), expected, "{name}");
    }
}

#[test]
fn coils_are_written_with_two_values_only() {
    let mut site = quiet();
    for (name, address, value, expected) in [
        ("a key", DOWN, ON, Answer::Echo),
        ("a key let go", START, OFF, Answer::Echo),
        ("an output off", 23, OFF, Answer::Echo),
        ("the value of PLC addresses", START, 1, Answer::Exception(3)),
        ("another value", LOCK, 0x00FF, Answer::Exception(3)),
        ("a reserved coil", 2, ON, Answer::Exception(2)),
        ("a reserved coil between the others", 17, ON, Answer::Exception(2)),
        ("past the outputs", 24, ON, Answer::Exception(2)),
        ("a register's address", 94, ON, Answer::Exception(2)),
        ("the last address", 65535, ON, Answer::Exception(2)),
        ("a reserved coil with another value", 2, 7, Answer::Exception(3)),
    ] {
        assert_eq!(ask(&mut site, 1, Request::WriteSingleCoil { address, value }), expected, "{name}");
    }
    assert_eq!(status(&site), 0);
}

#[test]
fn functions_other_than_3_and_5_are_illegal() {
    let mut site = quiet();
    let coils = busbar_modbus::Bits::from_bytes(&[1]);
    let registers = busbar_modbus::Registers::from(&[1]);
    for request in [
        Request::ReadCoils { address: 0, count: 1 },
        Request::ReadDiscreteInputs { address: 0, count: 1 },
        Request::ReadInputRegisters { address: 0, count: 1 },
        Request::WriteSingleRegister { address: 0, value: 1 },
        Request::WriteMultipleCoils { address: 0, coils },
        Request::WriteMultipleRegisters { address: 0, registers },
        Request::Other { function: 0x2B, data: &[0x0E, 1, 0] },
        Request::Other { function: 0, data: &[] },
    ] {
        assert_eq!(ask(&mut site, 1, request), Answer::Exception(1), "{request:?}");
    }
}

#[test]
fn other_units_and_broadcast_get_no_answer_and_no_effect() {
    let mut site = Site::new(&Config { unit: 254, ..config() });
    for unit in [0, 1, 253, 255] {
        assert_eq!(
            ask(&mut site, unit, Request::ReadHoldingRegisters { address: 0, count: 1 }),
            Answer::Silence
        );
        let start = Request::WriteSingleCoil { address: START, value: ON };
        assert_eq!(ask(&mut site, unit, start), Answer::Silence);
    }
    assert_eq!(status(&site), 0);
    for unit in [0, 255] {
        let refused = Device::new(&Config { unit, ..config() }).map(|_| ()).unwrap_err();
        assert_eq!(refused, StartError::Unit { unit, min: 1, max: 254 });
    }
}

#[test]
fn models_are_those_of_the_profile() {
    let of = |model: &str| Device::new(&Config { model: Some(model.into()), ..config() });
    let exhaust = |device: Device| device.registers(84, 1).map(|registers| registers[0]);
    assert_eq!(exhaust(of("acc1700").unwrap()), Some(32766), "without an ECU nobody knows");
    assert_ne!(exhaust(of("ACC1700CAN").unwrap()), Some(32766));
    let allowed = vec!["ACC1700".to_owned(), "ACC1700CAN".to_owned()];
    let refused = of("D-500").map(|_| ()).unwrap_err();
    assert_eq!(refused, StartError::UnknownModel { model: "D-500".into(), allowed });
}

#[test]
fn the_start_procedure_step_by_step() {
    let mut site = quiet();
    assert!(common(&site, 11) && !common(&site, 10));
    press(&mut site, START);
    assert_eq!(status(&site), 1, "whoever reads back at once sees it");
    assert!(common(&site, 10) && !common(&site, 11));
    assert_eq!(walk_to(&mut site, 8), [1, 2, 3, 5, 6, 7, 8]);
    assert!(indicator(&site, 8) && !indicator(&site, 6) && !indicator(&site, 5));

    site.pass_seconds(120);
    assert_eq!(status(&site), 8, "it never loads by itself");
    assert_eq!(site.number("discharge_pressure"), 0.0);
    press(&mut site, LOAD_UNLOAD);
    assert_eq!(status(&site), 9);
    assert!(indicator(&site, 6) && indicator(&site, 5) && !indicator(&site, 8));
    site.pass_seconds(60);
    assert_eq!(status(&site), 9);
    assert!(site.number("discharge_pressure") > 300.0);

    press(&mut site, LOAD_UNLOAD);
    assert_eq!(status(&site), 8, "the same key unloads");
    assert!(indicator(&site, 8) && !indicator(&site, 6) && !indicator(&site, 5));
}

#[test]
fn the_stop_procedure_step_by_step() {
    let mut site = loaded();
    site.pass_seconds(90);
    let pressure = site.number("discharge_pressure");
    press(&mut site, STOP);
    assert!(common(&site, 11) && !common(&site, 10));
    assert_eq!(status(&site), 10);
    assert!(!indicator(&site, 6) && !indicator(&site, 5));

    site.pass_seconds(2);
    assert!(indicator(&site, 7) && site.number("discharge_pressure") < pressure);
    assert_eq!(site.number("engine_delay"), 20.0, "the delay stands still");
    while indicator(&site, 7) {
        site.pass(TENTH);
    }
    assert!(site.number("discharge_pressure") <= 200.0);
    assert_eq!(status(&site), 10);
    assert_eq!(walk_to(&mut site, 0), [10, 11, 12, 13, 15, 0]);
    assert_eq!(site.number("engine_speed"), 0.0);
    assert!(!indicator(&site, 4) && common(&site, 11));
}

#[test]
fn the_delay_counts_down_where_the_manual_has_one_and_is_nothing_elsewhere() {
    let mut site = quiet();
    press(&mut site, START);
    let mut last = (status(&site), site.number("engine_delay"));
    let mut counted = std::collections::BTreeSet::new();
    for tenth in 0..2400 {
        match tenth {
            600 => press(&mut site, LOAD_UNLOAD),
            1200 => press(&mut site, STOP),
            _ => site.pass(TENTH),
        }
        let now = (status(&site), site.number("engine_delay"));
        let point = site.device.profile().point("engine_running_status").unwrap();
        if !point.choice(now.0).unwrap().timed {
            assert_eq!(now.1, 0.0, "status {}", now.0);
        } else if now.0 == last.0 && now.1 != last.1 {
            assert_eq!(now.1, last.1 - 1.0, "status {}", now.0);
            counted.insert(now.0);
        }
        last = now;
    }
    assert_eq!(status(&site), 0);
    assert!([1, 3, 5, 6, 7, 10, 11, 12, 13, 15].iter().all(|status| counted.contains(status)), "{counted:?}");
}

#[test]
fn keys_that_the_machine_would_ignore_are_echoed_and_ignored() {
    let mut site = quiet();
    press(&mut site, LOAD_UNLOAD);
    press(&mut site, STOP);
    assert_eq!(status(&site), 0, "nothing to load, nothing to stop");

    press(&mut site, START);
    for wanted in [3, 6, 7] {
        walk_to(&mut site, wanted);
        press(&mut site, LOAD_UNLOAD);
        press(&mut site, START);
        assert_eq!(status(&site), wanted);
    }
    walk_to(&mut site, 8);
    press(&mut site, START);
    assert_eq!(status(&site), 8);

    press(&mut site, STOP);
    site.pass_seconds(1);
    let left = site.number("engine_delay");
    for key in [STOP, START, LOAD_UNLOAD] {
        press(&mut site, key);
        assert_eq!((status(&site), site.number("engine_delay")), (10, left));
        assert!(common(&site, 11));
    }
    walk_to(&mut site, 11);
    press(&mut site, START);
    assert_eq!(walk_to(&mut site, 0), [11, 12, 13, 15, 0]);
}

#[test]
fn a_key_let_go_does_nothing() {
    let mut site = loaded();
    press(&mut site, LOCK);
    let before = site.image();
    for key in [START, STOP, LOAD_UNLOAD, DOWN, UNLOCK, LOCK] {
        write(&mut site, key, OFF);
    }
    assert_eq!(site.image(), before);
}

#[test]
fn locked_keys_are_dead_but_stop_is_not() {
    let mut site = quiet();
    press(&mut site, LOCK);
    assert!(common(&site, 15));
    press(&mut site, START);
    site.pass_seconds(5);
    assert_eq!(status(&site), 0);
    press(&mut site, UNLOCK);
    assert!(!common(&site, 15));
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOCK);
    press(&mut site, LOAD_UNLOAD);
    assert_eq!(status(&site), 8);
    press(&mut site, STOP);
    walk_to(&mut site, 0);
    assert!(common(&site, 15));
}

#[test]
fn remote_outputs_switch_on_and_off_whatever_else_happens() {
    let mut site = quiet();
    press(&mut site, LOCK);
    for output in 0..4 {
        let shown = |site: &Site| site.bits("outputs").iter().collect::<Vec<_>>();
        press(&mut site, OUTPUT_1 + output);
        assert_eq!(shown(&site), [2 + output]);
        press(&mut site, OUTPUT_1 + output);
        site.pass_seconds(30);
        assert_eq!(shown(&site), [2 + output]);
        write(&mut site, OUTPUT_1 + output, OFF);
        assert!(shown(&site).is_empty());
    }
}

#[test]
fn every_command_of_the_profile_ends_as_its_proof_says() {
    let mut site = quiet();
    for (id, verdict, sent) in [
        ("lock", Verdict::Done, 1),
        ("start", Verdict::NoEffect, 1),
        ("unlock", Verdict::Done, 1),
        ("unload", Verdict::Done, 0),
        ("load", Verdict::NoEffect, 1),
        ("start", Verdict::Done, 1),
        ("stop", Verdict::Done, 1),
        ("stop_to_standby", Verdict::Done, 0),
        ("start_and_load", Verdict::Done, 2),
        ("start_and_load", Verdict::Done, 0),
        ("load", Verdict::Done, 0),
        ("unload", Verdict::Done, 1),
        ("load", Verdict::Done, 1),
        ("down", Verdict::Unknown, 1),
        ("output_1", Verdict::Unknown, 1),
        ("output_2", Verdict::Unknown, 1),
        ("output_3", Verdict::Unknown, 1),
        ("output_4", Verdict::Unknown, 1),
        ("stop_to_standby", Verdict::Done, 1),
    ] {
        let report = command(&mut site, id);
        assert_eq!((report.verdict, report.sent), (verdict, sent), "{id}: {}", report.reason);
    }
    assert_eq!(status(&site), 0);
    assert_eq!(site.device.misfits(), 0);
}
