//! `busbar watch` for programs and in a pipe; `pty` has what people see on a terminal.

use std::{
    process::Stdio,
    sync::{
        Arc,
        atomic::{AtomicU16, Ordering},
    },
};

use serde_json::{Value, json};

use crate::{
    peer::Peer,
    support::{Service, command, d500},
};

fn watch(arguments: &str) -> Service {
    Service::start(format!("watch {arguments}").split_whitespace())
}

/// A device whose register 10363 counts the reads.
fn counting() -> Peer {
    let count = Arc::new(AtomicU16::new(0));
    Peer::new(move |request| {
        let count = count.fetch_add(1, Ordering::SeqCst);
        request.registers(&vec![count; request.count.into()])
    })
}

#[test]
fn json_is_one_document_a_round() {
    let (_device, url) = d500("--set fuel_level=12.5");
    let mut service = watch(&format!("datakom-d --from {url} --json --every 50ms unit_mode fuel_level"));
    for _ in 0..3 {
        let line = service.line();
        let readings: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(readings.as_array().unwrap().len(), 2, "the identity is read and not told");
        assert_eq!((&readings[0]["value"], &readings[1]["value"]), (&json!(12.5), &json!("AUTO")));
        assert!(
            readings[0]["ts"].is_string() && line.starts_with("[{\"id\":\"fuel_level\",\"address\":10363,")
        );
    }
    assert_eq!(service.signal("INT"), (Some(0), String::new()));
}

#[test]
fn all_points_come_at_the_rates_of_the_profile() {
    let (_device, url) = d500("");
    let mut service = watch(&format!("datakom-d --from {url} --json --every 50ms"));
    let mut ids = || -> Vec<String> {
        let readings: Value = serde_json::from_str(&service.line()).unwrap();
        let ids =
            readings.as_array().unwrap().iter().map(|reading| reading["id"].as_str().unwrap().to_owned());
        ids.collect()
    };
    let has = |ids: &[String], id: &str| ids.iter().any(|other| other == id);
    let (first, second) = (ids(), ids());
    for id in ["genset_frequency", "engine_hours", "device_identity"] {
        assert!(has(&first, id), "{id}");
    }
    assert!(has(&second, "genset_frequency"));
    assert!(!has(&second, "engine_hours") && !has(&second, "device_identity"));
    assert!(!has(&first, "lcd"), "the picture only when it is named");
}

#[test]
fn a_pipe_gets_a_line_a_change() {
    let peer = counting();
    let mut service = watch(&format!("datakom-d --from {} --every 20ms fuel_level", peer.url));
    for expected in ["fuel_level  0 %", "fuel_level  0.1 %", "fuel_level  0.2 %"] {
        let line = service.line();
        let (ts, rest) = line.split_once("  ").unwrap();
        assert!(ts.len() == 24 && ts.ends_with('Z'), "{line}");
        assert_eq!(rest, expected);
    }
    assert_eq!(service.signal("INT"), (Some(0), String::new()));

    // What stays as it is gets one line: the next one is of a point that changes.
    let (_device, url) = d500("--set fuel_level=12.5 --set unit_mode=STOP");
    let mut service = watch(&format!("datakom-d --from {url} --every 20ms fuel_level unit_mode genset_runs"));
    let lines = [service.line(), service.line(), service.line()];
    assert!(lines.iter().any(|line| line.ends_with("unit_mode  STOP")), "{lines:?}");
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn who_falls_silent_is_stale_and_who_comes_back_is_good() {
    let count = Arc::new(AtomicU16::new(0));
    let peer = Peer::new(move |request| match count.fetch_add(1, Ordering::SeqCst) {
        0 | 5.. => request.registers(&vec![125; request.count.into()]),
        _ => Vec::new(),
    });
    let mut service =
        watch(&format!("datakom-d --from {} --every 20ms --timeout 100ms fuel_level", peer.url));
    assert!(service.line().ends_with("fuel_level  12.5 %"));
    assert!(service.line().ends_with("fuel_level  12.5 %  (stale)"));
    assert!(service.line().ends_with("fuel_level  12.5 %"));
    let (status, err) = service.signal("INT");
    assert_eq!(status, Some(0));
    assert!(err.contains("did not answer within 100ms"), "{err}");
    assert!(err.contains("docs/connect/datakom-d.md tells more"), "{err}");
    assert!(err.ends_with("busbar: unit 1 answers again\n"), "{err}");
}

#[test]
fn who_was_never_there_is_waited_for() {
    let mut service = watch("datakom-d --from tcp://127.0.0.1:1 --every 20ms --json fuel_level");
    for _ in 0..2 {
        let readings: Value = serde_json::from_str(&service.line()).unwrap();
        assert_eq!((&readings[0]["quality"], &readings[0]["value"]), (&json!("bad"), &Value::Null));
        assert!(readings[0]["error"].as_str().unwrap().contains("127.0.0.1:1"));
    }
    let (status, err) = service.signal("TERM");
    assert_eq!(status, Some(0));
    assert!(err.contains("127.0.0.1:1"), "{err}");
}

#[test]
fn an_exception_is_bad_and_the_others_go_on() {
    let peer = Peer::new(|request| match request.address {
        10605 => request.exception(10),
        _ => request.addresses(),
    });
    let mut service =
        watch(&format!("datakom-d --from {} --every 20ms --json unit_mode fuel_level", peer.url));
    for _ in 0..2 {
        let readings: Value = serde_json::from_str(&service.line()).unwrap();
        assert_eq!(readings[0]["quality"], json!("good"));
        assert_eq!((&readings[1]["quality"], &readings[1]["value"]), (&json!("bad"), &Value::Null));
        assert!(readings[1]["error"].as_str().unwrap().contains("exception 10 (write protection)"));
    }
}

#[test]
fn a_reader_that_has_seen_enough_ends_it_quietly() {
    let peer = counting();
    let mut child = command()
        .args(["watch", "datakom-d", "--from", &peer.url, "--every", "20ms", "fuel_level"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()));
}
