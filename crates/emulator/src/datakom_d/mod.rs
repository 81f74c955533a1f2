//! Datakom D-300, D-500 and D-700: the unit with its plant, stepped and written to.
//!
//! Power-on finds it in AUTO with healthy mains that carry the load. What the imitation does where the manual is silent
//! stands in `docs/imitation/datakom-d.md`.

mod alarms;
mod contacts;
mod demand;
mod display;
mod gps;
mod identity;
mod keys;
mod loss_of_mains;
mod mains;
mod operation;
mod readings;
mod regulation;
mod render;
mod sequence;
mod service;
mod settings;
mod status;
mod story;
#[cfg(test)]
mod transitions;
mod watch;

use std::time::Duration;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::{Controls, Plant, Tank};
use crate::random::Random;
use crate::rules::Refusals;
use crate::waveform::Distortion;

use busbar_modbus::ExceptionCode;

use alarms::{Alarms, Breakers};
use contacts::Contacts;
use demand::{Causes, Peak};
use gps::Gps;
use identity::Identity;
use keys::Menu;
use loss_of_mains::LossOfMains;
use mains::Mains;
use operation::Operation::{Exporting, MainsBreakerTimer, TransferToMains, WaitBeforeFuel};
use readings::Readings;
use regulation::Regulation;
use sequence::{Demand, Sensed, Sequence, Source};
use service::Service;
use settings::Settings;
use story::Scene;
use watch::{Class, Situation};

const PUSH_BUTTONS: u16 = 8193;
const CHANNEL_SELECT: u16 = 8194;
const HARD_RESET: u16 = 8210;
const RESET_WORD: u16 = 14_536;
const LAST_CHANNEL: u16 = 19;
/// How long a unit takes to come back.
const RESTART: Duration = Duration::from_secs(4);

/// The unit and its plant.
#[derive(Clone, Debug)]
pub(crate) struct DatakomD {
    plant: Plant,
    settings: Settings,
    readings: Readings,
    mains: Mains,
    loss_of_mains: LossOfMains,
    contacts: Contacts,
    sequence: Sequence,
    regulation: Regulation,
    alarms: Alarms,
    peak: Peak,
    distortion: Distortion,
    random: Random,
    identity: Identity,
    gps: Gps,
    mode: Mode,
    /// RUN was pressed: the engine is wanted in the manual mode.
    run_wanted: bool,
    /// What the breaker keys chose in the manual mode.
    source: Source,
    controls: Controls,
    block_heater: bool,
    fuel_pump: bool,
    /// How long the pump has been told to run.
    pumping: Duration,
    /// Consumers are shed until the load is low enough.
    shedding: bool,
    channel: u16,
    menu: Menu,
    story: bool,
    scene: Scene,
    restarting: Duration,
    ethernet_resets: u16,
    packets: u16,
    service: Service,
}

/// Mode codes of register 10605.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Mode {
    Stop = 1,
    /// MANUAL on a D-700, RUN on the others.
    Run = 2,
    Auto = 4,
    Test = 8,
}

impl DatakomD {
    /// A unit of the model with this name and identity code.
    pub(crate) fn new(model: &str, code: u16, seed: u64, story: bool) -> Self {
        let mut random = Random::new(seed ^ 0xD500);
        let mut plant = Plant::new(seed);
        if story {
            // Low enough that the story reaches the warning.
            plant.tank = Tank::new(24.9);
        }
        let hours = plant.engine.hours;
        Self {
            settings: Settings::default(),
            readings: Readings::of(&plant, 0.0),
            mains: Mains::good(),
            loss_of_mains: LossOfMains::default(),
            contacts: Contacts::default(),
            sequence: Sequence::new((hours / 3.1) as u32),
            regulation: Regulation::new(&mut plant),
            alarms: Alarms::new(),
            peak: Peak::default(),
            distortion: Distortion::new(&mut random),
            identity: Identity::new(model, code, &mut random),
            gps: Gps::new(seed ^ 0x6B5),
            mode: Mode::Auto,
            run_wanted: false,
            source: Source::Mains,
            controls: Controls { mains_breaker: true, ..Controls::default() },
            block_heater: false,
            fuel_pump: false,
            pumping: Duration::ZERO,
            shedding: false,
            channel: 0,
            menu: Menu::default(),
            story,
            scene: Scene::NOTHING,
            restarting: Duration::ZERO,
            ethernet_resets: random.between(1.0, 9.0) as u16,
            packets: 0,
            service: Service::new(hours, &mut random),
            plant,
            random,
        }
    }

