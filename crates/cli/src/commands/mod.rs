//! One module a command.

mod command;
mod control;
mod decode;
mod demo;
mod emulate;
mod frame;
mod plan;
mod profile;
mod read;
mod registers;
mod run;
mod watch;

use crate::{
    args::{Args, Command},
    failure::Failure,
};

/// Does what the command line asked for.
pub(crate) fn dispatch(args: Args) -> Result<(), Failure> {
    let json = args.json;
    match args.command {
        Command::Demo(args) => demo::run(&args, json),
        Command::Run(args) => run::run(&args, json),
        Command::Emulate(args) => emulate::run(args, json),
        Command::Profile(args) => profile::run(&args, json),
        Command::Decode(args) => decode::run(&args, json),
        Command::Frame(args) => frame::run(&args, json),
        Command::Plan(args) => plan::run(&args, json),
        Command::Read(args) => read::run(&args, json),
        Command::Watch(args) => watch::run(&args, json),
        Command::Registers(args) => registers::run(&args, json),
        Command::Order(args) => command::run(&args, json),
    }
}
