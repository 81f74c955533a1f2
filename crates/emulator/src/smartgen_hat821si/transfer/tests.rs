//! The sequence alone, with switches that do as they are told.

use super::*;
use crate::random::Random;

const TENTH: Duration = Duration::from_millis(100);
const EVERYTHING: Positions = Positions::ALL_CLOSED;

fn limits(set: &[(&str, &str)]) -> Limits {
    let mut settings = super::super::tests::settings();
    set.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
    Limits::of(&settings)
}

fn view(now: Positions, target: Positions) -> View {
    View {
        now,
        target,
        ready: EVERYTHING,
        not_closed: Positions::OPEN,
        not_opened: Positions::OPEN,
        may_loop: false,
        in_step: true,
        forced: Positions::OPEN,
        alive: now.feeds().map(|by| by.contains(&true)),
    }
}

/// Switches that move at once; the statuses on the way.
fn walk(from: Positions, to: Positions, may_loop: bool, limits: &Limits) -> (Positions, Vec<u16>) {
    let (mut sequence, mut now, mut statuses) = (Sequence::new(), from, Vec::new());
    for _ in 0..200 {
        now = moved(now, sequence.drives());
        let failure = sequence.step(TENTH, View { may_loop, ..view(now, to) }, limits);
        assert_eq!(failure, None);
        statuses.push(sequence.status(now));
        statuses.dedup();
    }
    (now, statuses)
}

fn run(sequence: &mut Sequence, steps: u32, view: View, limits: &Limits) {
    for _ in 0..steps {
        sequence.step(TENTH, view, limits);
    }
}

fn moved(now: Positions, drives: [Option<Drive>; 3]) -> Positions {
    Positions::by(|switch| drives[switch as usize].map_or(now.is_closed(switch), Drive::closes))
}

#[test]
fn each_transfer_opens_rests_and_closes() {
    let at = Positions::of;
    let limits = limits(&[]);
    for (from, to, statuses) in [
        (at(1, 0, 1), at(0, 1, 1), vec![0, 2, 5, 20, 23]),
        (at(0, 1, 1), at(1, 0, 1), vec![0, 21, 5, 1, 24]),
        (at(1, 0, 1), at(1, 1, 0), vec![0, 4, 5, 20, 22]),
        (at(1, 1, 0), at(0, 1, 1), vec![0, 2, 5, 3, 23]),
        (at(1, 0, 1), at(0, 0, 0), vec![0, 2, 4, 18]),
        (at(0, 0, 0), at(0, 1, 1), vec![0, 3, 20, 23]),
        (at(1, 0, 0), at(1, 0, 0), vec![16]),
        (at(0, 1, 0), at(0, 0, 1), vec![0, 21, 5, 3, 17]),
    ] {
        assert_eq!(walk(from, to, false, &limits), (to, statuses), "{from:?} to {to:?}");
    }
}

#[test]
fn a_loop_closing_closes_in_step_and_then_opens() {
    let at = Positions::of;
    let limits = limits(&[]);
    for (from, to, statuses) in [
        (at(1, 0, 1), at(0, 1, 1), vec![0, 10, 9, 30, 2, 23]),
        (at(0, 1, 1), at(1, 0, 1), vec![0, 10, 11, 30, 21, 24]),
        (at(1, 1, 0), at(1, 0, 1), vec![0, 10, 12, 30, 21, 24]),
        (at(1, 1, 0), at(0, 1, 1), vec![0, 10, 12, 30, 2, 23]),
        (at(1, 0, 0), at(0, 1, 1), vec![0, 3, 10, 9, 30, 2, 23]),
        (at(1, 0, 1), at(0, 0, 0), vec![0, 2, 4, 18]),
        (at(1, 0, 0), at(0, 0, 1), vec![0, 2, 5, 3, 17]),
    ] {
        assert_eq!(walk(from, to, true, &limits), (to, statuses), "{from:?} to {to:?}");
    }
}

