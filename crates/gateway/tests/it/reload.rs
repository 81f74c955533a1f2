//! Another site file while the gateway runs: what it did not change goes on as if nothing had been.

use std::fs::File;
use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use busbar_gateway::{Gateway, Site};
use busbar_modbus::rtu::crc16;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::tcgetattr;
use serde_json::{Value, json};

use crate::support::{Bench, Client, Imitation, site, start, until};

fn reload(gateway: &mut Gateway, text: &str) {
    gateway.reload(Site::parse("bench.toml", text).unwrap()).unwrap();
}

fn site_at(device: &Imitation) -> String {
    site(&format!("tcp://{}", device.address()))
}

/// One more device on the first wire.
fn with_unit(text: &str, id: &str, unit: u8) -> String {
    let (_, table) = text.split_once("[[devices]]").unwrap();
    let table = table.split("[[").next().unwrap();
    let table = table.replace("gen1", id).replace("unit = 1", &format!("unit = {unit}"));
    format!("{text}\n[[devices]]{table}")
}

async fn view(client: &Client, id: &str) -> Value {
    client.get(&format!("/api/v1/devices/{id}")).await.json()
}

async fn until_good(client: &Client, id: &str) -> Value {
    let path = format!("/api/v1/devices/{id}/values?point=genset_l1_voltage");
    until(async || client.get(&path).await.json()[0].clone(), |value| value["quality"] == "good").await
}

fn connections(device: &Imitation) -> usize {
    device.change(|device| device.connections)
}

