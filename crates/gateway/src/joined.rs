//! Signals that several points make up, hours and clocks: their value, and how far it is to be trusted.

use busbar_profile::vocabulary::vocabulary;
use busbar_profile::{JoinedReading, JoinedValue, Profile, Quality, Rate};

use crate::api::types::{JoinedView, PointValue, Time};

/// One joined signal of a device.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joined {
    /// What its points made when they all last came in one round.
    last: Option<(JoinedReading, Time)>,
    /// How far it is to be trusted; none before it was judged.
    quality: Option<Quality>,
    /// What was last told of it.
    told: Option<(Option<JoinedValue>, Quality)>,
}

impl Joined {
    /// All its points came in one round.
    pub(crate) fn read(&mut self, reading: Option<(JoinedReading, Time)>) {
        self.last = reading;
    }

    /// Judges it by the quality of its points; whether that or its value is another than before.
    pub(crate) fn judge(&mut self, parts: impl Iterator<Item = Quality>) -> bool {
        let mut quality = match &self.last {
            Some((reading, _)) => reading.quality,
            None => Quality::Stale,
        };
        // A part without a value is one of the reading already.
        for part in parts.filter(|part| *part != Quality::Invalid) {
            if severity(part) > severity(quality) {
                quality = part;
            }
        }
        self.quality = Some(quality);
        let now = (self.last.and_then(|(reading, _)| reading.value), quality);
        self.told.replace(now) != Some(now)
    }

    pub(crate) fn view(&self, about: &busbar_profile::Joined) -> JoinedView {
        let value = self.last.and_then(|(reading, _)| reading.value);
        JoinedView {
            signal: about.signal.clone(),
            value: match value {
                Some(JoinedValue::Number(number)) => PointValue::Number(number),
                Some(JoinedValue::Clock(clock)) => PointValue::Text(clock.to_string()),
                None => PointValue::None,
            },
            unit: vocabulary().signal(&about.signal).and_then(|signal| signal.unit.clone()),
            quality: self.quality.unwrap_or(Quality::Stale).into(),
            ts: self.last.map(|(_, ts)| ts),
        }
    }
}

/// How often a joined signal is read: as its first point is.
pub(crate) fn rate(profile: &Profile, about: &busbar_profile::Joined) -> Rate {
    about.points().next().map_or(Rate::Once, |first| profile.points[first].rate)
}

fn severity(quality: Quality) -> u8 {
    match quality {
        Quality::Good => 0,
        Quality::Invalid => 1,
        Quality::Stale => 2,
        Quality::Bad => 3,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::device::{Device, points_view};
    use crate::site::SiteDevice;
    use crate::testing::{answered, at, failed, refusal, silence, site_device, ts};

    fn compressor() -> Device {
        let profile = busbar_profile::builtin("smartgen-acc1700").unwrap();
        Device::new(SiteDevice { profile, ..site_device("air1") }, "w1".to_owned())
    }

    /// The engine's hours: value, quality and when they were read.
    fn hours(device: &Device) -> (serde_json::Value, serde_json::Value, Option<Time>) {
        let view = device.joined_views().into_iter().find(|view| view.signal == "engine.hours").unwrap();
        assert_eq!(view.unit.as_deref(), Some("h"));
        (json!(view.value), json!(view.quality), view.ts)
    }

    #[test]
    fn hours_are_joined_when_all_their_parts_came_in_one_round() {
        let mut device = compressor();
        assert_eq!(hours(&device), (json!(null), json!("stale"), None));
        let whole = answered(Rate::Slow, &[(101, &[1234, 30, 0])]);
        let changes = device.finish(whole, at(0), ts(0));
        assert_eq!(hours(&device), (json!(1234.5), json!("good"), Some(ts(0))));
        let engine_hours = device.site().profile.joined().iter().position(|j| j.signal == "engine.hours");
        assert!(changes.joined.contains(&engine_hours.unwrap()), "{changes:?}");

        // A full hour is over, and only a part was read: no hour is made up.
        let part = device.finish(answered(Rate::Fast, &[(102, &[0, 0])]), at(1), ts(1));
        assert_eq!((hours(&device).0, part.joined), (json!(1234.5), vec![]));
        let same = device.finish(answered(Rate::Slow, &[(101, &[1234, 30, 0])]), at(2), ts(2));
        assert_eq!((hours(&device), same.joined), ((json!(1234.5), json!("good"), Some(ts(2))), vec![]));
    }

    #[test]
    fn a_value_is_as_good_as_the_worst_of_its_parts() {
        let mut device = compressor();
        device.finish(answered(Rate::Slow, &[(101, &[7, 32_766, 0])]), at(0), ts(0));
        assert_eq!(hours(&device), (json!(null), json!("invalid"), Some(ts(0))));
        device.finish(answered(Rate::Slow, &[(101, &[7, 15, 0])]), at(10), ts(10));
        assert_eq!(hours(&device), (json!(7.25), json!("good"), Some(ts(10))));

        let changes = device.expire(at(60));
        assert!(changes.iter().any(|(_, changes)| !changes.joined.is_empty()), "{changes:?}");
        assert_eq!(hours(&device), (json!(7.25), json!("stale"), Some(ts(10))));
        let changes = device.finish(failed(Rate::Slow, 103, 1, refusal(2)), at(61), ts(61));
        assert_eq!((hours(&device).1, changes.joined.len()), (json!("bad"), 1));
        device.finish(silence(), at(62), ts(62));
        assert_eq!(hours(&device), (json!(7.25), json!("bad"), Some(ts(10))), "the last good value");
    }

    #[test]
    fn a_clock_is_a_local_date_and_time() {
        let profile = busbar_profile::builtin("smartgen-hat821si").unwrap();
        let mut device = Device::new(SiteDevice { profile, ..site_device("ats1") }, "w1".to_owned());
        device.finish(answered(Rate::Slow, &[(1100, &[26, 11, 23, 1, 7, 30, 59])]), at(0), ts(0));
        let clock = device.joined_views().into_iter().find(|view| view.signal == "clock").unwrap();
        assert_eq!((json!(clock.value), clock.unit), (json!("2026-11-23T07:30:59"), None));
    }

    #[test]
    fn a_joined_signal_says_what_it_is_made_of() {
        let points = points_view(busbar_profile::builtin("smartgen-acc1700").unwrap());
        let hours = points.joined.iter().find(|joined| joined.signal == "engine.hours").unwrap();
        assert_eq!(hours.points, ["total_running_hours", "total_running_minutes", "total_running_seconds"]);
        assert!(hours.meaning.contains("ours") && hours.unit.as_deref() == Some("h"), "{hours:?}");
    }
}