#[test]
fn elevators_stop_before_a_living_section_is_interrupted() {
    let at = Positions::of;
    let limits = limits(&[("elevator_delay", "4")]);
    assert_eq!(walk(at(1, 0, 1), at(0, 1, 1), false, &limits).1, [0, 15, 2, 5, 20, 23]);
    assert_eq!(
        walk(at(1, 0, 1), at(0, 1, 1), true, &limits).1,
        [0, 10, 9, 30, 2, 23],
        "nothing is interrupted"
    );
    assert_eq!(walk(at(0, 0, 0), at(0, 1, 1), false, &limits).1, [0, 3, 20, 23]);

    let (mut sequence, target) = (Sequence::new(), at(0, 1, 1));
    let now = view(at(1, 0, 1), target);
    sequence.step(TENTH, now, &limits);
    assert!(!sequence.holds_elevators());
    sequence.step(TENTH, now, &limits);
    assert!(sequence.holds_elevators() && sequence.seconds_left() == 4);
    for _ in 0..40 {
        assert_eq!(sequence.drives(), [None; 3]);
        sequence.step(TENTH, now, &limits);
    }
    assert_eq!(sequence.drives()[0], Some(Drive::Open));
    // Wanted no longer, it ends.
    let mut sequence = Sequence::new();
    run(&mut sequence, 10, now, &limits);
    let back = View { target: now.now, ..now };
    run(&mut sequence, 2, back, &limits);
    assert!(sequence.is_still() && !sequence.holds_elevators());
    // Nothing that lives is interrupted: section 1 has lost its source.
    let mut sequence = Sequence::new();
    let dead = View { alive: [false, true], ..now };
    run(&mut sequence, 2, dead, &limits);
    assert_eq!(sequence.drives()[0], Some(Drive::Open));
}

#[test]
fn the_delay_counts_down() {
    let (mut sequence, limits) = (Sequence::new(), limits(&[]));
    let (from, to) = (Positions::of(1, 0, 1), Positions::of(0, 1, 1));
    run(&mut sequence, 2, view(from, to), &limits);
    assert_eq!((sequence.seconds_left(), sequence.seconds_to_alarm()), (5, 5));
    let now = view(Positions::of(0, 0, 1), to);
    sequence.step(TENTH, now, &limits);
    assert_eq!((sequence.seconds_left(), sequence.seconds_to_alarm()), (2, 0));
    for _ in 0..11 {
        sequence.step(TENTH, now, &limits);
    }
    assert_eq!(sequence.seconds_left(), 1);
}

/// Steps with this view until something fails; how many steps that took.
fn fail(sequence: &mut Sequence, view: View, limits: &Limits) -> (Failure, u32) {
    for steps in 1..2000 {
        if let Some(failure) = sequence.step(TENTH, view, limits) {
            return (failure, steps);
        }
    }
    panic!("nothing failed: {sequence:?}");
}

#[test]
fn a_switch_that_does_not_move_ends_the_transfer() {
    let (from, to) = (Positions::of(1, 0, 1), Positions::of(0, 1, 1));
    let limits = limits(&[]);
    let mut sequence = Sequence::new();
    assert_eq!(fail(&mut sequence, view(from, to), &limits), (Failure::Move(Switch::Qs1, Drive::Open), 52));
    assert_eq!((sequence.drives(), sequence.status(from)), ([None; 3], 24));
    // While its alarm stands nothing moves.
    let stuck = View { not_opened: Positions::of(1, 0, 0), ..view(from, to) };
    for _ in 0..100 {
        assert_eq!(sequence.step(TENTH, stuck, &limits), None);
        assert!(sequence.is_still());
    }
    run(&mut sequence, 2, view(from, to), &limits);
    assert_eq!(sequence.drives(), [Some(Drive::Open), None, None]);

    let mut sequence = Sequence::new();
    let now = view(Positions::of(0, 0, 1), to);
    assert_eq!(fail(&mut sequence, now, &limits).0, Failure::Move(Switch::Qtie, Drive::Close));
    // What did not close is not tried again; what has to open still does.
    let kept = View { not_closed: Positions::of(0, 1, 0), ..now };
    run(&mut sequence, 10, kept, &limits);
    assert!(sequence.is_still());
    let open = View { target: Positions::OPEN, ..kept };
    run(&mut sequence, 2, open, &limits);
    assert_eq!(sequence.drives(), [None, None, Some(Drive::Open)]);
}

