//! The ECU of an ACC1700CAN: what it sends over J1939 beside its measurements.

use crate::levers::Position;
use crate::plant::Compressor;

use super::causes::{Verdict, when};

/// degC of the coolant, and bar of oil while the engine runs, at which it warns and at which it asks for a stop.
const WARNS_AT: (f64, f64) = (106.0, 0.9);
const STOPS_AT: (f64, f64) = (112.0, 0.6);

/// The last that it sent.
#[derive(Clone, Debug)]
pub(super) struct Ecu {
    /// Its line is whole.
    talks: bool,
    /// The amber lamp.
    warns: bool,
    /// The red lamp.
    stops: bool,
    filter: Filter,
}

/// What it says of the particle filter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Filter {
    /// It is too full to be burned clean.
    pub(super) failed: bool,
    /// Hardly any exhaust goes through it.
    pub(super) plugged: bool,
    /// It is full and waits for a hot exhaust.
    pub(super) waits: bool,
    /// It burns its soot, in an exhaust that is hotter for it.
    pub(super) burns: bool,
    /// It never gets hot enough: somebody has to see to it.
    pub(super) needs_a_person: bool,
    /// Somebody has forbidden it to burn.
    pub(super) inhibited: bool,
    /// Somebody has asked it to burn, and it does as it is asked.
    pub(super) by_hand: bool,
}

impl Ecu {
    pub(super) fn new() -> Self {
        Self { talks: true, warns: false, stops: false, filter: Filter::default() }
    }

    /// `watched` is whether the engine has had time to build up its oil pressure; one that dies has no reason to.
    pub(super) fn step(&mut self, plant: &Compressor, watched: bool) {
        self.talks = !plant.ecu_silent;
        if !self.talks {
            return;
        }
        let senders = plant.readings();
        let blind = senders.coolant.is_none() || senders.oil_pressure.is_none() || senders.speed.is_none();
        let beyond = |(degc, bar): (f64, f64)| {
            senders.coolant.is_some_and(|coolant| coolant > degc)
                || watched
                    && plant.engine.is_running()
                    && senders.oil_pressure.is_some_and(|pressure| pressure < bar)
        };
        self.filter = Filter {
            failed: plant.filter.has_failed(),
            plugged: plant.filter.is_plugged(),
            waits: plant.filter.is_waiting(),
            burns: plant.filter.is_regenerating(),
            needs_a_person: plant.filter.needs_a_person(),
            inhibited: plant.filter.is_inhibited(),
            by_hand: plant.lever("dpf.regeneration") == Some(Position::Word("by_hand")),
        };
        self.warns = beyond(WARNS_AT) || blind || self.filter.failed || self.filter.needs_a_person;
        self.stops = beyond(STOPS_AT) || self.filter.plugged;
    }

    pub(super) fn talks(&self) -> bool {
        self.talks
    }

    pub(super) fn warns(&self) -> Verdict {
        when(self.talks && self.warns)
    }

    pub(super) fn stops(&self) -> Verdict {
        when(self.talks && self.stops)
    }

    /// What it says of the filter: nothing, where it is silent.
    pub(super) fn filter(&self) -> Filter {
        if self.talks { self.filter } else { Filter::default() }
    }
}
