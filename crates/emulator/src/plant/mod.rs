//! The plant behind a panel: mains, genset, load, breakers, tank and batteries, stepped by a simulated clock.
//!
//! The same seed, steps, controls and pulled levers give the same plant to the last bit. What a panel shows must follow
//! from here: no register has a value of its own that contradicts another.

mod air;
mod alternator;
mod breaker;
mod climate;
mod compressor;
mod compressor_levers;
mod electrical;
mod engine;
mod engine_levers;
mod exhaust;
mod governor;
mod grid;
mod levers;
mod load;
mod parallel;
mod senders;
mod sisters;
mod supplies;
#[cfg(test)]
mod tests;

pub(crate) use breaker::Breaker;
pub(crate) use compressor::{Compressor, Orders};
pub(crate) use compressor_levers::COMPRESSOR_LEVERS;
pub(crate) use electrical::{Energy, Feed};
pub(crate) use engine::Engine;
pub(crate) use governor::Regulation;
pub(crate) use grid::Supply;
pub(crate) use levers::LEVERS;
pub(crate) use parallel::Synchronism;
pub(crate) use senders::Readings;
pub(crate) use sisters::{Offer, Sisters};
pub(crate) use supplies::{Battery, Tank};

use crate::random::{Random, approach};

use alternator::Alternator;
use climate::Climate;
use engine::Inputs;
use governor::Fault;
use grid::{DEAD_PHASE, Grid};
use load::{Load, NO_LOAD, PhaseLoads, tenth};
use parallel::{Coupling, Set, live_average};
use senders::Senders;
use sisters::{Feeding, Machine};
use supplies::Service;

/// Nameplate of the imitated genset: 100 kVA, 230/400 V, 50 Hz, four poles.
pub(crate) const RATED_KW: f64 = 80.0;
pub(crate) const RATED_KVA: f64 = 100.0;
pub(crate) const RATED_KVAR: f64 = 60.0;
pub(crate) const RATED_RPM: f64 = 1500.0;
pub(crate) const RATED_VOLTAGE: f64 = 230.9;
/// Four poles: two periods a turn.
pub(crate) const HERTZ_PER_RPM: f64 = 2.0 / 60.0;

/// rpm a second at which the grid drags a shaft along.
const DRAG: f64 = 1500.0;
/// V of the mains from which the battery charger has its supply.
const SUPPLY: f64 = 180.0;

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
    /// Consumers that can be spared are switched off.
    pub(crate) load_shedding: bool,
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
    /// Other gensets on the bus bar.
    pub(crate) sisters: Sisters,
    /// degC.
    pub(crate) ambient: f64,
    /// degC under the canopy.
    pub(crate) canopy: f64,
    /// The set point of the genset's voltage regulator.
    pub(crate) excitation: Regulation,
    /// The button beside the panel is pressed: without the panel's help neither fuel nor starter has a supply.
    pub(crate) emergency_stop: bool,
    /// The site's contact for a remote start is closed.
    pub(crate) remote_start: bool,
    senders: Senders,
    coupling: Coupling,
    grid: Grid,
    load: Load,
    alternator: Alternator,
    climate: Climate,
    random: Random,
}

impl Plant {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let climate = Climate::new(&mut random);
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
            sisters: Sisters::new(&mut random),
            ambient: climate.outside(),
            canopy: climate.outside() + 2.0,
            excitation: Regulation::default(),
            emergency_stop: false,
            remote_start: false,
            senders: Senders::default(),
            coupling: Coupling::default(),
            grid: Grid::new(&mut random),
            load: Load::new(&mut random),
            alternator: Alternator::new(),
            climate,
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
        self.ambient = self.climate.step(dt, self.time, &mut self.random);
        let warmer = 2.0 + 0.25 * (self.engine.coolant - self.ambient).max(0.0);
        approach(&mut self.canopy, self.ambient + warmer, 240.0, dt);
        self.mains_breaker.step(dt, controls.mains_breaker);
        self.genset_breaker.step(dt, controls.genset_breaker);
        self.load.shed = controls.load_shedding;

