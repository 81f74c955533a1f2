//! What goes over the wire, and what is taken for an answer.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use busbar_link::{Direction, Link, LinkError, Options, Trace, WireState, Write};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::peer::*;

#[tokio::test]
async fn sends_and_takes_exactly_these_bytes() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut exchange = async |sent: &[u8], answer: &[u8]| {
            let mut bytes = vec![0; sent.len()];
            stream.read_exact(&mut bytes).await.unwrap();
            assert_eq!(bytes, sent);
            stream.write_all(answer).await.unwrap();
        };
        exchange(&[0, 1, 0, 0, 0, 6, 1, 3, 0x28, 0x06, 0, 2], &[0, 1, 0, 0, 0, 7, 1, 3, 4, 8, 0xFE, 0, 0])
            .await;
        exchange(&[0, 2, 0, 0, 0, 6, 9, 4, 0, 7, 0, 1], &[0, 2, 0, 0, 0, 5, 9, 4, 2, 0xBE, 0xEF]).await;
        let key = [0, 3, 0, 0, 0, 6, 1, 6, 0x20, 1, 0, 4];
        exchange(&key, &key).await;
        let coil = [0, 4, 0, 0, 0, 6, 1, 5, 0x3A, 0x9C, 0xFF, 0];
        exchange(&coil, &coil).await;
        exchange(
            &[0, 5, 0, 0, 0, 11, 1, 16, 0x2A, 0xF8, 0, 2, 4, 0, 1, 0, 2],
            &[0, 5, 0, 0, 0, 6, 1, 16, 0x2A, 0xF8, 0, 2],
        )
        .await;
        exchange(&[0, 6, 0, 0, 0, 6, 1, 6, 0x20, 1, 0, 4], &[0, 6, 0, 0, 0, 3, 1, 0x86, 10]).await;
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(link.read_registers(1, 3, ADDRESS, 2).await, Ok(vec![2302, 0]));

        let mut buffer = vec![1, 2, 3];
        link.read_registers_into(9, 4, 7, 1, &mut buffer).await.unwrap();
        assert_eq!(buffer, [0xBEEF]);

        write(&link).await.unwrap();
        let on = Write::Coil { address: 15004, on: true };
        link.write(1, on).await.unwrap();
        let values = Write::Registers { address: 11000, values: vec![1, 2] };
        link.write(1, values).await.unwrap();
        let refused = write(&link).await.unwrap_err();
        assert_eq!(
            refused.to_string(),
            "unit 1 answered function 6 with exception 10 (gateway path unavailable)"
        );

        let seen = link.statistics();
        assert_eq!((seen.requests, seen.answers, seen.exceptions[&10]), (6, 6, 1));
        assert_eq!(seen.latency.count(), 6);
        assert_eq!(link.state().borrow().clone(), WireState::Connected);
    };
    play(peer, client).await;
}

#[tokio::test]
async fn counts_each_unit_and_keeps_writes_together() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut functions = Vec::new();
        for _ in 0..4 {
            let request = request(&mut stream).await;
            functions.push((request[6], request[7]));
            let answer = match request[11] {
                // The third write is refused.
                3 => frame([request[0], request[1]], request[6], &[0x86, 3]),
                _ if request[7] == 6 => request.to_vec(),
                _ => register(&request, 7),
            };
            stream.write_all(&answer).await.unwrap();
        }
        assert_eq!(functions, [(9, 6), (9, 6), (9, 6), (1, 3)]);
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap().with_spacing(std::time::Duration::from_millis(1));
        assert_eq!(link.write_together(9, Vec::new()).await, Ok(()));
        let writes = [1, 2, 3, 4].map(|value| Write::Register { address: 8193, value });
        let (written, read) = tokio::join!(link.write_together(9, writes.into()), read(&link));
        let Err(interrupted) = written else { panic!("the third was refused") };
        assert_eq!((interrupted.acknowledged, interrupted.of, read), (2, 4, Ok(vec![7])));
        assert_eq!(
            interrupted.to_string(),
            "unit 9 answered function 6 with exception 3 (illegal data value) \
             (the device had acknowledged 2 of 4 writes that belong together)"
        );
        let seen = link.statistics();
        let units: Vec<_> = seen.units.iter().map(|unit| (unit.unit, unit.requests, unit.answers)).collect();
        assert_eq!(units, [(1, 1, 1), (9, 3, 3)]);
        assert_eq!((seen.requests, seen.units[1].exceptions[&3]), (4, 1));
        assert!(
            seen.busy.is_zero() && seen.waiting > std::time::Duration::ZERO && seen.open_for >= seen.waiting
        );
    };
    play(peer, client).await;
}

