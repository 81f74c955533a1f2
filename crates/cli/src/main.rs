//! `busbar`: reads, commands, imitates and serves standby-power controllers over Modbus.
//!
//! The rooms below do the work; here are the command line, what people see, and the wiring between the rooms.

mod anatomy;
mod args;
mod commands;
mod excerpt;
mod failure;
mod harvest;
mod logging;
mod manager;
mod people;
mod profiles;
mod runtime;
mod table;
mod terminal;
mod usage;
mod wall_clock;
mod wire;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    run()
}

fn run() -> ExitCode {
    let done = match args::Args::try_parse() {
        Ok(args) => commands::dispatch(args),
        // Help that was asked for goes to standard output and is no error.
        Err(help) if !help.use_stderr() => terminal::print_help(&help).map_err(failure::Failure::from),
        Err(error) => Err(usage::failure(&error)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
