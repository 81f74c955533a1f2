//! SmartGen HAT821SI: two sources, two bus sections with twelve load switches each, and the tie between them.
//!
//! Power-on finds the controller in automatic and remote mode, each source on its own section, the tie open and every
//! load switch closed. Where the manual is silent this is what the imitation does:
//! - the digits of a transfer command are QS1, QTIE and QS2: the codes that are missing, 010 and 111, are then the
//!   useless one and the forbidden one;
//! - both sources are masters: each feeds its section while both are good. With one master alone that one feeds both
//!   sections, and a section whose source has failed is fed over the tie. The master coils are levels, like
//!   automatic / manual: 0000h makes a source the standby one. So are the remote outputs: 0000h switches one off. For
//!   all other coils 0000h does nothing;
//! - remote commands work in automatic and in manual mode, and not while somebody has set the controller to local. In
//!   automatic mode a remote transfer stays until a source fails or returns, a master is set, or automatic mode is set
//!   again. A transfer onto a source that is not available is ignored, and so is one while a switch has failed;
//! - in manual mode nothing is transferred by itself;
//! - a switch that has not moved within its time has failed, and holds off transfers until the alarms are reset;
//! - a load switch falls when its section has been dead for a second. In automatic mode they come back one a second;
//!   in manual mode the window asks first, and cancelling it leaves them open;
//! - the genset stands behind source 2 and takes over there when its mains are dead. In automatic mode it starts by
//!   itself when neither source is available, and runs until source 1 is; a remote stop does not end that;
//! - registers without a scale: A, kW, kvar and kVA as they are, power factors in hundredths, percentages and angles
//!   in tenths, switch numbers from 1 with 0 for none; parallel mode is 0, as sources are never in parallel;
//! - the expansion modules are wired to the load switches: inputs 1 and 2 closed, 3 and 4 tripped, 5 and 6 in work
//!   position, outputs 2 and 3 the closing outputs. Output module 1 carries the remote outputs, 4 nothing.

mod counters;
mod genset;
mod loads;
mod plant;
mod render;
mod section;
mod source;
mod story;
mod transfer;

use std::time::Duration;

use busbar_modbus::ExceptionCode;
use busbar_profile::DateTime;

use crate::bank::Bank;
use crate::panel::Panel;
use crate::random::Random;
use crate::rules::Refusals;

use counters::SupplyTime;
use genset::Genset;
use loads::Loads;
use plant::{Plant, Positions, Switch};
use source::Supervision;
use story::Scene;
use transfer::Sequence;

const AUTO: u16 = 15_004;
const S1_MASTER: u16 = 15_005;
const S2_MASTER: u16 = 15_006;
const ALARM_RESET: u16 = 15_007;
const GENSET_START: u16 = 15_008;
const GENSET_STOP: u16 = 15_009;
const FIRST_OUTPUT: u16 = 15_012;
const LAST_OUTPUT: u16 = FIRST_OUTPUT + REMOTE_OUTPUTS as u16 - 1;
const TRANSFER_000: u16 = 15_030;
const TRANSFER_101: u16 = 15_031;
const TRANSFER_110: u16 = 15_032;
const TRANSFER_011: u16 = 15_033;
const TRANSFER_100: u16 = 15_034;
const TRANSFER_001: u16 = 15_035;
const WINDOW_CONFIRM: u16 = 15_036;
const WINDOW_CANCEL: u16 = 15_037;
/// Closing and opening of 1-1, closing and opening of 1-2, and so on to 2-12.
const FIRST_LOAD: u16 = 15_040;
const LAST_LOAD: u16 = 15_087;

const REMOTE_OUTPUTS: usize = 13;
/// Both sources on their own sections.
const NORMAL: Positions = Positions::of(1, 0, 1);
/// The feeder of the story, load switch 2-7, as section and index.
const STORY_FEEDER: (usize, usize) = (1, 6);
/// How long the horn sounds for a new alarm.
const HORN: Duration = Duration::from_secs(30);

