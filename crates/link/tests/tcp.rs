//! The wire over real loopback sockets, against a peer whose every byte the test decides.
#![cfg(test)]

use std::collections::HashMap;
use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex};
use std::task::Poll;
use std::time::Duration;

use busbar_link::{
    Backoff, Cause, Direction, Endpoint, Link, LinkError, Loss, OpenError, Options, Priority, Trace,
    WireState, Write,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::{mpsc, oneshot};

const UNIT: u8 = 1;
const ADDRESS: u16 = 10246;

/// Short enough for tests that wait for it, long enough for a peer on a busy machine.
const QUICK: Duration = Duration::from_millis(300);

/// A listener on a port of the system's choice.
async fn listener() -> (TcpListener, Endpoint) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = Endpoint::from(listener.local_addr().unwrap());
    (listener, endpoint)
}

fn quick() -> Options {
    Options {
        timeout: QUICK,
        backoff: Backoff { first: Duration::from_millis(5), max: Duration::from_millis(20) },
        ..Options::default()
    }
}

/// Time-outs that no test reaches.
fn patient() -> Options {
    Options { timeout: Duration::from_secs(60), ..Options::default() }
}

/// Runs the peer beside the client; both must come to their end.
async fn play<T>(peer: impl Future<Output = ()> + Send + 'static, client: impl Future<Output = T>) -> T {
    let peer = tokio::spawn(peer);
    let both = async {
        let result = client.await;
        peer.await.unwrap();
        result
    };
    tokio::time::timeout(Duration::from_secs(30), both).await.expect("somebody waits for ever")
}

async fn request(stream: &mut TcpStream) -> [u8; 12] {
    let mut request = [0; 12];
    stream.read_exact(&mut request).await.unwrap();
    request
}

/// The peer waits until the client has hung up.
async fn hung_up(mut stream: TcpStream) {
    // A reset is as good as an end.
    let _ = stream.read_to_end(&mut Vec::new()).await;
}

fn frame(transaction: [u8; 2], unit: u8, pdu: &[u8]) -> Vec<u8> {
    let length = u8::try_from(pdu.len() + 1).unwrap();
    [&transaction[..], &[0, 0, 0, length, unit], pdu].concat()
}

/// An answer to a read that holds one register.
fn register(request: &[u8; 12], value: u16) -> Vec<u8> {
    let [high, low] = value.to_be_bytes();
    frame([request[0], request[1]], request[6], &[request[7], 2, high, low])
}

async fn read(link: &Link) -> Result<Vec<u16>, LinkError> {
    link.read_registers(UNIT, 3, ADDRESS, 1).await
}

async fn write(link: &Link) -> Result<(), LinkError> {
    let write = Write::Register { address: 8193, value: 4 };
    link.write(UNIT, write).await
}

async fn wait_until(link: &Link, wanted: impl Fn(&WireState) -> bool) -> WireState {
    link.state().wait_for(|state| wanted(state)).await.unwrap().clone()
}

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
        assert_eq!(write(&link).await, Err(LinkError::Lost { unit: UNIT, loss: Loss::TimedOut { after } }));
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

