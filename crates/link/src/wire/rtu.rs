//! Scripts of a serial line: its time, its silences, and answers that only the asking tells apart.

use super::script::*;
use super::*;
use crate::job::Ask;

/// Nanoseconds of one character and of 3.5 at 9600 baud, 8N1.
const CHARACTER: u64 = 1_041_667;
const SILENCE: u64 = 3_645_834;

fn ns(nanos: u64) -> Duration {
    Duration::from_nanos(nanos)
}

/// How long `read` and its answer are on the line.
fn on_line() -> Duration {
    ns((8 + 9) * CHARACTER)
}

#[test]
fn keeps_the_silence_before_each_request_and_no_more() {
    let mut script = Script::serial();
    let first = script.read(0);
    assert_eq!(script.step(0), Step::Send(Some(ms(TIMEOUT) + on_line())), "its characters take their time");
    assert_eq!(script.out, rtu_frame(1, &[0x03, 0x28, 0x06, 0, 2]));
    script.read(1);
    script.hears(40, &rtu_answer(1, 7));
    assert_eq!(script.outcome(&first), Some(Ok(vec![7, 0])));

    let due = ms(40) + ns(SILENCE);
    assert_eq!(script.step(40), Step::Wait(Some(due)));
    assert_eq!(script.wire.start_next(due - ns(1), &mut script.out, &mut script.wakes), None);
    // Whatever is heard meanwhile, the silence begins anew.
    script.hears(43, &[0xFF]);
    let due = ms(43) + ns(SILENCE);
    assert_eq!(script.step(43), Step::Wait(Some(due)));
    assert_eq!(script.step_at(due - ns(1)), Step::Wait(Some(due)));
    assert!(matches!(script.step_at(due), Step::Send(_)));

    // A line that was quiet is asked at once.
    script.hears(100, &rtu_answer(1, 8));
    script.read(200);
    assert!(matches!(script.step(200), Step::Send(_)));
}

#[test]
fn gaps_inside_an_answer_mean_nothing() {
    let mut script = Script::serial();
    let ticket = script.read(0);
    script.asks(0);
    let answer = rtu_answer(1, 7);
    for (index, byte) in answer.iter().enumerate() {
        let now = 100 + 100 * index as u64;
        assert_eq!(script.step(now), Step::Wait(Some(ms(TIMEOUT) + on_line())), "at {now}");
        script.hears(now, &[*byte]);
    }
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 0])));
}

#[test]
fn finds_the_answer_behind_noise_when_the_line_has_fallen_silent() {
    let mut script = Script::serial();
    let ticket = script.read(0);
    script.asks(0);
    // It could be the beginning of a long answer.
    script.hears(30, &[0x05, 0x03, 0xF0]);
    script.hears(31, &rtu_answer(1, 7)[..4]);
    script.hears(47, &rtu_answer(1, 7)[4..]);
    let silent = ms(47 + 50) + ns(SILENCE);
    assert_eq!(script.step(47), Step::Wait(Some(silent)));
    assert_eq!(script.outcome(&ticket), None);
    assert_eq!(script.step_at(silent), Step::Wait(None));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 0])));

    // Nothing but noise: it is looked at once, and then the deadline is waited for.
    script.read(1000);
    let deadline = ms(1000) + script.asks(1000).2;
    script.hears(1001, &[0x05, 0x03, 0xF0]);
    assert_eq!(script.step_at(ms(1051) + ns(SILENCE)), Step::Wait(Some(deadline)));
    assert_eq!(script.step(1100), Step::Wait(Some(deadline)));
    assert_eq!(script.statistics().units[0].garbage_bytes, 3, "what is under way is counted at its end");
}

