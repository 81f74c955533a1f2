//! The whole state, told device by device as the reader takes it: nobody's copy of a large site is ever in memory.

use std::collections::HashMap;
use std::sync::Arc;

use serde::Serialize;

use super::event::{ended, put};
use super::filter::{View, Wish};
use crate::api::types::{AlarmView, AlarmsEvent, StateEvent};
use crate::hub::{Hub, gravest_first};
use crate::table::{Slot, Table};

/// What is being told.
#[derive(Debug)]
pub(super) struct Whole {
    slots: Vec<Arc<Slot>>,
    stage: Stage,
    /// Which device comes next.
    at: usize,
    /// By key of the device: the last event that is in what was told.
    seen: HashMap<u64, u64>,
    alarms: Vec<AlarmView>,
    /// Number of the first event that may not be in it.
    position: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Head,
    Devices,
    /// In place of those two, for a reader that had them.
    Site,
    States,
}

impl Whole {
    /// A snapshot, and the states behind it.
    pub(super) fn snapshot(hub: &Hub, table: &Table, wish: &Wish) -> Self {
        Self::new(hub, table, wish, Stage::Head)
    }

    /// What replaces the events that a reader missed who knows the devices.
    pub(super) fn again(hub: &Hub, table: &Table, wish: &Wish) -> Self {
        Self::new(hub, table, wish, Stage::Site)
    }

    fn new(hub: &Hub, table: &Table, wish: &Wish, stage: Stage) -> Self {
        Self {
            // Before any device is looked at: what happens from here on may be missing.
            position: hub.channel().next(),
            slots: wish.slots(table).map(Arc::clone).collect(),
            stage,
            at: 0,
            seen: HashMap::new(),
            alarms: Vec::new(),
        }
    }

    /// Whether it is between two events, and could be given up.
    pub(super) fn is_between_events(&self) -> bool {
        self.stage != Stage::Devices
    }

    pub(super) fn is_done(&self) -> bool {
        self.stage == Stage::States && self.at == self.slots.len()
    }

    /// Where to go on, and what of that is known already, by device.
    pub(super) fn done(self) -> (u64, HashMap<u64, u64>) {
        (self.position, self.seen)
    }

    /// Appends the next part of it, a device at most.
    pub(super) fn tell(&mut self, hub: &Hub, view: &View, out: &mut Vec<u8>) {
        match self.stage {
            Stage::Head => {
                out.extend_from_slice(b"event: snapshot\ndata: {\"site\":");
                json(out, &hub.info());
                out.extend_from_slice(b",\"devices\":[");
                self.stage = Stage::Devices;
            }
            Stage::Devices => match self.slots.get(self.at) {
                Some(slot) => {
                    let (device, sequence) = {
                        let live = slot.lock();
                        self.alarms.extend(live.device.alarm_views());
                        (live.device.view(), live.sequence)
                    };
                    self.seen.insert(slot.key, sequence);
                    if self.at > 0 {
                        out.push(b',');
                    }
                    json(out, &device);
                    self.at += 1;
                }
                None => self.end_snapshot(hub, out),
            },
            Stage::Site => self.site(hub, out),
            Stage::States => self.state(hub, view, out),
        }
    }

    fn site(&mut self, hub: &Hub, out: &mut Vec<u8>) {
        put(out, "site", &hub.info(), self.id_if_last(hub).as_deref());
        self.stage = Stage::States;
    }

    /// The id of an event behind which there are no devices.
    fn id_if_last(&self, hub: &Hub) -> Option<String> {
        self.slots.is_empty().then(|| hub.channel().id(self.position))
    }

    fn end_snapshot(&mut self, hub: &Hub, out: &mut Vec<u8>) {
        let mut alarms = std::mem::take(&mut self.alarms);
        gravest_first(&mut alarms);
        out.extend_from_slice(b"],\"alarms\":");
        json(out, &alarms);
        out.push(b'}');
        ended(out, self.id_if_last(hub).as_deref());
        (self.stage, self.at) = (Stage::States, 0);
    }

    fn state(&mut self, hub: &Hub, view: &View, out: &mut Vec<u8>) {
        let Some(slot) = self.slots.get(self.at) else { return };
        self.at += 1;
        let live = slot.lock();
        let (device, profile) = (&live.device, live.device.site().profile);
        let points =
            (0..profile.points.len()).filter(|index| device.shows(*index) && view.has_point(profile, *index));
        let joined = (0..profile.joined().len()).filter(|index| view.has_joined(profile, *index));
        let state = StateEvent {
            device: slot.id.clone(),
            values: points.map(|index| device.value(index)).collect(),
            joined: joined.map(|index| device.joined(index)).collect(),
        };
        let known = self.seen.insert(slot.key, live.sequence);
        // What else may have changed since it was told.
        let rest = (known != Some(live.sequence)).then(|| (device.view(), device.alarm_views()));
        drop(live);
        if let Some((device, alarms)) = rest {
            put(out, "device", &device, None);
            put(out, "alarms", &AlarmsEvent { device: slot.id.clone(), alarms }, None);
        }
        let id = (self.at == self.slots.len()).then(|| hub.channel().id(self.position));
        put(out, "state", &state, id.as_deref());
    }
}

/// Our types serialise; should one ever not, the rest is still JSON.
fn json(out: &mut Vec<u8>, data: &impl Serialize) {
    let start = out.len();
    if serde_json::to_writer(&mut *out, data).is_err() {
        out.truncate(start);
        out.extend_from_slice(b"null");
    }
}
