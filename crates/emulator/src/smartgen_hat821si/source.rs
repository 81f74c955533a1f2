//! Whether a source is good enough: what is wrong with it at once, and what counts after its delays.

use std::time::Duration;

use crate::plant::Feed;

use super::plant::PHASE_VOLTAGE;

/// Seconds that a source must be bad before it is given up: shorter dips transfer nothing.
const GIVE_UP: Duration = Duration::from_secs(5);
/// Seconds that it must be good before it is trusted again.
const TRUST: Duration = Duration::from_secs(10);

/// Thresholds as a site would set them; the manual has none. Voltages as parts of the rated one.
const DEAD: f64 = 0.2;
const UNDER_VOLTAGE: f64 = 0.80;
const OVER_VOLTAGE: f64 = 1.20;
/// A source that was bad must come this much nearer before it counts as good.
const VOLTAGE_RETURN: f64 = 0.05;
const UNDER_FREQUENCY: f64 = 45.0;
const OVER_FREQUENCY: f64 = 55.0;
const FREQUENCY_RETURN: f64 = 0.5;

/// What is sensed at this moment, with its code in registers 1088 and 1090. Reverse phase sequence (9) and reverse
/// power (10) need a wrong connection and an infeed, which this plant does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(super) enum Condition {
    Normal = 2,
    Blackout = 3,
    OverVoltage = 4,
    UnderVoltage = 5,
    OverFrequency = 6,
    UnderFrequency = 7,
    LossOfPhase = 8,
}

