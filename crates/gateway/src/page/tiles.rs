//! The few values that a device's card shows, as words: the page's own list, read here too.

use std::sync::LazyLock;

use serde::Deserialize;

use crate::api::types::{Kind, PointValue, Quality, ValueView};
use crate::device::Device;

/// One value of a card.
#[derive(Debug, Deserialize)]
struct Wanted {
    title: String,
    /// The first that a device has fills the tile; all of them are needed where they make a feed.
    signals: Vec<String>,
    /// A flag's words: not set, set.
    words: Option<[String; 2]>,
    /// The load on this side of a bus tie: its own switch, the tie, the other side's switch.
    feed: Option<u8>,
    /// The kinds on whose card it stands.
    #[serde(default)]
    card: Vec<String>,
}

static WANTED: LazyLock<Vec<Wanted>> = LazyLock::new(|| {
    serde_json::from_str(include_str!("../../../../web/src/logic/tiles.json")).unwrap_or_default()
});

/// A value as the card shows it.
#[derive(Debug, PartialEq)]
pub(super) struct Tile {
    pub(super) title: &'static str,
    /// The value in words, with its unit; none when it has none.
    pub(super) text: Option<String>,
    pub(super) quality: Quality,
}

fn of_kind(kind: Kind) -> impl Iterator<Item = &'static Wanted> {
    let word = match kind {
        Kind::Genset => "genset",
        Kind::TransferSwitch => "transfer_switch",
        Kind::Compressor => "compressor",
    };
    WANTED.iter().filter(move |wanted| wanted.card.iter().any(|kind| kind == word))
}

/// Every signal that a card of this kind may be filled with.
pub(super) fn signals(kind: Kind) -> Vec<&'static str> {
    of_kind(kind).flat_map(|wanted| &wanted.signals).map(String::as_str).collect()
}

/// What the card of a device shows now.
pub(super) fn tiles(device: &Device) -> Vec<Tile> {
    of_kind(device.site().profile.kind.into()).filter_map(|wanted| wanted.tile(device)).collect()
}

impl Wanted {
    fn tile(&'static self, device: &Device) -> Option<Tile> {
        let (text, quality) = match (self.feed, &self.words) {
            (Some(side), _) => self.feed(device, side)?,
            (None, Some(words)) => {
                let flag = self.signals.iter().find_map(|signal| Flag::find(device, signal))?;
                (flag.set.map(|set| words[usize::from(set)].clone()), flag.quality)
            }
            (None, None) => self.signals.iter().find_map(|signal| value(device, signal))?,
        };
        Some(Tile { title: &self.title, text, quality })
    }

    /// Which source the switches connect a load with.
    fn feed(&self, device: &Device, side: u8) -> Option<(Option<String>, Quality)> {
        let flags: Vec<Flag> =
            self.signals.iter().map(|signal| Flag::find(device, signal)).collect::<Option<_>>()?;
        let [own, tie, other] = flags.as_slice() else { return None };
        let quality = flags.iter().map(|flag| flag.quality).max_by_key(|quality| severity(*quality))?;
        let text = match (own.set, tie.set, other.set) {
            (Some(true), Some(true), Some(true)) => Some("on both sources".to_owned()),
            (Some(true), Some(_), Some(_)) => Some(format!("on source {side}")),
            (Some(false), Some(true), Some(true)) => Some(format!("on source {}", 3_u8.saturating_sub(side))),
            (Some(false), Some(_), Some(_)) => Some("on none".to_owned()),
            _ => None,
        };
        Some((text, quality))
    }
}

/// One bit of a device.
struct Flag {
    /// None while the word it is in has no value.
    set: Option<bool>,
    quality: Quality,
}

impl Flag {
    fn find(device: &Device, signal: &str) -> Option<Self> {
        let points = device.site().profile.points.iter().enumerate();
        let (index, bit) = points
            .flat_map(|(index, point)| point.bits.iter().map(move |bit| (index, bit)))
            .find(|(_, bit)| bit.signal.as_deref() == Some(signal))?;
        let view = device.value(index);
        let set = view.set.as_ref().filter(|_| view.quality != Quality::Invalid);
        Some(Self { set: set.map(|set| set.contains(&bit.bit)), quality: view.quality })
    }
}

/// The value of a signal that one point carries, or several make up.
fn value(device: &Device, signal: &str) -> Option<(Option<String>, Quality)> {
    let profile = device.site().profile;
    if let Some(index) = profile.points.iter().position(|point| point.signal.as_deref() == Some(signal)) {
        let view = device.value(index);
        return Some((text(&view), view.quality));
    }
    let index = profile.joined().iter().position(|joined| joined.signal == signal)?;
    let view = device.joined(index);
    let text = match &view.value {
        PointValue::Number(_) => hours(&view.value),
        PointValue::Text(clock) => Some(clock.replace('T', " ")),
        _ => None,
    };
    Some((text, view.quality))
}

