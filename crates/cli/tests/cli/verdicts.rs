//! What `busbar command` says of every command of the four controllers, each against its imitation.

use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{Service, busbar};

/// One imitation and what happens to it, in this order.
struct Story {
    profile: &'static str,
    /// For `busbar emulate`.
    options: &'static str,
    /// `COMMAND [ARG=VALUE]: VERDICT SENT`, or `until POINT=VALUE` to wait for the plant.
    steps: &'static [&'static str],
}

const STORIES: [Story; 15] = [
    Story {
        profile: "datakom-d",
        options: "--model D-500 --speed 20",
        steps: &[
            "stop: done 1",
            "auto: done 1",
            "test: done 1",
            "auto: done 1",
            "channel channel=0: done 1",
            "channel channel=19: done 1",
            "manual: refused 0",
            "menu_next: unknown 1",
            "menu_next press=long: unknown 1",
            "menu_previous press=very_long: unknown 1",
            "up: unknown 1",
            "down press=short: unknown 1",
            "run: done 1",
            "until operation_status=Running off load",
            "gcb: done 1",
            "mcb press=short: done 1",
            "auto: done 1",
        ],
    },
    // At twenty times the pace the restart would be over between two looks.
    Story { profile: "datakom-d", options: "", steps: &["reset: done 1", "stop: done 1"] },
    Story { profile: "datakom-d", options: "--model D-545", steps: &["run: done 1", "manual: refused 0"] },
    Story { profile: "datakom-d", options: "--model D-700", steps: &["manual: done 1", "run: done 1"] },
    Story {
        profile: "datakom-d",
        options: "--model D-300",
        steps: &["run: refused 0", "manual: refused 0", "test: done 1"],
    },
    // A unit that does not follow.
    Story {
        profile: "datakom-d",
        options: "--set unit_mode=STOP",
        steps: &["stop: done 1", "auto: no_effect 1"],
    },
    Story {
        profile: "datakom-dkg705",
        options: "--unit 1",
        steps: &["auto: done 1", "off: done 1", "test: done 1", "load_test: done 1"],
    },
    Story { profile: "datakom-dkg705", options: "--unit 1", steps: &["set_clock: done 6"] },
    Story {
        profile: "smartgen-hat821si",
        options: "--speed 20",
        steps: &[
            "auto: done 1",
            "manual: done 1",
            "s1_master: done 1",
            "s2_master: done 1",
            "genset_start: done 1",
            "genset_stop: done 1",
            "alarm_reset: done 1",
            "transfer_000: done 1",
            "transfer_101: unknown 1",
            "transfer_110: unknown 1",
            "transfer_011: unknown 1",
            "transfer_100: unknown 1",
            "transfer_001: unknown 1",
            "load_1_1_close: done 1",
            "load_1_1_open: done 1",
            "load_2_12_close: done 1",
            "load_2_12_open: done 1",
            "remote_output_1: unknown 1",
            "remote_output_13: unknown 1",
            "window_confirm: done 1",
            "window_cancel: done 1",
        ],
    },
    Story {
        profile: "smartgen-hat821si",
        options: "--set common_status=none",
        steps: &["auto: refused 0", "load_1_1_close: refused 0"],
    },
    Story {
        profile: "smartgen-hat821si",
        options: "--set controls_and_inhibits=remote_inhibit_input",
        steps: &["genset_start: refused 0"],
    },
    Story {
        profile: "smartgen-acc1700",
        options: "--speed 20",
        steps: &[
            "unload: done 0",
            "start: done 1",
            "until engine_running_status=8",
            "load: done 1",
            "load: done 0",
            "unload: done 1",
            "stop: done 1",
        ],
    },
    Story {
        profile: "smartgen-acc1700",
        options: "",
        steps: &[
            "lock: done 1",
            "unlock: done 1",
            "down: unknown 1",
            "output_1: unknown 1",
            "output_2: unknown 1",
            "output_3: unknown 1",
            "output_4: unknown 1",
        ],
    },
    Story {
        profile: "smartgen-acc1700",
        options: "--speed 20",
        steps: &["start_and_load: done 2", "start_and_load: done 0", "stop_to_standby: done 1"],
    },
    // A key that is looked at first is not pressed where nobody can see the state.
    Story {
        profile: "smartgen-acc1700",
        options: "--set indicators=load_indicator",
        steps: &["load: done 0"],
    },
];

#[test]
fn every_verdict_is_true() {
    std::thread::scope(|threads| {
        for story in &STORIES {
            threads.spawn(|| story.play());
        }
    });
}

#[test]
fn every_command_has_its_row() {
    for profile in busbar_profile::builtins() {
        for command in &profile.commands {
            let stories = STORIES.iter().filter(|story| story.profile == profile.key);
            let mut told = stories.flat_map(|story| story.steps).filter_map(|step| step.split_once(':'));
            let has_row = told.any(|(call, _)| call.split(' ').next() == Some(command.id.as_str()));
            // 24 load switches and 13 outputs are alike: the first and the last of them speak for the others.
            let like_others = command.id.starts_with("load_1_")
                || command.id.starts_with("load_2_")
                || command.id.starts_with("remote_output_");
            assert!(has_row || like_others, "{} of {} has no row", command.id, profile.key);
        }
    }
}

impl Story {
    fn play(&self) {
        let Self { profile, options, steps } = self;
        let arguments = format!("emulate {profile} --listen tcp://127.0.0.1:0 {options}");
        let mut device = Service::start(arguments.split_whitespace());
        let url = device.line();
        let unit = if *profile == "datakom-dkg705" { "--unit 1" } else { "" };
        for step in *steps {
            match step.strip_prefix("until ") {
                Some(state) => wait_until(profile, &format!("--from {url} {unit}"), state),
                None => check(profile, &format!("--to {url} {unit}"), step),
            }
        }
    }
}

fn wait_until(profile: &str, wire: &str, state: &str) {
    let (point, value) = state.split_once('=').unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        let reading = busbar(&format!("read {profile} {point} {wire} --json")).ok().json()[0].clone();
        if reading["value"] == value || value.parse::<u32>().is_ok_and(|code| reading["code"] == code) {
            return;
        }
        assert!(Instant::now() < deadline, "{point} never is {value}: {reading}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn check(profile: &str, wire: &str, step: &str) {
    let (call, expected) = step.split_once(": ").unwrap();
    let call = busbar(&format!("command {profile} {call} {wire} --yes --json --timeout 500ms"));
    let report = call.json();
    assert_eq!(
        format!("{} {}", report["verdict"].as_str().unwrap(), report["sent"]),
        expected,
        "{profile} {step}: {report}"
    );
    let call = if expected.starts_with("done") { call.ok() } else { call.fails() };
    call.silently();
    for seen in report["evidence"].as_array().unwrap() {
        let keys: Vec<&String> = seen.as_object().unwrap().keys().collect();
        assert_eq!(keys, ["after", "before", "id", "ts"], "{report}");
        let after_or_before = if report["sent"] == 0 { "before" } else { "after" };
        assert_ne!(seen[after_or_before], Value::Null, "{report}");
    }
    assert!(
        expected.starts_with("unknown") || !report["evidence"].as_array().unwrap().is_empty(),
        "{report}"
    );
}
