//! Lines on which each of the usual things is wrong, beside a wire that works.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use busbar_modbus::rtu::crc16;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

use crate::support::{Imitation, site, start, until};

/// What the line makes of the right answer to a request.
type Spoil = fn(&[u8], Vec<u8>) -> Vec<u8>;

fn frame(body: &[u8]) -> Vec<u8> {
    [body, &crc16(body).to_le_bytes()].concat()
}

/// A line behind a converter: one D-500 as unit 1, whose registers hold their address but for the voltage.
async fn line(spoil: Arc<Mutex<Spoil>>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            tokio::spawn(serve(stream, Arc::clone(&spoil)));
        }
    });
    address
}

async fn serve(mut stream: TcpStream, spoil: Arc<Mutex<Spoil>>) {
    let mut request = [0; 8];
    while stream.read_exact(&mut request).await.is_ok() {
        let first = u16::from_be_bytes([request[2], request[3]]);
        let count = u16::from_be_bytes([request[4], request[5]]);
        let mut body = vec![request[0], request[1], (2 * count) as u8];
        for register in first..first + count {
            let value = match register {
                10_246 => 2302,
                10_247 => 0,
                10_609 => 0xD500,
                other => other,
            };
            body.extend(u16::to_be_bytes(value));
        }
        let spoil = *spoil.lock().unwrap();
        if stream.write_all(&spoil(&request, frame(&body))).await.is_err() {
            return;
        }
    }
}

/// Two controllers answer at once: where either pulls the line low it is low.
fn collision(_: &[u8], answer: Vec<u8>) -> Vec<u8> {
    let body: Vec<u8> =
        answer.iter().enumerate().map(|(at, byte)| if at < 3 { *byte } else { 0x55 }).collect();
    let other = frame(&body[..body.len() - 2]);
    answer.iter().zip(other).map(|(one, other)| one & other).collect()
}

/// Frames of somebody else, glued together.
fn others(request: &[u8], _: Vec<u8>) -> Vec<u8> {
    frame(&[request[0] + 1, 3, 2, 0xEE, 0xEE]).repeat(2)
}

const FAULTS: [(&str, Spoil, &str); 6] = [
    ("two units with one id", collision, "a frame came with a wrong check sum"),
    ("an echo and no answer", |request, _| request.to_vec(), "only our own request came back"),
    ("noise", |_, _| vec![0xFE, 0xF0, 0x80], "3 bytes came that make no frame"),
    ("half an answer", |_, answer| answer[..4].to_vec(), "4 bytes came that make no frame"),
    (
        "noise inside the answer",
        |_, mut answer| {
            answer.insert(5, 0xEE);
            answer
        },
        "a frame came with a wrong check sum",
    ),
    ("somebody else's answers", others, "another unit answered"),
];

#[tokio::test(flavor = "multi_thread")]
async fn whatever_is_wrong_on_a_line_is_named_and_stays_there() {
    let works = Imitation::start().await;
    let mut text = site(&format!("tcp://{}", works.address()));
    let mut lines = Vec::new();
    for (number, (what, fault, words)) in (2..).zip(FAULTS) {
        let spoil: Arc<Mutex<Spoil>> = Arc::new(Mutex::new(|_, answer| answer));
        let address = line(Arc::clone(&spoil)).await;
        let one = site(&format!("rtu+tcp://{address}"));
        let (_, one) = one.split_once("[[wires]]").unwrap();
        let id = format!("gen{number}");
        text.push_str(&format!("[[wires]]{}", one.replace("w1", &format!("w{number}")).replace("gen1", &id)));
        lines.push((id, spoil, what, fault, words));
    }
    let (_gateway, client) = start(&text).await;
    let fault = async |id: &str| client.get(&format!("/api/v1/devices/{id}")).await.json()["fault"].clone();
    let voltage = async |id: &str| {
        client.get(&format!("/api/v1/devices/{id}/values?point=genset_l1_voltage")).await.json()[0].clone()
    };
    let is_good = |value: &Value| value["quality"] == "good" && value["raw"] == json!([2302, 0]);

    for (id, ..) in &lines {
        until(async || voltage(id).await, is_good).await;
    }
    lines.iter().for_each(|(_, spoil, _, fault, _)| *spoil.lock().unwrap() = *fault);
    for (id, _, what, _, words) in &lines {
        let sentence = until(async || fault(id).await, Value::is_string).await;
        let sentence = sentence.as_str().unwrap();
        assert!(sentence.contains(words), "{what}: {sentence}");
        assert_eq!(sentence.matches("docs/connect/").count(), 1, "{sentence}");
        let value = until(async || voltage(id).await, |value| value["quality"] == "bad").await;
        assert_eq!(value["raw"], json!([2302, 0]), "{what}: no value came of it");
    }
    // The wire that works does not notice.
    let reads = works.change(|device| device.reads.len());
    until(async || works.change(|device| device.reads.len()), |now| *now > reads + 20).await;
    assert!(is_good(&voltage("gen1").await) && fault("gen1").await.is_null());

    // Answers behind an echo, or with another frame glued to them, are answers.
    let glued: [Spoil; 2] = [
        |request, answer| [request, &answer].concat(),
        |request, answer| [answer, frame(&[request[0] + 1, 3, 2, 0xEE, 0xEE])].concat(),
    ];
    for (index, (_, spoil, ..)) in lines.iter().enumerate() {
        *spoil.lock().unwrap() = glued[index % 2];
    }
    for (id, ..) in &lines {
        until(async || voltage(id).await, is_good).await;
        until(async || fault(id).await, Value::is_null).await;
    }
}