    fn demand(&self) -> Demand {
        let wanted = self.wish();
        match wanted.source {
            Source::Genset | Source::PeakLopping | Source::Exporting if self.contacts.loading_inhibited => {
                Demand { source: Source::Mains, ..wanted }
            }
            _ => wanted,
        }
    }

    /// What the mode asks for.
    fn wish(&self) -> Demand {
        let causes = Causes {
            settings: &self.settings,
            contacts: self.contacts,
            mains: &self.mains,
            mains_usable: self.mains_usable(),
            remote_start: self.readings.remote_start,
            exerciser: self.is_exercising(),
            peak: &self.peak,
            operation: self.sequence.operation(),
        };
        match self.mode {
            // A mains breaker that was opened by hand stays open.
            Mode::Run if self.alarms.trip().is_some() => Demand { engine: false, source: self.source },
            _ if self.alarms.trip().is_some() => Demand::REST,
            Mode::Stop => Demand::REST,
            Mode::Run => {
                let chosen = Demand { engine: self.run_wanted, source: self.source };
                // Mains that fail leave a genset beside them the load.
                let helps = chosen.parallel() || self.settings.emergency_backup && chosen == Demand::OFF_LOAD;
                causes.backup().filter(|_| helps).unwrap_or(chosen)
            }
            Mode::Test => Demand::ON_LOAD,
            Mode::Auto => causes.auto(),
        }
    }

    /// The mains are good, and their breaker has not refused them.
    fn mains_usable(&self) -> bool {
        self.mains.is_healthy() && !self.alarms.mains_breaker_refused()
    }

    /// The story or the weekly schedule wants the genset to be exercised.
    fn is_exercising(&self) -> bool {
        let Settings { exerciser_interval: interval, exerciser_duration: duration, .. } = self.settings;
        let time = self.plant.time;
        let scheduled = interval > 0.0 && time >= interval && time % interval < duration;
        self.scene.exerciser || scheduled
    }

    /// Other gensets on the bus bar are to run with this one.
    fn calls_others(&self) -> bool {
        let others = matches!(self.plant.lever("busbar.gensets"), Some(Position::Number(_)));
        others && (WaitBeforeFuel..=MainsBreakerTimer).contains(&self.sequence.operation())
    }

    fn genset_healthy(&self) -> bool {
        self.readings.genset_within(self.settings.genset_voltage, self.settings.genset_frequency)
    }

    fn sensed(&self) -> Sensed {
        let (genset_unloaded, mains_unloaded) = regulation::unloaded(&self.plant);
        Sensed {
            running: self.readings.running,
            turning: self.readings.turning,
            genset_healthy: self.genset_healthy(),
            mains_healthy: self.mains_usable(),
            genset_breaker: self.plant.genset_breaker.closed,
            mains_breaker: self.plant.mains_breaker.closed,
            in_step: self.regulation.in_step(),
            genset_unloaded,
            mains_unloaded,
        }
    }

    /// Left of the timer that the unit shows: that of the status, else that of mains which are waited for.
    fn seconds_left(&self) -> u64 {
        let waits = self.sequence.operation().is_committed() && self.mode == Mode::Auto;
        let left = match self.sequence.timer() {
            Duration::ZERO if waits => self.mains.wait(),
            timer => timer,
        };
        left.as_millis().div_ceil(1000) as u64
    }

    /// Looks at the plant and judges it.
    fn look(&mut self, dt: Duration) {
        self.readings = Readings::of(&self.plant, self.pumping.as_secs_f64());
        self.loss_of_mains.step(dt.as_secs_f64(), &mut self.readings, self.plant.is_jolting());
        self.mains.step(dt, &self.plant.mains, self.readings.mains_in_order);
        self.peak.step(dt, &self.readings, &self.settings);
        let situation = Situation {
            running: self.readings.running,
            protected: self.sequence.operation().is_up_to_speed(),
            parallel: self.readings.side_by_side,
            in_company: self.plant.sisters.shares(),
            exporting: matches!(self.sequence.operation(), Exporting | TransferToMains),
            lenient: self.contacts.protections_disabled,
        };
        let breakers = Breakers {
            controls: &self.controls,
            genset_closed: self.plant.genset_breaker.closed,
            mains_closed: self.plant.mains_breaker.closed,
        };
        self.alarms.step(dt, &self.readings, situation, &breakers, self.sequence.failures);
        if self.alarms.loses_mains() && situation.parallel {
            self.mains.lose();
        }
        if self.alarms.is_new() {
            self.menu.show_alarms();
        }
    }