#[test]
fn drains_the_line_after_a_time_out() {
    let mut script = Script::serial();
    let ticket = script.read(0);
    script.asks(0);
    let deadline = ms(TIMEOUT) + on_line();
    assert_eq!(script.step_at(deadline), Step::Wait(Some(deadline + ms(50))));
    // The answer comes after all: it is counted, and the line has to be quiet anew.
    script.hears(1060, &rtu_answer(1, 6));
    assert_eq!(script.step(1060), Step::Wait(Some(ms(1110))));
    assert_eq!(script.outcome(&ticket), None);
    assert_eq!(script.step(1109), Step::Wait(Some(ms(1110))));
    assert_eq!(script.asks(1110).1, 10246);
    script.hears(1140, &rtu_answer(1, 7));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 0])));
    let seen = script.statistics();
    assert_eq!((seen.late, seen.units[0].late, seen.timeouts), (1, 1, 1));
}

/// A line on which unit 1 was asked for address 100 in vain, with nothing heard, and other questions wait. Gives back
/// the time at which the line is drained.
fn in_doubt(questions: &[(u8, Ask)]) -> (Script, u64) {
    let mut script = Script::serial_with(Options { retries: 0, ..Options::default() });
    script.submit(0, Priority::Person, read(100)).unwrap();
    script.asks(0);
    assert_eq!(script.step(1018), Step::Wait(None));
    for (unit, ask) in questions {
        let job = Job { ask: ask.clone(), ..job(*unit) };
        script.submit_job(1018, job).unwrap();
    }
    (script, 1100)
}

#[test]
fn asks_nothing_that_looks_the_same_while_a_late_answer_may_come() {
    // Its time-out is over, and for twice as long its answer may come.
    let until = ms(3 * TIMEOUT) + on_line();
    let (mut script, now) = in_doubt(&[(1, read(200))]);
    assert_eq!(script.step(now), Step::Wait(Some(until)));
    assert_eq!(script.asks(3018).1, 200);

    let longer = Ask::Holding { address: 300, count: 3 };
    let (mut script, mut now) = in_doubt(&[(1, read(200)), (2, read(400)), (1, longer), (1, read(100))]);
    for (asked, bytes) in
        [((2, 400), rtu_answer(2, 4)), ((1, 300), rtu_frame(1, &[0x03, 6, 0, 1, 0, 2, 0, 3]))]
    {
        let (unit, address, _) = script.asks(now);
        assert_eq!((unit, address), asked, "others are not held up");
        script.hears(now + 30, &bytes);
        now += 50;
    }
    // Once another question waits the one in doubt is not asked again either, or the doubt would never end.
    assert_eq!(script.step(now), Step::Wait(Some(until)));
    // The late answer is seen: the others go on when the line was quiet.
    script.hears(now, &rtu_answer(1, 9));
    assert_eq!(script.step(now), Step::Wait(Some(ms(now + 50))));
    assert_eq!(script.asks(now + 50).1, 200);
}

#[test]
fn the_same_read_may_be_asked_again_and_either_answer_is_right() {
    let mut script = Script::serial();
    let ticket = script.read(0);
    script.asks(0);
    script.step(1018);
    script.asks(1068);
    // One answer, whichever it is of; the other may come until twice the time-out after its own.
    script.hears(1100, &rtu_answer(1, 7));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 0])));
    let other = script.submit(1101, Priority::Person, read(200)).unwrap();
    assert_eq!(script.step(1110), Step::Wait(Some(ms(1068 + 3 * TIMEOUT) + on_line())));
    script.hears(1300, &rtu_answer(1, 7));
    assert_eq!(script.asks(1350).1, 200);
    script.hears(1400, &rtu_answer(1, 8));
    assert_eq!(script.outcome(&other), Some(Ok(vec![8, 0])));
}

#[test]
fn a_garbled_answer_is_spent() {
    let mut garbled = rtu_answer(1, 7);
    garbled[4] ^= 0x10;
    for (bytes, held) in [(&garbled[..], false), (&[0x55, 0xAA], true)] {
        let mut script = Script::serial_with(Options { retries: 0, ..Options::default() });
        script.read(0);
        script.asks(0);
        script.hears(30, bytes);
        script.step(1018);
        script.submit(1018, Priority::Person, read(200)).unwrap();
        let until = ms(3 * TIMEOUT) + on_line();
        let next = script.step(1100);
        assert_eq!(next == Step::Wait(Some(until)), held, "{bytes:?}: {next:?}");
        let seen = script.statistics();
        assert_eq!(seen.units[0].crc_errors, u64::from(!held));
        assert_eq!(seen.units[0].garbage_bytes, bytes.len() as u64);
    }
}

