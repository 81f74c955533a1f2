//! Active alarms of one device: which bits are set, of which class, and since when.

use busbar_profile::{BitSet, Class, Profile, Rate};

use crate::api::types::{AlarmCounts, AlarmView, Time};

/// The active alarms of one device, the gravest first, the oldest first among equals.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Alarms {
    active: Vec<Active>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Active {
    class: Class,
    since: Time,
    point: usize,
    bit: u16,
}

impl Alarms {
    /// Takes the bits of a point as they are at `ts`; true when the list changed.
    pub(crate) fn update(&mut self, profile: &Profile, point: usize, bits: &BitSet, ts: Time) -> bool {
        let before = self.active.len();
        self.active.retain(|active| active.point != point || bits.contains(active.bit));
        let gone = before != self.active.len();

        let known = self.active.len();
        for bit in bits.iter() {
            let Some(class) = class(profile, point, bit) else { continue };
            if !self.active[..known].iter().any(|active| (active.point, active.bit) == (point, bit)) {
                self.active.push(Active { class, since: ts, point, bit });
            }
        }
        let came = known != self.active.len();
        if came {
            self.active.sort_unstable();
        }
        gone || came
    }

    pub(crate) fn counts(&self) -> AlarmCounts {
        let mut counts = AlarmCounts::default();
        for active in &self.active {
            match active.class {
                Class::Shutdown => counts.shutdown += 1,
                Class::LoadDump => counts.load_dump += 1,
                Class::Trip => counts.trip += 1,
                Class::Warning => counts.warning += 1,
                Class::Indication => counts.indication += 1,
                Class::Status => {}
            }
        }
        counts
    }

    pub(crate) fn views(&self, device: &str, profile: &Profile) -> Vec<AlarmView> {
        let view = |active: &Active| {
            let point = &profile.points[active.point];
            let bit = point.bit(active.bit);
            AlarmView {
                device: device.to_owned(),
                point: point.id.clone(),
                bit: active.bit,
                id: bit.map_or_else(|| format!("bit_{}", active.bit), |bit| bit.id.clone()),
                label: bit.map_or_else(|| format!("bit {}", active.bit), |bit| bit.label.clone()),
                class: active.class.into(),
                since: active.since,
            }
        };
        self.active.iter().map(view).collect()
    }
}

/// Indexes of the polled points that alarms are read from.
pub(crate) fn sources(profile: &Profile) -> Vec<usize> {
    let points = profile.points.iter().enumerate();
    let alarms = |class: Option<Class>| class.is_some_and(Class::is_alarm);
    points
        .filter(|(_, point)| point.access.is_readable() && point.rate != Rate::OnDemand)
        .filter(|(_, point)| alarms(point.class) || point.bits.iter().any(|bit| alarms(bit.class)))
        .map(|(index, _)| index)
        .collect()
}

/// The class of a bit when a set one is an alarm; an unnamed bit is of its point's class.
fn class(profile: &Profile, point: usize, bit: u16) -> Option<Class> {
    let point = &profile.points[point];
    let class = point.bit(bit).map_or(point.class, |bit| bit.class)?;
    class.is_alarm().then_some(class)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{profile, ts};

    fn update(alarms: &mut Alarms, point: &str, bits: &[u16], second: i64) -> bool {
        let point = profile().point_index(point).unwrap();
        alarms.update(profile(), point, &bits.iter().copied().collect(), ts(second))
    }

    fn listed(alarms: &Alarms) -> Vec<(String, u16, Time)> {
        let views = alarms.views("gen1", profile());
        views.into_iter().map(|alarm| (alarm.point, alarm.bit, alarm.since)).collect()
    }

    #[test]
    fn rise_stay_and_fall() {
        let mut alarms = Alarms::default();
        assert!(update(&mut alarms, "warnings", &[0], 1));
        assert!(!update(&mut alarms, "warnings", &[0], 2), "still the same");
        assert!(update(&mut alarms, "shutdowns", &[0, 7], 3));
        assert_eq!(
            listed(&alarms),
            [
                ("shutdowns".to_owned(), 0, ts(3)),
                ("shutdowns".to_owned(), 7, ts(3)),
                ("warnings".to_owned(), 0, ts(1)),
            ],
            "the gravest first"
        );
        let counts = alarms.counts();
        assert_eq!((counts.shutdown, counts.warning, counts.trip), (2, 1, 0));

        assert!(update(&mut alarms, "shutdowns", &[7], 4));
        assert!(update(&mut alarms, "warnings", &[], 4));
        assert_eq!(listed(&alarms), [("shutdowns".to_owned(), 7, ts(3))]);

        // One goes as another comes: the count alone would not tell.
        assert!(update(&mut alarms, "shutdowns", &[0], 5));
        assert_eq!(listed(&alarms), [("shutdowns".to_owned(), 0, ts(5))]);
    }

    #[test]
    fn a_status_bit_is_no_alarm_and_an_unnamed_bit_is_one() {
        let mut alarms = Alarms::default();
        assert!(!update(&mut alarms, "warnings", &[3], 1));
        assert!(update(&mut alarms, "warnings", &[3, 9], 2));
        let view = alarms.views("gen1", profile()).remove(0);
        assert_eq!((view.id.as_str(), view.label.as_str()), ("bit_9", "bit 9"));
    }
}
