//! What an ACC1700 finds wrong: the words of registers 1 to 6 (shutdowns), 20 to 25 (warnings), 33 and 34 (indications),
//! and the fault of the particle filter in register 44.

use std::ops::RangeInclusive;
use std::time::Duration;

use busbar_profile::BitSet;

use super::causes::{Verdict, View, judge};

pub(super) const SHUTDOWNS: RangeInclusive<u16> = 1..=6;
pub(super) const WARNINGS: RangeInclusive<u16> = 20..=25;
pub(super) const INDICATIONS: RangeInclusive<u16> = 33..=34;
/// The fault of the particle filter and, worked out from the ECU's alarms, that of the engine.
pub(super) const FILTER_FAULT: (u16, u16) = (44, 0);
pub(super) const ECU_SHUTDOWN: (u16, u16) = (1, 11);
pub(super) const ECU_WARNING: (u16, u16) = (20, 15);

const REGISTERS: [u16; 15] = [1, 2, 3, 4, 5, 6, 20, 21, 22, 23, 24, 25, 33, 34, FILTER_FAULT.0];
/// The only alarm of its word that does not follow from others.
const OF_THE_ENGINE: u16 = 1 << FILTER_FAULT.1;

/// What is wrong now. A shutdown stays until [`Alarms::acknowledge`], all else goes with its cause.
#[derive(Clone, Debug)]
pub(super) struct Alarms {
    words: [Word; REGISTERS.len()],
}

/// One register, a bit an alarm.
#[derive(Clone, Debug, Default)]
struct Word {
    /// The plant has a cause for it.
    caused: u16,
    /// Whatever the plant says.
    injected: u16,
    /// Shutdowns that nobody has acknowledged.
    latched: u16,
    /// Those that the event log has.
    noted: u16,
    pending: [Duration; 16],
}

impl Word {
    fn active(&self) -> u16 {
        self.caused | self.injected | self.latched
    }
}

impl Alarms {
    pub(super) fn new() -> Self {
        Self { words: Default::default() }
    }

    /// Judges the plant; how many alarms are new.
    pub(super) fn step(&mut self, dt: Duration, view: &View<'_>) -> u32 {
        judge(view, |judgement| {
            let (register, bit) = judgement.at;
            let Some(word) = self.word_mut(register) else { return };
            let Some(pending) = word.pending.get_mut(usize::from(bit)) else { return };
            let active = word.caused >> bit & 1 == 1;
            // An alarm needs its cause for the whole delay, and goes when the cause is clearly gone.
            *pending = if judgement.verdict == Verdict::Alarm { *pending + dt } else { Duration::ZERO };
            let stays = match judgement.verdict {
                Verdict::Alarm => active || *pending >= judgement.delay,
                Verdict::Between => active,
                Verdict::Fine => false,
            };
            word.caused = word.caused & !(1 << bit) | u16::from(stays) << bit;
        });
        let mut new = 0;
        for (register, word) in REGISTERS.into_iter().zip(&mut self.words) {
            if SHUTDOWNS.contains(&register) {
                word.latched = word.active();
            }
            new += (word.active() & !word.noted).count_ones();
            word.noted = word.active();
        }
        new
    }

    /// Forgets the shutdowns that have no cause any more.
    pub(super) fn acknowledge(&mut self, view: &View<'_>) {
        judge(view, |judgement| {
            let (register, bit) = judgement.at;
            if judgement.verdict != Verdict::Alarm
                && SHUTDOWNS.contains(&register)
                && let Some(word) = self.word_mut(register)
            {
                word.caused &= !(1 << bit);
            }
        });
        for (register, word) in REGISTERS.into_iter().zip(&mut self.words) {
            let stands = word.caused | word.injected;
            word.latched = if SHUTDOWNS.contains(&register) { stands } else { 0 };
        }
    }

    /// Takes an alarm for active whatever the plant says; false where there is none, or it follows from others.
    pub(super) fn inject(&mut self, register: u16, bit: u16, active: bool) -> bool {
        let Some(word) = self.word_mut(register) else { return false };
        let mask = 1_u16.checked_shl(bit.into()).unwrap_or_default();
        if register == FILTER_FAULT.0 && mask & OF_THE_ENGINE == 0 {
            return false;
        }
        word.injected = if active { word.injected | mask } else { word.injected & !mask };
        true
    }

    pub(super) fn word(&self, register: u16) -> BitSet {
        let word = REGISTERS.iter().position(|known| *known == register).and_then(|at| self.words.get(at));
        BitSet::from_registers(&[word.map_or(0, Word::active)])
    }

    pub(super) fn any_shutdown(&self) -> bool {
        SHUTDOWNS.into_iter().any(|register| !self.word(register).is_empty())
    }

