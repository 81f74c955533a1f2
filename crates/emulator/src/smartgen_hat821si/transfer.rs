//! How the three switches get from where they are to where they shall be: register 1094 with delay 1095.
//!
//! Always an open transition: first everything opens that shall not stay closed, then a rest, then the switches
//! close one after the other, those of the sources before the tie. So two sources never meet.

use std::time::Duration;

use super::plant::{Drive, Positions, Switch};

/// Seconds with the load on neither source, for motors and transformers to lose their field.
const REST: Duration = Duration::from_secs(2);
/// Seconds that a switch may take before it has failed.
const SUPERVISION: Duration = Duration::from_secs(5);

const ORDER: [Switch; 3] = [Switch::Qs1, Switch::Qs2, Switch::Qtie];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    Still,
    Opening(Switch),
    Rest,
    Closing(Switch),
}

/// The state machine; time, positions and the target are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    activity: Activity,
    timer: Duration,
    /// Switches that did not move in time, each latched until [`Sequence::acknowledge`].
    not_closed: Vec<Switch>,
    not_opened: Vec<Switch>,
}

impl Sequence {
    pub(super) fn new() -> Self {
        Self {
            activity: Activity::Still,
            timer: Duration::ZERO,
            not_closed: Vec::new(),
            not_opened: Vec::new(),
        }
    }

    pub(super) fn step(&mut self, dt: Duration, now: Positions, target: Positions) {
        self.timer = self.timer.saturating_sub(dt);
        let elapsed = self.timer.is_zero();
        match self.activity {
            Activity::Still => self.enter(self.next(now, target)),
            Activity::Rest if elapsed => self.enter(self.next(now, target)),
            Activity::Rest => {}
            Activity::Opening(switch) if !now.is_closed(switch) => {
                let next = self.next(now, target);
                self.enter(if matches!(next, Activity::Closing(_)) { Activity::Rest } else { next });
            }
            Activity::Closing(switch) if now.is_closed(switch) => self.enter(self.next(now, target)),
            Activity::Opening(switch) if elapsed => {
                self.not_opened.push(switch);
                self.enter(Activity::Still);
            }
            Activity::Closing(switch) if elapsed => {
                self.not_closed.push(switch);
                self.enter(Activity::Still);
            }
            Activity::Opening(_) | Activity::Closing(_) => {}
        }
    }

    fn next(&self, now: Positions, target: Positions) -> Activity {
        if self.has_failed() {
            return Activity::Still;
        }
        let differs = |switch: &Switch| now.is_closed(*switch) != target.is_closed(*switch);
        let mut different = ORDER.into_iter().filter(differs);
        let opens = different.clone().find(|switch| now.is_closed(*switch));
        match (opens, different.next()) {
            (Some(switch), _) => Activity::Opening(switch),
            (None, Some(switch)) => Activity::Closing(switch),
            (None, None) => Activity::Still,
        }
    }

    fn enter(&mut self, next: Activity) {
        if next == self.activity {
            return;
        }
        self.activity = next;
        self.timer = match next {
            Activity::Still => Duration::ZERO,
            Activity::Rest => REST,
            Activity::Opening(_) | Activity::Closing(_) => SUPERVISION,
        };
    }

    /// What the control outputs drive: QS1, QTIE and QS2.
    pub(super) fn drives(&self) -> [Option<Drive>; 3] {
        Switch::ALL.map(|switch| match self.activity {
            Activity::Opening(moving) if moving == switch => Some(Drive::Open),
            Activity::Closing(moving) if moving == switch => Some(Drive::Close),
            _ => None,
        })
    }

    /// Nothing moves and nothing is waited for.
    pub(super) fn is_still(&self) -> bool {
        self.activity == Activity::Still
    }

    /// A switch has not moved: nothing is transferred until somebody acknowledges it.
    pub(super) fn has_failed(&self) -> bool {
        !(self.not_closed.is_empty() && self.not_opened.is_empty())
    }

    pub(super) fn failed_to(&self, switch: Switch, drive: Drive) -> bool {
        match drive {
            Drive::Close => self.not_closed.contains(&switch),
            Drive::Open => self.not_opened.contains(&switch),
        }
    }

    pub(super) fn acknowledge(&mut self) {
        self.not_closed.clear();
        self.not_opened.clear();
    }

    /// Register 1094: what is being done, otherwise what is closed.
    pub(super) fn status(&self, now: Positions) -> u16 {
        match self.activity {
            Activity::Closing(Switch::Qs1) => 1,
            Activity::Opening(Switch::Qs1) => 2,
            Activity::Closing(Switch::Qs2) => 3,
            Activity::Opening(Switch::Qs2) => 4,
            Activity::Rest => 5,
            Activity::Closing(Switch::Qtie) => 20,
            Activity::Opening(Switch::Qtie) => 21,
            Activity::Still => match now.digits() {
                [1, 0, 0] => 16,
                [0, 0, 1] => 17,
                [1, 1, 0] => 22,
                [0, 1, 1] => 23,
                [1, 0, 1] => 24,
                [0, 1, 0] => 25,
                _ => 18,
            },
        }
    }

