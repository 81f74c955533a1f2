//! What becomes of a pulled lever.

use super::*;

#[test]
fn the_grid_shows_what_is_wrong_with_it() {
    let mut plant = Plant::new(1);
    for (word, healthy) in [
        ("failed", false),
        ("normal", true),
        ("sagging", false),
        ("swelling", false),
        ("l2_lost", false),
        ("reversed", false),
        ("normal", true),
    ] {
        pull(&mut plant, "mains", word);
        run(&mut plant, &on_mains(), 3.0);
        assert_eq!(mains_healthy(&plant), healthy, "{word} {:?}", plant.mains);
        assert_eq!(plant.mains.phase_order_wrong, word == "reversed");
    }
    pull(&mut plant, "mains", "l2_lost");
    run(&mut plant, &on_mains(), 3.0);
    let [l1, l2, l3] = plant.mains.active;
    assert!(l1 > 8.0 && l2 == 0.0 && l3 > 8.0, "a dead phase feeds nothing");
    let [l1_l2, l2_l3, l3_l1] = plant.mains.line_voltage();
    assert!(l1_l2 < 240.0 && l2_l3 < 240.0 && l3_l1 > 390.0);
}

#[test]
fn an_outage_of_the_line_and_the_lever_are_two_things() {
    let mut plant = Plant::new(1);
    plant.fail_mains(true);
    run(&mut plant, &on_mains(), 2.0);
    assert_eq!(plant.lever("mains"), Some(Position::Word("normal")));
    assert_eq!(plant.mains.voltage, [0.0; 3]);
    plant.fail_mains(false);
    pull(&mut plant, "mains", "failed");
    run(&mut plant, &on_mains(), 2.0);
    assert_eq!(plant.mains.voltage, [0.0; 3]);
}

#[test]
fn an_engine_without_fuel_dies_and_does_not_fire_until_it_has_some() {
    for (lever, dry, fed) in [("fuel.supply", "shut", "open"), ("tank", "0", "50")] {
        let mut plant = Plant::new(2);
        let mut controls = start(&mut plant);
        pull(&mut plant, lever, dry);
        run(&mut plant, &controls, 2.0);
        assert!(plant.engine.is_running(), "what is in the line lasts for some seconds");
        run(&mut plant, &controls, 60.0);
        assert_eq!(plant.engine.speed, 0.0);
        controls.starter = true;
        run(&mut plant, &controls, 10.0);
        assert!(!plant.engine.firing);
        pull(&mut plant, lever, fed);
        run(&mut plant, &controls, 6.0);
        assert!(plant.engine.firing);
    }
}

#[test]
fn the_emergency_stop_cuts_fuel_and_starter_whatever_the_panel_does() {
    let mut plant = Plant::new(2);
    let mut controls = start(&mut plant);
    pull(&mut plant, "emergency_stop", "pressed");
    assert!(plant.emergency_stop);
    run(&mut plant, &controls, 15.0);
    assert_eq!(plant.engine.speed, 0.0);
    controls.starter = true;
    run(&mut plant, &controls, 5.0);
    assert_eq!(plant.engine.speed, 0.0);
    pull(&mut plant, "emergency_stop", "released");
    run(&mut plant, &controls, 6.0);
    assert!(plant.engine.firing);
    assert!(!plant.remote_start);
    pull(&mut plant, "remote_start", "on");
    assert!(plant.remote_start);
}

#[test]
fn a_stuck_solenoid_keeps_it_running_until_the_fuel_is_gone() {
    let mut plant = Plant::new(2);
    start(&mut plant);
    pull(&mut plant, "fuel.solenoid", "stuck");
    run(&mut plant, &on_mains(), 30.0);
    assert!(plant.engine.is_running());
    pull(&mut plant, "fuel.supply", "shut");
    run(&mut plant, &on_mains(), 60.0);
    assert_eq!(plant.engine.speed, 0.0);
    pull(&mut plant, "fuel.supply", "open");
    run(&mut plant, &Controls { starter: true, ..on_mains() }, 10.0);
    assert!(!plant.engine.firing, "a solenoid without current does not open by itself");
}

#[test]
fn batteries_crank_as_well_as_they_can() {
    let crank = |battery| {
        let mut plant = Plant::new(4);
        pull(&mut plant, "battery", battery);
        run(&mut plant, &on_mains(), 30.0);
        pull(&mut plant, "ignition", "never");
        run(&mut plant, &Controls { fuel: true, starter: true, ..on_mains() }, 5.0);
        (plant.engine.speed, plant.batteries[0].cranking_minimum)
    };
    let [normal, weak, flat] = ["normal", "weak", "flat"].map(crank);
    assert!(normal.0 > 220.0 && normal.1 > 18.0, "{normal:?}");
    assert!((100.0..200.0).contains(&weak.0) && weak.1 < normal.1 - 2.0, "{weak:?}");
    assert!(flat.0 < 30.0 && flat.1 < 10.0, "{flat:?}");
}

#[test]
fn the_charge_alternator_and_the_charger_fail_for_themselves() {
    let mut plant = Plant::new(4);
    pull(&mut plant, "charge_alternator", "failed");
    let controls = start(&mut plant);
    run(&mut plant, &controls, 60.0);
    assert!(plant.batteries[0].charge_input < 3.0);
    assert!(plant.batteries[0].voltage > 26.5, "the charger still works");
    pull(&mut plant, "charger", "failed");
    run(&mut plant, &controls, 300.0);
    assert!(plant.batteries.iter().all(|battery| battery.voltage < 25.8));
}

