//! The push-button word as a script: keys, simulated time, statuses.

use busbar_modbus::Request;

use crate::site::{AUTO, CHANNEL_SELECT, GCB, HARD_RESET, MCB, RUN, STOP, Site, TENTH, TEST};

const START: [u32; 8] = [0, 1, 2, 3, 5, 6, 7, 8];
const TAKE_LOAD: [u32; 3] = [12, 11, 13];
const GIVE_BACK: [u32; 3] = [13, 20, 19];
const STOP_COOLED: [u32; 5] = [21, 22, 23, 25, 0];

#[test]
fn test_runs_on_load_and_auto_brings_the_load_back() {
    let mut site = Site::quiet();
    assert_eq!(site.code("unit_mode"), 4);
    site.pass_seconds(10);
    assert_eq!(site.code("operation_status"), 0);

    site.press(TEST);
    assert_eq!(site.code("unit_mode"), 8);
    assert_eq!(site.walk_to(13), [&START[..], &TAKE_LOAD].concat());
    site.pass_seconds(5);
    assert!(site.number("genset_active_power") > 20.0);
    assert_eq!(site.number("mains_active_power"), 0.0);
    assert!(site.number("flowmeter") > 5.0);

    site.press(AUTO);
    assert_eq!(site.walk_to(0), [&GIVE_BACK[..], &STOP_COOLED].concat());
    assert!(site.number("mains_active_power") > 20.0);
    assert_eq!(site.number("engine_speed"), 0.0);
}

#[test]
fn the_timer_counts_down_in_every_timed_status() {
    let mut site = Site::quiet();
    site.press(TEST);
    let mut status = site.code("operation_status");
    let mut timer = site.number("operation_timer");
    let mut counted = std::collections::BTreeSet::new();
    for tenth in 0..1200 {
        if tenth == 600 {
            site.press(AUTO);
        }
        site.pass(TENTH);
        let (new_status, new_timer) = (site.code("operation_status"), site.number("operation_timer"));
        if new_status == status && new_timer != timer {
            assert_eq!(new_timer, timer - 1.0, "status {status}");
            counted.insert(status);
        }
        (status, timer) = (new_status, new_timer);
    }
    assert!([1, 2, 3, 6, 7, 12, 20, 22, 23].iter().all(|status| counted.contains(status)), "{counted:?}");
}

#[test]
fn run_stays_off_load_until_the_breaker_key() {
    let mut site = Site::quiet();
    site.press(RUN);
    assert_eq!(site.code("unit_mode"), 2);
    assert_eq!(site.walk_to(8), START);
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 8);
    assert!(site.flag(5) && !site.flag(4));

    site.press(GCB);
    assert_eq!(site.walk_to(13), [&[8][..], &TAKE_LOAD].concat());
    assert!(site.flag(4) && !site.flag(5));
    site.press(MCB);
    assert_eq!(site.walk_to(8), [&GIVE_BACK[..], &[8]].concat());
    assert!(site.flag(5) && !site.flag(4));
}

#[test]
fn a_breaker_key_opens_its_own_breaker_and_leaves_the_other_open() {
    let mut site = Site::quiet();
    let closed = |site: &Site| (site.codes("onboard_inputs")[0], site.codes("onboard_inputs")[1]);
    site.press(RUN);
    site.walk_to(8);
    site.press(GCB);
    site.walk_to(13);

    site.press(GCB);
    assert_eq!(site.walk_to(8), [13, 8]);
    site.pass_seconds(10);
    assert_eq!((site.code("operation_status"), closed(&site)), (8, (0, 0)));
    assert_eq!(site.number("mains_active_power") + site.number("genset_active_power"), 0.0);

    site.press(MCB);
    site.pass_seconds(1);
    assert_eq!(closed(&site), (0, 1));
    site.press(MCB);
    site.pass_seconds(1);
    assert_eq!(closed(&site), (0, 0));

    site.press(GCB);
    assert_eq!(site.walk_to(13), [&[8][..], &TAKE_LOAD].concat());
    site.press(AUTO);
    assert_eq!(site.walk_to(0), [&GIVE_BACK[..], &STOP_COOLED].concat());
    assert_eq!(closed(&site), (0, 1));
}

#[test]
fn a_breaker_that_closed_by_itself_is_opened_by_its_key() {
    let mut site = Site::quiet();
    let closed = |site: &Site| (site.codes("onboard_inputs")[0], site.codes("onboard_inputs")[1]);
    site.press(RUN);
    site.walk_to(8);
    site.device.pull("mains", "failed").unwrap();
    site.walk_to(13);
    site.press(MCB);
    site.pass_seconds(5);
    assert_eq!(closed(&site), (1, 0), "the key of dead mains is dead");
    site.press(GCB);
    assert_eq!(site.walk_to(8), [13, 8]);
    site.pass_seconds(10);
    assert_eq!((site.code("operation_status"), closed(&site)), (8, (0, 0)));
    site.press(GCB);
    assert_eq!(site.walk_to(13), [&[8][..], &TAKE_LOAD].concat());
}

