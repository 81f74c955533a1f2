//! The commands on a serial line: a pseudo-terminal with an imitated ACC1700 at its other end, unit 3.

use serde_json::{Value, json};

use crate::support::{Call, Service, busbar};

const PROFILE: &str = "smartgen-acc1700";

/// The imitation, the URL of its line, and that of the converter to the same controller.
fn acc1700(options: &str) -> (Service, String, String) {
    let arguments =
        format!("emulate {PROFILE} --unit 3 --listen rtu://pty --listen rtu+tcp://127.0.0.1:0 {options}");
    let mut service = Service::start(arguments.split_whitespace());
    let (line, converter) = (service.line(), service.line());
    assert!(line.starts_with("rtu:///dev/pts/"), "{line}");
    (service, line, converter)
}

/// The frames of `--trace`, `> 03 ...` or `< 03 ...`, without their times.
fn frames(call: &Call) -> Vec<String> {
    let time = "2026-11-23T04:45:11.689267Z ".len();
    let err = call.err();
    let lines = err.lines().filter(|line| !line.starts_with("busbar: "));
    lines.map(|line| line[time..].to_owned()).collect()
}

#[test]
fn read_brings_values_and_their_time() {
    let (_device, line, converter) = acc1700("--set battery_voltage=27.1");
    for url in [&line, &converter] {
        let call = busbar(&format!("read {PROFILE} --from {url} --unit 3 battery_voltage --json")).ok();
        let mut readings = call.silently().json();
        let ts = readings[0]["ts"].take();
        assert!(ts.as_str().unwrap().len() == 24 && ts.as_str().unwrap().ends_with('Z'), "{ts}");
        assert_eq!(
            readings,
            json!([{ "id": "battery_voltage", "address": 51, "value": 27.1, "unit": "V", "quality": "good",
                "raw": [271], "ts": null }])
        );
    }
}

#[test]
fn every_point_is_read_over_the_line() {
    let (_device, line, _) = acc1700("");
    let readings = busbar(&format!("read {PROFILE} --from {line} --unit 3 --json")).ok().json();
    let readings = readings.as_array().unwrap();
    let shown = busbar(&format!("profile show {PROFILE} --json")).ok().json();
    let readable = shown["points"].as_array().unwrap().iter().filter(|point| point["access"] != "w");
    assert_eq!(readings.len(), readable.count());
    for reading in readings {
        assert!(reading["quality"] == "good" || reading["quality"] == "invalid", "{reading}");
    }
}

#[test]
fn registers_and_their_frames() {
    let (_device, line, _) = acc1700("--set battery_voltage=27.1");
    let call = busbar(&format!("registers {line} 51 1 --unit 3 --json --trace")).ok();
    assert_eq!(frames(&call), ["> 03 03 00 33 00 01 75 E7", "< 03 03 02 01 0F 80 10"]);
    call.prints("{\"unit\":3,\"function\":3,\"address\":51,\"registers\":[271]}\n");
}

#[test]
fn refusals_say_what_to_try() {
    let (_device, line, _) = acc1700("");
    for (arguments, said) in [
        ("51 1 --function 4", "exception 1 (illegal function); try --function 3\n"),
        ("300 1", "it does not have all of these registers, check ADDRESS and COUNT"),
    ] {
        busbar(&format!("registers {line} {arguments} --unit 3"))
            .fails()
            .prints("")
            .says_in_one_sentence(said);
    }
}

#[test]
fn who_is_not_on_the_line_is_looked_for_on_the_line() {
    let (_device, line, _) = acc1700("");
    let advice = "asked 2 times: nothing came back; check the unit id, that the device is on, that A and B are not swapped, and the baud rate; ";
    busbar(&format!("read {PROFILE} --from {line} --unit 4 --timeout 100ms battery_voltage"))
        .fails()
        .prints("")
        .says(&format!(
            "unit 4 did not answer within 100ms, {advice}docs/connect/smartgen-acc1700.md tells more"
        ));
    busbar(&format!("registers {line} 51 1 --unit 4 --timeout 100ms")).fails().prints("").says(&format!(
        "unit 4 did not answer within 100ms, {advice}docs/connect/ has a page for each controller"
    ));
}

#[test]
fn watch_goes_on_until_ctrl_c() {
    let (_device, line, _) = acc1700("--set battery_voltage=27.1");
    let arguments =
        format!("watch {PROFILE} --from {line} --unit 3 --every 20ms --json --spacing 0 battery_voltage");
    let mut service = Service::start(arguments.split(' '));
    for _ in 0..3 {
        let readings: Value = serde_json::from_str(&service.line()).unwrap();
        assert_eq!((&readings[0]["value"], &readings[0]["quality"]), (&json!(27.1), &json!("good")));
    }
    assert_eq!(service.signal("INT"), (Some(0), String::new()));
}

