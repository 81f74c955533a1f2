//! `busbar emulate`: one imitated controller on one or more ports and lines.

use busbar_emulator::{Config, StartError};
use busbar_link::Endpoint;
use busbar_profile::DateTime;
use jiff::Zoned;
use serde::Serialize;

use super::{control, run};
use crate::{args, failure::Failure, logging, profiles, runtime, terminal, wall_clock};

/// Where it answers, as `--json` prints it.
#[derive(Serialize)]
struct Bound<'a> {
    urls: &'a [Endpoint],
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<String>,
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
    let token = control::token()?;
    runtime::service(async |mut stop| {
        let emulation = busbar_emulator::start(config).await.map_err(failure)?;
        let control = match args.control {
            Some(address) => Some(control::serve(address, &emulation, token).await?),
            None => None,
        };
        let (urls, page) = (emulation.urls(), control.as_ref().map(|control| run::page(control.address())));
        if json {
            terminal::print_json(&Bound { urls, control: page })?;
        } else {
            let mut lines: Vec<String> = urls.iter().map(|url| format!("{url}\n")).collect();
            lines.extend(page.map(|page| format!("control {page}\n")));
            terminal::print(&lines.concat())?;
        }
        stop.wait().await;
        if let Some(control) = control {
            control.stop().await;
        }
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
