//! The keys of the front, as the push-button word presses them, and the pages that they turn.
//!
//! One word may press several keys: STOP wins, the others act in the order of their bits. What a key does when it is
//! held is not in the manual.

use super::identity::Front;
use super::sequence::{Source, Trip};
use super::{DatakomD, Mode};

const MENU_NEXT: u16 = 7;
const MENU_PREVIOUS: u16 = 8;
const UP: u16 = 9;
const DOWN: u16 = 10;
const LONG: u16 = 14;
const VERY_LONG: u16 = 15;

/// How long the keys are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Press {
    Short,
    Long,
    VeryLong,
}

/// Groups of display pages, in the order in which MENU turns them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Group {
    #[default]
    Status,
    Mains,
    Genset,
    Engine,
    Synchroscope,
    Scope,
    Counters,
    Service,
    Alarms,
    Unit,
}

impl Group {
    pub(super) const ALL: [Self; 10] = [
        Self::Status,
        Self::Mains,
        Self::Genset,
        Self::Engine,
        Self::Synchroscope,
        Self::Scope,
        Self::Counters,
        Self::Service,
        Self::Alarms,
        Self::Unit,
    ];
}

/// What the display is turned to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Menu {
    pub(super) group: Group,
    /// Pages turned down, less those turned up; the group has fewer and begins again.
    pub(super) turned: i32,
}

impl Menu {
    fn show(&mut self, group: Group) {
        *self = Self { group, turned: 0 };
    }

    /// As the unit does by itself when an alarm comes.
    pub(super) fn show_alarms(&mut self) {
        self.show(Group::Alarms);
    }

    fn turn_group(&mut self, by: usize) {
        let now = self.group as usize;
        self.show(Group::ALL[(now + by) % Group::ALL.len()]);
    }
}

impl DatakomD {
    /// Takes a word for the push buttons.
    pub(super) fn press(&mut self, keys: u16) {
        let pressed = |bit: u16| keys >> bit & 1 == 1;
        let press = match (pressed(LONG), pressed(VERY_LONG)) {
            (_, true) => Press::VeryLong,
            (true, false) => Press::Long,
            (false, false) => Press::Short,
        };
        if (0..=DOWN).any(pressed) {
            // Whoever touches the front has heard the horn.
            self.alarms.mute();
        }
        if pressed(0) {
            return self.press_stop();
        }
        for key in (1..=DOWN).filter(|key| pressed(*key)) {
            match key {
                1..=4 => self.press_mode(key),
                5 => {
                    let ready = self.sequence.operation().is_up_to_speed()
                        && self.genset_healthy()
                        && !self.contacts.loading_inhibited;
                    self.press_breaker(Source::Genset, ready);
                }
                6 => self.press_breaker(Source::Mains, self.mains.is_healthy()),
                _ => self.press_menu(key, press),
            }
        }
    }

    fn press_mode(&mut self, key: u16) {
        match (key, self.identity.front) {
            (1, Front::Run) | (4, Front::ManualAndRun) => {
                self.enter(Mode::Run);
                self.run_wanted = true;
            }
            (1, Front::ManualAndRun) => {
                // The mode changes, and nothing else: a running engine goes on running, with the load that it has.
                let (running, source) = (self.readings.running, self.feeding());
                if self.enter(Mode::Run) {
                    (self.run_wanted, self.source) = (running, source);
                }
            }
            (2, _) => {
                self.enter(Mode::Auto);
            }
            (3, _) => {
                self.enter(Mode::Test);
            }
            _ => {}
        }
    }

    /// What feeds the load now, as far as the genset has to do with it.
    fn feeding(&self) -> Source {
        match self.sequence.operation().carries_load() {
            true => self.demand().source,
            false => Source::Mains,
        }
    }

    fn press_stop(&mut self) {
        if self.mode == Mode::Stop {
            self.sequence.trip(Trip::Shutdown);
        }
        self.enter(Mode::Stop);
        self.reset_alarms();
    }

    fn press_breaker(&mut self, own: Source, ready: bool) {
        if self.mode != Mode::Run {
            return;
        }
        let (genset, mains) = (self.controls.genset_breaker, self.controls.mains_breaker);
        let (driven, left) = match own {
            Source::Genset => (genset, if mains { Source::Mains } else { Source::Nothing }),
            _ => (mains, if genset { Source::Genset } else { Source::Nothing }),
        };
        // One that is on its way turns round.
        if driven || ready && self.source == own {
            self.source = left;
        } else if ready {
            self.source = own;
        }
    }

    fn press_menu(&mut self, key: u16, press: Press) {
        match (key, press) {
            (MENU_NEXT, Press::Short) => self.menu.turn_group(1),
            (MENU_PREVIOUS, Press::Short) => self.menu.turn_group(Group::ALL.len() - 1),
            (MENU_NEXT, _) => self.menu.show(Group::Alarms),
            (MENU_PREVIOUS, _) => self.menu.show(Group::Status),
            (DOWN, Press::VeryLong) if self.menu.group == Group::Service => {
                self.service.done(self.plant.engine.hours, self.plant.time);
            }
            (DOWN, Press::Long | Press::VeryLong) => self.reset_alarms(),
            (DOWN, Press::Short) => self.menu.turned = self.menu.turned.saturating_add(1),
            (UP, Press::Short) => self.menu.turned = self.menu.turned.saturating_sub(1),
            _ => {}
        }
    }

    /// Forgets the alarms whose cause is gone.
    fn reset_alarms(&mut self) {
        self.sequence.acknowledge();
        self.alarms.reset();
    }

    /// Changes the mode; false where it is the one already.
    fn enter(&mut self, mode: Mode) -> bool {
        let changes = mode != self.mode;
        if changes {
            self.mode = mode;
            self.run_wanted = false;
            self.source = Source::Mains;
        }
        changes
    }
}
