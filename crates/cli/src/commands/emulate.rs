//! `busbar emulate`: one imitated controller on one or more ports and lines.

use busbar_emulator::{Config, StartError};
use busbar_link::Endpoint;
use serde::Serialize;

use crate::{args, failure::Failure, logging, profiles, runtime, terminal};

/// Where it answers, as `--json` prints it.
#[derive(Serialize)]
struct Bound<'a> {
    urls: &'a [Endpoint],
}

pub(crate) fn run(args: args::Emulate, json: bool) -> Result<(), Failure> {
    logging::start("warn")?;
    let profile = profiles::resolve(&args.key)?;
    let config = Config {
        unit: args.unit.or(profile.wire.unit.default).unwrap_or(1),
        profile: args.key,
        model: args.model,
        listen: args.listen.into_iter().chain(args.more).collect(),
        seed: args.seed,
        speed: args.speed,
        pins: args.set,
        ..Config::default()
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
