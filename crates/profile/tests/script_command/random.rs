//! Whatever comes in whatever order, no step is ever sent twice.

use std::time::Duration;

use busbar_profile::command::{Next, ReadFailure, Run, WriteOutcome};
use busbar_profile::{Command, Profile, WordOrder, builtins};
use proptest::prelude::*;
use proptest::sample::select;

use crate::harness::local;

/// What may happen next, asked for or not.
#[derive(Clone, Debug)]
enum Input {
    Next,
    Later(u32),
    Store(u16, Vec<u16>),
    /// Some of the points asked for last, with any registers.
    StoreAsked(u16, u64),
    Read(Option<ReadFailure>),
    Written(WriteOutcome),
}

fn inputs() -> impl Strategy<Value = Input> {
    let register = prop_oneof![0..16_u16, any::<u16>(), select(&[0xD500, 0xD700, 0x2000, 0x0140][..])];
    let failures = select(&[ReadFailure::Silent, ReadFailure::Down, ReadFailure::Exception(2)][..]);
    let outcomes = prop_oneof![
        4 => Just(WriteOutcome::Acknowledged),
        2 => Just(WriteOutcome::Lost),
        1 => Just(WriteOutcome::NotSent),
        1 => any::<u8>().prop_map(WriteOutcome::Exception),
    ];
    prop_oneof![
        8 => Just(Input::Next),
        2 => (0..2_000_u32).prop_map(Input::Later),
        1 => (any::<u16>(), prop::collection::vec(register, 0..20)).prop_map(|(at, words)| Input::Store(at, words)),
        6 => (any::<u16>(), any::<u64>()).prop_map(|(word, which)| Input::StoreAsked(word & 0x1F, which)),
        6 => prop::option::weighted(0.2, failures).prop_map(Input::Read),
        4 => outcomes.prop_map(Input::Written),
    ]
}

fn commands() -> Vec<(&'static Profile, &'static Command)> {
    let all =
        builtins().iter().flat_map(|profile| profile.commands.iter().map(move |command| (profile, command)));
    // Half of the cases to the procedures, and the rest to all.
    let all: Vec<_> = all.collect();
    let procedures: Vec<_> = all.iter().filter(|(_, command)| command.is_procedure()).copied().collect();
    procedures.iter().cycle().take(all.len()).chain(&all).copied().collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn no_step_is_sent_twice(
        (profile, command) in select(commands()),
        inputs in prop::collection::vec(inputs(), 0..200),
    ) {
        let args: Vec<_> = command.args.iter().filter(|arg| arg.name == "channel").map(|_| ("channel", "7")).collect();
        let arguments = command.arguments(args, local()).unwrap();
        let mut run = Run::new(profile, command, arguments, WordOrder::LowFirst);
        let mut now = Duration::from_secs(7);
        let mut asked = Vec::new();
        let mut writes = 0;
        let mut over = None;
        for input in inputs {
            match input {
                Input::Next => match run.next(now) {
                    Next::Write(frame) => {
                        // Steps are sent in their order; a step that was left out is not sent later.
                        writes += 1;
                        let step = &command.steps[run.step() - 1].write;
                        prop_assert_eq!((frame.function, frame.address), (step.function, step.address));
                        prop_assert!(writes <= run.step(), "step {} and write {}", run.step(), writes);
                    }
                    Next::Read(points) => asked = points,
                    Next::WaitUntil(at) => {
                        prop_assert!(at > now);
                        prop_assert!(at <= now + Duration::from_millis(500), "{:?} is long", at - now);
                    }
                    Next::Done(report) => {
                        prop_assert!(report.sent as usize <= writes);
                        prop_assert_eq!(over.get_or_insert(report.clone()), &report);
                    }
                    _ => {}
                },
                Input::Later(ms) => now += Duration::from_millis(u64::from(ms)),
                Input::Store(at, words) => run.store(at, &words),
                Input::StoreAsked(word, which) => {
                    for (index, point) in asked.iter().enumerate() {
                        if which >> (index % 64) & 1 == 1 {
                            let point = &profile.points[*point];
                            run.store(point.address, &vec![word; usize::from(point.registers)]);
                        }
                    }
                }
                Input::Read(failure) => run.read(now, failure.map_or(Ok(()), Err)),
                Input::Written(outcome) => run.written(now, outcome),
            }
            prop_assert!(run.sent() as usize <= writes);
            prop_assert!(writes <= command.steps.len());
        }
    }

    /// A command that is given what it asks for comes to an end, whatever the answers are.
    #[test]
    fn every_command_ends(
        (profile, command) in select(commands()),
        words in prop::collection::vec((0..16_u16, any::<bool>()), 1..40),
        outcomes in prop::collection::vec(select(&[WriteOutcome::Acknowledged, WriteOutcome::Lost][..]), 6),
    ) {
        let args: Vec<_> = command.args.iter().filter(|arg| arg.name == "channel").map(|_| ("channel", "7")).collect();
        let mut run = Run::new(profile, command, command.arguments(args, local()).unwrap(), WordOrder::LowFirst);
        let mut now = Duration::ZERO;
        let (mut words, mut outcomes) = (words.into_iter().cycle(), outcomes.into_iter().cycle());
        for _ in 0..10_000 {
            match run.next(now) {
                Next::Read(points) => {
                    let (word, answers) = words.next().unwrap();
                    now += Duration::from_millis(40);
                    for point in points.iter().filter(|_| answers) {
                        let point = &profile.points[*point];
                        run.store(point.address, &vec![word; usize::from(point.registers)]);
                    }
                    run.read(now, if answers { Ok(()) } else { Err(ReadFailure::Silent) });
                }
                Next::Write(_) => {
                    now += Duration::from_millis(40);
                    run.written(now, outcomes.next().unwrap());
                }
                Next::WaitUntil(at) => now = at,
                Next::Pending => prop_assert!(false, "nothing is asked for"),
                Next::Done(report) => {
                    prop_assert_eq!(report.elapsed, now);
                    return Ok(());
                }
            }
        }
        prop_assert!(false, "no end after {now:?}");
    }
}
