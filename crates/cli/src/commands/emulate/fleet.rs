//! `--fleet FILE`: several imitated controllers, whose plants may be joined.

use std::path::Path;

use busbar_emulator::{Emulation, Faults, Fleet, start_fleet};
use busbar_link::Endpoint;
use serde::Serialize;

use super::{failure, read, today};
use crate::{args, commands::control, failure::Failure, runtime, terminal};

/// One controller of a fleet and where it answers, for programs.
#[derive(Serialize)]
pub(crate) struct Imitation {
    pub(crate) id: String,
    pub(crate) profile: &'static str,
    pub(crate) model: String,
    pub(crate) endpoint: Option<Endpoint>,
    pub(crate) unit: u8,
    #[serde(skip)]
    vendor: &'static str,
}

impl Imitation {
    /// The same for people.
    pub(crate) fn line(&self) -> String {
        let Self { vendor, model, unit, .. } = self;
        let endpoint = self.endpoint.as_ref().map(ToString::to_string).unwrap_or_default();
        format!("{:<21}{endpoint}, unit {unit}", format!("{vendor} {model}"))
    }
}

/// The controllers of a fleet that runs.
pub(crate) fn imitations(fleet: &Fleet, emulation: &Emulation) -> Vec<Imitation> {
    let members = fleet.members.iter().zip(emulation.controllers());
    let imitation = members.map(|(member, controller)| {
        let endpoint = controller.endpoints().first().cloned();
        controller.with(|device| Imitation {
            id: member.id.clone(),
            profile: &device.profile().key,
            model: device.model().to_owned(),
            endpoint,
            unit: device.unit(),
            vendor: device.profile().vendor.as_str(),
        })
    });
    imitation.collect()
}

/// What `--json` prints.
#[derive(Serialize)]
struct Bound<'a> {
    urls: &'a [Endpoint],
    controllers: &'a [Imitation],
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<String>,
}

pub(super) fn run(
    file: &Path,
    args: &args::Emulate,
    faults: Option<&Faults>,
    json: bool,
) -> Result<(), Failure> {
    let mut fleet = read(file, "fleet file", Fleet::parse)?;
    for member in &mut fleet.members {
        member.config.speed = args.speed;
        member.config.faults = faults.cloned();
        match args.seed {
            // By itself each is another machine.
            Some(seed) => member.config.seed = member.config.seed.wrapping_add(seed),
            None => member.config.epoch = today(),
        }
    }
    let token = control::token()?;
    if let Some(address) = args.control {
        control::allow(address, token.as_ref())?;
    }
    runtime::service(async |mut stop| {
        let emulation = start_fleet(fleet.clone()).await.map_err(failure)?;
        let control = match args.control {
            Some(address) => {
                Some(control::serve(address, control::imitated(&fleet, &emulation), token).await?)
            }
            None => None,
        };
        let page = control.as_ref().map(|control| super::run::page(control.address()));
        let controllers = imitations(&fleet, &emulation);
        match json {
            true => terminal::print_json(&Bound {
                urls: emulation.urls(),
                controllers: &controllers,
                control: page,
            })?,
            false => terminal::print(&told(emulation.urls(), &controllers, page))?,
        }
        stop.wait().await;
        if let Some(control) = control {
            control.stop().await;
        }
        emulation.stop().await;
        Ok(())
    })
}

/// The URLs first, for programs read them.
fn told(urls: &[Endpoint], controllers: &[Imitation], control: Option<String>) -> String {
    let mut text: String = urls.iter().map(|url| format!("{url}\n")).collect();
    for controller in controllers {
        text += &format!("{:<15} {}\n", controller.id, controller.line());
    }
    text + &control.map(|page| format!("control {page}\n")).unwrap_or_default()
}
