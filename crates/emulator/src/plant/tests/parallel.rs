//! Genset and grid on one busbar.

use super::*;

fn droop(plant: &mut Plant) {
    plant.engine.governor.droop = 60.0;
    plant.excitation.droop = 9.0;
}

/// How often the two were joined out of step meanwhile.
fn run(plant: &mut Plant, controls: &Controls, seconds: f64) -> u32 {
    let (mut jolts, mut jolting) = (0, plant.is_jolting());
    for _ in 0..(seconds / DT).round() as u32 {
        plant.step(DT, controls);
        jolts += u32::from(plant.is_jolting() && !jolting);
        jolting = plant.is_jolting();
    }
    jolts
}

/// Runs until the two agree as a panel would wait for it.
fn synchronise(plant: &mut Plant, controls: &Controls) {
    for _ in 0..6000 {
        let slip = (-plant.angle() / 1080.0).clamp(-0.25, 0.25);
        let missing = plant.mains.frequency + slip - plant.genset.frequency;
        plant.engine.governor.trim += 2.0 * DT * missing * 30.0;
        plant.excitation.trim -= DT * plant.synchronism().voltage;
        run(plant, controls, DT);
        let now = plant.synchronism();
        if now.is_safe() && now.angle.abs() < 5.0 && now.slip.abs() < 0.1 && now.voltage.abs() < 5.0 {
            return;
        }
    }
    panic!("{:?}", plant.synchronism());
}

fn paralleled() -> (Plant, Controls) {
    let mut plant = Plant::new(3);
    droop(&mut plant);
    let mut controls = start(&mut plant);
    synchronise(&mut plant, &controls);
    controls.genset_breaker = true;
    assert_eq!(run(&mut plant, &controls, 2.0), 0);
    assert!(plant.is_parallel());
    (plant, controls)
}

#[test]
fn in_parallel_the_governor_chooses_the_power_and_the_grid_the_frequency() {
    let (mut plant, controls) = paralleled();
    assert!(plant.genset.total_active().abs() < 6.0, "{:?}", plant.genset);
    let before = plant.genset.total_active();
    plant.engine.governor.trim += 15.0;
    run(&mut plant, &controls, 5.0);
    let genset = plant.genset.total_active();
    assert!((16.0..24.0).contains(&(genset - before)), "{genset}");
    assert!(plant.mains.total_active() > 5.0);
    assert!((plant.genset.frequency - plant.mains.frequency).abs() < 1e-9);
    assert_eq!(plant.angle(), 0.0);

    let before = plant.genset.total_reactive();
    plant.excitation.trim += 3.0;
    run(&mut plant, &controls, 5.0);
    assert!(plant.genset.total_reactive() > before + 10.0);
}

#[test]
fn the_genset_goes_on_alone_where_it_was_when_the_grid_leaves() {
    let (mut plant, mut controls) = paralleled();
    plant.engine.governor.trim += 30.0;
    run(&mut plant, &controls, 5.0);
    plant.fail_mains(true);
    controls.mains_breaker = false;
    run(&mut plant, &controls, 3.0);
    assert_eq!((plant.mains.voltage, plant.mains.frequency), ([0.0; 3], 0.0));
    assert!(plant.genset.total_active() > 25.0);
    assert!((plant.genset.frequency - 50.0).abs() < 1.2, "{:?}", plant.genset);

    plant.fail_mains(false);
    run(&mut plant, &controls, 2.0);
    assert!(mains_healthy(&plant));
    let before = plant.angle();
    plant.engine.governor.trim += 6.0;
    run(&mut plant, &controls, 1.0);
    assert_ne!(plant.angle(), before, "two sources apart run against each other");
}

