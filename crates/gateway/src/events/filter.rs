//! What a reader asks for: which devices, and which of their points.

use std::collections::HashSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use axum::http::StatusCode;
use busbar_profile::{Profile, Rate};

use super::event::{About, Event, Frame};
use crate::api::{EventsQuery, Problem};
use crate::looks::Look;
use crate::rates::Rates;
use crate::table::{Slot, Table};

/// Most groups that a sentence names.
const MOST_NAMED: usize = 40;

/// What the query says. Ids that a later site file does not have any more are passed over.
#[derive(Debug, Default)]
pub(super) struct Wish {
    devices: Option<HashSet<String>>,
    groups: Option<HashSet<String>>,
    signals: Option<HashSet<String>>,
}

impl Wish {
    /// Checks a query against the devices there are.
    pub(super) fn new(query: &EventsQuery, table: &Table) -> Result<Self, Problem> {
        let ids = |list: &Option<String>| {
            list.as_ref().map(|list| list.split(',').map(str::to_owned).collect::<HashSet<_>>())
        };
        let wish =
            Self { devices: ids(&query.device), groups: ids(&query.group), signals: ids(&query.signal) };
        wish.check_devices(query, table)?;
        wish.check_groups(query, table)?;
        Ok(wish)
    }

    fn check_devices(&self, query: &EventsQuery, table: &Table) -> Result<(), Problem> {
        let known: HashSet<&str> = table.devices.iter().map(|slot| slot.id.as_str()).collect();
        let mut asked = query.device.iter().flat_map(|list| list.split(','));
        match asked.find(|id| !known.contains(id)) {
            Some(unknown) => table.device(unknown).map(|_| ()),
            None => Ok(()),
        }
    }

    fn check_groups(&self, query: &EventsQuery, table: &Table) -> Result<(), Problem> {
        if self.groups.is_none() {
            return Ok(());
        }
        let mut known = Vec::new();
        for profile in profiles(self.slots(table)) {
            for group in &profile.groups {
                if !known.contains(&group.id.as_str()) {
                    known.push(&group.id);
                }
            }
        }
        let mut asked = query.group.iter().flat_map(|list| list.split(','));
        let Some(unknown) = asked.find(|id| !known.contains(id)) else { return Ok(()) };
        known.truncate(MOST_NAMED);
        let detail =
            format!("no device that is asked for has a group {unknown}; they have {}", known.join(", "));
        Err(Problem::new(StatusCode::BAD_REQUEST, detail))
    }

    /// The devices asked for, in the order of the site file.
    pub(super) fn slots<'a>(&self, table: &'a Table) -> impl Iterator<Item = &'a Arc<Slot>> {
        table
            .devices
            .iter()
            .filter(|slot| self.devices.as_ref().is_none_or(|devices| devices.contains(&slot.id)))
    }

    /// What it comes to with these devices; begins to look at what is read on demand.
    pub(super) fn view(&self, table: &Table, choices: &Choices) -> View {
        let keys = self.devices.is_some().then(|| self.slots(table).map(|slot| slot.key).collect());
        if self.groups.is_none() && self.signals.is_none() {
            return View { keys, wanted: None, looks: Vec::new() };
        }
        let wanted = profiles(self.slots(table))
            .into_iter()
            .map(|profile| choices.only_one(Wanted::new(profile, |group| self.names(group), &self.signals)))
            .collect();
        let looks = self.slots(table).filter_map(|slot| self.look(slot)).collect();
        View { keys, wanted: Some(wanted), looks }
    }

    fn names(&self, group: &str) -> bool {
        self.groups.as_ref().is_some_and(|groups| groups.contains(group))
    }

    /// Looks at the groups that are named and have something to be read on demand.
    fn look(&self, slot: &Slot) -> Option<Look> {
        let profile = slot.lock().device.site().profile;
        let on_demand = |index: &usize| profile.points[*index].rate == Rate::OnDemand;
        let groups: Vec<usize> = (0..profile.groups.len())
            .filter(|group| self.names(&profile.groups[*group].id))
            .filter(|group| profile.groups[*group].points.iter().any(on_demand))
            .collect();
        (!groups.is_empty()).then(|| slot.looks.look(&groups))
    }
}

/// The profiles of devices, each once.
fn profiles<'a>(slots: impl Iterator<Item = &'a Arc<Slot>>) -> Vec<&'static Profile> {
    let mut profiles: Vec<&'static Profile> = Vec::new();
    for slot in slots {
        let profile = slot.lock().device.site().profile;
        if !profiles.iter().any(|known| std::ptr::eq(*known, profile)) {
            profiles.push(profile);
        }
    }
    profiles
}

