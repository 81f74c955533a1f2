//! The plant behind a panel: mains, genset, load, breakers, tank and batteries, stepped by a simulated clock.
//!
//! The same seed, steps and controls give the same plant to the last bit. What a panel shows must follow from
//! here: no register has a value of its own that contradicts another.

mod air;
mod compressor;
mod electrical;
mod engine;
mod exhaust;
mod levers;
mod parallel;
mod supplies;

pub(crate) use compressor::{Compressor, Orders};
pub(crate) use electrical::{Energy, Feed};
pub(crate) use engine::Engine;
pub(crate) use levers::LEVERS;
pub(crate) use parallel::Regulation;
pub(crate) use supplies::{Battery, Tank};

use crate::random::{Drift, Random, approach};

use parallel::Coupling;

/// Nameplate of the imitated genset: 100 kVA, 230/400 V, 50 Hz, four poles.
pub(crate) const RATED_KW: f64 = 80.0;
pub(crate) const RATED_KVA: f64 = 100.0;
pub(crate) const RATED_KVAR: f64 = 60.0;
pub(crate) const RATED_RPM: f64 = 1500.0;
pub(crate) const RATED_VOLTAGE: f64 = 230.9;
/// Four poles: two periods a turn.
pub(crate) const HERTZ_PER_RPM: f64 = 2.0 / 60.0;
/// Seconds a breaker takes from command to position.
const BREAKER_SECONDS: f64 = 0.2;

/// kW and kvar of each phase.
type PhaseLoads = ([f64; 3], [f64; 3]);
const NO_LOAD: PhaseLoads = ([0.0; 3], [0.0; 3]);

/// What a panel can do to the plant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Controls {
    /// Fuel solenoid open.
    pub(crate) fuel: bool,
    /// Starter motor engaged.
    pub(crate) starter: bool,
    /// Governor at idle speed.
    pub(crate) idle: bool,
    /// Coolant heater on.
    pub(crate) block_heater: bool,
    /// Pump from the main tank into the day tank.
    pub(crate) fuel_pump: bool,
    /// Genset breaker commanded closed.
    pub(crate) genset_breaker: bool,
    /// Mains breaker commanded closed.
    pub(crate) mains_breaker: bool,
}

/// The whole of it; a panel reads the fields and hands back [`Controls`].
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    /// Seconds since power-on.
    pub(crate) time: f64,
    pub(crate) mains: Feed,
    pub(crate) mains_energy: Energy,
    pub(crate) genset: Feed,
    pub(crate) genset_energy: Energy,
    pub(crate) engine: Engine,
    pub(crate) mains_breaker: Breaker,
    pub(crate) genset_breaker: Breaker,
    pub(crate) batteries: [Battery; 2],
    pub(crate) tank: Tank,
    /// degC.
    pub(crate) ambient: f64,
    /// degC under the canopy.
    pub(crate) canopy: f64,
    /// The set point of the genset's voltage regulator.
    pub(crate) excitation: Regulation,
    coupling: Coupling,
    utility: Utility,
    load: Load,
    alternator: f64,
    weather: Drift,
    random: Random,
}

