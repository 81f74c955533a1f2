//! What the engine lives on: starter batteries with their charging, and the day tank.

use crate::random::{Drift, Random, approach};

/// How a battery is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Health {
    Normal,
    /// Old: holds little and gives way under the starter.
    Weak,
    /// Empty, and takes no charge.
    Flat,
}

impl Health {
    /// Ah that it holds.
    fn capacity(self) -> f64 {
        match self {
            Self::Normal => 100.0,
            Self::Weak => 25.0,
            Self::Flat => 5.0,
        }
    }

    /// Part of its capacity in it when it comes to be like this, and at most.
    fn charge(self) -> (f64, f64) {
        match self {
            Self::Normal => (0.96, 1.0),
            Self::Weak => (0.35, 0.5),
            Self::Flat => (0.01, 0.02),
        }
    }
}

/// What happens around a battery.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Service {
    /// The starter is engaged.
    pub(super) cranking: bool,
    /// The engine turns the charge alternator.
    pub(super) running: bool,
    /// The charger has its supply.
    pub(super) supplied: bool,
}

/// A 24 V starter battery.
#[derive(Clone, Debug)]
pub(crate) struct Battery {
    /// V at the terminals.
    pub(crate) voltage: f64,
    /// V at the charge alternator's D+ terminal.
    pub(crate) charge_input: f64,
    /// A into the battery.
    pub(crate) charge_current: f64,
    /// Lowest V of the last cranking.
    pub(crate) cranking_minimum: f64,
    pub(super) charger_failed: bool,
    pub(super) alternator_failed: bool,
    health: Health,
    /// Part of its capacity that is in it.
    charge: f64,
    cranking: bool,
    /// Part of the inrush that still flows: a starter that stands draws most.
    inrush: f64,
    sag: f64,
    ripple: Drift,
}

impl Battery {
    /// A that the starter draws, and that the controls draw all the time.
    const STARTER: f64 = 300.0;
    const CONTROLS: f64 = 2.5;
    /// By what part it gives way deeper when the starter begins to turn.
    const INRUSH: f64 = 0.45;
    /// A that the charger and the charge alternator give at most.
    const CHARGER: f64 = 10.0;
    const ALTERNATOR: f64 = 30.0;

    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            voltage: 27.1,
            charge_input: 0.3,
            charge_current: 0.4,
            cranking_minimum: random.between(19.0, 20.2),
            charger_failed: false,
            alternator_failed: false,
            health: Health::Normal,
            charge: Health::Normal.charge().0,
            cranking: false,
            inrush: 1.0,
            sag: random.between(6.0, 7.2),
            ripple: Drift::new(0.03, 5.0, random),
        }
    }

    pub(super) fn health(&self) -> Health {
        self.health
    }

    /// Somebody has put another battery in, charged as such a one is.
    pub(super) fn set_health(&mut self, health: Health) {
        self.health = health;
        self.charge = health.charge().0;
    }

    /// Part of its usual speed to which it turns the starter.
    pub(super) fn strength(&self) -> f64 {
        ((self.voltage - 9.0) / 10.0).clamp(0.0, 1.0)
    }

    pub(super) fn step(&mut self, dt: f64, service: Service, random: &mut Random) {
        let ripple = self.ripple.step(dt, random);
        let generating = service.running && !self.alternator_failed;
        let charging = service.supplied && !self.charger_failed;
        let rest = self.rest();
        let sag = self.sag * (1.0 + Self::INRUSH * self.inrush) * self.softness();
        approach(&mut self.inrush, if service.cranking { 0.0 } else { 1.0 }, 0.25, dt);
        // A charger that has to give all it can does not reach its voltage.
        let (target, memory) = match (service.cranking, generating, charging) {
            (true, ..) => (rest + 1.5 - sag, 0.15),
            (_, true, _) => (f64::min(28.2, rest + 6.0), 4.0),
            (_, _, true) => (f64::min(27.1, rest + 2.5), 6.0),
            // The starter lets it recover at once; what a charger has put on top goes slowly.
            _ => (rest, if self.voltage < rest { 1.5 } else { 60.0 }),
        };
        approach(&mut self.voltage, (target + ripple).max(2.0), memory, dt);

        if service.cranking && !self.cranking {
            self.cranking_minimum = self.voltage;
        }
        if service.cranking {
            self.cranking_minimum = self.cranking_minimum.min(self.voltage);
        }
        self.cranking = service.cranking;

        let charge_input = match (generating, service.running, service.cranking) {
            (true, ..) => self.voltage - 0.15,
            // The excitation lamp lights through D+ until the alternator gives its voltage.
            (_, true, _) | (.., true) => 1.8,
            _ => 0.3,
        };
        approach(&mut self.charge_input, charge_input, 0.5, dt);
        self.charge(dt, service.cranking, generating, charging);
    }

    fn charge(&mut self, dt: f64, cranking: bool, generating: bool, charging: bool) {
        let (fresh, most) = self.health.charge();
        let empty = (most - self.charge).max(0.0);
        let usual = (empty / (most - fresh)).min(1.0);
        let current = match (cranking, generating, charging) {
            (false, true, _) => {
                (9.0 * usual + 40.0 * (empty - (most - fresh)).max(0.0)).min(Self::ALTERNATOR)
            }
            (false, false, true) => (10.0 * empty).min(Self::CHARGER),
            _ => 0.0,
        };
        approach(&mut self.charge_current, current, 20.0, dt);
        let drawn = match (cranking, generating || charging) {
            (true, _) => Self::STARTER,
            (_, false) => Self::CONTROLS,
            _ => 0.0,
        };
        let amperes = current - drawn;
        self.charge = (self.charge + amperes * dt / 3600.0 / self.health.capacity()).clamp(0.0, most);
    }

    /// V without a load: it falls slowly, and in the end at once.
    fn rest(&self) -> f64 {
        let knee = 0.1;
        match self.charge {
            charge if charge < knee => 12.0 + (10.8 + 2.7 * knee) * charge / knee,
            charge => 22.8 + 2.7 * charge,
        }
    }

    /// How much deeper than a charged one it gives way.
    fn softness(&self) -> f64 {
        1.0 + 0.6 * (1.0 - self.charge / Health::Normal.charge().0).max(0.0)
    }
}

