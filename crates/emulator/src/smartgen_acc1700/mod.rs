//! SmartGen ACC1700 and ACC1700CAN: keys, lock and the situation the unit is in.
//!
//! From the inside out: [`readings`] are what it measures, [`causes`] and [`alarms`] what it finds wrong, [`sequence`] and
//! [`load`] what it does. What it does where the manual is silent stands in `docs/imitation/smartgen-acc1700.md`.

mod alarms;
mod causes;
mod ecu;
mod inputs;
mod levers;
mod load;
#[cfg(test)]
mod page;
mod readings;
mod render;
mod sequence;
mod services;
mod setup;
mod story;

use std::time::Duration;

use busbar_modbus::ExceptionCode;
use busbar_profile::Profile;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::{Compressor, Orders, Tank};
use crate::random::Random;
use crate::rules::Refusals;
use crate::settings::Settings;

use alarms::Alarms;
use causes::View;
use ecu::Ecu;
use inputs::{Hands, Inputs};
use load::{Demand, LoadValve};
use readings::Readings;
use sequence::{Cause, Sensed, Sequence, Status};
use services::Services;
use setup::Setup;
use story::Scene;

#[cfg(test)]
const PROFILE: &str = "smartgen-acc1700";

const START: u16 = 0;
const STOP: u16 = 1;
const LOAD_UNLOAD: u16 = 3;
const UNLOCK: u16 = 18;
const LOCK: u16 = 19;
const FIRST_OUTPUT: u16 = 20;

/// The event log has no more room (register 120).
const MOST_EVENTS: u16 = 99;

/// kPa of oil pressure above which an engine is taken for one that still turns.
const TURNING_OIL: f64 = 50.0;

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
    profile: &'static Profile,
    plant: Compressor,
    setup: Setup,
    readings: Readings,
    inputs: Inputs,
    ecu: Option<Ecu>,
    sequence: Sequence,
    valve: LoadValve,
    alarms: Alarms,
    services: Services,
    model: Model,
    mode: Mode,
    locked: bool,
    outputs: [bool; 4],
    story: bool,
    scene: Scene,
    /// The switch at input 4.
    switch_closed: bool,
    /// How much longer somebody's heating goes on.
    heating_left: Duration,
    events: u16,
    /// Total running time in seconds when the latest run began.
    run_began: u64,
}

impl Acc1700 {
    /// A unit with its plant at rest.
    pub(crate) fn new(profile: &'static Profile, model: Model, seed: u64, story: bool) -> Self {
        let mut random = Random::new(seed ^ 0xACC);
        let mut plant = Compressor::new(seed);
        if story {
            // Low enough that the story reaches the warning.
            plant.tank = Tank::new(22.3);
        }
        let setup = Setup::of(&Settings::of(profile));
        let seconds = (plant.engine.hours * 3600.0) as u64;
        let mut unit = Self {
            profile,
            readings: Readings::of(&plant, model, true),
            inputs: Inputs::default(),
            ecu: (model == Model::Acc1700Can).then(Ecu::new),
            sequence: Sequence::new((plant.engine.hours / 1.7) as u16),
            valve: LoadValve::default(),
            alarms: Alarms::new(),
            model,
            mode: Mode::Stop,
            locked: false,
            outputs: [false; 4],
            story,
            scene: Scene::NOTHING,
            switch_closed: false,
            heating_left: Duration::ZERO,
            events: random.between(12.0, 40.0) as u16,
            run_began: seconds - random.between(1200.0, 9000.0) as u64,
            services: Services::new(seconds, &setup, &mut random),
            setup,
            plant,
        };
        unit.measure(Duration::ZERO);
        unit
    }

    fn press_start(&mut self) {
        if self.locked || self.alarms.any_shutdown() {
            return;
        }
        if self.sequence.react(Cause::StartKey, &self.setup) {
            self.mode = Mode::Manual;
            self.heating_left = Duration::ZERO;
            self.note(1);
        }
    }

    fn press_stop(&mut self) {
        self.mode = Mode::Stop;
        self.heating_left = Duration::ZERO;
        self.sequence.react(Cause::StopKey, &self.setup);
        self.valve.follow(self.demand(), &self.setup);
        self.sequence.acknowledge();
        self.judge(Alarms::acknowledge);
    }

