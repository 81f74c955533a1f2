//! What holds in every image that a client can read, over an hour with the story running.

use busbar_emulator::Config;

use crate::site::Site;

pub(crate) const SOURCES: [&str; 2] = ["mains", "genset"];
const QUANTITIES: [&str; 3] = ["active_power", "reactive_power", "apparent_power"];
pub(crate) const GROWING: [&str; 13] = [
    "genset_runs",
    "genset_cranks",
    "genset_loadings",
    "engine_hours",
    "hours_since_service",
    "days_since_service",
    "genset_active_energy",
    "genset_inductive_energy",
    "genset_capacitive_energy",
    "mains_active_energy",
    "mains_inductive_energy",
    "export_active_energy",
    "fuel_counter",
];
const SHRINKING: [&str; 3] = ["service_1_hours_left", "service_2_days_left", "service_3_hours_left"];

#[test]
fn an_hour_obeys_physics_whatever_the_seed() {
    for (seed, seconds) in [(1, 1), (2, 4), (0xDEAD_BEEF, 4)] {
        let mut site = Site::new(&Config { seed, story: true, ..Config::default() });
        let mut last = Vec::new();
        let mut coolant = site.number("engine_temperature");
        let mut voltages = Vec::new();
        for second in (0..3600).step_by(seconds) {
            site.pass_seconds(seconds as u64);
            let place = format!("seed {seed}, second {second}");
            for source in SOURCES {
                voltages_agree(&site, source, &place);
                powers_agree(&site, source, &place);
            }
            speed_agrees(&site, &place);
            switching_agrees(&site, &place);
            derived_bits_agree(&site, &place);

            let now: Vec<f64> = GROWING.iter().map(|id| site.number(id)).collect();
            let left: Vec<f64> = SHRINKING.iter().map(|id| -site.number(id)).collect();
            let now = [now, left].concat();
            assert!(
                last.iter().zip(&now).all(|(before, after)| before <= after),
                "{place}: {last:?} {now:?}"
            );
            last = now;

            let warmer = site.number("engine_temperature");
            assert!((warmer - coolant).abs() <= 0.5 * seconds as f64, "{place}: temperatures have a memory");
            coolant = warmer;
            voltages.push(site.number("mains_l1_voltage"));
        }
        assert_eq!(site.device.misfits(), 0);
        voltages.sort_by(f64::total_cmp);
        voltages.dedup();
        assert!(voltages.len() > 20, "values move");
        assert!(site.number("genset_runs") > 5.0);
    }
}

fn voltages_agree(site: &Site, source: &str, place: &str) {
    let phase = [1, 2, 3].map(|n| site.number(&format!("{source}_l{n}_voltage")));
    let lines = [("l1_l2", 0, 1), ("l2_l3", 1, 2), ("l3_l1", 2, 0)];
    for (name, a, b) in lines {
        let line = site.number(&format!("{source}_{name}_voltage"));
        let expected = 3.0_f64.sqrt() * (phase[a] + phase[b]) / 2.0;
        assert!((line - expected).abs() < 0.3, "{place}: {source} {name} {line} {phase:?}");
    }
    let average = site.number(&format!("{source}_average_voltage"));
    assert!(
        (average - phase.iter().sum::<f64>() / 3.0).abs() < 0.101,
        "{place}: {source} {average} {phase:?}"
    );
}

pub(crate) fn powers_agree(site: &Site, source: &str, place: &str) {
    let [p, q, s] =
        QUANTITIES.map(|quantity| [1, 2, 3].map(|n| site.number(&format!("{source}_l{n}_{quantity}"))));
    let [total_p, total_q, total_s] = QUANTITIES.map(|quantity| site.number(&format!("{source}_{quantity}")));
    // Tenths add up without loss.
    for (total, phases) in [(total_p, p), (total_q, q)] {
        assert!((total - phases.iter().sum::<f64>()).abs() < 1e-6, "{place}: {source} {total} {phases:?}");
    }
    assert!((total_s - s.iter().sum::<f64>()).abs() < 0.3, "{place}: {source} {total_s} {s:?}");
    assert!((total_s - total_p.hypot(total_q)).abs() < 0.06, "{place}: {source}");

    let mut currents = 0.0;
    for n in 0..3 {
        let volts = site.number(&format!("{source}_l{}_voltage", n + 1));
        let amps = site.number(&format!("{source}_l{}_current", n + 1));
        let factor = site.number(&format!("{source}_l{}_power_factor", n + 1));
        currents += amps;
        assert!((s[n] - p[n].hypot(q[n])).abs() < 0.06, "{place}: {source} L{}", n + 1);
        assert!((s[n] - volts * amps / 1000.0).abs() < 0.09, "{place}: {source} L{} {volts} {amps}", n + 1);
        let expected = if s[n] > 0.0 { p[n] / s[n] } else { 0.0 };
        assert!((factor - expected).abs() < 0.06, "{place}: {source} L{} {factor} {expected}", n + 1);
    }
    let average = site.number(&format!("{source}_average_current"));
    assert!((average - currents / 3.0).abs() < 0.101, "{place}: {source}");
}

fn speed_agrees(site: &Site, place: &str) {
    let (rpm, hertz) = (site.number("engine_speed"), site.number("genset_frequency"));
    // Four poles; both are rounded.
    assert!((rpm / 30.0 - hertz).abs() < 0.022, "{place}: {rpm} rpm, {hertz} Hz");
    assert_eq!(rpm, site.number("pickup_speed"), "{place}");
    if rpm == 0.0 {
        assert_eq!(site.number("genset_l1_voltage"), 0.0, "{place}");
    }
    if site.flag(46) {
        assert!(rpm > 400.0, "{place}: engine running at {rpm} rpm");
    }
}

