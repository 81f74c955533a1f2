//! What readers are told, in which order, and what becomes of those that fall behind.

use std::io::Read;
use std::sync::Arc;

use axum::body::Bytes;
use busbar_profile::Rate;
use flate2::read::GzDecoder;
use serde_json::{Value, json};
use tokio::time::Instant;

use super::filter::Wish;
use super::reader::{KEEP_ALIVE, REST, Reader};
use super::{Draft, beat, ring};
use crate::api::EventsQuery;
use crate::hub::Hub;
use crate::rates::Rates;
use crate::stop::{self, Announcer};
use crate::testing::{answered, hub, table};

const FAST: [u16; 12] = [0, 1, 0, 0, 2302, 0, 215, 0, 0, 0, 0, 0];

pub(super) fn voltage(tenths: u16) -> [u16; 12] {
    let mut registers = FAST;
    registers[4] = tenths;
    registers
}

pub(super) fn site(devices: &[&str]) -> (Arc<Hub>, Announcer) {
    let (announcer, stop) = stop::channel();
    let hub = Arc::new(hub(devices, stop));
    tokio::spawn(beat(Arc::clone(&hub)));
    (hub, announcer)
}

fn round(hub: &Hub, device: usize, registers: &[u16]) {
    hub.finish(&hub.table().devices[device], answered(Rate::Fast, &[(100, registers)]));
}

fn query(text: &str) -> EventsQuery {
    let mut query = EventsQuery::default();
    for (name, value) in text.split('&').filter_map(|pair| pair.split_once('=')) {
        let field = match name {
            "device" => &mut query.device,
            "group" => &mut query.group,
            "signal" => &mut query.signal,
            _ => panic!("{name}"),
        };
        *field = Some(value.to_owned());
    }
    query
}

fn wish(hub: &Hub, text: &str) -> Wish {
    Wish::new(&query(text), &hub.table()).unwrap_or_else(|_| panic!("{text}"))
}

pub(super) fn reader(hub: &Arc<Hub>, text: &str) -> Told {
    resumed(hub, text, None)
}

pub(super) fn resumed(hub: &Arc<Hub>, text: &str, last: Option<&str>) -> Told {
    Told { reader: Reader::new(Arc::clone(hub), wish(hub, text), last, false), text: String::new() }
}

/// One reader, event by event.
pub(super) struct Told {
    reader: Reader,
    text: String,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Event {
    pub(super) name: String,
    pub(super) data: Value,
    pub(super) id: Option<String>,
}

impl Told {
    pub(super) async fn next(&mut self) -> Event {
        while !self.text.contains("\n\n") {
            let chunk = self.reader.next().await.expect("the stream goes on");
            self.text.push_str(std::str::from_utf8(&chunk).unwrap());
        }
        let (event, rest) = self.text.split_once("\n\n").unwrap();
        let field = |name: &str| event.lines().find_map(|line| line.strip_prefix(name));
        let event = Event {
            name: field("event: ").unwrap_or("comment").to_owned(),
            data: field("data: ").map_or(Value::Null, |data| serde_json::from_str(data).unwrap()),
            id: field("id: ").map(str::to_owned),
        };
        self.text = rest.to_owned();
        event
    }

    /// Reads over the whole state; gives back its last id.
    async fn over_the_state(&mut self) -> String {
        loop {
            if let Some(id) = self.next().await.id {
                return id;
            }
        }
    }
}

fn ids(values: &Value) -> Vec<&str> {
    values.as_array().unwrap().iter().map(|value| value["id"].as_str().unwrap()).collect()
}

#[tokio::test]
async fn a_snapshot_first_then_each_state_then_what_changes() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    round(&hub, 0, &FAST);
    let mut told = reader(&hub, "");

