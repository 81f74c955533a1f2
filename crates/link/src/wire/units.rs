//! Scripts of several units on one wire: whose turn it is, how long each is waited for, and who has to wait.

use super::script::*;
use super::*;
use crate::job::{Ask, Write};
use crate::statistics::UnitState;

/// The next frame leaves, and its unit answers at the same instant. Gives back unit and address.
fn serve(script: &mut Script, now: u64) -> (u8, u16) {
    let (unit, address, _) = script.asks(now);
    let transaction = u16::from_be_bytes([script.out[0], script.out[1]]);
    script.hears(now, &answer_of(unit, transaction));
    (unit, address)
}

fn adaptive() -> Script {
    let mut script = Script::on(Line::tcp(), Options { retries: 0, ..Options::default() });
    script.connect(0);
    script
}

fn poll(script: &mut Script, now: u64, unit: u8) -> Result<Ticket, LinkError> {
    script.submit_to(now, unit, Priority::Poll, read(1))
}

#[test]
fn the_unit_served_longest_ago_goes_first() {
    let mut script = Script::connected();
    for unit in [1, 2, 3] {
        script.submit_to(0, unit, Priority::Person, read(0)).unwrap();
        serve(&mut script, 0);
    }
    // Unit 1 has much to say.
    for (unit, address) in [(1, 1), (1, 2), (1, 3), (1, 4), (3, 5), (2, 6), (2, 7)] {
        script.submit_to(0, unit, Priority::Person, read(address)).unwrap();
    }
    let order: Vec<_> = (0..7).map(|_| serve(&mut script, 0)).collect();
    assert_eq!(order, [(1, 1), (2, 6), (3, 5), (1, 2), (2, 7), (1, 3), (1, 4)]);
    // The class counts more than that.
    script.submit_to(0, 2, Priority::Poll, read(8)).unwrap();
    script.submit_to(0, 1, Priority::Person, read(9)).unwrap();
    assert_eq!(serve(&mut script, 0), (1, 9));
}

#[test]
fn a_unit_has_its_pause_and_others_use_the_time() {
    let mut script = Script::connected();
    let with_pause = |unit, address| Job { spacing: ms(500), ask: read(address), ..job(unit) };
    for (unit, address) in [(1, 1), (1, 2), (2, 3), (1, 4)] {
        script.submit_job(0, with_pause(unit, address)).unwrap();
    }
    assert_eq!(serve(&mut script, 0), (1, 1));
    assert_eq!(serve(&mut script, 10), (2, 3));
    assert_eq!(script.step(10), Step::Wait(Some(ms(500))));
    // A command keeps the pause, but has not to queue for its end; nor has anybody without a pause of his own to keep.
    script.write(20, 4);
    script.submit_job(20, job(3)).unwrap();
    assert_eq!(serve(&mut script, 20).0, 3);
    assert_eq!(script.step(499), Step::Wait(Some(ms(500))));
    script.sends(500);
    assert_eq!(script.out[7], 0x06);
    script.hears(520, &echo(4));
    // The pause begins at the end of an exchange. The command had none of its own, the next read has.
    assert_eq!(script.step(520), Step::Wait(Some(ms(1020))));
    assert_eq!(serve(&mut script, 1020), (1, 2));
    // A time-out ends an exchange too.
    script.asks(1520);
    script.step(2520);
    assert_eq!(script.step(2521), Step::Wait(Some(ms(3020))));
}

