//! The device on real sockets.

use std::time::Duration;

use busbar_emulator::{Config, Emulation, StartError, start, start_together};
use busbar_link::Endpoint;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// More than any answer on loopback takes; only a failed test waits for it.
const PATIENCE: Duration = Duration::from_secs(10);

fn loopback(ports: &[u16]) -> Config {
    let listen = ports.iter().map(|port| Endpoint::Tcp { host: "127.0.0.1".into(), port: *port }).collect();
    Config { listen, ..Config::default() }
}

fn port(url: &Endpoint) -> u16 {
    match url {
        Endpoint::Tcp { port, .. } => *port,
        other => panic!("{other:?}"),
    }
}

async fn connect(emulation: &Emulation) -> TcpStream {
    TcpStream::connect(("127.0.0.1", port(&emulation.urls()[0]))).await.unwrap()
}

fn read_frame(transaction: u8, unit: u8, address: u16, count: u8) -> Vec<u8> {
    let [high, low] = address.to_be_bytes();
    vec![0, transaction, 0, 0, 0, 6, unit, 3, high, low, 0, count]
}

async fn receive(stream: &mut TcpStream, length: usize) -> Vec<u8> {
    let mut bytes = vec![0; length];
    timeout(PATIENCE, stream.read_exact(&mut bytes)).await.expect("an answer").unwrap();
    bytes
}

/// Until the other side closes; a reset is as good as an end.
async fn closed(stream: &mut TcpStream) {
    let mut bytes = [0; 64];
    let end = timeout(PATIENCE, stream.read(&mut bytes)).await.expect("the connection is closed");
    assert!(matches!(end, Ok(0) | Err(_)), "{end:?}");
}

#[tokio::test]
async fn several_listeners_share_one_plant() {
    let emulation = start(loopback(&[0, 0])).await.unwrap();
    let ports: Vec<u16> = emulation.urls().iter().map(port).collect();
    assert_eq!(ports.len(), 2);
    assert!(ports[0] != 0 && ports[1] != 0 && ports[0] != ports[1]);

    let mut first = TcpStream::connect(("127.0.0.1", ports[0])).await.unwrap();
    let mut second = TcpStream::connect(("127.0.0.1", ports[1])).await.unwrap();
    // Channel 5 is selected through one door and read through the other.
    first.write_all(&[0, 9, 0, 0, 0, 6, 1, 6, 0x20, 0x02, 0, 5]).await.unwrap();
    assert_eq!(receive(&mut first, 12).await, [0, 9, 0, 0, 0, 6, 1, 6, 0x20, 0x02, 0, 5]);
    second.write_all(&read_frame(1, 1, 10403, 1)).await.unwrap();
    assert_eq!(receive(&mut second, 11).await, [0, 1, 0, 0, 0, 5, 1, 3, 2, 0, 5]);
    emulation.stop().await;
}

#[tokio::test]
async fn requests_sent_together_are_answered_in_order() {
    let emulation = start(loopback(&[0])).await.unwrap();
    let mut stream = connect(&emulation).await;
    let mut requests = Vec::new();
    for transaction in 1..=20 {
        requests.extend(read_frame(transaction, 1, 10609, 1));
    }
    stream.write_all(&requests).await.unwrap();
    for transaction in 1..=20 {
        assert_eq!(receive(&mut stream, 11).await, [0, transaction, 0, 0, 0, 5, 1, 3, 2, 0xD5, 0]);
    }
    assert_eq!(emulation.statistics().answers, 20);
}

#[tokio::test]
async fn a_request_in_pieces_is_one_request_and_packets_are_counted() {
    let emulation = start(loopback(&[0])).await.unwrap();
    let mut stream = connect(&emulation).await;
    stream.set_nodelay(true).unwrap();
    let frame = read_frame(1, 1, 11683, 1);
    stream.write_all(&frame).await.unwrap();
    let first = receive(&mut stream, 11).await;
    stream.write_all(&frame).await.unwrap();
    let second = receive(&mut stream, 11).await;
    assert_eq!((first[10], second[10]), (1, 2));

    for byte in &frame {
        stream.write_all(&[*byte]).await.unwrap();
    }
    let third = receive(&mut stream, 11).await;
    assert!(third[10] > 2, "each packet of the pieces counts");
}

