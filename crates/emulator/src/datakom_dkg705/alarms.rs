//! The alarm words 0032h to 0037h: what is watched, for how long, and what stays until it is acknowledged.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::Plant;

use super::ecu::Ecu;
use super::sequence::Sequence;
use super::settings::{SITE, Settings};

/// How many words there are; their registers follow each other.
pub(super) const WORDS: usize = 6;

/// The words in the order of their registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Word {
    Shutdown1,
    Shutdown2,
    LoadDump,
    Warning1,
    Warning2,
    Warning3,
}

use Word::*;

/// What is wrong now.
#[derive(Clone, Debug, Default)]
pub(super) struct Alarms {
    words: [BitSet; WORDS],
    horn: Duration,
    pending: [Duration; WATCHES.len()],
}

/// Everything that can be judged.
pub(super) struct View<'a> {
    pub(super) plant: &'a Plant,
    pub(super) sequence: &'a Sequence,
    pub(super) ecu: &'a Ecu,
    pub(super) service_due: bool,
}

impl Alarms {
    pub(super) fn step(&mut self, dt: Duration, view: &View<'_>) {
        let before = self.count();
        self.horn = self.horn.saturating_sub(dt);
        for (watch, pending) in WATCHES.iter().zip(&mut self.pending) {
            let word = &mut self.words[watch.word as usize];
            let excess = if watch.live.now(view.sequence) {
                (watch.excess)(view.plant, &SITE)
            } else {
                f64::NEG_INFINITY
            };
            *pending = if excess > 0.0 { *pending + dt } else { Duration::ZERO };
            let active = word.contains(watch.bit);
            // It comes with its cause after the delay; a warning goes when the cause is clearly gone.
            let stays = active && (watch.word.is_latched() || excess > -watch.hysteresis);
            word.set(watch.bit, stays || excess > 0.0 && *pending >= watch.delay());
        }
        for (word, bit, on) in conditions(view) {
            let word_is_latched = word.is_latched();
            let word = &mut self.words[word as usize];
            word.set(bit, on || word_is_latched && word.contains(bit));
        }
        if self.count() > before {
            self.horn = Duration::from_secs(SITE.horn);
        }
    }

    /// Lets go of what is latched, and silences the horn.
    pub(super) fn acknowledge(&mut self) {
        for word in [Shutdown1, Shutdown2, LoadDump] {
            self.words[word as usize] = BitSet::EMPTY;
        }
        self.horn = Duration::ZERO;
    }

    pub(super) fn words(&self) -> [BitSet; WORDS] {
        self.words
    }

    /// The engine must stop, and stay so.
    pub(super) fn shutdown(&self) -> bool {
        !self.words[Shutdown1 as usize].is_empty() || !self.words[Shutdown2 as usize].is_empty()
    }

    /// The genset must let go of the load, and cool down.
    pub(super) fn load_dump(&self) -> bool {
        !self.words[LoadDump as usize].is_empty()
    }

    pub(super) fn any(&self) -> bool {
        self.count() > 0
    }

    /// The timed alarm output.
    pub(super) fn horn(&self) -> bool {
        !self.horn.is_zero()
    }

    fn count(&self) -> usize {
        self.words.iter().map(BitSet::len).sum()
    }
}

impl Word {
    fn is_latched(self) -> bool {
        matches!(self, Shutdown1 | Shutdown2 | LoadDump)
    }
}

/// When a watch looks.
#[derive(Clone, Copy, Debug)]
enum Live {
    Always,
    /// The starter dips the battery.
    NotCranking,
    UpToSpeed,
}

impl Live {
    fn now(self, sequence: &Sequence) -> bool {
        match self {
            Self::Always => true,
            Self::NotCranking => !sequence.is_cranking(),
            Self::UpToSpeed => sequence.is_up_to_speed(),
        }
    }
}

