//! Which reads a device is polled with, and what it taught us about them. No clock, no wire.

use std::time::Duration;

use busbar_profile::plan::{Cost, Planner, Read};
use busbar_profile::{Point, Profile, Rate};

use crate::rates::{POLLED, Rates};

/// A point that the device refuses by itself is asked for again this long after, in case it changed its mind.
const REST: Duration = Duration::from_secs(60);

/// The reads of one device, for whatever rates are due together.
#[derive(Debug)]
pub(crate) struct PollPlan {
    profile: &'static Profile,
    planner: Planner,
    /// What has been planned since the device last taught us something.
    plans: Vec<(Rates, Vec<Read>)>,
    /// Reads that the device refuses however small they are, and when it last did.
    refused: Vec<(Read, Duration)>,
    /// Reads that had no answer last time though the device answered others, the one that was tried longest ago first.
    mute: Vec<Mute>,
    /// Where a round begins.
    first: u16,
}

/// The reads of a round in which these rates are due.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlannedRound {
    pub(crate) rates: Rates,
    /// In address order, each with the rates that it serves.
    pub(crate) reads: Vec<(Read, Rates)>,
}

/// The plan as it stands, for people.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Overview {
    /// What is due most often first; each round holds the rates of the one before it.
    pub(crate) rounds: Vec<PlannedRound>,
    /// Reads that the device refuses however small they are.
    pub(crate) refused: Vec<Read>,
}

/// A read without an answer.
#[derive(Debug)]
struct Mute {
    read: Read,
    /// How often in a row.
    times: u32,
    /// Not to be tried before this.
    rests_until: Duration,
}

impl PollPlan {
    pub(crate) fn new(profile: &'static Profile, cost: Cost) -> Self {
        let planner = Planner::new(profile, cost);
        Self { profile, planner, plans: Vec::new(), refused: Vec::new(), mute: Vec::new(), first: 0 }
    }

    /// The reads to send at `now` for all points of these rates together, in address order. Of those that had no answer
    /// last time one comes along, at the end, so that it delays nothing.
    pub(crate) fn reads(&mut self, rates: Rates, now: Duration) -> Vec<Read> {
        let mut reads = self.plan(rates).to_vec();
        reads.retain(|read| !self.rests(*read, now));
        let planned = if self.mute.is_empty() { Vec::new() } else { reads.clone() };
        reads.retain(|read| !self.mute.iter().any(|mute| mute.read == *read));
        let first = reads.partition_point(|read| read.address < self.first);
        reads.rotate_left(first);
        // One is enough: several in a row would make the wire believe that its connection is dead.
        let awake = |mute: &&Mute| mute.rests_until <= now && planned.contains(&mute.read);
        reads.extend(self.mute.iter().find(awake).map(|mute| mute.read));
        reads
    }

    /// The reads of what is read on demand in a group, in address order. Of a picture the device refuses a part of,
    /// nothing is read for a while.
    pub(crate) fn on_demand(&self, group: usize, now: Duration) -> Vec<Read> {
        let rests = |point: &&Point| {
            let touches = |read: &Read| u32::from(point.address) < end(*read) && read.address <= point.last();
            self.refused.iter().any(|(read, at)| touches(read) && now < *at + REST)
        };
        let points = self.points(Rate::OnDemand.into()).filter(|point| point.group == group && !rests(point));
        self.planner.reads(points.map(|point| (point.address, point.registers)))
    }

    /// Whether the device is known to refuse this read however small it is.
    pub(crate) fn is_refused(&self, read: Read) -> bool {
        self.refused.iter().any(|(refused, _)| *refused == read)
    }

    fn rests(&self, read: Read, now: Duration) -> bool {
        self.refused.iter().any(|(refused, at)| *refused == read && now < *at + REST)
    }

    /// The device answered a read with its registers.
    pub(crate) fn accepted(&mut self, read: Read) {
        self.refused.retain(|(refused, _)| *refused != read);
    }

    /// The device answered a read, if only to refuse it.
    pub(crate) fn answered(&mut self, read: Read) {
        self.mute.retain(|mute| mute.read != read);
    }

    /// The device answered others, but not this read: it is tried again ever more rarely.
    pub(crate) fn unanswered(&mut self, read: Read, now: Duration) {
        let known = self.mute.iter().position(|mute| mute.read == read);
        let times = known.map_or(0, |index| self.mute.remove(index).times);
        let rest = match times {
            0 => Duration::ZERO,
            times => Duration::from_secs(1 << times.min(6)).min(REST),
        };
        self.mute.push(Mute { read, times: times.saturating_add(1), rests_until: now + rest });
    }

