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
/// kW of drag at rated speed, and with bearings that bind.
const DRAG: f64 = 8.0;
const BINDING_DRAG: f64 = 36.0;
/// m3/min that a leak lets out at the pressure of the tools, and that pressure in kPa.
const LEAK: f64 = 2.5;
const TOOLS: f64 = 500.0;
/// Part of its air that a clogged filter lets through.
const CLOGGED_FILTER: f64 = 0.78;
/// Times as much is lost across a clogged separator.
const CLOGGED_SEPARATOR: f64 = 5.0;
/// Times as warm the oil comes back from a blocked cooler.
const BLOCKED_COOLER: f64 = 2.2;

/// What the panel does to the air.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Valves {
    /// The screw's intake is open.
    pub(super) intake: bool,
    /// The receiver is vented.
    pub(super) blow_down: bool,
}

/// Where the intake valve is stuck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Intake {
    #[default]
    Free,
    Open,
    Shut,
}

/// What is worn or broken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wear {
    pub(super) intake: Intake,
    pub(super) blow_down_blocked: bool,
    pub(super) receiver_leaks: bool,
    pub(super) filter_clogged: bool,
    pub(super) separator_clogged: bool,
    pub(super) cooler_blocked: bool,
    pub(super) screw_binds: bool,
}

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
    pub(super) wear: Wear,
    pub(super) consumers: Consumers,
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
            wear: Wear::default(),
            consumers: Consumers::new(random),
            separator: random.between(22.0, 38.0),
        }
    }

    /// `speed` is a part of the rated one.
    pub(super) fn step(&mut self, dt: f64, speed: f64, valves: Valves, ambient: f64, random: &mut Random) {
        let demand = self.consumers.step(dt, random);
        // Tools get what they want down to some pressure, and less below it.
        self.consumption = demand * (self.pressure / TOOLS).min(1.0);
        let leak = if self.wear.receiver_leaks { LEAK * self.pressure / TOOLS } else { 0.0 };
        let vents = valves.blow_down && !self.wear.blow_down_blocked;
        let vented = if vents { 0.08 * self.pressure } else { 0.0 };
        let relieved = 2.0 * (self.pressure - SAFETY_VALVE).max(0.0);

        let open = match self.wear.intake {
            Intake::Free => valves.intake,
            Intake::Open => true,
            Intake::Shut => false,
        };
        let filter = if self.wear.filter_clogged { CLOGGED_FILTER } else { 1.0 };
        let slip = 1.0 - 0.00006 * self.pressure;
        // The intake opens slowly and a spring shuts it at once.
        match open {
            true => approach(&mut self.delivery, RATED_DELIVERY * speed * slip * filter, 0.8, dt),
            false => self.delivery = 0.0,
        }
        let filling = (self.delivery - self.consumption - leak) / 60.0 * ATMOSPHERE / RECEIVER;
        self.pressure = (self.pressure + (filling - vented - relieved) * dt).max(0.0);

        let flow = self.delivery / RATED_DELIVERY;
        let clogged = if self.wear.separator_clogged { CLOGGED_SEPARATOR } else { 1.0 };
        approach(&mut self.separator_loss, self.separator * clogged * flow * flow, 0.5, dt);
        let (rise, memory) = match (speed > 0.2, flow > 0.1) {
            (true, true) => (48.0 + 0.03 * self.pressure, 70.0),
            (true, false) => (34.0, 140.0),
            _ => (2.0, 900.0),
        };
        let cooler = if self.wear.cooler_blocked && speed > 0.2 { BLOCKED_COOLER } else { 1.0 };
        approach(&mut self.temperature, ambient + rise * cooler, memory, dt);
    }

    /// kW at the shaft: drag, and the work of polytropic compression.
    pub(crate) fn shaft_power(&self, speed: f64) -> f64 {
        let power = (EXPONENT - 1.0) / EXPONENT;
        // Before the separator stands more than behind it.
        let behind = self.pressure + self.separator_loss;
        let ratio = 1.0 + behind.max(BUILT_IN_PRESSURE) / ATMOSPHERE;
        let work = ATMOSPHERE / power * (ratio.powf(power) - 1.0);
        let drag = if self.wear.screw_binds { BINDING_DRAG } else { DRAG };
        drag * speed * speed + self.delivery / 60.0 * work / EFFICIENCY
    }
}

/// Tools that draw all the time, more or less, and one that starts and stops.
#[derive(Clone, Debug)]
pub(super) struct Consumers {
    /// m3/min at which they are held; none where they come and go.
    pub(super) held: Option<f64>,
    base: Drift,
    blaster_on: bool,
    blaster_switches_in: f64,
}

impl Consumers {
    fn new(random: &mut Random) -> Self {
        Self {
            held: None,
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
        let wanted = 4.4 + blaster + self.base.step(dt, random);
        self.held.unwrap_or(wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(air: &mut Air, speed: f64, intake: bool, blow_down: bool, seconds: u32) -> Vec<f64> {
        let mut random = Random::new(3);
        let steps = (0..10 * seconds).map(|_| {
            air.step(0.1, speed, Valves { intake, blow_down }, 20.0, &mut random);
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

    #[test]
    fn a_stuck_intake_fills_the_receiver_or_never_does() {
        let after = |intake, ordered| {
            let mut air = Air::new(&mut Random::new(1));
            air.wear.intake = intake;
            run(&mut air, 1.0, ordered, false, 120);
            air.pressure
        };
        assert!(after(Intake::Open, false) > 750.0);
        assert_eq!(after(Intake::Shut, true), 0.0);
    }

    #[test]
    fn tools_are_held_a_leak_takes_its_part_and_a_blocked_vent_keeps_the_pressure() {
        let mut tight = Air::new(&mut Random::new(1));
        tight.consumers.held = Some(6.0);
        let mut leaking = tight.clone();
        leaking.wear.receiver_leaks = true;
        for air in [&mut tight, &mut leaking] {
            run(air, 0.8, true, false, 60);
        }
        assert!(leaking.pressure < tight.pressure - 50.0, "{} {}", leaking.pressure, tight.pressure);
        assert!((tight.consumption - 6.0).abs() < 1e-9);

        tight.consumers.held = Some(0.0);
        tight.wear.blow_down_blocked = true;
        let before = tight.pressure;
        run(&mut tight, 0.0, false, true, 60);
        assert_eq!(tight.pressure, before);
    }

    #[test]
    fn dirt_costs_air_pressure_and_power() {
        let loaded = |wear| {
            let mut air = Air { wear, ..Air::new(&mut Random::new(1)) };
            air.consumers.held = Some(9.0);
            run(&mut air, 1.0, true, false, 60);
            air
        };
        let clean = loaded(Wear::default());
        let filter = loaded(Wear { filter_clogged: true, ..Wear::default() });
        let separator = loaded(Wear { separator_clogged: true, ..Wear::default() });
        let screw = loaded(Wear { screw_binds: true, ..Wear::default() });
        assert!(filter.delivery < 0.85 * clean.delivery);
        assert!(separator.separator_loss > 4.0 * clean.separator_loss);
        assert!(separator.shaft_power(1.0) > clean.shaft_power(1.0) + 2.0);
        assert!(screw.shaft_power(1.0) > clean.shaft_power(1.0) + 20.0);
    }

    #[test]
    fn a_blocked_cooler_overheats_the_discharge() {
        let mut air = Air::new(&mut Random::new(1));
        air.wear.cooler_blocked = true;
        run(&mut air, 1.0, true, false, 300);
        assert!((120.0..190.0).contains(&air.temperature), "{}", air.temperature);
    }
}
