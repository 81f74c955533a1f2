//! One conversation after the other, line by line.

use std::time::Duration;

use busbar_profile::command::{Next, Verdict, WriteOutcome};

use crate::harness::{Bench, play};

#[test]
fn a_mode_key_is_proved_by_the_mode() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 ack
         read
         read unit_mode=4
         at 0.7
         done 1 Unit mode is AUTO.",
    );
}

#[test]
fn a_mode_that_is_there_already_says_so() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=4
         write 6 8193 4 ack
         read
         done 1 Unit mode is AUTO as it was before.",
    );
}

#[test]
fn a_lost_answer_is_resolved_by_reading() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 lost
         read silent
         read
         read unit_mode=4
         done 1 The answer to the write was lost, but Unit mode is AUTO.",
    );
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 lost
         read*
         at 6.0
         no_effect 1 The answer to the write was lost, and Unit mode stayed STOP for 5 s.",
    );
}

#[test]
fn silence_after_the_write_leaves_it_unknown() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 lost
         read* silent
         unknown 1 The write was sent; the answer was lost, and the device has not answered since.",
    );
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 ack
         read
         read* down
         unknown 1 The write was sent; the device does not answer any more.",
    );
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 ack
         read* exception 2
         unknown 1 The device acknowledged the write, but Unit mode could not be read.",
    );
}

#[test]
fn silence_before_the_write_sends_nothing() {
    for failure in ["silent", "down"] {
        let script = format!(
            "read {failure}
             at 1.0
             refused 0 Nothing was sent: the device does not answer the reading that comes before it."
        );
        play("datakom-d", "auto", &[], &script);
    }
}

#[test]
fn who_refuses_the_reading_may_be_another_device_and_gets_nothing() {
    for (key, command, code) in [
        ("datakom-d", "stop", "2 (illegal address)"),
        ("datakom-d", "up", "2 (illegal address)"),
        ("datakom-d", "reset", "10 (write protection)"),
        ("datakom-dkg705", "auto", "2 (illegal address)"),
        ("smartgen-hat821si", "genset_start", "2 (illegal data address)"),
        ("smartgen-acc1700", "lock", "1 (illegal function)"),
        ("smartgen-acc1700", "output_1", "2 (illegal data address)"),
    ] {
        let number = code.split(' ').next().unwrap();
        let script = format!(
            "read exception {number}
             refused 0 Nothing was sent: the device refuses the reading that comes before it with exception {code}; \
             check the unit id, and that it is a {key}."
        );
        play(key, command, &[], &script);
    }
    // Nor does a silent one, even where nothing would show what came of the write.
    play(
        "datakom-d",
        "up",
        &[],
        "read silent
         refused 0 Nothing was sent: the device does not answer the reading that comes before it.",
    );
}

#[test]
fn an_exception_refuses_and_one_look_follows() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 exception 10
         read
         refused 1 The device refused the write with exception 10 (write protection); Unit mode is STOP.",
    );
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 exception 1
         read unit_mode=4
         refused 1 The device refused the write with exception 1 (illegal function code); Unit mode is AUTO all the same, \
         which was not this command.",
    );
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 exception 2
         read silent
         refused 1 The device refused the write with exception 2 (illegal address).",
    );
}

/// Two codes of the standard do not say that nothing was done.
#[test]
fn an_exception_may_mean_that_it_is_under_way() {
    play(
        "smartgen-acc1700",
        "lock",
        &[],
        "read
         write 5 19 0xFF00 exception 5
         read common_status.15=1
         done 1 Lock mode is on.",
    );
    play(
        "smartgen-acc1700",
        "lock",
        &[],
        "read
         write 5 19 0xFF00 exception 11
         read common_status.15=1
         done 1 The answer to the write was lost, but Lock mode is on.",
    );
}

