//! The alarm words 0032h to 0037h: what is so, what stays until it is acknowledged, what was injected, and the horn.

use std::time::Duration;

use busbar_profile::BitSet;

use super::ecu::Ecu;
use super::mains::is_order_wrong;
use super::measures::Measures;
use super::operation::Operation;
use super::parameters::Parameters;
use super::protections::{FREQUENCY, NO_FREQUENCY, Protections, REVERSE_POWER, ROCOF, VECTOR_SHIFT};
use super::regulation::Regulation;
use super::sequence::Sequence;
use super::watches::{Live, WATCHES};

/// How many words there are; their registers follow each other.
pub(super) const WORDS: usize = 6;

/// The points of the words, in the order of their registers.
const POINTS: [&str; WORDS] = [
    "shutdown_alarms_1",
    "shutdown_alarms_2",
    "load_dump_alarms",
    "warning_alarms_1",
    "warning_alarms_2",
    "warning_alarms_3",
];

/// The bit of [`Word::Warning1`] that the ECU's fault codes make.
pub(super) const ECU_WARNING: u16 = 11;

/// The words in the order of their registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Word {
    Shutdown1,
    Shutdown2,
    LoadDump,
    Warning1,
    Warning2,
    Warning3,
}

use Word::*;

const ALL: [Word; WORDS] = [Shutdown1, Shutdown2, LoadDump, Warning1, Warning2, Warning3];

/// What is wrong now.
#[derive(Clone, Debug, Default)]
pub(super) struct Alarms {
    /// What is shown: what has its own cause or is latched, and what is injected.
    words: [BitSet; WORDS],
    own: [BitSet; WORDS],
    /// Taken for active whatever the plant says.
    injected: [BitSet; WORDS],
    horn: Horn,
    pending: [Duration; WATCHES.len()],
}

/// The timed alarm output.
#[derive(Clone, Copy, Debug, Default)]
struct Horn {
    sounds: bool,
    left: Duration,
}

/// Everything that can be judged.
pub(super) struct View<'a> {
    pub(super) measures: &'a Measures,
    pub(super) set: &'a Parameters,
    pub(super) sequence: &'a Sequence,
    pub(super) regulation: &'a Regulation,
    pub(super) protections: &'a Protections,
    pub(super) ecu: &'a Ecu,
    pub(super) site: Contacts,
}

/// What comes over wires that are no measurement.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Contacts {
    /// Input 2.
    pub(super) emergency_stop: bool,
    /// Input 4.
    pub(super) charger_failed: bool,
    pub(super) mains_contactor: bool,
    pub(super) service_due: bool,
    /// The other genset of the busbar does not answer, though it should.
    pub(super) partner_missing: bool,
}

impl Alarms {
    pub(super) fn step(&mut self, dt: Duration, view: &View<'_>) {
        let before = self.words;
        self.watch(dt, view);
        for (word, bit, on) in conditions(view) {
            let latched = word.is_latched();
            let word = &mut self.own[word as usize];
            word.set(bit, on || latched && word.contains(bit));
        }
        for word in ALL {
            let (own, injected) = (&mut self.own[word as usize], self.injected[word as usize]);
            if word.is_latched() {
                injected.iter().for_each(|bit| own.insert(bit));
            }
            self.words[word as usize] = own.iter().chain(injected.iter()).collect();
        }
        let news = self.words.iter().zip(&before);
        let news = news.into_iter().any(|(now, before)| now.iter().any(|bit| !before.contains(bit)));
        self.horn.step(dt, news, self.any(), view.set.timers.horn);
    }

    fn watch(&mut self, dt: Duration, view: &View<'_>) {
        for (watch, pending) in WATCHES.iter().zip(&mut self.pending) {
            let word = &mut self.own[watch.word as usize];
            let excess = match watch.live.now(view.sequence) {
                true => (watch.excess)(view.measures, &view.set.limits),
                false => f64::NEG_INFINITY,
            };
            *pending = if excess > 0.0 { *pending + dt } else { Duration::ZERO };
            let active = word.contains(watch.bit);
            // It comes with its cause after the delay; a warning goes when the cause is clearly gone.
            let stays = active && (watch.word.is_latched() || excess > -watch.hysteresis);
            word.set(watch.bit, stays || excess > 0.0 && *pending >= (watch.delay)(&view.set.timers));
        }
    }

    /// Takes an alarm for active from the next step on, or no longer: what it has latched stays.
    pub(super) fn inject(&mut self, point: &str, bit: u16, active: bool) -> bool {
        let Some(word) = POINTS.iter().position(|known| *known == point) else { return false };
        self.injected[word].set(bit, active);
        true
    }

    /// Lets go of what is latched, and silences the horn.
    pub(super) fn acknowledge(&mut self) {
        for word in ALL.into_iter().filter(|word| word.is_latched()) {
            (self.own[word as usize], self.words[word as usize]) = (BitSet::EMPTY, BitSet::EMPTY);
        }
        self.horn = Horn::default();
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
        self.words.iter().any(|word| !word.is_empty())
    }

    /// The timed alarm output.
    pub(super) fn horn(&self) -> bool {
        self.horn.sounds
    }
}

impl Word {
    fn is_latched(self) -> bool {
        matches!(self, Shutdown1 | Shutdown2 | LoadDump)
    }
}

impl Horn {
    /// A timer of zero lets it sound as long as there is an alarm.
    fn step(&mut self, dt: Duration, news: bool, any: bool, timer: Duration) {
        self.left = self.left.saturating_sub(dt);
        if news {
            *self = Self { sounds: true, left: timer };
        } else if self.left.is_zero() && (!timer.is_zero() || !any) {
            self.sounds = false;
        }
    }
}

