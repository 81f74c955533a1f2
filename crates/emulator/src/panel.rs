//! What every imitated controller has in common: it lives, takes writes and fills its registers.

use std::fmt::Debug;
use std::time::Duration;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::plant::{Plant, Supply};
use crate::rules::Refusals;
use crate::settings::Settings;

/// One controller family, with the plant that it controls.
pub(crate) trait Panel: Debug + Send {
    /// Lets `dt` of simulated time pass.
    fn step(&mut self, dt: Duration);

    /// Takes a write to a register that the profile says is writable. Values that mean nothing have no effect.
    fn write(&mut self, address: u16, value: u16);

    /// Takes a write to a coil that the profile lists. For families without coils there is nothing to take.
    fn write_coil(&mut self, _address: u16, _on: bool) {}

    /// Whether the controller is restarting: it then hears and answers nothing.
    fn is_silent(&self) -> bool;

    /// Stores every documented register.
    fn render(&self, bank: &mut Bank);

    /// A packet has come in over Ethernet; most families do not count them.
    fn count_packet(&mut self, _bank: &mut Bank) {}

    /// The maker's exception codes.
    fn refusals(&self) -> Refusals;

    /// Takes timers, thresholds and attempts: at power-on, and again whenever one of them was set.
    fn configure(&mut self, _settings: &Settings) {}

    /// What can be made to happen here, in the order in which people are shown it.
    fn levers(&self) -> &'static [Lever] {
        &[]
    }

    /// Where one of its levers stands.
    fn lever(&self, _id: &str) -> Option<Position> {
        None
    }

    /// Pulls one of its levers to a position that it has.
    fn pull(&mut self, _id: &str, _to: Position) {}

    /// The plant of a genset, for what it is joined to.
    fn genset(&mut self) -> Option<&mut Plant> {
        None
    }

    /// What a bus section of its switchgear gives to whatever hangs on it; sections count from 0.
    fn section(&self, _section: usize) -> Option<Supply> {
        None
    }

    /// Takes an alarm for active, whatever the plant says, or no longer. False where that alarm follows from others.
    fn inject(&mut self, _point: &str, _bit: u16, _active: bool) -> bool {
        false
    }
}
