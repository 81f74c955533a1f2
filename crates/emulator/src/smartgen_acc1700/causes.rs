//! What gives an ACC1700 cause for an alarm: thresholds, inputs, sensors, the ECU and the countdowns.

use std::time::Duration;

use super::alarms::{ECU_SHUTDOWN, ECU_WARNING, FILTER_FAULT};
use super::ecu::Ecu;
use super::inputs::Inputs;
use super::readings::{Reading, Readings};
use super::sequence::{Sequence, Status};
use super::setup::{Action, Meaning, Setup};

/// How far a value has to come back before its alarm goes.
const RPM: f64 = 20.0;
const DEGC: f64 = 2.0;
const KILOPASCAL: f64 = 20.0;
const VOLT: f64 = 0.5;
/// In the unit of the sensor.
const OF_A_SENSOR: f64 = 3.0;

/// What is judged.
pub(super) struct View<'a> {
    pub(super) sequence: &'a Sequence,
    pub(super) readings: &'a Readings,
    pub(super) inputs: &'a Inputs,
    /// An ACC1700 has none.
    pub(super) ecu: Option<&'a Ecu>,
    /// Countdowns that have ended.
    pub(super) services_due: [bool; 10],
    pub(super) setup: &'a Setup,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Alarm,
    /// Inside the hysteresis, or nobody knows: it stays what it is.
    Between,
    Fine,
}

/// What one alarm is judged to be at this moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judgement {
    /// Register and bit.
    pub(super) at: (u16, u16),
    /// How long its cause has to last.
    pub(super) delay: Duration,
    pub(super) verdict: Verdict,
}

/// Judges every alarm that the plant can give cause for.
pub(super) fn judge(view: &View<'_>, mut take: impl FnMut(Judgement)) {
    for watch in &WATCHES {
        let (delay, verdict) = ((watch.delay)(view.setup), (watch.judge)(view));
        take(Judgement { at: watch.at, delay, verdict });
    }
    inputs(view, &mut take);
    sensors(view, &mut take);
    services(view, &mut take);
}

