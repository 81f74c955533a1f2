//! The DKG-705 takes its time: no wire has its answer before.

use std::time::{Duration, Instant};

use busbar_link::{Endpoint, SerialPort};
use busbar_modbus::rtu::crc16;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{Emulation, start};
use crate::config::Config;

const PATIENCE: Duration = Duration::from_secs(10);
/// At least so long after a request (manual, page 1).
const DELAY: Duration = Duration::from_micros(4300);
/// One character at 9600 baud, 8N1.
const CHARACTER: Duration = Duration::from_nanos(1_041_666);

/// A read, a write and an exception, each with the length of its answer's PDU.
const EXCHANGES: [(&[u8], usize); 3] =
    [(&[3, 0, 0, 0, 16], 34), (&[6, 0, 0x40, 0, 0x10], 5), (&[3, 0, 0x38, 0, 1], 2)];

async fn dkg(endpoint: &str) -> Emulation {
    let listen = vec![endpoint.parse().unwrap()];
    start(Config { profile: "datakom-dkg705".into(), listen, ..Config::default() }).await.unwrap()
}

async fn connect(emulation: &Emulation) -> TcpStream {
    let (Endpoint::Tcp { host, port } | Endpoint::RtuTcp { host, port }) = &emulation.urls()[0] else {
        panic!("{:?}", emulation.urls());
    };
    TcpStream::connect((host.as_str(), *port)).await.unwrap()
}

fn rtu(pdu: &[u8]) -> Vec<u8> {
    let body = [&[1], pdu].concat();
    [&body[..], &crc16(&body).to_le_bytes()].concat()
}

/// How long until the first byte of the answer is there, and until the last one is.
async fn ask(wire: &mut (impl AsyncRead + AsyncWrite + Unpin), frame: &[u8], length: usize) -> [Duration; 2] {
    let mut bytes = vec![0; length];
    let asked = Instant::now();
    wire.write_all(frame).await.unwrap();
    timeout(PATIENCE, wire.read_exact(&mut bytes[..1])).await.unwrap().unwrap();
    let first = asked.elapsed();
    timeout(PATIENCE, wire.read_exact(&mut bytes[1..])).await.unwrap().unwrap();
    [first, asked.elapsed()]
}

#[tokio::test]
async fn no_answer_comes_before_its_delay_over_tcp() {
    let emulation = dkg("tcp://127.0.0.1:0").await;
    let mut stream = connect(&emulation).await;
    for (pdu, answer) in EXCHANGES {
        let frame = [&[0, 1, 0, 0, 0, pdu.len() as u8 + 1, 1], pdu].concat();
        let [first, _] = ask(&mut stream, &frame, 7 + answer).await;
        assert!(first >= DELAY, "{pdu:02X?}: {first:?}");
    }
}

#[tokio::test]
async fn no_answer_comes_before_its_delay_through_a_converter() {
    let emulation = dkg("rtu+tcp://127.0.0.1:0").await;
    let mut stream = connect(&emulation).await;
    for (pdu, answer) in EXCHANGES {
        let [first, _] = ask(&mut stream, &rtu(pdu), 3 + answer).await;
        assert!(first >= DELAY, "{pdu:02X?}: {first:?}");
    }
}

/// The delay is longer than the silence of the line, and takes its place.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn no_answer_comes_before_its_delay_on_a_line() {
    let emulation = dkg("rtu://pty?baud=9600").await;
    let Endpoint::Rtu { path, serial } = &emulation.urls()[0] else { panic!() };
    let mut port = SerialPort::open(path, serial).unwrap();
    for (pdu, answer) in EXCHANGES {
        let asked = CHARACTER * 8 + DELAY;
        let [first, last] = ask(&mut port, &rtu(pdu), 3 + answer).await;
        assert!(first >= asked + CHARACTER, "{pdu:02X?}: {first:?}");
        assert!(last >= asked + CHARACTER * (3 + answer as u32), "{pdu:02X?}: {last:?}");
    }
}
