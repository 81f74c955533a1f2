//! How a running command ends: the verdict and the sentences that give the reason.

use std::time::Duration;

use super::{Answer, Phase, Run};
use crate::command::sight::{sign_of, sign_of_proof};
use crate::command::{Condition, Evidence, Hold, ProofStep, Report, Seen, Sign, Verdict, WriteValue, words};

impl Run<'_> {
    /// The hold is over, and it did not come.
    pub(super) fn no_moment(&mut self, now: Duration, hold: &Hold) {
        self.note_all_before(now, &hold.conditions);
        let states = self.states(&hold.conditions);
        let states = if states.is_empty() { states } else { format!(": {states}") };
        self.give_up(now, &format!("the moment for it did not come within {} s{states}", hold.within_s));
    }

    /// The one look after an exception.
    pub(super) fn look_back(&mut self, now: Duration, code: u8) {
        let goals: Vec<_> = self.goals().collect();
        let mut states = Vec::new();
        let mut all = true;
        for goal in &goals {
            all &= self.is_met(goal, now);
            if let Some(sign) = sign_of_proof(&goal.what).filter(|sign| *sign != Sign::Device) {
                let after = self.sight.seen(sign);
                self.sight.note_after(sign, after, now);
                states.extend(after.map(|after| self.state(sign, Some(after))));
            }
        }
        let rest = match (states.is_empty(), all) {
            (true, _) => String::new(),
            (false, false) => format!("; {}", states.join(", ")),
            (false, true) => format!("; {} all the same, which was not this command", states.join(", ")),
        };
        self.refused(now, code, &rest);
    }

    pub(super) fn refused(&mut self, now: Duration, code: u8, rest: &str) {
        let exception = words::exception(self.sight.profile, code);
        let verdict = if self.sent > 1 { Verdict::NoEffect } else { Verdict::Refused };
        let reason = format!("the device refused {} with {exception}{rest}", self.place());
        self.finish(now, verdict, &reason);
    }

    pub(super) fn proved(&mut self, now: Duration, goals: &[&ProofStep]) {
        let mut states = Vec::new();
        for (index, goal) in goals.iter().enumerate() {
            let Some(sign) = sign_of_proof(&goal.what) else { continue };
            let after = self.sight.record(sign).and_then(|record| record.after);
            let mut state = match &goal.what {
                Evidence::Device(_) => "the device fell silent and is back".to_owned(),
                _ => self.state(sign, after),
            };
            if self.proving.held_before.get(index) == Some(&true) {
                state.push_str(" as it was before");
            }
            states.push(state);
        }
        let lost = match self.answer {
            Answer::Lost => format!("the answer to {} was lost, but ", self.place()),
            Answer::Acknowledged => String::new(),
        };
        let reason = format!("{lost}{}{}", states.join(", "), self.gone_on(goals));
        self.finish(now, Verdict::Done, &reason);
    }

    /// The time of a proof is up.
    pub(super) fn too_late(&mut self, now: Duration, goals: &[&ProofStep], goal: &ProofStep) {
        let place = self.place();
        let lost = self.answer == Answer::Lost;
        if self.proving.silent || !self.proving.answered {
            let answer = if lost { "the answer was lost, and " } else { "" };
            let since =
                if self.proving.answered { "does not answer any more" } else { "has not answered since" };
            let reason = format!("{place} was sent; {answer}the device {since}");
            return self.finish(now, Verdict::Unknown, &reason);
        }
        let gone_on = self.gone_on(goals);
        let start = match self.answer {
            _ if self.left_out => "it was so already, but ".to_owned(),
            Answer::Lost => format!("the answer to {place} was lost, and "),
            Answer::Acknowledged => format!("the device acknowledged {place}, but "),
        };
        let within = goal.within_s;
        let Some(sign) = sign_of_proof(&goal.what) else { return };
        if sign == Sign::Device {
            let verdict = if lost { Verdict::Unknown } else { Verdict::NoEffect };
            let reason = format!("{start}the device answered every reading for {within} s{gone_on}");
            return self.finish(now, verdict, &reason);
        }
        let Some(record) = self.sight.record(sign).filter(|record| record.after.is_some()) else {
            let reason = format!("{start}{} could not be read{gone_on}", self.name(sign));
            return self.finish(now, Verdict::Unknown, &reason);
        };
        let (before, after) = (record.before, record.after);
        let is = words::seen(self.sight.profile, self.sight.model, sign, after);
        let name = self.name(sign);
        let what = if matches!(goal.what, Evidence::Clock { .. }) {
            format!("{name} is {is}, not the time that was asked for")
        } else if before == after {
            format!("{name} stayed {is} for {within} s")
        } else if before.is_none() {
            format!("{name} is {is} after {within} s")
        } else {
            let was = words::seen(self.sight.profile, self.sight.model, sign, before);
            let wanted = match &goal.what {
                Evidence::Point(condition) => {
                    let arg = |arg| self.sight.number(arg, self.written);
                    format!(", not {}", words::wanted(self.sight.profile, self.sight.model, condition, arg))
                }
                _ => String::new(),
            };
            format!(
                "{name} went from {was} to {is}{wanted}, within {within} s: somebody at the panel or the controller itself changed it"
            )
        };
        self.finish(now, Verdict::NoEffect, &format!("{start}{what}{gone_on}"));
    }

    /// Steps of the proof that were seen and do not hold any more: somebody at the panel, or the controller itself.
    fn gone_on(&self, goals: &[&ProofStep]) -> String {
        let mut text = String::new();
        for goal in goals.iter().take(self.proving.seen) {
            let Evidence::Point(condition) = &goal.what else { continue };
            let Some(sign) = sign_of(condition.subject) else { continue };
            let now = self.sight.seen(sign);
            if now.is_some() && self.sight.holds(condition, self.written) == Some(false) {
                let wanted = words::wanted(self.sight.profile, self.sight.model, condition, |arg| {
                    self.sight.number(arg, self.written)
                });
                let is = words::seen(self.sight.profile, self.sight.model, sign, now);
                text.push_str(&format!("; {} was {wanted} and is {is} by now", self.name(sign)));
            }
        }
        text
    }

    pub(super) fn already(&mut self, now: Duration, already: &[Condition]) {
        self.note_all_before(now, already);
        let reason = format!("it is so already, and nothing was sent: {}", self.states(already));
        self.finish(now, Verdict::Done, &reason);
    }

    /// A precondition does not hold.
    pub(super) fn not_met(&mut self, now: Duration, condition: &Condition) {
        self.note_all_before(now, std::slice::from_ref(condition));
        let Some(sign) = sign_of(condition.subject) else {
            return self.give_up(now, "it is not the moment for it");
        };
        let later = self.later(now);
        let state = match self.sight.seen(sign) {
            Some(seen) => self.state(sign, Some(seen)),
            None => format!("{} could not be read", self.name(sign)),
        };
        let wanted = words::wanted(self.sight.profile, self.sight.model, condition, |arg| {
            self.sight.number(arg, later)
        });
        self.give_up(now, &format!("{state}, and must be {wanted}"));
    }

    /// The device refused every reading before the first write.
    pub(super) fn foreign(&mut self, now: Duration, code: u8) {
        let profile = self.sight.profile;
        let exception = words::exception(profile, code);
        let why = format!(
            "the device refuses the reading that comes before it with {exception}; check the unit id, and that it is a {}",
            profile.key
        );
        self.give_up(now, &why);
    }

    pub(super) fn unreadable(&mut self, now: Duration, conditions: &[Condition]) {
        let later = self.later(now);
        let unread = conditions.iter().find(|condition| self.sight.holds(condition, later).is_none());
        let name = unread.and_then(|condition| sign_of(condition.subject)).map(|sign| self.name(sign));
        let name = name.unwrap_or_else(|| "the state".to_owned());
        self.give_up(now, &format!("{name} could not be read, and the command depends on it"));
    }

    pub(super) fn no_value(&mut self, now: Duration) {
        let WriteValue::By { point, .. } = self.current().write.value else {
            return self.give_up(now, "an argument is missing");
        };
        let sign = Sign::Point { point, bit: None };
        let seen = self.sight.seen(sign);
        self.sight.note_before(sign, seen, now);
        let reason = match seen {
            Some(_) => format!("{}, for which the manual gives no value to write", self.state(sign, seen)),
            None => format!("{} could not be read, and the value depends on it", self.name(sign)),
        };
        self.give_up(now, &reason);
    }

    /// Ends before the present step was sent.
    pub(super) fn give_up(&mut self, now: Duration, why: &str) {
        let verdict = if self.sent > 0 { Verdict::NoEffect } else { Verdict::Refused };
        let reason = match verdict {
            Verdict::Refused => format!("nothing was sent: {why}"),
            _ => format!("{} was not sent: {why}", self.place()),
        };
        self.finish(now, verdict, &reason);
    }

    pub(super) fn finish(&mut self, now: Duration, verdict: Verdict, reason: &str) {
        self.phase = Phase::Finished;
        self.report = Some(Report {
            verdict,
            reason: words::sentence(reason) + ".",
            sent: self.sent,
            evidence: std::mem::take(&mut self.sight.observed),
            elapsed: self.later(now),
            model: self.sight.model.map(str::to_owned),
        });
    }

    pub(super) fn note_all_before(&mut self, now: Duration, conditions: &[Condition]) {
        for condition in conditions {
            if let Some(sign) = sign_of(condition.subject) {
                let seen = self.sight.seen(sign);
                self.sight.note_before(sign, seen, now);
            }
        }
    }

    pub(super) fn states(&self, conditions: &[Condition]) -> String {
        let signs = conditions.iter().filter_map(|condition| sign_of(condition.subject));
        signs.map(|sign| self.state(sign, self.sight.seen(sign))).collect::<Vec<_>>().join(", ")
    }

    fn state(&self, sign: Sign, seen: Option<Seen>) -> String {
        format!("{} is {}", self.name(sign), words::seen(self.sight.profile, self.sight.model, sign, seen))
    }

    fn name(&self, sign: Sign) -> String {
        words::name(self.sight.profile, sign).into_owned()
    }

    pub(super) fn place(&self) -> String {
        match self.command.steps.len() {
            1 => "the write".to_owned(),
            all => format!("step {} of {all}", self.step + 1),
        }
    }
}
