//! Who answers in the place of a device. What is asked is a few short reads that no other family answers; what comes
//! back is judged here. No wire and no clock.

use std::collections::VecDeque;

use busbar_profile::plan::Read;
use busbar_profile::signature::{Signature, signature};
use busbar_profile::{Profile, WordOrder, builtins};

use crate::api::types::{Identity, NameplateView};
use crate::failure::Failure;
use crate::site::{Nameplate, SiteDevice};

/// What the site file expects of a device beside its profile.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Expected {
    /// The model that it has to be.
    pub(crate) model: Option<String>,
    /// The mode that it should be in.
    pub(crate) desired_mode: Option<String>,
    /// What stands on the machine.
    pub(crate) nameplate: NameplateView,
}

impl Expected {
    pub(crate) fn of(site: &SiteDevice) -> Self {
        let Nameplate { power_kw, tank_l, battery_v } = site.nameplate;
        Self {
            model: site.model.clone(),
            desired_mode: site.desired_mode.clone(),
            nameplate: NameplateView { power_kw, tank_l, battery_v },
        }
    }
}

/// Who answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Known {
    pub(crate) verdict: Identity,
    /// How that is known.
    pub(crate) detail: String,
    /// The model that it says it is.
    pub(crate) model: Option<&'static str>,
}

impl Known {
    pub(crate) fn is_wrong(&self) -> bool {
        self.verdict == Identity::Wrong
    }
}

/// What came of asking.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    Known(Known),
    /// It answers, but neither yes nor no.
    Unclear(Failure),
    /// It does not answer.
    Silent(Failure),
}

/// A read that tells something about who answers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Question {
    pub(crate) read: Read,
    /// Whose register it is.
    pub(crate) of: &'static Profile,
}

/// The questions to a device and what its answers come to.
#[derive(Debug)]
pub(crate) struct Check {
    profile: &'static Profile,
    word_order: WordOrder,
    wanted: Option<String>,
    signature: Signature,
    asking: Asking,
    /// What is still to be asked of this part, the next one first.
    waiting: VecDeque<Read>,
    /// Why one of the first reads did not come.
    doubt: Option<(Read, Failure)>,
    before: Option<Known>,
    finding: Option<Finding>,
}

#[derive(Debug)]
enum Asking {
    First,
    Second,
    /// It is another device: which of the other profiles fit it, and the one it is asked for now.
    Others {
        left: VecDeque<&'static Profile>,
        now: Option<&'static Profile>,
        fit: Vec<&'static Profile>,
        refused: (Read, Failure),
    },
}

impl Check {
    /// `before` is the other device that was found in its place, so that the other profiles are not asked for again.
    pub(crate) fn new(site: &SiteDevice, expected: &Expected, before: Option<Known>) -> Self {
        let signature = signature(site.profile, builtins());
        let nothing = || Known {
            verdict: Identity::Plausible,
            detail: "its profile has nothing that could be asked".to_owned(),
            model: None,
        };
        Self {
            profile: site.profile,
            word_order: site.word_order,
            wanted: expected.model.clone(),
            waiting: signature.first.iter().copied().collect(),
            asking: Asking::First,
            doubt: None,
            before,
            finding: signature.first.is_empty().then(|| Finding::Known(nothing())),
            signature,
        }
    }

    /// What to ask next; none when the finding is there.
    pub(crate) fn next(&self) -> Option<Question> {
        if self.finding.is_some() {
            return None;
        }
        let of = match &self.asking {
            Asking::Others { now, .. } => (*now)?,
            _ => self.profile,
        };
        Some(Question { read: *self.waiting.front()?, of })
    }

    /// What it came to; none while there is something to ask.
    pub(crate) fn finding(self) -> Option<Finding> {
        self.finding
    }

    /// The answer to the last question.
    pub(crate) fn take(&mut self, answer: Result<Vec<u16>, Failure>) {
        let Some(read) = self.waiting.pop_front() else { return };
        match self.asking {
            Asking::First => self.first(read, answer),
            Asking::Second => self.second(read, answer),
            Asking::Others { .. } => self.others(answer),
        }
    }

    fn first(&mut self, read: Read, answer: Result<Vec<u16>, Failure>) {
        match answer {
            Ok(registers) => {
                if let Some(known) = self.named(read, &registers) {
                    self.finding = Some(Finding::Known(known));
                } else if self.waiting.is_empty() {
                    let detail = format!(
                        "it answers {}, which of the known profiles only this one documents",
                        registers_of(read)
                    );
                    self.plausible(detail);
                }
            }
            // Neither the wire nor a unit that is known to be silent can be asked for more.
            Err(failure)
                if !failure.device_answered()
                    && (!failure.is_silence() || failure.next_probe().is_some()) =>
            {
                self.finding = Some(Finding::Silent(failure));
            }
            Err(failure) => {
                self.waiting = self.signature.second.iter().copied().collect();
                self.asking = Asking::Second;
                self.doubt = Some((read, failure));
                if self.waiting.is_empty() {
                    self.doubted(None);
                }
            }
        }
    }