fn switching_agrees(site: &Site, place: &str) {
    let inputs = site.codes("onboard_inputs");
    let (genset_closed, mains_closed) = (inputs[0] == 1, inputs[1] == 1);
    assert!(!(genset_closed && mains_closed), "{place}: both breakers closed");
    assert!(!(site.flag(4) && site.flag(5)), "{place}: both contactors driven");
    assert_eq!(site.number("mains_active_power") > 0.0, mains_closed, "{place}");
    assert_eq!(site.number("genset_active_power") > 0.0, genset_closed, "{place}");
    let status = site.code("operation_status");
    if status == 13 {
        // Driven, or released and on its way.
        assert!(site.flag(4) != site.flag(11) && site.flag(46), "{place}");
    }
    // The canonical word of the status says whether the genset carries the load.
    let profile = site.device.profile();
    let word = profile.point("operation_status").unwrap().choice(status).unwrap().state.as_deref();
    assert_eq!(word == Some("loaded"), genset_closed, "{place}: status {status}");
    if [12, 20].contains(&status) {
        assert!(!genset_closed && !mains_closed, "{place}: status {status}");
    }
    if status == 0 {
        assert!(site.flag(5) && site.flag(60) && !site.flag(0) && !site.flag(46), "{place}");
    }
    if [0, 8, 13].contains(&status) {
        assert_eq!(site.number("operation_timer"), 0.0, "{place}");
    }
}

#[test]
fn what_carries_the_load_and_the_status_agree_at_every_moment() {
    use crate::site::{AUTO, GCB, MCB, RUN, STOP, TENTH, TEST};
    let mut site = Site::quiet();
    let keys = [
        (0, TEST),
        (45, AUTO),
        (48, RUN),
        (55, GCB),
        (57, MCB),
        (65, GCB),
        (70, TEST),
        (80, STOP),
        (81, STOP),
        (120, RUN),
        (150, GCB),
        (158, GCB),
        (160, MCB),
        (162, STOP),
    ];
    let mut statuses = std::collections::BTreeSet::new();
    for tenth in 0..2400 {
        if let Some((_, pressed)) = keys.iter().find(|(second, _)| second * 10 == tenth) {
            site.press(*pressed);
            switching_agrees(&site, &format!("tenth {tenth}, key {pressed}"));
        }
        site.pass(TENTH);
        switching_agrees(&site, &format!("tenth {tenth}"));
        statuses.insert(site.code("operation_status"));
    }
    assert!([8, 11, 12, 13, 19, 20, 24].iter().all(|status| statuses.contains(status)), "{statuses:?}");
}

fn derived_bits_agree(site: &Site, place: &str) {
    let [shutdown, load_dump, warning] =
        ["shutdown_alarms", "load_dump_alarms", "warning_alarms"].map(|array| !site.bits(array).is_empty());
    let derived = [shutdown, load_dump, warning, shutdown || load_dump, shutdown || load_dump || warning];
    assert_eq!([50, 51, 52, 53, 54].map(|flag| site.flag(flag)), derived, "{place}");
    let leds = site.codes("leds");
    assert_eq!(leds[..3], [u8::from(shutdown), u8::from(load_dump), u8::from(warning)], "{place}");

    let modes = [(55, 8), (56, 4), (57, 2), (58, 1)];
    let mode = site.code("unit_mode");
    for (flag, code) in modes {
        assert_eq!(site.flag(flag), mode == code, "{place}: mode {mode}, flag {flag}");
    }
    assert_eq!(site.flag(59), mode != 4, "{place}");
}

#[test]
fn the_story_shows_every_status_of_a_run_and_a_warning_that_comes_and_goes() {
    let mut site = Site::new(&Config { story: true, ..Config::default() });
    let mut statuses = vec![0];
    let mut warnings = vec![false];
    for _ in 0..(2 * 270 * 10) {
        site.pass(crate::site::TENTH);
        let status = site.code("operation_status");
        if statuses.last() != Some(&status) {
            statuses.push(status);
        }
        let low_fuel = site.bits("warning_alarms").contains(58);
        if warnings.last() != Some(&low_fuel) {
            warnings.push(low_fuel);
        }
        assert!(site.bits("shutdown_alarms").is_empty());
    }
    let run = [1, 2, 3, 5, 6, 7, 8, 12, 11, 13, 20, 19, 21, 22, 23, 25, 0];
    assert_eq!(statuses, [vec![0], run.to_vec(), run.to_vec()].concat());
    assert_eq!(warnings, [false, true, false, true, false]);
}

#[test]
fn the_same_seed_and_inputs_give_the_same_registers_however_time_is_cut() {
    let story = |seed| Config { seed, story: true, ..Config::default() };
    let mut fine = Site::new(&story(5));
    let mut coarse = Site::new(&story(5));
    let mut other = Site::new(&story(6));
    for site in [&mut fine, &mut coarse, &mut other] {
        site.write(crate::site::CHANNEL_SELECT, 12);
    }
    for _ in 0..900 {
        fine.pass(crate::site::TENTH);
    }
    coarse.pass_seconds(90);
    other.pass_seconds(90);
    assert_eq!(fine.image(), coarse.image());
    assert_ne!(fine.image(), other.image());
    assert!(fine.image() != Site::new(&story(5)).image());
}
