//! Scripts of one wire: what happens at which millisecond, and what must follow.

use busbar_modbus::ExceptionCode;

use super::script::*;
use super::*;
use crate::job::Ask;

#[test]
fn asks_and_is_answered() {
    let mut script = Script::connected();
    let ticket = script.read(5);
    assert_eq!(script.sends(5), frame(1, &[0x03, 0x28, 0x06, 0, 2]));
    assert_eq!(script.step(6), Step::Wait(Some(ms(1005))));
    assert_eq!(script.outcome(&ticket), None);

    script.hears(12, &answer(1)[..5]);
    assert_eq!(script.outcome(&ticket), None);
    script.hears(13, &answer(1)[5..]);
    assert_eq!(script.wakes.len(), 1);
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![2302, 0])));
    assert_eq!(script.step(13), Step::Wait(None));

    let seen = script.statistics();
    assert_eq!((seen.requests, seen.answers, seen.reconnects), (1, 1, 0));
    assert_eq!((seen.bytes_sent, seen.bytes_received), (12, 13));
    assert_eq!(seen.latency.mean(), Some(ms(8)));
}

#[test]
fn sends_commands_first_then_people_then_polls() {
    let mut script = Script::connected();
    let first = script.submit(0, Priority::Poll, read(1)).unwrap();
    script.sends(0);
    for (priority, address) in
        [(Priority::Poll, 2), (Priority::Person, 3), (Priority::Poll, 4), (Priority::Person, 5)]
    {
        script.submit(1, priority, read(address)).unwrap();
    }
    script.write(1, 6);

    let mut order = Vec::new();
    for transaction in 1..=5 {
        // What is under way is finished first, whoever waits.
        assert_eq!(script.step(0), Step::Wait(Some(ms(TIMEOUT))));
        let bytes = match transaction {
            2 => frame(transaction, &[0x06, 0x20, 0x01, 0, 6]),
            _ => answer(transaction),
        };
        script.hears(0, &bytes);
        script.sends(0);
        order.push((script.out[7], script.out[9], script.out[11]));
    }
    assert_eq!(order, [(6, 1, 6), (3, 3, 2), (3, 5, 2), (3, 2, 2), (3, 4, 2)]);
    assert_eq!(script.outcome(&first), Some(Ok(vec![2302, 0])));
}

#[test]
fn bounds_what_waits_and_keeps_room_for_commands() {
    let mut script = Script::with(Options { queue: 2, ..Options::default() });
    for _ in 0..2 {
        script.submit(0, Priority::Poll, read(1)).unwrap();
    }
    assert_eq!(script.submit(0, Priority::Poll, read(1)), Err(LinkError::QueueFull { waiting: 2 }));
    script.write(0, 4);
    script.connect(1);
    script.sends(1);
    assert_eq!(script.out[7], 0x06);
}

#[test]
fn retries_a_read_once_and_never_takes_the_late_answer() {
    let mut script = Script::connected();
    let ticket = script.read(0);
    script.sends(0);
    assert_eq!(script.step(999), Step::Wait(Some(ms(1000))));
    assert_eq!(script.sends(1000), frame(2, &[0x03, 0x28, 0x06, 0, 2]));

    script.hears(1100, &answer(1));
    assert_eq!(script.outcome(&ticket), None);
    script.hears(1200, &frame(2, &[0x03, 4, 0, 7, 0, 8]));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 8])));

    let seen = script.statistics();
    assert_eq!((seen.requests, seen.retries, seen.timeouts, seen.late), (2, 1, 1, 1));
}

#[test]
fn gives_a_silent_read_up_after_its_retry() {
    let mut script = Script::connected();
    let ticket = script.read(0);
    script.sends(0);
    script.sends(1000);
    assert_eq!(script.step(2000), Step::Wait(None));
    assert_eq!(
        script.outcome(&ticket),
        Some(Err(LinkError::Timeout { unit: 1, after: ms(TIMEOUT), tries: 2, heard: NOTHING }))
    );
}

#[test]
fn tries_a_silent_unit_once_while_others_answer() {
    let mut script = Script::connected();
    let tries_of = |script: &mut Script, at| {
        let ticket = script.submit_to(at, 2, Priority::Person, read(1)).unwrap();
        script.sends(at);
        if script.step(at + TIMEOUT) != Step::Wait(None) {
            assert_eq!(script.step(at + 2 * TIMEOUT), Step::Wait(None));
        }
        script.outcome(&ticket)
    };
    let timeout =
        |tries| Some(Err(LinkError::Timeout { unit: 2, after: ms(TIMEOUT), tries, heard: NOTHING }));
    script.read(0);
    script.sends(0);
    script.hears(0, &answer(1));
    assert_eq!(tries_of(&mut script, 0), timeout(2));
    assert_eq!(tries_of(&mut script, 2000), timeout(1));
    assert_eq!(tries_of(&mut script, 3000), timeout(1));
}

