//! The start of gensets: register 1092 with delay 1093, why they are started, and which of two it is.

use std::time::Duration;

use busbar_profile::DateTime;

use crate::settings::Settings;

use super::alarms::{Alarm, Board};
use super::diagram::Edge;
use super::schedule::Window;
use super::timer::{Countdown, Lasting};

/// Delays, the calendar and what there is, as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    start: Duration,
    stop: Duration,
    /// From the start signal until the set must run.
    supply: Duration,
    /// Behind which source there is one.
    behind: [bool; 2],
    choice: Choice,
    /// How long a set runs before the other one takes its turn.
    turns: [Duration; 2],
    run: Option<Window>,
    runs_on_load: bool,
    not_run: Option<Window>,
}

/// Which of two sets is started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Choice {
    /// They take turns.
    #[default]
    Cycle,
    /// That of the master.
    Master,
    /// The one that has run less.
    Balanced,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        let minutes = |id| Duration::from_secs_f64(60.0 * settings.number(id));
        let window = |name| settings.is_on(name).then(|| Window::of(settings, name));
        Self {
            start: settings.seconds("genset_start_delay"),
            stop: settings.seconds("genset_stop_delay"),
            supply: settings.seconds("genset_supply_time"),
            behind: match settings.number("gensets") as u8 {
                0 => [false; 2],
                1 => [false, true],
                _ => [true; 2],
            },
            choice: match settings.number("genset_choice") as u8 {
                0 => Choice::Cycle,
                1 => Choice::Master,
                _ => Choice::Balanced,
            },
            turns: [minutes("genset_1_turn"), minutes("genset_2_turn")],
            run: window("scheduled_run"),
            runs_on_load: settings.number("scheduled_run") as u8 == 2,
            not_run: window("scheduled_not_run"),
        }
    }

    fn are_two(&self) -> bool {
        self.behind == [true; 2]
    }
}

/// What the controller knows when it decides about a start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub(super) now: DateTime,
    pub(super) auto: bool,
    /// Which sources are the master ones.
    pub(super) masters: [bool; 2],
    /// Which sources are available, and which of them hang on their gensets.
    pub(super) available: [bool; 2],
    pub(super) on_genset: [bool; 2],
    /// A genset feeds a section in place of its mains.
    pub(super) serves: bool,
    /// Sets that feed a section, for whatever reason.
    pub(super) feeds: [bool; 2],
    /// Contacts of the site.
    pub(super) on_load_input: bool,
    pub(super) off_load_input: bool,
    pub(super) inhibited: bool,
    /// Sets that run.
    pub(super) runs: [bool; 2],
    pub(super) limits: &'a Limits,
}

/// States with their codes; the two of the calendar are worked out when they are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(super) enum State {
    StartDelay = 0,
    StopDelay = 1,
    Started = 8,
    Standby = 9,
}

impl State {
    /// Every way from one to another, with what leads there.
    pub(super) const WAYS: &[Edge<Self>] = &[
        Edge::new(Self::Standby, Self::StartDelay, "a cause to start"),
        Edge::new(Self::StartDelay, Self::Standby, "no cause any more"),
        Edge::new(Self::StartDelay, Self::Started, "start delay over"),
        Edge::new(Self::Started, Self::StopDelay, "no cause any more"),
        Edge::new(Self::Started, Self::Standby, "no set without a fault"),
        Edge::new(Self::StopDelay, Self::Started, "a cause again"),
        Edge::new(Self::StopDelay, Self::Standby, "stop delay over, or no set without a fault"),
    ];
}

const NOT_SCHEDULED: u16 = 2;
const SCHEDULED: u16 = 3;

/// Why a genset is to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Causes {
    pub(super) on_load: bool,
    pub(super) off_load: bool,
    pub(super) mains_abnormal: bool,
    pub(super) scheduled: bool,
}

impl Causes {
    fn any(self) -> bool {
        self != Self::default()
    }
}