    let first = told.next().await;
    assert_eq!((first.name.as_str(), &first.id), ("snapshot", &None));
    assert_eq!(first.data["site"]["name"], "Test");
    assert_eq!(first.data["alarms"], json!([]));
    let devices = first.data["devices"].as_array().unwrap();
    assert_eq!(devices.len(), 2);
    assert_eq!((&devices[0]["id"], &devices[0]["online"]), (&json!("gen1"), &json!(true)));
    assert_eq!((&devices[1]["id"], &devices[1]["online"]), (&json!("gen2"), &json!(false)));

    let states = [told.next().await, told.next().await];
    assert_eq!(states.each_ref().map(|event| event.name.as_str()), ["state", "state"]);
    assert_eq!(states.each_ref().map(|event| event.data["device"].as_str().unwrap()), ["gen1", "gen2"]);
    assert_eq!(states.each_ref().map(|event| event.id.is_some()), [false, true], "the last one has an id");
    let (values, joined) = {
        let slot = &hub.table().devices[0];
        let live = slot.lock();
        (live.device.values(), live.device.joined_views())
    };
    assert_eq!(states[0].data["values"], json!(values));
    assert_eq!(states[0].data["joined"], json!(joined));

    round(&hub, 0, &voltage(2310));
    let changed = told.next().await;
    assert_eq!((changed.name.as_str(), &changed.data["device"]), ("values", &json!("gen1")));
    assert!(changed.id.is_some());
    assert_eq!(
        (ids(&changed.data["changed"]), &changed.data["changed"][0]["value"]),
        (vec!["voltage"], &json!(231))
    );

    // A round that changed nothing says that everything was read.
    round(&hub, 0, &voltage(2310));
    let same = told.next().await;
    assert_eq!((&same.data["changed"], &same.data["rate"]), (&json!([]), &json!("fast")));
    assert_ne!(same.id, changed.id);
}

#[tokio::test]
async fn a_site_without_devices_has_a_whole_snapshot() {
    let (hub, _announcer) = site(&[]);
    let mut told = reader(&hub, "");
    let first = told.next().await;
    assert_eq!((first.name.as_str(), &first.data["devices"]), ("snapshot", &json!([])));
    assert!(first.id.is_some(), "nothing comes behind it");
}

#[tokio::test]
async fn an_alarm_is_told_with_the_device_it_changes() {
    let (hub, _announcer) = site(&["gen1"]);
    round(&hub, 0, &FAST);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    let mut alarmed = FAST;
    alarmed[10] = 1;
    round(&hub, 0, &alarmed);
    assert_eq!(told.next().await.name, "values");
    let alarms = told.next().await;
    assert_eq!((alarms.name.as_str(), &alarms.data["alarms"][0]["id"]), ("alarms", &json!("low_oil")));
    let device = told.next().await;
    assert_eq!((device.name.as_str(), &device.data["alarms"]["shutdown"]), ("device", &json!(1)));
    assert_eq!(reader(&hub, "").next().await.data["alarms"][0]["id"], "low_oil");
}

#[tokio::test]
async fn a_round_of_two_rates_is_told_once_for_each() {
    let (hub, _announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    let registers = [0, 1, 0, 0, 2302, 0, 215, 0, 1234, 0, 0, 0];
    let both = Rates::from_iter([Rate::Fast, Rate::Slow]);
    // Of the curve a part came along, which is none; the identity is whole.
    hub.finish(&hub.table().devices[0], answered(both, &[(100, &registers), (126, &[9, 0, 0, 0, 2])]));
    let (fast, slow) = (told.next().await.data, told.next().await.data);
    assert_eq!((&fast["rate"], &slow["rate"]), (&json!("fast"), &json!("slow")));
    assert_eq!(fast["ts"], slow["ts"]);
    assert_eq!(ids(&slow["changed"]), ["hours", "starts"]);
    assert_eq!(ids(&fast["changed"]).len(), 8, "seven fast points and what came along: {fast}");
    assert_eq!(told.next().await.name, "device");
}

#[tokio::test]
async fn what_was_read_on_demand_is_told_so() {
    let (hub, _announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "group=display");
    told.over_the_state().await;
    let picture = [0xAAAA; 8];
    hub.finish(&hub.table().devices[0], answered(Rate::OnDemand, &[(152, &picture)]));
    let event = told.next().await;
    assert_eq!((event.name.as_str(), &event.data["rate"]), ("values", &json!("on_demand")));
    assert_eq!(ids(&event.data["changed"]), ["picture"]);
}

#[tokio::test]
async fn what_happens_while_the_state_is_told_is_told_once() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let mut told = reader(&hub, "");
    // Before its first byte: it is in the state.
    round(&hub, 0, &voltage(2310));
    let state = loop {
        let event = told.next().await;
        if event.name == "state" {
            break event;
        }
    };
    assert!(state.data.to_string().contains("231"));
    told.over_the_state().await;
    round(&hub, 0, &voltage(2320));
    assert_eq!(told.next().await.data["changed"][0]["value"], 232);
}