#[tokio::test(flavor = "multi_thread")]
async fn what_did_not_change_is_not_even_looked_at() {
    let mut bench = Bench::new().await;
    bench.until_value("longitude", |value| value["quality"] == "good").await;
    bench.until_view(|view| view["identity"]["verdict"] == "confirmed").await;
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    bench.device.change(|device| device.reads.clear());
    let text = site_at(&bench.device);
    reload(&mut bench.gateway, &text.replace("\"Bench\"", "\"Another name\""));
    let site = bench.client.get("/api/v1/site").await.json();
    assert_eq!((&site["name"], &site["revision"]), (&json!("Another name"), &json!(2)));
    let values = bench.client.get("/api/v1/devices/gen1/values").await.json();
    for value in values.as_array().unwrap() {
        assert!(value["quality"] == "good" || value["quality"] == "invalid", "{value}");
    }
    let view = bench.view().await;
    assert_eq!((&view["online"], &view["model"]), (&json!(true), &json!("D-500")), "not one moment without");

    let reads = async || bench.device.change(|device| device.reads.clone());
    let reads = until(reads, |reads| reads.len() > 100).await;
    let whose = |address: u16| reads.iter().filter(|read| read.0 == address).count();
    assert_eq!((whose(10_609), whose(11_693)), (0, 0), "neither who it is nor what is read once");
    assert_eq!(connections(&bench.device), 1);
    // Nobody was told of a value that was not good.
    for _ in 0..20 {
        let event = stream.next().await.unwrap();
        let text = event.data.to_string();
        assert!(!text.contains("\"stale\"") && !text.contains("\"bad\""), "{event:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn devices_come_go_and_change_their_places() {
    let device = Imitation::start().await;
    let one = site_at(&device);
    let two = with_unit(&one, "gen2", 2);
    let (mut gateway, client) = start(&one).await;
    until_good(&client, "gen1").await;

    reload(&mut gateway, &two);
    until_good(&client, "gen2").await;
    let listed = async || {
        let views = client.get("/api/v1/devices").await.json();
        views
            .as_array()
            .unwrap()
            .iter()
            .map(|view| view["id"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(listed().await, ["gen1", "gen2"]);

    // The other way round.
    let (head, tables) = two.split_once("[[devices]]").unwrap();
    let (first, second) = tables.split_once("[[devices]]").unwrap();
    reload(&mut gateway, &format!("{head}[[devices]]{second}\n[[devices]]{first}"));
    assert_eq!(listed().await, ["gen2", "gen1"]);
    for id in ["gen1", "gen2"] {
        assert_eq!((&view(&client, id).await["online"], connections(&device)), (&json!(true), 1), "{id}");
    }

    // One goes: it is not asked any more, whatever was under way.
    reload(&mut gateway, &one);
    assert_eq!(listed().await, ["gen1"]);
    let gone = client.get("/api/v1/devices/gen2").await.problem(404);
    assert_eq!(gone, "there is no device gen2; this site has gen1");
    let of = |unit: u8| device.change(|device| device.times.iter().filter(|read| read.1 == unit).count());
    let asked = (of(1), of(2));
    until(async || of(1), |now| *now > asked.0 + 100).await;
    assert!(of(2) <= asked.1 + 1, "{} and {}", of(2), asked.1);
    assert_eq!(connections(&device), 1, "all that over one connection");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_that_changed_is_read_as_the_file_says_now() {
    let device = Imitation::start().await;
    let text = site_at(&device);
    let (mut gateway, client) = start(&text).await;
    until_good(&client, "gen1").await;

    reload(&mut gateway, &text.replace("unit = 1", "unit = 7"));
    assert_eq!(view(&client, "gen1").await["unit"], 7);
    until_good(&client, "gen1").await;
    let last = device.change(|device| device.times.last().unwrap().1);
    assert_eq!((last, connections(&device)), (7, 1));

    // Once an hour in place of twenty times a second.
    let rarely = text.replace("fast = \"50ms\", slow = \"200ms\"", "fast = \"1h\", slow = \"1h\"");
    reload(&mut gateway, &rarely);
    until_good(&client, "gen1").await;
    let plan = client.get("/api/v1/wires/w1").await.json()["plans"][0].clone();
    assert_eq!(plan["rounds"][0]["every_s"], 3600.0);
    device.change(|device| device.registers.insert(10_246, 2_310));

    // And back: it is read at once.
    reload(&mut gateway, &text);
    let path = "/api/v1/devices/gen1/values?point=genset_l1_voltage";
    until(async || client.get(path).await.json()[0].clone(), |value| value["value"] == json!(231)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wire_that_leads_elsewhere_is_made_anew_and_the_old_one_closed() {
    let (here, there) = (Imitation::start().await, Imitation::start().await);
    there.change(|device| device.registers.insert(10_246, 2_310));
    let (mut gateway, client) = start(&site_at(&here)).await;
    until_good(&client, "gen1").await;
    assert_eq!((connections(&here), connections(&there)), (1, 0));
    reload(&mut gateway, &site_at(&there));
    let path = "/api/v1/devices/gen1/values?point=genset_l1_voltage";
    until(async || client.get(path).await.json()[0].clone(), |value| value["value"] == json!(231)).await;
    assert_eq!((connections(&here), connections(&there)), (1, 1));
    until(async || here.change(|device| device.open), |open| *open == 0).await;
    let wires = client.get("/api/v1/wires").await.json();
    assert_eq!(wires.as_array().unwrap().len(), 1);
    assert_eq!(wires[0]["endpoint"], format!("tcp://{}", there.address()));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_that_was_refused_is_told_and_changes_nothing() {
    let mut bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    bench.gateway.refuse("bench.toml: line 3 is no TOML");
    let site = bench.client.get("/api/v1/site").await.json();
    assert_eq!(site["config"]["refused"]["reason"], "bench.toml: line 3 is no TOML");
    assert_eq!((&site["revision"], &site["devices"][0]["online"]), (&json!(1), &json!(true)));
    // A wire that cannot be opened: the site before goes on.
    let text = site_at(&bench.device);
    let tls = text.replace("tcp://", "tls://");
    let refused = Site::parse("bench.toml", &tls).map(|site| bench.gateway.reload(site));
    assert!(!matches!(refused, Ok(Ok(()))), "{refused:?}");
    assert_eq!(connections(&bench.device), 1);
    assert_eq!(bench.view().await["online"], true);

    reload(&mut bench.gateway, &text);
    let site = bench.client.get("/api/v1/site").await.json();
    assert_eq!((&site["config"]["refused"], &site["revision"]), (&json!(null), &json!(2)));
}

/// A D-500 at the far end of a serial line of this machine.
struct Line {
    far: Arc<File>,
    path: String,
    over: Arc<AtomicBool>,
}

impl Line {
    fn new() -> Self {
        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&far).unwrap();
        unlockpt(&far).unwrap();
        let path = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
        let (far, over) = (Arc::new(File::from(far)), Arc::new(AtomicBool::new(false)));
        let (line, stop) = (Arc::clone(&far), Arc::clone(&over));
        std::thread::spawn(move || serve(&line, &stop));
        Self { far, path, over }
    }

    /// Bits a second, as whoever has it open has set it.
    fn baud(&self) -> u32 {
        tcgetattr(&*self.far).unwrap().output_speed()
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

fn serve(mut line: &File, over: &AtomicBool) {
    let mut request = [0; 8];
    while !over.load(Ordering::Relaxed) {
        // While nobody has the line open there is nothing to read.
        if line.read_exact(&mut request).is_err() {
            std::thread::sleep(Duration::from_millis(5));
            continue;
        }
        let address = u16::from_be_bytes([request[2], request[3]]);
        let count = u16::from_be_bytes([request[4], request[5]]);
        let mut answer = vec![request[0], 3, (2 * count) as u8];
        for register in address..address + count {
            answer.extend(u16::to_be_bytes(if register == 10_609 { 0xD500 } else { 0 }));
        }
        answer.extend(crc16(&answer).to_le_bytes());
        let _ = line.write_all(&answer);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_serial_line_at_another_speed_is_opened_anew() {
    let line = Line::new();
    let text = |baud: u32| site(&format!("rtu://{}?baud={baud}", line.path));
    let (mut gateway, client) = start(&text(9600)).await;
    until_good(&client, "gen1").await;
    assert_eq!(line.baud(), 9600);
    reload(&mut gateway, &text(19_200));
    until_good(&client, "gen1").await;
    assert_eq!(line.baud(), 19_200);
    let wires = client.get("/api/v1/wires").await.json();
    assert!(wires[0]["endpoint"].as_str().unwrap().contains("19200"), "{wires}");
    gateway.shutdown().await;
}
