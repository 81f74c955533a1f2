//! The diesel engine: cranking and firing, speed, oil pressure, temperatures that remember, fuel burned.

use crate::random::{Random, approach};

use super::governor::Governor;
use super::{RATED_KW, RATED_RPM};

/// Below this the starter turns the crankshaft; above it the engine turns by itself.
const FIRED_RPM: f64 = 400.0;
/// What a healthy battery makes of the starter, and the least at which a cylinder gets hot enough.
const CRANKING_RPM: f64 = 230.0;
const CATCHES_RPM: f64 = 100.0;
const IDLE_RPM: f64 = 900.0;
/// Pulled below this, it stalls.
const STALLS_RPM: f64 = 700.0;
/// kW at rated speed with all the fuel there is.
pub(super) const MOST_KW: f64 = 104.0;
/// kJ in the shaft at rated speed.
const FLYWHEEL: f64 = 100.0;
/// What the coolant and the block around it store, kJ/K.
const HEAT_CAPACITY: f64 = 160.0;
/// degC at which the thermostat begins to open, and at which it is open.
const THERMOSTAT: (f64, f64) = (80.0, 92.0);
/// kW/K between coolant and air that the radiator takes away, clear and blocked.
const RADIATOR: f64 = 1.5;
const BLOCKED_RADIATOR: f64 = 0.075;
/// degC from which the coolant boils, and kW/K that go with the steam.
const BOILS_DEGC: f64 = 112.0;
const STEAM: f64 = 4.0;
/// Part of the oil that a leak takes in a second at full pressure, and part at which the pump draws air.
const OIL_LEAK: f64 = 0.02;
const PUMP_DRAWS_AIR: f64 = 0.7;
/// Part of the coolant that a leak takes in a second, and part below which it no longer circulates.
const COOLANT_LEAK: f64 = 0.006;
const CIRCULATES: f64 = 0.5;

/// What works on an engine from outside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Inputs {
    /// The fuel solenoid has its current.
    pub(super) fuel: bool,
    /// There is fuel at the solenoid.
    pub(super) fed: bool,
    /// The starter is engaged: part of its usual speed that the battery gives it.
    pub(super) starter: Option<f64>,
    /// Governor at idle speed.
    pub(super) idle: bool,
    /// Coolant heater on.
    pub(super) heater: bool,
    /// kW at the shaft.
    pub(super) load: f64,
    /// degC of the air around it.
    pub(super) ambient: f64,
}

/// Whether the cylinders catch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ignition {
    Normal,
    Never,
    /// Not before this engagement of the starter since the engine last ran.
    Attempt(u8),
}

/// What is worn or broken.
#[derive(Clone, Debug)]
pub(super) struct Wear {
    ignition: Ignition,
    /// The fuel solenoid does not close.
    pub(super) solenoid_stuck: bool,
    pub(super) oil_leaks: bool,
    pub(super) coolant_leaks: bool,
    pub(super) radiator_blocked: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Engine {
    /// 1/min.
    pub(crate) speed: f64,
    /// Burning fuel and turning by itself.
    pub(crate) firing: bool,
    /// bar.
    pub(crate) oil_pressure: f64,
    /// Part of the oil that is still there.
    pub(crate) oil_level: f64,
    /// degC.
    pub(crate) coolant: f64,
    /// Part of the coolant that is still there.
    pub(crate) coolant_level: f64,
    /// degC.
    pub(crate) oil: f64,
    /// L/h at this moment.
    pub(crate) burn: f64,
    /// L since the controller was fitted.
    pub(crate) burned: f64,
    /// Hours run since the controller was fitted.
    pub(crate) hours: f64,
    pub(crate) governor: Governor,
    pub(super) wear: Wear,
    /// Engagements of the starter since it last ran, or since the ignition was last seen to.
    attempts: u8,
    starter_was_engaged: bool,
    /// Its load has choked it.
    stalled: bool,
    /// Seconds of starter at its usual speed still needed before the first cylinder catches.
    until_fire: f64,
}

impl Engine {
    pub(super) fn new(random: &mut Random) -> Self {
        let hours = random.between(900.0, 2600.0);
        Self {
            speed: 0.0,
            firing: false,
            oil_pressure: 0.0,
            oil_level: 1.0,
            coolant: random.between(38.5, 41.5),
            coolant_level: 1.0,
            oil: random.between(33.0, 36.0),
            burn: 0.0,
            burned: hours * 9.3,
            hours,
            governor: Governor::default(),
            wear: Wear {
                ignition: Ignition::Normal,
                solenoid_stuck: false,
                oil_leaks: false,
                coolant_leaks: false,
                radiator_blocked: false,
            },
            attempts: 0,
            starter_was_engaged: false,
            stalled: false,
            until_fire: random.between(1.0, 2.2),
        }
    }

