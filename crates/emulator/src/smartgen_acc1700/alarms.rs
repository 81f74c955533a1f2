//! What an ACC1700 finds wrong: the words of registers 1 to 6 (shutdowns), 20 to 25 (warnings) and 33 (indications).

use std::ops::RangeInclusive;
use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::Compressor;

use super::sequence::{Sequence, Status};

/// Registers of the words by class. The maintenance words 25 and 34 follow the countdowns and are not kept here.
pub(super) const SHUTDOWNS: RangeInclusive<u16> = 1..=6;
pub(super) const WARNINGS: RangeInclusive<u16> = 20..=25;
const INDICATIONS: RangeInclusive<u16> = 33..=33;
const WORDS: usize = 34;

/// Percent in the tank at which its float switch closes, and at which it opens again.
const FLOAT_CLOSES: f64 = 20.0;
const FLOAT_OPENS: f64 = 21.0;

/// What the five digital inputs are wired to. Input 4 is free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Inputs {
    /// Input 1: float in the expansion tank, closed when the coolant is low.
    pub(super) coolant_low: bool,
    /// Input 2: thermal switch on the cylinder head, closed when it is hot.
    pub(super) too_hot: bool,
    /// Input 3: float in the fuel tank, closed when it is nearly empty.
    pub(super) fuel_low: bool,
    /// Input 5: contact of the canopy door, closed while the door is.
    pub(super) door_open: bool,
}

impl Inputs {
    pub(super) fn step(&mut self, plant: &Compressor, door_open: bool) {
        let fuel = plant.tank.percent();
        *self = Self {
            coolant_low: plant.coolant_level() < 40.0,
            too_hot: plant.engine.coolant > 108.0,
            fuel_low: fuel < FLOAT_CLOSES || self.fuel_low && fuel < FLOAT_OPENS,
            door_open,
        };
    }

    /// Register 35: contacts that are closed. Bit 0 is the emergency stop.
    pub(super) fn signals(self) -> BitSet {
        let signals = [false, self.coolant_low, self.too_hot, self.fuel_low, false, !self.door_open];
        bits(signals)
    }

    /// Register 45: inputs in the position that matters; the door contact is set to matter when it opens.
    pub(super) fn active(self) -> BitSet {
        bits([self.coolant_low, self.too_hot, self.fuel_low, false, self.door_open])
    }
}

/// The positions that are true.
pub(super) fn bits(values: impl IntoIterator<Item = bool>) -> BitSet {
    (0..).zip(values).filter(|(_, value)| *value).map(|(bit, _)| bit).collect()
}

/// What is judged.
pub(super) struct View<'a> {
    pub(super) plant: &'a Compressor,
    pub(super) sequence: &'a Sequence,
    pub(super) inputs: Inputs,
}

impl View<'_> {
    /// A value that only means something while the engine is watched.
    fn watched(&self, verdict: Verdict) -> Verdict {
        if self.sequence.status().is_watched() { verdict } else { Verdict::Fine }
    }
}

/// What is wrong now. A shutdown stays until [`Alarms::acknowledge`], all else goes with its cause.
#[derive(Clone, Debug)]
pub(super) struct Alarms {
    words: [u16; WORDS],
    pending: [Duration; WATCHES.len()],
}

impl Alarms {
    pub(super) fn new() -> Self {
        Self { words: [0; WORDS], pending: [Duration::ZERO; WATCHES.len()] }
    }

    pub(super) fn step(&mut self, dt: Duration, view: &View<'_>) {
        for (watch, pending) in WATCHES.iter().zip(&mut self.pending) {
            let (register, bit) = watch.at;
            let Some(word) = self.words.get_mut(usize::from(register)) else { continue };
            let active = *word >> bit & 1 == 1;
            let judged = (watch.judge)(view);
            // An alarm needs its cause for the whole delay, and goes when the cause is clearly gone.
            *pending = if judged == Verdict::Alarm { *pending + dt } else { Duration::ZERO };
            let stays = match judged {
                Verdict::Alarm => active || *pending >= watch.delay,
                Verdict::Between => active,
                Verdict::Fine => active && SHUTDOWNS.contains(&register),
            };
            *word = *word & !(1 << bit) | u16::from(stays) << bit;
        }
    }

    /// Forgets the shutdowns; what is still wrong comes again.
    pub(super) fn acknowledge(&mut self) {
        for register in SHUTDOWNS {
            if let Some(word) = self.words.get_mut(usize::from(register)) {
                *word = 0;
            }
        }
    }

    /// Registers with their bits.
    pub(super) fn words(&self) -> impl Iterator<Item = (u16, BitSet)> + '_ {
        let registers = SHUTDOWNS.chain(WARNINGS).chain(INDICATIONS);
        registers.filter_map(|register| {
            let word = self.words.get(usize::from(register))?;
            Some((register, BitSet::from_registers(&[*word])))
        })
    }

    pub(super) fn any_shutdown(&self) -> bool {
        self.words().any(|(register, word)| SHUTDOWNS.contains(&register) && !word.is_empty())
    }

    /// How many there are, of any class.
    pub(super) fn count(&self) -> usize {
        self.words().map(|(_, word)| word.len()).sum()
    }
}