impl Live {
    fn now(self, sequence: &Sequence) -> bool {
        match self {
            Self::Always => true,
            Self::NotCranking => !sequence.is_cranking(),
            Self::Fuelled => sequence.is_committed(),
            Self::UpToSpeed => sequence.is_up_to_speed(),
        }
    }
}

/// What is so or not, without a limit.
fn conditions(view: &View<'_>) -> [(Word, u16, bool); 22] {
    let (failures, options, site) = (view.sequence.failures, &view.set.options, view.site);
    let tripped = view.protections.tripped();
    let orders_matter = !view.set.mains.any_order;
    let on_load = view.sequence.operation() == Operation::LoadOnGenset;
    [
        (Shutdown1, 2, site.emergency_stop),
        (Shutdown2, 0, failures.to_stop),
        (Shutdown2, 1, failures.to_start),
        (
            Shutdown2,
            5,
            is_order_wrong(&view.measures.genset) && orders_matter && view.sequence.is_up_to_speed(),
        ),
        (Shutdown2, 11, view.ecu.is_missed(view.set.timers.ecu_silence)),
        (Shutdown2, 14, site.partner_missing && !options.without_partner),
        (Warning1, ECU_WARNING, view.ecu.warns()),
        (Warning1, 12, options.genset_on_load_warning && on_load),
        (Warning1, 13, options.mains_on_load_warning && site.mains_contactor),
        (Warning1, 14, site.service_due && view.set.service.warns),
        (Warning2, 4, site.charger_failed),
        (Warning2, 8, failures.to_synchronize || failures.out_of_step),
        (Warning3, 0, is_order_wrong(&view.measures.mains) && orders_matter),
        (Warning3, 4, view.regulation.exciter_failed(view.set)),
        (Warning3, 5, view.regulation.governor_failed(view.set)),
        (Warning3, 8, failures.mains_in_parallel || !tripped.is_empty()),
        (Warning3, 9, tripped.contains(REVERSE_POWER)),
        (Warning3, 10, tripped.contains(FREQUENCY)),
        (Warning3, 11, tripped.contains(NO_FREQUENCY)),
        (Warning3, 12, tripped.contains(ROCOF)),
        (Warning3, 13, tripped.contains(VECTOR_SHIFT)),
        (Warning3, 14, site.partner_missing && options.without_partner),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{site, site_with};
    use super::*;
    use crate::plant::{Plant, Tank};

    const SECOND: Duration = Duration::from_secs(1);

    struct Bench {
        plant: Plant,
        set: Parameters,
        regulation: Regulation,
        sequence: Sequence,
        contacts: Contacts,
        alarms: Alarms,
    }

    impl Bench {
        fn new(set: Parameters) -> Self {
            let mut plant = Plant::new(1);
            let regulation = Regulation::new(&mut plant);
            Self {
                plant,
                set,
                regulation,
                sequence: Sequence::new(),
                contacts: Contacts::default(),
                alarms: Alarms::default(),
            }
        }

        fn step(&mut self) {
            let view = View {
                measures: &Measures::of(&self.plant, &self.set.options, false),
                set: &self.set,
                sequence: &self.sequence,
                regulation: &self.regulation,
                protections: &Protections::default(),
                ecu: &Ecu::new(&self.plant),
                site: self.contacts,
            };
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
        let mut bench = Bench::new(site());
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
        let mut bench = Bench::new(site());
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
    fn a_limit_of_zero_is_not_watched() {
        let mut bench = Bench::new(site_with(&[
            ("high_temperature_shutdown_limit", "0"),
            ("high_temperature_warning_limit", "0"),
        ]));
        bench.plant.engine.coolant = 106.0;
        for _ in 0..10 {
            bench.step();
        }
        assert!(!bench.alarms.any(), "{:?}", bench.alarms.words());
    }

    #[test]
    fn what_is_injected_acts_like_the_rest() {
        let mut bench = Bench::new(site());
        assert!(!bench.alarms.inject("relays", 1, true), "no word of alarms");
        for (point, bit, latched) in
            [("shutdown_alarms_2", 4, true), ("load_dump_alarms", 3, true), ("warning_alarms_3", 12, false)]
        {
            let word = POINTS.iter().position(|known| *known == point).unwrap();
            assert!(bench.alarms.inject(point, bit, true));
            bench.step();
            assert!(bench.alarms.words()[word].contains(bit) && bench.alarms.horn());
            bench.alarms.acknowledge();
            bench.step();
            assert!(bench.alarms.words()[word].contains(bit), "{point}: it is still so");
            assert!(bench.alarms.inject(point, bit, false));
            bench.step();
            assert_eq!(bench.alarms.words()[word].contains(bit), latched, "{point}");
            bench.alarms.acknowledge();
            bench.step();
            assert!(!bench.alarms.any() && !bench.alarms.horn());
        }
    }

    #[test]
    fn the_horn_sounds_for_its_timer_and_without_one_as_long_as_the_alarm() {
        for (timer, sounding) in [("3", 3), ("0", 9)] {
            let mut bench = Bench::new(site_with(&[("horn_timer", timer)]));
            bench.contacts.charger_failed = true;
            let mut sounded = 0;
            for _ in 0..9 {
                bench.step();
                sounded += u32::from(bench.alarms.horn());
            }
            assert_eq!(sounded, sounding, "timer {timer}");
            bench.contacts.charger_failed = false;
            bench.step();
            assert!(!bench.alarms.horn());
        }
    }

    #[test]
    fn protections_of_a_running_engine_sleep_while_it_stands() {
        let mut bench = Bench::new(site());
        for _ in 0..60 {
            bench.step();
        }
        assert!(!bench.alarms.any(), "{:?}", bench.alarms.words());
    }
}
