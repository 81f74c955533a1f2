//! The site of the soak: imitated D-500, each on a wire of its own, and a site file that has them all.

use std::error::Error;
use std::path::{Path, PathBuf};

use busbar_emulator::{Config, Emulation};
use busbar_link::{Endpoint, Link, LinkError, Options, Write};

const UNIT: u8 = 1;
const PUSH_BUTTONS: u16 = 8193;
const STOP_BUTTON: u16 = 1;
const AUTO_BUTTON: u16 = 4;

/// Imitated controllers that run.
pub(super) struct Fleet(Vec<Emulation>);

impl Fleet {
    pub(super) async fn start(devices: usize) -> Result<Self, Box<dyn Error>> {
        let mut fleet = Vec::with_capacity(devices);
        for seed in 1..=devices {
            let listen = vec![Endpoint::Tcp { host: "127.0.0.1".to_owned(), port: 0 }];
            let config = Config { listen, seed: seed as u64, ..Config::default() };
            fleet.push(busbar_emulator::start(config).await?);
        }
        Ok(Self(fleet))
    }

    pub(super) fn endpoint(&self, device: usize) -> Result<&Endpoint, Box<dyn Error>> {
        let emulation = self.0.get(device).ok_or("no such device")?;
        Ok(emulation.urls().first().ok_or("a device without a port")?)
    }

    /// Connections that the controllers have seen: each one more than its first is a reconnection.
    pub(super) fn connections(&self) -> u64 {
        self.0.iter().map(|emulation| emulation.statistics().connections).sum()
    }

    /// Writes the site file.
    pub(super) fn write_site(&self, folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
        let mut text = "[site]\nname = \"Soak\"\n".to_owned();
        for device in 0..self.0.len() {
            let endpoint = self.endpoint(device)?;
            text += &format!(
                "[[wires]]\nid = \"w{device}\"\nendpoint = \"{endpoint}\"\n\
                 [[devices]]\nid = \"d{device}\"\nprofile = \"datakom-d\"\nwire = \"w{device}\"\nunit = {UNIT}\n\
                 poll = {{ fast = \"1s\", slow = \"10s\" }}\n"
            );
        }
        let file = folder.join("site.toml");
        std::fs::write(&file, text)?;
        Ok(file)
    }
}

/// A person at one of the controllers, who presses STOP and AUTO in turn.
pub(super) struct Person {
    link: Link,
    stopped: bool,
}

impl Person {
    pub(super) fn new(endpoint: &Endpoint) -> Result<Self, Box<dyn Error>> {
        Ok(Self { link: Link::open(endpoint.clone(), Options::default())?, stopped: false })
    }

    /// The mode changes while this is awaited; gives back the mode that it changes to.
    pub(super) async fn press(&mut self) -> Result<&'static str, LinkError> {
        self.stopped = !self.stopped;
        let (value, mode) = if self.stopped { (STOP_BUTTON, "STOP") } else { (AUTO_BUTTON, "AUTO") };
        self.link.write(UNIT, Write::Register { address: PUSH_BUTTONS, value }).await?;
        Ok(mode)
    }
}
