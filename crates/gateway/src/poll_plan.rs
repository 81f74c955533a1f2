//! Which reads a device is polled with, and what it taught us about them. No clock, no wire.

use std::time::Duration;

use busbar_profile::plan::{Cost, Planner, Read};
use busbar_profile::{Profile, Rate};

/// A point that the device refuses by itself is asked for again this long after, in case it changed its mind.
const REST: Duration = Duration::from_secs(60);

/// The rates that are polled; what is read on demand is not.
pub(crate) const POLLED: [Rate; 3] = [Rate::Fast, Rate::Slow, Rate::Once];

/// The reads of one device, by rate.
#[derive(Debug)]
pub(crate) struct PollPlan {
    profile: &'static Profile,
    planner: Planner,
    fast: RatePlan,
    slow: RatePlan,
    once: RatePlan,
}

#[derive(Debug, Default)]
struct RatePlan {
    /// Indexes of the readable points, in address order.
    points: Vec<usize>,
    reads: Vec<Read>,
    /// Reads that the device refuses however small they are, and when it last did.
    refused: Vec<(Read, Duration)>,
}

impl PollPlan {
    pub(crate) fn new(profile: &'static Profile, cost: Cost) -> Self {
        let of = |rate| RatePlan { points: polled(profile, rate), ..RatePlan::default() };
        let mut plan = Self {
            profile,
            planner: Planner::new(profile, cost),
            fast: of(Rate::Fast),
            slow: of(Rate::Slow),
            once: of(Rate::Once),
        };
        plan.replan();
        plan
    }

    /// The reads of a rate to send at `now`, in address order.
    pub(crate) fn reads(&self, rate: Rate, now: Duration) -> Vec<Read> {
        let Some(plan) = self.rate(rate) else { return Vec::new() };
        let rests =
            |read: &Read| plan.refused.iter().any(|(refused, at)| refused == read && now < *at + REST);
        plan.reads.iter().filter(|read| !rests(read)).copied().collect()
    }

    /// Whether a rate has anything to read.
    pub(crate) fn has(&self, rate: Rate) -> bool {
        self.rate(rate).is_some_and(|plan| !plan.reads.is_empty())
    }

    /// The device knows none, or not all, of the addresses of `read`: the reads to send in its place. None when it
    /// cannot be split further; it then rests for a while.
    pub(crate) fn refused(&mut self, rate: Rate, read: Read, now: Duration) -> Vec<Read> {
        let items = self.items(rate, read);
        let Some(middle) = middle(&items) else {
            if let Some(plan) = self.rate_mut(rate) {
                plan.refused.retain(|(other, _)| *other != read);
                plan.refused.push((read, now));
            }
            return Vec::new();
        };
        self.planner.split_at(middle);
        self.replan();
        self.planner.reads(items)
    }

    /// The device answered `read` with fewer registers than asked for: cuts off what holds no whole point, and gives
    /// the reads to send for the rest. None when not even the first point is whole.
    pub(crate) fn cut(&mut self, rate: Rate, read: Read, registers: &mut Vec<u16>) -> Vec<Read> {
        let end = u32::from(read.address) + registers.len() as u32;
        registers.truncate(self.whole(read, end));
        let mut missing = self.items(rate, read);
        missing.retain(|item| u32::from(item.0) + u32::from(item.1) > end);
        match missing.first() {
            Some((first, _)) if *first > read.address => {
                self.planner.split_at(*first);
                self.replan();
                self.planner.reads(missing)
            }
            _ => Vec::new(),
        }
    }

    /// How many registers of an answer that goes up to `end` hold whole points: half a number is no number.
    fn whole(&self, read: Read, end: u32) -> usize {
        let points = self.profile.points.iter();
        let halved = points
            .filter(|point| point.address >= read.address && u32::from(point.address) < end)
            .filter(|point| u32::from(point.address) + u32::from(point.registers) > end)
            // What is longer than a read comes in parts anyway.
            .filter(|point| point.registers <= self.profile.wire.max_read);
        let whole = halved.map(|point| u32::from(point.address)).min().unwrap_or(end);
        (whole - u32::from(read.address)) as usize
    }

    /// Address and length of the points of a rate that lie in `read`, in address order.
    fn items(&self, rate: Rate, read: Read) -> Vec<(u16, u16)> {
        let Some(plan) = self.rate(rate) else { return Vec::new() };
        let points = plan.points.iter().map(|index| &self.profile.points[*index]);
        points
            .filter(|point| read.covers(point.address, point.registers))
            .map(|point| (point.address, point.registers))
            .collect()
    }