#[test]
fn lets_a_read_go_before_a_retry() {
    let mut script = Script::connected();
    let silent = script.submit_to(0, 2, Priority::Person, read(1)).unwrap();
    script.sends(0);
    let good = script.read(1);
    assert_eq!(script.sends(1000)[6], 1);
    script.hears(1001, &answer(2));
    assert_eq!(script.outcome(&good), Some(Ok(vec![2302, 0])));
    assert_eq!(script.sends(1001)[6], 2);
    assert_eq!(script.outcome(&silent), None);
}

#[test]
fn lets_a_command_go_before_a_retry() {
    let mut script = Script::connected();
    script.read(0);
    script.sends(0);
    script.write(500, 4);
    assert_eq!(script.sends(1000)[7], 0x06);
    script.hears(1001, &echo(2));
    assert_eq!(script.sends(1001)[7], 0x03);
}

#[test]
fn never_sends_a_write_twice() {
    let mut script = Script::connected();
    let ticket = script.write(0, 4);
    script.sends(0);
    assert_eq!(script.step(1000), Step::Wait(None));
    assert_eq!(
        script.outcome(&ticket),
        Some(Err(LinkError::Lost { unit: 1, loss: Loss::TimedOut { after: ms(TIMEOUT), heard: NOTHING } }))
    );

    // Its late echo does not confirm the next write, which carries the same bytes.
    let next = script.write(1001, 4);
    script.sends(1001);
    script.hears(1002, &echo(1));
    assert_eq!(script.outcome(&next), None);
    script.hears(1003, &echo(2));
    assert_eq!(script.outcome(&next), Some(Ok(vec![])));
    assert_eq!(script.statistics().requests, 2);
}

#[test]
fn takes_nothing_that_does_not_answer() {
    let mut script = Script::connected();
    let ticket = script.read(0);
    script.sends(0);

    let mut other_unit = answer(1);
    other_unit[6] = 2;
    script.hears(1, &other_unit);
    script.hears(2, &frame(1, &[0x04, 4, 0, 1, 0, 2]));
    script.hears(3, &frame(1, &[0x03, 6, 0, 1, 0, 2, 0, 3]));
    script.hears(4, &answer(9));
    let mut other_protocol = answer(1);
    other_protocol[3] = 1;
    script.hears(5, &other_protocol);
    assert_eq!(script.outcome(&ticket), None);

    script.hears(6, &answer(1));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![2302, 0])));
    let seen = script.statistics();
    assert_eq!((seen.wrong_unit, seen.wrong_function, seen.wrong_length), (1, 1, 1));
    assert_eq!((seen.late, seen.wrong_protocol, seen.answers), (1, 1, 1));
}

#[test]
fn hands_exceptions_on_and_counts_them() {
    let mut script = Script::connected();
    let ticket = script.read(0);
    script.sends(0);
    script.hears(1, &frame(1, &[0x83, 10]));
    let exception = LinkError::Exception { unit: 1, function: 3, code: ExceptionCode(10) };
    assert_eq!(script.outcome(&ticket), Some(Err(exception)));
    assert_eq!(script.step(1), Step::Wait(None), "an exception is an answer, not retried");
    assert_eq!(script.statistics().exceptions[&10], 1);
}

#[test]
fn sends_a_dropped_read_again_on_a_new_connection() {
    let mut script = Script::connected();
    let ticket = script.read(0);
    script.sends(0);
    script.hears(5, &answer(1)[..9]);
    script.loses(6, Cause::Reset);
    // The connection was a short one: not at once.
    assert_eq!(script.step(6), Step::Wait(Some(ms(206))));
    script.connect(206);
    assert_eq!(script.sends(207), frame(2, &[0x03, 0x28, 0x06, 0, 2]));
    script.hears(208, &answer(2));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![2302, 0])));
    assert_eq!(script.statistics().reconnects, 1);
}

#[test]
fn does_not_send_a_dropped_write_again() {
    let mut script = Script::connected();
    let ticket = script.write(0, 4);
    script.sends(0);
    script.loses(5, Cause::Closed);
    assert_eq!(script.outcome(&ticket), Some(Err(lost(Cause::Closed))));
    script.connect(205);
    assert_eq!(script.step(206), Step::Wait(None));
}

