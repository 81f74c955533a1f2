//! What runs of a site: its open wires and the pollers of its devices, and what a reload keeps of them.

use std::collections::HashMap;
use std::sync::Arc;

use busbar_link::{Link, OpenError};
use tokio::task::JoinSet;

use crate::api::types::DiagramView;
use crate::device::Device;
use crate::hub::Hub;
use crate::poller::{PolledWire, Poller};
use crate::site::{Site, SiteDevice, SiteWire};
use crate::stop::{self, Announcer};
use crate::table::{Slot, Table};
use crate::wires;

/// The wires and devices that run.
#[derive(Debug, Default)]
pub(crate) struct Running {
    wires: Vec<RunningWire>,
    devices: Vec<RunningDevice>,
}

#[derive(Debug)]
struct RunningWire {
    site: SiteWire,
    link: Link,
}

#[derive(Debug)]
struct RunningDevice {
    /// Which of the wires it is on.
    wire: usize,
    site: SiteDevice,
    slot: Arc<Slot>,
    /// Ends its poller, dropped as well; none until it is polled.
    poller: Option<Announcer>,
}

/// A wire that cannot be opened.
#[derive(Debug)]
pub(crate) struct Unopened {
    pub(crate) wire: String,
    pub(crate) source: OpenError,
}

impl Running {
    /// What is to run for a site, taking over from `self` what the site did not change: the wire stays open and the
    /// device keeps its values. `self` still runs as it did.
    pub(crate) fn next(&self, site: &Site) -> Result<Self, Unopened> {
        let mut profiles = vec![Vec::new(); site.wires.len()];
        for device in &site.devices {
            profiles[device.wire].push(device.profile);
        }
        let running = self.wires_by_id();
        let wires = site.wires.iter().zip(&profiles).map(|(wire, profiles)| {
            let kept = running.get(wire.id.as_str()).filter(|running| running.site.is_same_line(wire));
            let link = match kept {
                Some(running) => running.link.clone(),
                None => wires::open(wire, profiles)
                    .map_err(|source| Unopened { wire: wire.id.clone(), source })?,
            };
            Ok(RunningWire { site: wire.clone(), link })
        });
        let wires: Vec<RunningWire> = wires.collect::<Result<_, _>>()?;
        let running: HashMap<&str, &RunningDevice> =
            self.devices.iter().map(|running| (running.site.id.as_str(), running)).collect();
        let devices = site.devices.iter().map(|device| {
            let wire = &site.wires[device.wire];
            let is_same = |running: &&&RunningDevice| {
                running.site.is_same_device(device) && self.wires[running.wire].site.is_same_line(wire)
            };
            let slot = match running.get(device.id.as_str()).filter(is_same) {
                Some(running) => Arc::clone(&running.slot),
                None => Arc::new(Slot::new(Device::new(device.clone(), wire.id.clone()))),
            };
            RunningDevice { wire: device.wire, site: device.clone(), slot, poller: None }
        });
        Ok(Self { devices: devices.collect(), wires })
    }

    fn wires_by_id(&self) -> HashMap<&str, &RunningWire> {
        self.wires.iter().map(|running| (running.site.id.as_str(), running)).collect()
    }

    /// The same as the API has it.
    pub(crate) fn table(&self, site: &Site) -> Table {
        Table {
            name: site.name.clone(),
            time_zone: site.time_zone.clone(),
            hosts: site.hosts.clone(),
            devices: self.devices.iter().map(|device| Arc::clone(&device.slot)).collect(),
            wires: self.wires.iter().map(|wire| (wire.site.id.clone(), wire.link.clone())).collect(),
            diagram: DiagramView::from(&site.diagram),
        }
    }

    /// Shows the frames of the wires that the site wants to be seen, and of no others any more.
    fn trace(&self, before: &Self) {
        let before = before.wires_by_id();
        for RunningWire { site, link } in &self.wires {
            let kept = before.get(site.id.as_str()).filter(|running| running.site.is_same_line(site));
            if kept.is_some_and(|running| running.site.trace) != site.trace {
                link.trace(site.trace.then(|| wires::frames::trace(&site.id, link)));
            }
        }
    }

    /// Goes on with the pollers of `before` and starts those that are missing; those that have no device any more end.
    pub(crate) fn poll(&mut self, mut before: Self, hub: &Arc<Hub>, tasks: &mut JoinSet<()>) {
        self.trace(&before);
        let pollers =
            before.devices.iter_mut().filter_map(|running| Some((running.slot.key, running.poller.take()?)));
        let mut pollers: HashMap<u64, Announcer> = pollers.collect();
        for device in &mut self.devices {
            device.poller = pollers.remove(&device.slot.key);
        }
        // Ends the pollers that are left, and with the last user of a wire that wire.
        drop((pollers, before));
        for (place, device) in self.devices.iter_mut().enumerate() {
            if device.poller.is_some() {
                continue;
            }
            let RunningWire { site, link } = &self.wires[device.wire];
            let wire = PolledWire {
                link: wires::for_polling(link),
                cost: wires::cost(&site.endpoint, device.site.profile),
                place,
            };
            let (announcer, stop) = stop::channel();
            tasks.spawn(Poller::new(Arc::clone(hub), Arc::clone(&device.slot), wire).run(stop));
            device.poller = Some(announcer);
        }
    }
}