/// One cause, watched for some time.
struct Watch {
    /// Register and bit.
    at: (u16, u16),
    delay: Duration,
    judge: fn(&View<'_>) -> Verdict,
}

const fn watch(register: u16, bit: u16, seconds: u64, judge: fn(&View<'_>) -> Verdict) -> Watch {
    Watch { at: (register, bit), delay: Duration::from_secs(seconds), judge }
}

/// Thresholds and delays as a site would set them; the manual has none.
const WATCHES: [Watch; 23] = [
    watch(1, 1, 1, |v| above(v.plant.engine.speed, 1725.0, 1700.0)),
    watch(1, 2, 2, |v| v.watched(below(v.plant.engine.speed, 700.0, 720.0))),
    watch(1, 8, 0, |v| when(v.sequence.failed_to_start())),
    watch(1, 13, 3, |v| v.watched(when(v.inputs.coolant_low))),
    watch(1, 14, 2, |v| v.watched(when(v.inputs.too_hot))),
    watch(2, 1, 3, |v| v.watched(above(v.plant.engine.coolant, 104.0, 102.0))),
    watch(2, 6, 2, |v| v.watched(below(oil_pressure(v.plant), 100.0, 120.0))),
    watch(3, 5, 3, |v| above(v.plant.air.temperature, 115.0, 112.0)),
    watch(4, 9, 1, |v| above(v.plant.air.pressure, 950.0, 900.0)),
    watch(20, 0, 1, |v| above(v.plant.engine.speed, 1650.0, 1630.0)),
    watch(20, 1, 1, |v| v.watched(below(v.plant.engine.speed, 800.0, 820.0))),
    watch(20, 3, 0, |v| when(v.plant.filter.needs_a_person())),
    watch(20, 8, 0, |v| when(v.sequence.status() == Status::StopFailure)),
    watch(20, 9, 10, |v| v.watched(below(charger(v.plant), 24.0, 25.0))),
    watch(20, 10, 5, |v| above(battery(v.plant), 30.0, 29.5)),
    watch(20, 11, 10, |v| below(battery(v.plant), 23.5, 24.0)),
    watch(21, 1, 3, |v| above(v.plant.engine.coolant, 99.0, 97.0)),
    watch(21, 2, 10, |v| below(v.plant.engine.coolant, 0.0, 2.0)),
    watch(21, 6, 2, |v| v.watched(below(oil_pressure(v.plant), 140.0, 160.0))),
    watch(22, 5, 3, |v| above(v.plant.air.temperature, 108.0, 105.0)),
    watch(23, 9, 2, |v| above(v.plant.air.pressure, 850.0, 830.0)),
    watch(24, 2, 2, |v| when(v.inputs.fuel_low)),
    watch(33, 4, 0, |v| when(v.inputs.door_open)),
];

fn battery(plant: &Compressor) -> f64 {
    plant.voltages()[0]
}

fn charger(plant: &Compressor) -> f64 {
    plant.voltages()[1]
}

/// kPa.
fn oil_pressure(plant: &Compressor) -> f64 {
    plant.engine.oil_pressure * 100.0
}

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

fn above(value: f64, alarm: f64, fine: f64) -> Verdict {
    below(-value, -alarm, -fine)
}

fn when(cause: bool) -> Verdict {
    if cause { Verdict::Alarm } else { Verdict::Fine }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    const SECOND: Duration = Duration::from_secs(1);

    fn judge(alarms: &mut Alarms, plant: &Compressor, inputs: Inputs, seconds: u32) -> Vec<(u16, u16)> {
        let sequence = Sequence::new(1);
        for _ in 0..seconds {
            alarms.step(SECOND, &View { plant, sequence: &sequence, inputs });
        }
        alarms.words().flat_map(|(register, word)| word.iter().map(move |bit| (register, bit))).collect()
    }

    #[test]
    fn a_healthy_plant_at_rest_has_none() {
        let plant = Compressor::new(1);
        assert_eq!(judge(&mut Alarms::new(), &plant, Inputs::default(), 60), []);
    }

    #[test]
    fn the_fuel_float_has_a_hysteresis_and_warns_through_input_3() {
        let mut plant = Compressor::new(1);
        let mut inputs = Inputs::default();
        let mut alarms = Alarms::new();
        let mut at = |percent, seconds| {
            plant.tank = Tank::new(percent);
            inputs.step(&plant, false);
            judge(&mut alarms, &plant, inputs, seconds)
        };
        assert_eq!(at(20.5, 5), []);
        assert_eq!(at(19.9, 1), [], "shorter than the delay");
        assert_eq!(at(19.9, 1), [(24, 2)]);
        assert_eq!(at(20.5, 5), [(24, 2)]);
        assert_eq!(at(21.1, 1), []);
    }

    #[test]
    fn the_door_contact_is_closed_and_inactive_while_the_door_is_shut() {
        let shut = Inputs::default();
        assert_eq!((shut.signals().register(0), shut.active().register(0)), (1 << 5, 0));
        let open = Inputs { door_open: true, ..shut };
        assert_eq!((open.signals().register(0), open.active().register(0)), (0, 1 << 4));
        assert_eq!(judge(&mut Alarms::new(), &Compressor::new(1), open, 1), [(33, 4)]);
    }

    #[test]
    fn a_warning_goes_with_its_cause_and_a_shutdown_stays_until_acknowledged() {
        let mut plant = Compressor::new(1);
        let mut alarms = Alarms::new();
        plant.air.pressure = 960.0;
        assert_eq!(judge(&mut alarms, &plant, Inputs::default(), 2), [(4, 9), (23, 9)]);
        plant.air.pressure = 500.0;
        assert_eq!(judge(&mut alarms, &plant, Inputs::default(), 1), [(4, 9)]);
        assert!(alarms.any_shutdown());
        alarms.acknowledge();
        assert_eq!(judge(&mut alarms, &plant, Inputs::default(), 1), []);
    }
}