/// The controller's side of the gensets.
#[derive(Clone, Debug)]
pub(super) struct Genset {
    state: State,
    timer: Countdown,
    causes: Causes,
    /// A remote command has asked for it.
    commanded: bool,
    inhibited: bool,
    not_scheduled: Option<Duration>,
    scheduled: Option<Duration>,
    /// The set that is to run: 0 behind source 1, 1 behind source 2.
    chosen: usize,
    /// The set that goes on until the chosen one has taken its load over.
    relieved: Option<usize>,
    signals: [bool; 2],
    /// How long a set was asked to run and did not.
    missing: [Lasting; 2],
    /// How long each has run in all, and in this turn.
    hours: [Duration; 2],
    turn: Duration,
    carries: bool,
    choice: Choice,
    two: bool,
}

impl Genset {
    pub(super) fn new() -> Self {
        Self {
            state: State::Standby,
            timer: Countdown::default(),
            causes: Causes::default(),
            commanded: false,
            inhibited: false,
            not_scheduled: None,
            scheduled: None,
            chosen: 1,
            relieved: None,
            signals: [false; 2],
            missing: [Lasting::default(); 2],
            hours: [Duration::ZERO; 2],
            turn: Duration::ZERO,
            carries: false,
            choice: Choice::Cycle,
            two: false,
        }
    }

    /// A remote command: start, or stop. In manual mode a stop is one whatever the set runs for.
    pub(super) fn command(&mut self, start: bool, auto: bool) {
        self.commanded = start;
        self.causes.mains_abnormal &= start || auto;
    }

    pub(super) fn step(&mut self, dt: Duration, scene: Scene<'_>, board: &mut Board) {
        let limits = scene.limits;
        let works = [0, 1].map(|set| limits.behind[set] && !board.has(Alarm::genset(set)));
        let can = works != [false; 2];
        self.weigh(scene, can);
        let wanted = self.causes.any() && can;
        self.timer.step(dt);
        let elapsed = self.timer.is_over();
        match (self.state, wanted) {
            (State::Standby, true) => self.enter(State::StartDelay, limits.start),
            (State::StartDelay, true) if elapsed => self.enter(State::Started, Duration::ZERO),
            (State::StartDelay, false) => self.enter(State::Standby, Duration::ZERO),
            (State::Started | State::StopDelay, false) if !can => self.enter(State::Standby, Duration::ZERO),
            (State::Started, false) => self.enter(State::StopDelay, limits.stop),
            (State::StopDelay, true) => self.enter(State::Started, Duration::ZERO),
            (State::StopDelay, false) if elapsed => self.enter(State::Standby, Duration::ZERO),
            _ => {}
        }
        self.choose(dt, scene, works);
        self.watch(dt, scene, board);
    }

    /// Works out why one is to run; `can` says that there is one without a fault.
    fn weigh(&mut self, scene: Scene<'_>, can: bool) {
        let limits = scene.limits;
        (self.choice, self.two) = (limits.choice, limits.are_two());
        self.not_scheduled = limits.not_run.and_then(|window| window.left(scene.now));
        self.scheduled = limits.run.and_then(|window| window.left(scene.now));
        self.inhibited = scene.inhibited;
        let by_mains = |source: usize| scene.available[source] && !scene.on_genset[source];
        // Once there are mains again it goes on until they have taken over.
        let relieved = (by_mains(0) || by_mains(1)) && !(self.causes.mains_abnormal && scene.serves);
        let runs = matches!(self.state, State::Started | State::StopDelay);
        // In manual mode nothing starts by itself, and nobody but a person stops what runs.
        let goes_on = !scene.auto && runs;
        let may = limits.behind != [false; 2] && (!self.inhibited || goes_on);
        let by_clock = may && scene.auto && self.not_scheduled.is_none();
        // A start that cannot be obeyed is forgotten, or the set would start when nobody expects it.
        self.commanded &= may && can;
        self.causes = Causes {
            on_load: may && scene.on_load_input,
            off_load: may && (self.commanded || scene.off_load_input),
            mains_abnormal: !relieved && (by_clock || may && goes_on && self.causes.mains_abnormal),
            scheduled: by_clock && self.scheduled.is_some(),
        };
        self.carries = self.causes.on_load || self.causes.scheduled && limits.runs_on_load;
    }

