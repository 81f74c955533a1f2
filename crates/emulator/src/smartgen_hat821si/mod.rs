//! SmartGen HAT821SI: two sources, two bus sections with twelve load switches each, and the tie between them.
//!
//! Power-on finds the controller in automatic and remote mode, each source on its own section, the tie open and every
//! load switch closed. `docs/imitation/smartgen-hat821si.md` draws its states, lists what can be made to happen to it,
//! and says what it does where the manual is silent.

mod alarms;
mod control;
mod counters;
mod diagram;
mod genset;
mod inputs;
mod levers;
mod loads;
mod plant;
mod protection;
mod render;
mod schedule;
mod shedding;
mod story;
mod supervision;
mod switches;
mod sync;
mod timer;
mod transfer;

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_modbus::ExceptionCode;
use busbar_profile::DateTime;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::Supply;
use crate::random::Random;
use crate::rules::Refusals;
use crate::settings::Settings;

use alarms::{Alarm, Board};
use control::{Bars, Control, NORMAL};
use counters::SupplyTime;
use genset::Genset;
use inputs::{Input, Inputs};
use loads::{Around, Loads};
use plant::{Meter, Outputs, Plant, Source};
use protection::Protection;
use shedding::{Burden, Shedding};
use story::Scene;
use supervision::{Sensed, Supervision};
use switches::{Drive, FEEDERS, Positions, Switch};
use sync::Synchroscope;
use transfer::{Failure, Sequence, View};

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

/// Timers and thresholds as they are set, by the part that acts upon them.
#[derive(Clone, Debug, Default)]
struct Limits {
    supervision: supervision::Limits,
    transfer: transfer::Limits,
    sync: sync::Limits,
    loads: loads::Limits,
    shedding: shedding::Limits,
    protection: protection::Limits,
    genset: genset::Limits,
    restores: bool,
    /// How long the horn sounds for a new alarm.
    horn: Duration,
}

impl Limits {
    fn of(settings: &Settings) -> Self {
        Self {
            supervision: supervision::Limits::of(settings),
            transfer: transfer::Limits::of(settings),
            sync: sync::Limits::of(settings),
            loads: loads::Limits::of(settings),
            shedding: shedding::Limits::of(settings),
            protection: protection::Limits::of(settings),
            genset: genset::Limits::of(settings),
            restores: settings.is_on("auto_restore"),
            horn: settings.seconds("horn_time"),
        }
    }
}

