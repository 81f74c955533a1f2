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