    fn enter(&mut self, next: State, delay: Duration) {
        debug_assert!(Edge::cause(State::WAYS, self.state, next).is_some(), "{:?} {next:?}", self.state);
        if next == State::Started && self.state == State::StartDelay {
            self.turn = Duration::ZERO;
        }
        self.state = next;
        self.timer = Countdown::of(delay);
    }

    /// Which of two it is, and what the start outputs say.
    fn choose(&mut self, dt: Duration, scene: Scene<'_>, works: [bool; 2]) {
        let limits = scene.limits;
        let started = matches!(self.state, State::Started | State::StopDelay);
        if !started {
            self.relieved = None;
            self.chosen = match limits.choice {
                Choice::Cycle => self.chosen,
                Choice::Master => usize::from(!scene.masters[0]),
                Choice::Balanced => usize::from(self.hours[1] < self.hours[0]),
            };
        } else if scene.auto
            && works == [true; 2]
            && limits.choice == Choice::Cycle
            && self.state == State::Started
        {
            self.turn += dt;
            if self.turn >= limits.turns[self.chosen] {
                self.relieved = Some(self.chosen);
                self.chosen = 1 - self.chosen;
                self.turn = Duration::ZERO;
            }
        }
        if !works[self.chosen] && works[1 - self.chosen] {
            self.chosen = 1 - self.chosen;
            self.turn = Duration::ZERO;
        }
        if scene.runs[self.chosen] && self.relieved.is_some_and(|set| !scene.feeds[set]) {
            self.relieved = None;
        }
        self.signals =
            [0, 1].map(|set| started && works[set] && (set == self.chosen || self.relieved == Some(set)));
    }

    /// A set that is asked to run and does not is told of.
    fn watch(&mut self, dt: Duration, scene: Scene<'_>, board: &mut Board) {
        for set in 0..2 {
            if scene.runs[set] {
                self.hours[set] += dt;
            }
            let fails = self.signals[set] && !scene.runs[set];
            if self.missing[set].step(dt, fails, scene.limits.supply) {
                board.latch(Alarm::genset(set));
            }
        }
    }

    /// Bit 500.15.
    pub(super) fn start_output(&self) -> bool {
        self.signals != [false; 2]
    }

    /// The start signals of the sets behind source 1 and source 2.
    pub(super) fn signals(&self) -> [bool; 2] {
        self.signals
    }

    /// Sets that are to stop as soon as another one has taken their load over.
    pub(super) fn leaving(&self) -> [bool; 2] {
        [0, 1].map(|set| self.relieved == Some(set))
    }

    /// What runs is to carry load even while its mains are there.
    pub(super) fn carries(&self) -> bool {
        self.carries
    }

    pub(super) fn causes(&self) -> Causes {
        self.causes
    }

    /// Bits 0 to 2 of word 508: how the set was chosen that runs instead of the mains.
    pub(super) fn choice_bit(&self) -> Option<u16> {
        let chosen = self.two && self.causes.mains_abnormal && self.start_output();
        chosen.then_some(match self.choice {
            Choice::Cycle => 0,
            Choice::Balanced => 1,
            Choice::Master => 2,
        })
    }

    /// Bit 508.4.
    pub(super) fn is_not_scheduled(&self) -> bool {
        self.not_scheduled.is_some()
    }

    /// Bit 508.10.
    pub(super) fn is_inhibited(&self) -> bool {
        self.inhibited
    }

    /// Register 1092: the windows of the calendar under their own codes.
    pub(super) fn status(&self) -> u16 {
        match self.state {
            State::Standby if self.not_scheduled.is_some() => NOT_SCHEDULED,
            State::Started if self.causes.scheduled => SCHEDULED,
            state => state as u16,
        }
    }

    /// Register 1093.
    pub(super) fn seconds_left(&self) -> u16 {
        let window = match self.status() {
            NOT_SCHEDULED => self.not_scheduled,
            SCHEDULED => self.scheduled,
            _ => None,
        };
        window.map_or(self.timer, Countdown::of).seconds()
    }
}

#[cfg(test)]
mod tests;
