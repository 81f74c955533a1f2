//! Compressed air: the oil-flooded screw, the receiver behind it and the tools that draw from it.

use crate::random::{Drift, Random, approach};

/// kPa.
const ATMOSPHERE: f64 = 100.0;
/// m3/min of free air at rated speed.
const RATED_DELIVERY: f64 = 10.5;
/// m3 of the receiver with the pipes to it.
const RECEIVER: f64 = 0.8;
/// kPa at which the safety valve lifts.
const SAFETY_VALVE: f64 = 1000.0;
/// The screw compresses to this at least, whatever stands behind it: its ports are where they are. kPa.
const BUILT_IN_PRESSURE: f64 = 250.0;
/// Polytropic exponent of air in an oil-flooded screw.
const EXPONENT: f64 = 1.35;
const EFFICIENCY: f64 = 0.8;

/// What stands behind the intake valve.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    /// kPa above the atmosphere at the discharge.
    pub(crate) pressure: f64,
    /// degC at the discharge.
    pub(crate) temperature: f64,
    /// kPa lost across the oil separator.
    pub(crate) separator_loss: f64,
    /// m3/min of free air from the screw.
    pub(crate) delivery: f64,
    /// m3/min of free air to the site.
    pub(crate) consumption: f64,
    consumers: Consumers,
    /// kPa lost across the separator at rated delivery: it clogs over the months.
    separator: f64,
}

impl Air {
    pub(crate) fn new(random: &mut Random) -> Self {
        Self {
            pressure: 0.0,
            temperature: random.between(24.0, 30.0),
            separator_loss: 0.0,
            delivery: 0.0,
            consumption: 0.0,
            consumers: Consumers::new(random),
            separator: random.between(22.0, 38.0),
        }
    }

    /// `speed` is a part of the rated one.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        speed: f64,
        intake: bool,
        blow_down: bool,
        ambient: f64,
        random: &mut Random,
    ) {
        let demand = self.consumers.step(dt, random);
        // Tools get what they want down to some pressure, and less below it.
        self.consumption = demand * (self.pressure / 500.0).min(1.0);
        let vented = if blow_down { 0.08 * self.pressure } else { 0.0 };
        let relieved = 2.0 * (self.pressure - SAFETY_VALVE).max(0.0);

        // The intake opens slowly and a spring shuts it at once.
        let slip = 1.0 - 0.00006 * self.pressure;
        match intake {
            true => approach(&mut self.delivery, RATED_DELIVERY * speed * slip, 0.8, dt),
            false => self.delivery = 0.0,
        }
        let filling = (self.delivery - self.consumption) / 60.0 * ATMOSPHERE / RECEIVER;
        self.pressure = (self.pressure + (filling - vented - relieved) * dt).max(0.0);

        let flow = self.delivery / RATED_DELIVERY;
        approach(&mut self.separator_loss, self.separator * flow * flow, 0.5, dt);
        let (rise, memory) = match (speed > 0.2, flow > 0.1) {
            (true, true) => (48.0 + 0.03 * self.pressure, 70.0),
            (true, false) => (34.0, 140.0),
            _ => (2.0, 900.0),
        };
        approach(&mut self.temperature, ambient + rise, memory, dt);
    }

    /// kW at the shaft: drag, and the work of polytropic compression.
    pub(crate) fn shaft_power(&self, speed: f64) -> f64 {
        let power = (EXPONENT - 1.0) / EXPONENT;
        let ratio = 1.0 + self.pressure.max(BUILT_IN_PRESSURE) / ATMOSPHERE;
        let work = ATMOSPHERE / power * (ratio.powf(power) - 1.0);
        8.0 * speed * speed + self.delivery / 60.0 * work / EFFICIENCY
    }
}

/// Tools that draw all the time, more or less, and one that starts and stops.
#[derive(Clone, Debug)]
struct Consumers {
    base: Drift,
    blaster_on: bool,
    blaster_switches_in: f64,
}

impl Consumers {
    fn new(random: &mut Random) -> Self {
        Self {
            base: Drift::new(0.6, 40.0, random),
            blaster_on: false,
            blaster_switches_in: random.between(15.0, 40.0),
        }
    }

    /// m3/min of free air.
    fn step(&mut self, dt: f64, random: &mut Random) -> f64 {
        self.blaster_switches_in -= dt;
        if self.blaster_switches_in <= 0.0 {
            self.blaster_on = !self.blaster_on;
            self.blaster_switches_in = random.between(15.0, 45.0);
        }
        let blaster = if self.blaster_on { 2.6 } else { 0.0 };
        4.4 + blaster + self.base.step(dt, random)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(air: &mut Air, speed: f64, intake: bool, blow_down: bool, seconds: u32) -> Vec<f64> {
        let mut random = Random::new(3);
        let steps = (0..10 * seconds).map(|_| {
            air.step(0.1, speed, intake, blow_down, 20.0, &mut random);
            air.pressure
        });
        steps.collect()
    }

    #[test]
    fn an_open_intake_fills_the_receiver_and_a_shut_one_lets_the_site_empty_it() {
        let mut air = Air::new(&mut Random::new(1));
        run(&mut air, 1.0, true, false, 120);
        assert!(air.pressure > 750.0, "{}", air.pressure);
        assert!((60.0..80.0).contains(&air.shaft_power(1.0)), "{}", air.shaft_power(1.0));
        assert!((15.0..40.0).contains(&air.separator_loss));

        let falling = run(&mut air, 1.0, false, false, 20);
        assert!(falling.windows(2).all(|pair| pair[1] < pair[0]));
        assert_eq!(air.delivery, 0.0);
        assert!(air.shaft_power(1.0) < 10.0);
    }

    #[test]
    fn blowing_down_empties_it_and_it_never_goes_below_the_atmosphere() {
        let mut air = Air::new(&mut Random::new(1));
        air.pressure = 750.0;
        run(&mut air, 0.0, false, true, 20);
        assert!(air.pressure < 200.0, "{}", air.pressure);
        run(&mut air, 0.0, false, true, 600);
        assert!((0.0..0.5).contains(&air.pressure));
    }

    #[test]
    fn the_safety_valve_holds_against_the_screw() {
        let mut air = Air::new(&mut Random::new(1));
        run(&mut air, 1.0, true, false, 1200);
        assert!(air.pressure < SAFETY_VALVE + 20.0, "{}", air.pressure);
    }

    #[test]
    fn the_discharge_is_hot_on_load_and_forgets_it_slowly() {
        let mut air = Air::new(&mut Random::new(1));
        run(&mut air, 1.0, true, false, 300);
        let hot = air.temperature;
        assert!((75.0..105.0).contains(&hot), "{hot}");
        run(&mut air, 0.0, false, true, 60);
        assert!((hot - 10.0..hot).contains(&air.temperature), "{}", air.temperature);
    }
}