    pub(crate) fn is_running(&self) -> bool {
        self.firing && self.speed > FIRED_RPM
    }

    pub(super) fn ignition(&self) -> Ignition {
        self.wear.ignition
    }

    /// Somebody has seen to the ignition: attempts count from now on.
    pub(super) fn set_ignition(&mut self, ignition: Ignition) {
        self.wear.ignition = ignition;
        self.attempts = 0;
    }

    /// Somebody has let the oil leak, or has closed the leak and filled up.
    pub(super) fn set_oil_leaks(&mut self, leaks: bool) {
        self.wear.oil_leaks = leaks;
        self.oil_level = 1.0;
    }

    /// As with the oil.
    pub(super) fn set_coolant_leaks(&mut self, leaks: bool) {
        self.wear.coolant_leaks = leaks;
        self.coolant_level = 1.0;
    }

    pub(super) fn step(&mut self, dt: f64, inputs: &Inputs, random: &mut Random) {
        self.turn(dt, inputs, random);
        // A jolt at the shaft is not burned.
        let given = if self.is_running() { inputs.load.clamp(0.0, most_kw(self.speed)) } else { 0.0 };
        self.heat(dt, inputs, given);
        self.leak(dt);

        let thin = 1.0 - 0.004 * (self.oil - 40.0);
        let pressure = (5.4 * self.speed / RATED_RPM * thin).clamp(0.0, 4.9);
        let pumped = (self.oil_level / PUMP_DRAWS_AIR).min(1.0);
        approach(&mut self.oil_pressure, pressure * pumped, 0.8, dt);

        self.burn = match self.is_running() {
            true => 2.6 * self.speed / RATED_RPM + 0.25 * given,
            false => 0.0,
        };
        self.burned += self.burn * dt / 3600.0;
        if self.is_running() {
            self.hours += dt / 3600.0;
        }
    }

    fn turn(&mut self, dt: f64, inputs: &Inputs, random: &mut Random) {
        let engaged = inputs.starter.is_some();
        if engaged && !self.starter_was_engaged && !self.firing {
            self.attempts = self.attempts.saturating_add(1);
            // Cold cylinders take longer.
            self.until_fire = random.between(1.0, 2.2) + 0.04 * (10.0 - self.coolant).max(0.0);
        }
        self.starter_was_engaged = engaged;

        // One that is stuck was opened once.
        let opened = inputs.fuel || self.wear.solenoid_stuck && self.firing;
        let fuel = opened && inputs.fed;
        self.firing &= fuel;
        match (self.firing, inputs.starter) {
            (true, _) => self.run(dt, inputs, random),
            // The starter's pinion overruns: it does not brake what turns faster.
            (false, Some(strength)) if self.speed <= CRANKING_RPM => self.crank(dt, fuel, strength),
            (false, _) => self.coast(dt, fuel),
        }
    }

    fn crank(&mut self, dt: f64, fuel: bool, strength: f64) {
        approach(&mut self.speed, CRANKING_RPM * strength, 0.4, dt);
        if fuel && self.speed > CATCHES_RPM {
            let part = self.speed / CRANKING_RPM;
            self.until_fire -= part * part * dt;
            if self.until_fire <= 0.0 && self.ignites() {
                self.fire();
            }
        }
    }

    fn coast(&mut self, dt: f64, fuel: bool) {
        // Friction: a rolling engine stands after some seconds.
        approach(&mut self.speed, 0.0, 2.0, dt);
        self.speed = (self.speed - 60.0 * dt).max(0.0);
        self.governor.rest();
        // Fuel that comes back to a diesel that still rolls lights it again.
        if fuel && self.speed > FIRED_RPM && !self.stalled && self.ignites() {
            self.fire();
        }
    }

