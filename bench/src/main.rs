//! How fast the house is, beside bare C and its peers in the same run.
//!
//! Absolute figures vary from run to run and from machine to machine: compare ratios only.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its table")]

mod decode;
mod fleet;
mod peers;
mod process;
mod serial;
mod soak;
mod wire;

use std::process::ExitCode;

const USAGE: &str = "\
usage: busbar-bench [decode | wire [--rounds N] [--seconds S] | fleet [--seconds S] | serial [--exchanges N]]
       busbar-bench soak [--devices N] [--seconds N] [--readers N] [--count]
  decode  nanoseconds to decode and encode a point through a profile, and to plan reads
  wire    processor time a request of client and server, beside a bare C program and tokio-modbus
  fleet   a thousand and ten thousand devices polled each second: share of a processor, memory
  serial  the silence before each request on a serial line, and the time of a full refresh
  soak    imitated D-500 polled each second by the real gateway: missed polls, its processor time and memory, the time
          from a register changing to its event, readers that never read; with --count it judges no speed
Without a word it runs all but the soak.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match arguments.as_slice() {
        [] => decode::run()
            .and_then(|()| wire::run(&[]))
            .and_then(|()| fleet::run(&[]))
            .and_then(|()| serial::run(&[])),
        ["decode"] => decode::run(),
        ["wire", options @ ..] => wire::run(options),
        ["serial", options @ ..] => serial::run(options),
        ["fleet", options @ ..] => fleet::run(options),
        ["soak", options @ ..] => soak::run(options),
        // How the bench starts its peers: each is a process of its own, so that its processor time is its own.
        ["peer", role @ ..] => peers::run(role),
        _ => Err(USAGE.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
