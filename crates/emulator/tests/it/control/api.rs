//! What can be done.

use axum::http::Method;
use busbar_emulator::{Config, Device};
use serde_json::json;

use super::Bench;

#[tokio::test]
async fn controllers_say_what_they_are() {
    let bench = Bench::new().await;
    let all = bench.get("/api/v1/controllers").await;
    assert_eq!(all.as_array().unwrap().len(), 2);
    let one = bench.get("dkg").await;
    let said = ["name", "profile", "vendor", "model", "kind", "unit", "seed"].map(|key| one[key].clone());
    assert_eq!(
        said,
        [
            json!("Genset 2"),
            json!("datakom-dkg705"),
            json!("Datakom"),
            json!("DKG-705"),
            json!("genset"),
            json!(2),
            json!(1)
        ]
    );
    assert_eq!(one["endpoints"], json!([bench.emulation.urls()[0].to_string()]));
    assert_eq!((&one["clock"]["speed"], &one["clock"]["paused"]), (&json!(1.0), &json!(false)));
    assert_eq!((&one["injected"], &one["pinned"]), (&json!([]), &json!([])));
    assert_eq!(bench.get("d").await["model"], "D-500");
}

#[tokio::test]
async fn everything_goes_back_to_normal_at_once() {
    let bench = Bench::new().await;
    bench.step(1.0).await;
    let back = async |lever: &str| {
        let levers = bench.get("d/levers").await;
        let levers = levers.as_array().unwrap();
        levers.iter().find(|each| each["id"] == lever).unwrap()["back"].clone()
    };
    let level = bench.get("d/levers").await.as_array().unwrap()[16].clone();
    assert_eq!((&level["id"], &level["back"]), (&json!("tank"), &json!(null)));
    assert_eq!(back("load").await, json!(null));
    for (path, body) in [
        ("d/levers/mains", json!({ "position": "failed" })),
        ("d/levers/load", json!({ "position": 60 })),
        ("d/levers/tank", json!({ "position": 0 })),
        ("d/levers/tank", json!({ "position": 100 })),
        ("d/pins/battery_voltage", json!({ "value": 12 })),
        ("d/alarms/coolant_temperature_high", json!({})),
    ] {
        bench.put(path, body).await.json();
    }
    assert_eq!((back("mains").await, back("load").await), (json!("normal"), json!("varies")));
    assert_eq!(back("tank").await, level["position"], "what it was before the first pull");
    let normal = bench.put("d/normal", json!({})).await.json();
    assert_eq!((&normal["injected"], &normal["pinned"]), (&json!([]), &json!([])));
    let levers = normal["levers"].as_array().unwrap();
    assert!(levers.iter().all(|lever| lever["back"].is_null()), "{levers:?}");
    let tank = levers.iter().find(|lever| lever["id"] == "tank").unwrap();
    assert_eq!(tank["position"], level["position"]);

    bench.put("d/levers/tank", json!({ "position": 0 })).await.json();
    bench.put("d/levers/tank", json!({ "position": level["position"] })).await.json();
    assert_eq!(back("tank").await, json!(null), "put back by hand");
}

#[tokio::test]
async fn what_happened_lately_is_told_and_what_is_active() {
    let bench = Bench::new().await;
    bench.step(1.0).await;
    bench.put("d/levers/mains", json!({ "position": "failed" })).await.json();
    bench.put("d/alarms/warning_alarms.low_fuel_level", json!({})).await.json();
    bench.step(60.0).await;
    bench.put("d/normal", json!({})).await.json();
    let told = bench.get("d/events").await;
    let told: Vec<_> = told.as_array().unwrap().iter().map(|event| event["text"].as_str().unwrap()).collect();
    assert_eq!(told[0], "All back to normal", "the newest first");
    let place = |text: &str| {
        let place = told.iter().rposition(|told| *told == text);
        place.unwrap_or_else(|| panic!("{text} is not told: {told:?}"))
    };
    assert!(place("Mains: failed") > place("mains.failed"), "{told:?}");
    assert!(place("mains.failed") > place("breaker.genset.closed"), "{told:?}");
    place("warning alarm injected: Low fuel level");
    place("warning alarm: Low fuel level");
    let active = bench.get("d").await["active"].clone();
    let fuel = active.as_array().unwrap().iter().find(|alarm| alarm["id"] == "warning_alarms.low_fuel_level");
    assert!(fuel.is_some(), "it is let go from the next step on: {active}");
    assert_eq!(
        bench.get("dkg/events").await.as_array().unwrap().len(),
        0,
        "nothing happened to the other one"
    );
    assert_eq!(bench.get("d").await["scenario"], json!(null));
}

#[tokio::test]
async fn a_paused_clock_stands_still_and_is_stepped() {
    let bench = Bench::new().await;
    assert_eq!(bench.put("d/clock", json!({ "paused": true, "speed": 60 })).await.json()["paused"], true);
    let before = bench.get("d").await["clock"]["time_s"].as_f64().unwrap();
    tokio::time::sleep(busbar_emulator::STEP * 3).await;
    let clock = bench.get("d").await["clock"].clone();
    assert_eq!(clock, json!({ "time_s": before, "speed": 60.0, "paused": true }));
    let stepped = bench.ask(Method::POST, "d/steps", Some(json!({ "seconds": 90.5 }))).await.json();
    assert!((stepped["time_s"].as_f64().unwrap() - before - 90.5).abs() < 0.101, "{stepped}");
    assert_eq!(bench.get("dkg").await["clock"]["paused"], false, "each has its own");
    assert_eq!(bench.put("d/clock", json!({ "paused": false })).await.json()["speed"], 60.0);
}

