//! What the event stream tells of the polling: a finished round of each device for each second, and how late a change
//! that was made at a known instant is told.

use std::collections::HashMap;
use std::error::Error;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use serde::Deserialize;

/// A `values` event, as far as it is of use here.
#[derive(Deserialize)]
struct Values<'a> {
    device: &'a str,
    rate: &'a str,
    ts: Timestamp,
    #[serde(borrow)]
    changed: Vec<Value<'a>>,
}

#[derive(Deserialize)]
struct Value<'a> {
    id: &'a str,
    code: Option<u16>,
}

/// Follows the rounds of every device.
pub(super) struct Rounds {
    every: Duration,
    last: HashMap<String, Timestamp>,
    /// Rounds that were finished.
    pub(super) finished: u64,
    /// Rounds that should have been there between two that were.
    pub(super) missed: u64,
    /// Changes that are still to be told: by device the mode, and when it was made.
    awaited: HashMap<String, (u16, Instant)>,
    delays: Vec<Duration>,
}

impl Rounds {
    pub(super) fn new(every: Duration) -> Self {
        Self {
            every,
            last: HashMap::new(),
            finished: 0,
            missed: 0,
            awaited: HashMap::new(),
            delays: Vec::new(),
        }
    }

    /// Begins to count anew, with what is known of each device.
    pub(super) fn begin(&mut self) {
        (self.finished, self.missed) = (0, 0);
        self.delays.clear();
    }

    /// Devices that have had a round.
    pub(super) fn devices(&self) -> usize {
        self.last.len()
    }

    /// Takes in a `values` event.
    pub(super) fn values(&mut self, data: &str, came: Instant) -> Result<(), Box<dyn Error + Send + Sync>> {
        let values: Values = serde_json::from_str(data)?;
        for value in &values.changed {
            let awaited = self.awaited.get(values.device).filter(|_| value.id == "unit_mode");
            if let Some((_, made)) = awaited.filter(|(mode, _)| value.code == Some(*mode)) {
                self.delays.push(came.saturating_duration_since(*made));
                self.awaited.remove(values.device);
            }
        }
        if values.rate != "fast" {
            return Ok(());
        }
        self.finished += 1;
        let Some(last) = self.last.insert(values.device.to_owned(), values.ts) else { return Ok(()) };
        let apart = Duration::try_from(values.ts.duration_since(last)).unwrap_or_default();
        let beats = (apart.as_secs_f64() / self.every.as_secs_f64()).round() as u64;
        self.missed += beats.saturating_sub(1);
        Ok(())
    }

    /// A change is about to be made.
    pub(super) fn await_mode(&mut self, device: String, mode: u16, made: Instant) {
        self.awaited.insert(device, (mode, made));
    }

    /// Changes that were never told.
    pub(super) fn untold(&self) -> usize {
        self.awaited.len()
    }

    /// The share of changes that were told within what is returned; none when there were no changes.
    pub(super) fn delay(&mut self, share: f64) -> Option<Duration> {
        self.delays.sort_unstable();
        let last = self.delays.len().checked_sub(1)?;
        self.delays.get((share * last as f64).round() as usize).copied()
    }
}
