//! A healthy plant.

use super::*;

#[test]
fn mains_carry_the_load_from_the_first_image_on() {
    let plant = Plant::new(1);
    assert!(mains_healthy(&plant));
    assert!(plant.mains.total_active() > 25.0);
    assert_eq!(plant.genset.voltage, [0.0; 3]);
    assert_eq!(plant.time, 0.0);
}

#[test]
fn the_same_seed_is_the_same_plant() {
    let walk = |seed| {
        let mut plant = Plant::new(seed);
        run(&mut plant, &on_mains(), 60.0);
        (plant.mains.voltage, plant.mains_energy.active, plant.engine.coolant)
    };
    assert_eq!(walk(9), walk(9));
    assert_ne!(walk(9), walk(10));
}

#[test]
fn a_started_genset_builds_up_voltage_and_takes_the_load() {
    let mut plant = Plant::new(2);
    let mut controls = start(&mut plant);
    assert!(genset_healthy(&plant), "{:?}", plant.genset);
    assert_eq!(plant.genset.total_active(), 0.0);

    controls.mains_breaker = false;
    run(&mut plant, &controls, 1.0);
    assert_eq!(plant.mains.total_active(), 0.0);
    controls.genset_breaker = true;
    run(&mut plant, &controls, 5.0);
    assert!(plant.genset.total_active() > 25.0);
    assert!(genset_healthy(&plant), "{:?}", plant.genset);
    assert!(plant.engine.burn > 8.0);
}

#[test]
fn a_load_step_dips_speed_and_voltage_and_both_come_back() {
    let (mut plant, controls) = on_load(3);
    pull(&mut plant, "load", "5");
    run(&mut plant, &controls, 10.0);
    pull(&mut plant, "load", "65");
    let (mut hertz, mut volts) = (50.0_f64, 231.0_f64);
    for _ in 0..30 {
        run(&mut plant, &controls, DT);
        hertz = hertz.min(plant.genset.frequency);
        volts = volts.min(plant.genset.voltage[0]);
    }
    assert!((47.5..49.2).contains(&hertz), "{hertz}");
    assert!((205.0..221.0).contains(&volts), "{volts}");
    run(&mut plant, &controls, 10.0);
    assert!((plant.genset.frequency - 50.0).abs() < 0.2 && genset_healthy(&plant));
    assert!((plant.genset.total_active() - 65.0).abs() < 0.05);
}

#[test]
fn a_full_step_up_and_down_is_within_class_g2_of_iso_8528_5() {
    let (mut plant, controls) = on_load(3);
    pull(&mut plant, "load.power_factor", "0.8");
    pull(&mut plant, "load", "0");
    run(&mut plant, &controls, 20.0);
    // Least and most of frequency and voltage, in per cent, and the seconds until each is back.
    for (kw, hertz, volts) in [("80", -10.0..-2.0, -20.0..-7.0), ("0", 2.0..12.0, 7.0..25.0)] {
        pull(&mut plant, "load", kw);
        let (mut farthest, mut away) = ([0.0_f64; 2], [0.0; 2]);
        for tenth in 1..150 {
            run(&mut plant, &controls, DT);
            let now = [plant.genset.frequency / 50.0, plant.genset.average_voltage() / 230.9];
            for (index, (now, back)) in now.into_iter().zip([2.0, 2.5]).enumerate() {
                let percent = 100.0 * (now - 1.0);
                if percent.abs() > farthest[index].abs() {
                    farthest[index] = percent;
                }
                if percent.abs() > back {
                    away[index] = f64::from(tenth) * DT;
                }
            }
        }
        assert!(hertz.contains(&farthest[0]) && volts.contains(&farthest[1]), "{kw} kW: {farthest:?} %");
        assert!(away[0] < 5.0 && away[1] < 6.0, "{kw} kW: {away:?} s");
    }
}

#[test]
fn cranking_dips_the_battery_and_is_remembered() {
    let mut plant = Plant::new(4);
    run(&mut plant, &on_mains(), 10.0);
    let rest = plant.batteries[0].voltage;
    start(&mut plant);
    assert!(plant.batteries[0].cranking_minimum < rest - 4.0);
    assert!(plant.batteries[0].voltage > 27.0, "the alternator charges it again");
}

#[test]
fn burned_fuel_leaves_the_tank() {
    let mut plant = Plant::new(6);
    let controls = start(&mut plant);
    let (litres, burned) = (plant.tank.litres, plant.engine.burned);
    run(&mut plant, &controls, 600.0);
    let drawn = litres - plant.tank.litres;
    assert!(drawn > 0.1);
    assert!((drawn - (plant.engine.burned - burned)).abs() < 1e-6);
}

#[test]
fn sisters_on_the_bus_bar_share_the_load_and_go_with_this_set() {
    let (mut plant, mut controls) = on_load(5);
    pull(&mut plant, "load", "60");
    pull(&mut plant, "load.power_factor", "0.8");
    pull(&mut plant, "busbar.gensets", "2");
    run(&mut plant, &controls, 60.0);
    assert_eq!(plant.sisters.sets(), 3.0);
    let (own, others) = (plant.genset.total_active(), plant.sisters.active());
    assert!((18.5..21.5).contains(&own) && (own + others - 60.0).abs() < 0.05, "{own} {others}");
    controls.genset_breaker = false;
    run(&mut plant, &controls, 1.0);
    assert_eq!((plant.sisters.sets(), plant.sisters.active()), (1.0, 0.0));
}

#[test]
fn a_day_has_its_loads_and_its_weather() {
    let mut plant = Plant::new(7);
    pull(&mut plant, "load", "daily");
    let mut hours = Vec::new();
    for _ in 0..24 {
        (0..3600).for_each(|_| plant.step(1.0, &on_mains()));
        hours.push((plant.mains.total_active(), plant.ambient));
    }
    // Fifteen hours after ten in the morning it is one at night.
    assert!(hours[14].0 < 14.0 && hours[4].0 > 40.0, "{hours:?}");
    assert!(hours[4].1 > hours[16].1 + 3.0, "{hours:?}");
}