/// The controller and its switchgear.
#[derive(Clone, Debug)]
pub(crate) struct Hat821si {
    plant: Plant,
    limits: Limits,
    passed: Duration,
    /// What the calendar said at power-on.
    epoch: DateTime,
    inputs: Inputs,
    board: Board,
    meters: [Meter; 2],
    supervision: [Supervision; 2],
    protection: Protection,
    control: Control,
    synchroscope: Synchroscope,
    sequence: Sequence,
    loads: [Loads; 2],
    shedding: Shedding,
    genset: Genset,
    auto: bool,
    /// The key on the front says local: remote commands are ignored.
    local: bool,
    masters: [bool; 2],
    remote_outputs: [bool; REMOTE_OUTPUTS],
    /// Those of a moment ago: the horn sounds for each that is new.
    alarms: BTreeSet<Alarm>,
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
        let mut inputs = Inputs::default();
        inputs.hear(&plant);
        Self {
            meters: plant.sources.each_ref().map(Source::meter),
            plant,
            limits: Limits::default(),
            passed: Duration::ZERO,
            epoch: DateTime::FIRST,
            inputs,
            board: Board::default(),
            supervision: [Supervision::new(0), Supervision::new(1)],
            protection: Protection::new(NORMAL),
            control: Control::new(NORMAL),
            synchroscope: Synchroscope::default(),
            sequence: Sequence::new(),
            loads: [Loads::new(0), Loads::new(1)],
            shedding: Shedding::default(),
            genset: Genset::new(),
            auto: true,
            local: false,
            masters: [true; 2],
            remote_outputs: [false; REMOTE_OUTPUTS],
            alarms: BTreeSet::new(),
            horn: Duration::ZERO,
            source_supply,
            load_supply: source_supply.map(|own| SupplyTime::new(own, &mut random)),
            story,
            scene: Scene::NOTHING,
        }
    }

    /// The same controller with its calendar set.
    pub(crate) fn starting(self, epoch: DateTime) -> Self {
        Self { epoch, ..self }
    }

    fn now(&self) -> DateTime {
        self.epoch.plus(self.passed)
    }

    fn available(&self) -> [bool; 2] {
        self.supervision.each_ref().map(Supervision::is_available)
    }

    /// Which sources are there only because a genset stands in for their mains.
    fn guests(&self) -> [bool; 2] {
        let asked = self.genset.carries();
        self.plant.sources.each_ref().map(|source| source.is_on_genset() && !asked)
    }

    /// Remote commands are ignored.
    fn is_deaf(&self) -> bool {
        self.local || self.inputs.has(Input::RemoteInhibit)
    }

    /// What the outputs do now. What hangs on a module that is silent is off.
    fn outputs(&self) -> Outputs {
        let [_, first, second, third] = self.inputs.output_modules_cut;
        let mut loads = self.loads.each_ref().map(Loads::drives);
        for (side, cut) in [first, second].into_iter().enumerate() {
            for (feeder, drive) in loads[side].iter_mut().enumerate() {
                let cut = match drive {
                    Some(Drive::Open) if feeder >= inputs::OWN_OPENING => third,
                    _ => cut,
                };
                *drive = drive.filter(|_| !cut);
            }
        }
        Outputs {
            switches: self.sequence.drives(),
            loads,
            start: self.genset.signals(),
            on_load: self.genset.carries(),
            shed: self.shedding.steps(),
        }
    }

    fn burden(&self) -> Burden {
        let parts = [0, 1].map(|source: usize| {
            let on_genset = self.plant.sources[source].is_on_genset();
            self.meters[source].power / self.limits.shedding.capacity(source, on_genset).max(1.0)
        });
        Burden { parts, feeds: self.plant.feeds() }
    }

    fn bars(&self) -> Bars {
        let has = |input| self.inputs.has(input);
        let sources = [has(Input::Qs1QtieInhibit), has(Input::Qs2QtieInhibit)];
        Bars {
            locked: self.protection.locks(&self.board),
            inhibited: Positions::by(|switch| match switch {
                Switch::Qs1 => has(Input::S1CloseInhibit) || sources[0],
                Switch::Qtie => has(Input::QtieCloseInhibit) || sources[0] || sources[1],
                Switch::Qs2 => has(Input::S2CloseInhibit) || sources[1],
            }),
            not_closed: self.stuck(Drive::Close),
            now: self.plant.positions(),
            no_supply_over_tie: [has(Input::S1SupplyQtieInhibit), has(Input::S2SupplyQtieInhibit)],
        }
    }

    /// The switches that have an alarm because they did not close, or did not open.
    fn stuck(&self, drive: Drive) -> Positions {
        Positions::by(|switch| self.board.has(Alarm::stuck(switch, drive)))
    }

    fn wishes(&self) -> control::Scene {
        control::Scene {
            auto: self.auto,
            masters: self.masters,
            available: self.available(),
            guests: self.guests(),
            leaving: self.genset.leaving(),
            restores: self.limits.restores || self.inputs.has(Input::AutoRestore),
            faultless: self.supervision.each_ref().map(Supervision::is_faultless),
            forced_open: self.protection.forces_open(&self.board),
            bars: self.bars(),
        }
    }

    fn set_auto(&mut self, on: bool) {
        self.auto = on;
        self.control.reconsider();
    }

    fn set_master(&mut self, source: usize, on: bool) {
        self.masters[source] = on;
        self.control.reconsider();
    }

    fn transfer(&mut self, to: Positions) {
        let wishes = self.wishes();
        if self.stuck(Drive::Open) == Positions::OPEN {
            self.control.transfer(to, wishes);
        }
    }

    fn acknowledge(&mut self) {
        self.board.reset();
        self.protection.acknowledge();
        self.plant.relays = [false; 3];
        self.loads.iter_mut().for_each(Loads::acknowledge);
        self.horn = Duration::ZERO;
    }

    /// A coil that acts when it is set, whatever it was.
    fn press(&mut self, coil: u16) {
        match coil {
            ALARM_RESET => self.acknowledge(),
            GENSET_START => self.genset.command(true, self.auto),
            GENSET_STOP => self.genset.command(false, self.auto),
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
                let (side, within) = (number / (2 * FEEDERS), number % (2 * FEEDERS));
                let drive = if within % 2 == 0 { Drive::Close } else { Drive::Open };
                self.loads[side].drive(within / 2, drive, &self.limits.loads, &self.board);
            }
            _ => {}
        }
    }

    /// `before` are the sources that had a guest before this step.
    fn judge(&mut self, dt: Duration, before: [bool; 2]) {
        for (source, supervision) in self.supervision.iter_mut().enumerate() {
            let sensed = Sensed {
                meter: &self.meters[source],
                broken_wire: self.protection.broken_wire(source),
                reverse_power: self.board.has(Alarm::reverse_power(source)),
                lost: before[source] && !self.plant.sources[source].is_on_genset(),
            };
            supervision.step(dt, sensed, &self.limits.supervision);
        }
    }

    fn protect(&mut self, dt: Duration, drives: [Option<Drive>; 3]) {
        let [first, second] = &self.meters;
        let scene = protection::Scene {
            meters: [first, second],
            has_phases: self.supervision.each_ref().map(Supervision::has_phases),
            burden: self.burden(),
            positions: self.plant.positions(),
            relays: self.plant.relays,
            drives,
            inputs: &self.inputs,
            supervision: &self.limits.supervision,
            sync_fails: self.sequence.sync_fails(),
        };
        self.protection.step(dt, scene, &self.limits.protection, &mut self.board);
    }

    fn ask_for_gensets(&mut self, dt: Duration) {
        let guests = self.guests();
        let on_genset = self.plant.sources.each_ref().map(Source::is_on_genset);
        let feeds = [0, 1].map(|source: usize| self.plant.feeds().iter().any(|by| by[source]));
        let scene = genset::Scene {
            now: self.now(),
            auto: self.auto,
            masters: self.masters,
            available: self.available(),
            on_genset,
            serves: (0..2).any(|source| feeds[source] && guests[source]),
            feeds: [0, 1].map(|source: usize| feeds[source] && on_genset[source]),
            on_load_input: self.inputs.has(Input::StartOnLoad),
            off_load_input: self.inputs.has(Input::StartOffLoad),
            inhibited: self.inputs.has(Input::StartInhibit),
            runs: self.plant.engines.each_ref().map(plant::Engine::has_voltage),
            limits: &self.limits.genset,
        };
        self.genset.step(dt, scene, &mut self.board);
    }

    fn transfer_on(&mut self, dt: Duration) {
        let [first, second] = &self.meters;
        self.synchroscope.step(dt, [first, second]);
        let wishes = self.wishes();
        self.control.step(wishes);
        let faultless = self.supervision.iter().all(Supervision::is_faultless);
        let view = View {
            now: self.plant.positions(),
            target: self.control.target(),
            ready: self.inputs.ready(),
            not_closed: self.stuck(Drive::Close),
            not_opened: self.stuck(Drive::Open),
            may_loop: self.limits.sync.loops() && faultless,
            in_step: self.synchroscope.is_in_step(&self.limits.sync, &self.limits.supervision),
            forced: if wishes.forced_open { Positions::ALL_CLOSED } else { wishes.bars.locked },
            alive: self.plant.alive(),
        };
        match self.sequence.step(dt, view, &self.limits.transfer) {
            Some(Failure::Move(switch, drive)) => self.board.latch(Alarm::stuck(switch, drive)),
            Some(Failure::Sync) => {
                if let Some(alarm) = self.limits.protection.latched_sync_alarm() {
                    self.board.latch(alarm);
                }
            }
            None => {}
        }
    }

    fn serve_loads(&mut self, dt: Duration) {
        let burden = self.burden();
        let (alive, auto) = (self.plant.alive(), self.auto);
        let limits = &self.limits;
        let around = [0, 1].map(|side: usize| Around {
            heard: self.inputs.feeders(side),
            alive: alive[side],
            auto,
            full: self.limits.shedding.full(side, burden),
            limits: &limits.loads,
        });
        for (loads, around) in self.loads.iter_mut().zip(around) {
            loads.step(dt, around, &mut self.board);
        }
        self.shedding.step(dt, burden, &limits.shedding);
        let scene = shedding::Scene { burden, around, limits: &limits.shedding, board: &self.board };
        self.shedding.unload(dt, &mut self.loads, scene);
    }

    fn sound(&mut self, dt: Duration) {
        let alarms = self.board.active();
        let news = !alarms.is_subset(&self.alarms);
        self.horn = if news { self.limits.horn } else { self.horn.saturating_sub(dt) };
        self.alarms = alarms;
    }

    fn count(&mut self, dt: Duration) {
        let (feeds, alive) = (self.plant.feeds(), self.plant.alive());
        for (source, supply) in self.source_supply.iter_mut().enumerate() {
            let serves = feeds.iter().zip(alive).any(|(by, alive)| by[source] && alive);
            *supply += if serves { dt } else { Duration::ZERO };
        }
        for (supply, alive) in self.load_supply.iter_mut().zip(alive) {
            supply.step(dt, alive);
        }
    }
}

