//! What holds in one image of each family, whatever levers are pulled, keys pressed and alarms injected: line voltages
//! follow from phases, apparent power from active and reactive, frequency from speed; what is on one busbar has one
//! voltage, counters only grow, and temperatures have a memory.

use busbar_emulator::Config;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::identities::{GROWING, SOURCES, powers_agree};
use crate::levers::{Event, events, happen};
use crate::site::{Site, TENTH};

/// How often an image is looked at.
const LOOKS: u64 = 5;

fn fixed(seed: u64) -> ProptestConfig {
    ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Lives through the events; `look` sees an image twice a second and says what must not have gone down since the last
/// one, and what must not have leapt by more than its limit.
fn live(
    profile: &str,
    seed: u64,
    events: &[(Event, u64)],
    look: impl Fn(&Site, &str) -> (Vec<f64>, Vec<Option<(f64, f64)>>),
) {
    let mut site = Site::new(&Config { profile: profile.into(), seed, ..Config::default() });
    let mut last = look(&site, "at power-on");
    for (event, tenths) in events {
        happen(&mut site, *event);
        for half in 0..tenths / LOOKS {
            site.pass(TENTH * LOOKS as u32);
            let place = format!("{half} half seconds after {event:?}");
            let now = look(&site, &place);
            let grown = last.0.iter().zip(&now.0).all(|(before, after)| before <= after);
            assert!(grown, "{place}: {:?} {:?}", last.0, now.0);
            for (before, after) in last.1.iter().zip(&now.1) {
                let Some((before, after)) = before.zip(*after) else { continue };
                let leap = (before.0 - after.0).abs();
                assert!(leap <= after.1, "{place}: from {} to {}", before.0, after.0);
            }
            last = now;
        }
    }
}

fn known(site: &Site, id: &str) -> Option<f64> {
    site.decode(id).value.and_then(|value| value.as_number()).map(|number| number.as_f64())
}

fn remembers(site: &Site, ids: &[&str], limit: f64) -> Vec<Option<(f64, f64)>> {
    ids.iter().map(|id| known(site, id).map(|value| (value, limit))).collect()
}

fn phases(site: &Site, ids: [&str; 3], of: &str, what: &str) -> [f64; 3] {
    ids.map(|phase| site.number(&format!("{of}_{phase}_{what}")))
}

/// Phases stand 120 degrees apart, whatever each of them has.
fn lines_follow(phase: [f64; 3], line: [f64; 3], within: f64, place: &str) {
    for (number, line) in line.into_iter().enumerate() {
        let (a, b) = (phase[number], phase[(number + 1) % 3]);
        let expected = (a * a + b * b + a * b).sqrt();
        assert!((line - expected).abs() < within, "{place}: {line} V between phases of {phase:?}");
    }
}

const NUMBERED: [&str; 3] = ["l1", "l2", "l3"];
const BETWEEN_NUMBERED: [&str; 3] = ["l1_l2", "l2_l3", "l3_l1"];
const LETTERED: [&str; 3] = ["a", "b", "c"];
const BETWEEN_LETTERED: [&str; 3] = ["ab", "bc", "ca"];

fn d_series(site: &Site, place: &str) -> (Vec<f64>, Vec<Option<(f64, f64)>>) {
    let volts = SOURCES.map(|source| phases(site, NUMBERED, source, "voltage"));
    for (source, phase) in SOURCES.into_iter().zip(volts) {
        lines_follow(phase, phases(site, BETWEEN_NUMBERED, source, "voltage"), 0.3, place);
        powers_agree(site, source, place);
    }
    let inputs = site.codes("onboard_inputs");
    if inputs[0] == 1 && inputs[1] == 1 {
        assert_eq!(volts[0], volts[1], "{place}: both breakers are closed");
    }
    let (rpm, hertz) = (site.number("engine_speed"), site.number("genset_frequency"));
    assert!((rpm / 30.0 - hertz).abs() < 0.022, "{place}: {rpm} rpm, {hertz} Hz");
    let warm = ["oil_temperature", "canopy_temperature", "ambient_temperature"];
    (GROWING.map(|id| site.number(id)).to_vec(), remembers(site, &warm, 0.9))
}

fn dkg(site: &Site, place: &str) -> (Vec<f64>, Vec<Option<(f64, f64)>>) {
    for source in SOURCES {
        let volts = phases(site, NUMBERED, source, "voltage");
        lines_follow(volts, phases(site, BETWEEN_NUMBERED, source, "voltage"), 0.3, place);
        let amperes = phases(site, NUMBERED, source, "current");
        let [p, q, s] =
            ["active", "reactive", "apparent"].map(|kind| site.number(&format!("{source}_{kind}_power")));
        assert!((s - p.hypot(q)).abs() < 0.03, "{place}: {source} {p} kW, {q} kvar, {s} kVA");
        let product: f64 = volts.iter().zip(amperes).map(|(volts, amperes)| volts * amperes / 1000.0).sum();
        // Phases of different power factors have more between them than their sum shows.
        assert!(product > s - 0.2 - 0.001 * s, "{place}: {source} {volts:?} V, {amperes:?} A, {s} kVA");
        let factor = site.number(&format!("{source}_power_factor"));
        let expected = if s > 0.0 { p.abs() / s } else { 0.0 };
        assert!(
            (factor.abs() - expected).abs() < 0.006 + 0.01 / s.max(0.1),
            "{place}: {source} {factor} {p} {s}"
        );
    }
    let (rpm, hertz) = (site.number("engine_speed"), site.number("genset_frequency"));
    assert!((rpm / 30.0 - hertz).abs() < 0.07, "{place}: {rpm} rpm, {hertz} Hz");
    // An engine that does not tell its hours shows none.
    let hours = known(site, "ecu_engine_hours").filter(|hours| *hours > 0.0).map(|hours| (hours, 0.06));
    let mut remembered = remembers(site, &["oil_temperature"], 1.0);
    remembered.push(hours);
    (Vec::new(), remembered)
}

fn transfer(site: &Site, place: &str) -> (Vec<f64>, Vec<Option<(f64, f64)>>) {
    let sources = ["s1", "s2"];
    for source in sources {
        let volts = phases(site, LETTERED, source, "voltage");
        lines_follow(volts, phases(site, BETWEEN_LETTERED, source, "voltage"), 1.8, place);
        let mut sums = [0.0; 2];
        for phase in ["_a", "_b", "_c", ""] {
            let [p, q, s] = ["active", "reactive", "apparent"]
                .map(|kind| site.number(&format!("{source}{phase}_{kind}_power")));
            assert!((s - p.hypot(q)).abs() < 1.3, "{place}: {source}{phase} {p} kW, {q} kvar, {s} kVA");
            match phase {
                "" => assert!((sums[0] - p).abs() < 2.1 && (sums[1] - q).abs() < 2.1, "{place}: {source}"),
                _ => sums = [sums[0] + p, sums[1] + q],
            }
        }
    }
    let [first, second] = sources.map(|source| site.number(&format!("{source}_frequency")));
    let difference = site.number("frequency_difference");
    assert!((first - second - difference).abs() < 0.011, "{place}: {first} {second} {difference}");
    let counted = ["active_energy", "reactive_energy", "closings"];
    let mut counters: Vec<_> = sources
        .iter()
        .flat_map(|source| counted.iter().map(move |what| site.number(&format!("{source}_{what}"))))
        .collect();
    counters.push(site.number("qtie_closings"));
    counters.extend(
        ["s1", "s2", "load_1_total", "load_2_total"].map(|what| time(site, &format!("{what}_supply"))),
    );
    (counters, Vec::new())
}

fn compressor(site: &Site, place: &str) -> (Vec<f64>, Vec<Option<(f64, f64)>>) {
    let [torque, burned] = ["torque_percentage", "fuel_consumption"].map(|id| known(site, id));
    if let (Some(torque), Some(burned)) = (torque, burned) {
        assert_eq!(torque == 0.0, burned == 0.0, "{place}: {torque} % for {burned} L/h");
    }
    let warm = ["engine_temperature", "oil_temperature", "fuel_temperature", "air_inlet_temperature"];
    let counters = ["total_starts", "total_fuel", "event_logs"];
    let mut counters: Vec<_> = counters.iter().map(|id| known(site, id).unwrap_or(0.0)).collect();
    counters.push(time(site, "total_running"));
    (counters, remembers(site, &warm, 1.8))
}

/// Seconds of three registers.
fn time(site: &Site, what: &str) -> f64 {
    let [hours, minutes, seconds] =
        ["hours", "minutes", "seconds"].map(|unit| site.number(&format!("{what}_{unit}")));
    assert!(minutes < 60.0 && seconds < 60.0, "{what}");
    3600.0 * hours + 60.0 * minutes + seconds
}

proptest! {
    #![proptest_config(fixed(6))]

    #[test]
    fn a_d_series_unit_obeys_physics_whatever_happens(seed in any::<u64>(), events in events()) {
        live("datakom-d", seed, &events, d_series);
    }

    #[test]
    fn a_dkg_705_obeys_physics_whatever_happens(seed in any::<u64>(), events in events()) {
        live("datakom-dkg705", seed, &events, dkg);
    }

    #[test]
    fn a_transfer_switch_obeys_physics_whatever_happens(seed in any::<u64>(), events in events()) {
        live("smartgen-hat821si", seed, &events, transfer);
    }

    #[test]
    fn a_compressor_obeys_physics_whatever_happens(seed in any::<u64>(), events in events()) {
        live("smartgen-acc1700", seed, &events, compressor);
    }
}
