//! Rounds and readers on many threads at once: nobody misses a change, or hears of it out of order. Who comes back may
//! hear once more what happened while it was told the state, and nothing else twice.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use busbar_profile::Rate;
use serde_json::Value;
use tokio::task::JoinSet;

use super::tests::{reader, resumed, site, voltage};
use crate::hub::Hub;
use crate::testing::answered;

const DEVICES: [&str; 4] = ["gen1", "gen2", "gen3", "gen4"];

/// Fewer events than the ring holds, so that nobody may miss one.
const LAST: u16 = 2_000;

/// What the voltage's register holds, if it is told.
fn told(values: &Value) -> Option<u64> {
    let voltage = values.as_array()?.iter().find(|value| value["id"] == "voltage")?;
    voltage["raw"][0].as_u64()
}

/// Listens until every device is at its last value; goes away after so many events and comes back, or begins anew.
async fn listen(hub: Arc<Hub>, patience: usize, comes_back: bool) {
    let mut known: HashMap<String, u64> = HashMap::new();
    let (mut stream, mut heard, mut is_back) = (reader(&hub, ""), 0, false);
    // Of which devices something was told since it came back.
    let mut told_again = HashSet::new();
    while DEVICES.iter().any(|id| known.get(*id) != Some(&u64::from(LAST))) {
        let event = stream.next().await;
        let id = event.data["device"].as_str().unwrap_or_default().to_owned();
        match (event.name.as_str(), told(&event.data["changed"]), told(&event.data["values"])) {
            ("values", Some(now), _) => {
                let before = known.insert(id.clone(), now).expect("the state comes first");
                let is_first = told_again.insert(id) && is_back;
                assert!(now == before + 1 || (is_first && now <= before), "{before}, then {now}");
            }
            ("state", _, Some(now)) => {
                let before = known.insert(id, now);
                assert!(before.is_none_or(|before| before <= now), "{before:?}, then {now}");
            }
            _ => {}
        }
        // To be let in again is no news.
        heard += usize::from(event.name != "resumed");
        // Who goes in the middle of a state knows but a part of it.
        if heard >= patience && event.id.is_some() {
            (heard, is_back) = (0, comes_back);
            told_again.clear();
            stream = resumed(&hub, "", event.id.as_deref().filter(|_| comes_back));
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn every_change_is_told_once_and_in_order_whoever_comes_and_goes() {
    let (hub, _announcer) = site(&DEVICES);
    let finish = |hub: &Hub, device: usize, register: u16| {
        hub.finish(&hub.table().devices[device], answered(Rate::Fast, &[(100, &voltage(register))]));
    };
    for device in 0..DEVICES.len() {
        finish(&hub, device, 0);
    }
    let mut readers = JoinSet::new();
    for patience in [1, 2, 3, 7, 50, usize::MAX] {
        readers.spawn(listen(Arc::clone(&hub), patience, true));
        readers.spawn(listen(Arc::clone(&hub), patience.max(7), false));
    }
    let rounds: Vec<_> = (0..DEVICES.len())
        .map(|device| {
            let hub = Arc::clone(&hub);
            std::thread::spawn(move || (1..=LAST).for_each(|register| finish(&hub, device, register)))
        })
        .collect();
    while let Some(reader) = readers.join_next().await {
        reader.unwrap();
    }
    rounds.into_iter().for_each(|rounds| rounds.join().unwrap());
}