#[tokio::test]
async fn never_takes_a_late_answer() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        // The second comes only when the first has timed out.
        let second = request(&mut stream).await;
        stream.write_all(&register(&first, 111)).await.unwrap();
        stream.write_all(&register(&second, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, quick()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![222]));
        let seen = link.statistics();
        assert_eq!((seen.late, seen.timeouts, seen.retries), (1, 1, 1));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn takes_only_what_answers_whole_halved_or_glued() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        let id = [first[0], first[1]];
        let right = register(&first, 222);
        for wrong in [
            frame(id, UNIT + 1, &[3, 2, 0, 111]),
            frame(id, UNIT, &[4, 2, 0, 111]),
            frame(id, UNIT, &[3, 4, 0, 111, 0, 111]),
            frame([id[0], id[1] + 1], UNIT, &[3, 2, 0, 111]),
        ] {
            stream.write_all(&wrong).await.unwrap();
        }
        for byte in right {
            stream.write_all(&[byte]).await.unwrap();
            tokio::task::yield_now().await;
        }

        let second = request(&mut stream).await;
        let glued = [frame(id, UNIT, &[3, 2, 0, 111]), register(&second, 333)].concat();
        stream.write_all(&glued).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![222]));
        assert_eq!(read(&link).await, Ok(vec![333]));
        let seen = link.statistics();
        assert_eq!((seen.wrong_unit, seen.wrong_function, seen.wrong_length), (1, 1, 1));
        assert_eq!((seen.late, seen.requests, seen.answers), (2, 2, 2));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn refuses_what_is_no_request_and_goes_on() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let asked = request(&mut stream).await;
        stream.write_all(&register(&asked, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let error = link.read_registers(UNIT, 6, ADDRESS, 1).await;
        assert_eq!(error, Err(LinkError::NotARead { function: 6 }));
        for count in [0, 126] {
            let error = link.read_registers(UNIT, 3, ADDRESS, count).await;
            assert!(matches!(error, Err(LinkError::NotSent(_))), "{count}: {error:?}");
        }
        assert_eq!(read(&link).await, Ok(vec![222]));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn shows_every_frame_both_ways() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let asked = request(&mut stream).await;
        let answer = register(&asked, 222);
        stream.write_all(&answer[..4]).await.unwrap();
        tokio::task::yield_now().await;
        stream.write_all(&answer[4..]).await.unwrap();
        hung_up(stream).await;
    };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&seen);
    let client = async {
        let options = Options {
            trace: Some(Trace::new(move |event| {
                sink.lock().unwrap().push((event.direction, event.bytes.to_vec()));
            })),
            ..patient()
        };
        let link = Link::open(endpoint, options).unwrap();
        read(&link).await.unwrap();
    };
    play(peer, client).await;
    assert_eq!(
        *seen.lock().unwrap(),
        [
            (Direction::Sent, vec![0, 1, 0, 0, 0, 6, 1, 3, 0x28, 0x06, 0, 1]),
            (Direction::Received, vec![0, 1, 0, 0, 0, 5, 1, 3, 2, 0, 222]),
        ]
    );
}

#[tokio::test]
async fn frames_are_shown_only_while_somebody_wants_to_see_them() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        for value in [111, 222, 333, 444] {
            let asked = request(&mut stream).await;
            stream.write_all(&register(&asked, value)).await.unwrap();
        }
        hung_up(stream).await;
    };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![111]));
        for (trace, value) in [(Some("one"), 222), (None, 333), (Some("two"), 444)] {
            let sink = Arc::clone(&seen);
            // Any handle will do: the wire is one.
            link.with_timeout(Duration::from_secs(9)).trace(trace.map(|name| {
                Trace::new(move |event| sink.lock().unwrap().push((name, event.direction, event.bytes.len())))
            }));
            assert_eq!(read(&link).await, Ok(vec![value]));
        }
    };
    play(peer, client).await;
    let both = |name| [(name, Direction::Sent, 12), (name, Direction::Received, 11)];
    assert_eq!(*seen.lock().unwrap(), [both("one"), both("two")].concat());
}

#[tokio::test]
async fn takes_a_short_answer_only_for_who_allows_it() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        for full in [&[3, 4, 0, 1, 0, 2][..], &[], &[3, 4, 0, 3, 0, 4]] {
            let asked = request(&mut stream).await;
            stream.write_all(&register(&asked, 111)).await.unwrap();
            if !full.is_empty() {
                stream.write_all(&frame([asked[0], asked[1]], UNIT, full)).await.unwrap();
            }
        }
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let cutting = link.with_short_answers(true);
        assert_eq!(link.read_registers(UNIT, 3, ADDRESS, 2).await, Ok(vec![1, 2]));
        assert_eq!(cutting.read_registers(UNIT, 3, ADDRESS, 2).await, Ok(vec![111]));
        // It is the handle that allows it, not the wire.
        assert_eq!(link.read_registers(UNIT, 3, ADDRESS, 2).await, Ok(vec![3, 4]));
        assert_eq!(cutting.with_short_answers(false).statistics().wrong_length, 2);
    };
    play(peer, client).await;
}
