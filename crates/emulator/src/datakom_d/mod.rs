//! Datakom D-300, D-500 and D-700: keys, modes and the situation the unit is in.
//!
//! Power-on finds the unit in AUTO with healthy mains that carry the load. Where the manual is silent this is what
//! the imitation does:
//! - one word may press several keys: STOP wins, the others act in the order of their bits; the press length (bits
//!   14 and 15) and the menu keys change nothing yet;
//! - TEST runs the genset on load; RUN (MANUAL with RUN on a D-700) runs it off load;
//! - the rows of bits 1 and 4 and of mode 2 leave the D-300 out: its front has neither MANUAL nor RUN;
//! - a breaker key works in mode 2 and moves its own breaker: a closed one opens, for an open one the other opens
//!   first. The genset's is dead until the engine is up to speed;
//! - STOP cools a running engine down first; STOP again stops it at once;
//! - a service is due when its hours or its days are used up, and then a warning without a horn;
//! - a channel above 19 is acknowledged and ignored;
//! - the hard reset drops every output but the mains breaker and keeps mode and counters.

mod alarms;
mod render;
mod sequence;
mod story;

use std::time::Duration;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::{self, Controls, Plant, Tank};
use crate::random::Random;
use crate::rules::Refusals;
use crate::waveform::Distortion;

use busbar_modbus::ExceptionCode;

use alarms::Alarms;
use sequence::{Demand, Sensed, Sequence, Source};
use story::Scene;

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
    sequence: Sequence,
    alarms: Alarms,
    distortion: Distortion,
    random: Random,
    identity: Identity,
    mode: Mode,
    /// RUN was pressed: the engine is wanted in the manual mode.
    run_wanted: bool,
    /// What the breaker keys chose in the manual mode.
    source: Source,
    controls: Controls,
    block_heater: bool,
    fuel_pump: bool,
    channel: u16,
    story: bool,
    scene: Scene,
    restarting: Duration,
    ethernet_resets: u16,
    packets: u16,
    /// Days that had passed when the unit was switched on.
    days_before: f64,
    hours_at_service: f64,
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

/// Which keys the front has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Front {
    /// RUN is one key: the mode and the start.
    Run,
    /// MANUAL selects the mode and RUN starts, as on a D-700.
    ManualAndRun,
    /// None that the manual gives to this model, as on a D-300.
    Neither,
}

impl Front {
    fn of(model: &str) -> Self {
        match model {
            "D-300" => Self::Neither,
            "D-700" => Self::ManualAndRun,
            _ => Self::Run,
        }
    }
}

/// What makes this unit this unit.
#[derive(Clone, Debug)]
struct Identity {
    /// Register 10609.
    code: u16,
    model: String,
    front: Front,
    mac: [u8; 6],
    unique: [u8; 12],
    imei: [u8; 16],
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
        let mut unit = Self {
            sequence: Sequence::new((hours / 3.1) as u32),
            alarms: Alarms::default(),
            distortion: Distortion::new(&mut random),
            identity: Identity::new(model, code, &mut random),
            mode: Mode::Auto,
            run_wanted: false,
            source: Source::Mains,
            controls: Controls { mains_breaker: true, ..Controls::default() },
            block_heater: false,
            fuel_pump: false,
            channel: 0,
            story,
            scene: Scene::NOTHING,
            restarting: Duration::ZERO,
            ethernet_resets: random.between(1.0, 9.0) as u16,
            packets: 0,
            days_before: random.between(20.0, 90.0),
            hours_at_service: hours - random.between(20.0, 110.0),
            plant,
            random,
        };
        unit.alarms.step(Duration::ZERO, &unit.plant, false);
        unit
    }

    fn demand(&self) -> Demand {
        match self.mode {
            Mode::Run => Demand { engine: self.run_wanted, source: self.source },
            Mode::Test => Demand::ON_LOAD,
            Mode::Auto if self.scene.exerciser => Demand::ON_LOAD,
            Mode::Auto | Mode::Stop => Demand::REST,
        }
    }

    fn press(&mut self, keys: u16) {
        let pressed = |bit: u16| keys >> bit & 1 == 1;
        if pressed(0) {
            return self.press_stop();
        }
        for key in (1..=6).filter(|key| pressed(*key)) {
            match (key, self.identity.front) {
                (1, Front::Run) | (4, Front::ManualAndRun) => {
                    self.enter(Mode::Run);
                    self.run_wanted = true;
                }
                (1, Front::ManualAndRun) => {
                    // The mode changes, a running engine goes on running.
                    let running = self.plant.engine.is_running();
                    self.enter(Mode::Run);
                    self.run_wanted |= running;
                }
                (2, _) => self.enter(Mode::Auto),
                (3, _) => self.enter(Mode::Test),
                (5, _) => {
                    let ready = self.sequence.is_up_to_speed() && self.plant.genset_healthy();
                    self.press_breaker(Source::Genset, ready);
                }
                (6, _) => self.press_breaker(Source::Mains, self.plant.mains_healthy()),
                _ => {}
            }
        }
    }

    fn press_stop(&mut self) {
        if self.mode == Mode::Stop {
            self.sequence.stop_now();
        }
        self.enter(Mode::Stop);
        self.sequence.acknowledge();
    }

    fn press_breaker(&mut self, own: Source, ready: bool) {
        if self.mode != Mode::Run {
            return;
        }
        if self.source == own {
            self.source = Source::Nothing;
        } else if ready {
            self.source = own;
        }
    }

    fn enter(&mut self, mode: Mode) {
        if mode != self.mode {
            self.mode = mode;
            self.run_wanted = false;
            self.source = Source::Mains;
        }
    }

    fn restart(&mut self) {
        self.restarting = RESTART;
        self.sequence.restart();
        self.alarms = Alarms::default();
        self.channel = 0;
        self.run_wanted = false;
        self.source = Source::Mains;
        self.ethernet_resets = self.ethernet_resets.wrapping_add(1);
    }

    /// Switches the heater and the pump, each with its hysteresis.
    fn keep_ready(&mut self) {
        let coolant = self.plant.engine.coolant;
        self.block_heater =
            !self.plant.engine.firing && (coolant < 38.0 || self.block_heater && coolant < 42.0);
        let level = self.plant.tank.percent();
        self.fuel_pump = level < 19.0 || self.fuel_pump && level < 25.0;
    }
}