/// A value held against a limit.
struct Watch {
    word: Word,
    bit: u16,
    live: Live,
    seconds: u64,
    hysteresis: f64,
    /// By how much the value is beyond its limit.
    excess: fn(&Plant, &Settings) -> f64,
}

impl Watch {
    fn delay(&self) -> Duration {
        Duration::from_secs(self.seconds)
    }
}

const fn watch(
    word: Word,
    bit: u16,
    live: Live,
    seconds: u64,
    hysteresis: f64,
    excess: fn(&Plant, &Settings) -> f64,
) -> Watch {
    Watch { word, bit, live, seconds, hysteresis, excess }
}

/// Without limits in the table: fuel level in %, oil temperature by so much above the coolant's limits, charge input
/// and external DC in V, reverse power in kW.
const FUEL_SHUTDOWN: f64 = 3.0;
const FUEL_WARNING: f64 = 20.0;
const OIL_ABOVE_COOLANT: f64 = 20.0;
const LOW_CHARGE: f64 = 20.0;
const REVERSE_POWER: f64 = 8.0;

const WATCHES: [Watch; 23] = [
    watch(Shutdown1, 9, Live::UpToSpeed, 3, 0.0, |p, s| s.low_frequency_shutdown - p.genset.frequency),
    watch(Shutdown1, 10, Live::UpToSpeed, 3, 0.0, |p, s| p.genset.frequency - s.high_frequency_shutdown),
    watch(Shutdown1, 11, Live::Always, 3, 0.0, |p, s| p.batteries[0].voltage - s.high_battery_shutdown),
    watch(Shutdown1, 12, Live::Always, 3, 0.0, |p, _| FUEL_SHUTDOWN - p.tank.percent()),
    watch(Shutdown1, 13, Live::Always, 3, 0.0, |p, s| oil(p) - s.high_temperature_shutdown),
    watch(Shutdown1, 14, Live::Always, 3, 0.0, |p, s| p.engine.coolant - s.high_temperature_shutdown),
    watch(Shutdown1, 15, Live::UpToSpeed, 3, 0.0, |p, s| s.low_oil_pressure_shutdown - p.engine.oil_pressure),
    watch(Shutdown2, 2, Live::UpToSpeed, 3, 0.0, |p, s| s.low_voltage_shutdown - lowest(p)),
    watch(Shutdown2, 3, Live::UpToSpeed, 3, 0.0, |p, s| highest(p) - s.high_voltage_shutdown),
    watch(LoadDump, 13, Live::UpToSpeed, 5, 0.0, |p, _| -p.genset.total_active() - REVERSE_POWER),
    watch(LoadDump, 14, Live::UpToSpeed, SITE.overload, 0.0, |p, s| p.genset.total_active() - s.excess_power),
    watch(LoadDump, 15, Live::UpToSpeed, SITE.overload, 0.0, |p, s| current(p) - s.overcurrent),
    watch(Warning2, 9, Live::UpToSpeed, 3, 0.3, |p, s| s.low_frequency_warning - p.genset.frequency),
    watch(Warning2, 10, Live::UpToSpeed, 3, 0.3, |p, s| p.genset.frequency - s.high_frequency_warning),
    watch(Warning2, 11, Live::Always, 3, 0.5, |p, s| p.batteries[0].voltage - s.high_battery_warning),
    watch(Warning2, 12, Live::Always, 2, 2.0, |p, _| FUEL_WARNING - p.tank.percent()),
    watch(Warning2, 13, Live::Always, 3, 3.0, |p, s| oil(p) - s.high_temperature_warning),
    watch(Warning2, 14, Live::Always, 3, 3.0, |p, s| p.engine.coolant - s.high_temperature_warning),
    watch(Warning2, 15, Live::UpToSpeed, 3, 0.3, |p, s| s.low_oil_pressure_warning - p.engine.oil_pressure),
    watch(Warning3, 2, Live::UpToSpeed, 10, 2.0, |p, _| LOW_CHARGE - p.batteries[0].charge_input),
    watch(Warning3, 3, Live::NotCranking, 10, 0.5, |p, s| s.low_battery_warning - p.batteries[0].voltage),
    // Held against the warning limits too: rpm and frequency are one shaft.
    watch(Warning3, 6, Live::UpToSpeed, 3, 10.0, |p, s| s.low_frequency_warning * 30.0 - p.engine.speed),
    watch(Warning3, 7, Live::UpToSpeed, 3, 10.0, |p, s| p.engine.speed - s.high_frequency_warning * 30.0),
];

