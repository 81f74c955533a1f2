//! One step of a scenario file: when it is taken, what happens, what is expected; held against the controller.

use std::ops::Range;
use std::time::Duration;

use busbar_profile::command::{Proof, Verdict};
use busbar_profile::text::{in_words, shown};
use busbar_profile::{DateTime, Profile, nearest};
use toml::de::DeTable;

use super::{Action, Expectation, Step, Trigger, parse};
use crate::device::{Device, STEP};
use crate::notes::{Entry, Notes, flat};

/// Keys of a step that are no levers. No plant has a lever of such a name.
pub(super) const KEYS: [&str; 14] = [
    "at", "after", "when", "within", "expect", "inject", "clear", "set", "unset", "settings", "command",
    "args", "verdict", "note",
];
/// Those whose values are tables.
const TABLES: [&str; 3] = ["set", "settings", "args"];
const LONGEST_NOTE: usize = 500;
const VERDICTS: [Verdict; 4] = [Verdict::Done, Verdict::Refused, Verdict::NoEffect, Verdict::Unknown];

/// What the steps are held against, one after the other.
pub(super) struct Stage {
    profile: &'static Profile,
    /// A controller of the scenario's kind, to try things at.
    probe: Device,
    clock: DateTime,
    lasts: Duration,
    /// No step that follows is taken before this time.
    earliest: Duration,
}

/// The keys of a step that are more than an action by themselves.
#[derive(Default)]
struct Keys<'t, 'i> {
    triggers: Vec<Entry<'t, 'i>>,
    within: Option<Entry<'t, 'i>>,
    command: Option<Entry<'t, 'i>>,
    args: Option<Entry<'t, 'i>>,
    verdict: Option<Entry<'t, 'i>>,
    expect: Option<Entry<'t, 'i>>,
}

impl Stage {
    pub(super) fn new(profile: &'static Profile, probe: Device, clock: DateTime, lasts: Duration) -> Self {
        Self { profile, probe, clock, lasts, earliest: Duration::ZERO }
    }

    /// A step, if nothing is wrong with it that would leave none.
    pub(super) fn step(
        &mut self,
        table: &DeTable<'_>,
        span: Range<usize>,
        notes: &mut Notes<'_>,
    ) -> Option<Step> {
        let mut keys = Keys::default();
        let mut actions = Vec::new();
        for entry in flat(table, &TABLES) {
            if notes.is_full() {
                break;
            }
            match entry.key.as_str() {
                "at" | "after" | "when" => keys.triggers.push(entry),
                "within" => keys.within = Some(entry),
                "args" => keys.args = Some(entry),
                "verdict" => keys.verdict = Some(entry),
                "expect" => keys.expect = Some(entry),
                "command" => {
                    // Its arguments may stand behind it.
                    actions.push(None);
                    keys.command = Some(entry);
                }
                _ => actions.extend(self.actions(&entry, notes).into_iter().map(Some)),
            }
        }
        let trigger = self.trigger(&keys, span.clone(), notes);
        let mut order = self.order(&keys, notes);
        let actions =
            actions.into_iter().filter_map(|action| action.or_else(|| order.take())).collect::<Vec<_>>();
        let expectations = match &keys.expect {
            Some(entry) => self.expectations(entry, notes),
            None => Vec::new(),
        };
        let trigger = trigger?;
        let waits = matches!(trigger, Trigger::When { .. });
        if actions.is_empty() && expectations.is_empty() && !waits && notes.is_clean() {
            let help = "add what happens, such as mains = \"failed\", or `expect`";
            notes.add(span.clone(), "nothing happens in this step", help);
        }
        Some(Step { place: notes.place(span.start), trigger, actions, expectations })
    }

    fn trigger(&mut self, keys: &Keys<'_, '_>, span: Range<usize>, notes: &mut Notes<'_>) -> Option<Trigger> {
        let entry = match keys.triggers.as_slice() {
            [] => {
                let help = "add at = \"10s\", after = \"5s\", or when = \"state.engine == loaded\"";
                notes.add(span, "this step is never taken", help);
                return None;
            }
            [entry] => entry,
            [first, second, ..] => {
                let message = format!("`{}` and `{}` in one step", first.key, second.key);
                notes.add(second.span.clone(), message, "leave one of them, or make two steps of it");
                return None;
            }
        };
        if let Some(within) = keys.within.as_ref().filter(|_| entry.key != "when") {
            let message = format!("`within` beside `{}`", entry.key);
            notes.add(within.span.clone(), message, "leave it out: only `when` is waited for");
        }
        match entry.key.as_str() {
            "at" => self.at(entry, notes),
            "after" => {
                let time = notes.duration(entry, Duration::ZERO..=Duration::MAX)?;
                self.earliest = self.earliest.saturating_add(time);
                self.is_in_time(self.earliest, entry.value.span(), notes).then_some(Trigger::After(time))
            }
            _ => self.when(entry, keys.within.as_ref(), notes),
        }
    }

