//! Whatever levers are pulled, keys pressed and alarms injected, in whatever order: every register holds what its panel
//! wants to say, and the same story told twice is the same.

use busbar_emulator::{Config, Lever};
use busbar_modbus::Request;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::site::Site;

const PROFILES: [&str; 4] = ["datakom-d", "datakom-dkg705", "smartgen-hat821si", "smartgen-acc1700"];
/// What starts, stops and switches: keys of the Datakom units, coils of the SmartGen ones.
const KEYS: [u16; 7] = [1, 2, 4, 8, 16, 32, 64];
const MODES: [u16; 4] = [0x10, 0x20, 0x40, 0x80];

#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    /// A lever by its number, and how far into its positions.
    Lever(usize, f64),
    /// A command by its number.
    Command(usize),
    /// An alarm by its number.
    Alarm(usize, bool),
}

/// What happens, and for how many tenths of a second it then goes on.
pub(crate) fn events() -> impl Strategy<Value = Vec<(Event, u64)>> {
    let event = prop_oneof![
        5 => (any::<usize>(), 0.0..1.0).prop_map(|(number, part)| Event::Lever(number, part)),
        3 => any::<usize>().prop_map(Event::Command),
        1 => (any::<usize>(), any::<bool>()).prop_map(|(number, on)| Event::Alarm(number, on)),
    ];
    prop::collection::vec((event, 0..250_u64), 1..25)
}

fn position(lever: &Lever, part: f64) -> String {
    let kinds = lever.words.len() + usize::from(lever.numbers.is_some());
    let place = part * kinds as f64;
    match (lever.words.get(place as usize), lever.numbers) {
        (Some(word), _) => word.id.to_owned(),
        (None, Some(range)) => (range.min + place.fract() * (range.max - range.min)).to_string(),
        (None, None) => unreachable!("a lever has words or numbers"),
    }
}

pub(crate) fn happen(site: &mut Site, event: Event) {
    match event {
        Event::Lever(number, part) => {
            let levers = site.device.levers();
            let Some(lever) = levers.get(number % levers.len().max(1)) else { return };
            site.device.pull(lever.id, &position(lever, part)).unwrap();
        }
        Event::Command(number) => {
            site.device.answer(1, &command(site, number));
        }
        Event::Alarm(number, on) => {
            let alarms: Vec<_> = site.device.alarms().collect();
            let alarm = alarms[number % alarms.len()];
            // One that follows from others is refused.
            let _ = site.device.inject(&format!("{}.{}", alarm.point, alarm.id), on);
        }
    }
}

fn command(site: &Site, number: usize) -> Request<'static> {
    let profile = site.device.profile();
    let coil = |number: usize| &profile.coils[number % profile.coils.len()];
    match profile.key.as_str() {
        "datakom-d" => Request::WriteSingleRegister { address: 8193, value: KEYS[number % KEYS.len()] },
        "datakom-dkg705" => {
            Request::WriteSingleRegister { address: 0x0040, value: MODES[number % MODES.len()] }
        }
        _ => Request::WriteSingleCoil { address: coil(number).address, value: 0xFF00 },
    }
}

/// What every reader of it would see in the end.
fn tell(profile: &str, seed: u64, events: &[(Event, u64)]) -> (Vec<u16>, u64) {
    let mut site = Site::new(&Config { profile: profile.into(), seed, ..Config::default() });
    for (event, tenths) in events {
        happen(&mut site, *event);
        site.pass(crate::site::TENTH * u32::try_from(*tenths).unwrap());
    }
    (site.image(), site.device.misfits())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(6),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn registers_hold_whatever_happens_and_it_happens_again_the_same(
        number in 0..PROFILES.len(),
        seed in any::<u64>(),
        events in events(),
    ) {
        let (image, misfits) = tell(PROFILES[number], seed, &events);
        prop_assert_eq!(misfits, 0);
        prop_assert!(image == tell(PROFILES[number], seed, &events).0);
    }
}

#[test]
fn each_position_of_each_lever_has_its_registers_on_load_and_off() {
    for profile in PROFILES {
        for running in [false, true] {
            let mut site = Site::new(&Config { profile: profile.into(), ..Config::default() });
            for lever in site.device.levers() {
                let healthy = lever.words.first().map_or("50", |word| word.id);
                let ends = lever.numbers.iter().flat_map(|numbers| [numbers.min, numbers.max]);
                let words = lever.words.iter().map(|word| word.id.to_owned());
                for position in words.chain(ends.map(|end| end.to_string())) {
                    if running {
                        // TEST on load of the D-series and the DKG-705, the start key of an ACC1700.
                        let start = if profile == "datakom-dkg705" || profile == "datakom-d" { 3 } else { 0 };
                        site.device.answer(1, &command(&site, start));
                    }
                    site.device.pull(lever.id, &position).unwrap();
                    site.pass_seconds(20);
                    assert_eq!(site.device.misfits(), 0, "{profile}: {} {position}", lever.id);
                }
                site.device.pull(lever.id, healthy).unwrap();
            }
        }
    }
}
