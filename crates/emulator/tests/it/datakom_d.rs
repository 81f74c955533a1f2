//! The D-series unit with its plant: levers are pulled, and a client reads what becomes of it.

mod alarms;
mod auto;
mod chance;
mod contacts;
mod display;
mod g59;
mod meters;
mod parallel;
mod settings;
mod share;

use busbar_emulator::Config;

use crate::site::{Site, TENTH};

pub(crate) const SHUTDOWN: &str = "shutdown_alarms";
pub(crate) const LOAD_DUMP: &str = "load_dump_alarms";
pub(crate) const WARNING: &str = "warning_alarms";

/// A site with settings of its own.
pub(crate) fn set(settings: &[(&str, &str)]) -> Site {
    let pins = settings.iter().map(|(id, value)| ((*id).to_owned(), (*value).to_owned())).collect();
    Site::new(&Config { pins, ..Config::default() })
}

pub(crate) fn pull(site: &mut Site, lever: &str, to: &str) {
    site.device.pull(lever, to).unwrap();
}

/// Genset and mains breaker.
pub(crate) fn closed(site: &Site) -> (bool, bool) {
    let inputs = site.codes("onboard_inputs");
    (inputs[0] == 1, inputs[1] == 1)
}

/// All alarms of an array.
pub(crate) fn alarms(site: &Site, array: &str) -> Vec<u16> {
    site.bits(array).iter().collect()
}

/// kW on both feeds together.
pub(crate) fn load(site: &Site) -> f64 {
    site.number("mains_active_power") + site.number("genset_active_power")
}

/// Lets time pass until something holds; the seconds that took.
pub(crate) fn until(site: &mut Site, seconds: u32, holds: impl Fn(&Site) -> bool) -> f64 {
    for tenths in 0..seconds * 10 {
        if holds(site) {
            return f64::from(tenths) / 10.0;
        }
        site.pass(TENTH);
    }
    panic!(
        "it did not come in {seconds} s: status {}, {:?} {:?} {:?}",
        site.code("operation_status"),
        alarms(site, SHUTDOWN),
        alarms(site, LOAD_DUMP),
        alarms(site, WARNING)
    );
}
