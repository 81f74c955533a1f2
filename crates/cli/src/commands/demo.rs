//! `busbar demo`: a whole site on this machine.

use std::io;
use std::net::SocketAddr;

use busbar_emulator::{
    Config, Emulation, StartError,
    control::{Control, Imitated, may_listen, router},
};
use busbar_gateway::{Beside, Site};
use busbar_link::Endpoint;
use jiff::tz::{TimeZone, TimeZoneDatabase};
use serde::Serialize;

use super::{control, emulate, run};
use crate::{args, failure::Failure, logging, runtime, terminal};

/// Easy to remember for a person's own Modbus tools; any free port when it is taken.
const USUAL_PORT: u16 = 1502;

/// The serial line of the site: one wire, three units.
const LINE: &str = "rtu://pty?baud=9600&parity=none&stop=1";

/// The folder of the page that the imitation is controlled in.
const IMITATION: &str = "imitation";

/// The site, with places for what is known once the imitations listen.
const SITE: &str = include_str!("demo.toml");

/// One controller of the site, as it is imitated.
struct Member {
    id: &'static str,
    /// What the site calls it.
    name: &'static str,
    key: &'static str,
    model: &'static str,
    unit: u8,
    /// The maker's name with the model, for people.
    title: &'static str,
}

const GENSET: Member = Member {
    id: "genset-1",
    name: "Genset 1",
    key: "datakom-d",
    model: "D-500",
    unit: 1,
    title: "Datakom D-500",
};

const ON_THE_LINE: [Member; 3] = [
    Member {
        id: "genset-2",
        name: "Genset 2",
        key: "datakom-dkg705",
        model: "DKG-705",
        unit: 1,
        title: "Datakom DKG-705",
    },
    Member {
        id: "switch-1",
        name: "Transfer switch",
        key: "smartgen-hat821si",
        model: "HAT821SI",
        unit: 2,
        title: "SmartGen HAT821SI",
    },
    Member {
        id: "compressor-1",
        name: "Compressor",
        key: "smartgen-acc1700",
        model: "ACC1700CAN",
        unit: 3,
        title: "SmartGen ACC1700CAN",
    },
];

/// Where to look, as `--json` prints it.
#[derive(Serialize)]
struct Shown<'a> {
    page: String,
    /// Where the imitation is controlled.
    imitation: Option<String>,
    controllers: Vec<Controller<'a>>,
}

#[derive(Serialize)]
struct Controller<'a> {
    id: &'a str,
    profile: &'a str,
    model: &'a str,
    endpoint: &'a Endpoint,
    unit: u8,
}

pub(crate) fn run(args: &args::Demo, json: bool) -> Result<(), Failure> {
    logging::start("warn", logging::Format::Text)?;
    run::data(args.data.as_deref());
    runtime::service(async |mut stop| {
        let genset = over_tcp().await.map_err(emulate::failure)?;
        let line = on_one_line().await.map_err(emulate::failure)?;
        let (Some(tcp), Some(serial)) = (genset.urls().first(), line.urls().first()) else {
            return Err(Failure::Failed("the imitations have no port".to_owned()));
        };
        let site = site(tcp, serial)?;
        let beside = imitation(args.listen.unwrap_or(site.listen), &genset, &line)?;
        let is_controlled = beside.is_some();
        let gateway = run::gateway(site, args.listen, beside.into_iter().collect()).await?;
        let page = run::page(gateway.address());
        let imitation = is_controlled.then(|| format!("{page}{IMITATION}/"));
        match json {
            true => terminal::print_json(&shown(page, imitation, tcp, serial))?,
            false => terminal::print(&told(&page, imitation.as_deref(), tcp, serial))?,
        }
        stop.wait().await;
        gateway.shutdown().await;
        genset.stop().await;
        line.stop().await;
        Ok(())
    })
}

