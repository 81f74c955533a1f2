//! `busbar command`: what is printed where, wrong calls, and everything that may go wrong on the way.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicU16, Ordering},
    mpsc::{Receiver, Sender, channel},
};

use serde_json::{Value, json};

use crate::{
    peer::{Peer, Request},
    support::{Service, busbar, d500},
};

/// `unit_mode` and the word that sets it.
const MODE: u16 = 10605;
const AUTO: u16 = 4;

/// A unit in STOP that does with a write what the test says, and the writes that came.
fn unit(
    on_write: impl Fn(Request, &AtomicU16) -> Vec<u8> + Clone + Send + 'static,
) -> (Peer, Receiver<Request>) {
    let (tell, told): (Sender<Request>, _) = channel();
    let tell = Arc::new(Mutex::new(tell));
    let mode = Arc::new(AtomicU16::new(1));
    let peer = Peer::new(move |request| match request.function {
        3 => request.registers(&vec![mode.load(Ordering::SeqCst); request.count.into()]),
        _ => {
            tell.lock().unwrap().send(request).unwrap();
            on_write(request, &mode)
        }
    });
    (peer, told)
}

/// The confirmation of a write of function 6.
fn echo(request: Request) -> Vec<u8> {
    let [address, value] = [request.address, request.count].map(u16::to_be_bytes);
    request.pdu(&[&[request.function], &address[..], &value[..]].concat())
}

#[test]
fn json_has_the_contracts_keys() {
    let (_device, url) = d500("");
    let call = busbar(&format!("command datakom-d stop --to {url} --yes --json")).ok().silently();
    let mut report = call.json();
    assert!(call.out().starts_with(
        "{\"command\":\"stop\",\"verdict\":\"done\",\"reason\":\"Unit mode is STOP.\",\"sent\":1,\"evidence\":[{\"id\":\"unit_mode\",\"before\":\"AUTO\",\"after\":\"STOP\",\"ts\":\""
    ));
    let ts = report["evidence"][0]["ts"].take();
    assert!(ts.as_str().unwrap().len() == 24 && ts.as_str().unwrap().ends_with('Z'), "{ts}");
    assert!(report["elapsed_ms"].take().as_u64().unwrap() < 5000);
    assert_eq!(
        report,
        json!({ "command": "stop", "verdict": "done", "reason": "Unit mode is STOP.", "sent": 1, "elapsed_ms": null,
            "evidence": [{ "id": "unit_mode", "before": "AUTO", "after": "STOP", "ts": null }] })
    );
}

#[test]
fn people_get_the_verdict_and_what_was_seen() {
    let (_device, url) = d500("");
    for (name, command) in [("done", "stop"), ("refused", "manual"), ("unknown", "up press=long")] {
        let call = busbar(&format!("command datakom-d {command} --to {url} --yes"));
        let err = call.err();
        let told: Vec<&str> = err.lines().filter(|line| !line.ends_with(" ms")).collect();
        insta::assert_snapshot!(name, format!("{}---\n{}", call.out(), told.join("\n")));
    }
    // The model is known, and so is what its mode is called.
    let call = busbar(&format!("command datakom-d run --to {url} --yes")).ok();
    assert!(call.out().contains("RUN") && call.out().contains("-> "), "{}", call.out());
}