#[tokio::test]
async fn garbage_is_counted_and_answered_by_nothing() {
    let emulation = start(loopback(&[0])).await.unwrap();
    let mut stream = connect(&emulation).await;
    // Another protocol, another unit, unit 0, a body that is too short: then a request.
    stream.write_all(&[0, 1, 0, 7, 0, 6, 1, 3, 0x28, 0, 0, 1]).await.unwrap();
    stream.write_all(&read_frame(2, 2, 10240, 1)).await.unwrap();
    stream.write_all(&read_frame(3, 0, 10240, 1)).await.unwrap();
    stream.write_all(&[0, 4, 0, 0, 0, 3, 1, 3, 0x28]).await.unwrap();
    stream.write_all(&read_frame(5, 1, 10609, 1)).await.unwrap();
    assert_eq!(receive(&mut stream, 11).await[..2], [0, 5]);
    let statistics = emulation.statistics();
    assert_eq!(statistics.answers, 1);
    assert!(statistics.garbage >= 2, "{statistics:?}");

    // An impossible length leaves nobody in step: the connection ends, the device goes on.
    stream.write_all(&[0, 6, 0, 0, 0xFF, 0xFF, 1, 3]).await.unwrap();
    closed(&mut stream).await;
    let mut stream = connect(&emulation).await;
    stream.write_all(&read_frame(7, 1, 10609, 1)).await.unwrap();
    receive(&mut stream, 11).await;
}

#[tokio::test]
async fn function_0_is_an_illegal_function_and_functions_above_127_are_none() {
    let emulation = start(loopback(&[0])).await.unwrap();
    let mut stream = connect(&emulation).await;
    stream.write_all(&[1, 2, 0, 0, 0, 6, 1, 0, 0x28, 0, 0, 1]).await.unwrap();
    assert_eq!(receive(&mut stream, 9).await, [1, 2, 0, 0, 0, 3, 1, 0x80, 1]);
    // Nothing but its code, to another unit, and what only a server sends: the next answer is to the last one.
    stream.write_all(&[0, 2, 0, 0, 0, 2, 1, 0]).await.unwrap();
    assert_eq!(receive(&mut stream, 9).await, [0, 2, 0, 0, 0, 3, 1, 0x80, 1]);
    stream.write_all(&[0, 3, 0, 0, 0, 2, 9, 0]).await.unwrap();
    stream.write_all(&[0, 4, 0, 0, 0, 3, 1, 0x80, 1]).await.unwrap();
    stream.write_all(&[0, 5, 0, 0, 0, 2, 1, 0xFF]).await.unwrap();
    stream.write_all(&read_frame(6, 1, 10609, 1)).await.unwrap();
    assert_eq!(receive(&mut stream, 11).await[..2], [0, 6]);
    let statistics = emulation.statistics();
    assert_eq!((statistics.requests, statistics.answers, statistics.garbage), (4, 3, 2));
}

/// The function is judged before what follows it; a body that does not fit a function of the unit has no exception.
#[tokio::test]
async fn a_function_that_the_unit_does_not_have_is_refused_whatever_its_body() {
    let emulation = start(loopback(&[0])).await.unwrap();
    let mut stream = connect(&emulation).await;
    for function in [1, 2, 4, 5, 15, 0x2B] {
        for body in [&[][..], &[0], &[0, 0, 0, 1, 0], &[0; 250]] {
            let length = body.len() as u8 + 2;
            stream.write_all(&[&[0, 1, 0, 0, 0, length, 1, function], body].concat()).await.unwrap();
            let refused = [0, 1, 0, 0, 0, 3, 1, function | 0x80, 1];
            assert_eq!(receive(&mut stream, 9).await, refused, "{body:02X?}");
        }
    }
    let before = emulation.statistics();
    for function in [3, 6, 16] {
        stream.write_all(&[0, 2, 0, 0, 0, 3, 1, function, 0]).await.unwrap();
    }
    stream.write_all(&read_frame(3, 1, 10609, 1)).await.unwrap();
    assert_eq!(receive(&mut stream, 11).await[..2], [0, 3]);
    let after = emulation.statistics();
    assert_eq!((after.answers - before.answers, after.garbage - before.garbage), (1, 3));
}