#[tokio::test]
async fn what_changes_between_snapshot_and_state_is_told_with_the_state() {
    let devices: Vec<String> = (0..100).map(|number| format!("gen{number}")).collect();
    let (hub, _announcer) = site(&devices.iter().map(String::as_str).collect::<Vec<_>>());
    let mut told = reader(&hub, "");
    let snapshot = told.next().await;
    assert_eq!(snapshot.data["devices"][99]["online"], false);
    // The states are told as they are taken: this one is not told yet.
    round(&hub, 99, &FAST);
    let mut seen = Vec::new();
    loop {
        let event = told.next().await;
        if event.data["device"] == "gen99" || event.data["id"] == "gen99" {
            seen.push(event.name.clone());
        }
        if event.name == "device" {
            assert_eq!((&event.data["id"], &event.data["online"]), (&json!("gen99"), &json!(true)));
        }
        if event.id.is_some() {
            break;
        }
    }
    assert_eq!(seen, ["device", "alarms", "state"]);
    round(&hub, 0, &FAST);
    assert_eq!(told.next().await.data["device"], "gen0", "it is not told again");
}

#[tokio::test]
async fn who_comes_back_gets_what_it_missed() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let mut told = reader(&hub, "");
    let id = told.over_the_state().await;
    round(&hub, 0, &voltage(2310));
    let seen = told.next().await.id.unwrap();
    drop(told);
    round(&hub, 1, &voltage(2320));

    // The first round of a device changes its view as well.
    for (id, values) in [(&id, 2), (&seen, 1)] {
        let mut told = resumed(&hub, "", Some(id));
        let first = told.next().await;
        assert_eq!((first.name.as_str(), &first.data, first.id.as_ref()), ("resumed", &json!({}), Some(id)));
        let mut names = Vec::new();
        while names.iter().filter(|name| *name == "values").count() < values {
            names.push(told.next().await.name);
        }
        assert!(!names.contains(&"snapshot".to_owned()) && !names.contains(&"state".to_owned()), "{names:?}");
    }
    for id in ["0-0", "", &format!("{id}999"), &"9".repeat(60_000)] {
        assert_eq!(resumed(&hub, "", Some(id)).next().await.name, "snapshot", "{id:.20}");
    }
}

#[tokio::test]
async fn nothing_is_written_down_for_nobody() {
    let (hub, _announcer) = site(&["gen1"]);
    for _ in 0..10 {
        round(&hub, 0, &FAST);
    }
    assert!(hub.channel().from(9, 1).is_err(), "nobody was there to hear of it");
    let (next, mut told) = (hub.channel().next(), reader(&hub, ""));
    told.over_the_state().await;
    round(&hub, 0, &FAST);
    assert_eq!((hub.channel().next(), hub.channel().from(next, 9).unwrap().len()), (next + 1, 1));
}

