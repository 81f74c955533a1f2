//! What a caller can do wrong: a status and one sentence, and everything is as it was.

use axum::body::Body;
use axum::http::{Method, Request, header};
use serde_json::{Value, json};

use super::{Bench, at};

#[tokio::test]
async fn what_is_not_there_is_refused_by_name() {
    let bench = Bench::new().await;
    for (method, path, body, expected) in [
        ("GET", "gen9", None, "there is no controller gen9; there is d, dkg"),
        (
            "PUT",
            "d/levers/main",
            Some(json!({ "position": "failed" })),
            "the plant has no `main`; did you mean `mains`?",
        ),
        (
            "PUT",
            "d/pins/batery_voltage",
            Some(json!({ "value": 12 })),
            "the controller has no point `batery_voltage`; did you mean `battery_voltage`?",
        ),
        (
            "DELETE",
            "d/pins/batery_voltage",
            None,
            "the controller has no point `batery_voltage`; did you mean",
        ),
        (
            "PUT",
            "d/alarms/genset_low_frequenc",
            None,
            "the controller has no alarm `genset_low_frequenc`; did you mean shutdown_alarms.genset_low_frequency or",
        ),
        (
            "PUT",
            "d/settings/crank_tim",
            Some(json!({ "value": 1 })),
            "the controller has no setting `crank_tim`; did you mean `crank_time`?",
        ),
        (
            "GET",
            "d/nothing",
            None,
            "there is nothing at /api/v1/controllers/d/nothing; openapi.json lists what there is",
        ),
    ] {
        let problem = bench.ask(method.parse().unwrap(), path, body).await.problem(404);
        assert!(problem.contains(expected), "{path}: {problem}");
    }
    let problem = bench.ask(Method::GET, "d/values?name=mode,state.engin", None).await.problem(400);
    assert_eq!(problem, "the controller has no `state.engin`; did you mean `state.engine`?");
}

#[tokio::test]
async fn what_cannot_be_is_refused_with_what_can() {
    let bench = Bench::new().await;
    for (path, body, expected) in [
        (
            "d/levers/mains",
            json!({ "position": "broken" }),
            "`mains` cannot be `broken`; choose normal, failed",
        ),
        ("d/levers/mains", json!({ "position": 1e300 }), "`mains` cannot be `1000"),
        (
            "d/pins/battery_voltage",
            json!({ "value": "much" }),
            "cannot set battery_voltage to `much`: choose a number from",
        ),
        (
            "d/pins/push_buttons",
            json!({ "value": 1 }),
            "cannot set push_buttons to `1`: the point can only be written",
        ),
        (
            "d/alarms/genset_low_frequency",
            json!({}),
            "there are several alarms `genset_low_frequency`; choose shutdown_alarms.genset_low_frequency or",
        ),
        ("d/clock", json!({ "speed": 0 }), "speed 0 is not possible, choose a number above 0 and up to 3600"),
        ("d/clock", json!({ "speed": 3601 }), "speed 3601 is not possible"),
    ] {
        let problem = bench.put(path, body).await.problem(422);
        assert!(problem.starts_with(expected), "{path}: {problem}");
    }
    for seconds in [json!(0), json!(-1), json!(3600.1), json!(1e300)] {
        let body = json!({ "seconds": seconds });
        let problem = bench.ask(Method::POST, "d/steps", Some(body)).await.problem(422);
        assert!(problem.ends_with("choose a number above 0 and up to 3600"), "{problem}");
    }
}

#[tokio::test]
async fn bodies_that_are_none_are_refused() {
    let bench = Bench::new().await;
    let before = bench.get("dkg").await["levers"].clone();
    let send = async |method: &str, path: &str, kind: Option<&str>, body: String| {
        let mut request = Request::builder().method(method).uri(at(path));
        if let Some(kind) = kind {
            request = request.header(header::CONTENT_TYPE, kind);
        }
        bench.send(request.body(Body::from(body)).unwrap()).await
    };
    let json = Some("application/json");
    for body in [
        "",
        "{",
        "null",
        "[]",
        "{}",
        "{\"position\":true}",
        "{\"position\":\"failed\",\"now\":1}",
        "\u{fffd}",
    ] {
        let problem = send("PUT", "dkg/levers/mains", json, body.to_owned()).await.problem(400);
        assert!(problem.starts_with("the body is not what is needed: "), "{body}: {problem}");
    }
    let list = send("PUT", "dkg/clock", json, "[60, true]".to_owned()).await.problem(400);
    assert!(list.contains("an object is needed"), "{list}");
    let text = send("PUT", "dkg/clock", json, "{\"speed\":\"fast\"}".to_owned()).await.problem(400);
    assert!(text.contains("expected a number"), "{text}");
    for body in ["{\"speed\":null}", "{\"paused\":1}", "{\"step\":1}", "{\"speed\":1,\"speed\":2}"] {
        send("PUT", "dkg/clock", json, body.to_owned()).await.problem(400);
    }
    let large = format!("{{\"position\":\"{}\"}}", "a".repeat(10_000));
    let problem = send("PUT", "dkg/levers/mains", json, large).await.problem(413);
    assert!(problem.contains("8192 bytes"), "{problem}");
    // What a page elsewhere could make a browser send without asking first.
    for kind in [None, Some("text/plain"), Some("application/x-www-form-urlencoded")] {
        send("POST", "dkg/steps", kind, "{\"seconds\":1}".to_owned()).await.problem(415);
    }
    let asked_first = send("OPTIONS", "dkg/levers/mains", None, String::new()).await;
    assert!(asked_first.problem(405).contains("cannot be used with OPTIONS"));
    assert!(!asked_first.headers.contains_key(header::ACCESS_CONTROL_ALLOW_ORIGIN));
    for query in ["?names=mode", "?name=%FF", "?name=a&name=b"] {
        bench.ask(Method::GET, &format!("d/values{query}"), None).await.problem(400);
    }
    bench.ask(Method::GET, "%FF", None).await.problem(400);
    assert_eq!(bench.get("dkg").await["levers"], before);
    assert_eq!(bench.get("d/pins").await, Value::Array(Vec::new()));
}