fn text(view: &ValueView) -> Option<String> {
    let unit = view.unit.as_deref().map_or("", unit);
    match &view.value {
        PointValue::None => None,
        // The digits that the API has.
        PointValue::Number(_) => {
            let digits = serde_json::to_string(&view.value).ok()?;
            Some(if unit.is_empty() { digits } else { format!("{digits} {unit}") })
        }
        PointValue::Text(label) => Some(label.clone()),
        PointValue::Labels(labels) => Some(labels.join(", ")),
        PointValue::Numbers(_) => None,
    }
}

/// `1234 h 30 min`.
fn hours(value: &PointValue) -> Option<String> {
    let hours = serde_json::to_value(value).ok()?.as_f64()?;
    // Hours come to four decimals, so that the second they stand for is certain.
    let minutes = ((hours.abs() * 3600.0).round() / 60.0).floor();
    let sign = if hours < 0.0 { "-" } else { "" };
    Some(format!("{sign}{} h {:02} min", (minutes / 60.0).floor(), minutes % 60.0))
}

fn unit(unit: &str) -> &str {
    match unit {
        "degC" => "°C",
        "degF" => "°F",
        "deg" => "°",
        "ohm" => "Ω",
        "kohm" => "kΩ",
        "m3" => "m³",
        "m3/h" => "m³/h",
        other => other,
    }
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
    use busbar_profile::Rate;

    use super::*;
    use crate::site::SiteDevice;
    use crate::testing::{answered, at, site_device, ts};

    fn switch() -> Device {
        let profile = busbar_profile::builtin("smartgen-hat821si").unwrap();
        Device::new(SiteDevice { profile, ..site_device("ats1") }, "w1".to_owned())
    }

    #[test]
    fn every_kind_has_a_card_of_signals_that_there_are() {
        for kind in [Kind::Genset, Kind::TransferSwitch, Kind::Compressor] {
            let signals = signals(kind);
            assert!(signals.len() > 5, "{kind:?}");
            for signal in signals {
                assert!(busbar_profile::vocabulary::vocabulary().signal(signal).is_some(), "{signal}");
            }
        }
        for wanted in WANTED.iter() {
            assert_eq!(wanted.feed.is_some(), wanted.signals.len() == 3, "{}", wanted.title);
        }
    }

    #[test]
    fn what_was_not_read_has_no_words() {
        let tiles = tiles(&switch());
        assert!(tiles.iter().any(|tile| tile.title == "Load side 1"), "{tiles:?}");
        assert!(tiles.iter().all(|tile| tile.quality == Quality::Stale && tile.text.is_none()), "{tiles:?}");
    }

    #[test]
    fn a_load_is_on_the_source_that_its_switches_connect() {
        let points = &switch().site().profile.points;
        let signals = ["breaker.src1.closed", "breaker.tie.closed", "breaker.src2.closed"];
        let [own, tie, other] = signals.map(|signal| {
            let (point, bit) = points
                .iter()
                .flat_map(|point| point.bits.iter().map(move |bit| (point, bit)))
                .find(|(_, bit)| bit.signal.as_deref() == Some(signal))
                .unwrap();
            (point.address, bit.bit)
        });
        for (closed, one, two) in [
            (&[own][..], "on source 1", "on none"),
            (&[own, tie], "on source 1", "on source 1"),
            (&[other, tie], "on source 2", "on source 2"),
            (&[own, other], "on source 1", "on source 2"),
            (&[own, tie, other], "on both sources", "on both sources"),
            (&[tie], "on none", "on none"),
        ] {
            let mut device = switch();
            let answers: Vec<(u16, Vec<u16>)> = points
                .iter()
                .filter(|point| [own, tie, other].iter().any(|(address, _)| *address == point.address))
                .map(|point| {
                    let mut registers = vec![0; usize::from(point.registers)];
                    for (address, bit) in closed {
                        if *address == point.address {
                            registers[usize::from(bit / 16)] |= 1 << (bit % 16);
                        }
                    }
                    (point.address, registers)
                })
                .collect();
            let answers: Vec<(u16, &[u16])> = answers.iter().map(|(a, r)| (*a, r.as_slice())).collect();
            device.finish(answered(Rate::Fast, &answers), at(0), ts(0));
            let tiles = tiles(&device);
            let text = |title| tiles.iter().find(|tile| tile.title == title).unwrap().text.clone().unwrap();
            assert_eq!((text("Load side 1"), text("Load side 2")), (one.to_owned(), two.to_owned()));
        }
    }

    #[test]
    fn joined_hours_are_told_as_a_counter_has_them() {
        let profile = busbar_profile::builtin("smartgen-acc1700").unwrap();
        let mut device = Device::new(SiteDevice { profile, ..site_device("air1") }, "w1".to_owned());
        device.finish(answered(Rate::Slow, &[(101, &[1234, 30, 59])]), at(0), ts(0));
        let tiles = tiles(&device);
        let hours = tiles.iter().find(|tile| tile.title == "Engine hours").unwrap();
        assert_eq!((hours.text.as_deref(), hours.quality), (Some("1234 h 30 min"), Quality::Good));
    }
}