#[test]
fn fails_everything_that_waits_when_it_goes_down() {
    let mut script = Script::connected();
    let read = script.read(0);
    script.sends(0);
    let write = script.write(1, 4);
    script.loses(5, Cause::Closed);
    assert_eq!(script.outcome(&write), None, "one attempt to reconnect first");
    assert_eq!(script.step(205), Step::Connect);
    script.refuses(206, Cause::Refused);
    assert_eq!(script.outcome(&read), Some(Err(down(Cause::Refused))));
    assert_eq!(script.outcome(&write), Some(Err(down(Cause::Refused))));
    assert_eq!(script.statistics().requests, 1, "the write was not sent");

    let refused = script.submit(207, Priority::Command, super::script::write(4));
    assert_eq!(refused, Err(down(Cause::Refused)));
}

#[test]
fn backs_off_until_a_connection_proves_good() {
    let mut script = Script::new();
    let mut now = 0;
    let mut waits = Vec::new();
    for _ in 0..8 {
        assert_eq!(script.step(now), Step::Connect);
        assert_eq!(script.step(now), Step::Wait(None), "one attempt at a time");
        script.refuses(now, Cause::Refused);
        let Step::Wait(Some(until)) = script.step(now) else {
            panic!("no wait");
        };
        let until = u64::try_from(until.as_millis()).unwrap();
        waits.push(until - now);
        now = until;
    }
    assert_eq!(waits, [200, 400, 800, 1600, 3200, 6400, 10_000, 10_000]);

    // A peer that takes connections and drops them earns no trust.
    script.connect(now);
    script.loses(now, Cause::Closed);
    assert_eq!(script.step(now), Step::Wait(Some(ms(now + 10_000))));
    now += 10_000;

    // An answer alone does not either.
    script.connect(now);
    script.read(now);
    script.sends(now);
    script.hears(now, &answer(1));
    script.loses(now + 4_999, Cause::Closed);
    assert_eq!(script.step(now + 4_999), Step::Wait(Some(ms(now + 14_999))));
    now += 14_999;

    // One that lasts does.
    script.connect(now);
    now += 5_000;
    script.loses(now, Cause::Closed);
    assert_eq!(script.step(now), Step::Connect);
    script.refuses(now, Cause::Refused);
    assert_eq!(script.step(now), Step::Wait(Some(ms(now + 400))));
    now += 400;

    // And one that carries much, however fast.
    script.connect(now);
    for transaction in 2..102 {
        script.read(now);
        script.sends(now);
        script.hears(now, &answer(transaction));
    }
    script.loses(now, Cause::Closed);
    assert_eq!(script.step(now), Step::Connect);
}

#[test]
fn a_connection_that_never_answers_is_not_good_because_it_is_old() {
    let mut script = Script::connected();
    for now in [0, 3000, 6000] {
        script.write(now, 4);
        script.sends(now);
        let expected = if now == 6000 { Step::Disconnect } else { Step::Wait(None) };
        assert_eq!(script.step(now + TIMEOUT), expected);
    }
    assert_eq!(script.step(7000), Step::Wait(Some(ms(7200))));
    script.connect(7200);
    // It was idle, which is no fault.
    script.loses(12_200, Cause::Closed);
    assert_eq!(script.step(12_200), Step::Connect);
}

#[test]
fn our_own_pause_costs_no_request_its_time() {
    let mut script = Script::connected();
    let job = Job { timeout: ms(50), ..job(1) };
    let ticket = script.submit_job(0, job).unwrap();
    script.step(0);
    script.loses(10, Cause::Reset);
    assert_eq!(script.step(199), Step::Wait(Some(ms(210))));
    assert_eq!(script.step(210), Step::Connect);
    assert_eq!(script.step(210), Step::Wait(Some(ms(260))));
    assert_eq!(script.outcome(&ticket), None);
    script.step(260);
    assert_eq!(script.outcome(&ticket), Some(Err(down(Cause::StillConnecting { after: ms(50) }))));
}

#[test]
fn lets_a_request_wait_for_a_connection_only_as_long_as_for_an_answer() {
    let mut script = Script::new();
    let early = script.read(0);
    assert_eq!(script.step(0), Step::Connect);
    assert_eq!(script.step(1), Step::Wait(Some(ms(1000))));
    let late = script.write(400, 4);
    assert_eq!(script.step(1000), Step::Wait(Some(ms(1400))));
    let expired = down(Cause::StillConnecting { after: ms(TIMEOUT) });
    assert_eq!(script.outcome(&early), Some(Err(expired)));
    assert_eq!(script.outcome(&late), None);

    script.wire.connected(ms(1399));
    assert_eq!(script.sends(1399)[7], 0x06);
}

