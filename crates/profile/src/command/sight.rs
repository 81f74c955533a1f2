//! What a running command has read: conditions held against it, and the record of what was seen.

use std::time::Duration;

use crate::command::{ArgRef, Arguments, Condition, Evidence, Observed, Seen, Sign, Subject, Test};
use crate::image::Image;
use crate::joined::JoinedValue;
use crate::profile::Profile;
use crate::terms::WordOrder;
use crate::value::Value;

pub(super) struct Sight<'p> {
    pub(super) profile: &'p Profile,
    pub(super) arguments: Arguments,
    pub(super) order: WordOrder,
    /// The present reading alone; cleared before each.
    pub(super) image: Image,
    pub(super) observed: Vec<Observed>,
    /// The model, once a reading told it.
    pub(super) model: Option<&'p str>,
    /// Raw codes just before the last write, for `changes`.
    before: Vec<(Subject, Option<u32>)>,
}

impl<'p> Sight<'p> {
    pub(super) fn new(profile: &'p Profile, arguments: Arguments, order: WordOrder) -> Self {
        let image = Image::new(profile);
        Self { profile, arguments, order, image, observed: Vec::new(), model: None, before: Vec::new() }
    }

    /// Keeps the model that the present reading tells.
    pub(super) fn learn_model(&mut self) {
        let Some(identity) = &self.profile.identity else { return };
        let code = self.code(Subject::Point { point: identity.point, bit: None }, Duration::ZERO);
        let model = code.and_then(|code| self.profile.model(u16::try_from(code).ok()?));
        self.model = model.or(self.model);
    }

    /// The number of an argument after its time has run on by `later`.
    pub(super) fn number(&self, arg: ArgRef, later: Duration) -> Option<u16> {
        self.arguments.number(arg, later)
    }

    /// The raw code that conditions compare; none where it was not read or has no value.
    pub(super) fn code(&self, subject: Subject, later: Duration) -> Option<u32> {
        let (point, bit) = match subject {
            Subject::Point { point, bit } => (point, bit),
            Subject::Arg(arg) => return self.number(arg, later).map(u32::from),
        };
        let registers = self.image.registers(point)?;
        let point = self.profile.points.get(point)?;
        match (point.decode(registers, self.order).value?, bit) {
            (Value::Bits(bits), Some(bit)) => Some(u32::from(bits.contains(bit))),
            _ => point.raw_code(registers, self.order),
        }
    }

    /// Whether a condition holds; none where nobody can tell. Times have run on by `later`.
    pub(super) fn holds(&self, condition: &Condition, later: Duration) -> Option<bool> {
        let code = self.code(condition.subject, later)?;
        Some(match &condition.test {
            Test::Equals(value) => code == *value,
            Test::NotEquals(value) => code != *value,
            Test::Between(range) => range.contains(&code),
            Test::EqualsArg(arg) => code == u32::from(self.number(*arg, later)?),
            Test::Changes => {
                let (_, before) = self.before.iter().find(|(subject, _)| *subject == condition.subject)?;
                code != (*before)?
            }
        })
    }

    /// Whether all conditions hold: false as soon as one does not, none where nobody can tell.
    pub(super) fn all_hold(&self, conditions: &[Condition], later: Duration) -> Option<bool> {
        let mut all = Some(true);
        for condition in conditions {
            match self.holds(condition, later) {
                Some(true) => {}
                Some(false) => return Some(false),
                None => all = None,
            }
        }
        all
    }

    /// Whether a joined clock shows the time of an argument as it runs.
    pub(super) fn clock_agrees(&self, joined: usize, arg: usize, tolerance_s: u16, later: Duration) -> bool {
        let (Some(Seen::Clock(clock)), Some(time)) =
            (self.seen(Sign::Joined(joined)), self.arguments.time(arg))
        else {
            return false;
        };
        // The controller shows whole seconds.
        let tolerance = Duration::from_secs(u64::from(tolerance_s));
        clock.distance(time.plus(Duration::from_secs(later.as_secs()))) <= tolerance
    }

    /// What the present reading says of a sign.
    pub(super) fn seen(&self, sign: Sign) -> Option<Seen> {
        match sign {
            Sign::Point { point, bit } => {
                let registers = self.image.registers(point)?;
                match (self.profile.points.get(point)?.decode(registers, self.order).value?, bit) {
                    (Value::Bits(bits), Some(bit)) => Some(Seen::Bit(bits.contains(bit))),
                    (Value::Number(number), _) => Some(Seen::Number(number)),
                    (Value::Choice { code }, _) => Some(Seen::Code(code)),
                    _ => None,
                }
            }
            Sign::Joined(index) => {
                let joined = self.profile.joined().get(index)?;
                match joined.reading(self.profile, &self.image, self.order)?.value? {
                    JoinedValue::Clock(clock) => Some(Seen::Clock(clock)),
                    JoinedValue::Number(number) => Some(Seen::Number(number)),
                }
            }
            Sign::Device => None,
        }
    }

    /// Keeps the codes that a write may change.
    pub(super) fn remember(&mut self, subjects: impl Iterator<Item = Subject>) {
        self.before.clear();
        for subject in subjects {
            let code = self.code(subject, Duration::ZERO);
            self.before.push((subject, code));
        }
    }

    /// Records what a sign was before the write; what an earlier write met stays.
    pub(super) fn note_before(&mut self, sign: Sign, before: Option<Seen>, now: Duration) {
        if self.observed.iter().all(|observed| observed.sign != sign) {
            self.observed.push(Observed { sign, before, after: None, at: now });
        }
    }

    /// Records what a sign is after the write.
    pub(super) fn note_after(&mut self, sign: Sign, after: Option<Seen>, now: Duration) {
        self.note_before(sign, None, now);
        for observed in self.observed.iter_mut().filter(|observed| observed.sign == sign) {
            observed.after = after;
            observed.at = now;
        }
    }

    /// What is recorded of a sign.
    pub(super) fn record(&self, sign: Sign) -> Option<&Observed> {
        self.observed.iter().find(|observed| observed.sign == sign)
    }
}

/// What a condition looks at, for the record.
pub(super) fn sign_of(subject: Subject) -> Option<Sign> {
    match subject {
        Subject::Point { point, bit } => Some(Sign::Point { point, bit }),
        Subject::Arg(_) => None,
    }
}

/// What a proof looks at.
pub(super) fn sign_of_proof(evidence: &Evidence) -> Option<Sign> {
    match evidence {
        Evidence::Point(condition) => sign_of(condition.subject),
        Evidence::Clock { joined, .. } => Some(Sign::Joined(*joined)),
        Evidence::Device(_) => Some(Sign::Device),
    }
}
