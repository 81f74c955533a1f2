//! The HAT821SI from outside: what it shows, what it obeys, and what its manual lets through.

mod alarms;
mod commands;
mod gensets;
mod identities;
mod loads;
mod transfers;
mod values;
mod wire;

use busbar_emulator::Config;
use busbar_modbus::{Request, Response};

use crate::site::Site;

const ON: u16 = 0xFF00;
const OFF: u16 = 0x0000;

fn config() -> Config {
    Config { profile: "smartgen-hat821si".into(), ..Config::default() }
}

fn quiet() -> Site {
    Site::new(&config())
}

fn with_story(seed: u64) -> Site {
    Site::new(&Config { seed, story: true, ..config() })
}

/// Writes a coil and expects the echo.
fn send(site: &mut Site, address: u16, value: u16) {
    let request = Request::WriteSingleCoil { address, value };
    assert_eq!(site.device.answer(1, &request), Some(Response::WriteSingleCoil { address, value }));
}

/// Writes FF00h to the coil of that name.
fn set(site: &mut Site, coil: &str) {
    let coils = &site.device.profile().coils;
    let address =
        coils.iter().find(|known| known.id == coil).unwrap_or_else(|| panic!("no coil {coil}")).address;
    send(site, address, ON);
}

fn bit(site: &Site, point: &str, bit: u16) -> bool {
    site.bits(point).contains(bit)
}

/// QS1, QTIE and QS2.
fn positions(site: &Site) -> [u8; 3] {
    [bit(site, "switches", 4), bit(site, "tie_switch", 7), bit(site, "switches", 5)].map(u8::from)
}

/// Pulls a lever.
fn pull(site: &mut Site, lever: &str, to: &str) {
    site.device.pull(lever, to).unwrap();
}

/// A site where these are set.
fn with(settings: &[(&str, &str)]) -> Site {
    let mut site = quiet();
    settings.iter().for_each(|(id, value)| site.device.set(id, value).unwrap());
    site
}

/// Whether the alarm of that name is active.
fn has(site: &Site, alarm: &str) -> bool {
    let mut alarms = site.device.alarms();
    let alarm = alarms.find(|known| known.id == alarm).unwrap_or_else(|| panic!("no alarm {alarm}"));
    bit(site, alarm.point, alarm.bit)
}

/// The alarms that are active, by name.
fn active(site: &Site) -> Vec<&'static str> {
    site.device.alarms().filter(|alarm| bit(site, alarm.point, alarm.bit)).map(|alarm| alarm.id).collect()
}

/// Lets time pass until this is so; how many tenths that took.
fn until(site: &mut Site, tenths: u32, what: &str, is_so: impl Fn(&Site) -> bool) -> u32 {
    for passed in 0..tenths {
        if is_so(site) {
            return passed;
        }
        site.pass(crate::site::TENTH);
    }
    panic!("{what}: not within {tenths} tenths; {:?}, {:?}", positions(site), active(site));
}
