//! How the three switches get from where they are to where they shall be: register 1094 with delay 1095.
//!
//! An open transition opens first what shall not stay closed, rests, and closes one switch after the other, those of the
//! sources before the tie: so two sources never meet. A loop closing, between two sources that are both good, closes
//! first, the last switch synchronized, and opens what is then too much.

use std::time::Duration;

use crate::settings::Settings;

use super::diagram::Edge;
use super::switches::{Drive, Positions, Switch};
use super::sync::OWN_TIME;
use super::timer::Countdown;

const ORDER: [Switch; 3] = [Switch::Qs1, Switch::Qs2, Switch::Qtie];

/// Delays as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    closing: Duration,
    /// For how long a switch that did not close is driven once more; zero: it is not.
    again: Duration,
    opening: Duration,
    rest: Duration,
    elevator: Duration,
    /// How long a switch is waited for that does not say that it is ready; none: nobody asks.
    ready: Option<Duration>,
    sync: Duration,
    /// Sources that do not come together are changed over with a gap.
    sync_fallback: bool,
    parallel: Duration,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        Self {
            closing: settings.seconds("closing_time"),
            again: settings.seconds("closing_again_time"),
            opening: settings.seconds("opening_time"),
            rest: settings.seconds("transfer_rest"),
            elevator: settings.seconds("elevator_delay"),
            ready: settings.is_on("position_feedback").then(|| settings.seconds("position_feedback_time")),
            sync: settings.seconds("sync_time"),
            sync_fallback: settings.is_on("sync_fallback"),
            parallel: settings.seconds("loop_time"),
        }
    }
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    Still,
    Ready,
    Elevator,
    Opening(Switch),
    Rest,
    WaitPosition(Switch),
    Closing(Switch),
    WaitSync(Switch),
    SyncClosing(Switch),
    Parallel,
}

/// The same without the switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Still,
    Ready,
    Elevator,
    Opening,
    Rest,
    WaitPosition,
    Closing,
    WaitSync,
    SyncClosing,
    Parallel,
}

impl Stage {
    /// Every way from one to another, with what leads there.
    pub(super) const WAYS: &[Edge<Self>] = &[
        Edge::new(Self::Still, Self::Ready, "another position is wanted"),
        Edge::new(Self::Ready, Self::Still, "no longer wanted"),
        Edge::new(Self::Ready, Self::Elevator, "a living section will be interrupted"),
        Edge::new(Self::Ready, Self::Opening, "a switch has to open"),
        Edge::new(Self::Ready, Self::WaitPosition, "a switch has to close and is not ready"),
        Edge::new(Self::Ready, Self::Closing, "a switch has to close"),
        Edge::new(Self::Ready, Self::WaitSync, "the next switch joins both sources"),
        Edge::new(Self::Elevator, Self::Opening, "elevator delay over"),
        Edge::new(Self::Elevator, Self::Ready, "another way is wanted"),
        Edge::new(Self::Opening, Self::Opening, "open, and the next one has to"),
        Edge::new(Self::Opening, Self::Rest, "open, and one has to close"),
        Edge::new(Self::Opening, Self::Still, "all done, or not open in time"),
        Edge::new(Self::Rest, Self::Closing, "rest over"),
        Edge::new(Self::Rest, Self::WaitPosition, "rest over, switch not ready"),
        Edge::new(Self::Rest, Self::Ready, "rest over, another way is wanted"),
        Edge::new(Self::Rest, Self::Still, "rest over, nothing left to do"),
        Edge::new(Self::WaitPosition, Self::Closing, "ready"),
        Edge::new(Self::WaitPosition, Self::WaitSync, "ready, and it joins both sources"),
        Edge::new(Self::WaitPosition, Self::Ready, "another way is wanted"),
        Edge::new(Self::WaitPosition, Self::Still, "not ready in time"),
        Edge::new(Self::Closing, Self::Closing, "closed, and the next one has to"),
        Edge::new(Self::Closing, Self::WaitPosition, "closed, and the next one is not ready"),
        Edge::new(Self::Closing, Self::WaitSync, "closed, and the next one joins both sources"),
        Edge::new(Self::Closing, Self::Ready, "another way is wanted, or not closed and to be closed again"),
        Edge::new(Self::Closing, Self::Still, "all done, or not closed in time"),
        Edge::new(Self::WaitSync, Self::SyncClosing, "in step"),
        Edge::new(
            Self::WaitSync,
            Self::Ready,
            "another way is wanted, or not in step in time with the fallback set",
        ),
        Edge::new(Self::SyncClosing, Self::Parallel, "closed"),
        Edge::new(
            Self::SyncClosing,
            Self::Ready,
            "another way is wanted, or not closed and to be closed again",
        ),
        Edge::new(Self::SyncClosing, Self::Still, "not closed in time, or no longer in step"),
        Edge::new(Self::Parallel, Self::Opening, "loop time over"),
        Edge::new(Self::Parallel, Self::Still, "somebody else has opened one"),
    ];
}

