//! Polls one device: a task that asks the wire and hands every finished round to the hub.

use std::sync::Arc;

use busbar_link::{Link, WireState};
use busbar_profile::Rate;
use busbar_profile::plan::{Cost, Read};
use tokio::sync::watch;

use crate::device::Round;
use crate::failure::Failure;
use crate::hub::Hub;
use crate::poll_plan::{POLLED, PollPlan};
use crate::schedule::Schedule;
use crate::site::SiteDevice;

/// So many reads in a row without an answer, each with its retries, and the device counts as silent.
const SILENT_READS: u32 = 2;

/// Polls one device until the gateway ends.
pub(crate) struct Poller {
    hub: Arc<Hub>,
    /// Index of the device in the hub.
    device: usize,
    site: SiteDevice,
    link: Link,
    wire: watch::Receiver<WireState>,
    plan: PollPlan,
    /// Where a round begins: behind the read that made the last one give up, so that a part of the device that
    /// never answers does not hide the rest.
    first: usize,
    /// Whether the wire itself failed: then its return is worth a try at once.
    wire_failed: bool,
}

impl Poller {
    pub(crate) fn new(hub: Arc<Hub>, device: usize, site: SiteDevice, link: Link, cost: Cost) -> Self {
        let plan = PollPlan::new(site.profile, cost);
        Self { hub, device, wire: link.state(), site, link, plan, first: 0, wire_failed: false }
    }

    pub(crate) async fn run(mut self) {
        let mut stop = self.hub.stop();
        tokio::select! {
            () = stop.requested() => {}
            () = self.poll() => {}
        }
    }

    async fn poll(&mut self) {
        let Some(probe) = POLLED.into_iter().find(|rate| self.plan.has(*rate)) else { return };
        let mut schedule = Schedule::new(self.site.poll, self.hub.now());
        let mut answered = false;
        loop {
            let rate = self.next(&mut schedule).await;
            let rate = if schedule.is_silent() { probe } else { rate };
            let round = self.round(rate, schedule.is_silent()).await;
            match &round.silence {
                Some(failure) => {
                    schedule.silent(self.hub.now());
                    self.wire_failed = !failure.is_silence();
                }
                None => {
                    schedule.done(rate, self.hub.now());
                    // Behind a connection that was made anew there may be another device.
                    if self.wire.has_changed().unwrap_or(false) && answered {
                        schedule.identify(self.hub.now());
                    }
                    self.wire.mark_unchanged();
                    answered = true;
                }
            }
            self.hub.finish(self.device, round);
        }
    }

    /// Waits for the next rate to be due. A silent device is worth a try as soon as its wire is up again.
    async fn next(&mut self, schedule: &mut Schedule) -> Rate {
        loop {
            let (rate, at) = schedule.next();
            let wait = at.saturating_sub(self.hub.now());
            if wait.is_zero() {
                return rate;
            }
            tokio::select! {
                () = tokio::time::sleep(wait) => return rate,
                Ok(()) = self.wire.changed(), if self.wire_failed && schedule.is_silent() => {
                    if matches!(*self.wire.borrow_and_update(), WireState::Connected) {
                        schedule.probe(self.hub.now());
                    }
                }
            }
        }
    }

    /// Sends the reads of a rate, and those that the answers make necessary.
    async fn round(&mut self, rate: Rate, probing: bool) -> Round {
        let mut round = Round { rate, answers: Vec::new(), failures: Vec::new(), silence: None };
        let mut reads = self.plan.reads(rate, self.hub.now());
        let count = reads.len();
        reads.rotate_left(self.first % count.max(1));
        let mut unanswered = 0;
        for (sent, read) in reads.iter().enumerate() {
            let Some(failure) = self.read(rate, *read, &mut round).await else {
                unanswered = 0;
                continue;
            };
            unanswered += 1;
            let is_silence = failure.is_silence();
            round.failures.push((*read, failure.clone()));
            if is_silence && unanswered < SILENT_READS && !probing && count > 1 {
                continue;
            }
            // What comes behind is not worth its time-outs now, and comes first next time.
            self.first = (self.first + sent + 1) % count;
            if is_silence && round.reached_the_device() {
                round.failures.extend(reads[sent + 1..].iter().map(|read| (*read, failure.clone())));
            } else {
                round.silence = Some(failure);
            }
            break;
        }
        round
    }

    /// One read of the plan, in smaller ones where the device wants it so. Gives back the failure when the device
    /// did not answer at all.
    async fn read(&mut self, rate: Rate, read: Read, round: &mut Round) -> Option<Failure> {
        let mut waiting = vec![read];
        while let Some(read) = waiting.pop() {
            let function = self.site.profile.wire.read_function();
            let answer = self.link.read_registers(self.site.unit, function, read.address, read.count).await;
            let failure = match answer {
                Ok(mut registers) => {
                    let got = registers.len();
                    let rest = match got < usize::from(read.count) {
                        true => self.plan.cut(rate, read, &mut registers),
                        false => Vec::new(),
                    };
                    if !registers.is_empty() {
                        round.answers.push((read.address, registers));
                    }
                    if got >= usize::from(read.count) || !rest.is_empty() {
                        waiting.extend(rest.into_iter().rev());
                        continue;
                    }
                    Failure::Short { got, wanted: read.count }
                }
                Err(error) => Failure::new(error, self.site.profile),
            };
            if failure.is_illegal_address() {
                let parts = self.plan.refused(rate, read, self.hub.now());
                if !parts.is_empty() {
                    waiting.extend(parts.into_iter().rev());
                    continue;
                }
            }
            if !failure.device_answered() {
                return Some(failure);
            }
            round.failures.push((read, failure));
        }
        None
    }
}
