//! Every point of the profile, in every situation: decodes, says something a person would believe, and moves.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use busbar_profile::{DataType, Point, Quality};

use super::{bit, positions, quiet, send, set, with_story};
use crate::site::{Site, TENTH, believe};

#[test]
fn power_on_finds_two_sources_on_their_own_sections() {
    let site = quiet();
    assert_eq!(positions(&site), [1, 0, 1]);
    assert_eq!(site.bits("common_status").iter().collect::<Vec<_>>(), [8, 10, 11, 13]);
    assert!(!bit(&site, "controls_and_inhibits", 12));
    assert_eq!((site.code("s1_voltage_status"), site.code("s2_voltage_status")), (2, 2));
    assert_eq!((site.code("ats_status"), site.code("genset_status")), (24, 9));
    for side in ["load_1_closed", "load_2_closed", "load_1_work_positions", "load_2_work_positions"] {
        assert_eq!(site.bits(side).iter().collect::<Vec<_>>(), (0..12).collect::<Vec<_>>(), "{side}");
    }
    // What was delivered in all these hours fits what is carried now.
    for source in ["s1", "s2"] {
        let [energy, hours, power] = ["active_energy", "supply_hours", "active_power"]
            .map(|part| site.number(&format!("{source}_{part}")));
        let part = energy / hours / power;
        assert!((0.55..0.85).contains(&part), "{source}: {energy} kWh in {hours} h, {power} kW now");
    }
}

#[test]
fn every_point_is_good_and_plausible() {
    let mut site = with_story(3);
    judge(&site, "power-on");
    for second in 0..900 {
        site.pass_seconds(1);
        judge(&site, &format!("second {second}"));
    }
    let mut site = quiet();
    for coil in
        ["transfer_000", "transfer_110", "genset_start", "load_1_3_open", "transfer_001", "remote_output_4"]
    {
        set(&mut site, coil);
        for tenth in 0..150 {
            site.pass(TENTH);
            judge(&site, &format!("{coil}, tenth {tenth}"));
        }
    }
    assert_eq!(site.device.misfits(), 0);
}

fn judge(site: &Site, situation: &str) {
    for point in site.device.profile().points.iter().filter(|point| point.access.is_readable()) {
        let decoded = site.decode(&point.id);
        if decoded.quality == Quality::Invalid {
            // No angle without a voltage.
            assert!(is_angle(&point.id), "{situation}: {}", point.id);
            let volts = point.id.replace("angle", "voltage");
            assert!(site.number(&volts) < 700.0, "{situation}: {}", point.id);
            continue;
        }
        believe(point, decoded, plausible, situation);
    }
}

fn is_angle(id: &str) -> bool {
    ["s1_a_angle", "s1_b_angle", "s1_c_angle", "s2_a_angle", "s2_b_angle", "s2_c_angle"].contains(&id)
}

/// What a person at this site would believe; a new point needs a line here.
fn plausible(point: &Point) -> RangeInclusive<f64> {
    let id = point.id.as_str();
    let ends = |end: &str| id.ends_with(end);
    match (id, point.unit.as_deref()) {
        ("voltage_difference", _) => -10_500.0..=10_500.0,
        ("frequency_difference", _) => -51.0..=51.0,
        // Two feeders of one grid.
        ("phase_difference", _) => -15.0..=15.0,
        ("sync_failure_delay" | "parallel_mode", _) => 0.0..=0.0,
        ("ats_transfer_alarm_delay", _) => 0.0..=5.0,
        ("clock_year", _) => 26.0..=26.0,
        ("clock_month", _) => 1.0..=1.0,
        ("clock_day", _) => 5.0..=5.0,
        ("clock_weekday", _) => 1.0..=1.0,
        ("clock_hour", _) => 10.0..=10.0,
        (_, Some("V")) => 0.0..=10_500.0,
        (_, Some("Hz")) => 0.0..=50.6,
        (_, Some("deg")) => 0.0..=360.0,
        (_, Some("kWh" | "kvarh")) => 2_000_000.0..=60_000_000.0,
        (_, Some("h")) => 0.0..=30_000.0,
        (_, Some("min")) => 0.0..=59.0,
        (_, Some("s")) if ends("seconds") || ends("second") => 0.0..=59.0,
        (_, Some("s")) => 0.0..=10.0,
        _ if ends("_delay") => 0.0..=10.0,
        _ if ends("current_angle") => 0.0..=3600.0,
        _ if ends("zero_sequence_share") => 0.0..=1000.0,
        // With a phase lost the two that are left make up for nothing.
        _ if ends("current") => 0.0..=400.0,
        _ if ends("active_power") || ends("apparent_power") => 0.0..=6500.0,
        _ if ends("power_factor") => 0.0..=100.0,
        _ if ends("unbalance") => 0.0..=500.0,
        _ if ends("number") => 0.0..=12.0,
        _ if ends("closings") => 80.0..=500.0,
        _ => panic!("nobody said what is plausible for {id} ({:?})", point.unit),
    }
}