    fn second(&mut self, read: Read, answer: Result<Vec<u16>, Failure>) {
        match answer {
            Ok(_) if !self.waiting.is_empty() => {}
            Ok(_) => {
                let doubt = self
                    .doubt
                    .as_ref()
                    .map(|(first, failure)| format!("{}: {failure}", registers_of(*first)));
                let detail = format!(
                    "it answers {}, which of the known profiles only this one documents, though not {}",
                    registers_of(read),
                    doubt.unwrap_or_default()
                );
                self.plausible(detail);
            }
            Err(failure) => self.doubted(Some(failure)),
        }
    }

    /// Neither of the two parts was answered.
    fn doubted(&mut self, second: Option<Failure>) {
        let Some((read, first)) = self.doubt.take() else { return };
        let is_refusal = first.is_refusal() && second.as_ref().is_none_or(Failure::is_refusal);
        if is_refusal {
            if let Some(before) = self.before.take() {
                self.finding = Some(Finding::Known(before));
                return;
            }
            let left = builtins().iter().filter(|other| other.key != self.profile.key).collect();
            self.asking = Asking::Others { left, now: None, fit: Vec::new(), refused: (read, first) };
            self.next_other();
            return;
        }
        // What the device itself said tells more than what it did not say.
        let answered =
            [Some(&first), second.as_ref()].into_iter().flatten().find(|failure| failure.device_answered());
        self.finding = Some(match answered {
            Some(failure) => Finding::Unclear(failure.clone()),
            None => Finding::Silent(first),
        });
    }

    fn others(&mut self, answer: Result<Vec<u16>, Failure>) {
        let Asking::Others { left, now, fit, .. } = &mut self.asking else { return };
        match answer {
            Ok(_) if !self.waiting.is_empty() => return,
            Ok(_) => fit.extend(*now),
            Err(failure) if failure.device_answered() => {}
            // Not worth more time-outs.
            Err(_) => left.clear(),
        }
        self.next_other();
    }

    fn next_other(&mut self) {
        let Asking::Others { left, now, fit, refused: (read, failure) } = &mut self.asking else { return };
        *now = left.pop_front();
        if let Some(other) = now {
            self.waiting = signature(other, builtins()).first.into();
            return;
        }
        let lacks = format!(
            "it does not have {}, which every {} has: {failure}",
            registers_of(*read),
            family(self.profile)
        );
        let detail = match fit[..] {
            [one] => format!("{lacks}; it answers as a {} does (profile {})", family(one), one.key),
            _ => lacks,
        };
        self.finding = Some(Finding::Known(Known { verdict: Identity::Wrong, detail, model: None }));
    }

    fn plausible(&mut self, detail: String) {
        self.finding = Some(Finding::Known(Known { verdict: Identity::Plausible, detail, model: None }));
    }

    /// Who it says it is, if `read` is of the point that names the model.
    fn named(&self, read: Read, registers: &[u16]) -> Option<Known> {
        let point = &self.profile.points[self.profile.identity.as_ref()?.point];
        let code = point.raw_code(point.within(read.address, registers)?, self.word_order)?;
        Some(named(self.profile, code, self.wanted.as_deref()))
    }
}

/// Who a device says it is by the code that names the model. A code that nobody knows is no error: the lists of the
/// makers are open.
pub(crate) fn named(profile: &'static Profile, code: u32, wanted: Option<&str>) -> Known {
    let model = u16::try_from(code).ok().and_then(|code| profile.model(code));
    let (verdict, detail) = match (model, wanted) {
        (Some(model), Some(wanted)) if model != wanted => {
            (Identity::Wrong, format!("it says that it is a {model}, and the site file wants a {wanted}"))
        }
        (Some(model), _) => (Identity::Confirmed, format!("it says that it is a {model}")),
        (None, _) if is_blank(code) => {
            (Identity::Plausible, format!("its identity is {code:04X}h, which names no model"))
        }
        (None, _) => (Identity::Plausible, format!("its identity is {code:04X}h, a model that is not known")),
    };
    Known { verdict, detail, model }
}

/// Memory that was never written names nobody.
fn is_blank(code: u32) -> bool {
    matches!(code, 0 | 0xFFFF)
}

fn registers_of(read: Read) -> String {
    match read.count {
        1 => format!("register {}", read.address),
        count => format!("registers {} to {}", read.address, u32::from(read.address) + u32::from(count) - 1),
    }
}

/// The family of a profile as a person calls it.
fn family(profile: &Profile) -> String {
    format!("{} {}", profile.vendor, profile.models.join("/"))
}

#[cfg(test)]
mod tests {
    use busbar_profile::builtin;
    use busbar_profile::signature::answers;