#[test]
fn a_read_waits_as_long_as_its_unit_usually_takes() {
    let options = Options { retries: 0, timeouts_to_drop: 100, ..Options::default() };
    let mut script = Script::on(Line::tcp(), options);
    script.connect(0);
    for round in 0..30 {
        for (unit, takes) in [(1, 2), (2, 400)] {
            let now = 20_000 * round + 100 * u64::from(unit);
            script.submit_to(now, unit, Priority::Person, read(1)).unwrap();
            let patience = script.asks(now).2;
            if round == 0 {
                assert_eq!(patience, ms(1000), "nothing is known");
            } else if unit == 1 {
                assert_eq!(patience, ms(200), "the floor");
            }
            let transaction = u16::from_be_bytes([script.out[0], script.out[1]]);
            script.hears(now + takes, &answer_of(unit, transaction));
        }
    }
    let mut now = 600_000;
    let mut patience_of = |script: &mut Script, unit, ask| {
        script.submit_job(now, Job { ask, ..job(unit) }).unwrap();
        let patience = script.asks(now).2;
        now += 5000;
        script.step(now);
        patience.as_millis()
    };
    assert_eq!(patience_of(&mut script, 2, read(1)), 600);
    assert_eq!(patience_of(&mut script, 1, write(1)), 1000, "a write waits the whole time");
    for doubled in [400, 800, 1000] {
        assert_eq!(patience_of(&mut script, 1, read(1)), doubled);
    }
}

#[test]
fn a_silent_unit_is_polled_in_slots_that_grow() {
    let mut script = adaptive();
    for unit in [1, 2] {
        poll(&mut script, 0, unit).unwrap();
        serve(&mut script, 0);
    }
    // Unit 2 is switched off, and two more polls of it wait.
    let mut now = 0;
    for patience in [200, 400] {
        poll(&mut script, now, 2).unwrap();
        assert_eq!(script.asks(now).2, ms(patience));
        now += patience;
        script.step(now);
    }
    let last = poll(&mut script, now, 2).unwrap();
    script.asks(now);
    let waiting = poll(&mut script, now, 2).unwrap();
    now += 800;
    assert_eq!(script.step(now), Step::Wait(None), "nobody else's time is spent");
    assert!(matches!(script.outcome(&last), Some(Err(LinkError::Timeout { .. }))));
    let silent = |millis| LinkError::Silent { unit: 2, next_probe: ms(millis) };
    assert_eq!(script.outcome(&waiting), Some(Err(silent(1000))));

    let mut slots = Vec::new();
    for _ in 0..8 {
        let Err(LinkError::Silent { unit: 2, next_probe }) = poll(&mut script, now, 2) else {
            panic!("a poll outside the slots at {now}");
        };
        slots.push(next_probe.as_millis());
        now += u64::try_from(next_probe.as_millis()).unwrap();
        assert_eq!(poll(&mut script, now - 1, 2), Err(silent(1)));
        poll(&mut script, now, 2).unwrap();
        assert!(poll(&mut script, now, 2).is_err(), "one a slot");
        assert_eq!(script.asks(now).2, ms(200), "a probe is short");
        now += 200;
        assert_eq!(script.step(now), Step::Wait(None), "and has one try");
        // The others go on as before.
        poll(&mut script, now, 1).unwrap();
        serve(&mut script, now);
    }
    assert_eq!(slots, [1000, 2000, 4000, 8000, 16_000, 30_000, 30_000, 30_000]);
    let seen = script.statistics();
    assert_eq!((seen.held, seen.units[1].held, seen.units[1].requests), (24, 24, 12));
    assert!(matches!(seen.units[1].state, UnitState::Silent { .. }));
    assert_eq!(seen.units[0].state, UnitState::Answering);

    // A person has not to wait, and moves no slot; an answer ends it.
    let error = poll(&mut script, now, 2);
    script.submit_to(now, 2, Priority::Person, read(1)).unwrap();
    assert_eq!(script.asks(now).2, ms(1000), "and does not wait for less than he would for any other");
    now += 1000;
    script.step(now);
    assert_ne!(poll(&mut script, now, 2).unwrap_err(), error.unwrap_err(), "only time has passed");
    script.submit_to(now, 2, Priority::Command, read(1)).unwrap();
    serve(&mut script, now);
    poll(&mut script, now + 1, 2).unwrap();
    serve(&mut script, now + 1);
}

