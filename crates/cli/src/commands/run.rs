//! `busbar run`: the gateway on a real site.

use std::{net::SocketAddr, path::Path};

use busbar_gateway::{Gateway, Options, Site, StartError};
use serde::Serialize;

use crate::{args, failure::Failure, logging, profiles, runtime, terminal};

/// Where the page is, as `--json` prints it.
#[derive(Serialize)]
struct Served<'a> {
    page: String,
    site: &'a str,
    devices: usize,
}

pub(crate) fn run(args: &args::Run, json: bool) -> Result<(), Failure> {
    logging::start("info,memory_serve=warn")?;
    let site = site(&args.config)?;
    let name = site.name.clone();
    let devices = site.devices.len();
    data(args.data.as_deref());
    runtime::service(async |mut stop| {
        let gateway = gateway(site, args.listen).await?;
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
        stop.wait().await;
        gateway.shutdown().await;
        Ok(())
    })
}

/// Reads and checks the site file.
fn site(path: &Path) -> Result<Site, Failure> {
    let text = profiles::read(path, "site file")?;
    let file = path.display().to_string();
    Site::parse(&file, &text)
        .map_err(|findings| Failure::Findings(Box::new(profiles::excerpts(&file, text, &findings))))
}

pub(super) async fn gateway(site: Site, listen: Option<SocketAddr>) -> Result<Gateway, Failure> {
    busbar_gateway::start(site, Options { listen, ..Options::default() }).await.map_err(|error| match error {
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
