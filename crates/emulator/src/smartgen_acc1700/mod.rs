//! SmartGen ACC1700 and ACC1700CAN: keys, lock and the situation the unit is in.
//!
//! Power-on finds the unit in stop mode, at rest, unlocked. Where the manual is silent this is what the imitation does:
//! - the start key is taken in standby only, and turns stop mode into manual mode; it never loads: the unit waits for
//!   the load key, so that the documented procedure is needed;
//! - the load key turns over between waiting (8) and normal running (9) and is dead in every other status. The load
//!   indicator (43.6) is that choice; the load valve (43.5) then follows the discharge pressure between two limits, while
//!   status and indicator stay. Idle running (43.8) is status 8;
//! - the stop key is always taken. A loaded unit goes to cooling with 43.7 set, and the cooling delay stands still until
//!   the pressure has fallen; status 8 does the same. A second press does not hurry it. It also acknowledges shutdowns;
//! - a shutdown closes the fuel at once, and no start is taken until it is acknowledged;
//! - locked means that the start and load keys are dead; stop and the remote outputs are not, and a running unit goes on;
//! - the down key turns a page of the display, which no register shows;
//! - remote outputs 1 to 4 are auxiliary outputs 1 to 4 (37.2 to 37.5), as the unit may be set up;
//! - inputs: 1 low coolant and 2 high temperature stop the engine, 3 is the fuel float and warns, 4 is free, 5 is the door
//!   contact and indicates;
//! - sensors: 3 fuel level, 4 discharge temperature, 5 discharge pressure at 4 to 20 mA. Of an ACC1700CAN the ECU sends
//!   engine temperature and oil pressure, sensor 1 is not fitted and 2 is the pressure lost across the oil separator. An
//!   ACC1700 has 1 and 2 for temperature and oil pressure, and none of what only an ECU knows;
//! - no ECU here measures the coolant's pressure;
//! - the particle filter asks (44.1) when it is full, burns (44.3, 44.7) as soon as the exhaust is hot, wants a person (20.3,
//!   44.5) when it never is, and fails (44.0) in the end. Manual heating (0.14), inhibition (44.2), response (44.4) and engine
//!   fault (44.9) never show yet;
//! - maintenance 1 to 8 warn when their time is over, 9 and 10 indicate, none stops the engine;
//! - events are starts, stops and new alarms; their number ends at 99.

mod alarms;
mod render;
mod sequence;
mod story;

use std::time::Duration;

use busbar_modbus::ExceptionCode;

use crate::bank::Bank;
use crate::panel::Panel;
use crate::plant::{Compressor, Tank};
use crate::random::Random;
use crate::rules::Refusals;

use alarms::{Alarms, Inputs, View};
use sequence::{Sensed, Sequence, Status};
use story::Scene;

const START: u16 = 0;
const STOP: u16 = 1;
const LOAD_UNLOAD: u16 = 3;
const UNLOCK: u16 = 18;
const LOCK: u16 = 19;
const FIRST_OUTPUT: u16 = 20;

/// Hours between two services of maintenance 1 to 10, as their names suggest.
const SERVICES: [u64; 10] = [500, 500, 1000, 2000, 250, 500, 250, 500, 2000, 4000];
/// The event log has no more room (register 120).
const MOST_EVENTS: u16 = 99;

/// The models of the manual's title.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// Without an engine that talks.
    Acc1700,
    /// With an ECU on J1939.
    Acc1700Can,
}

impl Model {
    /// The model of this name; the one with an ECU where it is not the plain one.
    pub(crate) fn of(name: &str) -> Self {
        if name == "ACC1700" { Self::Acc1700 } else { Self::Acc1700Can }
    }
}

/// Bits 0.10 and 0.11.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Manual,
    Stop,
}

/// The unit and its plant.
#[derive(Clone, Debug)]
pub(crate) struct Acc1700 {
    plant: Compressor,
    sequence: Sequence,
    alarms: Alarms,
    inputs: Inputs,
    model: Model,
    mode: Mode,
    locked: bool,
    outputs: [bool; 4],
    story: bool,
    scene: Scene,
    events: u16,
    /// Total running time in seconds when the latest run began.
    run_began: u64,
    /// Total running time in seconds at which each service is due.
    services_due: [u64; 10],
}

impl Acc1700 {
    /// A unit with its plant at rest.
    pub(crate) fn new(model: Model, seed: u64, story: bool) -> Self {
        let mut random = Random::new(seed ^ 0xACC);
        let mut plant = Compressor::new(seed);
        if story {
            // Low enough that the story reaches the warning.
            plant.tank = Tank::new(22.3);
        }
        let seconds = (plant.engine.hours * 3600.0) as u64;
        let left =
            |hours: u64, random: &mut Random| (hours as f64 * 3600.0 * random.between(0.2, 0.9)) as u64;
        let mut unit = Self {
            sequence: Sequence::new((plant.engine.hours / 1.7) as u16),
            alarms: Alarms::new(),
            inputs: Inputs::default(),
            model,
            mode: Mode::Stop,
            locked: false,
            outputs: [false; 4],
            story,
            scene: Scene::NOTHING,
            events: random.between(12.0, 40.0) as u16,
            run_began: seconds - random.between(1200.0, 9000.0) as u64,
            services_due: SERVICES.map(|hours| seconds + left(hours, &mut random)),
            plant,
        };
        unit.inputs.step(&unit.plant, false);
        unit
    }

    fn press_start(&mut self) {
        if self.locked || self.alarms.any_shutdown() {
            return;
        }
        if self.sequence.start() {
            self.mode = Mode::Manual;
            self.note(1);
        }
    }

