//! What is due together is read together, and pauses are kept.

use std::time::Duration;

use busbar_profile::plan::{Cost, Planner, Read};
use busbar_profile::{Profile, Rate, builtin};
use serde_json::json;

use crate::support::{Imitation, site, start, until};

/// The cheapest reads for these rates together, over TCP as the gateway reckons it.
fn plan(profile: &Profile, rates: &[Rate]) -> Vec<(u16, u16)> {
    let pause = Duration::from_millis(profile.wire.spacing_ms.into());
    let planner = Planner::new(profile, Cost::tcp(Duration::from_millis(5), 1_000_000).spaced(pause));
    planner.due(profile, rates).reads.iter().map(|Read { address, count, .. }| (*address, *count)).collect()
}

fn smartgen(device: &Imitation, poll: &str) -> String {
    site(&format!("tcp://{}", device.address()))
        .replace("datakom-d", "smartgen-acc1700")
        .replace("fast = \"50ms\", slow = \"200ms\"", poll)
}

#[tokio::test(flavor = "multi_thread")]
async fn all_that_is_due_at_the_start_is_one_plan() {
    let device = Imitation::start().await;
    let rarely = site(&format!("tcp://{}", device.address()))
        .replace("fast = \"50ms\", slow = \"200ms\"", "fast = \"1h\", slow = \"1h\"");
    let (_gateway, client) = start(&rarely).await;
    let values = async || client.get("/api/v1/devices/gen1/values").await.json();
    let values = until(values, |values| values[0]["ts"].is_string()).await;
    // One round, so one instant for every rate.
    for value in values.as_array().unwrap() {
        assert_eq!(value["ts"], values[0]["ts"], "{value}");
    }
    let profile = builtin("datakom-d").unwrap();
    let shared = plan(profile, &[Rate::Fast, Rate::Slow, Rate::Once]);
    let apart: usize =
        [Rate::Fast, Rate::Slow, Rate::Once].map(|rate| plan(profile, &[rate]).len()).iter().sum();
    assert!(shared.len() < apart, "{} reads in place of {apart}", shared.len());
    // Before it, who is there.
    let reads = device.change(|device| device.reads.clone());
    assert_eq!((reads[0], &reads[1..]), ((10_609, 1), &shared[..]));
}

#[tokio::test(flavor = "multi_thread")]
async fn rates_that_fall_together_are_one_plan_each_time() {
    let device = Imitation::start().await;
    let both = site(&format!("tcp://{}", device.address())).replace("200ms\" }", "50ms\" }");
    let (_gateway, client) = start(&both).await;
    let mut stream = client.events("").await;
    let profile = builtin("datakom-d").unwrap();
    let first = plan(profile, &[Rate::Fast, Rate::Slow, Rate::Once]);
    let shared = plan(profile, &[Rate::Fast, Rate::Slow]);
    assert!(shared.len() < plan(profile, &[Rate::Fast]).len() + plan(profile, &[Rate::Slow]).len());
    // Before them, who is there.
    let wanted = 1 + first.len() + 3 * shared.len();
    let reads = async || device.change(|device| device.reads.clone());
    let reads = until(reads, |reads| reads.len() >= wanted).await;
    let reads = &reads[1..wanted];
    assert_eq!(reads[..first.len()], first);
    for round in reads[first.len()..].chunks(shared.len()) {
        assert_eq!(round, shared);
    }
    // Its readers are told of each rate, at the same instant.
    let fast = stream.until(|event| event.name == "values" && event.data["rate"] == "fast").await;
    let slow = stream.next().await.unwrap();
    assert_eq!((slow.name.as_str(), &slow.data["rate"]), ("values", &json!("slow")));
    assert_eq!(fast.data["ts"], slow.data["ts"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_has_its_pauses_and_wide_reads() {
    let device = Imitation::start().await;
    let one = smartgen(&device, "fast = \"50ms\", slow = \"1h\"");
    // A second unit on the same wire: its pauses are its own.
    let (_, table) = one.split_once("[[devices]]").unwrap();
    let table = table.replace("gen1", "gen2").replace("unit = 1", "unit = 2");
    let (_gateway, _client) = start(&format!("{one}\n[[devices]]{table}")).await;
    let times = async || device.change(|device| device.times.clone());
    let of = |times: &[(std::time::Instant, u8)], unit| {
        times.iter().filter(|read| read.1 == unit).map(|read| read.0).collect::<Vec<_>>()
    };
    let times = until(times, |times| of(times, 1).len() > 2 && of(times, 2).len() > 2).await;
    for unit in [1, 2] {
        for pair in of(&times, unit).windows(2) {
            let pause = pair[1].duration_since(pair[0]);
            assert!(pause >= Duration::from_millis(500), "unit {unit}: {pause:?}");
        }
    }
    let first = plan(builtin("smartgen-acc1700").unwrap(), &[Rate::Fast, Rate::Slow, Rate::Once]);
    let reads = device.change(|device| device.reads.clone());
    assert!(first.iter().take(2).all(|read| reads.contains(read)), "{reads:?} of {first:?}");
}