impl Plant {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut plant = Self {
            time: 0.0,
            mains: Feed::default(),
            mains_energy: past_energy(random.between(110_000.0, 160_000.0)),
            genset: Feed::default(),
            genset_energy: past_energy(random.between(18_000.0, 31_000.0)),
            engine: Engine::new(&mut random),
            mains_breaker: Breaker::new(true),
            genset_breaker: Breaker::new(false),
            batteries: [Battery::new(&mut random), Battery::new(&mut random)],
            tank: Tank::new(random.between(70.0, 85.0)),
            ambient: 18.0,
            canopy: 21.0,
            excitation: Regulation::default(),
            coupling: Coupling::default(),
            utility: Utility::new(&mut random),
            load: Load::new(&mut random),
            alternator: 0.0,
            weather: Drift::new(0.4, 600.0, &mut random),
            random,
        };
        // One step fills the meters, so that the first image is a whole one.
        plant.step(0.1, &Controls { mains_breaker: true, ..Controls::default() });
        plant.time = 0.0;
        plant
    }

    /// Lets `dt` seconds pass; meant for steps of about a tenth of a second.
    pub(crate) fn step(&mut self, dt: f64, controls: &Controls) {
        self.time += dt;
        self.climate(dt);
        self.mains_breaker.step(dt, controls.mains_breaker);
        self.genset_breaker.step(dt, controls.genset_breaker);

        let carried = self.genset.total_active();
        self.engine.step(dt, controls, carried, self.canopy, &mut self.random);
        self.electricity(dt);

        let charger = self.mains.average_voltage() > 180.0;
        for battery in &mut self.batteries {
            battery.step(dt, controls.starter, self.engine.is_running(), charger, &mut self.random);
        }
        self.tank.step(dt, self.engine.burn, controls.fuel_pump);
    }

    /// Whether the mains are good enough to feed the load.
    pub(crate) fn mains_healthy(&self) -> bool {
        self.mains.voltage.iter().all(|volts| (190.0..260.0).contains(volts))
            && (47.0..53.0).contains(&self.mains.frequency)
    }

    /// Whether the genset is good enough to feed the load.
    pub(crate) fn genset_healthy(&self) -> bool {
        self.genset.voltage.iter().all(|volts| (200.0..260.0).contains(volts))
            && (47.0..53.0).contains(&self.genset.frequency)
    }

    /// Takes the voltage off the grid, or gives it back.
    pub(crate) fn fail_mains(&mut self, failed: bool) {
        self.utility.failed = failed;
    }

    /// Whether genset and grid feed one busbar.
    pub(crate) fn is_parallel(&self) -> bool {
        self.mains_breaker.closed && self.genset_breaker.closed && self.utility.is_alive()
    }

    /// By how many degrees the genset leads the mains, -180 to 180; without meaning while one of them is dead.
    pub(crate) fn angle(&self) -> f64 {
        self.coupling.angle()
    }

    fn climate(&mut self, dt: f64) {
        // Power-on is ten in the morning; the warmest hour is three in the afternoon.
        let hour = 10.0 + self.time / 3600.0;
        let day = 4.0 * ((hour - 9.0) / 24.0 * std::f64::consts::TAU).sin();
        self.ambient = 19.0 + day + self.weather.step(dt, &mut self.random);
        let warmer = 2.0 + 0.25 * (self.engine.coolant - self.ambient).max(0.0);
        approach(&mut self.canopy, self.ambient + warmer, 240.0, dt);
    }

    fn electricity(&mut self, dt: f64) {
        self.excite(dt);
        // An alternator that does not turn has no voltage at all, however slowly the regulator forgets.
        let alternator = if self.engine.speed > 0.0 { self.alternator } else { 0.0 };

        let load = self.load.step(dt, &mut self.random);
        let on_mains = self.mains_breaker.closed && self.utility.is_alive();
        let on_genset = self.genset_breaker.closed && alternator > 100.0;
        let (mains_load, genset_load) = match (on_mains, on_genset) {
            (true, true) => {
                self.coupling.split(dt, load, &self.mains, &self.engine.governor, &self.excitation)
            }
            (true, false) => (load, NO_LOAD),
            (false, true) => (NO_LOAD, load),
            (false, false) => (NO_LOAD, NO_LOAD),
        };

        let (voltage, frequency) = self.utility.step(dt, mains_load.0.iter().sum(), &mut self.random);
        self.mains = Feed { voltage, frequency, active: mains_load.0, reactive: mains_load.1 };
        self.mains_energy.add(&self.mains, dt);

        let parallel = on_mains && on_genset;
        if parallel {
            // One busbar has one frequency and one voltage, and the grid is the stronger.
            self.engine.speed = frequency / HERTZ_PER_RPM;
            self.alternator = self.mains.average_voltage();
        }
        let terminals = match parallel {
            true => voltage,
            false => [0.9985, 1.0008, 1.0007].map(|part| part * alternator),
        };
        let ripple = 0.0006 * alternator;
        self.genset = Feed {
            voltage: terminals.map(|volts| volts + ripple * self.random.noise()),
            frequency: self.engine.speed * HERTZ_PER_RPM,
            active: genset_load.0,
            reactive: genset_load.1,
        };
        self.genset_energy.add(&self.genset, dt);
        self.coupling.follow(dt, &self.genset, &self.mains, parallel);
    }

    /// The voltage regulator builds up and holds the voltage of a turning alternator.
    fn excite(&mut self, dt: f64) {
        let settled = self.excitation.settles_at(RATED_VOLTAGE, self.genset.total_reactive() / RATED_KVAR);
        let excited = match self.engine.speed {
            rpm if rpm > 700.0 => settled * (rpm / (0.95 * RATED_RPM)).min(1.0),
            rpm => 4.0 * rpm / RATED_RPM,
        };
        approach(&mut self.alternator, excited, 0.4, dt);
    }
}