    /// Register 1095.
    pub(super) fn seconds_left(&self) -> u64 {
        self.timer.as_millis().div_ceil(1000) as u64
    }

    /// Register 1084: until the switch that is moving has failed.
    pub(super) fn seconds_to_alarm(&self) -> u64 {
        match self.activity {
            Activity::Opening(_) | Activity::Closing(_) => self.seconds_left(),
            Activity::Rest | Activity::Still => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const TENTH: Duration = Duration::from_millis(100);

    /// Switches that move at once; the statuses on the way.
    fn walk(from: Positions, to: Positions) -> (Positions, Vec<u16>) {
        let mut sequence = Sequence::new();
        let mut closed = from.digits().map(|digit| digit == 1);
        let mut statuses = Vec::new();
        for _ in 0..100 {
            for (closed, drive) in closed.iter_mut().zip(sequence.drives()) {
                *closed = drive.map_or(*closed, |drive| drive == Drive::Close);
            }
            let [qs1, qtie, qs2] = closed.map(u8::from);
            let now = Positions::of(qs1, qtie, qs2);
            sequence.step(TENTH, now, to);
            statuses.push(sequence.status(now));
            statuses.dedup();
        }
        let [qs1, qtie, qs2] = closed.map(u8::from);
        (Positions::of(qs1, qtie, qs2), statuses)
    }

    #[test]
    fn each_transfer_opens_rests_and_closes() {
        let at = Positions::of;
        for (from, to, statuses) in [
            (at(1, 0, 1), at(0, 1, 1), vec![2, 5, 20, 23]),
            (at(0, 1, 1), at(1, 0, 1), vec![21, 5, 1, 24]),
            (at(1, 0, 1), at(1, 1, 0), vec![4, 5, 20, 22]),
            (at(1, 1, 0), at(0, 1, 1), vec![2, 5, 3, 23]),
            (at(1, 0, 1), at(0, 0, 0), vec![2, 4, 18]),
            (at(0, 0, 0), at(0, 1, 1), vec![3, 20, 23]),
            (at(1, 0, 0), at(1, 0, 0), vec![16]),
            (at(0, 1, 0), at(0, 0, 1), vec![21, 5, 3, 17]),
        ] {
            assert_eq!(walk(from, to), (to, statuses), "{from:?} to {to:?}");
        }
    }

    #[test]
    fn the_delay_counts_down() {
        let mut sequence = Sequence::new();
        let (from, to) = (Positions::of(1, 0, 1), Positions::of(0, 1, 1));
        sequence.step(TENTH, from, to);
        assert_eq!((sequence.seconds_left(), sequence.seconds_to_alarm()), (5, 5));
        sequence.step(TENTH, Positions::of(0, 0, 1), to);
        assert_eq!((sequence.seconds_left(), sequence.seconds_to_alarm()), (2, 0));
        for _ in 0..11 {
            sequence.step(TENTH, Positions::of(0, 0, 1), to);
        }
        assert_eq!(sequence.seconds_left(), 1);
    }

    #[test]
    fn a_switch_that_does_not_move_ends_the_transfer_until_it_is_acknowledged() {
        let (from, to) = (Positions::of(1, 0, 1), Positions::of(0, 1, 1));
        let mut sequence = Sequence::new();
        for _ in 0..51 {
            sequence.step(TENTH, from, to);
        }
        assert!(
            sequence.failed_to(Switch::Qs1, Drive::Open) && !sequence.failed_to(Switch::Qs1, Drive::Close)
        );
        assert_eq!((sequence.drives(), sequence.status(from)), ([None; 3], 24));
        sequence.acknowledge();
        sequence.step(TENTH, from, to);
        assert_eq!(sequence.drives(), [Some(Drive::Open), None, None]);

        let mut sequence = Sequence::new();
        let now = Positions::of(0, 0, 1);
        for _ in 0..51 {
            sequence.step(TENTH, now, to);
        }
        assert!(sequence.failed_to(Switch::Qtie, Drive::Close) && sequence.has_failed());
    }

    #[test]
    fn whatever_is_asked_for_and_when_the_sources_never_meet() {
        let mut random = Random::new(5);
        let targets = [[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 0], [0, 0, 1]];
        let mut sequence = Sequence::new();
        let (mut closed, mut target) = ([true, false, true], Positions::of(1, 0, 1));
        for _ in 0..20_000 {
            let [qs1, qtie, qs2] = closed.map(u8::from);
            sequence.step(TENTH, Positions::of(qs1, qtie, qs2), target);
            for (closed, drive) in closed.iter_mut().zip(sequence.drives()) {
                // A switch that sometimes takes a step longer.
                if let Some(drive) = drive.filter(|_| random.between(0.0, 1.0) < 0.6) {
                    *closed = drive == Drive::Close;
                }
            }
            assert_ne!(closed, [true; 3]);
            sequence.acknowledge();
            if random.between(0.0, 1.0) < 0.1 {
                let [qs1, qtie, qs2] = targets[random.between(0.0, 6.0) as usize];
                target = Positions::of(qs1, qtie, qs2);
            }
        }
    }
}