#[test]
fn a_line_has_one_client() {
    let (_device, line, _) = acc1700("");
    let arguments = format!("watch {PROFILE} --from {line} --unit 3 --json battery_voltage");
    let mut first = Service::start(arguments.split(' '));
    first.line();
    for second in [
        format!("read {PROFILE} --from {line} --unit 3 battery_voltage"),
        format!("registers {line} 51 1 --unit 3"),
        format!("emulate {PROFILE} --unit 3 --listen {line}"),
    ] {
        busbar(&second).fails().prints("").says_in_one_sentence(
            "another program has the device open: close it, a serial line has one client",
        );
    }
    // A command that cannot have the line sends nothing, and says why.
    let report = busbar(&format!("command {PROFILE} lock --to {line} --unit 3 --yes --json")).fails().json();
    assert_eq!((&report["verdict"], &report["sent"]), (&json!("refused"), &json!(0)));
    assert!(report["reason"].as_str().unwrap().contains("another program has the device open"), "{report}");
    assert_eq!(first.signal("INT").0, Some(0));
}

#[test]
fn a_device_that_goes_away_is_told_and_waited_for() {
    let (device, line, _) = acc1700("");
    // A name of its own, as adapters have: the number of a pseudo-terminal is soon another test's.
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("adapter");
    let path = line.trim_start_matches("rtu://").split('?').next().unwrap();
    std::os::unix::fs::symlink(path, &name).unwrap();
    let line = format!("rtu://{}?baud=9600&parity=none&stop=1", name.display());
    let arguments = format!("watch {PROFILE} --from {line} --unit 3 --every 20ms --json battery_voltage");
    let mut service = Service::start(arguments.split(' '));
    let readings: Value = serde_json::from_str(&service.line()).unwrap();
    assert_eq!(readings[0]["quality"], json!("good"));
    std::fs::remove_file(&name).unwrap();
    drop(device);
    let reading = loop {
        let readings: Value = serde_json::from_str(&service.line()).unwrap();
        if readings[0]["quality"] == json!("bad") {
            break readings[0].clone();
        }
    };
    assert_eq!(reading["value"], Value::Null);
    let error = reading["error"].as_str().unwrap();
    assert!(error.starts_with(&line) && error.contains("check that the adapter is plugged in"), "{error}");
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn a_command_leaves_once() {
    let (_device, line, _) = acc1700("");
    let call = busbar(&format!("command {PROFILE} lock --to {line} --unit 3 --yes --json --trace")).ok();
    let report = call.json();
    assert_eq!((&report["verdict"], &report["sent"]), (&json!("done"), &json!(1)), "{report}");
    assert_eq!(report["reason"], json!("Lock mode is on."));
    let frames = frames(&call);
    let writes: Vec<_> = frames.iter().filter(|frame| !frame.starts_with("> 03 03")).collect();
    assert_eq!(writes[1], "> 03 05 00 13 FF 00 7C 1D", "{frames:?}");
    assert_eq!(writes[2], "< 03 05 00 13 FF 00 7C 1D", "{frames:?}");
    assert_eq!(frames.iter().filter(|frame| frame.starts_with("> 03 05")).count(), 1, "{frames:?}");

    // Asked for what is so already, it does not even leave.
    let loaded = busbar(&format!("command {PROFILE} unload --to {line} --unit 3 --yes --json")).ok().json();
    assert_eq!((&loaded["verdict"], &loaded["sent"]), (&json!("done"), &json!(0)), "{loaded}");
}

#[test]
fn plan_takes_the_url_of_the_line() {
    let (_device, line, converter) = acc1700("");
    let plan = busbar(&format!("plan {PROFILE} battery_voltage --endpoint {line} --json")).ok().json();
    assert_eq!(
        plan,
        json!({ "requests": [{ "function": 3, "address": 51, "count": 1 }], "characters": 15, "baud": 9600,
            "wire_ms": 22.9, "best_ms": 22.9, "refresh_ms": 522.9 })
    );
    let plan = busbar(&format!("plan {PROFILE} battery_voltage --endpoint {converter} --json")).ok().json();
    assert_eq!((&plan["characters"], &plan["wire_ms"]), (&json!(15), &Value::Null));
}

#[test]
fn what_is_no_line_is_one_sentence() {
    for (url, said) in [
        (
            "rtu:///dev/busbar-has-no-such-device",
            "there is no such device: check that the adapter is plugged in",
        ),
        ("rtu:///dev/null", "this is not a serial device: check the path"),
    ] {
        let url = format!("{url}?baud=9600&parity=none&stop=1");
        for call in [
            format!("registers {url} 0 1"),
            format!("read {PROFILE} --from {url} --unit 3 battery_voltage"),
            format!("command {PROFILE} lock --to {url} --unit 3 --yes"),
            format!("emulate {PROFILE} --listen {url}"),
        ] {
            let call = busbar(&call).fails();
            let told = format!("{}{}", call.out(), call.err());
            assert!(told.contains(said) && told.contains(&url), "{told}");
        }
    }
    busbar("registers rtu://pty 0 1").refuses().says_in_one_sentence("write the URL that it prints");
    busbar(&format!("read {PROFILE} --from rtu:///dev/null?baud=1200 --unit 3"))
        .refuses()
        .says_in_one_sentence("smartgen-acc1700 cannot be set to baud=1200; it has 9600, 19200, 38400");
    busbar("read datakom-d --from rtu:///dev/null?parity=odd")
        .refuses()
        .says_in_one_sentence("datakom-d cannot be set to parity=odd; it has none");
    busbar("emulate datakom-d --listen rtu://pty?parity=even")
        .refuses()
        .says_in_one_sentence("datakom-d has no such line; choose baud 2400");
}
