//! Connections that break, do not come, or come back.

use std::collections::HashMap;
use std::time::Duration;

use busbar_link::{Cause, Endpoint, Heard, Link, LinkError, Loss, OpenError, Options, WireState};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpSocket, TcpStream};

use crate::peer::*;

#[tokio::test]
async fn reconnects_after_bytes_that_are_no_modbus() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        request(&mut stream).await;
        stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n").await.unwrap();
        hung_up(stream).await;
        let (mut stream, _) = listener.accept().await.unwrap();
        let retried = request(&mut stream).await;
        stream.write_all(&register(&retried, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![222]));
        let seen = link.statistics();
        assert_eq!((seen.reconnects, seen.retries), (1, 1));
        assert!(seen.garbage_bytes > 0);
    };
    play(peer, client).await;
}

#[tokio::test]
async fn sends_a_read_again_when_the_connection_is_reset() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        request(&mut stream).await;
        stream.set_zero_linger().unwrap();
        drop(stream);
        let (mut stream, _) = listener.accept().await.unwrap();
        let retried = request(&mut stream).await;
        stream.write_all(&register(&retried, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![222]));
        assert_eq!(link.statistics().retries, 1);
    };
    play(peer, client).await;
}

#[tokio::test]
async fn sends_a_write_once_when_the_connection_is_reset() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        assert_eq!(request(&mut stream).await[7], 6);
        stream.set_zero_linger().unwrap();
        drop(stream);
        // The next thing that comes is the read, on a new connection.
        let (mut stream, _) = listener.accept().await.unwrap();
        let next = request(&mut stream).await;
        assert_eq!(next[7], 3);
        stream.write_all(&register(&next, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let Err(LinkError::Lost { loss: Loss::Dropped(why), .. }) = write(&link).await else {
            panic!("the write is lost");
        };
        assert_eq!(why.cause, Cause::Reset);
        assert_eq!(read(&link).await, Ok(vec![222]));
        assert_eq!((link.statistics().requests, link.statistics().retries), (2, 0));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn sends_a_write_once_when_nobody_answers() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        assert_eq!(request(&mut stream).await[7], 6);
        let next = request(&mut stream).await;
        assert_eq!(next[7], 3);
        stream.write_all(&register(&next, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, quick()).unwrap();
        let after = QUICK;
        let loss = Loss::TimedOut { after, heard: Heard::Nothing { serial: false } };
        assert_eq!(write(&link).await, Err(LinkError::Lost { unit: UNIT, loss }));
        assert_eq!(read(&link).await, Ok(vec![222]));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn makes_a_silent_connection_anew() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (stream, _) = listener.accept().await.unwrap();
        hung_up(stream).await;
        let (mut stream, _) = listener.accept().await.unwrap();
        let next = request(&mut stream).await;
        stream.write_all(&register(&next, 222)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, quick()).unwrap();
        assert!(matches!(read(&link).await, Err(LinkError::Timeout { tries: 2, .. })));
        // Its first try is the third time-out in a row.
        assert_eq!(read(&link).await, Ok(vec![222]));
        assert_eq!((link.statistics().timeouts, link.statistics().reconnects), (3, 1));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn minds_the_time_after_a_long_rest() {
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        stream.write_all(&register(&first, 111)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, Options { retries: 0, ..quick() }).unwrap();
        assert_eq!(read(&link).await, Ok(vec![111]));
        // Longer than any timer that the first exchange may have left behind.
        tokio::time::sleep(2 * QUICK).await;
        assert!(matches!(read(&link).await, Err(LinkError::Timeout { tries: 1, .. })));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn comes_back_when_the_server_does() {
    async fn serve_one(listener: TcpListener, value: u16) {
        let (mut stream, _) = listener.accept().await.unwrap();
        let asked = request(&mut stream).await;
        stream.write_all(&register(&asked, value)).await.unwrap();
        // Listener and connection go together, as when a server dies.
        drop(listener);
        drop(stream);
    }

    let (first, endpoint) = listener().await;
    let address = first.local_addr().unwrap();
    let link = Link::open(endpoint, quick()).unwrap();
    play(serve_one(first, 111), async {
        assert_eq!(read(&link).await, Ok(vec![111]));
    })
    .await;

    let state = wait_until(&link, |state| matches!(state, WireState::Down { .. })).await;
    let WireState::Down { reason, .. } = state else {
        panic!("not down: {state:?}");
    };
    assert_eq!(reason.cause, Cause::Refused);
    assert_eq!(read(&link).await, Err(LinkError::Down { reason: reason.clone() }));
    assert_eq!(write(&link).await, Err(LinkError::Down { reason }));

    let second = TcpListener::bind(address).await.unwrap();
    play(serve_one(second, 222), async {
        wait_until(&link, |state| *state == WireState::Connected).await;
        assert_eq!(read(&link).await, Ok(vec![222]));
    })
    .await;
    let seen = link.statistics();
    assert_eq!((seen.requests, seen.reconnects), (2, 1));
}

#[tokio::test]
async fn says_in_one_sentence_that_nothing_listens() {
    let (listener, endpoint) = listener().await;
    drop(listener);
    let link = Link::open(endpoint.clone(), patient()).unwrap();
    // Both are asked before the first attempt has failed.
    let (read, write) = tokio::join!(read(&link), write(&link));
    let sentence = format!(
        "{endpoint}: connection refused: check the port, and that the device is on and takes Modbus connections"
    );
    assert_eq!(read.unwrap_err().to_string(), sentence);
    assert_eq!(write.unwrap_err().to_string(), sentence);
    assert_eq!(link.statistics().requests, 0);
    wait_until(&link, |state| matches!(state, WireState::Down { .. })).await;
}

#[tokio::test]
async fn says_that_a_name_is_not_known() {
    // A label has at most 63 characters: the resolver refuses this one without asking anybody.
    let endpoint = Endpoint::Tcp { host: "genset".repeat(11), port: 502 };
    let link = Link::open(endpoint, patient()).unwrap();
    let Err(LinkError::Down { reason }) = read(&link).await else {
        panic!("not down");
    };
    assert_eq!(reason.cause, Cause::UnknownHost);
}

/// A listener whose queue is full: attempts to connect to it hang.
async fn black_hole() -> (tokio::net::TcpListener, Vec<TcpStream>, Endpoint) {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let listener = socket.listen(0).unwrap();
    let address = listener.local_addr().unwrap();
    let mut fillers = Vec::new();
    while let Ok(Ok(filler)) =
        tokio::time::timeout(Duration::from_millis(100), TcpStream::connect(address)).await
    {
        fillers.push(filler);
    }
    (listener, fillers, Endpoint::from(address))
}

#[tokio::test]
async fn lets_nobody_wait_behind_a_connection_that_does_not_come() {
    let (_listener, _fillers, endpoint) = black_hole().await;
    let options = Options { connect_timeout: 3 * QUICK, ..quick() };
    let link = Link::open(endpoint, options).unwrap();
    let (read, write) = tokio::join!(read(&link), write(&link));
    for error in [read.unwrap_err(), write.unwrap_err()] {
        let LinkError::Down { reason } = error else {
            panic!("not down: {error}");
        };
        let after = QUICK;
        assert_eq!(reason.cause, Cause::StillConnecting { after });
    }
    assert_eq!(*link.state().borrow(), WireState::Connecting);

    let state = wait_until(&link, |state| *state != WireState::Connecting).await;
    let WireState::Down { reason, .. } = state else {
        panic!("not down: {state:?}");
    };
    let after = 3 * QUICK;
    assert_eq!(reason.cause, Cause::ConnectTimedOut { after });
}

#[test]
fn opens_nothing_it_cannot_speak() {
    let opened = HashMap::from([
        ("tls://127.0.0.1", "does not speak tls yet"),
        ("rtu+tcp://127.0.0.1:0", "rtu+tcp://127.0.0.1:0: a device has no port 0"),
        ("tcp://127.0.0.1:0", "tcp://127.0.0.1:0: a device has no port 0; write the port that it listens on"),
        ("tcp://127.0.0.1", "inside a tokio runtime"),
        ("rtu+tcp://127.0.0.1", "inside a tokio runtime"),
        ("rtu:///dev/ttyUSB0", "inside a tokio runtime"),
    ]);
    for (url, said) in opened {
        let error = Link::open(url.parse().unwrap(), Options::default()).unwrap_err();
        assert_eq!(said == "inside a tokio runtime", error == OpenError::NoRuntime, "{url}");
        assert!(error.to_string().contains(said), "{error}");
    }
}