    fn press_load(&mut self) {
        if !self.locked && self.sequence.react(Cause::LoadKey, &self.setup) {
            self.valve.load(self.demand(), &self.setup);
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

    /// Reads contacts, sensors and the ECU.
    fn measure(&mut self, dt: Duration) {
        let watched = self.sequence.status().is_watched();
        if let Some(ecu) = &mut self.ecu {
            ecu.step(&self.plant, watched);
        }
        self.readings = Readings::of(&self.plant, self.model, self.ecu.as_ref().is_some_and(Ecu::talks));
        let hands = Hands {
            emergency_stop: self.plant.emergency_stop,
            switch_closed: self.switch_closed,
            door_open: self.plant.door_open || self.scene.attendant,
        };
        self.inputs.step(dt, &self.plant, hands, &self.setup);
    }

    fn sensed(&self) -> Sensed {
        let (readings, setup) = (&self.readings, &self.setup);
        Sensed {
            running: readings.turns(setup.disconnect_speed, setup.disconnect_oil_pressure),
            turning: readings.turns(0.0, TURNING_OIL),
            pressure: readings.discharge_pressure.value(),
        }
    }

    fn demand(&self) -> Demand {
        Demand {
            loaded: self.sequence.is_loaded(),
            pressure: self.readings.discharge_pressure.value(),
            engine_load: self.readings.engine_load.value(),
        }
    }

    /// Lets the alarms see everything else.
    fn judge<T>(&mut self, act: impl FnOnce(&mut Alarms, &View<'_>) -> T) -> T {
        let view = View {
            sequence: &self.sequence,
            readings: &self.readings,
            inputs: &self.inputs,
            ecu: self.ecu.as_ref(),
            services_due: self.services.left(self.running_seconds()).map(|left| left == 0),
            setup: &self.setup,
        };
        act(&mut self.alarms, &view)
    }

    /// Somebody has switched manual heating on (0.14).
    fn is_heating(&self) -> bool {
        !self.heating_left.is_zero()
    }

    fn orders(&self) -> Orders {
        Orders { load_valve: self.valve.is_open(), heater: self.is_heating(), ..self.sequence.orders() }
    }

    fn note(&mut self, events: u32) {
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
        self.plant.step(dt.as_secs_f64(), &self.orders());
        self.measure(dt);
        self.heating_left = self.heating_left.saturating_sub(dt);

        let (status, starts) = (self.sequence.status(), self.sequence.starts);
        self.sequence.step(dt, self.sensed(), &self.setup);
        if self.sequence.starts != starts {
            self.run_began = self.running_seconds();
        }

        let new = self.judge(|alarms, view| alarms.step(dt, view));
        self.note(new);
        if self.alarms.any_shutdown() {
            self.sequence.react(Cause::Shutdown, &self.setup);
            self.heating_left = Duration::ZERO;
        }
        self.valve.step(dt, self.demand(), &self.setup);
        if !self.sequence.status().is_running() {
            // What stands is not protected.
            self.valve = LoadValve::default();
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

    fn configure(&mut self, settings: &Settings) {
        self.setup = Setup::of(settings);
        self.services.configure(self.running_seconds(), &self.setup);
    }

    fn levers(&self) -> &'static [Lever] {
        &levers::LEVERS
    }

    fn lever(&self, id: &str) -> Option<Position> {
        levers::lever(self, id)
    }

    fn pull(&mut self, id: &str, to: Position) {
        levers::pull(self, id, to);
    }

    fn inject(&mut self, point: &str, bit: u16, active: bool) -> bool {
        let point = self.profile.point(point);
        point.is_some_and(|point| self.alarms.inject(point.address, bit, active))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn unit(model: Model) -> Acc1700 {
        Acc1700::new(busbar_profile::builtin(PROFILE).unwrap(), model, 1, false)
    }

    fn pass(unit: &mut Acc1700, seconds: u32) {
        for _ in 0..10 * seconds {
            unit.step(TENTH);
        }
    }

    fn loaded() -> Acc1700 {
        let mut unit = unit(Model::Acc1700Can);
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
        let mut unit = unit(Model::Acc1700);
        for _ in 0..100 {
            unit.note(3);
        }
        assert_eq!(unit.events, 99);
    }
}
