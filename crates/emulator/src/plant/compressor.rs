//! A diesel compressor: the engine turns a screw that fills a receiver, and a site that draws air from it.
//!
//! The same seed, steps and orders give the same plant to the last bit.

use crate::random::{Drift, Random, approach};

use super::air::{Air, Valves};
use super::climate::Climate;
use super::engine::Inputs;
use super::exhaust::{Exhaust, Gas, ParticleFilter};
use super::senders::Senders;
use super::supplies::Service;
use super::{Battery, Engine, RATED_KW, RATED_RPM, Readings, Tank};

/// degC at which the coolant heater's thermostat opens.
const HEATED: f64 = 60.0;

/// What a panel can do to the compressor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Orders {
    /// Fuel solenoid open.
    pub(crate) fuel: bool,
    /// Starter motor engaged.
    pub(crate) starter: bool,
    /// Governor at idle speed.
    pub(crate) idle: bool,
    /// The screw's intake is open.
    pub(crate) load_valve: bool,
    /// The receiver is vented.
    pub(crate) blow_down: bool,
    /// Coolant heater on.
    pub(crate) heater: bool,
}

/// What the senders behind the screw tell; nothing from a broken one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Discharge {
    /// kPa above the atmosphere.
    pub(crate) pressure: Option<f64>,
    /// degC.
    pub(crate) temperature: Option<f64>,
    /// Its wires touch, hence nothing.
    pub(crate) temperature_shorted: bool,
    /// kPa lost across the oil separator.
    pub(crate) separator_loss: Option<f64>,
}

/// Which of them are broken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DischargeSenders {
    pub(super) pressure: bool,
    pub(super) temperature: Wires,
    pub(super) separator: bool,
}

/// The wires of a sender.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Wires {
    #[default]
    Whole,
    Broken,
    Shorted,
}

/// The whole of it; a panel reads the fields and hands back [`Orders`].
#[derive(Clone, Debug)]
pub(crate) struct Compressor {
    /// Seconds since power-on.
    pub(crate) time: f64,
    pub(crate) engine: Engine,
    pub(crate) air: Air,
    pub(crate) exhaust: Exhaust,
    pub(crate) filter: ParticleFilter,
    pub(crate) battery: Battery,
    pub(crate) tank: Tank,
    /// Somebody pumps fuel into the tank.
    pub(crate) refilling: bool,
    /// degC.
    pub(crate) ambient: f64,
    /// degC of the air that the engine breathes.
    pub(crate) intake: f64,
    /// degC of the fuel at the injection pump.
    pub(crate) fuel_temperature: f64,
    /// kPa before the injection pump.
    pub(crate) fuel_pressure: f64,
    /// The button on the canopy is pressed: without the panel's help neither fuel nor starter has a supply.
    pub(crate) emergency_stop: bool,
    /// The door of the canopy is open.
    pub(crate) door_open: bool,
    /// The engine's own controller says nothing.
    pub(crate) ecu_silent: bool,
    pub(super) senders: Senders,
    pub(super) discharge_senders: DischargeSenders,
    pub(super) climate: Climate,
    lift_pump: Drift,
    random: Random,
}

