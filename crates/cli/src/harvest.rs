//! Reading a set of points once: which read comes next, what an answer gives, what a refusal costs.
//!
//! Pure: the wire is the caller's. A read that the device cuts is asked for again from where it was cut, and a read over
//! several points that is refused with exception 2 is taken apart, so that one bad address costs only its own point.

use std::collections::VecDeque;

use busbar_link::LinkError;
use busbar_modbus::ExceptionCode;
use busbar_profile::{
    Image, Profile,
    plan::{Cost, Planner, Read, items},
};
use jiff::Timestamp;

/// A device that has never answered is given up after so many reads in a row without an answer.
const PATIENCE: u32 = 2;

/// The reads that are still to do, and what the others brought.
pub(crate) struct Harvest<'p> {
    profile: &'p Profile,
    planner: Planner,
    wanted: Vec<(u16, u16)>,
    queue: VecDeque<Read>,
    image: Image,
    done: Vec<Done>,
    answers: usize,
    unanswered: u32,
}

/// A part of the map that was asked for: when, and why it did not come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Done {
    address: u16,
    registers: u16,
    pub(crate) at: Timestamp,
    pub(crate) error: Option<String>,
}

impl Done {
    fn overlaps(&self, (address, registers): (u16, u16)) -> bool {
        let end = |address: u16, registers: u16| u32::from(address) + u32::from(registers);
        u32::from(self.address) < end(address, registers)
            && u32::from(address) < end(self.address, self.registers)
    }
}

impl<'p> Harvest<'p> {
    /// The reads for the points with these indexes, planned at `cost`.
    pub(crate) fn new(profile: &'p Profile, points: &[usize], cost: Cost) -> Self {
        let planner = Planner::new(profile, cost);
        let wanted: Vec<(u16, u16)> = items(profile, points).collect();
        let queue = planner.reads(wanted.iter().copied()).into();
        let image = Image::new(profile);
        Self { profile, planner, wanted, queue, image, done: Vec::new(), answers: 0, unanswered: 0 }
    }

    /// The next read, until there is none.
    pub(crate) fn next(&mut self) -> Option<Read> {
        self.queue.pop_front()
    }

    /// The device answered `read`, in full or with its first registers only.
    pub(crate) fn answered(&mut self, read: Read, registers: &[u16], at: Timestamp) {
        self.answers += 1;
        self.unanswered = 0;
        self.image.store(read.address, registers, &mut Vec::new());
        let came = u16::try_from(registers.len()).unwrap_or(read.count).min(read.count);
        self.done.push(Done { address: read.address, registers: came, at, error: None });
        if came == read.count {
            return;
        }
        let mut missing = Vec::new();
        let cut = read.address.saturating_add(came);
        for item in self.parts(read) {
            let end = u32::from(item.0) + u32::from(item.1);
            if end <= u32::from(cut) {
                continue;
            }
            // What began the read and still did not come whole will not come by asking again.
            if item.0 == read.address && self.wanted.contains(&item) {
                let error = format!(
                    "the device answered {came} of {} registers from {} on",
                    read.count, read.address
                );
                self.done.push(Done { address: item.0, registers: item.1, at, error: Some(error) });
            } else if self.wanted.contains(&item) {
                missing.push(item);
            } else {
                let from = item.0.max(cut);
                missing.push((from, (end - u32::from(from)) as u16));
            }
        }
        self.plan_again(missing);
    }

    /// There is no answer to `read`, for the reason in `sentence`.
    pub(crate) fn failed(&mut self, read: Read, error: &LinkError, sentence: &str, at: Timestamp) {
        let illegal = matches!(error, LinkError::Exception { code: ExceptionCode::ILLEGAL_DATA_ADDRESS, .. });
        if matches!(error, LinkError::Exception { .. }) {
            self.answers += 1;
            self.unanswered = 0;
        } else {
            self.unanswered += 1;
        }
        let mut parts = self.parts(read);
        parts.sort_unstable();
        parts.dedup();
        if illegal && parts.len() > 1 {
            for (address, _) in parts.iter().filter(|(address, _)| *address != read.address) {
                self.planner.split_at(*address);
            }
            let before = self.queue.len();
            self.plan_again(parts);
            if self.queue.len() > before + 1 {
                return;
            }
            // Parts that overlap cannot be told apart: the read stays as it was.
            self.queue.drain(..self.queue.len() - before);
        }
        self.lose(read, sentence, at);
        let hopeless = matches!(error, LinkError::Down { .. } | LinkError::Closed);
        if hopeless || (self.answers == 0 && self.unanswered >= PATIENCE) {
            while let Some(read) = self.next() {
                self.lose(read, sentence, at);
            }
        }
    }

    fn lose(&mut self, read: Read, sentence: &str, at: Timestamp) {
        let error = Some(sentence.to_owned());
        self.done.push(Done { address: read.address, registers: read.count, at, error });
    }

    /// The wanted items inside a read, long ones only as far as they are in it.
    fn parts(&self, read: Read) -> Vec<(u16, u16)> {
        let end = u32::from(read.address) + u32::from(read.count);
        self.wanted
            .iter()
            .filter_map(|(address, registers)| {
                let from = u32::from(*address).max(u32::from(read.address));
                let to = (u32::from(*address) + u32::from(*registers)).min(end);
                (from < to).then(|| (from as u16, (to - from) as u16))
            })
            .collect()
    }

    /// Puts reads for these parts in front of the queue.
    fn plan_again(&mut self, parts: Vec<(u16, u16)>) {
        for read in self.planner.reads(parts).into_iter().rev() {
            self.queue.push_front(read);
        }
    }

