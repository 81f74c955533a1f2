//! `busbar read` and `busbar registers` on a wire: what comes, and everything that may come instead.

use std::{
    net::{TcpListener, TcpStream},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::{
    peer::Peer,
    support::{busbar, call, d500, write},
};

/// A port of this machine on which nobody listens, and nobody else will: it is one end of a connection.
struct Nobody {
    url: String,
    _ends: (TcpListener, TcpStream),
}

impl Nobody {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        Self { url: format!("tcp://{}", stream.local_addr().unwrap()), _ends: (listener, stream) }
    }
}

#[test]
fn reads_all_points_of_a_d500() {
    let (_device, url) = d500("");
    let call = busbar(&format!("read datakom-d --from {url} --json")).ok().silently();
    let readings = call.json();
    let readings = readings.as_array().unwrap();
    let shown = busbar("profile show datakom-d --json").ok().json();
    let readable: Vec<&Value> = shown["points"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|point| point["access"] != "w")
        .map(|point| &point["id"])
        .collect();
    assert_eq!(readings.iter().map(|reading| &reading["id"]).collect::<Vec<_>>(), readable);
    for reading in readings {
        assert!(reading["quality"] == "good" || reading["quality"] == "invalid", "{reading}");
        assert!(reading["raw"].is_array() && reading.get("error").is_none(), "{reading}");
        let ts = reading["ts"].as_str().unwrap();
        assert!(ts.len() == 24 && ts.ends_with('Z'), "{ts}");
    }
}

#[test]
fn reads_named_points_in_address_order_each_once() {
    let (_device, url) = d500("--set fuel_level=12.5");
    let call =
        busbar(&format!("read datakom-d --from {url} --json unit_mode fuel_level unit_mode")).ok().silently();
    let readings = call.json();
    assert_eq!(readings[0]["id"], json!("fuel_level"));
    assert_eq!(readings[0]["value"], json!(12.5));
    assert_eq!(readings[1]["id"], json!("unit_mode"));
    assert_eq!(readings.as_array().unwrap().len(), 2);
    assert!(call.out().starts_with(
        r#"[{"id":"fuel_level","address":10363,"value":12.5,"unit":"%","quality":"good","raw":[125],"ts":""#
    ));
}

#[test]
fn people_get_groups_and_units() {
    let (_device, url) = d500("--set fuel_level=12.5 --set warning_alarms=none --set unit_mode=8");
    let call = busbar(&format!("read datakom-d --from {url} fuel_level warning_alarms unit_mode")).ok();
    insta::assert_snapshot!(call.out());
    call.says_in_one_sentence("3 points in ");
}

#[test]
fn a_label_may_depend_on_the_model() {
    let (_device, url) = d500("--set unit_mode=2");
    let reading = busbar(&format!("read datakom-d --from {url} unit_mode --json")).ok().json();
    assert_eq!(reading.as_array().unwrap().len(), 1, "the identity was read and is not told");
    assert_eq!(reading[0]["value"], json!("RUN"));
}

#[test]
fn registers_are_raw() {
    let peer = Peer::new(|request| request.addresses());
    busbar(&format!("registers {} 10240 3 --json", peer.url))
        .ok()
        .silently()
        .prints("{\"unit\":1,\"function\":3,\"address\":10240,\"registers\":[10240,10241,10242]}\n");
    busbar(&format!("registers {} 0x2800 3 --json --unit 7 --function 4", peer.url))
        .ok()
        .prints("{\"unit\":7,\"function\":4,\"address\":10240,\"registers\":[10240,10241,10242]}\n");
    insta::assert_snapshot!(busbar(&format!("registers {} 0xFFFC 4", peer.url)).ok().silently().out());
    insta::assert_snapshot!(
        busbar(&format!("registers {} 0 3 --function 4 --word-order high-first", peer.url))
            .ok()
            .silently()
            .out()
    );
}

#[test]
fn a_short_answer_to_registers_is_taken_and_told() {
    let (_device, url) = d500("");
    let call = busbar(&format!("registers {url} 10240 20 --json")).ok();
    assert_eq!(call.json()["registers"].as_array().unwrap().len(), 16);
    call.says_in_one_sentence("answered 16 of 20 registers");
}

#[test]
fn a_read_that_is_cut_is_asked_for_again() {
    let peer = Peer::new(|request| request.registers(&[request.address]));
    // 10338 to 10341 come one by one; a 32-bit value never comes whole.
    let call = busbar(&format!(
        "read datakom-d --from {} --json mains_frequency genset_frequency charge_input_voltage genset_l1_voltage",
        peer.url
    ))
    .fails();
    let readings = call.json();
    assert_eq!(readings[0]["id"], json!("genset_l1_voltage"));
    assert_eq!(
        (&readings[0]["value"], &readings[0]["raw"], &readings[0]["quality"]),
        (&json!(null), &json!(null), &json!("bad"))
    );
    assert_eq!(readings[0]["error"], json!("the device answered 1 of 2 registers from 10246 on"));
    assert_eq!(readings[1]["value"], json!(103.38));
    assert_eq!(readings[2]["value"], json!(103.39));
    assert_eq!(readings[3]["value"], json!(103.4));
    call.says_in_one_sentence("genset_l1_voltage not read: the device answered 1 of 2 registers");
}