#[test]
fn wrong_calls_say_what_is_allowed() {
    for (arguments, part) in [
        ("datakom-d", "<NAME> is missing; write busbar command"),
        (
            "datakom-d chanel --to tcp://127.0.0.1:1",
            "datakom-d has no command \"chanel\"; did you mean channel? it has stop, auto, test,",
        ),
        (
            "smartgen-hat821si transfer --to tcp://127.0.0.1:1",
            "did you mean transfer_000, transfer_101, transfer_110?",
        ),
        (
            "smartgen-hat821si frob --to tcp://127.0.0.1:1",
            "\"busbar profile show smartgen-hat821si\" lists them",
        ),
        ("datakom-d channel --to tcp://127.0.0.1:1", "`channel` is not given; write a number from 0 to 19"),
        (
            "datakom-d channel channel=20 --to tcp://127.0.0.1:1",
            "`channel` cannot be `20`; write a number from 0 to 19",
        ),
        ("datakom-d gcb press=hard --to tcp://127.0.0.1:1", "write one of: short, long, very_long"),
        (
            "datakom-d gcb hold=long --to tcp://127.0.0.1:1",
            "there is no argument `hold`; write one of: press",
        ),
        ("datakom-d gcb press=long press=long --to tcp://127.0.0.1:1", "`press` is given twice"),
        ("datakom-d auto now --to tcp://127.0.0.1:1", "write ARG=VALUE, for example press=long"),
        ("datakom-d auto --to tcp://127.0.0.1:1 --unit 0", "datakom-d cannot be set to unit 0"),
        (
            "datakom-dkg705 set_clock time=noon --unit 1 --to tcp://127.0.0.1:1",
            "write now, or a local time as",
        ),
        ("datakom-d auto --to 127.0.0.1:1", "no scheme; write tcp://127.0.0.1:1"),
    ] {
        busbar(&format!("command {arguments} --yes")).refuses().says_in_one_sentence(part);
    }
}

#[test]
fn nothing_is_sent_without_a_yes() {
    let (peer, writes) = unit(|request, _| echo(request));
    for command in ["auto", "reset"] {
        busbar(&format!("command datakom-d {command} --to {}", peer.url))
            .refuses()
            .says_in_one_sentence("is not sent without a yes; give --yes, or call it from a terminal");
    }
    assert!(writes.try_recv().is_err());
}

#[test]
fn a_lost_answer_is_sent_once_and_resolved_by_reading() {
    let (peer, writes) = unit(|_, mode| {
        mode.store(AUTO, Ordering::SeqCst);
        Vec::new()
    });
    let call = busbar(&format!("command datakom-d auto --to {} --yes --json --timeout 200ms", peer.url)).ok();
    assert_eq!((&call.json()["verdict"], &call.json()["sent"]), (&json!("done"), &json!(1)));
    assert_eq!(call.json()["reason"], json!("The answer to the write was lost, but Unit mode is AUTO."));
    assert_eq!(writes.try_iter().count(), 1);
}

#[test]
fn an_answer_that_cannot_be_the_confirmation_is_lost_and_nothing_is_sent_again() {
    let answers: [fn(Request) -> Vec<u8>; 5] = [
        |request| echo(Request { address: request.address + 1, ..request }),
        |request| echo(Request { count: request.count + 1, ..request }),
        |request| request.pdu(&[6, 0x20, 0x01]),
        |request| request.pdu(&[16, 0x20, 0x01, 0, 1]),
        |request| echo(Request { unit: request.unit + 1, ..request }),
    ];
    for answer in answers {
        let (peer, writes) = unit(move |request, mode| {
            mode.store(AUTO, Ordering::SeqCst);
            answer(request)
        });
        let call = busbar(&format!("command datakom-d auto --to {} --yes --json --timeout 200ms", peer.url));
        let report = call.ok().json();
        assert_eq!(
            (&report["reason"], &report["sent"]),
            (&json!("The answer to the write was lost, but Unit mode is AUTO."), &json!(1))
        );
        assert_eq!(writes.try_iter().count(), 1);
    }
}

#[test]
fn another_controller_gets_no_write() {
    let (tell, writes) = channel();
    let tell = Arc::new(Mutex::new(tell));
    let peer = Peer::new(move |request| {
        if !matches!(request.function, 3 | 4) {
            tell.lock().unwrap().send(request).unwrap();
        }
        request.exception(2)
    });
    for (key, command) in [
        ("datakom-d", "stop"),
        ("datakom-d", "reset"),
        ("datakom-d", "up"),
        ("datakom-dkg705", "auto"),
        ("datakom-dkg705", "set_clock"),
        ("smartgen-hat821si", "genset_start"),
        ("smartgen-acc1700", "lock"),
        ("smartgen-acc1700", "output_1"),
    ] {
        let call =
            busbar(&format!("command {key} {command} --to {} --unit 1 --yes --json --spacing 0", peer.url));
        let report = call.fails().json();
        assert_eq!((&report["verdict"], &report["sent"]), (&json!("refused"), &json!(0)), "{report}");
        let reason = report["reason"].as_str().unwrap();
        assert!(reason.ends_with(&format!("check the unit id, and that it is a {key}.")), "{reason}");
    }
    assert!(writes.try_recv().is_err());
}