impl Panel for Hat821si {
    fn step(&mut self, dt: Duration) {
        self.passed += dt;
        self.play();
        let (outputs, guests) = (self.outputs(), self.guests());
        self.plant.step(dt.as_secs_f64(), &outputs);
        self.meters = self.plant.sources.each_ref().map(Source::meter);
        self.inputs.hear(&self.plant);
        self.protect(dt, outputs.switches);
        self.judge(dt, guests);
        self.ask_for_gensets(dt);
        self.transfer_on(dt);
        self.serve_loads(dt);
        self.sound(dt);
        self.count(dt);
    }

    /// No register can be written.
    fn write(&mut self, _address: u16, _value: u16) {}

    fn write_coil(&mut self, coil: u16, on: bool) {
        if self.is_deaf() {
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

    fn configure(&mut self, settings: &Settings) {
        self.limits = Limits::of(settings);
        self.board.feeder_faults = settings.is_on("load_switch_fault");
    }

    fn levers(&self) -> &'static [Lever] {
        levers::LEVERS
    }

    fn lever(&self, id: &str) -> Option<Position> {
        self.position_of(id)
    }

    fn pull(&mut self, id: &str, to: Position) {
        self.pull_to(id, to);
    }

    fn section(&self, section: usize) -> Option<Supply> {
        (section < 2).then(|| self.plant.supply(section))
    }

    fn inject(&mut self, point: &str, bit: u16, active: bool) -> bool {
        render::word_of(point).is_some_and(|word| self.board.inject(word, bit, active))
    }
}

#[cfg(test)]
mod tests;