#[tokio::test]
async fn refuses_more_than_it_can_hold() {
    let (listener, endpoint) = listener().await;
    let (arrived, mut first_arrived) = mpsc::channel(1);
    let (go, may_go) = oneshot::channel::<()>();
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        arrived.send(()).await.unwrap();
        may_go.await.unwrap();
        stream.write_all(&register(&first, 1)).await.unwrap();
        let second = request(&mut stream).await;
        stream.write_all(&register(&second, 2)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, Options { queue: 1, ..patient() }).unwrap();
        let flying = tokio::spawn({
            let link = link.clone();
            async move { read(&link).await }
        });
        first_arrived.recv().await.unwrap();
        let (second, third) = tokio::join!(biased; read(&link), async {
            let third = read(&link).await;
            go.send(()).unwrap();
            third
        });
        assert_eq!(third, Err(LinkError::QueueFull { waiting: 1 }));
        assert_eq!((flying.await.unwrap(), second), (Ok(vec![1]), Ok(vec![2])));
    };
    play(peer, client).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn gives_each_of_many_callers_their_own_answer() {
    const CALLERS: u16 = 64;
    const READS: u16 = 50;
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        for _ in 0..CALLERS * READS {
            let asked = request(&mut stream).await;
            let address = u16::from_be_bytes([asked[8], asked[9]]);
            stream.write_all(&register(&asked, !address)).await.unwrap();
        }
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let callers: Vec<_> = (0..CALLERS)
            .map(|caller| {
                let link =
                    link.with_priority(if caller % 2 == 0 { Priority::Poll } else { Priority::Person });
                tokio::spawn(async move {
                    for read in 0..READS {
                        let address = caller * 1000 + read;
                        assert_eq!(link.read_registers(UNIT, 3, address, 1).await, Ok(vec![!address]));
                    }
                })
            })
            .collect();
        for caller in callers {
            caller.await.unwrap();
        }
        assert_eq!(link.statistics().answers, u64::from(CALLERS * READS));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn does_not_send_what_was_given_up_before_its_turn() {
    let (listener, endpoint) = listener().await;
    let (arrived, mut first_arrived) = mpsc::channel(1);
    let (go, may_go) = oneshot::channel::<()>();
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        arrived.send(()).await.unwrap();
        may_go.await.unwrap();
        stream.write_all(&register(&first, 1)).await.unwrap();
        let second = request(&mut stream).await;
        assert_eq!(second[7], 3, "the write was given up");
        stream.write_all(&register(&second, 2)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let flying = tokio::spawn({
            let link = link.clone();
            async move { read(&link).await }
        });
        first_arrived.recv().await.unwrap();
        tokio::select! {
            biased;
            _ = write(&link) => panic!("nobody answers it"),
            () = std::future::ready(()) => {}
        }
        go.send(()).unwrap();
        assert_eq!(flying.await.unwrap(), Ok(vec![1]));
        assert_eq!(read(&link).await, Ok(vec![2]));
    };
    play(peer, client).await;
}

/// A peer that answers reads with the transaction id.
async fn count_reads(listener: TcpListener, reads: u16) {
    let (mut stream, _) = listener.accept().await.unwrap();
    for _ in 0..reads {
        let asked = request(&mut stream).await;
        let id = u16::from_be_bytes([asked[0], asked[1]]);
        stream.write_all(&register(&asked, id)).await.unwrap();
    }
    hung_up(stream).await;
}

#[tokio::test]
async fn lets_others_pass_a_caller_who_does_not_poll() {
    let (listener, endpoint) = listener().await;
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![1]));
        let mut forgotten = pin!(read(&link));
        assert!(poll_once(forgotten.as_mut()).await.is_pending());
        assert_eq!(read(&link).await, Ok(vec![3]));
        assert_eq!(forgotten.await, Ok(vec![2]));
    };
    play(count_reads(listener, 3), client).await;
}

#[tokio::test]
async fn goes_on_when_a_caller_leaves_with_its_request_on_the_wire() {
    let (listener, endpoint) = listener().await;
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![1]));
        {
            let left = pin!(read(&link));
            assert!(poll_once(left).await.is_pending());
        }
        assert_eq!(read(&link).await, Ok(vec![3]));
        assert_eq!((link.statistics().answers, link.statistics().late), (3, 0));
    };
    play(count_reads(listener, 3), client).await;
}

async fn poll_once<F: Future>(mut future: Pin<&mut F>) -> Poll<F::Output> {
    std::future::poll_fn(|cx| Poll::Ready(future.as_mut().poll(cx))).await
}

#[tokio::test]
async fn hangs_up_with_the_last_handle() {
    let (listener, endpoint) = listener().await;
    let link = Link::open(endpoint, patient()).unwrap();
    let (stream, _) = listener.accept().await.unwrap();
    let mut state = link.state();
    state.wait_for(|state| *state == WireState::Connected).await.unwrap();
    drop(link.clone());
    drop(link);
    hung_up(stream).await;
    assert!(state.changed().await.is_err(), "the task is gone");
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

#[test]
fn opens_nothing_it_cannot_speak() {
    let opened = HashMap::from([
        ("rtu:///dev/ttyUSB0", "does not speak rtu yet, use a tcp:// endpoint"),
        ("rtu+tcp://127.0.0.1", "does not speak rtu+tcp yet"),
        ("tls://127.0.0.1", "does not speak tls yet"),
        ("tcp://127.0.0.1", "inside a tokio runtime"),
    ]);
    for (url, said) in opened {
        let error = Link::open(url.parse().unwrap(), Options::default()).unwrap_err();
        assert_eq!(url.starts_with("tcp"), error == OpenError::NoRuntime);
        assert!(error.to_string().contains(said), "{error}");
    }
}
