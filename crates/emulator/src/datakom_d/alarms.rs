//! The three alarm arrays of a D-series unit, by the manual's bit numbers.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::Plant;

const HIGH_ENGINE_TEMPERATURE: u16 = 57;
const LOW_FUEL_LEVEL: u16 = 58;
const LOW_BATTERY_VOLTAGE: u16 = 96;
const FAIL_TO_START: u16 = 98;
const LOW_CHARGE_VOLTAGE: u16 = 100;
/// Those of services 2 and 3 follow.
pub(super) const SERVICE_1_REQUEST: u16 = 118;

/// How long the horn sounds for a new alarm.
const HORN: Duration = Duration::from_secs(30);

/// What is wrong now, by class.
#[derive(Clone, Debug, Default)]
pub(super) struct Alarms {
    pub(super) shutdown: BitSet,
    pub(super) load_dump: BitSet,
    pub(super) warning: BitSet,
    horn: Duration,
    pending: [Duration; WARNINGS.len()],
}

impl Alarms {
    pub(super) fn step(&mut self, dt: Duration, plant: &Plant, failed_to_start: bool) {
        let before = self.count();
        self.horn = self.horn.saturating_sub(dt);
        for (watch, pending) in WARNINGS.iter().zip(&mut self.pending) {
            let active = self.warning.contains(watch.bit);
            let judged = (watch.judge)(plant);
            // An alarm needs its cause for the whole delay, and goes when the cause is clearly gone.
            *pending = if judged == Verdict::Alarm { *pending + dt } else { Duration::ZERO };
            self.warning.set(
                watch.bit,
                match judged {
                    Verdict::Alarm => active || *pending >= watch.delay,
                    Verdict::Between => active,
                    Verdict::Fine => false,
                },
            );
        }
        self.shutdown.set(FAIL_TO_START, failed_to_start);
        if self.count() > before {
            self.horn = HORN;
        }
    }

    pub(super) fn horn(&self) -> bool {
        !self.horn.is_zero()
    }

    fn count(&self) -> usize {
        self.shutdown.len() + self.load_dump.len() + self.warning.len()
    }
}

/// A value watched against a threshold.
struct Watch {
    bit: u16,
    delay: Duration,
    judge: fn(&Plant) -> Verdict,
}

/// Thresholds and delays as a site would set them; the manual has none.
const WARNINGS: [Watch; 4] = [
    Watch {
        bit: LOW_FUEL_LEVEL,
        delay: Duration::from_secs(2),
        judge: |plant| below(plant.tank.percent(), 20.0, 22.0),
    },
    Watch {
        bit: HIGH_ENGINE_TEMPERATURE,
        delay: Duration::from_secs(3),
        judge: |plant| below(-plant.engine.coolant, -98.0, -95.0),
    },
    Watch {
        bit: LOW_BATTERY_VOLTAGE,
        delay: Duration::from_secs(10),
        judge: |plant| below(plant.batteries[0].voltage, 24.0, 24.5),
    },
    Watch {
        bit: LOW_CHARGE_VOLTAGE,
        delay: Duration::from_secs(10),
        judge: |plant| match plant.engine.is_running() {
            true => below(plant.batteries[0].charge_input, 20.0, 22.0),
            false => Verdict::Fine,
        },
    },
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Alarm,
    /// Inside the hysteresis: stays what it is.
    Between,
    Fine,
}

fn below(value: f64, alarm: f64, fine: f64) -> Verdict {
    match value {
        value if value < alarm => Verdict::Alarm,
        value if value < fine => Verdict::Between,
        _ => Verdict::Fine,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn low_fuel_needs_its_delay_and_its_hysteresis() {
        let mut plant = Plant::new(1);
        let mut alarms = Alarms::default();
        let mut at = |alarms: &mut Alarms, percent| {
            plant.tank = Tank::new(percent);
            alarms.step(SECOND, &plant, false);
            alarms.warning.contains(LOW_FUEL_LEVEL)
        };
        assert!(!at(&mut alarms, 19.0));
        assert!(!at(&mut alarms, 21.0), "a dip shorter than the delay is none");
        assert!(!at(&mut alarms, 19.0));
        assert!(at(&mut alarms, 19.0));
        assert!(alarms.horn());
        assert!(at(&mut alarms, 21.0));
        assert!(!at(&mut alarms, 23.0));
    }

    #[test]
    fn fail_to_start_is_a_shutdown() {
        let mut alarms = Alarms::default();
        alarms.step(SECOND, &Plant::new(1), true);
        assert_eq!(alarms.shutdown.iter().collect::<Vec<_>>(), [FAIL_TO_START]);
        assert!(alarms.warning.is_empty());
    }
}