#[test]
fn a_late_answer_ends_the_silence_and_the_haste() {
    let mut script = adaptive();
    poll(&mut script, 0, 1).unwrap();
    serve(&mut script, 0);
    // Unit 2 was switched on later, and is slower than a probe waits.
    for now in [0, 1000, 2000] {
        poll(&mut script, now, 2).unwrap();
        assert_eq!(script.asks(now).2, ms(1000));
        script.step(now + 1000);
    }
    poll(&mut script, 4000, 2).unwrap();
    assert_eq!(script.asks(4000).2, ms(200));
    let transaction = u16::from_be_bytes([script.out[0], script.out[1]]);
    script.step(4200);
    assert!(poll(&mut script, 4200, 2).is_err());
    script.hears(4300, &answer_of(2, transaction));
    poll(&mut script, 4300, 2).unwrap();
    assert_eq!(script.asks(4300).2, ms(900), "it took 300 ms");
}

#[test]
fn a_unit_that_is_slow_at_times_is_not_given_up_early() {
    let mut script = Script::on(Line::tcp(), Options::default());
    script.connect(0);
    for round in 0..20 {
        poll(&mut script, 1000 * round, 1).unwrap();
        script.asks(1000 * round);
        script.hears(1000 * round + 50, &answer(u16::try_from(round + 1).unwrap()));
    }
    // From 50 ms to 900 ms: within the time-out that the caller gave.
    let mut now = 20_000;
    let ticket = poll(&mut script, now, 1).unwrap();
    assert_eq!(script.asks(now).2, ms(200), "it is asked again soon");
    now += 200;
    assert_eq!(script.asks(now).2, ms(1000), "and then waited for");
    script.hears(now + 700, &answer(21));
    script.hears(now + 900, &answer(22));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![0x08FE, 0])));
    assert_eq!(script.statistics().late, 1);
}

#[test]
fn one_lost_answer_does_not_put_a_unit_behind_all_others() {
    // Unit 1 has always something to be asked; unit 2 loses one answer.
    let mut script = Script::connected();
    for unit in [1, 2] {
        poll(&mut script, 0, unit).unwrap();
        serve(&mut script, 0);
    }
    poll(&mut script, 0, 2).unwrap();
    assert_eq!(script.asks(0).0, 2);
    for _ in 0..8 {
        poll(&mut script, 0, 1).unwrap();
    }
    script.step(1000);
    let transaction = u16::from_be_bytes([script.out[0], script.out[1]]);
    script.hears(1000, &answer(transaction));
    assert_eq!(serve(&mut script, 1000).0, 2, "it is tried again in its turn");
}

#[test]
fn a_new_unit_does_not_wait_long_on_a_busy_wire() {
    let mut script = Script::connected();
    poll(&mut script, 0, 1).unwrap();
    serve(&mut script, 0);
    let mut asked_at = None;
    for now in (0..20_000).step_by(100) {
        poll(&mut script, now, 1).unwrap();
        if now == 0 {
            poll(&mut script, now, 2).unwrap();
        }
        if serve(&mut script, now).0 == 2 {
            asked_at.get_or_insert(now);
        }
    }
    assert_eq!(asked_at, Some(3000));
}

#[test]
fn where_nobody_answers_there_is_nobody_to_protect() {
    let mut script = adaptive();
    for now in [0, 1000] {
        poll(&mut script, now, 1).unwrap();
        script.asks(now);
        assert_eq!(script.step(now + 1000), Step::Wait(None));
    }
    poll(&mut script, 2000, 1).unwrap();
    script.asks(2000);
    assert_eq!(script.step(3000), Step::Disconnect, "the connection may be at fault");
    script.connect(3200);
    poll(&mut script, 3200, 1).unwrap();
    assert_eq!(script.asks(3200).2, ms(1000));
}

