//! Scripts of a line that is never silent: everybody who waits learns why, and nothing leaves into the noise.

use super::script::*;
use super::*;
use crate::job::{Ask, Write};

/// Bytes come all the time, from `from` on, one each 2 ms: the line is never silent for 3.5 characters.
fn noise(script: &mut Script, from: u64, until: u64) {
    for now in (from..until).step_by(2) {
        script.hears(now, &[0xFF]);
        match script.step(now) {
            Step::Wait(Some(next)) => assert!(next > ms(now)),
            Step::Wait(None) => {}
            other => panic!("{other:?} at {now}, into the noise"),
        }
    }
}

#[test]
fn a_line_that_is_never_silent_holds_nobody_for_ever() {
    let mut script = Script::serial();
    noise(&mut script, 0, 500);
    let read = script.read(500);
    let write = script.write(600, 4);
    noise(&mut script, 500, 1498);
    assert_eq!(script.outcome(&read), None);
    noise(&mut script, 1498, 1502);
    assert_eq!(script.outcome(&read), Some(Err(never_silent())), "as long as it would wait for an answer");
    assert_eq!(script.outcome(&write), None);
    noise(&mut script, 1502, 1602);
    assert_eq!(script.outcome(&write), Some(Err(never_silent())), "nothing of it has left");

    // When it ends, all is as before.
    let read = script.read(1602);
    assert!(matches!(script.step(1610), Step::Send(_)));
    script.hears(1640, &rtu_answer(1, 7));
    assert_eq!(script.outcome(&read), Some(Ok(vec![7, 0])));
}

#[test]
fn who_waited_in_silence_is_not_blamed_for_the_noise() {
    // A pause is no noise, however long; nor is one byte in it, and what was waited before it does not count.
    let spacing = ms(5000);
    let options = Options { spacing, ..Options::default() };
    let mut script = Script::serial_with(options);
    script.read(0);
    script.asks(0);
    script.hears(40, &rtu_answer(1, 7));
    let waiting = script.read(50);
    script.hears(2000, &[0xFF]);
    assert_eq!(script.step(4000), Step::Wait(Some(ms(5040))));
    noise(&mut script, 5039, 6000);
    assert_eq!(script.outcome(&waiting), None);
    assert!(matches!(script.step(6010), Step::Send(_)));
}

#[test]
fn an_exchange_and_what_belongs_to_it_end_in_noise_too() {
    let mut script = Script::serial();
    let read = script.read(0);
    script.asks(0);
    // Its answer never comes; its second try has to wait, and never leaves.
    noise(&mut script, 2, 1020);
    assert_eq!(script.outcome(&read), None);
    noise(&mut script, 1020, 2030);
    assert_eq!(script.outcome(&read), Some(Err(never_silent())));

    let mut script = Script::serial();
    let writes = [4, 5].map(|value| Write::Register { address: 8193, value });
    let ask = Ask::Together { writes: writes.into(), done: 0 };
    let ticket = script.submit_job(0, Job { ask, priority: Priority::Command, ..job(1) }).unwrap();
    script.asks(0);
    let echo = script.out.clone();
    script.hears(30, &echo);
    noise(&mut script, 32, 1100);
    let Poll::Ready(outcome) = script.wire.take(&ticket, Waker::noop()) else { panic!("it waits for ever") };
    assert_eq!((outcome.result, outcome.done), (Err(never_silent()), 1));
}

#[test]
fn another_client_on_the_line_is_noise() {
    let mut script = Script::serial();
    let read = script.read(0);
    script.asks(0);
    script.hears(30, &rtu_answer(1, 7));
    assert!(script.outcome(&read).is_some());
    let read = script.read(31);
    for now in (32..1200).step_by(40) {
        script.hears(now, &rtu_answer(2, 7));
        assert!(!matches!(script.step(now), Step::Send(_)), "{now}");
    }
    assert_eq!(script.outcome(&read), Some(Err(never_silent())));
}

fn never_silent() -> LinkError {
    LinkError::NeverSilent { unit: 1, after: ms(TIMEOUT) }
}
