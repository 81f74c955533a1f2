//! Whether a source is good enough: what is wrong with it at once, and what counts after its delays.

use std::time::Duration;

use crate::settings::Settings;

use super::diagram::Edge;
use super::plant::Meter;
use super::timer::Countdown;

/// Part of the rated voltage below which a phase counts as missing, and one to be told apart by its current.
const MISSING: f64 = 0.2;

/// Thresholds and delays, as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    /// V from phase to neutral.
    rated: f64,
    /// Parts of the rated voltage: low and high, and what a source that was bad must come back to.
    voltage: Band,
    /// Hz, likewise.
    frequency: Band,
    order: bool,
    normal: [Duration; 2],
    abnormal: [Duration; 2],
}

#[derive(Clone, Debug, Default)]
struct Band {
    low: f64,
    low_return: f64,
    high: f64,
    high_return: f64,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        let part = |id| settings.number(id) / 100.0;
        Self {
            rated: settings.number("rated_voltage") / 3.0_f64.sqrt(),
            voltage: Band {
                low: part("under_voltage"),
                low_return: part("under_voltage_return"),
                high: part("over_voltage"),
                high_return: part("over_voltage_return"),
            },
            frequency: Band {
                low: settings.number("under_frequency"),
                low_return: settings.number("under_frequency_return"),
                high: settings.number("over_frequency"),
                high_return: settings.number("over_frequency_return"),
            },
            order: settings.is_on("phase_sequence_check"),
            normal: [settings.seconds("s1_normal_delay"), settings.seconds("s2_normal_delay")],
            abnormal: [settings.seconds("s1_abnormal_delay"), settings.seconds("s2_abnormal_delay")],
        }
    }

    /// V from phase to neutral that the percentages are of.
    pub(super) fn rated(&self) -> f64 {
        self.rated
    }

    /// Whether a voltage counts as missing.
    pub(super) fn is_missing(&self, volts: f64) -> bool {
        volts < MISSING * self.rated
    }
}

impl Band {
    /// Below it, above it, or neither; `returning` asks for the narrower one.
    fn leaves(&self, value: f64, returning: bool) -> Option<Side> {
        let (low, high) = if returning { (self.low_return, self.high_return) } else { (self.low, self.high) };
        if value < low {
            Some(Side::Below)
        } else if value > high {
            Some(Side::Above)
        } else {
            None
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Below,
    Above,
}

/// What is sensed at this moment, with its code in registers 1088 and 1090.
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
    ReverseSequence = 9,
    ReversePower = 10,
}

/// What a source is judged by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed<'a> {
    pub(super) meter: &'a Meter,
    /// The phase whose voltage is missing only because its wire is broken.
    pub(super) broken_wire: Option<usize>,
    /// Power flows back into it, or did until its switch was opened for that.
    pub(super) reverse_power: bool,
    /// The genset that stood in for its ill mains has just gone.
    pub(super) lost: bool,
}

impl Condition {
    fn of(sensed: Sensed<'_>, limits: &Limits, returning: bool) -> Self {
        let feed = &sensed.meter.feed;
        let known = (0..3).filter(|phase| sensed.broken_wire != Some(*phase));
        let parts: Vec<f64> = known.map(|phase| feed.voltage[phase] / limits.rated).collect();
        let side =
            |which: Side| parts.iter().any(|part| limits.voltage.leaves(*part, returning) == Some(which));
        let frequency = limits.frequency.leaves(feed.frequency, returning);
        if parts.iter().all(|part| *part < MISSING) {
            Self::Blackout
        } else if parts.iter().any(|part| *part < MISSING) {
            Self::LossOfPhase
        } else if side(Side::Below) {
            Self::UnderVoltage
        } else if side(Side::Above) {
            Self::OverVoltage
        } else if frequency == Some(Side::Below) {
            Self::UnderFrequency
        } else if frequency == Some(Side::Above) {
            Self::OverFrequency
        } else if limits.order && is_reversed(sensed.meter) {
            Self::ReverseSequence
        } else if sensed.reverse_power {
            Self::ReversePower
        } else {
            Self::Normal
        }
    }
}

/// Whether phase B follows a third of a turn after phase C.
fn is_reversed(meter: &Meter) -> bool {
    match meter.angles {
        [Some(a), Some(b), _] => (a - b).rem_euclid(360.0) > 180.0,
        _ => false,
    }
}