/// One cause, watched for some time.
struct Watch {
    /// Register and bit.
    at: (u16, u16),
    delay: fn(&Setup) -> Duration,
    judge: fn(&View<'_>) -> Verdict,
}

const fn watch(at: (u16, u16), delay: fn(&Setup) -> Duration, judge: fn(&View<'_>) -> Verdict) -> Watch {
    Watch { at, delay, judge }
}

fn at_once(_: &Setup) -> Duration {
    Duration::ZERO
}

const WATCHES: [Watch; 24] = [
    watch((1, 0), at_once, |v| when(v.inputs.emergency_stop())),
    watch((1, 1), |s| s.overspeed.delay, |v| high(v.readings.speed, v.setup.overspeed.shutdown, RPM)),
    watch((1, 2), |s| s.underspeed.delay, |v| v.slow(v.setup.underspeed.shutdown)),
    watch((1, 3), |s| s.speed_loss_delay, |v| v.speed_lost(Action::Shutdown)),
    watch((1, 8), at_once, |v| when(v.sequence.failed_to_start())),
    watch(ECU_SHUTDOWN, at_once, |v| v.ecu.map_or(Verdict::Fine, Ecu::stops)),
    watch((2, 0), |s| s.ecu_silence, |v| when(v.ecu.is_some_and(|ecu| !ecu.talks()))),
    watch((2, 1), |s| s.engine_temperature.delay, |v| v.hot(v.setup.engine_temperature.shutdown)),
    watch((2, 6), |s| s.oil_pressure.delay, |v| v.low_oil(v.setup.oil_pressure.shutdown)),
    watch((4, 9), |s| s.discharge_pressure.delay, |v| v.high_pressure(v.setup.discharge_pressure.shutdown)),
    watch((20, 0), |s| s.overspeed.delay, |v| high(v.readings.speed, v.setup.overspeed.warning, RPM)),
    watch((20, 1), |s| s.underspeed.delay, |v| v.slow(v.setup.underspeed.warning)),
    watch((20, 2), |s| s.speed_loss_delay, |v| v.speed_lost(Action::Warning)),
    watch((20, 3), at_once, |v| when(v.ecu.is_some_and(|ecu| ecu.filter().needs_a_person))),
    watch((20, 8), at_once, |v| when(v.sequence.status() == Status::StopFailure)),
    watch((20, 9), |s| s.charging_delay, |v| v.charging_fails()),
    watch((20, 10), |s| s.battery_delay, |v| above(v.readings.battery, v.setup.battery_high, VOLT)),
    watch((20, 11), |s| s.battery_delay, |v| v.battery_low()),
    watch(ECU_WARNING, at_once, |v| v.ecu.map_or(Verdict::Fine, Ecu::warns)),
    watch((21, 1), |s| s.engine_temperature.delay, |v| v.hot(v.setup.engine_temperature.warning)),
    watch(
        (21, 2),
        |s| s.engine_temperature.delay,
        |v| low(v.readings.coolant, v.setup.low_engine_temperature, DEGC),
    ),
    watch((21, 6), |s| s.oil_pressure.delay, |v| v.low_oil(v.setup.oil_pressure.warning)),
    watch((23, 9), |s| s.discharge_pressure.delay, |v| v.high_pressure(v.setup.discharge_pressure.warning)),
    watch(FILTER_FAULT, at_once, |v| when(v.ecu.is_some_and(|ecu| ecu.filter().failed))),
];

impl View<'_> {
    /// What only means something while the engine is watched.
    fn watched(&self, verdict: Verdict) -> Verdict {
        if self.sequence.status().is_watched() { verdict } else { Verdict::Fine }
    }

    /// A speed that is there, and too low where the engine is not told to idle.
    fn slow(&self, limit: f64) -> Verdict {
        match self.readings.speed {
            Reading::Value(0.0) => Verdict::Fine,
            _ if self.sequence.orders().idle => Verdict::Fine,
            speed => self.watched(low(speed, limit, RPM)),
        }
    }

    fn speed_lost(&self, action: Action) -> Verdict {
        let lost = self.readings.speed == Reading::Value(0.0);
        self.watched(when(lost && self.setup.speed_loss == action))
    }

    fn hot(&self, limit: f64) -> Verdict {
        high(self.readings.coolant, limit, DEGC)
    }

    fn low_oil(&self, limit: f64) -> Verdict {
        self.watched(low(self.readings.oil_pressure, limit, KILOPASCAL))
    }

    fn high_pressure(&self, limit: f64) -> Verdict {
        high(self.readings.discharge_pressure, limit, KILOPASCAL)
    }

    fn charging_fails(&self) -> Verdict {
        self.watched(below(self.readings.charger, self.setup.charging_low, 2.0 * VOLT))
    }

    /// The starter may pull it down.
    fn battery_low(&self) -> Verdict {
        match self.sequence.status() {
            Status::Crank => Verdict::Between,
            _ => below(self.readings.battery, self.setup.battery_low, VOLT),
        }
    }
}

/// The words 5, 24 and 33 bit by bit, and the three inputs with a name.
fn inputs(view: &View<'_>, take: &mut impl FnMut(Judgement)) {
    let active = |meaning: Meaning| {
        let inputs = view.setup.inputs.iter().zip(view.inputs.confirmed());
        inputs.filter(|(input, _)| input.meaning == meaning).any(|(_, active)| active)
    };
    for (bit, meaning) in
        [(13, Meaning::LowCoolant), (14, Meaning::HighTemperature), (15, Meaning::LowOilPressure)]
    {
        take(now((1, bit), view.watched(when(active(meaning)))));
    }
    for (bit, (input, active)) in (0..).zip(view.setup.inputs.iter().zip(view.inputs.confirmed())) {
        for (register, action) in [(5, Action::Shutdown), (24, Action::Warning), (33, Action::Indication)] {
            take(now((register, bit), when(active && input.meaning == Meaning::Own(action))));
        }
    }
}

/// Open, high and low of each sensor: a shutdown, and 19 registers on a warning. And the error of the fourth.
fn sensors(view: &View<'_>, take: &mut impl FnMut(Judgement)) {
    const SHUTDOWNS: [(u16, u16); 5] = [(2, 8), (2, 12), (3, 0), (3, 4), (3, 8)];
    const WARNINGS_FROM: u16 = 19;
    let delay = view.setup.sensor_delay;
    let shorted = view.readings.sensors[3] == Reading::Shorted;
    take(Judgement { at: (22, 7), delay, verdict: when(shorted) });
    for (index, (sensor, setup)) in view.readings.sensors.iter().zip(&view.setup.sensors).enumerate() {
        let (register, bit) = SHUTDOWNS[index];
        // A sensor of the engine's has the engine's alarms.
        let value = if view.readings.is_of_the_engine(index) { Reading::Absent } else { *sensor };
        let open = |action: Action| when(*sensor == Reading::Broken && setup.open == action);
        let rows = [
            (register, open(Action::Shutdown), setup.high.1, setup.low.1),
            (register + WARNINGS_FROM, open(Action::Warning), setup.high.0, setup.low.0),
        ];
        for (register, open, too_high, too_low) in rows {
            take(Judgement { at: (register, bit), delay, verdict: open });
            let (too_high, too_low) = (high(value, too_high, OF_A_SENSOR), low(value, too_low, OF_A_SENSOR));
            take(Judgement { at: (register, bit + 1), delay, verdict: too_high });
            take(Judgement { at: (register, bit + 2), delay, verdict: too_low });
        }
    }
}

fn services(view: &View<'_>, take: &mut impl FnMut(Judgement)) {
    for (bit, (setup, due)) in (0..).zip(view.setup.services.iter().zip(view.services_due)) {
        for (register, action) in [(6, Action::Shutdown), (25, Action::Warning), (34, Action::Indication)] {
            take(now((register, bit), when(due && setup.due == action)));
        }
    }
}

fn now(at: (u16, u16), verdict: Verdict) -> Judgement {
    Judgement { at, delay: Duration::ZERO, verdict }
}

pub(super) fn when(cause: bool) -> Verdict {
    if cause { Verdict::Alarm } else { Verdict::Fine }
}

fn low(reading: Reading, limit: f64, hysteresis: f64) -> Verdict {
    match reading {
        Reading::Value(value) => below(value, limit, hysteresis),
        Reading::Broken | Reading::Shorted => Verdict::Between,
        Reading::Absent => Verdict::Fine,
    }
}

fn high(reading: Reading, limit: f64, hysteresis: f64) -> Verdict {
    match reading {
        Reading::Value(value) => above(value, limit, hysteresis),
        other => low(other, limit, hysteresis),
    }
}

fn below(value: f64, limit: f64, hysteresis: f64) -> Verdict {
    match value {
        value if value < limit => Verdict::Alarm,
        value if value < limit + hysteresis => Verdict::Between,
        _ => Verdict::Fine,
    }
}

fn above(value: f64, limit: f64, hysteresis: f64) -> Verdict {
    below(-value, -limit, hysteresis)
}
