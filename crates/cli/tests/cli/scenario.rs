//! `emulate --scenario`: what is told, what is printed in the end, and the exit status, which makes it a test.

use std::{fs, path::Path};

use serde_json::json;

use crate::support::{Call, Service, busbar, call};

/// Two steps: a step test starts the engine, or not.
const TEST: &str = r#"
[scenario]
title = "A start"
controller = "datakom-d"
[[steps]]
at = "2s"
command = "test"
expect = "state.engine == cranking within 20s"
[[steps]]
when = "state.engine == cranking"
expect = "breaker.mains.closed"
"#;

fn play(text: &str, options: &str) -> Call {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.toml");
    fs::write(&file, text).unwrap();
    let fixed = "emulate datakom-d --listen tcp://127.0.0.1:0 --speed 1000 --scenario";
    call(fixed.split(' ').chain([file.to_str().unwrap()]).chain(options.split_whitespace()))
}

#[test]
fn one_that_holds_ends_with_0() {
    let call = play(TEST, "").ok();
    assert!(call.out().starts_with("tcp://127.0.0.1:") && call.out().lines().count() == 1, "{}", call.out());
    let told = call.err();
    let lines: Vec<&str> = told.lines().map(|line| line.trim_start().split_once(" s  ").unwrap().1).collect();
    assert_eq!(lines.first(), Some(&"A start: datakom-d, D-500, seed 1"));
    assert_eq!(lines.last(), Some(&"all 3 expectations held"));
    for line in ["command test", "  state.engine preheat (Engine preheat)", "held: breaker.mains.closed"] {
        assert!(lines.contains(&line), "no \"{line}\" in\n{told}");
    }
}

#[test]
fn one_that_fails_ends_with_1_and_says_what_was_seen_where() {
    let text = TEST.replace("within 20s", "within 5s");
    let call = play(&text, "").fails();
    let last = call.err().lines().last().unwrap().to_owned();
    assert!(
        last.starts_with("busbar: ")
            && last.ends_with(
                "a.toml:8:10: expected state.engine == cranking within 5s from 2.0 s on; at 7.0 s state.engine was preheat"
            ),
        "{last}"
    );
}

#[test]
fn programs_get_one_document() {
    let document = play(TEST, "--json --seed 7 --model D-700").ok().json();
    assert!(document["urls"][0].as_str().unwrap().starts_with("tcp://127.0.0.1:"));
    for (key, value) in [
        ("title", json!("A start")),
        ("controller", json!("datakom-d")),
        ("model", json!("D-700")),
        ("seed", json!(7)),
        ("held", json!(true)),
        ("steps", json!(2)),
        ("taken", json!(2)),
    ] {
        assert_eq!(document[key], value, "{key}");
    }
    let cranks = &document["checks"][1];
    assert_eq!(cranks["expected"], "state.engine == cranking within 20s");
    assert_eq!(cranks["verdict"], "held");
    assert_eq!((&cranks["line"], &cranks["since_s"]), (&json!(8), &json!(2.0)));
    assert_eq!(cranks["seen"], json!([{ "name": "state.engine", "value": "cranking" }]));
    assert_eq!(
        document["events"][0],
        json!({ "at_s": 2.0, "kind": "action", "line": 5, "text": "command test" })
    );

    let failed = play(&TEST.replace("within 20s", "within 5s"), "--json").fails().json();
    assert_eq!(failed["held"], json!(false));
    assert_eq!(failed["checks"][1]["seen"], json!([{ "name": "state.engine", "value": "preheat" }]));
}

#[test]
fn a_wrong_file_is_a_wrong_call() {
    let wrong = TEST.replace("command", "comand").replace("== cranking\"", "== crank\"");
    play(&wrong, "")
        .refuses()
        .mentions("a.toml:7:1: the plant of datakom-d has no `comand`")
        .mentions("did you mean `command`?")
        .mentions("a.toml:10:25: `state.engine` is never `crank`");
    let other = "[scenario]\ntitle = \"Air\"\ncontroller = \"smartgen-acc1700\"\n[[steps]]\nat = \"1s\"\ncommand = \"start\"\n";
    play(other, "").refuses().says_in_one_sentence(
        "a.toml:3:14: this scenario is for smartgen-acc1700, not for datakom-d; imitate smartgen-acc1700, or choose another one",
    );
    busbar("emulate datakom-d --listen tcp://127.0.0.1:0 --scenario /no/such/file.toml")
        .refuses()
        .says_in_one_sentence(
            "scenario file /no/such/file.toml cannot be read: there is no such file; check the path",
        );
}

#[test]
fn a_client_can_watch_while_it_plays() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenarios/weekly-test.toml");
    let arguments = "emulate datakom-d --listen tcp://127.0.0.1:0 --scenario".split(' ');
    let mut service = Service::start(arguments.chain([file.to_str().unwrap()]));
    let url = service.line();
    let read = busbar(&format!("read datakom-d --from {} unit_mode --json", url.trim())).ok().json();
    assert_eq!(read[0]["value"], "AUTO");
    let (status, told) = service.signal("INT");
    assert_eq!(status, Some(0), "Ctrl-C is no failed expectation");
    assert!(told.ends_with("busbar: the scenario was stopped before its end\n"), "{told}");
}

#[test]
fn the_call_has_the_last_word() {
    let late = TEST.replace(
        "controller = \"datakom-d\"",
        "controller = \"datakom-d\"\nsettings = { preheat_time = 60 }",
    );
    play(&late, "").fails();
    play(&late, "--set preheat_time=1").ok();
}
