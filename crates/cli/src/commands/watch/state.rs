//! What is known of the points under watch: when each is due, what it was last, and how far that can be trusted.
//!
//! Pure: the wire and the clock are the caller's.

use std::time::Duration;

use busbar_profile::{
    Point, Profile, Quality, Rate, Reading, WordOrder, no_reading,
    plan::{Cost, Planner},
    reading,
};
use jiff::{SignedDuration, Timestamp};

use super::super::read::with_identity;
use crate::{harvest::Harvest, profiles};

/// From one reading of a slow point to the next.
const SLOW: Duration = Duration::from_secs(10);
/// A value is stale after so many times the time in which another should have come.
const PATIENCE: u32 = 3;

/// All points under watch.
pub(super) struct State<'p> {
    profile: &'p Profile,
    order: WordOrder,
    planner: Option<Planner>,
    cost: Cost,
    /// In address order.
    points: Vec<usize>,
    /// The points, and what else their labels depend on.
    entries: Vec<Entry>,
    /// Whether every point is read in every round.
    named: bool,
    /// A value that is older than this is stale.
    old: SignedDuration,
    /// Why the device did not answer the last round.
    reason: Option<String>,
    rounds: u64,
}

/// One point.
#[derive(Clone, Debug, Default)]
struct Entry {
    index: usize,
    raw: Option<Vec<u16>>,
    read_at: Option<Timestamp>,
    /// By the caller's clock.
    asked: Option<Duration>,
    asked_at: Option<Timestamp>,
    error: Option<String>,
    /// Whether the last round brought another value.
    changed: bool,
}

/// What a person sees of a point.
pub(super) struct Seen<'a> {
    pub(super) point: &'a Point,
    pub(super) reading: Reading<'a>,
    /// When it was read; when it was asked for, where it was never read.
    pub(super) at: Timestamp,
    pub(super) age: Option<SignedDuration>,
    pub(super) changed: bool,
}

impl Seen<'_> {
    /// What is to be said of the value beside it.
    pub(super) fn note(&self) -> &'static str {
        match self.reading.quality {
            Quality::Stale => "stale",
            Quality::Bad => "bad",
            Quality::Invalid => "invalid",
            Quality::Good => "",
        }
    }
}

impl<'p> State<'p> {
    /// The points that were named, each due in every round; or all that are worth polling, each at its own rate.
    pub(super) fn new(
        profile: &'p Profile,
        named: Option<Vec<usize>>,
        cost: Cost,
        order: WordOrder,
        every: Duration,
    ) -> Self {
        let is_named = named.is_some();
        let points = named.unwrap_or_else(|| {
            let polled = |point: &Point| point.access.is_readable() && point.rate != Rate::OnDemand;
            (0..profile.points.len()).filter(|index| polled(&profile.points[*index])).collect()
        });
        let mut indexes = with_identity(profile, &points);
        indexes.sort_unstable();
        indexes.dedup();
        let entries = indexes.into_iter().map(|index| Entry { index, ..Entry::default() }).collect();
        Self {
            profile,
            order,
            planner: Some(Planner::new(profile, cost)),
            cost,
            points,
            entries,
            named: is_named,
            old: SignedDuration::try_from(PATIENCE * every.max(SLOW)).unwrap_or(SignedDuration::MAX),
            reason: None,
            rounds: 0,
        }
    }

    /// The points to read in a round that begins at `now`.
    pub(super) fn due(&self, now: Duration) -> Vec<usize> {
        let due = |entry: &&Entry| {
            let rate = match self.points.binary_search(&entry.index) {
                Ok(_) if self.named => Rate::Fast,
                Ok(_) => self.profile.points[entry.index].rate,
                Err(_) => Rate::Once,
            };
            match (rate, entry.asked) {
                (_, None) => true,
                // What a silent device did not tell is asked for again.
                _ if entry.raw.is_none() && self.reason.is_some() => true,
                (Rate::Once, _) => false,
                (Rate::Slow, Some(asked)) => now >= asked + SLOW,
                _ => true,
            }
        };
        self.entries.iter().filter(due).map(|entry| entry.index).collect()
    }