impl Condition {
    /// `margin` is the part of the way back that a source in doubt has to make.
    fn of(feed: &Feed, margin: f64) -> Self {
        let parts = feed.voltage.map(|volts| volts / PHASE_VOLTAGE);
        let (volts, hertz) = (VOLTAGE_RETURN * margin, FREQUENCY_RETURN * margin);
        if parts.iter().all(|part| *part < DEAD) {
            Self::Blackout
        } else if parts.iter().any(|part| *part < DEAD) {
            Self::LossOfPhase
        } else if parts.iter().any(|part| *part < UNDER_VOLTAGE + volts) {
            Self::UnderVoltage
        } else if parts.iter().any(|part| *part > OVER_VOLTAGE - volts) {
            Self::OverVoltage
        } else if feed.frequency < UNDER_FREQUENCY + hertz {
            Self::UnderFrequency
        } else if feed.frequency > OVER_FREQUENCY - hertz {
            Self::OverFrequency
        } else {
            Self::Normal
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Judgement {
    Good,
    /// Bad, not yet for long enough.
    Doubted,
    Bad,
    /// Good again, not yet for long enough.
    Returning,
}

/// The controller's opinion of one source.
#[derive(Clone, Debug)]
pub(super) struct Supervision {
    condition: Condition,
    judgement: Judgement,
    timer: Duration,
}

impl Supervision {
    /// A source that has been good for long.
    pub(super) fn new() -> Self {
        Self { condition: Condition::Normal, judgement: Judgement::Good, timer: Duration::ZERO }
    }

    pub(super) fn step(&mut self, dt: Duration, feed: &Feed) {
        let margin = f64::from(u8::from(self.judgement != Judgement::Good));
        self.condition = Condition::of(feed, margin);
        self.timer = self.timer.saturating_sub(dt);
        let normal = self.condition == Condition::Normal;
        let elapsed = self.timer.is_zero();
        (self.judgement, self.timer) = match self.judgement {
            Judgement::Good if !normal => (Judgement::Doubted, GIVE_UP),
            Judgement::Doubted if normal => (Judgement::Good, Duration::ZERO),
            Judgement::Doubted if elapsed => (Judgement::Bad, Duration::ZERO),
            Judgement::Bad if normal => (Judgement::Returning, TRUST),
            Judgement::Returning if !normal => (Judgement::Bad, Duration::ZERO),
            Judgement::Returning if elapsed => (Judgement::Good, Duration::ZERO),
            same => (same, self.timer),
        };
    }

    /// Whether a switch may close onto it.
    pub(super) fn is_available(&self) -> bool {
        matches!(self.judgement, Judgement::Good | Judgement::Doubted)
    }

    /// Register 1088 or 1090: the delays under their own codes, otherwise what is sensed.
    pub(super) fn status(&self) -> u16 {
        match self.judgement {
            Judgement::Returning => 0,
            Judgement::Doubted => 1,
            Judgement::Good | Judgement::Bad => self.condition as u16,
        }
    }

    /// Register 1089 or 1091.
    pub(super) fn seconds_left(&self) -> u64 {
        self.timer.as_millis().div_ceil(1000) as u64
    }

    /// Bits of word 501 or 502: the kinds follow what is sensed once the source is given up.
    pub(super) fn bits(&self) -> impl Iterator<Item = u16> + use<> {
        let available = self.is_available();
        let abnormal = self.condition != Condition::Normal;
        let kind = (!available && abnormal).then_some(self.condition as u16 + 5);
        let bits = [(0, available), (1, !available), (2, abnormal)];
        bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).chain(kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn feed(parts: [f64; 3], frequency: f64) -> Feed {
        Feed { voltage: parts.map(|part| part * PHASE_VOLTAGE), frequency, ..Feed::default() }
    }

    fn good() -> Feed {
        feed([1.0; 3], 50.0)
    }

    #[test]
    fn each_fault_has_its_code_and_its_bit() {
        for (name, feed, status, bit) in [
            ("blackout", Feed::default(), 3, 8),
            ("over voltage", feed([1.3; 3], 50.0), 4, 9),
            ("under voltage", feed([0.7, 1.0, 1.0], 50.0), 5, 10),
            ("over frequency", feed([1.0; 3], 56.0), 6, 11),
            ("under frequency", feed([1.0; 3], 44.0), 7, 12),
            ("loss of phase", feed([1.0, 0.0, 1.0], 50.0), 8, 13),
        ] {
            let mut source = Supervision::new();
            source.step(SECOND, &feed);
            assert_eq!(
                (source.status(), source.seconds_left(), source.is_available()),
                (1, 5, true),
                "{name}"
            );
            assert_eq!(source.bits().collect::<Vec<_>>(), [0, 2], "{name}");
            for _ in 0..5 {
                source.step(SECOND, &feed);
            }
            assert_eq!((source.status(), source.is_available()), (status, false), "{name}");
            assert_eq!(source.bits().collect::<Vec<_>>(), [1, 2, bit], "{name}");
        }
    }

    #[test]
    fn a_short_dip_is_forgiven_and_a_return_is_waited_for() {
        let mut source = Supervision::new();
        for _ in 0..4 {
            source.step(SECOND, &Feed::default());
        }
        source.step(SECOND, &good());
        assert_eq!((source.status(), source.is_available()), (2, true));

        for _ in 0..7 {
            source.step(SECOND, &Feed::default());
        }
        source.step(SECOND, &good());
        assert_eq!((source.status(), source.seconds_left()), (0, 10));
        source.step(SECOND, &Feed::default());
        assert_eq!(source.status(), 3, "not yet trusted, bad again");
        let mut waited = 0;
        while !source.is_available() {
            source.step(SECOND, &good());
            waited += 1;
        }
        assert_eq!((waited, source.status()), (11, 2));
        assert_eq!(source.bits().collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn a_source_that_was_low_must_come_back_by_the_margin() {
        let mut source = Supervision::new();
        for _ in 0..7 {
            source.step(SECOND, &feed([0.79; 3], 50.0));
        }
        source.step(SECOND, &feed([0.83; 3], 50.0));
        assert_eq!(source.status(), 5);
        source.step(SECOND, &feed([0.86; 3], 50.0));
        assert_eq!(source.status(), 0);
    }
}
