//! What holds in every image that a client can read, whatever happens and whatever is commanded.

use busbar_profile::Quality;
use proptest::prelude::*;

use proptest::test_runner::RngSeed;

use super::{ON, bit, positions, pull, quiet, send, with, with_story};
use crate::levers::{events, happen};
use crate::site::{Site, TENTH};

const GROWING: [&str; 7] = [
    "s1_active_energy",
    "s1_reactive_energy",
    "s2_active_energy",
    "s2_reactive_energy",
    "s1_closings",
    "s2_closings",
    "qtie_closings",
];
const ACCUMULATED: [&str; 4] = ["s1_supply", "s2_supply", "load_1_total_supply", "load_2_total_supply"];

#[test]
fn an_hour_obeys_physics_whatever_the_seed() {
    for (seed, tenths) in [(1, 10), (2, 37), (0xDEAD_BEEF, 53)] {
        let mut site = with_story(seed);
        let mut last = accumulated(&site);
        let transfers = site.number("qtie_closings");
        for step in 0..36_000 / tenths {
            site.pass(TENTH * tenths);
            let place = format!("seed {seed}, tenth {}", step * tenths);
            holds(&site, &place);
            let now = accumulated(&site);
            assert!(
                last.iter().zip(&now).all(|(before, after)| before <= after),
                "{place}: {last:?} {now:?}"
            );
            last = now;
        }
        assert_eq!(site.device.misfits(), 0, "seed {seed}");
        // Twelve chapters, and in every third one the tie jams.
        assert_eq!(site.number("qtie_closings"), transfers + 8.0, "seed {seed}");
    }
}