#[test]
fn a_short_answer_is_no_value_from_a_device_that_cuts_nothing() {
    let peer = Peer::new(|request| request.registers(&[request.address]));
    let call = busbar(&format!(
        "read smartgen-acc1700 --from {} --unit 1 --timeout 100ms --json battery_voltage engine_speed",
        peer.url
    ))
    .fails();
    for reading in call.json().as_array().unwrap() {
        assert_eq!((&reading["value"], &reading["quality"]), (&json!(null), &json!("bad")), "{reading}");
    }
    call.says_in_one_sentence("did not answer within 100ms");
}

#[test]
fn exceptions_are_bad_points_and_status_1() {
    let peer = Peer::new(|request| match request.address {
        10605 => request.exception(10),
        _ => request.addresses(),
    });
    let call = busbar(&format!("read datakom-d --from {} --json fuel_level unit_mode", peer.url)).fails();
    let readings = call.json();
    assert_eq!(readings[0]["quality"], json!("good"));
    let mut bad = readings[1].clone();
    bad["ts"] = json!("");
    assert_eq!(
        bad,
        json!({ "id": "unit_mode", "address": 10605, "value": null, "unit": null, "quality": "bad", "raw": null, "ts": "",
            "error": "unit 1 answered function 3 with exception 10 (write protection)" })
    );
    call.says_in_one_sentence(
        "unit_mode not read: unit 1 answered function 3 with exception 10 (write protection)",
    );

    let people = busbar(&format!("read datakom-d --from {} fuel_level unit_mode", peer.url)).fails();
    assert!(people.out().contains("not read"), "{}", people.out());

    busbar(&format!("registers {} 10605 1", peer.url))
        .fails()
        .prints("")
        .says("unit 1 answered function 3 with exception 10 (gateway path unavailable)");
}

#[test]
fn an_address_that_does_not_exist_costs_only_its_own_points() {
    // The device lacks 10341, which lies in the middle of what is asked for.
    let peer = Peer::new(|request| {
        let asked = request.address..request.address + request.count;
        if asked.contains(&10341) { request.exception(2) } else { request.addresses() }
    });
    let call = busbar(&format!("read datakom-d --from {} --json", peer.url)).fails();
    let bad: Vec<Value> = call
        .json()
        .as_array()
        .unwrap()
        .iter()
        .filter(|reading| reading["quality"] == "bad")
        .map(|reading| reading["id"].clone())
        .collect();
    assert_eq!(bad, [json!("battery_voltage")]);
    busbar(&format!("registers {} 10340 2", peer.url)).fails().says(
        "unit 1 answered function 3 with exception 2 (illegal data address); it does not have all of these registers, check ADDRESS and COUNT",
    );
}

#[test]
fn answers_to_something_else_are_no_values() {
    let spoil: [fn(crate::peer::Request) -> Vec<u8>; 5] = [
        |request| crate::peer::Request { unit: request.unit + 1, ..request }.addresses(),
        |request| crate::peer::Request { transaction: request.transaction ^ 1, ..request }.addresses(),
        |request| crate::peer::Request { function: 4, ..request }.addresses(),
        |request| crate::peer::Request { count: request.count + 1, ..request }.addresses(),
        |_| Vec::new(),
    ];
    for answer in spoil {
        let peer = Peer::new(answer);
        let call =
            busbar(&format!("read datakom-d --from {} --json --timeout 100ms fuel_level", peer.url)).fails();
        assert_eq!(call.json()[0]["quality"], json!("bad"));
        assert_eq!(call.json()[0]["value"], json!(null));
        call.says_in_one_sentence("unit 1 did not answer within 100ms");
        busbar(&format!("registers {} 0 1 --timeout 100ms", peer.url))
            .fails()
            .prints("")
            .says_in_one_sentence("did not answer");
    }
}

#[test]
fn garbage_is_no_value() {
    let peer = Peer::new(|_| b"HTTP/1.1 400 Bad Request\r\n\r\n".to_vec());
    busbar(&format!("registers {} 0 1 --timeout 300ms", peer.url))
        .fails()
        .prints("")
        .says_in_one_sentence(&peer.url);
}

#[test]
fn a_silent_device_is_given_up_soon() {
    let peer = Peer::new(|_| Vec::new());
    let started = Instant::now();
    let call = busbar(&format!("read datakom-d --from {} --timeout 100ms", peer.url)).fails().prints("");
    // More than twenty reads would be tried twice each: far more than this.
    assert!(started.elapsed() < Duration::from_secs(3), "{:?}", started.elapsed());
    call.says_in_one_sentence("unit 1 did not answer");
}