#[test]
fn a_connection_that_stalls_is_not_dead_at_once() {
    let mut script = adaptive();
    let mut now = 0;
    poll(&mut script, now, 1).unwrap();
    serve(&mut script, now);
    let mut waited = Vec::new();
    loop {
        poll(&mut script, now, 1).unwrap();
        let patience = script.asks(now).2.as_millis();
        waited.push(patience);
        now += u64::try_from(patience).unwrap();
        if script.step(now) == Step::Disconnect {
            break;
        }
    }
    assert_eq!(waited, [200, 400, 800, 1000, 1000], "three whole time-outs at least");
}

fn together(spacing: u64) -> Job {
    let writes = [4, 5, 6].map(|value| Write::Register { address: 8193, value });
    let ask = Ask::Together { writes: writes.into(), done: 0 };
    Job { ask, priority: Priority::Command, spacing: ms(spacing), ..job(1) }
}

fn acknowledge(script: &mut Script, now: u64) -> u8 {
    script.sends(now);
    let echo = script.out.clone();
    script.hears(now, &echo);
    echo[11]
}

fn ended(script: &mut Script, ticket: &Ticket) -> (Result<(), LinkError>, usize) {
    match script.wire.take(ticket, Waker::noop()) {
        Poll::Ready(outcome) => (outcome.result, outcome.done),
        Poll::Pending => panic!("not done"),
    }
}

#[test]
fn nothing_comes_between_writes_that_belong_together() {
    for spacing in [0, 50] {
        let mut script = Script::connected();
        let ticket = script.submit_job(0, together(spacing)).unwrap();
        let other = script.submit_job(0, Job { priority: Priority::Command, ..job(2) }).unwrap();
        for (index, value) in [4, 5, 6].into_iter().enumerate() {
            let now = spacing * index as u64;
            assert_eq!(acknowledge(&mut script, now), value);
            assert!(script.outcome(&other).is_none());
            if spacing > 0 && value < 6 {
                assert_eq!(script.step(now), Step::Wait(Some(ms(now + spacing))), "not even in the pause");
                assert!(!script.wire.is_at_rest());
            }
        }
        assert_eq!(ended(&mut script, &ticket), (Ok(()), 3));
        assert_eq!(serve(&mut script, 2 * spacing).0, 2);
    }
}

#[test]
fn the_first_failure_ends_writes_that_belong_together() {
    // Refused, lost, and cut off by a drop in the pause between two.
    let mut script = Script::connected();
    let ticket = script.submit_job(0, together(0)).unwrap();
    acknowledge(&mut script, 0);
    script.sends(0);
    script.hears(0, &frame(2, &[0x86, 3]));
    let (result, done) = ended(&mut script, &ticket);
    assert!(matches!(result, Err(LinkError::Exception { .. })));
    assert_eq!((done, script.step(0)), (1, Step::Wait(None)), "the third never leaves");

    let ticket = script.submit_job(0, together(0)).unwrap();
    acknowledge(&mut script, 0);
    acknowledge(&mut script, 0);
    script.sends(0);
    assert_eq!(script.step(1000), Step::Wait(None));
    let (result, done) = ended(&mut script, &ticket);
    assert!(matches!(result, Err(LinkError::Lost { .. })) && done == 2);

    let ticket = script.submit_job(1000, together(50)).unwrap();
    acknowledge(&mut script, 1050);
    script.loses(1060, Cause::Reset);
    assert_eq!(ended(&mut script, &ticket), (Err(down(Cause::Reset)), 1));
    script.connect(1260);
    assert_eq!(script.step(1260), Step::Wait(None));

    // Nobody waits for them any more: what has not left does not leave.
    let ticket = script.submit_job(2000, together(50)).unwrap();
    acknowledge(&mut script, 2000);
    script.wire.cancel(ticket);
    assert_eq!(script.step(2050), Step::Wait(None));
    script.wire.news();
    assert!(script.wire.is_at_rest());

    let ticket = script.submit_job(3000, together(50)).unwrap();
    acknowledge(&mut script, 3000);
    script.wire.close(&mut script.wakes);
    assert_eq!(ended(&mut script, &ticket), (Err(LinkError::Closed), 1));
}