/// A breaker that follows its command after its operating time.
#[derive(Clone, Debug)]
pub(crate) struct Breaker {
    pub(crate) closed: bool,
    moving: f64,
}

impl Breaker {
    fn new(closed: bool) -> Self {
        Self { closed, moving: 0.0 }
    }

    fn step(&mut self, dt: f64, command: bool) {
        self.moving = if command == self.closed { 0.0 } else { self.moving + dt };
        if self.moving >= BREAKER_SECONDS {
            self.closed = command;
            self.moving = 0.0;
        }
    }
}

/// The public grid at the meter.
#[derive(Clone, Debug)]
struct Utility {
    common: Drift,
    phases: [Drift; 3],
    frequency: Drift,
    failed: bool,
    /// Part of its voltage that is there.
    present: f64,
}

impl Utility {
    fn new(random: &mut Random) -> Self {
        Self {
            common: Drift::new(1.2, 180.0, random),
            phases: std::array::from_fn(|_| Drift::new(0.5, 15.0, random)),
            frequency: Drift::new(0.012, 8.0, random),
            failed: false,
            present: 1.0,
        }
    }

    fn is_alive(&self) -> bool {
        !self.failed
    }

    fn step(&mut self, dt: f64, load: f64, random: &mut Random) -> ([f64; 3], f64) {
        let level = 231.5 + self.common.step(dt, random) - 0.02 * load;
        let voltage: [f64; 3] = std::array::from_fn(|phase| level + self.phases[phase].step(dt, random));
        let frequency = 50.0 + self.frequency.step(dt, random);
        // Motors that run down hold the voltage for some periods.
        approach(&mut self.present, if self.failed { 0.0 } else { 1.0 }, 0.1, dt);
        match self.present {
            0.999.. => (voltage, frequency),
            // Below this a meter sees neither voltage nor frequency.
            ..0.02 => ([0.0; 3], 0.0),
            part => (voltage.map(|volts| volts * part), frequency),
        }
    }
}

/// The consumers: a base that wanders, and a machine that switches on and off.
#[derive(Clone, Debug)]
struct Load {
    base: Drift,
    power_factor: Drift,
    shares: [Drift; 3],
    machine_on: bool,
    machine_switches_in: f64,
}

impl Load {
    fn new(random: &mut Random) -> Self {
        Self {
            base: Drift::new(2.5, 90.0, random),
            power_factor: Drift::new(0.012, 60.0, random),
            shares: std::array::from_fn(|_| Drift::new(0.008, 120.0, random)),
            machine_on: false,
            machine_switches_in: random.between(20.0, 60.0),
        }
    }