#[test]
fn a_voltage_regulator_gives_nothing_or_too_much() {
    let (mut plant, controls) = on_load(3);
    pull(&mut plant, "avr", "high");
    run(&mut plant, &controls, 4.0);
    assert!(plant.genset.voltage.iter().all(|volts| (265.0..290.0).contains(volts)), "{:?}", plant.genset);
    pull(&mut plant, "avr", "failed");
    run(&mut plant, &controls, 4.0);
    assert!(plant.genset.voltage.iter().all(|volts| (1.0..10.0).contains(volts)), "{:?}", plant.genset);
    assert_eq!(plant.genset.total_active(), 0.0);
    assert!((plant.genset.frequency - 50.0).abs() < 0.5);
}

#[test]
fn more_current_than_the_exciter_can_force_sinks_the_voltage() {
    let volts = |kw| {
        let (mut plant, controls) = on_load(3);
        pull(&mut plant, "load.power_factor", "0.5");
        pull(&mut plant, "load", kw);
        run(&mut plant, &controls, 1.0);
        assert!(plant.engine.is_running());
        plant.genset.average_voltage()
    };
    assert!(volts("70") > 205.0);
    assert!((100.0..180.0).contains(&volts("130")), "{}", volts("130"));
}

#[test]
fn an_overload_pulls_the_speed_down_and_in_the_end_stalls_the_engine() {
    let (mut plant, controls) = on_load(3);
    pull(&mut plant, "load", "97");
    run(&mut plant, &controls, 20.0);
    assert!((plant.genset.frequency - 50.0).abs() < 0.4, "{}", plant.genset.frequency);
    assert!((plant.genset.total_active() - 97.0).abs() < 0.1);
    pull(&mut plant, "load", "120");
    run(&mut plant, &controls, 1.5);
    assert!((38.0..48.5).contains(&plant.genset.frequency), "{}", plant.genset.frequency);
    run(&mut plant, &controls, 40.0);
    assert_eq!(plant.engine.speed, 0.0);
    assert_eq!(plant.genset.voltage, [0.0; 3]);
}

#[test]
fn a_runaway_overspeeds_until_its_fuel_is_cut() {
    let (mut plant, mut controls) = on_load(3);
    pull(&mut plant, "governor", "runaway");
    run(&mut plant, &controls, 6.0);
    assert!(plant.genset.frequency > 60.0);
    controls.fuel = false;
    run(&mut plant, &controls, 15.0);
    assert_eq!(plant.engine.speed, 0.0);
}

#[test]
fn breakers_stick_where_they_are() {
    let mut plant = Plant::new(1);
    pull(&mut plant, "breaker.mains", "will_not_open");
    run(&mut plant, &Controls::default(), 5.0);
    assert!(plant.mains_breaker.closed && plant.mains.total_active() > 20.0);
    pull(&mut plant, "breaker.mains", "normal");
    run(&mut plant, &Controls::default(), 1.0);
    assert!(!plant.mains_breaker.closed);
    pull(&mut plant, "breaker.mains", "will_not_close");
    run(&mut plant, &on_mains(), 5.0);
    assert!(!plant.mains_breaker.closed && plant.mains.total_active() == 0.0);
}

#[test]
fn a_broken_sender_reads_nothing_and_the_engine_goes_on() {
    let (mut plant, controls) = on_load(3);
    let readings = plant.readings();
    assert_eq!(readings.oil_pressure, Some(plant.engine.oil_pressure));
    assert_eq!(readings.speed, Some(plant.engine.speed));
    for lever in ["sender.oil_pressure", "sender.temperature", "sender.fuel_level", "pickup"] {
        pull(&mut plant, lever, "broken");
    }
    run(&mut plant, &controls, 5.0);
    let readings = plant.readings();
    assert_eq!(
        (readings.oil_pressure, readings.coolant, readings.fuel_level, readings.speed),
        (None, None, None, None)
    );
    assert!(plant.engine.is_running());
}

#[test]
fn the_load_is_held_uneven_and_at_its_power_factor() {
    let mut plant = Plant::new(3);
    pull(&mut plant, "load", "42");
    pull(&mut plant, "load.power_factor", "0.7");
    pull(&mut plant, "load.balance", "uneven");
    run(&mut plant, &on_mains(), 2.0);
    assert!((plant.mains.total_active() - 42.0).abs() < 1e-6);
    assert!((plant.mains.total_power_factor() - 0.7).abs() < 0.005);
    let [l1, l2, l3] = plant.mains.current();
    assert!(l1 > 1.5 * l2 && l2 > l3);
}

#[test]
fn the_pump_into_the_day_tank_fails() {
    let mut plant = Plant::new(3);
    pull(&mut plant, "tank", "10");
    let pumping = Controls { fuel_pump: true, ..on_mains() };
    run(&mut plant, &pumping, 60.0);
    let level = plant.tank.percent();
    assert!(level > 20.0);
    pull(&mut plant, "fuel.pump", "failed");
    run(&mut plant, &pumping, 60.0);
    assert_eq!(plant.tank.percent(), level);
}

#[test]
fn the_air_outside_is_held_and_cools_what_stands_in_it() {
    let mut plant = Plant::new(3);
    pull(&mut plant, "ambient", "-20");
    run(&mut plant, &on_mains(), 1.0);
    assert!(plant.ambient > 15.0, "weather takes its time");
    run(&mut plant, &on_mains(), 1200.0);
    assert!((-22.0..-18.0).contains(&plant.ambient), "{}", plant.ambient);
    assert!(plant.canopy < 0.0);
}