#[test]
fn a_silent_unit_is_not_another_one() {
    let (_device, url) = d500("");
    busbar(&format!("registers {url} 10240 1 --unit 2 --timeout 100ms"))
        .fails()
        .prints("")
        .says_in_one_sentence("unit 2 did not answer within 100ms");
}

#[test]
fn a_refused_connection_is_one_sentence_at_once() {
    let nobody = Nobody::new();
    let url = &nobody.url;
    let started = Instant::now();
    for arguments in [format!("registers {url} 0 1"), format!("read datakom-d --from {url}")] {
        busbar(&arguments).fails().prints("").says_in_one_sentence(&format!("{url}: connection refused"));
    }
    assert!(started.elapsed() < Duration::from_secs(3), "{:?}", started.elapsed());
    // Programs get their document all the same.
    let call = busbar(&format!("read datakom-d --from {url} --json fuel_level")).fails();
    assert_eq!(call.json()[0]["quality"], json!("bad"));
    assert!(call.json()[0]["error"].as_str().unwrap().contains("refused"));
}

#[test]
fn endpoints_that_are_not_spoken_yet_say_so() {
    busbar("registers tls://127.0.0.1:1 0 1").fails().prints("").says_in_one_sentence("does not speak tls");
}

#[test]
fn trace_shows_frames_with_their_time() {
    let peer = Peer::new(|request| request.addresses());
    let call = busbar(&format!("registers {} 10240 1 --trace --json", peer.url)).ok();
    let lines: Vec<String> = call.err().lines().map(str::to_owned).collect();
    let [sent, received] = lines.as_slice() else { panic!("{lines:?}") };
    let time = "2026-11-23T04:45:11.689267Z".len();
    assert!(sent[time..].starts_with(" > ") && sent.ends_with(" 00 00 00 06 01 03 28 00 00 01"), "{sent}");
    assert!(
        received[time..].starts_with(" < ") && received.ends_with(" 00 00 00 05 01 03 02 28 00"),
        "{received}"
    );
    assert!(sent[..time].ends_with('Z') && sent[..time] < received[..time]);
}

#[test]
fn one_of_something_is_no_plural() {
    let peer = Peer::new(|request| request.addresses());
    busbar(&format!("read datakom-d --from {} fuel_level", peer.url))
        .ok()
        .says_in_one_sentence("1 point in 1 answer, ");
}

#[test]
fn who_does_not_answer_is_looked_for_by_the_page() {
    let peer = Peer::new(|_| Vec::new());
    for (key, page) in [
        ("datakom-d", "docs/connect/datakom-d.md"),
        ("datakom-dkg705", "docs/connect/datakom-dkg705.md"),
        ("smartgen-hat821si", "docs/connect/smartgen-hat821si.md"),
        ("smartgen-acc1700", "docs/connect/smartgen-acc1700.md"),
    ] {
        busbar(&format!("read {key} --from {} --unit 1 --timeout 50ms", peer.url))
            .fails()
            .says_in_one_sentence(&format!("; {page} tells more"));
    }
    busbar(&format!("registers {} 0 1 --timeout 50ms", peer.url))
        .fails()
        .says_in_one_sentence("; docs/connect/ has a page for each controller");
    // The resolver refuses so long a label without asking anybody; and no page helps there.
    let unknown = "genset".repeat(11);
    let call = busbar(&format!("registers tcp://{unknown} 0 1")).fails();
    call.says_in_one_sentence("check its spelling, or use the address\n");
}

#[test]
fn a_unit_id_in_doubt_is_a_warning() {
    let peer = Peer::new(|request| request.addresses());
    busbar(&format!("read datakom-dkg705 --from {} --unit 145 fuel_level", peer.url))
        .ok()
        .mentions("ends at 144 in others");
    busbar(&format!("read datakom-dkg705 --from {} --unit 144 fuel_level --json", peer.url)).ok().silently();
}

#[test]
fn spacing_is_kept() {
    let peer = Peer::new(|request| request.addresses());
    let started = Instant::now();
    busbar(&format!("read datakom-d --from {} --spacing 200ms fuel_level unit_mode latitude", peer.url)).ok();
    assert!(started.elapsed() >= Duration::from_millis(400), "{:?}", started.elapsed());
}

#[test]
fn a_profile_without_unit_wants_one() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../profiles/datakom-d/profile.toml"
    ))
    .unwrap();
    let file = write(folder.path(), "own.toml", &text.replace("max = 240, default = 1", "max = 240"));
    let peer = Peer::new(|request| request.addresses());
    call(["read", &file, "--from", &peer.url, "fuel_level"])
        .refuses()
        .says_in_one_sentence("write --unit N, 1 to 240");
    call(["read", &file, "--from", &peer.url, "fuel_level", "--unit", "2"]).ok();
    call(["read", &file, "--from", &peer.url, "fuel_level", "--unit", "250"])
        .refuses()
        .says_in_one_sentence("datakom-d cannot be set to unit 250; write --unit N, 1 to 240");
}