    fn replan(&mut self) {
        for plan in [&mut self.fast, &mut self.slow, &mut self.once] {
            let points = plan.points.iter().map(|index| &self.profile.points[*index]);
            plan.reads = self.planner.reads(points.map(|point| (point.address, point.registers)));
        }
    }

    fn rate(&self, rate: Rate) -> Option<&RatePlan> {
        match rate {
            Rate::Fast => Some(&self.fast),
            Rate::Slow => Some(&self.slow),
            Rate::Once => Some(&self.once),
            Rate::OnDemand => None,
        }
    }

    fn rate_mut(&mut self, rate: Rate) -> Option<&mut RatePlan> {
        match rate {
            Rate::Fast => Some(&mut self.fast),
            Rate::Slow => Some(&mut self.slow),
            Rate::Once => Some(&mut self.once),
            Rate::OnDemand => None,
        }
    }
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
        let plan = plan();
        assert_eq!(spans(&plan.reads(Rate::Fast, at(0))), [(100, 12)]);
        assert_eq!(spans(&plan.reads(Rate::Slow, at(0))), [(108, 2), (126, 2)]);
        // The curve is longer than a read.
        let once = plan.reads(Rate::Once, at(0));
        assert!(once.iter().all(|read| read.count <= 16), "{once:?}");
        assert_eq!(once.iter().map(|read| read.count).sum::<u16>(), 21);
        assert!(!plan.has(Rate::OnDemand));
    }

    #[test]
    fn a_refused_read_is_halved_until_the_culprit_stands_alone() {
        let mut plan = plan();
        // This device does not know register 106.
        let refuses = |read: Read| read.covers(106, 1);
        let mut sent = 0;
        let mut answered = Vec::new();
        let mut waiting = plan.reads(Rate::Fast, at(0));
        while let Some(read) = waiting.pop() {
            sent += 1;
            match refuses(read) {
                true => waiting.extend(plan.refused(Rate::Fast, read, at(0))),
                false => answered.push(read),
            }
        }
        assert!(sent <= 8, "{sent} reads to find one register");
        for address in [100, 101, 102, 104, 110, 111] {
            assert!(answered.iter().any(|read| read.covers(address, 1)), "{address} was read");
        }

        // It is remembered: the next round meets no exception, and the culprit rests.
        let next = plan.reads(Rate::Fast, at(1));
        assert!(!next.iter().any(|read| refuses(*read)), "{next:?}");
        let later = plan.reads(Rate::Fast, at(61));
        assert_eq!(
            later.iter().filter(|read| refuses(**read)).map(|read| read.count).collect::<Vec<_>>(),
            [1]
        );
    }

    #[test]
    fn a_refused_single_point_cannot_be_split() {
        let mut plan = plan();
        let read = Read { function: 3, address: 104, count: 2 };
        assert_eq!(plan.refused(Rate::Fast, read, at(0)), []);
    }

    #[test]
    fn a_cut_answer_is_continued_at_the_first_point_that_is_not_whole() {
        let mut plan = plan();
        let read = plan.reads(Rate::Fast, at(0))[0];
        // Half of the voltage at 104 came, but half a number is no number.
        let mut registers = vec![1, 2, 3, 4, 5];
        assert_eq!(spans(&plan.cut(Rate::Fast, read, &mut registers)), [(104, 8)]);
        assert_eq!(registers, [1, 2, 3, 4]);
        assert_eq!(spans(&plan.reads(Rate::Fast, at(1))), [(100, 3), (104, 8)]);
    }

    #[test]
    fn a_cut_answer_without_a_whole_point_ends_there() {
        let mut plan = plan();
        let read = Read { function: 3, address: 104, count: 2 };
        let mut registers = vec![1];
        assert_eq!(plan.cut(Rate::Fast, read, &mut registers), []);
        assert!(registers.is_empty());
    }

    #[test]
    fn a_part_of_a_long_point_is_kept() {
        let mut plan = plan();
        let read = Read { function: 3, address: 131, count: 16 };
        let mut registers = vec![7; 10];
        assert_eq!(plan.cut(Rate::Once, read, &mut registers), []);
        assert_eq!(registers, [7; 10]);
    }
}
