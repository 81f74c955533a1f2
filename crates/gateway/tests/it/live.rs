//! What the device says is what the API shows.

use serde_json::json;

use crate::support::Bench;

#[tokio::test(flavor = "multi_thread")]
async fn values_appear() {
    let bench = Bench::new().await;
    let voltage = bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    assert_eq!(voltage["value"], json!(230.2));
    assert_eq!(voltage["unit"], "V");
    assert_eq!(voltage["raw"], json!([2302, 0]));
    let ts = voltage["ts"].as_str().unwrap();
    assert!(ts.ends_with('Z') && ts.len() == "2026-11-23T10:15:30.123Z".len(), "{ts}");

    let mode = bench.value("unit_mode").await;
    assert_eq!((&mode["value"], &mode["code"]), (&json!("AUTO"), &json!(4)));
}

#[tokio::test(flavor = "multi_thread")]
async fn every_polled_point_is_read() {
    let bench = Bench::new().await;
    bench.until_value("modem_imei", |value| value["quality"] == "good").await;
    bench.until_value("longitude", |value| value["quality"] == "good").await;
    bench.until_value("warning_alarms", |value| value["quality"] == "good").await;
    let values = bench.client.get("/api/v1/devices/gen1/values").await.json();
    let values = values.as_array().unwrap();
    assert!(values.len() > 100, "{}", values.len());
    for value in values {
        assert!(value["quality"] == "good" || value["quality"] == "invalid", "{value}");
    }
    // What is read on demand only is not there until it was, and what cannot be read never is.
    for absent in ["lcd", "scope", "push_buttons"] {
        assert!(!values.iter().any(|value| value["id"] == absent), "{absent}");
    }
    let most = bench.device.change(|device| device.reads.iter().map(|read| read.1).max());
    assert_eq!(most, Some(16), "never more than the device allows, and never less than it could");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_device_is_described() {
    let bench = Bench::with(|device| {
        device.registers.extend([(10_604, 5), (10_606, 7), (10_605, 2)]);
    })
    .await;
    let view = bench.until_view(|view| view["state"] != json!(null) && view["model"] == "D-500").await;
    let mut still = view.clone();
    still["last_seen"] = json!("[instant]");
    still["identity"]["checked"] = json!("[instant]");
    insta::assert_json_snapshot!(still);
    assert!(view["last_seen"].is_string() && view["identity"]["checked"].is_string());
}

#[tokio::test(flavor = "multi_thread")]
async fn alarms_are_listed_the_gravest_first() {
    let bench = Bench::with(|device| {
        // Bit 48 is bit 0 of the fourth register.
        device.registers.extend([(10_504 + 3, 1), (10_536, 1 << 5)]);
    })
    .await;
    let view =
        bench.until_view(|view| view["alarms"]["shutdown"] == 1 && view["alarms"]["warning"] == 1).await;
    assert_eq!(view["alarms"]["load_dump"], 0);
    let alarms = bench.client.get("/api/v1/alarms").await.json();
    let of = |index: usize, key: &str| alarms[index][key].clone();
    assert_eq!(
        (of(0, "point"), of(0, "bit"), of(0, "class")),
        (json!("shutdown_alarms"), json!(48), json!("shutdown"))
    );
    assert_eq!((of(0, "device"), of(0, "label")), (json!("gen1"), json!("Genset low frequency")));
    assert_eq!(
        (of(1, "point"), of(1, "bit"), of(1, "class")),
        (json!("warning_alarms"), json!(5), json!("warning"))
    );

    bench.device.change(|device| device.registers.clear());
    bench.until_view(|view| view["alarms"]["shutdown"] == 0).await;
    assert_eq!(bench.client.get("/api/v1/alarms").await.json(), json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn points_say_where_they_come_from() {
    let bench = Bench::new().await;
    let points = bench.client.get("/api/v1/devices/gen1/points").await.json();
    let all =
        points["groups"].as_array().unwrap().iter().flat_map(|group| group["points"].as_array().unwrap());
    let voltage = all.clone().find(|point| point["id"] == "genset_l1_voltage").unwrap();
    insta::assert_json_snapshot!(voltage);
    let alarms = all.clone().find(|point| point["id"] == "shutdown_alarms").unwrap();
    assert_eq!(alarms["bits"][0]["class"], "shutdown");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_wire_counts() {
    let bench = Bench::new().await;
    bench.until_view(|view| view["online"] == true).await;
    let wires = bench.client.get("/api/v1/wires").await.json();
    let wire = &wires[0];
    assert_eq!(
        (&wire["id"], &wire["state"], &wire["reason"]),
        (&json!("w1"), &json!("connected"), &json!(null))
    );
    assert_eq!(wire["endpoint"], format!("tcp://{}", bench.device.address()));
    let statistics = &wire["statistics"];
    assert!(statistics["answers"].as_u64().unwrap() > 0 && statistics["latency_ms"].as_f64().unwrap() > 0.0);
    assert_eq!(statistics["exceptions"], json!([]));
    for counter in ["wrong_unit", "wrong_function", "wrong_length", "wrong_echo", "wrong_protocol"] {
        assert_eq!(statistics[counter], 0, "{counter}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wire_is_told_in_detail() {
    let bench = Bench::new().await;
    bench.until_view(|view| view["online"] == true).await;
    let detail = bench.client.get("/api/v1/wires/w1").await.json();
    assert_eq!((&detail["wire"]["id"], &detail["wire"]["state"]), (&json!("w1"), &json!("connected")));
    let latency = &detail["latency"];
    let buckets = latency["buckets"].as_array().unwrap();
    let counted: u64 = buckets.iter().map(|bucket| bucket["count"].as_u64().unwrap()).sum();
    assert_eq!(
        (latency["count"].as_u64(), &buckets.last().unwrap()["up_to_ms"]),
        (Some(counted), &json!(null))
    );

    let unit = &detail["units"][0];
    assert_eq!(
        (&unit["unit"], &unit["device"], &unit["state"], &unit["next_probe_s"]),
        (&json!(1), &json!("gen1"), &json!("answering"), &json!(null))
    );
    assert_eq!((unit["answers"].as_u64(), &unit["time"]["busy_s"]), (Some(counted), &json!(null)));
    assert!(detail["open_s"].as_f64().unwrap() > 0.0, "{detail}");

    let plan = &detail["plans"][0];
    assert_eq!((&plan["device"], &plan["unit"], &plan["refused"]), (&json!("gen1"), &json!(1), &json!([])));
    let fast = &plan["rounds"][0];
    assert_eq!((&fast["rates"], &fast["every_s"]), (&json!(["fast"]), &json!(0.05)));
    assert_eq!(fast["reads"][0]["function"], 3);
    assert!(plan["rounds"].as_array().unwrap().len() == 3 && plan["refresh_ms"].is_null(), "{plan}");

    let unknown = bench.client.get("/api/v1/wires/w9").await.problem(404);
    assert_eq!(unknown, "there is no wire w9; this site has w1");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_device_refuses_is_in_its_plan() {
    let bench = Bench::with(|device| device.unknown = Some(10_246..=10_247)).await;
    let plan = async || bench.client.get("/api/v1/wires/w1").await.json()["plans"][0].clone();
    let plan = crate::support::until(plan, |plan| plan["refused"] != json!([])).await;
    assert_eq!((&plan["refused"][0]["address"], &plan["refused"][0]["count"]), (&json!(10_246), &json!(2)));
}