#[test]
fn a_transfer_that_is_no_longer_wanted_turns_round() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    site.press(GCB);
    site.walk_to(12);
    site.press(MCB);
    assert_eq!(site.walk_to(8), [12, 20, 19, 8]);
    site.press(GCB);
    site.walk_to(13);
    site.press(MCB);
    site.walk_to(20);
    site.press(GCB);
    assert_eq!(site.walk_to(13), [20, 12, 11, 13]);
}

#[test]
fn the_genset_breaker_key_is_dead_until_the_engine_is_up_to_speed() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(7);
    site.press(GCB);
    site.walk_to(8);
    site.pass_seconds(10);
    assert_eq!(site.code("operation_status"), 8);
    assert!(site.flag(5) && !site.flag(4));
}

#[test]
fn breaker_keys_mean_nothing_in_auto() {
    let mut site = Site::quiet();
    site.press(GCB | MCB);
    site.pass_seconds(20);
    assert_eq!(site.code("operation_status"), 0);
    assert!(site.flag(5) && !site.flag(4));
}

#[test]
fn stop_cools_down_and_stop_again_does_not() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    site.press(STOP);
    assert_eq!(site.code("unit_mode"), 1);
    assert_eq!(site.walk_to(22), [8, 21, 22]);
    site.press(STOP);
    assert_eq!(site.walk_to(0), [24, 25, 0]);
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 0);
}

#[test]
fn an_immediate_stop_on_load_leaves_the_mains_feeding() {
    let mut site = Site::quiet();
    site.press(TEST);
    site.walk_to(13);
    site.press(STOP);
    site.press(STOP);
    site.pass_seconds(2);
    assert_eq!(site.number("genset_active_power"), 0.0);
    assert!(site.number("mains_active_power") > 20.0);
}

#[test]
fn wanted_again_while_cooling_it_goes_on_running() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    site.press(AUTO);
    site.walk_to(22);
    site.press(RUN);
    site.pass(TENTH);
    assert_eq!(site.code("operation_status"), 8);
}

#[test]
fn stop_wins_over_other_keys_and_press_length_changes_nothing() {
    let mut site = Site::quiet();
    site.press(STOP | RUN | TEST);
    assert_eq!(site.code("unit_mode"), 1);
    site.press(0x4000 | AUTO);
    assert_eq!(site.code("unit_mode"), 4);
    site.press(0x8000 | TEST);
    assert_eq!(site.code("unit_mode"), 8);
}

#[test]
fn the_models_differ_in_their_run_key() {
    const D700_RUN: u16 = 16;
    for (model, identity, runs) in
        [("D-500", 0xD500, RUN), ("D-545", 0xD545, RUN), ("d-545", 0xD545, RUN), ("D-700", 0xD700, D700_RUN)]
    {
        let mut site = Site::model(model);
        assert_eq!(site.code("device_identity"), identity);
        site.press(runs);
        assert_eq!(site.code("unit_mode"), 2, "{model}");
        assert_eq!(site.walk_to(8), START, "{model}");
    }

    let mut site = Site::model("D-300");
    assert_eq!(site.code("device_identity"), 0xD300);
    for keys in [RUN, D700_RUN] {
        site.press(keys);
        assert_eq!(site.code("unit_mode"), 4, "the manual gives a D-300 neither key");
    }
    site.press(TEST);
    assert_eq!(site.walk_to(8), START);

    let mut site = Site::model("D-700");
    site.press(RUN);
    assert_eq!(site.code("unit_mode"), 2, "bit 1 is MANUAL on a D-700");
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 0);

    let mut site = Site::model("D-500");
    site.press(D700_RUN);
    assert_eq!(site.code("unit_mode"), 4, "a D-500 has no key at bit 4");
}

#[test]
fn counters_count_a_run() {
    let mut site = Site::quiet();
    let ids = ["genset_runs", "genset_cranks", "genset_loadings"];
    let before = ids.map(|id| site.number(id));
    site.press(TEST);
    site.walk_to(13);
    assert_eq!(ids.map(|id| site.number(id)), before.map(|count| count + 1.0));
    let minimum = site.number("battery_min_cranking_voltage");
    assert!((18.0..23.0).contains(&minimum), "{minimum}");
    assert!(site.number("battery_voltage") > minimum + 4.0);
}

