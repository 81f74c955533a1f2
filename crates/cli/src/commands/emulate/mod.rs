//! `busbar emulate`: one imitated controller on one or more ports and lines, and the scenario that happens to it; or a fleet.

mod fleet;
mod scenario;

use std::path::Path;

use busbar_emulator::{Config, Faults, Scenario, StartError};
use busbar_link::Endpoint;
use busbar_profile::{DateTime, Findings};
use jiff::Zoned;
use serde::Serialize;

use super::{control, run};
use crate::{args, failure::Failure, logging, profiles, runtime, terminal, wall_clock};

pub(crate) use fleet::{Imitation, imitations};

/// Where it answers, as `--json` prints it.
#[derive(Serialize)]
struct Bound<'a> {
    urls: &'a [Endpoint],
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<String>,
}

pub(crate) fn run(args: args::Emulate, json: bool) -> Result<(), Failure> {
    logging::start("warn", logging::Format::Text)?;
    let faults = args.faults.as_deref();
    let faults = faults.map(|file| read(file, "file of faults", Faults::parse)).transpose()?;
    if let Some(file) = &args.fleet {
        return fleet::run(file, &args, faults.as_ref(), json);
    }
    // One of the two is there: the command line saw to it.
    let key = args.key.unwrap_or_default();
    let profile = profiles::resolve(&key)?;
    let scenario = args.scenario.as_deref();
    let scenario = scenario.map(|file| read(file, "scenario file", Scenario::parse)).transpose()?;
    let is_played = scenario.is_some();
    let usual = scenario.map_or_else(Config::default, |scenario| scenario.config());
    let config = Config {
        unit: args.unit.or(profile.wire.unit.default).unwrap_or(1),
        profile: key,
        model: args.model.or(usual.model),
        listen: args.listen.into_iter().chain(args.more).collect(),
        seed: args.seed.unwrap_or(usual.seed),
        // Who names a seed, or plays a scenario, wants the same registers every time, the calendar's too.
        epoch: if args.seed.is_some() || is_played { usual.epoch } else { today() },
        speed: args.speed,
        faults,
        pins: usual.pins.into_iter().chain(args.set).collect(),
        ..usual
    };
    let token = control::token()?;
    if let Some(address) = args.control {
        control::allow(address, token.as_ref())?;
    }
    runtime::service(async |mut stop| {
        let emulation = busbar_emulator::start(config).await.map_err(failure)?;
        let control = match args.control {
            Some(address) => Some(control::serve(address, control::alone(&emulation), token).await?),
            None => None,
        };
        let (urls, page) = (emulation.urls(), control.as_ref().map(|control| run::page(control.address())));
        if !json {
            let mut lines: Vec<String> = urls.iter().map(|url| format!("{url}\n")).collect();
            lines.extend(page.map(|page| format!("control {page}\n")));
            terminal::print(&lines.concat())?;
        } else if !is_played {
            terminal::print_json(&Bound { urls, control: page })?;
        } else if let Some(page) = page {
            // Standard output is for the one document about the scenario.
            terminal::message(&format!("control {page}"));
        }
        let done = if is_played {
            scenario::play(&emulation, &mut stop, json).await
        } else {
            stop.wait().await;
            Ok(())
        };
        if let Some(control) = control {
            control.stop().await;
        }
        emulation.stop().await;
        done
    })
}

/// What a file says. What is wrong with it is wrong with the call.
fn read<T>(
    path: &Path,
    what: &str,
    parse: impl FnOnce(&str, &str) -> Result<T, Findings>,
) -> Result<T, Failure> {
    let text = profiles::read(path, what).map_err(|failure| match failure {
        Failure::Failed(sentence) => Failure::Call(sentence),
        other => other,
    })?;
    let name = path.display().to_string();
    parse(&name, &text)
        .map_err(|findings| Failure::CallFindings(Box::new(profiles::excerpts(&name, text, &findings))))
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