impl Compressor {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let climate = Climate::new(&mut random);
        Self {
            time: 0.0,
            engine: Engine::new(&mut random),
            air: Air::new(&mut random),
            exhaust: Exhaust::new(30.0),
            filter: ParticleFilter::new(random.between(30.0, 60.0)),
            battery: Battery::new(&mut random),
            tank: Tank::new(random.between(70.0, 85.0)),
            refilling: false,
            ambient: climate.outside(),
            intake: climate.outside() + 2.0,
            fuel_temperature: climate.outside() + 3.0,
            fuel_pressure: 0.0,
            emergency_stop: false,
            door_open: false,
            ecu_silent: false,
            senders: Senders::default(),
            discharge_senders: DischargeSenders::default(),
            climate,
            lift_pump: Drift::new(4.0, 3.0, &mut random),
            random,
        }
    }

    /// Lets `dt` seconds pass; meant for steps of about a tenth of a second.
    pub(crate) fn step(&mut self, dt: f64, orders: &Orders) {
        self.time += dt;
        let powered = !self.emergency_stop;
        let (fuel, starter) = (orders.fuel && powered, orders.starter && powered);
        let inputs = Inputs {
            fuel,
            fed: self.tank.feeds(),
            starter: starter.then(|| self.battery.strength()),
            idle: orders.idle,
            heater: orders.heater && self.engine.coolant < HEATED,
            load: self.shaft_power(),
            ambient: self.intake,
        };
        self.engine.step(dt, &inputs, &mut self.random);
        let speed = self.engine.speed / RATED_RPM;
        let valves = Valves { intake: orders.load_valve, blow_down: orders.blow_down };
        self.air.step(dt, speed, valves, self.ambient, &mut self.random);

        let running = self.engine.is_running();
        let (pull, starved) = (self.torque() / 100.0, self.air.wear.filter_clogged);
        self.exhaust.step(dt, Gas { running, pull, speed, starved, around: self.intake }, &self.filter);
        self.filter.step(dt, running, &self.exhaust);
        // A small charger on shore supply keeps the battery while the engine rests.
        self.battery.step(dt, Service { cranking: starter, running, supplied: true }, &mut self.random);
        self.tank.step(dt, self.engine.burn, self.refilling);
        self.climate(dt);

        let lift = 370.0 + 20.0 * speed + self.lift_pump.step(dt, &mut self.random);
        let lifted = fuel && self.tank.feeds();
        approach(&mut self.fuel_pressure, if lifted { lift } else { 0.0 }, 0.6, dt);
    }

    /// What the senders of the engine tell.
    pub(crate) fn readings(&self) -> Readings {
        self.senders.read(&self.engine, &self.tank)
    }

    /// What the senders behind the screw tell.
    pub(crate) fn discharge(&self) -> Discharge {
        let (air, broken) = (&self.air, self.discharge_senders);
        let unless = |broken: bool, value: f64| (!broken).then_some(value);
        Discharge {
            pressure: unless(broken.pressure, air.pressure),
            temperature: unless(broken.temperature != Wires::Whole, air.temperature),
            temperature_shorted: broken.temperature == Wires::Shorted,
            separator_loss: unless(broken.separator, air.separator_loss),
        }
    }

    /// kW that the screw asks of the engine.
    pub(crate) fn shaft_power(&self) -> f64 {
        self.air.shaft_power(self.engine.speed / RATED_RPM)
    }

    /// What the engine gives, in percent of its rated torque, its own friction included.
    pub(crate) fn torque(&self) -> f64 {
        if !self.engine.is_running() {
            return 0.0;
        }
        let rated = self.shaft_power() / RATED_KW * RATED_RPM / self.engine.speed;
        (6.0 + 94.0 * rated).min(125.0)
    }

    /// Percent of the torque that the engine has at this speed: a slow turbo gives less.
    pub(crate) fn load(&self) -> f64 {
        self.torque() / (0.7 + 0.3 * (self.engine.speed / RATED_RPM).min(1.0))
    }

    /// V at the battery and at the charge alternator's D+ terminal: chargers give less the warmer it is.
    pub(crate) fn voltages(&self) -> [f64; 2] {
        let less = 0.012 * (self.intake - 21.0);
        let charging = if self.engine.is_running() { less } else { 0.0 };
        [self.battery.voltage - less, self.battery.charge_input - charging]
    }

    /// Percent in the expansion tank, which hot coolant fills.
    pub(crate) fn coolant_level(&self) -> f64 {
        let full = 84.0 + 0.12 * (self.engine.coolant - 40.0);
        (full * self.engine.coolant_level).clamp(0.0, 100.0)
    }

    fn climate(&mut self, dt: f64) {
        self.ambient = self.climate.step(dt, self.time, &mut self.random);
        let warmer = 2.0 + 0.15 * (self.engine.coolant - self.ambient).max(0.0);
        approach(&mut self.intake, self.ambient + warmer, 180.0, dt);
        // What the injectors do not burn comes back warm.
        let returned = if self.engine.is_running() { 16.0 } else { 0.0 };
        approach(&mut self.fuel_temperature, self.intake + returned, 240.0, dt);
    }
}

#[cfg(test)]
mod tests {
    use super::super::COMPRESSOR_LEVERS;
    use super::*;

    const REST: Orders = Orders {
        fuel: false,
        starter: false,
        idle: false,
        load_valve: false,
        blow_down: false,
        heater: false,
    };
    const RUNNING: Orders = Orders { fuel: true, ..REST };
    const LOADED: Orders = Orders { load_valve: true, ..RUNNING };

    fn run(plant: &mut Compressor, orders: &Orders, seconds: f64) {
        for _ in 0..(seconds / 0.1) as u32 {
            plant.step(0.1, orders);
        }
    }

    fn started(seed: u64) -> Compressor {
        let mut plant = Compressor::new(seed);
        run(&mut plant, &Orders { starter: true, ..RUNNING }, 4.0);
        run(&mut plant, &RUNNING, 10.0);
        plant
    }

    #[test]
    fn a_loaded_engine_works_harder_burns_more_and_gets_hotter() {
        let mut plant = started(1);
        let (torque, burn, exhaust) = (plant.torque(), plant.engine.burn, plant.exhaust.temperature);
        assert_eq!(plant.air.pressure, 0.0);
        run(&mut plant, &LOADED, 40.0);
        assert!(plant.torque() > torque + 30.0, "{}", plant.torque());
        assert!(plant.load() <= 105.0, "{}", plant.load());
        assert!(plant.engine.burn > burn + 6.0);
        assert!(plant.exhaust.temperature > exhaust + 80.0);
        assert!(plant.exhaust.boost > 40.0);
    }