#[tokio::test(start_paused = true)]
async fn a_reader_that_fell_behind_is_told_the_state_of_each_device() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    tokio::time::advance(REST).await;
    let flood = |hub: &Hub| {
        for step in 0..ring::MOST_EVENTS as u64 + 1 {
            hub.channel().tell(Draft::device((u64::MAX, step), "device", &json!({})));
        }
        round(hub, 0, &voltage(2999));
    };
    hub.refuse("line 3".to_owned());
    flood(&hub);
    let mut names = Vec::new();
    let mut last = None;
    while last.is_none() {
        let event = told.next().await;
        if event.data["device"] == "gen1" && event.name == "state" {
            assert!(event.data.to_string().contains("299.9"), "as it stands now");
        }
        if event.name == "site" {
            assert_eq!(event.data["config"]["refused"]["reason"], "line 3");
        }
        names.push(event.name);
        last = event.id;
    }
    assert_eq!(names, ["site", "device", "alarms", "state", "device", "alarms", "state"]);
    round(&hub, 1, &FAST);
    let event = told.next().await;
    assert_eq!((event.name.as_str(), &event.data["device"]), ("values", &json!("gen2")));
    told.next().await;

    // Again, and at once: the whole state comes, but not more often than it is worth.
    let before = Instant::now();
    flood(&hub);
    assert_eq!(told.next().await.name, "site");
    assert!(before.elapsed() > REST / 2 && before.elapsed() <= REST, "{:?}", before.elapsed());
}

#[tokio::test]
async fn a_reader_of_one_device_hears_of_no_other() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let mut told = reader(&hub, "device=gen2");
    let first = told.next().await;
    assert_eq!(first.data["devices"].as_array().unwrap().len(), 1);
    told.over_the_state().await;
    round(&hub, 0, &FAST);
    round(&hub, 1, &FAST);
    let event = told.next().await;
    assert_eq!((event.name.as_str(), &event.data["device"]), ("values", &json!("gen2")));
}

/// A round in which every polled point has another value than in the one before.
fn other_round(hub: &Hub) {
    let slot = &hub.table().devices[0];
    let turn = slot.lock().sequence as u16;
    let mode = 1 + turn % 2;
    let registers = [5 * (turn % 2), mode, turn, 0, 2302 + turn, 0, 215 + turn, 0, 1234 + turn, 0, 0, 0];
    let all = Rates::from_iter([Rate::Fast, Rate::Slow]);
    hub.finish(slot, answered(all, &[(100, &registers), (126, &[turn, 0])]));
}

#[tokio::test]
async fn only_what_is_asked_for_is_told() {
    let (hub, _announcer) = site(&["gen1"]);
    other_round(&hub);
    // Query, what it holds of the fast and of the slow points.
    for (query, fast, slow) in [
        ("signal=genset.l1.voltage,nonsense", "voltage", ""),
        ("signal=engine.hours", "", "hours"),
        ("group=service", "", "hours,starts"),
        ("group=service&signal=mode,state.engine", "status,mode", "hours,starts"),
        ("signal=", "", ""),
        ("group=state,service", "status,mode,timer,voltage,temperature", "hours,starts"),
    ] {
        // Two who want the same, and one who wants something else: each gets its own.
        let mut readers = [reader(&hub, query), reader(&hub, query)];
        let mut other = reader(&hub, "signal=mode");
        other.over_the_state().await;
        for told in &mut readers {
            assert_eq!(told.next().await.data["devices"].as_array().unwrap().len(), 1);
            let state = told.next().await;
            let known = |id: &&str| [fast, slow].iter().any(|list| list.split(',').any(|one| one == *id));
            let values = ids(&state.data["values"]);
            let unchanging = ["shutdowns", "warnings"];
            assert!(values.iter().all(|id| known(id) || unchanging.contains(id)), "{query}: {values:?}");
        }
        other_round(&hub);
        for told in &mut readers {
            for (rate, wanted) in
                [("fast", fast), ("slow", slow)].into_iter().filter(|(_, wanted)| !wanted.is_empty())
            {
                let event = told.next().await;
                assert_eq!((event.name.as_str(), &event.data["rate"]), ("values", &json!(rate)), "{query}");
                assert_eq!(ids(&event.data["changed"]).join(","), wanted, "{query}");
                assert_eq!(event.data["joined"], json!([]));
                assert!(event.id.is_some());
            }
            // What the device does is for everybody.
            assert_eq!(told.next().await.name, "device", "{query}");
        }
        assert_eq!(ids(&other.next().await.data["changed"]), ["mode"]);
    }
}

