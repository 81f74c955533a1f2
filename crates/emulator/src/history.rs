//! What happened at a controller lately: what was done to it, and what a person at the panel would have seen of that.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_profile::Profile;
use busbar_profile::command::WriteValue;

use crate::device::Device;
use crate::scenario::{Event, EventKind, Narrator};

/// So many events are kept.
const KEPT: usize = 200;
/// How often somebody looks, in simulated time: what comes and goes between is not seen.
const LOOK: Duration = Duration::from_secs(1);

/// The latest events, the newest first.
#[derive(Debug)]
pub(crate) struct History {
    narrator: Narrator,
    events: VecDeque<Event>,
}

impl History {
    /// One that begins now: what stands now is known and not told.
    pub(crate) fn new(device: &Device) -> Self {
        Self { narrator: Narrator::new(device), events: VecDeque::new() }
    }

    /// Whether it is time to look.
    pub(crate) fn is_due(time: Duration) -> bool {
        time.as_millis().is_multiple_of(LOOK.as_millis())
    }

    /// Notes what a person at the panel sees now and did not see before.
    pub(crate) fn look(&mut self, device: &Device) {
        for change in self.narrator.changes(device) {
            self.note(device.time(), EventKind::Change, change);
        }
    }

    /// Notes what was done.
    pub(crate) fn act(&mut self, at: Duration, what: String) {
        self.note(at, EventKind::Action, what);
    }

    pub(crate) fn events(&self) -> impl Iterator<Item = &Event> {
        self.events.iter()
    }

    fn note(&mut self, at: Duration, kind: EventKind, text: String) {
        self.events.truncate(KEPT - 1);
        self.events.push_front(Event { at, kind, line: None, text });
    }
}

/// What a client wrote, by the name of the command where the profile has one like it.
pub(crate) fn written(profile: &Profile, address: u16, value: u16) -> String {
    let is_it = |write: &busbar_profile::command::Write| match write.value {
        WriteValue::Fixed(fixed) if write.arg.is_none() => write.address == address && fixed == value,
        _ => false,
    };
    let known = profile.commands.iter().find(|command| command.steps.iter().any(|step| is_it(&step.write)));
    match known {
        Some(command) => format!("Client: {}", command.name),
        None => format!("Client: {value} written to {address}"),
    }
}
