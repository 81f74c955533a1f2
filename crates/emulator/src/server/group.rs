//! Controllers whose plants are joined, and the one clock that all of them live by. One that is joined to nothing is a group
//! of its own.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::clock::Clock;
use super::door::Served;
use crate::device::Device;
use crate::fleet::{Joint, advance, join};

#[derive(Debug)]
pub(super) struct Group {
    clock: Mutex<Clock>,
    /// The joints name them by their index.
    devices: Vec<Arc<Served>>,
    joints: Vec<Joint>,
}

impl Group {
    /// A group at power-on.
    pub(super) fn new(clock: Clock, devices: Vec<Arc<Served>>, joints: Vec<Joint>) -> Self {
        let group = Self { clock: Mutex::new(clock), devices, joints };
        join(&mut group.lock(), &group.joints);
        group
    }

    pub(super) fn clock(&self) -> MutexGuard<'_, Clock> {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets the devices live until the time that the clock then says. All their time passes here: whoever moves the clock
    /// holds it meanwhile, so that nobody else does.
    pub(super) fn live(&self, pass: impl FnOnce(&mut Clock) -> Duration) {
        let mut clock = self.clock();
        let now = pass(&mut clock);
        advance(&mut self.lock(), &self.joints, now);
    }

    /// Nobody else ever holds more than one of them.
    fn lock(&self) -> Vec<MutexGuard<'_, Device>> {
        self.devices.iter().map(|served| served.lock()).collect()
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
    fn joined_is_who_is_joined_to_somebody_who_is() {
        let supply = |from, to| Joint::Supply { from, section: 0, to };
        assert_eq!(groups(3, &[]), [[0], [1], [2]]);
        let joints = [supply(4, 1), Joint::BusBar { gensets: vec![2, 3] }, supply(3, 0), supply(4, 3)];
        assert_eq!(groups(6, &joints), [vec![0, 1, 2, 3, 4], vec![5]]);
    }
}
