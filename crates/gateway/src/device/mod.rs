//! The live state of one device: who it is, its registers, values with quality and time, and active alarms.
//!
//! No wire and no clock in here: finished poll rounds and the time come in, what has changed comes out.

mod identity;
mod round;
mod view;

use std::sync::Arc;
use std::time::Duration;

use busbar_profile::{Decoded, Image, Quality, Rate};

pub(crate) use self::identity::{Check, Finding, Known, Question};
pub(crate) use self::round::Round;
use self::round::{outside, windows};
pub(crate) use self::view::points_view;
use crate::alarms::{self, Alarms};
use crate::api::types::{DeviceView, Identity, IdentityView, Time};
use crate::failure::Failure;
use crate::joined::Joined;
use crate::poll_plan::polled;
use crate::rates::RATES;
use crate::site::SiteDevice;

/// A value is stale after so many missed rounds...
const STALE_ROUNDS: u32 = 3;
/// ... but never before this.
const STALE_AT_LEAST: Duration = Duration::from_secs(5);

/// What a round changed.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Changes {
    /// Indexes of the points whose value or quality changed, in address order.
    pub(crate) values: Vec<usize>,
    /// Indexes of the joined signals whose value or quality changed, in the order of the profile.
    pub(crate) joined: Vec<usize>,
    /// Whether the device's own view changed.
    pub(crate) device: bool,
    /// Whether the list of active alarms changed.
    pub(crate) alarms: bool,
}

/// The live state of one device.
#[derive(Debug)]
pub(crate) struct Device {
    site: SiteDevice,
    /// Id of its wire.
    wire: String,
    image: Image,
    /// By index in the profile.
    points: Vec<Point>,
    /// By index in the profile's joined signals.
    joined: Vec<Joined>,
    /// Indexes of the points that come in parts.
    long: Vec<usize>,
    /// Indexes of the points that are read, for each of [`RATES`].
    read: [Vec<usize>; RATES.len()],
    /// When the last round was finished that the device answered, for each of [`RATES`].
    rounds: [Option<Time>; RATES.len()],
    /// How long the last round took that was read on demand.
    took: Duration,
    state: Option<usize>,
    mode: Option<usize>,
    alarms: Alarms,
    /// Indexes of the points that alarms are read from.
    alarm_points: Vec<usize>,
    online: bool,
    fault: Option<String>,
    /// Why it cannot be reached at all; none while it answers.
    silence: Option<Arc<Failure>>,
    last_seen: Option<Time>,
    model: Option<&'static str>,
    identity: IdentityView,
    /// Who it said it is in a round that was not about that.
    claim: Option<Known>,
    /// What was last told of it.
    told: Option<DeviceView>,
}

/// What is known of one point.
#[derive(Debug, Clone)]
struct Point {
    /// What the device last said.
    decoded: Decoded,
    /// Whether the registers changed since they were decoded.
    dirty: bool,
    /// When it was last read well.
    read: Option<(Duration, Time)>,
    /// Why it could not be read since.
    failure: Option<Arc<Failure>>,
    stale: bool,
}

impl Point {
    const UNREAD: Self =
        Self { decoded: Decoded::INVALID, dirty: true, read: None, failure: None, stale: false };

    fn quality(&self) -> Quality {
        match self {
            Self { failure: Some(_), .. } => Quality::Bad,
            Self { read: None, .. } | Self { stale: true, .. } => Quality::Stale,
            _ => self.decoded.quality,
        }
    }
}

impl Device {
    pub(crate) fn new(site: SiteDevice, wire: String) -> Self {
        let profile = site.profile;
        let signal = |signal: &str| profile.points.iter().position(|p| p.signal.as_deref() == Some(signal));
        // What has an engine is in that engine's state; of a transfer switch the transfer is what matters.
        let states = ["state.engine", "state.transfer"];
        let mut device = Self {
            wire,
            image: Image::new(profile),
            points: vec![Point::UNREAD; profile.points.len()],
            joined: vec![Joined::default(); profile.joined().len()],
            long: (0..profile.points.len()).filter(|index| comes_in_parts(profile, *index)).collect(),
            read: RATES.map(|rate| polled(profile, rate)),
            rounds: [None; RATES.len()],
            took: Duration::ZERO,
            state: states.into_iter().find_map(signal),
            mode: signal("mode"),
            alarms: Alarms::default(),
            alarm_points: alarms::sources(profile),
            online: false,
            fault: None,
            silence: None,
            last_seen: None,
            model: None,
            identity: IdentityView { verdict: Identity::Unknown, detail: None, checked: None },
            claim: None,
            told: None,
            site,
        };
        device.told = Some(device.view());
        device
    }

