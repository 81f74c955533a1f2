//! Every scenario that is shipped, played to its end: each is a test of the controller that it is for.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use busbar_emulator::{Report, Scenario};

/// A test a file, named like it.
macro_rules! scenarios {
    ($($name:ident: $file:literal,)+) => {
        $(
            #[test]
            fn $name() {
                holds($file);
            }
        )+

        const PLAYED: &[&str] = &[$($file),+];
    };
}

scenarios! {
    mains_failure_and_return: "mains-failure.toml",
    short_dip_that_must_not_start: "short-dip.toml",
    start_on_the_third_attempt: "third-attempt.toml",
    fail_to_start: "fail-to-start.toml",
    low_oil_pressure_shutdown: "low-oil-pressure.toml",
    overheating: "overheating.toml",
    overload_load_dump: "overload.toml",
    breaker_that_will_not_close: "breaker-will-not-close.toml",
    fuel_running_out: "fuel-running-out.toml",
    battery_dying: "battery-dying.toml",
    weekly_test_under_load: "weekly-test.toml",
    emergency_stop: "emergency-stop.toml",
    remote_start: "remote-start.toml",
    synchronised_soft_transfer: "soft-transfer.toml",
    peak_lopping: "peak-lopping.toml",
    loss_of_mains: "loss-of-mains.toml",
    by_hand: "by-hand.toml",
    contacts: "contacts.toml",
    dkg705_mains_failure: "dkg705-mains-failure.toml",
    dkg705_short_dip: "dkg705-short-dip.toml",
    dkg705_soft_transfer: "dkg705-soft-transfer.toml",
    governor_that_runs_away: "governor-fault.toml",
    voltage_regulator_that_fails: "avr-fault.toml",
    mains_breaker_that_refuses: "mains-breaker-fault.toml",
    dead_line_in_parallel: "dead-line.toml",
    alarm_under_load: "alarm-under-load.toml",
    injected_alarms: "injected-alarms.toml",
    bus_tie_with_one_source_dead: "bus-tie.toml",
    tie_that_will_not_close: "tie-will-not-close.toml",
    load_shedding_stepwise: "load-shedding.toml",
    both_sources_dead: "both-sources-dead.toml",
    switch_in_test_position: "switch-in-test-position.toml",
    remote_transfer: "remote-transfer.toml",
    forced_opening_with_a_switch_that_jams: "forced-open.toml",
    genset_that_is_asked_for_too_much: "genset-overloaded.toml",
    dkg705_weekly_exercise: "dkg705-weekly-exercise.toml",
    dkg705_out_of_step: "dkg705-out-of-step.toml",
    dkg705_runaway: "dkg705-runaway.toml",
    dkg705_stuck_mains_contactor: "dkg705-stuck-mains-contactor.toml",
    dkg705_load_shedding: "dkg705-load-shedding.toml",
    dkg705_two_attempts: "dkg705-two-attempts.toml",
    compressor_day: "compressor-day.toml",
    compressor_hot_discharge: "compressor-hot-discharge.toml",
    compressor_locked: "compressor-locked.toml",
    compressor_blind_start: "compressor-blind-start.toml",
    compressor_particle_filter: "compressor-particle-filter.toml",
    compressor_filter_neglected: "compressor-filter-neglected.toml",
    compressor_blow_down_blocked: "compressor-blow-down-blocked.toml",
    compressor_cold_morning: "compressor-cold-morning.toml",
    compressor_overloaded: "compressor-overloaded.toml",
    compressor_will_not_stop: "compressor-will-not-stop.toml",
}

#[test]
fn every_file_is_played() {
    let files = fs::read_dir(folder()).unwrap();
    let names: BTreeSet<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(names, PLAYED.iter().map(|name| (*name).to_owned()).collect());
}

#[test]
fn the_documentation_lists_every_file() {
    let page = fs::read_to_string(root().join("docs/scenarios.md")).unwrap();
    for name in PLAYED {
        let text = fs::read_to_string(folder().join(name)).unwrap();
        let scenario = Scenario::parse(name, &text).unwrap();
        let row = format!("| `{name}` | `{}` | {} |", scenario.controller(), scenario.title());
        assert!(page.contains(&row), "docs/scenarios.md lacks this row:\n{row}");
    }
}

#[test]
fn the_example_of_the_documentation_holds() {
    let page = fs::read_to_string(root().join("docs/scenarios.md")).unwrap();
    let (_, rest) = page.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    assert_held(&play("docs/scenarios.md", text));
}

fn holds(file: &str) {
    let text = fs::read_to_string(folder().join(file)).unwrap();
    assert_held(&play(file, &text));
}

fn play(file: &str, text: &str) -> Report {
    Scenario::parse(file, text).unwrap_or_else(|findings| panic!("{findings}")).play().unwrap()
}

#[track_caller]
fn assert_held(report: &Report) {
    let failures: Vec<_> = report.failures().map(|check| report.sentence(check)).collect();
    let told: Vec<_> =
        report.events.iter().map(|event| format!("{:>8} s  {}", event.seconds(), event.text)).collect();
    assert!(failures.is_empty(), "{}\n\n{}", failures.join("\n"), told.join("\n"));
    assert_eq!((report.held, report.taken), (Some(true), report.steps));
    assert!(report.checks.len() > 2, "a scenario that expects next to nothing is no test");
}

fn folder() -> PathBuf {
    root().join("examples/scenarios")
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
