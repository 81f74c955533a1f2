//! The live site: what every device and wire shows now, and who is told when it changes.
//!
//! Every device has a lock of its own that is held for microseconds and never across an await, so a reader of the
//! API holds up no poller and one device holds up no other.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Duration;

use axum::http::StatusCode;
use busbar_profile::{Profile, Rate};
use tokio::sync::broadcast;
use tokio::time::Instant;

use crate::api::types::{
    AlarmView, AlarmsEvent, ConfigView, DeviceSnapshot, DeviceView, JoinedView, PointsView, RefusedView,
    SiteInfo, SiteView, SnapshotEvent, Time, ValueView, ValuesEvent, WireDetailView, WireView,
};
use crate::api::{PointsQuery, Problem, ValuesQuery};
use crate::device::{Changes, Device, Round, points_view};
use crate::events::{Event, frame};
use crate::health::Health;
use crate::joined;
use crate::poll_plan::Overview;
use crate::rates::Rates;
use crate::site::SiteDevice;
use crate::stop::Stop;
use crate::table::{Live, Slot, Table};
use crate::wires;

/// The live site.
#[derive(Debug)]
pub(crate) struct Hub {
    table: RwLock<Arc<Table>>,
    config: Mutex<Config>,
    started: Time,
    events: broadcast::Sender<Arc<Event>>,
    stop: Stop,
    origin: Instant,
    health: Health,
}

/// What became of the site files.
#[derive(Debug)]
struct Config {
    revision: u64,
    view: ConfigView,
}

impl Hub {
    pub(crate) fn new(table: Table, stop: Stop) -> Self {
        // Room for the events of a few seconds; a reader that is further behind gets a snapshot, which costs less.
        let capacity = (table.devices.len() * 8).clamp(256, 16_384);
        let now = wall_clock();
        Self {
            table: RwLock::new(Arc::new(table)),
            config: Mutex::new(Config { revision: 1, view: ConfigView { loaded: now, refused: None } }),
            started: now,
            events: broadcast::Sender::new(capacity),
            stop,
            origin: Instant::now(),
            health: Health::default(),
        }
    }

    /// Time since the gateway started: the clock of every poller.
    pub(crate) fn now(&self) -> Duration {
        self.origin.elapsed()
    }

    /// Whether the gateway lives and is ready.
    pub(crate) fn health(&self) -> &Health {
        &self.health
    }

    /// Tells when the gateway is to end.
    pub(crate) fn stop(&self) -> Stop {
        self.stop.clone()
    }