/// How long a synchronization may take.
const SYNCHRONIZATION: Duration = Duration::from_secs(60);

/// What is so or not, without a limit.
fn conditions(view: &View<'_>) -> [(Word, u16, bool); 6] {
    let failures = view.sequence.failures;
    let operation = view.sequence.operation();
    [
        (Shutdown2, 0, failures.to_stop),
        (Shutdown2, 1, failures.to_start),
        (Warning1, 11, view.ecu.warns()),
        (Warning1, 14, view.service_due),
        (Warning2, 8, operation.is_synchronizing() && view.sequence.elapsed() > SYNCHRONIZATION),
        (Warning3, 8, failures.mains_in_parallel),
    ]
}

/// The oil's temperature on the coolant's scale.
fn oil(plant: &Plant) -> f64 {
    plant.engine.oil - OIL_ABOVE_COOLANT
}

fn lowest(plant: &Plant) -> f64 {
    plant.genset.voltage.into_iter().fold(f64::INFINITY, f64::min)
}

fn highest(plant: &Plant) -> f64 {
    plant.genset.voltage.into_iter().fold(0.0, f64::max)
}

fn current(plant: &Plant) -> f64 {
    plant.genset.current().into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    const SECOND: Duration = Duration::from_secs(1);

    struct Bench {
        plant: Plant,
        sequence: Sequence,
        alarms: Alarms,
    }

    impl Bench {
        fn new() -> Self {
            Self { plant: Plant::new(1), sequence: Sequence::new(SITE), alarms: Alarms::default() }
        }

        fn step(&mut self) {
            let ecu = Ecu::new(&self.plant);
            let view = View { plant: &self.plant, sequence: &self.sequence, ecu: &ecu, service_due: false };
            self.alarms.step(SECOND, &view);
        }

        fn low_fuel(&mut self, percent: f64) -> bool {
            self.plant.tank = Tank::new(percent);
            self.step();
            self.alarms.words()[Warning2 as usize].contains(12)
        }
    }

    #[test]
    fn a_warning_needs_its_delay_and_its_hysteresis_and_goes_by_itself() {
        let mut bench = Bench::new();
        assert!(!bench.low_fuel(19.0));
        assert!(!bench.low_fuel(20.5), "shorter than the delay");
        assert!(!bench.low_fuel(19.0));
        assert!(bench.low_fuel(19.0));
        assert!(bench.alarms.horn() && bench.alarms.any());
        assert!(bench.low_fuel(21.0));
        assert!(!bench.low_fuel(22.5));
        assert!(!bench.alarms.shutdown());
    }

    #[test]
    fn a_shutdown_stays_until_it_is_acknowledged() {
        let mut bench = Bench::new();
        bench.plant.engine.coolant = 106.0;
        for _ in 0..3 {
            bench.step();
        }
        assert!(bench.alarms.shutdown());
        bench.plant.engine.coolant = 60.0;
        bench.step();
        assert!(bench.alarms.shutdown());
        bench.alarms.acknowledge();
        bench.step();
        assert!(!bench.alarms.shutdown() && !bench.alarms.any());
    }

    #[test]
    fn protections_of_a_running_engine_sleep_while_it_stands() {
        let mut bench = Bench::new();
        for _ in 0..60 {
            bench.step();
        }
        assert!(!bench.alarms.any(), "{:?}", bench.alarms.words());
    }
}
