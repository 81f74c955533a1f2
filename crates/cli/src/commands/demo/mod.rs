//! `busbar demo`: a whole site on this machine.

use std::io;
use std::net::SocketAddr;

use busbar_emulator::{
    Emulation, Fleet, StartError,
    control::{Control, may_listen, router},
    start_fleet,
};
use busbar_gateway::{Beside, Site};
use busbar_link::Endpoint;
use jiff::tz::{TimeZone, TimeZoneDatabase};
use serde::Serialize;

use super::{control, emulate, run};
use crate::{args, failure::Failure, logging, runtime, terminal};

/// The folder of the page that the imitation is controlled in.
const IMITATION: &str = "imitation";

/// What is imitated.
const FLEET: &str = include_str!("fleet.toml");

/// The site, with places for what is known once the imitations listen.
const SITE: &str = include_str!("site.toml");

/// Where to look, as `--json` prints it.
#[derive(Serialize)]
struct Shown {
    page: String,
    /// Where the imitation is controlled.
    imitation: Option<String>,
    controllers: Vec<emulate::Imitation>,
}

pub(crate) fn run(args: &args::Demo, json: bool) -> Result<(), Failure> {
    logging::start("warn", logging::Format::Text)?;
    run::data(args.data.as_deref());
    runtime::service(async |mut stop| {
        let fleet = fleet()?;
        let emulation = imitate(fleet.clone()).await.map_err(emulate::failure)?;
        let [tcp, serial] = emulation.urls() else {
            return Err(Failure::Failed("the imitations have no port".to_owned()));
        };
        let site = site(tcp, serial)?;
        let beside = imitation(args.listen.unwrap_or(site.listen), &fleet, &emulation)?;
        let is_controlled = beside.is_some();
        let gateway = run::gateway(site, args.listen, beside.into_iter().collect()).await?;
        let page = run::page(gateway.address());
        let imitation = is_controlled.then(|| format!("{page}{IMITATION}/"));
        let controllers = emulate::imitations(&fleet, &emulation);
        match json {
            true => terminal::print_json(&Shown { page, imitation, controllers })?,
            false => terminal::print(&told(&page, imitation.as_deref(), tcp, &controllers))?,
        }
        stop.wait().await;
        gateway.shutdown().await;
        emulation.stop().await;
        Ok(())
    })
}

/// The imitations, to whom something happens by itself.
fn fleet() -> Result<Fleet, Failure> {
    let mut fleet = Fleet::parse("demonstration", FLEET).map_err(Failure::failed)?;
    for member in &mut fleet.members {
        member.config.story = true;
        member.config.epoch = emulate::today();
    }
    Ok(fleet)
}

/// Starts them on any free port where the usual one is taken.
async fn imitate(mut fleet: Fleet) -> Result<Emulation, StartError> {
    match start_fleet(fleet.clone()).await {
        Err(StartError::Listen {
            kind: io::ErrorKind::AddrInUse | io::ErrorKind::PermissionDenied, ..
        }) => {
            for wire in &mut fleet.wires {
                if let Endpoint::Tcp { port, .. } = wire {
                    *port = 0;
                }
            }
            start_fleet(fleet).await
        }
        started => started,
    }
}

/// The control of the imitations, to be served beside the page. Others than this machine reach it with a token only, and
/// without one they do not need it to look at the site.
fn imitation(listen: SocketAddr, fleet: &Fleet, emulation: &Emulation) -> Result<Option<Beside>, Failure> {
    let token = control::token()?;
    if let Err(error) = may_listen(listen, token.as_ref()) {
        terminal::message(&format!("{error} in {}", control::TOKEN));
        return Ok(None);
    }
    let imitated = control::imitated(fleet, emulation);
    let routes = router(Control { imitated, token, site: Some("../".to_owned()) });
    Ok(Some(Beside { folder: IMITATION.to_owned(), name: "Imitation".to_owned(), routes }))
}

fn told(page: &str, imitation: Option<&str>, tcp: &Endpoint, controllers: &[emulate::Imitation]) -> String {
    let mut text = format!("{}\n  page      {page}\n", terminal::style().title("Busbar demonstration site"));
    if let Some(imitation) = imitation {
        text += &format!("  switches  {imitation}\n");
    }
    for controller in controllers {
        text += &format!("  imitated  {}\n", controller.line());
    }
    // A serial line has one client, and here it is the gateway.
    let by_hand = controllers.iter().find(|controller| controller.endpoint.as_ref() == Some(tcp));
    if let Some(controller) = by_hand {
        text += &format!("  by hand   busbar watch {} --from {tcp}\n", controller.profile);
    }
    text + "\nCtrl-C ends it.\n"
}

/// The site file that a person would write for this.
fn site(tcp: &Endpoint, serial: &Endpoint) -> Result<Site, Failure> {
    // In a container or on a machine without a clock of its own the zone may not be known.
    let zone = TimeZone::try_system().ok();
    let zone = zone.as_ref().and_then(TimeZone::iana_name).filter(|name| is_known(name));
    let text = SITE
        .replace("{time_zone}", &zone.map(|name| format!("time_zone = \"{name}\"")).unwrap_or_default())
        .replace("{network}", &tcp.to_string())
        .replace("{line}", &serial.to_string());
    Site::parse("demonstration", &text).map_err(Failure::failed)
}

/// Whether a site file takes that zone: a machine may have names of its own.
fn is_known(zone: &str) -> bool {
    TimeZoneDatabase::bundled().get(zone).is_ok_and(|zone| !zone.is_unknown())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_site_has_what_is_imitated_and_draws_all_of_it() {
        let fleet = fleet().unwrap_or_else(|failure| panic!("{failure:?}"));
        let line = fleet.wires[1].to_string().replace("pty", "/dev/pts/9").parse().unwrap();
        let wires = [fleet.wires[0].clone(), line];
        let site = site(&wires[0], &wires[1]).unwrap_or_else(|failure| panic!("{failure:?}"));
        assert!(site.warnings.is_empty(), "{:?}", site.warnings);
        let imitated: Vec<_> = fleet
            .members
            .iter()
            .map(|member| {
                let (config, wire) = (&member.config, &wires[member.wire]);
                let (id, name, key) = (member.id.as_str(), member.name.as_str(), config.profile.as_str());
                (id, name, key, config.model.as_deref(), config.unit, wire)
            })
            .collect();
        let polled: Vec<_> = site
            .devices
            .iter()
            .map(|device| {
                let endpoint = &site.wires[device.wire].endpoint;
                (
                    device.id.as_str(),
                    device.name.as_str(),
                    device.profile.key.as_str(),
                    device.model.as_deref(),
                    device.unit,
                    endpoint,
                )
            })
            .collect();
        assert_eq!(polled, imitated);
        for device in &site.devices {
            let is_drawn = site.diagram.nodes.iter().any(|node| node.device.as_ref() == Some(&device.id));
            assert!(is_drawn, "{}", device.id);
        }
    }

    #[test]
    fn a_zone_of_this_machine_alone_is_left_out() {
        assert!(is_known("Europe/Berlin"));
        assert!(!is_known("Etc/Unknown") && !is_known("Local/Here"));
    }
}
