//! Scripts of minutes: how a wire keeps its pace with peers that do not keep theirs.

use super::script::*;
use super::*;

#[test]
fn does_not_storm_a_device_that_hangs_up_after_each_answer() {
    let mut script = Script::new();
    let mut connections = Vec::new();
    let mut transaction = 0;
    for now in 0..40_000 {
        if script.step(now) == Step::Connect {
            connections.push(now);
            script.wire.connected(ms(now));
        }
        // Somebody always wants something; that fails while the wire is down.
        let _ = script.submit(now, Priority::Poll, read(1));
        if matches!(script.step(now), Step::Send(_)) {
            transaction += 1;
            script.hears(now, &answer(transaction));
            script.loses(now, Cause::Closed);
        }
    }
    let waits: Vec<u64> = connections.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert_eq!(waits, [200, 400, 800, 1600, 3200, 6400, 10_000, 10_000]);
    assert_eq!(script.statistics().answers, 9);
    assert!(matches!(script.wire.phase(), Phase::Down { .. }), "and it shows");
}

/// Unit 1 is asked each second and answers in 5 ms; the others are asked without end and never answer. How often it
/// answered in a minute, the longest pause between two answers, how often each of the others was asked, and how often
/// the connection was made.
fn pace(silent_units: u8, priority: Priority) -> (usize, u64, Vec<usize>, usize) {
    const GOOD: u8 = 1;
    let mut script = Script::new();
    let mut waiting: Vec<Option<Ticket>> = (0..=silent_units).map(|_| None).collect();
    let mut asked = vec![0; waiting.len()];
    let (mut connections, mut answers, mut next_poll) = (0, Vec::new(), 0);
    let mut under_way: Option<(u64, Vec<u8>)> = None;
    for now in 0..60_000 {
        for (index, ticket) in waiting.iter_mut().enumerate() {
            let unit = GOOD + u8::try_from(index).unwrap();
            if let Some(outcome) = ticket.as_ref().and_then(|ticket| script.outcome(ticket)) {
                *ticket = None;
                assert_eq!(outcome.is_ok(), unit == GOOD, "unit {unit} at {now}: {outcome:?}");
                if unit == GOOD {
                    answers.push(now);
                }
            }
            if ticket.is_none() && (unit != GOOD || now >= next_poll) {
                if unit == GOOD {
                    next_poll = now + 1000;
                }
                *ticket = script.submit_to(now, unit, priority, read(1)).ok();
            }
        }
        if let Some((_, bytes)) = under_way.take_if(|(at, _)| *at == now) {
            script.hears(now, &bytes);
        }
        match script.step(now) {
            Step::Connect => {
                connections += 1;
                script.wire.connected(ms(now));
            }
            Step::Send(_) => {
                let unit = script.out[6];
                asked[usize::from(unit - GOOD)] += 1;
                under_way = (unit == GOOD).then(|| {
                    let transaction = u16::from_be_bytes([script.out[0], script.out[1]]);
                    (now + 5, answer(transaction))
                });
            }
            _ => {}
        }
    }
    let longest = answers.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(u64::MAX);
    (answers.len(), longest, asked.split_off(1), connections)
}

#[test]
fn silent_units_do_not_hold_up_the_one_that_answers() {
    // Whatever they are, they cost the good one a time-out a round at most: the one that is under way. Polled, they
    // have three time-outs to fall silent, and then slots after 1, 2, 4, 8 and 16 seconds.
    for (silent_units, priority, answers, longest, asked) in [
        (0, Priority::Poll, 60, 1000, vec![]),
        (1, Priority::Poll, 60, 1016, vec![8]),
        (3, Priority::Poll, 60, 1066, vec![8, 8, 8]),
        (8, Priority::Poll, 60, 1206, vec![7; 8]),
        // Where a person waits for each of them, they take turns.
        (3, Priority::Person, 20, 3005, vec![20, 20, 20]),
    ] {
        let found = pace(silent_units, priority);
        let expected = (answers, longest, asked, 1);
        assert_eq!(found, expected, "{silent_units} silent units, {priority:?}");
    }
}
