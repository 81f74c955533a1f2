//! What holds of the switchgear alone, without a controller.

use super::*;

const DT: f64 = 0.1;

fn pass(plant: &mut Plant, seconds: f64, outputs: &Outputs) {
    for _ in 0..(seconds / DT).round() as u32 {
        plant.step(DT, outputs);
    }
}

fn rest(plant: &mut Plant, seconds: f64) {
    pass(plant, seconds, &Outputs::default());
}

fn started() -> Outputs {
    Outputs { start: [false, true], ..Outputs::default() }
}

fn power(plant: &Plant) -> [f64; 2] {
    plant.sources.each_ref().map(|source| source.meter().power)
}

#[test]
fn the_load_follows_the_switches() {
    let [own_1, own_2] = power(&Plant::new(1, Positions::of(1, 0, 1)));
    assert!(own_1 > 1400.0 && own_2 > 1400.0, "{own_1} {own_2}");
    for (digits, expected) in [
        ((1, 1, 0), [own_1 + own_2, 0.0]),
        ((0, 1, 1), [0.0, own_1 + own_2]),
        ((1, 0, 0), [own_1, 0.0]),
        ((0, 0, 1), [0.0, own_2]),
        ((0, 1, 0), [0.0, 0.0]),
        ((0, 0, 0), [0.0, 0.0]),
    ] {
        let plant = Plant::new(1, Positions::of(digits.0, digits.1, digits.2));
        for (active, expected) in power(&plant).into_iter().zip(expected) {
            assert!((active - expected).abs() <= 0.02 * expected, "{digits:?}: {active} {expected}");
        }
    }
}

#[test]
fn a_dead_source_shows_nothing_and_comes_back() {
    let mut plant = Plant::new(2, Positions::of(1, 0, 1));
    plant.sources[0].mains = Mains::Failed;
    rest(&mut plant, 1.0);
    let meter = plant.sources[0].meter();
    assert_eq!((meter.feed.voltage, meter.feed.frequency), ([0.0; 3], 0.0));
    assert_eq!((meter.current, meter.power, meter.angles), ([0.0; 3], 0.0, [None; 3]));
    assert_eq!(plant.alive(), [false, true]);
    assert!(plant.feeders[0].iter().all(Mechanism::is_closed), "not yet");
    rest(&mut plant, 1.0);
    assert!(!plant.feeders[0].iter().any(Mechanism::is_closed));
    plant.sources[0].mains = Mains::Normal;
    rest(&mut plant, 1.0);
    assert_eq!(plant.alive(), [true, true]);
}

#[test]
fn the_genset_stands_in_for_ill_mains_of_its_source_only() {
    let mut plant = Plant::new(3, Positions::of(0, 1, 1));
    plant.sources[0].mains = Mains::Failed;
    plant.sources[1].mains = Mains::Failed;
    rest(&mut plant, 0.9);
    assert_eq!(plant.alive(), [false, false]);
    pass(&mut plant, 7.9, &started());
    assert_eq!(plant.alive(), [false, false], "it runs up");
    pass(&mut plant, 2.0, &started());
    assert_eq!(plant.alive(), [true, true]);
    assert!(plant.sources[1].is_on_genset() && !plant.sources[0].is_on_genset());
    assert!((50.0..50.4).contains(&plant.sources[1].frequency()), "{}", plant.sources[1].frequency());
    plant.sources[1].mains = Mains::Normal;
    pass(&mut plant, 1.0, &started());
    assert!(!plant.sources[1].is_on_genset());
    pass(&mut plant, 1.0, &Outputs { on_load: true, ..started() });
    assert!(plant.sources[1].is_on_genset());
}

#[test]
fn a_genset_gives_way_under_load_sags_under_too_much_and_stops_under_far_too_much() {
    let loaded = Outputs { on_load: true, ..started() };
    let mut plant = Plant::new(3, Positions::of(0, 1, 1));
    plant.sections.iter_mut().for_each(|section| section.load = Some(1600.0));
    pass(&mut plant, 10.0, &loaded);
    assert!(plant.sources[1].meter().power > 3000.0);
    assert!((49.0..49.9).contains(&plant.sources[1].frequency()), "{}", plant.sources[1].frequency());

    plant.sections.iter_mut().for_each(|section| section.load = Some(2200.0));
    pass(&mut plant, 30.0, &loaded);
    let (power, hertz) = (plant.sources[1].meter().power, plant.sources[1].frequency());
    assert!((3700.0..4000.0).contains(&power) && (45.5..47.5).contains(&hertz), "{power} {hertz}");
    assert!((0.9..0.96).contains(&plant.sources[1].average_part()));

    plant.sections.iter_mut().for_each(|section| section.load = Some(3500.0));
    pass(&mut plant, 4.0, &loaded);
    assert!(plant.sources[1].is_on_genset() && plant.sources[1].frequency() < 40.0);
    pass(&mut plant, 3.0, &loaded);
    assert!(!plant.engines[1].has_voltage() && !plant.sources[1].is_on_genset());
    pass(&mut plant, 60.0, &loaded);
    assert!(!plant.engines[1].has_voltage(), "it stays at rest");
}