    pub(crate) fn site(&self) -> &SiteDevice {
        &self.site
    }

    /// Id of its wire.
    pub(crate) fn wire(&self) -> &str {
        &self.wire
    }

    pub(crate) fn is_online(&self) -> bool {
        self.online
    }

    pub(crate) fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Whether another device answers in its place.
    pub(crate) fn is_wrong(&self) -> bool {
        self.identity.verdict == Identity::Wrong
    }

    /// Takes over a finished round.
    pub(crate) fn finish(&mut self, mut round: Round, now: Duration, ts: Time) -> Changes {
        let mut changes = Changes::default();
        if let Some(known) = round.identity.take() {
            self.last_seen = Some(ts);
            self.identified(known, ts, &mut changes);
        }
        if !self.is_wrong() || round.silence.is_some() {
            self.reached(&mut round, ts);
            let covered = self.store(&round, (now, ts), &mut changes);
            match self.silence.clone() {
                Some(failure) => {
                    let all: Vec<usize> =
                        self.read.iter().flatten().copied().filter(|index| self.shows(*index)).collect();
                    self.fail(&all, &failure, &mut changes.values);
                }
                None => self.fail_uncovered(&round, &covered, &mut changes.values),
            }
            self.join(&covered, ts);
            if let Some(claim) = self.claim.take() {
                self.identified(claim, ts, &mut changes);
            }
        }
        changes.values.sort_unstable();
        changes.values.dedup();
        changes.joined = self.rejudge();
        changes.device = self.is_news();
        changes
    }

    /// Marks what is older than its poll allows.
    pub(crate) fn expire(&mut self, now: Duration) -> Vec<(Rate, Changes)> {
        let mut expired = Vec::new();
        for (rate, points) in RATES.iter().zip(&self.read) {
            let Some(limit) = self.stale_after(*rate) else { continue };
            let mut changes = Changes::default();
            for index in points {
                let point = &mut self.points[*index];
                let old = point.read.is_some_and(|(at, _)| at + limit < now);
                if old && !point.stale {
                    point.stale = true;
                    if point.failure.is_none() {
                        changes.values.push(*index);
                    }
                }
            }
            if !changes.values.is_empty() {
                expired.push((*rate, changes));
            }
        }
        if !expired.is_empty() {
            let (joined, device) = (self.rejudge(), self.is_news());
            if let Some((_, last)) = expired.last_mut() {
                (last.joined, last.device) = (joined, device);
            }
        }
        expired
    }

    /// Whether the device's own view is another than was last told. That a device which answers has been seen again
    /// and again is no news.
    fn is_news(&mut self) -> bool {
        let view = self.view();
        let Some(told) = &mut self.told else { return true };
        told.last_seen = view.last_seen;
        told.identity.checked = view.identity.checked;
        let news = *told != view;
        *told = view;
        news
    }

    /// When the last round of a rate was; what is good of that rate was all read then, or since then on the way to
    /// something else.
    pub(crate) fn last_round(&self, rate: Rate) -> Option<Time> {
        RATES.iter().zip(&self.rounds).find(|(known, _)| **known == rate).and_then(|(_, ts)| *ts)
    }

    /// Who answers is known now. Of another device nothing is taken, and nothing is kept of the one before it.
    fn identified(&mut self, known: Known, ts: Time, changes: &mut Changes) {
        let Known { verdict, detail, model } = known;
        let is_news = self.identity.detail.as_ref() != Some(&detail);
        self.identity = IdentityView { verdict, detail: Some(detail.clone()), checked: Some(ts) };
        self.named(model, changes);
        if verdict != Identity::Wrong {
            return;
        }
        self.online = true;
        self.silence = None;
        if !is_news && self.fault.is_some() {
            return;
        }
        self.fault = Some(format!(
            "{} is not what the site file says: {detail}; connect the right device, or correct its unit, profile or model in the site file",
            self.site.name
        ));
        let reason = Arc::new(Failure::Wrong { detail });
        for index in 0..self.points.len() {
            if self.shows(index) {
                self.points[index] = Point { failure: Some(Arc::clone(&reason)), ..Point::UNREAD };
                changes.values.push(index);
            }
        }
        self.image = Image::new(self.site.profile);
        self.joined.iter_mut().for_each(|joined| joined.read(None));
        changes.alarms |= std::mem::take(&mut self.alarms) != Alarms::default();
    }

