//! Whether the gateway lives, and whether it has something to show yet.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use busbar_profile::Rate;

use crate::table::{Slot, Table};

/// Values are looked at for their age once a second; when that has not happened for so long, the gateway hangs.
const LATE: Duration = Duration::from_secs(10);

/// The pulse of the gateway.
#[derive(Debug, Default)]
pub(crate) struct Health {
    /// When values were last looked at, in milliseconds since the start.
    beat: AtomicU64,
    /// Once ready, it stays so: that a device dies or is added later is no reason to take the gateway out of service.
    ready: AtomicBool,
}

impl Health {
    /// Values were looked at.
    pub(crate) fn beat(&self, now: Duration) {
        self.beat.store(u64::try_from(now.as_millis()).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// When that was, in milliseconds since the start.
    pub(crate) fn last_beat(&self) -> u64 {
        self.beat.load(Ordering::Relaxed)
    }

    /// For how long they have not been, when that is too long.
    pub(crate) fn hangs(&self, now: Duration) -> Option<Duration> {
        let since = now.saturating_sub(Duration::from_millis(self.last_beat()));
        (since > LATE).then_some(since)
    }

    /// Ids of the devices that are still to be asked for the first time; none are waited for once it was ready.
    pub(crate) fn waits_for(&self, table: &Table) -> Vec<String> {
        if self.ready.load(Ordering::Relaxed) {
            return Vec::new();
        }
        let untried: Vec<String> =
            table.devices.iter().filter(|slot| !is_tried(slot)).map(|slot| slot.id.clone()).collect();
        self.ready.store(untried.is_empty(), Ordering::Relaxed);
        untried
    }
}

/// A device has been tried when it has given its first values, or when it is known what keeps it from that.
fn is_tried(slot: &Slot) -> bool {
    let live = slot.lock();
    let rates = [Rate::Fast, Rate::Slow, Rate::Once];
    live.device.fault().is_some() || rates.iter().any(|rate| live.device.last_round(*rate).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stop;
    use crate::testing::{answered, at, hub, silence};

    #[test]
    fn it_is_ready_when_every_device_was_tried_and_stays_so() {
        let hub = hub(&["gen1", "gen2"], stop::channel().1);
        let table = hub.table();
        let waits = || hub.health().waits_for(&table);
        assert_eq!(waits(), ["gen1", "gen2"]);
        hub.finish(&table.devices[1], answered(Rate::Fast, &[(100, &[0; 12])]));
        assert_eq!(waits(), ["gen1"]);
        hub.finish(&table.devices[0], silence());
        assert!(waits().is_empty(), "what is wrong with it is known");
        hub.finish(&table.devices[1], silence());
        assert!(waits().is_empty());
        assert!(hub.health().waits_for(&crate::testing::table(&["new"])).is_empty(), "nor for a new one");
    }

    #[test]
    fn a_pulse_that_stops_is_seen() {
        let health = Health::default();
        health.beat(at(100));
        assert_eq!(health.hangs(at(110)), None);
        assert_eq!(health.hangs(at(111)), Some(at(11)));
    }
}
