//! The client's transactions as message sequences: what is asked, what comes when, and what it is taken for.

mod support;

use std::time::Duration;

use busbar_modbus::{
    Bits, Client, Counters, EncodeError, ExceptionCode, Fault, Framing, Progress, Request, Response,
    StartError,
};
use support::{hex, ms};

use Progress::{Answered, Pending, TimedOut};

const READ: Request<'_> = Request::ReadHoldingRegisters { address: 0x20, count: 2 };
const WRITE: Request<'_> = Request::WriteSingleRegister { address: 0x40, value: 0x10 };

/// One line of a script. Times are milliseconds.
enum Step<'a> {
    /// At this time unit 1 is asked, with a second's patience; these bytes must leave.
    Ask(u64, Request<'a>, &'a str),
    /// At this time these bytes come.
    Come(u64, &'a str, Progress),
    /// At this time the line has been silent.
    Silence(u64, Progress),
    /// At this time nothing has come.
    Wait(u64, Progress),
    /// This is the answer.
    Response(Response<'a>),
    /// There is none.
    NoResponse,
}

use Step::{Ask, Come, NoResponse, Silence, Wait};

fn run(framing: Framing, steps: &[Step<'_>]) -> Client {
    let mut client = Client::new(framing);
    play(&mut client, steps);
    client
}

fn play(client: &mut Client, steps: &[Step<'_>]) {
    let mut out = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        let number = number + 1;
        match step {
            Ask(at, request, bytes) => {
                let started = client.start(ms(*at), 1, request, ms(1000), &mut out);
                assert_eq!(started, Ok(()), "step {number}");
                assert_eq!(out, hex(bytes), "step {number}");
                assert_eq!(client.deadline(), Some(ms(at + 1000)), "step {number}");
                assert_eq!(client.response(), None, "step {number}");
            }
            Come(at, bytes, progress) => {
                assert_eq!(client.receive(ms(*at), &hex(bytes)), *progress, "step {number}");
            }
            Silence(at, progress) => assert_eq!(client.silence(ms(*at)), *progress, "step {number}"),
            Wait(at, progress) => assert_eq!(client.expire(ms(*at)), *progress, "step {number}"),
            Step::Response(response) => assert_eq!(client.response(), Some(*response), "step {number}"),
            NoResponse => assert_eq!(client.response(), None, "step {number}"),
        }
    }
}

/// Counters that are all 0 but for those set.
fn counted(set: impl FnOnce(&mut Counters)) -> Counters {
    let mut counters = Counters::default();
    set(&mut counters);
    counters
}

fn registers(words: &[u16]) -> Step<'_> {
    Step::Response(Response::ReadHoldingRegisters(words.into()))
}

#[test]
fn tcp_an_answer_in_time() {
    let client = run(
        Framing::Tcp,
        &[
            Ask(0, READ, "0001 0000 0006 01 03 0020 0002"),
            Come(7, "0001 0000 0007 01 03 04 08FE 0000", Answered),
            registers(&[0x08FE, 0]),
            Wait(2000, Pending),
            registers(&[0x08FE, 0]),
            Ask(2000, WRITE, "0002 0000 0006 01 06 0040 0010"),
            Come(2009, "0002 0000 0006 01 06 0040 0010", Answered),
            Step::Response(Response::WriteSingleRegister { address: 0x40, value: 0x10 }),
        ],
    );
    assert_eq!(*client.counters(), Counters::default());
    assert_eq!((client.deadline(), client.quiet_until()), (None, None));
}

#[test]
fn tcp_an_exception_is_an_answer() {
    let refused = Response::Exception { function: 3, code: ExceptionCode(10) };
    run(
        Framing::Tcp,
        &[
            Ask(0, READ, "0001 0000 0006 01 03 0020 0002"),
            Come(7, "0001 0000 0003 01 83 0A", Answered),
            Step::Response(refused),
        ],
    );
}

#[test]
fn tcp_a_late_answer_is_never_taken_for_the_next() {
    let client = run(
        Framing::Tcp,
        &[
            Ask(0, READ, "0001 0000 0006 01 03 0020 0002"),
            Wait(999, Pending),
            Wait(1000, TimedOut),
            Wait(1001, Pending),
            NoResponse,
            // The same question again: only the transaction tells the answers apart.
            Ask(1001, READ, "0002 0000 0006 01 03 0020 0002"),
            Come(1002, "0001 0000 0007 01 03 04 FFFF FFFF", Pending),
            Come(1003, "0002 0000 0007 01 03 04 0001 0002", Answered),
            registers(&[1, 2]),
        ],
    );
    assert_eq!(*client.counters(), counted(|c| c.late = 1));
}

#[test]
fn tcp_half_a_late_answer_does_not_break_the_next() {
    let client = run(
        Framing::Tcp,
        &[
            Ask(0, READ, "0001 0000 0006 01 03 0020 0002"),
            Come(999, "0001 0000 0007 01 03", Pending),
            Wait(1000, TimedOut),
            Ask(1001, READ, "0002 0000 0006 01 03 0020 0002"),
            Come(1002, "04 FFFF FFFF 0002 0000 0007 01 03 04 0001", Pending),
            Come(1003, "0002", Answered),
            registers(&[1, 2]),
        ],
    );
    assert_eq!(*client.counters(), counted(|c| c.late = 1));
}

#[test]
fn tcp_what_comes_while_nobody_asked_is_late() {
    let client = run(
        Framing::Tcp,
        &[
            Come(0, "0001 0000 0003 01 83 02", Pending),
            Ask(1, READ, "0001 0000 0006 01 03 0020 0002"),
            Come(2, "0001 0000 0003 01 83 02 0001 0000 0003 01 83 03", Answered),
            Step::Response(Response::Exception { function: 3, code: ExceptionCode(2) }),
            Come(3, "0001 0000 0003 01 83 04", Pending),
            Step::Response(Response::Exception { function: 3, code: ExceptionCode(2) }),
        ],
    );
    assert_eq!(*client.counters(), counted(|c| c.late = 3));
}

#[test]
fn tcp_wrong_answers_are_dropped_and_the_right_one_awaited() {
    let cases: [(&str, Request<'_>, &str, Counters); 12] = [
        ("unit", READ, "0001 0000 0007 02 03 04 FFFF FFFF", counted(|c| c.wrong_unit = 1)),
        ("function", READ, "0001 0000 0007 01 04 04 FFFF FFFF", counted(|c| c.wrong_function = 1)),
        ("exception to a function", READ, "0001 0000 0003 01 84 02", counted(|c| c.wrong_function = 1)),
        ("too little", READ, "0001 0000 0005 01 03 02 FFFF", counted(|c| c.wrong_length = 1)),
        ("too much", READ, "0001 0000 0009 01 03 06 FFFF FFFF FFFF", counted(|c| c.wrong_length = 1)),
        ("nothing", READ, "0001 0000 0003 01 03 00", counted(|c| c.wrong_length = 1)),
        ("half a register", READ, "0001 0000 0006 01 03 03 FFFF FF", counted(|c| c.wrong_length = 1)),
        (
            "a byte count that lies",
            READ,
            "0001 0000 0007 01 03 02 FFFF FFFF",
            counted(|c| c.wrong_length = 1),
        ),
        ("a long exception", READ, "0001 0000 0004 01 83 02 02", counted(|c| c.wrong_length = 1)),
        ("a short confirmation", WRITE, "0001 0000 0005 01 06 0040 00", counted(|c| c.wrong_length = 1)),
        ("another value", WRITE, "0001 0000 0006 01 06 0040 0020", counted(|c| c.wrong_echo = 1)),
        ("another protocol", READ, "0001 0001 0007 01 03 04 FFFF FFFF", counted(|c| c.wrong_protocol = 1)),
    ];
    for (label, request, wrong, counters) in cases {
        let mut client = Client::new(Framing::Tcp);
        let mut asked = Vec::new();
        assert_eq!(client.start(ms(0), 1, &request, ms(1000), &mut asked), Ok(()));
        assert_eq!(client.receive(ms(1), &hex(wrong)), Pending, "{label}");
        assert_eq!(*client.counters(), counters, "{label}");
        assert_eq!(client.receive(ms(2), &hex("0001 0000 0003 01")), Pending, "{label}");
        let exception = [asked[7] | 0x80, 2];
        assert_eq!(client.receive(ms(3), &exception), Answered, "{label}");
    }
}

#[test]
fn a_short_read_is_an_answer_only_where_that_is_allowed() {
    let cases = [
        (Framing::Tcp, "0001 0000 0005 01 03 02 0007", "0002 0000 0005 01 03 02 0007"),
        (Framing::Rtu, "01 03 02 0007 F986", "01 03 02 0007 F986"),
    ];
    for (framing, first, second) in cases {
        let mut client = Client::new(framing);
        let ask = |client: &mut Client, at, request| {
            assert_eq!(client.start(ms(at), 1, request, ms(1000), &mut Vec::new()), Ok(()), "{framing:?}");
        };
        ask(&mut client, 0, &READ);
        assert_eq!(client.receive(ms(1), &hex(first)), Pending, "{framing:?}");
        assert_eq!(client.response(), None, "{framing:?}");
        assert_eq!(*client.counters(), counted(|c| c.wrong_length = 1), "{framing:?}");
        assert_eq!(client.expire(ms(1000)), TimedOut, "{framing:?}");

        ask(&mut client, 2000, &READ);
        client.accept_short();
        assert_eq!(client.receive(ms(2001), &hex(second)), Answered, "{framing:?}");
        assert_eq!(client.response(), Some(Response::ReadHoldingRegisters((&[7]).into())), "{framing:?}");

        // It holds for one transaction.
        ask(&mut client, 3000, &READ);
        let third = second.replacen("0002", "0003", 1);
        assert_eq!(client.receive(ms(3001), &hex(&third)), Pending, "{framing:?}");
        assert_eq!(*client.counters(), counted(|c| c.wrong_length = 2), "{framing:?}");
    }
}

#[test]
fn no_length_but_a_shorter_one_is_ever_allowed() {
    for wrong in ["0001 0000 0003 01 03 00", "0001 0000 0009 01 03 06 FFFF FFFF FFFF"] {
        let mut client = Client::new(Framing::Tcp);
        assert_eq!(client.start(ms(0), 1, &READ, ms(1000), &mut Vec::new()), Ok(()));
        client.accept_short();
        assert_eq!(client.receive(ms(1), &hex(wrong)), Pending, "{wrong}");
        assert_eq!(*client.counters(), counted(|c| c.wrong_length = 1), "{wrong}");
    }
}

#[test]
fn tcp_a_deadline_is_reached_at_its_instant() {
    let in_time = "0001 0000 0007 01 03 04 0001 0002";
    let ask = || Ask(0, READ, "0001 0000 0006 01 03 0020 0002");
    run(Framing::Tcp, &[ask(), Wait(999, Pending), Come(999, in_time, Answered)]);
    run(Framing::Tcp, &[ask(), Wait(1000, TimedOut), Come(1000, in_time, Pending), NoResponse]);
    // In hand before anybody gave up: taken, though the clock says otherwise.
    run(Framing::Tcp, &[ask(), Come(1000, in_time, Answered), registers(&[1, 2])]);
    // Anything else that comes then ends the wait.
    run(Framing::Tcp, &[ask(), Come(1000, "0009 0000 0003 01 83 02", TimedOut), Wait(1000, Pending)]);
    run(Framing::Tcp, &[ask(), Come(999, "0001 00", Pending), Come(1000, "00", TimedOut)]);
}

#[test]
fn tcp_an_impossible_length_breaks_the_connection() {
    for length in ["0000", "0001", "00FF", "FFFF"] {
        let bytes = hex(&format!("0001 0000 {length} 01 03 04 0001 0002"));
        let found = u16::from_be_bytes([bytes[4], bytes[5]]);
        let fault = Fault::Length { found };

        let mut client = Client::new(Framing::Tcp);
        let mut out = Vec::new();
        assert_eq!(client.start(ms(0), 1, &READ, ms(1000), &mut out), Ok(()));
        assert_eq!(client.receive(ms(1), &bytes), Progress::Broken(fault));
        assert_eq!((client.fault(), client.deadline(), client.response()), (Some(fault), None, None));
        assert_eq!(client.receive(ms(2), &[1]), Progress::Broken(fault));
        assert_eq!(client.start(ms(3), 1, &READ, ms(1000), &mut out), Err(StartError::Broken(fault)));
        assert_eq!(out, []);
        assert_eq!(*client.counters(), counted(|c| c.garbage_bytes = bytes.len() as u64 + 1));

        client.reset();
        play(&mut client, &[Ask(4, READ, "0002 0000 0006 01 03 0020 0002")]);
    }
}

#[test]
fn tcp_an_answer_before_the_break_counts() {
    let client = run(
        Framing::Tcp,
        &[
            Ask(0, READ, "0001 0000 0006 01 03 0020 0002"),
            Come(1, "0001 0000 0007 01 03 04 0007 0008 0000 0000 0000 00", Answered),
            registers(&[7, 8]),
        ],
    );
    assert_eq!(client.fault(), Some(Fault::Length { found: 0 }));
}

#[test]
fn tcp_transactions_wrap() {
    let mut client = Client::new(Framing::Tcp).with_transaction(0xFFFF);
    play(
        &mut client,
        &[
            Ask(0, READ, "FFFF 0000 0006 01 03 0020 0002"),
            Come(1, "FFFF 0000 0003 01 83 02", Answered),
            Ask(1, READ, "0000 0000 0006 01 03 0020 0002"),
            Come(2, "FFFF 0000 0003 01 83 02", Pending),
            Come(3, "0000 0000 0003 01 83 02", Answered),
        ],
    );
}

#[test]
fn tcp_a_reset_forgets_half_frames_and_the_transaction() {
    let mut client = run(
        Framing::Tcp,
        &[Ask(0, READ, "0001 0000 0006 01 03 0020 0002"), Come(1, "0001 0000 0007 01 03", Pending)],
    );
    client.reset();
    assert_eq!(client.deadline(), None);
    play(
        &mut client,
        &[
            Wait(5000, Pending),
            Ask(5000, READ, "0002 0000 0006 01 03 0020 0002"),
            Come(5001, "0002 0000 0003 01 83 02", Answered),
        ],
    );
}

#[test]
fn a_transaction_at_a_time() {
    let mut out = Vec::new();
    let mut client = Client::new(Framing::Tcp);
    assert_eq!(client.start(ms(0), 1, &READ, ms(1000), &mut out), Ok(()));
    assert_eq!(client.start(ms(1), 1, &READ, ms(1000), &mut out), Err(StartError::Busy));
    assert_eq!(out, []);
    assert_eq!(client.deadline(), Some(ms(1000)));
}

#[test]
fn an_illegal_request_does_not_leave() {
    let request = Request::ReadHoldingRegisters { address: 0, count: 126 };
    let error = EncodeError::Count { function: 3, found: 126, min: 1, max: 125 };
    for framing in [Framing::Tcp, Framing::Rtu] {
        let mut client = Client::new(framing);
        let mut out = vec![0xEE];
        assert_eq!(client.start(ms(0), 1, &request, ms(1), &mut out), Err(StartError::Encode(error)));
        assert_eq!((out, client.deadline()), (vec![], None));
    }
}

#[test]
fn endless_patience_never_ends() {
    let mut client = Client::new(Framing::Tcp);
    let started = client.start(ms(1), 1, &READ, Duration::MAX, &mut Vec::new());
    assert_eq!((started, client.expire(ms(1 << 40))), (Ok(()), Pending));
}

#[test]
fn answers_may_come_in_any_pieces() {
    let cases = [
        (Framing::Tcp, "0009 0000 0003 01 83 02 0001 0000 0007 01 03 04 0001 0002", counted(|c| c.late = 1)),
        (Framing::Rtu, "02 83 02 30F1 01 03 04 0001 0002 2A32", counted(|c| c.wrong_unit = 1)),
    ];
    for (framing, bytes, counters) in cases {
        let bytes = hex(bytes);
        for size in 1..=bytes.len() {
            let mut client = Client::new(framing);
            assert_eq!(client.start(ms(0), 1, &READ, ms(1000), &mut Vec::new()), Ok(()));
            let progress: Vec<_> = bytes.chunks(size).map(|piece| client.receive(ms(1), piece)).collect();
            let (last, before) = progress.split_last().unwrap();
            assert_eq!(*last, Answered, "{framing:?} in pieces of {size}");
            assert!(before.iter().all(|progress| *progress == Pending));
            assert_eq!(client.response(), Some(Response::ReadHoldingRegisters((&[1, 2]).into())));
            assert_eq!(*client.counters(), counters);
        }
    }
}

#[test]
fn coils_are_as_many_as_were_asked_for() {
    let request = Request::ReadCoils { address: 0x13, count: 10 };
    run(
        Framing::Tcp,
        &[
            Ask(0, request, "0001 0000 0006 01 01 0013 000A"),
            Come(1, "0001 0000 0005 01 01 02 CD FF", Answered),
            Step::Response(Response::ReadCoils(Bits::new(&[0xCD, 0x03], 10).unwrap())),
        ],
    );
}

#[test]
fn rtu_an_answer_in_time() {
    let client = run(
        Framing::Rtu,
        &[
            Ask(0, READ, "01 03 0020 0002 C5C1"),
            Come(7, "01 03 04 E240 0001 0C5F", Answered),
            registers(&[0xE240, 1]),
            Ask(11, WRITE, "01 06 0040 0010 89D2"),
            Come(18, "01 06 0040 0010 89D2", Answered),
            Ask(22, READ, "01 03 0020 0002 C5C1"),
            Come(29, "01 83 02 C0F1", Answered),
            Step::Response(Response::Exception { function: 3, code: ExceptionCode(2) }),
        ],
    );
    assert_eq!(*client.counters(), Counters::default());
}

#[test]
fn rtu_garbage_before_the_answer() {
    for garbage in ["00", "FF", "01 03", "55 55 55", "01 03 04 00 00 00"] {
        let mut client = run(
            Framing::Rtu,
            &[
                Ask(0, READ, "01 03 0020 0002 C5C1"),
                Come(1, garbage, Pending),
                Come(7, "01 03 04 E240 0001 0C5F", Answered),
                registers(&[0xE240, 1]),
            ],
        );
        let garbage_bytes = hex(garbage).len() as u64;
        assert_eq!(client.counters().garbage_bytes, garbage_bytes, "{garbage}");
        play(&mut client, &[Ask(8, READ, "01 03 0020 0002 C5C1")]);
    }
}

#[test]
fn rtu_wrong_answers_are_dropped_and_the_right_one_awaited() {
    let cases: [(&str, Request<'_>, &str, Counters); 6] = [
        ("unit", READ, "02 03 04 E240 0001 3F5F", counted(|c| c.wrong_unit = 1)),
        ("function", READ, "01 04 02 0007 F8F2", counted(|c| c.wrong_function = 1)),
        ("too much", READ, "01 03 06 0001 0002 0003 FD74", counted(|c| c.wrong_length = 1)),
        ("another value", WRITE, "01 06 0040 0020 89C6", counted(|c| c.wrong_echo = 1)),
        (
            "check sum",
            READ,
            "01 03 04 E240 0001 0C5E",
            counted(|c| {
                c.crc_errors = 1;
                c.garbage_bytes = 9;
            }),
        ),
        ("unit of another confirmation", READ, "09 10 0001 0002 1140", counted(|c| c.wrong_unit = 1)),
    ];
    for (label, request, wrong, counters) in cases {
        let mut client = Client::new(Framing::Rtu);
        assert_eq!(client.start(ms(0), 1, &request, ms(1000), &mut Vec::new()), Ok(()));
        assert_eq!(client.receive(ms(1), &hex(wrong)), Pending, "{label}");
        assert_eq!(client.silence(ms(5)), Pending, "{label}");
        assert_eq!(*client.counters(), counters, "{label}");
        assert_eq!(client.expire(ms(999)), Pending, "{label}");
        let refused = match request {
            Request::WriteSingleRegister { .. } => "01 86 0A C267",
            _ => "01 83 02 C0F1",
        };
        assert_eq!(client.receive(ms(999), &hex(refused)), Answered, "{label}");
    }
}

#[test]
fn rtu_a_time_out_drains_the_line() {
    let mut client = run(
        Framing::Rtu,
        &[Ask(0, READ, "01 03 0020 0002 C5C1"), Come(990, "01 03 04", Pending), Wait(1000, TimedOut)],
    );
    let mut out = Vec::new();
    let draining = |until| Err(StartError::Draining { until: ms(until) });
    assert_eq!(client.quiet_until(), Some(ms(1050)));
    assert_eq!(client.start(ms(1049), 2, &READ, ms(1000), &mut out), draining(1050));
    assert_eq!(out, []);

    // The rest of the late answer and a whole one: the line must be quiet again.
    play(
        &mut client,
        &[
            Come(1040, "E240 0001 0C5F", Pending),
            Silence(1044, Pending),
            Come(1060, "01 03 04 E240 0001 0C5F", Pending),
            NoResponse,
        ],
    );
    assert_eq!(client.start(ms(1109), 1, &READ, ms(1000), &mut out), draining(1110));
    play(
        &mut client,
        &[
            Ask(1110, READ, "01 03 0020 0002 C5C1"),
            Come(1120, "01 03 04 0001 0002 2A32", Answered),
            registers(&[1, 2]),
        ],
    );
    assert_eq!(client.quiet_until(), None);
    assert_eq!(
        *client.counters(),
        counted(|c| {
            c.late = 1;
            c.garbage_bytes = 9;
        })
    );
}

#[test]
fn rtu_the_quiet_period_can_be_set() {
    let mut client = Client::new(Framing::Rtu).with_quiet(ms(7));
    play(&mut client, &[Ask(0, READ, "01 03 0020 0002 C5C1"), Wait(1000, TimedOut)]);
    assert_eq!(client.quiet_until(), Some(ms(1007)));
    // A reset is a new line.
    client.reset();
    play(&mut client, &[Ask(1000, READ, "01 03 0020 0002 C5C1")]);
}

#[test]
fn rtu_what_comes_while_nobody_asked_is_dropped() {
    let client = run(
        Framing::Rtu,
        &[
            Come(0, "01 03 04 E240 0001 0C5F", Pending),
            Come(1, "01 03 04", Pending),
            Ask(2, READ, "01 03 0020 0002 C5C1"),
            Come(9, "01 03 04 0001 0002 2A32", Answered),
            registers(&[1, 2]),
            Come(10, "01 03 04 E240 0001 0C5F", Pending),
            registers(&[1, 2]),
        ],
    );
    assert_eq!(
        *client.counters(),
        counted(|c| {
            c.late = 2;
            c.garbage_bytes = 3;
        })
    );
}

#[test]
fn rtu_other_functions_are_answered_when_the_line_is_silent() {
    let request = Request::Other { function: 0x11, data: &[] };
    let client = run(
        Framing::Rtu,
        &[
            Ask(0, request, "01 11 C02C"),
            Come(5, "55 01 11 02", Pending),
            Come(6, "42 FF CDDC", Pending),
            Silence(10, Answered),
            Step::Response(Response::Other { function: 0x11, data: &[2, 0x42, 0xFF] }),
            Ask(20, request, "01 11 C02C"),
            // An exception tells its length.
            Come(25, "01 91 01 8C50", Answered),
            Ask(30, request, "01 11 C02C"),
            Come(35, "01 11 02 42 FF CDDB", Pending),
            Silence(40, Pending),
            // Another unit's answer, known by its check sum alone.
            Come(45, "02 11 02 42 FF 89DC", Pending),
            Silence(50, Pending),
            Silence(1030, TimedOut),
        ],
    );
    assert_eq!((client.counters().wrong_unit, client.counters().garbage_bytes), (1, 8));
}

#[test]
fn rtu_silence_ends_what_hides_the_answer() {
    run(
        Framing::Rtu,
        &[
            Ask(0, READ, "01 03 0020 0002 C5C1"),
            // Looks like an answer of 32 bytes.
            Come(5, "01 03 20", Pending),
            Come(6, "01 03 04 E240 0001 0C5F", Pending),
            Silence(10, Answered),
            registers(&[0xE240, 1]),
        ],
    );
}

#[test]
fn rtu_an_echo_is_no_confirmation() {
    const ASKED: &str = "01 06 00 40 00 10 89 D2";
    let mut client = Client::new(Framing::Rtu);
    play(&mut client, &[Ask(0, WRITE, ASKED)]);
    client.ignore_echo();
    // With noise in front and in pieces: nothing but a second copy confirms it.
    play(&mut client, &[Come(10, "FF 01 06 00", Pending), Come(12, "40 00 10 89 D2", Pending), NoResponse]);
    play(&mut client, &[Come(30, ASKED, Answered)]);
    assert_eq!(
        client.counters(),
        &counted(|counters| (counters.echoes, counters.garbage_bytes, counters.crc_errors) = (1, 1, 1))
    );

    // The device may refuse, and the next transaction begins anew.
    play(&mut client, &[Ask(100, WRITE, ASKED)]);
    client.ignore_echo();
    play(&mut client, &[Come(110, "01 86 02 C3 A1", Answered), Ask(200, WRITE, ASKED)]);
    play(&mut client, &[Come(210, ASKED, Answered)]);
}

#[test]
fn rtu_does_not_broadcast() {
    let mut client = Client::new(Framing::Rtu);
    let mut out = Vec::new();
    assert_eq!(client.start(ms(0), 0, &WRITE, ms(1), &mut out), Err(StartError::Broadcast));
    assert_eq!((out.len(), client.deadline()), (0, None));
    // Over TCP unit 0 is an address like any other.
    assert_eq!(Client::new(Framing::Tcp).start(ms(0), 0, &WRITE, ms(1), &mut out), Ok(()));
}