#[test]
fn a_switch_that_is_not_ready_is_waited_for() {
    let limits_with = limits(&[]);
    let to = Positions::of(0, 1, 1);
    let unready = View { ready: Positions::OPEN, ..view(Positions::of(0, 0, 1), to) };
    let mut sequence = Sequence::new();
    run(&mut sequence, 2, unready, &limits_with);
    assert_eq!((sequence.status(unready.now), sequence.waits_for()), (19, Some(Switch::Qtie)));
    assert_eq!((sequence.seconds_left(), sequence.drives()), (10, [None; 3]));
    let mut patient = sequence.clone();
    patient.step(TENTH, View { ready: EVERYTHING, ..unready }, &limits_with);
    assert_eq!(patient.status(unready.now), 20);
    assert_eq!(fail(&mut sequence, unready, &limits_with), (Failure::Move(Switch::Qtie, Drive::Close), 100));

    let without = limits(&[("position_feedback", "0")]);
    let mut careless = Sequence::new();
    run(&mut careless, 2, unready, &without);
    assert_eq!(careless.status(unready.now), 20);
}

#[test]
fn sources_that_do_not_come_together_are_told_of_and_waited_for() {
    let (from, to) = (Positions::of(1, 0, 1), Positions::of(0, 1, 1));
    let apart = View { may_loop: true, in_step: false, ..view(from, to) };
    let limits_with = limits(&[("sync_time", "20")]);
    let mut sequence = Sequence::new();
    run(&mut sequence, 2, apart, &limits_with);
    assert_eq!((sequence.status(from), sequence.seconds_to_sync_failure()), (10, 20));
    assert_eq!(fail(&mut sequence, apart, &limits_with), (Failure::Sync, 200));
    for _ in 0..50 {
        assert_eq!(sequence.step(TENTH, apart, &limits_with), None, "it is said once");
    }
    assert!(sequence.sync_fails() && sequence.status(from) == 10);
    sequence.step(TENTH, View { in_step: true, ..apart }, &limits_with);
    assert_eq!((sequence.status(from), sequence.sync_fails()), (9, false));

    let fallback = limits(&[("sync_time", "20"), ("sync_fallback", "1")]);
    let mut sequence = Sequence::new();
    (0..210).for_each(|_| assert_eq!(sequence.step(TENTH, apart, &fallback), None));
    assert_eq!(sequence.status(from), 2, "with a gap then");
}

#[test]
fn what_must_be_open_opens_though_another_one_does_not() {
    let limits = limits(&[]);
    let joined = Positions::of(1, 0, 1);
    let stuck = View { not_opened: Positions::of(1, 0, 0), ..view(joined, Positions::OPEN) };
    let mut sequence = Sequence::new();
    run(&mut sequence, 100, stuck, &limits);
    assert!(sequence.is_still(), "nobody has to be open");
    run(&mut sequence, 2, View { forced: EVERYTHING, ..stuck }, &limits);
    assert_eq!(sequence.drives(), [None, None, Some(Drive::Open)]);
}

#[test]
fn a_switch_that_does_not_close_is_driven_once_more_where_that_is_set() {
    let limits = limits(&[("closing_again_time", "2")]);
    let now = view(Positions::of(0, 0, 1), Positions::of(0, 1, 1));
    let mut sequence = Sequence::new();
    let mut pulses = vec![];
    for step in 0..100 {
        let failure = sequence.step(TENTH, now, &limits);
        pulses.push(sequence.drives()[1].is_some());
        if let Some(failure) = failure {
            assert_eq!((failure, step), (Failure::Move(Switch::Qtie, Drive::Close), 72));
            break;
        }
    }
    pulses.dedup();
    assert_eq!(pulses, [false, true, false, true, false]);
}

#[test]
fn a_switch_that_is_late_does_not_close_when_the_sources_have_passed() {
    let limits_with = limits(&[]);
    let passing = View { may_loop: true, ..view(Positions::of(1, 0, 1), Positions::of(1, 1, 0)) };
    for (again, failure) in [("0", Some(Failure::Move(Switch::Qtie, Drive::Close))), ("5", None)] {
        let limits_again = limits(&[("closing_again_time", again)]);
        let mut sequence = Sequence::new();
        run(&mut sequence, 3, passing, &limits_again);
        assert_eq!(sequence.status(passing.now), 9);
        let past = View { in_step: false, ..passing };
        run(&mut sequence, 2, past, &limits_again);
        assert_eq!(sequence.drives()[1], Some(Drive::Close), "it moves");
        assert_eq!(sequence.step(TENTH, past, &limits_again), failure);
        assert_eq!(sequence.drives(), [None; 3]);
    }
    let mut sequence = Sequence::new();
    run(&mut sequence, 30, passing, &limits_with);
    assert_eq!(sequence.status(passing.now), 9, "in step it may take its time");
}

