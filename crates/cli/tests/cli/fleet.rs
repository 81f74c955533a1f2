//! `emulate --fleet`: several controllers of one file, whose plants may be joined.

use std::{fs, path::Path};

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::{Service, busbar, call, write};

/// Two gensets on one bus bar, on ports of the system's choice.
const TWO: &str = r#"
[fleet]
title = "Two gensets"
[[wires]]
id = "a"
endpoint = "tcp://127.0.0.1:0"
[[wires]]
id = "b"
endpoint = "rtu+tcp://127.0.0.1:0"
[[controllers]]
id = "genset-1"
profile = "datakom-d"
wire = "a"
levers = { mains = "failed" }
[[controllers]]
id = "genset-2"
profile = "datakom-dkg705"
wire = "b"
[[bus_bars]]
gensets = ["genset-1", "genset-2"]
"#;

/// With the folder of its file, which is read before the first line is printed.
fn started(text: &str, options: &str) -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "fleet.toml", text);
    let arguments = ["emulate", "--fleet", &file].into_iter().chain(options.split_whitespace());
    let service = Service::start(arguments);
    (folder, service)
}

#[test]
fn the_urls_come_first_and_then_who_answers_there() {
    let (_folder, mut service) = started(TWO, "--speed 100 --control 127.0.0.1:0");
    let (tcp, rtu) = (service.line(), service.line());
    assert!(tcp.starts_with("tcp://127.0.0.1:") && rtu.starts_with("rtu+tcp://127.0.0.1:"), "{tcp} {rtu}");
    assert_eq!(service.line(), format!("genset-1        Datakom D-500        {tcp}, unit 1"));
    assert_eq!(service.line(), format!("genset-2        Datakom DKG-705      {rtu}, unit 1"));
    assert!(service.line().starts_with("control http://127.0.0.1:"));
    // The voltage is gone a moment after power-on.
    let voltage = || {
        busbar(&format!("read datakom-d --from {tcp} mains_l1_voltage --json")).ok().json()[0]["value"]
            .clone()
    };
    assert!((0..50).any(|_| voltage() == json!(0)), "the file's levers are pulled");
    busbar(&format!("read datakom-dkg705 --from {rtu} --unit 1 mains_l1_voltage")).ok();
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn programs_get_one_document() {
    let (_folder, mut service) = started(TWO, "--json");
    let document: Value = serde_json::from_str(&service.line()).unwrap();
    let urls = document["urls"].as_array().unwrap();
    assert_eq!(urls.len(), 2);
    let [first, second] = [&document["controllers"][0], &document["controllers"][1]];
    let expected =
        json!({ "id": "genset-1", "profile": "datakom-d", "model": "D-500", "endpoint": urls[0], "unit": 1 });
    assert_eq!(*first, expected);
    assert_eq!((&second["id"], &second["endpoint"]), (&json!("genset-2"), &urls[1]));
}

#[test]
fn what_is_shipped_starts() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/fleets");
    for file in fs::read_dir(folder).unwrap() {
        let text = fs::read_to_string(file.unwrap().path()).unwrap();
        let free =
            text.replace("127.0.0.1:1502\"", "127.0.0.1:0\"").replace("127.0.0.1:1503\"", "127.0.0.1:0\"");
        assert_ne!(free, text);
        let (_folder, mut service) = started(&free, "--seed 3");
        assert!(service.line().starts_with("tcp://127.0.0.1:"));
    }
}

#[test]
fn what_is_wrong_is_said_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "fleet.toml", &TWO.replace("\"genset-2\"]", "\"genset-3\"]"));
    let refused = call(["emulate", "--fleet", &file]).refuses();
    let said = refused.err();
    assert!(said.contains("fleet.toml:20:24: there is no controller `genset-3`"), "{said}");
    assert!(said.contains("there is: genset-1, genset-2"), "{said}");
    call(["emulate", "--fleet", "/no/such.toml"]).refuses().says_in_one_sentence("/no/such.toml");
    for rest in ["datakom-d", "--listen tcp://127.0.0.1:0", "--unit 3", "--set load=3", "--scenario x.toml"] {
        busbar(&format!("emulate --fleet {file} {rest}")).refuses().mentions("cannot be used with");
    }
    busbar("emulate --listen tcp://127.0.0.1:0").refuses().mentions("KEY");
}
