//! Whatever goes wrong on the wire is shown, and never becomes a value.

use serde_json::{Value, json};

use crate::support::{Bench, Event, Imitation, site, start, until};

fn is_good(value: &Value) -> bool {
    value["quality"] == "good"
}

fn is_bad(value: &Value) -> bool {
    value["quality"] == "bad"
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_device_is_bad_with_its_last_good_value_and_comes_back() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", is_good).await;
    bench.until_value("longitude", is_good).await;
    bench.device.change(|device| device.silent = true);

    let voltage = bench.until_value("genset_l1_voltage", is_bad).await;
    assert_eq!(voltage["value"], json!(230.2), "the last good value stays");
    assert!(voltage["ts"].is_string() && voltage["raw"] == json!([2302, 0]));
    let error = voltage["error"].as_str().unwrap();
    assert!(error.contains("answer"), "{error}");
    let view = bench.view().await;
    assert_eq!((&view["online"], &view["state"]), (&json!(false), &json!(null)));
    let fault = view["fault"].as_str().unwrap();
    assert!(fault.starts_with("Genset 1 cannot be read: "), "{fault}");
    assert!(is_bad(&bench.value("longitude").await), "the slow points too");

    bench.device.change(|device| {
        device.silent = false;
        device.registers.insert(10_246, 2310);
    });
    let voltage = bench.until_value("genset_l1_voltage", is_good).await;
    assert_eq!((&voltage["value"], voltage.get("error")), (&json!(231), None));
    bench.until_value("longitude", is_good).await;
    let view = bench.until_view(|view| view["online"] == true).await;
    assert_eq!(view["fault"], json!(null));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_exception_never_becomes_a_number() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", is_good).await;
    bench.device.change(|device| device.exception = Some(10));
    let voltage = bench.until_value("genset_l1_voltage", is_bad).await;
    assert_eq!(voltage["value"], json!(230.2));
    assert_eq!(voltage["error"], "the device answered exception 10 (write protection)");
    let view = bench.until_view(|view| view["fault"] != json!(null)).await;
    assert_eq!(view["online"], true, "it answers, if only to refuse");

    bench.device.change(|device| device.exception = None);
    bench.until_value("genset_l1_voltage", is_good).await;
    bench.until_view(|view| view["fault"] == json!(null)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_register_costs_its_own_point_and_no_other() {
    let bench = Bench::with(|device| device.unknown = Some(10_341..=10_341)).await;
    let battery = bench.until_value("battery_voltage", is_bad).await;
    assert_eq!(battery["error"], "the device answered exception 2 (illegal address)");
    assert_eq!((&battery["value"], &battery["ts"]), (&json!(null), &json!(null)));
    bench.until_value("charge_input_voltage", is_good).await;
    bench.until_value("charge_input_2_voltage", is_good).await;
    bench.until_value("genset_l1_voltage", is_good).await;

    // What was learnt is remembered: no later read runs into the hole.
    bench.until_value("warning_alarms", is_good).await;
    bench.device.change(|device| device.reads.clear());
    let reads =
        until(async || bench.device.change(|device| device.reads.clone()), |reads| reads.len() > 100).await;
    let into = |(address, count): &(u16, u16)| (*address..*address + *count).contains(&10_341);
    assert!(!reads.iter().any(into), "{reads:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_part_that_never_answers_does_not_hide_the_rest() {
    let bench = Bench::new().await;
    for point in ["warning_alarms", "unit_mode", "longitude"] {
        bench.until_value(point, is_good).await;
    }
    // The connection has proved good.
    until(async || bench.device.change(|device| device.reads.len()), |reads| *reads > 150).await;
    let mut stream = bench.client.events("").await;
    // All three alarm arrays, which are three reads in a row.
    bench.device.change(|device| device.mute = Some(10_504..=10_551));
    let changed = |event: &Event, point: &str, quality: &str| {
        let changed = event.data["changed"].as_array();
        changed.is_some_and(|changed| changed.iter().any(|v| v["id"] == point && v["quality"] == quality))
    };
    // A round that met two of them gave up, and says so of what it did not come to.
    stream.until(|event| changed(event, "unit_mode", "bad")).await;
    stream.until(|event| changed(event, "unit_mode", "good")).await;
    for point in ["shutdown_alarms", "load_dump_alarms", "warning_alarms"] {
        bench.until_value(point, is_bad).await;
    }
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    // From then on they come last and cost nobody anything.
    for _ in 0..3 {
        let round = stream.until(|event| event.name == "values" && event.data["rate"] == "fast").await;
        assert_eq!(round.data["changed"], json!([]));
    }
    let view = bench.view().await;
    assert_eq!((&view["online"], &view["fault"]), (&json!(true), &json!(null)));
    assert!(is_good(&bench.value("genset_l1_voltage").await));
    assert!(is_bad(&bench.value("shutdown_alarms").await));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_short_answer_is_no_value() {
    let bench = Bench::with(|device| device.cut = Some(5)).await;
    // Nobody asked for more than the device allows, so nobody knows what these registers are.
    for point in ["genset_l1_voltage", "genset_l3_voltage", "shutdown_alarms"] {
        let value = bench.until_value(point, is_bad).await;
        assert_eq!((&value["value"], &value["ts"]), (&json!(null), &json!(null)), "{value}");
    }
    let view = bench.view().await;
    assert!(view["alarms_fault"].is_string(), "{view}");
    // It was a passing fault: nothing of it stays in the plan.
    bench.device.change(|device| device.cut = None);
    bench.until_value("genset_l1_voltage", is_good).await;
    bench.until_value("longitude", is_good).await;
    bench.until_value("shutdown_alarms", is_good).await;
    bench.device.change(|device| device.reads.clear());
    let reads =
        until(async || bench.device.change(|device| device.reads.clone()), |reads| reads.len() > 50).await;
    assert!(reads.contains(&(10_240, 16)), "{reads:?}");
    assert_eq!(bench.view().await["alarms_fault"], json!(null));
}

#[tokio::test(flavor = "multi_thread")]
async fn alarms_that_cannot_be_read_are_not_called_none() {
    let bench = Bench::with(|device| device.unknown = Some(10_504..=10_535)).await;
    bench.until_value("shutdown_alarms", is_bad).await;
    let view = bench.view().await;
    assert_eq!((&view["online"], &view["alarms"]["shutdown"]), (&json!(true), &json!(0)));
    assert_eq!(view["alarms_fault"], "shutdown_alarms: the device answered exception 2 (illegal address)");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_drops_again_and_again_causes_no_storm() {
    let device = Imitation::start().await;
    device.change(|device| device.answers = Some(110));
    let rarely = site(&format!("tcp://{}", device.address())).replace("slow = \"200ms\"", "slow = \"1h\"");
    let (_gateway, client) = start(&rarely).await;
    let wire = async || client.get("/api/v1/wires").await.json()[0]["statistics"].clone();
    let many = |statistics: &Value| statistics["reconnects"].as_u64().is_some_and(|count| count > 4);
    until(wire, many).await;
    // What is read once is read with the first round, and again when an hour is over.
    let reads = device.change(|device| device.reads.clone());
    assert_eq!(reads.iter().filter(|read| read.0 == 11_693).count(), 1, "{reads:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_that_are_not_ours_change_nothing() {
    let bench = Bench::with(|device| device.wrong = true).await;
    let mut stream = bench.client.events("").await;
    bench.until_value("warning_alarms", is_good).await;
    bench.until_value("longitude", is_good).await;
    for value in bench.client.get("/api/v1/devices/gen1/values").await.json().as_array().unwrap() {
        assert!(!value["raw"].to_string().contains("61166"), "{value}");
    }
    let first = stream.next().await.unwrap();
    assert!(!first.data.to_string().contains("61166"));
    let statistics = bench.client.get("/api/v1/wires").await.json()[0]["statistics"].clone();
    for counter in ["late", "wrong_unit", "wrong_function", "wrong_length"] {
        assert!(statistics[counter].as_u64().unwrap() > 0, "{counter}: {statistics}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn garbage_changes_nothing_and_polling_goes_on() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", is_good).await;
    bench.device.change(|device| device.garbage = true);
    let voltage = bench.until_value("genset_l1_voltage", is_bad).await;
    assert_eq!((&voltage["value"], &voltage["raw"]), (&json!(230.2), &json!([2302, 0])));
    bench.device.change(|device| device.garbage = false);
    let voltage = bench.until_value("genset_l1_voltage", is_good).await;
    assert_eq!(voltage["value"], json!(230.2));
    let statistics = bench.client.get("/api/v1/wires").await.json()[0]["statistics"].clone();
    assert!(statistics["garbage"].as_u64().unwrap() > 0, "{statistics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_host_that_is_not_there_is_a_visible_fault_and_may_come_later() {
    // A port that is free now.
    let mut device = Imitation::start().await;
    let address = device.address();
    device.stop().await;

    let (_gateway, client) = start(&site(&format!("tcp://{address}"))).await;
    let view = async || client.get("/api/v1/devices/gen1").await.json();
    let faulty = until(view, |view| view["fault"] != json!(null)).await;
    assert_eq!((&faulty["online"], &faulty["last_seen"]), (&json!(false), &json!(null)));
    let fault = faulty["fault"].as_str().unwrap();
    assert!(fault.contains("connection refused"), "{fault}");
    let wire = async || client.get("/api/v1/wires").await.json()[0].clone();
    let down = until(wire, |wire| wire["state"] == "down").await;
    assert!(down["reason"].as_str().unwrap().contains("connection refused"), "{down}");

    let device = Imitation::at(address).await;
    until(view, |view| view["online"] == true && view["fault"] == json!(null)).await;
    until(wire, |wire| wire["state"] == "connected").await;
    drop(device);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wire_that_is_up_again_is_tried_at_once() {
    let mut device = Imitation::start().await;
    let address = device.address();
    device.stop().await;
    // With the usual pauses this device would be probed in an hour.
    let rarely =
        site(&format!("tcp://{address}")).replace("\"50ms\"", "\"1h\"").replace("\"200ms\" }", "\"1h\" }");
    let (_gateway, client) = start(&rarely).await;
    let view = async || client.get("/api/v1/devices/gen1").await.json();
    until(view, |view| view["fault"] != json!(null)).await;
    let device = Imitation::at(address).await;
    until(view, |view| view["online"] == true).await;
    drop(device);
}

#[tokio::test(flavor = "multi_thread")]
async fn after_a_new_connection_the_identity_is_read_again() {
    let mut bench = Bench::new().await;
    bench.until_view(|view| view["model"] == "D-500").await;
    let address = bench.device.address();
    bench.device.stop().await;
    bench.until_view(|view| view["online"] == false).await;
    assert_eq!(bench.view().await["model"], "D-500", "nobody said otherwise");
    bench.device = Imitation::at(address).await;
    bench.device.change(|device| device.registers.insert(10_609, 0xD700));
    bench.until_view(|view| view["model"] == "D-700" && view["online"] == true).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_drops_unnoticed_may_lead_to_another_device() {
    let bench = Bench::new().await;
    bench.until_view(|view| view["model"] == "D-500").await;
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    bench.device.change(|device| {
        device.hang_up = true;
        device.registers.insert(10_609, 0xD700);
    });
    // No read was lost, so nothing was ever bad.
    let told = stream.until(|event| event.name == "device" && event.data["model"] == "D-700").await;
    assert_eq!(told.data["online"], true);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_faulty_wire_leaves_the_others_alone() {
    let good = Imitation::start().await;
    let silent = Imitation::start().await;
    silent.change(|device| device.silent = true);
    let second = site(&format!("tcp://{}", silent.address()))
        .split_once("[[wires]]")
        .map(|(_, rest)| format!("[[wires]]{rest}").replace("w1", "w2").replace("gen1", "gen2"))
        .unwrap();
    let (_gateway, client) = start(&format!("{}{second}", site(&format!("tcp://{}", good.address())))).await;
    let view = async || client.get("/api/v1/devices").await.json();
    let views = until(view, |views| views[0]["online"] == true && views[1]["fault"] != json!(null)).await;
    assert_eq!((&views[0]["fault"], &views[1]["online"]), (&json!(null), &json!(false)));
}

#[tokio::test(flavor = "multi_thread")]
async fn silent_units_do_not_starve_the_one_that_answers() {
    let device = Imitation::start().await;
    device.change(|device| device.absent = vec![2, 3, 4]);
    let mut text = site(&format!("tcp://{}", device.address()));
    let table = text.split_once("[[devices]]").unwrap().1.to_owned();
    for unit in 2..=4 {
        let table =
            table.replace("gen1", &format!("gen{unit}")).replace("unit = 1", &format!("unit = {unit}"));
        text.push_str(&format!("\n[[devices]]{table}"));
    }
    let (_gateway, client) = start(&text).await;
    let view = async |id: &str| client.get(&format!("/api/v1/devices/{id}")).await.json();
    until(async || view("gen1").await, |view| view["online"] == true).await;
    for id in ["gen2", "gen3", "gen4"] {
        until(async || view(id).await, |view| view["fault"] != json!(null)).await;
    }
    let mut stream = client.events("?device=gen1").await;
    for _ in 0..20 {
        let round = stream.until(|event| event.name == "values" && event.data["rate"] == "fast").await;
        let bad = round.data["changed"].as_array().unwrap().iter().find(|value| !is_good(value));
        assert_eq!(bad, None);
    }
    assert_eq!(view("gen1").await["online"], true);

    // The wire says of each unit how it is, and protects the one that answers.
    let wire = async || client.get("/api/v1/wires/w1").await.json();
    let of = |wire: &Value, unit: usize| wire["units"][unit]["state"].clone();
    let silent = until(wire, |wire| (1..4).all(|unit| of(wire, unit) == "silent")).await;
    assert_eq!(of(&silent, 0), "answering");
    let two = &silent["units"][1];
    assert_eq!((&two["unit"], &two["device"], &two["answers"]), (&json!(2), &json!("gen2"), &json!(0)));
    assert!(two["next_probe_s"].is_number() && two["timeouts"].as_u64() >= Some(3), "{two}");
    // The sentence is still that of the first silence, with the way on.
    let fault = view("gen2").await["fault"].as_str().unwrap().to_owned();
    assert!(fault.contains("unit 2 did not answer within"), "{fault}");
    assert!(fault.ends_with("; docs/connect/datakom-d.md says how to set it up and wire it"), "{fault}");

    // A unit that comes back is seen with its next probe.
    device.change(|device| device.absent.clear());
    until(async || view("gen3").await, |view| view["online"] == true).await;
}
