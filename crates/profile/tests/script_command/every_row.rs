//! Every command of every profile through everything that can come of a write.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_profile::command::{
    Condition, Evidence, Next, Proof, ReadFailure, Report, Subject, Test, Verdict, WriteOutcome, WriteValue,
};
use busbar_profile::{Command, builtins};

use crate::harness::{Bench, World, frame};

/// What can come of a write.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Done,
    AnswerLost,
    AnswerLate,
    Exception,
    AlreadySo,
    NeverChanges,
    /// Somebody at the panel brings it elsewhere.
    Elsewhere,
    /// Somebody at the panel brings it about though the device refused.
    RefusedYetSo,
    Silent,
    NotSent,
}

const COURSES: [Course; 10] = [
    Course::Done,
    Course::AnswerLost,
    Course::AnswerLate,
    Course::Exception,
    Course::AlreadySo,
    Course::NeverChanges,
    Course::Elsewhere,
    Course::RefusedYetSo,
    Course::Silent,
    Course::NotSent,
];

/// The commands of one write, with the first thing that each argument can be.
fn rows() -> impl Iterator<Item = (&'static str, &'static Command, Vec<(&'static str, String)>)> {
    builtins().iter().flat_map(|profile| {
        let single = profile
            .commands
            .iter()
            .filter(|command| command.steps.len() == 1 && command.steps[0].already.is_empty());
        single.map(|command| {
            let args = command.args.iter().map(|arg| (arg.name.as_str(), first_of(arg))).collect();
            (profile.key.as_str(), command, args)
        })
    })
}

fn first_of(arg: &busbar_profile::command::Arg) -> String {
    match &arg.values {
        busbar_profile::command::ArgValues::Choices(choices) => choices[0].id.clone(),
        busbar_profile::command::ArgValues::Range(range) => range.end().to_string(),
        busbar_profile::command::ArgValues::Time { .. } => "now".to_owned(),
    }
}

/// Makes a condition hold or not. `arg` is what the command writes.
fn bring(world: &mut World, condition: &Condition, holds: bool, arg: u32) {
    let Subject::Point { point, bit } = condition.subject else { panic!("an argument") };
    let largest = if bit.is_some() { 1 } else { 30 };
    let fits = |code: &u32| match &condition.test {
        Test::Equals(value) => code == value,
        Test::NotEquals(value) => code != value,
        Test::Between(range) => range.contains(code),
        Test::EqualsArg(_) => *code == arg,
        // All begins at 0.
        Test::Changes => *code != 0,
    };
    let code = (0..=largest).find(|code| fits(code) == holds).unwrap();
    world.set(&world.profile.points[point].id, bit, code);
}

fn goals(command: &Command) -> Vec<&Condition> {
    let conditions = command.proof.steps().iter().filter_map(|step| match &step.what {
        Evidence::Point(condition) => Some(condition),
        _ => None,
    });
    conditions.collect()
}

fn is_reset(command: &Command) -> bool {
    command.proof.steps().iter().any(|step| matches!(step.what, Evidence::Device(_)))
}

/// A controller on which the command can be given and would change something.
fn ready(world: &mut World, command: &Command, arg: u32) {
    for goal in goals(command).iter().rev() {
        bring(world, goal, false, arg);
    }
    if let Some(condition) = command.already.first() {
        bring(world, condition, false, arg);
    }
    for condition in &command.require {
        bring(world, condition, true, arg);
    }
    if let WriteValue::By { point, values } = &command.steps[0].write.value {
        world.set(&world.profile.points[*point].id, None, values[0].0);
    }
}

/// Lets one course happen to one command. Counts the writes on the way.
fn happen(key: &str, command: &'static Command, args: &[(&str, &str)], course: Course) -> Report {
    let mut world = World::new(key);
    let arg = args.iter().find_map(|(_, text)| text.parse().ok()).unwrap_or(0);
    ready(&mut world, command, arg);
    if course == Course::AlreadySo {
        let changes = |condition: &&Condition| condition.test == Test::Changes;
        for goal in goals(command).into_iter().filter(|goal| !changes(goal)) {
            bring(&mut world, goal, true, arg);
        }
        for condition in &command.already {
            bring(&mut world, condition, true, arg);
        }
    }
    let mut bench = Bench::of(world, command, args);
    let mut written: Option<Duration> = None;
    let mut writes = 0;
    loop {
        match bench.ask() {
            Next::Read(points) => {
                let failure = after_write(&mut bench, command, course, written, arg);
                bench.answer(&points, failure);
            }
            Next::Write(sent) => {
                assert_eq!(frame(sent).0, command.steps[0].write.function);
                writes += 1;
                assert_eq!(writes, 1, "{key} {} {course:?}: sent again", command.id);
                bench.outcome(match course {
                    Course::AnswerLost | Course::AnswerLate | Course::Silent => WriteOutcome::Lost,
                    Course::Exception | Course::RefusedYetSo => WriteOutcome::Exception(3),
                    Course::NotSent => WriteOutcome::NotSent,
                    _ => WriteOutcome::Acknowledged,
                });
                written = Some(bench.now);
            }
            Next::Done(report) => {
                assert_eq!(report.sent, if course == Course::NotSent { 0 } else { writes });
                assert_eq!(bench.ask(), Next::Done(report.clone()), "the end is the end");
                return report;
            }
            other => panic!("{key} {} {course:?}: {other:?}", command.id),
        }
    }
}

/// What a reading meets, and whether it fails.
fn after_write(
    bench: &mut Bench<'_>,
    command: &Command,
    course: Course,
    written: Option<Duration>,
    arg: u32,
) -> Option<ReadFailure> {
    let since = bench.now - written?;
    let comes = match course {
        Course::Done | Course::AnswerLost | Course::RefusedYetSo => true,
        Course::AnswerLate => since >= Duration::from_secs(2),
        _ => false,
    };
    if is_reset(command) {
        let down = comes && (Duration::from_secs(3)..Duration::from_secs(9)).contains(&since);
        return (down || course == Course::Silent).then_some(ReadFailure::Silent);
    }
    if comes {
        for goal in goals(command) {
            bring(&mut bench.world, goal, true, arg);
        }
    }
    if course == Course::Elsewhere
        && let Some(Condition { subject: Subject::Point { point, bit: None }, test: Test::Equals(_), .. }) =
            goals(command).first()
    {
        bench.world.set(&bench.world.profile.points[*point].id.clone(), None, 29);
    }
    (course == Course::Silent).then_some(ReadFailure::Silent)
}

/// The verdict that a course must come to, and words that its reason must have.
fn expected(command: &Command, course: Course) -> (Verdict, &'static str) {
    let proved = matches!(command.proof, Proof::Steps(_));
    let toggle = !command.already.is_empty();
    let other = matches!(
        goals(command).first(),
        Some(Condition { subject: Subject::Point { bit: None, .. }, test: Test::Equals(_), .. })
    );
    let changes = goals(command).iter().any(|goal| goal.test == Test::Changes);
    match course {
        Course::NotSent => (Verdict::Refused, "Nothing was sent: the write did not leave"),
        Course::Exception => (Verdict::Refused, "refused the write with exception 3 (illegal data value)"),
        Course::RefusedYetSo if proved && !is_reset(command) => {
            (Verdict::Refused, "all the same, which was not this command")
        }
        Course::RefusedYetSo => (Verdict::Refused, "refused the write"),
        _ if !proved => (Verdict::Unknown, "and "),
        Course::AlreadySo if toggle => (Verdict::Done, "It is so already, and nothing was sent: "),
        Course::Done => (Verdict::Done, ""),
        Course::AlreadySo if is_reset(command) || changes => {
            (Verdict::NoEffect, "acknowledged the write, but")
        }
        Course::AlreadySo => (Verdict::Done, "as it was before"),
        Course::AnswerLost | Course::AnswerLate => (Verdict::Done, "The answer to the write was lost, but "),
        Course::Elsewhere if other => (Verdict::NoEffect, "somebody at the panel or the controller itself"),
        Course::NeverChanges | Course::Elsewhere if is_reset(command) => {
            (Verdict::NoEffect, "the device answered every reading for 60 s")
        }
        Course::NeverChanges | Course::Elsewhere => (Verdict::NoEffect, " stayed "),
        Course::Silent => (
            Verdict::Unknown,
            "The write was sent; the answer was lost, and the device has not answered since",
        ),
    }
}

#[test]
fn every_row_takes_every_course() {
    let mut count = 0;
    for (key, command, args) in rows() {
        let args: Vec<_> = args.iter().map(|(name, text)| (*name, text.as_str())).collect();
        for course in COURSES {
            let report = happen(key, command, &args, course);
            let (verdict, words) = expected(command, course);
            let place = format!("{key} {} {course:?}: {report:?}", command.id);
            assert_eq!(report.verdict, verdict, "{place}");
            assert!(report.reason.contains(words), "{place}");
            assert!(report.reason.ends_with('.') && !report.reason.contains(".."), "{place}");
            let seen = report.evidence.iter().filter(|observed| observed.after.is_some()).count();
            let shows =
                matches!(command.proof, Proof::Steps(_)) && report.sent == 1 && course != Course::Silent;
            assert!(!shows || seen > 0 || is_reset(command), "{place}");
        }
        count += 1;
    }
    assert_eq!(count, 13 + 4 + 76 + 11, "commands of one write");
}

#[test]
fn a_broken_precondition_sends_nothing() {
    for (key, command, args) in rows().filter(|(_, command, _)| !command.require.is_empty()) {
        let args: Vec<_> = args.iter().map(|(name, text)| (*name, text.as_str())).collect();
        for broken in &command.require {
            let mut world = World::new(key);
            ready(&mut world, command, 0);
            bring(&mut world, broken, false, 0);
            let mut bench = Bench::of(world, command, &args);
            let Next::Read(points) = bench.ask() else { panic!("{key} {}", command.id) };
            bench.answer(&points, None);
            let Next::Done(report) = bench.ask() else { panic!("{key} {}", command.id) };
            assert_eq!((report.verdict, report.sent), (Verdict::Refused, 0));
            assert!(report.reason.contains(", and must be "), "{}", report.reason);
            assert_eq!(report.evidence.len(), 1);
        }
    }
}

/// The frame of each row of the table, as the manuals have it.
#[test]
fn every_row_sends_its_frame() {
    let mut expected: Vec<(&str, String, (u8, u16, u16))> = Vec::new();
    let mut row = |key, id: &str, frame| expected.push((key, id.to_owned(), frame));
    for (id, value) in [
        ("stop", 1),
        ("auto", 4),
        ("test", 8),
        ("run", 2),
        ("manual", 2),
        ("gcb", 32),
        ("mcb", 64),
        ("menu_next", 128),
        ("menu_previous", 256),
        ("up", 512),
        ("down", 1024),
    ] {
        row("datakom-d", id, (6, 8193, value));
    }
    row("datakom-d", "channel", (6, 8194, 19));
    row("datakom-d", "reset", (6, 8210, 14536));
    for (id, value) in [("auto", 0x10), ("off", 0x20), ("test", 0x40), ("load_test", 0x80)] {
        row("datakom-dkg705", id, (6, 0x40, value));
    }
    row("smartgen-hat821si", "manual", (5, 15004, 0));
    for (id, address) in [
        ("auto", 15004),
        ("s1_master", 15005),
        ("s2_master", 15006),
        ("alarm_reset", 15007),
        ("genset_start", 15008),
        ("genset_stop", 15009),
        ("transfer_000", 15030),
        ("transfer_101", 15031),
        ("transfer_110", 15032),
        ("transfer_011", 15033),
        ("transfer_100", 15034),
        ("transfer_001", 15035),
        ("window_confirm", 15036),
        ("window_cancel", 15037),
    ] {
        row("smartgen-hat821si", id, (5, address, 0xFF00));
    }
    for side in [1, 2] {
        for switch in 1..=12 {
            let close = 15040 + (side - 1) * 24 + (switch - 1) * 2;
            row("smartgen-hat821si", &format!("load_{side}_{switch}_close"), (5, close, 0xFF00));
            row("smartgen-hat821si", &format!("load_{side}_{switch}_open"), (5, close + 1, 0xFF00));
        }
    }
    for output in 1..=13 {
        row("smartgen-hat821si", &format!("remote_output_{output}"), (5, 15011 + output, 0xFF00));
    }
    for (id, address) in [
        ("start", 0),
        ("stop", 1),
        ("load", 3),
        ("unload", 3),
        ("down", 8),
        ("unlock", 18),
        ("lock", 19),
        ("output_1", 20),
        ("output_2", 21),
        ("output_3", 22),
        ("output_4", 23),
    ] {
        row("smartgen-acc1700", id, (5, address, 0xFF00));
    }
    let mut found = BTreeSet::new();
    for (key, command, args) in rows() {
        let args: Vec<_> = args.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let mut world = World::new(key);
        ready(&mut world, command, 19);
        let mut bench = Bench::of(world, command, &args);
        let sent = loop {
            match bench.ask() {
                Next::Read(points) => bench.answer(&points, None),
                Next::Write(sent) => break frame(sent),
                other => panic!("{key} {}: {other:?}", command.id),
            }
        };
        found.insert((key, command.id.clone(), sent));
    }
    assert_eq!(found, expected.into_iter().collect());
}