    fn at(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<Trigger> {
        let time = notes.duration(entry, Duration::ZERO..=Duration::MAX)?;
        if !self.is_in_time(time, entry.value.span(), notes) {
            return None;
        }
        if time < self.earliest {
            let message = format!(
                "this step comes at {}, those before it not before {}",
                in_words(time),
                in_words(self.earliest)
            );
            notes.add(
                entry.value.span(),
                message,
                "steps are taken in the order of the file: move it up, or correct the time",
            );
            return None;
        }
        self.earliest = time;
        Some(Trigger::At(time))
    }

    fn when(
        &mut self,
        entry: &Entry<'_, '_>,
        within: Option<&Entry<'_, '_>>,
        notes: &mut Notes<'_>,
    ) -> Option<Trigger> {
        let text = notes.text(entry)?;
        let within = match within {
            Some(within) => {
                let time = notes.duration(within, STEP..=self.lasts)?;
                if !self.is_in_time(self.earliest.saturating_add(time), within.value.span(), notes) {
                    return None;
                }
                Some(time)
            }
            None => None,
        };
        match parse::condition(self.profile, &text) {
            Ok(condition) => Some(Trigger::When { condition, text: one_line(&text), within }),
            Err(mistake) => {
                let span = notes.inside(&entry.value.span(), &text, &mistake.span);
                notes.add(span, mistake.message, mistake.help);
                None
            }
        }
    }

    fn is_in_time(&self, time: Duration, span: Range<usize>, notes: &mut Notes<'_>) -> bool {
        let fits = time <= self.lasts;
        if !fits {
            let message = format!(
                "this comes at {} or later, the scenario lasts {}",
                in_words(time),
                in_words(self.lasts)
            );
            notes.add(span, message, "bring it forward, or give the scenario more time with `lasts`");
        }
        fits
    }

    /// What a key makes happen; a list makes several things happen.
    fn actions(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Action> {
        match entry.key.as_str() {
            "inject" => self.alarms(entry, true, notes),
            "clear" => self.alarms(entry, false, notes),
            "set" => self.pins(entry, notes),
            "unset" => self.unpins(entry, notes),
            "settings" => self.settings(entry, notes),
            "note" => notes.line(entry, LONGEST_NOTE).map(Action::Note).into_iter().collect(),
            _ => self.lever(entry, notes).into_iter().collect(),
        }
    }

    fn lever(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<Action> {
        let Some(lever) = self.probe.levers().iter().find(|lever| lever.id == entry.key) else {
            let (message, help) = self.no_lever(&entry.key);
            notes.add(entry.span.clone(), message, help);
            return None;
        };
        let to = notes.plain(entry)?;
        match lever.position(&to) {
            Ok(position) => Some(Action::Pull { lever: entry.key.clone(), to: position.to_string() }),
            Err(error) => {
                notes.add_error(entry.value.span(), &error);
                None
            }
        }
    }

    /// What to say of a key that is no lever of this plant.
    fn no_lever(&self, key: &str) -> (String, String) {
        let message = format!("the plant of {} has no `{}`", self.profile.key, shown(key));
        let levers: Vec<_> = self.probe.levers().iter().map(|lever| lever.id).collect();
        let help = if let Some(meant) = nearest(key, KEYS.into_iter().chain(levers.iter().copied())) {
            format!("did you mean `{meant}`?")
        } else if self.profile.setting(key).is_some() {
            format!("it is a setting: write settings = {{ {key} = ... }}")
        } else if self.profile.point(key).is_some() {
            format!("it is a point: write set = {{ {key} = ... }} to hold it at a value")
        } else if self.probe.alarms().any(|alarm| alarm.id == key) {
            format!("it is an alarm: write inject = \"{key}\"")
        } else {
            format!("it has {}", levers.join(", "))
        };
        (message, help)
    }

    fn alarms(&mut self, entry: &Entry<'_, '_>, active: bool, notes: &mut Notes<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for (alarm, span) in notes.texts(entry) {
            if notes.is_full() {
                break;
            }
            match self.probe.inject(&alarm, active) {
                Ok(()) => actions.push(Action::Inject { alarm, active }),
                Err(error) => notes.add_error(span, &error),
            }
        }
        actions
    }

    fn pins(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for entry in notes.table(entry).unwrap_or_default() {
            if notes.is_full() {
                break;
            }
            if !self.has_point(&entry.key, entry.span.clone(), notes) {
                continue;
            }
            let Some(value) = notes.plain(&entry) else { continue };
            match self.probe.pin(&entry.key, &value) {
                Ok(()) => actions.push(Action::Pin { point: entry.key, value }),
                Err(error) => {
                    let message = format!("`{}` cannot be `{}`", entry.key, shown(&value));
                    notes.add(entry.value.span(), message, error.problem.to_string());
                }
            }
        }
        actions
    }

    fn unpins(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for (point, span) in notes.texts(entry) {
            if !notes.is_full() && self.has_point(&point, span, notes) {
                actions.push(Action::Unpin { point });
            }
        }
        actions
    }

    fn has_point(&self, id: &str, span: Range<usize>, notes: &mut Notes<'_>) -> bool {
        let has = self.profile.point(id).is_some();
        if !has {
            let ids = self.profile.points.iter().map(|point| point.id.as_str());
            let help = match nearest(id, ids) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("`busbar profile show {}` lists them", self.profile.key),
            };
            notes.add(span, format!("the controller has no point `{}`", shown(id)), help);
        }
        has
    }

    fn settings(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for entry in notes.table(entry).unwrap_or_default() {
            if let Some(value) = notes.setting(&mut self.probe, &entry) {
                actions.push(Action::Set { setting: entry.key, value });
            }
        }
        actions
    }

    fn order(&self, keys: &Keys<'_, '_>, notes: &mut Notes<'_>) -> Option<Action> {
        let Some(entry) = &keys.command else {
            for beside in keys.args.iter().chain(&keys.verdict) {
                let message = format!("`{}` without a command", beside.key);
                notes.add(beside.span.clone(), message, "add the command, or leave it out");
            }
            return None;
        };
        let id = notes.text(entry)?;
        let Some(command) = self.profile.command(&id) else {
            let ids: Vec<_> = self.profile.commands.iter().map(|command| command.id.as_str()).collect();
            let help = match nearest(&id, ids.iter().copied()) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("`busbar profile show {}` lists them", self.profile.key),
            };
            notes.add(entry.value.span(), format!("the controller has no command `{}`", shown(&id)), help);
            return None;
        };
        let mut args = Vec::new();
        for arg in keys.args.as_ref().and_then(|args| notes.table(args)).unwrap_or_default() {
            let value = notes.plain(&arg)?;
            args.push((arg.key, value));
        }
        let given = args.iter().map(|(name, value)| (name.as_str(), value.as_str()));
        if let Err(error) = command.arguments(given, self.clock) {
            notes.add_error(keys.args.as_ref().unwrap_or(entry).value.span(), &error);
            return None;
        }
        let verdict = match &keys.verdict {
            Some(entry) => Some(verdict(entry, notes)?),
            None => None,
        };
        if let (Some(entry), Some(Verdict::Done), Proof::None { .. }) =
            (&keys.verdict, verdict, &command.proof)
        {
            let message = format!("nothing shows that `{id}` was done");
            notes.add(entry.value.span(), message, "leave the verdict out, and say in `expect` what follows");
            return None;
        }
        Some(Action::Order { command, args, verdict, place: notes.place(entry.span.start) })
    }

    fn expectations(&self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Expectation> {
        let mut expectations = Vec::new();
        for (text, span) in notes.texts(entry) {
            if notes.is_full() {
                break;
            }
            match parse::wish(self.profile, &text) {
                Ok(wish) => {
                    let takes =
                        wish.within.unwrap_or_default().saturating_add(wish.lasting.unwrap_or_default());
                    if self.is_in_time(self.earliest.saturating_add(takes), span.clone(), notes) {
                        let text = one_line(&text);
                        expectations.push(Expectation { place: notes.place(span.start), text, wish });
                    }
                }
                Err(mistake) => {
                    let span = notes.inside(&span, &text, &mistake.span);
                    notes.add(span, mistake.message, mistake.help);
                }
            }
        }
        expectations
    }
}

/// A condition as a report tells it.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn verdict(entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<Verdict> {
    let text = notes.text(entry)?;
    let found = VERDICTS.into_iter().find(|verdict| verdict.as_str() == text);
    if found.is_none() {
        let words = VERDICTS.map(Verdict::as_str).join(", ");
        notes.add(
            entry.value.span(),
            format!("there is no verdict `{}`", shown(&text)),
            format!("write one of: {words}"),
        );
    }
    found
}