#[test]
fn gives_a_silent_connection_up() {
    let mut script = Script::connected();
    for (at, transaction) in [(0, 1), (1000, 2)] {
        script.write(at, transaction);
        script.sends(at);
    }
    // An answer of any kind starts the count anew.
    assert_eq!(script.step(2000), Step::Wait(None));
    script.read(2000);
    script.sends(2000);
    script.hears(2001, &answer(3));

    let mut now = 2001;
    for value in 0..2 {
        script.write(now, value);
        script.sends(now);
        now += TIMEOUT;
        assert_eq!(script.step(now), Step::Wait(None));
    }
    let read = script.read(now);
    script.sends(now);
    now += TIMEOUT;
    assert_eq!(script.step(now), Step::Disconnect);
    script.connect(now);
    script.sends(now);
    script.hears(now, &answer(7));
    assert_eq!(script.outcome(&read), Some(Ok(vec![2302, 0])));
}

#[test]
fn says_why_when_even_a_new_connection_is_silent() {
    let mut script = Script::with(Options { timeouts_to_drop: 1, ..Options::default() });
    script.connect(0);
    let ticket = script.read(0);
    script.sends(0);
    assert_eq!(script.step(1000), Step::Disconnect);
    script.connect(1200);
    script.sends(1200);
    assert_eq!(script.step(2200), Step::Disconnect);
    assert_eq!(script.step(2200), Step::Wait(Some(ms(2600))));
    assert!(matches!(script.outcome(&ticket), Some(Err(LinkError::Timeout { tries: 2, .. }))));
    let refused = script.submit(2201, Priority::Person, read(1));
    assert_eq!(refused, Err(down(Cause::Silent { requests: 1 })));
}

#[test]
fn hangs_up_on_bytes_that_are_no_modbus() {
    let mut script = Script::connected();
    let read = script.read(0);
    script.sends(0);
    // The answer in front of the garbage counts.
    script.hears(1, &[answer(1), b"HTTP/1.1 400 Bad Request".to_vec()].concat());
    assert_eq!(script.outcome(&read), Some(Ok(vec![2302, 0])));
    assert_eq!(script.step(1), Step::Disconnect);
    script.connect(201);

    let write = script.write(202, 4);
    script.sends(202);
    script.hears(203, &[0xFF; 40]);
    assert_eq!(script.outcome(&write), Some(Err(lost(Cause::Garbage))));
    assert_eq!(script.step(203), Step::Disconnect);
    assert!(script.statistics().garbage_bytes >= 40);
}

#[test]
fn forgets_what_nobody_waits_for() {
    let mut script = Script::connected();
    let flying = script.read(0);
    script.sends(0);
    let waiting = script.write(1, 4);
    script.wire.cancel(waiting);
    script.wire.cancel(flying);
    // The exchange on the wire ends first, by an answer or its time-out, and is not tried again.
    assert_eq!(script.step(999), Step::Wait(Some(ms(1000))));
    assert_eq!(script.step(1000), Step::Wait(None));

    let next = script.read(1001);
    script.sends(1001);
    script.hears(1002, &answer(1));
    script.hears(1003, &answer(2));
    assert_eq!(script.outcome(&next), Some(Ok(vec![2302, 0])));
    assert_eq!(script.statistics().requests, 2);
}

#[test]
fn keeps_requests_apart() {
    let mut script = Script::with(Options { spacing: ms(50), ..Options::default() });
    script.connect(0);
    script.read(0);
    script.sends(0);
    script.hears(10, &answer(1));
    assert_eq!(script.step(10), Step::Wait(None), "nothing waits");
    script.read(20);
    assert_eq!(script.step(20), Step::Wait(Some(ms(60))));
    script.sends(60);
}

#[test]
fn never_sends_behind_half_a_frame() {
    for (sent, write_fails_with) in [(0, down(Cause::Stuck)), (5, lost(Cause::Stuck))] {
        let mut script = Script::connected();
        let write = script.write(0, 4);
        script.sends(0);
        script.wire.sent_only(sent);
        let read = script.read(1);
        assert_eq!(script.step(1000), Step::Disconnect);
        assert_eq!(script.outcome(&write), Some(Err(write_fails_with)));
        script.connect(1200);
        script.sends(1200);
        script.hears(1201, &answer(2));
        assert_eq!(script.outcome(&read), Some(Ok(vec![2302, 0])));
    }

    let mut script = Script::connected();
    script.write(0, 4);
    script.sends(0);
    script.wire.sent_only(5);
    script.wire.sent_rest();
    assert_eq!(script.step(1000), Step::Wait(None), "slow, but whole");
}

