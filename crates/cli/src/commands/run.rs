//! `busbar run`: the gateway on a real site.

use std::{net::SocketAddr, path::Path, time::Duration};

use busbar_gateway::{Beside, Gateway, Options, Site, StartError};
use serde::Serialize;
use tokio::{
    select,
    time::{Interval, MissedTickBehavior, interval},
};

use crate::{
    args,
    failure::Failure,
    logging,
    manager::Manager,
    profiles,
    runtime::{self, Reloads, Stop},
    terminal,
};

/// How often it is looked at how the devices fare.
const LOOK: Duration = Duration::from_secs(1);

/// Where the page is, as `--json` prints it.
#[derive(Serialize)]
struct Served<'a> {
    page: String,
    site: &'a str,
    devices: usize,
}

pub(crate) fn run(args: &args::Run, json: bool) -> Result<(), Failure> {
    logging::start("info,memory_serve=warn", args.log)?;
    let mut site = site(args)?;
    let unknown = trace(&mut site, &args.trace);
    if let Some(wire) = unknown.first() {
        let known: Vec<&str> = site.wires.iter().map(|wire| wire.id.as_str()).collect();
        return Err(Failure::Call(format!(
            "there is no wire \"{wire}\" to trace; the site has {}",
            known.join(", ")
        )));
    }
    let name = site.name.clone();
    let devices = site.devices.len();
    data(args.data.as_deref());
    runtime::service(async |stop| {
        let reloads = Reloads::listen()?;
        let gateway = gateway(site, args.listen, Vec::new()).await?;
        let page = page(gateway.address());
        if json {
            terminal::print_json(&Served { page, site: &name, devices })?;
        } else {
            let style = terminal::style();
            terminal::print(&format!(
                "{}\n  page     {page}\n  devices  {devices}\n\nCtrl-C ends it.\n",
                style.title(&name)
            ))?;
        }
        attend(gateway, args, stop, reloads).await;
        Ok(())
    })
}

/// Does what signals ask for, and tells the service manager, until it is time to stop.
async fn attend(mut gateway: Gateway, args: &args::Run, mut stop: Stop, mut reloads: Reloads) {
    let mut manager = Manager::new();
    manager.ready();
    let mut looks = every(LOOK);
    let mut beats = manager.beat().map(every);
    loop {
        select! {
            () = stop.wait() => break,
            () = reloads.wait() => {
                manager.reloading();
                reload(&mut gateway, args);
                manager.ready();
            }
            _ = looks.tick() => manager.status(gateway.tally()),
            () = tick(&mut beats) => manager.lives(gateway.heartbeat()),
        }
    }
    manager.stopping();
    tracing::info!("stopping; another signal ends it at once");
    select! {
        biased;
        () = gateway.shutdown() => tracing::info!("stopped"),
        () = stop.wait() => tracing::warn!("ended at once, as a second signal asked for"),
    }
}

/// Reads the site file again. One that is wrong changes nothing.
fn reload(gateway: &mut Gateway, args: &args::Run) {
    let done = site(args).and_then(|mut site| {
        for wire in trace(&mut site, &args.trace) {
            tracing::warn!(wire, "the site has no such wire any more, so its frames cannot be logged");
        }
        gateway.reload(site).map_err(Failure::failed)
    });
    let Err(failure) = done else { return };
    let wrong = failure.sentences();
    for sentence in &wrong {
        tracing::error!("{sentence}");
    }
    tracing::error!("the site file was refused; the one before it goes on");
    let reason = match wrong.as_slice() {
        [first] => first.clone(),
        [first, rest @ ..] => format!("{first} (and {} more, which the log has)", rest.len()),
        [] => "it cannot be used".to_owned(),
    };
    gateway.refuse(reason);
}

fn every(period: Duration) -> Interval {
    let mut interval = interval(period);
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    interval
}

/// The next beat; never where there is none.
async fn tick(beats: &mut Option<Interval>) {
    match beats {
        Some(beats) => {
            beats.tick().await;
        }
        None => std::future::pending().await,
    }
}

/// Reads and checks the site file. Where to listen the command line knows better.
fn site(args: &args::Run) -> Result<Site, Failure> {
    let text = profiles::read(&args.config, "site file")?;
    let file = args.config.display().to_string();
    let mut site = Site::parse(&file, &text)
        .map_err(|findings| Failure::Findings(Box::new(profiles::excerpts(&file, text, &findings))))?;
    site.listen = args.listen.unwrap_or(site.listen);
    Ok(site)
}

/// Asks for the frames of these wires too, and gives back those that the site does not have.
fn trace<'a>(site: &mut Site, wires: &'a [String]) -> Vec<&'a str> {
    let mut unknown = Vec::new();
    for id in wires {
        match site.wires.iter_mut().find(|wire| wire.id == *id) {
            Some(wire) => wire.trace = true,
            None => unknown.push(id.as_str()),
        }
    }
    unknown
}

pub(super) async fn gateway(
    site: Site,
    listen: Option<SocketAddr>,
    beside: Vec<Beside>,
) -> Result<Gateway, Failure> {
    let options = Options { listen, beside, ..Options::default() };
    busbar_gateway::start(site, options).await.map_err(|error| match error {
        StartError::AddressInUse { .. } => Failure::Failed(format!("{error} (--listen ADDR:PORT)")),
        _ => Failure::failed(error),
    })
}

/// The page's address for a browser on this machine.
pub(super) fn page(mut address: SocketAddr) -> String {
    if address.ip().is_unspecified() {
        address.set_ip(if address.is_ipv4() {
            [127, 0, 0, 1].into()
        } else {
            std::net::Ipv6Addr::LOCALHOST.into()
        });
    }
    format!("http://{address}/")
}

/// Nothing outlives a restart yet.
pub(super) fn data(folder: Option<&Path>) {
    if let Some(folder) = folder {
        terminal::message(&format!("nothing is kept yet, so {} is left as it is", folder.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_can_be_opened_on_this_machine() {
        for (address, expected) in [
            ("127.0.0.1:8080", "http://127.0.0.1:8080/"),
            ("0.0.0.0:80", "http://127.0.0.1:80/"),
            ("[::]:8080", "http://[::1]:8080/"),
            ("192.0.2.7:8080", "http://192.0.2.7:8080/"),
        ] {
            assert_eq!(page(address.parse().unwrap()), expected);
        }
    }
}
