//! Plays a scenario on a device, one step of its clock after the other. Pure: the device's time is all there is.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_profile::DateTime;
use busbar_profile::text::in_words;

use super::condition::Condition;
use super::expectation::Watch;
use super::narrator::Narrator;
use super::order::Order;
use super::report::Seen;
use super::{Action, Check, CheckVerdict, Event, EventKind, Report, Scenario, Step, Trigger};
use crate::device::{Device, STEP};
use crate::notes::Place;

/// A scenario under way.
#[derive(Debug)]
pub(crate) struct Player {
    steps: VecDeque<Step>,
    clock: DateTime,
    lasts: Duration,
    /// When the step before was taken; the start before that.
    since: Duration,
    watches: Vec<Watch>,
    orders: Vec<Order>,
    narrator: Option<Narrator>,
    report: Report,
}

impl Player {
    /// A scenario on a controller of this model, before its first moment; that is when [`Player::go_on`] is called first.
    pub(crate) fn new(scenario: &Scenario, model: &str, seed: u64) -> Self {
        Self {
            steps: scenario.steps.iter().cloned().collect(),
            clock: scenario.clock,
            lasts: scenario.lasts,
            since: Duration::ZERO,
            watches: Vec::new(),
            orders: Vec::new(),
            narrator: None,
            report: Report {
                file: scenario.file.clone(),
                title: scenario.title.clone(),
                controller: scenario.controller().to_owned(),
                model: model.to_owned(),
                seed,
                steps: scenario.steps.len(),
                ..Report::default()
            },
        }
    }

    pub(crate) fn report(&self) -> &Report {
        &self.report
    }

    /// Lets happen what is due, and judges what was expected: once for each step of the device's clock.
    pub(crate) fn go_on(&mut self, device: &mut Device) {
        if self.report.is_over() {
            return;
        }
        let now = device.time();
        self.report.lasted = now;
        self.narrate(now, device);
        self.judge(now, device);
        self.go_on_with_orders(now, device);
        self.take_steps(now, device);
        if self.steps.is_empty() && self.watches.is_empty() && self.orders.is_empty() {
            self.report.conclude();
        } else if now >= self.lasts {
            self.run_out(now, device);
        }
    }

    fn narrate(&mut self, now: Duration, device: &Device) {
        let changes = self.narrator.get_or_insert_with(|| Narrator::new(device)).changes(device);
        for change in changes {
            self.tell(now, EventKind::Change, None, change);
        }
    }

    fn judge(&mut self, now: Duration, device: &Device) {
        for mut watch in std::mem::take(&mut self.watches) {
            match watch.judge(now, device) {
                Some(held) => self.decide(&watch, held, now, device),
                None => self.watches.push(watch),
            }
        }
    }

    fn decide(&mut self, watch: &Watch, held: bool, now: Duration, device: &Device) {
        let expectation = &watch.expectation;
        let expected = expectation.text.clone();
        let seen = seen(&expectation.wish.condition, device);
        self.check(expectation.place, expected, (watch.since, now), held, (seen, None));
    }

    fn go_on_with_orders(&mut self, now: Duration, device: &mut Device) {
        for mut order in std::mem::take(&mut self.orders) {
            let Some(outcome) = order.go_on(now, device) else {
                self.orders.push(order);
                continue;
            };
            let expected = format!("of the command {} {}", order.command.id, order.wish());
            let reason =
                format!("the verdict was {}: {}", outcome.verdict, outcome.reason.trim_end_matches('.'));
            let held = order.is_met(outcome.verdict);
            self.check(order.place, expected, (order.since, now), held, (Vec::new(), Some(reason)));
        }
    }

    fn take_steps(&mut self, now: Duration, device: &mut Device) {
        while let Some(step) = self.steps.front() {
            match self.due(step, now, device) {
                Due::Later => return,
                Due::Never(miss) => return self.give_up(miss, now),
                Due::Now => {}
            }
            if let Some(step) = self.steps.pop_front() {
                self.take(step, now, device);
            }
        }
    }

    fn due(&self, step: &Step, now: Duration, device: &Device) -> Due {
        let (condition, text, within) = match &step.trigger {
            Trigger::At(time) if now >= *time + STEP => {
                let reason = "its time was past when its turn came".to_owned();
                let expected = format!("this step at {}", in_words(*time));
                return Due::Never(Miss { expected, seen: Vec::new(), reason: Some(reason) });
            }
            Trigger::At(time) if now >= *time => return Due::Now,
            Trigger::After(time) if now >= self.since + *time => return Due::Now,
            Trigger::At(_) | Trigger::After(_) => return Due::Later,
            Trigger::When { condition, text, within } => (condition, text, within),
        };
        // What the step before did shows from the clock's next step on.
        if (now > self.since || now.is_zero()) && condition.holds(device) {
            return Due::Now;
        }
        match within {
            Some(within) if now >= self.since + *within => {
                let expected = format!("{text} within {}", in_words(*within));
                Due::Never(Miss { expected, seen: seen(condition, device), reason: None })
            }
            _ => Due::Later,
        }
    }