#[test]
fn refuses_what_has_no_frame() {
    let mut script = Script::connected();
    let none = Ask::Holding { address: 0, count: 0 };
    let many = Ask::Input { address: 0, count: 126 };
    let none = script.submit(0, Priority::Person, none).unwrap();
    let many = script.submit(0, Priority::Person, many).unwrap();
    let good = script.read(0);
    script.sends(0);
    assert!(matches!(script.outcome(&none), Some(Err(LinkError::NotSent(_)))));
    assert!(matches!(script.outcome(&many), Some(Err(LinkError::NotSent(_)))));
    script.hears(1, &answer(1));
    assert_eq!(script.outcome(&good), Some(Ok(vec![2302, 0])));
    assert_eq!(script.statistics().requests, 1);
}

#[test]
fn takes_for_ever_as_a_day() {
    let day = Duration::from_secs(86_400);
    let mut script = Script::with(Options {
        spacing: Duration::MAX,
        backoff: Backoff { first: Duration::MAX, max: Duration::MAX },
        ..Options::default()
    });
    let endless = Job { priority: Priority::Poll, timeout: Duration::MAX, spacing: Duration::MAX, ..job(1) };
    script.wire.submit(ms(0), endless, Waker::noop()).unwrap();
    assert_eq!(script.step(0), Step::Connect);
    assert_eq!(script.step(0), Step::Wait(Some(day)));
    script.wire.connected(ms(0));
    assert_eq!(script.step(0), Step::Send(Some(day)));
    script.hears(0, &answer(1));
    script.read(0);
    assert_eq!(script.step(0), Step::Wait(Some(day)));
    script.loses(0, Cause::Closed);
    assert_eq!(script.step(0), Step::Wait(Some(day)));
    assert_eq!(script.step(86_400_000), Step::Connect);
    script.refuses(86_400_000, Cause::Refused);
    assert_eq!(script.step(86_400_000), Step::Wait(Some(2 * day)));
}

#[test]
fn ends_everything_when_closed() {
    let mut script = Script::connected();
    let flying = script.read(0);
    script.sends(0);
    let waiting = script.write(1, 4);
    script.wire.close(&mut script.wakes);
    assert_eq!(script.wakes.len(), 2);
    assert_eq!(script.outcome(&flying), Some(Err(LinkError::Closed)));
    assert_eq!(script.outcome(&waiting), Some(Err(LinkError::Closed)));
    assert_eq!(script.step(2), Step::End);
    assert_eq!(script.submit(3, Priority::Person, read(1)), Err(LinkError::Closed));

    let mut script = Script::connected();
    let flying = script.write(0, 4);
    script.sends(0);
    script.wire.close(&mut script.wakes);
    let lost = LinkError::Lost { unit: 1, loss: Loss::Closed };
    assert_eq!(script.outcome(&flying), Some(Err(lost)), "it has left");
}

#[test]
fn takes_a_short_answer_only_for_who_allows_it() {
    let mut script = Script::connected();
    let job = |short| Job { short, ..job(1) };
    for (transaction, short, registers) in
        [(1, true, Some(vec![7])), (2, false, None), (3, true, Some(vec![7]))]
    {
        let ticket = script.submit_job(0, job(short)).unwrap();
        script.sends(0);
        script.hears(0, &frame(transaction, &[0x03, 2, 0, 7]));
        assert_eq!(script.outcome(&ticket), registers.map(Ok));
        script.hears(0, &answer(transaction));
    }
    assert_eq!(script.statistics().wrong_length, 1);
}

#[test]
fn reports_each_change_of_the_connection_once() {
    let mut script = Script::new();
    assert_eq!(script.wire.news(), None);
    script.connect(0);
    assert_eq!(script.wire.news(), Some(&Phase::Connected));
    assert_eq!(script.wire.news(), None);
    script.loses(1, Cause::Closed);
    assert!(matches!(script.wire.news(), Some(Phase::Connecting { .. })));
    script.step(201);
    script.refuses(202, Cause::Refused);
    assert!(matches!(script.wire.news(), Some(Phase::Down { .. })));
}
