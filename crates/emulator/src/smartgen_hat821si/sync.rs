//! Whether two sources fit each other well enough to be joined when the switch will have closed.

use std::time::Duration;

use crate::settings::Settings;

use super::plant::Meter;
use super::supervision;

/// What a switch takes to close, while the angle goes on turning.
pub(super) const OWN_TIME: Duration = Duration::from_millis(300);

/// What is permitted, as it is set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    loops: bool,
    checks: bool,
    /// Part of the rated voltage.
    voltage: f64,
    /// Hz.
    frequency: f64,
    /// Degrees.
    angle: f64,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        Self {
            loops: settings.is_on("loop_closing"),
            checks: settings.is_on("sync_check"),
            voltage: settings.number("sync_voltage") / 100.0,
            frequency: settings.number("sync_frequency"),
            angle: settings.number("sync_angle"),
        }
    }

    /// Sources that are both good are changed over without a gap.
    pub(super) fn loops(&self) -> bool {
        self.loops
    }
}

/// Follows the angle between the sources.
#[derive(Clone, Debug, Default)]
pub(super) struct Synchroscope {
    /// V and Hz between them, degrees that source 1 leads, and degrees a second that it gains.
    between: Option<Between>,
}

#[derive(Clone, Copy, Debug)]
struct Between {
    volts: f64,
    hertz: f64,
    angle: f64,
    turns: f64,
}

impl Synchroscope {
    pub(super) fn step(&mut self, dt: Duration, meters: [&Meter; 2]) {
        let angles = meters.map(|meter| meter.angles);
        let apart = |phase: usize| {
            let (first, second) = (angles[0][phase]?, angles[1][phase]?);
            Some(half_turn(first - second))
        };
        let same_order = apart(1).zip(apart(0)).is_some_and(|(b, a)| half_turn(b - a).abs() < 1.0);
        let before = self.between;
        self.between = apart(0).filter(|_| same_order).map(|angle| Between {
            volts: (meters[0].feed.average_voltage() - meters[1].feed.average_voltage()).abs(),
            hertz: (meters[0].feed.frequency - meters[1].feed.frequency).abs(),
            angle,
            turns: before.map_or(0.0, |before| half_turn(angle - before.angle) / dt.as_secs_f64()),
        });
    }

    /// They may be joined by a switch that begins to close now.
    pub(super) fn is_in_step(&self, limits: &Limits, supervision: &supervision::Limits) -> bool {
        !limits.checks
            || self.between.is_some_and(|between| {
                let then = half_turn(between.angle + OWN_TIME.as_secs_f64() * between.turns);
                between.volts <= limits.voltage * supervision.rated()
                    && between.hertz <= limits.frequency
                    && then.abs() <= limits.angle
            })
    }
}

/// The same angle from -180 to 180 degrees.
fn half_turn(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Feed;

    fn meter(volts: f64, frequency: f64, degrees: f64) -> Meter {
        Meter {
            feed: Feed { voltage: [volts; 3], frequency, ..Feed::default() },
            current: [0.0; 3],
            angles: [0.0, 240.0, 120.0].map(|behind| Some((degrees + behind).rem_euclid(360.0))),
            residual: (0.0, 0.0),
            power: 0.0,
        }
    }

    fn fits(first: [&Meter; 2], then: [&Meter; 2], set: &[(&str, &str)]) -> bool {
        let mut settings = super::super::tests::settings();
        set.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
        let mut scope = Synchroscope::default();
        scope.step(Duration::from_millis(100), first);
        scope.step(Duration::from_millis(100), then);
        scope.is_in_step(&Limits::of(&settings), &supervision::Limits::of(&settings))
    }

    #[test]
    fn voltage_frequency_and_angle_have_to_fit() {
        let still = meter(5774.0, 50.0, 5.0);
        for (name, other, expected) in [
            ("alike", meter(5774.0, 50.0, 1.0), true),
            ("over the turn", meter(5774.0, 50.0, 357.0), true),
            ("too far apart", meter(5774.0, 50.0, 16.0), false),
            ("opposite", meter(5774.0, 50.0, 185.0), false),
            ("too low", meter(5300.0, 50.0, 5.0), false),
            ("too slow", meter(5774.0, 49.4, 5.0), false),
            ("dead", Meter { angles: [None; 3], ..meter(0.0, 0.0, 5.0) }, false),
            ("reversed", Meter { angles: [Some(5.0), Some(125.0), Some(245.0)], ..still.clone() }, false),
        ] {
            assert_eq!(fits([&still, &other], [&still, &other], &[]), expected, "{name}");
            assert!(fits([&still, &other], [&still, &other], &[("sync_check", "0")]), "{name}");
        }
    }

    #[test]
    fn the_switch_is_closed_ahead_of_the_angle() {
        // A third of a turn a second: 36 degrees in the time of the switch.
        let still = meter(5774.0, 50.0, 0.0);
        let [before, now] = [312.0, 324.0].map(|degrees| meter(5774.0, 50.33, degrees));
        assert!(fits([&before, &still], [&now, &still], &[]));
        let [before, now] = [348.0, 0.0].map(|degrees| meter(5774.0, 50.33, degrees));
        assert!(!fits([&before, &still], [&now, &still], &[]), "it would be past");
    }
}
