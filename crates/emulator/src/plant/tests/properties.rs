//! What holds whatever levers are pulled, whatever a panel does and for how long.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::{COMPRESSOR_LEVERS, Compressor, Feed, HERTZ_PER_RPM, Orders};
use super::*;

/// One thing that happens, and for how many steps it then goes on.
#[derive(Clone, Debug)]
struct Event {
    what: Happening,
    steps: u32,
}

#[derive(Clone, Debug)]
enum Happening {
    /// A lever by its number, and how far into its positions.
    Lever(usize, f64),
    /// Outputs of the panel, a bit each.
    Outputs(u8),
    /// What the panel's analog outputs add to the set points of speed and voltage, and their droop.
    Trim([f64; 4]),
}

fn events(levers: usize) -> impl Strategy<Value = Vec<Event>> {
    let what = prop_oneof![
        4 => (0..levers, 0.0..1.0).prop_map(|(lever, part)| Happening::Lever(lever, part)),
        4 => any::<u8>().prop_map(Happening::Outputs),
        // A start as every panel does it, so that an engine runs often enough.
        2 => Just(Happening::Outputs(0b0100_0011)),
        2 => Just(Happening::Outputs(0b0110_0001)),
        1 => (-90.0..90.0, -24.0..24.0, 0.0..60.0, 0.0..10.0)
            .prop_map(|(rpm, volts, rpm_droop, volt_droop)| {
                Happening::Trim([rpm, volts, rpm_droop, volt_droop])
            }),
    ];
    let event = (what, 1..120_u32).prop_map(|(what, steps)| Event { what, steps });
    prop::collection::vec(event, 1..40)
}

