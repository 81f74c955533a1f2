//! What holds whatever levers are pulled and whatever is commanded: of the switchgear alone, and with its controller.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::levers::LEVERS;
use super::super::plant::Condition;
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
    /// QS1, QTIE and QS2 by what drives them: nothing, closing, opening. And what starts, carries and is shed.
    Outputs([u8; 3], u8),
    Command(u16),
}

fn lever() -> impl Strategy<Value = Happening> {
    // Those of the many load switches more seldom than the others.
    let number = prop_oneof![6 => 0..LEVERS.len() - 48, 1 => 0..LEVERS.len()];
    (number, 0.0..1.0).prop_map(|(number, part)| Happening::Lever(number, part))
}

fn events(what: impl Strategy<Value = Happening>) -> impl Strategy<Value = Vec<Event>> {
    let event = (what, 1..250_u32).prop_map(|(what, steps)| Event { what, steps });
    prop::collection::vec(event, 1..40)
}

fn outputs() -> impl Strategy<Value = Happening> {
    (prop::array::uniform3(0..3_u8), any::<u8>()).prop_map(|(drives, bits)| Happening::Outputs(drives, bits))
}

fn commands() -> impl Strategy<Value = Happening> {
    let all = [AUTO, S1_MASTER, S2_MASTER, ALARM_RESET, GENSET_START, GENSET_STOP];
    let transfers = TRANSFER_000..=WINDOW_CANCEL;
    prop_oneof![prop::sample::select(all.to_vec()), transfers].prop_map(Happening::Command)
}

fn outputs_of(drives: [u8; 3], bits: u8) -> Outputs {
    let on = |bit: u8| bits >> bit & 1 == 1;
    Outputs {
        switches: drives.map(|drive| [None, Some(Drive::Close), Some(Drive::Open)][usize::from(drive)]),
        start: [on(0), on(1)],
        on_load: on(2),
        shed: u16::from(bits >> 3 & 3),
        ..Outputs::default()
    }
}

fn counters(plant: &Plant) -> Vec<f64> {
    let energy = plant.sources.iter().flat_map(|source| [source.energy.active, source.energy.inductive]);
    let closings = plant.switches.iter().map(|switch| f64::from(switch.closings()));
    energy.chain(closings).collect()
}

fn meter_is_lawful(meter: &Meter, carries: bool) -> Result<(), TestCaseError> {
    let feed = &meter.feed;
    let (volts, lines, apparent) = (feed.voltage, feed.line_voltage(), feed.apparent());
    for (line, (a, b)) in lines.into_iter().zip([(0, 1), (1, 2), (2, 0)]) {
        let expected = (volts[a] * volts[a] + volts[b] * volts[b] + volts[a] * volts[b]).sqrt();
        prop_assert!((line - expected).abs() < 1e-6, "{meter:?}");
    }
    for phase in 0..3 {
        let (p, q, s) = (feed.active[phase], feed.reactive[phase], apparent[phase]);
        prop_assert!((s * s - p * p - q * q).abs() < 1e-6, "{meter:?}");
        prop_assert!(volts[phase] == 0.0 || (volts[phase] * meter.current[phase] / 1000.0 - s).abs() < 1e-6);
        prop_assert!((0.0..11_700.0).contains(&volts[phase]) && p >= 0.0 && q >= 0.0, "{meter:?}");
        prop_assert!(meter.angles[phase].is_some() == (volts[phase] > 577.4), "{meter:?}");
        prop_assert!(carries || meter.current[phase] == 0.0, "an open switch carries nothing: {meter:?}");
    }
    prop_assert!(volts != [0.0; 3] || feed.frequency == 0.0, "{meter:?}");
    prop_assert!(feed.frequency == 0.0 || (15.0..66.0).contains(&feed.frequency), "{meter:?}");
    Ok(())
}

/// One step between two looks at everything.
fn step_is_lawful(plant: &mut Plant, outputs: &Outputs) -> Result<(), TestCaseError> {
    let (counted, surged) = (counters(plant), plant.is_surging());
    plant.step(0.1, outputs);
    let now = counters(plant);
    prop_assert!(counted.iter().zip(&now).all(|(before, after)| before <= after), "{counted:?} {now:?}");
    for (source, switch) in [0, 2].into_iter().enumerate() {
        meter_is_lawful(&plant.sources[source].meter(), plant.switches[switch].conducts())?;
    }
    let jammed = plant.switches.iter().all(|switch| switch.condition() == Condition::WillNotOpen);
    // One that comes up joined to another one is parted from it by the next step.
    prop_assert!(jammed || !surged || !plant.is_surging(), "sources out of step stay joined");
    for (alive, by) in plant.alive().into_iter().zip(plant.feeds()) {
        prop_assert!(!alive || by != [false; 2], "voltage from nowhere");
    }
    Ok(())
}

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(0x0821_51A7),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(fixed(40))]

    #[test]
    fn a_switchgear_stays_lawful(
        seed in any::<u64>(),
        events in events(prop_oneof![lever(), outputs()]),
    ) {
        let (mut unit, mut outputs) = (Hat821si::new(seed, false), Outputs::default());
        for Event { what, steps } in events {
            match what {
                Happening::Lever(number, part) => {
                    let lever = &LEVERS[number];
                    unit.pull(lever.id, lever.at(part));
                }
                Happening::Outputs(drives, bits) => outputs = outputs_of(drives, bits),
                Happening::Command(_) => {}
            }
            for _ in 0..steps {
                step_is_lawful(&mut unit.plant, &outputs)?;
            }
        }
    }

    #[test]
    fn with_its_controller_sources_are_joined_in_step_or_not_at_all(
        seed in any::<u64>(),
        loops in any::<bool>(),
        gensets in 0..3_u8,
        events in events(prop_oneof![3 => lever(), 2 => commands()]),
    ) {
        let numbers = [u8::from(loops), gensets].map(|number| number.to_string());
        let mut unit = set(&[
            ("loop_closing", &numbers[0]),
            ("gensets", &numbers[1]),
            ("genset_choice", "0"),
            ("genset_1_turn", "1"),
            ("genset_2_turn", "1"),
            ("closing_again_time", "3"),
        ]);
        unit.plant = Plant::new(seed, NORMAL);
        for Event { what, steps } in events {
            match what {
                Happening::Lever(number, part) => {
                    let lever = &LEVERS[number];
                    // Whoever joins sources cannot know of what befalls them a moment later.
                    let grid = lever.id.starts_with("src") && !lever.id.ends_with(".pt");
                    let befalls = grid || lever.id.starts_with("genset") || lever.id.starts_with("input");
                    let faults = lever.id.starts_with("short_circuit");
                    if !(faults || befalls && unit.sequence.loops()) {
                        unit.pull(lever.id, lever.at(part));
                    }
                }
                Happening::Command(coil) => unit.write_coil(coil, steps % 2 == 0),
                Happening::Outputs(..) => {}
            }
            for _ in 0..steps {
                unit.step(TENTH);
                prop_assert!(unit.plant.relays == [false; 3], "joined out of step");
                let joined = unit.plant.positions() == Positions::ALL_CLOSED;
                prop_assert!(loops || !joined, "joined unasked");
            }
        }
    }
}