/// Five minutes with the story: source 1 fails and returns, a feeder trips.
#[test]
fn what_ought_to_move_moves() {
    let still: BTreeSet<&str> = [
        // Within five minutes of a morning.
        "clock_year",
        "clock_month",
        "clock_day",
        "clock_weekday",
        "clock_hour",
        "s1_supply_hours",
        "s2_supply_hours",
        "load_2_present_supply_hours",
        "load_1_total_supply_hours",
        "load_2_total_supply_hours",
        // Source 2 and its section never fail in the story.
        "s2_voltage_status",
        "s2_voltage_delay",
        "s2_closings",
        "load_2_last_supply_hours",
        "load_2_last_supply_minutes",
        "load_2_last_supply_seconds",
        "genset_status",
        "genset_delay",
        // Never in parallel, nothing has failed, no trip on that side.
        "sync_failure_delay",
        "parallel_mode",
        "load_1_trip_number",
        "load_1_transfer_failure_number",
        "load_2_transfer_failure_number",
    ]
    .into();
    let mut site = with_story(1);
    let mut seen: BTreeMap<&str, BTreeSet<Vec<u16>>> = BTreeMap::new();
    let points = &site.device.profile().points;
    for _ in 0..3000 {
        site.pass(TENTH);
        for point in points.iter().filter(|point| point.data_type != DataType::Bits) {
            let registers = site.device.registers(point.address, point.registers).unwrap();
            seen.entry(&point.id).or_default().insert(registers.to_vec());
        }
    }
    for (id, values) in &seen {
        // Hours may turn over or not.
        let may = id.ends_with("_hours");
        assert!(may || (values.len() > 1) != still.contains(id), "{id} had {} values", values.len());
    }
    let moving = [
        "s1_a_voltage",
        "s2_ab_voltage",
        "s2_active_power",
        "s1_b_current",
        "phase_difference",
        "s2_a_angle",
    ];
    for id in moving {
        assert!(seen[id].len() > 8, "{id} had {} values", seen[id].len());
    }
}

#[test]
fn the_story_transfers_and_restores_and_shows_an_alarm() {
    let mut site = with_story(2);
    let (mut walk, mut alarms, mut steps) = (vec![positions(&site)], vec![0], BTreeSet::new());
    for _ in 0..9000 {
        site.pass(TENTH);
        walk.push(positions(&site));
        walk.dedup();
        alarms.push(site.bits("common_status").register(0) & 7);
        alarms.dedup();
        steps.insert(site.code("ats_status"));
    }
    let cycle = [[0, 0, 1], [0, 1, 1], [0, 0, 1], [1, 0, 1]];
    // In the third chapter the tie jams, and source 1 is put back by hand.
    assert_eq!(walk[1..], [&cycle[..], &cycle, &[[0, 0, 1], [1, 0, 1]]].concat());
    assert_eq!(alarms, [0, 7, 0, 7, 0, 5, 7, 0]);
    assert_eq!(steps.into_iter().collect::<Vec<_>>(), [0, 1, 2, 5, 17, 20, 21, 23, 24, 26, 28]);
    assert_eq!(site.device.misfits(), 0);
}

#[test]
fn a_tripped_feeder_is_put_right_at_the_controller() {
    let mut site = with_story(2);
    site.pass_seconds(155);
    assert_eq!(site.bits("load_2_trips").iter().collect::<Vec<_>>(), [6]);
    assert_eq!(site.number("load_2_trip_number"), 7.0);
    assert!(!bit(&site, "load_2_closed", 6) && bit(&site, "alarms_4", 6) && bit(&site, "common_status", 6));
    site.pass_seconds(35);
    assert!(bit(&site, "common_status", 9) && !bit(&site, "common_status", 13), "local");
    site.pass_seconds(15);
    assert!(site.bits("load_2_trips").is_empty() && bit(&site, "load_2_closed", 6));
    assert!(!bit(&site, "common_status", 9) && bit(&site, "common_status", 13));
}

#[test]
fn a_reset_from_afar_is_as_good_as_one_at_the_controller() {
    let mut site = with_story(2);
    site.pass_seconds(155);
    set(&mut site, "load_2_7_close");
    site.pass_seconds(2);
    assert!(!bit(&site, "load_2_closed", 6), "a trip keeps it open");
    send(&mut site, 15007, super::ON);
    assert!(!bit(&site, "common_status", 0) && !bit(&site, "common_status", 6));
    set(&mut site, "load_2_7_close");
    site.pass_seconds(2);
    assert!(bit(&site, "load_2_closed", 6));
}
