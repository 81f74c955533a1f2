//! `busbar plan`.

use serde_json::{Value, json};

use crate::support::{busbar, call};

/// The sum of what the requests of a plan take.
fn sum(plan: &Value, of: impl Fn(u64) -> u64) -> u64 {
    plan["requests"].as_array().unwrap().iter().map(|request| of(request["count"].as_u64().unwrap())).sum()
}

#[test]
fn json_has_the_contracts_keys_and_the_figures_of_the_wire() {
    let call = busbar("plan datakom-d --json").ok().silently();
    let plan = call.json();
    let keys: Vec<&String> = plan.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["baud", "best_ms", "characters", "refresh_ms", "requests", "wire_ms"]);
    assert_eq!(plan["requests"][0], json!({ "function": 3, "address": 10240, "count": 16 }));
    assert_eq!(plan["requests"].as_array().unwrap().len(), 24);
    assert_eq!(plan["characters"], json!(sum(&plan, |count| 13 + 2 * count)));
    assert!(call.out().ends_with(
        "\"characters\":940,\"baud\":9600,\"wire_ms\":1154.2,\"best_ms\":1154.2,\"refresh_ms\":1154.2}\n"
    ));
}

#[test]
fn the_line_is_that_of_the_endpoint() {
    // 32 characters of 11 bits, and four silences: of 3.5 characters at 19200 baud, of 1.75 ms at 115200.
    let points = "genset_l1_voltage fuel_level";
    let ms = |query: &str| {
        let plan = busbar(&format!("plan datakom-d {points} --json --endpoint rtu:///dev/null?{query}"));
        let plan = plan.ok().silently().json();
        assert_eq!((&plan["characters"], &plan["wire_ms"]), (&json!(32), &plan["best_ms"]));
        (plan["baud"].clone(), plan["wire_ms"].clone())
    };
    assert_eq!(ms("baud=19200&parity=even"), (json!(19200), json!(26.4)));
    assert_eq!(ms("baud=115200&parity=odd&stop=2"), (json!(115_200), json!(10.3)));
    assert_eq!(ms("baud=9600"), (json!(9600), json!(47.9)));
}

#[test]
fn over_a_network_bytes_count_and_times_are_unknown() {
    let points = "genset_l1_voltage fuel_level scope";
    for (url, fixed) in [("tcp://192.0.2.1:502", 21), ("rtu+tcp://192.0.2.1:502", 13)] {
        let plan = busbar(&format!("plan datakom-d {points} --endpoint {url} --json")).ok().silently().json();
        assert_eq!(plan["characters"], json!(sum(&plan, |count| fixed + 2 * count)));
        assert_eq!(sum(&plan, |count| count), 2 + 1 + 100);
        for key in ["baud", "wire_ms", "best_ms", "refresh_ms"] {
            assert_eq!(plan[key], Value::Null, "{url} {key}");
        }
    }
}

#[test]
fn named_points_and_no_others() {
    let plan = busbar("plan datakom-d fuel_level genset_l1_voltage fuel_level --json").ok().json();
    assert_eq!(
        plan["requests"],
        json!([
            { "function": 3, "address": 10246, "count": 2 },
            { "function": 3, "address": 10363, "count": 1 }
        ])
    );
    // All but image and trace, unless they are named.
    let all = busbar("plan datakom-d --json").ok().json();
    let reads = |plan: &Value, address: u64| {
        let requests = plan["requests"].as_array().unwrap();
        requests.iter().any(|request| {
            let first = request["address"].as_u64().unwrap();
            (first..first + request["count"].as_u64().unwrap()).contains(&address)
        })
    };
    assert!(!reads(&all, 10404) && !reads(&all, 10648));
    let bulk = busbar("plan datakom-d lcd --json").ok().json();
    assert_eq!(sum(&bulk, |count| count), 512);
    assert!(bulk["requests"].as_array().unwrap().iter().all(|request| request["count"] == json!(16)));
}

#[test]
fn what_cannot_be_planned_is_one_sentence() {
    for (arguments, part) in [
        ("plan", "<KEY> is missing"),
        ("plan datakom-x", "there is no profile \"datakom-x\""),
        ("plan datakom-d l1_volt", "datakom-d has no point \"l1_volt\"; did you mean mains_l1_voltage"),
        ("plan datakom-d nothing", "\"busbar profile show datakom-d\" lists them"),
        ("plan datakom-d push_buttons", "push_buttons of datakom-d can be written and not read"),
        ("plan datakom-d --endpoint /dev/ttyUSB0", "no scheme; write rtu:///dev/ttyUSB0"),
        ("plan datakom-d --endpoint rtu:///dev/ttyUSB0?baud=9601x", "baud cannot be \"9601x\""),
    ] {
        busbar(arguments).refuses().says_in_one_sentence(part);
    }
    call(["plan", "datakom-d", ""]).refuses().says_in_one_sentence("datakom-d has no point \"\"");
}

#[test]
fn people_get_requests_and_totals() {
    insta::assert_snapshot!(busbar("plan datakom-d").ok().silently().out());
    let named = "plan datakom-d genset_l1_voltage unit_mode scope --endpoint tcp://192.0.2.1:502";
    insta::assert_snapshot!(busbar(named).ok().silently().out());
}