    fn ignites(&self) -> bool {
        match self.wear.ignition {
            Ignition::Normal => true,
            Ignition::Never => false,
            // Who still rolls was not started anew.
            Ignition::Attempt(attempt) => self.attempts >= attempt || self.speed > FIRED_RPM,
        }
    }

    fn fire(&mut self) {
        self.firing = true;
        self.stalled = false;
        self.attempts = 0;
    }

    fn run(&mut self, dt: f64, inputs: &Inputs, random: &mut Random) {
        let target = match inputs.idle {
            true => self.governor.answer(dt, IDLE_RPM, inputs.load, random),
            false => self.governor.answer(dt, RATED_RPM, inputs.load, random),
        };
        let before = self.speed;
        approach(&mut self.speed, target, 0.35, dt);
        self.speed = self.speed.min(before + self.governor.fastest_rise() * dt);

        let surplus = most_kw(before) - inputs.load;
        if surplus < 0.0 {
            // All the fuel there is does not carry the load: the shaft gives what it has stored.
            let part = (before / RATED_RPM).powi(2) + surplus * dt / FLYWHEEL;
            self.speed = self.speed.min(RATED_RPM * part.max(0.0).sqrt());
            self.stalled = self.speed < STALLS_RPM;
            self.firing = !self.stalled;
        }
    }

    /// `given` are the kW that it burns fuel for.
    fn heat(&mut self, dt: f64, inputs: &Inputs, given: f64) {
        // kW into the coolant: a diesel gives it nearly as much as the shaft.
        let combustion = if self.is_running() { 4.0 + 0.55 * given } else { 0.0 };
        let heater = if inputs.heater { 1.8 } else { 0.0 };
        let radiator = if self.wear.radiator_blocked { BLOCKED_RADIATOR } else { RADIATOR };
        let circulating =
            if self.is_running() { (self.coolant_level / CIRCULATES).clamp(0.05, 1.0) } else { 0.0 };
        let (begins, is_open) = THERMOSTAT;
        let open = ((self.coolant - begins) / (is_open - begins)).clamp(0.0, 1.0);
        let cooled = radiator * circulating * open * (self.coolant - inputs.ambient).max(0.0);
        let steam = STEAM * (self.coolant - BOILS_DEGC).max(0.0);
        let casing = 0.03 * (self.coolant - inputs.ambient);
        self.coolant += (combustion + heater - cooled - steam - casing) * dt / HEAT_CAPACITY;

        let hotter = if self.is_running() { 6.0 + 14.0 * given / RATED_KW } else { -4.0 };
        approach(&mut self.oil, self.coolant + hotter, 150.0, dt);
    }