#[test]
fn what_the_device_refuses_is_refused_in_the_makers_words() {
    let (peer, writes) = unit(|request, _| request.exception(10));
    let call = busbar(&format!("command datakom-d auto --to {} --yes", peer.url)).fails();
    assert!(call.out().contains("exception 10 (write protection)"), "{}", call.out());
    assert!(call.out().starts_with("Auto mode: refused\n"), "{}", call.out());
    assert_eq!(writes.try_iter().count(), 1);
}

#[test]
fn what_does_not_come_is_no_effect() {
    let (peer, writes) = unit(|request, _| echo(request));
    let call = busbar(&format!("command datakom-d auto --to {} --yes --json", peer.url)).fails();
    let report = call.json();
    assert_eq!((&report["verdict"], &report["sent"]), (&json!("no_effect"), &json!(1)));
    assert_eq!(report["evidence"][0]["after"], json!("STOP"));
    assert!(report["elapsed_ms"].as_u64().unwrap() >= 5000);
    assert_eq!(writes.try_iter().count(), 1);
}

#[test]
fn who_does_not_answer_gets_nothing() {
    let peer = Peer::new(|_| Vec::new());
    let call =
        busbar(&format!("command datakom-d auto --to {} --yes --json --timeout 50ms", peer.url)).fails();
    let report = call.json();
    assert_eq!((&report["verdict"], &report["sent"]), (&json!("refused"), &json!(0)));
    let reason = report["reason"].as_str().unwrap();
    assert!(reason.contains("nothing was sent") || reason.starts_with("Nothing was sent"), "{reason}");
    assert!(reason.ends_with("docs/connect/datakom-d.md tells more."), "{reason}");
}

#[test]
fn ctrl_c_before_the_write_sends_nothing() {
    let (tell, told) = channel();
    let tell = Arc::new(Mutex::new(tell));
    let peer = Peer::new(move |request| {
        tell.lock().unwrap().send(request.function).unwrap();
        Vec::new()
    });
    let arguments = format!("command datakom-d auto --to {} --yes --json --timeout 60s", peer.url);
    let service = Service::start(arguments.split(' '));
    assert_eq!(told.recv(), Ok(3));
    let (status, out, err) = service.end("INT");
    assert_eq!(status, Some(0), "{err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["verdict"], &report["sent"]), (&json!("refused"), &json!(0)), "{report}");
    assert!(err.ends_with("busbar: interrupted: nothing was sent\n"), "{err}");
    assert!(told.try_recv().is_err());
}

#[test]
fn ctrl_c_after_the_write_says_that_it_has_left() {
    // Once while its answer is waited for, and once while its effect is.
    for confirmed in [false, true] {
        let (peer, writes) = unit(move |request, _| if confirmed { echo(request) } else { Vec::new() });
        let arguments = format!("command datakom-d auto --to {} --yes --json --timeout 60s", peer.url);
        let service = Service::start(arguments.split(' '));
        assert_eq!(writes.recv().unwrap().address, 8193);
        let (status, out, err) = service.end("TERM");
        assert_eq!(status, Some(0), "{err}");
        assert!(err.contains("the command has left, is not taken back"), "{err}");
        assert!(writes.try_recv().is_err());
        let report: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((&report["verdict"], &report["sent"]), (&json!("unknown"), &json!(1)), "{report}");
    }
}

#[test]
fn a_file_is_a_profile_too_and_reads_what_it_says() {
    let (peer, writes) = unit(|request, mode| {
        mode.store(AUTO, Ordering::SeqCst);
        echo(request)
    });
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../profiles/datakom-d/profile.toml");
    busbar(&format!("command {file} auto --to {} --yes --unit 9", peer.url)).ok();
    let write = writes.recv().unwrap();
    assert_eq!((write.unit, write.function, write.address, write.count), (9, 6, 8193, AUTO));
    assert_ne!(write.address, MODE);
}