    /// The registers of a point, when all of them came.
    pub(crate) fn registers(&self, point: usize) -> Option<&[u16]> {
        self.image.registers(point)
    }

    /// When a point was asked for last, and the reason if it did not come.
    pub(crate) fn last(&self, point: usize) -> Option<&Done> {
        let point = self.profile.points.get(point)?;
        let mut own = self.done.iter().filter(|done| done.overlaps((point.address, point.registers)));
        own.clone().find(|done| done.error.is_some()).or_else(|| own.next_back())
    }

    /// How many reads were answered.
    pub(crate) fn answers(&self) -> usize {
        self.answers
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use busbar_profile::builtin;

    use super::*;

    const NOW: Timestamp = Timestamp::UNIX_EPOCH;

    fn harvest(points: &[&str]) -> (Harvest<'static>, Vec<usize>) {
        let profile = builtin("datakom-d").unwrap();
        let indexes: Vec<usize> = points.iter().map(|id| profile.point_index(id).unwrap()).collect();
        (Harvest::new(profile, &indexes, Cost::tcp(Duration::from_millis(20), 100_000)), indexes)
    }

    fn read(address: u16, count: u16) -> Read {
        Read { function: 3, address, count }
    }

    fn illegal_address() -> LinkError {
        LinkError::Exception { unit: 1, function: 3, code: ExceptionCode::ILLEGAL_DATA_ADDRESS }
    }

    fn timeout() -> LinkError {
        LinkError::Timeout {
            unit: 1,
            after: Duration::from_secs(1),
            tries: 2,
            heard: busbar_link::Heard::Nothing { serial: false },
        }
    }

    #[test]
    fn a_full_answer_needs_nothing_more() {
        let (mut harvest, points) = harvest(&["mains_frequency", "genset_frequency"]);
        assert_eq!(harvest.next(), Some(read(10338, 2)));
        harvest.answered(read(10338, 2), &[5000, 5001], NOW);
        assert_eq!(harvest.next(), None);
        assert_eq!(harvest.registers(points[1]), Some(&[5001][..]));
        assert_eq!(harvest.last(points[1]).unwrap().error, None);
    }

    #[test]
    fn a_cut_answer_is_followed_up() {
        let (mut harvest, points) = harvest(&["scope"]);
        let first = harvest.next().unwrap();
        assert_eq!(first, read(10404, 16));
        harvest.answered(first, &[7; 10], NOW);
        assert_eq!(harvest.next(), Some(read(10414, 6)));
        harvest.answered(read(10414, 6), &[8; 6], NOW);
        while let Some(read) = harvest.next() {
            assert!(read.address >= 10420);
            harvest.answered(read, &vec![9; read.count.into()], NOW);
        }
        assert_eq!(harvest.registers(points[0]).map(<[u16]>::len), Some(100));
    }

    #[test]
    fn a_value_that_never_comes_whole_is_lost_once() {
        let (mut harvest, points) = harvest(&["genset_l1_voltage", "genset_l2_voltage"]);
        assert_eq!(harvest.next(), Some(read(10246, 4)));
        harvest.answered(read(10246, 4), &[1], NOW);
        assert_eq!(harvest.next(), Some(read(10248, 2)));
        harvest.answered(read(10248, 2), &[1, 0], NOW);
        assert_eq!(harvest.next(), None);
        assert_eq!(harvest.registers(points[0]), None);
        assert!(harvest.last(points[0]).unwrap().error.is_some());
        assert_eq!(harvest.registers(points[1]), Some(&[1, 0][..]));
    }

    #[test]
    fn a_refused_read_is_taken_apart_once() {
        let (mut harvest, points) = harvest(&["mains_frequency", "genset_frequency", "charge_input_voltage"]);
        let whole = harvest.next().unwrap();
        harvest.failed(whole, &illegal_address(), "refused", NOW);
        for address in 10338..=10340 {
            assert_eq!(harvest.next(), Some(read(address, 1)));
            if address == 10339 {
                harvest.failed(read(address, 1), &illegal_address(), "refused", NOW);
            } else {
                harvest.answered(read(address, 1), &[address], NOW);
            }
        }
        assert_eq!(harvest.next(), None);
        let came: Vec<bool> = points.iter().map(|point| harvest.registers(*point).is_some()).collect();
        assert_eq!(came, [true, false, true]);
        assert_eq!(harvest.last(points[1]).unwrap().error.as_deref(), Some("refused"));
    }

    #[test]
    fn who_never_answers_is_given_up() {
        let (mut harvest, points) = harvest(&["genset_frequency", "unit_mode", "latitude", "genset_runs"]);
        for _ in 0..PATIENCE {
            let read = harvest.next().unwrap();
            harvest.failed(read, &timeout(), "silent", NOW);
        }
        assert_eq!(harvest.next(), None);
        assert!(points.iter().all(|point| harvest.last(*point).unwrap().error.as_deref() == Some("silent")));
    }

    #[test]
    fn who_has_answered_is_asked_to_the_end() {
        let (mut harvest, _) = harvest(&["genset_frequency", "unit_mode", "latitude", "genset_runs"]);
        let first = harvest.next().unwrap();
        harvest.answered(first, &vec![0; first.count.into()], NOW);
        let mut asked = 1;
        while let Some(read) = harvest.next() {
            harvest.failed(read, &timeout(), "silent", NOW);
            asked += 1;
        }
        assert_eq!(asked, 4);
    }
}