async fn over_tcp() -> Result<Emulation, StartError> {
    let listen = |port| vec![Endpoint::Tcp { host: "127.0.0.1".to_owned(), port }];
    let config = |port| Config { listen: listen(port), ..imitated(&GENSET) };
    match busbar_emulator::start(config(USUAL_PORT)).await {
        Err(StartError::Listen {
            kind: io::ErrorKind::AddrInUse | io::ErrorKind::PermissionDenied, ..
        }) => busbar_emulator::start(config(0)).await,
        started => started,
    }
}

async fn on_one_line() -> Result<Emulation, StartError> {
    let line = LINE.parse().map_err(|_| StartError::NoEndpoint)?;
    busbar_emulator::start_together(ON_THE_LINE.iter().map(imitated).collect(), vec![line]).await
}

fn imitated(member: &Member) -> Config {
    Config {
        profile: member.key.to_owned(),
        unit: member.unit,
        model: Some(member.model.to_owned()),
        story: true,
        epoch: emulate::today(),
        ..Config::default()
    }
}

/// The control of the imitations, to be served beside the page. Others than this machine reach it with a token only, and
/// without one they do not need it to look at the site.
fn imitation(listen: SocketAddr, genset: &Emulation, line: &Emulation) -> Result<Option<Beside>, Failure> {
    let token = control::token()?;
    if let Err(error) = may_listen(listen, token.as_ref()) {
        terminal::message(&format!("{error} in {}", control::TOKEN));
        return Ok(None);
    }
    let ids = std::iter::once(&GENSET).chain(&ON_THE_LINE);
    let controllers = genset.controllers().iter().chain(line.controllers());
    let imitated = ids.zip(controllers).map(|(member, controller)| Imitated {
        id: member.id.to_owned(),
        name: member.name.to_owned(),
        controller: controller.clone(),
    });
    let routes = router(Control { imitated: imitated.collect(), token, site: Some("../".to_owned()) });
    Ok(Some(Beside { folder: IMITATION.to_owned(), name: "Imitation".to_owned(), routes }))
}

/// Each controller and where it answers.
fn members<'a>(
    tcp: &'a Endpoint,
    serial: &'a Endpoint,
) -> impl Iterator<Item = (&'static Member, &'a Endpoint)> {
    std::iter::once((&GENSET, tcp)).chain(ON_THE_LINE.iter().map(move |member| (member, serial)))
}

fn shown<'a>(page: String, imitation: Option<String>, tcp: &'a Endpoint, serial: &'a Endpoint) -> Shown<'a> {
    let controllers = members(tcp, serial).map(|(member, endpoint)| Controller {
        id: member.id,
        profile: member.key,
        model: member.model,
        endpoint,
        unit: member.unit,
    });
    Shown { page, imitation, controllers: controllers.collect() }
}

fn told(page: &str, imitation: Option<&str>, tcp: &Endpoint, serial: &Endpoint) -> String {
    let mut text = format!("{}\n  page      {page}\n", terminal::style().title("Busbar demonstration site"));
    if let Some(imitation) = imitation {
        text += &format!("  switches  {imitation}\n");
    }
    for (member, endpoint) in members(tcp, serial) {
        let Member { title, unit, .. } = member;
        text += &format!("  imitated  {title:<21}{endpoint}, unit {unit}\n");
    }
    // A serial line has one client, and here it is the gateway.
    text += &format!("  by hand   busbar watch {} --from {tcp}\n\nCtrl-C ends it.\n", GENSET.key);
    text
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
        let (tcp, serial) = ("tcp://127.0.0.1:1502".parse().unwrap(), LINE.replace("pty", "/dev/pts/9"));
        let serial = serial.parse().unwrap();
        let site = site(&tcp, &serial).unwrap_or_else(|failure| panic!("{failure:?}"));
        assert!(site.warnings.is_empty(), "{:?}", site.warnings);
        let imitated: Vec<_> = members(&tcp, &serial)
            .map(|(member, endpoint)| {
                (member.id, member.name, member.key, Some(member.model), member.unit, endpoint)
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