#[test]
fn joining_them_out_of_step_jolts_and_trips_the_genset_breaker() {
    let mut plant = Plant::new(3);
    let mut controls = start(&mut plant);
    pull(&mut plant, "load.power_factor", "0.9");
    // A slip big enough that any moment is a wrong one.
    plant.engine.governor.trim = 40.0;
    run(&mut plant, &controls, 5.0);
    assert!(!plant.synchronism().is_safe());
    controls.genset_breaker = true;
    let (mut most, mut jolts) = (0.0_f64, 0);
    for _ in 0..5 {
        jolts += run(&mut plant, &controls, DT);
        most = most.max(plant.genset.average_current());
    }
    assert_eq!(jolts, 1);
    assert!(!plant.genset_breaker.closed && plant.genset_breaker.tripped);
    assert!(plant.mains_breaker.closed && plant.mains.total_active() > 20.0);
    assert!(most > 40.0, "{most} A");
    run(&mut plant, &controls, 30.0);
    assert!(!plant.genset_breaker.closed, "a tripped breaker stays open");

    controls.genset_breaker = false;
    plant.engine.governor.trim = 0.0;
    droop(&mut plant);
    run(&mut plant, &controls, 1.0);
    synchronise(&mut plant, &controls);
    controls.genset_breaker = true;
    assert_eq!(run(&mut plant, &controls, 5.0), 0);
    assert!(plant.is_parallel());
}

#[test]
fn each_disagreement_alone_is_unsafe() {
    let (plant, _) = paralleled();
    let good = Synchronism { angle: 3.0, slip: 0.1, voltage: -4.0, ..plant.synchronism() };
    assert!(good.is_safe());
    for bad in [
        Synchronism { angle: -25.0, ..good },
        Synchronism { slip: 0.8, ..good },
        Synchronism { voltage: 30.0, ..good },
        Synchronism { same_order: false, ..good },
        Synchronism { live: false, ..good },
    ] {
        assert!(!bad.is_safe(), "{bad:?}");
    }
}

#[test]
fn mains_that_come_back_onto_a_running_genset_find_it_out_of_step() {
    let (mut plant, mut controls) = on_load(8);
    pull(&mut plant, "mains", "failed");
    run(&mut plant, &controls, 1.0);
    // Somebody closes the mains breaker onto the dead line.
    controls.mains_breaker = true;
    assert_eq!(run(&mut plant, &controls, 2.0), 0);
    pull(&mut plant, "mains", "normal");
    assert_eq!(run(&mut plant, &controls, 1.0), 1);
    assert!(!plant.genset_breaker.closed && plant.mains.total_active() > 20.0);
}

#[test]
fn an_engine_without_fuel_is_turned_by_the_grid_and_takes_power_for_it() {
    let (mut plant, mut controls) = paralleled();
    controls.fuel = false;
    run(&mut plant, &controls, 5.0);
    assert!((-11.0..-8.5).contains(&plant.genset.total_active()), "{:?}", plant.genset);
    assert!(plant.engine.speed > 1490.0 && plant.engine.burn == 0.0);
    let exported = plant.genset_energy.exported;
    run(&mut plant, &controls, 5.0);
    assert!(plant.genset_energy.exported > exported);
    controls.genset_breaker = false;
    run(&mut plant, &controls, 15.0);
    assert_eq!(plant.engine.speed, 0.0);
}

#[test]
fn a_lost_excitation_takes_reactive_power_from_the_grid() {
    let (mut plant, controls) = paralleled();
    pull(&mut plant, "avr", "failed");
    run(&mut plant, &controls, 4.0);
    assert!(plant.genset.total_reactive() < -35.0);
    pull(&mut plant, "avr", "high");
    run(&mut plant, &controls, 4.0);
    assert!(plant.genset.total_reactive() > 70.0);
    pull(&mut plant, "avr", "normal");
    pull(&mut plant, "governor", "runaway");
    run(&mut plant, &controls, 4.0);
    assert!(plant.genset.total_active() > 95.0 && (plant.genset.frequency - 50.0).abs() < 0.1);
}

