//! The devices and wires of the site file that runs now. A reload puts another table in its place; what it did not
//! change is the same in both.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::http::StatusCode;
use busbar_link::Link;

use crate::api::Problem;
use crate::api::types::DiagramView;
use crate::device::Device;
use crate::looks::Looks;
use crate::poll_plan::Overview;

/// What a site file makes up.
#[derive(Debug)]
pub(crate) struct Table {
    /// The name the site file gives.
    pub(crate) name: String,
    /// The time zone the site file gives.
    pub(crate) time_zone: Option<String>,
    /// Names besides those of this machine that a gateway for this machine alone answers to: a proxy passes them on.
    pub(crate) hosts: Vec<String>,
    /// In the order of the site file.
    pub(crate) devices: Vec<Arc<Slot>>,
    /// In the order of the site file: id and wire.
    pub(crate) wires: Vec<(String, Link)>,
    /// How it is connected.
    pub(crate) diagram: DiagramView,
}

/// How the devices of a gateway fare.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Tally {
    /// All devices of the site.
    pub devices: usize,
    /// Those that answer, if only to refuse.
    pub answering: usize,
    /// Those with a fault.
    pub faults: usize,
}

/// One device behind its lock.
#[derive(Debug)]
pub(crate) struct Slot {
    /// Never used twice in a process.
    pub(crate) key: u64,
    pub(crate) id: String,
    /// Who looks at what is read on demand.
    pub(crate) looks: Looks,
    live: Mutex<Live>,
    /// What it is read with; empty until its poller has begun.
    plan: Mutex<Overview>,
}

#[derive(Debug)]
pub(crate) struct Live {
    pub(crate) device: Device,
    /// Number of the last event of this device: an event that a snapshot already holds is not sent after it.
    pub(crate) sequence: u64,
    /// Whether the site file does not have it any more: another one may have its id.
    pub(crate) is_gone: bool,
}

impl Slot {
    pub(crate) fn new(device: Device) -> Self {
        static KEYS: AtomicU64 = AtomicU64::new(1);
        Self {
            key: KEYS.fetch_add(1, Ordering::Relaxed),
            id: device.site().id.clone(),
            looks: Looks::default(),
            live: Mutex::new(Live { device, sequence: 0, is_gone: false }),
            plan: Mutex::default(),
        }
    }

    /// A panic under this lock is caught by the task it happened in; what is left is still the last good state.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Live> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes over what the device is read with from now on.
    pub(crate) fn planned(&self, plan: Overview) {
        *self.plan.lock().unwrap_or_else(PoisonError::into_inner) = plan;
    }

    pub(crate) fn plan(&self) -> Overview {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Table {
    /// Whether it is the same devices and wires that make up another table.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let devices = |table: &Self| table.devices.iter().map(|slot| slot.key).collect::<Vec<_>>();
        let wires = |table: &Self| table.wires.iter().map(|wire| wire.0.clone()).collect::<Vec<_>>();
        devices(self) == devices(other) && wires(self) == wires(other)
    }

    /// How the devices fare.
    pub(crate) fn tally(&self) -> Tally {
        let mut tally = Tally { devices: self.devices.len(), ..Tally::default() };
        for slot in &self.devices {
            let live = slot.lock();
            tally.answering += usize::from(live.device.is_online());
            tally.faults += usize::from(live.device.fault().is_some());
        }
        tally
    }

    /// A device by its id.
    pub(crate) fn device(&self, id: &str) -> Result<&Arc<Slot>, Problem> {
        self.devices.iter().find(|slot| slot.id == id).ok_or_else(|| {
            let known: Vec<&str> = self.devices.iter().map(|slot| slot.id.as_str()).collect();
            unknown("device", id, &known)
        })
    }

    /// A wire by its id.
    pub(crate) fn wire(&self, id: &str) -> Result<&(String, Link), Problem> {
        self.wires.iter().find(|wire| wire.0 == id).ok_or_else(|| {
            let known: Vec<&str> = self.wires.iter().map(|(id, _)| id.as_str()).collect();
            unknown("wire", id, &known)
        })
    }
}

/// Most ids that a sentence names.
const MOST_NAMED: usize = 12;

fn unknown(kind: &str, id: &str, known: &[&str]) -> Problem {
    let detail = match known {
        [] => format!("there is no {kind} {id}: this site has none"),
        known if known.len() <= MOST_NAMED => {
            format!("there is no {kind} {id}; this site has {}", known.join(", "))
        }
        known => format!(
            "there is no {kind} {id}; this site has {} and {} more, which /api/v1/{kind}s lists",
            known[..MOST_NAMED].join(", "),
            known.len() - MOST_NAMED
        ),
    };
    Problem::new(StatusCode::NOT_FOUND, detail)
}