    /// Moves the sequence on and sets the outputs.
    fn act(&mut self, dt: Duration) {
        if let Some(trip) = self.alarms.trip() {
            self.sequence.trip(trip);
            self.forget_wishes();
        }
        let (demand, sensed) = (self.demand(), self.sensed());
        self.sequence.step(dt, demand, sensed);
        self.regulation.step(dt, self.sequence.operation(), &self.settings, &mut self.plant);
        self.keep_ready(dt);
        self.controls = Controls {
            block_heater: self.block_heater,
            fuel_pump: self.fuel_pump,
            ..self.sequence.controls(demand, sensed)
        };
    }

    /// What was asked for by hand is not done later by itself, when the alarm that forbade it has been reset.
    fn forget_wishes(&mut self) {
        self.run_wanted = false;
        if self.source != Source::Nothing {
            self.source = Source::Mains;
        }
    }

    /// Switches the heater, the pump and the consumers, each with its hysteresis.
    fn keep_ready(&mut self, dt: Duration) {
        let coolant = self.plant.engine.coolant;
        self.block_heater =
            !self.plant.engine.firing && (coolant < 38.0 || self.block_heater && coolant < 42.0);
        let (on, off) = self.settings.fuel_pump;
        let level = self.readings.fuel_level;
        self.fuel_pump = level.is_some_and(|level| level < on || self.fuel_pump && level < off);
        self.pumping = if self.fuel_pump { self.pumping + dt } else { Duration::ZERO };
        let (add, shed) = self.settings.load_shedding;
        let load = self.readings.genset_active;
        self.shedding = load > shed || self.shedding && load > add;
    }

    fn restart(&mut self) {
        self.restarting = RESTART;
        self.sequence.restart();
        self.sequence.acknowledge();
        self.alarms.restart();
        self.channel = 0;
        self.menu = Menu::default();
        self.run_wanted = false;
        self.source = Source::Mains;
        self.ethernet_resets = self.ethernet_resets.wrapping_add(1);
    }
}

impl Panel for DatakomD {
    fn step(&mut self, dt: Duration) {
        let seconds = dt.as_secs_f64();
        self.scene = if self.story { Scene::at(self.plant.time) } else { Scene::NOTHING };
        self.plant.tank.other_draw = self.scene.fuel_draw;
        self.distortion.step(seconds, &mut self.random);
        self.gps.step(seconds);
        if self.is_silent() {
            self.restarting = self.restarting.saturating_sub(dt);
            self.controls =
                Controls { mains_breaker: !self.plant.genset_breaker.closed, ..Controls::default() };
            self.plant.step(seconds, &self.controls);
            return;
        }
        // The plant first: the status then tells of breakers that have moved, in the same image.
        self.plant.step(seconds, &self.controls);
        self.sequence.failures.to_synchronize |= self.plant.is_jolting();
        self.look(dt);
        self.act(dt);
    }

    fn write(&mut self, address: u16, value: u16) {
        match (address, value) {
            (PUSH_BUTTONS, keys) => self.press(keys),
            (CHANNEL_SELECT, 0..=LAST_CHANNEL) => self.channel = value,
            (HARD_RESET, RESET_WORD) => self.restart(),
            _ => {}
        }
    }

    fn is_silent(&self) -> bool {
        !self.restarting.is_zero()
    }

    fn render(&self, bank: &mut Bank) {
        render::registers(self, bank);
    }

    fn count_packet(&mut self, bank: &mut Bank) {
        self.packets = self.packets.wrapping_add(1);
        render::packets(self, bank);
    }

    fn refusals(&self) -> Refusals {
        Refusals {
            quantity: ExceptionCode::ILLEGAL_DATA_ADDRESS,
            // Decimal 10: the manual's own meaning, write protection.
            protected: ExceptionCode(10),
        }
    }

    fn configure(&mut self, settings: &crate::settings::Settings) {
        self.settings = Settings::of(settings);
        self.mains.configure(&self.settings.mains);
        self.sequence.configure(&self.settings);
        self.alarms.configure(settings);
    }

    fn levers(&self) -> &'static [Lever] {
        contacts::LEVERS
    }

    fn lever(&self, id: &str) -> Option<Position> {
        self.contacts.lever(id).or_else(|| self.plant.lever(id))
    }

    fn pull(&mut self, id: &str, to: Position) {
        if !self.contacts.pull(id, to) {
            self.plant.pull(id, to);
        }
    }

    fn genset(&mut self) -> Option<&mut Plant> {
        Some(&mut self.plant)
    }

    fn inject(&mut self, point: &str, bit: u16, active: bool) -> bool {
        let class = match point {
            "shutdown_alarms" => Class::Shutdown,
            "load_dump_alarms" => Class::LoadDump,
            "warning_alarms" => Class::Warning,
            _ => return false,
        };
        self.alarms.inject(class, bit, active);
        true
    }
}