#[test]
fn a_line_that_its_grid_has_left_chokes_the_genset_until_they_part() {
    for stuck in [false, true] {
        let (mut plant, mut controls) = paralleled();
        plant.engine.governor.trim += 30.0;
        run(&mut plant, &controls, 5.0);
        if stuck {
            pull(&mut plant, "breaker.mains", "will_not_open");
        }
        pull(&mut plant, "mains", "failed");
        for _ in 0..8 {
            run(&mut plant, &controls, DT);
            assert_eq!(plant.mains.voltage, plant.genset.voltage, "one busbar has one voltage");
        }
        assert!((5.0..15.0).contains(&plant.mains.voltage[0]), "{:?}", plant.mains);
        assert!(plant.genset.average_current() > 300.0 && plant.mains.total_active() < 0.0);
        assert_eq!(plant.genset.total_active(), -plant.mains.total_active());
        controls.mains_breaker = false;
        // The field is still there: the voltage is back at once.
        run(&mut plant, &controls, 1.0);
        assert_eq!(genset_healthy(&plant), !stuck, "{:?}", plant.genset);
        assert_eq!(plant.mains.voltage == [0.0; 3], !stuck);
        assert_eq!(plant.genset.total_active() > 25.0, !stuck);
    }
}

#[test]
fn a_phase_that_the_grid_has_lost_is_dead_on_the_whole_busbar() {
    let (mut plant, mut controls) = paralleled();
    pull(&mut plant, "mains", "l3_lost");
    run(&mut plant, &controls, 2.0);
    assert_eq!(plant.mains.voltage, plant.genset.voltage);
    assert!(plant.genset.voltage[2] < 15.0 && plant.genset.voltage[0] > 220.0, "{:?}", plant.genset);
    assert!(plant.genset.current()[2] > 300.0 && plant.mains.active[2] < 0.0);
    controls.mains_breaker = false;
    run(&mut plant, &controls, 2.0);
    assert!(genset_healthy(&plant) && plant.genset.active[2] > 8.0, "{:?}", plant.genset);
}

#[test]
fn a_jolt_draws_what_the_two_voltages_and_their_angle_make_of_it() {
    /// kW and kvar of the genset in the step in which it is joined.
    fn jolt(angle: f64, prepare: impl Fn(&mut Plant)) -> (f64, f64) {
        let mut plant = Plant::new(3);
        let mut controls = start(&mut plant);
        plant.engine.governor.trim = 24.0;
        prepare(&mut plant);
        run(&mut plant, &controls, 5.0);
        for _ in 0..200 {
            if (plant.angle() - angle).abs() < 20.0 {
                break;
            }
            run(&mut plant, &controls, DT);
        }
        controls.genset_breaker = true;
        assert_eq!(run(&mut plant, &controls, 0.2), 1);
        (plant.genset.total_active(), plant.genset.total_reactive())
    }
    let (active, reactive) = jolt(75.0, |_| {});
    assert!(active > 150.0 && reactive < 0.0, "who leads gives: {active} {reactive}");
    let (active, reactive) = jolt(-130.0, |_| {});
    assert!(active < -100.0 && reactive < -200.0, "who lags takes: {active} {reactive}");
    let (active, reactive) = jolt(0.0, |plant| pull(plant, "mains", "reversed"));
    assert_eq!((active, (reactive / 10.0).round()), (0.0, -30.0), "three phases, three angles");
    let (active, reactive) = jolt(0.0, |plant| pull(plant, "avr", "failed"));
    assert_eq!((active, (reactive / 10.0).round()), (0.0, -30.0), "a dead one is magnetised by the grid");
}

#[test]
fn phases_that_change_places_part_what_is_joined() {
    for stuck in [false, true] {
        let (mut plant, controls) = paralleled();
        if stuck {
            pull(&mut plant, "breaker.genset", "will_not_open");
        }
        pull(&mut plant, "mains", "reversed");
        assert_eq!(run(&mut plant, &controls, 3.0), 1);
        assert_eq!(plant.genset_breaker.tripped, !stuck);
        assert_eq!(plant.is_jolting(), stuck, "nothing drags the one into the other's order");
        pull(&mut plant, "mains", "normal");
        run(&mut plant, &controls, 1.0);
        assert!(!plant.is_jolting());
    }
}