/// The controller and its switchgear.
#[derive(Clone, Debug)]
pub(crate) struct Hat821si {
    plant: Plant,
    passed: Duration,
    /// What the calendar said at power-on.
    epoch: DateTime,
    supervision: [Supervision; 2],
    sequence: Sequence,
    loads: [Loads; 2],
    genset: Genset,
    auto: bool,
    /// The key on the front says local: remote commands are ignored.
    local: bool,
    masters: [bool; 2],
    /// Where the switches shall stand.
    target: Positions,
    /// A remote transfer in automatic mode holds while exactly these sources are available.
    held: Option<[bool; 2]>,
    remote_start: bool,
    /// The genset runs because neither source was available.
    mains_abnormal: bool,
    remote_outputs: [bool; REMOTE_OUTPUTS],
    alarms: usize,
    horn: Duration,
    /// How long each source has fed a section.
    source_supply: [Duration; 2],
    load_supply: [SupplyTime; 2],
    story: bool,
    scene: Scene,
}

impl Hat821si {
    pub(crate) fn new(seed: u64, story: bool) -> Self {
        let mut random = Random::new(seed ^ 0x0821_5100);
        let mut past = || Duration::from_secs(random.between(2.0e7, 9.0e7) as u64);
        let source_supply = [past(), past()];
        let mut plant = Plant::new(seed, NORMAL);
        for (source, time) in plant.sources.iter_mut().zip(source_supply) {
            source.has_served(time, random.between(0.6, 0.8));
        }
        Self {
            plant,
            passed: Duration::ZERO,
            supervision: [Supervision::new(), Supervision::new()],
            sequence: Sequence::new(),
            loads: [Loads::new(), Loads::new()],
            genset: Genset::new(),
            auto: true,
            local: false,
            masters: [true; 2],
            target: NORMAL,
            held: None,
            remote_start: false,
            mains_abnormal: false,
            remote_outputs: [false; REMOTE_OUTPUTS],
            alarms: 0,
            horn: Duration::ZERO,
            source_supply,
            load_supply: source_supply.map(|own| SupplyTime::new(own, &mut random)),
            story,
            scene: Scene::NOTHING,
            epoch: DateTime::FIRST,
        }
    }

    /// The same controller with its calendar set.
    pub(crate) fn starting(self, epoch: DateTime) -> Self {
        Self { epoch, ..self }
    }

    fn available(&self) -> [bool; 2] {
        self.supervision.each_ref().map(Supervision::is_available)
    }

    /// Where automatic mode wants the switches; nowhere else while there is no source.
    fn automatic(&self) -> Positions {
        match (self.available(), self.masters) {
            ([true, true], [true, false]) | ([true, false], _) => Positions::of(1, 1, 0),
            ([true, true], [false, true]) | ([false, true], _) => Positions::of(0, 1, 1),
            ([true, true], _) => NORMAL,
            ([false, false], _) => self.target,
        }
    }

    fn choose_target(&mut self) {
        let failed = self.sequence.has_failed();
        if failed || self.held.is_some_and(|then| then != self.available()) {
            self.held = None;
        }
        if !self.auto {
            if failed {
                // What could not be done by hand is not tried again by itself.
                self.target = self.plant.positions();
            }
        } else if self.held.is_none() {
            self.target = self.automatic();
        }
    }

    fn choose_genset(&mut self) {
        let [first, second] = self.available();
        if !self.auto || first {
            self.mains_abnormal = false;
        } else if !second {
            self.mains_abnormal = true;
        }
    }

    fn transfer(&mut self, to: Positions) {
        let sources = [Switch::Qs1, Switch::Qs2].map(|switch| to.is_closed(switch));
        let dead = sources.iter().zip(self.available()).any(|(closes, available)| *closes && !available);
        if dead || self.sequence.has_failed() {
            return;
        }
        self.target = to;
        self.held = self.auto.then_some(self.available());
    }

    fn set_auto(&mut self, on: bool) {
        self.auto = on;
        self.held = None;
    }

    fn set_master(&mut self, source: usize, on: bool) {
        self.masters[source] = on;
        self.held = None;
    }

    fn acknowledge(&mut self) {
        self.sequence.acknowledge();
        self.loads.iter_mut().for_each(Loads::acknowledge);
        self.horn = Duration::ZERO;
    }