#[test]
fn the_same_seed_and_inputs_give_the_same_registers_however_time_is_cut() {
    let [mut fine, mut coarse, mut other] = [5, 5, 6].map(with_story);
    for site in [&mut fine, &mut coarse, &mut other] {
        send(site, 15032, ON);
    }
    (0..900).for_each(|_| fine.pass(TENTH));
    coarse.pass_seconds(90);
    other.pass_seconds(90);
    assert_eq!(fine.image(), coarse.image());
    assert_ne!(fine.image(), other.image());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn whatever_is_commanded_and_when(
        commands in prop::collection::vec((prop::sample::select(coils()), any::<bool>(), 0..60_u32), 1..40),
        story in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let mut site = if story { with_story(seed) } else { quiet() };
        let mut last = accumulated(&site);
        for (coil, on, tenths) in commands {
            send(&mut site, coil, if on { ON } else { super::OFF });
            holds(&site, &format!("coil {coil}"));
            for _ in 0..tenths {
                site.pass(TENTH);
                holds(&site, &format!("after coil {coil}"));
            }
            let now = accumulated(&site);
            assert!(last.iter().zip(&now).all(|(before, after)| before <= after));
            last = now;
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(821),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn whatever_is_pulled_commanded_and_injected(
        events in events(),
        loops in any::<bool>(),
        gensets in 0..3_u8,
        elevator in prop_oneof![Just("0"), Just("7")],
    ) {
        let (loop_closing, gensets) = (u8::from(loops).to_string(), gensets.to_string());
        let set = [("loop_closing", &*loop_closing), ("gensets", &*gensets), ("elevator_delay", elevator)];
        let mut site = with(&set);
        let mut last = accumulated(&site);
        for (event, tenths) in &events {
            happen(&mut site, *event);
            for tenth in 0..*tenths {
                site.pass(TENTH);
                holds_whatever_befalls(&site, loops, &format!("{tenth} tenths after {event:?}"));
            }
            let now = accumulated(&site);
            prop_assert!(last.iter().zip(&now).all(|(before, after)| before <= after), "{event:?}");
            last = now;
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }
}

/// Those that switch sources more often than the many load switches.
fn coils() -> Vec<u16> {
    let all = (15004..=15009).chain(15030..=15037);
    all.clone().chain(all).chain([15012, 15040, 15041, 15064, 15087]).collect()
}

fn accumulated(site: &Site) -> Vec<f64> {
    let clock = ["clock_day", "clock_hour", "clock_minute", "clock_second"];
    let [day, hour, minute, second] = clock.map(|part| site.number(part));
    let grown = GROWING.iter().map(|id| site.number(id));
    let times = ACCUMULATED.iter().map(|name| seconds(site, name));
    grown.chain(times).chain([((24.0 * day + hour) * 60.0 + minute) * 60.0 + second]).collect()
}

/// Of hours, minutes and seconds in registers of their own.
fn seconds(site: &Site, name: &str) -> f64 {
    let [hours, minutes, seconds] =
        ["hours", "minutes", "seconds"].map(|part| site.number(&format!("{name}_{part}")));
    3600.0 * hours + 60.0 * minutes + seconds
}

fn holds(site: &Site, place: &str) {
    for source in ["s1", "s2"] {
        voltages_agree(site, source, place);
        powers_agree(site, source, place);
        status_agrees(site, source, place);
    }
    differences_agree(site, place);
    switching_agrees(site, place);
    loads_agree(site, place);
    derived_bits_agree(site, place);
}

/// What of it holds though switches jam, wires break, gensets stop and modules are silent.
fn holds_whatever_befalls(site: &Site, loops: bool, place: &str) {
    for source in ["s1", "s2"] {
        voltages_agree(site, source, place);
        powers_agree(site, source, place);
        status_agrees(site, source, place);
    }
    differences_agree(site, place);
    outputs_agree(site, place);
    derived_bits_agree(site, place);
    let joined = positions(site) == [1; 3];
    assert!(loops || !joined, "{place}: the sources meet");
    assert!(!joined || bit(site, "common_status", 12), "{place}: the loop closing bit");
    for side in 1..=2 {
        let outputs = ["closing", "opening"].map(|word| site.bits(&format!("load_{side}_{word}_outputs")));
        assert!(outputs[0].intersection(&outputs[1]).is_empty(), "{place}: side {side}");
        let [work, test] = ["work", "testing"].map(|at| site.bits(&format!("load_{side}_{at}_positions")));
        assert!(work.intersection(&test).is_empty() && work.len() + test.len() == 12, "{place}: side {side}");
        let number = site.number(&format!("load_{side}_trip_number"));
        let trips = site.bits(&format!("load_{side}_trips"));
        assert_eq!(number > 0.0, !trips.is_empty(), "{place}: side {side}");
        let seconds =
            ["present_supply", "total_supply"].map(|time| seconds(site, &format!("load_{side}_{time}")));
        assert!(seconds[0] <= seconds[1], "{place}: side {side}");
    }
}

fn phases(site: &Site, source: &str, quantity: &str) -> [f64; 3] {
    ["a", "b", "c"].map(|phase| site.number(&format!("{source}_{phase}_{quantity}")))
}

fn voltages_agree(site: &Site, source: &str, place: &str) {
    let [a, b, c] = phases(site, source, "voltage");
    for (name, one, other) in [("ab", a, b), ("bc", b, c), ("ca", c, a)] {
        let line = site.number(&format!("{source}_{name}_voltage"));
        let expected = (one * one + other * other + one * other).sqrt();
        assert!((line - expected).abs() < 2.0, "{place}: {source} {name} {line} {expected}");
    }
    for (phase, volts) in ["a", "b", "c"].into_iter().zip([a, b, c]) {
        let angle = site.decode(&format!("{source}_{phase}_angle"));
        let absent = angle.quality == Quality::Invalid;
        assert!(if absent { volts < 700.0 } else { volts > 400.0 }, "{place}: {source} {phase} {volts}");
    }
    let dead = [a, b, c].iter().all(|volts| *volts == 0.0);
    assert!(!dead || site.number(&format!("{source}_frequency")) == 0.0, "{place}: {source}");
}

fn powers_agree(site: &Site, source: &str, place: &str) {
    let [p, q, s] =
        ["active_power", "reactive_power", "apparent_power"].map(|quantity| phases(site, source, quantity));
    let total = |quantity: &str| site.number(&format!("{source}_{quantity}"));
    let (total_p, total_q) = (total("active_power"), total("reactive_power"));
    assert_eq!(total_p, p.iter().sum::<f64>(), "{place}: {source}");
    assert_eq!(total_q, q.iter().sum::<f64>(), "{place}: {source}");
    assert!((total("apparent_power") - total_p.hypot(total_q)).abs() <= 0.5, "{place}: {source}");
    let (volts, amps) = (phases(site, source, "voltage"), phases(site, source, "current"));
    let factors = phases(site, source, "power_factor");
    for phase in 0..3 {
        assert!((s[phase] - p[phase].hypot(q[phase])).abs() <= 0.5, "{place}: {source} {phase}");
        let expected = volts[phase] * amps[phase] / 1000.0;
        // Half an ampere, and half a volt.
        let error = (volts[phase] + amps[phase]) / 2000.0 + 1.0;
        assert!((s[phase] - expected).abs() < error, "{place}: {source} {phase} {} {expected}", s[phase]);
        let expected = if s[phase] > 0.0 { 100.0 * p[phase] / s[phase] } else { 0.0 };
        assert!(s[phase] < 20.0 || (factors[phase] - expected).abs() < 3.0, "{place}: {source} {phase}");
    }
    assert_eq!(total("zero_sequence_current"), total("n_current"), "{place}: {source}");
    let share = total("zero_sequence_current") / 400.0 * 1000.0;
    assert!((total("zero_sequence_share") - share).abs() < 2.0, "{place}: {source}");
}

fn status_agrees(site: &Site, source: &str, place: &str) {
    let bits = site.bits(&format!("{source}_power"));
    let status = site.code(&format!("{source}_voltage_status"));
    let delay = site.number(&format!("{source}_voltage_delay"));
    assert_ne!(bits.contains(0), bits.contains(1), "{place}: {source} normal or abnormal");
    assert_eq!(bits.contains(0), [1, 2].contains(&status), "{place}: {source} {status}");
    assert_eq!(bits.contains(2), ![0, 2].contains(&status), "{place}: {source} {status}");
    let kinds: Vec<u32> = bits.iter().filter(|bit| *bit >= 8).map(u32::from).collect();
    let expected = if status >= 3 { vec![status + 5] } else { vec![] };
    assert_eq!(kinds, expected, "{place}: {source} {status}");
    assert_eq!(delay > 0.0, status < 2, "{place}: {source} {status} {delay}");
    if status == 2 {
        let known = super::has(site, &format!("{source}_pt_broken_wire"));
        let low = phases(site, source, "voltage").iter().filter(|volts| **volts < 0.8 * 5774.0).count();
        assert!(low <= usize::from(known), "{place}: {source}");
    }
}

fn differences_agree(site: &Site, place: &str) {
    let between =
        |quantity: &str| site.number(&format!("s1_{quantity}")) - site.number(&format!("s2_{quantity}"));
    assert_eq!(site.number("voltage_difference"), between("ab_voltage"), "{place}");
    assert!((site.number("frequency_difference") - between("frequency")).abs() < 1e-9, "{place}");
    let angles =
        ["s1_a_angle", "s2_a_angle"].map(|id| site.decode(id).value.and_then(|value| value.as_number()));
    let shown = site.number("phase_difference");
    match angles {
        [Some(first), Some(second)] => {
            let turns = (first.as_f64() - second.as_f64() - shown).rem_euclid(360.0);
            assert!(turns.min(360.0 - turns) < 0.11, "{place}: {first} {second} {shown}");
        }
        _ => assert_eq!(shown, 0.0, "{place}"),
    }
}

#[test]
fn at_both_ends_of_each_setting_a_bad_day_obeys_physics() {
    let all: Vec<_> = quiet().device.settings().map(|(setting, _)| setting).collect();
    for setting in all.iter().filter(|setting| !setting.id.ends_with("_priority")) {
        for end in [setting.min, setting.max].map(|end| end.to_string()) {
            let mut site = with(&[(&setting.id, &end)]);
            for (lever, to, seconds) in [
                ("load1", "3000", 5),
                ("src1", "failed", 20),
                ("src2", "l1_lost", 40),
                ("src1", "normal", 25),
                ("src2", "normal", 20),
            ] {
                pull(&mut site, lever, to);
                for _ in 0..seconds {
                    site.pass_seconds(1);
                    let place = format!("{} = {end}, {lever} {to}", setting.id);
                    for source in ["s1", "s2"] {
                        voltages_agree(&site, source, &place);
                    }
                    outputs_agree(&site, &place);
                    derived_bits_agree(&site, &place);
                }
            }
            assert_eq!(site.device.misfits(), 0, "{} = {end}", setting.id);
        }
    }
}

fn switching_agrees(site: &Site, place: &str) {
    let [qs1, qtie, qs2] = positions(site);
    assert_ne!([qs1, qtie, qs2], [1; 3], "{place}: the sources meet");
    let status = site.code("ats_status");
    outputs_agree(site, place);
    let moving = [1, 2, 3, 4, 20, 21].contains(&status);
    assert_eq!(site.number("ats_delay") > 0.0, moving || status == 5, "{place}: status {status}");
    for (side, opening) in [(1, 27), (2, 29)] {
        let [opened, closed] =
            ["opening", "closing"].map(|word| site.bits(&format!("load_{side}_{word}_outputs")));
        assert!(status != opening || !opened.is_empty(), "{place}: status {status}");
        let acts = site.number(&format!("load_{side}_act_number"));
        let driven: Vec<f64> = opened.iter().chain(closed.iter()).map(|bit| f64::from(bit) + 1.0).collect();
        assert!(
            driven.is_empty() || driven.contains(&acts),
            "{place}: side {side} drives {driven:?}, not {acts}"
        );
    }
}

/// Status, outputs, feedback and power of the three switches.
fn outputs_agree(site: &Site, place: &str) {
    let [qs1, qtie, qs2] = positions(site);
    let status = site.code("ats_status");
    let expected = match status {
        16 => Some([1, 0, 0]),
        17 => Some([0, 0, 1]),
        18 => Some([0, 0, 0]),
        22 => Some([1, 1, 0]),
        23 => Some([0, 1, 1]),
        24 => Some([1, 0, 1]),
        25 => Some([0, 1, 0]),
        _ => None,
    };
    assert!(expected.is_none_or(|expected| expected == [qs1, qtie, qs2]), "{place}: status {status}");
    for (codes, word, output) in [
        ([1, 11], "switches", 0),
        ([2, 2], "switches", 1),
        ([3, 12], "switches", 2),
        ([4, 4], "switches", 3),
        ([20, 9], "tie_switch", 2),
        ([21, 21], "tie_switch", 3),
    ] {
        let drives = codes.contains(&status);
        assert_eq!(bit(site, word, output), drives, "{place}: status {status}, {word}.{output}");
    }
    let carries = |source: &str| site.number(&format!("{source}_active_power")) > 0.0;
    assert!(qs1 == 1 || !carries("s1"), "{place}: power through an open QS1");
    assert!(qs2 == 1 || !carries("s2"), "{place}: power through an open QS2");
    let feedback = site.bits("aux_inputs");
    assert_eq!([0, 2, 1].map(|input| u8::from(feedback.contains(input))), [qs1, qtie, qs2], "{place}");
}

fn loads_agree(site: &Site, place: &str) {
    for side in 1..=2 {
        let word = |name: &str| site.bits(&format!("load_{side}_{name}"));
        assert!(word("closed").intersection(&word("trips")).is_empty(), "{place}: side {side}");
        let both = word("closing_outputs").intersection(&word("opening_outputs"));
        assert!(both.is_empty(), "{place}: side {side}");
        assert_eq!(word("closed"), site.bits(&format!("input_module_{side}")), "{place}: side {side}");
        // Whatever source n feeds, section n is between.
        let [load, source] = [format!("load_{side}_total_supply"), format!("s{side}_supply")];
        assert!(seconds(site, &load) >= seconds(site, &source), "{place}: side {side}");
        let number = site.number(&format!("load_{side}_trip_number"));
        assert_eq!(number > 0.0, !word("trips").is_empty(), "{place}: side {side}");
    }
}

fn derived_bits_agree(site: &Site, place: &str) {
    let word = |id: &str| site.bits(id).register(0);
    let (first, second) = (word("alarms_1"), word("alarms_2"));
    assert_eq!(first & 1 != 0, first & 0b11_0110 != 0, "{place}: 503.0");
    let failures = ["closing_failures", "opening_failures", "trips"];
    let of_loads = failures.iter().flat_map(|name| [1, 2].map(|side| word(&format!("load_{side}_{name}"))));
    let fault_bits =
        first | second & 0xF200 | word("alarms_3") & 0xF000 | of_loads.fold(0, |all, word| all | word);
    let warning_bits = second & 0x08FF | word("alarms_3") & 0x0FFF | word("alarms_4");
    let common = word("common_status");
    assert_eq!(common & 4 != 0, fault_bits != 0, "{place}: 500.2");
    assert_eq!(common & 2 != 0, warning_bits != 0, "{place}: 500.1");
    assert_eq!(common & 1 != 0, common & 6 != 0, "{place}: 500.0");
    assert_ne!(common >> 9 & 1, common >> 13 & 1, "{place}: local or remote");
    let started = [1, 3, 8].contains(&site.code("genset_status"));
    assert_eq!(common >> 15 & 1 == 1, started, "{place}: 500.15");
}
