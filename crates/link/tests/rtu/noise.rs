//! Bytes that are no answer: noise, pieces, late and foreign frames. None becomes a value, and each has its sentence.

use std::time::Duration;

use busbar_link::{Heard, Link, LinkError, Options, Write};

use crate::slave::*;

/// What is heard when a slave says this, and nothing else, to a read; and how many check sums were wrong.
async fn heard(answer: impl Fn(&[u8]) -> Vec<u8> + Send + 'static) -> (Heard, u64) {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(move |line| {
        let request = line.request();
        let answer = answer(&request);
        line.say(&answer);
    });
    let link = connected(endpoint, quick()).await;
    let error = read(&link).await.unwrap_err();
    let LinkError::Timeout { heard, .. } = error else { panic!("{error}") };
    let crc_errors = link.statistics().crc_errors;
    drop(link);
    slave.join().unwrap();
    (heard, crc_errors)
}

#[tokio::test]
async fn noise_before_an_answer_does_not_hide_it() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let request = line.request();
        line.say(&[0x00, 0xFF, 0x80]);
        line.say(&register(&request, 7));
        // Glued: what is behind the answer is not taken for the next one.
        let request = line.request();
        line.say(&[register(&request, 8), register(&request, 9)].concat());
        let request = line.request();
        line.say(&register(&request, 10));
    });
    let link = Link::open(endpoint, options()).unwrap();
    for value in [7, 8, 10] {
        assert_eq!(read(&link).await, Ok(vec![value]));
    }
    let seen = link.statistics();
    assert_eq!((seen.late, seen.garbage_bytes), (1, 3));
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn an_answer_behind_noise_does_not_wait_for_the_deadline() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        // It looks like the beginning of a long answer.
        let looks_long = [5, 3, 0xF0];
        for (noise, value) in [(&looks_long[..], 7), (&[], 8), (&looks_long, 9)] {
            let request = line.request();
            line.say(&[noise, &register(&request, value)].concat());
        }
    });
    let patient = Options { timeout_floor: options().timeout, ..options() };
    let link = connected(endpoint, patient).await;
    let soon = Duration::from_secs(10);
    for value in [7, 8, 9] {
        // Long enough for the line to be silent: the caller sends and reads by himself.
        tokio::time::sleep(Duration::from_millis(100)).await;
        assert_eq!(tokio::time::timeout(soon, read(&link)).await, Ok(Ok(vec![value])));
    }
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn a_line_that_is_never_silent_is_named_and_soon() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let (end, ended) = std::sync::mpsc::channel::<()>();
    let slave = line.play(move |line| {
        let chatter = Duration::from_millis(1);
        while ended.recv_timeout(chatter) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
            line.say(&[0xFF; 8]);
        }
        // And then it is a line like others, down to the last write.
        loop {
            let request = line.request();
            if request[1] == 6 {
                line.say(&request);
                return;
            }
            line.say(&register(&request, 7));
        }
    });
    let link = connected(endpoint, quick()).await;
    // On a busy machine a pause may slip in; then there is no answer.
    let mut named = false;
    for _ in 0..20 {
        let error = tokio::time::timeout(Duration::from_secs(10), read(&link)).await.unwrap().unwrap_err();
        named |= matches!(error, LinkError::NeverSilent { unit: UNIT, .. });
        if named {
            assert!(error.to_string().contains("not silent within 300ms; check"), "{error}");
            break;
        }
    }
    assert!(named);
    drop(end);
    let patient = link.with_timeout(Duration::from_secs(30));
    assert_eq!(read(&patient).await, Ok(vec![7]));
    assert_eq!(patient.write(UNIT, Write::Register { address: 8193, value: 4 }).await, Ok(()));
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn what_is_heard_instead_of_an_answer_has_a_name() {
    let (named, _) = heard(|_| vec![0xFE, 0xF0, 0x80]).await;
    assert_eq!(named, Heard::Noise { bytes: 3 });

    let (named, _) = heard(|request| register(request, 7)[..4].to_vec()).await;
    assert_eq!(named, Heard::Noise { bytes: 4 }, "a truncated frame");

    let (named, crc_errors) = heard(|request| {
        let mut damaged = register(request, 7);
        damaged[3] ^= 0x10;
        damaged
    })
    .await;
    assert_eq!(named, Heard::BadCrc);
    assert_eq!(crc_errors, 1);

    let (named, _) = heard(|_| frame(&[2, 3, 2, 0, 7])).await;
    assert_eq!(named, Heard::OtherUnit);

    let (named, _) = heard(|_| frame(&[UNIT, 3, 4, 0, 7, 0, 8])).await;
    assert_eq!(named, Heard::Misfit);

    let (named, _) = heard(|_| Vec::new()).await;
    assert_eq!(named, Heard::Nothing { serial: true });
}

#[tokio::test]
async fn noise_inside_a_frame_costs_a_try_and_no_value() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let request = line.request();
        let mut noisy = register(&request, 7);
        noisy.insert(3, 0xA5);
        line.say(&noisy);
        let request = line.request();
        line.say(&register(&request, 8));
    });
    let link = Link::open(endpoint, options()).unwrap();
    assert_eq!(read(&link.with_timeout(QUICK)).await, Ok(vec![8]));
    assert_eq!(link.statistics().retries, 1);
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn a_late_answer_is_counted_and_not_taken() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let (late, hears_late) = std::sync::mpsc::channel::<()>();
    let slave = line.play(move |line| {
        let missed = line.request();
        hears_late.recv().unwrap();
        line.say(&register(&missed, 66));
        let (request, _) = line.hear(8);
        line.say(&register(&request, 7));
    });
    let link = connected(endpoint, quick()).await;
    let error = read(&link).await.unwrap_err();
    assert!(matches!(error, LinkError::Timeout { .. }), "{error}");
    late.send(()).unwrap();
    // The wire hears it although nobody asks.
    while link.statistics().late == 0 {
        tokio::task::yield_now().await;
    }
    let second = link.with_timeout(Duration::from_secs(30));
    assert_eq!(second.read_registers(UNIT, 3, ADDRESS + 1, 1).await, Ok(vec![7]));
    drop(link);
    slave.join().unwrap();
}
