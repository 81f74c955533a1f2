//! Polls one device: a task that asks the wire and hands every finished round to the hub.

mod demand;
mod identify;

use std::sync::Arc;
use std::time::Duration;

use busbar_link::{Link, WireState};
use busbar_profile::plan::{Cost, Read};
use busbar_profile::{OverRead, Rate};
use tokio::sync::watch;

use self::demand::Demand;
use crate::device::{Known, Round};
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
    /// Whether the wire itself failed: then its return is worth a try at once.
    wire_failed: bool,
    plan: PollPlan,
    schedule: Schedule,
    /// Who answers, where that was asked and not told yet.
    known: Option<Known>,
    /// The other device that answers in its place.
    other: Option<Known>,
    /// Whether it answered all that it was asked in a round since a refusal made it doubtful.
    proven: bool,
    looks: watch::Receiver<Vec<usize>>,
    demand: Demand,
    /// Whether a read on demand may go before the next round, however late that is.
    owed: bool,
}

/// The wire of a device, as its poller sees it, and the place of the device among all.
pub(crate) struct PolledWire {
    pub(crate) link: Link,
    /// What a read costs on it.
    pub(crate) cost: Cost,
    /// Which of all devices it is.
    pub(crate) place: usize,
}

/// What comes next.
enum Turn {
    Round,
    OnDemand,
}

impl Poller {
    pub(crate) fn new(hub: Arc<Hub>, slot: Arc<Slot>, wire: PolledWire) -> Self {
        let PolledWire { link, cost, place } = wire;
        let site = slot.lock().device.site().clone();
        let link = link
            .with_short_answers(site.profile.wire.over_read == OverRead::Truncate)
            .with_spacing(wires::spacing(site.profile));
        Self {
            wire: link.state(),
            wire_failed: false,
            plan: PollPlan::new(site.profile, cost),
            schedule: Schedule::new(site.poll, place, hub.now()),
            known: None,
            other: None,
            proven: false,
            looks: slot.looks.watch(),
            demand: Demand::new(site.profile),
            owed: false,
            hub,
            slot,
            site,
            link,
        }
    }

    pub(crate) async fn run(mut self, mut stop: Stop) {
        tokio::select! {
            () = stop.requested() => {}
            () = self.poll() => {}
        }
    }

    async fn poll(&mut self) {
        let Some(probe) = POLLED.into_iter().find(|rate| self.plan.has(*rate)) else { return };
        self.slot.planned(self.plan.overview());
        loop {
            match self.next().await {
                Turn::Round => self.turn(probe).await,
                Turn::OnDemand => self.read_on_demand().await,
            }
        }
    }

    /// Waits for something to do. A silent device is worth a try as soon as its wire is up again.
    async fn next(&mut self) -> Turn {
        loop {
            let wait = self.schedule.next().saturating_sub(self.hub.now());
            let demand = self.demand.is_waiting();
            if demand && (self.owed || !wait.is_zero()) {
                self.owed = false;
                return Turn::OnDemand;
            }
            if wait.is_zero() {
                return Turn::Round;
            }
            let is_polled = self.schedule.is_polled();
            tokio::select! {
                () = tokio::time::sleep(wait) => {}
                Ok(()) = self.wire.changed(), if self.wire_failed || !self.schedule.is_silent() => {
                    self.wire.mark_unchanged();
                    self.other = None;
                    match self.is_connected() {
                        true if self.schedule.is_silent() => self.schedule.probe(self.hub.now()),
                        true => self.schedule.reconnected(self.hub.now()),
                        false => {}
                    }
                }
                Ok(()) = self.looks.changed(), if is_polled => {
                    self.demand.look(&self.looks.borrow_and_update());
                }
            }
        }
    }

    /// One round of what is due, of the device that the site file says.
    async fn turn(&mut self, probe: Rate) {
        let now = self.hub.now();
        if self.schedule.asks_identity(now) {
            self.known = self.identify(self.rates(probe)).await;
            if self.known.is_none() {
                return;
            }
        }
        let rates = self.rates(probe);
        if rates == Rates::default() {
            return;
        }
        let mut round = self.round(rates).await;
        let now = self.hub.now();
        match self.wire.has_changed() {
            Ok(true) => {
                self.wire.mark_unchanged();
                self.schedule.reconnected(now);
            }
            _ => self.schedule.steady(),
        }
        // Before these answers are believed.
        if round.silence.is_none() && self.schedule.is_doubted(now) {
            self.known = self.identify(rates).await;
            if self.known.is_none() || round.is_cut {
                return;
            }
        }
        round.identity = self.known.take();
        match &round.silence {
            Some(failure) => self.fell_silent(&failure.clone(), round.held()),
            None => {
                self.schedule.done(rates, now);
                self.proven |= round.failures.is_empty();
                if rates.contains(Rate::Once) && self.missed(Rate::Once, &round) {
                    self.schedule.missed_once();
                }
                if rates.contains(Rate::Fast) {
                    self.demand.look(&self.looks.borrow_and_update());
                    self.demand.begin();
                    self.owed = true;
                }
            }
        }
        self.finish(round);
    }