/// The day tank beside the genset, and the line from it to the injection pump.
#[derive(Clone, Debug)]
pub(crate) struct Tank {
    pub(crate) litres: f64,
    /// L/s that somebody else takes out of it.
    pub(crate) other_draw: f64,
    /// The cock in the line is shut.
    pub(super) shut: bool,
    /// The pump that fills it does nothing.
    pub(super) pump_failed: bool,
    /// L in the line.
    line: f64,
}

impl Tank {
    const CAPACITY: f64 = 250.0;
    const PUMP_LITRES_PER_SECOND: f64 = 0.7;
    /// L that the line holds, and that are needed in it for the injection pump to get any.
    const LINE: f64 = 0.012;
    const DRY_LINE: f64 = 0.002;

    pub(crate) fn new(percent: f64) -> Self {
        let mut tank =
            Self { litres: 0.0, other_draw: 0.0, shut: false, pump_failed: false, line: Self::LINE };
        tank.fill_to(percent);
        tank
    }

    pub(crate) fn percent(&self) -> f64 {
        self.litres / Self::CAPACITY * 100.0
    }

    /// Puts fuel in or takes it out.
    pub(super) fn fill_to(&mut self, percent: f64) {
        self.litres = Self::CAPACITY * percent / 100.0;
    }

    /// Whether fuel arrives at the injection pump.
    pub(super) fn feeds(&self) -> bool {
        self.line > Self::DRY_LINE
    }

