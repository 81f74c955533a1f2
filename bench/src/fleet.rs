//! Ten thousand devices over Modbus TCP, 16 registers each a second, decoded with change detection: share of a
//! processor and memory, beside tokio-modbus that does nothing but read.

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::process::Process;
use crate::wire::compile_bare;

const DEVICES: [usize; 2] = [1_000, 10_000];
const CLIENTS: [&str; 2] = ["busbar", "tokio-modbus"];
const SETTLE: Duration = Duration::from_secs(12);

pub(crate) fn run(options: &[&str]) -> Result<(), Box<dyn Error>> {
    let run = match options {
        [] => Duration::from_secs(20),
        ["--seconds", seconds] => Duration::try_from_secs_f64(seconds.parse()?)?,
        _ => return Err(crate::USAGE.into()),
    };
    let bare = compile_bare()?;
    println!("Devices polled each second over Modbus TCP, 16 registers each, one process; bare C answers");
    println!("{:<16}{:>9}{:>12}{:>14}{:>14}{:>10}", "", "devices", "reads/s", "processor", "memory", "late");
    for devices in DEVICES {
        for client in CLIENTS {
            let found = trial(&bare, client, devices, run)?;
            println!(
                "{client:<16}{devices:>9}{:>12.0}{:>12.1} %{:>10.1} MiB{:>10}",
                found.rate, found.processor, found.memory, found.late
            );
        }
    }
    println!(
        "target: 10,000 devices in 25 % of a processor and 60 MiB; busbar decodes and sees changes, tokio-modbus only reads"
    );
    Ok(())
}

struct Found {
    rate: f64,
    /// Percent of one processor.
    processor: f64,
    /// MiB resident.
    memory: f64,
    /// Reads that began more than a second after they were due.
    late: u64,
}

fn trial(bare: &Path, client: &str, devices: usize, run: Duration) -> Result<Found, Box<dyn Error>> {
    let mut server = Process::start(Command::new(bare).arg("server"))?;
    let port = server.line()?;
    let mut command = Command::new(std::env::current_exe()?);
    let settle = SETTLE.as_millis().to_string();
    let lasts = run.as_millis().to_string();
    command.args(["peer", client, "fleet", &port, &devices.to_string(), &settle, &lasts]);
    let mut client = Process::start(&mut command)?;

    if client.line()? != "go" {
        return Err("the client did not begin".into());
    }
    let (before, began) = (client.processor_time()?, Instant::now());
    sleep(run.mul_f64(0.9));
    let (spent, lasted) = (client.processor_time()? - before, began.elapsed());
    let memory = client.resident()? as f64 / 1_048_576.0;
    let end = client.line()?;
    let mut words = end.strip_prefix("end ").ok_or(end.clone())?.split(' ').map(str::parse::<u64>);
    let (Some(Ok(reads)), Some(Ok(late))) = (words.next(), words.next()) else { return Err(end.into()) };
    Ok(Found {
        rate: reads as f64 / run.as_secs_f64(),
        processor: 100.0 * spent.as_secs_f64() / lasted.as_secs_f64(),
        memory,
        late,
    })
}
