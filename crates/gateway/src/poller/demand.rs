//! What is read on demand: the groups that somebody looks at, and the pass that is under way. No clock, no wire.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_profile::plan::Read;
use busbar_profile::{Profile, Rate};

use crate::device::Round;
use crate::failure::Failure;
use crate::poll_plan::PollPlan;

/// What is to be read on demand of one device.
#[derive(Debug)]
pub(super) struct Demand {
    /// Groups in which something is read on demand.
    groups: Vec<usize>,
    /// Groups that somebody looks at.
    looked: Vec<usize>,
    /// Those that are still to be read this time.
    waiting: VecDeque<usize>,
    pass: Option<Pass>,
}

/// All reads of one group, handed over together: a picture of which each part is of another time is none.
#[derive(Debug)]
struct Pass {
    group: usize,
    reads: VecDeque<Read>,
    round: Round,
    began: Duration,
}

impl Demand {
    pub(super) fn new(profile: &Profile) -> Self {
        let points = || profile.points.iter().filter(|point| point.access.is_readable());
        let on_demand = |group: &usize| points().any(|p| p.group == *group && p.rate == Rate::OnDemand);
        let groups = (0..profile.groups.len()).filter(on_demand).collect();
        Self { groups, looked: Vec::new(), waiting: VecDeque::new(), pass: None }
    }

    /// Whether there is anything to read.
    pub(super) fn is_waiting(&self) -> bool {
        self.pass.is_some() || !self.waiting.is_empty()
    }

    /// Takes over which groups somebody looks at: a new one is read soon, and what nobody looks at any more is not.
    pub(super) fn look(&mut self, looked: &[usize]) {
        self.waiting.retain(|group| looked.contains(group));
        self.pass.take_if(|pass| !looked.contains(&pass.group));
        let new = self.groups.iter().filter(|group| looked.contains(group) && !self.looked.contains(group));
        self.waiting.extend(new);
        self.looked.clear();
        self.looked.extend_from_slice(looked);
    }

    /// Reads every group that is looked at once more, unless the last time is not over.
    pub(super) fn begin(&mut self) {
        if !self.is_waiting() {
            let looked = self.groups.iter().copied().filter(|group| self.looked.contains(group));
            self.waiting = looked.collect();
        }
    }

    /// Gives up what is under way.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.pass = None;
    }

    /// The next read, and the round that its answer goes to.
    pub(super) fn next(&mut self, plan: &PollPlan, now: Duration) -> Option<(Read, Round)> {
        while self.pass.is_none() {
            let group = self.waiting.pop_front()?;
            let reads = VecDeque::from(plan.on_demand(group, now));
            let round = Round { rates: Rate::OnDemand.into(), ..Round::default() };
            self.pass = Some(Pass { group, reads, round, began: now }).filter(|pass| !pass.reads.is_empty());
        }
        let pass = self.pass.as_mut()?;
        let read = pass.reads.pop_front()?;
        Some((read, std::mem::take(&mut pass.round)))
    }

    /// Takes back the round after a read, and the failure if the device did not answer it; gives out the round when
    /// there is nothing more to come.
    pub(super) fn took(
        &mut self,
        read: Read,
        mut round: Round,
        failure: Option<Failure>,
        now: Duration,
    ) -> Option<Round> {
        let mut pass = self.pass.take()?;
        if let Some(failure) = failure {
            // What comes behind is not worth its time-outs.
            let lost = std::iter::once(read).chain(pass.reads.drain(..));
            round.failures.extend(lost.map(|read| (read, failure.clone())));
        }
        if pass.reads.is_empty() {
            round.took = now.saturating_sub(pass.began);
            return Some(round);
        }
        pass.round = round;
        self.pass = Some(pass);
        None
    }
}

#[cfg(test)]
mod tests {
    use busbar_profile::plan::Cost;

    use super::*;
    use crate::testing::{at, timeout};

    const LCD: &str = "display";

    fn datakom() -> (&'static Profile, PollPlan, Demand) {
        let profile = busbar_profile::builtin("datakom-d").unwrap();
        (profile, PollPlan::new(profile, Cost::rtu(9600, 10, Duration::ZERO)), Demand::new(profile))
    }

    fn group(profile: &Profile, id: &str) -> usize {
        profile.groups.iter().position(|group| group.id == id).unwrap()
    }

    #[test]
    fn what_can_only_be_written_is_never_read() {
        let (profile, plan, mut demand) = datakom();
        demand.look(&[group(profile, "control"), group(profile, "identity")]);
        assert!(!demand.is_waiting() && demand.next(&plan, at(0)).is_none());
    }

    #[test]
    fn a_picture_is_one_round_of_all_its_reads() {
        let (profile, plan, mut demand) = datakom();
        let lcd = group(profile, LCD);
        demand.look(&[lcd, lcd]);
        for number in 1..=32 {
            // Looking anew begins nothing anew.
            demand.look(&[lcd]);
            demand.begin();
            let (read, mut round) = demand.next(&plan, at(number)).unwrap();
            round.answers.push((read.address, vec![0; read.count.into()]));
            let done = demand.took(read, round, None, at(number));
            assert_eq!(
                done.as_ref().map(|round| (round.answers.len(), round.took)),
                (number == 32).then_some((32, at(31)))
            );
        }
        assert!(!demand.is_waiting());
        demand.begin();
        assert!(demand.is_waiting(), "and once more with the next fast round");
    }

    #[test]
    fn it_stops_when_nobody_looks() {
        let (profile, plan, mut demand) = datakom();
        let lcd = group(profile, LCD);
        demand.look(&[lcd]);
        demand.next(&plan, at(0)).unwrap();
        demand.look(&[]);
        assert!(!demand.is_waiting());
        assert!(
            demand.took(Read { function: 3, address: 0, count: 1 }, Round::default(), None, at(0)).is_none()
        );
    }

    #[test]
    fn a_pass_ends_where_the_device_is_silent() {
        let (profile, plan, mut demand) = datakom();
        demand.look(&[group(profile, LCD)]);
        let (read, round) = demand.next(&plan, at(0)).unwrap();
        let round = demand.took(read, round, Some(timeout()), at(1)).unwrap();
        assert_eq!((round.failures.len(), round.answers.len(), demand.is_waiting()), (32, 0, false));
    }
}
