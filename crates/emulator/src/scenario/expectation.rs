//! An expectation while it is under way: it waits for its condition, then for the end of the time that it has to hold.

use std::time::Duration;

use super::Expectation;
use crate::device::Device;

/// An expectation that has not been decided.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    pub(super) expectation: Expectation,
    pub(super) since: Duration,
    stage: Stage,
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    /// It has to hold at the latest by then.
    Waiting(Duration),
    /// It has to hold until then.
    Holding(Duration),
    /// It has to hold at once.
    Now,
}

impl Watch {
    /// An expectation that begins now.
    pub(super) fn new(expectation: Expectation, now: Duration) -> Self {
        let stage = match (expectation.wish.within, expectation.wish.lasting) {
            (Some(within), _) => Stage::Waiting(now + within),
            (None, Some(lasting)) => Stage::Holding(now + lasting),
            (None, None) => Stage::Now,
        };
        Self { expectation, since: now, stage }
    }

    /// Whether it is about this very moment.
    pub(super) fn is_immediate(&self) -> bool {
        matches!(self.stage, Stage::Now)
    }

    /// Whether it is decided by what a client would read now, and how.
    pub(super) fn judge(&mut self, now: Duration, device: &Device) -> Option<bool> {
        let holds = self.expectation.wish.condition.holds(device);
        match (self.stage, self.expectation.wish.lasting) {
            (Stage::Now, _) => Some(holds),
            (Stage::Waiting(_), Some(lasting)) if holds => {
                self.stage = Stage::Holding(now + lasting);
                None
            }
            (Stage::Waiting(_), None) if holds => Some(true),
            (Stage::Waiting(deadline), _) => (now >= deadline).then_some(false),
            (Stage::Holding(_), _) if !holds => Some(false),
            (Stage::Holding(until), _) => (now >= until).then_some(true),
        }
    }
}
