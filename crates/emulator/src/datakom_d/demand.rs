//! What AUTO wants of the genset: mains that fail, a remote start, the exerciser, a peak of the load.

use std::time::Duration;

use super::contacts::Contacts;
use super::mains::Mains;
use super::operation::Operation;
use super::readings::Readings;
use super::sequence::{Demand, Source};
use super::settings::Settings;

/// A peak is over when the load lies this far below the limit, kW.
const PEAK_HYSTERESIS: f64 = 5.0;

/// The load of the site held against what the mains are to give at most.
#[derive(Clone, Debug, Default)]
pub(super) struct Peak {
    wanted: bool,
    /// How long the load has said otherwise.
    doubted: Duration,
}

impl Peak {
    pub(super) fn step(&mut self, dt: Duration, readings: &Readings, settings: &Settings) {
        if !settings.peak_lopping {
            *self = Self::default();
            return;
        }
        let load = readings.mains_active + readings.genset_active;
        let limit = settings.peak_lopping_power;
        let (otherwise, delay) = match self.wanted {
            true => (load < limit - PEAK_HYSTERESIS, settings.peak_lopping_return),
            false => (load > limit, settings.peak_lopping_delay),
        };
        self.doubted = if otherwise { self.doubted + dt } else { Duration::ZERO };
        if otherwise && self.doubted >= delay {
            (self.wanted, self.doubted) = (!self.wanted, Duration::ZERO);
        }
    }
}

/// What AUTO goes by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Causes<'a> {
    pub(super) settings: &'a Settings,
    pub(super) contacts: Contacts,
    pub(super) mains: &'a Mains,
    /// The mains are good, and their breaker obeys.
    pub(super) mains_usable: bool,
    pub(super) remote_start: bool,
    pub(super) exerciser: bool,
    pub(super) peak: &'a Peak,
    pub(super) operation: Operation,
}

impl Causes<'_> {
    /// The first cause in the order of their weight decides.
    pub(super) fn auto(self) -> Demand {
        if self.contacts.auto_start_disabled && !self.operation.is_committed() {
            return Demand::REST;
        }
        if let Some(backup) = self.backup() {
            return backup;
        }
        match () {
            () if self.contacts.force_to_start => Demand::ON_LOAD,
            () if self.remote_start && self.settings.power_export => Demand::EXPORTING,
            () if self.remote_start => Demand::ON_LOAD,
            () if self.exerciser && self.settings.exerciser_on_load => Demand::ON_LOAD,
            () if self.exerciser => Demand::OFF_LOAD,
            () if self.peak.wanted => Demand::PEAK_LOPPING,
            () => Demand::REST,
        }
    }

    /// What mains that have failed ask for, and mains that are not trusted again.
    ///
    /// A genset that was not cranked yet is not needed once they are back; one that was waits beside the load until
    /// they are trusted, or keeps the load until then.
    pub(super) fn backup(self) -> Option<Demand> {
        match self.mains_usable {
            false => Some(Demand::ON_LOAD),
            true if self.contacts.restore_inhibited && self.operation.has_the_load() => Some(Demand::ON_LOAD),
            true if self.mains.is_trusted() || !self.operation.is_committed() => None,
            true if self.operation.carries_load() => Some(Demand::ON_LOAD),
            true => Some(Demand { engine: true, source: Source::Mains }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_peak_is_one_after_its_delay_and_is_over_after_another() {
        let settings = Settings {
            peak_lopping: true,
            peak_lopping_power: 30.0,
            peak_lopping_delay: 5 * SECOND,
            peak_lopping_return: 10 * SECOND,
            ..Settings::default()
        };
        let mut peak = Peak::default();
        let mut pass = |kw: f64, seconds: u32| {
            for _ in 0..seconds {
                peak.step(SECOND, &Readings { mains_active: kw, ..Readings::default() }, &settings);
            }
            peak.wanted
        };
        assert!(!pass(40.0, 4));
        assert!(!pass(29.0, 1));
        assert!(!pass(40.0, 4));
        assert!(pass(40.0, 1));
        assert!(pass(27.0, 60), "inside the hysteresis");
        assert!(pass(20.0, 9));
        assert!(!pass(20.0, 1));
    }

    #[test]
    fn mains_that_come_back_are_waited_for_only_by_an_engine_that_was_cranked() {
        let settings = Settings::usual();
        let mut mains = Mains::good();
        mains.configure(&settings.mains);
        let dead = crate::plant::Feed::default();
        let good = crate::plant::Feed { voltage: [231.0; 3], frequency: 50.0, ..dead.clone() };
        let peak = Peak::default();
        let auto = |mains: &Mains, operation| {
            let causes = Causes {
                settings: &settings,
                contacts: Contacts::default(),
                mains,
                mains_usable: mains.is_healthy(),
                remote_start: false,
                exerciser: false,
                peak: &peak,
                operation,
            };
            causes.auto()
        };
        assert_eq!(auto(&mains, Operation::AtRest), Demand::REST);
        for _ in 0..10 {
            mains.step(SECOND, &dead, true);
        }
        assert_eq!(auto(&mains, Operation::AtRest), Demand::ON_LOAD);
        mains.step(SECOND, &good, true);
        assert_eq!(auto(&mains, Operation::Preheat), Demand::REST);
        assert_eq!(auto(&mains, Operation::Heating), Demand::OFF_LOAD);
        assert_eq!(auto(&mains, Operation::OnLoad), Demand::ON_LOAD);
        for _ in 0..settings.mains.waiting.as_secs() {
            mains.step(SECOND, &good, true);
        }
        assert_eq!(auto(&mains, Operation::OnLoad), Demand::REST);
    }
}