    /// A coil that acts when it is set, whatever it was.
    fn press(&mut self, coil: u16) {
        match coil {
            ALARM_RESET => self.acknowledge(),
            GENSET_START => self.remote_start = true,
            GENSET_STOP => self.remote_start = false,
            TRANSFER_000 => self.transfer(Positions::OPEN),
            TRANSFER_101 => self.transfer(NORMAL),
            TRANSFER_110 => self.transfer(Positions::of(1, 1, 0)),
            TRANSFER_011 => self.transfer(Positions::of(0, 1, 1)),
            TRANSFER_100 => self.transfer(Positions::of(1, 0, 0)),
            TRANSFER_001 => self.transfer(Positions::of(0, 0, 1)),
            WINDOW_CONFIRM => self.loads.iter_mut().for_each(|loads| loads.answer(true)),
            WINDOW_CANCEL => self.loads.iter_mut().for_each(|loads| loads.answer(false)),
            FIRST_LOAD..=LAST_LOAD => {
                let number = usize::from(coil - FIRST_LOAD);
                let (section, within) = (number / (2 * plant::FEEDERS), number % (2 * plant::FEEDERS));
                self.loads[section].drive(within / 2, within % 2 == 0);
            }
            _ => {}
        }
    }

    fn play(&mut self) {
        if !self.story {
            return;
        }
        let scene = Scene::at(self.passed.as_secs_f64());
        let before = std::mem::replace(&mut self.scene, scene);
        self.plant.sources[0].trouble = scene.source_1;
        self.plant.switches[Switch::Qtie as usize].jammed = scene.tie_jammed;
        self.local = scene.attended;
        let (section, feeder) = STORY_FEEDER;
        if scene.feeder_fault && !before.feeder_fault {
            self.loads[section].trip(feeder);
        }
        if scene.repaired && !before.repaired {
            self.acknowledge();
            self.loads[section].drive(feeder, true);
        }
    }

    fn sound(&mut self, dt: Duration) {
        let tripped: usize = self.loads.iter().map(|loads| loads.tripped().len()).sum();
        let alarms = tripped + usize::from(self.sequence.has_failed());
        self.horn = if alarms > self.alarms { HORN } else { self.horn.saturating_sub(dt) };
        self.alarms = alarms;
    }

    fn count(&mut self, dt: Duration) {
        let feeding = self.plant.feeding();
        let alive = self.plant.alive();
        for (index, supply) in self.source_supply.iter_mut().enumerate() {
            let feeds = feeding.iter().zip(alive).any(|(from, alive)| *from == Some(index) && alive);
            *supply += if feeds { dt } else { Duration::ZERO };
        }
        for (supply, alive) in self.load_supply.iter_mut().zip(alive) {
            supply.step(dt, alive);
        }
    }
}

impl Panel for Hat821si {
    fn step(&mut self, dt: Duration) {
        let seconds = dt.as_secs_f64();
        self.passed += dt;
        self.play();
        // The switchgear first: the words then tell of switches that have moved, in the same image.
        self.plant.switch(seconds, self.sequence.drives());
        for (loads, alive) in self.loads.iter_mut().zip(self.plant.alive()) {
            loads.step(dt, alive, self.auto);
        }
        let connected = self.loads.each_ref().map(Loads::connected);
        self.plant.carry(seconds, connected, self.genset.is_running());
        for (supervision, source) in self.supervision.iter_mut().zip(&self.plant.sources) {
            supervision.step(dt, &source.feed);
        }
        self.choose_target();
        self.choose_genset();
        self.genset.step(dt, self.remote_start || self.mains_abnormal);
        self.sequence.step(dt, self.plant.positions(), self.target);
        self.sound(dt);
        self.count(dt);
    }

    /// No register can be written.
    fn write(&mut self, _address: u16, _value: u16) {}

    fn write_coil(&mut self, coil: u16, on: bool) {
        if self.local {
            return;
        }
        match coil {
            AUTO => self.set_auto(on),
            S1_MASTER => self.set_master(0, on),
            S2_MASTER => self.set_master(1, on),
            FIRST_OUTPUT..=LAST_OUTPUT => self.remote_outputs[usize::from(coil - FIRST_OUTPUT)] = on,
            key if on => self.press(key),
            _ => {}
        }
    }

    fn is_silent(&self) -> bool {
        false
    }

    fn render(&self, bank: &mut Bank) {
        render::registers(self, bank);
    }

    fn refusals(&self) -> Refusals {
        Refusals {
            quantity: ExceptionCode::ILLEGAL_DATA_VALUE,
            // Never used: there is no function that writes registers.
            protected: ExceptionCode::ILLEGAL_DATA_ADDRESS,
        }
    }
}

#[cfg(test)]
mod tests;