        let starter = controls.starter && !self.emergency_stop;
        let inputs = Inputs {
            fuel: controls.fuel && !self.emergency_stop,
            fed: self.tank.feeds(),
            starter: starter.then(|| self.batteries[0].strength()),
            idle: controls.idle,
            heater: controls.block_heater,
            load: self.genset.total_active(),
            ambient: self.canopy,
        };
        let speed = self.engine.speed;
        self.engine.step(dt, &inputs, &mut self.random);
        self.electricity(dt, speed);

        let running = self.engine.is_running();
        let supplied = self.mains.average_voltage() > SUPPLY;
        let service = Service { cranking: starter, running, supplied };
        for battery in &mut self.batteries {
            battery.step(dt, service, &mut self.random);
        }
        self.tank.step(dt, self.engine.burn, controls.fuel_pump);
    }

    /// Switches the line of the grid off, or on again, whatever the lever `mains` says.
    pub(crate) fn fail_mains(&mut self, failed: bool) {
        self.grid.outage = failed;
    }

    /// Says what feeds the line to the mains meter from now on.
    pub(crate) fn supply(&mut self, supply: Supply) {
        self.grid.supply = Some(supply);
    }

    /// What this genset and the consumers behind it are to the bus bar that it shares with others.
    pub(crate) fn offer(&self) -> Offer {
        self.sisters.offer(self.engine.speed, self.alternator.voltage, self.genset.voltage)
    }

    /// Says what the others on its bus bar are to it: whatever is on one bus bar has one speed and one voltage.
    pub(crate) fn join(&mut self, others: Offer) {
        let (speed, volts) = self.sisters.join(self.offer(), others);
        if let Some(speed) = speed {
            self.engine.speed = speed;
            self.genset.frequency = speed * HERTZ_PER_RPM;
        }
        if let Some(volts) = volts.filter(|_| self.alternator.voltage > 0.0) {
            let part = volts / self.alternator.voltage;
            self.alternator.hold(volts);
            self.genset.voltage = self.genset.voltage.map(|phase| phase * part);
        }
        if self.sisters.shares() && self.is_joined() {
            self.mains.voltage = self.genset.voltage;
            self.mains.frequency = grid::found(self.genset.voltage, self.genset.frequency);
        }
    }

    /// Whether genset and grid feed one busbar.
    pub(crate) fn is_parallel(&self) -> bool {
        self.is_joined() && self.grid.is_alive()
    }

    /// Whether genset and line are on one busbar, whatever the grid gives.
    fn is_joined(&self) -> bool {
        self.mains_breaker.closed && self.genset_breaker.closed
    }

    /// By how many degrees the genset leads the mains, -180 to 180; without meaning while one of them is dead.
    pub(crate) fn angle(&self) -> f64 {
        self.coupling.angle()
    }

    /// How the genset stands to the mains.
    pub(crate) fn synchronism(&self) -> Synchronism {
        let mains = &self.mains;
        self.stand((mains.average_voltage(), mains.frequency), !mains.phase_order_wrong)
    }

    fn stand(&self, (volts, hertz): (f64, f64), same_order: bool) -> Synchronism {
        let own = self.genset.average_voltage();
        Synchronism {
            live: volts.min(own) > alternator::DEAD,
            angle: self.angle(),
            slip: self.genset.frequency - hertz,
            voltage: own - volts,
            same_order,
        }
    }

    /// Whether genset and grid were joined out of step just now, and pull at each other.
    pub(crate) fn is_jolting(&self) -> bool {
        self.coupling.is_jolting()
    }

    /// What the senders tell.
    pub(crate) fn readings(&self) -> Readings {
        self.senders.read(&self.engine, &self.tank)
    }

    /// `speed` is that of the shaft before the engine had its say.
    fn electricity(&mut self, dt: f64, speed: f64) {
        let chokes = self.is_joined() && !self.grid.is_alive();
        self.alternator.step(dt, self.engine.speed, &self.excitation, &self.genset, chokes);
        let (grid, hertz) = self.grid.step(dt, self.mains.total_active(), &mut self.random);
        let stand = self.stand((live_average(grid), self.grid.hertz()), !self.grid.is_reversed());
        if self.coupling.meet(dt, self.is_parallel(), &stand) {
            self.genset_breaker.trip();
        }
        let parallel = self.is_parallel();
        if parallel {
            self.drag(dt, speed, grid, hertz);
        }
        let genset_hertz = self.engine.speed * HERTZ_PER_RPM;
        let terminals = self.terminals(parallel.then_some(grid));
        // Whatever is on one busbar has one voltage.
        let (voltage, frequency) = match self.is_joined() {
            true if !parallel => (terminals, grid::found(terminals, genset_hertz)),
            true => (terminals, hertz),
            false => (grid, hertz),
        };
        let dead = grid.map(|volts| self.is_joined() && !(parallel && volts >= DEAD_PHASE));
        let line = parallel::dead_line(terminals, dead);
        let (mains_load, genset_load) = self.flows(dt, parallel, (grid, hertz), terminals);

        self.mains = Feed {
            voltage,
            frequency,
            phase_order_wrong: self.grid.is_reversed() && self.grid.is_alive(),
            active: both(mains_load.0, line.0.map(|kw| -kw)),
            reactive: both(mains_load.1, line.1.map(|kvar| -kvar)),
        };
        self.mains_energy.add(&self.mains, dt);
        self.genset = Feed {
            voltage: terminals,
            frequency: genset_hertz,
            active: both(genset_load.0, line.0),
            reactive: both(genset_load.1, line.1),
            ..Feed::default()
        };
        self.genset_energy.add(&self.genset, dt);
        self.coupling.follow(dt, &self.genset, self.grid.hertz());
    }

    /// One busbar has one frequency and one voltage, and the grid is the stronger.
    fn drag(&mut self, dt: f64, speed: f64, voltage: [f64; 3], frequency: f64) {
        let missing = frequency / HERTZ_PER_RPM - speed;
        self.engine.speed = speed + missing.clamp(-DRAG * dt, DRAG * dt);
        self.alternator.hold(live_average(voltage));
    }

    /// V of each phase at the genset's terminals: those of the grid where it is on the same busbar, and next to nothing
    /// on a phase that it has lost.
    fn terminals(&mut self, grid: Option<[f64; 3]>) -> [f64; 3] {
        let alternator = self.alternator.voltage;
        let ripple = 0.0006 * alternator;
        let mut terminals =
            [0.9985, 1.0008, 1.0007].map(|part| part * alternator + ripple * self.random.noise());
        if let Some(grid) = grid {
            for (own, grid) in terminals.iter_mut().zip(grid) {
                *own = if grid >= DEAD_PHASE { grid } else { grid.max(alternator::CHOKED * *own) };
            }
        }
        terminals
    }

    /// What the mains and the genset carry.
    fn flows(
        &mut self,
        dt: f64,
        parallel: bool,
        grid: ([f64; 3], f64),
        terminals: [f64; 3],
    ) -> (PhaseLoads, PhaseLoads) {
        let on_mains = self.mains_breaker.closed && self.grid.is_alive();
        let on_genset = self.genset_breaker.closed && self.alternator.voltage > alternator::DEAD;
        let busbar = match (parallel || on_genset, on_mains) {
            (true, _) => terminals,
            (_, true) => grid.0,
            _ => self.sisters.fed(),
        };
        let hour = Climate::hour(self.time);
        let load = self.load.step(dt, hour, busbar, &mut self.random);
        let feeding = match (on_mains, on_genset) {
            (true, _) => Feeding::Mains,
            (false, true) => Feeding::Genset,
            (false, false) => Feeding::Nobody,
        };
        let set = Set {
            running: self.engine.is_running(),
            runaway: self.engine.governor.fault == Fault::RunningAway,
            governor: self.engine.governor.set_point(),
            excitation: &self.excitation,
            avr: self.alternator.avr,
        };
        let machine = Machine {
            speed: self.engine.speed,
            voltage: self.alternator.voltage,
            active: set.forced_active(),
            reactive: set.forced_reactive(),
        };
        let shared = self.sisters.share(dt, feeding, load, machine, &mut self.random);
        match (on_mains, on_genset) {
            _ if parallel => self.coupling.split(dt, load, grid, &set),
            (true, _) => (load, NO_LOAD),
            (_, true) => (NO_LOAD, shared),
            _ => (NO_LOAD, NO_LOAD),
        }
    }
}

fn both(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|phase| tenth(one[phase] + other[phase]))
}

fn past_energy(active: f64) -> Energy {
    Energy { active, exported: 0.0, inductive: active * 0.47, capacitive: active * 0.003 }
}
