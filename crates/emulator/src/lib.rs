//! Imitated controllers: a small plant that obeys physics, a panel with its logic, and the wire rules of the manual.
//!
//! From the inside out:
//! - the plant (mains, genset, load, tank) is stepped by a simulated clock and a seed;
//! - a panel reads it, drives it, and stores every documented register through the profile;
//! - levers and injected alarms make things happen, as the grid, wear or a person would;
//! - a [`Scenario`] tells what happens, one thing after the other, and what is expected;
//! - [`Device`] puts the wire rules in front: requests in, responses out, no I/O;
//! - [`start`] gives a device sockets, serial lines and a clock; [`start_together`] puts several on one wire.

mod bank;
mod config;
pub mod control;
mod datakom_d;
mod datakom_dkg705;
mod device;
mod error;
mod facts;
mod faults;
mod fleet;
mod history;
mod inject;
mod lcd;
mod levers;
mod notes;
mod panel;
mod pins;
mod plant;
mod random;
mod rules;
mod scenario;
mod server;
mod settings;
mod smartgen_acc1700;
mod smartgen_hat821si;
mod waveform;

pub use config::Config;
pub use device::{Device, STEP};
pub use error::{PinError, PinProblem, StartError};
pub use facts::{Fact, FactError, FactKind, Subject};
pub use faults::Faults;
pub use fleet::{Fleet, Joint, Member};
pub use inject::{Alarm, InjectError};
pub use levers::{Lever, LeverError, Numbers, Position, Word};
pub use scenario::{Check, CheckVerdict, Event, EventKind, Report, Scenario, Seen};
pub use server::{Controller, Emulation, Pace, SpeedError, Statistics, start, start_fleet, start_together};
pub use settings::SettingError;

/// The fastest simulated clock: an hour a second.
pub const MAX_SPEED: f64 = 3600.0;