#[tokio::test]
async fn the_age_of_what_is_asked_for_is_told() {
    let (hub, _announcer) = site(&["gen1"]);
    round(&hub, 0, &FAST);
    let mut told = reader(&hub, "signal=genset.l1.voltage");
    told.over_the_state().await;
    let both = Rates::from_iter([Rate::Fast, Rate::Slow]);
    let mut warmer = FAST;
    warmer[6] += 1;
    hub.finish(&hub.table().devices[0], answered(both, &[(100, &warmer), (126, &[5, 0])]));
    let event = told.next().await;
    assert_eq!((&event.data["rate"], &event.data["changed"]), (&json!("fast"), &json!([])));
    hub.finish(&hub.table().devices[0], answered(Rate::Slow, &[(126, &[6, 0])]));
    round(&hub, 0, &voltage(2000));
    let event = told.next().await;
    assert_eq!(ids(&event.data["changed"]), ["voltage"], "nothing slow is asked for");
}

#[tokio::test]
async fn what_is_asked_for_must_be_there() {
    let (hub, _announcer) = site(&["gen1"]);
    let table = hub.table();
    let many = vec!["gen1"; 10_000].join(",");
    assert!(Wish::new(&query(&format!("device={many}&signal={many}")), &table).is_ok());
    for (text, status) in [
        ("device=gen9", 404),
        ("device=gen1,,", 404),
        (&format!("device={many},gen9"), 404),
        ("group=nonsense", 400),
        ("group=service,", 400),
    ] {
        let problem = Wish::new(&query(text), &table).unwrap_err();
        let response = axum::response::IntoResponse::into_response(problem);
        assert_eq!(response.status(), status, "{text:.40}");
    }
}

#[tokio::test]
async fn a_group_read_on_demand_is_looked_at_while_the_stream_is_open() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let looked = |hub: &Hub| {
        hub.table().devices.iter().map(|slot| slot.looks.watch().borrow().clone()).collect::<Vec<_>>()
    };
    let all = reader(&hub, "");
    let other = reader(&hub, "group=service&device=gen1");
    assert_eq!(looked(&hub), [vec![], vec![]] as [Vec<usize>; 2], "nothing else makes it read");
    let mut one = reader(&hub, "group=display&device=gen2");
    assert_eq!(looked(&hub), [vec![], vec![3]]);
    one.over_the_state().await;

    // Others take their place: it looks at those.
    hub.exchange(table(&["gen2", "gen1"]));
    assert_eq!(one.next().await.name, "snapshot");
    assert_eq!(looked(&hub), [vec![3], vec![]]);
    drop((one, all, other));
    assert_eq!(looked(&hub), [vec![], vec![]] as [Vec<usize>; 2]);
}

#[tokio::test]
async fn other_devices_begin_with_a_snapshot() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let (mut all, mut one) = (reader(&hub, ""), reader(&hub, "device=gen2"));
    let id = all.over_the_state().await;
    one.over_the_state().await;
    hub.exchange(table(&["gen1", "gen3"]));
    let told = all.next().await;
    assert_eq!((told.name.as_str(), &told.data["devices"][1]["id"]), ("snapshot", &json!("gen3")));
    assert_eq!(told.data["site"]["revision"], 2);
    assert_eq!(one.next().await.data["devices"], json!([]), "it is gone");
    all.over_the_state().await;
    // Who was away meanwhile knows nothing of them.
    let mut back = resumed(&hub, "", Some(&id));
    assert_eq!(back.next().await.name, "resumed");
    assert_eq!(back.next().await.name, "snapshot");

    round(&hub, 1, &FAST);
    assert_eq!(all.next().await.data["device"], "gen3");
}