    /// Whether the device answered, and what to say if it did not.
    fn reached(&mut self, round: &mut Round, ts: Time) {
        let name = &self.site.name;
        let refused = round.failures.iter().find(|(_, failure)| failure.device_answered());
        if !round.answers.is_empty() || refused.is_some() {
            self.last_seen = Some(ts);
        }
        let Some(failure) = round.silence.take() else {
            if !round.reached_the_device() {
                // Nothing was due: nothing is known.
                return;
            }
            for (rate, last) in RATES.iter().zip(&mut self.rounds) {
                if round.rates.contains(*rate) {
                    *last = Some(ts);
                }
            }
            if round.rates.contains(Rate::OnDemand) {
                self.took = round.took;
            }
            self.online = true;
            // What is read rarely may be all that it refuses.
            if self.silence.take().is_some() || round.rates.contains(self.most_frequent()) {
                self.fault = refused
                    .filter(|_| round.answers.is_empty())
                    .map(|(_, failure)| format!("{name} answers, but refuses what it is asked: {failure}; check that it is what its profile is for"));
            }
            return;
        };
        if !self.silence.as_ref().is_some_and(|known| failure.is_no_news_after(known)) {
            let page = &self.site.profile.key;
            self.fault = Some(format!(
                "{name} cannot be read: {failure}; docs/connect/{page}.md says how to set it up and wire it"
            ));
            self.silence = Some(Arc::new(failure));
        }
        self.online = false;
        // Who knows who answers when somebody does again.
        (self.identity.verdict, self.identity.detail) = (Identity::Unknown, None);
    }

    /// Stores the answers; returns which points were wholly in them.
    fn store(&mut self, round: &Round, read: (Duration, Time), changes: &mut Changes) -> Vec<bool> {
        let profile = self.site.profile;
        let mut dirty = Vec::new();
        let windows = windows(&round.answers);
        let halves = self.halves(&windows);
        for (address, registers) in &round.answers {
            for (address, registers) in outside(&halves, *address, registers) {
                self.image.store(address, registers, &mut dirty);
            }
        }
        for index in dirty {
            self.points[index].dirty = true;
        }

        let mut covered = vec![false; self.points.len()];
        for (first, end) in windows {
            let start = profile.points.partition_point(|point| u32::from(point.address) < first);
            for (index, about) in profile.points.iter().enumerate().skip(start) {
                if u32::from(about.address) >= end {
                    break;
                }
                if about.access.is_readable() && u32::from(about.address) + u32::from(about.registers) <= end
                {
                    covered[index] = true;
                    self.take(index, read, changes);
                }
            }
        }
        covered
    }

    /// The registers of long points that did not come whole: half of a picture does not go with half of the one before.
    fn halves(&self, windows: &[(u32, u32)]) -> Vec<(u32, u32)> {
        let span = |index: &usize| {
            let point = &self.site.profile.points[*index];
            (u32::from(point.address), u32::from(point.address) + u32::from(point.registers))
        };
        let is_half = |(first, end): &(u32, u32)| {
            let touched = windows.iter().any(|window| window.0 < *end && *first < window.1);
            touched && !windows.iter().any(|window| window.0 <= *first && *end <= window.1)
        };
        self.long.iter().map(span).filter(is_half).collect()
    }

    /// A point was read: decodes it if its registers changed.
    fn take(&mut self, index: usize, read: (Duration, Time), changes: &mut Changes) {
        let Some(registers) = self.image.registers(index) else { return };
        let about = &self.site.profile.points[index];
        let point = &mut self.points[index];
        let before = point.quality();
        let mut changed = false;
        if point.dirty {
            let decoded = about.decode(registers, self.site.word_order);
            point.dirty = false;
            changed = decoded != point.decoded;
            point.decoded = decoded;
        }
        let first = point.read.is_none();
        point.read = Some(read);
        point.failure = None;
        point.stale = false;
        if !(changed || first || before != point.quality()) {
            return;
        }
        changes.values.push(index);
        if let Some(bits) = point.decoded.value.as_ref().and_then(|value| value.as_bits()) {
            changes.alarms |= self.alarms.update(self.site.profile, index, bits, read.1);
        }
        self.identify(index);
    }

