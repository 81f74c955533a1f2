//! A hold on one running controller: to look at it, to act on it, and to rule its clock.

use std::sync::Arc;
use std::time::Duration;

use busbar_link::Endpoint;

use super::clock::{Pace, SpeedError};
use super::door::Served;
use super::group::Group;
use crate::device::Device;

/// One controller of an [`Emulation`](crate::Emulation) that runs. It stays as it is when that has ended.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(super) served: Arc<Served>,
    pub(super) group: Arc<Group>,
    pub(super) endpoints: Vec<Endpoint>,
}

impl Controller {
    /// Looks at the device or acts on it, between two steps of its plant and between two requests. Nobody is served
    /// meanwhile.
    pub fn with<T>(&self, act: impl FnOnce(&mut Device) -> T) -> T {
        act(&mut self.served.lock())
    }

    /// Where it answers: the endpoints that it shares first, then its own.
    pub fn endpoints(&self) -> &[Endpoint] {
        &self.endpoints
    }

    /// How its clock runs. Controllers whose plants are joined have one clock together.
    pub fn pace(&self) -> Pace {
        self.group.clock().pace()
    }

    /// Stops its clock, or lets it go on. Requests are answered all the same.
    pub fn pause(&self, paused: bool) {
        self.group.clock().pause(paused);
    }

    /// Changes how fast its clock runs, simulated seconds a second.
    ///
    /// # Errors
    /// No clock runs so fast, or backwards.
    pub fn run_at(&self, speed: f64) -> Result<(), SpeedError> {
        self.group.clock().run_at(speed)
    }

    /// Lets so much simulated time pass now, whether its clock runs or not. An hour is some work; other tasks of the
    /// thread wait for it, those of other threads do not.
    pub fn step(&self, by: Duration) {
        let mut left = by;
        while !left.is_zero() {
            let stride = left.min(self.group.stride());
            self.group.live(|clock| clock.step(stride));
            left -= stride;
            self.group.give_way();
        }
    }
}
