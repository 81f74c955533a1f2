//! The diesel engine: speed, oil pressure, temperatures that remember, fuel burned.

use crate::random::{Random, approach};

use super::{Controls, RATED_KW, RATED_RPM, Regulation};

/// Below this the starter turns the crankshaft; above it the engine turns by itself.
const FIRED_RPM: f64 = 400.0;
const CRANKING_RPM: f64 = 230.0;
const IDLE_RPM: f64 = 900.0;
/// What the coolant and the block around it store, kJ/K.
const HEAT_CAPACITY: f64 = 160.0;
const THERMOSTAT_DEGC: f64 = 80.0;

#[derive(Clone, Debug)]
pub(crate) struct Engine {
    /// 1/min.
    pub(crate) speed: f64,
    /// Burning fuel and turning by itself.
    pub(crate) firing: bool,
    /// bar.
    pub(crate) oil_pressure: f64,
    /// degC.
    pub(crate) coolant: f64,
    /// degC.
    pub(crate) oil: f64,
    /// L/h at this moment.
    pub(crate) burn: f64,
    /// L since the controller was fitted.
    pub(crate) burned: f64,
    /// Hours run since the controller was fitted.
    pub(crate) hours: f64,
    /// The governor's set point.
    pub(crate) governor: Regulation,
    /// Seconds of starter still needed before the first cylinder catches.
    until_fire: f64,
    /// kW the governor has already answered; the rest still pulls the speed down.
    governed: f64,
}

impl Engine {
    pub(crate) fn new(random: &mut Random) -> Self {
        let hours = random.between(900.0, 2600.0);
        Self {
            speed: 0.0,
            firing: false,
            oil_pressure: 0.0,
            coolant: random.between(38.5, 41.5),
            oil: random.between(33.0, 36.0),
            burn: 0.0,
            burned: hours * 9.3,
            hours,
            governor: Regulation::default(),
            until_fire: random.between(1.0, 2.2),
            governed: 0.0,
        }
    }

    pub(crate) fn is_running(&self) -> bool {
        self.firing && self.speed > FIRED_RPM
    }

    pub(crate) fn step(
        &mut self,
        dt: f64,
        controls: &Controls,
        load: f64,
        ambient: f64,
        random: &mut Random,
    ) {
        self.turn(dt, controls, load, random);
        self.heat(dt, controls, load, ambient);

        let thin = 1.0 - 0.004 * (self.oil - 40.0);
        let pressure = (5.4 * self.speed / RATED_RPM * thin).min(4.9);
        approach(&mut self.oil_pressure, pressure, 0.8, dt);

        self.burn = match self.is_running() {
            true => 2.6 * self.speed / RATED_RPM + 0.25 * load,
            false => 0.0,
        };
        self.burned += self.burn * dt / 3600.0;
        if self.is_running() {
            self.hours += dt / 3600.0;
        }
    }

    fn turn(&mut self, dt: f64, controls: &Controls, load: f64, random: &mut Random) {
        self.firing &= controls.fuel;
        if !self.firing && controls.starter {
            approach(&mut self.speed, CRANKING_RPM, 0.4, dt);
            if controls.fuel && self.speed > 150.0 {
                self.until_fire -= dt;
                self.firing = self.until_fire <= 0.0;
            }
            return;
        }
        if !self.firing {
            // Friction: a rolling engine stands after some seconds.
            approach(&mut self.speed, 0.0, 2.0, dt);
            self.speed = (self.speed - 60.0 * dt).max(0.0);
            self.until_fire = random.between(1.0, 2.2);
            self.governed = 0.0;
            return;
        }
        approach(&mut self.governed, load, 0.9, dt);
        let target = match controls.idle {
            true => IDLE_RPM,
            false => {
                let settled = self.governor.settles_at(RATED_RPM, load / RATED_KW);
                settled - 90.0 * (load - self.governed) / RATED_KW + 1.2 * random.noise()
            }
        };
        let before = self.speed;
        approach(&mut self.speed, target, 0.35, dt);
        self.speed = self.speed.min(before + 600.0 * dt);
    }

    fn heat(&mut self, dt: f64, controls: &Controls, load: f64, ambient: f64) {
        // kW into the coolant: a diesel gives it nearly as much as the shaft.
        let combustion = if self.is_running() { 4.0 + 0.55 * load } else { 0.0 };
        let heater = if controls.block_heater { 1.8 } else { 0.0 };
        let radiator = if self.is_running() { 3.0 * (self.coolant - THERMOSTAT_DEGC).max(0.0) } else { 0.0 };
        let casing = 0.03 * (self.coolant - ambient);
        self.coolant += (combustion + heater - radiator - casing) * dt / HEAT_CAPACITY;

        let hotter = if self.is_running() { 6.0 + 14.0 * load / RATED_KW } else { -4.0 };
        approach(&mut self.oil, self.coolant + hotter, 150.0, dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.1;

    fn run(engine: &mut Engine, controls: &Controls, load: f64, seconds: f64) {
        let mut random = Random::new(5);
        for _ in 0..(seconds / DT) as u32 {
            engine.step(DT, controls, load, 20.0, &mut random);
        }
    }

    fn running() -> Engine {
        let mut engine = Engine::new(&mut Random::new(1));
        run(&mut engine, &Controls { fuel: true, starter: true, ..Controls::default() }, 0.0, 5.0);
        run(&mut engine, &Controls { fuel: true, ..Controls::default() }, 0.0, 10.0);
        engine
    }

    #[test]
    fn the_starter_alone_never_fires_it() {
        let mut engine = Engine::new(&mut Random::new(1));
        run(&mut engine, &Controls { starter: true, ..Controls::default() }, 0.0, 20.0);
        assert!(!engine.firing);
        assert!((engine.speed - CRANKING_RPM).abs() < 1.0, "{}", engine.speed);
    }

    #[test]
    fn it_fires_runs_at_rated_speed_and_stops_without_fuel() {
        let mut engine = running();
        assert!(engine.is_running());
        assert!((engine.speed - RATED_RPM).abs() < 6.0, "{}", engine.speed);
        assert!((3.5..5.0).contains(&engine.oil_pressure), "{}", engine.oil_pressure);

        run(&mut engine, &Controls::default(), 0.0, 12.0);
        assert_eq!(engine.speed, 0.0);
        assert_eq!(engine.burn, 0.0);
        assert!(engine.oil_pressure < 0.1);
    }

    #[test]
    fn a_load_step_dips_the_speed_and_the_governor_brings_it_back() {
        let mut engine = running();
        let controls = Controls { fuel: true, ..Controls::default() };
        run(&mut engine, &controls, 60.0, 0.5);
        assert!(engine.speed < RATED_RPM - 15.0, "{}", engine.speed);
        run(&mut engine, &controls, 60.0, 8.0);
        assert!((engine.speed - RATED_RPM).abs() < 6.0, "{}", engine.speed);
    }

    #[test]
    fn it_warms_up_under_load_and_cools_slowly() {
        let mut engine = running();
        run(&mut engine, &Controls { fuel: true, ..Controls::default() }, 50.0, 1200.0);
        assert!((82.0..98.0).contains(&engine.coolant), "{}", engine.coolant);
        let hot = engine.coolant;
        run(&mut engine, &Controls::default(), 0.0, 60.0);
        assert!(engine.coolant < hot && engine.coolant > hot - 5.0, "{}", engine.coolant);
    }
}
