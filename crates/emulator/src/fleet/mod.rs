//! Several imitated controllers together: their wires, and what joins their plants.
//!
//! A fleet is a TOML file that is checked as a whole before anything starts, or is put together by a program.

mod file;
mod joints;

use busbar_link::Endpoint;
use busbar_profile::Findings;

use crate::config::Config;

pub use joints::Joint;
pub(crate) use joints::{advance, join};

/// Several controllers, to be started by [`start_fleet`](crate::start_fleet).
#[derive(Clone, Debug)]
pub struct Fleet {
    /// What people call it.
    pub title: String,
    /// Where it answers.
    pub wires: Vec<Endpoint>,
    /// The controllers, in the order in which people are shown them.
    pub members: Vec<Member>,
    /// What joins their plants; each plant is joined by one of each kind at most.
    pub joints: Vec<Joint>,
}

/// One controller of a fleet.
#[derive(Clone, Debug)]
pub struct Member {
    /// What programs call it, such as `genset-1`.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// Index of its wire.
    pub wire: usize,
    /// How its levers stand at power-on, by their ids.
    pub levers: Vec<(String, String)>,
    /// The rest of it; it needs no endpoint of its own.
    pub config: Config,
}

impl Fleet {
    /// Reads and checks a fleet file; `file` only serves the findings.
    ///
    /// # Errors
    /// Everything that is wrong with the text, with line, column and remedy.
    pub fn parse(file: &str, text: &str) -> Result<Self, Findings> {
        file::fleet(file, text)
    }
}
