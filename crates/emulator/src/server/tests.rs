//! Devices that take their time.

use std::time::{Duration, Instant};

use busbar_link::Endpoint;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{Emulation, serve};
use crate::config::Config;
use crate::device::Device;

const PATIENCE: Duration = Duration::from_secs(10);
/// What a DKG takes at least.
const DELAY: Duration = Duration::from_micros(4300);
/// 10609 of unit 1, and how it is answered.
const ASK: [u8; 8] = [0x01, 0x03, 0x29, 0x71, 0x00, 0x01, 0xDC, 0x4D];
const TOLD: [u8; 5] = [0x01, 0x03, 0x02, 0xD5, 0x00];

async fn slow(endpoint: &str) -> Emulation {
    let config = Config::default();
    let device = Device::new(&config).unwrap().with_answer_delay(DELAY);
    serve(&[config], vec![device], &[endpoint.parse().unwrap()]).await.unwrap()
}

async fn connect(emulation: &Emulation) -> TcpStream {
    let (Endpoint::Tcp { host, port } | Endpoint::RtuTcp { host, port }) = &emulation.urls()[0] else {
        panic!("{:?}", emulation.urls());
    };
    TcpStream::connect((host.as_str(), *port)).await.unwrap()
}

#[tokio::test]
async fn no_answer_comes_before_the_delay_of_its_device() {
    let frame = [&[0, 1, 0, 0, 0, 6][..], &ASK[..6]].concat();
    for (endpoint, request, answer) in [
        ("tcp://127.0.0.1:0", frame.as_slice(), [&[0, 1, 0, 0, 0, 5][..], &TOLD].concat()),
        ("rtu+tcp://127.0.0.1:0", ASK.as_slice(), TOLD.to_vec()),
    ] {
        let emulation = slow(endpoint).await;
        let mut stream = connect(&emulation).await;
        for _ in 0..5 {
            let asked = Instant::now();
            stream.write_all(request).await.unwrap();
            let mut bytes = vec![0; answer.len()];
            timeout(PATIENCE, stream.read_exact(&mut bytes)).await.unwrap().unwrap();
            assert!(asked.elapsed() >= DELAY, "{endpoint}: {:?}", asked.elapsed());
            assert_eq!(bytes, answer, "{endpoint}");
            if endpoint.starts_with("rtu") {
                timeout(PATIENCE, stream.read_exact(&mut [0; 2])).await.unwrap().unwrap();
            }
        }
    }
}