/// The controller's opinion of one source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judgement {
    Good,
    /// Bad, not yet for long enough.
    Doubted,
    Bad,
    /// Good again, not yet for long enough.
    Returning,
}

impl Judgement {
    /// Every way from one to another, with what leads there.
    pub(super) const WAYS: &[Edge<Self>] = &[
        Edge::new(Self::Good, Self::Doubted, "outside its limits"),
        Edge::new(Self::Doubted, Self::Good, "within them again"),
        Edge::new(Self::Good, Self::Bad, "its genset gone"),
        Edge::new(Self::Doubted, Self::Bad, "abnormal delay over, or its genset gone"),
        Edge::new(Self::Bad, Self::Returning, "within the return limits"),
        Edge::new(Self::Returning, Self::Bad, "outside them again"),
        Edge::new(Self::Returning, Self::Good, "normal delay over"),
    ];
}

#[derive(Clone, Debug)]
pub(super) struct Supervision {
    /// 0 for source 1, 1 for source 2.
    source: usize,
    condition: Condition,
    judgement: Judgement,
    timer: Countdown,
}

impl Supervision {
    /// A source that has been good for long.
    pub(super) fn new(source: usize) -> Self {
        Self { source, condition: Condition::Normal, judgement: Judgement::Good, timer: Countdown::default() }
    }

    pub(super) fn step(&mut self, dt: Duration, sensed: Sensed<'_>, limits: &Limits) {
        let returning = self.judgement != Judgement::Good;
        self.condition = Condition::of(sensed, limits, returning);
        self.timer.step(dt);
        let normal = self.condition == Condition::Normal;
        let elapsed = self.timer.is_over();
        match self.judgement {
            Judgement::Good | Judgement::Doubted if sensed.lost => {
                self.enter(Judgement::Bad, Duration::ZERO);
            }
            Judgement::Good if !normal => self.enter(Judgement::Doubted, limits.abnormal[self.source]),
            Judgement::Doubted if normal => self.enter(Judgement::Good, Duration::ZERO),
            Judgement::Doubted if elapsed => self.enter(Judgement::Bad, Duration::ZERO),
            Judgement::Bad if normal => self.enter(Judgement::Returning, limits.normal[self.source]),
            Judgement::Returning if !normal => self.enter(Judgement::Bad, Duration::ZERO),
            Judgement::Returning if elapsed => self.enter(Judgement::Good, Duration::ZERO),
            _ => {}
        }
    }

    fn enter(&mut self, next: Judgement, delay: Duration) {
        debug_assert!(
            Edge::cause(Judgement::WAYS, self.judgement, next).is_some(),
            "{:?} {next:?}",
            self.judgement
        );
        self.judgement = next;
        self.timer = Countdown::of(delay);
    }

    /// Whether a switch may close onto it.
    pub(super) fn is_available(&self) -> bool {
        matches!(self.judgement, Judgement::Good | Judgement::Doubted)
    }

    /// Nothing is wrong with it, not even for a moment.
    pub(super) fn is_faultless(&self) -> bool {
        self.judgement == Judgement::Good
    }