impl Activity {
    fn stage(self) -> Stage {
        match self {
            Self::Still => Stage::Still,
            Self::Ready => Stage::Ready,
            Self::Elevator => Stage::Elevator,
            Self::Opening(_) => Stage::Opening,
            Self::Rest => Stage::Rest,
            Self::WaitPosition(_) => Stage::WaitPosition,
            Self::Closing(_) => Stage::Closing,
            Self::WaitSync(_) => Stage::WaitSync,
            Self::SyncClosing(_) => Stage::SyncClosing,
            Self::Parallel => Stage::Parallel,
        }
    }
}

/// What the sequence acts upon.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) now: Positions,
    pub(super) target: Positions,
    /// Which switches say that they are ready to be closed.
    pub(super) ready: Positions,
    /// Which have an alarm because they did not close, or did not open.
    pub(super) not_closed: Positions,
    pub(super) not_opened: Positions,
    /// Both sources may be joined for a moment.
    pub(super) may_loop: bool,
    /// They fit each other now.
    pub(super) in_step: bool,
    /// Which switches have to be open, whatever else is wrong.
    pub(super) forced: Positions,
    /// Which sections have voltage.
    pub(super) alive: [bool; 2],
}

impl View {
    /// A living section loses its voltage when what has to open has opened.
    fn interrupts(&self) -> bool {
        let left = Positions::by(|switch| self.now.is_closed(switch) && self.target.is_closed(switch));
        // Elevators are not waited for where something must be open.
        let waits = !Switch::ALL.iter().any(|it| self.now.is_closed(*it) && self.forced.is_closed(*it));
        waits && self.alive.iter().zip(left.feeds()).any(|(alive, by)| *alive && by == [false; 2])
    }
}

/// What went wrong in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Failure {
    Move(Switch, Drive),
    Sync,
}

/// The state machine; time, positions and the target are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    activity: Activity,
    timer: Countdown,
    /// The elevators are to stand until all is done.
    elevator: bool,
    /// The switch that closed last.
    closed_last: Option<Switch>,
    /// The switch that did not close and is driven once more.
    again: Option<Switch>,
    /// This transfer goes on with a gap, for the sources did not come together.
    gives_up_loop: bool,
    /// It has been said that they do not.
    sync_failed: bool,
    #[cfg(test)]
    pub(super) walked: std::collections::BTreeSet<(u8, u8)>,
}

impl Sequence {
    pub(super) fn new() -> Self {
        Self {
            activity: Activity::Still,
            timer: Countdown::default(),
            elevator: false,
            closed_last: None,
            again: None,
            gives_up_loop: false,
            sync_failed: false,
            #[cfg(test)]
            walked: std::collections::BTreeSet::new(),
        }
    }

    pub(super) fn step(&mut self, dt: Duration, view: View, limits: &Limits) -> Option<Failure> {
        self.timer.step(dt);
        let next = self.next(view, limits);
        match self.activity {
            Activity::Still if next != Activity::Still => self.enter(Activity::Ready, limits),
            Activity::Still => {}
            Activity::Ready => self.begin(next, view, limits),
            Activity::Elevator if !matches!(next, Activity::Opening(_)) => {
                self.enter(Activity::Ready, limits);
            }
            Activity::Elevator if self.timer.is_over() => self.enter(next, limits),
            Activity::Rest if self.timer.is_over() => self.go_on(next, limits),
            Activity::Elevator | Activity::Rest => {}
            Activity::Opening(switch) => return self.open(switch, next, view, limits),
            Activity::WaitPosition(switch) => return self.wait_position(switch, next, limits),
            Activity::Closing(switch) => return self.close(switch, next, view, limits),
            Activity::WaitSync(switch) => return self.wait_sync(switch, next, view, limits),
            Activity::SyncClosing(switch) => return self.sync_close(switch, view, limits),
            Activity::Parallel => self.part(next, view, limits),
        }
        None
    }

