//! Child processes: started, listened to, and the processor time they have used.

use std::error::Error;
use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead, BufReader, Lines};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

/// A command that runs `program` on one processor only, the same for every peer.
///
/// Client and server then take turns, so that what is counted is their work and not the waking of idle processors,
/// which costs several times as much and is different each time.
pub(crate) fn on_one_processor(program: impl AsRef<OsStr>) -> Result<Command, Box<dyn Error>> {
    let status = fs::read_to_string("/proc/self/status")?;
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    let processors = allowed.ok_or("no list of allowed processors")?.trim();
    let last = processors.rsplit([',', '-']).next().unwrap_or(processors);
    let mut command = Command::new("taskset");
    command.args(["--cpu-list", last]).arg(program);
    Ok(command)
}

/// The interpreter in which `make setup` installs pymodbus.
pub(crate) fn python() -> Result<Command, Box<dyn Error>> {
    let interpreter = concat!(env!("CARGO_MANIFEST_DIR"), "/../.venv/bin/python");
    match fs::exists(interpreter)? {
        true => Ok(Command::new(interpreter)),
        false => Err("pymodbus is not installed: run make setup first".into()),
    }
}

/// A child that is killed when it is dropped.
pub(crate) struct Process {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Process {
    pub(crate) fn start(command: &mut Command) -> Result<Self, Box<dyn Error>> {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{}: {error}", command.get_program().display()))?;
        let stdout = child.stdout.take().ok_or("no standard output")?;
        Ok(Self { child, lines: BufReader::new(stdout).lines() })
    }

    /// The next line the child prints.
    pub(crate) fn line(&mut self) -> Result<String, Box<dyn Error>> {
        let line = self.lines.next().ok_or("a peer ended before its time")?;
        Ok(line?)
    }

    /// The processor time of all its threads so far.
    pub(crate) fn processor_time(&self) -> Result<Duration, Box<dyn Error>> {
        let mut nanos = 0;
        for thread in fs::read_dir(format!("/proc/{}/task", self.child.id()))? {
            let schedstat = fs::read_to_string(thread?.path().join("schedstat"))?;
            let on_cpu = schedstat.split(' ').next().ok_or("an empty schedstat")?;
            nanos += on_cpu.parse::<u64>()?;
        }
        Ok(Duration::from_nanos(nanos))
    }
}

impl Process {
    /// Bytes of memory that it has now.
    pub(crate) fn resident(&self) -> Result<u64, Box<dyn Error>> {
        resident(self.child.id())
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }
}

/// Bytes of memory that a process has now.
pub(crate) fn resident(process: u32) -> Result<u64, Box<dyn Error>> {
    let status = fs::read_to_string(format!("/proc/{process}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).ok_or("no VmRSS")?;
    Ok(line.trim().trim_end_matches(" kB").parse::<u64>()? * 1024)
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
