//! Asks who answers in the place of the device, before anything else is asked or believed.

use std::time::Duration;

use busbar_profile::Rate;

use super::Poller;
use crate::device::{Check, Finding, Known, Question, Round};
use crate::failure::Failure;
use crate::rates::{POLLED, Rates};
use crate::wires;

impl Poller {
    /// Asks who answers. Gives back the answer if it is the device that the site file says; all else is handed to the
    /// hub as what became of a round of these rates.
    pub(super) async fn identify(&mut self, due: Rates) -> Option<Known> {
        // Of a wire that is only being connected the coming up is no news.
        let was_connected = self.is_connected();
        if was_connected {
            self.wire.mark_unchanged();
        }
        let (finding, held) = self.ask().await;
        if !was_connected {
            self.wire.mark_unchanged();
        }
        let now = self.hub.now();
        match finding? {
            Finding::Known(known) if known.is_wrong() => {
                let news = !self.schedule.is_wrong();
                let rates = if news { POLLED.into_iter().collect() } else { Rate::Fast.into() };
                self.schedule.wrong(now);
                self.demand.clear();
                // Who says another model than is wanted is no other family.
                self.other = Some(known.clone()).filter(|known| known.model.is_none());
                self.finish(Round { rates, identity: Some(known), ..Round::default() });
                None
            }
            Finding::Known(known) => {
                self.schedule.identified(now);
                self.other = None;
                Some(known)
            }
            Finding::Unclear(failure) => {
                self.schedule.unclear(now);
                let reads = self.plan.reads(due, now).into_iter();
                let failures = reads.map(|read| (read, failure.clone())).collect();
                self.finish(Round { rates: due, failures, ..Round::default() });
                None
            }
            Finding::Silent(failure) => {
                self.fell_silent(&failure, held);
                self.finish(Round { rates: due, silence: Some(failure), ..Round::default() });
                None
            }
        }
    }

    /// What its answers come to; and when the wire lets the next question through, where it held one back.
    async fn ask(&self) -> (Option<Finding>, Option<Duration>) {
        let mut check = {
            let live = self.slot.lock();
            Check::new(&self.site, live.device.expected(), self.other.clone())
        };
        let mut held = None;
        while let Some(Question { read, of }) = check.next() {
            // Whoever it is has the pauses that it wants.
            let link = self.link.with_spacing(wires::spacing(self.site.profile).max(wires::spacing(of)));
            let answer = link.read_registers(self.site.unit, read.function, read.address, read.count).await;
            let answer = match answer {
                Ok(registers) if registers.len() == usize::from(read.count) => Ok(registers),
                Ok(registers) => Err(Failure::Short { got: registers.len(), wanted: read.count }),
                Err(error) => Err(Failure::new(error, self.site.profile)),
            };
            if let Err(failure) = &answer {
                held = failure.next_probe().or(held);
            }
            check.take(answer);
        }
        (check.finding(), held)
    }
}
