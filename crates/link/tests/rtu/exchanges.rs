//! Requests and answers: on a line, through a converter, over an adapter that echoes; and the silence between them.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use busbar_link::{Direction, Endpoint, Heard, Link, LinkError, Loss, Options, Trace, Write};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

use crate::slave::*;

/// 3.5 characters of 10 bits at 9600 baud.
const SILENCE: Duration = Duration::from_nanos(3_645_833);

fn set(value: u16) -> Write {
    Write::Register { address: 8193, value }
}

#[tokio::test]
async fn reads_and_writes() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let request = line.request();
        assert_eq!(request, frame(&[1, 3, 0x28, 0x06, 0, 1]));
        line.say(&register(&request, 2302));
        let write = line.request();
        assert_eq!(write, frame(&[1, 6, 0x20, 0x01, 0, 4]));
        line.say(&write);
        let request = line.request();
        line.say(&frame(&[request[0], request[1] | 0x80, 2]));
    });
    let link = Link::open(endpoint, options()).unwrap();
    assert_eq!(read(&link).await, Ok(vec![2302]));
    assert_eq!(link.write(UNIT, set(4)).await, Ok(()));
    let refused = read(&link).await.unwrap_err();
    assert!(matches!(refused, LinkError::Exception { unit: UNIT, function: 3, .. }), "{refused}");
    assert_eq!(link.statistics().echoes, 0);
    drop(link);
    slave.join().unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_line_is_silent_before_each_request() {
    const ROUNDS: usize = 40;
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let mut spoke = None;
        for round in 0..ROUNDS {
            let (request, heard) = line.hear(8);
            if let Some(spoke) = spoke {
                let silence = heard.duration_since(spoke);
                assert!(silence >= SILENCE, "only {silence:?} before request {round}");
            }
            let answer = register(&request, 7);
            // In pieces, as USB adapters deliver; and sometimes with noise behind, which starts the silence anew.
            line.say(&answer[..3]);
            spoke = Some(line.say(&answer[3..]));
            if round % 4 == 3 {
                spoke = Some(line.say(&[0x55]));
            }
        }
    });
    let link = Link::open(endpoint, options()).unwrap();
    for _ in 0..ROUNDS {
        assert_eq!(read(&link).await, Ok(vec![7]));
    }
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn a_converter_takes_frames_of_the_line() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let endpoint: Endpoint = format!("rtu+tcp://{address}").parse().unwrap();
    let converter = tokio::spawn(async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut request = [0; 8];
        stream.read_exact(&mut request).await.unwrap();
        assert_eq!(request[..], frame(&[1, 3, 0x28, 0x06, 0, 1]));
        stream.write_all(&register(&request, 2302)).await.unwrap();
        // It hangs up, as converters do with idle clients, and takes the next connection.
        drop(stream);
        let (mut stream, _) = listener.accept().await.unwrap();
        stream.read_exact(&mut request).await.unwrap();
        stream.write_all(&[&request[..], &register(&request, 2303)].concat()).await.unwrap();
        stream.read_exact(&mut request).await.unwrap();
        stream
    });
    let link = connected(endpoint, quick()).await;
    assert_eq!(read(&link).await, Ok(vec![2302]));
    assert_eq!(read(&link.with_timeout(Duration::from_secs(30))).await, Ok(vec![2303]));
    assert_eq!(link.statistics().echoes, 1);
    let silent = read(&link).await.unwrap_err();
    assert!(matches!(silent, LinkError::Timeout { heard: Heard::Nothing { serial: true }, .. }), "{silent}");
    converter.await.unwrap();
}

#[tokio::test]
async fn an_adapter_may_echo() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        // The echo comes in pieces, glued to the answer.
        let request = line.request();
        line.say(&request[..3]);
        line.say(&[&request[3..], &register(&request, 7)].concat());
        // A write: its echo, then its confirmation, which looks the same.
        let write = line.request();
        line.say(&write);
        line.say(&write);
        // An echo that nobody answers.
        let write = line.request();
        line.say(&write);
        let request = line.request();
        line.say(&[&request[..], &register(&request, 8)].concat());
    });
    let link = Link::open(endpoint, options()).unwrap();
    assert_eq!(read(&link).await, Ok(vec![7]));
    assert_eq!(link.write(UNIT, set(4)).await, Ok(()));
    let unanswered = link.with_timeout(QUICK).write(UNIT, set(5)).await.unwrap_err();
    assert!(
        matches!(unanswered, LinkError::Lost { loss: Loss::TimedOut { heard: Heard::Echo, .. }, .. }),
        "{unanswered}"
    );
    assert_eq!(read(&link).await, Ok(vec![8]));
    let seen = link.statistics();
    assert_eq!((seen.echoes, seen.garbage_bytes, seen.late), (4, 0, 0));
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn an_echo_behind_noise_confirms_no_write() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        // The transceiver adds a byte whenever it switches over.
        let request = line.request();
        line.say(&[&[0xFF], &request[..], &register(&request, 7)].concat());
        let write = line.request();
        line.say(&[&[0xFF], &write[..]].concat());
        let write = line.request();
        line.say(&[&[0xFF], &write[..5]].concat());
        line.say(&[&write[5..], &write].concat());
        // An echo alone is no answer, but a refusal behind it is.
        let write = line.request();
        line.say(&[&write[..], &frame(&[write[0], write[1] | 0x80, 10])].concat());
    });
    let link = Link::open(endpoint, options()).unwrap();
    assert_eq!(read(&link).await, Ok(vec![7]));
    let unanswered = link.with_timeout(QUICK).write(UNIT, set(4)).await;
    assert!(matches!(unanswered, Err(LinkError::Lost { loss: Loss::TimedOut { .. }, .. })), "{unanswered:?}");
    assert_eq!(link.write(UNIT, set(5)).await, Ok(()));
    let refused = link.write(UNIT, set(6)).await;
    assert!(matches!(refused, Err(LinkError::Exception { .. })), "{refused:?}");
    assert_eq!(link.statistics().echoes, 4);
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn an_echo_alone_is_named() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let request = line.request();
        line.say(&request);
    });
    let link = connected(endpoint, quick()).await;
    let silent = read(&link).await.unwrap_err();
    assert!(matches!(silent, LinkError::Timeout { heard: Heard::Echo, .. }), "{silent}");
    assert!(silent.to_string().contains("the adapter echoes"), "{silent}");
    drop(link);
    slave.join().unwrap();
}

#[tokio::test]
async fn frames_are_shown_whole() {
    let line = Line::new();
    let endpoint = line.endpoint();
    let slave = line.play(|line| {
        let request = line.request();
        let answer = register(&request, 7);
        line.say(&answer[..4]);
        line.say(&answer[4..]);
    });
    let shown = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&shown);
    let trace = Trace::new(move |event| {
        sink.lock().unwrap().push((event.direction, event.bytes.to_vec()));
    });
    let link = Link::open(endpoint, Options { trace: Some(trace), ..options() }).unwrap();
    let mut state = link.state();
    assert_eq!(read(&link).await, Ok(vec![7]));
    drop(link);
    slave.join().unwrap();
    // The task has ended, and shown everything.
    while state.changed().await.is_ok() {}
    let request = frame(&[1, 3, 0x28, 0x06, 0, 1]);
    let answer = register(&request, 7);
    assert_eq!(*shown.lock().unwrap(), [(Direction::Sent, request), (Direction::Received, answer)]);
}
