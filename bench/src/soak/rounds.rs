//! What the event stream tells of the polling: a finished round of each device for each second, and how late a change
//! that was made at a known instant is told.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use serde::Deserialize;

use super::Failure;

/// How often every device is polled.
const EVERY: f64 = 1.0;

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

/// The rounds of one device.
struct Seen {
    first: Timestamp,
    last: Timestamp,
    rounds: u64,
}

/// Follows the rounds of every device.
#[derive(Default)]
pub(super) struct Rounds {
    seen: HashMap<String, Seen>,
    /// Whole states that were sent: the first, and one for each time that this reader fell behind.
    pub(super) snapshots: u64,
    /// Changes that are still to be told: by device the mode, and when it was made.
    awaited: HashMap<String, (u16, Instant)>,
    delays: Vec<Duration>,
}

impl Rounds {
    /// Begins to count anew.
    pub(super) fn begin(&mut self) {
        self.seen.clear();
        self.delays.clear();
    }

    /// Devices that have had a round.
    pub(super) fn devices(&self) -> usize {
        self.seen.len()
    }

    /// Rounds that were finished.
    pub(super) fn finished(&self) -> u64 {
        self.seen.values().map(|seen| seen.rounds).sum()
    }

    /// Rounds that should have been finished by now and were not, of so many devices.
    pub(super) fn missed(&self, devices: usize, began: Timestamp, now: Timestamp) -> u64 {
        let beats = |from: Timestamp, to: Timestamp| (to.duration_since(from).as_secs_f64() / EVERY).max(0.0);
        let silent = devices.saturating_sub(self.seen.len()) as u64 * beats(began, now).round() as u64;
        let each = self.seen.values().map(|seen| {
            let between = (beats(seen.first, seen.last).round() as u64 + 1).saturating_sub(seen.rounds);
            // A round may take most of its second; the one that is under way is not missed yet.
            let late = |beats: f64| beats.floor().max(1.0) as u64 - 1;
            between + late(beats(began, seen.first)) + late(beats(seen.last, now))
        });
        silent + each.sum::<u64>()
    }

    /// Takes in an event.
    pub(super) fn event(&mut self, name: &str, data: &str, came: Instant) -> Result<(), Failure> {
        match name {
            "snapshot" => self.snapshots += 1,
            "values" => self.values(&serde_json::from_str(data)?, came),
            _ => {}
        }
        Ok(())
    }

    fn values(&mut self, values: &Values<'_>, came: Instant) {
        for value in &values.changed {
            let awaited = self.awaited.get(values.device).filter(|_| value.id == "unit_mode");
            if let Some((_, made)) = awaited.filter(|(mode, _)| value.code == Some(*mode)) {
                self.delays.push(came.saturating_duration_since(*made));
                self.awaited.remove(values.device);
            }
        }
        if values.rate == "fast" {
            let ts = values.ts;
            match self.seen.get_mut(values.device) {
                Some(seen) => (seen.last, seen.rounds) = (ts, seen.rounds + 1),
                None => {
                    self.seen.insert(values.device.to_owned(), Seen { first: ts, last: ts, rounds: 1 });
                }
            }
        }
    }

    /// A change is about to be made.
    pub(super) fn await_mode(&mut self, device: String, mode: u16, made: Instant) {
        self.awaited.insert(device, (mode, made));
    }

    /// Changes that were not told yet.
    pub(super) fn untold(&self) -> usize {
        self.awaited.len()
    }

    /// How long each change took to be told, the quickest first.
    pub(super) fn delays(&self) -> Vec<Duration> {
        let mut delays = self.delays.clone();
        delays.sort_unstable();
        delays
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: i64) -> Timestamp {
        Timestamp::from_millisecond(1_800_000_000_000 + millis).unwrap()
    }

    fn seen(rounds: &[(&str, i64)]) -> Rounds {
        let mut seen = Rounds::default();
        for (device, millis) in rounds {
            let data = format!(
                r#"{{"device":"{device}","rate":"fast","ts":"{}","changed":[],"joined":[]}}"#,
                at(*millis)
            );
            seen.event("values", &data, Instant::now()).unwrap();
        }
        seen
    }

    #[test]
    fn a_round_that_comes_late_is_not_missed_and_one_that_never_comes_is() {
        let late = [("a", 300), ("a", 1_300), ("a", 2_900), ("a", 3_300), ("a", 4_300)];
        assert_eq!(seen(&late).missed(1, at(0), at(5_000)), 0);
        assert_eq!(seen(&late).finished(), 5);
        let gap = [("a", 300), ("a", 1_300), ("a", 3_300), ("a", 4_300)];
        assert_eq!(seen(&gap).missed(1, at(0), at(5_000)), 1);
        assert_eq!(seen(&gap[..2]).missed(1, at(0), at(5_000)), 2, "after it the device is silent");
        assert_eq!(seen(&late).missed(2, at(0), at(5_000)), 5, "the other was never there");
        assert_eq!(seen(&late[3..]).missed(1, at(0), at(5_000)), 2, "it began late");
    }

    #[test]
    fn a_change_is_told_when_its_own_value_comes() {
        let mut rounds = Rounds::default();
        let made = Instant::now();
        rounds.await_mode("a".to_owned(), 4, made);
        let mut told = |device: &str, code: u16, millis| {
            let data = format!(
                r#"{{"device":"{device}","rate":"slow","ts":"{}","changed":[{{"id":"unit_mode","value":"x","code":{code}}},{{"id":"b","value":[1]}}]}}"#,
                at(0)
            );
            rounds.event("values", &data, made + Duration::from_millis(millis)).unwrap();
            (rounds.untold(), rounds.delays())
        };
        assert_eq!(told("b", 4, 10), (1, vec![]));
        assert_eq!(told("a", 1, 20), (1, vec![]));
        assert_eq!(told("a", 4, 30), (0, vec![Duration::from_millis(30)]));
        assert_eq!(told("a", 4, 40), (0, vec![Duration::from_millis(30)]));
        assert_eq!(rounds.finished(), 0);
    }
}