#[tokio::test]
async fn a_run_by_steps_is_the_run_of_its_seed() {
    let bench = Bench::new().await;
    bench.step(123.0).await;
    let config = Config { profile: "datakom-dkg705".into(), unit: 2, ..Config::default() };
    let mut twin = Device::new(&config).unwrap();
    bench.emulation.controllers()[1].with(|device| {
        twin.advance(device.time());
        assert_eq!(twin.time(), device.time());
        for point in device.profile().points.iter().filter(|point| point.access.is_readable()) {
            let registers =
                |device: &Device| device.registers(point.address, point.registers).unwrap().to_vec();
            assert_eq!(registers(device), registers(&twin), "{}", point.id);
        }
    });
}

#[tokio::test]
async fn a_pulled_lever_acts_on_the_plant() {
    let bench = Bench::new().await;
    bench.step(1.0).await;
    assert!(bench.value("dkg", "mains.l1.voltage").await.as_f64().unwrap() > 200.0);
    let mains = bench.put("dkg/levers/mains", json!({ "position": "failed" })).await.json();
    assert_eq!((&mains["id"], &mains["position"]), (&json!("mains"), &json!("failed")));
    bench.step(2.0).await;
    assert_eq!(bench.value("dkg", "mains.l1.voltage").await, 0);
    let levers = bench.get("dkg/levers").await;
    assert!(levers.as_array().unwrap().contains(&mains), "{levers}");
    assert!(bench.value("d", "mains.l1.voltage").await.as_f64().unwrap() > 200.0, "of the other plant");
}

#[tokio::test]
async fn points_are_pinned_and_let_go() {
    let bench = Bench::new().await;
    bench.step(1.0).await;
    let free = bench.value("d", "battery.voltage").await;
    let pins = bench.put("d/pins/battery_voltage", json!({ "value": 11.5 })).await.json();
    assert_eq!(pins[0]["point"], "battery_voltage");
    assert_eq!((&pins[0]["value"], &pins), (&json!("11.5"), &bench.get("d/pins").await));
    bench.put("d/pins/operation_status", json!({ "value": "at_rest" })).await.json();
    assert_eq!(bench.value("d", "battery.voltage").await, 11.5);
    assert_eq!(bench.get("d").await["pinned"].as_array().unwrap().len(), 2);
    let left = bench.delete("d/pins/battery_voltage").await.json();
    assert_eq!(left.as_array().unwrap().len(), 1);
    assert_eq!(bench.value("d", "battery.voltage").await, free);
    assert_eq!(bench.delete("d/pins/battery_voltage").await.json(), left, "it was let go already");
}

#[tokio::test]
async fn settings_are_read_and_set() {
    let bench = Bench::new().await;
    for id in ["d", "dkg"] {
        for setting in bench.get(&format!("{id}/settings")).await.as_array().unwrap() {
            let (name, most) = (setting["id"].as_str().unwrap(), &setting["max"]);
            let settings = bench.put(&format!("{id}/settings/{name}"), json!({ "value": most })).await.json();
            let now = settings.as_array().unwrap().iter().find(|one| one["id"] == name).unwrap();
            assert_eq!(&now["value"], most, "{id} {name}");
        }
    }
}

#[tokio::test]
async fn every_alarm_is_listed_with_those_that_are_injected() {
    let bench = Bench::new().await;
    for id in ["d", "dkg"] {
        let alarms = bench.get(&format!("{id}/alarms")).await;
        let known =
            bench.emulation.controllers()[usize::from(id == "dkg")].with(|device| device.alarms().count());
        assert_eq!(alarms.as_array().unwrap().len(), known);
        assert!(alarms.as_array().unwrap().iter().all(|alarm| alarm["injected"] == false));
        assert_eq!(bench.get(id).await["injected"], json!([]));
    }
}

#[tokio::test]
async fn an_injected_alarm_is_the_panels_own_until_it_is_let_go() {
    let bench = Bench::new().await;
    let alarm = "shutdown_alarms.low_oil_pressure";
    bench.step(1.0).await;
    assert_eq!(bench.value("d", alarm).await, false);
    let path = format!("d/alarms/{alarm}");
    let injected = bench.ask(Method::PUT, &path, None).await.json();
    assert_eq!((&injected[0]["id"], &injected[0]["class"]), (&json!(alarm), &json!("shutdown")));
    assert_eq!(bench.ask(Method::PUT, &path, None).await.json(), injected, "once");
    bench.step(1.0).await;
    assert_eq!(bench.value("d", alarm).await, true);
    assert_eq!(bench.get("d").await["injected"], injected);
    let listed = bench.get("d/alarms").await;
    assert_eq!(listed.as_array().unwrap().iter().filter(|one| one["injected"] == true).count(), 1);
    assert_eq!(bench.delete(&path).await.json(), json!([]));
    assert_eq!(bench.delete(&path).await.json(), json!([]), "it was let go already");
}

#[tokio::test]
async fn values_are_what_clients_read() {
    let bench = Bench::new().await;
    let names = "state.engine,mode,breaker.mains.closed,genset.frequency,unit_mode";
    let values = bench.get(&format!("d/values?name={names}")).await;
    let said: Vec<_> = values.as_array().unwrap().iter().map(|one| (&one["name"], &one["value"])).collect();
    assert_eq!(
        said,
        [
            (&json!("state.engine"), &json!("stopped")),
            (&json!("mode"), &json!("auto")),
            (&json!("breaker.mains.closed"), &json!(true)),
            (&json!("genset.frequency"), &json!(0)),
            (&json!("unit_mode"), &json!("auto")),
        ]
    );
    assert_eq!((&values[3]["unit"], &values[0]["unit"]), (&json!("Hz"), &json!(null)));
    let every = bench.get("d/values").await;
    assert!(every.as_array().unwrap().len() > 100, "every signal that it has");
}