#[test]
fn an_exception_is_not_taken_while_another_may_be_meant() {
    let longer = Ask::Holding { address: 300, count: 3 };
    let (mut script, now) = in_doubt(&[]);
    script.wire.rules.retries = 1;
    let ticket = script.submit_job(now, Job { ask: longer, ..job(1) }).unwrap();
    assert_eq!(script.asks(now).1, 300);
    script.hears(now + 20, &rtu_frame(1, &[0x83, 2]));
    assert_eq!(script.outcome(&ticket), None, "perhaps address 100 was refused");
    assert_eq!(script.asks(now + 50).1, 300);
    script.hears(now + 90, &rtu_frame(1, &[0x03, 6, 0, 1, 0, 2, 0, 3]));
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![1, 2, 3])));
}

#[test]
fn a_lost_write_holds_up_the_next_and_not_the_reads_that_tell_what_it_did() {
    let mut script = Script::serial();
    let lost = script.write(0, 4);
    script.asks(0);
    script.step(1017);
    assert!(matches!(script.outcome(&lost), Some(Err(LinkError::Lost { .. }))));
    let next = script.write(1017, 4);
    script.read(1017);
    assert_eq!(script.asks(1100).1, 10246, "the read");
    script.hears(1130, &rtu_answer(1, 7));
    assert_eq!(script.step(1140), Step::Wait(Some(ms(3 * TIMEOUT) + ns(16 * CHARACTER))));
    // Its late echo is its own, not that of the next.
    script.hears(1500, &rtu_frame(1, &[0x06, 0x20, 0x01, 0, 4]));
    assert_eq!(script.outcome(&next), None);
    assert_eq!(script.asks(1550).1, 8193);
}

#[test]
fn a_serial_line_is_not_hung_up_for_silence() {
    let mut script = Script::serial();
    let mut now = 0;
    for _ in 0..6 {
        script.write(now, 4);
        script.asks(now);
        assert_eq!(script.step(now + 1017), Step::Wait(None));
        now += 4000;
    }
    // What is polled of the silent unit waits for its slots all the same.
    script.submit(now, Priority::Poll, read(1)).unwrap();
    assert!(script.submit(now, Priority::Poll, read(1)).is_err());
}

#[test]
fn behind_a_converter_the_line_has_no_speed() {
    let mut script = Script::on(Line::tunnelled(), Options::default());
    script.connect(0);
    let ticket = script.read(0);
    assert_eq!(script.step(0), Step::Send(Some(ms(TIMEOUT))));
    // There a gap may be the network's.
    script.hears(30, &[0x05, 0x03, 0xF0]);
    script.hears(31, &rtu_answer(1, 7));
    assert_eq!(script.step(31), Step::Wait(Some(ms(TIMEOUT))));
    script.read(40);
    assert_eq!(
        script.step(1000),
        Step::Send(Some(ms(2000))),
        "found at the end, and nothing is to be drained"
    );
    assert_eq!(script.outcome(&ticket), Some(Ok(vec![7, 0])));
    assert!(script.statistics().busy.is_zero());
}

#[test]
fn counts_the_time_of_the_line() {
    let mut script = Script::serial();
    script.read(0);
    script.asks(0);
    script.hears(40, &rtu_answer(1, 7));
    script.hears(90, &rtu_answer(1, 7));
    let seen = script.wire.statistics(ms(100));
    assert_eq!((seen.open_for, seen.bytes_sent, seen.bytes_received), (ms(100), 8, 18));
    assert_eq!(seen.busy, ns(26 * CHARACTER));
    assert_eq!((seen.units[0].busy, seen.units[0].waiting), (on_line(), ms(40) - on_line()));
    assert_eq!((seen.waiting, seen.units[0].late), (ms(40) - on_line(), 1));
}