#[tokio::test]
async fn a_hard_reset_answers_drops_everybody_and_comes_back() {
    // 4 simulated seconds of silence are 40 ms.
    let emulation = start(Config { speed: 100.0, ..loopback(&[0]) }).await.unwrap();
    let mut idle = connect(&emulation).await;
    let mut stream = connect(&emulation).await;
    stream.write_all(&read_frame(1, 1, 10240, 1)).await.unwrap();
    receive(&mut stream, 11).await;

    let reset = [0, 2, 0, 0, 0, 6, 1, 6, 0x20, 0x12, 0x38, 0xC8];
    stream.write_all(&reset).await.unwrap();
    assert_eq!(receive(&mut stream, 12).await, reset);
    closed(&mut stream).await;
    closed(&mut idle).await;

    let back = async {
        loop {
            let mut stream = connect(&emulation).await;
            let mut answer = [0; 11];
            let asked = stream.write_all(&read_frame(3, 1, 10609, 1)).await;
            if asked.is_ok() && stream.read_exact(&mut answer).await.is_ok() {
                return answer;
            }
        }
    };
    let answer = timeout(PATIENCE, back).await.expect("the device comes back");
    assert_eq!(answer[9..], [0xD5, 0]);
}

#[tokio::test]
async fn one_connection_too_many_is_closed_at_once_and_a_freed_place_is_given_again() {
    let emulation = start(Config { connections: 1, ..loopback(&[0]) }).await.unwrap();
    let mut first = connect(&emulation).await;
    first.write_all(&read_frame(1, 1, 10240, 1)).await.unwrap();
    receive(&mut first, 11).await;
    closed(&mut connect(&emulation).await).await;
    assert_eq!(emulation.statistics().turned_away, 1);

    drop(first);
    let served = async {
        loop {
            let mut stream = connect(&emulation).await;
            let mut answer = [0; 11];
            let asked = stream.write_all(&read_frame(2, 1, 10240, 1)).await;
            if asked.is_ok() && stream.read_exact(&mut answer).await.is_ok() {
                return;
            }
        }
    };
    timeout(PATIENCE, served).await.expect("the place is free again");
}

#[tokio::test]
async fn a_silent_connection_is_closed() {
    let emulation = start(Config { idle: Duration::from_millis(20), ..loopback(&[0]) }).await.unwrap();
    closed(&mut connect(&emulation).await).await;
}

#[tokio::test]
async fn values_move_by_themselves() {
    let emulation = start(Config { speed: 50.0, ..loopback(&[0]) }).await.unwrap();
    let mut stream = connect(&emulation).await;
    let moved = async {
        let mut seen = std::collections::BTreeSet::new();
        while seen.len() < 5 {
            stream.write_all(&read_frame(1, 1, 10240, 16)).await.unwrap();
            seen.insert(receive(&mut stream, 41).await);
        }
    };
    timeout(PATIENCE, moved).await.expect("the plant lives");
}

#[tokio::test]
async fn a_taken_port_is_one_sentence_and_nothing_is_left_bound() {
    let holder = start(loopback(&[0])).await.unwrap();
    let held = port(&holder.urls()[0]);
    // The same port of another loopback address is free, whatever other tests do.
    let free = Endpoint::Tcp { host: "127.0.0.2".into(), port: held };
    let listen = vec![free.clone(), holder.urls()[0].clone()];
    let error = start(Config { listen, ..Config::default() }).await.unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "cannot listen on tcp://127.0.0.1:{held}: the port is taken; \
             stop the other program or choose another port"
        )
    );

    // The first endpoint was bound and is free again, and once more after a stop.
    for _ in 0..2 {
        let config = Config { listen: vec![free.clone()], ..Config::default() };
        let emulation = start(config).await.unwrap();
        assert_eq!(emulation.urls(), std::slice::from_ref(&free));
        emulation.stop().await;
    }
}

#[tokio::test]
async fn no_limits_at_all_are_limits_too() {
    let config = Config { connections: usize::MAX, idle: Duration::MAX, ..loopback(&[0]) };
    let emulation = start(config).await.unwrap();
    let mut stream = connect(&emulation).await;
    stream.write_all(&read_frame(1, 1, 10609, 1)).await.unwrap();
    receive(&mut stream, 11).await;
}

#[tokio::test]
async fn impossible_calls_are_refused() {
    assert_eq!(start(Config::default()).await.unwrap_err(), StartError::NoEndpoint);
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY, 3601.0] {
        let error = start(Config { speed, ..loopback(&[0]) }).await.unwrap_err();
        assert!(matches!(error, StartError::Speed { .. }), "{error:?}");
    }
    assert_eq!(start_together(Vec::new(), Vec::new()).await.unwrap_err(), StartError::NoController);
    let endpoint: Endpoint = "tls://127.0.0.1:0".parse().unwrap();
    let error = start(Config { listen: vec![endpoint.clone()], ..Config::default() }).await.unwrap_err();
    assert_eq!(error, StartError::Transport { endpoint });
}
