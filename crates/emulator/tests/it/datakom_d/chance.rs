//! Whatever happens to the plant and whoever presses keys: every image of the registers obeys the same laws.

use std::collections::BTreeSet;

use busbar_emulator::Position;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use super::{LOAD_DUMP, SHUTDOWN, WARNING, closed, set};
use crate::site::Site;

#[derive(Clone, Debug)]
enum Event {
    Keys(u16),
    /// A lever, and one of its words or a place in its range.
    Pull(Index, Index, f64),
    /// An alarm, given or taken back.
    Inject(Index, bool),
    Channel(u16),
}

fn event() -> impl Strategy<Value = Event> {
    let key = prop_oneof![
        4 => select((0..11).map(|bit| 1 << bit).collect::<Vec<u16>>()),
        1 => any::<u16>(),
    ];
    prop_oneof![
        4 => key.prop_map(Event::Keys),
        6 => (any::<Index>(), any::<Index>(), 0.0..1.0).prop_map(|(lever, word, part)| Event::Pull(lever, word, part)),
        1 => (any::<Index>(), any::<bool>()).prop_map(|(alarm, active)| Event::Inject(alarm, active)),
        1 => (0..22_u16).prop_map(Event::Channel),
    ]
}

fn happen(site: &mut Site, event: &Event) {
    match event {
        Event::Keys(keys) => site.press(*keys),
        Event::Channel(channel) => site.write(crate::site::CHANNEL_SELECT, *channel),
        Event::Pull(lever, word, part) => {
            let lever = lever.get(site.device.levers());
            let to = match lever.numbers {
                Some(range) if lever.words.is_empty() || *part < 0.5 => {
                    Position::Number(range.min + part * (range.max - range.min)).to_string()
                }
                _ => word.get(lever.words).id.to_owned(),
            };
            site.device.pull(lever.id, &to).unwrap();
        }
        Event::Inject(alarm, active) => {
            let alarms: Vec<_> = site.device.alarms().collect();
            let alarm = alarm.get(&alarms);
            site.device.inject(&format!("{}.{}", alarm.point, alarm.id), *active).unwrap();
        }
    }
}

