//! The live site: what every device and wire shows now, and who is told when it changes.
//!
//! Every device has a lock of its own that is held for microseconds and never across an await, so a reader of the
//! API holds up no poller and one device holds up no other.

use std::collections::HashSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Duration;

use axum::http::StatusCode;
use busbar_profile::{Profile, Rate};
use tokio::time::Instant;

use crate::api::types::{
    AlarmView, AlarmsEvent, BesideView, ConfigView, DeviceView, JoinedView, PointsView, RefusedView,
    SiteInfo, SiteView, Time, ValueView, WireDetailView, WireView,
};
use crate::api::{PointsQuery, Problem, ValuesQuery};
use crate::device::{Changes, Device, Round, points_view};
use crate::events::{Channel, Draft};
use crate::gateway::Beside;
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
    /// Counts the tables that had other devices or wires than the one before.
    generation: AtomicU64,
    config: Mutex<Config>,
    started: Time,
    channel: Channel,
    stop: Stop,
    origin: Instant,
    health: Health,
    beside: Vec<BesideView>,
}

/// What became of the site files.
#[derive(Debug)]
struct Config {
    revision: u64,
    view: ConfigView,
}

impl Hub {
    pub(crate) fn new(table: Table, stop: Stop) -> Self {
        let now = wall_clock();
        Self {
            table: RwLock::new(Arc::new(table)),
            generation: AtomicU64::new(0),
            config: Mutex::new(Config { revision: 1, view: ConfigView { loaded: now, refused: None } }),
            started: now,
            channel: Channel::default(),
            stop,
            origin: Instant::now(),
            health: Health::default(),
            beside: Vec::new(),
        }
    }

    /// The same hub, which says what else is served.
    pub(crate) fn beside(mut self, beside: &[Beside]) -> Self {
        self.beside = beside.iter().map(BesideView::of).collect();
        self
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
        let (before, table) = (self.table(), Arc::new(table));
        *self.table.write().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&table);
        if before.is_same(&table) {
            self.tell(Draft::site(&self.info()));
        } else {
            // What is under way on their wires is nobody's any more, and behind the snapshot it would be a lie.
            let kept: HashSet<u64> = table.devices.iter().map(|slot| slot.key).collect();
            let gone = before.devices.iter().filter(|slot| !kept.contains(&slot.key));
            gone.for_each(|slot| slot.lock().is_gone = true);
            // Behind the table: who knows of the generation finds the table, or a newer one.
            let generation = self.generation.fetch_add(1, Ordering::SeqCst) + 1;
            self.tell([Draft::exchanged(generation)]);
        }
    }

    /// A newer site file was refused; the one before it goes on.
    pub(crate) fn refuse(&self, reason: String) {
        self.config().view.refused = Some(RefusedView { at: wall_clock(), reason });
        self.tell(Draft::site(&self.info()));
    }

    /// Which devices and wires there are, as a number: another one when they are others.
    pub(crate) fn generation(&self) -> u64 {
        self.generation.load(Ordering::SeqCst)
    }

    fn config(&self) -> MutexGuard<'_, Config> {
        self.config.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes over a finished round of a device and tells who listens.
    pub(crate) fn finish(&self, slot: &Slot, round: Round) {
        let (now, ts, rates) = (self.now(), wall_clock(), round.rates);
        let mut live = slot.lock();
        if live.is_gone {
            return;
        }
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
            if expired.is_empty() || live.is_gone {
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
        if !self.channel.listens(self.now()) {
            return;
        }
        let (of, device) = ((slot.key, live.sequence), &live.device);
        let mut drafts = Vec::new();
        for (rate, ts, changes) in rounds {
            drafts.push(Draft::values(of, device, (*rate, *ts), changes));
            if changes.alarms {
                let alarms = AlarmsEvent { device: slot.id.clone(), alarms: device.alarm_views() };
                drafts.push(Draft::device(of, "alarms", &alarms));
            }
            if changes.device {
                drafts.push(Draft::device(of, "device", &device.view()));
            }
        }
        self.channel.tell(drafts.into_iter().flatten());
    }

    fn tell(&self, drafts: impl IntoIterator<Item = Draft>) {
        if self.channel.listens(self.now()) {
            self.channel.tell(drafts);
        }
    }

    /// What is told to the readers of the event stream.
    pub(crate) fn channel(&self) -> &Channel {
        &self.channel
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
            beside: self.beside.clone(),
        }
    }

    pub(crate) fn site(&self) -> SiteView {
        let table = self.table();
        let devices = table.devices.iter().map(|slot| slot.lock().device.view()).collect();
        SiteView { site: self.info(), devices, diagram: table.diagram.clone() }
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
pub(crate) fn gravest_first(alarms: &mut [AlarmView]) {
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
    }
}
