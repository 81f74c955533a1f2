//! The service: polling, live state, alarms, the HTTP API and the page.
//!
//! [`Site::parse`] reads and checks a site file; [`start`] polls its devices and serves what they say.
//!
//! The way of a reading: `poller` asks the wire by `schedule` and `poll_plan`; a finished round goes into `device`,
//! which keeps registers, values, quality and `alarms` and says what changed; `hub` holds all devices and tells the
//! readers of `events`. Everything that decides is pure and takes the time as an argument; only `poller`, `events`,
//! `server` and `gateway` wait for anything. `running` is what of a site runs, `table` what the API sees of it.

mod alarms;
pub mod api;
mod device;
mod events;
mod failure;
mod gateway;
mod health;
mod hub;
mod joined;
mod looks;
mod metrics;
mod page;
mod patience;
mod poll_plan;
mod poller;
mod rates;
mod running;
mod schedule;
mod server;
mod site;
mod stop;
mod table;
#[cfg(test)]
mod testing;
mod wires;

pub use crate::api::openapi;
pub use crate::gateway::{Beside, Gateway, Options, StartError, start};
pub use crate::server::Limits;
pub use crate::site::{
    Connection, DEFAULT_LISTEN, Diagram, Nameplate, Node, NodeKind, Poll, Site, SiteDevice, SiteWire,
};
pub use crate::table::Tally;