    /// What is to be done next, were nothing under way.
    fn next(&self, view: View, limits: &Limits) -> Activity {
        let View { now, target, .. } = view;
        let opens = |switch: &Switch| now.is_closed(*switch) && !target.is_closed(*switch);
        let closes = |switch: &Switch| {
            !now.is_closed(*switch) && target.is_closed(*switch) && !view.not_closed.is_closed(*switch)
        };
        if view.not_opened != Positions::OPEN {
            // One does not open: nothing moves but what must be open and what parts the sources again.
            let can = |switch: &Switch| now.is_closed(*switch) && !view.not_opened.is_closed(*switch);
            let must = ORDER.into_iter().find(|switch| can(switch) && view.forced.is_closed(*switch));
            let parts = self.closed_last.filter(|last| now == Positions::ALL_CLOSED && can(last));
            return must.or(parts).map_or(Activity::Still, Activity::Opening);
        }
        let open = ORDER.into_iter().find(opens);
        let close = ORDER.into_iter().find(closes);
        let union = Positions::by(|switch| now.is_closed(switch) || target.is_closed(switch));
        let loops = view.may_loop && !self.gives_up_loop && union == Positions::ALL_CLOSED;
        match (open, close) {
            (None, None) => Activity::Still,
            (Some(open), None) => Activity::Opening(open),
            (Some(open), Some(_)) if !loops => Activity::Opening(open),
            (_, Some(close)) => {
                let joins = Positions::by(|switch| now.is_closed(switch) || switch == close);
                if limits.ready.is_some() && !view.ready.is_closed(close) {
                    Activity::WaitPosition(close)
                } else if joins == Positions::ALL_CLOSED {
                    Activity::WaitSync(close)
                } else {
                    Activity::Closing(close)
                }
            }
        }
    }

    fn begin(&mut self, next: Activity, view: View, limits: &Limits) {
        let interrupts = matches!(next, Activity::Opening(_)) && view.interrupts() && !self.elevator;
        if interrupts && !limits.elevator.is_zero() {
            self.elevator = true;
            self.enter(Activity::Elevator, limits);
        } else {
            self.enter(next, limits);
        }
    }

    /// What follows a rest or a closing.
    fn go_on(&mut self, next: Activity, limits: &Limits) {
        let turns = matches!(next, Activity::Opening(_))
            || self.activity == Activity::Rest && matches!(next, Activity::WaitSync(_));
        self.enter(if turns { Activity::Ready } else { next }, limits);
    }

    fn open(&mut self, switch: Switch, next: Activity, view: View, limits: &Limits) -> Option<Failure> {
        if !view.now.is_closed(switch) {
            let rests = !matches!(next, Activity::Opening(_) | Activity::Still);
            self.enter(if rests { Activity::Rest } else { next }, limits);
        } else if self.timer.is_over() {
            self.enter(Activity::Still, limits);
            return Some(Failure::Move(switch, Drive::Open));
        }
        None
    }

    fn wait_position(&mut self, switch: Switch, next: Activity, limits: &Limits) -> Option<Failure> {
        if next == Activity::WaitPosition(switch) {
            if self.timer.is_over() {
                self.enter(Activity::Still, limits);
                return Some(Failure::Move(switch, Drive::Close));
            }
        } else if next == Activity::Closing(switch) || next == Activity::WaitSync(switch) {
            self.enter(next, limits);
        } else {
            self.enter(Activity::Ready, limits);
        }
        None
    }

    fn close(&mut self, switch: Switch, next: Activity, view: View, limits: &Limits) -> Option<Failure> {
        if view.now.is_closed(switch) {
            self.has_closed(switch);
            self.go_on(next, limits);
        } else if !view.target.is_closed(switch) {
            self.enter(Activity::Ready, limits);
        } else if self.timer.is_over() {
            return self.not_closed(switch, limits);
        }
        None
    }

    fn has_closed(&mut self, switch: Switch) {
        (self.closed_last, self.again) = (Some(switch), None);
    }

    /// Once more, or it has failed.
    fn not_closed(&mut self, switch: Switch, limits: &Limits) -> Option<Failure> {
        if self.again.is_none() && !limits.again.is_zero() {
            self.again = Some(switch);
            self.enter(Activity::Ready, limits);
            return None;
        }
        self.enter(Activity::Still, limits);
        Some(Failure::Move(switch, Drive::Close))
    }

    fn wait_sync(&mut self, switch: Switch, next: Activity, view: View, limits: &Limits) -> Option<Failure> {
        if next != Activity::WaitSync(switch) {
            self.enter(Activity::Ready, limits);
        } else if view.in_step {
            self.enter(Activity::SyncClosing(switch), limits);
        } else if self.timer.is_over() && limits.sync_fallback {
            self.gives_up_loop = true;
            self.enter(Activity::Ready, limits);
        } else if self.timer.is_over() && !self.sync_failed {
            self.sync_failed = true;
            return Some(Failure::Sync);
        }
        None
    }

    fn sync_close(&mut self, switch: Switch, view: View, limits: &Limits) -> Option<Failure> {
        // One that is late must not close when the sources have passed each other.
        let late = self.time_to_close(switch, limits).saturating_sub(self.timer.left()) >= OWN_TIME;
        if view.now.is_closed(switch) {
            self.has_closed(switch);
            self.enter(Activity::Parallel, limits);
        } else if !view.target.is_closed(switch) {
            self.enter(Activity::Ready, limits);
        } else if self.timer.is_over() || late && !view.in_step {
            return self.not_closed(switch, limits);
        }
        None
    }