    /// kW and kvar of each phase, in the tenths that the controllers' meters resolve: totals are then the exact
    /// sums of what is shown.
    fn step(&mut self, dt: f64, random: &mut Random) -> PhaseLoads {
        self.machine_switches_in -= dt;
        if self.machine_switches_in <= 0.0 {
            self.machine_on = !self.machine_on;
            self.machine_switches_in = random.between(40.0, 120.0);
        }
        let machine = if self.machine_on { 7.5 } else { 0.0 };
        let total = 36.0 + machine + self.base.step(dt, random);
        let power_factor = 0.885 + self.power_factor.step(dt, random);
        let reactive_part = (1.0 - power_factor * power_factor).sqrt() / power_factor;

        let mut shares = [0.342, 0.331, 0.327];
        for (share, drift) in shares.iter_mut().zip(&mut self.shares) {
            *share += drift.step(dt, random);
        }
        let whole: f64 = shares.iter().sum();
        let active = shares.map(|share| tenth(total * share / whole));
        (active, active.map(|kw| tenth(kw * reactive_part)))
    }
}

fn past_energy(active: f64) -> Energy {
    Energy { active, exported: 0.0, inductive: active * 0.47, capacitive: active * 0.003 }
}

fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.1;

    fn run(plant: &mut Plant, controls: &Controls, seconds: f64) {
        for _ in 0..(seconds / DT) as u32 {
            plant.step(DT, controls);
        }
    }

    fn on_mains() -> Controls {
        Controls { mains_breaker: true, ..Controls::default() }
    }

    fn start(plant: &mut Plant) -> Controls {
        let mut controls = Controls { fuel: true, starter: true, ..on_mains() };
        run(plant, &controls, 5.0);
        controls.starter = false;
        run(plant, &controls, 10.0);
        controls
    }

    #[test]
    fn mains_carry_the_load_from_the_first_image_on() {
        let plant = Plant::new(1);
        assert!(plant.mains_healthy());
        assert!(plant.mains.total_active() > 25.0);
        assert_eq!(plant.genset.voltage, [0.0; 3]);
        assert_eq!(plant.time, 0.0);
    }

    #[test]
    fn the_same_seed_is_the_same_plant() {
        let walk = |seed| {
            let mut plant = Plant::new(seed);
            run(&mut plant, &on_mains(), 60.0);
            (plant.mains.voltage, plant.mains_energy.active, plant.engine.coolant)
        };
        assert_eq!(walk(9), walk(9));
        assert_ne!(walk(9), walk(10));
    }

    #[test]
    fn a_started_genset_builds_up_voltage_and_takes_the_load() {
        let mut plant = Plant::new(2);
        let mut controls = start(&mut plant);
        assert!(plant.genset_healthy(), "{:?}", plant.genset);
        assert_eq!(plant.genset.total_active(), 0.0);

        controls.mains_breaker = false;
        run(&mut plant, &controls, 1.0);
        assert_eq!(plant.mains.total_active(), 0.0);
        controls.genset_breaker = true;
        run(&mut plant, &controls, 5.0);
        assert!(plant.genset.total_active() > 25.0);
        assert!(plant.genset_healthy(), "{:?}", plant.genset);
        assert!(plant.engine.burn > 8.0);
    }

    #[test]
    fn a_breaker_takes_its_time() {
        let mut breaker = Breaker::new(false);
        breaker.step(0.1, true);
        assert!(!breaker.closed);
        breaker.step(0.1, true);
        assert!(breaker.closed);
    }

    #[test]
    fn cranking_dips_the_battery_and_is_remembered() {
        let mut plant = Plant::new(4);
        run(&mut plant, &on_mains(), 10.0);
        let rest = plant.batteries[0].voltage;
        start(&mut plant);
        assert!(plant.batteries[0].cranking_minimum < rest - 4.0);
        assert!(plant.batteries[0].voltage > 27.0, "the alternator charges it again");
    }

    #[test]
    fn burned_fuel_leaves_the_tank() {
        let mut plant = Plant::new(6);
        let controls = start(&mut plant);
        let (litres, burned) = (plant.tank.litres, plant.engine.burned);
        run(&mut plant, &controls, 600.0);
        let drawn = litres - plant.tank.litres;
        assert!(drawn > 0.1);
        assert!((drawn - (plant.engine.burned - burned)).abs() < 1e-6);
    }
}