#[test]
fn sources_that_stay_joined_are_parted_by_the_switch_that_joined_them() {
    let to = Positions::of(0, 1, 1);
    let limits = limits(&[]);
    let mut sequence = Sequence::new();
    let looping = View { may_loop: true, ..view(Positions::of(1, 0, 1), to) };
    run(&mut sequence, 3, looping, &limits);
    assert_eq!(sequence.status(looping.now), 9);
    let joined = View { now: Positions::ALL_CLOSED, ..looping };
    assert_eq!(fail(&mut sequence, joined, &limits).0, Failure::Move(Switch::Qs1, Drive::Open));
    assert_eq!(sequence.status(joined.now), 30);
    let stuck = View { not_opened: Positions::of(1, 0, 0), ..joined };
    run(&mut sequence, 2, stuck, &limits);
    assert_eq!(sequence.drives(), [None, Some(Drive::Open), None]);
}

/// What may befall a sequence in one step.
struct Luck {
    random: Random,
}

impl Luck {
    fn with(&mut self, chance: f64) -> bool {
        self.random.between(0.0, 1.0) < chance
    }

    fn target(&mut self) -> Positions {
        let targets = [[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 0], [0, 0, 1]];
        let [qs1, qtie, qs2] = targets[self.random.between(0.0, 6.0) as usize];
        Positions::of(qs1, qtie, qs2)
    }
}

#[test]
fn whatever_is_asked_for_and_when_the_sources_never_meet_unasked() {
    let mut luck = Luck { random: Random::new(5) };
    let limits = limits(&[("elevator_delay", "1"), ("opening_time", "1"), ("closing_time", "1")]);
    let mut sequence = Sequence::new();
    let (mut now, mut target) = (Positions::of(1, 0, 1), Positions::of(1, 0, 1));
    for _ in 0..40_000 {
        sequence.step(TENTH, view(now, target), &limits);
        // A switch that sometimes takes a step longer.
        if luck.with(0.6) {
            now = moved(now, sequence.drives());
        }
        assert_ne!(now, Positions::ALL_CLOSED);
        if luck.with(0.1) {
            target = luck.target();
        }
    }
}

#[test]
fn the_ways_are_those_that_are_walked() {
    let mut luck = Luck { random: Random::new(7) };
    let set = [
        ("elevator_delay", "0.3"),
        ("opening_time", "1"),
        ("closing_time", "1"),
        ("position_feedback_time", "0.8"),
        ("transfer_rest", "0.5"),
        ("loop_time", "0.4"),
        ("sync_time", "1"),
    ];
    let fallback = [&set[..], &[("sync_fallback", "1")]].concat();
    let mut walked = std::collections::BTreeSet::new();
    for limits in [limits(&set), limits(&fallback)] {
        let mut sequence = Sequence::new();
        let mut view = view(Positions::of(1, 0, 1), Positions::of(1, 0, 1));
        for _ in 0..200_000 {
            match sequence.step(TENTH, view, &limits) {
                Some(Failure::Move(switch, Drive::Open)) if luck.with(0.5) => {
                    view.not_opened = Positions::by(|it| it == switch);
                }
                Some(Failure::Move(switch, Drive::Close)) if luck.with(0.5) => {
                    view.not_closed = Positions::by(|it| it == switch);
                }
                _ => {}
            }
            if luck.with(0.4) {
                view.now = moved(view.now, sequence.drives());
            }
            if luck.with(0.08) {
                view.target = luck.target();
                view.may_loop = luck.with(0.7);
            }
            if luck.with(0.3) {
                view.in_step = luck.with(0.3);
                view.ready = Positions::by(|_| luck.with(0.9));
            }
            if luck.with(0.02) {
                (view.not_closed, view.not_opened) = (Positions::OPEN, Positions::OPEN);
                view.alive = [luck.with(0.9); 2];
            }
            // Somebody opens one by hand.
            if luck.with(0.01) {
                view.now = Positions::by(|switch| view.now.is_closed(switch) && switch != Switch::Qs1);
            }
        }
        walked.extend(sequence.walked);
    }
    let drawn: std::collections::BTreeSet<_> =
        Stage::WAYS.iter().map(|edge| (edge.from as u8, edge.to as u8)).collect();
    assert_eq!(walked, drawn);
    assert_eq!(drawn.len(), Stage::WAYS.len(), "each is drawn once");
}