#[tokio::test]
async fn what_was_under_way_of_a_device_that_is_gone_is_told_to_nobody() {
    let (hub, _announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    let gone = hub.table();
    // Another one of the same id, perhaps on another wire.
    hub.exchange(table(&["gen1"]));
    assert_eq!(told.next().await.name, "snapshot");
    told.over_the_state().await;
    hub.finish(&gone.devices[0], answered(Rate::Fast, &[(100, &voltage(6_666))]));
    round(&hub, 0, &voltage(2_310));
    let event = told.next().await;
    assert_eq!(event.name, "values");
    assert_eq!(event.data["changed"][3]["value"], json!(231), "{event:?}");
}

#[tokio::test]
async fn a_site_file_without_other_devices_is_told_by_itself() {
    let (hub, _announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    hub.refuse("line 3".to_owned());
    let event = told.next().await;
    assert_eq!((event.name.as_str(), &event.data["config"]["refused"]["reason"]), ("site", &json!("line 3")));
    let mut same = table(&[]);
    same.devices = hub.table().devices.clone();
    same.name = "Renamed".to_owned();
    hub.exchange(same);
    let event = told.next().await;
    assert_eq!((event.name.as_str(), &event.data["name"]), ("site", &json!("Renamed")));
}

#[tokio::test(start_paused = true)]
async fn silence_is_kept_alive() {
    let (hub, _announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "");
    told.over_the_state().await;
    let before = Instant::now();
    assert_eq!(told.reader.next().await.unwrap(), ": keep-alive\n\n");
    assert_eq!(before.elapsed(), KEEP_ALIVE);
}

#[tokio::test(start_paused = true)]
async fn who_wants_nothing_of_what_happens_is_kept_alive_all_the_same() {
    let (hub, _announcer) = site(&["gen1", "gen2"]);
    let mut told = reader(&hub, "device=gen2");
    told.over_the_state().await;
    let busy = Arc::clone(&hub);
    let talk = tokio::spawn(async move {
        for tenths in 0..100 {
            tokio::time::sleep(std::time::Duration::from_secs(1)).await;
            round(&busy, 0, &voltage(tenths));
        }
    });
    let before = Instant::now();
    for times in 1..=3 {
        assert_eq!(told.next().await.name, "comment");
        assert!(before.elapsed() <= KEEP_ALIVE * times + std::time::Duration::from_millis(2));
    }
    assert!(!talk.is_finished(), "there was something to tell each second");
}

#[tokio::test]
async fn the_stream_ends_with_the_gateway() {
    let (hub, announcer) = site(&["gen1"]);
    let mut told = reader(&hub, "");
    let mut early = reader(&hub, "");
    told.over_the_state().await;
    announcer.announce();
    assert_eq!(told.reader.next().await, None);
    assert_eq!(early.reader.next().await, None, "even before its first byte");
}

#[tokio::test(start_paused = true)]
async fn a_compressed_stream_is_the_same_stream() {
    let (hub, announcer) = site(&["gen1", "gen2"]);
    for text in ["", "signal=genset.l1.voltage", "device=gen1"] {
        let mut plain = reader(&hub, text);
        let mut packed = Reader::new(Arc::clone(&hub), wish(&hub, text), None, true);
        let (mut one, mut other) = (Vec::new(), Vec::new());
        for step in 0..50 {
            round(&hub, step % 2, &voltage(2_000 + step as u16));
            one.extend(plain.reader.next().await.unwrap());
            other.extend(packed.next().await.unwrap());
            // What came is all there already.
            let mut read = Vec::new();
            let _ = GzDecoder::new(&*other).read_to_end(&mut read);
            assert!(read == one, "{text} {step}");
        }
    }
    let mut packed = Reader::new(Arc::clone(&hub), wish(&hub, ""), None, true);
    let mut bytes = packed.next().await.unwrap().to_vec();
    announcer.announce();
    while let Some(more) = packed.next().await {
        bytes.extend(&more);
    }
    let mut read = String::new();
    GzDecoder::new(&*Bytes::from(bytes)).read_to_string(&mut read).expect("a whole stream");
    assert!(read.starts_with("event: snapshot\n") && read.ends_with("\n\n"));
}