#[test]
fn somebody_at_the_panel_is_told() {
    play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 ack
         read
         read* unit_mode=8
         no_effect 1 The device acknowledged the write, but Unit mode went from STOP to TEST, not AUTO, within 5 s: somebody \
         at the panel or the controller itself changed it.",
    );
    // Seen on its way, and gone again: the first step of the proof was there.
    play(
        "datakom-d",
        "run",
        &[],
        "read device_identity=0xD500 unit_mode=1
         write 6 8193 2 ack
         read unit_mode=2
         read* unit_mode=1
         no_effect 1 The device acknowledged the write, but Unit operation status stayed Genset at rest for 10 s; Unit mode was \
         RUN and is STOP by now.",
    );
}

#[test]
fn the_run_key_depends_on_the_model() {
    for (code, key, label) in [(0xD500, 2, "RUN"), (0xD545, 2, "RUN"), (0xD700, 16, "MANUAL")] {
        let script = format!(
            "read device_identity={code} unit_mode=1
             write 6 8193 {key} ack
             read unit_mode=2
             read operation_status=1
             done 1 Unit mode is {label}, Unit operation status is Wait before fuel."
        );
        play("datakom-d", "run", &[], &script);
    }
    play(
        "datakom-d",
        "run",
        &[],
        "read device_identity=0xD300
         refused 0 Nothing was sent: Device identity is D-300, for which the manual gives no value to write.",
    );
    play(
        "datakom-d",
        "manual",
        &[],
        "read exception 2
         refused 0 Nothing was sent: the device refuses the reading that comes before it with exception 2 (illegal address); \
         check the unit id, and that it is a datakom-d.",
    );
}

#[test]
fn a_breaker_key_is_proved_by_a_change() {
    for closed in [0, 1] {
        let shows = if closed == 1 { "off" } else { "on" };
        let flag = |bit: u8| format!("function_flags.4={bit}");
        let script = format!(
            "read {}
             write 6 8193 0x4020 ack
             read
             read {}
             done 1 Genset contactor is {shows}.",
            flag(closed),
            flag(1 - closed)
        );
        play("datakom-d", "gcb", &[("press", "long")], &script);
    }
    play(
        "datakom-d",
        "gcb",
        &[],
        "read exception 2
         refused 0 Nothing was sent: the device refuses the reading that comes before it with exception 2 (illegal address); \
         check the unit id, and that it is a datakom-d.",
    );
}

#[test]
fn a_key_without_proof_is_unknown() {
    play(
        "datakom-d",
        "up",
        &[("press", "very_long")],
        "read
         write 6 8193 0x8200 ack
         unknown 1 The device acknowledged the write, and no register shows what a menu or arrow key did.",
    );
    play(
        "datakom-d",
        "up",
        &[],
        "read
         write 6 8193 0x0200 lost
         unknown 1 The answer to the write was lost, and no register shows what a menu or arrow key did.",
    );
    play(
        "datakom-d",
        "up",
        &[],
        "read
         write 6 8193 0x0200 exception 2
         refused 1 The device refused the write with exception 2 (illegal address).",
    );
    play(
        "datakom-d",
        "up",
        &[],
        "read
         write 6 8193 0x0200 unsent
         refused 0 Nothing was sent: the write did not leave, the wire is down.",
    );
}

#[test]
fn a_reset_is_proved_by_silence_and_return() {
    play(
        "datakom-d",
        "reset",
        &[],
        "read
         write 6 8210 14536 lost
         read
         read silent
         read down
         read
         done 1 The answer to the write was lost, but the device fell silent and is back.",
    );
    play(
        "datakom-d",
        "reset",
        &[],
        "read
         write 6 8210 14536 ack
         read*
         no_effect 1 The device acknowledged the write, but the device answered every reading for 60 s.",
    );
    play(
        "datakom-d",
        "reset",
        &[],
        "read
         write 6 8210 14536 lost
         read*
         unknown 1 The answer to the write was lost, and the device answered every reading for 60 s.",
    );
    play(
        "datakom-d",
        "reset",
        &[],
        "read
         write 6 8210 14536 ack
         read
         read* silent
         unknown 1 The write was sent; the device does not answer any more.",
    );
}