    /// `burn` in L/h.
    pub(super) fn step(&mut self, dt: f64, burn: f64, pump: bool) {
        self.line = (self.line - burn / 3600.0 * dt).max(0.0);
        let sucked = if self.shut { 0.0 } else { (Self::LINE - self.line).min(self.litres) };
        self.line += sucked;
        let pumped = if pump && !self.pump_failed { Self::PUMP_LITRES_PER_SECOND } else { 0.0 };
        let change = (pumped - self.other_draw) * dt - sucked;
        self.litres = (self.litres + change).clamp(0.0, Self::CAPACITY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CRANKING: Service = Service { cranking: true, running: false, supplied: true };
    const RESTING: Service = Service { cranking: false, running: false, supplied: true };
    const ALONE: Service = Service { cranking: false, running: false, supplied: false };

    fn run(battery: &mut Battery, service: Service, seconds: f64) {
        let mut random = Random::new(3);
        (0..(seconds * 10.0) as u32).for_each(|_| battery.step(0.1, service, &mut random));
    }

    fn battery(health: Health) -> Battery {
        let mut battery = Battery::new(&mut Random::new(1));
        battery.set_health(health);
        run(&mut battery, RESTING, 60.0);
        battery
    }

    #[test]
    fn the_minimum_is_that_of_the_last_cranking() {
        let mut battery = Battery::new(&mut Random::new(1));
        battery.cranking_minimum = 5.0;
        run(&mut battery, CRANKING, 3.0);
        let dip = battery.cranking_minimum;
        assert!((18.5..21.0).contains(&dip), "{dip}");
        assert!(battery.voltage > dip + 0.5, "the inrush is over: {}", battery.voltage);
        run(&mut battery, RESTING, 60.0);
        assert_eq!(battery.cranking_minimum, dip);
        assert!((battery.voltage - 27.1).abs() < 0.2);
    }

    #[test]
    fn a_weak_battery_dips_deeper_and_turns_slower_and_a_flat_one_not_at_all() {
        let crank = |health| {
            let mut battery = battery(health);
            run(&mut battery, CRANKING, 5.0);
            (battery.cranking_minimum, battery.strength())
        };
        let [normal, weak, flat] = [Health::Normal, Health::Weak, Health::Flat].map(crank);
        assert!(normal.1 > 0.95, "{normal:?}");
        assert!(weak.0 < normal.0 - 2.0 && (0.5..0.9).contains(&weak.1), "{weak:?}");
        assert!(flat.0 < 9.0 && flat.1 == 0.0, "{flat:?}");
        assert!(battery(Health::Flat).voltage < 20.0);
    }

    #[test]
    fn it_dies_slowly_without_a_charger_and_recovers_with_one() {
        let mut battery = battery(Health::Normal);
        battery.charger_failed = true;
        run(&mut battery, RESTING, 600.0);
        assert!((24.8..25.8).contains(&battery.voltage), "{}", battery.voltage);
        run(&mut battery, ALONE, 40.0 * 3600.0);
        assert!(battery.voltage < 18.0, "{}", battery.voltage);
        battery.charger_failed = false;
        run(&mut battery, RESTING, 3600.0);
        assert!(battery.charge_current > 3.0 && battery.voltage > 24.0, "{battery:?}");
    }

    #[test]
    fn a_failed_charge_alternator_gives_no_voltage_at_d_plus() {
        let running = Service { running: true, ..ALONE };
        let mut battery = battery(Health::Normal);
        run(&mut battery, running, 60.0);
        assert!(battery.charge_input > 27.0 && battery.voltage > 28.0);
        battery.alternator_failed = true;
        run(&mut battery, running, 300.0);
        assert!(battery.charge_input < 3.0 && battery.voltage < 26.0, "{battery:?}");
    }

    #[test]
    fn a_tank_neither_overflows_nor_goes_below_empty() {
        let mut tank = Tank::new(99.9);
        for _ in 0..600 {
            tank.step(1.0, 0.0, true);
        }
        assert_eq!(tank.percent(), 100.0);
        tank.other_draw = 100.0;
        for _ in 0..600 {
            tank.step(1.0, 0.0, false);
        }
        assert_eq!(tank.percent(), 0.0);
    }

    #[test]
    fn an_engine_lives_on_the_line_for_some_seconds() {
        for empty in [true, false] {
            let mut tank = Tank::new(if empty { 0.0 } else { 50.0 });
            tank.shut = !empty;
            let fed = (0..600).take_while(|_| {
                tank.step(0.1, 10.0, false);
                tank.feeds()
            });
            assert!((20..60).contains(&fed.count()));
            (tank.shut, tank.litres) = (false, 100.0);
            tank.step(0.1, 0.0, false);
            assert!(tank.feeds());
        }
    }
}
