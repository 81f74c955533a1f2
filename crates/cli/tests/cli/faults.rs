//! `emulate --faults`: what goes wrong on a wire, and that a client of ours neither believes nor repeats what it must not.

use std::path::Path;

use serde_json::Value;

use crate::support::{Call, Service, busbar, call, write};

/// A D-500 behind a converter, where answers have a check sum.
fn with_faults(text: &str) -> (Service, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "faults.toml", text);
    let listen = ["emulate", "datakom-d", "--listen", "rtu+tcp://127.0.0.1:0", "--faults", &file];
    let mut service = Service::start(listen);
    let url = service.line();
    (service, url)
}

fn fault(kind: &str) -> String {
    format!("[[faults]]\nkind = {kind}\n")
}

/// What a read of one point says under a fault.
fn read(fault: &str) -> Call {
    let (_service, url) = with_faults(fault);
    busbar(&format!("read datakom-d --from {url} --timeout 300ms battery_voltage --json"))
}

#[test]
fn a_read_is_asked_again_and_what_is_wrong_is_never_a_value() {
    for kind in ["unheard", "unanswered", "garbled", "cut", "other_unit", "other_function", "hang_up"] {
        let always = fault(&format!("\"{kind}\"\nevery = 1"));
        let reading = &read(&always).fails().json()[0];
        assert_eq!((&reading["value"], &reading["quality"]), (&Value::Null, &Value::from("bad")), "{kind}");
        let reading = &read(&(always + "times = 1\n")).ok().json()[0];
        let volts = reading["value"].as_f64().unwrap();
        assert!((20.0..30.0).contains(&volts), "{kind}: {volts}");
    }
    let reading = &read(&fault("\"noise\"\nevery = 1")).ok().json()[0];
    assert_eq!(reading["quality"], "good", "an answer is found behind stray bytes");
    let refused = &read(&fault("\"exception\"\ncode = 4\nevery = 1")).fails().json()[0];
    assert_eq!((&refused["value"], &refused["quality"]), (&Value::Null, &Value::from("bad")));
}

#[test]
fn a_command_whose_answer_is_lost_is_sent_once_and_proved_by_reading() {
    let lost = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/faults/lost-answer.toml");
    let lost = lost.to_str().unwrap();
    let listen = ["emulate", "datakom-d", "--listen", "tcp://127.0.0.1:0", "--faults", lost];
    let mut service = Service::start(listen);
    let url = service.line();
    let done = busbar(&format!("command datakom-d test --to {url} --yes --json"));
    let verdict = done.json();
    assert_eq!((&verdict["sent"], verdict["verdict"].as_str()), (&Value::from(1), Some("done")), "{verdict}");
}

#[test]
fn what_is_wrong_is_said_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "faults.toml", &fault("\"silence\"\nevery = 1"));
    let said =
        call(["emulate", "datakom-d", "--listen", "tcp://127.0.0.1:0", "--faults", &file]).refuses().err();
    assert!(said.contains("faults.toml:2:8: there is no fault `silence`"), "{said}");
    let poor = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/faults/poor-line.toml");
    let listen = "emulate smartgen-hat821si --listen rtu+tcp://127.0.0.1:0 --faults";
    let mut service = Service::start(listen.split(' ').chain([poor.to_str().unwrap()]));
    assert!(service.line().starts_with("rtu+tcp://"));
}
