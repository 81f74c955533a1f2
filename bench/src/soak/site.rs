//! The site of the soak: imitated D-500, each on a wire of its own, and a site file that has them all.

use std::path::{Path, PathBuf};
use std::time::Duration;

use busbar_emulator::{Config, Emulation};
use busbar_link::{Endpoint, Link, LinkError, Options, Write};

use super::Failure;

const UNIT: u8 = 1;
const PUSH_BUTTONS: u16 = 8193;
const STOP: u16 = 1;
const AUTO: u16 = 4;

/// Imitated controllers that run.
pub(super) struct Fleet(Vec<Emulation>);

impl Fleet {
    pub(super) async fn start(devices: usize) -> Result<Self, Failure> {
        let mut fleet = Vec::with_capacity(devices);
        for seed in 1..=devices {
            let listen = vec![Endpoint::Tcp { host: "127.0.0.1".to_owned(), port: 0 }];
            let config = Config { listen, seed: seed as u64, ..Config::default() };
            fleet.push(busbar_emulator::start(config).await?);
        }
        Ok(Self(fleet))
    }

    pub(super) fn endpoint(&self, device: usize) -> Result<&Endpoint, Failure> {
        let emulation = self.0.get(device).ok_or("no such device")?;
        Ok(emulation.urls().first().ok_or("a device without a port")?)
    }

    /// Writes the site file.
    pub(super) fn write_site(&self, folder: &Path) -> Result<PathBuf, Failure> {
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
    pub(super) fn new(endpoint: &Endpoint) -> Result<Self, Failure> {
        // The machine may be busy; it is not what is judged.
        let patience = Duration::from_secs(20);
        let options = Options { timeout: patience, connect_timeout: patience, ..Options::default() };
        Ok(Self { link: Link::open(endpoint.clone(), options)?, stopped: false })
    }

    /// The mode that the next press changes to, as its register has it.
    pub(super) fn next_mode(&self) -> u16 {
        if self.stopped { AUTO } else { STOP }
    }

    /// The mode changes while this is awaited.
    pub(super) async fn press(&mut self) -> Result<(), LinkError> {
        // The button of a mode has the mode's own number.
        let value = self.next_mode();
        self.stopped = !self.stopped;
        self.link.write(UNIT, Write::Register { address: PUSH_BUTTONS, value }).await
    }
}
