//! Procedures: several writes, each once, with what lies between them.

use busbar_profile::command::{ArgError, Next, Verdict, WriteOutcome};
use busbar_profile::{DateTime, TimePart, builtin};

use crate::harness::{Bench, local, play};

/// The clock of the unit as it stands, two hours and a few seconds late.
const CLOCK: &str = "clock_year=26 clock_month=11 clock_day=23 clock_hour=3 clock_minute=18 clock_second=30";

#[test]
fn the_clock_is_set_by_six_writes() {
    let script = format!(
        "read {CLOCK}
         write 6 0x24 26 ack
         read
         write 6 0x25 11 ack
         read
         write 6 0x26 23 ack
         read
         write 6 0x27 5 ack
         read clock_hour=5
         write 6 0x28 19 ack
         read clock_minute=19
         # Ten exchanges of 50 ms, and one before them: not half a second has gone by.
         write 6 0x29 20 ack
         read clock_second=20
         done 6 Clock is 2026-11-23T05:19:20."
    );
    let report = play("datakom-dkg705", "set_clock", &[], &script);
    let profile = builtin("datakom-dkg705").unwrap();
    let shown: Vec<_> = report.evidence.iter().map(|observed| observed.shown(profile, None)).collect();
    let json = serde_json::to_string(&shown).unwrap();
    assert!(json.contains(r#"{"id":"clock_hour","before":3,"after":5}"#), "{json}");
    let clock = r#"{"id":"clock","before":"2026-11-23T03:18:30","after":"2026-11-23T05:19:20"}"#;
    assert!(json.contains(clock), "{json}");
}

#[test]
fn a_clock_in_bcd_is_never_written() {
    play(
        "datakom-dkg705",
        "set_clock",
        &[],
        "read clock_year=0x26 clock_month=0x11 clock_day=0x23 clock_hour=0x03 clock_minute=0x18 clock_second=0x30
         refused 0 Nothing was sent: Clock year (two digits) is 38, and must be 26.",
    );
    let script = format!(
        "read {CLOCK} clock_month=17
         refused 0 Nothing was sent: Clock month is 17, and must be 1 to 12."
    );
    play("datakom-dkg705", "set_clock", &[], &script);
}

/// Neither clock may turn a minute while it is written: 23:59:50 waits until after midnight, and writes the new day.
#[test]
fn the_end_of_a_minute_is_waited_for() {
    let mut bench = Bench::new("datakom-dkg705", "set_clock", &[("time", "2026-11-30T23:59:50")]);
    let start: DateTime = "2026-11-30T23:59:50".parse().unwrap();
    let mut writes = Vec::new();
    let report = loop {
        // The unit's clock runs, and is right already.
        let unit = start.plus(bench.elapsed());
        for (id, part) in [
            ("clock_year", TimePart::Year),
            ("clock_month", TimePart::Month),
            ("clock_day", TimePart::Day),
            ("clock_hour", TimePart::Hour),
            ("clock_minute", TimePart::Minute),
            ("clock_second", TimePart::Second),
        ] {
            bench.world.set(id, None, u32::from(unit.part(part)));
        }
        match bench.ask() {
            Next::Read(points) => bench.answer(&points, None),
            Next::Write(frame) => {
                writes.push(frame.value);
                bench.outcome(WriteOutcome::Acknowledged);
            }
            Next::Done(report) => break report,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(report.verdict, Verdict::Done, "{}", report.reason);
    assert_eq!(writes[..5], [26, 12, 1, 0, 0]);
    assert!((5..=16).contains(&writes[5]), "{writes:?}");
    assert_eq!(report.sent, 6);
}

#[test]
fn a_moment_that_does_not_come_sends_nothing() {
    let script = "read* clock_year=26 clock_month=11 clock_day=23 clock_second=50
         refused 0 Nothing was sent: the moment for it did not come within 60 s: Clock second is 50 s.";
    play("datakom-dkg705", "set_clock", &[], script);
}

#[test]
fn a_clock_half_set_is_told() {
    let script = format!(
        "read {CLOCK}
         write 6 0x24 26 ack
         read
         write 6 0x25 11 lost
         read silent
         read
         write 6 0x26 23 ack
         read
         write 6 0x27 5 exception 10
         read
         no_effect 4 The device refused step 4 of 6 with exception 10 (write protection); Clock hour is 3 h."
    );
    play("datakom-dkg705", "set_clock", &[], &script);
    let script = format!(
        "read {CLOCK}
         write 6 0x24 26 ack
         read
         write 6 0x25 11 ack
         read
         write 6 0x26 23 ack
         read
         write 6 0x27 5 ack
         read*
         no_effect 4 The device acknowledged step 4 of 6, but Clock hour stayed 3 h for 2 s."
    );
    play("datakom-dkg705", "set_clock", &[], &script);
    let script = format!(
        "read {CLOCK}
         write 6 0x24 26 ack
         read
         write 6 0x25 11 unsent
         no_effect 1 Step 2 of 6 was not sent: the write did not leave, the wire is down."
    );
    play("datakom-dkg705", "set_clock", &[], &script);
}

/// Another unit's clock, or somebody who turns it back at the panel.
#[test]
fn the_clock_must_be_right_at_the_end() {
    let script = format!(
        "read {CLOCK}
         write 6 0x24 26 ack
         read
         write 6 0x25 11 ack
         read
         write 6 0x26 23 ack
         read
         write 6 0x27 5 ack
         read clock_hour=5
         write 6 0x28 19 ack
         read clock_minute=19
         write 6 0x29 20 lost
         read* clock_hour=4 clock_second=21
         no_effect 6 The answer to step 6 of 6 was lost, and clock is 2026-11-23T04:19:21, not the time that was asked for."
    );
    play("datakom-dkg705", "set_clock", &[], &script);
}

#[test]
fn a_time_is_now_or_what_a_person_writes() {
    let command = builtin("datakom-dkg705").unwrap().command("set_clock").unwrap();
    let given = |text| command.arguments([("time", text)], local());
    assert_eq!(command.arguments([], local()), given("now"));
    assert_eq!(given("2026-11-23T05:19:20"), given("now"));
    assert_ne!(given("2026-11-23T05:19:21"), given("now"));
    let error = given("noon").unwrap_err();
    assert_eq!(
        error.to_string(),
        "`time` cannot be `noon`; write now, or a local time as 2026-11-23T05:19:51"
    );
    let channel = builtin("datakom-d").unwrap().command("channel").unwrap();
    let given = |args: &[(&'static str, &'static str)]| channel.arguments(args.iter().copied(), local());
    assert_eq!(given(&[]).unwrap_err().to_string(), "`channel` is not given; write a number from 0 to 19");
    assert!(matches!(given(&[("channel", "20")]), Err(ArgError::Value { .. })));
    assert!(matches!(given(&[("channel", "1"), ("channel", "2")]), Err(ArgError::Twice { .. })));
    assert_eq!(
        given(&[("chanel", "1")]).unwrap_err().to_string(),
        "there is no argument `chanel`; write one of: channel"
    );
}

#[test]
fn starting_runs_through_to_the_load() {
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 ack
         read
         read engine_running_status=1
         read engine_running_status=3
         read engine_running_status=6
         read engine_running_status=7
         read indicators.8=1
         write 5 3 0xFF00 ack
         read
         read indicators.6=1 indicators.8=0
         read engine_running_status=9
         done 2 Load indicator is on, Engine running status is Normal running.",
    );
}

/// The manual says to send the key again: that is for a person to decide.
#[test]
fn a_start_key_without_effect_is_not_repeated() {
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 ack
         read*
         at 10.2
         no_effect 1 The device acknowledged step 1 of 2, but Engine running status stayed Standby for 10 s.",
    );
}

#[test]
fn an_engine_that_runs_is_only_loaded() {
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read engine_running_status=8
         read
         write 5 3 0xFF00 ack
         read indicators.6=1 engine_running_status=9
         done 1 Load indicator is on, Engine running status is Normal running.",
    );
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read engine_running_status=9 indicators.6=1
         done 0 It is so already, and nothing was sent: Load indicator is on, Engine running status is Normal running.",
    );
}

