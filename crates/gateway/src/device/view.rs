//! What the API shows of a device.

use busbar_profile::{Profile, Quality, Rate, reading};

use super::Device;
use crate::api::types::{
    AlarmView, BitView, ChoiceView, DesiredView, DeviceView, GroupView, JoinedPointView, JoinedView,
    ModeView, NameplateView, PointView, PointsView, StateView, ValueView,
};
use crate::joined;
use crate::site::{Nameplate, SiteDevice};

impl Device {
    pub(crate) fn view(&self) -> DeviceView {
        let SiteDevice { id, name, profile, unit, .. } = &self.site;
        let mode = self.mode.and_then(|index| self.mode_view(index));
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
            alarms: self.alarms.counts(),
            alarms_fault: self.alarms_fault(),
            last_seen: self.last_seen,
            identity: self.identity.clone(),
            desired: self.desired(mode.as_ref()),
            nameplate: nameplate(self.site.nameplate),
            mode,
        }
    }

    /// What the site file wants beside what is.
    fn desired(&self, mode: Option<&ModeView>) -> Option<DesiredView> {
        let wanted = self.site.desired_mode.clone()?;
        let met = mode.and_then(|mode| mode.canonical.as_ref()).map(|canonical| *canonical == wanted);
        Some(DesiredView { mode: wanted, met })
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

    /// Whether a point has a value to show: it is polled, or somebody asked for it.
    pub(crate) fn shows(&self, index: usize) -> bool {
        let about = &self.site.profile.points[index];
        let point = &self.points[index];
        about.access.is_readable()
            && (about.rate != Rate::OnDemand || point.read.is_some() || point.failure.is_some())
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

fn nameplate(Nameplate { power_kw, tank_l, battery_v }: Nameplate) -> NameplateView {
    NameplateView { power_kw, tank_l, battery_v }
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
    let manual = &profile.manual;
    PointsView {
        manual: [Some(&manual.title), manual.revision.as_ref()]
            .into_iter()
            .flatten()
            .map(String::as_str)
            .collect::<Vec<_>>()
            .join(", "),
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
