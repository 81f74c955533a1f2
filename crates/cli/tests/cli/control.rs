//! `--control` and what the demonstration mounts: where it is told, who is let in, and that it does something.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::{
    services::{body, get},
    support::{Service, busbar, command},
};

const TOKEN: &str = "BUSBAR_CONTROL_TOKEN";

/// Sends a body to the control and gives back the whole answer.
fn put(page: &str, path: &str, content: &Value) -> String {
    let (address, folder) = page.trim_start_matches("http://").split_once('/').unwrap();
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let content = content.to_string();
    write!(
        stream,
        "PUT /{folder}api/v1/controllers/{path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\
         Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{content}",
        content.len()
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

/// Reads points until one is as wanted.
fn until(url: &str, point: &str, wanted: impl Fn(&Value) -> bool) {
    let deadline = Instant::now() + Duration::from_secs(30);
    loop {
        let readings = busbar(&format!("read datakom-d --from {url} {point} --json")).ok().json();
        if wanted(&readings[0]["value"]) {
            return;
        }
        assert!(Instant::now() < deadline, "{readings}");
    }
}

#[test]
fn emulate_is_controlled_where_it_says() {
    let call = "emulate datakom-d --listen tcp://127.0.0.1:0 --control 127.0.0.1:0 --json";
    let mut service = Service::start(call.split(' '));
    let bound: Value = serde_json::from_str(&service.line()).unwrap();
    let (url, page) = (bound["urls"][0].as_str().unwrap(), bound["control"].as_str().unwrap());
    assert!(page.starts_with("http://127.0.0.1:") && !page.contains(":0/"), "{page}");
    let one = body(&get(page, "/api/v1/controllers/datakom-d"));
    assert_eq!((&one["name"], &one["endpoints"]), (&json!("Datakom D-500"), &bound["urls"]));
    assert!(get(page, "/").contains("<title>Imitation</title>"));

    until(url, "mains_l1_voltage", |volts| volts.as_f64().unwrap() > 200.0);
    let answer = put(page, "datakom-d/levers/mains", &json!({ "position": "failed" }));
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    until(url, "mains_l1_voltage", |volts| volts.as_f64() == Some(0.0));
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn people_get_the_address_of_the_control_after_the_urls() {
    let call = "emulate datakom-d --listen tcp://127.0.0.1:0 --control localhost:0";
    let mut service = Service::start(call.split(' '));
    assert!(service.line().starts_with("tcp://127.0.0.1:"));
    let control = service.line();
    let page = control.strip_prefix("control ").unwrap();
    assert!(page.starts_with("http://127.0.0.1:") && page.ends_with('/'), "{control}");
    // Without the option nothing of it is there.
    let mut service = Service::start("emulate datakom-d --listen tcp://127.0.0.1:0 --json".split(' '));
    let bound: Value = serde_json::from_str(&service.line()).unwrap();
    assert_eq!(bound.as_object().unwrap().len(), 1, "{bound}");
}

#[test]
fn beyond_this_machine_it_wants_a_token_that_nobody_guesses() {
    let call = "emulate datakom-d --listen tcp://127.0.0.1:0 --control 0.0.0.0:0";
    busbar(call).refuses().says_in_one_sentence("does not listen on 0.0.0.0:0 without a token");
    let started = |token: &str| {
        let mut command = command();
        command.args(call.split(' ')).env(TOKEN, token);
        command
    };
    for wrong in ["short", "with spaces in all of it"] {
        let output = started(wrong).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("BUSBAR_CONTROL_TOKEN holds no token: a token has at least 16"), "{said}");
    }
    let mut service = Service::spawn(&mut started("nobody-guesses-this"));
    service.line();
    let page = service.line().replace("control ", "");
    assert!(get(&page, "/api/v1/controllers").starts_with("HTTP/1.1 401"));
    assert!(get(&page, "/").starts_with("HTTP/1.1 200"));
}

#[test]
fn demo_controls_every_controller_beside_its_page() {
    let mut service = Service::start("demo --listen 127.0.0.1:0 --json".split(' '));
    let shown: Value = serde_json::from_str(&service.line()).unwrap();
    let (page, imitation) = (shown["page"].as_str().unwrap(), shown["imitation"].as_str().unwrap());
    assert_eq!(imitation, format!("{page}imitation/"));
    let controllers = body(&get(page, "/imitation/api/v1/controllers"));
    let named = |of: &Value| -> Vec<Value> {
        let parts = |one: &Value| json!([one["id"], one["profile"], one["model"], one["unit"]]);
        of.as_array().unwrap().iter().map(parts).collect()
    };
    assert_eq!(named(&controllers), named(&shown["controllers"]));
    let answer = put(imitation, "genset-2/levers/mains", &json!({ "position": "failed" }));
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert_eq!(body(&get(page, "/api/v1/site"))["beside"][0]["path"], "imitation/");
}

#[test]
fn a_demonstration_for_the_network_is_looked_at_and_not_controlled() {
    let mut service = Service::start("demo --listen 0.0.0.0:0 --json".split(' '));
    let shown: Value = serde_json::from_str(&service.line()).unwrap();
    assert_eq!(shown["imitation"], Value::Null);
    let page = shown["page"].as_str().unwrap();
    assert!(get(page, "/imitation/").starts_with("HTTP/1.1 404"));
    let (status, said) = service.signal("INT");
    assert_eq!(status, Some(0));
    assert!(said.contains("the control does not listen on 0.0.0.0:0 without a token"), "{said}");
}