fn fixed() -> ProptestConfig {
    ProptestConfig {
        cases: 64,
        rng_seed: RngSeed::Fixed(0x0B05_BA12),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn happen(plant: &mut Plant, controls: &mut Controls, what: &Happening) {
    match what {
        Happening::Lever(number, part) => plant.pull(LEVERS[*number].id, LEVERS[*number].at(*part)),
        Happening::Outputs(bits) => *controls = outputs(*bits),
        Happening::Trim([rpm, volts, rpm_droop, volt_droop]) => {
            (plant.engine.governor.trim, plant.engine.governor.droop) = (*rpm, *rpm_droop);
            (plant.excitation.trim, plant.excitation.droop) = (*volts, *volt_droop);
        }
    }
}

fn outputs(bits: u8) -> Controls {
    let on = |bit: u8| bits >> bit & 1 == 1;
    Controls {
        fuel: on(0),
        starter: on(1),
        idle: on(2),
        block_heater: on(3),
        fuel_pump: on(4),
        genset_breaker: on(5),
        mains_breaker: on(6),
        load_shedding: on(7),
    }
}

/// Numbers that only grow.
fn counters(plant: &Plant) -> [f64; 10] {
    let [mains, genset] = [&plant.mains_energy, &plant.genset_energy];
    [
        plant.engine.hours,
        plant.engine.burned,
        mains.active,
        mains.exported,
        mains.inductive,
        mains.capacitive,
        genset.active,
        genset.exported,
        genset.inductive,
        genset.capacitive,
    ]
}

fn temperatures(plant: &Plant) -> [f64; 4] {
    [plant.engine.coolant, plant.engine.oil, plant.canopy, plant.ambient]
}

fn feed_is_lawful(feed: &Feed, closed: bool) -> Result<(), TestCaseError> {
    let lines = feed.line_voltage();
    for (line, (a, b)) in lines.into_iter().zip([(0, 1), (1, 2), (2, 0)]) {
        let (a, b) = (feed.voltage[a], feed.voltage[b]);
        // Exact for equal phases, and near for phases that differ as those of a healthy feed.
        if (a - b).abs() < 0.05 * (a + b) {
            prop_assert!((line - 3.0_f64.sqrt() * (a + b) / 2.0).abs() < 0.3, "{feed:?}");
        }
    }
    let (apparent, current) = (feed.apparent(), feed.current());
    for phase in 0..3 {
        let (p, q, s) = (feed.active[phase], feed.reactive[phase], apparent[phase]);
        prop_assert!((s * s - p * p - q * q).abs() < 1e-6, "{feed:?}");
        prop_assert!((feed.voltage[phase] * current[phase] / 1000.0 - s).abs() < 1e-6, "{feed:?}");
        prop_assert!((0.0..450.0).contains(&feed.voltage[phase]), "{feed:?}");
        // Two sources in opposition draw up to 220 kvar, and the worst of loads 115 beside.
        prop_assert!(p.abs() < 250.0 && q.abs() < 340.0, "{feed:?}");
        prop_assert!(closed || (p, q) == (0.0, 0.0), "an open breaker carries nothing: {feed:?}");
    }
    let (p, q) = (feed.total_active(), feed.total_reactive());
    prop_assert!((feed.total_apparent().powi(2) - p * p - q * q).abs() < 1e-6);
    Ok(())
}

fn is_plausible(plant: &Plant) -> Result<(), TestCaseError> {
    let engine = &plant.engine;
    for (name, value, range) in [
        ("speed", engine.speed, 0.0..2300.0),
        ("oil pressure", engine.oil_pressure, 0.0..5.0),
        ("oil level", engine.oil_level, 0.0..1.001),
        ("coolant level", engine.coolant_level, 0.0..1.001),
        ("coolant", engine.coolant, -30.0..135.0),
        ("oil", engine.oil, -35.0..160.0),
        ("canopy", plant.canopy, -30.0..110.0),
        ("ambient", plant.ambient, -28.0..53.0),
        ("burn", engine.burn, 0.0..45.0),
        ("tank", plant.tank.percent(), 0.0..100.001),
        ("battery", plant.batteries[0].voltage, 1.0..31.0),
        ("second battery", plant.batteries[1].voltage, 1.0..31.0),
        ("cranking minimum", plant.batteries[0].cranking_minimum, 1.0..31.0),
        ("charge input", plant.batteries[0].charge_input, 0.0..31.0),
        ("charge current", plant.batteries[0].charge_current, 0.0..31.0),
        ("mains frequency", plant.mains.frequency, 0.0..66.0),
        ("angle", plant.angle(), -180.001..180.001),
        ("sisters", plant.sisters.active(), -1.0..160.0),
    ] {
        prop_assert!(range.contains(&value), "{name} {value}");
    }
    Ok(())
}

/// One step between two looks at everything.
fn step_is_lawful(plant: &mut Plant, controls: &Controls) -> Result<(), TestCaseError> {
    let (counted, warm) = (counters(plant), temperatures(plant));
    plant.step(DT, controls);
    is_plausible(plant)?;
    feed_is_lawful(&plant.mains, plant.mains_breaker.closed)?;
    feed_is_lawful(&plant.genset, plant.genset_breaker.closed)?;
    if plant.mains_breaker.closed && plant.genset_breaker.closed {
        prop_assert_eq!(plant.mains.voltage, plant.genset.voltage, "one busbar has one voltage");
    }
    prop_assert!((plant.genset.frequency - plant.engine.speed * HERTZ_PER_RPM).abs() < 1e-9);
    prop_assert!(plant.genset.frequency > 0.0 || plant.genset.voltage == [0.0; 3] || plant.is_parallel());

    let now = counters(plant);
    prop_assert!(counted.iter().zip(&now).all(|(before, after)| before <= after), "{counted:?} {now:?}");
    for (power, into) in [(plant.mains.total_active(), 2), (plant.genset.total_active(), 6)] {
        let expected = [power.max(0.0), (-power).max(0.0)].map(|kw| kw * DT / 3600.0);
        let grown = [now[into] - counted[into], now[into + 1] - counted[into + 1]];
        prop_assert!(grown.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{grown:?} {expected:?}");
    }
    for (before, after) in warm.iter().zip(temperatures(plant)) {
        prop_assert!((before - after).abs() < 1.5 * DT, "{warm:?} {after}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(fixed())]

    #[test]
    fn a_genset_plant_stays_lawful(seed in any::<u64>(), events in events(LEVERS.len())) {
        let (mut plant, mut controls) = (Plant::new(seed), on_mains());
        let mut parallel_for = 0;
        for event in &events {
            happen(&mut plant, &mut controls, &event.what);
            for _ in 0..event.steps {
                step_is_lawful(&mut plant, &controls)?;
                parallel_for = if plant.is_parallel() { parallel_for + 1 } else { 0 };
                // The grid has dragged whatever was there into step.
                if parallel_for > 20 && plant.mains.frequency > 0.0 {
                    prop_assert!((plant.genset.frequency - plant.mains.frequency).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn the_same_seed_and_events_give_the_same_plant_to_the_last_bit(
        seed in any::<u64>(),
        events in events(LEVERS.len()),
    ) {
        let live = || {
            let (mut plant, mut controls) = (Plant::new(seed), on_mains());
            for event in &events {
                happen(&mut plant, &mut controls, &event.what);
                (0..event.steps).for_each(|_| plant.step(DT, &controls));
            }
            format!("{plant:?}")
        };
        prop_assert_eq!(live(), live());
    }

    #[test]
    fn what_is_burned_has_left_the_tank(seed in any::<u64>(), events in events(LEVERS.len())) {
        let (mut plant, mut controls) = (Plant::new(seed), on_mains());
        let (litres, burned) = (plant.tank.litres, plant.engine.burned);
        for event in &events {
            match &event.what {
                // Somebody fills the tank.
                Happening::Lever(number, _) if LEVERS[*number].id == "tank" => {}
                what => happen(&mut plant, &mut controls, what),
            }
            controls.fuel_pump = false;
            for _ in 0..event.steps {
                plant.step(DT, &controls);
                let (drawn, burned) = (litres - plant.tank.litres, plant.engine.burned - burned);
                // A line that is shut off is burned empty, and filled again.
                prop_assert!((0.0..0.0125).contains(&(burned - drawn + 1e-9)), "{drawn} {burned}");
            }
        }
    }

    #[test]
    fn a_compressor_plant_stays_lawful(seed in any::<u64>(), events in events(COMPRESSOR_LEVERS.len())) {
        let (mut plant, mut orders) = (Compressor::new(seed), Orders::default());
        for event in &events {
            happen_to_air(&mut plant, &mut orders, &event.what);
            for _ in 0..event.steps {
                compressor_step_is_lawful(&mut plant, &orders)?;
            }
        }
    }

    #[test]
    fn the_same_seed_and_events_give_the_same_compressor_to_the_last_bit(
        seed in any::<u64>(),
        events in events(COMPRESSOR_LEVERS.len()),
    ) {
        let live = || {
            let (mut plant, mut orders) = (Compressor::new(seed), Orders::default());
            for event in &events {
                happen_to_air(&mut plant, &mut orders, &event.what);
                (0..event.steps).for_each(|_| plant.step(DT, &orders));
            }
            format!("{plant:?}")
        };
        prop_assert_eq!(live(), live());
    }
}

fn happen_to_air(plant: &mut Compressor, orders: &mut Orders, what: &Happening) {
    match what {
        Happening::Lever(number, part) => {
            let lever = &COMPRESSOR_LEVERS[*number];
            plant.pull(lever.id, lever.at(*part));
        }
        Happening::Outputs(bits) => {
            let on = |bit: u8| bits >> bit & 1 == 1;
            *orders = Orders {
                fuel: on(0),
                starter: on(1),
                idle: on(2),
                heater: on(3),
                blow_down: on(4),
                load_valve: on(5),
            };
        }
        Happening::Trim(_) => {}
    }
}

fn compressor_step_is_lawful(plant: &mut Compressor, orders: &Orders) -> Result<(), TestCaseError> {
    let counters = |plant: &Compressor| [plant.engine.hours, plant.engine.burned];
    let temperatures = |plant: &Compressor| {
        [plant.engine.coolant, plant.engine.oil, plant.intake, plant.fuel_temperature, plant.ambient]
    };
    let (counted, warm, hot) = (counters(plant), temperatures(plant), plant.exhaust.temperature);
    let discharge = plant.air.temperature;
    plant.step(DT, orders);
    let now = counters(plant);
    prop_assert!(counted.iter().zip(&now).all(|(before, after)| before <= after), "{counted:?} {now:?}");
    for (before, after) in warm.iter().zip(temperatures(plant)) {
        prop_assert!((before - after).abs() < 1.5 * DT, "{warm:?} {after}");
    }
    prop_assert!((discharge - plant.air.temperature).abs() < 4.0 * DT);
    prop_assert!((hot - plant.exhaust.temperature).abs() < 40.0 * DT);
    let [battery, charger] = plant.voltages();
    for (name, value, range) in [
        ("speed", plant.engine.speed, 0.0..2300.0),
        ("pressure", plant.air.pressure, 0.0..1100.0),
        ("discharge", plant.air.temperature, -30.0..220.0),
        ("separator", plant.air.separator_loss, 0.0..400.0),
        ("delivery", plant.air.delivery, 0.0..16.0),
        ("consumption", plant.air.consumption, 0.0..14.001),
        ("exhaust", plant.exhaust.temperature, -30.0..690.0),
        ("boost", plant.exhaust.boost, 0.0..350.0),
        ("soot", plant.filter.soot, 0.0..150.001),
        ("torque", plant.torque(), 0.0..125.001),
        ("load", plant.load(), 0.0..180.0),
        ("coolant", plant.engine.coolant, -30.0..135.0),
        ("coolant level", plant.coolant_level(), 0.0..100.001),
        ("intake", plant.intake, -30.0..90.0),
        ("fuel pressure", plant.fuel_pressure, 0.0..450.0),
        ("tank", plant.tank.percent(), 0.0..100.001),
        ("battery", battery, 0.0..32.0),
        ("charger", charger, -1.0..32.0),
        ("burn", plant.engine.burn, 0.0..45.0),
    ] {
        prop_assert!(range.contains(&value), "{name} {value}");
    }
    Ok(())
}
