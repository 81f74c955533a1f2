//! The live state of one device: its registers, values with quality and time, and active alarms.
//!
//! No wire and no clock in here: finished poll rounds and the time come in, what has changed comes out.

use std::sync::Arc;
use std::time::Duration;

use busbar_profile::plan::Read;
use busbar_profile::{Decoded, Image, Profile, Quality, Rate, reading};

use crate::alarms::{self, Alarms};
use crate::api::types::{
    AlarmView, BitView, ChoiceView, DeviceView, GroupView, Identity, IdentityView, JoinedPointView,
    JoinedView, ModeView, NameplateView, PointView, PointsView, StateView, Time, ValueView,
};
use crate::failure::Failure;
use crate::joined::{self, Joined};
use crate::poll_plan::polled;
use crate::rates::{POLLED, Rates};
use crate::site::SiteDevice;

/// A value is stale after so many missed rounds...
const STALE_ROUNDS: u32 = 3;
/// ... but never before this.
const STALE_AT_LEAST: Duration = Duration::from_secs(5);

/// What one poll round brought.
#[derive(Debug)]
pub(crate) struct Round {
    /// What was due.
    pub(crate) rates: Rates,
    /// Registers that came, by address.
    pub(crate) answers: Vec<(u16, Vec<u16>)>,
    /// Reads that failed, and why.
    pub(crate) failures: Vec<(Read, Failure)>,
    /// Set when the device, not just a read, could not be reached.
    pub(crate) silence: Option<Failure>,
}

impl Round {
    /// When the wire lets a poll through again, where it held the last one back.
    pub(crate) fn held(&self) -> Option<Duration> {
        self.failures.last().and_then(|(_, failure)| failure.next_probe())
    }