    /// All its phases are there, whatever else is wrong.
    pub(super) fn has_phases(&self) -> bool {
        !matches!(self.condition, Condition::Blackout | Condition::LossOfPhase)
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
    pub(super) fn seconds_left(&self) -> u16 {
        self.timer.seconds()
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
    use crate::plant::Feed;

    const SECOND: Duration = Duration::from_secs(1);

    fn limits() -> Limits {
        Limits::of(&super::super::tests::settings())
    }

    fn meter(parts: [f64; 3], frequency: f64) -> Meter {
        let voltage = parts.map(|part| part * limits().rated());
        let feed = Feed { voltage, frequency, ..Feed::default() };
        let angles = [Some(10.0), Some(250.0), Some(130.0)];
        Meter { feed, current: [0.0; 3], angles, residual: (0.0, 0.0), power: 0.0 }
    }

    fn good() -> Meter {
        meter([1.0; 3], 50.0)
    }

    fn step(source: &mut Supervision, meter: &Meter) {
        let sensed = Sensed { meter, broken_wire: None, reverse_power: false, lost: false };
        source.step(SECOND, sensed, &limits());
    }

    #[test]
    fn each_fault_has_its_code_and_its_bit() {
        let reversed = Meter { angles: [Some(10.0), Some(130.0), Some(250.0)], ..good() };
        for (name, meter, status, bit) in [
            ("blackout", meter([0.0; 3], 0.0), 3, 8),
            ("over voltage", meter([1.3; 3], 50.0), 4, 9),
            ("under voltage", meter([0.7, 1.0, 1.0], 50.0), 5, 10),
            ("over frequency", meter([1.0; 3], 56.0), 6, 11),
            ("under frequency", meter([1.0; 3], 44.0), 7, 12),
            ("loss of phase", meter([1.0, 0.0, 1.0], 50.0), 8, 13),
            ("reverse sequence", reversed, 9, 14),
        ] {
            let mut source = Supervision::new(0);
            step(&mut source, &meter);
            assert_eq!(
                (source.status(), source.seconds_left(), source.is_available()),
                (1, 5, true),
                "{name}"
            );
            assert_eq!(source.bits().collect::<Vec<_>>(), [0, 2], "{name}");
            for _ in 0..5 {
                step(&mut source, &meter);
            }
            assert_eq!((source.status(), source.is_available()), (status, false), "{name}");
            assert_eq!(source.bits().collect::<Vec<_>>(), [1, 2, bit], "{name}");
        }
    }

    #[test]
    fn power_that_flows_back_is_a_fault_of_the_source() {
        let mut source = Supervision::new(0);
        let meter = good();
        for _ in 0..6 {
            let sensed = Sensed { meter: &meter, broken_wire: None, reverse_power: true, lost: false };
            source.step(SECOND, sensed, &limits());
        }
        assert_eq!((source.status(), source.bits().collect::<Vec<_>>()), (10, vec![1, 2, 15]));
    }

    #[test]
    fn without_the_genset_that_stood_in_nobody_waits() {
        let mut source = Supervision::new(0);
        let dead = meter([0.0; 3], 0.0);
        let sensed = Sensed { meter: &dead, broken_wire: None, reverse_power: false, lost: true };
        source.step(SECOND, sensed, &limits());
        assert_eq!((source.status(), source.is_available()), (3, false));
    }

    #[test]
    fn a_broken_wire_is_no_missing_phase() {
        let mut source = Supervision::new(0);
        let meter = meter([1.0, 0.0, 1.0], 50.0);
        for _ in 0..10 {
            let sensed = Sensed { meter: &meter, broken_wire: Some(1), reverse_power: false, lost: false };
            source.step(SECOND, sensed, &limits());
        }
        assert_eq!((source.status(), source.is_available()), (2, true));
    }

    #[test]
    fn a_short_dip_is_forgiven_and_a_return_is_waited_for() {
        let mut source = Supervision::new(1);
        let dead = meter([0.0; 3], 0.0);
        for _ in 0..4 {
            step(&mut source, &dead);
        }
        step(&mut source, &good());
        assert_eq!((source.status(), source.is_available()), (2, true));

        for _ in 0..7 {
            step(&mut source, &dead);
        }
        step(&mut source, &good());
        assert_eq!((source.status(), source.seconds_left()), (0, 10));
        step(&mut source, &dead);
        assert_eq!(source.status(), 3, "not yet trusted, bad again");
        let mut waited = 0;
        while !source.is_available() {
            step(&mut source, &good());
            waited += 1;
        }
        assert_eq!((waited, source.status()), (11, 2));
        assert_eq!(source.bits().collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn a_source_that_was_low_must_come_back_by_the_margin() {
        let mut source = Supervision::new(0);
        for _ in 0..7 {
            step(&mut source, &meter([0.79; 3], 50.0));
        }
        step(&mut source, &meter([0.83; 3], 50.0));
        assert_eq!(source.status(), 5);
        step(&mut source, &meter([0.86; 3], 50.0));
        assert_eq!(source.status(), 0);
    }

    #[test]
    fn each_source_has_its_own_delays() {
        let mut settings = super::super::tests::settings();
        settings.set("s2_abnormal_delay", "2").unwrap();
        settings.set("under_voltage", "50").unwrap();
        let limits = Limits::of(&settings);
        for (index, code, volts) in [(0, 1, 0.4), (1, 5, 0.4), (1, 2, 0.6)] {
            let mut source = Supervision::new(index);
            let meter = meter([volts; 3], 50.0);
            for _ in 0..4 {
                let sensed = Sensed { meter: &meter, broken_wire: None, reverse_power: false, lost: false };
                source.step(SECOND, sensed, &limits);
            }
            assert_eq!(source.status(), code, "{index} {volts}");
        }
    }
}