/// A wish, worked out for the devices there are.
#[derive(Debug)]
pub(super) struct View {
    /// Keys of the devices; none for all of them.
    keys: Option<HashSet<u64>>,
    /// What of each profile; none for everything.
    wanted: Option<Vec<Arc<Wanted>>>,
    /// Ends with the reader.
    #[expect(dead_code, reason = "is dropped")]
    looks: Vec<Look>,
}

impl View {
    /// What of an event is wanted; none where nothing is.
    pub(super) fn of(&self, event: &Event) -> Option<Frame> {
        if let About::Device { key, .. } = event.about
            && self.keys.as_ref().is_some_and(|keys| !keys.contains(&key))
        {
            return None;
        }
        match (event.profile(), &self.wanted) {
            (Some(profile), Some(_)) => event.choice(self.wanted(profile)?),
            _ => Some(event.frame().clone()),
        }
    }

    /// Whether a point is wanted.
    pub(super) fn has_point(&self, profile: &'static Profile, index: usize) -> bool {
        self.wanted.is_none() || self.wanted(profile).is_some_and(|wanted| wanted.has_point(index))
    }

    /// Whether a joined signal is wanted.
    pub(super) fn has_joined(&self, profile: &'static Profile, index: usize) -> bool {
        self.wanted.is_none() || self.wanted(profile).is_some_and(|wanted| wanted.has_joined(index))
    }

    fn wanted(&self, profile: &'static Profile) -> Option<&Arc<Wanted>> {
        self.wanted.as_ref()?.iter().find(|wanted| std::ptr::eq(wanted.profile, profile))
    }
}

/// What is wanted of the devices of one profile.
#[derive(Debug)]
pub(super) struct Wanted {
    /// Told apart by it; what is the same has the same one.
    pub(super) id: u64,
    profile: &'static Profile,
    /// By index in the profile.
    points: Vec<bool>,
    /// By index in the profile's joined signals.
    joined: Vec<bool>,
    /// Rates that something wanted is read at.
    rates: Rates,
}

impl Wanted {
    fn new(
        profile: &'static Profile,
        names: impl Fn(&str) -> bool,
        signals: &Option<HashSet<String>>,
    ) -> Self {
        static IDS: AtomicU64 = AtomicU64::new(0);
        let carries = |signal: &str| signals.as_ref().is_some_and(|signals| signals.contains(signal));
        let groups: Vec<bool> = profile.groups.iter().map(|group| names(&group.id)).collect();
        let points: Vec<bool> = profile
            .points
            .iter()
            .map(|point| {
                let bits = point.bits.iter().filter_map(|bit| bit.signal.as_deref());
                point.access.is_readable()
                    && (groups[point.group] || point.signal.as_deref().into_iter().chain(bits).any(carries))
            })
            .collect();
        let joined: Vec<bool> = profile
            .joined()
            .iter()
            .map(|joined| {
                carries(&joined.signal) || joined.points().any(|index| groups[profile.points[index].group])
            })
            .collect();
        let read = profile.points.iter().enumerate().filter(|(index, _)| points[*index]);
        let made = profile.joined().iter().zip(&joined).filter(|(_, wanted)| **wanted);
        let rates = read
            .map(|(_, point)| point.rate)
            .chain(made.map(|(joined, _)| crate::joined::rate(profile, joined)))
            .collect();
        Self { id: IDS.fetch_add(1, Ordering::Relaxed), profile, points, joined, rates }
    }

    pub(super) fn has_point(&self, index: usize) -> bool {
        self.points.get(index).copied().unwrap_or(false)
    }

    pub(super) fn has_joined(&self, index: usize) -> bool {
        self.joined.get(index).copied().unwrap_or(false)
    }

    pub(super) fn has_rate(&self, rate: Rate) -> bool {
        self.rates.contains(rate)
    }
}

/// What all readers want: those who want the same share it, and with it the work.
#[derive(Debug, Default)]
pub(super) struct Choices(Mutex<Vec<Weak<Wanted>>>);

impl Choices {
    fn only_one(&self, wanted: Wanted) -> Arc<Wanted> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|known| known.strong_count() > 0);
        let same = |other: &Arc<Wanted>| {
            std::ptr::eq(other.profile, wanted.profile)
                && (&other.points, &other.joined) == (&wanted.points, &wanted.joined)
        };
        if let Some(same) = known.iter().filter_map(Weak::upgrade).find(same) {
            return same;
        }
        let wanted = Arc::new(wanted);
        known.push(Arc::downgrade(&wanted));
        wanted
    }
}