    use super::*;
    use crate::testing::{outage, refusal, site_device, timeout};

    fn site(key: &str) -> SiteDevice {
        SiteDevice { profile: builtin(key).unwrap(), ..site_device("gen1") }
    }

    fn wanting(model: &str) -> Expected {
        Expected { model: Some(model.to_owned()), ..Expected::default() }
    }

    /// Plays a check: what comes of it, and the addresses that were asked.
    fn play(
        mut check: Check,
        mut device: impl FnMut(Read) -> Result<Vec<u16>, Failure>,
    ) -> (Finding, Vec<u16>) {
        let mut asked = Vec::new();
        while let Some(Question { read, .. }) = check.next() {
            asked.push(read.address);
            check.take(device(read));
        }
        (check.finding().unwrap(), asked)
    }

    /// A device of a family whose registers all hold the same.
    fn of(key: &'static str, holds: u16) -> impl FnMut(Read) -> Result<Vec<u16>, Failure> {
        move |read| match answers(builtin(key).unwrap(), read) {
            true => Ok(vec![holds; read.count.into()]),
            false => Err(refusal(2)),
        }
    }

    fn known(finding: &Finding) -> &Known {
        let Finding::Known(known) = finding else { panic!("{finding:?}") };
        known
    }

    fn datakom(expected: &Expected) -> Check {
        Check::new(&site("datakom-d"), expected, None)
    }

    #[test]
    fn who_names_the_wanted_model_is_confirmed_after_one_read() {
        for expected in [Expected::default(), wanting("D-500")] {
            let (finding, asked) = play(datakom(&expected), of("datakom-d", 0xD500));
            let Known { verdict, detail, model } = known(&finding);
            assert_eq!((*verdict, *model, asked.len()), (Identity::Confirmed, Some("D-500"), 1));
            assert_eq!(detail, "it says that it is a D-500");
        }
        let (finding, _) = play(datakom(&wanting("D-700")), of("datakom-d", 0xD500));
        assert_eq!(known(&finding).verdict, Identity::Wrong);
        assert_eq!(known(&finding).detail, "it says that it is a D-500, and the site file wants a D-700");
        for code in [0, 0xFFFF, 0xD999] {
            let (finding, _) = play(datakom(&wanting("D-700")), of("datakom-d", code));
            assert_eq!(known(&finding).verdict, Identity::Plausible, "{code:04X}h");
        }
    }

    #[test]
    fn another_family_is_named_where_it_is_the_only_one_that_fits() {
        let (finding, asked) = play(datakom(&Expected::default()), of("smartgen-hat821si", 1));
        let found = known(&finding);
        assert_eq!((found.verdict, asked.len()), (Identity::Wrong, 5), "{found:?}");
        assert!(found.detail.ends_with("it answers as a SmartGen HAT821SI does (profile smartgen-hat821si)"));
        // Whoever refuses all that is asked is none of them.
        let (finding, _) = play(datakom(&Expected::default()), |_| Err(refusal(1)));
        assert_eq!(known(&finding).verdict, Identity::Wrong);
        assert!(!known(&finding).detail.contains("profile"), "{finding:?}");
        // Asked again, the others are not.
        let again = Check::new(&site("datakom-d"), &Expected::default(), Some(known(&finding).clone()));
        let (same, asked) = play(again, |_| Err(refusal(1)));
        assert_eq!((same, asked.len()), (finding, 2));
    }

    #[test]
    fn only_a_plain_refusal_of_both_says_that_it_is_another() {
        let first = Check::new(&site("datakom-d"), &Expected::default(), None).next().unwrap().read.address;
        let second = |answer: Result<Vec<u16>, Failure>, other: Result<Vec<u16>, Failure>| {
            play(datakom(&Expected::default()), move |read| {
                if read.address == first { answer.clone() } else { other.clone() }
            })
            .0
        };
        let good = || Ok(vec![7]);
        for doubt in [refusal(2), refusal(6), timeout()] {
            let finding = second(Err(doubt.clone()), good());
            assert_eq!(known(&finding).verdict, Identity::Plausible, "{doubt}");
        }
        for (one, other) in [(refusal(6), refusal(2)), (refusal(2), refusal(6)), (refusal(2), timeout())] {
            let finding = second(Err(one), Err(other));
            assert!(matches!(finding, Finding::Unclear(_)), "{finding:?}");
        }
        assert_eq!(second(Err(timeout()), Err(refusal(2))), Finding::Unclear(refusal(2)));
        assert_eq!(second(Err(timeout()), Err(timeout())), Finding::Silent(timeout()));
        // Over a wire that is down nothing else is asked.
        let (finding, asked) =
            play(datakom(&Expected::default()), |_| Err(outage(busbar_link::Cause::Refused)));
        assert!(matches!(finding, Finding::Silent(_)) && asked.len() == 1, "{finding:?}");
    }
}
