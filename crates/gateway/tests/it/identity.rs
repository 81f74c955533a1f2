//! Who answers is asked before anything is believed: another device is a visible fault and none of its registers a value.

use busbar_profile::builtins;
use serde_json::{Value, json};

use crate::support::{Behaviour, Bench, Client, Imitation, site, start, until};

/// The same site with a device of another family, in the usual pace of its polls.
fn site_of(profile: &str, device: &Imitation) -> String {
    site(&format!("tcp://{}", device.address()))
        .replace("datakom-d", profile)
        .replace("fast = \"50ms\", slow = \"200ms\"", "fast = \"200ms\", slow = \"1s\"")
}

async fn values(client: &Client) -> Vec<Value> {
    client.get("/api/v1/devices/gen1/values").await.json().as_array().unwrap().clone()
}

/// Nothing of the device is a value, and each says why.
#[track_caller]
fn assert_nothing_is_believed(values: &[Value]) {
    assert!(values.len() > 40);
    for value in values {
        assert_eq!(
            (&value["value"], &value["raw"], &value["ts"], &value["quality"]),
            (&json!(null), &json!(null), &json!(null), &json!("bad")),
            "{value}"
        );
        let error = value["error"].as_str().unwrap();
        assert!(error.starts_with("another device answers in its place: "), "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_other_family_is_seen_and_named() {
    let mut cases = Vec::new();
    for wanted in builtins() {
        for there in builtins().iter().filter(|other| other.key != wanted.key) {
            cases.push(stands_in(&there.key, &wanted.key));
        }
    }
    assert_eq!(futures_util::future::join_all(cases).await.len(), 12);
}

/// A device of one family is where the site file wants another.
async fn stands_in(there: &'static str, wanted: &'static str) {
    let device = Imitation::start().await;
    device.change(|device| device.family = Some(there));
    let (_gateway, client) = start(&site_of(wanted, &device)).await;
    let view = async || client.get("/api/v1/devices/gen1").await.json();
    let view = until(view, |view| view["identity"]["verdict"] != "unknown").await;
    let case = format!("a {there} in place of a {wanted}: {view:#}");
    assert_eq!(view["identity"]["verdict"], "wrong", "{case}");
    let fault = view["fault"].as_str().unwrap();
    assert!(fault.starts_with("Genset 1 is not what the site file says: "), "{case}");
    assert!(fault.contains(&format!("(profile {there})")), "{case}");
    assert!(view["alarms_fault"].as_str().unwrap().contains("another device"), "{case}");
    assert_eq!((&view["online"], &view["state"], &view["mode"]), (&json!(true), &json!(null), &json!(null)));
    assert_nothing_is_believed(&values(&client).await);
    let reads = device.change(|device| device.reads.clone());
    assert!(reads.iter().all(|read| read.1 <= 2), "{reads:?} to know a {case}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_of_each_family_is_let_in_after_one_read() {
    for profile in builtins() {
        let device = Imitation::start().await;
        let family = profile.key.as_str();
        device.change(|device| device.family = Some(family));
        let (_gateway, client) = start(&site_of(family, &device)).await;
        let view = async || client.get("/api/v1/devices/gen1").await.json();
        let view = until(view, |view| view["identity"]["verdict"] != "unknown").await;
        let verdict = if family == "datakom-d" { "confirmed" } else { "plausible" };
        assert_eq!(
            (&view["identity"]["verdict"], &view["fault"]),
            (&json!(verdict), &json!(null)),
            "{view:#}"
        );
        let reads = async || device.change(|device| device.reads.clone());
        let reads = until(reads, |reads| reads.len() > 1).await;
        let (first, second) = (reads[0], reads[1]);
        assert!(first.1 <= 2 && second.1 > 2, "one short read, and the round: {first:?} {second:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn another_device_behind_a_new_connection_takes_every_value_away() {
    let mut bench = Bench::with(|device| {
        device.registers.insert(10_504, 1);
    })
    .await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    bench.until_view(|view| view["alarms"]["shutdown"] == 1).await;
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    let address = bench.device.address();
    bench.device.stop().await;
    // On the wire of the genset stands a compressor.
    bench.device = Imitation::with(address, |device| device.family = Some("smartgen-acc1700")).await;
    let told =
        stream.until(|event| event.name == "device" && event.data["identity"]["verdict"] == "wrong").await;
    assert!(told.data["fault"].as_str().unwrap().contains("smartgen-acc1700"), "{told:?}");
    assert_nothing_is_believed(&values(&bench.client).await);
    assert_eq!(bench.client.get("/api/v1/alarms").await.json(), json!([]), "they were of the other one");
    assert!(bench.view().await["alarms_fault"].is_string());

    // It is asked nothing but who it is, but for the read that was under way when the connection dropped. Who else it
    // may be is asked once.
    let asked =
        until(async || bench.device.change(|device| device.reads.clone()), |reads| reads.len() > 8).await;
    assert!(asked[1..].iter().all(|read| read.1 <= 2), "{asked:?}");
    assert_eq!(asked.iter().filter(|read| read.0 < 10_000).count(), 3, "{asked:?}");
    assert_nothing_is_believed(&values(&bench.client).await);

    // Put back, it is there at once with all its values.
    bench.device.stop().await;
    let right = |device: &mut Behaviour| device.registers.extend([(10_609, 0xD500), (10_246, 2310)]);
    bench.device = Imitation::with(address, right).await;
    bench.until_value("genset_l1_voltage", |value| value["value"] == json!(231)).await;
    let view = bench.until_view(|view| view["identity"]["verdict"] == "confirmed").await;
    assert_eq!((&view["fault"], &view["alarms_fault"]), (&json!(null), &json!(null)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_drops_unnoticed_lets_no_other_device_in() {
    let device = Imitation::start().await;
    device.change(|device| device.family = Some("datakom-dkg705"));
    let (_gateway, client) = start(&site_of("datakom-dkg705", &device)).await;
    let view = async || client.get("/api/v1/devices/gen1").await.json();
    until(view, |view| view["identity"]["verdict"] == "plausible").await;
    let mut stream = client.events("").await;
    stream.next().await.unwrap();
    device.change(|device| {
        device.hang_up = true;
        // It has nearly all the registers of the other, and they mean something else.
        device.family = Some("smartgen-acc1700");
        device.registers.extend((0..128).map(|address| (address, 21_845)));
    });
    let told = stream
        .until(|event| {
            assert!(!event.data.to_string().contains("21845"), "{event:?}");
            event.name == "device" && event.data["identity"]["verdict"] == "wrong"
        })
        .await;
    assert!(told.data["fault"].as_str().unwrap().contains("smartgen-acc1700"), "{told:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_that_does_not_know_its_identity_register_is_let_in() {
    let bench = Bench::with(|device| device.unknown = Some(10_609..=10_611)).await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let view = bench.view().await;
    assert_eq!((&view["identity"]["verdict"], &view["fault"]), (&json!("plausible"), &json!(null)));
    let detail = view["identity"]["detail"].as_str().unwrap();
    assert!(detail.contains("though not register 10609: the device answered exception 2"), "{detail}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_model_that_the_profile_does_not_know_is_no_error() {
    for (code, words) in [(0xD999, "D999h"), (0, "0000h"), (0xFFFF, "FFFFh")] {
        let bench = Bench::with(|device| {
            device.registers.insert(10_609, code);
        })
        .await;
        bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
        let view = bench.view().await;
        let identity = &view["identity"];
        assert_eq!(
            (&identity["verdict"], &view["fault"], &view["model"]),
            (&json!("plausible"), &json!(null), &json!(null))
        );
        assert!(identity["detail"].as_str().unwrap().contains(words), "{identity}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_that_is_busy_or_silent_is_not_called_another() {
    let bench = Bench::with(|device| device.exception = Some(6)).await;
    let view = bench.until_view(|view| view["fault"] != json!(null)).await;
    assert_eq!((&view["identity"]["verdict"], &view["online"]), (&json!("unknown"), &json!(true)), "{view}");
    assert!(view["fault"].as_str().unwrap().contains("exception 6"), "{view}");
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "bad").await;
    bench.device.change(|device| (device.exception, device.silent) = (None, true));
    let view = bench.until_view(|view| view["online"] == false).await;
    assert_eq!(view["identity"]["verdict"], "unknown", "{view}");
    bench.device.change(|device| device.silent = false);
    let view = bench.until_view(|view| view["identity"]["verdict"] == "confirmed").await;
    assert_eq!(view["fault"], json!(null));
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_that_says_nothing_of_who_it_is_is_still_read() {
    let bench = Bench::with(|device| device.mute = Some(10_609..=10_609)).await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let view = bench.view().await;
    assert_eq!((&view["identity"]["verdict"], &view["model"]), (&json!("plausible"), &json!(null)), "{view}");
}

#[tokio::test(flavor = "multi_thread")]
async fn another_unit_of_the_line_that_took_its_place_without_a_word_is_found_out() {
    let device = Imitation::start().await;
    let text = site(&format!("tcp://{}", device.address()));
    let (_gateway, client) = start(&text).await;
    let view = async || client.get("/api/v1/devices/gen1").await.json();
    until(view, |view| view["identity"]["verdict"] == "confirmed").await;
    // No connection dropped and no answer was lost; what it always had it refuses now.
    device.change(|device| device.family = Some("smartgen-hat821si"));
    let view = until(view, |view| view["identity"]["verdict"] == "wrong").await;
    assert!(view["fault"].as_str().unwrap().contains("smartgen-hat821si"), "{view}");
    assert_nothing_is_believed(&values(&client).await);
    device.change(|device| device.family = None);
    until(
        async || client.get("/api/v1/devices/gen1").await.json(),
        |view| view["identity"]["verdict"] == "confirmed",
    )
    .await;
}