#[test]
fn a_hard_reset_stops_the_engine() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    let resets = site.number("ethernet_resets");
    site.write(HARD_RESET, 14536);
    assert_eq!(site.device.answer(1, &Request::ReadHoldingRegisters { address: 10604, count: 1 }), None);
    site.pass_seconds(5);
    assert_eq!(site.walk_to(0), [25, 0], "it rolls out");
    assert_eq!(site.number("engine_speed"), 0.0);
    assert_eq!(site.number("ethernet_resets"), resets + 1.0);
}

#[test]
fn a_hard_reset_of_a_unit_whose_engine_cannot_be_stopped_cranks_nothing() {
    let mut site = Site::quiet();
    site.press(TEST);
    site.walk_to(13);
    site.device.pull("fuel.solenoid", "stuck").unwrap();
    site.write(HARD_RESET, 14536);
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 25);
    assert!(site.bits("warning_alarms").contains(99), "fail to stop");
    site.device.pull("fuel.solenoid", "normal").unwrap();
    assert_eq!(site.walk_to(13), [&[25][..], &START, &TAKE_LOAD].concat());
}

#[test]
fn what_was_asked_for_by_hand_is_not_done_after_an_alarm_has_been_reset() {
    const RESET: u16 = 1 << 14 | 1 << 10;
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    site.press(GCB);
    site.walk_to(13);
    site.device.inject("shutdown_alarms.high_oil_pressure", true).unwrap();
    site.walk_to(0);
    site.device.inject("shutdown_alarms.high_oil_pressure", false).unwrap();
    site.press(RUN);
    site.pass_seconds(5);
    site.press(RESET);
    site.pass_seconds(30);
    assert_eq!((site.code("unit_mode"), site.code("operation_status")), (2, 0));
    assert!(site.bits("shutdown_alarms").is_empty());
    site.press(RUN);
    assert_eq!(site.walk_to(8), START);
    site.pass_seconds(10);
    assert_eq!(site.code("operation_status"), 8, "off load");
}

#[test]
fn a_mains_breaker_that_was_opened_by_hand_stays_open_whatever_trips() {
    for alarm in ["shutdown_alarms.low_fuel_level", "load_dump_alarms.over_load"] {
        let mut site = Site::model("D-700");
        site.press(RUN);
        site.press(MCB);
        site.pass_seconds(1);
        site.device.inject(alarm, true).unwrap();
        for _ in 0..100 {
            site.pass(TENTH);
            assert_eq!(site.codes("onboard_inputs")[1], 0, "{alarm}");
        }
        site.press(MCB);
        site.pass_seconds(1);
        assert_eq!(site.codes("onboard_inputs")[1], 1, "{alarm}: it is closed by hand too");
    }
}

#[test]
fn manual_leaves_a_d_700_with_the_load_that_it_has() {
    let mut site = Site::model("D-700");
    site.press(TEST);
    site.walk_to(13);
    site.press(RUN);
    site.pass_seconds(30);
    assert_eq!((site.code("unit_mode"), site.code("operation_status")), (2, 13));
    site.press(RUN);
    site.press(MCB);
    assert_eq!(site.walk_to(8), [&GIVE_BACK[..], &[8]].concat());
    site.pass_seconds(10);
    assert_eq!(site.code("operation_status"), 8, "it goes on running");
}

#[test]
fn a_word_without_a_key_silences_nothing() {
    let mut site = Site::quiet();
    site.device.inject("warning_alarms.over_load", true).unwrap();
    site.pass_seconds(1);
    for word in [0, 0x4000, 0x8000, 0x3800] {
        site.press(word);
        assert!(site.flag(1), "{word:04X}");
    }
    site.press(1 << 9);
    assert!(!site.flag(1));
}

#[test]
fn the_selected_channel_is_analysed_at_once() {
    let mut site = Site::quiet();
    site.write(CHANNEL_SELECT, 15);
    assert_eq!(site.code("selected_channel"), 15);
    assert_eq!(site.number("channel_fundamental"), 0.0, "no genset current at rest");
    site.write(CHANNEL_SELECT, 6);
    assert_eq!(site.number("channel_fundamental"), 100.0);
    assert_eq!(site.number("channel_harmonic_3"), 0.0, "cancelled between lines");

    let harmonics = (3..=31).step_by(2).map(|order| site.number(&format!("channel_harmonic_{order}")));
    let distortion = harmonics.map(|level| level * level).sum::<f64>().sqrt();
    assert!((distortion - site.number("channel_thd")).abs() < 0.006, "{distortion}");

    let Some(busbar_profile::Value::Trace(samples)) = site.decode("scope").value else { panic!("no trace") };
    let squares: f64 = samples.iter().map(|sample| f64::from(*sample).powi(2)).sum();
    let rms = (squares / 100.0).sqrt() / 10.0;
    assert!((rms - site.number("mains_l1_l2_voltage")).abs() < 0.2, "{rms}");
}
