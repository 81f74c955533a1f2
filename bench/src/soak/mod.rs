//! The soak: imitated D-500 polled each second by the real gateway, judged by what its readers see.

mod rounds;
mod site;
mod stream;

use std::error::Error;
use std::net::SocketAddr;
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use self::rounds::Rounds;
use self::site::{Fleet, Person};
use self::stream::Events;
use crate::process::Process;

pub(crate) fn run(options: &[&str]) -> Result<(), Box<dyn Error>> {
    let mut seconds = 60;
    let mut devices = 1000;
    for pair in options.chunks(2) {
        match *pair {
            ["--seconds", n] => seconds = n.parse()?,
            ["--devices", n] => devices = n.parse()?,
            _ => return Err(crate::USAGE.into()),
        }
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(soak(seconds, devices))
}

async fn soak(seconds: u64, devices: usize) -> Result<(), Box<dyn Error>> {
    let fleet = Fleet::start(devices).await?;
    let folder = std::env::temp_dir();
    let site = fleet.write_site(&folder)?;
    tokio::time::sleep(Duration::from_secs(3)).await;
    let own = || std::fs::read_to_string("/proc/self/stat").unwrap();
    println!("{}", own());
    tokio::time::sleep(Duration::from_secs(5)).await;
    println!("{}", own());
    let mut command = Command::new(std::env::current_exe()?.with_file_name("busbar"));
    command
        .args(["run", "--json", "--listen", "127.0.0.1:0", "--config"])
        .arg(&site)
        .env("BUSBAR_LOG", "warn");
    let mut gateway = Process::start(&mut command)?;
    let line = gateway.line()?;
    let page = line.split('"').find(|part| part.starts_with("http://")).unwrap();
    let address: SocketAddr = page.trim_start_matches("http://").trim_end_matches('/').parse()?;
    println!("{page}");
    tokio::time::sleep(Duration::from_secs(10)).await;
    let b = gateway.processor_time()?;
    tokio::time::sleep(Duration::from_secs(10)).await;
    println!("no reader: {:?} in 10 s, {} MiB", gateway.processor_time()? - b, gateway.resident()? >> 20);
    let rounds = Arc::new(Mutex::new(Rounds::new(Duration::from_secs(1))));
    let r2 = rounds.clone();
    let reader = tokio::spawn(async move {
        let mut events = Events::open(address, "").await.unwrap();
        loop {
            let event = events.next().await.unwrap();
            match event.name {
                "values" => r2.lock().unwrap().values(event.data, Instant::now()).unwrap(),
                "device" => {}
                other => println!("{other} {}", event.data.len()),
            }
        }
    });
    tokio::time::sleep(Duration::from_secs(10)).await;
    println!("{}", own());
    rounds.lock().unwrap().begin();
    let b = gateway.processor_time()?;
    let t = Instant::now();
    let mut people =
        (0..devices.min(97)).map(|d| Person::new(fleet.endpoint(d).unwrap()).unwrap()).collect::<Vec<_>>();
    let mut n = 0;
    while t.elapsed() < Duration::from_secs(seconds) {
        let d = n % people.len();
        let mode = if (n / people.len()).is_multiple_of(2) { 1 } else { 4 };
        rounds.lock().unwrap().await_mode(format!("d{d}"), mode, Instant::now());
        people[d].press().await?;
        n += 1;
        tokio::time::sleep(Duration::from_millis(73)).await;
    }
    println!(
        "with reader: {:?} in {:?}, {} MiB",
        gateway.processor_time()? - b,
        t.elapsed(),
        gateway.resident()? >> 20
    );
    let mut rounds = rounds.lock().unwrap();
    println!(
        "finished {} missed {} devices {} untold {} conns {}",
        rounds.finished,
        rounds.missed,
        rounds.devices(),
        rounds.untold(),
        fleet.connections()
    );
    println!("delay {:?} {:?} {:?}", rounds.delay(0.5), rounds.delay(0.99), rounds.delay(1.0));
    println!("{}", own());
    drop(rounds);
    let wire = stream::Body::of(address, "/api/v1/wires/w7").await.unwrap().whole().await.unwrap();
    println!("{:.700}", String::from_utf8_lossy(&wire));
    reader.abort();
    Ok(())
}