    fn press_stop(&mut self) {
        self.mode = Mode::Stop;
        self.sequence.stop();
        self.sequence.acknowledge();
        self.alarms.acknowledge();
    }

    fn press_load(&mut self) {
        if !self.locked {
            self.sequence.toggle_load(self.plant.air.pressure);
        }
    }

    /// Presses the keys that the people of the story press.
    fn follow(&mut self, scene: Scene) {
        let before = std::mem::replace(&mut self.scene, scene);
        if scene.engine && !before.engine {
            self.press_start();
        }
        // The hand on the key looks at the indicator first.
        if scene.air && !before.air && !self.sequence.is_loaded() {
            self.press_load();
        }
        if !scene.engine && before.engine {
            self.press_stop();
        }
    }

    fn note(&mut self, events: usize) {
        let events = u16::try_from(events).unwrap_or(MOST_EVENTS);
        self.events = self.events.saturating_add(events).min(MOST_EVENTS);
    }

    /// Seconds that the engine has run in its life.
    fn running_seconds(&self) -> u64 {
        (self.plant.engine.hours * 3600.0) as u64
    }
}

impl Panel for Acc1700 {
    fn step(&mut self, dt: Duration) {
        if self.story {
            self.follow(Scene::at(self.plant.time));
        }
        self.plant.tank.other_draw = self.scene.fuel_draw;
        self.plant.refilling = self.scene.refills(self.plant.tank.percent());
        // The plant first: the status then tells of an engine that has fired, in the same image.
        self.plant.step(dt.as_secs_f64(), &self.sequence.orders());

        let (status, starts) = (self.sequence.status(), self.sequence.starts);
        self.sequence.step(dt, Sensed::from(&self.plant));
        if self.sequence.starts != starts {
            self.run_began = self.running_seconds();
        }

        self.inputs.step(&self.plant, self.scene.attendant);
        let alarms = self.alarms.count();
        let view = View { plant: &self.plant, sequence: &self.sequence, inputs: self.inputs };
        self.alarms.step(dt, &view);
        self.note(self.alarms.count().saturating_sub(alarms));
        if self.alarms.any_shutdown() {
            self.sequence.trip();
        }
        if status != Status::Standby && self.sequence.status() == Status::Standby {
            self.note(1);
        }
    }

    /// No register can be written.
    fn write(&mut self, _address: u16, _value: u16) {}

    fn write_coil(&mut self, address: u16, on: bool) {
        if let Some(output) =
            address.checked_sub(FIRST_OUTPUT).and_then(|output| self.outputs.get_mut(usize::from(output)))
        {
            *output = on;
            return;
        }
        // A key is pressed, never released.
        if !on {
            return;
        }
        match address {
            START => self.press_start(),
            STOP => self.press_stop(),
            LOAD_UNLOAD => self.press_load(),
            LOCK => self.locked = true,
            UNLOCK => self.locked = false,
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
            protected: ExceptionCode::ILLEGAL_DATA_ADDRESS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn pass(unit: &mut Acc1700, seconds: u32) {
        for _ in 0..10 * seconds {
            unit.step(TENTH);
        }
    }

    fn loaded() -> Acc1700 {
        let mut unit = Acc1700::new(Model::Acc1700Can, 1, false);
        unit.write_coil(START, true);
        pass(&mut unit, 45);
        unit.write_coil(LOAD_UNLOAD, true);
        pass(&mut unit, 5);
        assert_eq!(unit.sequence.status(), Status::NormalRunning);
        unit
    }

    #[test]
    fn an_empty_tank_trips_the_engine_and_then_fails_every_start_until_it_is_filled() {
        let mut unit = loaded();
        unit.plant.tank.litres = 0.0;
        pass(&mut unit, 60);
        assert_eq!((unit.sequence.status(), unit.mode), (Status::Standby, Mode::Manual));
        assert!(unit.alarms.any_shutdown());
        unit.write_coil(START, true);
        assert_eq!(unit.sequence.status(), Status::Standby, "a shutdown stands");

        unit.write_coil(STOP, true);
        assert!(!unit.alarms.any_shutdown());
        unit.write_coil(START, true);
        pass(&mut unit, 120);
        assert_eq!(unit.sequence.status(), Status::Standby);
        assert!(unit.sequence.failed_to_start() && unit.alarms.any_shutdown());

        unit.plant.tank = Tank::new(50.0);
        unit.write_coil(STOP, true);
        unit.write_coil(START, true);
        pass(&mut unit, 45);
        assert_eq!(unit.sequence.status(), Status::WaitToOnload);
        assert!(!unit.alarms.any_shutdown());
    }

    #[test]
    fn a_shutdown_stops_a_loaded_engine_without_cooling() {
        let mut unit = loaded();
        unit.plant.engine.coolant = 110.0;
        let mut seen = vec![Status::NormalRunning];
        for _ in 0..400 {
            unit.plant.engine.coolant = 110.0;
            unit.step(TENTH);
            if seen.last() != Some(&unit.sequence.status()) {
                seen.push(unit.sequence.status());
            }
        }
        use Status::*;
        assert_eq!(seen, [NormalRunning, EnergiseToStop, WaitForStop, AfterStop, Standby]);
    }

    #[test]
    fn the_event_log_ends_at_99() {
        let mut unit = Acc1700::new(Model::Acc1700, 1, false);
        for _ in 0..100 {
            unit.note(3);
        }
        assert_eq!(unit.events, 99);
    }
}