    fn word_mut(&mut self, register: u16) -> Option<&mut Word> {
        let at = REGISTERS.iter().position(|known| *known == register)?;
        self.words.get_mut(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Compressor;

    use super::super::Model;
    use super::super::ecu::Ecu;
    use super::super::inputs::Inputs;
    use super::super::readings::{Reading, Readings};
    use super::super::sequence::Sequence;
    use super::super::setup::Setup;

    const SECOND: Duration = Duration::from_secs(1);

    /// A unit at rest, whose readings can be changed.
    struct Bench {
        alarms: Alarms,
        readings: Readings,
        ecu: Ecu,
        inputs: Inputs,
        sequence: Sequence,
        setup: Setup,
        services_due: [bool; 10],
    }

    impl Bench {
        fn new(changes: &[(&str, &str)]) -> Self {
            Self {
                alarms: Alarms::new(),
                readings: Readings::of(&Compressor::new(1), Model::Acc1700Can, true),
                ecu: Ecu::new(),
                inputs: Inputs::default(),
                sequence: Sequence::new(1),
                setup: Setup::with(changes),
                services_due: [false; 10],
            }
        }

        fn view(&mut self) -> (&mut Alarms, View<'_>) {
            let view = View {
                sequence: &self.sequence,
                readings: &self.readings,
                inputs: &self.inputs,
                ecu: Some(&self.ecu),
                services_due: self.services_due,
                setup: &self.setup,
            };
            (&mut self.alarms, view)
        }

        /// Registers and bits that are active after some seconds.
        fn pass(&mut self, seconds: u32) -> Vec<(u16, u16)> {
            let (alarms, view) = self.view();
            for _ in 0..seconds {
                alarms.step(SECOND, &view);
            }
            REGISTERS
                .into_iter()
                .flat_map(|at| alarms.word(at).iter().map(move |bit| (at, bit)).collect::<Vec<_>>())
                .collect()
        }

        fn acknowledge(&mut self) {
            let (alarms, view) = self.view();
            alarms.acknowledge(&view);
        }
    }

    #[test]
    fn a_healthy_plant_at_rest_has_none() {
        assert_eq!(Bench::new(&[]).pass(60), []);
    }

    #[test]
    fn a_warning_goes_with_its_cause_and_a_shutdown_stays_until_acknowledged() {
        let mut bench = Bench::new(&[]);
        bench.readings.discharge_pressure = Reading::Value(960.0);
        assert_eq!(bench.pass(1), [(4, 9), (23, 9)]);
        bench.acknowledge();
        assert_eq!(bench.pass(1), [(4, 9), (23, 9)], "what is still wrong stays");
        bench.readings.discharge_pressure = Reading::Value(500.0);
        assert_eq!(bench.pass(1), [(4, 9)]);
        assert!(bench.alarms.any_shutdown());
        bench.acknowledge();
        assert!(!bench.alarms.any_shutdown());
        assert_eq!(bench.pass(1), []);
    }

    #[test]
    fn an_alarm_needs_its_delay_and_comes_back_a_little_later_than_its_threshold() {
        let mut bench = Bench::new(&[("sensor_delay", "4")]);
        for (percent, seconds, expected) in [
            (9.9, 3, &[][..]),
            (10.1, 1, &[]),
            (9.9, 3, &[]),
            (9.9, 1, &[(22, 2)]),
            (12.9, 9, &[(22, 2)]),
            (13.0, 1, &[]),
        ] {
            bench.readings.sensors[2] = Reading::Value(percent);
            assert_eq!(bench.pass(seconds), expected, "{percent} for {seconds} s");
        }
    }

    #[test]
    fn an_injected_alarm_is_one_whatever_the_plant_says() {
        let mut bench = Bench::new(&[]);
        for at in [(4, 9), (23, 9), (20, 4), (33, 3)] {
            assert!(bench.alarms.inject(at.0, at.1, true));
        }
        assert_eq!(bench.pass(1), [(4, 9), (20, 4), (23, 9), (33, 3)]);
        bench.acknowledge();
        assert_eq!(bench.pass(1).len(), 4, "nobody acknowledges what is still there");
        for at in [(4, 9), (23, 9), (20, 4), (33, 3)] {
            assert!(bench.alarms.inject(at.0, at.1, false));
        }
        assert_eq!(bench.pass(1), [(4, 9)], "as any other shutdown");
        bench.acknowledge();
        assert_eq!(bench.pass(1), []);
        assert!(!bench.alarms.inject(44, 9, true) && !bench.alarms.inject(0, 1, true));
    }

    #[test]
    fn each_service_does_what_it_is_set_to() {
        let changes =
            [("maintenance_1_action", "0"), ("maintenance_2_action", "1"), ("maintenance_10_action", "3")];
        let mut bench = Bench::new(&changes);
        for service in [0, 1, 2, 9] {
            bench.services_due[service] = true;
        }
        assert_eq!(bench.pass(1), [(6, 9), (25, 2), (34, 1)]);
    }

    #[test]
    fn each_sensor_has_an_open_a_high_and_a_low_of_both_kinds() {
        const FIRST: [(u16, u16); 5] = [(2, 8), (2, 12), (3, 0), (3, 4), (3, 8)];
        for (index, (register, bit)) in FIRST.into_iter().enumerate() {
            let set = |what: &str, value: &str| (format!("sensor_{}_{what}", index + 1), value.to_owned());
            let limits = [
                set("high_warning", "10"),
                set("high_shutdown", "20"),
                set("low_warning", "0"),
                set("low_shutdown", "-10"),
            ];
            for (open, reading, expected) in [
                ("0", Reading::Broken, vec![]),
                ("2", Reading::Broken, vec![(register + 19, bit)]),
                ("3", Reading::Broken, vec![(register, bit)]),
                ("3", Reading::Value(11.0), vec![(register + 19, bit + 1)]),
                ("3", Reading::Value(21.0), vec![(register, bit + 1), (register + 19, bit + 1)]),
                ("3", Reading::Value(-1.0), vec![(register + 19, bit + 2)]),
                ("3", Reading::Value(-11.0), vec![(register, bit + 2), (register + 19, bit + 2)]),
                ("3", Reading::Absent, vec![]),
            ] {
                let mut changes = limits.to_vec();
                changes.push(set("open_action", open));
                let changes: Vec<_> =
                    changes.iter().map(|(id, value)| (id.as_str(), value.as_str())).collect();
                let mut bench = Bench::new(&changes);
                bench.readings.sensors[index] = reading;
                assert_eq!(bench.pass(3), expected, "sensor {}, {reading:?}", index + 1);
            }
        }
    }
}