    fn time_to_close(&self, switch: Switch, limits: &Limits) -> Duration {
        if self.again == Some(switch) { limits.again } else { limits.closing }
    }

    fn part(&mut self, next: Activity, view: View, limits: &Limits) {
        if view.now != Positions::ALL_CLOSED {
            self.enter(Activity::Still, limits);
        } else if self.timer.is_over() || !view.may_loop {
            self.enter(next, limits);
        }
    }

    fn enter(&mut self, next: Activity, limits: &Limits) {
        let (from, to) = (self.activity.stage(), next.stage());
        debug_assert!(Edge::cause(Stage::WAYS, from, to).is_some(), "{from:?} to {to:?}");
        #[cfg(test)]
        self.walked.insert((from as u8, to as u8));
        self.activity = next;
        self.timer = Countdown::of(match next {
            Activity::Still | Activity::Ready => Duration::ZERO,
            Activity::Elevator => limits.elevator,
            Activity::Rest => limits.rest,
            Activity::Opening(_) => limits.opening,
            Activity::WaitPosition(_) => limits.ready.unwrap_or_default(),
            Activity::Closing(switch) | Activity::SyncClosing(switch) => self.time_to_close(switch, limits),
            Activity::WaitSync(_) => limits.sync,
            Activity::Parallel => limits.parallel,
        });
        if next == Activity::Still {
            (self.elevator, self.gives_up_loop, self.again) = (false, false, None);
        }
        if !matches!(next, Activity::WaitSync(_)) {
            self.sync_failed = false;
        }
    }

    /// What the control outputs drive: QS1, QTIE and QS2.
    pub(super) fn drives(&self) -> [Option<Drive>; 3] {
        Switch::ALL.map(|switch| match self.activity {
            Activity::Opening(moving) if moving == switch => Some(Drive::Open),
            Activity::Closing(moving) | Activity::SyncClosing(moving) if moving == switch => {
                Some(Drive::Close)
            }
            _ => None,
        })
    }

    /// Nothing moves and nothing is waited for.
    pub(super) fn is_still(&self) -> bool {
        self.activity == Activity::Still
    }

    /// The switch whose feedback is waited for.
    pub(super) fn waits_for(&self) -> Option<Switch> {
        match self.activity {
            Activity::WaitPosition(switch) => Some(switch),
            _ => None,
        }
    }

    /// The sources are brought together, or are together.
    pub(super) fn loops(&self) -> bool {
        matches!(self.activity, Activity::WaitSync(_) | Activity::SyncClosing(_) | Activity::Parallel)
    }

    /// Bit 509.5.
    pub(super) fn holds_elevators(&self) -> bool {
        self.elevator
    }

    /// It has waited for the sources to come together for too long, and still does.
    pub(super) fn sync_fails(&self) -> bool {
        self.sync_failed
    }

    /// Register 1094: what is being done, otherwise what is closed.
    pub(super) fn status(&self, now: Positions) -> u16 {
        let by_switch = |switch, [qs1, qtie, qs2]: [u16; 3]| match switch {
            Switch::Qs1 => qs1,
            Switch::Qtie => qtie,
            Switch::Qs2 => qs2,
        };
        match self.activity {
            Activity::Ready => 0,
            Activity::Closing(switch) => by_switch(switch, [1, 20, 3]),
            Activity::Opening(switch) => by_switch(switch, [2, 21, 4]),
            Activity::Rest => 5,
            Activity::WaitSync(_) => 10,
            Activity::SyncClosing(switch) => by_switch(switch, [11, 9, 12]),
            Activity::WaitPosition(switch) => by_switch(switch, [13, 19, 14]),
            Activity::Elevator => 15,
            Activity::Parallel => 30,
            Activity::Still => match now.digits() {
                [1, 0, 0] => 16,
                [0, 0, 1] => 17,
                [1, 1, 0] => 22,
                [0, 1, 1] => 23,
                [1, 0, 1] => 24,
                [0, 1, 0] => 25,
                [1, 1, 1] => 30,
                _ => 18,
            },
        }
    }

    /// Register 1095.
    pub(super) fn seconds_left(&self) -> u16 {
        self.timer.seconds()
    }

    /// Register 1084: until the switch that is moving has failed.
    pub(super) fn seconds_to_alarm(&self) -> u16 {
        match self.activity {
            Activity::Opening(_)
            | Activity::Closing(_)
            | Activity::SyncClosing(_)
            | Activity::WaitPosition(_) => self.seconds_left(),
            _ => 0,
        }
    }

    /// Register 1083: until it is said that the sources do not come together.
    pub(super) fn seconds_to_sync_failure(&self) -> u16 {
        match self.activity {
            Activity::WaitSync(_) => self.seconds_left(),
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests;