    fn take(&mut self, step: Step, now: Duration, device: &mut Device) {
        let since = std::mem::replace(&mut self.since, now);
        self.report.taken += 1;
        match &step.trigger {
            Trigger::When { condition, text, within: Some(within) } => {
                let expected = format!("{text} within {}", in_words(*within));
                self.check(step.place, expected, (since, now), true, (seen(condition, device), None));
            }
            Trigger::When { text, .. } => self.tell(now, EventKind::Held, Some(step.place), text.clone()),
            Trigger::At(_) | Trigger::After(_) => {}
        }
        // What is expected at once is seen before anything is done.
        for expectation in step.expectations {
            let mut watch = Watch::new(expectation, now);
            match watch.is_immediate().then(|| watch.judge(now, device)).flatten() {
                Some(held) => self.decide(&watch, held, now, device),
                None => self.watches.push(watch),
            }
        }
        for action in step.actions {
            self.act(action, step.place, now, device);
        }
    }

    fn act(&mut self, action: Action, place: Place, now: Duration, device: &mut Device) {
        let (text, done) = match action {
            Action::Pull { lever, to } => (format!("{lever} = {to}"), failed(device.pull(&lever, &to))),
            Action::Inject { alarm, active } => {
                let verb = if active { "inject" } else { "clear" };
                (format!("{verb} {alarm}"), failed(device.inject(&alarm, active)))
            }
            Action::Pin { point, value } => {
                (format!("set {point} = {value}"), failed(device.pin(&point, &value)))
            }
            Action::Unpin { point } => {
                device.unpin(&point);
                (format!("unset {point}"), None)
            }
            Action::Set { setting, value } => {
                (format!("setting {setting} = {value}"), failed(device.set(&setting, &value)))
            }
            Action::Note(text) => return self.tell(now, EventKind::Note, Some(place), text),
            Action::Order { command, args, verdict, place } => {
                let given = args.iter().map(|(name, value)| (name.as_str(), value.as_str()));
                let arguments = command.arguments(given, self.clock.plus(now));
                let words: Vec<_> = args.iter().map(|(name, value)| format!(" {name}={value}")).collect();
                let text = format!("command {}{}", command.id, words.concat());
                let arguments = arguments.map(|arguments| {
                    let order = Order::new(device.profile(), command, arguments, verdict, (place, now));
                    self.orders.push(order);
                });
                (text, failed(arguments))
            }
        };
        self.tell(now, EventKind::Action, Some(place), text.clone());
        // The file was checked, so this is a fault of ours; it must not pass for something that happened.
        if let Some(reason) = done {
            self.check(place, text, (now, now), false, (Vec::new(), Some(reason)));
        }
    }

    /// The next step can no longer be taken, nor any after it. What is under way goes on.
    fn give_up(&mut self, miss: Miss, now: Duration) {
        if let Some(step) = self.steps.front() {
            let place = step.place;
            self.check(place, miss.expected, (self.since, now), false, (miss.seen, miss.reason));
        }
        self.steps.clear();
    }

    /// The time of the scenario is up: whatever has not come will not.
    fn run_out(&mut self, now: Duration, device: &Device) {
        let up = || Some(format!("the scenario's time of {} was up", in_words(self.lasts)));
        let reason = up();
        for watch in std::mem::take(&mut self.watches) {
            let seen = seen(&watch.expectation.wish.condition, device);
            let expected = watch.expectation.text.clone();
            self.check(watch.expectation.place, expected, (watch.since, now), false, (seen, reason.clone()));
        }
        for order in std::mem::take(&mut self.orders) {
            let expected = format!("of the command {} {}", order.command.id, order.wish());
            self.check(order.place, expected, (order.since, now), false, (Vec::new(), reason.clone()));
        }
        if let Some(Step { place, trigger, .. }) = self.steps.pop_front() {
            let (expected, seen) = match &trigger {
                Trigger::When { condition, text, .. } => (text.clone(), seen(condition, device)),
                _ => ("this step".to_owned(), Vec::new()),
            };
            self.check(place, expected, (self.since, now), false, (seen, reason));
        }
        self.report.conclude();
    }

    fn check(
        &mut self,
        Place { line, column }: Place,
        expected: String,
        (since, decided): (Duration, Duration),
        held: bool,
        (seen, reason): (Vec<Seen>, Option<String>),
    ) {
        let (verdict, kind) = match held {
            true => (CheckVerdict::Held, EventKind::Held),
            false => (CheckVerdict::Failed, EventKind::Failed),
        };
        let text = match (&reason, held) {
            (Some(reason), false) => format!("{expected}: {reason}"),
            _ => expected.clone(),
        };
        self.tell(decided, kind, Some(Place { line, column }), text);
        self.report.checks.push(Check { line, column, expected, since, decided, verdict, seen, reason });
    }

    fn tell(&mut self, at: Duration, kind: EventKind, place: Option<Place>, text: String) {
        self.report.events.push(Event { at, kind, line: place.map(|place| place.line), text });
    }
}

/// Whether a step is to be taken.
enum Due {
    Now,
    Later,
    Never(Miss),
}

/// Why a step is never taken.
struct Miss {
    expected: String,
    seen: Vec<Seen>,
    reason: Option<String>,
}

fn seen(condition: &Condition, device: &Device) -> Vec<Seen> {
    condition.seen(device).into_iter().map(|(name, value)| Seen { name, value }).collect()
}

fn failed<E: ToString>(result: Result<(), E>) -> Option<String> {
    result.err().map(|error| error.to_string())
}