impl Panel for DatakomD {
    fn step(&mut self, dt: Duration) {
        let seconds = dt.as_secs_f64();
        self.scene = if self.story { Scene::at(self.plant.time) } else { Scene::NOTHING };
        self.plant.tank.other_draw = self.scene.fuel_draw;
        self.distortion.step(seconds, &mut self.random);
        if self.is_silent() {
            self.restarting = self.restarting.saturating_sub(dt);
            self.controls =
                Controls { mains_breaker: !self.plant.genset_breaker.closed, ..Controls::default() };
            self.plant.step(seconds, &self.controls);
            return;
        }
        // The plant first: the status then tells of breakers that have moved, in the same image.
        self.plant.step(seconds, &self.controls);
        let (demand, sensed) = (self.demand(), Sensed::from(&self.plant));
        self.sequence.step(dt, demand, sensed);
        self.keep_ready();
        self.controls = Controls {
            block_heater: self.block_heater,
            fuel_pump: self.fuel_pump,
            ..self.sequence.controls(demand, sensed)
        };
        self.alarms.step(dt, &self.plant, self.sequence.failed_to_start());
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

    fn levers(&self) -> &'static [Lever] {
        plant::LEVERS
    }

    fn lever(&self, id: &str) -> Option<Position> {
        self.plant.lever(id)
    }

    fn pull(&mut self, id: &str, to: Position) {
        self.plant.pull(id, to);
    }
}

impl Identity {
    fn new(model: &str, code: u16, random: &mut Random) -> Self {
        let mut bytes = [0; 18];
        for (byte, word) in bytes.iter_mut().zip(std::iter::repeat_with(|| random.bits())) {
            *byte = word as u8;
        }
        let (mut mac, mut unique) = ([0; 6], [0; 12]);
        mac.copy_from_slice(&bytes[..6]);
        unique.copy_from_slice(&bytes[6..]);
        // Locally administered, so that it is no maker's address.
        mac[0] = 0x02;
        Self {
            code,
            model: model.to_owned(),
            front: Front::of(model),
            mac,
            unique,
            imei: imei(random.bits()),
        }
    }
}

/// 15 digits under the test prefix 001010 with their Luhn digit, in ASCII, then a zero byte.
fn imei(mut serial: u64) -> [u8; 16] {
    let mut digits = [0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    for digit in &mut digits[6..14] {
        *digit = (serial % 10) as u8;
        serial /= 10;
    }
    let sum: u8 = digits[..14]
        .iter()
        .enumerate()
        .map(|(position, digit)| match digit << (position % 2) {
            doubled @ 10.. => doubled - 9,
            kept => kept,
        })
        .sum();
    digits[14] = (10 - sum % 10) % 10;
    let mut text = [0; 16];
    for (letter, digit) in text.iter_mut().zip(digits) {
        *letter = b'0' + digit;
    }
    text
}
