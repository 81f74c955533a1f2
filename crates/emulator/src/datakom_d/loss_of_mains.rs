//! How a unit beside the mains notices that they are gone although it feeds their line: by the rate at which their
//! frequency changes, and by the jump of the voltage when the genset is suddenly left with another load.

use crate::plant::{RATED_KW, RATED_VOLTAGE};

use super::readings::Readings;

/// Seconds over which a rate is measured.
const WINDOW: f64 = 0.5;
/// Degrees by which rated active current bends the voltage behind the genset's reactance.
const BEND: f64 = 12.0;

/// V below which a meter tells no power.
const LEAST_VOLTAGE: f64 = 20.0;

/// What the last look saw.
#[derive(Clone, Debug, Default)]
pub(super) struct LossOfMains {
    /// Hz; none while the mains are dead.
    frequency: Option<f64>,
    /// Hz a second.
    rate: f64,
    /// kW that the genset's active current beside the mains would be at its rated voltage.
    carried: Option<f64>,
}

impl LossOfMains {
    /// Adds what follows from two looks. Sources that were joined out of step tell nothing of the mains.
    pub(super) fn step(&mut self, seconds: f64, readings: &mut Readings, jolting: bool) {
        let frequency = readings.mains_alive.then_some(readings.mains_frequency);
        self.rate = match (self.frequency, frequency) {
            (Some(before), Some(now)) => {
                let rate = (now - before) / seconds;
                self.rate + (rate - self.rate) * (seconds / WINDOW).min(1.0)
            }
            _ => 0.0,
        };
        self.frequency = frequency;

        let (least, greatest) = readings.genset_voltage;
        let volts = (0.5 * (least + greatest)).max(LEAST_VOLTAGE);
        // What bends the voltage is the active current.
        let active = readings.genset_active * RATED_VOLTAGE / volts;
        let carried = (readings.side_by_side && !jolting).then_some(active);
        let step = match (self.carried, carried) {
            (Some(before), Some(now)) => now - before,
            _ => 0.0,
        };
        self.carried = carried;
        (readings.rocof, readings.vector_shift) = (self.rate.abs(), BEND * step.abs() / RATED_KW);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(loss: &mut LossOfMains, hertz: f64, kw: f64) -> (f64, f64) {
        let mut readings = Readings {
            mains_alive: hertz > 0.0,
            mains_frequency: hertz,
            side_by_side: true,
            genset_active: kw,
            genset_voltage: (RATED_VOLTAGE, RATED_VOLTAGE),
            ..Readings::default()
        };
        loss.step(0.1, &mut readings, false);
        (readings.rocof, readings.vector_shift)
    }

    #[test]
    fn a_rate_is_that_of_half_a_second_and_dead_mains_have_none() {
        let mut loss = LossOfMains::default();
        let rates: Vec<f64> =
            (0..30).map(|tenth| look(&mut loss, 50.0 + 0.05 * f64::from(tenth), 0.0).0).collect();
        assert!(rates[0] == 0.0 && rates[1] < 0.2, "{rates:?}");
        assert!((rates[29] - 0.5).abs() < 0.01, "{rates:?}");
        assert_eq!(look(&mut loss, 0.0, 0.0).0, 0.0);
        assert_eq!(look(&mut loss, 50.0, 0.0).0, 0.0, "they come back");
    }

    #[test]
    fn a_shift_is_the_moment_at_which_the_load_changes() {
        let mut loss = LossOfMains::default();
        assert_eq!(look(&mut loss, 50.0, 20.0).1, 0.0, "its breaker has just closed");
        assert_eq!(look(&mut loss, 50.0, 60.0).1, 6.0);
        assert_eq!(look(&mut loss, 50.0, 60.0).1, 0.0);
        assert_eq!(look(&mut loss, 50.0, 40.0).1, 3.0);
    }
}