    /// Whether the device answered anything at all, if only to refuse.
    pub(crate) fn reached_the_device(&self) -> bool {
        !self.answers.is_empty() || self.failures.iter().any(|(_, failure)| failure.device_answered())
    }
}

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
    /// Indexes of the polled points, for each of [`POLLED`].
    polled: [Vec<usize>; POLLED.len()],
    /// When the last round was finished that the device answered, for each of [`POLLED`].
    rounds: [Option<Time>; POLLED.len()],
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
        Self {
            wire,
            image: Image::new(profile),
            points: vec![Point::UNREAD; profile.points.len()],
            joined: vec![Joined::default(); profile.joined().len()],
            polled: POLLED.map(|rate| polled(profile, rate)),
            rounds: [None; POLLED.len()],
            state: states.into_iter().find_map(signal),
            mode: signal("mode"),
            alarms: Alarms::default(),
            alarm_points: alarms::sources(profile),
            online: false,
            fault: None,
            silence: None,
            last_seen: None,
            model: None,
            site,
        }
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

    /// Takes over a finished round.
    pub(crate) fn finish(&mut self, mut round: Round, now: Duration, ts: Time) -> Changes {
        let before = self.view();
        let mut changes = Changes::default();
        self.reached(&mut round, ts);
        let covered = self.store(&round, (now, ts), &mut changes);
        match self.silence.clone() {
            Some(failure) => {
                let all = self.polled.concat();
                self.fail(&all, &failure, &mut changes.values);
            }
            None => self.fail_uncovered(&round, &covered, &mut changes.values),
        }
        changes.values.sort_unstable();
        changes.values.dedup();
        self.join(&covered, ts);
        changes.joined = self.rejudge();
        changes.device = !same_but_last_seen(&before, self.view());
        changes
    }

    /// Marks what is older than its poll allows.
    pub(crate) fn expire(&mut self, now: Duration) -> Vec<(Rate, Changes)> {
        let before = self.view();
        let mut expired = Vec::new();
        for (rate, points) in POLLED.iter().zip(&self.polled) {
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
        if let Some((_, changes)) = expired.last_mut() {
            changes.joined = self.rejudge();
            changes.device = !same_but_last_seen(&before, self.view());
        }
        expired
    }

    /// When the last round of a rate was; what is good of that rate was all read then, or since then on the way to
    /// something else.
    pub(crate) fn last_round(&self, rate: Rate) -> Option<Time> {
        POLLED.iter().zip(&self.rounds).find(|(polled, _)| **polled == rate).and_then(|(_, ts)| *ts)
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
            for (rate, last) in POLLED.iter().zip(&mut self.rounds) {
                if round.rates.contains(*rate) {
                    *last = Some(ts);
                }
            }
            self.online = true;
            self.silence = None;
            self.fault = refused
                .filter(|_| round.answers.is_empty())
                .map(|(_, failure)| format!("{name} answers, but refuses what it is asked: {failure}; check that it is what its profile is for"));
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
    }

    /// Stores the answers; returns which points were wholly in them.
    fn store(&mut self, round: &Round, read: (Duration, Time), changes: &mut Changes) -> Vec<bool> {
        let profile = self.site.profile;
        let mut dirty = Vec::new();
        for (address, registers) in &round.answers {
            self.image.store(*address, registers, &mut dirty);
        }
        for index in dirty {
            self.points[index].dirty = true;
        }

        let mut covered = vec![false; self.points.len()];
        for (first, end) in windows(&round.answers) {
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
        self.identify(index, changes);
    }

    /// The model, when the point that names it was read.
    fn identify(&mut self, index: usize, changes: &mut Changes) {
        let profile = self.site.profile;
        if profile.identity.as_ref().is_some_and(|identity| identity.point == index) {
            let registers = self.image.registers(index);
            let code = registers.and_then(|r| profile.points[index].raw_code(r, self.site.word_order));
            let model = code.and_then(|code| profile.model(u16::try_from(code).ok()?));
            if std::mem::replace(&mut self.model, model) != model {
                // What a code means may depend on the model.
                let renamed =
                    |point: &busbar_profile::Point| point.choices.iter().any(|c| !c.by_model.is_empty());
                let points = profile.points.iter().enumerate().filter(|(_, point)| renamed(point));
                let read = points.map(|(index, _)| index).filter(|index| self.points[*index].read.is_some());
                changes.values.extend(read);
            }
        }
    }

    /// The points of the round that did not come take the failure of the read they were in.
    fn fail_uncovered(&mut self, round: &Round, covered: &[bool], changed: &mut Vec<usize>) {
        let due = POLLED.iter().zip(&self.polled).filter(|(rate, _)| round.rates.contains(**rate));
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

    fn stale_after(&self, rate: Rate) -> Option<Duration> {
        let interval = match rate {
            Rate::Fast => self.site.poll.fast,
            Rate::Slow => self.site.poll.slow,
            Rate::Once | Rate::OnDemand => return None,
        };
        Some(interval.saturating_mul(STALE_ROUNDS).max(STALE_AT_LEAST))
    }

    /// A point's value when it can be relied on now.
    fn good(&self, index: usize) -> Option<&busbar_profile::Value> {
        let point = &self.points[index];
        point.decoded.value.as_ref().filter(|_| point.quality() == Quality::Good)
    }
}

/// What the API shows of a device.
impl Device {
    pub(crate) fn view(&self) -> DeviceView {
        let SiteDevice { id, name, profile, unit, .. } = &self.site;
        DeviceView {
            id: id.clone(),
            name: name.clone(),
            profile: profile.key.clone(),
            vendor: profile.vendor.clone(),
            kind: profile.kind.into(),
            model: self.model.map(str::to_owned),
            models: profile.models.clone(),
            wire: self.wire.clone(),
            unit: *unit,
            online: self.online,
            fault: self.fault.clone(),
            state: self.state.and_then(|index| self.state_view(index)),
            mode: self.mode.and_then(|index| self.mode_view(index)),
            alarms: self.alarms.counts(),
            alarms_fault: self.alarms_fault(),
            last_seen: self.last_seen,
            identity: IdentityView { verdict: Identity::Unknown, detail: None, checked: None },
            desired: None,
            nameplate: NameplateView::default(),
        }
    }

    /// What is wrong with the first point that alarms are read from and that is not good.
    fn alarms_fault(&self) -> Option<String> {
        let bad = |index: &&usize| self.points[**index].quality() != Quality::Good;
        let index = *self.alarm_points.iter().find(bad)?;
        let (id, point) = (&self.site.profile.points[index].id, &self.points[index]);
        Some(match &point.failure {
            Some(failure) => format!("{id}: {failure}"),
            None if point.read.is_none() => format!("{id}: not read yet"),
            None => format!("{id}: not read for too long"),
        })
    }

    fn state_view(&self, index: usize) -> Option<StateView> {
        let point = &self.site.profile.points[index];
        let code = self.good(index)?.as_code()?;
        let choice = point.choice(code);
        // A timer that does not run in this state holds whatever it held before.
        let timer = point.timer.filter(|_| choice.is_some_and(|choice| choice.timed));
        Some(StateView {
            code,
            label: point.label(code, self.model).into_owned(),
            canonical: choice.and_then(|choice| choice.state.clone()),
            timer_s: timer.and_then(|timer| self.good(timer)?.as_number()),
        })
    }

    fn mode_view(&self, index: usize) -> Option<ModeView> {
        let point = &self.site.profile.points[index];
        let value = self.good(index)?;
        if let Some(code) = value.as_code() {
            let label = point.label(code, self.model).into_owned();
            let canonical = point.choice(code).and_then(|choice| choice.state.clone());
            return Some(ModeView { code, label, canonical });
        }
        // A word of bits has one bit for each mode, or one bit for two.
        let set = value.as_bits()?;
        point.bits.iter().find_map(|bit| {
            let (label, state) = match (set.contains(bit.bit), &bit.clear) {
                (true, _) => (&bit.label, bit.state.as_ref()?),
                (false, Some(clear)) => (&clear.label, &clear.state),
                (false, None) => return None,
            };
            Some(ModeView { code: bit.bit.into(), label: label.clone(), canonical: Some(state.clone()) })
        })
    }

    pub(crate) fn alarm_views(&self) -> Vec<AlarmView> {
        self.alarms.views(&self.site.id, self.site.profile)
    }

    /// Whether a point has a value to show: it is polled, or was read on demand.
    pub(crate) fn shows(&self, index: usize) -> bool {
        let about = &self.site.profile.points[index];
        about.access.is_readable() && (about.rate != Rate::OnDemand || self.points[index].read.is_some())
    }

    /// Every value there is, in address order.
    #[cfg(test)]
    pub(crate) fn values(&self) -> Vec<ValueView> {
        (0..self.points.len()).filter(|index| self.shows(*index)).map(|index| self.value(index)).collect()
    }

    /// Every signal that several points make up, in the order of the profile.
    pub(crate) fn joined_views(&self) -> Vec<JoinedView> {
        (0..self.joined.len()).map(|index| self.joined(index)).collect()
    }

    pub(crate) fn joined(&self, index: usize) -> JoinedView {
        self.joined[index].view(&self.site.profile.joined()[index])
    }

    pub(crate) fn value(&self, index: usize) -> ValueView {
        let about = &self.site.profile.points[index];
        let point = &self.points[index];
        let raw = self.image.registers(index).filter(|_| point.read.is_some());
        let reading = reading(about, &point.decoded, raw.unwrap_or_default(), self.model);
        ValueView {
            id: about.id.clone(),
            value: reading.value.map(Into::into).unwrap_or_default(),
            code: reading.code,
            set: reading.set,
            unit: about.unit.clone(),
            quality: point.quality().into(),
            ts: point.read.map(|(_, ts)| ts),
            error: point.failure.as_ref().map(|failure| failure.to_string()),
            raw: raw.map(<[u16]>::to_vec),
        }
    }
}

/// What there is to read of a device of this profile.
pub(crate) fn points_view(profile: &Profile) -> PointsView {
    let groups = profile.groups.iter().map(|group| GroupView {
        id: group.id.clone(),
        title: group.title.clone(),
        rate: group.rate.into(),
        points: group
            .points
            .iter()
            .map(|index| &profile.points[*index])
            .filter(|point| point.access.is_readable())
            .map(point_view)
            .collect(),
    });
    PointsView {
        groups: groups.filter(|group| !group.points.is_empty()).collect(),
        joined: profile.joined().iter().map(|signal| joined_point_view(profile, signal)).collect(),
    }
}

fn joined_point_view(profile: &Profile, signal: &busbar_profile::Joined) -> JoinedPointView {
    let about = busbar_profile::vocabulary::vocabulary().signal(&signal.signal);
    JoinedPointView {
        signal: signal.signal.clone(),
        meaning: about.map(|about| about.meaning.clone()).unwrap_or_default(),
        unit: about.and_then(|about| about.unit.clone()),
        rate: joined::rate(profile, signal).into(),
        points: signal.points().map(|index| profile.points[index].id.clone()).collect(),
    }
}

fn point_view(point: &busbar_profile::Point) -> PointView {
    let choice =
        |choice: &busbar_profile::Choice| ChoiceView { value: choice.value, label: choice.label.clone() };
    let bit = |bit: &busbar_profile::Bit| BitView {
        bit: bit.bit,
        id: bit.id.clone(),
        label: bit.label.clone(),
        class: bit.class.map(Into::into),
        signal: bit.signal.clone(),
    };
    PointView {
        id: point.id.clone(),
        name: point.name.clone(),
        address: point.address,
        plc: point.plc_number(),
        registers: point.registers,
        unit: point.unit.clone(),
        data_type: point.data_type.into(),
        rate: point.rate.into(),
        signal: point.signal.clone(),
        doubt: point.doubt.clone(),
        page: point.page,
        choices: point.choices.iter().map(choice).collect(),
        bits: point.bits.iter().map(bit).collect(),
    }
}

/// A device that answers has been seen again and again; that alone is no news.
fn same_but_last_seen(before: &DeviceView, mut after: DeviceView) -> bool {
    after.last_seen = before.last_seen;
    *before == after
}

/// Address ranges that the answers cover, first and behind the last; answers that touch are one.
fn windows(answers: &[(u16, Vec<u16>)]) -> Vec<(u32, u32)> {
    let mut ranges: Vec<(u32, u32)> = answers
        .iter()
        .map(|(address, registers)| (u32::from(*address), u32::from(*address) + registers.len() as u32))
        .collect();
    ranges.sort_unstable();
    let mut windows: Vec<(u32, u32)> = Vec::with_capacity(ranges.len());
    for (first, end) in ranges {
        match windows.last_mut() {
            Some(last) if first <= last.1 => last.1 = last.1.max(end),
            _ => windows.push((first, end)),
        }
    }
    windows
}

#[cfg(test)]
mod tests;