    #[test]
    fn burned_fuel_leaves_the_tank_and_an_empty_tank_stops_the_engine() {
        let mut plant = started(2);
        let (litres, burned) = (plant.tank.litres, plant.engine.burned);
        run(&mut plant, &RUNNING, 300.0);
        assert!((litres - plant.tank.litres - (plant.engine.burned - burned)).abs() < 1e-6);
        plant.tank.litres = 0.0;
        run(&mut plant, &RUNNING, 20.0);
        assert_eq!(plant.engine.speed, 0.0);
        assert!(plant.fuel_pressure < 1.0);
        run(&mut plant, &Orders { starter: true, ..RUNNING }, 10.0);
        assert!(!plant.engine.is_running());
    }

    #[test]
    fn the_same_seed_is_the_same_plant() {
        let walk = |seed| {
            let mut plant = started(seed);
            run(&mut plant, &LOADED, 60.0);
            (plant.air.pressure, plant.engine.coolant, plant.battery.voltage)
        };
        assert_eq!(walk(9), walk(9));
        assert_ne!(walk(9), walk(10));
    }

    fn pull(plant: &mut Compressor, id: &str, to: &str) {
        let lever = COMPRESSOR_LEVERS.iter().find(|lever| lever.id == id).unwrap();
        plant.pull(id, lever.position(to).unwrap());
    }

    #[test]
    fn the_emergency_stop_cuts_fuel_and_starter() {
        let mut plant = started(3);
        pull(&mut plant, "emergency_stop", "pressed");
        run(&mut plant, &Orders { starter: true, ..RUNNING }, 20.0);
        assert_eq!(plant.engine.speed, 0.0);
        pull(&mut plant, "emergency_stop", "released");
        run(&mut plant, &Orders { starter: true, ..RUNNING }, 6.0);
        assert!(plant.engine.firing);
    }

    #[test]
    fn a_binding_screw_at_full_pressure_overloads_the_engine() {
        let mut plant = started(4);
        pull(&mut plant, "air.consumption", "8");
        run(&mut plant, &LOADED, 60.0);
        assert!(plant.load() < 105.0, "{}", plant.load());
        pull(&mut plant, "screw", "binding");
        run(&mut plant, &LOADED, 30.0);
        assert!(plant.load() > 110.0, "{}", plant.load());
    }

    #[test]
    fn broken_senders_read_nothing_and_the_machine_goes_on() {
        let mut plant = started(5);
        assert_eq!(plant.discharge().pressure, Some(plant.air.pressure));
        for lever in ["discharge_pressure", "discharge_temperature", "separator", "fuel_level"] {
            pull(&mut plant, &format!("sender.{lever}"), "broken");
        }
        run(&mut plant, &LOADED, 30.0);
        let discharge = plant.discharge();
        assert_eq!((discharge.pressure, discharge.temperature, discharge.separator_loss), (None, None, None));
        assert_eq!(plant.readings().fuel_level, None);
        assert!(plant.readings().coolant.is_some() && plant.air.pressure > 300.0);
    }

    #[test]
    fn a_clogged_air_filter_costs_delivery_and_boost_and_heats_the_exhaust() {
        let after = |filter| {
            let mut plant = started(6);
            pull(&mut plant, "air.consumption", "9");
            pull(&mut plant, "air_filter", filter);
            run(&mut plant, &LOADED, 90.0);
            (plant.air.delivery, plant.exhaust.boost)
        };
        let (clean, clogged) = (after("clean"), after("clogged"));
        assert!(clogged.0 < 0.9 * clean.0 && clogged.1 < 0.8 * clean.1, "{clean:?} {clogged:?}");
    }

    #[test]
    fn the_heater_warms_the_coolant_as_far_as_its_thermostat_lets_it() {
        let after = |heater, seconds| {
            let mut plant = Compressor::new(8);
            run(&mut plant, &Orders { heater, ..REST }, seconds);
            plant.engine.coolant
        };
        assert!((10.0..25.0).contains(&(after(true, 1800.0) - after(false, 1800.0))));
        assert!((59.0..61.0).contains(&after(true, 7200.0)), "{}", after(true, 7200.0));
    }

    #[test]
    fn lost_coolant_shows_in_the_expansion_tank() {
        let mut plant = started(7);
        pull(&mut plant, "coolant", "leaking");
        run(&mut plant, &RUNNING, 120.0);
        assert!(plant.coolant_level() < 40.0, "{}", plant.coolant_level());
        pull(&mut plant, "coolant", "normal");
        assert!(plant.coolant_level() > 80.0);
    }
}