    /// The devices and wires as they stand; whoever keeps it keeps what a reload may have replaced.
    pub(crate) fn table(&self) -> Arc<Table> {
        Arc::clone(&self.table.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Another site file runs from now on.
    pub(crate) fn exchange(&self, table: Table) {
        {
            let mut config = self.config();
            config.revision += 1;
            config.view = ConfigView { loaded: wall_clock(), refused: None };
        }
        *self.table.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(table);
        self.tell(Event::Exchanged);
    }

    /// A newer site file was refused; the one before it goes on.
    pub(crate) fn refuse(&self, reason: String) {
        self.config().view.refused = Some(RefusedView { at: wall_clock(), reason });
        let mut frames = Vec::new();
        frame(&mut frames, "site", &self.info());
        self.tell(Event::Site { frames: frames.into() });
    }

    fn config(&self) -> MutexGuard<'_, Config> {
        self.config.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes over a finished round of a device and tells who listens.
    pub(crate) fn finish(&self, slot: &Slot, round: Round) {
        let (now, ts, rates) = (self.now(), wall_clock(), round.rates);
        let mut live = slot.lock();
        let (was_online, had_fault) = (live.device.is_online(), live.device.fault().map(str::to_owned));
        let changes = live.device.finish(round, now, ts);
        note(&live.device, was_online, had_fault.as_deref());
        let rounds = by_rate(rates, ts, changes, live.device.site().profile);
        self.publish(slot, &mut live, &rounds);
    }

    /// Marks what became too old on any device.
    pub(crate) fn expire(&self) {
        self.health.beat(self.now());
        for slot in &self.table().devices {
            let mut live = slot.lock();
            let expired = live.device.expire(self.now());
            if expired.is_empty() {
                continue;
            }
            let at = |live: &Live, rate| live.device.last_round(rate).unwrap_or_else(wall_clock);
            let events: Vec<_> =
                expired.into_iter().map(|(rate, changes)| (rate, at(&live, rate), changes)).collect();
            self.publish(slot, &mut live, &events);
        }
    }

    fn publish(&self, slot: &Slot, live: &mut Live, rounds: &[(Rate, Time, Changes)]) {
        live.sequence += 1;
        if self.events.receiver_count() == 0 {
            return;
        }
        let device = &live.device;
        let id = &device.site().id;
        let mut frames = Vec::new();
        for (rate, ts, changes) in rounds {
            let changed = changes.values.iter().filter(|point| device.shows(**point));
            let values = ValuesEvent {
                device: id.clone(),
                rate: (*rate).into(),
                ts: *ts,
                changed: changed.map(|point| device.value(*point)).collect(),
                joined: changes.joined.iter().map(|signal| device.joined(*signal)).collect(),
            };
            frame(&mut frames, "values", &values);
            if changes.alarms {
                let alarms = AlarmsEvent { device: id.clone(), alarms: device.alarm_views() };
                frame(&mut frames, "alarms", &alarms);
            }
            if changes.device {
                frame(&mut frames, "device", &device.view());
            }
        }
        self.tell(Event::Device { key: slot.key, sequence: live.sequence, frames: frames.into() });
    }

    fn tell(&self, event: Event) {
        // Nobody listening is no error.
        let _ = self.events.send(Arc::new(event));
    }
}

/// What the API asks.
impl Hub {
    pub(crate) fn info(&self) -> SiteInfo {
        let table = self.table();
        let config = self.config();
        SiteInfo {
            name: table.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            started: self.started,
            time_zone: table.time_zone.clone(),
            revision: config.revision,
            config: config.view.clone(),
        }
    }

    pub(crate) fn site(&self) -> SiteView {
        SiteView { site: self.info(), devices: self.device_views(), diagram: self.table().diagram.clone() }
    }

    pub(crate) fn device_views(&self) -> Vec<DeviceView> {
        self.table().devices.iter().map(|slot| slot.lock().device.view()).collect()
    }

    pub(crate) fn device_view(&self, id: &str) -> Result<DeviceView, Problem> {
        Ok(self.device(id)?.lock().device.view())
    }

    pub(crate) fn points(&self, id: &str, query: &PointsQuery) -> Result<PointsView, Problem> {
        let profile = self.device(id)?.lock().device.site().profile;
        // Made when it is asked for: kept, it would be most of the memory of a large site.
        let points = points_view(profile);
        Ok(match &query.signal {
            Some(signals) => points.carrying(&signals.split(',').collect::<Vec<_>>()),
            None => points,
        })
    }

    pub(crate) fn values(&self, id: &str, query: &ValuesQuery) -> Result<Vec<ValueView>, Problem> {
        let slot = self.device(id)?;
        let live = slot.lock();
        let profile = live.device.site().profile;
        let group = match &query.group {
            Some(group) => {
                Some(profile.groups.iter().position(|known| known.id == *group).ok_or_else(|| {
                    let known: Vec<&str> = profile.groups.iter().map(|group| group.id.as_str()).collect();
                    bad_request(format!("{id} has no group {group}; it has {}", known.join(", ")))
                })?)
            }
            None => None,
        };
        let named = match &query.point {
            Some(points) => Some(
                points
                    .split(',')
                    .map(|point| {
                        profile.point_index(point).ok_or_else(|| {
                            bad_request(format!("{id} has no point {point}; see /api/v1/devices/{id}/points"))
                        })
                    })
                    .collect::<Result<Vec<usize>, Problem>>()?,
            ),
            None => None,
        };
        let wanted = |index: &usize| {
            live.device.shows(*index)
                && group.is_none_or(|group| profile.points[*index].group == group)
                && named.as_ref().is_none_or(|named| named.contains(index))
        };
        Ok((0..profile.points.len()).filter(wanted).map(|index| live.device.value(index)).collect())
    }

    pub(crate) fn joined(&self, id: &str) -> Result<Vec<JoinedView>, Problem> {
        Ok(self.device(id)?.lock().device.joined_views())
    }

    pub(crate) fn alarms(&self) -> Vec<AlarmView> {
        let mut alarms: Vec<AlarmView> =
            self.table().devices.iter().flat_map(|slot| slot.lock().device.alarm_views()).collect();
        gravest_first(&mut alarms);
        alarms
    }

    pub(crate) fn wires(&self) -> Vec<WireView> {
        self.table().wires.iter().map(|(id, link)| wires::view(id, link)).collect()
    }

    pub(crate) fn wire(&self, id: &str) -> Result<WireDetailView, Problem> {
        let table = self.table();
        let (id, link) = table.wire(id)?;
        let devices: Vec<(SiteDevice, Overview)> = table
            .devices
            .iter()
            .filter_map(|slot| {
                let live = slot.lock();
                (live.device.wire() == id).then(|| (live.device.site().clone(), slot.plan()))
            })
            .collect();
        Ok(wires::detail(id, link, &devices))
    }

    /// A device by its id.
    pub(crate) fn device(&self, id: &str) -> Result<Arc<Slot>, Problem> {
        self.table().device(id).map(Arc::clone)
    }

    /// Everything as it stands, and how to go on from there: the events that come after it, by device.
    pub(crate) fn snapshot(&self, only: Option<u64>) -> (SnapshotEvent, HashMap<u64, u64>) {
        let mut snapshot = SnapshotEvent { site: self.info(), devices: Vec::new(), alarms: Vec::new() };
        let mut sequences = HashMap::new();
        for slot in &self.table().devices {
            if only.is_some_and(|only| only != slot.key) {
                continue;
            }
            let live = slot.lock();
            sequences.insert(slot.key, live.sequence);
            let device = DeviceSnapshot {
                device: live.device.view(),
                values: live.device.values(),
                joined: live.device.joined_views(),
            };
            snapshot.devices.push(device);
            snapshot.alarms.extend(live.device.alarm_views());
        }
        gravest_first(&mut snapshot.alarms);
        (snapshot, sequences)
    }

    pub(crate) fn subscribe(&self) -> broadcast::Receiver<Arc<Event>> {
        self.events.subscribe()
    }
}

/// A round as its readers are told of it: once for each rate that was due. What came along goes with the first.
fn by_rate(rates: Rates, ts: Time, changes: Changes, profile: &Profile) -> Vec<(Rate, Time, Changes)> {
    let mut rounds: Vec<_> = rates.iter().map(|rate| (rate, ts, Changes::default())).collect();
    for index in changes.values {
        let own = rounds.iter().position(|(rate, ..)| *rate == profile.points[index].rate);
        if let Some((.., of_rate)) = rounds.get_mut(own.unwrap_or(0)) {
            of_rate.values.push(index);
        }
    }
    for index in changes.joined {
        let own =
            rounds.iter().position(|(rate, ..)| *rate == joined::rate(profile, &profile.joined()[index]));
        if let Some((.., of_rate)) = rounds.get_mut(own.unwrap_or(0)) {
            of_rate.joined.push(index);
        }
    }
    if let Some((.., last)) = rounds.last_mut() {
        (last.device, last.alarms) = (changes.device, changes.alarms);
    }
    rounds
}

fn bad_request(detail: String) -> Problem {
    Problem::new(StatusCode::BAD_REQUEST, detail)
}

/// Stable: devices stay in the order of the site file among equals.
fn gravest_first(alarms: &mut [AlarmView]) {
    alarms.sort_by_key(|alarm| (alarm.class, alarm.since));
}

/// Into the log what a person would want to find there: a device came, went, or has another fault.
fn note(device: &Device, was_online: bool, had_fault: Option<&str>) {
    let id = &device.site().id;
    match (device.fault(), had_fault) {
        (Some(fault), had) if had != Some(fault) => tracing::warn!(device = %id, "{fault}"),
        (None, Some(_)) => tracing::info!(device = %id, "answers again"),
        (None, None) if !was_online && device.is_online() => tracing::info!(device = %id, "answers"),
        _ => {}
    }
}

fn wall_clock() -> Time {
    Time::new(jiff::Timestamp::now())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stop;
    use crate::testing::{answered, hub};

    #[test]
    fn alarms_of_all_devices_are_listed_the_gravest_first() {
        let hub = hub(&["gen1", "gen2", "gen3"], stop::channel().1);
        let slots = &hub.table().devices;
        let alarms = |shutdowns, warnings| answered(Rate::Fast, &[(110, &[shutdowns, warnings])]);
        hub.finish(&slots[0], alarms(0, 1));
        hub.finish(&slots[1], alarms(1, 1));
        hub.finish(&slots[2], alarms(0, 0));
        let listed = |alarms: &[AlarmView]| {
            alarms.iter().map(|alarm| (alarm.device.clone(), alarm.point.clone())).collect::<Vec<_>>()
        };
        let expected = [("gen2", "shutdowns"), ("gen1", "warnings"), ("gen2", "warnings")];
        let expected = expected.map(|(device, point)| (device.to_owned(), point.to_owned()));
        assert_eq!(listed(&hub.alarms()), expected);
        assert_eq!(listed(&hub.snapshot(None).0.alarms), expected);
        assert_eq!(listed(&hub.snapshot(Some(slots[0].key)).0.alarms), expected[1..2]);
    }

    #[tokio::test]
    async fn a_round_of_two_rates_is_told_once_for_each() {
        let hub = hub(&["gen1"], stop::channel().1);
        let slots = &hub.table().devices;
        let mut events = hub.subscribe();
        let registers = [0, 1, 0, 0, 2302, 0, 215, 0, 1234, 0, 0, 0];
        let both = Rates::from_iter([Rate::Fast, Rate::Slow]);
        // Of the curve a part came along, which is none; the identity is whole.
        hub.finish(&slots[0], answered(both, &[(100, &registers), (126, &[9, 0, 0, 0, 2])]));
        let event = events.recv().await.unwrap();
        let Event::Device { frames, .. } = &*event else { panic!("of a device: {event:?}") };
        let told: Vec<serde_json::Value> = std::str::from_utf8(frames)
            .unwrap()
            .lines()
            .filter_map(|line| serde_json::from_str(line.strip_prefix("data: ")?).ok())
            .collect();
        let changed = |told: &serde_json::Value| {
            told["changed"].as_array().unwrap().iter().map(|v| v["id"].to_string()).collect::<Vec<_>>()
        };
        assert_eq!((&told[0]["rate"], &told[1]["rate"]), (&"fast".into(), &"slow".into()));
        assert_eq!(told[0]["ts"], told[1]["ts"]);
        assert_eq!(changed(&told[1]), ["\"hours\"", "\"starts\""]);
        assert_eq!(changed(&told[0]).len(), 8, "seven fast points and what came along: {}", told[0]);
        assert_eq!(told.len(), 3, "and the device once: {told:?}");
    }
}
