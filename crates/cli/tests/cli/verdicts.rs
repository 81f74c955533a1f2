//! What `busbar command` says of every command of the four controllers, each against its imitation.

use std::time::{Duration, Instant};

use busbar_profile::command::{Command, Proof};
use serde_json::Value;

use crate::support::{Service, busbar};

/// One imitation and what happens to it, in this order.
struct Story {
    profile: &'static str,
    /// For `busbar emulate`; without `--listen` it is one over TCP.
    options: &'static str,
    /// `COMMAND [ARG=VALUE]: VERDICT SENT`, or `until POINT=VALUE` to wait for the plant. `done!` where the state must
    /// have been another one before.
    steps: &'static [&'static str],
}

const STORIES: [Story; 20] = [
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
            "manual: done! 1",
            "auto: done! 1",
            "s1_master: done 1",
            "s2_master: done 1",
            "genset_start: done! 1",
            "genset_stop: done! 1",
            "alarm_reset: done 1",
            "transfer_000: done! 1",
            "transfer_110: unknown 1",
            "until ats_status=22",
            "transfer_011: unknown 1",
            "until ats_status=23",
            "transfer_100: unknown 1",
            "until ats_status=16",
            "transfer_001: unknown 1",
            "until ats_status=17",
            "transfer_101: unknown 1",
            "until ats_status=24",
        ],
    },
    // In manual mode the load switches that fell come back when somebody confirms it, and stay open when he cancels.
    Story {
        profile: "smartgen-hat821si",
        options: "--speed 20",
        steps: &[
            "manual: done! 1",
            "transfer_000: done! 1",
            "transfer_101: unknown 1",
            "until controls_and_inhibits=Stepwise transfer manual pop-up",
            "window_confirm: done! 1",
            "until load_1_closed=LOAD1 ATS12 closed",
            "transfer_000: done! 1",
            "transfer_101: unknown 1",
            "until controls_and_inhibits=Stepwise transfer manual pop-up",
            "window_cancel: done! 1",
            "load_1_1_close: done! 1",
            "load_1_2_open: done 1",
        ],
    },
    // No load switch closes on a section without voltage.
    Story {
        profile: "smartgen-hat821si",
        options: "--speed 20",
        steps: &["manual: done! 1", "transfer_000: done! 1", "load_2_12_close: no_effect 1"],
    },
    // A unit that does not follow, and an alarm whose cause stays.
    Story {
        profile: "smartgen-hat821si",
        options: "--set common_status=common_alarm,s1_master,remote_control_mode",
        steps: &[
            "manual: done 1",
            "auto: no_effect 1",
            "s1_master: done 1",
            "s2_master: no_effect 1",
            "alarm_reset: no_effect 1",
        ],
    },
    // The same truth on a serial line.
    Story {
        profile: "smartgen-hat821si",
        options: "--speed 20 --listen rtu://pty?baud=19200",
        steps: &[
            "manual: done! 1",
            "auto: done! 1",
            "load_2_12_open: done! 1",
            "load_2_12_close: done! 1",
            "remote_output_13: unknown 1",
            "transfer_000: done! 1",
        ],
    },
    Story {
        profile: "smartgen-acc1700",
        options: "--speed 20 --listen rtu://pty",
        steps: &["start_and_load: done! 2", "unload: done! 1", "stop_to_standby: done! 1"],
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
            "start: done! 1",
            "until engine_running_status=8",
            "load: done! 1",
            "load: done 0",
            "unload: done! 1",
            "stop: done! 1",
        ],
    },
    Story {
        profile: "smartgen-acc1700",
        options: "",
        steps: &[
            "lock: done! 1",
            // Locked, the start key is dead; the stop key is not.
            "start: no_effect 1",
            "stop: done 1",
            "unlock: done! 1",
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
        steps: &["start_and_load: done! 2", "start_and_load: done 0", "stop_to_standby: done! 1"],
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

/// 24 load switches and 13 remote outputs: each by the proof that its command has, load switches open before they close.
#[test]
fn every_load_switch_and_output_tells_its_own_truth() {
    const IMITATIONS: usize = 8;
    let profile = busbar_profile::builtin("smartgen-hat821si").unwrap();
    let mut alike: Vec<&Command> = profile.commands.iter().filter(|command| is_alike(&command.id)).collect();
    assert_eq!(alike.len(), 24 + 24 + 13);
    let order = ["_open", "_close"];
    alike
        .sort_by_key(|command| order.iter().position(|end| command.id.ends_with(end)).unwrap_or(order.len()));
    std::thread::scope(|threads| {
        for number in 0..IMITATIONS {
            // The two commands of a switch are 24 apart, so that they fall to one imitation.
            let own: Vec<&Command> = alike.iter().skip(number).step_by(IMITATIONS).copied().collect();
            threads.spawn(move || {
                let mut device = Service::start(emulation(&profile.key, "--speed 20").split_whitespace());
                let wire = format!("--to {}", device.line());
                for command in own {
                    let expected = match command.proof {
                        Proof::None { .. } => "unknown 1",
                        _ => "done! 1",
                    };
                    check(&profile.key, &wire, &format!("{}: {expected}", command.id));
                }
            });
        }
    });
}

/// One of the many commands of a HAT821SI that differ in their number only.
fn is_alike(command: &str) -> bool {
    ["load_1_", "load_2_", "remote_output_"].iter().any(|start| command.starts_with(start))
}

#[test]
fn every_command_has_its_row() {
    for profile in busbar_profile::builtins() {
        for command in &profile.commands {
            let stories = STORIES.iter().filter(|story| story.profile == profile.key);
            let mut told = stories.flat_map(|story| story.steps).filter_map(|step| step.split_once(':'));
            let has_row = told.any(|(call, _)| call.split(' ').next() == Some(command.id.as_str()));
            assert!(has_row || is_alike(&command.id), "{} of {} has no row", command.id, profile.key);
        }
    }
}

impl Story {
    fn play(&self) {
        let Self { profile, options, steps } = self;
        let mut device = Service::start(emulation(profile, options).split_whitespace());
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

fn emulation(profile: &str, options: &str) -> String {
    let listen = if options.contains("--listen") { "" } else { "--listen tcp://127.0.0.1:0" };
    format!("emulate {profile} {listen} {options}")
}

/// Waits until the point has this value, code or bit.
fn wait_until(profile: &str, wire: &str, state: &str) {
    let (point, value) = state.split_once('=').unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        let reading = busbar(&format!("read {profile} {point} {wire} --json")).ok().json()[0].clone();
        let has_bit =
            reading["value"].as_array().is_some_and(|labels| labels.iter().any(|label| label == value));
        if has_bit
            || reading["value"] == value
            || value.parse::<u32>().is_ok_and(|code| reading["code"] == code)
        {
            return;
        }
        assert!(Instant::now() < deadline, "{point} never is {value}: {reading}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn check(profile: &str, wire: &str, step: &str) {
    let (call, expected) = step.split_once(": ").unwrap();
    let changes = expected.contains('!');
    let expected = expected.replace('!', "");
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
    let changed = report["evidence"].as_array().unwrap().iter().any(|seen| seen["before"] != seen["after"]);
    assert!(!changes || changed, "it was so before: {report}");
    assert!(
        expected.starts_with("unknown") || !report["evidence"].as_array().unwrap().is_empty(),
        "{report}"
    );
}