    /// The reads for these points, by a plan that remembers what the device refused.
    pub(super) fn harvest(&mut self, points: &[usize]) -> Harvest<'p> {
        let planner = self.planner.take().unwrap_or_else(|| Planner::new(self.profile, self.cost));
        Harvest::new(self.profile, planner, points)
    }

    /// Takes over what a round at `now` brought, and returns the points whose value or quality it changed.
    pub(super) fn take(&mut self, points: &[usize], harvest: Harvest<'p>, now: Duration) -> Vec<usize> {
        let silent = harvest.answers() == 0;
        let mut changed = Vec::new();
        self.rounds += 1;
        self.reason = None;
        for entry in &mut self.entries {
            entry.changed = false;
            if points.binary_search(&entry.index).is_err() {
                continue;
            }
            let last = harvest.last(entry.index);
            let at = last.map_or_else(Timestamp::now, |done| done.at);
            let first = entry.asked.is_none();
            entry.asked = Some(now);
            entry.asked_at = Some(at);
            let had_error = entry.error.is_some();
            match harvest.registers(entry.index) {
                Some(registers) => {
                    let point = &self.profile.points[entry.index];
                    let decoded = point.decode(registers, self.order);
                    let before = entry.raw.as_ref().map(|raw| point.decode(raw, self.order));
                    entry.changed = before.as_ref().is_some_and(|before| *before != decoded);
                    entry.raw = Some(registers.to_vec());
                    entry.read_at = Some(at);
                    entry.error = None;
                }
                None => {
                    entry.error = Some(last.and_then(|done| done.error.clone()).unwrap_or_default());
                    // A device that is silent may be back with the same value; one that refuses has none.
                    if !silent {
                        entry.raw = None;
                    }
                }
            }
            if first || entry.changed || had_error != entry.error.is_some() {
                changed.push(entry.index);
            }
        }
        if silent {
            self.reason = self.entries.iter().find_map(|entry| entry.error.clone());
        }
        self.planner = Some(harvest.into_planner());
        changed.retain(|index| self.points.binary_search(index).is_ok());
        changed
    }

    /// What is known of a point under watch.
    pub(super) fn seen(&self, index: usize, now: Timestamp) -> Option<Seen<'_>> {
        let entry = &self.entries[self.entries.binary_search_by_key(&index, |entry| entry.index).ok()?];
        let point = &self.profile.points[index];
        let age = entry.read_at.map(|at| now.duration_since(at).max(SignedDuration::ZERO));
        let reading = match &entry.raw {
            Some(raw) => {
                let mut reading = reading(point, &point.decode(raw, self.order), raw, self.model());
                let once = !self.named && point.rate == Rate::Once;
                let old = age.is_some_and(|age| age > self.old) && !once;
                if reading.quality == Quality::Good && (entry.error.is_some() || old) {
                    reading.quality = Quality::Stale;
                }
                reading
            }
            None => no_reading(point, Quality::Bad),
        };
        let at = entry.read_at.filter(|_| entry.raw.is_some()).or(entry.asked_at)?;
        Some(Seen { point, reading, at, age: age.filter(|_| entry.raw.is_some()), changed: entry.changed })
    }

    /// All points under watch, in address order.
    pub(super) fn points(&self) -> &[usize] {
        &self.points
    }

    /// Those of these points that are under watch, without what only a label needs.
    pub(super) fn watched(&self, points: &[usize]) -> Vec<usize> {
        points.iter().copied().filter(|index| self.points.binary_search(index).is_ok()).collect()
    }

    pub(super) fn profile(&self) -> &'p Profile {
        self.profile
    }

    /// Why the device did not answer the last round.
    pub(super) fn reason(&self) -> Option<&str> {
        self.reason.as_deref()
    }

    /// Rounds that are over.
    pub(super) fn rounds(&self) -> u64 {
        self.rounds
    }

    /// The model, as far as it is known.
    fn model(&self) -> Option<&'p str> {
        let identity = self.profile.identity.as_ref()?.point;
        let at = self.entries.binary_search_by_key(&identity, |entry| entry.index).ok()?;
        profiles::model(self.profile, |_| self.entries[at].raw.as_deref())
    }

    /// The model, as far as it is known by now or by this harvest.
    pub(super) fn model_in(&self, harvest: &Harvest<'_>) -> Option<&'p str> {
        let identity = self.profile.identity.as_ref()?.point;
        profiles::model(self.profile, |_| harvest.registers(identity)).or_else(|| self.model())
    }
}
