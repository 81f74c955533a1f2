//! `busbar emulate`: one imitated controller on one or more ports and lines.

use busbar_emulator::{Config, StartError};
use busbar_link::Endpoint;
use busbar_profile::DateTime;
use jiff::Zoned;
use serde::Serialize;

use crate::{args, failure::Failure, logging, profiles, runtime, terminal, wall_clock};

/// Where it answers, as `--json` prints it.
#[derive(Serialize)]
struct Bound<'a> {
    urls: &'a [Endpoint],
}

pub(crate) fn run(args: args::Emulate, json: bool) -> Result<(), Failure> {
    logging::start("warn", logging::Format::Text)?;
    let profile = profiles::resolve(&args.key)?;
    let usual = Config::default();
    let config = Config {
        unit: args.unit.or(profile.wire.unit.default).unwrap_or(1),
        profile: args.key,
        model: args.model,
        listen: args.listen.into_iter().chain(args.more).collect(),
        seed: args.seed.unwrap_or(usual.seed),
        // Who names a seed wants the same registers every time, the calendar's too.
        epoch: if args.seed.is_some() { usual.epoch } else { today() },
        speed: args.speed,
        pins: args.set,
        ..usual
    };
    runtime::service(async |mut stop| {
        let emulation = busbar_emulator::start(config).await.map_err(failure)?;
        if json {
            terminal::print_json(&Bound { urls: emulation.urls() })?;
        } else {
            let lines: Vec<String> = emulation.urls().iter().map(|url| format!("{url}\n")).collect();
            terminal::print(&lines.concat())?;
        }
        stop.wait().await;
        emulation.stop().await;
        Ok(())
    })
}

/// What a calendar says that was set by this machine's clock.
pub(crate) fn today() -> DateTime {
    wall_clock::local(&Zoned::now()).unwrap_or(Config::default().epoch)
}

/// What the machine refuses is a failure; everything else was asked for wrongly.
pub(crate) fn failure(error: StartError) -> Failure {
    match error {
        StartError::Listen { .. }
        | StartError::SerialDevice { .. }
        | StartError::NoPseudoTerminal { .. }
        | StartError::Transport { .. } => Failure::failed(error),
        _ => Failure::Call(error.to_string()),
    }
}
