//! Controllers whose plants are joined, and the one clock that all of them live by. One that is joined to nothing is a group
//! of its own.

use std::sync::{Arc, MutexGuard};
use std::thread;
use std::time::Duration;

use super::clock::{Clock, STRIDE};
use super::door::Served;
use super::shared::Shared;
use crate::device::Device;
use crate::fleet::{Joint, advance, join};

/// How long whoever makes it step looks whether somebody still waits, and how often at most.
const LOOK: Duration = Duration::from_micros(50);
const MOST_LOOKS: u32 = 40;
/// So much time passes at once in the largest group.
const SHORTEST: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub(super) struct Group {
    clock: Shared<Clock>,
    /// The joints name them by their index.
    devices: Vec<Arc<Served>>,
    joints: Vec<Joint>,
}

impl Group {
    /// A group at power-on.
    pub(super) fn new(clock: Clock, devices: Vec<Arc<Served>>, joints: Vec<Joint>) -> Self {
        let group = Self { clock: Shared::new(clock), devices, joints };
        join(&mut group.lock(), &group.joints);
        group
    }

    pub(super) fn clock(&self) -> MutexGuard<'_, Clock> {
        self.clock.lock()
    }

    /// Lets the devices live until the time that the clock then says. All their time passes here: whoever moves the clock
    /// holds it meanwhile, so that nobody else does.
    pub(super) fn live(&self, pass: impl FnOnce(&mut Clock) -> Duration) {
        let mut clock = self.clock.hold();
        let now = pass(&mut clock);
        advance(&mut self.lock(), &self.joints, now);
    }

    /// Lets in everybody who waits for the clock or for one of the devices.
    pub(super) fn give_way(&self) {
        let is_wanted = || self.clock.is_wanted() || self.devices.iter().any(|served| served.is_wanted());
        for _ in 0..MOST_LOOKS {
            if !is_wanted() {
                return;
            }
            thread::sleep(LOOK);
        }
    }

    /// So much time passes at once: the more plants, the less, but not so little that registers are filled all the time.
    pub(super) fn stride(&self) -> Duration {
        (STRIDE / u32::try_from(self.devices.len()).unwrap_or(u32::MAX)).max(SHORTEST)
    }

    /// Nobody else ever holds more than one of them.
    fn lock(&self) -> Vec<MutexGuard<'_, Device>> {
        self.devices.iter().map(|served| served.hold()).collect()
    }
}

/// Which controllers are joined to each other, directly or through others: each group in order, and the groups by their
/// first.
pub(super) fn groups(count: usize, joints: &[Joint]) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..count).collect();
    for joint in joints {
        let members = joint.members();
        let Some(first) = members.iter().filter_map(|member| group.get(*member)).min().copied() else {
            continue;
        };
        let joined: Vec<_> = members.iter().filter_map(|member| group.get(*member)).copied().collect();
        for mark in group.iter_mut().filter(|mark| joined.contains(mark)) {
            *mark = first;
        }
    }
    let firsts = (0..count).filter(|index| group[*index] == *index);
    firsts.map(|first| (0..count).filter(|index| group[*index] == first).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_more_plants_the_less_time_passes_at_once() {
        let stride = |plants: usize| {
            let served = || Arc::new(Served::new(Device::new(&crate::Config::default()).unwrap()));
            let devices = (0..plants).map(|_| served()).collect();
            Group { clock: Shared::new(Clock::new(1.0)), devices, joints: Vec::new() }.stride()
        };
        assert_eq!([1, 4, 10, 40].map(|plants| stride(plants).as_millis()), [10_000, 2_500, 1_000, 1_000]);
    }

    #[test]
    fn joined_is_who_is_joined_to_somebody_who_is() {
        let supply = |from, to| Joint::Supply { from, section: 0, to };
        assert_eq!(groups(3, &[]), [[0], [1], [2]]);
        let joints = [supply(4, 1), Joint::BusBar { gensets: vec![2, 3] }, supply(3, 0), supply(4, 3)];
        assert_eq!(groups(6, &joints), [vec![0, 1, 2, 3, 4], vec![5]]);
    }
}
