//! Processor time a request over Modbus TCP, 16 registers a read: 12 bytes out, 41 back.
//!
//! A client is measured against the bare C server and a server against the bare C client, so that every peer meets
//! the same opponent. Programs take turns within a round; ratios are taken within the round, medians over rounds. The
//! bare C program stands in the table as a peer like the others: how far its ratio is from 1.00 is the error of the run.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use crate::process::{Process, on_one_processor};

const CONNECTIONS: [usize; 2] = [1, 100];
const WARM_UP: Duration = Duration::from_millis(300);

pub(crate) fn run(options: &[&str]) -> Result<(), Box<dyn Error>> {
    let options = Options::parse(options)?;
    let bare = compile_bare()?;
    let mut samples: BTreeMap<(Role, usize, Program), Vec<Sample>> = BTreeMap::new();
    for round in 1..=options.rounds {
        eprintln!("round {round} of {}", options.rounds);
        for connections in CONNECTIONS {
            let trial = |client, server| trial(&bare, client, server, connections, options.run);
            let (client_limit, server_limit) = trial(Program::Bare, Program::Bare)?;
            for program in Program::ALL {
                if program.has(Role::Client) {
                    let (cost, _) = trial(program, Program::Bare)?;
                    let sample = Sample { cost, ratio: cost.processor / client_limit.processor };
                    samples.entry((Role::Client, connections, program)).or_default().push(sample);
                }
                let (_, cost) = trial(Program::Bare, program)?;
                let sample = Sample { cost, ratio: cost.processor / server_limit.processor };
                samples.entry((Role::Server, connections, program)).or_default().push(sample);
            }
        }
    }
    print(&samples);
    Ok(())
}

struct Options {
    rounds: usize,
    run: Duration,
}

impl Options {
    fn parse(options: &[&str]) -> Result<Self, Box<dyn Error>> {
        let mut parsed = Self { rounds: 7, run: Duration::from_secs(1) };
        for pair in options.chunks(2) {
            match *pair {
                ["--rounds", rounds] => parsed.rounds = rounds.parse()?,
                ["--seconds", seconds] => parsed.run = Duration::try_from_secs_f64(seconds.parse()?)?,
                _ => return Err(crate::USAGE.into()),
            }
        }
        Ok(parsed)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Client,
    Server,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Program {
    Bare,
    Busbar,
    Emulator,
    TokioModbus,
}

impl Program {
    const ALL: [Self; 4] = [Self::Bare, Self::Busbar, Self::Emulator, Self::TokioModbus];

    fn has(self, role: Role) -> bool {
        role == Role::Server || self != Self::Emulator
    }

    fn name(self) -> &'static str {
        match self {
            Self::Bare => "bare C",
            Self::Busbar => "busbar",
            Self::Emulator => "busbar emulate",
            Self::TokioModbus => "tokio-modbus",
        }
    }

    fn command(self, bare: &PathBuf) -> Result<Command, Box<dyn Error>> {
        let peer = match self {
            Self::Bare => return on_one_processor(bare),
            Self::Busbar => "busbar",
            Self::Emulator => "emulator",
            Self::TokioModbus => "tokio-modbus",
        };
        let mut command = on_one_processor(std::env::current_exe()?)?;
        command.args(["peer", peer]);
        Ok(command)
    }
}

#[derive(Clone, Copy)]
struct Cost {
    /// Processor time a request, in microseconds.
    processor: f64,
    /// Requests a second.
    rate: f64,
}

struct Sample {
    cost: Cost,
    ratio: f64,
}

/// One client and one server for one stretch of time: what each spent on a request.
fn trial(
    bare: &PathBuf,
    client: Program,
    server: Program,
    connections: usize,
    run: Duration,
) -> Result<(Cost, Cost), Box<dyn Error>> {
    let mut server = Process::start(server.command(bare)?.arg("server"))?;
    let port = server.line()?;
    let millis = |duration: Duration| duration.as_millis().to_string();
    let mut client = Process::start(client.command(bare)?.args([
        "client",
        &port,
        &connections.to_string(),
        &millis(WARM_UP),
        &millis(run),
    ]))?;

    expect(&client.line()?, "go")?;
    let before = (client.processor_time()?, server.processor_time()?);
    let end = client.line()?;
    let after = (client.processor_time()?, server.processor_time()?);

    let exchanges: f64 = end.strip_prefix("end ").ok_or(end.clone())?.parse()?;
    if exchanges == 0.0 {
        return Err("no exchanges".into());
    }
    let cost = |spent: Duration| Cost {
        processor: spent.as_secs_f64() * 1e6 / exchanges,
        rate: exchanges / run.as_secs_f64(),
    };
    Ok((cost(after.0 - before.0), cost(after.1 - before.1)))
}

fn expect(line: &str, expected: &str) -> Result<(), Box<dyn Error>> {
    match line == expected {
        true => Ok(()),
        false => Err(format!("a peer said {line:?} in place of {expected:?}").into()),
    }
}

/// Compiles the bare C program beside the bench's own binary.
pub(crate) fn compile_bare() -> Result<PathBuf, Box<dyn Error>> {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/bare.c");
    let binary = std::env::current_exe()?.with_file_name("busbar-bench-bare");
    let status = Command::new("cc").args(["-O2", "-Wall", "-o"]).arg(&binary).arg(source).status()?;
    match status.success() {
        true => Ok(binary),
        false => Err("cc could not compile bench/bare.c".into()),
    }
}

fn print(samples: &BTreeMap<(Role, usize, Program), Vec<Sample>>) {
    println!("Modbus TCP, reads of 16 registers, client and server on one processor together:");
    println!("processor time a request (ratio to bare C), requests a second");
    println!("{:<16}{:<9}{:>24}{:>28}", "", "", "1 connection", "100 connections");
    for role in [Role::Client, Role::Server] {
        for program in Program::ALL.into_iter().filter(|program| program.has(role)) {
            let name = match role {
                Role::Client => "client",
                Role::Server => "server",
            };
            print!("{:<16}{name:<9}", program.name());
            for connections in CONNECTIONS {
                let Some(cell) = samples.get(&(role, connections, program)) else { continue };
                let processor = median(cell.iter().map(|sample| sample.cost.processor));
                let ratio = median(cell.iter().map(|sample| sample.ratio));
                let rate = median(cell.iter().map(|sample| sample.cost.rate));
                print!("{processor:>9.2} us ({ratio:.2}){rate:>8.0}/s");
            }
            println!();
        }
    }
    println!("target: 1.05 of bare C in every cell; compare ratios only");
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count if count % 2 == 1 => values[count / 2],
        count => f64::midpoint(values[count / 2 - 1], values[count / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_middle() {
        assert!((median([3.0, 1.0, 2.0].into_iter()) - 2.0).abs() < 1e-9);
        assert!((median([4.0, 1.0, 2.0, 3.0].into_iter()) - 2.5).abs() < 1e-9);
    }
}