    /// The device answered nothing from the start of a round up to `read`: the next one begins behind it, in case it is
    /// only that part which never answers.
    pub(crate) fn gave_up_at(&mut self, read: Read) {
        self.first = read.address.saturating_add(read.count);
    }

    /// The plan as it stands now.
    pub(crate) fn overview(&self) -> Overview {
        let mut rounds: Vec<PlannedRound> = Vec::new();
        let mut rates = Vec::new();
        for rate in POLLED.into_iter().filter(|rate| self.has(*rate)) {
            rates.push(rate);
            let due: Rates = rates.iter().copied().collect();
            let serving = |read| rates.iter().copied().filter(|rate| self.serves(*rate, read)).collect();
            let reads = self.planner.reads(self.wanted(due)).into_iter().map(|read| (read, serving(read)));
            rounds.push(PlannedRound { rates: due, reads: reads.collect() });
        }
        let mut refused: Vec<Read> = self.refused.iter().map(|(read, _)| *read).collect();
        refused.sort_unstable_by_key(|read| read.address);
        Overview { rounds, refused }
    }

    /// Whether a point of this rate is in a read that had no answer.
    pub(crate) fn is_mute(&self, rate: Rate) -> bool {
        self.mute.iter().any(|mute| self.serves(rate, mute.read))
    }

    /// Whether a rate has anything to read.
    pub(crate) fn has(&self, rate: Rate) -> bool {
        !self.planner.reads(self.wanted(rate.into())).is_empty()
    }

    /// Whether any of `read` was read for a point of this rate.
    pub(crate) fn serves(&self, rate: Rate, read: Read) -> bool {
        !self.items(rate.into(), read.address.into(), end(read)).is_empty()
    }

    /// The device knows none, or not all, of the addresses of `read`: the reads to send in its place. None when it
    /// cannot be split further; it then rests for a while.
    pub(crate) fn refused(&mut self, rates: Rates, read: Read, now: Duration) -> Vec<Read> {
        let items = self.items(rates, read.address.into(), end(read));
        let Some(middle) = middle(&items) else {
            self.refused.retain(|(other, _)| *other != read);
            self.refused.push((read, now));
            return Vec::new();
        };
        self.split_at(middle);
        self.planner.reads(items)
    }

    fn split_at(&mut self, address: u16) {
        self.planner.split_at(address);
        self.plans.clear();
        self.mute.clear();
    }

    fn plan(&mut self, rates: Rates) -> &[Read] {
        let place = self.plans.iter().position(|(planned, _)| *planned == rates).unwrap_or_else(|| {
            self.plans.push((rates, self.planner.reads(self.wanted(rates))));
            self.plans.len() - 1
        });
        &self.plans[place].1
    }

    /// Address and length of the points of these rates between two addresses, in address order; of what comes in
    /// parts, the part that lies there.
    fn items(&self, rates: Rates, from: u32, end: u32) -> Vec<(u16, u16)> {
        let inside = |point: &Point| {
            let (first, behind) =
                (u32::from(point.address), u32::from(point.address) + u32::from(point.registers));
            if !self.comes_in_parts(point) {
                return (from <= first && behind <= end).then_some((point.address, point.registers));
            }
            let (first, behind) = (first.max(from), behind.min(end));
            let length = u16::try_from(behind.checked_sub(first)?).ok()?;
            (length > 0).then_some((u16::try_from(first).ok()?, length))
        };
        self.points(rates).filter_map(inside).collect()
    }

    /// What all points of these rates need.
    fn wanted(&self, rates: Rates) -> impl Iterator<Item = (u16, u16)> {
        self.points(rates).map(|point| (point.address, point.registers))
    }

    fn points(&self, rates: Rates) -> impl Iterator<Item = &'static Point> + use<> {
        let points = self.profile.points.iter();
        points.filter(move |point| rates.contains(point.rate) && point.access.is_readable())
    }

    /// What is longer than a read comes in parts.
    fn comes_in_parts(&self, point: &Point) -> bool {
        point.registers > self.profile.wire.max_read
    }
}

/// The address behind a read.
fn end(read: Read) -> u32 {
    u32::from(read.address) + u32::from(read.count)
}

/// Indexes of the readable points of a rate.
pub(crate) fn polled(profile: &Profile, rate: Rate) -> Vec<usize> {
    let points = profile.points.iter().enumerate();
    points
        .filter(|(_, point)| point.rate == rate && point.access.is_readable())
        .map(|(index, _)| index)
        .collect()
}