    /// Who it says it is, when the point that names the model was read.
    fn identify(&mut self, index: usize) {
        let profile = self.site.profile;
        if profile.identity.as_ref().is_none_or(|identity| identity.point != index) {
            return;
        }
        let registers = self.image.registers(index);
        if let Some(code) = registers.and_then(|r| profile.points[index].raw_code(r, self.site.word_order)) {
            self.claim = Some(identity::named(profile, code, self.site.model.as_deref()));
        }
    }

    fn named(&mut self, model: Option<&'static str>, changes: &mut Changes) {
        if std::mem::replace(&mut self.model, model) == model {
            return;
        }
        // What a code means may depend on the model.
        let renamed = |point: &busbar_profile::Point| point.choices.iter().any(|c| !c.by_model.is_empty());
        let points = self.site.profile.points.iter().enumerate().filter(|(_, point)| renamed(point));
        let read = points.map(|(index, _)| index).filter(|index| self.points[*index].read.is_some());
        changes.values.extend(read);
    }

    /// The points of the round that did not come take the failure of the read they were in.
    fn fail_uncovered(&mut self, round: &Round, covered: &[bool], changed: &mut Vec<usize>) {
        if round.failures.is_empty() {
            return;
        }
        let due = RATES.iter().zip(&self.read).filter(|(rate, _)| round.rates.contains(**rate));
        let missing: Vec<usize> =
            due.flat_map(|(_, points)| points).copied().filter(|index| !covered[*index]).collect();
        for (read, failure) in &round.failures {
            let end = u32::from(read.address) + u32::from(read.count);
            let points = &self.site.profile.points;
            let inside: Vec<usize> = missing
                .iter()
                .copied()
                .filter(|index| {
                    u32::from(points[*index].address) < end && points[*index].last() >= read.address
                })
                .collect();
            self.fail(&inside, &Arc::new(failure.clone()), changed);
        }
    }

    fn fail(&mut self, points: &[usize], failure: &Arc<Failure>, changed: &mut Vec<usize>) {
        for index in points {
            let point = &mut self.points[*index];
            if point.failure.as_ref() != Some(failure) {
                point.failure = Some(Arc::clone(failure));
                changed.push(*index);
            }
        }
    }

    /// Joins the signals whose points all came in this round: parts of two rounds could straddle a full hour.
    fn join(&mut self, covered: &[bool], ts: Time) {
        let profile = self.site.profile;
        for (about, joined) in profile.joined().iter().zip(&mut self.joined) {
            if about.points().all(|index| covered[index]) {
                let reading = about.reading(profile, &self.image, self.site.word_order);
                joined.read(reading.zip(Some(ts)));
            }
        }
    }

    /// The joined signals whose value or quality is another than before.
    fn rejudge(&mut self) -> Vec<usize> {
        let points = &self.points;
        let signals = self.site.profile.joined().iter().zip(&mut self.joined).enumerate();
        signals
            .filter_map(|(index, (about, joined))| {
                let parts = about.points().map(|part| points[part].quality());
                joined.judge(parts).then_some(index)
            })
            .collect()
    }

    /// The rate of the rounds that tell how the device fares.
    fn most_frequent(&self) -> Rate {
        RATES
            .into_iter()
            .zip(&self.read)
            .find(|(_, points)| !points.is_empty())
            .map_or(Rate::Fast, |(rate, _)| rate)
    }

    fn stale_after(&self, rate: Rate) -> Option<Duration> {
        let interval = match rate {
            Rate::Fast => self.site.poll.fast,
            Rate::Slow => self.site.poll.slow,
            Rate::OnDemand => self.site.poll.fast.max(self.took),
            Rate::Once => return None,
        };
        Some(interval.saturating_mul(STALE_ROUNDS).max(STALE_AT_LEAST))
    }

    /// A point's value when it can be relied on now.
    pub(crate) fn good(&self, index: usize) -> Option<&busbar_profile::Value> {
        let point = &self.points[index];
        point.decoded.value.as_ref().filter(|_| point.quality() == Quality::Good)
    }
}

/// Whether a point is longer than a read may be.
fn comes_in_parts(profile: &busbar_profile::Profile, index: usize) -> bool {
    let point = &profile.points[index];
    point.access.is_readable() && point.registers > profile.wire.max_read
}

#[cfg(test)]
mod large;
#[cfg(test)]
mod tests;