#[test]
fn a_short_circuit_that_no_switch_clears_pulls_its_source_down() {
    let mut plant = Plant::new(7, Positions::of(1, 1, 0));
    plant.switches.iter_mut().for_each(|switch| switch.set_condition(Condition::WillNotOpen));
    plant.sections[1].short_circuit = true;
    rest(&mut plant, 1.0);
    assert_eq!((plant.positions().digits(), plant.relays), ([1, 1, 0], [false, true, false]));
    assert_eq!((plant.sources[0].meter().feed.voltage, plant.alive()), ([0.0; 3], [false; 2]));
    assert!(plant.sources[1].average_part() > 0.9);
    plant.sections[1].short_circuit = false;
    rest(&mut plant, 1.0);
    assert_eq!(plant.alive(), [true, true]);
}

#[test]
fn where_one_switch_jams_another_one_parts_sources_out_of_step() {
    let mut plant = Plant::new(6, Positions::of(1, 0, 1));
    plant.sources[1].shift = 90.0;
    plant.switches[1].set_condition(Condition::WillNotOpen);
    let close = Outputs { switches: [None, Some(Drive::Close), None], ..Outputs::default() };
    pass(&mut plant, 0.3, &close);
    assert_eq!((plant.positions().digits(), plant.relays), ([0, 1, 1], [true, true, false]));
}

#[test]
fn sources_of_one_grid_keep_their_angle_and_the_genset_does_not() {
    let mut plant = Plant::new(5, Positions::of(1, 0, 1));
    for _ in 0..600 {
        rest(&mut plant, 1.0);
        assert!(plant.angle_between().abs() < 10.0, "{}", plant.angle_between());
        let [first, second] = plant.sources.each_ref().map(Source::frequency);
        assert!((first - second).abs() < 0.02 && (first - 50.0).abs() < 0.1, "{first} {second}");
    }
    plant.sources[1].mains = Mains::Failed;
    let mut farthest = 0.0_f64;
    for _ in 0..60 {
        pass(&mut plant, 1.0, &started());
        farthest = farthest.max(plant.angle_between().abs());
    }
    assert!(farthest > 90.0, "{farthest}");
}

#[test]
fn sources_in_parallel_share_the_load_and_push_each_other() {
    let mut plant = Plant::new(6, Positions::of(1, 0, 1));
    plant.sources[1].shift = 10.0;
    let apart: f64 = power(&plant).iter().sum();
    let close = Outputs { switches: [None, Some(Drive::Close), None], ..Outputs::default() };
    pass(&mut plant, 1.0, &close);
    assert!(plant.is_parallel() && plant.relays == [false; 3]);
    let [first, second] = power(&plant);
    assert!((first + second - apart).abs() < 0.05 * apart, "{first} {second} {apart}");
    assert!(second - first > 1500.0, "what leads delivers: {first} {second}");
}

#[test]
fn closed_too_far_apart_they_are_separated_at_once() {
    for shift in [60.0, -120.0] {
        let mut plant = Plant::new(6, Positions::of(1, 0, 1));
        plant.sources[1].shift = shift;
        let close = Outputs { switches: [None, Some(Drive::Close), None], ..Outputs::default() };
        pass(&mut plant, 0.3, &close);
        assert_eq!((plant.positions().digits(), plant.relays), ([1, 0, 1], [false, true, false]));
    }
    let mut plant = Plant::new(6, Positions::of(1, 1, 0));
    plant.sources[1].mains = Mains::Reversed;
    let close = Outputs { switches: [None, None, Some(Drive::Close)], ..Outputs::default() };
    pass(&mut plant, 0.4, &close);
    assert_eq!(plant.relays, [false, false, true], "phases that follow differently never fit");
}

#[test]
fn a_short_circuit_opens_what_feeds_it() {
    for (positions, section, left, relays) in [
        (Positions::of(1, 0, 1), 0, [0, 0, 1], [true, false, false]),
        (Positions::of(1, 0, 1), 1, [1, 0, 0], [false, false, true]),
        (Positions::of(1, 1, 0), 1, [1, 0, 0], [false, true, false]),
        (Positions::of(0, 1, 1), 0, [0, 0, 1], [false, true, false]),
        (Positions::of(0, 1, 1), 1, [0, 1, 0], [false, false, true]),
    ] {
        let mut plant = Plant::new(7, positions);
        plant.sections[section].short_circuit = true;
        rest(&mut plant, 0.1);
        assert_eq!((plant.positions().digits(), plant.relays), (left, relays), "{positions:?} {section}");
        assert!(!plant.alive()[section]);
    }
}

#[test]
fn a_switch_that_is_not_in_work_carries_nothing() {
    let mut plant = Plant::new(8, Positions::of(1, 0, 1));
    plant.switches[0].set_in_work(false);
    let close = Outputs { switches: [Some(Drive::Close), None, None], ..Outputs::default() };
    pass(&mut plant, 1.0, &close);
    assert_eq!((plant.positions().digits(), plant.alive()), ([1, 0, 1], [false, true]));
    assert_eq!(power(&plant)[0], 0.0);

    let before = power(&plant)[1];
    plant.feeders[1][3].set_in_work(false);
    let mut outputs = Outputs::default();
    outputs.loads[1][3] = Some(Drive::Close);
    pass(&mut plant, 1.0, &outputs);
    assert!(plant.feeders[1][3].is_closed() && before - power(&plant)[1] > 80.0);
}

#[test]
fn an_earth_fault_is_what_the_phases_leave_over() {
    let mut plant = Plant::new(9, Positions::of(1, 0, 1));
    let before = plant.sources[0].meter().residual.0;
    plant.sections[0].earth_fault = 60.0;
    rest(&mut plant, 0.5);
    let residual = plant.sources[0].meter().residual.0;
    assert!((50.0..70.0).contains(&residual) && before < 15.0, "{before} {residual}");
}