/// The address nearest the middle at which `items` can be parted without cutting one.
fn middle(items: &[(u16, u16)]) -> Option<u16> {
    let mut end = 0;
    let mut gaps = Vec::new();
    for (index, (address, registers)) in items.iter().enumerate() {
        if index > 0 && u32::from(*address) >= end {
            gaps.push((index.abs_diff(items.len() / 2), *address));
        }
        end = end.max(u32::from(*address) + u32::from(*registers));
    }
    gaps.into_iter().min().map(|(_, address)| address)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at, profile};

    fn plan() -> PollPlan {
        PollPlan::new(profile(), Cost::tcp(Duration::from_millis(5), 1_000_000))
    }

    fn spans(reads: &[Read]) -> Vec<(u16, u16)> {
        reads.iter().map(|read| (read.address, read.count)).collect()
    }

    #[test]
    fn reads_each_rate_and_bridges_what_is_cheap() {
        let mut plan = plan();
        assert_eq!(spans(&plan.reads(Rate::Fast.into(), at(0))), [(100, 12)]);
        assert_eq!(spans(&plan.reads(Rate::Slow.into(), at(0))), [(108, 2), (126, 2)]);
        // The curve is longer than a read.
        let once = plan.reads(Rate::Once.into(), at(0));
        assert!(once.iter().all(|read| read.count <= 16), "{once:?}");
        assert_eq!(once.iter().map(|read| read.count).sum::<u16>(), 21);
        assert_eq!(spans(&plan.on_demand(3, at(0))), [(152, 8)]);
        assert_eq!(plan.on_demand(0, at(0)), []);
    }

    #[test]
    fn rates_that_are_due_together_share_reads() {
        let mut plan = plan();
        // The hours lie between fast points.
        let together = Rates::from_iter([Rate::Fast, Rate::Slow]);
        assert_eq!(spans(&plan.reads(together, at(0))), [(100, 12), (126, 2)]);
        let due = plan.planner.due(profile(), &[Rate::Fast, Rate::Slow]);
        assert_eq!(plan.reads(together, at(0)), due.reads);
    }

    #[test]
    fn the_plan_can_be_shown() {
        let mut plan = plan();
        let shown = |plan: &PollPlan| {
            let round = |round: &PlannedRound| {
                let reads: Vec<_> = round.reads.iter().map(|(read, _)| *read).collect();
                (round.rates.iter().collect::<Vec<_>>(), spans(&reads))
            };
            plan.overview().rounds.iter().map(round).collect::<Vec<_>>()
        };
        let (fast, slow, once) = (Rate::Fast, Rate::Slow, Rate::Once);
        let rounds = shown(&plan);
        assert_eq!(rounds[0], (vec![fast], vec![(100, 12)]));
        assert_eq!(rounds[1], (vec![fast, slow], vec![(100, 12), (126, 2)]));
        assert_eq!((rounds.len(), &rounds[2].0), (3, &vec![fast, slow, once]));
        let serves: Vec<Vec<Rate>> =
            plan.overview().rounds[1].reads.iter().map(|(_, rates)| rates.iter().collect()).collect();
        assert_eq!(serves, [vec![fast, slow], vec![slow]]);

        // What the device refuses is told, and what it taught is planned around.
        let parts = plan.refused(fast.into(), Read { function: 3, address: 100, count: 12 }, at(0));
        assert_eq!(shown(&plan)[0].1, spans(&parts));
        let single = Read { function: 3, address: 111, count: 1 };
        assert!(plan.refused(fast.into(), single, at(0)).is_empty());
        assert_eq!(plan.overview().refused, [single]);
    }

    #[test]
    fn what_one_rate_taught_holds_for_all() {
        let mut plan = plan();
        let fast = plan.reads(Rate::Fast.into(), at(0))[0];
        let parts = plan.refused(Rate::Fast.into(), fast, at(0));
        assert_eq!(spans(&parts), [(100, 3), (104, 8)]);
        let together = Rates::from_iter([Rate::Fast, Rate::Slow]);
        assert_eq!(spans(&plan.reads(together, at(1))), [(100, 3), (104, 8), (126, 2)]);
    }

    #[test]
    fn a_shared_read_that_is_refused_costs_the_culprit_alone() {
        // This device has no hours, which lie among fast points.
        let refuses = |read: Read| read.covers(108, 1);
        let mut plan = plan();
        let together = Rates::from_iter([Rate::Fast, Rate::Slow]);
        let mut waiting = plan.reads(together, at(0));
        let mut answered = Vec::new();
        while let Some(read) = waiting.pop() {
            match refuses(read) {
                true => waiting.extend(plan.refused(together, read, at(0))),
                false => answered.push(read),
            }
        }
        for address in [100, 101, 102, 104, 106, 110, 111, 126] {
            assert!(answered.iter().any(|read| read.covers(address, 1)), "{address} was read");
        }
        for rates in [together, Rate::Fast.into(), Rate::Slow.into()] {
            assert!(!plan.reads(rates, at(1)).into_iter().any(refuses), "{rates:?}");
        }
    }

    #[test]
    fn a_refused_part_of_a_long_point_does_not_hide_its_neighbour() {
        // The identity lies before a curve that this device does not know.
        let refuses = |read: Read| read.address + read.count > 131;
        let mut plan = plan();
        let mut waiting = plan.reads(Rate::Once.into(), at(0));
        assert!(waiting[0].covers(130, 2), "{waiting:?}");
        let mut answered = Vec::new();
        while let Some(read) = waiting.pop() {
            match refuses(read) {
                true => waiting.extend(plan.refused(Rate::Once.into(), read, at(0))),
                false => answered.push(read),
            }
        }
        assert_eq!(spans(&answered), [(130, 1)]);
        assert!(plan.reads(Rate::Once.into(), at(61)).iter().any(|read| spans(&[*read]) == [(130, 1)]));
    }

    #[test]
    fn a_device_that_wants_pauses_gets_fewer_and_wider_reads() {
        let cost = Cost::rtu(9600, 10, Duration::ZERO);
        let smartgen = busbar_profile::builtin("smartgen-acc1700").unwrap();
        let mut apart = PollPlan::new(smartgen, cost);
        let mut wide = PollPlan::new(smartgen, cost.spaced(Duration::from_millis(500)));
        let (apart, wide) = (apart.reads(Rate::Fast.into(), at(0)), wide.reads(Rate::Fast.into(), at(0)));
        assert!(wide.len() < apart.len(), "{wide:?} and {apart:?}");
    }

    #[test]
    fn a_refused_read_is_halved_until_the_culprit_stands_alone() {
        let mut plan = plan();
        // This device does not know register 106.
        let refuses = |read: Read| read.covers(106, 1);
        let mut sent = 0;
        let mut answered = Vec::new();
        let mut waiting = plan.reads(Rate::Fast.into(), at(0));
        while let Some(read) = waiting.pop() {
            sent += 1;
            match refuses(read) {
                true => waiting.extend(plan.refused(Rate::Fast.into(), read, at(0))),
                false => answered.push(read),
            }
        }
        assert!(sent <= 8, "{sent} reads to find one register");
        for address in [100, 101, 102, 104, 110, 111] {
            assert!(answered.iter().any(|read| read.covers(address, 1)), "{address} was read");
        }

        // It is remembered: the next round meets no exception, and the culprit rests.
        let next = plan.reads(Rate::Fast.into(), at(1));
        assert!(!next.iter().any(|read| refuses(*read)), "{next:?}");
        let later = plan.reads(Rate::Fast.into(), at(61));
        assert_eq!(
            later.iter().filter(|read| refuses(**read)).map(|read| read.count).collect::<Vec<_>>(),
            [1]
        );
    }

    #[test]
    fn what_has_no_answer_comes_last_and_ever_more_rarely() {
        let mut plan = plan();
        let together = Rates::from_iter([Rate::Fast, Rate::Slow]);
        let reads = plan.reads(together, at(0));
        plan.unanswered(reads[0], at(0));
        assert_eq!(plan.reads(together, at(0)), [reads[1], reads[0]]);
        assert!(plan.is_mute(Rate::Fast) && !plan.is_mute(Rate::Once));
        for (second, next) in [(1, 3), (3, 7), (7, 15), (15, 31), (31, 63), (63, 123), (123, 183)] {
            plan.unanswered(reads[0], at(second));
            assert_eq!(plan.reads(together, at(next - 1)), [reads[1]], "at {second} s");
            assert_eq!(plan.reads(together, at(next)), [reads[1], reads[0]], "at {second} s");
        }
        plan.answered(reads[0]);
        assert_eq!(plan.reads(together, at(124)), reads);

        plan.unanswered(reads[1], at(124));
        plan.unanswered(reads[0], at(124));
        assert_eq!(plan.reads(together, at(124)), [reads[1]], "one of them at a time");
        plan.unanswered(reads[1], at(124));
        assert_eq!(plan.reads(together, at(124)), [reads[0]], "and then the other");
    }

    #[test]
    fn a_round_begins_behind_what_made_the_last_one_give_up() {
        let mut plan = plan();
        let together = Rates::from_iter([Rate::Fast, Rate::Slow]);
        let reads = plan.reads(together, at(0));
        plan.gave_up_at(reads[0]);
        assert_eq!(plan.reads(together, at(0)), [reads[1], reads[0]]);
        plan.gave_up_at(reads[1]);
        assert_eq!(plan.reads(together, at(0)), reads);
    }

    #[test]
    fn a_refused_single_point_cannot_be_split() {
        let mut plan = plan();
        let read = Read { function: 3, address: 104, count: 2 };
        assert_eq!(plan.refused(Rate::Fast.into(), read, at(0)), []);
    }
}