    /// What a round at this moment reads.
    fn rates(&self, probe: Rate) -> Rates {
        if self.schedule.is_silent() { probe.into() } else { self.schedule.due(self.hub.now()) }
    }

    fn finish(&mut self, round: Round) {
        self.hub.finish(&self.slot, round);
        // It may say in any round that it is another one.
        if !self.schedule.is_wrong() && self.slot.lock().device.is_wrong() {
            self.schedule.wrong(self.hub.now());
            self.demand.clear();
        }
    }

    fn fell_silent(&mut self, failure: &Failure, held: Option<Duration>) {
        let now = self.hub.now();
        match held {
            Some(again) => self.schedule.held(now, again),
            None => self.schedule.silent(now),
        }
        self.wire_failed = !failure.is_silence();
        self.other = None;
        self.demand.clear();
    }

    fn is_connected(&self) -> bool {
        matches!(*self.wire.borrow(), WireState::Connected)
    }

    /// One read of what somebody looks at.
    async fn read_on_demand(&mut self) {
        self.demand.look(&self.looks.borrow_and_update());
        let Some((read, mut round)) = self.demand.next(&self.plan, self.hub.now()) else { return };
        let failure = self.read(Rate::OnDemand.into(), read, &mut round).await;
        if self.wire.has_changed().unwrap_or(false) || round.is_cut {
            // Who answered is to be asked first.
            self.demand.clear();
            return;
        }
        if let Some(round) = self.demand.took(read, round, failure, self.hub.now()) {
            self.finish(round);
        }
    }

    /// Whether who answers may be asked once more because a read of these rates was refused. It is not when that is
    /// known of this very round; and that all the rest is answered does not speak for what is read on demand.
    fn may_doubt(&self, rates: Rates, now: Duration) -> bool {
        let is_proven = self.proven && !rates.contains(Rate::OnDemand);
        self.known.is_none() && (is_proven || self.schedule.may_doubt(now))
    }

    /// Whether points of a rate did not come for a reason that may pass.
    fn missed(&self, rate: Rate, round: &Round) -> bool {
        let mut failures = round.failures.iter().filter(|(_, failure)| failure.may_pass());
        self.plan.is_mute(rate) || failures.any(|(read, _)| self.plan.serves(rate, *read))
    }

    /// Sends the reads of these rates together, and those that the answers make necessary.
    async fn round(&mut self, rates: Rates) -> Round {
        let probing = self.schedule.is_silent();
        let mut round = Round { rates, ..Round::default() };
        let reads = self.plan.reads(rates, self.hub.now());
        let mut mute = Vec::new();
        let mut unanswered = 0;
        for (sent, read) in reads.iter().enumerate() {
            let Some(failure) = self.read(rates, *read, &mut round).await else {
                if round.is_cut {
                    return round;
                }
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
    /// did not answer at all, and cuts the round short where it is to be asked first who it is.
    async fn read(&mut self, rates: Rates, read: Read, round: &mut Round) -> Option<Failure> {
        let mut waiting = vec![read];
        while let Some(read) = waiting.pop() {
            let function = self.site.profile.wire.read_function();
            let answer = self.link.read_registers(self.site.unit, function, read.address, read.count).await;
            let failure = match answer {
                Ok(registers) if registers.len() == usize::from(read.count) => {
                    round.answers.push((read.address, registers));
                    self.plan.accepted(read);
                    continue;
                }
                // No read is longer than the device allows, so a shorter answer is a wrong one: who knows what of.
                Ok(registers) => Failure::Short { got: registers.len(), wanted: read.count },
                Err(error) => Failure::new(error, self.site.profile),
            };
            // What it always had it refuses now: perhaps it is another device, and the rest is not worth asking.
            let now = self.hub.now();
            if failure.is_refusal() && !self.plan.is_refused(read) && self.may_doubt(rates, now) {
                self.schedule.doubt(now);
                self.proven = false;
                round.is_cut = true;
                return None;
            }
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

#[cfg(test)]
mod tests;
