//! The event stream carries changes, and nobody waits for a reader.

use serde_json::json;

use crate::support::{Bench, Event, Stream};

async fn until_value(stream: &mut Stream, point: &str, value: serde_json::Value) -> Event {
    let holds = |event: &Event| {
        let changed = event.data["changed"].as_array();
        changed
            .is_some_and(|changed| changed.iter().any(|view| view["id"] == point && view["value"] == value))
    };
    stream.until(|event| event.name == "values" && holds(event)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_snapshot_comes_first() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let mut stream = bench.client.events("").await;
    let first = stream.next().await.unwrap();
    assert_eq!(first.name, "snapshot");
    assert_eq!(first.data["site"]["name"], "Bench");
    assert_eq!(first.data["alarms"], json!([]));
    assert_eq!(first.data["devices"][0]["id"], "gen1");
    let state = stream.next().await.unwrap();
    assert_eq!((state.name.as_str(), &state.data["device"]), ("state", &json!("gen1")));
    let voltage =
        state.data["values"].as_array().unwrap().iter().find(|value| value["id"] == "genset_l1_voltage");
    assert_eq!(voltage.unwrap()["value"], json!(230.2));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_changed_register_becomes_an_event() {
    let bench = Bench::new().await;
    bench.until_value("modem_imei", |value| value["quality"] == "good").await;
    bench.until_value("longitude", |value| value["quality"] == "good").await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let mut stream = bench.client.events("?device=gen1").await;
    stream.next().await.unwrap();

    bench.device.change(|device| device.registers.insert(10_246, 2310));
    let event = until_value(&mut stream, "genset_l1_voltage", json!(231)).await;
    assert_eq!((&event.data["device"], &event.data["rate"]), (&json!("gen1"), &json!("fast")));
    let changed = event.data["changed"].as_array().unwrap();
    assert_eq!(changed.len(), 1, "only what changed: {changed:?}");
    assert_eq!((&changed[0]["quality"], &changed[0]["ts"]), (&json!("good"), &event.data["ts"]));

    // The next round has nothing to tell but that it took place.
    let next = stream.until(|event| event.name == "values" && event.data["rate"] == "fast").await;
    assert_eq!(next.data["changed"], json!([]));
    assert!(next.data["ts"].as_str() > event.data["ts"].as_str());
}

#[tokio::test(flavor = "multi_thread")]
async fn alarms_and_devices_are_told_when_they_change() {
    let bench = Bench::new().await;
    bench.until_value("shutdown_alarms", |value| value["quality"] == "good").await;
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    bench.device.change(|device| device.registers.insert(10_504 + 3, 1));
    let alarms = stream.until(|event| event.name == "alarms").await;
    assert_eq!((&alarms.data["device"], &alarms.data["alarms"][0]["bit"]), (&json!("gen1"), &json!(48)));
    let device = stream.until(|event| event.name == "device").await;
    assert_eq!(device.data["alarms"]["shutdown"], 1);

    bench.device.change(|device| device.registers.insert(10_504 + 3, 0));
    let alarms = stream.until(|event| event.name == "alarms").await;
    assert_eq!(alarms.data["alarms"], json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn readers_that_never_read_hold_nobody_up() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let mut idle = Vec::new();
    for _ in 0..50 {
        idle.push(bench.client.never_reads().await);
    }
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    for step in 1..=20_u16 {
        bench.device.change(|device| device.registers.insert(10_246, 2_300 + step * 10));
        until_value(&mut stream, "genset_l1_voltage", json!(230 + step)).await;
    }
    assert_eq!(bench.client.get("/healthz").await.body, "ok\n");
    drop(idle);
}