fn obeys(site: &Site) -> Result<(), TestCaseError> {
    let status = site.code("operation_status");
    prop_assert!(status <= 25);
    let [shutdown, load_dump, warning] =
        [SHUTDOWN, LOAD_DUMP, WARNING].map(|array| !site.bits(array).is_empty());
    let derived = [shutdown, load_dump, warning, shutdown || load_dump, shutdown || load_dump || warning];
    prop_assert_eq!([50, 51, 52, 53, 54].map(|flag| site.flag(flag)), derived);
    prop_assert_eq!(&site.codes("leds")[..3], &[shutdown, load_dump, warning].map(u8::from)[..]);
    prop_assert!(!site.flag(41) || !(shutdown || load_dump), "never ready with an alarm that has tripped it");

    // Outputs and flags are one.
    for (flag, output) in [(0, 0), (2, 1), (4, 2), (5, 3), (1, 4), (7, 5), (20, 6), (18, 7)] {
        prop_assert_eq!(site.flag(flag), site.bits("digital_outputs").contains(output), "flag {}", flag);
    }
    prop_assert!(!site.flag(2) || site.flag(0), "never cranked without fuel");

    for source in ["mains", "genset"] {
        let [p, q, s] =
            ["active", "reactive", "apparent"].map(|what| site.number(&format!("{source}_{what}_power")));
        prop_assert!((s - p.hypot(q)).abs() < 0.06, "{}: {} {} {}", source, p, q, s);
    }
    if site.number("pickup_speed") > 0.0 {
        let (rpm, hertz) = (site.number("engine_speed"), site.number("genset_frequency"));
        prop_assert!((rpm / 30.0 - hertz).abs() < 0.022, "{} rpm, {} Hz", rpm, hertz);
    }
    let harmonics = (3..=31).step_by(2).map(|order| site.number(&format!("channel_harmonic_{order}")));
    let distortion = harmonics.map(|level| level * level).sum::<f64>().sqrt();
    prop_assert!((distortion - site.number("channel_thd")).abs() < 0.006);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_image_obeys_whatever_happens(
        settings in select(vec![
            vec![],
            vec![("no_break_transfer", "1"), ("soft_transfer", "1")],
            vec![("peak_lopping", "1"), ("no_break_transfer", "1")],
            vec![("power_export", "1"), ("slave_unit", "1")],
        ]),
        script in prop::collection::vec((event(), 1..120_u64), 1..40),
    ) {
        let with_break = settings.is_empty();
        let mut site = set(&settings);
        let mut counters = [0.0; 3];
        let mut before = (site.flag(2), site.number("engine_speed"));
        for (event, tenths) in &script {
            happen(&mut site, event);
            for _ in 0..*tenths {
                site.pass(crate::site::TENTH);
                obeys(&site)?;
                let now = (site.flag(2), site.number("engine_speed"));
                prop_assert!(before.0 || !now.0 || before.1 == 0.0, "cranked at {} rpm", before.1);
                before = now;
                // With a break the two meet only where a breaker is stuck or somebody wants them side by side.
                let stuck = ["breaker.genset", "breaker.mains"].map(|lever| site.device.lever(lever));
                if with_break && stuck.iter().all(|lever| *lever == Some(Position::Word("normal"))) {
                    let driven = site.flag(4) && site.flag(5);
                    prop_assert!(!driven, "both contactors driven");
                }
            }
            let now = ["genset_runs", "genset_cranks", "genset_loadings"].map(|id| site.number(id));
            prop_assert!(counters.iter().zip(&now).all(|(before, after)| before <= after));
            counters = now;
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }

    #[test]
    fn a_site_that_is_put_right_comes_home(
        settings in select(vec![
            vec![],
            vec![("no_break_transfer", "1"), ("soft_transfer", "1")],
            vec![("peak_lopping", "1"), ("peak_lopping_power", "60"), ("power_export", "1"), ("slave_unit", "1")],
        ]),
        script in prop::collection::vec((event(), 1..120_u64), 1..40),
    ) {
        let mut site = set(&settings);
        for (event, tenths) in &script {
            happen(&mut site, event);
            site.pass(crate::site::TENTH * u32::try_from(*tenths).unwrap());
        }
        let alarms: Vec<_> = site.device.alarms().map(|alarm| format!("{}.{}", alarm.point, alarm.id)).collect();
        for alarm in alarms {
            site.device.inject(&alarm, false).unwrap();
        }
        for lever in site.device.levers() {
            let healthy = lever.words.first().map_or("80", |word| word.id);
            site.device.pull(lever.id, healthy).unwrap();
        }
        // What overheated has to cool before its alarm can be reset.
        site.press(crate::site::STOP);
        site.pass_seconds(600);
        site.press(crate::site::STOP);
        site.press(crate::site::AUTO);
        site.pass_seconds(5);
        prop_assert_eq!(site.code("operation_status"), 0);
        prop_assert!(site.bits(SHUTDOWN).is_empty() && site.bits(LOAD_DUMP).is_empty());
        prop_assert_eq!(closed(&site), (false, true));
        prop_assert!(super::load(&site) > 20.0);
        super::pull(&mut site, "mains", "failed");
        site.pass_seconds(90);
        prop_assert_eq!(closed(&site), (true, false));
        prop_assert!(super::load(&site) > 20.0);
    }

    #[test]
    fn a_genset_that_has_tripped_stops_and_stays(
        script in prop::collection::vec((event(), 1..60_u64), 1..12),
        alarm in any::<Index>(),
    ) {
        let mut site = Site::quiet();
        for (event, tenths) in &script {
            happen(&mut site, event);
            site.pass(crate::site::TENTH * u32::try_from(*tenths).unwrap());
        }
        // A solenoid that sticks keeps the engine turning whatever the unit does.
        site.device.pull("fuel.solenoid", "normal").unwrap();
        site.device.pull("breaker.genset", "normal").unwrap();
        let alarms: Vec<_> = site.device.alarms().filter(|alarm| alarm.point == SHUTDOWN).collect();
        site.device.inject(&format!("{SHUTDOWN}.{}", alarm.get(&alarms).id), true).unwrap();
        site.pass_seconds(60);
        let mut statuses = BTreeSet::new();
        for _ in 0..100 {
            site.pass(crate::site::TENTH);
            statuses.insert(site.code("operation_status"));
            prop_assert!(!closed(&site).0, "its breaker is open");
            prop_assert_eq!(site.number("engine_speed"), 0.0);
        }
        prop_assert_eq!(statuses.into_iter().collect::<Vec<_>>(), [0]);
    }
}
