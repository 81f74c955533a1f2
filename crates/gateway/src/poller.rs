//! Polls one device: a task that asks the wire and hands every finished round to the hub.

use std::sync::Arc;

use busbar_link::{Link, WireState};
use busbar_profile::plan::{Cost, Read};
use busbar_profile::{OverRead, Rate};
use tokio::sync::watch;

use crate::device::Round;
use crate::failure::Failure;
use crate::hub::Hub;
use crate::poll_plan::PollPlan;
use crate::rates::{POLLED, Rates};
use crate::schedule::Schedule;
use crate::site::SiteDevice;
use crate::stop::Stop;
use crate::table::Slot;
use crate::wires;

/// So many reads in a row without an answer, each with its retries, and the device counts as silent.
const SILENT_READS: u32 = 2;

/// Polls one device until it is told to stop.
pub(crate) struct Poller {
    hub: Arc<Hub>,
    slot: Arc<Slot>,
    site: SiteDevice,
    link: Link,
    wire: watch::Receiver<WireState>,
    plan: PollPlan,
    /// Whether the wire itself failed: then its return is worth a try at once.
    wire_failed: bool,
}

/// The wire of a device, as its poller sees it.
pub(crate) struct PolledWire {
    pub(crate) link: Link,
    /// What a read costs on it.
    pub(crate) cost: Cost,
}

impl Poller {
    pub(crate) fn new(hub: Arc<Hub>, slot: Arc<Slot>, wire: PolledWire) -> Self {
        let PolledWire { link, cost } = wire;
        let site = slot.lock().device.site().clone();
        let plan = PollPlan::new(site.profile, cost);
        let link = link
            .with_short_answers(site.profile.wire.over_read == OverRead::Truncate)
            .with_spacing(wires::spacing(site.profile));
        Self { hub, slot, wire: link.state(), site, link, plan, wire_failed: false }
    }

    pub(crate) async fn run(mut self, mut stop: Stop) {
        tokio::select! {
            () = stop.requested() => {}
            () = self.poll() => {}
        }
    }

    async fn poll(&mut self) {
        let Some(probe) = POLLED.into_iter().find(|rate| self.plan.has(*rate)) else { return };
        let mut schedule = Schedule::new(self.site.poll, self.hub.now());
        let mut answered = false;
        self.slot.planned(self.plan.overview());
        loop {
            let due = self.next(&mut schedule).await;
            let rates = if schedule.is_silent() { probe.into() } else { due };
            let round = self.round(rates, schedule.is_silent()).await;
            match &round.silence {
                Some(failure) => {
                    let now = self.hub.now();
                    match round.held() {
                        Some(again) => schedule.held(now, again),
                        None => schedule.silent(now),
                    }
                    self.wire_failed = !failure.is_silence();
                }
                None => {
                    schedule.done(rates, self.hub.now());
                    if rates.contains(Rate::Once) && self.missed(Rate::Once, &round) {
                        schedule.missed_once();
                    }
                    // Behind a connection that was made anew there may be another device.
                    if self.wire.has_changed().unwrap_or(false) && answered {
                        schedule.identify(self.hub.now());
                    }
                    self.wire.mark_unchanged();
                    answered = true;
                }
            }
            self.hub.finish(&self.slot, round);
        }
    }

    /// Waits for the next round to be due. A silent device is worth a try as soon as its wire is up again.
    async fn next(&mut self, schedule: &mut Schedule) -> Rates {
        loop {
            let now = self.hub.now();
            let wait = schedule.next().saturating_sub(now);
            if wait.is_zero() {
                return schedule.due(now);
            }
            tokio::select! {
                () = tokio::time::sleep(wait) => {}
                Ok(()) = self.wire.changed(), if self.wire_failed && schedule.is_silent() => {
                    if matches!(*self.wire.borrow_and_update(), WireState::Connected) {
                        schedule.probe(self.hub.now());
                    }
                }
            }
        }
    }

    /// Whether points of a rate did not come for a reason that may pass.
    fn missed(&self, rate: Rate, round: &Round) -> bool {
        let mut failures = round.failures.iter().filter(|(_, failure)| failure.may_pass());
        self.plan.is_mute(rate) || failures.any(|(read, _)| self.plan.serves(rate, *read))
    }

    /// Sends the reads of these rates together, and those that the answers make necessary.
    async fn round(&mut self, rates: Rates, probing: bool) -> Round {
        let mut round = Round { rates, answers: Vec::new(), failures: Vec::new(), silence: None };
        let reads = self.plan.reads(rates, self.hub.now());
        let mut mute = Vec::new();
        let mut unanswered = 0;
        for (sent, read) in reads.iter().enumerate() {
            let Some(failure) = self.read(rates, *read, &mut round).await else {
                self.plan.answered(*read);
                unanswered = 0;
                continue;
            };
            unanswered += 1;
            let is_silence = failure.is_silence();
            round.failures.push((*read, failure.clone()));
            if is_silence {
                mute.push((*read, failure.clone()));
            }
            let held = failure.next_probe().is_some();
            if is_silence && unanswered < SILENT_READS && !probing && reads.len() > 1 && !held {
                continue;
            }
            // What comes behind is not worth its time-outs now.
            if is_silence && round.reached_the_device() {
                round.failures.extend(reads[sent + 1..].iter().map(|read| (*read, failure.clone())));
            } else {
                if !held {
                    self.plan.gave_up_at(*read);
                }
                // The first silence says most: what followed may be the wire's being made anew for it.
                let first = mute.first().filter(|_| is_silence).map(|(_, failure)| failure.clone());
                round.silence = Some(first.unwrap_or(failure));
            }
            break;
        }
        if round.reached_the_device() && round.silence.is_none() {
            mute.into_iter().for_each(|(read, _)| self.plan.unanswered(read, self.hub.now()));
        }
        round
    }

    /// One read of the plan, in smaller ones where the device wants it so. Gives back the failure when the device
    /// did not answer at all.
    async fn read(&mut self, rates: Rates, read: Read, round: &mut Round) -> Option<Failure> {
        let mut waiting = vec![read];
        while let Some(read) = waiting.pop() {
            let function = self.site.profile.wire.read_function();
            let answer = self.link.read_registers(self.site.unit, function, read.address, read.count).await;
            let failure = match answer {
                Ok(registers) if registers.len() == usize::from(read.count) => {
                    round.answers.push((read.address, registers));
                    continue;
                }
                // No read is longer than the device allows, so a shorter answer is a wrong one: who knows what of.
                Ok(registers) => Failure::Short { got: registers.len(), wanted: read.count },
                Err(error) => Failure::new(error, self.site.profile),
            };
            if failure.is_illegal_address() {
                let parts = self.plan.refused(rates, read, self.hub.now());
                self.slot.planned(self.plan.overview());
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