    fn leak(&mut self, dt: f64) {
        if self.wear.oil_leaks {
            // A standing engine only drips.
            let pushed = 0.02 + self.oil_pressure / 4.9;
            self.oil_level = (self.oil_level - OIL_LEAK * pushed * dt).max(0.0);
        }
        if self.wear.coolant_leaks {
            self.coolant_level = (self.coolant_level - COOLANT_LEAK * dt).max(0.0);
        }
    }
}

/// kW with all the fuel there is: the torque first rises as the speed falls, until the turbo gives too little air.
fn most_kw(rpm: f64) -> f64 {
    let part = rpm / RATED_RPM;
    let torque = 1.0 + 0.6 * (1.0 - part).clamp(-0.35, 0.2) - 1.3 * (0.8 - part).max(0.0);
    MOST_KW * part * torque.max(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::governor::Fault;

    const DT: f64 = 0.1;
    const REST: Inputs = Inputs {
        fuel: false,
        fed: true,
        starter: None,
        idle: false,
        heater: false,
        load: 0.0,
        ambient: 20.0,
    };
    const FUEL: Inputs = Inputs { fuel: true, ..REST };
    const CRANK: Inputs = Inputs { starter: Some(1.0), ..FUEL };

    fn run(engine: &mut Engine, inputs: &Inputs, seconds: f64) {
        let mut random = Random::new(5);
        for _ in 0..(seconds / DT) as u32 {
            engine.step(DT, inputs, &mut random);
        }
    }

    fn cold() -> Engine {
        Engine::new(&mut Random::new(1))
    }

    fn running() -> Engine {
        let mut engine = cold();
        run(&mut engine, &CRANK, 5.0);
        run(&mut engine, &FUEL, 10.0);
        engine
    }

    fn under(load: f64) -> Inputs {
        Inputs { load, ..FUEL }
    }

    #[test]
    fn the_starter_alone_never_fires_it() {
        let mut engine = cold();
        run(&mut engine, &Inputs { starter: Some(1.0), ..REST }, 20.0);
        assert!(!engine.firing);
        assert!((engine.speed - CRANKING_RPM).abs() < 1.0, "{}", engine.speed);
    }

    #[test]
    fn it_fires_runs_at_rated_speed_and_stops_without_fuel() {
        let mut engine = running();
        assert!(engine.is_running());
        assert!((engine.speed - RATED_RPM).abs() < 6.0, "{}", engine.speed);
        assert!((3.5..5.0).contains(&engine.oil_pressure), "{}", engine.oil_pressure);

        run(&mut engine, &REST, 12.0);
        assert_eq!(engine.speed, 0.0);
        assert_eq!(engine.burn, 0.0);
        assert!(engine.oil_pressure < 0.1);
    }

    #[test]
    fn a_load_step_dips_the_speed_and_the_governor_brings_it_back() {
        let mut engine = running();
        run(&mut engine, &under(60.0), 0.5);
        assert!(engine.speed < RATED_RPM - 15.0, "{}", engine.speed);
        run(&mut engine, &under(60.0), 8.0);
        assert!((engine.speed - RATED_RPM).abs() < 6.0, "{}", engine.speed);
    }

    #[test]
    fn more_than_it_can_carry_pulls_it_down_and_much_more_stalls_it() {
        let mut engine = running();
        run(&mut engine, &under(98.0), 20.0);
        assert!((engine.speed - RATED_RPM).abs() < 8.0, "{}", engine.speed);
        run(&mut engine, &under(112.0), 2.0);
        assert!((1200.0..1440.0).contains(&engine.speed), "{}", engine.speed);
        run(&mut engine, &FUEL, 10.0);
        assert!((engine.speed - RATED_RPM).abs() < 6.0, "{}", engine.speed);
        run(&mut engine, &under(150.0), 1.7);
        assert!(!engine.firing && engine.speed > FIRED_RPM, "{}", engine.speed);
        run(&mut engine, &FUEL, 10.0);
        assert_eq!(engine.speed, 0.0, "a stalled engine does not come back by itself");
    }

    #[test]
    fn it_warms_up_under_load_and_cools_slowly() {
        let mut engine = running();
        run(&mut engine, &under(50.0), 1200.0);
        assert!((82.0..98.0).contains(&engine.coolant), "{}", engine.coolant);
        let hot = engine.coolant;
        run(&mut engine, &REST, 60.0);
        assert!(engine.coolant < hot && engine.coolant > hot - 5.0, "{}", engine.coolant);
    }

    #[test]
    fn the_thermostat_holds_it_until_the_air_is_too_hot() {
        let coolant = |ambient, load| {
            let mut engine = running();
            run(&mut engine, &Inputs { ambient, ..under(load) }, 2400.0);
            engine.coolant
        };
        let [winter, summer, desert] = [-20.0, 35.0, 65.0].map(|air| coolant(air, 80.0));
        assert!((82.0..90.0).contains(&winter), "{winter}");
        assert!((86.0..95.0).contains(&summer) && summer > winter + 2.0, "{summer} {winter}");
        assert!((95.0..104.0).contains(&desert), "{desert}");
        assert!(coolant(65.0, 100.0) > desert + 5.0);
    }

    #[test]
    fn a_blocked_radiator_or_lost_coolant_overheats_it_as_far_as_it_boils() {
        let mut blocked = running();
        blocked.wear.radiator_blocked = true;
        let mut empty = running();
        empty.set_coolant_leaks(true);
        for engine in [&mut blocked, &mut empty] {
            run(engine, &under(45.0), 900.0);
            assert!((105.0..125.0).contains(&engine.coolant), "{}", engine.coolant);
        }
        assert_eq!(empty.coolant_level, 0.0);
        blocked.wear.radiator_blocked = false;
        run(&mut blocked, &under(45.0), 300.0);
        assert!(blocked.coolant < 95.0, "{}", blocked.coolant);
    }

    #[test]
    fn an_oil_leak_takes_the_pressure_away_over_time_and_filling_up_brings_it_back() {
        let mut engine = running();
        let full = engine.oil_pressure;
        engine.set_oil_leaks(true);
        run(&mut engine, &FUEL, 10.0);
        assert!(engine.oil_pressure > full - 0.3, "{}", engine.oil_pressure);
        run(&mut engine, &FUEL, 60.0);
        let low = engine.oil_pressure;
        assert!(low < 2.5, "{low}");
        run(&mut engine, &FUEL, 120.0);
        assert!(engine.oil_pressure < 0.9 && engine.oil_pressure < low, "{}", engine.oil_pressure);
        engine.set_oil_leaks(false);
        run(&mut engine, &FUEL, 10.0);
        assert!(engine.oil_pressure > full - 0.3);
    }

    #[test]
    fn the_attempt_that_succeeds_is_counted_in_engagements_since_it_last_ran() {
        let mut engine = cold();
        engine.set_ignition(Ignition::Attempt(3));
        for round in 0..2 {
            for attempt in 1..=3 {
                run(&mut engine, &CRANK, 6.0);
                assert_eq!(engine.is_running(), attempt == 3, "round {round}, attempt {attempt}");
                run(&mut engine, if attempt == 3 { &FUEL } else { &REST }, 5.0);
            }
            run(&mut engine, &REST, 15.0);
            assert_eq!(engine.speed, 0.0);
        }
        engine.set_ignition(Ignition::Never);
        run(&mut engine, &CRANK, 60.0);
        assert!(!engine.firing && engine.speed > 200.0);
    }

    #[test]
    fn a_weak_starter_takes_longer_and_a_dead_one_does_nothing() {
        let seconds = |strength| {
            let mut engine = cold();
            let crank = Inputs { starter: Some(strength), ..FUEL };
            (0..300)
                .find(|_| {
                    run(&mut engine, &crank, DT);
                    engine.firing
                })
                .map(|tenths| f64::from(tenths) / 10.0)
        };
        let (strong, weak) = (seconds(1.0).unwrap(), seconds(0.7).unwrap());
        assert!(strong < 3.5 && weak > strong + 0.5, "{strong} {weak}");
        assert_eq!(seconds(0.2), None);
    }

    #[test]
    fn fuel_that_comes_back_to_a_rolling_engine_lights_it_again() {
        let mut engine = running();
        run(&mut engine, &REST, 0.5);
        assert!(!engine.firing && engine.speed > FIRED_RPM);
        run(&mut engine, &FUEL, 5.0);
        assert!(engine.is_running());
        engine.set_ignition(Ignition::Never);
        run(&mut engine, &REST, 0.5);
        run(&mut engine, &FUEL, 15.0);
        assert_eq!(engine.speed, 0.0);
    }

    #[test]
    fn a_sick_governor_hunts_runs_away_or_answers_late() {
        let speeds = |fault, load| {
            let mut engine = running();
            engine.governor.fault = fault;
            let steps = (0..200).map(|_| {
                run(&mut engine, &under(load), DT);
                engine.speed
            });
            let steps: Vec<f64> = steps.collect();
            let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
            (least, steps.iter().copied().fold(0.0, f64::max))
        };
        let (least, most) = speeds(Fault::Hunting, 20.0);
        assert!(least < 1470.0 && most > 1530.0 && most < 1600.0, "{least} {most}");
        let (_, most) = speeds(Fault::RunningAway, 20.0);
        assert!((1900.0..2200.0).contains(&most), "{most}");
        let (dip, _) = speeds(Fault::None, 50.0);
        let (deep, _) = speeds(Fault::Sluggish, 50.0);
        assert!(deep < dip - 40.0, "{deep} {dip}");
    }
}