#[test]
fn a_toggle_looks_first() {
    play(
        "smartgen-acc1700",
        "load",
        &[],
        "read indicators.6=1
         done 0 It is so already, and nothing was sent: Load indicator is on.",
    );
    play(
        "smartgen-acc1700",
        "load",
        &[],
        "read exception 2
         refused 0 Nothing was sent: the device refuses the reading that comes before it with exception 2 (illegal data address); \
         check the unit id, and that it is a smartgen-acc1700.",
    );
    play(
        "smartgen-acc1700",
        "unload",
        &[],
        "read indicators.6=1
         write 5 3 0xFF00 lost
         read
         read indicators.6=0
         done 1 The answer to the write was lost, but Load indicator is off.",
    );
}

#[test]
fn remote_control_must_be_allowed() {
    play(
        "smartgen-hat821si",
        "auto",
        &[],
        "read
         refused 0 Nothing was sent: Remote control mode is off, and must be on.",
    );
    play(
        "smartgen-hat821si",
        "transfer_000",
        &[],
        "read common_status.13=1 switches.4=1 switches.5=1 tie_switch.7=1
         write 5 15030 0xFF00 ack
         read switches.4=0
         read switches.5=0
         read* tie_switch.7=1 switches.4=1
         no_effect 1 The device acknowledged the write, but QTIE closed stayed on for 30 s; S1 closed was off and \
         is on by now.",
    );
}

#[test]
fn evidence_tells_before_and_after() {
    let report = play(
        "datakom-d",
        "auto",
        &[],
        "read unit_mode=1
         write 6 8193 4 ack
         read unit_mode=4
         done 1 Unit mode is AUTO.",
    );
    let profile = busbar_profile::builtin("datakom-d").unwrap();
    let shown: Vec<_> = report.evidence.iter().map(|observed| observed.shown(profile, None)).collect();
    let json = serde_json::to_string(&shown).unwrap();
    assert_eq!(json, r#"[{"id":"unit_mode","before":"STOP","after":"AUTO"}]"#);
    let report = play(
        "smartgen-acc1700",
        "load",
        &[],
        "read
         write 5 3 0xFF00 ack
         read indicators.6=1
         done 1 Load indicator is on.",
    );
    let profile = busbar_profile::builtin("smartgen-acc1700").unwrap();
    let shown: Vec<_> = report.evidence.iter().map(|observed| observed.shown(profile, None)).collect();
    let json = serde_json::to_string(&shown).unwrap();
    assert_eq!(json, r#"[{"id":"indicators.load_indicator","before":false,"after":true}]"#);
}

/// What was read a while ago does not speak for a write: the caller's queue may have been long.
#[test]
fn an_old_reading_is_read_again() {
    let mut bench = Bench::new("smartgen-acc1700", "load", &[]);
    let Next::Read(points) = bench.ask() else { panic!("a reading comes first") };
    bench.answer(&points, None);
    bench.now += Duration::from_secs(2);
    bench.world.set_all("indicators.6=1");
    assert_eq!(bench.ask(), Next::Read(points.clone()));
    bench.answer(&points, None);
    let Next::Done(report) = bench.ask() else { panic!("it is loaded by now") };
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 0));
}

/// The answer to a write counts from when it comes, however long it was in the queue.
#[test]
fn the_time_of_the_proof_begins_with_the_answer() {
    let mut bench = Bench::new("datakom-d", "auto", &[]);
    let Next::Read(points) = bench.ask() else { panic!("a reading comes first") };
    bench.answer(&points, None);
    assert!(matches!(bench.ask(), Next::Write(_)));
    assert_eq!(bench.ask(), Next::Pending, "it is not handed out again");
    bench.now += Duration::from_secs(30);
    assert_eq!(bench.ask(), Next::Pending);
    bench.outcome(WriteOutcome::Acknowledged);
    let Next::Read(points) = bench.ask() else { panic!("the state is read back") };
    bench.answer(&points, None);
    bench.world.set_all("unit_mode=4");
    let Next::Read(points) = bench.ask() else { panic!("and read again") };
    bench.answer(&points, None);
    let Next::Done(report) = bench.ask() else { panic!("it shows") };
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 1));
}