/// Load and unload are one key: who loads at the panel while the engine warms up must not be undone.
#[test]
fn a_load_from_the_panel_is_not_undone() {
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 lost
         read engine_running_status=7
         read
         read indicators.6=1
         read engine_running_status=9
         done 1 Load indicator is on as it was before, Engine running status is Normal running.",
    );
}

#[test]
fn a_start_that_fails_is_never_loaded() {
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 ack
         read engine_running_status=3
         read engine_running_status=4
         read engine_running_status=0
         no_effect 1 Step 2 of 2 was not sent: Engine running status is Standby, and must be Preheat to Normal running.",
    );
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 ack
         read engine_running_status=3
         read* engine_running_status=5
         no_effect 1 Step 2 of 2 was not sent: the moment for it did not come within 300 s: Idle running status is off, \
         Engine running status is Safety on delay.",
    );
    play(
        "smartgen-acc1700",
        "start_and_load",
        &[],
        "read
         write 5 0 0xFF00 ack
         read engine_running_status=3
         read* silent
         unknown 1 Step 2 of 2 was not sent: the device does not answer the reading that comes before it.",
    );
}

#[test]
fn stopping_runs_through_to_standby() {
    play(
        "smartgen-acc1700",
        "stop_to_standby",
        &[],
        "read engine_running_status=9
         write 5 1 0xFF00 ack
         read common_status.11=1
         read engine_running_status=10
         read engine_running_status=13
         read engine_running_status=0
         done 1 In stop mode is on, Engine running status is Standby.",
    );
    play(
        "smartgen-acc1700",
        "stop_to_standby",
        &[],
        "read engine_running_status=9
         write 5 1 0xFF00 ack
         read*
         no_effect 1 The device acknowledged the write, but In stop mode stayed off for 5 s.",
    );
    play(
        "smartgen-acc1700",
        "stop_to_standby",
        &[],
        "read common_status.11=1 engine_running_status=12
         read
         read engine_running_status=0
         done 0 Engine running status is Standby.",
    );
}
